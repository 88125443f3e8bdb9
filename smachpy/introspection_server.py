"""`IntrospectionServer`: a running machine, to be watched from elsewhere.

Of every container, on the topics of SMACH, as smach_msgs:

    <server>/smach/container_structure   its children and transitions, latched
    <server>/smach/container_status      what is active, and its userdata, latched
    <server>/smach/container_init        commands that choose where the next run begins

and of the machine as a whole, as JSON in std_msgs/String:

    <server>/smach/description           `smachpy.introspection.StateRecord`, latched
    <server>/smach/events                `smachpy.events`, each with a sequence number `seq`
    <server>/smach/history               what happened before, a service (`smachpy.feed`)
    <server>/smach/control               commands, where they are obeyed (`smachpy.remote_control`)

Everything is sent when it changes and only then; userdata is JSON, nothing is ever pickled.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.clock import SerialExecutor
from actionlib_core.interfaces.smach_msgs.msg import (
    SmachContainerInitialStatusCmd,
    SmachContainerStatus,
    SmachContainerStructure,
)
from actionlib_core.interfaces.std_msgs.msg import Header
from actionlib_core.node import get_node
from actionlib_core.time import Time
from actionlib_core.topic import Publisher, Subscriber
from actionlib_core.transport import Quality
from actionlib_core.wire import encoding_of
from smachpy import log
from smachpy._runtime.pace import Pace
from smachpy.container import Container
from smachpy.exceptions import InvalidStateError, SmachError
from smachpy.feed import DESCRIPTION_TOPIC, EVENTS_TOPIC, STOP_S, Feed
from smachpy.remote_control import ControlServer
from smachpy.user_data import UserData
from smachpy.userdata_json import dumps, loads

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from actionlib_core.transport import PublisherPort
    from smachpy.state import State
    from smachpy.tape import Tape

__all__ = [
    "DESCRIPTION_TOPIC",
    "EVENTS_TOPIC",
    "INIT_TOPIC",
    "STATUS_TOPIC",
    "STRUCTURE_TOPIC",
    "ContainerProxy",
    "IntrospectionServer",
]

STATUS_TOPIC = "/smach/container_status"
INIT_TOPIC = "/smach/container_init"
STRUCTURE_TOPIC = "/smach/container_structure"

REMOTE_INIT = "REMOTE_INIT"
REFUSED = "REMOTE_INIT_REFUSED: "
REQUEST_ID = "$id"

STATUS_INTERVAL_S = 0.05
"""A container's status is sent at most so often; events are never held back."""

READ_TRIES = 5

LONGEST_VALUE = 10_000
"""Userdata values with more elements are shown by their size."""


class _Topic:
    """A topic on which each container keeps a last message for those who come later.

    Threads: each container's messages come from one thread at a time.
    """

    def __init__(self, name: str, message_class: Any, node: Node) -> None:
        self.node = node
        self._end = Publisher(name, message_class, node=node)  # shows that we are there
        self._message_class = message_class
        self._ports: dict[str, PublisherPort] = {}

    def publish(self, path: str, fields: dict[str, Any]) -> None:
        """Send a message of the container at `path`.

        Raises:
            TransportError: the node is closed.
        """
        port = self._ports.get(path)
        if port is None:
            port = self._ports[path] = self.node.transport.publisher(
                self._end.resolved_name,
                encoding_of(self._message_class),
                Quality(express=True, latch=True),
            )
        stamp = Time(0, self.node.clock.time_ns())
        port.put(self._message_class(header=Header(stamp=stamp), **fields).to_bytes())

    def close(self) -> None:
        """Leave the topic."""
        for port in self._ports.values():
            port.close()
        self._end.unregister()


class _Topics:
    """What containers are shown on, and the thread that sends.

    Attributes:
        structure: Children and transitions.
        status: What is active.
        executor: Sends.
    """

    def __init__(self, server_name: str, node: Node) -> None:
        self.structure = _Topic(server_name + STRUCTURE_TOPIC, SmachContainerStructure, node)
        self.status = _Topic(server_name + STATUS_TOPIC, SmachContainerStatus, node)
        self.executor = SerialExecutor(node.clock, f"introspection {server_name}")

    def close(self) -> None:
        """Leave the topics."""
        self.structure.close()
        self.status.close()


