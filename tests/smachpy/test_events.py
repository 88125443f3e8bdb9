"""The event stream: order, nesting, listeners that fail, records."""

from __future__ import annotations

import json
import logging
from collections import Counter, OrderedDict, defaultdict, deque
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

import smachpy
from actionlib_core.interfaces.std_msgs.msg import Int8MultiArray, String
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
    assert shown["grid"][-1] == "<list of 900 elements>"
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


cells = [Cell()] * 100_000


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (deque(cells), "<deque of 100000 elements>"),
        (Map("hall", cells), "Map(name='hall', cells=<list of 100000 elements>)"),
        (Map("hall", [deque(cells)]), "Map(name='hall', cells=<list of 1 elements>)"),
        (SimpleNamespace(a=1, b=cells), "SimpleNamespace(a=1, b=<list of 100000 elements>)"),
        (ValueError("no", cells), "ValueError('no', <list of 100000 elements>)"),
        ({1: cells}, "{1: <list of 100000 elements>}"),
        ({1: Map("hall", [[Cell()] * 900] * 900)}, "{1: Map(name='hall', cells=<list of 900 "),
        (defaultdict(list, {1: cells}), "<defaultdict of 1 elements>"),
        ({1: dict.fromkeys(range(900), [Cell()] * 900)}, "{1: {0: [., ., "),
        ({1: {"grid": [[Cell()] * 900] * 900, "n": 3}}, "{1: {'grid': <list of 900 elements>, 'n'"),
        ({1: {2: Text("x" * 200_000)}}, "{1: {2: 'xxx"),
        ({1: ["x" * 200_000]}, "{1: <list of 1 elements>}"),
        ({b"x" * 200_000}, "<set of 1 elements>"),
        ({1: b"x" * 200_000}, "{1: <bytes of 200000 elements>}"),
        ({1: Int8MultiArray(data=[0] * 100_000)}, "{1: Int8MultiArray(layout=MultiArrayLayout("),
        ({1: String(data="x" * 200_000)}, "{1: String(data='xxx"),
        (Route(), "<Route of 5000 elements>"),
    ],
)
def test_a_value_is_not_looked_at_as_a_whole_when_it_is_large(value, text):
    Cell.looks = 0
    assert written(value)["value"].startswith(text)
    assert Cell.looks <= 20_000


def test_many_large_values_share_what_is_looked_at():
    Cell.looks = 0
    shown = written([{1: [Cell()] * 900} for _ in range(500)])["value"]
    assert shown[0].startswith("{1: [., ., ")
    assert shown[-1] == "<dict of 1 elements>"
    assert Cell.looks <= 10_000


@pytest.mark.parametrize(
    "value",
    [
        {1, 2},
        {1: [2, (3, None)], (0, 1): {2: b"x"}},
        deque([1.5, "a"], maxlen=3),
        Counter({1: 3}),
        OrderedDict({1: 2}),
        defaultdict(list, {1: [2]}),
        Map("hall", [[0] * 9] * 9),
        SimpleNamespace(a=1),
        ValueError("x", 3),
        {1: String(data="a")},
        {1: 2}.values(),
        range(10**9),
        {1: "x" * 3_000},
        frozenset(range(700)),
    ],
)
def test_a_value_of_usual_size_is_its_repr(value):
    assert written(value)["value"] == repr(value)


def test_values_that_hold_themselves_are_their_repr():
    tree = Map("root", [])
    tree.cells.append(Map("leaf", tree))
    ring = {}
    ring[1] = ring
    assert written(tree)["value"] == repr(tree)
    assert written(ring)["value"] == "{1: {...}}"


def test_a_number_of_many_digits_is_named_by_its_size():
    record = written([7, 10**5000, -(10**5000)])
    assert record["value"] == [7, "<int of 16610 bits>", "<int of 16610 bits>"]
    assert written(2**64)["value"] == 2**64


def test_a_value_that_cannot_be_looked_at_hurts_nobody():
    class Proxy:
        def __getattr__(self, name):
            raise ConnectionError("gone")

    assert written([Proxy()])["value"] == ["<Proxy: looking at it raised ConnectionError>"]


def test_a_record_becomes_text_whatever_is_in_it():
    text = events.record_text({"kind": "Left", "path": "/A", "outcome": 10**5000, "x": object})
    assert json.loads(text)["outcome"] == "<int of 16610 bits>"
    assert json.loads(text)["path"] == "/A"


def test_the_numbers_of_a_buffer_are_no_fields_of_an_event():
    record = to_record(Iterated("/P", 0.0, 0, 3))
    assert from_record({**record, "seq": 7, "dropped": 2}) == Iterated("/P", 0.0, 0, 3)
