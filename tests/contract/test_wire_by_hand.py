"""A client of nothing but Zenoh and `docs/wire_protocol.md`: what the page says, byte by byte."""

from __future__ import annotations

import json
import os
import queue
import struct
import time

import pytest
import zenoh

from actionlib_core import Node, Service, SimpleActionServer
from actionlib_core.clock import RealClock, use_clock
from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback
from actionlib_core.interfaces.std_srvs.srv import SetBool

pytestmark = pytest.mark.zenoh

LONG_S = 60.0
NAME = "by_hand/move_base"
MD5 = "70b6aca7c7f7746d8d1609ad94c80bb8"
PREEMPTED, SUCCEEDED, RECALLING, RECALLED, LOST = 2, 3, 7, 8, 9


def text(value):
    return struct.pack("<I", len(value.encode())) + value.encode()


def stamp(ns):
    return struct.pack("<II", *divmod(ns, 10**9))


def header(frame=""):
    return struct.pack("<I", 0) + stamp(time.time_ns()) + text(frame)


def goal_id(name, ns=0):
    return stamp(ns) + text(name)


def status_list(names, frame=""):
    entries = [goal_id(name) + bytes([0]) + text("") for name in names]
    return header(frame) + struct.pack("<I", len(entries)) + b"".join(entries)


class Reader:
    """Takes a payload apart, one field after another."""

    def __init__(self, payload):
        self.data = payload.to_bytes()
        self.at = 0

    def take(self, form):
        values = struct.unpack_from(f"<{form}", self.data, self.at)
        self.at += struct.calcsize(f"<{form}")
        return values

    def text(self):
        (length,) = self.take("I")
        self.at += length
        return self.data[self.at - length : self.at].decode()

    def header(self):
        self.take("III")
        return self.text()

    def status(self):
        self.take("II")
        name = self.text()
        (status,) = self.take("B")
        return name, status, self.text()

    def statuses(self):
        frame = self.header()
        (count,) = self.take("I")
        return frame, [self.status()[:2] for _ in range(count)]

    def report(self):
        """Return the id and the status of an XActionResult or XActionFeedback."""
        self.header()
        return self.status()[:2]


class ByHand:
    """A session that speaks the protocol by hand, and notes all that it hears."""

    def __init__(self):
        config = zenoh.Config()
        port = 7446 + int(os.environ.get("SMACHPY_DOMAIN", "0"))
        config.insert_json5("scouting/multicast/address", f'"224.0.0.224:{port}"')
        config.insert_json5("scouting/multicast/interface", '"lo"')
        config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
        self.session = zenoh.open(config)
        self.heard = {word: queue.Queue() for word in ("status", "feedback", "result")}
        for word, heard in self.heard.items():
            self.session.declare_subscriber(f"{NAME}/{word}", self._direct(heard.put))
        self.tokens = queue.Queue()
        self.session.liveliness().declare_subscriber(
            f"@smachpy/action_server/*/*/*/*/*/{NAME}", self._direct(self.tokens.put), history=True
        )
        zid = self.session.zid()
        self.token = (
            f"@smachpy/action_client/{zid}/1/hand/move_base_msgs%MoveBaseAction/{MD5}/{NAME}"
        )
        self._shown = self.session.liveliness().declare_token(self.token)
        self._goals = self.session.declare_publisher(f"{NAME}/goal", express=True)

    @staticmethod
    def _direct(callback):
        return zenoh.handlers.Callback(callback, indirect=False)

    def put(self, word, payload):
        self.session.put(f"{NAME}/{word}", payload)

    def send(self, name, x):
        """Publish a goal once: on a link that stands nothing is lost."""
        pose = header("map") + struct.pack("<7d", x, 0, 0, 0, 0, 0, 1)
        self._goals.put(header() + goal_id(name, time.time_ns()) + pose)

    def ask(self, word, name):
        """Return the encoding and the payload of the answer to a question."""
        replies = list(self.session.get(f"{NAME}/{word}", payload=goal_id(name), timeout=LONG_S))
        (reply,) = replies
        if reply.ok is None:
            return "error", reply.err.payload
        return str(reply.ok.encoding).partition(";")[0], reply.ok.payload

    def wait(self, word, wanted):
        """Return the first message on `word` that `wanted` reads as something true."""
        deadline = time.monotonic() + LONG_S
        while True:
            found = wanted(self.heard[word].get(timeout=max(0.0, deadline - time.monotonic())))
            if found:
                return found

    def wait_for_end(self, name):
        def wanted(sample):
            found, status = Reader(sample.payload).report()
            return status if found == name else None

        return self.wait("result", wanted)


