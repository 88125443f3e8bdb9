"""Messages that wait for a slow reader."""

from __future__ import annotations

from actionlib_core.goal.bounded import Backlog


def test_oldest_message_is_dropped_and_counted():
    backlog = Backlog(messages=2)
    assert [backlog.add(number, 1) for number in range(4)] == [True, True, False, False]
    assert backlog.dropped == 2
    assert [backlog.take(), backlog.take(), backlog.take()] == [2, 3, None]


def test_large_message_pushes_out_as_many_as_it_needs_and_is_kept_itself():
    backlog = Backlog(size=10)
    for name in "abc":
        backlog.add(name, 3)
    backlog.add("large", 20)
    assert (len(backlog), backlog.dropped, backlog.take()) == (1, 3, "large")
    assert backlog.add("next", 10)


def test_drop_all_counts_what_waited():
    backlog = Backlog(size=10)
    backlog.add("a", 9)
    assert backlog.drop_all() == 1
    assert backlog.dropped == 1
    assert backlog.add("b", 9)
