"""The play bar: playing a run again, the clock, and jumps to what matters."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.browser

SHOWN = "() => smachpy.store.instantText(smachpy.store.nowMs())"


def run():
    return [
        ("Started", "/JOB", {"at": 0.0}),
        ("Entered", "/JOB/A", {"at": 1.0}),
        ("UserdataWritten", "/JOB/A", {"key": "count", "value": 1, "at": 2.0}),
        ("PreemptRequested", "/JOB/A", {"source": "operator", "at": 10.0}),
        ("Left", "/JOB/A", {"outcome": "aborted", "at": 20.0}),
        ("Entered", "/JOB/B", {"at": 20.0}),
        ("UserdataWritten", "/JOB/B", {"key": "count", "value": 2, "at": 30.0}),
        ("Failed", "/JOB/B", {"error": "ValueError: x", "at": 40.0}),
        ("Finished", "/JOB", {"outcome": None, "at": 50.0}),
    ]


def freeze(page):
    """Let pictures of a run that is played come when the test asks for them."""
    page.evaluate(
        """() => { let moment = performance.now(); performance.now = () => moment;
          window.pass = (ms) => { moment += ms; smachpy.store.playOn(moment); }; }"""
    )


def test_a_run_is_played_at_its_rate_to_its_end(served, look):
    served.add("one", events=run())
    page = look(served.start())
    freeze(page)
    page.click("#play")
    assert page.evaluate(SHOWN) == "00:00.0"
    page.wait_for_selector("#play[aria-label='hold the picture']")
    page.evaluate("() => pass(1500)")
    assert page.evaluate(SHOWN) == "00:01.5"
    page.select_option(".rate select", "64")
    page.evaluate("() => pass(250)")
    assert page.evaluate(SHOWN) == "00:17.5"
    page.keyboard.press(" ")
    page.evaluate("() => pass(5000)")
    assert page.evaluate(SHOWN) == "00:17.5"  # held
    page.keyboard.press(" ")
    page.select_option(".rate select", "0.25")
    page.evaluate("() => pass(2000)")
    assert page.evaluate(SHOWN) == "00:18.0"
    page.evaluate(
        "() => smachpy.store.seek(smachpy.store.run.first() + 49000)"
    )  # plays on from there
    page.evaluate("() => pass(3000)")
    assert page.evaluate(SHOWN) == "00:49.8"
    page.evaluate("() => pass(2000)")
    assert page.evaluate("() => [smachpy.store.cursor.value, smachpy.store.playing.value]") == [
        None,
        None,
    ]
    page.wait_for_selector("#play[aria-label='play']")


def test_a_live_run_is_held_and_becomes_live_again(served, look):
    machine = served.add("one", events=run()[:3])
    page = look(served.start())
    freeze(page)
    page.wait_for_selector("#play[aria-label='hold the picture']")
    page.click("#play")
    assert page.evaluate(SHOWN) == "00:02.0"
    page.wait_for_selector(".live-button[aria-pressed=false]")
    machine.add(served.events(run()[3:4], after=3))
    page.wait_for_function("() => smachpy.store.run.events.length === 4")
    assert page.evaluate(SHOWN) == "00:02.0"
    page.keyboard.press(" ")
    page.evaluate("() => pass(8500)")
    page.wait_for_selector(".live-button[aria-pressed=true]")


def test_the_clock_goes_while_a_run_goes_on(served, look):
    served.add("one", events=run()[:1])
    page = look(served.start())
    page.wait_for_selector(".clock input")
    before = page.input_value(".clock input")
    page.wait_for_function(
        "(before) => document.querySelector('.clock input').value > before", arg=before
    )


def test_keys_and_buttons_jump(served, look):
    served.add("one", events=run())
    page = look(served.start())
    at = []
    for key in ("Home", "f", "f", "F", "P", "Home", "k", "k", "K", "Home", "g"):
        page.keyboard.press(key)
        at.append(page.evaluate(SHOWN)[3:5])
    assert at == ["00", "20", "40", "20", "10", "00", "02", "30", "02", "00", "00"]
    page.wait_for_selector(".notice")  # there is no goal
    page.keyboard.press("End")
    assert page.evaluate("() => smachpy.store.cursor.value") is None
    page.click(".jumps button:has-text('failure')")  # at the end the newest one is the next
    assert page.evaluate(SHOWN) == "00:40.0"
    page.wait_for_selector(".jumps button:has-text('failure')[aria-disabled=true]")
    page.click(".jumps button:has-text('preempt')", modifiers=["Shift"], force=True)
    assert page.evaluate(SHOWN) == "00:10.0"


def test_an_instant_is_typed(served, look):
    served.add("one", events=run())
    page = look(served.start())
    for text, shown in (("32.5", "00:32.5"), ("0:07", "00:07.0"), ("99:00", "00:50.0")):
        page.fill(".clock input", text)
        page.keyboard.press("Enter")
        assert page.evaluate(SHOWN) == shown
    page.fill(".clock input", "soon")
    page.keyboard.press("Enter")
    assert "got soon; expected" in page.text_content(".notice.error")
    assert page.evaluate(SHOWN) == "00:50.0"


def test_space_pauses_the_mission_only_where_one_looks_at_now(served, look):
    control = {"paused": False, "breakpoints": []}
    served.add("one", events=run()[:3], control=control)
    page = look(f"{served.start(token='t')}#token=t")
    page.wait_for_selector("#pause")
    page.keyboard.press(" ")
    page.wait_for_selector(".notice.info")
    page.evaluate("() => smachpy.store.seek(smachpy.store.run.first())")
    page.keyboard.press(" ")
    page.wait_for_function("() => smachpy.store.playing.value !== null")
    assert [one["command"] for one in served.commands] == ["pause"]


def test_the_bar_can_be_used_on_a_phone(served, look):
    served.add("one", events=run())
    page = look(served.start())
    page.set_viewport_size({"width": 390, "height": 844})
    box = page.query_selector("#play").bounding_box()
    assert min(box["width"], box["height"]) >= 40
    assert box["y"] + box["height"] <= 844
    page.click("#play")
    page.wait_for_function("() => smachpy.store.playing.value !== null")
