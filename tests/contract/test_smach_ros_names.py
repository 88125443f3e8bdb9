"""Every public name of `smach_ros`: where it is, its arguments, their order and defaults."""

from __future__ import annotations

import importlib
import inspect

import pytest

import smachpy as smach_ros
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.time import to_seconds

ALL = [
    "set_preempt_handler",
    "ActionServerWrapper",
    "IntrospectionClient",
    "IntrospectionServer",
    "SimpleActionState",
    "ServiceState",
    "MonitorState",
    "ConditionState",
]

MODULES = {
    "util": ["set_preempt_handler"],
    "action_server_wrapper": ["ActionServerWrapper"],
    "introspection": [
        "IntrospectionClient",
        "IntrospectionServer",
        "ContainerProxy",
        "STATUS_TOPIC",
        "INIT_TOPIC",
        "STRUCTURE_TOPIC",
    ],
    "simple_action_state": ["SimpleActionState"],
    "service_state": ["ServiceState"],
    "monitor_state": ["MonitorState"],
    "condition_state": ["ConditionState"],
}

E = ()  # an empty list, a tuple or a dict; () and None stand for it here
N = None

SIGNATURES = {
    "set_preempt_handler": {"sc": ...},
    "SimpleActionState": {
        "action_name": ...,
        "action_spec": ...,
        "goal": N,
        "goal_key": N,
        "goal_slots": E,
        "goal_cb": N,
        "goal_cb_args": E,
        "goal_cb_kwargs": E,
        "result_key": N,
        "result_slots": E,
        "result_cb": N,
        "result_cb_args": E,
        "result_cb_kwargs": E,
        "input_keys": E,
        "output_keys": E,
        "outcomes": E,
        "exec_timeout": N,
        "preempt_timeout": "inherit",  # 60 s, unless a container gives less
        "server_wait_timeout": 60.0,
    },
    "ServiceState": {
        "service_name": ...,
        "service_spec": ...,
        "request": N,
        "request_cb": N,
        "request_cb_args": E,
        "request_cb_kwargs": E,
        "request_key": N,
        "request_slots": E,
        "response_cb": N,
        "response_cb_args": E,
        "response_cb_kwargs": E,
        "response_key": N,
        "response_slots": E,
        "input_keys": E,
        "output_keys": E,
        "outcomes": E,
    },
    "MonitorState": {
        "topic": ...,
        "msg_type": ...,
        "cond_cb": ...,
        "max_checks": -1,
        "input_keys": E,
        "output_keys": E,
    },
    "ConditionState": {
        "cond_cb": ...,
        "input_keys": E,
        "poll_rate": 0.05,
        "timeout": N,
        "max_checks": 1,
    },
    "ActionServerWrapper": {
        "server_name": ...,
        "action_spec": ...,
        "wrapped_container": ...,
        "succeeded_outcomes": E,
        "aborted_outcomes": E,
        "preempted_outcomes": E,
        "goal_key": "action_goal",
        "feedback_key": "action_feedback",
        "result_key": "action_result",
        "goal_slots_map": E,
        "feedback_slots_map": E,
        "result_slots_map": E,
        "expand_goal_slots": False,
        "pack_result_slots": False,
    },
    "ActionServerWrapper.run_server": {"self": ...},
    "ActionServerWrapper.transition_cb": {"self": ..., "userdata": ..., "active_states": ...},
    "ActionServerWrapper.termination_cb": {
        "self": ...,
        "userdata": ...,
        "terminal_states": ...,
        "container_outcome": ...,
    },
    "ActionServerWrapper.publish_feedback": {"self": ..., "userdata": ...},
    "ActionServerWrapper.execute_cb": {"self": ..., "goal": ...},
    "ActionServerWrapper.preempt_cb": {"self": ...},
    "IntrospectionServer": {"server_name": ..., "state": ..., "path": ...},
    "IntrospectionServer.start": {"self": ...},
    "IntrospectionServer.stop": {"self": ...},
    "IntrospectionServer.construct": {"self": ..., "server_name": ..., "state": ..., "path": ...},
    "IntrospectionServer.clear": {"self": ...},
    "IntrospectionClient": {},
    "IntrospectionClient.get_servers": {"self": ...},
    "IntrospectionClient.set_initial_state": {
        "self": ...,
        "server": ...,
        "path": ...,
        "initial_states": ...,
        "initial_userdata": N,
        "timeout": N,
    },
    "introspection.ContainerProxy": {
        "server_name": ...,
        "container": ...,
        "path": ...,
        "update_rate": 2.0,
    },
    "introspection.ContainerProxy.start": {"self": ...},
    "introspection.ContainerProxy.stop": {"self": ...},
}


def test_all_names_come_from_the_root():
    for name in ALL:
        assert hasattr(smach_ros, name), name
        assert name in smach_ros.__all__


@pytest.mark.parametrize("module", MODULES)
def test_every_name_is_where_programs_import_it_from(module):
    found = importlib.import_module(f"smachpy.{module}")
    for name in MODULES[module]:
        assert hasattr(found, name), name


@pytest.mark.parametrize("name", sorted(SIGNATURES))
def test_arguments_order_and_defaults(name):
    thing = smach_ros
    for part in name.split("."):
        thing = getattr(thing, part)
    positional = {
        p.name: p
        for p in inspect.signature(thing).parameters.values()
        if p.kind is p.POSITIONAL_OR_KEYWORD
    }
    assert list(positional) == list(SIGNATURES[name])
    for key, default in SIGNATURES[name].items():
        given = positional[key].default
        if default is ...:
            assert given is inspect.Parameter.empty, key
        elif default in (E, N):
            assert given in (E, N), key
        else:
            assert to_seconds(given) == default if isinstance(default, float) else given == default


def test_outcomes_and_constants():
    def outcomes(state):
        return list(state.get_registered_outcomes())

    def yes(*_):
        return True

    from actionlib_core.interfaces.std_msgs.msg import Empty as EmptyMessage
    from actionlib_core.interfaces.std_srvs.srv import Empty as EmptyService

    state = smach_ros.SimpleActionState("a", Action)
    assert outcomes(state) == ["succeeded", "aborted", "preempted"]
    constants = ["WAITING_FOR_SERVER", "INACTIVE", "ACTIVE", "PREEMPTING", "COMPLETED"]
    assert [getattr(smach_ros.SimpleActionState, name) for name in constants] == [0, 1, 2, 3, 4]
    assert outcomes(smach_ros.ServiceState("s", EmptyService)) == [
        "succeeded",
        "aborted",
        "preempted",
    ]
    monitor = smach_ros.MonitorState("t", EmptyMessage, yes)
    assert outcomes(monitor) == ["valid", "invalid", "preempted"]
    assert outcomes(smach_ros.ConditionState(yes)) == ["true", "false", "preempted"]
