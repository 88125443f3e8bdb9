"""Our client at a server of ROS 2 in a process of its own, behind a router: what breaks, and when."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.server import ActionServer
from actionlib_core.config import Config, Ros2
from actionlib_core.goal.states import CommState, Status
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node
from tests.ros2_robot import DOMAIN, Ros2Robot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.action.client import ClientGoalHandle

pytestmark = pytest.mark.zenoh

LONG_S = 60.0
PROBE_S, NEVER_S = 0.5, 1e9
UNDECIDED, HELD, ENDS = 1, 2, 3  # what the server does with a goal, by its order
SERVER = """
import os, sys
from actionlib_core.action.server import ActionServer
from actionlib_core.config import Config, Ros2
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node
from actionlib_core.wire.ros2 import server_port

server_port.DECISION_S = 600.0  # as ROS 2, which answers when its callback does

def on_goal(goal):
    order = goal.get_goal().order
    os.write(1, b"%d\\n" % order)
    if order != 1:
        goal.set_accepted()
    if order > 2:
        goal.set_succeeded(Fibonacci.Result(sequence=[order]))

def on_cancel(goal):
    os.write(1, b"cancel\\n")

# A link counts as dead only after so long: what is lost earlier is lost by its tokens, or a probe.
robot = Ros2(router=sys.argv[1], domain=42, distro="kilted")
config = Config(discovery="off", lease=100.0, ros2=(robot,))
with Node("robot", config=config) as node:
    server = ActionServer("fib", Fibonacci, on_goal, on_cancel, node=node)
    print("ready", flush=True)
    server.wait()
