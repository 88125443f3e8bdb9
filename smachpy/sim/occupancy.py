"""Occupancy maps in the format of ROS `map_server`: a YAML file beside a PGM or PNG image."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from actionlib_core.checked_file import REQUIRED, CheckedFile, Limits
from smachpy.sim.exceptions import InputFileError
from smachpy.sim.geometry import Pose2D

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

UNKNOWN: Final = -1
FREE: Final = 0
OCCUPIED: Final = 100
MAX_CELLS: Final = 64_000_000  # a larger image is refused before it fills the memory
_TRANSPARENT: Final = 0.999


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyMap:
    """A grid of the known floor.

    Attributes:
        cells: int8 (rows, columns), row 0 at the bottom: 0 free to 100 occupied, -1 unknown.
        resolution: Edge of a cell [m].
        origin: Pose of the lower left corner of cell (0, 0) in the map frame.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: Pose2D

    @property
    def height(self) -> int:
        """Number of rows."""
        return int(self.cells.shape[0])

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.cells.shape[1])

    def row_column(self, x: float, y: float) -> tuple[int, int]:
        """Return (row, column) of a point in the map frame, which may be outside the map."""
        dx, dy = x - self.origin.x, y - self.origin.y
        c, s = math.cos(self.origin.yaw), math.sin(self.origin.yaw)
        return (
            math.floor((c * dy - s * dx) / self.resolution),
            math.floor((c * dx + s * dy) / self.resolution),
        )

    def cell(self, x: float, y: float) -> tuple[int, int] | None:
        """Return (row, column) of a point in the map frame; None outside the map."""
        try:
            row, column = self.row_column(x, y)
        except OverflowError:  # so far away that the quotient is infinite
            return None
        if 0 <= row < self.height and 0 <= column < self.width:
            return row, column
        return None

    def centre(self, row: int, column: int) -> tuple[float, float]:
        """Return the centre (x, y) [m] of a cell in the map frame."""
        u, v = (column + 0.5) * self.resolution, (row + 0.5) * self.resolution
        c, s = math.cos(self.origin.yaw), math.sin(self.origin.yaw)
        return self.origin.x + c * u - s * v, self.origin.y + s * u + c * v

    def centres(
        self, rows: NDArray[np.intp], columns: NDArray[np.intp]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the centres x and y [m] of many cells in the map frame."""
        u, v = (columns + 0.5) * self.resolution, (rows + 0.5) * self.resolution
        c, s = math.cos(self.origin.yaw), math.sin(self.origin.yaw)
        return self.origin.x + c * u - s * v, self.origin.y + s * u + c * v


def load_map(path: Path) -> OccupancyMap:
    """Read a map's YAML file and its image.

    Source: http://wiki.ros.org/map_server, "Map format" and "Value interpretation".

    Raises:
        InputFileError: a file has problems; each is listed with its line and field.
    """
    file = CheckedFile(path, InputFileError)
    top = file.top
    image = top.text("image", REQUIRED)
    resolution = top.number("resolution", REQUIRED, Limits(above=0, high=100), "m/cell")
    origin = Pose2D(*top.numbers("origin", REQUIRED, ("x [m]", "y [m]", "yaw [rad]")))
    negate = top.flag("negate", REQUIRED)
    occupied = top.number("occupied_thresh", REQUIRED, Limits(low=0, high=1))
    free = top.number("free_thresh", REQUIRED, Limits(low=0, high=1))
    mode = top.text("mode", "trinary", ("trinary", "scale", "raw"))
    top.close()
    if top.is_good("free_thresh", "occupied_thresh") and free >= occupied:
        top.problem("free_thresh", f"less than occupied_thresh ({occupied:g})")
    if top.is_good("image", "mode"):
        try:
            pixels, alpha = _read_image(path.parent / image, mode)
        except _ImageError as error:
            top.report("image", str(error))
    file.check()
    if negate:
        pixels = 255.0 - pixels
    if mode == "raw":
        cells = _raw(pixels)
    else:
        cells = _occupancy(pixels, occupied, free)
        if mode == "trinary":
            cells[(cells > FREE) & (cells < OCCUPIED)] = UNKNOWN
        elif alpha is not None:
            cells[(cells > FREE) & (cells < OCCUPIED) & (alpha < _TRANSPARENT)] = UNKNOWN
    return OccupancyMap(np.ascontiguousarray(cells[::-1]), resolution, origin)


def _occupancy(pixels: NDArray[np.float64], occupied: float, free: float) -> NDArray[np.int8]:
    """Interpret shades as map_server's mode `scale`; between the thresholds 1 to 99."""
    share = (255.0 - pixels) / 255.0
    between = 1.0 + 98.0 * (share - free) / (occupied - free)
    cells = np.where(share > occupied, OCCUPIED, np.where(share < free, FREE, between))
    return cells.astype(np.int8)


def _raw(pixels: NDArray[np.float64]) -> NDArray[np.int8]:
    """Interpret shades 0 to 100 as occupancy, all others as unknown."""
    return np.where(pixels <= OCCUPIED, pixels, UNKNOWN).astype(np.int8)


class _ImageError(Exception):
    """The image of a map cannot be used."""


def _read_image(path: Path, mode: str) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Return shades 0..255 (rows from the top, columns) and opacity 0..1 if the image has it."""
    from PIL import Image, UnidentifiedImageError

    def broken(got: str, expected: str) -> _ImageError:
        return _ImageError(f"got {got}; expected {expected}.")

    try:
        with Image.open(path, formats=("PPM", "PNG")) as picture:
            if picture.width * picture.height > MAX_CELLS:
                size = f"{picture.width} x {picture.height} pixels"
                raise broken(size, f"at most {MAX_CELLS} pixels")
            pixels = _channels(picture)
    except UnidentifiedImageError as error:
        raise broken(f"'{path}', which is no image", "a PGM (P2, P5) or PNG file") from error
    except OSError as error:
        reason = f" ({error.strerror})" if error.strerror else f" ({error})"
        raise broken(f"'{path}'{reason}", "a readable PGM (P2, P5) or PNG file") from error
    except (ValueError, Image.DecompressionBombError) as error:
        raise broken(f"'{path}' ({error})", "a whole PGM (P2, P5) or PNG file") from error
    if pixels.shape[2] in {1, 3}:
        return pixels.mean(axis=2), None
    # map_server averages the opacity in with the colours in trinary mode; maps rely on it.
    colours = pixels if mode == "trinary" else pixels[:, :, :-1]
    return colours.mean(axis=2), pixels[:, :, -1] / 255.0


def _channels(picture: object) -> NDArray[np.float64]:
    """Return the pixels as 0..255 (rows, columns, channels)."""
    from PIL import Image

    assert isinstance(picture, Image.Image)
    if picture.mode.startswith("I"):  # 16 bits per pixel: 65535 / 255 = 257
        return np.asarray(picture, dtype=np.float64)[:, :, None] / 257.0
    if picture.mode == "P":
        picture = picture.convert("RGBA" if "transparency" in picture.info else "RGB")
    elif picture.mode == "1":
        picture = picture.convert("L")
    array = np.asarray(picture, dtype=np.float64)
    return array[:, :, None] if array.ndim == 2 else array  # noqa: PLR2004  rows, columns
