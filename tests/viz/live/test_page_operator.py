"""What an operator relies on: commands reach what was asked about, and their buttons stay in place."""

from __future__ import annotations

import threading

import pytest

from tests.browser import draw, wait_for

pytestmark = pytest.mark.browser

FREE = {"paused": False, "breakpoints": []}
GOAL = {"action": "carrier/move_base", "goal_id": "1", "goal": {"station": "kitchen"}}
RUNS = [("Started", "/JOB"), ("Entered", "/JOB/A"), ("GoalSent", "/JOB/A", GOAL)]
LEFT = ("Left", "/JOB/A", {"outcome": "ok"})


@pytest.fixture
def operated(served):
    """Two machines that take commands; in the first one, A runs and drives a robot."""
    served.add("one", labels="ABC", events=RUNS, control=FREE)
    served.add("two", label="OTHER", events=[("Started", "/OTHER")], control=FREE)
    served.start(token="t")
    return served


def open_page(look, served, name="one", **options):
    page = look(f"{served.address}?machine={name}#token=t", **options)
    page.wait_for_selector("#pause")
    return page


def select(page, path):
    page.evaluate(f"() => smachpy.page.select('{path}')")
    page.wait_for_selector(f".inspector h2:text-is('{path[-1]}')")


def withdrawn(page):
    page.wait_for_selector(".confirm", state="detached")
    wait_for(page, "document.querySelector('.notice')?.textContent.includes('was closed')")
    page.evaluate("() => { smachpy.store.view.notice.value = null; }")


def test_a_question_names_its_target_and_what_ends(operated, look):
    page = open_page(look, operated)
    page.click("#preempt")
    said = page.text_content(".confirm")
    for part in ("Preempt JOB on carrier?", "A (", "carrier/move_base \u2192 kitchen"):
        assert part in said
    wait_for(page, "document.activeElement.textContent === 'No'")
    page.keyboard.press("Escape")
    page.wait_for_selector(".confirm", state="detached")
    assert operated.commands == []
    page.click("#preempt")
    page.click(".confirm button:text-is('Preempt')")
    page.wait_for_selector(".notice.info")
    (sent,) = operated.commands
    assert (sent["command"], sent["path"]) == ("preempt", "/JOB")


def test_a_question_never_changes_its_target(operated, look):
    """It is closed when another state or machine is chosen, or what it would end has ended."""
    page = open_page(look, operated)
    select(page, "/JOB/B")
    page.click(".actions button:text-is('Jump here')")
    assert "Continue JOB on carrier at B?" in page.text_content(".confirm")
    select(page, "/JOB/C")
    withdrawn(page)
    select(page, "/JOB/A")
    page.click(".actions button:text-is('Force outcome')")
    assert "End A of JOB on carrier with ok?" in page.text_content(".confirm")
    operated.machines.get("one").add(operated.events([LEFT, ("Entered", "/JOB/B")], after=3))
    withdrawn(page)
    page.click("#preempt")
    page.wait_for_selector(".confirm")
    page.select_option(".chooser select", "two")
    withdrawn(page)
    page.wait_for_selector("#preempt:has-text('Preempt OTHER')")
    page.click("#preempt")
    page.wait_for_selector(".confirm")
    page.keyboard.press("h")
    withdrawn(page)
    assert operated.commands == []


def boxes(page):
    return page.evaluate(
        """() => [...document.querySelectorAll(".operator button")].map((b) => {
            const { left, top, right, bottom } = b.getBoundingClientRect();
            const at = (x, y) => b.contains(document.elementFromPoint(x, y));
            return [b.id, left, right, top, bottom, at(left + 3, top + 3), at(right - 3, bottom - 3)];
        })"""
    )


