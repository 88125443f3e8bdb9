"""`IntrospectionServer`: shows a running machine on the network.

For every container, on SMACH's topics, as smach_msgs:

    <server>/smach/container_structure   its children and transitions, latched
    <server>/smach/container_status      its active states and userdata, latched
    <server>/smach/container_init        commands that set the initial state of the next run

and for the machine as a whole, in JSON:

    <server>/smach/description           `smachpy.introspection.StateRecord`, latched
    <server>/smach/events                `smachpy.events`, each with a sequence number `seq`
    <server>/smach/history               the run so far, a service (`smachpy.network.feed`)
    <server>/smach/control               commands, a service (`smachpy.network.remote_control`)

Messages are sent on change only. Userdata is sent as JSON, never as a pickle.
"""

from __future__ import annotations

import threading
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import SerialExecutor
from actionlib_core.interfaces.smach_msgs.msg import (
    SmachContainerInitialStatusCmd,
    SmachContainerStatus,
    SmachContainerStructure,
)
from actionlib_core.interfaces.std_msgs.msg import Header
from actionlib_core.names import check_name
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import Publisher, Subscriber
from actionlib_core.time import Time
from actionlib_core.transport import Quality
from actionlib_core.wire.encoding import encoding_of
from smachpy.base import log
from smachpy.base.problems import Problems
from smachpy.exceptions import SmachError
from smachpy.machines.container import Container
from smachpy.network.feed import DESCRIPTION_TOPIC, EVENTS_TOPIC, STOP_S, Feed
from smachpy.network.remote_control import ControlServer
from smachpy.userdata.json_text import dumps, loads
from smachpy.userdata.user_data import UserData, data_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from actionlib_core.transport import PublisherPort
    from smachpy.events.buffer import EventBuffer
    from smachpy.machines.state import State
    from smachpy.network.robot_topics import RobotTopics

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
"""Shortest time between two status messages of a container [s]; events are not delayed."""

READ_TRIES = 5

MAX_VALUE_LENGTH = 10_000
"""For userdata values with more elements only the size is sent."""


class _Topics:
    """The topics of structure and status, with a latched message for each container.

    Attributes:
        clock: The node's clock.
        executor: Its thread sends.

    Threads: each container's messages come from one thread at a time.
    """

    def __init__(self, server_name: str, node: Node) -> None:
        self.clock = node.clock
        self.executor = SerialExecutor(node.clock, f"introspection {server_name}")
        self._transport = node.transport
        self._ends: dict[Any, Publisher] = {  # clients find the server by these
            kind: Publisher(server_name + topic, kind, node=node)
            for kind, topic in (
                (SmachContainerStructure, STRUCTURE_TOPIC),
                (SmachContainerStatus, STATUS_TOPIC),
            )
        }
        self._ports: dict[tuple[type, str], PublisherPort] = {}

    def publish(self, kind: Any, fields: dict[str, Any]) -> None:
        """Send a message of the container at `fields["path"]`.

        Raises:
            TransportError: the node is closed.
        """
        key = kind, fields["path"]
        if key not in self._ports:
            self._ports[key] = self._transport.publisher(
                self._ends[kind].resolved_name,
                encoding_of(kind),
                Quality(express=True, latch=True),
            )
        header = Header(stamp=Time(0, self.clock.time_ns()))
        self._ports[key].put(kind(header=header, **fields).to_bytes())

    def close(self) -> None:
        """Leave the topics."""
        for port in self._ports.values():
            port.close()
        for end in self._ends.values():
            end.unregister()


