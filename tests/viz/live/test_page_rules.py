"""What the page makes of what it is told: machines and events of this process, a real browser."""

from __future__ import annotations

import asyncio
import os
import signal
import time
import urllib.request
from dataclasses import asdict

import pytest

from smachpy import CBState, Concurrence, ConditionState, StateMachine
from smachpy_viz.live import streams
from smachpy_viz.live.machines import MAX_KEPT_RUNS
from tests.browser import draw, wait_for

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
        assert page.evaluate("() => smachpy.store.status.activePaths.value") == seen[-1]
    assert seen == [["/JOB"], ["/JOB", "/JOB/B"], ["/JOB"], ["/JOB", "/JOB/A"], ["/JOB"]]
    page.keyboard.press(",")  # there is nothing before the first
    assert lit(page) == ["/JOB"]
    on = []
    for _ in range(4):
        page.keyboard.press(".")
        on.append(lit(page))
    assert on == seen[3::-1]
    page.keyboard.press(".")
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is None


def test_a_restart_keeps_the_run_before_to_look_at(served, look):
    machine = served.add("one", events=run()[:2])  # it is cut short in A
    page = look(served.start())
    history = {"problems": [], "base": None, "control": None, "description": asdict(machine.record)}
    machine.reset({**history, "epoch": "another program", "events": served.events(run()[:1])})
    page.click(".restarted button:text-is('Look at the one before')")
    wait_for(page, "smachpy.store.data.facts.value?.after === 'one'")
    assert lit(page) == ["/JOB", "/JOB/A"]
    assert page.text_content("[data-testid=status]") == "recording ends here"
    page.click("button:text-is('Show the newest')")
    wait_for(page, "smachpy.store.data.facts.value?.name === 'one'")
    wait_for(page, "!document.querySelector('.diagram g.active[data-path=\"/JOB/A\"]')")
    page.click(".restarted [aria-label=dismiss]")
    wait_for(page, "!document.querySelector('.restarted')")


def test_so_many_runs_before_are_kept(served):
    machine = served.add("one", events=run())
    history = {"problems": [], "base": None, "control": None, "description": asdict(machine.record)}
    for number in range(MAX_KEPT_RUNS + 2):
        machine.reset({**history, "epoch": str(number), "events": served.events(run())})
        machine.reset({**history, "epoch": str(number), "events": served.events(run())})
    machine.reset({**history, "epoch": "not begun", "events": []})
    machine.reset({**history, "epoch": "begun", "events": served.events(run())})
    kept = [one for one in served.machines.summaries() if one["after"] == "one"]
    assert len(kept) == MAX_KEPT_RUNS
    assert all(one["outcome"] == "done" and one["recorded"] for one in kept)
    assert machine.before in [one["name"] for one in kept]
    assert machine.summary()["outcome"] == "done"


def test_a_rule_over_several_children_is_a_bar_that_counts(served, look):
    both = Concurrence(
        outcomes=["low", "all"],
        default_outcome="all",
        outcome_map={"low": {"DRIVE": "preempted", "BATTERY": "invalid"}},
    )
    with both:
        Concurrence.add("DRIVE", CBState(lambda _: "ok", outcomes=["ok", "preempted"]))
        Concurrence.add("BATTERY", CBState(lambda _: "ok", outcomes=["ok", "invalid"]))
    sm = StateMachine(outcomes=["done"], name="JOB")
    with sm:
        StateMachine.add("A", both, {"low": "done", "all": "done"})
    begun = [("Started", "/JOB", {"initial": ["A"]})]
    begun += [("Entered", f"/JOB/A{path}") for path in ("", "/DRIVE", "/BATTERY")]
    machine = served.add("one", sm=sm, events=begun)
    page = look(served.start())
    assert page.locator("rect.join").count() == 1
    wait_for(page, "document.querySelector('.label.joined').textContent === 'both'")
    # Both arrows end on the bar, and one leads from it.
    ends = page.evaluate(
        """() => { const bar = document.querySelector('rect.join').getBBox();
        const near = (p) => p.x > bar.x - 2 && p.x < bar.x + bar.width + 2 && p.y > bar.y - 2 &&
          p.y < bar.y + bar.height + 2;
        const lines = [...document.querySelectorAll('path.edge')].map((e) => [e.getPointAtLength(0),
          e.getPointAtLength(e.getTotalLength())]);
        return [lines.filter(([, to]) => near(to)).length, lines.filter(([from]) => near(from)).length]; }"""
    )
    assert ends == [2, 1]
    left = [("Left", "/JOB/A/BATTERY", {"outcome": "invalid"})]
    machine.add(served.events(left, after=4))
    wait_for(page, "document.querySelector('.label.joined').textContent === 'both: 1 of 2'")
    assert page.locator("path.edge.arrived").count() == 1


