"""The chain of running containers: which state runs in this context, in which run.

One `Run` belongs to one execution of a root; every running container in it has a `Frame`. Frames
know the path and the subscribers, so that states need neither.
"""

from __future__ import annotations

import threading
from collections import deque
from functools import partial
from logging import INFO
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from actionlib_core.clock import current_clock
from actionlib_core.clock._serial import report_thread_exception
from smachpy.base import log
from smachpy.base.context import current_frame
from smachpy.base.functions import name_of
from smachpy.base.log import MESSAGES
from smachpy.engine.described import EPOCH
from smachpy.engine.interrupt import Interruption
from smachpy.engine.shutdown_check import SHUTDOWN_CHECK
from smachpy.events import CallbackFailed, Preempted
from smachpy.exceptions import error_text

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.clock import Clock
    from actionlib_core.clock import Event as ClockEvent
    from smachpy.engine.described import Child, Parent
    from smachpy.engine.journal import RunJournal
    from smachpy.engine.preempt import Visit
    from smachpy.events import Event


LISTENER_S = 1.0  # longest wait for a listener that another thread calls


class Gate(Protocol):
    """The part of an operator's control that a run uses: `smachpy.engine.control.Control`."""

    def attach(self, run: Run) -> None:
        """Control a new run."""

    def detach(self, run: Run) -> None:
        """End the pause of a run that has ended."""

    def stop(self, run: Run) -> None:
        """End the pause, as the root is asked to stop; with the run's lock held."""

    def is_paused(self) -> bool:
        """Return whether the machine is paused."""

    def pass_gate(self, frame: Frame, step: Any) -> None:
        """Block before `step` while the machine is paused."""

    def release(self, path: str) -> None:
        """Wake the state at `path` if it waits at the gate: it must no longer begin."""

    def note_outcome(self, frame: Frame, step: Any, outcome: object) -> None:
        """Pause after `step` if there is a breakpoint on this outcome of it."""


class Group(Protocol):
    """The running children of a concurrence: `smachpy.engine.threads.Group`."""

    started: bool
    when_ended: Callable[[], object] | None

    def running(self) -> Sequence[Frame]:
        """Return the branches that have not ended."""


class Run:
    """One execution of a root container, shared by all frames below it.

    Attributes:
        clock: The clock of the run.
        watched: Events have a subscriber, or `careful` holds.
        careful: Each transition needs more than events: a log, control, journal or shutdown check.
        logged: Transitions go to the log.
        has_shutdown_check: `set_shutdown_check` was called.
        control: The operator's control, once it was used.
        journal: The journal of a durable run, or one that keeps nothing.
        lock: Held for every decision about a request to stop, and for the begin and end of each
            visit; never while code of the user, listeners or the log run. One for all frames, so
            that requests that begin at different containers cannot deadlock. Re-entrant, because
            passing a request on may come back to it.
        pending: Functions to call in order once the lock is released: they publish events and write
            to the log.
    """

    _publisher = 0  # the thread that publishes a pending item now
    _published: ClockEvent | None = None  # set when it has done so

    def __init__(self, journal: RunJournal) -> None:
        self.clock: Clock = current_clock()
        self.has_shutdown_check = SHUTDOWN_CHECK.is_own
        self.logged = MESSAGES.are_own or MESSAGES.logger.isEnabledFor(INFO)
        self.watched = self.careful = self.logged or self.has_shutdown_check
        self.control: Gate | None = None
        self.journal = journal
        self.lock = threading.RLock()
        self.pending: deque[Callable[[], object]] = deque()

    def flush(self, *, wait: bool = True) -> None:
        """Publish the pending events and log texts in their order; never call it with a lock held.

        One thread publishes at a time. While it does, its place in `pending` is kept, so that
        whoever publishes next sees that something is before it.

        Args:
            wait: If another thread is publishing, wait until it has done so: what follows comes
                later. False leaves the rest to that thread.

        Blocks: as long as the listeners do; for another thread's listeners 1 s.
        """
        me = threading.get_ident()
        while self.pending:
            with self.lock:
                before = self._publisher
                if before in {0, me}:
                    # By number: others append meanwhile, without the lock.
                    numbers = range(len(self.pending))
                    place = next((n for n in numbers if self.pending[n] is not _taken), None)
                    if place is None:  # this thread is in a listener, or was interrupted in one
                        return
                    publish, self.pending[place] = self.pending[place], _taken
                    self._publisher = me
                elif self._published is None:
                    self._published = self.clock.event("events that are published")
                published = self._published
            if before not in {0, me}:
                if not wait:
                    return
                assert published is not None
                if not published.wait(LISTENER_S):
                    self._end_publishing(0, before)  # a listener blocks: go on without it
                continue
            try:
                publish()
            finally:
                self._end_publishing(before, me)

    def _end_publishing(self, before: int, by: int) -> None:
        """Note that the thread `by` publishes no more, or as `before` in the listener around it."""
        with self.lock:
            if _taken in self.pending:
                self.pending.remove(_taken)
            if self._publisher == by:
                self._publisher = before
            published = None if before else self._published
            if published is not None:
                self._published = None
        if published is not None:
            published.set()

    def is_publishing(self) -> bool:
        """Return whether this thread is in a listener that `flush` has called."""
        return self._publisher == threading.get_ident()

    def flush_soon(self) -> None:
        """Flush in a new thread, so that no timer waits for a listener or a logger."""
        if not self.pending:
            return
        try:
            self.clock.spawn(self.flush, name="events")
        except RuntimeError:  # no thread can be started: the next event of the run flushes
            return

    def note_log(self, text: str) -> None:
        """Queue an error for the log."""
        self.pending.append(partial(_log_error, text))


