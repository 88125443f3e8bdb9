"""The list of runs: what it shows, filters, pins, and opening a run."""

from __future__ import annotations

import json

import pytest

from smachpy import CBState, StateMachine, describe
from smachpy.events.recording import recording_lines
from smachpy_viz.live.runs import Runs

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
    page.wait_for_function("() => smachpy.store.data.facts.value?.label === 'GOOD'")
    assert page.query_selector(".home") is None
    assert "machine=" in page.url
    assert "runs" not in page.url.partition("?")[2].split("&")[0]
    page.keyboard.press("h")
    page.wait_for_selector(".home")
    page.keyboard.press("Escape")
    page.wait_for_selector(".home", state="detached")


def test_the_list_of_runs_and_its_header_fill_a_phone_held_sideways(home, look):
    page = look(home.address)
    page.set_viewport_size({"width": 844, "height": 390})
    page.wait_for_selector(".home .runs")
    for part in (".top", ".home"):
        box = page.locator(part).bounding_box()
        assert (box["x"], box["width"]) == (0, 844), part


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


class Missions:
    """A journal with one interrupted mission; it notes what it is told."""

    def __init__(self, began):
        self.told = []
        self.began = began

    def rows(self):
        state = {"id": "<b>m</b>", "journal": "j.db", "status": "interrupted", "active": ["/JOB/B"]}
        at = self.began
        return [
            {"id": "mission j.db m", "run": "m 1", "machine": "JOB", "robots": [], "began": at,
             "ended": None, "last": at + 20_000_000_000, "outcome": None, "reason": "B",
             "strip": [(0, "A", 0.0, 5.0, "success"), (0, "B", 15.0, None, "active")],
             "outages": [(5.0, 15.0)],
             "mission": {**state, "problem": "", "can": ["resume", "cancel"]}},
        ]  # fmt: skip

    def places(self):
        return [{"name": "j.db", "problem": ""}, {"name": "b.db", "problem": "no such file"}]

    def command(self, *words):
        self.told.append(words)
        return "it is resumed"


def test_a_durable_mission_is_resumed_with_the_token_alone(served, look):
    missions = Missions(served.began)
    served.start(runs=Runs(served.machines, [], missions), home=True, token="right")
    page = look(served.address, drawn=False)
    page.wait_for_selector(".runs tr:has-text('interrupted')")
    assert page.locator(".run-strip .outage").count() == 1
    assert page.locator(".chip.bad").get_attribute("title") == "no such file"
    assert page.locator(".runs button.small").count() == 0
    page = look(served.address + "#token=right", drawn=False)
    page.click("button[aria-label='resume <b>m</b>']")
    page.click(".confirm .warn")
    page.wait_for_selector("text=it is resumed")
    assert missions.told == [("j.db", "<b>m</b>", "resume", "")]
    answer = page.evaluate(
        """() => fetch('/api/mission', {method: 'POST', headers: {'x-smachpy-token': 'wrong',
           'content-type': 'application/json'}, body: '{}'}).then((one) => one.status)"""
    )
    assert answer == 403


def test_the_timeline_has_a_gap_where_no_process_ran_the_mission(served, look):
    at = served.began
    active = [["/JOB", at], ["/JOB/A", at]]
    facts = {"mission": "m", "began_ns": at, "outages": [[at, at + 10**10]], "active": active}
    served.add("one", events=[("Recovered", "/JOB", {**facts, "at": 10.0})])
    page = look(served.start())
    page.click(".time-tools button")
    assert page.evaluate("() => smachpy.store.data.run.now.outages.length") == 1
    assert page.evaluate("() => smachpy.page.timeline.gaps.length") == 1
    assert page.locator(".log >> text=resumed after an outage of 10 s").count() == 1


def test_a_fleet_of_a_thousand_is_scrolled_through_a_few_cards(served, look):
    for number in range(1000):
        served.add(f"r{number:03}", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
    page = look(served.start(home=True), drawn=False)
    page.click("button:has-text('Fleet')")
    page.wait_for_selector(".fleet header:has-text('1 to 32 of 1,000 live runs')")
    cards = page.locator(".fleet .cards button")
    assert cards.count() == page.locator(".fleet .lanes svg").count() == 32
    # Without a map the cards have its room, too.
    page.wait_for_function("() => document.querySelector('.cards').clientWidth > 1300")

    def scroll(where):
        page.evaluate(
            f"() => {{ const box = document.querySelector('.cards'); box.scrollTop = {where}; }}"
        )

    scroll("box.scrollHeight")
    last = page.locator(".fleet .cards button:has-text('r999')")
    last.wait_for()
    assert cards.count() <= 32
    assert last.bounding_box()["y"] > page.locator(".cards").bounding_box()["y"]
    scroll(0)
    page.wait_for_selector(".fleet header:has-text('1 to 32')")
    # In the middle, the cards in view are those of the place: 500 stand above the first.
    scroll("box.scrollHeight / 2")
    page.wait_for_function(
        """() => { const box = document.querySelector('.cards').getBoundingClientRect();
          return [...document.querySelectorAll('.cards button')].some((card) => {
            const { top } = card.getBoundingClientRect();
            return Math.abs(top - box.top) < 100 && card.textContent.startsWith('r50'); }); }"""
    )
    page.click(".fleet header button:has-text('Close')")
    page.wait_for_selector(".fleet", state="detached")


def test_live_runs_together_have_cards_lanes_and_one_map(served, look):
    floor = {"kind": "Observed", "path": "", "what": "map", "robot": "", "resolution": 0.5, "width": 3,
             "height": 2, "origin": [1.0, 2.0, 0.0], "cells": "eNpjYGRiYGIAAAAXAAY="}  # fmt: skip
    pose = {"kind": "Observed", "path": "", "what": "pose", "robot": "", "at": [1.0, 1.0, 0.0]}
    for name in ("one", "<b>two", "gone"):
        machine = served.add(name, events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
        machine.observe(
            {**one, "stamp_ns": served.began, "n": n} for n, one in enumerate((floor, pose), 1)
        )
    machine.set_stale(1)
    page = look(served.start(home=True), drawn=False)
    page.click("button:has-text('Fleet')")
    page.wait_for_selector(".fleet-map canvas")
    for part in (".cards button", ".lanes rect.active"):
        page.wait_for_function(f"() => document.querySelectorAll('.fleet {part}').length === 2")
    assert "<b>two" in page.locator(".fleet .cards").inner_text()
    page.wait_for_function(
        "() => document.querySelector('.fleet-map canvas').getAttribute('aria-label')"
    )
    page.click(".fleet .cards button:has-text('two')")
    page.wait_for_function("() => smachpy.store.data.facts.value?.name === '<b>two'")
    page.wait_for_selector(".fleet", state="detached")
