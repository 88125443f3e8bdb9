"""`smachpy runs`: lists, shows, compares and exports recorded runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.process.output import printable, tell
from smachpy.command import UsageError
from smachpy.command.pruning import add_age, add_page
from smachpy_viz.runs import reproduce_cli

# Most imports are inside functions: every `smachpy` command loads this module for its options.
if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable, Iterator

    from rich.console import Console

    from smachpy.events.introspection import StateRecord
    from smachpy.events.recording import Recording, Summary
    from smachpy_viz.runs.compare import ComparedRun
    from smachpy_viz.runs.report import MachineRuns
    from smachpy_viz.runs.statistics import Statistics

EXAMPLES = """examples:
  smachpy run patrol --record runs/1.jsonl    record a run
  smachpy runs list runs/                     list the runs in a folder
  smachpy runs show runs/1.jsonl              states, times and transitions of a run
  smachpy runs show runs/                     the same over all runs in a folder
  smachpy runs why runs/1.jsonl               the causes of its end, from the first one on
  smachpy runs compare old.jsonl new.jsonl    two runs, or two versions of a machine
  smachpy runs compare old.json my_robot.missions:deliver -o diff.svg    draw the differences
  smachpy runs reproduce runs/1.jsonl         run it again: is it the same with today's code?
  smachpy runs export runs/1.jsonl -o 1.html  a page that opens without a server
  smachpy runs export runs/1.jsonl -o 1.mcap  for Foxglove
  smachpy runs export runs/ -o report.html    one report of many runs
  smachpy view runs/1.jsonl                   replay it in the browser
