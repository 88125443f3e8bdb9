"""Transitions that are in a journal, beside DBOS's steps in the same run.

    pip install 'smachpy[bench]'
    python benchmarks/durable.py [--steps 2000] [--rounds 5] [--folder DIR] [--json]

A transition is one of `smachpy.run_durable`: a state ends, its userdata has changed and the next
one is chosen, in one transaction. A step is one of a DBOS workflow that returns the same number.
Both keep them in SQLite, in the same folder; the rounds take turns, and the median is shown. DBOS
is as it is installed: it sets no PRAGMA, so its file has a rollback journal and `synchronous` FULL.
`append` is the store alone, its median; `recovery` is opening a journal of 100,000 transitions,
which was compacted while they ran, and reading where the mission stands; the last row reads 100,000
entries that no snapshot has replaced.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import statistics
import sys
import tempfile
import time
from pathlib import Path

import smachpy
from smachpy.durable.journal import read_position
from smachpy.durable.opening import open_store
from smachpy.durable.processes import this_runner
from smachpy.durable.store import MissionRow

PAST = 100_000
BUDGETS = {"transition NORMAL us": 150.0, "transition FULL / DBOS step": 1.0, "recovery ms": 200.0}


def counting_machine(steps):
    """A machine whose two states take turns, each of which counts on."""

    @smachpy.state(outcomes=["next", "done"], input_keys=["n"], output_keys=["n"])
    def count(userdata):
        userdata.n += 1
        return "next" if userdata.n < steps else "done"

    machine = smachpy.StateMachine(["done"], name="COUNT")
    machine.userdata.n = 0
    with machine:
        machine.add("A", count, {"next": "B"})
        machine.add("B", count, {"next": "A"})
    return machine


def transition_us(folder, synchronous, steps):
    store = open_store(folder / f"{synchronous}-{time.time_ns()}.db", synchronous=synchronous)
    machine = counting_machine(steps)
    start = time.perf_counter()
    smachpy.run_durable(machine, store)
    took = time.perf_counter() - start
    store.close()
    return took / steps * 1e6


def plain_us(steps):
    machine = counting_machine(steps)
    start = time.perf_counter()
    machine.execute()
    return (time.perf_counter() - start) / steps * 1e6


def append_us(folder, synchronous, steps):
    store, lease = new_mission(folder / f"append-{time.time_ns()}.db", synchronous)
    entry = b'{"kind":"next","path":"/COUNT/A","outcome":"next","target":"B","userdata":{"n":5}}'
    times = []
    for _ in range(steps):
        start = time.perf_counter()
        store.append(lease, [entry])
        times.append(time.perf_counter() - start)
    store.close()
    return statistics.median(times) * 1e6


def new_mission(path, synchronous):
    store = open_store(path, synchronous=synchronous)
    store.create(
        MissionRow("m", "COUNT", "", (), "queued", None, None, 1.0, 1.0, None, b"{}", version=1)
    )
    return store, store.claim("m", this_runner(), seconds=3600)


class Dbos:
    """DBOS on SQLite; it is started once in a process."""

    def __init__(self, folder):
        from dbos import DBOS

        url = f"sqlite:///{folder / 'dbos.sqlite'}"
        DBOS(config={"name": "bench", "system_database_url": url, "log_level": "ERROR"})

        @DBOS.step()
        def count(n):
            return n + 1

        @DBOS.workflow()
        def workflow(steps):
            n = 0
            start = time.perf_counter()
            while n < steps:
                n = count(n)
            return (time.perf_counter() - start) / steps * 1e6

        DBOS.launch()
        self.step_us = workflow
        self.end = DBOS.destroy


def kept_machine(folder):
    """Run 100,000 transitions; return the journal as it is then, compacted while it ran."""
    place = folder / "past.db"
    store = open_store(place, synchronous="NORMAL")
    machine = counting_machine(PAST)
    smachpy.run_durable(machine, store)
    store.close()
    return place


def recovery_ms(place, mission="COUNT"):
    start = time.perf_counter()
    store = open_store(place)
    read_position(store, mission)
    took = time.perf_counter() - start
    store.close()
    return took * 1e3


def read_ms(folder):
    """Open and read 100,000 entries that no snapshot has replaced."""
    place = folder / "long.db"
    store, lease = new_mission(place, "NORMAL")
    entry = json.dumps({"kind": "next", "path": "/COUNT/A", "outcome": "next"}).encode()
    for _ in range(100):
        store.append(lease, [entry] * (PAST // 100))
    store.close()
    start = time.perf_counter()
    store = open_store(place)
    assert len(store.read("m")[1]) == PAST
    took = time.perf_counter() - start
    store.close()
    return took * 1e3


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--folder", type=Path, help="where the files are (default: a new one)")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=args.folder) as name:
        folder = Path(name)
        candidates = {
            "plain transition us": lambda: plain_us(args.steps),
            "append NORMAL us": lambda: append_us(folder, "NORMAL", args.steps),
            "append FULL us": lambda: append_us(folder, "FULL", args.steps),
            "transition NORMAL us": lambda: transition_us(folder, "NORMAL", args.steps),
            "transition FULL us": lambda: transition_us(folder, "FULL", args.steps),
        }
        dbos = None
        if importlib.util.find_spec("dbos") is None:
            print(
                "dbos is not installed: its row is left out. Try: pip install 'smachpy[bench]'",
                file=sys.stderr,
            )
        else:
            dbos = Dbos(folder)
            candidates["DBOS step us"] = lambda: dbos.step_us(args.steps)
        rounds = {row: [] for row in candidates}
        for _ in range(args.rounds):
            for row, measure in candidates.items():
                rounds[row].append(measure())
        if dbos is not None:
            dbos.end()
        figures = {row: statistics.median(values) for row, values in rounds.items()}
        if dbos is not None:
            ratio = figures["transition FULL us"] / figures["DBOS step us"]
            figures["transition FULL / DBOS step"] = ratio
        figures["recovery ms"] = statistics.median(
            recovery_ms(place) for place in [kept_machine(folder)] * args.rounds
        )
        figures["reading 100,000 entries ms"] = read_ms(folder)
    if args.json:
        print(json.dumps(figures))
        return 0
    for row, value in figures.items():
        budget = BUDGETS.get(row)
        verdict = (
            "" if budget is None else f"   at most {budget:g}: {'yes' if value <= budget else 'NO'}"
        )
        print(f"{row:32}{value:10.2f}{verdict}")
    return int(any(figures.get(row, 0.0) > budget for row, budget in BUDGETS.items()))


if __name__ == "__main__":
    sys.exit(main())
