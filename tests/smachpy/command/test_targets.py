"""Naming a machine on a command line: missions, modules, files."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import EntryPoint

import pytest

import smachpy
import smachpy.command.targets
from smachpy.command.targets import Target, TargetError, list_missions, load_target

FILE = '''
import smachpy

def mission(speed=1.0):
    """Drive about.

    More words.
    """
    machine = smachpy.StateMachine(outcomes=["done"])
    machine.userdata.speed = speed
    with machine:
        smachpy.StateMachine.add("GO", smachpy.CBState(lambda ud: "done", outcomes=["done"]))
    return machine

def other():
    return 3

number = 5
'''


def make_mission():
    """Say hello."""
    machine = smachpy.StateMachine(outcomes=["done"])
    with machine:
        smachpy.StateMachine.add("GO", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    return machine


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "drive_about.py"
    path.write_text(FILE)
    return path


@pytest.fixture(autouse=True)
def missions(monkeypatch):
    points = [EntryPoint("hello", f"{__name__}:make_mission", smachpy.command.targets.GROUP)]
    monkeypatch.setattr(EntryPoint, "load", lambda _: make_mission)
    monkeypatch.setattr(smachpy.command.targets, "entry_points", lambda **_: points)


def test_a_mission_s_name_gives_its_factory():
    target = load_target("hello")
    assert (target.name, target.summary) == ("hello", "Say hello.")
    assert target.build().execute() == "done"
    assert list(list_missions()) == ["hello"]


def test_an_unknown_mission_names_the_nearest():
    with pytest.raises(
        TargetError, match=r"target 'helo': no such mission; .*Did you mean 'hello'"
    ):
        load_target("helo")


@pytest.mark.parametrize("text", ["drive_about.py", "drive_about.py:mission", "./drive_about.py"])
def test_a_file_gives_its_mission(file, text):
    target = load_target(text)
    assert target.summary == "Drive about."
    machine = target.build(speed=2.0)
    assert machine.userdata.speed == 2.0
    assert machine.execute() == "done"


def test_a_file_that_changes_within_a_second_is_read_anew(tmp_path, monkeypatch):
    """Python took its cached bytecode: a mission with another limit did as before."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    path = tmp_path / "limit.py"
    for speed in ("1.0", "2.0"):
        path.write_text(FILE.replace("1.0", speed))
        os.utime(path, (1_000_000_000, 1_000_000_000))
        assert load_target(str(path)).build().userdata.speed == float(speed)


def test_the_only_marked_function_of_a_file_is_its_mission(tmp_path):
    path = tmp_path / "marked.py"
    marked = "@smachpy.mission\ndef {}():\n    return smachpy.StateMachine(['ok'])\n"
    path.write_text(
        "import smachpy\nfrom smachpy_missions.course.countdown import countdown\n"
        + marked.format("main")
    )
    assert load_target(str(path)).thing.__name__ == "main"
    path.write_text(path.read_text() + marked.format("other"))
    with pytest.raises(TargetError, match="which machine is meant"):
        load_target(str(path))


def test_two_machines_of_one_file_have_two_names_for_viewers(file):
    file.write_text(FILE + "\ndef make_other():\n    return mission()\n")
    named = load_target(f"{file}:make_other")
    assert (named.name, named.shown_name) == (file.stem, f"{file.stem}_make_other")
    for plain in (str(file), f"{file}:mission"):
        assert load_target(plain).shown_name == ""


def test_a_module_gives_the_named_factory(file):
    assert load_target("drive_about:mission").build().execute() == "done"


