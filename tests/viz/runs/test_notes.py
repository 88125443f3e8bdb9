"""Notes on recordings, in files beside them."""

from __future__ import annotations

import json
import os

import pytest

from actionlib_core.inputs.checked_data import DataError
from smachpy.events.recording import RecordingError, delete_recording, notes_file
from smachpy_viz.runs.notes import (
    LONGEST_NOTE,
    MAX_NOTES,
    MAX_NOTES_LENGTH,
    checked_note,
    read_notes,
    with_note,
    without_note,
    write_notes,
)


def a_note(stamp_ns=5, text="here", by="Ada"):
    return {"stamp_ns": stamp_ns, "text": text, "by": by}


def test_notes_are_kept_beside_the_recording_for_its_user_only(tmp_path):
    recording = tmp_path / "run.jsonl"
    assert read_notes(recording) == []
    write_notes(recording, [a_note(7), a_note(5, "\ud800 <b>")])
    assert [one["stamp_ns"] for one in read_notes(recording)] == [5, 7]
    assert [path.name for path in tmp_path.iterdir()] == ["run.notes.json"]
    assert os.stat(notes_file(recording)).st_mode & 0o777 == 0o600
    write_notes(recording, [])
    assert list(tmp_path.iterdir()) == []


def test_a_link_in_the_place_of_the_notes_is_replaced_and_not_followed(tmp_path):
    mine = tmp_path / "mine"
    mine.write_text("precious")
    notes_file(tmp_path / "run.jsonl").symlink_to(mine)
    write_notes(tmp_path / "run.jsonl", [a_note()])
    assert mine.read_text() == "precious"
    assert read_notes(tmp_path / "run.jsonl") == [a_note()]


def test_the_notes_go_with_their_recording(tmp_path):
    recording = tmp_path / "run.jsonl"
    recording.write_text("")
    write_notes(recording, [a_note()])
    delete_recording(recording)
    assert list(tmp_path.iterdir()) == []
    delete_recording(recording)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "no JSON"),
        ("{}", "an object of 0"),
        ('["x"]', "an object"),
        ("[{}]", "stamp_ns"),
        (json.dumps([a_note(-1)]), "stamp_ns"),
        (json.dumps([a_note(2**63)]), "stamp_ns"),
        (json.dumps([a_note(text=7)]), "text"),
        (json.dumps([a_note(text="  ")]), "a text"),
        (json.dumps([{**a_note(), "more": 1}]), "more"),
        (json.dumps([a_note(n) for n in range(MAX_NOTES + 1)]), "at most 100"),
        ("[" * 200, "no notes"),
        (" " * (MAX_NOTES_LENGTH + 1), "1,000,000"),
    ],
)
def test_a_file_with_something_else_is_refused(tmp_path, text, problem):
    notes_file(tmp_path / "run.jsonl").write_text(text)
    with pytest.raises(RecordingError, match=problem):
        read_notes(tmp_path / "run.jsonl")


def test_a_folder_in_the_place_of_the_notes_is_told(tmp_path):
    notes_file(tmp_path / "run.jsonl").mkdir()
    with pytest.raises(RecordingError, match="cannot be read"):
        read_notes(tmp_path / "run.jsonl")
    with pytest.raises(RecordingError, match="cannot be written"):
        write_notes(tmp_path / "run.jsonl", [a_note()])
    assert [path.name for path in tmp_path.iterdir()] == ["run.notes.json"]


def test_a_full_file_of_the_longest_notes_can_be_read(tmp_path):
    wide = "\U0001f916" * (2 * LONGEST_NOTE)
    notes = [checked_note(a_note(n, wide, wide)) for n in range(MAX_NOTES)]
    write_notes(tmp_path / "run.jsonl", notes)
    assert read_notes(tmp_path / "run.jsonl") == notes
    with pytest.raises(ValueError, match="more than 100"):
        with_note(notes, a_note())


def test_a_note_is_there_once_and_is_found_by_instant_and_text():
    notes = with_note([], a_note(1_764_300_000_123_456_789))
    as_a_browser_has_it = a_note(1_764_300_000_123_456_800, by="")
    assert len(with_note(notes, as_a_browser_has_it)) == 1
    assert without_note(notes, as_a_browser_has_it) == []
    assert without_note(notes, a_note(1_764_300_000_123_456_789, "other")) == notes


def test_who_wrote_a_note_is_filled_in(tmp_path):
    assert checked_note({"stamp_ns": 1, "text": " x "}, "page") == a_note(1, "x", "page")
    assert checked_note(a_note(), "page")["by"] == "Ada"
    with pytest.raises(DataError, match="an object"):
        checked_note("x")
