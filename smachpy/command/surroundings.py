"""The surroundings of a mission: the network in real time, or this process in virtual time."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, Protocol

from actionlib_core import shutdown
from actionlib_core.clock import current_clock, use_clock
from actionlib_core.config import ROS2_VARIABLE
from actionlib_core.exceptions import NodeError
from actionlib_core.inputs.suggest import nearest
from actionlib_core.node import Node, get_node, init, use_node
from actionlib_core.process.output import tell
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.ports import is_on_ros2, watch_for_server
from actionlib_core.wire.presence import list_endpoints
from smachpy.command.robot_process import RobotProcess
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping
    from pathlib import Path

    from actionlib_core.names import NameArguments
    from actionlib_core.transport import Closable, Transport
    from smachpy.machines.container import Container
    from smachpy.places.occupancy import OccupancyMap
    from smachpy.places.pose import Pose2D
    from smachpy.sim.world_file import WorldSpec

ROBOT_ACTIONS: Final = {
    "move_base": "move_base_msgs/MoveBaseAction",
    "charge": "mission_msgs/ChargeAction",
}
"""The actions of the simulated robot: the last part of their name, and their type."""

MAX_NAMED_SERVERS: Final = 3
"""The most names that an error suggests."""

_NUMBERED = re.compile(r"robot_(\d{1,2})")
_TIMES = re.compile(r"(?P<number>\d+(\.\d+)?)x")
_FASTEST: Final = 1000.0


@dataclass(frozen=True, slots=True)
class Pace:
    """How time passes.

    Attributes:
        virtual: Within this process, on a virtual clock.
        rate: Seconds per real second; None: as fast as the computer allows.
        seed: Chooses the next thread where several are ready in virtual time; None: first come,
            first served.
    """

    virtual: bool = False
    rate: float | None = None
    seed: int | None = None

    @classmethod
    def read(cls, text: str) -> Pace:
        """Read `real`, `virtual` or `10x`.

        Raises:
            ValueError: it is none of them.
        """
        if text in {"real", "virtual"}:
            return cls(virtual=text == "virtual")
        match = _TIMES.fullmatch(text)
        if match is None or not 0 < float(match["number"]) <= _FASTEST:
            raise ValueError(
                f"got {text!r}; expected real, virtual, or a rate of at most {_FASTEST:g}x such "
                "as 10x"
            )
        return cls(virtual=True, rate=float(match["number"]))

    def __str__(self) -> str:
        if not self.virtual:
            return "real"
        return "virtual" if self.rate is None else f"{self.rate:g}x"


REAL_TIME: Final = Pace()


@dataclass(frozen=True, slots=True)
class RobotOptions:
    """The robot of a run.

    Attributes:
        start: Start a simulated one for this run.
        map: Its map.
        config: Its parameters.
        pose: Its start pose [m, m, rad]; empty: as in the parameters.
        world: A world file instead of all that: robots, doors, moving obstacles.
        ros1: URL of the master of a real robot that runs ROS 1, instead of a simulated one.
    """

    start: bool
    map: Path
    config: Path
    pose: tuple[float, ...] = ()
    world: Path | None = None
    ros1: str = ""

    def arguments(self) -> tuple[str, ...]:
        """Return the arguments for the robot's program."""
        if self.world is not None:
            return ("--world", str(self.world))
        pose = ("--pose", *map(str, self.pose)) if self.pose else ()
        return ("--map", str(self.map), "--config", str(self.config), *pose)

    def floor(self) -> tuple[OccupancyMap, Pose2D | None]:
        """Return the map, and the pose of the robot's dock.

        Raises:
            InputFileError: a file has problems.
        """
        from smachpy.places.occupancy import load_map
        from smachpy.places.robot_file import load_config

        if self.world is None:
            return load_map(self.map), load_config(self.config).dock
        from smachpy.sim.world_file import load_world

        spec = load_world(self.world)
        return spec.grid, spec.robots[0].config.dock if spec.robots else None

    def choose_robot(self, name: str) -> str:
        """Return the name of the robot to use in the world: `name`, or its first one.

        Raises:
            InputFileError: the world file is wrong.
            MissionError: there is no such robot.
        """
        if self.world is None:
            return name
        from smachpy.sim.world_file import load_world

        names = [robot.name for robot in load_world(self.world).robots]
        if names and not name:
            return names[0]
        if name not in names:
            raise MissionError(f"--robot: got {name!r}; expected one of {names}, of {self.world}.")
        return name

    def names_robots(self, needed: Mapping[str, str]) -> bool:
        """Return whether a mission's own names say which robots of the world it drives."""
        if self.world is None:
            return False
        from smachpy.sim.world_file import load_world

        prefixes = _prefixes(needed)
        return bool(prefixes) and prefixes <= {r.name for r in load_world(self.world).robots}


