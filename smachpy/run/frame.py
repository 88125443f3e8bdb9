"""Where we are: the chain of running containers, in a context variable.

A `Run` belongs to one execution of a root; every container in it has a `Frame`. The frames
know the path and the listeners, so that states need to know neither.
"""

from __future__ import annotations

import threading
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from actionlib_core.clock import current_clock
from actionlib_core.clock._serial import report_thread_exception
from smachpy import log
from smachpy.context import current_frame
from smachpy.events import CallbackFailed
from smachpy.machines.names import name_of

if TYPE_CHECKING:
    from collections import deque
    from collections.abc import Callable, Mapping, Sequence

    from actionlib_core.clock import Clock
    from smachpy.events import Event
    from smachpy.events.buffer import EventBuffer
    from smachpy.run.child import Child, ContainerData, Parent
    from smachpy.run.grace import Visit


class Gate(Protocol):
    """What a run needs of an operator's control."""

    def attach(self, run: Run) -> None:
        """Control a new run."""

    def pass_gate(self, frame: Frame, step: Any) -> None:
        """Hold the machine before `step` while it is paused."""

    def release(self, path: str) -> None:
        """Let the state at `path` look again whether it is called off."""

    def note_outcome(self, frame: Frame, step: Any, outcome: object) -> None:
        """Pause after `step` if there is a breakpoint on this outcome of it."""


class RunJournal(Protocol):
    """What a run needs of its journal, if it has one: `smachpy.durable`.

    What a visit does is written before it is done or told. A run that goes on in another process
    is entered down to the states that were active; for the containers and states on the way the
    journal says where they were.

    Attributes:
        run: Names the run, in its recordings and to viewers.
    """

    run: str

    def attach(self, root: Frame) -> None:
        """Keep the run that begins in `root`, or go on with it."""

    def recovered(self) -> tuple[Any, ...] | None:
        """Return what the event `Recovered` tells, of a run that goes on; None: it begins."""
        ...

    def finish(self, outcome: str) -> None:
        """Write that the run ends."""

    def enter(self, frame: Frame, step: Any) -> str | None:
        """Write that `step` begins; return its outcome if it had ended before the resume."""

    def execute(self, frame: Frame, step: Any, userdata: Any) -> Any:
        """Execute `step`, or what its option `resume` says; return the outcome."""

    def leave(self, frame: Frame, step: Any, outcome: Any) -> None:
        """Write that `step` has ended."""

    def resumes(self, frame: Frame) -> bool:
        """Tell whether the container of `frame` goes on with children that had begun."""
        ...

    def resumed_label(self, frame: Frame) -> str | None:
        """Return the child with which the state machine of `frame` goes on; None: anew."""
        ...

    def item(self, frame: Frame, number: int) -> int:
        """Return where this item of the iterator of `frame` stands.

        Below 0: it was done before the resume. 0: it was the current one, which the userdata holds.
        Above 0: it is new.
        """
        ...

    def check_items(self, frame: Frame, count: int) -> None:
        """Check that there were not fewer items than before the resume."""

    def fired(
        self,
        frame: Frame,
        transitions: Sequence[str],
        marking: Sequence[str],
        ends: Sequence[str],
        begins: Sequence[str],
    ) -> None:
        """Write that transitions of the plan of `frame` have fired, by their ids.

        `marking` has the ids of the places that hold tokens now, `ends` the labels of the actions
        that have to stop, if they run, and `begins` of those that begin.
        """

    def note_conditions(self, frame: Frame) -> None:
        """Write what the conditions of the plan of `frame` are worth now, if that has changed."""

    def resumed_plan(self, frame: Frame) -> tuple[Sequence[str], Mapping[str, Any]] | None:
        """Return where the plan of `frame` goes on; None: it begins.

        Returns:
            The ids of the places that hold tokens, and label -> visit of each action that runs or
            has ended: outcome (None: runs), begun_ns [ns since the epoch]; stopping: it runs, a
            transition has let it stop; again: it begins anew after that.
        """
        ...

    def began_inside(self, frame: Frame) -> bool:
        """Tell whether what `frame` runs is a container whose children had begun."""
        ...

    def attempt(self, frame: Frame) -> tuple[int, float]:
        """Return the number of the first attempt, and what is left of the pause before it [s]."""
        ...

    def time_left(self, frame: Frame, seconds: float) -> float:
        """Return what is left of a timeout that began with the attempt [s]."""
        ...

    def goes_on(self, frame: Frame) -> bool:
        """Tell whether what `frame` runs has something to go on with: children, or a goal."""
        ...

    def retried(self, frame: Frame, attempt: int, wait: float, reason: str) -> None:
        """Write that attempt number `attempt` has ended, and the next begins in `wait` [s]."""

    def asked(self, frame: Frame, origin: tuple[str, str, str]) -> bool:
        """Write that somebody asked the container of `frame` to stop.

        Returns:
            Whether the journal asks it itself, once all that was active has been entered again:
            what is not entered could not stop its goal.
        """
        ...

    def asked_one(self, frame: Frame, step: Any, override: Any) -> None:
        """Write that an operator asked the child of `step` to stop, and what he wants instead.

        A run that goes on asks it again.
        """

    def check_value(self, frame: Frame, path: str, key: str, value: Any) -> None:
        """Raise if the state at `path` may not write `value`, as it cannot be kept."""

    def decide(self, frame: Frame, userdata: Any) -> Any:
        """Return the outcome that the option `resume` gives what `frame` runs; None: execute it."""

    def goal_of(self, frame: Frame) -> dict[str, Any] | None:
        """Return the goal that the state had sent before the resume, or None.

        Its id, action, taken_ns (when a server took it [ns since the epoch]), status, text,
        preempted and result (if it had ended; preempted: the state had been asked to stop), and
        stopped: the end of the process had cancelled it.
        """
        ...

    def goal_sent(self, frame: Frame, action: str, goal_id: str) -> None:
        """Write that a goal is about to be sent."""

    def goal_taken(self, frame: Frame, goal_id: str) -> None:
        """Write that a server has the goal."""

    def goal_done(
        self, frame: Frame, goal_id: str, status: str, text: str, result: Any, *, preempted: bool
    ) -> None:
        """Write how the goal ended, and whether its state had been asked to stop."""

    def once(self, frame: Frame, key: str, call: Callable[[], Any]) -> Any:
        """Return what `call` returned for `key` in this visit; call it if it has not."""


