"""Links that were lost and found: a process is suspended for longer than the lease and goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, contextmanager

import pytest
import zenoh

from actionlib_core.action.client import ActionClient
from actionlib_core.clock import RealClock
from actionlib_core.config import Config
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.node import Node
from actionlib_core.transport._keys import is_for_another_key, key_mark
from actionlib_core.transport._zenoh_config import is_local, new_session_id
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.transport.zenoh import ZenohTransport
from actionlib_core.wire.private_network import _free_domain
from tests.free_port import free_port

CLOCK = RealClock()
DOMAIN = int(os.environ["SMACHPY_DOMAIN"])
LEASE_S = 1.0
LONG_S = 60.0
KEYS = 6

# Answers what is put on `ask/<n>` by putting on `answer/<n>` the two keys that it came from and to.
ECHO = """
import sys
from actionlib_core.config import Config
from actionlib_core.transport.zenoh import ZenohTransport

session = ZenohTransport(Config(**{config}))

def echo(number):
    answer = session.publisher(f"answer/{{number}}")
    def callback(sample):
        answer.put(sample.payload + f" ask/{{number}} answer/{{number}}".encode())
    session.subscribe(f"ask/{{number}}", callback, history=False)

for number in range({keys}):
    echo(number)
session.declare_alive("@test/echo")
print("ready", flush=True)
sys.stdin.read()
session.close()
"""


def order(session_id: str) -> bytes:
    """Return what zenoh compares of an id."""
    return int(session_id, 16).to_bytes(16, "little")


def test_later_session_has_the_greater_id():
    now = 1_800_000_000_000_000_000
    ids = [new_session_id(now + delay) for delay in (0, 1, 255, 256, 10**6, 10**9, 10**18)]
    assert sorted(ids, key=order) == ids
    assert new_session_id(now) != new_session_id(now)


def test_mark_tells_a_message_for_another_key():
    mark = key_mark("robot_0/arm/goal")
    assert not is_for_another_key(mark, mark)
    assert is_for_another_key(key_mark("robot_0/arm/cancel"), mark)


@pytest.mark.parametrize("foreign", [0, 1, 1_000_000])
def test_foreign_senders_that_count_their_messages_are_heard(foreign):
    assert not is_for_another_key(foreign, key_mark("robot_0/arm/goal"))


@contextmanager
def sessions(*configs):
    opened = []
    try:
        for config in configs:
            opened.append(ZenohTransport(config))
        yield opened
    finally:
        for session in opened:
            session.close()


def wait_until(condition):
    deadline = CLOCK.now() + LONG_S
    event = CLOCK.event()
    while not condition():
        assert CLOCK.now() < deadline
        event.wait(0.01)


@pytest.mark.zenoh
@pytest.mark.parametrize("set_by", [0.0, -3600.0])
def test_of_two_peers_the_later_one_dials(monkeypatch, set_by):
    """Also if the computer's clock was put back: the later one was then found within 8 s only."""
    with ExitStack() as stack:
        # No other session: one of an earlier test may be in the network of this process.
        config = Config(domain=stack.enter_context(_free_domain()))
        earlier = stack.enter_context(sessions(config))
        monkeypatch.setattr(
            RealClock, "time_ns", staticmethod(lambda: time.time_ns() + int(set_by * 1e9))
        )
        with sessions(config, config) as later:
            links = [session.session.info.links for session in (*earlier, *later)]
            wait_until(lambda: all(len(of()) == 2 for of in links))
            # Who was dialled has its listener's port at its end of every link.
            listeners = {link.src for link in links[0]()}
            dialled = [{link.dst for link in of()} for of in links[1:]]
    assert len(listeners) == 1
    assert all(listeners <= ports for ports in dialled)


def test_only_a_session_on_loopback_is_local():
    assert is_local(Config())
    others = [
        {"discovery": "auto"},
        {"discovery": "off"},
        {"listen": ("tcp/0.0.0.0:7447",)},
        {"connect": ("tcp/robot:7447",)},
        {"connect": ("tcp/robot:7447",), "mode": "client"},
        {"mode": "router"},
    ]
    assert not any(is_local(Config(**other)) for other in others)


@pytest.mark.zenoh
def test_message_that_arrives_on_a_wrong_key_is_dropped(caplog):
    config = Config(domain=DOMAIN)
    inbox, arrived = [], CLOCK.event()

    def callback(sample):
        inbox.append(sample.payload)
        arrived.set()

    with sessions(config) as (session,):
        session.subscribe("arm/cancel", callback)
        for key in ("gripper/cancel", "arm/cancel"):
            source = zenoh.SourceInfo(session.session.id, key_mark(key))
            session.session.put("arm/cancel", key.encode(), source_info=source)
        assert arrived.wait(LONG_S)
    assert inbox == [b"arm/cancel"]
    assert "arm/cancel" in caplog.text


