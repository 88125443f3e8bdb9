"""The caller's end of a service, with rospy's interface.

Source:
    rospy.ServiceProxy and rospy.wait_for_service for names, arguments and meaning.
"""

from __future__ import annotations

import itertools
import json
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, ParamSpec, Protocol, TypeVar, overload

from actionlib_core import border
from actionlib_core.exceptions import (
    ActionlibError,
    DeserializationError,
    NodeError,
    ServiceBusyError,
    ServiceException,
    ServiceLostError,
    ServiceTimeoutError,
    ServiceUnavailableError,
    TypeMismatchError,
    WaitTimeoutError,
)
from actionlib_core.inputs.arguments import check_class, check_delay, check_limit
from actionlib_core.node import get_node
from actionlib_core.pubsub._ends import NamedEnd, NameWatch
from actionlib_core.shutdown import requested
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.end_port import make_end_port

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Event
    from actionlib_core.interfaces import Message, ServiceType
    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from actionlib_core.transport import Reply
    from actionlib_core.wire.end_port import EndPort

if TYPE_CHECKING:
    import typing_extensions  # type checkers have it; a plain `ServiceProxy` is one of any service

    P = typing_extensions.ParamSpec("P", default=...)
    Q = typing_extensions.TypeVar("Q", default=Any)
    S = typing_extensions.TypeVar("S", default=Any)
    Q_co = typing_extensions.TypeVar("Q_co", default=Any, covariant=True)
    S_co = typing_extensions.TypeVar("S_co", default=Any, covariant=True)
else:
    P, Q, S = ParamSpec("P"), TypeVar("Q"), TypeVar("S")
    Q_co, S_co = TypeVar("Q_co", covariant=True), TypeVar("S_co", covariant=True)


class ServiceSpec(Protocol[P, Q_co, S_co]):
    """A service class: type checkers find its request's fields and its response through it."""

    @staticmethod
    def _call(*args: P.args, **kwargs: P.kwargs) -> tuple[Q_co, S_co]: ...


CALL_TIMEOUT_S = 60.0  # default limit of a call
APPEAR_S = 2.0  # part of it in which the server must appear
FOREVER_S = 1e8  # three years: the network needs a number for "no limit"
MIN_PATIENCE_S = 3600.0  # see `patience_of`
STALE_S = 0.2  # a server that vanishes this soon after a call may already have died before it
MARGIN_S = 1.0  # added for the network, so that it does not give up before the call itself


_unlimited = itertools.count(1)  # numbers of calls without a limit; `next` is atomic


def patience_of(calls: int) -> float:
    """Return the network's timeout for the `calls`-th call without a limit.

    Zenoh keeps about 0.7 kB of each query until its timeout, even when it was answered. So a few
    such calls may wait for years, and a program that makes millions of them needs about 20 MB, plus
    the memory of the calls of the last hour.
    """
    return max(FOREVER_S / calls, MIN_PATIENCE_S)


class ServiceEnd(NamedEnd):
    """Base class of server and proxy."""

    _what = "service"
    _kind = Kind.SERVICE

    def __init__(self, name: str, service_class: type[ServiceType], node: Node | None) -> None:
        kind = "service class, such as SetBool"
        check_class(f"service {name!r}", service_class, "_request_class", kind)
        super().__init__(name, service_class, node)
        self.service_class = service_class
        self.request_class = service_class._request_class
        self.response_class = service_class._response_class

    def _watch(self) -> NameWatch:
        return NameWatch(self.node, self._end, {Kind.SERVICE})


def is_from(name: str, text: str) -> bool:
    """Return whether `text` is the text of an error of the service `name`."""
    return text.startswith(f"service /{name}: ")


def handler_raised(name: str, remote_type: str, remote_text: str) -> ServiceException:
    """Return the error for a handler that raised."""
    return ServiceException(
        name,
        f"the handler raised {remote_type}: {remote_text}",
        remote_type=remote_type,
        remote_text=remote_text,
    )


