"""Two packages of one name: the user's and ours."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import viz
from smachpy.command.extras import clash
from smachpy.command.targets import TargetError, load_target

pytestmark = pytest.mark.timeout(300)  # further Pythons, on a busy computer

ROOT = Path(viz.__file__).parents[1]
# As where smachpy is installed as users install it: the finders of an editable one help out.
PLAIN = f"""
import sys
sys.meta_path = [f for f in sys.meta_path if "Editable" not in repr(f)]
sys.path.append({str(ROOT)!r})
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
        ("run", "missions.fetch:mission"),
        ("run", "missions/fetch.py"),
        ("run", "missions.fetch:mission", "--time", "virtual", "--out", "out"),
        ("run", "missions.fetch:mission", "--record", "run.jsonl"),
        ("check", "missions.fetch:mission"),
        ("check", "mission.py"),
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


def test_missions_that_are_hidden_by_a_users_package_are_listed_as_hidden(folder):
    done = run(folder, "list")
    assert done.returncode == 0
    assert "patrol" in done.stdout
    assert "hidden by" in done.stdout


@pytest.mark.parametrize(
    ("file", "arguments"),
    [
        ("missions/__init__.py", ("check", "patrol")),
        ("viz.py", ("run", "mission.py")),
        ("viz.py", ("run", "mission.py", "--out", "out")),
        ("viz.py", ("render", "mission.py")),
        ("viz/__init__.py", ("view",)),
    ],
)
def test_a_users_package_that_hides_ours_is_named_with_ours(folder, file, arguments):
    (folder / file).parent.mkdir(exist_ok=True)
    (folder / file).write_text("")
    done = run(folder, *arguments)
    name = Path(file).parts[0]
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    for part in (str(folder / name), str(ROOT / name.removesuffix(".py")), "Try renaming yours"):
        assert part in done.stderr


@pytest.mark.parametrize("arguments", [("check", "mission.py"), ("run", "mission.py", "--json")])
def test_commands_that_do_not_need_it_go_on(folder, arguments):
    (folder / "viz.py").write_text("")
    assert run(folder, *arguments).returncode == 0


def test_a_users_package_that_is_hidden_by_ours_is_named(folder, monkeypatch):
    import missions

    (folder / "missions" / "night.py").write_text("")
    file = folder / "hidden.py"
    file.write_text("from missions.night import watch\n")
    ours, yours = Path(missions.__file__).parent, folder / "missions"
    with pytest.raises(TargetError) as caught:
        load_target(str(file))
    said = f"smachpy's own package here, {str(ours)!r}, which hides yours, {str(yours)!r}"
    assert said in str(caught.value)
    monkeypatch.chdir(folder)
    with pytest.raises(TargetError, match="Try renaming yours"):
        load_target("missions.night:watch")


def test_other_modules_do_not_clash(folder, tmp_path):
    empty = tmp_path / "empty"
    assert clash(ModuleNotFoundError("no", name="missions.nothing"), [empty]) is None
    assert clash(ModuleNotFoundError("no", name="my_robot"), [folder]) is None
    assert clash(ImportError("no")) is None
