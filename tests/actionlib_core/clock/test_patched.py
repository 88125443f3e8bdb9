"""User code that waits by Python's own means, in virtual time."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import queue
import subprocess
import sys
import threading
import time
from time import monotonic as imported_monotonic
from time import sleep as imported_sleep

import pytest

from actionlib_core.clock import Deadlock, VirtualClock, _patched, current_clock, use_clock


@pytest.fixture
def patched(clock):
    with clock.patched():
        yield clock


def test_sleep_and_every_reader_of_time_are_virtual(patched):
    before = (time.time(), time.monotonic(), time.perf_counter(), time.time_ns())
    time.sleep(3600)
    after = (time.time(), time.monotonic(), time.perf_counter(), time.time_ns())
    differences = [b - a for a, b in zip(before, after, strict=True)]
    assert differences == [3600, 3600, 3600, 3600 * 10**9]
    assert time.monotonic_ns() == time.perf_counter_ns() == 3600 * 10**9


def test_names_imported_before_are_covered(patched):
    imported_sleep(5)
    assert imported_monotonic() == 5 == patched.now()


def test_negative_sleep_raises_as_ever_and_zero_lets_others_run(patched):
    with pytest.raises(ValueError, match="non-negative"):
        time.sleep(-1)
    flag = []
    patched.spawn(lambda: flag.append(1), name="t")
    while not flag:
        time.sleep(0)
    assert patched.now() < 0.01


def test_ctrl_c_while_names_are_replaced_leaves_python_as_it_was(monkeypatch):
    real, search, modules = time.sleep, _patched._search, iter(range(1000))

    def interrupted(name, names):
        if next(modules) == 100:
            raise KeyboardInterrupt
        return search(name, names)

    with VirtualClock() as clock:
        with monkeypatch.context() as patch:
            patch.setattr(_patched, "_search", interrupted)
            with pytest.raises(KeyboardInterrupt), clock.patched():
                pytest.fail("the block is not entered")
        assert time.sleep is real is imported_sleep
        with clock.patched():
            imported_sleep(5)
        assert clock.now() == 5
    assert time.sleep is real is imported_sleep


def test_python_is_as_it_was_after_the_block():
    real = (time.sleep, time.time, threading.Lock, threading.RLock, queue.SimpleQueue)
    methods = (threading.Thread.start, threading.Thread.join, asyncio.new_event_loop)
    with VirtualClock() as clock:
        with contextlib.suppress(KeyError), clock.patched():
            assert time.sleep is not real[0]
            with clock.patched():
                time.sleep(1)
            assert time.sleep is not real[0]
            raise KeyError
        assert clock.now() == 1
    assert real == (time.sleep, time.time, threading.Lock, threading.RLock, queue.SimpleQueue)
    assert methods == (threading.Thread.start, threading.Thread.join, asyncio.new_event_loop)
    assert imported_sleep is real[0]


def test_other_threads_keep_real_time():
    seen, go, done = [], threading.Event(), threading.Event()

    def foreign():
        go.wait(5)
        seen.extend([time.time(), type(threading.Lock()), threading.Event().wait(0.001)])
        done.set()

    thread = threading.Thread(target=foreign)
    thread.start()
    with VirtualClock() as clock, clock.patched():
        go.set()
        while not done.is_set():
            pass
    thread.join()
    assert abs(seen[0] - time.time()) < 60
    assert seen[1:] == [type(threading.Lock()), False]


def test_event_of_another_thread_of_the_mission(patched):
    event, order = threading.Event(), []

    def later():
        time.sleep(7)
        order.append("set")
        event.set()

    thread = threading.Thread(target=later)
    thread.start()
    assert not event.wait(5)
    assert event.wait()
    order.append("woken")
    thread.join()
    assert order == ["set", "woken"]
    assert patched.now() == 7
    assert not thread.is_alive()


def test_event_made_before_the_block():
    event = threading.Event()
    with VirtualClock() as clock, clock.patched():
        assert not event.wait(3600)
        clock.call_later(5, event.set)
        assert event.wait(10)
        assert clock.now() == 3605


def test_timer_thread_condition_semaphore_and_barrier(patched):
    fired = []
    timer = threading.Timer(30, lambda: fired.append(time.monotonic()))
    timer.start()
    timer.join()
    assert fired == [30]
    condition, ready = threading.Condition(), []

    def produce():
        time.sleep(2)
        with condition:
            ready.append(1)
            condition.notify()

    threading.Thread(target=produce).start()
    with condition:
        assert condition.wait_for(lambda: ready, timeout=10)
    assert patched.now() == 32
    semaphore = threading.Semaphore(0)
    assert not semaphore.acquire(timeout=8)
    assert patched.now() == 40
    barrier = threading.Barrier(2)
    threading.Thread(target=lambda: (time.sleep(5), barrier.wait())).start()
    barrier.wait()
    assert patched.now() == 45


@pytest.mark.parametrize("make", [lambda: threading.Lock(), lambda: threading.RLock()])
def test_a_lock_held_across_a_sleep(patched, make):
    lock, order = make(), []

    def hold():
        with lock:
            order.append("held")
            time.sleep(10)
            order.append("released")

    thread = threading.Thread(target=hold)
    thread.start()
    time.sleep(1)
    assert not lock.acquire(blocking=False)
    assert not lock.acquire(timeout=2)
    with lock:
        order.append("mine")
    thread.join()
    assert order == ["held", "released", "mine"]
    assert patched.now() == 10


@pytest.mark.parametrize("kind", [queue.Queue, queue.SimpleQueue, queue.PriorityQueue])
def test_queues(patched, kind):
    kind = getattr(queue, kind.__name__)  # SimpleQueue is another one inside the block
    items = kind()
    with pytest.raises(queue.Empty):
        items.get(timeout=60)
    threading.Timer(5, items.put, ["item"]).start()
    assert items.get() == "item"
    assert patched.now() == 65


def test_thread_pool(patched):
    def work(seconds):
        time.sleep(seconds)
        return seconds

    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        assert list(pool.map(work, [30, 20, 10])) == [30, 20, 10]
        assert patched.now() == 30
        future = pool.submit(work, 100)
        with pytest.raises(concurrent.futures.TimeoutError):
            future.result(timeout=50)
        done, _ = concurrent.futures.wait([future])
        assert done == {future}
    assert patched.now() == 130


def test_asyncio_run_and_an_executor_in_it(patched):
    async def main():
        loop = asyncio.get_running_loop()
        waits = (asyncio.sleep(60), loop.run_in_executor(None, time.sleep, 90))
        await asyncio.wait_for(asyncio.gather(*waits), 100)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.Event().wait(), 10)

    asyncio.run(main())
    assert patched.now() == 100


def test_a_thread_subclass_keeps_its_run_its_name_and_the_clock(clock):
    seen = []

    class Mine(threading.Thread):
        def run(self):
            time.sleep(3)
            seen.extend([current_clock(), threading.current_thread().name, self.is_alive()])

    with clock.patched():
        thread = Mine(name="/MINE", daemon=True)
        thread.start()
        assert thread.is_alive()
        thread.join(1)
        assert thread.is_alive()
        thread.join()
    assert not thread.is_alive()
    assert seen == [clock, "/MINE", True]
    assert "run" not in vars(thread)


def test_a_deadlock_names_the_line_that_waits(patched):
    never = threading.Event()
    threading.Thread(target=never.wait, name="/PATROL/DRIVE").start()
    with pytest.raises(Deadlock) as caught:
        queue.Queue().get()
    assert set(caught.value.waits) == {"MainThread", "/PATROL/DRIVE"}
    assert f"{__file__}:" in caught.value.waits["MainThread"]


def test_two_participants_of_one_name_are_both_listed(clock):
    for _ in range(2):
        clock.spawn(clock.event("a tray").wait, name="/PICK")
    with pytest.raises(Deadlock) as caught:
        clock.event("the end").wait()
    assert set(caught.value.waits) == {"MainThread", "/PICK", "/PICK (2)"}


def test_a_coroutine_that_waits_for_ever_is_named(clock):
    async def main():
        await asyncio.create_task(asyncio.Event().wait(), name="dock")

    with pytest.raises(Deadlock, match="dock"):
        clock.run_async(main())


def test_a_subprocess_takes_real_time(patched):
    assert (
        subprocess.run([sys.executable, "-c", "print(1)"], timeout=30, check=True).returncode == 0
    )
    assert patched.now() == 0


def test_threads_and_locks_of_the_house_stay_real(patched):
    from actionlib_core.clock import SerialExecutor

    executor = SerialExecutor(patched, "serial")
    assert type(executor._busy) is type(__import__("_thread").allocate_lock())
    executor.submit(lambda: time.sleep(5))
    assert executor.join()
    assert patched.now() == 5


def test_a_callback_of_the_clock_may_start_a_task_that_needs_a_new_thread(patched):
    done = []

    def start_many():
        for _ in range(50):
            patched.spawn(lambda: done.append(time.monotonic()), name="t")

    patched.call_later(1, start_many)
    time.sleep(2)
    assert done == [1] * 50


def interleaving(seed: int) -> list[str]:
    with VirtualClock(seed) as clock, use_clock(clock), clock.patched():
        order = []

        def work(name):
            for _ in range(3):
                time.sleep(1)
                order.append(name)

        threads = [threading.Thread(target=work, args=(n,)) for n in "abc"]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return order


@pytest.mark.slow
def test_a_hundred_seeds_give_the_same_run_twice():
    first = [interleaving(seed) for seed in range(100)]
    assert first == [interleaving(seed) for seed in range(100)]
    assert len(set(map(tuple, first))) > 10


# -- watching ---------------------------------------------------------------------------------------


def test_a_rate_lets_real_time_pass():
    with VirtualClock(rate=10_000) as clock:
        before = time.monotonic()
        for _ in range(4):
            clock.sleep(100)
        assert clock.now() == 400
        assert 0.035 < time.monotonic() - before < 50


def test_a_call_from_outside_ends_a_paced_wait():
    with VirtualClock(rate=1) as clock:
        event, foreign = clock.event(), threading.Thread(target=lambda: event.set())
        clock.call_later(3600, lambda: None)
        foreign.start()
        assert event.wait()
        foreign.join()
        assert clock.now() < 60


def test_an_interrupt_ends_a_paced_wait():
    import signal

    class Interrupt(Exception):
        pass

    def handler(*_):
        raise Interrupt

    def sleep_until_it_rings():
        signal.setitimer(signal.ITIMER_REAL, 0.01)  # under load it rings before the wait
        clock.sleep(3600)

    previous = signal.signal(signal.SIGALRM, handler)
    try:
        with VirtualClock(rate=1) as clock:
            with pytest.raises(Interrupt):
                sleep_until_it_rings()
            clock.sleep(0.001)
            assert clock.now() < 60
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)


@pytest.mark.parametrize("rate", [0, -1, float("nan")])
def test_a_rate_is_above_zero(rate):
    with pytest.raises(ValueError, match="rate"):
        VirtualClock(rate=rate)


def test_the_innermost_of_two_blocks_has_the_thread():
    with VirtualClock() as outer, outer.patched():
        with VirtualClock() as inner, inner.patched():
            time.sleep(5)
            assert (inner.now(), outer.now()) == (5, 0)
        time.sleep(2)
        assert outer.now() == 2


def test_a_chooser_decides_the_interleaving():
    asked = []

    def choose(names):
        asked.append(names)
        return len(names) - 1

    with VirtualClock(choose=choose) as clock:
        order = []
        for name in "abc":
            clock.spawn(lambda n=name: order.append(n), name=name)
        clock.sleep(1)
    assert order == ["c", "b", "a"]
    assert asked == [["a", "b", "c"], ["a", "b"]]


# -- what was made before --------------------------------------------------------------------------


@pytest.fixture
def pool():
    with concurrent.futures.ThreadPoolExecutor(2, "mine") as pool:
        yield pool


def slow(seconds):
    time.sleep(seconds)
    return time.monotonic(), threading.current_thread().name


@pytest.mark.parametrize("used_before", [False, True])
def test_a_pool_made_before_runs_in_virtual_time(clock, pool, used_before):
    if used_before:
        assert pool.submit(str, 1).result() == "1"
    with clock.patched():
        ends = list(pool.map(slow, [30, 20, 10]))
        with pytest.raises(concurrent.futures.TimeoutError):
            pool.submit(time.sleep, 100).result(timeout=50)
    assert [end for end, _ in ends] == [30, 20, 30]
    assert all(name.startswith("mine") for _, name in ends)
    assert pool.submit(str, 2).result() == "2"


def test_a_pool_made_before_may_be_shut_down_inside(clock, pool):
    with clock.patched():
        future = pool.submit(slow, 5)
        pool.shutdown()
        assert future.done()
        with pytest.raises(RuntimeError, match="after shutdown"):
            pool.submit(slow, 5)
    assert clock.now() == 5


def test_queues_conditions_and_semaphores_made_before():
    items, condition, semaphore = queue.Queue(), threading.Condition(), threading.Semaphore(0)
    with VirtualClock() as clock, clock.patched():
        with pytest.raises(queue.Empty):
            items.get(timeout=60)
        with condition:
            assert not condition.wait(40)
        assert not semaphore.acquire(timeout=20)
        assert clock.now() == 120


@pytest.mark.parametrize("utc", [time.gmtime, time.localtime])
def test_calendar_time_of_now_is_virtual(patched, utc):
    utc = getattr(time, utc.__name__)
    start = time.mktime(time.localtime())
    time.sleep(3600)
    assert time.mktime(time.localtime()) - start == 3600
    assert utc() == utc(time.time())
    assert utc(0).tm_year in {1969, 1970}
    assert time.ctime() == time.ctime(time.time())
    assert time.asctime() == time.asctime(time.localtime())
    assert time.strftime("%H:%M:%S") == time.strftime("%H:%M:%S", time.localtime())


def test_every_timer_of_asyncio(patched):
    async def main():
        loop, fired = asyncio.get_running_loop(), []
        loop.call_later(30, fired.append, "later")
        loop.call_at(loop.time() + 20, fired.append, "at")
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(40):
                await asyncio.Future()
        assert fired == ["at", "later"]
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.Event().wait(), 10)
        done, waiting = await asyncio.wait([asyncio.ensure_future(asyncio.sleep(99))], timeout=5)
        assert (len(done), len(waiting)) == (0, 1)
        return loop.time()

    assert asyncio.run(main()) == 55 == patched.now()
