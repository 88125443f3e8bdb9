"""What a firing of a plan costs beside a transition of a state machine with the same leaves.

And how long a large plan takes to load and check.

    python benchmarks/petri_net_plans.py [--json]
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import smachpy
from smachpy import State, StateMachine, pnp

ACTIONS = 50
ROUNDS = 300
PLACES = 1000


class Nothing(State):
    def __init__(self) -> None:
        super().__init__(["succeeded"])

    def execute(self, ud: object) -> str:  # noqa: ARG002  the interface
        return "succeeded"


def machine() -> StateMachine:
    sm = StateMachine(["done"])
    with sm:
        for n in range(ACTIONS):
            following = f"S{n + 1}" if n + 1 < ACTIONS else "done"
            sm.add(f"S{n}", Nothing(), {"succeeded": following})
    return sm


def sequence(count: int) -> pnp.Net:
    return pnp.action("S", 0).then(*(pnp.action("S", n) for n in range(1, count))).net()


def plan() -> pnp.PetriNetPlan:
    return pnp.PetriNetPlan(sequence(ACTIONS), {f"S_{n}": Nothing() for n in range(ACTIONS)})


def best_s(container: smachpy.Container) -> float:
    times = []
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        container.execute()
        times.append(time.perf_counter() - begun)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    transition = best_s(machine()) / ACTIONS
    firing = best_s(plan()) / (2 * ACTIONS)
    with tempfile.TemporaryDirectory() as folder:
        file = pnp.write_pnml(sequence(PLACES // 2), Path(folder) / "long.pnml")
        begun = time.perf_counter()
        loaded = pnp.load(file)
        smachpy.check(loaded)
        seconds = time.perf_counter() - begun
    if args.json:
        print(json.dumps({"firing / transition": firing / transition, "load and check s": seconds}))
        return
    print(f"a transition {transition * 1e6:.2f} us, a firing {firing * 1e6:.2f} us: "
          f"{firing / transition:.1f} x")  # fmt: skip
    print(f"{len(loaded.plan.net.places)} places loaded and checked in {seconds:.2f} s")


if __name__ == "__main__":
    main()
