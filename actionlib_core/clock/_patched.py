"""Replacements for Python's own ways to wait, for the participants of a virtual clock.

The replacements check the calling thread: a participant of a clock inside `patched()` gets virtual
time, every other thread gets Python's original behaviour. They are installed with the first clock
and removed with the last one.
"""

from __future__ import annotations

import asyncio
import queue
import sys
import threading
import time
import weakref
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from actionlib_core.clock._real import use_clock
from actionlib_core.clock._virtual_loop import VirtualLoop

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import ThreadPoolExecutor
    from types import FrameType

    from actionlib_core.clock._virtual import VirtualClock
    from actionlib_core.clock._virtual_parts import VirtualEvent, VirtualTask

YIELD_S = 1e-6  # step of `time.sleep(0)`: others get their turn, and a loop around it ends
# Modules that wait for something outside the process, or measure the test run itself.
REAL_TIME = (
    "actionlib_core.clock",
    "multiprocessing",
    "selectors",
    "subprocess",
    "socketserver",
    "faulthandler",
    "importlib",
    "_frozen_importlib",
    "_thread",
    "_pytest",
    "pluggy",
    "execnet",
    "xdist",
    "pytest_timeout",
)
# Packages whose locks guard a few lines that never wait: real locks do, and are faster.
SHORT_LOCKS = ("actionlib_core", "smachpy", "smachpy_viz", "logging")

# The originals, for use in this module. (`_getframe`: some callers keep real time.)
_getframe = sys._getframe
_sleep, _allocate = time.sleep, threading.Lock
_localtime, _asctime = time.localtime, time.asctime
_thread_start, _thread_join = threading.Thread.start, threading.Thread.join
_thread_is_alive = threading.Thread.is_alive

_guard = _allocate()
_clocks: list[VirtualClock] = []  # those inside `patched()`
_bypass: set[int] = set()  # threads that use real time, while they start or join a thread
_places: list[tuple[dict[str, Any], str, Any, Any]] = []  # module globals that were replaced
_seen: dict[str, tuple[int, int]] = {}  # modules searched before: identity and size of globals
_found: dict[str, list[tuple[str, Any]]] = {}  # their names that are to be replaced
_tasks: dict[threading.Thread, VirtualTask] = {}  # running user threads that are participants
_SimpleQueue = queue.SimpleQueue
_pool: list[Callable[..., Any]] = []  # submit and shutdown of pools, and their class
_twins: weakref.WeakKeyDictionary[ThreadPoolExecutor, dict[VirtualClock, ThreadPoolExecutor]] = (
    weakref.WeakKeyDictionary()
)


def install(clock: VirtualClock) -> None:
    """Give the participants of `clock` virtual time."""
    with _guard:
        _clocks.append(clock)
        if len(_clocks) == 1:
            _replace()


def remove(clock: VirtualClock) -> None:
    """Undo `install`, also an incomplete one; with the last clock, restore Python's originals."""
    with _guard:
        if clock in _clocks:
            _clocks.remove(clock)
        if not _clocks:
            _restore()
    _forget_twins(clock)


def _here() -> VirtualClock | None:
    """Return the clock of the calling thread, the innermost of several; None: real time."""
    ident = threading.get_ident()
    if ident not in _bypass:
        for clock in reversed(_clocks):
            if clock.is_participant(ident):
                return clock
    return None


def _belongs(frame: FrameType, packages: tuple[str, ...]) -> bool:
    return _is_in(frame.f_globals.get("__name__", ""), packages)


def _is_in(module: str, packages: tuple[str, ...]) -> bool:
    return module in packages or module.startswith(tuple(f"{name}." for name in packages))


# -- time ------------------------------------------------------------------------------------------


def _virtual_sleep(seconds: float, /) -> None:
    clock = _here()
    if clock is None or _belongs(_getframe(1), REAL_TIME):
        _sleep(seconds)
    elif seconds < 0:
        raise ValueError("sleep length must be non-negative")
    else:
        clock.sleep(max(seconds, YIELD_S))


def _reader(real: Callable[[], Any], virtual: Callable[[VirtualClock], Any]) -> Callable[[], Any]:
    def read() -> Any:
        clock = _here()
        if clock is None or _belongs(_getframe(1), REAL_TIME):
            return real()
        return virtual(clock)

    return read


def _now_ns(clock: VirtualClock) -> int:
    return round(clock.now() * 1e9)


def _of_now(real: Callable[..., Any], index: int) -> Callable[..., Any]:
    """Replace a function whose argument number `index` is a time, by default the present."""

    def convert(*args: Any) -> Any:
        clock = _here()
        if clock is None or len(args) > index or _belongs(_getframe(1), REAL_TIME):
            return real(*args)
        now = clock.time_ns() / 1e9
        return real(*args, _localtime(now) if index or real is _asctime else now)

    return convert


# -- locks -----------------------------------------------------------------------------------------


