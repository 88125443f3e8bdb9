"""A fleet whose code is updated computer by computer while its missions run; prints what came of it.

    python tests/soak/fleet.py [--seconds 120] [--seed 1] [--keep DIRECTORY]

Two computers run the missions of one queue on two robots. Now and then a new version of the mission
comes, which has other states: one computer after the other gets it, its runner is stopped or killed
and started again, and so is each robot's action server. The last computer keeps the old version
until the missions of that are over. All the time missions come in, of the version of the day; each
calls its robot by one of its names. At the end it holds that

- every mission is over, and did all that its own version has, in its order;
- a robot's missions came one after the other, whatever it was called;
- a goal was executed once.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from smachpy.durable.opening import open_store

ROBOTS = ("r1", "r2")
NAMES = ("{}", "/{}", "")  # the last: the mission's action says which robot it is
SUBMIT_S = 0.5  # between two missions
SUBMITTING = 3  # at the same time
DRIVE_S = 0.4
DRAIN_S = 90.0  # longest wait until the missions of the old version are over
TICK_S = 0.1

MISSION = """
import json, os, time
import smachpy
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal

VERSION = {version}


def say(what):
    @smachpy.state(outcomes=["done"], input_keys=["number", "robot"])
    def state(userdata):
        note = {{"t": time.monotonic(), "what": what, "version": VERSION}}
        note.update(mission=userdata.number, robot=userdata.robot)
        with open({log!r}, "a") as log:
            log.write(json.dumps(note) + "\\n")
        return "done"

    return state


def mission(number: int = 0, robot: str = "r1"):
    machine = smachpy.StateMachine(["done", "preempted"], name="ERRAND")
    machine.userdata.number, machine.userdata.robot = number, robot
    drive = smachpy.SimpleActionState(
        f"/{{robot}}/drive", TestAction, goal=TestGoal(number), server_wait_timeout=60.0
    )
    again = {{"succeeded": "LEAVE", "aborted": "DRIVE", "preempted": "preempted"}}
    with machine:
        smachpy.StateMachine.add("ENTER", say("enter"), {{"done": "CHECK_{version}"}})
        smachpy.StateMachine.add("CHECK_{version}", say("check"), {{"done": "DRIVE"}})
        smachpy.StateMachine.add("DRIVE", drive, again)
        smachpy.StateMachine.add("LEAVE", say("leave"))
    return machine
"""

SERVER = """
import json, sys, time
from actionlib_core import Preempted, server, shutdown
from actionlib_core.interfaces.actionlib.msg import TestAction, TestResult

robot, path = sys.argv[1:]


@server(f"/{robot}/drive", TestAction)
def drive(goal, ctx):
    note = {"t": time.monotonic(), "what": "goal", "mission": goal.goal, "robot": robot}
    with open(path, "a") as log:
        log.write(json.dumps({**note, "id": ctx.goal_id}) + "\\n")
    if ctx.sleep(DRIVE_S):
        raise Preempted("stopped")
    return TestResult(goal.goal)


with shutdown.handle_signals() as ending, drive.start():
    ending.event().wait()
