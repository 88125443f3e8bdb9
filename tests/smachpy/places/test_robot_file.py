from __future__ import annotations

import dataclasses

import pytest

from smachpy.places.maps import OFFICE_ROBOT
from smachpy.places.pose import Pose2D
from smachpy.places.robot_file import SimConfig, load_config


def test_what_is_left_out_has_its_default(tmp_path):
    path = tmp_path / "r.yaml"
    path.write_text("robot: {radius: 0.4}\nstart: {x: 1, y: 2, yaw: 7}\n")
    config = load_config(path)
    assert config.robot.radius == 0.4
    assert config.robot == dataclasses.replace(SimConfig().robot, radius=0.4)
    assert config.planner == SimConfig().planner
    assert config.start == pytest.approx(Pose2D(1, 2, 7 - 6.283185307))
    assert config.dock is None


def test_the_office_robot_is_valid_and_starts_at_its_dock():
    config = load_config(OFFICE_ROBOT)
    assert config.start == config.dock


def test_every_parameter_has_unit_limits_and_a_sentence():
    config = SimConfig()
    for part in ("robot", "planner", "control", "recovery", "battery"):
        for item in dataclasses.fields(getattr(config, part)):
            if item.type != "bool":
                assert item.metadata["limits"].allow(item.default), item.name
                assert item.metadata["doc"].endswith("."), item.name
