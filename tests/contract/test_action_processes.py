"""Actions between real processes: killed, stopped, restarted, and with the link cut."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.config import Config
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.node import Node
from actionlib_core.transport.zenoh import ZenohTransport
from tests.free_port import free_port

pytestmark = pytest.mark.zenoh

LEASE_S = 1.0
LONG_S = 60.0

# Its goals take so many tenths of a second, those of 0 until the test says so.
SERVER = """
import sys, threading
from actionlib_core.config import Config
from actionlib_core.interfaces.actionlib.msg import TestAction, TestFeedback, TestResult
from actionlib_core.node import Node
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.transport.zenoh import ZenohTransport

config = Config(discovery="off", listen=("tcp/127.0.0.1:{port}",), lease={lease})
node = Node("server", transport=ZenohTransport(config))
over = threading.Event()

def execute(goal):
    print("run", goal.goal, flush=True)
    preempted = server.wait_preempt(goal.goal / 10 or 0.01)
    while goal.goal == 0 and not preempted and not over.is_set():
        preempted = server.wait_preempt(0.01)
    if preempted:
        server.set_preempted()
    else:
        server.set_succeeded(TestResult(goal.goal + 1))
    print("preempted" if preempted else "ended", flush=True)

server = SimpleActionServer("demo", TestAction, execute, node=node, on_client_lost="{on_lost}")
print("ready", flush=True)
for _ in sys.stdin:
    over.set()
node.close()
node.transport.close()
"""

CLIENT = """
from actionlib_core.action.client import ActionClient
from actionlib_core.config import Config
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal
from actionlib_core.node import Node
from actionlib_core.transport.zenoh import ZenohTransport

config = Config(discovery="off", connect=("tcp/127.0.0.1:{port}",), lease={lease})
node = Node("doomed", transport=ZenohTransport(config))
client = ActionClient("demo", TestAction, node=node, server_lost_timeout={patience})
assert client.wait_for_server(60)
handle = client.send_goal(TestGoal(600))
handle.wait()
print(handle.get_terminal_state().name, flush=True)
"""


class Process:
    """A Python program of a test, ended with it."""

    def __init__(self, script: str, **values: object) -> None:
        values = {"lease": LEASE_S, "on_lost": "continue", "patience": 0.0, **values}
        self.process = subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(script).format(**values)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def expect(self, line: str) -> None:
        ready, _, _ = select.select([self.process.stdout], [], [], LONG_S)
        assert ready, f"no line within {LONG_S} s; expected {line!r}"
        assert self.process.stdout.readline().strip() == line

    def end_goal(self) -> None:
        """Let the server end its goal, and wait until it has."""
        self.process.stdin.write("over\n")
        self.process.stdin.flush()
        self.expect("ended")

    def signal(self, number: int) -> None:
        os.kill(self.process.pid, number)

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


class Proxy:
    """Passes TCP on to a port; `cut` ends all links and lets none in until `mend`."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._pairs: list[socket.socket] = []
        self._open = True
        self._is_cut = threading.Event()
        self._alive = True
        self._thread = threading.Thread(target=self._run, name="proxy")
        self._thread.start()

    def _run(self) -> None:
        links: dict[socket.socket, socket.socket] = {}
        while self._alive:
            readable, _, _ = select.select([self._listener, *links], [], [], 0.05)
            if not self._open:
                for link in links:
                    link.close()
                links.clear()
                self._is_cut.set()
                readable = [r for r in readable if r is self._listener]
            for link in readable:
                if link is self._listener:
                    self._accept(links)
                elif link in links:
                    self._pass_on(link, links)
        for link in links:
            link.close()
        self._listener.close()

    def _accept(self, links: dict[socket.socket, socket.socket]) -> None:
        front, _ = self._listener.accept()
        if not self._open:
            front.close()
            return
        back = socket.create_connection(("127.0.0.1", self._target))
        links[front], links[back] = back, front

    def _pass_on(self, link: socket.socket, links: dict[socket.socket, socket.socket]) -> None:
        try:
            data = link.recv(65536)
            if data:
                links[link].sendall(data)
                return
        except OSError:
            pass
        other = links.pop(link)
        links.pop(other, None)
        link.close()
        other.close()

    def cut(self) -> None:
        self._is_cut.clear()
        self._open = False
        assert self._is_cut.wait(LONG_S)

    def mend(self) -> None:
        self._open = True

    def close(self) -> None:
        self._alive = False
        self._thread.join()


