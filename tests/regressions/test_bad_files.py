"""Files that people write or that were damaged: one reason, exit code 2, never a traceback."""

from __future__ import annotations

import json
import random

import pytest

import smachpy.command
from actionlib_core.cli import main as actionlib
from actionlib_core.config import load_config
from actionlib_core.exceptions import ConfigError, FieldError
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.tools import yaml_msgs_str
from actionlib_core.yaml_text import YamlTextError, load_yaml
from smachpy import CBState, StateMachine
from smachpy.events.recording import Recorder, RecordingError, read_recording
from smachpy.sim.exceptions import InputFileError

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
FINE = {"unknown"}  # plain data with a tag that nobody knows


@pytest.mark.parametrize("kind", ["safe", "rt"])
@pytest.mark.parametrize("text", sorted(TEXTS.keys() - FINE))
def test_a_yaml_text_is_refused_with_one_line(text, kind):
    if (text, kind) == ("own part", "rt"):
        return  # it is left out there
    with pytest.raises(YamlTextError) as caught:
        load_yaml(TEXTS[text], kind)
    assert "\n" not in str(caught.value)
    assert caught.value.reason


@pytest.mark.slow
@pytest.mark.parametrize("text", sorted(TEXTS))
def test_every_reader_of_yaml_refuses_it(text, tmp_path):
    path = tmp_path / "file.yaml"
    path.write_text(TEXTS[text])
    with pytest.raises(ConfigError):
        load_config(path)
    with pytest.raises(FieldError):
        String.from_yaml(TEXTS[text])
    with pytest.raises(FieldError):
        yaml_msgs_str(String, TEXTS[text])
    from missions.delivery.places import load_places
    from missions.fleet.site import load_site
    from missions.tour.tour_file import load_tour
    from smachpy.sim.config import load_config as load_robot
    from smachpy.sim.occupancy import load_map
    from smachpy.sim.world_file import load_world
    from smachpy.states import load_route

    for read in (load_tour, load_route, load_places, load_site, load_robot, load_map, load_world):
        with pytest.raises(InputFileError):
            read(path)


@pytest.mark.parametrize("value", ["1" + "0" * 400, ".nan", ".inf", "1e999", "٣"])
def test_a_number_that_no_float_holds_is_refused(value, tmp_path):
    path = tmp_path / "file.yaml"
    path.write_text(f"lease: {value}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="lease"):
        load_config(path)
    from missions.tour.tour_file import load_tour

    path.write_text(f"waypoints: [{{name: a, x: {value}, y: 1}}]\n", encoding="utf-8")
    with pytest.raises(InputFileError, match="expected a number"):
        load_tour(path)
    (tmp_path / "file.csv").write_text(f"name,x,y\na,{value},1\n", encoding="utf-8")
    with pytest.raises(InputFileError, match="expected a number"):
        load_tour(tmp_path / "file.csv")


def test_the_commands_end_with_2_and_one_line(tmp_path, capsys):
    bad = tmp_path / "bad.yaml"
    bad.write_text("lease: !!float x\n")
    assert actionlib(["--config", str(bad), "topic", "list"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    for option in ("--map", "--config", "--world"):
        run = ["run", "there_and_back", "--time", "virtual", option, str(bad)]
        assert smachpy.command.main(run) == 2
        assert capsys.readouterr().err.count("\n") == 1


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
