"""What other programs on the network send is believed only after a check.

For each topic and service of a machine everything that crosses is listed here; each field is
replaced by odd values. Either the reader refuses it, or all that uses it works.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import logging
import math
from dataclasses import asdict

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actionlib_core.inputs.checked_data import LATEST
from actionlib_core.inputs.json_text import load_json
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.node import Node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import Publisher
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.transport.tokens import Endpoint, Kind, token_key
from smachpy import CBState, Concurrence, IntrospectionServer, StateMachine
from smachpy.events import EVENT_KINDS, record_text
from smachpy.events.introspection import describe
from smachpy.events.reading import read_event
from smachpy.events.run_state import RunState
from smachpy.network import feed
from smachpy.network.reading import read_history, read_numbered_event, read_observation
from smachpy.network.remote_control import STATE_TOPIC
from smachpy.states.questions import AnswerQuestion
from smachpy_viz.live import machines as machines_module
from smachpy_viz.live import network as network_module
from smachpy_viz.live.machine_routes import EXPORTS, compared
from smachpy_viz.live.machines import Machine, Machines
from smachpy_viz.live.network import Network
from smachpy_viz.live.runs import Runs
from smachpy_viz.model.history import History
from smachpy_viz.model.why import why
from smachpy_viz.runs.scene import Scene

NOW = 1_700_000_000_000_000_000


def job():
    machine = StateMachine(outcomes=["done"], name="JOB")
    both = Concurrence(outcomes=["done"], default_outcome="done", outcome_map={"done": {"C": "ok"}})
    both.add("C", CBState(lambda _: "ok", outcomes=["ok"]))
    both.add("D", CBState(lambda _: "ok", outcomes=["ok"]))
    machine.add("A", CBState(lambda _: "ok", outcomes=["ok"]), {"ok": "B"})
    machine.add("B", both)
    return machine


RECORD = describe(job())

FIELDS = {
    "initial": ["A"], "mission": "m", "began_ns": NOW, "outages": [[NOW - 5, NOW - 3]],
    "active": [["/JOB/A", NOW]], "outcome": "ok", "error": "ValueError: x", "trace": "",
    "source": "operator", "by": "ann", "why": "", "grace": 2.0, "label": "A", "stack": "",
    "timeout": 5.0, "attempt": 1, "reason": "pause", "number": 3, "callback": "f", "key": "k",
    "value": {"x": [1, 2.5]}, "transition": "t1", "marking": ["p1"], "transitions": ["t1"],
    "guards": ["low"], "truths": [""], "text": "Go?", "answers": ["yes"], "words": ["Yes"],
    "default": "yes", "patience": 5.0, "service": "q/1", "has_picture": False, "answer": "yes",
    "action": "robot/move", "goal_id": "g1", "goal": {"$msg": "a/B", "fields": {"x": 1.0}},
    "feedback": {"$msg": "a/C", "fields": {"distance_remaining": 1.0}}, "status": "SUCCEEDED",
    "result": None, "resource": "base", "holder": "/JOB/B",
}  # fmt: skip


def event(kind, seq=1, **more):
    fields = {name: FIELDS[name] for name in EVENT_KINDS[kind]._fields[3:]}
    path = "/JOB" if kind in {"Started", "Finished", "Recovered"} else "/JOB/A"
    common = {"kind": kind, "path": path, "t": 1.0, "stamp_ns": NOW + seq * 1000, "seq": seq}
    return {**common, **fields, **more}


RUN = [event(kind, seq) for seq, kind in enumerate(["Started", "Entered", *EVENT_KINDS], 1)]

HEAD = {"kind": "Observed", "path": "", "stamp_ns": NOW, "robot": "", "n": 1}
OBSERVED = {
    "pose": {"at": [1.0, 2.0, 0.5]},
    "scan": {"at": [1.0, 2.0, 0.5], "first": -1.0, "step": 0.5, "ranges": [100, -1]},
    "plan": {"points": [[1.0, 2.0]]},
    "map": {
        "resolution": 0.5, "width": 3, "height": 2, "origin": [1.0, 2.0, 0.0],
        "cells": "eNpjYGRiYGIAAAAXAAY=",
    },
    "value": {"name": "battery", "value": 75.0, "unit": "%"},
    "values": {"topic": "odom", "values": {"linear.x": 0.5}},
}  # fmt: skip


def folded():
    state = RunState()
    for one in RUN:
        state.fold(read_event(one))
    return json.loads(json.dumps(state.data))


ODD = [
    *(None, True, -1, 0, 5, 2**63, 2**70, 1e308, "", "x", "\ud800", "\x1b]0;x\x07", "nan", "inf"),
    *([], [1], ["x"], [[]], [["x", "y"]], [[NOW, "x"]], {}, {"a": 1}, {"$msg": 5}, {"secs": "x"}),
    *({"$msg": "a/B", "fields": {"pose": {"$msg": "x", "fields": []}}}, {"secs": 9e9, "nsecs": 1}),
]


def history(**more):
    described = json.loads(json.dumps(asdict(RECORD)))
    told = {"epoch": "e", "session": "s", "run": "", "description": described, "problems": []}
    return {
        **told,
        "base": None,
        "events": RUN,
        "observed": [],
        "control": None,
        "now": NOW,
        **more,
    }


def use(machines, *, drawn=True):
    """Use machines in every way in which the viewer does; with `drawn` in the slow ways, too."""
    json.dumps(machines.summaries())
    runs = Runs(machines)
    json.dumps([runs.rows(), runs.fleet()], allow_nan=False)
    for name in [one["name"] for one in machines.summaries()]:
        machine = machines.get(name)
        for short in (True, False):
            json.loads(machine.snapshot(short=short)[1], parse_constant=refuse)
        why(machine.record, machine.events()).to_json()
        if drawn:
            side = (name, machine.record, machine.events())
            json.dumps(compared(side, side), allow_nan=False)
            for make, _ in EXPORTS.values():
                make(machine, machine.record, "", [])
        marks, scene, state = History(), Scene(machine.record, "/one"), RunState()
        for one in machine.events():
            marks.on_record(one)
            state.fold(one)
            list(scene.of_event(one, state))
        for one in machine.observed():
            list(scene.of_observation(one))
        marks.marks(), marks.goals(), marks.written(5)
        machine.questions(), machine.active()


def refuse(constant):
    raise AssertionError(f"a browser does not read {constant}")


def shown(told, **how):
    """Read a history as the viewer does; show and use it, unless it is refused as a whole."""
    try:
        found, record, problems = read_history(json.dumps(told))
    except ValueError:
        return None
    machines = Machines()
    machines.obtain("one").reset({**found, "description": record})
    use(machines, **how)
    return problems


def variants(record):
    """The record with one of its fields replaced by an odd value, or missing, in turn."""
    for name in record:
        yield {key: value for key, value in record.items() if key != name}
        for odd in ODD:
            yield {**record, name: odd}


def accepted(records, read):
    """The records that a reader takes."""
    for record in records:
        with contextlib.suppress(ValueError):
            yield read(json.dumps(record))


@pytest.mark.parametrize("kind", EVENT_KINDS)
def test_event_with_any_field_replaced_is_refused_or_harms_nothing(kind):
    odd = list(accepted(variants(event(kind, 5)), read_numbered_event))
    first = [event(one) for one in ("Started", "Entered", "GoalSent", "QuestionAsked")]
    events = [{**one, "seq": seq} for seq, one in enumerate([*first, *odd, event("Left")], 1)]
    assert shown(history(events=events)) == []
    assert 0 < len(odd) < len(list(variants(event(kind, 5))))


@pytest.mark.parametrize("kind", EVENT_KINDS)
def test_event_with_a_field_of_another_kind_harms_nothing(kind):
    foreign = sorted({*FIELDS, "progress"} - {*EVENT_KINDS[kind]._fields})
    odd = [{**event(kind, 5), name: value} for name in foreign for value in (5, "x", [1], {"a": 1})]
    taken = list(accepted(odd, read_numbered_event))
    first = [] if kind == "Started" else [event("Started"), event("Entered"), event("GoalSent")]
    events = [{**one, "seq": seq} for seq, one in enumerate([*first, *taken], 1)]
    assert shown(history(events=events)) == []
    state = RunState()
    for one in events:
        state.fold(read_event(one))
        assert all(
            goal.get("progress", {}).keys() != {"a"} for goal in state.data["goals"].values()
        )


@pytest.mark.parametrize("what", OBSERVED)
def test_data_of_topics_with_any_field_replaced_is_refused_or_harms_nothing(what):
    odd = list(variants({**HEAD, "what": what, **OBSERVED[what]}))
    taken = [{**one, "n": n} for n, one in enumerate(accepted(odd, read_observation), 1)]
    assert 0 < len(taken) < len(odd)
    assert shown(history(observed=taken)) == []
    assert len(shown(history(observed=odd), drawn=False)) == len(odd) - len(taken)


@pytest.mark.slow
def test_state_before_the_events_with_any_field_replaced_is_refused_or_harms_nothing():
    facts = folded()
    odd = list(variants(facts))
    for part in ("states", "goals", "userdata"):
        for name, one in facts[part].items():
            odd += [{**facts, part: {**facts[part], name: other}} for other in variants(one)]
    for base in odd:
        assert shown(history(base=base, events=RUN[:4]), drawn=False) is not None


def test_history_with_any_field_replaced_is_refused_or_harms_nothing():
    for odd in variants(history(events=RUN[:4])):
        shown(odd, drawn=False)


@pytest.mark.slow
def test_structure_with_any_field_replaced_is_refused_or_harms_nothing():
    whole = history()["description"]
    odd = list(variants(whole))
    first, second = whole["children"]
    odd += [{**whole, "children": [first, one]} for one in variants(second)]
    for record in odd:
        shown(history(description=record, events=RUN[:4]), drawn=False)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)


@st.composite
def random_events(draw):
    """Events of all kinds at random places, with random values; mostly well-formed."""
    events = []
    for seq in range(1, draw(st.integers(1, 15))):
        kind = draw(st.sampled_from(list(EVENT_KINDS)))
        path = draw(st.sampled_from(["/JOB", "/JOB/A", "/JOB/B", "/JOB/B/C", "/OTHER", ""]))
        one = event(kind, seq, path=path)
        one["stamp_ns"] = draw(st.integers(0, LATEST) | st.integers(NOW, NOW + 5))
        for name in ("value", "goal", "feedback", "result"):
            if name not in one:
                continue
            one[name] = draw(JSON)
        if "active" in one:
            one["active"] = [[path, draw(st.integers(0, NOW + 9))]]
        events.append(one)
    return events


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(random_events())
def test_well_formed_events_in_any_order_harm_nothing(events):
    assert shown(history(events=events), drawn=False) == []


# -- on the network -------------------------------------------------------------------------------


class World:
    """A viewer, a good machine, and a hostile program, on a network in memory."""

    def __init__(self, clock):
        self.clock = clock
        self.network = MemoryNetwork(clock)
        self.nodes = [self.node(name) for name in ("robot", "desk", "evil")]
        self.robot, self.desk, self.evil = self.nodes
        self.machines = Machines()
        self.viewer = Network(self.desk, self.machines, control=True)
        self.server = IntrospectionServer("good", job(), "/JOB", node=self.robot)
        self.server.start()
        self.parts = []

    def node(self, name):
        return Node(name, transport=self.network.session(), clock=self.clock)

    def hostile(self, told, name="hostile"):
        """A server of one's own making; returns functions that send on its topics."""
        session = self.evil.transport.session_id
        text = told if isinstance(told, str) else json.dumps({**told, "session": session})
        serve = feed.HISTORY_SERVICE
        self.parts.append(
            Service(f"/{name}{serve}", Trigger, lambda _: (True, text), node=self.evil, alone=False)
        )
        topics = (feed.EVENTS_TOPIC, feed.OBSERVED_TOPIC, feed.DESCRIPTION_TOPIC, STATE_TOPIC)
        made = {one: Publisher(f"/{name}{one}", String, node=self.evil) for one in topics}
        self.parts += made.values()
        self.clock.sleep(2.0)
        return made

    def leave(self):
        for part in self.parts:
            (part.unregister if hasattr(part, "unregister") else part.close)()
        self.parts.clear()
        self.clock.sleep(1.0)

    def end(self):
        self.leave()
        self.server.stop()
        self.viewer.close()
        for node in self.nodes:
            node.close()