class Group(Protocol):
    """The children of a concurrence while they run."""

    started: bool
    when_ended: Callable[[], object] | None

    def running(self) -> Sequence[Frame]:
        """Return the branches that have not ended."""
        ...


class Run:
    """One execution of a root container, shared by all frames below it.

    It is what the top frame of a machine is besides (`smachpy.run.threads.Root`): one object, as a
    small machine takes little longer to run than that takes to make.

    Attributes:
        clock: The clock of the run.
        watched: Somebody wants to see each transition.
        careful: Somebody wants more than to see them: a log, an operator, a shutdown check. Then it
            is watched, too.
        logged: Transitions go to the log.
        has_shutdown_check: `set_shutdown_check` was called.
        control: The operator's control, once somebody asked for it.
        journal: Keeps the run, so that another process can go on with it; None: nobody does.
        lock: Held while a request to stop is passed on, and by whoever ends a child; one for all
            frames, so that requests that begin at different containers cannot wait for each other.
            Re-entrant, because a signal handler may come in between.
        pending: What is to be told once no lock is held, in order: events to listeners, texts to
            the log.
    """

    clock: Clock
    watched: bool
    careful: bool
    logged: bool
    has_shutdown_check: bool
    control: Gate | None
    journal: RunJournal | None
    lock: threading.RLock
    pending: deque[Callable[[], object]]

    def flush(self) -> None:
        """Tell what was noted; never with a lock held.

        Blocks: as long as the listeners do.
        """
        while self.pending:
            try:
                tell = self.pending.popleft()
            except IndexError:  # another thread took the last one
                return
            tell()

    def flush_soon(self) -> None:
        """Tell what was noted in a thread of its own: no timer waits for a listener or a log."""
        if not self.pending:
            return
        try:
            self.clock.spawn(self.flush, name="events")
        except RuntimeError:  # the system gives no thread: whoever publishes next tells it
            return

    def note_log(self, text: str) -> None:
        """Note an error for the log."""
        self.pending.append(partial(_log_error, text))


