"""One child, compiled: its options, its events and its errors."""

from __future__ import annotations

import inspect
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from actionlib_core import shutdown
from smachpy import log
from smachpy.context import current_frame
from smachpy.events import Entered, Failed, Left, Retried, UserdataWritten
from smachpy.exceptions import InvalidStateError, InvalidUserCodeError, error_text
from smachpy.machines.problems import missing_init, name_of
from smachpy.run.callback import call_bounded
from smachpy.run.child import EPOCH
from smachpy.run.frame import clock_of_run
from smachpy.run.grace import (
    ask,
    asking,
    on_preempt,
    request_soon,
    shutdown_asking,
    wait_for_preempt,
)
from smachpy.run.interrupt import Interruption, ProgramEnds
from smachpy.run.options import NO_OPTIONS
from smachpy.run.stack_text import trace_of
from smachpy.run.visit import Again, End, Event, after_attempt
from smachpy.slips import ACCEPTING
from smachpy.userdata.user_data import Remapper, revoke

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actionlib_core.clock import Timer
    from smachpy.events.buffer import EventBuffer
    from smachpy.run.child import Child, Parent
    from smachpy.run.frame import Frame
    from smachpy.run.options import Options

_new = tuple.__new__  # takes half as long as the `__new__` of a NamedTuple


@dataclass(slots=True, eq=False)
class Step:
    """One child, ready to run.

    Attributes:
        label: Its label.
        state: The child.
        execute: Runs the child: its own `execute`, wrapped if it has options.
        userdata: Its window into the container's userdata; for a root, the argument of `execute`.
        next: Outcome -> the next step, or the `End` of the container.
        nested: The child's data, if it is a machine that its parent's loop may enter directly.
        interface: The version of the child's interface that this step was compiled from.
        writes: The child may write userdata.
        watched_window: The latest window that reports writes; None after its run has ended.
    """

    label: str
    state: Child
    execute: Callable[[Any], Any]
    userdata: Any = None
    next: dict[str, Any] = field(default_factory=dict)
    nested: Any = None
    interface: int = field(init=False)
    writes: bool = field(init=False)
    watched_window: _WatchedRemapper | None = None
    final: Literal[False] = False  # a slot is found faster than a class attribute; see `End`
    _base: str = ""
    _path: str = ""

    def __post_init__(self) -> None:
        self.interface = self.state._smachpy.version
        self.writes = bool(self.state._smachpy.output_keys)

    def is_stale(self) -> bool:
        """Return whether the child's interface has changed since the step was compiled."""
        return self.interface != self.state._smachpy.version

    def cut_off(self) -> None:
        """Stop a thread left behind in this child from writing userdata or starting a state."""
        # `Visit._cut_off` also drops the plan, so the machine's next run compiles new steps and
        # this one belongs to the abandoned thread alone.
        self.next = _NoTransitions()
        for window in (self.userdata, self.watched_window):
            if isinstance(window, Remapper):
                revoke(window)

    def path_in(self, frame: Frame) -> str:
        """Return the child's path."""
        base = frame.path
        # The identity is enough: a frame keeps one string as its path, and a wrong guess only
        # builds the text again.
        if base is not self._base:
            self._base = base
            self._path = f"{base}/{self.label}"
        return self._path

    def watched_userdata(self, frame: Frame) -> Remapper:
        """Return a window that reports each write."""
        window = self.watched_window
        if window is None or window._scope_of[0] is not frame:  # noqa: SLF001  its own module
            window = self.watched_window = _WatchedRemapper(
                self.userdata, frame, self.path_in(frame)
            )
        return window


def make_step(container: Parent, label: str) -> Step:
    """Compile the child `label` of `container`."""
    data = container._smachpy
    state: Any = data.children[label]
    execute, kind, of_child = state.execute, type(state), state._smachpy
    is_async = of_child.is_async or inspect.iscoroutinefunction(execute)
    # A container whose `execute` is overridden: the user's code around `super().execute()` would
    # block a preempt for ever, so it gets the container's grace.
    is_own = (
        kind._smachpy_is_container
        and getattr(execute, "__func__", None) is not kind._smachpy_execute
    )
    run = runner_of(state, get_options(state), execute, is_async=is_async, is_callback=is_own)
    step = Step(label, state, run)
    step.userdata = Remapper(
        container.userdata, of_child.input_keys, of_child.output_keys, data.remappings[label]
    )
    return step


