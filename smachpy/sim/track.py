"""Draws a picture of a drive: the floor, the driven way, the goals."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from smachpy.places.occupancy import OCCUPIED, UNKNOWN

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence
    from pathlib import Path

    from smachpy.places.occupancy import OccupancyMap
    from smachpy.places.pose import Pose2D

Colour = tuple[int, int, int]

WIDTH: Final = 1600  # [pixels] of the finished picture, the longer side
_SMOOTH: Final = 2  # drawn larger by this factor, then scaled down: Pillow's lines are jagged
_FLOOR: Final[Colour] = (250, 249, 246)
_WALL: Final[Colour] = (52, 58, 70)
_OUTSIDE: Final[Colour] = (226, 228, 232)
_START: Final[Colour] = (38, 103, 191)  # colour of the way at its start
_END: Final[Colour] = (214, 72, 42)
_REACHED: Final[Colour] = (46, 125, 50)
_MISSED: Final[Colour] = (176, 60, 60)
_INK: Final[Colour] = (40, 44, 52)
_PAPER: Final[Colour] = (255, 255, 255)
_LEGEND_PX: Final = 56
# For several robots, in this order, repeated; distinct for most colour-blind readers as well.
_ROBOTS: Final[tuple[Colour, ...]] = (
    (31, 119, 180),
    (230, 97, 1),
    (44, 140, 60),
    (200, 40, 50),
    (120, 80, 190),
    (140, 86, 75),
    (214, 90, 170),
    (95, 100, 110),
    (160, 150, 20),
    (0, 160, 175),
)
ROBOT_RADIUS: Final = 0.25  # [m]
_AT_DOCK: Final = 0.5  # [m] goals closer to the charger than this get no mark


@dataclass(frozen=True, slots=True)
class GoalMark:
    """A goal in the picture.

    Attributes:
        pose: Its pose in the map frame.
        label: A few words.
        reached: Whether the robot reached it.
    """

    pose: Pose2D
    label: str
    reached: bool


def draw_track(
    path: Path,
    grid: OccupancyMap,
    track: Sequence[tuple[float, float]],
    goals: Sequence[GoalMark],
    *,
    dock: Pose2D | None = None,
    title: str = "",
) -> None:
    """Write the picture, in the format of the file name's extension.

    Args:
        path: The file to write; its folder must exist.
        grid: The floor.
        track: The positions of the robot, (x, y) [m] in the map frame, in order.
        goals: The goals, in order; goals at one place are drawn as one, with the last one's result.
        dock: Position of the charger.
        title: A line below the picture.

    Raises:
        OSError: the file cannot be written.
        ValueError: Pillow knows no format of that name.
    """
    canvas = _Canvas(grid)
    if dock is not None:
        canvas.dock(dock, ROBOT_RADIUS)
    canvas.track(track)
    if track:
        canvas.robot(track, ROBOT_RADIUS)
    canvas.goals([goal for goal in goals if dock is None or goal.pose.distance(dock) > _AT_DOCK])
    canvas.finish(title, length=_length(track)).save(path)


def draw_tracks(
    path: Path,
    grid: OccupancyMap,
    tracks: Mapping[str, Sequence[tuple[float, float]]],
    *,
    lost: Collection[str] = (),
    docks: Iterable[Pose2D] = (),
    title: str = "",
) -> None:
    """Draw the ways of several robots, each in its own colour.

    Args:
        path: The file to write; its folder must exist.
        grid: The floor.
        tracks: By the robot's name: its positions, (x, y) [m] in the map frame, in order.
        lost: Robots that were lost at the end of their track; they get a cross.
        docks: Positions of the chargers.
        title: A line below the picture.

    Raises:
        OSError: the file cannot be written.
        ValueError: Pillow knows no format of that name.
    """
    canvas = _Canvas(grid)
    for dock in docks:
        canvas.dock(dock, ROBOT_RADIUS)
    shown = [(name, way, _ROBOTS[i % len(_ROBOTS)]) for i, (name, way) in enumerate(tracks.items())]
    for _, way, colour in shown:
        canvas.track(way, colour)
    for name, way, colour in shown:
        if way:
            canvas.end(way[-1], colour, ROBOT_RADIUS, number=_number(name), lost=name in lost)
    legend = [(name, colour, _length(way)) for name, way, colour in shown]
    canvas.finish_several(title, legend).save(path)


class _Canvas:
    """The picture during drawing, larger by `_SMOOTH`."""

    def __init__(self, grid: OccupancyMap) -> None:
        self._grid = grid
        self._scale = _SMOOTH * WIDTH / max(grid.width, grid.height)
        size = (round(grid.width * self._scale), round(grid.height * self._scale))
        self._image = Image.fromarray(_shades(grid)).resize(size, Image.Resampling.NEAREST)
        self._draw = ImageDraw.Draw(self._image)
        self._metre = self._scale / grid.resolution

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Return the pixel of a point in the map frame."""
        origin = self._grid.origin
        dx, dy = x - origin.x, y - origin.y
        c, s = math.cos(origin.yaw), math.sin(origin.yaw)
        u, v = c * dx + s * dy, c * dy - s * dx
        return u * self._metre, self._image.height - v * self._metre

    def track(self, track: Sequence[tuple[float, float]], colour: Colour | None = None) -> None:
        """Draw the way, with colours from start to end, or in one colour."""
        points = [self.pixel(x, y) for x, y in track]
        width = max(2, round(0.09 * self._metre))
        for shade, extra in ((_PAPER, 2 * _SMOOTH), (colour, 0)):
            for i, (a, b) in enumerate(itertools.pairwise(points)):
                colour = shade or _blend(i / max(1, len(points) - 2))
                self._draw.line([a, b], fill=colour, width=width + extra)
                self._dot(b, (width + extra) / 2.0, colour)

    def goals(self, goals: Sequence[GoalMark]) -> None:
        """Draw a numbered flag and a name at each goal."""
        font = _font(13 * _SMOOTH)
        bold = _font(12 * _SMOOTH)
        places: dict[tuple[float, float], tuple[list[str], GoalMark]] = {}
        for number, goal in enumerate(goals, 1):
            key = (round(goal.pose.x, 1), round(goal.pose.y, 1))
            numbers, _ = places.setdefault(key, ([], goal))
            numbers.append(str(number))
            places[key] = (numbers, goal)
        for numbers, goal in places.values():
            self._goal(goal, ",".join(numbers), font, bold)

    def robot(self, track: Sequence[tuple[float, float]], radius: float) -> None:
        """Draw the robot at its end: a disc, large enough to be seen around a goal."""
        x, y = track[-1]
        self._dot(self.pixel(x, y), (radius + 0.2) * self._metre, _END, outline=_PAPER)

    def dock(self, pose: Pose2D, radius: float) -> None:
        """Draw the charger: a square with a bolt."""
        x, y = self.pixel(pose.x, pose.y)
        half = (radius + 0.12) * self._metre
        box = (x - half, y - half, x + half, y + half)
        self._draw.rounded_rectangle(
            box,
            radius=0.1 * self._metre,
            fill=(255, 236, 179),
            outline=(240, 160, 0),
            width=2 * _SMOOTH,
        )
        bolt = (
            (0.1, -0.75),
            (-0.4, 0.12),
            (-0.03, 0.12),
            (-0.1, 0.75),
            (0.4, -0.12),
            (0.03, -0.12),
        )
        self._draw.polygon([(x + half * u, y + half * v) for u, v in bolt], fill=(240, 160, 0))

    def end(
        self,
        at: tuple[float, float],
        colour: Colour,
        radius: float,
        *,
        number: str,
        lost: bool,
    ) -> None:
        """Draw one of several robots at its end, with its number; a lost one with a cross."""
        x, y = self.pixel(*at)
        size = (radius + 0.15) * self._metre
        self._dot((x, y), size, colour, outline=_PAPER)
        if lost:
            for way in (1, -1):
                line = (x - size, y - way * size, x + size, y + way * size)
                self._draw.line(line, fill=_INK, width=4 * _SMOOTH)
        else:
            font = _font(14 * _SMOOTH)
            self._draw.text((x, y), number, fill=_PAPER, font=font, anchor="mm")

    def finish_several(
        self, title: str, legend: Sequence[tuple[str, Colour, float]]
    ) -> Image.Image:
        """Scale down and add the legend: name, colour and metres of each robot."""
        columns = 5
        rows = -(-len(legend) // columns)
        picture, draw, middle = self._with_lines(title, rows)
        width = picture.width // columns
        for i, (name, colour, length) in enumerate(legend):
            x, y = 20 + (i % columns) * width, middle + _LEGEND_PX // 2 + 28 * (i // columns) + 8
            draw.line([(x, y), (x + 36, y)], fill=colour, width=7)
            text = f"{name}  {length:.0f} m"
            draw.text((x + 48, y), text, fill=_INK, font=_font(16), anchor="lm")
        return picture

    def _with_lines(self, title: str, rows: int) -> tuple[Image.Image, ImageDraw.ImageDraw, int]:
        """Scale down; return the picture, its drawing context and the middle of its first line."""
        size = (self._image.width // _SMOOTH, self._image.height // _SMOOTH)
        height = size[1] + _LEGEND_PX + 28 * rows
        picture = Image.new("RGB", (size[0], height), _PAPER)
        picture.paste(self._image.reduce(_SMOOTH), (0, 0))
        draw = ImageDraw.Draw(picture)
        middle = size[1] + _LEGEND_PX // 2
        draw.text((20, middle), title, fill=_INK, font=_font(20), anchor="lm")
        return picture, draw, middle

    def finish(self, title: str, length: float) -> Image.Image:
        """Scale down and add the legend."""
        picture, draw, middle = self._with_lines(title, 0)
        size = picture.size
        left = size[0] - 480
        for i in range(160):
            draw.line([(left + i, middle - 4), (left + i, middle + 4)], fill=_blend(i / 159))
        draw.text((left - 10, middle), "start", fill=_INK, font=_font(16), anchor="rm")
        draw.text(
            (left + 170, middle), f"end  ({length:.1f} m)", fill=_INK, font=_font(16), anchor="lm"
        )
        bar = self._metre / _SMOOTH
        right = size[0] - 24
        draw.line([(right - bar, middle), (right, middle)], fill=_INK, width=3)
        for x in (right - bar, right):
            draw.line([(x, middle - 5), (x, middle + 5)], fill=_INK, width=2)
        draw.text((right - bar - 8, middle), "1 m", fill=_INK, font=_font(16), anchor="rm")
        return picture

    def _goal(
        self,
        goal: GoalMark,
        numbers: str,
        font: ImageFont.FreeTypeFont,
        bold: ImageFont.FreeTypeFont,
    ) -> None:
        x, y = self.pixel(goal.pose.x, goal.pose.y)
        colour = _REACHED if goal.reached else _MISSED
        yaw = goal.pose.yaw - self._grid.origin.yaw
        reach = 0.52 * self._metre
        tip = (x + reach * math.cos(yaw), y - reach * math.sin(yaw))
        wings = [
            (x + 0.3 * self._metre * math.cos(yaw + a), y - 0.3 * self._metre * math.sin(yaw + a))
            for a in (0.6, -0.6)
        ]
        self._draw.polygon([tip, *wings], fill=colour)
        self._dot((x, y), 0.3 * self._metre, colour, outline=_PAPER)
        self._draw.text((x, y), numbers, fill=_PAPER, font=bold, anchor="mm")
        if goal.label:
            place = (x, y + 0.36 * self._metre)
            self._draw.text(
                place,
                goal.label,
                fill=_INK,
                font=font,
                anchor="ma",
                stroke_width=2 * _SMOOTH,
                stroke_fill=_FLOOR,
            )

    def _dot(
        self, at: tuple[float, float], radius: float, fill: Colour, outline: Colour | None = None
    ) -> None:
        box = (at[0] - radius, at[1] - radius, at[0] + radius, at[1] + radius)
        self._draw.ellipse(box, fill=fill, outline=outline, width=2 * _SMOOTH if outline else 0)


def _shades(grid: OccupancyMap) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """Return the floor as colours, uint8 (rows from the top, columns, 3)."""
    cells = grid.cells[::-1]
    share = np.clip(cells, 0, OCCUPIED)[:, :, None] / OCCUPIED
    shades = np.array(_FLOOR) * (1.0 - share) + np.array(_WALL) * share
    shades[cells == UNKNOWN] = _OUTSIDE
    return shades.astype(np.uint8)


def _blend(share: float) -> Colour:
    r, g, b = (round(a + (z - a) * share) for a, z in zip(_START, _END, strict=True))
    return r, g, b


def _font(size: int) -> ImageFont.FreeTypeFont:
    font = ImageFont.load_default(size)
    assert isinstance(font, ImageFont.FreeTypeFont)
    return font


def _number(name: str) -> str:
    """Return the number at the end of a name, else its first letter."""
    digits = name[len(name.rstrip("0123456789")) :]
    return digits or name[:1]


def _length(track: Sequence[tuple[float, float]]) -> float:
    return sum(math.dist(a, b) for a, b in itertools.pairwise(track))
