"""The page while it looks at the past, on small screens, by touch; and what its panels say."""

from __future__ import annotations

import pytest

from smachpy import CBState, StateMachine
from tests.browser import wait_for

pytestmark = pytest.mark.browser

BEGUN = [("Started", "/JOB", {"initial": ["A"]}), ("Entered", "/JOB/A", {"at": 1.0})]
LATER = [
    ("Left", "/JOB/A", {"outcome": "ok", "at": 33.04}),
    ("Entered", "/JOB/B", {"at": 33.04}),
]
HOUR_NS = 3600 * 10**9  # of a run that far ahead, the present stands at its last event
CONTROL = {"paused": False, "breakpoints": []}


def seek(page, seconds):
    page.evaluate(
        f"() => smachpy.store.playback.seek(smachpy.store.data.run.first() + {seconds} * 1000)"
    )


def test_the_past_says_which_instant_and_disarms_what_commands(served, look):
    served.add("one", events=[*BEGUN, *LATER], control=CONTROL)
    page = look(f"{served.start(token='t')}#token=t")
    wait_for(page, "document.querySelector('#pause')")
    seek(page, 32)
    wait_for(page, "document.querySelector('.banner.past')")
    assert "Viewing 00:32.0, 1.0 s ago" in page.text_content(".banner.past")
    page.evaluate("() => smachpy.page.select('/JOB/B')")
    wait_for(page, "document.querySelectorAll('.actions [aria-disabled=true]').length >= 3")
    for button in ("#pause", "#pause-now", ".actions button:text-is('Breakpoint')"):
        assert "back to live" in page.get_attribute(button, "title")
        page.click(button, force=True)  # it is marked as one that does nothing
        page.wait_for_selector(".notice.error")
    # Space plays, and a second later that would be the present.
    page.evaluate("() => smachpy.store.playback.setRate(0)")
    page.keyboard.press("Space")
    page.keyboard.press("s")
    assert served.commands == []
    page.click(".banner.past button")
    wait_for(page, "document.querySelector('#pause[aria-disabled=false]')")
    page.click("#pause")
    page.wait_for_selector(".notice.info")
    assert [one["command"] for one in served.commands] == ["pause"]


def test_a_run_that_has_ended_is_shown_whole_and_commands_nothing(served, look):
    late = ("Finished", "/JOB", {"outcome": "ok", "at": 300.0})
    machine = served.add("one", events=[*BEGUN, *LATER, late], control=CONTROL)
    page = look(f"{served.start(token='t')}#token=t")
    wait_for(page, "smachpy.store.data.run.now.ended")
    assert page.query_selector("#pause") is None
    assert page.evaluate("() => smachpy.page.timeline.window.length") > 300_000
    machine.add(served.events(BEGUN, after=5))
    page.wait_for_selector("#pause")


def test_instants_are_clocks(served, look):
    served.add("one", events=[*BEGUN, *LATER])
    page = look(served.start())
    text = "(s) => smachpy.store.clock.instantText(smachpy.store.data.run.first() + s * 1000)"
    asked = [0, 32.04, 59.96, 3599.99, 3723.5, -1]
    shown = [page.evaluate(text, s) for s in asked]
    assert shown == ["00:00.0", "00:32.0", "01:00.0", "1:00:00.0", "1:02:03.5", "-00:01.0"]


def test_the_instant_stays_on_the_lanes(served, look):
    served.add("one", events=[*BEGUN, *LATER])
    page = look(served.start())
    seek(page, 1)
    page.evaluate(
        "() => { const t = smachpy.page.timeline; t.window.end = smachpy.store.data.run.last(); t.window.length = 2000; t.draw(); }"
    )
    # The line is drawn at the left end of the lanes, not over their names.
    column = """() => { const t = smachpy.page.timeline, c = t.canvas, r = devicePixelRatio;
      const d = t.context.getImageData(0, 2 * r, c.width, 1).data;
        const want = getComputedStyle(document.documentElement)
      .getPropertyValue('--active').trim(); const hex = (i) => '#' + [0, 1,
        2].map((k) => d[4 * i + k].toString(16).padStart(2, '0')).join('');
      const hits = []; for (let i = 0; i < c.width; i++) if (hex(i) === want.toLowerCase()) hits.push(i / r);
      return [Math.min(...hits), t.names]; }"""
    at, names = page.evaluate(column)
    assert abs(at - names) < 3