def test_a_finished_machine_is_a_target_too(file):
    file.write_text(FILE + "\nmachine = mission()\n")
    assert load_target("drive_about.py:machine").build().execute() == "done"
    with pytest.raises(TargetError, match="is a finished machine"):
        load_target("drive_about.py:machine").build(speed=1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("drive_abuot.py", "no file 'drive_abuot.py'; .*Did you mean 'drive_about.py'"),
        ("drive_about.py:misson", "nothing is called 'misson'; .*Did you mean 'mission'"),
        ("drive_about.py:number", "number is 5; expected a machine or a function"),
        ("no_such_module:x", "no module 'no_such_module'"),
    ],
)
def test_a_wrong_name_says_what_is_wrong(file, text, words):
    with pytest.raises(TargetError, match=words) as caught:
        load_target(text)
    assert caught.value.target == text


def test_a_wrong_name_lists_no_names_that_were_imported_from_elsewhere(file):
    """`from smachpy import *` filled the list with smachpy's own functions."""
    file.write_text("from smachpy import *\n" + FILE)
    with pytest.raises(TargetError, match=r"expected one of \['mission', 'other'\]"):
        load_target("drive_about.py:nope")


def test_a_wrong_name_in_a_package_lists_what_the_package_has_from_its_modules(
    tmp_path, monkeypatch
):
    (tmp_path / "tours").mkdir()
    (tmp_path / "tours" / "__init__.py").write_text("from tours.long import mission\n")
    (tmp_path / "tours" / "long.py").write_text(FILE)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(TargetError, match=r"expected one of .*mission.*Did you mean 'mission'"):
        load_target("tours:misson")


def test_a_factory_that_gives_no_machine_is_an_error(file):
    with pytest.raises(TargetError, match="returned 3; expected a state machine"):
        load_target("drive_about.py:other").build()


def test_a_factory_that_needs_arguments_is_named_with_them_where_there_are_none():
    target = Target("go", "here:go", "", lambda robot, x, y=0.0, **more: None)
    with pytest.raises(TargetError, match=r"here:go needs robot, x; expected .* or a function"):
        target.build()


def test_an_argument_the_factory_does_not_take_is_an_error(file):
    with pytest.raises(TargetError, match=r"mission\(speed=1.0\) cannot be called with \['sped'\]"):
        load_target("drive_about.py:mission").build(sped=1)


def test_a_file_that_raises_says_so_and_chains_the_cause(file):
    file.write_text("def half():\n    return 1 / 0\n\nhalf()\n")
    with pytest.raises(TargetError, match="raised ZeroDivisionError") as caught:
        load_target("drive_about.py")
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    assert str(caught.value).endswith(":4 in <module>: half()\n    " + LINE.format(file))


LINE = "{}:2 in half: return 1 / 0"


def test_a_file_without_a_machine_says_what_it_looked_for(file):
    file.write_text("x = 1\n")
    with pytest.raises(TargetError, match="no machine and no function"):
        load_target("drive_about.py")
    file.write_text("from re import match\ndef build(): ...\n")
    with pytest.raises(TargetError, match=r"got \['build'\]"):
        load_target("drive_about.py")


TYPED = """
from __future__ import annotations

from dataclasses import dataclass

import smachpy


@dataclass
class {name}:
    n: int = 0


@dataclass
class Data:
    item: {name} | None = None


def write(ud):
    ud.item = {name}()
    return "done"


def mission():
    sm = smachpy.StateMachine(["done"], userdata_type=Data)
    sm.add("GO", smachpy.CBState(write, outcomes=["done"], output_keys=["item"]))
    return sm
"""


def test_files_of_one_name_have_modules_of_their_own(file):
    """Annotations of a dataclass are looked up in the module of its name."""
    for folder, name in [("here", "Box"), ("there", "Crate"), ("here", "Box")]:
        path = file.parent / folder / "typed_target.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text(TYPED.format(name=name))
        machine = load_target(str(path)).build()
        assert machine.execute() == "done"
        assert type(machine.userdata.item).__name__ == name


def test_a_file_that_raises_leaves_no_half_module_behind(file):
    (file.parent / "half_target.py").write_text("1 / 0\n")
    with pytest.raises(TargetError):
        load_target("half_target.py")
    assert "half_target" not in sys.modules


