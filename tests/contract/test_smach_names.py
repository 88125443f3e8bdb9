"""Every public name of `smach`: where it is, its arguments, their order and defaults."""

from __future__ import annotations

import importlib
import inspect

import pytest

import smachpy as smach

# Module -> names that programs import from it.
MODULES = {
    "": [
        "set_loggers loginfo logwarn logerr logdebug is_shutdown set_shutdown_check",
        "has_smach_interface cb_interface CBInterface",
        "State CBState UserData Remapper Container StateMachine Sequence Concurrence Iterator",
        "SmachError InvalidTransitionError InvalidStateError InvalidConstructionError",
        "InvalidUserCodeError",
    ],
    "state": ["State CBState"],
    "state_machine": ["StateMachine"],
    "container": ["Container"],
    "concurrence": ["Concurrence"],
    "iterator": ["Iterator"],
    "sequence": ["Sequence"],
    "user_data": ["UserData Remapper Const get_const"],
    "util": ["is_shutdown set_shutdown_check cb_interface has_smach_interface CBInterface"],
    "exceptions": [
        "SmachError InvalidTransitionError InvalidStateError InvalidConstructionError",
        "InvalidUserCodeError",
    ],
    "log": ["set_loggers loginfo logwarn logerr logdebug"],
}

E = ()  # an empty list or dict; () and None stand for it here
N = None

# Name -> arguments with defaults, as in SMACH; `...` has no default.
SIGNATURES = {
    "set_loggers": {"info": ..., "warn": ..., "debug": ..., "error": ...},
    "loginfo": {"msg": ...},
    "set_shutdown_check": {"cb": ...},
    "has_smach_interface": {"obj": ...},
    "cb_interface": {"outcomes": N, "input_keys": N, "output_keys": N},
    "CBInterface": {"cb": ..., "outcomes": N, "input_keys": N, "output_keys": N, "io_keys": N},
    "State": {"outcomes": E, "input_keys": E, "output_keys": E, "io_keys": E},
    "State.execute": {"self": ..., "ud": ...},
    "State.register_outcomes": {"self": ..., "new_outcomes": ...},
    "State.get_registered_outcomes": {"self": ...},
    "State.register_io_keys": {"self": ..., "keys": ...},
    "State.register_input_keys": {"self": ..., "keys": ...},
    "State.get_registered_input_keys": {"self": ...},
    "State.register_output_keys": {"self": ..., "keys": ...},
    "State.get_registered_output_keys": {"self": ...},
    "State.request_preempt": {"self": ...},
    "State.service_preempt": {"self": ...},
    "State.recall_preempt": {"self": ...},
    "State.preempt_requested": {"self": ...},
    "CBState": {
        "cb": ...,
        "cb_args": E,
        "cb_kwargs": E,
        "outcomes": E,
        "input_keys": E,
        "output_keys": E,
        "io_keys": E,
    },
    "UserData": {},
    "UserData.update": {"self": ..., "other_userdata": ...},
    "UserData.extract": {"self": ..., "keys": ..., "remapping": ...},
    "UserData.merge": {"self": ..., "ud": ..., "keys": ..., "remapping": ...},
    "UserData.keys": {"self": ...},
    "Remapper": {"ud": ..., "input_keys": E, "output_keys": E, "remapping": E},
    "Remapper.update": {"self": ..., "other_userdata": ...},
    "Remapper.keys": {"self": ...},
    "Container": {"outcomes": E, "input_keys": E, "output_keys": E},
    "Container.get_children": {"self": ...},
    "Container.set_initial_state": {"self": ..., "initial_states": ..., "userdata": N},
    "Container.get_initial_states": {"self": ...},
    "Container.get_active_states": {"self": ...},
    "Container.get_internal_edges": {"self": ...},
    "Container.check_consistency": {"self": ...},
    "Container.register_start_cb": {"self": ..., "start_cb": ..., "cb_args": E},
    "Container.register_transition_cb": {"self": ..., "transition_cb": ..., "cb_args": E},
    "Container.register_termination_cb": {"self": ..., "termination_cb": ..., "cb_args": E},
    "Container.call_start_cbs": {"self": ...},
    "Container.call_transition_cbs": {"self": ...},
    "Container.call_termination_cbs": {"self": ..., "terminal_states": ..., "outcome": ...},
    "Container.open": {"self": ...},
    "Container.close": {"self": ...},
    "Container.is_opened": {"self": ...},
    "Container.assert_opened": {"self": ..., "msg": ""},
    "StateMachine": {"outcomes": ..., "input_keys": E, "output_keys": E},
    "StateMachine.add": {
        "label": ...,
        "state": ...,
        "transitions": N,
        "remapping": N,
        "constants": N,
    },
    "StateMachine.add_auto": {
        "label": ...,
        "state": ...,
        "connector_outcomes": ...,
        "transitions": N,
        "remapping": N,
        "constants": N,
    },
    "StateMachine.execute": {"self": ..., "parent_ud": N},
    "StateMachine.set_initial_state": {"self": ..., "initial_states": ..., "userdata": N},
    "StateMachine.check_state_spec": {"self": ..., "label": ..., "state": ..., "transitions": ...},
    "StateMachine.is_running": {"self": ...},
    "Sequence": {"outcomes": ..., "connector_outcome": ..., "input_keys": E, "output_keys": E},
    "Sequence.add": {"label": ..., "state": ..., "transitions": N, "remapping": N},
    "Concurrence": {
        "outcomes": ...,
        "default_outcome": ...,
        "input_keys": E,
        "output_keys": E,
        "outcome_map": E,
        "outcome_cb": N,
        "child_termination_cb": N,
    },
    "Concurrence.add": {"label": ..., "state": ..., "remapping": E},
    "Concurrence.execute": {"self": ..., "parent_ud": N},
    "Concurrence.is_running": {"self": ...},
    "Iterator": {
        "outcomes": ...,
        "input_keys": ...,
        "output_keys": ...,
        "it": E,
        "it_label": "it_data",
        "exhausted_outcome": "exhausted",
    },
    "Iterator.set_iteritems": {"it": ..., "it_label": "it_data"},
    "Iterator.set_contained_state": {
        "label": ...,
        "state": ...,
        "loop_outcomes": E,
        "break_outcomes": E,
        "final_outcome_map": E,
    },
    "Iterator.execute": {"self": ..., "parent_ud": N},
}


