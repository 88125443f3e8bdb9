"""The event stream: order, nesting, listeners that fail, records."""

from __future__ import annotations

import json
import logging
import math
from collections import OrderedDict, defaultdict, deque
from dataclasses import dataclass, field
from enum import Enum
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import smachpy
from actionlib_core.interfaces.std_msgs.msg import Int8MultiArray, String
from actionlib_core.time import Time
from smachpy import events
from smachpy.events import (
    CallbackFailed,
    Entered,
    Failed,
    Finished,
    Iterated,
    Left,
    Started,
    from_record,
    to_record,
)
from smachpy.userdata.shown import brief, literal
from tests.places import DATA


def say(outcome, *outcomes):
    return smachpy.CBState(lambda ud: outcome, outcomes=[outcome, *outcomes])


def nested():
    inner = smachpy.StateMachine(["ok"])
    inner.add("X", say("ok"))
    loop = smachpy.Iterator(["ok"], [], [], it="ab", exhausted_outcome="ok")
    loop.set_contained_state("EACH", say("next"))
    sm = smachpy.StateMachine(["ok"], name="P")
    sm.add("INNER", inner, {"ok": "LOOP"})
    sm.add("LOOP", loop)
    return sm


def test_events_of_a_run_in_order(clock):
    sm = nested()
    heard = []
    sm.subscribe(heard.append)
    sm.execute()
    assert [(type(e).__name__, e.path, *e[3:]) for e in heard] == [
        ("Started", "/P", ("INNER",)),
        ("Entered", "/P/INNER"),
        ("Entered", "/P/INNER/X"),
        ("Left", "/P/INNER/X", "ok"),
        ("Left", "/P/INNER", "ok"),
        ("Entered", "/P/LOOP"),
        ("Iterated", "/P/LOOP", 0),
        ("Entered", "/P/LOOP/EACH"),
        ("Left", "/P/LOOP/EACH", "next"),
        ("Iterated", "/P/LOOP", 1),
        ("Entered", "/P/LOOP/EACH"),
        ("Left", "/P/LOOP/EACH", "next"),
        ("Left", "/P/LOOP", "ok"),
        ("Finished", "/P", "ok"),
    ]
    assert all(e.t == 0.0 and e.stamp_ns == clock.time_ns() for e in heard)


def test_listeners_of_a_sub_machine_hear_that_part_only():
    sm = nested()
    heard = []
    sm["INNER"].subscribe(heard.append)
    sm.execute()
    assert {e.path for e in heard} == {"/P/INNER/X"}


def test_unsubscribe_and_subscribe_in_mid_run():
    sm = smachpy.StateMachine(["ok"])
    heard = []
    sm.add("A", say("ok"), {"ok": "B"})
    sm.add("B", say("ok"), {"ok": "C"})
    sm.add("C", say("ok"))
    forget = []
    sm["A"].execute = lambda ud: forget.append(sm.subscribe(heard.append)) or "ok"
    sm["C"].execute = lambda ud: forget[0]() or "ok"
    sm.execute()
    assert [(type(e), e.path[-1]) for e in heard] == [(Entered, "B"), (Left, "B"), (Entered, "C")]


def test_a_raising_listener_hurts_nobody(caplog):
    sm = nested()
    heard = []

    def fail(event):
        raise ValueError("listener")

    sm.subscribe(fail)
    sm.subscribe(heard.append)
    with caplog.at_level(logging.ERROR):
        assert sm.execute() == "ok"
    assert len(heard) == 14
    assert "listener" in caplog.text


def test_failures_are_events():
    def fail(ud):
        raise ValueError("motor")

    sm = smachpy.StateMachine(["ok"], name="P")
    sm.add("A", smachpy.CBState(fail, outcomes=["ok"]))
    sm.register_start_cb(lambda *a: 1 / 0)
    heard = []
    sm.subscribe(heard.append)
    with pytest.raises(smachpy.InvalidUserCodeError):
        sm.execute()
    assert [e.error for e in heard if isinstance(e, Failed)] == ["ValueError: motor"]
    (failed,) = [e for e in heard if isinstance(e, CallbackFailed)]
    assert (failed.path, failed.error) == ("/P", "ZeroDivisionError: division by zero")
    assert heard[-1][3:] == (None,)
    assert isinstance(heard[0], Started)
    assert isinstance(heard[-1], Finished)


