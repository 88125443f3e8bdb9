"""What is found in a plan without running it, with the run that shows it."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smachpy.pnp import Arc, Net, Place, Transition, check_plan, explore, understand
from tests.smachpy.pnp.nets import net_of


def rules(text, **options):
    return [p.rule for p in check_plan(understand(net_of(text), **options))]


GOOD = """
init* -> A.exec : A.start
A.exec -> goal : A.end
"""


def test_nothing_wrong():
    assert rules(GOOD) == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("init* -> A.exec : B.start\nA.exec -> goal : A.end", ["unmatched", "unmatched"]),
        ("init* -> A.exec : start\nA.exec -> goal : end", []),
        ("init* -> x : start\nx -> goal : t", ["unmatched"]),
        (GOOD + "\nelse -> goal : t", ["dead-transition", "unmarked-place"]),
        ("init* -> A.exec : A.start\nA.exec -> x : A.end", ["no-goal"]),
        ("init* -> A.exec : A.start\nA.exec -> x : A.end\nx y -> goal : t", ["unreachable-goal", "deadlock", "dead-transition", "unmarked-place", "unmarked-place"]),
        ("init* -> init x : t\ninit -> goal : u", ["unbounded"]),
        ("init* -> A.exec : A.start\nA.exec -> goal : A.end\nA.exec -> goal : A.end [c]", ["race"]),
        ("init* -> A.exec : A.start\nA.exec -> goal : A.end [c]\nA.exec -> goal : A.end [not c]", []),
        ("init* -> A.exec : A.start\nA.exec -> goal : A.end\nA.exec -> init : A.interrupt [c]", []),
        ("init* -> a b : t\na -> A.exec : A.start\nb -> A.exec~ : A.start\nA.exec -> c : A.end\nA.exec~ -> d : A.end\nc d -> goal : u", ["shared-name"]),
        ("init* -> A.exec B.exec : A.start B.start\nA.exec B.exec -> goal : A.end B.end", ["two-ends"]),
        ("init -> goal : t", ["no-token"]),
        ("-> goal : t\ninit* -> goal : u", ["no-input"]),
        ("init* -> A.exec : A.start\nA.exec -> Goal : A.end", ["comment", "no-goal"]),
        ("init* -> x : t\nx -> init : u", ["no-goal", "busy"]),
        ("init* -> x : t\nx -> init : u [c]", ["no-goal"]),
        ("init* -> A.exec : A.start\nA.exec -> init : A.interrupt\nA.exec -> goal : A.end", ["busy"]),
        ("init* -> A.exec : A.start\nA.exec -> init : A.end\nA.exec -> goal : A.end [c]", ["race"]),
        ("init* -> goal : t\ngoal -> init : u", []),
    ],
)  # fmt: skip
def test_rules(text, expected):
    assert rules(text) == expected


def test_strict_waits_for_both_ends():
    text = "init* -> A.exec B.exec : A.start B.start\nA.exec B.exec -> goal : A.end B.end"
    assert rules(text, strict=True) == []


def test_a_deadlock_comes_with_the_run_to_it():
    text = "init* -> a : left\ninit -> b : right\nb -> goal : on"
    (problem,) = check_plan(understand(net_of(text)))
    assert problem.rule == "deadlock"
    assert problem.run == ("left",)
    assert problem.marking == "{a}"


def test_a_loop_without_time_comes_with_the_firings_of_it():
    net = net_of("init* -> x : t\nx -> y : there\ny -> x : back\nx -> goal : on [c]")

    (problem,) = check_plan(understand(net))

    assert problem.rule == "busy"
    assert (
        "there, back lead from {x} back to it" in problem.message
        or "back, there lead from {y}" in problem.message
    )
    assert problem.run[0] == "t"


def test_an_unbounded_net_names_the_place_that_grows():
    (problem,) = check_plan(understand(net_of("init* -> init heap : t\nheap x -> goal : u")))
    assert problem.element == "place 'p1' (heap)"
    assert set(problem.run) == {"t"}


def test_a_guess_for_a_name_that_does_not_match():
    text = "init* -> goto_kitchen.exec : goto_kitchn.start\ngoto_kitchen.exec -> goal : end"
    problems = check_plan(understand(net_of(text)))
    assert any("Did you mean" in str(p) for p in problems)


@given(st.integers(0, 2**20))
def test_markings_are_those_of_a_plain_search(seed):
    import random

    dice = random.Random(seed)
    places = tuple(Place(f"p{n}", "", dice.choice([0, 0, 1])) for n in range(4))
    transitions = tuple(Transition(f"t{n}") for n in range(4))
    arcs = [
        Arc(*pair, dice.choice([1, 1, 2]))
        for t in transitions
        for pair in ((dice.choice(places).id, t.id), (t.id, dice.choice(places).id))
    ]
    net = Net("drawn", places, transitions, tuple(dict.fromkeys(arcs)))
    found = explore(net, limit=300)
    if not found.complete:
        return
    start = tuple(p.tokens for p in places)
    seen, queue = {start}, [start]
    for marking in queue:
        for number in range(4):
            after = list(marking)
            for p, weight in net.inputs[number]:
                after[p] -= weight
            if min(after) < 0:
                continue
            for p, weight in net.outputs[number]:
                after[p] += weight
            if tuple(after) not in seen:
                seen.add(tuple(after))
                queue.append(tuple(after))
    assert {tuple(m.count(p) for p in range(4)) for m in found.came} == seen
    for marking in itertools.islice(found.came, 20):
        at = net.initial
        for step in found.run_to(marking):
            assert net.has_tokens(at, step)
            at = net.fire(at, step)
        assert at == marking


def test_a_search_among_many_tokens_ends_early():
    places = tuple(Place(f"p{n}", "", 300 * (n == 0)) for n in range(3))
    transitions = tuple(Transition(f"t{n}") for n in range(3))
    arcs = tuple(
        arc for n in range(3) for arc in (Arc(f"p{n}", f"t{n}"), Arc(f"t{n}", f"p{(n + 1) % 3}"))
    )
    found = explore(Net("many", places, transitions, arcs))
    assert not found.complete
    assert len(found.came) < 3000
