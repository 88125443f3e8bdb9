"""The terminal view on a virtual clock, written into memory."""

from __future__ import annotations

import io
import threading
from types import SimpleNamespace as Message

import pytest
from rich.console import Console

import smachpy
from actionlib_core.clock import RealClock, VirtualClock, use_clock
from smachpy import events as ev
from smachpy.events.introspection import describe
from smachpy_viz.terminal import panel as terminal
from smachpy_viz.terminal.panel import TerminalView


@pytest.fixture(autouse=True)
def a_terminal_that_moves_its_cursor(monkeypatch):
    """Whatever the tests themselves are started in: one called dumb gets plain lines."""
    monkeypatch.setenv("TERM", "xterm-256color")


DRIVE = "/PATROL/WATCHED_DRIVE/DRIVE"


class Screen:
    """A console that keeps what is printed."""

    def __init__(self, *, tty, width=100):
        self.file = io.StringIO()
        self.console = Console(
            file=self.file, force_terminal=tty, width=width, height=30, highlight=False,
            color_system=None, force_interactive=tty,
        )  # fmt: skip

    @property
    def text(self):
        return self.file.getvalue()


def drive_events():
    yield ev.Started("/PATROL", 0.0, 0)
    yield ev.Entered("/PATROL/WATCHED_DRIVE", 0.0, 0)
    yield ev.Entered(DRIVE, 0.0, 0)
    yield ev.Entered("/PATROL/WATCHED_DRIVE/BATTERY", 0.0, 0)
    yield ev.Entered(f"{DRIVE}/NEXT_WAYPOINT", 0.0, 0)
    yield ev.Left(f"{DRIVE}/NEXT_WAYPOINT", 0.5, 0, "drive")
    yield ev.Entered(f"{DRIVE}/GO_THERE", 0.5, 0)
    yield ev.GoalSent(f"{DRIVE}/GO_THERE", 0.5, 0, "move_base", "g1", None)
    for left in (8.0, 2.0):
        yield ev.GoalFeedback(
            f"{DRIVE}/GO_THERE", 8.5 - left, 0, "move_base", "g1", Message(distance_remaining=left)
        )


def test_lines_alone_without_a_terminal(patrol):
    screen = Screen(tty=False)
    with TerminalView(patrol, console=screen.console, clock=RealClock()) as view:
        for event in drive_events():
            view.on_event(event)
    lines = screen.text.splitlines()
    assert lines[0].split() == ["0.00", "PATROL", "started"]
    assert "WATCHED_DRIVE/DRIVE/NEXT_WAYPOINT  drive \u2192 GO_THERE  0.5 s" in lines[1]
    assert "move_base  8.00 m left" in lines[2]
    assert "2.00 m left" in lines[3]
    assert "\x1b" not in screen.text


def test_plain_needs_no_terminal_control(patrol):
    screen = Screen(tty=True)
    with TerminalView(patrol, plain=True, console=screen.console, clock=RealClock()) as view:
        for event in drive_events():
            view.on_event(event)
    assert "\x1b" not in screen.text


def panel(patrol, width):
    screen = Screen(tty=True, width=width)
    view = TerminalView(
        patrol, console=screen.console, clock=Message(now=lambda: 70.0, event=Event)
    )
    for event in drive_events():
        view.on_event(event)
    screen.console.print(view._panel())
    return screen.text


class Event:
    def set(self):
        pass


def test_the_panel_shows_every_running_state_and_goal(patrol):
    text = panel(patrol, 100)
    assert "PATROL  1:10" in text
    assert "PATROL \u203a WATCHED_DRIVE \u203a BATTERY" in text
    assert "DRIVE \u203a GO_THERE  1:09" in text
    assert "2.00 m left" in text
    assert "75%" in text
    assert "~23.2 s" in text  # a quarter of the way, three quarters took 69.5 s
    assert "\u2501" in text


