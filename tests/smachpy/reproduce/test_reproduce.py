"""Recorded runs that are run again: the same, or the first difference."""

from __future__ import annotations

import json
import os as ENVIRONMENT
import random
import re
import subprocess
import sys
import tempfile
import uuid
import warnings
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

import smachpy
from actionlib_core.clock import current_clock
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy import CBState, StateMachine
from smachpy.command import main
from smachpy.events.introspection import describe
from smachpy.events.recording import Recorder, read_recording
from smachpy.reproduce.compare import Said, compare, odd_verdicts, steps_of
from smachpy.reproduce.report import lines_of
from smachpy.reproduce.run import ReproductionError, reproduce
from smachpy.reproduce.world import world_of
from smachpy.states import Wait
from smachpy.testing import mission_kit
from tests.smachpy.reproduce.random_missions import Plan, plans


def recorded(plan: Plan, folder: Path):
    path = folder / "run.jsonl"
    with mission_kit() as kit, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a preempt after the end of the run
        plan.play(kit)
        machine = plan.machine()
        with Recorder(path, machine):
            kit(machine)
    return read_recording(path)


@pytest.mark.slow
@settings(
    max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
@given(plan=plans())
def test_random_machines_among_random_servers_are_reproduced(plan):
    with tempfile.TemporaryDirectory() as folder:
        recording = recorded(plan, Path(folder))
        found = reproduce(recording, make=plan.machine)
        assert found.comparison.difference is None, (found.comparison.difference, found.notes)
        assert found.comparison.same == found.comparison.total > 0


def test_a_goal_that_is_sent_as_the_server_dies_does_not_outlive_it(tmp_path):
    """It was taken for one that did: the server was cut off, and its first goal hung."""
    plan = Plan((("drive", 1, 1), ("drive", -1, -1)), (("die", 0.213),), (), (), None)
    found = reproduce(recorded(plan, tmp_path), make=plan.machine)
    assert found.is_same, lines_of(found)


def test_a_message_comes_again_that_was_like_one_before_its_subscriber(tmp_path):
    """It was taken for that one, of which two subscribers had got a copy."""
    states = (("watch", -1, 1), ("watch", -1, -1))
    plan = Plan(states, (), (), ((1.0, 9), (1.2, 3), (1.4, 9)), None)
    recording = recorded(plan, tmp_path)
    assert [act.t for act in world_of(recording).acts] == [1.0, 1.2, 1.4]
    assert reproduce(recording, make=plan.machine).is_same


MISSION = """
import smachpy
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from smachpy import CBState, Concurrence, MonitorState, SimpleActionState, StateMachine

LOW = 0.30


def is_good(_, state):
    return state.percentage > LOW


def note(userdata):
    userdata.trips = userdata.trips + 1
    return "noted"


def mission() -> StateMachine:
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="ROUND", userdata={"trips": 0})
    with sm:
        visit = Concurrence(
            ["succeeded", "aborted", "preempted", "low"],
            default_outcome="aborted",
            child_termination_cb=lambda ended: True,
            outcome_map={"succeeded": {"DRIVE": "succeeded"}, "low": {"WATCH": "invalid"}},
        )
        with visit:
            visit.add("DRIVE", SimpleActionState("move_base", MoveBaseAction, exec_timeout=60.0))
            visit.add("WATCH", MonitorState("battery", BatteryState, is_good))
        sm.add("VISIT", visit, {"low": "HOME", "aborted": "HOME", "succeeded": "NOTE"})
        sm.add(
            "NOTE",
            CBState(note, outcomes=["noted"], input_keys=["trips"], output_keys=["trips"]),
            {"noted": "HOME"},
        )
        sm.add("HOME", SimpleActionState("move_base", MoveBaseAction), {"aborted": "aborted"})
    return sm
"""


FRAMED = """SimpleActionState(
            "move_base",
            MoveBaseAction,
            goal_cb=lambda _, goal: setattr(goal.target_pose.header, "frame_id", "odom"),
        ), {"""


@pytest.fixture
def night(tmp_path, monkeypatch):
    """A mission in a file, and the recording of a run in which the battery got low."""
    file = tmp_path / "night.py"
    file.write_text(MISSION)
    monkeypatch.syspath_prepend(str(tmp_path))
    # A test that imports the mission takes cached bytecode if it has changed within a second.
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    path = tmp_path / "incident.jsonl"
    with mission_kit() as kit:
        robot = kit.action_server("move_base", MoveBaseAction)
        robot.never_finish()
        robot.reply(status="aborted", duration=31.2, text="the door is shut")
        battery = kit.topic("battery", BatteryState)
        battery.publish_at(5.0, percentage=0.8)
        battery.publish_at(32.4, percentage=0.29)
        from smachpy.command.targets import load_target

        machine = load_target(str(file)).build()
        with Recorder(path, machine, origin={"target": str(file)}):
            kit(machine)
    return file, path


def test_the_same_code_does_the_same(night, capsys):
    _, path = night
    assert main(["runs", "reproduce", str(path), f"--allow={path.parent}"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("ROUND: the same 15 of 15 events, 63 s in ")


EVIL = """
import pathlib
pathlib.Path(__file__).with_name("executed").touch()
def mission():
    ...
"""


@pytest.mark.parametrize(
    "target", ["subprocess:getoutput", "FOLDER/evil.py", "evil", "evil:mission"]
)
def test_a_recording_runs_no_code_that_nobody_allowed(night, capsys, target):
    """It comes from anybody: what it names was imported, and called with its words."""
    file, path = night
    (file.parent / "evil.py").write_text(EVIL)
    header, *rest = path.read_text().splitlines(keepends=True)
    data = json.loads(header)
    there = target.replace("FOLDER", str(file.parent))
    data["origin"]["mission"] |= {"target": there, "words": [f"touch {file.parent}/executed"]}
    path.write_text(json.dumps(data) + "\n" + "".join(rest))
    for more in ([], ["-o", str(file.with_name("test_x.py"))]):
        assert main(["runs", "reproduce", str(path), *more]) == 2
        assert "a recording names it; expected" in "".join(capsys.readouterr())
        assert not (file.parent / "executed").exists()


def test_a_recording_names_a_mission_and_nothing_else_of_an_allowed_place(night, capsys):
    file, path = night
    path.write_text(path.read_text().replace(str(file), f"{file}:visit"))
    file.write_text(f"{MISSION}\ndef visit(*words):\n    raise SystemExit('called')\n")
    assert main(["runs", "reproduce", str(path), f"--allow={file}"]) == 2
    assert "expected a mission" in capsys.readouterr().out


MUTATIONS = [
    # what is changed, at which step the first effect is, and a word of what is said
    ("LOW = 0.30", "LOW = 0.25", 32.4, "WATCH  invalid", "goes on", ".LOW is 0.25 now, was 0.3"),
    ('"low": "HOME", "ab', '"low": "aborted", "ab', 32.4, "HOME  begins", "ends: aborted", "VISIT"),
    (
        '{"aborted": "aborted"}',
        '{"aborted": "succeeded"}',
        63.6,
        "ends: aborted",
        "ends: succeeded",
        "HOME",
    ),
    (
        "exec_timeout=60.0",
        "exec_timeout=20.0",
        20.0,
        "to stop (concurrence)",
        "DRIVE",
        "exec_timeout: 20 s",
    ),
    ('MonitorState("battery"', 'MonitorState("akku"', 32.4, "WATCH  invalid", "goes on", "topic"),
    ('"trips": 0', '"trips": 7', None, "", "", ""),
]


@pytest.mark.parametrize(("old", "new", "at", "then", "now", "said"), MUTATIONS)
def test_a_change_is_found_at_its_first_effect(night, capsys, old, new, at, then, now, said):
    file, path = night
    assert old in MISSION
    file.write_text(MISSION.replace(old, new))
    code = main(["runs", "reproduce", str(path), f"--allow={path.parent}"])
    out = capsys.readouterr().out
    if at is None:  # a change without an effect in this run
        assert code == 0, out
        return
    assert code == 1, out
    assert f"differs at 00:{at:04.1f}" in out or f"differs at 01:{at - 60:04.1f}" in out, out
    recorded = next(line for line in out.splitlines() if line.startswith("  recorded"))
    present = next(line for line in out.splitlines() if line.startswith("  now"))
    assert then in recorded
    assert now in present
    assert any(said in line for line in out.splitlines() if line.startswith("  changed: ")), out


@pytest.mark.parametrize("name", ["HOME", "VISIT/WATCH", "goals", "trips"])
def test_what_may_differ_is_left_out(night, name, capsys):
    file, path = night
    changes = {
        "HOME": ('SimpleActionState("move_base", MoveBaseAction), {', FRAMED),
        "goals": ('SimpleActionState("move_base", MoveBaseAction), {', FRAMED),
    }
    old, new = changes.get(name, ("LOW = 0.30", "LOW = 0.25"))
    file.write_text(MISSION.replace(old, new))
    code = main(["runs", "reproduce", str(path), f"--allow={path.parent}", "--tolerate", name])
    assert code == (0 if name in changes else 1), capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("HOEM", "no state and no key is called 'HOEM'. Did you mean 'HOME'?"),
        ("gaols", "no state and no key is called 'gaols'. Did you mean 'goals'?"),
        ("HOME", ""),
        ("VISIT/WATCH", ""),
        ("errors", ""),
        ("trips", ""),
    ],
)
def test_a_name_of_nothing_that_may_differ_is_told(night, name, said, capsys):
    _, path = night
    assert main(["runs", "reproduce", str(path), f"--allow={path.parent}", "--tolerate", name]) == 0
    out = capsys.readouterr().out
    assert out.count("note: tolerate: ") == (1 if said else 0)
    assert said in out


def test_a_test_that_reads_its_recording_may_be_moved_with_it(night, monkeypatch, tmp_path, capsys):
    """It named the recording and the mission by the folders of the computer that wrote it."""
    file, path = night
    monkeypatch.setattr("smachpy.reproduce.written._Trial.holds", lambda _trial, _script: False)
    (tmp_path / "tests").mkdir()
    test = tmp_path / "tests" / "test_it.py"
    words = [str(path), f"--allow={path.parent}", "-o", str(test)]
    assert main(["runs", "reproduce", *words]) == 0
    assert "the test reads the recording" in capsys.readouterr().out
    assert str(tmp_path) not in test.read_text()
    moved = tmp_path / "elsewhere"
    (moved / "tests").mkdir(parents=True)
    for one in (file, path, test):
        one.rename(moved / one.relative_to(tmp_path))
    names = {"__file__": str(moved / "tests" / "test_it.py")}
    exec(Path(names["__file__"]).read_text(), names)
    names["test_round_as_recorded"]()


@pytest.mark.parametrize(
    ("seconds", "is_same"), [("2.0", True), ("2.4", True), ("3.5", False), ("0.5", True)]
)
def test_a_state_that_sleeps_longer_than_recorded_differs(tmp_path, monkeypatch, seconds, is_same):
    """One that takes less time does not: its code itself took time on the robot."""
    file, path = tmp_path / "nap.py", tmp_path / "nap.jsonl"
    file.write_text(NAP)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    with mission_kit() as kit:
        from smachpy.command.targets import load_target

        machine = load_target(str(file)).build()
        with Recorder(path, machine, origin={"target": str(file)}):
            kit(machine)
    file.write_text(NAP.replace("sleep(2.0)", f"sleep({seconds})"))
    found = reproduce(read_recording(path), allow=[path.parent])
    assert found.is_same == is_same, found.comparison
    if not is_same:
        difference = found.comparison.difference
        assert difference.recorded == "NAP  done after 2.0 s"
        assert difference.now == f"NAP  done after {seconds} s"
        assert "module nap has changed" in found.changed
        assert reproduce(
            read_recording(path), allow=[path.parent], tolerate=["NAP", "AGAIN"]
        ).is_same


NAP = """
import smachpy


class Nap(smachpy.State):
    def __init__(self):
        super().__init__(["done"])

    def execute(self, userdata):
        self.sleep(2.0)
        return "done"


def mission():
    sm = smachpy.StateMachine(["done", "preempted"], name="REST")
    with sm:
        sm.add("NAP", Nap(), {"done": "AGAIN"})
        sm.add("AGAIN", Nap(), {"done": "done"})
    return sm
"""


def test_a_folder_has_a_report_for_ci_whatever_the_number_of_processes(night, tmp_path, capfd):
    _, path = night
    folder = tmp_path / "runs"
    folder.mkdir()
    for name in ("a", "b", "c"):
        (folder / f"{name}.jsonl").write_bytes(path.read_bytes())
    (folder / "cut.jsonl").write_bytes(path.read_bytes()[:9_000])
    texts = []
    for jobs in ("1", "2"):
        report = tmp_path / f"{jobs}.xml"
        arguments = [str(folder), "--jobs", jobs, "--junit", str(report), "--json"]
        assert main(["runs", "reproduce", f"--allow={path.parent}", *arguments]) in {0, 1, 2}
        lines = capfd.readouterr().out.splitlines()
        found = [json.loads(line) for line in lines]
        assert [one["file"].rpartition("/")[2] for one in found] == [
            "a.jsonl",
            "b.jsonl",
            "c.jsonl",
            "cut.jsonl",
        ]
        texts.append([(one["result"], one["same"], one["events"]) for one in found])
        assert report.read_text().count("<testcase") == 4
    assert texts[0] == texts[1]
    assert texts[0][0] == ("same", 15, 15)


def test_a_recording_that_ends_early_is_reproduced_up_to_there(night):
    _, path = night
    lines = path.read_bytes().splitlines(keepends=True)
    last = next(n for n, line in enumerate(lines) if b'"Left"' in line and b'"invalid"' in line)
    path.write_bytes(b"".join(lines[: last + 1]) + lines[last + 1][:20])
    found = reproduce(read_recording(path), allow=[path.parent])
    assert found.is_same, found.comparison
    assert found.comparison.total == 6
    assert "the run is recorded up to 32.4 s, where the file is cut off" in found.notes


def test_a_gap_ends_the_reproduction(night):
    _, path = night
    lines = path.read_bytes().splitlines(keepends=True)
    at = next(n for n, line in enumerate(lines) if b'"Left"' in line and b'"invalid"' in line)
    event = json.loads(lines[at]) | {"dropped": 3}
    path.write_bytes(b"".join([*lines[:at], json.dumps(event).encode() + b"\n", *lines[at + 1 :]]))
    found = reproduce(read_recording(path), allow=[path.parent])
    assert found.is_same
    assert any("where 3 events are missing" in note for note in found.notes)


def test_lines_that_are_lost_are_a_gap(night):
    """The first difference was where the file had lost a line, as if the mission were another."""
    _, path = night
    lines = path.read_bytes().splitlines(keepends=True)
    at = next(n for n, line in enumerate(lines) if b'"Left"' in line and b'"invalid"' in line)
    path.write_bytes(b"".join(lines[:at] + lines[at + 1 :]))
    recording = read_recording(path)
    assert recording.dropped == 1
    found = reproduce(recording, allow=[path.parent])
    assert found.is_same
    assert any("where 1 events are missing" in note for note in found.notes)


def changed_header(path, **facts):
    header, *rest = path.read_text().splitlines(keepends=True)
    path.write_text(json.dumps(json.loads(header) | facts) + "\n" + "".join(rest))


def changed_origin(path, **facts):
    data = json.loads(path.read_text().partition("\n")[0])
    changed_header(path, origin=data["origin"] | facts)


def cut(path, size):
    path.write_bytes(path.read_bytes()[:size])


WRONG = [
    (lambda path: changed_header(path, version=2, machine={"new": 1}), "of a newer smachpy"),
    (lambda path: changed_header(path, origin=5), "line 1: got a wrong header ($.origin: got 5;"),
    (lambda path: changed_origin(path, code=None), r"($.origin.code: got None; expected an object"),
    (lambda path: changed_origin(path, code={"constants": {"a": 5}}), r"constants['a']: got 5;"),
    (lambda path: changed_origin(path, code={"files": []}), "$.origin.code.files: got a list of 0"),
    (lambda path: changed_origin(path, mission={"seed": "x"}), "$.origin.mission.seed: got 'x'"),
    (lambda path: changed_origin(path, namespace="a b//"), "line 1: origin: invalid namespace"),
    (lambda path: cut(path, 300), "line 1, which is cut off: got no header"),
    (lambda path: cut(path, 0), "line 1: got an empty file; expected a file of"),
    (lambda path: path.write_bytes(bytes(range(256)) * 9), "line 1: got no header"),
    (
        lambda path: path.write_text(path.read_text().replace('"/ROUND', '"/OTHER')),
        "it is of the machine 'OTHER'; expected one of 'ROUND'",
    ),
    (
        lambda path: path.write_text(path.read_text().replace('"path": "/ROUND', '"path": "/O', 1)),
        "it is of the machine 'O' and 'ROUND'",
    ),
]


@pytest.mark.parametrize(("harm", "said"), WRONG, ids=[said for _, said in WRONG])
def test_what_is_wrong_with_a_recording_is_one_line(night, capsys, harm, said):
    _, path = night
    harm(path)
    assert main(["runs", "reproduce", str(path), f"--allow={path.parent}"]) == 2
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1
    assert said in lines[0]
    assert lines[0].count(str(path)) == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["/dev/null"], "recording '/dev/null': got a device or a pipe; expected recorded runs."),
        (["FOLDER"], "FOLDER: got no recordings; expected *.jsonl files."),
        (["/dev/null", "-o", "test_x.py"], "recording '/dev/null': line 1: got an empty file;"),
        (["FOLDER", "-o", "test_x.py"], "-o: got the folder 'FOLDER'; expected one recording."),
    ],
)
def test_a_place_that_is_no_recording_is_told_as_what_it_is(words, said, tmp_path, capsys):
    folder = str(tmp_path)
    words = [word.replace("FOLDER", folder) for word in words]
    assert main(["runs", "reproduce", *words]) == 2
    assert said.replace("FOLDER", folder) in capsys.readouterr().err