@pytest.fixture
def world(clock):
    world = World(clock)
    yield world
    world.end()


WRONG_TEXTS = ["", "{", "5", "[]", "{}", "[" * 100_000, '{"a":' * 50_000, "\x00", '"x"', "null"]


def test_wrong_messages_on_each_topic_are_counted_and_named_with_their_sender(world, caplog):
    topics = world.hostile(history())
    machine = world.machines.get("hostile")
    for topic, text in itertools.product(topics.values(), WRONG_TEXTS):
        topic.publish(text)
    long = json.dumps(event("Entered", 99, path="x" * network_module.MAX_EVENT_LENGTH))
    topics[feed.EVENTS_TOPIC].publish(long)
    world.clock.sleep(1.0)
    assert machine.facts()["refused"] == 4 * len(WRONG_TEXTS) + 1
    assert "node 'evil' in session" in machine.facts()["refusal"]
    assert len([one for one in caplog.records if "left out" in one.message]) == 1
    use(world.machines)
    # What is right is still taken.
    seq = machine.seq
    topics[feed.EVENTS_TOPIC].publish(json.dumps(event("Entered", seq + 1)))
    topics[feed.OBSERVED_TOPIC].publish(json.dumps({**HEAD, "what": "pose", **OBSERVED["pose"]}))
    topics[STATE_TOPIC].publish(json.dumps({"paused": True, "breakpoints": [["/JOB/A", None]]}))
    world.clock.sleep(1.0)
    assert machine.seq == seq + 1
    assert len(machine.observed()) == 1
    assert machine.facts()["control"] == {"paused": True, "breakpoints": [["/JOB/A", None]]}


