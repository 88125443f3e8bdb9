"""What only real sessions and processes can show: exits, kills, stops, and a router between."""

from __future__ import annotations

import itertools
import os
import signal
import socket
import subprocess
import sys
import threading
from contextlib import ExitStack, contextmanager, suppress
from functools import partial

import pytest

from actionlib_core.clock import RealClock
from actionlib_core.config import Config, load_config
from actionlib_core.exceptions import ConfigError, TransportError
from actionlib_core.transport import Quality
from actionlib_core.transport import zenoh as zenoh_transport
from actionlib_core.transport._access import ACCESS_KEY
from actionlib_core.transport._inlet import Inside
from actionlib_core.transport.zenoh import ZenohTransport
from actionlib_core.transport.zenoh._callbacks import Held
from actionlib_core.transport.zenoh._declared import (
    LATCHED_REMEMBERED,
    Watcher,
    _LatchFilter,
    _pack_numbers,
)
from actionlib_core.transport.zenoh._shared import FEW
from actionlib_core.wire.private_network import _free_domain
from tests.free_port import free_port

pytestmark = pytest.mark.zenoh

CLOCK = RealClock()
WAIT_S = 60.0  # only a failing test waits so long


class Watch:
    """Follows the tokens `@test/*` and waits for them."""

    def __init__(self, transport):
        self._changed = CLOCK.event()
        self.alive = set()
        transport.watch_alive("@test/*", self)

    def __call__(self, presence):
        (self.alive.add if presence.alive else self.alive.discard)(presence.key)
        self._changed.set()

    def wait(self, condition, timeout=WAIT_S):
        deadline = CLOCK.now() + timeout
        while not condition(self.alive):
            assert self._changed.wait(deadline - CLOCK.now()), self.alive
            self._changed.clear()


@contextmanager
def child(code, **environment):
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout, process.stderr):
            pipe.close()


START = """
import sys, threading, time
from actionlib_core.transport import Quality
from actionlib_core.transport._access import ACCESS_KEY
from actionlib_core.transport._inlet import Inside
from actionlib_core.transport.zenoh import ZenohTransport
t = ZenohTransport()
t.subscribe("goal", lambda sample: None)
t.queryable("add", lambda query: None)
token = t.declare_alive("@test/child")
"""

ENDINGS = {
    "falls off the end": "sys.stdin.readline()",
    "sys.exit": "sys.stdin.readline(); sys.exit(3)",
    "exception": "sys.stdin.readline(); raise ValueError('no')",
    "keyboard interrupt": "sys.stdin.readline(); raise KeyboardInterrupt",
    "closed before": "sys.stdin.readline(); t.close()",
    "thread still busy": (
        "threading.Thread(target=time.sleep, args=(60,), daemon=True).start(); sys.stdin.readline()"
    ),
    "a query is open": (
        "t.query('add', b'', timeout=60, on_reply=print, on_done=print); sys.stdin.readline()"
    ),
    "in a callback": (
        "t.subscribe('goal', lambda s: time.sleep(60)); t.publisher('goal').put(b''); "
        "sys.stdin.readline()"
    ),
    "default node": (
        "from actionlib_core import get_node; get_node().on_close(lambda: print('closed', "
        "flush=True)); sys.stdin.readline()"
    ),
    "many sessions": "more = [ZenohTransport() for _ in range(3)]; sys.stdin.readline()",
}


@pytest.mark.slow
@pytest.mark.parametrize("ending", ENDINGS)
def test_program_ends_on_every_path(ending):
    transport = ZenohTransport()
    try:
        watch = Watch(transport)
        with child(START + ENDINGS[ending]) as process:
            watch.wait(lambda alive: alive)
            process.stdin.write("\n")
            process.stdin.close()
            process.wait(WAIT_S)  # under a second alone; what goes on would take a minute
            watch.wait(lambda alive: not alive)
            assert process.returncode >= 0 or ending == "keyboard interrupt"
            errors = process.stderr.read()
            assert "Fatal" not in errors
            if ending == "default node":
                assert process.stdout.read() == "closed\n"
    finally:
        transport.close()


BUSY = """
def publish(n):
    publisher = t.publisher(f"busy{n % 3}")
    while True:
        publisher.put(bytes(100))
def declare(n):
    while True:
        t.subscribe("busy0", lambda sample: None).close()
def mark(n):
    while True:
        t.declare_alive(f"@test/busy{n}").close()
def for_ever(function, n):
    while True:
        with contextlib.suppress(Exception):
            function(n)
import contextlib
for n in range(24):
    function = (publish, declare, mark)[n % 3]
    threading.Thread(target=for_ever, args=(function, n), daemon=True).start()
sys.stdin.readline()
"""


