"""Services over the network in memory, and over zenoh."""

from __future__ import annotations

import itertools
import logging

import pytest

from actionlib_core.clock import RealClock
from actionlib_core.exceptions import (
    NodeError,
    ServiceBusyError,
    ServiceConflictError,
    ServiceException,
    ServiceLostError,
    ServiceTimeoutError,
    ServiceUnavailableError,
    TypeMismatchError,
    WaitTimeoutError,
)
from actionlib_core.interfaces import define_service
from actionlib_core.interfaces.std_srvs.srv import Empty, SetBool, SetBoolResponse, Trigger
from actionlib_core.node import Node
from actionlib_core.pubsub import service_proxy
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.service_proxy import ServiceProxy, patience_of, wait_for_service
from actionlib_core.transport.faulty import FaultyTransport
from actionlib_core.transport.memory import MemoryNetwork

NODES = ("server", "caller")

AddTwoInts = define_service("test_pkg/AddTwoInts", "int64 a\nint64 b\n---\nint64 sum\n")


@pytest.mark.parametrize(
    "result",
    [
        lambda q: AddTwoInts._response_class(q.a + q.b),
        lambda q: {"sum": q.a + q.b},
        lambda q: (q.a + q.b,),
        lambda q: [q.a + q.b],
        lambda q: q.a + q.b,
    ],
)
def test_call_returns_what_the_handler_returns(nodes, result):
    server, caller = nodes
    Service("add", AddTwoInts, result, node=server)
    add = ServiceProxy("add", AddTwoInts, node=caller)
    assert add(1, 2).sum == 3
    assert add(a=20, b=22).sum == 42
    assert add.call(AddTwoInts._request_class(a=5)).sum == 5


def test_empty_service_needs_no_result(nodes):
    server, caller = nodes
    calls = []
    Service("reset", Empty, calls.append, node=server)
    ServiceProxy("reset", Empty, node=caller)()
    assert len(calls) == 1


def test_handlers_error_reaches_the_caller_with_type_and_text(nodes, caplog):
    server, caller = nodes

    def handler(request):
        raise ValueError("the gripper is open")

    Service("grip", SetBool, handler, node=server)
    with pytest.raises(ServiceException) as caught:
        ServiceProxy("grip", SetBool, node=caller)(True)
    error = caught.value
    assert (error.name, error.remote_type, error.remote_text) == (
        "grip", "ValueError", "the gripper is open",
    )  # fmt: skip
    assert "service /grip: the handler raised ValueError: the gripper is open" in str(error)
    assert "the gripper is open" in caplog.text


def test_handler_that_returns_none_is_an_error(nodes, caplog):
    server, caller = nodes
    Service("grip", SetBool, lambda _: None, node=server)
    with pytest.raises(ServiceException, match="returned None; expected SetBoolResponse"):
        ServiceProxy("grip", SetBool, node=caller)(True)
    assert "returned None" in caplog.text


def test_call_without_server_says_so_after_a_moment(nodes, clock):
    with pytest.raises(ServiceUnavailableError, match="no server: got none in 2 s"):
        ServiceProxy("grip", SetBool, node=nodes[1])(True)
    assert clock.now() == pytest.approx(2.0)


def test_call_waits_for_a_server_that_appears(nodes, clock):
    server, caller = nodes
    clock.call_later(1.0, lambda: Service("grip", SetBool, lambda r: (r.data, "ok"), node=server))
    assert ServiceProxy("grip", SetBool, node=caller)(True) == SetBoolResponse(True, "ok")


def test_call_times_out(nodes, clock):
    server, caller = nodes
    Service("grip", SetBool, lambda _: clock.sleep(100), node=server)
    proxy = ServiceProxy("grip", SetBool, timeout=3, node=caller)
    with pytest.raises(ServiceTimeoutError, match="no answer: got none in 3 s"):
        proxy(True)
    assert clock.now() == pytest.approx(3.0)


