"""Checks of finished containers, on drawn specifications."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

import smachpy
from smachpy.machines.rules import all_of, any_of
from smachpy.machines.validate import (
    ChildSpec,
    ConcurrenceSpec,
    LoopSpec,
    MachineSpec,
    concurrence_problems,
    loop_problems,
    machine_problems,
)

NAMES = st.sampled_from(["a", "b", "c", "A", "B", "C", "preempted"])
OUTCOMES = st.lists(NAMES, max_size=3, unique=True).map(tuple)
TARGETS = NAMES | st.none() | st.just("")
children = st.builds(
    ChildSpec,
    label=st.sampled_from("ABC"),
    outcomes=OUTCOMES,
    transitions=st.dictionaries(NAMES, TARGETS, max_size=3).map(lambda d: tuple(d.items())),
)
some_children = st.lists(children, max_size=3, unique_by=lambda child: child.label).map(tuple)
machines = st.builds(
    MachineSpec,
    where=st.just("/M"),
    outcomes=OUTCOMES,
    children=some_children,
    initial=st.sampled_from("ABC") | st.none(),
)


@given(machines)
def test_a_machine_without_problems_has_a_way_on_from_every_outcome(spec):
    problems = machine_problems(spec)
    labels = {child.label for child in spec.children}
    dead_ends = [
        (child.label, outcome)
        for child in spec.children
        for outcome, target in child.targets().items()
        if outcome not in child.outcomes
        or ((target or outcome) not in spec.outcomes and target not in labels)
    ]
    empty = [child for child in spec.children if not child.outcomes]
    assert bool(problems) == bool(dead_ends or empty or spec.initial not in labels)
    assert len(problems) == len(dead_ends) + len(empty) + (not labels or spec.initial not in labels)
    assert all(problem.startswith("/M") for problem in problems)


@given(machines)
def test_machines_that_pass_run_and_the_others_raise(spec):
    sm = smachpy.StateMachine(spec.outcomes, name="M")
    for child in spec.children:
        steps = iter(range(4))

        def answer(_ud, child=child, steps=steps):
            if next(steps, None) is None:
                raise StopIteration
            return child.outcomes[-1]

        sm.add(
            child.label, smachpy.CBState(answer, outcomes=child.outcomes), dict(child.transitions)
        )
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
        assert outcome in spec.outcomes


@given(
    st.builds(
        ConcurrenceSpec,
        where=st.just("/C"),
        outcomes=OUTCOMES,
        children=some_children,
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
)
def test_a_concurrence_without_problems_names_only_what_exists(spec):
    known = {child.label: {*child.outcomes, "preempted"} for child in spec.children}
    good = bool(known) and (spec.default is None or spec.default in spec.outcomes)
    for outcome, rule in spec.rules:
        good = good and outcome in spec.outcomes
        for label, wanted in rule.conditions:
            good = good and label in known and known[label] >= set(wanted)
    assert good == (not concurrence_problems(spec))


@given(
    st.builds(
        LoopSpec,
        where=st.just("/L"),
        outcomes=OUTCOMES,
        child=children | st.none(),
        exhausted=NAMES,
        loop=OUTCOMES,
        breaks=OUTCOMES,
        final=st.dictionaries(NAMES, NAMES, max_size=2).map(lambda d: tuple(d.items())),
    )
)
def test_a_loop_without_problems_ends_with_its_own_outcomes(spec):
    problems = loop_problems(spec)
    if not problems:
        final = dict(spec.final)
        assert spec.child is not None
        assert {final.get(o, o) for o in (*spec.breaks, spec.exhausted)} <= set(spec.outcomes)
        assert {*spec.breaks, *spec.loop} <= set(spec.child.outcomes)
