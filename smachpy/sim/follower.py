"""Follows a way: turn towards it, drive along it, stop at the goal, turn to its heading."""

from __future__ import annotations

import bisect
import math
from enum import Enum, auto
from typing import TYPE_CHECKING, Final

import numpy as np

from smachpy.places.pose import wrap_angle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from smachpy.places.pose import Pose2D
    from smachpy.places.robot_file import ControlConfig, RobotConfig
    from smachpy.sim.body import Body

    Floats = NDArray[np.float64]

_CREEP: Final = 0.06  # [m/s] slowest approach, so that the goal is reached in finite time
_CREEP_TURN: Final = 0.08  # [rad/s] the same for the last turn
_FACING: Final = 0.15  # [rad] a turn on the spot ends this close to the way's heading
_SHARE: Final = 0.8  # fraction of the braking and turning power that the plan counts on
_TINY: Final = 1e-3  # [m] smallest distance to the target point: no division by zero
_REACHED: Final = 0.02  # [m] a closer target point gives no direction
_STRAIGHT: Final = 1e-4  # [1/m] less curvature than this needs no slowing down
_BEND_REACH: Final = 4  # points on each side over which a bend is measured


class Stage(Enum):
    """The stages of following a way."""

    TURN = auto()  # on the spot, towards the way
    DRIVE = auto()
    BRAKE = auto()  # at the goal
    FACE = auto()  # on the spot, to the goal's heading
    DONE = auto()


class Follower:
    """Computes commands from the position of a body on one way.

    Source of the steering law: R. C. Coulter, "Implementation of the Pure Pursuit Path Tracking
    Algorithm", CMU-RI-TR-92-01.

    Attributes:
        stage: The current stage.
        points: The way, (x, y) [m].
        robot: The robot's limits.
        control: The control parameters.
    """

    def __init__(
        self,
        points: Sequence[tuple[float, float]],
        goal: Pose2D,
        robot: RobotConfig,
        control: ControlConfig,
    ) -> None:
        self.points = points
        self.stage = Stage.DRIVE
        self._goal = goal
        self.robot = robot
        self.control = control
        self._at = 0  # index of the nearest point
        self._ahead = 0  # index of the point steered to
        self._xy: Floats = np.array(points, dtype=np.float64)
        self._along = _lengths(self._xy)
        self._lengths: list[float] = self._along.tolist()
        self._stopping = 2.0 * _SHARE * robot.braking
        self._fastest_turn = _SHARE * robot.max_turn_rate
        self._limits: list[float] = _speed_limits(self._xy, self._along, robot).tolist()

    @property
    def remaining(self) -> float:
        """Distance left [m] along the way."""
        return self._lengths[-1] - self._lengths[self._at]

    def rest(self, distance: float = math.inf) -> Sequence[tuple[float, float]]:
        """Return the points ahead, for the next `distance` metres."""
        end = bisect.bisect_right(self._lengths, self._lengths[self._at] + distance)
        return self.points[self._at : end]

    def ahead(self, distance: float) -> tuple[Floats, Floats]:
        """Return the points (n, 2) of the next `distance` metres, with their distances [m]."""
        here = self._lengths[self._at]
        end = bisect.bisect_right(self._lengths, here + distance)
        return self._xy[self._at : end], self._along[self._at : end] - here

    def command(self, body: Body) -> tuple[float, float]:
        """Return the next speed [m/s] and turn rate [rad/s]; may change the stage."""
        stage = self.stage
        # Faster than a set: this runs at every step.
        if stage is Stage.DRIVE or stage is Stage.TURN:
            return self._go(body)
        if stage is Stage.BRAKE:
            if not body.standing:
                return 0.0, 0.0
            self.stage = Stage.FACE
        if self.stage is Stage.FACE:
            error = wrap_angle(self._goal.yaw - body.yaw)
            if abs(error) > self.control.yaw_tolerance / 2.0:
                return 0.0, self._turn(error)
            if body.standing:
                self.stage = Stage.DONE
        return 0.0, 0.0

    def _go(self, body: Body) -> tuple[float, float]:
        x, y = body.x, body.y
        self._progress(x, y)
        left = math.hypot(self._goal.x - x, self._goal.y - y)
        if left < self.control.xy_tolerance / 2.0 or self._overshot(x, y, left):
            self.stage = Stage.BRAKE
            return 0.0, 0.0
        target_x, target_y = self.points[self._look(body.speed)]
        distance = math.hypot(target_x - x, target_y - y)
        if distance < _REACHED and self._ahead < len(self.points) - 1:
            # The way returns to this place: skip the bend, whose both ends are here.
            self._at = self._ahead
            return self._go(body)
        error = wrap_angle(math.atan2(target_y - y, target_x - x) - body.yaw)
        if self._must_turn(error):
            return 0.0, self._turn(error)
        speed = min(self._limits[self._at], math.sqrt(self._stopping * left))
        speed = max(speed, _CREEP)
        # Pure pursuit: the arc through the target point has the curvature 2 sin(error) / distance.
        turn_rate = speed * 2.0 * math.sin(error) / max(_TINY, distance)
        most = self._fastest_turn
        if turn_rate > most or turn_rate < -most:
            speed *= most / abs(turn_rate)
            turn_rate = math.copysign(most, turn_rate)
        return speed, turn_rate

    def _must_turn(self, error: float) -> bool:
        """Return whether the heading is so wrong that it has to turn on the spot.

        Two thresholds: with one, it would switch back and forth between turning and driving.
        """
        if self.stage is Stage.TURN:
            if abs(error) < _FACING:
                self.stage = Stage.DRIVE
        elif abs(error) > self.control.turn_on_spot:
            self.stage = Stage.TURN
        return self.stage is Stage.TURN

    def _turn(self, error: float) -> float:
        """Return the turn rate for a turn by `error` [rad] that ends at rest (w^2 = 2 a phi)."""
        rate = math.sqrt(2.0 * _SHARE * self.robot.turn_acceleration * abs(error)) * _SHARE
        return math.copysign(max(_CREEP_TURN, min(rate, self.robot.max_turn_rate)), error)

    def _progress(self, x: float, y: float) -> None:
        """Move the nearest point forward, never back: ways may cross themselves."""
        points, at = self.points, self._at
        px, py = points[at]
        best = (px - x) ** 2 + (py - y) ** 2
        last = len(points) - 1
        while at < last:
            px, py = points[at + 1]
            distance = (px - x) ** 2 + (py - y) ** 2
            if distance > best:
                break
            at, best = at + 1, distance
        self._at = at

    def _look(self, speed: float) -> int:
        """Return the index of the point to steer to."""
        control = self.control
        reach = self._lengths[self._at] + max(
            control.lookahead_min, abs(speed) * control.lookahead_time
        )
        ahead, last = max(self._ahead, self._at), len(self.points) - 1
        while ahead < last and self._lengths[ahead] < reach:
            ahead += 1
        self._ahead = ahead
        return ahead

    def _overshot(self, x: float, y: float, left: float) -> bool:
        """Return whether it is at the end of the way and the goal is no longer ahead."""
        last = len(self.points) - 1
        if self._at < last or left > self.control.xy_tolerance or last == 0:
            return False
        (px, py), (qx, qy) = self.points[max(0, last - _BEND_REACH)], self.points[last]
        return (qx - x) * (qx - px) + (qy - y) * (qy - py) <= 0.0


