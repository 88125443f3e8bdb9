"""Plans and `PNPCmd` with a robot that runs PNP's action server: here a twin of it, in memory."""

from __future__ import annotations

from typing import Any

import pytest

import smachpy
from actionlib_core.action.server import ActionServer
from actionlib_core.interfaces import get_action, get_service
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.node import use_node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import Publisher
from smachpy.actions.goal_run import GoalFollower
from smachpy.exceptions import InvalidStateError, InvalidUserCodeError
from smachpy.pnp import PetriNetPlan, PlanError, PNPCmd, PNPServer, load_plan, write_pnml
from smachpy.pnp.server import _ACTION, _CONDITION, ServerAction, _interface
from tests.smachpy.durable.killing_store import Kill
from tests.smachpy.durable.test_plans import Cut
from tests.smachpy.pnp.nets import net_of
from tests.two_nodes import TwoNodes

SENSING = """
init* -> goto_kitchen.exec : goto_kitchen.start
goto_kitchen.exec -> there : goto_kitchen.end
goto_kitchen.exec -> blocked : goto_kitchen.interrupt [obstacle]
there -> robot_1#say_hello_you.exec : robot_1#say_hello_you.start
robot_1#say_hello_you.exec -> goal : robot_1#say_hello_you.end
"""


class Robot(TwoNodes):
    """Each action lasts 2 s, or until it is interrupted; conditions are what the test says."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[str] = []
        self.asked: list[str] = []
        self.holds: set[str] = set()
        self.running: dict[int, Any] = {}

    def __enter__(self) -> Robot:
        super().__enter__()
        self._using.enter_context(use_node(self.mission))
        spec = _interface("action", "PNP", _ACTION)
        self.server = ActionServer("PNP", spec, self.take, auto_start=False, node=self.robot)
        self.server.start()
        condition = _interface("srv", "PNPCondition", _CONDITION)
        self.service = Service("pnp/conditionEval", condition, self.answer, node=self.robot)
        self.events = Publisher("pnp/conditionEvent", String, node=self.robot)
        return self

    def take(self, handle: Any) -> None:
        goal = handle.get_goal()
        whole = f"{goal.robotname}#{goal.name}_{goal.params}".lstrip("#")
        self.told.append(f"{whole} {goal.function}")
        handle.set_accepted()
        if goal.function == "start":
            self.running[goal.id] = handle
            self.clock.call_later(2.0, lambda: self.end(goal.id))
            return
        handle.set_succeeded()
        self.end(goal.id)

    def end(self, number: int) -> None:
        handle = self.running.pop(number, None)
        if handle is not None:
            handle.set_aborted() if "broken" in self.holds else handle.set_succeeded()

    def answer(self, request: Any) -> int:
        self.asked.append(request.cond)
        return int(request.cond in self.holds)

    def says(self, condition: str) -> None:
        self.holds.add(condition)
        self.events.publish(String(condition))


def test_the_robot_does_all_actions_by_their_names() -> None:
    with Robot() as robot:
        plan = PetriNetPlan(net_of(SENSING), server=PNPServer())
        assert plan.execute() == "goal"
        assert robot.told == ["goto_kitchen start", "robot_1#say_hello_you start"]
        assert robot.clock.now() == pytest.approx(4.0, abs=0.1)
        assert set(robot.asked) == {"obstacle"}


def test_an_event_of_the_robot_lets_the_plan_look_at_once_and_interrupts() -> None:
    with Robot() as robot:
        plan = PetriNetPlan(net_of(SENSING + "blocked -> goal : out"), server=PNPServer(every=60))
        robot.clock.call_later(1.0, lambda: robot.says("obstacle"))
        assert plan.execute() == "goal"
        assert robot.clock.now() == pytest.approx(1.0, abs=0.1)
        assert robot.told == ["goto_kitchen start", "goto_kitchen interrupt"]


def test_a_condition_whose_name_begins_like_a_built_in_one_is_asked_for() -> None:
    """It was false, without a question to the robot."""
    with Robot() as robot:
        robot.holds.add("true_north")
        text = SENSING.replace("obstacle", "true_north") + "blocked -> goal : out"
        assert PetriNetPlan(net_of(text), server=PNPServer()).execute() == "goal"
        assert robot.asked[0] == "true_north"
        assert robot.told == ["goto_kitchen start", "goto_kitchen interrupt"]


def test_a_condition_without_an_event_is_asked_for_again() -> None:
    with Robot() as robot:
        plan = PetriNetPlan(net_of(SENSING + "blocked -> goal : out"), server=PNPServer(every=0.5))
        robot.clock.call_later(1.2, lambda: robot.holds.add("obstacle"))
        assert plan.execute() == "goal"
        assert robot.clock.now() == pytest.approx(1.5, abs=0.1)


def test_what_is_registered_or_said_here_is_not_asked_for() -> None:
    with Robot() as robot:
        text = SENSING + "blocked -> goal : out"
        plan = PetriNetPlan(net_of(text), conditions={"obstacle": True}, server=PNPServer())
        assert plan.execute() == "goal"
        plan = PetriNetPlan(net_of(text), server=PNPServer())
        plan.set_condition("obstacle", value=True)
        assert plan.execute() == "goal"
        assert robot.asked == []


def test_an_action_that_the_robot_aborts_has_failed() -> None:
    with Robot() as robot:
        robot.holds.add("broken")
        text = "init* -> a.exec : a.start\na.exec -> goal : a.end\na.exec -> fail : a.fail"
        assert PetriNetPlan(net_of(text), server=PNPServer()).execute() == "fail"


def test_a_preempt_interrupts_the_action() -> None:
    with Robot() as robot:
        plan = PetriNetPlan(net_of(SENSING), server=PNPServer())
        robot.clock.call_later(1.0, plan.request_preempt)
        assert plan.execute() == "preempted"
        assert robot.told[-1] == "goto_kitchen interrupt"
        assert robot.running == {}


def test_an_interrupt_comes_after_the_goal_that_it_interrupts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The robot was told to stop, and then to begin: it drove on after the end of the plan."""
    with Robot() as robot:
        plan = PetriNetPlan(net_of(SENSING), server=PNPServer())
        send = GoalFollower.send

        def send_late(follower: GoalFollower, *goal: Any, **options: Any) -> None:
            plan.request_preempt()
            robot.clock.sleep(0.05)  # such as an entry in the journal takes
            send(follower, *goal, **options)

        monkeypatch.setattr(GoalFollower, "send", send_late)
        assert plan.execute() == "preempted"
        assert robot.told == ["goto_kitchen start", "goto_kitchen interrupt"]
        assert robot.running == {}


