"""One child, compiled: its options, its events and its errors."""

from __future__ import annotations

import copy
import math
from functools import partial
from types import FunctionType
from typing import TYPE_CHECKING, Any, Literal

from actionlib_core import shutdown
from smachpy.base import log
from smachpy.base.context import current_frame
from smachpy.base.functions import is_coroutine_function, name_of, takes, unrun_kind
from smachpy.base.slips import ACCEPTING
from smachpy.engine.callback import call_bounded
from smachpy.engine.container import run_container
from smachpy.engine.errors import error_of, raised
from smachpy.engine.frame import clock_of_run
from smachpy.engine.interrupt import Interruption, ProgramEnds, uninterrupted
from smachpy.engine.options import NO_OPTIONS
from smachpy.engine.preempt import (
    ask,
    asking,
    on_preempt,
    request_soon,
    shutdown_asking,
    wait_for_preempt,
)
from smachpy.engine.visit import Again, Decision, End, Event, after_attempt, following
from smachpy.events import Retried, UserdataWritten
from smachpy.exceptions import InvalidStateError, error_text
from smachpy.userdata.user_data import Remapper, revoke

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterator

    from actionlib_core.clock import Timer
    from smachpy.engine.described import Child, Parent
    from smachpy.engine.frame import Frame
    from smachpy.engine.options import Options

_new = tuple.__new__  # takes half as long as the `__new__` of a NamedTuple


