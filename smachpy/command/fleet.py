"""`smachpy submit` and `smachpy runner`: a queue of missions, and the process that runs them."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import os
import re
import signal
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core import shutdown
from actionlib_core.clock import Event, RealClock
from actionlib_core.command_line.numbers import between, seconds
from actionlib_core.names import check_name, resolve_name
from actionlib_core.process.output import printable, tell
from smachpy.command import EXIT_ERROR
from smachpy.command.durable import JOURNAL, LEASE_S, robot_name, whole_target, words_of
from smachpy.command.pruning import add_keep, age, deleted, is_kept
from smachpy.command.queued import Allowed, add_allow, add_allow_packages, run_words
from smachpy.command.run import add_input, add_require_evidence, read_inputs
from smachpy.command.warm import Starter
from smachpy.durable.store import for_child, store_name
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from actionlib_core.shutdown import Shutdown
    from smachpy.command.warm import MissionProcess
    from smachpy.durable.store import Lease, MissionRow, Store

LOOK_S: Final = 2.0
"""Period of a runner's look into the queue [s]: nobody announces that a lease has run out."""
FIRST_REST_S: Final = 5.0  # [s] before a mission whose process died is tried again; doubles
MAX_REST_S: Final = 300.0  # [s] limit of that pause
MAX_ATTEMPTS: Final = 3
"""After so many attempts `--until-empty` gives a mission up."""
MAX_UNFIT_STARTS: Final = 3
"""After so many missions of one target that did not begin here, the target itself rests."""
START_S: Final = 60.0
"""Time that a process has from its start until it claims the mission reserved for it [s]."""
PRUNE_EVERY_S: Final = 3600.0
"""Time between two deletions of old missions [s]."""
MAX_MISSIONS_AT_ONCE: Final = 999
MAX_PRIORITY: Final = 1000
MAX_TRIES: Final = 1000
"""The most missions that a runner takes, or puts back, in one look."""
MAX_TOLD_MISSIONS: Final = 100
"""Problems of single missions are reported up to this number."""
SUSPEND_S: Final = 10.0
"""Longest wait of a runner's end for the processes of its missions; then they are killed [s]."""


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
    parser.add_argument(
        "--not-after", metavar="TIME", help="cancel it if it has not begun by then, as for --at"
    )
    parser.add_argument(
        "--priority",
        type=between(-MAX_PRIORITY, MAX_PRIORITY),
        default=0,
        metavar="N",
        help="missions with a higher number begin first (default: %(default)s)",
    )
    parser.add_argument(
        "--group",
        metavar="NAME",
        help="one mission of a group runs at a time, such as those that use the lift",
    )
    add_allow_packages(parser)
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
        type=between(1, MAX_MISSIONS_AT_ONCE),
        default=1,
        metavar="N",
        help="how many missions run at once (default: %(default)s)",
    )
    parser.add_argument(
        "--lease",
        type=seconds,
        default=LEASE_S,
        metavar="S",
        help="after this long without a sign of this computer another one takes over its missions "
        "[s] (default: %(default)g)",
    )
    parser.add_argument("--until-empty", action="store_true", help="end when the queue is empty")
    parser.add_argument(
        "--prune",
        type=age,
        metavar="AGE",
        help="each hour, delete missions that have been over for so long: 30d, 12h",
    )
    add_keep(parser, "missions")
    add_allow(parser, "run missions of this place, too")
    add_require_evidence(parser)
    parser.add_argument(
        "--record", type=Path, metavar="DIR", help="write each mission to a file in this folder"
    )
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
    from actionlib_core.config import load_config
    from smachpy.command.mission_run import build
    from smachpy.command.needs import driven_robot, needed_servers
    from smachpy.command.targets import load_target
    from smachpy.durable.mission import new_mission
    from smachpy.durable.opening import open_store
    from smachpy.durable.schedule import next_due, read_time
    from smachpy.events.introspection import describe

    robot = robot_name(args.robot) if args.robot else None
    group = None if args.group is None else check_name(args.group, "group name")
    now = RealClock().time_ns() / 1e9
    due = None if args.at is None else read_time(args.at, now)
    not_after = None if args.not_after is None else read_time(args.not_after, now, "--not-after")
    if not_after is not None and (args.every is not None or (due is not None and not_after <= due)):
        got = "it beside --every" if due is None else f"{args.not_after!r} beside --at {args.at!r}"
        expected = "a mission that begins once, and a later time than --at"
        raise MissionError(f"--not-after: got {got}; expected {expected}.")
    if args.every is not None:
        due = next_due(args.every, now)
    target = load_target(args.target, allow=args.allow)
    machine = build(target, read_inputs(args.input), args.words, kept=True)
    space = robot or load_config().namespace
    names = [resolve_name(name, namespace=space) for name in needed_servers(describe(machine))]
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
        drives=driven_robot(names, robot),
        not_after=not_after,
        priority=args.priority,
        group=group,
    )
    with contextlib.closing(open_store(args.db)) as store:
        store.create(row)
    print(printable(f"mission {row.id}: queued in {store_name(args.db)}"))
    return 0


