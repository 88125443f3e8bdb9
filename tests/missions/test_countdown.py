from __future__ import annotations

import pytest

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.presence import list_endpoints
from smachpy import events as ev
from smachpy.exceptions import MissionError
from smachpy_missions.course.countdown import CountdownServer, countdown, main
from smachpy_missions.interfaces import CountdownAction, CountdownGoal


@pytest.fixture
def server(node):
    shown = []
    server = CountdownServer(shown.append)
    server.shown = shown
    yield server
    server.close()


@pytest.fixture
def clients(server):
    clients = [SimpleActionClient("countdown", CountdownAction) for _ in range(2)]
    assert all(client.wait_for_server(1.0) for client in clients)
    return clients


def test_it_shows_each_second_down_to_zero(clock, server, clients):
    seen = []
    start = clock.now()
    clients[0].send_goal(
        CountdownGoal(seconds=3), feedback_cb=lambda f: seen.append((clock.now() - start, f))
    )
    clients[0].wait_for_result()
    assert clients[0].get_state() == GoalStatus.SUCCEEDED
    assert [(round(t, 3), f.seconds_left) for t, f in seen] == [(0, 3), (1, 2), (2, 1)]
    assert clock.now() - start == pytest.approx(3.0)
    assert server.shown == [3, 2, 1, 0]


def test_another_client_can_stop_it_at_once(clock, clients):
    starter, stopper = clients
    starter.send_goal(CountdownGoal(seconds=10))
    clock.sleep(2.5)
    stopper.cancel_all_goals()
    starter.wait_for_result()
    assert clock.now() == pytest.approx(2.5)
    assert starter.get_state() == GoalStatus.PREEMPTED
    assert starter.get_result().seconds_left == 8
    assert starter.get_goal_status_text() == "stopped with 8 s left"


def test_a_second_start_preempts_the_first(clock, clients):
    first, second = clients
    first.send_goal(CountdownGoal(seconds=10))
    clock.sleep(2.5)
    second.send_goal(CountdownGoal(seconds=2))
    second.wait_for_result()
    assert first.get_state() == GoalStatus.PREEMPTED
    assert second.get_state() == GoalStatus.SUCCEEDED
    assert clock.now() == pytest.approx(4.5)


def test_the_mission_counts_takes_over_and_stops(clock, node):
    machine = countdown()
    events = []
    machine.subscribe(events.append)
    assert machine.execute() == "succeeded"
    assert clock.now() == pytest.approx(3.0 + 5.0 + 2.0, abs=0.1)
    left = {e.path: e.outcome for e in events if isinstance(e, ev.Left)}
    assert left["/COUNTDOWN/START_TWICE/FIRST"] == "taken_over"
    assert left["/COUNTDOWN/STOP"] == "stopped"
    assert list_endpoints(node.transport, kind=Kind.ACTION_SERVER, name="countdown") == []


def test_the_mission_can_run_twice_and_be_preempted(clock, node):
    machine = countdown(seconds=1)
    assert machine.execute() == "succeeded"
    task = clock.spawn(lambda: outcomes.append(machine.execute()), name="mission")
    outcomes = []
    clock.sleep(3.0)
    machine.request_preempt()
    task.join()
    assert outcomes == ["preempted"]


@pytest.mark.parametrize("seconds", [-3, 2**32])
def test_seconds_that_do_not_fit_the_goal_are_refused_before_anything_counts(seconds, capsys):
    with pytest.raises(MissionError, match=f"seconds: got {seconds}; expected 0 to 4294967295"):
        countdown(seconds)
    assert main(["start", str(seconds)]) == 2
    assert f"countdown: seconds: got {seconds}; expected" in capsys.readouterr().err