def test_dead_server_ends_the_call_at_once(nodes, clock):
    server, caller = nodes
    Service("grip", SetBool, lambda _: clock.sleep(100), node=server)
    proxy = ServiceProxy("grip", SetBool, node=caller)
    clock.call_later(5.0, server.transport.kill)
    with pytest.raises(ServiceLostError, match="died or left"):
        proxy(True)
    assert clock.now() == pytest.approx(5.0)


def test_server_that_leaves_ends_the_call_at_once(nodes, clock):
    server, caller = nodes
    service = Service("grip", SetBool, lambda _: clock.sleep(100), node=server)
    proxy = ServiceProxy("grip", SetBool, node=caller)
    clock.call_later(5.0, service.shutdown)
    with pytest.raises(ServiceLostError):
        proxy(True)
    assert clock.now() == pytest.approx(5.0)


def test_call_to_a_successor_that_is_not_yet_known_is_answered(nodes, clock):
    """The caller saw the former server go, and took the call for lost, which the new one had."""
    server, caller = nodes
    former = Service("grip", SetBool, lambda _: (True, "former"), node=server)
    proxy = ServiceProxy("grip", SetBool, timeout=3, node=caller)
    assert proxy(True).message == "former"

    def successor(request):
        clock.sleep(1.0)
        return True, "successor"

    former.shutdown()
    Service("grip", SetBool, successor, node=server)
    assert proxy(True).message == "successor"


def test_without_limit_a_call_ends_with_the_server(nodes, clock):
    server, caller = nodes
    Service("grip", SetBool, lambda _: clock.sleep(1e6), node=server)
    proxy = ServiceProxy("grip", SetBool, timeout=None, node=caller)
    clock.call_later(1e5, server.transport.kill)
    with pytest.raises(ServiceLostError):
        proxy(True)
    assert clock.now() == pytest.approx(1e5)


@pytest.mark.parametrize(
    ("calls", "seconds"), [(1, 1e8), (1000, 1e5), (27_777, 3600.1), (10**9, 3600.0)]
)
def test_calls_without_a_limit_leave_a_bounded_trace_in_the_network(calls, seconds):
    assert patience_of(calls) == pytest.approx(seconds, rel=1e-4)


def test_the_millionth_call_without_a_limit_ends_after_an_hour(nodes, clock, monkeypatch):
    monkeypatch.setattr(service_proxy, "_unlimited", itertools.count(10**6))
    Service("stuck", SetBool, lambda _: clock.sleep(4000.0), node=nodes[0])
    proxy = ServiceProxy("stuck", SetBool, timeout=None, node=nodes[1])
    start = clock.now()
    with pytest.raises(ServiceTimeoutError, match="without a limit"):
        proxy(True)
    assert clock.now() - start == pytest.approx(3600.0, abs=10.0)


def test_slow_calls_do_not_hold_up_others(nodes, clock):
    server, caller = nodes

    def handler(request):
        clock.sleep(10 if request.data else 0)
        return True, "done"

    Service("grip", SetBool, handler, node=server)
    ends = []
    for slow in (True, False, True):

        def call(slow=slow):
            ServiceProxy("grip", SetBool, node=caller)(slow)
            ends.append((slow, round(clock.now(), 3)))

        clock.spawn(call, name=f"caller {slow}")
    clock.sleep(20)
    assert sorted(ends) == [(False, 0.0), (True, 10.0), (True, 10.0)]


def test_handler_may_call_a_service_of_its_own_node(nodes):
    server, caller = nodes
    inner = ServiceProxy("inner", Trigger, node=server)
    Service("inner", Trigger, lambda _: (True, "inner"), node=server)
    Service("outer", Trigger, lambda _: inner(), node=server)
    assert ServiceProxy("outer", Trigger, node=caller)().message == "inner"


