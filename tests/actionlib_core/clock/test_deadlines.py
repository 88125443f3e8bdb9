"""Deadlines that no longer count do not stay in memory, and the others keep their order."""

from __future__ import annotations

import hypothesis.strategies as st
import pytest
from hypothesis import given

from actionlib_core.clock import RealClock, VirtualClock
from actionlib_core.clock._deadlines import SPARE, Deadlines


class Book(Deadlines):
    """Deadlines of names, of which some were cancelled; counts the looks at them."""

    def __init__(self):
        self.cancelled, self.looks = set(), 0
        super().__init__(self.counts)

    def counts(self, number, name):
        self.looks += 1
        return name not in self.cancelled

    def take(self):
        while (first := self.first()) is not None:
            assert first[2] == self.pop()
            yield first[2]


@given(st.lists(st.tuples(st.integers(0, 5), st.booleans()), max_size=300))
def test_what_counts_comes_in_order_of_time_and_then_of_number(entries):
    book, expected = Book(), []
    for number, (due, cancelled) in enumerate(entries):
        book.push(float(due), number, number)
        if cancelled:
            book.cancelled.add(number)
        else:
            expected.append((due, number))
    assert list(book.take()) == [number for _, number in sorted(expected)]


@pytest.mark.parametrize("method", ["push", "first"])
@pytest.mark.parametrize("due", [0.0, 9.0])
def test_deadline_of_a_signal_handler_in_the_middle_of_another_call_is_not_lost(method, due):
    class Interrupted(Book):
        def counts(self, number, name):
            if self.handler is not None:
                self.handler, handler = None, self.handler
                handler()
            return super().counts(number, name)

    book = Interrupted()
    book.handler = None
    for number in range(SPARE):
        book.push(1.0 + number / SPARE, number, number)
        book.cancelled.add(number)
    book.handler = lambda: book.push(due, 1000, "of the handler")
    if method == "push":
        book.push(5.0, 1001, "kept")
    else:
        book.first()
    assert book.handler is None
    assert [name for name in book.take() if name != "kept"] == ["of the handler"]


def test_size_follows_what_counts_at_a_constant_cost():
    book = Book()
    for number in range(100):
        book.push(1e6, number, f"kept {number}")
    for number in range(100, 50_000):
        book.push(1e3, number, number)
        book.cancelled.add(number)
        assert len(book) <= 2 * 100 + SPARE
    assert book.looks < 3 * 50_000
    assert len(list(book.take())) == 100


@pytest.mark.parametrize("make", [RealClock, VirtualClock])
def test_cancelled_timers_of_a_clock_do_not_stay(make):
    clock = make()
    kept = clock.call_later(86_400.0, lambda: None)
    entries = clock._timers if make is RealClock else clock._deadlines
    for _ in range(1000):
        clock.call_later(3600.0, lambda: None).cancel()
    assert len(entries) <= SPARE + 2
    assert entries.first()[2] is kept
    kept.cancel()
    clock.call_later(0.0, lambda: None)  # wakes the real clock's thread, which then ends


def test_waits_that_ended_early_do_not_stay():
    with VirtualClock() as clock:
        event = clock.event()
        for _ in range(1000):
            clock.call_later(1e-3, event.set)
            assert event.wait(86_400.0)
            event.clear()
        assert len(clock._deadlines) <= SPARE + 2
