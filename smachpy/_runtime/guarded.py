"""Run a state with its options around it: hooks, retry, exceptions, timeout, coroutines."""

from __future__ import annotations

import inspect
import threading
from functools import partial
from typing import TYPE_CHECKING, Any

from smachpy._runtime.asker import asking
from smachpy._runtime.failures import ChildErrors
from smachpy._runtime.frame import FRAME
from smachpy._runtime.interrupt import Interruption
from smachpy._runtime.watch import disarm, note_answer
from smachpy.events import PreemptServiced, Retried, TimedOut
from smachpy.exceptions import InvalidUserCodeError

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable, Coroutine

    from smachpy._core.retry import Retry
    from smachpy._runtime.frame import Frame, RootFrame
    from smachpy.state import State


def runner_of(state: State) -> Callable[[Any], Any]:
    """Return what runs `state` once: its `execute` itself when it asks for nothing more."""
    execute: Callable[[Any], Any] = state.execute
    callback = getattr(state, "_cb", None)  # a CBState whose function is a coroutine function
    if inspect.iscoroutinefunction(execute) or inspect.iscoroutinefunction(callback):
        execute = _Async(state, execute)
    return guarded(state, execute)


def guarded(
    state: State, execute: Callable[[Any], Any], root: RootFrame | None = None
) -> Callable[[Any], Any]:
    """Return `execute` with the options of `state` around it; itself when there are none.

    `root` is the frame of `state` itself when it is the root: no step of a container watches it.
    """
    if (
        state.timeout is None
        and state.retry is None
        and state.on_enter is None
        and state.on_exit is None
        and not state.on_exception
    ):
        return execute
    return _Guarded(state, execute, root)


class _Async:
    """Runs a state's coroutine; a preempt cancels it."""

    def __init__(self, state: State, execute: Callable[[Any], Coroutine[Any, Any, Any]]) -> None:
        self._state = state
        self._execute = execute

    def __call__(self, userdata: Any) -> Any:
        return self._state._clock().run_async(self._main(userdata))  # noqa: SLF001  one machinery

    async def _main(self, userdata: Any) -> Any:
        import asyncio

        loop = asyncio.get_running_loop()
        task = asyncio.ensure_future(self._execute(userdata))

        def cancel() -> None:
            loop.call_soon_threadsafe(_cancel, task)

        forget = self._state._on_preempt(cancel)  # noqa: SLF001  one machinery
        try:
            return await task
        except asyncio.CancelledError as error:
            if not self._state.preempt_requested():
                own = asyncio.current_task()
                if own is not None and own.cancelling():
                    raise  # somebody ends the loop: Ctrl-C in a program that handles it itself
                raise RuntimeError("the coroutine was cancelled, by no preempt") from error
            self._state.service_preempt()
            return "preempted"
        finally:
            forget()


def _cancel(task: asyncio.Task[Any]) -> None:
    task.cancel()


class _Guarded:
    """Runs a state with its options around it."""

    def __init__(self, state: State, execute: Callable[[Any], Any], root: RootFrame | None) -> None:
        self._state = state
        self._execute = execute
        self._root = root

    def __call__(self, userdata: Any) -> Any:
        state = self._state
        frame = FRAME.get()
        if state.on_enter is not None:
            self._hook(frame, state.on_enter, userdata)
        outcome = self._attempts(frame, userdata)
        if state.on_exit is not None:
            self._hook(frame, state.on_exit, userdata, outcome)
        return outcome

    def _hook(self, frame: Frame | None, hook: Callable[..., object], *arguments: Any) -> None:
        try:
            hook(*arguments)
        except Exception as error:
            where = "" if frame is None else frame.here()
            name = getattr(hook, "__name__", repr(hook))
            raise InvalidUserCodeError(
                f"{where}: hook {name} raised {type(error).__name__}: {error}", path=where
            ) from error

    def _attempts(self, frame: Frame | None, userdata: Any) -> Any:
        """Run until an attempt is good, or the last one was made, or a preempt came."""
        state = self._state
        attempt = 1
        while True:
            result: Any
            try:
                result = self._once(frame, userdata)
            except Exception as error:  # noqa: BLE001  raised again unless somebody wants it
                result = error
            retry = state.retry
            asked = state.preempt_requested() or self._is_told(frame)
            if retry is None or asked or not self._wants(retry, attempt, result):
                return self._conclude(result)
            if self._root is not None:
                self._root.emit_own(Retried, attempt, _reason(result))
            elif frame is not None:
                frame.emit(Retried, attempt, _reason(result))
            if retry.backoff and state.sleep(retry.wait_s(attempt)):
                return self._conclude(result)
            attempt += 1

    def _is_told(self, frame: Frame | None) -> bool:
        """Tell whether somebody wants an end, not just the timeout of this attempt."""
        if self._root is not None:
            return self._root.called_off
        return frame is not None and frame.told is not None

    def _wants(self, retry: Retry, attempt: int, result: Any) -> bool:
        """Tell whether to run again after `result`, or after what a container's children raised."""
        if not isinstance(result, Exception):
            return retry.wants(attempt, result)
        return _applies(partial(retry.wants, attempt), result)

    def _conclude(self, result: Any) -> Any:
        """Return the outcome, or raise what no `on_exception` entry wants."""
        if not isinstance(result, Exception):
            return result
        for kind, outcome in (self._state.on_exception or {}).items():
            if _applies(partial(_is_a, kind), result):
                return outcome
        raise result

    def _once(self, frame: Frame | None, userdata: Any) -> Any:
        """Run the state, at most for its timeout."""
        timeout = self._state.timeout
        if timeout is None:
            return self._execute(userdata)
        guard: Timeout | _RootTimeout
        if self._root is not None:
            guard = _RootTimeout(self._root, timeout)
        else:
            assert frame is not None  # a container runs it
            guard = Timeout(self._state, frame, timeout)
        try:
            outcome = self._execute(userdata)
        except Interruption:
            guard.end(None)
            if guard.passed and frame is not None and not frame.dead:
                return self._state.timeout_outcome
            raise
        except BaseException:
            guard.end(None)
            raise
        guard.end(outcome)
        return self._state.timeout_outcome if guard.passed and outcome == "preempted" else outcome