class ContainerProxy:
    """Shows one container; `IntrospectionServer` makes one for each.

    Args:
        server_name: First part of the topics' names.
        container: What to show.
        path: What to call it, "/SM_ROOT/DRIVE".
        update_rate: As SMACH takes it; there are no heartbeats here.
        node: Where to send; the current node when None.

    Attributes:
        path: What the container is called.

    Raises:
        InvalidStateError: `container` is none.
    """

    def __init__(
        self,
        server_name: str,
        container: State,
        path: str,
        update_rate: float | Duration = 2.0,
        *,
        node: Node | None = None,
    ) -> None:
        if not isinstance(container, Container):
            raise InvalidStateError(
                f"introspection of {path!r}: got {container!r}; expected a container."
            )
        del update_rate
        self._server_name = server_name
        self._container = container
        self.path = path
        self._node = node
        self._own_topics: _Topics | None = None
        self._topics: _Topics | None = None
        self._commands: Subscriber[Any] | None = None
        self._pace: Pace | None = None
        self._tape: Tape | None = None
        self._forget: Callable[[], None] | None = None
        self._info = "Initial state"
        self._sent: dict[str, Any] = {}

    def start(self) -> None:
        """Show and obey, from now on; a second call does nothing."""
        if self._topics is not None:
            return
        node = get_node() if self._node is None else self._node
        self._own_topics = _Topics(self._server_name, node)
        self.show(self._own_topics)
        self._commands = Subscriber(
            self._server_name + INIT_TOPIC, SmachContainerInitialStatusCmd, self.obey, node=node
        )
        self._forget = node.on_close(self.stop)  # the newest are closed first: before our topics

    def show(self, topics: _Topics, *, listen: bool = True) -> None:
        """Send structure and status on `topics`, and from now on what changes.

        Args:
            topics: Where to.
            listen: Find out by itself when something changes; else `mark` is called.
        """
        self._topics = topics
        clock = topics.status.node.clock
        pace = self._pace = Pace(clock, topics.executor, self._update, STATUS_INTERVAL_S)
        self._update()
        if listen:
            self._tape = self._container.tape(pace.mark, limit=1)

    def mark(self, kind: str) -> None:
        """Send what has changed, soon; `kind` of event tells why."""
        self._info = kind
        pace = self._pace
        if pace is not None:
            pace.mark()

    def stop(self) -> None:
        """Send the last status and leave the topics; a second call does nothing."""
        topics, pace = self._topics, self._pace
        if topics is None or pace is None:
            return
        pace.close()
        if self._forget is not None:
            self._forget()
        if self._tape is not None:
            self._tape.close()
        if self._commands is not None:
            self._commands.unregister()
        topics.executor.join(STOP_S)
        self._update()
        self._topics = self._pace = self._forget = self._tape = self._commands = None
        self._sent.clear()
        if self._own_topics is not None:
            self._own_topics.close()
            self._own_topics = None

    def obey(self, command: Any) -> bool:
        """Carry out a SmachContainerInitialStatusCmd; whether it was for this container.

        The answer is a status whose `info` begins with the command's request id (the entry "$id" of
        its userdata, if any) and goes on with "REMOTE_INIT", or "REMOTE_INIT_REFUSED: " and why.
        """
        if command.path != self.path:
            return False
        request = ""
        try:
            values = loads(command.local_data)
            request = str(values.pop(REQUEST_ID, ""))
            userdata = UserData()
            userdata.update(values)
            self._container.set_initial_state(list(command.initial_states), userdata)
        except (SmachError, ValueError) as error:
            log.logwarn(f"{self.path}: initial state was not set from remote: {error}")
            self._send_status(f"{request}{REFUSED}{error}")
        else:
            log.loginfo(f"{self.path}: initial state set from remote: {command.initial_states}")
            self._send_status(f"{request}{REMOTE_INIT}")
        return True

    def _update(self) -> None:
        """Send what has changed."""
        while self._tape is not None and (records := self._tape.read()):
            self._info = records[-1]["kind"]
        structure = self._describe_structure()
        if self._topics is not None and structure != self._sent.get("structure"):
            self._sent["structure"] = structure
            self._topics.structure.publish(self.path, structure)
        self._send_status(self._info, only_changes=True)

    def _send_status(self, info: str, *, only_changes: bool = False) -> None:
        status = self._describe_status()
        if self._topics is None or (only_changes and status == self._sent.get("status")):
            return
        self._sent["status"] = status
        self._topics.status.publish(self.path, status | {"info": info})

    def _describe_structure(self) -> dict[str, Any]:
        edges = list(self._container.get_internal_edges())
        return {
            "path": self.path,
            "children": list(self._container.get_children()),
            "internal_outcomes": [str(outcome) for outcome, _, _ in edges],
            "outcomes_from": [str(source) for _, source, _ in edges],
            "outcomes_to": [str(target) for _, _, target in edges],
            "container_outcomes": list(self._container.get_registered_outcomes()),
        }

    def _describe_status(self) -> dict[str, Any]:
        return {
            "path": self.path,
            "initial_states": list(self._container.get_initial_states()),
            "active_states": list(self._container.get_active_states()),
            "local_data": _describe_userdata(self._container.userdata),
        }


