"""Outcome rules of concurrences."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smachpy.exceptions import InvalidStateError
from smachpy.machines.rules import Rule, all_of, any_of, as_rules, decide, n_of

LABELS = st.sampled_from("ABCD")
OUTCOMES = st.sampled_from(["x", "y", "z"])
children = st.dictionaries(LABELS, OUTCOMES | st.none(), min_size=4, max_size=4)
conditions = st.dictionaries(LABELS, OUTCOMES | st.lists(OUTCOMES, min_size=1), min_size=1)


def met(label, wanted, outcomes):
    return outcomes[label] in ([wanted] if isinstance(wanted, str) else wanted)


@given(conditions, children)
def test_all_any_and_n_mean_what_they_say(wanted, outcomes):
    count = sum(met(label, one, outcomes) for label, one in wanted.items())
    assert all_of(wanted).holds(outcomes) == (count == len(wanted))
    assert any_of(wanted).holds(outcomes) == (count >= 1)
    for n in range(1, len(wanted) + 1):
        assert n_of(n, wanted).holds(outcomes) == (count >= n)


@given(st.dictionaries(OUTCOMES, conditions), children)
def test_the_decision_is_a_rule_that_holds_and_asks_for_most(outcome_map, outcomes):
    rules = as_rules(outcome_map)
    chosen = decide(rules, outcomes)
    named = None if chosen is None else (chosen[1].need, chosen[0])
    holding = [(rule.need, outcome) for outcome, rule in rules if rule.holds(outcomes)]
    if not holding:
        assert named is None
    else:
        assert named in holding
        assert named[0] == max(need for need, _ in holding)


@pytest.mark.parametrize("n", [0, 3, -1])
def test_n_out_of_range_is_told(n):
    with pytest.raises(InvalidStateError, match="expected 1 <= n <= 2"):
        n_of(n, {"A": "x", "B": "x"})


def test_rules_that_could_never_hold_are_refused():
    with pytest.raises(InvalidStateError, match="any_of"):
        any_of({})
    for rule in (all_of, any_of, lambda wanted: n_of(1, wanted)):
        with pytest.raises(InvalidStateError, match="'A'"):
            rule({"A": [], "B": "x"})


def test_rules_read_well():
    assert str(all_of({"A": "x"})) == "A:x"
    assert str(all_of({"A": "x", "B": ["y", "z"]})) == "all of A:x, B:y|z"
    assert str(any_of({"A": "x", "B": "y"})) == "any of A:x, B:y"
    assert str(n_of(2, {"A": "x", "B": "y", "C": "z"})) == "2 of A:x, B:y, C:z"
    assert Rule(1, (("A", ("x",)),)) == any_of({"A": "x"})
