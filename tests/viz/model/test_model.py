from __future__ import annotations

from smachpy_viz.model.machine import Marks, Node


def test_walk_goes_parents_first():
    tree = Node("/A", "A", "machine", children=(Node("/A/B", "B", "state"),))
    assert [node.path for node in tree.walk()] == ["/A", "/A/B"]
    assert tree.is_open
    assert not tree.children[0].is_open


def test_marks_know_whether_there_was_a_run():
    assert not Marks(active=frozenset({"/A"})).has_run
    assert Marks(visits={"/A": 1}).has_run
