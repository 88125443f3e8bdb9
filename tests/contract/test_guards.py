"""Conditions of transitions: which one counts, when they are asked, what is refused."""

from __future__ import annotations

import asyncio
import copy
import math
from typing import Any

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, use_clock
from smachpy import InvalidStateError, InvalidUserCodeError, State, StateMachine, When, when
from smachpy.checks import check
from smachpy.testing import explore, mission_kit


class Step(State):
    def __init__(self, value: Any = None, seconds: float = 0.0) -> None:
        super().__init__(["done", "preempted"], output_keys=["value"])
        self.value, self.seconds = value, seconds

    def execute(self, userdata: Any) -> str:
        if self.value is not None:
            userdata.value = self.value
        return "preempted" if self.seconds and self.sleep(self.seconds) else "done"


LOW = when("value < 0.3", "LOW")
HIGH = when(lambda userdata: userdata.value > 0.9, "HIGH")


def machine_of(cases: Any, value: Any = None, seconds: float = 0.0) -> StateMachine:
    outcomes = ["low", "high", "done", "preempted"]
    sm = StateMachine(outcomes, name="M", userdata={"value": 0.5})
    with sm:
        sm.add("WORK", Step(value, seconds), {"done": cases})
        sm.add("LOW", Step(), {"done": "low"})
        sm.add("HIGH", Step(), {"done": "high"})
        sm.add("NEXT", Step())
    return sm


@pytest.mark.parametrize(("value", "outcome"), [(0.1, "low"), (1.0, "high"), (0.5, "done")])
def test_the_first_case_that_holds_counts(value, outcome):
    assert machine_of([LOW, HIGH, "NEXT"], value).execute() == outcome


@pytest.mark.parametrize("text", ["value < 1", "value >= 1", "value == value"])
def test_no_order_or_equality_with_nan_holds(text):
    assert machine_of([when(text, "LOW"), "NEXT"], math.nan).execute() == "done"


@pytest.mark.parametrize("text", ["value != 1", "value != value", "value in [value]"])
def test_nan_differs_from_everything_and_is_found_as_the_same_object(text):
    assert machine_of([when(text, "LOW"), "NEXT"], math.nan).execute() == "low"


def test_a_condition_of_a_preempt_decides_what_tidies_up():
    sm = StateMachine(["done", "low", "preempted"], name="M", userdata={"value": 0.1})
    sm.add("WORK", Step(seconds=60.0), {"preempted": [when("value < 0.3", "LOW"), "preempted"]})
    sm.add("LOW", Step(), {"done": "low"})
    with mission_kit() as mission:
        mission.preempt(at=2.0)
        run = mission(sm)
    assert (run.outcome, run.path) == ("low", ("/M/WORK", "/M/LOW"))


def test_it_is_asked_anew_after_each_visit():
    @smachpy.state(["done"], io_keys=["count"])
    def count(userdata):
        userdata.count += 1
        return "done"

    sm = StateMachine(["done"], userdata={"count": 0})
    sm.add("COUNT", count, {"done": [when("count < 5", "COUNT"), None]})
    for _ in range(2):
        assert sm.execute() == "done"
        assert sm.userdata.count == 5


def test_none_at_the_end_is_the_outcome_of_the_same_name():
    assert machine_of([LOW, None]).execute() == "done"


def test_a_container_may_have_conditions_too():
    inner = StateMachine(["done", "preempted"], output_keys=["value"])
    inner.add("IN", Step(0.1))
    sm = StateMachine(["low", "done", "preempted"], userdata={"value": 0.5})
    sm.add("INNER", inner, {"done": [when("value < 0.3", "low"), "done"]})
    assert sm.execute() == "low"


def test_a_sequence_may_have_them():
    sequence = smachpy.Sequence(["done", "low", "preempted"], "done")
    sequence.userdata.value = 0.5
    sequence.add("WORK", Step(0.1), {"done": [when("value < 0.3", "low"), "NEXT"]})
    sequence.add("NEXT", Step())
    assert sequence.execute() == "low"


@pytest.mark.parametrize(
    ("condition", "problem"),
    [
        ("valu < 1", "'valu' is not there"),
        ("len(value)", "has no len"),
        (lambda userdata: userdata.value.nothing, "nothing"),
        (lambda userdata: asyncio.sleep(0), "got a coroutine; expected an answer"),
    ],
)
def test_a_condition_that_cannot_be_evaluated_ends_the_machine_with_its_place(condition, problem):
    with pytest.raises(InvalidUserCodeError, match=f"(?s)/M/WORK.*{problem}") as caught:
        machine_of([when(condition, "LOW"), "NEXT"]).execute()
    assert caught.value.path == "/M/WORK"


@pytest.mark.parametrize(
    "cases", [[], ["LOW"], ["LOW", "HIGH"], [LOW], [LOW, HIGH], [LOW, "NEXT", "HIGH"], [LOW, 3]]
)
def test_a_list_without_conditions_and_a_last_target_is_refused(cases):
    with pytest.raises(InvalidStateError, match="transitions: got 'done'"):
        machine_of(cases)