def test_what_a_condition_finds_is_drawn_as_no_failure(served, look):
    sm = StateMachine(outcomes=["done"], name="JOB")
    with sm:
        StateMachine.add(
            "A", ConditionState(lambda _: True), {"true": "B", "false": "C", "preempted": "done"}
        )
        for name in "BC":
            StateMachine.add(name, CBState(lambda _: "no", outcomes=["no"]), {"no": "done"})
    served.add("one", sm=sm)
    page = look(served.start())
    kinds = page.evaluate(
        "() => ['A', 'B'].map((name) => [...smachpy.page.diagram.picture.arrows].filter(([key]) => /(false|no)$/.test(key)"
        " && key.startsWith(`/JOB/${name}`)).map(([, [{ line }]]) => line.getAttribute('class')))"
    )
    assert kinds == [["edge other"], ["edge failure"]]


def test_a_hidden_page_gathers_nothing_to_draw(served, look):
    machine = served.add("one", events=run()[:1])
    page = look(served.start())
    page.evaluate("() => Object.defineProperty(document, 'hidden', { value: true })")
    page.evaluate("() => { smachpy.page.scheduler.frame = 1; }")  # asked for, and never drawn
    machine.add(served.events([("Entered", "/JOB/A"), ("Left", "/JOB/A", {"outcome": "ok"})], 1))
    wait_for(page, "smachpy.store.data.run.events.length === 3")
    assert page.evaluate(
        "() => [smachpy.page.scheduler.flashes.length, smachpy.page.scheduler.latency.arrived.length]"
    ) == [
        0,
        0,
    ]


GOAL = ("GoalSent", "/JOB/A", {"action": "drive", "goal_id": "1", "goal": {"x": 1}})


def test_progress_is_as_wide_as_the_feedback_tells(served, look):
    told = {"action": "drive", "goal_id": "1", "feedback": {}}
    machine = served.add("one", events=[*run()[:2], GOAL])
    page = look(served.start())
    width = "() => document.querySelector('g[data-path=\"/JOB/A\"] .progress').getBoundingClientRect().width"
    assert page.evaluate(width) == 0
    part = {"progress": {"fraction": 0.5, "distance": None, "text": ""}}
    machine.add(served.events([("GoalFeedback", "/JOB/A", {**told, **part})], after=3))
    frame = "document.querySelector('g[data-path=\"/JOB/A\"] .frame').getBoundingClientRect().width"
    wait_for(page, f"Math.abs(({width})() / {frame} - 0.4) < 0.1")


def test_links_and_summaries_keep_their_keys(served, look, tmp_path):
    served.add("one", events=[*run()[:2], GOAL], control={"paused": False, "breakpoints": []})
    page = look(f"{served.start(token='t')}#token=t")
    wait_for(page, "document.querySelector('#pause')")
    page.focus("summary:text-is('goal')")
    page.keyboard.press("Space")
    wait_for(page, "document.querySelector('details[open] pre')")
    page.keyboard.press("Enter")
    wait_for(page, "!document.querySelector('details[open] pre')")
    page.click(".menu > button")
    page.focus(".sheet a:text-is('recording')")
    with page.expect_download() as download:
        page.keyboard.press("Enter")
    assert download.value.suggested_filename == "run.jsonl"
    assert served.commands == []
    page.evaluate("() => document.activeElement.blur()")
    page.keyboard.press("Space")
    page.wait_for_selector(".notice")
    assert [one["command"] for one in served.commands] == ["pause"]


