"""`smachpy new`: writes a mission with a test and a README, or copies a shipped mission."""

from __future__ import annotations

import inspect
import keyword
import re
import shutil
import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.process.output import printable
from smachpy.command import UsageError
from smachpy.command.targets import load_target
from smachpy.machines.mission_info import mission_info

if TYPE_CHECKING:
    import argparse

_MISSION = '''"""Drive to a place, look around, come back."""

import smachpy
from smachpy.states import Pose2D, drive_to

PLACE = Pose2D(11.5, 8.0, 0.0)  # x, y [m] and yaw [rad] on the map
HOME = Pose2D(9.8, 8.0, 0.0)


@smachpy.state(outcomes=["done"])
def look_around(userdata: smachpy.UserData) -> str:
    """Replace this by what your robot does at the place."""
    return "done"


@smachpy.mission
def {name}() -> smachpy.StateMachine:
    """Drive to a place, look around, come back."""
    sm = smachpy.StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="{label}")
    with sm:
        sm.add("GO", drive_to(PLACE, exec_timeout=120.0), transitions={{"succeeded": "LOOK"}})
        sm.add("LOOK", look_around, transitions={{"done": "BACK"}})
        sm.add("BACK", drive_to(HOME, exec_timeout=120.0))
    return sm
'''

_FILE = """\
# yaml-language-server: $schema=https://smachpy.github.io/smachpy/latest/mission.schema.json
name: {label}
help: Drive to a place, wait there, come back.
parameters:
  seconds: {{type: number, default: 5, unit: s, help: how long to wait there}}
outcomes: [succeeded, aborted, preempted]
states:
  GO:
    state: drive_to
    with: {{x: 11.5, y: 8.0}}
    on: {{succeeded: WAIT}}
  WAIT:
    state: wait
    with: {{seconds: "${{seconds}}"}}
    on: {{done: succeeded}}
cleanup:
  BACK:
    state: drive_to
    with: {{x: 9.8, y: 8.0}}
"""

_TEST = '''"""The mission against a robot that does what each test says: `smachpy test`."""

import pytest
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction

from {name} import {name}


@pytest.fixture
def robot(action_server):
    return action_server("move_base", MoveBaseAction)


def test_it_goes_looks_and_comes_back(mission, robot):
    robot.default_result(duration=20)
    run = mission({name}())
    run.assert_outcome("succeeded")
    run.assert_path(["GO", "LOOK", "BACK"])


def test_a_blocked_way_ends_it(mission, robot):
    robot.reply(status="aborted", duration=5)
    run = mission({name}())
    run.assert_outcome("aborted")
    run.assert_path(["GO"])


def test_a_preempt_cancels_the_drive(mission, robot):
    robot.default_result(duration=30)
    mission.preempt(on="GO", after=10)
    run = mission({name}())
    run.assert_outcome("preempted")
    assert len(robot.cancelled) == 1
'''

_README = """# {name}

| what | how |
| --- | --- |
| test it, without a robot | `smachpy test` |
| look for mistakes | `smachpy check {name}.py` |
| draw it | `smachpy render {name}.py -o {name}.svg` |
{run}
| watch it in a browser | `smachpy run {name}.py --start-robot --view` |
| keep it through a power loss | `smachpy run {name}.py --durable` |

`pip install 'smachpy[dot,sim,web]'` brings what these need.
"""

_RUN = {
    "sim": "| drive the simulated robot | `smachpy run {name}.py --start-robot` |",
    "ros2": """| drive the simulated robot | `smachpy run {name}.py --start-robot` |
| check the connection to your robot | `smachpy doctor --ros2 tcp/robot.local:7447` |
| drive your robot | `smachpy run {name}.py --ros2 tcp/robot.local:7447` |""",
    "ros1": """| drive the simulated robot | `smachpy run {name}.py --start-robot` |
| drive your robot | `smachpy run {name}.py --ros1-robot http://robot:11311` |""",
}

_COPY_TEST = '''"""The mission has no mistakes and succeeds with the simulated robot."""

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent


def smachpy(*arguments):
    command = [sys.executable, "-P", "-m", "smachpy", *arguments]
    done = subprocess.run(command, cwd=HERE, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_it_has_no_mistakes():
    smachpy("check", "{name}.py:{function}")


def test_it_succeeds_with_the_simulated_robot():
    how = ["--start-robot", "--time", "virtual", "--plain"{options}]
    smachpy("run", "{name}.py:{function}", *how)
'''

_MAPS = re.compile(r"^from smachpy\.places\.maps import ([\w, ]+)$", re.MULTILINE)


def register(subparsers: Any) -> None:
    """Add `smachpy new`."""
    parser = subparsers.add_parser(
        "new",
        help="write a mission to begin with, and its test",
        description="Write a folder with a mission, its test and a README; or, with --from, a copy "
        "of a shipped mission with its map and world.",
    )
    parser.add_argument(
        "name", nargs="?", metavar="NAME", help="name of the folder and of the mission: my_mission"
    )
    parser.add_argument(
        "--robot",
        choices=sorted(_RUN),
        default="sim",
        help="the robot that its README drives (default: the simulated one)",
    )
    parser.add_argument(
        "--from", dest="source", metavar="MISSION", help="a mission of `smachpy list` to copy"
    )
    parser.set_defaults(run=_new)


