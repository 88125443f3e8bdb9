from __future__ import annotations

import pytest

from smachpy.outcome_classes import is_good, outcome_class


@pytest.mark.parametrize(
    ("outcome", "kind"),
    [
        ("succeeded", "success"),
        ("DONE", "success"),
        ("aborted", "failure"),
        ("timed_out", "failure"),
        ("Timed out", "failure"),
        ("timeout", "failure"),
        ("fail", "failure"),
        ("unreachable", "failure"),
        ("no", "failure"),
        ("preempted", "preempted"),
        ("cancelled", "preempted"),
        ("CANCELED", "preempted"),
        ("low_battery", "other"),
        ("failsafe", "other"),
        ("", "other"),
    ],
)
def test_outcome_names_tell_how_something_ended(outcome, kind):
    assert outcome_class(outcome) == kind
    assert is_good(outcome) == (kind in {"success", "other"})
