from __future__ import annotations

import pytest

from viz.model import Marks, Node, outcome_class


@pytest.mark.parametrize(
    ("outcome", "kind"),
    [
        ("succeeded", "success"),
        ("DONE", "success"),
        ("aborted", "failure"),
        ("timed_out", "failure"),
        ("preempted", "preempted"),
        ("cancelled", "preempted"),
        ("low_battery", "other"),
        ("", "other"),
    ],
)
def test_outcome_names_tell_how_something_ended(outcome, kind):
    assert outcome_class(outcome) == kind


def test_walk_goes_parents_first():
    tree = Node("/A", "A", "machine", children=(Node("/A/B", "B", "state"),))
    assert [node.path for node in tree.walk()] == ["/A", "/A/B"]
    assert tree.is_open
    assert not tree.children[0].is_open


def test_marks_know_whether_there_was_a_run():
    assert not Marks(active=frozenset({"/A"})).has_run
    assert Marks(visits={"/A": 1}).has_run
