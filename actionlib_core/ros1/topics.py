"""One bridged topic, in both directions."""

from __future__ import annotations

import threading
from functools import partial
from typing import TYPE_CHECKING

from actionlib_core.ros1.sides import Typed, type_of
from actionlib_core.transport import Quality
from actionlib_core.transport.tokens import Kind

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from actionlib_core.ros1.definitions import Definitions
    from actionlib_core.ros1.frames import Header
    from actionlib_core.ros1.node import Publication, Subscription
    from actionlib_core.ros1.sides import Sides
    from actionlib_core.transport import Closable, Presence, Sample
    from actionlib_core.transport.tokens import Endpoint

LATCHED = "1"
LATCHED_S = 1.0  # a publisher sends what it has latched within this time
MAX_SENDERS = 64  # their last messages are kept, as it is not known at once who of them latches


class TopicBridge:
    """A topic on both networks.

    Each publisher in ROS 1 gets its own publisher and token on our network, with its node's name,
    so that each latched publisher keeps a message. All publishers on our network are one in ROS 1.

    Args:
        sides: The two networks.
        topic: Its name in ROS 1.
        definitions: Gets the definitions that publishers send.

    Threads: `look` and `close` from one thread.
    """

    def __init__(self, sides: Sides, topic: str, definitions: Definitions) -> None:
        self._sides = sides
        self._topic = topic
        self._key = sides.key(topic)
        self._definitions = definitions
        self._from_ros: Subscription | None = None
        self._to_ros: _ToRos | None = None

    def look(self, ends: Collection[Endpoint], *, listen: bool) -> None:
        """Update what is bridged.

        Args:
            ends: The endpoints of the topic on our network, without those of bridges.
            listen: Pass messages from ROS 1 to our network.
        """
        if listen and self._from_ros is None:
            self._from_ros = self._sides.ros.subscribe(self._topic, self._accept)
        elif not listen and self._from_ros is not None:
            self._from_ros.close()
            self._from_ros = None
        # A topic has one type in ROS 1. Keep the current one as long as a publisher here has it.
        types = sorted({Typed(end.type, end.md5) for end in ends if end.kind is Kind.PUBLISHER})
        if self._to_ros is not None and self._to_ros.typed not in types:
            self._to_ros.close()
            self._to_ros = None
        if types and self._to_ros is None:
            self._to_ros = _ToRos(self._sides, self._topic, types[0], self._definitions)

    def close(self) -> None:
        """End the bridge; does not wait."""
        for each in (self._from_ros, self._to_ros):
            if each is not None:
                each.close()

    def _accept(self, header: Header, was_there: bool) -> _FromRos:
        typed = type_of(header, self._topic)
        self._definitions.learn(typed, header.get("message_definition", ""))
        return _FromRos(self._sides, self._key, typed, header, was_there=was_there)


class _FromRos:
    """A publisher in ROS 1, shown on our network."""

    coalesce_s = 0.0

    def __init__(
        self, sides: Sides, key: str, typed: Typed, header: Header, *, was_there: bool
    ) -> None:
        latch = header.get("latching") == LATCHED
        quality = Quality(express=True, block=True, latch=latch)
        self._make = partial(sides.node.transport.publisher, key, typed.encoding, quality)
        # What it has latched before comes at once. Here it is kept, and is no news for those who
        # want no latched message, such as somebody who waits for an answer to a new question.
        self._port = None if latch and was_there else self._make()
        self._now, self._old_until = sides.ros.clock.now, sides.ros.clock.now() + LATCHED_S
        self._token = sides.show(Kind.PUBLISHER, key, typed, header.get("callerid", ""))

    def take(self, payload: bytes) -> None:
        """Pass a message on; blocks while a link is full: ROS 1 then buffers or drops messages."""
        if self._port is None:
            is_old = self._now() < self._old_until
            self._port = self._make(kept=payload if is_old else None)
            if is_old:
                return
        self._port.put(payload)

    def gone(self) -> None:
        """Withdraw the publisher."""
        self._token.close()
        if self._port is not None:
            self._port.close()


class _ToRos:
    """The publishers on our network, as one publisher in ROS 1."""

    def __init__(self, sides: Sides, topic: str, typed: Typed, definitions: Definitions) -> None:
        self.typed = typed
        self._sides = sides
        self._key = sides.key(topic)
        self._lock = threading.Lock()
        self._latched: dict[str, set[str]] = {}  # session -> keys of its latched publishers' tokens
        # Session -> its last message. The message of a latched publisher may arrive before its
        # token, so the last one of every session is kept.
        self._last: dict[str, bytes] = {}
        transport = sides.node.transport
        self._publication: Publication = sides.ros.advertise(
            topic, *typed, definitions.text(typed), latching=False, accept=self._accept
        )
        latches = transport.watch_alive(f"{self._key}/@latch/*/*", self._on_latch)
        self._parts: list[Closable] = [latches, transport.subscribe(self._key, self._on_sample)]

    def close(self) -> None:
        """Stop publishing; does not wait."""
        for part in self._parts:
            part.close()
        self._publication.close()

    def _on_latch(self, presence: Presence) -> None:
        """Note which sessions latch: later subscribers in ROS 1 get their last messages."""
        session = presence.key.rsplit("/", 2)[1]
        if session == self._sides.node.transport.session_id:
            return
        with self._lock:
            tokens = self._latched.setdefault(session, set())
            (tokens.add if presence.alive else tokens.discard)(presence.key)
            if not tokens:
                del self._latched[session]
            self._publication.latching = bool(self._latched)
            with self._publication.lock:
                if not tokens:
                    self._publication.kept.pop(session, None)
                elif session in self._last:
                    self._publication.kept[session] = self._last[session]

    def _on_sample(self, sample: Sample) -> None:
        if self._sides.is_own(sample) or not self._sides.fits(sample, self.typed):
            return
        source = sample.source
        with self._lock:
            self._last.pop(source, None)
            self._last[source] = sample.payload
            if len(self._last) > MAX_SENDERS:
                del self._last[next(iter(self._last))]
            keep = source if source in self._latched else None
            self._publication.put(sample.payload, keep=keep)

    def _accept(self, header: Header) -> Callable[[], object]:
        node = header.get("callerid", "")
        return self._sides.show(Kind.SUBSCRIBER, self._key, self.typed, node).close
