"""A picture of what the laser scanner sees around the robot, on the map."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from smachpy.places.occupancy import OCCUPIED
from smachpy_missions.explore.map_file import write_atomically
from smachpy_missions.explore.scans import rays_of

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
    from smachpy.places.occupancy import OccupancyMap
    from smachpy.states import Pose2D

Colour = tuple[int, int, int]

SIDE: Final = 720  # [pixels]
REACH: Final = 5.0  # [m] from the robot to the edges of the picture
_TITLE: Final = 36  # [pixels] height of the line below the picture
_SMOOTH: Final = 2  # drawn larger by this factor, then scaled down: Pillow's lines are jagged
_METRE: Final = SIDE * _SMOOTH / (2.0 * REACH)  # [pixels] per metre, before scaling down
_FLOOR: Final[Colour] = (226, 228, 232)
_WALL: Final[Colour] = (120, 126, 138)
_SEEN: Final[Colour] = (255, 249, 219)
_HIT: Final[Colour] = (200, 48, 36)
_ROBOT: Final[Colour] = (38, 103, 191)
_INK: Final[Colour] = (40, 44, 52)
_PAPER: Final[Colour] = (255, 255, 255)


def save_photo(
    path: Path, scan: LaserScan, pose: Pose2D, grid: OccupancyMap | None, title: str
) -> None:
    """Write the picture: north (the y axis of the map) is up, the robot is in the middle.

    Args:
        path: The PNG file; missing folders are created.
        scan: The scan.
        pose: Where the scan was made, in the map frame.
        grid: The map, drawn below the scan; None: no map.
        title: The line below the picture.

    Raises:
        OSError: the file cannot be written.
    """
    picture = _background(grid, pose)
    draw = ImageDraw.Draw(picture)
    rays = rays_of(scan, pose)
    xs, ys = rays.ends(REACH * math.sqrt(2.0))
    seen = [_pixel(x - pose.x, y - pose.y) for x, y in zip(xs, ys, strict=True)]
    if len(seen) > 1:
        draw.polygon([_pixel(0.0, 0.0), *seen], fill=_SEEN)
    for (x, y), hit in zip(seen, rays.hits, strict=True):
        if hit:
            draw.ellipse(_box(x, y, 0.05), fill=_HIT)
    x, y = _pixel(0.0, 0.0)
    draw.ellipse(_box(x, y, 0.25), fill=_ROBOT, outline=_PAPER, width=2 * _SMOOTH)
    nose = _pixel(0.25 * math.cos(pose.yaw), 0.25 * math.sin(pose.yaw))
    draw.line([(x, y), nose], fill=_PAPER, width=3 * _SMOOTH)
    buffer = io.BytesIO()
    _with_title(picture.reduce(_SMOOTH), title).save(buffer, format="PNG")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, buffer.getvalue())


def _background(grid: OccupancyMap | None, pose: Pose2D) -> Image.Image:
    """Return the map around the robot."""
    side = SIDE * _SMOOTH
    if grid is None:
        return Image.new("RGB", (side, side), _FLOOR)
    steps = (np.arange(side) + 0.5) / _METRE - REACH
    dx, dy = np.meshgrid(pose.x + steps - grid.origin.x, pose.y - steps - grid.origin.y)
    c, s = math.cos(grid.origin.yaw), math.sin(grid.origin.yaw)
    columns = np.floor((c * dx + s * dy) / grid.resolution).astype(np.intp)
    rows = np.floor((c * dy - s * dx) / grid.resolution).astype(np.intp)
    inside = (rows >= 0) & (rows < grid.height) & (columns >= 0) & (columns < grid.width)
    cells = np.where(inside, grid.cells[np.where(inside, rows, 0), np.where(inside, columns, 0)], 0)
    return Image.fromarray(_colours()[cells])


def _colours() -> NDArray[np.uint8]:
    """Return the colour of each value of a cell; that of -1, which is unknown, is the last one."""
    values = np.arange(256, dtype=np.uint8).view(np.int8)
    share = np.clip(values, 0, OCCUPIED)[:, None] / OCCUPIED
    return (np.array(_FLOOR) * (1.0 - share) + np.array(_WALL) * share).astype(np.uint8)


def _pixel(dx: float, dy: float) -> tuple[float, float]:
    """Return the pixel of a point (dx, dy) [m] relative to the robot."""
    middle = SIDE * _SMOOTH / 2.0
    return middle + dx * _METRE, middle - dy * _METRE


def _box(x: float, y: float, radius: float) -> tuple[float, float, float, float]:
    half = radius * _METRE
    return x - half, y - half, x + half, y + half


def _with_title(picture: Image.Image, title: str) -> Image.Image:
    framed = Image.new("RGB", (SIDE, SIDE + _TITLE), _PAPER)
    framed.paste(picture, (0, 0))
    draw = ImageDraw.Draw(framed)
    middle = SIDE + _TITLE // 2
    font = ImageFont.load_default(18)
    draw.text((10, middle), title, fill=_INK, font=font, anchor="lm")
    metre = _METRE / _SMOOTH
    draw.line([(SIDE - 12 - metre, middle), (SIDE - 12, middle)], fill=_INK, width=3)
    draw.text((SIDE - 20 - metre, middle), "1 m", fill=_INK, font=font, anchor="rm")
    return framed
