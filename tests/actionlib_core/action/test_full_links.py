"""What actions put on the network where they must not wait for a link that is full."""

from __future__ import annotations

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.transport.memory import DEFAULT_QUALITY, MemoryTransport
from tests.two_nodes import TwoNodes


class Noting:
    """A publisher that notes what is put, and whether the sender would wait for a full link."""

    def __init__(self, publisher, word, quality, notes):
        self.matching, self.close = publisher.matching, publisher.close
        self._publisher = publisher
        self._note = word, quality.block
        self._notes = notes

    def put(self, payload):
        self._notes.append(self._note)
        self._publisher.put(payload)


@pytest.fixture
def sent(monkeypatch):
    """What was put: the last word of the key, and whether the sender would have waited."""
    notes = []
    make = MemoryTransport.publisher

    def publisher(self, key, encoding="", quality=DEFAULT_QUALITY):
        made = make(self, key, encoding, quality)
        return Noting(made, key.split("/")[-1], quality, notes)

    monkeypatch.setattr(MemoryTransport, "publisher", publisher)
    return notes


def test_what_the_client_repeats_by_itself_waits_for_no_link(sent, monkeypatch):
    """It is sent in a thread that other timers of the program, and its deadlines, need too."""
    with TwoNodes() as world:
        server = SimpleActionServer("do", msg.TestAction, auto_start=False, node=world.robot)
        server.start()
        monkeypatch.setattr(server.action_server.keeper, "on_goal", lambda *_, **__: None)
        monkeypatch.setattr(server.action_server.keeper, "on_cancel", lambda *_: None)
        client = ActionClient("do", msg.TestAction, node=world.mission)
        assert client.wait_for_server(5.0)
        handle = client.send_goal(msg.TestGoal(1))
        handle.cancel()
        world.clock.sleep(3.0)
        assert [block for key, block in sent if key == "goal"].count(True) == 1
        assert [block for key, block in sent if key == "cancel"].count(True) == 1
        assert ("goal", False) in sent
        assert ("cancel", False) in sent


def test_what_a_server_answers_on_the_networks_thread_waits_for_no_link(sent):
    """A suspended client would hold up the goals and cancels of all others."""
    with TwoNodes() as world:
        server = SimpleActionServer(
            "do", msg.TestAction, lambda _: server.wait_preempt(60.0), False, node=world.robot
        )
        server.start()
        client = ActionClient("do", msg.TestAction, node=world.mission)
        assert client.wait_for_server(5.0)
        handles = [client.send_goal(msg.TestGoal(number)) for number in range(3)]
        world.clock.sleep(0.1)
        assert handles[1].wait(5.0)  # recalled, as a newer goal came
        assert ("result", False) in sent
        recalled = sent.count(("result", True))
        server.action_server.keeper.on_goal(handles[1].get_goal_id(), 1, msg.TestGoal(1), "")
        assert sent.count(("result", True)) == recalled
