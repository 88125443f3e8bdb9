"""The list of runs: what it shows, filters, pins, and opening a run."""

from __future__ import annotations

import json

import pytest

from smachpy import CBState, StateMachine, describe
from smachpy.events.recording import recording_lines
from viz.live.runs import Runs

pytestmark = pytest.mark.browser


def record(served, path, label, outcome, reason=""):
    sm = StateMachine(outcomes=["succeeded", "aborted"], name=label)
    with sm:
        StateMachine.add(
            "GO",
            CBState(lambda _: "succeeded", outcomes=["succeeded", "aborted"]),
            {"succeeded": "succeeded", "aborted": "aborted"},
        )
    events = served.events(
        [
            ("Started", f"/{label}", {"at": 0.0}),
            ("Entered", f"/{label}/GO", {"at": 0.0}),
            ("GoalSent", f"/{label}/GO", {"action": "r1/go", "goal_id": "1", "goal": None, "at": 1.0}),
            ("GoalDone", f"/{label}/GO", {"action": "r1/go", "goal_id": "1", "status": outcome.upper(),
                                          "text": reason, "result": None, "at": 2.0}),
            ("Left", f"/{label}/GO", {"outcome": outcome, "at": 2.0}),
            ("Finished", f"/{label}", {"outcome": outcome, "at": 2.0}),
        ]
    )  # fmt: skip
    path.write_text("".join(recording_lines(describe(sm), events, None)), encoding="utf-8")


@pytest.fixture
def home(served, tmp_path):
    """A live machine, and three files; one is none."""
    record(served, tmp_path / "good.jsonl", "GOOD", "succeeded")
    record(
        served, tmp_path / "evil.jsonl", "<img src=x onerror=alert(1)>", "aborted", "<b>no way</b>"
    )
    (tmp_path / "bad.jsonl").write_text("{}\n", encoding="utf-8")
    served.add("one", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
    served.start(runs=Runs(served.machines, [tmp_path]), home=True)
    return served


def rows(page):
    return page.evaluate(
        "() => [...document.querySelectorAll('.runs tbody b')].map((b) => b.textContent)"
    )


def test_the_page_begins_with_the_runs_and_opens_one(home, look):
    page = look(home.address)
    page.wait_for_selector(".home .runs")
    assert rows(page)[0] == "JOB"
    assert set(rows(page)) == {"JOB", "GOOD", "<img src=x onerror=alert(1)>", "bad"}
    assert page.locator(".runs small:has-text('no way')").count() == 1
    assert page.locator(".runs tr.bad").count() == 1
    page.click(".runs tr:has-text('GOOD')")
    page.wait_for_function("() => smachpy.store.facts.value?.label === 'GOOD'")
    assert page.query_selector(".home") is None
    assert "machine=" in page.url
    assert "runs" not in page.url.partition("?")[2].split("&")[0]
    page.keyboard.press("h")
    page.wait_for_selector(".home")
    page.keyboard.press("Escape")
    page.wait_for_selector(".home", state="detached")


def test_filters_search_and_pins(home, look):
    page = look(home.address)
    page.wait_for_selector(".home .runs")
    page.click(".filters button:has-text('failed')")
    page.wait_for_function("() => document.querySelectorAll('.runs tbody tr').length === 1")
    page.fill(".run-list header input", "good")
    page.wait_for_selector(".empty-list")
    assert "No run is failed and with \u201cgood\u201d." in page.text_content(".empty-list")
    page.click(".empty-list button")
    page.wait_for_function("() => document.querySelectorAll('.runs tbody tr').length === 4")
    page.click(".runs tr:has-text('GOOD') .pin")
    page.wait_for_function(
        "() => document.querySelectorAll('.runs tbody b')[1].textContent === 'GOOD'"
    )
    page.reload()
    page.wait_for_selector(".runs tr:has-text('GOOD') .pin[aria-pressed=true]")


def test_a_run_that_cannot_be_opened_says_why(home, look):
    page = look(home.address)
    page.wait_for_selector(".home .runs")
    page.click(".runs tr.bad")
    page.wait_for_selector(".notice.error")
    assert "expected a file of" in page.text_content(".notice.error")
    answer = page.request.get(f"{home.address}api/open?run=file%20/etc/passwd")
    assert answer.status == 404
    assert json.loads(answer.text())["ok"] is False


def test_a_live_run_ends_in_the_list(home, look):
    page = look(home.address)
    page.wait_for_selector(".runs tr:has-text('running')")
    machine = home.machines.get("one")
    machine.add(
        home.events(
            [("Left", "/JOB/A", {"outcome": "ok"}), ("Finished", "/JOB", {"outcome": "done"})], 2
        )
    )
    page.wait_for_selector(".runs tr:has-text('JOB'):has-text('done')")


def test_a_viewer_without_runs_says_how_to_make_one(served, look, tmp_path):
    page = look(served.start(runs=Runs(served.machines, [tmp_path]), home=True), drawn=False)
    page.wait_for_selector(".empty-list")
    assert "smachpy run patrol --start-robot --view" in page.text_content(".empty-list")


def test_a_machine_that_is_asked_for_is_shown_at_once(home, look):
    page = look(f"{home.address}?machine=one")
    assert page.query_selector(".home") is None


def test_a_live_run_that_asks_its_operator_says_so(home, look):
    asked = {
        "text": "Go on?",
        "answers": ["yes", "no"],
        "words": ["", ""],
        "default": "no",
        "patience": 60.0,
        "service": "operator/questions/q1",
        "has_picture": False,
    }
    page = look(home.address)
    page.wait_for_selector(".runs .pill-text:has-text('running')")
    home.machines.get("one").add(home.events([("QuestionAsked", "/JOB/A", asked)], after=2))
    page.wait_for_selector(".runs .pill-text.waiting:has-text('asks you')")
    page.wait_for_function("() => document.title.startsWith('(1) ')")