class Plan:
    """The children of one container, compiled.

    Attributes:
        epoch: The `EPOCH.value` for which the plan is valid.
        userdata: The container's userdata, to which the windows of the steps refer.
        steps: Label -> step.
        first: Of a state machine: the initial step.
    """

    __slots__ = ("epoch", "first", "steps", "userdata")
    first: Step

    def __init__(self, container: Parent) -> None:
        self.epoch: object = None
        self.userdata = container.userdata
        self.steps = {label: make_step(container, label) for label in container._smachpy.children}

    def is_stale(self) -> bool:
        """Return whether the interface of a child has changed since the plan was compiled."""
        return any(step.is_stale() for step in self.steps.values())


class _NoTransitions(dict[str, Any]):
    """The transitions of a child that was left behind: following any of them ends its thread."""

    def __missing__(self, _key: object) -> Any:
        raise Interruption

    def __contains__(self, _key: object) -> bool:
        raise Interruption


Following: TypeAlias = Step | End


class _WatchedRemapper(Remapper):
    """A window that publishes `UserdataWritten` for each write."""

    __slots__ = ("_scope_of",)
    _scope_of: tuple[Frame, str]

    def __init__(self, original: Remapper, frame: Frame, path: str) -> None:
        set_slot = object.__setattr__  # `self.name = ...` would write userdata
        for name in Remapper.__slots__:
            set_slot(self, name, getattr(original, name))
        set_slot(self, "_scope_of", (frame, path))

    def __setitem__(self, key: str, item: Any) -> None:
        frame, path = self._scope_of
        if frame.run.journal is not None and key in self._output:
            frame.run.journal.check_value(frame, path, self._output[key], item)
        super().__setitem__(key, item)
        if frame.run.watched and key in self._output:  # other keys were ignored by the line above
            clock = frame.run.clock
            fields = (path, clock.now(), clock.time_ns(), self._output[key], item)
            frame.publish(_new(UserdataWritten, fields))

    __setattr__ = __setitem__


# -- options -----------------------------------------------------------------------------------


_HOOKS = (("on_enter", 2), ("on_exit", 3), ("resume", 2), ("on_resume", 2))
"""Methods that act as options, and their number of arguments, `self` included."""


def get_options(state: Child) -> Options:
    """Return the options of `state`, including hooks that are methods of its class.

    The hooks are `on_enter(self, userdata)`, `on_exit(self, userdata, outcome)`,
    `resume(self, userdata)` and `on_resume(self, userdata)`. A method with one of these names but
    other arguments belongs to the user and is not called.
    """
    data = state._smachpy
    known, options = data.with_hooks, data.options
    # Kept with the options it was made from: looking for methods takes longer than running a small
    # machine. Setting an option replaces `data.options`, so a stale entry is noticed.
    if known is not None and known[0] is options:
        return known[1]
    hooks = {
        name: getattr(state, name)
        for name, count in _HOOKS
        if getattr(options, name) is None and _is_hook(type(state), name, count)
    }
    found = replace(options, **hooks) if hooks else options
    data.with_hooks = options, found
    return found


def _is_hook(kind: type, name: str, count: int) -> bool:
    """Return whether the method `name` of a class takes exactly `count` arguments."""
    # Static look-up: a property or `__getattr__` of the user's must not run here.
    method = inspect.getattr_static(kind, name, None)
    if not inspect.isfunction(method) or inspect.iscoroutinefunction(method):
        return False
    code = method.__code__
    return (
        code.co_argcount == count
        and not method.__defaults__
        and not code.co_kwonlyargcount
        and not code.co_flags & (inspect.CO_VARARGS | inspect.CO_VARKEYWORDS)
    )


