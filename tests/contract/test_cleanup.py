"""A clean-up runs once at every end of its machine, and changes nothing of that end."""

from __future__ import annotations

import asyncio
import copy
import threading
import warnings
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import smachpy
from actionlib_core.clock import VirtualClock, current_clock, use_clock
from smachpy import (
    Concurrence,
    Ending,
    InvalidConstructionError,
    InvalidStateError,
    InvalidUserCodeError,
    Iterator,
    Sequence,
    State,
    StateMachine,
)
from smachpy.checks import after_any_end, check
from smachpy.engine import shutdown_check
from smachpy.events import PreemptRequested
from smachpy.pnp import PetriNetPlan
from smachpy.testing import explore, mission_kit
from tests.smachpy.pnp.nets import net_of


class Step(State):
    def __init__(self, seconds: float = 1.0, **options: Any) -> None:
        super().__init__(["done", "preempted"], **options)
        self.seconds = seconds

    def execute(self, userdata: Any) -> str:
        return "preempted" if self.sleep(self.seconds) else "done"


class Raising(State):
    def __init__(self) -> None:
        super().__init__(["done"])

    def execute(self, userdata: Any) -> str:
        raise OSError("no such door")


class Dock(Step):
    def __init__(self, seconds: float = 1.0, **options: Any) -> None:
        super().__init__(seconds, **options)
        self.endings: list[Ending | None] = []

    def execute(self, userdata: Any) -> str:
        self.endings.append(smachpy.current_ending())
        return super().execute(userdata)


def machine_of(state: State, cleanup: State, **options: Any) -> StateMachine:
    sm = StateMachine(["done", "aborted", "preempted"], name="M", **options)
    with sm:
        sm.add("WORK", state)
        sm.add_cleanup("DOCK", cleanup)
    return sm


def test_it_runs_after_success():
    dock = Dock()
    with mission_kit() as mission:
        run = mission(machine_of(Step(), dock))
    assert (run.outcome, run.path) == ("done", ("/M/WORK", "/M/DOCK"))
    assert dock.endings == [Ending("done", "", preempted=False)]


def test_it_runs_after_an_exception_which_is_raised_afterwards():
    dock = Dock(0.0)
    with pytest.raises(InvalidUserCodeError, match="no such door"):
        machine_of(Raising(), dock).execute()
    (ending,) = dock.endings
    assert ending.outcome is None
    assert "no such door" in ending.error


def test_it_runs_after_a_timeout_of_the_machine():
    dock = Dock()
    outer = StateMachine(["done", "aborted", "preempted"])
    with outer:
        outer.add("M", machine_of(Step(60.0), dock, timeout=5.0))
    with mission_kit() as mission:
        run = mission(outer)
    assert run.outcome == "aborted"
    assert run.duration == 6.0
    assert dock.endings == [Ending("preempted", "", preempted=True)]


@pytest.mark.parametrize("how", ["preempt", "interrupt"])
def test_it_runs_after_a_request_to_stop(how):
    dock = Dock(30.0)
    with mission_kit() as mission:
        getattr(mission, how)(at=2.0)
        run = mission(machine_of(Step(60.0), dock))
    assert run.outcome == "preempted"
    assert run.duration == 32.0
    assert run.preempted
    assert dock.endings == [Ending("preempted", "", preempted=True)]


def test_it_runs_after_a_state_that_finishes_as_the_request_comes():
    sm = StateMachine(["done", "preempted"], name="M")

    @smachpy.state(["done"])
    def finishing(userdata):
        sm.request_preempt()
        return "done"

    with sm:
        sm.add("WORK", finishing, {"done": "MORE"})
        sm.add("MORE", Step())
        sm.add_cleanup("DOCK", Dock())
    with mission_kit() as mission:
        run = mission(sm)
    assert (run.outcome, run.path) == ("preempted", ("/M/WORK", "/M/DOCK"))


