"""Bad networks: both ends agree on every goal's fate, and no goal runs twice."""

from __future__ import annotations

import contextlib
from collections import Counter
from dataclasses import dataclass

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

from actionlib_core.action_client import ActionClient, CommState
from actionlib_core.action_server import ActionServer
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.node import Node
from actionlib_core.simple_action_server import SimpleActionServer
from actionlib_core.transport.faulty import FaultyTransport, RandomFaults, ScriptedFaults
from actionlib_core.transport.memory import MemoryNetwork

ENDS = {"PREEMPTED", "SUCCEEDED", "ABORTED", "REJECTED", "RECALLED"}


class Bad:
    """A client and a server with a bad network between them."""

    def __init__(
        self, clock, *, client_plan=None, server_plan=None, lease=10.0, keep=60.0, **kwargs
    ):
        network = MemoryNetwork(clock)
        self.clock = clock
        self.links = {}
        nodes = {}
        for name, plan in (("client", client_plan), ("server", server_plan)):
            plans = () if plan is None else (plan,)
            link = FaultyTransport(network.session(), *plans, clock=clock, lease=lease)
            self.links[name] = link
            nodes[name] = Node(name, transport=link, clock=clock)
        self.nodes = nodes
        self.runs = Counter()
        self.closing = False
        self.fates = {}
        self.server = ActionServer(
            "demo",
            msg.TestAction,
            self.on_goal,
            self.on_cancel,
            node=nodes["server"],
            result_timeout=keep,
        )
        self.client = ActionClient("demo", msg.TestAction, node=nodes["client"], **kwargs)

    def on_goal(self, handle):
        goal_id = handle.get_goal_id().id
        self.runs[goal_id] += 1
        if self.closing:  # `stop` ends the goals that the client has given up
            return
        number = handle.get_goal().goal
        if number < 0:
            self.end(handle, handle.set_rejected)
            return
        handle.set_accepted()
        self.clock.call_later(number / 10, lambda: self.finish(handle))

    def finish(self, handle):
        self.end(handle, handle.set_succeeded)

    def on_cancel(self, handle):
        self.end(handle, handle.set_canceled)

    def end(self, handle, how):
        goal_id = handle.get_goal_id().id
        if goal_id in self.fates or self.closing:  # the end and a cancel met
            return
        result = msg.TestResult(len(self.fates) + 1)
        how(result, f"end {result.result}")
        self.fates[goal_id] = (handle.status_tracker.record.status.name, result)

    def check(self, handles):
        """Both ends agree on every goal, and none has run twice."""
        for handle in handles:
            assert handle.wait(3000.0), (handle, self.links)
            goal_id = handle.get_goal_id()
            state = handle.get_terminal_state().name
            assert self.runs[goal_id] <= 1
            if state == "RECALLED" and goal_id not in self.fates:
                assert self.runs[goal_id] == 0
            elif state in ENDS:
                assert self.fates[goal_id] == (state, handle.get_result())
            else:
                assert state == "LOST"
                assert handle.get_goal_status_text()
            yield state

    def close(self):
        self.closing = True
        for node in self.nodes.values():
            node.close()
            node.transport.close()


@contextlib.contextmanager
def bad(seed=None, **kwargs):
    with VirtualClock(seed) as clock, use_clock(clock):
        pair = Bad(clock, **kwargs)
        yield pair
        pair.close()


@dataclass(frozen=True)
class Send:
    number: int
    cancel_after: float | None
    pause: float


sends = st.builds(
    Send,
    number=st.integers(-1, 40),
    cancel_after=st.one_of(st.none(), st.floats(0.0, 3.0)),
    pause=st.floats(0.0, 2.0),
)
faults = st.builds(
    RandomFaults,
    seed=st.integers(0, 10_000),
    drop=st.sampled_from([0.0, 0.2, 0.5, 0.8]),
    repeat=st.sampled_from([0.0, 0.3, 0.9]),
    delay=st.sampled_from([0.0, 0.3, 0.9]),
    longest=st.sampled_from([0.1, 1.0, 4.0]),
)


@settings(deadline=None, max_examples=120)
@given(
    seed=st.integers(0, 1000),
    client_plan=faults,
    server_plan=faults,
    script=st.lists(sends, min_size=1, max_size=6),
    cuts=st.lists(st.tuples(st.floats(0.0, 5.0), st.floats(0.1, 4.0)), max_size=2),
)
def test_drops_repeats_delays_and_short_cuts(seed, client_plan, server_plan, script, cuts):
    """Nothing of this loses a goal: the link is never away longer than the lease."""
    with bad(seed, client_plan=client_plan, server_plan=server_plan, keep=3600.0) as pair:
        for start, length in cuts:
            pair.clock.call_later(start, lambda length=length: pair.links["client"].cut(length))
        handles = play(pair, script)
        assert "LOST" not in list(pair.check(handles))