@pytest.mark.parametrize("buffered", [True, False])
@pytest.mark.parametrize("kind", [KeyboardInterrupt, SystemExit])
def test_what_is_never_wrapped_ends_the_states_in_the_events_too(clock, kind, buffered):
    def leave(ud):
        raise kind

    inner = smachpy.StateMachine(["ok"])
    inner.add("X", smachpy.CBState(leave, outcomes=["ok"]))
    sm = smachpy.StateMachine(["ok"], name="P")
    sm.add("IN", inner)
    heard = []
    buffer = sm.event_buffer()
    if not buffered:
        sm.subscribe(heard.append)
    with pytest.raises(kind):
        sm.execute()
    told = [(record["kind"], record["path"]) for record in buffer.read()]
    assert told[-3:] == [("Failed", "/P/IN/X"), ("Failed", "/P/IN"), ("Finished", "/P")]


def test_scopes_publish_from_any_thread(clock):
    heard = []

    class Sends(smachpy.State):
        def execute(self, userdata):
            scope = self.scope()
            task = clock.spawn(
                lambda: scope.emit(events.GoalSent, "move_base", "id-1", "there"), name="elsewhere"
            )
            task.join()
            return "ok"

    sm = smachpy.StateMachine(["ok"], name="P")
    sm.add("A", Sends(["ok"]))
    sm.subscribe(heard.append)
    sm.execute()
    (sent,) = [e for e in heard if isinstance(e, events.GoalSent)]
    assert (sent.path, sent.action, sent.goal_id, sent.goal) == (
        "/P/A",
        "move_base",
        "id-1",
        "there",
    )


def test_the_scope_of_a_root_publishes_after_its_run():
    heard, scopes = [], []
    sm = smachpy.StateMachine(["ok"], name="P", on_enter=lambda _ud: scopes.append(sm.scope()))
    sm.add("A", say("ok"))
    sm.subscribe(heard.append)
    sm.execute()
    assert scopes[0].is_watched
    scopes[0].emit(events.GoalSent, "move_base", "id-1", "there")
    assert (heard[-1].path, heard[-1].goal_id) == ("/P", "id-1")


texts = st.text(max_size=5)
anything = st.none() | st.integers() | texts | st.lists(st.integers()) | st.builds(object)


@given(st.sampled_from(events.EVENT_TYPES), st.data())
def test_events_survive_a_record(kind, data):
    fields = [data.draw(texts), 1.5, 17]
    for name in kind._fields[3:]:
        fields.append(("A",) if name == "initial" else data.draw(texts))
    event = kind(*fields)
    record = to_record(event)
    assert record["kind"] == kind.__name__
    assert from_record(record) == event
    assert type(from_record(record)) is kind


@pytest.mark.parametrize(
    "event",
    [
        events.UserdataWritten("/P/A", 0.0, 0, "k", [1, [2]]),
        events.GoalDone("/P/A", 0.0, 0, "dock", "1", "SUCCEEDED", "", [1]),
        events.Recovered("/P", 0.0, 0, "m", 1, ((1, 2), (3, 4)), (("/P", 1), ("/P/A", 2))),
    ],
)
def test_lists_and_pairs_survive_a_record(event):
    """Lists of users became tuples, and pairs became lists."""
    assert from_record(json.loads(json.dumps(to_record(event)))) == event


@given(anything)
def test_records_are_plain_whatever_the_value(value):
    import json

    json.dumps(to_record(events.UserdataWritten("/P/A", 0.0, 0, "k", value)))


@pytest.mark.parametrize(
    "record", [{}, {"kind": "Nope"}, {"kind": "Left", "path": "/"}, {"kind": "Left", "x": 1}]
)
def test_records_of_nothing_are_told(record):
    with pytest.raises(ValueError, match="event record"):
        from_record(record)


def test_iterated_counts_from_zero():
    assert Iterated("/P", 0.0, 0, 3).number == 3


def written(value):
    return to_record(events.UserdataWritten("/P/A", 0.0, 0, "k", value))


def test_a_grid_is_not_taken_down_cell_by_cell():
    record = written({"name": "hall", "grid": [[0] * 900 for _ in range(900)], "after": "word"})
    shown = record["value"]
    assert shown["name"] == "hall"
    assert shown["grid"][0] == [0] * 900
    assert shown["grid"][-1] == {"$large": "list", "length": 900}
    assert shown["after"] == "word"
    assert len(json.dumps(record)) < 200_000


@pytest.mark.parametrize(
    "value",
    [
        {1: [[0] * 900] * 900},
        {(0, 0): [["x" * 3000] * 900] * 900},
        ["x" * 3_000] * 1_000,
        [[["x"] * 90] * 90] * 90,
    ],
)
def test_a_record_is_short_whatever_the_value(value):
    assert len(json.dumps(written(value))) < 400_000


