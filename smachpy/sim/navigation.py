"""One drive to a goal, as a script: plan, follow, plan again, recover, give up.

`drive_to` is a generator. Each `next` returns the command for one control step; between two calls
the robot has moved. It is independent of clocks, threads and actions.
"""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import TYPE_CHECKING, Final

from smachpy.places.exceptions import NavigationError
from smachpy.places.pose import Pose2D, wrap_angle
from smachpy.sim.follower import Follower, Stage
from smachpy.sim.planner import keep_right

if TYPE_CHECKING:
    from collections.abc import Generator

    from smachpy.sim.costmap import Costmap
    from smachpy.sim.planner import Point
    from smachpy.sim.world import Robot

Command = tuple[float, float]  # speed [m/s], turn rate [rad/s]
STOP: Final[Command] = (0.0, 0.0)
_LOOK_EVERY: Final = 4  # control steps between two looks around
_CREEP_OUT: Final = 0.5  # [m] at the start of a way may lead out of a place that is too narrow
_LATE_FACTOR: Final = 20.0  # a drive may take this many times its shortest time
_LATE_SECONDS: Final = 60.0  # [s] and this much more
_SEARCH_RATE: Final = 0.7  # fraction of the turn rate used to look around
_HEED: Final = 1.5  # [m] beyond the braking distance: within this, others on the way matter
_STOPPING_DISTANCE: Final = 0.1  # [m] distance at which it stops in front of others
_NO_CREEPING: Final = 0.03  # [m] with less space than this beyond that distance it stays
_SHARE: Final = 0.8  # fraction of the braking power that is counted on
_RETHINK: Final = 0.5  # [s] between two searches for a way around others
_HOLD: Final = 1.0  # [s] it waits in front of others before it tries something else
_CLOSER: Final = 1e-3  # [m] a point is a meeting only if it is closer than now: see `_gap`
_PROGRESS: Final = 1.0  # [m] after this way, being held up counts as new
_APPROACHES: Final = 5  # to one goal, before the robot recovers and tries again
_YIELD_WAIT: Final = 6.0  # [s] it waits at most where it has made space


class DriveEnd(Enum):
    """The end of following a way."""

    ARRIVED = auto()
    CHANGED = auto()  # a standing thing blocks the way
    BUMPED = auto()
    HELD = auto()  # another robot or moving thing is in the way


def drive_to(robot: Robot, goal: Pose2D) -> Generator[Command]:
    """Yield commands until the robot stands at `goal`.

    Raises:
        NavigationError: the goal cannot be reached, or not within the allowed recoveries. The
            robot may still be moving then.
    """
    try:
        yield from _drive_to(robot, goal)
    finally:
        robot.follower = None


def _drive_to(robot: Robot, goal: Pose2D) -> Generator[Command]:
    robot.check_place(goal.x, goal.y)
    robot.set_out()
    robot.look()
    recoveries, patience = 0, _Patience(robot)
    while True:
        trouble = yield from _try(robot, goal, patience)
        if trouble == "":
            return
        if trouble is None:
            continue
        if recoveries >= robot.config.recovery.attempts:
            raise NavigationError(f"{trouble}; gave up after {recoveries} recoveries")
        recoveries += 1
        yield from _recover(robot)


def _try(robot: Robot, goal: Pose2D, patience: _Patience) -> Generator[Command, None, str | None]:
    """Plan a way and follow it.

    Returns:
        "" on arrival, None to try another way at once, else the error.
    """
    try:
        way = robot.planner.plan((robot.body.x, robot.body.y), (goal.x, goal.y))
    except NavigationError as error:
        if not robot.known_obstacles:
            raise
        doors = robot.closed_doors()
        return f"{error}; closed: {doors}" if doors else str(error)
    # Only with others around: the middle of a corridor is the best way for a single robot.
    if len(robot.world.robots) > 1:
        way = keep_right(robot.planner.costmap, way)
    end = yield from _follow(robot, way, goal)
    if end is DriveEnd.ARRIVED:
        return patience.approached(goal)
    if end is DriveEnd.BUMPED:
        return f"bumped into something at ({robot.body.x:.2f}, {robot.body.y:.2f})"
    trouble = patience.trouble() if end is DriveEnd.HELD else ""
    if end is DriveEnd.HELD and not trouble:
        yield from _give_way(robot)
    return trouble or None