def test_it_does_not_run_if_the_machine_was_asked_before_it_began():
    dock = Dock()
    sm = machine_of(Step(), dock)
    sm.request_preempt()
    assert sm.execute() == "preempted"
    assert dock.endings == []


def test_a_further_request_gives_it_its_grace():
    dock = Dock(8.0, preempt_timeout=10.0)
    with mission_kit() as mission:
        mission.preempt(at=1.0)
        mission.preempt(on="DOCK", after=2.0)
        run = mission(machine_of(Step(60.0), dock))
    assert run.duration == 9.0
    run.assert_outcome("preempted")


def test_after_its_grace_it_is_asked_to_stop_however_often_somebody_asks():
    dock = Dock(1000.0, preempt_timeout=5.0)
    with mission_kit() as mission:
        mission.preempt(at=1.0)
        for after in (2.0, 3.0, 4.0, 6.0):
            mission.preempt(on="DOCK", after=after)
        run = mission(machine_of(Step(60.0), dock))
    assert run.duration == 1.0 + 2.0 + 5.0


def test_a_first_request_while_it_runs_gives_it_its_grace_and_keeps_the_outcome():
    dock = Dock(3.0)
    with mission_kit() as mission:
        mission.preempt(on="DOCK", after=1.0)
        run = mission(machine_of(Step(), dock))
    assert (run.outcome, run.duration) == ("done", 4.0)


def test_a_request_while_it_runs_stops_the_machine_above():
    outer = StateMachine(["done", "aborted", "preempted"], name="O")
    with outer:
        outer.add("M", machine_of(Step(), Dock(3.0)), {"done": "NEXT"})
        outer.add("NEXT", Step())
    with mission_kit() as mission:
        mission.preempt(on="DOCK", after=1.0)
        run = mission(outer)
    assert (run.outcome, run.visits("NEXT"), run.duration) == ("preempted", 0, 4.0)


def test_a_clean_up_that_ignores_its_request_is_interrupted():
    class Deaf(State):
        def __init__(self) -> None:
            super().__init__(["done"], preempt_timeout=5.0)

        def execute(self, userdata: Any) -> str:
            self.clock().event("nothing").wait()
            return "done"

    with mission_kit() as mission:
        mission.preempt(at=1.0)
        mission.preempt(on="DOCK", after=2.0)
        run = mission(machine_of(Step(60.0), Deaf()))
    assert run.outcome == "preempted"
    assert run.duration == pytest.approx(1.0 + 2.0 + 5.0 + 5.0, abs=0.2)


def test_what_it_raises_is_reported_and_hides_nothing(caplog):
    sm = machine_of(Step(0.0), Raising())
    with mission_kit() as mission:
        run = mission(sm)
    assert run.outcome == "done"
    assert any("no such door" in text for text in caplog.messages)
    assert [event.path for event in run.events if type(event).__name__ == "Failed"] == ["/M/DOCK"]


def test_the_exception_of_the_work_is_raised_if_both_raise():
    class Other(Raising):
        def execute(self, userdata: Any) -> str:
            raise ValueError("the dock is gone")

    with pytest.raises(InvalidUserCodeError, match="no such door"):
        machine_of(Raising(), Other()).execute()


def test_an_operator_stops_it_at_once():
    sm = machine_of(Step(0.0), Dock(1000.0))

    def stop(event: Any) -> None:
        if type(event).__name__ == "Entered" and event.path == "/M/DOCK":
            threading.Thread(target=sm.control.preempt, args=("/M/DOCK",)).start()

    sm.subscribe(stop)
    assert sm.execute() == "done"


def test_it_may_be_a_machine_and_knows_the_ending_at_every_depth():
    dock = Dock()
    inner = Sequence(["done", "preempted"], "done")
    with inner:
        inner.add("STOP", Step())
        inner.add("DRIVE", dock)
    with mission_kit() as mission:
        mission.preempt(at=0.5)
        run = mission(machine_of(Step(60.0), inner))
    assert run.path == ("/M/WORK", "/M/DOCK/STOP", "/M/DOCK/DRIVE")
    assert dock.endings == [Ending("preempted", "", preempted=True)]


