"""Services: functions that other programs can call, with rospy's interface.

A handler's exception is raised in the caller as a `ServiceException`. When the server is absent,
dies or does not answer in time, the call raises an error of its own kind. By default no call waits
for ever.

Source:
    rospy.Service for names, arguments and meaning.
"""

from __future__ import annotations

import json
import logging
import math
import threading
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core import border
from actionlib_core.action._callbacks import CallbackQueue
from actionlib_core.exceptions import (
    ActionlibError,
    DeserializationError,
    ServiceBusyError,
    ServiceConflictError,
    ServiceException,
    TypeMismatchError,
    text_of,
)
from actionlib_core.inputs.arguments import check_function
from actionlib_core.pubsub._ends import NameWatch
from actionlib_core.pubsub.service_proxy import ServiceEnd, handler_raised, is_from
from actionlib_core.shutdown import exits_on_signals
from actionlib_core.transport.tokens import Endpoint, Kind
from actionlib_core.wire.arrivals import Readable
from actionlib_core.wire.encoding import parse_encoding
from actionlib_core.wire.presence import in_conflict, is_younger, with_age

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.interfaces import Message, ServiceType
    from actionlib_core.node import Node
    from actionlib_core.transport import Query

logger = logging.getLogger("actionlib_core")

CALLS_AT_ONCE = 500  # limit for one service, as each call has a thread
BUSY_LOG_S = 10.0  # shortest interval of log entries about refused calls


