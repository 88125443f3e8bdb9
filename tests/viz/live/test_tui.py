"""The terminal's view of a machine."""

from __future__ import annotations

import asyncio

from textual.widgets import RichLog, Static, Tree

from smachpy import CBState, StateMachine
from viz.live.machines import Machines
from viz.live.tui import MissionApp
from viz.runs.recording import Recorder, read_recording


def recorded(tmp_path):
    sm = StateMachine(outcomes=["succeeded"], name="JOB")
    inner = StateMachine(outcomes=["succeeded"], output_keys=["x"])

    def write(userdata):
        userdata.x = "[bold]not markup[/]"
        return "succeeded"

    with inner:
        StateMachine.add("DEEP", CBState(write, outcomes=["succeeded"], output_keys=["x"]))
    with sm:
        StateMachine.add(
            "FIRST", CBState(lambda _: "succeeded", outcomes=["succeeded"]), {"succeeded": "IN"}
        )
        StateMachine.add("IN", inner)
    with Recorder(tmp_path / "run.jsonl", sm):
        sm.execute()
    return read_recording(tmp_path / "run.jsonl")


def test_tree_log_status_search_and_refused_commands(tmp_path, clock):
    machines = Machines()
    machines.obtain("job").reset(recorded(tmp_path).history())
    found = {}

    async def look():
        app = MissionApp(machines, None)
        async with app.run_test(size=(120, 40)) as pilot:
            app.refresh_view()
            await pilot.pause()
            found["status"] = str(app.query_one("#status", Static).render())
            found["tree"] = [str(node.label) for node in app.query_one(Tree).root.children]
            found["log"] = len(app.query_one(RichLog).lines)
            await pilot.press("slash", *"deep", "enter")
            await pilot.pause(0.1)
            found["cursor"] = str(app.query_one(Tree).cursor_node.label)
            await pilot.press("s")
            await pilot.pause(0.1)
            await pilot.press("space")  # though the tree has the focus
            await pilot.pause(0.1)
            found["told"] = [note.message for note in app._notifications]
            await pilot.press("slash", "a", "space", "b")
            found["typed"] = app.query_one("#search").value
            app.save_screenshot(str(tmp_path / "tui.svg"))

    asyncio.run(look())
    assert "ended: succeeded" in found["status"]
    assert [label.split()[0] for label in found["tree"]] == ["FIRST", "IN"] or "FIRST" in found[
        "tree"
    ][0]
    assert found["log"] > 3
    assert found["told"] == ["this viewer only looks; try --control"] * 2
    assert found["typed"] == "a b"
    assert "DEEP" in found["cursor"]


def test_a_preempt_says_who_asked_and_who_holds_it_up(tmp_path, clock):
    recording = recorded(tmp_path)
    deep = next(e for e in recording.events if e["path"] == "/JOB/IN/DEEP")
    at = recording.events.index(deep) + 1
    events = recording.events[:at]
    asked = {"source": "operator", "by": "ann", "why": "preempt /JOB"}
    for path, grace in (("/JOB", None), ("/JOB/IN", None), ("/JOB/IN/DEEP", 5.0)):
        number = len(events) + 1
        stamp = deep["stamp_ns"] + number
        events.append(
            {
                "kind": "PreemptRequested", "path": path, "seq": number, "t": 0.0,
                "stamp_ns": stamp, "grace": grace, **asked,
            }
        )  # fmt: skip
    machines = Machines()
    machine = machines.obtain("job")
    machine.recorded = True
    machine.reset({**recording.history(), "events": events})
    found = {}

    async def look():
        app = MissionApp(machines, None)
        async with app.run_test(size=(120, 40)) as pilot:
            app.refresh_view()
            await pilot.pause()
            found["status"] = str(app.query_one("#status", Static).render())
            found["preempt"] = str(app.query_one("#preempt", Static).render())
            found["log"] = "\n".join(line.text for line in app.query_one(RichLog).lines)

    asyncio.run(look())
    assert "preempting" in found["status"]
    assert "preempt by operator ann: preempt /JOB" in found["preempt"]
    assert "DEEP holds it up for" in found["preempt"]
    assert "of 5 s" in found["preempt"]
    assert "asked to stop by operator ann" in found["log"]


def test_a_frame_that_comes_after_the_widgets_have_gone_is_none(tmp_path, clock):
    machines = Machines()
    machines.obtain("job").reset(recorded(tmp_path).history())

    async def leave():
        app = MissionApp(machines, None)
        async with app.run_test():
            await app.screen.query("*").remove()
            app.refresh_view()

    asyncio.run(leave())
