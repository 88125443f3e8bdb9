"""How much sooner are the same runs done on all cores than on one?

Explores a mission with a large space, and simulates another, in one process and in one per core, in
turn. What is found must be the same. Compared is CPU time, because on a busy computer the
processes share the cores with others: that of one process, and what all cores need at least, which
is that of the busiest process, or of all divided by the cores. Linux only.

    python benchmarks/cores.py [--mission patrol] [--runs 6000] [--simulated 40] [--json]
"""

from __future__ import annotations

import argparse
import contextlib
import json
import tempfile
import time
from pathlib import Path
from typing import ClassVar

import smachpy
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from smachpy.base import workers
from smachpy.base.workers import WorkerProcess, cores
from smachpy.command.explore import MissionMaker, reckoning_states
from smachpy.testing.exploring.exploration import explore
from smachpy_viz.runs.simulate import SimulationPlan, simulate

OUTCOMES = ["succeeded", "aborted", "preempted"]


@smachpy.mission
def wide() -> smachpy.StateMachine:
    """Send four goals at once, and then another: more runs than can be tried."""
    together = smachpy.Concurrence(
        OUTCOMES,
        default_outcome="aborted",
        outcome_map={"succeeded": dict.fromkeys("ABCD", "succeeded")},
    )
    with together:
        for label in "ABCD":
            together.add(label, drive())
    sm = smachpy.StateMachine(OUTCOMES, name="WIDE")
    with sm:
        sm.add("TOGETHER", together, {"aborted": "AGAIN"})
        sm.add("AGAIN", drive())
    return sm


def drive():
    return smachpy.SimpleActionState("move_base", MoveBaseAction, goal=MoveBaseGoal())


class Measured(WorkerProcess):
    """A process whose CPU time is noted at its end."""

    used: ClassVar[dict[int, float]] = {}

    def kill(self):
        self._note()
        super().kill()

    def end(self):
        self._note()
        return super().end()

    def _note(self):
        pid = self._process.pid
        with contextlib.suppress(OSError):  # it is gone, and noted before
            self.used[pid] = time.clock_gettime((~pid << 3) | 2)  # the clock of a process


def explored(_mission, runs, jobs):
    make = MissionMaker(f"{__file__}:wide", {})
    found = explore(make, max_runs=runs, max_time=3600.0, keep=reckoning_states(make()), jobs=jobs)
    return found.ok, found.runs, found.stopped_by


def simulated(mission, runs, jobs):
    with tempfile.TemporaryDirectory() as folder:
        return [
            one.outcome for one in simulate(SimulationPlan(mission, runs, Path(folder)), jobs=jobs)
        ]


def measure(work, mission, runs, rounds):
    """Return the best CPU seconds in one process, and what all cores need at least."""
    best, seen = {}, []
    for _ in range(rounds):
        for jobs in (1, cores()):
            Measured.used.clear()
            begun = time.process_time()
            seen.append(work(mission, runs, jobs))
            used = [time.process_time() - begun, *Measured.used.values()]
            took = max(*used, sum(used) / jobs)
            best[jobs] = min(took, best.get(jobs, took))
    assert all(one == seen[0] for one in seen), "the results depend on the number of processes"
    return best[1], best[cores()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--mission", default="patrol", help="the one that is simulated")
    parser.add_argument("--runs", type=int, default=6000, help="of the exploration")
    parser.add_argument("--simulated", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    workers.WorkerProcess = Measured
    for name, work, runs in (
        ("explore", explored, args.runs),
        ("simulate", simulated, args.simulated),
    ):
        one, all_ = measure(work, args.mission, runs, args.rounds)
        facts = {
            "what": name,
            "runs": runs,
            "cores": cores(),
            "one_s": round(one, 2),
            "all_s": round(all_, 2),
            "times": round(one / all_, 2),
        }
        if args.json:
            print(json.dumps(facts), flush=True)
        else:
            print(
                f"{name}: {runs} runs: {one:.1f} s of CPU in one process, {all_:.1f} s at "
                f"least on {cores()} cores: {one / all_:.2f} x",
                flush=True,
            )


if __name__ == "__main__":
    main()
