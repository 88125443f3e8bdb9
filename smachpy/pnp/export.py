"""State machines with concurrences as Petri net plans."""

from __future__ import annotations

import itertools
import math
import re
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from smachpy.base.problems import Problems
from smachpy.events.introspection import describe
from smachpy.events.outcome_classes import is_good
from smachpy.machines.concurrence import Concurrence
from smachpy.machines.container import Container
from smachpy.machines.rules import decide
from smachpy.machines.state_machine import StateMachine
from smachpy.pnp.conditions import ConditionError, parse
from smachpy.pnp.container import PetriNetPlan
from smachpy.pnp.net import Arc, Net, Place, Transition
from smachpy.pnp.reach import explore

if TYPE_CHECKING:
    from collections.abc import Collection

    from smachpy.events.introspection import StateRecord
    from smachpy.machines.state import State

PREEMPTED: Final = "preempted"
MAX_COMBINATIONS: Final = 1000
"""Most combinations of outcomes of a concurrence's children; each becomes a transition or more."""


class StopPlaces(NamedTuple):
    """The places by which a child of a concurrence is preempted; one of the two has a token.

    Attributes:
        place: Has the token once the child is asked to stop.
        runs_on: Has the token before, and again once the child has serviced the preempt.
        deep: Whether this is a machine inside a machine of the child.
    """

    place: str
    runs_on: str
    deep: bool = False


class Exported(NamedTuple):
    """A machine as a net.

    Attributes:
        net: The net.
        states: Name of an action in the net -> path of its state.
    """

    net: Net
    states: dict[str, str]


def export_net(machine: Container) -> Exported:
    """Return a machine as a net; for a plan, its own net.

    State machines and concurrences are opened at any depth. Any other state, including an iterator,
    is an action, named by the labels of its path joined with '_'; its outcomes are conditions at
    its ends. Failures and preempts among the machine's outcomes (`smachpy.events.outcome_classes`)
    lead to the failed plan, the others to the goal. A net has no userdata, remappings or options.

    The callbacks with which a concurrence decides are called once for each combination of outcomes
    that can occur, and the net gets their answers. If a callback depends on more than its argument,
    the net has the answer of this moment.

    Raises:
        InconsistentMachineError: the machine is not consistent.
        InvalidStateError: a part of it cannot be written as a net; all problems at once.
    """
    if isinstance(machine, PetriNetPlan):
        return Exported(machine._smachpy.net_plan.net, {})
    machine.check_consistency()
    record = describe(machine)
    writer = _NetWriter(record)
    writer.write(machine, record)
    return writer.exported()


