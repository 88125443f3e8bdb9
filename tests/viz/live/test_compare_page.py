"""Two versions of a machine in one drawing, in a real browser."""

from __future__ import annotations

import pytest

from smachpy import CBState, StateMachine
from smachpy.events.recording import Recorder
from tests.browser import wait_for

pytestmark = [pytest.mark.browser, pytest.mark.zenoh]


def group(path):
    return f'g[data-path="{path}"]'


def make(labels):
    sm = StateMachine(outcomes=["done"], name="JOB")
    with sm:
        for label, after in zip(labels, [*labels[1:], "done"], strict=True):
            StateMachine.add(label, CBState(lambda _: "ok", outcomes=["ok"]), {"ok": after})
    return sm


@pytest.fixture
def versions(tmp_path, clock):
    for name, labels in [("old", ["LOOK", "DRIVE", "WAIT"]), ("new", ["LOOK", "SCAN", "WAIT"])]:
        sm = make(labels)
        with Recorder(tmp_path / f"{name}.jsonl", sm):
            sm.execute()
    return tmp_path / "old.jsonl", tmp_path / "new.jsonl"


def test_two_versions_in_one_drawing(versions, start, look):
    view = start.view(*versions)
    page = look(f"{view.base}?machine=new.jsonl")
    page.click("text=View")
    page.select_option("#compare", "old.jsonl")
    page.wait_for_selector(f"{group('/JOB/SCAN')}.cmp-added")
    page.wait_for_selector(f"{group('/JOB/DRIVE')}.cmp-removed")
    assert page.query_selector(f"{group('/JOB/LOOK')}.cmp-added") is None
    # Never by colour alone: a sign, a line, a word for those who listen.
    assert page.text_content(f"{group('/JOB/SCAN')} .name") == "+ SCAN"
    assert page.text_content(f"{group('/JOB/DRIVE')} .name") == "− DRIVE"
    assert page.get_attribute(group("/JOB/SCAN"), "aria-label").endswith(", added")
    dashes = "(p) => getComputedStyle(document.querySelector(p)).strokeDasharray"
    assert page.evaluate(dashes, ".edge.cmp-removed") != "none"
    assert page.evaluate(dashes, ".edge.cmp-added") == "none"
    assert "removed" in page.text_content(".legend")
    told = page.text_content(".differences")
    assert "SCAN" in told
    assert "ok → DRIVE" in told
    page.click(".compare-chip")
    wait_for(page, f"!document.querySelector('{group('/JOB/DRIVE')}')")
    assert page.query_selector(".differences") is None
    assert page.query_selector(".compared") is None
