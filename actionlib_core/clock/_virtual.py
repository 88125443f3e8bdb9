"""Virtual time: real threads, one at a time, and time that jumps when all of them wait."""

from __future__ import annotations

import _thread
import asyncio
import contextvars
import heapq
import itertools
import random
import selectors
import threading
from typing import TYPE_CHECKING, TypeVar

from actionlib_core.clock._serial import report_thread_exception

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Mapping
    from types import TracebackType
    from typing import Self

    from _typeshed import FileDescriptorLike as _File

T = TypeVar("T")

START_TIME_NS = 1_000_000_000 * 1_000_000_000  # 2001-09-09T01:46:40Z: stamps of tests never change
INTERRUPT_S = 1.0  # real seconds that an interrupted thread waits for its turn
JOIN_S = 5.0  # real seconds that `close` gives a thread to unwind


class Deadlock(Exception):  # noqa: N818  the field's word
    """Every participant waits and nothing can ever wake one of them.

    Attributes:
        waits: Participant name -> what it waits for.
    """

    def __init__(self, waits: Mapping[str, str]) -> None:
        self.waits = dict(waits)
        lines = [f"  - {name}: waits for {what}" for name, what in self.waits.items()]
        super().__init__(
            "virtual clock: every participant waits and no deadline is left; "
            "expected at least one that can go on:\n" + "\n".join(lines)
        )


class _Stopped(BaseException):
    """The clock was closed while this participant waited."""


class _Participant:
    """One thread under the clock; `gate` is locked while it must not run."""

    __slots__ = ("error", "event", "gate", "name", "waiting", "woken")

    def __init__(self, name: str) -> None:
        self.name = name
        self.gate = _thread.allocate_lock()
        self.gate.acquire()
        self.waiting = ""
        self.event: VirtualEvent | None = None
        self.woken = True
        self.error: BaseException | None = None


class VirtualEvent:
    """An event of a `VirtualClock`; `set` may come from any thread."""

    __slots__ = ("_clock", "_flag", "_waiters", "name")

    def __init__(self, clock: VirtualClock, name: str = "an event") -> None:
        self._clock = clock
        self._flag = False
        self._waiters: list[_Participant] = []
        self.name = name

    def is_set(self) -> bool:
        return self._flag

    def set(self) -> None:
        self._flag = True
        if self._waiters:
            self._clock._wake_all(self._waiters)  # noqa: SLF001  the two are one module's secret

    def clear(self) -> None:
        self._flag = False

    def wait(self, timeout: float | None = None) -> bool:
        if self._flag:
            return True
        if timeout is not None and timeout <= 0:
            return False
        return self._clock._wait(self, timeout) or self._flag  # noqa: SLF001


class VirtualTask:
    """A participant's thread as its starter sees it."""

    __slots__ = ("_done", "error", "ident", "name")

    def __init__(self, clock: VirtualClock, name: str) -> None:
        self._done = VirtualEvent(clock, f"the end of {name}")
        self.name = name
        self.ident: int | None = None
        self.error: BaseException | None = None

    def is_alive(self) -> bool:
        return not self._done.is_set()

    def join(self, timeout: float | None = None) -> bool:
        return self._done.wait(timeout)


class VirtualTimer:
    """A scheduled callback."""

    __slots__ = ("callback",)

    def __init__(self, callback: Callable[[], object]) -> None:
        self.callback: Callable[[], object] | None = callback

    def cancel(self) -> None:
        self.callback = None


