"""The terminal's view of a machine."""

from __future__ import annotations

import asyncio

import pytest
from textual.widgets import DataTable, RichLog, Static, Tree

from smachpy import CBState, StateMachine
from smachpy.events.recording import Recorder, read_recording
from smachpy.events.run_state import RunState
from smachpy_viz.live import tui
from smachpy_viz.live.machines import Machine, Machines
from smachpy_viz.live.tui import MissionApp


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


@pytest.mark.slow
def test_tree_log_status_search_and_refused_commands(tmp_path, clock):
    machines = Machines()
    machines.obtain("job").reset(recorded(tmp_path).history())
    found = {}

    async def look():
        app = MissionApp(machines, None)
        app.NOTIFICATION_TIMEOUT = 600.0
        async with app.run_test(size=(120, 40)) as pilot:
            app.refresh_view()
            await pilot.pause()
            found["status"] = str(app.query_one("#status", Static).render())
            found["tree"] = [str(node.label) for node in app.query_one(Tree).root.children]
            found["log"] = len(app.query_one(RichLog).lines)
            await pilot.press("slash", *"deep", "enter")
            while "DEEP" not in str(app.query_one(Tree).cursor_node.label):
                await pilot.pause(0.01)
            for count, key in enumerate(("s", "space"), 1):  # though the tree has the focus
                await pilot.press(key)
                while len(app._notifications) < count:
                    await pilot.pause(0.01)
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
    assert found["told"] == ["this viewer sends no commands; try --control"] * 2
    assert found["typed"] == "a b"


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


def test_the_next_machine_is_shown_though_the_present_one_was_forgotten(tmp_path, clock):
    machines = Machines()
    for name in ("one", "two"):
        machines.obtain(name).reset(recorded(tmp_path / name).history())
    shown = []

    async def look():
        app = MissionApp(machines, None)
        async with app.run_test(size=(120, 40)) as pilot:
            app.refresh_view()
            machines.forget("one")
            for _ in range(2):
                await pilot.press("n")
                shown.append(app._machine.name)
            machines.forget("two")
            await pilot.press("n")
            shown.append(app._machine.name)

    asyncio.run(look())
    assert shown == ["two", "two", "two"]


def test_a_frame_that_comes_after_the_widgets_have_gone_is_none(tmp_path, clock):
    machines = Machines()
    machines.obtain("job").reset(recorded(tmp_path).history())

    async def leave():
        app = MissionApp(machines, None)
        async with app.run_test():
            await app.screen.query("*").remove()
            app.refresh_view()

    asyncio.run(leave())


def seen(machine, keys=(), *, then=None):
    """What the terminal shows of a machine, after some keys."""
    machines = Machines()
    machines.get = {"job": machine}.get
    machines.summaries = lambda: [machine.summary()]
    found = {}

    async def look():
        app = MissionApp(machines, None)
        async with app.run_test(size=(140, 50)) as pilot:
            app.refresh_view()
            await pilot.pause()
            for key in keys:
                await pilot.press(key)
            if then is not None:
                then()
            app.refresh_view()
            await pilot.pause()
            for name in ("status", "goals"):
                found[name] = str(app.query_one(f"#{name}", Static).render())
            table = app.query_one(DataTable)
            found["values"] = [list(map(str, table.get_row_at(i))) for i in range(table.row_count)]
            found["active"] = app._state.active()

    asyncio.run(look())
    return found


def watched(tmp_path, events=None):
    machine = Machine("job", lambda _machine: None)
    history = recorded(tmp_path).history()
    machine.recorded = True
    machine.reset({**history, "events": history["events"] if events is None else events})
    return machine


def event(seq, kind="Entered", path="/JOB/FIRST", **more):
    return {"kind": kind, "path": path, "t": 0.0, "stamp_ns": seq, "seq": seq, **more}


def test_values_are_shown_whatever_they_spell(tmp_path, clock):
    wrote = event(
        1, "UserdataWritten", path="/JOB/IN/DEEP[b]", key="k[/x]", value="goal [/red] done"
    )
    machine = watched(tmp_path, [wrote])
    assert seen(machine)["values"] == [["k[/x]", "'goal [/red] done'", "DEEP[b]"]]


