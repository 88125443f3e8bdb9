"""The declarations of a Zenoh session: publishers, subscribers, queryables, queries, tokens.

Each keeps its Zenoh objects until it is closed, so that no finalizer undeclares anything.
"""

from __future__ import annotations

import contextlib
import logging
import struct
import threading
from datetime import UTC, datetime, timedelta
from functools import partial
from threading import get_ident
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import zenoh
import zenoh.ext

from actionlib_core.clock._ending import ending
from actionlib_core.exceptions import TransportError
from actionlib_core.transport import Presence, Quality, Reply, Sample
from actionlib_core.transport._inlet import Inlet, inside
from actionlib_core.transport._keys import is_for_another_key, key_mark
from actionlib_core.transport.zenoh._callbacks import direct
from actionlib_core.transport.zenoh._process import process

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.transport import Query
    from actionlib_core.transport.zenoh import ZenohTransport

T = TypeVar("T")

log = logging.getLogger("actionlib_core")

LATCH_RETRIES = 5  # queries to a latched publisher that cannot be reached yet
LATCH_RETRY_S = 0.1  # between them
LATCHED_REMEMBERED = 1000  # latched publishers whose last numbers a subscriber remembers
HEARTBEAT_S = 0.5  # interval in which publishers with a cache send their last number, as in ROS 2
_EPOCH = datetime.fromtimestamp(0, UTC)
_MICROSECOND = timedelta(microseconds=1)
_PLAIN = "zenoh/bytes"  # Zenoh's encoding of a payload without one
_ERROR = "smachpy/error"  # distinguishes `reply_error` from the errors of Zenoh itself


kept: list[Any] = []
"""Objects that were let go as the interpreter exits, kept alive for good.

A thread that drops the last reference to an object of Zenoh releases the GIL for a moment, and must
not ask for it again after the interpreter's end.
"""


class _Undeclarable(Protocol):
    def undeclare(self) -> Any: ...


class Declared:
    """A declaration of a session, which keeps it until it is closed."""

    def __init__(self, transport: ZenohTransport) -> None:
        self._transport = transport
        self._inlet = Inlet(transport.gate, transport.loopback)
        self._handles: list[_Undeclarable] = []

    def _keep(self, *handles: _Undeclarable) -> None:
        self._handles.extend(handles)

    def close(self) -> None:
        self._inlet.closed = True
        if not self._transport.forget(self):
            return
        self._before_close()
        try:
            # It frees the objects within `inside`, too: that releases the GIL for a moment.
            with inside:
                while self._handles:
                    # It fails only if the session was closed meanwhile, which undeclares all.
                    with contextlib.suppress(zenoh.ZError):
                        self._handles.pop().undeclare()
                self._free()
        except TransportError:
            kept.append(self)

    def _before_close(self) -> None:
        """Do what comes before it is undeclared; called once."""

    def _free(self) -> None:
        """Drop further references to Zenoh's objects."""


class Publisher(Declared):
    """The sending end of a key."""

    def __init__(
        self, transport: ZenohTransport, key: str, encoding: str, quality: Quality
    ) -> None:
        super().__init__(transport)
        self._key = key
        blocking = zenoh.CongestionControl.BLOCK
        dropping = zenoh.CongestionControl.DROP
        self._port = transport.session.declare_publisher(
            key,
            encoding=encoding or None,
            express=quality.express,
            congestion_control=blocking if quality.block else dropping,
        )
        self._source = zenoh.SourceInfo(self._port.id, key_mark(key))
        self._users: list[None] = []  # one per call in progress; list operations are atomic
        self._keep(self._port)

    def close(self) -> None:
        # Zenoh refuses to undeclare what another thread is using: then its last user does it.
        self._inlet.closed = True
        if not self._users:
            super().close()

    def _free(self) -> None:
        del self._port  # nobody uses it once this is closed

    def _check_open(self) -> None:
        process.check(self._key)
        if self._inlet.closed:
            ending.slow_down()
            raise TransportError(
                f"{self._key}: the publisher is closed. Try sending before the node is closed."
            )
        inside.check_late(get_ident())

    def put(self, payload: bytes, attachment: bytes | None = None) -> None:
        # Before counting as inside, or a thread that keeps sending would delay the exit for good.
        if self._inlet.closed:
            self._check_open()
        self._users.append(None)
        depths, me = inside.depths, get_ident()
        depth = depths.get(me, 0)
        depths[me] = depth + 1  # `with inside`, written out: takes half the time
        try:
            if self._inlet.closed or process.forked or inside.ended_by:
                self._check_open()
            self._send(payload, attachment)
        except zenoh.ZError as error:
            raise TransportError(f"{self._key}: cannot send: {error}") from error
        finally:
            if depth:
                depths[me] = depth
            else:
                del depths[me]
            self._users.pop()
            if self._inlet.closed:
                self.close()

    def _send(self, payload: bytes, attachment: bytes | None) -> None:
        # The mark is for our own programs. ROS 2 programs, whose messages have an attachment, use
        # this number in their own way.
        source = self._source if attachment is None else None
        self._port.put(payload, source_info=source, attachment=attachment)

    def matching(self) -> bool:
        process.check(self._key)
        self._users.append(None)
        try:
            with inside:
                if self._inlet.closed:
                    return False
                # Queried each time (2 us): a listener would be notified too late.
                status: Any = self._port.matching_status  # zenoh's stub says bool
                return bool(status.matching)
        except (zenoh.ZError, TransportError):  # the session is closed, or the interpreter exits
            return False
        finally:
            self._users.pop()
            if self._inlet.closed:
                self.close()


