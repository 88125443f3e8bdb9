"""Recorded runs that the page reproduces, and tests that it writes of them."""

from __future__ import annotations

import contextlib
import json
import signal
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

from smachpy.events.recording import Recorder, read_recording
from smachpy.testing import mission_kit
from smachpy_viz.live import started_commands
from smachpy_viz.live.machines import Machines
from smachpy_viz.live.reproductions import ReproductionRequestError, Reproductions
from smachpy_viz.live.runs import Runs

MISSION = """
import pathlib
import smachpy
from smachpy.states import Wait

pathlib.Path(__file__).with_name("executed").touch()
SURE = True

def look(userdata):
    return "seen" if SURE else "missed"

def mission():
    sm = smachpy.StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="LOOK")
    with sm:
        sm.add("WAIT", Wait(2.0), {"done": "EYE"})
        sm.add(
            "EYE",
            smachpy.CBState(look, outcomes=["seen", "missed"]),
            {"seen": "succeeded", "missed": "aborted"},
        )
    return sm
"""


def test_what_has_ended_gets_no_signal(monkeypatch):
    """Its number may be another process's: *Stop* of an old reproduction hit that one's group."""
    sent = []
    monkeypatch.setattr(started_commands.os, "killpg", lambda *words: sent.append(words))
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    started_commands.send_signal(process, signal.SIGINT)
    assert sent == [(process.pid, signal.SIGINT)]
    process.communicate(b"\n", timeout=60)
    started_commands.send_signal(process, signal.SIGINT)
    assert len(sent) == 1


@pytest.fixture
def incident(tmp_path):
    """A mission in a file, and the recording of a run of it."""
    from smachpy.command.targets import load_target

    file = tmp_path / "look.py"
    file.write_text(MISSION, encoding="utf-8")
    path = tmp_path / "runs" / "night one.jsonl"
    with mission_kit() as kit:
        machine = load_target(str(file)).build()
        with Recorder(path, machine, origin={"target": str(file)}):
            kit(machine)
    (tmp_path / "executed").unlink()
    return file, path


@pytest.fixture
def opened(incident, tmp_path):
    """Machines with that run, and what reproduces it."""
    file, path = incident
    machines = Machines()
    machines.obtain("night").load(read_recording(path))
    runs = Runs(machines, [path.parent])
    with contextlib.closing(Reproductions(machines, runs.file_of, [str(file)])) as made:
        yield machines, made, runs


