"""Many simulated runs, and their report."""

from __future__ import annotations

import json
import os
import random
import re
import select
import signal
import subprocess
import sys
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from xml.etree import ElementTree as ET

import pytest

import smachpy_viz.runs.simulate
from smachpy.command import main
from smachpy.events.introspection import StateRecord
from smachpy.events.recording import each_recording, read_recording
from smachpy.exceptions import MissionError, SmachError
from smachpy_viz.runs.report import MachineRuns, by_quarter, collect, report
from smachpy_viz.runs.simulate import SimulationPlan, Vary, simulate
from smachpy_viz.runs.statistics import StateStatistics

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
    return SimulationPlan(job, runs, tmp_path / "runs", [Vary.read(text) for text in vary], seed)


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
    assert [" to " in words for words, _ in quarters] == [True] * 4
    few = dict(list({str(r.task.file): r.task.values for r in results}.items())[:4])
    assert not any(" to " in words for words, _ in by_quarter(runs, few, "seconds"))
    assert capsys.readouterr().out == ""


def test_the_same_seed_makes_the_same_runs(job, tmp_path):
    def values(seed):
        tasks = plan(job, tmp_path, 5, "seconds=1..9", "name=a,b", seed=seed).tasks()
        return [(task.seed, dict(task.values)) for task in tasks]

    assert values(1) == values(1) != values(2)
    assert [value["name"] for _, value in values(1)] == ["a", "b", "a", "b", "a"]


def test_a_mission_draws_the_same_random_numbers_with_the_same_seed(tmp_path):
    dice = tmp_path / "dice.py"
    dice.write_text("""
import random
import smachpy

@smachpy.state(outcomes=[str(i) for i in range(1000)])
def draw(userdata):
    return str(random.randrange(1000))

def mission():
    sm = smachpy.StateMachine(outcomes=[str(i) for i in range(1000)], name="DICE")
    sm.add("DRAW", draw)
    return sm
""")
    before = random.getstate()

    def draw(seed, folder):
        (tmp_path / folder).mkdir()
        runs = simulate(SimulationPlan(str(dice), 3, tmp_path / folder, [], seed), Here())
        return [run.outcome for run in runs]

    drawn = draw(1, "a")
    assert drawn == draw(1, "b") != draw(2, "c")
    assert None not in drawn
    assert len(set(drawn)) > 1
    assert random.getstate() == before


def test_whole_numbers_stay_whole_and_meet_both_ends():
    found = {Vary.read("n=1..3").value(run, 300, 1) for run in range(300)}
    assert found == {1, 2, 3}


def test_a_run_that_raises_is_told_and_the_others_go_on(job, tmp_path):
    results = simulate(plan(job, tmp_path, 4, "name=broken,x"), Here())
    assert [result.outcome for result in results] == [None, "succeeded", None, "succeeded"]
    assert "no such tool" in results[0].error


def test_a_run_without_the_packages_of_the_robot_says_what_to_install(job, tmp_path, monkeypatch):
    def fail(*_):
        raise ModuleNotFoundError("No module named 'scipy'", name="scipy")

    monkeypatch.setattr(smachpy_viz.runs.simulate, "open_surroundings", fail)
    (result,) = simulate(plan(job, tmp_path, 1), Here())
    assert result.error == "package 'scipy' is missing. Try: pip install 'smachpy[sim]'"


def test_other_executors_do_it_too(job, tmp_path):
    with ThreadPoolExecutor(1) as threads:
        results = simulate(plan(job, tmp_path, 2), threads)
    assert [result.outcome for result in results] == ["succeeded"] * 2


CHARGED = """
import smachpy

@smachpy.cb_interface(input_keys=["battery"], outcomes=["done", "failed"])
def go(userdata):
    return "done" if userdata.battery > 0.5 else "failed"

def mission():
    sm = smachpy.StateMachine(outcomes=["done", "failed"], input_keys=["battery"])
    with sm:
        smachpy.StateMachine.add("GO", smachpy.CBState(go))
    return sm
"""


def test_a_key_of_the_mission_comes_before_a_short_name_of_the_robots_parameters(tmp_path):
    (tmp_path / "charged.py").write_text(CHARGED)
    plan = SimulationPlan(str(tmp_path / "charged.py"), 2, tmp_path, [Vary.read("battery=0.2,0.8")])
    assert [one.outcome for one in simulate(plan, Here())] == ["failed", "done"]


def test_parameters_of_the_robot_can_vary(tmp_path):
    results = simulate(
        SimulationPlan("there_and_back", 2, tmp_path, [Vary.read("robot.max_speed=0.5..0.9")]),
        Here(),
    )
    assert {result.error for result in results} == {""}
    assert not list(tmp_path.glob("*.yaml"))