@pytest.mark.slow
@pytest.mark.timeout(900)  # busy processes, one after the other
def test_program_ends_while_its_threads_go_on_using_the_network():
    for _ in range(3):
        with child(START + BUSY) as process:
            _, errors = process.communicate("\n", timeout=250)
            assert process.returncode == 0, errors


def test_killed_process_is_seen_at_once(tmp_path):
    file = tmp_path / "config.yaml"
    file.write_text(f"domain: {load_config().domain}\nlease: 100.0\n")
    transport = ZenohTransport(load_config(file))
    try:
        watch = Watch(transport)
        with child(START + "sys.stdin.readline()", SMACHPY_CONFIG=str(file)) as process:
            watch.wait(lambda alive: alive)
            done = CLOCK.event()
            transport.query("add", b"", timeout=3600.0, on_reply=print, on_done=done.set)
            process.kill()
            watch.wait(lambda alive: not alive)  # not by its link's silence: the lease is longer
            assert done.wait(WAIT_S)
    finally:
        transport.close()


@pytest.mark.slow
def test_stopped_process_is_lost_after_its_lease_and_found_again(tmp_path):
    file = tmp_path / "config.yaml"
    file.write_text(f"domain: {load_config().domain}\nlease: 1.0\n")
    transport = ZenohTransport(load_config(file))
    try:
        watch = Watch(transport)
        with child(START + "sys.stdin.readline()", SMACHPY_CONFIG=str(file)) as process:
            watch.wait(lambda alive: alive)
            process.send_signal(signal.SIGSTOP)
            watch.wait(lambda alive: not alive)
            process.send_signal(signal.SIGCONT)
            # Peers look for each other ever more rarely, at last every 8 s, and one look may be
            # too early: before the other side has noticed that the old link is dead.
            watch.wait(lambda alive: alive)
    finally:
        transport.close()


@pytest.mark.slow
def test_close_does_not_wait_for_a_process_that_does_not_read(monkeypatch):
    transport = ZenohTransport()
    watch = Watch(transport)
    with child(START + "sys.stdin.readline()") as process:
        watch.wait(lambda alive: alive)
        process.send_signal(signal.SIGSTOP)
        publisher = transport.publisher("goal")
        stuck = CLOCK.event()

        def flood():
            try:
                while True:
                    timer = CLOCK.call_later(3.0, stuck.set)  # on a busy computer one takes long
                    publisher.put(bytes(1_000_000))
                    timer.cancel()
            except TransportError:
                pass

        task = CLOCK.spawn(flood, name="flood")
        assert stuck.wait(WAIT_S)
        monkeypatch.setattr(zenoh_transport, "CLOSE_S", 0.1)
        transport.close()
        # Zenoh's own close waits for 10 s: it has been left behind.
        assert any(thread.name == "transport-close" for thread in threading.enumerate())
        process.kill()
        assert task.join(WAIT_S)


@pytest.fixture
def router():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    transport = ZenohTransport(Config(mode="router", listen=(endpoint,), discovery="off"))
    yield endpoint
    transport.close()


@pytest.mark.parametrize("mode", ["client", "peer"])
def test_sessions_meet_through_a_router(router, mode):
    config = Config(mode=mode, connect=(router,), discovery="off")
    a, b = ZenohTransport(config), ZenohTransport(config)
    try:
        latched = a.publisher("map", "enc", Quality(latch=True))
        latched.put(b"old")
        latched.put(b"new")
        a.queryable("add", lambda q: (q.reply(b"sum of " + q.payload), q.finish()))
        a.declare_alive("@test/a")
        watch = Watch(b)
        watch.wait(lambda alive: alive)
        heard, answers, changed = [], [], CLOCK.event()

        def on_sample(sample):
            heard.append(sample)
            if sample.payload == b"new":
                changed.set()

        b.subscribe("map", on_sample)
        assert changed.wait(WAIT_S)
        done = CLOCK.event()
        b.query("add", b"1", timeout=WAIT_S, on_reply=answers.append, on_done=done.set)
        assert done.wait(WAIT_S)
        # Tokens overtake samples: the live "old" may still have been on its way.
        assert [s[1:4] for s in heard if s.payload != b"old"] == [(b"new", "enc", a.session_id)]
        assert [r.payload for r in answers] == [b"sum of 1"]
        for _ in range(400):  # an answer lacks at times what the session was told meanwhile
            assert b.list_alive("@test/*", WAIT_S) == ["@test/a"]
        a.close()
        watch.wait(lambda alive: not alive)
    finally:
        a.close()
        b.close()


