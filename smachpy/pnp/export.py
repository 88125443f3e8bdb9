"""State machines with concurrences as Petri net plans."""

from __future__ import annotations

import itertools
import re
from typing import TYPE_CHECKING, NamedTuple

from smachpy.introspection import describe
from smachpy.machines.concurrence import Concurrence
from smachpy.machines.container import Container
from smachpy.machines.problems import Problems
from smachpy.machines.rules import decide
from smachpy.machines.state_machine import StateMachine
from smachpy.outcome_classes import is_good
from smachpy.pnp.conditions import ConditionError, parse
from smachpy.pnp.container import PetriNetPlan
from smachpy.pnp.net import Arc, Net, Place, Transition

if TYPE_CHECKING:
    from smachpy.introspection import StateRecord
    from smachpy.machines.state import State

MOST_COMBINATIONS = 1000
"""Of the outcomes of a concurrence's children."""


class Exported(NamedTuple):
    """A machine as a net.

    Attributes:
        net: The net.
        states: Name of an action in it -> path of its state.
    """

    net: Net
    states: dict[str, str]


def export_net(machine: Container) -> Exported:
    """Return a machine as a net; a plan, as its own.

    State machines and concurrences are opened, at any depth. Any other state, an iterator too, is
    an action, named by the labels down to it with '_' between them; its outcomes are conditions at
    its ends. Outcomes of the machine that sound good lead to the goal, the others to the failed
    plan. Userdata, remappings and options are no part of a net.

    Raises:
        InconsistentMachineError: the machine does not hold together.
        InvalidStateError: something in it cannot be written as a net; all problems at once.
    """
    if isinstance(machine, PetriNetPlan):
        return Exported(machine._smachpy.net_plan.net, {})
    machine.check_consistency()
    record = describe(machine)
    writer = _Writer(record)
    writer.write(machine, record)
    return writer.exported()


class _Writer:
    def __init__(self, record: StateRecord) -> None:
        self._name = record.label
        self._root = record.path
        self._places: list[Place] = []
        self._transitions: list[Transition] = []
        self._arcs: list[Arc] = []
        self._states: dict[str, str] = {}
        self._problems = Problems(f"export of {record.path}")

    def write(self, machine: State, record: StateRecord) -> None:
        begin = self._place("init", 1)
        ends = self._state(machine, record, begin)
        places: dict[str, str] = {}
        for outcome, end in ends.items():
            kind = "goal" if is_good(outcome) else "fail"
            if kind not in places:
                places[kind] = self._place(kind)
            self._fire(_plain(outcome), [end], [places[kind]])

    def exported(self) -> Exported:
        self._problems.raise_all()
        return Exported(
            Net(self._name, tuple(self._places), tuple(self._transitions), tuple(self._arcs)),
            self._states,
        )

    def _place(self, name: str, tokens: int = 0) -> str:
        identity = f"p{len(self._places)}"
        self._places.append(Place(identity, name, tokens))
        return identity

    def _fire(self, name: str, inputs: list[str], outputs: list[str]) -> None:
        identity = f"t{len(self._transitions)}"
        self._transitions.append(Transition(identity, name))
        self._arcs += [Arc(place, identity) for place in inputs]
        self._arcs += [Arc(identity, place) for place in outputs]

    def _state(self, state: State, record: StateRecord, begin: str) -> dict[str, str]:
        """Add a state that begins at a place; return outcome -> place where it has ended so."""
        if type(state).execute is Container.execute and "execute" not in vars(state):
            if isinstance(state, Concurrence):
                return self._concurrence(state, record, begin)
            if isinstance(state, StateMachine):
                return self._machine(state, record, begin)
        return self._action(record, begin)

    def _action(self, record: StateRecord, begin: str) -> dict[str, str]:
        path = record.path.removeprefix(self._root).strip("/") or record.label
        name = re.sub(r"[^\w@#<>+^{},-]", "_", path)
        while name in self._states or name in {"goal", "fail"}:
            name += "_"
        self._states[name] = record.path
        place = self._place(f"{name}.exec")
        self._fire(f"{name}.start", [begin], [place])
        ends = {}
        for outcome in record.outcomes:
            try:
                fits = parse(outcome).operator == "atom" and "." not in outcome
            except ConditionError:
                fits = False
            if not fits:
                self._problems.add(
                    f"{record.path}: outcome: got {outcome!r}; expected a name that can be a "
                    "condition: letters, digits, '_' and '-'."
                )
            ends[outcome] = self._place(_plain(f"{name} {outcome}"))
            self._fire(f"{name}.end [{outcome}]", [place], [ends[outcome]])
        return ends

    def _machine(self, machine: StateMachine, record: StateRecord, begin: str) -> dict[str, str]:
        words = record.path.removeprefix(self._root).strip("/").replace("/", " ")
        entries = {c.label: self._place(_plain(f"{words} {c.label}")) for c in record.children}
        outs = {o: self._place(_plain(f"{words} {o}")) for o in record.outcomes}
        for label in record.initial:
            self._fire("", [begin], [entries[label]])
        children = machine.get_children()
        for child in record.children:
            ends = self._state(children[child.label], child, entries[child.label])
            for edge in record.transitions:
                if edge.source == child.label and edge.outcome in ends:
                    target = outs if edge.target_is_outcome else entries
                    self._fire(_plain(edge.outcome), [ends[edge.outcome]], [target[edge.target]])
        return outs

    def _concurrence(self, state: Concurrence, record: StateRecord, begin: str) -> dict[str, str]:
        data = state._smachpy
        if data.outcome_cb is not None or data.child_termination_cb is not None:
            self._problems.add(
                f"{record.path}: concurrence: got a callback that decides; expected an outcome_map "
                "alone: a net holds no Python."
            )
            return {}
        begins = [self._place(_plain(f"{c.label} begins")) for c in record.children]
        self._fire("fork", [begin], begins)
        children = state.get_children()
        ends = [
            self._state(children[child.label], child, place)
            for child, place in zip(record.children, begins, strict=True)
        ]
        count = 1
        for each in ends:
            count *= len(each)
        if count > MOST_COMBINATIONS:
            self._problems.add(
                f"{record.path}: concurrence: got {count} combinations of outcomes; expected at "
                f"most {MOST_COMBINATIONS}."
            )
            return {}
        outs: dict[str, str] = {}
        labels = [child.label for child in record.children]
        for chosen in itertools.product(*ends):
            ruled = decide(data.rules, dict(zip(labels, chosen, strict=True)))
            outcome = data.default_outcome if ruled is None else ruled[0]
            if outcome not in outs:
                outs[outcome] = self._place(_plain(f"{record.label} {outcome}"))
            places = [each[one] for each, one in zip(ends, chosen, strict=True)]
            self._fire(_plain(f"join {' '.join(chosen)}"), places, [outs[outcome]])
        return outs


def _plain(text: str) -> str:
    """Return a text that means nothing as a label: no dots, no brackets, no goal."""
    words = re.sub(r"[.()\[\]]", "_", text).split()
    taken = {"goal", "fail", "start", "end", "interrupt", "interr", "resume", "res"}
    return " ".join(f"'{w}'" if w in taken or w.startswith(("goal", "fail")) else w for w in words)
