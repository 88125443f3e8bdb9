"""Files that people write or that were damaged: one reason, exit code 2, never a traceback."""

from __future__ import annotations

import json
import random
import re

import pytest

import smachpy.command
from actionlib_core.action.tools import yaml_msgs_str
from actionlib_core.cli import main as actionlib
from actionlib_core.config import load_config
from actionlib_core.exceptions import ConfigError, FieldError
from actionlib_core.inputs.yaml_text import YamlTextError, load_yaml
from actionlib_core.interfaces.std_msgs.msg import String
from smachpy import CBState, StateMachine
from smachpy.checks import IgnoreError
from smachpy.checks.suppression import read_settings
from smachpy.events.recording import Recorder, RecordingError, read_recording
from smachpy.places.exceptions import InputFileError
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.occupancy import load_map
from smachpy.places.robot_file import load_config as load_robot
from smachpy.pnp.mapping import read_mapping
from smachpy.pnp.problems import PlanError
from smachpy.sim.world_file import load_world
from smachpy.states import load_route
from smachpy_missions.delivery.places import load_places
from smachpy_missions.fleet.site import load_site
from smachpy_missions.tour.tour_file import load_tour

DEEP = "[" * 3000
BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 10)}]\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)
TEXTS = {
    "number": "x: !!int x\n",
    "float": "x: !!float x\n",
    "time": "x: !!timestamp x\n",
    "bytes": "x: !!binary x\n",
    "set": "x: !!set [a, b]\n",
    "pairs": "x: !!omap x\n",
    "unknown": "x: !thing y\n",
    "deep": f"x: {DEEP}\n",
    "deep lines": "- " * 3000,
    "own part": "x: &x [*x]\n",
    "billions": BOMB,
    "open": "x: 'y\n",
    "digits": f"x: {'9' * 5000}\n",
    "control": "x: \x07\n",
}


ERRORS = (ConfigError, IgnoreError, InputFileError, PlanError)

