"""`smachpy run --durable`: opens the mission's journal, and finds the mission in it."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.command_line.numbers import seconds
from actionlib_core.names import check_name, clean_namespace
from actionlib_core.process.output import printable, tell
from smachpy.command.needs import driven_robot, needed_servers
from smachpy.command.targets import names_file
from smachpy.durable.store import store_name
from smachpy.exceptions import MissionError
from smachpy.machines.mission_info import mission_info
from smachpy.userdata.secret import masked_words

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from smachpy.command.targets import Target
    from smachpy.durable.mission import Outage
    from smachpy.durable.store import FencedError, Lease, MissionRow, Store
    from smachpy.machines.container import Container

LEASE_S: Final = 15.0  # [s] default of --lease
EXIT_FENCED: Final = 2
JOURNAL: Final = "./.smachpy/journal.db"


@dataclass(frozen=True, slots=True)
class DurableOptions:
    """The options of a durable run.

    Attributes:
        journal: A path, or a URL of PostgreSQL.
        mission: The mission's id; None finds it by target and robot.
        target: The target of `smachpy run`; for a file its absolute path.
        argv: The mission's own arguments.
        robot: The robot that it uses, or None.
        outage: Whether deadlines continue during an outage.
        max_outage: The largest age of the journal [s]; None: as the mission declares.
        lease_s: How long a silent process holds the mission [s].
        migrate: Old path -> new path.
        reserved: The runner that has reserved the mission for this process, "host:pid", and the
            fence of its lease; None if none has.
    """

    journal: str
    mission: str | None
    target: str
    argv: tuple[str, ...]
    robot: str | None
    outage: Outage
    max_outage: float | None
    lease_s: float
    migrate: dict[str, str]
    reserved: tuple[str, int] | None = None


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add `--durable` and its companions."""
    group = parser.add_argument_group("a mission that survives (docs/durable_missions.md)")
    group.add_argument(
        "--durable",
        nargs="?",
        const=JOURNAL,
        metavar="JOURNAL",
        help=f"store it in a file (default: {JOURNAL}) or at postgresql://HOST/DATABASE; continue "
        "it if it has begun",
    )
    group.add_argument("--mission", metavar="ID", help="the mission's id, if it needs a name")
    group.add_argument(
        "--outage",
        choices=("counts", "pauses"),
        default="counts",
        help="whether timeouts continue while no process runs it (default: %(default)s)",
    )
    group.add_argument(
        "--max-outage",
        type=seconds,
        metavar="S",
        help="refuse a journal that is older [s] (default: as the mission declares)",
    )
    group.add_argument(
        "--lease",
        type=seconds,
        default=LEASE_S,
        metavar="S",
        help="in a database: after this long without a sign of this process another one may take "
        "over the mission [s] (default: %(default)g)",
    )
    group.add_argument(
        "--migrate",
        action="append",
        default=[],
        type=_pair,
        metavar="OLD=NEW",
        help="a state's new path, if it changed since the mission began",
    )
    # From a runner, see `Store.reserve`.
    group.add_argument("--reserved", type=_reserved, help=argparse.SUPPRESS)


def durable_options(args: argparse.Namespace) -> DurableOptions | None:
    """Return the options; None without `--durable`.

    Raises:
        MissionError: a companion option was given without it, or time is virtual.
    """
    if args.durable is None:
        given = [
            name
            for name, is_given in (
                ("--mission", args.mission is not None),
                ("--outage", args.outage != "counts"),
                ("--max-outage", args.max_outage is not None),
                ("--lease", args.lease != LEASE_S),
                ("--migrate", bool(args.migrate)),
            )
            if is_given
        ]
        if given:
            raise MissionError(f"{given[0]}: got no --durable beside it; expected both.")
        return None
    if args.time.virtual:
        raise MissionError(
            f"--durable: got --time {args.time} beside it; expected real time, in which there are "
            "outages."
        )
    return DurableOptions(
        journal=args.durable,
        mission=args.mission,
        target=whole_target(args.target),
        argv=words_of(args),
        robot=clean_namespace(args.robot) or None,
        outage=args.outage,
        max_outage=args.max_outage,
        lease_s=args.lease,
        migrate=dict(args.migrate),
        reserved=args.reserved,
    )


def robot_name(given: str) -> str:
    """Check the name of a robot and return it; "r1/" is "r1".

    Raises:
        InvalidNameError: it is no name.
    """
    return check_name(given.rstrip("/") or given, "robot name")


def whole_target(text: str) -> str:
    """Return a mission's target; for a file with its absolute path."""
    place, colon, attribute = text.partition(":")
    return f"{Path(place).resolve()}{colon}{attribute}" if names_file(place) else text


def words_of(args: argparse.Namespace) -> tuple[str, ...]:
    """Return the part of a command line that is for the mission."""
    inputs = [word for key, text in args.input for word in ("--input", f"{key}={text}")]
    words = ["--", *args.words] if args.words else []
    return (*inputs, *words)


def _leave(error: FencedError) -> None:
    """End the process at once: a preempt would cancel goals that another process follows now."""
    tell("smachpy", str(error))
    sys.stdout.flush()
    os._exit(EXIT_FENCED)


