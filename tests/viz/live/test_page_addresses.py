"""The pages of the viewer: each has an address, Back works, and what is covered is out of reach."""

from __future__ import annotations

import pytest

from smachpy_viz.live.runs import Runs
from tests.browser import wait_for

pytestmark = pytest.mark.browser

EVENTS = [("Started", "/JOB"), ("Entered", "/JOB/A")]
ASKED = {"text": "May I?", "answers": ["yes", "no"], "words": ["", ""], "default": "no", "patience": 60.0,
         "service": "s", "has_picture": False}  # fmt: skip
# The page at the middle of the window.
VISIBLE = """() => {
    const section = document.elementFromPoint(innerWidth * 0.55, 300)?.closest("section, main");
    return section?.className.split(" ")[0];
}"""


@pytest.fixture
def two(served, tmp_path):
    served.add("one", events=EVENTS)
    served.add("two", label="OTHER", events=[("Started", "/OTHER")])
    served.start(token="t", runs=Runs(served.machines, [tmp_path]))
    return served


def shows(page, name):
    wait_for(page, f"smachpy.store.view.pageShown.value === '{name}'")
    places = {
        "machine": "stage",
        "runs": "home",
        "actions": "actions-page",
        "fleet": "fleet",
        "simulate": "simulate",
    }
    page.wait_for_function(f"() => ({VISIBLE})() === '{places[name]}'")


def test_each_page_is_reached_from_each_and_back_leads_to_the_one_before(two, look):
    page = look(f"{two.address}?machine=one#token=t")
    page.click("#actions")
    shows(page, "actions")
    page.click("#runs")
    shows(page, "runs")
    page.click("button:has-text('Simulate')")
    shows(page, "simulate")
    page.click(".simulate button:has-text('Close')")
    shows(page, "runs")
    page.click("button:has-text('Fleet')")
    shows(page, "fleet")
    page.click(".fleet .cards button:has-text('OTHER')")
    shows(page, "machine")
    wait_for(page, "smachpy.store.data.facts.value?.name === 'two'")
    for name in ("fleet", "runs", "simulate", "runs", "actions", "machine"):
        page.go_back()
        shows(page, name)
    wait_for(page, "smachpy.store.data.facts.value?.name === 'one'")
    page.go_forward()
    shows(page, "actions")
    page.reload()
    shows(page, "actions")


def test_choosing_a_machine_can_be_undone(two, look):
    page = look(f"{two.address}?machine=one#token=t")
    page.select_option(".chooser select", "two")
    wait_for(page, "smachpy.store.data.facts.value?.name === 'two'")
    page.go_back()
    wait_for(page, "smachpy.store.data.facts.value?.name === 'one'")
    assert page.input_value(".chooser select") == "one"


REACHED = """() => {
    const one = document.activeElement;
    const { left, top, width, height } = one.getBoundingClientRect();
    const seen = document.elementFromPoint(left + width / 2, top + height / 2);
    return one === document.body || Boolean(seen && (one.contains(seen) || seen.contains(one)));
}"""


@pytest.mark.parametrize("key", ["h", "a"])
def test_the_keyboard_reaches_nothing_that_is_covered(two, look, key):
    page = look(f"{two.address}?machine=one#token=t")
    page.keyboard.press(key)
    wait_for(page, "smachpy.store.view.pageShown.value !== 'machine'")
    for _ in range(25):
        page.keyboard.press("Tab")
        assert page.evaluate(REACHED), page.evaluate("() => document.activeElement.outerHTML")


# Whether the questions lie over a part of the page.
COVERS = """() => {
    const section = document.querySelector(".home, .fleet, .actions-page, .simulate");
    if (!section) return false;
    const [a, b] = [section, document.querySelector(".questions")].map((one) => one.getBoundingClientRect());
    return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}"""


@pytest.mark.parametrize("size", [(1400, 900), (1000, 800), (390, 844)])
@pytest.mark.parametrize("place", ["runs", "actions", "fleet", "simulate", "machine"])
def test_a_question_is_on_every_page_and_covers_nothing(served, look, place, size):
    served.add("one", events=[*EVENTS, ("QuestionAsked", "/JOB/A", ASKED)])
    page = look(f"{served.start(token='t')}?{place}=#token=t", drawn=False)
    page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
    page.wait_for_selector(".question .answer")
    assert not page.evaluate(COVERS)
    with page.expect_response("**/api/control*"):
        page.click(".question .answer:text-is('yes')")  # it is not covered
    assert [one["answer"] for one in served.commands] == ["yes"]


def test_a_question_of_another_machine_leads_to_it(two, look):
    page = look(f"{two.address}?machine=two#token=t")
    two.machines.get("one").add(two.events([("QuestionAsked", "/JOB/A", ASKED)], after=2))
    page.keyboard.press("h")
    page.click(".question.elsewhere:has-text('JOB') button")
    page.wait_for_selector(".question .answer:text-is('yes')")
    shows(page, "machine")


def test_phones_show_who_answered(served, look):
    machine = served.add("one", events=[*EVENTS, ("QuestionAsked", "/JOB/A", ASKED)])
    page = look(f"{served.start(token='t')}#token=t")
    page.set_viewport_size({"width": 390, "height": 844})
    for part in ("Machine", "Log"):
        page.click(f".parts button:has-text('{part}')")
        page.wait_for_selector(".question .answer:text-is('yes')")
    answered = {"service": "s", "answer": "yes", "by": "ann"}
    # The answer is shown for three seconds: the present stands still.
    page.evaluate("() => { const { data } = smachpy.store; data.liveMs = () => data.run.last(); }")
    machine.add(served.events([("QuestionAnswered", "/JOB/A", answered)], after=3))
    page.wait_for_selector(".question.over:has-text('answered yes by ann')")
    shown = page.locator(".question.over").bounding_box()
    assert shown["height"] > 20
    assert shown["y"] + shown["height"] <= 844


def test_a_dialog_has_the_focus_and_gives_it_back(two, look):
    page = look(f"{two.address}?machine=one#token=t")
    page.focus("#runs")
    page.keyboard.press("?")
    inside = "() => document.activeElement === document.body || Boolean(document.activeElement.closest('dialog'))"
    wait_for(page, "document.querySelector('dialog[open]')")
    for _ in range(5):
        assert page.evaluate(inside)
        page.keyboard.press("Tab")
    before = page.evaluate("() => smachpy.page.view.k")
    page.keyboard.press("+")  # no shortcut of the page works behind it
    assert page.evaluate("() => smachpy.page.view.k") == before
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    wait_for(page, "document.activeElement.id === 'runs'")
    page.click(".menu > button")
    page.wait_for_selector(".sheet")
    page.keyboard.press("Escape")
    page.wait_for_selector(".sheet", state="detached")


def test_the_log_is_one_stop_of_tab_and_arrows_go_through_it(served, look):
    events = [*EVENTS, ("Left", "/JOB/A", {"outcome": "ok"}), ("Entered", "/JOB/B")]
    served.add("one", events=events)
    page = look(served.start())
    page.wait_for_selector(".log li")
    stops = page.locator(".log button[tabindex='0']")
    assert stops.count() == 1
    stops.first.focus()
    page.keyboard.press("ArrowDown")
    assert (
        page.evaluate(
            "() => [...document.querySelectorAll('.log button')].indexOf(document.activeElement)"
        )
        == 1
    )
    for handle in page.locator("[role=separator]").all():
        assert int(handle.get_attribute("aria-valuenow")) >= 0
