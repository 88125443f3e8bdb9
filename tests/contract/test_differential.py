"""The same machines on `standalone-smach` and here: outcome, order, callbacks, userdata.

Hypothesis draws a machine as data; both libraries build and run it. What differs on purpose is
left out here and listed, with a test each, in docs/coming_from_smach.md.
"""

from __future__ import annotations

import os
import threading
from dataclasses import dataclass

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import smachpy

threading.Thread.isAlive = threading.Thread.is_alive  # the package still calls it
MACHINES = int(os.environ.get("MACHINES", "600"))  # `make soak` compares 4,000
smach = pytest.importorskip("smach", reason="standalone-smach is in the extra `test`")


@dataclass(frozen=True)
class Leaf:
    """Returns 'again' so often, then 'next', or from then on 'preempted' after asking for it."""

    again: int
    add: int
    reads: str
    writes: str
    preempts: bool = False
    constant: int | None = None


@dataclass(frozen=True)
class Child:
    part: object
    forward: int | None  # how many states ahead 'next' leads; None: ends the machine
    back: int  # how many states back 'again' leads
    implicit: bool = False  # 'next' is left to fall through


@dataclass(frozen=True)
class Machine:
    children: tuple[Child, ...]
    keys: tuple[str, ...]
    start: int = 0


@dataclass(frozen=True)
class Loop:
    leaf: Leaf
    items: int
    kind: str
    final: bool


@dataclass(frozen=True)
class Chain:
    leaves: tuple[Leaf, ...]


@dataclass(frozen=True)
class Both:
    leaves: tuple[Leaf, ...]
    rules: tuple[tuple[int, str], ...]
    callback: bool


KEYS = ("k0", "k1", "k2")
leaves = st.builds(
    Leaf,
    again=st.integers(0, 2),
    add=st.integers(-3, 3),
    reads=st.sampled_from(KEYS),
    writes=st.sampled_from(KEYS),
    preempts=st.sampled_from([False] * 6 + [True]),
    constant=st.sampled_from([None, None, 5]),
)
peaceful = st.builds(
    Leaf,
    again=st.just(0),
    add=st.integers(-3, 3),
    reads=st.sampled_from(KEYS),
    writes=st.sampled_from(KEYS),
)
loops = st.builds(
    Loop,
    leaf=leaves.filter(lambda leaf: not leaf.preempts),
    items=st.integers(0, 4),
    kind=st.sampled_from(["list", "range", "callable", "generator"]),
    final=st.booleans(),
)
chains = st.builds(Chain, st.lists(leaves, min_size=1, max_size=3).map(tuple))


def machines(parts):
    child = st.builds(
        Child,
        part=parts,
        forward=st.sampled_from([1, 1, 1, 2, None]),
        back=st.integers(0, 1),
        implicit=st.booleans(),
    )
    return st.builds(
        Machine,
        children=st.lists(child, min_size=1, max_size=4).map(tuple),
        keys=st.lists(st.sampled_from(KEYS), unique=True, max_size=3).map(tuple),
        start=st.integers(0, 3),
    )


sequential = machines(st.recursive(leaves | loops | chains, machines, max_leaves=6))
both = st.builds(
    Both,
    leaves=st.lists(peaceful, min_size=1, max_size=4).map(tuple),
    rules=st.lists(st.tuples(st.integers(0, 3), st.sampled_from(["won", "lost"])), max_size=2).map(
        tuple
    ),
    callback=st.booleans(),
)
parallel = machines(leaves | both)


