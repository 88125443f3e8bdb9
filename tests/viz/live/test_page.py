"""The page in a real browser, against real missions in other processes."""

from __future__ import annotations

import json
import os
import signal
import socket
import time
import urllib.error
import urllib.parse
import urllib.request

import pytest

from tests.browser import draw, hear, wait_for

pytestmark = [pytest.mark.browser, pytest.mark.zenoh]


@pytest.fixture
def no_leaks():
    """Processes of this module's fixtures outlive single tests."""


def active(page):
    return page.evaluate("() => smachpy.store.status.activeLeaves.value")


def group(path):
    return f'g[data-path="{path}"]'


def test_states_light_up_where_the_mission_is(delivery, shared):
    page = shared()
    page.evaluate(
        """() => { const svg = document.querySelector('.diagram'); window.seen = new Set();
        new MutationObserver(() => {
          for (const g of svg.querySelectorAll('g.leaf.active')) seen.add(g.dataset.path); })
        .observe(svg, { subtree: true, attributeFilter: ['class'] }); }"""
    )
    wait_for(page, "seen.size >= 5")
    assert page.text_content("[data-testid=status]") == "running"
    assert page.foreign == []


def test_a_concurrence_shows_all_its_active_regions(delivery, shared):
    page = shared()
    wait_for(
        page,
        "['NAVIGATE', 'WATCH'].every((l) => document.querySelector("
        '`g.active[data-path="/DELIVER/TRANSPORT/${l}"]`))',
    )


def test_collapse_expand_and_depth_without_moving_the_rest(delivery, shared):
    page = shared()
    before = page.evaluate("() => ({...smachpy.page.view, svg: 0, world: 0}).k")
    page.dblclick(group("/DELIVER/PICK") + " > text.title", force=True)
    page.evaluate("() => smachpy.page.layouts.running")
    wait_for(page, "!document.querySelector('g[data-path=\"/DELIVER/PICK/GRASP\"]')")
    assert page.evaluate("() => smachpy.page.view.k") == before
    page.evaluate("() => smachpy.page.layouts.setDepth(9)")
    wait_for(page, "document.querySelector('g[data-path=\"/DELIVER/PICK/GRASP\"]')")
    page.keyboard.press("1")
    wait_for(page, "!document.querySelector('g[data-path=\"/DELIVER/PICK/GRASP\"]')")


def test_search_reveals_a_hidden_state(delivery, shared):
    page = shared()
    page.keyboard.press("1")
    wait_for(page, "!document.querySelector('g[data-path=\"/DELIVER/PICK/GRASP\"]')")
    page.keyboard.press("/")
    page.keyboard.type("gras")
    page.keyboard.press("Enter")
    wait_for(page, "document.querySelector('g.selected[data-path=\"/DELIVER/PICK/GRASP\"]')")
    assert "GRASP" in page.text_content(".inspector h2")
    page.keyboard.press("Escape")
    wait_for(page, "!document.querySelector('.selected[data-path]')")


def test_follow_opens_what_runs_and_keeps_it_legible(delivery, shared):
    page = shared()
    page.keyboard.press("1")
    page.keyboard.press("o")
    wait_for(
        page, "[...document.querySelectorAll('g.leaf[data-path^=\"/DELIVER/PICK/\"]')].length > 0"
    )
    wait_for(page, "smachpy.page.view.k * 11 >= 9.0")


def test_events_never_move_the_view(delivery, shared):
    page = shared()
    before = page.evaluate("() => smachpy.page.view.k")
    page.mouse.move(600, 400)
    page.mouse.wheel(0, -400)
    wait_for(page, f"smachpy.page.view.k !== {before}")  # it does not wait itself
    view = page.evaluate("() => [smachpy.page.view.x, smachpy.page.view.y, smachpy.page.view.k]")
    hear(page, 8)
    draw(page)
    assert (
        page.evaluate("() => [smachpy.page.view.x, smachpy.page.view.y, smachpy.page.view.k]")
        == view
    )


