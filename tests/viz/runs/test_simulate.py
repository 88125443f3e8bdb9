"""Many simulated runs, and their report."""

from __future__ import annotations

import re
import subprocess
import sys
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from xml.etree import ElementTree as ET

import pytest

from smachpy.command import main
from smachpy.events.recording import each_recording
from smachpy.exceptions import MissionError, SmachError
from viz.runs.report import by_quarter, collect, report
from viz.runs.simulate import Plan, Vary, simulate

MISSION = """
import smachpy

class Work(smachpy.State):
    def __init__(self, seconds, name):
        super().__init__(outcomes=["done", "failed"])
        self.seconds, self.name = seconds, name

    def execute(self, userdata):
        print("not for the terminal")
        if self.name == "broken":
            raise RuntimeError("<script>no such tool")
        self.sleep(self.seconds)
        return "done" if self.seconds < 60 else "failed"

def mission(seconds: float = 1.0, name: str = "x"):
    sm = smachpy.StateMachine(outcomes=["succeeded", "aborted"], name="JOB")
    with sm:
        sm.add("WORK", Work(seconds, name), {"done": "REST", "failed": "aborted"})
        sm.add("REST", Work(1.0, "x"), {"done": "succeeded", "failed": "aborted"})
    return sm
"""


class Here(Executor):
    """Does everything at once, in this thread."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@pytest.fixture
def job(tmp_path):
    path = tmp_path / "job.py"
    path.write_text(MISSION)
    (tmp_path / "runs").mkdir()
    return str(path)


def plan(job, tmp_path, runs, *vary, seed=1):
    return Plan(job, runs, tmp_path / "runs", [Vary.read(text) for text in vary], seed)


def test_runs_vary_over_the_whole_range_and_end_differently(job, tmp_path, capsys):
    results = simulate(plan(job, tmp_path, 8, "seconds=0..120"), Here())
    values = sorted(result.task.values["seconds"] for result in results)
    for number, value in enumerate(values):  # one in each of eight parts
        assert number * 15 <= value <= (number + 1) * 15
    assert [result.outcome for result in results].count("succeeded") == 4
    for result in results:
        assert (result.outcome == "aborted") == (result.task.values["seconds"] >= 60)
    runs = collect(each_recording([tmp_path / "runs"]))["JOB"]
    assert runs.statistics.outcomes == {"succeeded": 4, "aborted": 4}
    assert (["WORK"], "aborted") in runs.ways
    assert (["WORK", "REST"], "succeeded") in runs.ways
    quarters = by_quarter(runs, {str(r.task.file): r.task.values for r in results}, "seconds")
    assert [dict(ends) for _, ends in quarters] == [
        {"succeeded": 2}, {"succeeded": 2}, {"aborted": 2}, {"aborted": 2},
    ]  # fmt: skip
    assert capsys.readouterr().out == ""


def test_the_same_seed_makes_the_same_runs(job, tmp_path):
    def values(seed):
        tasks = plan(job, tmp_path, 5, "seconds=1..9", "name=a,b", seed=seed).tasks()
        return [(task.seed, dict(task.values)) for task in tasks]

    assert values(1) == values(1) != values(2)
    assert [value["name"] for _, value in values(1)] == ["a", "b", "a", "b", "a"]


def test_whole_numbers_stay_whole_and_meet_both_ends():
    found = {Vary.read("n=1..3").value(run, 300, 1) for run in range(300)}
    assert found == {1, 2, 3}


def test_a_run_that_raises_is_told_and_the_others_go_on(job, tmp_path):
    results = simulate(plan(job, tmp_path, 4, "name=broken,x"), Here())
    assert [result.outcome for result in results] == [None, "succeeded", None, "succeeded"]
    assert "no such tool" in results[0].error


def test_other_executors_do_it_too(job, tmp_path):
    with ThreadPoolExecutor(1) as threads:
        results = simulate(plan(job, tmp_path, 2), threads)
    assert [result.outcome for result in results] == ["succeeded"] * 2


def test_parameters_of_the_robot_can_vary(tmp_path):
    results = simulate(
        Plan("there_and_back", 2, tmp_path, [Vary.read("robot.max_speed=0.5..0.9")]), Here()
    )
    assert {result.error for result in results} == {""}
    assert not list(tmp_path.glob("*.yaml"))


@pytest.mark.parametrize(
    "text",
    ["", "x", "x=", "=1..2", "x=..", "x=1..", "x=2..1", "x=nan..1", "x=1..inf", "x=a..b"],
)
def test_what_is_no_range_is_refused(text):
    with pytest.raises(ValueError, match="expected"):
        Vary.read(text)


@pytest.mark.parametrize("key", ["color", "robot.wings", "robot"])
def test_an_unknown_key_names_the_known_ones(job, tmp_path, key):
    with pytest.raises(MissionError, match=r"battery\.charge.*seconds"):
        plan(job, tmp_path, 2, f"{key}=1..2").tasks()


def test_the_robot_of_a_world_is_the_worlds(tmp_path):
    with pytest.raises(SmachError, match="plays in a world"):
        Plan("delivery", 2, tmp_path, [Vary.read("battery=0..1")]).tasks()


def test_the_report_shows_all_and_runs_nothing(job, tmp_path):
    results = simulate(plan(job, tmp_path, 6, "name=<b>x,broken", "seconds=1..99"), Here())
    values = {str(result.task.file): result.task.values for result in results}
    runs = collect(each_recording([tmp_path / "runs"]))["JOB"]
    page = report(runs, before=runs, values=values)
    for title in (
        "Outcomes",
        "What varied",
        "Ways taken",
        "The machine",
        "Time by state",
        "States",
    ):
        assert f"<h2>{title}</h2>" in page
    assert "no notable difference" in page
    assert "<script" not in page
    assert "<b>x" not in page
    for chart in re.findall(r'<svg class="chart".*?</svg>', page, re.DOTALL):
        ET.fromstring(chart)


def test_the_command_prints_a_table_and_writes_a_report(job, tmp_path, capsys):
    folder, page = tmp_path / "kept", tmp_path / "report.html"
    words = ["simulate", job, "--runs", "4", "--vary", "seconds=1..119", "--jobs", "2"]
    done = subprocess.run(  # a pool leaves a process of Python's behind until the program ends
        [sys.executable, "-m", "smachpy.command", *words, "--record", folder, "-o", page],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    out = done.stdout
    assert "JOB: 4 run(s)" in out
    assert "succeeded x2" in out
    assert "seconds:" in out
    assert "not for the terminal" not in out
    assert page.read_text().startswith("<!doctype html>")
    assert len(list(folder.iterdir())) == 4
    assert main(["runs", "export", str(folder), "-o", str(tmp_path / "all.html")]) == 0
    assert "JOB: 4 runs" in (tmp_path / "all.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--vary", "color=1..2"], "--vary color"),
        (["--vary", "seconds=1..2", "--vary", "seconds=3..4"], "expected each key once"),
        (["--compare", "nowhere"], "nowhere"),
        (["--record", "."], "not empty"),
    ],
)
def test_bad_requests_end_with_2(job, tmp_path, monkeypatch, capsys, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", job, *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error


@pytest.mark.parametrize("ending", ["run.mcap", "run"])
def test_a_folder_is_exported_as_a_page_only(job, tmp_path, capsys, ending):
    simulate(plan(job, tmp_path, 1), Here())
    assert main(["runs", "export", str(tmp_path / "runs"), "-o", str(tmp_path / ending)]) == 2
    assert "expected .html" in capsys.readouterr().err
