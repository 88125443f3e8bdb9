"""Reads the waypoints of a tour and their tasks from YAML or CSV."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from actionlib_core.inputs.checked_file import Limits
from smachpy import register_type
from smachpy.states.waypoints import PlaceFile, Waypoint, network_name

if TYPE_CHECKING:
    from pathlib import Path

    from actionlib_core.inputs.checked_file import Section
    from smachpy.places.occupancy import OccupancyMap

TASKS: Final = ("photo", "turn", "wait_for_service")
_SECONDS: Final = Limits(low=0.0)
_TURN: Final = Limits(low=-180.0, high=180.0)


@dataclass(frozen=True, slots=True)
class Task:
    """A task at a waypoint.

    Attributes:
        kind: One of `TASKS`.
        angle: Angle of the task 'turn' [deg], anticlockwise.
        service: Name of the service for the task 'wait_for_service'.
    """

    kind: str
    angle: float = 0.0
    service: str = ""


@register_type
@dataclass(frozen=True, slots=True)
class Stop(Waypoint):
    """A waypoint with a task.

    Attributes:
        dwell: How long to stay there [s].
        task: The task after that, if any.
    """

    dwell: float = 0.0
    task: Task | None = None


@dataclass(frozen=True, slots=True)
class Tour:
    """A list of stops.

    Attributes:
        waypoints: The stops, in this order.
        map: The map, if the file names one.
    """

    waypoints: tuple[Stop, ...]
    map: OccupancyMap | None


def load_tour(path: Path, map_file: Path | None = None) -> Tour:
    """Read waypoints with their tasks, from YAML (the list `waypoints`) or CSV (a header line).

    Args:
        path: The file.
        map_file: The map to check the waypoints against if the file has no field `map`.

    Raises:
        InputFileError: the file has problems; each is listed with its line and field.
    """
    file = PlaceFile(path, map_file, csv_rows="waypoints", csv_texts=("name", "task", "service"))
    rows = file.top.rows("waypoints")
    stops = tuple(_stop(file, row, f"waypoint {i}") for i, row in enumerate(rows, 1))
    file.close()
    return Tour(stops, None if file.floor is None else file.floor.map)


def _stop(file: PlaceFile, row: Section, default_name: str) -> Stop:
    dwell = row.number("dwell", 0.0, _SECONDS, "s")
    task = _task(row)
    place = file.place(row, default_name)
    return Stop(place.name, place.pose, dwell, task)


def _task(row: Section) -> Task | None:
    angle = row.number("angle", 90.0, _TURN, "deg")
    service = network_name(row, "service")
    kind = row.text("task", TASKS[0], TASKS)
    if not row.is_good("task"):  # then nothing is known of its angle or service
        return None
    if "angle" in row and kind != "turn":
        row.problem("angle", "nothing, as the task is not 'turn'")
    if ("service" in row) != (kind == "wait_for_service"):
        row.problem("service", "the service of the task 'wait_for_service', and only of that")
    return Task(kind, angle, service) if "task" in row else None