@pytest.mark.zenoh
def test_question_that_arrives_on_a_wrong_key_is_not_answered():
    config = Config(domain=DOMAIN)
    asked = []

    def answer(query):
        asked.append(query.payload)
        query.reply(b"done")
        query.finish()

    with sessions(config) as (session,):
        session.queryable("gripper/open", answer)
        for key in ("gripper/close", "gripper/open"):
            done = threading.Event()
            session.session.get(
                "gripper/open",
                zenoh.handlers.Callback(lambda _: None, done.set, indirect=False),
                payload=key.encode(),
                source_info=zenoh.SourceInfo(session.session.id, key_mark(key)),
                timeout=LONG_S,
            )
            assert done.wait(LONG_S)
    assert asked == [b"gripper/open"]


class Echo:
    """Asks the echo on every key, and waits until every key has answered."""

    def __init__(self, session: ZenohTransport) -> None:
        self._session = session
        self.answers: list[tuple[str, str]] = []
        self._publishers = [session.publisher(f"ask/{number}") for number in range(KEYS)]
        for number in range(KEYS):
            session.subscribe(f"answer/{number}", self._take, history=False)
        self.alive: list[bool] = []
        session.watch_alive("@test/echo", lambda presence: self.alive.append(presence.alive))

    def _take(self, sample) -> None:
        self.answers.append((sample.key, sample.payload.decode()))

    def ask(self, word: str) -> set[tuple[str, str]]:
        for number, publisher in enumerate(self._publishers):
            publisher.put(f"{word} ask/{number}".encode())
        return {
            (f"answer/{number}", f"{word} ask/{number} ask/{number} answer/{number}")
            for number in range(KEYS)
        }

    def check(self, word: str) -> None:
        """Ask until all have answered, and check that no word came on another's key."""
        wanted: set[tuple[str, str]] = set()

        def answered() -> bool:
            wanted.update(self.ask(word))
            return wanted <= set(self.answers)

        wait_until(answered)


@contextmanager
def echo_process(config):
    code = ECHO.format(config=config, keys=KEYS)
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout.readline() == "ready\n"
        yield process
    finally:
        process.kill()
        process.wait()
        process.stdin.close()
        process.stdout.close()


def suspend(process, echo: Echo, rounds: int) -> None:
    """Suspend a process for longer than the lease; when it is back everything is as before."""
    echo.check("before")
    for number in range(rounds):
        seen = len(echo.alive)
        os.kill(process.pid, signal.SIGSTOP)
        wait_until(lambda seen=seen: False in echo.alive[seen:])
        os.kill(process.pid, signal.SIGCONT)
        wait_until(lambda seen=seen: True in echo.alive[seen:])
        echo.check(f"after{number}")
    astray = [
        (key, words)
        for key, words in echo.answers
        if words.split()[1] != words.split()[2] or words.split()[3] != key
    ]
    assert astray == []


@pytest.mark.zenoh
@pytest.mark.slow  # peers that have lost each other look around every 8 s
@pytest.mark.parametrize("later", ["this one", "the suspended one"])
def test_peer_that_was_suspended_longer_than_the_lease_is_whole_again(later):
    config = {"domain": DOMAIN, "lease": LEASE_S}
    with ExitStack() as stack:
        processes = [stack.enter_context(echo_process(config)) for _ in range(later == "this one")]
        (session,) = stack.enter_context(sessions(Config(**config)))
        echo = Echo(session)
        processes += [stack.enter_context(echo_process(config)) for _ in range(not processes)]
        suspend(processes[0], echo, rounds=2)


@pytest.mark.slow
@pytest.mark.zenoh
def test_client_of_a_router_that_was_suspended_longer_than_the_lease_is_whole_again():
    router = f"tcp/127.0.0.1:{free_port()}"
    common = {"discovery": "off", "lease": LEASE_S}
    client = {"mode": "client", "connect": (router,), **common}
    with sessions(Config(mode="router", listen=(router,), **common), Config(**client)) as opened:
        echo = Echo(opened[1])
        with echo_process(client) as process:
            suspend(process, echo, rounds=2)


class Network:
    """A transport of which only the speed of its rediscovery matters."""

    def __init__(self, session, rediscovery: float) -> None:
        self._session = session
        self.rediscovery = rediscovery
        self.is_local = False

    def __getattr__(self, name):
        return getattr(self._session, name)


@pytest.mark.parametrize(
    ("patience", "warned"), [(0.0, False), (3.0, True), (8.0, False), (30.0, False)]
)
def test_patience_that_ends_before_a_lost_link_is_found_is_warned_of(
    clock, caplog, patience, warned
):
    session = MemoryNetwork(clock).session()
    node = Node("mission", transport=Network(session, rediscovery=8.0), clock=clock)
    client = ActionClient("dock", Action, node=node, server_lost_timeout=patience)
    assert [record.args for record in caplog.records] == [("dock", 3.0, 8.0)] * warned
    client.stop()
    node.close()
    session.close()


@pytest.mark.zenoh
def test_rediscovery_is_that_of_the_configured_network():
    peer = Config(domain=DOMAIN)
    router = Config(mode="router", listen=("tcp/127.0.0.1:0",), discovery="off")
    with sessions(peer, router) as opened:
        assert opened[0].rediscovery == 8.0
        assert opened[1].rediscovery < 8.0
