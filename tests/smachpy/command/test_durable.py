"""`smachpy run --durable` and `smachpy missions`, in one process: Ctrl-C twice ends the mission's."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from actionlib_core.clock import RealClock
from smachpy.command import main
from smachpy.command.fleet import Runner
from smachpy.command.pruning import size_text
from smachpy.command.warm import MissionProcess
from smachpy.durable.opening import open_store
from smachpy.durable.processes import this_runner
from smachpy.durable.store import PAGE
from smachpy.events.recording import read_recording
from smachpy_viz.runs.listing import run_row
from smachpy_viz.runs.statistics import Statistics

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
    resume = ["missions", "resume", "--durable", "../j.db", mission, "--plain"]
    assert main(resume) == 2  # a row names a file, which is not allowed by itself
    assert "Try --allow /" in capsys.readouterr().err
    assert main([*resume, "--allow", ".."]) == 0
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
    assert "mission 'first' has ended: done; expected one that goes on" in capsys.readouterr().err
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


def test_a_mission_that_could_not_begin_is_not_begun_by_a_runner_later(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("taken.jsonl").touch()
    assert run("--record", "taken.jsonl") == 2
    assert listed(capsys) == []
    assert main(["submit", "errand.py", "--db", "j.db", "--mission", "waits"]) == 0
    assert run("--mission", "waits", "--record", "taken.jsonl") == 2
    assert [row["id"] for row in listed(capsys)] == ["waits"]  # somebody wants it to wait
    assert run("--mission", "m", "--robot", "ghost", "--record", "taken.jsonl") == 2


def test_what_is_queued_is_listed_with_when_it_is_due(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["submit", "errand.py", "--db", "j.db"]
    assert main([*words, "--every", "0 8 * * 1-5"]) == 0
    [row] = listed(capsys)
    assert row["every"] == "0 8 * * 1-5"
    assert row["due"] > row["created"]
    assert missions("list") == 0
    assert "due" in capsys.readouterr().out


def test_a_list_is_a_page_of_the_newest_and_says_why_missions_wait(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for name in "abc":
        options = ["--robot", "/r1", "--group", "lift", "--priority", "2"]
        assert main(["submit", "errand.py", "--db", "q.db", "--mission", name, *options]) == 0
    store = open_store("q.db")
    store.claim("a", this_runner(), seconds=60)
    _list = ["missions", "list", "--durable", "q.db"]
    capsys.readouterr()
    assert main([*_list, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["id"] for row in rows] == ["c", "b", "a"]
    assert rows[0]["waits"] == (
        "waits: robot 'r1' is used by mission a; waits: group 'lift' is used by mission a"
    )
    assert (rows[0]["priority"], rows[0]["group"], rows[2]["waits"]) == (2, "lift", "")
    assert main([*_list, "--limit", "1", "--skip", "1"]) == 0
    page = capsys.readouterr().out
    assert "1 of 3 missions" in page
    assert [line.split()[0] for line in page.splitlines()[1:2]] == ["b"]
    for options, ids in (
        (["--status", "running"], ["a"]),
        (["--status", "queued", "--robot", "r1"], ["c", "b"]),
        (["--robot", "r2"], []),
    ):
        assert main([*_list, "--json", *options]) == 0
        assert [row["id"] for row in json.loads(capsys.readouterr().out)] == ids
    store.close()


def test_old_missions_are_pruned_except_failures(capsys: pytest.CaptureFixture[str]) -> None:
    store = open_store("q.db")
    for name, outcome in (("good", "done"), ("bad", "aborted"), ("asked", "preempted")):
        assert main(["submit", "errand.py", "--db", "q.db", "--mission", name]) == 0
        lease = store.claim(name, this_runner(), seconds=60)
        store.append(lease, [], status="ended", outcome=outcome)
        store.release(lease, "ended")
    assert main(["submit", "errand.py", "--db", "q.db", "--mission", "waits"]) == 0
    prune = ["missions", "prune", "--durable", "q.db"]
    capsys.readouterr()
    assert main([*prune, "--older-than", "1d"]) == 0
    assert capsys.readouterr().out.startswith("0 missions deleted")
    assert main([*prune, "--older-than", "0s", "--keep", "failed"]) == 0
    assert capsys.readouterr().out.startswith("1 mission deleted")
    assert [row.id for row in store.missions()] == ["bad", "asked", "waits"]
    runner = Runner(store, "q.db", robots=["nobody"], at_once=1, lease_s=15.0, prune=(0.0, "none"))
    runner.look()
    assert [row.id for row in store.missions()] == ["waits"]
    store.close()


def test_what_a_mission_calls_good_decides_whether_it_is_kept(tmp_path: Path) -> None:
    """By its name "outside" is no failure, and "lost" is one."""
    (tmp_path / "walk.py").write_text(
        "import smachpy\n\n\n@smachpy.mission(success=['home', 'lost'])\ndef mission():\n"
        "    return smachpy.Sequence(['home', 'lost', 'outside'], 'home', name='WALK')\n"
    )
    store = open_store("q.db")

    def end(outcome: str) -> None:
        assert main(["submit", "walk.py", "--db", "q.db", "--mission", outcome]) == 0
        lease = store.claim(outcome, this_runner(), seconds=60)
        store.append(lease, [], status="ended", outcome=outcome)
        store.release(lease, "ended")

    for outcome in ("home", "lost", "outside"):
        end(outcome)
    prune = ["missions", "prune", "--durable=q.db", "--older-than=0s", "--keep=failed"]
    assert main(prune) == 0
    assert [row.id for row in store.missions()] == ["outside"]
    end("lost")
    options = {"robots": ["nobody"], "at_once": 1, "lease_s": 15.0}
    Runner(store, "q.db", **options, prune=(0.0, "failed")).look()
    assert [row.id for row in store.missions()] == ["outside"]
    store.close()


def test_a_robot_has_one_name_however_it_is_submitted() -> None:
    for number, robot in enumerate(("r1", "/r1", "r1/", "/r1/")):
        words = ["submit", "errand.py", "--db", "q.db", f"--mission=m{number}", "--robot", robot]
        assert main(words) == 0
    with contextlib.closing(open_store("q.db")) as store:
        assert {row.robot for row in store.missions()} == {"r1"}


def test_a_mission_is_not_begun_again_before_its_process_has_ended() -> None:
    """It may have given it back already."""
    assert main(["submit", "errand.py", "--db", "q.db", "--mission", "m1"]) == 0
    with contextlib.closing(open_store("q.db")) as store:
        runner = Runner(store, "q.db", robots=[], at_once=2, lease_s=15.0)
        runner._processes["m1"] = None
        assert not runner._take()
        assert store.mission("m1").owner is None


def test_a_runner_keeps_nothing_of_missions_that_it_runs_no_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It kept the lease of each mission that it had ever taken."""
    clock = RealClock()
    over = clock.event("end of a process")
    over.set()
    for name in ("m1", "m2"):
        assert main(["submit", "errand.py", "--db", "q.db", f"--mission={name}"]) == 0
    with contextlib.closing(open_store("q.db")) as store:
        refuses = Runner(store, "q.db", robots=[], at_once=2, lease_s=15.0)
        refuses.look()
        assert (refuses._processes, refuses._leases) == ({}, {})
        runner = Runner(store, "q.db", robots=[], at_once=2, lease_s=15.0, allow=["."])
        monkeypatch.setattr(runner._starter, "start", lambda _words: MissionProcess(0, over, 2))
        runner.look()
        assert {*runner._leases} == {*runner._processes} == {"m1", "m2"}
        runner.look()
        assert (runner._processes, runner._leases) == ({}, {})