def test_a_factory_that_raises_is_an_error_of_the_target(tmp_path):
    path = tmp_path / "job.py"
    path.write_text("def mission():\n    raise ValueError('no map')\n")
    with pytest.raises(TargetError, match="raised ValueError: no map") as caught:
        load_target(str(path)).build()
    assert isinstance(caught.value.__cause__, ValueError)
    assert f"{path}:2 in mission: raise ValueError" in str(caught.value)
    path.write_text("def mission(): ...\n")
    with pytest.raises(TargetError, match="at the end"):
        load_target(str(path)).build()


def test_no_control_character_of_an_exception_reaches_the_terminal(tmp_path):
    path = tmp_path / "job.py"
    path.write_text("def mission():\n    raise ValueError('\\x1b]0;title\\x07')\n")
    for more in ([], ["--debug"]):
        command = [sys.executable, "-m", "smachpy.command", "run", str(path), *more]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 2 if not more else done.returncode != 0
        assert "title" in done.stderr
        assert "\x1b" not in done.stderr + done.stdout


@pytest.mark.parametrize("line", ["import rospy", "from geometry_msgs.msg import Pose"])
def test_a_script_for_ros_1_is_told_of_the_option_for_it(tmp_path, line):
    path = tmp_path / "old.py"
    path.write_text(f"{line}\n")
    with pytest.raises(TargetError, match=r"is a module of ROS 1.*Try the option --ros1"):
        load_target(str(path))
    path.write_text("import no_such_module\n")
    with pytest.raises(TargetError) as raised:
        load_target(str(path))
    assert "--ros1" not in str(raised.value)


def test_a_mission_that_needs_an_extra_when_it_is_built_says_which(tmp_path):
    path = tmp_path / "drawing.py"
    path.write_text("def mission():\n    raise ModuleNotFoundError('no PIL', name='PIL')\n")
    with pytest.raises(
        TargetError, match=r"package 'PIL' is missing. Try: pip install 'smachpy\[sim\]'"
    ):
        load_target(str(path)).build()


@pytest.mark.parametrize("line", ["sys.exit()", "sys.exit(3)", 'sys.exit("no robot")'])
def test_a_file_or_factory_that_ends_the_program_is_an_error(tmp_path, line):
    # Otherwise `smachpy run` and `smachpy check` would end with 0, without a run or a check.
    path = tmp_path / "ends.py"
    path.write_text(f"import sys\n{line}\n")
    with pytest.raises(TargetError, match="running the file raised SystemExit"):
        load_target(str(path))
    path.write_text(f"import sys\ndef mission():\n    {line}\n")
    with pytest.raises(TargetError, match=":mission raised SystemExit"):
        load_target(str(path)).build()


@pytest.mark.parametrize("line", ["os.chdir('..')", "sys.path.clear()"])
def test_a_file_may_change_the_folder_and_the_python_path(file, monkeypatch, line):
    monkeypatch.setattr(sys, "path", sys.path[:])
    file.write_text(f"import os, sys\n{line}\n{FILE}")
    assert load_target("drive_about.py").build().execute() == "done"


