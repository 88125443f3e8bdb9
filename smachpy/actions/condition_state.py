"""`ConditionState`: check a condition until it is true."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.actions.interface import adopt_interface
from smachpy.actions.wakeup import Wakeup, answer_preempt
from smachpy.base.functions import name_of, no_coroutine
from smachpy.base.problems import Problems
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import Unpack

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from smachpy.actions.interface import UntimedOptions
    from smachpy.base.names import Names
    from smachpy.events.introspection import Kind

__all__ = ["ConditionState"]

_SHORTEST_POLL_S = 0.001


class ConditionState(State):
    """Calls a function until it returns a true value. Outcomes: 'true', 'false', 'preempted'.

    Args:
        cond_cb: Called as `cond_cb(userdata)`; a true value ends the state with 'true'. Its
            `cb_interface` is added.
        input_keys: Userdata keys that it reads.
        poll_rate: Time between two checks [s], at least 1 ms.
        timeout: Time after which it ends with 'false' [s]; None for no limit.
        max_checks: Number of checks after which it ends with 'false'; -1 for no limit. 0 checks
            once, like 1.
        wake_on: Topics as pairs (name, message class): each message causes a check at once. With
            `poll_rate=None` only messages do, after the first check.
        node: Node that subscribes to them; None for the current node.
        **options: See `StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong, or nothing would ever cause a second check; all
            problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "condition"

    def __init__(
        self,
        cond_cb: Callable[..., object],
        input_keys: Names = (),
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
            else:
                problems.network_name("wake_on", topic[0])
        if poll_rate is None and not self.__wake_on:
            problems.add(
                "poll_rate: got None without topics; expected seconds between two checks. Try "
                "wake_on=[(topic, message class)]."
            )
        self.__node = node
        problems.raise_all()
        adopt_interface(self, cond_cb, outcomes=False)

    def execute(self, ud: Any) -> str:
        """Check until the condition is true, a limit is reached, or a preempt arrives.

        An exception of the condition is passed on.

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
            wake.clear()  # first, so that a message that comes during the check causes another one
            if answer_preempt(self):
                return "preempted"
            if checks and until is not None and clock.now() >= until:
                return "false"
            if no_coroutine(self.__cond_cb(ud)):
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
    """Return a subscriber that wakes the state for each message."""
    # Imported here: a condition without topics needs no network.
    from actionlib_core.pubsub.topic import Subscriber

    return Subscriber(topic, msg_type, lambda _message: wake.set(), node=node)
