"""A user's packages whose names are also those of folders of this project."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

import smachpy

pytestmark = pytest.mark.timeout(900)  # further Pythons, on a busy computer

ROOT = Path(smachpy.__file__).parents[1]
# As where smachpy is installed as users install it: the finders of an editable one help out.
PLAIN = f"""
import sys
sys.meta_path = [f for f in sys.meta_path if "Editable" not in repr(f)]
sys.path += [{str(ROOT)!r}, {str(ROOT / "viz")!r}, {str(ROOT / "missions")!r}]
from smachpy.command import main
sys.exit(main())
"""
MISSION = """
import smachpy
def mission():
    sm = smachpy.StateMachine(outcomes=["done"], name="M")
    with sm:
        sm.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    return sm
"""


def run(folder, *arguments, program=PLAIN, on_path=True):
    return subprocess.run(
        [sys.executable, "-P", "-c", program, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder) if on_path else ""},
        capture_output=True,
        text=True,
        timeout=280,
    )


@pytest.fixture
def folder(tmp_path):
    """A folder with a mission, and a package `missions` with another one."""
    (tmp_path / "mission.py").write_text(MISSION)
    (tmp_path / "missions").mkdir()
    (tmp_path / "missions" / "__init__.py").write_text("")
    (tmp_path / "missions" / "fetch.py").write_text(MISSION)
    return tmp_path


@pytest.mark.parametrize("on_path", [False, True])
@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "missions/fetch.py"),
        ("run", "missions.fetch:mission", "--time", "virtual", "--out", "o", "--record", "r.jsonl"),
        ("check", "missions.fetch:mission"),
        ("render", "missions.fetch:mission", "-o", "m.svg"),
    ],
)
def test_a_users_package_called_missions_works(folder, arguments, on_path):
    done = run(folder, *arguments, on_path=on_path)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.zenoh
def test_a_users_package_called_missions_works_with_the_robot_and_the_viewer(folder):
    arguments = ("--start-robot", "--view", "--view-for", "0", "--port", "0")
    done = run(folder, "run", "missions.fetch:mission", *arguments)
    assert done.returncode == 0, done.stderr


def test_a_users_package_called_missions_works_where_smachpy_is_installed_as_here(folder):
    here = "import sys; from smachpy.command import main; sys.exit(main())"
    done = run(folder, "run", "missions.fetch:mission", program=here, on_path=False)
    assert done.returncode == 0, done.stderr


def test_a_users_package_called_missions_works_under_pytest(folder):
    (folder / "test_fetch.py").write_text(
        "from missions.fetch import mission as fetch\n"
        "def test_fetch(mission):\n"
        "    assert fetch().execute() == 'done'\n"
    )
    program = PLAIN.replace("from smachpy.command import main", "from pytest import main")
    done = run(folder, "-q", "-p", "no:cacheprovider", program=program, on_path=False)
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout


@pytest.mark.parametrize(
    "arguments",
    [
        ("list",),
        ("check", "patrol"),
        ("run", "mission.py", "--out", "out"),
        ("render", "mission.py", "-o", "m.svg"),
    ],
)
def test_a_users_packages_of_ordinary_names_stop_no_command(folder, arguments):
    for name in ("viz", "missions", "tests", "state", "smach"):
        (folder / name).mkdir(exist_ok=True)
        (folder / name / "__init__.py").write_text("raise AssertionError('imported')")
    done = run(folder, *arguments)
    assert (done.returncode, done.stderr) == (0, "")


def test_only_names_of_smachpy_and_actionlib_core_are_installed():
    found = packages_distributions()
    ours = {name for name, owners in found.items() if "smachpy" in owners}
    assert {one for one in ours if not one.startswith("__editable__")} <= {
        "smachpy", "actionlib_core", "smachpy_viz", "smachpy_missions", "smachpy_programs",
    }  # fmt: skip
