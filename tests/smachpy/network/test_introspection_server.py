"""A machine watched and prepared over the network."""

from __future__ import annotations

import json
from dataclasses import dataclass

import pytest

from actionlib_core.interfaces.geometry_msgs.msg import Point
from actionlib_core.interfaces.smach_msgs.msg import (
    SmachContainerInitialStatusCmd,
    SmachContainerStatus,
    SmachContainerStructure,
)
from actionlib_core.interfaces.std_msgs.msg import Int32, String
from actionlib_core.node import Node
from actionlib_core.pubsub.topic import Publisher, Subscriber
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.presence import list_endpoints
from smachpy import (
    CBState,
    Concurrence,
    InvalidStateError,
    SmachError,
    State,
    StateMachine,
    UserData,
    describe,
    events,
)
from smachpy.events.introspection import (
    INIT_TOPIC,
    STATUS_TOPIC,
    STRUCTURE_TOPIC,
    ContainerProxy,
    IntrospectionClient,
    IntrospectionServer,
)
from smachpy.network.server import DESCRIPTION_TOPIC, EVENTS_TOPIC
from smachpy.userdata.json_text import loads
from tests.two_nodes import TwoNodes


class Wait(State):
    def __init__(self, seconds=1.0):
        super().__init__(["done"], output_keys=["count"])
        self.seconds = seconds

    def execute(self, ud):
        ud.count = self.seconds
        self.sleep(self.seconds)
        return "done"


@dataclass
class Trip:
    goal: str = ""
    speed: float = 0.5


class World(TwoNodes):
    def serve(self, machine, **kwargs):
        server = IntrospectionServer("robot", machine, "/SM_ROOT", node=self.robot, **kwargs)
        server.start()
        return server

    def listen(self, topic, message_class):
        found = []
        Subscriber("robot" + topic, message_class, found.append, node=self.mission)
        return found

    def remotely(self, function):
        """Run `function` in another thread."""
        results = []
        task = self.clock.spawn(lambda: results.append(function()), name="operator")
        assert task.join(60.0)
        return results[0]


@pytest.fixture
def world():
    with World() as world:
        yield world


def make_machine():
    machine = StateMachine(["finished"])
    with machine:
        machine.add("FIRST", Wait(), {"done": "BOTH"})
        both = Concurrence(["fine"], "fine")
        machine.add("BOTH", both, {"fine": "LAST"})
        with both:
            both.add("LEFT", Wait(2.0))
            both.add("RIGHT", Wait(3.0))
        machine.add("LAST", Wait(), {"done": "finished"})
    return machine


def test_the_names_of_smach_hold():
    assert STATUS_TOPIC == "/smach/container_status"
    assert INIT_TOPIC == "/smach/container_init"
    assert STRUCTURE_TOPIC == "/smach/container_structure"


def test_structure_reaches_those_who_come_later(world):
    world.serve(make_machine())
    world.clock.sleep(10.0)
    found = world.listen(STRUCTURE_TOPIC, SmachContainerStructure)
    world.clock.sleep(0.1)
    by_path = {message.path: message for message in found}
    assert sorted(by_path) == ["/SM_ROOT", "/SM_ROOT/BOTH"]
    root = by_path["/SM_ROOT"]
    assert root.children == ["FIRST", "BOTH", "LAST"]
    assert root.container_outcomes == ["finished"]
    edges = list(zip(root.internal_outcomes, root.outcomes_from, root.outcomes_to, strict=True))
    assert edges == [
        ("done", "FIRST", "BOTH"),
        ("fine", "BOTH", "LAST"),
        ("done", "LAST", "finished"),
    ]
    assert root.header.stamp.to_sec() == 1e9


def active(found, path):
    """The active states of `path` one after another, repetitions left out."""
    states = [sorted(message.active_states) for message in found if message.path == path]
    return [s for i, s in enumerate(states) if i == 0 or s != states[i - 1]]


def test_status_shows_messages_that_a_nested_machine_may_only_read(world):
    machine, nested = StateMachine(["done"]), StateMachine(["done"], input_keys=["goal"])
    machine.add("NESTED", nested)
    nested.add("WAIT", Wait())
    machine.userdata.goal = Point(x=7.0)
    world.serve(machine)
    found = world.listen(STATUS_TOPIC, SmachContainerStatus)
    machine.execute()
    world.clock.sleep(0.1)
    shown = [m.local_data for m in found if m.path == "/SM_ROOT/NESTED" and m.active_states]
    assert any(loads(text).get("goal") == Point(x=7.0) for text in shown)


