"""The bridge: watches both networks, decides which names are bridged, and bridges them."""

from __future__ import annotations

import logging
import os
import threading
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.exceptions import ActionlibError, InvalidNameError, Ros1Error
from actionlib_core.names import check_name
from actionlib_core.ros1.actions import ActionBridge
from actionlib_core.ros1.answers import SystemState
from actionlib_core.ros1.definitions import Definitions
from actionlib_core.ros1.node import ANY, Ros1Node
from actionlib_core.ros1.plan import BridgePlan, Wanted, make_plan, without
from actionlib_core.ros1.services import ServiceBridge
from actionlib_core.ros1.sides import BRIDGE, Sides
from actionlib_core.ros1.topics import TopicBridge
from actionlib_core.shutdown import current_shutdown
from actionlib_core.transport.tokens import parse_token, token_pattern
from actionlib_core.wire import looked_for

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Self

    from actionlib_core.node import Node
    from actionlib_core.transport import Presence
    from actionlib_core.transport.tokens import Endpoint

B = TypeVar("B", ActionBridge, TopicBridge, ServiceBridge)

log = logging.getLogger("actionlib_core")

# A ROS 1 master announces neither new services and subscribers nor its own restart, so it is asked.
LOOK_S = 1.0
BRIDGES = "@smachpy_ros1"  # prefix of the tokens by which bridges find each other
CLOSE_S = 5.0


