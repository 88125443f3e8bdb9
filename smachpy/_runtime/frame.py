"""Where we are: the chain of running containers, in a context variable.

A `Run` belongs to one execution of a root; every container below it has a `Frame`. The frames
know the path and the listeners, so that states need to know neither.
"""

from __future__ import annotations

import threading
from collections import deque
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, NamedTuple

from smachpy import log
from smachpy.events import CallbackFailed, PreemptServiced
from smachpy.util import has_shutdown_check

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock
    from smachpy.container import Container
    from smachpy.control import Control
    from smachpy.events import Event
    from smachpy.state import State
    from smachpy.tape import Tape


class Run:
    """One execution of a root container, shared by all frames below it.

    Attributes:
        clock: The clock of the run.
        watched: Somebody wants to see each transition.
        careful: Somebody wants more than to see them: a log, an operator, a shutdown check.
        logged: Transitions go to the log.
        has_shutdown_check: `set_shutdown_check` was called.
        control: The operator's control, once somebody asked for it.
        pending: Events that were noted while a lock was held, to be published without it.
    """

    __slots__ = (
        "careful",
        "clock",
        "control",
        "has_shutdown_check",
        "logged",
        "pending",
        "watched",
    )

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.logged = log.is_info_wanted()
        self.has_shutdown_check = has_shutdown_check()
        self.watched = self.careful = self.logged or self.has_shutdown_check
        self.control: Control | None = None
        self.pending: deque[tuple[Frame, Event]] = deque()

    def flush(self) -> None:
        """Publish the events that were noted; never with a lock held."""
        while self.pending:
            try:
                frame, event = self.pending.popleft()
            except IndexError:  # another thread took the last one
                return
            frame.publish(event)


class _Hearing:
    """Changes when somebody wants to hear, see or steer more or less than before."""

    now = object()


HEARING = _Hearing()


class Ears:
    """Who hears the events of a frame, as long as nobody comes or goes.

    Attributes:
        at: `HEARING.now` then.
        listeners: Those of the container, then those of the containers above.
        tapes: Likewise.
        tape: The only one that hears anything, if it is a tape.
    """

    __slots__ = ("at", "listeners", "tape", "tapes")

    def __init__(
        self, at: object, listeners: tuple[Callable[[Event], object], ...], tapes: tuple[Tape, ...]
    ) -> None:
        self.at = at
        self.listeners = listeners
        self.tapes = tapes
        self.tape = tapes[0] if len(tapes) == 1 and not listeners else None


class Override(NamedTuple):
    """What an operator wants instead of a child's own outcome: another one, or a jump."""

    outcome: str | None = None
    label: str | None = None


