"""Data from JSON is believed only after a check; what is wrong is named with its place."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple, NotRequired, TypedDict

import pytest

from actionlib_core.inputs.checked_data import LATEST, Count, DataError, Number, Stamp, checked
from actionlib_core.inputs.checked_file import Limits
from actionlib_core.inputs.json_text import (
    MAX_JSON_NESTING,
    MAX_JSON_PARTS,
    JsonTextError,
    load_json,
)


class Pose(TypedDict):
    x: Number
    name: NotRequired[str | None]
    pairs: NotRequired[list[tuple[str, int]]]


@dataclass(frozen=True)
class Node:
    label: str
    children: tuple[Node, ...] = ()
    pair: tuple[str, int] = ("", 0)
    facts: dict[str, Any] = field(default_factory=dict)


class Entered(NamedTuple):
    path: str
    t: float = 0.0


GOOD = [
    (str, "a", "a"),
    (int, 5, 5),
    (float, 5, 5),
    (float, "nan", "nan"),  # a text in place of what JSON does not have
    (bool, True, True),
    (None.__class__, None, None),
    (Any, {"a": [1]}, {"a": [1]}),
    (str | None, None, None),
    (list[int], [1, 2], [1, 2]),
    (tuple[int, ...], [1, 2], (1, 2)),
    (tuple[str, int], ["a", 2], ("a", 2)),
    (dict[str, Count], {"a": 0}, {"a": 0}),
    (Literal["a", "b"], "b", "b"),
    (Stamp, LATEST, LATEST),
    (Pose, {"x": 1}, {"x": 1}),
    (Pose, {"x": 1, "pairs": [["a", 1]]}, {"x": 1, "pairs": [["a", 1]]}),
    (Pose, {"x": 1.5, "name": None}, {"x": 1.5, "name": None}),
    (Node, {"label": "A", "children": [{"label": "B"}]}, Node("A", (Node("B"),))),
    (Node, {"label": "A", "pair": ["k", 1]}, Node("A", pair=("k", 1))),
    (Entered, {"path": "/A"}, Entered("/A")),
    (Annotated[int, Limits(low=1, high=3)], 3, 3),
]

BAD = [
    (str, 5, "$: got 5; expected a text."),
    (int, True, "$: got True; expected a whole number."),
    (int, 1.0, "$: got 1.0; expected a whole number."),
    (float, "fast", "$: got 'fast'; expected a number."),
    (float, False, "$: got False; expected a number."),
    (str | None, 5, "$: got 5; expected a text or null."),
    (list[int], "ab", "$: got 'ab'; expected a list."),
    (list[int], [1, None], "$[1]: got None; expected a whole number."),
    (tuple[str, int], ["a"], "$: got a list of 1; expected a list of 2."),
    (dict[str, Count], {"a": -1}, "$['a']: got -1; expected a finite number, at least 0"),
    (dict[str, int], [], "$: got a list of 0; expected an object."),
    (Literal["a", "b"], "c", "$: got 'c'; expected one of ['a', 'b']."),
    (Literal["a", "b"], ["a"], "$: got a list of 1; expected one of ['a', 'b']."),
    (Stamp, LATEST + 1, "$: got 4294967296000000000; expected a finite number, at least 0"),
    (Number, "inf", "$: got 'inf'; expected a finite number."),
    (Pose, {"x": 1, "name": 2}, "$.name: got 2; expected a text or null."),
    (Pose, {}, "$: got an object without them; expected one with the fields ['x']."),
    (Pose, {"x": 1, "y": 2}, "$: got 'y'; expected one of the fields ['name', 'pairs', 'x']."),
    (Node, {"label": "A", "children": [{"label": 5}]}, "$.children[0].label: got 5; expected a"),
    (Entered, {"t": 1.0}, "$: got an object without them; expected one with the fields ['path']."),
    (str, "x" * 10**6 + "\ud800", "$: got 'xxx"),
]


@pytest.mark.parametrize(("kind", "data", "value"), GOOD)
def test_checked_returns_the_value_of_the_type(kind, data, value):
    assert checked(kind, data) == value


@pytest.mark.parametrize(("kind", "data", "text"), BAD[:-1])
def test_checked_names_the_place_of_the_first_mistake(kind, data, text):
    with pytest.raises(DataError) as caught:
        checked(kind, data)
    assert str(caught.value).startswith(text)


def test_checked_error_stays_short_for_a_long_text():
    with pytest.raises(DataError) as caught:
        checked(int, "x" * 10**6)
    assert len(str(caught.value)) < 150


def test_checked_drops_fields_of_newer_programs_if_asked():
    assert checked(list[Pose], [{"x": 1, "shade": "blue"}], known_only=True) == [{"x": 1}]


def test_checked_refuses_a_tree_that_is_deeper_than_the_stack():
    data: dict[str, Any] = {"label": "A"}
    for _ in range(5_000):
        data = {"label": "A", "children": [data]}
    with pytest.raises(DataError, match="nested less deeply"):
        checked(Node, data)


def test_load_json_returns_plain_data_and_texts_for_numbers_that_json_does_not_have():
    assert load_json('{"a": [1, NaN, -Infinity]}') == {"a": [1, "NaN", "-Infinity"]}
    assert load_json(b'"\xff"') == "\ufffd"
    assert load_json("[1e999, -1e999, 1.5]") == ["1e999", "-1e999", 1.5]
    assert load_json(f"[{'9' * 400}, -5]") == ["9" * 400, -5]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no JSON"),
        ("[1", "no JSON"),
        ("[" * 100_000, "nested deeper"),
        ("[" * (MAX_JSON_NESTING + 1) + "]" * (MAX_JSON_NESTING + 1), "nested deeper"),
        ('{"a":' * (MAX_JSON_NESTING + 1) + "1" + "}" * (MAX_JSON_NESTING + 1), "nested deeper"),
        (f"[{'[],' * MAX_JSON_PARTS}0]", "arrays and objects; expected at most"),
        (json.dumps("x" * 100), "102 characters; expected at most 50"),
    ],
)
def test_load_json_refuses_what_is_no_json_or_too_much(text, words):
    with pytest.raises(JsonTextError, match=words):
        load_json(text, longest=50 if text.startswith('"') else 10**8)


def test_load_json_takes_what_is_just_allowed():
    deep = "[" * MAX_JSON_NESTING + "]" * MAX_JSON_NESTING
    assert json.dumps(load_json(deep)) == deep
    assert len(load_json(f"[{','.join(['[]'] * 1_000)}]")) == 1_000
    assert load_json('"' + "[" * 1_000 + '"') == "[" * 1_000  # brackets in a text
