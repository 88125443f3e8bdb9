"""Who hears of a run: SMACH's callbacks and the listeners of events."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smachpy import log
from smachpy._runtime.frame import HEARING
from smachpy.tape import LONGEST, Tape

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from smachpy._runtime.frame import Frame
    from smachpy.events import Event
    from smachpy.user_data import UserData

Callback = tuple["Callable[..., object]", "tuple[Any, ...]"]


class Callbacks:
    """The part of a container that calls back."""

    userdata: UserData
    _frame: Frame | None

    def __init__(self) -> None:
        self._start_cbs: list[Callback] = []
        self._transition_cbs: list[Callback] = []
        self._termination_cbs: list[Callback] = []
        self._listeners: tuple[Callable[[Event], object], ...] = ()
        self._tapes: tuple[Tape, ...] = ()

    def get_initial_states(self) -> list[str]:
        """Return the labels of the children that run first."""
        raise NotImplementedError

    def get_active_states(self) -> list[str]:
        """Return the labels of the children that run now."""
        raise NotImplementedError

    def register_start_cb(
        self, start_cb: Callable[..., object], cb_args: Iterable[Any] = ()
    ) -> None:
        """Call `start_cb(userdata, initial_states, *cb_args)` at the start of each run."""
        self._start_cbs.append((start_cb, tuple(cb_args)))

    def register_transition_cb(
        self, transition_cb: Callable[..., object], cb_args: Iterable[Any] = ()
    ) -> None:
        """Call `transition_cb(userdata, active_states, *cb_args)` after each transition."""
        self._transition_cbs.append((transition_cb, tuple(cb_args)))
        HEARING.now = object()

    def register_termination_cb(
        self, termination_cb: Callable[..., object], cb_args: Iterable[Any] = ()
    ) -> None:
        """Call `termination_cb(userdata, terminal_states, outcome, *cb_args)` at the end."""
        self._termination_cbs.append((termination_cb, tuple(cb_args)))

    def call_start_cbs(self) -> None:
        """Call the start callbacks; one that raises is reported, the others still run."""
        self._call(self._start_cbs, self.get_initial_states())

    def call_transition_cbs(self) -> None:
        """Call the transition callbacks; one that raises is reported, the others still run."""
        self._call(self._transition_cbs, self.get_active_states())

    def call_termination_cbs(self, terminal_states: Sequence[str], outcome: str) -> None:
        """Call the termination callbacks; one that raises is reported, the others still run."""
        self._call(self._termination_cbs, terminal_states, outcome)

    def _call(self, callbacks: list[Callback], *arguments: object) -> None:
        for callback, extra in tuple(callbacks):
            try:
                callback(self.userdata, *arguments, *extra)
            except Exception as error:  # noqa: BLE001  a border: reported, the machine goes on
                frame = self._frame
                if frame is not None:
                    frame.callback_failed(callback, error)
                else:
                    log.log_exception(f"callback {callback!r} raised {error!r}", error)

    def subscribe(self, listener: Callable[[Event], object]) -> Callable[[], None]:
        """Give every event of this container and of all below it to `listener`.

        Returns:
            A function that ends it.

        Threads: `listener` is called in the thread where the event happens and holds the machine
            up while it runs. What it raises is logged and otherwise without effect.
        """
        self._listeners = (*self._listeners, listener)
        self._hearing_changed()

        def unsubscribe() -> None:
            self._listeners = tuple(item for item in self._listeners if item is not listener)
            self._hearing_changed()

        return unsubscribe

    def tape(
        self, on_news: Callable[[], object] | None = None, *, limit: int = LONGEST, name: str = ""
    ) -> Tape:
        """Take every event of this container and of all below it down, to be read later.

        It costs the machine a fraction of what a listener does. Arguments as for
        `smachpy.tape.Tape`, whose `read` gives the records and whose `close` ends it.

        Threads: any.
        """
        made = Tape(self, on_news, limit=limit, name=name)
        self._add_tape(made)
        return made

    def _add_tape(self, tape: Tape) -> None:
        self._tapes = (*self._tapes, tape)
        self._hearing_changed()

    def _remove_tape(self, tape: Tape) -> None:
        self._tapes = tuple(item for item in self._tapes if item is not tape)
        self._hearing_changed()

    def _hearing_changed(self) -> None:
        HEARING.now = object()
        frame = self._frame
        if frame is not None:
            frame.run.watched = True
