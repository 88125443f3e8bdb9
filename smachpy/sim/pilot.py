"""Decides on a robot's next command: an override, the drive to its goal, or a stop."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Final

from smachpy.places.exceptions import NavigationError
from smachpy.sim.navigation import STOP, brake, drive_to

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from smachpy.places.pose import Pose2D
    from smachpy.sim.navigation import Command
    from smachpy.sim.world import Robot

_LOOKED_AHEAD: Final = 0.15  # [m] beyond the braking distance, when driven by hand
_BATTERY_EVERY: Final = 4  # steps between two checks of the battery
_SHARE: Final = 0.8  # fraction of the braking power that is counted on


class Pilot:
    """Steers one robot, one control step at a time.

    An override (driving by hand) has priority over the drive to a goal, which waits and is planned
    again from where the override left the robot. A robot without an order brakes.

    Threads: none of its own; the owner serialises the calls with its lock.

    Attributes:
        robot: The robot.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._script: Generator[Command, None, str] | None = None
        self._goal: Pose2D | None = None
        self._done: Callable[[str], object] | None = None
        self._ended: list[Callable[[], object]] = []
        self._override: Command = STOP
        self._override_until = -math.inf
        self._plan_anew = False
        self._now = -math.inf

    # -- orders --------------------------------------------------------------------------------

    def drive(self, goal: Pose2D, done: Callable[[str], object]) -> None:
        """Drive to `goal` instead of the current order, whose end is not reported.

        Args:
            goal: In the map frame.
            done: Called once at the end, by `take_ends`, with an error text; "" for none.
        """
        self._goal, self._done = goal, done
        self._script, self._plan_anew = self._journey(goal), False

    def run(self, script: Generator[Command, None, str], done: Callable[[str], object]) -> None:
        """Follow a script of commands instead of the current order; arguments as for `drive`.

        Args:
            script: Yields a command for each control step; returns an error text, "" for none.
            done: As for `drive`.
        """
        self._goal, self._done = None, done
        self._script, self._plan_anew = script, False

    def stop(self, done: Callable[[str], object]) -> None:
        """Brake instead of the current order; `done("")` is called when the robot stands."""
        self.run(self._halt(), done)

    def let_go(self) -> None:
        """Drop the current order without a report; the robot brakes unless it gets a new one."""
        self._goal = self._done = self._script = None

    def override(self, now: float, command: Command) -> None:
        """Drive by hand from `now` [s] on, for `override_time` seconds."""
        self._override = command
        self._override_until = now + self.robot.config.control.override_time

    def plan_anew(self) -> None:
        """Plan the way to the goal again, with what the robot knows now."""
        self._plan_anew = self._goal is not None

    # -- steps ---------------------------------------------------------------------------------

    def is_busy(self, now: float) -> bool:
        """Return whether steps would change anything."""
        return (
            self._script is not None or now < self._override_until or not self.robot.body.standing
        )

    def step(self, now: float, dt: float) -> None:
        """Drive from `now` [s] on for `dt` seconds."""
        self._now = now
        self.robot.step(now, dt, self._command(now))

    def take_ends(self) -> list[Callable[[], object]]:
        """Return the callbacks of orders that have ended; to be called without a lock."""
        ended, self._ended = self._ended, []
        return ended

    def _command(self, now: float) -> Command:
        if now < self._override_until:
            if self._goal is None:
                self._end(
                    ""
                )  # an order to stop is over: the override decides now when the robot stands
            self.plan_anew()
            return self._by_hand(now)
        if self._script is None:
            return STOP
        if self._plan_anew and self._goal is not None:
            self._plan_anew, self._script = False, self._journey(self._goal)
        try:
            return next(self._script)
        except StopIteration as end:
            self._end(end.value)
            return STOP

    def _end(self, trouble: str) -> None:
        if self._done is not None:
            self._ended.append(partial(self._done, trouble))
        self.let_go()

    def _journey(self, goal: Pose2D) -> Generator[Command, None, str]:
        """Drive to `goal`; return the error text when the robot stands."""
        try:
            for count, command in enumerate(drive_to(self.robot, goal)):
                if count % _BATTERY_EVERY == 0:
                    self._check_battery()
                yield command
        except NavigationError as error:
            yield from brake(self.robot)
            return str(error)
        return ""

    def _check_battery(self) -> None:
        if not self.robot.battery.charge(self._now):
            raise NavigationError("the battery is empty")

    def _halt(self) -> Generator[Command, None, str]:
        yield from brake(self.robot)
        return ""

    def _by_hand(self, now: float) -> Command:
        """Return the override, slowed down so that the robot stops before an obstacle.

        It stops where a goal could be, too: at the margin of goals and two cells more, because
        bodies and goals are measured in cells.
        """
        robot, limits = self.robot, self.robot.config.robot
        # What it will do: of a command beyond its limits, the way to look along could be endless.
        speed, turn_rate = self._override
        speed = max(-limits.max_reverse_speed, min(limits.max_speed, speed))
        turn_rate = max(-limits.max_turn_rate, min(limits.max_turn_rate, turn_rate))
        if not robot.battery.charge(now):
            return STOP
        if speed == 0.0:
            return speed, turn_rate
        braking = _SHARE * limits.braking
        kept_away = robot.config.planner.margin + 2.0 * robot.world.map.resolution
        room = max(0.0, robot.room((speed, turn_rate), kept_away + _LOOKED_AHEAD) - kept_away)
        most = math.sqrt(2.0 * braking * room)
        return math.copysign(min(abs(speed), most), speed), turn_rate
