# ruff: noqa: D102  the methods of a session are documented in the protocol
"""Zenoh as transport: the only package that imports zenoh.

Threads: Zenoh calls back on its own threads. What a session sends to itself, it delivers inside the
sending call; `Inlet` hands such an item to a thread of the transport, so that no callback ever runs
on the stack of a caller, who may hold locks.

Locks: each guards a few fields for a short time; none is held while Zenoh or a callback is called.

Nothing is left to finalizers: a session is kept alive here until it is closed, at the latest when
the interpreter exits.
"""

from __future__ import annotations

import atexit
import contextlib
import itertools
import json
import logging
import threading
import weakref
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import zenoh
from zenoh import handlers

from actionlib_core.clock import RealClock, SerialExecutor, current_clock
from actionlib_core.clock._ending import PART_S, ending
from actionlib_core.config import Config, load_config
from actionlib_core.exceptions import AccessDeniedError, TransportError
from actionlib_core.transport import Presence, Quality, Reply, Sample
from actionlib_core.transport._access import (
    ACCESS_KEY,
    Permissions,
    decode_permissions,
    decode_question,
    find_permissions,
)
from actionlib_core.transport._inlet import CallbackGate, inside
from actionlib_core.transport._keys import check_key, check_pattern, key_mark, key_matches
from actionlib_core.transport._refusal import check_interface, explain_refusal
from actionlib_core.transport._zenoh_config import (
    RETRY_S,
    SCOUT_S,
    is_local,
    new_session_id,
    zenoh_settings,
)
from actionlib_core.transport.zenoh._callbacks import direct, held
from actionlib_core.transport.zenoh._declared import (
    Asking,
    CachingPublisher,
    Declared,
    LatchedPublisher,
    Links,
    Publisher,
    Queryable,
    Subscriber,
    Token,
    kept,
)
from actionlib_core.transport.zenoh._process import process
from actionlib_core.transport.zenoh._shared import Watches

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.transport import Query

__all__ = ["ZenohTransport"]

D = TypeVar("D", bound=Declared)

log = logging.getLogger("actionlib_core")

CLOSE_S = 0.5  # longest wait for Zenoh to close a session; its thread is then left behind
LET_GO_S = 2.0  # longest wait at exit for running callbacks and calls; long on a busy computer only
LET_GO_PARTS = round(LET_GO_S / PART_S)
LINK_S = 0.03  # Zenoh reports the end of a link some 0.4 ms after that of the tokens behind it
IDLE_S = 0.3  # longest wait of `close` for running callbacks
ACCESS_S = 1.0  # longest wait for the other side's access rules
ASK_S = 5.0  # longest wait for a latched publisher's answer
DEFAULT = Quality()


