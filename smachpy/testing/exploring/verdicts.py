"""Judges explored runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.clock import Deadlock
from smachpy.events import Abandoned, Finished, PreemptRequested
from smachpy.exceptions import SmachError, UserDataKeyError
from smachpy.testing.runs import TimeLimitError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from smachpy.testing.exploring.explorer import Explorer
    from smachpy.testing.runs import Run


class Verdict(NamedTuple):
    """A fault of a run.

    Attributes:
        kind: Equal for two runs with the same kind of fault.
        reason: The fault in words.
    """

    kind: tuple[str, ...]
    reason: str


def judge(
    run: Run,
    error: Exception | None,
    explorer: Explorer,
    *,
    grace: float,
    invariants: Iterable[Callable[[Run], object]],
) -> Verdict | None:
    """Return the fault of a run; None if it has none.

    Args:
        run: The run.
        error: The exception it raised, if any.
        explorer: The explorer that made its choices.
        grace: Longest time from a preempt to the end [s].
        invariants: Functions of the run that must hold.
    """
    if isinstance(error, Deadlock | TimeLimitError) or explorer.too_long:
        return Verdict(("ends",), f"it never ends{f': {error}' if error is not None else ''}")
    if error is not None:
        kind = "" if isinstance(error, SmachError) else f"{type(error).__name__}: "
        causes = list(_causes(error))
        what = f"it raises: {kind}{error}{_way_out(causes, run, explorer)}"
        return Verdict(("raises", *[type(cause).__name__ for cause in causes]), what)
    slow = _slow_preempt(run, explorer, grace)
    if slow:
        return Verdict(("preempt",), slow)
    # A server that ignores a cancel is not the mission's fault.
    left = [goal_id for goal_id in run.goals_left if goal_id not in run.ignored]
    if left:
        return Verdict(("goals",), f"goals are left running: {', '.join(left)}")
    return _broken(run, invariants)


def _slow_preempt(run: Run, explorer: Explorer, grace: float) -> str:
    """Return in words how a preempt took too long; "" if none did."""
    asked = [
        e.t for e in run.events if isinstance(e, PreemptRequested) and e.path == run.record.path
    ]
    ended = [event.t for event in run.events if isinstance(event, Finished)]
    if not asked or not ended:
        return ""
    left = [event.path for event in run.events if isinstance(event, Abandoned)]
    # Leaves that ran on only to outlast others are no delay of the mission itself.
    took = ended[-1] - asked[0] - explorer.outlasted_s(asked[0])
    if not left and took <= grace:
        return ""
    who = f", {', '.join(left)} ignored it" if left else ""
    return f"a preempt takes {took:g} s{who}; expected at most {grace:g} s"


def _broken(run: Run, invariants: Iterable[Callable[[Run], object]]) -> Verdict | None:
    """Return the first invariant that does not hold; one that returns None uses asserts."""
    for number, invariant in enumerate(invariants):
        name = getattr(invariant, "__name__", repr(invariant))
        kind = ("invariant", str(number))
        try:
            answer = invariant(run)
            holds = answer is None or bool(answer)
        except AssertionError as error:
            return Verdict(kind, f"invariant {name}: {error}")
        except Exception as error:  # noqa: BLE001  an invariant that cannot be evaluated does not hold
            raised = type(error).__name__
            return Verdict((*kind, raised), f"invariant {name} raised {raised}: {error}")
        if not holds:
            told = "" if answer is False else f": it returned {answer!r}"
            return Verdict(kind, f"invariant {name} does not hold{told}")
    return None


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__


def _way_out(causes: Iterable[BaseException], run: Run, explorer: Explorer) -> str:
    """Return advice for a missing value that the replaced state would have written."""
    keys = [
        cause.key
        for cause in causes
        if isinstance(cause, UserDataKeyError) and "has no value" in str(cause)
    ]
    if not keys:
        return ""
    key = keys[-1]
    for leaf in run.record.walk():
        names = dict(leaf.remapping)
        for own in leaf.output_keys:
            if leaf.path in explorer.doubles and key in {own, names.get(own, own)}:
                return (
                    f" The double of {leaf.path} writes only what it is told: try "
                    f"explore(..., writes={{{leaf.path!r}: {{{own!r}: ...}}}})."
                )
    return ""
