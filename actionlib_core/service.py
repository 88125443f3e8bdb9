"""Services: call a function in another program and get its answer, in rospy's shape.

A handler's exception travels to the caller as a `ServiceException`; a server that dies, is absent
or does not answer in time ends the call with an error of its own. No call waits for ever by
default.

Source:
    rospy.Service, rospy.ServiceProxy and rospy.wait_for_service for names, arguments and meaning.
"""

from __future__ import annotations

import json
import logging
import math
import threading
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core._arguments import check_class, check_function
from actionlib_core._callbacks import CallbackQueue
from actionlib_core._name_watch import NameWatch
from actionlib_core.exceptions import (
    ActionlibError,
    NodeError,
    ServiceBusyError,
    ServiceConflictError,
    ServiceException,
    ServiceLostError,
    ServiceTimeoutError,
    ServiceUnavailableError,
    TypeMismatchError,
    WaitTimeoutError,
)
from actionlib_core.node import get_node
from actionlib_core.presence import (
    Endpoint,
    Kind,
    in_conflict,
    is_younger,
    list_endpoints,
    token_key,
    with_age,
)
from actionlib_core.shutdown import requested
from actionlib_core.time import to_seconds
from actionlib_core.wire import check_encoding, encoding_of, parse_encoding

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Self

    from actionlib_core.clock import Event
    from actionlib_core.interfaces import Message, ServiceType
    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from actionlib_core.transport import Closable, Query, Reply

logger = logging.getLogger("actionlib_core")

NAME_KIND = "service name"
CALLS_AT_ONCE = 500  # of one service; each has a thread
BUSY_LOG_S = 10.0  # shortest time between two words in the log that calls are refused
CALL_TIMEOUT_S = 60.0  # default limit of a call
APPEAR_S = 2.0  # how much of it a call gives a server to appear
FOREVER_S = 1e8  # for the network, which wants a number: three years
STALE_S = 0.2  # a server that vanishes so soon after a call may have been gone before it
MARGIN_S = 1.0  # the network gives up after the call itself has


