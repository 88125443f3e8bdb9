"""What action clients and servers promise, on ROS 2's wire: the suite of our own, on every network.

The names of the suite are on ROS 2 by configuration, their ROS 1 types with the ROS 2 type of the same
fields, so that goals cross the wire as those of ROS 2 nodes do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actionlib_core.action.client import TerminalState
from actionlib_core.config import Config, Ros2
from actionlib_core.goal.states import Status
from actionlib_core.interfaces._ros2 import ros2_registry
from actionlib_core.wire.ros2.goal_exchange import TEXT_REFUSED
from tests.contract.conftest import World, opened_world
from tests.contract.test_actions import *  # noqa: F403  each test of the suite, with our `world`
from tests.transports import TRANSPORTS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actionlib_core.action.client import ActionClient, ClientGoalHandle
    from actionlib_core.node import Node

NOT_ON_ROS2 = {
    "test_copy_of_a_goal_that_outlives_its_server_does_not_run_at_the_next": (
        "a goal is a request to whoever answers: it names no server, and no copy of it is kept"
    ),
    "test_goal_runs_although_a_dead_server_still_shows_a_token": (
        "a request does not go to the server that the client chose but to one that answers"
    ),
    "test_second_server_that_knows_of_the_first_too_late_stops_and_the_first_goes_on": (
        "tokens tell no age, so neither of two servers knows that it is the later one"
    ),
    "test_server_behind_a_bridge_is_known_by_its_status_lists": (
        "every server of ROS 2 shows tokens; the bridge speaks our own wire"
    ),
    "test_messages_that_cannot_be_read_are_dropped_and_reported_once": (
        "other keys and other messages: test_client_port and test_server_port have it"
    ),
}

ON_ROS2 = Config(ros2=(Ros2(names=("**/demo", "demo", "other", "*")),))


class Ros2World(World):
    """Nodes whose names are on ROS 2, where nothing is said about the end of a goal."""

    tells_recalls = False  # a result may overtake the lists that tell
    stopped = World.stopped | {Status.LOST}  # the result may be asked for when nobody can answer

    def type_names(self, *actions: str) -> list[str]:
        return [f"actionlib/action/{action}_" for action in actions]

    def text(self, said: str) -> str:
        return ""

    def refusal(self, said: str) -> str:
        return TEXT_REFUSED

    def expect_gone(self, client: ActionClient) -> None:
        while client.wait_for_server(0.01):  # there is no farewell: its tokens go
            self.clock.sleep(0.01)

    def check_end(self, handle: ClientGoalHandle, ran: int) -> None:
        """No farewell says what a server that left has taken: then a goal may end as LOST."""
        state = handle.get_terminal_state()
        if state is TerminalState.SUCCEEDED:
            assert ran == 1
        elif state is TerminalState.LOST:
            assert ran <= 1
        else:  # refused, or accepted before as ROS 2 sees it
            assert state in {TerminalState.REJECTED, TerminalState.ABORTED}
            assert ran == 0

    def node(self, name: str, **kwargs: object) -> Node:
        return super().node(name, config=ON_ROS2, **kwargs)


@pytest.fixture(scope="module", autouse=True)
def definitions() -> None:
    for name, definition in DEFINITIONS.items():
        ros2_registry("jazzy").define("action", f"actionlib/{name}", definition)


DEFINITIONS = {
    "Test": "int32 goal\n---\nint32 result\n---\nint32 feedback\n",
    "TestRequest": """\
int32 terminate_status
bool ignore_cancel
string result_text
int32 the_result
bool is_simple_client
builtin_interfaces/Duration delay_accept
builtin_interfaces/Duration delay_terminate
builtin_interfaces/Duration pause_status
---
int32 the_result
bool is_simple_server
---
""",
    "TwoInts": "int64 a\nint64 b\n---\nint64 sum\n---\n",
}


@pytest.fixture(params=TRANSPORTS)
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    with opened_world(request.param, Ros2World) as world:
        yield world


for _name in NOT_ON_ROS2:
    del globals()[_name]