def test_time_travel_shows_graph_goals_and_userdata_of_one_instant(delivery, shared):
    page = shared()
    wait_for(page, "smachpy.store.data.run.events.length > 60")
    found = page.evaluate("""() => {
      const { store } = smachpy, run = store.data.run;
      const i = run.events.findIndex((e, n) => n > 20 && e.kind === "Left");
      store.playback.seek(run.events[i].stamp_ns / 1e6);
      const path = run.events[i].path;
      return { path, out: store.playback.shown().states[path].outcome,
        wrote: Object.values(store.playback.shown().userdata).map((u) => u.writer) };
    }""")
    assert found["out"] == "succeeded"
    assert found["wrote"]
    assert page.text_content("[data-testid=status]") == "replay"
    frozen = active(page)
    hear(page, 8)
    draw(page)
    assert active(page) == frozen
    page.keyboard.press("l")
    wait_for(page, "smachpy.store.playback.cursor.value === null")


def test_the_page_folds_events_as_the_server_does(delivery, shared):
    from smachpy.events.run_state import RunState

    page = shared()
    wait_for(page, "smachpy.store.data.run.events.length > 40")
    mine, theirs, base = page.evaluate(
        "() => [smachpy.store.data.run.after(40), smachpy.store.data.run.events.slice(0, 40), JSON.parse(smachpy.store.data.run.base)]"
    )
    state = RunState(base)
    for event in theirs:
        state.fold(event)
    for path, facts in state.data["states"].items():
        for key in ("visits", "outcome", "outcomes", "since", "preempt", "asked", "serviced"):
            assert mine["states"][path].get(key) == facts.get(key), (path, key)
    assert mine["run"] == state.data["run"]
    assert {k: v["writer"] for k, v in mine["userdata"].items()} == {
        k: v["writer"] for k, v in state.data["userdata"].items()
    }


def test_control_with_the_token(delivery, look):
    page = look(delivery.address.replace("/#", "/?machine=delivery#"))
    assert "token" not in page.url
    page.click("#pause")
    wait_for(page, "smachpy.store.data.facts.value.control.paused")
    wait_for(page, "document.querySelector('g.waiting')")
    held = page.evaluate("() => document.querySelector('g.waiting').dataset.path")
    page.click("#step")
    wait_for(page, f"document.querySelector('g.waiting')?.dataset.path !== {json.dumps(held)}")
    page.click("#pause")
    wait_for(page, "!smachpy.store.data.facts.value.control.paused")
    page.evaluate("() => smachpy.page.goTo('/DELIVER/PLACE')")
    page.click("text=Breakpoint")
    wait_for(page, "document.querySelector('g.stopped[data-path=\"/DELIVER/PLACE\"]')")
    wait_for(page, "document.querySelector('g.waiting[data-path=\"/DELIVER/PLACE\"]')")
    page.click("text=Remove breakpoint")
    page.click("#pause")
    wait_for(page, "!document.querySelector('g.waiting')")


def test_who_pauses_at_another_viewer_is_seen_here(start, look):
    start.robot("--name", "shared", "--rate", 10, "--control")
    view, other = start.view("--control"), start.view("--control")
    page = look(view.address.replace("/#", "/?machine=shared#"))
    there = look(other.address.replace("/#", "/?machine=shared#"))
    page.wait_for_selector("#pause:text-is('Pause')")
    there.click("#pause")
    page.wait_for_selector("#pause:text-is('Resume')")
    wait_for(page, "smachpy.store.status.runStatus.value.word.startsWith('paused')")
    # Until it says Resume, a click there is a second Pause.
    there.click("#pause:text-is('Resume')")
    page.wait_for_selector("#pause:text-is('Pause')")
    # A machine that stands at a breakpoint is paused, though nobody has said so.
    there.evaluate("() => smachpy.page.goTo('/DELIVER/PLACE')")
    there.click("text=Breakpoint")
    for one in (page, there):
        one.wait_for_selector("#pause:text-is('Resume')")
        one.wait_for_selector('g.waiting.stopped[data-path="/DELIVER/PLACE"]')


def test_without_the_token_there_is_nothing_to_press(delivery, shared):
    page = shared()
    assert page.query_selector("#pause") is None
    ask = """(headers) => fetch('/api/control?machine=delivery', {method: 'POST', headers,
        body: JSON.stringify({command: 'pause'})}).then(async (a) => [a.status, await a.text()])"""
    assert page.evaluate(ask, {})[0] == 403
    status, text = page.evaluate(ask, {"x-smachpy-token": "guess"})
    assert status == 403
    assert "token" in text


