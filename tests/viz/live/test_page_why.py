"""Why a run failed, in the page: what was read, and how good runs differ."""

from __future__ import annotations

import json
import urllib.request

import pytest

from smachpy_viz.live.runs import Runs
from tests.viz.drives import GOOD, run

pytestmark = pytest.mark.browser


def test_the_page_shows_them_below_the_causes(tmp_path, served, look):
    for number, speed in enumerate([*GOOD, 0.3]):
        run(speed, path=tmp_path / f"{number}.jsonl")
    runs = Runs(served.machines, [tmp_path])
    name = runs.open(f"file {tmp_path / '4.jsonl'}")
    address = served.start(runs=runs)
    page = look(address)
    page.keyboard.press("w")
    page.wait_for_selector(".good-runs .fact.differs")
    assert "speed 0.3 (good: 0.5 to 0.6)" in page.inner_text(".good-runs .conclusion")
    assert page.locator(".good-runs .fact").count() == 3
    why = page.inner_text(".why")
    assert "read speed 0.3 of PLAN" in " ".join(why.split())
    refuse = "() => { navigator.clipboard.write = () => Promise.reject(new Error('refused')); }"
    page.evaluate(refuse)
    with page.expect_download() as saved:  # what cannot be copied is saved
        page.get_by_role("button", name="Copy as card").click()
    assert saved.value.suggested_filename.endswith(".png")
    with urllib.request.urlopen(f"{address}api/good?machine={name.replace(' ', '%20')}") as answer:
        assert json.load(answer)["runs"] == 4
