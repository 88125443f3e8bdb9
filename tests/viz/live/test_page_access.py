"""What axe-core finds on the pages of the viewer: nothing serious."""

from __future__ import annotations

import pytest

from tests.browser import draw, wait_for
from tests.places import ROOT

pytestmark = pytest.mark.browser

AXE = ROOT / "viz" / "web" / "node_modules" / "axe-core" / "axe.min.js"
FREE = {"paused": False, "breakpoints": []}
ASKED = {
    "text": "Is the door open?",
    "answers": ["yes", "no"],
    "words": ["yes", "no"],
    "default": "no",
    "patience": 300.0,
    "service": "ask",
    "has_picture": False,
}
GOAL = {"action": "carrier/move_base", "goal_id": "1", "goal": {"station": "kitchen"}}
RUNS = [
    ("Started", "/JOB"),
    ("Entered", "/JOB/A"),
    ("UserdataWritten", "/JOB/A", {"key": "shelf", "value": [1, {"a": 2}]}),
    ("GoalSent", "/JOB/A", GOAL),
    ("GoalDone", "/JOB/A", {**GOAL, "status": "SUCCEEDED", "text": "there", "result": {}}),
    ("Left", "/JOB/A", {"outcome": "ok"}),
    ("Entered", "/JOB/B"),
    ("QuestionAsked", "/JOB/B", ASKED),
]


@pytest.mark.parametrize("size", [(1440, 900), (390, 844)])
@pytest.mark.parametrize("colours", ["light", "dark"])
def test_axe_finds_nothing_serious(served, look, size, colours):
    assert AXE.exists(), "needs axe-core; try: .ci/web tools"
    served.add("one", labels="ABC", events=RUNS, control=FREE)
    page = look(f"{served.start(token='t')}#token=t", color_scheme=colours)
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = {}
    for name, open_it in {
        "machine": lambda: page.evaluate("() => smachpy.page.select('/JOB/A')"),
        "menu": lambda: page.click(".menu > button"),
        "palette": lambda: page.keyboard.press("Control+k"),
        "keys": lambda: page.evaluate("() => { smachpy.store.view.help.value = true; }"),
        "runs": lambda: page.keyboard.press("h"),
        "actions": lambda: page.keyboard.press("a"),
    }.items():
        open_it()
        wait_for(page, "document.readyState === 'complete'")
        draw(page)
        seen = page.evaluate(
            "() => axe.run({ resultTypes: ['violations'] }).then(({ violations }) => violations)"
        )
        found[name] = [
            (one["id"], [node["html"][:90] for node in one["nodes"][:3]])
            for one in seen
            if one["impact"] in {"serious", "critical"}
        ]
        page.keyboard.press("Escape")
    assert {name: seen for name, seen in found.items() if seen} == {}
