from __future__ import annotations

import math

import pytest

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState, LaserScan
from actionlib_core.time import Time
from smachpy import events as ev
from smachpy.checks import check
from smachpy.exceptions import MissionError
from smachpy.places.occupancy import FREE, load_map
from smachpy.places.pose import quaternion_of
from smachpy.testing import mission_kit
from smachpy_missions.explore.explore import IN_VAIN, explore, pose_at

RAYS = 180


@pytest.fixture
def path(tmp_path):
    return tmp_path / "seen.yaml"


def odometry(x, y, yaw=0.0, at=0.0):
    message = Odometry()
    message.header.stamp = Time.from_sec(at)
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.pose.orientation.z, message.pose.pose.orientation.w = quaternion_of(yaw)[2:]
    return message


def hall(x, y, at=0.0, *, width=12.0, depth=4.0):
    """What a scanner that reaches 3 m sees at (x, y) in an empty hall whose corner is (0, 0)."""
    ranges = []
    for i in range(RAYS):
        dx, dy = math.cos(math.tau * i / RAYS), math.sin(math.tau * i / RAYS)
        along = [(width - x) / dx if dx > 0 else -x / dx] if abs(dx) > 1e-9 else []
        along += [(depth - y) / dy if dy > 0 else -y / dy] if abs(dy) > 1e-9 else []
        ranges.append(min(along) if min(along) < 3.0 else math.inf)
    scan = LaserScan(angle_increment=math.tau / RAYS, range_max=3.0, ranges=ranges)
    scan.header.stamp = Time.from_sec(at)
    return scan


class Hall:
    """A robot in the hall: each goal takes five seconds, then the scanner sees from there."""

    def __init__(self, mission):
        self.odom = mission.topic("odom", Odometry)
        self.scan = mission.topic("scan", LaserScan)
        self.robot = mission.action_server("move_base", MoveBaseAction)
        self.clock = mission.clock
        self.at = (1.5, 2.0)
        self.refuses = lambda x, y: False
        self.silent_after = math.inf
        for _ in range(60):
            self.robot.custom_reply(self.drive)
        self.odom.publish(odometry(*self.at), latch=True)
        self.tick()

    def tick(self):
        """Ten scans a second, as long as the mission runs."""
        if self.clock.now() < self.silent_after:
            now = self.clock.now()
            self.odom.publish(odometry(*self.at, at=now), latch=True)
            self.scan.publish(hall(*self.at, at=now))
            self.timer = self.clock.call_later(0.5, self.tick)

    def drive(self, handle):
        handle.set_accepted()
        goal = handle.get_goal().target_pose.pose.position
        self.clock.sleep(5.0)
        if self.refuses(goal.x, goal.y):
            handle.set_aborted(text="no way")
            return
        self.at = goal.x, goal.y
        self.tick_now()
        self.clock.sleep(0.2)
        handle.set_succeeded()

    def tick_now(self):
        self.timer.cancel()
        self.tick()


@pytest.fixture
def world(mission):
    made = Hall(mission)
    yield made
    made.timer.cancel()


def test_it_looks_everywhere_saves_the_map_and_comes_back(mission, world, path):
    run = mission(explore(path))
    run.assert_outcome("succeeded")
    assert world.at == (1.5, 2.0)
    assert 2 <= run.visits("GO") <= 12
    grid = load_map(path)
    free = (grid.cells == FREE).sum() * grid.resolution**2
    assert free == pytest.approx(12 * 4, rel=0.08)
    assert grid.cells[grid.cell(11.5, 2.0)] == FREE
    last = run.userdata["progress"].text
    assert last.endswith("m² seen")


def test_it_looks_at_as_many_as_it_is_told(mission, world, path):
    run = mission(explore(path, most=1))
    run.assert_outcome("succeeded")
    assert run.visits("GO") == 1
    assert path.exists()


def test_from_a_place_out_of_reach_it_looks_from_another(mission, world, path):
    refused = []

    def refuses(x, y):
        if not refused:
            refused.append((x, y))
        return (x, y) in refused

    world.refuses = refuses
    run = mission(explore(path))
    run.assert_outcome("succeeded")
    assert run.outcomes("GO").count("aborted") == 1
    grid = load_map(path)
    assert grid.cells[grid.cell(11.5, 2.0)] == FREE


def test_when_nothing_can_be_reached_it_comes_back(mission, world, path):
    world.refuses = lambda x, y: x > 1.6
    run = mission(explore(path, smallest=0.3))
    run.assert_outcome("incomplete")
    assert set(run.outcomes("GO")) == {"aborted"}
    assert run.visits("GO") == IN_VAIN


def test_a_scanner_that_falls_silent_ends_the_search(mission, world, path):
    world.silent_after = mission.clock.now() + 3.0
    mission.clock.call_later(1.0, lambda: setattr(world, "tick_now", lambda: None))
    run = mission(explore(path))
    run.assert_outcome("incomplete")
    assert run.outcomes("MAP") == ("blind",)
    assert run.outcomes("COME_BACK") == ("succeeded",)
    assert path.exists()


def test_a_low_battery_ends_the_search(mission, world, path):
    battery = mission.topic("battery", BatteryState)
    battery.publish_at(8.0, BatteryState(percentage=0.19))
    run = mission(explore(path))
    run.assert_outcome("incomplete")
    assert run.outcomes("SEARCH") == ("battery_low",)
    assert run.outcomes("COME_BACK") == ("succeeded",)
    assert path.exists()