def test_the_panel_shows_the_userdata_that_was_written_last(patrol):
    screen = Screen(tty=True)
    clock = Message(now=lambda: 1.0, event=Event)
    view = TerminalView(patrol, console=screen.console, clock=clock)

    class Broken:
        def __repr__(self):
            raise ValueError

    for number in range(9):
        view.on_event(ev.UserdataWritten("/PATROL", 0.0, 0, f"key_{number}", number))
    view.on_event(
        ev.UserdataWritten("/PATROL", 0.0, 0, "places", ["\x1b[2J"] + ["x" * 99] * 10_000)
    )
    view.on_event(ev.UserdataWritten("/PATROL", 0.0, 0, "key_7", Broken()))
    screen.console.print(view._panel())
    rows = [line.split(None, 1) for line in screen.text.splitlines()[1:]]
    assert [row[0] for row in rows] == ["key_7", "places", "key_8", "key_6", "key_5"]
    assert rows[0][1].startswith("<Broken instance at")
    assert rows[2][1].strip() == "8"
    assert "\x1b" not in screen.text
    assert max(map(len, screen.text.splitlines())) <= 100


def test_a_value_that_says_how_far_it_is_gets_a_bar(patrol):
    for width, bar in ((100, True), (60, False)):
        screen = Screen(tty=True)
        screen.console.width = width
        clock = Message(now=lambda: 1.0, event=Event)
        view = TerminalView(patrol, console=screen.console, clock=clock)
        value = Message(fraction=0.45, seconds_left=83.0, text="2/4 kitchen")
        view.on_event(ev.UserdataWritten("/PATROL", 0.0, 0, "progress", value))
        view.on_event(ev.UserdataWritten("/PATROL", 0.0, 0, "index", 1))
        screen.console.print(view._panel())
        row = next(line for line in screen.text.splitlines() if "progress" in line)
        assert ("\u2501" in row) == bar
        assert " ".join(row.replace("\u2501", "").split()).endswith("45% ~1:23 2/4 kitchen")
        assert any(line.split() == ["index", "1"] for line in screen.text.splitlines())


def test_a_narrow_terminal_keeps_the_numbers_and_drops_the_bar(patrol):
    text = panel(patrol, 50)
    assert "2.00 m left" in text
    assert "75%" not in text
    assert max(len(line) for line in text.splitlines()) <= 50


def test_a_terminal_gets_lines_and_its_cursor_back(patrol):
    screen = Screen(tty=True)
    with TerminalView(patrol, console=screen.console, clock=RealClock()) as view:
        for event in drive_events():
            view.on_event(event)
    assert "\u2192 GO_THERE" in screen.text
    assert screen.text.rstrip().endswith("\x1b[?25h") or "\x1b[?25h" in screen.text


def test_the_view_closes_when_the_mission_raises(patrol):
    screen = Screen(tty=True)
    with (
        pytest.raises(KeyboardInterrupt),
        TerminalView(patrol, console=screen.console, clock=RealClock()),
    ):
        raise KeyboardInterrupt
    assert "\x1b[?25h" in screen.text


class Blocked(io.StringIO):
    """A terminal on which somebody pressed Ctrl-S."""

    def __init__(self):
        super().__init__()
        self.gate = threading.Event()
        self.reached = threading.Event()

    def write(self, text):
        self.reached.set()
        self.gate.wait(60)
        return super().write(text)


def test_a_blocked_terminal_never_holds_the_mission_up(patrol, monkeypatch):
    monkeypatch.setattr(terminal, "PATIENCE", 0.05)
    file = Blocked()
    console = Console(file=file, force_terminal=False, width=100)
    view = TerminalView(patrol, console=console, clock=RealClock())
    view.__enter__()
    view.on_event(ev.Started("/PATROL", 0.0, 0))
    assert file.reached.wait(60)
    for i in range(3 * terminal.BACKLOG):
        view.on_event(ev.Left(f"{DRIVE}/GO_THERE", float(i), 0, "succeeded"))
    assert len(view._lines) == terminal.BACKLOG
    task = view._task
    view.close()  # gives up waiting
    file.gate.set()
    assert task.join(60)
    assert "lines left out: the terminal was too slow" in file.getvalue()
    assert view.history.visits()[f"{DRIVE}/GO_THERE"].outcomes["succeeded"] == 3 * terminal.BACKLOG


