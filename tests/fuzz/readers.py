"""The readers of what others have written, the errors by which they refuse it, and a first corpus.

A reader takes bytes: a file, a message or a request. Anything but one of its errors is a fault.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import shutil
import sqlite3
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import smachpy
from actionlib_core.config import load_config
from actionlib_core.exceptions import ActionlibError
from actionlib_core.inputs.expression import ExpressionError
from actionlib_core.inputs.json_text import load_json
from actionlib_core.inputs.yaml_text import load_yaml
from actionlib_core.interfaces import define_message
from actionlib_core.interfaces.geometry_msgs.msg import PoseWithCovarianceStamped
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseActionGoal
from actionlib_core.interfaces.nav_msgs.msg import OccupancyGrid
from actionlib_core.interfaces.ros2 import get_message as get_ros2_message
from actionlib_core.ros1 import frames, rpc
from actionlib_core.transport.tokens import parse_token
from smachpy.checks.suppression import read_settings
from smachpy.durable.mission import new_mission
from smachpy.durable.opening import open_store
from smachpy.durable.overview import overview
from smachpy.durable.store import StoreError
from smachpy.events.introspection import StateRecord, describe
from smachpy.events.recording import Recorder, read_recording
from smachpy.exceptions import SmachError
from smachpy.files import load as load_mission
from smachpy.network import reading
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.occupancy import load_map
from smachpy.places.robot_file import load_config as load_robot
from smachpy.pnp.conditions import parse as parse_condition
from smachpy.pnp.knowledge import Expression
from smachpy.pnp.mapping import read_mapping
from smachpy.pnp.plan import understand
from smachpy.pnp.reading import read_net
from smachpy.reproduce.world import world_of
from smachpy.sim.world_file import load_world
from smachpy.states.waypoints import load_route
from smachpy.userdata.json_text import loads
from smachpy_viz.live.machines import Machine
from smachpy_viz.runs.statistics import StatisticsOfFiles

ROOT: Final = Path(__file__).parents[2]
MAPS: Final = ROOT / "smachpy" / "places" / "maps"
PLANS: Final = ROOT / "missions" / "smachpy_missions" / "pnp"
OWN: Final = (SmachError, ActionlibError)
TEXT: Final = (*OWN, ValueError)  # readers of texts say what is wrong by a ValueError


@dataclass(frozen=True)
class Reader:
    """One of the readers.

    Attributes:
        read: Reads bytes.
        errors: By which it refuses them.
        seeds: What it takes, and what it should not take.
    """

    read: Callable[[bytes], object]
    errors: tuple[type[BaseException], ...]
    seeds: tuple[bytes, ...]


def _text(read: Callable[[str], object]) -> Callable[[bytes], object]:
    return lambda data: read(data.decode("utf-8", "replace"))


def _file(name: str, read: Callable[[Path], object], beside: tuple[Path, ...] = ()) -> Any:
    """A reader of a file; the folder of the first time is used again and again."""

    @cache
    def folder() -> Path:
        made = Path(tempfile.mkdtemp(prefix="smachpy-fuzz-"))
        atexit.register(shutil.rmtree, made, ignore_errors=True)
        for other in beside:
            shutil.copy(other, made)
        return made

    def read_bytes(data: bytes) -> object:
        path = folder() / name
        path.write_bytes(data)
        return read(path)

    return read_bytes


def _machine() -> smachpy.StateMachine:
    made = smachpy.StateMachine(["done"], name="M")
    made.userdata.word = {"a": [1, 2.5, None, "x"], "b": (1, {2})}
    inner = smachpy.Concurrence(["done"], default_outcome="done")
    inner.add("C", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    made.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"]), {"done": "B"})
    made.add("B", inner)
    return made


def _recording() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        machine = _machine()
        with Recorder(Path(folder) / "r.jsonl", machine):
            machine.execute()
        return (Path(folder) / "r.jsonl").read_bytes()


def _journal() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "j.db"
        machine = _machine()
        machine.userdata.word = [1]
        smachpy.run_durable(machine, path, mission="one")
        with contextlib.closing(open_store(path)) as store:
            store.create(new_mission(machine, mission="two", target="x.py", argv=(), robot="r"))
        with contextlib.closing(sqlite3.connect(path)) as file:
            file.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            file.execute("PRAGMA journal_mode = DELETE")
        return path.read_bytes()


def _look_at_journal(path: Path) -> None:
    for more in ("-wal", "-shm", "-journal"):
        path.with_name(path.name + more).unlink(missing_ok=True)
    with contextlib.closing(open_store(path, create=False, patience=0.1)) as store:
        for row in store.missions():
            json.dumps(overview(store, row), allow_nan=False)


def _use_recording(path: Path) -> None:
    recording = read_recording(path)
    machine = Machine("one", lambda _machine: None)
    machine.load(recording)
    json.loads(machine.snapshot()[1])
    StatisticsOfFiles([path]).of(recording.record)
    world_of(recording)


def _history() -> bytes:
    lines = [json.loads(line) for line in _recording().splitlines()]
    events = [{**one, "seq": seq} for seq, one in enumerate(lines[1:], 1)]
    described = json.loads(json.dumps(asdict(describe(_machine()))))
    head = {"epoch": "e", "session": "s", "run": "", "problems": [], "base": None, "now": 1}
    told = {**head, "observed": [], "control": None, "events": events, "description": described}
    return json.dumps(told).encode()


def _serialised(message: Any) -> bytes:
    return bytes(message.to_bytes())


def _net(suffix: str) -> Callable[[bytes], object]:
    return _file(f"p{suffix}", lambda path: understand(read_net(path)[0]))


def _net_with_rules(path: Path, plan: bytes) -> object:
    path.with_name("p.plan").write_bytes(plan)
    return read_net(path.with_name("p.plan"))


def _seeds(*paths: Path) -> tuple[bytes, ...]:
    return tuple(path.read_bytes() for path in paths)


def readers() -> dict[str, Reader]:
    """All readers, by name; making them writes files and runs small machines."""
    history, recording, journal = _history(), _recording(), _journal()
    events = recording.splitlines()[1:]
    described = json.dumps(asdict(describe(_machine()))).encode()
    ros2 = get_ros2_message("geometry_msgs/PoseWithCovarianceStamped")
    plan = b"LABEL_a; goto_kitchen; < low ? say_hello; : (not low) ? wait_2; GOTO_LABEL_a; >; fetch_@cup;\n"
    rules = b"*if* low *during* goto *do* say_help; restart_action\n*if* (and a (not b)) *during* x *do* fail_plan\n"
    answer = {"ok": True, "text": "", "paused": False, "breakpoints": [["/M/A", None]]}
    seen = json.loads((ROOT / "tests/data/observed.json").read_text())
    observed = [json.dumps(one).encode() for one in (seen if isinstance(seen, list) else [seen])]
    package = b"<?xml version='1.0'?><package><name>p</name><depend>std_msgs</depend></package>"
    call = b"<?xml version='1.0'?><methodCall><methodName>requestTopic</methodName><params><param><value><string>/x</string></value></param></params></methodCall>"
    toml = b'[tool.smachpy.check]\nenable = ["no-timeout"]\n[tool.smachpy.check.properties]\nA = ["never(B)"]\n'
    yaml = b"a: &a [1, 2.5, 'x', {b: null}]\nc: *a\nd: |\n  text\n? e\n: {<<: {f: 2026-01-01}}\n"
    config = b"mode: router\nlisten: [tcp/127.0.0.1:7447]\ndiscovery: 'off'\naccess:\n- names: [a/**]\n  users: [b]\n"
    return {
        "yaml": Reader(_text(load_yaml), TEXT, (yaml,)),
        "config": Reader(_file("c.yaml", load_config), OWN, (config,)),
        "robot": Reader(_file("r.yaml", load_robot), OWN, _seeds(Path(OFFICE_ROBOT))),
        "world": Reader(
            _file(
                "w.yaml",
                load_world,
                (MAPS / "office.yaml", MAPS / "office.pgm", Path(OFFICE_ROBOT)),
            ),
            OWN,
            _seeds(MAPS / "office_world.yaml", MAPS / "office_fleet.yaml"),
        ),
        "map": Reader(
            _file("m.yaml", load_map, (MAPS / "office.pgm",)), OWN, _seeds(Path(OFFICE_MAP))
        ),
        "picture": Reader(
            _file(
                "office.pgm",
                lambda path: load_map(path.with_name("office.yaml")),
                (MAPS / "office.yaml",),
            ),
            OWN,
            (b"P5\n# x\n4 3\n255\n" + bytes(range(12)), b"P2\n2 2\n255\n1 2 3 4\n"),
        ),
        "route": Reader(
            _file(
                "r.yaml",
                load_route,
                (MAPS / "office.yaml", MAPS / "office.pgm", Path(OFFICE_ROBOT)),
            ),
            OWN,
            _seeds(MAPS / "office_waypoints.yaml"),
        ),
        "settings": Reader(
            _file("pyproject.toml", lambda p: read_settings(p.parent)), OWN, (toml,)
        ),
        "definition": Reader(
            _text(partial(define_message, "fuzz_msgs/Fuzz")),
            TEXT,
            (
                b"Header header\nint32[] a  # c\nstring b\nuint8 X=5\nstring Y= z \ngeometry_msgs/Pose[3] p\n",
            ),
        ),
        "message of ROS 1": Reader(
            MoveBaseActionGoal.from_bytes, TEXT, (_serialised(MoveBaseActionGoal()),)
        ),
        "map of ROS 1": Reader(
            OccupancyGrid.from_bytes, TEXT, (_serialised(OccupancyGrid(data=[1, 2, 3])),)
        ),
        "pose of ROS 1": Reader(
            PoseWithCovarianceStamped.from_bytes, TEXT, (_serialised(PoseWithCovarianceStamped()),)
        ),
        "message of ROS 2": Reader(ros2.from_bytes, TEXT, (_serialised(ros2()),)),
        "header of ROS 1": Reader(
            frames.unpack_header,
            TEXT,
            (
                frames.pack_header({"callerid": "/x", "topic": "/t", "md5sum": "*", "type": "*"})[
                    4:
                ],
            ),
        ),
        "call of ROS 1": Reader(rpc._check_plain, (*TEXT, SyntaxError), (call, package)),
        "plan": Reader(_net(".plan"), OWN, (plan,)),
        "plan of a planner": Reader(
            _net(".pddlout"), OWN, (b"0.001: (goto kitchen) [1.000]\n(fetch cup)\n",)
        ),
        "rules": Reader(_file("p.er", lambda path: _net_with_rules(path, plan)), OWN, (rules,)),
        "net": Reader(_net(".pnml"), OWN, _seeds(PLANS / "meet.pnml", PLANS / "errand.pnml")),
        "mission file": Reader(
            _file("m.yaml", partial(load_mission, to_run=False)),
            OWN,
            _seeds(Path(__file__).with_name("mission.yaml")),
        ),
        "machine of YASMIN": Reader(
            _file("m.xml", partial(load_mission, to_run=False)),
            OWN,
            _seeds(Path(__file__).with_name("rounds.xml")),
        ),
        "machine in SCXML": Reader(
            _file("m.scxml", partial(load_mission, to_run=False)),
            OWN,
            _seeds(Path(__file__).with_name("rounds.scxml")),
        ),
        "behaviour of FlexBE": Reader(
            _file("m.py", partial(load_mission, to_run=False)),
            OWN,
            _seeds(Path(__file__).with_name("rounds_sm.py.txt")),
        ),
        "mapping": Reader(
            _file("actions.yaml", partial(read_mapping, imports=False)),
            OWN,
            _seeds(PLANS / "actions.yaml"),
        ),
        "condition": Reader(
            _text(parse_condition), TEXT, (b"(and a (not b_@x) (or c d))", b"[a and not b]")
        ),
        "expression": Reader(
            _text(lambda text: Expression(text)({"a": 5, "b": [1, 2], "c": "x"})),
            (*TEXT, ExpressionError),
            (b"a < 20 and len(b) > 1 or c == 'x'", b"b[0] ** 2 + a % 3 if c else -1"),
        ),
        "json": Reader(load_json, TEXT, (history, b"[1, -2.5e3, NaN, true, null]")),
        "userdata": Reader(
            _text(loads),
            TEXT,
            (
                b'{"a": {"$tuple": [1, {"$set": [2]}]}, "b": {"$bytes": "AAA="}, "c": {"$items": [[1, 2]]}}',
            ),
        ),
        "event": Reader(_text(reading.read_numbered_event), TEXT, tuple(events)),
        "observation": Reader(_text(reading.read_observation), TEXT, tuple(observed)),
        "history": Reader(_text(reading.read_history), TEXT, (history,)),
        "description": Reader(_text(reading.read_description), TEXT, (described,)),
        "control": Reader(_text(reading.read_control_answer), TEXT, (json.dumps(answer).encode(),)),
        "structure": Reader(_text(StateRecord.from_json), TEXT, (described,)),
        "token": Reader(
            _text(parse_token),
            (),
            (b"@smachpy/1/action_server/a%b/type/md5/session/node/1", b"@a/**/*"),
        ),
        "recording": Reader(_file("r.jsonl", _use_recording), OWN, (recording,)),
        "journal": Reader(_file("j.db", _look_at_journal), (StoreError,), (journal,)),
    }
