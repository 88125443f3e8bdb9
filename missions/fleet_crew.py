"""The robots of a fleet as processes of this machine, and how some of them die."""

from __future__ import annotations

import os
import signal
import threading
from contextlib import ExitStack
from typing import TYPE_CHECKING, Final

from actionlib_core.clock import current_clock
from missions.exceptions import MissionError
from missions.interfaces.srv import PermitRequest
from missions.robot_process import RobotProcess
from smachpy import logwarn

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from missions.fleet_desk import Robot

_DIES_AFTER: Final = 2.0  # [s] on the way, with the parcel aboard


class Crew:
    """Starts a process for each robot; a server in the sense of `missions.serving`.

    Args:
        robots: Whom to start.
        site: The file that says what floor they are on.
        lose: So many of them are killed, each on the way with its first parcel.

    Threads: `on_permit` may be called from any thread.
    """

    def __init__(self, robots: Sequence[Robot], site: Path, lose: int = 0) -> None:
        self._robots = tuple(robots)
        self._site = site
        self._lose = lose
        self._lock = threading.Lock()
        self._doomed: set[str] = set()
        self._processes: dict[str, RobotProcess] = {}
        self._stack = ExitStack()

    def start(self) -> Crew:
        """Start them all; they take goals as soon as they are ready."""
        self._doomed.clear()
        for robot in self._robots:
            x, y, yaw = (str(value) for value in robot.home)
            process = RobotProcess((robot.name, "--pose", x, y, yaw), module="missions.fleet_robot")
            self._stack.callback(self._end, robot.name, process)
            self._processes[robot.name] = self._stack.enter_context(process)
        return self

    def close(self) -> None:
        """End them all.

        Blocks: until they have ended, 4 s at most.
        """
        for process in self._processes.values():
            process.let_go()
        self._stack.close()
        self._processes.clear()

    def on_permit(self, robot: str, step: int) -> None:
        """Note a robot's step; one that is to be lost dies soon after it has left with a parcel."""
        with self._lock:
            if step != PermitRequest.DRIVE_OFF or len(self._doomed) >= self._lose:
                return
            if robot not in self._processes or robot in self._doomed:
                return
            self._doomed.add(robot)
        current_clock().call_later(_DIES_AFTER, lambda: self._kill(robot))

    def _kill(self, robot: str) -> None:
        process = self._processes.get(robot)
        if process is not None:
            os.kill(process.pid, signal.SIGKILL)

    def _end(self, robot: str, process: RobotProcess) -> None:
        """Say what a robot died of, unless that was meant."""
        try:
            process.check()
        except MissionError as error:
            if robot not in self._doomed:
                logwarn(f"{robot}: {error}")
