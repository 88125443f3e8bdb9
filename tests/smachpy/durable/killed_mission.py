"""A mission that kills its own process at a write of its journal: run by tests, again and again.

    python killed_mission.py JOURNAL DEEDS KILL_AT WRITTEN

KILL_AT 0 never kills. At its end it prints outcome and userdata as a line of JSON.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

import smachpy
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal
from smachpy import Concurrence, Iterator, SimpleActionState, State, StateMachine
from smachpy.durable.journal import read_position
from smachpy.durable.sqlite import SQLiteStore

ACTION = "killed_mission"


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

    def __init__(self, deeds: Path, name: str) -> None:
        super().__init__(["ok"], io_keys=["count"])
        self.deeds, self.name = deeds, name

    def execute(self, userdata: Any) -> str:
        smachpy.once("note", lambda: self.write(userdata.count))
        userdata.count += 1
        return "ok"

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


def build(deeds: Path) -> StateMachine:
    """Note, drive, two branches with goals of their own, and a loop of goals."""
    ends = ["succeeded", "aborted", "preempted"]
    goes = {"succeeded": "ok", "aborted": "bad", "preempted": "bad"}
    keys = {"input_keys": ["number", "sum"], "output_keys": ["number", "sum"]}
    root = StateMachine(["ok", "bad"], name="KILLED")
    root.userdata.count, root.userdata.number, root.userdata.sum = 0, 0, 0
    with root:
        StateMachine.add("NOTE", Note(deeds, "note"), {"ok": "DRIVE"})
        StateMachine.add("DRIVE", action(), {**goes, "succeeded": "BOTH"})
        both = Concurrence(["ok", "bad"], "bad", outcome_map={"ok": dict.fromkeys("LR", "ok")})
        with both:
            for number, label in ((10, "L"), (20, "R")):
                branch = StateMachine(["ok", "bad"])
                branch.userdata.number, branch.userdata.sum, branch.userdata.count = number, 0, 0
                with branch:
                    StateMachine.add("GO", action(), {**goes, "succeeded": "NOTE"})
                    StateMachine.add("NOTE", Note(deeds, label))
                Concurrence.add(label, branch)
        StateMachine.add("BOTH", both, {"ok": "LOOP"})
        loop = Iterator(["ok", *ends], it=range(2), exhausted_outcome="ok", **keys)
        with loop:
            Iterator.set_contained_state("GO", action(), loop_outcomes=["succeeded"])
        StateMachine.add("LOOP", loop, goes | {"ok": "ok"})
    return root


def main() -> None:
    journal, deeds, kill_at, written = sys.argv[1:]
    store = KillingStore(journal, synchronous="NORMAL")
    store.left, store.written = int(kill_at), written == "True"
    machine = build(Path(deeds))
    print("ready", flush=True)
    if any(row.status == "ended" for row in store.missions()):  # killed after that was written
        position = read_position(store, "m")
        outcome, values = position.data["outcome"], position.userdata["/KILLED"]
    else:
        outcome, values = smachpy.run_durable(machine, store, mission="m"), machine.userdata
    userdata = {key: values[key] for key in ("count", "number", "sum")}
    print(json.dumps({"outcome": outcome, **userdata}), flush=True)


if __name__ == "__main__":
    main()
