"""A callback of a container while it runs.

A leaf has its grace after a preempt; so has code of the user that a container itself calls, else a
callback that blocks would hold the container for ever. Such a callback is run in a frame of its
own, whose visit goes through the table of `smachpy.run.visit` as that of a leaf does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.machines.names import name_of
from smachpy.run.child import StateData
from smachpy.run.frame import Frame
from smachpy.run.grace import ask, forget_visit
from smachpy.run.interrupt import Interruption

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from smachpy.events import Event
    from smachpy.run.child import Parent


class _Code:
    """Stands where a visit expects a step and its state: no options, outcomes or userdata."""

    _preempt_requested = False
    _smachpy_is_container = False
    _smachpy_grace = None

    def __init__(self, function: Callable[..., Any]) -> None:
        self._smachpy = StateData()
        self.label = name_of(function)
        self.execute = function

    @property
    def state(self) -> _Code:
        """The code itself."""
        return self

    def request_preempt(self) -> None:
        """Nothing: a function cannot be told."""

    _smachpy_request_preempt: ClassVar[object] = request_preempt

    def cut_off(self) -> None:
        """Nothing: it has no userdata, and nothing follows it."""


class CallbackFrame(Frame):
    """Runs one callback of `container` in the thread of `parent`.

    In events its path is that of the container: a callback is no state.
    """

    def __init__(self, container: Parent, parent: Frame, function: Callable[..., Any]) -> None:
        self.container = container
        self.data = container._smachpy
        self.parent = parent
        self.run = parent.run
        self.first = parent.first
        above = parent.step
        self._is_hook = above is not None and above.state is container  # called around its run
        self._path = parent.here() if self._is_hook else parent.path
        self._step = _Code(function)

    def here(self) -> str:
        """Return the container's path."""
        return self.path

    def described(self) -> str:
        """Name the callback and its container, for the log."""
        return f"{self.path}: {self._step.label}"

    def is_in_child(self) -> bool:
        """Tell that no child runs here."""
        return False

    def note(self, path: str, kind: Callable[..., Event], *fields: Any) -> None:
        """Note nothing: that its container was asked is known."""

    def waits_for(self) -> Any:
        """Return the branches that its container has to wait for, before it can be left behind.

        They end, as they were asked together with the callback.
        """
        parent = self.parent
        assert parent is not None
        group = None if self._is_hook else parent.group
        return group if group is not None and group.started else None

    def begin(self) -> None:
        """The callback runs from here on."""
        container, parent = self.container, self.parent
        self.step = self._step
        self.data.callback = self
        assert parent is not None
        visit = parent.visit if self._is_hook else None
        if container._preempt_requested or (visit is not None and visit.is_asked()):
            with self.run.lock:  # its grace begins now
                ask(self)

    def end(self) -> None:
        """The callback has returned, raised, was interrupted, or runs the container now."""
        self.step = None  # first the mark, then the look: see `smachpy.run.grace.ask`
        data = self.data
        if data.callback is self:
            data.callback = None
        if self.visit is not None:
            forget_visit(self)


def call_bounded(
    container: Parent, parent: Frame, function: Callable[..., Any], arguments: Sequence[Any]
) -> Any:
    """Call code of the user for `container`; a preempt bounds it by the container's grace.

    Args:
        container: The container whose code it is.
        parent: The frame in which it runs: the container's own, or that of the container above.
        function: The callback.
        arguments: Its arguments.

    Returns:
        What it returns.

    Raises:
        Interruption: it ran longer than the grace; with `parent.dead`, its thread was left behind.
    """
    data = container._smachpy
    if data.callback is not None:  # code of the same container called this
        return function(*arguments)
    frame = CallbackFrame(container, parent, function)
    answer: Any = None
    failure: BaseException | None = None
    try:
        frame.begin()
        answer = function(*arguments)
    except BaseException as error:  # noqa: BLE001  raised below, once nothing can interrupt it
        failure = error
    while True:
        try:
            frame.end()
        except Interruption:  # on its way when the callback ended
            if frame.dead:
                raise
            continue
        break
    if frame.dead:
        raise Interruption
    if failure is not None:
        raise failure
    return answer