def brake(robot: Robot) -> Generator[Command]:
    """Yield commands until the robot stands still."""
    while not robot.body.standing:
        yield STOP


class _Patience:
    """Decides when a robot has waited long enough for others, and approached its goal enough."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._approaches = 0
        self._since = 0.0
        self._odometer = -math.inf

    def approached(self, goal: Pose2D) -> str | None:
        """Return "" if the robot stands at the goal, None to approach it again, else the error.

        A robot that is told in full speed to stop where it is brakes behind the goal.
        """
        self._approaches += 1
        beside = self._robot.body.pose.distance(goal)
        if beside <= self._robot.config.control.xy_tolerance:
            return ""
        if self._approaches < _APPROACHES:
            return None
        self._approaches = 0
        return f"stopped {beside:.2f} m beside the goal"

    def trouble(self) -> str:
        """Return what has been in the way for too long; else ""."""
        robot = self._robot
        if robot.odometer - self._odometer > _PROGRESS:
            self._since, self._odometer = robot.now, robot.odometer
        if robot.now - self._since < robot.config.recovery.traffic_patience:
            return ""
        self._odometer = -math.inf
        who = robot.held_by
        assert who is not None
        return f"{who.name} stands in the way at ({who.x:.2f}, {who.y:.2f})"


def _follow(
    robot: Robot, way: list[Point], goal: Pose2D, *, asked: bool = False
) -> Generator[Command, None, DriveEnd]:
    """Follow a way, and drive around others on it if there is space.

    Args:
        robot: The robot.
        way: The way.
        goal: Its end, with the heading there.
        asked: Whether the robot is making space, and therefore ignores other requests.
    """
    follower = Follower(way, goal, robot.config.robot, robot.config.control)
    count, longest, dt = 0, _longest(robot, follower.remaining), _dt(robot)
    gap, think, held = math.inf, -math.inf, 0.0
    while count < longest:
        robot.follower = follower
        speed, turn_rate = follower.command(robot.body)
        if follower.stage is Stage.DONE:
            return DriveEnd.ARRIVED
        if robot.traffic or gap < math.inf:
            # Measured at every second step and estimated in between, to save time.
            gap = _gap(robot, follower) if count % 2 == 0 else gap - abs(robot.body.speed) * dt
            if gap < math.inf and robot.now > think:
                around = _around(robot, follower)
                think = robot.now + (_RETHINK if around else 2.0 * _RETHINK)
                if around:
                    follower, gap = (
                        Follower(around, goal, follower.robot, follower.control),
                        math.inf,
                    )
                    continue
            speed = min(speed, _safe_speed(robot, gap))
            held = held + dt if speed == 0.0 and gap < math.inf else 0.0
            if held > _HOLD or (held and not asked and robot.asked_by() is not None):
                return DriveEnd.HELD
        yield speed, turn_rate
        if robot.bumped:
            return DriveEnd.BUMPED if robot.held_by is None else DriveEnd.HELD
        count += 1
        if count % _LOOK_EVERY == 0 and robot.look():
            costmap = robot.planner.costmap
            if not _is_clear(costmap, list(follower.rest())):
                return DriveEnd.CHANGED
    raise NavigationError(f"no progress: {longest * _dt(robot):.0f} s were not enough for this way")


def _gap(robot: Robot, follower: Follower) -> float:
    """Return how far along the way it can go before it meets others [m], and note whom.

    Infinite if nobody is close enough to matter, or if it only drives away from them.
    """
    body, margin = robot.body, robot.config.planner.margin
    far = body.braking_distance() + _HEED
    robot.held_by = None
    near = [
        (seen, now, seen.radius + body.radius + margin)
        for seen in robot.traffic.values()
        if (now := math.hypot(seen.x - body.x, seen.y - body.y)) < far + _HEED
    ]
    if not near:
        return math.inf
    points, lengths = follower.ahead(far)
    found = math.inf
    for seen, now, reach in near:
        # Points that are no closer to the other than the robot is now do not count: it is only
        # driving away from it.
        dx, dy = points[:, 0] - seen.x, points[:, 1] - seen.y
        meets = dx * dx + dy * dy < min(reach, now - _CLOSER) ** 2
        first = int(meets.argmax())
        if meets[first] and lengths[first] < found:
            found, robot.held_by = float(lengths[first]), seen
    return found


def _around(robot: Robot, follower: Follower) -> list[Point] | None:
    place = (robot.body.x, robot.body.y)
    return robot.planner.around(place, follower.rest(), robot.traffic.values())


def _safe_speed(robot: Robot, gap: float) -> float:
    """Return the speed from which it can stop within a gap [m] (v^2 = 2 a s)."""
    if math.isinf(gap):
        return gap
    if gap < _STOPPING_DISTANCE + _NO_CREEPING:
        return 0.0
    return math.sqrt(2.0 * _SHARE * robot.config.robot.braking * (gap - _STOPPING_DISTANCE))


def _give_way(robot: Robot) -> Generator[Command]:
    """Make space if asked to, else ask the robot in the way; wait a moment."""
    yield from brake(robot)
    other = robot.asked_by()
    if other is not None:
        yield from _make_room(robot, other)
        return
    robot.ask_for_room()
    yield from _stand(robot, _RETHINK)
    robot.look()


def _make_room(robot: Robot, other: Robot) -> Generator[Command]:
    """Leave another robot's way and wait until it has passed."""
    here = (robot.body.x, robot.body.y)
    clearance = other.body.radius + robot.planner.costmap.radius + _STOPPING_DISTANCE
    robot.look()
    way = robot.planner.refuge(here, other.ahead(), clearance, robot.traffic.values())
    if way is not None:
        yield from _follow(robot, way, Pose2D(*way[-1], robot.body.yaw), asked=True)
        yield from brake(robot)
    robot.follower = None
    until = robot.now + _YIELD_WAIT
    while robot.now < until and _comes_near(other, here, clearance):
        yield from _stand(robot, _RETHINK)