def test_no_ending_is_known_outside_of_a_clean_up():
    dock = Dock()
    with mission_kit() as mission:
        mission(machine_of(dock, Step()))
    assert dock.endings == [None]


def test_that_of_a_concurrence_runs_after_all_branches():
    cc = Concurrence(["done", "preempted"], "done", name="C")
    with cc:
        cc.add("A", Step(1.0))
        cc.add("B", Step(3.0))
        Concurrence.add_cleanup("STOP", Dock())
    with mission_kit() as mission:
        run = mission(cc)
    assert (run.outcome, run.duration, run.path[-1]) == ("done", 4.0, "/C/STOP")


def iterator_of(state: State, cleanup: State) -> Iterator:
    it = Iterator(["done", "preempted"], [], [], range(3), "item", "done", name="I")
    with it:
        Iterator.set_contained_state("EACH", state)
        Iterator.add_cleanup("STOP", cleanup)
    return it


def plan_of(state: State, cleanup: State) -> PetriNetPlan:
    net = """
        init* -> WORK.exec : WORK.start
        WORK.exec -> goal : WORK.end
    """
    plan = PetriNetPlan(net_of(net), {"WORK": state}, name="P")
    plan.add_cleanup("STOP", cleanup)
    return plan


def test_that_of_an_iterator_runs_after_the_last_item():
    it = iterator_of(Step(1.0), Dock())
    with mission_kit() as mission:
        run = mission(it)
    assert (run.outcome, run.duration) == ("done", 4.0)
    assert (run.visits("EACH"), run.visits("STOP")) == (3, 1)
    assert it["STOP"].endings == [Ending("done", "", preempted=False)]


def test_another_child_of_an_iterator_leaves_its_clean_up():
    it = iterator_of(Step(), Dock())
    it.set_contained_state("OTHER", Step())
    with pytest.raises(InvalidStateError):
        it.set_contained_state("STOP", Step())
    with mission_kit() as mission:
        run = mission(it)
    assert (run.visits("OTHER"), run.visits("STOP")) == (3, 1)


def test_an_iterator_needs_another_state():
    it = Iterator(["done"], [], [], range(3), "item", "done", name="I")
    it.add_cleanup("STOP", Dock())
    with pytest.raises(smachpy.InconsistentMachineError, match="contained state: got none"):
        it.execute()


def test_that_of_a_plan_runs_after_its_goal():
    dock = Dock()
    with mission_kit() as mission:
        run = mission(plan_of(Step(2.0), dock))
    assert (run.outcome, run.duration, run.path) == ("goal", 3.0, ("/P/WORK", "/P/STOP"))
    assert dock.endings == [Ending("goal", "", preempted=False)]


@pytest.mark.parametrize("make", [iterator_of, plan_of])
def test_those_run_once_and_the_same_at_every_end(make):
    found = explore(
        lambda: make(Step(), Dock()),
        preempts=2,
        grace=60.0,
        invariants=[lambda run: run.visits("STOP") == 1],
    )
    found.assert_ok()
    assert found.exhaustive


@pytest.mark.parametrize("make", [iterator_of, plan_of])
def test_those_go_on_after_a_kill(make):
    found = explore(lambda: make(Step(), Dock()), preempts=1, faults=["kill"])
    found.assert_ok()
    assert found.exhaustive


@pytest.mark.parametrize("make", [iterator_of, plan_of])
def test_those_are_drawn_and_proved(make):
    machine = make(Step(), Dock())
    assert smachpy.describe(machine).cleanup == "STOP"
    assert "STOP" in machine._repr_svg_()
    report = check(machine, properties=[after_any_end("STOP")])
    assert not [problem for problem in report.problems if problem.rule == "property"]