class Cable:
    """A TCP connection to `port` that can be cut: while it is, nothing passes, and nothing ends."""

    def __init__(self, port):
        self._target = ("127.0.0.1", port)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._open = threading.Event()
        self._open.set()
        self._sockets = [self._listener]
        self._tasks = [CLOCK.spawn(self._accept, name="cable")]

    def _accept(self):
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            far = socket.create_connection(self._target)
            self._sockets += [near, far]
            for source, sink in ((near, far), (far, near)):
                task = CLOCK.spawn(partial(self._pump, source, sink), name="cable")
                self._tasks.append(task)

    def _pump(self, source, sink):
        try:
            while data := source.recv(65536):
                self._open.wait()
                sink.sendall(data)
        except OSError:
            pass
        finally:
            self._open.wait()
            for end in (source, sink):
                with suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)

    def cut(self):
        self._open.clear()

    def mend(self):
        self._open.set()

    def close(self):
        self.mend()
        for end in self._sockets:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
        for task in self._tasks:
            task.join(WAIT_S)


@pytest.mark.slow
@pytest.mark.parametrize("longer_than_lease", [False, True])
def test_cut_cable(longer_than_lease):
    port = free_port()
    # Only the link with the cable is short of patience: a busy computer cuts none of the others.
    lease = 2.0 if longer_than_lease else 100.0
    common = {"discovery": "off", "lease": 100.0}
    router = ZenohTransport(Config(mode="router", listen=(f"tcp/127.0.0.1:{port}",), **common))
    cable = Cable(port)
    connect = (f"tcp/127.0.0.1:{cable.port}",)
    near = ZenohTransport(Config(mode="client", connect=connect, discovery="off", lease=lease))
    far = ZenohTransport(Config(mode="client", connect=(f"tcp/127.0.0.1:{port}",), **common))
    try:
        watch = Watch(far)
        near.declare_alive("@test/near")
        watch.wait(lambda alive: alive)
        heard, changed = [], CLOCK.event()

        def on_sample(sample):
            heard.append(sample.payload)
            changed.set()

        far.subscribe("map", on_sample)
        publisher = near.publisher("map", "", Quality(latch=True))
        publisher.put(b"before")
        assert changed.wait(WAIT_S)
        changed.clear()
        cable.cut()
        publisher.put(b"during")
        if longer_than_lease:
            watch.wait(lambda alive: not alive)
        else:
            assert not changed.wait(0.5)
        cable.mend()
        watch.wait(lambda alive: alive)
        assert changed.wait(WAIT_S)
        assert heard == [b"before", b"during"]
    finally:
        for transport in (near, far, router):
            transport.close()
        cable.close()


def test_unreachable_router_is_named():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    config = Config(mode="client", connect=(endpoint,), connect_timeout=0.3, discovery="off")
    with pytest.raises(TransportError) as caught:
        ZenohTransport(config)
    text = str(caught.value)
    assert text.startswith(f"cannot join the network as client: {endpoint}: nothing answers there")
    assert "Try starting the router with 'actionlib router'" in text


def test_taken_endpoint_is_named(router):
    with pytest.raises(TransportError, match="cannot join the network as router"):
        ZenohTransport(Config(mode="router", listen=(router,), discovery="off"))


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        (
            {"discovery": "eth77"},
            "discovery: no such network interface: got 'eth77'; expected one of",
        ),
        ({"listen": ("foo/bar",)}, "cannot join the network as peer: .*foo"),
        ({"listen": ("tcp/127.0.0.1:99999",)}, "cannot join the network as peer"),
        (
            {"connect": ("tcp/127.0.0.1:x",), "connect_timeout": 0.1},
            "cannot join the network as peer",
        ),
    ],
)
def test_what_cannot_work_is_an_error(fields, text):
    with pytest.raises((ConfigError, TransportError), match=text) as caught:
        ZenohTransport(Config(**fields))
    assert "/root/" not in str(caught.value)
    assert ".rs:" not in str(caught.value)


