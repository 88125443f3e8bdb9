"""One program and several robots: each with a router of its own, one of them by TLS, or a namespace."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core import ServiceProxy
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.clock import RealClock
from actionlib_core.config import Config, Ros2, Tls
from actionlib_core.exceptions import TransportError
from actionlib_core.goal.states import Status
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node
from actionlib_core.transport import _refusal
from actionlib_core.transport.zenoh import ZenohTransport
from actionlib_core.wire.ros2.network import ros_network
from tests.actionlib_core.transport.test_security import write_certificate
from tests.free_port import free_port

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = pytest.mark.zenoh

LONG_S = 60.0
CLOCK = RealClock()


@pytest.fixture
def left() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def route(left: ExitStack, protocol: str, tls: Tls | None = None) -> str:
    """Start a router; return where it listens."""
    endpoint = f"{protocol}/127.0.0.1:{free_port()}"
    router = ZenohTransport(
        Config(
            mode="router",
            listen=(endpoint,),
            discovery="off",
            timestamping=True,
            **({"tls": tls} if tls else {}),
        )
    )
    left.callback(router.close)
    return endpoint


def serve(left: ExitStack, number: int, config: Config, namespace: str = "") -> None:
    """Be a robot with the action `fib`, whose results are its number."""

    def on_goal(goal: Any) -> None:
        goal.set_accepted()
        goal.set_succeeded(Fibonacci.Result(sequence=[number]))

    node = left.enter_context(Node("robot", namespace=namespace, clock=CLOCK, config=config))
    left.callback(ActionServer("fib", Fibonacci, on_goal, node=node).stop)


def ask(node: Node, name: str) -> int:
    """Return the number of the robot that gets a goal of this name."""
    client = SimpleActionClient(name, Fibonacci, node=node)
    try:
        assert client.wait_for_server(LONG_S)
        client.send_goal(Fibonacci.Goal(order=1))
        assert client.wait_for_result(LONG_S)
        assert client.get_state() == Status.SUCCEEDED
        number: int = client.get_result().sequence[0]
        return number
    finally:
        client.stop()


def test_robots_with_the_same_names_behind_routers_of_their_own(left, tmp_path: Path):
    ca = write_certificate(tmp_path, "ca")
    write_certificate(tmp_path, "robot", issuer=ca)
    trust = Tls(ca=str(tmp_path / "ca.pem"), verify_name=False)
    certificate, key = (str(tmp_path / f"robot.{end}") for end in ("pem", "key"))
    own = Tls(ca=trust.ca, certificate=certificate, key=key)
    plain, secret = route(left, "tcp"), route(left, "tls", own)
    settings = (
        Ros2(router=plain, robot="red"),
        Ros2(router=secret, robot="blue", distro="kilted"),
        Ros2(router=plain, names=("green/**",), namespace="fleet"),
    )
    robots = (plain, ""), (secret, ""), (plain, "fleet/green")
    for number, (router, namespace) in enumerate(robots):
        config = Config(discovery="off", tls=trust, ros2=(Ros2(router=router),))
        serve(left, number, config, namespace)
    config = Config(discovery="off", tls=trust, ros2=settings)
    node = left.enter_context(Node("mission", clock=CLOCK, config=config))
    assert [ask(node, f"{name}/fib") for name in ("red", "blue", "green")] == [0, 1, 2]
    parameters: Any = ros2.get_service("rcl_interfaces/ListParameters")
    call = ServiceProxy("red/robot/list_parameters", parameters, node=node, timeout=LONG_S)
    assert call().result.names == ["use_sim_time"]


def test_a_router_whose_certificate_nobody_has_signed_is_refused(
    left, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(_refusal, "PROBE_S", LONG_S)
    for name in ("ca", "stranger"):
        write_certificate(tmp_path, name)
    own = Tls(
        ca=str(tmp_path / "stranger.pem"),
        certificate=str(tmp_path / "stranger.pem"),
        key=str(tmp_path / "stranger.key"),
    )
    endpoint = route(left, "tls", own)
    config = Config(
        discovery="off",
        connect_timeout=0.5,
        tls=Tls(ca=str(tmp_path / "ca.pem"), verify_name=False),
        ros2=(Ros2(router=endpoint),),
    )
    node = left.enter_context(Node("mission", clock=CLOCK, config=config))
    with pytest.raises(TransportError, match="certificate"):
        ros_network(node, "fib")