def test_the_tree_by_keyboard(served, look):
    served.add("one", events=run()[:2], control={"paused": False, "breakpoints": []})
    page = look(f"{served.start(token='t')}#token=t")
    wait_for(page, "document.querySelectorAll('[role=treeitem]').length === 3")
    page.focus("[role=tree]")
    here = """() => document.getElementById(document.querySelector('[role=tree]')
        .getAttribute('aria-activedescendant')).title"""

    def press(*keys):
        for key in keys:
            page.keyboard.press(key)
        draw(page)
        return page.evaluate(here)

    assert page.evaluate(here) == "/JOB"
    assert press("ArrowDown", "ArrowDown") == "/JOB/B"
    assert press("ArrowDown") == "/JOB/B"
    page.keyboard.press("Space")
    assert page.evaluate("() => smachpy.store.view.selected.value") == "/JOB/B"
    assert press("ArrowUp") == "/JOB/A"
    page.keyboard.press("Enter")
    assert page.evaluate("() => smachpy.store.view.selected.value") == "/JOB/A"
    assert press("ArrowLeft") == "/JOB"
    assert press("ArrowLeft") == "/JOB"
    wait_for(page, "document.querySelectorAll('[role=treeitem]').length === 1")
    assert page.get_attribute("[role=treeitem]", "aria-expanded") == "false"
    press("ArrowRight")
    wait_for(page, "document.querySelectorAll('[role=treeitem]').length === 3")
    assert press("End") == "/JOB/B"
    assert press("Home") == "/JOB"
    assert served.commands == []


def test_a_row_of_userdata_by_keyboard(served, look):
    written = ("UserdataWritten", "/JOB/A", {"key": "load", "value": {"boxes": [1, 2]}})
    served.add("one", events=[*run()[:2], written])
    page = look(served.start())
    page.wait_for_selector(".userdata tr")
    page.focus(".userdata th button")
    page.keyboard.press("Enter")
    page.wait_for_selector(".userdata .value-tree")
    page.keyboard.press("Space")
    wait_for(page, "!document.querySelector('.userdata .value-tree')")


def test_a_server_that_says_nothing_is_lost_and_found_again(start, look):
    view = start.view()
    page = look(view.base, drawn=False)
    wait_for(page, "smachpy.store.data.connection.value === 'live'")
    os.kill(view.pid, signal.SIGSTOP)
    try:
        wait_for(page, "smachpy.store.data.connection.value === 'lost'")
        page.wait_for_selector("text=does not answer")
    finally:
        os.kill(view.pid, signal.SIGCONT)
    wait_for(page, "smachpy.store.data.connection.value === 'live'")


def test_a_message_that_comes_slowly_is_waited_for(served, look, monkeypatch):
    """What a slow link brings is no message before its end, and looks as if nothing came."""
    beat, slow = 0.05, 0.6
    opened = []
    messages = streams.Streams._messages

    async def slowly(viewer, one, stranger):
        opened.append(one)
        async for text in messages(viewer, one, stranger):
            if text.startswith("event: snap"):
                yield text[:40]
                await asyncio.sleep(slow)
                text = text[40:]
            yield text

    served.beat = beat
    monkeypatch.setattr(streams, "BEAT_S", beat)
    monkeypatch.setattr(streams.Streams, "_messages", slowly)
    served.add("one", events=run())
    page = look(served.start())
    assert len(opened) > 1  # it was cut at first
    wait_for(page, "smachpy.store.data.connection.value === 'live'")


def test_a_page_that_was_cut_off_goes_on_where_it_was(served, look):
    machine = served.add("one", events=run()[:2])
    page = look(served.start())
    page.keyboard.press(",")
    page.evaluate("() => smachpy.reconnect()")
    wait_for(page, "smachpy.store.data.connection.value === 'live'")
    machine.add(served.events(run()[2:4], after=2))
    wait_for(page, "smachpy.store.data.run.events.length === 4")
    assert (
        page.evaluate("() => smachpy.store.playback.cursor.value") is not None
    )  # still looking back


def test_a_busy_network_does_not_hold_the_beat_up(served):
    served.add("one", events=run())
    busy = served.machines.obtain("busy")
    with urllib.request.urlopen(f"{served.start()}api/events?machine=one", timeout=60) as stream:
        beats = 0
        while beats < 2:
            busy.set_stale(None)  # wakes the page
            if stream.readline() == b"event: beat\n":
                beats += 1


