"""Commands over the network, and the history that late viewers ask for."""

from __future__ import annotations

import json

import pytest

from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.node import Node
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.pubsub.topic import Subscriber
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import IntrospectionServer, State, StateMachine
from smachpy.events import PreemptRequested, to_record
from smachpy.events.run_state import RunState
from smachpy.network.remote_control import (
    STATE_TOPIC,
    CommandError,
    ControlClient,
    ControlServer,
    parse_command,
)
from smachpy.pnp import PetriNetPlan
from tests.smachpy.pnp.nets import net_of


class Wait(State):
    def __init__(self):
        super().__init__(outcomes=["done", "preempted"])

    def execute(self, userdata):
        self.sleep(2.0)
        return "preempted" if self.preempt_requested() else "done"


@pytest.fixture
def world(clock):
    network = MemoryNetwork(clock)
    robot = Node("robot", transport=network.session(), clock=clock)
    desk = Node("desk", transport=network.session(), clock=clock)
    machine = StateMachine(outcomes=["done", "preempted"], name="JOB")
    with machine:
        StateMachine.add("A", Wait(), {"done": "B"})
        StateMachine.add("B", Wait(), {"done": "A"})
    server = IntrospectionServer("robot", machine, "/JOB", node=robot, control=True)
    server.start()
    client = ControlClient("/robot", desk)
    task = clock.spawn(machine.execute, name="mission")
    clock.sleep(0.5)
    yield machine, client, clock, desk
    machine.control.resume()
    machine.request_preempt()
    assert task.join(60.0)
    client.close()
    server.stop()
    desk.close()
    robot.close()


def test_pause_step_resume_and_breakpoints(world):
    machine, client, clock, _ = world
    answer = client.send({"command": "pause"})
    assert answer["ok"]
    assert answer["paused"]
    clock.sleep(5.0)
    assert machine.control.waiting() == ("/JOB/B",)
    client.send({"command": "step"})
    clock.sleep(5.0)
    assert machine.control.waiting() == ("/JOB/A",)
    assert client.send({"command": "break", "path": "/JOB/B"})["breakpoints"] == [["/JOB/B", None]]
    client.send({"command": "resume"})
    clock.sleep(5.0)
    assert machine.control.waiting() == ("/JOB/B",)
    assert client.send({"command": "unbreak", "path": "/JOB/B"})["breakpoints"] == []


def test_every_change_is_told_though_it_is_undone_at_once(world):
    """An answer may have told what was in between: a resume into the next breakpoint."""
    machine, _, clock, desk = world
    told = []
    with Subscriber("/robot" + STATE_TOPIC, String, lambda m: told.append(m.data), node=desk):
        clock.sleep(0.5)
        machine.control.pause()
        clock.sleep(0.5)
        told.clear()
        machine.control.resume()
        machine.control.pause()
        clock.sleep(0.5)
    assert told
    assert json.loads(told[-1]) == {"paused": True, "breakpoints": []}


def test_a_pause_that_stops_what_runs(world):
    machine, client, clock, _ = world
    events = []
    machine.subscribe(events.append)
    assert client.send({"command": "pause", "running": "cancel"})["paused"]
    clock.sleep(5.0)
    assert machine.control.waiting() == ("/JOB/A",)  # it runs again
    client.send({"command": "resume"})
    clock.sleep(0.1)
    assert machine.get_active_states() == ["A"]
    asked = [to_record(e) for e in events if isinstance(e, PreemptRequested)]
    assert [(one["path"], one["source"]) for one in asked] == [("/JOB/A", "operator")]


def test_a_breakpoint_after_an_outcome(world):
    machine, client, clock, _ = world
    command = {"command": "break", "path": "/JOB/A", "outcome": "done"}
    assert client.send(command)["breakpoints"] == [["/JOB/A", "done"]]
    clock.sleep(3.0)
    assert machine.control.is_paused()
    assert client.send({**command, "command": "unbreak"})["breakpoints"] == []


