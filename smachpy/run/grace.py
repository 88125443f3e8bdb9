"""The visit of a child: asked to stop, given its grace, interrupted, left behind.

What happens to a visit is the table of `smachpy.run.visit`; here each effect of it is performed.
All of it happens with the run's lock held, and no code of the user runs there but what waits for a
request: events and logs are noted and told afterwards, and a child's own `request_preempt` has a
thread of its own. Graces end on the clock's thread, which waits for no listener and no log.
"""

from __future__ import annotations

import contextlib
import inspect
import sys
import threading
from contextvars import ContextVar
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
from smachpy.run.visit import IS_ASKED, STEPS, Decision, Effect, Event, Origin, Phase, Why, after

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actionlib_core.clock import Clock, Task, Timer
    from actionlib_core.shutdown import Shutdown
    from smachpy.run.child import Child, Parent
    from smachpy.run.frame import Frame, Run
    from smachpy.run.visit import Override

DEFAULT_GRACE_S = 10.0
PATIENCE_S = 0.1  # how long an interrupted state has to unwind before it is left behind
LONGEST_PATIENCE_S = 1.0


class Visit:
    """One visit of the child that `frame` runs, and where it is.

    Attributes:
        phase: Where it is.
        step: The child.
        by_timeout: Nobody but its own timeout has asked.
        serviced: It has said that it takes the request up.
        timeout: Its own timeout [s], when that has passed.
        override: What an operator wants instead of its outcome.
        override_call: Its own `request_preempt`, which is running or has run.
    """

    __slots__ = (
        "_frame",
        "_injected",
        "_patience",
        "_timer",
        "_timer_number",
        "by_timeout",
        "override",
        "override_call",
        "phase",
        "serviced",
        "step",
        "timeout",
    )

    def __init__(self, frame: Frame, step: Any, phase: Phase = Phase.RUNNING) -> None:
        self.phase = phase
        self.step = step
        self.by_timeout = False
        self.serviced = False
        self.timeout: float | None = None
        self.override: Override | None = None
        self._frame = frame
        self._injected = 0  # thread to which an interruption is on its way
        self.override_call: Task | None = None
        self._patience = PATIENCE_S
        self._timer: Timer | None = None
        self._timer_number = 0

    def happen(self, event: Event) -> None:
        """Let `event` happen; with the run's lock held."""
        self.phase, effects = STEPS[self.phase, event]
        for effect in effects:
            self._PERFORM[effect](self)

    def is_asked(self) -> bool:
        """Tell whether somebody wants the child to stop."""
        return self.phase in IS_ASKED

    def has_answered(self, outcome: object) -> bool:
        """Tell whether the child, which ended with `outcome`, took its request up.

        It did if it says 'preempted' or has serviced the request; work that just finished did not.
        """
        if outcome == "preempted":
            return self.is_asked() or self.phase is Phase.LEFT_BEHIND
        if not self.is_asked():
            return False
        state: Any = self.step.state
        return bool(
            state._smachpy.answered if state._smachpy_is_container else not state._preempt_requested
        )

    def service(self) -> None:
        """Publish, once, that the child takes its request up."""
        run = self._frame.run
        with run.lock:
            if not self.serviced and self.is_asked():
                self.serviced = True
                self.happen(Event.SERVICE)
        if run.pending:
            run.flush()

    def settle(self) -> None:
        """Wait until the own `request_preempt` of the child that has ended has returned too.

        Else it might meet the child's next visit. One that blocks is left behind.
        """
        frame, task = self._frame, self.override_call
        self.override_call = None
        if task is None or frame.dead:
            return
        try:
            ended = task.join(LONGEST_PATIENCE_S)
        except Interruption:  # it was for the child, which has ended
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
        except Exception as error:  # noqa: BLE001  its siblings are told all the same
            self._frame.note_failure(self._frame.here(), _request_of(state), error)

    def _call_override(self) -> None:
        state, frame = self.step.state, self._frame
        if not has_own_request(state) or REQUESTING.get() is state:
            return
        path = frame.here()
        call = partial(call_override, state, frame, path)
        try:
            self.override_call = frame.run.clock.spawn(call, name=f"request_preempt of {path}")
        except Exception as error:  # noqa: BLE001  no thread, for one: told, as what it raises is
            frame.note_failure(path, _request_of(state), error)

    def _arm_grace(self) -> None:
        state = self.step.state
        grace = None if state._smachpy_is_container else grace_of(self._frame, state)
        if grace is not None:  # a container's children have their own
            self._start_timer(grace, Event.GRACE_OVER)

    def _publish_serviced(self) -> None:
        frame = self._frame
        if frame.run.watched:
            frame.note(frame.here(), PreemptServiced)

    def _publish_abandoned(self) -> None:
        frame, clock = self._frame, self._frame.run.clock
        grace = grace_of(frame, self.step.state)
        path, described = frame.here(), frame.described()
        now = clock.now(), clock.time_ns()
        lines = lines_of(frame.first.thread)
        subscribers = frame.find_subscribers() if frame.run.watched else None  # before it is dead

        def tell() -> None:
            stack = text_of(lines)
            if subscribers is not None:
                frame.give(subscribers, Abandoned(path, *now, grace or 0.0, stack))
            frame.run.note_log(
                f"{described}: still runs {grace or 0.0:g} s after its preempt; interrupted. It "
                f"was at:\n{stack}"
            )

        frame.run.pending.append(tell)

    def _arm_patience(self) -> None:
        patience, self._patience = self._patience, min(2 * self._patience, LONGEST_PATIENCE_S)
        can_be_left = self._frame.first.can_be_left
        self._start_timer(patience, Event.LEAVE if can_be_left else Event.INTERRUPT_AGAIN)

    def _interrupt(self) -> None:
        ident = self._frame.first.thread
        if interrupt(self._frame.run.clock, ident, self._is_on):
            self._injected = ident

    def _publish_left(self) -> None:
        """Note the ends of all that is left behind with the child.

        Those who listen are looked up now: a dead frame has none.
        """
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
        """Cut off what is left behind from userdata, events and later runs; then go on without.

        The thread that is left behind keeps dead frames: it can neither go on to another state,
        nor write userdata, nor end a later run, nor publish events.
        """
        frame = self._frame
        first: Any = frame.first
        chain = _up_to(frame, first)
        try:
            for each in chain:
                each.dead = True
                each.subscribers = None
            for each in chain:
                if each.step is not None:
                    each.step.cut_off()
                    each.step.state._preempt_requested = False
                data = each.data
                data.plan = data.plain_plan = None
                if data.callback is each:
                    data.callback = None
                if data.frame is each:
                    data.frame = None
                    each.container._preempt_requested = False
                    for ended in tuple(data.end_waiters):
                        ended.set()
        finally:
            frame.dead = True
            first.abandon()

    def _clear(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
            self._timer_number += 1
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
        over = partial(self._overdue, event, self._timer_number)
        self._timer = self._frame.run.clock.call_later(seconds, over)

    def _overdue(self, event: Event, number: int) -> None:
        with self._frame.run.lock:
            if not self._is_on() or number != self._timer_number:  # one that was cancelled late
                return
            group = self._frame.waits_for() if event is Event.LEAVE else None
            if group is not None and group.running():
                group.when_ended = partial(self._overdue, event, number)
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


# -- who asks -----------------------------------------------------------------------------------
#
# A request is passed on to every active state in the thread that makes it, so what is said once
# holds for all of them.

REQUESTING: ContextVar[object] = ContextVar("smachpy_requesting", default=None)
"""The state whose `request_preempt` runs here: a second call from within changes nothing."""


class _Said(threading.local):
    """What was said in this thread; not in the context, which tasks would inherit."""

    origin: Origin | None = None


_said = _Said()


@contextlib.contextmanager
def asking(source: str, by: str = "", why: str = "") -> Iterator[None]:
    """Say who asks for the preempts that this thread requests inside the `with` block.

    Inside another such block it changes nothing: the outer one knows where the wish came from.
    """
    before = _said.origin
    if before is None:
        _said.origin = Origin(source, by, why)
    try:
        yield
    finally:
        _said.origin = before


@contextlib.contextmanager
def shutdown_asking(shutdown: Shutdown) -> Iterator[None]:
    """Say that the program's end asks, and the signal that requested it."""
    reason = shutdown.reason or ""
    with asking("signal" if reason.startswith("SIG") else "shutdown", reason):
        yield


def current_origin() -> Origin:
    """Return who asks in this thread: what was said, else what can be seen."""
    said = _said.origin
    if said is not None:
        return said
    first: Frame | None = THREAD.get()
    if first is not None and first.innermost is not None:
        return Origin("state", first.innermost.here())
    return Origin("program", threading.current_thread().name)


# -- asking --------------------------------------------------------------------------------------


def on_preempt(state: Child, callback: Callable[[], object]) -> Callable[[], None]:
    """Call `callback` on each request to `state`, at once if there is one.

    Returns:
        Forgets the callback.

    Threads: the callback runs in the requester's thread with the run's lock held, maybe in a signal
        handler: it must not wait, and is none of the user's (`PreemptNotice`).
    """
    callbacks = state._smachpy.preempt_callbacks
    callbacks.append(callback)
    if state._preempt_requested:
        callback()

    def forget() -> None:
        if callback in callbacks:
            callbacks.remove(callback)

    return forget


def wait_for_preempt(state: Child, clock: Clock, seconds: float | None) -> bool:
    """Wait at most `seconds` for a request to `state`; tell whether there is one.

    Blocks: that long; None waits for ever.
    """
    wake = clock.event()
    callbacks = state._smachpy.preempt_callbacks
    callbacks.append(wake.set)
    try:
        if not state._preempt_requested:
            wake.wait(seconds)
    finally:
        callbacks.remove(wake.set)
    return state._preempt_requested


def mark_preempt(state: Child) -> None:
    """Set the flag of `state` and call what waits for it.

    Raises:
        Exception: the first one that a callback raised, after all were called.
    """
    state._preempt_requested = True
    failure: Exception | None = None
    for callback in tuple(state._smachpy.preempt_callbacks):
        try:
            callback()
        except Exception as error:  # noqa: BLE001  raised below: the others are called too
            failure = failure or error
    if failure is not None:
        raise failure


def has_own_request(state: Child) -> bool:
    """Tell whether `request_preempt` is the user's."""
    try:
        function = getattr(state.request_preempt, "__func__", None)
    except Exception:  # noqa: BLE001  a property of the user's: reported where it is called
        return True
    return function is not type(state)._smachpy_request_preempt


def _request_of(state: Child) -> Any:
    """Return the function `request_preempt` of `state` to be named, without running a property."""
    found = inspect.getattr_static(state, "request_preempt")
    return getattr(found, "fget", None) or found


def ask(frame: Frame, step: Any = None, *, timeout: float | None = None) -> bool:
    """Ask what runs in `frame` to stop; with the run's lock held.

    Args:
        frame: Where the child runs.
        step: The child that is meant; None: whatever runs.
        timeout: The child's own timeout [s], if that is what asks.

    Returns:
        Whether it runs, or will.
    """
    before, meant = frame.visit, step or frame.step
    if meant is None:
        return False
    visit = before
    if visit is None or visit.step is not meant:
        visit = Visit(frame, meant)
    # First the mark, then the look; the frame's thread sets its step first and looks at the mark
    # then, so one of the two always sees the other.
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
    """Ask the child of `step` to stop, but not its container; tell whether it ran."""
    with frame.run.lock:
        asked = ask(frame, step)
        if asked and frame.visit is not None:
            frame.visit.override = override
    frame.run.flush_soon()
    return asked


def pass_on(container: Parent) -> None:
    """Ask a container, then what runs in it; with the run's lock held.

    Raises:
        Exception: what waits for a request to the container raised; all that runs was asked.
    """
    data = container._smachpy
    if data.is_passing_on:
        return  # a child that is told runs this container, or asks it: it is asked
    data.is_passing_on = True
    try:
        try:
            mark_preempt(container)  # first the mark, then the look: see `Container._run`
        finally:
            if data.frame is not None and (data.callback is None or data.frame.group is not None):
                group = data.frame.group  # a child that comes after a callback is not told
                for each in (data.frame,) if group is None else group.running():
                    ask(each)
            if data.callback is not None:
                ask(data.callback)
    finally:
        data.is_passing_on = False


def request(container: Parent, only: Frame | None = None) -> Run | None:
    """Ask a container and all that runs in it to stop; publish nothing yet.

    Args:
        container: The container; before a run it is marked, and the next run ends at once.
        only: Ask only if this frame's run is still on.

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
            frame = data.root or data.frame or data.callback  # it may have begun meanwhile
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
                _pass_on_reported(container, frame)
            else:  # it has just ended
                container._preempt_requested = True
        return frame.run


def _pass_on_reported(container: Parent, frame: Frame) -> None:
    try:
        pass_on(container)
    except Exception as error:  # noqa: BLE001  reported: all that runs was asked
        frame.note_failure(frame.path, _request_of(container), error)


def request_soon(container: Parent, only: Frame | None = None) -> None:
    """Ask as `request` does, but wait for no code of the user, listeners neither.

    A `request_preempt` of the container's own is called in a thread of its own.
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
    """Call the own `request_preempt` of a state that has been asked; its thread's whole work."""
    REQUESTING.set(state)
    try:
        state.request_preempt()
    except BaseException as error:  # a border: reported, and without effect on others
        if frame is None:
            raise
        frame.note_failure(path or frame.path, _request_of(state), error)
        frame.run.flush()


class PreemptNotice:
    """Calls a function of the user for requests to a state, in a thread where it holds up nobody.

    Threads: any, also in a signal handler.
    """

    def __init__(self, function: Callable[[], object]) -> None:
        self._function: Callable[[], object] | None = function
        self._frame: Frame | None = current_frame()
        self._path = current_path()
        self._clock = clock_of_run()
        self._busy = threading.Lock()
        self._asked = False  # no lock for it: a signal handler may interrupt whoever holds it

    def __call__(self) -> None:
        """Have the function called."""
        self._asked = True
        self._clock.spawn(self._work, name=f"on_preempt of {self._path or 'a state'}")

    def forget(self) -> None:
        """Call it no more."""
        self._function = None

    def _work(self) -> None:
        while self._asked and self._busy.acquire(blocking=False):  # else another thread sees it
            try:
                self._asked = False
                function = self._function
                if function is not None:
                    self._call(function)
            finally:
                self._busy.release()

    def _call(self, function: Callable[[], object]) -> None:
        frame = self._frame
        if frame is None:  # outside of any machine; the thread's border reports what it raises
            function()
            return
        try:
            function()
        except BaseException as error:  # noqa: BLE001  a border: reported, without effect on others
            frame.note_failure(self._path, function, error)
            frame.run.flush()


def note_serviced(state: Child) -> None:
    """Publish that `state`, which runs in this context, takes its request up."""
    first: Frame | None = THREAD.get()
    frame = None if first is None else first.innermost
    if frame is None:
        return
    visit = frame.visit
    if visit is not None and visit.step is frame.step and visit.step.state is state:
        visit.service()


def forget_visit(frame: Frame) -> None:
    """End a visit that nobody follows: it was asked just when it had ended, or its frame ends."""
    with frame.run.lock:
        visit = frame.visit
        if visit is None or frame.dead:
            return
        frame.visit = None
        visit.happen(Event.END)
    if visit.override_call is not None:
        visit.settle()


def leave(frame: Frame) -> None:
    """Forget the run of the container of `frame`; with it ends the preempt that belonged to it."""
    container, data, step = frame.container, frame.data, frame.step
    with frame.run.lock:
        if frame.dead:
            return
        if data.frame is None:
            container._preempt_requested = False
        if step is not None:  # what a child that raised asked itself
            step.state._preempt_requested = False
    if frame.visit is not None:
        forget_visit(frame)
    for ended in tuple(data.end_waiters):
        ended.set()


# -- its end -----------------------------------------------------------------------------------


def end_visit(frame: Frame, outcome: Any) -> Decision:
    """End the visit of what `frame` runs, which ended with `outcome`, and decide what comes now.

    Called when somebody may have asked it, or its container, to stop. The frame's `answered` says
    afterwards whether the container's own request was taken up.

    Raises:
        InvalidTransitionError: it has no such outcome.
        Interruption: its thread was left behind meanwhile.
    """
    step = frame.step
    state: Child = step.state
    with frame.run.lock:  # whoever passes a request on is done after this
        if frame.dead:
            raise Interruption
        visit = frame.visit
        if visit is not None and visit.step is not step:  # it was for the one before
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
        if decision.why is Why.ANSWERED:
            frame.container._preempt_requested = frame.answered = False
    if visit is not None and visit.override_call is not None:
        visit.settle()
    if decision.why is Why.UNKNOWN:
        raise unknown_outcome(step.path_in(frame), state._smachpy.outcomes, outcome) from None
    if decision.why is Why.FORCED and override is not None:
        frame.emit(OutcomeForced, override.outcome)
    return decision


def unknown_outcome(path: str, outcomes: Iterable[str], got: object) -> InvalidTransitionError:
    """Return the error for a child that returned none of its outcomes."""
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
    """Return the seconds that a child has after a request; None for as long as it likes."""
    rule, grace = state._smachpy_grace, state._smachpy.options.preempt_timeout
    if grace == "inherit" or rule is not None:
        inherited = inherited_grace(frame)
        grace = inherited if rule is None else rule(inherited)
    if grace == "inherit":
        return DEFAULT_GRACE_S
    return None if grace is None else float(grace)


def inherited_grace(frame: Frame | None) -> Any:
    """Return the `preempt_timeout` of the nearest container that has one, else "inherit"."""
    while frame is not None:
        grace = frame.data.options.preempt_timeout
        if grace != "inherit":
            return grace
        frame = frame.parent
    return "inherit"


def outcome_left(frame: Frame) -> str:
    """Return the outcome of the child that `frame` runs if it is left behind now."""
    visit = frame.visit
    late = visit is not None and visit.by_timeout
    outcome: str = frame.step.state._smachpy.options.timeout_outcome if late else "preempted"
    return outcome


def _up_to(frame: Frame, first: Frame) -> list[Frame]:
    """Return the frames that are left behind with `frame`: itself and those up to `first`."""
    chain = [frame]
    while chain[-1] is not first and chain[-1].parent is not None:
        chain.append(chain[-1].parent)
    return chain


def lines_of(ident: int) -> list[tuple[str, int, str]]:
    """Return where the thread `ident` is: file, line and function, the innermost last."""
    top = sys._current_frames().get(ident)
    lines = []
    while top is not None:
        lines.append((top.f_code.co_filename, top.f_lineno or 0, top.f_code.co_name))
        top = top.f_back
    return lines[::-1]


def text_of(lines: list[tuple[str, int, str]]) -> str:
    """Return these lines as a traceback prints them."""
    import traceback

    return "".join(traceback.format_list([traceback.FrameSummary(*line) for line in lines]))
