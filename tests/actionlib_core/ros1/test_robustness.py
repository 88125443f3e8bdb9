"""Masters and nodes that die, hang, are replaced, or send what is no message."""

from __future__ import annotations

import signal
import socket
import struct
import xmlrpc.client
from contextlib import closing
from functools import partial
from urllib.parse import urlsplit

import pytest

from actionlib_core import ros1
from actionlib_core.exceptions import InterfaceError, NameSetupError, Ros1Error
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.pubsub.topic import Subscriber
from actionlib_core.ros1.frames import pack_header
from actionlib_core.ros1.rpc import RpcServer

pytestmark = [pytest.mark.ros1, pytest.mark.zenoh]

WAIT_S = 60.0


def listen(node, name):
    heard = node.clock.event()
    return Subscriber(name, String, lambda message: heard.set()), heard


def test_a_bridge_that_is_closed_leaves_nothing_registered(ros, bridge, node):
    topics = ros.start("topics", "registered")
    topics.ask("advertise /here plain")
    made = bridge(topics=["/here"], actions=["a/b"], services=["c"])
    subscriber, _ = listen(node, "here")
    assert subscriber.wait_for_connections(1, WAIT_S)
    assert {"/here", "/a/b/goal", "/a/b/status"} <= set(ros.names_of(made.name))
    made.close()
    made.close()
    assert made.wait(0)
    assert ros.names_of(made.name) == []
    assert subscriber.get_num_connections() == 0


def test_a_restarted_master_hears_of_the_bridge_again(own_ros, bridge, node):
    made = bridge(master=own_ros.uri, topics=["/after"])
    own_ros.end_master()
    own_ros.start_master()
    topics = own_ros.start("topics", "after_node")
    topics.ask("advertise /after plain")
    subscriber, heard = listen(node, "after")
    assert subscriber.wait_for_connections(1, WAIT_S)
    assert topics.ask("connections /after") == "1"  # rospy counts it after it has said so
    topics.ask("publish /after text")
    assert heard.wait(WAIT_S)
    assert "/after" in own_ros.names_of(made.name)


def test_a_node_that_is_replaced_under_its_name_is_heard_again(ros, bridge, node):
    bridge(topics=["/replaced"])
    subscriber, heard = listen(node, "replaced")
    for _ in range(3):
        topics = ros.start("topics", "same_name")
        topics.ask("advertise /replaced latch")
        topics.ask("publish /replaced text")
        assert heard.wait(WAIT_S)
        heard.clear()
        topics.end()
    assert subscriber._ends.wait(lambda: not subscriber.get_num_connections(), WAIT_S)


GARBAGE = {
    "nothing": b"",
    "a length without bytes": struct.pack("<I", 100),
    "a length that is too great": b"\xff\xff\xff\xff" + b"x" * 100,
    "a field that is too long": struct.pack("<II", 8, 1000) + b"abcd",
    "a field without =": struct.pack("<II", 7, 3) + b"abc",
    "no text": struct.pack("<II", 6, 2) + b"\xff\xfe",
    "an unknown topic": pack_header({"callerid": "/x", "topic": "/no", "type": "*", "md5sum": "*"}),
    "an unknown service": pack_header({"callerid": "/x", "service": "/no", "md5sum": "*"}),
    "another type": pack_header({"topic": "/a/cancel", "type": "std_msgs/String", "md5sum": "0"}),
    "no name": pack_header({"topic": "/a/cancel"}),
    "HTTP": b"GET / HTTP/1.0\r\n\r\n",
    "a long question": b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n",
    "a question of no length": b"POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
    "a question that is none": b"POST / HTTP/1.1\r\nContent-Length: 3\r\n\r\n<x>",
}


@pytest.mark.parametrize("garbage", GARBAGE.values(), ids=GARBAGE.keys())
def test_garbage_on_its_ports_changes_nothing(ros, bridge, node, garbage):
    made = bridge(actions=["a"])
    inner = made._ros
    for port in (inner._data.port, urlsplit(inner.uri).port):
        with socket.create_connection(("127.0.0.1", port), WAIT_S) as peer:
            peer.sendall(garbage)
            peer.shutdown(socket.SHUT_WR)
            while peer.recv(1000):
                pass
    assert ros.ask("lookupNode", made.name) == inner.uri


def test_a_publisher_that_sends_garbage_is_left_and_the_others_are_heard(ros, bridge, node):
    """A hostile publisher: a master may be told of anything."""
    bridge(topics=["/mixed"])
    with socket.create_server(("127.0.0.1", 0)) as silent:
        bad = f"http://127.0.0.1:{silent.getsockname()[1]}/"
        ros.ask("registerPublisher", "/mixed", "std_msgs/String", bad)
        topics = ros.start("topics", "good")
        topics.ask("advertise /mixed latch")
        topics.ask("publish /mixed text")
        _, heard = listen(node, "mixed")
        assert heard.wait(WAIT_S)
        ros.ask("unregisterPublisher", "/mixed", bad)


