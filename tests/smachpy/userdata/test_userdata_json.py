"""Userdata as JSON: everything that can be carried over is, and nothing else is executed."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
from actionlib_core.time import Duration, Time
from smachpy.userdata import json_text
from smachpy.userdata.json_text import dumps, find_lost, loads

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False)
    | st.text()
    | st.binary()
    | st.builds(Time, st.integers(0, 2**31), st.integers(0, 10**9 - 1))
    | st.builds(Duration, st.integers(-(2**31), 2**31 - 1), st.integers(0, 10**9 - 1))
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.lists(inner, max_size=4).map(tuple)
        | st.dictionaries(st.text() | st.integers() | st.just("$msg"), inner, max_size=4)
        | st.sets(st.integers() | st.text(), max_size=4)
    ),
    max_leaves=12,
)


@given(st.dictionaries(st.text(), VALUES, max_size=5))
def test_what_is_written_is_read_back(values):
    text = dumps(values)
    assert find_lost(values) == []
    read = loads(text)
    assert read == values
    assert {k: type(v) for k, v in read.items()} == {k: type(v) for k, v in values.items()}


def test_nan_survives_and_the_text_is_strict_json():
    text = dumps({"x": math.nan, "y": [math.inf, -math.inf]})
    json.loads(text, parse_constant=lambda word: pytest.fail(word))
    read = loads(text)
    assert math.isnan(read["x"])
    assert read["y"] == [math.inf, -math.inf]


def test_a_foreign_object_is_shown_and_not_rebuilt():
    class Robot:
        def __repr__(self):
            return '{"$repr" of a robot}'

    text = dumps({"robot": Robot(), "n": 1})
    assert json.loads(text)["robot"] == {"$repr": '{"$repr" of a robot}'}
    assert find_lost({"robot": [Robot()], "text": '{"$repr": 1}'}) == ["robot"]
    with pytest.raises(ValueError, match=r"userdata: \$\.robot: got .*could only show it"):
        loads(text)


def test_a_repr_that_raises_and_a_value_without_end_are_shown():
    class Bad:
        def __repr__(self):
            raise RuntimeError("no")

    endless = []
    endless.append(endless)
    read = json.loads(dumps({"bad": Bad(), "endless": endless}))
    assert read["bad"] == {"$repr": "<Bad: its repr raised RuntimeError>"}
    assert "$repr" in json.dumps(read["endless"])


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[]", "expected a JSON object"),
        ('{"a": {"$time": ["x", 1]}}', r"\$\.a"),
        ('{"a": {"$tuple": 3}}', r"\$\.a: got 3; expected a list"),
        ('{"a": {"$items": [[[1], 2]]}}', r"\$\.a"),
        ('{"a": [{"$new": 1}]}', r"\$\.a\[0\]: got .* \(unknown\)"),
        ('{"a": {"$bytes": "!"}}', r"\$\.a"),
        ('{"a": {"$msg": "no_such/Type", "fields": {}}}', r"\$\.a"),
        ("[" * 100_000, "nested deeper"),
    ],
)
def test_bad_texts_raise_value_errors(text, problem):
    if problem is None:
        loads(text)
        return
    with pytest.raises(ValueError, match=problem):
        loads(text)


def test_no_text_is_no_values():
    assert loads("") == {}


def test_long_values_can_be_left_out():
    values = {"map": bytes(1000), "path": list(range(1000)), "name": "x" * 9, "deep": [["y" * 11]]}
    read = json.loads(dumps(values, longest=10))
    assert read == {
        "map": {"$repr": "<bytes of 1000 elements>"},
        "path": {"$repr": "<list of 1000 elements>"},
        "name": "x" * 9,
        "deep": [[{"$repr": "<str of 11 elements>"}]],
    }


def test_messages_are_carried_over():
    from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped

    pose = PoseStamped()
    pose.header.frame_id = "map"
    pose.header.stamp = Time(12, 34)
    pose.pose.position.x = float("inf")
    assert loads(dumps({"goal": [pose]})) == {"goal": [pose]}
    pose.pose.position.x = "here"
    assert find_lost({"goal": pose}) == ["goal"]


def places(count):
    """A map of roads: each place knows its neighbours."""
    found = [{"name": f"p{number}", "near": []} for number in range(count)]
    for one, other in [(a, b) for a in range(count) for b in (a + 1, a + 2) if b < count]:
        found[one]["near"].append(found[other])
        found[other]["near"].append(found[one])
    return found


@pytest.mark.parametrize("longest", [None, 100])
def test_a_value_with_many_ways_to_each_part_is_cut(longest):
    """A map of 30 places was written along each way between two of them: it never ended."""
    text = dumps({"map": places(30)}, longest=longest)
    assert "<list of " in text
    assert len(text) < 5_000_000
    assert find_lost({"map": places(30)}) == ["map"]


def test_parts_that_a_value_has_in_common_are_written_in_each_place():
    home, many = [1.0, {"name": "home"}], [0.0, 0.0]
    value = {"home": home, "last": home, "all": [home] * 100, "track": [many] * 20_000}
    assert loads(dumps({"v": value})) == {"v": value}


def test_many_messages_are_no_parts_in_common(monkeypatch):
    """What their fields are converted to may have the address of an earlier one."""
    monkeypatch.setattr(json_text, "_AGAIN", 10)
    value = [MoveBaseGoal() for _ in range(100)]
    assert loads(dumps({"v": value})) == {"v": value}
