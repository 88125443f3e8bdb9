"""The threads of a concurrence in real time: enough for all that block, named, none left over."""

from __future__ import annotations

import contextlib
import threading
from collections import deque

import pytest

from actionlib_core.clock import RealClock, use_clock
from smachpy import Concurrence, InvalidUserCodeError, State, StateMachine

MANY = 30
LONG_S = 60.0  # only a failing test waits so long


@pytest.fixture
def clock():
    with use_clock(RealClock()) as clock:
        yield clock


class Does(State):
    def __init__(self, function):
        super().__init__(["ok", "preempted"])
        self.function = function

    def execute(self, userdata):
        return self.function() or "ok"


def concurrence(*functions, outcome="ok", **options):
    both = Concurrence([outcome], outcome, **options)
    with both:
        for i, function in enumerate(functions):
            Concurrence.add(f"C{i}", Does(function))
    return both


def test_children_that_wait_for_each_other_all_run_at_once(clock):
    barrier = threading.Barrier(MANY)
    both = concurrence(*[lambda: barrier.wait(LONG_S) and None] * MANY)
    assert [both.execute() for _ in range(5)] == ["ok"] * 5


@pytest.mark.parametrize("blocks", range(4))
def test_one_that_blocks_keeps_no_other_from_starting(clock, blocks):
    others = threading.Semaphore(0)

    def wait():
        for _ in range(3):
            assert others.acquire(timeout=LONG_S)

    functions = [others.release] * 3
    functions.insert(blocks, wait)
    assert concurrence(*functions).execute() == "ok"


def test_every_child_runs_in_a_thread_of_its_name(clock):
    names = []
    both = concurrence(*[lambda: names.append(threading.current_thread().name)] * MANY)
    outer = StateMachine(["ok"], name="M")
    outer.add("BOTH", both)
    outer.execute()
    assert sorted(names) == sorted(f"/M/BOTH/C{i}" for i in range(MANY))


def test_children_that_do_little_share_threads_and_leave_none(clock):
    used = set()
    both = concurrence(*[lambda: used.add(threading.get_ident())] * MANY)
    before = threading.active_count()
    for _ in range(50):
        both.execute()
    # Not one for each: how many is the scheduler's choice.
    assert threading.active_count() - before < MANY
    assert threading.get_ident() not in used


def test_context_variables_of_one_child_are_not_those_of_the_next(clock):
    from contextvars import ContextVar

    mark = ContextVar("mark", default="none")
    seen = []

    def look():
        seen.append(mark.get())
        mark.set("mine")

    mark.set("outside")
    concurrence(*[look] * MANY).execute()
    assert seen == ["outside"] * MANY


def test_a_child_that_raises_or_is_preempted_ends_neither_thread_nor_run(clock):
    def fail():
        raise ValueError("motor")

    both = concurrence(fail, *[lambda: None] * 5)
    for _ in range(20):
        with pytest.raises(InvalidUserCodeError, match="motor"):
            both.execute()
    fine = concurrence(*[lambda: None] * 5)
    assert fine.execute() == "ok"


def test_an_end_is_reported_before_it_is_counted(clock, monkeypatch):
    """Else the last child, overtaking, lets the container leave with a report on its way."""
    free = []

    class Watched(deque):
        def append(self, branch):
            def look():
                if branch.run.lock.acquire(blocking=False):
                    branch.run.lock.release()
                    free.append(branch)

            looker = threading.Thread(target=look)
            looker.start()
            looker.join()
            super().append(branch)

    monkeypatch.setattr("smachpy.engine.threads.deque", Watched)
    seen = []
    both = concurrence(lambda: None, lambda: None, child_termination_cb=seen.append)
    assert both.execute() == "ok"
    assert len(seen) == 2
    assert free == []


def test_no_thread_left_is_an_error_of_the_children_and_no_hang(clock, monkeypatch):
    class Starved(RealClock):
        given = 0

        def spawn(self, target, *, name):
            if name.startswith("/"):
                Starved.given += 1
                if Starved.given > 2:
                    raise RuntimeError("can't start new thread")
            return super().spawn(target, name=name)

    release = threading.Event()

    def wait():
        release.wait(LONG_S)

    both = concurrence(wait, release.set, wait, wait)
    with use_clock(Starved()), pytest.raises(InvalidUserCodeError, match="start new thread"):
        both.execute()


def test_a_deaf_child_is_left_behind_and_the_next_run_is_whole(clock):
    release, started = threading.Event(), threading.Event()

    def deaf():
        started.set()
        while not release.is_set():
            with contextlib.suppress(BaseException):
                release.wait(LONG_S)

    both = Concurrence(["ok", "preempted"], "ok", preempt_timeout=0.05)
    with both:
        Concurrence.add("DEAF", Does(deaf))
        Concurrence.add("FINE", Does(lambda: None))
    outer = StateMachine(["ok", "preempted"], name="M")
    outer.add("BOTH", both)
    asker = threading.Thread(target=lambda: (started.wait(LONG_S), outer.request_preempt()))
    asker.start()
    try:
        assert outer.execute() == "preempted"
        asker.join()
    finally:
        release.set()
    assert not outer.is_running()
    assert outer.execute() == "ok"
