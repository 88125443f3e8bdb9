"""Bad networks: both ends agree on every goal's fate, and no goal runs twice."""

from __future__ import annotations

import contextlib
from collections import Counter
from dataclasses import dataclass, replace

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

from actionlib_core.action.client import ActionClient, CommState
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.goal.client import TEXT_NEVER_TAKEN
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatusArray
from actionlib_core.node import Node
from actionlib_core.time import Time
from actionlib_core.transport.faulty import FaultyTransport, RandomFaults, ScriptedFaults
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.actions import pack_statuses
from actionlib_core.wire.encoding import encoding_of

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
        self.fates[goal_id] = (handle.record.status.name, result)

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


@pytest.mark.timeout(900)  # on a busy computer
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


@pytest.mark.timeout(900)  # on a busy computer
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


@pytest.mark.parametrize("stamped", [False, True])
def test_cancel_of_all_goals_is_sent_again_for_those_of_this_client(stamped):
    with bad() as pair:
        handle = pair.client.send_goal(msg.TestGoal(1000))
        pair.clock.sleep(1.0)
        pair.links["client"].cut(5.0)
        if stamped:
            now = Time.now()
            pair.clock.sleep(0.1)
            later = pair.client.send_goal(msg.TestGoal(60))
            pair.client.cancel_goals_at_and_before_time(now)
            assert list(pair.check([handle, later])) == ["PREEMPTED", "SUCCEEDED"]
        else:
            pair.client.cancel_all_goals()
            assert list(pair.check([handle])) == ["PREEMPTED"]
        assert pair.clock.now() < 14.0


def test_cancel_of_all_goals_overtaking_a_goal_recalls_it():
    plan = ScriptedFaults({"demo/goal": [(1.0,)]})
    with bad(client_plan=plan) as pair:
        handle = pair.client.send_goal(msg.TestGoal(5))
        pair.client.cancel_all_goals()
        assert list(pair.check([handle])) == ["RECALLED"]
        assert pair.runs == {}


def test_cancel_by_time_covers_a_goal_that_is_followed_by_its_id():
    with bad() as pair:
        goal_id = pair.client.send_goal(msg.TestGoal(1000)).get_goal_id()
        pair.clock.sleep(1.0)
        other = ActionClient("demo", msg.TestAction, node=pair.nodes["client"])
        handle = other.attach(goal_id)
        pair.clock.sleep(1.0)
        pair.links["client"].cut(5.0)
        other.cancel_goals_at_and_before_time(Time.now())
        assert list(pair.check([handle])) == ["PREEMPTED"]


def test_result_is_dropped_at_the_server_once_acknowledged():
    with bad() as pair:
        assert only(pair)[0] == "SUCCEEDED"
        pair.clock.sleep(0.2)
        assert pair.server.status_list == []
        assert not pair.server.keeper.goals.tracked


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


# -- one server after another --------------------------------------------------------------------


class Row:
    """One client, and servers that follow each other on one name; each has a bad link."""

    def __init__(self, clock, *, client_plan=None, server_plan=None, **kwargs):
        self.clock = clock
        self.network = MemoryNetwork(clock)
        self.server_plan = server_plan
        self.runs = []
        self.nodes = []
        self.client = ActionClient(
            "demo", msg.TestAction, node=self.node("client", client_plan), **kwargs
        )

    def node(self, name, plan):
        plans = () if plan is None else (plan,)
        link = FaultyTransport(self.network.session(), *plans, clock=self.clock)
        self.nodes.append(Node(name, transport=link, clock=self.clock))
        return self.nodes[-1]

    def serve(self, name):
        """Start a server; every goal runs for as many tenths of a second as it says."""

        def execute(goal):
            self.runs.append((name, goal.goal))
            if server.wait_preempt(goal.goal / 10):
                server.set_preempted()
            else:
                server.set_succeeded()

        server = SimpleActionServer(
            "demo",
            msg.TestAction,
            execute,
            auto_start=False,
            node=self.node(name, self.server_plan),
            policy="queue",
        )
        server.start()
        return server

    def kill(self, server):
        server.action_server.node.transport.inner.kill()

    def close(self):
        for node in self.nodes:
            node.close()
            node.transport.close()


