"""`smachpy missions`: lists, shows, resumes, cancels, forgets and prunes missions of a journal."""

from __future__ import annotations

import contextlib
import json
import sys
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.process.output import printable
from smachpy.command.durable import JOURNAL
from smachpy.command.pruning import add_age, add_page, deleted, is_kept, size_text
from smachpy.command.queued import add_allow, run_words
from smachpy.durable.store import store_name
from smachpy.userdata.secret import masked, masked_words

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from smachpy.durable.position import Position
    from smachpy.durable.store import MissionRow


_RUN_OPTIONS = (
    ("plain", "lines only, for logs"),
    ("view", "show it in a browser while it runs, and after"),
    ("control", "let viewers pause, step, jump and preempt"),
)
"""Options of `smachpy run` that `resume` passes on, with their help."""


def register(subparsers: Any) -> None:
    """Add `smachpy missions`."""
    parser = subparsers.add_parser(
        "missions",
        help="list, show, resume, cancel, forget and prune durable missions",
        description="Missions of `smachpy run --durable`. Exit codes: 0 done, 2 bad input; "
        "resume: those of `smachpy run`.",
    )
    commands = parser.add_subparsers(metavar="WHAT", required=True, dest="what")
    for name, run, text in (
        ("list", _list, "the newest missions and where they stand"),
        ("show", _show, "one mission: its active states, values, goals and outages"),
        ("resume", _resume, "resume a mission, however old its journal is"),
        ("cancel", _cancel, "preempt a mission, now or when it is resumed"),
        ("forget", _forget, "delete a mission with its journal"),
        ("prune", _prune, "delete missions that have been over for some time"),
    ):
        command = commands.add_parser(name, help=text, description=text)
        if name not in {"list", "prune"}:
            command.add_argument(
                "mission", metavar="ID", help="as listed by 'smachpy missions list'"
            )
        command.add_argument(
            "--durable",
            default=JOURNAL,
            metavar="JOURNAL",
            help="the file, or postgresql://HOST/DATABASE (default: %(default)s)",
        )
        if name in {"list", "show"}:
            command.add_argument("--json", action="store_true", help="as JSON")
        if name == "list":
            add_page(command, "missions")
            command.add_argument(
                "--status",
                choices=("queued", "running", "interrupted", "ended", "cancelled"),
                action="append",
                default=[],
                help="only missions of this status (repeatable)",
            )
            command.add_argument("--robot", metavar="NAME", help="only missions of this robot")
        if name == "prune":
            add_age(command, "missions")
        if name == "resume":
            for option, meaning in _RUN_OPTIONS:
                command.add_argument(f"--{option}", action="store_true", help=meaning)
            command.add_argument(
                "--record", type=Path, metavar="FILE", help="where the run is recorded"
            )
            add_allow(command, "the mission may be of this place")
        command.set_defaults(act=run)
    parser.set_defaults(run=_run)


def _run(args: argparse.Namespace) -> int:
    act: Callable[[argparse.Namespace], int] = args.act
    return act(args)


def _open(args: argparse.Namespace) -> Any:
    from smachpy.durable.opening import open_store

    return contextlib.closing(open_store(args.durable, create=False))


def _list(args: argparse.Namespace) -> int:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text as Cell

    from smachpy.durable.overview import overview
    from smachpy.durable.store import INTERRUPTED, QUEUED
    from smachpy.events import outages_text

    with _open(args) as store:
        rows = store.missions(
            statuses=args.status, robot=args.robot, limit=args.limit, skip=args.skip
        )[::-1]
        holders = (
            store.holders() if any(row.status in {QUEUED, INTERRUPTED} for row in rows) else []
        )
        found = [
            {
                **overview(store, row),
                "due": row.due,
                "every": row.every,
                "priority": row.priority,
                "group": row.group,
                "not_after": row.not_after,
                "waits": _reason(row, holders),
            }
            for row in rows
        ]
        total, size = store.size()
    if args.json:
        print(json.dumps(found))
        return 0
    if not found:
        print(printable(f"no missions in {store_name(args.durable)}"))
        return 0
    table = Table(box=None, pad_edge=False)
    for title in ("mission", "status", "outcome", "robot", "changed", "outages", "active"):
        table.add_column(title, overflow="fold")  # never cut: people copy paths and ids
    for one in found:
        stands = [f"({one['problem']})"] if one["problem"] else one["active"]
        cells = (
            one["id"],
            _status(one["status"], one["due"], one["every"]),
            one["outcome"] or "",
            one["robot"] or "",
            _time(one["changed"]),
            outages_text(one["outages"]),
            ", ".join([*stands, *([one["waits"]] if one["waits"] else [])]),
        )
        table.add_row(*(Cell(printable(cell)) for cell in cells))
    wide = None if sys.stdout.isatty() else 160
    Console(highlight=False, width=wide).print(table)
    if len(found) < total:
        print(f"{len(found)} of {total:d} missions, {size_text(size)}; more: --limit N, --skip N")
    return 0


