"""Topics and services of ROS 2 through the public classes, on every transport."""

from __future__ import annotations

import contextlib
import threading

import pytest
import zenoh

from actionlib_core.clock import RealClock
from actionlib_core.config import Config, Mapped, Ros2
from actionlib_core.exceptions import (
    ConfigError,
    ServiceConflictError,
    ServiceException,
    ServiceUnavailableError,
    TypeMismatchError,
    WaitTimeoutError,
)
from actionlib_core.interfaces import nav_msgs, std_msgs
from actionlib_core.interfaces.ros2.nav_msgs.msg import OccupancyGrid, Odometry
from actionlib_core.interfaces.ros2.sensor_msgs.msg import LaserScan
from actionlib_core.interfaces.ros2.std_msgs.msg import Int32, String
from actionlib_core.interfaces.ros2.std_srvs.srv import SetBool, Trigger
from actionlib_core.interfaces.std_srvs.srv import SetBool as SetBool1
from actionlib_core.node import Node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.service_proxy import ServiceProxy, wait_for_service
from actionlib_core.pubsub.topic import Publisher, Subscriber, wait_for_message
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.ros2.attachment import Numbering, unpack_attachment
from actionlib_core.wire.ros2.end_port import list_any_type
from actionlib_core.wire.ros2.graph import RosEnd, RosNode, RosType
from actionlib_core.wire.ros2.names import DEFAULT, LATCHED, Kind, data_key
from tests.transports import TRANSPORTS, opened

WAIT_S = 60.0


class World:
    """Two nodes on one network of ROS 2, and sessions that only know the wire."""

    def __init__(self, clock, open_session):
        self.clock = clock
        self._open = open_session
        self.left = contextlib.ExitStack()
        self.robot = self.node("robot")
        self.mission = self.node("mission")

    def node(self, name, **settings):
        config = Config(ros2=(Ros2(**settings),))
        node = Node(name, transport=self.session(), clock=self.clock, config=config)
        self.left.callback(node.close)
        return node

    def tokens(self, kind, name):
        """Return the tokens of a kind and name, once there is one."""
        looker = RosNode(self.session(), self.clock, domain=0, full_name="looker")
        seen = self.inbox()
        watch = looker.watch(lambda token, *_: seen(token), kind=kind, name=name)
        seen.wait_for(1)
        watch.close()
        return seen.items

    def session(self):
        session = self._open()
        self.left.callback(session.close)
        return session

    def inbox(self):
        return Inbox(self.clock)


class Inbox:
    def __init__(self, clock):
        self.clock, self.items, self._news = clock, [], clock.event()

    def __call__(self, item):
        self.items.append(item)
        self._news.set()

    def wait_for(self, count):
        deadline = self.clock.now() + WAIT_S
        while len(self.items) < count:
            self._news.clear()
            if len(self.items) < count:
                assert self._news.wait(deadline - self.clock.now()), self.items
        return self.items


@pytest.fixture(params=TRANSPORTS)
def world(request):
    with opened(request.param, seed=5) as (clock, open_session):
        made = World(clock, open_session)
        with made.left:
            yield made


# -- topics ----------------------------------------------------------------------------------------


def test_messages_arrive_in_order(world):
    heard = world.inbox()
    subscriber = Subscriber("chatter", String, heard, node=world.mission)
    publisher = Publisher("/chatter", String, node=world.robot)
    assert publisher.wait_for_connections(timeout=WAIT_S)
    assert subscriber.wait_for_connections(timeout=WAIT_S)
    for number in range(50):
        publisher.publish(f"line {number}")
        heard.wait_for(number - 8)  # more at a time may be dropped
    assert [message.data for message in heard.wait_for(50)] == [f"line {n}" for n in range(50)]
    assert isinstance(heard.items[0], String)


