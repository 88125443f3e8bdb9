"""Machines nested in each other: as deep as is promised, and refused beyond."""

from __future__ import annotations

from typing import Any

import pytest

import smachpy
from smachpy import CBState, Concurrence, InvalidStateError, StateMachine
from smachpy.machines import container
from smachpy.machines.container import MAX_LEVELS, Container, allow_depth


def work(userdata: Any) -> str:
    return "ok"


def nested(levels: int, kind: str = "machine") -> Container:
    inner: Any = CBState(work, outcomes=["ok"])
    for _ in range(levels):
        made: Container = StateMachine(["ok"]) if kind == "machine" else Concurrence(["ok"], "ok")
        made.add("IN", inner)  # type: ignore[attr-defined]
        inner = made
    assert isinstance(inner, Container)
    return inner


def test_the_deepest_machine_runs_at_once_and_is_watched_checked_and_described() -> None:
    machine = nested(MAX_LEVELS)
    assert machine.execute() == "ok"
    events: list[Any] = []
    machine.subscribe(events.append)
    assert machine.execute() == "ok"
    assert len(events) == 2 * (MAX_LEVELS + 1)
    assert not smachpy.check(machine).problems
    assert len([*smachpy.describe(machine).walk()]) == MAX_LEVELS + 1


def test_a_deeper_one_is_refused_with_its_depth() -> None:
    machine = nested(MAX_LEVELS + 1)
    for refuse in (machine.check_consistency, machine.execute, lambda: smachpy.check(machine)):
        with pytest.raises(InvalidStateError, match=r"more than 300 levels"):
            refuse()


def test_a_container_that_is_used_in_many_places_is_looked_at_once_per_level() -> None:
    inner: Any = CBState(work, outcomes=["ok"])
    for _ in range(60):
        made = StateMachine(["ok"])
        made.add("A", inner, {"ok": "B"})
        made.add("B", inner)
        inner = made
    allow_depth(inner)


def test_building_inside_out_walks_no_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    walks: list[Any] = []
    original = container.below

    def counted(state: Any) -> Any:
        walks.append(state)
        return original(state)

    monkeypatch.setattr(container, "below", counted)
    nested(50)
    assert walks == []


def test_a_container_in_itself_is_refused_however_deep() -> None:
    inner = StateMachine(["ok"])
    middle, outer = StateMachine(["ok"]), StateMachine(["ok"])
    middle.add("INNER", inner)
    outer.add("MIDDLE", middle)
    for machine in (inner, middle, outer):
        with pytest.raises(InvalidStateError, match="which contains this container"):
            inner.add("ROUND", machine)


def closed(inner: Any, levels: int) -> StateMachine:
    """Build machines inside out, each in a `with` block of its own."""
    for _ in range(levels):
        made = StateMachine(["ok"])
        with made:
            StateMachine.add("IN", inner)
        inner = made
    assert isinstance(inner, StateMachine)
    return inner


def test_the_end_of_a_with_block_checks_what_is_new_only(monkeypatch: pytest.MonkeyPatch) -> None:
    checked: list[Any] = []
    original = StateMachine.find_problems

    def counted(self: StateMachine, where: str) -> tuple[str, ...]:
        checked.append(self)
        return original(self, where)

    monkeypatch.setattr(StateMachine, "find_problems", counted)
    machine = closed(CBState(work, outcomes=["ok"]), 100)
    assert len(checked) == 100
    assert allow_depth(machine) == 100
    machine.check_consistency()
    assert len(checked) == 101
    assert machine.execute() == "ok"


@pytest.mark.parametrize("change", ["add", "outcome of a state", "outcome of a machine", "initial"])
def test_what_was_changed_inside_is_checked_again(change: str) -> None:
    leaf = CBState(work, outcomes=["ok"])
    inner = closed(leaf, 1)
    outer = closed(inner, 2)
    if change == "add":
        inner.add("MORE", CBState(work, outcomes=["ok"]), {"ok": "NOWHERE"})
    elif change == "outcome of a state":
        leaf.register_outcomes(["more"])
    elif change == "outcome of a machine":
        inner.register_outcomes(["more"])
    else:
        inner._smachpy.initial = "NOWHERE"
        inner._smachpy.restructured()
    with pytest.raises(InvalidStateError):
        outer.check_consistency()
    with pytest.raises(InvalidStateError):
        closed(outer, 1)
    with pytest.raises(InvalidStateError):
        outer.execute()


def test_a_change_of_the_outermost_machine_is_checked_again() -> None:
    outer = closed(CBState(work, outcomes=["ok"]), 2)
    outer.add("MORE", CBState(work, outcomes=["ok"]), {"ok": "NOWHERE"})
    with pytest.raises(InvalidStateError, match="NOWHERE"):
        outer.check_consistency()
    with pytest.raises(InvalidStateError, match="NOWHERE"):
        closed(outer, 1)


def test_a_machine_that_gets_too_deep_by_checked_ones_is_refused() -> None:
    machine = closed(CBState(work, outcomes=["ok"]), MAX_LEVELS)
    with pytest.raises(InvalidStateError, match=r"more than 300 levels"):
        closed(machine, 1)
