"""`smachpy submit` and `smachpy runner`: a queue of missions, and the process that runs them."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import subprocess
import sys
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core import shutdown
from actionlib_core.clock import Event, RealClock
from actionlib_core.names import check_name
from actionlib_core.output import printable, tell
from smachpy.command.durable import JOURNAL, LEASE_S, store_name, whole_target, words_of
from smachpy.command.run import add_input, read_inputs
from smachpy.sim.geometry import positive_seconds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from smachpy.durable.store import MissionRow, Store

LOOK_S: Final = 2.0
"""Period of a runner's look into the queue [s]: nobody announces that a lease has run out."""
FIRST_REST_S: Final = 5.0  # [s] before a mission whose process died is tried again; doubles
LONGEST_REST_S: Final = 300.0  # [s] limit of that pause
MOST_AT_ONCE: Final = 999


def register_submit(subparsers: Any) -> None:
    """Add `smachpy submit`."""
    parser = subparsers.add_parser(
        "submit",
        help="put a mission into the queue of runners",
        usage="smachpy submit MISSION --db JOURNAL [OPTIONS] [-- ARGUMENTS]",
        description="Put a mission into the queue of a 'smachpy runner'.",
        epilog="The words after -- are the arguments of the mission's function. The mission is "
        "built once here, so that errors are reported now.",
    )
    parser.add_argument(
        "target", metavar="MISSION", help="as for `smachpy run`; runners need it, too"
    )
    _add_db(parser)
    add_input(parser)
    parser.add_argument("--mission", metavar="ID", help="its id (default: a new one)")
    parser.add_argument("--robot", default="", metavar="NAME", help="the robot that it uses")
    when = parser.add_mutually_exclusive_group()
    when.add_argument("--at", metavar="TIME", help="start it at 08:30, or 2026-03-28T08:30+01:00")
    when.add_argument(
        "--every",
        metavar="CRON",
        help="repeat it, '0 8 * * 1-5 Europe/Berlin' (default zone: UTC), until "
        "'smachpy missions cancel'",
    )
    parser.set_defaults(run=_submit, words=())


def register_runner(subparsers: Any) -> None:
    """Add `smachpy runner`."""
    parser = subparsers.add_parser(
        "runner",
        help="run the missions of a queue",
        description="Run the missions that 'smachpy submit' queued, and continue those whose "
        "process or computer died. Any number of runners on any number of computers may share a "
        "database. Ctrl-C and SIGTERM end it; its missions continue on other runners.",
    )
    _add_db(parser)
    parser.add_argument(
        "--robot",
        action="append",
        default=[],
        metavar="NAME",
        help="run only missions of this robot (repeatable; default: all missions)",
    )
    parser.add_argument(
        "--at-once",
        type=_count,
        default=1,
        metavar="N",
        help="how many missions run at once (default: %(default)s)",
    )
    parser.add_argument(
        "--lease",
        type=positive_seconds,
        default=LEASE_S,
        metavar="S",
        help="after this long without a sign of this computer another one takes over its missions "
        "[s] (default: %(default)g)",
    )
    parser.add_argument("--until-empty", action="store_true", help="end when the queue is empty")
    parser.set_defaults(run=_run)


def _add_db(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--db",
        default=JOURNAL,
        metavar="JOURNAL",
        help="postgresql://HOST/DATABASE, or a file for the runners of one computer (default: "
        "%(default)s)",
    )


def _submit(args: argparse.Namespace) -> int:
    from smachpy.command.runner import build
    from smachpy.command.targets import load_target
    from smachpy.durable.mission import new_mission
    from smachpy.durable.schedule import next_due, read_time
    from smachpy.durable.store import open_store

    robot = check_name(args.robot, "robot name") if args.robot else None
    now = RealClock().time_ns() / 1e9
    due = None if args.at is None else read_time(args.at, now)
    if args.every is not None:
        due = next_due(args.every, now)
    machine = build(load_target(args.target), read_inputs(args.input), args.words)
    row = dataclasses.replace(
        new_mission(
            machine,
            mission=args.mission,
            target=whole_target(args.target),
            argv=words_of(args),
            robot=robot,
        ),
        due=due,
        every=args.every,
    )
    with contextlib.closing(open_store(args.db)) as store:
        store.create(row)
    print(printable(f"mission {row.id}: queued in {store_name(args.db)}"))
    return 0


def _run(args: argparse.Namespace) -> int:
    from smachpy.durable.store import open_store

    robots = [check_name(name, "robot name") for name in args.robot]
    with shutdown.handle_signals() as ending, contextlib.closing(open_store(args.db)) as store:
        runner = Runner(store, args.db, robots=robots, at_once=args.at_once, lease_s=args.lease)
        forget = ending.on_shutdown(runner.wake.set)
        try:
            for_whom = f" for {', '.join(robots)}" if robots else ""
            print(printable(f"runner{for_whom} of {store_name(args.db)}"), flush=True)
            while not ending.requested():
                runner.look()
                if args.until_empty and runner.idle:
                    return 0
                runner.wait()
        finally:
            forget()
            runner.leave()
    return 0


