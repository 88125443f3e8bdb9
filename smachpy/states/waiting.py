"""States that wait for some time or for a message."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core import border
from smachpy.base import log
from smachpy.base.context import current_path
from smachpy.base.functions import no_coroutine
from smachpy.base.problems import Problems, as_number
from smachpy.engine.frame import clock_of_run
from smachpy.engine.preempt import on_preempt
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Unpack

    from actionlib_core.clock import Clock, Event
    from actionlib_core.time import Duration
    from smachpy.actions.interface import UntimedOptions
    from smachpy.events.introspection import Kind
    from smachpy.machines.state import StateOptions
    from smachpy.userdata.user_data import UserData


class AwaitMessage(State):
    """Waits for a message that fulfils a condition. Outcomes: 'came', 'timeout', 'preempted'.

    After a timeout the log says how many messages came, and from how many publishers.

    Args:
        topic: Name of the topic.
        msg_type: Class of its messages.
        wanted: Called with each message, in the subscriber's thread; a true value ends the wait.
            What it raises, the state raises. None: any message is wanted.
        key: The userdata key that gets the message; None: none does.
        timeout: Longest wait [s]; None: no limit, 0: it looks once.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    def __init__(
        self,
        topic: str,
        msg_type: Any,
        wanted: Callable[[Any], bool] | None = None,
        *,
        key: str | None = None,
        timeout: float | Duration | None,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems(f"AwaitMessage {topic!r}")
        name = problems.network_name("topic", topic)
        problems.kind_of("msg_type", msg_type, "_slot_types", "a class of messages")
        problems.function("wanted", wanted, "wanted(message)", 1)
        longest = problems.seconds("timeout", timeout)
        keys = [] if key is None else [problems.word("key", key)]
        with problems:
            super().__init__(("came", "timeout", "preempted"), (), keys, **options)
        problems.raise_all()
        self.__topic = name
        self.__msg_type = msg_type
        self.__wanted = wanted
        self.__key = key
        self.__longest = longest

    def execute(self, userdata: UserData) -> str:
        """Wait for the message.

        Raises:
            TypeMismatchError: no message came, and all publishers have another type.

        Blocks: until the message, `timeout` or a preempt.
        """
        from actionlib_core.pubsub.topic import Subscriber

        ends: list[Any] = []  # messages that are wanted, and errors; the first one counts
        count = 0
        clock = clock_of_run()
        wake = clock.event(f"a message on {self.__topic}")
        verdicts = border.Verdicts(current_path() or "", self.__topic, clock)

        def on_message(message: Any) -> None:
            nonlocal count
            count += 1
            try:
                is_wanted = self.__wanted is None or bool(no_coroutine(self.__wanted(message)))
                verdicts.note(message, is_wanted)
                if is_wanted:
                    ends.append(message)
            except BaseException as error:  # noqa: BLE001  raised in the state's thread
                ends.append(error)
            if ends:
                wake.set()

        forget = on_preempt(self, wake.set)
        try:
            subscriber = Subscriber(self.__topic, self.__msg_type, on_message)
            with subscriber, subscriber.telling():
                self.__wait(wake, clock, ends)
                publishers, others = subscriber.get_num_connections(), subscriber.mismatches
        finally:
            forget()
        if ends:
            if isinstance(ends[0], BaseException):
                raise ends[0]
            if self.__key is not None:
                userdata[self.__key] = ends[0]
            return "came"
        if self.preempt_requested():
            return "preempted"
        if others and not publishers:
            raise others[0]
        log.logwarn(
            f"{current_path() or 'AwaitMessage'}: topic {subscriber.name}: got {count} messages in "
            f"{self.__longest:g} s, none that was wanted, {publishers} publishers there; expected "
            f"a {subscriber.type}."
        )
        return "timeout"

    def __wait(self, wake: Event, clock: Clock, ends: list[Any]) -> None:
        """Wait for the first of `ends`, the limit or a preempt, which may be withdrawn."""
        until = None if self.__longest is None else clock.now() + self.__longest
        while not (ends or self.preempt_requested()):
            if not wake.wait(None if until is None else max(0.0, until - clock.now())):
                return
            wake.clear()

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the topic and the limit."""
        _, details = super().describe_details()
        limit = () if self.__longest is None else (("timeout", f"{self.__longest:g} s -> timeout"),)
        return "monitor", (("topic", self.__topic), *limit, *details)


class Wait(State):
    """Waits for some time. Outcomes: 'done', 'preempted'.

    Args:
        seconds: The time [s], a number or a `Duration`; None for the userdata key `seconds`.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    def __init__(
        self, seconds: float | Duration | None = None, **options: Unpack[StateOptions]
    ) -> None:
        problems = Problems("Wait")
        problems.seconds("seconds", seconds)
        keys = ["seconds"] if seconds is None else []
        with problems:
            super().__init__(("done", "preempted"), keys, **options)
        problems.raise_all()
        self.__seconds = as_number(seconds)

    def execute(self, userdata: UserData) -> str:
        """Wait; a preempt ends it early."""
        seconds = userdata.seconds if self.__seconds is None else self.__seconds
        return "preempted" if State.sleep(self, seconds) else "done"

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the time."""
        kind, details = super().describe_details()
        waits = () if self.__seconds is None else (("waits", f"{self.__seconds:g} s"),)
        return kind, (*waits, *details)
