"""The widget that shows a machine in a notebook: with real drawing, and its script in a browser."""

from __future__ import annotations

import json
import math
import os
import threading
import time

import pytest

from smachpy import CBState, State, StateMachine, viz
from smachpy_viz.pictures.drawing import PictureError
from tests.browser import opened_browser

pytest.importorskip("anywidget")


class Held(State):
    """Runs until it is let go."""

    def __init__(self):
        super().__init__(outcomes=["done", "preempted"])
        self.go_on = threading.Event()

    def execute(self, userdata):
        self.go_on.wait(60.0)
        return "done"


@pytest.fixture
def machine():
    sm = StateMachine(outcomes=["done", "preempted"], name="JOB")
    with sm:
        StateMachine.add("FIRST", CBState(lambda _: "ok", outcomes=["ok"]), {"ok": "HELD"})
        StateMachine.add("HELD", Held())
    return sm


@pytest.fixture
def widget(machine):
    widget = viz.MachineWidget(machine, interval=0.01)
    yield widget
    widget.close()


def wait_for(condition, timeout=60.0):
    deadline = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < deadline
        threading.Event().wait(0.02)


def test_it_follows_a_run_and_says_how_it_ended(machine, widget):
    assert widget.status == "not started"
    before = widget.picture
    assert before.startswith(("<?xml", "<svg"))
    runner = threading.Thread(target=machine.execute)
    runner.start()
    try:
        wait_for(lambda: widget.status == "running: HELD" and widget.picture != before)
        during = widget.picture
    finally:
        machine["HELD"].go_on.set()
        runner.join(60.0)
    wait_for(lambda: widget.status.startswith("ended: done after "))
    wait_for(lambda: widget.picture != during)


def test_after_its_close_it_follows_nothing(machine):
    widget = viz.MachineWidget(machine)
    widget.close()
    widget.close()
    machine["HELD"].go_on.set()
    machine.execute()
    assert widget.status == "not started"


def test_its_close_ends_the_wait_for_the_next_picture(machine):
    """The thread that draws slept for the whole interval."""
    widget = viz.MachineWidget(machine, interval=3600.0)
    machine["HELD"].go_on.set()
    machine.execute()
    wait_for(lambda: widget.status != "not started")
    widget.close()
    assert widget._executor.join(60.0)


def test_its_close_gives_up_a_picture_that_takes_long(machine, monkeypatch, tmp_path):
    widget = viz.MachineWidget(machine)
    told = tmp_path / "pid"
    dot = tmp_path / "dot"
    dot.write_text(f"#!/bin/sh\necho $$ > {told}.new\nmv {told}.new {told}\nexec sleep 3600\n")
    dot.chmod(0o755)
    monkeypatch.setenv("SMACHPY_DOT", str(dot))
    monkeypatch.setattr("smachpy_viz.pictures.graphviz_process.TIME_LIMIT", 3600.0)
    machine["HELD"].go_on.set()
    machine.execute()
    wait_for(told.exists)
    widget.close()
    assert widget._executor.join(60.0)
    assert widget.status == "not started"
    with pytest.raises(ProcessLookupError):
        os.kill(int(told.read_text()), 0)


def test_a_picture_that_cannot_be_drawn_stops_no_machine(machine, widget, monkeypatch):
    def fails(*_args, **_options):
        raise PictureError("no dot any more")

    monkeypatch.setattr("smachpy_viz.notebook.picture", fails)
    machine["HELD"].go_on.set()
    assert machine.execute() == "done"
    wait_for(lambda: widget.status == "no dot any more")


@pytest.mark.parametrize("interval", [0.0, -1.0, math.nan, math.inf])
def test_an_interval_that_is_no_time_is_refused(machine, interval):
    with pytest.raises(PictureError, match="interval: got"):
        viz.MachineWidget(machine, interval=interval)


@pytest.mark.browser
def test_its_script_shows_the_picture_and_follows(machine, widget):
    facts = {"picture": widget.picture, "status": "<b>running</b>"}
    script = widget._esm.replace("export default", "window.widget =")
    with opened_browser() as browser:
        page = browser.new_page()
        page.set_default_timeout(60_000)
        page.set_content(f"<div id='el'></div><script>{script}</script>")
        page.evaluate(
            """(facts) => { const on = {}; window.changed = (name, value) => { facts[name] = value;
            on[`change:${name}`]?.(); }; const model = { get: (name) => facts[name], off() {},
            on: (name, f) => { on[name] = f; } };
            window.widget.render({ model, el: document.getElementById("el") }); }""",
            facts,
        )
        page.wait_for_function("document.querySelector('img').naturalWidth > 50")
        assert page.text_content("p") == "<b>running</b>"
        page.evaluate(f"changed('status', {json.dumps('ended: done')})")
        assert page.text_content("p") == "ended: done"