def test_space_after_a_click_on_a_button_pauses(served, look):
    served.add("one", events=BEGUN, control=CONTROL)
    page = look(f"{served.start(token='t')}#token=t")
    wait_for(page, "document.querySelector('#pause')")
    page.evaluate("() => smachpy.page.select('/JOB/B')")
    page.click(".actions button:text-is('Breakpoint')")
    page.keyboard.press("Space")
    wait_for(page, "document.querySelector('.notice')?.textContent === 'pause: done'")
    assert [one["command"] for one in served.commands] == ["break", "pause"]


def test_what_is_held_back_and_why_is_said(served, look):
    held = ("Paused", "/JOB/B", {"reason": "breakpoint", "at": 33.1})
    paused = {"paused": True, "breakpoints": [["/JOB/B", None]]}
    served.add("one", events=[*BEGUN, LATER[0], held], control=paused)
    page = look(served.start())
    wait_for(page, "smachpy.store.status.runStatus.value.word === 'paused before B (breakpoint)'")


def test_selected_looks_like_nothing_else(served, look):
    served.add("one", events=BEGUN)
    page = look(served.start())
    page.click('g[data-path="/JOB/B"] .frame')
    colour = """(p) => { const s = getComputedStyle(document.querySelector(`g[data-path='${p}'] > .frame`));
      return [s.outlineStyle, s.outlineColor, s.stroke]; }"""
    (_, running_line, running), (style, line, stroke) = (
        page.evaluate(colour, path) for path in ("/JOB/A", "/JOB/B")
    )
    assert style == "solid"
    assert line not in {running, running_line} or running_line == line != running
    assert stroke != running


def test_a_flight_never_mirrors_the_picture(served, look):
    served.add("one", events=BEGUN)
    page = look(served.start())
    scales = page.evaluate(
        """() => new Promise((done) => { const { view } = smachpy.page, scales = [], real = requestAnimationFrame;
        window.requestAnimationFrame = (f) => real((t) => { f(t - 900 + 400 * scales.length); scales.push(view.k); });
        view.set(0, 0, 1); view.animateTo(50, 50, 0.5);
        const look = () => (view.k === 0.5 ? done(scales) : real(look)); look(); })"""
    )
    assert all(0.5 <= k <= 1 for k in scales)
    assert scales[-1] == 0.5


def test_a_recording_without_an_end_stands_where_it_ends(served, look):
    served.began = 978_307_200_000_000_000  # a run in virtual time
    served.add("one", events=[*BEGUN, *LATER]).recorded = True
    page = look(served.start())
    wait_for(page, "smachpy.store.clock.instantText(smachpy.store.playback.nowMs()) === '00:33.0'")


def test_two_fingers_zoom(served, look):
    served.add("one", events=BEGUN)
    page = look(served.start())
    pinch = """() => { const svg = document.querySelector('.diagram'), { view } = smachpy.page; view.set(0, 0, 1);
      const on = (type, id, x, target = window) => target.dispatchEvent(new PointerEvent(type,
        { pointerId: id, clientX: x, clientY: 300, bubbles: true, pointerType: 'touch' }));
      const box = svg.getBoundingClientRect();
      on('pointerdown', 1, 500, svg); on('pointerdown', 2, 600, svg);
      on('pointermove', 2, 700); on('pointermove', 1, 400);
      const wide = [view.k, (550 - box.left - view.x) / view.k];
      on('pointerup', 1, 400); on('pointermove', 2, 720); const k = view.k;
      on('pointerup', 2, 720); on('pointermove', 2, 900);
      return [...wide, 550 - box.left, k, view.x]; }"""
    k, under, middle, after, x = page.evaluate(pinch)
    assert k == pytest.approx(3)
    assert under == pytest.approx(middle)  # what was between the fingers still is
    assert after == pytest.approx(3)
    assert page.evaluate("() => smachpy.page.view.x") == x