class ZenohTransport:
    """A session on a Zenoh network.

    Args:
        config: How to join; None: the file in `SMACHPY_CONFIG`, else only this machine's loopback.

    Raises:
        ConfigError: the configuration has errors.
        TransportError: the network cannot be joined.

    Blocks: the constructor opens the session: `connect_timeout` plus `settle` of `config` at most.
    """

    def __init__(self, config: Config | None = None) -> None:
        self.config = load_config(config)
        clock = current_clock()
        self.clock = clock if isinstance(clock, RealClock) else RealClock()
        self.gate = CallbackGate()
        self.numbers = itertools.count(1)
        self._lock = threading.Lock()
        self._closed = False
        self._declared: dict[Declared, None] = {}
        self._permissions: Permissions | None = None
        self.watches = Watches(self)
        time_ns = round(self.clock.now() * 1e9) if self.is_local else self.clock.time_ns()
        self.session = _open(self.config, new_session_id(time_ns))
        self._session_id = str(self.session.zid())
        self.loopback = SerialExecutor(self.clock, f"transport-{self._session_id[:8]}")
        _loopbacks.add(self.loopback)
        _open_transports[self] = None
        self._links: Links | None = None
        if self.config.mode == "client":
            with inside:
                self._links = Links(self)
            self._declared[self._links] = None
        try:
            if self.config.access:
                self.queryable(ACCESS_KEY, self._send_permissions)
            if self.config.connect:
                self._permissions = self._ask_permissions()
        except BaseException:
            self.close()
            raise

    @property
    def session_id(self) -> str:
        """This session's id."""
        return self._session_id

    @property
    def rediscovery(self) -> float:
        """Zenoh's intervals: peers search every 8 s, clients try their router every second."""
        looks = self.config.mode == "peer" and self.config.discovery != "off"
        return SCOUT_S if looks else 2 * RETRY_S

    @property
    def lost_link(self) -> str:
        """The routers of a client, while it is linked with none of them."""
        if self._links is None or self._links.open:
            return ""
        return f"router {', '.join(self.config.connect)}"

    @property
    def is_linked(self) -> bool:
        """Whether there is any link, to a peer or a router."""
        return bool(self.session.info.links())

    @property
    def link_delay(self) -> float:
        """Of a client, the time until Zenoh reports the end of the link; of a peer 0."""
        return 0.0 if self._links is None else LINK_S

    @property
    def is_local(self) -> bool:
        """Whether this session listens and looks for others on the loopback interface only."""
        return is_local(self.config)

    @property
    def is_restricted(self) -> bool:
        """Whether access rules limit which names this session may watch."""
        return self._permissions is not None

    def publisher(
        self,
        key: str,
        encoding: str = "",
        quality: Quality = DEFAULT,
        *,
        kept: bytes | None = None,
    ) -> Publisher:
        kind: Callable[..., Publisher] = Publisher
        if quality.latch or quality.cache:
            kind = CachingPublisher if quality.cache else partial(LatchedPublisher, kept=kept)
        return self._declare(lambda: kind(self, check_key(key), encoding, quality), key)

    def subscribe(
        self,
        key: str,
        callback: Callable[[Sample], None],
        *,
        history: bool = True,
        cached: int = 0,
    ) -> Subscriber:
        make = partial(Subscriber, self, check_key(key), callback, history=history, cached=cached)
        return self._declare(make, key)

    def queryable(
        self, key: str, callback: Callable[[Query], None], *, complete: bool = False
    ) -> Queryable:
        make = partial(Queryable, self, check_key(key), callback, complete=complete)
        return self._declare(make, key)

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
    ) -> Asking:
        self._check_open(check_key(key))
        self._check_access(key)
        asking = Asking(self, on_reply, on_done)
        self.keep(asking)
        callback = direct(asking.take_reply, asking.take_done)
        try:
            self._get(
                key, callback, payload, encoding, timeout, asking.token, attachment, best=best
            )
        except TransportError:
            asking.close()
            raise
        return asking

    def ask(
        self, key: str, on_reply: Callable[[zenoh.Reply], None], on_done: Callable[[], None]
    ) -> None:
        """Send an empty query that cannot be closed; for the declarations of this session."""
        callback = direct(on_reply, on_done)
        try:
            self._get(key, callback, b"", "", ASK_S, None)
        except TransportError:
            if not self._closed:
                raise

    def _get(
        self,
        key: str,
        callback: handlers.Callback[zenoh.Reply],
        payload: bytes,
        encoding: str,
        timeout: float,
        token: zenoh.CancellationToken | None,
        attachment: bytes | None = None,
        *,
        best: bool = False,
    ) -> None:
        # The mark is for our own programs; see `Publisher`.
        mark = zenoh.SourceInfo(self.session.id, key_mark(key)) if attachment is None else None
        try:
            with inside:
                self.session.get(
                    key,
                    callback,
                    target=zenoh.QueryTarget.BEST_MATCHING if best else zenoh.QueryTarget.ALL,
                    consolidation=zenoh.ConsolidationMode.NONE,
                    timeout=timeout,
                    congestion_control=zenoh.CongestionControl.BLOCK,
                    express=True,
                    payload=payload,
                    encoding=encoding or None,
                    attachment=attachment,
                    source_info=mark,
                    cancellation_token=token,
                )
        except zenoh.ZError as error:
            raise TransportError(f"{key}: cannot ask: {error}") from error

    def declare_alive(self, key: str) -> Token:
        return self._declare(lambda: Token(self, check_key(key)), key)

    def watch_alive(self, pattern: str, callback: Callable[[Presence], None]) -> Declared:
        check_pattern(pattern)
        return self._declare(lambda: self.watches.new(pattern, callback), pattern)

    def list_alive(self, pattern: str, timeout: float) -> list[str]:
        check_pattern(pattern)
        self._check_open(pattern)
        known = self.watches.known(pattern)
        if known is not None:
            return known
        asked = self.watches.asks_for(pattern)
        found, is_complete = self._ask_alive(asked, timeout)
        if asked != pattern and is_complete:
            self.watches.answered(asked, found)
        return sorted(key for key in found if asked == pattern or key_matches(pattern, key))

    def _ask_alive(self, pattern: str, timeout: float) -> tuple[set[str], bool]:
        """Return the tokens that match a pattern, and whether the network has answered in time."""
        found: set[str] = set()
        done, freed = self.clock.event(), self.clock.event()

        def on_token(token: zenoh.Sample) -> None:
            there = token.kind == zenoh.SampleKind.PUT
            (found.add if there else found.discard)(str(token.key_expr))

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                found.add(str(reply.ok.key_expr))

        # Zenoh (1.10) omits from an answer the tokens that this session receives at the same time
        # for another of its subscribers. A subscriber with history gets those too, sometimes after
        # the end of the answer. It has got all when it was undeclared and Zenoh has freed its
        # callback.
        deadline = self.clock.now() + timeout
        try:
            with inside:
                liveliness = self.session.liveliness()
                history = [
                    liveliness.declare_subscriber(
                        pattern, direct(on_token, freed.set), history=True
                    )
                ]
                liveliness.get(pattern, direct(on_reply, done.set), timeout=timeout)
            done.wait(timeout)
            with inside:  # where it is freed, too, see `Declared.close`
                history.pop().undeclare()  # type: ignore[no-untyped-call]  # zenoh's stub
            freed.wait(max(0.0, deadline - self.clock.now()))
        except zenoh.ZError as error:
            raise TransportError(f"{pattern}: cannot ask: {error}") from error
        return found, done.is_set() and freed.is_set()

    def close(self) -> None:
        if process.forked:  # it is the parent's
            return
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self.gate.shut()  # first: from now on no callback starts
        _leave(self.clock, self.session)
        self.gate.wait_idle(IDLE_S)
        # Not earlier: once the session is closed, dropping Zenoh's objects has no side effects.
        if ending.begun:
            kept.extend(self._declared)
        self._declared.clear()
        _open_transports.pop(self, None)

    def keep(self, entry: Declared) -> None:
        """Keep an entry until it is closed."""
        with self._lock:
            self._declared[entry] = None

    def forget(self, entry: Declared) -> bool:
        """Remove an entry that is being closed; False when it was removed before."""
        if ending.begun:
            kept.append(entry)
        with self._lock:
            return self._declared.pop(entry, False) is None

    def _send_permissions(self, query: Query) -> None:
        try:
            session, user = decode_question(query.payload)
        except ValueError as error:  # anybody may ask
            query.reply_error(f"access rules: {error}")
        else:
            links = {str(link.zid): link.auth_identifier for link in self.session.info.links()}
            permissions = find_permissions(self.config.access, user, links.get(session) or "")
            query.reply(permissions.encode())
        query.finish()

    def _ask_permissions(self) -> Permissions | None:
        """Return our permissions on the other side, None when it has no rules.

        Blocks: for one exchange, `ACCESS_S` at most.
        """
        answers: list[Reply] = []
        done = self.clock.event()
        question = {"session": self._session_id, "user": self.config.user}
        asking = self.query(
            ACCESS_KEY,
            json.dumps(question).encode(),
            timeout=ACCESS_S,
            on_reply=answers.append,
            on_done=done.set,
        )
        done.wait(ACCESS_S)
        asking.close()
        with inside:
            others = {str(link.zid) for link in self.session.info.links()}
        for reply in answers:
            if not reply.error and reply.source in others:  # what others say holds for their links
                try:
                    return decode_permissions(reply.payload)
                except ValueError as error:  # anybody may answer
                    log.warning("access rules of session %s: dropped: %s", reply.source, error)
        return None

    def _check_access(self, key: str) -> None:
        permissions = self._permissions
        if permissions is not None and not permissions.allows(key):
            raise AccessDeniedError(key, permissions.who, permissions.allow, permissions.deny)

    def _declare(self, make: Callable[[], D], key: str) -> D:
        self._check_open(key)
        self._check_access(key)
        try:
            # `_close_all` waits for threads that are inside: from here on the check is final.
            with inside:
                self._check_open(key)
                entry = make()
        except zenoh.ZError as error:
            if ending.begun:  # its traceback refers to objects of Zenoh; see `kept`
                kept.append(error)
            raise TransportError(f"{key}: cannot be declared: {error}") from error
        self.keep(entry)
        return entry

    def _check_open(self, key: str) -> None:
        process.check(key)
        if self._closed:
            ending.slow_down()
            raise TransportError(
                f"{key}: the session is closed. Try using a node that is still open."
            )


