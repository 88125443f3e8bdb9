"""Hand-overs between threads: every kind of gate, threads used again, forked children."""

from __future__ import annotations

import errno
import os
import signal
import threading

import pytest

from actionlib_core.clock import VirtualClock, _turns
from actionlib_core.clock._gates import EventGate, LockGate, make_gate

GATES = [LockGate, EventGate] if hasattr(os, "eventfd") else [LockGate]
needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")


@pytest.fixture(params=GATES, ids=lambda gate: gate.__name__)
def gate(request):
    return request.param()


def test_a_turn_given_early_is_kept(gate):
    gate.release()
    gate.acquire()
    assert not gate.acquire_within(0.001)


def test_a_turn_comes_from_another_thread(gate):
    threading.Thread(target=gate.release).start()
    assert gate.acquire_within(5.0)


def test_a_signal_handler_that_returns_does_not_open_a_gate(gate):
    caught = []

    def handler(*_):
        caught.append(1)
        gate.release()

    previous = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.005)
        gate.acquire()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    assert caught == [1]


def test_gates_need_no_files_that_are_not_there(monkeypatch):
    def full(_start):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(os, "eventfd", full, raising=False)
    assert isinstance(make_gate(), LockGate)


def run_on(kind, monkeypatch):
    monkeypatch.setattr("actionlib_core.clock._virtual.make_gate", kind)
    monkeypatch.setattr("actionlib_core.clock._turns.make_gate", kind)
    order = []
    with VirtualClock(3) as clock:

        def work(name):
            for _ in range(3):
                clock.sleep(1)
                order.append((clock.now(), name))

        tasks = [clock.spawn(lambda n=n: work(n), name=n) for n in "abc"]
        assert all(task.join() for task in tasks)
    return order


def test_a_clock_runs_the_same_on_every_kind_of_gate(monkeypatch):
    orders = []
    kept = [_turns._idle.pop() for _ in range(len(_turns._idle))]  # that new threads are made
    try:
        for kind in GATES:
            orders.append(run_on(kind, monkeypatch))
            kept += [_turns._idle.pop() for _ in range(len(_turns._idle))]
    finally:
        _turns._idle.extend(kept)
    assert [t for t, _ in orders[0]] == [1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert all(order == orders[0] for order in orders)


def test_a_clock_that_is_gone_leaves_no_file_open():
    def count():
        return len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0

    def run():
        with VirtualClock() as clock:
            for _ in range(3):
                clock.spawn(lambda: clock.sleep(1), name="t")
            clock.sleep(2)

    run()
    before = count()
    for _ in range(20):
        run()
    # A thread that is still on its way back from one run has another one made for the next.
    assert count() < before + 20


def test_a_task_that_follows_on_another_s_end_takes_its_thread(clock):
    idents = []

    def first():
        idents.append(threading.get_ident())
        clock.spawn(lambda: idents.append(threading.get_ident()), name="second")

    clock.spawn(first, name="first")
    clock.sleep(1)
    assert idents[0] == idents[1]


@needs_fork
@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_a_forked_child_takes_no_part_in_its_parent_s_time(clock):
    reader, writer = os.pipe()
    with clock.patched():
        child = os.fork()
        if child == 0:
            import time

            try:
                time.sleep(0.001)
                clock.sleep(1)
            except RuntimeError as error:
                os.write(writer, str(error).encode())
            os._exit(0)
    os.close(writer)
    with open(reader, "rb") as pipe:
        said = pipe.read().decode()
    os.waitpid(child, 0)
    assert "may not wait" in said
    clock.sleep(1)
    assert clock.now() == 1
