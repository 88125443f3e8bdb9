"""One drive from here to a goal, as a script: plan, follow, plan again, recover, give up.

`drive_to` is a generator. Each `next` returns the command for one control step; between two of
them the robot has moved. It knows nothing of clocks, threads or actions.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from missions.exceptions import NavigationError
from missions.move_base.follower import Follower, Stage
from missions.move_base.geometry import wrap_angle

if TYPE_CHECKING:
    from collections.abc import Generator

    from missions.move_base.costmap import Costmap
    from missions.move_base.geometry import Pose2D
    from missions.move_base.planner import Point
    from missions.move_base.world import Robot

Command = tuple[float, float]  # speed [m/s], turn rate [rad/s]
STOP: Final[Command] = (0.0, 0.0)
_LOOK_EVERY: Final = 4  # control steps between two looks around
_CREEP_OUT: Final = 0.5  # [m] of a way that may lead out of somewhere too narrow
_LATE_FACTOR: Final = 20.0  # a drive may take so many times its shortest time
_LATE_SECONDS: Final = 60.0  # and this [s] besides
_SEARCH_RATE: Final = 0.7  # share of the turn rate used to look around


def drive_to(robot: Robot, goal: Pose2D) -> Generator[Command]:
    """Yield commands until the robot stands on `goal`.

    Raises:
        NavigationError: the goal cannot be reached, or only after too many recoveries. The robot
            may still be moving then.
    """
    place = (goal.x, goal.y)
    robot.check_place(*place)
    robot.look()
    recoveries = 0
    while True:
        try:
            way = robot.planner.plan((robot.body.x, robot.body.y), place)
        except NavigationError as error:
            if not robot.known_obstacles:
                raise
            trouble = str(error)
        else:
            arrived = yield from _follow(robot, way, goal)
            if arrived:
                return
            if not robot.bumped:
                continue
            trouble = f"bumped into something at ({robot.body.x:.2f}, {robot.body.y:.2f})"
        if recoveries >= robot.config.recovery.attempts:
            raise NavigationError(f"{trouble}; gave up after {recoveries} recoveries")
        recoveries += 1
        yield from _recover(robot)


def brake(robot: Robot) -> Generator[Command]:
    """Yield commands until the robot stands."""
    while not robot.body.standing:
        yield STOP


def _follow(robot: Robot, way: list[Point], goal: Pose2D) -> Generator[Command, None, bool]:
    """Follow a way; whether the goal was reached (else the way is blocked, or it bumped)."""
    follower = Follower(way, goal, robot.config.robot, robot.config.control)
    count, longest = 0, _longest(robot, follower.remaining)
    while count < longest:
        command = follower.command(robot.body)
        if follower.stage is Stage.DONE:
            return True
        yield command
        if robot.bumped:
            return False
        count += 1
        if count % _LOOK_EVERY == 0 and robot.look():
            costmap = robot.planner.costmap
            if not _is_clear(costmap, list(follower.rest())):
                return False
    raise NavigationError(f"no progress: {longest * _dt(robot):.0f} s were not enough for this way")


def _longest(robot: Robot, distance: float) -> float:
    """Return the control steps after which a drive over `distance` metres has gone wrong."""
    limits = robot.config.robot
    seconds = distance / limits.max_speed + 2.0 * math.pi / limits.max_turn_rate
    return (_LATE_FACTOR * seconds + _LATE_SECONDS) / _dt(robot)


def _dt(robot: Robot) -> float:
    return 1.0 / robot.config.control.rate


def _is_clear(costmap: Costmap, way: list[Point]) -> bool:
    """Tell whether the way is free; its beginning may lead out of somewhere too narrow."""
    start = 0
    while start < len(way) - 1 and not costmap.is_free(*way[start]):
        if math.dist(way[0], way[start]) > _CREEP_OUT:
            return False
        start += 1
    return costmap.polyline_is_free(way[start:])


def _recover(robot: Robot) -> Generator[Command]:
    """Stop, back up, turn round once, wait a little, forget what is out of sight."""
    config = robot.config
    yield from brake(robot)
    yield from _back_up(robot)
    yield from brake(robot)
    turned, yaw = 0.0, robot.body.yaw
    while turned < 2.0 * math.pi:
        yield 0.0, _SEARCH_RATE * config.robot.max_turn_rate
        turned += abs(wrap_angle(robot.body.yaw - yaw))
        yaw = robot.body.yaw
    yield from brake(robot)
    for _ in range(round(config.recovery.patience * config.control.rate)):
        yield STOP
    robot.forget()


def _back_up(robot: Robot) -> Generator[Command]:
    """Drive back, as far as set and as long as there is room behind."""
    body, distance = robot.body, robot.config.recovery.back_up
    x, y = body.x, body.y
    costmap, radius = robot.planner.costmap, robot.config.robot.radius
    while math.hypot(body.x - x, body.y - y) + body.braking_distance() < distance:
        behind_x = body.x - radius * math.cos(body.yaw)
        behind_y = body.y - radius * math.sin(body.yaw)
        if costmap.touches(behind_x, behind_y):
            return
        yield -robot.config.robot.max_reverse_speed, 0.0
        if robot.bumped:
            return
