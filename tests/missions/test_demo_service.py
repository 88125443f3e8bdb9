from __future__ import annotations

import itertools

import pytest

from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.wire.presence import list_endpoints
from smachpy import events as ev
from smachpy.checks import check
from smachpy.exceptions import MissionError
from smachpy_missions.course.demo_service import NAME, TOPIC, client, demo_service, server
from smachpy_missions.interfaces import DemoMsg
from smachpy_missions.interfaces.srv import DemoSrv


def test_the_mission_talks_listens_and_calls_ten_times_a_second(clock, node):
    machine, asked = demo_service(calls=20), []
    machine.subscribe(
        lambda e: asked.append(e.t) if isinstance(e, ev.Left) and e.path.endswith("/ASK") else None
    )
    assert machine.execute() == "succeeded"
    assert len(asked) == 20
    gaps = [b - a for a, b in itertools.pairwise(asked)]
    assert gaps == pytest.approx([0.1] * 19)
    assert clock.now() == pytest.approx(1.9 + 1.9, abs=0.11)
    assert list_endpoints(node.transport) == []


def test_it_can_run_twice_also_after_a_preempt(clock, node):
    machine = demo_service(calls=5)
    outcomes = []
    task = clock.spawn(lambda: outcomes.append(machine.execute()), name="mission")
    clock.sleep(0.55)
    machine.request_preempt()
    task.join()
    outcomes.append(machine.execute())
    assert outcomes == ["preempted", "succeeded"]


def test_a_call_says_what_was_heard(clock, node):
    machine, answers = server(), []
    task = clock.spawn(machine.execute, name="server")
    answers.append(ServiceProxy(NAME, DemoSrv)("good morning").out)
    machine.request_preempt()
    task.join()
    assert answers == ["heard 'good morning'"]
    assert list_endpoints(node.transport) == []


def test_the_client_calls_and_counts(mission, service_server):
    asked = service_server(NAME, DemoSrv)
    asked.default_response({"out": "yes"})
    run = mission(client(calls=3))
    run.assert_outcome("succeeded")
    assert [request.in_ for request in asked.requests] == ["call 0", "call 1", "call 2"]
    assert run.duration == pytest.approx(0.2)


def test_time_that_is_lost_is_not_hurried_after(mission, service_server):
    slow = service_server(NAME, DemoSrv)
    slow.reply({"out": "late"}, duration=0.55)
    slow.default_response({"out": "yes"})
    run = mission(client(calls=4))
    run.assert_outcome("succeeded")
    assert run.duration == pytest.approx(0.55 + 0.3)


@pytest.mark.parametrize("fault", ["fail", "never_answer", "die"])
def test_a_server_that_fails_ends_the_client(mission, service_server, fault):
    broken = service_server(NAME, DemoSrv)
    getattr(broken, fault)()
    run = mission(client(calls=3))
    run.assert_outcome("aborted")
    run.assert_duration(at_most=5.1)


def test_no_server_ends_the_client_in_time(mission):
    run = mission(client(calls=3))
    run.assert_outcome("aborted")
    run.assert_duration(at_most=5.1)


@pytest.mark.parametrize("state", ["TALK", "REST"])
def test_a_preempt_ends_it_at_once(mission, state):
    mission.preempt(on=state, after=0.05)
    run = mission(demo_service())
    run.assert_outcome("preempted")
    assert run.duration < 1.1


def test_a_lost_message_is_noticed(mission):
    mission.topic(TOPIC, DemoMsg).publish_every(0.1, [{"number": n} for n in (0, 1, 3)], start=0.5)
    mission.replace("TALK", outcomes=["preempted"], duration=2)
    run = mission(demo_service(calls=5))
    assert run.outcomes("LISTEN") == ("invalid",)
    run.assert_outcome("aborted")


def test_silence_ends_it(mission):
    mission.replace("TALK", outcomes=["preempted"], duration=60)
    run = mission(demo_service(calls=5))
    assert run.outcomes("LISTEN") == ("invalid",)
    run.assert_duration(at_most=6)


def test_whatever_happens_it_ends(mission):
    found = mission.explore(lambda: demo_service(calls=2), max_time=40, max_runs=400)
    found.assert_ok()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"calls": 0}, "calls: got 0; expected 1 or more"),
        ({"rate": 0.0}, "rate: got 0; expected more than 0, at most 1000"),
        ({"rate": 1e6}, r"rate: got 1e\+06; expected"),
    ],
)
def test_bad_arguments_are_refused(arguments, text):
    with pytest.raises(MissionError, match=text):
        demo_service(**arguments)


@pytest.mark.parametrize("machine", [demo_service, client, server])
def test_a_check_finds_nothing(machine):
    report = check(machine())
    report.assert_ok()
