"""What a viewer knows of machines on the network, without a browser."""

from __future__ import annotations

import json
from dataclasses import asdict

import pytest

from actionlib_core.node import Node
from actionlib_core.transport.faulty import FaultyTransport
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import IntrospectionServer, State, StateMachine
from smachpy.events import buffer
from smachpy.events.introspection import describe
from smachpy.network import feed
from smachpy.network.remote_control import CommandError
from smachpy_viz.live.machines import Machine, Machines
from smachpy_viz.live.network import Network


class Spin(State):
    """Ends at once, so often that nobody can follow."""

    def __init__(self, rounds):
        super().__init__(outcomes=["again", "done"])
        self.rounds = rounds

    def execute(self, userdata):
        self.rounds -= 1
        return "again" if self.rounds > 0 else "done"


class Wait(State):
    def __init__(self):
        super().__init__(outcomes=["done", "preempted"])

    def execute(self, userdata):
        return "preempted" if self.sleep(2.0) else "done"


def spinning(rounds):
    machine = StateMachine(outcomes=["done", "preempted"], name="JOB")
    with machine:
        StateMachine.add("A", Spin(rounds), {"again": "A", "done": "B"})
        StateMachine.add("B", Wait())
    return machine


@pytest.fixture
def watch(clock):
    """`watch(machine)` shows a machine and returns what a viewer elsewhere makes of it."""
    network = MemoryNetwork(clock)
    robot = Node("robot", transport=network.session(), clock=clock)
    desk = Node("desk", transport=network.session(), clock=clock)
    machines = Machines()
    viewer = Network(desk, machines, control=True)
    servers = []

    def watch(machine):
        servers.append(IntrospectionServer("robot", machine, "/JOB", node=robot, control=True))
        servers[-1].start()
        clock.sleep(2.0)
        return machines.get("robot")

    watch.viewer, watch.machines, watch.robot, watch.desk = viewer, machines, robot, desk
    watch.network, watch.servers = network, servers
    yield watch
    for server in servers:
        server.stop()
    viewer.close()
    desk.close()
    robot.close()


def test_a_flood_ends_as_the_mission_does(clock, watch, monkeypatch):
    monkeypatch.setattr(feed, "QUEUED_EVENTS", 50)
    monkeypatch.setattr(buffer, "SLACK", 50)
    job = spinning(2000)
    seen = watch(job)
    mission = clock.spawn(job.execute, name="mission")
    clock.sleep(1.0)
    assert seen.summary()["active"] == ["/JOB/B"]
    assert mission.join(60.0)
    clock.sleep(1.0)
    told = seen.summary()
    assert told["active"] == []
    assert told["outcome"] == "done"
    state = json.loads(seen.snapshot(short=True)[1])["base"]
    assert state["dropped"] + sum(one["visits"] for one in state["states"].values()) > 1000
    assert seen.seq == 2 + 2 * 2000 + 2


class Behind:
    """A clock that was set wrongly."""

    def __init__(self, clock, seconds):
        self._clock, self._ns = clock, int(seconds * 1e9)

    def __getattr__(self, name):
        return getattr(self._clock, name)

    def time_ns(self):
        return self._clock.time_ns() - self._ns


def test_a_viewer_knows_how_far_a_robots_clock_is_off(clock, watch, monkeypatch):
    monkeypatch.setattr(feed, "current_clock", lambda: Behind(clock, 300.0))
    seen = watch(spinning(1))
    assert seen.facts()["behind"] == pytest.approx(300e9, abs=1e9)


def test_who_comes_late_is_told_what_the_kept_events_do_not_tell(clock, watch, monkeypatch):
    monkeypatch.setattr(feed, "MAX_KEPT_BYTES", 1000)
    job = spinning(500)
    seen = watch(job)
    assert job.execute() == "done"
    clock.sleep(1.0)
    other = Machines()
    late = Network(watch.desk, other)
    clock.sleep(2.0)
    late.close()
    assert other.get("robot").summary()["outcome"] == "done"
    assert 0 < len(other.get("robot").events()) < 20
    told = json.loads(other.get("robot").snapshot(short=True)[1])["base"]
    assert told["states"]["/JOB/A"]["visits"] == 500
    assert seen.summary()["outcome"] == "done"