class ContainerProxy:
    """Shows one container; `IntrospectionServer` makes one for each.

    Args:
        server_name: First part of the topics' names.
        container: The container to show.
        path: Its path for viewers, "/SM_ROOT/DRIVE".
        update_rate: Ignored; from SMACH's signature. Here messages are sent on change only.
        node: Node that sends; None for the current node.

    Attributes:
        path: See above.

    Raises:
        InvalidStateError: `container` is not a container, or a name is not a string.
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
        del update_rate
        self._container = _checked("ContainerProxy", server_name, "container", container, path)
        self._server_name = check_name(server_name)
        self.path = path
        self._node = node
        self._own_topics: _Topics | None = None
        self._topics: _Topics | None = None
        self._commands: Subscriber[Any] | None = None
        self._lock = threading.Lock()
        self._marked = False  # an update is scheduled
        self._updated = 0.0  # when it last began, on the clock [s]
        self._buffer: EventBuffer | None = None
        self._forget: Callable[[], None] | None = None
        self._info = "Initial state"
        self._sent: dict[str, Any] = {}

    def start(self) -> None:
        """Start to show the container and to take commands; may be called twice."""
        if self._topics is not None:
            return
        node = get_node() if self._node is None else self._node
        self._own_topics = _Topics(self._server_name, node)
        self.show(self._own_topics)
        self._commands = Subscriber(
            self._server_name + INIT_TOPIC, SmachContainerInitialStatusCmd, self.obey, node=node
        )
        # A node closes the newest first, so `stop` can still use the topics.
        self._forget = node.on_close(self.stop)

    def show(self, topics: _Topics, *, listen: bool = True) -> None:
        """Send structure and status on `topics`, now and after every change.

        Args:
            topics: The topics to use.
            listen: Watch the container's events; if False, the caller calls `mark` after each
                change.
        """
        self._topics = topics
        self._updated = topics.clock.now() - STATUS_INTERVAL_S
        self._update(topics)
        if listen:
            self._buffer = self._container.event_buffer(self.mark, limit=1)

    def mark(self, kind: str = "") -> None:
        """Send changes soon; `kind` is the event behind them, "" if the buffer has it."""
        # Limited to one message each STATUS_INTERVAL_S: changes in between are merged into one.
        with self._lock:
            self._info = kind or self._info
            topics = self._topics
            if topics is None or self._marked:
                return
            self._marked = True
            delay = max(0.0, self._updated + STATUS_INTERVAL_S - topics.clock.now())
        topics.clock.call_later(delay, lambda: topics.executor.submit(self._update_marked))

    def _update_marked(self) -> None:
        with self._lock:
            self._marked, topics = False, self._topics
            if topics is None:
                return
            self._updated = topics.clock.now()
        self._update(topics)

    def stop(self) -> None:
        """Send the last status and leave the topics; may be called twice."""
        with self._lock:
            topics, self._topics = self._topics, None
        if topics is None:
            return
        if self._forget is not None:
            self._forget()
        if self._commands is not None:
            self._commands.unregister()
        topics.executor.join(STOP_S)
        self._update(topics)
        if self._buffer is not None:
            self._buffer.close()
        self._forget = self._buffer = self._commands = None
        self._sent.clear()
        if self._own_topics is not None:
            self._own_topics.close()
            self._own_topics = None

    def obey(self, command: Any) -> bool:
        """Execute a SmachContainerInitialStatusCmd; return whether it was for this container.

        The answer is a status whose `info` begins with the command's request id (the entry "$id" of
        its userdata, if any), followed by "REMOTE_INIT", or "REMOTE_INIT_REFUSED: " and the reason.
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
            self._send_status(self._topics, f"{request}{REFUSED}{error}")
        else:
            log.loginfo(f"{self.path}: initial state set from remote: {command.initial_states}")
            self._send_status(self._topics, f"{request}{REMOTE_INIT}")
        return True

    def _update(self, topics: _Topics) -> None:
        """Send structure and status if they have changed."""
        while self._buffer is not None and (records := self._buffer.read()):
            self._info = records[-1]["kind"]
        structure = self._describe_structure()
        if structure != self._sent.get("structure"):
            self._sent["structure"] = structure
            topics.publish(SmachContainerStructure, structure)
        self._send_status(topics, self._info, only_changes=True)

    def _send_status(
        self, topics: _Topics | None, info: str, *, only_changes: bool = False
    ) -> None:
        status = self._describe_status()
        if topics is None or (only_changes and status == self._sent.get("status")):
            return
        self._sent["status"] = status
        topics.publish(SmachContainerStatus, status | {"info": info})

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


