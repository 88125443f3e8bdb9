"""Reads the map of a floor from a file, for robots that do not publish theirs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path


def read_floor(path: Path) -> dict[str, Any]:
    """Read a map_server YAML file and its image; return a record of `smachpy.network.observations`.

    Raises:
        InputFileError: names all problems of the file.
    """
    from smachpy.network.observations import grid_facts, map_record
    from smachpy.places.occupancy import load_map

    grid = load_map(path)
    origin = grid.origin.x, grid.origin.y, grid.origin.yaw
    return map_record(grid_facts(grid.cells.ravel(), grid.width, grid.resolution, origin))
