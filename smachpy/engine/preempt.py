"""Preemption at run time: a child is asked to stop, gets its grace, is interrupted, left behind.

The table in `smachpy.engine.visit` says what happens to a visit; this module performs its effects.
They are performed with the run's lock held, so they must not run the user's code: events and log
texts are queued and published later without the lock, and a state's own `request_preempt` is called
in a thread of its own. Graces end on the clock's timer thread, which therefore never waits for a
listener or a logger.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from contextvars import ContextVar
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from actionlib_core.clock import RealClock, current_clock
from smachpy.base.context import THREAD, current_frame, current_path
from smachpy.engine.errors import unknown_outcome
from smachpy.engine.frame import clock_of_run
from smachpy.engine.interrupt import Interruption, interrupt, take_back
from smachpy.engine.stack_text import stack_of, stack_text
from smachpy.engine.visit import (
    CHOSEN,
    ENDED,
    FOLLOWED,
    IS_ASKED,
    NOT_STARTED,
    RUNNING,
    STEPS,
    STOPPED,
    Decision,
    Effect,
    Event,
    Origin,
    Phase,
    Why,
    after,
    choice_after,
    followed,
)
from smachpy.events import (
    Abandoned,
    Finished,
    Left,
    OutcomeForced,
    PreemptRequested,
    PreemptServiced,
    TimedOut,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actionlib_core.clock import Clock, Task, Timer
    from actionlib_core.shutdown import Shutdown
    from smachpy.engine.described import Child, Parent
    from smachpy.engine.frame import Frame, Run
    from smachpy.engine.visit import Override

DEFAULT_GRACE_S = 10.0
PATIENCE_S = 0.1  # time for an interrupted state to unwind its `finally` blocks
MAX_PATIENCE_S = 1.0  # between two interruptions of a thread that cannot be left behind


ANSWER_S = 0.25
"""Longest wait of a request in the main thread until another thread has passed it on [s]."""

ANSWER_LOOKS = 50
"""Looks at the answer in `ANSWER_S`. Between two of them the other thread can run. One long wait
would be over at once if the computer had been too busy for both threads."""

FLAGS = threading.RLock()
"""Held to set or read the flag of a state together with what follows from it outside of a visit:
its callbacks, and whether a run has begun. It is taken after the lock of a run, and nothing is
called with it."""


class Visit:
    """One visit of the child that `frame` runs.

    Attributes:
        phase: Its phase in the table.
        step: The child.
        by_timeout: Only its own timeout has asked it to stop.
        serviced: It has serviced the request.
        spent: It is a container in which a child has serviced the request, and others ran then.
        answered: A container: its run ended because a request to stop was serviced.
        timeout: Its own timeout [s], once that has passed.
        override: The outcome or jump that an operator chose instead of its outcome.
        override_call: The thread of its own `request_preempt`, if it has one that was called.
        holds: The resource that it holds, or "".
    """

    __slots__ = (
        *("by_timeout", "serviced", "answered", "spent", "timeout", "override", "override_call"),
        "holds",
        *("step", "phase", "_frame", "_injected", "_patience", "_timer", "_timer_number"),
    )

    def __init__(self, frame: Frame, step: Any, phase: Phase = CHOSEN) -> None:
        self._frame = frame
        self.step = step
        self.phase = phase
        self.by_timeout = self.serviced = self.answered = self.spent = False
        self.timeout: float | None = None
        self.override: Override | None = None
        self.override_call: Task | None = None
        self.holds = ""
        self._injected = 0  # the thread for which an exception is pending, 0 for none
        self._patience = PATIENCE_S
        self._timer: Timer | None = None
        self._timer_number = 0

    def happen(self, event: Event) -> None:
        """Apply `event`: change the phase, then perform the effects; with the run's lock held."""
        # The phase changes first: an effect may come back here, as a container passes a request on
        # to its children, one of which may ask the container again.
        self.phase, effects = STEPS[self.phase, event]
        for effect in effects:
            self._PERFORM[effect](self)

    def end(self) -> None:
        """End the visit; with the run's lock held.

        An interruption may end this, then it must be called again: after it none is pending.
        """
        self.take_back()
        self.happen(Event.END)
        self.step.state._preempt_requested = False

    def is_asked(self) -> bool:
        """Return whether the child has been asked to stop."""
        return self.phase in IS_ASKED

    def has_answered(self, outcome: object) -> bool:
        """Return whether the child, which ended with `outcome`, serviced its request.

        It did if the outcome is 'preempted' or if it called `service_preempt()`. A child that just
        finished its work did not.
        """
        if isinstance(outcome, str) and outcome == "preempted":
            return self.is_asked() or self.phase is Phase.LEFT_BEHIND
        if not self.is_asked():
            return False
        # `service_preempt` clears the flag of a leaf; that of a container is cleared at its end.
        state: Any = self.step.state
        return bool(self.answered if state._smachpy_is_container else not state._preempt_requested)

    def service(self) -> None:
        """Publish, once, that the child services its request."""
        run = self._frame.run
        with run.lock:
            if not self.serviced and self.is_asked():
                self.serviced = True
                self.happen(Event.SERVICE)
        if run.pending:
            run.flush()

    def recall(self) -> None:
        """Withdraw the request: the child runs on as if nobody had asked."""
        with self._frame.run.lock:
            if not self._frame.dead:
                if self.is_asked():
                    self._frame.run.journal.recalled(self._frame.here())
                self.override = None  # an operator's choice was part of the request
                self.happen(Event.RECALL)
        self._frame.run.journal.commit()

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
            ended = task.join(MAX_PATIENCE_S)
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
                journal = self._frame.run.journal
                self.spent = journal.has_served(self._frame.here())
                if not (self.spent or journal.holds_back(self._frame.here())):
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
                frame.publish(Abandoned(path, *now, grace or 0.0, text), subscribers)
            frame.run.note_log(
                f"{described}: still runs {grace or 0.0:g} s after its preempt; interrupted. It "
                f"was at:\n{text}"
            )

        frame.run.pending.append(publish)

    def _arm_patience(self) -> None:
        patience, self._patience = self._patience, min(2 * self._patience, MAX_PATIENCE_S)
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
                run.pending.append(partial(each.publish, event, each.find_subscribers()))
        names = [each.visit.holds for each in _up_to(frame, first) if each.visit is not None]
        holds = "".join(f", and still holds {name}" for name in names if name)
        run.note_log(f"{frame.described()}: did not react; its thread is left behind{holds}.")

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
                live = each.live
                # The steps stay with the thread, so the next run needs new ones.
                live.plan = None
                if each.parent is not None:
                    live.stopped_at = getattr(each.step, "label", "")
                if live.callback is each:
                    live.callback = None
                if live.frame is each:
                    live.frame = None
                    live.ended += live.root is None
                    each.container._preempt_requested = False
                    waiters, live.end_waiters = live.end_waiters, []
                    for ended in waiters:
                        ended.set()
        finally:  # whatever was raised, the mission must go on without the thread
            frame.dead = True
            first.abandon()

    def _clear(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
            self._timer_number += 1  # one that has fired and waits for the lock is stale now
        self.take_back()
        self._patience = PATIENCE_S
        self.by_timeout = self.serviced = self.answered = self.spent = False
        self.step.state._preempt_requested = False

    def take_back(self) -> None:
        """Remove an interruption that has not been raised yet; with the run's lock held.

        Not that of a thread which was left behind: it ends what still runs there.
        """
        if self._injected and not self._frame.dead:
            take_back(self._injected)
            self._injected = 0

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

    Threads: the callback runs in the requester's thread with the run's lock held. It must not
        block, so it must not be the user's; see `PreemptNotice` for those.
    """
    callbacks = state._smachpy.preempt_callbacks
    with FLAGS:
        callbacks.append(callback)
        is_asked = state._preempt_requested
    if is_asked:
        callback()

    def forget() -> None:
        with FLAGS:
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
    forget = on_preempt(state, wake.set)
    try:
        wake.wait(seconds)
    finally:
        forget()
    return state._preempt_requested


def mark_preempt(state: Child) -> None:
    """Set the preempt flag of `state` and call its preempt callbacks.

    Raises:
        Exception: the first one that a callback raised, after all were called.
    """
    with FLAGS:
        state._preempt_requested = True
        callbacks = tuple(state._smachpy.preempt_callbacks)
    _call_back(callbacks)


def _call_back(callbacks: Iterable[Callable[[], object]]) -> None:
    failure: Exception | None = None
    for callback in callbacks:
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
    from inspect import getattr_static  # here: a machine rarely needs it

    found = getattr_static(state, "request_preempt")
    return getattr(found, "fget", None) or found


def ask(
    frame: Frame,
    step: Any = None,
    *,
    timeout: float | None = None,
    override: Override | None = None,
) -> bool:
    """Ask the child that `frame` runs to stop; with the run's lock held.

    Args:
        frame: Where the child runs.
        step: The child to ask; None: the one that runs.
        timeout: The child's own timeout [s], if that is what asks.
        override: As for `ask_child`.

    Returns:
        Whether the child was running, or about to start.
    """
    visit, meant = frame.visit, step or frame.step
    if visit is None or visit.step is not meant or frame.dead or frame.ended:
        return False
    if not frame.run.journal.passes(meant.path_in(frame)):
        return False
    if timeout is None:
        # Before the child hears of it: one that ends at once looks at it without the lock.
        asked = visit.is_asked() and not visit.by_timeout
        visit.override = choice_after(visit.override, override, asked=asked)
        visit.by_timeout = False
    elif not visit.is_asked():
        visit.by_timeout = True
    visit.timeout = timeout
    if frame.run.control is not None:
        frame.run.control.release(f"{frame.path}/{meant.label}")
    visit.happen(Event.ASK if timeout is None else Event.TIME_OVER)
    return True


def ask_child(frame: Frame, step: Any, override: Override | None = None) -> bool:
    """Ask the child of `step` to stop, but not its container; return whether it was running.

    Args:
        frame: Where it runs.
        step: The child.
        override: What the operator chose for its end; None if it is no operator who asks. See
            `smachpy.engine.visit.choice_after`.

    Blocks: for the journal of a durable mission; the child has been told by then.
    """
    with frame.run.lock:
        asked = ask(frame, step, override=override)
    frame.run.journal.commit()
    frame.run.flush_soon()
    return asked


def pass_on(container: Parent) -> None:
    """Set the flag of a container, then ask its running children; with the run's lock held.

    Raises:
        Exception: a preempt callback of the container raised; all its children were asked.
    """
    live = container._smachpy.live
    if live.is_passing_on:
        return  # a child's callback asks the container, which is just passing a request on
    if live.frame is not None and live.frame.tidying is not None:
        live.frame.tidying.asked()
        return
    live.is_passing_on = True
    try:
        try:
            mark_preempt(container)
        finally:
            for each in () if live.frame is None else live.frame.running():
                ask(each)
            if live.callback is not None:
                ask(live.callback)
    finally:
        live.is_passing_on = False


def frame_of(container: Parent) -> Frame | None:
    """Return the frame in which a request meets a container; None if it does not run."""
    live = container._smachpy.live
    return live.root or live.frame or live.callback


def request(
    container: Parent, only: Frame | None = None, *, before: int | None = None
) -> Run | None:
    """Ask a container and everything running in it to stop; events are queued, not published.

    Args:
        container: The container. Before a run only its flag is set, and the next run ends at once.
        only: Ask only if the run of this frame is still on.
        before: What `Live.ended` was when it was asked, between two runs. If one has ended since,
            the request was for that one, and nobody is asked.

    Returns:
        The run that was asked, or None.

    Blocks: for the journal of a durable mission; all have been told by then.
    """
    live = container._smachpy.live
    origin = current_origin()
    with asking(*origin):
        with FLAGS:
            frame = frame_of(container)
            is_for_next = frame is None and only is None and before in {None, live.ended}
            if is_for_next:
                live.origin = origin
                container._preempt_requested = True  # the run that begins next sees it
        if frame is None:
            if is_for_next:
                _call_back(tuple(container._smachpy.preempt_callbacks))
            return None
        wanted = (only or frame).run
        with frame.run.lock:
            now = frame_of(container)
            # It may have just ended. Or it goes on in another frame: the user's code around its
            # children has begun them meanwhile.
            if now is None or not frame.run is now.run is wanted:
                return None
            if live.is_passing_on or before not in {None, live.ended}:
                return None
            # A listener that answers each request with a further one would never come to an end.
            if container._preempt_requested and wanted.is_publishing():
                return None
            asked = None if wanted.journal.asked(now, origin) else _ask_in(now, container)
        wanted.journal.commit()
        return asked


def _ask_in(frame: Frame, container: Parent) -> Run:
    """Ask a container that runs in `frame`, and all that runs in it; with the run's lock held."""
    run = frame.run
    if frame is container._smachpy.live.root:
        ask(frame)
        if run.control is not None:  # what may still run now is not to be held
            run.control.stop(run)
    else:
        try:
            pass_on(container)
        except Exception as error:  # noqa: BLE001  reported; all children were asked
            frame.note_failure(frame.path, _request_of(container), error)
    return run


def request_now(container: Parent, by: str = "") -> None:
    """Ask as `request` does, in a thread or signal handler of which nothing is known.

    Python runs signal handlers in the main thread, between any two steps of it, so one may have
    interrupted code that holds a lock. That code goes on only when the handler has returned. So in
    the main thread this only hands the request to another thread, and waits until it was passed on,
    at most `ANSWER_S`.

    Args:
        container: The container.
        by: Who asks; the name of a signal is taken for one. "" finds it out.
    """
    origin = current_origin()
    if by:
        origin = Origin("signal" if by in signal.Signals.__members__ else "program", by)
    ended = container._smachpy.live.ended
    frame = frame_of(container)
    before = ended if frame is None else None  # else it is for the run of this frame
    clock = current_clock() if frame is None else frame.run.clock
    told = clock.event()

    def ask_it() -> None:
        token = REQUESTING.set(container)
        try:
            with asking(*origin):
                run = request(container, frame, before=before)
        finally:
            REQUESTING.reset(token)
            told.set()
        if run is not None and run.pending:
            run.flush(wait=False)

    # Virtual time is that of its own threads: another one would disturb their order.
    if isinstance(clock, RealClock) and threading.current_thread() is threading.main_thread():
        try:
            clock.spawn(ask_it, name=f"preempt of /{container.name or 'SM_ROOT'}")
        except RuntimeError:  # no thread can be started, at the interpreter's exit for one
            ask_it()
        else:
            any(told.wait(ANSWER_S / ANSWER_LOOKS) for _ in range(ANSWER_LOOKS))
    else:
        ask_it()


def request_soon(container: Parent, only: Frame | None = None) -> None:
    """Ask as `request` does, without waiting for listeners or other code of the user.

    If the container overrides `request_preempt`, that is called in a new thread.
    """
    run = request(container, only)
    live = container._smachpy.live
    if live.root is None and has_own_request(container):
        clock = clock_of_run() if run is None else run.clock
        name = f"request_preempt of /{container.name or 'SM_ROOT'}"
        clock.spawn(partial(call_override, container, live.frame, ""), name=name)
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

    Threads: any.
    """

    def __init__(self, function: Callable[[], object]) -> None:
        self._function: Callable[[], object] | None = function
        self._frame: Frame | None = current_frame()
        self._path = current_path()
        self._clock = clock_of_run()
        self._is_asked = self._is_busy = False

    def __call__(self) -> None:
        """Start a thread that calls the function."""
        with FLAGS:
            self._is_asked = True
        self._clock.spawn(self._work, name=f"on_preempt of {self._path or 'a state'}")

    def forget(self) -> None:
        """Stop calling the function."""
        self._function = None

    def _work(self) -> None:
        while True:
            with FLAGS:
                if self._is_busy or not self._is_asked:
                    return  # the thread that is busy looks again after its call
                self._is_busy, self._is_asked = True, False
                function = self._function
            try:
                if function is not None:
                    _call_reported(function, function, self._frame, self._path)
            finally:
                with FLAGS:
                    self._is_busy = False


def note_serviced(state: Child) -> None:
    """Publish that `state`, which runs in this context, services its request."""
    visit = _visit_here(state)
    if visit is not None:
        visit.service()


def serve(container: Parent) -> None:
    """Note that the container's own code services the request to it: what is above goes on."""
    visit, frame = _visit_here(container), container._smachpy.live.frame
    container._preempt_requested = False
    if visit is None or not visit.is_asked():
        return
    visit.answered = True
    if frame is not None:
        frame.answered = True
    visit.service()


def recall(state: Child) -> None:
    """Withdraw the request to `state`; if that runs in this context, its grace ends too."""
    visit = _visit_here(state)
    if visit is not None:
        visit.recall()
    state._preempt_requested = False


def _visit_here(state: Child) -> Visit | None:
    """Return the visit of `state` if that runs in this context."""
    first: Frame | None = THREAD.get()
    frame = None if first is None else first.innermost
    while frame is not None:
        visit = frame.visit
        if visit is not None and visit.step is frame.step and visit.step.state is state:
            return visit
        frame = frame.parent
    return None


# -- the begin and the end of a visit ----------------------------------------------------------


def choose(frame: Frame, step: Any) -> None:
    """Begin the visit of the child of `step` without starting it, as the operator may hold it.

    Raises:
        Interruption: the thread was left behind.
    """
    with frame.run.lock:
        if frame.dead:
            raise Interruption
        frame.step = step
        frame.visit = frame.visit or Visit(frame, step)


def start(frame: Frame, step: Any) -> bool:
    """Start the child of `step`, whose visit begins here if `choose` was not called.

    Returns:
        Whether it runs now. Not if it, or its container, has been asked to stop.

    Raises:
        Interruption: the thread was left behind.
    """
    with frame.run.lock:  # a request comes either before this or to a running child
        if frame.dead:
            raise Interruption
        frame.step = step
        visit, asked = frame.visit, frame.container._preempt_requested
        if visit is None:  # nobody can have asked for it before
            frame.visit = Visit(frame, step, CHOSEN if asked else RUNNING)
            return not asked
        if not asked:
            visit.happen(Event.START)
        return visit.phase not in NOT_STARTED


def call_off(frame: Frame) -> None:
    """Call off the child that `frame` has just started, and stop its container.

    For a journal that could not write that the child begins. The request to the container counts
    anew: children before this one may have serviced those that came before.
    """
    with frame.run.lock:
        frame.container._preempt_requested = True
        if frame.visit is not None:
            frame.visit.phase = Phase.CALLED_OFF


def end_visit(frame: Frame, outcome: Any) -> Decision:
    """End the visit of the child that `frame` runs, and decide where the container goes.

    Afterwards `frame.answered` says whether the request to the container was serviced.

    Raises:
        InvalidTransitionError: the child has no such outcome.
        Interruption: the thread was left behind, or an interruption that was pending ended this;
            then it must be called again.
    """
    step, visit, container = frame.step, frame.visit, frame.container
    assert visit is not None
    state: Child = step.state
    if frame.run.control is not None and visit.phase not in NOT_STARTED:
        frame.run.control.note_outcome(frame, step, outcome)
    with frame.run.lock:  # a request is passed on completely before or after this, never in between
        if frame.dead:
            raise Interruption
        if visit.phase is not RUNNING:
            visit.take_back()  # from here on no interruption is pending
        frame.visit = None  # nobody can ask for this visit any more, also no signal handler in here
        flags = container._preempt_requested or state._preempt_requested
        if visit.phase is RUNNING and not flags:
            # As in the table: nothing was armed that would have to be cleared.
            visit.phase, frame.answered = ENDED, False
            decision = followed(outcome, step.next)
        else:
            decision = _end_asked(frame, visit, outcome)
    if visit.override_call is not None:
        visit.settle()
    if decision.why is not FOLLOWED:
        if decision.why is Why.UNKNOWN:
            raise unknown_outcome(step.path_in(frame), state._smachpy.outcomes, outcome) from None
        if decision.why is Why.FORCED:
            frame.emit(OutcomeForced, decision.outcome)
            if frame.run.control is not None:  # there may be a breakpoint on what was chosen
                frame.run.control.note_outcome(frame, step, decision.outcome)
    return decision


def _note_spent(frame: Frame) -> None:
    """Note that what ran in the container of `frame`, and in those above it, was stopped."""
    while frame.parent is not None:
        above = frame.parent.visit
        if above is not None and above.step.state is frame.container and above.is_asked():
            above.spent = True
        frame = frame.parent


def _end_asked(frame: Frame, visit: Visit, outcome: Any) -> Decision:
    """End a visit in which the child, or its container, was asked; with the run's lock held."""
    step, container = frame.step, frame.container
    run_asked = container._preempt_requested
    answered = visit.has_answered(outcome)
    if run_asked and visit.phase in NOT_STARTED:
        decision = STOPPED
    else:
        override = visit.override
        decision = after(
            outcome, step.next, run_asked=run_asked, answered=answered, override=override
        )
    visit.end()
    if decision.why is Why.JUMPED and decision.target == step.label:
        frame.visit = Visit(frame, step)  # it runs again: a request from here on is for that visit
    frame.answered = answered or decision.why is Why.STOPPED
    if decision.why is Why.ANSWERED:  # the request is spent; a second one starts from here
        container._preempt_requested = frame.answered = False
        _note_spent(frame)
    return decision


def forget_visit(frame: Frame) -> None:
    """End a visit whose outcome is not followed: its child raised, or its frame has ended."""
    with frame.run.lock:
        visit = frame.visit
        if visit is None or frame.dead:
            return
        visit.end()
        frame.visit = None
    if visit.override_call is not None:
        visit.settle()


def leave_inner(frame: Frame) -> None:
    """End the runs inside of `frame` that several interruptions in a row kept from ending.

    A visit that had not ended would have the thread interrupted for ever.
    """
    first = frame.first
    while (inner := first.innermost) is not None and inner is not frame:
        leave(inner)
        first.innermost = inner.parent


def leave(frame: Frame) -> None:
    """End a container's run; a request belongs to one run, so its flag is cleared.

    An interruption may end this, then it must be called again.
    """
    leave_inner(frame)
    live = frame.live
    with frame.run.lock:
        if frame.dead:
            return
        if live.frame is frame:
            live.frame = None
            visit = None if frame.parent is None else frame.parent.visit
            if visit is not None and visit.step.state is frame.container:
                visit.answered = frame.answered
            frame.container._preempt_requested = False
            live.ended += live.root is None  # else it goes on, with another attempt maybe
        waiters, live.end_waiters = live.end_waiters, []
    if frame.visit is not None:
        forget_visit(frame)
    for ended in waiters:
        ended.set()


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