def _reason(row: MissionRow, holders: list[MissionRow]) -> str:
    """Return why a mission waits, as far as the store knows, or ""."""
    from smachpy.durable.store import INTERRUPTED, QUEUED

    if row.status not in {QUEUED, INTERRUPTED} or row.every is not None:
        return ""
    reasons = [
        f"waits: {what} {name!r} is used by mission {other.id}"
        + (", which was interrupted: resume or forget it" if other.status == INTERRUPTED else "")
        for other in holders
        for what, name, used in (
            ("robot", row.held_robot, other.held_robot),
            ("group", row.group, other.group),
        )
        if other.id != row.id and name is not None and name == used
        if row.status == QUEUED or other.status != INTERRUPTED
    ]
    return "; ".join([*reasons, *([row.note] if row.note else [])])


def _status(status: str, due: float | None, every: str | None) -> str:
    """Return a mission's status; if queued, also when it is due and how often."""
    from smachpy.durable.store import QUEUED

    if status != QUEUED:
        return status
    often = f", every {every}" if every else ""
    return status + often + (f", due {_time(due)}" if due is not None else "")


def _show(args: argparse.Namespace) -> int:
    from smachpy.durable.journal import read_position
    from smachpy.durable.overview import overview

    with _open(args) as store:
        row = store.mission(args.mission)
        position = read_position(store, row.id)
        facts = overview(store, row)
        uses = store.resources()
    own = {one.resource for one in uses if one.mission == row.id}
    uses = [one for one in uses if one.resource in own]
    if args.json:
        resources = [asdict(one) for one in uses]
        print(json.dumps({**facts, "resources": resources, "position": masked(position.data)}))
        return 0
    for line in _lines(row, position):
        print(printable(line))
    for one in uses:
        print(printable(f"resource  {one.resource}: {'held by' if one.holds else 'waits:'} {one}"))
    return 0


def _lines(row: MissionRow, position: Position) -> list[str]:
    from smachpy.events import span_text

    data = position.data
    lines = [
        f"mission   {row.id}",
        f"runs      {' '.join((row.target, *masked_words(row.argv)))}",
        f"status    {row.status}{f', {row.outcome}' if row.outcome else ''}",
        f"began     {_time(row.created)}",
        f"changed   {_time(row.changed)}",
    ]
    if row.owner and row.status == "running":
        lines.append(f"process   {row.owner}")
    for path in position.leaves():
        visit = position.visits[path]
        facts = [f"since {_time(visit['since_ns'] / 1e9)}"]
        if visit["attempt"] > 1:
            facts.append(f"attempt {visit['attempt']}")
        goal = visit["goal"]
        if goal is not None:
            taken = "taken" if goal["taken_ns"] else "not taken yet"
            facts.append(f"goal {goal['id']} on {goal['action']}: {goal['status'] or taken}")
        lines.append(f"active    {path}: {', '.join(facts)}")
    for container, values in position.userdata.items():
        lines += [
            f"userdata  {container} {key} = {json.dumps(masked(value, key))[:200]}"
            for key, value in values.items()
        ]
    lines += [f"note      {row.note}"] if row.note else []
    lines += [f"asked     {one['path']}: {one['source']} {one['by']}" for one in data["preempts"]]
    lines += [
        f"outage    {_time(begin / 1e9)}, {span_text((end - begin) / 1e9)}"
        for begin, end in data["outages"]
    ]
    return lines


def _resume(args: argparse.Namespace) -> int:
    from smachpy.command import main
    from smachpy.durable.store import OVER, MissionOverError

    with _open(args) as store:
        row: MissionRow = store.mission(args.mission)
        if row.status in OVER:
            raise MissionOverError(store_name(args.durable), row.id, row.status)
    # No limit for the age: whoever resumes by hand has looked at it.
    own = [*run_words(args.durable, row.id, args.allow), "--max-outage", "1e12"]
    options = [f"--{option}" for option, _ in _RUN_OPTIONS if getattr(args, option)]
    options += [] if args.record is None else ["--record", str(args.record)]
    return main([*own, *options])


def _cancel(args: argparse.Namespace) -> int:
    with _open(args) as store:
        store.request_cancel(args.mission)
        row = store.mission(args.mission)
    how = "now" if row.status == "running" else "when it is resumed"
    told = "" if row.status == "cancelled" else f"will be preempted {how}; status: "
    print(printable(f"mission {row.id}: {told}{row.status}"))
    return 0


def _forget(args: argparse.Namespace) -> int:
    with _open(args) as store:
        store.forget(args.mission)
    print(printable(f"mission {args.mission}: forgotten"))
    return 0


def _prune(args: argparse.Namespace) -> int:
    from smachpy.durable.structure import success_of

    with _open(args) as store:
        before = store.size()[1]
        gone = store.prune(
            args.older_than,
            keep=lambda row: is_kept(args.keep, row.outcome, row.status, success_of(row)),
        )
        total, size = store.size()
    freed = size_text(max(0, before - size))
    left = f"{total} {'mission is' if total == 1 else 'missions are'} left, {size_text(size)}"
    print(printable(f"{deleted(gone)}, {freed} freed; {left}"))
    return 0


def _time(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, tz=UTC).astimezone().isoformat(" ", "seconds")
