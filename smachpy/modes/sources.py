"""Where events come from: topics, services and signals, while the modes run."""

from __future__ import annotations

import signal
import threading
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from actionlib_core.clock import RealClock
from actionlib_core.inputs.expression import WHOLE, Expression, ExpressionError
from smachpy.base import log
from smachpy.base.problems import unknown_name
from smachpy.modes.table import ModesError

if TYPE_CHECKING:
    from collections.abc import Callable


class Source(Protocol):
    """Something that can trigger events."""

    def open(self, trigger: Callable[[str], bool]) -> Callable[[], object]:
        """Begin to call `trigger` with events; return a function that ends that."""


@dataclass(frozen=True, slots=True)
class _Topic:
    topic: str
    kind: Any
    event: str
    when: Expression | None

    def open(self, trigger: Callable[[str], bool]) -> Callable[[], object]:
        from actionlib_core.pubsub.topic import Subscriber

        before = told = False

        def is_met(message: Any) -> bool:
            nonlocal told
            try:
                return self.when is None or bool(self.when(message))
            except ExpressionError as error:
                if not told:
                    log.logwarn(f"Modes: the condition of topic {self.topic!r}: {error}")
                told = True
                return False

        def take(message: Any) -> None:
            nonlocal before
            holds = is_met(message)
            # A condition triggers once while it holds: a joystick sends 50 times a second. Where
            # the event means nothing yet, a later message triggers.
            before = holds and (before or trigger(self.event)) and self.when is not None

        return Subscriber(self.topic, self.kind, take).unregister


@dataclass(frozen=True, slots=True)
class _Service:
    name: str
    event: str

    def open(self, trigger: Callable[[str], bool]) -> Callable[[], object]:
        from actionlib_core.interfaces.std_srvs.srv import Trigger, TriggerResponse
        from actionlib_core.pubsub.service import Service

        def handle(_request: Any) -> Any:
            done = trigger(self.event)
            text = "" if done else f"{self.event!r} means nothing in this mode"
            return TriggerResponse(success=done, message=text)

        return Service(self.name, Trigger, handle).shutdown


@dataclass(frozen=True, slots=True)
class Signal:
    """A signal of the process."""

    number: signal.Signals
    event: str

    def open(self, trigger: Callable[[str], bool]) -> Callable[[], object]:
        """Trigger the event with each signal until the returned function is called."""
        if threading.current_thread() is not threading.main_thread():
            log.logwarn(
                f"modes: {self.number.name} triggers nothing: they do not run in the main thread."
            )
            return lambda: None

        def note(_number: int, _frame: object) -> None:
            # The interrupted code may hold any lock: another thread passes it on.
            RealClock().spawn(partial(trigger, self.event), name=f"event {self.event}")

        before = signal.signal(self.number, note)
        return lambda: signal.signal(self.number, before)


def on_topic(topic: str, msg_type: Any, event: str, when: str = "") -> Source:
    """Return a source: messages of a topic trigger an event.

    Args:
        topic: Name of the topic.
        msg_type: Its class.
        event: The event.
        when: An expression over the message, such as "percentage < 0.2": triggers once while it
            holds, in a mode where the event means something. "" triggers with every message. If it
            cannot be evaluated, it does not hold; the first time is logged.

    Raises:
        ExpressionError: `when` cannot be parsed.
        ModesError: `msg_type` is no class, or `when` names a field that it does not have.
    """
    if not isinstance(msg_type, type):
        raise ModesError([f"on_topic: msg_type: got {msg_type!r}; expected a class of messages."])
    condition, known = Expression(when) if when else None, list(getattr(msg_type, "__slots__", ()))
    if condition is not None and known:
        unknown = sorted(condition.names - {*known, WHOLE})
        problems = [unknown_name("on_topic: when: field", name, known) for name in unknown]
        if problems:
            raise ModesError(problems)
    return _Topic(topic, msg_type, event, condition)


def on_service(name: str, event: str) -> Source:
    """Return a source: a call of the service `name` (std_srvs/Trigger) triggers an event.

    The response says whether it meant something.
    """
    return _Service(name, event)


def on_signal(number: signal.Signals | int, event: str) -> Source:
    """Return a source: a signal of the process, such as `signal.SIGUSR1`, triggers an event.

    Raises:
        ModesError: it is no signal, or one that no program gets.

    Threads: only modes that run in the main thread get signals.
    """
    try:
        known = signal.Signals(number)
    except ValueError:
        known = signal.SIGKILL
    if known in {signal.SIGKILL, signal.SIGSTOP}:
        expected = "expected a signal that a program gets, such as signal.SIGUSR1"
        raise ModesError([f"on_signal: got {number!r}; {expected}."])
    return Signal(known, event)
