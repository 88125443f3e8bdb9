"""Shutdown: one event, callbacks off the signal's frame, and what a second Ctrl-C does."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading

import pytest

from actionlib_core import shutdown
from actionlib_core.clock import RealClock
from actionlib_core.shutdown import Shutdown


@pytest.fixture
def end():
    with shutdown.use_shutdown(Shutdown()) as end:
        yield end


def test_request_sets_the_event_and_calls_back_once(end, clock):
    called = []
    end.on_shutdown(lambda: called.append(clock.now()))
    event = shutdown.event()
    assert not shutdown.requested()
    clock.call_later(3.0, lambda: end.request("test"))
    assert event.wait(10)
    clock.sleep(1)
    assert (clock.now(), called, end.reason) == (4.0, [3.0], "test")
    assert not shutdown.request("again")
    clock.sleep(1)
    assert (called, end.reason) == ([3.0], "test")


def test_late_callback_and_late_event(end, clock):
    assert shutdown.request()
    called = []
    shutdown.on_shutdown(lambda: called.append(True))
    assert shutdown.event().is_set()
    clock.sleep(1)
    assert called == [True]


def test_forgotten_callback_is_not_called(end, clock):
    called = []
    forget = shutdown.on_shutdown(lambda: called.append(True))
    forget()
    forget()
    shutdown.request()
    clock.sleep(1)
    assert called == []


def test_callback_may_block_and_raise_without_hurting_others(end, clock, monkeypatch):
    reported = []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(str(args.exc_value)))
    called = []

    def slow():
        clock.sleep(5)
        raise ValueError("slow")

    shutdown.on_shutdown(slow)
    shutdown.on_shutdown(lambda: called.append(clock.now()))
    shutdown.request()
    clock.sleep(10)
    assert (called, reported) == ([0.0], ["slow"])


def test_each_clock_has_one_event(end, clock):
    assert shutdown.event() is shutdown.event(clock)
    real = RealClock()
    assert shutdown.event(real) is not shutdown.event()
    event = shutdown.event(real)
    shutdown.request()
    assert event.is_set()


def test_clear_lets_the_program_go_on(end, clock):
    event = shutdown.event()
    shutdown.request("first")
    end.clear()
    assert not shutdown.requested()
    assert not event.is_set()
    assert shutdown.request("second")
    assert end.reason == "second"


@pytest.mark.parametrize("number", shutdown.SIGNALS)
def test_signals_request_and_handlers_return(end, number):
    clock = RealClock()
    called = clock.event()
    before = signal.getsignal(number)
    with shutdown.handle_signals() as here:
        assert here is end
        frames = []
        shutdown.on_shutdown(lambda: (frames.append(threading.current_thread()), called.set()))
        os.kill(os.getpid(), number)
        assert called.wait(60)
        assert shutdown.requested()
        assert end.reason == number.name
        assert frames[0] is not threading.main_thread()
    assert signal.getsignal(number) is before


def test_a_signal_that_is_ignored_stays_so_if_a_terminal_sends_it(end):
    """`nohup` ignores SIGHUP."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with shutdown.handle_signals():
            os.kill(os.getpid(), signal.SIGHUP)
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        assert not shutdown.requested()
    finally:
        signal.signal(signal.SIGHUP, before)


def test_signals_that_the_parent_had_blocked_are_handled(end):
    """Only SIGKILL ended a program whose parent waits with `sigwait`."""
    clock = RealClock()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGURG})
    try:
        with shutdown.handle_signals():
            assert not signal.pthread_sigmask(signal.SIG_BLOCK, ())
            os.kill(os.getpid(), signal.SIGTERM)
            assert shutdown.event(clock).wait(60)
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
        assert blocked == {signal.SIGTERM, signal.SIGURG}
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@pytest.mark.parametrize(
    "numbers",
    [
        (signal.SIGTERM, signal.SIGHUP, signal.SIGHUP),
        (signal.SIGHUP, signal.SIGHUP),
        (signal.SIGHUP, signal.SIGTERM),
    ],
)
def test_the_echo_of_a_closed_terminal_is_no_second_request(end, monkeypatch, numbers):
    """A shell sends SIGHUP to its jobs, and the system sends one more as the shell ends."""
    monkeypatch.setattr(shutdown, "ECHO_S", 60.0)  # a busy computer may be long between two signals
    ended = []
    monkeypatch.setattr(shutdown, "_end_process", ended.append)
    clock = RealClock()
    with shutdown.handle_signals():
        for number in numbers:
            os.kill(os.getpid(), number)
        assert shutdown.event(clock).wait(60)
    assert not ended


