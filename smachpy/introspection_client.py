"""`IntrospectionClient`: find machines on the network, watch them, choose where they begin."""

from __future__ import annotations

import json
import uuid
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import WaitTimeoutError
from actionlib_core.interfaces.smach_msgs.msg import (
    SmachContainerInitialStatusCmd,
    SmachContainerStatus,
)
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.node import get_node
from actionlib_core.presence import Kind, list_endpoints
from actionlib_core.time import to_seconds
from actionlib_core.topic import Publisher, Subscriber, wait_for_message
from smachpy import log
from smachpy.events import from_record
from smachpy.exceptions import InvalidStateError, SmachError
from smachpy.introspection import StateRecord
from smachpy.introspection_server import (
    DESCRIPTION_TOPIC,
    EVENTS_TOPIC,
    INIT_TOPIC,
    REFUSED,
    REMOTE_INIT,
    REQUEST_ID,
    STATUS_TOPIC,
)
from smachpy.userdata_json import dumps, find_lost

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from smachpy.events import Event
    from smachpy.user_data import UserData

__all__ = ["IntrospectionClient"]

ANSWER_S = 5.0
"""How long a server has to answer when the caller does not say."""


class IntrospectionClient:
    """Talks to introspection servers.

    Args:
        node: Where; the current node when None.
    """

    def __init__(self, *, node: Node | None = None) -> None:
        self._node = node

    def get_servers(self, *, timeout: float = 1.0) -> list[str]:
        """Return the names of the introspection servers that are there, sorted.

        Blocks: until the network has answered, `timeout` [s] at most.
        """
        transport = self._get_node().transport
        names = {
            end.name for end in list_endpoints(transport, kind=Kind.PUBLISHER, timeout=timeout)
        }
        end = STATUS_TOPIC
        return sorted(f"/{name.removesuffix(end)}" for name in names if name.endswith(end))

    def set_initial_state(
        self,
        server: str,
        path: str,
        initial_states: Sequence[str],
        initial_userdata: UserData | None = None,
        timeout: float | Duration | None = None,
    ) -> bool | None:
        """Choose where the next run of a container begins, and set userdata of it.

        Args:
            server: Name of the introspection server.
            path: Path of the container.
            initial_states: Labels.
            initial_userdata: Values to set.
            timeout: Longest wait for the server's answer [s]; None: 5 s.

        Returns:
            Whether the server has done it; why it has not is logged.

        Raises:
            InvalidStateError: userdata that JSON cannot carry over; all of it is named.

        Blocks: until the answer, `timeout` at most.
        """
        values = {} if initial_userdata is None else dict(initial_userdata._data)  # noqa: SLF001
        lost = find_lost(values)
        if lost:
            raise InvalidStateError(
                f"{server}: {path}: userdata: got {lost}, which JSON cannot carry over; expected "
                "numbers, texts, containers, times and messages."
            )
        request = uuid.uuid4().hex
        data = dumps({**values, REQUEST_ID: request})
        command = SmachContainerInitialStatusCmd(path, list(initial_states), data)
        exchange = _Exchange(server, command, request, self._get_node())
        return exchange.run(ANSWER_S if timeout is None else to_seconds(timeout))

    def get_description(self, server: str, *, timeout: float | Duration = ANSWER_S) -> StateRecord:
        """Return the structure of a server's machine.

        Raises:
            SmachError: there is no such server, or it does not answer.

        Blocks: until the answer, `timeout` [s] at most.
        """
        topic = server + DESCRIPTION_TOPIC
        try:
            message = wait_for_message(topic, String, timeout, node=self._get_node())
        except WaitTimeoutError as error:
            known = self.get_servers()
            raise SmachError(
                f"introspection server {server!r}: got no answer in {to_seconds(timeout):g} s; "
                f"servers that are there: {known}."
            ) from error
        return StateRecord.from_json(message.data)

    def subscribe(
        self, server: str, listener: Callable[[Event, int], object]
    ) -> Callable[[], None]:
        """Call `listener(event, seq)` with every event of a server's machine from now on.

        Goals and userdata arrive as plain values or as their `repr`. A gap in `seq` is the number
        of events that the server could not send in time.

        Returns:
            A function that ends it.

        Threads: the listener runs in a thread of the node's clock.
        """

        def take(message: Any) -> None:
            record = json.loads(message.data)
            number = record.pop("seq")
            listener(from_record(record), number)

        return Subscriber(server + EVENTS_TOPIC, String, take, node=self._get_node()).unregister

    def _get_node(self) -> Node:
        return get_node() if self._node is None else self._node


class _Exchange:
    """One command and its answer.

    The command is latched, so that a server gets it when the network has connected the two.
    """

    def __init__(self, server: str, command: Any, request: str, node: Node) -> None:
        self._server = server
        self._command = command
        self._request = request
        self._node = node
        self._answered = node.clock.event()
        self._accepted = False

    def run(self, timeout: float) -> bool:
        """Send the command and return whether the server has done it."""
        node, server = self._node, self._server
        with (
            Subscriber(server + STATUS_TOPIC, SmachContainerStatus, self._on_status, node=node),
            Publisher(
                server + INIT_TOPIC, SmachContainerInitialStatusCmd, latch=True, node=node
            ) as commands,
        ):
            commands.publish(self._command)
            if not self._answered.wait(timeout):
                log.logwarn(
                    f"{server}: {self._command.path}: initial state not set: no answer in "
                    f"{timeout:g} s. Try get_servers()."
                )
        return self._accepted

    def _on_status(self, status: Any) -> None:
        answer = status.info.removeprefix(self._request)
        if answer == status.info:
            return  # news, or an answer to somebody else
        if answer.startswith(REFUSED):
            log.logwarn(f"{self._server}: {self._command.path}: {answer}")
        self._accepted = answer == REMOTE_INIT
        self._answered.set()
