"""Occupancy maps in the format of ROS `map_server`: a YAML file beside a PGM or PNG image."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from actionlib_core.inputs.checked_file import REQUIRED, CheckedFile, Limits
from smachpy.places.exceptions import InputFileError
from smachpy.places.pose import Pose2D

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray
    from PIL import Image

UNKNOWN: Final = -1
FREE: Final = 0
OCCUPIED: Final = 100
MAX_CELLS: Final = 16_000_000
"""Most cells of a map, such as 200 m x 200 m at 5 cm; planning needs some 60 bytes for each."""

_PIXELS_AT_ONCE: Final = 1_000_000
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

    def interpret(shades: _Shades, opacity: _Shades | None) -> NDArray[np.int8]:
        """Return the cells of some rows of the image."""
        shades = 255.0 - shades if negate else shades
        if mode == "raw":
            return _raw(shades)
        cells = _occupancy(shades, occupied, free)
        between = (cells > FREE) & (cells < OCCUPIED)
        if mode == "trinary":
            cells[between] = UNKNOWN
        elif opacity is not None:
            cells[between & (opacity < _TRANSPARENT)] = UNKNOWN
        return cells

    cells = np.empty((0, 0), dtype=np.int8)
    if not top.is_good("occupied_thresh", "free_thresh"):
        occupied, free = 0.65, 0.2  # only to look for mistakes in the image
    if top.is_good("image", "mode"):
        try:
            cells = _read_image(path.parent / image, mode, interpret)
        except _ImageError as error:
            top.report("image", str(error))
    file.check()
    return OccupancyMap(np.ascontiguousarray(cells[::-1]), resolution, origin)


_Shades: TypeAlias = "NDArray[np.float64]"


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


def _read_image(
    path: Path, mode: str, interpret: Callable[[_Shades, _Shades | None], NDArray[np.int8]]
) -> NDArray[np.int8]:
    """Return the cells of an image, row 0 at the top.

    Args:
        path: The image.
        mode: The map's mode.
        interpret: Returns the cells of shades 0..255 and, if there are any, opacities 0..1.
    """
    from PIL import Image, UnidentifiedImageError

    def broken(got: str, expected: str) -> _ImageError:
        return _ImageError(f"got {got}; expected {expected}.")

    try:
        with Image.open(path, formats=("PPM", "PNG")) as picture:
            if picture.width * picture.height > MAX_CELLS:
                size = f"{picture.width} x {picture.height} pixels"
                raise broken(size, f"at most {MAX_CELLS:,} pixels")
            plain: Image.Image = picture
            if picture.mode == "P":
                plain = picture.convert("RGBA" if "transparency" in picture.info else "RGB")
            elif picture.mode == "1":
                plain = picture.convert("L")
            cells = np.empty((plain.height, plain.width), dtype=np.int8)
            # Some rows at a time: floats of all pixels would need fifty times the memory.
            rows = max(1, _PIXELS_AT_ONCE // plain.width)
            for top in range(0, plain.height, rows):
                below = min(top + rows, plain.height)
                part = plain.crop((0, top, plain.width, below))
                cells[top:below] = interpret(*_shades(part, mode))
            return cells
    except UnidentifiedImageError as error:
        raise broken(f"'{path}', which is no image", "a PGM (P2, P5) or PNG file") from error
    except OSError as error:
        reason = f" ({error.strerror})" if error.strerror else f" ({error})"
        raise broken(f"'{path}'{reason}", "a readable PGM (P2, P5) or PNG file") from error
    except (ValueError, Image.DecompressionBombError) as error:
        raise broken(f"'{path}' ({error})", "a whole PGM (P2, P5) or PNG file") from error


def _shades(picture: Image.Image, mode: str) -> tuple[_Shades, _Shades | None]:
    """Return shades 0..255 of an image, and its opacity 0..1 if it has one."""
    pixels = np.asarray(picture, dtype=np.float64)
    if picture.mode.startswith("I"):  # 16 bits per pixel: 65535 / 255 = 257
        return pixels / 257.0, None
    if pixels.ndim == 2:  # noqa: PLR2004  rows, columns
        return pixels, None
    if pixels.shape[2] == 3:  # noqa: PLR2004  red, green, blue
        return pixels.mean(axis=2), None
    # map_server averages the opacity in with the colours in trinary mode; maps rely on it.
    colours = pixels if mode == "trinary" else pixels[:, :, :-1]
    return colours.mean(axis=2), pixels[:, :, -1] / 255.0