"""
COLUMN_GAP = 2
MAX_UNTAKEN_TRANSITIONS = 20
"""Transitions that no run has taken, in the output."""


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
    # One subcommand after the other; `run` is the function that carries it out.
    one = actions.add_parser("list", help="one line per run")
    one.add_argument("places", nargs="*", default=["."], metavar="FILE|DIR")
    one.add_argument("--json", action="store_true", help="one JSON object per line, for programs")
    add_page(one, "runs")
    one.set_defaults(run=_list)
    prune = actions.add_parser("prune", help="delete old recordings")
    prune.add_argument("places", nargs="+", metavar="FILE|DIR")
    add_age(prune, "recordings")
    prune.set_defaults(run=_prune)
    show = actions.add_parser("show", help="states, times and transitions of one run or many")
    show.add_argument("places", nargs="+", metavar="FILE|DIR")
    show.add_argument("--json", action="store_true", help="one JSON object per line, for programs")
    show.set_defaults(run=_show)
    because = actions.add_parser("why", help="the causes of the end of the newest run in a file")
    because.add_argument("file", metavar="FILE")
    because.add_argument("--json", action="store_true", help="as JSON, for programs")
    because.set_defaults(run=_why)
    two = actions.add_parser("compare", help="the differences between two runs or two machines")
    what = "recordings, or a machine: a mission's name, module:factory, path.py, a record .json"
    two.add_argument("first", metavar="FILE|DIR|TARGET", help=what)
    two.add_argument("second", metavar="FILE|DIR|TARGET", help="the same")
    two.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="draw both in one picture: svg, png, pdf or dot; - writes svg to standard output",
    )
    two.add_argument("--theme", choices=("light", "dark"), default="light")
    two.add_argument("--depth", type=int, metavar="N", help="container levels to open")
    two.set_defaults(run=_compare)
    reproduce_cli.add(actions)
    export = actions.add_parser(
        "export", help="write a page (.html), a Foxglove file (.mcap) or a picture"
    )
    export.add_argument(
        "file", metavar="FILE|DIR", help="a run, or a folder of runs for one report (.html)"
    )
    export.add_argument(
        "-o",
        "--output",
        required=True,
        metavar="FILE",
        help="its extension chooses the format: html, mcap, or that of a picture",
    )
    export.add_argument(
        "--runs", metavar="DIR", action="append", default=[], help="runs for the page's statistics"
    )
    export.add_argument(
        "--map",
        type=Path,
        metavar="FILE",
        help="a map_server YAML file for the page, if the recording has no map",
    )
    export.set_defaults(run=_export)


def _list(args: argparse.Namespace) -> int:
    from rich.cells import cell_len
    from rich.table import Table
    from rich.text import Text

    from smachpy.events.recording import summaries

    found, total = summaries(args.places, limit=args.limit, skip=args.skip)
    if args.json:
        for one in found:
            print(json.dumps(_facts(one)))
        return 0
    titles = ("file", "machine", "began", "time", "outcome", "outages", "events")
    rows = [_line(one) for one in found]
    out = console()
    widths = [max(map(cell_len, column)) for column in zip(titles, *rows, strict=True)]
    if sum(widths) + COLUMN_GAP * (len(widths) - 1) > out.width:
        # A table would cut the outcomes away: the facts stand below the name instead.
        for file, *facts, outages, events in rows:
            more = [*([f"{outages} outages"] if outages else []), f"{events} events"]
            out.print(file, markup=False, soft_wrap=True)
            out.print(f"  {'  '.join([*facts, *more])}", markup=False, soft_wrap=True)
        _print_more(out, len(rows), total)
        return 0
    table = Table(box=None, pad_edge=False)
    for title in titles:
        table.add_column(title, no_wrap=True, justify="right" if title == "events" else "left")
    for row in rows:  # as Text, because rich would read "[...]" in a name as markup
        table.add_row(*(Text(printable(word)) for word in row))
    out.print(table)
    _print_more(out, len(rows), total)
    return 0


def _print_more(out: Console, listed: int, total: int) -> None:
    if listed < total:
        out.print(f"{listed} of {total} files; more: --limit N, --skip N", markup=False)


def _prune(args: argparse.Namespace) -> int:
    from functools import partial

    from smachpy.command.pruning import size_text
    from smachpy_viz.runs.pruning import prune_recordings

    problems = partial(tell, "smachpy runs")
    gone = prune_recordings(args.places, args.older_than, args.keep, problems)
    print(f"{gone.number:d} recordings deleted, {size_text(gone.size)} freed")
    return 0


def _facts(one: Summary) -> dict[str, Any]:
    """The facts for `runs list`; `outcome` is None if none is recorded, `outages` are in ns."""
    return {
        "file": str(one.path),
        "machine": one.machine,
        "began_ns": one.made_ns,
        "seconds": (one.last_ns - one.first_ns) / 1e9,
        "outcome": one.outcome,
        "outages": one.outages,
        "events": one.events,
        "missing": one.missing,
    }


def _line(one: Summary) -> tuple[str, ...]:
    from datetime import UTC, datetime

    from smachpy.events import outages_text

    facts = _facts(one)
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


def _each(places: Iterable[str], *, stream: bool = False) -> Iterator[Recording]:
    """Yield the recordings in files and folders; each place must have at least one."""
    from smachpy.events.recording import each_recording

    for place in places:
        empty = True
        for recording in each_recording([place], stream=stream):
            empty = False
            yield recording
        if empty:
            raise UsageError(f"smachpy runs: {place!r}: got no recordings; expected *.jsonl files.")


def _show(args: argparse.Namespace) -> int:
    from smachpy_viz.runs.statistics import count_by_machine, never_taken

    counted = count_by_machine(_each(args.places, stream=True))
    if args.json:
        for label, (record, statistics, lost) in counted.items():
            facts = {
                "machine": label,
                "runs": statistics.runs,
                "outcomes": statistics.outcomes,
                "missing": lost,
                "states": {path: one.to_json() for path, one in statistics.states.items()},
                "never_taken": never_taken(record, statistics),
            }
            print(json.dumps(facts))
        return 0
    out = console()
    for record, statistics, lost in counted.values():
        print_statistics(out, record, statistics, lost)
    return 0


def print_statistics(out: Console, record: StateRecord, statistics: Statistics, lost: int) -> None:
    """Print the statistics of a machine's runs, in which `lost` events are missing."""
    from rich.table import Table
    from rich.text import Text

    from smachpy_viz.runs.statistics import never_taken

    ended = ", ".join(f"{outcome} x{n}" for outcome, n in statistics.outcomes.items())
    out.print(
        printable(f"{record.label}: {statistics.runs} run(s); {ended or 'none has ended'}"),
        markup=False,
    )
    if lost:
        out.print(f"{lost} events are missing: the true numbers may be higher")
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
        for path, outcome in untaken[:MAX_UNTAKEN_TRANSITIONS]:
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
    from smachpy_viz.model.why import why

    recording = read_recording(args.file, stream=True)
    found = why(recording.record, recording.events)
    if args.json:
        print(json.dumps(found.to_json()))
        return 0
    for line in found.text().splitlines():  # `print`, because rich would wrap long lines
        print(printable(line))
    return 0


def _compare(args: argparse.Namespace) -> int:
    old, new = _side(args.first), _side(args.second)
    if args.output:
        _draw_both(args, old, new)
        return 0
    _print_union(old, new)
    return 0


def _print_union(old: ComparedRun, new: ComparedRun) -> None:
    from smachpy_viz.runs.compare import unite

    signs = {"added": "+", "removed": "-", "changed": "~", "numbers": " "}
    lines = [
        f"{signs[one['change']]} {one['path']}  {one['text']}".rstrip()
        for one in unite(old, new).listed()
    ]
    console().print(printable("\n".join(lines or ["no notable difference"])), markup=False)


def print_differences(before: MachineRuns, now: MachineRuns) -> None:
    """Print how runs differ from earlier runs."""
    from smachpy_viz.runs.compare import ComparedRun

    print("compared with earlier runs:")
    _print_union(
        ComparedRun("before", before.record, before.statistics),
        ComparedRun("now", now.record, now.statistics),
    )


