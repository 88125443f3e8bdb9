"""What actions put on the network where they must not wait for a link that is full."""

from __future__ import annotations

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.server import ActionServer
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


def test_what_a_client_asks_by_itself_holds_up_no_timer_while_a_link_is_full(monkeypatch):
    """A query waits 5 s then: limits and graces of all missions of the process came as late."""
    with TwoNodes() as world:
        query, asked = MemoryTransport.query, []

        def ask(self, *arguments, **options):
            asked.append(world.clock.now())
            world.clock.sleep(5.0)
            return query(self, *arguments, **options)

        monkeypatch.setattr(MemoryTransport, "query", ask)
        ActionServer("do", msg.TestAction, lambda goal: goal.set_accepted(), node=world.robot)
        client = ActionClient("do", msg.TestAction, node=world.mission)
        goal = client.send_goal(msg.TestGoal(1))
        world.clock.sleep(1.0)
        goal.cancel()  # the server's code does not answer
        world.clock.sleep(2.0)
        assert asked
        fired = []
        world.clock.call_later(0.1, lambda: fired.append(world.clock.now()))
        due = world.clock.now() + 0.1
        world.clock.sleep(10.0)
        assert fired == [due]