def test_who_pauses_does_not_matter(clock, watch):
    """The program, a breakpoint or another viewer: all viewers know it, those that only look too."""
    job = spinning(1)
    seen = watch(job)
    looks = Machines()
    other = Network(watch.desk, looks)
    clock.sleep(2.0)
    paused = {"paused": True, "breakpoints": []}
    going = {"paused": False, "breakpoints": []}
    stopping = {"paused": False, "breakpoints": [["/JOB/B", None]]}
    steps = (
        (lambda: job.control.pause(), paused),
        (lambda: job.control.resume(), going),
        (lambda: job.control.step(), paused),
        (lambda: watch.viewer.send("robot", {"command": "resume"}), going),
        (lambda: job.control.add_breakpoint("/JOB/B"), stopping),
        (lambda: clock.spawn(job.execute, name="mission"), stopping | {"paused": True}),
        (lambda: job.control.remove_breakpoint("/JOB/B"), paused),
        (lambda: job.control.resume(), going),
    )
    for number, (act, expected) in enumerate(steps):
        act()
        clock.sleep(1.0)
        assert seen.facts()["control"] == expected, number
        assert looks.get("robot").facts()["control"] == expected, number
    clock.sleep(5.0)
    other.close()


def test_a_machine_that_obeys_nobody_tells_nobody(clock, watch):
    job = spinning(1)
    server = IntrospectionServer("free", job, "/FREE", node=watch.desk)
    server.start()
    watch(spinning(1))
    job.control.pause()
    clock.sleep(1.0)
    assert watch.machines.get("free").facts()["control"] is None
    server.stop()
    job.control.resume()


def test_a_network_that_takes_nothing_does_not_hold_up_the_end(clock, watch, monkeypatch):
    monkeypatch.setattr(feed, "MAX_KEPT_EVENTS", 300)
    job = spinning(2000)
    watch(job)
    sent = []
    publisher = watch.servers[0]._feed._events
    publish = publisher.publish

    def slowly(text):
        clock.sleep(0.05)
        sent.append(text)
        publish(text)

    monkeypatch.setattr(publisher, "publish", slowly)
    mission = clock.spawn(job.execute, name="mission")
    assert mission.join(60.0)
    begun = clock.now()
    watch.servers[0].stop()
    assert clock.now() - begun < 10.0
    clock.sleep(300.0)
    assert 0 < len(sent) < 100  # those of the time until then, and none later


def test_a_history_tells_of_a_pause_too(clock, watch):
    """What was said while nobody could hear it."""
    seen = watch(spinning(1))
    seen.set_control({"paused": True, "breakpoints": [["/JOB/B", None]]})
    link = watch.viewer._links["robot"]
    link._executor.submit(link._read_history)
    clock.sleep(1.0)
    assert seen.facts()["control"] == {"paused": False, "breakpoints": []}


def test_what_went_before_a_history_is_missing_for_who_was_there_earlier():
    """Between two histories of one machine more went by than its server keeps."""
    described = asdict(describe(spinning(1)))

    def told(first, last, **facts):
        events = [
            {"kind": "Started", "path": "/JOB", "t": 0.0, "stamp_ns": seq, "seq": seq}
            for seq in range(first, last + 1)
        ]
        events[0].update(facts)
        return {"epoch": "e", "description": described, "base": None, "events": events}

    machine = Machine("robot", lambda _machine: None)
    machine.reset(told(1, 40))
    assert machine.since(0) is not None
    machine.reset(told(5001, 5080))
    assert machine.since(40) is None
    assert len(machine.since(5000)) == 80
    assert len(machine.since(5030)) == 50
    machine.reset(told(5081, 5090, dropped=10))  # which no history has
    assert machine.since(5069) is None
    assert len(machine.since(5070)) == 10


def test_an_answer_that_is_read_late_does_not_undo_what_was_told_since(clock, watch, monkeypatch):
    """Resume, into the next breakpoint."""
    job = spinning(1)
    seen = watch(job)
    job.control.add_breakpoint("/JOB/A")
    job.control.add_breakpoint("/JOB/B")
    mission = clock.spawn(job.execute, name="mission")
    clock.sleep(1.0)
    assert seen.facts()["control"]["paused"]
    client = watch.viewer._links["robot"].client
    send = client.send

    def slowly(command):
        answer = send(command)
        clock.sleep(1.0)
        return {**answer, "paused": False}  # as it was when the command had been obeyed

    monkeypatch.setattr(client, "send", slowly)
    watch.viewer.send("robot", {"command": "resume"})
    clock.sleep(1.0)
    assert job.control.waiting() == ("/JOB/B",)
    assert seen.facts()["control"]["paused"]
    job.control.resume()
    assert mission.join(60.0)