def _draw_both(args: argparse.Namespace, old: ComparedRun, new: ComparedRun) -> None:
    import sys

    from smachpy_viz.pictures import drawing
    from smachpy_viz.runs.compare import drawing as drawn
    from smachpy_viz.runs.compare import unite

    # A picture can be binary, so it goes to the buffer below standard output.
    form = "svg" if args.output == "-" else Path(args.output).suffix.lstrip(".").lower()
    diagram = drawn(unite(old, new), old, new, depth=args.depth)
    content = drawing.draw(diagram, form, theme=args.theme)
    if args.output == "-":
        sys.stdout.buffer.write(content)
    else:
        print(printable(drawing.write(content, args.output)))


def _side(place: str) -> ComparedRun:
    """One side of a comparison: recordings, or a machine that has not run."""
    from smachpy_viz.runs.compare import ComparedRun

    if not place.endswith(".jsonl") and not Path(place).is_dir():
        from smachpy_viz.cli import read_record

        return ComparedRun(place, read_record(place))
    runs = collect_one(place, "compare")
    return ComparedRun(place, runs.record, runs.statistics)


def _export(args: argparse.Namespace) -> int:
    from smachpy.events.recording import read_recording
    from smachpy_viz.runs import html

    if Path(args.file).is_dir():
        return _export_all(args.file, Path(args.output))
    output = Path(args.output)
    # A page needs the events at once, the others one after the other.
    newest = html.MOST_EVENTS if output.suffix.lower() == ".html" else None
    recording = read_recording(args.file, stream=newest is None, newest=newest)
    try:
        _write(recording, output, args.runs, args.map)
    except OSError as error:
        raise UsageError(
            f"smachpy runs export: {args.output!r}: cannot write: {error.strerror or error}."
        ) from error
    print(printable(output))
    if newest is not None and recording.folded:
        tell(
            "smachpy runs export",
            f"{printable(output)}: has the newest {newest:,} of {recording.folded + newest:,} "
            "events, and counts and newest values of those before. Try: smachpy view "
            f"{printable(args.file)}",
        )
    return 0


def _export_all(folder: str, output: Path) -> int:
    """Write one report of all runs in a folder."""
    from smachpy_viz.pictures.drawing import write
    from smachpy_viz.runs.report import report

    if output.suffix.lower() != ".html":
        raise UsageError(
            f"smachpy runs export: {str(output)!r}: got {output.suffix or 'no extension'} for a "
            f"folder of runs; expected .html, or one recording. Try -o {output.stem}.html"
        )
    page = report(collect_one(folder, "export")).encode("utf-8", "replace")
    print(printable(write(page, output)))
    return 0


def collect_one(place: str, command: str) -> MachineRuns:
    """Return the runs in a folder or file, which must be of one machine.

    Raises:
        UsageError: there are runs of several machines, or none.
    """
    from smachpy_viz.runs.report import collect

    found = collect(_each([place]))
    if len(found) > 1:
        raise UsageError(
            f"smachpy runs {command}: {place!r}: got runs of {sorted(found)}; expected those of "
            "one machine. Try one folder per machine, or a single file."
        )
    [runs] = found.values()
    return runs


def check_extension(command: str, output: Path, *forms: str) -> str:
    """Return the extension of a file, which is one of `forms`, or that of a picture.

    Raises:
        UsageError: it is not.
    """
    from smachpy_viz.pictures.drawing import FORMATS

    form = output.suffix.lstrip(".").lower()
    if form not in {*forms, *FORMATS}:
        raise UsageError(
            f"smachpy {command}: {str(output)!r}: got {form or 'no extension'}; expected "
            f"{', '.join(forms)}, or one of {', '.join(FORMATS)} for a picture. "
            f"Try -o {output.stem or 'run'}.html"
        )
    return form


def _write(recording: Recording, output: Path, runs: list[str], floor: Path | None) -> None:
    form = check_extension("runs export", output, "html", "mcap")
    if form == "html":
        from smachpy_viz.runs.html import standalone_page

        page = standalone_page(recording, runs, floor)
        output.write_text(page, encoding="utf-8", errors="replace")
    elif form == "mcap":
        from smachpy_viz.runs.mcap import write_mcap

        write_mcap(recording, output)
    else:
        from smachpy_viz.model.history import History
        from smachpy_viz.pictures.drawing import render

        # The picture of the machine with what the run did, as `viz.render(..., run=history)`.
        history = History()
        for event in recording.events:
            history.on_record(event)
        render(recording.record, output, run=history)


def console() -> Console:
    """Return a console as wide as the terminal; 160 columns wide if the output is a file."""
    import sys

    from rich.console import Console

    wide = None if sys.stdout.isatty() else 160
    return Console(highlight=False, width=wide)
