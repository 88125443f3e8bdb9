"""A plan drives a robot of ROS 1 that runs PNP's action server, over the bridge."""

from __future__ import annotations

import pytest

from smachpy import events
from smachpy.pnp import PetriNetPlan, PNPCmd, PNPServer
from smachpy.pnp.server import _CONDITION, _interface
from tests.smachpy.pnp.nets import net_of

pytestmark = [pytest.mark.ros1, pytest.mark.zenoh]

WAIT_S = 60.0

PLAN = """
init* -> robot_0#goto_hall_2.exec : robot_0#goto_hall_2.start
robot_0#goto_hall_2.exec -> there : robot_0#goto_hall_2.end
there -> wander.exec : wander.start
wander.exec -> again : wander.end
again -> wander.exec : wander.start
wander.exec -> goal : wander.interrupt [obstacle]
"""


@pytest.fixture
def robot(ros, bridge):
    program = ros.start("pnp_action_server", _interface("srv", "PNPCondition", _CONDITION)._md5sum)
    bridge(actions=["PNP"], services=["/pnp/conditionEval"], topics=["/pnp/conditionEvent"])
    return program


def test_a_plan_runs_on_the_robot_until_its_event_interrupts(robot, node):
    plan = PetriNetPlan(net_of(PLAN), server=PNPServer(every=0.5, timeout=WAIT_S))

    def listen(event):
        if isinstance(event, events.GoalSent) and event.path == "/plan/wander":
            robot.say("obstacle")

    plan.subscribe(listen)
    assert plan.execute() == "goal"
    assert robot.read() == "robot_0 goto hall_2 start"
    told = [robot.read().split() for _ in range(2)]
    assert told == [["wander", "start"], ["wander", "interrupt"]]


def test_pnp_cmd_runs_actions_of_the_robot(robot, node):
    with PNPCmd(server=PNPServer(robot="robot_1", timeout=WAIT_S)) as cmd:
        assert cmd.exec_action("say", "hello_you") == "success"
        assert robot.read() == "robot_1 say hello_you start"
        assert not cmd.get_condition("door_open")
        robot.say("door_open")
        how = cmd.exec_action("wander", "off", interrupt="door_open", recovery="skip_action")
        assert how == "interrupt"
