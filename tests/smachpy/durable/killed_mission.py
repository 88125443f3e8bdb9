"""Missions that are killed, each life in a process of its own: run by tests, again and again.

    python killed_mission.py

Each line of the input is a life to live, a JSON object with the arguments of `live` and, in
`after`, how many seconds it has at most; `by` is the signal that ends it then. The answer is a line, too: its exit code. Processes are
forked from this one, which has all modules loaded: most of a short life would be imports.
"""

from __future__ import annotations

import json
import os
import random
import select
import signal
import sys
from pathlib import Path
from typing import Any

import smachpy
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal
from actionlib_core.transport import zenoh as _  # noqa: F401  loaded before the fork
from smachpy import Concurrence, Iterator, Sequence, SimpleActionState, State, StateMachine
from smachpy.durable.journal import read_position
from smachpy.durable.sqlite import SQLiteStore
from smachpy.machines.container import Container
from smachpy.machines.state import get_options

ACTION = "killed_mission"
KEYS = ["count", "number", "sum"]
ENDS = ["succeeded", "aborted", "preempted"]
GOES = {"succeeded": "ok", "aborted": "bad", "preempted": "bad"}


class KillingStore(SQLiteStore):
    """Kills the process at one write, before it or after it."""

    left = 0
    written = False

    def append(self, *arguments: Any, **named: Any) -> None:
        self.left -= 1
        if self.left == 0 and not self.written:
            os.kill(os.getpid(), signal.SIGKILL)
        super().append(*arguments, **named)
        if self.left == 0:
            os.kill(os.getpid(), signal.SIGKILL)


class Note(State):
    """Writes a line to the file of deeds, once, and counts."""

    def __init__(self, deeds: Path, name: str, **options: Any) -> None:
        super().__init__(["ok", "again"], io_keys=["count"], **options)
        self.deeds, self.name = deeds, name

    def execute(self, userdata: Any) -> str:
        smachpy.once("note", lambda: self.write(userdata.count))
        userdata.count += 1
        return "again" if userdata.count % 2 and get_options(self).retry else "ok"

    def write(self, count: int) -> None:
        with self.deeds.open("a") as file:
            file.write(f"{self.name} {count}\n")


def action(**options: Any) -> SimpleActionState:
    """A goal whose number is that of the userdata key `number`; it counts."""

    def goal(userdata: Any, goal: TestGoal) -> None:
        goal.goal = userdata.number

    def count(userdata: Any, _status: int, result: Any) -> None:
        userdata.number += 1
        userdata.sum += result.result

    return SimpleActionState(
        ACTION,
        TestAction,
        goal_cb=goal,
        result_cb=count,
        input_keys=["number", "sum"],
        output_keys=["number", "sum"],
        **options,
    )


def begin(container: Container, number: int) -> None:
    container.userdata.count, container.userdata.number, container.userdata.sum = 0, number, 0


def build(deeds: Path) -> StateMachine:
    """Note, drive, two branches with goals of their own, and a loop of goals."""
    root = StateMachine(["ok", "bad"], name="KILLED")
    begin(root, 0)
    with root:
        StateMachine.add("NOTE", Note(deeds, "note"), {"ok": "DRIVE", "again": "bad"})
        StateMachine.add("DRIVE", action(), {**GOES, "succeeded": "BOTH"})
        both = Concurrence(["ok", "bad"], "bad", outcome_map={"ok": dict.fromkeys("LR", "ok")})
        with both:
            for number, label in ((10, "L"), (20, "R")):
                branch = StateMachine(["ok", "bad"])
                begin(branch, number)
                with branch:
                    StateMachine.add("GO", action(), {**GOES, "succeeded": "NOTE"})
                    StateMachine.add("NOTE", Note(deeds, f"branch {label}"), {"again": "bad"})
                Concurrence.add(label, branch)
        StateMachine.add("BOTH", both, {"ok": "LOOP"})
        keys = {"input_keys": ["number", "sum"], "output_keys": ["number", "sum"]}
        loop = Iterator(["ok", *ENDS], it=range(2), exhausted_outcome="ok", **keys)
        with loop:
            Iterator.set_contained_state("GO", action(), loop_outcomes=["succeeded"])
        StateMachine.add("LOOP", loop, GOES | {"ok": "ok"})
    return root


