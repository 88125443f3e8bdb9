"""The robot's body: a unicycle with limited speed and acceleration."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from smachpy.places.pose import Pose2D, wrap_angle

if TYPE_CHECKING:
    from smachpy.places.robot_file import RobotConfig

_STILL = 1e-9  # [m/s, rad/s] below this it counts as standing


class Body:
    """The robot's pose and motion.

    Attributes:
        name: The robot's name.
        radius: [m].
        x: [m], map frame.
        y: [m], map frame.
        yaw: Heading [rad] in [-pi, pi).
        speed: Forward speed [m/s], negative backwards.
        turn_rate: [rad/s], anticlockwise.
    """

    __slots__ = ("_limits", "name", "radius", "speed", "turn_rate", "x", "y", "yaw")

    def __init__(self, limits: RobotConfig, pose: Pose2D, name: str = "robot") -> None:
        self._limits = limits
        self.name = name
        self.radius = limits.radius
        self.x, self.y, self.yaw = pose
        self.speed = 0.0
        self.turn_rate = 0.0

    @property
    def pose(self) -> Pose2D:
        """Its pose."""
        return Pose2D(self.x, self.y, self.yaw)

    @property
    def standing(self) -> bool:
        """Whether it neither drives nor turns."""
        return abs(self.speed) < _STILL and abs(self.turn_rate) < _STILL

    def steer(self, speed: float, turn_rate: float, dt: float) -> None:
        """Move speed and turn rate towards a command, as far as `dt` seconds allow."""
        limits, present = self._limits, self.speed
        speed = _clamp(speed, -limits.max_reverse_speed, limits.max_speed)
        speeding = present * speed >= 0.0 and abs(speed) > abs(present)
        step = (limits.acceleration if speeding else limits.braking) * dt
        self.speed = _clamp(speed, present - step, present + step)
        turn_rate = _clamp(turn_rate, -limits.max_turn_rate, limits.max_turn_rate)
        step = limits.turn_acceleration * dt
        self.turn_rate = _clamp(turn_rate, self.turn_rate - step, self.turn_rate + step)

    def advance(self, dt: float) -> None:
        """Move along the present arc for `dt` seconds."""
        half = 0.5 * self.turn_rate * dt
        heading = self.yaw + half
        length = self.speed * dt
        # It moves along an arc; the straight line between its ends is shorter by sin(h)/h.
        if abs(half) > 1e-6:  # noqa: PLR2004
            length *= math.sin(half) / half
        self.x += length * math.cos(heading)
        self.y += length * math.sin(heading)
        self.yaw = wrap_angle(self.yaw + 2.0 * half)

    def braking_distance(self) -> float:
        """Return the braking distance from the current speed [m]."""
        return self.speed * self.speed / (2.0 * self._limits.braking)


def _clamp(value: float, low: float, high: float) -> float:
    return max(low, min(high, value))
