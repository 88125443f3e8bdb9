"""Kills at every write of the journal: the run that goes on ends as the one without kills."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import smachpy
from smachpy import Concurrence, Iterator, Sequence, State, StateMachine
from smachpy.durable.journal import read_position
from smachpy.durable.mission import kept_mission, new_mission

if TYPE_CHECKING:
    from collections.abc import Iterator as IteratorOf

    from smachpy.machines.container import Container
from tests.smachpy.durable.killing_store import Kill, KillingStore

Tree = tuple[str, tuple[Any, ...]]

LEAVES = st.sampled_from(["plain", "once", "retry", "list", "loop"])
TREES: st.SearchStrategy[Tree] = st.recursive(
    st.tuples(LEAVES, st.just(())),
    lambda below: st.tuples(
        st.sampled_from(["machine", "sequence", "concurrence", "iterator", "tidied"]),
        st.lists(below, min_size=1, max_size=3).map(tuple),
    ),
    max_leaves=6,
)


@dataclass
class World:
    """What outlives the process: what was done in it, by whom."""

    done: list[str] = field(default_factory=list)
    begun: list[str] = field(default_factory=list)


class Leaf(State):
    """Does one thing in the world and counts in its userdata; the same each time it is executed."""

    def __init__(self, world: World, name: str, kind: str) -> None:
        options: dict[str, Any] = {"retry": (3, 0.0, ["again"])} if kind == "retry" else {}
        super().__init__(["ok", "again"], io_keys=["count", "seen"], **options)
        self.world, self.name, self.kind = world, name, kind
        self.tries = 0

    def execute(self, userdata: Any) -> str:
        self.world.begun.append(self.name)
        if self.kind == "once":
            number = smachpy.once("thing", lambda: self.do(userdata.count))
            assert number == userdata.count
        if self.kind == "list":
            userdata.seen.append(self.name)  # in place: no write that anybody is told of
        userdata.count += 1
        if self.kind == "retry":
            return "again" if userdata.count % 3 else "ok"
        return "again" if self.kind == "loop" and userdata.count % 4 else "ok"

    def do(self, number: int) -> int:
        self.world.done.append(f"{self.name} {number}")
        return number


def build(tree: Tree, world: World, name: str = "M") -> Any:
    """Return the machine, or the leaf, of a tree; the same each time."""
    kind, below = tree
    keys = {"input_keys": ["count", "seen"], "output_keys": ["count", "seen"]}
    if not below:
        return Leaf(world, name, kind)
    children = [build(child, world, f"{name}{number}") for number, child in enumerate(below)]
    container: Container
    if kind == "iterator":
        container = Iterator(["ok"], it=range(2), exhausted_outcome="ok", **keys)
        with container:
            inner = StateMachine(["ok"], **keys)
            with inner:
                outcomes = children[0].get_registered_outcomes()
                StateMachine.add("IN", children[0], dict.fromkeys(outcomes, "ok"))
            Iterator.set_contained_state("EACH", inner, loop_outcomes=["ok"])
    elif kind == "concurrence":
        container = Concurrence(["ok"], "ok", **keys)
        with container:
            for number, child in enumerate(children):
                key = f"count{number}"
                container.userdata[key], container.userdata[f"seen{number}"] = 0, []
                remapping = {"count": key, "seen": f"seen{number}"}
                Concurrence.add(f"S{number}", child, remapping=remapping)
    elif kind == "sequence":
        container = Sequence(["ok", "again"], connector_outcome="ok", **keys)
        with container:
            for number, child in enumerate(children):
                Sequence.add(f"S{number}", child)
    else:
        container = StateMachine(["ok"], **keys)
        if kind == "tidied" and len(children) > 1:
            container.add_cleanup("LAST", children.pop())
        last = len(children) - 1
        with container:
            for number, child in enumerate(children):
                own = f"S{number}"
                following = "ok" if number == last else f"S{number + 1}"
                loops = own if below[number][0] == "loop" else following
                transitions = {"ok": following, "again": loops}
                outcomes = child.get_registered_outcomes()
                StateMachine.add(own, child, {o: transitions[o] for o in outcomes})
    return container


def root_of(tree: Tree, world: World) -> StateMachine:
    root = StateMachine(["ok", "again", "aborted"], name="ROOT")
    root.userdata.count, root.userdata.seen = 0, []
    with root:
        StateMachine.add("M", build(tree, world))
    return root


def values(machine: Any) -> IteratorOf[tuple[str, Any]]:
    for path, container in walk(machine, "/ROOT"):
        for key in sorted(container.userdata.keys()):
            # A list that two containers share is two lists after a resume: what a container that
            # does not run has of it may differ. The root gets it when those below it end.
            if path == "/ROOT" or not key.startswith("seen"):
                yield f"{path} {key}", container.userdata[key]


def walk(machine: Any, path: str) -> IteratorOf[tuple[str, Any]]:
    if machine._smachpy_is_container:
        yield path, machine
        for label, child in machine.get_children().items():
            yield from walk(child, f"{path}/{label}")


def live(tree: Tree, world: World, store: KillingStore) -> tuple[str, dict[str, Any]] | None:
    """Run, or go on, in a process of its own; None: it was killed."""
    machine = root_of(tree, world)
    if store.find("m") is None:
        store.create(new_mission(machine, mission="m"))
    try:
        # The lease without an end needs no thread: on a busy computer each took longest.
        with kept_mission(machine, store, "m", lease_s=math.inf):
            outcome = machine.execute()
    except Kill:
        return None
    return outcome, dict(values(machine))


@pytest.mark.slow
@pytest.mark.timeout(900)  # hundreds of runs; on a busy machine they take minutes
@settings(max_examples=40)
@given(TREES)
def test_a_run_killed_at_any_write_ends_as_one_that_is_not(tree: Tree) -> None:
    calm, store = World(), KillingStore()
    expected = live(tree, calm, store)
    writes = store.writes
    assert expected is not None
    for kill_at in range(1, writes):  # the last one says that it has ended
        for written in (False, True):
            world, store = World(), KillingStore()
            store.arm(kill_at, written=written)
            ended = live(tree, world, store)
            has_ended = store.rows["m"].status == "ended"
            # Branches may share more writes than in the calm run: this one may be the last, or none.
            assert is_parallel(tree) or (ended is None and not has_ended)
            if not has_ended:
                store.arm(0, written=False)
                ended = live(tree, world, store)
            if ended is not None or not has_ended:
                assert ended == expected, (kill_at, written)
            check_deeds(calm, world, exact=written and not is_parallel(tree))


@pytest.mark.timeout(900)  # hundreds of runs; on a busy machine they take minutes
@settings(max_examples=60)
@given(TREES, st.lists(st.tuples(st.integers(1, 8), st.booleans()), min_size=1, max_size=6))
def test_a_run_killed_again_and_again_ends_as_one_that_is_not(
    tree: Tree, kills: list[tuple[int, bool]]
) -> None:
    calm = World()
    expected = live(tree, calm, KillingStore())
    world, store = World(), KillingStore()
    ended = None
    for kill_at, written in kills:
        store.arm(kill_at, written=written)
        ended = live(tree, world, store)
        if ended is not None or store.rows["m"].status == "ended":
            break
    if store.rows["m"].status != "ended":
        store.arm(0, written=False)
        ended = live(tree, world, store)
    if ended is not None:
        assert ended == expected
    assert read_position(store, "m").data["outcome"] == (expected or ("",))[0]
    exact = all(written for _, written in kills) and not is_parallel(tree)
    check_deeds(calm, world, exact=exact)


def is_parallel(tree: Tree) -> bool:
    """Tell whether branches run side by side.

    Their timing decides how many of them share a write, and a kill at the write of one may come
    between a call of another one and the write of its result, so that the call is repeated.
    """
    kind, below = tree
    return (kind == "concurrence" and len(below) > 1) or any(map(is_parallel, below))


def check_deeds(calm: World, world: World, *, exact: bool) -> None:
    """Check what was done: nothing is left out, and what was written down is not done twice."""
    assert set(world.done) == set(calm.done)
    assert set(world.begun) == set(calm.begun)
    if exact:
        assert sorted(world.done) == sorted(calm.done)