def test_a_robot_that_dies_is_stale_and_one_that_comes_back_is_not(delivery, start, look):
    robot = start.robot("--name", "mortal", "--rate", 4)
    page = look(delivery.base + "?machine=mortal")
    robot.kill()
    wait_for(page, "smachpy.store.status.runStatus.value.word === 'stale'")
    assert "Stale" in page.text_content(".banner")
    start.robot("--name", "mortal", "--rate", 4)
    wait_for(page, "smachpy.store.status.runStatus.value.word === 'running'")
    wait_for(page, "smachpy.store.status.activeLeaves.value.length")  # a state is entered soon


def test_a_suspended_robot_is_stale_refuses_commands_in_time_and_goes_on(delivery, start, look):
    """A debugger, a laptop's lid, SIGSTOP: its token stays until the link is given up."""
    robot = start.robot("--name", "asleep", "--rate", 4, "--control")
    page = look(delivery.address.replace("/#", "/?machine=asleep#"))
    page.wait_for_selector("#pause:enabled")
    os.kill(robot.pid, signal.SIGSTOP)
    page.click("#pause")
    page.wait_for_selector(".notice.error")  # it did not answer
    wait_for(page, "smachpy.store.status.runStatus.value.word === 'stale'")
    os.kill(robot.pid, signal.SIGCONT)
    wait_for(page, "['running', 'paused'].includes(smachpy.store.status.runStatus.value.word)")


def test_a_viewer_that_is_restarted_is_found_again_with_the_whole_history(start, look):
    start.robot("--name", "steady", "--rate", 8)
    view = start.view()
    page = look(view.base + "?machine=steady")
    wait_for(page, "smachpy.store.data.run.events.length > 30")
    first = page.evaluate("() => smachpy.store.data.run.events[0].stamp_ns")
    view.kill()
    wait_for(page, "smachpy.store.data.connection.value === 'lost'")
    start.view(port=view.port)
    wait_for(page, "smachpy.store.data.connection.value === 'live'")
    wait_for(page, "smachpy.store.status.runStatus.value.word === 'running'")
    assert page.evaluate("() => smachpy.store.data.run.events[0].stamp_ns") == first


def test_hostile_names_and_values_are_harmless(delivery, start, look):
    start.robot("--name", "hostile", "--rate", 5, "--hostile")
    page = look(delivery.base + "?machine=hostile")
    wait_for(page, "Object.keys(smachpy.store.data.run.now.userdata).length >= 4")
    for part in ("its repr raised RuntimeError", "<list of 100000 elements>", "lock"):
        wait_for(page, f"document.querySelector('.userdata')?.textContent.includes('{part}')")
    assert page.title().startswith("HOSTILE")
    assert page.evaluate("() => document.querySelectorAll('img, .diagram script').length") == 0


def test_ten_clients_at_once_hear_the_same(delivery, shared):
    page = shared()
    streams = [
        urllib.request.urlopen(f"{delivery.base}api/events?machine=delivery", timeout=60)
        for _ in range(9)
    ]
    last = page.evaluate("() => smachpy.store.data.run.events.at(-1).seq")
    wait_for(page, f"smachpy.store.data.run.events.at(-1).seq > {last + 4}")
    for stream in streams:
        numbers = []
        while not numbers or numbers[-1] <= last + 4:
            line = stream.readline().decode()
            if line.startswith("id: "):
                numbers.append(int(urllib.parse.unquote(line).rpartition(":")[2]))
        assert numbers == sorted(numbers)
        stream.close()


