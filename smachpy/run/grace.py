"""Preemption at run time: a child is asked to stop, gets its grace, is interrupted, left behind.

The table in `smachpy.run.visit` says what happens to a visit; this module performs its effects.
They are performed with the run's lock held, so they must not run the user's code: events and log
texts are queued and published later without the lock, and a state's own `request_preempt` is called
in a thread of its own. Graces end on the clock's timer thread, which therefore never waits for a
listener or a logger.
"""

from __future__ import annotations

import contextlib
import inspect
import threading
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.context import THREAD, current_frame, current_path
from smachpy.events import (
    Abandoned,
    Finished,
    Left,
    OutcomeForced,
    PreemptRequested,
    PreemptServiced,
    TimedOut,
)
from smachpy.exceptions import InvalidTransitionError, did_you_mean
from smachpy.run.frame import clock_of_run
from smachpy.run.interrupt import Interruption, interrupt, take_back
from smachpy.run.stack_text import stack_of, stack_text
from smachpy.run.visit import IS_ASKED, STEPS, Decision, Effect, Event, Origin, Phase, Why, after

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actionlib_core.clock import Clock, Task, Timer
    from actionlib_core.shutdown import Shutdown
    from smachpy.run.child import Child, Parent
    from smachpy.run.frame import Frame, Run
    from smachpy.run.visit import Override

DEFAULT_GRACE_S = 10.0
PATIENCE_S = 0.1  # time for an interrupted state to unwind its `finally` blocks
LONGEST_PATIENCE_S = 1.0  # between two interruptions of a thread that cannot be left behind


