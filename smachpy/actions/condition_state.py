"""`ConditionState`: look at a condition until it is true."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.actions.interface import adopt_interface
from smachpy.actions.wakeup import Wakeup
from smachpy.machines.names import name_of
from smachpy.machines.problems import Problems
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import Unpack

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from smachpy.actions.interface import UntimedOptions
    from smachpy.introspection import Kind

__all__ = ["ConditionState"]

_SHORTEST_POLL_S = 0.001


class ConditionState(State):
    """Calls a function until it says yes. Outcomes: 'true', 'false', 'preempted'.

    Args:
        cond_cb: Called as `cond_cb(userdata)`; a true value ends the state with 'true'. Its
            `cb_interface` is added.
        input_keys: Userdata keys that it reads.
        poll_rate: Time between two checks [s], at least 1 ms.
        timeout: 'false' after so long [s]; None: no limit.
        max_checks: 'false' after so many checks; -1: no limit. 0 looks once, as 1 does.
        wake_on: Topics as pairs (name, message class): a message on one of them causes a check at
            once. With `poll_rate=None` nothing else does, past the first check.
        node: Where to listen; the current node when None.
        **options: See `StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong, or nothing would ever cause a check; all problems
            at once.
    """

    _smachpy_kind: ClassVar[Kind] = "condition"

    def __init__(
        self,
        cond_cb: Callable[..., object],
        input_keys: Iterable[str] = (),
        poll_rate: float | Duration | None = 0.05,
        timeout: float | Duration | None = None,
        max_checks: int = 1,
        *,
        wake_on: Iterable[tuple[str, Any]] = (),
        node: Node | None = None,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems(type(self).__name__)
        with problems:
            super().__init__(("true", "false", "preempted"), input_keys, **options)
        call = "cond_cb(userdata)"
        self.__cond_cb = problems.function("cond_cb", cond_cb, call, 1, optional=False)
        self._smachpy.code = (cond_cb,)
        poll_s = problems.seconds("poll_rate", poll_rate)
        self.__poll_s = None if poll_s is None else max(poll_s, _SHORTEST_POLL_S)
        self.__timeout_s = problems.seconds("timeout", timeout)
        expected = "-1 (no limit) or a number of checks"
        self.__max_checks = problems.whole("max_checks", max_checks, -1, expected)
        self.__wake_on = problems.values("wake_on", wake_on)
        for topic in self.__wake_on:
            if not (isinstance(topic, (tuple, list)) and len(topic) == 2):  # noqa: PLR2004  a pair
                problems.add(f"wake_on: got {topic!r} in it; expected (topic, message class).")
        if poll_rate is None and not self.__wake_on:
            problems.add(
                "poll_rate: got None without topics; expected seconds between two checks. Try "
                "wake_on=[(topic, message class)]."
            )
        self.__node = node
        problems.raise_all()
        adopt_interface(self, cond_cb, outcomes=False)

    def execute(self, ud: Any) -> str:
        """Check until it is true, time is up, enough was checked, or a preempt.

        What the condition raises goes through.

        Blocks: see above.
        """
        with Wakeup(self) as wake, contextlib.ExitStack() as listening:
            for topic, msg_type in self.__wake_on:
                listening.enter_context(_listen(topic, msg_type, wake, self.__node))
            return self.__watch(ud, wake)

    def __watch(self, ud: Any, wake: Wakeup) -> str:
        clock = wake.clock
        until = None if self.__timeout_s is None else clock.now() + self.__timeout_s
        checks = 0
        while True:
            wake.clear()
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            if checks and until is not None and clock.now() >= until:
                return "false"
            if self.__cond_cb(ud):
                return "true"
            checks += 1
            if self.__max_checks != -1 and checks >= self.__max_checks:
                return "false"
            due = None if self.__poll_s is None else clock.now() + self.__poll_s
            wake.wait_until(due, until)

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the condition and the limits."""
        kind, details = super().describe_details()
        own = [("condition", name_of(self.__cond_cb))]
        own += [("wakes on", topic) for topic, _ in self.__wake_on]
        if self.__timeout_s is not None:
            own.append(("timeout", f"{self.__timeout_s:g} s -> false"))
        if self.__max_checks != -1:
            own.append(("checks", str(max(1, self.__max_checks))))
        return kind, (*own, *details)


def _listen(
    topic: str, msg_type: Any, wake: Wakeup, node: Node | None
) -> contextlib.AbstractContextManager[object]:
    """Wake the state for each message; conditions that need no topic need no network either."""
    from actionlib_core.pubsub.topic import Subscriber

    return Subscriber(topic, msg_type, lambda _message: wake.set(), node=node)
