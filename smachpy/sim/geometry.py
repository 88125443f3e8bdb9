"""Poses and angles in the plane."""

from __future__ import annotations

import argparse
import math
from typing import Final, NamedTuple

from smachpy.userdata.kept_types import register_type

_TAU = 2.0 * math.pi


@register_type
class Pose2D(NamedTuple):
    """A place and a heading.

    Attributes:
        x: [m].
        y: [m].
        yaw: Heading [rad], anticlockwise from the x axis.
    """

    x: float
    y: float
    yaw: float

    def then(self, step: Pose2D) -> Pose2D:
        """Return `step`, given in this pose's own frame, in the frame this pose is given in."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2D(
            self.x + c * step.x - s * step.y,
            self.y + s * step.x + c * step.y,
            wrap_angle(self.yaw + step.yaw),
        )

    def distance(self, other: Pose2D) -> float:
        """Return the straight distance [m] between the two places."""
        return math.hypot(other.x - self.x, other.y - self.y)


ORIGIN: Final = Pose2D(0.0, 0.0, 0.0)


def wrap_angle(angle: float) -> float:
    """Return `angle` [rad] turned by whole circles into [-pi, pi)."""
    return (angle + math.pi) % _TAU - math.pi


def yaw_of(x: float, y: float, z: float, w: float) -> float:
    """Return the heading [rad] of a quaternion, whose length need not be one."""
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def quaternion_of(yaw: float) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of a heading [rad]."""
    return 0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)


def finite(text: str) -> float:
    """Read a number of the command line that is neither infinite nor none at all.

    Raises:
        argparse.ArgumentTypeError: it is not.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"got {text!r}; expected a finite number")
    return value