class Step:
    """One child, ready to run.

    Attributes:
        label: Its label.
        state: The child.
        execute: Runs the child: its own `execute`, wrapped if it has options.
        userdata: Its window into the container's userdata; for a root, the argument of `execute`.
        next: Outcome -> the decision that it leads to the next step, or to an `End`.
        interface: The version of the child's interface that this step was compiled from.
        writes: The child may write userdata.
        watched_window: The latest window that reports writes; None after its run has ended.
        choices: Outcome -> what decides where it leads, for outcomes with conditions; or None.
    """

    __slots__ = (
        *("label", "state", "execute", "userdata", "next", "interface", "writes"),
        *("watched_window", "choices", "final", "_base", "_path"),
    )

    def __init__(
        self, label: str, state: Child, execute: Callable[[Any], Any], userdata: Any = None
    ) -> None:
        self.label = label
        self.state = state
        self.execute = execute
        self.userdata = userdata
        self.next: dict[str, Decision] = {}
        self.interface = state._smachpy.version
        self.writes = bool(state._smachpy.output_keys)
        self.watched_window: _WatchedRemapper | None = None
        self.choices: dict[str, Any] | None = None
        # A slot is found faster than a class attribute; see `End`.
        self.final: Literal[False] = False
        self._base: str | None = (
            None  # None, so that a root's "" is taken for no path that is known
        )
        self._path = ""

    def end_always(self) -> None:
        """Let each outcome lead to an end of that name: what is around the child decides."""
        self.next = {name: following(name, End(name)) for name in self.state._smachpy.outcomes}

    def is_stale(self) -> bool:
        """Return whether the child's interface has changed since the step was compiled."""
        return self.interface != self.state._smachpy.version

    def is_undecided(self, outcome: object) -> bool:
        """Return whether conditions decide where `outcome` leads, and have not yet."""
        choices = self.choices
        if choices is None or not isinstance(outcome, str) or outcome not in choices:
            return False
        return self.next[outcome].target is choices[outcome]

    def decide(self, frame: Frame, outcome: Any) -> None:
        """Put where `outcome` leads into `next`, if conditions decide about it and have not yet."""
        if self.choices is not None and self.is_undecided(outcome):
            self.next[outcome] = following(outcome, self.choices[outcome].decide(frame))

    def outcome_if_interrupted(self, outcome: Any) -> Any:
        """Return the outcome that counts after an interruption; `outcome` is what it was before.

        A condition that has outlasted the grace is not asked again.
        """
        return "preempted" if self.is_undecided(outcome) else outcome

    def forget_choices(self) -> None:
        """Forget what the conditions have decided, for the next visit."""
        for outcome, choice in (self.choices or {}).items():
            self.next[outcome] = following(outcome, choice)

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
        base = frame._path or frame.path  # noqa: SLF001  the property costs a call
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
    is_copy = state._smachpy.is_shared
    if is_copy:  # each machine has its own flag for a preempt
        state = copy.copy(state)
    execute, kind, of_child = state.execute, type(state), state._smachpy
    is_async = of_child.is_async or is_coroutine_function(execute)
    # A container whose `execute` is overridden: the user's code around `super().execute()` would
    # block a preempt for ever, so it gets the container's grace.
    is_own = False
    if kind._smachpy_is_container:
        is_own = getattr(execute, "__func__", None) is not kind._smachpy_execute
        if not is_own:  # what `Container.execute` would call
            execute = partial(run_container, state)
    run = runner_of(state, get_options(state), execute, is_async=is_async, is_callback=is_own)
    step = Step(label, state, run)
    if is_copy:
        step.interface = -1  # the options of the copy are those of the present ones: always stale
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
        cleanup: The step of the clean-up, which is not in `steps`; None without one.
    """

    __slots__ = ("cleanup", "epoch", "steps", "userdata")

    def __init__(self, container: Parent) -> None:
        self.epoch: object = None
        self.userdata = container.userdata
        data = container._smachpy
        self.steps = {label: make_step(container, label) for label in data.others()}
        self.cleanup: Step | None = None
        if data.cleanup:
            self.cleanup = step = make_step(container, data.cleanup)
            step.end_always()

    def is_stale(self) -> bool:
        """Return whether the interface of a child has changed since the plan was compiled."""
        if self.cleanup is not None and self.cleanup.is_stale():
            return True
        return any(step.is_stale() for step in self.steps.values())


class _NoTransitions(dict[str, Decision]):
    """The transitions of a child that was left behind: following any of them ends its thread."""

    def __missing__(self, _key: object) -> Any:
        raise Interruption

    def __contains__(self, _key: object) -> bool:
        raise Interruption


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
        if key in self._output:
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

    See `smachpy.get_options`.

    Raises:
        InvalidStateError: a hook is `async` or a generator, so that nothing would run its body.
    """
    data = state._smachpy
    known, options = data.with_hooks, data.options
    # Kept with the options it was made from: looking for methods takes longer than running a small
    # machine. Setting an option replaces `data.options`, so a stale entry is noticed.
    if known is not None and known[0] is options:
        return known[1]
    problems = [*hook_problems(state)]
    if problems:
        raise InvalidStateError(f"{type(state).__name__}: {' '.join(problems)}", problems)
    hooks = {
        name: getattr(state, name)
        for name, count in _HOOKS
        if getattr(options, name) is None and _is_hook(type(state), name, count)
    }
    found = options._replace(**hooks) if hooks else options
    data.with_hooks = options, found
    return found


def hook_problems(state: Child) -> Iterator[str]:
    """Yield a problem for each hook that is a method whose body nothing would run."""
    for name, count in _HOOKS:
        if getattr(state._smachpy.options, name) is None and _is_hook(type(state), name, count):
            method = _defined(type(state), name)
            if kind := unrun_kind(method):
                yield f"{name}: got the {kind} {name_of(method)}; expected a plain method."


def _defined(kind: type, name: str) -> object:
    """Return what a class or its bases define under a name, or None.

    No property or `__getattr__` of the user's runs, as in `inspect.getattr_static`, which also
    looks at metaclasses: half of the time that it took to build and run a small machine.
    """
    return next((vars(one)[name] for one in kind.__mro__ if name in vars(one)), None)


