"""A finished run that is run again from the page."""

from __future__ import annotations

import pytest

from smachpy.events.recording import Recorder
from smachpy.testing import mission_kit
from tests.browser import wait_for

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.timeout(900)]

MISSION = """
import smachpy
from smachpy.states import Wait

SURE = True

def look(userdata):
    return "seen" if SURE else "missed"

def mission():
    sm = smachpy.StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="LOOK")
    with sm:
        sm.add("WAIT", Wait(2.0), {"done": "EYE"})
        sm.add(
            "EYE",
            smachpy.CBState(look, outcomes=["seen", "missed"]),
            {"seen": "succeeded", "missed": "aborted"},
        )
    return sm
"""


@pytest.fixture
def incident(tmp_path):
    """A mission that has changed since a run of it was recorded."""
    from smachpy.command.targets import load_target

    file = tmp_path / "look.py"
    file.write_text(MISSION, encoding="utf-8")
    path = tmp_path / "night.jsonl"
    with mission_kit() as kit:
        machine = load_target(str(file)).build()
        with Recorder(path, machine, origin={"target": str(file)}):
            kit(machine)
    file.write_text(MISSION.replace("True", "False"), encoding="utf-8")
    return file, path


def test_the_difference_is_shown_and_a_test_is_written(start, look, incident):
    file, path = incident
    page = look(start.view(path, "--control", f"--allow={file}").address)
    page.get_by_role("button", name="Reproduce").click()
    page.wait_for_selector(".first-difference", timeout=400_000)
    assert "event 5" in page.inner_text(".first-difference")
    told = page.inner_text(".again")
    assert "EYE  seen" in told or "EYE seen" in told
    assert "look.SURE is False now, was True" in told
    wait_for(page, "document.querySelector('.diagram .differs')?.dataset.path === '/LOOK/EYE'")
    bars = page.locator(".two-runs .bar.differs")
    assert [bars.nth(i).inner_text().split()[0] for i in range(bars.count())] == ["EYE", "EYE"]
    page.get_by_role("button", name="One run").click()
    page.wait_for_selector(".two-runs", state="detached")
    page.get_by_role("button", name="Make a test").click()
    page.wait_for_selector(".written-test", timeout=400_000)
    assert "def test_" in page.inner_text(".written-test")
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save", exact=True).click()
    assert saved.value.suggested_filename == "test_night.py"


def test_a_page_without_control_offers_none_of_it(start, look, incident):
    page = look(start.view(incident[1]).address)
    wait_for(page, "document.querySelector('.why-button')")
    assert page.get_by_role("button", name="Reproduce").count() == 0
