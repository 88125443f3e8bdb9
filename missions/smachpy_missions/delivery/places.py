"""The places that deliveries go to, with their doors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from smachpy.states.waypoints import PlaceFile, Waypoint, network_name

if TYPE_CHECKING:
    from pathlib import Path

    from actionlib_core.inputs.checked_file import Section


@dataclass(frozen=True, slots=True)
class DeliveryPlace:
    """A place that a delivery can go to.

    Attributes:
        goal: The place itself.
        door: The name of the door in front of it; "" if there is none.
        wait: Where to wait until the door is open; None if there is no door.
    """

    goal: Waypoint
    door: str = ""
    wait: Waypoint | None = None


@dataclass(frozen=True, slots=True)
class Places:
    """The contents of a places file.

    Attributes:
        home: Where the robot starts and returns to.
        places: The destinations, by name.
    """

    home: Waypoint
    places: dict[str, DeliveryPlace]


def load_places(path: Path) -> Places:
    """Read a places file: `home`, and the list `places`.

    Raises:
        InputFileError: the file has problems; each is listed with its line and field.
    """
    file = PlaceFile(path)
    home = file.place(file.top.section("home"), "home")
    places: dict[str, DeliveryPlace] = {}
    names: set[str] = set()
    for row in file.top.rows("places"):
        file.check_name(row, names)
        place = _behind_door(file, row)
        places[place.goal.name] = place
    file.close()
    return Places(home, places)


def _behind_door(file: PlaceFile, row: Section) -> DeliveryPlace:
    """Read a place and its door."""
    door = network_name(row, "door")
    before = row.section("wait")
    wait = file.place(before, "before the door") if "wait" in row or door else None
    if wait is not None and not door:
        row.problem("wait", "a door to wait for", "Try: door: NAME.")
    return DeliveryPlace(file.place(row, "-"), door, wait)
