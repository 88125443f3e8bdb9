"""The real floor, the robots on it, and what each robot knows about the floor."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from smachpy.places.exceptions import NavigationError
from smachpy.places.floor import Bar, Obstacle, Sighting
from smachpy.sim.battery import Battery
from smachpy.sim.body import Body
from smachpy.sim.costmap import Costmap
from smachpy.sim.doors import Door
from smachpy.sim.planner import Planner
from smachpy.sim.raycast import Raycaster
from smachpy.sim.traffic import Mover

if TYPE_CHECKING:
    from collections.abc import Sequence

    from smachpy.places.floor import Thing
    from smachpy.places.occupancy import OccupancyMap
    from smachpy.places.pose import Pose2D
    from smachpy.places.robot_file import PlannerConfig, SimConfig
    from smachpy.sim.follower import Follower
    from smachpy.sim.traffic import Disc

AT_DOCK: Final = 0.2  # [m] reach of the charger
_MAX_CACHED_PLANNERS: Final = 8  # sets of obstacles whose planner is kept; making one takes long
_REMEMBERED: Final = 2.0  # times the robot's sight: farther moving things are forgotten
_TOLD: Final = 4.0  # [m] of its way that a robot shares with others
_ASKED: Final = 3.0  # [s] after which a request for space expires


@dataclass(frozen=True, slots=True)
class Dock:
    """A place where any robot may charge, one at a time.

    Attributes:
        name: One word; "" for a robot's own dock.
        pose: The robot's pose while it charges, in the map frame.
    """

    name: str
    pose: Pose2D


class World:
    """A map, the things on it, and the robots; robots of the same kind share their planners.

    Threads: `add_obstacle` and `remove_obstacle` may be called while robots drive. Everything else
    is changed by one thread at a time, under `Stepper.lock`.

    Attributes:
        map: The map known from the start.
        obstacles: Other things that stand there, including closed doors. The tuple is replaced,
            never changed, so that readers need no lock.
        robots: In the order in which they were added.
        movers: The moving obstacles.
        doors: By name.
        docks: Docks for any robot.
    """

    def __init__(self, grid: OccupancyMap) -> None:
        self.map = grid
        self.obstacles: tuple[Thing, ...] = ()
        self.robots: tuple[Robot, ...] = ()
        self.movers: tuple[Mover, ...] = ()
        self.doors: dict[str, Door] = {}
        self.docks: tuple[Dock, ...] = ()
        self.discs: tuple[Disc, ...] = ()
        self._lock = threading.Lock()
        self._planners: OrderedDict[tuple[object, ...], Planner] = OrderedDict()
        self._rays: Raycaster | None = None

    # -- contents ------------------------------------------------------------------------------

    def add_obstacle(self, x: float, y: float, radius: float) -> Obstacle:
        """Put a round obstacle on the floor."""
        obstacle = Obstacle(x, y, radius)
        self.add_thing(obstacle)
        return obstacle

    def remove_obstacle(self, obstacle: Obstacle) -> None:
        """Remove an obstacle, if it is there."""
        self.remove_thing(obstacle)

    def add_thing(self, thing: Thing) -> None:
        """Put a thing on the floor, unless it is there."""
        with self._lock:
            if thing not in self.obstacles:
                self.obstacles = (*self.obstacles, thing)

    def remove_thing(self, thing: Thing) -> None:
        """Remove a thing, if it is there."""
        with self._lock:
            self.obstacles = tuple(o for o in self.obstacles if o != thing)

    def add_door(
        self,
        name: str,
        ends: tuple[float, float, float, float],
        *,
        travel: float = 3.0,
        is_open: bool = False,
    ) -> Door:
        """Put a door between the two ends (x0, y0, x1, y1) [m] of a doorway.

        Args:
            name: One word.
            ends: The position of its leaf when closed.
            travel: How long it takes to open or to close [s].
            is_open: Its initial state.
        """
        door = self.doors[name] = Door(self, name, ends, travel=travel, is_open=is_open)
        return door

    def add_mover(
        self,
        name: str,
        places: Sequence[tuple[float, float]],
        *,
        radius: float = 0.3,
        speed: float = 0.8,
        loop: bool = False,
    ) -> Mover:
        """Add a moving obstacle that walks from place to place; see `Mover`."""
        mover = Mover(self, name, places, radius=radius, speed=speed, loop=loop)
        self.movers = (*self.movers, mover)
        self.discs = (*self.discs, mover)
        return mover

    def add_dock(self, name: str, pose: Pose2D) -> Dock:
        """Add a dock at which any robot may charge."""
        dock = Dock(name, pose)
        self.docks = (*self.docks, dock)
        return dock

    def enter(self, robot: Robot) -> None:
        """Add a robot."""
        self.robots = (*self.robots, robot)
        self.discs = (*self.discs, robot.body)

    def leave(self, robot: Robot) -> None:
        """Remove a robot, if it is there."""
        self.robots = tuple(other for other in self.robots if other is not robot)
        self.discs = tuple(disc for disc in self.discs if disc is not robot.body)

    # -- time ----------------------------------------------------------------------------------

    def is_changing(self) -> bool:
        """Return whether anything except the robots moves."""
        return bool(self.movers) or any(door.is_moving for door in self.doors.values())

    def step(self, dt: float) -> None:
        """Advance everything except the robots by `dt` seconds."""
        for mover in self.movers:
            mover.step(dt)
        for door in self.doors.values():
            door.step(dt)

    # -- questions -----------------------------------------------------------------------------

    @property
    def rays(self) -> Raycaster:
        """The map's ray caster, made at the first use."""
        if self._rays is None:
            self._rays = Raycaster(self.map)
        return self._rays

    def who_is_at(self, thing: Thing) -> str:
        """Return the name of a robot or moving obstacle that touches a thing; "" for none."""
        for disc in self.discs:
            if thing.gap(disc.x, disc.y) <= disc.radius:
                return disc.name
        return ""

    def holder(self, dock: Dock) -> str:
        """Return the name of the robot that stands at a dock; "" for none."""
        for robot in self.robots:
            if robot.body.pose.distance(dock.pose) <= AT_DOCK:
                return robot.name
        return ""

    def planner(
        self, body_radius: float, config: PlannerConfig, obstacles: tuple[Thing, ...]
    ) -> Planner:
        """Return the planner for a body among these obstacles; robots of one kind share it."""
        key = (body_radius, config, frozenset(obstacles))
        with self._lock:
            planner = self._planners.get(key)
            if planner is None:
                planner = Planner(Costmap(self.map, body_radius, config, obstacles))
                self._planners[key] = planner
                if len(self._planners) > _MAX_CACHED_PLANNERS:
                    self._planners.popitem(last=False)
            else:
                self._planners.move_to_end(key)
        return planner


