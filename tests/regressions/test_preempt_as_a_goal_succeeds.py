"""A goal that succeeds although it was being cancelled must not hide the preempt."""

from __future__ import annotations

import pytest

import smachpy
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.node import Node, use_node
from actionlib_core.transport.memory import MemoryNetwork


@pytest.mark.parametrize("seed", range(4))
def test_no_further_state_starts(clock, seed):
    goals = []

    def execute(goal):
        goals.append(goal.goal)
        clock.sleep(1.0)
        server.set_succeeded(msg.TestResult())

    network = MemoryNetwork(clock)
    with (
        Node("server", transport=network.session(), clock=clock) as server_node,
        Node("mission", transport=network.session(), clock=clock) as node,
        use_node(node),
    ):
        server = SimpleActionServer("work", msg.TestAction, execute, True, node=server_node)
        outcomes = ["succeeded", "aborted", "preempted"]
        outer = smachpy.StateMachine(outcomes=outcomes)
        inner = smachpy.StateMachine(outcomes=outcomes)
        with inner:
            for number, following in ((1, "B"), (2, "succeeded")):
                smachpy.StateMachine.add(
                    "AB"[number - 1],
                    smachpy.SimpleActionState("work", msg.TestAction, goal=msg.TestGoal(number)),
                    transitions={"succeeded": following},
                )
        with outer:
            smachpy.StateMachine.add("INNER", inner)
        got = []
        task = clock.spawn(lambda: got.append(outer.execute()), name="mission")
        clock.sleep(0.5 + seed / 10)
        outer.request_preempt()
        assert task.join(60.0)
        server.stop()
    assert got == ["preempted"]
    assert goals == [1]