def test_a_recording_of_another_computer_says_what_is_another_there(night, tmp_path, capsys):
    """Its folder does not exist here, its Python is older; neither makes another run."""
    file, path = night
    data = json.loads(path.read_text().partition("\n")[0])["origin"]
    code = data["code"] | {"versions": {"python": "3.9.1"}, "commit": "1234567890abcdef"}
    mission = data["mission"] | {"folder": "/home/robot/nowhere"}
    changed_origin(path, code=code, mission=mission)
    command = ["runs", "reproduce", str(path), f"--allow={path.parent}"]
    assert main(command) == 0
    assert len(capsys.readouterr().out.splitlines()) == 1
    file.write_text(MISSION.replace("LOW = 0.30", "LOW = 0.25"))
    assert main(command) == 1
    changed = [line for line in capsys.readouterr().out.splitlines() if "  changed: " in line]
    assert "night.LOW is 0.25 now, was 0.3" in changed[0]
    assert any("python is" in line and "was 3.9.1" in line for line in changed)
    assert any("was 1234567890" in line for line in changed)


def with_much_data(path, megabytes):
    """Put messages of a topic between the events of a recording."""
    header, *lines = path.read_text().splitlines(keepends=True)
    at = next(n for n, line in enumerate(lines) if '"status"' in line)
    began = json.loads(lines[at])
    size, count = 9_000, megabytes * 110
    with path.open("w") as file:
        file.writelines([header, *lines[: at + 1]])
        for number in range(count):
            message = {
                **began,
                "t": began["t"] + number / count,
                "what": "message",
                "name": "chatter",
                "type": "std_msgs/String",
                "key": "a subscriber",
                "value": {
                    "$msg": "std_msgs/String",
                    "fields": {"data": f"{number} {'x' * size}"},
                },
            }
            file.write(json.dumps(message) + "\n")
        file.writelines(lines[at + 1 :])