def test_domains_do_not_meet():
    with _free_domain() as second:
        first = load_config().domain
        sessions = [ZenohTransport(Config(domain=domain, settle=0.3)) for domain in (first, second)]
        try:
            sessions[0].declare_alive("@test/a")
            assert sessions[1].list_alive("@test/*", 0.5) == []
        finally:
            for session in sessions:
                session.close()


def test_settled_session_knows_the_others_when_it_is_open():
    first = ZenohTransport()
    try:
        first.declare_alive("@test/a")
        second = ZenohTransport(Config(domain=load_config().domain, settle=5.0))
        try:
            assert second.list_alive("@test/*", WAIT_S) == ["@test/a"]
        finally:
            second.close()
    finally:
        first.close()


def test_no_thread_of_ours_while_idle():
    before = {t for t in threading.enumerate() if t.name.startswith("transport")}
    transport = ZenohTransport()
    try:
        for number in range(50):
            transport.subscribe(f"key/{number}", print)
        assert {t for t in threading.enumerate() if t.name.startswith("transport")} <= before
    finally:
        transport.close()


def test_router_command_serves_until_it_is_told_to_end():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    command = [
        sys.executable, "-c", "import sys; from actionlib_core.cli import main; sys.exit(main())",
        "router", "--listen", endpoint,
    ]  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        line = process.stdout.readline()
        assert f"listens at {endpoint}" in line
        config = Config(mode="client", connect=(endpoint,), discovery="off")
        ZenohTransport(config).close()
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0
    finally:
        process.kill()
        process.communicate()


LETS_GO = """
import threading
from actionlib_core.transport._access import ACCESS_KEY
from actionlib_core.transport._inlet import Inside
from actionlib_core.transport.zenoh import ZenohTransport
from actionlib_core.transport.zenoh._callbacks import held

transport = ZenohTransport()
began, go_on = threading.Event(), threading.Event()

def slow(sample):
    began.set()
    go_on.wait(60)

transport.subscribe("test/slow", slow, history=False)
sender = ZenohTransport()
publisher = sender.publisher("test/slow")
while not publisher.matching():
    began.wait(0.01)
publisher.put(b"x")
assert began.wait(60)
transport.close()
sender.close()
assert not held.wait(0.0)
go_on.set()
assert held.wait(60)
print("let go")
"""


def test_zenoh_lets_go_of_a_callback_when_it_has_returned_and_not_before():
    with child(LETS_GO) as process:
        out, errors = process.communicate(timeout=250)
    assert (out, errors) == ("let go\n", "")


_FORK = """
import os, sys, time
from actionlib_core import SimpleActionClient, SimpleActionServer, get_node
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal
from actionlib_core.transport._access import ACCESS_KEY
from actionlib_core.transport._inlet import Inside
from actionlib_core.transport.zenoh import ZenohTransport

server = SimpleActionServer("demo", TestAction, lambda goal: server.set_succeeded())
client = SimpleActionClient("demo", TestAction)
client.wait_for_server()
pid = os.fork()
if pid == 0:
    for attempt in (
        lambda: client.send_goal_and_wait(TestGoal(1)),
        lambda: SimpleActionClient("demo", TestAction).send_goal_and_wait(TestGoal(1)),
        lambda: SimpleActionClient("other", TestAction),
        ZenohTransport,
    ):
        try:
            attempt()
        except ConnectionError as error:
            print(str(error).partition(": ")[2][:23], flush=True)
    sys.exit(0)
print("exit code", os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), flush=True)
print("status", client.send_goal_and_wait(TestGoal(2)), flush=True)
"""


def test_forked_process_is_told_that_it_has_no_network():
    """It waited for ever, for threads that a fork does not copy; its parent goes on."""
    with child(_FORK) as process:
        output, errors = process.communicate(timeout=250)
    told = ["this process was forked"] * 4
    assert output.splitlines() == [*told, "exit code 0", "status 3"], errors
    assert "Traceback" not in errors


def test_end_of_the_interpreter_waits_for_calls_that_have_begun():
    """A thread that came back from zenoh after the interpreter's end aborted the process."""
    calls = Inside()
    begun, release = threading.Event(), threading.Event()

    def call():
        with calls:
            begun.set()
            release.wait(WAIT_S)

    thread = threading.Thread(target=call)
    thread.start()
    assert begun.wait(WAIT_S)
    calls.wait_idle(0.01)
    assert calls.depths
    with calls:  # a thread does not wait for itself
        release.set()
        calls.wait_idle(WAIT_S)
        assert list(calls.depths) == [threading.get_ident()]
    thread.join(WAIT_S)


