"""Every public name of ROS 1's actionlib is there, with its arguments in its order."""

from __future__ import annotations

import inspect
import subprocess
import sys

import pytest

import actionlib_core as actionlib
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus

# Positional parameters and the defaults they have in ROS 1 ("D" is a zero duration there).
SIGNATURES = {
    "SimpleActionClient": "ns ActionSpec",
    "SimpleActionClient.wait_for_server": "timeout=D",
    "SimpleActionClient.send_goal": "goal done_cb=None active_cb=None feedback_cb=None",
    "SimpleActionClient.send_goal_and_wait": "goal execute_timeout=D preempt_timeout=D",
    "SimpleActionClient.wait_for_result": "timeout=D",
    "SimpleActionClient.get_result": "",
    "SimpleActionClient.get_state": "",
    "SimpleActionClient.get_goal_status_text": "",
    "SimpleActionClient.cancel_all_goals": "",
    "SimpleActionClient.cancel_goals_at_and_before_time": "time",
    "SimpleActionClient.cancel_goal": "",
    "SimpleActionClient.stop_tracking_goal": "",
    "SimpleActionServer": "name ActionSpec execute_cb=None auto_start=True",
    "SimpleActionServer.start": "",
    "SimpleActionServer.accept_new_goal": "",
    "SimpleActionServer.is_new_goal_available": "",
    "SimpleActionServer.is_preempt_requested": "",
    "SimpleActionServer.is_active": "",
    "SimpleActionServer.set_succeeded": "result=None text=''",
    "SimpleActionServer.set_aborted": "result=None text=''",
    "SimpleActionServer.set_preempted": "result=None text=''",
    "SimpleActionServer.publish_feedback": "feedback",
    "SimpleActionServer.get_default_result": "",
    "SimpleActionServer.register_goal_callback": "cb",
    "SimpleActionServer.register_preempt_callback": "cb",
    "SimpleActionServer.internal_goal_callback": "goal",
    "SimpleActionServer.internal_preempt_callback": "preempt",
    "SimpleActionServer.executeLoop": "",
    "ActionClient": "ns ActionSpec",
    "ActionClient.send_goal": "goal transition_cb=None feedback_cb=None",
    "ActionClient.cancel_all_goals": "",
    "ActionClient.cancel_goals_at_and_before_time": "time",
    "ActionClient.wait_for_action_server_to_start": "timeout=D",
    "ActionClient.wait_for_server": "timeout=D",
    "ActionClient.stop": "",
    "ClientGoalHandle.cancel": "",
    "ClientGoalHandle.get_comm_state": "",
    "ClientGoalHandle.get_goal_status": "",
    "ClientGoalHandle.get_goal_status_text": "",
    "ClientGoalHandle.get_result": "",
    "ClientGoalHandle.get_terminal_state": "",
    "get_name_of_constant": "C n",
    "ActionServer": "ns ActionSpec goal_cb cancel_cb=nop_cb auto_start=True",
    "ActionServer.start": "",
    "ActionServer.stop": "",
    "ActionServer.register_goal_callback": "cb",
    "ActionServer.register_cancel_callback": "cancel_cb",
    "ActionServer.initialize": "",
    "ActionServer.publish_result": "status result",
    "ActionServer.publish_feedback": "status feedback",
    "ActionServer.publish_status": "",
    "ActionServer.publish_status_async": "event",
    "ServerGoalHandle.get_default_result": "",
    "ServerGoalHandle.set_accepted": "text=''",
    "ServerGoalHandle.set_canceled": "result=None text=''",
    "ServerGoalHandle.set_rejected": "result=None text=''",
    "ServerGoalHandle.set_aborted": "result=None text=''",
    "ServerGoalHandle.set_succeeded": "result=None text=''",
    "ServerGoalHandle.publish_feedback": "feedback",
    "ServerGoalHandle.get_goal": "",
    "ServerGoalHandle.get_goal_id": "",
    "ServerGoalHandle.get_goal_status": "",
    "ServerGoalHandle.set_cancel_requested": "",
    "GoalIDGenerator": "name=None",
    "GoalIDGenerator.set_name": "name",
    "GoalIDGenerator.generate_ID": "",
    "StatusTracker": "goal_id=None status=None goal=None",
}


def find(path):
    value = actionlib
    for word in path.split("."):
        value = getattr(value, word)
    return value


@pytest.mark.parametrize("path", SIGNATURES)
def test_signature(path):
    parameters = [
        p
        for p in inspect.signature(find(path)).parameters.values()
        if p.kind is p.POSITIONAL_OR_KEYWORD and p.name != "self"
    ]
    expected = [word.partition("=") for word in SIGNATURES[path].split()]
    assert [p.name for p in parameters] == [name for name, _, _ in expected]
    for parameter, (_, equals, default) in zip(parameters, expected, strict=True):
        if not equals:
            continue
        value = parameter.default
        if default == "D":
            assert value == 0
        else:
            assert getattr(value, "__name__", repr(value)) == default


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("action_client", "CommState"),
        ("action_client", "TerminalState"),
        ("action_client", "GoalManager"),
        ("action_client", "CommStateMachine"),
        ("action_client", "get_name_of_constant"),
        ("simple_action_client", "SimpleGoalState"),
        ("action_server", "nop_cb"),
        ("server_goal_handle", "ServerGoalHandle"),
        ("goal_id_generator", "GoalIDGenerator"),
        ("status_tracker", "StatusTracker"),
        ("handle_tracker_deleter", "HandleTrackerDeleter"),
    ],
)
def test_modules_have_their_ros_names(module, name):
    assert getattr(getattr(actionlib, module), name) is getattr(actionlib, name)


def test_constants():
    assert actionlib.CommState.WAITING_FOR_CANCEL_ACK == 4
    assert actionlib.TerminalState.LOST == 9
    assert actionlib.SimpleGoalState.DONE == 2
    assert actionlib.get_name_of_constant(actionlib.CommState, 7) == "DONE"
    assert actionlib.get_name_of_constant(actionlib.TerminalState, 99) == "???"
    assert GoalStatus.to_string(3) == "SUCCEEDED"
    assert actionlib.TerminalState.to_string(2) == "PREEMPTED"
    assert actionlib.CommState.to_string(7) == actionlib.SimpleGoalState.to_string(2) == "DONE"


def test_new_parameters_are_keyword_only():
    for path in ("SimpleActionClient", "SimpleActionServer", "ActionClient", "ActionServer"):
        kinds = {p.name: p.kind for p in inspect.signature(find(path)).parameters.values()}
        assert kinds["node"] is inspect.Parameter.KEYWORD_ONLY


def test_everything_exported_is_documented():
    for name in actionlib.__all__:
        assert getattr(actionlib, name).__doc__, name


def test_import_is_light():
    code = (
        "import sys, actionlib_core; "
        "print([m for m in ('zenoh', 'rosbags', 'numpy', 'transitions') if m in sys.modules])"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    assert out.strip() == "[]"