def test_what_is_told_anew_is_shown_anew(tmp_path, clock):
    """The same machine, after a time in which nobody could hear it."""
    machine = watched(tmp_path, [event(1), event(2, path="/JOB/IN")])
    base = {**RunState().data, "states": {}}
    later = RunState(base)
    later.fold(event(90, path="/JOB/IN/DEEP"))

    def hear():
        history = recorded(tmp_path / "again").history()
        new = {**history, "epoch": machine.epoch, "base": later.data}
        machine.reset({**new, "events": [event(91, path="/JOB/FIRST")]})

    assert sorted(seen(machine, then=hear)["active"]) == ["/JOB/FIRST", "/JOB/IN/DEEP"]


def test_a_goal_under_way_is_shown_though_newer_ones_have_ended(tmp_path, clock):
    sent = {"kind": "GoalSent", "goal": None}
    events = [event(1, **sent, action="oldest", goal_id="old")]
    for n in range(2, 20, 2):
        events.append(event(n, **sent, action="quick", goal_id=f"g{n}"))
        ended = {"status": "SUCCEEDED", "text": "", "result": None}
        events.append(event(n + 1, "GoalDone", action="quick", goal_id=f"g{n}", **ended))
    goals = seen(watched(tmp_path, events))["goals"]
    assert "oldest" in goals
    assert goals.count("\n") <= 4
    many = [event(n, **sent, action=f"a{n}", goal_id=f"g{n}") for n in range(1, 8)]
    assert "3 more under way" in seen(watched(tmp_path / "2", many))["goals"]


def test_values_that_are_left_out_are_counted(tmp_path, clock):
    wrote = [event(n, "UserdataWritten", key=f"k{n}", value=n) for n in range(1, 111)]
    assert seen(watched(tmp_path, wrote))["values"][-1][0] == "and 10 more"


@pytest.mark.slow
def test_one_event_back_one_on_and_back_to_now(tmp_path, clock):
    machine = watched(tmp_path)
    last = machine.seq
    shown = []
    keys = ["comma", "comma", "full_stop", "full_stop", "comma", "comma", "l"]

    async def look():
        machines = Machines()
        machines.get, machines.summaries = {"job": machine}.get, lambda: [machine.summary()]
        app = MissionApp(machines, None)
        async with app.run_test(size=(140, 50)) as pilot:
            app.refresh_view()
            for key in keys:
                await pilot.press(key)
                app.refresh_view()
                shown.append((str(app.query_one("#status", Static).render()), app._state.active()))

    asyncio.run(look())
    for (status, _), number in zip(shown, [1, 2, 1, 0, 1, 2, 0], strict=True):
        assert (f"event {last - number} of {last}" if number else "ended: succeeded") in status
    assert shown[1][1] == ["/JOB", "/JOB/IN"]
    assert shown[3][1] == []


def test_events_that_are_missing_are_counted(tmp_path, clock):
    machine = watched(tmp_path, [event(1), event(9, "Left", outcome="ok", dropped=7)])
    assert "7 events missing" in seen(machine)["status"]


@pytest.mark.slow
def test_looking_back_folds_what_is_near_and_shows_what_was(tmp_path, clock, monkeypatch):
    monkeypatch.setattr(tui, "STRIDE", 10)
    monkeypatch.setattr(tui, "LOGGED_BACK", 10)
    events = [event(1, "Started", "/JOB")]
    for n in range(2, 402, 2):
        events += [event(n), event(n + 1, "Left", outcome=f"end{n + 1}")]
    machine = watched(tmp_path, events)
    folds = []
    fold = RunState.fold
    monkeypatch.setattr(
        RunState, "fold", lambda state, one: (folds.append(one), fold(state, one))[1]
    )

    async def look():
        app = MissionApp(Machines(), None)
        async with app.run_test(size=(140, 50)) as pilot:
            app._machine = machine
            app.refresh_view()
            await pilot.pause()
            folds.clear()
            at = len(events)
            for step in [-1] * 20 + [1] * 5 + [-1] * 10:
                app.action_go_by(step)
                at += step
                there = RunState()
                for one in events[:at]:
                    fold(there, one)
                assert app._state.data == there.data
                assert f" end{at - 1 + at % 2}" in app.query_one(RichLog).lines[-1].text
            lines = len(app.query_one(RichLog).lines)
            app.action_live()
            assert len(app.query_one(RichLog).lines) > lines
            assert app._state.data["states"]["/JOB/FIRST"]["visits"] == 200

    asyncio.run(look())
    assert len(folds) < 3_000  # from the beginning each time it is 13,000