def test_no_call_begins_after_the_end_of_the_interpreter_has_waited_for_calls():
    calls = Inside()
    begun, release, told = threading.Event(), threading.Event(), []

    def call():
        with calls:
            begun.set()
            release.wait(WAIT_S)
            with calls:  # of a call that was waited for
                told.append("goes on")
        try:
            with calls:
                told.append("late")
        except TransportError as error:
            told.append(str(error).partition(";")[0])

    thread = threading.Thread(target=call)
    thread.start()
    assert begun.wait(WAIT_S)
    timer = threading.Timer(0.05, release.set)
    timer.start()
    calls.end(WAIT_S)
    thread.join(WAIT_S)
    assert told == ["goes on", "network: got a call as the interpreter exits"]
    assert not calls.depths
    with calls:  # by the thread that ends the interpreter
        assert list(calls.depths) == [threading.get_ident()]
    timer.join()


LATE = """
import threading
from actionlib_core.transport.zenoh import ZenohTransport

transport = ZenohTransport()
queries, asked = [], threading.Event()

def note(query):
    queries.append(query)
    asked.set()

transport.queryable("late", note)
transport.query("late", b"", timeout=60.0, on_reply=print, on_done=int)
publisher = transport.publisher("later")
assert asked.wait(60)
started = threading.Barrier(4)

def repeat(call):
    started.wait()
    while True:
        call()

def publish():
    try:
        publisher.put(b"x")
    except ConnectionError:
        pass

def answer(query=queries.pop()):
    query.reply(b"x")

for call in (answer, answer, publish):
    threading.Thread(target=repeat, args=(call,), daemon=True).start()
started.wait()
"""


@pytest.mark.slow
def test_threads_that_still_send_as_the_interpreter_ends_do_not_abort_the_process():
    """It said 'exception not rethrown': they came back from zenoh after the interpreter's end."""
    with ExitStack() as left:
        domains = [str(left.enter_context(_free_domain())) for _ in range(5)]
        processes = [left.enter_context(child(LATE, SMACHPY_DOMAIN=one)) for one in domains]
        for process in processes:
            _, errors = process.communicate(timeout=250)
            assert process.returncode == 0, errors


def test_time_in_which_the_process_was_stopped_is_not_waiting(monkeypatch):
    """As it went on, all that the interpreter's end waits for seemed to be late, and was left."""
    calls, held = Inside(), Held()
    begun, release = threading.Event(), threading.Event()

    def last():
        """What zenoh lets go of."""

    held.add(last)

    def call(last):
        with calls:
            begun.set()
            release.wait(WAIT_S)

    thread = threading.Thread(target=call, args=(last,))
    del last
    thread.start()
    assert begun.wait(WAIT_S)
    stopped = itertools.count(step=100.0)
    monkeypatch.setattr(RealClock, "now", lambda *_: next(stopped))
    timer = threading.Timer(0.05, release.set)
    timer.start()
    calls.wait_idle(WAIT_S)
    assert not calls.depths
    assert held.wait(WAIT_S)
    thread.join()
    timer.join()


def test_what_fails_as_the_interpreter_ends_is_not_freed(monkeypatch):
    """A subscriber in a frame of the error went back to Python after the interpreter's end."""
    kept = []
    transport = ZenohTransport()
    transport.session.close()
    with monkeypatch.context() as at_the_end:
        at_the_end.setattr(zenoh_transport, "kept", kept)
        at_the_end.setattr(zenoh_transport.ending, "begun", True)
        with pytest.raises(TransportError) as caught:
            transport.subscribe("late", print)
    assert kept == [caught.value.__cause__]
    transport.close()


def test_closed_publisher_is_not_entered():
    transport = ZenohTransport()
    publisher = transport.publisher("closed")
    publisher.close()
    publisher._port = None  # whatever is called on it raises AttributeError
    with pytest.raises(TransportError, match="closed: the publisher is closed"):
        publisher.put(b"x")
    assert not publisher.matching()
    transport.close()


