"""Real time: signal safety of events and the thread cache."""

from __future__ import annotations

import contextlib
import signal
import threading

from actionlib_core.clock import RealClock


def test_event_may_be_set_by_a_signal_handler_that_interrupts_its_wait():
    clock = RealClock()
    event = clock.event()
    previous = signal.signal(signal.SIGALRM, lambda *_: event.set())
    try:
        for _ in range(50):
            event.clear()
            signal.setitimer(signal.ITIMER_REAL, 0.0005)
            assert event.wait(5)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)


def test_a_raising_signal_handler_leaves_no_waiter_behind():
    class Interrupt(Exception):
        pass

    def handler(*_):
        raise Interrupt

    event = RealClock().event()
    previous = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.001)
        with contextlib.suppress(Interrupt):
            event.wait(5)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    assert event._waiters == []


def test_spawn_reuses_an_idle_thread():
    clock, idents = RealClock(), set()
    for _ in range(20):
        clock.spawn(lambda: idents.add(threading.get_ident()), name="t").join(5)
    assert len(idents) < 20


def test_a_thousand_timers_need_one_thread():
    clock, done, left = RealClock(), threading.Semaphore(0), 1000
    before = threading.active_count()
    for i in range(left):
        clock.call_later(0.0001 * (i % 7), done.release)
    assert threading.active_count() <= before + 1
    for _ in range(left):
        assert done.acquire(timeout=5)


def test_hand_over_to_cached_threads_under_load():
    clock, count = RealClock(), []
    for _ in range(300):
        tasks = [clock.spawn(lambda: count.append(1), name="t") for _ in range(4)]
        assert all(task.join(5) for task in tasks)
    assert len(count) == 1200
