"""What a visit of a container did not write does not leave it, and what it was not given is gone."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import pytest

import smachpy
from smachpy import CBState, Concurrence, Iterator, Sequence, StateMachine
from smachpy.base.slips import set_accepting
from smachpy.exceptions import InvalidUserCodeError
from smachpy.machines.container import Container

Build = Callable[..., Container]


def machine(child: smachpy.State, **keys: Any) -> Container:
    made = StateMachine(["ok"], **keys)
    made.add("CHILD", child)
    return made


def sequence(child: smachpy.State, **keys: Any) -> Container:
    made = Sequence(["ok"], "ok", **keys)
    made.add("CHILD", child)
    return made


def concurrence(child: smachpy.State, **keys: Any) -> Container:
    made = Concurrence(["ok"], "ok", **keys)
    made.add("CHILD", child)
    return made


def iterator(child: smachpy.State, **keys: Any) -> Container:
    inputs, outputs = keys.get("input_keys", []), keys.get("output_keys", [])
    made = Iterator([], inputs, outputs, [1], exhausted_outcome="ok")
    made.set_contained_state("CHILD", child)
    return made


CONTAINERS = pytest.mark.parametrize("build", [machine, sequence, concurrence, iterator])


def writes_first_time(key: str = "pose") -> smachpy.State:
    visits: list[int] = []

    def look(userdata: Any) -> str:
        visits.append(1)
        if len(visits) == 1:
            setattr(userdata, key, "at the door")
        return "ok"

    return CBState(look, outcomes=["ok"], output_keys=[key])


def twice(inner: Container) -> list[Any]:
    """Run `inner` twice in one run; return what follows it has read."""
    read: list[Any] = []

    def use(userdata: Any) -> str:
        read.append(userdata.pose)
        userdata.pose = None
        return "again" if len(read) < 2 else "done"

    outer = StateMachine(["done"], name="M")
    outer.add("INNER", inner, {"ok": "USE"})
    outer.add("USE", CBState(use, outcomes=["again", "done"], io_keys=["pose"]), {"again": "INNER"})
    outer.execute()
    return read


@CONTAINERS
def test_a_value_of_a_former_visit_does_not_leave(build: Build) -> None:
    assert twice(build(writes_first_time(), output_keys=["pose"])) == ["at the door", None]


@CONTAINERS
def test_nor_does_it_through_two_levels(build: Build) -> None:
    inner = build(writes_first_time(), output_keys=["pose"])
    assert twice(build(inner, output_keys=["pose"])) == ["at the door", None]


@CONTAINERS
def test_what_the_program_has_put_there_leaves_at_each_visit(build: Build) -> None:
    inner = build(CBState(lambda userdata: "ok", outcomes=["ok"]), output_keys=["pose"])
    inner.userdata.pose = "by hand"
    assert twice(inner) == ["by hand", "by hand"]


@CONTAINERS
def test_a_value_that_is_written_again_leaves_also_if_it_is_the_same_object(build: Build) -> None:
    def look(userdata: Any) -> str:
        userdata.pose = "at the door"
        return "ok"

    child = CBState(look, outcomes=["ok"], output_keys=["pose"])
    assert twice(build(child, output_keys=["pose"])) == ["at the door", "at the door"]


@CONTAINERS
def test_a_value_that_was_only_copied_in_overwrites_nothing(build: Build) -> None:
    newer = {}

    def work(_userdata: Any) -> str:
        newer["parent"].userdata.pose = "newer"
        return "ok"

    child = CBState(work, outcomes=["ok"], io_keys=["pose"])
    outer = StateMachine(["ok"], name="M")
    outer.add("INNER", build(child, input_keys=["pose"], output_keys=["pose"]))
    outer.userdata.pose = "old"
    newer["parent"] = outer
    outer.execute()
    assert outer.userdata.pose == "newer"


@CONTAINERS
def test_an_input_that_is_gone_is_not_read_with_its_former_value(build: Build) -> None:
    def work(userdata: Any) -> str:
        assert userdata.order == "old"
        return "ok"

    outer = StateMachine(["ok"], name="M")
    child = CBState(work, outcomes=["ok"], input_keys=["order"])
    outer.add("INNER", build(child, input_keys=["order"]))
    outer.userdata.order = "old"
    outer.execute()
    del outer.userdata.order
    with pytest.raises(InvalidUserCodeError, match=r"no value: got .order."):
        outer.execute()


def test_a_machine_that_counts_in_its_own_userdata_goes_on_counting() -> None:
    def count(userdata: Any) -> str:
        userdata.count += 1
        return "ok"

    inner = machine(CBState(count, outcomes=["ok"], io_keys=["count"]), output_keys=["count"])
    inner.userdata.count = 0
    outer = StateMachine(["ok"], name="M")
    outer.add("INNER", inner)
    outer.execute()
    outer.execute()
    assert outer.userdata.count == 2


def test_programs_for_ros_1_keep_the_way_of_smach() -> None:
    set_accepting(True)
    try:
        inner = machine(writes_first_time(), output_keys=["pose"])
        assert twice(inner) == ["at the door", "at the door"]
    finally:
        set_accepting(False)


def test_a_constant_that_the_state_has_changed_is_whole_at_the_next_visit() -> None:
    """The gripper was opened a little wider in each round."""
    seen: list[Any] = []

    def work(userdata: Any) -> str:
        seen.append((userdata.width, list(userdata.tried)))
        userdata.width += 1
        userdata.tried.append(userdata.width)
        return "again" if len(seen) % 2 else "ok"

    state = CBState(work, outcomes=["again", "ok"], io_keys=["width", "tried"])
    sm = StateMachine(["ok"], name="M")
    sm.add("GRIP", state, {"again": "GRIP"}, constants={"width": 3, "tried": []})
    sm.execute()
    sm.reset_userdata()
    sm.execute()
    assert seen == [(3, [])] * 4


def test_a_constant_that_cannot_be_copied_is_given_as_it_is() -> None:
    device, seen = threading.Lock(), []
    state = CBState(lambda ud: seen.append(ud.port) or "ok", outcomes=["ok"], io_keys=["port"])
    sm = StateMachine(["ok"])
    sm.add("ASK", state, constants={"port": device})
    sm.execute()
    assert seen == [device]


USED_UP = {
    "a generator": lambda: (n for n in (1, 2)),
    "an iterator": lambda: iter([1, 2]),
    "a map": lambda: map(str, (1, 2)),
}


def rounds(items: Any) -> tuple[Iterator, list[Any]]:
    done: list[Any] = []
    child = CBState(lambda ud: done.append(ud.item) or "ok", outcomes=["ok"], input_keys=["item"])
    made = Iterator([], [], [], items, "item", "ok", name="ROUNDS")
    made.set_contained_state("CHILD", child)
    return made, done


@pytest.mark.parametrize("kind", USED_UP)
@pytest.mark.parametrize("given", ["the items", "a function"])
def test_items_that_a_former_run_has_used_up_are_no_work_that_is_done(
    kind: str, given: str
) -> None:
    """The second round visited no place, and the mission succeeded."""
    items: Any = USED_UP[kind]()
    machine, done = rounds(items if given == "the items" else lambda: items)
    assert machine.execute() == "ok"
    assert len(done) == 2
    with pytest.raises(InvalidUserCodeError, match=r"/ROUNDS: items: .* used up; .*Try a list"):
        machine.execute()
    machine.set_iteritems(USED_UP[kind](), "item")
    assert machine.execute() == "ok"
    assert len(done) == 4


@pytest.mark.parametrize("items", [[], range(0), lambda: iter([]), lambda: (n for n in ())])
def test_no_items_are_no_work_at_each_run(items: Any) -> None:
    machine, done = rounds(items)
    assert [machine.execute() for _ in range(3)] == ["ok"] * 3
    assert done == []


@pytest.mark.filterwarnings("ignore::smachpy.base.slips.SlipWarning")
def test_programs_for_ros_1_are_only_warned_of_items_that_are_used_up() -> None:
    set_accepting(True)
    try:
        machine, done = rounds(iter([1]))
        assert [machine.execute() for _ in range(2)] == ["ok", "ok"]
        assert done == [1]
    finally:
        set_accepting(False)
