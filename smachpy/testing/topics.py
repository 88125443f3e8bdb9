"""A scripted topic: messages at moments that the test says, faults included, and what comes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.topic import Publisher, Subscriber
from smachpy.testing.ends import LOST, TWICE, ScriptedEnd, as_message

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.testing.kit import MissionKit


class ScriptedTopic(ScriptedEnd):
    """Writes to a topic and keeps what is written there; made by the `topic` fixture.

    Args:
        kit: The test.
        name: The topic's name.
        message_class: Class of its messages.

    Attributes:
        received: All messages on the topic, its own too, in order.
    """

    def __init__(self, kit: MissionKit, name: str, message_class: Any) -> None:
        self._message_class = message_class
        self.received: list[Any] = []
        super().__init__(kit, name)
        self._subscriber = Subscriber(name, message_class, self.received.append, node=self.node)
        self._publisher: Publisher | None = None
        self._latched: Publisher | None = None

    def publish(self, message: Any = None, *, latch: bool = False, **fields: Any) -> None:
        """Write now.

        Args:
            message: A message or a dict of its fields; or give the fields themselves.
            latch: Those who come later get it too.
            **fields: The fields of the message, in place of `message`.
        """
        made = self._message(message if message is not None else fields)
        self._port(latch=latch).publish(made)

    def publish_at(self, at: float, message: Any = None, **fields: Any) -> None:
        """Write `at` so long [s] from now."""
        made = self._message(message if message is not None else fields)
        port = self._port(latch=False)
        self._clock.call_later(at, lambda: port.publish(made))

    def publish_every(self, period: float, messages: Iterable[Any], *, start: float = 0.0) -> None:
        """Write one message after the other, `period` [s] apart, the first `start` [s] from now."""
        for number, message in enumerate(messages):
            self.publish_at(start + number * period, message)

    def lose(self, count: int = 1) -> None:
        """Lose the next messages that this end writes."""
        self._doom(self._word(), LOST, count)

    def deliver_twice(self, count: int = 1) -> None:
        """Deliver the next messages twice."""
        self._doom(self._word(), TWICE, count)

    def delay(self, seconds: float, count: int = 1) -> None:
        """Deliver the next messages late by `seconds`: those after them may overtake."""
        self._doom(self._word(), (seconds,), count)

    def _word(self) -> str:
        return self.name.rpartition("/")[2]

    def _port(self, *, latch: bool) -> Publisher:
        if latch:
            self._latched = self._latched or Publisher(
                self.name, self._message_class, latch=True, node=self.node
            )
            return self._latched
        self._publisher = self._publisher or Publisher(
            self.name, self._message_class, node=self.node
        )
        return self._publisher

    def _message(self, value: Any) -> Any:
        return as_message(self._message_class, value, f"{self.name}: message")