def test_a_preempt_is_a_process_one_can_watch(delivery, start, look):
    robot = start.robot("--name", "slow", "--rate", 20, "--control", "--hold")
    page = look(delivery.address.replace("/#", "/?machine=slow#"))
    watch, navigate = "/DELIVER/TRANSPORT/WATCH", "/DELIVER/TRANSPORT/NAVIGATE"
    wait_for(page, f"document.querySelector('g.active[data-path=\"{watch}\"]')")
    page.click("#preempt")
    page.click(".confirm .warn")
    wait_for(page, f"document.querySelector('g.preempting[data-path=\"{watch}\"]')")
    # Who asked, who has serviced it, who holds it up: on the picture, in words, in the log.
    wait_for(page, f"document.querySelector('g.serviced[data-path=\"{navigate}\"]')")
    assert page.query_selector(f'g.serviced[data-path="{watch}"]') is None
    said = "operator page at 127.0.0.1: preempt /DELIVER"
    for part in (said, "WATCH", "of 10 min 00"):
        page.wait_for_selector(f".preempt-banner:has-text('{part}')")
    wait_for(page, "document.querySelectorAll('.waterfall > div').length === 4")
    for part in (said, "\u2713 cleaning up"):
        page.wait_for_selector(f".preempt:has-text('{part}')")
    for part in ("asked to stop by operator", "preempt serviced"):
        page.wait_for_selector(f".log:has-text('{part}')")
    assert "cleaning up" in page.get_attribute(group(navigate), "aria-label")
    robot.tell("NAVIGATE")
    wait_for(page, f"!document.querySelector('g.active[data-path=\"{navigate}\"]')")
    robot.tell("WATCH")
    wait_for(page, "smachpy.store.status.runStatus.value.word === 'ended: preempted'")
    wait_for(page, "document.querySelector('.preempt').textContent.includes('longest: WATCH')")
    # The same at an earlier instant, and in the file that can be mailed.
    when = page.evaluate("""() => { const { store } = smachpy;
        const { from, rows } = store.data.run.preempts[0];
        const t = (from + Math.max(...rows.map((row) => row.to))) / 2; store.playback.seek(t); return t; }""")
    wait_for(page, "document.querySelector('.preempt')?.textContent.includes('held up by')")
    exported = delivery.get("/api/export?machine=slow&format=html")[2]
    page = look("about:blank", drawn=False)
    page.set_content(exported.decode())
    page.wait_for_selector("html[data-drawn]")
    page.evaluate(f"() => smachpy.store.playback.seek({when})")
    wait_for(page, "document.querySelector('.preempt')?.textContent.includes('held up by')")


def test_a_run_opens_as_one_file_without_a_server(delivery, start, look, tmp_path):
    start.robot("--name", "mailed", "--rate", 10)
    page = look(delivery.base + "?machine=mailed")
    wait_for(page, "smachpy.store.data.run.events.length > 60")
    _, _, text = delivery.get("/api/export?machine=mailed&format=html")
    file = tmp_path / "run.html"
    file.write_bytes(text)
    page = look(file.as_uri())
    assert page.evaluate("() => smachpy.store.data.run.events.length") > 60
    assert page.query_selector(group("/DELIVER/PICK/GRASP")) is not None
    page.keyboard.press(",")
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is not None
    assert page.foreign == []


def test_dark_small_and_by_keyboard_alone(delivery, look):
    page = look(delivery.base + "?machine=delivery", color_scheme="dark")
    assert (
        page.evaluate("() => getComputedStyle(document.body).backgroundColor") == "rgb(15, 23, 32)"
    )
    page.keyboard.press("d")
    wait_for(page, "getComputedStyle(document.body).backgroundColor === 'rgb(255, 255, 255)'")
    page.evaluate("() => smachpy.page.select('/DELIVER/INIT')")
    page.keyboard.press("ArrowDown")
    assert page.evaluate("() => smachpy.store.view.selected.value") != "/DELIVER/INIT"
    k = page.evaluate("() => smachpy.page.view.k")
    page.keyboard.press("+")
    assert page.evaluate("() => smachpy.page.view.k") > k
    page.keyboard.press("?")
    page.wait_for_selector("dialog[open]")
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    label = page.get_attribute(group("/DELIVER/INIT"), "aria-label")
    assert label.startswith("/DELIVER/INIT, ")
    page.set_viewport_size({"width": 600, "height": 800})
    draw(page)
    assert page.is_visible(".diagram")