@pytest.mark.parametrize("told", [*WRONG_TEXTS, json.dumps(history(description=5))])
def test_machine_without_a_history_that_can_be_read_is_not_shown(world, caplog, told):
    caplog.set_level(logging.INFO)
    world.hostile(told)
    assert [one["name"] for one in world.machines.summaries()] == ["good"]
    assert "history" in caplog.text
    world.leave()
    assert world.machines.get("hostile") is None


def test_history_with_some_wrong_events_is_shown_without_them(world):
    wrong = [event("Left", 3, outcome=7), event("Left", 4)]
    world.hostile(history(events=[event("Started", 1), event("Entered", 2), *wrong]))
    machine = world.machines.get("hostile")
    assert [one["seq"] for one in machine.events()] == [1, 2, 4]
    assert machine.events()[-1]["dropped"] == 1
    # It is read twice when a machine appears.
    assert machine.facts()["refused"] == 2
    assert "history: events[2]: $.outcome: got 7; expected a text." in machine.facts()["refusal"]


def test_flood_of_invented_tokens_leaves_nothing_behind(world, monkeypatch, caplog):
    monkeypatch.setattr(network_module, "MAX_MACHINES", 50)
    world.clock.sleep(2.0)
    tokens = []
    for number in range(200):
        end = Endpoint(
            Kind.PUBLISHER, f"m{number}/smach/events", String._type, String._md5sum,
            f"session{number % 7}", "/evil", number,
        )  # fmt: skip
        tokens.append(world.evil.transport.declare_alive(token_key(end)))
    world.clock.sleep(5.0)
    assert len(world.viewer._links) == 50
    assert "more than 50 machines" in caplog.text
    assert [one["name"] for one in world.machines.summaries()] == ["good"]
    for token in tokens:
        token.close()
    world.clock.sleep(60.0)
    assert list(world.viewer._links) == ["good"]
    assert [server for _, server in world.viewer._subscriptions] == ["good"]
    assert list(world.machines._machines) == ["good"]
    # The next real one is found.
    world.hostile(history())
    assert [one["name"] for one in world.machines.summaries()] == ["good", "hostile"]