@pytest.mark.slow
def test_a_recording_of_100_mb_is_reproduced(night, capsys):
    _, path = night
    with_much_data(path, 100)
    assert path.stat().st_size > 100_000_000
    command = ["runs", "reproduce", str(path), f"--allow={path.parent}"]
    assert main(command) == 0
    assert capsys.readouterr().out.startswith("ROUND: the same 15 of 15 events, 63 s in ")
    with path.open("rb+") as file:
        file.truncate(path.stat().st_size // 2)
    assert main(command) == 0
    first, note = capsys.readouterr().out.splitlines()
    assert re.match(r"ROUND: the same (\d+) of \1 events, ", first)
    assert note.endswith("where the file is cut off")
    path.unlink()  # pytest keeps the folders of the last tests


def test_a_recording_that_is_too_large_is_one_line(night, capsys):
    _, path = night
    with path.open("rb+") as file:
        file.truncate(2_000_000_000)  # a hole, which takes no room on the disk
    assert main(["runs", "reproduce", str(path), f"--allow={path.parent}"]) == 2
    (line,) = capsys.readouterr().out.splitlines()
    assert "got 2,000,000,000 bytes; expected at most 1,000,000,000" in line


def test_a_recording_does_not_say_where_modules_are(night, tmp_path, capsys):
    """With --allow night, the module of its own folder was run, whoever had sent both."""
    _, path = night
    evil = tmp_path / "evil"
    evil.mkdir()
    (evil / "nocturne.py").write_text(EVIL)
    data = json.loads(path.read_text().partition("\n")[0])
    facts = data["origin"]["mission"] | {"target": "nocturne:mission", "folder": str(evil)}
    changed_origin(path, mission=facts)
    assert main(["runs", "reproduce", str(path), "--allow", "nocturne"]) == 2
    assert not (evil / "executed").exists()
    assert str(evil) not in sys.path


def test_no_test_is_written_of_a_mission_that_cannot_be_made(night, tmp_path, capsys):
    _, path = night
    data = json.loads(path.read_text().partition("\n")[0])
    changed_origin(path, mission=data["origin"]["mission"] | {"words": ["--password=<secret>"]})
    output = tmp_path / "test_it.py"
    command = ["runs", "reproduce", str(path), f"--allow={path.parent}", "-o", str(output)]
    assert main(command) == 2
    assert "it was begun with a secret" in capsys.readouterr().err
    changed_origin(path, mission=data["origin"]["mission"] | {"words": ["one", "too", "many"]})
    assert main(command) == 2
    assert "got 3 more than it takes" in capsys.readouterr().err
    assert not output.exists()


def test_secrets_of_a_recording_are_no_values(tmp_path):
    """The mission was run with the password "<secret>"."""
    seen = []

    def look(userdata):
        seen.append((userdata.password, smachpy.once("token", lambda: "mine")))
        return "done"

    def make():
        sm = StateMachine(["done"], name="LOGIN", userdata={"password": "sesame"})
        sm.add("GO", CBState(look, outcomes=["done"], input_keys=["password"]))
        return sm

    machine = make()
    with mission_kit() as kit, Recorder(tmp_path / "run.jsonl", machine):
        kit(machine)
    found = reproduce(read_recording(tmp_path / "run.jsonl"), make=make)
    assert found.is_same, lines_of(found)
    assert seen == [("sesame", "mine")] * 2
    assert any("once 'token': it has a secret" in note for note in found.notes)


def test_older_recordings_say_what_they_lack(night, capsys):
    _, path = night
    header, *rest = path.read_text().splitlines(keepends=True)
    old = {key: value for key, value in json.loads(header).items() if key != "origin"}
    path.write_text(
        json.dumps(old) + "\n" + "".join(line for line in rest if '"Crossed"' not in line)
    )
    assert main(["runs", "reproduce", str(path), f"--allow={path.parent}"]) == 2
    out = capsys.readouterr().out
    assert "it has no inputs" in out
    assert len(out.splitlines()) == 1


def test_a_mission_that_is_gone_is_one_line(night, capsys):
    file, path = night
    file.unlink()
    assert main(["runs", "reproduce", str(path), f"--allow={path.parent}"]) == 2
    assert len(capsys.readouterr().out.splitlines()) == 1


def test_a_recording_of_a_program_needs_to_know_the_mission(night, tmp_path):
    file, path = night
    header, *rest = path.read_text().splitlines(keepends=True)
    data = json.loads(header)
    data["origin"]["mission"] = {}
    path.write_text(json.dumps(data) + "\n" + "".join(rest))
    with pytest.raises(ReproductionError, match="Try --mission"):
        reproduce(read_recording(path), allow=[path.parent])
    assert reproduce(read_recording(path), mission=str(file)).is_same


def test_a_changed_goal_shows_both(night):
    file, path = night
    file.write_text(MISSION.replace('SimpleActionState("move_base", MoveBaseAction), {', FRAMED))
    text = "\n".join(lines_of(reproduce(read_recording(path), allow=[path.parent])))
    assert "HOME  sends move_base" in text
    assert "odom" in text


def make_asking():
    from smachpy.states import AskOperator

    sm = StateMachine(["done", "preempted"], name="ASKS")
    with sm:
        ask = AskOperator("Go on?", answers=["yes", "no"], patience=30.0)
        sm.add("ASK", ask, {"yes": "WORK", "no": "done", "no_answer": "done"})
        sm.add("WORK", CBState(lambda _: "done", outcomes=["done"]))
    return sm


def test_answers_and_commands_of_operators_come_again(tmp_path):
    path = tmp_path / "run.jsonl"
    with mission_kit() as kit:
        machine = make_asking()

        def answer():
            from smachpy.states.questions import find_questions, give_answer

            kit.clock.sleep(7.0)
            machine.control.pause()
            [question] = find_questions(node=kit.node)
            give_answer(question.service, "yes", "Ada", node=kit.node)
            kit.clock.sleep(3.0)
            machine.control.resume()

        kit.clock.spawn(answer, name="operator")
        with Recorder(path, machine):
            kit(machine)
    recording = read_recording(path)
    kinds = [event["kind"] for event in recording.events]
    assert "Paused" in kinds
    found = reproduce(recording, make=make_asking)
    assert found.is_same, lines_of(found)
    assert found.outcome == "done"
    again = [event["kind"] for event in found.events]
    assert again == kinds


def driving_and_waiting():
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="DRIVES")
    with sm:
        drive = smachpy.SimpleActionState("move_base", MoveBaseAction)
        sm.add("DRIVE", drive, {"succeeded": "WAIT"})
        sm.add("WAIT", Wait(1.0), {"done": "succeeded"})
    return sm


