"""Reproduces one file, in this process or in a worker."""

from __future__ import annotations

import contextlib
import logging
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from actionlib_core.clock import RealClock
from smachpy.events.recording import read_recording
from smachpy.exceptions import SmachError
from smachpy.reproduce.report import Verdict, lines_of, nearest
from smachpy.reproduce.run import reproduce

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from smachpy.reproduce.run import Reproduction


@dataclass(frozen=True, slots=True)
class Options:
    """How recordings are reproduced; see `smachpy.reproduce.run.reproduce`."""

    mission: str = ""
    allow: tuple[str, ...] = ()
    seed: int | None = None
    tolerate: tuple[str, ...] = ()


def reproduce_file(
    path: str, options: Options, keep: Callable[[Reproduction], object] = lambda _found: None
) -> Verdict:
    """Reproduce a file; a file that cannot be is a verdict, too.

    Args:
        path: The file.
        options: How.
        keep: Gets what was found.
    """
    started = RealClock().now()
    try:
        found = run_file(path, options)
    except SmachError as error:
        took = RealClock().now() - started
        text = str(error)
        return Verdict(path, "failed", (text if path in text else f"{path}: {text}",), seconds=took)
    keep(found)
    comparison, difference = found.comparison, found.comparison.difference
    return Verdict(
        path,
        "same" if difference is None else "differs",
        lines_of(found),
        comparison.same,
        comparison.total,
        RealClock().now() - started,
        difference,
        () if difference is None else tuple(nearest(found.changed, difference.path)),
        found.notes,
    )


def reproduce_content(path: str, content: bytes, options: Options) -> Verdict:
    """Reproduce a file that is on another computer.

    Args:
        path: Its name there.
        content: Its content.
        options: How.
    """
    with tempfile.TemporaryDirectory(prefix="smachpy-reproduce-") as folder:
        file = Path(folder) / "recording.jsonl"
        file.write_bytes(content)
        verdict = reproduce_file(str(file), options)
        lines = tuple(line.replace(str(file), path) for line in verdict.lines)
        return replace(verdict, path=path, lines=lines)


def run_file(path: str, options: Options) -> Reproduction:
    """Reproduce a file.

    Raises:
        RecordingError, ReproductionError: it cannot be read, or does not say enough.
    """
    with quiet():
        return reproduce(
            read_recording(path, plots=False),
            mission=options.mission,
            allow=options.allow,
            seed=options.seed,
            tolerate=options.tolerate,
        )


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Let the mission log nothing, and print to standard error."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    finally:
        logging.disable(before)