class _NetWriter:
    def __init__(self, record: StateRecord) -> None:
        self._name = record.label
        self._root = record.path
        self._places: list[Place] = []
        self._transitions: list[Transition] = []
        self._arcs: list[Arc] = []
        self._states: dict[str, str] = {}
        self._answers: set[str] = set()  # transitions for the answers of callbacks
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
        places, transitions, arcs = tuple(self._places), self._transitions, self._arcs
        net = Net(self._name, places, tuple(transitions), tuple(arcs))
        # Callbacks were called for all combinations; those that cannot occur are removed again.
        if self._answers:
            reachable = explore(net)
            gone = {
                each.id
                for number, each in enumerate(transitions)
                if reachable.complete and each.id in self._answers
                if number not in reachable.fired
            }
            transitions = [each for each in transitions if each.id not in gone]
            arcs = [arc for arc in arcs if not {arc.source, arc.target} & gone]
            # Places without arcs belonged to removed transitions.
            used = {end for arc in arcs for end in (arc.source, arc.target)}
            places = tuple(place for place in places if place.id in used)
            net = Net(self._name, places, tuple(transitions), tuple(arcs))
        return Exported(net, self._states)

    def _place(self, name: str, tokens: int = 0) -> str:
        identity = f"p{len(self._places)}"
        self._places.append(Place(identity, name, tokens))
        return identity

    def _fire(self, name: str, inputs: list[str], outputs: list[str]) -> str:
        identity = f"t{len(self._transitions)}"
        self._transitions.append(Transition(identity, name))
        self._arcs += [Arc(place, identity) for place in inputs]
        self._arcs += [Arc(identity, place) for place in outputs]
        return identity

    def _state(
        self, state: State, record: StateRecord, begin: str, stop: StopPlaces | None = None
    ) -> dict[str, str]:
        """Add a state that begins at a place; return outcome -> place of this end."""
        # A subclass that overrides `execute` may do anything: it is an action, not opened.
        if type(state).execute is Container.execute and "execute" not in vars(state):
            if isinstance(state, (Concurrence, StateMachine)):
                self._refuse_what_nets_lack(record)
            if isinstance(state, Concurrence):
                if stop is not None:
                    self._problems.add(
                        f"{record.path}: concurrence: got one that another concurrence preempts; "
                        "expected machines and states there."
                    )
                return self._concurrence(state, record, begin)
            if isinstance(state, StateMachine):
                return self._machine(state, record, begin, stop)
        return self._action(state, record, begin, stop)

    def _refuse_what_nets_lack(self, record: StateRecord) -> None:
        if record.cleanup:
            self._problems.add(
                f"{record.path}: clean-up: got {record.cleanup!r}; expected none, as a net runs "
                "nothing at every end. Try a clean-up of the plan that the net becomes."
            )
        for guard in dict.fromkeys(edge.guard for edge in record.transitions if edge.guard):
            self._problems.add(
                f"{record.path}: condition: got {guard!r}; expected transitions without "
                "conditions. Try a state that has an outcome for each case."
            )

    def _action(
        self, state: State, record: StateRecord, begin: str, stop: StopPlaces | None
    ) -> dict[str, str]:
        path = record.path.removeprefix(self._root).strip("/") or record.label
        # Characters that labels do not allow become '_'; then two names may be the same.
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
        if stop is not None and isinstance(state, Container) and PREEMPTED not in ends:
            ends[PREEMPTED] = self._place(_plain(f"{name} {PREEMPTED}"))  # declared or not
        if stop is not None and PREEMPTED in ends:
            self._fire(f"{name}.interrupt", [place, stop.place], [ends[PREEMPTED], stop.runs_on])
        return ends

    def _machine(
        self, machine: StateMachine, record: StateRecord, begin: str, stop: StopPlaces | None
    ) -> dict[str, str]:
        words = record.path.removeprefix(self._root).strip("/").replace("/", " ")
        entries = {c.label: self._place(_plain(f"{words} {c.label}")) for c in record.children}
        outs = {o: self._place(_plain(f"{words} {o}")) for o in record.outcomes}
        inner = None
        if stop is not None:
            inner = stop._replace(deep=True)
            if PREEMPTED not in outs:  # it ends so, declared or not
                outs[PREEMPTED] = self._place(_plain(f"{words} {PREEMPTED}"))
            # Added before the transitions that begin the children: the first in the file wins, so
            # a machine that is asked to stop begins no other child.
            for entry in entries.values():
                self._fire("stopped", [entry, stop.place], [outs[PREEMPTED], stop.runs_on])
        for label in record.initial:
            self._fire("", [begin], [entries[label]])
        children = machine.get_children()
        for child in record.children:
            ends = self._state(children[child.label], child, entries[child.label], inner)
            for edge in record.transitions:
                # A concurrence has places only for outcomes that occur.
                if edge.source != child.label or edge.outcome not in ends:
                    continue
                target = outs if edge.target_is_outcome else entries
                self._fire(_plain(edge.outcome), [ends.pop(edge.outcome)], [target[edge.target]])
                if stop and stop.deep and edge.outcome == PREEMPTED and target is entries:
                    self._problems.add(
                        f"{child.path}: preempted: got {edge.target!r}; expected an outcome of its "
                        "machine, as that is in a machine that a concurrence preempts."
                    )
            if PREEMPTED in ends:  # without a transition: the machine ends with it, too
                self._fire(PREEMPTED, [ends[PREEMPTED]], [outs[PREEMPTED]])
        return outs

    def _concurrence(self, state: Concurrence, record: StateRecord, begin: str) -> dict[str, str]:
        data = state._smachpy
        children = state.get_children()
        preempts = data.child_termination_cb is not None
        begins = [self._place(_plain(f"{c.label} begins")) for c in record.children]
        asks: dict[str, tuple[str, str]] = {}
        stops: list[StopPlaces | None] = [None] * len(begins)
        if preempts:
            asks = {
                c.label: (
                    self._place(_plain(f"{c.label} runs on")),
                    self._place(_plain(f"{c.label} is to stop")),
                )
                for c in record.children
            }
            stops = [StopPlaces(stop, runs_on) for runs_on, stop in asks.values()]
        self._fire("fork", [begin], [*begins, *(runs_on for runs_on, _ in asks.values())])
        ends = {
            child.label: self._state(children[child.label], child, place, stop)
            for child, place, stop in zip(record.children, begins, stops, strict=True)
        }
        # With preempts a child may also run on, or be asked to stop, when another one has ended.
        count = math.prod(2 + len(each) if preempts else len(each) for each in ends.values())
        if count > MAX_COMBINATIONS:
            self._problems.add(
                f"{record.path}: concurrence: got {count} combinations of outcomes; expected at "
                f"most {MAX_COMBINATIONS}."
            )
            return {}
        try:
            if preempts:
                ends = self._preempting(state, ends, asks)
            return self._joined(state, record, ends)
        except Exception as error:  # noqa: BLE001  the user's callback
            self._problems.add(
                f"{record.path}: concurrence: a callback that decides raised "
                f"{type(error).__name__}: {error}; expected an answer to each combination of "
                "outcomes."
            )
            return {}

    def _joined(
        self, state: Concurrence, record: StateRecord, ends: dict[str, dict[str, str]]
    ) -> dict[str, str]:
        """Add a join for each combination of the children's outcomes."""
        data = state._smachpy
        outs: dict[str, str] = {}
        for chosen in itertools.product(*ends.values()):
            outcomes: dict[str, str | None] = dict(zip(ends, chosen, strict=True))
            # As in `Concurrence`: the callback, else the rules, else the default outcome.
            answer = None if data.outcome_cb is None else data.outcome_cb(dict(outcomes))
            ruled = decide(data.rules, outcomes)
            outcome = answer or (data.default_outcome if ruled is None else ruled[0])
            if outcome not in record.outcomes:
                raise ValueError(f"outcome_cb returned {outcome!r}")
            if outcome not in outs:
                outs[outcome] = self._place(_plain(f"{record.label} {outcome}"))
            places = [each[one] for each, one in zip(ends.values(), chosen, strict=True)]
            joined = self._fire(_plain(f"join {' '.join(chosen)}"), places, [outs[outcome]])
            if data.child_termination_cb is not None:
                self._answers.add(joined)
        return outs

    def _preempting(
        self,
        state: Concurrence,
        ends: dict[str, dict[str, str]],
        asks: dict[str, tuple[str, str]],
    ) -> dict[str, dict[str, str]]:
        """Add the answers of `child_termination_cb` for each end of a child.

        Args:
            state: The concurrence.
            ends: Label -> outcome -> place of this end.
            asks: Label -> the place that has a token while the child runs on, and the one that has
                it when the child is asked to stop.

        Returns:
            As `ends`, with the places after the call of the callback.
        """
        ask = state._smachpy.child_termination_cb
        assert ask is not None
        done = {
            label: {o: self._place(_plain(f"{label} {o} seen")) for o in places}
            for label, places in ends.items()
        }
        for label, places in ends.items():
            others = [other for other in ends if other != label]
            # Each other child runs on (None), is asked to stop (True), or has an outcome (a text).
            known = [[None, True, *ends[other]] for other in others]
            for outcome, end in places.items():
                for stands in itertools.product(*known):
                    how = dict(zip(others, stands, strict=True))
                    outcomes = {
                        each: outcome if each == label else _outcome(how[each]) for each in ends
                    }
                    asked = _labels(ask(dict(outcomes)), ends)
                    before, after = [end], [done[label][outcome]]
                    for other, stand in how.items():
                        runs_on, stop = asks[other]
                        if stand is None:
                            before.append(runs_on)
                            after.append(stop if other in asked else runs_on)
                        else:
                            place = stop if stand is True else done[other][str(stand)]
                            before.append(place)
                            after.append(place)
                    # The child may have been asked to stop before, or not: its token is in one of
                    # the two places, and a transition takes it from there.
                    for own in asks[label]:
                        name = _plain(f"{label} {outcome}")
                        self._answers.add(self._fire(name, [*before, own], after))
        return done


def _outcome(stand: object) -> str | None:
    return stand if isinstance(stand, str) else None


def _labels(answer: Any, known: Collection[str]) -> set[str]:
    """Return the children that an answer of `child_termination_cb` preempts."""
    if answer is True or answer is False or answer is None:
        return set(known) if answer else set()
    labels = {answer} if isinstance(answer, str) else set(answer)
    if not labels <= set(known):
        raise ValueError(f"child_termination_cb returned {answer!r}")
    return labels


def _plain(text: str) -> str:
    """Return a text without the parts that have a meaning in labels: dots, brackets, "goal", ..."""
    words = re.sub(r"[.()\[\]]", "_", text).split()
    taken = {"goal", "fail", "start", "end", "interrupt", "interr", "resume", "res"}
    return " ".join(f"'{w}'" if w in taken or w.startswith(("goal", "fail")) else w for w in words)
