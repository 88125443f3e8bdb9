"""Real time: signal safety of events and the thread cache."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
import weakref

import pytest

from actionlib_core.clock import RealClock


def test_event_may_be_set_by_a_signal_handler_that_interrupts_its_wait():
    clock = RealClock()
    event = clock.event()
    previous = signal.signal(signal.SIGALRM, lambda *_: event.set())
    try:
        for _ in range(50):
            event.clear()
            signal.setitimer(signal.ITIMER_REAL, 0.0005)
            assert event.wait(60)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)


def test_a_signal_that_does_not_end_the_system_call_is_handled_soon():
    """As one that comes just before the call: here another thread takes it from the kernel."""
    event, ready = RealClock().event(), threading.Event()
    previous = signal.signal(signal.SIGUSR1, lambda *_: event.set())
    sender = threading.Thread(
        target=lambda: (ready.wait(60.0), os.kill(os.getpid(), signal.SIGUSR1))
    )
    sender.start()
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})
    try:
        ready.set()
        start = time.monotonic()
        assert event.wait(60.0)
        assert time.monotonic() - start < 30.0
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGUSR1})
        signal.signal(signal.SIGUSR1, previous)
        sender.join()


@pytest.mark.parametrize("timeout", [0.01, 0.7])
def test_a_wait_in_the_main_thread_keeps_to_its_timeout(timeout):
    start = time.monotonic()
    assert not RealClock().event().wait(timeout)
    assert time.monotonic() - start >= timeout


def test_a_raising_signal_handler_leaves_no_waiter_behind():
    class Interrupt(Exception):
        pass

    def handler(*_):
        raise Interrupt

    event = RealClock().event()
    previous = signal.signal(signal.SIGALRM, handler)
    try:
        with contextlib.suppress(Interrupt):
            signal.setitimer(signal.ITIMER_REAL, 0.001)  # under load it rings before the wait
            event.wait(60)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    assert event._waiters == []


def test_spawn_reuses_an_idle_thread():
    clock, idents = RealClock(), set()
    for _ in range(20):
        clock.spawn(lambda: idents.add(threading.get_ident()), name="t").join(60)
    assert len(idents) < 20


def test_a_thousand_timers_need_one_thread():
    clock, done, left = RealClock(), threading.Semaphore(0), 1000
    before = threading.active_count()
    for i in range(left):
        clock.call_later(0.0001 * (i % 7), done.release)
    assert threading.active_count() <= before + 1
    for _ in range(left):
        assert done.acquire(timeout=60)


def test_what_a_timer_has_called_is_freed_before_the_next_one_is_due():
    class Call:
        def __call__(self):
            pass

    clock = RealClock()
    next_one = clock.call_later(600.0, int)
    freed = threading.Event()
    call = Call()
    watch = weakref.ref(call, lambda _: freed.set())
    clock.call_later(0.0, call)
    del call
    assert freed.wait(60.0)
    assert watch() is None
    next_one.cancel()
    clock.call_later(0.0, int)  # lets the thread see that nothing is left


def test_hand_over_to_cached_threads_under_load():
    clock, count = RealClock(), []
    for _ in range(300):
        tasks = [clock.spawn(lambda: count.append(1), name="t") for _ in range(4)]
        assert all(task.join(60) for task in tasks)
    assert len(count) == 1200


def test_what_is_spawned_while_the_program_ends_waits_for_a_thread_that_was_kept(monkeypatch):
    """As in Python 3.12, which starts no thread once the main thread has ended."""
    clock, other, done = RealClock(), RealClock(), []
    clock.keep_threads(2)
    main = threading.Thread(target=int)
    main.start()
    main.join()

    def refuse(_thread):
        raise RuntimeError("can't create new thread at interpreter shutdown")

    monkeypatch.setattr(threading, "main_thread", lambda: main)
    monkeypatch.setattr(threading.Thread, "start", refuse)
    timer = clock.event()
    clock.call_later(0.0, timer.set)
    tasks = [clock.spawn(lambda i=i: done.append(i), name="t") for i in range(50)]
    assert all(task.join(60.0) for task in tasks)
    assert sorted(done) == list(range(50))
    assert timer.wait(60.0)
    with pytest.raises(RuntimeError, match="can't create new thread"):
        other.spawn(int, name="nobody asked for threads at the end")


FORK = """
import os
from actionlib_core.clock import RealClock

clock = RealClock()
held, leave = clock.event(), clock.event()
clock.spawn(held.clear, name="idle").join()
clock.call_later(600.0, leave.set)

def hold():
    with clock._timer_lock:  # as a thread of the parent may have it at this moment
        held.set()
        leave.wait()

holder = clock.spawn(hold, name="holder")
held.wait()
pid = os.fork()
if pid == 0:
    spawned, timed = clock.event(), clock.event()
    clock.spawn(spawned.set, name="spawned")
    clock.call_later(0.001, timed.set)
    print(spawned.wait(60.0), timed.wait(60.0), flush=True)
    os._exit(0)
os.waitpid(pid, 0)
leave.set()
holder.join()
timed = clock.event()
clock.call_later(0.001, timed.set)
print(timed.wait(60.0), flush=True)
os._exit(0)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_child_has_threads_and_timers_of_its_own():
    """Its timers never came, as the thread of its parent's timers was not there."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FORK], capture_output=True, text=True, timeout=250
    )
    assert done.stdout.split() == ["True", "True", "True"], done.stderr