def test_a_plan_takes_events_and_fires(clock):
    network = MemoryNetwork(clock)
    robot = Node("robot", transport=network.session(), clock=clock)
    desk = Node("desk", transport=network.session(), clock=clock)
    plan = PetriNetPlan(net_of("init* -> there : [begun]\nthere -> goal : [never]", "inner"))
    machine = StateMachine(outcomes=["goal", "fail", "preempted"], name="JOB")
    with machine:
        StateMachine.add("PLAN", plan)
        StateMachine.add("A", Wait(), {"done": "goal"})
    server = IntrospectionServer("robot", machine, "/JOB", node=robot, control=True)
    server.start()
    client = ControlClient("/robot", desk)
    early = client.send({"command": "fire", "path": "/JOB/PLAN", "transition": "t1"})
    assert not early["ok"]
    assert "not running" in early["text"]
    outcomes = []
    task = clock.spawn(lambda: outcomes.append(machine.execute()), name="mission")
    clock.sleep(0.5)
    wrong = client.send({"command": "post", "path": "/JOB/A", "event": "begun"})
    assert not wrong["ok"]
    assert "/JOB/A" in wrong["text"]
    wrong = client.send({"command": "fire", "path": "/JOB/PLAN", "transition": "t7"})
    assert not wrong["ok"]
    assert "t7" in wrong["text"]
    assert client.send({"command": "post", "path": "/JOB/PLAN", "event": "begun"})["ok"]
    clock.sleep(0.5)
    assert plan.marking() == {"p1": 1}
    assert client.send({"command": "fire", "path": "/JOB/PLAN", "transition": "t1"})["ok"]
    assert task.join(60.0)
    assert outcomes == ["goal"]
    client.close()
    server.stop()
    desk.close()
    robot.close()


def test_force_jump_preempt_and_the_next_start(world):
    machine, client, clock, _ = world
    assert client.send({"command": "force", "path": "/JOB/A", "outcome": "done"})["ok"]
    clock.sleep(0.5)
    assert machine.get_active_states() == ["B"]
    assert client.send({"command": "jump", "path": "/JOB/A"})["ok"]
    clock.sleep(0.5)
    assert machine.get_active_states() == ["A"]
    assert client.send({"command": "initial", "path": "/JOB", "states": ["B"]})["ok"]
    assert client.send({"command": "preempt", "path": "/JOB"})["ok"]


def test_what_cannot_be_done_is_told_to_who_asked(world):
    _, client, _, _ = world
    answer = client.send({"command": "jump", "path": "/JOB/NOWHERE"})
    assert not answer["ok"]
    assert "NOWHERE" in answer["text"]
    answer = client.send({"command": "initial", "path": "/JOB/A/X", "states": ["B"]})
    assert not answer["ok"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("no json", "no JSON"),
        ("[]", "an object"),
        ('{"command": "explode"}', "explode"),
        ('{"command": "jump"}', "path"),
        ('{"command": "jump", "path": 3}', "path"),
        ('{"command": "initial", "path": "/A", "states": "B"}', "states"),
        ('{"command": "break", "path": "/A", "outcome": 5}', "outcome"),
        ('{"command": "pause", "running": "stop"}', "'keep' or 'cancel'"),
        ('{"command": "pause", "running": ["keep"]}', "'keep' or 'cancel'"),
    ],
)
def test_wrong_commands_are_refused(text, words):
    with pytest.raises(CommandError, match=words):
        parse_command(text)


def test_nobody_answers(clock):
    with Node("desk", transport=MemoryNetwork(clock).session(), clock=clock) as desk:
        client = ControlClient("/nobody", desk)
        with pytest.raises(CommandError, match="no answer"):
            client.send({"command": "pause"})
        client.close()


@pytest.mark.parametrize("how", ["stops", "dies"])
def test_who_waits_for_an_answer_learns_at_once_that_none_will_come(clock, how):
    class Stuck(StateMachine):
        def set_initial_state(self, *_):
            clock.sleep(60.0)

    network = MemoryNetwork(clock)
    session = network.session()
    with (
        Node("robot", transport=session, clock=clock) as robot,
        Node("desk", transport=network.session(), clock=clock) as desk,
    ):
        machine = Stuck(outcomes=["done"], name="JOB")
        server = ControlServer("/robot", machine, "/JOB", robot)
        client = ControlClient("/robot", desk)
        clock.call_later(0.5, server.close if how == "stops" else session.kill)
        with pytest.raises(CommandError, match="no answer"):
            client.send({"command": "initial", "path": "/JOB", "states": ["A"]})
        assert clock.now() < 1.0
        client.close()
        server.close()


def test_what_a_command_raises_reaches_who_sent_it(clock):
    class Broken(StateMachine):
        def set_initial_state(self, *_):
            raise RuntimeError("jammed")

    network = MemoryNetwork(clock)
    with (
        Node("robot", transport=network.session(), clock=clock) as robot,
        Node("desk", transport=network.session(), clock=clock) as desk,
    ):
        server = ControlServer("/robot", Broken(outcomes=["done"], name="JOB"), "/JOB", robot)
        client = ControlClient("/robot", desk)
        with pytest.raises(CommandError, match="jammed"):
            client.send({"command": "initial", "path": "/JOB", "states": ["A"]})
        assert client.send({"command": "pause"})["paused"]
        client.close()
        server.close()


