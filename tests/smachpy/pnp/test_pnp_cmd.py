"""`PNPCmd`: actions and plans one by one, as programs for PNP's own class use it."""

import pytest

import smachpy
from smachpy.exceptions import InvalidStateError
from smachpy.pnp import PetriNetPlan, PlanError, PNPCmd, write_pnml
from tests.smachpy.pnp.nets import net_of


@pytest.fixture
def log():
    return []


@pytest.fixture
def cmd(clock, log):
    def goto(ud, *words):
        log.append(f"goto {' '.join(words)}")
        return "preempted" if smachpy.current_state().sleep(5.0) else "succeeded"

    def say(ud, *words):
        log.append(f"say {' '.join(words)}")

    with PNPCmd({"goto": goto, "say": say, "fail": lambda ud: False}) as cmd:
        yield cmd


def test_an_action_to_its_end(cmd, log, clock):
    assert cmd.exec_action("goto", "kitchen") == "success"
    assert cmd.exec_action("say", ["hello", "you"]) == "success"
    assert cmd.exec_action("fail") == "failure"
    assert log == ["goto kitchen", "say hello you"]
    assert clock.now() == 5.0
    assert cmd.action_status("goto", "kitchen") == "success"
    assert cmd.action_status("goto", "hall") == ""


def test_interrupt_and_recovery(cmd, log, clock):
    clock.call_later(2.0, lambda: cmd.post("obstacle"))
    done = cmd.exec_action(
        "goto", "kitchen", interrupt="obstacle", recovery="say_sorry; restart_action"
    )
    assert (done, log) == ("success", ["goto kitchen", "say sorry", "goto kitchen"])
    assert clock.now() == 7.0


def test_a_timeout_interrupts(cmd, clock):
    assert cmd.exec_action("goto", "kitchen", interrupt="timeout_3") == "interrupt"
    assert clock.now() == 3.0


def test_started_and_interrupted(cmd, clock):
    cmd.start_action("goto", "kitchen")
    assert cmd.action_status("goto", "kitchen") == "run"
    assert cmd.running_actions() == ["goto_kitchen"]
    with pytest.raises(InvalidStateError, match="already running"):
        cmd.start_action("goto", "kitchen")
    clock.call_later(1.0, lambda: cmd.action_cmd("goto", "kitchen", "interrupt"))
    assert not cmd.wait_for_termination(0.5)
    assert cmd.wait_for_termination()
    assert cmd.action_status("goto", "kitchen") == "interrupt"
    assert clock.now() == 1.0


def test_end_stops_what_runs(clock):
    cmd = PNPCmd({"goto": lambda ud: smachpy.current_state().sleep(60.0) and "preempted"})
    cmd.begin()
    cmd.start_action("goto")
    clock.sleep(1.0)
    cmd.end()
    assert clock.now() == 1.0
    assert cmd.running_actions() == []


def test_conditions(cmd):
    cmd.set_condition("door", True)
    assert cmd.get_condition("door")
    cmd.set_condition("door", False)
    assert not cmd.get_condition("door")
    cmd.post("seen")
    assert [cmd.get_condition("seen"), cmd.get_condition("seen")] == [True, False]


def test_plans(clock, tmp_path, log):
    write_pnml(
        net_of("init* -> wait_2.exec : start\nwait_2.exec -> goal : end"), tmp_path / "rest.pnml"
    )
    cmd = PNPCmd(plan_folder=tmp_path)
    assert cmd.execute_plan("rest") == "goal"
    cmd.plan_cmd("rest", "start")
    assert (cmd.plan_name(), cmd.plan_status()) == ("rest", "run")
    cmd.plan_cmd("rest", "stop")
    cmd.end()
    assert cmd.plan_status() == "preempted"
    with pytest.raises(PlanError, match="Did you mean 'rest'"):
        cmd.execute_plan("rset")


@pytest.mark.parametrize("how", ["post", "set", "set before"])
def test_events_and_conditions_reach_a_plan_that_was_started(clock, tmp_path, log, how):
    """Only single actions heard of them."""
    net = net_of("init* -> goal : t [obstacle]")
    write_pnml(net, tmp_path / "watch.pnml")
    with PNPCmd(plan_folder=tmp_path) as cmd:
        if how == "set before":
            cmd.set_condition("obstacle", True)
        cmd.start_plan("watch")
        clock.sleep(1.0)
        if how == "set":
            cmd.set_condition("obstacle", True)
        elif how == "post":
            cmd.post("obstacle")
        assert cmd.wait_for_termination(1.0)
        assert cmd.plan_status() == "goal"


def test_events_reach_an_action_that_is_a_plan(clock):
    watch = PetriNetPlan(net_of("init* -> goal : t [obstacle]"))
    with PNPCmd({"watch": watch}) as cmd:
        clock.call_later(1.0, lambda: cmd.post("obstacle"))
        assert cmd.exec_action("watch") == "success"
        assert clock.now() == 1.0


@pytest.mark.parametrize(
    "call",
    [
        lambda cmd: cmd.exec_action("fly"),
        lambda cmd: cmd.exec_action("go to"),
        lambda cmd: cmd.exec_action("goto", "x", recovery="say_sorry"),
        lambda cmd: cmd.exec_action("goto", "x", interrupt="a and b"),
        lambda cmd: cmd.exec_action("goto", "x", interrupt="c", recovery="say_sorry"),
        lambda cmd: cmd.action_cmd("goto", "x", "begin"),
        lambda cmd: cmd.plan_cmd("x", "begin"),
    ],
)
def test_bad_input(cmd, call, log):
    with pytest.raises(InvalidStateError):
        call(cmd)
    assert log == []
    assert cmd.running_actions() == []
