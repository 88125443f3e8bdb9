"""Fixtures: the simulated robot of the office, in virtual time."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from functools import partial

import pytest

from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.node import Node, use_node
from actionlib_core.transport.memory import MemoryNetwork
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.occupancy import load_map
from smachpy.places.robot_file import load_config
from smachpy.sim.server import RobotServer
from smachpy.sim.world import Robot, World


@pytest.fixture
def clock(mission_seed):
    """A virtual clock, in force for the test, with the interleaving of `--mission-seeds`."""
    with VirtualClock(mission_seed) as clock, use_clock(clock):
        yield clock


@pytest.fixture(scope="session")
def office():
    return load_map(OFFICE_MAP)


@pytest.fixture(scope="session")
def office_robot():
    return load_config(OFFICE_ROBOT)


@dataclass
class Simulation:
    """A robot with its server, and a node for the mission, on one network in virtual time."""

    world: World
    robot: Robot
    server: RobotServer
    node: Node
    network: MemoryNetwork


@contextlib.contextmanager
def _simulate(grid, clock, config, *, namespace="", pose=None):
    network = MemoryNetwork(clock)
    with (
        Node("robot", transport=network.session(), clock=clock, namespace=namespace) as robot_node,
        Node("mission", transport=network.session(), clock=clock, namespace=namespace) as node,
        use_node(node),
    ):
        world = World(grid)
        robot = Robot(world, config, pose or config.start, clock.now())
        server = RobotServer(robot, node=robot_node)
        server.start()
        try:
            yield Simulation(world, robot, server, node, network)
        finally:
            server.close()


@pytest.fixture
def simulate_on(office):
    """`with simulate_on(clock, config) as simulation`: any robot on the office floor."""
    return partial(_simulate, office)


@pytest.fixture
def simulate(simulate_on, clock):
    """`with simulate(config) as simulation`: on the test's clock."""
    return partial(simulate_on, clock)


@pytest.fixture
def simulation(simulate, office_robot):
    """The office robot with a full battery, at its dock."""
    battery = replace(office_robot.battery, capacity=100.0, charge=1.0)
    with simulate(replace(office_robot, battery=battery)) as made:
        yield made