class Surroundings(Protocol):
    """Starts and stops what a mission needs: its robot and the wait for its servers."""

    def start(self, machine: Container, needed: Mapping[str, str]) -> None:
        """Begin to start it.

        Args:
            machine: The mission; it is preempted if its robot refuses to run.
            needed: Names and types of the actions that others must serve.

        Raises:
            MissionError: that is not possible here.
        """

    def put_robot(self, prefix: str, timeout: float) -> None:
        """Start the simulated robot or world before it is known which actions are needed.

        Args:
            prefix: Prefix of the robot's names, below the node's namespace.
            timeout: How long to wait for it [s].

        Raises:
            MissionError: it could not start.

        Blocks: until it is there, `timeout` at most.
        """

    def wait(self, timeout: float) -> bool:
        """Wait until everything is there; return False if the program is to end.

        Raises:
            MissionError: something is missing after `timeout` [s], or the robot could not start.

        Blocks: `timeout` at most.
        """

    def over(self) -> None:
        """Note that the mission has ended.

        Raises:
            MissionError: its goals may have gone to another robot.
        """

    def close(self) -> None:
        """Stop everything.

        Blocks: for 3.5 s at most.
        """


@contextlib.contextmanager
def open_surroundings(
    pace: Pace, robot: RobotOptions, names: NameArguments, namespace: str
) -> Iterator[Surroundings]:
    """Make clock and node for a mission; both are current within the `with` block.

    Args:
        pace: How time passes.
        robot: The simulated robot.
        names: Remapping from the command line.
        namespace: Prefix of relative names; "" uses the configuration's.

    Raises:
        NameSetupError: a name is not allowed.
        TransportError: the network cannot be joined.
        MissionError: names are to be remapped, but the mission's module has already made its node;
            or the world file has problems, or has no such robot.
    """
    said = bool(namespace)
    if pace.virtual or robot.start:
        namespace = robot.choose_robot(namespace)
    if pace.virtual:
        with _open_virtual(pace, robot, names, namespace, said=said) as surroundings:
            yield surroundings
        return
    if names.rules or namespace:
        _name_node(names, namespace)
    real = _Network(robot, said=said)
    try:
        yield real
    finally:
        real.close()


def _name_node(names: NameArguments, namespace: str) -> None:
    words: list[str] = []
    for rule in names.rules:
        text = f"{rule.old}:={rule.new}"
        words += ["--ros-args", "-r", f"{rule.node}:{text}", "--"] if rule.node else [text]
    try:
        init(argv=words, namespace=namespace or None)
    except NodeError as error:
        raise MissionError(
            f"names cannot be changed: the mission made its node already ({error}). Try making "
            "clients and servers in the mission's function or its states, not when its module is "
            "imported."
        ) from error


# -- real time -------------------------------------------------------------------------------------


