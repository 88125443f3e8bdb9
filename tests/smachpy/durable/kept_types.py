"""Classes of a user, whose values journals keep."""

from __future__ import annotations

import enum
from dataclasses import InitVar, dataclass, field
from typing import Any, NamedTuple, TypedDict


class Colour(enum.Enum):
    RED = 1
    GREEN = "green"
    CRIMSON = 1  # noqa: PIE796  an alias


class Level(enum.IntEnum):
    LOW = 1


class Ways(enum.Flag):
    IN = 1
    OUT = 2


class Point(NamedTuple):
    x: float
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class Waypoint:
    at: Point
    colour: Colour = Colour.RED


@dataclass
class Route:
    waypoints: list[Waypoint]
    by_name: dict[str, Waypoint | None] = field(default_factory=dict)
    length: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        self.length = float(len(self.waypoints))


@dataclass
class WithInitVar:
    x: int = field(init=False)
    y: InitVar[int]

    def __post_init__(self, y: int) -> None:
        self.x = y


@dataclass
class Stranger:
    x: int = 1


class Socket:
    def __init__(self, address: str) -> None:
        self.address = address

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Socket) and other.address == self.address

    __hash__ = None


class Values(TypedDict):
    route: Route
    ways: Ways
    anything: Any


class MyDict(dict):
    pass