@pytest.fixture
def stage():
    """Starts processes, proxies and clients, and ends them all."""
    with_close = []

    class Stage:
        port = free_port()

        def process(self, script, **values):
            process = Process(script, **{"port": self.port, **values})
            with_close.append(process.close)
            return process

        def server(self, **values):
            server = self.process(SERVER, **values)
            server.expect("ready")
            return server

        def proxy(self):
            proxy = Proxy(self.port)
            with_close.append(proxy.close)
            return proxy

        def client(self, port=None, *, lease=LEASE_S, **kwargs):
            endpoint = f"tcp/127.0.0.1:{port or self.port}"
            config = Config(discovery="off", connect=(endpoint,), lease=lease)
            transport = ZenohTransport(config)
            node = Node("client", transport=transport)
            with_close.append(transport.close)
            with_close.append(node.close)
            client = ActionClient("demo", msg.TestAction, node=node, **kwargs)
            assert client.wait_for_server(LONG_S)
            return client

    yield Stage()
    for close in reversed(with_close):
        close()


def test_kill_of_the_server_is_known_at_once(stage):
    server = stage.server(lease=3 * LONG_S)
    client = stage.client(lease=3 * LONG_S)
    handle = client.send_goal(msg.TestGoal(600))
    server.expect("run 600")
    server.signal(signal.SIGKILL)
    assert handle.wait(LONG_S)  # long before the lease; 50 ms on a computer with nothing else to do
    assert handle.get_terminal_state().name == "LOST"
    assert "node 'server'" in handle.get_goal_status_text()


@pytest.mark.parametrize("on_lost", ["continue", "cancel"])
def test_kill_of_the_client(stage, on_lost):
    server = stage.server(on_lost=on_lost)
    doomed = stage.process(CLIENT)
    server.expect("run 600")
    doomed.signal(signal.SIGKILL)
    if on_lost == "cancel":
        server.expect("preempted")
        return
    client = stage.client()
    second = client.send_goal(msg.TestGoal(1))  # preempts the goal that goes on
    server.expect("preempted")
    assert second.wait(LONG_S)


@pytest.mark.slow
def test_server_stopped_for_longer_than_the_lease(stage):
    server = stage.server()
    client = stage.client(server_lost_timeout=LONG_S)
    handle = client.send_goal(msg.TestGoal(0))
    server.expect("run 0")
    server.signal(signal.SIGSTOP)
    time.sleep(2.5 * LEASE_S)
    assert not handle.wait(0)
    server.signal(signal.SIGCONT)
    server.end_goal()
    assert handle.wait(LONG_S)
    assert handle.get_terminal_state().name == "SUCCEEDED"
    assert handle.get_result() == msg.TestResult(1)


@pytest.mark.slow
def test_server_stopped_without_patience_is_lost(stage):
    server = stage.server()
    client = stage.client()
    handle = client.send_goal(msg.TestGoal(600))
    server.expect("run 600")
    server.signal(signal.SIGSTOP)
    assert handle.wait(LONG_S)
    assert handle.get_terminal_state().name == "LOST"
    server.signal(signal.SIGCONT)


@pytest.mark.slow
@pytest.mark.parametrize("on_lost", ["continue", "cancel"])
def test_client_stopped_for_longer_than_the_lease(stage, on_lost):
    """To the server it is dead meanwhile; it has not noticed, and asks for what it missed."""
    server = stage.server(on_lost=on_lost)
    client = stage.process(CLIENT.replace("600", "0"), patience=LONG_S)
    server.expect("run 0")
    client.signal(signal.SIGSTOP)
    if on_lost == "cancel":
        server.expect("preempted")
    else:
        time.sleep(2.5 * LEASE_S)
        server.end_goal()
    client.signal(signal.SIGCONT)
    client.expect("PREEMPTED" if on_lost == "cancel" else "SUCCEEDED")


@pytest.mark.slow
def test_restarted_server_takes_the_next_goal_and_not_the_old_one(stage):
    server = stage.server(lease=3 * LONG_S)
    client = stage.client(lease=3 * LONG_S)
    handle = client.send_goal(msg.TestGoal(600))
    server.expect("run 600")
    server.signal(signal.SIGKILL)
    assert handle.wait(LONG_S)
    server.close()
    again = stage.server(lease=3 * LONG_S)
    following = client.send_goal(msg.TestGoal(1))
    assert following.wait(LONG_S)
    assert following.get_terminal_state().name == "SUCCEEDED"
    again.expect("run 1")


@pytest.mark.slow
@pytest.mark.parametrize("cut_s", [1.5, pytest.param(5.0, marks=pytest.mark.slow)])
def test_link_cut_during_a_goal(stage, cut_s):
    server = stage.server()
    proxy = stage.proxy()
    client = stage.client(proxy.port, server_lost_timeout=LONG_S)
    handle = client.send_goal(msg.TestGoal(0))
    server.expect("run 0")
    proxy.cut()
    server.end_goal()
    time.sleep(cut_s)
    assert not handle.wait(0)
    proxy.mend()
    assert handle.wait(LONG_S)
    assert handle.get_terminal_state().name == "SUCCEEDED"
    assert handle.get_result() == msg.TestResult(1)