def test_status_tells_what_is_active_and_the_userdata(world):
    machine = make_machine()
    world.serve(machine)
    found = world.listen(STATUS_TOPIC, SmachContainerStatus)
    world.clock.sleep(0.1)
    assert {(m.path, m.info) for m in found} == {
        ("/SM_ROOT", "Initial state"),
        ("/SM_ROOT/BOTH", "Initial state"),
    }
    machine.execute()
    world.clock.sleep(0.1)
    assert active(found, "/SM_ROOT") == [["None"], ["FIRST"], ["BOTH"], ["LAST"], ["None"]]
    assert active(found, "/SM_ROOT/BOTH") == [[], ["LEFT", "RIGHT"], ["RIGHT"], []]
    last = [message for message in found if message.path == "/SM_ROOT"][-1]
    assert json.loads(last.local_data) == {"count": 1.0}
    assert last.initial_states == ["FIRST"]


def test_nothing_is_sent_while_nothing_changes(world):
    world.serve(make_machine())
    found = [
        *([world.listen(STATUS_TOPIC, SmachContainerStatus)]),
        world.listen(STRUCTURE_TOPIC, SmachContainerStructure),
    ]
    world.clock.sleep(0.1)
    before = [len(messages) for messages in found]
    world.clock.sleep(3600.0)
    assert [len(messages) for messages in found] == before


def test_a_fast_machine_is_shown_at_a_bounded_rate(world):
    machine = StateMachine(["finished"])
    with machine:
        machine.add("A", Wait(0.001), {"done": "B"})
        machine.add("B", Wait(0.001), {"done": "A"})
    world.serve(machine)
    found = world.listen(STATUS_TOPIC, SmachContainerStatus)
    world.clock.call_later(10.0, machine.request_preempt)
    machine.execute()
    assert 2 < len(found) <= 202  # every 0.05 s


def test_structure_that_changes_is_sent_again(world):
    machine = make_machine()
    world.serve(machine)
    found = world.listen(STRUCTURE_TOPIC, SmachContainerStructure)
    descriptions = world.listen(DESCRIPTION_TOPIC, String)
    world.clock.sleep(0.1)
    with machine.opened(check=False):
        machine.add("MORE", Wait(), {"done": "FIRST"})
    machine.execute()
    world.clock.sleep(0.1)
    roots = [message for message in found if message.path == "/SM_ROOT"]
    assert [len(message.children) for message in roots] == [3, 4]
    assert len(descriptions) == 2


def test_events_can_be_followed_from_elsewhere(world):
    machine = make_machine()
    world.serve(machine)
    client = IntrospectionClient(node=world.mission)
    found, here = [], []
    machine.subscribe(here.append)
    end = client.subscribe("robot", lambda event, seq: found.append((seq, event)))
    world.clock.sleep(0.1)
    machine.execute()
    world.clock.sleep(0.1)
    assert [event for _, event in found] == here
    assert [seq for seq, _ in found] == list(range(1, len(here) + 1))
    assert isinstance(found[0][1], events.Started)
    end()
    machine.execute()
    assert len(found) * 2 == len(here)


def test_events_have_the_path_that_the_server_gives(world):
    machine = make_machine()
    server = IntrospectionServer("robot", machine, "/OFFICE", node=world.robot)
    server.start()
    found = []
    client = IntrospectionClient(node=world.mission)
    client.subscribe("robot", lambda event, seq: found.append(event.path))
    world.clock.sleep(0.1)
    machine.execute()
    world.clock.sleep(0.1)
    assert found[0] == found[-1] == "/OFFICE"
    assert {path.split("/")[1] for path in found} == {"OFFICE"}
    record = world.remotely(lambda: client.get_description("robot"))
    assert {r.path for r in record.walk()} >= set(found)


def test_the_description_is_that_of_describe(world):
    machine = make_machine()
    world.serve(machine)
    client = IntrospectionClient(node=world.mission)
    assert world.remotely(lambda: client.get_description("robot")) == describe(machine)
    with pytest.raises(
        SmachError, match=r"got no answer in 2 s; servers that are there: \['/robot'\]"
    ):
        client.get_description("robt", timeout=2.0)