def test_message_on_the_wire_is_what_a_ros_2_node_expects(world):
    seen = world.inbox()
    key = data_key(0, "robot1/chatter", "std_msgs/msg/String", String._rihs01)
    looker = world.session()
    looker.subscribe(key, seen)
    publisher = Publisher("chatter", String, node=world.node("talker", namespace="robot1"))
    tokens = world.inbox()
    looker.watch_alive("@ros2_lv/0/*/*/*/MP/**", tokens)
    tokens.wait_for(1)
    publisher.publish("a")
    publisher.publish("bc")
    first, second = seen.wait_for(2)
    assert (first.payload, first.encoding) == (bytes.fromhex("00010000 02000000 6100"), "")
    numbers = [unpack_attachment(sample.attachment) for sample in (first, second)]
    assert [number.sequence for number in numbers] == [1, 2]
    assert numbers[0].gid == numbers[1].gid


def test_messages_of_several_threads_are_sent_in_the_order_of_their_numbers(monkeypatch):
    clock = RealClock()
    network = MemoryNetwork(clock)
    seen = Inbox(clock)
    key = data_key(0, "chatter", "std_msgs/msg/String", String._rihs01)
    network.session().subscribe(key, seen)
    with Node("talker", transport=network.session(), clock=clock) as node:
        publisher = Publisher("chatter", String, node=node)
        other = threading.Thread(target=publisher.publish, args=("second",))
        take = RosEnd.attachment

        def slowly(end):
            taken = take(end)
            if other.ident is None:
                other.start()
                other.join(0.2)  # it would send its message now, if it did not have to wait
            return taken

        monkeypatch.setattr(RosEnd, "attachment", slowly)
        publisher.publish("first")
        other.join(WAIT_S)
        samples = seen.wait_for(2)
    assert [unpack_attachment(sample.attachment).sequence for sample in samples] == [1, 2]


def test_a_message_published_by_a_signal_handler_during_another_one(world, monkeypatch):
    seen = world.inbox()
    Subscriber("chatter", String, seen, node=world.mission)
    publisher = Publisher("chatter", String, node=world.robot)
    assert publisher.wait_for_connections(timeout=WAIT_S)
    take, handled = RosEnd.attachment, []

    def interrupted(end):
        if not handled:
            handled.append(True)
            publisher.publish("from the handler")
        return take(end)

    monkeypatch.setattr(RosEnd, "attachment", interrupted)
    publisher.publish("first")
    words = [message.data for message in seen.wait_for(2)]
    assert words == ["from the handler", "first"]


@pytest.mark.zenoh
@pytest.mark.parametrize("latch", [False, True])
def test_suspended_subscriber_holds_nothing_up(robot, latch):
    """Zenoh drops such messages for a link without room; it waits for others, at each router."""
    seen, arrived = [], robot.clock.event()

    def on_sample(sample):
        seen.append(sample)
        arrived.set()

    key = data_key(42, "chatter", "std_msgs/msg/String", String._rihs01)
    looker = robot.session().session.declare_subscriber(key, on_sample)
    publisher = Publisher("chatter", String, latch=latch, node=robot.node())
    for _ in range(400):
        publisher.publish("a")  # what is sent before the two have met is lost
        if arrived.wait(0.05):
            break
    looker.undeclare()
    assert seen[0].congestion_control == zenoh.CongestionControl.DROP
    assert (seen[0].priority, seen[0].express) == (zenoh.Priority.DATA, False)
    assert seen[0].timestamp is not None


def test_latched_message_reaches_who_comes_later(world):
    # Until two sessions know one another, Zenoh sends what nobody there has subscribed to yet.
    linked = Subscriber("linked", String, world.inbox(), node=world.mission)
    assert Publisher("linked", String, node=world.robot).wait_for_connections(timeout=WAIT_S)
    publisher = Publisher("map", OccupancyGrid, latch=True, node=world.robot)
    for width in (1, 2, 3):
        grid = OccupancyGrid()
        grid.info.width = width
        publisher.publish(grid)
    assert wait_for_message("map", OccupancyGrid, WAIT_S, node=world.mission).info.width == 3
    late = world.inbox()
    Subscriber("map", OccupancyGrid, late, node=world.mission)
    late.wait_for(1)
    grid.info.width = 4
    publisher.publish(grid)
    assert [message.info.width for message in late.wait_for(2)] == [3, 4]
    linked.unregister()
    (token,) = world.tokens(Kind.PUBLISHER, "map")
    assert token.qos == LATCHED


