"""Behaviour of rospy that programs rely on, compared with the original of Debian's packages."""

import warnings

import pytest

from actionlib_core.clock import current_clock, use_clock
from actionlib_core.node import get_node
from smachpy import ros1
from smachpy.ros1 import session
from smachpy.ros1.session import Session
from smachpy.testing import MissionKit
from tests.wall_clock import Computer

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


def test_a_later_program_logs_once_again(rospy, capsys):
    """What one program of a process had logged, the next one did not."""
    for _ in range(2):
        made = Session(["script.py"])
        session.begin(made)
        for _ in range(2):
            rospy.loginfo_once("once")
            rospy.loginfo_throttle(10.0, "throttled")
            rospy.loginfo_throttle_identical(10.0, "identical")
        session.end(made)
    words = [line.rpartition(" ")[2] for line in capsys.readouterr().out.splitlines()]
    assert words == ["once", "throttled", "identical"] * 2


@pytest.mark.parametrize("step", [-3600.0, -0.05, 3600.0])
def test_a_rate_goes_on_when_the_clock_is_set(rospy, step):
    """It slept for an hour after the clock had been set back by one."""
    clock = current_clock()
    computer = Computer(clock)
    with use_clock(computer):
        rate = rospy.Rate(10)
        rate.sleep()
        computer.ahead = step
        before = clock.now()
        for _ in range(3):
            rate.sleep()
    assert clock.now() - before <= 0.41


def test_a_client_of_dynamic_reconfigure_converts_values_to_the_types_of_the_node(tmp_path):
    """The node ignored them without a word, such as 1 for a float."""
    made = Session(["script.py"], make_node=lambda _name: get_node())
    with ros1.installed(tmp_path / "script.py"), MissionKit() as mission:
        from dynamic_reconfigure.client import Client

        session.begin(made)
        node = mission.ros1_node("planner", {"speed": 0.5, "samples": 3, "on": False, "frame": "a"})
        client = Client("planner", timeout=5)
        wanted = {"speed": 1, "samples": 4.0, "on": "true", "frame": 7, "groups": {}}
        assert client.update_configuration(wanted) == node.parameters
        assert repr(node.parameters["speed"]) == "1.0"
        assert node.changes == [{"speed": 1.0, "samples": 4, "on": True, "frame": "7"}]
        for change, problem in (({"sped": 1.0}, "don't know"), ({"speed": "fast"}, "can't set")):
            with pytest.raises(Exception, match=problem):
                client.update_configuration(change)
        session.end(made)


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


def raised(function, *args):
    """Return the exception of a call."""
    with pytest.raises(Exception) as caught:
        function(*args)
    return caught.value


def test_texts_begin_as_rospys_because_programs_look_for_them(rospy):
    from std_msgs.msg import Empty
    from std_srvs.srv import SetBool, Trigger

    def refuse(_request):
        raise ValueError("no power")

    rospy.init_node("texts")
    late = raised(rospy.wait_for_message, "start", Empty, 0.5)
    assert isinstance(late, rospy.ROSException)
    assert str(late).startswith("timeout exceeded while waiting for message on topic start")
    late = raised(rospy.wait_for_message, "start", rospy.AnyMsg, 0.5)
    assert str(late).startswith("timeout exceeded while waiting for message on topic start")
    late = raised(rospy.wait_for_service, "grip", 0.5)
    assert str(late).startswith("timeout exceeded while waiting for service /grip")
    absent = raised(rospy.ServiceProxy("grip", SetBool), True)
    assert isinstance(absent, rospy.ServiceException)
    assert str(absent).startswith("service [/grip] unavailable")
    rospy.Service("open", Trigger, refuse)
    failed = raised(rospy.ServiceProxy("open", Trigger))
    begin = "service [/open] responded with an error: error processing request: "
    assert str(failed) == f"{begin}no power"
    again = raised(rospy.init_node, "other")
    assert str(again).startswith("rospy.init_node() has already been called with different arg")


def test_texts_of_tf_name_the_argument_as_tf2s(rospy):
    import tf2_ros

    rospy.init_node("texts")
    buffer = tf2_ros.Buffer()
    unknown = raised(buffer.lookup_transform, "map", "base", rospy.Time(0))
    assert str(unknown) == '"map" passed to lookupTransform argument target_frame does not exist.'


def test_private_names_of_smach_are_live(tmp_path):
    import smachpy

    class Pair(smachpy.Container):
        def __init__(self):
            super().__init__(["ok"], ["a", "lost"], ["b"])

        def execute(self, parent_ud):
            self._copy_input_keys(parent_ud, self.userdata)
            self.userdata.b = self.userdata.a
            self._copy_output_keys(self.userdata, parent_ud)
            return "ok"

    with ros1.installed(tmp_path / "script.py"):
        state = smachpy.CBState(print, outcomes=["a", "b"], input_keys=["in"])
        state._outcomes.add("c")
        state._outcomes.discard("a")
        state._outcomes |= {"d"}
        state._input_keys = ["x", "y"]
        assert state.get_registered_outcomes() == ("b", "c", "d")
        assert state._outcomes == {"b", "c", "d"}
        assert state.get_registered_input_keys() == ("x", "y")
        ud = smachpy.UserData()
        ud.a = 3
        assert Pair().execute(ud) == "ok"
        assert ud.b == 3
    assert not hasattr(Pair, "_copy_input_keys")
    assert state._outcomes == {"b", "c", "d"}
