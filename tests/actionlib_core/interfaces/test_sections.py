"""Splitting .srv and .action text at its separators."""

from __future__ import annotations

import warnings

import pytest

from actionlib_core.exceptions import InterfaceError, InterfaceWarning
from actionlib_core.interfaces._sources import ACTION_PARTS, SERVICE_PARTS, action_messages, split


def test_three_parts_and_their_lines() -> None:
    parts = split("int32 a\n---\n# c\nint32 b\n---\n", ACTION_PARTS, "x")
    assert [(p.text, p.first_line) for p in parts] == [
        ("int32 a\n", 1),
        ("# c\nint32 b\n", 3),
        ("", 6),
    ]


def test_plain_separators_do_not_warn() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        split("string in\n---\nstring out", SERVICE_PARTS, "x")
        split("  ---  # response\n", SERVICE_PARTS, "x")


@pytest.mark.parametrize("separator", ["--", "----", "-------", "—", "–––", "-–"])
def test_printed_separators_are_accepted_with_a_warning(separator: str) -> None:
    with pytest.warns(InterfaceWarning, match="separator .* taken for '---'") as caught:
        parts = split(f"string in\n{separator}\nstring out\n", SERVICE_PARTS, "My.srv")
    assert (caught[0].filename, caught[0].lineno) == ("My.srv", 2)
    assert [p.text for p in parts] == ["string in\n", "string out\n"]


def test_too_few() -> None:
    with pytest.raises(InterfaceError) as caught:
        split("int32 a\n---\nint32 b", ACTION_PARTS, "Turn.action")
    assert str(caught.value).startswith(
        "Turn.action:3: got 1 separators; expected 2 `---` between goal, result, feedback"
    )
    with pytest.raises(InterfaceError, match="got 0 separators"):
        split("", SERVICE_PARTS, "My.srv")


def test_too_many() -> None:
    with pytest.raises(InterfaceError, match=r"My.srv:3: one separator too many; expected 1 `---`"):
        split("a\n---\n---\n", SERVICE_PARTS, "My.srv")


def test_action_messages_have_the_ros_names() -> None:
    assert set(action_messages("Demo_action")) == {
        "Demo_actionAction",
        "Demo_actionActionGoal",
        "Demo_actionActionResult",
        "Demo_actionActionFeedback",
    }
