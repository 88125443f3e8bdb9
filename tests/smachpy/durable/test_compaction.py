"""A journal does not grow with the age of its mission."""

from __future__ import annotations

import itertools

import smachpy
from smachpy.durable import journal
from smachpy.durable.journal import SNAPSHOT_EVERY, read_position
from smachpy.durable.opening import open_store
from smachpy.durable.position import Position
from tests.smachpy.checks.test_growth import lines_run

STEPS = 5 * SNAPSHOT_EVERY // 2


def test_a_long_mission_has_a_short_journal(tmp_path):
    store = open_store(tmp_path / "journal.db", synchronous="NORMAL")
    lengths = []

    @smachpy.state(outcomes=["next", "done"], input_keys=["n"], output_keys=["n"])
    def count(userdata):
        userdata.n += 1
        if userdata.n % 100 == 0:
            lengths.append(len(store.read("COUNT")[1]))
        if userdata.n == STEPS:
            position = read_position(store, "COUNT")
            assert position.userdata["/COUNT"]["n"] == STEPS - 1
            return "done"
        return "next"

    machine = smachpy.StateMachine(["done"], name="COUNT")
    machine.userdata.n = 0
    with machine:
        machine.add("A", count, {"next": "B"})
        machine.add("B", count, {"next": "A"})
    assert smachpy.run_durable(machine, store) == "done"
    assert max(lengths) <= SNAPSHOT_EVERY
    assert sum(b < a for a, b in itertools.pairwise(lengths)) >= 2
    assert store.read("COUNT")[1] == []
    store.close()


def test_a_large_value_that_changes_in_each_state_does_not_fill_the_disk(tmp_path, monkeypatch):
    monkeypatch.setattr(journal, "SNAPSHOT_BYTES", 1_000_000)
    store = open_store(tmp_path / "journal.db", synchronous="NORMAL")
    sizes = []

    @smachpy.state(outcomes=["next", "done"], input_keys=["scan"], output_keys=["scan"])
    def measure(userdata):
        kept = read_position(store, "SCAN").userdata["/SCAN"]["scan"]
        assert store.blob("SCAN", kept["$blob"]).startswith(b'"%d ' % len(sizes))
        sizes.append(store.size()[1])
        userdata.scan = f"{len(sizes)} {'x' * 100_000}"
        return "done" if len(sizes) == 100 else "next"

    machine = smachpy.StateMachine(["done"], name="SCAN")
    machine.userdata.scan = f"0 {'x' * 100_000}"
    with machine:
        machine.add("A", measure, {"next": "B"})
        machine.add("B", measure, {"next": "A"})
    assert smachpy.run_durable(machine, store) == "done"
    assert max(sizes) < 2_000_000
    store.close()


def test_the_end_of_a_branch_looks_at_no_other_branch():
    def turns(branches):
        position, stamps = Position(), itertools.count(1)

        def fold(kind, path, **facts):
            position.fold({"kind": kind, "path": path, "stamp_ns": next(stamps), **facts})

        fold("Started", "/BOTH")
        paths = [f"/BOTH/B{number}" for number in range(branches)]
        for path in paths:
            fold("Entered", path, **{"in": "/BOTH", "beside": True})
            fold("Entered", f"{path}/S", **{"in": path})

        def end():
            fold("Left", paths[0], outcome="done")
            fold("Entered", paths[0], **{"in": "/BOTH", "beside": True})

        end()
        assert f"{paths[0]}/S" not in position.visits
        assert f"{paths[1]}/S" in position.visits
        return lines_run(end)

    assert turns(3) == turns(300)
