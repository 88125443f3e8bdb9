"""How a container runs a child: the one way, for every container."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from smachpy.base.problems import plain
from smachpy.engine.callback import call_bounded
from smachpy.engine.errors import error_of, user_error
from smachpy.engine.interrupt import Interruption, uninterrupted
from smachpy.engine.preempt import asking, choose, end_visit, forget_visit, request_soon, start
from smachpy.engine.shutdown_check import is_shutdown
from smachpy.engine.stack_text import trace_of
from smachpy.engine.visit import RUNNING, Why
from smachpy.events import Entered, Failed, Left
from smachpy.exceptions import SmachError, error_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.engine.frame import Frame
    from smachpy.engine.step import Step
    from smachpy.engine.visit import Decision
    from smachpy.events import Event

_new = tuple.__new__  # takes half as long as the `__new__` of a NamedTuple


def run_child(frame: Frame, step: Step) -> Decision:
    """Run a child of the container of `frame` in this thread, and decide where that goes.

    A visit of the child begins. The operator may hold it. Unless it has been called off by then,
    the journal and the subscribers learn that it is entered, it is executed with its options, and
    they learn how it ended. Its visit ends, and with it all requests that were meant for it.

    Raises:
        InvalidUserCodeError: the child's code raised; the cause is chained. A branch of a
            concurrence raises the cause itself: its container raises those of all branches.
        InvalidTransitionError: the child has no such outcome.
        Interruption: the thread was left behind.
    """
    run = frame.run
    outcome: Any = "preempted"
    try:
        if run.careful:
            _wait_at_gate(frame, step)
        if start(frame, step):
            outcome = _watched(frame, step) if run.watched else step.execute(step.userdata)
            if type(outcome) is not str and isinstance(outcome, str):
                outcome = plain(outcome)
            if step.choices is not None:
                step.decide(frame, outcome)
    except Interruption:
        if frame.dead:
            raise
        outcome = step.outcome_if_interrupted(outcome)
    except BaseException as error:  # noqa: BLE001  raised below
        uninterrupted(frame, partial(forget_visit, frame))
        step.forget_choices()  # the journal may have raised after the conditions had decided
        raise _as_raised(frame, step, error)  # noqa: B904  it has its cause
    try:
        decision = end_visit(frame, outcome)
    except Interruption:  # injected just before the child ended, which counts
        decision = uninterrupted(frame, partial(end_visit, frame, outcome))
    return decision if step.choices is None else _decided(frame, step, decision)


def _as_raised(frame: Frame, step: Step, error: BaseException) -> BaseException:
    """Return what the container raises if a child has raised `error`."""
    own = error_of(error)
    if own is None:
        return error
    if frame.is_branch or isinstance(own, SmachError):
        return own
    made = user_error(step.path_in(frame), step.state, own)
    made.__cause__ = own
    return made


def _decided(frame: Frame, step: Step, decision: Decision) -> Decision:
    """Return the decision for an outcome with conditions, also for one that an operator chose.

    The visit is over, so a condition that is asked only now has the grace of the container.
    """
    assert step.choices is not None
    choice = step.choices.get(decision.outcome) if isinstance(decision.outcome, str) else None
    step.forget_choices()
    if choice is None or decision.target is not choice or decision.why is Why.STOPPED:
        return decision
    target = call_bounded(frame.container, frame, choice.decide, (frame,))
    return decision._replace(target=target)


def _wait_at_gate(frame: Frame, step: Step) -> None:
    """Ask the operator's control and the program's shutdown check before a child starts.

    Blocks: while the machine is paused, until the child is called off.
    """
    run = frame.run
    choose(frame, step)
    if run.control is not None:
        run.control.pass_gate(frame, step)
        if frame.tidying is not None:
            frame.tidying.begins()
    if run.has_shutdown_check and is_shutdown() and not frame.is_in_cleanup():
        with asking("shutdown", "", "the shutdown check says so"):
            request_soon(frame.container)


def _watched(frame: Frame, step: Step) -> Any:
    """Execute a child; write and publish its begin before, and its end after."""
    run, visit = frame.run, frame.visit
    ended = run.journal.enter(frame, step)
    if ended is not None:
        return ended
    clock, path = run.clock, step.path_in(frame)
    if run.pending:
        run.flush()
    try:
        frame.publish(_new(Entered, (path, clock.now(), clock.time_ns())))
        window = step.watched_userdata(frame) if step.writes else step.userdata
        outcome = run.journal.execute(frame, step, window)
    except Interruption:
        _tell_end(frame, path, Left, "preempted")
        raise
    except BaseException as error:
        _tell_end(frame, path, Failed, error_text(error), trace_of(error))
        raise
    if visit is not None and visit.phase is not RUNNING and visit.has_answered(outcome):
        visit.service()
    if run.pending:
        uninterrupted(frame, run.flush)
    text = outcome if type(outcome) is str else _text_of(outcome)
    try:
        frame.publish(_new(Left, (path, clock.now(), clock.time_ns(), text)))
    except Interruption:  # of a listener: the child has ended, which counts
        if frame.dead:
            raise
    return outcome


def _text_of(outcome: object) -> str:
    """Return the text of an outcome; one that is no string at all is refused right after this."""
    return plain(outcome) if isinstance(outcome, str) else repr(outcome)


def _tell_end(frame: Frame, path: str, kind: Callable[..., Event], *fields: Any) -> None:
    """Publish how a child ended: queued first, as a further interruption may come at any step."""
    frame.note(path, kind, *fields)
    uninterrupted(frame, frame.run.flush)