def test_the_machine_chosen_last_is_shown_however_late_the_first_answers(served, look):
    served.add("one", label="ONE")
    served.add("two", label="TWO", labels="XYZ")
    page = look(served.start())
    held = []
    page.route("**/api/model?machine=one*", lambda route: held.append(route))
    choose = "(name) => smachpy.choose(name)"
    page.evaluate(choose, "two")
    page.wait_for_selector('g[data-path="/TWO/Z"]')
    with page.expect_request("**/api/model?machine=one*"):
        page.evaluate(choose, "one")
    page.evaluate(choose, "two")
    page.wait_for_selector('g[data-path="/TWO/Z"]')
    wait_for(page, "smachpy.store.data.facts.value?.name === 'two'")
    [late] = held
    with page.expect_response("**/api/model?machine=one*") as answer:
        late.continue_()
    answer.value.finished()
    draw(page)
    assert page.evaluate("() => smachpy.store.data.model.value.root.path") == "/TWO"
    assert page.query_selector('g[data-path="/TWO/Z"]') is not None


def test_a_structure_that_could_not_be_fetched_is_asked_for_again(served, look):
    served.add("one", label="ONE")
    address = served.start()
    page = look("about:blank", drawn=False)
    page.route("**/api/model?*", lambda route: route.abort(), times=1)
    page.goto(address)
    page.wait_for_selector('g[data-path="/ONE/A"]')


def test_a_page_without_its_layout_worker_says_so_and_has_the_states_without_arrows(served, look):
    served.add("one", labels="AB")
    address = served.start()
    page = look("about:blank", drawn=False)
    page.route("**/elk-worker.js", lambda route: route.abort())
    page.goto(address)
    page.wait_for_selector("text=could not be laid out")
    page.click("g[data-path='/JOB/B']")
    assert page.evaluate("() => smachpy.store.view.selected.value") == "/JOB/B"


def test_what_the_server_answers_is_told_as_it_is(served, look):
    served.add("one")
    page = look(served.start())
    ask = "(address) => smachpy.ask(address)"
    gone = page.evaluate(ask, "/api/compare?machine=one&with=gone")
    assert gone["ok"] is False
    assert gone["text"] == "with: got 'gone'; expected one of /api/machines."
    page.route("**/api/compare?*", lambda route: route.fulfill(status=500, body="Internal"))
    assert "500 Internal Server Error: Internal" in page.evaluate(ask, "/api/compare?")["text"]
    page.route("**/api/compare?*", lambda route: route.abort())
    assert "does not answer" in page.evaluate(ask, "/api/compare?")["text"]


def test_a_clock_that_differs_is_known_before_anything_happens(served, look):
    served.began -= 3_600_000_000_000
    served.add("one", events=run()[:2]).behind = 3_600_000_000_000
    page = look(served.start())
    assert (
        page.evaluate("() => smachpy.store.playback.nowMs() - smachpy.store.data.run.last()")
        < 1_800_000
    )
    assert "min" not in page.text_content('g[data-path="/JOB/A"] .badge')


@pytest.mark.parametrize("hours", [-3, 3])
def test_clocks_that_differ_do_not_show_as_time_spent(served, look, hours):
    served.began += hours * 3_600_000_000_000
    machine = served.add("one", events=run()[:2])
    page = look(served.start())
    off = "Math.abs(smachpy.store.playback.nowMs() - smachpy.store.data.run.last())"
    if hours < 0:
        assert page.evaluate(f"() => {off}") > 3_000_000  # nothing has been heard yet
    deadline = time.monotonic() + 60.0
    seq = 2
    while page.evaluate(f"() => smachpy.store.data.robotLag.value === null || {off} > 60_000"):
        assert time.monotonic() < deadline
        since = (time.time_ns() - served.began) / 1e9 + hours * 3600
        done = [("Iterated", "/JOB/A", {"number": seq, "at": since})]
        machine.add(served.events(done, after=seq))
        seq += 1
        draw(page)
    wait_for(
        page, "smachpy.store.playback.nowMs() - smachpy.store.data.run.last() > 200"
    )  # it goes on