def test_machine_that_sends_faster_than_the_viewer_reads_is_read_anew(world, monkeypatch):
    monkeypatch.setattr(network_module, "MAX_RECEIVED_ITEMS", 20)
    told = history(events=[event("Started", 1)])
    topics = world.hostile(told)
    machine = world.machines.get("hostile")
    for seq in range(2, 100):
        topics[feed.EVENTS_TOPIC].publish(json.dumps(event("Entered", seq)))
    world.clock.sleep(1.0)
    link = world.viewer._links["hostile"]
    assert len(link._received) <= 20
    assert machine.events()  # from its history


def test_states_keys_and_goals_without_end_are_bounded(monkeypatch):
    for name in ("MAX_STATES", "MAX_KEYS", "MAX_GOALS"):
        monkeypatch.setattr(machines_module, name, 10)
    for kind, field in (("Entered", "path"), ("UserdataWritten", "key"), ("GoalSent", "goal_id")):
        machine = Machine("one", lambda _machine: None)
        events = [event(kind, seq, **{field: f"/JOB/{seq}"}) for seq in range(2, 100)]
        machine.reset({**history(events=[event("Started", 1), *events]), "description": RECORD})
        assert machine.seq == 99
        assert len(machine.events()) <= 12
        assert machine.facts()["refused"] >= 87
        assert "expected fewer" in machine.facts()["refusal"]


