"""Maps in the format of ROS `map_server`, with robots and waypoint lists for them."""

from __future__ import annotations

from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent
OFFICE_MAP: Final = FOLDER / "office.yaml"
OFFICE_ROBOT: Final = FOLDER / "office_robot.yaml"
OFFICE_WAYPOINTS: Final = FOLDER / "office_waypoints.yaml"
OFFICE_TOUR: Final = FOLDER / "office_tour.yaml"
OFFICE_PLACES: Final = FOLDER / "office_places.yaml"
OFFICE_FLEET: Final = FOLDER / "office_fleet.yaml"
OFFICE_DOORS: Final = FOLDER / "office_doors.yaml"
OFFICE_EXPLORER: Final = FOLDER / "office_explorer.yaml"
