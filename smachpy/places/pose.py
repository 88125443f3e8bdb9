"""Poses and angles in the plane."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from smachpy.userdata.kept_types import REGISTERED, name_of, register_type

_TAU = 2.0 * math.pi


@register_type
class Pose2D(NamedTuple):
    """A position and a heading.

    Attributes:
        x: [m].
        y: [m].
        yaw: Heading [rad], anticlockwise from the x axis.
    """

    x: float
    y: float
    yaw: float

    def then(self, step: Pose2D) -> Pose2D:
        """Return `step`, given relative to this pose, in the frame of this pose."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2D(
            self.x + c * step.x - s * step.y,
            self.y + s * step.x + c * step.y,
            wrap_angle(self.yaw + step.yaw),
        )

    def distance(self, other: Pose2D) -> float:
        """Return the straight distance between the two positions [m]."""
        return math.hypot(other.x - self.x, other.y - self.y)


REGISTERED["smachpy.sim.geometry:Pose2D"] = REGISTERED[name_of(Pose2D)]  # in journals of 0.1

ORIGIN: Final = Pose2D(0.0, 0.0, 0.0)


def wrap_angle(angle: float) -> float:
    """Return `angle` [rad] wrapped to [-pi, pi)."""
    return (angle + math.pi) % _TAU - math.pi


def yaw_of(x: float, y: float, z: float, w: float) -> float:
    """Return the heading of a quaternion [rad], which need not be normalised."""
    largest = max(abs(x), abs(y), abs(z), abs(w)) or 1.0  # the square of 1e200 would be infinite
    x, y, z, w = x / largest, y / largest, z / largest, w / largest
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def quaternion_of(yaw: float) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of a heading [rad]."""
    return 0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)
