"""Moving things on the floor: other robots and moving obstacles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

    from smachpy.sim.world import World

_ACCELERATION: Final = 1.0  # [m/s^2] of moving obstacles
_STOPPING_DISTANCE: Final = 0.15  # [m] distance at which they stop in front of a robot


class Disc(Protocol):
    """A round thing that moves.

    Attributes:
        name: Its name.
        x: [m], map frame.
        y: [m], map frame.
        radius: [m].
    """

    name: str
    x: float
    y: float
    radius: float


class Mover:
    """A moving obstacle: it walks from place to place in straight lines, and waits for robots.

    Args:
        world: Its floor.
        name: Its name.
        places: Where it walks, (x, y) [m], beginning at the first place.
        radius: [m].
        speed: [m/s].
        loop: Walk from the last place to the first; otherwise back the same way.
    """

    def __init__(
        self,
        world: World,
        name: str,
        places: Sequence[tuple[float, float]],
        *,
        radius: float = 0.3,
        speed: float = 0.8,
        loop: bool = False,
    ) -> None:
        self.name = name
        self.radius = radius
        self.x, self.y = places[0]
        self._world = world
        turned = list(places) if loop else [*places, *reversed(places[1:-1])]
        self._places = turned
        self._next = 1 % len(turned)
        self._top = speed
        self._speed = 0.0
        self._heading = 0.0

    def step(self, dt: float) -> None:
        """Walk for `dt` seconds."""
        if len(self._places) == 1:
            return
        x, y = self._places[self._next]
        left = math.hypot(x - self.x, y - self.y)
        if left > 0.0:
            self._heading = math.atan2(y - self.y, x - self.x)
        room = self._room()
        # v^2 = 2 a s: the speed from which it can stop within the free distance.
        wanted = min(self._top, math.sqrt(2.0 * _ACCELERATION * room))
        self._speed = min(self._speed + _ACCELERATION * dt, wanted)
        way = min(self._speed * dt, left)
        self.x += way * math.cos(self._heading)
        self.y += way * math.sin(self._heading)
        if way >= left:
            self._next = (self._next + 1) % len(self._places)

    def _room(self) -> float:
        """Return how far it can walk straight on before it meets a robot [m]."""
        ux, uy = math.cos(self._heading), math.sin(self._heading)
        far = self._top * self._top / (2.0 * _ACCELERATION) + _STOPPING_DISTANCE
        room = far
        for robot in self._world.robots:
            other = robot.body
            dx, dy = other.x - self.x, other.y - self.y
            reach = other.radius + self.radius + _STOPPING_DISTANCE
            along = dx * ux + dy * uy
            if along <= 0.0 or along > far + reach:
                continue
            beside = abs(dy * ux - dx * uy)
            if beside < reach:
                room = min(room, max(0.0, along - math.sqrt(reach * reach - beside * beside)))
        return room