def test_buttons_zoom_and_cover_nothing(served, look):
    served.add("one", events=BEGUN)
    page = look(served.start())
    before = page.evaluate("() => smachpy.page.view.k")
    page.click("[aria-label='zoom out']")
    assert page.evaluate("() => smachpy.page.view.k") < before
    page.click("[aria-label='zoom in']")
    assert page.evaluate("() => smachpy.page.view.k") == pytest.approx(before)
    below = """() => document.querySelector('.strip').getBoundingClientRect().top
        >= document.querySelector('.diagram').getBoundingClientRect().bottom - 0.5"""
    assert page.evaluate(below)


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (390, 844), (844, 390)])
def test_the_words_about_the_past_cover_nothing_of_the_machine(served, look, size):
    late = ("Left", "/JOB/A", {"outcome": "ok", "at": 500.0})  # "8 min 19 ago" is long
    served.add("one", labels="ABCDEFGHIJ", events=[*BEGUN, late])
    page = look(served.start(), viewport={"width": size[0], "height": size[1]})
    seek(page, 1)
    page.wait_for_selector(".banner.past")
    between = """() => document.querySelector('.diagram g[data-path="/JOB"] .frame').getBoundingClientRect().top
        - document.querySelector('.banner.past').getBoundingClientRect().bottom"""
    assert page.evaluate(between) >= 0


def test_the_tree_opens_on_a_small_screen(served, look):
    served.add("one", events=BEGUN)
    page = look(served.start())
    page.set_viewport_size({"width": 390, "height": 844})
    assert not page.is_visible(".tree")
    page.click(".menu > button")
    page.click(".sheet button:text-is('States')")
    page.click("[role=treeitem][title='/JOB/B']")
    wait_for(page, "smachpy.store.view.selected.value === '/JOB/B'")
    assert not page.is_visible(".tree")
    page.keyboard.press("t")
    page.wait_for_selector(".tree", state="visible")
    page.keyboard.press("Escape")
    page.wait_for_selector(".tree", state="hidden")


def test_following_a_run_that_has_ended_shows_where(served, look):
    inner = StateMachine(outcomes=["done"])
    with inner:
        StateMachine.add("DEEP", CBState(lambda _: "ok", outcomes=["ok"]), {"ok": "done"})
    sm = StateMachine(outcomes=["done"], name="JOB")
    with sm:
        StateMachine.add("A", inner, {"done": "B"})
        StateMachine.add("B", CBState(lambda _: "ok", outcomes=["ok"]), {"ok": "done"})
    ended = [
        *BEGUN, ("Entered", "/JOB/A/DEEP", {"at": 2.0}), ("Left", "/JOB/A/DEEP", {"outcome": "ok", "at": 3.0}),
        ("Left", "/JOB/A", {"outcome": "done", "at": 3.0}), ("Finished", "/JOB", {"outcome": "done", "at": 3.0}),
    ]  # fmt: skip
    served.add("one", sm=sm, events=ended)
    page = look(served.start())
    page.keyboard.press("1")
    page.keyboard.press("o")
    wait_for(page, "document.querySelector('g[data-path=\"/JOB/A/DEEP\"]')")


def goal(n, path, at, **more):
    sent = {"action": "robot_0/move_base", "goal_id": str(n), "goal": {"x": 1.5708000000000002}}
    done = {
        "action": "robot_0/move_base",
        "goal_id": str(n),
        "status": "SUCCEEDED",
        "text": "arrived",
    }
    yield ("GoalSent", path, {**sent, "at": at})
    yield ("GoalDone", path, {**done, "result": None, "at": at + 0.5, **more})


