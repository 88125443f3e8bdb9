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
