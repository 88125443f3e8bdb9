"""The changes of meaning that `make mutants` tries."""

from __future__ import annotations

import pytest

from tests.tools import mutants

TEXT = '''\
"""A docstring says 1 == 2."""

LIMIT_S: float = 2.5


def decide(lock, items, most: int = 3) -> bool:
    """Not a raise: 3 < 4."""
    with lock:
        if items and len(items) < most:
            items.clear()
        for item in items:
            if item is None:
                raise ValueError(item)
    return True
'''


@pytest.fixture
def changes(tmp_path, monkeypatch):
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    (tmp_path / "room.py").write_text(TEXT, encoding="utf-8")
    return mutants.mutants_of("room.py")


def test_each_kind_of_change_is_a_candidate(changes):
    assert {(each.line, each.old, each.new) for each in changes} == {
        (3, "2.5", "3.5"),
        (8, "lock", "__import__('contextlib').nullcontext()"),
        (9, "items and len(items) < most", "items or len(items) < most"),
        (9, "items and len(items) < most", "not (items and len(items) < most)"),
        (9, "len(items) < most", "len(items) <= most"),
        (10, "items.clear()", "pass"),
        (12, "item is None", "item is not None"),
        (12, "item is None", "not item is None"),
        (13, "raise ValueError(item)", "pass"),
        (14, "return True", "return False"),
    }


def test_a_changed_file_differs_in_that_place_only(changes):
    data = TEXT.encode()
    for each in changes:
        assert data[each.begin : each.end].decode() == each.old
        changed = data[: each.begin] + each.new.encode() + data[each.end :]
        compile(changed, "room.py", "exec")


def test_a_change_keeps_its_name_when_lines_move(changes, tmp_path):
    (tmp_path / "room.py").write_text("import math\n\n" + TEXT, encoding="utf-8")
    assert [each.key for each in mutants.mutants_of("room.py")] == [each.key for each in changes]
