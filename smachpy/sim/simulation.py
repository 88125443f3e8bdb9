"""Offers a world on the network: robots in their namespaces, doors, moving obstacles."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool, SetBoolResponse
from actionlib_core.node import Node, get_node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import NewsPublisher
from smachpy.exceptions import MissionError
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.occupancy import load_map
from smachpy.places.robot_file import ControlConfig, load_config
from smachpy.sim.server import RobotServer, map_publisher
from smachpy.sim.stepper import Stepper
from smachpy.sim.world_file import WorldSpec, load_world, place_robots

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from actionlib_core.exceptions import ServerConflictError
    from smachpy.sim.doors import Door
    from smachpy.sim.nav2 import Nav2Server
    from smachpy.sim.world import Robot, World

_NODE: Final = "move_base"  # base name of each robot's node
_ROS2_NODE: Final = "simulated_robot"


class Simulation:
    """Serves a world: each robot in its namespace, the doors under `doors/NAME`.

    Args:
        world: The world with its robots.
        node: Its node; the robots get nodes on the same session.
        on_ros2: The robots are Nav2 robots, each in its namespace on the ROS 2 network of the
            node's configuration; the doors stay on this network. If the node has opened its own
            transport, each robot opens one, too.

    Raises:
        MissionError: the robots' control rates differ.

    Threads: one thread steps all robots; `start` and `close` may be called from any thread.

    Attributes:
        world: The world.
        servers: The robots' servers by name.
        stepper: Steps the world; hold its lock to change the world while it runs.
    """

    def __init__(self, world: World, *, node: Node | None = None, on_ros2: bool = False) -> None:
        self.world = world
        self._node = node if node is not None else get_node()
        self._on_ros2 = on_ros2
        self.stepper = Stepper(self._node.clock, rate=_rate(world))
        self._surroundings = _Surroundings(self)
        self._nodes: list[Node] = []
        self.servers: dict[str, RobotServer | Nav2Server] = {}
        self._closing = self._node.clock.event("the simulation closes")
        self._closed = False
        self._conflict: ServerConflictError | None = None

    @property
    def node(self) -> Node:
        """Its node."""
        return self._node

    @property
    def robots(self) -> dict[str, Robot]:
        """The robots by name."""
        return {robot.name: robot for robot in self.world.robots}

    def start(self) -> None:
        """Offer everything on the network.

        Raises:
            ServerConflictError: another robot has one of the names.
        """
        try:
            self._surroundings.start()
            self.stepper.add(self._surroundings)
            for robot in self.world.robots:
                self._start_robot(robot)
        except BaseException:
            self.close()
            raise

    def _start_robot(self, robot: Robot) -> None:
        base = self._node.namespace
        namespace = f"{base}/{robot.name}" if base else robot.name
        clock, transport, stepper = self._node.clock, self._node.transport, self.stepper
        server: RobotServer | Nav2Server
        if self._on_ros2:
            from smachpy.sim.nav2 import Nav2Server

            node = Node(
                _ROS2_NODE,
                transport=None if self._node.owns_transport else transport,
                clock=clock,
                namespace=namespace,
                config=self._node.config,
            )
            self._nodes.append(node)
            server = Nav2Server(robot, node=node, stepper=stepper)
        else:
            node = Node(_NODE, transport=transport, clock=clock, namespace=namespace)
            self._nodes.append(node)
            server = RobotServer(robot, node=node, stepper=stepper)
        self.servers[robot.name] = server
        server.start()

    def remove(self, name: str) -> None:
        """Remove a robot from the network and the floor, as if it had been carried away.

        Raises:
            KeyError: there is no robot of that name.

        Blocks: for two seconds at most.
        """
        robot = self.robots[name]
        self.servers.pop(name).close()
        with self.stepper.lock:
            self.world.leave(robot)

    def wait(self) -> None:
        """Wait until it is closed.

        Raises:
            ServerConflictError: an older robot of the same name was found later.

        Blocks: until then.
        """
        self._closing.wait()
        if self._conflict is not None:
            raise self._conflict

    def check_names(self) -> None:
        """End `wait` if a robot had to give up its name to an older one."""
        for server in tuple(self.servers.values()):
            if server.conflict is not None and self._conflict is None:
                self._conflict = server.conflict
                self._closing.set()

    def close(self) -> None:
        """Leave the network; running goals are aborted. A second call does nothing.

        Blocks: until the threads have ended, a few seconds at most.
        """
        if self._closed:
            return
        self._closed = True
        for server in self.servers.values():
            server.close()
        self.stepper.close()
        self._surroundings.close()
        for node in self._nodes:
            node.close()
        self._closing.set()


class _Surroundings:
    """Everything on the floor except the robots, for the stepper and the network."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._doors: list[_DoorServer] = []
        self._map: NewsPublisher | None = None

    def start(self) -> None:
        self._map = map_publisher(self._simulation.world.map, self._simulation.node)
        for door in self._simulation.world.doors.values():
            self._doors.append(_DoorServer(door, self._simulation))

    def close(self) -> None:
        for door in self._doors:
            door.close()
        if self._map is not None:
            self._map.unregister()

    def is_busy(self, now: float) -> bool:
        del now
        return self._simulation.world.is_changing()

    def step(self, now: float, dt: float) -> None:
        del now
        self._simulation.world.step(dt)

    def report(self, now: float) -> None:
        del now
        for door in self._doors:
            door.report()
        self._simulation.check_names()


