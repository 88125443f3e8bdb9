"""What the page computes as well, on data that its own tests share (viz/web/test)."""

from __future__ import annotations

import json

import pytest

from actionlib_core.exceptions import FieldError
from actionlib_core.interfaces import define_action, get_message
from smachpy import CBState, Concurrence, StateMachine
from smachpy.events import SOURCES, asker_text, span_text
from smachpy.events.introspection import describe
from smachpy.events.outcome_classes import FAILURE, PREEMPTED_PREFIXES, SUCCESS, outcome_class
from smachpy.events.run_state import RunState
from smachpy_viz.live import assets
from smachpy_viz.live.forms import fields_of, problems_of, sensible, values_of
from smachpy_viz.model.labels import shorten
from smachpy_viz.runs.statistics import Statistics, never_taken
from tests.places import DATA

define_action(
    "page_msgs/Paint",
    """
# Paint a wall.

uint8 SLOW=1       # carefully
uint8 FAST=2
uint8 speed        # how fast
string COLOR_RED=red
string color       # by name
duration rest      # between coats
time begin
float32[3] mixture # shares of the paints
string[] names
geometry_msgs/Pose[] corners
int64 serial
bool dry
uint16[] doors
bool[2] flags
std_msgs/Empty nothing
---
---
""",
)
Paint = get_message("page_msgs/PaintGoal")


def load(name):
    return json.loads((DATA / name).read_text(encoding="utf-8"))


def machine():
    """ROUND, a concurrence, and DOCK, with an implicit transition and rules."""

    def state(*outcomes):
        return CBState(lambda _: outcomes[0], outcomes=list(outcomes), input_keys=["place"])

    sm = StateMachine(outcomes=["done", "aborted"], name="PATROL")
    round_ = Concurrence(
        outcomes=["all", "low", "aborted"],
        default_outcome="aborted",
        outcome_map={"all": {"DRIVE": "succeeded"}, "low": {"BATTERY": "low"}},
        input_keys=["place"],
    )
    with round_:
        Concurrence.add("DRIVE", state("succeeded", "aborted", "preempted"))
        Concurrence.add("BATTERY", state("low", "preempted"), remapping={"place": "dock"})
    with sm:
        StateMachine.add("ROUND", round_, {"all": "done", "low": "DOCK"})
        StateMachine.add("DOCK", state("succeeded", "aborted"), {"succeeded": "ROUND"})
    return sm


@pytest.mark.parametrize("case", load("folds.json"), ids=lambda case: case["name"])
def test_events_add_up_to_a_state(case):
    state = RunState()
    for event in case["events"]:
        state.fold(event)
    assert state.data == case["state"]
    assert list(state.questions()) == case.get("questions", [])


def test_goals_that_ended_are_forgotten_in_the_order_in_which_they_were_sent():
    """Whatever order a snapshot that went through a page or a file has its goals in."""
    *_, case = (case for case in load("folds.json") if len(case["state"]["goals"]) > 20)
    *events, last = case["events"]
    state = RunState()
    for event in events:
        state.fold(event)
    state.data["goals"] = dict(sorted(state.data["goals"].items()))
    state.fold(last)
    assert state.data["goals"] == case["state"]["goals"]


def test_the_structure_of_a_machine():
    assert json.loads(json.dumps(assets.model(describe(machine())))) == load("page_model.json")


def test_numbers_of_recorded_runs():
    fixture = load("statistics.json")
    statistics = Statistics()
    statistics.add(fixture["events"])
    assert statistics.to_json() == fixture["statistics"]
    missing = never_taken(describe(machine()), statistics)
    assert [list(one) for one in missing] == fixture["never_taken"]


def test_outcome_classes():
    fixture = load("outcome_classes.json")
    assert fixture["success"] == sorted(SUCCESS)
    assert fixture["failure"] == sorted(FAILURE)
    assert fixture["preempted_prefixes"] == sorted(PREEMPTED_PREFIXES)
    assert fixture["classes"] == {word: outcome_class(word) for word in fixture["classes"]}


def test_texts():
    fixture = load("texts.json")
    for text, length, short in fixture["shorten"]:
        assert shorten(text, length) == short
    for asker in fixture["askers"]:
        assert asker_text(asker["source"], asker["by"], asker["why"]) == asker["text"]
    assert {asker["source"] for asker in fixture["askers"]} > set(SOURCES)
    assert all(span_text(seconds) == text for seconds, text in fixture["spans"])


def test_the_fields_of_a_form():
    fixture = load("forms.json")
    assert fields_of(Paint) == fixture["fields"]
    assert values_of(sensible(Paint)) == fixture["read"][0]["values"]


@pytest.mark.parametrize("case", load("forms.json")["read"] + load("forms.json")["typed"])
def test_what_the_form_writes_is_read_as_it_was_meant(case):
    if "problems" in case:
        with pytest.raises(FieldError) as caught:
            Paint.from_yaml(case["yaml"])
        assert problems_of(caught.value, Paint._type) == case["problems"]
    else:
        assert values_of(Paint.from_yaml(case["yaml"])) == case["values"]
