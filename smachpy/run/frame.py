"""The chain of running containers: which state runs in this context, in which run.

One `Run` belongs to one execution of a root; every running container in it has a `Frame`. Frames
know the path and the subscribers, so that states need neither.
"""

from __future__ import annotations

import threading
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from actionlib_core.clock import current_clock
from actionlib_core.clock._serial import report_thread_exception
from smachpy import log
from smachpy.context import current_frame
from smachpy.events import CallbackFailed, Preempted
from smachpy.exceptions import error_text
from smachpy.machines.problems import name_of
from smachpy.run.child import EPOCH

if TYPE_CHECKING:
    from collections import deque
    from collections.abc import Callable, Mapping, Sequence

    from actionlib_core.clock import Clock
    from smachpy.events import Event
    from smachpy.events.buffer import EventBuffer
    from smachpy.run.child import Child, ContainerData, Parent
    from smachpy.run.grace import Visit


class Gate(Protocol):
    """The part of an operator's control that a run uses: `smachpy.events.control.Control`."""

    def attach(self, run: Run) -> None:
        """Control a new run."""

    def pass_gate(self, frame: Frame, step: Any) -> None:
        """Block before `step` while the machine is paused."""

    def release(self, path: str) -> None:
        """Wake the state at `path`, which may wait at the gate, to see that it is called off."""

    def note_outcome(self, frame: Frame, step: Any, outcome: object) -> None:
        """Pause after `step` if there is a breakpoint on this outcome of it."""