def test_wrong_type_is_told_on_both_sides(nodes, clock, caplog):
    server, caller = nodes
    with caplog.at_level(logging.ERROR, "actionlib_core"):
        service = Service("grip", SetBool, lambda _: (True, ""), node=server)
        proxy = ServiceProxy("grip", Trigger, node=caller)
        with pytest.raises(TypeMismatchError) as caught:
            proxy()
    for text in ("std_srvs/SetBool", "std_srvs/Trigger", SetBool._md5sum, Trigger._md5sum):
        assert text in str(caught.value)
    assert len(proxy.mismatches) == 1
    # A caller has no token; the server hears of it from the call itself.
    replies = []
    caller.transport.query(
        "grip", b"", encoding="ros1/std_srvs/Trigger;md5=1", timeout=5,
        on_reply=replies.append, on_done=lambda: None,
    )  # fmt: skip
    clock.sleep(1)
    assert replies[0].error
    (error,) = service.mismatches
    assert (error.expected_type, error.found_type) == ("std_srvs/SetBool", "std_srvs/Trigger")


def test_second_server_on_a_name_is_refused_and_names_both(nodes):
    server, caller = nodes
    calls = []
    Service("who", Trigger, lambda _: (calls.append("first") or True, "first"), node=server)
    for other in (server, caller):
        with pytest.raises(ServiceConflictError, match="service /who: two servers") as caught:
            Service("who", Trigger, lambda _: (calls.append("second") or True, ""), node=other)
        assert caught.value.mine == (other.full_name, other.transport.session_id)
        assert caught.value.other == ("server", server.transport.session_id)
    assert ServiceProxy("who", Trigger, node=caller)().message == "first"
    assert calls == ["first"]


def test_server_of_another_type_on_a_name_is_refused_too(nodes):
    server, caller = nodes
    Service("grip", SetBool, lambda _: (True, "first"), node=server)
    with pytest.raises(ServiceConflictError):
        Service("grip", Trigger, lambda _: (True, "second"), node=caller)
    assert ServiceProxy("grip", SetBool, node=caller)(True).message == "first"


def test_name_can_be_taken_again_once_its_server_has_left(nodes):
    server, caller = nodes
    for name in ("first", "second"):
        with Service("who", Trigger, lambda _, name=name: (True, name), node=server):
            assert ServiceProxy("who", Trigger, node=caller)().message == name


@pytest.fixture
def strangers(clock, network):
    """Two nodes of which neither hears of the other before a second has passed."""
    made = []
    for name in ("older", "younger"):
        link = FaultyTransport(network.session(), clock=clock, lease=0.0)
        made.append(Node(name, transport=link, clock=clock))
        link.cut(1.0)
        clock.sleep(0.1)
    yield made
    for node in made:
        node.close()
        node.transport.close()


def test_younger_of_two_servers_that_meet_late_stops_and_the_older_goes_on(
    strangers, nodes, clock, caplog
):
    older, younger = strangers
    Service("who", Trigger, lambda _: (True, "older"), node=older)
    clock.sleep(0.2)
    service = Service("who", Trigger, lambda _: (True, "younger"), node=younger)
    with pytest.raises(ServiceConflictError) as caught:
        service.spin()
    assert clock.now() < 2.0
    assert service.error is caught.value
    assert (caught.value.mine[0], caught.value.other[0]) == ("younger", "older")
    assert caplog.text.count("service /who: two servers") == 2  # each side says it, once
    assert ServiceProxy("who", Trigger, node=nodes[1])().message == "older"


def test_servers_that_share_a_name_answer_once(nodes, network, clock, caplog):
    server, caller = nodes
    third = Node("second", transport=network.session(), clock=clock)
    for node in (server, third):
        Service("who", Trigger, lambda _, n=node: (True, n.name), node=node, alone=False)
    clock.sleep(1.0)
    assert ServiceProxy("who", Trigger, node=caller)().message in {"server", "second"}
    assert "two servers" not in caplog.text


def test_spin_ends_with_the_service(nodes, clock):
    service = Service("who", Trigger, lambda _: (True, ""), node=nodes[0])
    clock.call_later(5.0, service.close)
    service.spin()
    assert clock.now() == pytest.approx(5.0)


# -- a handler that calls its own service --------------------------------------------------------


def test_handler_may_call_its_own_service(nodes):
    server, caller = nodes
    add = ServiceProxy("sum", AddTwoInts, node=server)

    def handler(request):
        return request.a + (add(request.a - 1, 0).sum if request.a else 0)

    Service("sum", AddTwoInts, handler, node=server)
    assert ServiceProxy("sum", AddTwoInts, node=caller)(20, 0).sum == 210