def test_a_machine_that_is_not_there_is_named_and_another_can_be_chosen(served, look):
    served.add("one", label="ONE")
    address = served.start()
    page = look(f"{address}?machine=gone", drawn=False)
    wait_for(page, "document.querySelector('.empty')?.textContent.includes('“gone”')")
    assert "gone" in page.text_content(".chooser select option:checked")
    page.click(".empty button:text-is('one')")
    page.wait_for_selector('g[data-path="/ONE/A"]')
    assert page.query_selector(".chooser") is None  # there is no other one
    page = look(f"{address}?machine=gone", drawn=False)
    page.wait_for_selector(".chooser select")
    page.select_option(".chooser select", "one")
    page.wait_for_selector('g[data-path="/ONE/A"]')
    page = look(f"{address}?machine=late", drawn=False)
    wait_for(page, "document.querySelector('.empty')?.textContent.includes('“late”')")
    served.add("late", label="LATE")
    page.wait_for_selector('g[data-path="/LATE/A"]')


ASKED = ("PreemptRequested", "/JOB/A", {"source": "operator", "by": "me", "why": "", "grace": 5.0})


def test_a_page_that_could_not_follow_says_so_and_keeps_the_preempt(served, look):
    machine = served.add("one", events=[*run()[:2], ASKED])
    page = look(served.start())
    page.wait_for_selector(".preempt-banner")
    assert page.query_selector(".gap") is None
    many = [("Iterated", "/JOB/A", {"number": n}) for n in range(3_100)]
    machine.add(served.events(many, after=3))
    wait_for(page, "document.querySelector('.gap')?.textContent.includes('3,100 events')")
    # Who asked, and who holds it up, is still known.
    page.wait_for_selector(".preempt-banner >> text=operator me")
    page.wait_for_selector(".waterfall button:text-is('A')")
    machine.add(served.events([("PreemptServiced", "/JOB/A")], after=3_103))
    wait_for(page, "document.querySelector('.waterfall').textContent.includes('cleaning up')")


def test_events_that_the_mission_had_to_drop_are_missed(served, look):
    machine = served.add("one", events=run()[:2])
    page = look(served.start())
    left = served.events(run()[4:], after=400)
    left[0]["dropped"] = 398
    if not machine.add(left):  # a server asks for the history then
        machine.reset(
            {
                "epoch": "x",
                "description": asdict(machine.record),
                "events": [*machine.events(), *left],
            }
        )
    wait_for(page, "document.querySelector('.gap')?.textContent.includes('398 events')")
    page.wait_for_selector(".log:has-text('398 events missing here')")
    wait_for(page, "smachpy.store.status.runStatus.value.word === 'ended: done'")


def test_a_saved_picture_has_the_colours_and_the_active_states_of_the_page(served, look):
    served.add("one", events=run()[:4])
    page = look(served.start(), color_scheme="dark")
    page.click(".menu > button")

    def link():
        return page.get_attribute(".sheet a:text-is('svg')", "href")

    assert "&theme=dark" in link()
    assert "&active=%2FJOB&active=%2FJOB%2FB" in link()
    page.evaluate("() => smachpy.page.setTheme('light')")
    wait_for(page, "document.querySelector('.sheet a').href.includes('&theme=light')")
    # Of the instant that is shown.
    page.evaluate("() => smachpy.store.playback.seekTo(2)")
    wait_for(page, "document.querySelector('.sheet a').href.endsWith('&active=%2FJOB%2FA')")
    with page.expect_download() as download:
        page.click(".sheet a:text-is('svg')")
    text = download.value.path().read_text()
    with urllib.request.urlopen(f"{served.address}api/picture?machine=one&active=1") as answer:
        assert text != answer.read().decode()


def test_the_saved_page_of_a_run_that_goes_on_says_that_it_ends_there(served, look, tmp_path):
    served.add("one", events=run()[:4], control={"paused": True, "breakpoints": []})
    with urllib.request.urlopen(f"{served.start()}api/export?machine=one&format=html") as answer:
        (tmp_path / "run.html").write_bytes(answer.read())
    page = look((tmp_path / "run.html").as_uri())
    assert page.text_content("[data-testid=status]") == "recording ends here"


