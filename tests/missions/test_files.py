"""Missions as files beside those in Python: the same machine, and the same behaviour."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import smachpy
import smachpy_missions.delivery
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy.checks import check
from smachpy.files import read, resolve
from smachpy.places.maps import OFFICE_WAYPOINTS
from smachpy.pnp.files import load_plan
from smachpy.sim.interfaces import ChargeAction
from smachpy.states import Wait, load_route, pose_of
from smachpy.testing import mission_kit
from smachpy_missions.delivery.delivery import delivery
from smachpy_missions.patrol import patrol

FILE = Path(smachpy_missions.delivery.__file__).with_name("delivery.yaml")


PATROL = FILE.parent.parent / "patrol.yaml"
ERRAND = FILE.parent.parent / "pnp" / "errand.yaml"


def from_file(**arguments: Any) -> Any:
    return resolve(smachpy.load(FILE, **arguments))


def patrol_from_file() -> Any:
    return resolve(smachpy.load(PATROL))


def facts(record: Any) -> Any:
    return (
        record.path,
        record.kind if record.is_container else "leaf",
        record.outcomes,
        record.input_keys,
        record.output_keys,
        record.initial,
        sorted((e.source, e.outcome, e.target, e.target_is_outcome) for e in record.transitions),
        [detail for detail in record.details if detail[0] not in {"callback", "condition"}],
        [facts(child) for child in record.children],
    )


def story(make: Any, answer: str, *, door: bool, drives: list[str]) -> Any:
    with mission_kit() as mission:
        robot = mission.action_server("move_base", MoveBaseAction)
        for status in drives:
            robot.reply(status=status, duration=7)
        robot.default_result(duration=7)
        mission.service_server("/doors/lab/set", SetBool).default_response({"success": door})
        mission.topic("/doors/lab/open", Bool).publish(data=True, latch=True)
        mission.replace("CONFIRM", [answer])
        mission.replace("HELP", ["no"])
        run = mission(make())
    left = [(e.path, e.outcome, e.t) for e in run.events if type(e).__name__ == "Left"]
    return run.outcome, run.duration, left


def test_the_delivery_is_the_same_machine():
    assert facts(smachpy.describe(from_file())) == facts(smachpy.describe(delivery()))


@pytest.mark.parametrize("answer", ["yes", "no", "no_answer"])
@pytest.mark.parametrize("door", [True, False])
@pytest.mark.parametrize("drives", [[], ["aborted"], ["succeeded", "aborted"], ["aborted"] * 9])
def test_the_delivery_behaves_the_same(answer, door, drives):
    first = story(delivery, answer, door=door, drives=drives)
    assert story(from_file, answer, door=door, drives=drives) == first


def patrol_story(make: Any, levels: list[float], drives: list[str], preempt: float | None) -> Any:
    with mission_kit() as mission:
        robot = mission.action_server("move_base", MoveBaseAction)
        for status in drives:
            robot.reply(status=status, duration=7)
        robot.default_result(duration=7)
        mission.action_server("charge", ChargeAction).default_result(duration=60)
        battery = mission.topic("battery", BatteryState)
        for number, level in enumerate(levels):
            battery.publish_at(1.0 + 10.0 * number, BatteryState(percentage=level))
        if preempt is not None:
            mission.preempt(at=preempt)
        run = mission(make())
        goals = [pose_of(goal.target_pose.pose) for goal in robot.goals]
        goals = [tuple(round(number, 6) for number in pose) for pose in goals]
    left = [(e.path, e.outcome, e.t) for e in run.events if type(e).__name__ == "Left"]
    return run.outcome, run.duration, left, goals, run.userdata["index"]


def test_the_patrol_is_the_same_machine():
    assert facts(smachpy.describe(patrol_from_file())) == facts(smachpy.describe(patrol()))


@pytest.mark.parametrize("levels", [[0.9], [0.9, 0.3, 0.9], [0.36, 0.35, 0.34, 0.34, 0.9]])
@pytest.mark.parametrize("drives", [[], ["succeeded", "aborted"]])
@pytest.mark.parametrize("preempt", [None, 5.0, 13.5])
def test_the_patrol_behaves_the_same(levels, drives, preempt):
    first = patrol_story(patrol, levels, drives, preempt)
    assert patrol_story(patrol_from_file, levels, drives, preempt) == first


def test_the_file_of_the_patrol_has_the_waypoints_of_the_map():
    route = load_route(OFFICE_WAYPOINTS)
    defaults = {one.name: one.default for one in read(PATROL)[1]}
    places = [
        {"name": one.name, "x": one.pose.x, "y": one.pose.y, "yaw": round(one.pose.yaw, 6)}
        for one in route.waypoints
    ]
    limits = {"low_battery": route.low_battery, "charge_until": route.charge_until}
    assert defaults == {"waypoints": places, **limits}


def errand_in_python() -> Any:
    sm = smachpy.StateMachine(["succeeded", "failed", "preempted"], name="ERRAND")
    plan = load_plan(ERRAND.with_suffix(".pnml"))
    ends = dict.fromkeys(plan.get_registered_outcomes(), "failed")
    sm.add("GO", plan, {**ends, "goal": "WAIT", "preempted": "preempted"})
    sm.add("WAIT", Wait(2.0), {"done": "succeeded"})
    return sm


def errand_from_file() -> Any:
    return resolve(smachpy.load(ERRAND, allow=["smachpy_missions"]))


def errand_story(make: Any, drives: list[str]) -> Any:
    with mission_kit() as mission:
        robot = mission.action_server("move_base", MoveBaseAction)
        for status in drives:
            robot.reply(status=status, duration=7)
        robot.default_result(duration=7)
        run = mission(make())
    return run.outcome, run.duration, run.path, run.states


def test_the_errand_is_the_same_machine():
    assert facts(smachpy.describe(errand_from_file())) == facts(
        smachpy.describe(errand_in_python())
    )


@pytest.mark.parametrize("drives", [[], ["aborted"], ["succeeded", "aborted"]])
def test_the_errand_behaves_the_same(drives):
    assert errand_story(errand_from_file, drives) == errand_story(errand_in_python, drives)


@pytest.mark.parametrize("file", [FILE, PATROL, ERRAND])
def test_the_files_have_no_mistakes(file):
    assert check(smachpy.load(file, allow=["smachpy_missions"])).ok
