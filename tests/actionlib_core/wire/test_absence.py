"""A name that nobody has: each wait for it tells after some seconds what it waits for."""

from __future__ import annotations

import logging
import subprocess
import sys

import pytest

from actionlib_core import (
    ActionClient,
    ActionServer,
    Publisher,
    Service,
    ServiceProxy,
    SimpleActionServer,
    Subscriber,
    wait_for_message,
    wait_for_service,
)
from actionlib_core.config import Config
from actionlib_core.exceptions import (
    ServiceUnavailableError,
    TransportError,
    TypeMismatchError,
    WaitTimeoutError,
)
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import SetBool, Trigger
from actionlib_core.node import use_node
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.absence import ABSENT_S, SHOWN, describe_network, names_there
from smachpy import MonitorState, StateMachine
from smachpy.states import AwaitMessage
from tests.two_nodes import TwoNodes

LOOKED = "looked at the program's network: "


@pytest.fixture
def world():
    with TwoNodes() as world:
        yield world


def told(caplog):
    return [record.getMessage() for record in caplog.records if "looked at" in record.getMessage()]


def serve(world):
    return ActionServer("lift", msg.TestAction, node=world.robot)


# -- actions -----------------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["wait_for_server", "send_goal", "attach"])
def test_missing_action_server_is_told_once_with_what_is_there(world, caplog, how):
    """Waiting for a misspelt name was silent for ever."""
    serve(world)
    client = ActionClient("lfit", msg.TestAction, node=world.mission)
    if how == "wait_for_server":
        for _ in range(2):
            assert not client.wait_for_server(10.0)
    else:
        for number in range(3):
            client.send_goal(msg.TestGoal()) if how == "send_goal" else client.attach(f"g{number}")
        world.clock.sleep(ABSENT_S - 0.1)
        assert told(caplog) == []
        world.clock.sleep(100.0)
    assert told(caplog) == [
        f"action 'lfit': no server after 3 s: {LOOKED}actions: /lift. Did you mean '/lift'?"
    ]
    assert [record.levelno for record in caplog.records] == [logging.WARNING]


def test_missing_server_is_told_again_after_one_was_there(world, caplog):
    client = ActionClient("lift", msg.TestAction, node=world.mission)
    for _ in range(2):
        handle = client.send(msg.TestGoal())
        world.clock.sleep(10.0)
        assert not handle.over
        server = serve(world)
        world.clock.sleep(1.0)
        server.stop()
        world.clock.sleep(1.0)
    assert len(told(caplog)) == 2


@pytest.mark.parametrize("wait", [0.5, ABSENT_S, ABSENT_S + 0.9])
def test_wait_for_server_lasts_as_long_as_it_may(world, caplog, wait):
    client = ActionClient("lift", msg.TestAction, node=world.mission)
    begun = world.clock.now()
    assert not client.wait_for_server(wait)
    assert world.clock.now() - begun == pytest.approx(wait)
    assert told(caplog) == []


def test_explanation_that_takes_its_time_delays_no_timeout(world, monkeypatch):
    client = ActionClient("lift", msg.TestAction, node=world.mission)
    monkeypatch.setattr(client.manager.port, "explain_absence", lambda: world.clock.sleep(1.0))
    for wait in (3.5, 4.5):
        begun = world.clock.now()
        assert not client.wait_for_server(wait)
        assert world.clock.now() - begun == pytest.approx(wait)


def test_server_that_is_there_in_time_is_not_told(world, caplog):
    client = ActionClient("lift", msg.TestAction, node=world.mission)
    client.send_goal(msg.TestGoal())
    world.clock.sleep(ABSENT_S - 0.5)
    serve(world)
    world.clock.sleep(20.0)
    assert told(caplog) == []


@pytest.mark.parametrize("end", ["cancel", "stop", "session"])
def test_goal_that_no_longer_waits_is_not_told(world, caplog, end):
    client = ActionClient("lift", msg.TestAction, node=world.mission)
    handle = client.send_goal(msg.TestGoal())
    world.clock.sleep(1.0)
    {"cancel": handle.cancel, "stop": client.stop, "session": world.mission.transport.close}[end]()
    world.clock.sleep(20.0)
    assert told(caplog) == []


