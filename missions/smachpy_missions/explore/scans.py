"""Laser scans in the map frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
    from smachpy.states import Pose2D

    Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Rays:
    """The valid rays of one scan, in the map frame.

    Attributes:
        x: Origin of the rays [m].
        y: Origin of the rays [m].
        angles: Their directions [rad].
        ranges: Their free lengths [m].
        hits: Whether each ray ends at an obstacle.
    """

    x: float
    y: float
    angles: Floats
    ranges: Floats
    hits: NDArray[np.bool_]

    def ends(self, longest: float) -> tuple[Floats, Floats]:
        """Return the end points of the rays, x [m] and y [m], at most `longest` [m] away."""
        ranges = np.minimum(self.ranges, longest)
        return self.x + ranges * np.cos(self.angles), self.y + ranges * np.sin(self.angles)


def rays_of(scan: LaserScan, pose: Pose2D) -> Rays:
    """Return the rays of a scan made at `pose`.

    A range that is infinite, or beyond the scanner's maximum, is a ray without an obstacle; ranges
    that are too short or NaN are invalid and left out.
    """
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    angles = pose.yaw + scan.angle_min + scan.angle_increment * np.arange(len(ranges), dtype=float)
    known = ~np.isnan(ranges) & (ranges >= scan.range_min)
    ranges, angles = ranges[known], angles[known]
    hits = ranges < scan.range_max
    return Rays(pose.x, pose.y, angles, np.where(hits, ranges, scan.range_max), hits)
