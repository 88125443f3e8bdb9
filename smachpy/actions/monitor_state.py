"""`MonitorState`: check every message of a topic."""

from __future__ import annotations

import sys
import threading
from typing import TYPE_CHECKING, Any, ClassVar

from actionlib_core import border
from actionlib_core.goal.bounded import Backlog
from actionlib_core.pubsub.topic import NotingSubscriber
from smachpy.actions.interface import adopt_interface
from smachpy.actions.wakeup import Wakeup, answer_preempt
from smachpy.base import log
from smachpy.base.context import current_path
from smachpy.base.functions import name_of, no_coroutine
from smachpy.base.problems import Problems
from smachpy.engine.frame import current_scope
from smachpy.events import CallbackFailed
from smachpy.exceptions import error_text
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Unpack

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from smachpy.actions.interface import UntimedOptions
    from smachpy.base.names import Names
    from smachpy.events.introspection import Kind

__all__ = ["MonitorState"]


class MonitorState(State):
    """Checks the messages of a topic. Outcomes: 'valid', 'invalid', 'preempted'.

    The condition runs in the state's thread, once per message, in order. It may be slow: messages
    that arrive meanwhile wait; beyond 100,000 or 32 MiB the oldest are dropped, which is logged.

    Args:
        topic: Name of the topic.
        msg_type: Class of its messages.
        cond_cb: Called as `cond_cb(userdata, message)`. The first false value ends the state with
            'invalid'; so does an exception, which is logged and reported as `CallbackFailed`. Its
            `cb_interface` is added.
        max_checks: Number of true values after which it ends with 'valid'; -1 for no limit.
        input_keys: Userdata keys that it reads.
        output_keys: Userdata keys that it writes.
        timeout: Time after which it ends with `timeout_outcome` [s]; None for no limit.
        timeout_outcome: Outcome after a timeout; registered if there is one.
        latest: If several messages wait, check only the newest.
        node: Node that subscribes; None for the current node.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "monitor"

    def __init__(
        self,
        topic: str,
        msg_type: Any,
        cond_cb: Callable[[Any, Any], object],
        max_checks: int = -1,
        input_keys: Names = (),
        output_keys: Names = (),
        *,
        timeout: float | Duration | None = None,
        timeout_outcome: str = "aborted",
        latest: bool = False,
        node: Node | None = None,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems(f"{type(self).__name__} {topic!r}")
        with problems:
            super().__init__(("valid", "invalid", "preempted"), input_keys, output_keys, **options)
        self.__topic = problems.network_name("topic", topic)
        problems.kind_of("msg_type", msg_type, "_slot_types", "a class of messages")
        self.__msg_type = msg_type
        call = "cond_cb(userdata, message)"
        self.__cond_cb = problems.function("cond_cb", cond_cb, call, 2, optional=False)
        self._smachpy.code = (cond_cb,)
        expected = "-1 (no limit) or a number of checks"
        self.__max_checks = problems.whole("max_checks", max_checks, -1, expected)
        self.__timeout_s = problems.seconds("timeout", timeout)
        self.__timeout_outcome = problems.word("timeout_outcome", timeout_outcome)
        self.__latest = latest
        self.__node = node
        problems.raise_all()
        if self.__timeout_s is not None:
            self.register_outcomes([timeout_outcome])
        adopt_interface(self, cond_cb, outcomes=False)

    def execute(self, ud: Any) -> str:
        """Check messages until one is invalid, a limit is reached, or a preempt arrives.

        Blocks: see above.
        """
        with Wakeup(self) as wake:
            inlet = _WaitingMessages(self.__topic, self.__msg_type, wake, latest=self.__latest)
            subscriber = NotingSubscriber(
                self.__topic, self.__msg_type, inlet.take_in, node=self.__node
            )
            with subscriber, subscriber.telling():
                return self.__watch(ud, wake, inlet)

    def __watch(self, ud: Any, wake: Wakeup, inlet: _WaitingMessages) -> str:
        clock = wake.clock
        verdicts = border.Verdicts(current_path() or "", self.__topic, clock)
        until = None if self.__timeout_s is None else clock.now() + self.__timeout_s
        good = 0
        while True:
            wake.clear()  # first, so that nothing that happens after these checks is missed
            if answer_preempt(self):
                return "preempted"
            if until is not None and clock.now() >= until:
                return self.__timeout_outcome
            message = inlet.take()
            if message is None:
                wake.wait_until(until)
                continue
            is_good = self.__check(ud, message)
            verdicts.note(message, is_good)
            if not is_good:
                return "invalid"
            good += 1
            if good == self.__max_checks:
                return "valid"

    def __check(self, ud: Any, message: Any) -> bool:
        try:
            return bool(no_coroutine(self.__cond_cb(ud, message)))
        except Exception as error:  # noqa: BLE001  as in SMACH: a check that raises has failed
            text = error_text(error)
            scope = current_scope()
            where = f"MonitorState {self.__topic!r}" if scope is None else scope.path
            log.log_exception(f"{where}: condition {name_of(self.__cond_cb)} raised {text}", error)
            if scope is not None:
                scope.emit(CallbackFailed, name_of(self.__cond_cb), text)
            return False

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the topic, the condition and the limits."""
        kind, details = super().describe_details()
        own = [
            ("topic", self.__topic),
            ("type", str(self.__msg_type._type)),
            ("condition", name_of(self.__cond_cb)),
        ]
        if self.__max_checks > 0:
            own.append(("checks", str(self.__max_checks)))
        if self.__timeout_s is not None:
            own.append(("timeout", f"{self.__timeout_s:g} s -> {self.__timeout_outcome}"))
        return kind, (*own, *details)


class _WaitingMessages:
    """The messages that wait for the condition.

    Threads: `take_in` on the network's thread, `take` in the state's.
    """

    def __init__(self, topic: str, kind: Any, wake: Wakeup, *, latest: bool) -> None:
        self._topic = topic
        self._kind = kind
        self._wake = wake
        self._latest = latest
        self._lock = threading.Lock()  # guards `_waiting`
        self._waiting: Backlog[Any] = Backlog(1, sys.maxsize) if latest else Backlog()

    def take_in(self, message: Any) -> None:
        """Keep a message."""
        size = 0
        if self._waiting and not self._latest:  # the condition is slow: how large are they?
            ros2 = self._kind._wire == "ros2"
            size = len(message.to_cdr() if ros2 else message.to_bytes())
        with self._lock:
            before = self._waiting.dropped
            self._waiting.add(message, size)
            first = not before and self._waiting.dropped and not self._latest
        if first:
            log.logwarn(
                f"MonitorState {self._topic!r}: messages come faster than the condition checks "
                "them: of those that wait, the oldest are dropped. Try latest=True."
            )
        self._wake.set()

    def take(self) -> Any:
        """Return the next message; None if none waits."""
        with self._lock:
            return self._waiting.take()
