"""Panels around the diagram: moved, resized, hidden, kept and linked; on a phone one part at a time."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.browser

WORD = """() => ['left', 'right', 'bottom'].map((dock) =>
  [...document.querySelectorAll(`.dock.${dock} > .panel`)].map((p) => p.dataset.panel).join(' '))"""


def run():
    return [
        ("Started", "/JOB", {"at": 0.0}),
        ("Entered", "/JOB/A", {"at": 0.0}),
        ("UserdataWritten", "/JOB/A", {"key": "count", "value": 1, "at": 1.0}),
        ("Left", "/JOB/A", {"outcome": "ok", "at": 9.0}),
        ("Finished", "/JOB", {"outcome": "done", "at": 10.0}),
    ]


def observed(served):
    pose = {"kind": "Observed", "path": "", "robot": "", "what": "pose", "at": [1.0, 1.0, 0.0]}
    return [{**pose, "n": 1, "stamp_ns": served.began}]


@pytest.fixture
def page(served, look):
    served.add("one", events=run(), observed=observed(served))
    page = look(served.start())
    page.wait_for_selector(".map-view canvas")
    return page


def drag(page, begin, end):
    page.mouse.move(*begin)
    page.mouse.down()
    page.mouse.move(*[(a + b) / 2 for a, b in zip(begin, end, strict=True)])
    page.mouse.move(*end)
    page.mouse.up()


def middle(page, selector):
    box = page.locator(selector).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_a_panel_is_dragged_to_another_side_and_stays_there(page):
    assert page.evaluate(WORD) == ["tree", "map details", "time"]
    page.hover(".map-view")
    drag(page, middle(page, "[data-panel=map] > .grip"), (60, 300))
    page.wait_for_function(f"() => ({WORD})().join() === 'map tree,details,time'")
    drag(page, middle(page, "[data-panel=tree] > .grip"), (700, 860))
    page.wait_for_function(f"() => ({WORD})().join() === 'map,details,time tree'")
    page.wait_for_selector(".dock.bottom [role=treeitem]")
    assert page.evaluate("() => smachpy.page.map.canvas.clientWidth") > 100  # it draws there
    address = page.evaluate("() => smachpy.page.address.text")
    page.wait_for_function("() => location.hash === new URL(smachpy.page.address.text).hash")
    page.reload()
    page.wait_for_function(f"() => ({WORD})().join() === 'map,details,time tree'")
    page.evaluate("() => localStorage.clear()")
    page.goto("about:blank")
    page.goto(address)  # whoever gets the link sees the same
    page.wait_for_function(f"() => ({WORD})().join() === 'map,details,time tree'")


def test_keys_move_and_hide_panels_and_the_menu_brings_them_back(page):
    page.focus("[data-panel=details] > .grip")
    page.keyboard.press("ArrowUp")
    page.wait_for_function(f"() => ({WORD})()[1] === 'details map'")
    page.wait_for_function("() => document.activeElement.matches('[data-panel=details] > .grip')")
    page.keyboard.press("ArrowLeft")
    page.wait_for_function(f"() => ({WORD})()[0] === 'tree details'")
    page.wait_for_function("() => document.activeElement.matches('[data-panel=details] > .grip')")
    page.keyboard.press("Delete")
    page.wait_for_function(f"() => ({WORD})()[0] === 'tree'")
    page.click(".top .menu > button")
    page.click(".panel-lines summary")
    page.select_option(".panel-lines label:has-text('Details') select", "right")
    page.wait_for_function(f"() => ({WORD})()[1] === 'map details'")
    page.select_option(".panel-lines label:has-text('States') select", "hidden")
    page.wait_for_function(f"() => ({WORD})()[0] === ''")
    page.click(".panel-lines button")
    page.wait_for_function(f"() => ({WORD})().join() === 'tree,map details,time'")


def test_borders_are_moved_by_the_pointer_and_by_keys(page):
    wide = "() => document.querySelector('.dock.right').getBoundingClientRect().width"
    before = page.evaluate(wide)
    x, y = middle(page, ".dock.right > .handle")
    drag(page, (x, y), (x - 100, y))
    assert page.evaluate(wide) == pytest.approx(before + 100, abs=2)
    page.focus(".dock.right > .handle")
    page.keyboard.press("ArrowRight")
    page.wait_for_function(f"() => ({wide})() < {before + 90}")
    tall = "() => smachpy.page.timeline.canvas.clientHeight"
    before = page.evaluate(tall)
    x, y = middle(page, ".dock.bottom .handle")
    drag(page, (x, y), (x, y - 80))
    page.wait_for_function(f"() => Math.abs(({tall})() - {before + 80}) <= 2")


def test_a_question_is_seen_though_the_details_are_hidden(served, look):
    asked = {"text": "Go on?", "answers": ["yes", "no"], "words": ["Yes", "No"], "default": "no",
             "patience": 60.0, "service": "/x", "has_picture": False}  # fmt: skip
    machine = served.add("one", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
    page = look(f"{served.start(token='t')}#token=t")
    page.evaluate(
        "() => { localStorage.setItem('smachpy.panels', JSON.stringify('tree||time|208:416')); }"
    )
    page.reload()
    page.wait_for_selector("html[data-drawn]")
    assert page.evaluate(WORD) == ["tree", "", "time"]
    machine.add(served.events([("QuestionAsked", "/JOB/A", asked)], after=2))
    with page.expect_response("**/api/control*"):
        page.click(".question .answer:text-is('Yes')")


def test_a_phone_shows_one_part_at_a_time(page):
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_selector(".parts button:nth-child(4)")
    assert [one.text_content().strip() for one in page.locator(".parts button").all()] == [
        "Machine", "Map", "Time", "Log",
    ]  # fmt: skip
    seen = {
        "Machine": ".diagram", "Map": ".map-view canvas", "Time": ".timeline canvas[role=slider]", "Log": ".log",
    }  # fmt: skip
    for title, selector in seen.items():
        page.click(f".parts button:has-text('{title}')")
        page.wait_for_selector(selector, state="visible")
        for other in seen.values():
            assert page.is_visible(other) == (other == selector), (title, other)
        box = page.locator(selector).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
    page.click(".log .link >> nth=0")  # a state: the machine is shown
    page.wait_for_selector(".diagram", state="visible")
    sizes = page.evaluate(
        "() => [...document.querySelectorAll('.parts button')].map((b) => b.clientHeight)"
    )
    assert min(sizes) >= 44
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
