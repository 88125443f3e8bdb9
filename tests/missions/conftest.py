import pytest

from actionlib_core.node import Node, use_node
from actionlib_core.transport.memory import MemoryNetwork
from tests.simulated_robot import clock, office, office_robot, simulate, simulate_on, simulation

__all__ = ["clock", "office", "office_robot", "simulate", "simulate_on", "simulation"]


@pytest.fixture
def node(clock):
    """The current node, on a network in memory."""
    network = MemoryNetwork(clock)
    with Node("test", transport=network.session(), clock=clock) as node, use_node(node):
        yield node
