"""The live view in a terminal: tree, goals, userdata and log. It works over ssh."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any, ClassVar

from rich.text import Text
from textual import work
from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.widgets import DataTable, Footer, Input, RichLog, Static, Tree

from smachpy.events import answered_text, asker_text, recovered_text, resource_text
from smachpy.events.outcome_classes import outcome_class
from smachpy.events.run_state import RunState, innermost
from smachpy.exceptions import SmachError
from smachpy.userdata.shown import brief
from smachpy_viz.model.destination import destination
from smachpy_viz.model.labels import GLYPHS, cleanups, shorten, tidies, visible
from smachpy_viz.terminal.lines import NARROW, RUNNING, STYLES, WAITING

if TYPE_CHECKING:
    from collections.abc import Callable

    from textual import events
    from textual.widgets.tree import TreeNode

    from smachpy.events.introspection import StateRecord
    from smachpy_viz.live.machines import Machine, Machines

FRAME_S = 0.2
"""Time between two updates [s]."""
BAR = 20
WIDE = 100
"""From this width on, names and bars of goals have their full length [columns]."""
MAX_GOALS = 4
MAX_VALUES = 100
LOGGED_LINES = 500
LOGGED_BACK = 100
"""Lines of the log while looking back, where every step writes all of them anew."""

STRIDE = 1000
"""Events before the shown one at which the folded state is kept for further steps back."""

LOGGED = {
    *("Started", "Recovered", "Finished", "Left", "Failed", "GoalDone", "Retried"),
    *("PreemptRequested", "PreemptServiced", "Abandoned"),
    *("QuestionAsked", "QuestionAnswered", "ResourceUse"),
}


class MissionApp(App[None]):
    """Shows one machine at a time.

    Args:
        machines: The machines.
        send: Sends a command to a machine; None disables commands.
    """

    TITLE = "smachpy"
    CSS = """
    #status { height: 1; background: $panel; padding: 0 1; }
    #preempt { height: auto; max-height: 6; background: $warning 20%; padding: 0 1; }
    #question { height: auto; max-height: 9; border: round $accent; padding: 0 1; }
    #left { width: 45%; } Tree { height: 1fr; } #search { display: none; dock: bottom; }
    #goals { height: auto; max-height: 9; padding: 0 1; } DataTable { height: 1fr; }
    RichLog { height: 1fr; border-top: solid $panel; }
    .-narrow Horizontal { layout: vertical; } .-narrow #left { width: 1fr; height: 40%; }
    .-narrow #userdata { height: auto; max-height: 5; }
    """
    HORIZONTAL_BREAKPOINTS = [  # noqa: RUF012  textual does not declare it as a class variable
        (0, "-narrow"),
        (NARROW, "-wide"),
    ]
    BINDINGS: ClassVar = [
        # All of them fit into 80 columns.
        ("q", "quit", "Quit"),
        ("n", "next", "Next"),
        ("o", "follow", "Follow"),
        ("slash", "search", "Find"),
        Binding("space", "pause", "Pause", priority=True),  # otherwise the tree would take it
        ("s", "step", "Step"),
        ("comma", "go_by(-1)", "Back"),
        ("full_stop", "go_by(1)", "On"),
        ("l", "live", "Now"),
        Binding("escape", "leave", "Leave", show=False),
    ]

    def __init__(
        self,
        machines: Machines,
        send: Callable[[str, dict[str, Any]], dict[str, Any]] | None,
    ) -> None:
        super().__init__()
        self._machines = machines
        self._send = send
        self._machine: Machine | None = None
        self._cleanups: tuple[str, ...] = ()
        self._shown: tuple[str, int] = ("", 0)  # epoch and revision of the machine in the tree
        self._seq = 0  # number of the newest event in `_state`
        self._until: int | None = None  # while looking back: number of the event that is shown
        # Number of an earlier event and the state after it as JSON: a step back folds from there.
        self._mark = 0, ""
        self._state = RunState()
        self._places: dict[str, TreeNode[StateRecord]] = {}  # by path
        self._targets: dict[tuple[str, str], str] = {}  # by path and outcome
        self._follow = True
        self._rung: set[str] = set()  # services of the questions for which the bell has rung

    def compose(self) -> ComposeResult:
        """Create the widgets."""
        yield Static(id="status")
        yield Static(id="preempt")
        yield Static(id="question")
        with Horizontal():
            with Vertical(id="left"):
                yield Tree[Any]("no machine yet", id="tree")
                yield Input(placeholder="search", id="search")
            with Vertical():
                yield Static(id="goals")
                yield DataTable(id="userdata", cursor_type="row")
                yield RichLog(id="log", max_lines=LOGGED_LINES, wrap=True, min_width=20)
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Begin with the updates."""
        self.query_one(DataTable).add_columns("key", "value", "written by")
        self.set_interval(FRAME_S, self.refresh_view)

    def on_resize(self) -> None:
        """Write the log again: it keeps lines wrapped for the old width."""
        self.call_after_refresh(self._rewrap)

    def _rewrap(self) -> None:
        if self._machine is not None and self.query(RichLog):
            events = [e for e in self._machine.events() if e["seq"] <= self._seq]
            self._rewrite(events, LOGGED_LINES if self._until is None else LOGGED_BACK)

    def refresh_view(self) -> None:
        """Draw the changes since the last update."""
        if not self.query("#status"):  # at the end, widgets are removed before the timer
            return
        # Called by a timer: what has changed is folded and drawn here, in textual's thread.
        machine = self._machine or self._machines.first()
        self._machine = machine
        if machine is None or machine.record is None:
            self.query_one("#status", Static).update("waiting for a machine on the network")
            return
        if self._shown != (machine.epoch, machine.revision):
            self._begin(machine, machine.record)
        self._catch_up(machine)
        self._draw_status(machine)
        events = list(machine.events())
        ended = (machine.stale is not None or machine.recorded) and events
        if self._until is not None:
            events = [event for event in events if event["seq"] <= self._until]
            ended = events
        # Durations end with the newest event if nothing can follow; else at the machine's time now.
        now = events[-1]["stamp_ns"] if ended else time.time_ns() - (machine.behind or 0)
        self._draw_preempt(now)
        self._draw_question(machine, now)
        self._draw_tree(now)
        self._draw_goals()

    def _begin(self, machine: Machine, record: StateRecord) -> None:
        self._shown = (machine.epoch, machine.revision)
        self._until, self._mark = None, (0, "")
        tree = self.query_one(Tree)
        tree.reset(_clean(shorten(record.label)), record)
        self._places = {record.path: tree.root}
        self._cleanups = cleanups(record)
        self._targets = {
            (f"{state.path}/{edge.source}", edge.outcome): edge.target
            for state in record.walk()
            for edge in state.transitions
            if not edge.target_is_outcome
        }
        self._grow(tree.root, record)
        tree.root.expand()
        self._refold(machine)

    def _refold(self, machine: Machine) -> None:
        """Fold all events of the machine from the beginning."""
        base, kept = machine.history()
        events = list(kept)
        self._state, self._seq = RunState(base), 0
        self._mark = 0, ""
        self._fold(events)
        self._draw_userdata()
        self._rewrite(events, LOGGED_LINES)

    def _look_back(self, machine: Machine, until: int) -> None:
        """Show the state after event `until`; fold from the mark if it is before that event."""
        base, kept = machine.history()
        events = [event for event in kept if event["seq"] <= until]
        number, text = self._mark
        at = sum(event["seq"] <= number for event in events)
        if at and events[at - 1]["seq"] == number:
            self._state = RunState(json.loads(text))
        else:  # set a new mark STRIDE events before: the next steps back fold only up to STRIDE
            at = max(0, len(events) - STRIDE)
            self._state = RunState(base)
            self._fold(events[:at])
            if at:
                self._mark = self._seq, json.dumps(self._state.data)
        self._fold(events[at:])
        self._seq = until
        self._draw_userdata()
        self._rewrite(events, LOGGED_BACK)

    def _grow(self, node: TreeNode[Any], record: StateRecord) -> None:
        for child in record.children:
            add = node.add if child.children else node.add_leaf
            self._places[child.path] = added = add(_clean(shorten(child.label)), child)
            self._grow(added, child)

    def _catch_up(self, machine: Machine) -> None:
        if self._until is not None:
            return
        texts = machine.since(self._seq)
        if texts is None:  # some are no longer kept, or the machine was reset
            self._refold(machine)
        else:
            self._add([json.loads(text) for text in texts])

    def _fold(self, events: list[dict[str, Any]]) -> bool:
        """Fold events; return whether userdata was written."""
        for event in events:
            self._state.fold(event)
            self._seq = event["seq"]
        return any(event["kind"] == "UserdataWritten" for event in events)

    def _add(self, events: list[dict[str, Any]]) -> None:
        """Fold and show the next events."""
        if self._fold(events):
            self._draw_userdata()
        self._write(events, LOGGED_LINES)

    def _write(self, events: list[dict[str, Any]], most: int) -> None:
        log = self.query_one(RichLog)
        for event in [one for one in events if one["kind"] in LOGGED][-most:]:
            target = self._targets.get((event["path"], event.get("outcome") or ""), "")
            log.write(_clean(_line(event, target if event["kind"] == "Left" else "")))

    def _rewrite(self, events: list[dict[str, Any]], most: int) -> None:
        self.query_one(RichLog).clear()
        self._write(events, most)

    def _draw_userdata(self) -> None:
        table = self.query_one(DataTable)
        table.clear()
        written = self._state.data["userdata"]
        entries = [written[name] for name in sorted(written)]
        for entry in entries[:MAX_VALUES]:
            words = (
                shorten(entry["key"]),
                shorten(brief(entry["value"]), 34),
                _name(entry["writer"]),
            )
            table.add_row(*map(_clean, words))
        if len(entries) > MAX_VALUES:
            table.add_row(Text(f"and {len(entries) - MAX_VALUES} more", "dim"))

    def _draw_status(self, machine: Machine) -> None:
        data = self._state.data
        if self._until is not None:
            word, style = f"event {self._until} of {machine.seq}", STYLES["preempted"]
        elif machine.stale is not None and data["ended"] is None:
            word, style = "stale", WAITING
        elif data["ended"] is not None:
            word, style = f"ended: {data['outcome']}", STYLES[outcome_class(data["outcome"])]
        elif machine.control and machine.control["paused"]:
            word, style = "paused", WAITING
        elif self._state.holding_up():
            word, style = "preempting", STYLES["preempted"]
        elif any(tidies(path, self._cleanups) for path in self._state.active()):
            word, style = "tidying up", RUNNING
        else:
            word, style = "running", RUNNING
        active = self._state.active()
        leaf = next(reversed(innermost(active)), "")
        trail = " \u203a ".join(shorten(name, 24) for name in leaf.strip("/").split("/"))
        text = Text.assemble(
            (f" {machine.name} ", "bold"), (f" {word} ", f"{style} reverse"), f"  {trail}"
        )
        if lost := data.get("dropped"):
            text.append(f"  {lost} events missing", STYLES["preempted"])
        self.query_one("#status", Static).update(_clean(text))

    def _draw_preempt(self, now: int) -> None:
        """Draw who requested the running preempt, and which states it waits for."""
        widget = self.query_one("#preempt", Static)
        states = self._state.data["states"]
        holds = self._state.holding_up()
        widget.display = bool(holds)
        if not holds:
            return
        # A request passes from a container to the states inside: the first one has its origin.
        first = min((states[p] for p in states if _asked(states[p])), key=lambda s: s["preempt"])
        lines = Text.assemble(
            ("preempt", f"bold {STYLES['preempted']}"),
            (f" by {_asker(first['asked'])}", STYLES["preempted"]),
            (f", {(now - first['preempt']) / 1e9:.1f} s ago", "dim"),
        )
        for path in holds[:4]:
            state = states[path]
            grace = (state["asked"] or {}).get("grace")
            lines.append(f"\n\u25a0 {shorten(path.rpartition('/')[2])}", "bold")
            lines.append(f" holds it up for {(now - state['preempt']) / 1e9:.1f} s")
            lines.append("" if grace is None else f" of {grace:g} s", "dim")
            lines.append(", cleaning up" if state["serviced"] else "", "dim")
        widget.update(_clean(lines))

    def _question(self) -> tuple[str, dict[str, Any]] | None:
        """Path and question of the oldest unanswered question."""
        return next(iter(self._state.questions().items()), None)

    def _draw_question(self, machine: Machine, now: int) -> None:
        """Draw the question, the answers with their keys, and the time left."""
        widget = self.query_one("#question", Static)
        # Nobody waits for an answer in a recording, or when the program is gone.
        found = None if machine.recorded or machine.stale is not None else self._question()
        widget.display = found is not None
        if found is None:
            return
        path, question = found
        if question["service"] not in self._rung:  # each question has a service of its own
            self._rung.add(question["service"])
            self.bell()
        left = max(0.0, question["patience"] - (now - question["asked"]) / 1e9)
        lines = Text.assemble(
            ("? ", f"bold {WAITING}"),
            (shorten(question["text"], 300), "bold"),
            (f"  {_name(path)}", "dim"),
        )
        pairs = zip(question["answers"], question["words"], strict=False)
        for number, (answer, words) in enumerate(pairs, 1):
            lines.append(f"\n {number} ", "reverse")
            lines.append(f" {shorten(words or answer, 60)}")
        lines.append(f"\nno answer in {left:.0f} s means {shorten(question['default'], 40)}", "dim")
        widget.update(_clean(lines))

    def _draw_tree(self, now: int) -> None:
        for path, node in self._places.items():
            if node.data is None:
                continue
            state = self._state.data["states"].get(path)
            label = _label(node.data, state, now, tidies=path in self._cleanups)
            node.set_label(_clean(label))
            if self._follow and state and state["since"] and node.data.children:
                node.expand()

    def _draw_goals(self) -> None:
        lines = Text()
        goals = list(self._state.data["goals"].values())
        written = self._state.data["userdata"].values()
        goals.sort(key=lambda goal: goal["ended"] is None)  # running ones last: those are shown
        name, bar = (20, BAR) if self.size.width >= WIDE else (14, BAR // 3)
        if len(goals) > MAX_GOALS and (hidden := _running(goals[:-MAX_GOALS])):
            lines.append(f"{hidden} more under way\n", "dim")
        for goal in goals[-MAX_GOALS:]:
            progress = goal.get("progress") or {}
            part = 1.0 if goal["status"] == "SUCCEEDED" else progress.get("fraction") or 0.0
            filled = round(part * bar)
            style = RUNNING if goal["ended"] is None else STYLES[outcome_class(goal["status"])]
            lines.append(f"{shorten(goal['action'], name):{name}} ", "bold")
            lines.append("\u2501" * filled, style)
            lines.append("\u2501" * (bar - filled), "dim")
            words = goal["text"] or progress.get("text") or ""
            where = destination(goal["goal"], [one["value"] for one in written])
            left = progress.get("distance")
            told = [
                f"\u2192 {where}" if where else "",
                "" if left is None else f"{left:.1f} m left",
            ]
            told += ["" if goal["ended"] is None else goal["status"].lower(), shorten(words, 40)]
            lines.append(f" {part:4.0%} {' '.join(filter(None, told))}\n")
        widget = self.query_one("#goals", Static)
        widget.display = bool(lines)
        widget.update(_clean(lines))

    # -- keys ----------------------------------------------------------------------------------

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave the space bar to the search field while it has the focus."""
        del parameters
        return not (action == "pause" and self.query_one("#search", Input).has_focus)

    def action_next(self) -> None:
        """Show the next machine."""
        names = [one["name"] for one in self._machines.summaries()]
        if names and self._machine is not None:
            # The one that is shown may be an earlier run that is no longer kept.
            here = names.index(self._machine.name) if self._machine.name in names else -1
            self._machine = self._machines.get(names[(here + 1) % len(names)])

    def action_go_by(self, step: int) -> None:
        """Show the instant one event back or forward."""
        machine = self._machine
        if machine is None or machine.record is None:
            return
        here = self._seq if self._until is None else self._until
        events = list(machine.events())
        numbers = [event["seq"] for event in events]
        # The neighbour by number, as numbers have gaps where events were dropped.
        to = (
            [n for n in numbers if n < here][-1:]
            if step < 0
            else [n for n in numbers if n > here][:1]
        )
        if not to:
            return
        self._until = None if to[0] == numbers[-1] else to[0]  # the newest event is live again
        if self._until is None:
            self._refold(machine)
        elif step > 0 and machine.since(here) is not None:
            self._add([events[numbers.index(to[0])]])
        else:
            self._look_back(machine, to[0])

    def action_live(self) -> None:
        """Return to the present."""
        if self._machine is not None and self._until is not None:
            self._until = None
            self._refold(self._machine)

    def action_follow(self) -> None:
        """Switch opening of running containers on or off."""
        self._follow = not self._follow

    def action_search(self) -> None:
        """Show the search field."""
        search = self.query_one("#search", Input)
        search.display = True
        search.focus()

    def action_leave(self) -> None:
        """Hide the search field."""
        self.query_one("#search", Input).display = False
        self.query_one(Tree).focus()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Go to the first state whose name contains the text."""
        wanted = event.value.lower()
        for path, node in self._places.items():
            if wanted and wanted in path.rpartition("/")[2].lower():
                # Scroll after the refresh: only then do the opened rows have their places.
                above = node.parent
                while above is not None:
                    above.expand()
                    above = above.parent
                self.call_after_refresh(self.query_one(Tree).move_cursor, node)
                break
        self.action_leave()

    def action_pause(self) -> None:
        """Pause or resume the machine."""
        machine = self._machine
        if machine is not None:
            paused = bool(machine.control and machine.control["paused"])
            self._command(machine.name, "resume" if paused else "pause")

    def action_step(self) -> None:
        """Run one state of a paused machine."""
        if self._machine is not None:
            self._command(self._machine.name, "step")

    async def on_key(self, event: events.Key) -> None:
        """Answer the question by the number of an answer, unless the search field has the focus."""
        found = self._question()
        machine = self._machine
        if found is None or machine is None or self.query_one("#search", Input).has_focus:
            return
        path, question = found
        number = int(event.key) if event.key.isdecimal() else 0
        if self._until is None and 1 <= number <= len(question["answers"]):
            self._command(machine.name, "answer", path=path, answer=question["answers"][number - 1])

    # In a thread: the answer can take seconds, in which the view must stay alive.
    @work(thread=True)
    def _command(self, name: str, command: str, **more: str) -> None:
        if self._send is None:
            self.call_from_thread(self._say, "this viewer sends no commands; try --control")
            return
        try:
            answer = self._send(name, {"command": command, "by": f"terminal of {_user()}", **more})
            text = answer["text"] or f"{command}: done"
        except SmachError as error:
            text = str(error)
        self.call_from_thread(self._say, text)

    def _say(self, text: str) -> None:
        self.notify(_clean(text).plain, markup=False)


def _user() -> str:
    import getpass
    import socket

    try:
        return f"{getpass.getuser()}@{socket.gethostname()}"
    except (KeyError, OSError):  # a user without a name, in a container
        return socket.gethostname()


def _clean(text: Text | str) -> Text:
    """Return a text without control characters; each widget shows such texts only."""
    made = Text(text) if isinstance(text, str) else text
    made.plain = visible(made.plain)
    return made


def _name(path: str) -> str:
    return shorten(path.rpartition("/")[2])


def _running(goals: list[dict[str, Any]]) -> int:
    return sum(goal["ended"] is None for goal in goals)


def _asked(state: dict[str, Any]) -> bool:
    return state["since"] is not None and bool(state.get("preempt"))


def _asker(asked: dict[str, Any] | None) -> str:
    """The origin of a preempt as a phrase; recordings of older versions have none."""
    if not asked or not asked.get("source"):
        return "someone"
    return asker_text(asked["source"], asked["by"], asked["why"])


def _label(
    record: StateRecord, state: dict[str, Any] | None, now: int, *, tidies: bool = False
) -> Text:
    glyph = GLYPHS.get(record.kind, "\u00b7" if not record.children else "")
    name = f"{glyph} {shorten(record.label)}".strip()
    if state is None:
        return Text(name, "dim")
    if state["since"] is not None:
        style = f"bold {STYLES['preempted']}" if state.get("preempt") else f"bold {RUNNING}"
        texts = filter(None, (state.get("resource"), state.get("note")))
        note = "".join(f" {shorten(text, 40)}" for text in texts)
        tidy = ", tidying up" if tidies else ""
        text = Text.assemble(
            (name, style), tidy, note, (f"  {(now - state['since']) / 1e9:.1f} s", "dim")
        )
        if not state.get("preempt"):
            return text
        word = "preempt serviced" if state.get("serviced") else "asked to stop"
        return text.append(f"  {word}", STYLES["preempted"])
    text = Text(name)
    if state["outcome"]:
        text.append(f"  {shorten(state['outcome'], 20)}", STYLES[outcome_class(state["outcome"])])
    return text.append(f" x{state['visits']}", "dim") if state["visits"] > 1 else text


def _line(event: dict[str, Any], target: str) -> Text:
    words = event.get("outcome") or event.get("error") or event.get("status") or event["kind"]
    style = STYLES[outcome_class(str(words))]
    if event["kind"] == "PreemptRequested":
        words, style = f"asked to stop by {_asker(event)}", STYLES["preempted"]
    if event["kind"] == "QuestionAsked":
        words, style = f"asks {event['text']}", WAITING
    if event["kind"] == "ResourceUse":
        words = resource_text(event["status"], event["resource"], event["holder"])
    if event["kind"] == "QuestionAnswered":
        words, style = answered_text(event["answer"], event["by"]), WAITING
    if event["kind"] == "Recovered":
        words = recovered_text(event["outages"])
    words = {
        "PreemptServiced": "preempt serviced",
        "Abandoned": "abandoned",
        "Started": "started",
    }.get(str(words), words)
    clock = time.strftime("%H:%M:%S", time.localtime(event["stamp_ns"] / 1e9))
    name = shorten(event["path"].rpartition("/")[2])
    return Text.assemble(
        (f"{clock}  ", "dim"),
        (name, "bold"),
        "  ",
        (shorten(str(words), 80), style),
        f" \u2192 {shorten(target)}" if target else "",
    )
