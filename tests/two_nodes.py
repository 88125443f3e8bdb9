"""A robot and a mission on a network in memory, in virtual time: what tests of talking states need."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork

if TYPE_CHECKING:
    from typing import Self

    from actionlib_core.transport import Transport


class TwoNodes:
    """The nodes `robot` and `mission`, and their clock, which is in force inside the block.

    Tests derive a world of their own from it, with the servers and states that they are about.
    """

    def __init__(self, seed: int | None = None) -> None:
        self.clock = VirtualClock(seed)
        self.network = MemoryNetwork(self.clock)
        self._left = contextlib.ExitStack()
        self._using = contextlib.ExitStack()
        self.robot = self.node("robot")
        self.mission = self.node("mission")

    def session(self) -> Transport:
        """Open what a node talks through."""
        return self.network.session()

    def node(self, name: str) -> Node:
        """Make a node; the end of the block closes it."""
        node = Node(name, transport=self.session(), clock=self.clock)
        self._left.callback(node.transport.close)
        self._left.callback(node.close)
        return node

    def __enter__(self) -> Self:
        self._using.enter_context(self.clock)
        self._using.enter_context(use_clock(self.clock))
        return self

    def __exit__(self, *_: object) -> None:
        with self._using:  # left even if a node does not close
            self._left.close()
