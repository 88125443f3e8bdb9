"""Calls to masters and nodes that are none, and links that are full: without a ROS 1."""

from __future__ import annotations

import socket
import threading

import pytest

from actionlib_core.clock import RealClock
from actionlib_core.exceptions import Ros1Error
from actionlib_core.node import Node
from actionlib_core.ros1 import links, rpc
from actionlib_core.ros1 import node as node_module
from actionlib_core.ros1.answers import SystemState
from actionlib_core.ros1.bridging import Ros1Bridge
from actionlib_core.ros1.frames import pack_frame
from actionlib_core.ros1.links import Budget, Connection, TcpListener
from actionlib_core.ros1.node import Ros1Node
from actionlib_core.ros1.plan import Wanted
from actionlib_core.ros1.rpc import RpcServer, call
from actionlib_core.shutdown import Shutdown, use_shutdown
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.transport.tokens import Endpoint, Kind, token_key

WAIT_S = 60.0
ANSWERS = {
    "nothing": b"",
    "no HTTP": b"hello\r\n\r\n",
    "no XML": b"HTTP/1.0 200 OK\r\nContent-Length: 3\r\n\r\n<x>",
    "no page": b"HTTP/1.0 404 Not Found\r\n\r\n",
    "no answer": b"HTTP/1.0 200 OK\r\n\r\n<methodResponse><params><param><value><int>1</int>"
    b"</value></param></params></methodResponse>",
    "packed": b"HTTP/1.0 200 OK\r\nContent-Encoding: gzip\r\n\r\n\x1f\x8b\x08",
    "many entities": b'HTTP/1.0 200 OK\r\n\r\n<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">'
    + b"".join(b'<!ENTITY a%d "%s">' % (n, b"&a%d;" % (n - 1) * 10) for n in range(1, 12))
    + b"]><methodResponse>&a11;</methodResponse>",
}


@pytest.fixture
def clock():
    return RealClock()


@pytest.fixture
def listen(clock):
    """`listen(handle)` returns the port of a server that handles each connection so."""
    opened = []

    def listen(handle):
        opened.append(TcpListener("127.0.0.1", clock, "test", handle))
        return opened[-1].port

    yield listen
    for listener in opened:
        listener.close(WAIT_S)


@pytest.mark.parametrize("answer", ANSWERS.values(), ids=ANSWERS.keys())
def test_what_is_no_answer_is_an_error(listen, answer):
    def handle(sock, _peer):
        sock.recv(10_000)
        sock.sendall(answer)

    uri = f"http://127.0.0.1:{listen(handle)}"
    with pytest.raises(Ros1Error) as error:
        call(uri, "getPid", "/me", timeout=WAIT_S)
    assert error.value.peer == uri


def test_nobody_and_somebody_who_is_silent_are_errors(listen, clock):
    over = clock.event()
    uri = f"http://127.0.0.1:{listen(lambda _sock, _peer: over.wait(WAIT_S))}"
    try:
        with pytest.raises(Ros1Error, match="no answer within"):
            call(uri, "getPid", "/me", timeout=0.2)
    finally:
        over.set()
    with pytest.raises(Ros1Error, match="cannot be reached"):
        call("http://127.0.0.1:1", "getPid", "/me")


def test_a_server_answers_errors_and_goes_on(clock):
    def fail(_caller):
        raise ValueError("not today")

    server = RpcServer("127.0.0.1", clock, {"fail": fail, "add": lambda _caller, a, b: a + b})
    uri = f"http://127.0.0.1:{server.port}"
    try:
        for method, arguments in (("fail", ()), ("add", ("x", 1)), ("add", ()), ("unknown", ())):
            with pytest.raises(Ros1Error):
                call(uri, method, "/me", *arguments)
        assert call(f"{uri}/RPC2", "add", "/me", 2, 3) == 5
    finally:
        server.close(WAIT_S)


