"""SMACH's callbacks, and the subscribers of events."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from smachpy.base import log
from smachpy.base.functions import name_of
from smachpy.base.problems import Problems
from smachpy.engine.callback import call_bounded
from smachpy.engine.described import EPOCH
from smachpy.events.buffer import MAX_BUFFER_EVENTS, EventBuffer
from smachpy.exceptions import error_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from smachpy.engine.described import Callback
    from smachpy.events import Event
    from smachpy.events.buffer import SubscriberKind
    from smachpy.userdata.user_data import UserData


class Callbacks:
    """The callbacks and subscriptions of a container."""

    userdata: UserData
    _smachpy: Any

    def get_initial_states(self) -> list[str]:
        """Return the labels of the children that run first."""
        raise NotImplementedError

    def get_active_states(self) -> list[str]:
        """Return the labels of the active children."""
        raise NotImplementedError

    def register_start_cb(
        self, start_cb: Callable[..., object], cb_args: Iterable[Any] = ()
    ) -> None:
        """Call `start_cb(userdata, initial_states, *cb_args)` at the start of each run."""
        call = "start_cb(userdata, initial_states, *cb_args)"
        self.__register(self._smachpy.start_cbs, start_cb, call, 2, cb_args)

    def register_transition_cb(
        self, transition_cb: Callable[..., object], cb_args: Iterable[Any] = ()
    ) -> None:
        """Call `transition_cb(userdata, active_states, *cb_args)` after each transition."""
        call = "transition_cb(userdata, active_states, *cb_args)"
        self.__register(self._smachpy.transition_cbs, transition_cb, call, 2, cb_args)

    def register_termination_cb(
        self, termination_cb: Callable[..., object], cb_args: Iterable[Any] = ()
    ) -> None:
        """Call `termination_cb(userdata, terminal_states, outcome, *cb_args)` at the end."""
        call = "termination_cb(userdata, terminal_states, outcome, *cb_args)"
        self.__register(self._smachpy.termination_cbs, termination_cb, call, 3, cb_args)

    def __register(
        self, known: list[Callback], function: Any, call: str, ours: int, args: Iterable[Any]
    ) -> None:
        name = call.partition("(")[0]
        problems = Problems(f"register_{name}")
        more = problems.values("cb_args", args)
        problems.function(name, function, call, ours + len(more), optional=False)
        problems.raise_all()
        known.append((function, more))
        EPOCH.value = object()

    def call_start_cbs(self) -> None:
        """Call the start callbacks; one that raises is reported, the others still run."""
        self.__call(self._smachpy.start_cbs, self.get_initial_states())

    def call_transition_cbs(self) -> None:
        """Call the transition callbacks; one that raises is reported, the others still run."""
        self.__call(self._smachpy.transition_cbs, self.get_active_states())

    def call_termination_cbs(self, terminal_states: Sequence[str], outcome: str) -> None:
        """Call the termination callbacks; one that raises is reported, the others still run."""
        self.__call(self._smachpy.termination_cbs, terminal_states, outcome)

    def __call(self, callbacks: list[Callback], *arguments: object) -> None:
        frame = self._smachpy.live.frame
        for callback, extra in tuple(callbacks):  # a copy: a callback may register another one
            given = (self.userdata, *arguments, *extra)
            try:
                if frame is None:  # the program calls `call_..._cbs` itself, outside of a run
                    callback(*given)
                else:
                    call_bounded(frame.container, frame, callback, given)
            except Exception as error:  # noqa: BLE001  reported; as in SMACH, the machine goes on
                if frame is not None:
                    frame.callback_failed(callback, error)
                else:
                    log.log_exception(
                        f"callback {name_of(callback)} raised {error_text(error)}", error
                    )

    def subscribe(self, listener: Callable[[Event], object]) -> Callable[[], None]:
        """Call `listener` with every event of this container and of all below it.

        Returns:
            A function that ends the subscription.

        Threads: `listener` is called in the thread in which the event happens, and blocks the
            machine while it runs. An exception that it raises is logged and has no other effect.
        """
        problems = Problems("subscribe")
        problems.function("listener", listener, "listener(event)", 1, optional=False)
        problems.raise_all()
        self._smachpy_attach("listeners", listener)
        return partial(self._smachpy_detach, "listeners", listener)

    def event_buffer(
        self,
        on_news: Callable[[], object] | None = None,
        *,
        limit: int = MAX_BUFFER_EVENTS,
        name: str = "",
    ) -> EventBuffer:
        """Return a buffer that keeps every event of this container and of all below it.

        It costs the machine a fraction of a listener. The arguments are those of
        `smachpy.events.buffer.EventBuffer`; its `read` returns the events, its `close` ends it.

        Threads: any.
        """
        problems = Problems("event_buffer")
        problems.function("on_news", on_news, "on_news()", 0)
        problems.whole("limit", limit, 0, "a whole number >= 0")
        problems.raise_all()
        return EventBuffer(self, on_news, limit=limit, name=name)

    tape = event_buffer  # its name in the first release

    def _smachpy_attach(self, kind: SubscriberKind, subscriber: object) -> None:
        live = self._smachpy.live
        setattr(live, kind, (*getattr(live, kind), subscriber))
        self.__subscriptions_changed()

    def _smachpy_detach(self, kind: SubscriberKind, subscriber: object) -> None:
        live = self._smachpy.live
        setattr(live, kind, tuple(x for x in getattr(live, kind) if x is not subscriber))
        self.__subscriptions_changed()

    def __subscriptions_changed(self) -> None:
        EPOCH.value = object()
        frame = self._smachpy.live.frame or self._smachpy.live.root
        if frame is not None:
            frame.run.watched = True
