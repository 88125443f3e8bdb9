"""Which ROS 2 network a name is on, what it is called there, and how it is joined."""

from __future__ import annotations

import pytest

from actionlib_core.clock import RealClock, VirtualClock, use_clock
from actionlib_core.config import Config, Ros2, load_config
from actionlib_core.exceptions import ConfigError, TransportError
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.ros2.names import HASH_NOT_SUPPORTED, Kind
from actionlib_core.wire.ros2.network import choose_network, name_there, ros_network
from tests.free_port import free_port

FLEET = (
    Ros2(router="tcp/10.0.0.1:7447", robot="robot1"),
    Ros2(router="tcp/10.0.0.2:7447", names=("robot2/**", "dock")),
    Ros2(router="tcp/10.0.0.3:7447"),
)


@pytest.mark.parametrize(
    ("name", "router"),
    [
        ("robot1/navigate_to_pose", "tcp/10.0.0.1:7447"),
        ("robot2/nav/spin", "tcp/10.0.0.2:7447"),
        ("dock", "tcp/10.0.0.2:7447"),
        ("robot10/spin", "tcp/10.0.0.3:7447"),
        ("spin", "tcp/10.0.0.3:7447"),
    ],
)
def test_names_choose_their_network(name, router):
    assert choose_network(FLEET, name).router == router


def test_name_of_no_network_is_refused():
    with pytest.raises(ConfigError, match=r"got 'spin'.*none of the 2 networks"):
        choose_network(FLEET[:2], "spin")


def test_the_network_without_settings_is_of_the_default_distribution(monkeypatch):
    """It was of Jazzy, whatever the environment said, so the classes and the network differed."""
    assert choose_network((), "spin").distro == "jazzy"
    monkeypatch.setenv("SMACHPY_ROS2_DISTRO", "humble")
    assert choose_network((), "spin").distro == "humble"


def test_only_network_has_every_name_and_none_is_the_own_session():
    assert choose_network(FLEET[1:2], "spin") == FLEET[1]
    assert choose_network((), "spin") == Ros2()


@pytest.mark.parametrize(
    ("network", "here", "there"),
    [
        (Ros2(), "a/b", "a/b"),
        (Ros2(namespace="/robot1/"), "spin", "robot1/spin"),
        (Ros2(namespace="robot1"), "robot1/spin", "robot1/spin"),
        (Ros2(robot="robot1"), "robot1/spin", "spin"),
        (Ros2(robot="red", namespace="robot1"), "red/spin", "robot1/spin"),
    ],
)
def test_name_there(network, here, there):
    assert name_there(network, here) == there


def read(tmp_path, text):
    path = tmp_path / "net.yaml"
    path.write_text(text)
    return load_config(path)


def test_configuration_file_has_one_network_or_a_list(tmp_path):
    text = "ros2: {router: tcp/robot:7447, domain: 42, distro: kilted, namespace: robot1}"
    only = Ros2(router="tcp/robot:7447", domain=42, distro="kilted", namespace="robot1")
    assert read(tmp_path, text).ros2 == (only,)
    several = read(
        tmp_path, "ros2: [{router: tcp/a:1, robot: a}, {router: tcp/b:1, names: [b/**]}]"
    )
    assert [network.router for network in several.ros2] == ["tcp/a:1", "tcp/b:1"]


@pytest.mark.parametrize(("text", "told"), [
    ("ros2:", "ros2: got None; expected lines such as 'router: "),
    ("ros2: tcp/robot:7447", "expected lines such as 'router: tcp/robot.local:7447', or a list of"),
    ("ros2: {map: move_base}", "ros2.map: got 'move_base'; expected a mapping of names"),
    ("ros2: {map: {a: {fields: [goal]}}}", "fields: got ['goal']; expected a mapping of names"),
])  # fmt: skip
def test_what_was_expected_in_place_of_a_network(tmp_path, text, told):
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, text)
    assert told in str(caught.value)


@pytest.mark.parametrize(
    "networks",
    [
        (Ros2(router="tcp/a:1"), Ros2(router="tcp/b:1")),
        (Ros2(router="tls/a:1"),),
        (Ros2(router="tcp/a:1", robot="red"), Ros2(router="tcp/b:1", robot="/red")),
    ],
)
def test_networks_that_cannot_be_told_apart_or_trusted_are_refused(networks):
    with pytest.raises(ConfigError):
        Config(ros2=networks)


def test_node_shows_itself_once_in_the_session_it_was_given():
    with VirtualClock() as clock, use_clock(clock):
        network = MemoryNetwork(clock)
        config = Config(ros2=(Ros2(router="tcp/nowhere:1", domain=42, distro="humble"),))
        node = Node("mission", transport=network.session(), clock=clock, config=config)
        other = Node("other", transport=node.transport, clock=clock, config=config)
        there, again = ros_network(node, "spin"), ros_network(node, "dock")
        assert there is again
        assert there.transport is node.transport
        assert there.type("a/msg/B", "RIHS01_00") == ("a/msg/B", HASH_NOT_SUPPORTED)
        ros_network(other, "spin")
        tokens = there.ros.list(kind=Kind.NODE)
        assert {token.node: token.domain for token in tokens} == {"mission": 42, "other": 42}
        assert len({token.entity_id for token in tokens}) == 2
        node.close()
        assert {token.node for token in ros_network(other, "x").ros.list()} == {"other"}
        other.close()


@pytest.mark.zenoh
def test_router_that_is_not_there_is_told_with_a_way_out():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    config = Config(connect_timeout=0.2, ros2=(Ros2(router=endpoint),))
    with Node("mission", clock=RealClock(), config=config) as node:
        with pytest.raises(TransportError, match="nothing answers there") as caught:
            ros_network(node, "spin")
        assert endpoint in str(caught.value)
        assert "rmw_zenohd" in str(caught.value)
        assert not node.closed


@pytest.mark.zenoh
@pytest.mark.parametrize("mode", ["client", "peer"])
def test_network_of_a_router_has_a_session_of_its_own_which_ends_with_the_node(mode):
    from actionlib_core.transport.zenoh import ZenohTransport

    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = ZenohTransport(Config(mode="router", listen=(endpoint,), discovery="off"))
    try:
        config = Config(ros2=(Ros2(router=endpoint, domain=7, mode=mode),))
        with Node("mission", clock=RealClock(), config=config) as node:
            there = ros_network(node, "spin")
            assert there.transport is not node.transport
            gone, here = RealClock().event(), RealClock().event()

            def on_token(presence):
                (here if presence.alive else gone).set()

            router.watch_alive("@ros2_lv/7/**", on_token)
            assert here.wait(60.0)
        assert gone.wait(60.0)
    finally:
        router.close()
