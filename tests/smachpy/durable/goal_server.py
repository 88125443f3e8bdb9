"""An action server that writes down each goal that it executes: `python goal_server.py FILE NAME`."""

from __future__ import annotations

import sys
from pathlib import Path

from actionlib_core import ActionServer
from actionlib_core.clock import current_clock
from actionlib_core.interfaces.actionlib.msg import TestAction, TestResult

if __name__ == "__main__":
    log, name = Path(sys.argv[1]), sys.argv[2]
    clock = current_clock()

    def execute(handle: object) -> None:
        goal = handle.get_goal()  # type: ignore[attr-defined]
        handle.set_accepted()  # type: ignore[attr-defined]
        with log.open("a") as file:
            file.write(f"{handle.get_goal_id().id} {goal.goal}\n")  # type: ignore[attr-defined]
        clock.call_later(
            0.02,
            lambda: handle.set_succeeded(TestResult(goal.goal)),  # type: ignore[attr-defined]
        )

    server = ActionServer(name, TestAction, execute, lambda _: None, auto_start=False)
    server.start()
    print("ready", flush=True)
    sys.stdin.read()
    server.stop()