class Runner:
    """Takes missions from a queue and runs each in a process of its own, which holds its lease.

    Args:
        store: The queue.
        journal: Its path or URL, for the processes.
        robots: Run only missions of these robots; empty: all missions.
        at_once: Number of missions that run at once.
        lease_s: How long a silent process holds its mission [s].

    Attributes:
        wake: Set when there may be something to do.
        idle: Whether nothing runs here, and nothing that this runner could take will be due.

    Threads: `look`, `wait` and `leave` are called from one thread.
    """

    def __init__(
        self, store: Store, journal: str, *, robots: Sequence[str], at_once: int, lease_s: float
    ) -> None:
        self._clock = RealClock()  # the missions run in processes of their own, in real time
        self.wake: Event = self._clock.event("work for the runner")
        self.idle = False
        self._store = store
        self._journal = journal
        self._robots = frozenset(robots)
        self._at_once = at_once
        self._lease_s = lease_s
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._rests: dict[
            str, tuple[float, float]
        ] = {}  # id -> (end of its pause, length of it) [s]
        self._pause = 0.0
        self._unreachable = False

    def look(self) -> None:
        """Start missions that are due, and note those that have ended."""
        from smachpy.durable.schedule import due_schedules, next_mission, next_time
        from smachpy.durable.store import RUNNING, StoreError

        self.wake.clear()
        self._pause = LOOK_S
        now = self._clock.time_ns() / 1e9
        try:
            self._note_ends(now)
            rows = self._store.missions(open_only=True)
            for schedule, begun, due in due_schedules(rows, now):
                self._store.begin_next(begun, due=schedule.due, next_due=due)
                self._pause = 0.0
        except StoreError as error:
            if error.reason not in {"busy", "unreachable"}:
                raise
            # Reported once per outage: the loop comes back every few seconds.
            if not self._unreachable:
                tell("smachpy runner", str(error))
            self._unreachable = True
            return
        self._unreachable = False
        resting = {mission for mission, (until, _) in self._rests.items() if until > now}
        while len(self._processes) < self._at_once:
            row = next_mission(rows, now, self._robots, {*self._processes, *resting})
            if row is None:
                break
            self._start(row)
            running = dataclasses.replace(row, status=RUNNING)
            # The row is as it was read: mark it here, so that its robot gets no second mission.
            rows = [running if each is row else each for each in rows]
        later = next_time(rows, now)
        if later is not None:
            self._pause = max(0.0, min(self._pause, later - now))
        self.idle = not self._processes and later is None and self._pause > 0

    def wait(self) -> None:
        """Wait until a mission has ended or may be due."""
        self.wake.wait(self._pause)

    def leave(self) -> None:
        """Kill the processes: other runners continue their missions, with the goals that run."""
        for process in self._processes.values():
            process.kill()
            process.wait()

    def _start(self, row: MissionRow) -> None:
        # -P: a user's module in the current folder must not take the place of one of ours.
        command = [sys.executable, "-P", "-m", "smachpy.command", "run", row.target, "--plain"]
        command += ["--durable", self._journal, "--mission", row.id, f"--lease={self._lease_s}"]
        command += ["--robot", row.robot] if row.robot else []
        verb = "begins" if row.status == "queued" else "is resumed"
        print(printable(f"mission {row.id}: {verb}"), flush=True)
        process = subprocess.Popen(  # noqa: S603  our own command
            [*command, *row.argv],
            stdin=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for the runner: it would preempt the mission
        )
        self._processes[row.id] = process
        self._clock.spawn(partial(self._watch, process), name=f"end of {row.id}")

    def _watch(self, process: subprocess.Popen[bytes]) -> None:
        process.wait()
        self.wake.set()

    def _note_ends(self, now: float) -> None:
        """Report missions that have ended; one that is not over pauses before the next attempt."""
        from smachpy.durable.store import INTERRUPTED, QUEUED, UnknownMissionError

        ended = [one for one, process in self._processes.items() if process.poll() is not None]
        for mission in ended:
            try:
                row = self._store.mission(mission)
            except UnknownMissionError:
                how = "forgotten"
            else:
                how = f"{row.status}{f': {row.outcome}' if row.outcome else ''}"
                if row.status in {QUEUED, INTERRUPTED}:
                    before = self._rests.get(mission, (now, FIRST_REST_S / 2))[1]
                    rest = min(2 * before, LONGEST_REST_S)
                    self._rests[mission] = (now + rest, rest)
            code = self._processes.pop(mission).returncode
            print(printable(f"mission {mission}: {how} (exit code {code})"), flush=True)


def _count(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) <= MOST_AT_ONCE:
        raise argparse.ArgumentTypeError(
            f"got {text!r}; expected a number from 1 to {MOST_AT_ONCE}"
        )
    return int(text)