def test_an_empty_queue_is_not_one_whose_newest_missions_are_of_other_robots() -> None:
    """A list has 1,000 missions: the one that waits for its robot was not among them."""
    words = ["submit", "errand.py", "--db", "q.db", "--robot=r1"]
    for name in ("begun", "waits"):
        assert main([*words, f"--mission={name}"]) == 0
    with contextlib.closing(open_store("q.db")) as store:
        store.claim("begun", this_runner(), seconds=60)
        others = replace(store.mission("waits"), robot="r2")

        def fill(cursor: Any, _: bool) -> None:
            for number in range(PAGE):
                store._insert(cursor, replace(others, id=f"{number}"), 4e9)

        store._transact(fill)
        runner = Runner(
            store, "q.db", robots=["r1"], at_once=1, lease_s=15.0, allow=["."], until_empty=True
        )
        runner.look()
        assert not runner.idle


@pytest.mark.parametrize("text", ["", "30", "d", "-1d", "nan", "1e9d", "30 d"])
def test_what_is_no_age_is_refused(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["missions", "prune", f"--older-than={text}"])
    assert caught.value.code == 2
    assert "an age such as" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("size", "text"),
    [
        (0, "0 B"),
        (1023, "1023 B"),
        (1536, "1.5 KiB"),
        (3 * 2**20, "3.0 MiB"),
        (2**41, "2048.0 GiB"),
    ],
)
def test_sizes_for_people(size: int, text: str) -> None:
    assert size_text(size) == text


DRIVES = """
import smachpy
from actionlib_core.interfaces.actionlib.msg import TestAction


def mission(name: str = "/r1/move_base"):
    machine = smachpy.StateMachine(["succeeded", "aborted", "preempted"], name="DRIVES")
    machine.add("DRIVE", smachpy.SimpleActionState(name, TestAction))
    return machine
"""


def test_two_missions_that_drive_one_robot_by_different_names_do_not_run_at_once() -> None:
    """By the names of their actions, in place of --robot, two runners drove one robot at once."""
    Path("drives.py").write_text(DRIVES)
    submit = ["submit", "drives.py", "--db", "q.db", "--mission"]
    assert main([*submit, "a"]) == 0
    assert main([*submit, "b", "--robot", "r1", "--", "move_base"]) == 0
    assert main([*submit, "c", "--robot", "/r1", "--", "/r1/arm/grip"]) == 0
    assert main([*submit, "d", "--robot", "r2"]) == 0  # it drives r1 all the same
    assert main([*submit, "e", "--robot", "r2", "--", "move_base"]) == 0
    with contextlib.closing(open_store("q.db")) as store:
        assert [row.held_robot for row in store.missions()] == ["r1", "r1", "r1", "r1", "r2"]
        taken = []
        while (found := store.reserve(this_runner(), seconds=60)) is not None:
            taken.append(found[0].id)
    assert taken == ["a", "e"]