def _run(args: argparse.Namespace) -> int:
    robots = [robot_name(name) for name in args.robot]
    with shutdown.handle_signals() as ending:
        store = _open_in_time(args, ending)
        if store is None:
            return 0
        with contextlib.closing(store):
            runner = Runner(
                store,
                args.db,
                robots=robots,
                at_once=args.at_once,
                lease_s=args.lease,
                allow=args.allow,
                evidence=args.require_evidence,
                record=args.record,
                until_empty=args.until_empty,
                prune=None if args.prune is None else (args.prune, args.keep),
            )
            forget = ending.on_shutdown(runner.wake.set)
            deafen = store.listen(runner.wake.set)
            try:
                for_whom = f" for {', '.join(robots)}" if robots else ""
                print(printable(f"runner{for_whom} of {store_name(args.db)}"), flush=True)
                while not ending.requested():
                    runner.look()
                    if args.until_empty and runner.idle:
                        return runner.tell_left()
                    runner.wait()
            finally:
                forget()
                if deafen is not None:
                    deafen()
                runner.leave()
    return 0


def _open_in_time(args: argparse.Namespace, ending: Shutdown) -> Store | None:
    """Open the store; wait for a database that starts later, as after a power failure.

    Returns:
        None if the process was asked to end before it answered.
    """
    from smachpy.durable.opening import open_store
    from smachpy.durable.store import StoreError

    wake = ending.event()
    is_told = False
    while not ending.requested():
        try:
            return open_store(args.db)
        except StoreError as error:
            if error.reason != "unreachable" or "://" not in args.db or args.until_empty:
                raise
            if not is_told:
                tell("smachpy runner", f"{error} The runner waits for it.")
            is_told = True
            wake.wait(LOOK_S)
    return None


@dataclasses.dataclass(slots=True)
class _Rest:
    """A pause after attempts that have failed.

    Attributes:
        attempts: How many there were.
        until: When it ends [s].
    """

    attempts: int = 0
    until: float = 0.0

    def fail(self, now: float, free: int = 0) -> None:
        """Count one more; after more than `free` ones the pause doubles with each."""
        self.attempts += 1
        doublings = self.attempts - free - 1
        rest = FIRST_REST_S * 2.0 ** min(doublings, 99) if doublings >= 0 else 0.0
        self.until = now + min(rest, MAX_REST_S)


def _forget_old(rests: dict[Any, _Rest], now: float) -> None:
    for key in [key for key, rest in rests.items() if rest.until < now - MAX_REST_S]:
        del rests[key]


