"""The life cycle of a child as a table, and the decision of its container after it.

A visit is one execution of one child, from the moment its container has chosen it until its outcome
has been followed. A root is the child of an invisible top, so it has a visit like any other child.

This module knows no threads, clocks or logs. `smachpy.engine.preempt` keeps the phase of a visit,
applies events to it with the run's lock held, and performs the effects of each row in their order.
The table is drawn in docs/preemption.md.
"""

from __future__ import annotations

from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from smachpy.exceptions import InvalidUserCodeError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from smachpy.engine.options import Options


class Origin(NamedTuple):
    """Who asked first; the fields of `smachpy.events.PreemptRequested`."""

    source: str
    by: str = ""
    why: str = ""


class _Name(Enum):
    """A name that is hashed by identity: `Enum.__hash__` is written in Python, and slower."""

    __hash__ = object.__hash__


class Phase(_Name):
    """The phases of a visit."""

    CHOSEN = "chosen"  # the container will start the child
    CALLED_OFF = "called off"  # asked to stop before it started: it will not be started
    RUNNING = "running"
    ASKED = "asked"  # it has been asked to stop
    OVERDUE = "overdue"  # its grace is over; it was interrupted
    LEFT_BEHIND = "left behind"  # it did not react; its thread runs on without effect
    ENDED = "ended"


class Event(_Name):
    """The events of a visit."""

    ASK = "ask"  # anyone except its own timeout asks it to stop
    TIME_OVER = "time over"  # its own timeout has passed
    START = "start"  # its thread is about to run it
    SERVICE = "service"  # it services the request
    RECALL = "recall"  # it withdraws the request
    GRACE_OVER = "grace over"
    INTERRUPT_AGAIN = "interrupt again"  # still runs, in a thread that cannot be left behind
    LEAVE = "leave"  # still runs, in a thread that can be left behind
    NEXT_ATTEMPT = "next attempt"  # an attempt ended that only its own timeout had asked to stop
    END = "end"  # it returned or raised, or was not started


class Effect(_Name):
    """The effects of an event on a visit."""

    PUBLISH_TIMED_OUT = "publish TimedOut"
    PUBLISH_REQUEST = "publish PreemptRequested"
    TELL = "tell the child"  # sets its flag; a container passes the request on to its children
    CALL_OVERRIDE = "call its own request_preempt"
    ARM_GRACE = "arm grace"
    PUBLISH_SERVICED = "publish PreemptServiced"
    PUBLISH_ABANDONED = "publish Abandoned"
    ARM_PATIENCE = "arm patience"
    INTERRUPT = "interrupt"
    PUBLISH_LEFT = "publish Left"
    CUT_OFF = "cut off"  # from userdata, events and later runs
    CLEAR = "clear"  # cancels timers and interruption, clears the child's flag


class Row(NamedTuple):
    """One line of the table: `event` leads from any of `sources` to `target`."""

    event: Event
    sources: tuple[Phase, ...]
    target: Phase | None  # None: the phase does not change
    effects: tuple[Effect, ...] = ()


def _rows() -> Iterator[Row]:
    p, e, do = Phase, Event, Effect
    over = (p.LEFT_BEHIND, p.ENDED)
    first = (do.PUBLISH_REQUEST, do.TELL, do.CALL_OVERRIDE, do.ARM_GRACE)
    again = (do.PUBLISH_REQUEST, do.TELL)  # a container may be running another child by now

    # A child that never starts is told nothing: its flag would still be set at its next visit.
    yield Row(e.ASK, (p.CHOSEN,), p.CALLED_OFF)
    yield Row(e.ASK, (p.CALLED_OFF,), None)
    yield Row(e.START, (p.CHOSEN,), p.RUNNING)
    yield Row(e.START, (p.CALLED_OFF,), None)

    # A second request starts no new grace: repeated requests must not keep a child running.
    yield Row(e.ASK, (p.RUNNING,), p.ASKED, first)
    yield Row(e.ASK, (p.ASKED, p.OVERDUE), None, again)
    yield Row(e.TIME_OVER, (p.RUNNING,), p.ASKED, (do.PUBLISH_TIMED_OUT, *first))
    yield Row(e.TIME_OVER, (p.ASKED, p.OVERDUE), None, (do.PUBLISH_TIMED_OUT, *again))

    yield Row(e.SERVICE, (p.ASKED, p.OVERDUE), None, (do.PUBLISH_SERVICED,))
    yield Row(e.RECALL, (p.ASKED, p.OVERDUE), p.RUNNING, (do.CLEAR,))
    overdue = (do.PUBLISH_ABANDONED, do.ARM_PATIENCE, do.INTERRUPT)
    yield Row(e.GRACE_OVER, (p.ASKED,), p.OVERDUE, overdue)
    yield Row(e.INTERRUPT_AGAIN, (p.OVERDUE,), None, (do.ARM_PATIENCE, do.INTERRUPT))
    yield Row(e.LEAVE, (p.OVERDUE,), p.LEFT_BEHIND, (do.PUBLISH_LEFT, do.CUT_OFF))

    yield Row(e.NEXT_ATTEMPT, (p.ASKED, p.OVERDUE), p.RUNNING, (do.CLEAR,))
    yield Row(e.END, tuple(x for x in p if x not in over), p.ENDED, (do.CLEAR,))

    # Events that come too late change nothing. A late request to stop is not lost: the run keeps
    # it, and `after` or the next visit acts on it.
    yield Row(e.ASK, over, None)
    yield Row(e.TIME_OVER, over, None)
    yield Row(e.SERVICE, (p.RUNNING, *over), None)
    yield Row(e.RECALL, (p.RUNNING, *over), None)
    yield Row(e.GRACE_OVER, over, None)
    yield Row(e.INTERRUPT_AGAIN, over, None)
    yield Row(e.LEAVE, over, None)
    yield Row(e.NEXT_ATTEMPT, (p.RUNNING, *over), None)
    yield Row(e.START, (p.LEFT_BEHIND,), None)
    yield Row(e.END, over, None)