def test_servers_are_found(world):
    client = IntrospectionClient(node=world.mission)
    assert client.get_servers() == []
    server = world.serve(make_machine())
    assert client.get_servers() == ["/robot"]
    server.stop()
    assert client.get_servers() == []
    assert list_endpoints(world.mission.transport) == []


@pytest.mark.parametrize("name", ["robot", "/robot"])
def test_the_initial_state_is_set_for_the_next_run(world, name):
    machine = make_machine()
    world.serve(machine)
    client = IntrospectionClient(node=world.mission)
    userdata = UserData()
    userdata.count = (1, b"two")
    assert client.set_initial_state(name, "/SM_ROOT", ["LAST"], userdata, timeout=3.0) is True
    assert machine.get_initial_states() == ["LAST"]
    assert machine.userdata.count == (1, b"two")
    entered = []
    machine.subscribe(lambda e: entered.append(e.path) if isinstance(e, events.Entered) else None)
    machine.execute()
    assert entered == ["/SM_ROOT/LAST"]


def test_a_state_that_is_not_there_is_refused(world, caplog):
    world.serve(make_machine())
    client = IntrospectionClient(node=world.mission)
    start = world.clock.now()
    assert client.set_initial_state("robot", "/SM_ROOT", ["LSAT"], timeout=3.0) is False
    assert world.clock.now() - start < 0.5
    assert "REMOTE_INIT_REFUSED: " in caplog.text
    assert "Did you mean 'LAST'?" in caplog.text


def test_a_start_with_a_value_that_is_refused_changes_nothing(world):
    machine = StateMachine(["done"], userdata_type=Trip)
    machine.add("FIRST", CBState(lambda _: "done", outcomes=["done"]))
    machine.add("LAST", CBState(lambda _: "done", outcomes=["done"]))
    world.serve(machine)
    client = IntrospectionClient(node=world.mission)
    userdata = UserData()
    userdata.goal, userdata.speed = "dock", "fast"
    assert client.set_initial_state("robot", "/SM_ROOT", ["LAST"], userdata, timeout=3.0) is False
    assert machine.get_initial_states() == ["FIRST"]
    assert (machine.userdata.goal, machine.userdata.speed) == ("", 0.5)


def test_refused_then_accepted(world):
    world.serve(make_machine())
    client = IntrospectionClient(node=world.mission)
    for states, expected in ((["NO"], False), (["LAST"], True), (["NO"], False), (["LAST"], True)):
        assert client.set_initial_state("robot", "/SM_ROOT", states, timeout=3.0) is expected


def test_without_a_server_or_path_it_is_false_after_the_timeout(world, caplog):
    client = IntrospectionClient(node=world.mission)
    assert client.set_initial_state("robot", "/SM_ROOT", ["A"], timeout=3.0) is False
    assert world.clock.now() == 3.0
    world.serve(make_machine())
    assert client.set_initial_state("robot", "/NO", ["A"]) is False
    assert "got path '/NO'; expected one of ['/SM_ROOT', '/SM_ROOT/BOTH']" in caplog.text


def test_a_server_that_only_shows_takes_no_commands(world):
    machine = make_machine()
    world.serve(machine, obey=False)
    client = IntrospectionClient(node=world.mission)
    assert client.set_initial_state("robot", "/SM_ROOT", ["LAST"], timeout=1.0) is False
    assert machine.get_initial_states() == ["FIRST"]


def test_userdata_that_cannot_travel_is_named(world):
    userdata = UserData()
    userdata.fine, userdata.bad = 1, object()
    client = IntrospectionClient(node=world.mission)
    with pytest.raises(InvalidStateError, match=r"userdata: got \['bad'\], which JSON cannot"):
        client.set_initial_state("robot", "/SM_ROOT", ["A"], userdata)


@pytest.mark.parametrize("text", ["gASVBAAAAAAAAABLAS4=", "[", '{"a": {"$repr": "x"}}', "3"])
def test_a_pickle_or_other_rubbish_from_the_network_does_nothing(world, text, caplog):
    machine = make_machine()
    world.serve(machine)
    found = world.listen(STATUS_TOPIC, SmachContainerStatus)
    with Publisher(
        "robot" + INIT_TOPIC, SmachContainerInitialStatusCmd, node=world.mission
    ) as commands:
        commands.publish("/SM_ROOT", ["LAST"], text)
        world.clock.sleep(0.1)
    assert found[-1].info.startswith("REMOTE_INIT_REFUSED: ")
    assert machine.get_initial_states() == ["FIRST"]


