"""States that wait for some time or for a message."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smachpy.base.problems import Problems
from smachpy.engine.frame import clock_of_run
from smachpy.engine.preempt import on_preempt
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.events.introspection import Kind
    from smachpy.userdata.user_data import UserData


class AwaitMessage(State):
    """Waits for a message that fulfils a condition. Outcomes: 'came', 'timeout', 'preempted'.

    Args:
        topic: Name of the topic.
        msg_type: Class of its messages.
        wanted: Called with each message, in the subscriber's thread; a true value ends the wait.
        timeout: Longest wait [s].

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    def __init__(
        self, topic: str, msg_type: Any, wanted: Callable[[Any], bool], *, timeout: float
    ) -> None:
        problems = Problems(f"AwaitMessage {topic!r}")
        problems.network_name("topic", topic)
        problems.kind_of("msg_type", msg_type, "_slot_types", "a class of messages")
        problems.function("wanted", wanted, "wanted(message)", 1, optional=False)
        longest = problems.seconds("timeout", timeout, optional=False)
        problems.raise_all()
        super().__init__(outcomes=["came", "timeout", "preempted"])
        self.__topic = topic
        self.__msg_type = msg_type
        self.__wanted = wanted
        self.__longest = longest

    def execute(self, userdata: UserData) -> str:
        """Wait for the message.

        Blocks: until the message, `timeout` or a preempt.
        """
        del userdata
        came: list[bool] = []
        from actionlib_core.pubsub.topic import Subscriber

        wake = clock_of_run().event(f"a message on {self.__topic}")

        def on_message(message: Any) -> None:
            if self.__wanted(message):
                came.append(True)
                wake.set()

        forget = on_preempt(self, wake.set)
        try:
            subscriber = Subscriber(self.__topic, self.__msg_type, on_message)
            with subscriber, subscriber.telling():
                wake.wait(self.__longest)
        finally:
            forget()
        if came:
            return "came"
        return "preempted" if self.preempt_requested() else "timeout"

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the topic and the limit."""
        _, details = super().describe_details()
        own = (("topic", self.__topic), ("timeout", f"{self.__longest:g} s -> timeout"))
        return "monitor", (*own, *details)


class Wait(State):
    """Waits for some time. Outcomes: 'done', 'preempted'.

    Args:
        seconds: The time [s]; None for the userdata key `seconds`.

    Raises:
        InvalidStateError: `seconds` is not a duration.
    """

    def __init__(self, seconds: float | None = None) -> None:
        problems = Problems("Wait")
        problems.seconds("seconds", seconds)
        problems.raise_all()
        keys = ["seconds"] if seconds is None else []
        super().__init__(outcomes=["done", "preempted"], input_keys=keys)
        self.__seconds = seconds

    def execute(self, userdata: UserData) -> str:
        """Wait; a preempt ends it early."""
        seconds = userdata.seconds if self.__seconds is None else self.__seconds
        return "preempted" if State.sleep(self, seconds) else "done"