def test_a_real_mission_is_told_to_its_end():
    class Step(smachpy.State):
        def __init__(self):
            super().__init__(outcomes=["succeeded"])

        def execute(self, userdata):
            return "succeeded"

    machine = smachpy.StateMachine(outcomes=["succeeded"], name="M")
    with machine:
        smachpy.StateMachine.add("ONE", Step(), transitions={"succeeded": "TWO"})
        smachpy.StateMachine.add("TWO", Step())
    screen = Screen(tty=False)
    with TerminalView(describe(machine), console=screen.console, clock=RealClock()) as view:
        unsubscribe = machine.subscribe(view.on_event)
        outcome = machine.execute()
        unsubscribe()
    view.print_summary(outcome)
    text = screen.text
    assert "ONE  succeeded \u2192 TWO" in text
    assert "M  ended: succeeded" in text
    assert text.index("ended") < text.index("state ") < text.index("M: succeeded after")
    view.close()


def test_hostile_names_and_errors_reach_the_terminal_as_text(build):
    record = build.rooted(build.machine("[bold]M", [build.leaf("\x1b[2J<b>")], {}))
    screen = Screen(tty=False)
    with TerminalView(record, console=screen.console, clock=RealClock()) as view:
        path = f"{record.path}/\x1b[2J<b>"
        view.on_event(ev.Started(record.path, 0.0, 0))
        view.on_event(ev.Entered(path, 0.0, 0))
        view.on_event(ev.Failed(path, 0.0, 0, "ValueError: [red]\x1b[2J" + "x" * 10_000))
    view.print_summary(None)
    assert "\x1b" not in screen.text
    assert "[bold]M: exception" in screen.text
    assert "x" * 10_000 in screen.text  # lines for logs cut no reason


def test_a_terminal_that_is_gone_ends_the_drawing_alone(patrol):
    class Gone(io.StringIO):
        def write(self, text):
            raise BrokenPipeError(32, "Broken pipe")

    view = TerminalView(patrol, console=terminal._Output(file=Gone()), clock=RealClock())
    with view:
        view.on_event(ev.Started("/PATROL", 0.0, 0))
        assert view._task.join(60)
        view.on_event(ev.Left(f"{DRIVE}/GO_THERE", 1.0, 0, "succeeded"))
    assert not view._lines
    assert view.history.visits()[f"{DRIVE}/GO_THERE"].count == 1


def test_a_hidden_defect_of_the_drawing_is_reported_not_swallowed(patrol, monkeypatch):
    seen = []
    monkeypatch.setattr(threading, "excepthook", seen.append)
    view = TerminalView(patrol, console=Screen(tty=False).console, clock=RealClock())
    monkeypatch.setattr(view, "_frame", lambda: 1 / 0)
    with view:
        view.on_event(ev.Started("/PATROL", 0.0, 0))
        assert view._task.join(60)
    assert [report.exc_type for report in seen] == [ZeroDivisionError]


def test_the_view_lives_on_the_clock_of_its_mission(patrol):
    screen = Screen(tty=True)
    with VirtualClock() as clock, use_clock(clock):
        with TerminalView(patrol, console=screen.console) as view:
            view.on_event(ev.Started("/PATROL", clock.now(), 0))
            clock.sleep(120.0)
            view.on_event(ev.Finished("/PATROL", clock.now(), 0, "succeeded"))
        view.print_summary("succeeded")
    assert "PATROL  1:59" in screen.text
    assert "PATROL: succeeded after 120.00 s" in screen.text
