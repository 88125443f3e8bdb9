"""The palette finds what the page has by name, and the page works without shortcuts of single keys."""

from __future__ import annotations

import pytest

from tests.browser import wait_for

pytestmark = pytest.mark.browser

FREE = {"paused": False, "breakpoints": []}
RUNS = [
    ("Started", "/JOB"),
    ("Entered", "/JOB/A"),
    ("UserdataWritten", "/JOB/A", {"key": "shelf", "value": 7}),
    ("Left", "/JOB/A", {"outcome": "ok", "at": 90.0}),
    ("Entered", "/JOB/B", {"at": 90.0}),
]


@pytest.fixture
def page(served, look):
    served.add("one", labels="ABC", events=RUNS, control=FREE)
    served.add("two", label="OTHER", events=[("Started", "/OTHER")])
    return look(f"{served.start(token='t')}?machine=one#token=t")


def find(page, text):
    page.keyboard.press("Control+k")
    page.wait_for_selector(".palette input:focus")
    page.keyboard.type(text)


def test_states_instants_keys_machines_and_commands_are_found(page, served):
    find(page, "b")
    page.keyboard.press("Enter")
    wait_for(page, "smachpy.store.view.selected.value === '/JOB/B'")
    find(page, "00:30")
    assert page.text_content(".palette .at b") == "00:30.0"
    page.keyboard.press("Enter")
    wait_for(
        page,
        "Math.round(smachpy.store.playback.nowMs() - smachpy.store.playback.began()) === 30000",
    )
    find(page, ".shelf")
    assert "7 by A" in page.text_content(".palette .at")
    page.keyboard.press("Enter")
    wait_for(page, "smachpy.store.view.selected.value === '/JOB/A'")
    find(page, "> live")
    page.keyboard.press("Enter")
    wait_for(page, "smachpy.store.playback.cursor.value === null")
    find(page, "pause")
    assert page.text_content(".palette .at b") == "Pause JOB"
    page.keyboard.press("Enter")
    wait_for(page, "document.querySelector('.notice')?.textContent.includes('pause')")
    assert served.commands[-1]["command"] == "pause"
    find(page, "#other")
    page.keyboard.press("Enter")
    wait_for(page, "smachpy.store.data.facts.value?.name === 'two'")


def test_it_closes_with_escape_and_gives_the_focus_back(page):
    page.focus("#preempt")
    find(page, "zzz")
    assert page.text_content(".palette .none") == "nothing of this name"
    assert (
        page.evaluate("() => smachpy.store.view.follow.value") is False
    )  # no key reached the page
    page.keyboard.press("Escape")
    page.wait_for_selector(".palette", state="detached")
    wait_for(page, "document.activeElement.id === 'preempt'")


def test_shortcuts_of_single_keys_can_be_switched_off(page):
    page.click(".menu > button")
    page.click("text=Single keys are shortcuts")
    page.keyboard.press("Escape")
    page.keyboard.press("h")
    page.keyboard.press("o")
    find(page, "b")
    page.keyboard.press("Escape")
    assert page.query_selector(".home") is None
    assert page.evaluate("() => smachpy.store.view.follow.value") is False


@pytest.mark.parametrize("size", [(390, 844), (844, 390)])
def test_a_phone_has_one_row_at_the_top_and_the_rest_in_its_menu(page, size):
    page.set_viewport_size({"width": size[0], "height": size[1]})
    wait_for(page, "document.querySelector('.top').offsetHeight === 48")
    page.click(".menu > button")
    inside = "() => document.querySelector('.sheet').getBoundingClientRect().bottom <= innerHeight"
    assert page.evaluate(inside)
    page.click(".sheet button:text-is('Find')")
    page.wait_for_selector(".palette input:focus")
    page.keyboard.press("Escape")
    page.click(".menu > button")
    page.click(".sheet button:text-is('States')")
    page.wait_for_selector(".panel-tree")
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
