"""The pictures of machines in the docs show the states that the machines have now."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import smachpy
from missions.lesson_6_server import go_and_look
from smachpy.command.targets import load_target

IMAGES = Path(__file__).parents[2] / "docs" / "images"
MISSIONS = [
    "delivery",
    "door",
    "explore",
    "guided_recovery",
    "inspect",
    "patrol",
    "patrol_run",
    "shuttle",
    "there_and_back",
    "waypoints",
]


def machine_of(picture):
    if picture == "look_at":  # the machine that is served; the mission only sends a goal to it
        return go_and_look()
    return load_target(picture.removesuffix("_run")).build()


@pytest.mark.parametrize("picture", [*MISSIONS, "look_at"])
def test_a_picture_shows_the_states_of_its_machine(picture):
    drawn = re.findall(r'id="a_(/[^"]*)"', (IMAGES / f"{picture}.svg").read_text("utf-8"))
    states = [record.path for record in smachpy.describe(machine_of(picture)).walk()]
    assert sorted(drawn) == sorted(states)