# What is left of a killed process fails, as its session is closed: nothing of it may get out.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_resumed_plan_interrupts_the_action_that_ran_before_the_kill() -> None:
    """The interrupt named no action: the robot drove on after the end of the plan."""
    store = Cut()
    text = """
    init* -> i j : fork
    i -> goto_kitchen.exec : goto_kitchen.start
    j -> wait_1.exec : wait_1.start
    wait_1.exec -> a : wait_1.end
    goto_kitchen.exec a -> goal : goto_kitchen.end
    """
    with Robot() as robot:
        plan = PetriNetPlan(net_of(text), server=PNPServer(), name="PLAN")
        robot.clock.call_later(0.5, lambda: store.arm(1, written=False))
        store.on_kill = robot.mission.transport.close
        with pytest.raises(Kill):
            smachpy.run_durable(plan, store, mission="m")
        store.arm(0, written=False)
        with use_node(robot.node("mission_2")):
            plan = PetriNetPlan(net_of(text), server=PNPServer(), name="PLAN")
            robot.clock.call_later(0.1, plan.request_preempt)
            assert smachpy.run_durable(plan, store, mission="m") == "preempted"
        assert robot.told == ["goto_kitchen start", "goto_kitchen interrupt"]
        assert robot.clock.now() == pytest.approx(1.1, abs=0.1)


