"""A journal does not grow with the age of its mission."""

from __future__ import annotations

import itertools

import smachpy
from smachpy.durable.journal import SNAPSHOT_EVERY, read_position
from smachpy.durable.store import open_store

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
