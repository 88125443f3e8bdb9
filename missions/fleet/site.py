"""Where a fleet works: docks, homes, and places that parcels come from and go to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from smachpy.states import PlaceFile, Waypoint

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class Site:
    """Where a fleet works.

    Attributes:
        docks: Where robots charge.
        homes: Where they wait, one each.
        places: Where parcels come from and go to.
        low_battery: A robot below this charges before its next order, 0 to 1.
        charge_until: It leaves the dock at this charge, 0 to 1.
        map: The file of the floor; None when the file names none.
        robot: The file of the robots' parameters, likewise.
    """

    docks: tuple[Waypoint, ...]
    homes: tuple[Waypoint, ...]
    places: tuple[Waypoint, ...]
    low_battery: float
    charge_until: float
    map: Path | None = None
    robot: Path | None = None


def load_site(path: Path) -> Site:
    """Read where a fleet works: the lists `docks`, `homes` and `places`.

    Raises:
        InputFileError: with the line and field of every problem.
    """
    file = PlaceFile(path)
    low, until = file.charges()
    docks, homes, places = (file.named_places(key) for key in ("docks", "homes", "places"))
    top = file.top
    files = [path.parent / top.text(key, "") if key in top else None for key in ("map", "robot")]
    file.close()
    return Site(docks, homes, places, low, until, *files)