@settings(deadline=None, max_examples=80)
@given(
    seed=st.integers(0, 1000),
    plan=faults,
    script=st.lists(sends, min_size=1, max_size=4),
    cuts=st.lists(
        st.tuples(st.sampled_from(["client", "server"]), st.floats(0.0, 5.0), st.floats(0.5, 20.0)),
        min_size=1,
        max_size=2,
    ),
    grace=st.sampled_from([0.0, 30.0]),
)
def test_long_cuts(seed, plan, script, cuts, grace):
    """A link away longer than the lease loses goals, never silently, and runs none twice."""
    options = {"lease": 2.0, "keep": 3600.0, "server_lost_timeout": grace}
    with bad(seed, client_plan=plan, server_plan=plan, **options) as pair:
        for name, start, length in cuts:
            pair.clock.call_later(
                start, lambda name=name, length=length: pair.links[name].cut(length)
            )
        handles = play(pair, script)
        states = list(pair.check(handles))
        if grace:
            assert "LOST" not in states


def play(pair, script):
    handles = []
    for step in script:
        handle = pair.client.send_goal(msg.TestGoal(step.number))
        handles.append(handle)
        if step.cancel_after is not None:
            pair.clock.call_later(step.cancel_after, handle.cancel)
        pair.clock.sleep(step.pause)
    return handles


# -- single faults, spelled out ------------------------------------------------------------------


def only(pair, number=3):
    handle = pair.client.send_goal(msg.TestGoal(number))
    states = list(pair.check([handle]))
    return states[0], pair.clock.now()


@pytest.mark.parametrize("lost", [1, 2, 4])
def test_lost_goals_are_sent_again(lost):
    plan = ScriptedFaults({"demo/goal": [()] * lost})
    with bad(client_plan=plan) as pair:
        assert only(pair)[0] == "SUCCEEDED"


def test_a_goal_delivered_five_times_runs_once():
    plan = ScriptedFaults({"demo/goal": [(0.0, 0.0, 0.1, 1.0, 70.0)]})
    with bad(client_plan=plan) as pair:
        assert only(pair)[0] == "SUCCEEDED"
        pair.clock.sleep(100.0)
        assert list(pair.runs.values()) == [1]


def test_lost_result_is_asked_for():
    plan = ScriptedFaults({"demo/result": [()]})
    with bad(server_plan=plan) as pair:
        state, now = only(pair)
        assert state == "SUCCEEDED"
        assert now < 1.0


def test_lost_result_and_all_statuses_are_asked_for_when_silence_is_too_long():
    plan = ScriptedFaults({"demo/result": [()], "demo/status": [()] * 50})
    with bad(server_plan=plan) as pair:
        state, now = only(pair)
        assert state == "SUCCEEDED"
        assert now < 5.0


def test_lost_cancel_is_sent_again():
    plan = ScriptedFaults({"demo/cancel": [(), ()]})
    with bad(client_plan=plan) as pair:
        handle = pair.client.send_goal(msg.TestGoal(1000))
        pair.clock.sleep(1.0)
        handle.cancel()
        assert list(pair.check([handle])) == ["PREEMPTED"]
        assert pair.clock.now() < 5.0


def test_result_is_dropped_at_the_server_once_acknowledged():
    with bad() as pair:
        assert only(pair)[0] == "SUCCEEDED"
        pair.clock.sleep(0.2)
        assert pair.server.status_list == []
        assert len(pair.server._goals) == 0


def test_result_comes_within_the_result_timeout_after_a_long_cut():
    with bad(lease=2.0, server_lost_timeout=40.0) as pair:
        handle = pair.client.send_goal(msg.TestGoal(10))
        pair.clock.sleep(0.5)
        pair.links["server"].cut(30.0)
        assert list(pair.check([handle])) == ["SUCCEEDED"]
        assert 30.0 < pair.clock.now() < 32.0


def test_result_past_the_result_timeout_is_known_but_gone():
    with bad(lease=2.0, server_lost_timeout=100.0) as pair:
        handle = pair.client.send_goal(msg.TestGoal(10))
        pair.clock.sleep(0.5)
        pair.links["server"].cut(80.0)
        assert handle.wait(200.0)
        assert handle.get_terminal_state().name == "SUCCEEDED"
        assert handle.get_result() is None
        assert "no longer kept" in handle.get_goal_status_text()


def test_cancel_overtaking_its_goal_recalls_it():
    plan = ScriptedFaults({"demo/goal": [(1.0,)]})
    with bad(client_plan=plan) as pair:
        handle = pair.client.send_goal(msg.TestGoal(5))
        handle.cancel()
        assert list(pair.check([handle])) == ["RECALLED"]
        assert pair.runs == {}


def test_goal_is_lost_when_the_server_restarts_and_is_not_run_again():
    with VirtualClock() as clock, use_clock(clock):
        network = MemoryNetwork(clock)
        runs = []

        def serve(name):
            node = Node(name, transport=network.session(), clock=clock)

            def execute(goal):
                runs.append(name)
                server.wait_preempt(5.0)
                server.set_succeeded()

            server = SimpleActionServer("demo", msg.TestAction, execute, node=node)
            return node

        first = serve("first")
        client = ActionClient(
            "demo",
            msg.TestAction,
            node=Node("client", transport=network.session(), clock=clock),
            server_lost_timeout=60.0,
        )
        assert client.wait_for_server(1.0)
        handle = client.send_goal(msg.TestGoal(1))
        clock.sleep(1.0)
        first.transport.kill()
        clock.sleep(1.0)
        assert handle.get_comm_state() is CommState.ACTIVE  # it may come back
        serve("second")
        assert handle.wait(1.0)
        assert handle.get_terminal_state().name == "LOST"
        assert "restarted" in handle.get_goal_status_text()
        clock.sleep(10.0)
        assert runs == ["first"]
