"""The site of a fleet: docks, homes, and the places of parcels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from smachpy.states import PlaceFile, Waypoint

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class Site:
    """The site of a fleet.

    Attributes:
        docks: Where robots charge.
        homes: Where robots wait, one for each.
        places: Where parcels are fetched and delivered.
        low_battery: A robot with less charge than this, 0 to 1, charges before its next order.
        charge_until: A robot leaves the dock at this charge, 0 to 1.
        map: The map file; None if the site names none.
        robot: The file with the robots' parameters; None if the site names none.
    """

    docks: tuple[Waypoint, ...]
    homes: tuple[Waypoint, ...]
    places: tuple[Waypoint, ...]
    low_battery: float
    charge_until: float
    map: Path | None = None
    robot: Path | None = None


def load_site(path: Path) -> Site:
    """Read a site file: the lists `docks`, `homes` and `places`.

    Raises:
        InputFileError: the file has problems; each is listed with its line and field.
    """
    file = PlaceFile(path)
    low, until = file.charges()
    docks, homes, places = (file.named_places(key) for key in ("docks", "homes", "places"))
    top = file.top
    files = [path.parent / top.text(key, "") if key in top else None for key in ("map", "robot")]
    file.close()
    return Site(docks, homes, places, low, until, *files)