@contextlib.contextmanager
def row(seed=None, **kwargs):
    with VirtualClock(seed) as clock, use_clock(clock):
        servers = Row(clock, **kwargs)
        yield servers
        servers.close()


def end_of(handle):
    assert handle.wait(3000.0), handle
    return handle.get_terminal_state().name, handle.get_goal_status_text()


def test_goal_that_never_reached_a_server_that_leaves_is_run_by_the_next():
    with row(client_plan=ScriptedFaults({"demo/goal": [()]})) as servers:
        first = servers.serve("first")
        assert servers.client.wait_for_server(1.0)
        handle = servers.client.send_goal(msg.TestGoal(1))
        servers.clock.sleep(0.1)
        first.stop()
        servers.clock.sleep(7.0)
        assert not handle.wait(0)
        servers.serve("second")
        assert end_of(handle)[0] == "SUCCEEDED"
        assert servers.runs == [("second", 1)]


def test_goal_that_never_reached_a_server_that_is_killed_is_lost_and_not_run_by_the_next():
    """The client cannot tell this from a server that had just begun the goal."""
    with row(client_plan=ScriptedFaults({"demo/goal": [()]})) as servers:
        first = servers.serve("first")
        assert servers.client.wait_for_server(1.0)
        handle = servers.client.send_goal(msg.TestGoal(1))
        servers.clock.sleep(0.1)
        servers.kill(first)
        state, text = end_of(handle)
        assert state == "LOST"
        assert "node 'first'" in text
        assert "may or may not have begun" in text
        servers.serve("second")
        servers.clock.sleep(10.0)
        assert servers.runs == []


def test_goal_that_a_server_took_before_it_left_is_not_run_by_the_next():
    """What the first server says of the goal is lost, but its farewell names it: it is asked."""
    plan = ScriptedFaults({"demo/status": [()], "demo/result": [()] * 9})
    with row(server_plan=plan, server_lost_timeout=60.0) as servers:
        first = servers.serve("first")
        assert servers.client.wait_for_server(1.0)
        handle = servers.client.send_goal(msg.TestGoal(1000))
        servers.clock.sleep(0.1)
        first.stop()
        assert end_of(handle)[0] == "PREEMPTED"
        servers.serve("second")
        servers.clock.sleep(10.0)
        assert servers.runs == [("first", 1000)]


@pytest.mark.parametrize(("lost", "state"), [(1, "SUCCEEDED"), (9, "LOST")])
def test_farewell_is_repeated_and_without_it_the_goal_is_lost(lost, state):
    plans = {
        "client_plan": ScriptedFaults({"demo/goal": [()]}),
        "server_plan": ScriptedFaults({"demo/status": [()] * lost}),
    }
    with row(**plans) as servers:
        first = servers.serve("first")
        assert servers.client.wait_for_server(1.0)
        handle = servers.client.send_goal(msg.TestGoal(1))
        servers.clock.sleep(0.1)
        first.stop()
        servers.serve("second")
        assert end_of(handle)[0] == state
        assert servers.runs == ([("second", 1)] if state == "SUCCEEDED" else [])


def test_cancelled_goal_that_a_leaving_server_never_took_is_recalled():
    with row(client_plan=ScriptedFaults({"demo/goal": [()]})) as servers:
        first = servers.serve("first")
        assert servers.client.wait_for_server(1.0)
        handle = servers.client.send_goal(msg.TestGoal(1))
        servers.clock.sleep(0.1)
        handle.cancel()
        first.stop()
        state, text = end_of(handle)
        assert (state, text) == ("RECALLED", TEXT_NEVER_TAKEN)
        servers.serve("second")
        servers.clock.sleep(10.0)
        assert servers.runs == []