def _log_error(text: str) -> None:
    try:
        log.logerr(text)
    except Exception:  # noqa: BLE001  a border: the program's own logger
        report_thread_exception()


class _Subscriptions:
    """Changes when somebody wants to hear, see or steer more or less than before."""

    version = object()


SUBSCRIPTIONS = _Subscriptions()


class Subscribers:
    """Who hears the events of a frame, as long as nobody comes or goes.

    Attributes:
        version: `SUBSCRIPTIONS.version` then.
        listeners: Those of the container, then those of the containers above.
        buffers: Likewise.
        buffer: The only one that hears anything, if it is a buffer.
    """

    __slots__ = ("buffer", "buffers", "listeners", "version")

    def __init__(
        self,
        version: object,
        listeners: tuple[Callable[[Event], object], ...],
        buffers: tuple[EventBuffer, ...],
    ) -> None:
        self.version = version
        self.listeners = listeners
        self.buffers = buffers
        self.buffer = buffers[0] if len(buffers) == 1 and not listeners else None


class Frame:
    """One running container, or a thread in which one child runs (`smachpy.run.threads.Branch`).

    Attributes:
        container: The container.
        data: What the library knows of it; here Python finds it several times faster than there.
        parent: The frame around it; None for the top, in which the root runs.
        run: What all frames of this execution share.
        step: What runs now: anything with `label` and `state`; None between runs.
        visit: The visit of what runs; None while it just runs and nobody asks or watches.
        group: The children of a concurrence, while they run.
        answered: The container ends because a request to stop was taken up.
        dead: The thread was left behind.
        above: What the parent runs while this frame lives: this container.
        first: The frame with which its thread begins.
        innermost: Of the first frame of a thread: the innermost one that runs there.
        thread: Of the first frame of a thread: the thread's identifier.
        can_be_left: That thread is ours to leave behind.
        ended: The child of a `Branch` has ended, and was reported.
    """

    # Entering a container is a hot path: what is rarely set stands here, and there is no __init__,
    # which takes as long as all else that a frame needs: who enters one sets the rest.
    run: Run
    first: Frame
    innermost: Frame | None
    container: Parent
    data: ContainerData
    parent: Frame | None
    step: Any = None
    visit: Visit | None = None
    group: Group | None = None
    answered = False
    dead = False
    ended = False
    thread = 0
    can_be_left = False
    subscribers: Subscribers | None = None
    _path: str | None = None
    above: Any = None

    @property
    def path(self) -> str:
        """Path of the container."""
        path = self._path
        if path is None:
            parent = self.parent
            assert parent is not None
            above = self.above
            path = self._path = parent.path if above is None else f"{parent.path}/{above.label}"
        return path

    def here(self) -> str:
        """Return the path of the state that runs now."""
        step = self.step
        return self.path if step is None else f"{self.path}/{step.label}"

    def described(self) -> str:
        """Name what runs now, for the log."""
        return self.here()

    def is_in_child(self) -> bool:
        """Tell whether a child runs, or a callback of the child, which is a container."""
        step, callback = self.step, self.data.callback
        if step is None or callback is None or callback.parent is not self:
            return step is not None
        return step.state is self.container  # a hook of the root; else the child comes after it

    def waits_for(self) -> Group | None:
        """Return the branches that must end before what runs here is left behind; None: none."""
        return None

    def running(self) -> Sequence[Frame]:
        """Return the frames that run a child each: this one, or those of a concurrence."""
        return [self] if self.group is None else self.group.running()

    def begin_thread(self) -> None:
        """Let the thread that runs here begin with this frame."""
        self.first = self.innermost = self
        self.thread = threading.get_ident()

    def end_thread(self) -> None:
        """Refer to itself no more, so that no run waits for the garbage collector."""
        self.innermost = None
        del self.first

    # -- events --------------------------------------------------------------------------------

    def publish(self, event: Event) -> None:
        """Give `event` to the listeners of this container and of all above it.

        A listener that raises is reported to the others and to the log; it hurts nobody.
        """
        subscribers = self.subscribers
        if subscribers is None or subscribers.version is not SUBSCRIPTIONS.version:
            subscribers = self.find_subscribers()
        self.give(subscribers, event)

    def give(self, subscribers: Subscribers, event: Event) -> None:
        """Give `event` to `subscribers`."""
        if subscribers.buffers:
            for buffer in subscribers.buffers:
                buffer.take(event)
        for listener in subscribers.listeners:
            try:
                listener(event)
            except Exception as error:  # noqa: BLE001  a border: reported below
                self._listener_failed(listener, error, event)

    def find_subscribers(self) -> Subscribers:
        """Return who hears the events of this frame now."""
        version = SUBSCRIPTIONS.version
        if self.dead:
            self.subscribers = Subscribers(version, (), ())
            return self.subscribers
        container, parent = self.container, self.parent
        above = None
        if parent is not None:
            above = parent.subscribers
            if above is None or above.version is not version:
                above = parent.find_subscribers()
        data = self.data
        if above is None or parent is None or parent.container is not container:
            for buffer in data.buffers:
                buffer.begin(self.here() if parent is None else self.path, self.run.clock)
            if above is None:
                above = Subscribers(version, data.listeners, data.buffers)
            elif data.listeners or data.buffers:
                listeners = data.listeners + above.listeners
                above = Subscribers(version, listeners, data.buffers + above.buffers)
        self.subscribers = above
        return above

    def emit(self, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish an event about the state that runs now."""
        if self.run.watched:
            self._emit(self.here(), kind, fields)

    def emit_own(self, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish an event about the container itself."""
        if self.run.watched:
            self._emit(self.path, kind, fields)

    def _emit(self, path: str, kind: Callable[..., Event], fields: Any) -> None:
        run = self.run
        if run.pending:
            run.flush()
        clock = run.clock
        self.publish(kind(path, clock.now(), clock.time_ns(), *fields))

    def note(self, path: str, kind: Callable[..., Event], *fields: Any) -> None:
        """Note an event while a lock is held; the next `Run.flush` or event publishes it."""
        run = self.run
        if run.watched:
            clock = run.clock
            event = kind(path, clock.now(), clock.time_ns(), *fields)
            run.pending.append(partial(self.publish, event))

    def note_failure(self, path: str, callback: object, error: BaseException) -> None:
        """Note that a callback of the state at `path` raised."""
        name = name_of(callback)
        text = f"{type(error).__name__}: {error}"
        self.note(path, CallbackFailed, name, text)
        self.run.note_log(f"{path}: {name} raised {text}")

    def callback_failed(self, callback: object, error: BaseException) -> None:
        """Report a raising callback: to the log and to the listeners."""
        name = name_of(callback)
        text = f"{type(error).__name__}: {error}"
        log.log_exception(f"{self.path}: callback {name} raised {text}", error)
        self.emit_own(CallbackFailed, name, text)

    def _listener_failed(self, listener: object, error: BaseException, event: Event) -> None:
        name = name_of(listener)
        path = self.path or self.here()
        log.log_exception(f"{path}: listener {name} raised {error!r} on {event!r}", error)


class Scope:
    """A running state's handle on its run: to publish from any thread, also after callbacks.

    Attributes:
        path: Path of the state.
        clock: Clock of the run.
    """

    __slots__ = ("_frame", "clock", "path")

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self.path = frame.here()
        self.clock = frame.run.clock

    @property
    def is_watched(self) -> bool:
        """Somebody wants to hear of each transition."""
        return self._frame.run.watched

    def emit(self, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish the event `kind(path, t, stamp_ns, *fields)`, if anybody listens.

        Threads: any.
        """
        frame = self._frame
        if frame.run.watched:
            if frame.run.pending:
                frame.run.flush()
            clock = self.clock
            frame.publish(kind(self.path, clock.now(), clock.time_ns(), *fields))


def current_scope() -> Scope | None:
    """Return the scope of the state that runs in this context; None outside any machine."""
    frame = current_frame()
    return None if frame is None else Scope(frame)


def clock_of_run() -> Clock:
    """Return the clock of the run in this context, or outside of one that of the context."""
    frame = current_frame()
    return current_clock() if frame is None else frame.run.clock


def current_state() -> Child | None:
    """Return the state that runs in this context."""
    frame = current_frame()
    return None if frame is None or frame.step is None else frame.step.state