def _describe_userdata(userdata: UserData) -> str:
    """Return userdata as JSON, while states may be changing it in other threads."""
    values = dict(userdata._data)  # noqa: SLF001  at once, so that no key vanishes meanwhile
    for _ in range(READ_TRIES):
        try:
            return dumps(values, longest=LONGEST_VALUE)
        except RuntimeError:  # a dict or set has changed its size while it was read
            continue
    return dumps({key: f"<{type(value).__name__} that changes>" for key, value in values.items()})


class IntrospectionServer:
    """Shows a machine and all containers in it.

    Args:
        server_name: First part of the topics' names.
        state: The machine.
        path: What to call it, "/SM_ROOT".
        obey: Take commands that choose the initial state; False only shows.
        control: Take all the commands of `machine.control`, from everybody on the network.
        node: Where to send; the current node when None.

    Raises:
        InvalidStateError: `state` is no container.

    Threads: `start` and `stop` by their caller; messages are sent in a thread of their own, so that
        the machine never waits for the network.
    """

    def __init__(
        self,
        server_name: str,
        state: State,
        path: str,
        *,
        obey: bool = True,
        control: bool = False,
        node: Node | None = None,
    ) -> None:
        self._server_name = server_name
        self._state = state
        self._path = path
        self._obey = obey
        self._controlled = control
        self._control: ControlServer | None = None
        self._node = node
        self._topics: _Topics | None = None
        self._proxies: list[ContainerProxy] = []
        self._feed: Feed | None = None
        self._commands: Subscriber[Any] | None = None
        self._forget: Callable[[], None] | None = None
        if not isinstance(state, Container):
            raise InvalidStateError(
                f"IntrospectionServer {server_name!r}: got {state!r}; expected a container."
            )

    def start(self) -> None:
        """Begin to show the machine; a second call does nothing."""
        if self._forget is not None:
            return
        node = get_node() if self._node is None else self._node
        self._node = node
        self.construct(self._server_name, self._state, self._path)
        self._topics = _Topics(self._server_name, node)
        for proxy in self._proxies:
            proxy.show(self._topics, listen=False)
        assert isinstance(self._state, Container)
        if self._controlled:
            self._control = ControlServer(self._server_name, self._state, self._path, node)
        self._feed = Feed(
            self._server_name,
            self._state,
            self._path,
            node,
            control=self._control,
            on_paths=self._mark,
        )
        if self._obey:
            self._commands = Subscriber(
                self._server_name + INIT_TOPIC,
                SmachContainerInitialStatusCmd,
                self._on_command,
                node=node,
            )
        self._forget = node.on_close(self.stop)

    def stop(self) -> None:
        """Send the last status and leave the topics; a second call does nothing."""
        forget, self._forget = self._forget, None
        if forget is None:
            return
        forget()
        if self._commands is not None:
            self._commands.unregister()
        if self._control is not None:
            self._control.close()
        if self._feed is not None:
            self._feed.close()
        self.clear()
        if self._topics is not None:
            self._topics.close()

    def construct(self, server_name: str, state: State, path: str) -> None:
        """Make the proxies of a container and of all below it; `start` does it."""
        if not isinstance(state, Container):
            return
        self._proxies.append(ContainerProxy(server_name, state, path, node=self._node))
        for label, child in state.get_children().items():
            self.construct(server_name, child, f"{path}/{label}")

    def clear(self) -> None:
        """Stop the proxies and forget them."""
        for proxy in self._proxies:
            proxy.stop()
        self._proxies.clear()

    def _mark(self, kinds: dict[str, str]) -> None:
        """Let the containers at the paths in `kinds`, and above them, send what has changed."""
        touched: dict[str, str] = {}
        for path, kind in kinds.items():
            while path:
                touched[path] = kind
                path = path.rpartition("/")[0]  # noqa: PLW2901  one up
        for proxy in self._proxies:
            if proxy.path in touched:
                proxy.mark(touched[proxy.path])

    def _on_command(self, command: Any) -> None:
        if not any(proxy.obey(command) for proxy in self._proxies):
            log.logwarn(
                f"{self._server_name}: initial state was not set from remote: got path "
                f"{command.path!r}; expected one of {[p.path for p in self._proxies]}."
            )