def test_recordings_have_the_map_the_poses_and_the_battery_of_the_robot(tmp_path):
    [result] = simulate(SimulationPlan("shuttle", 1, tmp_path, []), Here())
    told = read_recording(result.task.file).observed
    assert {"map", "pose", "plan"} <= {one["what"] for one in told}
    assert "battery" in {one["name"] for one in told if one["what"] == "value"}
    assert "scan" not in {one["what"] for one in told}  # they would take longer than the run
    assert told == sorted(told, key=lambda one: one["stamp_ns"])


def test_a_parameter_of_the_robot_that_is_no_number_is_named(tmp_path):
    vary = Vary.read("robot.max_speed=slow,fast")
    [result] = simulate(SimulationPlan("there_and_back", 1, tmp_path, [vary]), Here())
    assert "robot.max_speed: got 'slow'; expected a number" in result.error


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
    with pytest.raises(SmachError, match="runs in its own world"):
        SimulationPlan("delivery", 2, tmp_path, [Vary.read("battery=0..1")]).tasks()


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
    for result in results:
        assert f"<td >{result.task.file.name}</td>" in page
    assert str(tmp_path) not in page


def test_the_report_shows_what_a_monitor_finds_as_no_failure():
    record = StateRecord("/JOB", "JOB", "machine", "StateMachine", ("invalid",), children=(
        StateRecord("/JOB/WATCH", "WATCH", "monitor", "MonitorState", ("invalid",)),
        StateRecord("/JOB/TRY", "TRY", "state", "State", ("invalid",)),
    ))  # fmt: skip
    runs = MachineRuns(record)
    for path, kind in (("/JOB/WATCH", "monitor"), ("/JOB/TRY", "state")):
        runs.statistics.states[path] = StateStatistics(1, [1.0], {"invalid": 1}, kind=kind)
    page = report(runs)
    assert page.count('<span class="other">invalid</span>') == 1
    assert page.count('<span class="failure">invalid</span>') == 1