def test_no_interrupt_of_a_goal_that_was_not_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    with Robot() as robot:
        fill = ServerAction._fill

        def fill_late(state: ServerAction, *given: Any) -> None:
            fill(state, *given)
            plan.request_preempt()
            robot.clock.sleep(0.05)

        monkeypatch.setattr(ServerAction, "_fill", fill_late)
        plan = PetriNetPlan(net_of(SENSING), server=PNPServer())
        assert plan.execute() == "preempted"
        assert robot.told == []


def test_a_robot_that_does_not_answer_ends_the_plan_with_an_error() -> None:
    with Robot() as robot:
        plan = PetriNetPlan(net_of(SENSING), server=PNPServer(conditions="nobody", timeout=3.0))
        with pytest.raises(InvalidUserCodeError):
            plan.execute()
        assert robot.clock.now() == pytest.approx(3.0, abs=0.1)
        assert robot.told == ["goto_kitchen start"]


def test_variables_and_their_actions_are_the_robots() -> None:
    with Robot() as robot:
        text = (
            "init* -> setvar_@V_x.exec : setvar_@V_x.start\nsetvar_@V_x.exec -> b : setvar_@V_x.end"
        )
        text += "\nb -> goto_@V.exec : goto_@V.start\ngoto_@V.exec -> goal : goto_@V.end"
        assert PetriNetPlan(net_of(text), server=PNPServer()).execute() == "goal"
        assert robot.told == ["setvar_@V_x start", "goto_@V start"]


def test_pnp_cmd_drives_the_robot() -> None:
    with Robot() as robot, PNPCmd(server=PNPServer(robot="robot_0")) as cmd:
        assert cmd.exec_action("goto", "7.5_-7.5_0.0") == "success"
        robot.clock.call_later(1.0, lambda: robot.says("obstacle"))
        how = cmd.exec_action("goto", "hall", interrupt="obstacle", recovery="wait_1; skip_action")
        assert how == "interrupt"
        assert cmd.get_condition("obstacle")
        assert not cmd.get_condition("door")
        assert robot.told == [
            "robot_0#goto_7.5_-7.5_0.0 start",
            "robot_0#goto_hall start",
            "robot_0#goto_hall interrupt",
        ]


def test_the_mapping_file_names_the_robot(tmp_path: Any) -> None:
    write_pnml(net_of(SENSING), tmp_path / "it.pnml")
    (tmp_path / "actions.yaml").write_text("server: true\n")
    with Robot() as robot:
        assert load_plan(tmp_path / "it.pnml").execute() == "goal"
        assert len(robot.told) == 2


@pytest.mark.parametrize("text", ["server: 7", "server: {acton: PNP}", "server: {every: soon}"])
def test_a_wrong_robot_is_told_with_its_line(tmp_path: Any, text: str) -> None:
    write_pnml(net_of(SENSING), tmp_path / "it.pnml")
    (tmp_path / "actions.yaml").write_text(f"# a comment\n{text}\n")
    with pytest.raises(PlanError) as caught:
        load_plan(tmp_path / "it.pnml")
    assert [problem.line for problem in caught.value.found] == [2]


@pytest.mark.parametrize(
    "options", [{"every": 0}, {"timeout": "long"}, {"robot": 7}, {"action": ""}]
)
def test_wrong_arguments_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(InvalidStateError):
        PNPServer(**options)


def test_the_interfaces_are_those_of_pnp_msgs() -> None:
    _interface("action", "PNP", _ACTION)
    _interface("srv", "PNPCondition", _CONDITION)
    assert [*get_action("pnp_msgs/PNP")().action_goal.goal.__slots__][:2] == ["id", "robotname"]
    assert get_service("pnp_msgs/PNPCondition") is not None
