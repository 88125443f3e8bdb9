"""Where deliveries go: places, with the doors that lead there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from smachpy.states.waypoints import PlaceFile, Waypoint, network_name

if TYPE_CHECKING:
    from pathlib import Path

    from smachpy.sim.checked_yaml import Section


@dataclass(frozen=True, slots=True)
class Place:
    """Where a delivery goes.

    Attributes:
        goal: The place itself.
        door: The name of the door that leads there; "" when there is none.
        wait: Where to stand until the door is open; None when there is none.
    """

    goal: Waypoint
    door: str = ""
    wait: Waypoint | None = None


@dataclass(frozen=True, slots=True)
class Places:
    """Where deliveries go.

    Attributes:
        home: Where the robot waits for orders and comes back to.
        places: The others, by name.
    """

    home: Waypoint
    places: dict[str, Place]


def load_places(path: Path) -> Places:
    """Read the places that deliveries go to: `home`, and the list `places`.

    Raises:
        InputFileError: with the line and field of every problem.
    """
    file = PlaceFile(path)
    home = file.place(file.top.section("home"), "home")
    places: dict[str, Place] = {}
    names: set[str] = set()
    for row in file.top.rows("places"):
        file.check_name(row, names)
        place = _behind_door(file, row)
        places[place.goal.name] = place
    file.close()
    return Places(home, places)


def _behind_door(file: PlaceFile, row: Section) -> Place:
    """Read a place with the door that leads there."""
    door = network_name(row, "door")
    before = row.section("wait")
    wait = file.place(before, "before the door") if "wait" in row or door else None
    if wait is not None and not door:
        row.problem("wait", "a door to wait for", "Try: door: NAME.")
    return Place(file.place(row, "-"), door, wait)