def test_inner_clean_ups_run_first():
    inner = machine_of(Step(60.0), Dock())
    outer = StateMachine(["done", "aborted", "preempted"], name="O")
    with outer:
        outer.add("M", inner)
        outer.add_cleanup("HOME", Dock())
    with mission_kit() as mission:
        mission.preempt(at=1.0)
        run = mission(outer)
    assert run.path == ("/O/M/WORK", "/O/M/DOCK", "/O/HOME")


def test_it_reads_and_writes_the_userdata_of_its_machine():
    @smachpy.state(["done"], input_keys=["at"], output_keys=["log"])
    def note(userdata):
        userdata.log = f"left {userdata.at}"
        return "done"

    sm = StateMachine(["done", "preempted"], output_keys=["report"], userdata={"place": "hall"})
    with sm:
        sm.add("WORK", Step(0.0))
        sm.add_cleanup("NOTE", note, {"at": "place", "log": "report"})
    sm.execute()
    assert sm.userdata.report == "left hall"


def test_a_second_one_is_refused():
    sm = machine_of(Step(), Dock())
    with pytest.raises(InvalidStateError, match=r"second one, beside 'DOCK'.*Try a Sequence"):
        sm.add_cleanup("HOME", Dock())


def test_a_transition_to_it_is_refused():
    sm = StateMachine(["done", "preempted"], name="M")
    sm.add("WORK", Step(), {"done": "DOCK"})
    sm.add_cleanup("DOCK", Dock())
    with pytest.raises(smachpy.InconsistentMachineError, match="leads nowhere: got 'DOCK'"):
        sm.execute()


def test_a_machine_needs_another_state():
    sm = StateMachine(["done"], name="M")
    sm.add_cleanup("DOCK", Dock())
    with pytest.raises(smachpy.InconsistentMachineError, match="states: got none"):
        sm.execute()


def test_it_cannot_be_added_while_the_machine_runs():
    sm = StateMachine(["done"], name="M")

    @smachpy.state(["done"])
    def adding(userdata):
        sm.add_cleanup("DOCK", Dock())
        return "done"

    sm.add("WORK", adding)
    with pytest.raises(InvalidConstructionError, match="got a new clean-up while it runs"):
        sm.execute()


def test_a_copy_has_it_too():
    dock = Dock(0.0)
    sm = copy.deepcopy(machine_of(Step(0.0), dock))
    assert sm.execute() == "done"
    assert sm["DOCK"].endings == [Ending("done", "", preempted=False)]


def test_a_jump_to_it_is_refused():
    sm = machine_of(Step(), Dock())
    refused = []

    @smachpy.state(["done"])
    def jumping(userdata):
        try:
            sm.control.jump("/M/DOCK")
        except smachpy.SmachError as error:
            refused.append(str(error))
        return "done"

    sm = StateMachine(["done", "preempted"], name="M")
    sm.add("WORK", jumping)
    sm.add_cleanup("DOCK", Dock(0.0))
    sm.execute()
    assert "no jump there" in refused[0]


def test_a_run_cannot_begin_with_it():
    with pytest.raises(InvalidStateError, match=r"got \['DOCK'\]; expected one of \['WORK'\]\."):
        machine_of(Step(), Dock()).set_initial_state(["DOCK"])


def test_check_proves_that_no_end_goes_without():
    with_it = machine_of(Step(), Dock())
    report = check(with_it, properties=[after_any_end("DOCK")])
    assert not [problem for problem in report.problems if problem.rule == "property"]
    by_hand = StateMachine(["done", "preempted"], name="M")
    with by_hand:
        by_hand.add("WORK", Step(), {"done": "DOCK", "preempted": "DOCK"})
        by_hand.add("DOCK", Dock())
    report = check(by_hand, properties=["after_any_end(DOCK)"])
    assert [problem.rule for problem in report.problems if problem.severity == "error"] == [
        "property"
    ]