def _open(config: Config, session_id: str) -> zenoh.Session:
    process.check("joining the network")
    check_interface(config)
    process.opened = True
    raw = zenoh.Config()
    try:
        for path, value in {"id": session_id, **zenoh_settings(config)}.items():
            raw.insert_json5(path, json.dumps(value))
        return zenoh.open(raw)
    except zenoh.ZError as error:
        text = str(error).partition(" at /")[0]  # without the line of zenoh's source
        reached = not config.connect or "Unable to connect" not in text
        why = text if reached else explain_refusal(config)
        raise TransportError(f"cannot join the network as {config.mode}: {why}") from error


def _leave(clock: RealClock, session: zenoh.Session) -> None:
    """Close a session.

    Blocks: `CLOSE_S` at most. Zenoh waits 10 s for another side that has stopped reading. Its
    thread is then left behind, which does not keep the interpreter alive.
    """

    def close() -> None:
        # An error means that others could not be notified, or that the interpreter has ended before
        # this call. The session is closed all the same.
        with contextlib.suppress(zenoh.ZError, TransportError), inside:
            session.close()  # type: ignore[no-untyped-call]  # zenoh's stub

    try:
        clock.spawn(close, name="transport-close").join(CLOSE_S)
    except RuntimeError:  # the interpreter is exiting and starts no more threads
        close()


# Sessions stay alive until they are closed, so that no finalizer ever does it.
_open_transports: dict[ZenohTransport, None] = {}
_loopbacks: weakref.WeakSet[SerialExecutor] = weakref.WeakSet()


def _close_all() -> None:
    """Close all sessions, and wait for threads that are about to return to Python.

    CPython ends a foreign thread that asks for the GIL after the interpreter's end. If Zenoh's Rust
    code is on the thread's stack, this aborts the process ("exception not rethrown"). Two kinds of
    threads can be at that point: those in a callback that started before its session was closed
    (`held` waits until Zenoh has freed the callbacks), and those in a call into Zenoh (`inside`
    waits for them, and refuses later calls: an answer to a query, for example).
    """
    if process.forked:  # the sessions belong to the parent; their threads do not exist here
        return
    ending.begin()
    for transport in list(_open_transports):
        transport.close()
    held.wait(LET_GO_S)
    for executor in list(_loopbacks):
        # Since Python 3.12 the exit starts no threads: what waits for one never runs.
        with contextlib.suppress(RuntimeError):
            any(executor.join(PART_S) for _ in range(LET_GO_PARTS))
    inside.end(LET_GO_S)


atexit.register(_close_all)