def test_messages_carry_the_time_they_were_sent_at_if_the_session_says_so():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    a = ZenohTransport(Config(listen=(endpoint,), discovery="off", timestamping=True))
    b = ZenohTransport(Config(connect=(endpoint,), discovery="off"))
    try:
        stamps, came = [], CLOCK.event()

        def note(sample):
            stamps.append(sample.stamp_ns)
            came.set()

        b.subscribe("stamped", note, history=False)
        for session in (a, b):
            session.declare_alive(f"@test/{session.session_id}")
        Watch(a).wait(lambda alive: len(alive) == 2)
        publisher = a.publisher("stamped")
        before = CLOCK.time_ns()
        publisher.put(b"x", b"att")
        assert came.wait(WAIT_S)
        assert before - 1_000_000 <= stamps[0] <= CLOCK.time_ns() + 1_000_000
    finally:
        a.close()
        b.close()


def test_a_thousand_watches_of_single_names_have_few_subscribers():
    """Zenoh walks all tokens for each: a thousand servers took 6 s of CPU to start."""
    transport = ZenohTransport()
    try:
        for number in range(1_000):
            transport.watch_alive(f"@test/*/{number}", print)
            transport.list_alive(f"@test/*/{number}", WAIT_S)
        assert sum(isinstance(entry, Watcher) for entry in transport._declared) == FEW + 1
        assert transport.watches.known("@test/*/7") == []
    finally:
        transport.close()


def test_own_tokens_are_noted_before_the_network_tells_of_them(monkeypatch):
    """A token that was declared again just after its end was sometimes not heard by own watches."""
    transport = ZenohTransport(Config(discovery="off"))
    try:
        note, seen = transport.watches.note_own, []

        def noted(key, change):
            answers = transport.session.liveliness().get(key, timeout=WAIT_S)
            seen.append((change, [str(answer.ok.key_expr) for answer in answers]))
            note(key, change)

        monkeypatch.setattr(transport.watches, "note_own", noted)
        token = transport.declare_alive("@test/a/1")
        token.close()
        token.close()
        assert seen == [(1, []), (-1, ["@test/a/1"])]
    finally:
        transport.close()


def test_latched_message_that_comes_last_is_the_one_that_is_kept(monkeypatch):
    transport = ZenohTransport()
    try:
        live, kept, news = [], [], CLOCK.event()

        def see(seen, sample):
            seen.append(sample.payload)
            news.set()

        def wait_for(seen, count):
            while len(seen) < count:
                assert news.wait(WAIT_S), seen
                news.clear()

        transport.subscribe("latched", partial(see, live), history=False)
        publisher = transport.publisher("latched", "", Quality(latch=True))
        other, send = threading.Thread(target=publisher.put, args=(b"2",)), publisher._send

        def send_late(payload, attachment):
            if payload == b"1":
                other.start()
                other.join(0.2)  # it may not overtake, so it waits for this one
            send(payload, attachment)

        monkeypatch.setattr(publisher, "_send", send_late)
        publisher.put(b"1")
        other.join(WAIT_S)
        wait_for(live, 2)
        transport.subscribe("latched", partial(see, kept))
        wait_for(kept, 1)
        assert kept == live[-1:]
    finally:
        transport.close()


def test_answers_that_are_no_access_rules_keep_nobody_out(monkeypatch):
    monkeypatch.setattr(zenoh_transport, "ACCESS_S", WAIT_S)
    port = free_port()
    endpoint = (f"tcp/127.0.0.1:{port}",)
    router = ZenohTransport(Config(mode="router", listen=endpoint, discovery="off"))
    try:

        def answer(query):
            query.reply(b"junk")
            query.finish()

        router.queryable(ACCESS_KEY, answer)
        client = ZenohTransport(Config(mode="client", connect=endpoint, discovery="off"))
        try:
            client.publisher("some/name").put(b"")
        finally:
            client.close()
    finally:
        router.close()


def test_a_subscriber_of_a_latched_topic_remembers_a_bounded_number_of_publishers():
    copies = _LatchFilter()
    for publisher in range(3 * LATCHED_REMEMBERED):
        assert copies.take_asked("robot", _pack_numbers(publisher, 2))
        assert copies.take_live(
            "steady", _pack_numbers(0, publisher + 1)
        )  # it is heard all the time
    assert len(copies._numbers) == LATCHED_REMEMBERED
    newest = 3 * LATCHED_REMEMBERED - 1
    assert not copies.take_live("robot", _pack_numbers(newest, 2))  # the copy
    assert not copies.take_asked("steady", _pack_numbers(0, newest + 1))
    assert copies.take_live("robot", _pack_numbers(newest, 3))