def runner_of(
    state: Child,
    options: Options,
    execute: Callable[[Any], Any],
    *,
    is_async: bool = False,
    is_callback: bool = False,
) -> Callable[[Any], Any]:
    """Return `execute` wrapped by `options`, or `execute` itself if there is nothing to add.

    With `is_async` it is a coroutine function, with `is_callback` the user's override of a
    container's `execute`.
    """
    if is_async:
        execute = _run_async(state, execute)
    if is_callback:
        execute = _bounded(state, execute)
    if ACCEPTING[0]:  # only programs for ROS 1 wait in rospy, whose waits raise `ProgramEnds`
        execute = _ended_by_program(execute)
    plain = options is NO_OPTIONS or (
        options.timeout is None
        and options.retry is None
        and options.on_enter is None
        and options.on_exit is None
        and not options.on_exception
    )
    return execute if plain else _with_options(state, options, execute)


def _run_async(
    state: Any, execute: Callable[[Any], Coroutine[Any, Any, Any]]
) -> Callable[[Any], Any]:
    """Return a function that runs the state's coroutine. A preempt cancels it."""
    import asyncio  # here: it takes 60 ms, and most machines never need it

    async def main(userdata: Any) -> Any:
        loop = asyncio.get_running_loop()
        task = asyncio.ensure_future(execute(userdata))
        # The request comes in another thread; `Task.cancel` is not thread-safe.
        forget = on_preempt(state, lambda: loop.call_soon_threadsafe(task.cancel))
        try:
            return await task
        except asyncio.CancelledError as error:
            if not state.preempt_requested():
                own = asyncio.current_task()
                if own is not None and own.cancelling():
                    raise  # the loop itself is ending: Ctrl-C in a program that handles it
                raise RuntimeError("the coroutine was cancelled, by no preempt") from error
            state.service_preempt()
            return "preempted"
        finally:
            forget()

    def run(userdata: Any) -> Any:
        try:
            asyncio.get_running_loop()
        except RuntimeError:  # none, as it should be: asyncio runs one loop per thread
            pass
        else:
            frame: Frame | None = current_frame()
            where = type(state).__name__ if frame is None else frame.here()
            raise InvalidStateError(
                f"{where}: execute: got an async state in a thread with a running event loop, as "
                "in a notebook or a coroutine; expected a thread without one. Try `outcome = await "
                "asyncio.to_thread(machine.execute)`."
            )
        return clock_of_run().run_async(main(userdata))

    return run


