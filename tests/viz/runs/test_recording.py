"""Recordings: written as a run happens, readable whatever happened."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import gc
import gzip
import json
import math
import os
import queue
import re
import threading
import weakref
import zlib
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from actionlib_core.interfaces import define_action
from smachpy import CBState, State, StateMachine, describe
from smachpy.events import GoalDone, GoalFeedback, GoalSent, buffer, to_record
from smachpy.events import recording as recording_module
from smachpy.events.recording import (
    Recorder,
    RecordingError,
    each_recording,
    find_recordings,
    notes_file,
    read_recording,
    read_summary,
    recording_lines,
)
from smachpy.events.run_state import RunState
from smachpy_viz.live import kept, machines
from smachpy_viz.live.machine_routes import _export_recording
from smachpy_viz.live.machines import Machine, Machines
from smachpy_viz.model.why import why
from smachpy_viz.runs import html, pruning
from smachpy_viz.runs.html import standalone_page
from smachpy_viz.runs.statistics import (
    Statistics,
    StatisticsOfFiles,
    count_by_machine,
    never_taken,
    quantile,
)


def make_machine(*, failing=False, extra=False):
    sm = StateMachine(outcomes=["succeeded", "aborted"], name="JOB")

    def work(userdata):
        userdata.count = 3
        return "aborted" if failing else "succeeded"

    with sm:
        StateMachine.add(
            "FIRST",
            CBState(work, outcomes=["succeeded", "aborted"], output_keys=["count"]),
            {"succeeded": "LAST"},
        )
        StateMachine.add("LAST", CBState(lambda _: "succeeded", outcomes=["succeeded"]))
        if extra:
            StateMachine.add("EXTRA", CBState(lambda _: "succeeded", outcomes=["succeeded"]))
    return sm


@pytest.fixture
def record(tmp_path, clock):
    def record(name, **how):
        machine = make_machine(**how)
        with Recorder(tmp_path / name, machine):
            machine.execute()
        return tmp_path / name

    return record


@pytest.mark.parametrize("rows", [0, 40, 48, 52, 60, 80])  # of about 1,300 characters
def test_a_file_whose_last_line_is_long_is_continued_and_listed(tmp_path, clock, rows):
    """Parts of the last line were read twice, and the next process wrote behind a gap of zeros."""
    path = tmp_path / "run.jsonl"

    def write(userdata):
        userdata.scan = [[100_000_000 + row] * 120 for row in range(rows)]
        return "done"

    def run():
        machine = StateMachine(["done"], name="M")
        machine.add("A", CBState(write, outcomes=["done"], output_keys=["scan"]))
        with Recorder(path, machine, run="r"):
            machine.execute()

    run()
    lines = path.read_text().splitlines(keepends=True)
    last = next(n for n, line in enumerate(lines) if '"UserdataWritten"' in line)
    path.write_text("".join(lines[: last + 1]))  # killed
    assert len(lines[last]) > 1_000 * rows
    assert read_summary(path).events == last
    run()
    assert b"\0" not in path.read_bytes()
    assert [each["kind"] for each in read_recording(path).events].count("UserdataWritten") == 2
    assert read_summary(path).has_end


def test_a_run_comes_back_as_it_was(record):
    recording = read_recording(record("run.jsonl"))
    assert recording.record == describe(make_machine())
    kinds = [event["kind"] for event in recording.events]
    assert kinds[0] == "Started"
    assert kinds[-1] == "Finished"
    assert [event["seq"] for event in recording.events] == list(range(1, len(kinds) + 1))
    assert not recording.cut


@pytest.mark.parametrize("lost", [1, 5, 40])
def test_a_file_cut_off_by_a_crash_is_readable(record, lost):
    path = record("run.jsonl")
    data = path.read_bytes()
    path.write_bytes(data[:-lost])
    recording = read_recording(path)
    assert recording.cut
    assert recording.events[0]["kind"] == "Started"


def test_every_event_is_in_the_file_at_once(tmp_path, clock):
    machine = make_machine()
    seen = []

    def look(event):
        clock.sleep(0.001)
        seen.append((tmp_path / "run.jsonl").read_text().count("\n"))

    with Recorder(tmp_path / "run.jsonl", machine):
        machine.subscribe(look)
        machine.execute()
    assert seen == list(range(2, 2 + len(seen)))


def test_a_run_is_never_overwritten(record, tmp_path, clock):
    path = record("run.jsonl")
    with pytest.raises(RecordingError, match="exists"):
        Recorder(path, make_machine())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "line 1"),
        ("{}\n", "no header"),
        ('{"format": "other", "version": 1}\n', "other"),
        ("\x00\x01\n", "line 1"),
    ],
)
def test_what_is_no_recording_is_named(tmp_path, text, words):
    (tmp_path / "x.jsonl").write_text(text)
    with pytest.raises(RecordingError, match=words):
        read_recording(tmp_path / "x.jsonl")


def test_a_broken_line_in_the_middle_is_named(record):
    path = record("run.jsonl")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:2], "{broken\n", *lines[2:]]))
    with pytest.raises(RecordingError, match="line 3"):
        read_recording(path)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[("dropped", value) for value in ("5", -1, 1.5, True, None, [1])],
        *[("stamp_ns", value) for value in ("5", None, 1.5)],
        ("kind", 3),
        ("path", ["/A"]),
        *[("t", value) for value in ("5", None, 1e300, [])],
    ],
)
def test_a_field_that_is_none_is_named_with_its_line(record, name, value):
    path = record("run.jsonl")
    lines = path.read_text().splitlines(keepends=True)
    lines[2] = json.dumps({**json.loads(lines[2]), name: value}) + "\n"
    path.write_text("".join(lines))
    with pytest.raises(RecordingError, match=rf"line 3: .*\(\$\.{name}: .*expected an event"):
        read_recording(path)


def with_line(path, **fields):
    """The recording with another line before its last event."""
    *lines, last, end = path.read_text().splitlines(keepends=True)
    event = {"path": "/JOB/FIRST", "t": 0.0, "stamp_ns": json.loads(last)["stamp_ns"], **fields}
    path.write_text("".join([*lines, json.dumps(event) + "\n", last, end]))
    return path


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"kind": "Left"}, "outcome"),
        ({"kind": "Left", "outcome": None}, "outcome"),
        ({"kind": "Retried", "attempt": "2", "reason": ""}, "attempt"),
        ({"kind": "Fired", "transition": "a", "marking": ["a", 1]}, "marking"),
        ({"kind": "UserdataWritten", "key": "a"}, "value"),
        ({"kind": "GoalFeedback", "action": "a", "goal_id": "1"}, "feedback"),
    ],
)
def test_an_event_without_what_its_kind_needs_is_named(record, fields, word):
    path = with_line(record("run.jsonl"), **fields)
    with pytest.raises(RecordingError, match=rf"line 8: .*{word}.*expected an event"):
        read_recording(path)


POSE = {"what": "pose", "robot": "", "at": [1.0, 2.0, 0.0]}


@pytest.mark.parametrize(
    "fields",
    [{}, {"what": "map"}, {"what": "map", "robot": {}}, {**POSE, "at": [1.0]}, {**POSE, "at": 5}],
)
def test_data_of_topics_in_another_shape_is_left_out_with_a_warning(record, caplog, fields):
    path = with_line(record("run.jsonl"), kind="Observed", **POSE)
    path = with_line(path, kind="Observed", **fields)
    recording = read_recording(path)
    assert [one["at"] for one in recording.observed] == [[1.0, 2.0, 0.0]]
    without = read_recording(path, plots=False)
    assert (without.events, without.observed) == (recording.events, [])
    assert "1 record(s) of topics or inputs are left out; the first: line 9" in caplog.text


def test_feedback_that_is_only_shown_keeps_its_place_and_not_its_content(record):
    fields = {"action": "a", "goal_id": "1", "feedback": {"x": 1.0}}
    path = with_line(record("run.jsonl"), kind="GoalFeedback", **fields)
    whole, without = (read_recording(path, plots=plots).events for plots in (True, False))
    [feedback] = [event for event in whole if event["kind"] == "GoalFeedback"]
    assert feedback["feedback"] == {"x": 1.0}
    feedback["feedback"] = None
    assert without == whole


@pytest.mark.parametrize(
    "change",
    [
        {"states": {"/JOB": 5}},
        {"states": []},
        {"run": "1"},
        {"started": -1},
        {"goals": {"1": {"path": "/NO/STATE"}}},
        {"userdata": {"/JOB a": {"key": 1}}},
    ],
)
def test_a_state_before_the_first_event_of_another_form_is_refused(record, change):
    path = record("run.jsonl")
    header, *lines = path.read_text().splitlines(keepends=True)
    base = {**RunState().data, **change}
    path.write_text("".join([json.dumps({**json.loads(header), "base": base}) + "\n", *lines]))
    with pytest.raises(RecordingError, match=r"line 1: got a wrong header"):
        read_recording(path)


def test_fields_that_older_recordings_lack_have_their_defaults(record):
    path = with_line(
        record("run.jsonl"), kind="GoalDone", action="a", goal_id="1", status="LOST", text=""
    )
    assert read_recording(path).events[-2]["result"] is None


@pytest.mark.parametrize("fields", [{"kind": "Sparkled"}, {"kind": "Entered", "shade": "blue"}])
def test_what_a_newer_version_records_is_skipped(record, fields):
    """Format: the `version` in the header changes when an older reader would be wrong."""
    from smachpy.command import main

    path = with_line(record("run.jsonl"), **fields)
    picture = path.with_suffix(".txt")
    assert main(["runs", "export", str(path), "-o", str(picture)]) == 0
    assert "FIRST" in picture.read_text()


def test_a_disk_that_fails_ends_the_recording_and_not_the_run(tmp_path, clock):
    machine = make_machine()
    recorder = Recorder(tmp_path / "run.jsonl", machine)

    class Full:
        closed = False

        def write(self, text):
            raise OSError(28, "No space left on device")

        def close(self):
            self.closed = True

    recorder._file.close()
    recorder._file = Full()
    with recorder:
        assert machine.execute() == "succeeded"
    assert recorder.dropped == 7


def test_more_events_than_can_be_written_end_as_the_run_did(
    tmp_path, clock, monkeypatch, caplog, capsys
):
    monkeypatch.setattr(recording_module, "WAITING_EVENTS", 20)
    monkeypatch.setattr(buffer, "SLACK", 20)

    class Again(State):
        left = 3000

        def execute(self, userdata):
            self.left -= 1
            return "again" if self.left else "succeeded"

    sm = StateMachine(outcomes=["succeeded"], name="JOB")
    with sm:
        StateMachine.add("SPIN", Again(outcomes=["again", "succeeded"]), {"again": "SPIN"})
    with Recorder(tmp_path / "run.jsonl", sm) as recorder:
        recorder._buffer.on_full = None  # as if the disk hung
        sm.execute()
    recording = read_recording(tmp_path / "run.jsonl")
    assert recording.dropped == recorder.dropped > 5000
    assert recording.events[-1]["kind"] == "Finished"
    assert recording.events[-1]["seq"] == 2 + 2 * 3000
    assert f"{recorder.dropped} events are missing" in caplog.text
    assert "disk" not in caplog.text
    from smachpy.command import main

    assert main(["runs", "list", str(tmp_path / "run.jsonl")]) == 0
    assert "of 6002" in capsys.readouterr().out
    assert main(["runs", "show", str(tmp_path / "run.jsonl")]) == 0
    assert "events are missing" in capsys.readouterr().out
    again = tmp_path / "again.jsonl"
    again.write_text("".join(recording_lines(recording.record, recording.events, None)))
    assert read_recording(again).events == recording.events


def busy(transitions):
    """A machine that is faster than the disk."""

    class Again(State):
        left = transitions

        def execute(self, userdata):
            self.left -= 1
            return "again" if self.left else "succeeded"

    sm = StateMachine(outcomes=["succeeded"], name="JOB")
    sm.add("SPIN", Again(outcomes=["again", "succeeded"]), {"again": "SPIN"})
    return sm


def end_of(path):
    return json.loads(path.read_text().splitlines()[-1])


@pytest.mark.parametrize("time", ["real", "virtual"])
def test_a_machine_that_is_faster_than_the_writer_loses_nothing(
    time, tmp_path, monkeypatch, request
):
    """11 to 33 % of the events were lost, with a normal end of the program."""
    if time == "virtual":  # the writer gets no turn until the machine waits
        request.getfixturevalue("clock")
    monkeypatch.setattr(recording_module, "WAITING_EVENTS", 50)
    monkeypatch.setattr(recording_module, "WRITTEN_AT_ONCE", 20)
    monkeypatch.setattr(buffer, "SLACK", 20)
    path = tmp_path / "run.jsonl"
    waits = []
    with Recorder(path, machine := busy(3000)) as recorder:
        wait = recorder._make_room
        recorder._buffer.on_full = lambda: waits.append(len(recorder._buffer._entries)) or wait()
        machine.execute()
    assert recorder.dropped == 0
    assert waits
    assert max(waits) < 50 * 20  # memory stays bounded
    events = read_recording(path).events
    assert [event["seq"] for event in events] == list(range(1, 3 * 1 + 2 * 3000))
    end = end_of(path)
    assert (end["kind"], end["events"], end["missing"]) == ("End", len(events), 0)
    assert end["outcome"] == "succeeded"


def test_a_disk_that_hangs_does_not_hang_the_machine(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(recording_module, "WAITING_EVENTS", 50)
    monkeypatch.setattr(recording_module, "HANGS_S", 0.2)
    monkeypatch.setattr(recording_module, "CLOSE_S", 0.1)
    monkeypatch.setattr(buffer, "SLACK", 20)
    path = tmp_path / "run.jsonl"
    machine, goes_on = busy(2000), threading.Event()
    recorder = Recorder(path, machine)
    monkeypatch.setattr(recorder, "_file", SlowFile(recorder._file, goes_on))
    assert machine.execute() == "succeeded"
    recorder.close()
    assert "still being written" in caplog.text
    assert "the end of the run is lost" in caplog.text
    goes_on.set()
    recorder.close()
    assert recorder.dropped > 1000
    events = read_recording(path).events
    assert events[-1]["kind"] == "Finished"
    assert sum(event.get("dropped", 0) for event in events) == recorder.dropped
    assert end_of(path)["missing"] == recorder.dropped
    summary = read_summary(path)
    assert (summary.missing, summary.events) == (recorder.dropped, len(events))


class SlowFile:
    """A file on a disk that hangs until an event is set."""

    def __init__(self, file, goes_on):
        self.file, self.goes_on = file, goes_on

    def write(self, text):
        self.goes_on.wait(60)
        return self.file.write(text)

    def __getattr__(self, name):
        return getattr(self.file, name)


def test_a_summary_reads_two_lines(record, monkeypatch):
    path = record("run.jsonl")
    events = read_recording(path).events
    whole = read_summary(path)
    assert whole.has_end
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:-1]))  # as it is when the process dies
    cut = read_summary(path)
    assert not cut.has_end
    assert replace(cut, has_end=True) == whole
    assert (whole.events, whole.outcome) == (len(events), "succeeded")
    assert (whole.first_ns, whole.last_ns) == (events[0]["stamp_ns"], events[-1]["stamp_ns"])
    # What lies between is not read.
    path.write_text("".join([lines[0], "nonsense\n" * 3, lines[-1]]))
    assert read_summary(path) == whole


@pytest.mark.parametrize("change", [{"events": "7"}, {"outages": 5}, {"stamp_ns": -1}])
def test_a_wrong_end_mark_is_refused(record, change):
    path = record("run.jsonl")
    *lines, end = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines, json.dumps({**json.loads(end), **change}) + "\n"]))
    with pytest.raises(RecordingError, match="end mark"):
        read_summary(path)


def test_a_large_recording_is_counted_event_by_event(record, monkeypatch, capsys):
    from smachpy.command import main

    path = record("run.jsonl", failing=True)
    whole = count_by_machine([read_recording(path)])
    monkeypatch.setattr(recording_module, "STREAMED", 10)
    monkeypatch.setattr(recording_module, "_read", None)  # nothing is read whole
    (recording,) = each_recording([path], stream=True)
    assert isinstance(recording.events, recording_module.Streamed)
    assert count_by_machine([recording]) == whole
    assert main(["runs", "show", str(path)]) == 0
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:3], "nonsense\n", *lines[3:]]))
    assert main(["runs", "show", str(path)]) == 2
    assert "line 4" in capsys.readouterr().err


def test_a_large_recording_is_drawn_event_by_event(record, monkeypatch, tmp_path):
    from smachpy.command import main

    path = record("run.jsonl", failing=True)
    whole, streamed = tmp_path / "whole.txt", tmp_path / "streamed.txt"
    assert main(["runs", "export", str(path), "-o", str(whole)]) == 0
    monkeypatch.setattr(recording_module, "STREAMED", 10)
    monkeypatch.setattr(recording_module, "_read", None)  # nothing is read whole
    assert main(["runs", "export", str(path), "-o", str(streamed)]) == 0
    assert streamed.read_text() == whole.read_text()


def test_a_recording_with_a_wrong_line_leaves_no_half_mcap_file(
    record, monkeypatch, capsys, tmp_path
):
    from smachpy.command import main

    monkeypatch.setattr(recording_module, "STREAMED", 10)
    path, output = record("run.jsonl"), tmp_path / "run.mcap"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:3], "nonsense\n", *lines[3:]]))
    assert main(["runs", "export", str(path), "-o", str(output)]) == 2
    assert "line 4" in capsys.readouterr().err
    assert not output.exists()


def test_a_large_recording_is_explained_event_by_event(record, monkeypatch, capsys):
    from smachpy.command import main

    path = record("run.jsonl", failing=True)
    assert main(["runs", "why", str(path)]) == 0
    whole = capsys.readouterr().out
    monkeypatch.setattr(recording_module, "STREAMED", 10)
    monkeypatch.setattr(recording_module, "_read", None)  # nothing is read whole
    assert main(["runs", "why", str(path)]) == 0
    assert capsys.readouterr().out == whole


def test_a_folder_is_no_run_whose_end_has_a_cause(tmp_path, capsys):
    from smachpy.command import main

    assert main(["runs", "why", str(tmp_path)]) == 2
    assert "got a folder; expected one recorded run. Try a file in it." in capsys.readouterr().err


def test_of_a_large_recording_the_page_has_the_newest_events_and_says_so(
    record, monkeypatch, tmp_path, capsys
):
    from smachpy.command import main

    def exported():
        assert main(["runs", "export", str(path), "-o", str(tmp_path / "run.html")]) == 0
        [data] = re.findall('id="run-data">([^<]*)<', (tmp_path / "run.html").read_text())
        return json.loads(gzip.decompress(base64.b64decode(data)))

    path = record("run.jsonl", failing=True)
    whole = exported()
    events = whole["snap"]["events"]
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(html, "MOST_EVENTS", 4)
    page = exported()
    assert page["snap"]["events"] == events[-4:]
    for part in ("why", "model"):  # the cause of the end is before these events
        assert page[part] == whole[part]
    told = capsys.readouterr().err
    assert f"has the newest 4 of {len(events)} events" in told
    before = RunState()
    for event in events[:-4]:
        before.fold(event)
    assert page["snap"]["base"] == json.loads(json.dumps(before.data))


def test_a_large_recording_is_shown_without_holding_its_events(record, monkeypatch):
    path = record("run.jsonl", failing=True)
    lines = path.read_text().splitlines(keepends=True)
    pose = {
        "kind": "Observed",
        "path": "",
        "stamp_ns": 1,
        "robot": "",
        "what": "of a newer program",
    }
    path.write_text("".join([lines[0], *[json.dumps(pose) + "\n"] * 40, *lines[1:]]))
    whole = Machine("run", lambda _machine: None)
    whole.load(read_recording(path))
    monkeypatch.setattr(kept, "PACKED", 200)
    monkeypatch.setattr(recording_module, "STREAMED", 10)
    monkeypatch.setattr(recording_module, "_read", None)  # nothing is read whole
    machine = Machines().load("run", read_recording(path, stream=True))
    assert isinstance(machine.events(), kept.Packed)
    seq, text = machine.snapshot()
    assert (seq, json.loads(text)) == (whole.seq, json.loads(whole.snapshot()[1]))
    assert list(machine.events()) == list(machine.events()) == whole.events()
    assert machine.observed() == whole.observed() != []
    assert ",".join(machine.observed_since(0)) == ",".join(whole.observed_since(0))
    assert machine.newest_observed("of a newer program", 30) == whole.newest_observed(
        "of a newer program", 30
    )
    assert machine.newest_events("", 1_000) == whole.events()
    assert machine.row() == whole.row()
    assert (machine.since(seq), machine.since(seq - 1)) == ([], whole.since(seq - 1))
    assert machine.since(0) is None  # a page that lacks them gets a snapshot
    assert _export_recording(machine, machine.record, "", []) == _export_recording(
        whole, whole.record, "", []
    )


def test_a_page_saved_from_the_viewer_has_the_newest_events(record, monkeypatch):
    machine = Machine("run", lambda _machine: None)
    machine.load(read_recording(record("run.jsonl", failing=True)))
    monkeypatch.setattr(html, "MOST_EVENTS", 4)
    [data] = re.findall('id="run-data">([^<]*)<', html.page_of(machine, machine.record))
    page = json.loads(gzip.decompress(base64.b64decode(data)))
    assert page["snap"]["events"] == machine.events()[-4:]
    assert page["snap"]["seq"] == machine.seq
    before = RunState()
    for event in machine.events()[:-4]:
        before.fold(event)
    assert page["snap"]["base"] == json.loads(json.dumps(before.data))
    assert page["why"]["text"] == why(machine.record, machine.events()).text()


def test_of_many_records_of_topics_the_newest_are_read_and_each_newest_map(record):
    path = record("run.jsonl")
    newest_events = read_recording(path, newest=2).events
    assert newest_events == read_recording(path).events[-2:]
    pose = {"what": "of a newer program"}
    cells = base64.b64encode(zlib.compress(bytes(6))).decode()
    a_map = {"what": "map", "resolution": 0.5, "width": 3, "height": 2, "origin": [0, 0, 0]}
    a_map["cells"] = cells
    lines = path.read_text().splitlines(keepends=True)
    records = [a_map, *[pose] * 3, a_map, *[pose] * 40]
    observed = [
        json.dumps({"kind": "Observed", "path": "", "stamp_ns": 1, "robot": "", **one}) + "\n"
        for one in records
    ]
    path.write_text("".join([lines[0], *observed, *lines[1:]]))
    whole = read_recording(path)
    assert len(whole.observed) == len(records), whole.wrong
    few = read_recording(path, newest=4)
    assert 4 < len(few.observed) <= 9
    assert few.observed == [whole.observed[4], *whole.observed[-len(few.observed) + 1 :]]


def test_names_that_a_recording_repeats_are_kept_once(record):
    events = read_recording(record("run.jsonl")).events
    texts = {}
    for event in events:
        for text in (*event, event["kind"], event["path"], event.get("outcome")):
            assert texts.setdefault(text, text) is text


def test_a_list_is_a_page_of_the_newest(record, capsys):
    from smachpy.command import main

    for number in range(4):
        path = record(f"{number}.jsonl", failing=number == 1)
        os.utime(path, (1000 * number, 1000 * number))
    folder = str(path.parent)
    assert main(["runs", "list", "--json", "--limit", "2", "--skip", "1", folder]) == 0
    files = [json.loads(line)["file"] for line in capsys.readouterr().out.splitlines()]
    assert [Path(file).name for file in files] == ["2.jsonl", "1.jsonl"]
    assert main(["runs", "list", "--limit", "3", folder]) == 0
    assert "3 of 4 files" in capsys.readouterr().out


def test_old_recordings_are_pruned_except_failures(record, capsys):
    from smachpy.command import main

    paths = [record(f"{name}.jsonl", failing=name == "bad") for name in ("old", "bad", "new")]
    other = paths[0].with_name("other.jsonl")
    other.write_text("no recording\n")
    for path in (*paths[:2], other):
        os.utime(path, (1000, 1000))
    prune = ["runs", "prune", str(paths[0].parent), "--older-than", "1d", "--keep", "failed"]
    assert main(prune) == 0
    assert capsys.readouterr().out.startswith("1 recordings deleted")
    assert sorted(path.name for path in other.parent.glob("*.jsonl")) == [
        "bad.jsonl",
        "new.jsonl",
        "other.jsonl",
    ]
    assert main(prune[:-2]) == 0
    assert sorted(path.name for path in other.parent.glob("*.jsonl")) == [
        "new.jsonl",
        "other.jsonl",
    ]


def test_a_viewer_prunes_again_and_again(record, monkeypatch):
    path = record("one.jsonl")
    path.with_name("other.jsonl").write_text("no recording\n")
    os.utime(path.with_name("other.jsonl"), (1000, 1000))
    monkeypatch.setattr(pruning, "EVERY_S", 0.05)
    texts: queue.Queue[str] = queue.Queue()
    folders = [path.parent, path.parent / "none"]
    with contextlib.closing(pruning.Pruning(folders, 3600.0, "none", texts.put)):
        assert "It is left." in texts.get(timeout=60)
        os.utime(path, (1000, 1000))
        assert texts.get(timeout=60) == "1 old recordings deleted"
        path.with_name("other.jsonl").unlink()
    assert not path.exists()
    assert texts.empty()


def test_a_disk_that_refuses_a_deletion_ends_no_pruning(record, monkeypatch):
    path = record("one.jsonl")
    os.utime(path, (1000, 1000))

    def refuse(_path, **_how):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "unlink", refuse)
    problems = []
    assert pruning.prune_recordings([path], 3600.0, "none", problems.append) == (0, 0)
    assert "Read-only file system" in problems[0]


def test_a_recorder_that_is_late_tells_what_is_missing_too(tmp_path, clock, caplog, monkeypatch):
    machine = make_machine()
    recorder = Recorder(tmp_path / "run.jsonl", machine)
    monkeypatch.setattr(recorder._executor, "join", lambda _seconds: False)
    recorder._buffer.dropped = 17
    recorder.close()
    assert "still being written" in caplog.text
    assert "17 events are missing" in caplog.text
    monkeypatch.undo()
    recorder.close()


def test_a_value_that_json_does_not_take_costs_no_other_event(tmp_path, clock):
    sm = StateMachine(outcomes=["succeeded"], name="JOB")

    def work(userdata):
        userdata.count = 10**5000
        return "succeeded"

    with sm:
        StateMachine.add("A", CBState(work, outcomes=["succeeded"], output_keys=["count"]))
    with Recorder(tmp_path / "run.jsonl", sm) as recorder:
        sm.execute()
    events = read_recording(tmp_path / "run.jsonl").events
    assert [e["kind"] for e in events][-1] == "Finished"
    assert [e["value"] for e in events if "value" in e] == [{"$repr": "<int of 16610 bits>"}]
    assert recorder.dropped == 0


def test_statistics_over_runs(record):
    runs = [read_recording(record(f"{i}.jsonl", failing=i == 2)) for i in range(3)]
    [(_, statistics, _)] = count_by_machine(runs).values()
    assert statistics.runs == 3
    assert statistics.outcomes == {"succeeded": 2, "aborted": 1}
    first = statistics.states["/JOB/FIRST"]
    assert first.outcomes == {"succeeded": 2, "aborted": 1}
    assert first.failures() == pytest.approx(1 / 3)
    assert never_taken(runs[0].record, statistics) == []
    assert quantile([], 0.5) is None
    assert quantile([3.0, 1.0, 2.0], 0.5) == 2.0


def test_a_machine_tells_who_comes_late_and_drops_who_is_too_far_behind(record):
    recording = read_recording(record("run.jsonl"))
    changes = []
    machine = Machine("x", changes.append)
    machine.reset(recording.history() | {"events": recording.events[:4]}, limit=3)
    assert machine.seq == 4
    assert machine.since(4) == []
    assert [json.loads(text)["seq"] for text in machine.since(1)] == [2, 3, 4]
    assert machine.since(0) is None
    assert machine.since(5) is None
    assert machine.add([{**recording.events[5], "seq": 6}]) is False
    assert machine.add(recording.events[:6]) is True
    seq, text = machine.snapshot(short=True)
    assert seq == 6
    assert json.loads(text)["events"] == []
    assert json.loads(text)["base"]["states"]["/JOB"]["visits"] == 1
    assert changes


def a_machine(events, **how):
    machine = Machine("x", lambda _machine: None)
    record = describe(make_machine())
    history = {"epoch": "e", "description": asdict(record), "base": None, "events": events}
    machine.reset(history, **how)
    return machine


def visits(numbers, **more):
    return [
        {"kind": "Entered", "path": "/JOB/FIRST", "t": 0.0, "stamp_ns": n, "seq": n, **more}
        for n in numbers
    ]


def test_after_a_gap_a_page_gets_the_events_by_their_numbers(clock):
    machine = a_machine(visits([*range(1, 101), *range(201, 301)]))
    assert [json.loads(text)["seq"] for text in machine.since(100)] == list(range(201, 301))
    assert [json.loads(text)["seq"] for text in machine.since(150)] == list(range(201, 301))
    machine = a_machine(visits([1, 2, 3, 9, 10]), limit=2)
    assert machine.since(3) == machine.since(5) != []
    assert machine.since(2) is None


def test_events_that_a_machine_dropped_are_not_asked_for(clock):
    machine = a_machine(visits([1, 2]))
    assert machine.add(visits([7], dropped=4))
    assert not machine.add(visits([9]))
    assert machine.active() == ["/JOB/FIRST"]
    assert json.loads(machine.snapshot(short=True)[1])["base"]["dropped"] == 4


def test_a_snapshot_is_of_one_instant(clock, monkeypatch):
    """An event that comes while its text is made is not counted as one that it has."""
    machine = a_machine(visits([1]))

    class Slow:
        def __enter__(self):
            self.lock.acquire()

        def __exit__(self, *_error):
            self.lock.release()
            machine._seq = 2  # as another thread's `add` would, at once

        lock = threading.Lock()

    monkeypatch.setattr(machine, "_lock", Slow())
    number, text = machine.snapshot()
    assert number == json.loads(text)["seq"] == len(json.loads(text)["events"]) == 1


def test_so_much_text_of_events_is_kept(clock, monkeypatch):
    monkeypatch.setattr(machines, "MAX_KEPT_BYTES", 1000)
    machine = a_machine(visits(range(1, 101)))
    assert sum(len(text) for text in machine.since(100 - 5)) < 1000
    assert machine.since(1) is None
    assert (
        json.loads(machine.snapshot(short=True)[1])["base"]["states"]["/JOB/FIRST"]["visits"] == 100
    )


def test_machines_are_listed_when_they_are_known(record):
    machines = Machines()
    machine = machines.obtain("x")
    assert machines.summaries() == []
    machine.reset(read_recording(record("run.jsonl")).history())
    (one,) = machines.summaries()
    assert one["outcome"] == "succeeded"
    assert machines.obtain("x") is machine


def test_the_page_of_a_run_is_one_file_without_addresses(record):
    text = standalone_page(read_recording(record("run.jsonl")))
    assert 'src="' not in text
    assert "http://" not in text.replace("http://www.w3.org", "")
    assert "https://" not in text


def test_runs_are_found_in_folders(record, tmp_path):
    record("b.jsonl")
    record("a.jsonl")
    assert [path.name for path in find_recordings([tmp_path])] == ["a.jsonl", "b.jsonl"]
    with pytest.raises(RecordingError, match="no such"):
        find_recordings([tmp_path / "none"])


def test_a_recording_that_is_named_twice_is_one(record, tmp_path, monkeypatch):
    """Lists had it twice, and statistics counted its run twice."""
    path = record("a.jsonl")
    monkeypatch.chdir(tmp_path)
    places = [tmp_path, path, "a.jsonl", ".", f"../{tmp_path.name}/a.jsonl"]
    assert find_recordings(places) == [path]
    assert [recording.path for recording in each_recording(places)] == [path]


def test_a_recording_that_cannot_begin_leaves_no_file(tmp_path):
    """It left an empty one, beside which the next run could not be recorded either."""

    class Odd(State):
        def __init__(self):
            super().__init__(["done"])

        def describe_details(self):
            raise ZeroDivisionError

    machine = StateMachine(["done"], name="M")
    machine.add("ODD", Odd())
    with pytest.raises(ZeroDivisionError):
        Recorder(tmp_path / "run.jsonl", machine)
    assert list(tmp_path.iterdir()) == []


def test_a_wrong_origin_is_refused_before_the_run(tmp_path):
    """The file was written, and nobody could read it."""
    path = tmp_path / "run.jsonl"
    with pytest.raises(
        RecordingError, match=r"origin: .*inputs\['speed'\]: got 0.5; expected a text"
    ):
        Recorder(path, make_machine(), origin={"inputs": {"speed": 0.5}})
    assert not path.exists()
    with Recorder(path, make_machine(), origin={"inputs": {"speed": "0.5"}}):
        pass
    assert read_recording(path).origin["mission"] == {"inputs": {"speed": "0.5"}}


def test_notes_on_a_recording_outlive_one_of_a_name_like_it(tmp_path):
    """The notes on "run.1" were deleted by the recording of "run.2"."""
    for name in ("run.1", "run.2"):
        with Recorder(tmp_path / name, make_machine()):
            pass
        notes_file(tmp_path / name).write_text("{}")
    assert sorted(path.name for path in tmp_path.glob("*.json")) == [
        "run.1.notes.json",
        "run.2.notes.json",
    ]


def test_the_command_line(record, tmp_path, capsys):
    from smachpy.command import main

    path = str(record("run.jsonl"))
    assert main(["runs", "list", path]) == 0
    assert "succeeded" in capsys.readouterr().out
    assert main(["runs", "show", path]) == 0
    assert "/JOB/FIRST" in capsys.readouterr().out
    assert main(["runs", "compare", path, path]) == 0
    assert "no notable difference" in capsys.readouterr().out
    for name in ("run.html", "run.mcap", "run.txt"):
        assert main(["runs", "export", path, "-o", str(tmp_path / name)]) == 0
        assert (tmp_path / name).stat().st_size > 100
    assert main(["runs", "show", str(tmp_path / "none")]) == 2


def exported(recording, path):
    """(topic, type, content) of all messages of the recording as MCAP."""
    from mcap.reader import make_reader

    from actionlib_core.interfaces import get_message
    from smachpy_viz.runs.mcap import write_mcap

    write_mcap(recording, path)
    with path.open("rb") as file:
        return [
            (c.topic, s.name, get_message(s.name).from_bytes(m.data))
            for s, c, m in make_reader(file).iter_messages()
        ]


def test_mcap_has_the_topics_of_smach_and_of_actions(record, tmp_path):
    from actionlib_core.interfaces.move_base_msgs.msg import (
        MoveBaseFeedback,
        MoveBaseGoal,
        MoveBaseResult,
    )

    recording = read_recording(record("run.jsonl"))
    goal = MoveBaseGoal()
    goal.target_pose.pose.position.x = 2.5
    path, action = "/JOB/FIRST", "robot/move_base"
    events = [
        GoalSent(path, 0.0, 10**9, action, "id", goal),
        GoalFeedback(path, 0.0, 2 * 10**9, action, "id", MoveBaseFeedback()),
        GoalDone(path, 0.0, 3 * 10**9, action, "id", "SUCCEEDED", "there", MoveBaseResult()),
    ]
    recording.events[2:2] = [{**to_record(e), "seq": 0} for e in events]
    messages = exported(recording, tmp_path / "run.mcap")
    found = {topic: (kind, message) for topic, kind, message in messages}
    assert found["/JOB/smach/container_structure"][0] == "smach_msgs/SmachContainerStructure"
    assert "/JOB/smach/container_status" in found
    kind, sent = found["/robot/move_base/goal"]
    assert kind == "move_base_msgs/MoveBaseActionGoal"
    assert sent.goal == goal
    assert (sent.goal_id.id, sent.header.stamp.secs, sent.goal_id.stamp.secs) == ("id", 1, 1)
    kind, told = found["/robot/move_base/feedback"]
    assert kind == "move_base_msgs/MoveBaseActionFeedback"
    assert told.status.status == 1
    kind, told = found["/robot/move_base/result"]
    assert kind == "move_base_msgs/MoveBaseActionResult"
    assert (told.status.status, told.status.text, told.status.goal_id.id) == (3, "there", "id")
    statuses = [m.status_list for topic, _, m in messages if topic == "/robot/move_base/status"]
    assert [[one.status for one in several] for several in statuses] == [[1], [3]]


def test_numbers_that_browsers_do_not_know_are_texts(record):
    path = Path(record("run.jsonl"))
    lines = path.read_text(encoding="utf-8").splitlines()
    told = {
        "kind": "UserdataWritten",
        "path": "/JOB/FIRST",
        "key": "x",
        "value": [math.nan, -math.inf],
    }
    told |= {name: json.loads(lines[1])[name] for name in ("t", "stamp_ns", "seq")}
    path.write_text(f"{lines[0]}\n{json.dumps(told)}\n", encoding="utf-8")
    [event] = read_recording(str(path)).events
    assert event["value"] == ["NaN", "-Infinity"]


def test_mcap_has_the_real_date_of_a_run_in_virtual_time(record, tmp_path):
    from mcap.reader import make_reader

    recording = read_recording(record("run.jsonl"))
    recording.made_ns = 1_795_411_316 * 10**9
    exported(recording, tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as file:
        [told] = make_reader(file).iter_metadata()
    facts = {"machine": recording.record.label, "began": "2026-11-23T05:21:56+00:00"}
    assert (told.name, told.metadata) == ("run", facts)


def test_mcap_has_what_json_has_no_word_for_and_names_what_is_left_out(record, tmp_path, caplog):
    define_action("mcap_test_msgs/Scan", "float32[] ranges\nuint8[] data\nfloat64 x\n---\n---\n")
    from actionlib_core.interfaces import get_message

    goal_type = get_message("mcap_test_msgs/ScanGoal")
    goals = [
        goal_type(ranges=[math.inf, -math.inf, 1.5], data=b"a\x00'\xff", x=math.nan),
        goal_type(ranges=[1.0] * 1001),
        goal_type(data=b"x" * 5000),
        "not a message",
    ]
    recording = read_recording(record("run.jsonl"))
    recording.events += [
        {**to_record(GoalSent("/JOB/FIRST", 0.0, n, "scan", f"g{n}", goal)), "seq": n}
        for n, goal in enumerate(goals, 100)
    ]
    (sent,) = [
        m.goal
        for topic, _, m in exported(recording, tmp_path / "run.mcap")
        if topic == "/scan/goal"
    ]
    assert list(sent.ranges) == [math.inf, -math.inf, 1.5]
    assert bytes(sent.data) == b"a\x00'\xff"
    assert math.isnan(sent.x)
    assert (
        "1 message(s) of /scan/goal are left out: too long to be recorded: <list of" in caplog.text
    )
    assert "too long to be recorded: <bytes of 5000" in caplog.text
    assert "it was recorded as text" in caplog.text


def test_mcap_of_names_that_no_file_in_utf8_can_contain(record, tmp_path):
    path = record("run.jsonl")
    path.write_text(path.read_text().replace("FIRST", "F\\ud800").replace("count", "c\\udfff"))
    messages = exported(read_recording(path), tmp_path / "run.mcap")
    assert "/JOB/userdata/c?" in {topic for topic, _, _ in messages}


def test_mcap_of_a_goal_without_fields_is_counted(record, tmp_path, caplog):
    goal = {"$msg": "move_base_msgs/MoveBaseGoal"}
    path = with_line(record("run.jsonl"), kind="GoalSent", action="a", goal_id="1", goal=goal)
    exported(read_recording(path), tmp_path / "run.mcap")
    assert "1 message(s) of /a/goal are left out" in caplog.text


def test_mcap_leaves_out_what_was_cut(record, tmp_path, caplog):
    fields = "".join(f"uint8[] part{n}\n" for n in range(30))
    definition = f"string text\nuint8[] data\nstring[] words\n{fields}---\n---\n"
    define_action("mcap_test_msgs/Photo", definition)
    from actionlib_core.interfaces import get_message

    goal_type = get_message("mcap_test_msgs/PhotoGoal")
    whole = [
        goal_type(text="loading\u2026", words=["\u2026"]),
        goal_type(text="x" * 4000, data=bytes(990)),
    ]
    cut = [
        goal_type(data=bytes(1001)),
        goal_type(**{f"part{n}": bytes(900) for n in range(30)}, words=["x" * 3000] * 33),
        goal_type(text="x" * 4001),
        goal_type(words=["x" * 3000] * 34, text="loading"),
    ]
    recording = read_recording(record("run.jsonl"))
    recording.events += [
        {**to_record(GoalSent("/JOB/FIRST", 0.0, n, "scan", f"g{n}", goal)), "seq": n}
        for n, goal in enumerate([*whole, *cut], 100)
    ]
    damaged = json.loads(json.dumps(recording.events[-5]))
    damaged["goal"]["fields"]["data"] = {"$bytes": "A"}
    shortened = {**damaged, "goal": {**damaged["goal"], "fields": "<dict of 3 elements>"}}
    recording.events += [damaged, shortened]
    sent = [
        m.goal
        for topic, _, m in exported(recording, tmp_path / "run.mcap")
        if topic == "/scan/goal"
    ]
    assert sent == whole
    for text in ("<bytes of 1001 elements>", "<bytes of 900 elements>", "a text of 4001"):
        assert f"1 message(s) of /scan/goal are left out: too long to be recorded: {text}." in (
            caplog.text
        )
    assert "too long to be recorded: a text of 3000." in caplog.text
    assert "left out: Invalid base64" in caplog.text
    assert "left out: 'str' object" in caplog.text


def test_mcap_does_not_bring_a_goal_back_that_has_ended(record, tmp_path):
    recording = read_recording(record("run.jsonl"))
    path, action = "/JOB/FIRST", "robot/move_base"
    events = [
        GoalSent(path, 0.0, 1, action, "a", None),
        GoalDone(path, 0.0, 2, action, "a", "SUCCEEDED", "", None),
        GoalFeedback(path, 0.0, 3, action, "a", None),
        GoalSent(path, 0.0, 4, action, "b", None),
    ]
    recording.events[2:2] = [{**to_record(e), "seq": 0} for e in events]
    statuses = [
        [(one.goal_id.id, one.status) for one in m.status_list]
        for topic, _, m in exported(recording, tmp_path / "run.mcap")
        if topic == "/robot/move_base/status"
    ]
    assert statuses == [[("a", 1)], [("a", 3)], [("b", 1)]]


def test_progress_of_goals_that_come_as_plain_data():
    from smachpy_viz.live.machines import with_progress

    goals = {"id": SimpleNamespace()}
    goals = {
        "id": {
            "goal": {"$msg": "x/Y", "fields": {}},
            "first_feedback": {"$msg": "x/F", "fields": {"seconds_left": 10}},
        }
    }
    record = {
        "kind": "GoalFeedback",
        "path": "/A",
        "action": "a",
        "goal_id": "id",
        "feedback": {"$msg": "x/F", "fields": {"seconds_left": 4}},
    }
    assert with_progress(record, goals)["progress"]["fraction"] == pytest.approx(0.6)
    assert with_progress({**record, "goal_id": "other"}, goals) == {**record, "goal_id": "other"}


def test_a_folder_with_a_file_that_is_no_recording(record, tmp_path, capsys, caplog):
    from smachpy.command import main

    record("a.jsonl")
    (tmp_path / "empty.jsonl").write_text("")
    assert main(["runs", "list", str(tmp_path)]) == 0
    assert "a.jsonl" in capsys.readouterr().out
    assert "empty.jsonl" in caplog.text
    assert "left out" in caplog.text
    assert StatisticsOfFiles([tmp_path]).of(describe(make_machine()))["runs"] == 1
    assert main(["runs", "list", str(tmp_path / "empty.jsonl")]) == 2


def test_names_with_brackets_are_shown_as_they_are(tmp_path, clock, capsys):
    from smachpy.command import main

    sm = StateMachine(outcomes=["[/red]"], name="M[/x]")
    with sm:
        StateMachine.add("PICK[arm]", CBState(lambda _: "[/red]", outcomes=["[/red]"]))
    with Recorder(tmp_path / "run.jsonl", sm):
        sm.execute()
    assert main(["runs", "show", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "M[/x]: 1 run(s); [/red] x1" in out
    assert "/M[/x]/PICK[arm]" in out
    assert main(["runs", "list", str(tmp_path)]) == 0
    assert "M[/x]" in capsys.readouterr().out


@pytest.mark.parametrize("columns", [20, 80, 400])
def test_the_outcome_of_each_run_is_shown_however_narrow_the_terminal(
    record, tmp_path, capsys, monkeypatch, columns
):
    from smachpy.command import main

    (tmp_path / ("f" * 100)).mkdir()
    path = record(f"{'f' * 100}/run.jsonl")
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert main(["runs", "list", str(path.parent)]) == 0
    shown = capsys.readouterr().out
    assert str(path) in shown
    assert "JOB" in shown
    assert "succeeded" in shown


@pytest.mark.parametrize("name", ["run", "run.xyz", "", ".hidden"])
def test_an_export_of_an_unknown_kind_names_the_kinds_that_there_are(
    record, capsys, monkeypatch, tmp_path, name
):
    from smachpy.command import main

    path = record("run.jsonl")
    monkeypatch.chdir(tmp_path)
    assert main(["runs", "export", str(path), "-o", name]) == 2
    assert "expected html, mcap, or one of dot" in capsys.readouterr().err


@pytest.mark.parametrize(("name", "begins"), [("A.HTML", b"<!doctype"), ("A.Mcap", b"\x89MCAP")])
def test_an_export_knows_extensions_in_capitals(record, tmp_path, name, begins):
    from smachpy.command import main

    path = str(record("run.jsonl"))
    assert main(["runs", "export", path, "-o", str(tmp_path / name)]) == 0
    assert (tmp_path / name).read_bytes().startswith(begins)


@pytest.mark.parametrize("name", ["x.html", "x.mcap"])
def test_an_export_to_nowhere_is_told(record, tmp_path, capsys, name):
    from smachpy.command import main

    path = str(record("run.jsonl"))
    assert main(["runs", "export", path, "-o", str(tmp_path / "none" / name)]) == 2
    assert "none" in capsys.readouterr().err


def test_quantiles_are_those_of_their_definition():
    assert quantile(range(1, 21), 0.95) == 19
    assert quantile([1.0, 2.0], 0.5) == 1.0
    assert quantile([7.0], 0.0) == quantile([7.0], 1.0) == 7.0
    for n in range(1, 200):
        for percent in (5, 50, 95, 100):
            value = quantile(range(1, n + 1), percent / 100)
            assert 100 * value >= percent * n > 100 * (value - 1)


def test_statistics_of_a_machine_that_is_shown_under_another_name(record, tmp_path):
    record("run.jsonl")
    runs = StatisticsOfFiles([tmp_path])
    shown = describe(make_machine(), name="SM_ROOT")
    assert runs.of(shown)["states"]["/SM_ROOT/FIRST"]["visits"] == 1
    assert runs.of(describe(make_machine(extra=True), name="SM_ROOT")) is None
    with pytest.raises(RecordingError, match="no such"):
        StatisticsOfFiles([tmp_path / "none"])


@pytest.mark.slow
def test_counted_runs_are_not_kept(record, tmp_path, monkeypatch):
    from smachpy_viz.runs import statistics

    for name in ("a", "b", "c"):
        record(f"{name}.jsonl")
    seen = []

    def followed(places, *, stream):
        for recording in recording_module.each_recording(places, stream=stream):
            assert sum(events() is not None for events in seen) <= 1  # the one before
            recording.events = Events(recording.events)
            seen.append(weakref.ref(recording.events))
            yield recording

    class Events(list):
        """A list that can be followed."""

    monkeypatch.setattr(statistics, "each_recording", followed)
    runs = StatisticsOfFiles([tmp_path])
    assert runs.of(describe(make_machine()))["runs"] == len(seen) == 3
    assert runs.counted()["JOB"].runs == 3
    gc.collect()
    assert not any(events() is not None for events in seen)


def test_files_of_one_name_are_two_machines(record, tmp_path):
    from smachpy_viz.live.cli import _load

    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        record("1.jsonl").rename(tmp_path / folder / "1.jsonl")
    record("2.jsonl")
    machines = Machines()
    files = [str(tmp_path / "a"), str(tmp_path / "b/1.jsonl"), str(tmp_path / "2.jsonl")]
    _load(machines, files, terminal=False)
    names = [one["name"] for one in machines.summaries()]
    assert names == [str(tmp_path / "a/1.jsonl"), str(tmp_path / "b/1.jsonl"), "2.jsonl"]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--port", "99999"], "got '99999'; expected 0 to 65535"),
        (["--port", "http"], "got 'http'; expected 0 to 65535"),
        (["--runs", "/nonexistent"], "no such file or folder"),
        (["--tui"], "got no terminal"),  # pytest's input and output are none
    ],
)
def test_a_viewer_that_cannot_be_started_says_why(words, text, capsys):
    from smachpy.command import main

    try:
        code = main(["view", *words])
    except SystemExit as error:
        code = error.code
    assert code == 2
    assert text in capsys.readouterr().err


def ask(app, path, query=""):
    """Status and body of the answer to a GET."""
    sent = []

    async def run():
        done = asyncio.Event()

        async def receive():
            await done.wait()
            return {"type": "http.disconnect"}

        async def send(message):
            sent.append(message)

        await app(
            {
                "type": "http",
                "method": "GET",
                "path": path,
                "query_string": query.encode(),
                "headers": [(b"host", b"127.0.0.1")],
                "scheme": "http",
                "server": ("127.0.0.1", 80),
            },
            receive,
            send,
        )
        done.set()

    asyncio.run(run())
    return sent[0]["status"], b"".join(message.get("body", b"") for message in sent).decode()


def test_half_a_pair_of_utf16_in_a_name_and_odd_addresses(record, tmp_path):
    from smachpy_viz.live.app import Viewer

    machines = Machines()
    history = read_recording(record("run.jsonl")).history()
    history["description"]["label"] = "JOB \udc80"
    machines.obtain("x").reset(history)

    def fails(record):
        raise RecordingError("r.jsonl", "it is gone")

    app = Viewer(machines, statistics=fails).app
    status, text = ask(app, "/api/model", "machine=x")
    assert status == 200
    assert json.loads(text)["explicit"]["label"] == "JOB \udc80"
    assert ask(app, "/api/export", "machine=x")[0] == 200
    assert ask(app, "/\0")[0] == 404
    status, text = ask(app, "/api/statistics", "machine=x")
    assert status == 503
    assert "it is gone" in text


def test_what_a_monitor_finds_is_no_failure_and_retries_are_counted():
    from smachpy.events.introspection import StateRecord

    outcomes = ("invalid", "valid")
    children = (
        StateRecord("/TOP/WATCH", "WATCH", "monitor", "MonitorState", outcomes),
        StateRecord("/TOP/WORK", "WORK", "state", "State", outcomes),
    )
    record = StateRecord("/TOP", "TOP", "machine", "StateMachine", ("done",), children=children)
    events = []
    for path in ("/TOP/WATCH", "/TOP/WORK"):
        kinds = [("Entered", {}), ("Retried", {"attempt": 1, "reason": "invalid"})]
        kinds += [("Left", {"outcome": "invalid"}), ("Entered", {}), ("Failed", {"error": "E: x"})]
        events += [
            {"kind": kind, "path": path, "stamp_ns": n, "t": 0.0, **facts}
            for n, (kind, facts) in enumerate(kinds)
        ]
    statistics = Statistics()
    statistics.add(events, record)
    told = statistics.to_json()["states"]
    assert {path: one["failures"] for path, one in told.items()} == {
        "/TOP/WATCH": 0.5,  # it raised once
        "/TOP/WORK": 1.0,
    }
    assert [one["retries"] for one in told.values()] == [1, 1]


def test_lists_and_statistics_for_programs(tmp_path, capsys):
    from smachpy import CBState, StateMachine
    from smachpy.command import main

    sm = StateMachine(outcomes=["done"], name="TOP")
    with sm:
        sm.add("A", CBState(lambda _: "ok", outcomes=["ok", "no"]), {"ok": "done", "no": "done"})
    path = tmp_path / "run.jsonl"
    with Recorder(path, sm):
        sm.execute()
    assert main(["runs", "list", "--json", str(tmp_path)]) == 0
    (one,) = map(json.loads, capsys.readouterr().out.splitlines())
    assert (one["file"], one["machine"], one["outcome"]) == (str(path), "TOP", "done")
    assert main(["runs", "show", "--json", str(path)]) == 0
    (told,) = map(json.loads, capsys.readouterr().out.splitlines())
    assert told["states"]["/TOP/A"]["outcomes"] == {"ok": 1}
    assert told["never_taken"] == [["/TOP/A", "no"]]


def test_a_page_takes_the_floor_from_a_file_where_the_run_has_none(record, capsys, tmp_path):
    from smachpy.command import main
    from smachpy.places.maps import OFFICE_MAP

    run, page = str(record("run.jsonl")), str(tmp_path / "run.html")
    assert main(["runs", "export", run, "-o", page, "--map", str(OFFICE_MAP)]) == 0
    assert main(["runs", "export", run, "-o", page, "--map", str(tmp_path / "none.yaml")]) == 2
    assert "none.yaml" in capsys.readouterr().err
    assert main(["view", "--map", run]) == 2
