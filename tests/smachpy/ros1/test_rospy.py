"""Behaviour of rospy that programs rely on, compared with the original of Debian's packages."""

import warnings

import pytest

from actionlib_core.node import get_node
from smachpy import ros1
from smachpy.ros1 import session
from smachpy.ros1.session import Session
from smachpy.testing import MissionKit

WORDS = ["_a/b:=3", "_c-d:= [1, x]", "_empty:=", "__log:=x", "_1:=true"]


@pytest.fixture
def rospy(tmp_path):
    """rospy on a network in memory, for a program with the arguments `WORDS`."""
    made = Session(["script.py", *WORDS], make_node=lambda _name: get_node())
    with ros1.installed(tmp_path / "script.py"), MissionKit():
        import rospy

        session.begin(made)
        yield rospy
        session.end(made)


@pytest.fixture
def grip(rospy):
    from std_srvs.srv import SetBool

    return rospy.Service("grip", SetBool, lambda request: (request.data, ""))


def test_resolved_names_have_a_slash_in_front(rospy, grip):
    from std_msgs.msg import Empty
    from std_srvs.srv import SetBool

    proxy = rospy.ServiceProxy("grip", SetBool)
    assert grip.resolved_name == proxy.resolved_name == "/grip"
    publisher = rospy.Publisher("news", Empty, queue_size=1)
    assert publisher.resolved_name == publisher.name == "/news"
    for kind in (Empty, rospy.AnyMsg):
        assert rospy.Subscriber("news", kind).resolved_name == "/news"


def test_a_proxy_that_was_closed_calls_again(rospy, grip):
    from std_srvs.srv import SetBool

    proxy = rospy.ServiceProxy("grip", SetBool)
    proxy.close()
    assert proxy(True).success


def test_a_service_of_another_type_is_a_service_exception(rospy, grip):
    from std_srvs.srv import Trigger

    with pytest.raises(rospy.ServiceException, match="types differ"):
        rospy.ServiceProxy("grip", Trigger)()


def test_private_parameters_of_the_command_line(rospy):
    rospy.init_node("script")
    assert rospy.get_param("~") == {"a": {"b": 3}, "c-d": [1, "x"], "1": True}


def test_log_messages_are_formatted_as_logging_does(rospy, capsys):
    rospy.loginfo("%(what)s at %(speed).1f", {"what": "base", "speed": 2})
    rospy.loginfo("%s", {})
    rospy.loginfo("%(what)s", {"speed": 2})
    assert [line.partition(": ")[2] for line in capsys.readouterr().out.splitlines()] == [
        "base at 2.0",
        "{}",
        "%(what)s {'speed': 2}",
    ]


def test_published_headers_are_numbered(rospy):
    import smach
    from geometry_msgs.msg import PoseStamped

    heard = []
    rospy.Subscriber("pose", PoseStamped, lambda pose: heard.append(pose.header.seq))
    publisher = rospy.Publisher("pose", PoseStamped, queue_size=1)

    def publish(userdata):
        publisher.publish(userdata.pose)
        publisher.publish(pose=userdata.pose.pose)
        return "done"

    sm = smach.StateMachine(["done"])
    sm.userdata.pose = PoseStamped()
    sm.add("PUBLISH", smach.CBState(publish, outcomes=["done"], input_keys=["pose"]))
    rospy.init_node("numbers")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sm.execute()
    rospy.sleep(0.1)
    assert heard == [1, 2]
