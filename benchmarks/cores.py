"""How much sooner are the same runs done on all cores than on one?

Explores a mission, and simulates it, in one process and in one per core, in turn, and compares the
best times of each. What is found must be the same.

    python benchmarks/cores.py [--mission patrol] [--runs 2000] [--simulated 40] [--json]
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

from smachpy.base.workers import cores
from smachpy.command.explore import MissionMaker, reckoning_states
from smachpy.testing.exploring.exploration import explore
from smachpy_viz.runs.simulate import SimulationPlan, simulate


def explored(mission, runs, jobs):
    make = MissionMaker(mission, {})
    found = explore(make, max_runs=runs, max_time=3600.0, keep=reckoning_states(make()), jobs=jobs)
    return found.ok, found.runs, found.stopped_by


def simulated(mission, runs, jobs):
    with tempfile.TemporaryDirectory() as folder:
        return [
            one.outcome for one in simulate(SimulationPlan(mission, runs, Path(folder)), jobs=jobs)
        ]


def measure(work, mission, runs, rounds):
    """Return the best seconds in one process and in all, and what was found."""
    best, seen = {}, []
    for _ in range(rounds):
        for jobs in (1, cores()):
            begun = time.perf_counter()
            seen.append(work(mission, runs, jobs))
            took = time.perf_counter() - begun
            best[jobs] = min(took, best.get(jobs, took))
    assert all(one == seen[0] for one in seen), "the results depend on the number of processes"
    return best[1], best[cores()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--mission", default="patrol")
    parser.add_argument("--runs", type=int, default=2000, help="of the exploration")
    parser.add_argument("--simulated", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
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
                f"{name}: {runs} runs of {args.mission}: {one:.1f} s in one process, {all_:.1f} s "
                f"in {cores()}: {one / all_:.2f} x",
                flush=True,
            )


if __name__ == "__main__":
    main()