# For each kind of file one with several mistakes; behind #! are the wrong fields of the line.
READERS = {
    "configuration.yaml": (
        load_config,
        """                           #! user
mode: clinet                          #! mode
conect: [tcp/a:1]                     #! conect
listen: [localhost]                   #! listen
namespace: a b                        #! namespace
lease: soon                           #! lease
settle: -1                            #! settle
password: secret
tls:                                  #! tls.key
  certificate: no.pem                 #! tls.certificate
  verify_name: maybe                  #! tls.verify_name
access:
- users: [alice]                      #! access[0].names
- names: [/a]                         #! access[1].names
  permission: perhaps                 #! access[1].permission
ros2:
- router: localhost                   #! ros2[0].router
  distro: foxi                        #! ros2[0].distro
  namespace: 9 lives                  #! ros2[0].namespace
  names: [/x, 3]                      #! ros2[0].names[1]
  mode: router                        #! ros2[0].mode
  probe: .nan                         #! ros2[0].probe
  map:
    a: {acton: b}                     #! ros2[0].map.a.acton
    b: {action: a, topic: b}          #! ros2[0].map.b.topic
    c: {topic: 'x y'}                 #! ros2[0].map.c.topic
    d: 3                              #! ros2[0].map.d
    e: {fields: {a: 1}}               #! ros2[0].map.e.fields.a
    f: {}                             #! ros2[0].map.f.action
- {robot: b, domain: -1, names: [/x]} #! ros2[1].domain ros2[1].names
wire: ros1                            #! wire
""",
    ),
    "robot.yaml": (
        load_robot,
        """
robot: {radius: 0, sight: far}        #! robot.radius robot.sight
planner:
  unknown_is_free: 3                  #! planner.unknown_is_free
recovery:
  attempts: 1.5                       #! recovery.attempts
scan: 7                               #! scan
batery: {}                            #! batery
start:                                #! start.y
  x: 1
dock: {x: 1, y: here}                 #! dock.y
""",
    ),
    "map.yaml": (
        load_map,
        """
image: nowhere.pgm                    #! image
resolution: 0                         #! resolution
origin: [1, 2]                        #! origin
negate: 3                             #! negate
occupied_thresh: 0.2
free_thresh: 0.9                      #! free_thresh
maps: trinary                         #! maps
""",
    ),
    "world.yaml": (
        load_world,
        """
robots:
- {x: 4, y: 7.7, config: 7}           #! robots[0].config
- {y: far}                            #! robots[1].x robots[1].y
- {x: 99, y: 1}                       #! robots[2].x
- x: 4                                #! robots[3].x
  y: 7.7
  name: my robot                      #! robots[3].name
  charge: 3                           #! robots[3].charge
moving:
- speed: 0                            #! moving[0].speed
  places:
  - {x: 99, y: 2}                     #! moving[0].places[0].x
  - 7                                 #! moving[0].places[1]
doors:
- {x0: 1, y0: 2, x1: 1, y1: 2}        #! doors[0].x1
- {x0: 1, y0: 2, x1: 2, y1: y}        #! doors[1].y1
docks: []                             #! docks
door: 3                               #! door
""",
    ),
    "world_without_map.yaml": (
        load_world,
        """
map: [office]                         #! map
robot: 5                              #! robot
robots:
- {x: 99, y: 1, yaw: left}            #! robots[0].yaw
doors:
- {x0: 1, y0: 2, x1: 99}              #! doors[0].y1
""",
    ),
    "route.yaml": (
        load_route,
        f"""
map: {OFFICE_MAP}
robot: {OFFICE_ROBOT}
dock: {{x: 9.8}}                      #! dock.y
waypoints:
- {{x: 0.5, y: 5.0}}                  #! waypoints[0].x
- kitchen                             #! waypoints[1]
- {{x: 2.0, y: 3.0, yaww: 1}}         #! waypoints[2].yaww
- {{name: off, x: 50, y: 5.0}}        #! waypoints[3].x
- {{name: tight, x: 0.75, y: 5.0}}    #! waypoints[4].x
low_battery: 2                        #! low_battery
charge_until: full                    #! charge_until
""",
    ),
    "tour.yaml": (
        load_tour,
        """
waypoints:
- {name: 7, x: here, y: 2}            #! waypoints[0].name waypoints[0].x
- {x: 1, y: 2, dwell: -1, angle: 400} #! waypoints[1].dwell waypoints[1].angle
- {x: 1, y: 2, service: a b}          #! waypoints[2].service
- {x: 1, y: 2, task: turrn}           #! waypoints[3].task
maps: office.yaml                     #! maps
""",
    ),
    "tour.csv": (
        load_tour,
        """name,x,y,dwell,task,clour
a,here,2,,,red                        #! waypoints[0].x waypoints[0].clour
b,1,,-1,turrn                         #! waypoints[1].y waypoints[1].dwell waypoints[1].task
""",
    ),
    "places.yaml": (
        load_places,
        """
home: 3                               #! home
places:
- {name: a, x: 1, y: 2}
- name: a                             #! places[1].name
  x: 1
  y: 2
  door: a b                           #! places[1].door
  wait: {x: 1}                        #! places[1].wait.y
- {x: 1, y: 2, wait: 3}               #! places[2].name places[2].wait
""",
    ),
    "site.yaml": (
        load_site,
        """
docks: []                             #! docks
homes:                                #! homes
places:
- {name: a, x: 1, y: 2}
- {name: a, x: b, y: 2}               #! places[1].name places[1].x
map: 7                                #! map
""",
    ),
    "pyproject.toml": (
        lambda path: read_settings(path.parent),
        """
[project]
enable = []
[tool.smachpy.check]
enable = ["no-timeout", "x"]          #! tool.smachpy.check.enable[1]
ignored = []                          #! tool.smachpy.check.ignored
[[tool.smachpy.check.ignore]]
rule = "no-timeout"
reason = "it takes long"
[[tool.smachpy.check.ignore]]         #! tool.smachpy.check.ignore[1].reason
rule = "no-timeouts"                  #! tool.smachpy.check.ignore[1].rule
paths = "/A"                          #! tool.smachpy.check.ignore[1].paths
[tool.smachpy.check.properties]
A = ["never(B)"]
B = "never(C)"                        #! tool.smachpy.check.properties.B
""",
    ),
    "actions.yaml": (
        read_mapping,
        """
actions:
  a: {run: no colon}                  #! actions.a.run
  b: {run: "nowhere_x:f", every: 1}   #! actions.b.run actions.b.every
  c: {}                               #! actions.c
  d: 3                                #! actions.d
  e:
    action: move_base
    type: move_base_msgs/Move         #! actions.e.type
    case: {}                          #! actions.e.case
    timeout: -1                       #! actions.e.timeout
conditions:
  f: {}                               #! conditions.f
  g: {userdata: "f(x)"}               #! conditions.g.userdata
  h: {topic: t, when: "data >"}       #! conditions.h.when conditions.h.type
  i: {run: "os:getcwd", every: x}     #! conditions.i.every
strict: maybe                         #! strict
events: never                         #! events
server: {timeout: 0, every: x}        #! server.timeout server.every
condition: {}                         #! condition
""",
    ),
}


@pytest.mark.parametrize("text", sorted(TEXTS))
def test_a_yaml_text_is_refused_with_one_line(text):
    with pytest.raises(YamlTextError) as caught:
        load_yaml(TEXTS[text])
    assert "\n" not in str(caught.value)
    assert caught.value.reason


@pytest.mark.slow
@pytest.mark.parametrize("text", sorted(TEXTS))
def test_every_reader_of_yaml_refuses_it(text, tmp_path):
    path = tmp_path / "file.yaml"
    path.write_text(TEXTS[text])
    with pytest.raises(FieldError):
        String.from_yaml(TEXTS[text])
    with pytest.raises(FieldError):
        yaml_msgs_str(String, TEXTS[text])
    for read in (read for name, (read, _) in READERS.items() if name.endswith(".yaml")):
        with pytest.raises(ERRORS):
            read(path)


