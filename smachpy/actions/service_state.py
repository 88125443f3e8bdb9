"""`ServiceState`: a state that calls a service."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, ClassVar

from actionlib_core.exceptions import (
    ServiceException,
    ServiceTimeoutError,
    ServiceUnavailableError,
    WaitTimeoutError,
)
from actionlib_core.node import get_node
from actionlib_core.pubsub.service_proxy import CALL_TIMEOUT_S, ServiceProxy
from smachpy.actions.messages import Incoming, Outgoing, UserCallback
from smachpy.actions.wakeup import PreemptedError, answer_preempt, call_blocking
from smachpy.base import log
from smachpy.base.problems import Problems
from smachpy.base.slips import accepting
from smachpy.engine.frame import clock_of_run, current_scope
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Unpack

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from smachpy.actions.interface import UntimedOptions
    from smachpy.base.names import Names
    from smachpy.events.introspection import Kind

__all__ = ["ServiceState"]

_TIMED_OUT = (ServiceTimeoutError, ServiceUnavailableError, WaitTimeoutError)


class ServiceState(State):
    """Calls a service once. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Each run builds a new request from `request` or `request_key`, then `request_slots`, then
    `request_cb`. 'aborted' means: no server, a server that died, or a handler that raised; the
    reason is logged.

    Args:
        service_name: Name of the service.
        service_spec: Its class.
        request: The request, or the initial one for the slots and the callback.
        request_cb: Called as `request_cb(userdata, request, *request_cb_args,
            **request_cb_kwargs)`; changes the request or returns another. Its `cb_interface` is
            added, like that of `response_cb`.
        request_cb_args: Arguments for it.
        request_cb_kwargs: Keyword arguments for it.
        request_key: Userdata key that holds the request.
        request_slots: Names of request fields that are set from userdata keys of the same name.
        response_cb: Called as `response_cb(userdata, response, *response_cb_args,
            **response_cb_kwargs)`; may return the outcome.
        response_cb_args: Arguments for it.
        response_cb_kwargs: Keyword arguments for it.
        response_key: Userdata key that gets the response.
        response_slots: Names of response fields that are written to keys of the same name.
        input_keys: More keys to read, for the callbacks.
        output_keys: More keys to write, for the callbacks.
        outcomes: More outcomes, for `response_cb`.
        timeout: Time after which it ends with `timeout_outcome` [s], including the wait for the
            server; None for no limit.
        timeout_outcome: Outcome after a timeout.
        node: Node of the client; None for the current node.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument does not fit the service; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "service"

    def __init__(
        self,
        service_name: str,
        service_spec: Any,
        request: Any = None,
        request_cb: Callable[..., Any] | None = None,
        request_cb_args: Iterable[Any] = (),
        request_cb_kwargs: Mapping[str, Any] | None = None,
        request_key: str | None = None,
        request_slots: Iterable[str] = (),
        response_cb: Callable[..., str | None] | None = None,
        response_cb_args: Iterable[Any] = (),
        response_cb_kwargs: Mapping[str, Any] | None = None,
        response_key: str | None = None,
        response_slots: Iterable[str] = (),
        input_keys: Names = (),
        output_keys: Names = (),
        outcomes: Names = (),
        *,
        timeout: float | Duration | None = CALL_TIMEOUT_S,
        timeout_outcome: str = "aborted",
        node: Node | None = None,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems(f"{type(self).__name__} {service_name!r}")
        problems.kind_of("service_spec", service_spec, "_request_class", "a class of services")
        problems.raise_all()
        given = ("succeeded", "aborted", "preempted", *problems.names("outcomes", outcomes))
        with problems:
            super().__init__(given, input_keys, output_keys, **options)
        self.__service_name = problems.network_name("service_name", service_name)
        self.__service_spec = service_spec
        self.__request = Outgoing(
            "request",
            service_spec._request_class,
            copy.deepcopy(_as_request(service_spec, request)),
            request_key,
            problems.names("request_slots", request_slots),
            UserCallback.of(
                problems,
                "request_cb",
                ("userdata", "request"),
                request_cb,
                request_cb_args,
                request_cb_kwargs,
            ),
        )
        self.__response = Incoming(
            "response",
            service_spec._response_class,
            response_key,
            problems.names("response_slots", response_slots),
            UserCallback.of(
                problems,
                "response_cb",
                ("userdata", "response"),
                response_cb,
                response_cb_args,
                response_cb_kwargs,
            ),
        )
        self.__timeout_s = problems.seconds("timeout", timeout)
        self.__timeout_outcome = problems.word("timeout_outcome", timeout_outcome)
        self.__node = node
        self.__proxy: ServiceProxy | None = None
        problems.add(*self.__request.problems(), *self.__response.problems())
        problems.raise_all()
        self.register_outcomes([timeout_outcome])
        self._smachpy.code = (self.__request,)
        self.__request.declare(self)
        self.__response.declare(self)

    def execute(self, ud: Any) -> str:
        """Call the service.

        An exception of a callback is passed on.

        Raises:
            FieldError: a field of the request has a wrong type.
            TypeMismatchError: the server is of another type.

        Blocks: until the answer, `timeout` or a preempt. After a preempt the server may continue
            with the call.
        """
        if answer_preempt(self):
            return "preempted"
        request = self.__request.build(ud)  # may block in the user's callback
        if answer_preempt(self):
            return "preempted"
        proxy, clock = self.__get_proxy(), clock_of_run()
        start = clock.now()

        def call() -> Any:
            proxy.wait_for_service(self.__timeout_s)
            if self.__timeout_s is not None:  # one timeout for the wait and the call together
                proxy.timeout = max(0.0, self.__timeout_s - (clock.now() - start))
            return proxy.call(request)

        try:
            response = call_blocking(
                self, call, self.__drop_proxy, f"call of {proxy.resolved_name}"
            )
        except PreemptedError:
            return "preempted"
        except (ServiceException, WaitTimeoutError) as error:
            scope = current_scope()
            where = f"ServiceState {self.__service_name!r}" if scope is None else scope.path
            log.logwarn(f"{where}: service '{self.__service_name}': {error}")
            return self.__timeout_outcome if isinstance(error, _TIMED_OUT) else "aborted"
        self.__response.store(ud, response)
        chosen = self.__response.callback(ud, response)
        return "succeeded" if chosen is None else chosen

    def __get_proxy(self) -> ServiceProxy:
        """Return the proxy on the node; make one if there is none, or the node has changed."""
        node = self.__node if self.__node is not None else get_node()
        proxy = self.__proxy
        if proxy is None or proxy.node is not node or node.closed:
            self.__drop_proxy()
            proxy = self.__proxy = ServiceProxy(
                self.__service_name, self.__service_spec, timeout=self.__timeout_s, node=node
            )
        return proxy

    def __drop_proxy(self) -> None:
        """Close the proxy; a running call ends with an error at once."""
        proxy, self.__proxy = self.__proxy, None
        if proxy is not None:
            proxy.close()

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the service and the timeout."""
        kind, details = super().describe_details()
        own = [("service", self.__service_name), ("type", str(self.__service_spec._type))]
        if self.__timeout_s is not None:
            own.append(("timeout", f"{self.__timeout_s:g} s -> {self.__timeout_outcome}"))
        return kind, (*own, *details)


def _as_request(service_spec: Any, given: Any) -> Any:
    """In programs for ROS 1, convert a plain value to a request, as rospy does."""
    kind = service_spec._request_class
    if given is None or isinstance(given, kind) or not kind.__slots__ or not accepting():
        return given
    return kind(given)
