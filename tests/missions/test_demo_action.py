from __future__ import annotations

import pytest

from actionlib_core.action.client import ActionClient, CommState
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.presence import list_endpoints
from smachpy import events as ev
from smachpy.checks import check
from smachpy.exceptions import MissionError
from smachpy_missions.course.demo_action import (
    NAME,
    SEVERAL,
    DemoActionServer,
    SeveralServer,
    demo_action,
)
from smachpy_missions.course.demo_action import client as client_machine
from smachpy_missions.course.demo_action import server as server_machine
from smachpy_missions.interfaces import Demo_actionAction, Demo_actionGoal


@pytest.fixture
def server(node):
    server = DemoActionServer()
    yield server
    server.close()


@pytest.fixture
def several(node):
    server = SeveralServer()
    yield server
    server.close()


@pytest.fixture
def clients(server):
    clients = [SimpleActionClient(NAME, Demo_actionAction) for _ in range(2)]
    assert all(client.wait_for_server(1.0) for client in clients)
    return clients


def test_it_counts_one_step_a_second(clock, clients):
    seen, start = [], clock.now()
    clients[0].send_goal(
        Demo_actionGoal(3), feedback_cb=lambda f: seen.append((clock.now() - start, f))
    )
    clients[0].wait_for_result()
    assert clients[0].get_state() == GoalStatus.SUCCEEDED
    assert clients[0].get_result().final_count == 3
    assert clients[0].get_goal_status_text() == "counted to 3"
    assert [(round(t, 3), f.current_number) for t, f in seen] == [(1, 1), (2, 2), (3, 3)]
    assert clock.now() - start == pytest.approx(3.0)


def test_nothing_to_count_is_done_at_once(clock, clients):
    assert clients[0].send_goal_and_wait(Demo_actionGoal(0)) == GoalStatus.SUCCEEDED
    assert clients[0].get_result().final_count == 0
    assert clock.now() == 0.0


def test_a_negative_count_is_refused_and_the_next_goal_is_taken(clients):
    assert clients[0].send_goal_and_wait(Demo_actionGoal(-1)) == GoalStatus.REJECTED
    assert clients[0].get_goal_status_text() == "count: got -1; expected 0 or more"
    assert clients[0].send_goal_and_wait(Demo_actionGoal(1)) == GoalStatus.SUCCEEDED


def test_a_preempt_on_the_way_says_how_far_it_got(clock, clients):
    clients[0].send_goal(Demo_actionGoal(10))
    clock.sleep(2.5)
    clients[0].cancel_goal()
    clients[0].wait_for_result()
    assert clock.now() == pytest.approx(2.5)
    assert clients[0].get_state() == GoalStatus.PREEMPTED
    assert clients[0].get_result().final_count == 2
    assert clients[0].get_goal_status_text() == "stopped at 2"


def test_a_newer_goal_preempts_the_older(clock, clients):
    first, second = clients
    first.send_goal(Demo_actionGoal(10))
    clock.sleep(2.5)
    second.send_goal(Demo_actionGoal(2))
    second.wait_for_result()
    assert clock.now() == pytest.approx(4.5)
    assert (first.get_state(), first.get_result().final_count) == (GoalStatus.PREEMPTED, 2)
    assert (second.get_state(), second.get_result().final_count) == (GoalStatus.SUCCEEDED, 2)


def test_a_goal_that_is_cancelled_as_it_arrives_counts_nothing(clock, clients):
    clients[0].send_goal(Demo_actionGoal(10))
    clients[0].cancel_goal()
    clients[0].wait_for_result()
    assert clients[0].get_state() in {GoalStatus.PREEMPTED, GoalStatus.RECALLED}
    assert clients[0].get_result().final_count == 0
    assert clients[0].send_goal_and_wait(Demo_actionGoal(2)) == GoalStatus.SUCCEEDED
    assert clock.now() == pytest.approx(2.0)


def test_closing_the_server_ends_the_count(clock, node):
    server = DemoActionServer()
    client = SimpleActionClient(NAME, Demo_actionAction)
    client.send_goal(Demo_actionGoal(10))
    clock.sleep(1.5)
    server.close()
    client.wait_for_result()
    assert client.get_state() == GoalStatus.PREEMPTED
    assert client.get_result().final_count == 1