# -- services and topics -----------------------------------------------------------------------


def test_missing_service_is_told_and_named_in_the_errors(world, caplog):
    Service("door/open", Trigger, lambda _: (True, ""), node=world.robot)
    proxy = ServiceProxy("dor/open", Trigger, node=world.mission)
    there = f"{LOOKED}services: /door/open. Did you mean '/door/open'?"
    with pytest.raises(WaitTimeoutError) as caught:
        proxy.wait_for_service(5.0)
    assert there.capitalize()[:10] in str(caught.value)
    assert there[1:] in str(caught.value)
    assert told(caplog) == [f"service 'dor/open': no server after 3 s: {there}"]
    with pytest.raises(ServiceUnavailableError, match="Did you mean '/door/open'"):
        proxy()
    with pytest.raises(WaitTimeoutError, match="Did you mean '/door/open'"):
        wait_for_service("dor/open", 1.0, node=world.mission)
    caplog.clear()
    world.clock.call_later(10.0, world.mission.close)
    with pytest.raises(Exception, match="closed"):
        wait_for_service("dor/open", node=world.mission)
    assert len(told(caplog)) == 1


def test_service_of_another_type_is_a_mismatch_and_not_absent(world, caplog):
    Service("door/open", SetBool, lambda _: (True, ""), node=world.robot)
    with pytest.raises(TypeMismatchError):
        ServiceProxy("door/open", Trigger, node=world.mission).wait_for_service(5.0)
    assert told(caplog) == []


def test_missing_publisher_is_told_by_waits_only(world, caplog):
    scan = Publisher("scan", String, node=world.robot)
    Subscriber("sacn", String, lambda _: None, node=world.mission)
    world.clock.sleep(10.0)
    assert told(caplog) == []
    with pytest.raises(WaitTimeoutError):
        wait_for_message("sacn", String, 5.0, node=world.mission)
    expected = f"topic 'sacn': no publisher after 3 s: {LOOKED}topics: /scan. Did you mean '/scan'?"
    assert told(caplog) == [expected]
    caplog.clear()
    with pytest.raises(WaitTimeoutError):  # it is there, but says nothing
        wait_for_message("scan", String, 5.0, node=world.mission)
    assert told(caplog) == []
    scan.unregister()


def test_missing_subscriber_is_told_as_one_and_not_as_a_server(world, caplog):
    """The log told of a service without a server."""
    Service("scan/off", Trigger, lambda _: (True, ""), node=world.robot)
    Subscriber("scan", String, lambda _: None, node=world.robot)
    publisher = Publisher("sacn", String, node=world.mission)
    assert not publisher.wait_for_connections(1, 5.0)
    expected = (
        f"topic 'sacn': no subscriber after 3 s: {LOOKED}topics: /scan. Did you mean '/scan'?"
    )
    assert told(caplog) == [expected]


@pytest.mark.parametrize(
    "state",
    [
        lambda: MonitorState("sacn", String, lambda *_: True, timeout=5.0),
        lambda: AwaitMessage("sacn", String, lambda _: True, timeout=5.0),
    ],
    ids=["MonitorState", "AwaitMessage"],
)
def test_states_that_wait_for_a_topic_tell_that_nobody_publishes(world, caplog, state):
    machine = StateMachine(["end", "preempted"], name="M")
    with use_node(world.mission):
        made = state()
        outcomes = made.get_registered_outcomes()
        machine.add("WAIT", made, {o: "end" for o in outcomes if o != "preempted"})
        assert machine.execute() == "end"
    assert [text.partition(":")[0] for text in told(caplog)] == ["topic 'sacn'"]


# -- the texts ---------------------------------------------------------------------------------