def test_a_run_is_paused_again_after_feedback_that_only_the_page_shows(tmp_path):
    """The feedback is recorded and does not come again: the run was never paused."""
    path = tmp_path / "run.jsonl"
    with mission_kit() as kit:
        robot = kit.action_server("move_base", MoveBaseAction)
        robot.reply(duration=3.0, feedback=[{}, {}])
        machine = driving_and_waiting()
        kit.trigger(lambda _: machine.control.pause(), at=2.0)
        kit.trigger(lambda _: machine.control.resume(), at=7.0)
        with Recorder(path, machine):
            kit(machine)
    found = reproduce(read_recording(path), make=driving_and_waiting)
    assert found.is_same, lines_of(found)
    assert [one["t"] for one in found.events if one["kind"] == "Resumed"] == [pytest.approx(7.0)]


def driving_home():
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="DRIVES")
    with sm:
        both = smachpy.Concurrence(
            ["succeeded", "aborted", "preempted"],
            default_outcome="aborted",
            outcome_map={"preempted": {"DRIVE": "preempted"}},
        )
        with both:
            both.add("DRIVE", smachpy.SimpleActionState("move_base", MoveBaseAction))
            both.add("LIFT", smachpy.SimpleActionState("lift", MoveBaseAction))
        sm.add("BOTH", both, {"preempted": "HOME"})
        sm.add("HOME", smachpy.SimpleActionState("move_base", MoveBaseAction))
    return sm


