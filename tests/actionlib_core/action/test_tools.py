"""What programs use of `actionlib_tools.library`."""

from __future__ import annotations

import pytest

from actionlib_core.action.tools import (
    DynamicAction,
    to_yaml,
    yaml_msg,
    yaml_msg_str,
    yaml_msgs,
    yaml_msgs_str,
)
from actionlib_core.exceptions import FieldError
from actionlib_core.interfaces.actionlib import msg


def test_message_to_text_and_back():
    assert to_yaml(msg.TestGoal(7)) == "goal: 7"
    assert yaml_msg_str(msg.TestGoal, "goal: 7") == msg.TestGoal(7)
    assert yaml_msg_str(msg.TestGoal, " ") == msg.TestGoal()
    assert yaml_msgs_str(msg.TestGoal, to_yaml([{"goal": 1}])) == [msg.TestGoal(1)]


def test_messages_from_files(tmp_path):
    one, many = tmp_path / "one.yaml", tmp_path / "many.yaml"
    one.write_text("goal: 3")
    many.write_text("- goal: 1\n- {goal: 2}\n")
    assert yaml_msg(msg.TestGoal, one) == msg.TestGoal(3)
    assert yaml_msgs(msg.TestGoal, many) == [msg.TestGoal(1), msg.TestGoal(2)]
    assert yaml_msgs_str(msg.TestGoal, "") == []


@pytest.mark.parametrize(
    ("read", "text", "said"),
    [
        (yaml_msg_str, "[1]", "expected a YAML mapping"),
        (yaml_msg_str, "gaol: 1", "gaol"),
        (yaml_msg_str, "{", "malformed YAML"),
        (yaml_msgs_str, "goal: 1", "expected a YAML list"),
        (yaml_msgs_str, "[1]", "expected a YAML mapping"),
        (yaml_msgs_str, "[", "malformed YAML"),
        (yaml_msgs_str, "- goal: x", "goal"),
    ],
)
def test_text_that_does_not_fit_is_refused_with_its_file(read, text, said):
    with pytest.raises(FieldError, match=said) as caught:
        read(msg.TestGoal, text, "goals.yaml")
    assert str(caught.value).startswith("goals.yaml: ")


@pytest.mark.parametrize("name", ["actionlib/Test", "actionlib/TestAction"])
def test_classes_of_an_action_by_its_name(name):
    action = DynamicAction(name)
    assert action.name == "actionlib/Test"
    assert (action.action, action.goal) == (msg.TestAction, msg.TestGoal)
    assert (action.result, action.feedback) == (msg.TestResult, msg.TestFeedback)
