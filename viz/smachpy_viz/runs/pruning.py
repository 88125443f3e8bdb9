"""Deletes old recordings: `smachpy runs prune`, and the viewer's `--prune`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from actionlib_core.clock import RealClock
from smachpy.command.pruning import is_kept
from smachpy.events.recording import (
    RecordingError,
    delete_recording,
    find_recordings,
    read_summary,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from actionlib_core.clock import Timer

EVERY_S: Final = 3600.0
"""Time between two looks for old recordings [s]."""


class Pruned(NamedTuple):
    """What was deleted: the number of recordings, and their size [bytes]."""

    number: int
    size: int


def prune_recordings(
    places: Iterable[str | Path],
    seconds: float,
    keep: str,
    on_problem: Callable[[str], object],
) -> Pruned:
    """Delete recordings that nothing was written to for so long, and their notes.

    Args:
        places: Files and folders.
        seconds: The age [s].
        keep: `smachpy.command.pruning.KEEPABLE`.
        on_problem: Called with a text about each file that is left because it is no recording, or
            cannot be read or deleted.

    Raises:
        RecordingError: there is no such place.
    """
    count = size = 0
    oldest = RealClock().time_ns() / 1e9 - seconds
    for path in find_recordings(places):
        try:
            facts = path.stat()
            if facts.st_mtime > oldest:
                continue
            # Not what is no recording, and not the records of failures; a name is no proof.
            found = read_summary(path)
            if is_kept(keep, found.outcome, success=found.success):
                continue
            delete_recording(path)
        except (OSError, RecordingError) as error:
            on_problem(f"{error} It is left.")
            continue
        count, size = count + 1, size + facts.st_size
    return Pruned(count, size)


class Pruning:
    """Deletes old recordings of some folders now and each hour, until it is closed.

    Args:
        folders: The folders; those that do not exist are passed over.
        seconds: The age of what is deleted [s].
        keep: As for `prune_recordings`.
        on_text: Called with a text about what was deleted, and about each file that is left because
            of a problem, once.

    Threads: `on_text` is called from threads of the clock, one at a time.
    """

    def __init__(
        self, folders: Iterable[Path], seconds: float, keep: str, on_text: Callable[[str], object]
    ) -> None:
        self._folders = list(folders)
        self._seconds, self._keep = seconds, keep
        self._on_text = on_text
        self._told: set[str] = set()
        self._clock = RealClock()
        self._closed = False
        self._timer: Timer | None = None
        self._look()

    def close(self) -> None:
        """Delete nothing more; a second call does nothing."""
        self._closed = True
        if self._timer is not None:
            self._timer.cancel()

    def _look(self) -> None:
        if not self._closed:
            # The disk may be slow, and timers must not wait for it.
            self._clock.spawn(self._prune, name="pruning of recordings")
            self._timer = self._clock.call_later(EVERY_S, self._look)

    def _prune(self) -> None:
        folders = [folder for folder in self._folders if folder.is_dir()]
        try:
            gone = prune_recordings(folders, self._seconds, self._keep, self._tell_once)
        except (OSError, RecordingError) as error:
            self._tell_once(str(error))
            return
        if gone.number:
            self._on_text(f"{gone.number} old recordings deleted")

    def _tell_once(self, text: str) -> None:
        if text not in self._told:
            self._told.add(text)
            self._on_text(text)
