"""One world, several networks: nodes that reach each other, on virtual time or on zenoh."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actionlib_core.clock import RealClock, VirtualClock, use_clock
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock
    from actionlib_core.transport import Transport


class World:
    """A clock and nodes on one network, each with a session of its own."""

    def __init__(self, clock: Clock, open_session: Callable[[], Transport]) -> None:
        self.clock = clock
        self._open = open_session
        self.nodes: list[Node] = []

    def node(self, name: str, **kwargs: object) -> Node:
        node = Node(name, transport=self._open(), clock=self.clock, **kwargs)
        self.nodes.append(node)
        return node

    def event(self):
        return self.clock.event()

    def close(self) -> None:
        for node in reversed(self.nodes):
            node.close()
            node.transport.close()


def _zenoh_session() -> Transport:
    from actionlib_core.transport.zenoh import ZenohTransport

    return ZenohTransport()


@pytest.fixture(
    params=[
        "memory-virtual",
        "memory-seeded",
        "memory-real",
        pytest.param("zenoh", marks=pytest.mark.zenoh),
    ]
)
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    if request.param in {"memory-virtual", "memory-seeded"}:
        seed = None if request.param == "memory-virtual" else 11
        with VirtualClock(seed) as clock, use_clock(clock):
            world = World(clock, MemoryNetwork(clock).session)
            yield world
            world.close()
    else:
        clock = RealClock()
        with use_clock(clock):
            session = _zenoh_session if request.param == "zenoh" else MemoryNetwork(clock).session
            world = World(clock, session)
            yield world
            world.close()