@pytest.mark.parametrize("width", [721, 800, 900, 1024, 1100, 1440])
def test_the_buttons_have_one_place_and_are_never_cut_off(served, look, width):
    name = "warehouse_robot_3/machines"
    machine = served.add(name, label="A_MISSION_WITH_A_LONG_NAME", events=RUNS, control=FREE)
    served.add("two", label="OTHER", control=FREE)
    page = look(f"{served.start(token='t')}?machine={name}#token=t")
    page.set_viewport_size({"width": width, "height": 768})
    page.wait_for_selector("#pause:text-is('Pause')")
    running = boxes(page)
    assert [one[0] for one in running] == ["pause", "pause-now", "step", "preempt"]
    for _, left, right, _, _, begins, ends in running:
        assert left >= 0
        assert right <= width
        assert begins
        assert ends
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    machine.set_control({"paused": True, "breakpoints": []})
    page.wait_for_selector("#pause:text-is('Resume')")
    assert boxes(page) == running
    machine.set_control(FREE)
    page.wait_for_selector("#pause:text-is('Pause')")
    page.evaluate("() => smachpy.store.playback.seek(smachpy.store.data.run.first())")
    page.wait_for_selector("#preempt[aria-disabled=true]")
    assert boxes(page) == running


@pytest.mark.parametrize("name", ["GUIDED_RECOVERY", "WAREHOUSE_DELIVERY_WITH_RECOVERY_AND_NOTES"])
@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (900, 900), (390, 844), (844, 390)])
def test_the_name_of_what_preempt_stops_is_shown_whole_in_two_or_three_lines(
    served, look, size, name
):
    served.add("one", label=name, events=[("Started", f"/{name}")], control=FREE)
    viewport = {"width": size[0], "height": size[1]}
    page = look(f"{served.start(token='t')}#token=t", viewport=viewport)
    page.wait_for_selector(f"#preempt span:text-is('Preempt {name}')")
    span = """() => { const span = document.querySelector("#preempt span"), { top, bottom } = span.getBoundingClientRect();
        const button = document.querySelector("#preempt").getBoundingClientRect();
        return [span.scrollHeight - span.clientHeight, span.scrollWidth - span.clientWidth,
            top - button.top, button.bottom - bottom]; }"""
    below, right, over, under = page.evaluate(span)
    assert max(below, right) <= 0
    assert min(over, under) >= 0


@pytest.mark.parametrize("size", [(844, 390), (667, 375)])
def test_a_phone_held_sideways_shows_the_whole_name_and_leaves_nothing_empty(served, look, size):
    served.add("one", label="PATROL", events=[("Started", "/PATROL")], control=FREE)
    page = look(f"{served.start(token='t')}#token=t")
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.wait_for_selector("#preempt span:text-is('Preempt PATROL')")
    assert page.evaluate(
        """() => { const span = document.querySelector("#preempt span");
        return span.scrollWidth <= span.clientWidth || getComputedStyle(span).overflow === "visible"; }"""
    )
    assert page.evaluate(
        "() => document.querySelector('.stage').getBoundingClientRect().right === innerWidth"
    )


# What is cut off by the window or by its own box, by class and text. (Names may be: the tip has all of them.)
CUT = """() => [...document.querySelectorAll(":is(.top, .operator, .play) :is(button, select, input, .status, .seal)")]
    .filter((one) => { const { left, right, bottom, width } = one.getBoundingClientRect();
      return width && (left < 0 || right > innerWidth || bottom > innerHeight
        || (one.matches(".status, .seal, .play *") && one.scrollWidth > one.clientWidth)); })
    .map((one) => `${one.className} ${one.id} ${one.textContent}`)"""


@pytest.mark.parametrize("size", [(390, 844), (844, 390), (900, 600), (1024, 768)])
def test_nothing_of_the_bars_is_cut_off(served, look, size):
    facts = {"text": "evidence: valid, e.json"}, {"outcome": "succeeded", "at": 5 * 3600.0}
    running = [
        *RUNS,
        ("Noted", "/JOB", facts[0]),
        ("UserdataWritten", "/JOB/A", {"key": "place_to_go_to", "value": 1}),
    ]
    served.add("one", events=[*running, ("Entered", "/JOB/B", {"at": 5 * 3600.0})], control=FREE)
    served.add("two", events=[*running, ("Finished", "/JOB", facts[1])], control=FREE)
    address = served.start(token="t")
    for name in ("one", "two"):
        page = look(f"{address}?machine={name}#token=t")
        page.set_viewport_size({"width": size[0], "height": size[1]})
        wait_for(page, f"({CUT})().length === 0")
        assert page.locator("[data-testid=seal]").bounding_box()["width"] >= 26
        assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