@pytest.mark.parametrize("reason", ["SIGTERM", "requested", ""])
def test_a_signal_and_the_end_of_a_program_ask_once_again(tmp_path, reason):
    path = tmp_path / "run.jsonl"
    with mission_kit() as kit:
        kit.action_server("lift", MoveBaseAction).never_finish()
        robot = kit.action_server("move_base", MoveBaseAction)
        robot.never_finish()
        robot.reply(duration=3.0)
        if reason:
            kit.trigger(lambda _: kit.shutdown.request(reason), at=2.0)
        else:
            kit.interrupt(at=2.0)
        machine = driving_home()
        with Recorder(path, machine):
            assert kit(machine).outcome == "succeeded"
    recording = read_recording(path)
    found = reproduce(recording, make=driving_home)
    assert found.is_same, lines_of(found)
    asked = [
        [(e["path"], e["source"], e["by"]) for e in events if e["kind"] == "PreemptRequested"]
        for events in (recording.events, found.events)
    ]
    assert sorted(asked[0]) == sorted(asked[1])
    assert len(asked[0]) == (4 if reason else 8)  # the test's own request comes beside it


def written(path, folder, *arguments):
    file = folder / "test_incident.py"
    file.unlink(missing_ok=True)
    assert (
        main(
            ["runs", "reproduce", str(path), f"--allow={path.parent}", "-o", str(file), *arguments]
        )
        == 0
    )
    return file


def pytest_in(folder):
    """Run pytest alone in a folder; return its exit code and output."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(folder)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


EXPECTED_TEST = """
def test_round_aborted(mission, action_server, topic):
    move_base = action_server("move_base", MoveBaseAction)
    move_base.never_finish()
    move_base.reply(status="aborted", duration=31)
    battery = topic("battery", BatteryState)
    battery.publish_at(32, percentage=0.29)
    run = mission(make_mission())
    run.assert_path(["DRIVE", "WATCH", "HOME"])
    assert run.outcomes("DRIVE") == ("preempted",)
    assert run.outcomes("WATCH") == ("invalid",)
    assert run.outcomes("HOME") == ("aborted",)
    run.assert_outcome("aborted")
    assert len(move_base.goals) == 2
    assert len(move_base.cancelled) == 1