class ServiceProxy(ServiceEnd, Generic[P, Q, S]):
    """Calls a service: `proxy(request)`, `proxy(data=True)`, `proxy(True)`.

    Args:
        name: Service name, relative, absolute or private.
        service_class: The service's class, `SetBool` for example.
        persistent: As in rospy, but without effect: there is no connection to keep.
        headers: As in rospy, but not sent.
        timeout: Longest time of a call [s], including the wait for the server to appear. None:
            until the server has answered or died; after 27,777 such calls in one program, an hour
            at most (see `patience_of`).
        node: Its node; None: the current node.

    Raises:
        InvalidDurationError: `timeout` is not a duration, or negative.
        InvalidNameError: the name breaks the ROS rules.
        NodeError: the node is closed.

    Threads: any number of threads may call at the same time, but not the network's own.
    """

    def __init__(
        self,
        name: str,
        service_class: type[ServiceSpec[P, Q, S]],
        persistent: bool = False,
        headers: dict[str, str] | None = None,
        *,
        timeout: float | Duration | None = CALL_TIMEOUT_S,
        node: Node | None = None,
    ) -> None:
        service: Any = service_class
        super().__init__(name, service, node)
        self.persistent = persistent
        self.headers = headers
        self.timeout = check_limit(f"service {name!r}", "timeout", timeout)
        self._ends = self.node.shared(("service", *self._shared_key()), self._watch)

    def _make_end(self, interface: type[Message | ServiceType]) -> EndPort:
        make = partial(make_end_port, self.node, Kind.SERVICE, self._full_name, interface)
        return self.node.shared(("caller", *self._shared_key()), partial(make, calls=True))

    def _shared_key(self) -> tuple[str, str, str]:
        """Return the key of what proxies share: programs make many of them and close none."""
        return self._full_name, self.type, self.md5sum

    def close(self) -> None:
        """Make running and later calls fail; a second call does nothing."""
        self._leave()

    def _leave(self) -> None:
        # The watch and the end stay, as other proxies of the node share them.
        self._closed = True
        self._ends.wake()

    @overload
    def __call__(self, request: Q, /) -> S: ...
    @overload
    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> S: ...
    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the service; see `call`."""
        return self.call(*args, **kwargs)

    @overload
    def call(self, request: Q, /) -> S: ...
    @overload
    def call(self, *args: P.args, **kwargs: P.kwargs) -> S: ...
    def call(self, *args: Any, **kwargs: Any) -> Any:
        """Send a request, or one made from the arguments, and return the response.

        Raises:
            FieldError: a value does not fit its field of the request.
            ServiceException: the handler raised, then type and text are on the error; or the bytes
                of the response cannot be read.
            ServiceUnavailableError: there is no server.
            ServiceTimeoutError: the server did not answer in time.
            ServiceLostError: the server died or left during the call.
            ServiceBusyError: too many calls are running there, for example because its handler
                calls itself, or no thread could be started.
            TypeMismatchError: the server has another type.
            NodeError: the node is closed, or shutdown was requested.

        Blocks: until the answer, `timeout` at most.
        """
        if len(args) == 1 and not kwargs and isinstance(args[0], self.request_class):
            request = args[0]
        else:
            request = self.request_class(*args, **kwargs)
        return self._call_told(request) if border.listeners else self._call(request)

    def _call(self, request: Message) -> Message:
        clock = self.node.clock
        # The wait for the server is part of the timeout.
        start = clock.now()
        self._find_server()
        left = None if self.timeout is None else max(self.timeout - (clock.now() - start), 0.0)
        if left == 0.0:
            raise ServiceTimeoutError(
                self._full_name,
                f"not called: got no time to wait for an answer; expected more than the "
                f"{self.timeout:g} s of its timeout.",
            )
        return self._read(self._ask(request, left))

    def _call_told(self, request: Message) -> Message:
        """Call, and tell the listeners of the border what is sent and what comes back."""
        number = next(border.numbers)
        told = self.node, self._full_name, self.type, number
        border.tell("request", *told, request)
        try:
            self._find_server()
            if any(end.session == self.node.transport.session_id for end in self._ends.ends()):
                border.tell("own", *told)
            response = self._call(request)
        except ActionlibError as error:
            text = error.remote_text if isinstance(error, ServiceException) else ""
            border.tell("response", *told, None, type(error).__name__, text)
            raise
        border.tell("response", *told, response)
        return response

    def wait_for_service(self, timeout: float | Duration | None = None) -> None:
        """Wait until there is a server.

        Args:
            timeout: Longest wait [s]; None: until the node closes or shutdown is requested.

        Raises:
            InvalidDurationError: `timeout` is not a duration.
            WaitTimeoutError: there was no server in time.
            TypeMismatchError: there is one, but of another type.
            NodeError: the node was closed, or shutdown was requested.

        Blocks: see `timeout`.
        """
        seconds = check_delay(f"service /{self._full_name}", "timeout", timeout)
        started = self.node.clock.now()
        if not self._wait_for_server(seconds):
            if border.listeners:
                waited = f"{self.node.clock.now() - started:.6f}"
                border.tell("absent", self.node, self._full_name, self.type, "", text=waited)
            raise WaitTimeoutError(
                f"/{self._full_name}: no server: got none in {_show(seconds)}; expected one of "
                f"type {self.type}. "
                f"{self._absence() or 'Try starting it.'}"
            )

    def _wait_for_server(self, timeout: float | None) -> bool:
        def known() -> bool:  # also a server of another type, which is then reported at once
            return self._closed or bool(self._ends.ends(any_type=True))

        if not known():
            with self._ends.telling(Kind.SERVICE):
                self._ends.wait(known, timeout)
        if self._closed:
            raise NodeError(f"/{self._full_name}: not called: the proxy is closed.")
        if self._ends.ends():
            return True
        if self.mismatches:
            raise self.mismatches[0]
        if self.node.closed or (timeout is None and requested()):
            raise NodeError(
                f"/{self._full_name}: not called: the node was closed or shutdown was requested."
            )
        return False

    def _find_server(self) -> None:
        longest = APPEAR_S if self.timeout is None else min(self.timeout, APPEAR_S)
        if not self._wait_for_server(longest):
            raise ServiceUnavailableError(
                self._full_name,
                f"no server: got none in {longest:g} s; expected one of type {self.type}. "
                f"{self._absence() or 'Try starting it, or wait_for_service() first.'}",
            )

    def _absence(self) -> str:
        """Return why there may be no server, as a sentence."""
        link = self._end.transport.lost_link
        why = f"the link to {link} is lost." if link else self._end.explain_absence()
        return f"{why[:1].upper()}{why[1:]}"

    def _ask(self, request: Message, timeout: float | None) -> Reply:
        """Send a request and return the first reply.

        Blocks: until the first reply, or until none can come any more.
        """
        replies: list[Reply] = []
        done: list[bool] = []
        news = self.node.clock.event(f"the answer of service /{self._full_name}")

        def on_reply(reply: Reply) -> None:
            replies.append(reply)
            news.set()

        def on_done() -> None:
            done.append(True)
            news.set()

        longest = patience_of(next(_unlimited)) if timeout is None else timeout + MARGIN_S
        start = self.node.clock.now()
        query = self._end.ask(request, longest, on_reply, on_done)

        def settled() -> bool:
            return bool(replies or done or self._closed)

        try:
            in_time = self._wait_for_answer(settled, timeout, news)
        finally:
            query.close()
        if replies:
            return replies[0]
        # Only a call without a limit can end here: `MARGIN_S` lets others time out before.
        if done and self.node.clock.now() >= start + longest:
            raise ServiceTimeoutError(
                self._full_name,
                f"no answer: got none in {longest:g} s; expected one sooner, as the program has "
                "made many calls without a limit. Try a timeout.",
            )
        raise self._explain_silence(timeout, in_time=in_time)

    def _wait_for_answer(
        self, settled: Callable[[], bool], timeout: float | None, news: Event
    ) -> bool:
        """Wait until a call is settled or its servers are gone; return False after `timeout`.

        If the servers known at the call vanish right after it, they may have been dead before, and
        a new server may have received the call: its token can arrive later than its answer.
        """
        now, servers = self.node.clock.now, self._ends
        start = now()
        asked = set(servers.ends())

        def over() -> bool:
            return settled() or asked.isdisjoint(servers.ends())

        in_time = servers.wait(over, timeout, news)
        # The servers are gone so soon after the call: give a new one's token until `STALE_S`.
        stale = start + STALE_S - now()
        if in_time and stale > 0:
            servers.wait(lambda: settled() or bool(servers.ends()), stale, news)
            asked = set(servers.ends())
            left = None if timeout is None else start + timeout - now()
            in_time = servers.wait(over, left, news)
        return in_time

    def _explain_silence(self, timeout: float | None, *, in_time: bool) -> ActionlibError:
        if self._closed:
            return NodeError(f"/{self._full_name}: no answer: the proxy was closed.")
        if in_time:
            self.node.clock.sleep(self._end.transport.link_delay)
            link = self._end.transport.lost_link
            return ServiceLostError(
                self._full_name,
                f"the link to {link} is lost; the server may still handle the call."
                if link
                else "the server died or left before it answered.",
            )
        if self.node.closed or timeout is None:
            return NodeError(
                f"/{self._full_name}: no answer: the node was closed or shutdown was requested."
            )
        return ServiceTimeoutError(
            self._full_name,
            f"no answer: got none in {self.timeout:g} s; expected one from the server that is "
            "there. Try a longer timeout.",
        )

    def _read(self, reply: Reply) -> Message:
        if not reply.error:
            try:
                response: Message = self._end.read_response(reply)
            except DeserializationError as unreadable:
                reason = f"the response cannot be read: {unreadable}"
                raise ServiceException(self._full_name, reason) from unreadable
            return response
        text = reply.payload.decode(errors="replace")
        try:
            error = json.loads(text)
            remote_type, remote_text = str(error["type"]), str(error["text"])
        except (ValueError, TypeError, KeyError):  # a server of another program: any text
            remote_type, remote_text = "", text
        if remote_type == TypeMismatchError.__name__:
            self._raise_mismatch(remote_text)
        busy = remote_type == ServiceBusyError.__name__
        # Otherwise a service is busy that the handler has called.
        if busy and is_from(self._full_name, remote_text):
            _, _, reason = remote_text.partition(": ")
            raise ServiceBusyError(self._full_name, reason)
        if not remote_type:
            reason = f"the server answered with an error: {remote_text}"
            raise ServiceException(self._full_name, reason, remote_text=remote_text)
        raise handler_raised(self._full_name, remote_type, remote_text)

    def _raise_mismatch(self, remote_text: str) -> None:
        """Raise the mismatch found by tokens, which says more than the server's text."""
        if self.mismatches:
            raise self.mismatches[0]
        raise ServiceException(
            self._full_name,
            f"the server has another type: {remote_text}",
            remote_type=TypeMismatchError.__name__,
            remote_text=remote_text,
        )