@pytest.mark.slow
def test_the_command_prints_a_table_and_writes_a_report(job, tmp_path, capsys):
    folder, page = tmp_path / "kept", tmp_path / "report.html"
    words = ["simulate", job, "--runs", "4", "--vary", "seconds=1..119", "--jobs", "2"]
    done = subprocess.run(  # a pool leaves a process of Python's behind until the program ends
        [sys.executable, "-m", "smachpy.command", *words, "--record", folder, "-o", page],
        capture_output=True,
        text=True,
        timeout=250,
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


@pytest.mark.slow
def test_what_it_prints_does_not_depend_on_the_number_of_processes(job, capfd):
    said = []
    for jobs in ("1", "3"):
        words = ["--runs", "7", "--vary", "seconds=1..119", "--jobs", jobs, "--json"]
        assert main(["simulate", job, *words]) == 0
        said.append(capfd.readouterr().out.splitlines())
    assert said[0] == said[1]
    assert [json.loads(line)["run"] for line in said[0]] == list(range(1, 8))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--vary", "color=1..2"], "--vary color"),
        (["--vary", "seconds=1..2", "--vary", "seconds=3..4"], "expected each key once"),
        (["--compare", "nowhere"], "nowhere"),
        (["--record", "."], "not empty"),
        (["--record", "new", "-o", "report.pdfx"], "expected html, or one of dot"),
        (["--record", "new", "-o", "report"], "got no extension"),
        (["--record", "new", "-o", "none/report.html"], "got no folder 'none'"),
    ],
)
def test_bad_requests_end_with_2(job, tmp_path, monkeypatch, capsys, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", job, *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error
    assert not list(tmp_path.glob("new/*"))  # nothing has run


@pytest.mark.slow
def test_a_report_may_have_its_extension_in_capitals(job, tmp_path, capsys):
    words = ["simulate", job, "--runs", "1", "--jobs", "1", "--record", str(tmp_path / "runs")]
    for command in (words, ["runs", "export", str(tmp_path / "runs")]):
        assert main([*command, "-o", str(tmp_path / "A.HTML")]) == 0
        assert (tmp_path / "A.HTML").read_text().startswith("<!doctype html>")
        (tmp_path / "A.HTML").unlink()


@pytest.mark.parametrize("ending", ["run.mcap", "run"])
def test_a_folder_is_exported_as_a_page_only(job, tmp_path, capsys, ending):
    simulate(plan(job, tmp_path, 1), Here())
    assert main(["runs", "export", str(tmp_path / "runs"), "-o", str(tmp_path / ending)]) == 2
    assert "expected .html" in capsys.readouterr().err


ENDLESS = """
import smachpy

class Wait(smachpy.State):
    def __init__(self, seconds):
        super().__init__(outcomes=["again", "preempted"])
        self.seconds = seconds

    def execute(self, userdata):
        self.sleep(self.seconds)
        return "preempted" if self.preempt_requested() else "again"

def mission(seconds: float = 1.0):
    sm = smachpy.StateMachine(outcomes=["preempted"], name="ENDLESS")
    with sm:
        sm.add("WAIT", Wait(seconds), {"again": "WAIT"})
    return sm
"""


@pytest.mark.slow
@pytest.mark.parametrize("seconds", ["1.0", "0.0"])
def test_a_mission_that_never_ends_is_named(tmp_path, seconds):
    """One that waits, and one that only goes round: no time passes then."""
    (tmp_path / "endless.py").write_text(ENDLESS)
    (tmp_path / "runs").mkdir()
    vary = [Vary.read(f"seconds={seconds}")]
    endless = SimulationPlan(str(tmp_path / "endless.py"), 1, tmp_path / "runs", vary, limit=60.0)
    [result] = simulate(endless, Here())
    assert result.outcome is None
    assert "WAIT" in result.error
    [recording] = each_recording([tmp_path / "runs"])
    assert recording.events[-1]["outcome"] == "preempted"


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    (tmp_path / "cluster.py").write_text(
        "from concurrent.futures import ThreadPoolExecutor\n"
        "def executor():\n    return ThreadPoolExecutor(1)\n"
        "def nothing():\n    return 7\n"
    )
    monkeypatch.chdir(tmp_path)
    yield "cluster:executor"
    sys.modules.pop("cluster", None)


def test_the_limit_is_an_option_and_each_run_an_object(tmp_path, capsys, cluster):
    (tmp_path / "endless.py").write_text(ENDLESS)
    words = ["simulate", "endless.py", "--runs", "2", "--executor", cluster]
    assert main([*words, "--limit", "30s", "--json"]) == 1
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [(one["run"], one["outcome"]) for one in told] == [(1, None), (2, None)]
    with pytest.raises(SystemExit):
        main([*words, "--limit", "soon"])


def test_the_executor_of_a_cluster_is_an_option(job, cluster, capsys):
    words = ["simulate", job, "--runs", "2", "--executor"]
    assert main([*words, cluster]) == 0
    assert "succeeded x2" in capsys.readouterr().out
    for wrong in ("cluster", "cluster:gone", "cluster:nothing", "no_such_module_here:x"):
        assert main([*words, wrong]) == 2


def test_recordings_come_back_from_where_the_folder_is_not(job, tmp_path):
    class Elsewhere(Here):
        def submit(self, fn, task):
            return super().submit(fn, replace(task, file=tmp_path / "gone" / task.file.name))

    [result] = simulate(plan(job, tmp_path, 1), Elsewhere())
    assert result.outcome == "succeeded"
    assert result.task.file == tmp_path / "runs" / "0001.jsonl"
    assert len(list(each_recording([tmp_path / "runs"]))) == 1


DIES = """
import os, smachpy

def mission(kind: str = "good"):
    sm = smachpy.StateMachine(["done"], name="SIM")
    end = lambda userdata: os._exit(3) if kind == "crash" else "done"
    sm.add("WORK", smachpy.CBState(end, outcomes=["done"]))
    return sm
"""


@pytest.mark.slow
def test_a_run_whose_process_dies_is_named_and_the_others_end(tmp_path, capsys, monkeypatch):
    (tmp_path / "dies.py").write_text(DIES)
    (tmp_path / "signal.py").write_text("RED = 1")  # a pool of `concurrent.futures` imported it
    monkeypatch.chdir(tmp_path)
    words = ["simulate", "dies.py", "--runs", "6", "--vary", "kind=good,good,crash"]
    assert main(words) == 1
    printed = capsys.readouterr().out
    assert "done x4" in printed
    assert "run 3: its process died 3 times: exit code 3 (kind=crash)" in printed
    assert "run 6: its process died 3 times: exit code 3 (kind=crash)" in printed


STAYS = """
import os, smachpy

@smachpy.state(outcomes=["done"])
def stay(userdata):
    with open(os.environ["PIPE"], "w") as pipe:
        print(os.getpid(), file=pipe, flush=True)
        os.read(os.pipe()[0], 1)  # for ever, in real time
    return "done"

def mission():
    sm = smachpy.StateMachine(outcomes=["done"], name="STAYS")
    with sm:
        sm.add("STAY", stay)
    return sm
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"),
    [(signal.SIGKILL, -9), (signal.SIGTERM, 143), (signal.SIGINT, 130)],
)
def test_a_command_that_is_ended_leaves_no_process_and_no_file_behind(tmp_path, number, code):
    (tmp_path / "stays.py").write_text(STAYS)
    pipe, files = tmp_path / "pipe", tmp_path / "files"
    os.mkfifo(pipe)
    files.mkdir()
    mission = str(tmp_path / "stays.py")
    command = subprocess.Popen(
        [sys.executable, "-m", "smachpy.command", "simulate", mission, "--runs", "2"],
        env={**os.environ, "PIPE": str(pipe), "TMPDIR": str(files)},
    )
    with pipe.open() as ends:
        worker = int(ends.readline())
        command.send_signal(number)
        assert command.wait(120) == code
        ended, _, _ = select.select([ends], [], [], 120)  # its end closes the pipe
        if not ended:
            os.kill(worker, signal.SIGKILL)
    assert ended, f"process {worker} runs on"
    assert number == signal.SIGKILL or not [*files.glob("smachpy-*")]