def test_userdata_that_is_no_json_is_shown(world):
    machine = make_machine()
    machine.userdata.robot = object()
    machine.userdata.map = bytes(100_000)
    machine.userdata.number = Int32(4)
    world.serve(machine)
    found = world.listen(STATUS_TOPIC, SmachContainerStatus)
    world.clock.sleep(0.1)
    data = json.loads(next(m.local_data for m in found if m.path == "/SM_ROOT"))
    assert data["robot"]["$repr"].startswith("<object object")
    assert data["map"] == {"$repr": "<bytes of 100000 elements>"}
    assert data["number"] == {"$msg": "std_msgs/Int32", "fields": {"data": 4}}


def test_stop_sends_the_last_status_and_everything_that_waits(world):
    machine = make_machine()
    server = world.serve(machine)
    found = world.listen(STATUS_TOPIC, SmachContainerStatus)
    seen = world.listen(EVENTS_TOPIC, String)
    world.clock.sleep(0.1)
    machine.execute()
    server.stop()
    server.stop()
    world.clock.sleep(0.1)
    assert json.loads(seen[-1].data)["kind"] == "Finished"
    assert [m for m in found if m.path == "/SM_ROOT"][-1].active_states == ["None"]
    assert machine._smachpy.live.listeners == ()
    server.start()  # and again
    world.clock.sleep(0.1)
    assert IntrospectionClient(node=world.mission).get_servers() == ["/robot"]


def test_a_node_that_closes_stops_the_server(world):
    server = world.serve(make_machine())
    world.robot.close()
    server.stop()
    assert list_endpoints(world.mission.transport) == []


def test_a_proxy_alone_shows_and_obeys_one_container(world):
    machine = make_machine()
    proxy = ContainerProxy("robot", machine, "/SM_ROOT", node=world.robot)
    proxy.start()
    proxy.start()
    client = IntrospectionClient(node=world.mission)
    assert client.set_initial_state("robot", "/SM_ROOT", ["LAST"], timeout=1.0) is True
    proxy.stop()
    proxy.stop()
    assert list_endpoints(world.mission.transport) == []


def test_only_containers_can_be_shown(world):
    with pytest.raises(InvalidStateError, match="expected a container"):
        IntrospectionServer("robot", Wait(), "/SM_ROOT")
    with pytest.raises(InvalidStateError, match="expected a container"):
        ContainerProxy("robot", Wait(), "/SM_ROOT")


@pytest.mark.parametrize("seed", range(20))
def test_in_every_order_the_last_status_is_the_right_one(seed):
    with World(seed) as world:
        machine = make_machine()
        world.serve(machine)
        found = world.listen(STATUS_TOPIC, SmachContainerStatus)
        for _ in range(2):
            machine.execute()
            world.clock.sleep(0.2)
            last = [m for m in found if m.path == "/SM_ROOT"][-1]
            assert last.active_states == ["None"]


def test_userdata_that_changes_while_it_is_read_is_shown_as_that(world):
    class Restless(dict):
        def items(self):
            raise RuntimeError("dictionary changed size during iteration")

    machine = make_machine()
    machine.userdata.restless = Restless(a=1)
    machine.userdata.number = 1
    world.serve(machine)
    found = world.listen(STATUS_TOPIC, SmachContainerStatus)
    world.clock.sleep(0.1)
    data = json.loads(next(m.local_data for m in found if m.path == "/SM_ROOT"))
    assert data == {"restless": "<Restless that changes>", "number": "<int that changes>"}
    client = IntrospectionClient(node=world.mission)
    assert client.set_initial_state("robot", "/SM_ROOT", ["LAST"], timeout=1.0) is True


def test_a_server_that_cannot_start_leaves_nothing_on_the_network(clock, monkeypatch):
    def fails(*_, **__):
        raise RuntimeError("no feed")

    monkeypatch.setattr("smachpy.network.server.Feed", fails)
    session = MemoryNetwork(clock).session()
    with Node("robot", transport=session, clock=clock) as node:
        before = list_endpoints(session)
        server = IntrospectionServer(
            "robot", StateMachine(["done"]), "/SM", node=node, control=True
        )
        with pytest.raises(RuntimeError, match="no feed"):
            server.start()
        assert list_endpoints(session) == before
        monkeypatch.undo()
        server.start()
        server.stop()
        assert list_endpoints(session) == before
