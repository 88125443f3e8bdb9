"""Virtual time: determinism, jumps, seeds, deadlocks."""

from __future__ import annotations

import os
import signal
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actionlib_core.clock import Deadlock, RealClock, TimeLimit, VirtualClock, use_clock


def test_time_jumps_to_the_next_deadline(clock):
    clock.sleep(3600)
    assert clock.now() == 3600
    assert clock.time_ns() - VirtualClock().time_ns() == 3600 * 10**9


def test_one_participant_runs_at_a_time(clock):
    running, most = [], []

    def work():
        for _ in range(20):
            running.append(1)
            most.append(len(running))
            running.pop()
            clock.sleep(0.1)

    tasks = [clock.spawn(work, name=f"t{i}") for i in range(4)]
    assert all(task.join() for task in tasks)
    assert set(most) == {1}
    assert clock.now() == pytest.approx(2.0)


def interleaving(seed: int | None) -> list[tuple[str, int]]:
    with VirtualClock(seed) as clock:
        order = []

        def work(name):
            for i in range(5):
                order.append((name, i))
                clock.sleep(1)

        tasks = [clock.spawn(lambda n=n: work(n), name=n) for n in "abc"]
        for task in tasks:
            task.join()
        return order


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32))
def test_the_same_seed_gives_the_same_run(seed):
    assert interleaving(seed) == interleaving(seed)


def test_seeds_differ_and_no_seed_takes_turns():
    assert interleaving(None)[:6] == [("a", 0), ("b", 0), ("c", 0), ("a", 1), ("b", 1), ("c", 1)]
    assert len({tuple(interleaving(seed)) for seed in range(10)}) > 3


def test_a_wait_that_can_never_end_raises_with_everybody_s_reason(clock):
    never = clock.event("the result of goal 7")
    clock.spawn(never.wait, name="/PATROL/DRIVE")
    with pytest.raises(Deadlock) as caught:
        clock.event("the patrol").wait()
    assert caught.value.waits == {
        "MainThread": "the patrol",
        "/PATROL/DRIVE": "the result of goal 7",
    }
    assert "/PATROL/DRIVE: waits for the result of goal 7" in str(caught.value)


def test_the_run_can_go_on_after_a_deadlock(clock):
    with pytest.raises(Deadlock):
        clock.event().wait()
    clock.sleep(1)
    assert clock.now() == 1


def test_close_ends_participants_that_still_wait():
    with VirtualClock() as clock:
        unwound = []

        def work():
            try:
                clock.event().wait()
            finally:
                unwound.append(True)

        task = clock.spawn(work, name="t")
        clock.sleep(1)
        assert task.is_alive()
    assert unwound == [True]
    assert not task.is_alive()


def test_close_ends_a_participant_that_never_started():
    with VirtualClock() as clock:
        started = []
        clock.spawn(lambda: started.append(1), name="t")
    assert started == []


def test_set_by_a_foreign_thread_just_before_the_wait_begins_is_seen(clock, monkeypatch):
    event = clock.event()
    wait = clock.wait_for

    def wait_late(*args):
        thread = threading.Thread(target=event.set)
        thread.start()
        thread.join()
        return wait(*args)

    monkeypatch.setattr(clock, "wait_for", wait_late)
    assert event.wait()
    event.clear()
    assert event.wait(5.0)
    assert clock.now() == 0.0


def test_a_foreign_thread_may_set_but_not_wait(clock):
    event, errors = clock.event(), []

    def foreign():
        event.set()
        try:
            clock.sleep(1)
        except RuntimeError as error:
            errors.append(str(error))

    thread = threading.Thread(target=foreign, name="foreign")
    thread.start()
    thread.join()
    assert event.wait()
    assert "'foreign' may not wait" in errors[0]


def test_a_callback_may_not_wait(clock, monkeypatch):
    reported = []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(str(args.exc_value)))
    clock.call_later(1, lambda: clock.sleep(1))
    clock.sleep(2)
    assert "a callback may not wait" in reported[0]


def test_a_callback_on_a_leaving_thread_schedules_in_virtual_time_only(clock):
    made = []

    def tick():
        made.append(clock.call_later(1.0, lambda: None))

    clock.call_later(0.5, tick)
    clock.spawn(lambda: clock.sleep(0.1), name="leaves")  # its thread calls `tick`
    clock.spawn(lambda: clock.sleep(5.0), name="waits")
    clock.sleep(2.0)
    assert [timer.real for timer in made] == [None]


def test_what_another_thread_calls_later_is_called_in_real_time_if_the_program_is_busy(clock):
    called = threading.Event()
    outside = RealClock().spawn(lambda: clock.call_later(0.01, called.set), name="outside")
    assert called.wait(60)  # this participant does not wait on its clock
    assert outside.join(60)
    assert clock.now() == 0.0


