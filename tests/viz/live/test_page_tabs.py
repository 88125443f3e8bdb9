"""Many tabs of one viewer: they share one stream, and all of them work."""

from __future__ import annotations

import pytest

from tests.browser import wait_for

pytestmark = pytest.mark.browser

FREE = {"paused": False, "breakpoints": []}
ENTERED = ("Entered", "/JOB/B")


def machines(served, count):
    for n in range(count):
        events = [("Started", "/JOB"), ("Entered", "/JOB/A")]
        served.add(f"robot_{n}/job", events=events, control=FREE)
    return served.start(token="t")


def has_events(page, count):
    wait_for(page, f"smachpy.store.data.run.events.length === {count}")


@pytest.mark.timeout(600)
def test_more_tabs_of_one_browser_than_it_has_connections_work(served, look):
    # Chromium keeps six connections to a host: streams of their own would use them up.
    address = machines(served, 4)
    first = look(f"{address}?machine=robot_0/job#token=t")
    tabs = [first]
    for n in range(1, 7):
        tab = first.context.new_page()
        tab.goto(f"{address}?machine=robot_{n % 4}/job#token=t")
        tabs.append(tab)
    for tab in tabs:
        tab.wait_for_selector("html[data-drawn]")
    for n in range(4):
        served.machines.get(f"robot_{n}/job").add(served.events([ENTERED], after=2))
    for tab in tabs:
        has_events(tab, 3)
        wait_for(tab, "smachpy.store.data.connection.value === 'live'")
    tabs[-1].click("#pause")
    tabs[-1].wait_for_selector(".notice.info")
    assert [one["command"] for one in served.commands] == ["pause"]
    streams_open = first.evaluate(
        "() => performance.getEntriesByType('resource').filter((one) => one.name.includes('events')).length"
    )
    assert streams_open == 0  # they are those of the shared worker


def test_a_second_tab_of_a_machine_moves_nothing_in_the_first(served, look):
    address = machines(served, 1)
    first = look(address)
    first.keyboard.press(",")
    before = first.evaluate("() => smachpy.store.playback.cursor.value")
    assert before is not None
    second = first.context.new_page()
    second.goto(address)
    second.wait_for_selector("html[data-drawn]")
    served.machines.get("robot_0/job").add(served.events([ENTERED], after=2))
    for tab in (first, second):
        has_events(tab, 3)
    assert first.evaluate("() => smachpy.store.playback.cursor.value") == before


HIDE = """(hidden) => {
    Object.defineProperty(document, "hidden", { configurable: true, value: hidden });
    document.dispatchEvent(new Event("visibilitychange"));
}"""


@pytest.mark.parametrize("shared", [True, False])
def test_a_hidden_tab_has_no_stream_and_goes_on_where_it_was(served, look, shared):
    address = machines(served, 1)
    page = look("about:blank", drawn=False)
    if not shared:
        page.add_init_script("delete window.SharedWorker")
    page.goto(address)
    page.wait_for_selector("html[data-drawn]")
    page.evaluate(HIDE, True)
    machine = served.machines.get("robot_0/job")
    machine.add(served.events([ENTERED], after=2))
    page.evaluate(HIDE, False)
    has_events(page, 3)
    machine.add(served.events([("Left", "/JOB/B", {"outcome": "ok"})], after=3))
    has_events(page, 4)
    assert page.evaluate("() => smachpy.store.data.gap.value") is None
