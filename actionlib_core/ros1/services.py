"""One bridged service, in one direction or the other."""

from __future__ import annotations

import json
import threading
from functools import partial
from typing import TYPE_CHECKING

from actionlib_core.exceptions import (
    ActionlibError,
    Ros1Error,
    ServiceBusyError,
    TypeMismatchError,
)
from actionlib_core.ros1.node import RETRY_FIRST_S, RETRY_LONGEST_S
from actionlib_core.ros1.sides import Typed, type_of
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.encoding import check_encoding

if TYPE_CHECKING:
    from collections.abc import Collection

    from actionlib_core.ros1.links import Connection
    from actionlib_core.ros1.node import ServiceServer
    from actionlib_core.ros1.sides import Sides
    from actionlib_core.transport import Query, Reply
    from actionlib_core.transport.tokens import Endpoint

CALLS_AT_ONCE = 500  # limit for one service, as each call has a thread
_BUSY = f"{CALLS_AT_ONCE} calls are under way; expected fewer. Try ending calls sooner."


class ServiceBridge:
    """A service whose server is on either network.

    Args:
        sides: The two networks.
        name: Its name in ROS 1.
        timeout: Longest time of a call [s].

    Threads: `look` and `close` from one thread.
    """

    def __init__(self, sides: Sides, name: str, timeout: float) -> None:
        self._sides = sides
        self._name = name
        self._timeout = timeout
        self._from_ros: _FromRos | None = None
        self._to_ros: _ToRos | None = None

    def look(self, ends: Collection[Endpoint], *, served: bool) -> None:
        """Update what is bridged.

        Args:
            ends: The endpoints of that name on our network, without those of bridges.
            served: A node in ROS 1 offers it; that one is used even if there is one here.
        """
        key = self._sides.key(self._name)
        servers = (end for end in ends if end.kind is Kind.SERVICE)
        here = min(servers, key=lambda end: end.age, default=None)
        if served and here is not None:
            text = f"two servers: got one in ROS 1 and one of node '{here.node}' here"
            error = Ros1Error(f"service {self._name}", f"{text}; expected one.")
            self._sides.ros.report(f"two servers of {self._name}", error)
        # A server here that is replaced by one of another type needs another offer in ROS 1.
        typed = None if served or here is None else Typed(here.type, here.md5)
        if self._to_ros is not None and self._to_ros.typed != typed:
            self._to_ros.close()
            self._to_ros = None
        if typed is not None and self._to_ros is None:
            self._to_ros = _ToRos(self._sides, key, self._name, typed, self._timeout)
        if self._from_ros is not None and not served:
            self._from_ros.close()
            self._from_ros = None
        elif self._from_ros is None and served:
            self._from_ros = _FromRos(self._sides, key, self._name, self._timeout)

    def close(self) -> None:
        """End the bridge; does not wait."""
        for each in (self._from_ros, self._to_ros):
            if each is not None:
                each.close()