def test_machines_of_two_networks_are_told_apart(clock, watch):
    seen = watch(spinning(1))
    elsewhere = MemoryNetwork(clock)
    desk, robot = (
        Node(name, transport=elsewhere.session(), clock=clock) for name in ("desk", "robot")
    )
    job = spinning(1)
    server = IntrospectionServer("robot", job, "/JOB", node=robot, control=True)
    server.start()
    watch.viewer.join(desk)
    clock.sleep(2.0)
    other = watch.machines.get("robot (2)")
    assert job.execute() == "done"
    clock.sleep(1.0)
    assert (seen.summary()["outcome"], other.summary()["outcome"]) == (None, "done")
    watch.viewer.send("robot (2)", {"command": "pause"})  # it reaches one only
    clock.sleep(1.0)
    assert (other.control["paused"], seen.control["paused"]) == (True, False)
    watch.viewer.leave(desk)
    clock.sleep(1.0)
    assert (seen.summary()["stale"], other.summary()["stale"] is None) == (None, False)
    server.stop()
    desk.close()
    robot.close()


@pytest.fixture
def left_alone(clock):
    """A viewer that knew two robots of one name, of which "robot" was killed and "robot (2)" stays.

    Yields the viewer and the job of the one that stays.
    """
    network = MemoryNetwork(clock)
    gone, stays, desk = (
        Node(name, transport=network.session(), clock=clock) for name in ("gone", "stays", "desk")
    )
    viewer = Network(desk, Machines(), control=True)
    servers = []
    for node in (gone, stays):
        job = spinning(1)
        servers.append(IntrospectionServer("robot", job, "/JOB", node=node, control=True))
        servers[-1].start()
        clock.sleep(2.0)
    gone.transport.kill()
    clock.sleep(2.0)
    yield viewer, job
    viewer.close()
    servers[1].stop()
    desk.close()
    stays.close()


def test_a_command_to_a_machine_that_is_gone_reaches_no_other_one_of_its_name(left_alone):
    viewer, stays = left_alone
    with pytest.raises(CommandError, match="robot: the machine is gone"):
        viewer.send("robot", {"command": "pause"})
    assert not stays.control.is_paused()
    viewer.send("robot (2)", {"command": "pause"})
    assert stays.control.is_paused()


def test_a_value_of_a_machine_that_is_gone_is_not_that_of_another_one_of_its_name(left_alone):
    viewer, stays = left_alone
    stays.userdata.place = "dock"
    with pytest.raises(CommandError, match="robot: the machine is gone"):
        viewer.value("robot", "/JOB", "place")
    assert viewer.value("robot (2)", "/JOB", "place") == "dock"


def test_a_value_is_not_fetched_while_two_machines_of_the_name_would_answer(clock, watch):
    watch(spinning(1))
    with Node("other", transport=watch.network.session(), clock=clock) as other:
        server = IntrospectionServer("robot", spinning(1), "/JOB", node=other)
        server.start()
        clock.sleep(2.0)
        with pytest.raises(CommandError, match="got 2 machines with the name 'robot'"):
            watch.viewer.value("robot", "/JOB", "place")
        server.stop()


def test_events_of_a_new_program_are_not_put_into_the_run_before_it(clock):
    """Those that come before its history, on a slow link."""
    network = MemoryNetwork(clock)
    slow = FaultyTransport(network.session(), lambda key, _: (0.5 if "history" in key else 0.0,))
    machines = Machines()
    with Node("desk", transport=slow, clock=clock) as desk:
        viewer = Network(desk, machines)
        for rounds in (1, 20):
            with Node("robot", transport=network.session(), clock=clock) as robot:
                job = spinning(rounds)
                server = IntrospectionServer("robot", job, "/JOB", node=robot)
                server.start()
                clock.sleep(3.0 if rounds == 1 else 0.1)
                assert job.execute() == "done"
                clock.sleep(3.0)
                server.stop()
            clock.sleep(3.0)
        seen = machines.get("robot")
        assert (seen.seq, seen.summary()["outcome"]) == (44, "done")
        assert [event["seq"] for event in seen.events()] == list(range(1, 45))
        before = machines.get(seen.before)
        assert (before.seq, before.summary()["outcome"]) == (6, "done")
        viewer.close()


def test_the_end_of_a_run_that_arrives_after_its_program_has_gone_is_shown(clock):
    """A machine whose program ended with it stayed "stale": the end of its token came first."""
    network = MemoryNetwork(clock)
    late = FaultyTransport(network.session(), lambda key, _: (0.1 if "events" in key else 0.0,))
    machines = Machines()
    with (
        Node("robot", transport=late, clock=clock) as robot,
        Node("desk", transport=network.session(), clock=clock) as desk,
    ):
        viewer = Network(desk, machines)
        job = spinning(1)
        server = IntrospectionServer("robot", job, "/JOB", node=robot)
        server.start()
        clock.sleep(2.0)
        job.execute()
        server.stop()
        clock.sleep(2.0)
        seen = machines.get("robot")
        assert seen.stale is not None
        assert seen.summary()["outcome"] == "done"
        viewer.close()
