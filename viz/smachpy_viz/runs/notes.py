"""Notes of people on a recorded run, kept in a file beside it: `run.notes.json` for `run.jsonl`."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, Final, TypedDict

from actionlib_core.inputs.checked_data import DataError, Stamp, checked
from actionlib_core.inputs.json_text import JsonTextError, load_json
from actionlib_core.process.private_files import open_private
from smachpy.events.recording import RecordingError, notes_file

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

MAX_NOTES: Final = 100
"""Notes of a run."""

LONGEST_NOTE: Final = 300
"""Length of a note's text [characters]."""

MAX_NOTES_LENGTH: Final = 1_000_000
"""Longest file of notes [bytes]: `MAX_NOTES` of them in the widest writing take less."""

_SAME_NS: Final = 1_000
"""Numbers of browsers are floats: their instants are right to less than this."""


class RunNote(TypedDict):
    """A note at an instant of a run, by the robot's clock; `by`: who wrote it."""

    stamp_ns: Stamp
    text: str
    by: str


def checked_note(data: Any, by: str = "") -> RunNote:
    """Return data from a page or a file as a note, its texts cut to their longest.

    Args:
        data: `stamp_ns`, `text` and perhaps `by`.
        by: Who wrote it, if the data does not say so.

    Raises:
        DataError: it is no note.
    """
    note: RunNote = checked(RunNote, {"by": by, **data} if isinstance(data, dict) else data)
    text = note["text"].strip()[:LONGEST_NOTE]
    if not text:
        raise DataError(note["text"], "a text", ".text")
    return {"stamp_ns": note["stamp_ns"], "text": text, "by": note["by"][:LONGEST_NOTE]}


def with_note(notes: Iterable[RunNote], note: RunNote) -> list[RunNote]:
    """Return notes and another one, by their instants; one that is there already is not doubled.

    Raises:
        ValueError: there are `MAX_NOTES`.
    """
    found = [*without_note(notes, note), note]
    if len(found) > MAX_NOTES:
        raise ValueError(f"got more than {MAX_NOTES} of a run; expected fewer. Try: remove one.")
    return sorted(found, key=lambda one: one["stamp_ns"])


def without_note(notes: Iterable[RunNote], note: RunNote) -> list[RunNote]:
    """Return notes but those with the instant and text of another."""
    return [one for one in notes if not _is_same(one, note)]


def _is_same(one: RunNote, other: RunNote) -> bool:
    return one["text"] == other["text"] and abs(one["stamp_ns"] - other["stamp_ns"]) < _SAME_NS


def read_notes(recording: Path) -> list[RunNote]:
    """Return the notes of a recording by their instants; none if there is no file of them.

    Raises:
        RecordingError: the file cannot be read, or has something else in it.
    """
    file = notes_file(recording)
    try:
        with file.open("rb") as opened:
            data = load_json(opened.read(MAX_NOTES_LENGTH + 1), longest=MAX_NOTES_LENGTH)
        notes = [checked_note(one) for one in checked(list[Any], data)]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise RecordingError(file, f"its notes cannot be read: {error.strerror}.") from error
    except (JsonTextError, DataError) as error:
        raise RecordingError(file, f"no notes: {str(error).rstrip('.')}.") from error
    if len(notes) > MAX_NOTES:
        raise RecordingError(file, f"got {len(notes)} notes; expected at most {MAX_NOTES}.")
    return sorted(notes, key=lambda one: one["stamp_ns"])


def write_notes(recording: Path, notes: list[RunNote]) -> None:
    """Replace the notes of a recording, in one step; without notes there is no file.

    Raises:
        RecordingError: the file cannot be written.
    """
    file = notes_file(recording)
    draft = file.with_name(f".{file.name}.{os.urandom(4).hex()}")
    try:
        if not notes:
            file.unlink(missing_ok=True)
            return
        try:
            with open_private(draft, "x") as opened:
                json.dump(notes, opened, indent=1)
            draft.replace(file)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        raise RecordingError(file, f"its notes cannot be written: {error.strerror}.") from error