def test_what_the_page_keeps_has_an_end(served, look):
    """The newest events can be wound back; what was before them counts on."""
    from smachpy.events.run_state import RunState

    page = look(served.start(), drawn=False)
    there = served.events(
        [
            ("Started", "/JOB"),
            *[
                event
                for _ in range(1_500)
                for event in [("Entered", "/JOB/A"), ("Left", "/JOB/A", {"outcome": "ok"})]
            ],
        ]
    )
    kept = page.evaluate(
        """(events) => {
          const run = new smachpy.store.data.run.constructor(null, []);
          let gone = 0;
          for (let i = 0; i < events.length; i += 10) {
            run.push(events.slice(i, i + 10));
            gone += run.trim(1000);
          }
          const { events: kept, spans, frames, open } = run;
          return { kept: kept.length, first: kept[0].seq, gone, spans: spans.length, frames: frames.length,
            open: [...open.keys()], began: run.first(), now: run.now, old: run.after(100), base: run.after(0) };
        }""",
        there,
    )
    assert 1000 <= kept["kept"] <= 1400
    assert kept["gone"] == len(there) - kept["kept"] == kept["first"] - 1
    assert kept["spans"] <= kept["kept"] / 2 + 2
    assert kept["frames"] <= 4
    assert kept["open"] == ["/JOB"]
    for count, mine in [(0, kept["base"]), (100, kept["old"]), (kept["kept"], kept["now"])]:
        state = RunState()
        for event in there[: kept["gone"] + count]:
            state.fold(event)
        for path in ("/JOB", "/JOB/A"):
            theirs = state.data["states"][path]
            for fact in ("visits", "outcome", "outcomes"):
                assert mine["states"][path][fact] == theirs[fact]
            assert (mine["states"][path]["since"] is None) == (theirs["since"] is None)


def test_looking_back_stays_where_it_is_while_older_events_are_forgotten(served, look):
    machine = served.add("one", events=run()[:2])
    page = look(served.start())
    page.evaluate(
        "() => { smachpy.store.data.settings.value = { ...smachpy.store.data.settings.value, kept: 1000 }; }"
    )
    pairs = [("Left", "/JOB/A", {"outcome": "ok"}), ("Entered", "/JOB/A")]
    seq = 2
    for turn in range(8):
        machine.add(served.events(pairs * 150, after=seq))
        seq += 300
        wait_for(page, f"smachpy.store.data.run.events.at(-1).seq === {seq}")
        if turn == 5:
            shown = page.evaluate(
                """() => { const { store } = smachpy; store.playback.seekTo(store.data.run.events.length - 11);
                  return store.playback.shown().states; }"""
            )
    assert page.evaluate("() => smachpy.store.data.run.events.length") < 1400
    assert page.evaluate("() => smachpy.store.playback.shown().states") == shown
    page.evaluate(
        "() => { smachpy.store.playback.seekEvent(-1); smachpy.store.playback.seekEvent(1); }"
    )
    assert page.evaluate("() => smachpy.store.playback.shown().states") == shown
    wait_for(page, "smachpy.page.scheduler.flashes.length === 0")


def test_what_comes_just_before_one_looks_back_does_not_flash_later(served, look):
    served.add("one", events=run()[:2])
    page = look(served.start())
    page.evaluate(
        """() => { const { page, store } = smachpy;
          const newest = store.data.run.events.at(-1);
          page.scheduler.takeEvents([{ ...newest, kind: "Left", outcome: "ok", seq: newest.seq + 1 }]);
          window.waiting = page.scheduler.flashes.length;
          store.playback.seekTo(1); }"""  # before the next frame
    )
    assert page.evaluate("() => window.waiting") == 1
    wait_for(page, "smachpy.page.scheduler.flashes.length === 0")


class Network:
    """The actions of a network, as `smachpy_viz.live.actions.Actions` tells them."""

    revision = 0

    def __init__(self):
        self.names, self.seen = [], set()

    def listen(self, on_change):
        self.on_change = on_change

    def summary(self):
        one = {"type": "a/B", "node": "n", "servers": 1}
        gone = sorted(self.seen - set(self.names))
        return {
            "actions": [{"name": name, **one} for name in self.names],
            "gone": gone,
            "goals": [],
        }

    def turn(self, *names):
        self.names = list(names)
        self.seen.update(names)
        self.revision += 1
        self.on_change()


