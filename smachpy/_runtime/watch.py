"""The grace after a preempt: wait, break in, leave behind.

Whoever asks a leaf to stop arms a watch for it. When the grace is over, the leaf's path and stack
are reported and it is interrupted. If that does not end it, the task that it runs in is left
behind; in a thread that is not ours to leave (the caller of `execute`), it is interrupted again.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from smachpy import log
from smachpy._runtime.frame import RootFrame
from smachpy._runtime.interrupt import close, interrupt
from smachpy.events import Abandoned, Finished, Left, PreemptServiced

if TYPE_CHECKING:
    from actionlib_core.clock import Timer
    from smachpy._runtime.frame import Frame
    from smachpy._runtime.step import Step

DEFAULT_GRACE_S = 10.0
PATIENCE_S = 0.1  # how long an interrupted state has to unwind before it is left behind
LONGEST_PATIENCE_S = 1.0


class Watch:
    """One leaf that was asked to stop and has not stopped yet."""

    __slots__ = ("_frame", "_grace", "_patience", "_step", "_timer")

    def __init__(self, frame: Frame, step: Step, grace: float) -> None:
        self._frame = frame
        self._step = step
        self._grace = grace
        self._patience = PATIENCE_S
        self._timer: Timer = frame.run.clock.call_later(grace, self._overdue)

    def cancel(self) -> None:
        """Forget it: the leaf has stopped."""
        self._timer.cancel()

    def _is_on(self) -> bool:
        frame = self._frame
        return frame.watch is self and frame.told is self._step and frame.step is self._step

    def _overdue(self) -> None:
        frame = self._frame
        with frame.container._lock:  # noqa: SLF001  one machinery
            if not self._is_on():
                return
            path = frame.here()
            stack = stack_of(frame.thread)
        log.logerr(
            f"{path}: still runs {self._grace:g} s after its preempt; interrupted. It was at:\n"
            f"{stack}"
        )
        clock = frame.run.clock
        frame.publish(Abandoned(path, clock.now(), clock.time_ns(), self._grace, stack))
        with frame.container._lock:  # noqa: SLF001  one machinery
            if self._is_on():
                self._again()
                interrupt(frame)

    def _again(self) -> None:
        self._timer = self._frame.run.clock.call_later(self._patience, self._escalate)

    def _escalate(self) -> None:
        frame = self._frame
        with frame.container._lock:  # noqa: SLF001  one machinery
            if not self._is_on():
                return
            boundary = frame.boundary
            if boundary is None:
                self._patience = min(2 * self._patience, LONGEST_PATIENCE_S)
                self._again()
                interrupt(frame)
                return
            if frame.run.watched:
                frame.find_ears()  # `bury` has some last words for them
            frame.dead = True
        log.logerr(f"{frame.here()}: did not react; its thread is left behind.")
        bury(frame, boundary)
        boundary.abandon()


def arm(frame: Frame, step: Step) -> None:
    """Watch the child that was just told to stop; with the container's lock held."""
    if frame.watch is not None or step.state.is_container:
        return  # watched already, or a container, which watches its own leaves
    grace = grace_of(frame, step)
    if grace is not None:
        frame.watch = Watch(frame, step, grace)


def disarm(frame: Frame) -> None:
    """The child has ended: nothing may break in any more; with the container's lock held."""
    watch, frame.watch = frame.watch, None
    if watch is not None:
        watch.cancel()
    close(frame)
    frame.told = None
    frame.timed_out = False


def has_answered(frame: Frame, outcome: object) -> bool:
    """Tell whether the child that ended with `outcome` took up a preempt it was told of.

    It did if it says 'preempted' or has serviced the request; work that just finished did not.
    Called with the container's lock held, before `disarm`.
    """
    told = frame.told
    if told is None:
        return False
    if outcome == "preempted":
        return True
    state = told.state
    return bool(state._answered if state.is_container else not state.preempt_requested())  # noqa: SLF001


def note_answer(frame: Frame, outcome: object) -> None:
    """Publish that the child, which has just ended with `outcome`, took its preempt up, if so."""
    with frame.container._lock:  # noqa: SLF001  one machinery
        answered = frame.told is frame.step and not frame.serviced and has_answered(frame, outcome)
        if answered:
            frame.serviced = True
    if answered:
        frame.emit(PreemptServiced)


def grace_of(frame: Frame, step: Step) -> float | None:
    """Return the seconds that a child has after a preempt; None for as long as it likes."""
    grace: Any = step.state._grace(inherited_grace(frame))  # noqa: SLF001  one machinery
    if grace == "inherit":
        return DEFAULT_GRACE_S
    return None if grace is None else float(grace)


def inherited_grace(frame: Frame | None) -> Any:
    """Return the `preempt_timeout` of the nearest container that has one, else "inherit"."""
    while frame is not None:
        grace = frame.container.preempt_timeout
        if grace != "inherit":
            return grace
        frame = frame.parent
    return "inherit"


def bury(frame: Frame, boundary: Any) -> None:
    """Cut everything from `frame` up to `boundary` off from later runs.

    The thread that is left behind keeps a dead frame: it can neither go on to another state, nor
    write userdata, nor end a later run, nor publish events: what was active in it has left now.
    """
    above: Frame | None = frame
    while above is not None:
        container = above.container
        step = above.step
        if above.run.watched:
            _publish_end(above, boundary)
        above.dead = True
        above._ears = None  # noqa: SLF001  a dead frame finds none
        if step is not None:
            step.cut_off()
            step.state.recall_preempt()
        with container._lock:  # noqa: SLF001  one machinery
            container._plan = None  # noqa: SLF001
            if container._frame is above:  # noqa: SLF001
                container._frame = None  # noqa: SLF001
                container._preempt_requested = False  # noqa: SLF001
        if above is boundary:
            return
        above = above.parent


def _publish_end(frame: Frame, boundary: Any) -> None:
    """Publish the end of the child that is left behind in `frame`, and of a root with it."""
    clock = frame.run.clock
    now = clock.now(), clock.time_ns()
    last: str = boundary.outcome_left()
    if frame.step is not None:
        outcome = last if frame is boundary else "preempted"
        frame.publish(Left(frame.here(), *now, outcome))
    if isinstance(frame, RootFrame):
        frame.publish(Finished(frame.path, *now, last))


def stack_of(ident: int) -> str:
    """Return where the thread `ident` is, as a traceback prints it."""
    import traceback

    top = sys._current_frames().get(ident)  # noqa: SLF001  the documented way
    return "" if top is None else "".join(traceback.format_stack(top))