class _ServiceEnd:
    """What server and proxy share."""

    def __init__(self, name: str, service_class: type[ServiceType], node: Node | None) -> None:
        kind = "service class, such as SetBool"
        check_class(f"service {name!r}", service_class, "_request_class", kind)
        self.node = get_node() if node is None else node
        self.resolved_name = self.node.resolve(name, NAME_KIND)
        self.service_class = service_class
        self.request_class = service_class._request_class
        self.response_class = service_class._response_class
        self.type = service_class._type
        self.md5sum = service_class._md5sum
        self._own = self.node.endpoint(Kind.SERVICE, self.resolved_name, self.type, self.md5sum)
        self._closed = False

    def _watch(self) -> NameWatch:
        return NameWatch(self.node, self._own, {Kind.SERVICE})

    def close(self) -> None:
        """Leave the service; a second call does nothing."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} /{self.resolved_name} [{self.type}]>"


class Service(_ServiceEnd):
    """Answers the calls of a service.

    Args:
        name: Service name, relative, absolute or private.
        service_class: The service's class, `SetBool` for example.
        handler: Gets the request; returns the response, or what makes one: a dict of its fields, a
            tuple or list of all of them, or the value of its only field.
        node: Where it lives; the node in force when None.
        alone: False when others may have the name too: each of them runs its handler for every
            call, and the caller takes the first answer.

    Attributes:
        error: Why it stopped by itself: an older server has the name; None while all is well.

    Raises:
        InvalidNameError: the name breaks the ROS rules.
        NodeError: the node is closed.
        ServiceConflictError: the name has a server already.

    Blocks: until the network has said who has the name, 1 s at most.

    Threads: each call of the handler has a thread of the node's clock, so calls may overlap, block,
        and call services themselves. An exception goes to the caller, and to the log. A caller that
        finds `CALLS_AT_ONCE` under way, or no thread left, gets a `ServiceBusyError`, which the log
        tells of every `BUSY_LOG_S` at most.
    """

    def __init__(
        self,
        name: str,
        service_class: type[ServiceType],
        handler: Callable[[Any], Any],
        *,
        node: Node | None = None,
        alone: bool = True,
    ) -> None:
        check_function(f"service {name!r}", "handler", handler)
        super().__init__(name, service_class, node)
        self._own = with_age(self._own, self.node.clock.time_ns())
        self.handler = handler
        self.error: ServiceConflictError | None = None
        self._alone = alone
        self._lock = threading.Lock()
        self._running = 0
        self._busy_logged = -math.inf  # clock time [s]
        self._shown = False
        self._refuse_second()
        self._servers = self._watch()
        self._parts: list[Closable] = [self._servers]
        self._forget = self.node.on_close(self.close)
        self._calls = CallbackQueue(self.node, f"service /{self.resolved_name}")
        transport = self.node.transport
        try:
            self._parts.append(transport.queryable(self.resolved_name, self._on_query))
            self._parts.append(transport.declare_alive(token_key(self._own)))
            self._meet_servers()
        except BaseException:
            self.close()
            raise

    @property
    def mismatches(self) -> list[TypeMismatchError]:
        """Other servers and callers of another type, as errors; each was logged once."""
        return self._servers.mismatches

    def close(self) -> None:
        """Stop answering; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        self._forget()
        for part in reversed(self._parts):
            part.close()

    def shutdown(self, reason: str = "") -> None:
        """Stop answering; as `close`.

        Args:
            reason: For the log.
        """
        logger.info("service /%s is shut down: %s", self.resolved_name, reason or "requested")
        self.close()

    def spin(self) -> None:
        """Answer until the service is closed or the program is to end.

        Raises:
            ServiceConflictError: it stopped because an older server has the name.

        Blocks: until then.
        """
        self._servers.wait(lambda: self._closed, None)
        if self.error is not None:
            raise self.error

    # -- other servers -------------------------------------------------------------------------

    def _watch(self) -> NameWatch:
        return NameWatch(self.node, self._own, {Kind.SERVICE}, on_new=self._on_server)

    def _refuse_second(self) -> None:
        if not self._alone:
            return
        there = list_endpoints(self.node.transport, kind=Kind.SERVICE, name=self.resolved_name)
        if there:
            raise self._conflict(there[0])

    def _meet_servers(self) -> None:
        """Look at the servers that were found while this one was made, and from now on at all."""
        self._shown = True
        for other in self._servers.ends(any_type=True):
            self._on_server(other)
        if self.error is not None:
            raise self.error

    def _on_server(self, other: Endpoint) -> None:
        """Stop when `other` is older: a session that has just been opened hears of it late."""
        if not (self._alone and self._shown) or self._closed:
            return
        if not is_younger(self._own, other):
            logger.error("%s", self._conflict(other, stays=True))
            return
        self.error = self._conflict(other)
        logger.error("%s", self.error)
        self.close()

    def _conflict(self, other: Endpoint, *, stays: bool = False) -> ServiceConflictError:
        return ServiceConflictError(self.resolved_name, *in_conflict(self._own, other, stays=stays))

    # -- calls ---------------------------------------------------------------------------------

    def _on_query(self, query: Query) -> None:
        try:
            check_encoding(query.encoding, self.service_class, name=self.resolved_name)
        except TypeMismatchError as error:
            self._servers.note(error, _caller_of(query))
            _fail(query, error)
            return
        if not self._admit():
            # Without an end, handlers that call themselves would take all threads there are.
            self._refuse(query, _BUSY.format(CALLS_AT_ONCE))
            return
        try:
            self._calls.spawn(partial(self._answer, query), f"service /{self.resolved_name}")
        except BaseException as error:
            self._leave()
            if not isinstance(error, RuntimeError):
                raise
            self._refuse(query, f"no thread is left: {error}.")

    def _refuse(self, query: Query, reason: str) -> None:
        error = ServiceBusyError(self.resolved_name, reason)
        self._log_busy(error)
        _fail(query, error)

    def _pass_on(self, query: Query, text: str) -> None:
        """Answer with the very words of a busy service: handlers that call each other add none."""
        kind = ServiceBusyError.__name__
        if not _is_from(self.resolved_name, text):  # else it was logged when it came up
            self._log_busy(_raised(self.resolved_name, kind, text))
        _send_error(query, kind, text)

    def _log_busy(self, error: ServiceException) -> None:
        """Log that calls fail because a service is busy: once in a while, as there may be many."""
        now = self.node.clock.now()
        with self._lock:
            if now < self._busy_logged + BUSY_LOG_S:
                return
            self._busy_logged = now
        logger.error("%s", error)

    def _admit(self) -> bool:
        with self._lock:
            if self._running >= CALLS_AT_ONCE:
                return False
            self._running += 1
            return True

    def _leave(self) -> None:
        with self._lock:
            self._running -= 1

    def _answer(self, query: Query) -> None:
        try:
            self._reply(query)
        finally:
            self._leave()

    def _reply(self, query: Query) -> None:
        try:
            response = self._respond(self.handler(self.request_class.from_bytes(query.payload)))
            query.reply(response.to_bytes(), encoding_of(self.service_class))
        except BaseException as error:  # sys.exit() too: the caller waits for an answer
            busy = _find_busy(error)
            if busy:
                self._pass_on(query, busy)
            else:
                logger.exception("service /%s: the handler raised", self.resolved_name)
                _fail(query, error)
            if not isinstance(error, Exception):
                raise
        finally:
            query.finish()

    def _respond(self, result: object) -> Message:
        if isinstance(result, self.response_class):
            return result
        make: Callable[..., Message] = self.response_class
        if isinstance(result, dict):
            return make(**result)
        if isinstance(result, (tuple, list)):
            return make(*result)
        if result is None and self.response_class.__slots__:
            name = self.response_class.__name__
            raise ServiceException(
                self.resolved_name,
                f"the handler returned None; expected {name}, a dict or its field values",
            )
        return make() if result is None else make(result)


