"""The network as one object that can be replaced: zenoh for robots, memory for tests.

A transport moves bytes under keys. It knows nothing of actions or messages. Every implementation
passes the suite in `tests/conformance`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable


class Sample(NamedTuple):
    """One message as it crossed the network.

    Attributes:
        key: The key it was put on, slashes between words, none in front.
        payload: The bytes.
        encoding: What the bytes are, in the sender's words; "" when it said nothing.
        source: Session id of the sender; "" when unknown.
        attachment: What the sender put beside the payload; None when nothing.
        stamp_ns: When it was sent, by the clock of a session on its way (`Config.timestamping`), to
            the microsecond [ns since the epoch]; 0 when nobody said. Only beside an attachment.
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
        key: The key that was asked; "" for an error.
        payload: The bytes; the text of an error.
        encoding: What the bytes are.
        error: It says why there is no answer.
        attachment: What the sender put beside the payload; None when nothing.
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
    """How a publisher's messages travel.

    Attributes:
        express: Send at once, never batched (goals, cancels, results).
        block: Wait for room rather than drop when the network is slower than the sender.
        latch: Keep the last message and give it to every subscriber that comes later.
        cache: Keep so many of the last messages, in the way of zenoh's advanced publishers, for
            subscribers that ask for them (`cached`); ROS 2 latches in this way.
    """

    express: bool = False
    block: bool = True
    latch: bool = False
    cache: int = 0


class Closable(Protocol):
    """Something declared on the network."""

    def close(self) -> None:
        """Undeclare it; a second call does nothing.

        No callback starts after it returned; one that runs in another thread may still be ending.
        """
        ...


class PublisherPort(Closable, Protocol):
    """The sending end of a key."""

    def put(self, payload: bytes, attachment: bytes | None = None) -> None:
        """Send `payload` to every subscriber of the key.

        Args:
            payload: The bytes.
            attachment: More bytes, which arrive beside the payload; not for a key that latches.

        Raises:
            TransportError: the transport is closed.
        """
        ...

    def matching(self) -> bool:
        """Tell whether any subscriber listens now."""
        ...


class Query(Protocol):
    """A question that a queryable answers, now or later, from any thread.

    It is open until `finish`; what is called on it after that does nothing. A session that ends
    finishes what it has not answered, and so does a queryable's callback that raises (its error is
    the answer then).
    """

    key: str
    payload: bytes
    encoding: str
    attachment: bytes | None

    def reply(self, payload: bytes, encoding: str = "", *, attachment: bytes | None = None) -> None:
        """Send an answer."""
        ...

    def reply_error(self, text: str) -> None:
        """Send an error; the asking side sees it as `Reply(error=True)`."""
        ...

    def finish(self) -> None:
        """End the exchange; the asking side's `on_done` fires when all queryables have finished."""
        ...


class Transport(Protocol):
    """One session on the network.

    Keys are exact here, without wildcards; only tokens are asked for by pattern.

    Threads: callbacks run on the transport's own threads, never inside a call of yours, in order
    per key and sender (those of different senders may overlap); they must be short and must not
    wait. They may call every method here, also for their own key. An exception that one lets
    through is given to `threading.excepthook`, and what it was about to get next still comes.

    Raises:
        TransportError: by every method but `close`: the session is closed, or a key is malformed.
    """

    @property
    def session_id(self) -> str:
        """This session's id: lower-case hexadecimal, unique on the network."""
        ...

    @property
    def rediscovery(self) -> float:
        """Longest time until a lost link that could be there again is there again [s]."""
        ...

    def publisher(self, key: str, encoding: str = "", quality: Quality = ...) -> PublisherPort:
        """Declare that this session sends on `key`."""
        ...

    def subscribe(
        self,
        key: str,
        callback: Callable[[Sample], None],
        *,
        history: bool = True,
        cached: int = 0,
    ) -> Closable:
        """Receive what is put on `key`, own puts included.

        Args:
            key: An exact key.
            callback: Gets each message.
            history: Ask latched publishers for their last message: one that was put before now
                comes first, once. False saves the asking where nobody latches.
            cached: Ask publishers with a cache (`Quality.cache`) for so many of their last
                messages, now and when one appears later; `history` counts as False then.
        """
        ...

    def queryable(
        self, key: str, callback: Callable[[Query], None], *, complete: bool = False
    ) -> Closable:
        """Answer the queries on `key`; each ends with `Query.finish`.

        Args:
            key: An exact key.
            callback: Gets each query.
            complete: It knows all there is to answer, so that a query for one (`best`) may come
                here and to nobody else.
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
        """Ask every queryable on `key`; `on_done` is called exactly once, after the last reply.

        It is called at once when there is no queryable, when all have finished, and when those that
        have not are known to be dead. Closing the query ends the interest: neither callback starts
        after that.

        Args:
            key: An exact key.
            payload: The question.
            encoding: What the payload is.
            attachment: More bytes beside the payload.
            best: Ask one complete queryable only, however many there are; all if none is complete.
            timeout: After this [s] the query is done, whoever has not answered.
            on_reply: Gets each answer.
            on_done: Hears that no more answers come.
        """
        ...

    def declare_alive(self, key: str) -> Closable:
        """Show a liveliness token on `key` until it is closed or this session dies."""
        ...

    def watch_alive(self, pattern: str, callback: Callable[[Presence], None]) -> Closable:
        """Hear of tokens matching `pattern`: those that exist now first, then every change.

        A token that several declare appears with the first of them and vanishes with the last.

        Args:
            pattern: A key in which `*` stands for one word and `**` for any number of words;
                neither stands for a word that begins with `@`.
            callback: Gets each token that appears or vanishes.
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
