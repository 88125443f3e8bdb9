"""Durations that are no number, and timers whose callbacks misbehave: no other timer suffers."""

from __future__ import annotations

import math
import sys
import threading

import pytest

from actionlib_core.clock import Deadlock, RealClock, VirtualClock

NAN = float("nan")


def fires(clock):
    """Whether a new timer of `clock` still comes."""
    event = clock.event()
    clock.call_later(0.001, event.set)
    return event.wait(60)


def test_nan_is_refused_where_it_is_given(any_clock):
    for use in (
        any_clock.sleep,
        any_clock.event().wait,
        lambda seconds: any_clock.call_later(seconds, print),
    ):
        with pytest.raises(ValueError, match="nan"):
            use(NAN)
        with pytest.raises(TypeError):
            use("5 s")
    assert fires(any_clock)


def test_infinity_is_for_ever(any_clock):
    called = []
    any_clock.call_later(math.inf, lambda: called.append(True))
    event = any_clock.event()
    any_clock.call_later(0.001, event.set)
    assert event.wait(math.inf)
    assert fires(any_clock)
    assert called == []


def test_time_never_jumps_to_infinity():
    with VirtualClock() as clock:
        clock.call_later(math.inf, lambda: None)
        for wait in (clock.event().wait, clock.sleep):
            with pytest.raises(Deadlock):
                wait(math.inf)
        assert clock.now() == 0.0


def test_a_negative_time_is_none(any_clock):
    any_clock.sleep(-1.0)
    assert not any_clock.event().wait(-1.0)
    event = any_clock.event()
    any_clock.call_later(-1.0, event.set)
    assert event.wait(60)


@pytest.mark.parametrize(
    "error", [ValueError("v"), SystemExit(3), KeyboardInterrupt(), GeneratorExit(), MemoryError()]
)
def test_timers_survive_whatever_a_callback_raises(any_clock, error, monkeypatch):
    if isinstance(any_clock, VirtualClock) and isinstance(error, KeyboardInterrupt):
        return  # Ctrl-C of the whole test: it goes through
    heard = []
    monkeypatch.setattr(threading, "excepthook", heard.append)

    def fail():
        raise error

    any_clock.call_later(0.0, fail)
    assert fires(any_clock)
    assert len(heard) == (0 if isinstance(error, SystemExit) else 1)


def test_timers_survive_a_broken_excepthook(any_clock, monkeypatch):
    def broken(_):
        raise RuntimeError("the hook itself")

    told = []
    monkeypatch.setattr(threading, "excepthook", broken)
    monkeypatch.setattr(sys, "__excepthook__", lambda kind, *_: told.append(kind))
    any_clock.call_later(0.0, lambda: 1 / 0)
    assert fires(any_clock)
    assert told == [ZeroDivisionError, RuntimeError]


def test_timers_come_back_when_their_thread_could_not_be_started(monkeypatch):
    clock = RealClock()

    def refuse(*_, **__):
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patch:
        patch.setattr(clock, "spawn", refuse)
        with pytest.raises(RuntimeError):
            clock.call_later(0.0, print)
    assert fires(clock)


def test_timers_come_back_when_their_thread_dies(monkeypatch):
    """As in a program that is out of memory for a moment."""
    clock = RealClock()
    monkeypatch.setattr(threading, "excepthook", lambda _: None)
    now, broken = clock.now, []

    def fail_once():
        if threading.current_thread().name == "clock-timers" and not broken:
            broken.append(True)
            raise MemoryError
        return now()

    monkeypatch.setattr(clock, "now", fail_once)
    assert fires(clock)
    assert broken
