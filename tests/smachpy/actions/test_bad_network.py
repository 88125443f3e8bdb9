"""Action states on a network that drops, repeats, delays, reorders and is cut."""

from __future__ import annotations

import pytest

from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.actionlib.msg import TestResult as Result
from actionlib_core.transport.faulty import FaultyTransport, RandomFaults
from smachpy import SimpleActionState, StateMachine
from tests.two_nodes import TwoNodes


class World(TwoNodes):
    def __init__(self, seed=0, **faults):
        self.faults, self.seed = faults, seed
        super().__init__(seed)
        self.runs = []

    def session(self):
        faults = RandomFaults(self.seed, **self.faults)
        return FaultyTransport(super().session(), faults, clock=self.clock, lease=5.0)

    def __enter__(self):
        super().__enter__()
        self.server = SimpleActionServer("do", Action, self.run, False, node=self.robot)
        self.server.start()
        return self

    def run(self, goal):
        self.runs.append(goal.goal)
        if self.server.wait_preempt(3.0):
            self.server.set_preempted(Result(-1))
        else:
            self.server.set_succeeded(Result(goal.goal))

    def machine(self, goal=1, **kwargs):
        machine = StateMachine(["succeeded", "aborted", "preempted"], output_keys=["result"])
        state = SimpleActionState(
            "do", Action, goal=Goal(goal), result_slots=["result"], node=self.mission, **kwargs
        )
        with machine:
            machine.add("A", state)
        return machine


@pytest.mark.parametrize("seed", range(25))
def test_goals_run_once_and_their_results_arrive(seed):
    with World(seed, drop=0.3, repeat=0.3, delay=0.3, longest=2.0) as world:
        for number in range(1, 6):
            machine = world.machine(number)
            assert machine.execute() == "succeeded"
            assert machine.userdata.result == number
        assert world.runs == [1, 2, 3, 4, 5]


@pytest.mark.parametrize("seed", range(25))
@pytest.mark.parametrize("moment", [0.0, 0.1, 1.5, 3.0])
def test_a_preempt_reaches_the_robot(seed, moment):
    with World(seed, drop=0.3, repeat=0.3, delay=0.3, longest=2.0) as world:
        machine = world.machine()
        world.clock.call_later(moment, machine.request_preempt)
        outcome = machine.execute()
        assert outcome == "preempted" or (outcome == "succeeded" and machine.userdata.result == 1)
        world.clock.sleep(20.0)
        assert not world.server.is_active()
        if outcome == "preempted":
            assert world.runs in ([], [1])


@pytest.mark.parametrize(
    ("cut_s", "outcome"), [(2.0, "succeeded"), (4.0, "succeeded"), (30.0, "aborted")]
)
@pytest.mark.parametrize("at", [0.5, 2.5])
def test_a_cut_shorter_than_the_lease_is_survived_and_a_longer_one_is_noticed(cut_s, outcome, at):
    with World() as world:
        machine = world.machine()
        world.clock.call_later(at, lambda: world.mission.transport.cut(cut_s))
        start = world.clock.now()
        assert machine.execute() == outcome
        took = world.clock.now() - start
        assert took == pytest.approx(at + 5.0, abs=0.5) if outcome == "aborted" else took < 10.0
        world.clock.sleep(60.0)
        assert world.machine().execute() == "succeeded"  # and the link is used again


def test_a_preempt_while_the_link_is_cut_is_bounded():
    with World() as world:
        machine = world.machine(preempt_timeout=2.0)
        world.clock.call_later(1.0, world.mission.transport.cut)
        world.clock.call_later(1.5, machine.request_preempt)
        start = world.clock.now()
        assert machine.execute() == "preempted"
        assert world.clock.now() - start == pytest.approx(3.5)
