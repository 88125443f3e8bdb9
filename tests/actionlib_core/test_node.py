"""Nodes: names, the default one, and closing."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import RealClock, VirtualClock, use_clock
from actionlib_core.exceptions import InvalidNameError, NameSetupError, NodeError, TransportError
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.names import parse_arguments
from actionlib_core.node import CLOSE_S, Node, get_node, use_node
from actionlib_core.transport.faulty import FaultyTransport
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.presence import list_endpoints


def test_names_of_a_node(network, clock):
    node = Node("nav", transport=network.session(), clock=clock, namespace="/robot_1")
    assert (node.name, node.namespace, node.full_name) == ("nav", "robot_1", "robot_1/nav")
    assert node.resolve("goal") == "robot_1/goal"
    assert node.resolve("/goal") == "goal"
    assert node.resolve("~goal") == "robot_1/nav/goal"
    with pytest.raises(InvalidNameError, match="invalid action name"):
        node.resolve("go al", "action name")
    for bad in ("a/b", "", "~x"):
        with pytest.raises(InvalidNameError, match="node name"):
            Node(bad, transport=network.session())


def test_arguments_rename_node_and_names(network, clock):
    arguments = parse_arguments(["__ns:=/robot_2", "__name:=patrol", "goal:=/arm/goal"])
    node = Node("nav", transport=network.session(), namespace="robot_1", arguments=arguments)
    assert node.full_name == "robot_2/patrol"
    assert node.resolve("goal") == "arm/goal"
    assert node.resolve("cancel") == "robot_2/cancel"


def test_a_node_that_is_renamed_keeps_what_is_announced(network, clock):
    arguments = parse_arguments(["goal:=~goal"])
    node = Node("python_42", transport=network.session(), namespace="lab", arguments=arguments)
    node.announce(Kind.SERVICE, "early", "p/T", "1")
    node.rename("nav")
    node.announce(Kind.SERVICE, "late", "p/T", "1")
    assert (node.full_name, node.resolve("goal")) == ("lab/nav", "lab/nav/goal")
    ends = list_endpoints(network.session())
    assert {(e.name, e.node) for e in ends} == {("early", "lab/python_42"), ("late", "lab/nav")}
    with pytest.raises(InvalidNameError, match="node name"):
        node.rename("a b")


def test_announced_ends_are_seen_until_closed(network, clock):
    node = Node("nav", transport=network.session())
    first = node.announce(Kind.SERVICE, "grip", "p/T", "1")
    node.announce(Kind.SERVICE, "grip", "p/T", "1")
    ends = list_endpoints(network.session())
    assert [e.entity for e in ends] == sorted({e.entity for e in ends})
    assert {(e.name, e.node) for e in ends} == {("grip", "nav")}
    first.close()
    assert len(list_endpoints(network.session())) == 1


def test_closing_calls_the_newest_first_and_survives_errors(network, clock, monkeypatch):
    reported = []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(str(args.exc_value)))
    node = Node("nav", transport=network.session())
    order = []

    def fail():
        raise ValueError("second")

    node.on_close(lambda: order.append("first"))
    node.on_close(fail)
    forget = node.on_close(lambda: order.append("forgotten"))
    node.on_close(lambda: order.append("third"))
    forget()
    forget()
    with node:
        assert not node.closed
    node.close()
    assert (order, reported, node.closed) == (["third", "first"], ["second"], True)
    with pytest.raises(NodeError, match="nav: it is closed"):
        node.on_close(print)


def test_closing_asks_all_before_it_closes_the_first(network, clock, monkeypatch):
    reported = []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(str(args.exc_value)))
    node = Node("nav", transport=network.session())
    order = []

    def fail():
        raise ValueError("asked")

    node.on_close(lambda: order.append("first"), ask=lambda: order.append("ask first"))
    node.on_close(lambda: order.append("second"), ask=fail)
    node.on_close(lambda: order.append("third"))
    node.on_close(lambda: order.append("fourth"), ask=lambda: order.append("ask fourth"))
    node.close()
    assert order == ["ask fourth", "ask first", "fourth", "third", "second", "first"]
    assert reported == ["asked"]


def test_closers_share_the_time_that_a_node_has(network, clock):
    node = Node("nav", transport=network.session())
    assert node.time_to_leave(0.3) == 0.3
    left = []
    for _ in range(5):
        node.on_close(lambda: (left.append(node.time_to_leave(0.3)), clock.sleep(left[-1])))
    before = clock.now()
    node.close()
    assert clock.now() - before == pytest.approx(CLOSE_S)
    assert left == pytest.approx([0.3, 0.3, CLOSE_S - 0.6, 0.0, 0.0])


@pytest.mark.parametrize("trouble", ["stubborn callbacks", "a dead client"])
def test_node_with_many_servers_closes_within_a_second(network, clock, trouble):
    """The servers stopped one after another, each with all the time that one may take."""
    node = Node("nav", transport=network.session())
    client_node = Node("client", transport=FaultyTransport(network.session(), clock=clock))
    running, release = [], clock.event()

    def execute(goal):
        running.append(goal)
        release.wait(5.0) if trouble == "stubborn callbacks" else None

    clients = []
    for number in range(6):
        SimpleActionServer(f"demo_{number}", msg.TestAction, execute, node=node)
        clients.append(ActionClient(f"demo_{number}", msg.TestAction, node=client_node))
        assert clients[-1].wait_for_server(5.0)
    if trouble == "a dead client":
        client_node.transport.cut(100.0)
    else:
        for client in clients:
            client.send_goal(msg.TestGoal(1))
        clock.sleep(1.0)
        assert len(running) == 6
    before = clock.now()
    node.close()
    assert clock.now() - before < 1.0
    release.set()
    client_node.close()


def test_closing_leaves_a_transport_that_was_given_open(network, clock):
    session = network.session()
    Node("nav", transport=session).close()
    session.declare_alive("@x/a")


def test_closing_may_be_called_from_many_threads(network, clock):
    node = Node("nav", transport=network.session())
    closed = []
    node.on_close(lambda: closed.append(True))
    for number in range(5):
        clock.spawn(node.close, name=f"closer {number}")
    clock.sleep(1)
    assert closed == [True]


def test_use_node_is_in_force_in_its_block_and_its_tasks(network, clock):
    node = Node("nav", transport=network.session())
    seen = []
    with use_node(node):
        assert get_node() is node
        clock.spawn(lambda: seen.append(get_node()), name="task")
        clock.sleep(1)
    assert seen == [node]


def test_no_default_node_on_a_virtual_clock():
    with VirtualClock() as clock, use_clock(clock), pytest.raises(NodeError, match="use_node"):
        get_node()


def test_no_zenoh_on_a_virtual_clock(clock):
    with pytest.raises(NodeError, match="node nav: the clock is not the real one"):
        Node("nav")


def run(code, *arguments, **environment):
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.mark.zenoh
def test_default_node_is_made_once_by_many_threads():
    done = run("""