@pytest.mark.parametrize("module", sorted(MODULES))
def test_every_name_is_where_programs_import_it_from(module):
    found = importlib.import_module(f"smachpy.{module}" if module else "smachpy")
    for name in " ".join(MODULES[module]).split():
        assert hasattr(found, name), name


@pytest.mark.parametrize("name", sorted(SIGNATURES))
def test_arguments_order_and_defaults(name):
    thing = smach
    for part in name.split("."):
        thing = getattr(thing, part)
    expected = SIGNATURES[name]
    positional = {
        p.name: p
        for p in inspect.signature(thing).parameters.values()
        if p.kind is p.POSITIONAL_OR_KEYWORD
    }
    assert list(positional) == list(expected)
    for key, default in expected.items():
        given = positional[key].default
        if default is ...:
            assert given is inspect.Parameter.empty, key
        elif default in (E, N):
            assert given in (E, N), key
        else:
            assert given == default, key


def test_class_attributes_that_third_parties_read():
    sm = smach.StateMachine(["done"])
    sm.add("A", smach.CBState(lambda ud: "done", outcomes=["done"]))
    assert list(sm._states) == ["A"]
    assert sm._transitions == {"A": {}}
    assert sm._remappings == {"A": {}}
    assert sm._initial_state_label == "A"
    assert sm._current_label is None
    assert sm._current_state is None
    assert sm._is_running is False
    assert sm["A"]._preempt_requested is False
    assert smach.UserData()._data == {}


def test_the_error_tree():
    for name in ("Transition", "State", "Construction", "UserCode"):
        error = getattr(smach, f"Invalid{name}Error")
        assert issubclass(error, smach.SmachError)
        assert str(error("text")) == "text"


def test_the_decorator_and_the_module_of_the_same_name():
    import smachpy.state
    from smachpy.machines.state import State

    assert smachpy.state.State is State is smach.State
    assert callable(smachpy.state)


def test_importing_the_root_loads_nothing_heavy():
    import subprocess
    import sys

    code = (
        "import sys, smachpy; "
        "print([m for m in ('zenoh', 'numpy', 'rosbags', 'rich', 'transitions') if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
