"""What every clock promises, on real and on virtual time."""

from __future__ import annotations

import asyncio
import threading
from contextvars import ContextVar

import pytest

from actionlib_core.clock import (
    Clock,
    RealClock,
    SerialExecutor,
    VirtualClock,
    current_clock,
    use_clock,
)


def test_clocks_satisfy_the_protocol(any_clock):
    assert isinstance(any_clock, Clock)


def test_event_set_before_the_wait_returns_at_once(any_clock):
    event = any_clock.event()
    event.set()
    assert event.is_set()
    assert event.wait()
    assert event.wait(60)


def test_event_wait_times_out(any_clock):
    before = any_clock.now()
    assert not any_clock.event().wait(0.01)
    assert any_clock.now() >= before + 0.01
    assert not any_clock.event().wait(0)
    assert not any_clock.event().wait(-1)


def test_event_set_wakes_every_waiter(any_clock):
    event, woken = any_clock.event(), []
    tasks = [any_clock.spawn(lambda: woken.append(event.wait(60)), name=f"w{i}") for i in range(5)]
    any_clock.call_later(0.001, event.set)
    assert all(task.join(60) for task in tasks)
    assert woken == [True] * 5


def test_event_clear_resets(any_clock):
    event = any_clock.event()
    event.set()
    event.clear()
    assert not event.is_set()
    assert not event.wait(0.001)


def test_spawn_runs_in_a_copy_of_the_context(any_clock):
    variable = ContextVar("variable", default="outside")
    seen = []

    def target():
        seen.append(variable.get())
        variable.set("changed")

    variable.set("inside")
    any_clock.spawn(target, name="t").join(60)
    assert seen == ["inside"]
    assert variable.get() == "inside"


def test_spawn_names_its_thread_and_knows_its_ident(any_clock):
    seen = []
    ready, go = any_clock.event(), any_clock.event()

    def target():
        seen.extend([threading.current_thread().name, threading.get_ident()])
        ready.set()
        go.wait(60)

    task = any_clock.spawn(target, name="/PATROL/DRIVE")
    assert ready.wait(60)
    assert task.is_alive()
    assert seen == ["/PATROL/DRIVE", task.ident]
    go.set()
    assert task.join(60)
    assert not task.is_alive()
    assert task.ident is None


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_spawn_keeps_and_reports_what_the_target_raised(any_clock, monkeypatch):
    reported = []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(args.exc_type))
    task = any_clock.spawn(lambda: 1 / 0, name="t")
    assert task.join(60)
    assert isinstance(task.error, ZeroDivisionError)
    assert reported == [ZeroDivisionError]


def test_call_later_runs_in_order_of_the_deadlines(any_clock):
    done, order = any_clock.event(), []
    any_clock.call_later(0.3, lambda: (order.append("late"), done.set()))
    any_clock.call_later(0.01, lambda: order.append("early"))
    assert done.wait(60)
    assert order == ["early", "late"]


def test_call_later_cancelled_never_runs(any_clock):
    order, done = [], any_clock.event()
    any_clock.call_later(0.01, lambda: order.append("cancelled")).cancel()
    any_clock.call_later(0.02, done.set)
    assert done.wait(60)
    assert order == []


def test_call_later_reports_an_error_and_runs_the_next(any_clock, monkeypatch):
    reported, done = [], any_clock.event()
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(args.exc_type))
    any_clock.call_later(0.001, lambda: 1 / 0)
    any_clock.call_later(0.002, done.set)
    assert done.wait(60)
    assert reported == [ZeroDivisionError]


@pytest.mark.parametrize("ends", [False, True], ids=["waits", "ends"])
@pytest.mark.parametrize("raised", [SystemExit, asyncio.CancelledError])
def test_timers_go_on_after_one_that_ends_its_thread(any_clock, monkeypatch, caplog, raised, ends):
    """In real time no timer ever ran again; in virtual time it ended whoever waited or had ended.

    `ends`: the thread that made the timer has ended when it is due.
    """
    reported = []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(args.exc_type))
    done = any_clock.event()

    def leave():
        raise raised("enough")

    def start():
        any_clock.call_later(0, leave)
        any_clock.call_later(0.002, done.set)

    task = any_clock.spawn(start, name="t") if ends else start()
    assert done.wait(60)
    assert task is None or task.join(60)
    if raised is SystemExit:
        assert "clock-timers: a callback raised SystemExit: enough" in caplog.text
    else:
        assert reported == [raised]


def test_run_async_returns_the_result_and_uses_the_clock(any_clock):
    async def main():
        before = any_clock.now()
        await asyncio.sleep(0.01)
        return any_clock.now() - before

    assert any_clock.run_async(main()) >= 0.009


