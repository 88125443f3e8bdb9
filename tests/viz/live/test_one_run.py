"""A durable run that another process goes on with: one run to viewers, and in the list of runs."""

from __future__ import annotations

import contextlib
import copy
import json
import subprocess
from pathlib import Path

import pytest

from actionlib_core.clock import RealClock
from smachpy.command import main
from smachpy.durable.opening import open_store
from smachpy.exceptions import SmachError
from smachpy_viz.live import journals as journals_module
from smachpy_viz.live.journals import Journals
from smachpy_viz.live.machines import Machines
from smachpy_viz.live.runs import Runs, with_missions
from tests.places import DATA

MISSION = """
from pathlib import Path

import smachpy
from smachpy import StateMachine


def mission():
    machine = StateMachine(["done"], name="ERRAND")
    with machine:
        StateMachine.add("LOAD", load, {"done": "CARRY"})
        StateMachine.add("CARRY", carry)
    return machine


@smachpy.state(outcomes=["done"])
def load(userdata):
    return "done"


@smachpy.state(outcomes=["done"])
def carry(userdata):
    if not Path("go").exists():
        raise KeyboardInterrupt
    return "done"
"""
FOLDS = DATA / "folds.json"


@pytest.fixture
def interrupted(tmp_path, monkeypatch):
    """The journal of a mission whose process has ended."""
    monkeypatch.chdir(tmp_path)
    Path("errand.py").write_text(MISSION, encoding="utf-8")
    words = ["--plain", "--durable", "j.db", "--mission", "m", "--record", "runs/r.jsonl"]
    assert main(["run", "errand.py", *words]) == 130
    return "j.db"


def listed(runs):
    [row] = runs.rows()["runs"]
    return row


def test_a_mission_its_recording_and_its_machine_are_one_row(interrupted):
    journals = Journals([interrupted])
    row = listed(Runs(Machines(), [], journals))
    assert (row["machine"], row["outcome"], row["reason"]) == ("ERRAND", None, "CARRY")
    assert [piece[1] for piece in row["strip"]] == ["LOAD", "CARRY"]
    assert row["mission"]["can"] == ["resume", "cancel"]
    both = listed(Runs(Machines(), [Path("runs")], journals))
    assert (both["mission"], both["file"]) == (row["mission"], "runs/r.jsonl")
    assert (both["outcome"], both["reason"]) == (None, "CARRY")
    journals.close()