"""


@pytest.mark.slow
@pytest.mark.timeout(900)  # seven processes
def test_the_written_test_reads_like_a_person_s_and_fails_after_a_change(night, tmp_path):
    file, path = night
    fresh = tmp_path / "fresh"
    fresh.mkdir()
    test = written(path, fresh)
    path.unlink()  # it needs no recording
    assert test.read_text().endswith(EXPECTED_TEST)
    assert str(tmp_path) not in test.read_text()  # it may be moved with its mission
    assert pytest_in(fresh)[0] == 0
    for old, new, at, *_ in MUTATIONS:
        file.write_text(MISSION.replace(old, new))
        code, out = pytest_in(fresh)
        assert code == (0 if at is None else 1), (old, new, out)


@pytest.mark.slow
def test_a_test_that_expects_better_fails_until_the_mission_is_mended(night, tmp_path):
    file, path = night
    fresh = tmp_path / "fresh"
    fresh.mkdir()
    text = written(path, fresh, "--expect", "succeeded").read_text()
    assert 'run.assert_outcome("succeeded")' in text
    assert "assert_path" not in text
    assert pytest_in(fresh)[0] == 1
    file.write_text(MISSION.replace('{"aborted": "aborted"}', '{"aborted": "succeeded"}'))
    assert pytest_in(fresh)[0] == 0


def test_a_mission_file_is_reproduced_and_its_test_is_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("rounds.yaml").write_text(
        "name: ROUNDS\noutcomes: [done, preempted]\nparameters: {seconds: {type: number}}\n"
        "states: {A: {state: wait, with: {seconds: '${seconds}'}}}\n"
    )
    words = ["rounds.yaml", "--input", "seconds=2", "--time", "virtual", "--plain"]
    assert main(["run", *words, "--record", "run.jsonl"]) == 0
    assert main(["runs", "reproduce", "run.jsonl"]) == 2
    assert f"Try --allow {tmp_path}/rounds.yaml" in capsys.readouterr().out
    allowed = ["--allow", str(tmp_path)]
    assert main(["runs", "reproduce", "run.jsonl", *allowed]) == 0
    assert main(["runs", "reproduce", "run.jsonl", *allowed, "-o", "test_it.py"]) == 0
    text = Path("test_it.py").read_text()
    assert 'load(Path(__file__).parent / "rounds.yaml", seconds=2.0)' in text
    compile(text, "test_it.py", "exec")


def test_an_existing_file_is_not_overwritten(night, tmp_path, capsys):
    _, path = night
    (tmp_path / "test_incident.py").write_text("mine")
    arguments = [
        "runs",
        "reproduce",
        str(path),
        f"--allow={path.parent}",
        "-o",
        str(tmp_path / "test_incident.py"),
    ]
    assert main(arguments) == 2
    assert "File exists" in capsys.readouterr().err
    assert (tmp_path / "test_incident.py").read_text() == "mine"


@pytest.mark.parametrize("option", ["-o", "--record", "--junit"])
def test_what_cannot_be_written_is_told_before_the_work(night, tmp_path, capsys, option):
    _, path = night
    nowhere = str(tmp_path / "nowhere" / "test_it.py")
    assert main(["runs", "reproduce", str(path), f"--allow={path.parent}", option, nowhere]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert f"{option} {nowhere!r}: cannot write: no such folder" in err


def test_a_run_that_does_not_end_any_more_says_where_it_was(tmp_path):
    plan = Plan((("wait", -1, -1),), (), (), (), None)
    recording = recorded(plan, tmp_path)

    def waiting():
        sm = StateMachine(["good", "bad", "preempted"], name="RANDOM", userdata={"found": 0})
        sm.add("S0", Wait(1000.0), {"done": "good"})
        return sm

    found = reproduce(recording, make=waiting)
    assert [note for note in found.notes if "still ran after" in note] == [
        "/RANDOM: it still ran after 60.25 s, in /RANDOM/S0; expected an end."
    ]


def test_expect_needs_a_file_to_write(night, capsys):
    _, path = night
    assert (
        main(["runs", "reproduce", str(path), f"--allow={path.parent}", "--expect", "succeeded"])
        == 2
    )
    assert "--expect: got it without -o" in capsys.readouterr().err


def test_an_expected_outcome_that_the_machine_does_not_have_writes_no_test(night, tmp_path, capsys):
    _, path = night
    test = tmp_path / "test_incident.py"
    words = [str(path), f"--allow={path.parent}", "-o", str(test), "--expect", "suceeded"]
    assert main(["runs", "reproduce", *words]) == 2
    error = capsys.readouterr().err
    assert "expect: got 'suceeded'; expected one of [" in error
    assert "Did you mean 'succeeded'?" in error
    assert not test.exists()


def test_results_of_once_come_from_the_recording(tmp_path):
    dice = iter(range(100))

    def throw(userdata):
        userdata.eyes = smachpy.once("dice", lambda: next(dice))
        return "done"

    def make():
        sm = StateMachine(["done"], name="DICE")
        keys = ["eyes"]
        sm.add("ONE", CBState(throw, outcomes=["done"], output_keys=keys), {"done": "TWO"})
        sm.add("TWO", CBState(throw, outcomes=["done"], output_keys=keys))
        return sm

    machine = make()
    with mission_kit() as kit, Recorder(tmp_path / "run.jsonl", machine):
        kit(machine)
    found = reproduce(read_recording(tmp_path / "run.jsonl"), make=make)
    assert found.is_same, lines_of(found)
    assert next(dice) == 2


DICE = """
import random
import smachpy

FACES = range(1, 7)


def throw(userdata):
    userdata.eyes = FACES[random.randrange(6)], random.random()
    return "done"


@smachpy.mission
def mission() -> smachpy.StateMachine:
    sm = smachpy.StateMachine(["done"], name="DICE", userdata={"first": random.random()})
    sm.add("ONE", smachpy.CBState(throw, outcomes=["done"], output_keys=["eyes"]), {"done": "TWO"})
    sm.add("TWO", smachpy.CBState(throw, outcomes=["done"], output_keys=["eyes"]))
    return sm