def test_run_async_is_woken_from_another_thread(any_clock):
    async def main():
        loop, future = asyncio.get_running_loop(), asyncio.get_running_loop().create_future()
        any_clock.spawn(lambda: loop.call_soon_threadsafe(future.set_result, "woken"), name="waker")
        return await future

    assert any_clock.run_async(main()) == "woken"


def test_serial_executor_runs_in_order_one_at_a_time(any_clock):
    executor, order = SerialExecutor(any_clock, "serial"), []
    for i in range(20):
        executor.submit(lambda i=i: order.append(i))
    assert executor.join(60)
    assert order == list(range(20))


def test_join_of_a_serial_executor_waits_for_what_no_thread_has_taken_yet(any_clock):
    """Between two of its threads the next has not begun, and nothing runs."""
    executor, ran = SerialExecutor(any_clock, "serial"), []
    executor._queue.append(lambda: ran.append(1))
    assert executor.join(60)
    assert ran == [1]


def test_serial_executor_goes_on_after_an_error(any_clock, monkeypatch):
    reported, order = [], []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(args.exc_type))
    executor = SerialExecutor(any_clock, "serial")
    executor.submit(lambda: 1 / 0)
    executor.submit(lambda: order.append("next"))
    assert executor.join(60)
    assert (reported, order) == ([ZeroDivisionError], ["next"])


@pytest.mark.parametrize("raised", [SystemExit, KeyboardInterrupt, asyncio.CancelledError])
def test_serial_executor_goes_on_after_what_ends_a_thread(any_clock, monkeypatch, caplog, raised):
    """What was queued never ran, in silence."""
    reported, order, all_reported = [], [], any_clock.event()

    def report(args):
        reported.append(args.exc_type)
        if len(reported) == 3:
            all_reported.set()

    monkeypatch.setattr(threading, "excepthook", report)
    executor = SerialExecutor(any_clock, "serial")
    begin = any_clock.event()

    def leave():
        raise raised("enough")

    executor.submit(lambda: begin.wait(60))
    for number in range(3):
        executor.submit(leave)
        executor.submit(lambda number=number: order.append(number))
    begin.set()
    assert executor.join(60)
    assert order == [0, 1, 2]
    executor.submit(lambda: order.append("later"))
    assert executor.join(60)
    assert order[3:] == ["later"]
    told = [record.getMessage() for record in caplog.records]
    if raised is SystemExit:
        assert (reported, len(told)) == ([], 3)
        assert "serial: a callback raised SystemExit: enough" in told[0]
    else:
        assert all_reported.wait(60)  # by threads that end beside the one that has gone on
        assert (reported, told) == ([raised] * 3, [])


def test_serial_executor_of_a_closed_clock_runs_nothing_more():
    ran = []
    with VirtualClock() as clock:
        executor = SerialExecutor(clock, "serial")
        executor.submit(lambda: clock.sleep(1.0))
        executor.submit(lambda: ran.append(1))
        clock.sleep(0.5)
    assert ran == []


def test_serial_executor_takes_what_a_signal_handler_submits_amid_a_submit():
    """The handler waited for ever for the lock of the `submit` that it had interrupted."""
    clock, order, depth = RealClock(), [], []

    def spawn(target, *, name):
        depth.append(len(depth))
        if len(depth) == 1:  # here the signal comes
            executor.submit(lambda: order.append("handler"))
        return clock.spawn(target, name=name)

    executor = SerialExecutor(clock, "serial", spawn)
    program = clock.spawn(lambda: executor.submit(lambda: order.append("program")), name="program")
    assert program.join(60)
    assert executor.join(60)
    assert (order, depth) == (["program", "handler"], [0])


def test_serial_executor_runs_its_work_later_if_no_thread_can_be_started(any_clock):
    """It waited for the next `submit`, which may never come."""
    order, done, refused = [], any_clock.event(), []

    def spawn(target, *, name):
        if len(refused) < 3:
            refused.append(name)
            raise RuntimeError("can't start new thread")
        return any_clock.spawn(target, name=name)

    executor = SerialExecutor(any_clock, "serial", spawn)
    executor.submit(lambda: order.append(1))
    executor.submit(lambda: order.append(2))
    executor.submit(done.set)
    assert done.wait(60)
    assert order == [1, 2]


def test_serial_executor_accepts_work_from_its_own_work(any_clock):
    executor, done = SerialExecutor(any_clock, "serial"), any_clock.event()
    executor.submit(lambda: executor.submit(done.set))
    assert done.wait(60)


def test_use_clock_reaches_spawned_tasks_and_ends_with_the_block():
    outside = current_clock()
    with VirtualClock() as clock, use_clock(clock):
        seen = []
        clock.spawn(lambda: seen.append(current_clock()), name="t").join()
        assert seen == [clock]
    assert current_clock() is outside