class Frame:
    """One running container, or one branch of a concurrence.

    Attributes:
        step: What runs now: anything with `label` and `state`; None between runs.
        told: The step whose state was asked to stop.
        asked: The root itself was asked to stop.
        called_off: It was asked by somebody else than its own timeout.
        answered: The container ends because a preempt was taken up.
        watch: What sees to it that the told step stops.
        override: What an operator wants instead of the told step's outcome.
        boundary: The task that can be left behind when a state below ignores its preempt.
        thread: Identifier of the thread it runs in.
        injected: An interruption is on its way to that thread.
        dead: The thread was left behind.
        ended: The child of a concurrence's branch has ended.
        timed_out: The told step was asked by nothing but its own timeout.
        serviced: The told step has said that it takes the preempt up.
    """

    # Entering a container is a hot path: what is rarely set stands here, not in __init__.
    container: Container
    parent: Frame | None
    run: Run
    boundary: Any
    thread: int
    step: Any
    told: Any = None
    watch: Any = None
    override: Override | None = None
    asked = False
    called_off = False
    answered = False
    injected = False
    dead = False
    ended = False
    timed_out = False
    serviced = False
    _ears: Ears | None = None
    _path: str | None = None

    def __init__(self, container: Container, parent: Frame) -> None:
        self.container = container
        self.parent = parent
        self.run = parent.run
        self.boundary = parent.boundary
        self.thread = parent.thread
        self.step = None
        self._above = parent.step  # what the parent runs while this frame lives: this container

    @property
    def path(self) -> str:
        """Path of the container."""
        path = self._path
        if path is None:
            parent = self.parent
            assert parent is not None
            above = self._above
            path = self._path = parent.path if above is None else f"{parent.path}/{above.label}"
        return path

    def here(self) -> str:
        """Return the path of the state that runs now."""
        step = self.step
        return self.path if step is None else f"{self.path}/{step.label}"

    def publish(self, event: Event) -> None:
        """Give `event` to the listeners of this container and of all above it.

        A listener that raises is reported to the others and to the log; it hurts nobody.
        """
        ears = self._ears
        if ears is None or ears.at is not HEARING.now:
            ears = self.find_ears()
        if ears.tapes:
            for tape in ears.tapes:
                tape.take(event)
        for listener in ears.listeners:
            try:
                listener(event)
            except Exception as error:  # noqa: BLE001  a border: reported below
                self._listener_failed(listener, error, event)

    def find_ears(self) -> Ears:
        """Return who hears the events of this frame now."""
        at = HEARING.now
        if self.dead:
            self._ears = Ears(at, (), ())
            return self._ears
        container, parent = self.container, self.parent
        above = None
        if parent is not None:
            above = parent._ears  # noqa: SLF001  one class
            if above is None or above.at is not at:
                above = parent.find_ears()
        own, tapes = container._listeners, container._tapes  # noqa: SLF001  one machinery
        for tape in tapes:
            tape.begin(self.path, self.run.clock)
        if above is None:
            above = Ears(at, own, tapes)
        elif own or tapes:
            above = Ears(at, own + above.listeners, tapes + above.tapes)
        self._ears = above
        return above

    def emit(self, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish an event about the state that runs now."""
        run = self.run
        if run.watched:
            if run.pending:
                run.flush()
            clock = run.clock
            self.publish(kind(self.here(), clock.now(), clock.time_ns(), *fields))

    def emit_own(self, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish an event about the container itself."""
        run = self.run
        if run.watched:
            if run.pending:
                run.flush()
            clock = run.clock
            self.publish(kind(self.path, clock.now(), clock.time_ns(), *fields))

    def note(self, path: str, kind: Callable[..., Event], *fields: Any) -> None:
        """Note an event while a lock is held; the next `Run.flush` or event publishes it."""
        run = self.run
        if run.watched:
            clock = run.clock
            run.pending.append((self, kind(path, clock.now(), clock.time_ns(), *fields)))

    def callback_failed(self, callback: object, error: BaseException) -> None:
        """Report a raising callback: to the log and to the listeners."""
        name = getattr(callback, "__qualname__", None) or repr(callback)
        text = f"{type(error).__name__}: {error}"
        log.log_exception(f"{self.path}: callback {name} raised {text}", error)
        self.emit_own(CallbackFailed, name, text)

    def _listener_failed(self, listener: object, error: BaseException, event: Event) -> None:
        name = getattr(listener, "__qualname__", None) or repr(listener)
        log.log_exception(f"{self.path}: listener {name} raised {error!r} on {event!r}", error)


class RootFrame(Frame):
    """The frame of a root; its path begins all others."""

    path = ""

    def __init__(self, container: Container, run: Run, boundary: Any) -> None:
        self.container = container
        self.parent = None
        self.run = run
        self.boundary = boundary
        self.thread = threading.get_ident()
        self.step = None
        self.path = self._path = f"/{container.name or 'SM_ROOT'}"


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


FRAME: ContextVar[Frame | None] = ContextVar("smachpy_frame", default=None)


def current_scope() -> Scope | None:
    """Return the scope of the state that runs in this context; None outside any machine."""
    frame = FRAME.get()
    return None if frame is None else Scope(frame)


def note_serviced(state: State) -> None:
    """Publish that `state`, which runs in this context, takes its preempt up."""
    frame = FRAME.get()
    if frame is None or not frame.run.watched or frame.serviced:
        return
    told = frame.told
    if told is not None and told is frame.step and told.state is state:
        frame.serviced = True
        frame.emit(PreemptServiced)


def current_path() -> str:
    """Return the path of the state that runs in this context, or ""."""
    frame = FRAME.get()
    return "" if frame is None else frame.here()


def current_state() -> State | None:
    """Return the state that runs in this context."""
    frame = FRAME.get()
    return None if frame is None or frame.step is None else frame.step.state
