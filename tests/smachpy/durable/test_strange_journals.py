"""A journal may come from a stranger: a mission that cannot be read is one bad line of the list."""

from __future__ import annotations

import contextlib
import json
import socket
import sqlite3
import zlib
from functools import cache

import pytest

import smachpy
from actionlib_core.process.output import printable
from smachpy import command
from smachpy.durable.mission import new_mission
from smachpy.durable.opening import open_store
from smachpy.durable.position import Position
from smachpy.durable.store import StoreError
from smachpy.exceptions import SmachError
from smachpy_viz.live.journals import Journals

NOW = 1_764_000_000_000_000_000
ODD = [
    *(None, -1, 10**30, 1e308, "\x1b]0;x\x07", [["x", "y"]], {"a": {"in": 5}}, {"$blob": 5}),
]
ENTRIES = [
    {"kind": "Started", "path": "/M", "stamp_ns": NOW, "userdata": {"/M": {"key": 1}}},
    {"kind": "Entered", "path": "/M/A", "in": "/M", "stamp_ns": NOW + 1},
    {
        "kind": "GoalSent",
        "path": "/M/A",
        "action": "drive",
        "goal_id": "g",
        "stamp_ns": NOW + 2,
    },
    {"kind": "GoalTaken", "path": "/M/A", "stamp_ns": NOW + 3},
    {"kind": "Once", "path": "/M/A", "key": "k", "value": 1, "stamp_ns": NOW + 3},
    {"kind": "Met", "path": "/M/A", "paths": ["/M/A"], "stamp_ns": NOW + 3},
    {
        "kind": "PreemptRequested",
        "path": "/M",
        "source": "operator",
        "by": "me",
        "why": "",
        "stamp_ns": NOW + 4,
    },
    {"kind": "Recovered", "path": "/M", "shift_ns": 0, "gone_ns": 5, "stamp_ns": NOW + 9},
    {
        "kind": "Noted",
        "path": "",
        "stamp_ns": NOW + 9,
        "conditions": {"/M": {"set": {"a": True}, "events": [["b", NOW]]}},
    },
    {
        "kind": "Left",
        "path": "/M/A",
        "outcome": "preempted",
        "stopped": {"/M/A": "B"},
        "stamp_ns": NOW + 9,
    },
]


def snapshot():
    position = Position()
    for entry in ENTRIES:
        position.fold(json.loads(json.dumps(entry)))
    position.check()
    return json.loads(position.to_bytes())


def variants(record):
    """The record with one field of it, or of a dict in it, replaced or missing, in turn."""
    for name, value in record.items():
        yield {key: one for key, one in record.items() if key != name}
        for odd in ODD:
            yield {**record, name: odd}
        if isinstance(value, dict):
            for inner in variants(value):
                yield {**record, name: inner}


@pytest.fixture
def journal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    machine = smachpy.StateMachine(["done"], name="M")
    machine.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    with contextlib.closing(open_store("j.db")) as store:
        store.create(new_mission(machine, mission="one", target="x.py", argv=(), robot=None))
        store.create(new_mission(machine, mission="good", target="x.py", argv=(), robot=None))
    with contextlib.closing(sqlite3.connect("j.db", isolation_level=None)) as file:
        yield file


@cache
def arguments(*words):
    """Not by `main`, which looks up all commands each time."""
    words = ["missions", *words, "--durable", "j.db"]
    return command._parser(words).parse_args(words)


def told(*words):
    args = arguments(*words)
    return args.run(args)


def shown(capsys):
    """Show the journal in every way; return the problem of the mission that may be bad."""
    page = Journals(["j.db"])
    rows = page.rows()
    page.close()
    json.dumps(rows, allow_nan=False)
    assert [row["mission"]["id"] for row in rows if row["mission"]["id"] == "good"] == ["good"]
    for words in (["list"], ["list", "--json"], ["show", "one", "--json"]):
        with contextlib.suppress(StoreError):
            assert told(*words) == 0
    try:
        code = told("show", "one")
    except SmachError as error:
        print(printable(error))
        code = 2
    bad = [row["mission"]["problem"] for row in rows if row["mission"]["id"] == "one"]
    said = capsys.readouterr()
    assert "\x1b]" not in said.out + said.err
    return bad[0] if bad else "gone", code


def put(file, texts, table="smachpy_snapshots"):
    file.execute(f"DELETE FROM {table}")
    for number, text in enumerate(texts, 1):
        values = ("one", number, zlib.crc32(text), text)
        file.execute(f"INSERT INTO {table} VALUES (?, ?, ?, ?)", values)


@pytest.mark.slow
def test_any_field_of_a_snapshot_may_be_wrong(journal, capsys):
    problems = []
    for text in [snapshot(), *variants(snapshot())]:
        put(journal, [json.dumps(text).encode()])
        problems.append(shown(capsys))
    assert problems[0] == ("", 0)
    assert {problem for problem, _ in problems} <= {"", "corrupt", "future"}
    assert sum(bool(problem) for problem, _ in problems) > len(problems) / 2


@pytest.mark.parametrize(
    "text",
    [b"", b"5", b"{", b"[" * 100_000, b'{"a":' * 50_000, b"null", b"\xff", b"[]", b"9" * 10_000],
)
def test_a_snapshot_of_anything_else_is_one_bad_line(journal, capsys, text):
    put(journal, [text])
    problem, code = shown(capsys)
    assert (problem, code) in {("corrupt", 2), ("", 0)}


COLUMNS = [
    *("name", "target", "argv", "status", "outcome", "robot", "created", "changed", "owner"),
    *("structure", "version", "due", "every", "schedule", "cancel", "fence", "mark", "lease_end"),
    *("lease_clock", "priority", "not_after", "grp", "drives", "note"),
]


@pytest.mark.parametrize("column", COLUMNS)
def test_any_column_of_a_row_may_be_wrong(journal, capsys, column):
    here = f"{socket.gethostname()}:{10**20}"
    for odd in (
        here,
        None,
        -1,
        2**62,
        1e308,
        float("inf"),
        "",
        "x",
        "\x1b]0;x\x07",
        b"\xff\x00",
        b"{}",
    ):
        [before] = journal.execute(f"SELECT {column} FROM smachpy_missions WHERE id = 'one'")
        with contextlib.suppress(sqlite3.IntegrityError):
            journal.execute(f"UPDATE smachpy_missions SET {column} = ? WHERE id = 'one'", (odd,))
        shown(capsys)
        journal.execute(f"UPDATE smachpy_missions SET {column} = ? WHERE id = 'one'", before)