def test_ends_show_themselves_and_go(world):
    looker = RosNode(world.session(), world.clock, domain=0, full_name="looker")
    seen = world.inbox()
    watch = looker.watch(lambda token, _, alive: seen((token.kind, alive)), name="scan")
    subscriber = Subscriber("scan", LaserScan, print, node=world.mission)
    seen.wait_for(1)
    (token,) = world.tokens(Kind.SUBSCRIPTION, "scan")
    assert (token.kind, token.node, token.type) == (
        Kind.SUBSCRIPTION, "mission", "sensor_msgs/msg/LaserScan",
    )  # fmt: skip
    assert token.qos == DEFAULT
    subscriber.unregister()
    assert seen.wait_for(2) == [(Kind.SUBSCRIPTION, True), (Kind.SUBSCRIPTION, False)]
    watch.close()


def test_other_type_on_a_topic_is_told_with_both_hashes(world):
    publisher = Publisher("level", Int32, node=world.robot)
    with pytest.raises(TypeMismatchError) as caught:
        wait_for_message("level", String, WAIT_S, node=world.mission)
    for text in ("std_msgs/msg/String", "std_msgs/msg/Int32", String._rihs01, Int32._rihs01):
        assert text in str(caught.value)
    publisher.unregister()


def test_broken_message_is_logged_once_and_the_next_one_comes(world, monkeypatch, caplog):
    raised = []
    monkeypatch.setattr(threading, "excepthook", lambda args: raised.append(args.exc_value))
    heard = world.inbox()
    subscriber = Subscriber("chatter", String, heard, node=world.mission)
    key = data_key(0, "chatter", "std_msgs/msg/String", String._rihs01)
    stranger = world.robot.transport.publisher(key)
    publisher = Publisher("chatter", String, node=world.robot)
    assert subscriber.wait_for_connections(timeout=WAIT_S)
    assert publisher.wait_for_connections(timeout=WAIT_S)
    for payload in (b"", b"\x00\x01\x00\x00\xff\xff\xff\xff", bytes(3)):
        stranger.put(payload, bytes(33))
    last = String("seen").to_cdr()
    stranger.put(last, bytes(33))
    heard.wait_for(1)  # those before it have arrived too
    publisher.publish("fine")
    assert [message.data for message in heard.wait_for(2)] == ["seen", "fine"]
    (record,) = (r for r in caplog.records if "cannot be read" in r.getMessage())
    assert record.getMessage().startswith("topic /chatter: a message cannot be read")
    assert "std_msgs/msg/String: got 0 bytes" in record.getMessage()
    assert raised == []


def test_topic_with_a_ros_1_type_goes_to_ros_2_where_the_configuration_names_it(world):
    node = world.node("old", names=("chatter",))
    heard, back = world.inbox(), world.inbox()
    Subscriber("chatter", String, heard, node=world.robot)
    Subscriber("other", std_msgs.msg.String, back, node=node)
    publisher = Publisher("chatter", std_msgs.msg.String, node=node)
    assert publisher.wait_for_connections(timeout=WAIT_S)
    publisher.publish("from ROS 1")
    assert [message.data for message in heard.wait_for(1)] == ["from ROS 1"]
    assert isinstance(heard.items[0], String)
    assert back.items == []


def test_message_with_a_time_that_the_ros_1_type_cannot_hold_is_dropped(world, caplog):
    node = world.node("old", names=("odom",))
    heard = world.inbox()
    Subscriber("odom", nav_msgs.msg.Odometry, heard, node=node)
    publisher = Publisher("odom", Odometry, node=world.robot)
    assert publisher.wait_for_connections(timeout=WAIT_S)
    message = Odometry()
    message.header.stamp.sec = -1
    publisher.publish(message)
    publisher.publish(Odometry(child_frame_id="base_link"))
    assert [message.child_frame_id for message in heard.wait_for(1)] == ["base_link"]
    assert any("topic /odom" in r.getMessage() and "-1 s" in r.getMessage() for r in caplog.records)


# -- services --------------------------------------------------------------------------------------


