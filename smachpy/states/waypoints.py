"""Named places to drive to, read from files and checked against the map."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actionlib_core.exceptions import InvalidNameError
from actionlib_core.inputs.checked_file import REQUIRED, CheckedFile, Limits, parse_yaml
from actionlib_core.names import check_name
from smachpy.places.exceptions import InputFileError, NavigationError
from smachpy.places.pose import Pose2D, wrap_angle
from smachpy.places.robot_file import SimConfig, load_config, read_file
from smachpy.userdata.kept_types import register_type

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actionlib_core.inputs.checked_file import Section
    from smachpy.places.floor import Floor

_SHARE: Final = Limits(low=0.0, high=1.0)


@register_type
@dataclass(frozen=True, slots=True)
class Waypoint:
    """A named place to drive to.

    Attributes:
        name: Its name in logs and pictures.
        pose: Its pose in the map frame.
    """

    name: str
    pose: Pose2D


@dataclass(frozen=True, slots=True)
class Route:
    """The places and limits of a patrol.

    Attributes:
        waypoints: The places to visit, in this order.
        dock: The place where the robot charges.
        low_battery: Charge below which it drives to the dock, 0 to 1.
        charge_until: Charge at which it leaves the dock, 0 to 1.
    """

    waypoints: tuple[Waypoint, ...]
    dock: Waypoint
    low_battery: float
    charge_until: float


class PlaceFile(CheckedFile):
    """A YAML or CSV file with places; base of the readers of such files.

    With the field `map` (and `robot`, for its radius) every place is checked against that map.
    Without it, only the robot's server can refuse places where the robot cannot stand.

    Args:
        path: The file.
        map_file: The map for the check if the file has no field `map`.
        csv_rows: The key for the rows of a CSV file; "" to refuse CSV files.
        csv_texts: Columns of a CSV file that are always texts.

    Attributes:
        floor: The map, inflated by the robot's radius; None if there is none.

    Raises:
        InputFileError: it cannot be read, or the map or the robot's file is wrong.
    """

    def __init__(
        self,
        path: Path,
        map_file: Path | None = None,
        csv_rows: str = "",
        csv_texts: Sequence[str] = (),
    ) -> None:
        parse = parse_yaml
        if csv_rows and path.suffix.lower() == ".csv":
            from smachpy.places.checked_csv import parse_csv

            parse = partial(parse_csv, key=csv_rows, texts=csv_texts)
        super().__init__(path, InputFileError, parse)
        self.floor: Floor | None = None
        self.top.allow("map", "robot")
        robot = read_file(self.top, "robot", load_config) if "robot" in self.top else SimConfig()
        if "map" in self.top or map_file is not None:
            from smachpy.places.floor import Floor
            from smachpy.places.occupancy import load_map

            grid = read_file(self.top, "map", load_map, map_file)
            if grid is not None and robot is not None:
                self.floor = Floor(grid, robot.robot.radius, robot.planner)

    def place(self, section: Section, default_name: str) -> Waypoint:
        """Read a name and a pose, and close the section."""
        name = section.text("name", default_name)
        x = section.number("x", REQUIRED, unit="m")
        y = section.number("y", REQUIRED, unit="m")
        yaw = section.number("yaw", 0.0, unit="rad")
        section.close()
        if self.floor is not None and section.is_good("x", "y"):
            try:
                self.floor.check_place(x, y)
            except NavigationError as error:
                reason = str(error).removeprefix("goal ")
                section.problem("x", "a place where the robot can stand", f"{name}: {reason}.")
        return Waypoint(name, Pose2D(x, y, wrap_angle(yaw)))

    def named_places(self, key: str) -> tuple[Waypoint, ...]:
        """Read a list of places with different names."""
        names: set[str] = set()
        places = []
        for row in self.top.rows(key):
            self.check_name(row, names)
            places.append(self.place(row, "-"))
        return tuple(places)

    def check_name(self, row: Section, names: set[str]) -> None:
        """Add the row's name to `names`; add a problem if it has none, or one of these."""
        name = row.text("name", REQUIRED)
        if name in names:
            row.problem("name", "a name that no other place has")
        names.add(name)

    def charges(self) -> tuple[float, float]:
        """Read the battery charges at which to begin and to end charging; 0 to 1."""
        low = self.top.number("low_battery", 0.3, _SHARE)
        until = self.top.number("charge_until", 0.9, _SHARE)
        is_good = "charge_until" in self.top and self.top.is_good("low_battery", "charge_until")
        if is_good and until <= low:
            self.top.problem("charge_until", f"more than low_battery ({low:g})")
        return low, until

    def close(self) -> None:
        """Finish reading.

        Raises:
            InputFileError: with the line and field of every problem.
        """
        self.top.close()
        self.check()


def network_name(row: Section, key: str) -> str:
    """Read a name of the network; "" if it is missing."""
    row.allow(key)
    if key not in row:
        return ""
    name = row.text(key, REQUIRED)
    try:
        return check_name(name, key)
    except InvalidNameError as error:
        row.problem(key, "a name of the network", f"{error.reason}.")
        return name


def load_route(path: str | Path) -> Route:
    """Read a patrol's file: `dock`, `waypoints`, `low_battery`, `charge_until`; see `PlaceFile`.

    Raises:
        InputFileError: with the line and field of every problem.
    """
    file = PlaceFile(Path(path))
    low, until = file.charges()
    dock = file.place(file.top.section("dock"), "dock")
    rows = file.top.rows("waypoints")
    waypoints = tuple(file.place(row, f"waypoint {i}") for i, row in enumerate(rows, 1))
    file.close()
    return Route(waypoints, dock, low, until)
