"""Where a goal leads, in a few words."""

from __future__ import annotations

import pytest

from smachpy_viz.model.destination import destination


def message(**fields):
    return {"$msg": "G", "fields": fields}


def goal(x, y):
    position = message(x=x, y=y, z=0.0)
    return message(target_pose=message(header=message(seq=1), pose=message(position=position)))


PLACES = [
    {"$object": "Waypoint", "fields": {"name": "kitchen", "pose": message(x=3.0, y=2.0)}},
    {"$object": "Waypoint", "fields": {"name": 7, "pose": message(x=9.0, y=9.0)}},
    "text",
]


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        (goal(3.1, 2.0), "kitchen"),
        (goal(3.5, 2.0), "(3.5, 2.0)"),
        (goal(9.0, 9.0), "(9.0, 9.0)"),
        (message(station="dock 2"), "dock 2"),
        (message(count=3), ""),
        (message(name=""), ""),
        (None, ""),
        ("odd", ""),
        (goal("nan", None), ""),
    ],
)
def test_a_goal_is_for_a_named_place_a_place_or_what_its_fields_name(sent, words):
    assert destination(sent, PLACES) == words