def test_service_is_called_and_answers(world):
    service = Service("flag", SetBool, lambda request: (request.data, "done"), node=world.robot)
    proxy = ServiceProxy("flag", SetBool, node=world.mission)
    proxy.wait_for_service(WAIT_S)
    answer = proxy(data=True)
    assert (answer.success, answer.message) == (True, "done")
    assert proxy(False).success is False
    assert isinstance(answer, SetBool.Response)
    service.close()


@pytest.mark.parametrize(("settings", "name"), [
    (None, "flag"),
    ({}, "flag"),
    ({"robot": "red"}, "red/flag"),
    ({"map": (Mapped("lamp", service="flag"),)}, "lamp"),
])  # fmt: skip
def test_waiting_for_a_service_by_its_name_finds_it_on_ros_2(world, settings, name):
    service = Service("flag", SetBool, lambda request: (True, ""), node=world.robot)
    if settings is None:  # a program without a configured robot, in the same network
        node = Node("other", transport=world.session(), clock=world.clock)
        world.left.callback(node.close)
    else:
        node = world.node("other", **settings)
    wait_for_service(name, WAIT_S, node=node)
    service.close()


def test_waiting_for_a_service_with_a_name_of_no_robot_looks_on_our_own_wire(world):
    config = Config(ros2=(Ros2(robot="red"), Ros2(robot="blue")))
    node = Node("other", transport=world.session(), clock=world.clock, config=config)
    world.left.callback(node.close)
    service = Service("flag", SetBool1, lambda request: (True, ""), node=node)
    wait_for_service("flag", WAIT_S, node=node)
    service.close()


def test_requests_are_numbered_by_the_client_whatever_proxies_there_are(world):
    session, seen = world.session(), world.inbox()
    key = data_key(0, "flag", "std_srvs/srv/SetBool", SetBool._rihs01)
    token = RosNode(session, world.clock, domain=0, full_name="robot2")
    end = token.end(Kind.SERVICE, "flag", RosType("std_srvs/srv/SetBool", SetBool._rihs01))

    def answer(query):
        seen(unpack_attachment(query.attachment))
        query.reply(SetBool.Response(success=True).to_cdr(), attachment=query.attachment)
        query.finish()

    session.queryable(key, answer, complete=True)
    end.show()
    for _ in range(3):
        proxy = ServiceProxy("flag", SetBool, node=world.mission)
        proxy.wait_for_service(WAIT_S)
        proxy(True)
    assert [attachment.sequence for attachment in seen.items] == [1, 2, 3]
    assert len({attachment.gid for attachment in seen.items}) == 1
    assert [token.node for token in world.tokens(Kind.CLIENT, "flag")] == ["mission"]
    end.close()


@pytest.mark.parametrize("attachment", [None, b"", bytes(32), b"\xff" * 33])
def test_request_that_would_kill_a_real_node_is_dropped_without_harm(world, attachment):
    service = Service("go", Trigger, lambda _: (True, "gone"), node=world.robot)
    proxy = ServiceProxy("go", Trigger, node=world.mission)
    proxy.wait_for_service(WAIT_S)
    replies, done = world.inbox(), world.inbox()
    key = data_key(0, "go", "std_srvs/srv/Trigger", Trigger._rihs01)
    world.mission.transport.query(
        key,
        Trigger.Request().to_cdr(),
        attachment=attachment,
        timeout=WAIT_S,
        on_reply=replies,
        on_done=lambda: done("done"),
    )
    done.wait_for(1)
    assert replies.items == []
    assert proxy().message == "gone"
    service.close()


def test_request_that_cannot_be_read_is_told_and_logged_once(world, caplog):
    service = Service("flag", SetBool, pytest.fail, node=world.robot)
    key = data_key(0, "flag", "std_srvs/srv/SetBool", SetBool._rihs01)
    proxy = ServiceProxy("flag", SetBool, node=world.mission)
    proxy.wait_for_service(WAIT_S)
    for payload in (b"", b"\0\1\0\0"):
        replies = world.inbox()
        attachment = Numbering(bytes(16)).take(1)[1]
        world.mission.transport.query(
            key, payload, attachment=attachment, timeout=WAIT_S, on_reply=replies, on_done=list
        )
        (reply,) = replies.wait_for(1)
        assert reply.error
        assert b"the request cannot be read: std_srvs/srv/SetBool_Request: got" in reply.payload
    (record,) = (r for r in caplog.records if "cannot be read" in r.getMessage())
    assert record.getMessage().startswith("service /flag: a request cannot be read: std_srvs")
    with pytest.raises(ServiceException, match="/flag: the server answered with an error: the re"):
        proxy._read(replies.items[0])
    service.close()