def test_every_way_runs_it_once():
    found = explore(
        lambda: machine_of(Step(), Dock()),
        preempts=2,
        grace=60.0,
        invariants=[lambda run: run.visits("DOCK") == 1],
    )
    found.assert_ok()
    assert found.exhaustive


def test_a_mission_that_is_killed_anywhere_goes_on_to_the_same_end():
    found = explore(lambda: machine_of(Step(), Dock()), preempts=2, faults=["kill"])
    found.assert_ok()
    assert found.exhaustive


def test_a_service_in_a_callback_of_a_container_lets_the_machine_above_go_on():
    inner = StateMachine(["done", "preempted"])

    @smachpy.state(["done"])
    def finishing(userdata):
        outer.request_preempt()
        return "done"

    inner.add("WORK", finishing)
    inner.register_termination_cb(lambda *_: inner.service_preempt())
    outer = StateMachine(["done", "preempted"], name="O")
    outer.add("IN", inner, {"done": "DOCK"})
    outer.add("DOCK", Step())
    with mission_kit() as mission:
        run = mission(outer)
    assert (run.outcome, run.visits("DOCK")) == ("done", 1)


NESTED = st.recursive(
    st.just("leaf"),
    lambda below: st.tuples(st.sampled_from(["machine", "concurrence"]), below, below),
    max_leaves=4,
)


def build(tree: Any, cleanups: list[str], path: str) -> State:
    if tree == "leaf":
        return Step()
    kind, first, second = tree
    container: Any
    if kind == "machine":
        container = StateMachine(["done", "preempted"])
        container.add("A", build(first, cleanups, f"{path}/A"), {"done": "B"})
    else:
        container = Concurrence(["done", "preempted"], "done")
        container.add("A", build(first, cleanups, f"{path}/A"))
    container.add("B", build(second, cleanups, f"{path}/B"))
    container.add_cleanup("Z", Step())
    cleanups.append(path)
    return container


@settings(max_examples=50, deadline=None)
@given(NESTED, st.floats(0.0, 12.0), st.floats(0.0, 6.0))
def test_each_machine_that_began_cleans_up_once_whenever_somebody_asks(tree, first, more):
    owners: list[str] = []
    root = StateMachine(["done", "preempted"], name="R")
    root.add("M", build(tree, owners, "/R/M"))
    root.add_cleanup("Z", Step())
    with mission_kit() as mission:
        mission.preempt(at=first)
        mission.preempt(at=first + more)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a preempt after the end
            run = mission(root)
    for owner in [*owners, "/R"]:
        first_child = "M" if owner == "/R" else "A"
        begun, cleaned = run.visits(f"{owner}/{first_child}"), run.visits(f"{owner}/Z")
        assert cleaned <= 1
        assert cleaned == 1 or not begun


def test_it_is_not_lost_if_an_operator_holds_it_for_longer_than_its_grace():
    """Asked to stop, then cancelled by a pause, it was called off after its grace."""
    dock = Dock(5.0)
    both = Concurrence(["done", "preempted"], "done", name="BOTH")
    both.add("BROKEN", Raising())  # the other is asked to stop, and then its clean-up
    both.add("WORK", machine_of(Step(0.0), dock))
    with mission_kit() as mission:
        mission.clock.call_later(1.0, lambda: both.control.pause(running="cancel"))
        mission.clock.call_later(60.0, both.control.resume)
        with pytest.raises(InvalidUserCodeError, match="no such door"):
            mission(both)
        assert mission.clock.now() >= 65.0
    assert len(dock.endings) == 2


class Ends(State):
    """Raises what it is given, if it is."""

    def __init__(self, error: BaseException | None, **options: Any) -> None:
        super().__init__(["done", "aborted"], **options)
        self.runs = 0
        self.error = error

    def execute(self, userdata: Any) -> str:
        self.runs += 1
        if self.error is None:
            return "done"
        raise self.error