def test_goals_that_have_ended_are_a_line_each(served, look):
    served.began += HOUR_NS
    ended = [event for n in range(5) for event in goal(n, "/JOB/A", 2 + n)]
    served.add("one", events=[*BEGUN, *ended])
    page = look(served.start())
    lines = page.locator(".ended-goal")
    assert lines.count() == 3
    assert all(lines.nth(n).bounding_box()["height"] < 30 for n in range(3))
    assert "arrived" in lines.nth(0).text_content()
    assert page.evaluate(
        """() => { const link = document.querySelector('.ended-goal .link');
          return link.scrollWidth <= link.clientWidth; }"""
    )
    page.click("button:text-is('2 earlier')")
    wait_for(page, "document.querySelectorAll('.ended-goal').length === 5")
    lines.nth(0).locator(".what").click()
    wait_for(page, "document.querySelector('.ended-goal pre')?.textContent.includes('goal')")


@pytest.mark.parametrize(
    ("source", "until", "shown"),
    [("concurrence", 3.2, 0), ("operator", 3.2, 1), ("concurrence", 5.0, 1)],
)
def test_only_a_preempt_worth_reading_has_a_section(served, look, source, until, shown):
    asked = ("PreemptRequested", "/JOB/A", {"source": source, "by": "/JOB/B", "why": "", "at": 3.0})
    left = ("Left", "/JOB/A", {"outcome": "preempted", "at": until})
    served.began += HOUR_NS
    served.add("one", events=[*BEGUN, asked, left])
    page = look(served.start())
    page.wait_for_selector(".log li")
    assert page.locator(".preempt").count() == shown


def test_names_carry_their_parent_where_they_repeat(served, look):
    sm = StateMachine(outcomes=["done"], name="JOB")
    with sm:
        for name, after in (("A", "B"), ("B", "done")):
            inner = StateMachine(outcomes=["done"])
            with inner:
                StateMachine.add("DRIVE", CBState(lambda _: "ok", outcomes=["ok"]), {"ok": "done"})
            StateMachine.add(name, inner, {"done": after})
    drove = [
        ("Entered", "/JOB/A/DRIVE", {"at": 2.0}),
        ("Left", "/JOB/A/DRIVE", {"outcome": "ok", "at": 3.0}),
    ]
    served.add("one", sm=sm, events=[*BEGUN, *drove])
    page = look(served.start())
    wait_for(page, "document.querySelector('.log')?.textContent.includes('A \u203a DRIVE')")


def test_values_are_trees_and_rounded(served, look):
    pose = {"$object": "Pose2D", "fields": {"x": 9.8, "yaw": 1.5708000000000002}}
    value = {"$object": "Waypoint", "fields": {"name": "dock 2", "pose": pose}}
    wrote = ("UserdataWritten", "/JOB/A", {"key": "task", "value": value, "at": 2.0})
    served.add("one", events=[*BEGUN, wrote])
    page = look(served.start())
    assert "yaw=1.5708)" in page.text_content(".userdata code")
    page.click(".userdata tr")
    wait_for(page, "document.querySelectorAll('.value-tree .value-tree li').length === 2")
    assert page.text_content(".value-tree .value-tree li:nth-child(2)") == "yaw 1.5708"


def test_the_log_is_always_in_sight(served, look):
    wrote = [
        ("UserdataWritten", "/JOB/A", {"key": f"key_{n}", "value": n, "at": 2.0}) for n in range(50)
    ]
    served.add("one", events=[*BEGUN, *wrote])
    page = look(served.start())
    box = page.locator(".log").bounding_box()
    assert box["y"] + box["height"] <= 900
    assert box["height"] >= 140