"""


@pytest.mark.parametrize("more", [[], ["--time", "virtual"]], ids=["real", "virtual"])
def test_a_recorded_mission_throws_the_same_dice_again(tmp_path, monkeypatch, capsys, more):
    """Between the begin of the command and that of the mission, others had thrown some."""
    monkeypatch.chdir(tmp_path)
    Path("dice.py").write_text(DICE)
    state = random.getstate()
    try:
        for name in ("one", "two"):
            command = ["run", "dice.py", "--plain", "--record", f"{name}.jsonl", *more]
            assert main(command) == 0
            assert main(["runs", "reproduce", f"{name}.jsonl", "--allow", "."]) == 0
    finally:
        random.setstate(state)
    first, second = (read_recording(f"{name}.jsonl").events for name in ("one", "two"))
    written = [[e["value"] for e in events if "value" in e] for events in (first, second)]
    assert written[0] != written[1]


def looks_around(userdata):

    with open("/etc/hostname", encoding="utf-8") as file:
        userdata.host = file.read() + ENVIRONMENT.environ.get("HOME", "")
    userdata.id = smachpy.once("id", lambda: uuid.uuid4().hex)
    return "done"


def test_the_check_names_what_cannot_be_reproduced():
    sm = StateMachine(["done"], name="LOOKS")
    sm.add("LOOK", CBState(looks_around, outcomes=["done"], output_keys=["host", "id"]))
    found = [p.message for p in smachpy.check(sm, enable=["outside"]) if p.rule == "outside"]
    assert [text.split()[2].strip(",") for text in found] == ["open", "os.environ.get"]
    assert not [p for p in smachpy.check(sm) if p.rule == "outside"]


def test_what_is_broken_in_the_inputs_is_left_out(night):
    _, path = night
    lines = path.read_text().splitlines(keepends=True)
    broken = [
        line.replace('"t":', '"u":')
        if '"subscriber"' in line
        else line.replace('"key":', '"key":[],"k":')
        if '"server"' in line
        else line
        for line in lines
    ]
    path.write_text("".join(broken))
    recording = read_recording(path)
    found = reproduce(recording, allow=[path.parent])
    assert found.comparison.total == 15
    assert f"{len(recording.wrong)} record(s) are left out: {recording.wrong[0]}" in found.notes


def test_the_new_run_is_recorded_and_programs_learn_where_the_two_part(night, tmp_path, capsys):
    file, path = night
    file.write_text(file.read_text().replace("0.30", "0.25"))
    today = tmp_path / "today.jsonl"
    words = ["runs", "reproduce", str(path), f"--allow={path.parent}", "--record", str(today)]
    assert main([*words, "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["difference"]["path"] == "/ROUND/VISIT/WATCH"
    assert told["difference"]["now"] == "VISIT/WATCH  goes on"
    assert told["difference"]["later"] == pytest.approx(0.0, abs=0.01)
    assert any("0.25" in text for text in told["changed"])
    new, old = read_recording(today), read_recording(path)
    assert new.record.label == "ROUND"
    assert new.made_ns > old.made_ns  # by a real clock
    assert [event["kind"] for event in new.events[:5]] == [e["kind"] for e in old.events[:5]]
    assert new.events != old.events
    assert main(words) == 2  # a recording is never overwritten
    assert "cannot write: File exists" in capsys.readouterr().err
    for more in (["-o", "test_x.py"], []):
        places = [str(path)] if more else [str(path), str(today)]
        assert main([*words[:2], *places, *words[3:], *more]) == 2
        assert "--record: got" in capsys.readouterr().err


DOOR = """
import smachpy
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool, SetBoolRequest
from smachpy.states import AwaitMessage, Wait


class Late(smachpy.State):
    def __init__(self):
        super().__init__(["done", "preempted"], timeout=3.0, timeout_outcome="late")

    def execute(self, userdata):
        return "preempted" if self.sleep(60.0) else "done"


def mission():
    sm = smachpy.StateMachine(
        ["done", "aborted", "preempted"], name="DOOR", userdata={"short": 0.0, "long": 5.0}
    )
    ask = smachpy.ServiceState("door/set", SetBool, request=SetBoolRequest(data=True), timeout=5.0)
    with sm:
        sm.add("OPEN", ask, {"succeeded": "WAIT"})
        sm.add(
            "WAIT",
            AwaitMessage("door/open", Bool, lambda message: message.data, timeout=20.0),
            {"came": "REST", "timeout": "aborted"},
        )
        sm.add("REST", Wait(), {"done": "SLEEP"}, {"seconds": "short"})
        sm.add("SLEEP", Wait(2.0), {"done": "HANG"})
        sm.add("HANG", Late(), {"done": "aborted", "late": "LOOK"})
        sm.add("LOOK", AwaitMessage("nothing", Bool, timeout=8.0), {"timeout": "done", "came": "done"})
    return sm