class Robot:
    """One robot: its body, its battery, and what it knows about the floor.

    Threads: one thread steers it at a time; pose and battery may be read from any thread.

    Attributes:
        world: Its floor.
        name: Its name.
        body: Its pose and motion.
        battery: Its battery.
        planner: Finds ways among the standing things that it knows.
        traffic: The moving things, where it saw them last.
        bumped: Whether its last step was stopped by something solid.
        odometer: Distance driven [m].
        follower: Follows its way; None if it has none.
        held_by: What stands in its way, as far as it has looked.
        rank: Its right of way: the lowest rank goes first, which is who set out first.
        now: Time of its last step [s].
    """

    def __init__(
        self, world: World, config: SimConfig, pose: Pose2D, now: float, name: str = "robot"
    ) -> None:
        """Put a robot on the floor.

        Raises:
            NavigationError: it cannot stand at `pose`.
        """
        self.config = config
        self.name = name
        self.world = world
        self._known: tuple[Thing, ...] = ()
        self.planner = self._planner(())
        try:
            self.check_place(pose.x, pose.y)
        except NavigationError as error:
            raise NavigationError(f"start pose: {error}".replace("goal ", "", 1)) from None
        self.body = Body(config.robot, pose, name)
        for other in world.discs:
            if math.hypot(other.x - pose.x, other.y - pose.y) < other.radius + self.body.radius:
                where = f"({pose.x:.2f}, {pose.y:.2f})"
                raise NavigationError(f"start pose: {where} is taken by {other.name}")
        self.battery = Battery(config.battery, now)
        self.traffic: dict[Disc, Sighting] = {}
        self.bumped = False
        self.odometer = 0.0
        self.follower: Follower | None = None
        self.held_by: Sighting | None = None
        self.rank = (math.inf, 0)
        self._asked_by: Robot | None = None
        self._asked_until = -math.inf
        self.now = now
        self._share = 0.0
        world.enter(self)

    # -- moving --------------------------------------------------------------------------------

    def step(self, now: float, dt: float, command: tuple[float, float]) -> None:
        """Drive for `dt` seconds towards a command (speed [m/s], turn rate [rad/s])."""
        self.now = now
        body = self.body
        x, y, yaw = body.x, body.y, body.yaw
        body.steer(command[0], command[1], dt)
        body.advance(dt)
        self.bumped = False
        if (body.x != x or body.y != y) and self._hits(x, y, body.x, body.y):
            # The whole step is taken back: a body that stays where it hit would overlap the
            # obstacle.
            body.x, body.y, body.yaw, body.speed = x, y, yaw, 0.0
            self.bumped = True
        speed = abs(body.speed)
        self.odometer += speed * dt
        share = speed / self.config.robot.max_speed
        # Only when the power changes: the battery computes its charge from the last change.
        if share != self._share:
            self._share = share
            self.battery.drive(now, share)

    def room(self, command: tuple[float, float], beside: float) -> float:
        """Return the free distance [m] ahead on the arc of a command (speed, turn rate).

        It looks no farther than the braking distance and `beside` [m] more.
        """
        speed, turn_rate = command
        body = self.body
        fastest = max(abs(speed), abs(body.speed))
        braking = fastest * fastest / self.config.robot.braking + beside
        step = math.copysign(self.world.map.resolution / 2.0, speed)
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

    # -- knowledge -----------------------------------------------------------------------------

    def look(self) -> bool:
        """Compare the visible floor with what is known.

        Returns:
            Whether a standing thing appeared or disappeared; `planner` takes account of it then.
        """
        self._watch_traffic()
        real, known = self.world.obstacles, self._known
        if real == known:
            return False
        # A known thing stays known until its place is seen without it.
        seen = tuple(o for o in real if o in known or self._sees(o))
        seen += tuple(o for o in known if o not in real and not self._sees(o))
        if seen == known:
            return False
        self._known = seen
        self.planner = self._planner(seen)
        return True

    def forget(self) -> None:
        """Forget all things that are out of sight: they may be gone."""
        self._known = tuple(o for o in self._known if self._sees(o))
        self.planner = self._planner(self._known)
        self.traffic.clear()
        self.look()

    def nearest_dock(self) -> Dock | None:
        """Return the nearest dock, its own or a common one; None if there is none."""
        docks = list(self.world.docks)
        if self.config.dock is not None:
            docks.append(Dock("", self.config.dock))
        return min(docks, key=lambda dock: self.body.pose.distance(dock.pose), default=None)

    def ahead(self) -> Sequence[tuple[float, float]]:
        """Return the next metres of its way; empty if it has none."""
        return self.follower.rest(_TOLD) if self.follower is not None else ()

    # -- right of way --------------------------------------------------------------------------

    def set_out(self) -> None:
        """Note the start of a drive."""
        self.rank = (self.now, self.world.robots.index(self))
        self._asked_by = None

    def asked_by(self) -> Robot | None:
        """Return the robot that has recently asked this one for space, if any."""
        other = self._asked_by
        if other is None or self.now > self._asked_until or other.follower is None:
            return None
        return other

    def ask_for_room(self) -> None:
        """Ask the robot in the way to make space, if this one set out before it."""
        seen = self.held_by
        for other in self.world.robots:
            if seen is not None and other.name == seen.name and self.rank < other.rank:
                other.hear(self)

    def hear(self, other: Robot) -> None:
        """Note a request for space by another robot."""
        self._asked_by, self._asked_until = other, self.now + _ASKED

    def check_place(self, x: float, y: float) -> None:
        """Check a place against the map alone: obstacles may go, walls do not.

        Raises:
            NavigationError: the robot can never stand there.
        """
        self._planner(()).costmap.check_place(x, y)

    @property
    def known_obstacles(self) -> tuple[Thing, ...]:
        """The standing things that it has seen and that are not on the map."""
        return self._known

    def closed_doors(self) -> str:
        """Return the names of the closed doors it knows of."""
        return ", ".join(thing.name for thing in self._known if isinstance(thing, Bar))

    def _planner(self, obstacles: tuple[Thing, ...]) -> Planner:
        return self.world.planner(self.config.robot.radius, self.config.planner, obstacles)

    def _others(self) -> list[Disc]:
        """Return all other moving things on the floor."""
        return [disc for disc in self.world.discs if disc is not self.body]

    def _sees(self, thing: Thing) -> bool:
        return thing.gap(self.body.x, self.body.y) <= self.config.robot.sight

    def _watch_traffic(self) -> None:
        """Note the positions of the visible moving things."""
        traffic, sight = self.traffic, self.config.robot.sight
        x, y = self.body.x, self.body.y
        close = [d for d in self._others() if math.hypot(d.x - x, d.y - y) - d.radius <= sight]
        # Things remembered at a place that is now visible are dropped there: if they still are
        # there, they are seen again below.
        remembered = []
        for disc, seen in list(traffic.items()):
            distance = math.hypot(seen.x - x, seen.y - y)
            if distance > _REMEMBERED * sight:
                del traffic[disc]
            elif distance <= sight:
                remembered.append((disc, seen))
        # One call for all: the rays are cast together as arrays.
        visible = self._which_are_visible([*close, *(seen for _, seen in remembered)])
        for (disc, _), clear in zip(remembered, visible[len(close) :], strict=True):
            if clear:
                del traffic[disc]
        for disc, clear in zip(close, visible[: len(close)], strict=True):
            if clear:
                traffic[disc] = Sighting(disc.x, disc.y, disc.radius, disc.name)

    def _which_are_visible(self, places: Sequence[Disc | Sighting]) -> Sequence[bool]:
        """Return which places are not hidden by a wall."""
        if not places:
            return ()
        points = np.array([(place.x, place.y) for place in places])
        visible: list[bool] = self.world.rays.sees(self.body.x, self.body.y, points).tolist()
        return visible

    # -- touching ------------------------------------------------------------------------------

    def _hits(self, x: float, y: float, new_x: float, new_y: float) -> bool:
        """Return whether the body would run into something; it may always move out of something."""
        if self._touches(new_x, new_y) and not self._touches(x, y):
            self.held_by = None
            return True
        radius = self.body.radius
        for disc in self._others():
            dx, dy, reach = disc.x - new_x, disc.y - new_y, disc.radius + radius
            square = dx * dx + dy * dy
            # Only a collision if it gets closer: two that overlap must be able to part.
            if square < reach * reach and square < (disc.x - x) ** 2 + (disc.y - y) ** 2:
                self.held_by = Sighting(disc.x, disc.y, disc.radius, disc.name)
                return True
        return False

    def _touches(self, x: float, y: float) -> bool:
        """Return whether a body at (x, y) would overlap a standing thing."""
        if self.planner.costmap.touches(x, y):
            return True
        radius = self.body.radius
        return any(thing.gap(x, y) < radius for thing in self.world.obstacles)
