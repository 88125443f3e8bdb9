"""Converts a recording's data about robots to the messages that 3D viewers for ROS display.

Coordinates are in the frame "map" [m, rad]. A robot's frame is "ROBOT/base_link" and its scanner's
"ROBOT/scanner"; those of the mission's own robot have no prefix.
"""

from __future__ import annotations

import base64
import math
import zlib
from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces.geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from actionlib_core.interfaces.nav_msgs.msg import MapMetaData, OccupancyGrid, Path
from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
from actionlib_core.interfaces.std_msgs.msg import ColorRGBA, Float64, Header, String
from actionlib_core.interfaces.tf2_msgs.msg import TFMessage
from actionlib_core.interfaces.visualization_msgs.msg import Marker, MarkerArray
from actionlib_core.time import Time
from smachpy.events.run_state import innermost

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from smachpy.events.introspection import StateRecord
    from smachpy.events.run_state import RunState

MAP = "map"
MAX_RANGE_M = 100.0
"""Range of every scanner; recordings do not contain it."""
OCCUPANCY = bytes.maketrans(b"\x00\x01\x02", bytes([0, 100, 255]))
"""Maps a recording's cells to an occupancy grid's: free 0, occupied 100, unknown -1 as a byte."""
NAME_HEIGHT_M = 0.3

Message = tuple[str, Any]
"""Topic and message."""


class Scene:
    """Converts the records of a run to messages, in their order.

    Args:
        machine: The mission.
        server: Prefix of the mission's topics, such as "/PATROL".
    """

    def __init__(self, machine: StateRecord, server: str) -> None:
        self._server = server
        # Several children of a concurrence or plan can run at once: they have no single "state".
        self._sequential = [
            state
            for state in machine.walk()
            if state.is_container and state.kind not in {"concurrence", "plan"}
        ]
        self._labels: dict[str, str] = {}  # label of the running child, by path of the container

    def of_observation(self, record: Mapping[str, Any]) -> Iterator[Message]:
        """Yield the messages for a record of a robot's topic.

        Raises:
            ArithmeticError, LookupError, TypeError, ValueError, zlib.error: the record is
                malformed.
        """
        header = Header(stamp=Time(0, record["stamp_ns"]), frame_id=MAP)
        robot = record["robot"]
        namespace = f"/{robot}" if robot else ""
        match record["what"]:
            case "pose":
                at = record["at"]
                yield "/tf", _frame(header, _name(robot, "base_link"), at)
                yield f"{namespace}/pose", PoseStamped(header=header, pose=_pose(*at))
            case "scan":
                frame = _name(robot, "scanner")
                yield "/tf", _frame(header, frame, record["at"])
                yield f"{namespace}/scan", _scan(record, frame)
            case "plan":
                poses = [
                    PoseStamped(header=header, pose=_pose(x, y, 0.0)) for x, y in record["points"]
                ]
                yield f"{namespace}/plan", Path(header=header, poses=poses)
            case "map":
                yield f"{namespace}/map", _grid(record, header)
            case "value":
                yield f"{namespace}/{record['name']}", Float64(data=float(record["value"]))
            case "values":
                for path, value in record["values"].items():
                    name = f"/{record['topic']}/{path.replace('.', '/')}"
                    yield name, Float64(data=float(value))

    def of_event(self, event: Mapping[str, Any], state: RunState) -> Iterator[Message]:
        """Yield the messages for an event of the mission.

        Args:
            event: The event's record.
            state: The run after this event.
        """
        if event["kind"] == "GoalSent":
            yield from _goal(event)
        if event["kind"] == "UserdataWritten":
            value = event.get("value")
            if isinstance(value, int | float) and not isinstance(value, bool):
                yield f"{self._server}/userdata/{event['key']}", Float64(data=float(value))
        active = set(state.active())
        changed = False
        for container in self._sequential:
            labels = [child.label for child in container.children if child.path in active]
            label = labels[0] if labels else ""
            if self._labels.get(container.path, "") != label:
                self._labels[container.path] = label
                changed = True
                yield f"{container.path}/state", String(data=label)
        if changed:
            yield f"{self._server}/markers", _names(event["stamp_ns"], innermost(active))