@pytest.mark.parametrize("names", [["a"], ["a", "b"]])
def test_handlers_that_call_each_other_for_ever_end_in_an_error(nodes, caplog, monkeypatch, names):
    monkeypatch.setattr("actionlib_core.pubsub.service.CALLS_AT_ONCE", 20)
    server, caller = nodes
    runs = []
    for name, other in zip(names, names[1:] + names[:1], strict=True):
        proxy = ServiceProxy(other, Trigger, node=server)
        Service(name, Trigger, lambda _, p=proxy: runs.append(1) or p(), node=server)
    with pytest.raises(ServiceBusyError) as caught:
        ServiceProxy("a", Trigger, node=caller)()
    assert str(caught.value) == (
        "service /a: 20 calls are running; expected fewer. Try checking whether the handler calls "
        "its own service, directly or through another, or a handler that returns sooner."
    )
    assert len(runs) == 20 * len(names)
    assert caplog.text.count("calls are running") == len(names)
    # The service has not suffered.
    with pytest.raises(ServiceBusyError):
        ServiceProxy("a", Trigger, node=caller)()


@pytest.fixture
def busy(nodes, clock, monkeypatch):
    """The service `b` runs all the calls it takes, for 100 s."""
    monkeypatch.setattr("actionlib_core.pubsub.service.CALLS_AT_ONCE", 1)
    server, caller = nodes

    def handler(_):
        clock.sleep(100.0)
        return True, ""

    Service("b", Trigger, handler, node=server)
    clock.spawn(lambda: ServiceProxy("b", Trigger, timeout=None, node=caller)(), name="first")
    clock.sleep(1.0)


def test_the_caller_of_a_handler_that_calls_a_busy_service_is_told_which_one(nodes, busy, caplog):
    server, caller = nodes
    for name, other in (("a", "b"), ("outer", "a")):
        proxy = ServiceProxy(other, Trigger, node=server)
        Service(name, Trigger, lambda _, p=proxy: p(), node=server)
    for name in ("a", "outer"):
        with pytest.raises(ServiceException) as caught:
            ServiceProxy(name, Trigger, node=caller)()
        error = caught.value
        assert not isinstance(error, ServiceBusyError)
        assert (error.name, error.remote_type) == (name, "ServiceBusyError")
        assert error.remote_text.startswith("service /b: 1 calls are running")
        assert f"service /{name}: the handler raised ServiceBusyError: service /b" in str(error)
        assert str(error) in caplog.messages


def test_refused_calls_are_logged_once_in_a_while(nodes, clock, busy, caplog):
    proxy = ServiceProxy("b", Trigger, node=nodes[1])
    for logged in (1, 1, 2, 2):
        if len(caplog.messages) < logged:
            clock.sleep(10.0)
        with pytest.raises(ServiceBusyError, match="service /b: 1 calls are running"):
            proxy()
        assert caplog.text.count("calls are running") == logged


def test_a_call_that_no_thread_is_left_for_is_answered(nodes, clock, caplog, monkeypatch):
    server, caller = nodes
    add = ServiceProxy("add", AddTwoInts, node=caller)
    Service("add", AddTwoInts, lambda q: q.a + q.b, node=server)
    assert add(1, 2).sum == 3
    spawn = clock.spawn

    def no_thread(target, *, name):
        if name == "service /add":
            raise RuntimeError("can't start new thread")
        return spawn(target, name=name)

    monkeypatch.setattr(clock, "spawn", no_thread)
    with pytest.raises(ServiceBusyError, match="service /add: no thread is left: can't start new"):
        add(1, 2)
    monkeypatch.undo()
    assert add(1, 2).sum == 3


def test_answer_of_a_foreign_server_with_a_plain_error(nodes, clock):
    server, caller = nodes
    Service("grip", SetBool, print, node=server).close()
    server.announce(ServiceProxy("grip", SetBool, node=server)._end.own.kind, "grip", "std_srvs/SetBool",
                    SetBool._md5sum)  # fmt: skip
    server.transport.queryable("grip", lambda q: (q.reply_error("plain words"), q.finish()))
    with pytest.raises(ServiceException, match="plain words") as caught:
        ServiceProxy("grip", SetBool, node=caller)(True)
    assert caught.value.remote_text == "plain words"


