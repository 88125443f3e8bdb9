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
            app.save_screenshot(str(tmp_path / "tui.svg"))

    asyncio.run(look())
    assert "ended: succeeded" in found["status"]
    assert [label.split()[0] for label in found["tree"]] == ["FIRST", "IN"] or "FIRST" in found[
        "tree"
    ][0]
    assert found["log"] > 3
    assert "DEEP" in found["cursor"]
