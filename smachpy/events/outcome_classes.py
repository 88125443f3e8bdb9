"""The class of an outcome (success, failure, ...): what its state says, else by its name.

Exit codes, pictures, statistics and the live page all use what is here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from collections.abc import Collection

OutcomeClass = Literal["success", "failure", "preempted", "other"]

SUCCESS: Final = frozenset(
    {"succeeded", "success", "successful", "done", "ok", "yes", "true", "valid"}
    | {"complete", "completed", "finished", "reached", "arrived", "goal"}
)
FAILURE: Final = frozenset(
    {"abort", "aborted", "fail", "failed", "failure", "error", "exception", "invalid", "no"}
    | {"false", "timeout", "timed_out", "lost", "rejected", "denied", "impossible"}
    | {"unreachable", "unreached"}
)
PREEMPTED_PREFIXES: Final = ("preempt", "cancel", "recall", "interrupt")
"""An outcome whose name begins with one of these is of the class "preempted"."""


def outcome_class(outcome: str, success: Collection[str] | None = None) -> OutcomeClass:
    """Return the class of an outcome; upper case, spaces and hyphens of its name do not matter.

    Args:
        outcome: The outcome.
        success: The good outcomes of its state: another one is a preempt if it is called so, else a
            failure. None goes by the name alone.

    >>> outcome_class("preempted"), outcome_class("Timed-out"), outcome_class("low_battery")
    ('preempted', 'failure', 'other')
    """
    if success is not None and outcome in success:
        return "success"
    word = outcome.lower().replace("-", "_").replace(" ", "_")
    if word.startswith(PREEMPTED_PREFIXES):
        return "preempted"
    if success is not None or word in FAILURE:
        return "failure"
    return "success" if word in SUCCESS else "other"


def is_good(outcome: str, success: Collection[str] | None = None) -> bool:
    """Return whether an outcome is good: it is neither a failure nor a preempt."""
    return outcome_class(outcome, success) in {"success", "other"}
