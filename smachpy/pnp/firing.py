"""What fires next, as a table that fills itself; no threads, time or I/O.

One step of PNP: the guards of all transitions that have their tokens are read on the marking before
any firing; then those whose guards hold fire one after the other, in the order of the document,
each at most once and only if it still has its tokens.
"""

from __future__ import annotations

from functools import partial
from operator import eq
from typing import TYPE_CHECKING, NamedTuple

from smachpy.outcome_classes import is_good
from smachpy.pnp.conditions import Condition
from smachpy.pnp.labels import BEGINS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Container, Mapping

    from smachpy.pnp.net import Marking
    from smachpy.pnp.plan import Plan

ACTION_FAILED = "action_failed"
"""The name that rules of PNP use for the failure of the action that runs."""


class Asks(NamedTuple):
    """What a name in a guard asks of an action.

    Attributes:
        label: The action's label.
        holds: Called with its outcome; None while it has not ended.
    """

    label: str
    holds: Callable[[str | None], bool]


def _finished(outcome: str | None) -> bool:
    return outcome is not None and is_good(outcome)


def _failed(outcome: str | None) -> bool:
    return outcome is not None and not is_good(outcome)


def _ended(outcome: str | None) -> bool:
    return outcome is not None


_OF_ACTION: Mapping[str, Callable[[str | None], bool]] = {
    "finished": _finished,
    "failed": _failed,
    "ended": _ended,
}


class Jump(NamedTuple):
    """What one step does.

    Attributes:
        fired: Transitions, in their order.
        calls: Pairs (label, True: it begins, False: it ends), in their order.
        moment: What follows.
        ends: Labels of the actions that end, when none runs.
        begins: Labels of those that begin, likewise.
    """

    fired: tuple[int, ...]
    calls: tuple[tuple[str, bool], ...]
    moment: Moment
    ends: tuple[str, ...]
    begins: tuple[str, ...]


def called(
    calls: Collection[tuple[str, bool]], running: Container[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the labels of the actions that end, and then of those that begin."""
    ends: list[str] = []
    begins: list[str] = []
    for label, begin in calls:
        if not begin:
            ends.append(label)
            if label in begins:
                begins.remove(label)
        elif (label not in running or label in ends) and label not in begins:
            begins.append(label)
    return tuple(ends), tuple(begins)


class Moment:
    """A marking, as a run sees it.

    Attributes:
        marking: The marking.
        end: Outcome of the plan here: "goal", "fail", or None.
        candidates: Transitions that have their tokens.
        guards: Their guards.
        free: What happens, when it needs no guard and is known already; None else.
        only: The one action that all guards ask about, if they ask nothing else: nothing can
            happen before it ends.
        asks_world: Names that the guards ask the world for.
        jumps: The table: what the guards say -> what happens, None for nothing; with `only` the
            outcome of that action -> what happens.
    """

    __slots__ = ("asks_world", "candidates", "end", "free", "guards", "jumps", "marking", "only")

    def __init__(self, table: Table, marking: Marking) -> None:
        plan = table.plan
        self.marking = marking
        self.end = "goal" if plan.is_goal(marking) else "fail" if plan.is_fail(marking) else None
        self.candidates = () if self.end else tuple(plan.net.enabled(marking))
        self.guards = tuple(table.guards[t] for t in self.candidates)
        names = [name for guard in self.guards if guard is not None for name in guard.atoms()]
        self.asks_world = tuple(dict.fromkeys(n for n in names if n not in table.asks))
        labels = {table.asks[name].label for name in names if name in table.asks}
        self.only = None
        if len(labels) == 1 and not self.asks_world and all(self.guards):
            self.only = next(iter(labels))
        self.jumps: dict[object, Jump | None] = {}
        self.free: Jump | None = None


class Table:
    """The moments of a plan, each made when it is first reached.

    Args:
        plan: The plan.
        labels: Name of an executable -> label of its state.
        outcomes: Label -> outcomes of its state.
        known: Names that the world gives; any other one that an action beside the transition has
            as an outcome asks for that.
    """

    def __init__(
        self,
        plan: Plan,
        labels: Mapping[str, str],
        outcomes: Mapping[str, Collection[str]],
        known: Callable[[str], bool],
    ) -> None:
        self.plan = plan
        self.asks: dict[str, Asks] = {}
        self._labels = labels
        self._moments: dict[Marking, Moment] = {}
        place_action = {p: name for name, e in plan.executables.items() for p in e.places}
        self.guards: list[Condition | None] = []
        for number, guard in enumerate(plan.guards):
            beside = [place_action[p] for p, _ in plan.net.inputs[number] if p in place_action]
            beside += [name for name, function in plan.calls[number] if function not in BEGINS]
            own = {labels[name]: outcomes[labels[name]] for name in beside}
            self.guards.append(None if guard is None else self._bound(guard, own, known))

    def _bound(
        self,
        guard: Condition,
        beside: Mapping[str, Collection[str]],
        known: Callable[[str], bool],
    ) -> Condition:
        """Return a guard whose names say what they ask."""
        if guard.operator != "atom":
            parts = tuple(self._bound(part, beside, known) for part in guard.parts)
            return Condition(guard.operator, "", parts)
        name = guard.name
        if "." in name:
            action, _, what = name.rpartition(".")
            label = self._labels.get(action)
            if label is not None:
                self.asks[name] = Asks(label, _OF_ACTION[what])
            return guard
        if known(name):
            return guard
        for label, outcomes in beside.items():
            if name in outcomes:
                bound = f"{label} ended with {name}"
                self.asks[bound] = Asks(label, partial(eq, name))
                return Condition("atom", bound)
        if name == ACTION_FAILED and beside:
            label = next(iter(beside))
            bound = f"{label}.failed"
            self.asks[bound] = Asks(label, _failed)
            return Condition("atom", bound)
        return guard

    def moment(self, marking: Marking) -> Moment:
        """Return the moment of a marking."""
        found = self._moments.get(marking)
        if found is None:
            found = self._moments[marking] = Moment(self, marking)
        return found

    def jump(self, moment: Moment, key: object, true: Collection[int]) -> Jump | None:
        """Return what happens when the guards of the transitions `true` hold; kept under `key`."""
        moment.jumps[key] = found = self._jump(moment, true)
        return found

    def jump_without_begins(self, moment: Moment, true: Collection[int]) -> Jump | None:
        """Return what happens when nothing more may begin."""
        calls = self.plan.calls
        return self._jump(moment, [t for t in true if not any(f in BEGINS for _, f in calls[t])])

    def forced(self, moment: Moment, transition: int) -> Jump:
        """Return what happens when a transition that has its tokens fires, whatever its guard."""
        jump = self._jump(moment, [transition])
        assert jump is not None
        return jump

    def _jump(self, moment: Moment, true: Collection[int]) -> Jump | None:
        plan = self.plan
        marking = moment.marking
        fired: list[int] = []
        for transition in true:
            if not fired or plan.net.has_tokens(marking, transition):
                marking = plan.net.fire(marking, transition)
                fired.append(transition)
        if not fired:
            return None
        calls = tuple(
            (self._labels[name], function in BEGINS)
            for transition in fired
            for name, function in plan.calls[transition]
        )
        return Jump(tuple(fired), calls, self._made(marking, moment), *called(calls, ()))

    def _made(self, marking: Marking, moment: Moment) -> Moment:
        return moment if marking == moment.marking else self.moment(marking)
