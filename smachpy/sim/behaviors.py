"""Nav2's behaviors that need no map: turn on the spot, back up. Scripts as in `navigation`.

Each `next` returns the command for one control step; the script returns an error text, "" for none.
The robot stands still then.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from smachpy.places.pose import wrap_angle
from smachpy.sim.navigation import brake

if TYPE_CHECKING:
    from collections.abc import Generator

    from smachpy.sim.navigation import Command
    from smachpy.sim.world import Robot

_SHARE: Final = 0.8  # fraction of the braking power that is counted on
_SLOWEST_TURN: Final = 0.05  # [rad/s]
_DISTANCE_BEHIND: Final = 0.1  # [m] distance to things behind


def spin(robot: Robot, angle: float) -> Generator[Command, None, str]:
    """Turn by `angle` [rad] on the spot, anticlockwise if positive; several turns are possible."""
    body, limits = robot.body, robot.config.robot
    turned, yaw = 0.0, body.yaw
    while abs(angle - turned) > robot.config.control.yaw_tolerance / 2.0:
        left = angle - turned
        # w^2 = 2 a phi: the turn rate from which it can stop within the remaining angle.
        rate = math.sqrt(2.0 * _SHARE * limits.turn_acceleration * abs(left)) * _SHARE
        yield 0.0, math.copysign(max(_SLOWEST_TURN, min(rate, limits.max_turn_rate)), left)
        turned += wrap_angle(body.yaw - yaw)
        yaw = body.yaw
    yield from brake(robot)
    return ""


def back_up(robot: Robot, distance: float, speed: float) -> Generator[Command, None, str]:
    """Drive `distance` [m] backwards at `speed` [m/s] at most, while there is space behind."""
    body = robot.body
    x, y = body.x, body.y
    trouble = ""
    while math.hypot(body.x - x, body.y - y) + body.braking_distance() < distance:
        room = robot.room((-speed, 0.0), _DISTANCE_BEHIND)
        if robot.bumped or room < body.braking_distance() + _DISTANCE_BEHIND:
            driven = math.hypot(body.x - x, body.y - y)
            trouble = f"something is in the way {room:.2f} m behind, after {driven:.2f} m"
            break
        yield -speed, 0.0
    yield from brake(robot)
    return trouble
