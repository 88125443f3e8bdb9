"""Exceptions and values whose `__str__` or `__repr__` raises are reported like any others."""

from __future__ import annotations

import logging

import pytest

import smachpy
from smachpy import CBState, Concurrence, InvalidUserCodeError, Iterator, StateMachine, pnp
from smachpy.events import CallbackFailed, Failed, UserdataWritten

TEXT = "GripError: <its str raised TypeError>"


class GripError(Exception):
    def __str__(self):
        return f"code {None:d}"

    __repr__ = __str__


class Unreadable:
    def __repr__(self):
        raise GripError


def fail(*_):
    raise GripError


def done(userdata):
    return "done"


def leaf(function=done, **options):
    return CBState(function, outcomes=["done"], **options)


def sequence(*states):
    machine = StateMachine(["done"], name="M")
    for number, state in enumerate(states, 1):
        following = f"S{number + 1}" if number < len(states) else "done"
        machine.add(f"S{number}", state, {"done": following})
    return machine


def both(*states, **options):
    machine = Concurrence(["done"], "done", **options)
    with machine:
        for number, state in enumerate(states, 1):
            machine.add(f"S{number}", state)
    return machine


def rounds(items):
    machine = Iterator(["exhausted"], [], [], it=items)
    with machine:
        machine.set_contained_state("S1", leaf(), loop_outcomes=["done"])
    return machine


def plan(action=done, **options):
    return pnp.PetriNetPlan(pnp.action("a").net("M"), {"a": action}, **options)


MACHINES = {
    "state": lambda: sequence(leaf(fail)),
    "hook": lambda: sequence(leaf(on_enter=fail)),
    "child": lambda: both(leaf(fail), leaf()),
    "outcome_cb": lambda: both(leaf(), outcome_cb=fail),
    "child_termination_cb": lambda: both(leaf(), child_termination_cb=fail),
    "items": lambda: rounds(fail),
    "action": lambda: plan(fail),
    "condition": lambda: pnp.PetriNetPlan(
        pnp.choose({"c": pnp.action("wait", 0)}).net("M"), {}, {"c": fail}
    ),
}


@pytest.mark.parametrize("make", MACHINES.values(), ids=list(MACHINES))
def test_the_error_of_the_run_names_the_exception(make):
    """A `TypeError` of the exception's own `__str__` was raised, without the path."""
    with pytest.raises(InvalidUserCodeError, match=TEXT):
        make().execute()


def test_a_watched_state_that_raises_is_an_event():
    seen = []
    machine = sequence(leaf(fail))
    machine.subscribe(seen.append)
    with pytest.raises(InvalidUserCodeError):
        machine.execute()
    assert [event.error for event in seen if isinstance(event, Failed)] == [TEXT]


def test_the_machine_goes_on_after_a_callback_that_raises(caplog):
    seen = []
    machine = sequence(leaf(), leaf())
    machine.register_start_cb(fail)
    machine.register_transition_cb(fail)
    machine.register_termination_cb(fail)
    machine.subscribe(seen.append)
    assert machine.execute() == "done"
    assert [event.error for event in seen if isinstance(event, CallbackFailed)] == [TEXT] * 3


@pytest.mark.parametrize("value", [1, Unreadable()], ids=["exception", "value"])
def test_a_listener_that_raises_has_no_effect(caplog, value):
    """The log's text had the `repr` of the exception and of the event, with the value in it."""

    def write(userdata):
        userdata.x = value
        return "done"

    def listener(event):
        raise GripError if isinstance(value, int) else ValueError("listener")

    machine = sequence(leaf(write, output_keys=["x"]))
    machine.subscribe(listener)
    with caplog.at_level(logging.ERROR, "smachpy"):
        assert machine.execute() == "done"
    assert UserdataWritten.__name__ in caplog.text
    assert smachpy.describe(machine).path in caplog.text