class RunJournal(Protocol):
    """The part of a journal that a durable run uses: `smachpy.durable.recorder`.

    Each action of a visit is written before it is done or published. A run that is resumed in
    another process is entered again down to the states that were active; on the way the journal
    says where its containers and states were.

    Attributes:
        run: The run's name in recordings and viewers.
    """

    run: str

    def attach(self, root: Frame) -> None:
        """Record the run that begins in `root`, or resume it."""

    def recovered(self) -> tuple[Any, ...] | None:
        """Return the fields of the event `Recovered` for a resumed run; None for a new one."""

    def finish(self, outcome: str) -> None:
        """Write that the run ends."""

    def enter(self, frame: Frame, step: Any) -> str | None:
        """Write that `step` begins; return its outcome if it had ended before the resume."""

    def execute(self, frame: Frame, step: Any, userdata: Any) -> Any:
        """Execute `step`, or its option `resume` instead; return the outcome."""

    def leave(self, frame: Frame, step: Any, outcome: Any) -> None:
        """Write that `step` has ended."""

    def resumes(self, frame: Frame) -> bool:
        """Return whether children of the container of `frame` had begun before the resume."""

    def resumed_label(self, frame: Frame) -> str | None:
        """Return the child in which the state machine of `frame` resumes; None if it starts."""

    def item(self, frame: Frame, number: int) -> int:
        """Compare an item of the iterator of `frame` with the position before the resume.

        Returns:
            < 0: the item was done. 0: it was the current one, and is in the userdata. > 0: it is
            new.
        """

    def check_items(self, frame: Frame, count: int) -> None:
        """Check that there are at least as many items as before the resume."""

    def fired(
        self,
        frame: Frame,
        transitions: Sequence[str],
        marking: Sequence[str],
        ends: Sequence[str],
        begins: Sequence[str],
    ) -> None:
        """Write that transitions of the plan of `frame` have fired.

        Args:
            frame: The frame of the plan.
            transitions: Their ids.
            marking: The ids of the places that hold tokens now.
            ends: The labels of actions that must stop if they run.
            begins: The labels of actions that begin.
        """

    def note_conditions(self, frame: Frame) -> None:
        """Write the values of the conditions of the plan of `frame`, if they have changed."""

    def resumed_plan(self, frame: Frame) -> tuple[Sequence[str], Mapping[str, Any]] | None:
        """Return where the plan of `frame` resumes; None if it starts.

        Returns:
            The ids of the places that hold tokens, and label -> visit of each action that runs or
            has ended, with the fields: outcome (None while it runs); begun_ns [ns since the epoch];
            stopping (a transition has asked it to stop); again (it starts again after that).
        """

    def began_inside(self, frame: Frame) -> bool:
        """Return whether `frame` runs a container whose children had begun before the resume."""

    def attempt(self, frame: Frame) -> tuple[int, float]:
        """Return the number of the first attempt, and the rest of the pause before it [s]."""

    def time_left(self, frame: Frame, seconds: float) -> float:
        """Return the rest of a timeout that began with the attempt [s]."""

    def goes_on(self, frame: Frame) -> bool:
        """Return whether the child of `frame` had children that began, or a goal, to resume."""

    def retried(self, frame: Frame, attempt: int, wait: float, reason: str) -> None:
        """Write that attempt number `attempt` has ended, and the next begins in `wait` [s]."""

    def asked(self, frame: Frame, origin: tuple[str, str, str]) -> bool:
        """Write that the container of `frame` was asked to stop.

        Returns:
            Whether the journal will pass the request on itself, once all states that were active
            have been entered again: a state that is not entered yet could not cancel its goal.
        """

    def asked_one(self, frame: Frame, step: Any, override: Any) -> None:
        """Write that an operator asked the child of `step` to stop, with the override.

        A resumed run asks it again.
        """

    def check_value(self, frame: Frame, path: str, key: str, value: Any) -> None:
        """Raise if the state at `path` writes a `value` that the journal cannot keep."""

    def decide(self, frame: Frame, userdata: Any) -> Any:
        """Return the outcome that `resume` gives the child of `frame`; None to execute it."""

    def goal_of(self, frame: Frame) -> dict[str, Any] | None:
        """Return the goal that the state had sent before the resume, or None.

        Its fields: id, action, taken_ns (when a server accepted it [ns since the epoch]), and, if
        it had ended, status, text, result and preempted (the state had been asked to stop);
        stopped: the end of the process had cancelled it.
        """

    def goal_sent(self, frame: Frame, action: str, goal_id: str) -> None:
        """Write that a goal is about to be sent."""

    def goal_taken(self, frame: Frame, goal_id: str) -> None:
        """Write that a server has the goal."""

    def goal_done(
        self, frame: Frame, goal_id: str, status: str, text: str, result: Any, *, preempted: bool
    ) -> None:
        """Write how the goal ended, and whether its state had been asked to stop."""

    def once(self, frame: Frame, key: str, call: Callable[[], Any]) -> Any:
        """Return the result of `call` for `key` in this visit; call it only the first time."""


class Group(Protocol):
    """The running children of a concurrence: `smachpy.run.threads.Group`."""

    started: bool
    when_ended: Callable[[], object] | None

    def running(self) -> Sequence[Frame]:
        """Return the branches that have not ended."""


