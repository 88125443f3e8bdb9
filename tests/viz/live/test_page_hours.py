"""Long runs: the strip over the whole run with its window, lanes by name, and one clock for all instants."""

from __future__ import annotations

import pytest

from smachpy import CBState, StateMachine
from tests.browser import wait_for

pytestmark = pytest.mark.browser

HOUR = 3600.0
RANGE = "[smachpy.page.strip.shown.from, smachpy.page.strip.shown.to].map((t) => Math.round((t - smachpy.store.playback.began()) / 1000))"


@pytest.fixture
def page(served, look):
    events = [("Started", "/JOB")]
    for n in range(60):
        label = "ABC"[n % 3]
        events += [
            ("Entered", f"/JOB/{label}", {"at": n * 60.0}),
            ("Left", f"/JOB/{label}", {"outcome": "ok", "at": n * 60.0 + 59}),
        ]
    events += [("Finished", "/JOB", {"outcome": "done", "at": HOUR})]
    served.add("one", labels="ABC", events=events)
    return look(served.start())


def shown(page):
    return page.evaluate(f"() => {RANGE}")


def place(page, seconds):
    """The place in the strip of an instant of the run."""
    box = page.locator(".timeline canvas").first.bounding_box()
    left = page.evaluate("() => smachpy.page.strip.left")
    wide = box["width"] - left - 14
    return box["x"] + left + seconds / HOUR * wide, box["y"] + box["height"] / 2


def drag(page, begin, end):
    page.mouse.move(*place(page, begin))
    page.mouse.down()
    page.mouse.move(*place(page, (begin + end) / 2))
    page.mouse.move(*place(page, end))
    page.mouse.up()


def test_the_window_is_moved_and_stretched(page):
    page.evaluate(
        "() => { const t = smachpy.store.playback.began(); smachpy.page.timeline.window.show({ from: t + 600e3, to: t + 1200e3 }); }"
    )
    wait_for(page, f"{RANGE}[0] === 600")
    drag(page, 900, 1500)
    begin, end = shown(page)
    assert begin == pytest.approx(1200, abs=20)
    assert end - begin == pytest.approx(600, abs=2)
    drag(page, end, 3000)
    assert shown(page)[0] == begin
    assert shown(page)[1] == pytest.approx(3000, abs=20)
    page.mouse.dblclick(*place(page, 300))
    begin, end = shown(page)
    assert begin <= 0
    assert end >= HOUR


def test_lanes_are_found_by_name(page):
    page.fill(".lane-filter", "nothing")
    wait_for(page, "smachpy.page.timeline.bars.hits.length === 0")
    page.fill(".lane-filter", "b")
    wait_for(page, "smachpy.page.timeline.bars.hits.length > 0")


def test_one_clock_for_all_instants(page):
    first = "() => document.querySelector('.log time').textContent"
    assert page.evaluate(first) == "1:00:00.00"
    page.select_option("[aria-label=clock]", "wall")
    wait_for(
        page, r"/^\d\d:\d\d:\d\d\.\d\d$/.test(document.querySelector('.log time').textContent)"
    )
    page.keyboard.press("Escape")
    page.evaluate("() => document.activeElement.blur()")
    page.keyboard.press("c")
    wait_for(page, "document.querySelector('.log time').textContent === '0.00 s'")
    page.keyboard.press("c")
    wait_for(page, "document.querySelector('.log time').textContent === '1:00:00.00'")


def test_a_night_is_folded_until_it_is_unfolded(served, look):
    """Five hours with 20,000 events and an idle night: each failure is a bar wide enough to be seen."""
    events, failures, at = [("Started", "/JOB")], 20, 0.0
    for n in range(10_000):
        if n == 5_000:
            at += 8 * HOUR
        outcome = "aborted" if n % 500 == 250 else "ok"
        events += [("Entered", "/JOB/A", {"at": at})]
        events += [("Left", "/JOB/A", {"outcome": outcome, "at": at + 1.7})]
        at += 1.8
    sm = StateMachine(outcomes=["done"], name="JOB")
    with sm:
        both = CBState(lambda _: "ok", outcomes=["ok", "aborted"])
        StateMachine.add("A", both, {"ok": "A", "aborted": "A"})
        StateMachine.add("B", CBState(lambda _: "done", outcomes=["done"]))
    served.add("one", sm=sm, events=[*events, ("Finished", "/JOB", {"outcome": "done", "at": at})])
    page = look(served.start())
    bars = """() => { smachpy.page.timeline.draw(); const { bars, scale } = smachpy.page.timeline;
        const failed = bars.hits.filter(({ span }) => span.outcome === 'aborted');
        return [failed.length, Math.min(...failed.map((b) => b.right - b.left)), scale.folds.length]; }"""
    assert page.evaluate(bars) == [failures, 3, 1]
    fold = "(() => { const { scale } = smachpy.page.timeline; const [one] = scale.folds; return (scale.x(one.from) + scale.x(one.to)) / 2; })()"
    canvas = page.locator(".timeline canvas").last
    canvas.click(position={"x": page.evaluate(fold), "y": 12})
    wait_for(page, "smachpy.page.timeline.scale.folds.length === 0")
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is None
    button = page.get_by_role("button", name="Idle", exact=True)
    assert button.get_attribute("aria-pressed") == "false"
    button.click()
    wait_for(page, "smachpy.page.timeline.scale.folds.length === 1")
    page.evaluate("() => smachpy.store.playback.seek(smachpy.store.data.run.first() + 3600e3)")
    assert page.evaluate(bars)[0] == failures
