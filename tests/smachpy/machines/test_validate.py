"""Checks of finished containers, on drawn specifications."""

from __future__ import annotations

from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

import smachpy
from smachpy.machines.rules import all_of, any_of

NAMES = st.sampled_from(["a", "b", "c", "A", "B", "C", "preempted"])
OUTCOMES = st.lists(NAMES, max_size=3, unique=True).map(tuple)
TARGETS = NAMES | st.none()


class Child(NamedTuple):
    label: str
    outcomes: tuple[str, ...]
    transitions: dict[str, str | None]

    def targets(self):
        return dict.fromkeys(self.outcomes) | self.transitions

    def state(self):
        return smachpy.CBState(lambda _ud: self.outcomes[-1], outcomes=self.outcomes)


children = st.builds(
    Child,
    label=st.sampled_from("ABC"),
    outcomes=OUTCOMES,
    transitions=st.dictionaries(NAMES, TARGETS, max_size=3),
)
some_children = st.lists(children, max_size=3, unique_by=lambda child: child.label).map(tuple)


def machine_of(outcomes, of_children, initial=None):
    sm = smachpy.StateMachine(outcomes, name="M")
    for child in of_children:
        sm.add(child.label, child.state(), child.transitions)
    if initial is not None:
        sm.set_initial_state([initial])
    return sm


@given(OUTCOMES, some_children)
def test_a_machine_without_problems_has_a_way_on_from_every_outcome(outcomes, of_children):
    problems = machine_of(outcomes, of_children).find_problems("/M")
    labels = {child.label for child in of_children}
    dead_ends = [
        (child.label, outcome)
        for child in of_children
        for outcome, target in child.targets().items()
        if outcome not in child.outcomes
        or ((target or outcome) not in outcomes and target not in labels)
    ]
    empty = [child for child in of_children if not child.outcomes]
    assert len(problems) == len(dead_ends) + len(empty) + (not labels)
    assert all(problem.startswith("/M") for problem in problems)


def test_an_initial_state_that_was_renamed_away_is_a_problem():
    sm = machine_of(["a"], [Child("A", ("a",), {})])
    sm.get_children()["B"] = sm.get_children().pop("A")  # as programs for SMACH do
    sm._smachpy.transitions["B"] = {}
    (problem,) = sm.find_problems("/M")
    assert problem.startswith("/M: initial state: got 'A'; expected one of ['B'].")


@given(OUTCOMES, some_children)
def test_machines_that_pass_run_and_the_others_raise(outcomes, of_children):
    sm = smachpy.StateMachine(outcomes, name="M")
    for child in of_children:
        steps = iter(range(4))

        def answer(_ud, child=child, steps=steps):
            if next(steps, None) is None:
                raise StopIteration
            return child.outcomes[-1]

        sm.add(child.label, smachpy.CBState(answer, outcomes=child.outcomes), child.transitions)
    good = not sm.find_problems("/M")
    try:
        outcome = sm.execute()
    except smachpy.InconsistentMachineError as error:
        assert not good
        assert error.problems == sm.find_problems("/M")  # noqa: PT017  one of three ends
    except smachpy.InvalidUserCodeError:
        assert good  # it went round in a circle
    else:
        assert good
        assert outcome in outcomes


@given(
    outcomes=OUTCOMES,
    of_children=some_children,
    default=NAMES | st.none(),
    rules=st.lists(
        st.tuples(
            NAMES,
            st.dictionaries(st.sampled_from("ABC"), NAMES, min_size=1).map(all_of)
            | st.dictionaries(st.sampled_from("ABC"), NAMES, min_size=1).map(any_of),
        ),
        max_size=2,
    ).map(tuple),
)
def test_a_concurrence_without_problems_names_only_what_exists(
    outcomes, of_children, default, rules
):
    cc = smachpy.Concurrence(["first"], "first")
    for child in of_children:
        cc.add(child.label, child.state())
    # Set past the constructor, which refuses some of them: a subclass may change them later.
    cc._smachpy.outcomes, cc._smachpy.default_outcome = outcomes, default
    cc._smachpy.rules = rules
    known = {child.label: {*child.outcomes, "preempted"} for child in of_children}
    good = bool(known) and (default is None or default in outcomes)
    for outcome, rule in rules:
        good = good and outcome in outcomes
        for label, wanted in rule.conditions:
            good = good and label in known and known[label] >= set(wanted)
    problems = cc.find_problems("/C")
    assert good == (not problems)
    assert all(problem.startswith("/C: ") for problem in problems)


@given(
    outcomes=OUTCOMES,
    child=children | st.none(),
    exhausted=NAMES,
    loop=OUTCOMES,
    breaks=OUTCOMES,
    final=st.dictionaries(NAMES, NAMES, max_size=2),
)
def test_a_loop_without_problems_ends_with_its_own_outcomes(
    outcomes, child, exhausted, loop, breaks, final
):
    loops = smachpy.Iterator(outcomes, [], [], range(2), exhausted_outcome=exhausted)
    if child is not None:
        loops.set_contained_state(child.label, child.state(), loop, breaks, final)
    problems = loops.find_problems("/L")
    assert all(problem.startswith("/L") for problem in problems)
    own = {*outcomes, exhausted}
    good = child is not None
    if child is not None:
        ends = breaks or [o for o in child.outcomes if loop and o not in (*loop, "preempted")]
        named = {*loop, *ends, *final} - ({exhausted} - {*loop, *ends})
        good = named <= set(child.outcomes)
        good = good and {final.get(o, o) for o in (*ends, exhausted)} <= own
    assert good == (not problems)


def test_an_empty_target_is_refused():
    """It meant the outcome of the machine, and said nothing."""
    sm = smachpy.StateMachine(["done"])
    with pytest.raises(smachpy.InvalidStateError, match="transitions: got 'done': '' in it"):
        sm.add("A", smachpy.CBState(lambda _ud: "done", outcomes=["done"]), {"done": ""})
