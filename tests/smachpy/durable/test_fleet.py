"""Missions in a queue: real runners, killed and suspended, and what they leave to one another."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import time
from dataclasses import replace

import pytest

from actionlib_core import node
from smachpy.command import main
from smachpy.command.durable import whole_target
from smachpy.command.fleet import MAX_UNFIT_STARTS, _Rest, recording_name
from smachpy.durable.opening import open_store
from smachpy.events.recording import read_recording
from tests.smachpy.durable.test_stores import ROW

pytestmark = pytest.mark.timeout(900)  # several processes after one another, on a busy computer

MISSION = """
import os
import time
from pathlib import Path

import smachpy
from smachpy import StateMachine

HERE = Path(__file__).parent


def note(text):
    with (HERE / "log").open("a") as log:
        log.write(f"{text} {os.getpid()}\\n")


@smachpy.state(outcomes=["done"], input_keys=["name"])
def first(userdata):
    note(f"first {userdata.name}")
    return "done"


@smachpy.state(outcomes=["done"], input_keys=["name"])
def wait(userdata):
    note(f"wait {userdata.name}")
    while not (HERE / f"go_{userdata.name}").exists():
        time.sleep(0.02)
    note(f"end {userdata.name}")
    return "done"


def mission(name: str = "a"):
    machine = StateMachine(["done"], name="ERRAND")
    machine.userdata.name = name
    with machine:
        StateMachine.add("FIRST", first, {"done": "WAIT"})
        StateMachine.add("WAIT", wait)
    return machine
"""
WITHIN_S = 60


@pytest.fixture
def errand(tmp_path):
    file = tmp_path / "errand.py"
    file.write_text(MISSION)
    return file


def submit(errand, place, name, *options):
    assert (
        main(["submit", str(errand), "--db", place, "--mission", name, *options, "--", name]) == 0
    )


def runner(place, *options, start=("-m", "smachpy.command")):
    """Start a runner with its processes in one group, as on one computer."""
    return subprocess.Popen(
        [
            sys.executable,
            *start,
            "runner",
            "--db",
            place,
            "--allow",
            "/",
            *options,
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )


def log_of(errand):
    file = errand.parent / "log"
    return [tuple(line.split()) for line in file.read_text().splitlines()] if file.exists() else []


def until(condition):
    """Wait for what other processes do."""
    deadline = time.monotonic() + WITHIN_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def pid_that(errand, what, name):
    until(lambda: any(line[:2] == (what, name) for line in log_of(errand)))
    return next(
        int(pid) for kind, who, pid in reversed(log_of(errand)) if (kind, who) == (what, name)
    )


def end(process):
    process.kill()
    process.communicate()


def statuses(place):
    store = open_store(place)
    try:
        return {row.id: (row.status, row.outcome) for row in store.missions()}
    finally:
        store.close()


@pytest.mark.slow
def test_a_runner_takes_what_was_submitted(errand, tmp_path, capsys):
    place = str(tmp_path / "queue.db")
    for name in ("a", "b"):
        submit(errand, place, name)
        (tmp_path / f"go_{name}").touch()
    submit(errand, place, "later", "--at", "2100-01-01T00:00Z")
    assert main(["missions", "cancel", "later", "--durable", place]) == 0
    process = runner(place, "--until-empty", "--record", str(tmp_path / "runs"))
    output, _ = process.communicate(timeout=WITHIN_S)
    assert process.returncode == 0, output
    found = [read_recording(path) for path in (tmp_path / "runs").iterdir()]
    assert sorted(one.origin["mission"]["words"] for one in found) == [["a"], ["b"]]
    assert all(one.events[-1]["outcome"] == "done" for one in found)
    assert statuses(place) == {
        "a": ("ended", "done"),
        "b": ("ended", "done"),
        "later": ("cancelled", None),
    }
    assert [line[:2] for line in log_of(errand)] == [
        (what, name) for name in ("a", "b") for what in ("first", "wait", "end")
    ]


@pytest.mark.slow
def test_what_a_dead_computer_ran_goes_on_at_another(errand, tmp_path, store_place):
    submit(errand, store_place, "a")
    dead = runner(store_place)
    child = pid_that(errand, "wait", "a")
    os.kill(dead.pid, signal.SIGKILL)
    os.kill(child, signal.SIGKILL)
    end(dead)
    other = runner(store_place, "--until-empty")
    try:
        until(lambda: pid_that(errand, "wait", "a") != child)
        (tmp_path / "go_a").touch()
        output, _ = other.communicate(timeout=WITHIN_S)
    finally:
        end(other)
    assert "is resumed" in output
    assert statuses(store_place) == {"a": ("ended", "done")}
    assert [line[0] for line in log_of(errand)] == ["first", "wait", "wait", "end"]


@pytest.mark.postgres
def test_a_computer_that_comes_back_is_refused(errand, tmp_path, postgres_url):
    submit(errand, postgres_url, "a")
    suspended = runner(postgres_url, "--lease", "6")
    child = pid_that(errand, "wait", "a")
    for pid in (suspended.pid, child):
        os.kill(pid, signal.SIGSTOP)
    other = runner(postgres_url)
    try:
        until(lambda: pid_that(errand, "wait", "a") != child)
        for pid in (child, suspended.pid):
            os.kill(pid, signal.SIGCONT)
        lines = []
        while "exit code 2" not in "".join(lines[-1:]):
            lines.append(suspended.stdout.readline())
            assert lines[-1], lines
        assert any("taken it over" in line for line in lines), lines
        assert statuses(postgres_url) == {"a": ("running", None)}
        (tmp_path / "go_a").touch()
        until(lambda: statuses(postgres_url) == {"a": ("ended", "done")})
    finally:
        for _, _, pid in log_of(errand):
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(pid), signal.SIGKILL)
        end(suspended)
        end(other)
    assert statuses(postgres_url) == {"a": ("ended", "done")}
    ends = [pid for what, _, pid in log_of(errand) if what == "end"]
    assert len(ends) == 1
    assert int(ends[0]) != child


@pytest.mark.slow
def test_a_robot_has_one_mission_at_a_time(errand, tmp_path):
    place = str(tmp_path / "queue.db")
    for name, robot in (("a", "r1"), ("b", "r1"), ("c", "r2"), ("d", "r3")):
        submit(errand, place, name, "--robot", robot)
    process = runner(place, "--robot", "r1", "--robot", "r2", "--at-once", "3")
    try:
        pid_that(errand, "wait", "a")
        pid_that(errand, "wait", "c")
        store = open_store(place)
        assert store.mission("b").status == "queued"
        (tmp_path / "go_a").touch()
        pid_that(errand, "wait", "b")
        assert store.mission("d").status == "queued"
        store.close()
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=WITHIN_S)
    finally:
        end(process)
    assert statuses(place) == {
        "a": ("ended", "done"),
        "b": ("interrupted", None),
        "c": ("interrupted", None),
        "d": ("queued", None),
    }


RESTS_SHORTLY = """
import sys
from smachpy.command import fleet, main

