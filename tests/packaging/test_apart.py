"""What stands apart can be deleted: the rest imports, checks, runs and passes its tests."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
KEPT = ("actionlib_core", "smachpy", "viz", "missions", "tests", "docs", "pyproject.toml")
CORE = ("machines", "engine", "userdata", "checks", "places")

IMPORT_ALL = """
import importlib, pkgutil, sys, smachpy
needs_plans = "smachpy.ros1.names.pnp_cmd_ros"  # the names of a program that runs plans
left_out = {"smachpy.__main__", "smachpy.command.__main__"}
left_out |= {needs_plans} if "pnp" in sys.argv else set()
for module in pkgutil.walk_packages(smachpy.__path__, "smachpy."):
    if module.name not in left_out:
        importlib.import_module(module.name)
"""


APART = ("pnp", "ros1", "sim")


def without(rooms, folder):
    """Copy the project to a folder without some rooms."""
    for name in KEPT:
        source = ROOT / name
        if source.is_dir():
            skip = shutil.ignore_patterns("__pycache__", "node_modules")
            shutil.copytree(source, folder / name, ignore=skip)
        else:
            shutil.copy(source, folder)
    for room in rooms:
        shutil.rmtree(folder / "smachpy" / room)
    # What is installed says less, too: a room's own entry points go with it.
    (metadata,) = (one for one in distribution("smachpy").files if one.name == "METADATA")
    installed = folder / "smachpy.dist-info"
    shutil.copytree(metadata.locate().parent, installed)
    entries = (installed / "entry_points.txt").read_text(encoding="utf-8").splitlines(keepends=True)
    own = re.compile(rf"= smachpy\.({'|'.join(rooms)})\b")
    text = "".join(line for line in entries if not own.search(line))
    (installed / "entry_points.txt").write_text(text, encoding="utf-8")


def run(folder, *words):
    paths = os.pathsep.join(str(folder / name) for name in ("", "viz", "missions"))
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        timeout=800,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
    return done.stdout


def needs_none_of(rooms, test):
    """Return whether a file of tests is about none of the rooms, and uses none."""
    name = rf"({'|'.join(rooms)})"
    words = rf"smachpy[./]{name}\b|smachpy import .*\b{name}\b|--{name}\b"
    simulated = r"simulated_robot|start-robot|smachpy_missions.(?!lesson_0[123])|patrol"
    return re.search(f"{words}|{simulated}", test.read_text(encoding="utf-8")) is None


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("room", APART)
def test_without_a_room_that_stands_apart_all_else_imports_checks_and_runs(room, tmp_path):
    without([room], tmp_path)
    run(tmp_path, "-c", IMPORT_ALL, room)  # also of commands: they import the room when it is used
    run(tmp_path, "-m", "smachpy", "check", "hello", "mail")
    run(tmp_path, "-m", "smachpy", "run", "hello", "--plain")


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_without_all_rooms_that_stand_apart_the_core_passes_its_tests(tmp_path):
    # One room less can break only what knows it, and the linter's contract names who does.
    without(APART, tmp_path)
    run(tmp_path, "-c", IMPORT_ALL, *APART)
    rooms = [tmp_path / "tests" / "smachpy" / name for name in CORE]
    tests = [test for path in rooms for test in sorted(path.rglob("test_*.py"))]
    kept = [str(test.relative_to(tmp_path)) for test in tests if needs_none_of(APART, test)]
    assert len(kept) > 0.7 * len(tests)
    chosen = "not slow and not zenoh and not browser and not ros1 and not rclpy and not postgres"
    run(tmp_path, "-m", "pytest", "-q", "-m", chosen, *kept)
