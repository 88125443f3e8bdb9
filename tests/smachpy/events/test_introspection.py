"""Machines as records."""

from __future__ import annotations

import json

import pytest

import smachpy
from smachpy.events.introspection import RuleRecord, StateRecord, TransitionRecord, describe


class Drive(smachpy.State):
    """Drive somewhere.

    More text.
    """

    def __init__(self):
        super().__init__(["ok", "failed"], ["goal"], ["pose"], timeout=5.0, retry=2)

    def execute(self, userdata):
        return "ok"


def mission():
    both = smachpy.Concurrence(
        ["ok", "low", "failed"],
        "failed",
        outcome_map={
            "ok": {"DRIVE": "ok"},
            "low": smachpy.any_of({"DRIVE": ["failed", "aborted"], "WATCH": "low"}),
        },
    )
    both.add("DRIVE", Drive(), {"goal": "where"})
    both.add("WATCH", smachpy.State(["low", "ok"]))
    loop = smachpy.Iterator(["done", "stop"], [], [], it=range(3), exhausted_outcome="done")
    loop.set_contained_state("EACH", smachpy.State(["ok", "stop"]), loop_outcomes=["ok"])
    sm = smachpy.StateMachine(["done", "failed", "stop"], ["start"], ["end"], name="PATROL")
    sm.add("BOTH", both, {"ok": "LOOP", "low": "failed"})
    sm.add("LOOP", loop, {"done": None})
    return sm


def test_a_machine_is_described():
    root = describe(mission())
    assert [(r.path, r.kind) for r in root.walk()] == [
        ("/PATROL", "machine"),
        ("/PATROL/BOTH", "concurrence"),
        ("/PATROL/BOTH/DRIVE", "state"),
        ("/PATROL/BOTH/WATCH", "state"),
        ("/PATROL/LOOP", "iterator"),
        ("/PATROL/LOOP/EACH", "state"),
    ]
    assert root.initial == ("BOTH",)
    assert root.transitions == (
        TransitionRecord("BOTH", "ok", "LOOP"),
        TransitionRecord("BOTH", "low", "failed", target_is_outcome=True),
        TransitionRecord("BOTH", "failed", "failed", target_is_outcome=True, implicit=True),
        TransitionRecord("LOOP", "done", "done", target_is_outcome=True, implicit=True),
        TransitionRecord("LOOP", "stop", "stop", target_is_outcome=True, implicit=True),
    )
    both, loop = root.children
    assert both.default_outcome == "failed"
    assert both.initial == ("DRIVE", "WATCH")
    assert both.rules == (
        RuleRecord("ok", (("DRIVE", "ok"),), "DRIVE:ok"),
        RuleRecord(
            "low",
            (("DRIVE", "failed"), ("DRIVE", "aborted"), ("WATCH", "low")),
            "any of DRIVE:failed|aborted, WATCH:low",
        ),
    )
    drive = both.children[0]
    assert drive.doc == "Drive somewhere."
    assert drive.remapping == (("goal", "where"),)
    assert drive.input_keys == ("goal",)
    assert drive.output_keys == ("pose",)
    assert drive.outcomes == ("ok", "failed", "aborted")
    assert dict(drive.details)["timeout"] == "5 s -> aborted"
    assert "2 attempts" in dict(drive.details)["retry"]
    assert loop.transitions == (
        TransitionRecord("EACH", "ok", "EACH"),
        TransitionRecord("EACH", "stop", "stop", target_is_outcome=True, implicit=True),
    )
    assert loop.details == (("items", "range(0, 3)"), ("item key", "it_data"))


def test_records_survive_json():
    root = describe(mission())
    assert StateRecord.from_json(root.to_json()) == root
    assert StateRecord.from_json(root.to_json(indent=2)) == root


def test_inconsistent_and_empty_machines_are_described_too():
    sm = smachpy.StateMachine(["done"])
    assert describe(sm).children == ()
    sm.add("A", smachpy.State(["x"]), {"x": "NOWHERE"})
    (edge,) = describe(sm, name="DRAFT").transitions
    assert edge.target == "NOWHERE"
    empty = smachpy.Iterator(["done"], [], [])
    assert describe(empty).children == ()
    assert describe(smachpy.Sequence(["ok"], "ok")).kind == "sequence"


PLAIN = {"path": "/A", "label": "A", "kind": "state", "type_name": "T", "outcomes": []}


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("[]", r"\$: got a list of 0"),
        ("{}", "without them; expected one with the fields"),
        (
            json.dumps({**PLAIN, "kind": "x"}),
            r"\$\.kind",
        ),
        (
            json.dumps({**PLAIN, "children": [{}]}),
            r"\$\.children\[0\]",
        ),
    ],
)
def test_bad_json_names_the_place(text, where):
    with pytest.raises(ValueError, match=where):
        StateRecord.from_json(text)
