"""What the page makes of what it is told: machines and events of this process, a real browser."""

from __future__ import annotations

import time

import pytest

pytestmark = pytest.mark.browser

RUN = [
    ("Started", "/JOB", {"initial": ["A"]}),
    ("Entered", "/JOB/A"),
    ("Left", "/JOB/A", {"outcome": "ok", "at": 0.01}),
    ("Entered", "/JOB/B", {"at": 0.01}),
    ("Left", "/JOB/B", {"outcome": "ok", "at": 0.02}),
    ("Finished", "/JOB", {"outcome": "done", "at": 0.02}),
]
"""A whole run; a transition is two events of one instant."""


def run(events=RUN):
    """The events, for one use."""
    return [(kind, path, dict(*more)) for kind, path, *more in events]


def wait_for(page, condition, timeout=10.0):
    deadline = time.monotonic() + timeout
    while not page.evaluate(f"() => Boolean({condition})"):
        assert time.monotonic() < deadline, f"never true: {condition}"
        page.wait_for_timeout(50)


def lit(page):
    return page.evaluate(
        "() => [...document.querySelectorAll('.diagram g.active')].map((g) => g.dataset.path)"
    )


def test_single_events_back_and_on_though_they_share_an_instant(served, look):
    served.add("one", events=run())
    page = look(served.start())
    seen = []
    for _ in range(5):
        page.keyboard.press(",")
        seen.append(lit(page))
        # The panels and the picture show the same.
        assert page.evaluate("() => smachpy.store.activePaths.value") == seen[-1]
    assert seen == [["/JOB"], ["/JOB", "/JOB/B"], ["/JOB"], ["/JOB", "/JOB/A"], ["/JOB"]]
    page.keyboard.press(",")  # there is nothing before the first
    assert lit(page) == ["/JOB"]
    on = []
    for _ in range(4):
        page.keyboard.press(".")
        on.append(lit(page))
    assert on == seen[3::-1]
    page.keyboard.press(".")
    assert page.evaluate("() => smachpy.store.cursor.value") is None


GOAL = ("GoalSent", "/JOB/A", {"action": "drive", "goal_id": "1", "goal": {"x": 1}})


def test_links_and_summaries_keep_their_keys(served, look, tmp_path):
    served.add("one", events=[*run()[:2], GOAL], control={"paused": False, "breakpoints": []})
    page = look(f"{served.start(token='t')}#token=t")
    wait_for(page, "document.querySelector('#pause')")
    page.focus("summary:text-is('goal')")
    page.keyboard.press("Space")
    wait_for(page, "document.querySelector('details[open] pre')")
    page.keyboard.press("Enter")
    wait_for(page, "!document.querySelector('details[open] pre')")
    page.click(".menu > button")
    page.focus(".sheet a:text-is('recording')")
    with page.expect_download() as download:
        page.keyboard.press("Enter")
    assert download.value.suggested_filename == "run.jsonl"
    assert served.commands == []
    page.evaluate("() => document.activeElement.blur()")
    page.keyboard.press("Space")
    page.wait_for_selector(".notice")
    assert [one["command"] for one in served.commands] == ["pause"]


def test_the_tree_by_keyboard(served, look):
    served.add("one", events=run()[:2], control={"paused": False, "breakpoints": []})
    page = look(f"{served.start(token='t')}#token=t")
    wait_for(page, "document.querySelectorAll('[role=treeitem]').length === 3")
    page.focus("[role=tree]")
    here = """() => document.getElementById(document.querySelector('[role=tree]')
        .getAttribute('aria-activedescendant')).title"""

    def press(*keys):
        for key in keys:
            page.keyboard.press(key)
        page.wait_for_timeout(50)
        return page.evaluate(here)

    assert page.evaluate(here) == "/JOB"
    assert press("ArrowDown", "ArrowDown") == "/JOB/B"
    assert press("ArrowDown") == "/JOB/B"
    page.keyboard.press("Space")
    assert page.evaluate("() => smachpy.store.selected.value") == "/JOB/B"
    assert press("ArrowUp") == "/JOB/A"
    page.keyboard.press("Enter")
    assert page.evaluate("() => smachpy.store.selected.value") == "/JOB/A"
    assert press("ArrowLeft") == "/JOB"
    assert press("ArrowLeft") == "/JOB"
    wait_for(page, "document.querySelectorAll('[role=treeitem]').length === 1")
    assert page.get_attribute("[role=treeitem]", "aria-expanded") == "false"
    press("ArrowRight")
    wait_for(page, "document.querySelectorAll('[role=treeitem]').length === 3")
    assert press("End") == "/JOB/B"
    assert press("Home") == "/JOB"
    assert served.commands == []


def test_a_row_of_userdata_by_keyboard(served, look):
    written = ("UserdataWritten", "/JOB/A", {"key": "load", "value": {"boxes": [1, 2]}})
    served.add("one", events=[*run()[:2], written])
    page = look(served.start())
    page.wait_for_selector(".userdata tr")
    page.focus(".userdata tr")
    page.keyboard.press("Enter")
    page.wait_for_selector(".userdata pre")
    page.keyboard.press("Space")
    wait_for(page, "!document.querySelector('.userdata pre')")