def test_a_mission_is_resumed_by_a_process_of_its_own(interrupted, monkeypatch, tmp_path):
    started = []

    class Popen(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            started.append(self)

    monkeypatch.setattr(journals_module.subprocess, "Popen", Popen)
    journals = Journals([interrupted])
    runs = Runs(Machines(), [Path("runs")], journals)
    with pytest.raises(SmachError, match="--allow"):
        runs.command({"journal": "j.db", "id": "m", "command": "resume"})
    journals.close()
    journals = Journals([interrupted], logs=tmp_path / "logs", allow=[str(tmp_path)])
    runs = Runs(Machines(), [Path("runs")], journals)
    Path("go").touch()
    assert runs.command({"journal": "j.db", "id": "m", "command": "resume"})
    assert started[0].wait(60.0) == 0
    row = listed(runs)
    assert (row["outcome"], row["mission"]["status"]) == ("done", "ended")
    assert (row["mission"]["can"], len(row["outages"])) == ([], 1)
    assert Path("runs/r.jsonl").read_text(encoding="utf-8").count('"Recovered"') == 1
    for command in ("resume", "cancel"):
        with pytest.raises(SmachError):
            runs.command({"journal": "j.db", "id": "m", "command": command})
    journals.close()


def test_a_failed_resume_is_told_until_the_mission_goes_on(interrupted, tmp_path, monkeypatch):
    tasks = []

    class Clock(RealClock):
        def spawn(self, function, *, name):
            tasks.append(super().spawn(function, name=name))

    monkeypatch.setattr(journals_module, "RealClock", Clock)
    Path("errand.py").rename("elsewhere.py")
    journals = Journals([interrupted], allow=[str(tmp_path)])
    runs = Runs(Machines(), [], journals)
    journals.command("j.db", "m", "resume")
    tasks[0].join(60.0)
    assert listed(runs)["reason"].startswith("not resumed: ")
    Path("elsewhere.py").rename("errand.py")
    Path("go").touch()
    assert main(["missions", "resume", "m", "--durable", "j.db", "--allow", ".", "--plain"]) == 0
    assert (listed(runs)["outcome"], listed(runs)["reason"]) == ("done", "")
    journals.close()


def test_a_mission_in_the_queue_is_cancelled_at_once(interrupted):
    Path("go").touch()
    assert main(["submit", "errand.py", "--db", interrupted, "--mission", "later"]) == 0
    journals = Journals([interrupted])
    assert journals.command("j.db", "later", "cancel") == "it is cancelled"
    with contextlib.closing(open_store(interrupted)) as store:
        assert store.mission("later").status == "cancelled"
    journals.close()


def test_a_mission_is_cancelled(interrupted):
    journals = Journals([interrupted])
    assert journals.command("j.db", "m", "cancel")
    store = open_store(interrupted)
    assert store.mission("m").cancel
    store.close()
    journals.close()


@pytest.mark.parametrize(
    "told",
    [
        {},
        {"journal": "j.db", "id": "m", "command": "forget"},
        {"journal": "j.db", "id": "other", "command": "cancel"},
        {"journal": "/etc/passwd", "id": "m", "command": "cancel"},
        {"journal": ["j.db"], "id": "m", "command": "cancel"},
    ],
)
def test_a_command_that_makes_no_sense_is_refused(interrupted, told):
    journals = Journals([interrupted])
    with pytest.raises(SmachError):
        Runs(Machines(), [], journals).command(told)
    journals.close()


def test_a_journal_that_cannot_be_read_is_named_and_the_others_are_listed(interrupted):
    Path("bad.db").write_bytes(b"no journal at all")
    journals = Journals(["bad.db", "gone.db", interrupted], Path(".smachpy/journal.db"))
    found = Runs(Machines(), [], journals).rows()
    assert [row["mission"]["id"] for row in found["runs"]] == ["m"]
    assert [bool(one["problem"]) for one in found["journals"]] == [True, True, False]
    journals.close()


def test_a_password_is_told_to_nobody(monkeypatch):
    monkeypatch.setattr(journals_module, "PATIENCE_S", 0.1)
    secret = "postgresql://robot:geheim@localhost:1/missions"
    journals = Journals([secret])
    told = json.dumps(Runs(Machines(), [], journals).rows())
    assert "geheim" not in told
    assert "localhost:1/missions" in told
    journals.close()


def history(events, epoch, run="m 1"):
    machine = {"path": "/JOB", "label": "JOB", "kind": "machine", "type_name": "StateMachine",
               "outcomes": ["done"]}  # fmt: skip
    return {
        "epoch": epoch, "run": run, "description": machine, "base": None, "events": events,
        "control": None, "problems": [],
    }  # fmt: skip


def parts():
    """The records of a run in two processes, each with numbers of its own."""
    *_, case = json.loads(FOLDS.read_text(encoding="utf-8"))
    events = case["events"]
    cut = next(i for i, one in enumerate(events) if one["kind"] == "Recovered")
    second = [{**one, "seq": n} for n, one in enumerate(events[cut:], 1)]
    return events[:cut], second, case["state"]


def test_a_viewer_that_was_there_before_shows_both_processes_as_one_run():
    first, second, state = parts()
    machines = Machines()
    machine = machines.obtain("job")
    machine.reset(history(first, "one"))
    machine.reset(history(second[:1], "two"))
    assert machine.add(copy.deepcopy(second[1:3]))
    machine.reset(history(second[:4], "two"))  # what was missed is read again
    assert machine.add(copy.deepcopy(second[4:]))
    assert [one["seq"] for one in machine.events()] == list(range(1, len(first + second) + 1))
    assert machine.history()[1][0]["kind"] == "Started"
    assert machine._now.data == state
    assert [one["name"] for one in machines.summaries()] == ["job"]


def test_another_run_of_the_same_name_is_another_run():
    first, second, _ = parts()
    machines = Machines()
    machine = machines.obtain("job")
    machine.reset(history(first, "one"))
    machine.reset(history(second, "two", run="m 2"))
    assert len(machines.summaries()) == 2
    assert machine.before is not None


def test_the_journal_of_a_run_adds_to_its_row():
    mission = {
        "run": "m 1", "id": "mission j m", "machine": "JOB", "robots": [], "began": 1, "ended": None,
        "last": 5, "outcome": None, "reason": "A", "strip": [], "outages": [(1.0, 2.0)],
        "mission": {"id": "m"},
    }  # fmt: skip
    row = {**mission, "id": "file f", "name": None, "live": False, "file": "f", "outcome": "exception", "stamp": 1,
           "reason": "A: KeyboardInterrupt", "problem": "", "mission": None, "outages": []}  # fmt: skip
    [found] = with_missions([row], [mission])
    assert (found["id"], found["outcome"], found["outages"]) == ("file f", None, [(1.0, 2.0)])
    live = {**row, "id": "machine m", "live": True, "outcome": None, "file": ""}
    [found] = with_missions([live, row], [mission])
    assert (found["id"], found["file"]) == ("machine m", "f")
    [alone] = with_missions([], [mission])
    assert (alone["name"], alone["live"], alone["problem"]) == (None, False, "")
