"""The operator's control of a running machine: pause, step, breakpoint, jump, force, preempt.

    machine.control.pause()
    machine.control.step()
    machine.control.force_outcome("/PATROL/DRIVE", "succeeded")
    machine.control.resume()

A pause stops the machine before the next state. The states that are running continue, including
their goals (`keep`), or are preempted and run again after the resume (`cancel`). It belongs to one
run: it ends with that, and when the machine is asked to stop. A machine whose control is not used
pays nothing for it.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Literal, TypeAlias

from smachpy.base import log
from smachpy.engine.described import EPOCH, ContainerData, walk
from smachpy.engine.preempt import (
    ask,
    ask_child,
    asking,
    frame_of,
    on_preempt,
    request_soon,
)
from smachpy.engine.visit import Override
from smachpy.events import Paused, Resumed
from smachpy.exceptions import SmachError, did_you_mean, error_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actionlib_core.clock import Event
    from smachpy.engine.described import Child, Parent
    from smachpy.engine.frame import Frame, Run
    from smachpy.engine.preempt import Visit
    from smachpy.engine.step import Step, Timeout

__all__ = ["Control", "ControlError"]

Running: TypeAlias = Literal["keep", "cancel"]


class ControlError(SmachError):
    """A command names a state that is not running or does not exist.

    Try: use one of the paths in `active`.

    Attributes:
        path: The path of the command.
        active: Paths of the states that run.
    """

    def __init__(
        self, path: str, problem: str, active: tuple[str, ...], known: Iterable[str] = ()
    ) -> None:
        self.path = path
        self.active = active
        hint = did_you_mean(path, known or active)
        super().__init__(f"{path}: {problem}; running: {sorted(active)}.{hint}")


class Control:
    """The commands for one machine; made by `Container.control` of the root.

    Threads: a command may come from any thread, and does not wait for the machine.
    """

    def __init__(self, machine: Parent) -> None:
        self._machine = machine
        self._lock = threading.RLock()
        self._paused = False
        self._stop: object | None = None  # the emergency stop that the pause is
        self._steps = 0
        self._breakpoints: set[tuple[str, str | None]] = set()
        self._waiting: dict[str, Event] = {}
        self._run: Run | None = None
        self._listeners: tuple[Callable[[], object], ...] = ()

    def on_change(self, listener: Callable[[], object]) -> Callable[[], None]:
        """Call `listener` after every change of `is_paused()` or `breakpoints()`.

        Returns:
            A function that removes the listener.

        Threads: called in the thread of the change; at a breakpoint that is the machine's own,
            which it blocks: only wake another thread. An exception that it raises is logged.
        """
        with self._lock:
            self._listeners = (*self._listeners, listener)

        def forget() -> None:
            with self._lock:
                self._listeners = tuple(item for item in self._listeners if item is not listener)

        return forget

    # -- commands ------------------------------------------------------------------------------

    def pause(self, *, running: Running = "keep") -> None:
        """Stop the machine before the next state; before a run, before its first state.

        Args:
            running: What happens to the running states and their goals: "keep" lets them end;
                "cancel" preempts them, and those that it stopped run again from their start after
                `resume`. One that finishes its work first is not run again.

        Raises:
            ControlError: `running` is something else.
        """
        if running not in {"keep", "cancel"}:
            problem = f"pause: running: got {running!r}; expected 'keep' or 'cancel'"
            raise ControlError(self._path(), problem, self.active())
        self._watch()
        self._pause()
        if running == "cancel":
            self._cancel("pause")

    def emergency_stop(self) -> None:
        """Stop the machine as `pause(running="cancel")` does, until that pause ends.

        All running states are told before anything is written, as a journal may be slow.
        """
        self._watch()
        self._pause(object())
        self._cancel("emergency stop", written=False)
        if self._run is not None:
            self._run.journal.stopped()

    def emergency(self) -> object | None:
        """Return the emergency stop that holds the machine, another object for each; or None."""
        return self._stop

    def end_emergency(self, stop: object) -> None:
        """End the pause, unless there was another emergency stop after `stop`."""
        if self._end_pause(stop):
            self._note_release()
            self._call_listeners()

    def resume(self) -> None:
        """Continue after a pause."""
        if self._end_pause():
            self._note_release()
            self._call_listeners()

    def _note_release(self) -> None:
        if self._run is not None:
            self._run.journal.released()
            if self._stop is not None:  # there was another emergency stop meanwhile
                self._run.journal.stopped()

    def step(self) -> None:
        """Run one state, then pause again."""
        self._watch()
        with self._lock:
            changed, self._paused = not self._paused, True
            self._steps += 1
        self._wake(1)  # one of several branches
        if changed:
            self._call_listeners()

    def is_paused(self) -> bool:
        """Return whether the machine is paused, or will be before its next state."""
        return self._paused

    def waiting(self) -> tuple[str, ...]:
        """Return the paths of the states before which the machine waits."""
        with self._lock:
            return tuple(self._waiting)

    def add_breakpoint(self, path: str, outcome: str | None = None) -> None:
        """Pause before the state at `path`, or, with `outcome`, after it has ended with that.

        Raises:
            ControlError: the machine has no such state, or the state no such outcome.
        """
        self._check_breakpoint(path, outcome)
        self._watch()
        with self._lock:
            self._breakpoints.add((path, outcome))
        self._call_listeners()

    def remove_breakpoint(self, path: str, outcome: str | None = None) -> None:
        """Remove a breakpoint, if there is one.

        Raises:
            ControlError: there is none, and the machine has no such state, or the state no such
                outcome.
        """
        with self._lock:
            is_known = (path, outcome) in self._breakpoints
            self._breakpoints.discard((path, outcome))
        if not is_known:
            self._check_breakpoint(path, outcome)
        self._call_listeners()

    def _check_breakpoint(self, path: str, outcome: str | None) -> None:
        known = dict(walk(self._machine, self._path()))
        del known[self._path()]  # nothing is before or after the machine itself
        if path not in known:
            raise ControlError(path, "there is no such state", self.active(), known)
        outcomes = known[path]._smachpy.outcomes
        if outcome is not None and outcome not in outcomes:
            raise _no_outcome(path, outcome, outcomes, self.active())

    def breakpoints(self) -> tuple[tuple[str, str | None], ...]:
        """Return the breakpoints as pairs (path, outcome)."""
        with self._lock:
            return tuple(sorted(self._breakpoints, key=str))

    def jump(self, path: str) -> None:
        """Preempt the active child of the state's container, and continue with the state at `path`.

        Raises:
            ControlError: its container is not running, is not a state machine, or has no such
                child.
        """
        above, _, label = path.rpartition("/")
        frame = self._frame_at(above, path)
        is_machine = hasattr(frame.data, "transitions")  # `events` imports no containers
        states = frame.data.others()
        if label not in states or not is_machine or frame.tidying is not None:
            known = sorted(states)
            raise ControlError(path, f"no jump there; children: {known}", self.active())
        with asking("operator", "", f"jump to {path}"):
            self._stop_at(frame, frame.step, path, Override(label=label))

    def force_outcome(self, path: str, outcome: str) -> None:
        """Preempt the active state at `path`; it ends with `outcome`, whatever it returns.

        Raises:
            ControlError: it is not running, or has no such outcome.
        """
        frame, step = self._step_at(path)
        outcomes = step.state._smachpy.outcomes
        if outcome not in outcomes:
            raise _no_outcome(path, outcome, outcomes, self.active())
        with asking("operator", "", f"force {outcome!r} of {path}"):
            self._stop_at(frame, step, path, Override(outcome=outcome))

    def preempt(self, path: str) -> None:
        """Preempt the state or container at `path`; the container above follows its outcome.

        Raises:
            ControlError: it is not running.
        """
        with asking("operator", "", f"preempt of {path}"):
            if path == self._path():
                running = frame_of(self._machine)
                if running is None:  # `request_preempt` would end the next run
                    raise ControlError(path, "it does not run", ())
                request_soon(self._machine, running)
                return
            frame, step = self._step_at(path)
            self._stop_at(frame, step, path, Override())

    def active(self) -> tuple[str, ...]:
        """Return the paths of all running states, containers first."""
        return tuple(f"{frame.path}/{step.label}" for frame, step in self._active())

    # -- called by the machine -----------------------------------------------------------------

    def attach(self, run: Run) -> None:
        """Control a new run."""
        run.control = self
        self._run = run
        if self._paused or self._breakpoints:
            run.watched = run.careful = True
        if self._stop is not None:  # before the run
            run.journal.stopped()

    def detach(self, run: Run) -> None:
        """End the pause of a run that has ended: the next one would wait for somebody else."""
        if self._run is not run:
            return
        self._run = None
        if self._end_pause():
            self._call_listeners()

    def stop(self, run: Run) -> None:
        """End the pause, as the root is asked to stop; with the run's lock held."""
        if self._end_pause():
            run.pending.append(run.journal.released)
            run.pending.append(self._call_listeners)

    def pass_gate(self, frame: Frame, step: Step) -> None:
        """Wait before `step` while the machine is paused.

        Blocks: until a command lets the step run, or a preempt arrives.
        """
        path = f"{frame.path}/{step.label}"
        if self._stop is not None and frame.run.journal.must_return(path):
            return  # it has a goal, perhaps, which it is to cancel
        # A breakpoint pauses the whole machine, not only this branch.
        if (path, None) in self._breakpoints:
            self._pause_at(frame, frame.visit)
            reason = "breakpoint"
        else:
            reason = "step" if self._steps else "pause"
        if not self._paused or self._take_step():
            return
        self._hold(frame, path, reason)

    def hold(
        self, frame: Frame, path: str, reason: str, *, until: Callable[[], bool] | None = None
    ) -> None:
        """Pause, and block the running state at `path` until an operator decides.

        Args:
            frame: Where it runs.
            path: Its path.
            reason: The reason for the event.
            until: Called after `release`; returns whether the state may continue.

        Blocks: as `pass_gate`.
        """
        self._watch()
        self._pause_at(frame, frame.visit)
        if self._paused:
            self._hold(frame, path, reason, until)

    def release(self, path: str) -> None:
        """Wake the state at `path`, if it waits, to check whether it was called off."""
        event = self._waiting.get(path)
        if event is not None:
            event.set()

    def note_outcome(self, frame: Frame, step: Step, outcome: object) -> None:
        """Pause after `step` if there is a breakpoint on this outcome of it."""
        path = f"{frame.path}/{step.label}"
        if isinstance(outcome, str) and (path, outcome) in self._breakpoints:
            self._pause_at(frame, None)

    def _pause(self, stop: object | None = None) -> None:
        changed = self._begin_pause(stop)
        self._watch()  # a run that has begun meanwhile has not seen it
        if changed:
            self._call_listeners()

    def _pause_at(self, frame: Frame, visit: Visit | None) -> None:
        """Pause, unless the container of `frame`, or the child in `visit`, is asked to stop.

        Nothing would start there any more, and what cleans up after the stop would be held.
        """
        with frame.run.lock:  # a request to stop comes before this, or it ends the pause
            is_over = frame.dead or _is_asked(frame, visit)
            changed = not is_over and self._begin_pause()
        if changed:
            self._call_listeners()

    def _begin_pause(self, stop: object | None = None) -> bool:
        """Let what starts next wait; return whether it would not have waited."""
        with self._lock:
            changed, self._paused = not self._paused, True
            self._stop = stop or self._stop
        return changed

    def _cancel(self, why: str, *, written: bool = True) -> None:
        with asking("operator", "", why):
            for frame, step in self._active():
                if step.state._smachpy_is_container:
                    continue
                again = Override(label=step.label, if_stopped=True)
                with frame.run.lock:
                    if written:  # a resumed run asks it again, which runs it again
                        frame.run.journal.asked_one(frame, step, again)
                    ask(frame, step, override=again)
        if self._run is not None:
            if written:
                self._run.journal.commit()
            self._run.flush_soon()

    def _end_pause(self, stop: object | None = None) -> bool:
        """Let all waiting states go on, if `stop` is None or holds them; return whether any did."""
        with self._lock:
            if stop is not None and self._stop is not stop:
                return False
            changed, self._paused, self._stop = self._paused, False, None
            self._steps = 0
        self._wake()
        return changed  # the listeners are called without any lock

    def _call_listeners(self) -> None:
        for listener in self._listeners:
            try:
                listener()
            except Exception as error:  # noqa: BLE001  the user's: logged, the machine goes on
                log.log_exception(f"{self._path()}: on_change raised {error_text(error)}", error)

    def _wake(self, most: int | None = None) -> None:
        """Wake the states that wait, or the first `most` of them, to check how they go on."""
        with self._lock:
            waiting = list(self._waiting.values())[:most]
        for event in waiting:
            event.set()

    def _take_step(self) -> bool:
        with self._lock:
            if self._steps == 0:
                return False
            self._steps -= 1
            return True

    def _hold(
        self, frame: Frame, path: str, reason: str, until: Callable[[], bool] | None = None
    ) -> None:
        event = frame.run.clock.event(f"control of {path}")
        with self._lock:
            self._waiting[path] = event
        # Registered before the first look at the flags below: a preempt sets the event.
        forget = on_preempt(frame.container, event.set)
        frame.emit(Paused, reason)
        halted = list(_timeouts_above(frame))
        for timeout in halted:
            timeout.halt()
        try:
            # Its own has not begun here, but in the journal: a resumed run reads it there.
            frame.run.journal.halted(path)
            while self._paused and not self._take_step():
                # Called off: the caller sees the same flags and does not start the state.
                if _is_asked(frame, frame.visit):
                    return
                if until is not None and until():
                    return
                event.wait()
                event.clear()
        finally:
            for timeout in halted:
                timeout.go_on()
            forget()
            with self._lock:
                self._waiting.pop(path, None)
            frame.run.journal.went_on(path)
            frame.emit(Resumed)

    def _watch(self) -> None:
        live = self._machine._smachpy.live
        frame, root = live.frame, live.root
        if frame is not None and root is None:
            raise ControlError(frame.path, "it is not the root; expected the root's control", ())
        if root is not None:  # also in a hook of the root, or between two attempts of it
            self._run = root.run
            root.run.control = self
        run = self._run
        if run is not None:
            run.watched = run.careful = True
            EPOCH.value = object()  # a loop that runs now must notice the flags

    # -- finding -------------------------------------------------------------------------------

    def _path(self) -> str:
        return f"/{self._machine.name or 'SM_ROOT'}"

    def _active(self) -> list[tuple[Frame, Step]]:
        frame = self._machine._smachpy.live.frame
        return [] if frame is None else list(_walk(frame))

    def _frame_at(self, path: str, wanted: str) -> Frame:
        root = self._machine._smachpy.live.frame
        if root is not None and root.path == path:
            return root
        for frame, step in self._active():
            inner = _inner_frame(step.state)
            if inner is not None and f"{frame.path}/{step.label}" == path:
                return inner
        raise ControlError(wanted, f"its container {path!r} does not run", self.active())

    def _step_at(self, path: str) -> tuple[Frame, Step]:
        for frame, step in self._active():
            if f"{frame.path}/{step.label}" == path:
                return frame, step
        raise ControlError(path, "no state runs there", self.active())

    def _stop_at(self, frame: Frame, step: Step, path: str, override: Override) -> None:
        self._watch()
        if not self._ask(frame, step, override):
            raise ControlError(path, "it has just ended", self.active())
        self._wake()  # the state may wait at the gate; each one checks whether it was called off

    @staticmethod
    def _ask(frame: Frame, step: Step, override: Override) -> bool:
        """Ask a child to stop; return whether it was running."""
        frame.run.journal.asked_one(frame, step, override)
        return ask_child(frame, step, override)