""".replace("DRIVE_S", str(DRIVE_S))


@dataclass
class Computer:
    """A folder with a version of the mission, and the runner that uses it."""

    folder: Path
    version: int = 0
    runner: subprocess.Popen[bytes] | None = None


@dataclass
class Figures:
    """What came of a campaign."""

    counts: collections.Counter[str] = field(default_factory=collections.Counter)
    longest_wait: float = 0.0
    problems: list[str] = field(default_factory=list)


class Fleet:
    """The processes of a campaign.

    Args:
        place: A folder for all that they write.
        rng: Says what happens when.
    """

    def __init__(self, place: Path, rng: random.Random) -> None:
        self.random = rng
        self.log = place / "log.jsonl"
        self.log.touch()
        self.queue = str(place / "queue.db")
        self.version = 0
        self.figures = Figures()
        self.submitted: dict[int, tuple[int, str, float]] = {}  # number -> version, robot, time
        self.laptop = Computer(place / "laptop")
        self.computers = [Computer(place / f"computer_{n}") for n in (1, 2)]
        self.servers: dict[str, subprocess.Popen[bytes]] = {}
        self.submitting: dict[int, subprocess.Popen[bytes]] = {}
        self._place = place
        self._store = open_store(self.queue)
        self._domain = str(1 + os.getpid() % 9999)
        (place / "server.py").write_text(SERVER)
        for computer in (self.laptop, *self.computers):
            computer.folder.mkdir()

    # -- processes -----------------------------------------------------------------------------

    def _start(self, folder: Path, *words: str) -> subprocess.Popen[bytes]:
        environment = {**os.environ, "PYTHONPATH": str(folder), "SMACHPY_DOMAIN": self._domain}
        with (self._place / "output").open("ab") as output:
            return subprocess.Popen(
                [sys.executable, *words],
                cwd=folder,
                env={**environment, "PYTHONDONTWRITEBYTECODE": "1"},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
            )

    def install(self, computer: Computer) -> None:
        """Install the version of the day."""
        text = MISSION.format(version=self.version, log=str(self.log))
        (computer.folder / "errand.py").write_text(text)
        computer.version = self.version

    def start_runner(self, computer: Computer) -> None:
        words = ["runner", "--db", self.queue, "--allow", "errand", "--at-once", "2"]
        computer.runner = self._start(computer.folder, "-m", "smachpy", *words)

    def stop_runner(self, computer: Computer) -> None:
        assert computer.runner is not None
        # When it is killed, its missions go on; when it is stopped, others resume them.
        kill = self.random.random() < 0.3
        computer.runner.send_signal(signal.SIGKILL if kill else signal.SIGTERM)
        computer.runner.wait()
        self.figures.counts["runners killed" if kill else "runners stopped"] += 1

    def start_server(self, robot: str) -> None:
        script = str(self._place / "server.py")
        self.servers[robot] = self._start(self._place, script, robot, str(self.log))

    def restart_server(self, robot: str) -> None:
        number = self.random.choice([signal.SIGTERM, signal.SIGKILL])
        self.servers[robot].send_signal(number)
        self.servers[robot].wait()
        self.start_server(robot)
        self.figures.counts["servers restarted"] += 1

    def submit(self) -> None:
        number, robot = len(self.submitted) + 1, self.random.choice(ROBOTS)
        name = self.random.choice(NAMES).format(robot)
        named = ["--robot", name] if name else []
        words = ["submit", "errand:mission", "--db", self.queue, "--mission", str(number), *named]
        self.submitted[number] = self.version, robot, time.monotonic()
        words += ["--", str(number), robot]
        self.submitting[number] = self._start(self.laptop.folder, "-m", "smachpy", *words)

    def _note_submitted(self) -> None:
        for number, process in list(self.submitting.items()):
            if process.poll() is not None:
                del self.submitting[number]
                if process.returncode:
                    self.figures.problems.append(f"mission {number} cannot be submitted")

    # -- a campaign ----------------------------------------------------------------------------

    def update(self) -> None:
        """Bring the next version to all computers, while missions come in and run."""
        while self.submitting:  # they read the mission that is to be replaced
            self._note_submitted()
            time.sleep(TICK_S)
        self.version += 1
        self.figures.counts["updates"] += 1
        self.install(self.laptop)
        first, last = self.random.sample(self.computers, 2)
        self._update(first)
        for robot in ROBOTS:
            self.work(self.random.uniform(0.0, 3.0))
            self.restart_server(robot)
        self.work(3.0)
        deadline = time.monotonic() + DRAIN_S
        while self.unfinished(self.version - 1) and time.monotonic() < deadline:
            self.work(TICK_S)
        if left := self.unfinished(self.version - 1):
            self.figures.problems.append(f"missions {left} are not over with a runner that fits")
        self._update(last)

    def _update(self, computer: Computer) -> None:
        self.stop_runner(computer)
        self.install(computer)
        self.start_runner(computer)

    def work(self, seconds: float) -> None:
        """Let missions come in for some time."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            newest = max((when for *_, when in self.submitted.values()), default=0.0)
            self._note_submitted()
            if time.monotonic() > newest + SUBMIT_S and len(self.submitting) < SUBMITTING:
                self.submit()
            time.sleep(TICK_S)

    def unfinished(self, up_to: int) -> list[int]:
        """Return the missions of versions up to one that are not over."""
        over = {row.id for row in self._store.missions() if row.outcome}
        return [
            number
            for number, (version, *_) in self.submitted.items()
            if version <= up_to and str(number) not in over
        ]

    def run(self, seconds: float) -> None:
        for computer in (self.laptop, *self.computers):
            self.install(computer)
        for robot in ROBOTS:
            self.start_server(robot)
        for computer in self.computers:
            self.start_runner(computer)
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.work(self.random.uniform(2.0, 6.0))
            self.update()
        last = time.monotonic() + DRAIN_S
        while self.unfinished(self.version) and time.monotonic() < last:
            self._note_submitted()
            time.sleep(TICK_S)

    def close(self) -> None:
        """Leave nothing running."""
        runners = (one.runner for one in self.computers)
        processes = [*self.servers.values(), *self.submitting.values(), *runners]
        for process in filter(None, processes):
            process.terminate()
        for process in filter(None, processes):
            process.wait()
        self._store.close()

    # -- what is promised ----------------------------------------------------------------------

    def judge(self) -> Figures:
        figures, rows = self.figures, {row.id: row for row in self._store.missions()}
        notes = [json.loads(line) for line in self.log.read_text().splitlines()]
        notes.sort(key=lambda note: note["t"])
        said: dict[int, list[dict[str, Any]]] = collections.defaultdict(list)
        order: dict[str, list[int]] = {robot: [] for robot in ROBOTS}
        ids: collections.Counter[str] = collections.Counter()
        for note in notes:
            said[note["mission"]].append(note)
            if order[note["robot"]][-1:] != [note["mission"]]:
                order[note["robot"]].append(note["mission"])
            if note["what"] == "goal":
                ids[note["id"]] += 1
        figures.problems += [f"goal {one} executed {n} times" for one, n in ids.items() if n > 1]
        for robot, numbers in order.items():
            for number, times in collections.Counter(numbers).items():
                if times > 1:
                    figures.problems.append(f"{robot}: mission {number} met others: {numbers}")
        for number, (version, _, when) in self.submitted.items():
            row = rows.get(str(number))
            if row is None or row.outcome != "done":
                figures.problems.append(f"mission {number}: {row and (row.status, row.note)}")
                continue
            steps = list(dict.fromkeys(note["what"] for note in said[number]))
            if steps != ["enter", "check", "goal", "leave"]:
                figures.problems.append(f"mission {number} did {steps}")
            if wrong := {n["version"] for n in said[number] if "version" in n} - {version}:
                figures.problems.append(f"mission {number} of version {version} ran as {wrong}")
            figures.longest_wait = max(figures.longest_wait, said[number][0]["t"] - when)
        figures.counts.update({"missions": len(self.submitted), "goals": len(ids)})
        return figures


def main(seconds: float, seed: int, *, keep: Path | None = None) -> Figures:
    """Run a campaign and return its figures.

    Args:
        seconds: Its length, without the last missions.
        seed: Which updates, and when. What runs when within the processes is the computer's choice.
        keep: Where log and queue go; None: nowhere.
    """
    with contextlib.ExitStack() as stack:
        place = keep or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="soak-")))
        place.mkdir(parents=True, exist_ok=True)
        fleet = Fleet(place, random.Random(seed))
        stack.callback(fleet.close)
        fleet.run(seconds)
        return fleet.judge()


def print_figures(figures: Figures) -> None:
    for name, count in figures.counts.items():
        print(f"  {name}: {count}")
    print(f"  longest wait of a mission [s]: {figures.longest_wait:.1f}")
    print(f"  problems: {len(figures.problems)}")
    for problem in figures.problems[:20]:
        print(f"  PROBLEM: {problem}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="where log and queue go")
    options = parser.parse_args()
    found = main(options.seconds, options.seed, keep=options.keep)
    print_figures(found)
    sys.exit(1 if found.problems else 0)