class Build:
    """Builds a drawn machine with one of the two libraries and records what happens."""

    def __init__(self, library):
        self.library = library
        self.log = []
        self.root = None
        self.asked = 0

    def container(self, container, path, *, order=True):
        def note(kind):
            def callback(userdata, *args):
                plain = [list(a) if isinstance(a, (list, tuple)) else a for a in args]
                self.log.append((kind, path, plain))

            return callback

        container.register_start_cb(note("start"))
        if order:
            container.register_transition_cb(note("transition"), ["extra"])
        container.register_termination_cb(note("end"))
        return container

    def leaf(self, leaf, path, *, extra=()):
        build = self

        class State(self.library.State):
            def __init__(self):
                build.library.State.__init__(
                    self, ["next", "again", "preempted"], ["x", *extra], ["y"]
                )
                self.left = leaf.again

            def execute(self, ud):
                value = ud.x + (ud[extra[0]] if extra else 0)
                ud.y = value + leaf.add
                build.log.append(("run", path, value))
                if self.left:
                    self.left -= 1
                    return "again"
                if leaf.preempts and build.asked < 2:
                    build.asked += 1
                    build.root.request_preempt()
                    assert self.preempt_requested()
                    self.service_preempt()
                    return "preempted"
                return "next"

        return State()

    def names(self, leaf):
        return {"x": leaf.reads, "y": leaf.writes}

    def part(self, part, path):
        build = {Leaf: self.leaf, Machine: self.machine, Loop: self.loop, Chain: self.chain}
        return {**build, Both: self.both}[type(part)](part, path)

    def machine(self, machine, path):
        sm = self.library.StateMachine(
            ["next", "again", "preempted", "other"], list(machine.keys), list(machine.keys)
        )
        self.container(sm, path)
        self.fill(sm)
        labels = [f"S{i}" for i in range(len(machine.children))]
        with sm:
            for i, child in enumerate(machine.children):
                state = self.part(child.part, f"{path}/{labels[i]}")
                transitions = {"again": labels[max(0, i - child.back)]}
                if not isinstance(child.part, Leaf):
                    transitions = {}
                if isinstance(child.part, Both):
                    transitions = {"won": labels[-1] if i + 1 < len(labels) else "other"}
                    transitions["lost"] = "next"
                if child.forward is not None and i + child.forward < len(labels):
                    transitions["next"] = labels[i + child.forward]
                elif not child.implicit:
                    transitions["next"] = "next"
                is_leaf = isinstance(child.part, Leaf)
                names = self.names(child.part) if is_leaf else {}
                constants = {}
                if is_leaf and child.part.constant is not None:
                    del names["x"]
                    constants = {"constants": {"x": child.part.constant}}
                if constants and self.library is smach:  # not in this release of it
                    sm.userdata[f"{labels[i]}.x"] = child.part.constant
                    names["x"] = f"{labels[i]}.x"
                    constants = {}
                self.library.StateMachine.add(
                    labels[i], state, transitions, remapping=names, **constants
                )
            if machine.start < len(labels):
                sm.set_initial_state([labels[machine.start]], self.library.UserData())
        return sm

    def loop(self, loop, path):
        made = {
            "list": list(range(loop.items)),
            "range": range(loop.items),
            "callable": lambda: list(range(loop.items)),
            "generator": lambda: (i for i in range(loop.items)),
        }[loop.kind]
        it = self.library.Iterator(
            ["next", "preempted", "other"], ["k0"], ["k0"], made, "item", "next"
        )
        self.container(it, path, order=True)
        self.fill(it)
        it.userdata.x = 1
        leaf = self.leaf(loop.leaf, f"{path}/EACH", extra=("item",))
        with it:
            self.library.Iterator.set_contained_state(
                "EACH",
                leaf,
                loop_outcomes=["again"],
                final_outcome_map={"next": "other"} if loop.final else {},
            )
        return it

    def chain(self, chain, path):
        sq = self.library.Sequence(["next", "again", "preempted"], "next", ["k1"], ["k1"])
        self.container(sq, path)
        self.fill(sq)
        with sq:
            for i, leaf in enumerate(chain.leaves):
                self.library.Sequence.add(
                    f"Q{i}", self.leaf(leaf, f"{path}/Q{i}"), remapping=self.names(leaf)
                )
        return sq

    def both(self, both, path):
        rules = {}
        for index, outcome in both.rules:
            if index < len(both.leaves):
                rules[outcome] = {f"P{index}": "next"}

        def decide(outcomes):
            self.log.append(("outcomes", path, dict(sorted(outcomes.items()))))
            return "won" if len(outcomes) > 2 else None

        cc = self.library.Concurrence(
            ["next", "won", "lost", "preempted"],
            "next",
            outcome_map=rules,
            outcome_cb=decide if both.callback else None,
        )
        self.container(cc, path, order=False)
        self.fill(cc)
        with cc:
            for i, leaf in enumerate(both.leaves):
                names = {"x": f"in{i}", "y": f"out{i}"}
                cc.userdata[f"in{i}"] = i
                self.library.Concurrence.add(
                    f"P{i}", self.leaf(leaf, f"{path}/P{i}"), remapping=names
                )
        return cc

    def fill(self, container):
        for number, key in enumerate(KEYS):
            container.userdata[key] = number

    def run(self, machine, runs=2):
        self.root = self.machine(machine, "")
        # Not without argument: there all machines of SMACH share one UserData.
        outcomes = [self.root.execute(self.library.UserData()) for _ in range(runs)]
        data = {k: self.root.userdata[k] for k in KEYS}
        return outcomes, self.log, data


def canonical(log):
    """Smooth out what differs on purpose, and what threads decide."""
    plain = []
    for kind, path, what in log:
        if kind == "end":
            labels, outcome = what[0], what[1]
            labels = [labels] if isinstance(labels, str) else sorted(labels)
            plain.append((kind, path, labels, outcome))
        elif kind == "start":
            plain.append((kind, path, sorted(what[0])))
        else:
            plain.append((kind, path, what))
    return plain


def parallel_order(log):
    """Bring the states of each concurrence, which run at once, into one order."""
    ordered, block = [], []
    for entry in log:
        if entry[0] == "run" and "/P" in entry[1]:
            block.append(entry)
            continue
        ordered += sorted(block)
        block = []
        ordered.append(entry)
    return ordered + sorted(block)


@pytest.fixture(autouse=True, scope="module")
def quiet():
    smach.set_loggers(*[lambda message: None] * 4)


def examples(number):
    return settings(
        max_examples=number,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        database=None,
        print_blob=False,
    )


def compare_sequential(machine):
    theirs = Build(smach).run(machine, runs=1)
    ours = Build(smachpy).run(machine, runs=1)
    assert ours[0] == theirs[0]
    assert canonical(ours[1]) == canonical(theirs[1])
    assert ours[2] == theirs[2]


@examples(150)
@given(sequential)
def test_sequential_machines_behave_as_in_smach(machine):
    compare_sequential(machine)


@pytest.mark.slow
@pytest.mark.timeout(900)
@examples(MACHINES)
@given(sequential)
def test_many_sequential_machines_behave_as_in_smach(machine):
    compare_sequential(machine)


@examples(40)
@given(parallel)
def test_parallel_machines_behave_as_in_smach(machine):
    theirs = Build(smach).run(machine, runs=1)
    ours = Build(smachpy).run(machine, runs=1)
    assert ours[0] == theirs[0]
    assert parallel_order(canonical(ours[1])) == parallel_order(canonical(theirs[1]))
    assert ours[2] == theirs[2]