@pytest.fixture
def pair(clock):
    """A connection, and the plain socket at its other end."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        theirs = socket.create_connection(server.getsockname())
        ours, _ = server.accept()
    with theirs, Connection(ours, "/peer", clock, Budget(1 << 30)) as connection:
        connection.limit(None)
        yield connection, theirs


def test_messages_for_one_who_does_not_read_are_dropped_and_counted(pair, monkeypatch):
    connection, theirs = pair
    monkeypatch.setattr(links, "BUFFER", 1 << 20)
    message = b"x" * (1 << 18)
    for _ in range(100):
        connection.put(message)
    assert 0 < connection.dropped < 100
    connection.put(b"last")
    theirs.settimeout(WAIT_S)
    with theirs.makefile("rb") as file:
        received = []
        while not received or received[-1] != b"last":
            received.append(file.read(int.from_bytes(file.read(4), "little")))
    assert len(received) == 101 - connection.dropped
    assert set(received[:-1]) == {message}


def test_connection_for_whose_rest_of_a_message_no_thread_can_be_started_ends(pair, monkeypatch):
    """The next message was read as the rest of the one before: wrong numbers at the robot."""
    connection, theirs = pair

    def fail(*_args, **_options):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(connection._clock, "spawn", fail)
    message = b"x" * (1 << 24)
    connection.put(message)
    connection.put(b"next")
    assert connection.read_frame() is None
    theirs.settimeout(WAIT_S)
    with theirs.makefile("rb") as file:
        received = file.read()
    assert 0 < len(received) < len(message)
    assert received == pack_frame(message)[: len(received)]


def test_waiting_until_all_has_been_taken_ends_with_the_connection(pair, clock):
    connection, theirs = pair
    theirs.sendall(b"\1\0\0\0x")
    assert connection.read_frame() == b"x"
    theirs.sendall(b"\5\0\0\0cut")
    connection.wait_idle(0.01)
    theirs.shutdown(socket.SHUT_WR)
    assert connection.read_frame() is None
    connection.close()
    connection.wait_idle(0.01)
    connection.put(b"to nobody")


def test_of_messages_that_come_together_the_last_is_read(pair, monkeypatch):
    connection, theirs = pair
    theirs.sendall(b"".join(pack_frame(b"%d" % number) for number in range(10)))
    assert connection.read_latest(0.01) == b"9"
    monkeypatch.setattr(links, "MAX_SKIPPED", 3)
    theirs.sendall(b"".join(pack_frame(b"%d" % number) for number in range(6)))
    assert [connection.read_latest(0.01) for _ in range(2)] == [b"3", b"5"]
    theirs.sendall(pack_frame(b"end"))
    theirs.shutdown(socket.SHUT_WR)
    assert connection.read_latest(0.01) == b"end"
    assert connection.read_latest(0.01) is None


def test_a_message_that_is_too_long_is_an_error(pair):
    connection, theirs = pair
    theirs.sendall(b"\xff\xff\xff\xff")
    with pytest.raises(Ros1Error):
        connection.read_frame()


def test_connections_beyond_the_limit_are_refused(listen, clock, monkeypatch):
    monkeypatch.setattr(links, "MAX_CONNECTIONS", 1)
    over = clock.event()
    port = listen(lambda _sock, _peer: over.wait(WAIT_S))
    with (
        socket.create_connection(("127.0.0.1", port), WAIT_S),
        socket.create_connection(("127.0.0.1", port), WAIT_S) as refused,
    ):
        assert refused.recv(1) == b""
        over.set()


def test_connection_for_which_no_thread_can_be_started_is_refused_alone(listen, clock, monkeypatch):
    """In a container with few threads left, one more caller made a bridge deaf for ever."""
    heard = clock.event()
    port = listen(lambda _sock, _peer: heard.set())
    spawn = clock.spawn

    def fail(*_args, **_options):
        monkeypatch.setattr(clock, "spawn", spawn)
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(clock, "spawn", fail)
    with socket.create_connection(("127.0.0.1", port), WAIT_S) as refused:
        assert refused.recv(1) == b""
    with socket.create_connection(("127.0.0.1", port), WAIT_S):
        assert heard.wait(WAIT_S)


@pytest.mark.parametrize("refused", ["fault", "code"])
def test_name_that_the_master_refuses_keeps_no_other_from_being_registered(
    clock, caplog, refused, monkeypatch
):
    taken = []

    def take(_caller, name, *_):
        if " " in name:
            raise ValueError(f"{name!r} is no name")
        taken.append(name)
        return []

    words = ("registerPublisher", "registerSubscriber", "registerService", "unregisterSubscriber")
    master = RpcServer("127.0.0.1", clock, dict.fromkeys(words, take))
    if refused == "code":
        dispatch = master._dispatch
        bad = [-1, "is no name", 0]
        monkeypatch.setattr(
            master, "_dispatch", lambda word, args: bad if " " in args[1] else dispatch(word, args)
        )
    node = Ros1Node("/bridge", f"http://127.0.0.1:{master.port}", clock=clock)
    made = [node.subscribe(name, lambda _header: None) for name in ("/a b", "/c")]
    for name in ("/d e", "/f"):
        made.append(
            node.advertise(name, "x/Y", "1" * 32, "", latching=False, accept=lambda _header: bool)
        )
        made.append(node.provide(name, "x/Y", "1" * 32, lambda *_: b""))
    left = SystemState(subscribers={"/g h": ["/bridge"], "/i": ["/bridge"]})
    try:
        for _ in range(2):
            node.register(left)
        assert sorted(set(taken)) == ["/c", "/f", "/i"]
        told = [record.getMessage() for record in caplog.records]
        assert len([text for text in told if "/a b" in text and "is no name" in text]) == 1
    finally:
        for each in made:
            each.close()
        node.close()
        master.close(WAIT_S)


def test_names_that_others_have_invented_are_not_bridged(clock):
    asked, come = [], threading.Event()

    def take(_caller, name, *_):
        asked.append(name)
        come.set()
        return []

    methods = dict.fromkeys(("registerPublisher", "registerSubscriber"), take)
    methods |= {"getSystemState": lambda _: [[], [], []], "getTopicTypes": lambda _: []}
    master = RpcServer("127.0.0.1", clock, methods)
    network = MemoryNetwork(clock)
    stranger, node = network.session(), Node("bridge", transport=network.session(), clock=clock)
    invented = ["a b", "x:y", "ü", "fine"]
    ends = [
        Endpoint(Kind.PUBLISHER, name, "a/B", "1" * 32, stranger.session_id, "odd")
        for name in invented
    ]
    tokens = [stranger.declare_alive(token_key(end)) for end in ends]
    with use_shutdown(Shutdown()):
        bridge = Ros1Bridge(node, f"http://127.0.0.1:{master.port}", Wanted(used=True))
    try:
        assert bridge.wait_for_master(WAIT_S)
        assert come.wait(WAIT_S)
        assert set(bridge.plan.topics) == set(asked) == {"/fine"}
    finally:
        for token in tokens:
            token.close()
        bridge.close()
        stranger.close()
        master.close(WAIT_S)


def test_master_that_does_not_answer_is_asked_once_for_all_names(clock, monkeypatch):
    node = Ros1Node("/bridge", "http://127.0.0.1:9", clock=clock)
    made = [node.subscribe(name, lambda _header: None) for name in ("/a", "/b")]
    asked = []
    monkeypatch.setattr(
        node_module, "call", lambda *args, **kw: asked.append(args) or call(*args, **kw)
    )
    try:
        with pytest.raises(Ros1Error, match="cannot be reached"):
            node.register(SystemState())
        assert len(asked) == 1
    finally:
        for each in made:
            each.close()
        node.close()


def test_one_call_with_many_publishers_starts_few_threads(clock, caplog):
    """Anybody who reaches the port may send it; each publisher has a thread."""
    node = Ros1Node("/bridge", "http://127.0.0.1:9", clock=clock)
    subscription = node.subscribe("/chatter", lambda _header: None)
    before = threading.active_count()
    try:
        uris = [f"http://127.0.0.1:1/{i}" for i in range(3_000)]
        call(node.uri, "publisherUpdate", "/x", "/chatter", uris)
        assert threading.active_count() <= before + 110
        assert "publishers: got 2900 more; expected at most 100" in caplog.text
    finally:
        subscription.close()
        node.close()


def test_publishers_of_all_topics_together_start_few_threads(clock, caplog, monkeypatch):
    monkeypatch.setattr(node_module, "MAX_LINKS", 50)
    node = Ros1Node("/bridge", "http://127.0.0.1:9", clock=clock)
    made = [node.subscribe(f"/t{n}", lambda _header: None) for n in range(10)]
    try:
        for number, subscription in enumerate(made):
            subscription.update([f"http://127.0.0.1:1/{number}/{i}" for i in range(20)])
        assert len(node._tasks) <= 50
        assert "links to publishers: got 50; expected fewer" in caplog.text
    finally:
        for subscription in made:
            subscription.close()
        node.close()


def test_publisher_for_which_no_thread_can_be_started_is_tried_with_the_next_list(
    clock, caplog, monkeypatch
):
    """It counted as connected, and was never heard."""
    node = Ros1Node("/bridge", "http://127.0.0.1:9", clock=clock)
    subscription = node.subscribe("/chatter", lambda _header: None)
    uri = "http://127.0.0.1:1/"
    spawn = node.spawn

    def fail(*_args):
        monkeypatch.setattr(node, "spawn", spawn)
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(node, "spawn", fail)
    try:
        subscription.update([uri])
        assert not subscription._links
        assert "can't start new thread" in caplog.text
        subscription.update([uri])
        assert list(subscription._links) == [uri]
    finally:
        subscription.close()
        node.close()


def test_a_subscriber_that_has_the_header_gets_every_message(clock, monkeypatch):
    """What was published before the bridge's thread ran again did not come."""
    published = threading.Event()
    send_header = Connection.send_header

    def send_and_wait(connection, fields):
        send_header(connection, fields)
        if "type" in fields and "latching" in fields:
            published.wait(WAIT_S)

    monkeypatch.setattr(Connection, "send_header", send_and_wait)
    node = Ros1Node("/bridge", "http://127.0.0.1:9", clock=clock)
    made = node.advertise(
        "/chatter", "std_msgs/String", "1" * 32, "", latching=False, accept=lambda _header: bool
    )
    port = node._data.port
    try:
        with Connection.open("127.0.0.1", port, "/bridge", clock, Budget(10**6)) as link:
            link.send_header({"callerid": "/ear", "topic": "/chatter", "type": "*", "md5sum": "*"})
            assert link.read_header()["type"] == "std_msgs/String"
            link.limit(WAIT_S)
            made.put(b"hello")
            published.set()
            assert link.read_frame() == b"hello"
    finally:
        made.close()
        node.close()