def test_names_are_whole_however_long():
    path = "/P" + "/A_LABEL_OF_THIRTY_CHARACTERS__" * 200
    active = tuple((f"{path}/{number}", number) for number in range(1_500))
    record = to_record(events.Recovered(path, 0.0, 0, "m", 0, active=active))
    assert record["path"] == path
    assert record["active"] == [list(pair) for pair in active]
    marking = ("p",) * 1_500
    assert to_record(events.Fired(path, 0.0, 0, "t", marking))["marking"] == list(marking)


class Cell:
    """Counts how often it is looked at."""

    looks = 0

    def __repr__(self):
        Cell.looks += 1
        return "."


class Text(str):
    __slots__ = ()

    def __repr__(self):
        Cell.looks += len(self)
        return str.__repr__(self)


@dataclass
class Map:
    name: str
    cells: object
    above: object = field(default=None, repr=False)


class Route:
    def __len__(self):
        return 5_000

    def __repr__(self):
        Cell.looks += len(self)
        return "route"


class Secret:
    _smachpy_secret = True

    def __init__(self, text):
        self.text = text


class Colour(Enum):
    RED = 1


class Point(NamedTuple):
    x: int
    y: int


cells = [Cell()] * 100_000


@pytest.mark.parametrize(
    ("value", "shown", "text"),
    [
        (None, None, "None"),
        (True, True, "True"),
        (5, 5, "5"),
        (2**60, {"$int": str(2**60)}, str(2**60)),
        pytest.param(10**5000, {"$repr": "<int of 16610 bits>"}, "<int of 16610 bits>", id="huge"),
        (1.5, 1.5, "1.5"),
        (math.nan, {"$float": "nan"}, "nan"),
        (-math.inf, {"$float": "-inf"}, "-inf"),
        ("nan", "nan", "'nan'"),
        ("x" * 5000, {"$cut": "x" * 4000, "length": 5000}, f"{'x' * 4000!r}\u2026"),
        ([1, [2]], [1, [2]], "[1, [2]]"),
        ((1, (2,)), {"$tuple": [1, {"$tuple": [2]}]}, "(1, (2,))"),
        ({3}, {"$set": [3]}, "{3}"),
        (frozenset(), {"$set": []}, "set()"),
        ({"a": (1,)}, {"a": {"$tuple": [1]}}, "{'a': (1,)}"),
        ({1: "b"}, {"$items": [[1, "b"]]}, "{1: 'b'}"),
        ({"$set": 1}, {"$items": [["$set", 1]]}, "{'$set': 1}"),
        (OrderedDict(a=1), {"a": 1}, "{'a': 1}"),
        (b"a\x00", {"$bytes": "YQA="}, "b'a\\x00'"),
        (bytes(2000), {"$large": "bytes", "length": 2000}, "<bytes of 2000 elements>"),
        (
            Map("hall", [1]),
            {"$object": "Map", "fields": {"name": "hall", "cells": [1]}},
            "Map(name='hall', cells=[1])",
        ),
        (Point(1, 2), {"$object": "Point", "fields": {"x": 1, "y": 2}}, "Point(x=1, y=2)"),
        (
            SimpleNamespace(a=1),
            {"$object": "SimpleNamespace", "fields": {"a": 1}},
            "SimpleNamespace(a=1)",
        ),
        (
            Time(1, 2),
            {"$object": "Time", "fields": {"secs": 1, "nsecs": 2}},
            "Time(secs=1, nsecs=2)",
        ),
        (
            String(data="a"),
            {"$msg": "std_msgs/String", "fields": {"data": "a"}},
            "String(data='a')",
        ),
        (np.float32(1.5), 1.5, "1.5"),
        (np.int64(3), 3, "3"),
        (
            np.array([[1, 2]]),
            {"$array": [[1, 2]], "dtype": "int64"},
            "array([[1, 2]], dtype=int64)",
        ),
        (np.zeros(5000), {"$large": "ndarray", "length": 5000}, "<ndarray of 5000 elements>"),
        (Colour.RED, {"$repr": "Colour.RED"}, "Colour.RED"),
        (deque([1]), {"$repr": "deque([1])"}, "deque([1])"),
        (ValueError("x", 3), {"$repr": "ValueError('x', 3)"}, "ValueError('x', 3)"),
        (1 + 2j, {"$repr": "(1+2j)"}, "(1+2j)"),
        (range(10**9), {"$repr": "range(0, 1000000000)"}, "range(0, 1000000000)"),
        (Secret("hunter2"), {"$repr": "<secret>"}, "<secret>"),
        ([Secret("hunter2")], [{"$repr": "<secret>"}], "[<secret>]"),
    ],
)
def test_value_in_a_record_has_its_structure_and_its_text(value, shown, text):
    record = written(value)
    assert record["value"] == shown
    assert type(record["value"]) is type(shown)
    assert literal(json.loads(json.dumps(record, allow_nan=False))["value"]) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (deque(cells), "<deque of 100000 elements>"),
        (Map("hall", cells), "Map(name='hall', cells=<list of 100000 elements>)"),
        (Map("hall", [deque(cells)]), "Map(name='hall', cells=[<deque of 100000 elements>])"),
        (SimpleNamespace(a=1, b=cells), "SimpleNamespace(a=1, b=<list of 100000 elements>)"),
        (ValueError("no", cells), "ValueError('no', <list of 100000 elements>)"),
        ({1: cells}, "{1: <list of 100000 elements>}"),
        ({1: Map("hall", [[Cell()] * 900] * 900)}, "{1: Map(name='hall', cells=[[., ., "),
        (defaultdict(list, {1: cells}), "{1: <list of 100000 elements>}"),
        ({1: dict.fromkeys(range(900), [Cell()] * 900)}, "{1: {0: [., ., "),
        ({1: {2: Text("x" * 200_000)}}, "{1: {2: 'xxx"),
        ({1: ["x" * 200_000]}, "{1: ['xxx"),
        ({b"x" * 200_000}, "{<bytes of 200000 elements>}"),
        ({1: Int8MultiArray(data=[0] * 100_000)}, "{1: Int8MultiArray(layout=MultiArrayLayout("),
        ({1: String(data="x" * 200_000)}, "{1: String(data='xxx"),
        (Route(), "<Route of 5000 elements>"),
    ],
)
def test_a_value_is_not_looked_at_as_a_whole_when_it_is_large(value, text):
    Cell.looks = 0
    record = written(value)
    assert Cell.looks <= 20_000
    assert literal(record["value"]).startswith(text)


