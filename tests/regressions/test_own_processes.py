"""Processes that this project starts run no code that nobody has asked for."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import actionlib_core
import smachpy
import smachpy_viz
from actionlib_core.shutdown.child_process import python_command

STARTS_ITS_OWN = {
    "child_process.py",  # `python_command` itself
    "new.py",  # the text of a test, which has -P
}


def test_python_is_started_by_one_function_only():
    """Two of six places had forgotten -P: files of the current folder were executed."""
    found = {
        path.name
        for package in (actionlib_core, smachpy, smachpy_viz)
        for path in Path(package.__file__).parent.rglob("*.py")
        if "sys.executable" in path.read_text(encoding="utf-8")
    }
    assert found == STARTS_ITS_OWN


@pytest.mark.parametrize("flags", [[], ["-I"], ["-OO"], ["-E", "-s"], ["-X", "utf8=0"]])
def test_options_of_this_python_are_handed_on(flags, tmp_path):
    show = "import sys; print(*sys.flags)"
    nested = (
        "import subprocess; from actionlib_core.shutdown.child_process import python_command;"
        f"print(subprocess.check_output(python_command('-c', {show!r}), text=True))"
    )
    command = [sys.executable, "-P", *flags, "-c"]
    own, theirs = (
        subprocess.check_output([*command, code], text=True, cwd=tmp_path).split()
        for code in (show, nested)
    )
    assert theirs == own


def test_nothing_of_the_current_folder_is_imported(tmp_path):
    (tmp_path / "argparse.py").write_text("raise SystemExit(9)")
    command = python_command("-m", "smachpy.command", "--version")
    assert subprocess.run(command, cwd=tmp_path, capture_output=True).returncode == 0