def test_who_stops_reading_holds_up_nobody(delivery, shared):
    deaf = socket.create_connection(("127.0.0.1", delivery.port))
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
    deaf.sendall(b"GET /api/events?machine=delivery HTTP/1.1\r\nHost: localhost\r\n\r\n")
    page = shared()
    seq = page.evaluate("() => smachpy.store.data.run.events.at(-1).seq")
    wait_for(page, f"smachpy.store.data.run.events.at(-1).seq > {seq + 20}")
    deaf.close()


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Host": "evil.example:80"}, 421),
        ({"Host": "localhost"}, 200),
    ],
)
def test_foreign_host_names_are_refused(delivery, headers, status):
    try:
        got = delivery.get("/api/machines", **headers)[0]
    except urllib.error.HTTPError as error:
        got = error.code
    assert got == status


def test_a_policy_that_lets_nothing_in_from_elsewhere(delivery):
    _, headers, _ = delivery.get("/")
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert headers["x-content-type-options"] == "nosniff"


def test_a_viewer_that_hangs_or_dies_holds_up_no_mission(start):
    start.robot("--name", "busy", "--rate", 50)
    views = [start.view(), start.view(), start.view()]

    def wait_for_more(count):
        """Wait until the mission has left that many further states."""

        def left():
            return views[0].get("/api/export?machine=busy&format=jsonl")[2].count(b'"Left"')

        until = left() + count
        deadline = time.monotonic() + 60.0
        while left() < until:
            assert time.monotonic() < deadline

    deadline = time.monotonic() + 60.0
    while views[0].get("/api/machines")[2] == b"[]":
        assert time.monotonic() < deadline
    wait_for_more(10)
    os.kill(views[1].pid, signal.SIGSTOP)
    try:
        views[2].kill()
        wait_for_more(200)
    finally:
        os.kill(views[1].pid, signal.SIGCONT)


def test_two_machines_of_one_name_are_two_machines(start, look):
    first = start.robot("--name", "twin", "--rate", 4, "--control")
    view = start.view("--control")
    page = look(view.address.replace("/#", "/?machine=twin#"))
    start.robot("--name", "twin", "--rate", 4, "--states", 12, "--control")
    wait_for(page, "smachpy.store.data.machines.value.some((m) => m.name === 'twin (2)')")
    twins = "smachpy.store.data.machines.value.filter((m) => m.name.startsWith('twin') && !m.after)"
    labels = page.evaluate(f"() => {twins}.map((m) => [m.name, m.label])")
    assert labels == [["twin", "DELIVER"], ["twin (2)", "FACTORY_12"]]
    hear(page, 10)
    # Nothing of the one is in the other.
    paths = "[...new Set(smachpy.store.data.run.events.map((e) => e.path.split('/')[1]))]"
    assert page.evaluate(f"() => {paths}") == ["DELIVER"]
    other = look(view.base + "?machine=twin%20(2)")
    wait_for(other, "smachpy.store.data.run.events.length > 5")
    assert other.evaluate(f"() => {paths}") == ["FACTORY_12"]
    # A command would reach both, so it reaches none.
    page.click("#pause")
    page.wait_for_selector(".notice.error")
    assert "got 2 machines with the name 'twin'" in page.text_content(".notice")
    # The one goes, the other stays; a new one takes the place of the one that has gone.
    first.kill()
    wait_for(page, "smachpy.store.status.runStatus.value.word === 'stale'")
    wait_for(other, "smachpy.store.status.runStatus.value.word === 'running'")
    start.robot("--name", "twin", "--rate", 4)
    wait_for(page, "smachpy.store.status.runStatus.value.word === 'running'")
    assert page.evaluate(f"() => {twins}.length") == 2