class VirtualClock:
    """Deterministic time for tests.

    One participant runs at a time: the thread that made the clock, and every `spawn`. Another one
    gets its turn when the running one waits; when all wait, time jumps to the next deadline. The
    seed chooses who is next among those that can go on: the same seed gives the same run, another
    seed another interleaving, None takes turns in order. A wait that can never end raises
    `Deadlock` in the thread that made the clock.

    Use it as a context manager, or `close` it: participants that still wait are ended.

    Threads: only participants may wait; `Event.set` and `call_later` may come from any thread.
    """

    def __init__(self, seed: int | None = None) -> None:
        self.seed = seed
        self._random = None if seed is None else random.Random(seed)  # noqa: S311  no secret
        self._now = 0.0
        self._lock = threading.RLock()
        self._ready: list[_Participant | VirtualTimer] = []
        self._deadlines: list[tuple[float, int, _Participant | VirtualTimer, int]] = []
        self._count = itertools.count()
        self._waits: dict[_Participant, int] = {}
        self._owner = _Participant(threading.current_thread().name)
        self._participants: dict[int, _Participant] = {threading.get_ident(): self._owner}
        self._threads: list[threading.Thread] = []
        self._in_callback = False
        self._closed = False

    # -- the protocol --------------------------------------------------------------------------

    def now(self) -> float:
        return self._now

    def time_ns(self) -> int:
        return START_TIME_NS + round(self._now * 1e9)

    def sleep(self, seconds: float) -> None:
        if seconds > 0:
            self._wait(None, seconds)

    def event(self, name: str = "an event") -> VirtualEvent:
        return VirtualEvent(self, name)

    def spawn(self, target: Callable[[], object], *, name: str) -> VirtualTask:
        task = VirtualTask(self, name)
        participant = _Participant(name)
        context = contextvars.copy_context()

        def run() -> None:
            participant.gate.acquire()
            task.ident = threading.get_ident()
            try:
                if not self._closed:
                    context.run(target)
            except _Stopped:
                pass
            except BaseException as error:  # noqa: BLE001  the thread's border: kept and reported
                task.error = error
                if not isinstance(error, SystemExit):
                    report_thread_exception()
            finally:
                task.ident = None
                task._done.set()  # noqa: SLF001
                self._leave()

        thread = threading.Thread(target=run, name=name, daemon=True)
        with self._lock:
            self._threads = [t for t in self._threads if t.is_alive()]
            thread.start()
            self._threads.append(thread)
            assert thread.ident is not None
            self._participants[thread.ident] = participant
            self._ready.append(participant)
        return task

    def call_later(self, delay: float, callback: Callable[[], object]) -> VirtualTimer:
        timer = VirtualTimer(callback)
        with self._lock:
            if delay <= 0:
                self._ready.append(timer)
            else:
                self._push(self._now + delay, timer, 0)
        return timer

    def run_async(self, main: Coroutine[object, object, T]) -> T:
        with asyncio.Runner(loop_factory=lambda: _VirtualLoop(self)) as runner:
            return runner.run(main)

    # -- life ----------------------------------------------------------------------------------

    def close(self) -> None:
        """End every participant that still waits; later waits raise.

        Blocks: until their threads have unwound, `JOIN_S` real seconds at most each.
        """
        with self._lock:
            self._closed = True
        while True:
            with self._lock:
                others = [p for p in self._waits if p is not self._owner]
                others += [p for p in self._ready if isinstance(p, _Participant)]
                threads = [t for t in self._threads if t is not threading.current_thread()]
                self._waits.clear()
                self._ready.clear()
                self._deadlines.clear()
            if not others:
                break
            for participant in others:
                participant.gate.release()
            for thread in threads:
                thread.join(JOIN_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    # -- scheduling ----------------------------------------------------------------------------

    def _push(self, due: float, what: _Participant | VirtualTimer, wait: int) -> None:
        heapq.heappush(self._deadlines, (due, next(self._count), what, wait))

    def _wait(self, event: VirtualEvent | None, timeout: float | None) -> bool:
        """Let others run until `event` is set or `timeout` has passed; whether it was set."""
        me = self._participants.get(threading.get_ident())
        if me is None:
            raise RuntimeError(
                f"virtual clock: thread {threading.current_thread().name!r} may not wait; expected "
                "a thread started by the clock. Try clock.spawn(...) instead of threading.Thread."
            )
        if self._in_callback:
            raise RuntimeError("virtual clock: a callback may not wait. Try clock.spawn(...).")
        with self._lock:
            if self._closed:
                raise _Stopped
            wait = next(self._count)
            self._waits[me] = wait
            me.event, me.woken = event, False
            me.waiting = _describe(event, None if timeout is None else self._now + timeout)
            if event is not None:
                event._waiters.append(me)  # noqa: SLF001
            if timeout is not None:
                self._push(self._now + timeout, me, wait)
        if self._pass_on(me):
            self._sit_out(me)
        if me.error is not None:
            error, me.error = me.error, None
            raise error
        self._check_open(me)
        return me.woken

    def _check_open(self, me: _Participant) -> None:
        if self._closed and me is not self._owner:
            raise _Stopped

    def _sit_out(self, me: _Participant) -> None:
        """Wait for the turn; so does, for a moment, what a signal handler raised."""
        try:
            me.gate.acquire()
        except BaseException as error:
            with self._lock:
                self._wake(me)
            if not me.gate.acquire(timeout=INTERRUPT_S):
                self._closed = True  # another participant never waits: this clock is broken
                raise
            me.error = error

    def _leave(self) -> None:
        """Hand the turn on for good: the participant's thread ends."""
        with self._lock:
            self._participants.pop(threading.get_ident(), None)
            if self._closed:
                return
        self._pass_on(None)

    def _pass_on(self, me: _Participant | None) -> bool:
        """Run callbacks and choose who goes on; False when that is `me`."""
        while True:
            with self._lock:
                chosen = self._choose()
            if isinstance(chosen, VirtualTimer):
                self._call(chosen)
            elif chosen is me:
                return False
            else:
                if chosen is not None:
                    chosen.gate.release()
                return True

    def _choose(self) -> _Participant | VirtualTimer | None:
        if not self._ready:
            self._jump()
        if self._ready:
            if self._random is None or len(self._ready) == 1:
                return self._ready.pop(0)
            return self._ready.pop(self._random.randrange(len(self._ready)))
        if self._owner in self._waits:
            waits = {p.name: p.waiting for p in self._waits}
            self._owner.error = Deadlock(waits)
            self._wake(self._owner)
            self._ready.clear()
            return self._owner
        return None

    def _jump(self) -> None:
        """Advance to the next deadline that still matters; all that are due become ready."""
        due = None
        while self._deadlines:
            time, _, what, wait = self._deadlines[0]
            if due is not None and time > due:
                return
            heapq.heappop(self._deadlines)
            if isinstance(what, VirtualTimer):
                if what.callback is not None:
                    due = self._now = max(time, self._now)
                    self._ready.append(what)
            elif self._waits.get(what) == wait:
                due = self._now = max(time, self._now)
                self._end_wait(what, woken=False)

    def _call(self, timer: VirtualTimer) -> None:
        callback, timer.callback = timer.callback, None
        if callback is None:
            return
        self._in_callback = True
        try:
            contextvars.Context().run(callback)
        except Exception:  # noqa: BLE001  a border: reported, the run goes on
            report_thread_exception()
        finally:
            self._in_callback = False

    def _wake_all(self, waiters: list[_Participant]) -> None:
        with self._lock:
            for participant in tuple(waiters):
                self._wake(participant)

    def _wake(self, participant: _Participant) -> None:
        if participant in self._waits:
            self._end_wait(participant, woken=True)

    def _end_wait(self, participant: _Participant, *, woken: bool) -> None:
        del self._waits[participant]
        event, participant.event = participant.event, None
        if event is not None and participant in event._waiters:  # noqa: SLF001
            event._waiters.remove(participant)  # noqa: SLF001
        participant.woken = woken
        self._ready.append(participant)


def _describe(event: VirtualEvent | None, deadline: float | None) -> str:
    what = "time to pass" if event is None else event.name
    return what if deadline is None else f"{what} (until {deadline:.6g} s)"


class _VirtualSelector(selectors.BaseSelector):
    """What asyncio waits on: no sockets, only the clock."""

    def __init__(self, clock: VirtualClock) -> None:
        self.wakeup = clock.event("a coroutine")
        self._keys: dict[object, selectors.SelectorKey] = {}

    def register(self, fileobj: _File, events: int, data: object = None) -> selectors.SelectorKey:
        fd = fileobj if isinstance(fileobj, int) else fileobj.fileno()
        key = selectors.SelectorKey(fileobj, fd, events, data)
        self._keys[fileobj] = key
        return key

    def unregister(self, fileobj: _File) -> selectors.SelectorKey:
        return self._keys.pop(fileobj)

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        self.wakeup.wait(timeout)
        self.wakeup.clear()
        return []

    def get_map(self) -> Mapping[object, selectors.SelectorKey]:  # type: ignore[override]
        return self._keys


class _VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop whose time and waiting are the clock's."""

    def __init__(self, clock: VirtualClock) -> None:
        self._virtual_clock = clock
        self._virtual_selector = _VirtualSelector(clock)
        super().__init__(self._virtual_selector)

    def time(self) -> float:
        return self._virtual_clock.now()

    def _write_to_self(self) -> None:
        self._virtual_selector.wakeup.set()