def test_looking_back_at_few_events_begins_with_what_was_before_them(tmp_path, clock):
    machine = watched(tmp_path)
    recording = machine.events()

    async def look():
        app = MissionApp(Machines(), None)
        async with app.run_test(size=(140, 50)):
            app._machine = machine
            app.refresh_view()
            for at in (*range(len(recording) - 1, 0, -1), *range(2, 5), 3, 2):
                app.action_go_by(-1 if at < app._seq else 1)
                there = RunState()
                for one in recording[:at]:
                    there.fold(one)
                assert app._state.data == there.data, at

    asyncio.run(look())


ASKED = {
    "text": "Delivery to lab: may I hand it over?",
    "answers": ["yes", "no"],
    "words": ["Yes, hand over", ""],
    "default": "no",
    "patience": 60.0,
    "service": "operator/questions/q1",
    "has_picture": False,
}
WAITS = [("Started", "/JOB"), ("Entered", "/JOB/A"), ("QuestionAsked", "/JOB/A", ASKED)]


@pytest.mark.slow
def test_the_terminal_view_shows_a_question_and_takes_the_number_of_an_answer(served, clock):
    served.add("one", events=[(kind, path, dict(*more)) for kind, path, *more in WAITS])
    sent = []

    def send(name, command):
        sent.append((name, command))
        return {"text": ""}

    found = {}

    async def look():
        app = MissionApp(served.machines, send)
        async with app.run_test(size=(100, 40)) as pilot:
            app.refresh_view()
            await pilot.pause()
            found["question"] = str(app.query_one("#question", Static).render())
            await pilot.press("slash", "1", "enter")  # typed in the search
            await pilot.press("1")
            await app.workers.wait_for_complete()

    asyncio.run(look())
    assert "Delivery to lab: may I hand it over?" in found["question"]
    assert "1  Yes, hand over" in found["question"]
    assert "means no" in found["question"]
    ((name, command),) = sent
    assert (name, command["command"], command["path"], command["answer"]) == (
        "one",
        "answer",
        "/JOB/A",
        "yes",
    )
    assert command["by"].startswith("terminal of ")


@pytest.mark.parametrize(("width", "stacked"), [(40, True), (80, False)])
def test_narrow_terminals_stack_the_tree_and_the_log(tmp_path, clock, width, stacked):
    machines = Machines()
    machines.obtain("job").reset(recorded(tmp_path).history())
    found = {}

    async def look():
        app = MissionApp(machines, None)
        async with app.run_test(size=(width, 24)) as pilot:
            app.refresh_view()
            await pilot.pause()
            for name in ("tree", "log"):
                found[name] = app.query_one(f"#{name}").region
            found["lines"] = [line.text for line in app.query_one(RichLog).lines]

    asyncio.run(look())
    tree, log = found["tree"], found["log"]
    assert (tree.bottom <= log.y) == stacked
    assert (tree.right <= log.x) != stacked
    assert min(tree.height, log.height) >= 5
    assert min(tree.width, log.width) >= 34
    assert any("FIRST  succeeded \u2192 IN" in line for line in found["lines"])


@pytest.mark.slow
def test_goals_say_where_to_and_how_far_and_the_keys_fit_into_80_columns(tmp_path, clock):
    fields = {"station": "dock 2"}
    sent = {"action": "go", "goal_id": "g", "goal": {"$msg": "G", "fields": fields}}
    progress = {"fraction": 0.5, "distance": 3.14, "text": ""}
    events = [event(1, "GoalSent", **sent), event(2, "GoalFeedback", action="go", goal_id="g")]
    events[-1] |= {"feedback": None, "progress": progress}
    machine = watched(tmp_path, events)
    assert "\u2192 dock 2 3.1 m left" in seen(machine)["goals"]
    machines, found = Machines(), {}
    machines.obtain("job").reset(recorded(tmp_path / "keys").history())

    async def look():
        app = MissionApp(machines, None)
        async with app.run_test(size=(80, 24)) as pilot:
            await pilot.pause()
            keys = list(app.query("FooterKey"))
            found["right"] = max(key.region.right for key in keys)
            found["count"] = len(keys)

    asyncio.run(look())
    assert found["count"] == 9
    assert found["right"] <= 80