def test_history_rebuilds_what_happened(world):
    machine, _, clock, desk = world
    clock.sleep(6.0)
    with ServiceProxy("/robot/smach/history", Trigger, node=desk) as ask:
        history = json.loads(ask().message)
    assert [event["seq"] for event in history["events"]] == list(
        range(1, len(history["events"]) + 1)
    )
    state = RunState(history["base"])
    for event in history["events"]:
        state.fold(event)
    assert state.active() == ["/JOB", f"/JOB/{machine.get_active_states()[0]}"]
    assert state.data["states"]["/JOB/A"]["visits"] == 2
    assert history["control"] == {"paused": False, "breakpoints": []}
    assert history["description"]["label"] == "JOB"


def test_state_of_a_run_notes_preempts_while_they_last():
    state = RunState()
    for number, (kind, path, more) in enumerate(
        [("Started", "/J", {}), ("Entered", "/J/A", {}), ("PreemptRequested", "/J/A", {})], 1
    ):
        state.fold({"kind": kind, "path": path, "stamp_ns": number, **more})
    assert state.data["states"]["/J/A"]["preempt"] == 3
    state.fold({"kind": "Left", "path": "/J/A", "stamp_ns": 4, "outcome": "preempted"})
    assert state.data["states"]["/J/A"]["preempt"] is None
    assert to_record(PreemptRequested("/J", 0.0, 1))["kind"] == "PreemptRequested"


@pytest.fixture
def dots(clock):
    """A machine whose labels have dots in them, and who commands it."""
    network = MemoryNetwork(clock)
    robot = Node("robot", transport=network.session(), clock=clock)
    desk = Node("desk", transport=network.session(), clock=clock)
    inner = StateMachine(outcomes=["done", "preempted"])
    with inner:
        StateMachine.add("B", Wait(), {"done": "C.D"})
        StateMachine.add("C.D", Wait())
    machine = StateMachine(outcomes=["done", "preempted"], name="JOB")
    with machine:
        StateMachine.add("A", Wait(), {"done": "A.1"})
        StateMachine.add("A.1", inner)
    server = IntrospectionServer("robot", machine, "/SHOWN", node=robot, control=True)
    server.start()
    client = ControlClient("/robot", desk)
    yield machine, client
    client.close()
    server.stop()
    desk.close()
    robot.close()


def test_labels_may_have_dots(dots):
    machine, client = dots
    assert client.send({"command": "initial", "path": "/SHOWN/A.1", "states": ["C.D"]})["ok"]
    answer = client.send({"command": "break", "path": "/SHOWN/A.1/C.D", "outcome": "done"})
    assert answer["breakpoints"] == [["/SHOWN/A.1/C.D", "done"]]
    assert machine.control.breakpoints() == (("/JOB/A.1/C.D", "done"),)


@pytest.mark.parametrize(
    ("path", "outcome", "words"),
    [
        ("/SHOWN/NONE", None, "got '/SHOWN/NONE'; expected that of a state below '/SHOWN'"),
        ("/SHOWN/A.2", None, "expected that of a state"),
        ("/SHOWN", None, "expected that of a state below"),
        ("/OTHER/A", None, "expected that of a state"),
        ("/SHOWN/A", "nope", "got 'nope'; expected one of ['done', 'preempted']"),
    ],
)
def test_a_breakpoint_that_nothing_can_reach_is_refused(dots, path, outcome, words):
    machine, client = dots
    answer = client.send({"command": "break", "path": path, "outcome": outcome})
    assert not answer["ok"]
    assert words in answer["text"]
    assert machine.control.breakpoints() == ()


def test_a_server_that_cannot_listen_leaves_nothing_at_the_machine(clock, monkeypatch):
    def fails(*_, **__):
        raise RuntimeError("no service")

    monkeypatch.setattr("smachpy.network.remote_control.Service", fails)
    published = []
    monkeypatch.setattr(ControlServer, "_publish_state", lambda _: published.append(1))
    machine = StateMachine(outcomes=["done"], name="JOB")
    session = MemoryNetwork(clock).session()
    with Node("robot", transport=session, clock=clock) as node:
        with pytest.raises(RuntimeError, match="no service"):
            ControlServer("robot", machine, "/JOB", node)
        machine.control.pause()
        clock.sleep(1.0)
    assert not published


@pytest.mark.parametrize("path", ["", "JOB", "A", "/A"])
def test_a_path_begins_with_the_machine(world, path):
    _, client, _, _ = world
    answer = client.send({"command": "initial", "path": path, "states": ["B"]})
    assert f"got {path!r}; expected a container's, such as '/JOB'" in answer["text"]
