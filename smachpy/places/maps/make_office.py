"""Draws the office floor: `python make_office.py` writes office.pgm and office.yaml.

27 x 17 m at 5 cm. The coordinates below are metres from the lower left corner of the image, which
is also the origin of the map frame.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from PIL import Image, ImageDraw

RESOLUTION: Final = 0.05  # [m]
WIDTH, HEIGHT = 27.0, 17.0  # [m]
UNKNOWN, FREE, SOLID = 205, 254, 0  # the shades map_saver writes
WALL: Final = 0.2  # [m]
DOOR: Final = 1.0  # [m]

WEST, EAST, SOUTH, NORTH = 0.5, 26.5, 0.5, 16.5
CORRIDOR_SOUTH, CORRIDOR_NORTH = 6.6, 8.8

YAML: Final = """\
# The office floor that make_office.py draws, in the form of ROS map_server.
image: office.pgm
resolution: 0.05              # [m/cell]
origin: [0.0, 0.0, 0.0]       # lower left corner: x [m], y [m], yaw [rad]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
mode: trinary
"""


class Floor:
    """A picture drawn in metres, y upwards."""

    def __init__(self) -> None:
        size = (round(WIDTH / RESOLUTION), round(HEIGHT / RESOLUTION))
        self.image = Image.new("L", size, UNKNOWN)
        self._draw = ImageDraw.Draw(self.image)

    def box(self, x0: float, y0: float, x1: float, y1: float, shade: int = SOLID) -> None:
        """Fill a rectangle between two corners."""
        self._draw.rectangle(self._pixels(x0, y0, x1, y1), fill=shade)

    def disc(self, x: float, y: float, radius: float) -> None:
        """Fill a circle."""
        self._draw.ellipse(self._pixels(x - radius, y - radius, x + radius, y + radius), fill=SOLID)

    def oval(self, x0: float, y0: float, x1: float, y1: float) -> None:
        """Fill an ellipse."""
        self._draw.ellipse(self._pixels(x0, y0, x1, y1), fill=SOLID)

    def wall_x(self, y: float, x0: float, x1: float, doors: tuple[float, ...] = ()) -> None:
        """Draw a wall along x, with a door around each x of `doors`."""
        self.box(x0, y - WALL / 2, x1, y + WALL / 2)
        for door in doors:
            self.box(door - DOOR / 2, y - WALL / 2, door + DOOR / 2, y + WALL / 2, FREE)

    def wall_y(self, x: float, y0: float, y1: float, doors: tuple[float, ...] = ()) -> None:
        """Draw a wall along y, with a door around each y of `doors`."""
        self.box(x - WALL / 2, y0, x + WALL / 2, y1)
        for door in doors:
            self.box(x - WALL / 2, door - DOOR / 2, x + WALL / 2, door + DOOR / 2, FREE)

    def desk(self, x: float, y: float, *, chair: float) -> None:
        """Put a desk of 1.6 x 0.8 m around (x, y) and its chair `chair` metres above it."""
        self.box(x - 0.8, y - 0.4, x + 0.8, y + 0.4)
        self.disc(x, y + chair, 0.22)

    def _pixels(self, x0: float, y0: float, x1: float, y1: float) -> tuple[int, int, int, int]:
        left, right = round(x0 / RESOLUTION), round(x1 / RESOLUTION) - 1
        top, bottom = round((HEIGHT - y1) / RESOLUTION), round((HEIGHT - y0) / RESOLUTION) - 1
        return left, top, max(left, right), max(top, bottom)


def shell(floor: Floor) -> None:
    """Outer walls, corridor and rooms."""
    floor.box(WEST, SOUTH, EAST, NORTH, FREE)
    for y in (SOUTH, NORTH):
        floor.wall_x(y, WEST - WALL / 2, EAST + WALL / 2)
    for x in (WEST, EAST):
        floor.wall_y(x, SOUTH, NORTH)
    floor.wall_x(CORRIDOR_SOUTH, WEST, EAST, doors=(2.2, 7.6, 11.8, 18.0, 24.6))
    floor.wall_x(CORRIDOR_NORTH, WEST, EAST, doors=(4.4, 9.0, 15.2, 19.6, 24.4))
    for x in (5.4, 9.2, 14.2, 21.2):
        floor.wall_y(x, SOUTH, CORRIDOR_SOUTH)
    floor.wall_y(6.4, CORRIDOR_NORTH, NORTH)
    floor.wall_y(11.6, CORRIDOR_NORTH, NORTH, doors=(15.2,))
    floor.wall_y(22.0, CORRIDOR_NORTH, NORTH)
    floor.wall_x(12.4, 22.0, EAST, doors=(23.2,))


def south_rooms(floor: Floor) -> None:
    """Three offices, the lab and the store room."""
    for x, shelf in ((2.9, 4.0), (7.3, 8.2), (12.0, 13.1)):
        floor.desk(x, 1.0, chair=0.72)
        floor.box(shelf, 5.9, shelf + 1.0, 6.5)  # a shelf beside the door
    floor.desk(2.9, 4.2, chair=-0.72)
    floor.box(5.6, 2.6, 6.0, 4.6)  # shelves along the walls
    floor.box(13.7, 2.4, 14.1, 4.8)
    floor.disc(0.95, 6.1, 0.22)  # plants
    floor.disc(5.9, 0.95, 0.2)
    floor.disc(13.7, 0.95, 0.2)
    floor.box(14.3, 0.6, 21.1, 1.2)  # the lab: a bench along the wall, two islands
    for x in (15.6, 19.0):
        floor.box(x - 0.6, 2.6, x + 1.2, 4.2)
        floor.disc(x + 0.3, 4.55, 0.2)
        floor.disc(x - 0.95, 3.4, 0.2)
    for y in (1.4, 3.0, 4.6):  # the store room
        floor.box(22.6, y, 25.2, y + 0.5)


def north_rooms(floor: Floor) -> None:
    """Kitchen, meeting room, open-plan office, print room and the quiet room."""
    floor.box(0.6, 15.8, 4.4, 16.4)  # kitchen: counter, fridge, a round table with chairs
    floor.box(5.5, 15.7, 6.3, 16.4)
    floor.disc(3.0, 12.6, 0.7)
    for dx, dy in ((1.05, 0.0), (-1.05, 0.0), (0.0, 1.05), (0.0, -1.05)):
        floor.disc(3.0 + dx, 12.6 + dy, 0.22)
    floor.oval(7.8, 11.2, 10.2, 14.4)  # meeting room
    for y in (11.9, 12.8, 13.7):
        floor.disc(7.45, y, 0.22)
        floor.disc(10.55, y, 0.22)
    floor.box(7.4, 16.3, 10.6, 16.4)  # the screen
    for x in (14.4, 18.6):  # open plan: islands of four desks, back to back
        for y in (11.7, 14.4):
            for side in (-0.82, 0.82):
                floor.desk(x + side, y + 0.4, chair=0.72)
                floor.desk(x + side, y - 0.4, chair=-0.72)
    floor.disc(12.1, 9.4, 0.22)
    floor.disc(21.5, 16.0, 0.22)
    floor.box(16.8, 8.9, 18.2, 9.3)  # lockers
    floor.box(25.6, 9.4, 26.4, 11.6)  # print room
    floor.box(22.1, 11.2, 22.7, 12.3)
    floor.box(24.2, 14.6, 26.2, 15.6)  # quiet room: a sofa and a low table
    floor.oval(24.6, 13.4, 25.8, 14.1)
    floor.disc(22.5, 16.0, 0.22)


def main() -> None:
    """Write the two files beside this script."""
    floor = Floor()
    shell(floor)
    south_rooms(floor)
    north_rooms(floor)
    floor.box(0.7, 8.3, 1.3, 8.65)  # corridor: copier, bench, plants
    floor.box(12.6, 6.7, 14.4, 7.05)
    floor.disc(26.1, 8.4, 0.22)
    floor.disc(26.1, 7.0, 0.22)
    here = Path(__file__).parent
    floor.image.save(here / "office.pgm")
    (here / "office.yaml").write_text(YAML, encoding="utf-8")


if __name__ == "__main__":
    main()
