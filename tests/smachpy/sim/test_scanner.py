from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
from actionlib_core.pubsub.topic import Subscriber
from smachpy.places.pose import Pose2D
from smachpy.sim.scanner import Scanner
from smachpy.sim.world import Robot, World

CORRIDOR = Pose2D(9.0, 7.7, 0.0)


@pytest.fixture
def world(office):
    return World(office)


@pytest.fixture
def robot(world, office_robot):
    return Robot(world, office_robot, CORRIDOR, 0.0, "robot_0")


def at(robot, degrees):
    """The range at a bearing of the robot's frame."""
    scanner = Scanner(robot)
    ranges = scanner.scan()
    return ranges[round((math.radians(degrees) - scanner.first) / scanner.step)]


def test_it_measures_the_walls_of_the_corridor(robot):
    assert at(robot, -90) == pytest.approx(7.7 - 6.7, abs=0.06)
    assert at(robot, 0) == math.inf
    robot.body.x = 8.2  # no door on the other side
    assert at(robot, 90) == pytest.approx(8.7 - 7.7, abs=0.06)


def test_it_measures_obstacles_robots_and_closed_doors(world, robot, office_robot):
    world.add_obstacle(11.0, 7.7, 0.3)
    assert at(robot, 0) == pytest.approx(1.7)
    Robot(world, office_robot, Pose2D(10.2, 7.7, 0), 0.0, "robot_1")
    assert at(robot, 0) == pytest.approx(0.95)
    walker = world.add_mover("visitor", [(9.8, 7.7)], radius=0.2)
    assert at(robot, 0) == pytest.approx(0.6)
    walker.y += 1.0
    assert at(robot, 0) == pytest.approx(0.95)
    through = at(robot, 90)
    assert through > 2.0
    world.add_door("meeting", (8.5, 8.8, 9.5, 8.8))
    assert at(robot, 90) == pytest.approx(8.8 - 7.7 - 0.05)


def test_noise_is_the_same_in_every_run(world, office_robot):
    noisy = replace(office_robot, scan=replace(office_robot.scan, noise=0.02))
    robot = Robot(world, noisy, CORRIDOR, 0.0, "robot_0")
    first, second = Scanner(robot), Scanner(robot)
    ranges = first.scan()
    assert np.array_equal(ranges, second.scan())
    assert not np.array_equal(ranges, first.scan())
    robot.config = office_robot
    exact = Scanner(robot).scan()
    seen = np.isfinite(ranges) & np.isfinite(exact)
    assert np.std(ranges[seen] - exact[seen]) == pytest.approx(0.02, rel=0.3)


def test_scans_are_published_while_somebody_listens(clock, simulation, monkeypatch):
    scans, count = [], []
    scan = Scanner.scan
    monkeypatch.setattr(Scanner, "scan", lambda self: count.append(1) or scan(self))
    clock.sleep(10.0)
    assert count == []
    with Subscriber("scan", LaserScan, scans.append):
        clock.sleep(4.0)
    assert len(scans) == pytest.approx(4.0 * 5.0, abs=4)
    taken = len(count)
    clock.sleep(10.0)
    assert len(count) <= taken + 1
    message = scans[-1]
    assert message.header.frame_id == "base_link"
    assert len(message.ranges) == 271
    assert message.angle_min == pytest.approx(-math.radians(135), abs=1e-4)
    last = message.angle_min + 270 * message.angle_increment
    assert message.angle_max == pytest.approx(last, abs=1e-4)
    assert (message.range_min, message.range_max) == pytest.approx((0.05, 8.0))
    assert all(0.05 <= r <= 8.0 or math.isinf(r) for r in message.ranges)
