"""Topics and services between our network and a real ROS 1, both ways."""

from __future__ import annotations

import pytest

from actionlib_core import Publisher, Service, ServiceException, ServiceProxy, Subscriber
from actionlib_core.cli import main
from actionlib_core.exceptions import InterfaceError, ServiceUnavailableError
from actionlib_core.interfaces import get_message
from actionlib_core.interfaces.std_msgs.msg import Int32, String
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.pubsub.topic import FreshSubscriber
from actionlib_core.ros1 import topics as bridged_topics
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.definitions import ask_definition, define, split_definition
from actionlib_core.wire.presence import list_endpoints

pytestmark = [pytest.mark.ros1, pytest.mark.zenoh]

WAIT_S = 60.0


class Heard:
    """Messages of a topic, with a wait for them."""

    def __init__(self, name, node, count):
        self.texts = []
        self._count = count
        self._all = node.clock.event()
        self.subscriber = Subscriber(name, String, self._hear)

    def _hear(self, message):
        self.texts.append(message.data)
        if len(self.texts) >= self._count:
            self._all.set()

    def wait(self):
        assert self._all.wait(WAIT_S)
        return self.texts


def test_a_topic_of_ros_arrives_here_in_order(ros, bridge, node):
    topics = ros.start("topics", "talker")
    topics.ask("advertise /chatter plain")
    bridge(topics=["/chatter"], namespace="robot_1")
    heard = Heard("robot_1/chatter", node, 100)
    assert heard.subscriber.wait_for_connections(1, WAIT_S)
    name = "robot_1/chatter"
    (end,) = list_endpoints(node.transport, kind=Kind.PUBLISHER, name=name, timeout=WAIT_S)
    assert (end.node, end.type, end.md5) == ("robot_1/talker", String._type, String._md5sum)
    assert topics.ask("connections /chatter") == "1"  # rospy counts it after it has said so
    for number in range(100):
        topics.ask(f"publish /chatter {number}")
    assert heard.wait() == [str(number) for number in range(100)]


def test_latched_messages_arrive_late_both_ways(ros, bridge, node):
    topics = ros.start("topics", "latcher")
    topics.ask("advertise /map latch")
    topics.ask("publish /map office")
    bridge(topics=["/map", "/plan"])
    assert Heard("map", node, 1).wait() == ["office"]
    with Publisher("plan", String, latch=True) as plan:
        plan.publish("there")
        topics.ask("subscribe /plan")
        assert topics.ask("heard /plan 1") == "there"


def test_what_was_latched_in_ros_is_no_news(ros, bridge, node, monkeypatch):
    """An answer of yesterday on a latched topic answered the next question of `AskOperator`."""
    monkeypatch.setattr(bridged_topics, "LATCHED_S", WAIT_S)  # also on a busy computer
    old, new = (ros.start("topics", name) for name in ("old", "new"))
    old.ask("advertise /answer latch")
    old.ask("publish /answer yesterday")
    bridge(topics=["/answer"])
    texts, came = [], node.clock.event()

    def hear(message):
        texts.append(message.data)
        came.set()

    with FreshSubscriber("answer", String, hear) as fresh:
        assert fresh.wait_for_connections(1, WAIT_S)
        assert Heard("answer", node, 1).wait() == ["yesterday"]  # kept for everybody else
        new.ask("advertise /answer latch")
        new.ask("publish /answer now")  # `rostopic pub` latches
        assert came.wait(WAIT_S)
        assert texts == ["now"]


def test_each_of_several_latched_publishers_is_heard_late(ros, bridge, node):
    for number in (1, 2):
        topics = ros.start("topics", f"static_{number}")
        topics.ask("advertise /tf_static latch")
        topics.ask(f"publish /tf_static {number}")
    bridge(topics=["/tf_static"])
    with Subscriber("tf_static", String, lambda message: None) as first:
        assert first.wait_for_connections(2, WAIT_S)
    assert sorted(Heard("tf_static", node, 2).wait()) == ["1", "2"]