class PatchedLock:
    """A lock that participants wait for in virtual time, other threads in real time."""

    def __init__(self) -> None:
        self._real = _allocate()
        self._waiters: list[VirtualEvent] = []

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        if self._real.acquire(blocking=False):
            return True
        if not blocking:
            return False
        clock = _here()
        if clock is None:
            return self._real.acquire(timeout=timeout)
        return self._wait(clock, None if timeout < 0 else clock.now() + timeout)

    def _wait(self, clock: VirtualClock, deadline: float | None) -> bool:
        event = clock.event(f"what {_call_site()} waits for")
        self._waiters.append(event)
        try:
            while not self._real.acquire(blocking=False):
                left = None if deadline is None else deadline - clock.now()
                if not event.wait(left):
                    return self._real.acquire(blocking=False)
                event.clear()
            return True
        finally:
            self._waiters.remove(event)

    def release(self) -> None:
        self._real.release()
        for event in tuple(self._waiters):
            event.set()

    def locked(self) -> bool:
        return self._real.locked()

    def _at_fork_reinit(self) -> None:
        self._real = _allocate()
        self._waiters.clear()

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()


def _call_site() -> str:
    """Return the line of the user's code that waits."""
    frame: FrameType | None = _getframe(1)
    while frame is not None and _belongs(frame, _WAITERS):
        frame = frame.f_back
    if frame is None:
        return "a thread"
    return f"{frame.f_code.co_filename}:{frame.f_lineno}"


_WAITERS = ("actionlib_core.clock", "asyncio", "concurrent.futures", "queue", "threading")


def _lock() -> Any:
    return _allocate() if _is_short(_getframe(1)) else PatchedLock()


def _is_short(caller: FrameType) -> bool:
    """Return whether a lock made there is a real one.

    That is one of a thread with real time, of our own packages, or made by a module's import.
    """
    if _here() is None or caller.f_code.co_name == "<module>":
        return True
    return _belongs(caller, SHORT_LOCKS)


def _make_rlock(real: Callable[[], Any]) -> Callable[[], Any]:
    def make() -> Any:
        if _is_short(_getframe(1)):
            return real()
        return threading._RLock()  # noqa: SLF001  Python's version, on the replaced lock

    return make


def _make_simple_queue(real: Callable[[], Any]) -> Callable[[], Any]:
    def make() -> Any:
        return real() if _here() is None else queue._PySimpleQueue()  # type: ignore[attr-defined]  # noqa: SLF001

    return make


# -- threads ---------------------------------------------------------------------------------------


def _start(thread: threading.Thread) -> None:
    """Start a thread; a participant's thread becomes a participant."""
    clock = _here()
    if clock is None or _belongs(_getframe(1), REAL_TIME):
        _really(_thread_start, thread)
        return
    run = thread.run

    def target() -> None:
        with use_clock(clock):
            run()

    # The thread stays the user's own object; only its `run` waits for the turn first.
    task = clock.adopt(target, name=thread.name)

    def run_in_turn() -> None:
        name = thread.name
        try:
            task.run()
        finally:
            thread.name = name
            del thread.run
            _tasks.pop(thread, None)

    thread.run = run_in_turn  # type: ignore[method-assign]
    _tasks[thread] = task
    try:
        _really(_thread_start, thread)
    except BaseException:
        clock.disown(task)
        del _tasks[thread]
        raise


def _join(thread: threading.Thread, timeout: float | None = None) -> None:
    task = _tasks.get(thread)
    if task is None or _here() is None:
        _really(_thread_join, thread, timeout)
    elif task.join(timeout):
        _really(_thread_join, thread)  # its last steps come after its last turn


def _is_alive(thread: threading.Thread) -> bool:
    task = _tasks.get(thread)
    return _thread_is_alive(thread) if task is None else task.is_alive()


def _really(function: Callable[..., None], *arguments: object) -> None:
    """Call `function`, which waits for a thread to start or end, in real time."""
    ident = threading.get_ident()
    _bypass.add(ident)
    try:
        function(*arguments)
    finally:
        _bypass.discard(ident)


# -- executors -------------------------------------------------------------------------------------


def _submit(pool: ThreadPoolExecutor, function: Any, /, *args: Any, **kwargs: Any) -> Any:
    """Run a participant's work on participants, even if the pool was made outside the block."""
    clock = _here()
    used = pool if clock is None or _takes_part(pool) else _twin(pool, clock)
    return _pool[0](used, function, *args, **kwargs)


def _shutdown(pool: ThreadPoolExecutor, *args: Any, **kwargs: Any) -> None:
    for twin in _twins.pop(pool, {}).values():
        _pool[1](twin, *args, **kwargs)
    _pool[1](pool, *args, **kwargs)


def _takes_part(pool: Any) -> bool:
    """Return whether a pool can be used directly: made inside the block, or shut down.

    A pool that is shut down refuses the work itself.
    """
    return type(pool._work_queue) is not _SimpleQueue or pool._shutdown  # noqa: SLF001  no other way