def test_why_it_ended_so_and_a_step_goes_there(served, look):
    ended = [
        ("Failed", "/JOB/A", {"error": "KeyError: 'x'", "trace": "job.py:7 in go: x", "at": 33.0}),
        ("Finished", "/JOB", {"outcome": None, "at": 33.0}),
    ]
    machine = served.add("one", events=BEGUN)
    page = look(served.start())
    assert page.locator(".why-button").count() == 0  # it runs
    machine.add(served.events([*ended], after=2))
    page.click(".why-button")
    page.wait_for_selector(".why li")
    said = [text.split() for text in page.locator(".why .step").all_text_contents()]
    assert [(words[0], words[-1]) for words in said] == [
        ("A", "00:33.00"),
        ("A", "00:33.00"),
        ("JOB", "00:33.00"),
    ]
    assert page.text_content(".why pre") == "job.py:7 in go: x"
    page.click(".why .step")
    wait_for(
        page,
        "smachpy.store.view.selected.value === '/JOB/A' && smachpy.store.playback.cursor.value !== null",
    )
    page.keyboard.press("w")
    wait_for(page, "!document.querySelector('.why')")
    page.keyboard.press("l")
    page.set_viewport_size({"width": 390, "height": 844})
    page.click(".why-button")
    page.wait_for_selector(".why li", state="visible")
    tops = "() => ['.why', '.log'].map((name) => document.querySelector(name).getBoundingClientRect().top)"
    why, log = page.evaluate(tops)
    assert why < log
    for kind in ("success", "failure", "preempted", "other"):  # its number can be read
        number = page.evaluate(
            """(kind) => { const step = document.querySelector('.why li');
              step.className = `${kind} first`;
              const { color, backgroundColor } = getComputedStyle(step, '::before');
              return [color, backgroundColor]; }""",
            kind,
        )
        assert number[0] != number[1]


def test_the_way_to_the_end_is_opened_and_drawn_thick(served, look):
    """From the state that failed through the transition and each container's outcome."""
    inner = StateMachine(outcomes=["aborted", "done"], input_keys=["x"], output_keys=["x"])
    with inner:
        go = CBState(lambda _: "aborted", outcomes=["aborted"], output_keys=["x"])
        StateMachine.add("GO", go, {"aborted": "aborted"})
    sm = StateMachine(outcomes=["aborted", "done"], name="JOB")
    with sm:
        StateMachine.add("IN", inner, {"done": "NEXT", "aborted": "aborted"})
        StateMachine.add("NEXT", CBState(lambda _: "done", outcomes=["done"]))
    events = [
        ("Started", "/JOB", {"initial": ["IN"]}),
        ("Entered", "/JOB/IN"),
        ("UserdataWritten", "/JOB/IN/NEXT", {"key": "x", "value": 1}),
        ("Entered", "/JOB/IN/GO"),
        ("UserdataWritten", "/JOB/IN/GO", {"key": "x", "value": 2}),
        ("Left", "/JOB/IN/GO", {"outcome": "aborted"}),
        ("Left", "/JOB/IN", {"outcome": "aborted"}),
        ("Finished", "/JOB", {"outcome": "aborted"}),
    ]
    served.add("one", sm=sm, events=events)
    page = look(served.start())
    page.evaluate(
        "async () => { smachpy.page.layouts.setDepth(1); await smachpy.page.layouts.running; }"
    )
    assert page.locator('g[data-path="/JOB/IN/GO"]').count() == 0
    page.click(".why-button")
    for path in ("/JOB/IN/GO", "/JOB/IN", "/JOB"):
        page.wait_for_selector(f'g.on-way[data-path="{path}"]')
    assert page.locator("g.on-way[data-path='/JOB/NEXT']").count() == 0
    assert page.locator("path.edge.on-way").count() == 2
    assert page.locator(".pill.on-way").all_text_contents() == ["aborted", "aborted"]
    assert "wrote x 2 (was 1)" in " ".join(page.locator(".why p").all_text_contents())
    page.keyboard.press("w")
    page.wait_for_selector(".on-way", state="detached")