def test_a_state_whose_goal_has_no_server_waits_and_does_not_run(served, look):
    network = Network()
    served.add("one", events=[*run()[:2], GOAL])
    page = look(served.start(actions=network))
    page.wait_for_selector('g.waiting[data-path="/JOB/A"]')
    label = page.get_attribute('g[data-path="/JOB/A"]', "aria-label")
    assert label == "/JOB/A, no server of drive seen"
    wait_for(page, "document.querySelector('.goal .pill-text').textContent === 'no server seen'")
    network.turn("drive")
    wait_for(page, "!document.querySelector('g.waiting')")
    assert page.get_attribute('g[data-path="/JOB/A"]', "aria-label") == "/JOB/A, running"
    wait_for(page, "document.querySelector('.goal .pill-text').textContent === 'active'")
    network.turn()  # gone again: nobody works on it
    page.wait_for_selector('g.waiting[data-path="/JOB/A"]')


def test_a_server_that_shows_itself_by_answers_only_is_not_missed(served, look):
    """As behind a bridge, which declares no servers."""
    answer = {"action": "drive", "goal_id": "1"}
    done = {**answer, "status": "SUCCEEDED", "text": "", "result": {}}
    again = [("GoalDone", "/JOB/A", done), ("GoalSent", "/JOB/A", {**GOAL[2], "goal_id": "2"})]
    network = Network()
    machine = served.add("one", events=[*run()[:2], GOAL])
    page = look(served.start(actions=network))
    page.wait_for_selector('g.waiting[data-path="/JOB/A"]')  # nobody has answered yet
    machine.add(served.events(again, after=3))
    wait_for(page, "!document.querySelector('g.waiting')")
    assert page.get_attribute('g[data-path="/JOB/A"]', "aria-label") == "/JOB/A, running"
    wait_for(page, "document.querySelector('.goal .pill-text').textContent === 'active'")
    network.turn("drive")
    network.turn()  # it did show one, and has gone: who answered then answers no more
    page.wait_for_selector('g.waiting[data-path="/JOB/A"]')


def test_without_a_look_at_the_network_no_server_is_missed(served, look):
    served.add("one", events=[*run()[:2], GOAL])
    page = look(served.start())
    page.wait_for_selector('g.active[data-path="/JOB/A"]')
    assert page.query_selector("g.waiting") is None


def test_lists_that_are_cut_say_so(served, look):
    written = [("UserdataWritten", "/JOB/A", {"key": f"k{n:03}", "value": n}) for n in range(70)]
    done = [("Left", "/JOB/A", {"outcome": "ok"}), ("Entered", "/JOB/B")]
    served.add("one", events=[*run()[:2], *written, *done])
    page = look(served.start())
    page.wait_for_selector(".userdata")
    assert len(page.query_selector_all(".userdata tr")) == 60
    page.click("button:text-is('and 10 more')")
    wait_for(page, "document.querySelectorAll('.userdata tr').length === 70")
    page.keyboard.press(",")
    page.keyboard.press(",")
    wait_for(page, "document.querySelectorAll('.diff').length === 8")
    page.click("button:text-is('and 62 more')")
    wait_for(page, "document.querySelectorAll('.diff').length === 70")


def test_a_log_that_is_cut_goes_further_back_when_it_is_asked_to(served, look):
    turn = [("Left", "/JOB/A", {"outcome": "ok"}), ("Entered", "/JOB/A")]
    events = [event for _ in range(3_100) for event in turn]
    served.add("one", events=[*run()[:2], *events])
    page = look(served.start())
    wait_for(page, "document.querySelectorAll('.log li').length === 70")
    page.fill("[aria-label='filter the log']", "started")
    wait_for(page, "document.querySelectorAll('.log li').length === 0")
    assert "last 6,000 of 6,202 events" in page.text_content(".log ~ button")
    page.click(".log ~ button")
    wait_for(page, "document.querySelectorAll('.log li').length === 1")
    assert page.query_selector(".log ~ button") is None
    page.fill("[aria-label='filter the log']", "")
    wait_for(page, "document.querySelectorAll('.log li').length === 140")
    page.press("button:text-is('older')", "Enter")
    wait_for(page, "document.querySelectorAll('.log li').length === 210")