# Controls that are smaller than the least target of WCAG 2.2, but for those within a line of text.
SMALL = """() => [...document.querySelectorAll(":is(button, select, input, a, [role=slider])")]
    .filter((one) => one.checkVisibility({ visibilityProperty: true }) && !one.matches(".link"))
    .map((one) => [one, one.getBoundingClientRect()])
    .filter(([, { width, height }]) => width && Math.min(width, height) < 24)
    .map(([one, { width, height }]) => `${one.className} ${one.textContent} ${width} x ${height}`)"""


@pytest.mark.parametrize("size", [(390, 844), (844, 390)])
@pytest.mark.parametrize("part", ["machine", "time", "log", "runs"])
def test_what_a_finger_presses_is_large_enough(operated, look, size, part):
    page = open_page(look, operated, viewport={"width": size[0], "height": size[1]})
    if part == "runs":
        page.keyboard.press("h")
        page.wait_for_selector(".home .runs")
    else:
        page.evaluate(f"() => {{ smachpy.store.view.part.value = '{part}'; }}")
        page.wait_for_selector(f".app.part-{part}")
    draw(page)
    assert page.evaluate(SMALL) == []


def test_no_commands_where_no_machine_is_shown(operated, look):
    page = open_page(look, operated)
    for key, place in ("h", ".home"), ("a", ".actions-page"):
        page.keyboard.press(key)
        page.wait_for_selector(place)
        assert page.query_selector(".operator") is None
        page.keyboard.press("Escape")
        page.wait_for_selector(".operator")


def test_a_command_without_an_answer_turns_its_button_red(served, look):
    answer = threading.Event()
    served._send = lambda _name, _command: answer.wait(300) and {"ok": True, "text": ""}
    served.add("one", events=RUNS, control=FREE)
    served.start(token="t")
    page = open_page(look, served, patient=False)
    # What is to happen after seconds, happens when the test wants it. Preact gives no time at all.
    page.evaluate(
        """() => { window.later = []; const real = setTimeout;
        window.setTimeout = (f, ms, ...more) => ms >= 3000 ? later.push(f) : real(f, ms, ...more); }"""
    )
    try:
        page.click("#pause")
        page.wait_for_selector("#pause.sent")
        page.evaluate("() => later.shift()()")
        page.wait_for_selector("#pause.failed")
        assert "no answer in 3 s" in page.get_attribute("#pause", "title")
        assert "no answer in 3 s" in page.text_content(".notice.error")
    finally:
        answer.set()


def test_without_its_server_a_page_says_why_its_buttons_do_nothing(operated, look):
    page = open_page(look, operated)
    operated.end()
    page.wait_for_selector("#preempt[aria-disabled=true]")
    page.click("#preempt", force=True)
    wait_for(page, "document.querySelector('.notice')?.textContent.includes('does not answer')")
    assert page.query_selector(".confirm") is None


def test_resuming_a_durable_mission_asks_first(served, look):
    served.add("one")
    page = look(f"{served.start(token='t')}?runs=#token=t", drawn=False)
    mission = {"id": "m-1", "journal": "j.db", "status": "interrupted", "active": ["/PATROL/DRIVE"],
               "problem": "", "can": ["resume", "cancel"]}  # fmt: skip
    row = {"id": "x", "name": None, "machine": "PATROL", "robots": ["carrier"], "live": False, "began": 1,
           "ended": None, "last": 2, "outcome": None, "reason": "", "problem": "", "file": "", "strip": [],
           "outages": [], "run": "r", "asks": False, "stamp": 1, "mission": mission}  # fmt: skip
    page.route(
        "**/api/runs",
        lambda route: route.fulfill(json={"runs": [row], "folders": [], "journals": []}),
    )
    sent = []
    page.on(
        "request", lambda request: sent.append(request.url) if "mission" in request.url else None
    )
    page.reload()
    page.click("button[aria-label='resume m-1']")
    said = page.text_content(".confirm")
    for part in ("Resume PATROL on carrier?", "interrupted in DRIVE", "moves its robots"):
        assert part in said
    assert sent == []
    with page.expect_request("**/api/mission"):
        page.click(".confirm .warn")