fleet.LOOK_S = fleet.FIRST_REST_S = 0.1
sys.exit(main())
"""


def test_a_mission_that_cannot_run_here_is_left_to_others(errand, tmp_path):
    place = str(tmp_path / "queue.db")
    for name in "abcde":
        submit(errand, place, name)
    errand.rename(tmp_path / "gone.py")
    process = runner(place, "--until-empty", start=("-c", RESTS_SHORTLY))
    output, _ = process.communicate(timeout=WITHIN_S)
    assert process.returncode == 2, output  # work is left
    assert statuses(place) == dict.fromkeys("abcde", ("queued", None))
    assert output.count("begins") == 5
    with contextlib.closing(open_store(place)) as store:
        notes = [store.mission(name).note for name in "abcde"]
    assert all(str(errand) in note for note in notes), notes  # the file that is missing


@pytest.mark.parametrize("run", ["../../etc/x 17", "", "/", "x" * 5000, "a\0b", "ä\ud800", ".."])
def test_a_recording_stays_in_its_folder_whatever_a_row_says(run):
    name = recording_name(run)
    assert re.fullmatch(r"[A-Za-z0-9_-]*\.jsonl", name)
    assert len(name) < 130
    assert name != recording_name(f"{run}_")


def test_pauses_grow_with_each_attempt_that_fails():
    rest, target_rest = _Rest(), _Rest()
    pauses = []
    for _ in range(2000):
        rest.fail(100.0)
        target_rest.fail(100.0, MAX_UNFIT_STARTS - 1)
        pauses.append((rest.until - 100.0, target_rest.until - 100.0))
    assert pauses[:4] == [(5.0, 0.0), (10.0, 0.0), (20.0, 5.0), (40.0, 10.0)]
    assert pauses[-1] == (300.0, 300.0)


@pytest.mark.slow
def test_missions_of_an_old_version_hold_up_none_of_the_new_one(errand, tmp_path, capsys):
    """After an update their file rested, minutes long: they could not begin on that computer."""
    place = str(tmp_path / "queue.db")
    old = [f"old{n}" for n in range(5)]
    for name in old:
        submit(errand, place, name)
    errand.write_text(MISSION.replace("FIRST", "CHECK"))
    submit(errand, place, "new")
    (tmp_path / "go_new").touch()
    process = runner(place)
    try:
        until(lambda: statuses(place)["new"] == ("ended", "done"))
    finally:
        end(process)
    assert {statuses(place)[name] for name in old} == {("queued", None)}
    assert {line[1] for line in log_of(errand)} == {"new"}


@pytest.mark.slow
def test_the_last_runner_resumes_what_died_before_it_ends(errand, tmp_path, capsys):
    """The pause after an attempt that failed was taken for an empty queue."""
    place = str(tmp_path / "queue.db")
    submit(errand, place, "a")
    process = runner(place, "--until-empty")
    os.kill(pid_that(errand, "wait", "a"), signal.SIGKILL)
    (tmp_path / "go_a").touch()
    output, _ = process.communicate(timeout=WITHIN_S)
    assert process.returncode == 0, output
    assert statuses(place) == {"a": ("ended", "done")}


@pytest.mark.slow
def test_each_mission_runs_once_while_runners_are_killed_and_others_start(
    errand, tmp_path, store_place
):
    names = [f"m{n}" for n in range(12)]
    for name in names:
        submit(errand, store_place, name)
        (tmp_path / f"go_{name}").touch()
    runners = [runner(store_place) for _ in range(3)]
    try:
        for after in (1, 3, 5, 7):  # missions that have begun
            until(lambda least=after: len(log_of(errand)) > 3 * least)
            end(runners.pop(0))
            runners.append(runner(store_place))
        until(lambda: set(statuses(store_place).values()) == {("ended", "done")})
    finally:
        for one in runners:
            end(one)
    ran = [line[:2] for line in log_of(errand)]
    assert sorted(ran) == sorted(
        (what, name) for what in ("first", "wait", "end") for name in names
    )


@pytest.mark.slow
def test_one_mission_that_cannot_be_started_stops_no_other(errand, tmp_path, capsys):
    place = str(tmp_path / "queue.db")
    store = open_store(place)
    good = whole_target(str(errand))
    schedule = {"every": "0 8 * * * Nowhere/Land", "due": 1.0}
    store.create(replace(ROW, id="null", target=good, argv=("a\0b",), robot="r1"))
    store.create(replace(ROW, id="long", target=good, argv=("x" * 200_000,), robot="r2"))
    store.create(replace(ROW, id="zone", target=good, **schedule))
    store.close()
    raw = sqlite3.connect(place)
    raw.execute("UPDATE smachpy_missions SET structure = 'text' WHERE id = 'null'")
    raw.commit()
    raw.close()
    submit(errand, place, "good")
    (tmp_path / "go_good").touch()
    process = runner(place)
    try:
        until(lambda: statuses(place)["good"] == ("ended", "done"))
    finally:
        process.send_signal(signal.SIGTERM)
        output, _ = process.communicate(timeout=WITHIN_S)
    assert process.returncode == 0, output
    assert "mission zone: its schedule is left to other runners" in output
    assert output.count("mission zone") == 1
    left = open_store(place).missions(statuses=["queued"])
    assert {row.id for row in left} >= {"long", "zone"}


def test_a_schedule_is_kept_and_shown(errand, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(node, "_default", node._Default())  # another test may have joined one
    place = str(tmp_path / "queue.db")
    submit(errand, place, "night", "--every", "0 3 * * * Europe/Berlin", "--robot", "r1")
    store = open_store(place)
    row = store.mission("night")
    assert (row.every, row.robot, row.argv) == ("0 3 * * * Europe/Berlin", "r1", ("--", "night"))
    assert row.due > row.created
    store.close()
    capsys.readouterr()
    assert main(["missions", "list", "--json", "--durable", place]) == 0
    assert [each["id"] for each in json.loads(capsys.readouterr().out)] == ["night"]
    # A run of the same file is another mission.
    (tmp_path / "go_night").touch()
    words = ["--plain", "--robot", "r1", "--durable", place, "--", "night"]
    assert main(["run", str(errand), *words]) in {0, 1}
    assert len(statuses(place)) == 2


@pytest.mark.parametrize(
    "options",
    [
        ["--every", "daily"],
        ["--every", "* * * * * Nowhere"],
        ["--at", "soon"],
        ["--at", "08:00", "--every", "* * * * *"],
        ["--at", "2020-01-01T00:00"],
        ["--at", "2100-01-02T00:00", "--not-after", "2100-01-01T00:00"],
        ["--every", "* * * * *", "--not-after", "2100-01-01T00:00"],
        ["--priority", "high"],
        ["--priority", "1e3"],
        ["--group", "no good"],
        ["--robot", "no good"],
        ["--input", "nothing=1"],
        ["--db", "mysql://db"],
        ["--", "a", "b", "c"],
    ],
    ids=" ".join,
)
def test_what_cannot_be_submitted_is_refused(errand, tmp_path, options, capsys):
    place = tmp_path / "queue.db"
    try:
        code = main(["submit", str(errand), "--db", str(place), *options])
    except SystemExit as error:
        code = error.code
    assert code == 2
    assert capsys.readouterr().err
    assert not place.exists()


@pytest.mark.parametrize(
    "options",
    [
        ["--at-once", "0"],
        ["--at-once", "x"],
        ["--lease", "-1"],
        ["--lease", "nan"],
        ["--robot", "a b"],
    ],
)
def test_a_runner_refuses_bad_options(tmp_path, options, capsys):
    try:
        code = main(["runner", "--db", str(tmp_path / "queue.db"), "--until-empty", *options])
    except SystemExit as error:
        code = error.code
    assert code == 2
    assert capsys.readouterr().err