"""

WITHOUT_ANOTHER_PATH = [
    # what is changed without another path, outcome or goal, and what is said of that
    ("message.data,", "not message.data,", "WAIT  says no to door/open Bool()", "WAIT  says yes"),
    ("SetBoolRequest(data=True)", "SetBoolRequest()", "OPEN  asks door/set", "OPEN  asks door/set"),
    ("Wait(2.0)", "Wait(2.5)", "SLEEP  done after 2.0 s", "SLEEP  done after 2.5 s"),
    ("timeout=3.0", "timeout=2.5", "HANG  runs into its timeout of 3.0 s", "timeout of 2.5 s"),
    ("timeout=8.0", "timeout=9.0", "LOOK  timeout after 8.0 s", "LOOK  timeout after 9.0 s"),
    ('"seconds": "short"', '"seconds": "long"', "REST  done after 0.0 s", "REST  done after 5.0 s"),
    ("timeout=20.0", "timeout=30.0", "", ""),  # which the run never came near
]


@pytest.mark.parametrize(("old", "new", "then", "now"), WITHOUT_ANOTHER_PATH)
def test_a_change_that_leaves_the_path_is_found_too(tmp_path, capsys, old, new, then, now):
    from smachpy.command.targets import load_target

    file, path = tmp_path / "door_mission.py", tmp_path / "run.jsonl"
    file.write_text(DOOR)
    with mission_kit() as kit:
        kit.service_server("door/set", SetBool).reply({"success": True})
        door = kit.topic("door/open", Bool)
        door.publish_at(0.5, data=False)
        door.publish_at(3.5, data=True)
        machine = load_target(str(file)).build()
        with Recorder(path, machine, origin={"target": str(file)}):
            kit(machine)
    assert old in DOOR
    file.write_text(DOOR.replace(old, new))
    code = main(["runs", "reproduce", str(path), f"--allow={file}"])
    out = capsys.readouterr().out
    assert code == (1 if then else 0), out
    if then:
        recorded = next(line for line in out.splitlines() if line.startswith("  recorded"))
        present = next(line for line in out.splitlines() if line.startswith("  now"))
        assert then in recorded
        assert now in present
        assert recorded != present
        assert "is gone" not in out


def test_the_cost_of_what_conditions_say_grows_with_the_messages():
    """Each verdict was compared with all messages before it."""
    looked = [0]

    class Message(dict):
        def __getitem__(self, key):
            looked[0] += 1
            return super().__getitem__(key)

    def odds(count):
        inputs = []
        for n in range(count):
            inputs.append(Message(what="message", name="robot/door", t=float(n), value=n))
            inputs.append(Message(what="message", name="robot/other", t=float(n), value=-n))
            if n % 3 == 0:  # of the two between, it says the same as of the last one
                said = {"what": "said", "name": "/M/WAIT", "key": "door", "state": "no"}
                inputs.append(Message(said, t=float(n), value=n))
        now = [Said(50.0 + n, "/M/WAIT", "door", n, "yes", n) for n in range(count)]
        looked[0] = 0
        return list(odd_verdicts(inputs, now, 50.0)), looked[0]

    found, few = odds(100)
    assert [one.at for one in found] == [float(n) for n in range(100)]
    many = odds(1_000)[1]
    assert many < 20 * few  # 100 times as many


def numbered(values, begin):
    events = [{"kind": "Entered", "path": "/M/A", "t": begin}]
    for number, value in enumerate(values):
        written = {"kind": "UserdataWritten", "path": "/M/A", "key": "due", "value": value}
        events.append({**written, "t": begin + number})
    return steps_of(events, describe(smachpy.StateMachine(["done"], name="M")), ())


def test_moments_of_two_clocks_are_the_same_if_they_are_as_far_away():
    recorded = numbered([13_700.5, 13_701.5], 13_700.0)
    assert compare(recorded, numbered([0.3, 1.4], 0.0)).difference is None
    assert compare(recorded, numbered([0.3, 9.4], 0.0)).difference.number == 3
    assert compare(numbered([0.5], 13_700.0), numbered([0.4], 0.0)).difference.number == 2


def test_a_machine_that_serves_a_goal_of_the_run_begins_beside_the_state_that_sends_it():
    sm = smachpy.StateMachine(["succeeded", "aborted", "preempted"], name="M")
    sm.add("SEND", smachpy.SimpleActionState("turn", MoveBaseAction))
    sent = {"kind": "GoalSent", "path": "/M/SEND", "action": "turn"}
    begins = {"kind": "Entered", "path": "/M/SEND/TURN"}
    ends = {"kind": "Left", "path": "/M/SEND/TURN", "outcome": "done"}
    one, other = (
        steps_of(events, describe(sm), ())
        for events in ([sent, begins, ends], [begins, sent, ends])
    )
    assert compare(one, other).difference is None
    differs = compare(one, steps_of([sent, begins, {**ends, "outcome": "stuck"}], describe(sm), ()))
    assert differs.difference.number == 3


def test_what_is_shown_of_the_progress_is_not_compared():
    text = {"$object": "Progress", "fields": {"fraction": 0.1, "seconds_left": 9.0, "text": "a"}}
    assert compare(numbered([text, text], 0.0), numbered([text], 0.0)).difference is None


def test_a_result_that_is_the_same_is_not_shown_where_the_status_differs():
    done = {"kind": "GoalDone", "path": "/M/GO", "action": "move_base", "result": "x" * 80}
    record = describe(smachpy.StateMachine(["done"], name="M"))
    one, other = (
        steps_of([{**done, "status": status}], record, ()) for status in ("ABORTED", "PREEMPTED")
    )
    found = compare(one, other).difference
    assert found.recorded == "GO  move_base is ABORTED, result the same, cancelled: False"
    assert found.now == "GO  move_base is PREEMPTED, result the same, cancelled: False"


class Computes(smachpy.State):
    """Takes ten seconds that it neither sleeps nor waits."""

    def __init__(self):
        super().__init__(["done"])

    def execute(self, userdata):
        if ENVIRONMENT.environ.get("SLOW_COMPUTER"):
            self.sleep(10.0)
        return "done"


def computing():
    sm = StateMachine(["valid", "invalid", "aborted", "preempted"], name="COMPUTING")
    with sm:
        sm.add("COMPUTE", Computes(), {"done": "LOOK"})
        look = smachpy.MonitorState(
            "battery", BatteryState, lambda _, message: message.percentage < 0.5, 1, timeout=5.0
        )
        sm.add("LOOK", look)
    return sm


def test_code_that_computed_for_long_takes_no_time_and_what_follows_comes_earlier(
    tmp_path, monkeypatch
):
    path = tmp_path / "run.jsonl"
    monkeypatch.setenv("SLOW_COMPUTER", "1")
    with mission_kit() as kit:
        kit.topic("battery", BatteryState).publish_at(13.0, percentage=0.4)
        machine = computing()
        with Recorder(path, machine):
            assert kit(machine).outcome == "valid"
    monkeypatch.delenv("SLOW_COMPUTER")
    found = reproduce(read_recording(path), make=computing)
    assert found.is_same, lines_of(found)
    assert found.events[-1]["t"] - found.events[0]["t"] < 4.0


def thinking():
    def think(_userdata, _goal):
        if ENVIRONMENT.environ.get("SLOW_COMPUTER"):
            current_clock().sleep(0.5)

    both = smachpy.Concurrence(
        ["there", "low"],
        default_outcome="there",
        outcome_map={"low": {"WATCH": "invalid"}},
        child_termination_cb=lambda ended: ended.get("DRIVE") is not None,
        name="THINKING",
    )
    with both:
        both.add("DRIVE", smachpy.SimpleActionState("move_base", MoveBaseAction, goal_cb=think))
        both.add("WATCH", smachpy.MonitorState("battery", BatteryState, lambda *_: False))
    return both


def test_a_message_comes_as_long_after_a_goal_as_it_did(tmp_path, monkeypatch):
    """The goal's answers do, too: they came before it if the goal was sent late."""
    monkeypatch.setenv("SLOW_COMPUTER", "1")
    with mission_kit() as kit:
        kit.action_server("move_base", MoveBaseAction).reply(duration=2.0)
        kit.topic("battery", BatteryState).publish_at(2.4, percentage=0.1)
        machine = thinking()
        with Recorder(tmp_path / "run.jsonl", machine):
            assert kit(machine).outcome == "low"
    monkeypatch.delenv("SLOW_COMPUTER")
    found = reproduce(read_recording(tmp_path / "run.jsonl"), make=thinking)
    assert found.is_same, lines_of(found)


def test_a_world_of_too_many_lines_stays_in_the_recording(tmp_path, monkeypatch, capsys):
    path = tmp_path / "many.jsonl"
    monkeypatch.setattr("smachpy.reproduce.written.MOST_LINES", 2)
    with mission_kit() as kit:
        battery = kit.topic("battery", BatteryState)
        for number in range(3):
            battery.publish_at(1.0 + number, percentage=0.4)
        machine = three_lows()
        with Recorder(path, machine):
            assert kit(machine).outcome == "valid"
    written = tmp_path / "test_many.py"
    command = ["runs", "reproduce", str(path), "--mission", f"{__name__}:three_lows"]
    assert main([*command, "-o", str(written)]) == 0
    assert "would be 3 lines: the test reads the recording" in capsys.readouterr().out
    assert 'read_recording(HERE / "many.jsonl")' in written.read_text()


def three_lows():
    sm = StateMachine(["valid", "invalid", "aborted", "preempted"], name="LOWS")
    look = smachpy.MonitorState(
        "battery", BatteryState, lambda _, message: message.percentage < 0.5, 3, timeout=5.0
    )
    sm.add("LOOK", look)
    return sm