class OddNode:
    """A node that the master has as the publisher of topics, and what it does about connections."""

    def __init__(self, ros, clock, topics, answer):
        self._answer = answer
        self._asked = dict.fromkeys(topics, 0)
        self.twice = clock.event()
        self._server = RpcServer("127.0.0.1", clock, {"requestTopic": self._on_request})
        uri = f"http://127.0.0.1:{self._server.port}/"
        self._end = [partial(ros.ask, "unregisterPublisher", topic, uri) for topic in topics]
        for topic in topics:
            ros.ask("registerPublisher", topic, "std_msgs/String", uri)

    def _on_request(self, _caller, topic, _protocols):
        self._asked[topic] += 1
        if min(self._asked.values()) > 1:
            self.twice.set()
        return self._answer()

    def close(self):
        for unregister in self._end:
            unregister()
        self._server.close(WAIT_S)


def test_a_node_that_cannot_be_had_is_told_once_for_all_its_topics(ros, bridge, node, caplog):
    def refuse():
        raise Ros1Error("odd", "about to leave")

    topics = ["/odd_1", "/odd_2"]
    with closing(OddNode(ros, node.clock, topics, refuse)) as odd:
        bridge(topics=topics)
        assert odd.twice.wait(WAIT_S)
        assert len([text for text in caplog.messages if "about to leave" in text]) == 1


def test_a_bridge_that_is_closed_while_it_connects_tells_no_error(ros, bridge, node, caplog):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        answer = ["TCPROS", *silent.getsockname()]
        with closing(OddNode(ros, node.clock, ["/silent"], lambda: answer)):
            made = bridge(topics=["/silent"])
            peer, _ = silent.accept()
            with peer:
                assert peer.recv(4)  # its header is there, and it waits for ours
                made.close()
    assert caplog.messages == []


def test_a_master_that_hangs_does_not_hold_the_end(own_ros, bridge, node):
    made = bridge(master=own_ros.uri, topics=["/x"])
    own_ros._master.send_signal(signal.SIGSTOP)
    try:
        made.close()
    finally:
        own_ros._master.send_signal(signal.SIGCONT)


def test_a_bridge_that_the_master_ends_says_so(ros, bridge, node):
    made = bridge(topics=["/x"])
    with xmlrpc.client.ServerProxy(made._ros.uri) as slave:
        slave.shutdown("/master", "new node registered with same name")
    assert made.wait(WAIT_S)
    assert "same name" in made.ended


def test_parameters_are_read(ros, bridge):
    ros.ask("setParam", "/base/speed", 0.5)
    made = bridge(topics=["/x"])
    assert made.get_param("/base/speed") == 0.5
    assert made.get_param("base") == {"speed": 0.5}
    assert "/base/speed" in made.param_names()
    with pytest.raises(KeyError):
        made.get_param("/nothing")


def test_two_bridges_do_not_carry_a_name_twice(ros, bridge, node):
    topics = ros.start("topics", "single")
    topics.ask("advertise /single plain")
    bridge(topics=["/single"])
    bridge(topics=["/single"])
    subscriber, _ = listen(node, "single")

    def carried():
        ends = [end for end in subscriber._ends.ends() if end.node == "single"]
        return len(ends) == 1

    assert subscriber._ends.wait(carried, WAIT_S)


def test_the_command_ends_cleanly(ros, command):
    with command("--topic", "/x", "--namespace", "r") as (child, name):
        assert "/x" in ros.names_of(name)
        child.send_signal(signal.SIGTERM)
        assert child.wait(WAIT_S) == 0
        assert ros.names_of(name) == []


def test_what_a_killed_bridge_has_left_is_unregistered_by_the_next(ros, bridge, command):
    with command("--topic", "/left", "--action", "left") as (child, name):
        child.kill()
        child.wait()
    assert "/left" in ros.names_of(name)
    bridge(topics=["/x"])
    assert ros.names_of(name) == []


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"master": "https://robot:1"}, Ros1Error),
        ({"master": "http://nowhere.invalid:1"}, Ros1Error),
        ({"actions": ["a b"], "topics": ["/c//d"]}, NameSetupError),
        ({"actions": {"a": "no type"}}, InterfaceError),
        ({"status_timeout": float("nan")}, ValueError),
        ({"status_timeout": "5"}, ValueError),
        ({"namespace": "a b"}, NameSetupError),
    ],
)
def test_what_cannot_be_bridged_is_refused(options, error):
    with pytest.raises(error):
        ros1.bridge(**{"master": "http://127.0.0.1:1", **options})