def test_the_arrows_of_the_search_stay_on_what_it_shows(served, look):
    from smachpy.events.introspection import StateRecord

    leaves = tuple(
        StateRecord(f"/JOB/STEP_{n:02}", f"STEP_{n:02}", "state", "State", ("done",))
        for n in range(20)
    )
    root = StateRecord("/JOB", "JOB", "machine", "StateMachine", ("done",), children=leaves)
    served.add("one").describe(root)
    page = look(served.start())
    wait_for(page, "smachpy.store.data.model.value.order.length === 21")
    page.fill("#search", "step")
    assert "and 8 more" in page.text_content(".results")
    for _ in range(16):
        page.press("#search", "ArrowDown")
    assert page.text_content(".results .at b") == "STEP_11"
    page.press("#search", "Enter")
    assert page.evaluate("() => smachpy.store.view.selected.value") == "/JOB/STEP_11"


def test_breakpoints_after_an_outcome_and_a_pause_that_stops_what_runs(served, look):
    machine = served.add("one", events=run()[:2], control={"paused": False, "breakpoints": []})
    page = look(f"{served.start(token='t')}#token=t")
    wait_for(page, "document.querySelector('#pause')")
    page.evaluate("() => smachpy.page.select('/JOB/A')")
    page.click("[aria-label='breakpoint after ok']")
    page.wait_for_selector(".notice")
    assert {"command": "break", "path": "/JOB/A", "outcome": "ok"}.items() <= served.commands[
        -1
    ].items()
    machine.set_control({"paused": False, "breakpoints": [["/JOB/A", "ok"]]})
    page.wait_for_selector("[aria-label='breakpoint after ok'][aria-pressed=true]")
    page.wait_for_selector('g.stopped-after[data-path="/JOB/A"]')
    assert page.text_content(".actions button").strip() == "Breakpoint"  # before it there is none
    page.click("[aria-label='breakpoint after ok']")
    wait_for(page, "document.querySelector('.notice')?.textContent.includes('unbreak')")
    assert {"command": "unbreak", "path": "/JOB/A", "outcome": "ok"}.items() <= served.commands[
        -1
    ].items()
    page.click("#pause-now")
    assert len(served.commands) == 2  # it asks first
    page.click(".confirm .warn")
    wait_for(page, "document.querySelector('.notice')?.textContent.includes('pause')")
    assert {"command": "pause", "running": "cancel"}.items() <= served.commands[-1].items()


def test_who_pauses_elsewhere_is_seen_here(served, look):
    machine = served.add("one", events=run()[:2], control={"paused": False, "breakpoints": []})
    page = look(f"{served.start(token='t')}#token=t")
    page.wait_for_selector("#pause:text-is('Pause')")
    machine.set_control({"paused": True, "breakpoints": [["/JOB/B", None]]})
    page.wait_for_selector("#pause:text-is('Resume')")
    assert page.is_enabled("#step")
    assert page.text_content("[data-testid=status]") == "paused"
    page.wait_for_selector('g.stopped[data-path="/JOB/B"]')
    page.evaluate("() => document.activeElement.blur()")
    page.keyboard.press("Space")
    page.wait_for_selector(".notice")
    assert served.commands[-1]["command"] == "resume"


def test_half_a_character_in_a_name_breaks_nothing(served, look):
    served.add(
        "one", labels=["A\ud800", "B"], events=[("Started", "/JOB"), ("Entered", "/JOB/A\ud800")]
    )
    page = look(served.start())
    wait_for(page, "smachpy.store.status.activeLeaves.value.length === 1")
    page.click(".menu > button")
    page.wait_for_selector(".sheet a:text-is('svg')")
    with page.expect_download():
        page.click(".sheet a:text-is('svg')")
    with page.expect_download():
        page.click(".sheet a:text-is('recording')")


def test_recorded_runs_that_cannot_be_read_are_told(served, look):
    from smachpy.exceptions import SmachError

    def statistics(_record):
        raise SmachError("runs/x.jsonl: no recording")

    served.add("one")
    page = look(served.start(statistics=statistics))
    wait_for(page, "document.querySelector('.notice.error')?.textContent.includes('no recording')")