class Run:
    """One execution of a root container, shared by all frames below it.

    The top frame of a machine (`smachpy.run.threads.Root`) is its run at the same time: making a
    second object would take almost as long as running a small machine.

    Attributes:
        clock: The clock of the run.
        watched: Events have a subscriber, or `careful` holds.
        careful: Each transition needs more than events: a log, control, journal or shutdown check.
        logged: Transitions go to the log.
        has_shutdown_check: `set_shutdown_check` was called.
        control: The operator's control, once it was used.
        journal: The journal of a durable run, or None.
        lock: Held while a request to stop is passed on, and while a child is ended. One for all
            frames, so that requests that begin at different containers cannot deadlock. Re-entrant,
            because passing a request on may come back to it, and a signal handler may interrupt
            the thread that holds it.
        pending: Functions to call in order once the lock is released: they publish events and write
            to the log.
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
        """Publish the pending events and log texts; never call it with a lock held.

        Blocks: as long as the listeners do.
        """
        while self.pending:
            try:
                publish = self.pending.popleft()
            except IndexError:  # another thread took the last one
                return
            publish()

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


def _log_error(text: str) -> None:
    try:
        log.logerr(text)
    except Exception:  # noqa: BLE001  the program's own logger; this thread must go on
        report_thread_exception()


class Subscribers:
    """The subscribers of a frame.

    Attributes:
        epoch: The `EPOCH.value` for which they are valid.
        listeners: Those of the container, then those of the containers above.
        buffers: The same for event buffers.
        buffer: The only subscriber, if that is a buffer, else None.
    """

    __slots__ = ("buffer", "buffers", "epoch", "listeners")

    def __init__(
        self,
        epoch: object,
        listeners: tuple[Callable[[Event], object], ...],
        buffers: tuple[EventBuffer, ...],
    ) -> None:
        self.epoch = epoch
        self.listeners = listeners
        self.buffers = buffers
        self.buffer = buffers[0] if len(buffers) == 1 and not listeners else None


class Frame:
    """One running container, or a thread in which one child runs (`smachpy.run.threads.Branch`).

    Attributes:
        container: The container.
        data: Its `_smachpy`; reading it from there takes several times as long.
        parent: The frame of the container above; None for the top, in which the root runs.
        run: The run that all frames of this execution share.
        step: The child that runs now: anything with `label` and `state`; None between runs.
        visit: The visit of that child. A container's own frame has none until the child is asked to
            stop; a `Branch` has one from the start.
        group: The children of a concurrence, while they run.
        answered: The container ends because a request to stop was serviced.
        dead: The thread was left behind.
        above: The parent's step that runs this container.
        first: The first frame of this thread.
        innermost: Only in the first frame of a thread: the innermost frame that runs there.
        thread: Only in the first frame of a thread: the thread's identifier.
        can_be_left: Only in the first frame of a thread: the thread can be left behind.
        ended: The child of a `Branch` has ended, and was reported.
    """

    # Entering a container is a hot path. Attributes that are rarely set are class attributes, and
    # there is no __init__, which would take as long as everything else: the code that enters a
    # container (`Container.execute`, the loop of StateMachine) sets the rest.
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
        step, callback = self.step, self.data.callback
        if step is None or callback is None or callback.parent is not self:
            return step is not None
        # During a callback, `step` is the child that starts after it, except in a hook of the root.
        return step.state is self.container

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

    def publish(self, event: Event) -> None:
        """Give `event` to the listeners of this container and of all above it.

        A listener that raises is reported in the log; the others still get the event.
        """
        subscribers = self.subscribers
        if subscribers is None or subscribers.epoch is not EPOCH.value:
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
            except Exception as error:  # noqa: BLE001  the user's listener: reported in the log
                where = f"{self.path or self.here()}: listener {name_of(listener)}"
                on = type(event).__name__
                log.log_exception(f"{where} raised {error_text(error)} on {on}", error)

    def find_subscribers(self) -> Subscribers:
        """Look up the subscribers of this frame, and keep them until somebody comes or goes."""
        epoch = EPOCH.value  # read first: a change during the look-up counts as newer
        if self.dead:  # a thread that was left behind must not publish
            self.subscribers = Subscribers(epoch, (), ())
            return self.subscribers
        container, parent = self.container, self.parent
        above = None
        if parent is not None:
            above = parent.subscribers
            if above is None or above.epoch is not epoch:
                above = parent.find_subscribers()
        data = self.data
        # The top frame has the root as its container too, so the root's own are taken once.
        if above is None or parent is None or parent.container is not container:
            for buffer in data.buffers:
                buffer.begin(self.here() if parent is None else self.path, self.run.clock)
            if above is None:
                above = Subscribers(epoch, data.listeners, data.buffers)
            elif data.listeners or data.buffers:
                listeners = data.listeners + above.listeners
                above = Subscribers(epoch, listeners, data.buffers + above.buffers)
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