def ended(reproductions, number):
    for task in reproductions._tasks:
        task.join(400.0)
    return reproductions.row(number)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_run_is_reproduced_and_the_new_one_is_a_machine_outside_the_list(opened, incident):
    machines, reproductions, runs = opened
    same = ended(reproductions, reproductions.start({"machine": "night", "what": "run"}))
    assert (same["running"], same["problem"]) == (False, "")
    assert (same["found"]["kind"], same["found"]["difference"]) == ("same", None)
    incident[0].write_text(MISSION.replace("True", "False"), encoding="utf-8")
    found = ended(reproductions, reproductions.start({"machine": "night", "what": "run"}))["found"]
    assert (found["kind"], found["difference"]["path"]) == ("differs", "/LOOK/EYE")
    assert "look.SURE is False now, was True" in found["changed"]
    assert (found["difference"]["recorded"], found["difference"]["now"]) == (
        "EYE  seen",
        "EYE  missed",
    )
    new = machines.get(found["machine"])
    assert [event.get("outcome") for event in new.events()][-1] == "aborted"
    assert [row["name"] for row in runs.rows()["runs"]] == ["night"]
    with pytest.raises(ReproductionRequestError, match="without a recording"):
        reproductions.start({"machine": found["machine"], "what": "run"})


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_test_is_written_to_be_saved_beside_its_mission(opened, tmp_path):
    _, reproductions, _ = opened
    found = ended(reproductions, reproductions.start({"machine": "night", "what": "test"}))["found"]
    assert (found["kind"], found["file"]) == ("test", "test_night_one.py")
    assert "def test_" in found["test"]
    assert 'assert_path(["WAIT", "EYE"])' in found["test"]
    assert "sys.path.insert(0, str(Path(__file__).parent))" in found["test"]
    assert found["notes"] == [f"save it in {str(tmp_path)!r}"]
    asked = {"machine": "night", "what": "test", "expect": "aborted"}
    found = ended(reproductions, reproductions.start(asked))["found"]
    assert "aborted" in found["test"]


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_what_a_mission_prints_at_the_end_of_its_program_is_no_verdict(opened, incident):
    _, reproductions, _ = opened
    incident[0].write_text(f"{MISSION}\nimport atexit\natexit.register(print, 'bye')\n")
    row = ended(reproductions, reproductions.start({"machine": "night", "what": "run"}))
    assert (row["problem"], row["found"]["kind"]) == ("", "same")


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_recording_cannot_name_code_that_nobody_allowed(incident, tmp_path):
    _, path = incident
    machines = Machines()
    machines.obtain("night").load(read_recording(path))
    with contextlib.closing(Reproductions(machines, Runs(machines).file_of)) as reproductions:
        for what, where in (("run", "found"), ("test", "problem")):
            row = ended(reproductions, reproductions.start({"machine": "night", "what": what}))
            told = row[where]["text"][0] if where == "found" else row[where]
            assert "Try --allow" in told
    assert not (tmp_path / "executed").exists()


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_one_that_never_ends_is_stopped_and_nothing_is_left(opened, incident):
    _, reproductions, _ = opened
    endless = MISSION.replace("SURE = True", "while True:\n    pass")
    incident[0].write_text(endless, encoding="utf-8")
    first, second = (reproductions.start({"machine": "night", "what": "run"}) for _ in range(2))
    with pytest.raises(ReproductionRequestError, match="expected fewer"):
        reproductions.start({"machine": "night", "what": "run"})
    assert reproductions.row(first)["running"]
    reproductions.stop(first)
    reproductions._tasks[0].join(400.0)
    assert reproductions.row(first) == {
        "running": False,
        "problem": "it was stopped",
        "found": None,
    }
    folder = reproductions._folder
    reproductions.close()
    assert reproductions._known[second].process.poll() is not None
    assert not folder.exists()


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"what": "rm"}, "what"),
        ({"what": ["run"]}, "what"),
        ({"machine": "nobody"}, "machine"),
        ({"machine": ["night"]}, "machine"),
        ({"machine": "/etc/passwd"}, "machine"),
        ({"machine": "bare"}, "bare: got a run without a recording"),
        ({"expect": 1}, "expect"),
        ({"expect": "x" * 1000}, "expect"),
        ({"expect": "done\0"}, "expect"),
        ({"expect": "\ud800"}, "expect"),
    ],
)
def test_what_makes_no_sense_is_refused_and_nothing_begins(opened, wrong, word):
    machines, reproductions, _ = opened
    machines.obtain("bare")
    with pytest.raises(ReproductionRequestError) as caught:
        reproductions.start({"machine": "night", "what": "run", **wrong})
    assert str(caught.value).startswith(word)
    for unknown in ("1", "..", ""):
        with pytest.raises(ReproductionRequestError):
            reproductions.row(unknown)
        with pytest.raises(ReproductionRequestError):
            reproductions.stop(unknown)


def post(address, headers, **command):
    body = json.dumps(command).encode()
    request = urllib.request.Request(f"{address}api/reproduce", body, headers)
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        with error:
            return error.code, json.load(error)


def test_only_the_token_of_a_viewer_with_control_reproduces(served):
    served.add("night")
    with contextlib.closing(Reproductions(served.machines, lambda _name: None)) as reproductions:
        address = served.start(token="t", reproductions=reproductions)
        ask = {"command": "start", "machine": "night", "what": "run"}
        json_type = {"content-type": "application/json", "origin": address.rstrip("/")}
        assert post(address, json_type, **ask)[0] == 403
        assert post(address, {**json_type, "x-smachpy-token": "x"}, **ask)[0] == 403
        status, said = post(address, {**json_type, "x-smachpy-token": "t"}, **ask)
        assert (status, said["text"].partition(":")[0]) == (409, "night")
        assert post(address, {**json_type, "x-smachpy-token": "t"}, command="rm")[0] == 400
