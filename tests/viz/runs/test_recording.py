"""Recordings: written as a run happens, readable whatever happened."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest

from smachpy import CBState, StateMachine, describe
from viz.live.machines import Machine, Machines
from viz.runs.html import standalone_page
from viz.runs.recording import Recorder, RecordingError, find_recordings, read_recording
from viz.runs.statistics import count, never_taken, quantile


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


def test_statistics_over_runs(record):
    runs = [read_recording(record(f"{i}.jsonl", failing=i == 2)) for i in range(3)]
    statistics = count(runs)
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
    assert machine.add([{**recording.events[5], "seq": 6}]) is False
    assert machine.add(recording.events[:6]) is True
    seq, text = machine.snapshot(short=True)
    assert seq == 6
    assert json.loads(text)["events"] == []
    assert json.loads(text)["base"]["states"]["/JOB"]["visits"] == 1
    assert changes


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


def test_the_command_line(record, tmp_path, capsys):
    from smachpy.cli import main

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


def test_mcap_has_the_topics_of_smach_and_of_actions(record, tmp_path):
    from mcap.reader import make_reader

    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
    from smachpy.events import GoalSent, to_record
    from viz.runs.mcap import write_mcap

    recording = read_recording(record("run.jsonl"))
    goal = MoveBaseGoal()
    goal.target_pose.pose.position.x = 2.5
    sent = to_record(GoalSent("/JOB/FIRST", 0.0, 5, "robot/move_base", "id", goal))
    recording.events.insert(2, {**sent, "seq": 3})
    write_mcap(recording, tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as file:
        found = {c.topic: (s.name, m.data) for s, c, m in make_reader(file).iter_messages()}
    assert found["/JOB/smach/container_structure"][0] == "smach_msgs/SmachContainerStructure"
    assert "/JOB/smach/container_status" in found
    name, data = found["/robot/move_base/goal"]
    assert name == "move_base_msgs/MoveBaseGoal"
    assert MoveBaseGoal.from_bytes(data) == goal


def test_progress_of_goals_that_come_as_plain_data():
    from viz.live.progress import annotate

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
    assert annotate(record, goals)["progress"]["fraction"] == pytest.approx(0.6)
    assert annotate({**record, "goal_id": "other"}, goals) == {**record, "goal_id": "other"}
