"""Two nodes on a network in memory, for tests of what talks between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actionlib_core.clock import VirtualClock


@pytest.fixture
def network(clock: VirtualClock) -> MemoryNetwork:
    return MemoryNetwork(clock)


@pytest.fixture
def nodes(
    clock: VirtualClock, network: MemoryNetwork, request: pytest.FixtureRequest
) -> Iterator[list[Node]]:
    """Two nodes, called as the module's NODES says."""
    names = request.module.NODES
    made = [Node(name, transport=network.session(), clock=clock) for name in names]
    yield made
    for node in made:
        node.close()
        node.transport.close()
