"""A durable mission that uses a resource, in a process of its own; a test talks to it by lines.

    python sharing_mission.py JOURNAL MISSION POLICY [RESUME]

It prints what becomes of its resource, "begins" and "ends", and its outcome. Between the two it
waits for a line of its input, or for a request to stop.
"""

from __future__ import annotations

import contextlib
import sys
import threading
from pathlib import Path
from typing import Any

from smachpy import State, StateMachine
from smachpy.durable.mission import kept_mission, new_mission
from smachpy.durable.opening import open_store
from smachpy.events import ResourceUse


class Use(State):
    """Uses the base alone; who finds the mark of another mission there says so."""

    def __init__(self, mark: Path, mission: str, **options: Any) -> None:
        super().__init__(["done", "preempted"], **options)
        self.mark, self.mission = mark, mission

    def execute(self, userdata: Any) -> str:
        del userdata
        found = self.mark.read_text() if self.mark.exists() else self.mission
        self.mark.write_text(self.mission)
        print("begins" if found == self.mission else f"begins beside {found}", flush=True)
        told = threading.Event()
        self.on_preempt(told.set)

        def read() -> None:
            sys.stdin.readline()
            told.set()

        threading.Thread(target=read, daemon=True).start()
        told.wait()
        self.mark.unlink()
        print("ends", flush=True)
        return "preempted" if self.preempt_requested() else "done"


def main() -> None:
    journal, mission, policy, *resume = sys.argv[1:]
    machine = StateMachine(["done", "refused", "preempted"], name="M")
    options = {"resume": resume[0]} if resume else {}
    mark = Path(journal).with_name("mark")
    machine.add("USE", Use(mark, mission, resource=("base", policy), **options))
    machine.subscribe(
        lambda event: (
            type(event) is ResourceUse
            and print(event.status, *event.holder.partition(",")[:1], flush=True)
        )
    )
    with contextlib.closing(open_store(journal)) as store:
        if store.find(mission) is None:
            store.create(new_mission(machine, mission=mission))
        # A file keeps the mission with its process however late that renews the lease.
        with kept_mission(machine, store, mission, lease_s=0.3):
            print(machine.execute(), flush=True)


if __name__ == "__main__":
    main()
