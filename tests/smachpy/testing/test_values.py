"""What an exploration remembers of userdata."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import pytest

from smachpy._core.readonly import read_only
from smachpy.testing._core.values import Snapshot, Values, is_frozen


@dataclass(frozen=True)
class Shelf:
    number: int
    where: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Tray:
    items: list[str] = field(default_factory=list)


@dataclass
class Battery:
    charge: float


class Pose(NamedTuple):
    x: float
    y: object


@pytest.mark.parametrize(
    ("value", "frozen"),
    [
        (1, True),
        ("a", True),
        ((1, (2, "b")), True),
        (Pose(1.0, 2.0), True),
        (Shelf(3), True),
        ((1, [2]), False),
        (Pose(1.0, []), False),
        (Tray(), False),
        (Battery(0.5), False),
        ([], False),
        ({}, False),
    ],
)
def test_what_cannot_change(value, frozen):
    assert is_frozen(value) is frozen


def test_values_that_look_the_same_compare_equal_also_behind_a_read_only_view():
    values = Values()
    route = [Shelf(1), Shelf(2), Battery(0.5)]
    before = values.comparable(route)
    assert values.comparable([Shelf(1), Shelf(2), Battery(0.5)]) == before
    assert values.comparable(read_only(route)) == before
    assert values.comparable(tuple(route)) != before
    assert values.comparable([Shelf(1)]) != before


def test_what_changes_is_looked_at_again():
    values = Values()
    tray, battery = Tray(), Battery(0.5)
    before = values.comparable([tray, battery])
    tray.items.append("mail")
    after = values.comparable([tray, battery])
    assert after != before
    battery.charge = 0.4
    assert values.comparable([tray, battery]) not in {before, after}


def test_a_copy_shares_only_what_cannot_change():
    shelf, tray = Shelf(1), Tray(["mail"])
    data = {"route": [shelf], "tray": tray, "again": tray}
    copied = Snapshot(data).copy()
    assert copied == data
    assert copied["route"][0] is shelf
    assert copied["route"] is not data["route"]
    assert copied["tray"].items is not tray.items
    assert copied["again"] is copied["tray"]