def test_a_run_in_one_file_says_why_too(served, look, tmp_path):
    ended = [
        ("Left", "/JOB/A", {"outcome": "aborted", "at": 2.0}),
        ("Finished", "/JOB", {"outcome": "aborted", "at": 2.0}),
    ]
    served.add("one", events=[*BEGUN, *ended])
    page = look(served.start())
    saved = page.request.get(f"{served.address}api/export?machine=one&format=html")
    file = tmp_path / "run.html"
    file.write_bytes(saved.body())
    alone = look(file.as_uri())
    alone.keyboard.press("w")
    alone.wait_for_selector(".why li")
    assert "aborted" in alone.text_content(".why")


def test_an_old_tab_asks_for_the_token_of_a_new_viewer(served, look):
    served.add("one", events=BEGUN, control=CONTROL)
    page = look(f"{served.start(token='new')}#token=old")
    wait_for(page, "document.querySelector('#pause')")
    page.click("#pause")
    page.wait_for_selector(".token")
    page.fill(".token input", "no token here")
    page.click(".token .primary")
    page.wait_for_selector(".token .problem")
    page.fill(".token input", "http://127.0.0.1:8080/?machine=one#token=new")
    page.click(".token .primary")
    page.wait_for_selector(".token", state="detached")
    assert served.commands == []  # nothing is sent twice by itself
    page.click("#pause")
    wait_for(page, "document.querySelector('.notice')?.textContent === 'pause: done'")
    assert [one["command"] for one in served.commands] == ["pause"]


def test_an_old_tab_takes_the_token_of_an_address_that_is_pasted_into_it(served, look):
    served.add("one", events=BEGUN, control=CONTROL)
    page = look(f"{served.start(token='new')}#token=old")
    page.evaluate("() => { location.hash = 'token=new'; }")
    wait_for(page, "!location.hash.includes('token')")
    page.click("#pause")
    wait_for(page, "document.querySelector('.notice')?.textContent === 'pause: done'")


def test_a_page_without_the_token_for_reading_shows_nothing_and_one_with_it_commands_nothing(
    served, look
):
    served.add("one", events=BEGUN, control=CONTROL)
    address = served.start(token="commander", read_token="reader")
    stranger = look(address, drawn=False)
    stranger.wait_for_selector(".token")  # it asks for one
    assert stranger.locator("g.leaf").count() == 0
    reader = look(f"{address}#view=reader")
    assert reader.locator("g.leaf").count() == 2
    assert "reader" not in reader.url
    assert reader.query_selector("#pause") is None


def test_escape_closes_the_dialog_and_not_what_is_below(served, look):
    served.add("one", events=BEGUN)
    page = look(served.start())
    page.keyboard.press("h")
    page.keyboard.press("?")
    page.wait_for_selector("dialog[open]")
    page.keyboard.press("h")  # keys are for the dialog
    page.keyboard.press("Escape")
    wait_for(page, "!document.querySelector('dialog[open]')")
    assert page.evaluate("() => smachpy.store.view.pageShown.value === 'runs'")


def test_a_recording_of_another_machine_is_shown_with_its_own_states_alone(served, look):
    other = [("Started", "/OTHER"), ("Entered", "/OTHER/X"), ("Left", "/OTHER/X", {"outcome": "x"})]
    served.add("one", events=[*other, ("Finished", "/OTHER", {"outcome": "x"})]).recorded = True
    page = look(served.start())
    assert page.evaluate("() => [...smachpy.page.diagram.picture.states.keys()]") == [
        "/JOB", "/JOB/A", "/JOB/B",
    ]  # fmt: skip
    wait_for(page, "document.querySelectorAll('.log li').length === 3")  # what happened is there
    assert page.evaluate("() => smachpy.page.timeline.bars.hits") == []