@contextlib.contextmanager
def journalled(
    target: Target,
    machine: Container,
    options: DurableOptions | None,
    close: Iterable[Callable[[], object]] = (),
) -> Iterator[None]:
    """Write the run of `machine` to its journal within the block, or continue one.

    Args:
        target: The mission.
        machine: Its machine.
        options: The journal; None writes nothing.
        close: Called before the process ends because the mission was suspended: they restore the
            terminal and complete files.

    Raises:
        SmachError: as `smachpy.run_durable` does.
    """
    if options is None:
        yield
        return
    from smachpy.durable.mission import kept_mission
    from smachpy.durable.opening import open_store
    from smachpy.durable.store import Lease

    info = mission_info(target.thing)
    limit = info.max_outage if options.max_outage is None else options.max_outage
    # Give up before the lease runs out: this process must have stopped before another one may
    # take over (`open_store`).
    patience = min(8.0, options.lease_s / 2)
    with (
        contextlib.closing(open_store(options.journal, patience=patience)) as store,
        contextlib.ExitStack() as stack,
    ):
        row, begun = find_or_start(store, machine, options)
        if begun is not None:
            stack.callback(_forget_if_queued, store, row.id)
        verb = "begins" if row.status == "queued" else "is resumed"

        def tell_suspended(by: str) -> None:
            for each in close:
                each()
            id_ = row.id
            text = (
                f"mission {id_}: suspended by {by}; its goals run on. It goes on at the next start"
            )
            tell("smachpy", f"{text}; 'smachpy missions cancel {id_}' ends it.")

        migrate: Any = options.migrate or info.migrations
        with kept_mission(
            machine,
            store,
            row.id,
            outage=options.outage,
            max_outage=limit,
            migrate=migrate,
            lease_s=options.lease_s,
            reserved=options.reserved and Lease(row.id, options.reserved[1], options.reserved[0]),
            started=None if begun is None else (row, begun),
            on_fenced=_leave,
            on_suspended=tell_suspended,
        ):
            where = store_name(options.journal)
            print(printable(f"mission {row.id} {verb}; journal: {where}"), file=sys.stderr)
            yield


def _forget_if_queued(store: Store, mission: str) -> None:
    """Forget a mission that this process could not begin: a runner would do so, hours later."""
    with contextlib.suppress(MissionError):
        if store.mission(mission).status == "queued":
            store.forget(mission)


def find_or_start(
    store: Store, machine: Container, options: DurableOptions
) -> tuple[MissionRow, Lease | None]:
    """Return the mission to continue, or a new one and the lease with which it was started.

    Raises:
        MissionError: the mission that has begun has other arguments.
        MissionInUseError: another mission uses the robot of the new one, which is not added.
    """
    from actionlib_core.node import get_node
    from smachpy.durable.mission import new_mission
    from smachpy.durable.processes import this_runner
    from smachpy.durable.store import OVER
    from smachpy.events.introspection import describe

    if options.mission is not None:
        # A mission that is reserved for this process and was deleted since must not begin.
        known = store.mission(options.mission) if options.reserved else store.find(options.mission)
        if known is not None and known.status in OVER:
            how = f"{known.status}: {known.outcome}" if known.outcome else known.status
            raise MissionError(
                f"{store_name(options.journal)}: mission {known.id!r} has {how}; expected one that "
                "goes on, or a new id. Try another --mission, or none, which begins a new mission."
            )
        alike = [] if known is None else [known]
    else:
        rows = store.missions(open_only=True, target=options.target)
        alike = [row for row in rows if row.robot == options.robot]
    alike = [row for row in alike if row.every is None]
    same = [row for row in alike if row.argv == options.argv]
    if same:
        return same[-1], None
    if alike:
        row = alike[-1]
        raise MissionError(
            f"{options.target}: arguments: got {masked_words(options.argv)}, but mission "
            f"{row.id!r} has begun with {masked_words(row.argv)}; expected the same. Try 'smachpy "
            f"missions resume {row.id}', 'smachpy missions forget {row.id}', or --mission NAME for "
            "another one."
        )
    row = new_mission(
        machine,
        mission=options.mission,
        target=options.target,
        argv=options.argv,
        robot=options.robot,
    )
    actions = needed_servers(describe(machine))
    names = [get_node().resolve(name, "action name") for name in actions]
    row = replace(row, drives=driven_robot(names, options.robot))
    # At once: a runner must not begin it in between.
    started = store.start(row, this_runner(), seconds=options.lease_s)
    return started or (store.create(row), None)  # another process has the id by now: an error


def _reserved(text: str) -> tuple[str, int]:
    runner, _, fence = text.rpartition(":")
    if ":" not in runner or not fence.isdecimal():
        raise argparse.ArgumentTypeError(f"got {text!r}; expected HOST:PID:FENCE")
    return runner, int(fence)


def _pair(text: str) -> tuple[str, str]:
    old, equals, new = text.partition("=")
    if not (equals and old.startswith("/") and new.startswith("/")):
        raise argparse.ArgumentTypeError(f"got {text!r}; expected /OLD/PATH=/NEW/PATH")
    return old, new
