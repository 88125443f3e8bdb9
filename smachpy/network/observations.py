"""Data of a robot's topics as records for pages and recordings; without threads, time or I/O.

A record has `kind` "Observed", `path` "", `stamp_ns` (its arrival, by the mission's clock), `robot`
and `what`. `robot` is the prefix of the topics' names below the mission's own namespace: "" for its
own robot. Poses are [x, y, yaw] in the map frame [m, m, rad]:

- "pose": `at`, a pose.
- "scan": `at`, the pose of the scanner; `first` and `step` [rad]; `ranges` [cm], -1 for nothing.
- "plan": `points`, [x, y] in the map frame [m]; empty when there is no plan any more.
- "map": `resolution` [m], `width`, `height`, `origin`, a pose; `cells`, base64 of zlib of one byte
  per cell, row 0 at the bottom: 0 free, 1 occupied, 2 unknown.
- "value": `name`, `value`, `unit`.
- "values": `topic`, its name below the mission's namespace; `values`, path in the message
  ("linear.x") -> number. `robot` is "".
"""

from __future__ import annotations

import base64
import itertools
import math
import zlib
from typing import TYPE_CHECKING, Any, Final

from smachpy.events.reading import MAX_CELLS, OBSERVED

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

KIND: Final = OBSERVED

Pose = tuple[float, float, float]
"""x, y [m], yaw [rad]."""

TOPICS: Final[dict[str, tuple[str, tuple[str, ...]]]] = {
    "nav_msgs/OccupancyGrid": ("map", ("map",)),
    "nav_msgs/Odometry": ("odometry", ("odom", "odometry/filtered")),
    "geometry_msgs/PoseWithCovarianceStamped": ("pose", ("amcl_pose",)),
    "tf2_msgs/TFMessage": ("tf", ("tf", "tf_static")),
    "sensor_msgs/LaserScan": ("scan", ("scan",)),
    "nav_msgs/Path": (
        "plan",
        ("plan", "move_base/NavfnROS/plan", "move_base/GlobalPlanner/plan"),
    ),
    "sensor_msgs/BatteryState": ("battery", ("battery", "battery_state")),
}
"""Type of a topic -> its role, and its usual names."""

NUMBERS: Final = "numbers"
"""The role of any other topic with small messages (`is_small`); its name takes the place of the
robot's."""

POSE_S: Final = 0.2
"""Time between two records of the pose of a moving robot [s]."""
SCAN_S: Final = 0.5
VALUE_S: Final = 1.0
NUMBERS_S: Final = 0.5
MAP_S: Final = 2.0
_NEAR_M, _NEAR_RAD = 0.01, 0.02  # smaller changes of a pose are not recorded
_MAX_RAYS: Final = 181
_MAX_POINTS: Final = 200  # of a plan
_OCCUPIED, _FREE = 65, 25  # [%], the thresholds of ROS's map_saver
_STANDS: Final = 1e-3  # [m/s] and [rad/s]: a slower robot is at rest
_MAX_FRAMES: Final = 32  # between a frame and the map; a longer chain is a cycle
_MAX_SCOPES: Final = 1000  # robots, and topics with numbers; whoever publishes can invent them
_MAX_NAMES: Final = 10_000  # of frames of one robot; whoever publishes on `tf` can invent them
_MAX_NUMBERS: Final = 32  # of one message
_MAX_ITEMS: Final = 8  # of an array
_NUMERIC: Final = ("bool", "int", "uint", "float", "double")
_BYTES: Final = frozenset({"uint8", "int8", "char", "byte", "octet"})


def role_of(type_name: str, name: str) -> tuple[str, str] | None:
    """Return the role of a topic and the robot to which it belongs; None if it has no role.

    Args:
        type_name: "nav_msgs/Odometry" or "nav_msgs/msg/Odometry".
        name: Its name without a leading slash: "robot_0/odom".
    """
    role, names = TOPICS.get(type_name.replace("/msg/", "/"), ("", ()))
    for usual in sorted(names, key=len, reverse=True):
        if name == usual:
            return role, ""
        if name.endswith(f"/{usual}"):
            return role, name.removesuffix(f"/{usual}")
    return None


