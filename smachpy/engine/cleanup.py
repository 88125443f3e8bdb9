"""The clean-up of a container: one child that runs at every end of the others.

It runs in the container's frame, after the frame's other children. A request to stop that they have
got does not concern it. A request that comes while it runs does not stop it at once either: it has
its grace first, and is asked only then.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from smachpy.base import log
from smachpy.base.context import current_frame
from smachpy.engine.child import run_child
from smachpy.engine.interrupt import Interruption
from smachpy.engine.preempt import ask, asking, current_origin, grace_of
from smachpy.engine.visit import CHOSEN, Why
from smachpy.exceptions import InvalidUserCodeError, error_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Timer
    from smachpy.engine.frame import Frame
    from smachpy.engine.step import Step
    from smachpy.engine.visit import Origin


class Ending(NamedTuple):
    """How the other children of a container have ended, for the clean-up.

    Attributes:
        outcome: The outcome with which the container will end; None if it will raise.
        error: The text of the exception that it will raise, or "".
        preempted: The container had been asked to stop.
    """

    outcome: str | None
    error: str = ""
    preempted: bool = False


class Tidying:
    """The clean-up of the container of `frame` while it runs.

    Attributes:
        ending: How the other children have ended.
        requested: The container has been asked to stop since the clean-up began.
    """

    def __init__(self, frame: Frame, step: Step, ending: Ending) -> None:
        self._frame = frame
        self._step = step
        self._timer: Timer | None = None
        self._origin: Origin | None = None
        self.ending = ending
        self.requested = False

    def asked(self) -> None:
        """Let the clean-up go on for its grace, and ask it to stop then; with the run's lock held.

        Only the first request counts: repeated ones must not keep it running, or end it sooner.
        """
        if self.requested:
            return
        self.requested = True
        self._origin = current_origin()
        self._start_grace()

    def begins(self) -> None:
        """Give the clean-up its whole grace again: an operator may have held it before."""
        with self._frame.run.lock:
            if self.requested:
                self.end()
                self._start_grace()

    def _start_grace(self) -> None:
        grace = grace_of(self._frame, self._step.state)
        if grace is not None:
            self._timer = self._frame.run.clock.call_later(grace, self._over)

    def _over(self) -> None:
        frame = self._frame
        assert self._origin is not None
        with asking(*self._origin), frame.run.lock:
            visit = frame.visit
            held = frame.run.control is not None and (visit is None or visit.phase is CHOSEN)
            # Called off while an operator holds it, it would never run: see `begins`.
            if frame.tidying is self and not frame.dead and not held:
                ask(frame, self._step)
        frame.run.flush_soon()

    def end(self) -> None:
        """Forget the timer."""
        if self._timer is not None:
            self._timer.cancel()


def run_with_cleanup(frame: Frame, step: Step, run_others: Callable[[], str]) -> str:
    """Run the other children of the container of `frame`, then its clean-up `step`.

    It does not run if the container was asked to stop before it has begun: then nothing has been
    started that needs it. Nor does it after what ends the process, such as a second Ctrl-C, or
    `sys.exit()` in a durable run, whose goals the next process follows.

    Returns:
        The outcome of the others; that of the clean-up, or its exception, is only reported.

    Raises:
        Exception, SystemExit: the others raised it.
        Interruption: the thread was left behind.
    """
    container, journal = frame.container, frame.run.journal
    before_resume = journal.ending(frame)
    failure: Exception | SystemExit | None = None
    outcome = ""
    if before_resume is not None:
        ending = Ending(*before_resume)
        outcome = ending.outcome or ""
        if ending.outcome is None:
            failure = InvalidUserCodeError(ending.error, path=frame.path)
    else:
        if container._preempt_requested and not journal.has_begun(frame.path):
            return run_others()
        try:
            outcome = run_others()
        except Interruption:  # a callback outlasted its grace
            if frame.dead:
                raise
            outcome = "preempted" if frame.answered else frame.end_preempted()
        except (Exception, SystemExit) as error:  # raised below, after the clean-up
            if frame.dead or (journal.is_durable and isinstance(error, SystemExit)):
                raise
            failure = error
        asked = container._preempt_requested or frame.answered
        error_of = "" if failure is None else error_text(failure)
        ending = Ending(None if failure else outcome, error_of, preempted=asked)
    _clean_up(frame, step, ending)
    if failure is not None:
        journal.cleaned_up(frame, step)
        raise failure
    return outcome


def _clean_up(frame: Frame, step: Step, ending: Ending) -> None:
    container, run = frame.container, frame.run
    last, answered = frame.step, frame.answered
    tidying = Tidying(frame, step, ending)
    with run.lock:
        if frame.dead:
            raise Interruption
        asked, container._preempt_requested = container._preempt_requested, False
        frame.tidying = tidying
    try:
        while run_child(frame, step).why is Why.JUMPED:  # after a pause that cancelled it
            pass
    except Exception as error:  # noqa: BLE001  it must not hide how the mission has ended
        path, how = step.path_in(frame), ending.outcome or ending.error
        log.log_exception(f"{path}: clean-up after {how!r} raised {error_text(error)}", error)
    finally:
        tidying.end()
        with run.lock:
            if not frame.dead:
                frame.tidying = None
                container._preempt_requested = asked or tidying.requested
                frame.step, frame.answered = last, answered


def current_ending() -> Ending | None:
    """Return how the machine has ended whose clean-up runs in this context; None in no clean-up."""
    frame: Any = current_frame()
    while frame is not None:
        if frame.tidying is not None:
            ending: Ending = frame.tidying.ending
            return ending
        frame = frame.parent
    return None