def test_two_signals_at_once_raise_once(monkeypatch):
    """The second one ended what the first had begun: the cancel of a goal."""
    monkeypatch.setattr(shutdown, "ECHO_S", 60.0)
    both = (signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, signal.SIG_DFL) for number in both]
    raised = []
    with shutdown.terminable():
        try:
            for number in both:
                signal.raise_signal(number)
        except shutdown.Terminated as error:
            raised.append(error.number)
            for number in both:
                signal.raise_signal(number)
            raised.append("cancelled")
    for number, handler in zip(both, before, strict=True):
        signal.signal(number, handler)
    assert raised == [signal.SIGTERM, "cancelled"]


def test_a_server_that_ends_by_a_signal_is_not_ended_by_its_echo():
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    try:
        with pytest.raises(SystemExit) as ended, shutdown.exits_on_signals():
            signal.raise_signal(signal.SIGHUP)
        assert ended.value.code == 128 + signal.SIGHUP
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_request_from_outside_of_virtual_time_does_not_wait_for_a_busy_thread(end, clock):
    """A mission in virtual time that did not wait could not be stopped by a signal."""

    class Busy:
        def __init__(self):
            self.clock = clock
            self.stopped = threading.Event()

        def stop(self):
            self.stopped.set()

    busy = Busy()
    end.runs.add(busy)
    task = RealClock().spawn(lambda: end.request("SIGTERM"), name="signal")
    assert busy.stopped.wait(60)
    assert task.join(60)


class Left:
    """A run in a thread that the end of the program would end."""

    clock = RealClock()

    def __init__(self, end, *, is_deaf=False):
        self.asked = 0
        self._end, self._is_deaf = end, is_deaf
        end.runs.add(self)

    def stop(self):
        self.asked += 1
        if not self._is_deaf:
            self.clock.spawn(lambda: self._end.forget(self), name="ends")


def test_the_end_of_the_program_stops_the_runs_that_are_left(end):
    left = Left(end)
    end.leave()
    assert (left.asked, end.runs, end.reason) == (1, set(), "exit")


def test_the_end_of_the_program_cancels_the_goals_of_runs_that_do_not_end(end, monkeypatch):
    monkeypatch.setattr(shutdown, "LEAVE_S", 0.01)
    cancelled = []
    end.cancels.add(lambda: cancelled.append("goal"))
    left = Left(end, is_deaf=True)
    end.leave()
    assert (left.asked, cancelled) == (1, ["goal"])


def test_second_ctrl_c_is_pythons_own(end):
    clock = RealClock()

    def press_twice():
        with shutdown.handle_signals():
            os.kill(os.getpid(), signal.SIGINT)
            assert shutdown.event(clock).wait(60)
            os.kill(os.getpid(), signal.SIGINT)
            clock.event().wait(10)

    with pytest.raises(KeyboardInterrupt):
        press_twice()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_later_signals_cancel_goals_and_end_the_process():
    program = """
import threading
from actionlib_core import shutdown
with shutdown.handle_signals():
    shutdown.current_shutdown().cancels.add(lambda: print("cancelled", flush=True))
    print("ready", flush=True)
    shutdown.event().wait()
    print("first", flush=True)
    threading.Event().wait()
"""
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True
    ) as process:
        for line in ("ready", "first", "cancelled"):
            assert process.stdout.readline() == f"{line}\n"
            process.send_signal(signal.SIGTERM)
        assert process.wait(60) == -signal.SIGTERM


def test_handling_signals_in_another_thread_is_refused(end):
    errors = []
    task = RealClock().spawn(lambda: _catch(errors), name="not main")
    assert task.join(60)
    assert "main thread" in errors[0]


def _catch(errors):
    try:
        with shutdown.handle_signals():
            pass
    except RuntimeError as error:
        errors.append(str(error))


THIRD = """
import threading
from actionlib_core import shutdown
with shutdown.handle_signals():
    shutdown.on_shutdown(lambda: print("first", flush=True))
    print("ready", flush=True)
    while True:
        try:
            threading.Event().wait(0.05)  # see docs/preemption.md, the instant before a blocking call
        except KeyboardInterrupt:
            print("second", flush=True)
"""


def test_third_ctrl_c_ends_a_program_that_ignores_the_others():
    process = subprocess.Popen([sys.executable, "-c", THIRD], stdout=subprocess.PIPE, text=True)
    try:
        for line in ("ready", "first", "second"):
            assert process.stdout.readline() == f"{line}\n"
            process.send_signal(signal.SIGINT)
        assert process.wait(60) == -signal.SIGINT
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
