"""The life cycle of a child as a table, and what its container does after it.

A visit is one execution of one child, from the moment its container has chosen it until its outcome
has been followed. A root is the child of an invisible top, so it has a visit like every other.

Nothing here knows threads, clocks or logs. `smachpy.run.grace` holds one visit's state, feeds it
events with the run's lock held, and performs the effects of each row in their order.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from smachpy.run.options import Options


class Origin(NamedTuple):
    """Who asked first, as `smachpy.events.PreemptRequested` tells it."""

    source: str
    by: str = ""
    why: str = ""


class _Name(Enum):
    """A name; hashed as an object, because `Enum.__hash__` is a function in Python."""

    __hash__ = object.__hash__


class Phase(_Name):
    """Where a visit is."""

    CHOSEN = "chosen"  # its container will start it
    CALLED_OFF = "called off"  # its container will not start it
    RUNNING = "running"
    ASKED = "asked"  # somebody wants it to stop
    OVERDUE = "overdue"  # its grace is over; it was interrupted
    LEFT_BEHIND = "left behind"  # it did not react; its thread goes on without effect
    ENDED = "ended"


class Event(_Name):
    """What happens to a visit."""

    ASK = "ask"  # somebody wants it to stop, other than its own timeout
    TIME_OVER = "time over"  # its own timeout has passed
    START = "start"  # its thread is about to run it
    SERVICE = "service"  # it takes the request up
    GRACE_OVER = "grace over"
    INTERRUPT_AGAIN = "interrupt again"  # still runs, in a thread that cannot be left behind
    LEAVE = "leave"  # still runs, in a thread that can be left behind
    NEXT_ATTEMPT = "next attempt"  # an attempt ended that only its own timeout wanted to stop
    END = "end"  # it returned or raised, or was not started


class Effect(_Name):
    """What is done when an event changes a visit."""

    PUBLISH_TIMED_OUT = "publish TimedOut"
    PUBLISH_REQUEST = "publish PreemptRequested"
    TELL = "tell the child"  # sets its flag; a container tells its own children
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
    """One line of the table: an event leads from each of these phases to another."""

    event: Event
    sources: tuple[Phase, ...]
    target: Phase | None  # None: the phase stays
    effects: tuple[Effect, ...] = ()


def _rows() -> Iterator[Row]:
    p, e, do = Phase, Event, Effect
    over = (p.LEFT_BEHIND, p.ENDED)
    first = (do.PUBLISH_REQUEST, do.TELL, do.CALL_OVERRIDE, do.ARM_GRACE)
    again = (do.PUBLISH_REQUEST, do.TELL)  # a container may be running another child by now

    # A child that never starts is told nothing, so it keeps no flag.
    yield Row(e.ASK, (p.CHOSEN,), p.CALLED_OFF)
    yield Row(e.ASK, (p.CALLED_OFF,), None)
    yield Row(e.START, (p.CHOSEN,), p.RUNNING)

    yield Row(e.ASK, (p.RUNNING,), p.ASKED, first)
    yield Row(e.ASK, (p.ASKED, p.OVERDUE), None, again)
    yield Row(e.TIME_OVER, (p.RUNNING,), p.ASKED, (do.PUBLISH_TIMED_OUT, *first))
    yield Row(e.TIME_OVER, (p.ASKED, p.OVERDUE), None, (do.PUBLISH_TIMED_OUT, *again))

    yield Row(e.SERVICE, (p.ASKED, p.OVERDUE), None, (do.PUBLISH_SERVICED,))
    overdue = (do.PUBLISH_ABANDONED, do.ARM_PATIENCE, do.INTERRUPT)
    yield Row(e.GRACE_OVER, (p.ASKED,), p.OVERDUE, overdue)
    yield Row(e.INTERRUPT_AGAIN, (p.OVERDUE,), None, (do.ARM_PATIENCE, do.INTERRUPT))
    yield Row(e.LEAVE, (p.OVERDUE,), p.LEFT_BEHIND, (do.PUBLISH_LEFT, do.CUT_OFF))

    yield Row(e.NEXT_ATTEMPT, (p.ASKED, p.OVERDUE), p.RUNNING, (do.CLEAR,))
    yield Row(e.END, tuple(x for x in p if x not in over), p.ENDED, (do.CLEAR,))

    # What comes too late changes nothing; a request stays with the run.
    yield Row(e.ASK, over, None)
    yield Row(e.TIME_OVER, over, None)
    yield Row(e.SERVICE, (p.RUNNING, *over), None)
    yield Row(e.GRACE_OVER, over, None)
    yield Row(e.INTERRUPT_AGAIN, over, None)
    yield Row(e.LEAVE, over, None)
    yield Row(e.NEXT_ATTEMPT, (p.RUNNING, *over), None)
    yield Row(e.START, (p.LEFT_BEHIND,), None)
    yield Row(e.END, over, None)


ROWS: tuple[Row, ...] = tuple(_rows())
"""The table as it was written; a pair of phase and event that is missing cannot happen."""

IS_ASKED = frozenset({Phase.CALLED_OFF, Phase.ASKED, Phase.OVERDUE})
"""The phases of a child that somebody wants to stop."""

STEPS: Mapping[tuple[Phase, Event], tuple[Phase, tuple[Effect, ...]]] = {
    (source, row.event): (row.target or source, row.effects)
    for row in ROWS
    for source in row.sources
}
"""The table, compiled: (phase, event) -> the phase that follows, and what is done."""


# -- after an attempt, and after the visit -----------------------------------------------------


class Again(NamedTuple):
    """The child runs again, after `wait` seconds, because of `result`."""

    wait: float
    result: Any


def after_attempt(
    result: Any,
    options: Options,
    attempt: int,
    *,
    asked: bool,
    timed_out: bool,
    applies: Callable[[Callable[[BaseException], bool], BaseException], bool],
) -> Any:
    """Decide after one attempt at a child with `options`: the first line that fits.

    1. Only its own timeout asked, and it ended 'preempted' or was interrupted: `timeout_outcome`
       takes the place of that.
    2. It was interrupted: that is passed on.
    3. `retry` wants another attempt, some are left, and nobody asked: `Again`.
    4. `on_exception` names the error: that outcome.
    5. The outcome, or the error.

    Args:
        result: Its outcome, or what it raised; a BaseException that is no Exception interrupted it.
        options: The child's options.
        attempt: Number of this attempt, from 1.
        asked: Somebody asked it to stop, other than its own timeout.
        timed_out: Only its own timeout asked it to stop.
        applies: Whether a condition holds for an error or for what a container made it from.

    Returns:
        `Again`, the outcome, or what is to be raised.
    """
    is_interrupted = isinstance(result, BaseException) and not isinstance(result, Exception)
    if timed_out and (is_interrupted or (isinstance(result, str) and result == "preempted")):
        result = options.timeout_outcome
    elif is_interrupted:
        return result
    retry = None if asked else options.retry
    if isinstance(result, Exception):
        if retry is not None and applies(partial(retry.wants, attempt), result):
            return Again(retry.wait_s(attempt), result)
        for kind, outcome in options.on_exception.items():
            if applies(partial(_is_a, kind), result):
                return outcome
    elif retry is not None and retry.wants(attempt, result):
        return Again(retry.wait_s(attempt), result)
    return result


def _is_a(kind: type[BaseException], error: BaseException) -> bool:
    return isinstance(error, kind)


class Why(Enum):
    """Why a container goes where it goes."""

    FOLLOWED = "the outcome leads there"
    ANSWERED = "the child took the run's request up, which is spent with it"
    STOPPED = "the run was asked to stop"
    FORCED = "an operator chose the outcome"
    JUMPED = "an operator chose the next child"
    UNKNOWN = "the child has no such outcome"


@dataclass(frozen=True, slots=True, eq=False)
class End:
    """The container ends with this outcome."""

    outcome: str
    final: Literal[True] = True  # on the instance, where Python finds it faster


PREEMPTED = End("preempted")


@dataclass(frozen=True, slots=True)
class Override:
    """What an operator wants instead of a child's own outcome: another one, or a jump."""

    outcome: str | None = None
    label: str | None = None


