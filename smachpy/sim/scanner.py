"""The laser scanner of a robot."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

import numpy as np

from smachpy.places.floor import Obstacle
from smachpy.sim.raycast import cast_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from smachpy.places.floor import Thing
    from smachpy.sim.world import Robot


class Scanner:
    """Measures the distances to walls, obstacles, doors and moving things.

    Args:
        robot: The robot; the scanner is at its centre.

    Attributes:
        first: Angle of the first ray [rad], in the robot's frame.
        step: Angle between two rays [rad].
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._config = config = robot.config.scan
        self.step = config.field / (config.rays - 1)
        self.first = -config.field / 2.0
        self._angles: NDArray[np.float64] = self.first + self.step * np.arange(
            config.rays, dtype=np.float64
        )
        # Seeded with the name: a robot measures the same noise in every run.
        self._random = np.random.default_rng(zlib.crc32(robot.name.encode()))

    def scan(self) -> NDArray[np.float64]:
        """Return the range of each ray [m]; infinite if it meets nothing within its reach."""
        robot, config = self._robot, self._config
        world, body, reach = robot.world, robot.body, config.range_max
        x, y = body.x, body.y
        bearings: NDArray[np.float64] = self._angles + body.yaw
        ranges = world.rays.cast(x, y, bearings, reach)
        things: list[Thing] = [Obstacle(d.x, d.y, d.radius) for d in world.discs if d is not body]
        things = [thing for thing in (*things, *world.obstacles) if thing.gap(x, y) <= reach]
        if things:
            ranges = np.minimum(ranges, cast_at(things, x, y, bearings))
        if config.noise:
            ranges += config.noise * self._random.standard_normal(ranges.size)
        ranges[(ranges > reach) | (ranges < config.range_min)] = np.inf
        return ranges
