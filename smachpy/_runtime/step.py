"""A container, compiled: one record per child with all that running it needs, looked up once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

from smachpy._runtime.frame import HEARING
from smachpy._runtime.guarded import runner_of
from smachpy._runtime.interrupt import Interruption
from smachpy._runtime.watch import note_answer
from smachpy.events import Entered, Failed, Left, UserdataWritten
from smachpy.user_data import Remapper

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from smachpy._runtime.frame import Frame
    from smachpy.state import State
    from smachpy.tape import Tape
    from smachpy.user_data import UserData


_new = tuple.__new__  # half the time of a NamedTuple's own


class End:
    """The container ends with this outcome."""

    __slots__ = ("outcome",)
    final: ClassVar[Literal[True]] = True

    def __init__(self, outcome: str) -> None:
        self.outcome = outcome


class Step:
    """One child, ready to run.

    Attributes:
        label: Its label.
        state: The child.
        execute: Runs it: its own `execute`, or that with its options around it.
        userdata: Its window into the container's userdata.
        next: Outcome -> what comes then.
        interface: The child's interface version that this was compiled from.
        writes: It may write userdata.
    """

    __slots__ = (
        "_base",
        "_path",
        "_window",
        "execute",
        "interface",
        "label",
        "next",
        "state",
        "userdata",
        "writes",
    )
    final: ClassVar[Literal[False]] = False

    def __init__(
        self, label: str, state: State, userdata: UserData, remapping: Mapping[str, str]
    ) -> None:
        self.label = label
        self.state = state
        self.interface = state._interface  # noqa: SLF001  one machinery
        self.writes = bool(state.get_registered_output_keys())
        self._base = self._path = ""
        self._window: _WatchedRemapper | None = None
        self.userdata = Remapper(
            userdata,
            state.get_registered_input_keys(),
            state.get_registered_output_keys(),
            remapping,
        )
        self.execute: Callable[[Any], Any] = runner_of(state)
        self.next: dict[str, Any] = {}

    def is_stale(self) -> bool:
        """Tell whether the child's interface has changed."""
        return self.interface != self.state._interface  # noqa: SLF001  one machinery

    def cut_off(self) -> None:
        """Let a thread that was left behind in this child get no further, and write nothing."""
        self.next = _Nowhere()
        self.userdata._revoke()  # noqa: SLF001  one machinery
        if self._window is not None:
            self._window._revoke()  # noqa: SLF001  one machinery

    def path_in(self, frame: Frame) -> str:
        """Return the child's path."""
        base = frame.path
        if base is not self._base:
            self._base = base
            self._path = f"{base}/{self.label}"
        return self._path

    def watched_userdata(self, frame: Frame) -> Remapper:
        """Return a window that reports each write."""
        window = self._window
        if window is None or window._scope_of[0] is not frame:  # noqa: SLF001  its own module
            window = self._window = _WatchedRemapper(self.userdata, frame, self.path_in(frame))
        return window


class _Nowhere(dict[str, Any]):
    """The transitions of a child that was left behind: every one ends its thread."""

    def __missing__(self, _key: object) -> Any:
        raise Interruption

    def __contains__(self, _key: object) -> bool:
        raise Interruption


Following: TypeAlias = Step | End


class _WatchedRemapper(Remapper):
    """A window that says who wrote what, when."""

    __slots__ = ("_scope_of",)
    _scope_of: tuple[Frame, str]

    def __init__(self, original: Remapper, frame: Frame, path: str) -> None:
        set_slot = object.__setattr__
        set_slot(self, "_data", original._data)  # noqa: SLF001  one class
        set_slot(self, "_input", original._input)  # noqa: SLF001  one class
        set_slot(self, "_output", original._output)  # noqa: SLF001  one class
        set_slot(self, "_scope_of", (frame, path))

    def __setitem__(self, key: str, item: Any) -> None:
        super().__setitem__(key, item)
        frame, path = self._scope_of
        if frame.run.watched:
            clock = frame.run.clock
            fields = (path, clock.now(), clock.time_ns(), self._output[key], item)
            frame.publish(_new(UserdataWritten, fields))

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value


def run_watched(frame: Frame, step: Step) -> Any:
    """Run a step and publish that it was entered and left."""
    run = frame.run
    clock = run.clock
    path = step._path if step._base is frame._path else step.path_in(frame)  # noqa: SLF001
    if run.pending:
        run.flush()
    frame.publish(_new(Entered, (path, clock.now(), clock.time_ns())))
    try:
        window = step.watched_userdata(frame) if step.writes else step.userdata
        outcome = step.execute(window)
    except BaseException as error:
        publish_raised(frame, error)
        raise
    if frame.told is not None or run.pending or run.control is not None:
        publish_left(frame, step, outcome)
    else:
        frame.publish(_new(Left, (path, clock.now(), clock.time_ns(), outcome)))
    return outcome


def publish_raised(frame: Frame, error: BaseException) -> None:
    """Publish that the step that runs was ended by `error`."""
    if isinstance(error, Interruption):
        frame.emit(Left, "preempted")
    else:
        frame.emit(Failed, f"{type(error).__name__}: {error}")


def publish_left(frame: Frame, step: Step, outcome: Any) -> None:
    """Publish that `step` has just ended, and what goes with it."""
    run = frame.run
    clock = run.clock
    if frame.told is not None:
        note_answer(frame, outcome)
    if run.pending:
        run.flush()
    frame.publish(_new(Left, (step.path_in(frame), clock.now(), clock.time_ns(), outcome)))
    if run.control is not None:
        run.control.note_outcome(frame, step, outcome)


def taping(frame: Frame) -> Tape | None:
    """Return the tape that is the only one to hear the events of `frame`; None if there is none."""
    ears = frame._ears  # noqa: SLF001  one machinery
    if ears is None or ears.at is not HEARING.now:
        ears = frame.find_ears()
    return ears.tape