_BUSY = (
    "{} calls are under way; expected fewer. Try looking whether the handler calls its own "
    "service, directly or through another, or ending calls sooner."
)


def _show(seconds: float | None) -> str:
    return "all the time" if seconds is None else f"{seconds:g} s"


def _fail(query: Query, error: BaseException) -> None:
    _send_error(query, type(error).__name__, str(error))


def _send_error(query: Query, kind: str, text: str) -> None:
    query.reply_error(json.dumps({"type": kind, "text": text}))
    query.finish()


def _find_busy(error: BaseException) -> str:
    """Return what a busy service has said, this one or one that the handler called, or ""."""
    if isinstance(error, ServiceBusyError):
        return str(error)
    if isinstance(error, ServiceException) and error.remote_type == ServiceBusyError.__name__:
        return error.remote_text
    return ""


def _is_from(name: str, text: str) -> bool:
    """Tell whether `text` is that of an error of the service `name`."""
    return text.startswith(f"service /{name}: ")


def _raised(name: str, remote_type: str, remote_text: str) -> ServiceException:
    """Return the error for a handler that raised."""
    return ServiceException(
        name,
        f"the handler raised {remote_type or 'an error'}: {remote_text}",
        remote_type=remote_type,
        remote_text=remote_text,
    )


def _caller_of(query: Query) -> Endpoint:
    """Return the end that a call of another type came from; callers have no token."""
    encoding = parse_encoding(query.encoding)
    return Endpoint(Kind.SERVICE, query.key, encoding.type, encoding.md5, "", "", 0)