def _is_hook(kind: type, name: str, count: int) -> bool:
    """Return whether a class has the method `name`, and it can be called with `count` arguments."""
    method = _defined(kind, name)
    return isinstance(method, FunctionType) and takes(method, count)


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
    if options.resource is not None:
        from smachpy.engine.resources import holding  # here: few states need what it imports

        execute = holding(state, options.resource, execute)
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

        def cancel() -> None:
            if not task.cancelling():  # once: what it does after that is its clean-up
                task.cancel()

        # The request comes in another thread; `Task.cancel` is not thread-safe.
        forget = on_preempt(state, lambda: loop.call_soon_threadsafe(cancel))
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
        if options.on_enter is not None and not journal.has_begun(frame.here()):
            _call_hook(frame, state, options.on_enter, userdata)
        # A durable run that goes on continues with the attempt in which the process ended, after
        # the rest of the pause before it.
        attempt, wait = journal.attempt(frame)
        outcome: Any = "preempted"
        try:
            if not wait or _begins_again(frame, state, wait):
                outcome = _attempts(frame, state, options, execute, userdata, attempt)
        except (Exception, SystemExit, Interruption) as error:
            if options.on_exit is not None and not frame.dead:
                left = outcome if isinstance(error, Interruption) else None
                _tidy_up(frame, state, options.on_exit, userdata, left)
            raise
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
    """Run until an attempt is the last one, or a preempt arrives; return the outcome."""
    while True:
        timer, passed = None, False
        if options.timeout is not None:
            timer = Timeout(frame, options.timeout)
            passed = timer.begin()
        result: Any = None
        timed_out = False
        try:
            result = "preempted" if passed else execute(userdata)
        except BaseException as error:  # noqa: BLE001  raised below
            result = _result_of(error)
        finally:
            if timer is not None:
                timed_out = uninterrupted(frame, partial(timer.end, result))
                result = "preempted" if timed_out and timer.stopped else result
        if frame.dead:  # the thread was left behind: no retry, no hook, however it ended
            raise result if isinstance(result, BaseException) else Interruption
        asked = _is_asked(frame, state)
        decision = after_attempt(result, options, attempt, asked=asked, timed_out=timed_out)
        if isinstance(decision, Again):
            wait, result = decision
            _tell_retried(frame, attempt, wait, result)
            if _begins_again(frame, state, wait):
                attempt += 1
                continue
            decision = "preempted"
        if isinstance(decision, BaseException):
            raise decision
        if isinstance(result, Exception):  # else its reason would be lost
            makes = "on_exception makes it" if decision != "preempted" else "asked to stop:"
            log.logwarn(f"{frame.here()}: {error_text(result)}; {makes} {decision!r}")
        return decision


def _result_of(error: BaseException) -> BaseException:
    """Return the result of an attempt that raised `error`.

    Raises:
        BaseException: `error`, if it ends the program.
    """
    result = error if isinstance(error, Interruption) else error_of(error)
    if result is None:
        raise error
    return result


def _begins_again(frame: Frame, state: Child, wait: float) -> bool:
    """Wait for the next attempt [s], then while an operator has paused the machine.

    Returns:
        Whether it may begin; no if the child was asked to stop meanwhile.
    """
    if wait and wait_for_preempt(state, clock_of_run(), wait):
        return False
    if frame.run.control is not None:
        frame.run.control.pass_gate(frame, frame.step)
    return not _is_asked(frame, state)


def _is_asked(frame: Frame, state: Child) -> bool:
    return state._preempt_requested or (frame.visit is not None and frame.visit.is_asked())


def _tell_retried(frame: Frame, attempt: int, wait: float, result: Any) -> None:
    reason = error_text(result) if isinstance(result, Exception) else str(result)
    frame.run.journal.retried(frame, attempt, wait, reason)
    frame.emit(Retried, attempt, reason)


def _tidy_up(
    frame: Frame, state: Child, hook: Callable[..., object], userdata: Any, outcome: str | None
) -> None:
    """Call `on_exit` of a state that has raised or was interrupted; its own error hides neither."""
    try:
        _call_hook(frame, state, hook, userdata, outcome)
    except Exception as error:  # noqa: BLE001  of the user's function
        log.logerr(error_text(error))


def _call_hook(frame: Frame, state: Any, hook: Callable[..., object], *arguments: Any) -> None:
    try:
        if state._smachpy_is_container:  # a leaf's grace covers its hooks
            call_bounded(state, frame, hook, arguments)
        else:
            hook(*arguments)
    except Exception as error:
        raise raised(frame.here(), f"hook {name_of(hook)}", error) from error