def concurrence_of(state: State, cleanup: State) -> Concurrence:
    both = Concurrence(["done", "preempted"], "done", name="C")
    both.add("WORK", state)
    both.add("OTHER", Step(60.0))
    both.add_cleanup("STOP", cleanup)
    return both


CONTAINERS = [machine_of, concurrence_of, iterator_of, plan_of]


@pytest.mark.parametrize(
    "options", [{}, {"timeout": 60.0}, {"retry": (2, 0.0, "aborted")}], ids=str
)
@pytest.mark.parametrize("make", CONTAINERS)
def test_it_runs_after_sys_exit_of_a_state_which_ends_the_program_afterwards(make, options):
    dock = Dock(0.0)
    machine = make(Ends(SystemExit(3), **options), dock)
    for _ in range(2):
        with use_clock(VirtualClock()), pytest.raises(SystemExit) as ends:
            machine.execute()
        assert ends.value.code == 3
    assert dock.endings == [Ending(None, "SystemExit: 3", preempted=False)] * 2


@pytest.mark.parametrize("make", CONTAINERS)
def test_what_ends_the_program_at_once_ends_it_without(make):
    dock = Dock(0.0)
    with use_clock(VirtualClock()), pytest.raises(KeyboardInterrupt):
        make(Ends(KeyboardInterrupt()), dock).execute()
    assert dock.endings == []


def test_sys_exit_in_a_durable_mission_leaves_all_to_the_next_process(tmp_path):
    """As its goals, which are followed there."""
    dock, where = Dock(0.0), tmp_path / "missions.db"
    with pytest.raises(SystemExit):
        smachpy.run_durable(machine_of(Ends(SystemExit(3)), dock), where, mission="m")
    assert dock.endings == []
    assert smachpy.run_durable(machine_of(Ends(None), dock), where, mission="m") == "done"
    assert dock.endings == [Ending("done", "", preempted=False)]


@pytest.mark.parametrize("options", [{}, {"timeout": 60.0}, {"on_enter": repr}], ids=str)
@pytest.mark.parametrize("make", CONTAINERS)
def test_a_cancelled_error_of_asyncio_is_an_error_of_the_state(make, options):
    """It went through all machines, without clean-ups, and cancelled who waited for the mission."""
    dock = Dock(0.0)
    with use_clock(VirtualClock()), pytest.raises(InvalidUserCodeError, match=CANCELLED) as caught:
        make(Ends(asyncio.CancelledError(), **options), dock).execute()
    assert len(dock.endings) == 1
    assert caught.value.path.endswith(("/WORK", "/EACH"))


CANCELLED = "RuntimeError: got a CancelledError of asyncio; expected an outcome"


def test_a_cancelled_error_of_asyncio_is_retried_and_covered_by_on_exception():
    options = {"retry": (3, 0.0, RuntimeError), "on_exception": {RuntimeError: "aborted"}}
    work = Ends(asyncio.CancelledError(), **options)
    sm = StateMachine(["done", "aborted"])
    sm.add("WORK", work)
    assert sm.execute() == "aborted"
    assert work.runs == 3


class Answers(State):
    """Services its request, and tells by its outcome what it has done."""

    def __init__(self) -> None:
        super().__init__(["parked", "preempted"])

    def execute(self, userdata: Any) -> str:
        self.wait_preempt()
        self.service_preempt()
        return "parked"


@pytest.mark.parametrize("cleanup", [False, True])
def test_the_machine_above_goes_on_after_a_serviced_request_as_it_would_without(cleanup):
    dock = Dock()
    inner = StateMachine(["parked", "preempted"])
    inner.add("WORK", Answers())
    if cleanup:
        inner.add_cleanup("DOCK", dock)
    outer = StateMachine(["done", "preempted"], name="O")
    outer.add("IN", inner, {"parked": "NEXT"})
    outer.add("NEXT", Step())
    with mission_kit() as mission:
        mission.preempt(at=1.0)
        run = mission(outer)
    assert (run.outcome, run.visits("NEXT")) == ("done", 1)
    assert dock.endings == ([Ending("parked", "", preempted=True)] if cleanup else [])


