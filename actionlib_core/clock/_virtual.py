"""Virtual time: real threads, of which one runs at a time, and time that jumps when all wait.

The participants are threads of the operating system, so that thread ids, thread-local data and
stacks are as user code expects. `benchmarks/virtual_time.py` measures their cost.

A thread runs from the moment it receives the turn at its gate until it waits and gives the turn to
another. The lock guards the tables for `set_event` and `call_later` calls of other threads; it is
not what keeps participants from running at the same time.
"""

from __future__ import annotations

import contextlib
import contextvars
import itertools
import math
import operator
import os
import random
import threading
import time
import weakref
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core.clock._deadlines import Deadlines
from actionlib_core.clock._gates import LockGate, make_gate
from actionlib_core.clock._protocol import check_seconds
from actionlib_core.clock._real import REAL, RealEvent
from actionlib_core.clock._serial import report_callback
from actionlib_core.clock._virtual_parts import (
    Deadlock,
    Participant,
    Stopped,
    TimeLimit,
    VirtualEvent,
    VirtualTask,
    VirtualTimer,
    name_waits,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterable, Iterator, Mapping
    from typing import Self

T = TypeVar("T")

START_TIME_NS = 1_000_000_000 * 1_000_000_000  # 2001-09-09T01:46:40Z: stamps of tests never change
INTERRUPT_S = 1.0  # longest wait of an interrupted thread for its turn [real s]
JOIN_S = 5.0  # longest wait of `close` for a thread to unwind [real s]

_clocks: weakref.WeakSet[VirtualClock] = weakref.WeakSet()


class VirtualClock:
    """Deterministic time for tests.

    Participants are the thread that made the clock and every `spawn`; one of them runs at a time.
    When it waits, another one gets the turn; when all wait, time jumps to the next deadline. The
    seed chooses the next one among those that can go on: the same seed gives the same run, another
    seed another interleaving, None takes turns in order. A wait that can never end raises
    `Deadlock` in the thread that made the clock.

    Use it as a context manager, or `close` it: this ends participants that still wait.

    Args:
        seed: Selects the interleaving.
        rate: Virtual seconds per real second, for watching a run; None: time jumps at once.
        choose: Called with the names of the participants and callbacks that can go on, at least
            two; returns the index of the next one. For going through interleavings one by one.
        begin_ns: The wall time at its begin [ns since the epoch].

    Attributes:
        limit: When time would pass this [s], the wait of the thread that made the clock raises
            `TimeLimit`; None, the default: no limit.
        most_turns: After more turns than this at one time, that wait raises it too; None: no limit.
        numbers: A counter for ids that are to be the same in every run.

    Threads: only participants may wait; `Event.set` and `call_later` may come from any thread. What
        another thread calls later is called after that many real seconds if that is earlier, in
        another thread: a program that is busy lets no virtual time pass.

    Raises:
        ValueError: `rate` is not above 0.
    """

    def __init__(
        self,
        seed: int | None = None,
        *,
        rate: float | None = None,
        choose: Callable[[list[str]], int] | None = None,
        begin_ns: int = START_TIME_NS,
    ) -> None:
        if rate is not None and not rate > 0:
            raise ValueError(f"virtual clock: rate: got {rate!r}; expected a number over 0.")
        self.seed = seed
        self.rate = rate
        self._begin_ns = begin_ns
        self._pick = _picker(seed, choose)
        self.limit: float | None = None
        self.most_turns: int | None = None
        self._turns = 0  # turns since time was last advanced, to `_moment`
        self._moment = 0.0
        self.numbers = itertools.count(1)
        self._now = 0.0
        self._stepped = time.monotonic()  # with a `rate`: when `_now` was last advanced [real s]
        self._poke = RealEvent()  # with a `rate`: a call from outside ends the pause
        # Reentrant: a signal handler may set an event while its thread holds the lock.
        self._lock = threading.RLock()
        # Every other participant and timer is in exactly one place: ready to go on, or waiting.
        self._ready: list[Participant | VirtualTimer] = []
        self._count = itertools.count()
        self._waits: dict[Participant, int] = {}  # with the numbers of their waits
        self._deadlines: Deadlines[Participant | VirtualTimer] = Deadlines(_counting(self._waits))
        self._owner = Participant(threading.current_thread().name)
        self._owner.gate = make_gate()
        self._participants: dict[int, Participant] = {threading.get_ident(): self._owner}
        self._in_callback = False
        self._caller: int | None = None  # the thread of the callback
        self._closed = False
        _clocks.add(self)

    # -- the protocol --------------------------------------------------------------------------

    def now(self) -> float:
        return self._now

    def time_ns(self) -> int:
        return self._begin_ns + round(self._now * 1e9)

    def sleep(self, seconds: float) -> None:
        if seconds > 0:
            self.wait_for(None, seconds)
        else:
            check_seconds("sleep", seconds)

    def event(self, name: str = "an event") -> VirtualEvent:
        return VirtualEvent(self, name)

    def spawn(self, target: Callable[[], object], *, name: str) -> VirtualTask:
        # It gets a thread at its first turn (`Participant.begin`), which may never come.
        task = VirtualTask(self, target, contextvars.copy_context(), name)
        task.participant.job = task
        with self._lock:
            self._ready.append(task.participant)
        return task

    def call_later(self, delay: float, callback: Callable[[], object]) -> VirtualTimer:
        check_seconds("call_later", delay)
        timer = VirtualTimer(callback)
        with self._lock:
            if delay <= 0:
                self._ready.append(timer)
            elif delay < math.inf:
                self._deadlines.push(self._now + delay, next(self._count), timer)
        if self.rate is not None:  # a running pause may now be too long
            self._poke.set()
        if not self.is_participant(threading.get_ident()):
            timer.real = REAL.call_later(delay, lambda: self._call_from_outside(timer))
        return timer

    def _call_from_outside(self, timer: VirtualTimer) -> None:
        """Call a timer that a signal has led to: time may stand still, as a participant is busy."""
        with self._lock:
            callback, timer.callback = timer.callback, None
        if callback is not None and not self._closed:
            callback()

    def run_async(self, main: Coroutine[object, object, T]) -> T:
        import asyncio  # here: it takes 60 ms, and most programs never need it

        from actionlib_core.clock._virtual_loop import VirtualLoop

        with asyncio.Runner(loop_factory=lambda: VirtualLoop(self)) as runner:
            return runner.run(main)

    @contextlib.contextmanager
    def patched(self) -> Iterator[Self]:
        """Put `time.sleep`, `threading.Event().wait` and the like of user code on this clock.

        Covered inside the block, for this clock's participants only (other threads keep real time):
        `time.sleep`, `time`, `monotonic`, `perf_counter` and their `_ns` forms, `localtime`,
        `gmtime`, `ctime`, `asctime` and `strftime` of now; in `threading`: `Event`, `Condition`,
        `Semaphore`, `Barrier`, `Timer`, `Thread.start` (the new thread is a participant),
        `Thread.join`, `Lock` and `RLock` made inside the block; `queue` (a `SimpleQueue` made
        inside), thread pools of `concurrent.futures`, asyncio's loops and timers. Names that
        modules imported before (`from time import sleep`) are covered too, and so are events,
        conditions, semaphores, queues and pools that were made before.

        Not covered, because Python offers no way to do so: `datetime.now()`, `utcnow()` and
        `date.today()` return real time (`datetime.fromtimestamp(time.time())` does not); a `Lock`,
        `RLock` or `SimpleQueue` made before the block really blocks, for ever if another
        participant is to release or fill it. Sockets, processes and code in C take real time, in
        which the mission stands still. References other than a module's globals (a default
        argument, a class attribute) stay real. `time.sleep(0)` lets a microsecond pass, so that a
        loop around it ends.
        """
        from actionlib_core.clock._patched import install, remove

        try:  # around `install` too, so that a Ctrl-C during it leaves nothing replaced
            install(self)
            yield self
        finally:
            remove(self)

    # -- life ----------------------------------------------------------------------------------

    def close(self) -> None:
        """End every participant that still waits; later waits raise `Stopped`.

        Blocks: until their threads have unwound, `JOIN_S` real seconds at most each.
        """
        with self._lock:
            self._closed = True
        while True:  # again, as threads that unwind may have started others
            with self._lock:
                others = [p for p in (*self._waits, *self._ready) if isinstance(p, Participant)]
                others = [p for p in others if p is not self._owner]
                self._waits.clear()
                self._ready.clear()
                self._deadlines.clear()
            if not others:
                break
            for participant in others:
                participant.begin()
                participant.gate.release()
            for participant in others:
                participant.ended.wait(JOIN_S)
        # Clocks live on in frames, contexts and tracebacks, and the owner's gate is an open file:
        # replace it now. Only the owner itself certainly does not wait at it.
        if self._participants.get(threading.get_ident()) is self._owner:
            self._owner.gate = LockGate()

    def stop(self, tasks: Iterable[VirtualTask]) -> None:
        """End participants as if their process had ended: from now on their waits raise `Stopped`.

        Does not block: each unwinds at its next turn, without a step of time.
        """
        with self._lock:
            for task in tasks:
                task.participant.stopped = True
                self._wake(task.participant)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- for `patched()` ------------------------------------------------------------------------

    def is_participant(self, ident: int) -> bool:
        """Return whether the thread `ident` is a participant, or calls a callback of this clock.

        Callbacks run in the thread that gives the turn to others, which may be one that is ending.
        """
        return ident in self._participants or ident == self._caller

    def adopt(self, target: Callable[[], object], *, name: str) -> VirtualTask:
        """Make a participant for a thread of the caller, which calls `VirtualTask.run`."""
        task = VirtualTask(self, target, contextvars.copy_context(), name)
        task.participant.gate = make_gate()
        with self._lock:
            self._ready.append(task.participant)
        return task

    def disown(self, task: VirtualTask) -> None:
        """Forget a participant whose thread could not be started."""
        with self._lock:
            self._ready.remove(task.participant)

    def interrupt(self, ident: int, error: BaseException) -> bool:
        """Raise `error` in the participant in thread `ident` at its next turn.

        Returns:
            Whether it waits on this clock: for an event, for time or for its turn.
        """
        with self._lock:
            participant = self._participants.get(ident)
            if participant is None or participant not in {*self._waits, *self._ready}:
                return False
            participant.error = error
            self._wake(participant)
            return True

    # -- for participants and their events -----------------------------------------------------

    def wait_for(self, event: VirtualEvent | None, timeout: float | None) -> bool:
        """Let others run until `event` is set or `timeout` has passed; return whether it is set."""
        me = self._participants.get(threading.get_ident())
        if me is None or self._in_callback:
            raise _refusal(in_callback=me is not None)
        with self._lock:
            if self._closed or me.stopped:
                raise Stopped
            if event is not None and event.flag:  # set since the caller has checked it
                return True
            deadline = None if timeout is None or timeout == math.inf else self._now + timeout
            if deadline is not None and self._is_alone(deadline):
                self._now = deadline
                return False
            # Added to the heap only when another participant gets the turn: most never need it.
            me.turn = self._waits[me] = next(self._count)
            me.event, me.deadline, me.woken = event, deadline, False
            me.noted = deadline is None
            if event is not None:
                event.waiters.append(me)
        self._hand_over(me)
        if me.error is not None:
            error, me.error = me.error, None
            raise error
        self._check_open(me)
        return me.woken

    def _is_alone(self, deadline: float) -> bool:
        """Return whether nothing else can run before `deadline`: then the wait only steps time."""
        if self._ready or self.rate is not None or self._is_past(deadline):
            return False
        due = self._next_due()
        return due is None or due > deadline

    def _check_open(self, me: Participant) -> None:
        if me.stopped or (self._closed and me is not self._owner):
            raise Stopped

    def enter(self, me: Participant) -> bool:
        """Start the first turn in a new thread; False when the clock was closed before."""
        with self._lock:
            self._participants[threading.get_ident()] = me
        return not (self._closed or me.stopped)

    def _hand_over(self, me: Participant) -> None:
        """Give the turn to the next participant, and wait for it to come back.

        A signal handler may raise here (a Ctrl-C, for example). `steps` tells how far the exchange
        has come: 0: the turn is still mine; 1: given away; 2: given away and received.
        """
        steps: list[object] = []
        chosen: Participant | None = None
        try:
            chosen = self._next_turn(me)
            if chosen is me:
                return
            gates: tuple[Any, ...] = (me.gate.acquire,)
            if chosen is not None:
                chosen.begin()
                gates = (chosen.gate.release, me.gate.acquire)
            # In C, so that no signal handler runs between the end of a call and its entry here.
            steps.extend(map(operator.call, gates))
        except BaseException as error:
            with self._lock:
                self._wake(me)
                if not steps:  # the turn is still mine
                    self._ready = [r for r in self._ready if r is not me]
                    self._ready[:0] = [] if chosen in {None, me} else [chosen]
                    raise
            self._poke.set()
            if len(steps) == 1 and not me.gate.acquire_within(INTERRUPT_S):
                self._closed = True  # another participant does not wait: the clock is unusable
                raise
            me.error = error

    def leave(self, me: Participant) -> None:
        """Give the turn away for good, at the end of the participant's thread."""
        with self._lock:
            self._participants.pop(threading.get_ident(), None)
            closed = self._closed
        chosen = None if closed else self._next_turn()
        if chosen is not None:
            chosen.begin()
            chosen.gate.release()
        me.ended.set()

    def _next_turn(self, me: Participant | None = None) -> Participant | None:
        """Run callbacks and choose who goes on: the waiting `me` or another; None: nobody can."""
        while True:
            if self.rate is not None and (pause := self._pause(me)):
                self._pace(pause)
                continue
            with self._lock:
                chosen = self._choose(me)
                if not isinstance(chosen, VirtualTimer):
                    if chosen is not me:
                        self._note(me)
                    return chosen
                callback, chosen.callback = chosen.callback, None
                if chosen.real is not None:
                    chosen.real.cancel()
            if callback is not None:
                self._call(callback)

    def _note(self, me: Participant | None) -> None:
        """Put the deadline of `me`, who waits, into the heap, where others see it."""
        if me is not None and me.deadline is not None and not me.noted:
            me.noted = True
            self._deadlines.push(me.deadline, me.turn, me)

    def _pause(self, me: Participant | None) -> float:
        """Return the real seconds to wait before the next jump."""
        with self._lock:
            self._poke.clear()
            self._note(me)
            due = self._next_due()
            if self.rate is None or self._ready or due is None:
                return 0.0
            return max(0.0, (due - self._now) / self.rate - (time.monotonic() - self._stepped))

    def _pace(self, pause: float) -> None:
        """Let real time pass; a call from outside ends it early, and virtual time advances less."""
        if self._poke.wait(pause) and self.rate is not None:
            with self._lock:
                real = time.monotonic()
                due = self._next_due()
                passed = self._now + (real - self._stepped) * self.rate
                self._now = passed if due is None else min(passed, due)
                self._stepped = real

    def _choose(self, me: Participant | None) -> Participant | VirtualTimer | None:
        ready = self._ready
        # Nobody is ready: time advances. If only `me` waits for time, without the heap.
        if not ready:
            if me is not None and me.deadline is not None and self._is_alone(me.deadline):
                self._now = me.deadline
                self._stop_waiting(me, woken=False)
                return me
            self._note(me)
            self._jump()
        if self.most_turns is not None and self._is_stuck() and self._stop_owner():
            return self._owner
        if ready:
            return ready.pop(0 if len(ready) == 1 or self._pick is None else self._pick(ready))
        # Nothing can run any more: end the owner's wait with an error.
        if self._owner in self._waits:
            waits = name_waits(self._waits, self._participants)
            over = self.limit is not None and self._next_due() is not None
            self._owner.error = TimeLimit(self._now, waits) if over else Deadlock(waits)
            self._wake(self._owner)
            ready.clear()
            return self._owner
        return None

    def _is_stuck(self) -> bool:
        """Count a turn; return whether there were too many since time was last advanced."""
        if self._now != self._moment:
            self._moment, self._turns = self._now, 0
        self._turns += 1
        return self.most_turns is not None and self._turns > self.most_turns

    def _stop_owner(self) -> bool:
        """End a wait of the owner with `TimeLimit`, as turns are taken without time passing."""
        owner = self._owner
        if owner not in self._waits and owner not in self._ready:
            return False
        waits = name_waits({owner: 0, **self._waits}, self._participants)
        owner.error = TimeLimit(self._now, waits, self._turns - 1)
        self._wake(owner)
        self._ready.remove(owner)
        self._turns = 0
        return True

    def _is_past(self, due: float) -> bool:
        return self.limit is not None and due > self.limit

    def _next_due(self) -> float | None:
        first = self._deadlines.first()
        return None if first is None else first[0]

    def _jump(self) -> None:
        """Advance to the next deadline; everything that is due then becomes ready."""
        due = self._next_due()
        if due is None or self._is_past(due):
            return
        self._now = max(due, self._now)
        self._stepped = time.monotonic() if self.rate is not None else 0.0
        while self._next_due() == due:
            what = self._deadlines.pop()
            if isinstance(what, VirtualTimer):
                self._ready.append(what)
            else:
                self._end_wait(what, woken=False)

    def _call(self, callback: Callable[[], object]) -> None:
        # The thread may be one that is just leaving, so that it is no participant any more.
        self._in_callback, self._caller = True, threading.get_ident()
        try:
            contextvars.Context().run(callback)
        except Stopped:
            pass  # a callback of participants that were stopped
        except BaseException as error:  # reported here, and the run goes on
            main = threading.current_thread() is threading.main_thread()
            if main and isinstance(error, KeyboardInterrupt):  # Ctrl-C, not the callback's error
                raise
            report_callback("clock-timers")
        finally:
            self._in_callback, self._caller = False, None

    def set_event(self, event: VirtualEvent) -> None:
        """Set `event`; the participants that wait for it can go on."""
        with self._lock:
            event.flag = True
            for participant in tuple(event.waiters):
                self._wake(participant)
        if self.rate is not None:
            self._poke.set()

    def _wake(self, participant: Participant) -> None:
        if participant in self._waits:
            self._end_wait(participant, woken=True)

    def _end_wait(self, participant: Participant, *, woken: bool) -> None:
        self._stop_waiting(participant, woken=woken)
        self._ready.append(participant)

    def _stop_waiting(self, participant: Participant, *, woken: bool) -> None:
        del self._waits[participant]
        event, participant.event = participant.event, None
        if event is not None and participant in event.waiters:
            event.waiters.remove(participant)
        participant.noted = True
        participant.woken = woken


def _counting(
    waits: Mapping[Participant, int],
) -> Callable[[int, Participant | VirtualTimer], bool]:
    """Return a function that tells timers that were not cancelled and waits that have not ended."""

    def counts(number: int, what: Participant | VirtualTimer) -> bool:
        if isinstance(what, VirtualTimer):
            return what.callback is not None
        return waits.get(what) == number

    return counts


def _refusal(*, in_callback: bool) -> RuntimeError:
    if in_callback:
        return RuntimeError("virtual clock: a callback may not wait. Try clock.spawn(...).")
    return RuntimeError(
        f"virtual clock: thread {threading.current_thread().name!r} may not wait; expected "
        "a thread started by the clock. Try clock.spawn(...) instead of threading.Thread."
    )


def _picker(
    seed: int | None, choose: Callable[[list[str]], int] | None
) -> Callable[[list[Participant | VirtualTimer]], int] | None:
    """Return a function that chooses the index of the next one; None: always the first."""
    if choose is not None:
        return lambda ready: choose([each.name for each in ready])
    if seed is None:
        return None
    pick = random.Random(seed).randrange  # noqa: S311  no secret
    return lambda ready: pick(len(ready))


def _forget_all() -> None:
    """Remove all participants in a forked child: their threads exist only in the parent."""
    for clock in _clocks:
        clock._participants.clear()  # noqa: SLF001  one module


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_all)
