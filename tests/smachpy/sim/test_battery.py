from __future__ import annotations

import math

import pytest

from smachpy.places.robot_file import BatteryConfig
from smachpy.sim.battery import Battery

CONFIG = BatteryConfig(
    capacity=1.0, charge=0.5, idle_power=3.6, drive_power=36.0, charge_power=360.0
)


def test_it_drains_while_idle_and_faster_while_driving():
    battery = Battery(CONFIG, 10.0)
    assert battery.charge(110.0) == pytest.approx(0.4)
    battery.drive(110.0, 0.5)
    assert battery.power == pytest.approx(-21.6)
    assert battery.charge(120.0) == pytest.approx(0.34)


def test_it_is_never_emptier_than_empty_nor_fuller_than_full():
    battery = Battery(CONFIG, 0.0)
    assert battery.charge(1e6) == 0.0
    battery.fill(1e6)
    assert battery.charge(1e6 + 1.0) == pytest.approx(0.1)
    assert battery.charge(2e6) == 1.0


def test_it_knows_how_long_charging_takes():
    battery = Battery(CONFIG, 0.0)
    assert battery.seconds_until(0.9, 0.0) == math.inf
    battery.fill(0.0)
    assert battery.seconds_until(0.9, 0.0) == pytest.approx(4.0)
    assert battery.seconds_until(0.4, 0.0) == 0.0