def test_termination_callbacks_get_the_state_that_ended_the_machine():
    ends = []
    sm = machine_of(Step(0.0), Dock(0.0))
    sm.register_termination_cb(lambda userdata, labels, outcome: ends.append((labels, outcome)))
    sm.execute()
    assert ends == [(["WORK"], "done")]


def block(*_: Any) -> None:
    current_clock().event("nothing").wait()


@pytest.mark.parametrize("during", [False, True])
def test_a_termination_callback_that_blocks_has_its_grace_after_the_clean_up(during):
    sm = machine_of(Step(5.0), Dock(3.0), preempt_timeout=2.0)
    sm.register_termination_cb(block)
    with mission_kit() as mission:
        mission.preempt(on="DOCK" if during else "WORK", after=1.0)
        run = mission(sm)
    assert run.outcome == "preempted"
    assert run.duration == pytest.approx(5.0 * during + 1.0 * (not during) + 3.0 + 2.0, abs=0.2)


def test_it_runs_after_a_callback_that_was_interrupted():
    dock = Dock(3.0)
    sm = StateMachine(["done", "preempted"], name="M", preempt_timeout=2.0)
    sm.add("WORK", Step(1.0), {"done": "MORE"})
    sm.add("MORE", Step())
    sm.add_cleanup("DOCK", dock)
    sm.register_transition_cb(block)
    with mission_kit() as mission:
        mission.preempt(at=4.0)
        run = mission(sm)
    assert (run.outcome, run.path) == ("preempted", ("/M/WORK", "/M/DOCK"))
    assert run.duration == pytest.approx(4.0 + 2.0 + 3.0, abs=0.2)
    assert dock.endings == [Ending("preempted", "", preempted=True)]


def test_a_shutdown_check_that_has_stopped_the_others_does_not_stop_it():
    answers = iter([False, True])
    dock = Dock(30.0)
    try:
        smachpy.set_shutdown_check(lambda: next(answers, True))
        sm = machine_of(Step(), dock)
        sm.add("MORE", Step())
        sm._smachpy.transitions["WORK"]["done"] = "MORE"
        with mission_kit() as mission:
            run = mission(sm)
    finally:
        shutdown_check.reset_shutdown_check()
    assert (run.outcome, run.path, run.duration) == ("preempted", ("/M/WORK", "/M/DOCK"), 31.0)


def test_a_mission_that_has_raised_goes_on_with_that_state_and_cleans_up_again(tmp_path):
    dock, where = Dock(0.0), tmp_path / "missions.db"
    with pytest.raises(InvalidUserCodeError):
        smachpy.run_durable(machine_of(Ends(OSError("no door")), dock), where, mission="m")
    works = Ends(None)
    assert smachpy.run_durable(machine_of(works, dock), where, mission="m") == "done"
    assert works.runs == 1
    assert [ending.outcome for ending in dock.endings if ending] == [None, "done"]


def test_who_asked_again_is_told_when_it_is_asked_to_stop_after_its_grace():
    heard: list[PreemptRequested] = []
    sm = machine_of(Step(60.0), Dock(1000.0, preempt_timeout=5.0))
    sm.subscribe(lambda e: heard.append(e) if isinstance(e, PreemptRequested) else None)
    with mission_kit() as mission:
        mission.preempt(at=1.0)
        mission.preempt(on="DOCK", after=2.0)
        mission(sm)
    (dock,) = [event for event in heard if event.path == "/M/DOCK"]
    (again,) = [event for event in heard if event.path == "/M"][1:]
    assert dock.asker == again.asker