def _bounded(container: Any, execute: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function that runs the user's override of a container's `execute`.

    The container's grace bounds it, but pauses inside `super().execute()`, where each child has its
    own.
    """

    def run(userdata: Any) -> Any:
        frame: Frame | None = current_frame()
        assert frame is not None  # a container runs it
        return call_bounded(container, frame, execute, (userdata,))

    return run


def _ended_by_program(execute: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return `execute` for a state whose waits raise `ProgramEnds` at shutdown: a preempt here."""

    def run(userdata: Any) -> Any:
        try:
            return execute(userdata)
        except Exception as error:
            frame: Frame | None = current_frame()
            asked = shutdown.requested() and frame is not None and not frame.dead
            if not asked or not isinstance(error, ProgramEnds):
                raise
            # The wait may have noticed the shutdown before the machine was asked to stop. Ask the
            # root now; otherwise it would go on with the next state.
            while frame is not None and frame.parent is not None:
                frame = frame.parent
            assert frame is not None
            if not frame.container._preempt_requested:
                with shutdown_asking(shutdown.current_shutdown()):
                    request_soon(frame.container)
            raise Interruption from error

    return run


def _with_options(
    state: Child, options: Options, execute: Callable[[Any], Any]
) -> Callable[[Any], Any]:
    """Return a function that runs a state with its hooks, timeout, retry and `on_exception`."""

    def run(userdata: Any) -> Any:
        frame: Frame | None = current_frame()
        assert frame is not None  # a container runs it
        journal = frame.run.journal
        if options.on_enter is not None and (journal is None or not journal.began_inside(frame)):
            _call_hook(frame, state, options.on_enter, userdata)
        # A durable run that goes on continues with the attempt in which the process ended, after
        # the rest of the pause before it.
        attempt, wait = (1, 0.0) if journal is None else journal.attempt(frame)
        outcome: Any = "preempted"
        if not (wait and wait_for_preempt(state, clock_of_run(), wait)):
            outcome = _attempts(frame, state, options, execute, userdata, attempt)
        if options.on_exit is not None:
            _call_hook(frame, state, options.on_exit, userdata, outcome)
        return outcome

    return run


def _attempts(
    frame: Frame,
    state: Child,
    options: Options,
    execute: Callable[[Any], Any],
    userdata: Any,
    attempt: int,
) -> Any:
    """Run until an attempt succeeds, none are left, or a preempt arrives; return the outcome."""
    while True:
        timer, passed = None, False
        if options.timeout is not None:
            timer = Timeout(frame, options.timeout)
            passed = timer.begin()
        result: Any = None
        timed_out = False
        try:
            result = "preempted" if passed else execute(userdata)
        except (Exception, Interruption) as error:
            if frame.dead:  # the thread was left behind: no retry, no hook
                raise
            result = error
        finally:
            if timer is not None:
                timed_out = timer.end(result)
        asked = state._preempt_requested or (frame.visit is not None and frame.visit.is_asked())
        decision = after_attempt(result, options, attempt, asked=asked, timed_out=timed_out)
        if isinstance(decision, Again):
            wait, result = decision
            _tell_retried(frame, attempt, wait, result)
            if not (wait and wait_for_preempt(state, clock_of_run(), wait)):
                attempt += 1
                continue
            # Preempted during the pause: decide again without the retry.
            decision = after_attempt(result, options, attempt, asked=True, timed_out=False)
        if isinstance(decision, BaseException):
            raise decision
        if isinstance(result, Exception):  # else its reason would be lost
            where = frame.here()
            log.logwarn(f"{where}: {error_text(result)}; on_exception makes it {decision!r}")
        return decision


def _tell_retried(frame: Frame, attempt: int, wait: float, result: Any) -> None:
    reason = error_text(result) if isinstance(result, Exception) else str(result)
    if frame.run.journal is not None:
        frame.run.journal.retried(frame, attempt, wait, reason)
    frame.emit(Retried, attempt, reason)


def _call_hook(frame: Frame, state: Any, hook: Callable[..., object], *arguments: Any) -> None:
    try:
        if state._smachpy_is_container:  # a leaf's grace covers its hooks
            call_bounded(state, frame, hook, arguments)
        else:
            hook(*arguments)
    except Exception as error:
        raise raised(frame.here(), f"hook {name_of(hook)}", error) from error


class Timeout:
    """The `timeout` of the child that `frame` runs: asks it to stop after `seconds`."""

    def __init__(self, frame: Frame, seconds: float) -> None:
        self._frame = frame
        self._step: Step = frame.step
        self._seconds = seconds
        self._passed = False
        self._ended = False  # both are changed with the run's lock held
        self._timer: Timer | None = None

    def begin(self) -> bool:
        """Start the timeout.

        Returns:
            Whether it passed before this process began, in a durable run that has no goal and no
            children to go on with; then the attempt is over.
        """
        journal, frame = self._frame.run.journal, self._frame
        left = self._seconds if journal is None else journal.time_left(frame, self._seconds)
        if left > 0.0:
            self.start(left)
            return False
        self.over()
        return journal is not None and not journal.goes_on(frame)

    def start(self, left: float) -> None:
        """Start the timeout with `left` seconds."""
        self._timer = self._frame.run.clock.call_later(left, self.over)

    def is_alone(self) -> bool:
        """Return whether the timeout has passed and nobody else has asked the child to stop."""
        visit = self._frame.visit
        return self._passed and visit is not None and visit.step is self._step and visit.by_timeout

    def end(self, result: object) -> bool:
        """End the attempt, whose outcome or exception is `result`.

        Returns:
            Whether only this timeout had asked the child to stop. The request then ends with the
            attempt, and the next attempt starts fresh; a request from anyone else stays.
        """
        if self._timer is not None:
            self._timer.cancel()
        frame = self._frame
        with frame.run.lock:
            # A timer that was cancelled too late finds this in `over` and does nothing.
            self._ended = True
            if not self._passed or frame.dead:
                return False
        visit = frame.visit
        if visit is None or visit.step is not self._step:
            return False
        if frame.run.watched and visit.has_answered(result):
            visit.service()
        with frame.run.lock:
            # Looked up under the lock: a request may have arrived since the timeout's.
            alone = visit.by_timeout and not frame.dead
            if alone:
                visit.happen(Event.NEXT_ATTEMPT)
        visit.settle()
        return alone

    def over(self) -> None:
        """Ask the child to stop; only the first call counts."""
        frame = self._frame
        with asking("timeout", frame.here(), f"{self._seconds:g} s"), frame.run.lock:
            if self._passed or self._ended or frame.dead:
                return
            self._passed = ask(frame, self._step, timeout=self._seconds)
        frame.run.flush_soon()


# -- events ------------------------------------------------------------------------------------


def run_watched(frame: Frame, step: Step) -> Any:
    """Run a step and publish its `Entered` and `Left` (or `Failed`)."""
    run = frame.run
    clock = run.clock
    path = step.path_in(frame)
    journal = run.journal
    if journal is not None:
        ended = journal.enter(frame, step)
        if ended is not None:
            return ended
    if run.pending:
        run.flush()
    frame.publish(_new(Entered, (path, clock.now(), clock.time_ns())))
    try:
        window = step.watched_userdata(frame) if step.writes else step.userdata
        if journal is None:
            outcome = step.execute(window)
        else:
            outcome = journal.execute(frame, step, window)
            journal.leave(frame, step, outcome)
    except BaseException as error:
        publish_raised(frame, error)
        raise
    if frame.visit is not None or run.pending or run.control is not None:
        publish_left(frame, step, outcome)
    else:
        # An outcome that is no string is refused by the machine right after this.
        text = outcome if isinstance(outcome, str) else repr(outcome)
        frame.publish(_new(Left, (path, clock.now(), clock.time_ns(), text)))
    return outcome


def publish_raised(frame: Frame, error: BaseException) -> None:
    """Publish that the running step was ended by `error`."""
    if isinstance(error, Interruption):
        frame.emit(Left, "preempted")
    else:
        frame.emit(Failed, error_text(error), trace_of(error))


def publish_left(frame: Frame, step: Step, outcome: Any) -> None:
    """Publish that `step` has ended, after the events noted meanwhile, and check breakpoints."""
    run = frame.run
    clock = run.clock
    visit = frame.visit
    if visit is not None and visit.step is step and visit.has_answered(outcome):
        visit.service()
    if run.pending:
        run.flush()
    text = outcome if isinstance(outcome, str) else repr(outcome)
    frame.publish(_new(Left, (step.path_in(frame), clock.now(), clock.time_ns(), text)))
    if run.control is not None:
        run.control.note_outcome(frame, step, outcome)


def only_buffer(frame: Frame) -> EventBuffer | None:
    """Return the event buffer of `frame` if it is the only subscriber, else None."""
    subscribers = frame.subscribers
    if subscribers is None or subscribers.epoch is not EPOCH.value:
        subscribers = frame.find_subscribers()
    return subscribers.buffer


# -- errors ------------------------------------------------------------------------------------


def user_error(path: str, state: Child, error: BaseException) -> InvalidUserCodeError:
    """Return the error to raise, `from error`, when a state's code has raised."""
    hint = missing_init(state, error) if isinstance(error, AttributeError) else ""
    return raised(path, type(state).__name__, error, hint)


def raised(path: str, what: str, error: BaseException, hint: str = "") -> InvalidUserCodeError:
    """Return the error to raise, `from error`, when `what`, the user's code, has raised."""
    text = f"{path}: {what} raised {error_text(error)}{hint}"
    return InvalidUserCodeError(text, path=path)
