"""`smachpy runs reproduce`: runs recorded missions again, and says what differs."""

from __future__ import annotations

import argparse
import json
from collections import deque
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import RealClock
from actionlib_core.process.output import printable
from smachpy.command import UsageError
from smachpy.command.durable import whole_target
from smachpy.command.on import (
    ProgressLine,
    add_jobs_and_on,
    opened_cluster,
    whole_place,
    workers_text,
)
from smachpy.command.queued import add_allow
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smachpy.base.cluster import Cluster
    from smachpy.base.workers import Workers
    from smachpy.reproduce.report import Verdict
    from smachpy.reproduce.run import Reproduction
    from smachpy.reproduce.task import Options

EXAMPLES = """examples:
  smachpy runs reproduce incident.jsonl                       is it the same with today's code?
  smachpy runs reproduce incident.jsonl --tolerate started_at --tolerate CHARGE
  smachpy runs reproduce incident.jsonl --record today.jsonl  to look at beside the recorded one
  smachpy runs reproduce incident.jsonl -o test_incident.py   write a test
  smachpy runs reproduce incident.jsonl -o test_incident.py --expect succeeded
  smachpy runs reproduce night/ --junit report.xml            in continuous integration
"""


def add(actions: Any) -> None:
    """Add the action to `smachpy runs`."""
    parser = actions.add_parser(
        "reproduce",
        help="run a recorded mission again, and find the first difference",
        description="Run the missions of recordings again: today's code, in virtual time, with the "
        "servers, topics and operators that were recorded. Exit codes: 0 all are the same, 1 one "
        "differs, 2 one cannot be reproduced, or bad input.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("places", nargs="+", metavar="FILE|DIR")
    parser.add_argument(
        "--mission",
        default="",
        help="the mission (default: the one that the recording names, installed or allowed)",
    )
    add_allow(parser, "the recording may name a mission of this place")
    parser.add_argument(
        "--tolerate",
        action="append",
        default=[],
        metavar="NAME",
        help="what may differ: userdata, goals, errors, a key of userdata, or a state with all in "
        "it; may be repeated",
    )
    parser.add_argument("--seed", type=int, help="another order of what happens at one moment")
    add_jobs_and_on(parser)
    parser.add_argument("--junit", type=Path, metavar="FILE", help="write a report for CI")
    parser.add_argument("--json", action="store_true", help="one JSON object per recording")
    parser.add_argument(
        "--record", type=Path, metavar="FILE", help="record the new run in this file"
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="write a test of the run: test_NAME.py"
    )
    parser.add_argument(
        "--expect",
        default="",
        metavar="OUTCOME",
        help="with -o: the test wants this outcome, and fails until the mission is mended",
    )
    # For the page: nobody knows where the test will be saved.
    parser.add_argument("--beside-mission", action="store_true", help=argparse.SUPPRESS)
    parser.set_defaults(run=_run)


def _write(args: argparse.Namespace) -> int:
    from smachpy.events.recording import read_recording
    from smachpy.reproduce.task import quiet
    from smachpy.reproduce.written import beside, write_test

    where = "smachpy runs reproduce: -o"
    if args.record is not None:
        raise UsageError("smachpy runs reproduce: --record: got it with -o; expected one.")
    is_folder = len(args.places) == 1 and Path(args.places[0]).is_dir()
    if len(args.places) != 1 or is_folder:
        got = f"the folder {args.places[0]!r}" if is_folder else f"{len(args.places)} places"
        raise UsageError(f"{where}: got {got}; expected one recording.")
    if args.output.suffix != ".py":
        raise UsageError(f"{where} {str(args.output)!r}: expected a name that ends with .py.")
    _check_new(args.output, "-o")
    recording = read_recording(args.places[0], plots=False)
    folder = beside(recording, args.mission) if args.beside_mission else args.output.parent
    with quiet():
        written = write_test(
            recording,
            mission=args.mission,
            allow=args.allow,
            expect=args.expect,
            folder=folder,
        )
    try:
        with args.output.open("x", encoding="utf-8") as file:
            file.write(written.text)
    except OSError as error:
        raise UsageError(
            f"{where} {str(args.output)!r}: cannot write: {error.strerror or error}."
        ) from error
    print(printable(f"{args.output}: shortened in {written.runs} runs"))
    needs_place = args.beside_mission and "__file__" in written.text
    for note in (*written.notes, *([f"save it in {str(folder)!r}"] if needs_place else [])):
        print(printable(f"  note: {note}"))
    return 0


def _run(args: argparse.Namespace) -> int:
    if args.output is not None:
        return _write(args)
    if args.expect:
        raise UsageError("smachpy runs reproduce: --expect: got it without -o; expected both.")
    from smachpy.events.recording import find_recordings
    from smachpy.reproduce.report import junit, summary
    from smachpy.reproduce.task import Options

    paths = [str(path) for path in find_recordings(args.places)]
    if not paths:
        raise UsageError(
            f"smachpy runs reproduce: {' '.join(args.places)}: got no recordings; expected *.jsonl "
            "files."
        )
    _check_outputs(args, len(paths))
    options = Options(args.mission, tuple(args.allow), args.seed, tuple(args.tolerate))
    if args.on is not None:  # as the workers know them
        mission, allow = whole_target(args.mission), map(whole_place, args.allow)
        options = replace(options, mission=mission if args.mission else "", allow=tuple(allow))
    verdicts = []
    with opened_cluster(args.on, options.mission, options.allow) as cluster:
        who = workers_text(cluster, args.jobs, len(paths))
        progress = ProgressLine(f"of {len(paths)} recordings", who)
        for verdict in verdicts_of(paths, options, args.jobs, cluster, args.record):
            progress.end()
            verdicts.append(verdict)
            _show(verdict, many=len(paths) > 1, as_json=args.json)
            progress.show(len(verdicts))
        progress.end()
    if len(paths) > 1 and not args.json:
        print(printable(summary(verdicts)))
    if args.junit is not None:
        try:
            args.junit.write_text(junit(verdicts), encoding="utf-8")
        except OSError as error:
            raise UsageError(
                f"smachpy runs reproduce: --junit {str(args.junit)!r}: cannot write: "
                f"{error.strerror or error}."
            ) from error
    kinds = {verdict.kind for verdict in verdicts}
    return 2 if "failed" in kinds else 1 if "differs" in kinds else 0


def _check_outputs(args: argparse.Namespace, recordings: int) -> None:
    if args.junit is not None:
        _check_folder(args.junit, "--junit")
    if args.record is None:
        return
    if recordings > 1 or args.on is not None:
        raise UsageError(
            f"smachpy runs reproduce: --record: got {recordings} recordings, or --on; expected one "
            "recording here."
        )
    _check_new(args.record, "--record")


def _check_new(path: Path, option: str) -> None:
    """Refuse a file that cannot be written, before the work for it is done."""
    if path.exists() or path.is_symlink():
        raise UsageError(
            f"smachpy runs reproduce: {option} {str(path)!r}: cannot write: File exists."
        )
    _check_folder(path, option)


def _check_folder(path: Path, option: str) -> None:
    if not path.parent.is_dir():
        raise UsageError(
            f"smachpy runs reproduce: {option} {str(path)!r}: cannot write: no such folder."
        )


def _record(path: Path | None, found: Reproduction) -> None:
    """Write the new run to a file that must not exist; None: nowhere."""
    if path is None:
        return
    from actionlib_core.process.private_files import open_private
    from smachpy.events.recording import recording_lines

    assert found.record is not None
    try:
        with open_private(path, "x") as file:
            now = RealClock().time_ns()
            file.writelines(recording_lines(found.record, found.events, None, made_ns=now))
    except OSError as error:
        raise UsageError(
            f"smachpy runs reproduce: --record {str(path)!r}: cannot write: "
            f"{error.strerror or error}."
        ) from error


def _show(verdict: Verdict, *, many: bool, as_json: bool) -> None:
    if as_json:
        print(json.dumps(verdict.to_json()))
        return
    head = f"{verdict.path}: " if many and verdict.kind != "failed" else ""
    for number, line in enumerate(verdict.lines):
        print(printable(line if number else f"{head}{line}"))


def verdicts_of(
    paths: list[str],
    options: Options,
    jobs: int | None,
    cluster: Cluster | None,
    record: Path | None = None,
) -> Iterator[Verdict]:
    """Yield the verdicts in the order of the files, whoever does them."""
    from smachpy.base.workers import Workers, cores
    from smachpy.reproduce.report import Verdict
    from smachpy.reproduce.task import reproduce_file

    if len(paths) == 1 and cluster is None:
        yield reproduce_file(paths[0], options, partial(_record, record))
        return
    count = min(jobs or cores(), len(paths)) if cluster is None else cluster.count
    workers = cluster or Workers(count)
    begun: deque[tuple[str, Future[Verdict]]] = deque()
    try:
        for path in [*paths, *[""] * 2 * count]:  # no more than these are in memory at once
            if path:
                begun.append((path, _begun(workers, path, options)))
            if begun and (not path or len(begun) > 2 * count):
                name, future = begun.popleft()
                try:
                    yield future.result()
                except (SmachError, RuntimeError, OSError) as error:
                    yield Verdict(name, "failed", (f"{name}: {error}",))
    except BaseException:  # such as Ctrl-C
        if isinstance(workers, Workers):
            workers.kill()
        raise
    finally:
        if isinstance(workers, Workers):
            workers.shutdown(cancel_futures=True)


def _begun(workers: Workers | Cluster, path: str, options: Options) -> Future[Verdict]:
    from actionlib_core.inputs.checked_file import read_limited
    from smachpy.base.workers import Workers
    from smachpy.events.recording import LARGEST
    from smachpy.reproduce.task import reproduce_content, reproduce_file

    if isinstance(workers, Workers):
        return workers.submit(reproduce_file, path, options)
    try:
        content = read_limited(path, LARGEST)
    except (OSError, ValueError) as error:
        failed: Future[Verdict] = Future()
        failed.set_exception(RuntimeError(str(error)))
        return failed
    return workers.submit(reproduce_content, path, content, options)
