"""The floor as it really is, the robots on it, and what each of them knows of it."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from typing import TYPE_CHECKING, Final

from missions.exceptions import NavigationError
from missions.move_base.battery import Battery
from missions.move_base.body import Body
from missions.move_base.costmap import Costmap
from missions.move_base.floor import Obstacle
from missions.move_base.planner import Planner

if TYPE_CHECKING:
    from missions.move_base.config import PlannerConfig, SimConfig
    from missions.move_base.geometry import Pose2D
    from missions.move_base.occupancy import OccupancyMap

_ROOM_BESIDE: Final = 0.2  # [m] looked for ahead besides the braking distance
_KEPT_PLANNERS: Final = 8  # of the last sets of obstacles


class World:
    """A map and the obstacles that came later; robots on one floor share its planners.

    Threads: `add_obstacle` and `remove_obstacle` may be called while robots drive.

    Attributes:
        map: What was known from the start.
        obstacles: What stands there besides. Replaced as a whole, never changed in place.
    """

    def __init__(self, grid: OccupancyMap) -> None:
        self.map = grid
        self.obstacles: tuple[Obstacle, ...] = ()
        self._lock = threading.Lock()
        self._planners: OrderedDict[tuple[object, ...], Planner] = OrderedDict()

    def add_obstacle(self, x: float, y: float, radius: float) -> Obstacle:
        """Put a round obstacle on the floor."""
        obstacle = Obstacle(x, y, radius)
        with self._lock:
            self.obstacles = (*self.obstacles, obstacle)
        return obstacle

    def remove_obstacle(self, obstacle: Obstacle) -> None:
        """Take it away again; nothing happens when it is not there."""
        with self._lock:
            self.obstacles = tuple(o for o in self.obstacles if o != obstacle)

    def planner(
        self, body_radius: float, config: PlannerConfig, obstacles: tuple[Obstacle, ...]
    ) -> Planner:
        """Return the planner for a body among these obstacles; robots alike share it."""
        key = (body_radius, config, frozenset(obstacles))
        with self._lock:
            planner = self._planners.get(key)
            if planner is None:
                planner = Planner(Costmap(self.map, body_radius, config, obstacles))
                self._planners[key] = planner
                if len(self._planners) > _KEPT_PLANNERS:
                    self._planners.popitem(last=False)
        return planner


class Robot:
    """One robot: body, battery, and what it knows of the floor.

    Threads: one thread steers it at a time; pose and battery may be read from any thread.

    Attributes:
        body: Where it is and how it moves.
        battery: How full it is.
        planner: Finds ways among what the robot knows.
        bumped: Whether its last step was stopped by something solid.
        odometer: Distance driven [m].
    """

    def __init__(self, world: World, config: SimConfig, pose: Pose2D, now: float) -> None:
        """Put a robot on the floor.

        Raises:
            NavigationError: it cannot stand at `pose`.
        """
        self.config = config
        self._world = world
        self._known: tuple[Obstacle, ...] = ()
        self.planner = self._planner(())
        try:
            self.check_place(pose.x, pose.y)
        except NavigationError as error:
            raise NavigationError(f"start pose: {error}".replace("goal ", "", 1)) from None
        self.body = Body(config.robot, pose)
        self.battery = Battery(config.battery, now)
        self.bumped = False
        self.odometer = 0.0
        self._share = 0.0

    def step(self, now: float, dt: float, command: tuple[float, float]) -> None:
        """Drive for `dt` seconds towards a command (speed [m/s], turn rate [rad/s])."""
        body = self.body
        x, y, yaw = body.x, body.y, body.yaw
        body.steer(command[0], command[1], dt)
        body.advance(dt)
        self.bumped = False
        if self._hits(x, y, body.x, body.y):
            body.x, body.y, body.yaw, body.speed = x, y, yaw, 0.0
            self.bumped = True
        self.odometer += abs(body.speed) * dt
        share = abs(body.speed) / self.config.robot.max_speed
        if share != self._share:
            self._share = share
            self.battery.drive(now, share)

    def room(self, command: tuple[float, float]) -> float:
        """Return the free distance [m] ahead on the arc of a command (speed, turn rate).

        Looked for no farther than it takes to brake.
        """
        speed, turn_rate = command
        body = self.body
        fastest = max(abs(speed), abs(body.speed))
        braking = fastest * fastest / self.config.robot.braking + _ROOM_BESIDE
        step = math.copysign(self._world.map.resolution / 2.0, speed)
        turn = turn_rate * step / speed if speed else 0.0
        x, y, yaw = body.pose
        done = 0.0
        while done < braking:
            yaw += turn
            ahead_x, ahead_y = x + step * math.cos(yaw), y + step * math.sin(yaw)
            if self._hits(x, y, ahead_x, ahead_y):
                break
            x, y = ahead_x, ahead_y
            done += abs(step)
        return done

    def look(self) -> bool:
        """Compare the floor in sight with what is known.

        Returns:
            Whether something appeared or went; `planner` then knows it.
        """
        real, known = self._world.obstacles, self._known
        if real == known:
            return False
        seen = tuple(o for o in real if o in known or self._sees(o))
        seen += tuple(o for o in known if o not in real and not self._sees(o))
        if seen == known:
            return False
        self._known = seen
        self.planner = self._planner(seen)
        return True

    def forget(self) -> None:
        """Forget the obstacles that are out of sight: they may have gone."""
        self._known = tuple(o for o in self._known if self._sees(o))
        self.planner = self._planner(self._known)
        self.look()

    def check_place(self, x: float, y: float) -> None:
        """Check a place against the map alone: obstacles may go, walls do not.

        Raises:
            NavigationError: the robot can never stand there.
        """
        self._planner(()).costmap.check_place(x, y)

    @property
    def known_obstacles(self) -> tuple[Obstacle, ...]:
        """What it has seen that is not on the map."""
        return self._known

    def _planner(self, obstacles: tuple[Obstacle, ...]) -> Planner:
        return self._world.planner(self.config.robot.radius, self.config.planner, obstacles)

    def _sees(self, obstacle: Obstacle) -> bool:
        distance = math.hypot(obstacle.x - self.body.x, obstacle.y - self.body.y)
        return distance <= self.config.robot.sight + obstacle.radius

    def _hits(self, x: float, y: float, new_x: float, new_y: float) -> bool:
        """Tell whether the body would run into something; out of something it may always go."""
        return self._touches(new_x, new_y) and not self._touches(x, y)

    def _touches(self, x: float, y: float) -> bool:
        """Tell whether a body at (x, y) would overlap something solid."""
        if self.planner.costmap.touches(x, y):
            return True
        radius = self.config.robot.radius
        return any(math.hypot(o.x - x, o.y - y) < o.radius + radius for o in self._world.obstacles)