def test_names_are_shown_the_most_similar_first_and_not_all():
    names = {f"robot_{number}/arm" for number in range(100)} | {"lift"}
    text = names_there("lfit", names, Kind.ACTION_SERVER)
    assert text.startswith("actions: /lift, ")
    assert text.count("/robot") == SHOWN - 1
    assert f" and {101 - SHOWN} more." in text
    assert "Did you mean" not in names_there("x", {"robot/arm"}, Kind.PUBLISHER)
    assert names_there("lift", {"lift"}, Kind.ACTION_SERVER) == "it is just starting."
    for kind in (Kind.ACTION_SERVER, Kind.SERVICE, Kind.PUBLISHER, Kind.SUBSCRIBER):
        assert "in the same domain" in names_there("lift", set(), kind)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "this computer, domain 0"),
        ({"domain": 7}, "this computer, domain 7"),
        ({"discovery": "eth0", "domain": 7}, "interface 'eth0', domain 7"),
        ({"mode": "client", "connect": ("tcp/a:1", "tcp/b:2")}, "router tcp/a:1, tcp/b:2"),
        ({"connect": ("tcp/a:1",)}, "this computer, domain 0, with links to tcp/a:1"),
        (
            {"discovery": "off", "connect": ("tcp/a:1",)},
            "a network without discovery with links to tcp/a:1",
        ),
        ({"discovery": "off"}, "a network without discovery and without links"),
    ],
)
def test_network_is_described_as_people_know_it(options, text):
    assert describe_network(Config(**options)) == text


# -- programs that end at once -----------------------------------------------------------------

OFFER = """
import actionlib_core
from actionlib_core.interfaces.actionlib.msg import TestAction
from actionlib_core.interfaces.std_srvs.srv import Trigger
server = actionlib_core.SimpleActionServer("fib", TestAction, lambda goal: None)
service = actionlib_core.Service("open", Trigger, lambda _: (True, ""))
"""


@pytest.mark.zenoh
@pytest.mark.parametrize(
    ("more", "warns"),
    [
        ("", True),
        ("server.wait(0.0)\nservice.close()", False),
        ("server.stop()\nservice.close()", False),
        ("server.wait(0.0)\nactionlib_core.ServiceProxy('open', Trigger)()", False),
        ("raise SystemError('a mistake')", False),
    ],
    ids=["nothing", "waits", "stops", "used", "error"],
)
def test_program_that_ends_before_anybody_can_use_it_says_so(more, warns):
    """A script without rospy.spin() ended with 0 and no word, and its server with it."""
    process = subprocess.run(
        [sys.executable, "-c", OFFER + more], capture_output=True, text=True, check=False
    )
    assert ("the program ends at once" in process.stderr) is warns
    if warns:
        assert "action server '/fib' and service '/open'" in process.stderr
        assert process.returncode == 0


def test_callback_that_uses_its_server_before_it_is_made_gets_a_hint(world, caplog, monkeypatch):
    start = ActionServer.start

    def slow_start(server):
        start(server)
        world.clock.sleep(1.0)  # as on a busy computer: goals come meanwhile

    monkeypatch.setattr(ActionServer, "start", slow_start)
    client = ActionClient("lift", msg.TestAction, node=world.mission)
    handle = client.send(msg.TestGoal())
    made = []

    def execute(_goal):
        made[0].set_succeeded()

    server = SimpleActionServer("lift", msg.TestAction, execute, node=world.robot)
    assert handle.wait(5.0)
    assert handle.status is Status.ABORTED
    assert "list index out of range (The goal came before the constructor" in handle.text
    assert "auto_start=False" in caplog.text
    late = client.send(msg.TestGoal())
    assert late.wait(5.0)
    assert late.text.endswith("list index out of range")
    made.append(server)
    assert client.send(msg.TestGoal()).wait(5.0)


def test_absence_on_a_closed_session_is_an_error_of_the_session(world):
    client = ActionClient("lift", msg.TestAction, node=world.mission)
    world.mission.transport.close()
    with pytest.raises(TransportError):
        client.manager.port.explain_absence()