class _Network:
    """The configured network; the robot runs in a process of its own."""

    def __init__(self, robot: RobotOptions, *, said: bool) -> None:
        self._options = robot
        self._said = said
        self._robot: RobotProcess | None = None
        self._wait: ServerWait | None = None
        self._forget: Callable[[], None] = lambda: None

    def start(self, machine: Container, needed: Mapping[str, str]) -> None:
        if self._options.start:
            _leave_names(self._options, needed, said=self._said)
            refuse_ros2(needed)
        self._wait = ServerWait(needed)
        self._forget = shutdown.on_shutdown(self._wait.wake)
        if not self._options.start:
            return
        arguments = self._options.arguments()
        if self._options.world is None:
            prefix, count = _robots_of(needed)
            space = get_node().namespace
            name = "/".join(word for word in (space, prefix) if word)
            arguments += ("--namespace", name or "/")
            arguments += ("--robots", str(count)) if count > 1 else ()
        self._robot = RobotProcess(arguments, on_change=self._wait.wake)
        self._robot.on_refusal(machine.request_preempt)
        self._robot.__enter__()

    def put_robot(self, prefix: str, timeout: float) -> None:
        drive = f"{prefix}/move_base" if prefix else "move_base"
        refuse_ros2({drive: "move_base_msgs/MoveBaseAction"})
        self._wait = ServerWait({})
        self._forget = shutdown.on_shutdown(self._wait.wake)
        arguments = self._options.arguments()
        if self._options.world is None:
            arguments += ("--namespace", prefix or "/")
        self._robot = RobotProcess(arguments, on_change=self._wait.wake)
        self._robot.on_refusal(lambda: shutdown.request("the robot refused"))
        self._robot.__enter__()
        self._wait.wait(timeout, self._robot)

    def wait(self, timeout: float) -> bool:
        assert self._wait is not None
        missing = self._wait.wait(timeout, self._robot)
        if self._robot is not None and not (self._robot.ready() or shutdown.requested()):
            raise MissionError(
                f"--start-robot: the robot is not ready after {timeout:g} s; expected it to be. "
                "Try a longer --server-timeout."
            )
        if missing:
            text, way_out = self._explain(missing, timeout)
            # A real robot may lack what the mission needs only in some cases.
            if not ((get_node().config.ros2 or self._options.ros1) and self._wait.found):
                raise MissionError(f"{text}{way_out}")
            tell("smachpy", f"{text} The mission runs without.")
        return not shutdown.requested()

    def _explain(self, missing: Mapping[str, str], timeout: float) -> tuple[str, str]:
        """Return the error for actions without a server, and what more to try."""
        if get_node().config.ros2:
            return missing_on_robot(missing, timeout), " Try: smachpy doctor --ros2"
        if self._options.ros1:
            return missing_on_ros1_robot(missing, timeout, self._options.ros1), ""
        there = list_endpoints(get_node().transport, kind=Kind.ACTION_SERVER)
        return missing_text(missing, {end.name for end in there}, timeout), ""

    def over(self) -> None:
        if self._robot is not None:
            # An older robot of the same name appeared late: it, and not ours, got the goals.
            if self._robot.refused():
                self._robot.check()
            self._robot.let_go()

    def close(self) -> None:
        self._forget()
        if self._wait is not None:
            self._wait.close()
        if self._robot is not None:
            self._robot.stop()


def _leave_names(robot: RobotOptions, needed: Mapping[str, str], *, said: bool) -> None:
    """Take the names of a mission as they are if they say which robots of the world it drives.

    Without --robot a mission's names are those of the first robot of a world, which must be known
    before the mission is built; what it calls is known only then.
    """
    if not said and robot.names_robots(needed):
        node = get_node()
        node.rename(node.name, namespace="")


def is_of_robot(name: str, type_name: str) -> bool:
    """Return whether an action is one that the simulated robot serves."""
    return ROBOT_ACTIONS.get(name.rpartition("/")[2]) == type_name


def _prefixes(needed: Mapping[str, str]) -> set[str]:
    """Return what stands before the names of the robots' actions."""
    return {
        name.strip("/").rpartition("/")[0]
        for name, type_name in needed.items()
        if is_of_robot(name, type_name)
    }


def _robots_of(needed: Mapping[str, str]) -> tuple[str, int]:
    """Return the robots whose actions a mission calls: a prefix and their number.

    Several robots are robot_0, robot_1, ... up to the highest in use; their prefix is "".

    Raises:
        MissionError: there are several, with other names.
    """
    prefixes = _prefixes(needed)
    if len(prefixes) < 2:  # noqa: PLR2004  one, or none
        return (prefixes.pop() if prefixes else ""), 1
    matches = [_NUMBERED.fullmatch(prefix) for prefix in prefixes]
    if not all(matches):
        raise MissionError(
            f"--start-robot: the mission calls several robots: {sorted(prefixes)}; expected one, "
            "or robot_0, robot_1, ... Try starting each: smachpy robot --namespace NAME"
        )
    return "", 1 + max(int(match[1]) for match in matches if match)


def refuse_ros2(needed: Mapping[str, str]) -> None:
    """Check that the actions of a mission are those of the robot that is started for it.

    Raises:
        MissionError: some are on a ROS 2 robot, which would drive in place of the simulated one.
    """
    node = get_node()
    if not node.config.ros2:
        return
    there = [
        f"'/{full}'"
        for name, type_name in needed.items()
        if is_on_ros2(node, full := node.resolve(name, "action name"), type_name)
    ]
    if there:
        what = "action" if len(there) == 1 else "actions"
        raise MissionError(
            f"--start-robot: goals of {what} {', '.join(there)} would be sent to the ROS 2 robot "
            f"that {ROS2_VARIABLE} or the configuration names; expected the simulated robot. Try "
            f"without --start-robot, or without {ROS2_VARIABLE}."
        )


