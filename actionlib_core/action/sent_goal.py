"""One goal as a `with` block: its feedback as a loop, its result as a value; also with `async`.

    with client.send(goal, timeout=60) as handle:
        for feedback in handle.feedback():
            print(feedback)
        result = handle.result()

Leaving the block before the goal is over cancels it.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actionlib_core.exceptions import GoalFailedError, GoalTimeoutError
from actionlib_core.goal.states import OVER, Status
from actionlib_core.inputs.arguments import check_delay

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Generator, Iterator
    from types import TracebackType
    from typing import Self

    from actionlib_core.action.client_goal_handle import ClientGoalHandle
    from actionlib_core.goal.states import CommState

R = TypeVar("R")
F = TypeVar("F")

CANCEL_GRACE_S = 5.0
"""How long `SentGoal.result` waits for the end of a goal that it cancelled."""


class SentGoal(Generic[R, F]):
    """A goal that is followed. Made by `ActionClient.send` and `ActionClient.follow`.

    Args:
        handle: The goal.
        timeout: Longest time to the end of the goal, from now [s]; None: no limit.

    Threads: every method may be called from any thread and any callback. Each feedback message goes
        to one reader only, the first that asks.
    """

    def __init__(self, handle: ClientGoalHandle, timeout: float | None) -> None:
        self._handle = handle
        self._name = handle.manager.name
        self._clock = handle.manager.clock
        self._timeout = timeout
        self._deadline = None if timeout is None else self._clock.now() + timeout
        self._changed = self._clock.event(f"news of a goal of {self._name}")
        # No lock: a signal handler that cancels the goal may have interrupted the thread that holds
        # it. Appending to a list, removing from it and copying it are atomic.
        self._wakers: list[Callable[[], object]] = []
        handle.on_state = self._note_state
        handle.on_feedback = self._notify

    def _note_state(self, state: CommState) -> None:
        if state in OVER:
            self._handle.settle()
        self._notify()

    def _notify(self) -> None:
        self._changed.set()
        for wake in tuple(self._wakers):
            wake()

    # -- state ---------------------------------------------------------------------------------

    @property
    def id(self) -> str:
        """The goal's id, for `ActionClient.follow`, also after a restart of the program."""
        return self._handle.goal.id

    @property
    def status(self) -> Status:
        """The last status from the server; LOST once the goal is lost."""
        return self._handle.goal.status

    @property
    def text(self) -> str:
        """The text of the last status, or why the goal is lost."""
        return self._handle.goal.text

    @property
    def over(self) -> bool:
        """Whether the goal has ended."""
        return self._handle.goal.over

    @property
    def accepted(self) -> bool:
        """Whether the server has accepted the goal, also when it has ended since."""
        return self._handle.goal.begun

    @property
    def dropped_feedback(self) -> int:
        """Number of feedback messages dropped because too many waited."""
        return self._handle.dropped_feedback

    def get_result(self) -> R | None:
        """Return the result message as it is now, whatever the goal's end; None without one."""
        result: Any = self._handle.goal.result
        return result  # type: ignore[no-any-return]

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the goal's end without cancelling it; return whether it has ended.

        Blocks: until then, `timeout` [s] at most; None: no limit.
        """
        return self._handle.wait_settled(check_delay(f"goal {self.id}", "timeout", timeout))

    def cancel(self) -> None:
        """Ask the server to cancel the goal, which ends with the server's answer."""
        self._handle.cancel()

    # -- without async -------------------------------------------------------------------------

    def feedback(self) -> FeedbackStream[F]:
        """Return the feedback until the goal's end, for a loop with `for` or `async for`.

        Each message goes to one loop only. Up to 100,000 messages of together 32 MiB wait for it;
        beyond that the oldest are dropped, logged and counted.
        """
        return FeedbackStream(self)

    def result(self, timeout: float | None = None) -> R:
        """Wait for the end and return the result.

        Args:
            timeout: Longest wait [s], besides that of `send`; after either, the goal is cancelled.

        Raises:
            GoalTimeoutError: one of the two timeouts has passed.
            InvalidDurationError: `timeout` is not a duration.
            GoalFailedError: the goal's end was not SUCCEEDED.

        Blocks: until the goal is over; after a timeout, 5 s more for the answer to the cancel.
        """
        timeout = check_delay(f"goal {self.id}", "timeout", timeout)
        if not self._wait(timeout):
            self.cancel()
            self._handle.wait_settled(CANCEL_GRACE_S)
            raise self._late(timeout)
        return self._outcome()

    def news(self) -> Iterator[F | None]:
        """Yield each feedback message, and None at each new state.

        Raises:
            GoalTimeoutError: while looping; the timeout of `send` has passed, the goal is
                cancelled.

        Blocks: while looping, until there is something new or the goal is over.
        """
        while True:
            self._changed.clear()
            over = self.over  # read before the feedback: all that came before the end is then there
            if over:
                self._changed.set()  # stays set, for readers in other threads
            while (feedback := self._take()) is not None:
                yield feedback
            yield None
            if over:
                return
            left = self._left(None)
            if not self._changed.wait(left) and left is not None and not self.over:
                self.cancel()
                raise self._late(None)

    def next_feedback(self) -> F | None:
        """Wait for feedback and return it; None once the goal is over and all was taken.

        Raises:
            GoalTimeoutError: the timeout of `send` has passed; the goal is cancelled.

        Blocks: until then.
        """
        taken = next((item for item in self.news() if item is not None), None)
        if self._handle.feedback:
            # `news` above was left with feedback waiting, whose signal it has cleared: another
            # thread may be the one that takes it.
            self._changed.set()
        return taken

    def _take(self) -> F | None:
        """Return the next feedback, None when there is none; another thread may take it first."""
        feedback: F | None = self._handle.take_feedback()
        return feedback

    def _wait(self, timeout: float | None) -> bool:
        return self._handle.wait_settled(self._left(timeout)) or self.over

    def _left(self, timeout: float | None) -> float | None:
        if self._deadline is None:
            return timeout
        left = max(0.0, self._deadline - self._clock.now())
        return left if timeout is None else min(left, timeout)

    def _late(self, timeout: float | None) -> GoalTimeoutError:
        limit = min(t for t in (timeout, self._timeout) if t is not None)
        status = self.status.name
        return GoalTimeoutError(self._name, self.id, status, limit, accepted=self.accepted)

    def _outcome(self) -> R:
        goal = self._handle.goal
        if goal.status is not Status.SUCCEEDED:
            raise GoalFailedError(self._name, goal.id, goal.status.name, goal.text, goal.result)
        result: Any = goal.result
        # The server no longer had the result when this client asked for it.
        if result is None:
            raise GoalFailedError(self._name, goal.id, goal.status.name, goal.text, None)
        return result  # type: ignore[no-any-return]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if not self.over:
            self.cancel()

    # -- async ---------------------------------------------------------------------------------

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.__exit__(kind, error, traceback)

    def __await__(self) -> Generator[Any, None, R]:
        return self.result_async().__await__()

    async def result_async(self) -> R:
        """Wait for the end and return the result; `await handle` is the short form.

        Errors are those of `result`. When the waiting task is cancelled, the `async with` block
        cancels the goal.
        """
        if not await self._wait_async(lambda: self.over, self._left(None)):
            self.cancel()
            await self._wait_async(lambda: self.over, CANCEL_GRACE_S)
            raise self._late(None)
        return self._outcome()

    async def next_feedback_async(self) -> F | None:
        """Wait for feedback and return it; as `next_feedback`."""
        if not await self._wait_async(lambda: self._handle.feedback or self.over, self._left(None)):
            self.cancel()
            raise self._late(None)
        return self._take()

    async def _wait_async(self, condition: Callable[[], object], limit: float | None) -> bool:
        import asyncio  # here, as it slows down the start of programs that do not use it

        loop = asyncio.get_running_loop()
        changed = asyncio.Event()

        def wake() -> None:
            with contextlib.suppress(RuntimeError):  # the loop has just been closed
                loop.call_soon_threadsafe(changed.set)

        self._wakers.append(wake)
        try:
            async with asyncio.timeout(limit):
                while not condition():  # after `wake` was registered: no change is missed
                    await changed.wait()
                    changed.clear()
        except TimeoutError:
            return bool(condition())
        finally:
            self._wakers.remove(wake)
        return True


class FeedbackStream(Generic[F]):
    """The feedback of one goal, for one loop."""

    def __init__(self, goal: SentGoal[Any, F]) -> None:
        self._goal = goal

    def __iter__(self) -> Iterator[F]:
        while (feedback := self._goal.next_feedback()) is not None:
            yield feedback

    async def __aiter__(self) -> AsyncIterator[F]:
        while (feedback := await self._goal.next_feedback_async()) is not None:
            yield feedback
