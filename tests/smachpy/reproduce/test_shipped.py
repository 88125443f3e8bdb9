"""The shipped missions, recorded with the simulated robot, do the same again."""

from __future__ import annotations

import subprocess
import sys

import pytest

from smachpy.events.recording import read_recording
from smachpy.reproduce.report import lines_of
from smachpy.reproduce.run import reproduce

VIRTUAL = [
    "asking",
    "battery_check",
    "countdown",
    "delivery",
    "demo_action",
    "demo_service",
    "door",
    "guided_recovery",
    "hello",
    "inspect",
    "look_at",
    "mail",
    "move_cup",
    "patrol",
    "rp_action",
    "take_cup",
    "there_and_back",
    "watched_drive",
    "waypoints",
]


def recorded(mission, path, *options):
    """Run a mission in a process of its own."""
    command = [sys.executable, "-m", "smachpy", "run", mission, "--plain", "--record", str(path)]
    done = subprocess.run(
        [*command, *options],
        cwd=path.parent,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert path.exists(), done.stderr
    return read_recording(path)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # photos


@pytest.mark.slow
@pytest.mark.parametrize("mission", VIRTUAL)
def test_a_shipped_mission_recorded_in_virtual_time_is_reproduced(mission, tmp_path):
    recording = recorded(mission, tmp_path / "run.jsonl", "--time", "virtual")
    found = reproduce(recording)
    assert found.is_same, lines_of(found)
    assert found.comparison.total > 3


@pytest.mark.slow
@pytest.mark.parametrize("mission", ["there_and_back", "watched_drive", "battery_check"])
def test_a_shipped_mission_recorded_over_zenoh_is_reproduced(mission, tmp_path):
    recording = recorded(mission, tmp_path / "run.jsonl", "--start-robot")
    found = reproduce(recording)
    assert found.is_same, lines_of(found)
    assert found.comparison.total > 3