def _name(robot: str, frame: str) -> str:
    return f"{robot}/{frame}" if robot else frame


def _turn(yaw: float) -> Quaternion:
    return Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def _pose(x: float, y: float, yaw: float) -> Pose:
    return Pose(position=Point(x=float(x), y=float(y)), orientation=_turn(yaw))


def _frame(header: Header, child: str, at: Any) -> TFMessage:
    x, y, yaw = at
    placed = Transform(translation=Vector3(x=float(x), y=float(y)), rotation=_turn(yaw))
    moved = TransformStamped(header=header, child_frame_id=child, transform=placed)
    return TFMessage(transforms=[moved])


def _scan(record: Mapping[str, Any], frame: str) -> LaserScan:
    # Recorded in cm, -1 without an echo. As in REP 117, +inf means nothing within range.
    ranges = [r / 100 if r >= 0 else math.inf for r in record["ranges"]]
    return LaserScan(
        header=Header(stamp=Time(0, record["stamp_ns"]), frame_id=frame),
        angle_min=float(record["first"]),
        angle_max=record["first"] + record["step"] * max(0, len(ranges) - 1),
        angle_increment=float(record["step"]),
        range_max=MAX_RANGE_M,
        ranges=ranges,
    )


def _grid(record: Mapping[str, Any], header: Header) -> OccupancyGrid:
    size = record["width"] * record["height"]
    # One byte more than expected is enough to see that a record is wrong: a small one could
    # expand to gigabytes.
    expand = zlib.decompressobj()
    cells = expand.decompress(base64.b64decode(record["cells"], validate=True), size + 1)
    if len(cells) != size:
        raise ValueError(f"map: got {len(cells)} cells; expected {size}")
    data = [b - 256 if b > 127 else b for b in cells.translate(OCCUPANCY)]  # noqa: PLR2004  int8
    info = MapMetaData(
        resolution=float(record["resolution"]),
        width=record["width"],
        height=record["height"],
        origin=_pose(*record["origin"]),
    )
    return OccupancyGrid(header=header, info=info, data=data)


def _goal(event: Mapping[str, Any]) -> Iterator[Message]:
    """The goal's pose, which viewers show as an arrow, if it has one."""
    goal = event.get("goal")
    fields = goal.get("fields") if isinstance(goal, dict) else None
    for stamped in fields.values() if isinstance(fields, dict) else ():
        if not (isinstance(stamped, dict) and stamped.get("$msg") == "geometry_msgs/PoseStamped"):
            continue
        try:
            pose = stamped["fields"]["pose"]["fields"]
            position, turn = pose["position"]["fields"], pose["orientation"]["fields"]
            header = Header(
                stamp=Time(0, event["stamp_ns"]),
                frame_id=stamped["fields"]["header"]["fields"]["frame_id"] or MAP,
            )
            placed = Pose(position=Point(**position), orientation=Quaternion(**turn))
        except (LookupError, TypeError):  # shortened in the recording, or edited by hand
            continue
        yield f"/{event['action'].strip('/')}/goal_pose", PoseStamped(header=header, pose=placed)


def _names(stamp_ns: int, leaves: list[str]) -> MarkerArray:
    """The names of the running leaves, as text above the mission's robot."""
    marker = Marker(
        header=Header(stamp=Time(0, stamp_ns), frame_id="base_link"),
        ns="states",
        type=Marker.TEXT_VIEW_FACING,
        pose=Pose(position=Point(z=1.0), orientation=_turn(0.0)),
        scale=Vector3(z=NAME_HEIGHT_M),
        color=ColorRGBA(r=0.0, g=0.51, b=0.83, a=1.0),  # the page's blue
        frame_locked=True,
        text="\n".join(sorted(path.rpartition("/")[2] for path in leaves)) or " ",
    )
    return MarkerArray(markers=[marker])