def _comes_near(other: Robot, place: Point, clearance: float) -> bool:
    return any(math.dist(point, place) < clearance for point in other.ahead())


def _stand(robot: Robot, seconds: float) -> Generator[Command]:
    for _ in range(max(1, round(seconds * robot.config.control.rate))):
        yield STOP


def _longest(robot: Robot, distance: float) -> float:
    """Return the number of control steps after which a drive over `distance` metres fails."""
    limits = robot.config.robot
    seconds = distance / limits.max_speed + 2.0 * math.pi / limits.max_turn_rate
    return (_LATE_FACTOR * seconds + _LATE_SECONDS) / _dt(robot)


def _dt(robot: Robot) -> float:
    return 1.0 / robot.config.control.rate


def _is_clear(costmap: Costmap, way: list[Point]) -> bool:
    """Return whether the way is free; its start may lead out of a place that is too narrow."""
    start = 0
    while start < len(way) - 1 and not costmap.is_free(*way[start]):
        if math.dist(way[0], way[start]) > _CREEP_OUT:
            return False
        start += 1
    return costmap.polyline_is_free(way[start:])


def _recover(robot: Robot) -> Generator[Command]:
    """Stop, back up, turn once around, wait a little, forget things that are out of sight."""
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
    yield from _stand(robot, config.recovery.patience)
    robot.forget()


def _back_up(robot: Robot) -> Generator[Command]:
    """Drive back by the configured distance, while there is space behind."""
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
