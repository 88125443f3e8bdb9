"""Missions as files beside those in Python: the same machine, and the same behaviour."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import smachpy
import smachpy_missions.delivery
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy.checks import check
from smachpy.files import resolve
from smachpy.testing import mission_kit
from smachpy_missions.delivery.delivery import delivery

FILE = Path(smachpy_missions.delivery.__file__).with_name("delivery.yaml")


def from_file(**arguments: Any) -> Any:
    return resolve(smachpy.load(FILE, **arguments))


def facts(record: Any) -> Any:
    return (
        record.path,
        record.kind if record.is_container else "leaf",
        record.outcomes,
        record.input_keys,
        record.output_keys,
        record.initial,
        sorted((e.source, e.outcome, e.target, e.target_is_outcome) for e in record.transitions),
        [detail for detail in record.details if detail[0] != "callback"],
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


def test_the_file_has_no_mistakes():
    assert check(smachpy.load(FILE, to_run=False)).ok
