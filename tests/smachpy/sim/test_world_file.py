from __future__ import annotations

import math
from dataclasses import replace

import pytest

from smachpy.places.exceptions import InputFileError, NavigationError
from smachpy.places.maps import FOLDER, OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.pose import Pose2D
from smachpy.sim.world_file import load_world, place_robots

OFFICE = f"map: {OFFICE_MAP}\nrobot: {OFFICE_ROBOT}\n"


@pytest.fixture
def write(tmp_path):
    def write(text, head=OFFICE):
        path = tmp_path / "world.yaml"
        path.write_text(head + text)
        return path

    return write


def problems(path):
    with pytest.raises(InputFileError) as error:
        load_world(path)
    return error.value.problems


def test_the_office_world_is_what_it_says():
    spec = load_world(FOLDER / "office_world.yaml")
    world = spec.build(0.0)
    assert [robot.name for robot in world.robots] == ["robot_0", "robot_1", "robot_2"]
    assert world.robots[1].battery.charge(0.0) == pytest.approx(0.9)
    assert sorted(world.doors) == ["kitchen", "lab"]
    assert world.doors["kitchen"].is_open
    assert [thing.name for thing in world.obstacles] == ["door lab"]
    assert [dock.name for dock in world.docks] == ["middle", "east"]
    (visitor,) = world.movers
    assert (visitor.name, visitor.x, visitor.y, visitor.radius) == ("visitor", 3.0, 8.1, 0.25)


def test_an_empty_file_is_the_office_without_anything(tmp_path):
    path = tmp_path / "world.yaml"
    path.write_text("robots:\n  - {x: 9.8, y: 7.1}\n")
    spec = load_world(path)
    assert spec.grid.width == 540
    assert [robot.name for robot in spec.robots] == ["robot_0"]
    assert spec.robots[0].config.start == Pose2D(9.8, 7.1, 0.0)


def test_a_robot_may_have_its_own_parameters(write, tmp_path):
    (tmp_path / "big.yaml").write_text("robot: {radius: 0.4}\n")
    path = write("robots:\n  - {x: 4, y: 7.7, config: big.yaml}\n  - {x: 9, y: 7.7, name: small}\n")
    big, small = load_world(path).robots
    assert (big.config.robot.radius, small.config.robot.radius) == (0.4, 0.25)
    assert (big.name, small.name) == ("robot_0", "small")


@pytest.mark.parametrize(
    ("text", "line", "field", "message"),
    [
        ("robots: [{x: 99, y: 1}]", 3, "robots[0].x", "is outside the map"),
        ("robots: [{x: 0.5, y: 5}]", 3, "robots[0].x", "is in a wall"),
        ("robots:\n  - {y: 5}", 4, "robots[0].x", "got nothing; expected a number [m]"),
        ("robots: [{x: 4, y: 7.7, name: my robot}]", 3, "robots[0].name", "' ' is not allowed"),
        ("robots: [{x: 4, y: 7.7, name: a/b}]", 3, "robots[0].name", "'/' is not allowed"),
        ("robots: [{x: 4, y: 7.7, charge: 3}]", 3, "robots[0].charge", "at most 1"),
        ("robots: [{x: 4, y: 7.7, yawn: 3}]", 3, "robots[0].yawn", "Did you mean 'yaw'?"),
        ("robots: []", 3, "robots", "a list with at least one entry"),
        (
            "robots:\n  - {x: 4, y: 7.7, name: a}\n  - {x: 9, y: 7.7, name: a}",
            5,
            "robots[1].name",
            "another name than the robot in line 4",
        ),
        ("doors: [{x0: 1, y0: 2, x1: 1, y1: 2}]", 3, "doors[0].x1", "at least 0.1 m from"),
        ("doors: [{x0: 1, y0: 2, x1: 99, y1: 2}]", 3, "doors[0].x1", "(99.00, 2.00) is outside"),
        ("doors: [{x0: 1, y0: 2, x1: 2, y1: 2, open: maybe}]", 3, "doors[0].open", "true or false"),
        ("docks: [{x: 0.5, y: 5}]", 3, "docks[0].x", "is in a wall"),
        ("moving: [{places: [{x: 99, y: 2}]}]", 3, "moving[0].places[0].x", "is outside"),
        ("moving: [{speed: 0, places: [{x: 4, y: 7}]}]", 3, "moving[0].speed", "> 0"),
        ("moving: [{speed: 1}]", 3, "moving[0].places", "a list with at least one entry"),
        ("door: 3", 3, "door", "Did you mean 'doors'?"),
    ],
)
def test_a_mistake_is_named_with_line_and_field(write, text, line, field, message):
    (problem,) = problems(write(text + "\n"))
    assert (problem.line, problem.field) == (line, field)
    assert message in str(problem)


@pytest.mark.parametrize(
    ("text", "line", "field", "message"),
    [
        (
            "robots:\n  - {x: 4, y: 7.7}\n  - {x: 4.2, y: 7.7}\n",
            5,
            "robots[1].x",
            "expected a free place. (4.20, 7.70) is taken by robot_0.",
        ),
        (
            "robots: [{x: 4, y: 7.7}]\nmoving: [{name: visitor, places: [{x: 4.3, y: 7.7}]}]\n",
            4,
            "moving[0].places[0].x",
            "(4.30, 7.70) is taken by robot_0.",
        ),
    ],
)
def test_nothing_begins_where_a_robot_stands(write, text, line, field, message):
    (problem,) = problems(write(text))
    assert (problem.line, problem.field) == (line, field)
    assert message in str(problem)


def test_a_world_made_in_code_also_refuses_two_at_one_place(write):
    spec = load_world(write("robots: [{x: 4, y: 7.7}]\nmoving: [{places: [{x: 6, y: 7.7}]}]\n"))
    (robot,), (mover,) = spec.robots, spec.movers
    twins = (robot, replace(robot, name="twin"))
    with pytest.raises(
        NavigationError, match=r"twin: start pose: \(4\.00, 7\.70\) is taken by robot_0"
    ):
        replace(spec, robots=twins).build(0.0)
    with pytest.raises(NavigationError, match=r"first place: \(4\.00, 7\.70\) is taken by robot_0"):
        replace(spec, movers=(replace(mover, places=((4.0, 7.7),)),)).build(0.0)


def test_robots_by_number_stand_apart_and_near_the_first(office, office_robot):
    specs = place_robots(office, office_robot, 50)
    assert [spec.name for spec in specs] == [f"robot_{i}" for i in range(50)]
    assert specs[0].pose == office_robot.start
    for i, spec in enumerate(specs):
        assert spec.pose.distance(office_robot.start) < 12.0
        for other in specs[:i]:
            assert spec.pose.distance(other.pose) > 0.9
    assert all(math.isclose(s.pose.yaw, office_robot.start.yaw) for s in specs)
