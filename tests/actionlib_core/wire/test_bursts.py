"""Messages that come in bursts are gathered, in order, and none is left behind."""

from __future__ import annotations

import threading

import pytest

from actionlib_core.clock import RealClock, VirtualClock, use_clock
from actionlib_core.wire.arrivals import PAUSE_S, RAPID, RAPID_S, Bursts


class Desk:
    """What was handed on, and when."""

    def __init__(self, clock):
        self.clock = clock
        self.seen = []
        self.bursts = Bursts(clock, lambda run, name: clock.spawn(run, name=name), self.handle)

    def handle(self, item):
        if item == "bad":
            raise RuntimeError(item)
        self.seen.append((item, self.clock.now()))

    @property
    def items(self):
        return [item for item, _ in self.seen]


@pytest.fixture
def desk():
    with VirtualClock() as clock, use_clock(clock):
        yield Desk(clock)


def test_rare_items_are_handed_on_at_once(desk):
    for number in range(3 * RAPID):
        desk.bursts.take(number)
        assert desk.seen[-1] == (number, desk.clock.now())
        desk.clock.sleep(2 * RAPID_S)


def test_rest_of_a_burst_comes_together(desk):
    for number in range(100):
        desk.bursts.take(number)
    assert desk.items == list(range(RAPID))
    desk.clock.sleep(2 * PAUSE_S)
    assert desk.items == list(range(100))
    whens = {when for _, when in desk.seen[RAPID:]}
    assert list(whens) == [pytest.approx(PAUSE_S)]


def test_a_burst_is_handed_on_at_once_while_no_thread_can_be_started(desk, monkeypatch):
    """It waited for the next status list, and so did all feedback from then on."""

    def refuse(*_arguments, **_options):
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as without:
        without.setattr(desk.clock, "spawn", refuse)
        for number in range(50):
            desk.bursts.take(number)
        assert desk.items == list(range(50))
    for number in range(50, 100):
        desk.bursts.take(number)
    desk.clock.sleep(2 * PAUSE_S)
    assert desk.items == list(range(100))


def test_flush_hands_on_what_waits_before_something_else_is_done(desk):
    for number in range(50):
        desk.bursts.take(number)
    desk.bursts.flush()
    assert desk.items == list(range(50))
    desk.clock.sleep(2 * PAUSE_S)
    assert len(desk.seen) == 50


def test_item_that_raises_is_reported_and_the_next_is_handed_on(desk, monkeypatch):
    raised = []
    monkeypatch.setattr(threading, "excepthook", lambda args: raised.append(args.exc_type))
    for item in (*range(RAPID), "bad", "good"):
        desk.bursts.take(item)
    desk.bursts.flush()
    assert desk.items[-1] == "good"
    assert raised == [RuntimeError]


def test_order_holds_while_gathering_and_flushing_meet():
    """Real threads: one takes and flushes now and then, others gather."""
    desk = Desk(RealClock())
    for number in range(20_000):
        desk.bursts.take(number)
        if number % 997 == 0:
            desk.bursts.flush()
            assert desk.items[-1] == number
    desk.bursts.flush()
    assert desk.items == list(range(20_000))
