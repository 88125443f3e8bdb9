"""A simulated process of a mission under test, which can be killed with its threads and timers."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core.clock import use_clock
from actionlib_core.node import Node, use_node
from actionlib_core.transport.tokens import Kind

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterator

    from actionlib_core.clock import Event, Timer, VirtualClock
    from actionlib_core.clock._virtual_parts import VirtualTask
    from actionlib_core.transport.memory import MemoryNetwork
    from actionlib_core.transport.tokens import Endpoint

T = TypeVar("T")


class MissionNode(Node):
    """The mission's node, which reports the action clients made on it.

    Attributes:
        on_client: Called with the full name and the type of an action, before its client joins.
    """

    on_client: Callable[[str, str], object] | None = None

    def endpoint(self, kind: Kind, name: str, type_name: str, md5: str) -> Endpoint:
        if kind is Kind.ACTION_CLIENT and self.on_client is not None:
            self.on_client(name, type_name)
        return super().endpoint(kind, name, type_name, md5)


class Killed(BaseException):
    """The process of a run was killed.

    Not an `Exception`: code of a mission or test that catches those must not survive a kill.
    """


class Process:
    """One process of a mission: a clock that knows the threads and timers it has started.

    Args:
        clock: The clock of the test.
        network: The network of the test; the process has a session of its own.

    Attributes:
        node: The node of the process.
        is_killed: Whether `kill` was called.
    """

    def __init__(self, clock: VirtualClock, network: MemoryNetwork) -> None:
        self.is_killed = False
        self._clock = clock
        self._tasks: list[VirtualTask] = []
        self._timers: list[Timer] = []
        self._session = network.session()
        self.node = MissionNode("mission", transport=self._session, clock=self)

    @contextlib.contextmanager
    def current(self) -> Iterator[None]:
        """Make this process the current one within the block; the block's end ends the process."""
        with use_clock(self), use_node(self.node):
            try:
                yield
            finally:
                if not self.is_killed:
                    self.node.close()

    def run(self, target: Callable[[], T]) -> T:
        """Call `target` in a thread of the process.

        Raises:
            Killed: the process was killed; all its threads have ended.
        """
        found: list[T] = []
        main = self.spawn(lambda: found.append(target()), name="mission")
        main.join()
        if self.is_killed:
            for task in self._tasks:
                task.join()
            raise Killed
        return found[0]

    def kill(self) -> None:
        """Kill the process as SIGKILL does: without a farewell, in no time.

        Its threads end where they wait; what their `finally` blocks do reaches nobody.
        """
        self.is_killed = True
        self._session.kill()
        for timer in self._timers:
            timer.cancel()
        self._clock.stop(self._tasks)

    # -- the protocol of clocks ----------------------------------------------------------------

    @property
    def numbers(self) -> Iterator[int]:
        """Counter for ids; that of the test's clock, so that two processes never use the same."""
        return self._clock.numbers

    def now(self) -> float:
        return self._clock.now()

    def time_ns(self) -> int:
        return self._clock.time_ns()

    def sleep(self, seconds: float) -> None:
        self._clock.sleep(seconds)

    def event(self, name: str = "an event") -> Event:
        return self._clock.event(name)

    def spawn(self, target: Callable[[], object], *, name: str) -> VirtualTask:
        task = self._clock.spawn(target, name=name)
        self._tasks.append(task)
        # A thread on its way out may still start others: they must end as well.
        if self.is_killed:
            self._clock.stop([task])
        return task

    def call_later(self, delay: float, callback: Callable[[], object]) -> Timer:
        timer = self._clock.call_later(delay, callback)
        self._timers.append(timer)
        if self.is_killed:
            timer.cancel()
        return timer

    def interrupt(self, ident: int, error: BaseException) -> bool:
        return self._clock.interrupt(ident, error)

    def run_async(self, main: Coroutine[object, object, Any]) -> Any:
        return self._clock.run_async(main)
