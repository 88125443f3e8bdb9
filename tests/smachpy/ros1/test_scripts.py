"""Every script of tests/ros1_scripts runs, draws and checks as it is."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2] / "ros1_scripts"
NAMES = sorted(f"{path.stem}.py" for path in SCRIPTS.glob("*.py*") if path.is_file())
EXIT_CODES = {"serves_for_ever.py": 1}  # its end is a preempt


@pytest.fixture(scope="module")
def smachpy():
    """Return a function that runs the command and returns its exit code and output."""
    environment = {**os.environ, "PYTHONWARNINGS": "default", "COLUMNS": "200"}
    environment.pop("SMACHPY_INTERFACE_PATH", None)
    process = subprocess.Popen(
        [sys.executable, Path(__file__).with_name("forking.py")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )

    def run(*words):
        process.stdin.write(json.dumps([*map(str, words)]) + "\n")
        process.stdin.flush()
        answer = json.loads(process.stdout.readline())
        return answer["code"], answer["output"]

    yield run
    process.stdin.close()
    process.wait(30)
    process.stdout.close()


def test_there_are_enough():
    assert len(NAMES) >= 60


@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", NAMES)
def test_runs_renders_and_checks(name, scripts, smachpy, tmp_path):
    script = scripts / name
    code, output = smachpy("run", "--ros1", script, "--time", "virtual", "--plain")
    assert code == EXIT_CODES.get(name, 0), output
    assert "ended: " in output, output
    picture = tmp_path / "machine.json"
    code, output = smachpy("render", "--ros1", script, "-o", picture)
    assert code == 0, output
    assert picture.stat().st_size > 0
    code, output = smachpy("check", "--ros1", script, "--format", "json")
    assert code in {0, 1}, output
    assert '"severity": "error"' not in output, output
