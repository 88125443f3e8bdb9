"""Topics over the network in memory, and once over zenoh."""

from __future__ import annotations

import logging
import threading

import pytest

from actionlib_core import shutdown
from actionlib_core.clock import RealClock
from actionlib_core.exceptions import (
    InvalidNameError,
    NodeError,
    TransportError,
    TypeMismatchError,
    WaitTimeoutError,
)
from actionlib_core.goal.bounded import BYTES
from actionlib_core.interfaces.geometry_msgs.msg import Point
from actionlib_core.interfaces.std_msgs.msg import Int32, String
from actionlib_core.node import Node, use_node
from actionlib_core.pubsub.topic import NewsPublisher, Publisher, Subscriber, wait_for_message
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.transport.tokens import Endpoint, Kind
from actionlib_core.wire.arrivals import REPORTED

NODES = ("talker", "listener")


def test_messages_arrive_in_order(nodes, clock):
    talker, listener = nodes
    heard = []
    Subscriber("chatter", String, lambda m: heard.append(m.data), node=listener)
    publisher = Publisher("chatter", String, node=talker)
    for word in ("a", "b", "c"):
        publisher.publish(String(data=word))
    clock.sleep(1)
    assert heard == ["a", "b", "c"]


def test_publish_makes_the_message_from_its_arguments(nodes, clock):
    talker, listener = nodes
    heard = []
    Subscriber("point", Point, heard.append, node=listener)
    publisher = Publisher("point", Point, node=talker)
    publisher.publish(1.0, 2.0, 3.0)
    publisher.publish(x=4.0)
    clock.sleep(1)
    assert heard == [Point(1.0, 2.0, 3.0), Point(x=4.0)]


def test_callback_args_are_handed_on(nodes, clock):
    talker, listener = nodes
    heard = []
    Subscriber("chatter", String, lambda *args: heard.append(args), {"a": 1}, node=listener)
    Publisher("chatter", String, node=talker).publish("x")
    clock.sleep(1)
    assert heard == [(String("x"), {"a": 1})]


def test_names_are_resolved_in_the_node(clock):
    network = MemoryNetwork(clock)
    node = Node("nav", transport=network.session(), clock=clock, namespace="/robot_1/")
    assert Publisher("chatter", String, node=node).name == "/robot_1/chatter"
    assert Publisher("~chatter", String, node=node).name == "/robot_1/nav/chatter"
    assert Publisher("/chatter", String, node=node).name == "/chatter"
    with pytest.raises(InvalidNameError, match="topic name"):
        Publisher("chat ter", String, node=node)


def test_latched_message_reaches_a_late_subscriber(nodes, clock):
    talker, listener = nodes
    publisher = Publisher("map", String, latch=True, node=talker)
    publisher.publish("old")
    publisher.publish("new")
    heard = []
    Subscriber("map", String, lambda m: heard.append(m.data), node=listener)
    clock.sleep(1)
    assert heard == ["new"]


def test_slow_subscriber_drops_the_oldest_and_counts(nodes, clock):
    talker, listener = nodes
    heard = []

    def slow(message):
        heard.append(message.data)
        clock.sleep(10)

    subscriber = Subscriber("count", Int32, slow, queue_size=2, node=listener)
    publisher = Publisher("count", Int32, node=talker)
    publisher.publish(0)
    clock.sleep(1)
    for number in range(1, 8):
        publisher.publish(number)
    clock.sleep(100)
    assert heard == [0, 6, 7]
    assert subscriber.dropped == 5


