"""One world, several networks: nodes that reach each other, in memory, over bad links, on zenoh."""

from __future__ import annotations

import contextlib
import itertools
import os
from typing import TYPE_CHECKING

import pytest

from actionlib_core.action.client import TerminalState
from actionlib_core.clock import RealClock
from actionlib_core.goal.states import Status
from actionlib_core.node import Node
from actionlib_core.transport.faulty import DELIVERED, FaultyTransport, RandomFaults
from tests.transports import TRANSPORTS, opened

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.action.client import ActionClient, ClientGoalHandle
    from actionlib_core.clock import Clock
    from actionlib_core.transport import Transport
    from actionlib_core.transport.faulty import Fate

SEED = int(os.environ.get("CONTRACT_SEED", "11"))  # each run of `make contract-100` has its own
LATE_S = 0.02
REPEATED = {"goal", "cancel", "status", "result", "ack"}


class SmallFaults:
    """A network that is bad as the delivery contract allows; the session's seed says how.

    What the protocol of actions repeats until it is answered comes late, out of order and twice;
    feedback and what is not of an action arrives as it was sent. (Losses and long cuts are in
    `test_delivery`.)
    """

    def __init__(self, seed: int) -> None:
        self._faults = RandomFaults(seed, repeat=0.2, delay=0.3, longest=LATE_S)

    def __call__(self, key: str, number: int) -> Fate:
        if key.rpartition("/")[2] not in REPEATED:
            return DELIVERED
        return self._faults(key, number)


class World:
    """A clock and nodes on one network, each with a session of its own.

    Attributes:
        tells_recalls: A client is told for certain whether a cancelled goal has run.
        stopped: How a goal ends whose server is stopped while it runs.

    Args:
        clock: The clock of all nodes.
        open_session: Opens one of the sessions.
        late: Longest time [s] that a message may be overtaken by others.
    """

    tells_recalls = True
    stopped = frozenset({Status.PREEMPTED, Status.ABORTED})

    def __init__(
        self, clock: Clock, open_session: Callable[[], Transport], *, late: float = 0.0
    ) -> None:
        self.clock = clock
        self._open = open_session
        self._late = late
        self.nodes: list[Node] = []

    def node(self, name: str, **kwargs: object) -> Node:
        node = Node(name, transport=self._open(), clock=self.clock, **kwargs)
        self.nodes.append(node)
        return node

    def type_names(self, *actions: str) -> list[str]:
        """Return what errors call actions of the package actionlib."""
        return [f"actionlib/{action}Action" for action in actions]

    def text(self, said: str) -> str:
        """Return what a client reads where a server has said something about a goal's end."""
        return said

    def refusal(self, said: str) -> str:
        """The same of a goal that was refused."""
        return said

    def expect_gone(self, client: ActionClient) -> None:
        """A client of a server that has stopped knows so: it has heard the farewell.

        On a busy computer later: a server waits only for a moment until the farewell is heard.
        """
        deadline = self.clock.now() + (60.0 if isinstance(self.clock, RealClock) else 0.0)
        while client.wait_for_server(0.01):
            assert self.clock.now() < deadline
            self.clock.sleep(0.01)

    def check_end(self, handle: ClientGoalHandle, ran: int) -> None:
        """Check a goal that was sent while servers came and went, and how often it `ran`."""
        state = handle.get_terminal_state()
        if state is TerminalState.REJECTED:  # it waited in the queue as its server was stopped
            assert handle.get_goal_status_text() == "The action server was stopped"
            assert ran == 0
        else:
            assert state is TerminalState.SUCCEEDED, handle.get_goal_status_text()
            assert ran == 1

    def event(self):
        return self.clock.event()

    def keep_order(self) -> None:
        """Wait until what was sent cannot be overtaken by what comes next."""
        if self._late:
            self.clock.sleep(2 * self._late)

    def close(self) -> None:
        for node in reversed(self.nodes):
            node.close()
            node.transport.close()


@contextlib.contextmanager
def opened_world(transport: str, kind: type[World] = World) -> Iterator[World]:
    """Make a world on one of the networks, and close it at the end."""
    seeds = itertools.count(SEED)
    late = LATE_S if transport == "faulty" else 0.0

    def make_faulty(session: Transport) -> Transport:
        return FaultyTransport(session, SmallFaults(next(seeds)))

    with opened(transport, SEED, make_faulty) as (clock, open_session):
        world = kind(clock, open_session, late=late)
        yield world
        world.close()


@pytest.fixture(params=TRANSPORTS)
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    with opened_world(request.param) as world:
        yield world
