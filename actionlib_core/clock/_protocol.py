"""The interface of clocks: time, waiting, threads and timers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol, TypeVar, runtime_checkable

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

T = TypeVar("T")


class Event(Protocol):
    """A flag that threads wait for."""

    def is_set(self) -> bool:
        """Return whether the flag is set."""
        ...

    def set(self) -> None:
        """Set the flag and wake every waiter.

        Threads: any thread, any callback and any signal handler; never blocks.
        """
        ...

    def clear(self) -> None:
        """Reset the flag."""
        ...

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the flag is set.

        Args:
            timeout: Longest wait [s]; None and infinity: no limit; 0 or less: do not wait.

        Returns:
            Whether the flag was set.

        Raises:
            ValueError: `timeout` is NaN.

        Blocks: until the flag is set or `timeout` has passed.
        """
        ...


class Task(Protocol):
    """A thread started by `Clock.spawn`."""

    @property
    def name(self) -> str:
        """The name given to `spawn`."""
        ...

    @property
    def error(self) -> BaseException | None:
        """The exception of the target, once the task has ended with one."""
        ...

    @property
    def ident(self) -> int | None:
        """`threading.get_ident()` of the thread that runs the target, while it runs.

        `sys._current_frames()` maps it to the stack, for reports about a thread left behind.
        """
        ...

    def is_alive(self) -> bool:
        """Return whether the target is still running."""
        ...

    def join(self, timeout: float | None = None) -> bool:
        """Wait until the target has returned or raised.

        Returns:
            Whether it has ended.

        Blocks: until the task has ended or `timeout` [s] has passed.
        """
        ...


class Timer(Protocol):
    """A callback scheduled by `Clock.call_later`."""

    def cancel(self) -> None:
        """Cancel the callback; no effect once it has started."""
        ...


@runtime_checkable
class Clock(Protocol):
    """Time and threads."""

    def now(self) -> float:
        """Monotonic time [s]; only differences have a meaning."""
        ...

    def time_ns(self) -> int:
        """Nanoseconds since the Unix epoch, for stamps in records and messages."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait; a negative time does not wait.

        Raises:
            ValueError: `seconds` is NaN.

        Blocks: for `seconds`.
        """
        ...

    def event(self, name: str = "an event") -> Event:
        """Return a new event, not set; its `name` appears in reports about waiting threads."""
        ...

    def spawn(self, target: Callable[[], object], *, name: str) -> Task:
        """Run `target` in a thread named `name`, in a copy of the caller's context variables.

        Threads come from a cache and never keep the interpreter alive. An exception of `target` is
        stored in `Task.error` and passed to `threading.excepthook`.
        """
        ...

    def call_later(self, delay: float, callback: Callable[[], object]) -> Timer:
        """Call `callback` once, `delay` seconds from now; never when `delay` is infinity.

        Raises:
            ValueError: `delay` is NaN.

        Threads: callbacks run on the clock's own thread, one at a time; they must not block. An
            exception is passed to `threading.excepthook`, `SystemExit` is logged; the other timers
            go on.
        """
        ...

    def run_async(self, main: Coroutine[object, object, T]) -> T:
        """Run a coroutine to its end in this thread, in a fresh event loop on this clock.

        Blocks: until the coroutine has returned, raised or was cancelled.
        """
        ...


def check_seconds(where: str, seconds: float) -> None:
    """Check that `seconds` is a number; infinity is one.

    Raises:
        ValueError: it is NaN.
    """
    if math.isnan(seconds):
        raise ValueError(f"{where}: got {seconds!r}; expected a number of seconds.")