import threading
from actionlib_core.node import get_node
nodes = []
threads = [threading.Thread(target=lambda: nodes.append(get_node())) for _ in range(10)]
for thread in threads: thread.start()
for thread in threads: thread.join()
print(len(set(map(id, nodes))), nodes[0].name.rsplit("_", 1)[0])
""")
    assert done.stdout == "1 c\n" or done.stdout.startswith("1 "), done.stderr


@pytest.mark.zenoh
def test_init_names_the_default_node_and_keeps_the_programs_arguments():
    done = run(
        """
import actionlib_core
node = actionlib_core.init("nav", namespace="robot_1")
print(node.full_name, actionlib_core.get_node() is node, node.arguments.rest)
try:
    actionlib_core.init("again")
except actionlib_core.ActionlibError as error:
    print(error)
node.close()
print(actionlib_core.init("second").full_name)
""",
        "--fast",
        "__name:=patrol",
    )
    first, second, third = done.stdout.splitlines()
    assert first == "robot_1/patrol True ('--fast',)"
    assert "the default node exists already: got 'again'" in second
    assert third == "patrol"


@pytest.mark.zenoh
def test_configuration_of_the_environment_is_used(tmp_path):
    file = tmp_path / "config.yaml"
    file.write_text("namespace: robot_7\n")
    done = run("import actionlib_core; print(actionlib_core.get_node().namespace)",
               SMACHPY_CONFIG=str(file))  # fmt: skip
    assert done.stdout == "robot_7\n", done.stderr


def test_importing_loads_no_network():
    done = run("import sys, actionlib_core, actionlib_core.node, actionlib_core.pubsub.topic\n"
               "print([m for m in ('zenoh', 'rosbags', 'numpy', 'ruamel') if m in sys.modules])")  # fmt: skip
    assert done.stdout == "[]\n", done.stderr


def test_wrong_arguments_are_all_told():
    with pytest.raises(NameSetupError) as caught:
        parse_arguments(["a:=b c", "__name:=x/y"])
    assert len(caught.value.problems) == 2


@pytest.mark.zenoh
def test_node_on_zenoh_closes_its_session():
    node = Node("nav", clock=RealClock())
    transport = node.transport
    node.close()
    with pytest.raises(TransportError):
        transport.declare_alive("@x/a")


def test_what_is_shared_may_need_other_shared_things(clock, network):
    with Node("mission", transport=network.session(), clock=clock) as node:
        made = node.shared("client", lambda: [node.shared("network", object)])
        assert made == [node.shared("network", object)]
