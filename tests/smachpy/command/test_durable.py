"""`smachpy run --durable` and `smachpy missions`, in one process: Ctrl-C twice ends the mission's."""

from __future__ import annotations

import itertools
import json
import os
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from smachpy.command import main
from smachpy.events.recording import read_recording
from viz.runs.listing import run_row
from viz.runs.statistics import Statistics

MISSION = """
from pathlib import Path

import smachpy
from smachpy import StateMachine

{decorator}
def mission(speed: float = 1.0):
    machine = StateMachine(["done"], name="ERRAND")
    with machine:
        StateMachine.add("LOAD", load, {{"done": "{label}"}})
        StateMachine.add("{label}", carry)
    return machine


@smachpy.state(outcomes=["done"], output_keys=["weight"])
def load(userdata):
    userdata.weight = 3
    loaded = Path("loaded")
    loaded.write_text(loaded.read_text() + "x" if loaded.exists() else "x")
    return "done"


@smachpy.state(outcomes=["done"], input_keys=["weight"])
def carry(userdata):
    if not Path("go").exists():
        raise KeyboardInterrupt
    assert userdata.weight == 3
    return "done"
"""


_seconds = itertools.count(1_700_000_000)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    write()
    return tmp_path


def write(label: str = "CARRY", decorator: str = "@smachpy.mission") -> None:
    Path("errand.py").write_text(MISSION.format(label=label, decorator=decorator))
    second = next(_seconds)  # Python takes a file of the same size and second for the same
    os.utime("errand.py", (second, second))


def run(*words: str) -> int:
    return main(["run", "errand.py", "--plain", "--durable", "j.db", *words])


def missions(*words: str) -> int:
    return main(["missions", words[0], *words[1:], "--durable", "j.db"])


