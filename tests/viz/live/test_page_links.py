"""The address of what the page shows, and notes at instants."""

from __future__ import annotations

from urllib.parse import parse_qs, urlsplit

import pytest

from smachpy import CBState, StateMachine
from tests.browser import wait_for

pytestmark = pytest.mark.browser

EVENTS = [
    ("Started", "/JOB", {"initial": ["IN"]}),
    ("Entered", "/JOB/IN", {"at": 1.0}),
    ("Entered", "/JOB/IN/GO", {"at": 2.0}),
    ("Left", "/JOB/IN/GO", {"outcome": "done", "at": 12.0}),
    ("Left", "/JOB/IN", {"outcome": "done", "at": 12.0}),
    ("Finished", "/JOB", {"outcome": "done", "at": 20.0}),
]


@pytest.fixture
def address(served):
    """A machine with a closed container, and a run that is over."""
    inner, sm = (StateMachine(outcomes=["done"], name=name) for name in ("IN", "JOB"))
    with inner:
        StateMachine.add("GO", CBState(lambda _: "done", outcomes=["done"]))
    with sm:
        StateMachine.add("IN", inner)
    served.add("one", sm=sm, events=[(kind, path, dict(facts)) for kind, path, facts in EVENTS])
    return served.start(token="t")


def pin(page, text):
    page.keyboard.press("n")
    page.fill(".note-form input", text)
    page.keyboard.press("Enter")
    page.wait_for_selector(".note-form", state="detached")


def test_a_link_shows_another_browser_the_same(address, look):
    page = look(address)
    page.evaluate(
        "async () => { smachpy.page.layouts.setDepth(9); await smachpy.page.layouts.running; }"
    )
    page.evaluate(
        "() => { const { data, playback } = smachpy.store; playback.seek(data.run.first() + 5000); }"
    )
    page.evaluate("() => smachpy.page.select('/JOB/IN/GO')")
    pin(page, "<b>here</b> it hesitates")
    wait_for(page, "location.hash.includes('note=')")
    link = page.evaluate("() => smachpy.page.address.text")
    assert page.url.split("#")[1] == link.split("#")[1]
    assert "token" not in link
    assert parse_qs(urlsplit(link).query) == {"machine": ["one"]}
    other = look(link)
    wait_for(other, "document.querySelector('g.selected[data-path=\"/JOB/IN/GO\"]')")
    assert "00:05.0" in other.text_content(".banner.past")
    assert other.text_content(".notes li span") == "<b>here</b> it hesitates"
    assert other.evaluate("() => smachpy.store.view.opened.value.has('/JOB/IN')")
    other.keyboard.press("l")
    other.click(".notes .link")
    wait_for(other, "document.querySelector('.banner.past')?.textContent.includes('00:05.0')")


def test_notes_are_kept_by_the_browser_until_they_are_removed(address, look):
    page = look(address)
    pin(page, "look at this")
    page.goto(address)
    page.wait_for_selector(".notes li")
    page.click(".notes [aria-label='remove the note look at this']")
    page.wait_for_selector(".notes", state="detached")
    page.goto(address)
    page.wait_for_selector("html[data-drawn]")
    assert page.locator(".notes").count() == 0


def test_all_pages_share_the_notes_of_those_that_may_command(address, look, tmp_path):
    page, other, stranger = look(f"{address}#token=t"), look(f"{address}#token=t"), look(address)
    pin(page, "<b>here</b> it hesitates")
    for one in (page, other, stranger):
        one.wait_for_selector(".notes li")
        assert one.text_content(".notes li span") == "<b>here</b> it hesitates"
    assert "note=" not in page.url  # the server has it
    assert stranger.locator(".notes [aria-label^=remove]").count() == 0
    with stranger.expect_download() as saved:
        stranger.get_by_role("button", name="Share").click()
    file = tmp_path / "shared.html"
    saved.value.save_as(file)
    assert "hesitates" in look(file.as_uri()).inner_text(".notes")
    other.click(".notes [aria-label^=remove]")
    for one in (page, other, stranger):
        one.wait_for_selector(".notes", state="detached")


def test_a_link_to_what_is_not_there_says_so(address, look):
    page = look(f"{address}#at=1000.5&state=/NO/SUCH&open=/NO&note=x&token=t")
    page.wait_for_selector(".notice.error")
    assert "not in this machine" in page.text_content(".notice.error")
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is None
    page.evaluate("() => { location.hash = '#state=/JOB/IN'; }")
    wait_for(page, "document.querySelector('g.selected[data-path=\"/JOB/IN\"]')")


def test_a_run_in_one_file_has_links_too(address, look, tmp_path):
    page = look(address)
    saved = page.request.get(f"{address}api/export?machine=one&format=html")
    file = tmp_path / "run.html"
    file.write_bytes(saved.body())
    alone = look(file.as_uri() + "#state=/JOB/IN")
    wait_for(alone, "smachpy.store.view.selected.value === '/JOB/IN'")
    pin(alone, "as a file")
    wait_for(alone, "location.hash.includes('as+a+file')")


def test_a_shared_file_opens_at_the_instant_with_the_notes(address, look, tmp_path):
    page = look(address)
    page.evaluate("() => smachpy.page.select('/JOB/IN')")
    pin(page, "here <b>it</b> waits")
    page.evaluate("() => smachpy.store.playback.seek(smachpy.store.data.run.first() + 2)")
    shown = page.evaluate("() => smachpy.store.playback.cursor.value")
    with page.expect_download() as saved:
        page.get_by_role("button", name="Share").click()
    file = tmp_path / "shared.html"
    saved.value.save_as(file)
    alone = look(file.as_uri())
    wait_for(alone, "smachpy.store.view.selected.value === '/JOB/IN'")
    assert alone.evaluate("() => smachpy.store.playback.cursor.value") == pytest.approx(
        shown, abs=0.01
    )
    assert "here <b>it</b> waits" in alone.inner_text(".notes")
    assert alone.get_by_role("button", name="Share").count() == 0
    other = look(file.as_uri() + "#state=/JOB")  # an address of the reader's own counts
    wait_for(other, "smachpy.store.view.selected.value === '/JOB'")
    assert other.locator(".notes").count() == 0
    long = page.request.get(f"{address}api/export?machine=one&format=html&view={'x' * 20_001}")
    assert (long.status, long.json()["text"].partition(":")[0]) == (400, "view")