@pytest.mark.parametrize(
    "sent", [b"", b"POST / HTTP/1.1\r\n", b"POST / HTTP/1.1\r\nContent-Length"]
)
def test_call_that_does_not_end_is_given_up(clock, monkeypatch, sent):
    monkeypatch.setattr(rpc, "REQUEST_S", 0.2)
    server = RpcServer("127.0.0.1", clock, {})
    try:
        with socket.create_connection(("127.0.0.1", server.port), WAIT_S) as link:
            link.sendall(sent)
            link.settimeout(WAIT_S)
            while link.recv(1000):
                pass
    finally:
        server.close(WAIT_S)


def test_call_with_entities_is_refused(clock):
    server = RpcServer("127.0.0.1", clock, {"f": lambda: 1})
    body = b"<?xml version='1.0'?><!DOCTYPE a [<!ENTITY a 'f'>]><methodCall/>"
    try:
        with socket.create_connection(("127.0.0.1", server.port), WAIT_S) as link:
            head = f"POST / HTTP/1.1\r\nContent-Length: {len(body)}\r\n\r\n"
            link.sendall(head.encode() + body)
            link.settimeout(WAIT_S)
            assert b" 400 " in link.recv(1000)
    finally:
        server.close(WAIT_S)


def test_header_that_comes_byte_by_byte_has_no_more_time(pair, monkeypatch):
    connection, theirs = pair
    monkeypatch.setattr(links, "WHOLE_HEADER_S", 0.2)
    theirs.sendall((1000).to_bytes(4, "little"))
    with pytest.raises(Ros1Error, match="connection header: got none"):
        connection.read_header()


def test_message_for_which_the_node_has_no_room_is_refused(pair):
    connection, theirs = pair
    connection._budget = Budget(100)
    theirs.sendall(pack_frame(b"x" * 60) + pack_frame(b"y" * 200))
    assert connection.read_frame() == b"x" * 60
    with pytest.raises(Ros1Error, match="got 200 bytes; expected fewer beside 0 of others"):
        connection.read_frame()