ROWS: tuple[Row, ...] = tuple(_rows())
"""The table in rows. A pair of phase and event that is not in it cannot occur."""

IS_ASKED = frozenset({Phase.CALLED_OFF, Phase.ASKED, Phase.OVERDUE})
"""The phases of a child that has been asked to stop and has not ended."""

NOT_STARTED = frozenset({Phase.CHOSEN, Phase.CALLED_OFF})
"""The phases of a child that its container has chosen and not started."""

STEPS: Mapping[tuple[Phase, Event], tuple[Phase, tuple[Effect, ...]]] = {
    (source, row.event): (row.target or source, row.effects)
    for row in ROWS
    for source in row.sources
}
"""The same table for look-ups: (phase, event) -> (next phase, effects)."""


# Of every transition. Looking up the member of an enumeration takes as long as a call.
CHOSEN, RUNNING, ENDED = Phase.CHOSEN, Phase.RUNNING, Phase.ENDED


# -- after an attempt, and after the visit -----------------------------------------------------


class Again(NamedTuple):
    """The child runs again after `wait` seconds, because `retry` covers `result`."""

    wait: float
    result: Any


def after_attempt(
    result: Any,
    options: Options,
    attempt: int,
    *,
    asked: bool,
    timed_out: bool,
) -> Any:
    """Decide what follows one attempt at a child with `options`: the first rule that applies.

    1. Only its own timeout asked, and it ended 'preempted' or was interrupted: replace that result
       by `timeout_outcome`, and go on with rule 3.
    2. It was interrupted: raise that.
    3. `retry` covers the result and attempts are left: `Again`; if anyone else asked, 'preempted',
       because the child has not finished and will not go on.
    4. `on_exception` covers the error: the outcome given there.
    5. The outcome, or raise the error.

    Args:
        result: Its outcome, or what it raised; a BaseException that is no Exception interrupted it.
        options: The child's options.
        attempt: Number of this attempt, from 1.
        asked: Anyone except its own timeout has asked it to stop.
        timed_out: Only its own timeout has asked it to stop.

    Returns:
        `Again`, the outcome, or the exception to raise.
    """
    is_interrupted = isinstance(result, BaseException) and not isinstance(result, Exception)
    if timed_out and (is_interrupted or (isinstance(result, str) and result == "preempted")):
        result = options.timeout_outcome
    elif is_interrupted:
        return result
    retry = options.retry
    if isinstance(result, Exception):
        if retry is not None and _applies(partial(retry.wants, attempt), result):
            return "preempted" if asked else Again(retry.wait_s(attempt), result)
        for kind, outcome in options.on_exception.items():
            if _applies(partial(_is_a, kind), result):
                return outcome
    elif retry is not None and retry.wants(attempt, result):
        return "preempted" if asked else Again(retry.wait_s(attempt), result)
    return result


def _applies(wanted: Callable[[BaseException], bool], error: BaseException) -> bool:
    """Return whether `wanted` holds for `error`, or for the errors a container wrapped in it.

    If several children of a concurrence have raised, it must hold for all of them: otherwise an
    unexpected error would disappear beside an expected one. An `ExceptionGroup` that a state has
    raised itself counts as one error.
    """
    if wanted(error):
        return True
    cause = error.__cause__ if isinstance(error, InvalidUserCodeError) else None
    if cause is None:
        return False
    if isinstance(cause, ChildErrors):
        return wanted(cause) or all(_applies(wanted, one) for one in cause.exceptions)
    return _applies(wanted, cause)


class ChildErrors(ExceptionGroup[Exception]):
    """The exceptions of a concurrence's children; a group that one child raised is no such one."""