# A latched publisher's messages have two numbers: that of the publisher in its session and their
# own, counted from 1 (0: the answer to a query before the first message). A subscriber gets the
# last message live, by a query, or in both ways and any order. (The advanced publishers of
# zenoh.ext keep a last message too, but without our source information, so without the key's mark.)
_NUMBERS = struct.Struct("<IQ")


def _pack_numbers(publisher: int, message: int) -> bytes:
    """Return the attachment of a latched message."""
    return _NUMBERS.pack(publisher, message)


class _LatchFilter:
    """Drops the second copy of a message that came both live and by a query.

    It remembers the publishers that it has heard last: each start of a program has new ones, and
    anybody can invent some.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        # By publisher: the number of the newest message, and of the one delivered from a query.
        self._numbers: dict[tuple[str, int], tuple[int, int]] = {}

    def take_live(self, session: str, numbers: bytes) -> bool:
        """Return whether a live message is to be delivered."""
        who, message = _unpack(session, numbers)
        with self._lock:
            newest, asked = self._numbers.pop(who, (0, 0))
            self._note(who, max(message, newest), asked)
            return message > asked

    def take_asked(self, session: str, numbers: bytes) -> bool:
        """Return whether the answer of a latched publisher is to be delivered."""
        if len(numbers) != _NUMBERS.size:
            return False
        who, message = _unpack(session, numbers)
        with self._lock:
            newest, asked = self._numbers.pop(who, (0, 0))
            is_new = message > newest  # else it came live before, or nothing was published yet
            self._note(who, max(message, newest), message if is_new else asked)
            return is_new

    def _note(self, who: tuple[str, int], newest: int, asked: int) -> None:
        self._numbers[who] = newest, asked
        if len(self._numbers) > LATCHED_REMEMBERED:
            del self._numbers[next(iter(self._numbers))]  # the one not heard for longest


def _unpack(session: str, numbers: bytes) -> tuple[tuple[str, int], int]:
    publisher, message = _NUMBERS.unpack(numbers)
    return (session, int(publisher)), int(message)


class LatchedPublisher(Publisher):
    """Keeps its last message and answers queries for it on a key of its own.

    The key is `<key>/@latch/<session>/<n>`; a token on it announces it to subscribers. Every
    message has `n` and its own number as attachment, so that a subscriber that gets it both live
    and by a query recognises the copy.
    """

    def __init__(
        self,
        transport: ZenohTransport,
        key: str,
        encoding: str,
        quality: Quality,
        *,
        kept: bytes | None = None,
    ) -> None:
        super().__init__(transport, key, encoding, quality)
        self._number = next(transport.numbers)
        self._encoding = encoding
        # Held while it sends: the last message that others hear is the one that is kept. Reentrant,
        # as a signal's handler may publish while this thread does.
        self._lock = threading.RLock()
        self._count = int(kept is not None)
        self._last: tuple[bytes, bytes] = kept or b"", _pack_numbers(self._number, self._count)
        self._own_key = f"{key}/@latch/{transport.session_id}/{self._number}"
        session = transport.session
        self._keep(session.declare_queryable(self._own_key, direct(self._on_query)))
        self._keep(session.liveliness().declare_token(self._own_key))

    def put(self, payload: bytes, attachment: bytes | None = None) -> None:
        with self._lock:
            self._count += 1
            attachment = _pack_numbers(self._number, self._count)
            self._last = payload, attachment
            super().put(payload, attachment)

    def _send(self, payload: bytes, attachment: bytes | None) -> None:
        self._port.put(payload, source_info=self._source, attachment=attachment)

    def _on_query(self, query: zenoh.Query) -> None:
        # Without the inlet: this calls no callback and takes no lock, so it may run inline.
        with query:
            payload, attachment = self._last
            query.reply(
                self._own_key, payload, encoding=self._encoding or None, attachment=attachment
            )


class CachingPublisher(Publisher):
    """Keeps its last messages in the way of Zenoh's advanced publishers.

    The plain publisher of the base class sends nothing here; it only serves `matching`.
    """

    def __init__(
        self, transport: ZenohTransport, key: str, encoding: str, quality: Quality
    ) -> None:
        super().__init__(transport, key, encoding, quality)
        blocking, dropping = zenoh.CongestionControl.BLOCK, zenoh.CongestionControl.DROP
        self._cache = zenoh.ext.declare_advanced_publisher(
            transport.session,
            key,
            encoding=encoding or None,
            express=quality.express,
            congestion_control=blocking if quality.block else dropping,
            cache=zenoh.ext.CacheConfig(quality.cache),
            publisher_detection=True,
            sample_miss_detection=zenoh.ext.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=HEARTBEAT_S
            ),
        )
        self._keep(self._cache)

    def _free(self) -> None:
        super()._free()
        del self._cache

    def _send(self, payload: bytes, attachment: bytes | None) -> None:
        self._cache.put(payload, attachment=attachment)


class Subscriber(Declared):
    """Receives a key, and the last messages of its publishers that latch or have a cache."""

    def __init__(
        self,
        transport: ZenohTransport,
        key: str,
        callback: Callable[[Sample], None],
        *,
        history: bool,
        cached: int = 0,
    ) -> None:
        super().__init__(transport)
        self._key = key
        self._mark = key_mark(key)
        self._callback = callback
        self._filter = _LatchFilter() if history and not cached else None
        self._encoding = zenoh.Encoding("")
        self._encoding_text = ""
        self._latched: set[str] = set()
        session = transport.session
        if cached:
            subscriber: _Undeclarable = zenoh.ext.declare_advanced_subscriber(
                session,
                key,
                direct(self._on_sample),
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=cached),
                recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
                subscriber_detection=True,
            )
        else:
            subscriber = session.declare_subscriber(key, direct(self._on_sample))
        self._keep(subscriber)
        if self._filter is not None:
            tokens = session.liveliness().declare_subscriber(
                f"{key}/@latch/*/*", direct(self._on_token), history=True
            )
            self._keep(tokens)

    def _on_sample(self, raw: zenoh.Sample) -> None:
        self._inlet.take(self._deliver, raw)

    def _deliver(self, raw: zenoh.Sample) -> None:
        payload = raw.payload.to_bytes()
        if not payload and raw.kind != zenoh.SampleKind.PUT:  # a Zenoh delete, which we never send
            return
        info = raw.source_info
        if _is_astray(info, self._mark, self._key):
            return
        encoding = raw.encoding
        if encoding != self._encoding:  # comparing is cheaper than converting to text
            self._encoding_text = _convert_encoding(encoding)
            self._encoding = encoding
        source = "" if info is None else str(info.source_id.zid)
        raw_attachment = raw.attachment
        if raw_attachment is None:
            self._callback(Sample(self._key, payload, self._encoding_text, source))
            return
        numbers = raw_attachment.to_bytes()
        attachment: bytes | None = numbers
        if self._filter is not None and len(numbers) == _NUMBERS.size:
            if not self._filter.take_live(source, numbers):
                return
            attachment = None
        stamp_ns = _convert_time(raw.timestamp)
        self._callback(
            Sample(self._key, payload, self._encoding_text, source, attachment, stamp_ns)
        )

    def _on_token(self, token: zenoh.Sample) -> None:
        self._inlet.take(self._note_token, token)

    def _note_token(self, token: zenoh.Sample) -> None:
        key = str(token.key_expr)
        if token.kind == zenoh.SampleKind.PUT:
            self._latched.add(key)
            self._ask(key, LATCH_RETRIES)
        else:
            self._latched.discard(key)

    def _ask(self, key: str, retries: int) -> None:
        if self._inlet.closed or key not in self._latched:
            return
        answered: list[bool] = []

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                answered.append(True)
                self._inlet.take(self._deliver_last, reply.ok)

        def on_done() -> None:
            if not answered and retries:
                again = partial(self._ask, key, retries - 1)
                # Not in the timers' thread: a query waits while a link is full.
                later = partial(self._transport.loopback.submit, again)
                self._transport.clock.call_later(LATCH_RETRY_S, later)

        self._transport.ask(key, on_reply, on_done)

    def _deliver_last(self, raw: zenoh.Sample) -> None:
        source = str(raw.key_expr).rsplit("/", 2)[1]
        numbers = b"" if raw.attachment is None else raw.attachment.to_bytes()
        if self._filter is not None and self._filter.take_asked(source, numbers):
            encoding = _convert_encoding(raw.encoding)
            self._callback(Sample(self._key, raw.payload.to_bytes(), encoding, source))


class ZenohQuery:
    """A query to a queryable of ours."""

    __slots__ = ("_lock", "_raw", "attachment", "encoding", "key", "payload")

    def __init__(self, raw: zenoh.Query) -> None:
        self._raw: zenoh.Query | None = raw
        self._lock = threading.Lock()
        self.key = str(raw.key_expr)
        self.payload = b"" if raw.payload is None else raw.payload.to_bytes()
        self.encoding = "" if raw.encoding is None else _convert_encoding(raw.encoding)
        self.attachment = _convert_attachment(raw.attachment)

    def reply(self, payload: bytes, encoding: str = "", *, attachment: bytes | None = None) -> None:
        raw = self._raw
        if raw is not None:
            # Finished, or the caller is gone, or the interpreter exits.
            with contextlib.suppress(zenoh.ZError, TransportError), inside:
                raw.reply(
                    self.key,
                    payload,
                    encoding=encoding or None,
                    attachment=attachment,
                    express=True,
                )

    def reply_error(self, text: str) -> None:
        raw = self._raw
        if raw is not None:
            with contextlib.suppress(zenoh.ZError, TransportError), inside:
                raw.reply_err(text.encode(), encoding=_ERROR)

    def finish(self) -> None:
        with self._lock:
            raw, self._raw = self._raw, None
        if raw is None:
            return
        try:
            with inside:
                raw.drop()  # type: ignore[no-untyped-call]  # zenoh's stub
                raw = None  # within `inside`, as freeing it releases the GIL once more
        except TransportError:
            kept.append(raw)


class Queryable(Declared):
    """Answers queries."""

    def __init__(
        self,
        transport: ZenohTransport,
        key: str,
        callback: Callable[[Query], None],
        *,
        complete: bool = False,
    ) -> None:
        super().__init__(transport)
        self._key = key
        self._mark = key_mark(key)
        self._callback = callback
        queries = direct(self._on_query)
        self._keep(transport.session.declare_queryable(key, queries, complete=complete))

    def _on_query(self, raw: zenoh.Query) -> None:
        self._inlet.take(self._answer, raw, self._refuse)

    @staticmethod
    def _refuse(raw: zenoh.Query) -> None:
        ZenohQuery(raw).finish()

    def _answer(self, raw: zenoh.Query) -> None:
        if _is_astray(raw.source_info, self._mark, self._key):
            self._refuse(raw)
            return
        query = ZenohQuery(raw)
        try:
            self._callback(query)
        except Exception as error:
            query.reply_error(f"{type(error).__name__}: {error}")
            query.finish()
            raise


class Asking(Declared):
    """A running query of this session."""

    def __init__(
        self,
        transport: ZenohTransport,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> None:
        super().__init__(transport)
        self._on_reply = on_reply
        self._on_done = on_done
        self._replying: int | None = None  # id of the thread that is in `on_reply`
        self._answered = False
        # Dropped at the end: it refers to the callbacks, which refer to this object, a cycle.
        self.token: zenoh.CancellationToken | None = zenoh.CancellationToken()

    def take_reply(self, raw: zenoh.Reply) -> None:
        self._inlet.take(self._deliver, raw)

    def take_done(self) -> None:
        if self._answered:
            self._inlet.take(self._finish, None)
        else:  # may come from a lost link: Zenoh then holds a lock that any call of ours needs
            self._transport.loopback.submit(partial(self._inlet.take, self._finish, None))

    def _deliver(self, raw: zenoh.Reply) -> None:
        reply = _convert_reply(raw)
        if reply is not None:
            self._answered = True
            self._replying = get_ident()
            try:
                self._on_reply(reply)
            finally:
                self._replying = None

    def _finish(self, _: None) -> None:
        self.token = None
        if self._transport.forget(self):
            self._on_done()

    def close(self) -> None:
        self._inlet.closed = True
        token, self.token = self.token, None
        if self._transport.forget(self) and token is not None:
            # Cancelling waits for running callbacks, and so would wait for itself inside one.
            if self._replying == get_ident():
                self._transport.loopback.submit(partial(_cancel, token))
            else:
                _cancel(token)


def _cancel(token: zenoh.CancellationToken) -> None:
    try:
        with inside:
            token.cancel()  # type: ignore[no-untyped-call]  # zenoh's stub
    except TransportError:
        kept.append(token)


class Watcher(Declared):
    """Watches tokens."""

    def __init__(
        self, transport: ZenohTransport, pattern: str, callback: Callable[[Presence], None]
    ) -> None:
        super().__init__(transport)
        self._callback = callback
        self._alive: set[str] = set()
        tokens = transport.session.liveliness().declare_subscriber(
            pattern, direct(self._on_token), history=True
        )
        self._keep(tokens)

    def _on_token(self, raw: zenoh.Sample) -> None:
        self._inlet.take(self._deliver, raw)

    def _deliver(self, raw: zenoh.Sample) -> None:
        key = str(raw.key_expr)
        alive = raw.kind == zenoh.SampleKind.PUT
        if alive != (key in self._alive):  # Zenoh may report one state twice
            (self._alive.add if alive else self._alive.discard)(key)
            self._callback(Presence(key, alive))


class Links(Declared):
    """The links of the session.

    Attributes:
        open: The ids of the sessions at their other ends.
    """

    def __init__(self, transport: ZenohTransport) -> None:
        super().__init__(transport)
        self.open: set[str] = set()
        listener = transport.session.info.declare_transport_events_listener(
            direct(self._on_event), history=True
        )
        self._keep(listener)

    def _on_event(self, event: zenoh.TransportEvent) -> None:
        # Without the inlet: this calls no callback and takes no lock, so it may run inline.
        change = self.open.add if event.kind == zenoh.SampleKind.PUT else self.open.discard
        change(str(event.transport.zid))


class Token(Declared):
    """A liveliness token."""

    def __init__(self, transport: ZenohTransport, key: str) -> None:
        super().__init__(transport)
        self._key = key
        # Before the network can tell the watches of this session, which else take this token for
        # the former one of its name, of whose end they have not heard.
        transport.watches.note_own(key, 1)
        try:
            self._keep(transport.session.liveliness().declare_token(key))
        except BaseException:
            transport.watches.note_own(key, -1)
            raise

    def _before_close(self) -> None:
        self._transport.watches.note_own(self._key, -1)


def _convert_encoding(raw: zenoh.Encoding) -> str:
    text = str(raw)
    return "" if text == _PLAIN else text


def _convert_attachment(raw: zenoh.ZBytes | None) -> bytes | None:
    return None if raw is None else raw.to_bytes()


def _convert_time(raw: zenoh.Timestamp | None) -> int:
    """Return a timestamp in ns since the epoch, 0 for None; Zenoh gives it in microseconds."""
    return 0 if raw is None else (raw.get_time() - _EPOCH) // _MICROSECOND * 1000


def _is_astray(info: zenoh.SourceInfo | None, mark: int, key: str) -> bool:
    """Return whether a message or query was sent on another key than `key`; see `key_mark`."""
    if info is None or not is_for_another_key(info.source_sn, mark):
        return False
    log.warning(
        "%s: dropped a message of session %s that was sent on another key: its link was just lost "
        "or restored.",
        key,
        info.source_id.zid,
    )
    return True


def _convert_reply(raw: zenoh.Reply) -> Reply | None:
    """Return an answer; None for an error of Zenoh itself, such as a timeout."""
    good, replier = raw.ok, raw.replier_id
    source = "" if replier is None else str(replier.zid)
    if good is not None:
        encoding = _convert_encoding(good.encoding)
        attachment = _convert_attachment(good.attachment)
        payload = good.payload.to_bytes()
        return Reply(str(good.key_expr), payload, encoding, False, attachment, source)  # noqa: FBT003
    bad = raw.err
    if bad is None or str(bad.encoding) != _ERROR:
        return None
    return Reply("", bad.payload.to_bytes(), "", error=True, source=source)