def test_wait_for_service(nodes, clock):
    server, caller = nodes
    with pytest.raises(WaitTimeoutError, match="no server: got none in 1 s"):
        wait_for_service("grip", 1, node=caller)
    clock.call_later(3.0, lambda: Service("grip", SetBool, print, node=server))
    wait_for_service("grip", node=caller)
    assert clock.now() == pytest.approx(4.0)
    proxy = ServiceProxy("grip", SetBool, node=caller)
    proxy.wait_for_service(1)
    other = ServiceProxy("grip", Trigger, node=caller)
    with pytest.raises(TypeMismatchError):
        other.wait_for_service(1)


def test_closed_node_ends_the_call(nodes, clock):
    server, caller = nodes
    Service("grip", SetBool, lambda _: clock.sleep(100), node=server)
    proxy = ServiceProxy("grip", SetBool, node=caller)
    clock.call_later(5.0, caller.close)
    with pytest.raises(NodeError):
        proxy(True)
    assert clock.now() == pytest.approx(5.0)


def test_proxies_of_one_service_share_what_lasts(nodes, network):
    server, caller = nodes
    Service("who", Trigger, lambda _: (True, ""), node=server)
    ServiceProxy("who", Trigger, node=caller)()
    before = len(network.watchers)
    for _ in range(20):
        ServiceProxy("who", Trigger, node=caller)()
    assert len(network.watchers) == before


def test_closed_proxy_does_not_call(nodes):
    server, caller = nodes
    calls = []
    Service("reset", Empty, calls.append, node=server)
    with ServiceProxy("reset", Empty, node=caller) as proxy:
        proxy()
    with pytest.raises(NodeError, match="closed"):
        proxy()
    assert len(calls) == 1


@pytest.mark.zenoh
def test_services_over_zenoh():
    def handler(request):
        if request.a < 0:
            raise ValueError("negative")
        return request.a + request.b

    with Node("server") as server, Node("caller") as caller:
        Service("add", AddTwoInts, handler, node=server)
        add = ServiceProxy("add", AddTwoInts, node=caller)
        assert [add(n, 1).sum for n in range(20)] == list(range(1, 21))
        with pytest.raises(ServiceException, match="ValueError: negative"):
            add(-1, 0)
        local = ServiceProxy("add", AddTwoInts, node=server)
        assert local(2, 2).sum == 4


@pytest.mark.zenoh
def test_server_that_leaves_ends_a_call_over_zenoh():
    clock = RealClock()
    release = clock.event()
    with Node("server") as server, Node("caller") as caller:
        started = clock.event()

        def handler(request):
            started.set()
            release.wait(60)
            return True, ""

        Service("grip", SetBool, handler, node=server)
        proxy = ServiceProxy("grip", SetBool, timeout=3600, node=caller)
        proxy.wait_for_service(60)

        def leave():
            started.wait(60)
            server.close()

        task = clock.spawn(leave, name="leave")
        with pytest.raises(ServiceLostError):
            proxy(True)
        release.set()
        assert task.join(60)


@pytest.mark.parametrize("there", [True, False])
def test_closing_a_proxy_ends_its_call_at_once(clock, there):
    network = MemoryNetwork(clock)
    with Node("robot", transport=network.session(), clock=clock) as robot:
        if there:
            Service("slow", SetBool, lambda request: clock.sleep(50.0) or {}, node=robot)
        with Node("desk", transport=network.session(), clock=clock) as desk:
            proxy = ServiceProxy("slow", SetBool, timeout=None, node=desk)
            clock.call_later(3.0, proxy.close)
            with pytest.raises(NodeError, match=r"the proxy (is|was) closed"):
                proxy.wait_for_service() if not there else proxy.call(True)
            assert clock.now() == 3.0
            clock.sleep(100.0)