def _new(args: argparse.Namespace) -> int:
    if args.name and args.name.endswith((".yaml", ".yml")):
        return _new_file(Path(args.name))
    name = args.name or (args.source or "").replace(".", "_")
    if args.source and not args.name and _is_taken(name):  # such as `inspect`
        name = f"my_{name}"
    if not name:
        raise UsageError("new: got no name. Try: smachpy new my_mission")
    if not name.isidentifier() or keyword.iskeyword(name):
        way_out = re.sub(r"\W", "_", name.lstrip("0123456789-")) or "mission"
        way_out = f"my_{way_out}" if keyword.iskeyword(way_out) else way_out
        raise UsageError(
            f"new: name: got {name!r}; expected a name of Python. Try: smachpy new {way_out}"
        )
    if _is_taken(name):
        source = f" --from {args.source}" if args.source else ""
        raise UsageError(
            f"new: name: got {name!r}, a module that is installed; expected another name, as the "
            f"mission would hide it. Try: smachpy new my_{name}{source}"
        )
    folder = Path(name)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"new: {name!r} is there already. Try another name.")
    files = _copied(args.source, name) if args.source else _begun(name, args.robot)
    try:
        folder.mkdir(exist_ok=True)
        for file, content in files.items():
            if isinstance(content, Path):
                shutil.copyfile(content, folder / file)
            else:
                (folder / file).write_text(content, encoding="utf-8")
    except OSError as error:
        raise UsageError(f"new: {name!r} cannot be written: {error.strerror}") from error
    print(printable(f"{name}/: {', '.join(files)}"))
    print(printable(f"Try: cd {name} && smachpy test"))
    return 0


def _is_taken(name: str) -> bool:
    """Return whether Python has a module of that name, besides those of this folder."""
    if name in sys.stdlib_module_names:
        return True
    spec = PathFinder.find_spec(name, [place for place in sys.path if place])
    return spec is not None and spec.origin is not None  # else it is a folder without code


def _new_file(path: Path) -> int:
    """Write a mission file."""
    if path.exists():
        raise UsageError(f"new: {str(path)!r} is there already. Try another name.")
    try:
        path.write_text(_FILE.format(label=path.stem.upper()), encoding="utf-8")
    except OSError as error:
        raise UsageError(f"new: {str(path)!r} cannot be written: {error.strerror}") from error
    print(printable(f"{path}\nTry: smachpy check {path}, and smachpy states list"))
    return 0


def _begun(name: str, robot: str) -> dict[str, str | Path]:
    return {
        f"{name}.py": _MISSION.format(name=name, label=name.upper()),
        f"test_{name}.py": _TEST.format(name=name),
        "README.md": _README.format(name=name, run=_RUN[robot].format(name=name)),
    }


def _copied(source: str, name: str) -> dict[str, str | Path]:
    """Return a shipped mission's file, its maps and world, its test and a README."""
    from smachpy.places import maps

    function = load_target(source).thing
    info = mission_info(function)
    place = Path(inspect.getfile(inspect.unwrap(function)))
    text = place.read_text(encoding="utf-8")
    files: dict[str, str | Path] = {f"{name}.py": text}
    world = info.world.name if info.world else ""
    # The map belongs to every world; what else the mission reads is named in its import.
    for file in (maps.OFFICE_MAP, maps.OFFICE_ROBOT, info.world):
        if file:
            files[file.name] = file
    files[maps.OFFICE_MAP.with_suffix(".pgm").name] = maps.OFFICE_MAP.with_suffix(".pgm")
    for match in _MAPS.finditer(text):
        lines = []
        for constant in match[1].split(", "):
            file = getattr(maps, constant)
            files[file.name] = file
            lines.append(f'{constant} = Path(__file__).with_name("{file.name}")')
        text = text.replace(f"{match[0]}\n", "")
        text = _with_constants(text, "\n".join(lines))
    files[f"{name}.py"] = text
    options = "" if world else ', "--map", "office.yaml"'
    own_test = place.with_name(place.name.replace("lesson_", "test_"))
    if own_test != place and own_test.exists():
        test = own_test.read_text(encoding="utf-8").replace(f"{function.__module__} ", f"{name} ")
    else:
        test = _COPY_TEST.format(name=name, function=function.__name__, options=options)
    files[f"test_{name}.py"] = test
    run = _RUN["sim"].format(name=name)
    if not world:
        run = run.replace("--start-robot", "--start-robot --map office.yaml")
    files["README.md"] = _README.format(name=name, run=run)
    return files


def _with_constants(text: str, lines: str) -> str:
    """Put lines that use `Path` behind the last import of a module, and its import before them."""
    imports = re.compile(r"^(?:from|import) .*(?:\([^)]*\))?$", re.MULTILINE)
    end = [match.end() for match in imports.finditer(text)][-1]
    text = f"{text[:end]}\n\n{lines}{text[end:]}"
    first = next(m.start() for m in imports.finditer(text) if "__future__" not in m[0])
    return f"{text[:first]}from pathlib import Path\n\n{text[first:]}"