@dataclass(slots=True, eq=False)
class Visit:
    """One visit of the child that `frame` runs.

    Attributes:
        phase: Its phase in the table.
        step: The child.
        by_timeout: Only its own timeout has asked it to stop.
        serviced: It has serviced the request.
        timeout: Its own timeout [s], once that has passed.
        override: The outcome or jump that an operator chose instead of its outcome.
        override_call: The thread of its own `request_preempt`, if it has one that was called.
    """

    _frame: Frame
    step: Any
    phase: Phase = Phase.RUNNING
    by_timeout: bool = False
    serviced: bool = False
    timeout: float | None = None
    override: Override | None = None
    override_call: Task | None = None
    _injected: int = 0  # the thread for which an exception is pending, 0 for none
    _patience: float = PATIENCE_S
    _timer: Timer | None = None
    _timer_number: int = 0

    def happen(self, event: Event) -> None:
        """Apply `event`: change the phase, then perform the effects; with the run's lock held."""
        # The phase changes first: an effect may come back here, as a container passes a request on
        # to its children, one of which may ask the container again.
        self.phase, effects = STEPS[self.phase, event]
        for effect in effects:
            self._PERFORM[effect](self)

    def is_asked(self) -> bool:
        """Return whether the child has been asked to stop."""
        return self.phase in IS_ASKED

    def has_answered(self, outcome: object) -> bool:
        """Return whether the child, which ended with `outcome`, serviced its request.

        It did if the outcome is 'preempted' or if it called `service_preempt()`. A child that just
        finished its work did not.
        """
        if outcome == "preempted":
            return self.is_asked() or self.phase is Phase.LEFT_BEHIND
        if not self.is_asked():
            return False
        # `service_preempt` clears the flag of a leaf. The flag of a container is cleared at its
        # end, so its last run says how it ended.
        state: Any = self.step.state
        return bool(
            state._smachpy.answered if state._smachpy_is_container else not state._preempt_requested
        )

    def service(self) -> None:
        """Publish, once, that the child services its request."""
        run = self._frame.run
        with run.lock:
            if not self.serviced and self.is_asked():
                self.serviced = True
                self.happen(Event.SERVICE)
        if run.pending:
            run.flush()

    def settle(self) -> None:
        """Wait until the `request_preempt` of the child, which has ended, has returned as well.

        Otherwise a late one would preempt the child's next visit. If it blocks, its thread is left
        behind.
        """
        frame, task = self._frame, self.override_call
        self.override_call = None
        if task is None or frame.dead:
            return
        try:
            ended = task.join(LONGEST_PATIENCE_S)
        except Interruption:  # a late one for the child, which has ended
            if frame.dead:
                raise
            return
        if not ended:
            frame.run.note_log(f"{task.name} still runs; its thread is left behind.")
            frame.run.flush_soon()

    # -- the effects of the table --------------------------------------------------------------

    def _publish_timed_out(self) -> None:
        self._frame.note(self._frame.here(), TimedOut, self.timeout)

    def _publish_request(self) -> None:
        frame = self._frame
        if frame.run.watched:
            is_container = self.step.state._smachpy_is_container
            grace = None if is_container else grace_of(frame, self.step.state)
            frame.note(frame.here(), PreemptRequested, *current_origin(), grace)

    def _tell(self) -> None:
        state: Any = self.step.state
        try:
            if state._smachpy_is_container:
                pass_on(state)
            else:
                mark_preempt(state)
        except Exception as error:  # noqa: BLE001  a callback's: the siblings must be told too
            self._frame.note_failure(self._frame.here(), _request_of(state), error)

    def _call_override(self) -> None:
        state, frame = self.step.state, self._frame
        if not has_own_request(state) or REQUESTING.get() is state:
            return
        path = frame.here()
        call = partial(call_override, state, frame, path)
        try:
            self.override_call = frame.run.clock.spawn(call, name=f"request_preempt of {path}")
        except Exception as error:  # noqa: BLE001  reported: no thread, for one
            frame.note_failure(path, _request_of(state), error)

    def _arm_grace(self) -> None:
        # A container has no grace: each of its children has one.
        state = self.step.state
        grace = None if state._smachpy_is_container else grace_of(self._frame, state)
        if grace is not None:
            self._start_timer(grace, Event.GRACE_OVER)

    def _publish_serviced(self) -> None:
        frame = self._frame
        if frame.run.watched:
            frame.note(frame.here(), PreemptServiced)

    def _publish_abandoned(self) -> None:
        frame, clock = self._frame, self._frame.run.clock
        grace = grace_of(frame, self.step.state)
        path, described = frame.here(), frame.described()
        # Stack, time and subscribers are taken now: by the time the event is published, the thread
        # may be elsewhere and the frame dead, which has no subscribers.
        now = clock.now(), clock.time_ns()
        stack = stack_of(frame.first.thread)
        subscribers = frame.find_subscribers() if frame.run.watched else None

        def publish() -> None:
            text = stack_text(stack)  # reads source files: not under the lock
            if subscribers is not None:
                frame.give(subscribers, Abandoned(path, *now, grace or 0.0, text))
            frame.run.note_log(
                f"{described}: still runs {grace or 0.0:g} s after its preempt; interrupted. It "
                f"was at:\n{text}"
            )

        frame.run.pending.append(publish)

    def _arm_patience(self) -> None:
        patience, self._patience = self._patience, min(2 * self._patience, LONGEST_PATIENCE_S)
        can_be_left = self._frame.first.can_be_left
        self._start_timer(patience, Event.LEAVE if can_be_left else Event.INTERRUPT_AGAIN)

    def _interrupt(self) -> None:
        ident = self._frame.first.thread
        if interrupt(self._frame.run.clock, ident, self._is_on):
            self._injected = ident

    def _publish_left(self) -> None:
        """Queue the `Left` events of the child and of all containers left behind with it."""
        # The subscribers are looked up now: once the frames are dead they have none.
        frame, run = self._frame, self._frame.run
        first = frame.first
        last = outcome_left(first)
        now = run.clock.now(), run.clock.time_ns()
        for each in _up_to(frame, first):
            if run.watched and each.is_in_child():
                kind = Finished if each.parent is None else Left
                event = kind(each.here(), *now, last if each is first else "preempted")
                run.pending.append(partial(each.give, each.find_subscribers(), event))
        run.note_log(f"{frame.described()}: did not react; its thread is left behind.")

    def _cut_off(self) -> None:
        """Cut the thread off from userdata, events and later runs; then report it as ended.

        The thread keeps dead frames: it can neither start another state, nor write userdata, nor
        end a later run, nor publish events.
        """
        frame = self._frame
        first: Any = frame.first
        chain = _up_to(frame, first)
        try:
            # All frames are dead before the first one is taken apart: the thread is still running.
            for each in chain:
                each.dead = True
                each.subscribers = None
            for each in chain:
                if each.step is not None:
                    each.step.cut_off()
                    each.step.state._preempt_requested = False
                data = each.data
                # The steps stay with the thread, so the next run needs new ones.
                data.plan = data.plain_plan = None
                if data.callback is each:
                    data.callback = None
                if data.frame is each:
                    data.frame = None
                    each.container._preempt_requested = False
                    for ended in tuple(data.end_waiters):
                        ended.set()
        finally:  # whatever was raised, the mission must go on without the thread
            frame.dead = True
            first.abandon()

    def _clear(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
            self._timer_number += 1  # one that has fired and waits for the lock is stale now
        if self._injected:
            take_back(self._injected)
            self._injected = 0
        self._patience = PATIENCE_S
        self.by_timeout = self.serviced = False
        self.step.state._preempt_requested = False

    def _is_on(self) -> bool:
        frame = self._frame
        return self.is_asked() and frame.visit is self and frame.step is self.step

    def _start_timer(self, seconds: float, event: Event) -> None:
        self._timer_number += 1
        over = partial(self._on_timer, event, self._timer_number)
        self._timer = self._frame.run.clock.call_later(seconds, over)

    def _on_timer(self, event: Event, number: int) -> None:
        with self._frame.run.lock:
            if not self._is_on() or number != self._timer_number:  # cancelled after it had fired
                return
            # A callback of a concurrence is left behind only after the branches, whose graces are
            # their own: the container goes on at that moment and must not leave running children.
            group = self._frame.waits_for() if event is Event.LEAVE else None
            if group is not None and group.running():
                group.when_ended = partial(self._on_timer, event, number)
                return
            self.happen(event)
        self._frame.run.flush_soon()

    _PERFORM: ClassVar[dict[Effect, Callable[[Visit], None]]] = {
        Effect.PUBLISH_TIMED_OUT: _publish_timed_out,
        Effect.PUBLISH_REQUEST: _publish_request,
        Effect.TELL: _tell,
        Effect.CALL_OVERRIDE: _call_override,
        Effect.ARM_GRACE: _arm_grace,
        Effect.PUBLISH_SERVICED: _publish_serviced,
        Effect.PUBLISH_ABANDONED: _publish_abandoned,
        Effect.ARM_PATIENCE: _arm_patience,
        Effect.INTERRUPT: _interrupt,
        Effect.PUBLISH_LEFT: _publish_left,
        Effect.CUT_OFF: _cut_off,
        Effect.CLEAR: _clear,
    }


# -- the origin of a request --------------------------------------------------------------------
#
# A request is passed on to every active state in the thread that makes it, so an origin set once
# per thread holds for all of them.

REQUESTING: ContextVar[object] = ContextVar("smachpy_requesting", default=None)
"""The state whose `request_preempt` runs in this context: a call from within it does nothing."""


class _ThreadOrigin(threading.local):
    """The origin of this thread's requests; no context variable, as asyncio tasks inherit those."""

    origin: Origin | None = None


_thread = _ThreadOrigin()


@contextlib.contextmanager
def asking(source: str, by: str = "", why: str = "") -> Iterator[None]:
    """Set the origin of all requests that this thread makes inside the `with` block.

    Inside another such block it changes nothing: the outer one is nearer to the first cause.
    """
    before = _thread.origin
    if before is None:
        _thread.origin = Origin(source, by, why)
    try:
        yield
    finally:
        _thread.origin = before


@contextlib.contextmanager
def shutdown_asking(shutdown: Shutdown) -> Iterator[None]:
    """Set the origin to the program's shutdown, and to the signal that requested it."""
    reason = shutdown.reason or ""
    with asking("signal" if reason.startswith("SIG") else "shutdown", reason):
        yield


def current_origin() -> Origin:
    """Return the origin set for this thread, else the state that runs in it, else the thread."""
    given = _thread.origin
    if given is not None:
        return given
    first: Frame | None = THREAD.get()
    if first is not None and first.innermost is not None:
        return Origin("state", first.innermost.here())
    return Origin("program", threading.current_thread().name)


# -- asking --------------------------------------------------------------------------------------


def on_preempt(state: Child, callback: Callable[[], object]) -> Callable[[], None]:
    """Call `callback` on each request to `state`, and at once if there is one already.

    Returns:
        A function that removes the callback.

    Threads: the callback runs in the requester's thread with the run's lock held, maybe in a signal
        handler. It must not block, so it must not be the user's; see `PreemptNotice` for those.
    """
    # First register, then look at the flag; `mark_preempt` does it the other way round. So a
    # request that arrives in between is noticed here or there, maybe twice, never missed.
    callbacks = state._smachpy.preempt_callbacks
    callbacks.append(callback)
    if state._preempt_requested:
        callback()

    def forget() -> None:
        if callback in callbacks:
            callbacks.remove(callback)

    return forget


def wait_for_preempt(state: Child, clock: Clock, seconds: float | None) -> bool:
    """Wait at most `seconds` for a request to `state`.

    Returns:
        Whether there is one.

    Blocks: that long; None waits for ever.
    """
    wake = clock.event()
    callbacks = state._smachpy.preempt_callbacks
    callbacks.append(wake.set)  # before the look at the flag, as in `on_preempt`
    try:
        if not state._preempt_requested:
            wake.wait(seconds)
    finally:
        callbacks.remove(wake.set)
    return state._preempt_requested


def mark_preempt(state: Child) -> None:
    """Set the preempt flag of `state` and call its preempt callbacks.

    Raises:
        Exception: the first one that a callback raised, after all were called.
    """
    state._preempt_requested = True
    failure: Exception | None = None
    for callback in tuple(state._smachpy.preempt_callbacks):
        try:
            callback()
        except Exception as error:  # noqa: BLE001  raised below, after the other callbacks
            failure = failure or error
    if failure is not None:
        raise failure


def has_own_request(state: Child) -> bool:
    """Return whether the user has overridden `request_preempt`."""
    try:
        function = getattr(state.request_preempt, "__func__", None)
    except Exception:  # noqa: BLE001  a property that raises: reported where it is called
        return True
    return function is not type(state)._smachpy_request_preempt


def _request_of(state: Child) -> Any:
    """Return the `request_preempt` of `state` for its name only, without running a property."""
    found = inspect.getattr_static(state, "request_preempt")
    return getattr(found, "fget", None) or found


def ask(frame: Frame, step: Any = None, *, timeout: float | None = None) -> bool:
    """Ask the child that `frame` runs to stop; with the run's lock held.

    Args:
        frame: Where the child runs.
        step: The child to ask; None: the one that runs.
        timeout: The child's own timeout [s], if that is what asks.

    Returns:
        Whether the child was running, or about to start.
    """
    before, meant = frame.visit, step or frame.step
    if meant is None:
        return False
    # A child has no visit until somebody asks or watches: the hot path makes none.
    visit = before
    if visit is None or visit.step is not meant:
        visit = Visit(frame, meant)
    # The thread of the frame goes on without this lock. It writes `frame.step` and then reads
    # `frame.visit`; here `frame.visit` is written first and `frame.step` read after it. Whatever
    # the order in time, at least one of the two sees what the other wrote, so no request is lost.
    frame.visit = visit
    if frame.step is not meant or frame.dead or frame.ended:
        frame.visit = before
        return False
    if timeout is None:
        visit.by_timeout = False
    elif not visit.is_asked():
        visit.by_timeout = True
    visit.timeout = timeout
    if frame.run.control is not None:
        frame.run.control.release(f"{frame.path}/{meant.label}")
    visit.happen(Event.ASK if timeout is None else Event.TIME_OVER)
    return True


def ask_child(frame: Frame, step: Any, override: Override | None = None) -> bool:
    """Ask the child of `step` to stop, but not its container; return whether it was running."""
    with frame.run.lock:
        asked = ask(frame, step)
        if asked and frame.visit is not None:
            frame.visit.override = override
    frame.run.flush_soon()
    return asked


def pass_on(container: Parent) -> None:
    """Set the flag of a container, then ask its running children; with the run's lock held.

    Raises:
        Exception: a preempt callback of the container raised; all its children were asked.
    """
    data = container._smachpy
    if data.is_passing_on:
        return  # a child's callback asks the container, which is just passing a request on
    data.is_passing_on = True
    try:
        try:
            # First the flag, then the look at `data.frame`: see the end of `Container.__run`.
            mark_preempt(container)
        finally:
            # While a callback of the container runs, the frame's step is one that comes after it.
            # The flag stops that one, so it is not asked. Branches run beside a callback.
            if data.frame is not None and (data.callback is None or data.frame.group is not None):
                group = data.frame.group
                for each in (data.frame,) if group is None else group.running():
                    ask(each)
            if data.callback is not None:
                ask(data.callback)
    finally:
        data.is_passing_on = False


def request(container: Parent, only: Frame | None = None) -> Run | None:
    """Ask a container and everything running in it to stop; events are queued, not published.

    Args:
        container: The container. Before a run only its flag is set, and the next run ends at once.
        only: Ask only if the run of this frame is still on.

    Returns:
        The run that was asked, or None.
    """
    data = container._smachpy
    origin = current_origin()
    with asking(*origin):
        frame: Frame | None = data.root or data.frame or data.callback
        if frame is None and only is None:
            data.origin = origin
            pass_on(container)
            # A run that began meanwhile has seen the flag; the caller publishes its events.
            frame = data.root or data.frame or data.callback
            return None if frame is None else frame.run
        if frame is None:
            return None
        with frame.run.lock:
            if data.is_passing_on or (only is not None and only is not frame):
                return None
            if frame.run.journal is not None and frame.run.journal.asked(frame, origin):
                return None
            if frame is data.root:
                ask(frame)
            elif frame is data.frame or frame is data.callback:
                try:
                    pass_on(container)
                except Exception as error:  # noqa: BLE001  reported; all children were asked
                    frame.note_failure(frame.path, _request_of(container), error)
            else:  # it has just ended: the request is for its next run
                container._preempt_requested = True
        return frame.run


def request_soon(container: Parent, only: Frame | None = None) -> None:
    """Ask as `request` does, without waiting for listeners or other code of the user.

    If the container overrides `request_preempt`, that is called in a new thread.
    """
    run = request(container, only)
    data = container._smachpy
    if data.root is None and has_own_request(container):
        clock = clock_of_run() if run is None else run.clock
        name = f"request_preempt of /{container.name or 'SM_ROOT'}"
        clock.spawn(partial(call_override, container, data.frame, ""), name=name)
    if run is not None:
        run.flush_soon()


def call_override(state: Child, frame: Frame | None, path: str) -> None:
    """Call the overridden `request_preempt` of a state that was asked; the body of its thread."""
    REQUESTING.set(state)

    def ask_it() -> None:
        state.request_preempt()  # looked up in here, as a property of the user's may raise

    _call_reported(ask_it, _request_of(state), frame, path)


def _call_reported(
    function: Callable[[], object], named: object, frame: Frame | None, path: str
) -> None:
    """Call the user's `function` in a thread of its own; what it raises is reported as `named`."""
    try:
        function()
    except BaseException as error:  # the end of this thread: nobody else is affected
        if frame is None:  # outside of any machine: the clock reports what its threads raise
            raise
        frame.note_failure(path or frame.path, named, error)
        frame.run.flush()


class PreemptNotice:
    """Calls a user's function on requests to a state, in a thread of its own: it blocks nobody.

    Requests that arrive while the function runs are merged into one more call.

    Threads: any, also in a signal handler.
    """

    def __init__(self, function: Callable[[], object]) -> None:
        self._function: Callable[[], object] | None = function
        self._frame: Frame | None = current_frame()
        self._path = current_path()
        self._clock = clock_of_run()
        self._busy = threading.Lock()
        self._asked = False  # without a lock: a signal handler could interrupt its holder

    def __call__(self) -> None:
        """Start a thread that calls the function."""
        self._asked = True
        self._clock.spawn(self._work, name=f"on_preempt of {self._path or 'a state'}")

    def forget(self) -> None:
        """Stop calling the function."""
        self._function = None

    def _work(self) -> None:
        # If the lock is taken, the thread that holds it looks at the flag again after its call.
        while self._asked and self._busy.acquire(blocking=False):
            try:
                self._asked = False  # before the call: a request during it needs another one
                function = self._function
                if function is not None:
                    _call_reported(function, function, self._frame, self._path)
            finally:
                self._busy.release()


def note_serviced(state: Child) -> None:
    """Publish that `state`, which runs in this context, services its request."""
    first: Frame | None = THREAD.get()
    frame = None if first is None else first.innermost
    if frame is None:
        return
    visit = frame.visit
    if visit is not None and visit.step is frame.step and visit.step.state is state:
        visit.service()


def forget_visit(frame: Frame) -> None:
    """End a visit whose outcome is not followed: its child, or its frame, has already ended."""
    with frame.run.lock:
        visit = frame.visit
        if visit is None or frame.dead:
            return
        frame.visit = None
        visit.happen(Event.END)
    if visit.override_call is not None:
        visit.settle()


def leave(frame: Frame) -> None:
    """Clear the flags at the end of a container's run: a request belongs to one run."""
    container, data, step = frame.container, frame.data, frame.step
    with frame.run.lock:
        if frame.dead:
            return
        if data.frame is None:  # else it runs again by now
            container._preempt_requested = False
        if step is not None:  # a child that asked itself and then raised
            step.state._preempt_requested = False
    if frame.visit is not None:
        forget_visit(frame)
    for ended in tuple(data.end_waiters):
        ended.set()


# -- the end of a visit ------------------------------------------------------------------------


def end_visit(frame: Frame, outcome: Any) -> Decision:
    """End the visit of the child that `frame` runs, and decide where the container goes.

    Called only if the child or its container may have been asked to stop. Afterwards
    `frame.answered` says whether the request to the container was serviced.

    Raises:
        InvalidTransitionError: the child has no such outcome.
        Interruption: the thread was left behind meanwhile.
    """
    step = frame.step
    state: Child = step.state
    with frame.run.lock:  # a request is passed on completely before or after this, never in between
        if frame.dead:
            raise Interruption
        visit = frame.visit
        if visit is not None and visit.step is not step:  # asked after the child before had ended
            forget_visit(frame)
            visit = None
        answered = visit is not None and visit.has_answered(outcome)
        asked = state._preempt_requested or (visit is not None and visit.is_asked())
        override = None if visit is None else visit.override
        if visit is not None:
            visit.happen(Event.END)
        frame.visit = None
        state._preempt_requested = False
        run_asked = frame.container._preempt_requested
        if asked or run_asked:
            decision = after(
                outcome, step.next, run_asked=run_asked, answered=answered, override=override
            )
        else:
            target = step.next.get(outcome) if isinstance(outcome, str) else None
            decision = Decision(Why.UNKNOWN if target is None else Why.FOLLOWED, target)
        frame.answered = answered
        if decision.why is Why.ANSWERED:  # the request is spent; a second one starts from here
            frame.container._preempt_requested = frame.answered = False
    if visit is not None and visit.override_call is not None:
        visit.settle()
    if decision.why is Why.UNKNOWN:
        raise unknown_outcome(step.path_in(frame), state._smachpy.outcomes, outcome) from None
    if decision.why is Why.FORCED and override is not None:
        frame.emit(OutcomeForced, override.outcome)
    return decision


def unknown_outcome(path: str, outcomes: Iterable[str], got: object) -> InvalidTransitionError:
    """Return the error for a child that returned something other than one of its outcomes."""
    known = sorted(outcomes)
    hint = did_you_mean(got, known) if isinstance(got, str) else ""
    if got is None:
        hint = " Try a `return` at the end of every way through execute."
    elif inspect.iscoroutine(got):
        got.close()
        hint = " Try `async def execute`, or `await` it."
    return InvalidTransitionError(
        f"{path}: unknown outcome: got {got!r}; expected one of {known}.{hint}"
    )


# -- graces --------------------------------------------------------------------------------------


def grace_of(frame: Frame, state: Child) -> float | None:
    """Return the grace of a child after a request [s]; None for no limit."""
    rule, grace = state._smachpy_grace, state._smachpy.options.preempt_timeout
    if grace == "inherit" or rule is not None:
        inherited = inherited_grace(frame)
        grace = inherited if rule is None else rule(inherited)
    if grace == "inherit":
        return DEFAULT_GRACE_S
    return None if grace is None else float(grace)


def inherited_grace(frame: Frame | None) -> Any:
    """Return the `preempt_timeout` of the nearest container that sets one, else "inherit"."""
    while frame is not None:
        grace = frame.data.options.preempt_timeout
        if grace != "inherit":
            return grace
        frame = frame.parent
    return "inherit"


def outcome_left(frame: Frame) -> str:
    """Return the outcome that the child of `frame` gets if it is left behind now."""
    visit = frame.visit
    late = visit is not None and visit.by_timeout
    outcome: str = frame.step.state._smachpy.options.timeout_outcome if late else "preempted"
    return outcome


def _up_to(frame: Frame, first: Frame) -> list[Frame]:
    """Return the frames left behind with `frame`: itself and its parents up to `first`."""
    chain = [frame]
    while chain[-1] is not first and chain[-1].parent is not None:
        chain.append(chain[-1].parent)
    return chain
