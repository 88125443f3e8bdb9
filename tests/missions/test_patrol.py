from __future__ import annotations

import itertools

import pytest

from actionlib_core.clock import VirtualClock, use_clock
from smachpy import events as ev
from smachpy.exceptions import MissionError
from smachpy.places.exceptions import InputFileError
from smachpy.places.maps import OFFICE_WAYPOINTS
from smachpy.states import load_route
from smachpy_missions.patrol import patrol


def record(machine):
    events = []
    machine.subscribe(events.append)
    return events


def goals(events):
    return [e for e in events if isinstance(e, ev.GoalDone)]


def test_it_visits_every_waypoint_and_charges_when_the_battery_is_low(
    clock, simulate, office_robot
):
    route = load_route(OFFICE_WAYPOINTS)
    with simulate(office_robot) as simulation:
        machine = patrol()
        events = record(machine)
        reached = []

        def note(event):
            drive = isinstance(event, ev.GoalDone) and event.path.endswith("/DRIVE")
            if drive and event.status == "SUCCEEDED":
                reached.append(simulation.robot.body.pose)

        machine.subscribe(note)
        assert machine.execute() == "succeeded"
        seconds = clock.now()
    assert len(reached) == len(route.waypoints)
    for pose, waypoint in zip(reached, route.waypoints, strict=True):
        assert pose.distance(waypoint.pose) < 0.1
    left = [(e.path, e.outcome) for e in events if isinstance(e, ev.Left)]
    assert left.count(("/PATROL/ROUND", "battery_low")) == 1
    assert left.count(("/PATROL/RECHARGE", "succeeded")) == 1
    assert left.count(("/PATROL/ROUND/VISIT/DRIVE", "preempted")) == 1
    assert [e.action for e in goals(events)].count("charge") == 1
    assert 40 < seconds < 90


def test_it_goes_on_with_the_interrupted_waypoint(clock, simulate, office_robot):
    with simulate(office_robot):
        machine = patrol()
        events = record(machine)
        machine.execute()
    sent = [
        e.goal.target_pose.pose.position
        for e in events
        if isinstance(e, ev.GoalSent) and e.path == "/PATROL/ROUND/VISIT/DRIVE"
    ]
    places = [(p.x, p.y) for p in sent]
    assert len(places) == 6
    assert sum(a == b for a, b in itertools.pairwise(places)) == 1


def test_a_preempt_stops_the_robot_and_ends_it(clock, simulate, office_robot):
    with simulate(office_robot) as simulation:
        machine = patrol()
        task = clock.spawn(lambda: outcomes.append(machine.execute()), name="mission")
        outcomes = []
        clock.sleep(5.0)
        assert simulation.robot.body.speed > 1.0
        machine.request_preempt()
        task.join()
        assert outcomes == ["preempted"]
        assert simulation.robot.body.standing
        assert clock.now() < 7.0


def test_a_robot_that_cannot_get_there_ends_it_with_aborted(simulation):
    for y in (6.9, 7.6, 8.3):
        simulation.world.add_obstacle(6.0, y, 0.4)
    machine = patrol()
    events = record(machine)
    assert machine.execute() == "aborted"
    assert "every path is blocked" in goals(events)[-1].text


def test_a_long_patrol_charges_whenever_it_must(clock, simulate, office_robot):
    with simulate(office_robot) as simulation:
        machine = patrol(rounds=5)
        events = record(machine)
        assert machine.execute() == "succeeded"
        assert clock.now() > 300.0
        assert simulation.robot.battery.charge(clock.now()) > 0.1
    done = [(e.action, e.status) for e in goals(events)]
    assert done.count(("charge", "SUCCEEDED")) >= 4
    assert {status for _, status in done} == {"SUCCEEDED", "PREEMPTED"}


def test_a_broken_waypoint_file_is_refused_before_anything_moves(tmp_path):
    with pytest.raises(InputFileError, match=r"nowhere\.yaml"):
        patrol(waypoints=tmp_path / "nowhere.yaml")


@pytest.mark.parametrize("seed", range(5))
def test_it_succeeds_whoever_goes_first(seed, simulate_on, office_robot):
    with VirtualClock(seed) as clock, use_clock(clock), simulate_on(clock, office_robot):
        machine = patrol()
        events = record(machine)
        assert machine.execute() == "succeeded"
    assert [e.status for e in goals(events)].count("PREEMPTED") == 1


@pytest.mark.parametrize("rounds", [0, -2])
def test_no_rounds_are_refused(rounds):
    with pytest.raises(MissionError, match=rf"rounds: got {rounds}; expected 1 or more"):
        patrol(rounds=rounds)
