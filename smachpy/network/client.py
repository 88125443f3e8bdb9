"""`IntrospectionClient`: find machines on the network, watch them, set their initial states."""

from __future__ import annotations

import uuid
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import WaitTimeoutError
from actionlib_core.interfaces.smach_msgs.msg import (
    SmachContainerInitialStatusCmd,
    SmachContainerStatus,
)
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import Publisher, Subscriber, wait_for_message
from actionlib_core.time import to_seconds
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.presence import list_endpoints
from smachpy.base import log
from smachpy.base.problems import Problems
from smachpy.events import from_record
from smachpy.exceptions import SmachError
from smachpy.network.reading import read_description, read_numbered_event
from smachpy.network.server import (
    DESCRIPTION_TOPIC,
    EVENTS_TOPIC,
    INIT_TOPIC,
    REMOTE_INIT,
    REQUEST_ID,
    STATUS_TOPIC,
)
from smachpy.userdata.json_text import dumps, find_lost
from smachpy.userdata.user_data import data_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from smachpy.events import Event
    from smachpy.events.introspection import StateRecord
    from smachpy.userdata.user_data import UserData

__all__ = ["IntrospectionClient"]

ANSWER_S = 5.0
"""Default time for a server to answer [s]."""


class IntrospectionClient:
    """Talks to introspection servers.

    Args:
        node: The node to use; None for the current node.
    """

    def __init__(self, *, node: Node | None = None) -> None:
        self._node = node

    def get_servers(self, *, timeout: float = 1.0) -> list[str]:
        """Return the names of the introspection servers on the network, sorted.

        Blocks: until the network has answered, at most `timeout` [s].
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
            timeout: Longest wait for the server's answer [s]; None for 5 s.

        Returns:
            Whether the server has done it; a refusal is logged with its reason.

        Raises:
            InvalidStateError: an argument has a wrong type, or JSON cannot represent some of the
                userdata; with all problems.

        Blocks: until the answer, at most `timeout`.
        """
        problems = Problems(f"{server}: {path}")
        problems.word("server", server)
        problems.word("path", path)
        labels = problems.names("initial_states", initial_states)
        seconds = ANSWER_S if timeout is None else problems.seconds("timeout", timeout)
        values = {} if initial_userdata is None else dict(data_of(initial_userdata))
        lost = find_lost(values)
        if lost:
            problems.add(
                f"initial_userdata: got {lost}, which JSON cannot carry over; expected numbers, "
                "texts, containers, times and messages."
            )
        problems.raise_all()
        request = uuid.uuid4().hex
        data = dumps({**values, REQUEST_ID: request})
        command = SmachContainerInitialStatusCmd(path, list(labels), data)
        node = self._get_node()
        answered = node.clock.event(f"the answer of {server}")
        answers: list[str] = []

        def take(status: Any) -> None:
            if status.info.startswith(request):  # else a usual status, or an answer to others
                answers.append(status.info.removeprefix(request))
                answered.set()

        with (
            Subscriber(server + STATUS_TOPIC, SmachContainerStatus, take, node=node),
            Publisher(  # latched: the server gets it even if the network connects the two later
                server + INIT_TOPIC, SmachContainerInitialStatusCmd, latch=True, node=node
            ) as commands,
        ):
            commands.publish(command)
            answered.wait(seconds)
        if answers[:1] != [REMOTE_INIT]:
            problem = answers[0] if answers else f"no answer in {seconds} s. Try get_servers()."
            log.logwarn(f"{server}: {path}: initial state not set: {problem}")
        return answers[:1] == [REMOTE_INIT]

    def get_description(self, server: str, *, timeout: float | Duration = ANSWER_S) -> StateRecord:
        """Return the structure of a server's machine.

        Raises:
            SmachError: there is no such server, it does not answer, or sends no structure.

        Blocks: until the answer, at most `timeout` [s].
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
        try:
            return read_description(message.data)
        except ValueError as error:
            raise SmachError(f"introspection server {server!r}: its structure: {error}") from error

    def subscribe(
        self, server: str, listener: Callable[[Event, int], object]
    ) -> Callable[[], None]:
        """Call `listener(event, seq)` with every event of a server's machine from now on.

        Goals and userdata arrive in the form of `smachpy.userdata.shown`. A gap in `seq` is the
        number of events that the server could not send in time.

        Returns:
            A function that ends the subscription.

        Raises:
            InvalidStateError: `listener` cannot be called in this way.

        Threads: the listener runs in a thread of the node's clock.
        """
        problems = Problems(f"events of {server}")
        problems.function("listener", listener, "listener(event, seq)", 2, optional=False)
        problems.raise_all()

        def take(message: Any) -> None:
            try:
                record = read_numbered_event(message.data)
                event = from_record(record)
            except ValueError as error:
                log.logwarn(f"{server}: an event is left out: {error}")
            else:
                listener(event, record["seq"])

        return Subscriber(server + EVENTS_TOPIC, String, take, node=self._get_node()).unregister

    def _get_node(self) -> Node:
        return get_node() if self._node is None else self._node