class Chance:
    """Builds a random machine, the same one for each seed, with six leaves or a few more."""

    def __init__(self, seed: int, deeds: Path) -> None:
        self.random = random.Random(seed)
        self.deeds = deeds
        self.leaves = 0
        self.branches = 0

    def root(self) -> StateMachine:
        root = self.container("machine", depth=0)
        assert isinstance(root, StateMachine)
        root.name = "KILLED"
        begin(root, 0)
        return root

    def child(self, depth: int) -> tuple[State, dict[str, str]]:
        """A state that ends ok or bad, or that is mapped to these."""
        if depth < 3 and self.leaves < 6 and self.random.random() < 0.5:
            kinds = ["machine", "sequence", "concurrence", "iterator"]
            return self.container(self.random.choice(kinds), depth), {}
        self.leaves += 1
        kind = self.random.choice(["note", "goal", "goal", "retried"])
        if kind == "goal":
            return action(), GOES
        retry: dict[str, Any] = {"retry": (3, 0.01, ["again"])} if kind == "retried" else {}
        name = f"{'branch ' if self.branches else ''}{self.leaves} {kind}"
        return Note(self.deeds, name, **retry), {"ok": "ok", "again": "bad"}

    def container(self, kind: str, depth: int) -> Container:
        keys = {"input_keys": KEYS, "output_keys": KEYS}
        number = self.random.randint(1, 2) if depth else 3
        container: Container
        if kind == "concurrence":
            labels = [f"S{i}" for i in range(number + 1)]
            ends = {"ok": dict.fromkeys(labels, "ok")}
            container = Concurrence(["ok", "bad"], "bad", outcome_map=ends, **keys)
            for label in labels:
                branch = StateMachine(["ok", "bad"])  # with values of its own
                self.branches += 1
                begin(branch, 100 * self.branches)
                state, goes = self.child(depth + 1)
                branch.add("IN", state, goes)
                container.add(label, branch)
        elif kind == "iterator":
            container = Iterator(["ok", "bad"], it=range(2), exhausted_outcome="ok", **keys)
            inner = self.container("machine", depth + 1)
            container.set_contained_state("EACH", inner, loop_outcomes=["ok"])
        elif kind == "sequence":
            container = Sequence(["ok", "bad"], connector_outcome="ok", **keys)
            for i in range(number):
                container.add(f"S{i}", self.container("machine", depth + 1))
        else:
            container = StateMachine(["ok", "bad"], **keys)
            for i in range(number):
                state, goes = self.child(depth + 1)
                following = "ok" if i == number - 1 else f"S{i + 1}"
                goes = {end: following if to == "ok" else to for end, to in goes.items()}
                container.add(f"S{i}", state, goes or {"ok": following})
        return container


def live(folder: str, machine: int, kill_at: int = 0, *, written: bool = False) -> None:
    """Let a mission run, or go on, and write its outcome and userdata to the file `ended`.

    Args:
        folder: Holds all that outlives the process.
        machine: Seed of a random machine; 0: the one of `build`.
        kill_at: The write of the journal that kills; 0: none.
        written: Whether that one is written first.
    """
    home = Path(folder)
    store = KillingStore(home / "journal.db", synchronous="NORMAL")
    store.left, store.written = kill_at, written
    deeds = home / "deeds"
    root = Chance(machine, deeds).root() if machine else build(deeds)
    if any(row.status == "ended" for row in store.missions()):  # killed after that was written
        position = read_position(store, "m")
        outcome, values = position.data["outcome"], position.userdata["/KILLED"]
    else:
        outcome, values = smachpy.run_durable(root, store, mission="m"), root.userdata
    ended = {"outcome": outcome, "writes": -store.left, **{key: values[key] for key in KEYS}}
    (home / "ended").write_text(json.dumps(ended))
    store.close()


def main() -> None:
    for line in sys.stdin:
        life = json.loads(line)
        after, by = life.pop("after", None), life.pop("by", "SIGKILL")
        pid = os.fork()
        if pid == 0:
            for number in (signal.SIGTERM, signal.SIGHUP):
                signal.signal(number, signal.SIG_DFL)
            sys.stdin = open(os.devnull)  # noqa: SIM115  the parent's is not to be read
            live(**life)
            return
        ends = os.pidfd_open(pid)
        if after is not None and not select.select([ends], [], [], after)[0]:
            os.kill(pid, signal.Signals[by])
        code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        os.close(ends)
        print(code, flush=True)


if __name__ == "__main__":
    main()
