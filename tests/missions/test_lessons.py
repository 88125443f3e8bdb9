"""The lessons that no file of their own tests, and what holds for all of them."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import smachpy_missions
from actionlib_core import ActionClient, Node
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool, SetBoolResponse
from smachpy.checks import check
from smachpy.states import Pose2D, goal_at
from smachpy_missions.lesson_07_service import door
from smachpy_missions.lesson_11_server import look, look_at, offer
from smachpy_missions.lesson_12_async import shuttle

LESSONS = sorted(Path(smachpy_missions.__file__).parent.glob("lesson_*.py"))
DRIVE_S = 10.0


TESTS = sorted(Path(smachpy_missions.__file__).parent.glob("test_*.py"))


def calls_of(tree, *names):
    """Return the calls of these functions or methods."""
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    return [call for call in calls if getattr(call.func, "attr", "") in names]


@pytest.mark.parametrize("file", LESSONS, ids=lambda file: file.stem)
def test_a_lesson_is_one_screen_of_public_api_in_one_spelling(file):
    text = file.read_text()
    assert 20 <= len(text.splitlines()) <= 45
    assert not re.search(r"noqa|type: ignore|ignore\[", text)
    tree = ast.parse(text)
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    private = {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    assert not any(name.startswith("smachpy_missions") for name in imported)
    assert not any(re.match(r"_(?!_)", name) for name in private)
    # One spelling: `import smachpy`, `with sm:`, keyword arguments.
    assert "smachpy" not in imported
    machines = calls_of(tree, "StateMachine", "Concurrence", "Iterator", "state")
    assert not [ast.unparse(call) for call in machines if call.args]
    adds = calls_of(tree, "add")
    assert not [ast.unparse(call) for call in adds if len(call.args) != 2]
    inside = {
        add
        for node in ast.walk(tree)
        if isinstance(node, ast.With)
        for add in calls_of(node, "add")
    }
    assert set(adds) == inside


def test_every_lesson_has_a_test_beside_it():
    assert len(LESSONS) == 12
    numbers = [re.sub(r"^lesson_", "test_", file.name) for file in LESSONS]
    assert [file.name for file in TESTS] == numbers
    for file in TESTS:
        assert len(file.read_text().splitlines()) <= 30


@pytest.fixture
def drives(mission):
    server = mission.action_server("move_base", MoveBaseAction)
    server.default_result(duration=DRIVE_S)
    return server


# -- 7 the door ------------------------------------------------------------------------------------


@pytest.fixture
def lab(mission):
    return mission.service_server("doors/lab/set", SetBool)


def opened(mission, *, is_open, at=0.0):
    mission.topic("doors/lab/open", Bool).publish_at(at, Bool(data=is_open))


def test_a_door_that_stays_shut_is_not_driven_through(mission, drives, lab):
    lab.reply(SetBoolResponse(success=True))
    opened(mission, is_open=False, at=DRIVE_S + 3.0)
    run = mission(door(patience=20.0))
    run.assert_outcome("closed")
    assert run.duration == pytest.approx(DRIVE_S + 20.0)
    assert len(drives.goals) == 1


@pytest.mark.parametrize("state", ["APPROACH", "WAIT", "ENTER"])
def test_the_way_through_the_door_is_preempted_anywhere(mission, drives, lab, state):
    lab.reply(SetBoolResponse(success=True))
    if state == "ENTER":
        opened(mission, is_open=True, at=DRIVE_S + 3.0)
    mission.preempt(on=state, after=1.0)
    mission(door()).assert_outcome("preempted")


# -- 11 the action server --------------------------------------------------------------------------


def test_a_preempt_that_ends_the_machine_at_once_is_no_failure(mission):
    # Nobody serves the drive: the machine ends before SEND's cancel reaches its server.
    mission.preempt(on="SEND", after=3.0)
    mission(look_at()).assert_outcome("preempted")


def test_the_machine_that_is_served_has_no_problems():
    check(look()).assert_ok()


def test_the_server_takes_one_goal_after_the_other(mission, drives):
    server = offer()
    try:
        with Node("other", transport=mission.network.session(), clock=mission.clock) as node:
            client = ActionClient("look_at", MoveBaseAction, node=node)
            for _ in range(2):
                with client.send(goal_at(Pose2D(1.0, 2.0, 0.0)), timeout=100.0) as goal:
                    goal.result()
            client.stop()
    finally:
        server.stop()
    assert len(drives.goals) == 4


# -- 12 async and typed ----------------------------------------------------------------------------


def test_a_shuttle_that_cannot_get_there_fails(mission, drives):
    drives.default_result(status="aborted")
    mission(shuttle()).assert_outcome("failed")