@pytest.mark.parametrize(
    "text", ["", "value <", "__import__('os')", "value.__class__", "(lambda: 1)()", "x" * 2000]
)
def test_a_text_that_is_no_expression_is_refused(text):
    with pytest.raises(InvalidStateError, match="when: condition"):
        when(text, "LOW")


def test_a_case_that_leads_nowhere_is_refused():
    with pytest.raises(smachpy.InconsistentMachineError, match="Did you mean 'HIGH'"):
        machine_of([when("value > 1", "HIGHT"), "NEXT"])


def test_a_preempt_that_comes_as_the_state_ends_stops_the_machine_before_the_chosen_state():
    with mission_kit() as mission:
        mission.preempt(on="WORK", after=1.0)
        run = mission(machine_of([LOW, "NEXT"], seconds=1.0))
    assert run.outcome in {"preempted", "done"}
    assert run.visits("LOW") == 0


def test_finished_work_counts_if_the_chosen_case_ends_the_machine():
    sm = StateMachine(["low", "done", "preempted"], userdata={"value": 0.1})

    @smachpy.state(["done"])
    def finishing(userdata):
        sm.request_preempt()
        return "done"

    sm.add("WORK", finishing, {"done": [when("value < 0.3", "low"), "NEXT"]})
    sm.add("NEXT", Step())
    assert sm.execute() == "low"


def test_an_outcome_that_an_operator_forces_asks_the_conditions():
    sm = machine_of([LOW, "NEXT"], seconds=60.0)
    sm["WORK"].register_outcomes(["other"])
    sm._smachpy.transitions["WORK"]["other"] = "NEXT"

    def force(event: Any) -> None:
        if type(event).__name__ == "Entered" and event.path == "/M/WORK":
            sm.userdata.value = 0.1
            sm.control.force_outcome("/M/WORK", "done")

    sm.subscribe(force)
    assert sm.execute() == "low"


@pytest.mark.parametrize("command", ["preempt", "force_outcome"])
def test_a_condition_that_blocks_holds_no_machine_that_is_asked_to_stop(command):
    """After an operator's command it was asked a second time, when no grace was left to end it."""
    clock, asked = VirtualClock(), []

    def blocks(userdata: Any) -> bool:
        asked.append(clock.now())
        clock.sleep(1e6)
        return True

    sm = machine_of([when(blocks, "LOW"), "NEXT"], seconds=5.0 if command != "preempt" else 0.0)
    sm["WORK"].register_outcomes(["other"])
    sm._smachpy.transitions["WORK"]["other"] = "NEXT"
    words = ["done"] if command == "force_outcome" else []
    with use_clock(clock):
        clock.call_later(1.0, lambda: getattr(sm.control, command)("/M/WORK", *words))
        clock.call_later(100.0, sm.request_preempt)
        assert sm.execute() == "preempted"
    assert len(asked) == 1
    assert clock.now() == pytest.approx(11.0 if command == "preempt" else 110.0, abs=1.0)


def test_what_was_decided_in_a_run_that_could_not_be_written_is_asked_anew(tmp_path):
    sm = machine_of([LOW, "NEXT"])
    things: list[Any] = []
    sm.userdata.things = things

    @smachpy.state(["done"], io_keys=["value", "things"])
    def work(userdata):
        userdata.value = values.pop()
        if userdata.value < 0.3:
            userdata.things.append(object())  # no journal can keep it
        return "done"

    sm._smachpy_exchange("WORK", work)
    values = [0.5, 0.1]
    with pytest.raises(smachpy.SmachError, match="things"):
        smachpy.run_durable(sm, tmp_path / "missions.db", mission="m")
    assert sm.execute() == "done"


def test_they_are_drawn_and_described():
    edges = smachpy.describe(machine_of([LOW, "NEXT"])).transitions
    of_work = [(edge.target, edge.guard) for edge in edges if edge.outcome == "done"][:2]
    assert of_work == [("LOW", "value < 0.3"), ("NEXT", "")]
    assert "value &lt; 0.3" in machine_of([LOW, "NEXT"])._repr_svg_()


def test_a_copy_has_them():
    assert copy.deepcopy(machine_of([LOW, "NEXT"], 0.1)).execute() == "low"


def test_two_equal_cases_are_equal():
    assert When("value < 0.3", "LOW") == LOW


def test_check_follows_all_cases():
    report = check(machine_of([LOW, HIGH, "NEXT"]))
    assert report.ok, report


def test_exploration_tries_every_case():
    paths = set()

    def note(run):
        paths.update(run.path)

    found = explore(lambda: machine_of([LOW, HIGH, "NEXT"]), invariants=[note])
    assert found.exhaustive
    assert paths == {"/M/WORK", "/M/LOW", "/M/HIGH", "/M/NEXT"}


def test_exploration_leaves_the_conditions_of_a_machine_as_they_were():
    sm = machine_of([LOW, HIGH, "NEXT"], 0.1)
    explore(sm)
    assert sm.execute() == "low"


def test_a_mission_that_is_killed_anywhere_goes_the_same_way():
    found = explore(lambda: machine_of([LOW, HIGH, "NEXT"]), faults=["kill"])
    found.assert_ok()
    assert found.exhaustive
