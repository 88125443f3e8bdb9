"""What crosses the border of this program, for recordings: goals, answers, messages, requests.

Clients, subscribers and services tell here what they send and what reaches the program's code.
Nobody listens in most programs: then nothing is made, and one comparison is the whole cost.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock
    from actionlib_core.node import Node

What: TypeAlias = Literal[
    "client",
    "server",
    "gone",
    "goal",
    "status",
    "feedback",
    "end",
    "cancel",
    "subscriber",
    "message",
    "published",
    "request",
    "response",
    "absent",
    "own",
    "asked",
    "once",
    "said",
]


class Crossing(NamedTuple):
    """Something that crossed the border.

    Attributes:
        what: "client": an action client was made; "server", "gone": its server is there, is gone;
            "goal", "cancel": were sent; "status", "feedback", "end": reached the client;
            "subscriber": was made; "message": its callback is called; "published": by the
            program itself; "request", "response": of a
            service that the program calls; "absent": a wait for a service was in vain; "own": a
            service is called in the program that offers it; "asked": a request to a service that
            the program offers; "once": a call of `smachpy.once` by the state `name` returned;
            "said": the condition of the state `name` said something else of a message than of
            the one before.
        name: Full name of the action, topic or service.
        type: Its type.
        key: The goal's id, the number of the subscriber or call, or the session of an action's
            client or server; the topic of what is said.
        t: When, by the node's clock [s].
        node: Full name of the node.
        value: The message, or None.
        state: Name of a goal's status, or of the class of an error; what is said, yes or no.
        text: The status text, or that of the error.
    """

    what: What
    name: str
    type: str
    key: str
    t: float
    node: str
    value: Any = None
    state: str = ""
    text: str = ""


Listener: TypeAlias = "Callable[[Crossing], object]"

listeners: tuple[Listener, ...] = ()
"""Those of this process. Clients look here first: `if border.listeners: border.tell(...)`."""

numbers = itertools.count(1)
"""Numbers of subscribers and calls; `next` is atomic."""


def listen(listener: Listener) -> Callable[[], None]:
    """Call `listener` with each crossing from now on; return a function that ends it.

    Threads: it is called in the thread of whoever sends or receives, which it must not block, and
        sometimes under locks: it may only store the crossing.
    """
    global listeners  # noqa: PLW0603  replaced as a whole: readers need no lock
    listeners = (*listeners, listener)

    def leave() -> None:
        global listeners  # noqa: PLW0603
        listeners = tuple(one for one in listeners if one is not listener)

    return leave


class Verdicts:
    """Tells the listeners what a state's condition says of messages, whenever that changes.

    Args:
        path: Path of the state.
        topic: The topic.
        clock: Of the run.
    """

    def __init__(self, path: str, topic: str, clock: Clock) -> None:
        self._path = path
        self._topic = topic
        self._clock = clock
        self._last: bool | None = None

    def note(self, message: Any, verdict: bool) -> None:
        """Tell what is said of a message."""
        if listeners and verdict != self._last:
            self._last = verdict
            kind, said = getattr(message, "_type", ""), "yes" if verdict else "no"
            now = self._clock.now()
            crossing = Crossing("said", self._path, kind, self._topic, now, "", message, said)
            for listener in listeners:
                listener(crossing)


def tell(
    what: What,
    node: Node,
    name: str,
    type_name: str,
    key: object,
    value: Any = None,
    state: str = "",
    text: str = "",
) -> None:
    """Tell all listeners; see `Crossing` for the arguments."""
    now, who = node.clock.now(), node.full_name
    crossing = Crossing(what, name, type_name, str(key), now, who, value, state, text)
    for listener in listeners:
        listener(crossing)
