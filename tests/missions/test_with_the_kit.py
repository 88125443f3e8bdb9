"""Every mission under the test kit: what it does with good and bad servers, the same each time."""

from __future__ import annotations

import importlib
import random
import tomllib

import pytest

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from smachpy.checks import check
from smachpy.sim.interfaces import ChargeAction
from smachpy.states import Pose2D
from smachpy.testing import mission_kit
from smachpy.testing.coverage import Coverage
from smachpy.testing.exploring.exploration import RepeatedRun
from smachpy.testing.exploring.explorer import Explorer
from smachpy.testing.exploring.search import ScheduleChoice
from smachpy_missions.course.countdown import countdown
from smachpy_missions.lesson_06_drive import there_and_back
from smachpy_missions.patrol import patrol
from tests.places import ROOT

PATROL = patrol()  # reading the waypoints takes longer than a run
FULL, EMPTY = {"percentage": 1.0}, {"percentage": 0.05}


def run_patrol(mission, battery=(FULL, EMPTY, FULL, FULL)):
    mission.action_server("move_base", MoveBaseAction).default_result(duration=10)
    mission.action_server("charge", ChargeAction).default_result(duration=100)
    mission.topic("battery", BatteryState).publish_every(12.5, battery)
    return mission(PATROL)


def run_countdown(mission):
    return mission(countdown())


def run_there_and_back(mission):
    server = mission.action_server("move_base", MoveBaseAction)
    server.reply(duration=60)
    server.reply(duration=4)
    here = Odometry()
    here.pose.pose.orientation.w = 1.0
    mission.topic("odom", Odometry).publish(here, latch=True)
    return mission(there_and_back())


RUNS = {"patrol": run_patrol, "countdown": run_countdown, "there_and_back": run_there_and_back}


def test_patrol_charges_when_the_battery_is_low(mission):
    run = run_patrol(mission)
    run.assert_outcome("succeeded")
    assert run.outcomes("ROUND") == ("battery_low", "all_visited")
    run.assert_visited("DRIVE_TO_DOCK", "CHARGE")


def test_patrol_gives_up_when_the_way_is_blocked(mission, action_server):
    action_server("move_base", MoveBaseAction).reply(status="aborted")
    mission(patrol()).assert_outcome("aborted")


@pytest.mark.parametrize("state", ["DRIVE", "CHARGE", "DRIVE_TO_DOCK"])
def test_patrol_is_preempted_anywhere(mission, state):
    mission.preempt(on=state, after=1.0)
    run_patrol(mission).assert_outcome("preempted")


@pytest.mark.parametrize("name", RUNS)
def test_every_mission_succeeds(mission, name):
    run = RUNS[name](mission)
    run.assert_outcome("succeeded")
    assert run.goals_left == ()


@pytest.mark.slow
@pytest.mark.timeout(900)  # 200 missions; a minute is too little on a busy computer
@pytest.mark.parametrize("name", RUNS)
def test_a_hundred_seeds_give_the_same_verdict_twice(name):
    def verdict(seed):
        with mission_kit(seed=seed) as mission:
            run = RUNS[name](mission)
            return run.outcome, run.path, run.duration

    first = [verdict(seed) for seed in range(100)]
    assert first == [verdict(seed) for seed in range(100)]
    assert {outcome for outcome, _, _ in first} == {"succeeded"}


def listed():
    """Return name -> place of the missions that `smachpy list` shows, as the project has them."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        points = tomllib.load(file)["project"]["entry-points"]["smachpy.missions"]
    return dict(points)


# What the missions that need arguments are made with.
ARGUMENTS = {
    "rp_action.gotopose": {"robot": "robot_0", "x": 1.0, "y": 2.0},
    "rp_action.stopmove": {"robot": "robot_0"},
    "rp_action.turn": {"client": "robot_0", "angle": 90.0},
}
PROCESSES = {"fleet"}  # its robots are processes of their own, in real time


def make(name):
    """Make the machine of a listed mission."""
    module, _, function = listed()[name].partition(":")
    return getattr(importlib.import_module(module), function)(**ARGUMENTS.get(name, {}))


def dice(seed):
    """Return what chooses outcomes, faults, preempts and turns in an explored run."""
    pick = random.Random(seed).randrange

    def choose(self, where, options, _situation=None, _key=None):
        self.choices.append(
            ScheduleChoice(where, tuple(options), picked := pick(len(options)), None)
        )
        return picked

    return choose


@pytest.mark.slow
@pytest.mark.timeout(900)  # 200 missions; a minute is too little on a busy computer
@pytest.mark.parametrize("name", sorted(listed().keys() - PROCESSES))
def test_a_hundred_dice_give_the_same_run_of_every_mission_twice(name, monkeypatch):
    machine = make(name)

    def verdict(seed):
        monkeypatch.setattr(Explorer, "choose", dice(seed))
        run, error = runner.run(())
        return run.outcome, repr(error), [repr(event) for event in run.events]

    with RepeatedRun("explore", machine, {}) as runner:
        first = [verdict(seed) for seed in range(100)]
        assert [verdict(seed) for seed in range(100)] == first
    assert len({str(events) for _, _, events in first}) > 1


@pytest.mark.parametrize("name", listed())
def test_no_mission_has_problems_that_a_check_finds_in_any_folder(name):
    report = check(make(name))
    report.assert_ok()


def test_whatever_states_return_the_patrol_ends(mission):
    found = mission.explore(PATROL, grace=30, max_time=3600)
    found.assert_ok()
    assert found.exhaustive


def test_whatever_servers_do_the_patrol_ends(mission):
    found = mission.explore(
        PATROL, grace=30, real_actions=True, interleavings=False, max_runs=60, max_time=40
    )
    found.assert_ok()


def test_whatever_happens_the_way_there_and_back_ends(mission):
    mission.explore(there_and_back, max_time=40).assert_ok()
    home = {"/THERE_AND_BACK/REMEMBER": {"home": Pose2D(0.0, 0.0, 0.0)}}
    found = mission.explore(there_and_back, real_actions=True, writes=home, max_runs=60)
    found.assert_ok()


def test_the_countdown_ends_whatever_happens(mission):
    found = mission.explore(countdown, max_time=3600)
    found.assert_ok()
    assert found.exhaustive


def test_the_runs_of_this_file_cover_the_patrol():
    coverage = Coverage()
    for preempted in (None, "DRIVE", "CHARGE", "DRIVE_TO_DOCK", "WATCH_BATTERY"):
        with mission_kit() as mission:
            mission.on_run = coverage.add
            if preempted:
                mission.preempt(on=preempted, after=1.0)
            run_patrol(mission)
    (machine,) = coverage.machines
    assert machine.counts("states") == (10, 10)
    assert machine.counts("preempts") == (4, 4)
