"""A router as a ROS 2 robot has one, and sessions behind it."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING

from actionlib_core.config import Config, Ros2
from actionlib_core.node import Node
from actionlib_core.transport.zenoh import ZenohTransport
from tests.free_port import free_port

if TYPE_CHECKING:
    from actionlib_core.clock import Clock

DOMAIN = 42


class Ros2Robot:
    """A router in this process, which can be started again.

    Attributes:
        endpoint: Where the router listens.
        config: Of a program that uses the robot.
        left: Closed as the robot is, before its router.
    """

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.left = ExitStack()
        self.config = Config(
            discovery="off",
            connect_timeout=60.0,
            ros2=(Ros2(router=self.endpoint, domain=DOMAIN, distro="kilted"),),
        )
        self.route()

    def route(self) -> None:
        """Start the router."""
        self.router = ZenohTransport(
            Config(mode="router", listen=(self.endpoint,), discovery="off", timestamping=True)
        )

    def node(self, name: str = "robot") -> Node:
        return self.left.enter_context(Node(name, clock=self.clock, config=self.config))

    def session(self) -> ZenohTransport:
        """Return a session behind the router, without a node of ours."""
        session = ZenohTransport(self.config.for_ros2(self.config.ros2[0]))
        self.left.callback(session.close)
        return session

    def close(self) -> None:
        try:
            self.left.close()
        finally:
            self.router.close()