@pytest.fixture
def server():
    with use_clock(RealClock()), Node("server") as node:

        def execute(goal):
            pose = PoseStamped(pose=goal.target_pose.pose)
            for _ in range(3):
                server.publish_feedback(MoveBaseFeedback(pose))
            if goal.target_pose.pose.position.x > 0 or not server.wait_preempt(LONG_S):
                server.set_succeeded()
            else:
                server.set_preempted()

        server = SimpleActionServer(NAME, MoveBaseAction, execute, node=node)
        yield server


@pytest.fixture
def client(server):
    client = ByHand()
    assert client.tokens.get(timeout=LONG_S).kind == zenoh.SampleKind.PUT
    deadline = time.monotonic() + LONG_S
    while not client._goals.matching_status.matching:
        assert time.monotonic() < deadline
    yield client
    client.session.close()


def test_goal_feedback_result_questions_and_acknowledgement(client):
    client.send("/hand-1", 2.5)
    assert client.wait_for_end("/hand-1") == SUCCEEDED
    for _ in range(3):
        reader = Reader(client.heard["feedback"].get(timeout=LONG_S).payload)
        assert reader.report()[0] == "/hand-1"
        reader.header()
        assert reader.take("7d")[0] == 2.5
        assert reader.at == len(reader.data)

    kind, payload = client.ask("result", "/hand-1")
    assert kind == "ros1/move_base_msgs/MoveBaseActionResult"
    assert Reader(payload).report() == ("/hand-1", SUCCEEDED)
    assert client.ask("goal", "/hand-1")[0] == "ros1/move_base_msgs/MoveBaseActionGoal"
    kind, payload = client.ask("result", "")
    assert kind == "ros1/actionlib_msgs/GoalStatusArray"
    assert Reader(payload).statuses() == ("", [("/hand-1", SUCCEEDED)])

    client.put("ack", status_list(["/hand-1"]))
    deadline = time.monotonic() + LONG_S
    while client.ask("result", "/hand-1")[0] != "ros1/actionlib_msgs/GoalStatus":
        assert time.monotonic() < deadline
    assert Reader(client.ask("result", "/hand-1")[1]).status()[:2] == ("/hand-1", SUCCEEDED)
    client.send("/hand-1", 2.5)  # it does not run again
    assert client.ask("goal", "/hand-1")[0] == "error"
    assert client.heard["feedback"].empty()


def test_questions_about_what_is_not_there(client):
    kind, payload = client.ask("result", "/nobody-1")
    assert kind == "ros1/actionlib_msgs/GoalStatus"
    assert Reader(payload).status()[:2] == ("/nobody-1", LOST)
    assert client.ask("goal", "/nobody-1")[0] == "error"


def test_cancel_before_and_after_the_goal(client):
    client.put("cancel", goal_id("/hand-2"))
    wanted = ("/hand-2", RECALLING)
    client.wait("status", lambda sample: wanted in Reader(sample.payload).statuses()[1])
    client.send("/hand-2", 1.0)
    assert client.wait_for_end("/hand-2") == RECALLED

    client.send("/hand-3", 0.0)
    client.heard["feedback"].get(timeout=LONG_S)
    client.put("cancel", goal_id("/hand-3"))
    assert client.wait_for_end("/hand-3") == PREEMPTED


def test_farewell_names_what_was_taken_and_is_answered(client, server):
    client.send("/hand-4", 1.0)
    assert client.wait_for_end("/hand-4") == SUCCEEDED
    stopping = RealClock().spawn(server.stop, name="stop")

    def farewell(sample):
        frame, entries = Reader(sample.payload).statuses()
        return (frame, entries) if frame else None

    frame, entries = client.wait("status", farewell)
    assert frame.startswith("@smachpy/action_server/")
    assert entries == [("/hand-4", SUCCEEDED)]
    client.put("ack", status_list(["/hand-4"], client.token))
    assert stopping.join(LONG_S)
    assert client.tokens.get(timeout=LONG_S).kind == zenoh.SampleKind.DELETE


def test_service_is_a_query(client):
    with Node("arm") as node:

        def handler(request):
            if request.data:
                raise ValueError("stuck")
            return True, "open"

        Service("by_hand/arm", SetBool, handler, node=node)
        pattern = "@smachpy/service/*/*/*/*/*/by_hand/arm"
        found = queue.Queue()
        watch = client.session.liveliness().declare_subscriber(
            pattern, ByHand._direct(found.put), history=True
        )
        found.get(timeout=LONG_S)
        (reply,) = client.session.get("by_hand/arm", payload=b"\x00", timeout=LONG_S)
        assert reply.ok.payload.to_bytes() == b"\x01" + text("open")
        (reply,) = client.session.get("by_hand/arm", payload=b"\x01", timeout=LONG_S)
        told = json.loads(reply.err.payload.to_string())
        assert told == {"type": "ValueError", "text": "stuck"}
        watch.undeclare()
