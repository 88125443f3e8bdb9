"""A table of what fires at each marking, filled as markings are reached; no threads, time or I/O.

One step of PNP: first the guards of all transitions that have their tokens are evaluated; then the
transitions whose guards are true fire one after the other, in the order of the document, each at
most once and only if it still has its tokens.
"""

from __future__ import annotations

from functools import partial
from operator import eq
from typing import TYPE_CHECKING, NamedTuple

from smachpy.events.outcome_classes import is_good
from smachpy.pnp.conditions import Condition
from smachpy.pnp.labels import BEGINS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Container, Mapping

    from smachpy.pnp.net import Marking
    from smachpy.pnp.plan import Plan

ACTION_FAILED = "action_failed"
"""The name for the failure of the running action in rules of PNP."""


class OutcomeTest(NamedTuple):
    """A name in a guard that tests the outcome of an action.

    Attributes:
        label: The action's label.
        holds: Called with its outcome, None while it has not ended; returns the name's value.
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


class Firing(NamedTuple):
    """The transitions that fire in one step, and their effect.

    Attributes:
        fired: The transitions, in their order.
        calls: Pairs (label, True: it begins, False: it ends), in their order.
        moment: The moment after it.
        ends: Labels of the actions that end, if none is running before.
        begins: Labels of the actions that begin, if none is running before.
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
    # Several transitions of one step may call the same action: an end cancels the begin before it,
    # and a running action begins again only if it ends before.
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
    """A marking, with all that a run needs to know about it.

    Attributes:
        marking: The marking.
        end: The outcome with which the plan ends here, "goal" or "fail", or None.
        candidates: Transitions that have their tokens.
        guards: Their guards.
        free: The firing, if no candidate has a guard and it has been computed; otherwise None.
        only: The action that all guards test, if they test nothing else: nothing can fire before it
            ends.
        externals: Names in the guards that do not test actions.
        firings: The table: values of the guards -> firing, or None if nothing fires. If `only` is
            set: outcome of that action -> firing.
    """

    __slots__ = ("candidates", "end", "externals", "firings", "free", "guards", "marking", "only")

    def __init__(self, table: Table, marking: Marking) -> None:
        plan = table.plan
        self.marking = marking
        self.end = "goal" if plan.is_goal(marking) else "fail" if plan.is_fail(marking) else None
        self.candidates = () if self.end else tuple(plan.net.enabled(marking))
        self.guards = tuple(table.guards[t] for t in self.candidates)
        names = [name for guard in self.guards if guard is not None for name in guard.atoms()]
        self.externals = tuple(dict.fromkeys(n for n in names if n not in table.outcome_tests))
        labels = {table.outcome_tests[name].label for name in names if name in table.outcome_tests}
        self.only = None
        # All must have a guard: a transition without one fires at once.
        if len(labels) == 1 and not self.externals and all(self.guards):
            self.only = next(iter(labels))
        self.firings: dict[object, Firing | None] = {}
        self.free: Firing | None = None


class Table:
    """The moments of a plan, each made when it is first reached.

    Args:
        plan: The plan.
        labels: Name of an executable -> label of its state.
        outcomes: Label -> outcomes of its state.
        known: Returns whether a condition is registered for a name. Any other name that is an
            outcome of an action beside the transition tests that outcome.

    Attributes:
        plan: The plan.
        outcome_tests: Name in a guard -> its test, for names that test outcomes.
        guards: For each transition: its guard, with names of actions written out, or None.
    """

    def __init__(
        self,
        plan: Plan,
        labels: Mapping[str, str],
        outcomes: Mapping[str, Collection[str]],
        known: Callable[[str], bool],
    ) -> None:
        self.plan = plan
        self.outcome_tests: dict[str, OutcomeTest] = {}
        self._labels = labels
        self._moments: dict[Marking, Moment] = {}
        place_action = {p: name for name, e in plan.executables.items() for p in e.places}
        self.guards: list[Condition | None] = []
        for number, guard in enumerate(plan.guards):
            # The actions whose outcomes the guard may name: those of the exec places in front of
            # the transition, and those that its label ends.
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
        """Return a guard in which tests of outcomes have a unique name, and record the tests.

        The same name may be an outcome of different actions at different transitions.
        """
        if guard.operator != "atom":
            parts = tuple(self._bound(part, beside, known) for part in guard.parts)
            return Condition(guard.operator, "", parts)
        name = guard.name
        if "." in name:
            action, _, what = name.rpartition(".")
            label = self._labels.get(action)
            if label is not None:
                self.outcome_tests[name] = OutcomeTest(label, _OF_ACTION[what])
            return guard
        if known(name):  # a registered condition takes precedence over an outcome of this name
            return guard
        for label, outcomes in beside.items():
            if name in outcomes:
                bound = f"{label} ended with {name}"
                self.outcome_tests[bound] = OutcomeTest(label, partial(eq, name))
                return Condition("atom", bound)
        if name == ACTION_FAILED and beside:
            label = next(iter(beside))
            bound = f"{label}.failed"
            self.outcome_tests[bound] = OutcomeTest(label, _failed)
            return Condition("atom", bound)
        return guard

    def moment(self, marking: Marking) -> Moment:
        """Return the moment of a marking."""
        # A moment is created when its marking is first reached: a net may have too many of them.
        found = self._moments.get(marking)
        if found is None:
            found = self._moments[marking] = Moment(self, marking)
        return found

    def firing(self, moment: Moment, key: object, true: Collection[int]) -> Firing | None:
        """Return the firing if the guards of the transitions `true` hold; kept under `key`."""
        moment.firings[key] = found = self._make_firing(moment, true)
        return found

    def firing_without_begins(self, moment: Moment, true: Collection[int]) -> Firing | None:
        """Return the firing of the transitions `true` that begin no action."""
        calls = self.plan.calls
        return self._make_firing(
            moment, [t for t in true if not any(f in BEGINS for _, f in calls[t])]
        )

    def forced(self, moment: Moment, transition: int) -> Firing:
        """Return the firing of one transition that has its tokens, regardless of its guard."""
        firing = self._make_firing(moment, [transition])
        assert firing is not None
        return firing

    def _make_firing(self, moment: Moment, true: Collection[int]) -> Firing | None:
        plan = self.plan
        marking = moment.marking
        fired: list[int] = []
        for transition in true:
            # The first one has its tokens; it may have taken those of the others.
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
        return Firing(tuple(fired), calls, self.moment(marking), *called(calls, ()))
