"""What stands apart can be deleted: the rest is imported, runs, checks and passes its tests."""

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
left_out |= {needs_plans} if sys.argv[1] == "pnp" else set()
for module in pkgutil.walk_packages(smachpy.__path__, "smachpy."):
    if module.name not in left_out:
        importlib.import_module(module.name)
"""


@pytest.fixture(params=["pnp", "ros1", "sim"])
def rest(request, tmp_path):
    """A copy of the project without one of the rooms: its folder, and the room's name."""
    for name in KEPT:
        source = ROOT / name
        if source.is_dir():
            skip = shutil.ignore_patterns("__pycache__", "node_modules")
            shutil.copytree(source, tmp_path / name, ignore=skip)
        else:
            shutil.copy(source, tmp_path)
    shutil.rmtree(tmp_path / "smachpy" / request.param)
    # What is installed says less, too: the room's own entry points go with it.
    (metadata,) = (one for one in distribution("smachpy").files if one.name == "METADATA")
    installed = tmp_path / "smachpy.dist-info"
    shutil.copytree(metadata.locate().parent, installed)
    entries = (installed / "entry_points.txt").read_text(encoding="utf-8").splitlines(keepends=True)
    own = re.compile(rf"= smachpy\.{request.param}\b")
    text = "".join(line for line in entries if not own.search(line))
    (installed / "entry_points.txt").write_text(text, encoding="utf-8")
    return tmp_path, request.param


def run(folder, *words):
    paths = os.pathsep.join(str(folder / name) for name in ("", "viz", "missions"))
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        timeout=1100,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
    return done.stdout


def needs(test, room):
    """Return whether a file of tests is about a room, or uses it."""
    shared = {"sim": "|simulated_robot|start-robot|smachpy_missions.(?!lesson_0[123])|patrol"}
    words = rf"smachpy[./]{room}\b|smachpy import .*\b{room}\b|--{room}\b{shared.get(room, '')}"
    return re.search(words, test.read_text(encoding="utf-8")) is not None


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_the_rest_passes_without_a_room_that_stands_apart(rest):
    folder, room = rest
    run(folder, "-c", IMPORT_ALL, room)  # also of commands: they import the room when it is used
    run(folder, "-m", "smachpy", "check", "hello", "mail")
    run(folder, "-m", "smachpy", "run", "hello", "--plain")
    rooms = [folder / "tests" / "smachpy" / name for name in CORE]
    tests = [test for path in rooms for test in sorted(path.rglob("test_*.py"))]
    kept = [str(test.relative_to(folder)) for test in tests if not needs(test, room)]
    assert len(kept) > 0.8 * len(tests)
    chosen = "not slow and not zenoh and not browser and not ros1 and not rclpy and not postgres"
    run(folder, "-m", "pytest", "-q", "-m", chosen, *kept)
