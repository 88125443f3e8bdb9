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


def test_signals_request_and_handlers_return(end):
    clock = RealClock()
    called = clock.event()
    before = signal.getsignal(signal.SIGTERM)
    with shutdown.handle_signals() as here:
        assert here is end
        frames = []
        shutdown.on_shutdown(lambda: (frames.append(threading.current_thread()), called.set()))
        os.kill(os.getpid(), signal.SIGTERM)
        assert called.wait(10)
        assert shutdown.requested()
        assert end.reason == "SIGTERM"
        assert frames[0] is not threading.main_thread()
    assert signal.getsignal(signal.SIGTERM) is before


def test_second_ctrl_c_is_pythons_own(end):
    clock = RealClock()

    def press_twice():
        with shutdown.handle_signals():
            os.kill(os.getpid(), signal.SIGINT)
            assert shutdown.event(clock).wait(10)
            os.kill(os.getpid(), signal.SIGINT)
            clock.event().wait(10)

    with pytest.raises(KeyboardInterrupt):
        press_twice()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_handling_signals_in_another_thread_is_refused(end):
    errors = []
    task = RealClock().spawn(lambda: _catch(errors), name="not main")
    assert task.join(10)
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
            threading.Event().wait()
        except KeyboardInterrupt:
            print("second", flush=True)
"""


def test_third_ctrl_c_ends_a_program_that_ignores_the_others():
    process = subprocess.Popen([sys.executable, "-c", THIRD], stdout=subprocess.PIPE, text=True)
    try:
        for line in ("ready", "first", "second"):
            assert process.stdout.readline() == f"{line}\n"
            process.send_signal(signal.SIGINT)
        assert process.wait(10) == -signal.SIGINT
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
