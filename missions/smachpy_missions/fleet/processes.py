"""Runs the robots of a fleet as processes on this machine, and kills some of them.

Each process runs one robot's mission and simulates its body on a floor of its own; or one more
process simulates all bodies on one floor, where they see each other.
"""

from __future__ import annotations

import json
import os
import signal
import tempfile
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actionlib_core.clock import current_clock
from smachpy import logwarn
from smachpy.command.robot_process import RobotProcess
from smachpy.states import MissionError
from smachpy_missions.interfaces.srv import PermitRequest

if TYPE_CHECKING:
    from collections.abc import Sequence

    from smachpy.states import Pose2D
    from smachpy_missions.fleet.dispatcher import Robot
    from smachpy_missions.fleet.site import Site

_DIES_AFTER: Final = 2.0  # [s] after it left with a parcel a robot is killed: it is on its way then


class RobotProcesses:
    """Starts one process per robot; a server for `smachpy.states.serve_during`.

    Args:
        robots: The robots to start.
        site: Where they work.
        site_file: The file that describes the site.
        lose: Kill this many robots, each on the way with its first parcel.
        together: Simulate all of them on one floor.

    Threads: `on_permit` may be called from any thread.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        site: Site,
        site_file: Path,
        *,
        lose: int = 0,
        together: bool = False,
    ) -> None:
        self._robots = tuple(robots)
        self._site = site
        self._site_file = site_file
        self._together = together
        self._lose = lose
        self._lock = threading.Lock()
        self._doomed: set[str] = set()
        self._processes: dict[str, RobotProcess] = {}
        self._stack = ExitStack()

    def start(self) -> RobotProcesses:
        """Start all processes; the robots accept goals as soon as they are ready.

        Raises:
            OSError: a file cannot be written, or a process cannot be started.
        """
        self._doomed.clear()
        if self._together and self._robots:
            folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory()))
            world = folder / "fleet.yaml"
            world.write_text(world_text(self._site, self._robots), encoding="utf-8")
            self._run("the floor", RobotProcess(("--world", str(world))))
        for robot in self._robots:
            x, y, yaw = (str(value) for value in robot.home)
            words = [robot.name, "--site", str(self._site_file), "--pose", x, y, yaw]
            words += ["--no-body"] if self._together else []
            self._run(robot.name, RobotProcess(words, program=("smachpy_missions.fleet.robot",)))
        return self

    def _run(self, name: str, process: RobotProcess) -> None:
        self._stack.callback(self._end, name, process)
        self._processes[name] = self._stack.enter_context(process)

    def close(self) -> None:
        """End all processes.

        Blocks: until they have ended, for 4 s at most.
        """
        # First ask all of them, then wait: they end side by side and not one after the other.
        for process in self._processes.values():
            process.let_go()
        self._stack.close()
        self._processes.clear()

    def on_permit(self, robot: str, step: int) -> None:
        """Note a granted step; schedule the death of a robot that leaves with a parcel."""
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
        """Log why a robot's process ended, unless it was killed on purpose."""
        try:
            process.check()
        except MissionError as error:
            if robot not in self._doomed:
                logwarn(f"{robot}: {error}")


def world_text(site: Site, robots: Sequence[Robot]) -> str:
    """Return a world file with these robots at home and with the site's docks."""
    assert site.map is not None
    lines = [f"map: {json.dumps(str(site.map.resolve()))}"]
    if site.robot is not None:
        lines.append(f"robot: {json.dumps(str(site.robot.resolve()))}")
    lines.append("robots:")
    lines += [f"  - {{name: {robot.name}, {_pose_text(robot.home)}}}" for robot in robots]
    lines.append("docks:")
    lines += [
        f"  - {{name: dock_{n}, {_pose_text(dock.pose)}}}" for n, dock in enumerate(site.docks, 1)
    ]
    return "\n".join(lines) + "\n"


def _pose_text(pose: Pose2D) -> str:
    return f"x: {pose.x:.4f}, y: {pose.y:.4f}, yaw: {pose.yaw:.4f}"