class _FromRos:
    """A service in ROS 1, shown on our network while a connection to its node is open.

    The connection carries no calls; its end shows that the node has left.
    """

    def __init__(self, sides: Sides, key: str, name: str, timeout: float) -> None:
        self._sides = sides
        self._key = key
        self._name = name
        self._timeout = timeout
        self._closed = sides.node.clock.event(f"the end of the bridge of {name}")
        self._connection: Connection | None = None
        self._lock = threading.Lock()
        self._calls = 0
        sides.ros.spawn(self._follow, f"ros1-service{name}")

    def close(self) -> None:
        """Withdraw it; does not wait."""
        self._closed.set()
        if self._connection is not None:
            self._connection.close()

    def _follow(self) -> None:
        about, pause = f"service {self._name}", RETRY_FIRST_S
        while not self._closed.is_set():
            try:
                self._show(about)
                pause = RETRY_FIRST_S
            except ActionlibError as error:
                self._sides.ros.report(about, error)
            self._closed.wait(pause)
            pause = min(2 * pause, RETRY_LONGEST_S)

    def _show(self, about: str) -> None:
        ros, transport = self._sides.ros, self._sides.node.transport
        connection, header = ros.open_service(self._name, persistent="1")
        with connection:
            self._connection = connection
            if self._closed.is_set():
                return
            typed = type_of(header, about)
            ros.forget_report(about)
            answer = transport.queryable(self._key, partial(self._on_query, typed))
            token = self._sides.show(Kind.SERVICE, self._key, typed, header.get("callerid", ""))
            connection.read(1)  # a service sends nothing without a request: this waits for the end
            self._connection = None
            token.close()
            answer.close()

    def _on_query(self, typed: Typed, query: Query) -> None:
        class_of = type(typed.type, (), {"_type": typed.type, "_md5sum": typed.md5})
        try:
            check_encoding(query.encoding, class_of, name=self._key)
        except TypeMismatchError as error:
            _refuse(query, error)
            return
        # Each call has a thread, as it blocks and this is the network's thread.
        with self._lock:
            busy = self._calls >= CALLS_AT_ONCE
            self._calls += not busy
        if busy:
            _refuse(query, ServiceBusyError(self._key, _BUSY))
            return
        call = partial(self._call, typed, query)
        try:
            self._sides.ros.spawn(call, f"ros1-call{self._name}")
        except RuntimeError as error:  # no thread can be started
            with self._lock:
                self._calls -= 1
            _refuse(query, ServiceBusyError(self._key, str(error)))

    def _call(self, typed: Typed, query: Query) -> None:
        try:
            ros = self._sides.ros
            answer = ros.call_service(self._name, query.payload, typed.md5, self._timeout)
            query.reply(answer, typed.encoding)
            query.finish()
        except Ros1Error as error:
            _refuse(query, error)
        finally:
            with self._lock:
                self._calls -= 1


def _refuse(query: Query, error: Exception) -> None:
    """Answer with an error, in the format of our own services."""
    text = error.reason if isinstance(error, Ros1Error) else str(error)
    query.reply_error(json.dumps({"type": type(error).__name__, "text": text}))
    query.finish()


class _ToRos:
    """A service on our network, for callers in ROS 1."""

    def __init__(self, sides: Sides, key: str, name: str, typed: Typed, timeout: float) -> None:
        self.typed = typed
        self._sides = sides
        self._key = key
        self._timeout = timeout
        self._offer: ServiceServer = sides.ros.provide(name, *typed, self._answer)

    def close(self) -> None:
        """Withdraw it; does not wait."""
        self._offer.close()

    def _answer(self, request: bytes, caller: str) -> bytes:
        """Call the service; runs in the thread of the caller's connection.

        Raises:
            Ros1Error: it raised, has left, or does not answer in time.
        """
        node = self._sides.node
        replies: list[Reply] = []
        done = node.clock.event(f"the answer of service {self._key}")

        def on_reply(reply: Reply) -> None:
            replies.append(reply)
            done.set()

        asking = node.transport.query(
            self._key,
            request,
            encoding=self.typed.encoding,
            timeout=self._timeout,
            on_reply=on_reply,
            on_done=done.set,
        )
        in_time = done.wait(self._timeout)
        asking.close()
        if not replies:
            why = "its server died or left before it answered" if in_time else "no answer in time"
            raise Ros1Error(self._key, f"called by {caller}: {why}.")
        if replies[0].error:
            raise Ros1Error(self._key, _read_error(replies[0].payload))
        return replies[0].payload


def _read_error(payload: bytes) -> str:
    """Return the text of an error reply; our own services send JSON with type and text."""
    text = payload.decode(errors="replace")
    try:
        error = json.loads(text)
        return f"{error['type']}: {error['text']}"
    except (ValueError, TypeError, KeyError):
        return text