def _no_outcome(
    path: str, outcome: str, outcomes: Iterable[str], active: tuple[str, ...]
) -> ControlError:
    """Return the error for an outcome that the state at `path` does not have."""
    problem = f"no such outcome: got {outcome!r}; expected one of {sorted(outcomes)}"
    return ControlError(path, problem, active)


def _inner_frame(state: Child) -> Frame | None:
    """Return the frame of a running container; None for any other state."""
    data = state._smachpy
    return data.live.frame if isinstance(data, ContainerData) else None


def _is_asked(frame: Frame, visit: Visit | None) -> bool:
    """Return whether the container of `frame`, or its child in `visit`, is asked to stop."""
    return frame.container._preempt_requested or (visit is not None and visit.is_asked())


def _timeouts_above(frame: Frame) -> Iterator[Timeout]:
    """Yield the timeouts of the container of `frame` and of those above it."""
    parent = frame.parent
    while parent is not None:
        if parent.timeout is not None:
            yield parent.timeout
        parent = parent.parent


def _walk(frame: Frame) -> Iterator[tuple[Frame, Step]]:
    """Yield (frame, step) for every running state below `frame`."""
    for branch in frame.running():
        step = branch.step
        if step is None:
            continue
        yield branch, step
        inner = _inner_frame(step.state)
        if inner is not None:
            yield from _walk(inner)