def wait_for_service(
    service: str, timeout: float | Duration | None = None, *, node: Node | None = None
) -> None:
    """Wait until a service has a server, of any type, here or on ROS 2.

    Args:
        service: Service name, relative, absolute or private.
        timeout: Longest wait [s]; None: until the node closes or shutdown is requested.
        node: Our node; None: the current node.

    Raises:
        InvalidDurationError: `timeout` is not a duration.
        WaitTimeoutError: there was no server in time.
        NodeError: the node was closed, or shutdown was requested.
        TransportError: a ROS 2 network in the configuration cannot be joined.

    Blocks: see `timeout`.
    """
    node = get_node() if node is None else node
    name = node.resolve(service, "service name")
    seconds = check_delay(f"service {service!r}", "timeout", timeout)
    anybody = make_end_port(node, Kind.SERVICE, name, None)
    watch = NameWatch(node, anybody, {Kind.SERVICE}, any_type=True)
    try:
        with watch.telling(Kind.SERVICE):
            if watch.wait(lambda: bool(watch.ends(any_type=True)), seconds):
                return
    finally:
        watch.close()
    if seconds is None or node.closed:
        raise NodeError(f"/{name}: not there: the node was closed or shutdown was requested.")
    why = anybody.explain_absence()
    raise WaitTimeoutError(
        f"/{name}: no server: got none in {seconds:g} s; expected one. {why[:1].upper()}{why[1:]}"
    )


def _show(seconds: float | None) -> str:
    return "all the time" if seconds is None else f"{seconds:g} s"