class _DoorServer:
    """A door on the network: the service `doors/NAME/set`, the topic `doors/NAME/open`."""

    def __init__(self, door: Door, simulation: Simulation) -> None:
        self._door = door
        self._stepper = simulation.stepper
        node = simulation.node
        self._told: bool | None = None
        self._open = NewsPublisher(f"doors/{door.name}/open", Bool, latch=True, node=node)
        self._set = Service(f"doors/{door.name}/set", SetBool, self._on_set, node=node)
        self.report()

    def report(self) -> None:
        """Publish whether it is open, if that has changed."""
        is_open = self._door.is_open
        if is_open is not self._told:
            self._told = is_open
            self._open.publish(data=is_open)

    def close(self) -> None:
        """Leave the network."""
        self._set.close()
        self._open.unregister()

    def _on_set(self, request: Any) -> SetBoolResponse:
        with self._stepper.lock:
            trouble = self._door.set(opening=request.data)
            if self._door.is_moving:
                doing = "opens" if request.data else "closes"
            else:
                doing = "is open" if self._door.is_open else "is closed"
        self._stepper.wake()
        message = trouble or f"door {self._door.name} {doing}"
        return SetBoolResponse(success=not trouble, message=message)


@contextlib.contextmanager
def simulation(
    world: WorldSpec | World | Path | str | None = None,
    *,
    robots: int = 1,
    node: Node | None = None,
) -> Iterator[Simulation]:
    """Run a world in this process for the duration of a `with` block.

    Args:
        world: A world, its specification, or a world file; None takes the office with `robots`
            robots, robot_0 at its dock.
        robots: Number of robots, if `world` is None.
        node: Its node; None uses the current one.

    Raises:
        InputFileError: a file has problems.
        NavigationError: a robot cannot stand at its start pose.
        ServerConflictError: another robot has one of the names.

    Blocks: at the end of the block, until the threads have ended.
    """
    where = node if node is not None else get_node()
    made = Simulation(_make(world, robots, where.clock.now()), node=where)
    made.start()
    try:
        yield made
    finally:
        made.close()


def office(robots: int = 1) -> WorldSpec:
    """Return the office with some robots: robot_0 at the dock, the others around it.

    Raises:
        NavigationError: there is not enough space.
    """
    grid = load_map(OFFICE_MAP)
    return WorldSpec("office", grid, place_robots(grid, load_config(OFFICE_ROBOT), robots))


def _make(world: WorldSpec | World | Path | str | None, robots: int, now: float) -> World:
    if world is None:
        world = office(robots)
    elif isinstance(world, (str, Path)):
        world = load_world(Path(world))
    return world.build(now) if isinstance(world, WorldSpec) else world


def _rate(world: World) -> float:
    """Return the control rate [Hz] of the robots.

    Raises:
        MissionError: they have different ones.
    """
    rates = [(robot.name, robot.config.control.rate) for robot in world.robots]
    if not rates:
        return ControlConfig().rate
    first, rate = rates[0]
    for name, other in rates:
        if other != rate:
            raise MissionError(
                f"{name}: control.rate: got {other:g} Hz; expected {rate:g} Hz as {first} has: one "
                "clock steps all robots of a world."
            )
    return rate
