"""The pictures of machines in the docs show the states that the machines have now."""

from __future__ import annotations

import re

import pytest

import smachpy
from smachpy.command.targets import load_target
from smachpy_missions.lesson_11_server import look
from tests.places import DOCS

IMAGES = DOCS / "images"
MISSIONS = [
    "asking",
    "battery_check",
    "delivery",
    "door",
    "explore",
    "guided_recovery",
    "hello",
    "inspect",
    "mail",
    "move_cup",
    "patrol",
    "patrol_run",
    "shuttle",
    "take_cup",
    "there_and_back",
    "watched_drive",
    "waypoints",
]


def machine_of(picture):
    if picture == "look_at":  # the machine that is served; the mission only sends a goal to it
        return look()
    return load_target(picture.removesuffix("_run")).build()


@pytest.mark.parametrize("picture", [*MISSIONS, "look_at"])
def test_a_picture_shows_the_states_of_its_machine(picture):
    drawn = re.findall(r'id="a_(/[^"]*)"', (IMAGES / f"{picture}.svg").read_text("utf-8"))
    states = [record.path for record in smachpy.describe(machine_of(picture)).walk()]
    assert sorted(drawn) == sorted(states)
