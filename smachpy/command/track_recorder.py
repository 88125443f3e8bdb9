"""Records from a mission's events where the robots drove, and their goals."""

from __future__ import annotations

import threading
from collections import Counter
from typing import TYPE_CHECKING, Any

from smachpy import events as ev
from smachpy.places.pose import Pose2D, yaw_of

if TYPE_CHECKING:
    from pathlib import Path

    from smachpy.places.occupancy import OccupancyMap
    from smachpy.sim.track import GoalMark

_SAME_STATE = 3  # a state with more goals than this does not name them
_SAME_PLACE = 0.05  # [m] a goal this close to a named waypoint gets its name


class TrackRecorder:
    """Listens to a mission and can draw its track; for `machine.subscribe(recorder.on_event)`.

    The track consists of the poses in the feedback of `move_base` and Nav2, and of other actions
    whose feedback has a field `base_position` or `current_pose`. A goal is named after the waypoint
    that a state wrote to userdata (any value with a `name` and a `pose`), else after the state that
    sent it.

    Threads: `on_event` may be called from any thread.

    Attributes:
        tracks: The positions, (x, y) [m] in the map frame, by robot: the prefix of its actions, ""
            for a robot without a name.
    """

    def __init__(self) -> None:
        self.tracks: dict[str, list[tuple[float, float]]] = {}
        self._lost: set[str] = set()
        self._docks: dict[tuple[float, float], Pose2D] = {}
        self._lock = threading.Lock()
        self._names: list[tuple[Pose2D, str]] = []
        self._goals: dict[str, tuple[Pose2D, str, bool]] = {}

    @property
    def track(self) -> list[tuple[float, float]]:
        """The track of the only robot, or of the first one."""
        return next(iter(self.tracks.values()), [])

    @property
    def has_goals(self) -> bool:
        """Whether there is anything to draw: a goal on the map, or several robots."""
        return bool(self._goals) or len(self.tracks) > 1

    def on_event(self, event: ev.Event) -> None:
        """Process one event."""
        with self._lock:
            if isinstance(event, ev.GoalFeedback):
                self._on_feedback(_robot(event.action), event.feedback)
            elif isinstance(event, ev.GoalSent):
                self._on_goal(event)
            elif isinstance(event, ev.GoalDone):
                self._on_done(event)
            elif isinstance(event, ev.UserdataWritten):
                pose = getattr(event.value, "pose", None)
                name = getattr(event.value, "name", None)
                if isinstance(pose, Pose2D) and isinstance(name, str):
                    self._names.append((pose, name))

    def draw(self, path: Path, grid: OccupancyMap, *, dock: Pose2D | None, title: str) -> None:
        """Write the picture of the drive.

        Raises:
            OSError: the file cannot be written.
        """
        from smachpy.sim.track import draw_track, draw_tracks

        with self._lock:
            tracks, goals = {name: list(way) for name, way in self.tracks.items()}, self._marks()
            lost, docks = set(self._lost), [*self._docks.values()]
        if len(tracks) > 1:
            tracks = dict(sorted(tracks.items(), key=lambda item: (len(item[0]), item[0])))
            draw_tracks(path, grid, tracks, lost=lost, docks=docks, title=title)
        else:
            draw_track(path, grid, next(iter(tracks.values()), []), goals, dock=dock, title=title)

    def _marks(self) -> list[GoalMark]:
        from smachpy.sim.track import GoalMark

        # A state that drives to many places would give all of them the same name.
        times = Counter(label for _, label, _ in self._goals.values())
        return [
            GoalMark(
                pose,
                self._name(pose) or (label if times[label] <= _SAME_STATE else ""),
                reached=reached,
            )
            for pose, label, reached in self._goals.values()
        ]

    def _on_goal(self, event: ev.GoalSent) -> None:
        dock = getattr(event.goal, "dock", None)
        if dock is not None:
            self._docks[dock.position.x, dock.position.y] = _pose(dock)
        target = _find_place(event.goal, "target_pose", "pose")
        if target is not None and target.header.frame_id.removeprefix("/") == "map":
            label = event.path.rpartition("/")[2].replace("_", " ").lower()
            self._goals[event.goal_id] = _pose(target.pose), label, False

    def _on_done(self, event: ev.GoalDone) -> None:
        if event.goal_id in self._goals:
            pose, label, _ = self._goals[event.goal_id]
            self._goals[event.goal_id] = pose, label, event.status == "SUCCEEDED"
        if event.status == "LOST":
            self._lost.add(_robot(event.action))

    def _on_feedback(self, robot: str, feedback: Any) -> None:
        base = _find_place(feedback, "base_position", "current_pose")
        if base is not None:
            track = self.tracks.setdefault(robot, [])
            place = (base.pose.position.x, base.pose.position.y)
            if not track or track[-1] != place:
                track.append(place)

    def _name(self, pose: Pose2D) -> str:
        for place, name in reversed(self._names):
            if place.distance(pose) < _SAME_PLACE:
                return name
        return ""


def _robot(action: str) -> str:
    """Return the prefix of an action's name, which is the robot's."""
    return action.lstrip("/").rpartition("/")[0]


def _find_place(message: Any, *fields: str) -> Any:
    """Return the PoseStamped in the first field found: move_base and Nav2 use other names."""
    for field in fields:
        place = getattr(message, field, None)
        if hasattr(place, "header") and hasattr(place, "pose"):
            return place
    return None


def _pose(message: Any) -> Pose2D:
    turn = message.orientation
    yaw = yaw_of(turn.x, turn.y, turn.z, turn.w)
    return Pose2D(message.position.x, message.position.y, yaw)
