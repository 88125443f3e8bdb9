"""`smachpy missions`: the missions of a journal, and what a person does with them."""

from __future__ import annotations

import contextlib
import json
import os
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from actionlib_core.output import printable
from smachpy.command.durable import JOURNAL, store_name

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from smachpy.durable.position import Position
    from smachpy.durable.store import MissionRow, Store


_PASSED_ON = (
    ("plain", "lines only, for logs"),
    ("view", "show it in a browser while it runs, and after"),
    ("control", "let viewers pause, step, jump and preempt"),
)
"""Options of `smachpy run` that `resume` has too, and their meaning."""


def register(subparsers: Any) -> None:
    """Add `smachpy missions`."""
    parser = subparsers.add_parser(
        "missions",
        help="list, show, resume, cancel and forget durable missions",
        description="What `smachpy run --durable` keeps. Exit codes: 0 it was done, 2 bad input; "
        "resume: those of `smachpy run`.",
    )
    commands = parser.add_subparsers(metavar="WHAT", required=True, dest="what")
    for name, run, text in (
        ("list", _list, "all missions and where they stand"),
        ("show", _show, "one mission: its active states, values, goals and outages"),
        ("resume", _resume, "go on with a mission, however old its journal is"),
        ("cancel", _cancel, "preempt a mission, now or when it goes on"),
        ("forget", _forget, "delete a mission with its journal"),
    ):
        command = commands.add_parser(name, help=text, description=text)
        if name != "list":
            command.add_argument("mission", metavar="ID", help="as 'smachpy missions list' has it")
        command.add_argument(
            "--durable",
            default=JOURNAL,
            metavar="JOURNAL",
            help="the file, or postgresql://HOST/DATABASE (default: %(default)s)",
        )
        if name in {"list", "show"}:
            command.add_argument("--json", action="store_true", help="as JSON")
        if name == "resume":
            for option, meaning in _PASSED_ON:
                command.add_argument(f"--{option}", action="store_true", help=meaning)
        command.set_defaults(act=run)
    parser.set_defaults(run=_run)


def _run(args: argparse.Namespace) -> int:
    act: Callable[[argparse.Namespace], int] = args.act
    return act(args)


def _open(args: argparse.Namespace) -> Any:
    from smachpy.durable.store import open_store

    return contextlib.closing(open_store(args.durable, create=False))


def _list(args: argparse.Namespace) -> int:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text as Cell

    with _open(args) as store:
        rows = store.missions()
        stands = {row.id: _active(store, row.id) for row in rows}
    if args.json:
        print(json.dumps([{**_facts(row), "active": stands[row.id]} for row in rows]))
        return 0
    if not rows:
        print(f"no missions in {store_name(args.durable)}")
        return 0
    table = Table(box=None, pad_edge=False)
    for title in ("mission", "status", "outcome", "robot", "changed", "active"):
        table.add_column(title)
    for row in rows:
        cells = (
            row.id,
            _status(row),
            row.outcome or "",
            row.robot or "",
            _time(row.changed),
            ", ".join(stands[row.id]),
        )
        table.add_row(*(Cell(printable(cell)) for cell in cells))
    Console(highlight=False, soft_wrap=True).print(table)
    return 0


def _active(store: Store, mission: str) -> list[str]:
    """Return the active states; of a journal that cannot be read, why."""
    from smachpy.durable.journal import read_position
    from smachpy.durable.store import StoreError

    try:
        return read_position(store, mission).leaves()
    except StoreError as error:
        return [f"({error.reason})"]


def _show(args: argparse.Namespace) -> int:
    from smachpy.durable.journal import read_position

    with _open(args) as store:
        row = store.mission(args.mission)
        position = read_position(store, row.id)
    if args.json:
        print(json.dumps({**_facts(row), "position": position.data}))
        return 0
    for line in _lines(row, position):
        print(printable(line))
    return 0


def _lines(row: MissionRow, position: Position) -> list[str]:
    data = position.data
    lines = [
        f"mission   {row.id}",
        f"runs      {' '.join((row.target, *row.argv))}",
        f"status    {_status(row)}{f', {row.outcome}' if row.outcome else ''}",
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
            f"userdata  {container} {key} = {json.dumps(value)[:200]}"
            for key, value in values.items()
        ]
    lines += [f"asked     {one['path']}: {one['source']} {one['by']}" for one in data["preempts"]]
    lines += [
        f"outage    {_time(begin / 1e9)}, {(end - begin) / 1e9:.1f} s"
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
    robot = ["--robot", row.robot] if row.robot else []
    own = ["--durable", args.durable, "--mission", row.id, "--max-outage", "1e12"]
    options = [f"--{option}" for option, _ in _PASSED_ON if getattr(args, option)]
    return main(["run", row.target, *own, *robot, *options, *row.argv])


def _cancel(args: argparse.Namespace) -> int:
    with _open(args) as store:
        store.request_cancel(args.mission)
        row = store.mission(args.mission)
    how = "now" if row.status in {"running", "cancelled"} else "when it goes on"
    print(f"mission {row.id}: will be preempted {how}; status: {_status(row)}")
    return 0


def _forget(args: argparse.Namespace) -> int:
    with _open(args) as store:
        store.forget(args.mission)
    print(f"mission {args.mission}: forgotten")
    return 0


def _status(row: MissionRow) -> str:
    """Return the status; one whose process was killed still says "running" in the store."""
    from smachpy.durable.processes import this_runner
    from smachpy.durable.store import host_and_pid

    if row.status == "running" and row.owner:
        host, pid = host_and_pid(row.owner)
        if host == host_and_pid(this_runner())[0] and not _lives(pid):
            return "interrupted"
    return row.status


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _facts(row: MissionRow) -> dict[str, Any]:
    facts = {name: getattr(row, name) for name in _SHOWN}
    return {**facts, "status": _status(row)}


_SHOWN = ("id", "name", "target", "argv", "outcome", "robot", "created", "changed", "owner")


def _time(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, tz=UTC).astimezone().isoformat(" ", "seconds")
