"""The waypoints of a tour, with what to do at each: read from YAML or CSV."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from smachpy import register_type
from smachpy.sim.checked_yaml import Limits
from smachpy.states.waypoints import PlaceFile, Waypoint, network_name

if TYPE_CHECKING:
    from pathlib import Path

    from smachpy.sim.checked_yaml import Section
    from smachpy.sim.occupancy import OccupancyMap

TASKS: Final = ("photo", "turn", "wait_for_service")
_SECONDS: Final = Limits(low=0.0)
_TURN: Final = Limits(low=-180.0, high=180.0)


@dataclass(frozen=True, slots=True)
class Task:
    """What to do at a waypoint.

    Attributes:
        kind: One of `TASKS`.
        angle: By how much to turn [deg], anticlockwise.
        service: The service to wait for.
    """

    kind: str
    angle: float = 0.0
    service: str = ""


@register_type
@dataclass(frozen=True, slots=True)
class Stop(Waypoint):
    """A waypoint with what to do there.

    Attributes:
        dwell: How long to stay there [s].
        task: What to do there after that.
    """

    dwell: float = 0.0
    task: Task | None = None


@dataclass(frozen=True, slots=True)
class Tour:
    """A list of stops.

    Attributes:
        waypoints: Where to go, in this order.
        map: The floor, if the file names one.
    """

    waypoints: tuple[Stop, ...]
    map: OccupancyMap | None


def load_tour(path: Path, map_file: Path | None = None) -> Tour:
    """Read waypoints with their tasks, from YAML (the list `waypoints`) or CSV (a header line).

    Args:
        path: The file.
        map_file: The floor to check the waypoints against when the file has no field `map`.

    Raises:
        InputFileError: with the line and field of every problem.
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
    found = row.problem_count
    kind = row.text("task", TASKS[0], TASKS)
    if row.problem_count > found:
        return None
    if "angle" in row and kind != "turn":
        row.problem("angle", "nothing, as the task is not 'turn'")
    if ("service" in row) != (kind == "wait_for_service"):
        row.problem("service", "the service of the task 'wait_for_service', and only of that")
    return Task(kind, angle, service) if "task" in row else None
