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
    "set_loggers": dict(info=..., warn=..., debug=..., error=...),
    "loginfo": dict(msg=...),
    "set_shutdown_check": dict(cb=...),
    "has_smach_interface": dict(obj=...),
    "cb_interface": dict(outcomes=N, input_keys=N, output_keys=N),
    "CBInterface": dict(cb=..., outcomes=N, input_keys=N, output_keys=N, io_keys=N),
    "State": dict(outcomes=E, input_keys=E, output_keys=E, io_keys=E),
    "State.execute": dict(self=..., ud=...),
    "State.register_outcomes": dict(self=..., new_outcomes=...),
    "State.get_registered_outcomes": dict(self=...),
    "State.register_io_keys": dict(self=..., keys=...),
    "State.register_input_keys": dict(self=..., keys=...),
    "State.get_registered_input_keys": dict(self=...),
    "State.register_output_keys": dict(self=..., keys=...),
    "State.get_registered_output_keys": dict(self=...),
    "State.request_preempt": dict(self=...),
    "State.service_preempt": dict(self=...),
    "State.recall_preempt": dict(self=...),
    "State.preempt_requested": dict(self=...),
    "CBState": dict(
        cb=..., cb_args=E, cb_kwargs=E, outcomes=E, input_keys=E, output_keys=E, io_keys=E
    ),
    "UserData": dict(),
    "UserData.update": dict(self=..., other_userdata=...),
    "UserData.extract": dict(self=..., keys=..., remapping=...),
    "UserData.merge": dict(self=..., ud=..., keys=..., remapping=...),
    "UserData.keys": dict(self=...),
    "Remapper": dict(ud=..., input_keys=E, output_keys=E, remapping=E),
    "Remapper.update": dict(self=..., other_userdata=...),
    "Remapper.keys": dict(self=...),
    "Container": dict(outcomes=E, input_keys=E, output_keys=E),
    "Container.get_children": dict(self=...),
    "Container.set_initial_state": dict(self=..., initial_states=..., userdata=N),
    "Container.get_initial_states": dict(self=...),
    "Container.get_active_states": dict(self=...),
    "Container.get_internal_edges": dict(self=...),
    "Container.check_consistency": dict(self=...),
    "Container.register_start_cb": dict(self=..., start_cb=..., cb_args=E),
    "Container.register_transition_cb": dict(self=..., transition_cb=..., cb_args=E),
    "Container.register_termination_cb": dict(self=..., termination_cb=..., cb_args=E),
    "Container.call_start_cbs": dict(self=...),
    "Container.call_transition_cbs": dict(self=...),
    "Container.call_termination_cbs": dict(self=..., terminal_states=..., outcome=...),
    "Container.open": dict(self=...),
    "Container.close": dict(self=...),
    "Container.is_opened": dict(self=...),
    "Container.assert_opened": dict(self=..., msg=""),
    "StateMachine": dict(outcomes=..., input_keys=E, output_keys=E),
    "StateMachine.add": dict(label=..., state=..., transitions=N, remapping=N, constants=N),
    "StateMachine.add_auto": dict(
        label=..., state=..., connector_outcomes=..., transitions=N, remapping=N, constants=N
    ),
    "StateMachine.execute": dict(self=..., parent_ud=N),
    "StateMachine.set_initial_state": dict(self=..., initial_states=..., userdata=N),
    "StateMachine.check_state_spec": dict(self=..., label=..., state=..., transitions=...),
    "StateMachine.is_running": dict(self=...),
    "Sequence": dict(outcomes=..., connector_outcome=..., input_keys=E, output_keys=E),
    "Sequence.add": dict(label=..., state=..., transitions=N, remapping=N),
    "Concurrence": dict(
        outcomes=...,
        default_outcome=...,
        input_keys=E,
        output_keys=E,
        outcome_map=E,
        outcome_cb=N,
        child_termination_cb=N,
    ),
    "Concurrence.add": dict(label=..., state=..., remapping=E),
    "Concurrence.execute": dict(self=..., parent_ud=N),
    "Concurrence.is_running": dict(self=...),
    "Iterator": dict(
        outcomes=...,
        input_keys=...,
        output_keys=...,
        it=E,
        it_label="it_data",
        exhausted_outcome="exhausted",
    ),
    "Iterator.set_iteritems": dict(it=..., it_label="it_data"),
    "Iterator.set_contained_state": dict(
        label=..., state=..., loop_outcomes=E, break_outcomes=E, final_outcome_map=E
    ),
    "Iterator.execute": dict(self=..., parent_ud=N),
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
    from smachpy.state import State

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