def recording_name(run: str) -> str:
    """Return the name of a run's file; the run's name comes from the queue, and may be anything."""
    words = re.sub(r"[^A-Za-z0-9_-]+", "_", run)[:100].strip("_")
    return f"{words}-{hashlib.sha256(run.encode('utf-8', 'replace')).hexdigest()[:8]}.jsonl"


class Runner:
    """Takes missions from a queue and runs each in a process of its own, which holds its lease.

    Args:
        store: The queue.
        journal: Its path or URL, for the processes.
        robots: Run only missions of these robots; empty: all missions.
        at_once: Number of missions that run at once.
        lease_s: How long a silent process holds its mission [s].
        allow: Places whose missions are run besides the installed ones, see
            `smachpy.command.queued`.
        evidence: Files and folders: a mission without evidence in them is not begun; none: any is.
        record: Folder for recordings; None: there are none.
        until_empty: Whether it gives up missions that fail again and again.
        prune: Each hour missions are deleted that have been over for so long [s], except those that
            the second word keeps, see `smachpy.command.pruning`; None: never.

    Attributes:
        wake: Set when there may be something to do.
        idle: With `until_empty`, whether nothing runs here, and nothing that this runner could take
            waits or will be due.

    Threads: `look`, `wait` and `leave` are called from one thread.
    """

    def __init__(
        self,
        store: Store,
        journal: str,
        *,
        robots: Sequence[str],
        at_once: int,
        lease_s: float,
        allow: Sequence[str] = (),
        evidence: Sequence[str] = (),
        record: Path | None = None,
        until_empty: bool = False,
        prune: tuple[float, str] | None = None,
    ) -> None:
        self._clock = RealClock()  # the missions run in processes of their own, in real time
        self.wake: Event = self._clock.event("work for the runner")
        self.idle = False
        self._store = store
        self._robots = frozenset(robots)
        self._at_once = at_once
        self._lease_s = lease_s
        self._allow = allow
        self._evidence = evidence
        self._record = record
        self._allowed = Allowed(allow)
        self._refused: dict[str, None] = {}  # targets that are not allowed here, in their order
        self._given_up: set[str] = set()  # missions that are left to other runners
        self._left: list[str] = []  # missions that are not allowed here
        self._until_empty = until_empty
        self._prune_options = prune
        self._prunes_at = self._clock.now()
        self._address, secrets = for_child(journal)
        self._starter = Starter({**os.environ, **secrets}, self.wake.set)
        self._processes: dict[str, MissionProcess] = {}
        self._leases: dict[str, Lease] = {}  # of reservations
        self._rests: defaultdict[str, _Rest] = defaultdict(_Rest)  # id of a mission -> its pause
        # The same for a target whose missions cannot begin here, such as one that is not installed.
        # By the machine's structure, too: those of another version may wait for another computer.
        self._shape_rests: defaultdict[tuple[str, bytes], _Rest] = defaultdict(_Rest)
        self._told: set[str] = set()  # problems that were reported
        self._pause = 0.0
        self._unreachable = False

    def look(self) -> None:
        """Start missions that are due, and note those that have ended."""
        from smachpy.durable.store import StoreError

        self.wake.clear()
        self._pause = LOOK_S
        try:
            self._note_ends()
            news = self._store.look(robots=self._robots)
            for mission in news.cancelled:
                print(printable(f"mission {mission}: cancelled, it was not begun in time"))
            for schedule in news.schedules:
                self._begin_next(schedule, news.now)
            # Bounded: a queue may be full of what is not allowed here.
            tries = MAX_TRIES if news.free or news.schedules else 0
            while tries and len(self._processes) < self._at_once and self._take():
                tries -= 1
            self._prune()
            waiting = self._until_empty and not self._processes and self._waits_here()
        except StoreError as error:
            if error.reason not in {"busy", "unreachable"}:
                raise
            # Reported once per outage: the loop comes back every few seconds.
            if not self._unreachable:
                tell("smachpy runner", str(error))
            self._unreachable = True
            return
        self._unreachable = False
        # A schedule that is due and still there could not begin; its time is not waited for.
        times = [one for one in (news.next_due, news.next_schedule) if one]
        self._pause = min([self._pause, *times])
        self.idle = not (self._processes or waiting or times or news.schedules)

    def _prune(self) -> None:
        """Delete old missions, once an hour; a full disk is told and does not end the runner."""
        from smachpy.durable.store import StoreError
        from smachpy.durable.structure import success_of

        if self._prune_options is None or self._clock.now() < self._prunes_at:
            return
        self._prunes_at = self._clock.now() + PRUNE_EVERY_S
        seconds, keep = self._prune_options
        try:
            gone = self._store.prune(
                seconds, keep=lambda row: is_kept(keep, row.outcome, row.status, success_of(row))
            )
        except StoreError as error:
            if error.reason not in {"full", "failed"}:
                raise
            tell("smachpy runner", f"old missions are not deleted: {error}")
            return
        if gone:
            print(printable(deleted(gone)), flush=True)

    def _begin_next(self, schedule: MissionRow, now: float) -> None:
        """Put the next mission of a schedule into the queue; one that cannot be read is told."""
        from smachpy.durable.schedule import ScheduleError, next_of

        problem = self._allowed.problem(schedule.target)
        if problem:
            problem = f"{schedule.target!r:.300}: {problem}"
        else:
            try:
                begun, due = next_of(schedule, now)
            except (ScheduleError, ModuleNotFoundError) as error:
                # Another computer may know the zone, or have the extra: it stays as it is.
                problem = f"its schedule is left to other runners: {error}"
        if problem:
            self._tell_once(f"mission {schedule.id}: {problem}")
        else:
            self._store.begin_next(begun, due=schedule.due, next_due=due)

    def _tell_once(self, text: str) -> None:
        if text not in self._told and len(self._told) < MAX_TOLD_MISSIONS:
            self._told.add(text)
            tell("smachpy runner", text)

    def _take(self) -> bool:
        """Reserve the mission that comes next, and start its process; return whether there was one.

        Its process gets the lease. Until it has claimed the mission with that, nobody else takes
        it, unless `START_S` pass.
        """
        from smachpy.durable.mission import MAX_NOTE_LENGTH
        from smachpy.durable.processes import this_runner

        now = self._clock.now()
        found = self._store.reserve(
            this_runner(),
            seconds=max(START_S, self._lease_s),
            robots=self._robots,
            leave=[
                *self._given_up,
                *(mission for mission, rest in self._rests.items() if rest.until > now),
                *self._processes,  # given back by a process that has not ended yet
            ],
            leave_targets=list(self._refused),
            leave_shapes=[shape for shape, rest in self._shape_rests.items() if rest.until > now],
        )
        if found is None:
            return False
        row, lease = found
        row = dataclasses.replace(row, id=lease.mission)  # the id of a damaged row may be no text
        self._leases[row.id] = lease
        problem = self._allowed.problem(row.target)
        if row.problem:
            self._note_failure(row, f"its row is damaged ({row.problem})", begun=False)
        elif problem:
            self._refused[row.target] = None
            self._tell_once(f"mission {row.id}: {row.target!r:.300}: {problem}")
            self._store.release(lease, None, note=f"{this_runner()}: {problem}"[:MAX_NOTE_LENGTH])
        else:
            self._start(row)
        if row.id not in self._processes:
            del self._leases[row.id]
        return True

    def _start(self, row: MissionRow) -> None:
        """Start the process of a mission that is reserved; if that fails, put it back."""
        lease = self._leases[row.id]
        words = [*run_words(self._address, row.id, self._allow, self._evidence), "--plain"]
        words += [f"--lease={self._lease_s}", f"--reserved={lease.runner}:{lease.fence}"]
        if self._record is not None:
            words.append(f"--record={self._record / recording_name(row.run)}")
        verb = "begins" if row.status == "queued" else "is resumed"
        print(printable(f"mission {row.id}: {verb}"), flush=True)
        try:
            self._processes[row.id] = self._starter.start(words)
        except (OSError, ValueError) as error:  # no memory; a word with a null character
            self._note_failure(row, f"its process cannot be started: {error}", begun=False)

    def tell_left(self) -> int:
        """Return the exit code for an empty queue; report missions that may not be run here."""
        if self._left:
            text = f"left in the queue, as they are not allowed here: {', '.join(self._left)}"
            way_out = "Try --allow, or 'smachpy missions cancel'."
            tell("smachpy runner", f"{text}; expected none. {way_out}")
        return EXIT_ERROR if self._left or self._given_up else 0

    def _waits_here(self) -> bool:
        """Return whether a mission waits that this runner could take and has not given up."""
        from smachpy.durable.store import INTERRUPTED, QUEUED

        # One list for each robot: those of others may be as many as a list has.
        waiting = [
            row
            for robot in self._robots or (None,)
            for row in self._store.missions(statuses=(QUEUED, INTERRUPTED), robot=robot)
            if row.every is None and row.owner is None and row.id not in self._given_up
        ]
        self._left = [row.id for row in waiting if self._allowed.problem(row.target)]
        return len(self._left) < len(waiting)

    def wait(self) -> None:
        """Wait until a mission has ended or may be due."""
        self.wake.wait(self._pause)

    def leave(self) -> None:
        """Suspend the missions: other runners continue them, with the goals that run.

        Blocks: until their processes have ended, `SUSPEND_S` at most.
        """
        by = self._clock.now() + SUSPEND_S
        self._starter.close()
        for process in self._processes.values():
            process.signal(signal.SIGTERM)
        for mission, process in self._processes.items():
            if not process.wait(max(0.0, by - self._clock.now())):
                process.signal(signal.SIGKILL)
                process.wait(SUSPEND_S)
            with contextlib.suppress(MissionError):
                self._store.release(self._leases[mission], None)

    def _note_ends(self) -> None:
        """Report missions that have ended; one that is not over pauses before the next attempt."""
        from smachpy.durable.store import OVER, QUEUED, StoreError

        ended = [one for one, process in self._processes.items() if process.over.is_set()]
        for mission in ended:
            number = self._processes[mission].code
            code = f"exit code {'unknown' if number is None else number}"
            row, how = None, "forgotten"
            try:
                row = self._store.find(mission)
            except StoreError as error:
                if error.reason != "corrupt":
                    raise
                how = "damaged"
            if row is not None:
                how = f"{row.status}{f': {row.outcome}' if row.outcome else ''}"
                if row.status != QUEUED:
                    self._shape_rests.pop((row.target, row.structure), None)
            if row is not None and row.status not in OVER:
                self._note_failure(row, code, begun=row.status != QUEUED)
            else:
                self._rests.pop(mission, None)
            print(printable(f"mission {mission}: {how} ({code})"), flush=True)
            del self._processes[mission], self._leases[mission]

    def _note_failure(self, row: MissionRow, why: str, *, begun: bool) -> None:
        """Put a mission back into the queue, and let it rest here."""
        from smachpy.durable.processes import this_runner
        from smachpy.durable.store import FencedError

        mission, now = row.id, self._clock.now()
        # Its process has claimed it, and has released it with a reason of its own, or died.
        with contextlib.suppress(FencedError):
            self._store.release(self._leases[mission], None, note=f"{this_runner()}: {why}")
        self._rests[mission].fail(now)
        if not begun:
            self._shape_rests[row.target, row.structure].fail(now, MAX_UNFIT_STARTS - 1)
        if self._until_empty and (not begun or self._rests[mission].attempts >= MAX_ATTEMPTS):
            self._given_up.add(mission)
            tell("smachpy runner", f"mission {mission}: given up, it stays {row.status}: {why}")
        _forget_old(self._rests, now)
        _forget_old(self._shape_rests, now)
