"""When a server says how its goals stand, also when its timer is late."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

from actionlib_core.action.goal_keeper import GoalKeeper
from actionlib_core.action.status_publisher import GAP_S, PERIOD_S, StatusPublisher
from actionlib_core.clock import RealClock
from actionlib_core.exceptions import IllegalTransitionError
from actionlib_core.goal.server import ServerGoal, ServerGoals


class LateClock:
    """A clock whose timers run when the test says so, as on a computer that was suspended."""

    def __init__(self):
        self.time = 100.0
        self.timers = []

    event = RealClock().event

    def now(self):
        return self.time

    def time_ns(self):
        return round(self.time * 1e9)

    def call_later(self, delay, callback):
        timer = LateTimer(self.time + delay, callback)
        self.timers.append(timer)
        return timer

    def run(self, time):
        """Let `time` come, and then run what was due before."""
        self.time = time
        due, self.timers = self.timers, []
        for timer in due:
            if timer.callback is not None and timer.due <= time:
                timer.callback()
            elif timer.callback is not None:
                self.timers.append(timer)


class LateTimer:
    def __init__(self, due, callback):
        self.due = due
        self.callback = callback

    def cancel(self):
        self.callback = None


class Server:
    """Goals and what was said of them."""

    def __init__(self):
        self.clock = LateClock()
        self.goals = ServerGoals("demo")
        self.said = []
        self.status = StatusPublisher(self.clock, threading.RLock(), self.goals, self)

    def send_status(self, entries):
        self.said.append([entry.id for entry in entries])

    def take(self, goal_id):
        self.goals.on_goal(ServerGoal(goal_id, 1), self.clock.now())
        self.status.on_change()

    def end(self, goal_id):
        goal = self.goals.find(goal_id)
        self.goals.step(goal, "reject", "set_rejected()", self.clock.now())
        self.goals.on_acknowledged([goal_id], self.clock.now())
        self.status.on_change()


@pytest.mark.parametrize("late_s", [0.0, 10 * PERIOD_S])
def test_status_goes_on_after_a_timer_that_was_late(late_s):
    """Nothing was ever said again when the list was empty as a late timer ran."""
    server = Server()
    server.take("a")
    server.end("a")
    assert server.said == [["a"]]
    server.clock.run(server.clock.time + GAP_S + late_s)
    assert server.said == [["a"], []]
    server.clock.run(server.clock.time + 2 * PERIOD_S)
    server.take("b")
    assert server.said == [["a"], [], ["b"]]
    assert len(server.clock.timers) > 0


def test_an_empty_list_is_not_said_again_and_needs_no_timer():
    server = Server()
    server.take("a")
    server.clock.run(server.clock.time + PERIOD_S)
    assert server.said == [["a"]] * 2
    server.end("a")
    server.clock.run(server.clock.time + PERIOD_S)
    server.clock.run(server.clock.time + PERIOD_S)
    server.clock.run(server.clock.time + PERIOD_S)
    assert server.said == [["a"], ["a"], []]
    assert server.clock.timers == []


def make_keeper():
    """Return a keeper, its clock, the statuses that it has said, and its goals."""
    clock, said, handles = LateClock(), [], []
    port = SimpleNamespace(
        send_accepted=None,
        send_status=lambda entries: said.append([entry.status.name for entry in entries]),
    )
    keeper = GoalKeeper(
        SimpleNamespace(clock=clock),
        "demo",
        None,
        port,
        on_client_lost="continue",
        result_timeout=60.0,
        deliver_goal=handles.append,
        deliver_cancel=handles.remove,
        on_stopped=said.clear,
    )
    return keeper, clock, said, handles


def test_call_that_is_refused_holds_up_no_change():
    """The change before it was said with the next list, up to a second later."""
    keeper, clock, said, handles = make_keeper()
    keeper.on_goal("a", 1, None, "client")
    handles[0].set_accepted()
    handles[0].set_cancel_requested()
    assert said == [["ACTIVE"]]
    clock.time += 2 * GAP_S  # the timer is late
    with pytest.raises(IllegalTransitionError):
        handles[0].set_accepted()
    clock.run(clock.time + 2 * GAP_S)
    assert said == [["ACTIVE"], ["PREEMPTING"]]


def test_goal_that_comes_is_said_within_the_gap():
    server = Server()
    for goal_id in ("a", "b"):
        server.clock.time += 2 * PERIOD_S
        server.said.clear()
        server.goals.on_goal(ServerGoal(goal_id, 1), server.clock.now())
        server.status.on_arrival()
        server.status.on_arrival()
        assert server.said == []
        server.clock.run(server.clock.time + GAP_S)
        assert server.said == [sorted({"a", goal_id})]
        server.clock.run(server.clock.time + GAP_S)
        assert len(server.said) == 1


def test_acceptance_that_follows_a_goal_is_said_at_once():
    """Its client, which had read PENDING, learned of it 20 ms later."""
    keeper, clock, said, handles = make_keeper()
    keeper.on_goal("a", 1, None, "client")
    keeper.status.on_arrival()
    clock.time += 0.1 * GAP_S
    handles[0].set_accepted()
    assert said == [["ACTIVE"]]
    clock.run(clock.time + GAP_S)
    clock.run(clock.time + GAP_S)
    assert said == [["ACTIVE"]]
