"""Simulated runs that the page starts."""

from __future__ import annotations

import contextlib
import json
import threading
import urllib.error
import urllib.request

import pytest

from smachpy_viz.live.simulations import SimulationError, Simulations

MISSION = """
import smachpy

def mission(seconds: float = 1.0):
    sm = smachpy.StateMachine(outcomes=["succeeded", "aborted"], name="JOB<b>")
    def work(userdata):
        if seconds > 3.5:
            raise RuntimeError("<script>alert(1)</script>")
        return "succeeded" if seconds < 2 else "aborted"
    with sm:
        sm.add("WORK", smachpy.CBState(work, outcomes=["succeeded", "aborted"]))
    return sm
"""


@pytest.fixture
def job(tmp_path):
    path = tmp_path / "job.py"
    path.write_text(MISSION, encoding="utf-8")
    return str(path)


@pytest.fixture
def simulations(tmp_path, job):
    with contextlib.closing(Simulations(tmp_path / "simulated", [job])) as made:
        yield made


def ended(simulations, name):
    """The batch, when its process has ended."""
    for task in simulations._tasks:
        task.join(400.0)
    return next(one for one in simulations.rows() if one["id"] == name)


@pytest.mark.slow  # processes of processes
@pytest.mark.timeout(900)
def test_a_batch_is_counted_reported_compared_and_found_again(simulations, tmp_path, job):
    asked = {"mission": job, "runs": 4, "vary": ["seconds=0.0..4.0"], "seed": 2, "limit": "1h"}
    first = ended(simulations, simulations.start(asked))
    assert (first["running"], first["problem"], first["report"]) == (False, "", True)
    assert sum(first["outcomes"].values()) + first["failed"] == 4
    again = {**asked, "vary": [], "runs": 2, "compare": first["id"]}
    second = ended(simulations, simulations.start(again))
    page = simulations.report(second["id"]).decode()
    assert "Compared with earlier runs" in page
    assert "<script" not in page
    later = Simulations(tmp_path / "simulated")
    assert [one["id"] for one in later.rows()] == [second["id"], first["id"]]
    assert later.rows()[1] == first


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"mission": "/etc/passwd"}, "mission"),
        ({"mission": ["x"]}, "mission"),
        ({"runs": 0}, "runs"),
        ({"runs": True}, "runs"),
        ({"runs": 10**9}, "runs"),
        ({"runs": "4"}, "runs"),
        ({"seed": 1.5}, "seed"),
        ({"limit": "soon"}, "limit"),
        ({"limit": "--help"}, "limit"),
        ({"vary": ["x"]}, "vary"),
        ({"vary": "x=1..2"}, "vary"),
        ({"compare": "../.."}, "compare"),
    ],
)
def test_what_makes_no_sense_is_refused_and_nothing_begins(simulations, job, wrong, word):
    with pytest.raises(SimulationError) as caught:
        simulations.start({"mission": job, "runs": 1, **wrong})
    assert str(caught.value).startswith(word)
    assert simulations.rows() == []


def test_a_name_cannot_lead_out_of_the_folder(simulations, tmp_path, job):
    (tmp_path / "runs").mkdir()
    (tmp_path / "report.html").touch()
    (tmp_path / "simulated").mkdir()
    for name in (".", "..", ".hidden", "", "a/b"):
        with pytest.raises(SimulationError):
            simulations.report(name)
    with pytest.raises(SimulationError, match="compare"):
        simulations.start({"mission": job, "runs": 1, "compare": ".."})


@pytest.mark.slow
@pytest.mark.parametrize("key", ["nobody", "--output"])
def test_a_batch_that_cannot_run_says_why(simulations, job, key):
    found = ended(
        simulations, simulations.start({"mission": job, "runs": 1, "vary": [f"{key}=1..2"]})
    )
    assert f"{key}: mission" in found["problem"]
    assert not found["report"]
    with pytest.raises(SimulationError):
        simulations.report(found["id"])
    with pytest.raises(SimulationError):
        simulations.stop(found["id"])


def test_a_batch_that_loses_the_interrupt_is_killed(simulations, tmp_path, job, monkeypatch):
    """An interrupt in a destructor, or in a callback of the import system, is printed and lost."""
    monkeypatch.setattr("smachpy_viz.live.simulations.STOP_S", 0.2)
    deaf = tmp_path / "deaf.py"
    deaf.write_text("import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n" + MISSION)
    simulations._own.append(str(deaf))
    began, count = threading.Event(), simulations._count
    monkeypatch.setattr(simulations, "_count", lambda *told: (count(*told), began.set()))
    name = simulations.start({"mission": str(deaf), "runs": 1000})
    assert began.wait(60.0)
    simulations.stop(name)
    assert ended(simulations, name)["problem"] == "it was stopped"


@pytest.mark.slow
def test_a_batch_is_stopped_and_no_more_than_two_run(simulations, job):
    names = [simulations.start({"mission": job, "runs": 900}) for _ in range(2)]
    with pytest.raises(SimulationError):
        simulations.start({"mission": job, "runs": 1})
    for name in names:
        simulations.stop(name)
    assert {ended(simulations, name)["problem"] for name in names} == {"it was stopped"}
    assert not any(one["running"] for one in simulations.rows())


def test_files_that_are_no_batches_are_passed_over(simulations, tmp_path):
    for name, text in (("a", "{}"), ("b", "["), ("c", json.dumps({"id": "other"}))):
        (tmp_path / "simulated" / name).mkdir(parents=True)
        (tmp_path / "simulated" / name / "batch.json").write_text(text, encoding="utf-8")
    assert simulations.rows() == []
    for name in ("../a", "", "a/b", "a"):
        with pytest.raises(SimulationError):
            simulations.report(name)


def test_only_who_has_the_token_starts_runs(served, simulations, job):
    address = served.start(simulations=simulations, token="right")
    told = json.dumps({"command": "start", "mission": job, "runs": 1}).encode()
    for token in ("", "wrong"):
        headers = {"origin": address.rstrip("/"), "x-smachpy-token": token}
        request = urllib.request.Request(address + "api/simulate", told, headers)
        with pytest.raises(urllib.error.HTTPError) as caught:
            urllib.request.urlopen(request, timeout=60)
        with caught.value:
            assert caught.value.code == 403
    assert simulations.rows() == []


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.browser
def test_the_page_starts_runs_and_shows_the_report(served, look, simulations, job):
    address = served.start(simulations=simulations, token="right", home=True)
    page = look(address + "#token=right", drawn=False)
    page.click("button:has-text('Simulate')")
    page.select_option(".simulate select", job)
    page.fill(".simulate label:has-text('Runs') input", "none")
    page.click(".simulate button[type=submit]")
    page.wait_for_selector(".simulate p.problem")
    page.fill(".simulate label:has-text('Runs') input", "3")
    page.fill(".simulate textarea", "seconds=0.0..1.5")
    page.click(".simulate button[type=submit]")
    page.wait_for_selector(".batches >> text=succeeded \u00d73", timeout=400_000)
    page.wait_for_selector(".batches a", timeout=400_000)
    with page.context.expect_page() as opened:
        page.click(".batches a")
    assert opened.value.locator("h2:has-text('Ways taken')").count() == 1
    assert opened.value.locator("svg.chart").count() >= 1
    page.keyboard.press("Escape")
    page.wait_for_selector(".simulate", state="detached")