def test_a_value_that_was_shortened_is_fetched_whole_from_the_mission(delivery, start, look):
    start.robot("--name", "hoarder", "--rate", 5, "--hostile")
    page = look(delivery.base + "?machine=hoarder")
    wait_for(
        page, "Object.values(smachpy.store.data.run.now.userdata).some((u) => u.key === 'big')"
    )
    page.click(".userdata tr:has(th button:text-is('big'))")
    page.press(".whole", "Enter")  # a click misses a button that moves as the page is drawn anew
    answer = "document.querySelector('.whole-value')?.innerText ?? ''"
    wait_for(page, f"!/^(Asking.*)?$/.test({answer})")
    assert not page.query_selector(".whole-value .error"), page.inner_text(".whole-value")
    text = page.input_value(".whole-value textarea")
    assert text.startswith("[0,")
    assert text.endswith("99999]")
    page.click(".userdata tr:has(th button:text-is('markup'))")  # nothing is missing here
    assert page.query_selector(".whole") is None
    status, _, body = delivery.get("/api/value?machine=hoarder&container=/HOSTILE&key=markup")
    assert (status, json.loads(body)["text"]) == (200, "<script>document.title='broken'</script>")
    for query, why in [
        ("container=/HOSTILE&key=nothing", "'nothing' is not there any more"),
        ("container=/HOSTILE/nowhere&key=big", "no such container"),
        ("container=/HOSTILE&key=mute", "its repr raised RuntimeError"),
    ]:
        with pytest.raises(urllib.error.HTTPError) as caught:
            delivery.get(f"/api/value?machine=hoarder&{query}")
        assert caught.value.code == 409
        assert why in json.loads(caught.value.read())["text"]


def test_follow_shows_all_regions_that_are_active(delivery, start, look):
    start.robot("--name", "regions", "--rate", 4, "--hold")
    page = look(delivery.base + "?machine=regions")
    page.keyboard.press("1")
    page.keyboard.press("o")
    wait_for(
        page,
        "['NAVIGATE', 'WATCH'].every((l) => document.querySelector("
        '`g.active[data-path="/DELIVER/TRANSPORT/${l}"]`))',
    )
    wait_for(page, "smachpy.store.status.activeLeaves.value.length === 2")
    page.wait_for_selector(".crumbs:has-text('+1 active')")
    inside = """(label) => { const box = document.querySelector(`g[data-path="/DELIVER/TRANSPORT/${label}"]`)
        ?.getBoundingClientRect(), stage = document.querySelector('.diagram').getBoundingClientRect();
        return box?.left >= stage.left && box.right <= stage.right && box.top >= stage.top
            && box.bottom <= stage.bottom; }"""
    wait_for(page, f"['NAVIGATE', 'WATCH'].every({inside})")
    # What does not run any more is folded again.
    wait_for(page, "!document.querySelector('g[data-path=\"/DELIVER/PICK/GRASP\"]')")


def test_every_key_does_what_the_help_says(delivery, look):
    page = look(delivery.base + "?machine=delivery")
    view = "() => { const { x, y, k } = smachpy.page.view; return [x, y, k]; }"
    page.keyboard.press("Escape")
    x, y, k = page.evaluate(view)
    for key, moves in [
        ("ArrowLeft", (80, 0)), ("ArrowRight", (-80, 0)), ("ArrowUp", (0, 80)), ("ArrowDown", (0, -80)),
    ]:  # fmt: skip
        page.keyboard.press(key)
        x, y = x + moves[0], y + moves[1]
        assert page.evaluate(view) == pytest.approx([x, y, k])
    page.keyboard.press("+")
    assert page.evaluate(view)[2] == pytest.approx(k * 1.25)
    page.keyboard.press("-")
    page.keyboard.press("-")
    assert page.evaluate(view)[2] == pytest.approx(k * 0.8)
    page.keyboard.press("0")
    wait_for(page, f"Math.abs(smachpy.page.view.k - {k}) < 0.01")
    page.keyboard.press("/")
    assert page.evaluate("() => document.activeElement.id") == "search"
    page.keyboard.type("f+1,")  # only text here
    assert page.input_value("#search") == "f+1,"
    page.keyboard.press("Escape")
    assert page.evaluate("() => document.activeElement.tagName") == "BODY"
    # Neighbours, and the same state again.
    page.evaluate("() => smachpy.page.select('/DELIVER/PICK')")
    page.keyboard.press("Enter")
    wait_for(page, "!document.querySelector('g[data-path=\"/DELIVER/PICK/GRASP\"]')")
    page.keyboard.press("Enter")
    wait_for(page, "document.querySelector('g[data-path=\"/DELIVER/PICK/GRASP\"]')")
    page.keyboard.press("Shift+ArrowLeft")  # moves the view though something is selected
    assert page.evaluate("() => smachpy.store.view.selected.value") == "/DELIVER/PICK"
    page.keyboard.press("Escape")
    assert page.evaluate("() => smachpy.store.view.selected.value") is None
    before = page.evaluate("() => smachpy.store.view.implicit.value")
    page.keyboard.press("i")
    assert page.evaluate("() => smachpy.store.view.implicit.value") != before
    page.keyboard.press("i")
    wait_for(page, "smachpy.store.data.run.events.length > 5")
    page.keyboard.press(",")
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is not None
    page.keyboard.press("l")
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is None
    page.keyboard.press("o")
    assert page.evaluate("() => smachpy.store.view.follow.value") is True
    page.keyboard.press("o")
    page.keyboard.press("?")
    listed = page.text_content("dialog[open]")
    for word in ("search", "fit everything", "follow the running states", "zoom", "actions"):
        assert word in listed
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")


