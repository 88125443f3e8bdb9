"""A callback of a container while it runs.

Code of the user that a container itself calls has a grace after a preempt, as a leaf has: otherwise
a callback that blocks would hold the container for ever. It runs in a frame of its own, whose visit
follows the table of `smachpy.engine.visit` like the visit of a leaf.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.base.functions import name_of
from smachpy.engine.described import StateData
from smachpy.engine.frame import Frame
from smachpy.engine.interrupt import Interruption, uninterrupted
from smachpy.engine.preempt import Visit, ask, forget_visit
from smachpy.engine.visit import Phase

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from smachpy.engine.described import Parent
    from smachpy.events import Event


class _Code:
    """The step, and at once the state, of a callback's visit; without options and userdata."""

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

    def path_in(self, frame: Frame) -> str:
        """Return the container's path: a callback has none."""
        return frame.path

    def request_preempt(self) -> None:
        """Do nothing: a plain function has no way to notice a request."""

    _smachpy_request_preempt: ClassVar[object] = request_preempt

    def cut_off(self) -> None:
        """Do nothing: a callback has no userdata of its own, and no child follows it."""


class CallbackFrame(Frame):
    """Runs one callback of `container` in the thread of `parent`.

    In events its path is that of the container: a callback is no state.
    """

    def __init__(self, container: Parent, parent: Frame, function: Callable[..., Any]) -> None:
        super().__init__(container, parent, parent.run, parent.first)
        above = parent.step
        # A hook is called around the run, in the frame of the parent; other callbacks inside it.
        self._is_hook = above is not None and above.state is container
        self._path = parent.here() if self._is_hook else parent.path
        self._step = _Code(function)

    def here(self) -> str:
        """Return the container's path."""
        return self.path

    def described(self) -> str:
        """Name the callback and its container, for the log."""
        return f"{self.path}: {self._step.label}"

    def is_in_child(self) -> bool:
        """Return False: a callback is not a child."""
        return False

    def note(self, path: str, kind: Callable[..., Event], *fields: Any) -> None:
        """Publish nothing: the events of the container's own visit say that it was asked."""

    def waits_for(self) -> Any:
        """Return the container's branches, which must end before the callback is left behind.

        They do end: they were asked together with the callback.
        """
        parent = self.parent
        assert parent is not None
        group = None if self._is_hook else parent.group
        return group if group is not None and group.started else None

    def begin(self) -> None:
        """Start the visit; called before the callback, and after the container has run in it."""
        container, parent = self.container, self.parent
        self.step = self._step
        self.live.callback = self
        assert parent is not None
        with self.run.lock:
            self.visit = Visit(self, self._step, Phase.RUNNING)
            visit = parent.visit if self._is_hook else None
            # Asked already: the grace of the callback begins now, or it would never be interrupted.
            if container._preempt_requested or (visit is not None and visit.is_asked()):
                ask(self)

    def end(self) -> None:
        """End the visit: the callback has ended, or runs the container now."""
        forget_visit(self)
        self.step = None
        live = self.live
        if live.callback is self:
            live.callback = None


def call_bounded(
    container: Parent, parent: Frame, function: Callable[..., Any], arguments: Sequence[Any]
) -> Any:
    """Call the user's `function` for `container`; after a preempt the container's grace limits it.

    It runs in the frame `parent`: the container's own, or that of the container above.

    Raises:
        Interruption: it outlasted the grace; with `parent.dead`, its thread was left behind.
    """
    live = container._smachpy.live
    if live.callback is not None:  # inside another callback of it, whose grace covers this one
        return function(*arguments)
    frame = CallbackFrame(container, parent, function)
    answer: Any = None
    failure: BaseException | None = None
    try:
        frame.begin()
        answer = function(*arguments)
    except BaseException as error:  # noqa: BLE001  raised below, once nothing can interrupt it
        failure = error
    uninterrupted(frame, frame.end)
    if frame.dead:
        raise Interruption
    if failure is not None:
        raise failure
    return answer