class Service(ServiceEnd):
    """Answers the calls of a service.

    Args:
        name: Service name, relative, absolute or private.
        service_class: The service's class, `SetBool` for example.
        handler: Called with the request. Returns the response, a dict of its fields, a tuple or
            list of all fields, or the value of its only field.
        node: Its node; None: the current node.
        alone: False: other servers may have the same name. Then each of them runs its handler for
            every call, and the caller takes the first answer.

    Attributes:
        error: Set when it has stopped by itself because an older server has the name, else None.

    Raises:
        InvalidNameError: the name breaks the ROS rules.
        NodeError: the node is closed.
        ServiceConflictError: the name has a server already.

    Blocks: until the network has listed the servers of the name, 1 s at most.

    Threads: each call of the handler has a thread of the node's clock, so calls may overlap, block,
        and call services themselves. An exception is sent to the caller and logged. When
        `CALLS_AT_ONCE` calls are running, or no thread can be started, the caller gets a
        `ServiceBusyError`, which is logged every `BUSY_LOG_S` at most.
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
        # Of two servers with the name, the younger stops.
        if self._end.ages:
            self._end.own = with_age(self._end.own, self.node)
        self.handler = handler
        self.error: ServiceConflictError | None = None
        self._alone = alone
        self._lock = threading.Lock()
        self._running = 0
        self._readable = Readable(logger)
        self._busy_logged = -math.inf  # when refused calls were last logged [s, clock]
        self._shown = False  # the token was declared
        # Check for another server, then watch for later ones: both may miss a server that starts at
        # the same time, so `_meet_servers` checks again once the token is declared.
        self._refuse_second()
        self._ends = self._watch()
        self._parts.append(self._ends)
        self._forget = self.node.on_close(self.close)
        self._used = self.node.offer(f"service '/{self._full_name}'") if alone else bool
        self._calls = CallbackQueue(self.node, f"service /{self._full_name}")
        try:
            self._parts.append(self._end.answer(self._on_query))
            self._parts.append(self._end.show())
            self._meet_servers()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stop answering; a second call does nothing."""
        self._used()
        self._leave()

    def shutdown(self, reason: str = "") -> None:
        """Stop answering; as `close`.

        Args:
            reason: For the log.
        """
        logger.info("service /%s is shut down: %s", self._full_name, reason or "requested")
        self.close()

    def spin(self) -> None:
        """Answer until the service is closed or shutdown is requested.

        Raises:
            ServiceConflictError: it stopped because an older server has the name.
            SystemExit: as `ActionServer.wait`.

        Blocks: until then.
        """
        self._used()
        with exits_on_signals():
            self._ends.wait(lambda: self._closed, None)
        if self.error is not None:
            raise self.error

    # -- other servers -------------------------------------------------------------------------

    def _watch(self) -> NameWatch:
        return NameWatch(self.node, self._end, {Kind.SERVICE}, on_new=self._on_server)

    def _refuse_second(self) -> None:
        if not self._alone:
            return
        there = self._end.list_services()
        if there:
            raise self._conflict(there[0])

    def _meet_servers(self) -> None:
        """Check for conflicts: with the servers found so far, and from now on with each new one.

        Not before our token is declared: until then, the others cannot see that we have the name,
        and of two servers both might stop.
        """
        self._shown = True
        for other in self._ends.ends(any_type=True):
            self._on_server(other)
        if self.error is not None:
            raise self.error

    def _on_server(self, other: Endpoint) -> None:
        """Stop if `other` is older; a new session may discover it only after the constructor."""
        if not (self._alone and self._shown and self._end.ages) or self._closed:
            return
        if not is_younger(self._end.own, other):
            logger.error("%s", self._conflict(other, stays=True))
            return
        self.error = self._conflict(other)
        logger.error("%s", self.error)
        self.close()

    def _conflict(self, other: Endpoint, *, stays: bool = False) -> ServiceConflictError:
        return ServiceConflictError(
            self._full_name, *in_conflict(self._end.own, other, stays=stays)
        )

    # -- calls ---------------------------------------------------------------------------------

    def _on_query(self, query: Query) -> None:
        self._used()
        try:
            self._end.check(query)
        except TypeMismatchError as error:
            self._ends.note(error, _caller_of(query))
            _fail(query, error)
            return
        except ValueError as error:
            self._report_unreadable("dropped a request", error)
            query.finish()
            return
        if not self._begin_call():
            # Without a limit, a handler that calls its own service would use up all threads.
            self._refuse(query, _BUSY.format(CALLS_AT_ONCE))
            return
        try:
            self._calls.spawn(partial(self._answer, query), f"service /{self._full_name}")
        except BaseException as error:
            self._end_call()
            if not isinstance(error, RuntimeError):  # Python's "can't start new thread"
                raise
            self._refuse(query, f"no thread is left: {error}.")

    def _refuse(self, query: Query, reason: str) -> None:
        error = ServiceBusyError(self._full_name, reason)
        self._log_busy(error)
        _fail(query, error)

    def _pass_on(self, query: Query, text: str) -> None:
        """Answer with the unchanged text of a busy service.

        Handlers that call each other would otherwise each put their own text in front of it.
        """
        kind = ServiceBusyError.__name__
        if not is_from(self._full_name, text):  # our own was logged when it was raised
            self._log_busy(handler_raised(self._full_name, kind, text))
        _send_error(query, kind, text)

    def _log_busy(self, error: ServiceException) -> None:
        """Log that a service is busy, every `BUSY_LOG_S` at most, as this may happen often."""
        now = self.node.clock.now()
        with self._lock:
            if now < self._busy_logged + BUSY_LOG_S:
                return
            self._busy_logged = now
        logger.error("%s", error)

    def _begin_call(self) -> bool:
        with self._lock:
            if self._running >= CALLS_AT_ONCE:
                return False
            self._running += 1
            return True

    def _end_call(self) -> None:
        with self._lock:
            self._running -= 1

    def _answer(self, query: Query) -> None:
        try:
            self._reply(query)
        finally:
            self._end_call()

    def _reply(self, query: Query) -> None:
        try:
            request = self._end.read_request(query)
        except DeserializationError as error:
            self._report_unreadable("a request cannot be read", error)
            _send_error(query, "", f"the request cannot be read: {error}")
            return
        if border.listeners:
            number = next(border.numbers)
            border.tell("asked", self.node, self._full_name, self.type, number, request)
        try:
            response = self._respond(self.handler(request))
            self._end.reply(query, response)
        except BaseException as error:  # also for sys.exit(), the caller waits for an answer
            busy = _find_busy(error)
            if busy:
                self._pass_on(query, busy)
            else:
                if isinstance(error, Exception | SystemExit):  # not when a virtual clock ends it
                    logger.exception("service /%s: the handler raised", self._full_name)
                _fail(query, error)
            if not isinstance(error, Exception):
                raise
        finally:
            query.finish()

    def _report_unreadable(self, what: str, error: Exception) -> None:
        """Log what is wrong with a request, once per kind, as a caller may send many of them."""
        text = f"service /{self._full_name}: {what}: {error}"
        self._readable.report(what, ActionlibError(text))

    def _respond(self, result: object) -> Message:
        # The return values that rospy accepts.
        make: Callable[..., Message] = self.response_class
        if isinstance(result, self.response_class):
            response: Message = result
            return response
        if isinstance(result, dict):
            return make(**result)
        if isinstance(result, (tuple, list)):
            return make(*result)
        if result is None and self.response_class.__slots__:
            name = self.response_class.__name__
            raise ServiceException(
                self._full_name,
                f"the handler returned None; expected {name}, a dict or its field values",
            )
        return make() if result is None else make(result)


_BUSY = (
    "{} calls are running; expected fewer. Try checking whether the handler calls its own "
    "service, directly or through another, or a handler that returns sooner."
)


def _fail(query: Query, error: BaseException) -> None:
    _send_error(query, type(error).__name__, text_of(error))


def _send_error(query: Query, kind: str, text: str) -> None:
    query.reply_error(json.dumps({"type": kind, "text": text}))
    query.finish()


def _find_busy(error: BaseException) -> str:
    """Return the text of a `ServiceBusyError` of ours or of a service that the handler called.

    "" for other errors.
    """
    if isinstance(error, ServiceBusyError):
        return str(error)
    if isinstance(error, ServiceException) and error.remote_type == ServiceBusyError.__name__:
        return error.remote_text
    return ""


def _caller_of(query: Query) -> Endpoint:
    """Return an end for a caller with another type; callers have no token."""
    encoding = parse_encoding(query.encoding)
    return Endpoint(Kind.SERVICE, query.key, encoding.type, encoding.md5, "", "", 0)