def test_who_cannot_see_is_told(delivery, look):
    page = look(delivery.base + "?machine=delivery")
    wait_for(page, "document.querySelector('g.leaf.active')")
    unnamed = page.evaluate("""() => [
      ...document.querySelectorAll('button, input, select, [role=button], [role=slider], svg[role]')]
        .filter((e) => e.getClientRects().length)
        .filter((e) => !(e.getAttribute('aria-label') || e.labels?.length || e.textContent.trim() || e.title))
        .map((e) => e.outerHTML.slice(0, 200))""")
    assert unnamed == []
    # Every state says its path and what it does.
    wrong = page.evaluate("""() => [...document.querySelectorAll('.diagram g[data-path]')]
        .filter((g) => !g.getAttribute('aria-label').startsWith(`${g.dataset.path}, `)).length""")
    assert wrong == 0
    wait_for(
        page,
        "document.querySelector('g.leaf.active')?.getAttribute('aria-label').endsWith(', running')",
    )
    # What happens is spoken, at most once a second.
    wait_for(page, "document.getElementById('announced').textContent.startsWith('running: ')")
    page.evaluate("""() => { window.spoken = 0; window.moment = performance.now() + 1000;
        new MutationObserver(() => { spoken += 1; })
        .observe(document.getElementById('announced'), {childList: true, characterData: true, subtree: true});
        performance.now = () => moment; }""")
    for count in (1, 2):
        wait_for(page, f"spoken === {count}")
        hear(page, 8)
        draw(page)
        assert page.evaluate("() => spoken") == count
        page.evaluate("() => { moment += 1000; }")
    tree = page.evaluate("""() => [...document.querySelectorAll('[role=treeitem]')].map((e) =>
        [e.getAttribute('aria-level'), e.getAttribute('aria-selected')])""")
    assert tree
    assert all(level and selected in {"true", "false"} for level, selected in tree)
    for label in ("states", "details", "state machine"):
        assert page.query_selector(f'[aria-label="{label}"]') is not None


def test_at_first_no_more_is_open_than_can_be_read_and_a_new_size_shows_all_again(
    delivery, start, look
):
    start.robot("--name", "wide", "--rate", 2, "--states", 60)
    page = look(delivery.base + "?machine=wide")
    wait_for(page, "smachpy.page.layouts.running === null")
    assert page.evaluate("() => smachpy.page.view.k") >= 0.55
    assert page.evaluate("() => smachpy.store.view.opened.value.size") < 5
    whole = """() => { const { view, diagram } = smachpy.page, s = diagram.size;
        return view.x >= 0 && view.y >= 0 && view.x + s.w * view.k <= view.width
            && view.y + s.h * view.k <= view.height; }"""
    page.set_viewport_size({"width": 800, "height": 600})
    wait_for(page, f"({whole})() && smachpy.page.layouts.running === null")
    fitted = page.evaluate("() => smachpy.page.view.k")
    page.mouse.move(300, 200)
    page.mouse.wheel(0, -300)  # who has looked closer keeps what they look at
    wait_for(page, f"smachpy.page.view.k !== {fitted}")
    k = page.evaluate("() => smachpy.page.view.k")
    page.set_viewport_size({"width": 1200, "height": 800})
    wait_for(page, "innerWidth === 1200")
    draw(page)
    assert page.evaluate("() => smachpy.page.view.k") == k
