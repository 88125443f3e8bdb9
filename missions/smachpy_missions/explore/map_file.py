"""Writes maps in the format of ROS `map_server`: a YAML file beside a PNG image."""

from __future__ import annotations

import io
import math
import os
import tempfile
from pathlib import Path
from typing import Final

import numpy as np
from PIL import Image

from smachpy.places.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyMap
from smachpy.states import Pose2D

_SHADES: Final = {UNKNOWN: 205, FREE: 254, OCCUPIED: 0}  # as ROS's map_saver writes them


def write_map(path: Path, grid: OccupancyMap) -> None:
    """Write a map of free, occupied and unknown cells, without unknown margins.

    Args:
        path: The YAML file; the image beside it has the same name and ends with .png.
        grid: The map.

    Raises:
        OSError: a file cannot be written. The image is written first, so that the YAML file never
            names an image that is not there.
    """
    grid = _trimmed(grid)
    shades = np.full(grid.cells.shape, _SHADES[UNKNOWN], dtype=np.uint8)
    shades[grid.cells == FREE] = _SHADES[FREE]
    shades[grid.cells == OCCUPIED] = _SHADES[OCCUPIED]
    buffer = io.BytesIO()
    # Row 0 of a map is its lower edge, row 0 of an image its upper one.
    Image.fromarray(shades[::-1]).save(buffer, format="PNG")
    image, origin = path.with_suffix(".png"), grid.origin
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(image, buffer.getvalue())
    write_atomically(
        path,
        f"image: '{image.name.replace(chr(39), chr(39) * 2)}'\n"
        f"resolution: {grid.resolution:g}  # [m/cell]\n"
        f"origin: [{origin.x:.3f}, {origin.y:.3f}, {origin.yaw:.6f}]  # x [m], y [m], yaw [rad]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n",
    )


def _trimmed(grid: OccupancyMap) -> OccupancyMap:
    """Return the map without the rows and columns at its edges that are all unknown."""
    known = grid.cells != UNKNOWN
    rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if not rows.size:
        return grid
    r0, c0 = int(rows[0]), int(columns[0])
    cells = grid.cells[r0 : rows[-1] + 1, c0 : columns[-1] + 1]
    c, s = math.cos(grid.origin.yaw), math.sin(grid.origin.yaw)
    u, v = c0 * grid.resolution, r0 * grid.resolution
    origin = Pose2D(grid.origin.x + c * u - s * v, grid.origin.y + s * u + c * v, grid.origin.yaw)
    return OccupancyMap(cells, grid.resolution, origin)


def write_atomically(path: Path, data: str | bytes) -> None:
    """Write a file so that readers see either the old contents or the new ones, never a part.

    Raises:
        OSError: the file cannot be written; the old one is unchanged.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            os.fchmod(handle, 0o644)  # mkstemp makes files that only their owner can read
            file.write(data.encode() if isinstance(data, str) else data)
            file.flush()
            os.fsync(file.fileno())  # before the rename: a power failure must not leave it empty
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
