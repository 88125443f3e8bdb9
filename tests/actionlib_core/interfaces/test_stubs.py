"""The typed stubs: those shipped are current, and mypy learns the fields from them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from actionlib_core import interfaces
from actionlib_core.interfaces import _stubs
from actionlib_core.interfaces._registry import Registry
from actionlib_core.interfaces._sources import BUNDLED, Sources

ROOT = Path(interfaces.__file__).parents[2]


def test_shipped_stubs_are_current() -> None:
    folder = Path(interfaces.__file__).parent
    expected = _stubs.bundled_stubs()
    shipped = {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*.pyi")}
    outdated = {name for name in expected | shipped if expected.get(name) != shipped.get(name)}
    assert not outdated, "Run: python -m actionlib_core.interfaces._stubs"


def own_package(root: Path) -> Registry:
    folder = root / "my_pkg" / "msg"
    folder.mkdir(parents=True)
    (folder / "Odd.msg").write_text(
        '# It\'s \\ """odd"""\n\nint32 int  # a name\nfloat32 X=inf\nstring Y=a\'b\n'
        "Other[] others\nHeader header\nchar[4] list\nuint8 in\n"
    )
    (folder / "Other.msg").write_text("duration d\n")
    return Registry(Sources(folders=[root, BUNDLED]))


def test_own_package(tmp_path: Path) -> None:
    files = _stubs.package_stubs(own_package(tmp_path), "my_pkg")
    assert list(files) == ["my_pkg/__init__.pyi", "my_pkg/msg.pyi"]
    text = files["my_pkg/msg.pyi"]
    assert "    int: _builtins.int  # a name\n" in text
    assert "    others: list[Other]" not in text  # a field is named list
    assert "    others: _builtins.list[Other]\n" in text
    assert "    header: _std_msgs_msg.Header\n" in text
    assert "    X: _Final = float('inf')" in text
    assert "in_: _builtins.int" in text
    compile(text, "msg.pyi", "exec")


@pytest.mark.slow
@pytest.mark.timeout(900)  # mypy reads all interfaces anew
def test_mypy_knows_the_fields(tmp_path: Path) -> None:
    _stubs.write(_stubs.package_stubs(own_package(tmp_path), "my_pkg"), tmp_path / "typings")
    program = tmp_path / "program.py"
    program.write_text(
        "from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal\n"
        "from my_pkg.msg import Odd, Other\n"
        "goal = MoveBaseGoal()\n"
        "goal.target_pose.pose.position.x = 1\n"
        "goal.target_pose.pose.position.x = 'a'\n"
        "odd = Odd(others=[Other(d=1.5)], int=3)\n"
        "odd.others[0].d.to_sec()\n"
        "odd.nothing\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-incremental", str(program)],
        capture_output=True,
        text=True,
        timeout=800,
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": os.pathsep.join([str(tmp_path / "typings"), str(ROOT)])},
    )
    errors = [line for line in done.stdout.splitlines() if "program.py" in line]
    assert [line.split(":")[1] for line in errors] == ["5", "8"], done.stdout + done.stderr