def _is_a(kind: type[BaseException], error: BaseException) -> bool:
    return isinstance(error, kind)


class Why(Enum):
    """The reason of a decision."""

    FOLLOWED = "the outcome leads there"
    ANSWERED = "the child serviced the run's request, which is spent with it"
    STOPPED = "the run was asked to stop"
    FORCED = "an operator chose the outcome"
    JUMPED = "an operator chose the next child"
    UNKNOWN = "the child has no such outcome"


class End:
    """The container ends with this outcome."""

    __slots__ = ("final", "outcome")

    def __init__(self, outcome: str) -> None:
        self.outcome = outcome
        # A slot is found faster than a class attribute; see `Step`.
        self.final: Literal[True] = True


PREEMPTED = End("preempted")


class Override(NamedTuple):
    """An operator's choice instead of a child's own outcome: another outcome, or a jump.

    Without either, the child's own outcome counts: the operator has stopped it, and no more.

    Attributes:
        outcome: The outcome.
        label: The child to jump to.
        if_stopped: Only if the child has serviced the request: work that it finished counts.
    """

    outcome: str | None = None
    label: str | None = None
    if_stopped: bool = False

    def holds(self, *, answered: bool) -> bool:
        """Return whether it replaces an outcome with which the child `answered` the request."""
        is_choice = self.outcome is not None or self.label is not None
        return is_choice and (answered or not self.if_stopped)


def choice_after(
    earlier: Override | None, later: Override | None, *, asked: bool
) -> Override | None:
    """Return what replaces the outcome of a child that is asked to stop once more.

    Of an operator's choices the last one counts. A pause only adds that the child waits: it
    replaces no choice, and a child that anybody else stops, before it or after it, does not run
    again.

    Args:
        earlier: What replaced it before this request.
        later: The choice of this request; None if it is no operator's.
        asked: Anyone except its own timeout has asked the child before.
    """
    if later is None:
        return None if earlier is not None and earlier.if_stopped else earlier
    return earlier if later.if_stopped and asked else later


class Decision(NamedTuple):
    """Where a container goes after a visit.

    Attributes:
        why: The reason.
        target: `End` or the next `smachpy.engine.step.Step`; with JUMPED the label of the next
            child, with UNKNOWN None; with STOPPED the step that would have followed finished work.
        outcome: The outcome that counts: that of the child, or the one that an operator chose.
    """

    why: Why
    target: Any = None
    outcome: Any = "preempted"


STOPPED = Decision(Why.STOPPED, PREEMPTED)


FOLLOWED = Why.FOLLOWED  # as `CHOSEN` above


def following(outcome: str, target: Any) -> Decision:
    """Return the decision that `outcome` leads to `target`; made once, when a child is compiled."""
    return Decision(FOLLOWED, target, outcome)


def followed(outcome: Any, leads: Mapping[str, Decision]) -> Decision:
    """Decide where a container goes after a visit in which nobody was asked to stop."""
    try:
        return leads[outcome]
    except (KeyError, TypeError):  # an outcome need not even be hashable
        return Decision(Why.UNKNOWN, None, outcome)


def after(
    outcome: object,
    leads: Mapping[str, Decision],
    *,
    run_asked: bool,
    answered: bool,
    override: Override | None = None,
) -> Decision:
    """Decide where a container goes after a visit in which it, or its child, was asked to stop.

    The first rule that applies:

    1. The outcome is 'preempted' and has no transition: the container ends 'preempted', unless only
       an operator asked and chose something else.
    2. The run was asked to stop:
       a. the outcome ends the container: it ends so, because finished work counts;
       b. the child serviced the request: go where the outcome leads; the request is spent;
       c. otherwise the container ends 'preempted' and starts no other child.
    3. An operator chose another outcome, or another child: go there. A pause that cancelled the
       child chooses it again, but only if it serviced the request.
    4. Go where the outcome leads.

    Args:
        outcome: The child's outcome.
        leads: Outcome -> where it leads.
        run_asked: The container itself was asked to stop, not only this child.
        answered: The child serviced its request: it ended 'preempted' or said so.
        override: An operator's choice.
    """
    decision = followed(outcome, leads)
    is_preempted = isinstance(outcome, str) and outcome == "preempted"  # an array answers with one
    chosen = None
    if override is not None and not run_asked and override.holds(answered=answered):
        chosen = override
    if decision.why is Why.UNKNOWN and is_preempted and chosen is None:
        return STOPPED
    if run_asked and decision.why is FOLLOWED and not decision.target.final:
        if answered:
            return decision._replace(why=Why.ANSWERED)
        return STOPPED if is_preempted else STOPPED._replace(target=decision.target)
    if chosen is not None:
        if chosen.label is not None:
            return Decision(Why.JUMPED, chosen.label)
        return followed(chosen.outcome, leads)._replace(why=Why.FORCED)
    return decision