def _checked(where: str, server_name: Any, argument: str, container: Any, path: Any) -> Container:
    """Check the arguments of a proxy or server, and return the container."""
    problems = Problems(f"{where} {server_name!r}")
    problems.network_name("server_name", server_name)
    if not isinstance(container, Container):
        problems.add(f"{argument}: got {container!r}; expected a container.")
    problems.word("path", path)
    problems.raise_all()
    found: Container = container
    return found


def _describe_userdata(userdata: UserData) -> str:
    """Return userdata as JSON, while states may be changing it in other threads."""
    values = dict(data_of(userdata))  # an atomic copy
    for _ in range(READ_TRIES):
        try:
            return dumps(values, longest=MAX_VALUE_LENGTH)
        except RuntimeError:  # a state changed the size of a dict or set meanwhile: try again
            continue
    return dumps({key: f"<{type(value).__name__} that changes>" for key, value in values.items()})


class IntrospectionServer:
    """Shows a machine and all containers in it.

    Args:
        server_name: First part of the topics' names.
        state: The machine.
        path: Its path for viewers, "/SM_ROOT".
        obey: Take commands that set the initial state.
        control: Take all commands of `machine.control`, from anybody on the network.
        node: Node that sends; None for the current node.
        robot: Provides the data of the robot's topics; None for those in `node`'s namespace, while
            somebody watches.
        earlier: Records of earlier processes of the durable run that this one resumes.

    Raises:
        InvalidStateError: `state` is not a container, or a name is not a string.

    Threads: messages are sent in a thread of their own, so that the machine never waits for the
        network.
    """

    def __init__(
        self,
        server_name: str,
        state: Container,
        path: str,
        *,
        obey: bool = True,
        control: bool = False,
        node: Node | None = None,
        robot: RobotTopics | None = None,
        earlier: Sequence[dict[str, Any]] = (),
    ) -> None:
        self._earlier = earlier
        self._robot = robot
        self._state = _checked("IntrospectionServer", server_name, "state", state, path)
        self._server_name = check_name(server_name)
        self._path = path
        self._obey = obey
        self._controlled = control
        self._node = node
        self._topics: _Topics | None = None
        self._proxies: list[ContainerProxy] = []
        self._feed: Feed | None = None
        self._parts: ExitStack | None = None

    def start(self) -> None:
        """Start to show the machine; may be called twice."""
        if self._parts is not None:
            return
        node = self._node = get_node() if self._node is None else self._node
        name, state, path = self._server_name, self._state, self._path
        with ExitStack() as parts:
            self._topics = _Topics(name, node)
            parts.callback(self._topics.close)
            parts.callback(self.clear)
            self.construct(name, state, path)
            for proxy in self._proxies:
                proxy.show(self._topics, listen=False)
            control = None
            if self._controlled:
                control = ControlServer(name, state, path, node)
                parts.callback(control.close)
            self._feed = Feed(
                *(name, state, path, node),
                control=control,
                robot=self._robot,
                earlier=self._earlier,
                on_paths=self._mark,
            )
            parts.callback(self._feed.close)
            if self._obey:
                commands = Subscriber(
                    name + INIT_TOPIC, SmachContainerInitialStatusCmd, self._on_command, node=node
                )
                parts.callback(commands.unregister)
            parts.callback(node.on_close(self.stop))
            self._parts = parts.pop_all()

    def stop(self) -> None:
        """Send the last status and leave the topics; may be called twice."""
        parts, self._parts = self._parts, None
        if parts is not None:
            parts.close()

    def construct(self, server_name: str, state: State, path: str) -> None:
        """Make the proxies of a container and of all containers below it; `start` calls it."""
        if not isinstance(state, Container):
            return
        self._proxies.append(ContainerProxy(server_name, state, path, node=self._node))
        for label, child in state.get_children().items():
            self.construct(server_name, child, f"{path}/{label}")

    def clear(self) -> None:
        """Stop and remove the proxies."""
        for proxy in self._proxies:
            proxy.stop()
        self._proxies.clear()

    def _mark(self, kinds: dict[str, str]) -> None:
        """Let the containers at the paths in `kinds`, and those above, send their changes."""
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