def test_nothing_is_sent_to_a_server_that_has_said_farewell():
    """It stays a little, as the answer to its farewell is lost, and somebody looks on."""
    with row(client_plan=ScriptedFaults({"demo/ack": [()] * 9})) as servers:
        heard = []
        onlooker = servers.node("onlooker", None).transport
        onlooker.subscribe("demo/goal", heard.append, history=False)
        first = servers.serve("first")
        assert servers.client.wait_for_server(1.0)
        servers.clock.call_later(0.2, lambda: handles.append(send()))

        def send():
            assert not first.action_server.stopped
            return servers.client.send_goal(msg.TestGoal(1))

        handles = []
        servers.clock.sleep(0.1)
        first.stop()
        lists = first.action_server.node.transport.publisher(
            "demo/status", encoding_of(GoalStatusArray)
        )
        lists.put(pack_statuses(servers.clock.time_ns(), []))  # its last words, overtaken
        servers.clock.sleep(5.0)
        assert heard == []
        handles[0].cancel()
        assert end_of(handles[0])[0] == "RECALLED"


def test_goal_still_waits_no_longer_than_its_ack_timeout_for_the_next_server():
    with row(client_plan=ScriptedFaults({"demo/goal": [()]})) as servers:
        first = servers.serve("first")
        assert servers.client.wait_for_server(1.0)
        handle = servers.client.send_goal(msg.TestGoal(1), ack_timeout=3.0)
        servers.clock.sleep(0.1)
        first.stop()
        state, text = end_of(handle)
        assert (state, servers.clock.now()) == ("LOST", pytest.approx(3.0, abs=0.1))
        assert "no action server took this goal within 3 s" in text


def test_server_without_clients_leaves_at_once():
    with row() as servers:
        servers.client.stop()
        first = servers.serve("first")
        before = servers.clock.now()
        first.stop()
        assert servers.clock.now() == before


@dataclass(frozen=True)
class Reign:
    """The time of one server: how long, how it ends, how long the name is free then."""

    length: float
    killed: bool
    gap: float


@pytest.mark.timeout(900)  # on a busy computer
@settings(deadline=None, max_examples=100)
@given(
    seed=st.integers(0, 1000),
    client_plan=faults,
    server_plan=faults,
    reigns=st.lists(
        st.builds(Reign, st.floats(0.05, 4.0), st.booleans(), st.floats(0.0, 2.0)),
        min_size=1,
        max_size=4,
    ),
    script=st.lists(sends, min_size=1, max_size=8),
    grace=st.sampled_from([0.0, 30.0]),
)
def test_servers_that_come_and_go(seed, client_plan, server_plan, reigns, script, grace):
    """Every goal has an end, none runs twice; none is lost without a kill or a lost message.

    Goals are not late here: one that arrives when its client has its end, at a server that came
    after the one that ended it, runs again.
    """
    client_plan = replace(client_plan, delay=0.0, repeat=0.0)
    options = {"server_plan": server_plan, "server_lost_timeout": grace}
    with row(seed, client_plan=client_plan, **options) as servers:

        def rule():
            for number, reign in enumerate(reigns):
                server = servers.serve(f"s{number}")
                servers.clock.sleep(reign.length)
                (servers.kill if reign.killed else _stop)(server)
                servers.clock.sleep(reign.gap)
            servers.serve("last")

        ruling = servers.clock.spawn(rule, name="reigns")
        handles = []
        for number, step in enumerate(script):
            handles.append(servers.client.send_goal(msg.TestGoal(number)))
            if step.cancel_after is not None:
                servers.clock.call_later(step.cancel_after, handles[-1].cancel)
            servers.clock.sleep(step.pause)
        states = [end_of(handle)[0] for handle in handles]
        assert ruling.join(3000.0)
        ran = Counter(number for _, number in servers.runs)
        assert all(count == 1 for count in ran.values()), servers.runs
        for number, state in enumerate(states):
            if state in {"RECALLED", "REJECTED"}:
                assert ran[number] == 0
            elif state == "SUCCEEDED":
                assert ran[number] == 1
        good = not (client_plan.drop or server_plan.drop or server_plan.delay)
        if good and not any(reign.killed for reign in reigns):
            assert "LOST" not in states


def _stop(server):
    server.stop()