def time_left_around() -> float:
    """Return the time until a timeout of a container passes that has this state in it [s]."""
    frame, left = current_frame(), math.inf
    while frame is not None:
        if frame.timeout is not None:
            left = min(left, frame.timeout.left_s())
        frame = frame.parent
    return left


class Timeout:
    """The `timeout` of the child that `frame` runs: asks it to stop after `seconds`.

    Attributes:
        stopped: The child was a container in which this has stopped something; whatever ran after
            that, it has not finished its work.
    """

    def __init__(self, frame: Frame, seconds: float) -> None:
        self._frame = frame
        self._step: Step = frame.step
        self._seconds = seconds
        self.stopped = False
        self._passed = False
        self._ended = False
        self._alone = False
        self._halts = 0  # states below that an operator holds; these three need the run's lock
        self._due = self._left = 0.0
        self._timer: Timer | None = None

    def begin(self) -> bool:
        """Start the timeout.

        Returns:
            Whether it passed before this process began, in a durable run that has no goal and no
            children to go on with; then the attempt is over.
        """
        journal, frame = self._frame.run.journal, self._frame
        if self._step.state._smachpy_is_container:
            frame.timeout = self
        left = journal.time_left(frame, self._seconds)
        if left > 0.0:
            self.start(left)
            return False
        self.over()
        return self._passed and not journal.goes_on(frame)

    def start(self, left: float) -> None:
        """Start the timeout with `left` seconds."""
        clock = self._frame.run.clock
        self._due = clock.now() + left
        self._timer = clock.call_later(left, self.over)

    def halt(self) -> None:
        """Stop the time while an operator holds a state below; `go_on` ends that."""
        with self._frame.run.lock:
            self._halts += 1
            if self._halts == 1 and self._timer is not None:
                self._timer.cancel()
                self._left = max(0.0, self._due - self._frame.run.clock.now())
                self._frame.run.journal.halted(self._frame.here())

    def go_on(self) -> None:
        """Let the time go on, unless other states below are held."""
        with self._frame.run.lock:
            self._halts -= 1
            if self._halts == 0 and self._timer is not None and not (self._passed or self._ended):
                self._frame.run.journal.went_on(self._frame.here())
                self.start(self._left)

    def left_s(self) -> float:
        """Return the time until it passes [s]; infinite once it has, or while it is halted."""
        if self._passed or self._halts or self._ended:
            return math.inf
        return self._due - self._frame.run.clock.now()

    def is_alone(self) -> bool:
        """Return whether the timeout has passed and nobody else has asked the child to stop."""
        visit = self._frame.visit
        return self._passed and visit is not None and visit.step is self._step and visit.by_timeout

    def end(self, result: object) -> bool:
        """End the attempt, whose outcome or exception is `result`.

        An interruption may end this, then it must be called again.

        Returns:
            Whether only this timeout had asked the child to stop. The request then ends with the
            attempt, and the next attempt starts fresh; a request from anyone else stays.
        """
        frame = self._frame
        frame.timeout = None
        if self._timer is not None:
            self._timer.cancel()
        with frame.run.lock:
            # A timer that was cancelled too late finds this in `over` and does nothing.
            self._ended = True
            if not self._passed or frame.dead:
                return False
        visit = frame.visit
        if visit is None or visit.step is not self._step:
            return False
        if self._step.state._smachpy_is_container and isinstance(result, str):
            self.stopped = self.stopped or visit.spent or visit.has_answered(result)
        if frame.run.watched and visit.has_answered(result):
            visit.service()
        with frame.run.lock:
            visit.take_back()  # from here on no interruption of this attempt is pending
            # Looked up under the lock: a request may have arrived since the timeout's.
            if visit.by_timeout and not frame.dead:
                self._alone = True
                visit.happen(Event.NEXT_ATTEMPT)
        visit.settle()
        return self._alone

    def over(self) -> None:
        """Ask the child to stop; only the first call counts."""
        frame = self._frame
        with asking("timeout", frame.here(), f"{self._seconds:g} s"), frame.run.lock:
            if self._passed or self._ended or self._halts or frame.dead:
                return
            self._passed = ask(frame, self._step, timeout=self._seconds)
        frame.run.flush_soon()