def test_a_robot_that_cannot_come_home_says_so(mission, world, path):
    world.refuses = lambda x, y: x == 1.5
    run = mission(explore(path))
    run.assert_outcome("aborted")
    assert run.visits("COME_BACK") == 1
    assert path.exists()


@pytest.mark.parametrize("missing", ["odom", "scan"])
def test_without_pose_or_scan_it_does_not_set_out(mission, path, missing):
    robot = mission.action_server("move_base", MoveBaseAction)
    if missing == "scan":
        mission.topic("odom", Odometry).publish(odometry(1, 1), latch=True)
    mission(explore(path)).assert_outcome("aborted")
    assert not robot.goals


def test_a_scanner_that_sees_nothing_at_all_is_no_scanner(mission, path):
    mission.action_server("move_base", MoveBaseAction)
    mission.topic("odom", Odometry).publish(odometry(1, 1), latch=True)
    broken = LaserScan(angle_increment=0.1, range_max=3.0, ranges=[math.nan] * 60)
    mission.topic("scan", LaserScan).publish_every(0.5, [broken] * 20)
    run = mission(explore(path))
    run.assert_outcome("aborted")
    assert run.outcomes("LOOK_AROUND") == ("invalid",)


def test_a_map_that_cannot_be_written_spoils_no_way_home(mission, world, tmp_path):
    (tmp_path / "file").write_text("in the way")
    run = mission(explore(tmp_path / "file" / "seen.yaml", most=1))
    run.assert_outcome("incomplete")
    assert run.outcomes("SAVE") == ("failed",)
    assert run.outcomes("COME_BACK") == ("succeeded",)


@pytest.mark.parametrize("state", ["LOOK_AROUND", "GO", "COME_BACK"])
def test_a_preempt_stops_it_anywhere(mission, world, path, state):
    mission.preempt(on=state, after=1.0 if state != "LOOK_AROUND" else 0.0)
    run = mission(explore(path, most=1))
    run.assert_outcome("preempted")
    assert [e for e in run.events if isinstance(e, ev.Abandoned)] == []


def test_a_second_run_begins_with_nothing_seen(mission, world, path):
    machine = explore(path, most=2)
    first = mission(machine)
    second = mission(machine)
    assert first.visits("GO") == second.visits("GO") == 2


def test_a_scan_gets_the_pose_of_its_own_time():
    from collections import deque

    poses = deque([odometry(1, 0, at=1.0), odometry(2, 0, at=2.0), odometry(3, 0, at=3.0)])
    assert pose_at(poses, hall(1, 1, at=2.2)).x == 2.0
    assert pose_at(poses, hall(1, 1, at=9.0)).x == 3.0


def test_a_scan_that_comes_before_its_pose_gets_the_one_that_the_twist_leads_to():
    from collections import deque

    latest = odometry(1, 0, at=1.0)
    latest.twist.twist.linear.x, latest.twist.twist.angular.z = 0.5, 1.0
    pose = pose_at(deque([latest]), hall(1, 1, at=1.1))
    assert pose == pytest.approx((1.05, 0.0025, 0.1), abs=1e-4)


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("map_file", "seen.png", "expected a name that ends with .yaml"),
        ("most", -1, "got -1; expected 0"),
        ("smallest", 0.0, "got 0; expected more than 0"),
        ("smallest", math.nan, "got nan; expected more than 0"),
        ("low_battery", 1.0, "got 1; expected 0 or more, less than 1"),
    ],
)
def test_arguments_that_make_no_sense_are_refused(name, value, text):
    with pytest.raises(MissionError, match=text):
        explore(**{name: value})


def test_a_check_finds_no_problems(path):
    report = check(explore(path), name="EXPLORE")
    report.assert_ok()


def comes_back_whenever_it_set_out(run):
    return run.outcome == "preempted" or bool(run.visits("SEARCH")) == bool(run.visits("COME_BACK"))


@pytest.mark.slow
def test_whatever_happens_it_comes_back(mission, path):
    found = mission.explore(
        lambda: explore(path), invariants=[comes_back_whenever_it_set_out], max_runs=150
    )
    found.assert_ok()


@pytest.mark.slow
def test_the_simulated_robot_sees_the_rooms_around_it(simulation, path):
    machine = explore(path, most=3)
    events = []
    machine.subscribe(events.append)
    home = simulation.robot.body.pose
    assert machine.execute() == "succeeded"
    done = [event.status for event in events if isinstance(event, ev.GoalDone)]
    assert done == ["SUCCEEDED"] * 4
    assert simulation.robot.body.pose.distance(home) < 0.1
    seen, real = load_map(path), simulation.world.map
    wrong = 0
    for row, column in zip(*(seen.cells == FREE).nonzero(), strict=True):
        x, y = seen.centre(row, column)
        wrong += real.cells[real.cell(x, y)] != FREE
    assert (seen.cells == FREE).sum() > 3000
    assert wrong < 0.03 * (seen.cells == FREE).sum()


@pytest.mark.parametrize("seed", range(3))
def test_the_same_seed_gives_the_same_search(seed, path):
    def search():
        with mission_kit(seed=seed) as mission:
            world = Hall(mission)
            run = mission(explore(path, most=3))
            world.timer.cancel()
            return (
                run.outcome,
                run.path,
                run.duration,
                [g.target_pose.pose for g in world.robot.goals],
            )

    first = search()
    assert first[0] == "succeeded"
    assert search() == first