class ServerWait:
    """Waits until every needed action has a server, or waiting has become pointless.

    Args:
        names: The actions, with the names in the mission, and their types.

    Raises:
        ConfigError: an action is configured for ROS 2, but has no counterpart there.
        TransportError: the robot's network cannot be joined.
    """

    def __init__(self, names: Mapping[str, str]) -> None:
        self._clock = current_clock()
        self._wake = self._clock.event("the servers of the mission's actions")
        self._missing: dict[str, str] = {}
        self._watches: list[Closable] = []
        if names:
            self._watch(get_node(), names)

    def _watch(self, node: Node, names: Mapping[str, str]) -> None:
        self._missing = {node.resolve(name, "action name"): name for name in names}
        for full, name in list(self._missing.items()):
            on_there = partial(self._on_server, full)
            self._watches.append(watch_for_server(node, full, names[name], on_there))

    @property
    def found(self) -> bool:
        """Whether at least one of the servers is there."""
        return len(self._missing) < len(self._watches)

    def wake(self) -> None:
        """Make `wait` check again; from any thread."""
        self._wake.set()

    def close(self) -> None:
        """Stop watching."""
        for watch in self._watches:
            watch.close()

    def wait(self, timeout: float, robot: RobotProcess | None) -> dict[str, str]:
        """Wait for the servers, and for `robot` to be ready.

        Returns:
                The actions without a server after `timeout` [s], full name -> name in the mission;
                empty if all are there or the program is to end.

        Raises:
            MissionError: the robot could not start.

        Blocks: `timeout` at most.
        """
        deadline = self._clock.now() + timeout
        while not shutdown.requested():
            if robot is not None:
                robot.check()
            if not self._missing and (robot is None or robot.ready()):
                return {}
            left = deadline - self._clock.now()
            if left <= 0:
                return dict(self._missing)
            self._wake.wait(left)
            self._wake.clear()
        return {}

    def _on_server(self, full: str) -> None:
        self._missing.pop(full, None)
        self._wake.set()


def missing_on_robot(missing: Mapping[str, str], timeout: float) -> str:
    """Return the error for actions without a server, if a ROS 2 robot is in use.

    Blocks: until the robot's network has answered, 1 s at most.
    """
    from actionlib_core.wire.ros2.ends import explain_absence

    what = "action" if len(missing) == 1 else "actions"
    names = sorted(missing)
    listed = ", ".join(f"'/{full}'" for full in names)
    there = explain_absence(get_node(), names[0])
    return (
        f"{what} {listed}: no server after {timeout:g} s, neither on the ROS 2 robot nor here. "
        f"{there[:1].upper()}{there[1:]} Another name there is given by 'map' in the configuration."
    )


def missing_on_ros1_robot(missing: Mapping[str, str], timeout: float, master: str) -> str:
    """Return the error for actions without a server, if a ROS 1 robot is in use."""
    what, be = ("action", "has") if len(missing) == 1 else ("actions", "have")
    listed = ", ".join(f"'/{full}'" for full in sorted(missing))
    return (
        f"{what} {listed}: {be} no server after {timeout:g} s, neither on the ROS 1 robot at "
        f"{master} nor here; expected one. Try 'smachpy bridge ros1 --master {master}' and, in "
        "another terminal, 'actionlib list' for the actions that the robot has."
    )


def missing_text(missing: Mapping[str, str], there: Collection[str], timeout: float) -> str:
    """Return the error for actions without a server.

    Args:
        missing: Full name -> name in the mission.
        there: Full names of the actions with a server.
        timeout: How long the mission waited for them [s].
    """
    what, be = ("action", "has") if len(missing) == 1 else ("actions", "have")
    listed = ", ".join(f"'/{full}'" for full in sorted(missing))
    text = f"{what} {listed}: {be} no server after {timeout:g} s; expected one."
    if any(name.strip("/") != full for full, name in missing.items()):
        called = ", ".join(repr(name) for _, name in sorted(missing.items()))
        text += f" The mission calls {'it' if len(missing) == 1 else 'them'} {called}."
    # One that is missing may have come before `there` was looked up.
    near = {close for full in missing for close in _close_names(full, there)} - {*missing}
    if near:
        text += f" Did you mean {' or '.join(repr(f'/{name}') for name in sorted(near))}?"
    full = min(missing)
    if all(name.rpartition("/")[2] in ROBOT_ACTIONS for name in missing.values()):
        prefix = full.rpartition("/")[0]
        program = "smachpy robot" + (f" --namespace {prefix}" if prefix else "")
        text += "" if not near else " Try --robot NAME if another robot is meant."
        return f"{text} Try --start-robot, or in another terminal: {program}"
    return f"{text} Try starting it; `actionlib list` shows those that run."