@pytest.mark.parametrize("name", ["drive.yaml", "drive.pnml"])
def test_where_no_file_of_its_kind_is_no_list_of_them_is_shown(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(TargetError, match=f"no file '{name}'; expected one that is there\\."):
        load_target(name)


def test_a_folder_is_not_suggested_as_a_file(tmp_path):
    (tmp_path / "drive.py").mkdir()
    with pytest.raises(TargetError, match=r"no file .*drive\.py'\. Try 'smachpy new drive'\.\n"):
        load_target(str(tmp_path / "drive.py"))


def test_a_function_whose_parameters_python_cannot_tell_is_no_mission(file):
    file.write_text("mission = int\n")
    with pytest.raises(TargetError, match="is <class 'int'>; expected a machine or a function"):
        load_target("drive_about.py")


def _install(monkeypatch, *values):
    points = [EntryPoint("mine", value, smachpy.command.targets.GROUP) for value in values]
    monkeypatch.undo()  # what `missions` replaced
    monkeypatch.setattr(smachpy.command.targets, "entry_points", lambda **_: points)


@pytest.mark.parametrize(
    ("source", "problem"),
    [
        ("1 / 0", "importing 'mine_of_mine:mission' raised ZeroDivisionError: division by zero"),
        ("raise SystemExit", "importing 'mine_of_mine:mission' raised SystemExit: "),
        ("x = 1", "importing 'mine_of_mine:mission' raised AttributeError: "),
        ("mission = 3", "mine_of_mine:mission is 3; expected a machine or a function"),
    ],
)
def test_an_installed_mission_that_cannot_be_loaded_is_told_in_the_list(
    tmp_path, monkeypatch, source, problem
):
    _install(monkeypatch, "mine_of_mine:mission")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mine_of_mine", raising=False)
    (tmp_path / "mine_of_mine.py").write_text(f"{source}\n")
    assert list_missions()["mine"].startswith(f"not available: {problem}")
    with pytest.raises(TargetError, match="mine_of_mine:mission"):
        load_target("mine")


def test_two_packages_with_a_mission_of_one_name(monkeypatch):
    one, other = f"{__name__}:make_mission", f"{__name__}:other"
    _install(monkeypatch, one, other)
    with pytest.raises(TargetError, match=f"have 2 missions of that name.*Try {one} or {other}"):
        load_target("mine")
    assert list_missions()["mine"].startswith("not available: ")
    _install(monkeypatch, one, one)  # the same package, found twice on the Python path
    assert load_target("mine").summary == "Say hello."


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Write a package with a module that holds a mission; return a function that does."""
    monkeypatch.chdir(tmp_path)
    before = set(sys.modules)

    def write(line, name="my_robot"):
        inner = tmp_path / "src" / name / "wards"
        inner.mkdir(parents=True, exist_ok=True)
        (inner / "__init__.py").touch()
        (inner.parent / "__init__.py").touch()
        (inner.parent / "places.py").write_text("WARD = 'A'\n")
        file = inner / "hospital.py"
        file.write_text(f"{line}\n{FILE}")
        return file

    yield write
    for module in set(sys.modules) - before:
        del sys.modules[module]


@pytest.mark.parametrize(
    "line",
    ["from ..places import WARD", "from my_robot.places import WARD", "import my_robot.places"],
)
def test_a_file_of_a_package_is_a_module_of_it(package, line):
    path = package(line)
    assert list(load_target(str(path)).build().get_children()) == ["GO"]
    assert load_target(f"{path}:mission").source == "my_robot.wards.hospital:mission"


def test_a_link_to_a_file_of_a_package_is_this_module(package, tmp_path):
    (tmp_path / "current.py").symlink_to(package("from ..places import WARD"))
    found = load_target("current.py")
    assert found.source == "my_robot.wards.hospital:mission"
    assert found.build()


def test_a_module_with_a_dot_needs_no_function(package, monkeypatch, tmp_path):
    package("from ..places import WARD")
    monkeypatch.chdir(tmp_path / "src")
    assert load_target("my_robot.wards.hospital").name == "hospital"
    with pytest.raises(TargetError, match="no such mission; expected one of"):
        load_target("my_robot.wards.hospitals")


def test_a_file_of_a_package_whose_name_is_taken_is_run_as_a_file(package):
    path = package("", name="json")
    assert load_target(str(path)).source == "hospital:mission"


def test_a_module_that_lacks_another_one_says_which(package):
    path = package("import nobody_has_this")
    with pytest.raises(
        TargetError, match=r"importing 'my_robot\.wards\.hospital' raised .*nobody_has"
    ):
        load_target(str(path))
    path.write_text("import rospy\n")
    with pytest.raises(TargetError, match=r"(?s)'rospy' is a module of ROS 1.*--ros1"):
        load_target(str(path))