def test_many_large_values_share_what_is_looked_at():
    Cell.looks = 0
    shown = written([{1: [Cell()] * 900} for _ in range(500)])["value"]
    assert literal(shown[0]).startswith("{1: [., ., ")
    assert shown[-1] == {"$items": [[1, {"$large": "list", "length": 900}]]}
    assert Cell.looks <= 10_000


def test_values_that_hold_themselves_are_shown_as_python_does():
    tree = Map("root", [])
    tree.cells.append(Map("leaf", tree))
    ring = {}
    ring[1] = ring
    listed = []
    listed += [listed, [1], [1]]
    assert literal(written(tree)["value"]) == repr(tree)
    assert literal(written(ring)["value"]) == "{1: ...}"
    assert literal(written(listed)["value"]) == "[..., [1], [1]]"


def test_a_value_that_cannot_be_looked_at_hurts_nobody():
    class Proxy:
        @property
        def dtype(self):
            raise ConnectionError("gone")

        tolist = shape = dtype

    [shown] = written([Proxy()])["value"]
    assert shown == {"$repr": "<Proxy: looking at it raised ConnectionError>"}


EXAMPLES = DATA / "values.json"  # the page has the same


@pytest.mark.parametrize("example", json.loads(EXAMPLES.read_text(encoding="utf-8")))
def test_text_of_an_example(example):
    assert literal(example["value"]) == example["text"]


def test_text_of_a_line_has_rounded_numbers():
    pose = {"$object": "Pose2D", "fields": {"x": 9.8, "yaw": 1.5708000000000002, "ids": [5, 1e300]}}
    assert brief(pose) == "Pose2D(x=9.8, yaw=1.5708, ids=[5, 1e+300])"
    assert brief({"$tuple": [0.1 + 0.2, True, "0.30000000000000004"]}) == (
        "(0.3, True, '0.30000000000000004')"
    )


@pytest.mark.parametrize(
    "value",
    [{"$tuple": 5}, {"$object": "A"}, {"$msg": 5, "fields": {}}, {"$items": [1]}, {"$bytes": "A"}],
)
def test_text_of_a_damaged_value_is_the_value_as_it_is(value):
    assert literal(value) == repr(value)


def test_a_record_becomes_text_whatever_is_in_it():
    text = events.record_text({"kind": "Left", "path": "/A", "outcome": 10**5000, "x": object})
    assert json.loads(text)["outcome"] == {"$repr": "<int of 16610 bits>"}
    assert json.loads(text)["path"] == "/A"


def test_the_numbers_of_a_buffer_are_no_fields_of_an_event():
    record = to_record(Iterated("/P", 0.0, 0, 3))
    assert from_record({**record, "seq": 7, "dropped": 2}) == Iterated("/P", 0.0, 0, 3)