def test_handler_that_raises_is_told(world):
    def handler(request):
        raise RuntimeError("no power")

    service = Service("go", Trigger, handler, node=world.robot)
    proxy = ServiceProxy("go", Trigger, node=world.mission)
    proxy.wait_for_service(WAIT_S)
    with pytest.raises(ServiceException) as caught:
        proxy()
    assert caught.value.remote_text == "no power"
    service.close()


@pytest.mark.parametrize("cut", [0, 4, -1])
def test_response_that_cannot_be_read_is_a_failed_call(world, cut):
    session = world.session()
    server = RosNode(session, world.clock, domain=0, full_name="robot2")
    end = server.end(Kind.SERVICE, "flag", RosType("std_srvs/srv/SetBool", SetBool._rihs01))

    def answer(query):
        query.reply(SetBool.Response(message="on").to_cdr()[:cut], attachment=query.attachment)
        query.finish()

    session.queryable(end.key, answer, complete=True)
    end.show()
    proxy = ServiceProxy("flag", SetBool, node=world.mission)
    proxy.wait_for_service(WAIT_S)
    with pytest.raises(ServiceException, match="the response cannot be read: std_srvs/srv/SetB"):
        proxy(True)
    end.close()


def test_second_service_of_a_name_is_refused(world):
    service = Service("go", Trigger, lambda _: (True, "1"), node=world.robot)
    ServiceProxy("go", Trigger, node=world.mission).wait_for_service(WAIT_S)
    with pytest.raises(ServiceConflictError):
        Service("go", Trigger, lambda _: (True, "2"), node=world.mission)
    service.close()


def test_service_that_is_not_there(world):
    with pytest.raises(ServiceUnavailableError):
        ServiceProxy("nobody", Trigger, node=world.mission, timeout=0.1)()


def test_service_that_is_on_ros_2_and_not_here_is_told_with_the_way_there(world):
    service = Service("flag", SetBool, lambda request: (True, ""), node=world.robot)
    # std_srvs are not taken to a robot by `**`, as programs use them among themselves.
    old = world.node("old", names=("**",))
    deadline = world.clock.now() + WAIT_S
    while not list_any_type(old, "flag"):  # their sessions may meet late
        assert world.clock.now() < deadline
        world.clock.sleep(0.01)
    proxy = ServiceProxy("flag", SetBool1, node=old, timeout=0.1)
    for call in (proxy, lambda: proxy.wait_for_service(0.1)):
        with pytest.raises((ServiceUnavailableError, WaitTimeoutError)) as caught:
            call()
        assert "A ROS 2 robot has one, of type std_srvs/srv/SetBool, in node '/robot'. Try" in str(
            caught.value
        )
        assert "'names: [flag]' in the section ros2" in str(caught.value)
    service.close()


def test_service_of_a_ros_1_type_goes_to_ros_2_where_the_configuration_names_it(world):
    service = Service("flag", SetBool, lambda request: (request.data, "2"), node=world.robot)
    node = world.node("old", names=("flag",))
    proxy = ServiceProxy("flag", SetBool1, node=node)
    proxy.wait_for_service(WAIT_S)
    answer = proxy(True)
    assert (answer.success, answer.message) == (True, "2")
    assert isinstance(answer, SetBool1._response_class)
    service.close()


def test_type_without_a_counterpart_is_refused(world):
    node = world.node("old", names=("status",))
    from actionlib_core.interfaces.smach_msgs.msg import SmachContainerStatus

    with pytest.raises(ConfigError):
        Publisher("status", SmachContainerStatus, node=node)