def test_what_another_thread_calls_later_is_called_once(clock):
    called = []
    outside = RealClock().spawn(
        lambda: clock.call_later(0.001, lambda: called.append(clock.now())), name="outside"
    )
    assert outside.join(60)
    clock.sleep(1.0)
    threading.Event().wait(0.01)
    assert len(called) == 1


def test_ctrl_c_in_a_callback_is_the_main_thread_s(clock):
    clock.call_later(1, lambda: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        clock.sleep(2)
    clock.sleep(2)
    assert clock.now() == pytest.approx(3)


class Interrupt(Exception):
    pass


@pytest.fixture
def alarm():
    """A way to interrupt the main thread, once, wherever it waits."""
    raised = []

    def handler(*_):
        if not raised:
            raised.append(True)
            raise Interrupt

    def interrupt():
        # A signal that comes just before the wait is seen only after it: send until seen.
        while not raised:
            signal.pthread_kill(threading.main_thread().ident, signal.SIGUSR1)
            threading.Event().wait(0.001)

    previous = signal.signal(signal.SIGUSR1, handler)
    yield interrupt
    signal.signal(signal.SIGUSR1, previous)


def test_a_raising_signal_handler_waits_for_the_turn_then_goes_on(clock, alarm):
    # The participant holds the turn while the signal reaches the waiting main thread.
    def work():
        alarm()
        while clock._owner in clock._waits:
            pass
        clock.sleep(1)

    task = clock.spawn(work, name="t")
    with pytest.raises(Interrupt):
        clock.event().wait()
    assert task.join()


def test_an_interrupt_ends_the_wait_for_a_participant_that_never_waits(clock, alarm, monkeypatch):
    monkeypatch.setattr("actionlib_core.clock._virtual.INTERRUPT_S", 0.01)
    stop = threading.Event()

    def hog():
        alarm()
        stop.wait(60)

    clock.spawn(hog, name="hog")
    with pytest.raises(Interrupt):
        clock.event().wait()
    stop.set()


def test_ten_hours_of_sleeps_cost_little(clock):
    for _ in range(36_000):
        clock.sleep(1)
    assert clock.now() == 36_000


def test_a_limit_ends_waits_that_would_pass_it(clock):
    clock.limit = 10

    def tick():
        while True:
            clock.sleep(1)

    clock.spawn(tick, name="ticker")
    clock.sleep(9)
    with pytest.raises(TimeLimit, match="ticker: waits for time to pass"):
        clock.event("the end").wait()
    with pytest.raises(TimeLimit):
        clock.sleep(5)
    assert clock.now() == 10
    clock.limit = None
    clock.sleep(5)
    assert clock.now() == 15


def test_most_turns_end_a_wait_while_others_take_turns_and_no_time_passes(clock):
    clock.most_turns = 100
    ping, pong = clock.event("ping"), clock.event("pong")

    def answer(mine, other):
        while True:
            mine.wait()
            mine.clear()
            other.set()

    for _ in range(200):  # as long as time passes, turns do not add up
        clock.sleep(1)
        clock.spawn(lambda: None, name="short").join()
    clock.spawn(lambda: answer(ping, pong), name="a")
    clock.spawn(lambda: answer(pong, ping), name="b")
    ping.set()
    with pytest.raises(TimeLimit, match="100 turns were taken at 200 s") as caught:
        clock.event("the end").wait()
    assert caught.value.turns == 100
    assert caught.value.waits["MainThread"] == "the end"
    with pytest.raises(TimeLimit):
        clock.sleep(1)


def test_a_limit_hides_no_deadlock(clock):
    clock.limit = 10
    with pytest.raises(Deadlock):
        clock.event("the end").wait()


def test_a_deadlock_on_an_event_without_a_name_names_the_line(clock):
    with pytest.raises(Deadlock) as caught:
        clock.event().wait()
    assert f"an event at {__file__}:" in caught.value.waits["MainThread"]


def test_a_callback_in_a_thread_that_is_ending_belongs_to_the_clock(clock):
    # Symptom: a shutdown that a test requests at a time stopped the machine in a thread of real time, maybe too late.
    called_by = []
    ending = clock.spawn(lambda: clock.sleep(1.0), name="ending")
    clock.call_later(2.0, lambda: called_by.append(threading.get_ident()))
    clock.call_later(2.0, lambda: called_by.append(clock.is_participant(threading.get_ident())))
    clock.sleep(3.0)
    assert ending.join()
    assert called_by[0] != threading.get_ident()
    assert called_by[1]
    assert not clock.is_participant(called_by[0])


def test_a_closed_clock_holds_no_file_however_long_it_is_kept():
    kept = []
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(20):
        with VirtualClock() as clock, use_clock(clock):
            clock.spawn(lambda: None, name="another").join()
        kept.append(clock)
    assert len(os.listdir("/proc/self/fd")) - before < 20
