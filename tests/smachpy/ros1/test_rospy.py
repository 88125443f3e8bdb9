"""Behaviour of rospy that programs rely on, compared with the original of Debian's packages."""

import pytest

from actionlib_core.node import get_node
from smachpy import ros1
from smachpy.ros1 import session
from smachpy.ros1.session import Session
from smachpy.testing import MissionKit


@pytest.fixture
def rospy(tmp_path):
    """rospy on a network in memory."""
    with ros1.installed(tmp_path / "script.py"), MissionKit():
        import rospy

        yield rospy


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
    words = ["_a/b:=3", "_c-d:= [1, x]", "_empty:=", "__log:=x", "_1:=true"]
    made = Session(["script.py", *words], make_node=lambda _name: get_node())
    session.begin(made)
    try:
        rospy.init_node("script")
        names = rospy.get_param("~")
    finally:
        session.end(made)
    assert names == {"a": {"b": 3}, "c-d": [1, "x"], "1": True}


def test_log_messages_are_formatted_as_logging_does(rospy, capsys):
    rospy.loginfo("%(what)s at %(speed).1f", {"what": "base", "speed": 2})
    rospy.loginfo("%s", {})
    rospy.loginfo("%(what)s", {"speed": 2})
    assert [line.partition(": ")[2] for line in capsys.readouterr().out.splitlines()] == [
        "base at 2.0",
        "{}",
        "%(what)s {'speed': 2}",
    ]