def test_with_queue_size_as_many_messages_wait_however_large_they_are(nodes, clock):
    talker, listener = nodes
    heard = []

    def slow(message):
        heard.append(message.data[0])
        clock.sleep(10)

    subscriber = Subscriber("images", String, slow, queue_size=3, node=listener)
    publisher = Publisher("images", String, node=talker)
    for number in range(4):
        publisher.publish(str(number) * (BYTES // 2 + 1))
        clock.sleep(1)
    clock.sleep(100)
    assert heard == ["0", "1", "2", "3"]
    assert subscriber.dropped == 0


def test_types_of_senders_that_are_invented_do_not_fill_the_memory(nodes):
    subscriber = Subscriber("count", Int32, node=nodes[1])
    for number in range(2 * REPORTED):
        end = Endpoint(Kind.PUBLISHER, "count", "a/B", "1" * 32, f"session {number}", "odd")
        error = TypeMismatchError("count", ("std_msgs/Int32", "2"), ("a/B", "1"), by=end.session)
        subscriber._ends.note(error, end)
    assert len(subscriber._ends.mismatches) == REPORTED


def test_without_queue_size_nothing_is_dropped(nodes, clock):
    talker, listener = nodes
    heard = []

    def slow(message):
        heard.append(message.data)
        clock.sleep(1)

    subscriber = Subscriber("count", Int32, slow, node=listener)
    publisher = Publisher("count", Int32, node=talker)
    for number in range(50):
        publisher.publish(number)
    clock.sleep(100)
    assert heard == list(range(50))
    assert subscriber.dropped == 0


def test_raising_callback_is_reported_and_the_next_message_comes(nodes, clock, monkeypatch):
    reported = []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(args.exc_value))
    talker, listener = nodes
    heard = []

    def callback(message):
        heard.append(message.data)
        raise ValueError(message.data)

    Subscriber("chatter", String, callback, node=listener)
    publisher = Publisher("chatter", String, node=talker)
    publisher.publish("a")
    publisher.publish("b")
    clock.sleep(1)
    assert heard == ["a", "b"]
    assert [str(error) for error in reported] == ["a", "b"]


def test_connections_are_counted(nodes, clock):
    talker, listener = nodes
    publisher = Publisher("chatter", String, node=talker)
    assert publisher.get_num_connections() == 0
    first = Subscriber("chatter", String, print, node=listener)
    second = Subscriber("chatter", String, print, node=listener)
    assert publisher.wait_for_connections(2, timeout=1)
    assert first.wait_for_connections(1, timeout=1)
    second.unregister()
    second.unregister()
    clock.sleep(0.1)
    assert publisher.get_num_connections() == 1
    assert not publisher.wait_for_connections(2, timeout=3)
    assert first.get_num_connections() == 1


def test_unregistered_subscriber_hears_nothing(nodes, clock):
    talker, listener = nodes
    heard = []
    publisher = Publisher("chatter", String, node=talker)
    with Subscriber("chatter", String, heard.append, node=listener):
        publisher.publish("a")
        clock.sleep(1)
    publisher.publish("b")
    clock.sleep(1)
    assert heard == [String("a")]


def test_message_that_is_being_read_at_the_end_does_not_start_a_callback(nodes, clock):
    talker, listener = nodes
    heard = []
    subscriber = Subscriber("chatter", String, heard.append, node=listener)
    read = subscriber._end.read

    def slow(sample):
        message = read(sample)
        clock.sleep(1.0)
        return message

    subscriber._end.read = slow
    Publisher("chatter", String, node=talker).publish("late")
    clock.sleep(0.5)
    subscriber.unregister()
    clock.sleep(5.0)
    assert heard == []


def test_unregistered_publisher_raises(nodes):
    publisher = Publisher("chatter", String, node=nodes[0])
    publisher.unregister()
    with pytest.raises(TransportError, match="chatter: the publisher is closed"):
        publisher.publish("x")


def test_wrong_type_is_told_on_both_sides(nodes, clock, caplog):
    talker, listener = nodes
    heard = []
    with caplog.at_level(logging.ERROR, "actionlib_core"):
        subscriber = Subscriber("chatter", Int32, heard.append, node=listener)
        publisher = Publisher("chatter", String, node=talker)
        clock.sleep(1)
    for end, other in ((publisher, subscriber), (subscriber, publisher)):
        (error,) = end.mismatches
        assert (error.name, error.expected_type, error.found_type) == (
            "chatter", end.type, other.type,
        )  # fmt: skip
        for text in ("std_msgs/String", "std_msgs/Int32", String._md5sum, Int32._md5sum):
            assert text in str(error)
    assert len(caplog.records) == 2
    with pytest.raises(TypeMismatchError, match="std_msgs/Int32"):
        publisher.publish("x")
    clock.sleep(1)
    assert heard == []
    assert publisher.get_num_connections() == 0
    fitting = Subscriber("chatter", String, heard.append, node=listener)
    clock.sleep(1)
    publisher.publish("y")
    clock.sleep(1)
    assert heard == [String("y")]
    subscriber.unregister()
    clock.sleep(1)
    assert publisher.mismatches == []
    fitting.unregister()


def test_news_are_published_although_their_listeners_have_another_type(nodes, clock, caplog):
    talker, listener = nodes
    Subscriber("chatter", Int32, print, node=listener)
    publisher = NewsPublisher("chatter", String, node=talker)
    clock.sleep(1)
    publisher.publish("x")
    assert "chatter: types differ" in caplog.text


def test_message_of_another_encoding_without_token_is_noted(nodes, clock):
    talker, listener = nodes
    heard = []
    subscriber = Subscriber("chatter", Int32, heard.append, node=listener)
    port = talker.transport.publisher("chatter", "ros1/std_msgs/String;md5=12")
    port.put(b"\0\0\0\0")
    port.put(b"\0\0\0\0")
    clock.sleep(1)
    assert heard == []
    assert [e.found_type for e in subscriber.mismatches] == ["std_msgs/String"]


def test_wait_for_message_returns_the_next_one(nodes, clock):
    talker, listener = nodes
    publisher = Publisher("chatter", String, node=talker)
    clock.call_later(3.0, lambda: publisher.publish("hello"))
    assert wait_for_message("chatter", String, 5, node=listener) == String("hello")
    assert clock.now() == pytest.approx(3.0)


def test_wait_for_message_times_out(nodes, clock):
    with pytest.raises(WaitTimeoutError, match=r"/chatter: no message: got none in 2 s"):
        wait_for_message("chatter", String, 2, node=nodes[1])
    assert clock.now() == pytest.approx(2.0)


def test_wait_for_message_raises_on_another_type(nodes, clock):
    talker, listener = nodes
    Publisher("chatter", Int32, node=talker)
    with pytest.raises(TypeMismatchError):
        wait_for_message("chatter", String, 100, node=listener)
    assert clock.now() == 0


def test_wait_for_message_ends_with_the_program(nodes, clock):
    with shutdown.use_shutdown(shutdown.Shutdown()) as end:
        clock.call_later(4.0, end.request)
        with pytest.raises(NodeError, match="shutdown was requested"):
            wait_for_message("chatter", String, node=nodes[1])


def test_wait_for_message_ends_with_the_node(nodes, clock):
    listener = nodes[1]
    clock.call_later(4.0, listener.close)
    with pytest.raises(NodeError, match="node was closed"):
        wait_for_message("chatter", String, node=listener)


def test_node_in_force_is_the_default(nodes):
    with use_node(nodes[0]):
        assert Publisher("chatter", String).node is nodes[0]


def test_closing_the_node_closes_its_topics(nodes):
    talker = nodes[0]
    publisher = Publisher("chatter", String, node=talker)
    talker.close()
    with pytest.raises(TransportError):
        publisher.publish("x")
    with pytest.raises(NodeError, match="it is closed"):
        Publisher("chatter", String, node=talker)


@pytest.mark.zenoh
def test_topics_over_zenoh():
    clock = RealClock()
    heard = []
    latched, done = clock.event(), clock.event()

    def callback(message):
        heard.append(message.data)
        latched.set()
        if message.data == 20:
            done.set()

    with Node("talker") as talker, Node("listener") as listener:
        publisher = Publisher("count", Int32, latch=True, node=talker)
        publisher.publish(0)
        with Subscriber("count", Int32, callback, node=listener) as subscriber:
            assert publisher.wait_for_connections(timeout=60)
            assert subscriber.wait_for_connections(timeout=60)
            assert wait_for_message("count", Int32, 10, node=listener) == Int32(0)
            assert latched.wait(60)  # else a later message may come before it, in its place
            for number in range(1, 21):
                publisher.publish(number)
            assert done.wait(60)
    assert heard == list(range(21))
