"""`MonitorState`: check every message of a topic."""

from __future__ import annotations

from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from actionlib_core.time import to_seconds
from actionlib_core.topic import NotingSubscriber
from smachpy import log
from smachpy._core.plain import only_compares
from smachpy._runtime.interface import adopt_interface, name_of
from smachpy._runtime.wakeup import Wakeup
from smachpy.events import CallbackFailed
from smachpy.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import Unpack

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from smachpy._runtime.interface import UntimedOptions
    from smachpy.introspection import Kind

__all__ = ["MonitorState"]


class MonitorState(State):
    """Checks the messages of a topic. Outcomes: 'valid', 'invalid', 'preempted'.

    The condition runs in the thread that runs the state, once per message, in order. One that only
    reads and compares (`message.percentage > 0.2`: no call, no loop, nothing written) runs where
    the message arrives: while the messages are good, the state's thread sleeps.

    Args:
        topic: Name of the topic.
        msg_type: Class of its messages.
        cond_cb: Called as `cond_cb(userdata, message)`. The first false answer ends the state with
            'invalid'; so does an exception, which is logged and reported as `CallbackFailed`. Its
            `cb_interface` is added.
        max_checks: 'valid' after so many true answers; -1: no limit.
        input_keys: Userdata keys that it reads.
        output_keys: Userdata keys that it writes.
        timeout: `timeout_outcome` after so long [s]; None: no limit.
        timeout_outcome: Outcome then; registered if there is a timeout.
        latest: Of several messages that wait, check only the newest. For a condition that only
            reads and compares none ever waits.
        node: Where to listen; the current node when None.
        **options: See `smachpy.state.StateOptions`.
    """

    kind: ClassVar[Kind] = "monitor"

    def __init__(
        self,
        topic: str,
        msg_type: Any,
        cond_cb: Callable[[Any, Any], object],
        max_checks: int = -1,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        *,
        timeout: float | Duration | None = None,
        timeout_outcome: str = "aborted",
        latest: bool = False,
        node: Node | None = None,
        **options: Unpack[UntimedOptions],
    ) -> None:
        super().__init__(("valid", "invalid", "preempted"), input_keys, output_keys, **options)
        self._topic = topic
        self._msg_type = msg_type
        self._cond_cb = cond_cb
        self._max_checks = max_checks
        self._timeout_s = to_seconds(timeout)
        self.timeout_outcome = timeout_outcome
        if self._timeout_s is not None:
            self.register_outcomes([timeout_outcome])
        self._latest = latest
        self._node = node
        adopt_interface(self, cond_cb, "cond_cb", outcomes=False)

    def execute(self, ud: Any) -> str:
        """Check messages until one is bad, enough are good, time is up, or a preempt.

        Blocks: see above.
        """
        with Wakeup(self) as wake:
            condition = partial(self._cond_cb, ud) if only_compares(self._cond_cb) else None
            checks = _Checks(condition, wake, most=self._max_checks, latest=self._latest)
            with NotingSubscriber(self._topic, self._msg_type, checks.note, node=self._node):
                return self._watch(ud, wake, checks)

    def _watch(self, ud: Any, wake: Wakeup, checks: _Checks) -> str:
        clock = wake.clock
        until = None if self._timeout_s is None else clock.now() + self._timeout_s
        while True:
            wake.clear()
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            if until is not None and clock.now() >= until:
                return self.timeout_outcome
            if checks.outcome is not None:
                return checks.outcome
            if checks.waiting:
                checks.count(good=self._check(ud, checks.waiting.popleft()))
                continue
            wake.wait_until(until)

    def _check(self, ud: Any, message: Any) -> bool:
        try:
            return bool(self._cond_cb(ud, message))
        except Exception as error:  # noqa: BLE001  SMACH's rule: a broken check is not passed
            text = f"{type(error).__name__}: {error}"
            scope = self._scope()
            where = f"MonitorState {self._topic!r}" if scope is None else scope.path
            log.log_exception(f"{where}: condition {name_of(self._cond_cb)} raised {text}", error)
            if scope is not None:
                scope.emit(CallbackFailed, name_of(self._cond_cb), text)
            return False

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the topic, the condition and the limits."""
        kind, details = super().describe_details()
        own = [
            ("topic", self._topic),
            ("type", str(self._msg_type._type)),
            ("condition", name_of(self._cond_cb)),
        ]
        if self._max_checks > 0:
            own.append(("checks", str(self._max_checks)))
        if self._timeout_s is not None:
            own.append(("timeout", f"{self._timeout_s:g} s -> {self.timeout_outcome}"))
        return kind, (*own, *details)


class _Checks:
    """The messages of one run: what they have come to, and those that are still to be checked.

    Args:
        condition: Called with each message where it arrives; None: the state's thread checks them.
        wake: What the state's thread waits on.
        most: So many good messages are enough; -1: no limit.
        latest: Keep only the newest of those that wait.

    Attributes:
        waiting: Those that the state's thread is to check.
        outcome: What the state ends with; None: nothing yet.

    Threads: `note` on the network's; the rest belongs to the state's.
    """

    def __init__(
        self,
        condition: Callable[[Any], object] | None,
        wake: Wakeup,
        *,
        most: int,
        latest: bool,
    ) -> None:
        self.waiting: deque[Any] = deque(maxlen=1 if latest else None)
        self.outcome: str | None = None
        self._condition = condition
        self._most = most
        self._wake = wake
        self._good = 0

    def note(self, message: Any) -> None:
        """Take a message; wake the state's thread if it has to do something about it."""
        if self._condition is not None:
            if self.outcome is not None:
                return
            try:
                good = bool(self._condition(message))
            except Exception:  # noqa: BLE001  the state's thread calls it again, and reports it
                self._condition = None
            else:
                if self.count(good=good):
                    self._wake.set()
                return
        self.waiting.append(message)
        self._wake.set()

    def count(self, *, good: bool) -> bool:
        """Count an answer, in one of the two threads; tell whether it ends the state."""
        self._good += good
        if not good:
            self.outcome = "invalid"
        elif 0 < self._most <= self._good:
            self.outcome = "valid"
        return self.outcome is not None