class ServiceProxy(_ServiceEnd):
    """Calls a service: `proxy(request)`, `proxy(data=True)`, `proxy(True)`.

    Args:
        name: Service name, relative, absolute or private.
        service_class: The service's class, `SetBool` for example.
        persistent: As rospy takes it; there is no connection to keep here.
        headers: As rospy takes it; not sent.
        timeout: Longest time of a call [s], waiting for the server to appear included; None waits
            until the server has answered or died.
        node: Where it lives; the node in force when None.

    Raises:
        InvalidNameError: the name breaks the ROS rules.
        NodeError: the node is closed.

    Threads: any number of threads may call at the same time; a transport callback may not.
    """

    def __init__(
        self,
        name: str,
        service_class: type[ServiceType],
        persistent: bool = False,
        headers: dict[str, str] | None = None,
        *,
        timeout: float | Duration | None = CALL_TIMEOUT_S,
        node: Node | None = None,
    ) -> None:
        super().__init__(name, service_class, node)
        self.persistent = persistent
        self.headers = headers
        self.timeout = to_seconds(timeout)
        # Programs make proxies as they need them and never close them, so they share what lasts.
        key = ("service", self.resolved_name, self.type, self.md5sum)
        self._servers = self.node.shared(key, self._watch)

    @property
    def mismatches(self) -> list[TypeMismatchError]:
        """The servers of another type, as errors; each was logged once."""
        return self._servers.mismatches

    def close(self) -> None:
        """Make later calls fail, and those under way at once; a second call does nothing."""
        self._closed = True
        self._servers.wake()

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the service; see `call`."""
        return self.call(*args, **kwargs)

    def call(self, *args: Any, **kwargs: Any) -> Any:
        """Send a request, or one made from the arguments, and return the response.

        Raises:
            FieldError: a value does not fit its field of the request.
            ServiceException: the handler raised; type and text are on the error.
            ServiceUnavailableError: there is no server.
            ServiceTimeoutError: the server did not answer in time.
            ServiceLostError: the server died or left during the call.
            ServiceBusyError: too many calls are under way there, its handler calls itself, or no
                thread is left.
            TypeMismatchError: the server has another type.
            NodeError: the node is closed, or the program is to end.

        Blocks: until the answer, `timeout` at most.
        """
        if len(args) == 1 and not kwargs and isinstance(args[0], self.request_class):
            request = args[0]
        else:
            request = self.request_class(*args, **kwargs)
        clock = self.node.clock
        start = clock.now()
        self._find_server()
        left = None if self.timeout is None else max(self.timeout - (clock.now() - start), 0.0)
        return self._read(self._ask(request.to_bytes(), left))

    def wait_for_service(self, timeout: float | Duration | None = None) -> None:
        """Wait until there is a server.

        Args:
            timeout: Longest wait [s]; None waits until the node closes or the program is to end.

        Raises:
            WaitTimeoutError: there is none in time.
            TypeMismatchError: there is one, but of another type.
            NodeError: the node was closed, or the program is to end.

        Blocks: see `timeout`.
        """
        seconds = to_seconds(timeout)
        if not self._wait_for_server(seconds):
            raise WaitTimeoutError(
                f"/{self.resolved_name}: no server: got none in {_show(seconds)}; expected one of "
                f"type {self.type}. Try 'actionlib service list'."
            )

    def _wait_for_server(self, timeout: float | None) -> bool:
        self._servers.wait(lambda: self._closed or bool(self._servers.ends(any_type=True)), timeout)
        if self._closed:
            raise NodeError(f"/{self.resolved_name}: not called: the proxy is closed.")
        if self._servers.ends():
            return True
        if self.mismatches:
            raise self.mismatches[0]
        if self.node.closed or (timeout is None and requested()):
            raise NodeError(
                f"/{self.resolved_name}: not called: the node was closed or the program is to end."
            )
        return False

    def _find_server(self) -> None:
        longest = APPEAR_S if self.timeout is None else min(self.timeout, APPEAR_S)
        if not self._wait_for_server(longest):
            raise ServiceUnavailableError(
                self.resolved_name,
                f"no server: got none in {longest:g} s; expected one of type {self.type}. Try "
                "starting it, or wait_for_service() first.",
            )

    def _ask(self, payload: bytes, timeout: float | None) -> Reply:
        """Return the first reply.

        Blocks: until the first, or until none can come any more.
        """
        replies: list[Reply] = []
        done: list[bool] = []
        news = self.node.clock.event(f"the answer of service /{self.resolved_name}")

        def on_reply(reply: Reply) -> None:
            replies.append(reply)
            news.set()

        def on_done() -> None:
            done.append(True)
            news.set()

        query = self.node.transport.query(
            self.resolved_name,
            payload,
            encoding=encoding_of(self.service_class),
            timeout=FOREVER_S if timeout is None else timeout + MARGIN_S,
            on_reply=on_reply,
            on_done=on_done,
        )

        def settled() -> bool:
            return bool(replies or done or self._closed)

        try:
            in_time = self._wait_for_answer(settled, timeout, news)
        finally:
            query.close()
        if replies:
            return replies[0]
        raise self._explain_silence(timeout, in_time=in_time)

    def _wait_for_answer(
        self, settled: Callable[[], bool], timeout: float | None, news: Event
    ) -> bool:
        """Wait until a call is settled, or whoever may have got it is gone; return whether.

        When the servers that were known at the call go right after it, a new one that has just
        taken the name has got it: its token may be later here than the answer.
        """
        now, servers = self.node.clock.now, self._servers
        start = now()
        asked = set(servers.ends())

        def over() -> bool:
            return settled() or asked.isdisjoint(servers.ends())

        in_time = servers.wait(over, timeout, news)
        stale = start + STALE_S - now()
        if in_time and stale > 0:
            servers.wait(lambda: settled() or bool(servers.ends()), stale, news)
            asked = set(servers.ends())
            left = None if timeout is None else start + timeout - now()
            in_time = servers.wait(over, left, news)
        return in_time

    def _explain_silence(self, timeout: float | None, *, in_time: bool) -> ActionlibError:
        if self._closed:
            return NodeError(f"/{self.resolved_name}: no answer: the proxy was closed.")
        if in_time:
            return ServiceLostError(
                self.resolved_name, "the server died or left before it answered."
            )
        if self.node.closed or timeout is None:
            return NodeError(
                f"/{self.resolved_name}: no answer: the node was closed or the program is to end."
            )
        return ServiceTimeoutError(
            self.resolved_name,
            f"no answer: got none in {self.timeout:g} s; expected one from the server that is "
            "there. Try a longer timeout.",
        )

    def _read(self, reply: Reply) -> Message:
        if not reply.error:
            check_encoding(reply.encoding, self.service_class, name=self.resolved_name)
            return self.response_class.from_bytes(reply.payload)
        text = reply.payload.decode(errors="replace")
        try:
            told = json.loads(text)
            remote_type, remote_text = str(told["type"]), str(told["text"])
        except (ValueError, TypeError, KeyError):  # a server that is not ours says it its own way
            remote_type, remote_text = "", text
        if remote_type == TypeMismatchError.__name__:
            self._raise_mismatch(remote_text)
        busy = remote_type == ServiceBusyError.__name__
        if busy and _is_from(self.resolved_name, remote_text):  # else it is one that it called
            _, _, reason = remote_text.partition(": ")
            raise ServiceBusyError(self.resolved_name, reason)
        raise _raised(self.resolved_name, remote_type, remote_text)

    def _raise_mismatch(self, remote_text: str) -> None:
        """Raise the mismatch that the tokens show, rather than the server's words."""
        if self.mismatches:
            raise self.mismatches[0]
        raise ServiceException(
            self.resolved_name,
            f"the server has another type: {remote_text}",
            remote_type=TypeMismatchError.__name__,
            remote_text=remote_text,
        )


def wait_for_service(
    service: str, timeout: float | Duration | None = None, *, node: Node | None = None
) -> None:
    """Wait until a service of that name has a server, of whatever type.

    Args:
        service: Service name, relative, absolute or private.
        timeout: Longest wait [s]; None waits until the node closes or the program is to end.
        node: Where to look; the node in force when None.

    Raises:
        WaitTimeoutError: there is none in time.
        NodeError: the node was closed, or the program is to end.

    Blocks: see `timeout`.
    """
    node = get_node() if node is None else node
    name = node.resolve(service, NAME_KIND)
    seconds = to_seconds(timeout)
    anybody = node.endpoint(Kind.SERVICE, name, "", "")
    watch = NameWatch(node, anybody, {Kind.SERVICE}, any_type=True)
    try:
        if watch.wait(lambda: bool(watch.ends(any_type=True)), seconds):
            return
    finally:
        watch.close()
    if seconds is None or node.closed:
        raise NodeError(f"/{name}: not there: the node was closed or the program is to end.")
    raise WaitTimeoutError(
        f"/{name}: no server: got none in {seconds:g} s; expected one. "
        "Try 'actionlib service list'."
    )