class Timeout:
    """Preempts a state when its time is over.

    Attributes:
        seconds: Its time [s].
        passed: It was over before the state ended.
        ended: The state has ended; both are changed with the container's lock held.
    """

    def __init__(self, state: State, frame: Frame, seconds: float) -> None:
        self.seconds = seconds
        self.passed = False
        self.ended = False
        self._state = state
        self._frame = frame
        self._step: Any = frame.step
        self._timer = frame.run.clock.call_later(seconds, self._over)

    def end(self, outcome: object) -> None:
        """The state has ended with `outcome`: the timeout, and the preempt it caused, end too.

        The next attempt begins anew. A preempt that somebody else asked for stays.
        """
        self._timer.cancel()
        frame = self._frame
        if self.passed and frame.run.watched:
            note_answer(frame, outcome)
        with frame.container._lock:  # noqa: SLF001  one machinery
            self.ended = True
            if frame.timed_out and frame.told is self._step and not frame.dead:
                disarm(frame)
                self._state.recall_preempt()

    def _over(self) -> None:
        frame = self._frame
        with asking("timeout", frame.here(), f"{self.seconds:g} s"):
            frame.container._time_out_child(frame, self._step, self)  # noqa: SLF001  one machinery


class _RootTimeout:
    """Preempts a root when its time is over.

    The lock is for this alone: the end of an attempt waits for a request that is under way, so
    that none hits the next attempt or run.

    Attributes:
        passed: The time was over before the attempt ended.
    """

    def __init__(self, frame: RootFrame, seconds: float) -> None:
        self.passed = False
        self._frame = frame
        self._seconds = seconds
        self._ended = False
        self._calling = threading.RLock()
        self._timer = frame.run.clock.call_later(seconds, self._over)

    def end(self, _outcome: object) -> None:
        """The attempt has ended, and with it the preempt that the timeout caused."""
        self._timer.cancel()
        with self._calling:
            self._ended = True
        frame = self._frame
        if not self.passed or frame.called_off or frame.dead:
            return
        frame.container.recall_preempt()
        if frame.asked and frame.answered:
            frame.emit_own(PreemptServiced)
        frame.asked = frame.answered = False

    def _over(self) -> None:
        frame = self._frame
        with self._calling, asking("timeout", frame.path, f"{self._seconds:g} s"):
            if self._ended or frame.dead:
                return
            self.passed = True
            frame.note(frame.path, TimedOut, self._seconds)
            frame.container.request_preempt()


def _reason(result: Any) -> str:
    return f"{type(result).__name__}: {result}" if isinstance(result, Exception) else str(result)


def _is_a(kind: type[BaseException], error: BaseException) -> bool:
    return isinstance(error, kind)


def _applies(wanted: Callable[[BaseException], bool], error: BaseException) -> bool:
    """Tell whether `wanted` is true of `error`, or of what a container made it from.

    Several children of a concurrence may have raised; an error that nobody wants must not
    disappear beside one that somebody does, so it must be true of all. A group that a state
    itself has raised is one error.
    """
    if wanted(error):
        return True
    cause = error.__cause__ if isinstance(error, InvalidUserCodeError) else None
    if cause is None:
        return False
    if isinstance(cause, ChildErrors):
        return wanted(cause) or all(_applies(wanted, one) for one in cause.exceptions)
    return _applies(wanted, cause)
