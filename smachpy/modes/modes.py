"""The machine of modes."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.base.functions import name_of as name_of_code
from smachpy.base.problems import Problems, unknown_name
from smachpy.engine.child import run_child
from smachpy.engine.preempt import ask, asking, choose
from smachpy.engine.visit import Override, Why
from smachpy.events import Jumped
from smachpy.events.introspection import TransitionRecord
from smachpy.exceptions import error_text
from smachpy.machines.container import Container, control_of
from smachpy.machines.guards import when
from smachpy.machines.history import forget, places, remember
from smachpy.machines.state import State, get_options, set_options
from smachpy.machines.state_machine import StateMachine
from smachpy.modes.sources import Signal
from smachpy.modes.table import ModesError, Table, name_of, rows_of, states_of
from smachpy.userdata.user_data import data_of

if TYPE_CHECKING:
    import signal
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from typing import Self, Unpack

    from smachpy.engine.frame import Frame
    from smachpy.engine.step import Plan, Step
    from smachpy.events.introspection import Kind, Structure
    from smachpy.machines.container import ModeEvent
    from smachpy.machines.state import StateOptions
    from smachpy.modes.sources import Source
    from smachpy.modes.table import Way

RAISED = "error"
"""The outcome of a mission that has raised, in `Modes`; and the event."""
STOP = "emergency stop"
"""What leads to the emergency mode, in pictures."""


class Waiting(State):
    """A mode without a mission: it waits for an event. The events are its outcomes."""

    def __init__(self, events: Iterable[str]) -> None:
        super().__init__([*events, "preempted"])

    def execute(self, ud: Any) -> str:  # noqa: ARG002  it reads nothing
        """Wait for ever, or until something asks it to stop."""
        self.wait_preempt()
        return "preempted"


class Modes(StateMachine):
    """A machine whose states are the modes of a robot, and events lead from one to another.

    A mode with a mission runs it. An event that leads elsewhere preempts the mission, waits for its
    clean-up, and only then begins the next mode: two missions never run at once. A mission that
    ends triggers the event of its outcome; without one the first mode follows.

    It is an ordinary machine: served, drawn, recorded, controlled and tested like one. It ends when
    it is preempted, as by Ctrl-C.

    Args:
        states: The modes, as for the package `transitions`: names, or dicts with `name`, `mission`
            (a machine, a function that returns one, or a mission file), `resume` (the mission goes
            on where it was when the mode is entered again), `children` and `initial`.
        transitions: Dicts with `trigger`, `source` (a mode, a list, or "*"), `dest` and maybe
            `when`, a condition on the userdata; or such lists. "*" does not mean `emergency`.
        initial: The first mode; by default the first of `states`.
        emergency: The mode of an emergency stop; see `emergency_stop`.
        listen: Sources of events: `on_topic`, `on_service`, `on_signal`.
        name: Its name.
        userdata: As for `StateMachine`.
        **options: See `StateOptions`.

    Raises:
        ModesError: the table is wrong; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "machine"

    def __init__(
        self,
        states: Iterable[Any],
        transitions: Iterable[Any],
        *,
        initial: str | None = None,
        emergency: str | None = None,
        listen: Iterable[Source] = (),
        name: str = "MODES",
        userdata: Mapping[str, Any] | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        super().__init__(["preempted"], name=name, userdata=userdata, **options)
        table = self.__table = Table(states, transitions, initial, emergency)
        self.__listen = tuple(listen)
        _check_sources(self.__listen, {event for _, event in table.ways})
        self.__emergency = emergency
        self.__frame: Frame | None = None  # of the run whose events are taken
        self.__mode = table.initial
        self.__wanted = ""
        if emergency is not None and emergency not in table.modes:
            raise ModesError([f"emergency: got {emergency!r}; expected one of {[*table.modes]}."])
        for mode in table.modes.values():
            self.__add(mode.name, mode.mission)
        self._smachpy.initial = table.initial
        control_of(self)  # a stop must find what is about to start: see `run.careful` below

    @classmethod
    def from_machine(
        cls, machine: Any, missions: Mapping[str, Any] | None = None, **options: Any
    ) -> Self:
        """Return modes with the table of a machine of the package `transitions`.

        Args:
            machine: The machine, nested or not. Its callbacks and internal transitions are not
                used, nor the events `to_MODE` that `transitions` adds.
            missions: Mode -> mission; a mode in a mode is "manual_slow".
            **options: Those of `Modes`.

        Raises:
            ModesError: it has conditions, or a mode is unknown.
        """
        if not hasattr(machine, "states") or not hasattr(machine, "events"):
            problem = f"machine: got {machine!r}; expected one of the package 'transitions'."
            raise ModesError([problem])
        given, known = missions or {}, list[str]()
        states = states_of(machine, given, known)
        unknown = [name for name in given if name not in known]
        if unknown:
            raise ModesError([f"missions: got {unknown}; expected some of {known}."])
        rows = list(rows_of(machine, known))
        if isinstance(machine.initial, str):
            options.setdefault("initial", name_of(machine, machine.initial))
        return cls(states, rows, **options)

    def __add(self, name: str, mission: Any) -> None:
        events = self.__table.events(name)
        if mission is None:
            lasts = {event: self.__table.ways[name, event][-1].target for event in events}
            self.add(name, Waiting(events), lasts)
            return
        state = _mission(name, mission)
        own = get_options(state).on_exception  # its own come first, and may be for some errors only
        if Exception not in own:
            set_options(state, on_exception={**own, Exception: RAISED})
        ways: dict[str, Any] = {}
        for outcome in state.get_registered_outcomes():
            if outcome == "preempted":  # of the whole machine, which then ends
                continue
            there = self.__table.ways.get((name, outcome), ())
            last = there[-1].target if there and not there[-1].when else None
            cases = [when(_condition(way), way.target) for way in there[: -1 if last else None]]
            target = last or self.__table.initial
            ways[outcome] = [*cases, target] if cases else target
        self.add(name, state, ways)

    # -- events --------------------------------------------------------------------------------

    @property
    def mode(self) -> str:
        """The present mode; the one that an event has chosen counts before it has begun."""
        return self.__emergency or "stopped" if self.control.emergency() else self.__mode

    def trigger(self, event: str, *, by: str = "") -> bool:
        """Trigger an event; return whether it means something in the present mode.

        Args:
            event: The event.
            by: Who triggers it, for viewers and recordings.

        Threads: any, but no signal handler. It does not wait for the mode to change.

        Raises:
            ModesError: no way has such an event.
        """
        table = self.__table
        known = {one for _, one in table.ways}
        if event not in known:
            raise ModesError([unknown_name("trigger: event", event, known)])
        return self.__go(
            lambda mode, values: table.next(mode, event, values), by or f"event {event}"
        )

    def __go(self, choose_mode: Callable[[str, Any], str | None], by: str) -> bool:
        """Leave for the mode that is chosen from the present one; return whether there is one."""
        frame = self.__frame
        if frame is None:
            return False
        values = data_of(self.userdata)
        with asking("program", by):
            written: tuple[Step | None, str, dict[str, str]] | None = None
            while True:
                with frame.run.lock:
                    stop = self.control.emergency()
                    here = self.__emergency if stop else self.__mode
                    target = choose_mode(here, values) if here else None
                    if target is None or self.__frame is not frame:
                        return False
                    step: Step | None = frame.step
                    left = self.__place_of(step, target)
                    if written == (step, target, left):
                        self.__leave_for(frame, step, target)
                        break
                # Written before it has an effect, and outside of the lock: then all is looked at
                # again. A process that is killed between the two does this when it goes on.
                self.__write(frame, step, target, left)
                written = (step, target, left)
            frame.run.flush_soon()
            if stop:
                self.control.end_emergency(stop)
        return True

    @staticmethod
    def __write(frame: Frame, step: Step | None, target: str, left: dict[str, str]) -> None:
        """Write to the journal that `target` follows, and where the present mission is left."""
        if step is not None:
            frame.run.journal.asked_one(frame, step, Override(label=target), left)
            frame.run.journal.commit()

    def __place_of(self, step: Step | None, target: str) -> dict[str, str]:
        """Return where the present mission is if it is to go on there; with the run's lock held."""
        if step is None or not self.__table.modes[step.label].resume or target == step.label:
            return {}
        return places(step.state)

    def __leave_for(self, frame: Frame, step: Step | None, target: str) -> None:
        """Ask the present mode to stop, and begin `target` then; with the run's lock held."""
        self.__mode = self.__wanted = target
        if step is None:
            return
        running = getattr(step.state._smachpy, "live", None)
        if running is not None and running.frame is not None and running.frame.tidying is not None:
            # It has ended, and cleans up: `target` follows, whatever its outcome leads to.
            if frame.visit is not None:
                frame.visit.override = Override(label=target)
            return
        remember(step.state, step.path_in(frame), self.__place_of(step, target))
        ask(frame, step, override=Override(label=target))

    def emergency_stop(self, why: str = "") -> None:
        """Stop everything at once: states are preempted, goals are cancelled, and nothing starts.

        Neither clean-ups nor other modes run before `release`. No event but that of the mode
        `emergency` has an effect. It comes before anything else, as often as it is called.

        Threads: any, but no signal handler. It waits for no state.
        """
        with asking("operator", "", f"emergency stop {why}".strip()):
            self.control.emergency_stop()

    def release(self, target: str | None = None, *, by: str = "") -> bool:
        """Release the emergency stop; return whether there was one.

        Args:
            target: The mode that follows, after the clean-up of the mission that was stopped; None:
                what was stopped begins again.
            by: Who releases it.

        Threads: any, but no signal handler.

        Raises:
            ModesError: there is no such mode.
        """
        if target is not None and target not in self.__table.modes:
            raise ModesError([f"release: got {target!r}; expected one of {[*self.__table.modes]}."])
        stop, frame = self.control.emergency(), self.__frame
        if stop is None:
            return False
        if frame is not None and target is not None:
            with asking("operator", by, "release"):
                with frame.run.lock:
                    left = self.__place_of(frame.step, target)
                self.__write(frame, frame.step, target, left)
                with frame.run.lock:
                    self.__leave_for(frame, frame.step, target)
                frame.run.flush_soon()
        self.control.end_emergency(stop)
        return True

    def __take_events(self, frame: Frame | None, mode: str) -> None:
        """Take the events of a run from now on, or none; what a former run wanted is no more."""
        self.__frame, self.__mode, self.__wanted = frame, mode, ""

    # -- exploration ---------------------------------------------------------------------------

    def _smachpy_events(self, label: str) -> tuple[list[ModeEvent], bool]:
        waits = self.__table.modes[label].mission is None
        # What its own outcomes trigger is explored as such.
        ends = () if waits else self._smachpy.children[label].get_registered_outcomes()

        def ways(mode: str) -> Iterator[tuple[str, str]]:
            for (source, event), ways in self.__table.ways.items():
                for way in ways if source == mode and event not in ends else ():
                    yield f"{event} to {way.target}" if len(ways) > 1 else event, way.target

        def leave_for(target: str) -> Callable[[], object]:
            return lambda: self.__go(lambda *_: target, "exploration")

        found: list[ModeEvent] = [
            (f"event {event}", leave_for(target), None) for event, target in ways(label)
        ]
        if self.__emergency not in {None, label}:
            found += [
                (f"{STOP}, then {event}", self.emergency_stop, leave_for(target))
                for event, target in ways(str(self.__emergency))
            ]
        return found, waits

    def _smachpy_situation(self) -> str:
        return f"{self.mode} {self.__wanted}"

    # -- structure and running -----------------------------------------------------------------

    def describe_structure(self) -> Structure:
        """Return the modes; the edges are the events."""
        structure = super().describe_structure()
        events = [
            TransitionRecord(mode, event, way.target, guard=way.when)
            for (mode, event), ways in self.__table.ways.items()
            for way in ways
        ]
        if self.__emergency:
            events += [
                TransitionRecord(mode, STOP, self.__emergency)
                for mode in self.__table.modes
                if mode != self.__emergency
            ]
        known = {(edge.source, edge.outcome) for edge in events}
        others = [
            edge for edge in structure.transitions if (edge.source, edge.outcome) not in known
        ]
        return replace(structure, transitions=(*events, *others))

    def _smachpy_run_children(self, frame: Frame, plan: Plan) -> str:
        data, journal = self._smachpy, frame.run.journal
        resumed = journal.resumed_label(frame)
        label, data.next_initial = resumed or data.next_initial or data.initial or "", None
        wanted = journal.wanted_label(frame) or ""  # what an event had led to before a resume
        frame.run.watched = frame.run.careful = True
        for state in data.children.values() if resumed is None else ():
            forget(state)  # the last run ended in another mode
        with contextlib.ExitStack() as stack:
            stack.callback(self.__take_events, None, label)
            self.__take_events(frame, label)
            if data.start_cbs:
                self.call_start_cbs()
            for source in self.__listen:
                stack.callback(source.open(self.trigger))
            while True:
                # From here to the end of the visit an event asks this mode; before, it is `wanted`.
                with frame.run.lock:
                    label, self.__wanted, wanted = self.__wanted or label, wanted, ""
                    self.__mode = self.__wanted or label
                    step = plan.steps[label]
                    if frame.visit is not None and frame.visit.step is not step:
                        frame.visit = None  # of a jump to the same mode, before another event
                    choose(frame, step)
                why, target, _ = run_child(frame, step)
                if why is Why.STOPPED and self._preempt_requested:
                    return frame.end_preempted(label)
                if why is Why.JUMPED:
                    frame.emit_own(Jumped, target)
                    label = target
                elif why is Why.STOPPED or target.final:
                    # An operator has ended the mission alone, or it says 'preempted' by itself.
                    if self._preempt_requested:
                        return str(target.outcome)
                    label = data.initial or label
                else:
                    label = target.label
                self.call_transition_cbs()


def _condition(way: Way) -> Callable[[Any], bool]:
    def holds(userdata: Any) -> bool:
        return way.holds(data_of(userdata))

    return holds


def _check_sources(sources: Iterable[Any], events: Iterable[str]) -> None:
    """Check that each source is one, and that its event is in the table.

    Raises:
        ModesError: all problems.
    """
    problems = []
    known = {*events}
    of_signals: dict[signal.Signals, str] = {}
    for source in sources:
        if isinstance(source, Signal):
            first = of_signals.setdefault(source.number, source.event)
            if first != source.event:
                problems.append(
                    f"listen: got {source.number.name} for {first!r} and for {source.event!r}; "
                    "expected one event, with a way from each mode where it means something."
                )
        event = getattr(source, "event", None)  # others may have several
        if not callable(getattr(source, "open", None)):
            expected = "expected on_topic(...), on_service(...) or on_signal(...)"
            problems.append(f"listen: got {source!r}; {expected}.")
        elif isinstance(event, str) and event not in known:
            problems.append(unknown_name("listen: event", event, known))
    if problems:
        raise ModesError(problems)


def _mission(name: str, mission: Any) -> State:
    """Return the machine that a mode runs."""
    if isinstance(mission, (str, Path)):
        from smachpy.files.reading import load

        return load(mission)
    if not isinstance(mission, State) and callable(mission):
        try:
            mission = mission()
        except Exception as error:
            text = f"{name}: mission: got {name_of_code(mission)}, which raised {error_text(error)}"
            raise ModesError([f"{text}; expected a function that returns a machine."]) from error
    problems = Problems(f"Modes: {name}")
    if not isinstance(mission, Container):
        problems.add(f"mission: got {mission!r}; expected a machine, a function, or a file.")
    problems.raise_all()
    return mission  # type: ignore[no-any-return]