def test_what_is_kept_of_all_machines_together_is_bounded(monkeypatch):
    monkeypatch.setattr(machines_module, "MAX_TOTAL_BYTES", 100_000)
    machines = Machines()
    found = [machines.obtain(f"m{number}") for number in range(10)]
    for machine in found:
        events = [event("UserdataWritten", seq, value="x" * 1000) for seq in range(2, 50)]
        observed = [{**HEAD, "n": n, "what": "value", **OBSERVED["value"]} for n in range(1, 500)]
        told = history(events=[event("Started", 1), *events], observed=observed)
        machine.reset({**told, "description": RECORD})
        assert sum(len(record_text(one)) for one in machine.events()) <= 10_000
        assert sum(len(record_text(one)) for one in machine.observed()) <= 10_000
        assert json.loads(machine.snapshot()[1])["base"]["run"] == 1


def test_machines_that_have_gone_are_forgotten_when_there_are_too_many(world, monkeypatch):
    monkeypatch.setattr(network_module, "MAX_MACHINES", 3)
    for number in range(8):
        world.hostile(history(epoch=f"e{number}"), name=f"m{number}")
        world.leave()
    assert [one["name"] for one in world.machines.summaries()] == ["good", "m5", "m6", "m7"]


def test_answer_is_not_given_to_the_question_of_another_machine(world):
    taken = []

    def take(request):
        taken.append(request.answer)
        return AnswerQuestion._response_class(accepted=True)

    robots = Service("/good/questions/q1", AnswerQuestion, take, node=world.robot, alone=False)
    asks = event("QuestionAsked", 3, service="/good/questions/q1")
    told = history(events=[event("Started", 1), event("Entered", 2), asks])
    world.hostile(told)
    answer = {"command": "answer", "path": "/JOB/A", "answer": "yes", "by": "ann"}
    for service in ("/good/questions/q1", "good/questions/*", "**"):
        asks["service"] = service
        with pytest.raises(network_module.CommandError, match="nobody asks that any more"):
            world.viewer.send("hostile", answer)
    assert world.viewer.picture("hostile", "/JOB/A") is None
    assert not taken
    # Its own question can be answered.
    own = Service("/good/questions/q2", AnswerQuestion, take, node=world.evil, alone=False)
    world.machines.get("hostile").add([event("QuestionAsked", 4, service="/good/questions/q2")])
    assert world.viewer.send("hostile", answer)["ok"]
    assert taken == ["yes"]
    for one in (robots, own):
        one.close()


def test_answer_is_given_though_the_network_and_the_mission_are_slow(world, monkeypatch):
    """After 1 s the viewer said that nobody asks any more, though the question was open."""
    taken = []

    def take(request):
        world.clock.sleep(4.0)
        taken.append(request.answer)
        return AnswerQuestion._response_class(accepted=True)

    list_alive = world.desk.transport.list_alive

    def slowly(pattern, timeout):
        world.clock.sleep(min(3.0, timeout))
        return list_alive(pattern, timeout) if timeout >= 3.0 else []

    service = Service("/q", AnswerQuestion, take, node=world.evil, alone=False)
    asks = event("QuestionAsked", 3, service="/q")
    world.hostile(history(events=[event("Started", 1), event("Entered", 2), asks]))
    monkeypatch.setattr(world.desk.transport, "list_alive", slowly)
    answer = {"command": "answer", "path": "/JOB/A", "answer": "yes", "by": "ann"}
    assert world.viewer.send("hostile", answer)["ok"]
    assert taken == ["yes"]
    service.close()


def test_picture_of_a_question_is_recognised_by_its_bytes(world):
    png = b"\x89PNG\r\n\x1a\n" + b"0" * 20
    pictures = iter([("image/png", b"<script>"), ("text/html", png), ("image/png", b"")])

    def show(_request):
        media, data = next(pictures)
        return AnswerQuestion._response_class(media_type=media, picture=data)

    service = Service("/q", AnswerQuestion, show, node=world.evil, alone=False)
    asks = event("QuestionAsked", 3, service="/q", has_picture=True)
    world.hostile(history(events=[event("Started", 1), event("Entered", 2), asks]))
    found = [world.viewer.picture("hostile", "/JOB/A") for _ in range(3)]
    assert found == [None, ("image/png", png), None]
    service.close()


def test_numbers_that_no_float_has_reach_no_computation():
    goal = {"$msg": "a/B", "fields": {"secs": 10**400, "distance_remaining": 10**320}}
    found = load_json(json.dumps(event("GoalFeedback", 1, feedback=goal)))
    assert all(
        isinstance(one, str) or math.isfinite(one) for one in found["feedback"]["fields"].values()
    )
