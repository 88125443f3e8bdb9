"""Every script of tests/ros1_scripts runs, draws and checks as it is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2] / "ros1_scripts"
NAMES = sorted(path.name for path in SCRIPTS.glob("*.py"))


def smachpy(*words, timeout=120):
    """Run the command; returns what `subprocess.run` does."""
    environment = {**os.environ, "PYTHONWARNINGS": "default", "COLUMNS": "200"}
    program = "import sys; from smachpy_programs import smachpy; sys.exit(smachpy())"
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, words)],
        capture_output=True,
        text=True,
        timeout=timeout,
        env=environment,
        check=False,
    )


@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", NAMES)
def test_runs_renders_and_checks(name, tmp_path):
    script = SCRIPTS / name
    ran = smachpy("run", "--ros1", script, "--time", "virtual", "--plain")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "ended: " in ran.stdout, ran.stdout + ran.stderr
    picture = tmp_path / "machine.json"
    drawn = smachpy("render", "--ros1", script, "-o", picture)
    assert drawn.returncode == 0, drawn.stdout + drawn.stderr
    assert picture.stat().st_size > 0
    checked = smachpy("check", "--ros1", script, "--format", "json")
    assert checked.returncode in {0, 1}, checked.stdout + checked.stderr
    assert '"severity": "error"' not in checked.stdout, checked.stdout