@pytest.mark.parametrize("name", READERS)
def test_all_mistakes_of_a_file_come_at_once_with_their_lines(name, tmp_path):
    read, text = READERS[name]
    path = tmp_path / name
    path.write_text(re.sub(" *#!.*", "", text))
    with pytest.raises(ERRORS) as caught:
        read(path)
    expected = [
        (number, field)
        for number, line in enumerate(text.splitlines(), 1)
        for field in line.partition("#!")[2].split()
    ]
    told = re.findall(r"^.*?(?:line |:)(\d+): (\S+): ", str(caught.value), re.MULTILINE)
    found = [(int(line), field) for line, field in told]
    assert sorted(found) == sorted(expected)
    assert [line for line, _ in found] == [line for line, _ in expected]  # in this order


@pytest.mark.parametrize("value", ["1" + "0" * 400, ".nan", ".inf", "1e999", "٣"])
def test_a_number_that_no_float_holds_is_refused(value, tmp_path):
    path = tmp_path / "file.yaml"
    path.write_text(f"lease: {value}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="lease"):
        load_config(path)
    path.write_text(f"waypoints: [{{name: a, x: {value}, y: 1}}]\n", encoding="utf-8")
    with pytest.raises(InputFileError, match="expected a number"):
        load_tour(path)
    (tmp_path / "file.csv").write_text(f"name,x,y\na,{value},1\n", encoding="utf-8")
    with pytest.raises(InputFileError, match="expected a number"):
        load_tour(tmp_path / "file.csv")


def test_the_commands_end_with_2_and_one_line_and_an_address(tmp_path, capsys):
    bad = tmp_path / "bad.yaml"
    bad.write_text("lease: !!float x\n")
    assert actionlib(["--config", str(bad), "topic", "list"]) == 2
    assert capsys.readouterr().err.count("\n") == 2
    for option in ("--map", "--config", "--world"):
        run = ["run", "there_and_back", "--time", "virtual", option, str(bad)]
        assert smachpy.command.main(run) == 2
        assert capsys.readouterr().err.count("\n") == 2


# -- recordings ------------------------------------------------------------------------------------


@pytest.fixture
def lines(tmp_path, clock):
    """The lines of a good recording."""
    sm = StateMachine(outcomes=["done"], name="JOB", output_keys=["n"])
    with sm:
        sm.add("A", CBState(lambda _: "done", outcomes=["done"]))
    with Recorder(tmp_path / "good.jsonl", sm):
        sm.execute()
    return (tmp_path / "good.jsonl").read_text().splitlines(keepends=True)


@pytest.mark.parametrize("line", [DEEP, '{"a":' * 3000, "5", "null", '"x"', "[]", "{}", "\x00"])
@pytest.mark.parametrize("place", [0, 1])
def test_a_line_of_another_kind_is_named(lines, line, place, tmp_path):
    lines[place] = f"{line}\n"
    path = tmp_path / "bad.jsonl"
    path.write_text("".join(lines))
    with pytest.raises(RecordingError, match=f"line {place + 1}"):
        read_recording(path)


@pytest.mark.parametrize("outage", [[2**70, -1], [-1, 2**70], [0, 2**63]])
def test_both_ends_of_an_outage_are_checked(lines, outage, tmp_path):
    event = {**json.loads(lines[1]), "kind": "Recovered", "mission": "m", "began_ns": 0}
    lines[1] = json.dumps({**event, "outages": [outage], "active": []}) + "\n"
    path = tmp_path / "bad.jsonl"
    path.write_text("".join(lines))
    with pytest.raises(RecordingError, match="line 2"):
        read_recording(path)


def damaged(value, rng):
    """Put another value in one place of JSON data."""
    others = [None, -1, 1.5, 10**400, "x", [], {}, [[]], True, float("nan")]
    if isinstance(value, dict) and value and rng.random() < 0.8:
        key = rng.choice(sorted(value))
        return {**value, key: damaged(value[key], rng)}
    if isinstance(value, list) and value and rng.random() < 0.8:
        i = rng.randrange(len(value))
        return [*value[:i], damaged(value[i], rng), *value[i + 1 :]]
    return rng.choice(others)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(150))
def test_a_damaged_recording_is_shown_or_refused(lines, seed, tmp_path, capsys):
    rng = random.Random(seed)
    place = rng.randrange(len(lines)) if rng.random() < 0.5 else 0
    lines[place] = json.dumps(damaged(json.loads(lines[place]), rng)) + "\n"
    path = tmp_path / "bad.jsonl"
    path.write_text("".join(lines))
    assert smachpy.command.main(["runs", "show", str(path)]) in {0, 2}
    assert smachpy.command.main(["runs", "list", str(path)]) in {0, 2}
    page = tmp_path / "run.html"
    assert smachpy.command.main(["runs", "export", str(path), "-o", str(page)]) in {0, 2}
