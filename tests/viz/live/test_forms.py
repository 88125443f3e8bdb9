"""Forms for goals: what the page is told of a definition, and YAML with its comments."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actionlib_core.exceptions import FieldError
from actionlib_core.interfaces import define_action, get_message
from smachpy_viz.live.forms import fields_of, problems_of, sensible, values_of, yaml_of

define_action(
    "form_msgs/Paint",
    """
# Paint a wall.

uint8 SLOW=1       # carefully
uint8 FAST=2
uint8 speed        # how fast
uint8 coats
string COLOR_RED=red
string color       # by name
string label
duration rest      # between coats
time begin
float32[3] mixture # shares of the paints
string[] names
geometry_msgs/Pose[] corners  # where the wall ends: as many as it has, in the order in which they are painted
int64 serial
bool dry
geometry_msgs/PoseStamped start
std_msgs/Empty nothing
---
---
""",
)
Goal = get_message("form_msgs/PaintGoal")
Pose = get_message("geometry_msgs/Pose")


def field(name):
    return next(one for one in fields_of(Goal) if one["name"] == name)


def test_fields_have_types_units_and_comments():
    assert field("rest")["comment"] == "between coats"
    assert field("mixture") == {
        "name": "mixture",
        "type": "float32[3]",
        "base": "float32",
        "comment": "shares of the paints",
        "array": {"length": 3},
        "choices": [],
        "kind": "float",
    }
    assert field("names")["array"] == {"length": None}
    assert (field("serial")["least"], field("serial")["most"]) == (str(-(2**63)), str(2**63 - 1))


def test_nested_messages_bring_their_fields_and_a_default_for_rows():
    corners = field("corners")
    assert [one["name"] for one in corners["fields"]] == ["position", "orientation"]
    assert corners["default"]["orientation"] == {"x": "0.0", "y": "0.0", "z": "0.0", "w": "1.0"}
    assert field("nothing")["fields"] == []


def test_constants_go_to_the_field_that_they_are_meant_for():
    assert field("color")["choices"] == [{"name": "COLOR_RED", "value": "red", "comment": ""}]
    assert field("label")["choices"] == []
    # Two fields of the type and no name to tell them apart: no guess.
    assert field("speed")["choices"] == []
    only = define_action(
        "form_msgs/Pace", "uint8 SLOW=1 # carefully\nuint8 FAST=2\nuint8 pace\n---\n---"
    )
    assert only
    (pace,) = fields_of(get_message("form_msgs/PaceGoal"))
    assert pace["choices"] == [
        {"name": "SLOW", "value": "1", "comment": "carefully"},
        {"name": "FAST", "value": "2", "comment": ""},
    ]


def test_rotations_begin_as_rotations_which_all_zeros_are_not():
    assert sensible(Goal).start.pose.orientation.w == 1.0
    assert sensible(Goal).serial == 0


def test_the_yaml_has_types_units_comments_and_reads_back():
    text = yaml_of(sensible(Goal))
    lines = text.splitlines()
    assert lines[0] == "# Paint a wall."
    assert "rest: 0.0                       # duration [s]; between coats" in lines
    assert any(line.startswith("begin: 0.0") and "or now" in line for line in lines)
    assert "  # red: COLOR_RED" in lines
    above = next(i for i, line in enumerate(lines) if line == "corners: []")
    assert lines[above - 2].startswith("# geometry_msgs/Pose[]; where the wall ends")
    assert max(map(len, lines)) <= 100
    assert Goal.from_yaml(text) == sensible(Goal)


@settings(max_examples=30)
@given(
    st.builds(
        Goal,
        speed=st.integers(0, 255),
        label=st.text(),
        rest=st.integers(-(2**31), 2**31 - 1),
        mixture=st.lists(st.floats(width=32, allow_nan=False), min_size=3, max_size=3),
        names=st.lists(st.text(), max_size=3),
        corners=st.lists(st.builds(Pose), max_size=2),
        serial=st.integers(-(2**63), 2**63 - 1),
        dry=st.booleans(),
    )
)
def test_every_goal_reads_back_from_its_yaml(goal):
    try:
        before = goal.to_bytes()
    except FieldError:  # text that UTF-8 cannot hold
        return
    assert Goal.from_yaml(yaml_of(goal)).to_bytes() == before


def test_numbers_are_texts_as_javascript_cannot_hold_them_all():
    goal = Goal(
        serial=2**62 + 1, rest=-1.5, begin=12.25, mixture=[float("nan"), 1.0, float("-inf")]
    )
    values = values_of(goal)
    assert values["serial"] == "4611686018427387905"
    assert (values["rest"], values["begin"]) == ("-1.5", "12.25")
    assert values["mixture"] == [".nan", "1.0", "-.inf"]
    assert values["dry"] is False


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("{speed: 300}", [("$.speed", "expected uint8 (0 to 255), got 300")]),
        (
            "{corners: [{position: {x: a}}], serial: 1.5}",
            [
                ("$.corners[0].position.x", "expected float64, got str"),
                ("$.serial", "expected int64, got float"),
            ],
        ),
        ("{spede: 1}", [("$.spede", "no such field in form_msgs/PaintGoal; expected speed,")]),
        ("[1]", [("", "got [1]; expected a YAML mapping")]),
        ("{a: [", [("", "malformed YAML: line 1: ")]),
    ],
)
def test_problems_know_their_field(text, found):
    with pytest.raises(FieldError) as caught:
        Goal.from_yaml(text)
    problems = problems_of(caught.value, Goal._type)
    assert [one["path"] for one in problems] == [path for path, _ in found]
    for problem, (_, what) in zip(problems, found, strict=True):
        assert problem["text"].startswith(what)