# A pool has no public attributes for the arguments of its constructor.
_POOL_ARGUMENTS = attrgetter("_max_workers", "_thread_name_prefix", "_initializer", "_initargs")


def _twin(pool: Any, clock: VirtualClock) -> ThreadPoolExecutor:
    """Return the pool of participants that replaces one whose threads use real time."""
    twins = _twins.setdefault(pool, {})
    if clock not in twins:
        twins[clock] = _pool[2](*_POOL_ARGUMENTS(pool))
    return twins[clock]


def _replace_pools() -> None:
    module: Any = sys.modules.get("concurrent.futures.thread")
    if module is None:  # then there is no pool that was made before
        return
    kind = module.ThreadPoolExecutor
    if not _pool:
        _pool[:] = [kind.submit, kind.shutdown, kind]
    kind.submit, kind.shutdown = _submit, _shutdown


def _restore_pools() -> None:
    if _pool:
        module: Any = sys.modules["concurrent.futures.thread"]
        module.ThreadPoolExecutor.submit, module.ThreadPoolExecutor.shutdown = _pool[:2]


def _forget_twins(clock: VirtualClock) -> None:
    for twins in list(_twins.values()):
        twin = twins.pop(clock, None)
        if twin is not None:
            _pool[1](twin, wait=False)


# -- asyncio ---------------------------------------------------------------------------------------


def _make_loop(real: Callable[[], Any]) -> Callable[[], Any]:
    def make() -> asyncio.AbstractEventLoop:
        clock = _here()
        loop: asyncio.AbstractEventLoop = real() if clock is None else VirtualLoop(clock)
        return loop

    return make


# -- replacing -------------------------------------------------------------------------------------


def _replacements() -> dict[int, Any]:
    """Return the replacements by the ids of the originals."""
    pairs: list[tuple[Any, Any]] = [
        (time.sleep, _virtual_sleep),
        (time.time, _reader(time.time, lambda clock: clock.time_ns() / 1e9)),
        (time.time_ns, _reader(time.time_ns, lambda clock: clock.time_ns())),
        (time.monotonic, _reader(time.monotonic, lambda clock: clock.now())),
        (time.monotonic_ns, _reader(time.monotonic_ns, _now_ns)),
        (time.perf_counter, _reader(time.perf_counter, lambda clock: clock.now())),
        (time.perf_counter_ns, _reader(time.perf_counter_ns, _now_ns)),
        (time.localtime, _of_now(time.localtime, 0)),
        (time.gmtime, _of_now(time.gmtime, 0)),
        (time.ctime, _of_now(time.ctime, 0)),
        (time.asctime, _of_now(time.asctime, 0)),
        (time.strftime, _of_now(time.strftime, 1)),
        (threading.Lock, _lock),
        # What `threading` itself waits on: another object than `Lock` since Python 3.13.
        (threading._allocate_lock, _lock),  # type: ignore[attr-defined]  # noqa: SLF001
        (threading.RLock, _make_rlock(threading.RLock)),
        (queue.SimpleQueue, _make_simple_queue(queue.SimpleQueue)),
        (asyncio.events.new_event_loop, _make_loop(asyncio.events.new_event_loop)),
    ]
    return {id(real): fake for real, fake in pairs}


_FAKES = _replacements()


def _replace() -> None:
    # All modules, as `from time import sleep` has put the function into a module's own globals.
    # A copy, as an import in another thread, or in a finalizer, may come between.
    for name, module in sys.modules.copy().items():
        names = getattr(module, "__dict__", None)
        if type(names) is dict:
            for key, real in _search(name, names):
                if names.get(key) is real:
                    _places.append((names, key, real, _FAKES[id(real)]))
                    names[key] = _FAKES[id(real)]
    threading.Thread.start = _start  # type: ignore[method-assign, assignment]
    threading.Thread.join = _join  # type: ignore[method-assign, assignment]
    threading.Thread.is_alive = _is_alive  # type: ignore[method-assign, assignment]
    _replace_pools()


def _search(name: str, names: dict[str, Any]) -> list[tuple[str, Any]]:
    """Return the names to replace in a module; the result is kept, as modules rarely change."""
    key = (id(names), len(names))
    if _seen.get(name) != key:
        here = () if _is_in(name, REAL_TIME) else list(names.items())
        _found[name] = [(n, value) for n, value in here if id(value) in _FAKES]
        _seen[name] = key
    return _found[name]


def _restore() -> None:
    _restore_pools()
    threading.Thread.start = _thread_start  # type: ignore[method-assign]
    threading.Thread.join = _thread_join  # type: ignore[method-assign]
    threading.Thread.is_alive = _thread_is_alive  # type: ignore[method-assign]
    for names, key, real, fake in _places:
        if names.get(key) is fake:
            names[key] = real
    _places.clear()