def test_several_goals_run_side_by_side_and_one_is_cancelled_alone(clock, several):
    client = ActionClient(SEVERAL, Demo_actionAction)
    seen = []
    handles = [
        client.send_goal(
            Demo_actionGoal(count), feedback_cb=lambda h, f: seen.append((h, f.current_number))
        )
        for count in (1, 3, 5)
    ]
    clock.sleep(2.5)
    handles[1].cancel()
    for handle in handles:
        handle.wait()
    assert clock.now() == pytest.approx(5.0)
    assert [h.get_comm_state() for h in handles] == [CommState.DONE] * 3
    assert [h.get_goal_status() for h in handles] == [
        GoalStatus.SUCCEEDED,
        GoalStatus.PREEMPTED,
        GoalStatus.SUCCEEDED,
    ]
    assert [h.get_result().final_count for h in handles] == [1, 2, 5]
    assert [n for h, n in seen if h == handles[2]] == [1, 2, 3, 4, 5]


def test_a_cancel_of_all_ends_all_of_them(clock, several):
    client = ActionClient(SEVERAL, Demo_actionAction)
    handles = [client.send_goal(Demo_actionGoal(100)) for _ in range(50)]
    refused = client.send_goal(Demo_actionGoal(-3))
    clock.sleep(1.5)
    client.cancel_all_goals()
    for handle in handles:
        handle.wait()
    assert {h.get_goal_status() for h in handles} == {GoalStatus.PREEMPTED}
    assert {h.get_result().final_count for h in handles} == {1}
    assert refused.get_goal_status() == GoalStatus.REJECTED


def test_the_mission_counts_is_preempted_and_does_several(clock, node):
    machine, events = demo_action(), []
    machine.subscribe(events.append)
    assert machine.execute() == "succeeded"
    assert clock.now() == pytest.approx(3.0 + 2.5 + 3.0, abs=0.1)
    left = {e.path: e.outcome for e in events if isinstance(e, ev.Left)}
    assert left["/DEMO_ACTION/PREEMPT"] == "stopped"
    results = [e.result.final_count for e in events if isinstance(e, ev.GoalDone)]
    assert results == [3, 2, 1, 2, 3]
    assert list_endpoints(node.transport, kind=Kind.ACTION_SERVER) == []


def test_the_mission_can_run_twice(clock, node):
    machine = demo_action(count=1, preempt_after=0.5)
    assert [machine.execute(), machine.execute()] == ["succeeded", "succeeded"]


@pytest.mark.parametrize("state", ["COUNT", "PREEMPT", "TO_2"])
def test_a_preempt_anywhere_ends_it(mission, state):
    mission.preempt(on=state, after=0.7)
    run = mission(demo_action())
    run.assert_outcome("preempted")
    assert run.goals_left == ()


def test_the_client_and_a_server_that_fails(mission, action_server):
    server = action_server(NAME, Demo_actionAction)
    server.reply(status="aborted", duration=2, text="out of numbers")
    server.die(after=1)
    mission(client_machine(3)).assert_outcome("aborted")
    mission(client_machine(3)).assert_outcome("aborted")


def test_the_client_stops_when_asked_to(mission, action_server):
    server = action_server(NAME, Demo_actionAction)
    server.default_result(duration=100)
    run = mission(client_machine(10, preempt_after=4.0))
    run.assert_outcome("succeeded")
    assert run.outcomes("COUNT") == ("stopped",)
    assert run.duration == pytest.approx(4.0)
    assert len(server.cancelled) == 1


def test_a_count_that_takes_too_long_is_called_off(mission, action_server):
    action_server(NAME, Demo_actionAction).never_finish()
    run = mission(client_machine(3))
    run.assert_outcome("aborted")
    run.assert_duration(at_least=8, at_most=9)


@pytest.mark.slow
def test_whatever_happens_it_ends(mission):
    found = mission.explore(demo_action, max_time=40)
    found.assert_ok()


def test_the_server_program_serves_until_it_is_preempted(clock, node):
    machine, outcomes = server_machine(), []
    task = clock.spawn(lambda: outcomes.append(machine.execute()), name="server")
    client = SimpleActionClient(NAME, Demo_actionAction)
    assert client.wait_for_server(1.0)
    assert client.send_goal_and_wait(Demo_actionGoal(1)) == GoalStatus.SUCCEEDED
    machine.request_preempt()
    task.join()
    assert outcomes == ["preempted"]
    assert list_endpoints(node.transport, kind=Kind.ACTION_SERVER) == []


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"count": -1}, "count: got -1; expected 0 to 2147483647"),
        ({"count": 2**31}, "count: got 2147483648"),
        ({"preempt_after": -1.0}, "preempt_after: got -1; expected more than 0"),
    ],
)
def test_bad_arguments_are_refused_before_anything_moves(arguments, text):
    with pytest.raises(MissionError, match=text):
        demo_action(**arguments)


@pytest.mark.parametrize("machine", [demo_action, client_machine, server_machine])
def test_a_check_finds_nothing(machine):
    report = check(machine())
    report.assert_ok()