"""


class Process:
    """A server in a process of its own; each goal that it gets is a line of its output."""

    def __init__(self, robot: Ros2Robot) -> None:
        self.child = subprocess.Popen(
            [sys.executable, "-c", SERVER, robot.endpoint], stdout=subprocess.PIPE, text=True
        )
        robot.left.callback(self.child.wait)
        robot.left.callback(self.child.kill)
        assert self.child.stdout is not None
        robot.left.enter_context(self.child.stdout)
        assert self.line() == "ready"

    def line(self) -> str:
        assert self.child.stdout is not None
        return self.child.stdout.readline().strip()

    def stop(self) -> None:
        """Suspend it; returns when it has stopped."""
        self.child.send_signal(signal.SIGSTOP)
        os.waitpid(self.child.pid, os.WUNTRACED)

    def lines_left(self) -> list[str]:
        """Kill it; return what it had still to say."""
        self.child.kill()
        assert self.child.stdout is not None
        return self.child.stdout.read().split()


class Client:
    """A client, and the states that a goal of it has passed."""

    def __init__(self, robot: Ros2Robot, *, lost_after: float = 0.0) -> None:
        network = replace(robot.config.ros2[0], probe=0.0)
        node = Node("mission", clock=robot.clock, config=replace(robot.config, ros2=(network,)))
        robot.left.enter_context(node)
        self.clock = robot.clock
        self.client = ActionClient("fib", Fibonacci, node=node, server_lost_timeout=lost_after)
        assert self.client.wait_for_server(LONG_S)

    def send(self, order: int, until: CommState | None = None) -> ClientGoalHandle:
        """Send a goal; wait until it is in a state."""
        there = self.clock.event()
        handle = self.client.send_goal(
            Fibonacci.Goal(order=order),
            lambda goal: there.set() if goal.get_comm_state() is until else None,
        )
        assert until is None or there.wait(LONG_S)
        return handle


@contextlib.contextmanager
def probing(handle: ClientGoalHandle) -> Iterator[None]:
    """Look often whether the server is there: only while it is not, as a busy one is slow."""
    port: Any = handle.manager.port
    port._probe._every = PROBE_S
    port._probe.watch()
    yield
    port._probe._every = NEVER_S


def reach(phase: str, process: Process, client: Client) -> ClientGoalHandle:
    """Bring a goal to a phase of its life."""
    if phase == "sent":
        handle = client.send(UNDECIDED)
        assert process.line() == str(UNDECIDED)
        return handle
    handle = client.send(HELD, CommState.ACTIVE)
    assert process.line() == str(HELD)
    if phase == "canceling":
        handle.cancel()
        assert process.line() == "cancel"
    return handle


PHASES = ["sent", "active", "canceling"]


@pytest.mark.slow
@pytest.mark.parametrize("phase", PHASES)
def test_goal_of_a_killed_server_is_lost(robot: Ros2Robot, phase: str) -> None:
    process = Process(robot)
    client = Client(robot)
    handle = reach(phase, process, client)
    process.child.send_signal(signal.SIGKILL)
    # By its tokens, not by the silence of its link; benchmarks/ros2_actions.py has the time.
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.LOST
    again = Process(robot)
    assert client.client.wait_for_server(LONG_S)
    assert client.send(ENDS).wait(LONG_S)
    assert again.lines_left() == [str(ENDS)]  # and not the goal that was lost


@pytest.mark.slow
@pytest.mark.parametrize("phase", PHASES)
def test_goal_of_a_suspended_server_is_lost_and_the_server_found_again(
    robot: Ros2Robot, phase: str
) -> None:
    process = Process(robot)
    client = Client(robot)
    handle = reach(phase, process, client)
    process.stop()
    with probing(handle):
        assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.LOST
    process.child.send_signal(signal.SIGCONT)
    assert client.client.wait_for_server(LONG_S)
    last = client.send(ENDS)
    assert last.wait(LONG_S)
    assert last.get_goal_status() == Status.SUCCEEDED
    assert process.lines_left() == [str(ENDS)]


@pytest.mark.slow
def test_goal_outlives_its_router(robot: Ros2Robot) -> None:
    process = Process(robot)
    client = Client(robot, lost_after=LONG_S)
    handle = client.send(HELD, CommState.ACTIVE)
    robot.router.close()
    robot.route()
    assert not handle.wait(0.2)
    again = Client(robot)
    assert again.send(ENDS).wait(LONG_S)
    assert handle.get_comm_state() is CommState.ACTIVE
    handle.cancel()
    assert [process.line() for _ in range(3)] == [str(HELD), str(ENDS), "cancel"]


@pytest.mark.slow
def test_goal_on_its_way_outlives_its_router(robot: Ros2Robot) -> None:
    """Zenoh ends open questions while it holds a lock that the next question needs."""
    process = Process(robot)
    client = Client(robot, lost_after=LONG_S)
    handle = client.send(UNDECIDED)
    assert process.line() == str(UNDECIDED)
    robot.router.close()
    robot.route()
    assert client.send(ENDS).wait(LONG_S)
    assert handle.get_comm_state() is CommState.WAITING_FOR_GOAL_ACK
    assert process.lines_left() == [str(ENDS)]


class Cable:
    """A way to a router on which bytes stop to flow, while its connections stay open."""

    def __init__(self, endpoint: str) -> None:
        self._there = "127.0.0.1", int(endpoint.rpartition(":")[2])
        self._whole = threading.Event()
        self._whole.set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._listener.getsockname()[1]}"
        self._sockets: list[socket.socket] = []
        self._threads: list[threading.Thread] = []
        self._start(self._accept)

    def _start(self, work: Callable[..., None], *args: object) -> None:
        self._threads.append(threading.Thread(target=work, args=args))
        self._threads[-1].start()

    def _accept(self) -> None:
        while True:
            try:
                here, _ = self._listener.accept()
                there = socket.create_connection(self._there)
            except OSError:
                return
            self._sockets += [here, there]
            self._start(self._pump, here, there)
            self._start(self._pump, there, here)

    def _pump(self, source: socket.socket, sink: socket.socket) -> None:
        try:
            while data := source.recv(65536):
                self._whole.wait()
                sink.sendall(data)
        except OSError:
            return

    def cut(self) -> None:
        self._whole.clear()

    def mend(self) -> None:
        self._whole.set()

    def close(self) -> None:
        self.mend()
        for end in (self._listener, *self._sockets):
            with contextlib.suppress(OSError):  # it has ended by itself
                end.shutdown(socket.SHUT_RDWR)
            end.close()
        for thread in self._threads:
            thread.join()


@pytest.mark.slow
def test_goal_behind_a_cut_cable_is_lost_and_the_server_found_again(robot: Ros2Robot) -> None:
    process = Process(robot)
    cable = Cable(robot.endpoint)
    robot.left.callback(cable.close)
    robot.config = replace(
        robot.config, ros2=(replace(robot.config.ros2[0], router=cable.endpoint),)
    )
    client = Client(robot)
    handle = client.send(HELD, CommState.ACTIVE)
    cable.cut()
    with probing(handle):
        assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.LOST
    cable.mend()
    assert client.client.wait_for_server(LONG_S)
    assert client.send(ENDS).wait(LONG_S)
    assert process.lines_left() == [str(HELD), str(ENDS)]


def test_goals_run_in_one_of_two_servers(robot: Ros2Robot) -> None:
    first = Process(robot)
    client = Client(robot)
    other = Twin(robot)
    first_orders = range(ENDS, ENDS + 20)
    handles = [client.send(order) for order in first_orders]
    assert all(handle.wait(LONG_S) for handle in handles)
    ran = Counter(first.lines_left()) + Counter(other.orders)
    assert ran == Counter(str(order) for order in first_orders)


class Twin:
    """A second server of the name, which does not mind that there is one, as those of ROS 2."""

    def __init__(self, robot: Ros2Robot) -> None:
        from actionlib_core.wire.ros2.action_messages import pack_accepted
        from tests.ros2_server import Ros2Server

        self.orders: list[str] = []
        server = Ros2Server(
            robot.session(), robot.clock, "fib", Fibonacci, domain=DOMAIN, distro="kilted"
        )
        robot.left.callback(server.close)

        def succeed(query: object, uuid: bytes) -> None:
            self.orders.append(str(server.goals[uuid].order))
            server.reply(query, pack_accepted(1))  # type: ignore[arg-type]
            server.end(uuid, 4)

        server.on_goal = succeed
        server.on_result = lambda query, uuid: server.answer_result(
            query, 4 if uuid in server.states else 0
        )


@pytest.mark.slow
def test_a_thousand_goals(robot: Ros2Robot) -> None:
    process = Process(robot)
    client = Client(robot)
    orders = range(ENDS, ENDS + 1000)
    handles = [client.send(order) for order in orders]
    for order, handle in zip(orders, handles, strict=True):
        assert handle.wait(2 * LONG_S)
        assert handle.get_result() == Fibonacci.Result(sequence=[order])
    assert sorted(map(int, process.lines_left())) == list(orders)


def test_one_node_in_both_worlds(robot: Ros2Robot) -> None:
    """A session with two wires: names of ROS 2 beside those of our own, each with its own types."""
    shared = Config(mode="client", connect=(robot.endpoint,), discovery="off", timestamping=True)
    config = replace(shared, ros2=(Ros2(domain=DOMAIN, distro="kilted", names=("fib",)),))
    here = robot.left.enter_context(Node("both", clock=robot.clock, config=config))
    there = robot.left.enter_context(Node("robot", clock=robot.clock, config=config))

    def on_ros2(goal: object) -> None:
        goal.set_accepted()  # type: ignore[attr-defined]
        goal.set_succeeded(Fibonacci.Result(sequence=[2]))  # type: ignore[attr-defined]

    def on_own(goal: object) -> None:
        goal.set_accepted()  # type: ignore[attr-defined]
        goal.set_aborted(text="own")  # type: ignore[attr-defined]

    ActionServer("fib", Fibonacci, on_ros2, node=there)
    ActionServer("own", msg.TestAction, on_own, node=there)
    clients = [
        ActionClient("fib", Fibonacci, node=here),
        ActionClient("own", msg.TestAction, node=here),
    ]
    assert all(client.wait_for_server(LONG_S) for client in clients)
    handles = [
        clients[0].send_goal(Fibonacci.Goal(order=1)),
        clients[1].send_goal(msg.TestGoal(goal=1)),
    ]
    assert all(handle.wait(LONG_S) for handle in handles)
    assert handles[0].get_result() == Fibonacci.Result(sequence=[2])
    assert handles[1].get_goal_status_text() == "own"
    assert (
        here.transport.session_id
        == here.shared(("ros2", config.ros2[0]), lambda: None).transport.session_id
    )
