"""Plans under the test kit, in explorations, recorded, and with a timeout and a retry of their own."""

import pytest

import smachpy
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from smachpy import State, StateMachine
from smachpy.exceptions import InvalidStateError
from smachpy.pnp import Goal, PetriNetPlan
from smachpy.testing import explore, mission_kit
from tests.smachpy.pnp.nets import net_of

FORK = """
init* -> i j : fork
i -> A.exec : A.start
j -> B.exec : B.start
A.exec -> a : A.end
B.exec -> b : B.end
A.exec -> fail : A.fail
a b -> goal : join
"""


class Leaf(State):
    def __init__(self):
        super().__init__(["succeeded", "aborted", "preempted"])

    def execute(self, ud):
        return "preempted" if self.sleep(1.0) else "succeeded"


def plan():
    return PetriNetPlan(net_of(FORK), {"A": Leaf(), "B": Leaf()})


def test_an_exploration_finds_the_outcomes_of_a_plan():
    outcomes = set()

    def note(run):
        outcomes.add(run.outcome)

    found = explore(plan, invariants=[note])
    assert found.ok, str(found)
    assert found.exhaustive
    assert {"goal", "fail"} <= outcomes


def test_a_recording_tells_where_the_tokens_were(clock):
    machine = plan()
    buffer = machine.event_buffer()
    assert machine.execute() == "goal"
    fired = [record for record in buffer.read() if record["kind"] == "Fired"]
    buffer.close()
    assert fired[-1]["transition"] == "t6"


def test_options_of_a_plan(clock):
    slow = PetriNetPlan(net_of("init* -> wait_60.exec : start\nwait_60.exec -> goal : end"), retry=(2, 0.0, ["late"]),
                        timeout=2.0, timeout_outcome="late")  # fmt: skip
    sm = StateMachine(["goal", "fail", "late", "preempted"])
    with sm:
        sm.add("P", slow)
    assert sm.execute() == "late"
    assert clock.now() == 4.0
    assert dict(smachpy.describe(sm).children[0].details)["timeout"] == "2 s -> late"


def test_an_unknown_case_in_a_variable_sends_no_goal():
    """The goal was sent without the case's fields: to the origin of the map."""
    cases = {"kitchen": {"target_pose.pose.position.x": 4.0}}
    goal = Goal("move_base", MoveBaseAction, {"target_pose.header.frame_id": "map"}, cases)
    net = net_of("init* -> goto_@place.exec : start\ngoto_@place.exec -> goal : end")
    with mission_kit() as mission:
        server = mission.action_server("move_base", MoveBaseAction)
        plan = PetriNetPlan(net, {"goto": goal}, userdata={"place": "kitchn"})
        with pytest.raises(InvalidStateError, match=r"cases: got 'kitchn'.*Did you mean 'kitchen'"):
            mission(plan)
        assert server.goals == []
        mission(PetriNetPlan(net, {"goto": goal}, userdata={"place": "kitchen"}))
        assert [goal.target_pose.pose.position.x for goal in server.goals] == [4.0]