def listed(capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    capsys.readouterr()
    assert missions("list", "--json") == 0
    rows: list[dict[str, Any]] = json.loads(capsys.readouterr().out)
    return rows


def test_it_goes_on_where_it_was(capsys: pytest.CaptureFixture[str]) -> None:
    assert run() == 130
    [row] = listed(capsys)
    assert (row["status"], row["active"]) == ("interrupted", ["/ERRAND/CARRY"])
    mission = row["id"]
    Path("go").touch()
    assert run() == 0
    assert f"mission {mission} is resumed" in capsys.readouterr().err
    assert Path("loaded").read_text() == "x"
    [row] = listed(capsys)
    assert (row["status"], row["outcome"], row["active"]) == ("ended", "done", [])
    assert run() == 0  # another mission: that one has ended
    assert "begins" in capsys.readouterr().err
    assert Path("loaded").read_text() == "xx"


def test_a_person_shows_resumes_and_forgets_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run("--input", "speed=2.0") == 130
    mission = listed(capsys)[0]["id"]
    assert missions("show", mission, "--json") == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["position"]["userdata"] == {"/ERRAND": {"weight": 3}}
    assert missions("show", mission) == 0
    assert "/ERRAND/CARRY" in capsys.readouterr().out
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir("elsewhere")
    Path("go").touch()
    assert main(["missions", "resume", "--durable", "../j.db", mission, "--plain"]) == 0
    monkeypatch.chdir(tmp_path)
    assert missions("resume", mission, "--plain") == 2  # it has ended
    assert missions("cancel", mission) == 2
    assert missions("forget", mission) == 0
    assert listed(capsys) == []
    assert missions("list") == 0


def test_one_that_is_cancelled_is_preempted_when_it_goes_on(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What was active is entered, to be stopped; nothing comes after it."""
    last = 'StateMachine.add("CARRY", carry'
    text = (
        Path("errand.py")
        .read_text()
        .replace(f"{last})", f'{last}, {{"done": "REST"}})\n        StateMachine.add("REST", load)')
    )
    Path("errand.py").write_text(text)
    assert run() == 130
    assert missions("cancel", listed(capsys)[0]["id"]) == 0
    Path("go").touch()
    assert run() == 1
    assert listed(capsys)[0]["outcome"] == "preempted"


def test_other_arguments_are_another_mission_only_if_it_is_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run() == 130
    assert run("--input", "speed=2.0") == 2
    assert run("--input", "speed=2.0", "--mission", "second") == 130
    assert {row["id"] for row in listed(capsys)} >= {"second"}
    assert run("--input", "speed=3.0", "--mission", "second") == 2
    said = capsys.readouterr().err
    assert "speed=3.0" in said
    assert "speed=2.0" in said


def test_the_id_of_one_that_has_ended_can_be_used_again_when_that_is_forgotten(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("go").touch()
    assert run("--mission", "first") == 0
    assert run("--mission", "first") == 2
    assert "Try 'smachpy missions forget first'" in capsys.readouterr().err
    assert missions("forget", "first") == 0
    assert run("--mission", "first") == 0


def test_a_changed_machine_needs_to_be_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert run() == 130
    write("BRING")
    Path("go").touch()
    assert run() == 2
    said = capsys.readouterr().err
    assert "/ERRAND/BRING: is new" in said
    assert "Traceback" not in said
    assert run("--migrate", "/ERRAND/CARRY=/ERRAND/BRING") == 0
    assert Path("loaded").read_text() == "x"


def test_a_mission_says_what_has_changed_and_how_old_its_journal_may_be() -> None:
    assert run() == 130
    renames = 'lambda _: {"/ERRAND/CARRY": "/ERRAND/BRING"}'
    write("BRING", f"@smachpy.mission(migrations={renames}, max_outage=1e-6)")
    Path("go").touch()
    assert run() == 2  # too old
    assert run("--max-outage", "3600") == 0


@pytest.mark.parametrize(
    "words",
    [
        ["--mission", "m"],
        ["--outage", "pauses"],
        ["--max-outage", "3"],
        ["--migrate", "/A=/B"],
        ["--durable", "j.db", "--time", "virtual"],
        ["--durable", "mysql://here/db"],
        ["--durable", "errand.py"],
        ["--durable", "/dev/null/j.db"],
    ],
    ids=" ".join,
)
def test_bad_options_are_one_line(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "errand.py", "--plain", *words]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said
    assert said.startswith("smachpy: ")


@pytest.mark.parametrize(
    "words",
    [["--outage", "stops"], ["--max-outage", "nan"], ["--max-outage", "-1"], ["--migrate", "A=B"]],
    ids=" ".join,
)
def test_words_that_do_not_fit_are_refused(words: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        run(*words)
    assert caught.value.code == 2


def test_missions_of_no_journal_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert missions("list") == 2
    assert not Path("j.db").exists()
    assert run() == 130
    assert missions("show", "nobody") == 2
    assert "Traceback" not in capsys.readouterr().err


def test_a_journal_with_a_damaged_entry_is_refused_and_still_listed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run() == 130
    connection = sqlite3.connect("j.db")
    connection.execute("UPDATE smachpy_entries SET data = X'00'")
    connection.commit()
    connection.close()
    assert run() == 2
    assert listed(capsys)[0]["problem"] == "corrupt"
    assert missions("show", listed(capsys)[0]["id"]) == 2


def test_a_run_that_goes_on_is_one_run_in_its_recording(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run("--record", "r.jsonl") == 130
    with Path("r.jsonl").open("a", encoding="utf-8") as file:
        file.write('{"kind": "Ent')  # as a power loss leaves it
    Path("go").touch()
    assert run("--record", "r.jsonl") == 0
    [mission] = listed(capsys)
    recording = read_recording("r.jsonl")
    assert recording.run == mission["run"]
    kinds = [event["kind"] for event in recording.events]
    assert (kinds.count("Started"), kinds.count("Recovered")) == (1, 1)
    statistics = Statistics()
    statistics.add(recording.events, recording.record)
    assert (statistics.runs, statistics.outcomes) == (1, {"done": 1})
    assert {path: state.visits for path, state in statistics.states.items()} == {
        "/ERRAND": 1, "/ERRAND/LOAD": 1, "/ERRAND/CARRY": 1,
    }  # fmt: skip
    row = run_row(recording.record, recording.events)
    assert row["outcome"] == "done"
    assert [piece[1] for piece in row["strip"]] == ["LOAD", "CARRY"]
    assert len(row["outages"]) == len(mission["outages"]) == 1
    assert main(["runs", "list", "r.jsonl", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["outages"] == mission["outages"]
    assert run("--record", "r.jsonl") == 2  # another mission: no file is overwritten


def test_what_was_recorded_of_one_run_in_several_files_is_one_run(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As when another computer has taken it over."""
    assert run("--record", "runs/b.jsonl") == 130
    Path("go").touch()
    assert run("--record", "runs/a.jsonl") == 0
    capsys.readouterr()
    assert main(["runs", "show", "runs", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["runs"], told["outcomes"]) == (1, {"done": 1})
    assert main(["runs", "list", "runs", "--json"]) == 0
    [line] = capsys.readouterr().out.splitlines()
    assert (json.loads(line)["outcome"], len(json.loads(line)["outages"])) == ("done", 1)


def test_a_mission_that_could_not_begin_is_none_that_was_interrupted(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("taken.jsonl").touch()
    assert run("--record", "taken.jsonl") == 2
    assert listed(capsys)[0]["status"] == "queued"
    assert run("--mission", "m", "--robot", "ghost", "--record", "taken.jsonl") == 2


def test_what_is_queued_is_listed_with_when_it_is_due(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["submit", "errand.py", "--db", "j.db"]
    assert main([*words, "--every", "0 8 * * 1-5"]) == 0
    [row] = listed(capsys)
    assert row["every"] == "0 8 * * 1-5"
    assert row["due"] > row["created"]
    assert missions("list") == 0
    assert "due" in capsys.readouterr().out