def _lengths(points: Floats) -> Floats:
    """Return the distance [m] along the way from its start to each point."""
    steps = np.diff(points, axis=0)
    return np.concatenate(([0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))))


def _speed_limits(points: Floats, lengths: Floats, robot: RobotConfig) -> Floats:
    """Return the fastest speed [m/s] at each point: slow in bends, braking before them."""
    squares = np.full(len(points), robot.max_speed**2)
    if len(points) > 2 * _BEND_REACH:
        bends = _bends(points)
        in_bends = _SHARE * robot.max_turn_rate / np.maximum(bends, _STRAIGHT)
        inner = squares[_BEND_REACH:-_BEND_REACH]
        np.minimum(inner, in_bends * in_bends, out=inner, where=bends > _STRAIGHT)
    squares[-1] = 0.0
    # It must be able to brake for every point ahead: v^2 <= v_ahead^2 + 2 a (distance).
    braking = 2.0 * _SHARE * robot.braking
    energy = np.minimum.accumulate((squares + braking * lengths)[::-1])[::-1]
    limits: Floats = np.sqrt(np.maximum(energy - braking * lengths, 0.0))
    return limits


def _bends(points: Floats) -> Floats:
    """Return the curvature at each point except the first and last few [1/m]."""
    u = points[_BEND_REACH:-_BEND_REACH] - points[: -2 * _BEND_REACH]
    v = points[2 * _BEND_REACH :] - points[_BEND_REACH:-_BEND_REACH]
    # The circle through three points has the curvature 4 area / (product of the three sides);
    # `area` here is twice that of the triangle.
    w = u + v
    product = np.sqrt((u * u).sum(axis=1) * (v * v).sum(axis=1) * (w * w).sum(axis=1))
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    bends: Floats = np.zeros(len(area))
    np.divide(2.0 * area, product, out=bends, where=product > 0.0)
    return bends
