"""The class of an outcome (success, failure, ...) by its name.

Exit codes, pictures, statistics and the live page all use the table here.
"""

from __future__ import annotations

from typing import Final, Literal

OutcomeClass = Literal["success", "failure", "preempted", "other"]

SUCCESS: Final = frozenset(
    {"succeeded", "success", "successful", "done", "ok", "yes", "true", "valid"}
    | {"complete", "completed", "finished", "reached", "arrived"}
)
FAILURE: Final = frozenset(
    {"abort", "aborted", "fail", "failed", "failure", "error", "exception", "invalid", "no"}
    | {"false", "timeout", "timed_out", "lost", "rejected", "denied", "impossible"}
    | {"unreachable", "unreached"}
)
PREEMPTED_PREFIXES: Final = ("preempt", "cancel", "recall", "interrupt")
"""An outcome whose name begins with one of these is of the class "preempted"."""


def outcome_class(outcome: str) -> OutcomeClass:
    """Return the class of an outcome by its name; upper case, spaces and hyphens do not matter.

    >>> outcome_class("preempted"), outcome_class("Timed-out"), outcome_class("low_battery")
    ('preempted', 'failure', 'other')
    """
    word = outcome.lower().replace("-", "_").replace(" ", "_")
    if word in SUCCESS:
        return "success"
    if word in FAILURE:
        return "failure"
    return "preempted" if word.startswith(PREEMPTED_PREFIXES) else "other"


def is_good(outcome: str) -> bool:
    """Return whether an outcome is good: it is neither a failure nor a preempt."""
    return outcome_class(outcome) in {"success", "other"}
