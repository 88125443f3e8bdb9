"""The states of ROS 2's actions in those of ROS 1's, and back."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from actionlib_core.goal.states import TERMINAL, Status
from actionlib_core.wire.ros2.goal_states import (
    ENDED,
    TO_CODE,
    TO_STATUS,
    TO_STATUS_NEVER_ACTIVE,
    GoalCode,
    draw_tables,
    give_reason,
    reason_of,
    to_code,
    to_status,
)
from tests.places import DOCS


def test_the_tables_are_complete() -> None:
    assert set(TO_STATUS) == set(TO_STATUS_NEVER_ACTIVE) == set(GoalCode)
    assert set(TO_CODE) == set(Status)


@pytest.mark.parametrize(("code", "active", "never_active"), [
    (1, Status.PENDING, Status.PENDING),
    (2, Status.ACTIVE, Status.ACTIVE),
    (3, Status.PREEMPTING, Status.RECALLING),
    (4, Status.SUCCEEDED, Status.SUCCEEDED),
    (5, Status.PREEMPTED, Status.RECALLED),
    (6, Status.ABORTED, Status.ABORTED),
    (0, Status.LOST, Status.LOST),
    (7, Status.LOST, Status.LOST),
    (-1, Status.LOST, Status.LOST),
])  # fmt: skip
def test_what_a_client_sees(code: int, active: Status, never_active: Status) -> None:
    assert to_status(code, was_active=True) is active
    assert to_status(code, was_active=False) is never_active


def test_an_end_is_an_end_on_both_sides() -> None:
    for status in Status:
        assert (to_code(status) in ENDED) == (status in TERMINAL)
    for code in GoalCode:
        for was_active in (True, False):
            assert (to_status(code, was_active=was_active) in TERMINAL) == (code in ENDED)


def test_what_a_client_sees_of_a_server_here_is_its_status_but_for_a_late_refusal() -> None:
    for status in set(Status) - {Status.REJECTED}:
        was_active = status not in {Status.PENDING, Status.RECALLING, Status.RECALLED}
        assert to_status(to_code(status), was_active=was_active) is status
    assert to_status(to_code(Status.REJECTED), was_active=True) is Status.ABORTED


def test_the_table_of_the_documentation_is_the_one_that_runs() -> None:
    drawn = draw_tables()
    assert drawn in (DOCS / "ros2_servers.md").read_text()
    for code in GoalCode:
        assert f"| {code.value} {code.name.lower()} |" in drawn
    for status in Status:
        assert f"`{status.name}`" in drawn


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({}, ""),
        ({"error_code": 0, "error_msg": ""}, ""),
        ({"error_code": 9000, "error_msg": "no way"}, "no way (error code 9000)"),
        ({"error_code": 9000, "error_msg": ""}, "error code 9000"),
        ({"error_code": -5, "error_string": "goal tolerance"}, "goal tolerance (error code -5)"),
        ({"error_code": SimpleNamespace(val=1)}, ""),
        ({"error_msg": 7, "error_code": "7"}, ""),
    ],
)
def test_reason_in_a_result(fields, reason):
    assert reason_of(SimpleNamespace(**fields)) == reason


@pytest.mark.parametrize(
    ("fields", "given"),
    [
        ({}, False),
        ({"error_msg": ""}, True),
        ({"error_string": ""}, True),
        ({"error_msg": "said"}, False),
        ({"error_msg": 0}, False),
    ],
)
def test_reason_for_a_result(fields, given):
    result = SimpleNamespace(**fields)
    assert give_reason(result, "no way") is given
    assert (reason_of(result) == "no way") is given
