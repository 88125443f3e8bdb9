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
    """The rays of one scan that say something, from a place of the map frame.

    Attributes:
        x: Where they begin [m].
        y: Likewise [m].
        angles: Their directions [rad], in the map frame.
        ranges: How far they are free [m].
        hits: bool: whether there is something solid at their end.
    """

    x: float
    y: float
    angles: Floats
    ranges: Floats
    hits: NDArray[np.bool_]

    def ends(self, longest: float) -> tuple[Floats, Floats]:
        """Return where the rays end, x [m] and y [m], none farther than `longest` [m]."""
        ranges = np.minimum(self.ranges, longest)
        return self.x + ranges * np.cos(self.angles), self.y + ranges * np.sin(self.angles)


def rays_of(scan: LaserScan, pose: Pose2D) -> Rays:
    """Return the rays of a scan made at `pose`.

    A range that is infinite, or longer than the scanner reaches, is a ray that met nothing; one
    that is too short or no number says nothing and is left out.
    """
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    angles = pose.yaw + scan.angle_min + scan.angle_increment * np.arange(len(ranges), dtype=float)
    known = ~np.isnan(ranges) & (ranges >= scan.range_min)
    ranges, angles = ranges[known], angles[known]
    hits = ranges < scan.range_max
    return Rays(pose.x, pose.y, angles, np.where(hits, ranges, scan.range_max), hits)