class Decision(NamedTuple):
    """Where a container goes after a visit.

    Attributes:
        why: The reason.
        target: `End`, or the next child's record (`smachpy.run.step.Step`); with JUMPED its label,
            with UNKNOWN None.
    """

    why: Why
    target: Any = None


def after(
    outcome: object,
    targets: Mapping[str, Any],
    *,
    run_asked: bool,
    answered: bool,
    override: Override | None = None,
) -> Decision:
    """Decide where a container goes after a visit that somebody asked to stop.

    The first line that fits:

    1. 'preempted', which is no outcome of the child: the container ends 'preempted' too, unless
       only an operator asked, who wants something else.
    2. The run was asked to stop:
       a. the outcome ends the container: so it does, finished work stands;
       b. the child took the request up: where the outcome leads; the request is spent;
       c. else it ends 'preempted', and nothing more is started.
    3. An operator wants another outcome, or another child.
    4. Where the outcome leads.

    Args:
        outcome: What the child returned.
        targets: Outcome -> `End` or the next child.
        run_asked: The container itself was asked to stop, not only this child.
        answered: The child took its request up: it ended 'preempted', or said so.
        override: What an operator wants.
    """
    target = targets.get(outcome) if isinstance(outcome, str) else None
    if target is None and outcome == "preempted" and (override is None or run_asked):
        return Decision(Why.STOPPED, PREEMPTED)
    if run_asked and target is not None and not target.final:
        return Decision(Why.ANSWERED, target) if answered else Decision(Why.STOPPED, PREEMPTED)
    if not run_asked and override is not None:
        if override.label is not None:
            return Decision(Why.JUMPED, override.label)
        target = targets.get(override.outcome or "")
        return Decision(Why.FORCED, target)
    return Decision(Why.FOLLOWED, target) if target is not None else Decision(Why.UNKNOWN)