def test_two_robots_are_two_name_spaces(ros, own_ros, bridge, node):
    for number, system in ((1, ros), (2, own_ros)):
        topics = system.start("topics", "lidar")
        topics.ask("advertise /scan latch")
        topics.ask(f"publish /scan {number}")
        bridge(master=system.uri, topics=["/scan"], namespace=f"robot_{number}")
    assert Heard("robot_1/scan", node, 1).wait() == ["1"]
    assert Heard("robot_2/scan", node, 1).wait() == ["2"]


def test_what_is_used_here_is_carried_and_ros_subscribers_are_counted(ros, bridge, node):
    topics = ros.start("topics", "driver")
    topics.ask("subscribe /cmd")
    bridge(used=True)
    with Publisher("cmd", String) as publisher:
        assert publisher.wait_for_connections(1, WAIT_S)
        for number in range(100):
            publisher.publish(str(number))
        wanted = " ".join(str(number) for number in range(100))
        assert topics.ask("heard /cmd 100") == wanted


def test_a_type_that_is_another_one_here_is_told(ros, bridge, node):
    topics = ros.start("topics", "other")
    topics.ask("advertise /typed plain")
    bridge(topics=["/typed"])
    with Subscriber("typed", Int32, lambda message: None) as subscriber:
        assert subscriber._ends.wait(lambda: bool(subscriber.mismatches), WAIT_S)
        (error,) = subscriber.mismatches
        assert (error.found_type, error.found_md5) == (String._type, String._md5sum)


def test_the_definition_of_a_type_can_be_asked_for(ros, bridge, node):
    topics = ros.start("topics", "definer")
    topics.ask("advertise /defined plain")
    bridge(topics=["/defined"])
    heard = Heard("defined", node, 1)
    assert heard.subscriber.wait_for_connections(1, WAIT_S)
    text = ask_definition(node, String._type, String._md5sum)
    assert list(split_definition(String._type, text)) == [String._type]
    assert define(String._type, String._md5sum, text) is String
    assert ask_definition(node, "nobody/Has", "0") is None


def test_a_type_that_nobody_here_knows_is_passed_on_and_printed(ros, bridge, node, capsys):
    topics = ros.start("topics", "stranger")
    topics.ask("advertise_logger /unknown")
    bridge(used=True, topics=["/unknown"])
    with pytest.raises(InterfaceError):
        get_message("roscpp/Logger")
    assert main(["topic", "echo", "/unknown", "--once", "--timeout", "40"], node=node) == 0
    assert 'level: "info"' in capsys.readouterr().out


def test_services_of_ros_answer_here_and_raise_here(ros, bridge, node):
    ros.start("services", "/ros_switch")
    bridge(services=["ros_switch"])
    proxy = ServiceProxy("ros_switch", SetBool)
    proxy.wait_for_service(WAIT_S)
    for _ in range(20):
        assert proxy(True).message == "by ROS 1"
    with pytest.raises(ServiceException) as error:
        proxy(False)
    assert "not that way" in error.value.remote_text


def test_a_killed_service_of_ros_is_gone(ros, bridge, node):
    program = ros.start("services", "/dying")
    bridge(services=["dying"])
    proxy = ServiceProxy("dying", SetBool, timeout=1.0)
    proxy.wait_for_service(WAIT_S)
    program.end()
    assert proxy._ends.wait(lambda: not proxy._ends.ends(), WAIT_S)
    with pytest.raises(ServiceUnavailableError):
        proxy(True)


def test_our_services_answer_in_ros_and_raise_there(ros, bridge, node):
    def handle(request):
        if not request.data:
            raise ValueError("no, thanks")
        return True, "by us"

    with Service("our_switch", SetBool, handle):
        bridge(used=True)
        program = ros.start("services", "/unused")
        assert program.ask("/our_switch True") == "True by us"
        answer = program.ask("/our_switch False")
        assert answer.startswith("error")
        assert "no, thanks" in answer
        assert program.ask("/our_switch persistent") == "True by us True by us"
