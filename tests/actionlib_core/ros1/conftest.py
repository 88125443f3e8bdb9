"""A real ROS 1 master, and programs on rospy, from Debian's packages."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import xmlrpc.client
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from actionlib_core import ros1
from actionlib_core.clock import RealClock
from actionlib_core.node import Node, use_node
from actionlib_core.shutdown import Shutdown, use_shutdown
from tests.free_port import free_port

if TYPE_CHECKING:
    from collections.abc import Iterator

PROGRAMS = Path(__file__).parent / "programs"
ROSMASTER = shutil.which("rosmaster")
ROS_PYTHON = "/usr/bin/python3"  # the one that Debian's packages are for
START_S = 60.0
# What the master's state has, in this order.
WITHDRAW = ("unregisterPublisher", "unregisterSubscriber", "unregisterService")
PATIENT_S = 60.0  # without a status list of a server in ROS: a busy one sends none for a while


class Ros:
    """A master of its own and the programs that were started for it."""

    def __init__(self) -> None:
        self.port = free_port()
        self.uri = f"http://127.0.0.1:{self.port}"
        self._environment = {
            **{k: v for k, v in os.environ.items() if not k.startswith(("ROS", "PYTHON"))},
            "ROS_MASTER_URI": self.uri,
            "ROS_IP": "127.0.0.1",
            "PYTHONUNBUFFERED": "1",
        }
        self.programs: list[Program] = []
        self.start_master()

    def start_master(self) -> None:
        """Start the master and wait until it answers."""
        assert ROSMASTER is not None
        arguments = [ROSMASTER, "--core", "-p", str(self.port)]
        self._master = subprocess.Popen(
            arguments, env=self._environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        clock = RealClock()
        deadline = clock.now() + START_S
        while clock.now() < deadline:  # it says nothing when it is ready
            try:
                self.ask("getPid")
            except OSError:
                clock.sleep(0.05)
            else:
                return
        raise TimeoutError("rosmaster")

    def end_master(self) -> None:
        self._master.kill()
        self._master.wait()

    def ask(self, method: str, *arguments: object) -> object:
        with xmlrpc.client.ServerProxy(self.uri) as master:
            code, text, value = getattr(master, method)("/test", *arguments)
        assert code == 1, text
        return value

    def names_of(self, node: str) -> list[str]:
        """What the master has registered for nodes whose names begin so."""
        state = self.ask("getSystemState")
        return [
            name
            for part in state
            for name, nodes in part
            if any(other.startswith(node) for other in nodes)
        ]

    def start(self, program: str, *arguments: str, ready: bool = True) -> Program:
        """Start a program on rospy; with `ready`, wait for its first line, which says so."""
        started = Program(
            [ROS_PYTHON, str(PROGRAMS / f"{program}.py"), *arguments], self._environment
        )
        self.programs.append(started)
        if ready:
            assert started.read() == "ready"
        return started

    def end_programs(self) -> None:
        """Kill the programs, and take from the master what it still has of them."""
        for program in self.programs:
            program.end()
        self.programs.clear()
        for part, withdraw in zip(self.ask("getSystemState"), WITHDRAW, strict=True):
            for name, nodes in part:
                for node in nodes:
                    self._withdraw(withdraw, name, node)

    def _withdraw(self, method: str, name: str, node: str) -> None:
        with xmlrpc.client.ServerProxy(self.uri) as master:
            of_services = method == "unregisterService"
            _, _, uri = (
                master.lookupService(node, name) if of_services else master.lookupNode(node, node)
            )
            getattr(master, method)(node, name, uri)

    def end(self) -> None:
        for program in self.programs:
            program.end()
        self.end_master()


class Program:
    """A child that answers lines with lines."""

    def __init__(self, arguments: list[str], environment: dict[str, str]) -> None:
        self._child = subprocess.Popen(
            arguments, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def say(self, text: str) -> None:
        self._child.stdin.write(f"{text}\n")
        self._child.stdin.flush()

    def read(self) -> str:
        return self._child.stdout.readline().strip()

    def ask(self, text: str) -> str:
        self.say(text)
        return self.read()

    def send_signal(self, number: signal.Signals) -> None:
        self._child.send_signal(number)

    def end(self) -> None:
        self._child.kill()
        self._child.communicate()


@pytest.fixture(scope="session")
def ros_system() -> Iterator[Ros]:
    if ROSMASTER is None:
        pytest.skip("needs a ROS 1 master; try: .ci/ros1")
    system = Ros()
    yield system
    system.end()


@pytest.fixture
def ros(ros_system: Ros) -> Iterator[Ros]:
    """A master, and no programs from before."""
    yield ros_system
    ros_system.end_programs()


@pytest.fixture
def own_ros() -> Iterator[Ros]:
    """A master that a test may end."""
    if ROSMASTER is None:
        pytest.skip("needs a ROS 1 master; try: .ci/ros1")
    system = Ros()
    yield system
    system.end()


@pytest.fixture
def node() -> Iterator[Node]:
    """A node on our network, in force for the test."""
    with use_shutdown(Shutdown()), Node("mission", clock=RealClock()) as node, use_node(node):
        yield node


@pytest.fixture
def bridge(ros: Ros, node: Node):
    """`bridge(...)` starts a bridge to the master, which is closed at the end."""
    opened = []

    def bridge(**options):
        options = {"master": ros.uri, "status_timeout": PATIENT_S, **options}
        opened.append(ros1.bridge(options.pop("master"), **options))
        assert opened[-1].wait_for_master(START_S)
        return opened[-1]

    yield bridge
    for each in opened:
        each.close()


@contextlib.contextmanager
def impatient(bridge, action: str) -> Iterator[None]:
    """Let a server in ROS be gone after a moment without a status, while it cannot send any."""
    side = bridge._actions[action]._side
    side._status_timeout = 0.5
    yield
    side._status_timeout = PATIENT_S


@pytest.fixture
def command(ros: Ros):
    """`with command(...)` starts `smachpy bridge ros1`; gives the process and its node's name."""

    @contextlib.contextmanager
    def command(*options):
        program = Path(sys.executable).parent / "smachpy"
        with subprocess.Popen(
            [program, "bridge", "ros1", "--master", ros.uri, *options],
            stdout=subprocess.PIPE,
            text=True,
        ) as child:
            try:
                line = child.stdout.readline()
                assert "ready" in line
                yield child, line.partition(":")[0]
            finally:
                child.kill()

    return command
