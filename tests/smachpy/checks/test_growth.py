"""Checks and pictures of large machines: steps of the interpreter are counted, not seconds."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Any

import pytest

import smachpy
from smachpy import CBState, Concurrence, StateMachine
from smachpy.checks import graph, never
from smachpy.events.introspection import StateRecord
from smachpy.events.run_state import innermost, paths_above

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

SMALL, LARGE = 40, 320


def lines_run(function: Callable[[], Any]) -> int:
    """Return how many lines of Python a call runs; each turn of a loop counts."""
    count = 0

    def trace(_frame: Any, event: str, _arg: Any) -> Any:
        nonlocal count
        count += event == "line"
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        function()
    finally:
        sys.settrace(before)
    return count


def slope(make: Callable[[int], Any], run: Callable[[Any], Any]) -> float:
    """Return the exponent of the growth from `SMALL` to `LARGE`."""
    run(make(3))  # imports and caches
    small, large = make(SMALL), make(LARGE)
    steps = lines_run(lambda: run(small)), lines_run(lambda: run(large))
    return math.log(steps[1] / steps[0]) / math.log(LARGE / SMALL)


def work(userdata: Any) -> str:
    return "ok"


def reads(userdata: Any) -> str:
    return "ok" if userdata.v else "failed"


def chain(size: int, last: str = "done", state: Callable[[int], Any] | None = None) -> StateMachine:
    machine = StateMachine(["done", "preempted"], name="BIG")
    with machine:
        for number in range(size):
            target = f"S{number + 1}" if number + 1 < size else last
            made = CBState(work, outcomes=["ok"]) if state is None else state(number)
            StateMachine.add(
                f"S{number}", made, {"ok": target, "failed": "done"} if state else {"ok": target}
            )
    return machine


def ring(size: int) -> StateMachine:
    return chain(size, last="S0")


def unset(size: int) -> StateMachine:
    return chain(size, state=lambda _: CBState(reads, outcomes=["ok", "failed"], input_keys=["v"]))


def wide(size: int) -> Concurrence:
    both = Concurrence(["done"], "done", name="WIDE")
    for number in range(size):
        both.add(f"S{number}", CBState(work, outcomes=["ok"]))
    return both


def test_where_a_state_begins_is_found_without_a_walk(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[graph.Graph] = []
    real = graph.Graph

    def keep() -> graph.Graph:
        made.append(real())
        return made[-1]

    monkeypatch.setattr(graph, "Graph", keep)
    smachpy.check(chain(5))
    found = made[0]
    begins = {node.record.path: {node.number} for node in found.nodes if node.outcome is None}
    found.nodes.clear()
    assert {path: found.begins(path) for path in begins} == begins
    assert found.begins("/BIG/OTHER") == set()


def rings(size: int) -> Concurrence:
    both = Concurrence(["done"], "done", name="RINGS")
    for number in range(size):
        both.add(f"R{number}", ring(2))
    return both


@pytest.mark.parametrize("make", [chain, ring, unset, wide, rings])
def test_check_grows_with_the_machine(make: Callable[[int], Any]) -> None:
    assert slope(make, smachpy.check) < 1.2


def test_a_further_child_of_a_concurrence_is_no_dearer_than_the_first_ones() -> None:
    def cost(size: int) -> int:
        both, state = wide(size), CBState(work, outcomes=["ok"])
        return lines_run(lambda: both.add("NEW", state))

    cost(3)  # imports and caches
    assert cost(LARGE) == cost(SMALL)


@pytest.mark.parametrize("what", ["always_reaches(done)", "never(S2)", "after_preempt(S2)"])
def test_properties_grow_with_the_machine(what: str) -> None:
    assert slope(chain, lambda machine: smachpy.check(machine, properties=[what])) < 1.2
    assert slope(ring, lambda machine: smachpy.check(machine, properties=[what])) < 1.2


def test_a_property_for_each_state_takes_no_walk_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    machine = chain(20)
    walks = [0]
    real = StateRecord.walk

    def count(record: StateRecord) -> Any:
        walks[0] += record.path == "/BIG"
        return real(record)

    def walks_of(labels: list[str]) -> int:
        walks[0] = 0
        report = smachpy.check(machine, properties=[never(label) for label in labels])
        assert sum(problem.rule == "property" for problem in report.problems) == len(labels)
        return walks[0]

    monkeypatch.setattr(StateRecord, "walk", count)
    assert walks_of([*machine.get_children()]) == walks_of(["S2"])


def test_a_walk_over_nested_machines_visits_each_once() -> None:
    def nested(depth: int) -> StateMachine:
        machine = chain(1)
        for _ in range(depth):
            outer = StateMachine(["done", "preempted"])
            outer.add("IN", machine)
            machine = outer
        return machine

    def turns(depth: int) -> int:
        record, calls = smachpy.describe(nested(depth)), [0]

        def count(_frame: Any, event: str, _arg: Any) -> None:
            calls[0] += event == "call"  # a generator that goes on counts, too

        before = sys.getprofile()
        sys.setprofile(count)
        try:
            assert sum(1 for _ in record.walk()) == depth + 2
        finally:
            sys.setprofile(before)
        return calls[0]

    assert turns(80) < 2.5 * turns(40)


def test_the_innermost_of_many_active_states_are_found_in_one_walk() -> None:
    assert innermost(["/A", "/A/B", "/A/BC", "/A/B/C"]) == ["/A/BC", "/A/B/C"]
    assert paths_above(["/A/B/C", "/A/D"]) == {"/A/B", "/A"}

    def active(size: int) -> list[str]:
        return ["/BOTH", *(f"/BOTH/S{number}" for number in range(size))]

    assert slope(active, innermost) < 1.2


def test_drawing_as_text_grows_with_the_machine(tmp_path: Path) -> None:
    assert slope(chain, lambda machine: smachpy.render(machine, tmp_path / "m.txt")) < 1.2
