"""The interface of the network: Zenoh for robots, a network in memory for tests.

A transport sends bytes under keys and knows nothing of actions or messages. Every implementation
passes the tests in `tests/conformance`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable


class Sample(NamedTuple):
    """One received message.

    Attributes:
        key: Its key: words with slashes between them, without a leading slash.
        payload: The bytes.
        encoding: The sender's description of the bytes; "" without one.
        source: Session id of the sender; "" when unknown.
        attachment: Further bytes beside the payload, or None.
        stamp_ns: When it was sent, by the clock of a session on its way that stamps messages
            (`Config.timestamping`), to the microsecond [ns since the epoch]; 0 without a stamp.
            Only set for messages with an attachment.
    """

    key: str
    payload: bytes
    encoding: str
    source: str
    attachment: bytes | None = None
    stamp_ns: int = 0


class Presence(NamedTuple):
    """A liveliness token that appeared or vanished."""

    key: str
    alive: bool


class Reply(NamedTuple):
    """An answer to a query.

    Attributes:
        key: The query's key; "" for an error.
        payload: The bytes; the text of an error.
        encoding: The sender's description of the bytes.
        error: Whether it is an error.
        attachment: Further bytes beside the payload, or None.
        source: Session id of the sender; "" when unknown.
    """

    key: str
    payload: bytes
    encoding: str
    error: bool
    attachment: bytes | None = None
    source: str = ""


@dataclass(frozen=True, slots=True)
class Quality:
    """The delivery options of a publisher.

    Attributes:
        express: Send at once, never batched (goals, cancels, results).
        block: Block while a link is full rather than drop the message.
        latch: Keep the last message and send it to every later subscriber.
        cache: Number of last messages to keep, in the way of Zenoh's advanced publishers, for
            subscribers that ask for them (`cached`). ROS 2 latches in this way.
    """

    express: bool = False
    block: bool = True
    latch: bool = False
    cache: int = 0


class Closable(Protocol):
    """Something declared on the network."""

    def close(self) -> None:
        """Undeclare it; a second call does nothing.

        No callback starts after this has returned; one in another thread may still be running.
        """
        ...


class PublisherPort(Closable, Protocol):
    """The sending end of a key."""

    def put(self, payload: bytes, attachment: bytes | None = None) -> None:
        """Send `payload` to every subscriber of the key.

        Args:
            payload: The bytes.
            attachment: Further bytes beside the payload; not for a publisher that latches.

        Raises:
            TransportError: the transport is closed.
        """
        ...

    def matching(self) -> bool:
        """Return whether there is a subscriber now."""
        ...


class Query(Protocol):
    """A query that a queryable answers, now or later, from any thread.

    It is open until `finish`; calls after that do nothing. A session that ends finishes its open
    queries. So does a queryable's callback that raises; its error is then sent as the answer.
    """

    key: str
    payload: bytes
    encoding: str
    attachment: bytes | None

    def reply(self, payload: bytes, encoding: str = "", *, attachment: bytes | None = None) -> None:
        """Send an answer."""
        ...

    def reply_error(self, text: str) -> None:
        """Send an error, which arrives as `Reply(error=True)`."""
        ...

    def finish(self) -> None:
        """End the answer; `on_done` is called when all queryables have done so."""
        ...


class Transport(Protocol):
    """One session on the network.

    Keys are exact, without wildcards; only tokens are matched with patterns.

    Threads: callbacks run on the transport's own threads, never inside a call of yours, in order
    per key and sender (those of different senders may overlap). They must be short and must not
    block, and may call every method here, also for their own key. An exception in a callback is
    passed to `threading.excepthook`; the next items are delivered all the same.

    Raises:
        TransportError: by every method except `close`: the session is closed, or a key is
            malformed.
    """

    @property
    def session_id(self) -> str:
        """This session's id: lower-case hexadecimal, unique on the network."""
        ...

    @property
    def rediscovery(self) -> float:
        """Longest time in which a lost link is restored once the network allows it [s]."""
        ...

    @property
    def lost_link(self) -> str:
        """What connects this session with all others, while that is lost; else "".

        For example "router tcp/robot:7447". Of a peer this is never known, as it has many links.
        """
        ...

    @property
    def is_linked(self) -> bool:
        """Whether this session has found any other one, which may have announced nothing yet."""
        ...

    @property
    def link_delay(self) -> float:
        """A lost link is known this long after the tokens behind it have vanished [s]."""
        ...

    @property
    def is_local(self) -> bool:
        """Whether all programs of the network run on this computer and share its clocks."""
        ...

    def publisher(
        self, key: str, encoding: str = "", quality: Quality = ..., *, kept: bytes | None = None
    ) -> PublisherPort:
        """Declare a publisher of `key`.

        `kept` is the message that one that latches has already: it is not sent, but all who
        subscribe with history get it.
        """
        ...

    def subscribe(
        self,
        key: str,
        callback: Callable[[Sample], None],
        *,
        history: bool = True,
        cached: int = 0,
    ) -> Closable:
        """Receive the messages on `key`, also this session's own.

        Args:
            key: An exact key.
            callback: Called with each message.
            history: Query latched publishers for their last message: one that was sent earlier
                comes first, and only once. False spares the queries where nothing is latched.
            cached: Number of last messages to request from publishers with a cache
                (`Quality.cache`), now and when one appears later; then `history` has no effect.
        """
        ...

    def queryable(
        self, key: str, callback: Callable[[Query], None], *, complete: bool = False
    ) -> Closable:
        """Answer the queries on `key`; each ends with `Query.finish`.

        Args:
            key: An exact key.
            callback: Called with each query.
            complete: It has the whole answer, so that a query for one answer (`best`) may be sent
                to it alone.
        """
        ...

    def query(
        self,
        key: str,
        payload: bytes,
        *,
        encoding: str = "",
        attachment: bytes | None = None,
        best: bool = False,
        timeout: float,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> Closable:
        """Query every queryable on `key`; `on_done` is called exactly once, after the last reply.

        It is called as soon as there is no queryable, all have finished, or those that have not are
        known to be dead. After the query was closed, neither callback starts any more.

        Args:
            key: An exact key.
            payload: The bytes of the query.
            encoding: Description of the payload.
            attachment: Further bytes beside the payload.
            best: Query only one of the complete queryables; all queryables if none is complete.
            timeout: After this time [s] the query is done, even if answers are missing.
            on_reply: Called with each answer.
            on_done: Called when no more answers come.
        """
        ...

    def declare_alive(self, key: str) -> Closable:
        """Declare a liveliness token on `key`, until it is closed or this session dies."""
        ...

    def watch_alive(self, pattern: str, callback: Callable[[Presence], None]) -> Closable:
        """Watch the tokens that match `pattern`: first the present ones, then every change.

        A token that several sessions declare appears with the first and vanishes with the last.

        Args:
            pattern: A key in which `*` matches one word and `**` any number of words; neither
                matches a word that begins with `@`.
            callback: Called with each token that appears or vanishes.
        """
        ...

    def list_alive(self, pattern: str, timeout: float) -> list[str]:
        """Return the keys of the tokens that match `pattern` now.

        Blocks: until the network has answered, `timeout` [s] at most.
        """
        ...

    def close(self) -> None:
        """Undeclare everything and leave the network; a second call does nothing.

        Blocks: under a second. No callback runs after it returned.
        """
        ...