def is_small(message: Any) -> bool:
    """Return whether messages of this kind have numbers to plot and no arrays that can be long.

    Arrays of bytes and of messages can be long: those of images, point clouds and paths.

    Args:
        message: A new message with default values.
    """
    kinds = list(_kinds(message))
    may_be_long = any(
        kind.endswith("[]") and (kind[:-2] in _BYTES or "/" in kind) for kind in kinds
    )
    return not may_be_long and any(kind.startswith(_NUMERIC) for kind in kinds)


def _kinds(message: Any) -> Iterator[str]:
    """Yield the types of all fields of a message, nested ones too, except headers."""
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        value = getattr(message, name)
        if not hasattr(value, "_slot_types"):
            yield kind
        elif not kind.endswith("Header"):
            yield from _kinds(value)


def _numbers(message: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Yield path and value of each finite number, except in headers and long fixed arrays."""
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        value, here = getattr(message, name), f"{path}{name}"
        if hasattr(value, "_slot_types"):
            if not kind.endswith("Header"):
                yield from _numbers(value, f"{here}.")
        elif isinstance(value, list | tuple):
            if kind.endswith("[]") or len(value) <= _MAX_ITEMS:
                items = enumerate(value[:_MAX_ITEMS])
                yield from ((f"{here}.{i}", float(item)) for i, item in items if _is_finite(item))
        elif _is_finite(value):
            yield here, float(value)


def _is_finite(value: Any) -> bool:
    return isinstance(value, bool | int | float) and math.isfinite(value)


class Observer:
    """Converts messages of topics to records, and skips those that change nothing.

    Poses are converted to the map frame by means of `tf`; a frame that `tf` does not contain is
    taken for the map frame.
    """

    def __init__(self) -> None:
        self._frames: dict[str, dict[str, tuple[str, Pose]]] = {}  # robot -> child -> parent, pose
        self._poses: dict[str, Pose] = {}
        self._recorded: dict[tuple[str, str], tuple[int, Any]] = {}  # by `what` and robot
        self._localized: set[str] = set()
        self._late_maps: dict[str, dict[str, Any]] = {}  # robot -> a map that came too soon
        self._robots: set[str] = set()
        self._topics: set[str] = set()  # those of `NUMBERS`

    def take(self, role: str, robot: str, message: Any, stamp_ns: int) -> list[dict[str, Any]]:
        """Return the records of a message; none if it has invalid numbers, or of too many robots.

        Args:
            role: The topic's role, see `role_of`.
            robot: The robot to which it belongs.
            message: A message of ROS 1 or ROS 2.
            stamp_ns: Its arrival.
        """
        known = self._topics if role == NUMBERS else self._robots
        if robot not in known and len(known) >= _MAX_SCOPES:
            return []
        known.add(robot)
        make = getattr(self, f"_take_{role}")
        try:
            found = [(what, robot, facts) for what, facts in make(robot, message, stamp_ns)]
        except (ArithmeticError, ValueError):  # NaN or infinity
            found = []
        if self._late_maps:
            found += self._due_maps(stamp_ns)
        return [
            {"kind": KIND, "path": "", "stamp_ns": stamp_ns, "what": what, "robot": whose, **facts}
            for what, whose, facts in found
        ]

    def _due_maps(self, stamp_ns: int) -> Iterator[tuple[str, str, dict[str, Any]]]:
        """Yield the maps that came soon after the ones before, once their time has come.

        A map is published when it changes: there may be no later one.
        """
        for robot in [one for one in self._late_maps if self._is_due("map", one, stamp_ns, MAP_S)]:
            facts = self._late_maps.pop(robot)
            self._recorded["map", robot] = stamp_ns, facts
            yield "map", robot, facts

    # -- one method for each role: they yield `what` and the fields of the record ----------------

    def _take_tf(self, robot: str, message: Any, _stamp_ns: int) -> Iterable[Any]:
        known = self._frames.setdefault(robot, {})
        for stamped in message.transforms:
            if len(known) >= _MAX_NAMES and _plain(stamped.child_frame_id) not in known:
                continue
            moved = stamped.transform.translation
            x, y, yaw = _finite(moved.x, moved.y, _yaw(stamped.transform.rotation))
            parent = _plain(stamped.header.frame_id)
            known[_plain(stamped.child_frame_id)] = parent, (x, y, yaw)
        return ()

    def _take_pose(self, robot: str, message: Any, stamp_ns: int) -> Iterator[Any]:
        self._localized.add(robot)
        yield from self._pose(robot, _pose_of(message.pose.pose), stamp_ns, at_rest=True)

    def _take_odometry(self, robot: str, message: Any, stamp_ns: int) -> Iterator[Any]:
        pose, frame = _pose_of(message.pose.pose), _plain(message.header.frame_id)
        placed = self._in_map(robot, frame, pose)
        if placed is None and robot in self._localized:
            return  # odometry drifts; the localization's own pose is better
        twist = message.twist.twist
        at_rest = max(abs(twist.linear.x), abs(twist.linear.y), abs(twist.angular.z)) < _STANDS
        yield from self._pose(robot, placed or pose, stamp_ns, at_rest=at_rest)

    def _pose(
        self, robot: str, pose: Pose, stamp_ns: int, *, at_rest: bool
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield the pose, at a limited rate; the place where it stops at once, as the last one."""
        self._poses[robot] = pose
        told_ns, told = self._recorded.get(("pose", robot), (0, None))
        if told is not None and _is_near(told, pose):
            return
        if told is not None and not at_rest and stamp_ns - told_ns < POSE_S * 0.95e9:
            return
        self._recorded["pose", robot] = stamp_ns, pose
        yield "pose", {"at": _rounded(pose)}

    def _take_scan(self, robot: str, message: Any, stamp_ns: int) -> Iterator[Any]:
        if robot not in self._poses or not self._is_due("scan", robot, stamp_ns, SCAN_S):
            return
        every = max(1, math.ceil(len(message.ranges) / _MAX_RAYS))
        first, step = _finite(message.angle_min, message.angle_increment * every)
        low, high = message.range_min, message.range_max
        ranges = [
            round(r * 100) if math.isfinite(r) and low <= r <= high else -1
            for r in message.ranges[::every]
        ]
        at = self._in_map(robot, _plain(message.header.frame_id), (0.0, 0.0, 0.0))
        yield (
            "scan",
            {
                "at": _rounded(at or self._poses[robot]),
                "first": round(first, 5),
                "step": round(step, 6),
                "ranges": ranges,
            },
        )

    def _take_plan(self, robot: str, message: Any, stamp_ns: int) -> Iterator[Any]:
        poses, frame = list(message.poses), _plain(message.header.frame_id)
        every = max(1, math.ceil(len(poses) / _MAX_POINTS))
        kept = [*poses[:-1:every], *poses[-1:]]
        points = []
        for stamped in kept:
            pose = _pose_of(stamped.pose)
            x, y, _ = self._in_map(robot, frame, pose) or pose
            points.append([round(x, 2), round(y, 2)])
        if self._recorded.get(("plan", robot), (0, None))[1] != points:
            self._recorded["plan", robot] = stamp_ns, points
            yield "plan", {"points": points}

    def _take_map(self, robot: str, message: Any, stamp_ns: int) -> Iterator[Any]:
        info = message.info
        facts = grid_facts(message.data, info.width, info.resolution, _pose_of(info.origin))
        told_ns, told = self._recorded.get(("map", robot), (0, None))
        self._late_maps.pop(robot, None)
        if facts == told:
            return
        if told is not None and stamp_ns - told_ns < MAP_S * 1e9:
            self._late_maps[robot] = facts
            return
        self._recorded["map", robot] = stamp_ns, facts
        yield "map", facts

    def _take_numbers(self, topic: str, message: Any, stamp_ns: int) -> Iterator[Any]:
        if not self._is_due("numbers", topic, stamp_ns, NUMBERS_S):
            return
        found = dict(itertools.islice(_numbers(message), _MAX_NUMBERS))
        if found:
            values = {path: round(value, 6) for path, value in found.items()}
            yield "values", {"robot": "", "topic": topic, "values": values}

    def _take_battery(self, robot: str, message: Any, stamp_ns: int) -> Iterator[Any]:
        if self._is_due("battery", robot, stamp_ns, VALUE_S):
            (part,) = _finite(message.percentage)
            yield "value", {"name": "battery", "value": round(100 * part, 2), "unit": "%"}

    def _is_due(self, what: str, robot: str, stamp_ns: int, seconds: float) -> bool:
        told_ns, _ = self._recorded.get((what, robot), (None, None))
        if told_ns is not None and stamp_ns - told_ns < seconds * 0.95e9:
            return False
        self._recorded[what, robot] = stamp_ns, None
        return True

    # -- frames ----------------------------------------------------------------------------------

    def _in_map(self, robot: str, frame: str, pose: Pose) -> Pose | None:
        """Return a pose of `frame` in the map frame; None if `tf` has no chain to it."""
        known = {**self._frames.get("", {}), **self._frames.get(robot, {})}
        for _ in range(_MAX_FRAMES):
            if frame == "map" or frame.endswith("/map"):
                return pose
            if frame not in known:
                return None
            frame, placed = known[frame]
            pose = _compose(placed, pose)
        return None


def grid_facts(data: Any, width: int, resolution: float, origin: Pose) -> dict[str, Any]:
    """Return the fields of the record of an occupancy grid.

    Args:
        data: The cells row by row from the bottom: 0 free to 100 occupied, -1 unknown.
        width: Cells of a row.
        resolution: Edge of a cell [m].
        origin: Pose of the lower left corner in the map frame.

    Raises:
        ValueError: the number of cells is not a multiple of `width`, or the resolution is not > 0.
    """
    import numpy as np

    cells = np.asarray(data, dtype=np.int8)
    (edge,) = _finite(resolution)
    if edge <= 0 or not cells.size or width < 1 or cells.size % width:
        raise ValueError(f"map: got {cells.size} cells of {edge} m in rows of {width}")
    # First thinned out, then classified: a large map would need many times its memory.
    every = math.ceil(math.sqrt(cells.size / MAX_CELLS))
    rows: Any = cells.reshape(-1, width)[::every, ::every]
    classes = np.full(rows.shape, 2, dtype=np.uint8)
    classes[(rows >= 0) & (rows <= _FREE)] = 0
    classes[rows >= _OCCUPIED] = 1
    return {
        "resolution": round(edge * every, 6),
        "width": int(classes.shape[1]),
        "height": int(classes.shape[0]),
        "origin": _rounded(origin),
        "cells": base64.b64encode(zlib.compress(classes.tobytes(), 9)).decode("ascii"),
    }


def map_record(facts: dict[str, Any]) -> dict[str, Any]:
    """Return the record of the initial map, valid until a topic sends another one."""
    return {
        "kind": KIND,
        "path": "",
        "stamp_ns": 0,
        "what": "map",
        "robot": "",
        **facts,
        "n": 0,
    }


def _plain(frame: str) -> str:
    return frame.removeprefix("/")


def _finite(*values: float) -> tuple[float, ...]:
    numbers = tuple(float(value) for value in values)
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"no finite numbers: {numbers}")
    return numbers


def _yaw(turn: Any) -> float:
    """Return the rotation about the vertical axis [rad] of a quaternion."""
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _pose_of(message: Any) -> Pose:
    x, y, yaw = _finite(message.position.x, message.position.y, _yaw(message.orientation))
    return x, y, yaw


def _compose(frame: Pose, pose: Pose) -> Pose:
    """Transform `pose`, given in `frame`, to the parent of `frame`."""
    x, y, yaw = frame
    c, s = math.cos(yaw), math.sin(yaw)
    return x + c * pose[0] - s * pose[1], y + s * pose[0] + c * pose[1], yaw + pose[2]


def _is_near(one: Pose, other: Pose) -> bool:
    turned = math.remainder(one[2] - other[2], math.tau)
    return math.dist(one[:2], other[:2]) < _NEAR_M and abs(turned) < _NEAR_RAD


def _rounded(pose: Pose) -> list[float]:
    return [round(value, 3) for value in pose]