def _close_names(name: str, there: Collection[str]) -> list[str]:
    """Return names that may be meant by `name`: the same action elsewhere, or a similar one."""
    word = name.rpartition("/")[2]
    same = sorted(other for other in there if other.rpartition("/")[2] == word)
    return same[:MAX_NAMED_SERVERS] or nearest(name, there)


# -- virtual time ----------------------------------------------------------------------------------


@contextlib.contextmanager
def _open_virtual(
    pace: Pace, robot: RobotOptions, names: NameArguments, namespace: str, *, said: bool
) -> Iterator[_VirtualNetwork]:
    from actionlib_core.clock import VirtualClock
    from actionlib_core.transport.memory import MemoryNetwork

    with VirtualClock(pace.seed, rate=pace.rate) as clock, use_clock(clock):
        network = MemoryNetwork(clock)
        node = Node(
            "mission",
            transport=network.session(),
            clock=clock,
            namespace=namespace,
            arguments=names,
        )
        with node, use_node(node):
            surroundings = _VirtualNetwork(pace, robot, network.session, said=said)
            try:
                yield surroundings
            finally:
                surroundings.close()


class _VirtualNetwork:
    """A network in memory, with the robot in this process and nobody else."""

    def __init__(
        self, pace: Pace, robot: RobotOptions, session: Callable[[], Transport], *, said: bool
    ) -> None:
        self._pace = pace
        self._said = said
        self._options = robot
        self._session = session
        self._needed: Mapping[str, str] = {}
        self._down = contextlib.ExitStack()

    def start(self, machine: Container, needed: Mapping[str, str]) -> None:
        del machine
        others = {name: kind for name, kind in needed.items() if not is_of_robot(name, kind)}
        if others:
            called = ", ".join(f"{name} ({kind})" for name, kind in sorted(others.items()))
            raise MissionError(
                f"--time {self._pace}: the mission calls {called}, which nobody in this "
                "process serves; expected a mission that needs the simulated robot only. Try "
                "--time real."
            )
        self._needed = needed
        _leave_names(self._options, needed, said=self._said)
        if self._options.world is not None:
            self._put_world(self._options.world)
        elif needed or self._options.start:
            prefix, count = _robots_of(needed)
            if count > 1:
                self._put_robots(count)
            else:
                self._put_robot(prefix)

    def put_robot(self, prefix: str, timeout: float) -> None:
        del timeout
        if self._options.world is not None:
            self._put_world(self._options.world)
        else:
            self._put_robot(prefix)

    def _put_robots(self, count: int) -> None:
        from smachpy.command.robot import team

        options = self._options
        spec = team(options.map, options.config, options.pose, count)
        self._put_world(spec, get_node().namespace)

    def _put_world(self, world: Path | WorldSpec, space: str = "") -> None:
        from smachpy.sim.simulation import simulation

        mine = get_node()
        node = Node("simulation", transport=self._session(), clock=mine.clock, namespace=space)
        self._down.enter_context(node)
        self._down.enter_context(simulation(world, node=node))

    def _put_robot(self, prefix: str) -> None:
        from smachpy.command.robot import make_robot
        from smachpy.sim.server import RobotServer

        options, mine = self._options, get_node()
        space = "/".join(word for word in (mine.namespace, prefix) if word)
        node = Node(
            "move_base",
            transport=self._session(),
            clock=mine.clock,
            namespace=space,
        )
        self._down.enter_context(node)
        robot = make_robot(options.map, options.config, options.pose)
        server = RobotServer(robot, node=node)
        self._down.callback(server.close)
        server.start()

    def wait(self, timeout: float) -> bool:
        wait = ServerWait(self._needed)
        forget = shutdown.on_shutdown(wait.wake)
        try:
            missing = wait.wait(timeout, None)
        finally:
            forget()
            wait.close()
        if missing:
            raise MissionError(
                f"--time {self._pace}: the mission calls {sorted(missing.values())}, which the "
                "simulated robot does not serve under that name; expected its own. Try other "
                "--robot or renaming."
            )
        return not shutdown.requested()

    def over(self) -> None:
        """Do nothing: no other robot can have interfered."""

    def close(self) -> None:
        self._down.close()