class Ros1Bridge:
    """Carries actions, topics and services between a ROS 1 robot and our network.

    Args:
        node: The node on our network, for the bridge only: messages of its session are not bridged.
            The bridge closes it.
        master: Address of the robot's master, "http://robot:11311".
        wanted: The names to bridge.
        namespace: Prefix of the robot's names on our network, "robot_1"; "" for none.
        host: Name or address under which the robot finds this computer; see `Ros1Node`.
        status_timeout: An action server in ROS 1 without a status list for this time counts as
            gone [s].
        service_timeout: Longest time of a service call through the bridge [s].

    Attributes:
        name: Name of the bridge's node in ROS 1.
        plan: The names that are bridged now.

    Raises:
        Ros1Error: the master's address cannot be used.
        TransportError: the node is closed.

    Threads: has its own. Every method may be called from any thread.
    """

    def __init__(
        self,
        node: Node,
        master: str,
        wanted: Wanted,
        *,
        namespace: str = "",
        host: str = "",
        status_timeout: float = 5.0,
        service_timeout: float = 600.0,
    ) -> None:
        self.name = f"{BRIDGE}{os.getpid()}_{node.transport.session_id[:12]}"
        self.plan = BridgePlan({}, {}, {})
        self._wanted = wanted
        self._node = node
        self._clock = node.clock
        self._status_timeout = status_timeout
        self._service_timeout = service_timeout
        self._ros = Ros1Node(self.name, master, clock=node.clock, host=host)
        self._ros.on_ended = self._wake
        self._sides = Sides(node, self._ros, namespace)
        self._definitions = Definitions(node)
        self._actions: dict[str, ActionBridge] = {}
        self._topics: dict[str, TopicBridge] = {}
        self._services: dict[str, ServiceBridge] = {}
        self._lock = threading.Lock()
        self._ends: dict[str, Endpoint] = {}
        self._bridges: set[str] = set()  # sessions of bridges, ours among them
        self._changed = node.clock.event("a change on the bridge's networks")
        self._looked = node.clock.event("the bridge's first look at the master")
        self._over = node.clock.event("the end of the bridge")
        self._answered = False
        self._is_there = True
        self._closing = False
        self._forget = current_shutdown().at_exit(self.close)
        lists = looked_for.actions, looked_for.services
        self._forget_names = [names.on_new(self._wake) for names in lists]
        transport = node.transport
        self._parts = [
            transport.declare_alive(f"{BRIDGES}/{transport.session_id}"),
            transport.watch_alive(f"{BRIDGES}/*", self._on_bridge),
            transport.watch_alive(token_pattern(), self._on_end),
        ]
        self._task = node.clock.spawn(self._run, name="ros1-bridge")

    @property
    def master(self) -> str:
        """Address of the robot's master."""
        return self._ros.master

    @property
    def ended(self) -> str:
        """Why the bridge has ended by itself; "" while it has not."""
        return self._ros.ended

    def wait_for_master(self, timeout: float | None = None) -> bool:
        """Wait until the master has answered once; return whether it has.

        Blocks: `timeout` [s] at most; None: until it has answered or the bridge is closed.
        """
        self._looked.wait(timeout)
        return self._answered

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the bridge has ended by itself or was closed; return whether it has.

        Blocks: `timeout` [s] at most; None: until it has ended.
        """
        return self._over.wait(timeout)

    def get_param(self, name: str) -> Any:
        """Return a parameter of the robot's parameter server, or a tree of them as a dict.

        Raises:
            KeyError: there is no parameter of that name.
            Ros1Error: the master does not answer.

        Blocks: a few seconds at most.
        """
        full = name if name.startswith("/") else f"/{name}"
        if not self._ros.ask("hasParam", full):
            raise KeyError(name)
        return self._ros.ask("getParam", full)

    def param_names(self) -> list[str]:
        """Return the names of all parameters; raises and blocks as `get_param`."""
        return sorted(map(str, self._ros.ask("getParamNames")))

    def state(self) -> SystemState:
        """Return the nodes of the robot that publish, subscribe and serve, by name.

        Raises:
            Ros1Error: the master does not answer.

        Blocks: a few seconds at most.
        """
        return without(self._ros.state(), BRIDGE)

    def published_topics(self) -> dict[str, str]:
        """Return the topics that nodes of the robot publish, name -> type; raises as `state`."""
        topics = self.state().publishers
        types = self._ros.types()
        return {topic: types.get(topic, ANY) for topic in sorted(topics)}

    def close(self) -> None:
        """End the bridge and unregister everything in ROS 1; a second call does nothing.

        Blocks: less than a second if the master answers, `CLOSE_S` at most.
        """
        with self._lock:
            if self._closing:
                return
            self._closing = True
        # First end the loop, which makes bridges; then close these; the connections last.
        self._forget()
        for forget in self._forget_names:
            forget()
        self._changed.set()
        self._looked.set()
        self._task.join(CLOSE_S)
        for part in self._parts:
            part.close()
        every: list[ActionBridge | TopicBridge | ServiceBridge] = [
            *self._actions.values(),
            *self._topics.values(),
            *self._services.values(),
        ]
        for bridge in every:
            bridge.close()
        self._ros.close()
        self._definitions.close()
        self._node.close()
        self._over.set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- our network ---------------------------------------------------------------------------

    def _wake(self) -> None:
        self._changed.set()

    def _on_end(self, presence: Presence) -> None:
        end = parse_token(presence.key)
        if end is None:
            return
        with self._lock:
            if presence.alive:
                self._ends[presence.key] = end
            else:
                self._ends.pop(presence.key, None)
        if end.session != self._node.transport.session_id:
            self._changed.set()

    def _on_bridge(self, presence: Presence) -> None:
        session = presence.key.rpartition("/")[2]
        with self._lock:
            (self._bridges.add if presence.alive else self._bridges.discard)(session)
        self._changed.set()

    def _ends_by_name(self) -> tuple[dict[str, list[Endpoint]], set[str]]:
        """Return our network's endpoints by name in ROS 1, and names that another bridge has."""
        own = self._node.transport.session_id
        with self._lock:
            ends, bridges = list(self._ends.values()), set(self._bridges)
        found: dict[str, list[Endpoint]] = {}
        elsewhere = set()
        for end in sorted(ends):
            name = self._sides.ros_name(end.name)
            if name is None or end.session == own or not _is_name(name):
                continue
            if end.session not in bridges:
                found.setdefault(name, []).append(end)
            elif end.session < own:  # of two bridges the one with the lower session id has the name
                elsewhere.add(name)
        return found, elsewhere

    # -- the loop ------------------------------------------------------------------------------

    def _run(self) -> None:
        state, types = SystemState(), {}
        while not self._closing and not self.ended:
            self._changed.clear()  # before looking: a change from now on causes another round
            try:
                state = self._ros.state()
                if not self._answered:
                    self._ros.clean(state, BRIDGE)
                types = self._ros.types()
                # `_look` only notes what is wanted in ROS 1; this registers it.
                self._look(state, types)
                self._ros.register(state, BRIDGE)
                self._note_master(None)
            except Ros1Error as error:
                self._note_master(error)
                self._look(state, types)  # with the last known state: ours may have changed
            except ActionlibError as error:  # our own session is closed
                self._ros.report("bridge", error)
            except Exception:  # noqa: BLE001  report it; the bridge goes on
                report_thread_exception()
            self._changed.wait(LOOK_S)
        if self.ended:
            log.error("ROS 1 bridge %s: %s", self.name, self.ended)
            self._over.set()

    def _note_master(self, error: Ros1Error | None) -> None:
        """Log once when the master does not answer, and once when it answers again."""
        if error is not None:
            self._ros.report("master", error)
        else:
            if not self._is_there:
                log.warning("ROS 1 bridge %s: the master answers again", self.name)
            self._ros.forget_report("master")
            self._answered = True
            self._looked.set()
        self._is_there = error is None

    def _look(self, state: SystemState, types: Mapping[str, str]) -> None:
        """Update what is bridged."""
        state = without(state, BRIDGE)  # two bridges must not serve each other
        ends, elsewhere = self._ends_by_name()
        names = [*looked_for.actions.names(), *looked_for.services.names()]
        ros_names = set(filter(None, map(self._sides.ros_name, names)))
        plan = make_plan(self._wanted, ends, state, types, ros_names)
        for name in elsewhere & {*plan.actions, *plan.topics, *plan.services}:
            error = Ros1Error(name, "it is bridged by another bridge already; expected one.")
            self._ros.report(f"bridge of {name}", error)
        sides, definitions = self._sides, self._definitions
        actions = {n: t for n, t in plan.actions.items() if n not in elsewhere}
        topics = {n: t for n, t in plan.topics.items() if n not in elsewhere}
        services = {n: t for n, t in plan.services.items() if n not in elsewhere}

        def make_action(name: str) -> ActionBridge:
            timeout = self._status_timeout
            return ActionBridge(sides, name, actions[name], definitions, timeout)

        _keep(self._actions, actions, make_action)
        _keep(self._topics, topics, lambda name: TopicBridge(sides, name, definitions))
        _keep(self._services, services, lambda n: ServiceBridge(sides, n, self._service_timeout))
        for name, action in self._actions.items():
            action.look(ends.get(name, []), state)
        for name, topic in self._topics.items():
            topic.look(ends.get(name, []), listen=topics[name])
        for name, service in self._services.items():
            service.look(ends.get(name, []), served=services[name])
        self.plan = BridgePlan(actions, topics, services)


def _is_name(name: str) -> bool:
    """Return whether ROS 1 allows a name: anybody can invent a token."""
    try:
        return check_name(name) == name
    except InvalidNameError:
        return False


def _keep(there: dict[str, B], wanted: Iterable[str], make: Callable[[str], B]) -> None:
    """Close the bridges of names that are no longer wanted, and make those of new names."""
    names = set(wanted)
    for name in there.keys() - names:
        there.pop(name).close()
    for name in names - there.keys():
        there[name] = make(name)
