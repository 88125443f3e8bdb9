"""`smachpy runs`: what recorded runs say."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.output import printable
from smachpy.command import UsageError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable, Iterator

    from rich.console import Console

    from smachpy.events.recording import Recording
    from smachpy.introspection import StateRecord
    from viz.runs.compare import Side
    from viz.runs.report import Runs
    from viz.runs.statistics import Statistics

EXAMPLES = """examples:
  smachpy run patrol --record runs/1.jsonl    record a run
  smachpy runs list runs/                     what there is
  smachpy runs show runs/1.jsonl              what happened in it
  smachpy runs show runs/                     what all of them add up to
  smachpy runs why runs/1.jsonl               why it ended so, from the first cause on
  smachpy runs compare old.jsonl new.jsonl    two runs, or two versions of a machine
  smachpy runs compare old.json my_robot.missions:deliver -o diff.svg    the same as a picture
  smachpy runs export runs/1.jsonl -o 1.html  a page that opens without a server
  smachpy runs export runs/1.jsonl -o 1.mcap  for Foxglove
  smachpy runs export runs/ -o report.html    one report of many runs
  smachpy view runs/1.jsonl                   see it again in the browser
"""
MOST_PROBLEMS = 20


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    import argparse

    parser = subparsers.add_parser(
        "runs",
        help="list, show, compare and export recorded runs",
        description="Work with the files of `smachpy run --record`.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    one = actions.add_parser("list", help="one line per run")
    one.add_argument("places", nargs="*", default=["."], metavar="FILE|DIR")
    one.add_argument("--json", action="store_true", help="for programs: an object a line")
    one.set_defaults(run=_list)
    show = actions.add_parser("show", help="states, times and transitions of one run or many")
    show.add_argument("places", nargs="+", metavar="FILE|DIR")
    show.add_argument("--json", action="store_true", help="for programs: an object a line")
    show.set_defaults(run=_show)
    because = actions.add_parser(
        "why", help="why the newest run in a file ended so, cause by cause"
    )
    because.add_argument("file", metavar="FILE")
    because.add_argument("--json", action="store_true", help="the same for programs")
    because.set_defaults(run=_why)
    two = actions.add_parser("compare", help="how the second differs from the first")
    what = "recordings, or a machine: a mission's name, module:factory, path.py, a record .json"
    two.add_argument("first", metavar="FILE|DIR|TARGET", help=what)
    two.add_argument("second", metavar="FILE|DIR|TARGET", help="the same")
    two.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="draw both into one picture: svg, png, pdf or dot; - is svg",
    )
    two.add_argument("--theme", choices=("light", "dark"), default="light")
    two.add_argument("--depth", type=int, metavar="N", help="container levels to open")
    two.set_defaults(run=_compare)
    export = actions.add_parser("export", help="as a page (.html), for Foxglove (.mcap), a picture")
    export.add_argument("file", metavar="FILE|DIR", help="a run, or many for one report (.html)")
    export.add_argument(
        "-o",
        "--output",
        required=True,
        metavar="FILE",
        help="the ending names the format: html, mcap, or that of a picture",
    )
    export.add_argument(
        "--runs", metavar="DIR", action="append", default=[], help="runs for the page's statistics"
    )
    export.add_argument(
        "--map",
        type=Path,
        metavar="FILE",
        help="the page's floor, a map_server YAML file, where the recording has none",
    )
    export.set_defaults(run=_export)


def _list(args: argparse.Namespace) -> int:
    from rich.table import Table
    from rich.text import Text

    from smachpy.events.recording import each_recording

    if args.json:
        for recording in each_recording(args.places):
            print(json.dumps(_facts(recording)))
        return 0
    table = Table(box=None, pad_edge=False)
    for title in ("file", "machine", "began", "time", "outcome", "outages", "events"):
        table.add_column(title, no_wrap=True, justify="right" if title == "events" else "left")
    for recording in each_recording(args.places):
        table.add_row(*(Text(printable(word)) for word in _line(recording)))
    console().print(table)
    return 0


def _facts(recording: Recording) -> dict[str, Any]:
    """What a list says of a run; `outcome` is null when none is recorded, `outages` are in ns."""
    from smachpy.events.run_state import RunState

    events = recording.events
    newest = RunState()
    for event in events:
        newest.fold(event)
    return {
        "file": str(recording.path),
        "machine": recording.record.label,
        "began_ns": recording.made_ns,
        "seconds": (events[-1]["stamp_ns"] - events[0]["stamp_ns"]) / 1e9 if events else 0.0,
        "outcome": newest.data["outcome"],
        "outages": newest.data.get("outages", []),
        "events": len(events),
        "missing": recording.dropped,
    }


def _line(recording: Recording) -> tuple[str, ...]:
    from datetime import UTC, datetime

    from smachpy.events import outages_text

    facts = _facts(recording)
    began = datetime.fromtimestamp(facts["began_ns"] / 1e9, UTC)
    events, missing = facts["events"], facts["missing"]
    return (
        facts["file"],
        facts["machine"],
        began.strftime("%Y-%m-%d %H:%M:%S"),
        f"{facts['seconds']:.1f} s",
        facts["outcome"] or "not finished",
        outages_text(facts["outages"]),
        f"{events} of {events + missing}" if missing else str(events),
    )


def _each(places: Iterable[str]) -> Iterator[Recording]:
    """Yield the recordings of places, each of which must have some."""
    from smachpy.events.recording import each_recording

    for place in places:
        empty = True
        for recording in each_recording([place]):
            empty = False
            yield recording
        if empty:
            raise UsageError(f"smachpy runs: {place!r}: got no recordings; expected *.jsonl files.")


def _show(args: argparse.Namespace) -> int:
    from viz.runs.statistics import count_by_machine, never_taken

    counted = count_by_machine(_each(args.places))
    if args.json:
        for label, (record, statistics, lost) in counted.items():
            told = {
                "machine": label,
                "runs": statistics.runs,
                "outcomes": statistics.outcomes,
                "missing": lost,
                "states": {path: one.to_json() for path, one in statistics.states.items()},
                "never_taken": never_taken(record, statistics),
            }
            print(json.dumps(told))
        return 0
    out = console()
    for record, statistics, lost in counted.values():
        print_statistics(out, record, statistics, lost)
    return 0


def print_statistics(out: Console, record: StateRecord, statistics: Statistics, lost: int) -> None:
    """Print what the runs of a machine add up to; `lost` events are missing in them."""
    from rich.table import Table
    from rich.text import Text

    from viz.runs.statistics import never_taken

    ended = ", ".join(f"{outcome} x{n}" for outcome, n in statistics.outcomes.items())
    out.print(
        printable(f"{record.label}: {statistics.runs} run(s); {ended or 'none has ended'}"),
        markup=False,
    )
    if lost:
        out.print(f"{lost} events are missing: visits and outcomes are at least these")
    table = Table(box=None, pad_edge=False)
    for title in ("state", "visits", "median", "95 %", "failed", "retried", "outcomes"):
        table.add_column(title, justify="left" if title in {"state", "outcomes"} else "right")
    for state in record.walk():
        if state.path in statistics.states:
            row = _row(state.path, statistics.states[state.path].to_json())
            table.add_row(*(Text(printable(word)) for word in row))
    out.print(table)
    untaken = never_taken(record, statistics)
    if untaken:
        out.print(f"never taken: {len(untaken)} transition(s)")
        for path, outcome in untaken[:MOST_PROBLEMS]:
            out.print(printable(f"  {path}  {outcome}"), markup=False)


def _row(path: str, numbers: dict[str, Any]) -> tuple[str, ...]:
    return (
        path,
        str(numbers["visits"]),
        _seconds(numbers["median"]),
        _seconds(numbers["p95"]),
        f"{numbers['failures']:.0%}",
        str(numbers["retries"] or ""),
        " ".join(f"{outcome} x{n}" for outcome, n in numbers["outcomes"].items()),
    )


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.3f} s"


def _why(args: argparse.Namespace) -> int:
    from smachpy.events.recording import read_recording
    from viz.model.why import why

    recording = read_recording(args.file)
    found = why(recording.record, recording.events)
    if args.json:
        print(json.dumps(found.to_json()))
        return 0
    for line in found.text().splitlines():  # a line each, however wide the terminal is
        print(printable(line))
    return 0


def _compare(args: argparse.Namespace) -> int:

    old, new = _side(args.first), _side(args.second)
    if args.output:
        _draw_both(args, old, new)
        return 0
    _print_union(old, new)
    return 0


def _print_union(old: Side, new: Side) -> None:
    from viz.runs.compare import unite

    signs = {"added": "+", "removed": "-", "changed": "~", "numbers": " "}
    lines = [
        f"{signs[one['change']]} {one['path']}  {one['text']}".rstrip()
        for one in unite(old, new).listed()
    ]
    console().print(printable("\n".join(lines or ["no notable difference"])), markup=False)


def print_differences(before: Runs, now: Runs) -> None:
    """Print how runs differ from earlier ones."""
    from viz.runs.compare import Side

    print("compared with earlier runs:")
    _print_union(
        Side("before", before.record, before.statistics), Side("now", now.record, now.statistics)
    )


def _draw_both(args: argparse.Namespace, old: Side, new: Side) -> None:
    import sys

    from viz.pictures import drawing
    from viz.runs.compare import drawing as drawn
    from viz.runs.compare import unite

    form = "svg" if args.output == "-" else Path(args.output).suffix.lstrip(".").lower()
    diagram = drawn(unite(old, new), old, new, depth=args.depth)
    content = drawing.draw(diagram, form, theme=args.theme)
    if args.output == "-":
        sys.stdout.buffer.write(content)
    else:
        print(drawing.write(content, args.output))


def _side(place: str) -> Side:
    """What is to be compared: recordings, or a machine that has not run."""
    from viz.runs.compare import Side
    from viz.runs.statistics import count_by_machine

    if not place.endswith(".jsonl") and not Path(place).is_dir():
        from viz.cli import read_record

        return Side(place, read_record(place))
    counted = count_by_machine(_each([place]))
    if len(counted) > 1:
        raise UsageError(
            f"smachpy runs compare: {place!r}: got runs of {sorted(counted)}; expected those of "
            "one machine. Try naming the files."
        )
    [(record, statistics, _)] = counted.values()
    return Side(place, record, statistics)


def _export(args: argparse.Namespace) -> int:
    from smachpy.events.recording import read_recording

    if Path(args.file).is_dir():
        return _export_all(args.file, Path(args.output))
    recording = read_recording(args.file)
    output = Path(args.output)
    try:
        _write(recording, output, args.runs, args.map)
    except OSError as error:
        raise UsageError(
            f"smachpy runs export: {args.output!r}: cannot write: {error.strerror or error}."
        ) from error
    print(output)
    return 0


def _export_all(folder: str, output: Path) -> int:
    """One report of all runs in a folder."""
    from viz.pictures.drawing import write
    from viz.runs.report import report

    if output.suffix != ".html":
        raise UsageError(
            f"smachpy runs export: {str(output)!r}: got {output.suffix or 'no ending'} for a "
            f"folder of runs; expected .html, or one recording. Try -o {output.stem}.html"
        )
    print(write(report(collect_one(folder, "export")).encode("utf-8", "replace"), output))
    return 0


def collect_one(place: str, command: str) -> Runs:
    """Return the runs in a folder or file, of one machine.

    Raises:
        UsageError: they are of several, or there are none.
    """
    from viz.runs.report import collect

    found = collect(_each([place]))
    if len(found) > 1:
        raise UsageError(
            f"smachpy runs {command}: {place!r}: got runs of {sorted(found)}; expected those of "
            "one machine. Try a folder for each."
        )
    [runs] = found.values()
    return runs


def _write(recording: Recording, output: Path, runs: list[str], floor: Path | None) -> None:
    if output.suffix == ".html":
        from viz.runs.html import standalone_page

        page = standalone_page(recording, runs, floor)
        output.write_text(page, encoding="utf-8", errors="replace")
    elif output.suffix == ".mcap":
        from viz.runs.mcap import write_mcap

        write_mcap(recording, output)
    else:
        from smachpy.events import from_record
        from viz.model.history import History
        from viz.pictures.drawing import render

        history = History()
        for event in recording.events:
            history.on_event(from_record(event))
        render(recording.record, output, run=history)


def console() -> Console:
    """Where to print: as wide as the terminal, 160 columns to a file."""
    import sys

    from rich.console import Console

    wide = None if sys.stdout.isatty() else 160
    return Console(highlight=False, width=wide)
