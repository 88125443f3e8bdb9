"""A container, compiled: one record per child with all that running it needs, looked up once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from smachpy.events import UserdataWritten
from smachpy.run.interrupt import Interruption
from smachpy.run.visit import End
from smachpy.userdata.user_data import Remapper, revoke

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.run.child import Child
    from smachpy.run.frame import Frame


_new = tuple.__new__  # half the time of a NamedTuple's own


class Step:
    """One child, ready to run.

    Attributes:
        label: Its label.
        state: The child.
        execute: Runs it: its own `execute`, or that with its options around it.
        userdata: Its window into the container's userdata; what `execute` was given, for a root.
        next: Outcome -> what comes then.
        interface: The child's interface version that this was compiled from.
        writes: It may write userdata.
    """

    __slots__ = (
        "_base",
        "_path",
        "_window",
        "execute",
        "final",
        "interface",
        "label",
        "next",
        "state",
        "userdata",
        "writes",
    )
    final: Literal[False]

    def __init__(
        self, label: str, state: Child, userdata: Any, execute: Callable[[Any], Any]
    ) -> None:
        data = state._smachpy
        self.label = label
        self.final = False  # on the instance, where Python finds it faster; see `End`
        self.state = state
        self.execute = execute
        self.userdata = userdata
        self.next: dict[str, Any] = {}
        self.interface = data.version
        self.writes = bool(data.output_keys)
        self._base = self._path = ""
        self._window: _WatchedRemapper | None = None

    def is_stale(self) -> bool:
        """Tell whether the child's interface has changed."""
        return self.interface != self.state._smachpy.version

    def cut_off(self) -> None:
        """Let a thread that was left behind in this child get no further, and write nothing."""
        self.next = _Nowhere()
        for window in (self.userdata, self._window):
            if isinstance(window, Remapper):
                revoke(window)

    def forget_frame(self) -> None:
        """Keep nothing of the run that has ended."""
        self._window = None

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
        for name in Remapper.__slots__:
            set_slot(self, name, getattr(original, name))
        set_slot(self, "_scope_of", (frame, path))

    def __setitem__(self, key: str, item: Any) -> None:
        frame, path = self._scope_of
        if frame.run.journal is not None and key in self._output:
            frame.run.journal.check_value(frame, path, self._output[key], item)
        super().__setitem__(key, item)
        if frame.run.watched and key in self._output:  # else it was dropped
            clock = frame.run.clock
            fields = (path, clock.now(), clock.time_ns(), self._output[key], item)
            frame.publish(_new(UserdataWritten, fields))

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value
