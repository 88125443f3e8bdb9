"""The timeout of a container holds, whatever its children make of the request."""

from __future__ import annotations

import pytest

import smachpy
from smachpy import CBState, Concurrence, Iterator, State, StateMachine
from smachpy.states import Wait

ENDS = ["done", "cleaned", "late", "preempted"]


class Works(State):
    def __init__(self, *, services=False):
        super().__init__(["done", "preempted"])
        self.services = services

    def execute(self, userdata):
        if self.sleep(100.0):
            if self.services:
                self.service_preempt()
                return "done"
            return "preempted"
        return "done"


def tidies_up(**options):
    sm = StateMachine(ENDS, **options)
    sm.add("WORK", Works(), {"preempted": "TIDY"})
    sm.add("TIDY", Wait(3.0), {"done": "cleaned"})
    return sm


def begins_again(**options):
    sm = StateMachine(ENDS, **options)
    sm.add("WORK", Works(), {"preempted": "WORK"})
    return sm


def says_that_it_services(**options):
    sm = StateMachine(ENDS, **options)
    sm.add("WORK", Works(services=True), {"done": "TIDY"})
    sm.add("TIDY", Wait(3.0), {"done": "cleaned"})
    return sm


def default_of_a_concurrence(**options):
    both = Concurrence(["done"], "done", **options)
    both.add("WORK", Works())
    both.add("TOO", Works())
    return both


def rule_of_a_concurrence(**options):
    both = Concurrence(["done", "late"], "late", outcome_map={"done": {"IN": "cleaned"}}, **options)
    both.add("IN", tidies_up())
    return both


def items(**options):
    each = Iterator(["done", "cleaned"], [], [], it=[1, 2], exhausted_outcome="done", **options)
    each.set_contained_state("IN", tidies_up(), ["done"], ["cleaned"])
    return each


SHAPES = [
    (tidies_up, 8.0),
    (begins_again, 105.0),
    (says_that_it_services, 8.0),
    (default_of_a_concurrence, 5.0),
    (lambda **options: machine_of(tidies_up(), **options), 8.0),
    (rule_of_a_concurrence, 8.0),
    (items, 8.0),
]


def machine_of(state, **options):
    sm = StateMachine(ENDS, name="M", **options)
    sm.add("IN", state)
    return sm


@pytest.mark.parametrize("place", ["root", "nested", "branch"])
@pytest.mark.parametrize(("make", "ends"), SHAPES)
def test_a_container_that_its_timeout_has_stopped_ends_with_that_outcome(clock, make, ends, place):
    """It ended as if it had finished, as the tidy-up inside it did."""
    limited = make(timeout=5.0, timeout_outcome="late")
    sm = limited
    if place == "nested":
        sm = machine_of(limited)
    if place == "branch":
        sm = Concurrence(ENDS, "done", outcome_map={"late": {"IN": "late"}})
        sm.add("IN", limited)
    assert sm.execute() == "late"
    assert clock.now() == ends


def test_an_end_without_a_stop_counts(clock):
    class Finishes(Works):
        def execute(self, userdata):
            self.wait_preempt()
            return "done"

    sm = StateMachine(ENDS, name="M", timeout=5.0, timeout_outcome="late")
    sm.add("WORK", Finishes())
    assert sm.execute() == "done"


def test_a_container_that_was_stopped_is_tried_again_whole(clock):
    limited = tidies_up(timeout=5.0, timeout_outcome="late")
    smachpy.set_options(limited, retry=(3, 0.0, "late"))
    assert machine_of(limited).execute() == "late"
    assert clock.now() == 24.0


def test_a_tidy_up_that_raises_is_no_timeout(clock):
    def broken(_userdata):
        raise OSError("the brake is broken")

    sm = StateMachine(ENDS, timeout=5.0, timeout_outcome="late")
    sm.add("WORK", Works(), {"preempted": "TIDY"})
    sm.add("TIDY", CBState(broken, outcomes=["cleaned"]))
    with pytest.raises(smachpy.InvalidUserCodeError, match="the brake is broken"):
        machine_of(sm).execute()
