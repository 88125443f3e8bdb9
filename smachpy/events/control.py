"""The operator's control of a running machine: pause, step, breakpoint, jump, force, preempt.

    machine.control.pause()
    machine.control.step()
    machine.control.force_outcome("/PATROL/DRIVE", "succeeded")
    machine.control.resume()

A pause stops the machine before the next state. The states that are running continue, including
their goals (`keep`), or are preempted and run again after the resume (`cancel`). A machine whose
control is not used pays nothing for it.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from smachpy import log
from smachpy.events import Paused, Resumed
from smachpy.exceptions import SmachError, did_you_mean, error_text
from smachpy.run.child import EPOCH, ContainerData
from smachpy.run.grace import ask_child, asking, on_preempt, request_soon
from smachpy.run.visit import Override

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actionlib_core.clock import Event
    from smachpy.machines.container import Container
    from smachpy.machines.state import State
    from smachpy.run.child import Child
    from smachpy.run.frame import Frame, Run
    from smachpy.run.step import Step

__all__ = ["Control", "ControlError"]

Running: TypeAlias = Literal["keep", "cancel"]


class ControlError(SmachError):
    """A command names a state that is not running or does not exist.

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

    def __init__(self, machine: Container) -> None:
        self._machine = machine
        self._lock = threading.RLock()
        self._paused = False
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
        """Stop the machine before the next state.

        Args:
            running: What happens to the running states and their goals: "keep" lets them end;
                "cancel" preempts them, and they run again from their start after `resume`.

        Raises:
            ControlError: `running` is something else.
        """
        if running not in {"keep", "cancel"}:
            problem = f"pause: running: got {running!r}; expected 'keep' or 'cancel'"
            raise ControlError(self._path(), problem, self.active())
        self._watch()
        self._pause()
        if running == "cancel":
            with asking("operator", "", "pause"):
                for frame, step in self._active():
                    if not step.state._smachpy_is_container:
                        ask_child(frame, step, Override(label=step.label))

    def resume(self) -> None:
        """Continue after a pause."""
        with self._lock:
            changed, self._paused = self._paused, False
            self._steps = 0
        self._wake()
        if changed:  # the listeners are called without the lock
            self._call_listeners()

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
        known = dict(_paths(self._machine, self._path()))
        if path not in known:
            raise ControlError(path, "there is no such state", self.active(), known)
        outcomes = known[path]._smachpy.outcomes
        if outcome is not None and outcome not in outcomes:
            raise _no_outcome(path, outcome, outcomes, self.active())
        self._watch()
        with self._lock:
            self._breakpoints.add((path, outcome))
        self._call_listeners()

    def remove_breakpoint(self, path: str, outcome: str | None = None) -> None:
        """Remove a breakpoint."""
        with self._lock:
            self._breakpoints.discard((path, outcome))
        self._call_listeners()

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
        if label not in frame.container.get_children() or not is_machine:
            known = sorted(frame.container.get_children())
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
                request_soon(self._machine)
                return
            frame, step = self._step_at(path)
            self._stop_at(frame, step, path, None)

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

    def pass_gate(self, frame: Frame, step: Step) -> None:
        """Wait before `step` while the machine is paused.

        Blocks: until a command lets the step run, or a preempt arrives.
        """
        path = f"{frame.path}/{step.label}"
        # A breakpoint pauses the whole machine, not only this branch.
        if (path, None) in self._breakpoints:
            self._pause()
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
        self._pause()
        self._hold(frame, path, reason, until)

    def release(self, path: str) -> None:
        """Wake the state at `path`, if it waits, to check whether it was called off."""
        event = self._waiting.get(path)
        if event is not None:
            event.set()

    def note_outcome(self, frame: Frame, step: Step, outcome: object) -> None:
        """Pause after `step` if there is a breakpoint on this outcome of it."""
        if (f"{frame.path}/{step.label}", outcome) in self._breakpoints:
            self._pause()

    def _pause(self) -> None:
        with self._lock:
            changed, self._paused = not self._paused, True
        if changed:
            self._call_listeners()

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
        container = frame.container
        # Registered before the first look at the flags below: a preempt sets the event.
        forget = on_preempt(container, event.set)
        frame.emit(Paused, reason)
        try:
            while self._paused and not self._take_step():
                visit = frame.visit
                # Called off: the caller sees the same flags and does not start the state.
                if container._preempt_requested or (visit is not None and visit.is_asked()):
                    return
                if until is not None and until():
                    return
                event.wait()
                event.clear()
        finally:
            forget()
            with self._lock:
                self._waiting.pop(path, None)
            frame.emit(Resumed)

    def _watch(self) -> None:
        run = self._run
        frame = self._machine._smachpy.frame
        if frame is not None and self._machine._smachpy.root is None:
            raise ControlError(frame.path, "it is not the root; expected the root's control", ())
        if frame is not None:
            run = self._run = frame.run
            run.control = self
        if run is not None:
            run.watched = run.careful = True
            EPOCH.value = object()  # a loop that runs now must notice the flags

    # -- finding -------------------------------------------------------------------------------

    def _path(self) -> str:
        return f"/{self._machine.name or 'SM_ROOT'}"

    def _active(self) -> list[tuple[Frame, Step]]:
        frame = self._machine._smachpy.frame
        return [] if frame is None else list(_walk(frame))

    def _frame_at(self, path: str, wanted: str) -> Frame:
        root = self._machine._smachpy.frame
        if root is not None and root.path == path:
            return root
        for frame, step in self._active():
            inner = _frame_of(step.state)
            if inner is not None and f"{frame.path}/{step.label}" == path:
                return inner
        raise ControlError(wanted, f"its container {path!r} does not run", self.active())

    def _step_at(self, path: str) -> tuple[Frame, Step]:
        for frame, step in self._active():
            if f"{frame.path}/{step.label}" == path:
                return frame, step
        raise ControlError(path, "no state runs there", self.active())

    def _stop_at(self, frame: Frame, step: Step, path: str, override: Override | None) -> None:
        self._watch()
        if frame.run.journal is not None:
            frame.run.journal.asked_one(frame, step, override)
        if not ask_child(frame, step, override):
            raise ControlError(path, "it has just ended", self.active())
        self._wake()  # the state may wait at the gate; each one checks whether it was called off


def _no_outcome(
    path: str, outcome: str, outcomes: Iterable[str], active: tuple[str, ...]
) -> ControlError:
    """Return the error for an outcome that the state at `path` does not have."""
    problem = f"no such outcome: got {outcome!r}; expected one of {sorted(outcomes)}"
    return ControlError(path, problem, active)


def _paths(container: Any, above: str) -> Iterator[tuple[str, State]]:
    """Yield (path, state) for every state in a container."""
    for label, child in container.get_children().items():
        path = f"{above}/{label}"
        yield path, child
        if child._smachpy_is_container:
            yield from _paths(child, path)


def _frame_of(state: Child) -> Frame | None:
    """Return the frame of a running container; None for any other state."""
    data = state._smachpy
    return data.frame if isinstance(data, ContainerData) else None


def _walk(frame: Frame) -> Iterator[tuple[Frame, Step]]:
    """Yield (frame, step) for every running state below `frame`."""
    for branch in frame.running():
        step = branch.step
        if step is None:
            continue
        yield branch, step
        inner = _frame_of(step.state)
        if inner is not None:
            yield from _walk(inner)