def _taken() -> None:
    """Stand in `pending` for an item that is being published."""


def _log_error(text: str) -> None:
    try:
        log.logerr(text)
    except Exception:  # noqa: BLE001  the program's own logger; this thread must go on
        report_thread_exception()


class Subscribers(NamedTuple):
    """The subscribers of a frame.

    Attributes:
        epoch: The `EPOCH.value` for which they are valid.
        buffers: Those of the container, then those of the containers above: their `take`.
        listeners: The same for listeners.
        all: Both, buffers first, as they block nobody.
    """

    epoch: object
    buffers: tuple[Callable[[Event], object], ...]
    listeners: tuple[Callable[[Event], object], ...]
    all: tuple[Callable[[Event], object], ...]


class Frame:
    """One running container, or a thread in which one child runs (`smachpy.engine.threads.Branch`).

    Attributes:
        container: The container.
        data: Its `_smachpy`; reading it from there takes several times as long.
        live: The same of its `live`.
        parent: The frame of the container above; None for the top, in which the root runs.
        run: The run that all frames of this execution share.
        step: The child that runs now: anything with `label` and `state`; None between runs.
        visit: The visit of that child; None between two children.
        group: The children of a concurrence, while they run.
        answered: The container ends because a request to stop was serviced.
        dead: The thread was left behind.
        above: The parent's step that runs this container.
        timeout: The timeout of the child, if that is a container and has one.
        first: The first frame of this thread.
        innermost: Only in the first frame of a thread: the innermost frame that runs there.
        thread: Only in the first frame of a thread: the thread's identifier.
        can_be_left: Only in the first frame of a thread: the thread can be left behind.
        ended: The child of a `Branch` has ended, and was reported.
        is_branch: It runs one of several children; what they raise is raised together.
        tidying: The container's clean-up while that runs.
        goes_on: The container goes on where its last run was interrupted; as `Live.goes_on`.
        stopped_at: The child that was to run, or to go on, when the container was asked to stop.
    """

    innermost: Frame | None
    ended = False
    is_branch = False
    thread = 0
    can_be_left = False
    subscribers: Subscribers | None = None
    _path: str | None = None
    timeout: Any = None  # a smachpy.engine.step.Timeout, which imports this module
    goes_on = ""
    stopped_at = ""
    tidying: Any = None  # a smachpy.engine.cleanup.Tidying, which imports this module

    def __init__(
        self, container: Parent, parent: Frame | None, run: Run, first: Frame | None = None
    ) -> None:
        self.container = container
        self.data = data = container._smachpy
        self.live = data.live
        self.parent = parent
        self.above: Any = None if parent is None else parent.step
        self.run = run
        # Of every transition: an attribute of the instance is found faster than one of the class.
        self.step: Any = None
        self.visit: Visit | None = None
        self.group: Group | None = None
        self.answered = self.dead = False
        if first is not None:  # else the frame begins a thread
            self.first = first

    @property
    def path(self) -> str:
        """Path of the container."""
        path = self._path
        if path is None:  # built only when somebody wants to know it
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
        """Return the name of what runs now, for the log."""
        return self.here()

    def is_in_child(self) -> bool:
        """Return whether a child runs here; a callback of the container itself is none."""
        step, callback = self.step, self.live.callback
        if step is None or callback is None or callback.parent is not self:
            return step is not None
        # During a callback, `step` is the child that starts after it, except in a hook of the root.
        return step.state is self.container

    def is_in_cleanup(self) -> bool:
        """Return whether this is inside the clean-up of a container."""
        frame: Frame | None = self
        while frame is not None and frame.tidying is None:
            frame = frame.parent
        return frame is not None

    def waits_for(self) -> Group | None:
        """Return the branches that must end before this frame's child is left behind, if any."""
        return None

    def running(self) -> Sequence[Frame]:
        """Return the frames that run a child each: this one, or those of a concurrence."""
        return [self] if self.group is None else self.group.running()

    def begin_thread(self) -> None:
        """Make this the first frame of the current thread."""
        self.first = self.innermost = self
        self.thread = threading.get_ident()

    def end_thread(self) -> None:
        """Break the reference cycles of this frame: its run is freed without the collector."""
        self.innermost = None
        del self.first

    # -- events --------------------------------------------------------------------------------

    def publish(self, event: Event, subscribers: Subscribers | None = None) -> None:
        """Give `event` to the listeners of this container and of all above it.

        A listener that raises is reported in the log, and an interruption ends only the listener
        in which it comes; the others still get the event.

        Args:
            event: The event.
            subscribers: Those who get it; None: those of now.

        Raises:
            Interruption: it came in a listener.
        """
        if subscribers is None:
            subscribers = self.subscribers
            if subscribers is None or subscribers.epoch is not EPOCH.value:
                subscribers = self.find_subscribers()
        listeners = subscribers.all
        called = 0
        try:
            for listener in listeners:
                called += 1
                try:
                    listener(event)
                except Exception as error:  # noqa: BLE001  the user's: reported in the log
                    where = f"{self.path or self.here()}: listener {name_of(listener)}"
                    on = type(event).__name__
                    log.log_exception(f"{where} raised {error_text(error)} on {on}", error)
        except Interruption:
            if not self.dead:
                self.publish(event, subscribers._replace(all=listeners[called:]))
            raise

    def find_subscribers(self) -> Subscribers:
        """Look up the subscribers of this frame, and keep them until somebody comes or goes."""
        epoch = EPOCH.value  # read first: a change during the look-up counts as newer
        if self.dead:  # a thread that was left behind must not publish
            self.subscribers = Subscribers(epoch, (), (), ())
            return self.subscribers
        container, parent = self.container, self.parent
        above = None
        if parent is not None:
            above = parent.subscribers
            if above is None or above.epoch is not epoch:
                above = parent.find_subscribers()
        live = self.live
        # The top frame has the root as its container too, so the root's own are taken once.
        if above is None or parent is None or parent.container is not container:
            for buffer in live.buffers:
                buffer.begin(self.here() if parent is None else self.path, self.run.clock)
            buffers = (*(one.take for one in live.buffers), *(above.buffers if above else ()))
            listeners = (*live.listeners, *(above.listeners if above else ()))
            above = Subscribers(epoch, buffers, listeners, buffers + listeners)
        self.subscribers = above
        return above

    def emit(self, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish an event about the state that runs now."""
        if self.run.watched:
            self.emit_at(self.here(), kind, *fields)

    def emit_own(self, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish an event about the container itself."""
        if self.run.watched:
            self.emit_at(self.path, kind, *fields)

    def emit_at(self, path: str, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish an event about the state at `path`; the run is watched."""
        run = self.run
        if run.pending:  # keeps the order of the events
            run.flush()
        clock = run.clock
        self.publish(kind(path, clock.now(), clock.time_ns(), *fields))

    def end_preempted(self, label: str = "") -> str:
        """Note that the container ends because of a preempt, and return that outcome.

        Args:
            label: The child that was not started, or whose outcome is not followed; "" for none.
        """
        self.answered = True
        self.emit_own(Preempted, label)
        return "preempted"

    def note(self, path: str, kind: Callable[..., Event], *fields: Any) -> None:
        """Queue an event while the lock is held; the next `Run.flush` or event publishes it."""
        run = self.run
        if run.watched:
            clock = run.clock
            event = kind(path, clock.now(), clock.time_ns(), *fields)
            run.pending.append(partial(self.publish, event))

    def note_failure(self, path: str, callback: object, error: BaseException) -> None:
        """Queue, for the listeners and the log, that a callback of the state at `path` raised."""
        name = name_of(callback)
        text = error_text(error)
        self.note(path, CallbackFailed, name, text)
        self.run.note_log(f"{path}: {name} raised {text}")

    def callback_failed(self, callback: object, error: BaseException) -> None:
        """Report to the log and the listeners that a callback of the container raised."""
        name = name_of(callback)
        text = error_text(error)
        log.log_exception(f"{self.path}: callback {name} raised {text}", error)
        self.emit_own(CallbackFailed, name, text)


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
        """Whether the events of the run have a subscriber."""
        return self._frame.run.watched

    def emit(self, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish the event `kind(path, t, stamp_ns, *fields)` if the run has a subscriber.

        Threads: any.
        """
        if self._frame.run.watched:
            self._frame.emit_at(self.path, kind, *fields)


def current_scope() -> Scope | None:
    """Return the scope of the state that runs in this context; None outside of any machine."""
    frame = current_frame()
    return None if frame is None else Scope(frame)


def clock_of_run() -> Clock:
    """Return the clock of the run in this context; outside of a run, the current clock."""
    frame = current_frame()
    return current_clock() if frame is None else frame.run.clock


def current_state() -> Child | None:
    """Return the state that runs in this thread or task; None outside of any state."""
    frame = current_frame()
    return None if frame is None or frame.step is None else frame.step.state
