"""The conditions of FlexBE's ConcurrencyContainer as the rules of a concurrence."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


class Conditions:
    """The argument `conditions`: [(outcome, [(label, outcome of it), ...]), ...].

    In FlexBE the container ends as soon as one of them holds, with the first one of the list.

    Args:
        given: It, as plain data.

    Attributes:
        rules: The same as `outcome_map` of a mission file.
        notes: What could not be kept.
        problems: What is wrong.
    """

    def __init__(self, given: Any) -> None:
        self.rules: dict[str, Any] = {}
        self.notes: list[str] = []
        self.problems: list[str] = []
        self._alone: dict[str, set[str]] = {}
        found: dict[str, list[dict[str, str]]] = {}
        try:
            for outcome, wanted in given:
                found.setdefault(str(outcome), []).append({str(k): str(v) for k, v in wanted})
        except (TypeError, ValueError):
            expected = "expected [(outcome, [(label, outcome), ...]), ...]"
            self.problems.append(f"conditions: got something else; {expected}.")
            return
        for outcome, cases in reversed(found.items()):  # here the last rule that holds wins
            self._take(outcome, cases)

    def _take(self, outcome: str, cases: Sequence[dict[str, str]]) -> None:
        single = [pair for case in cases if len(case) == 1 for pair in case.items()]
        for label, wanted in single:
            self._alone.setdefault(label, set()).add(wanted)
        self.rules[outcome] = cases[0]
        if len(single) == len(cases) > 1:
            of: dict[str, list[str]] = {}
            for label, wanted in single:
                of.setdefault(label, []).append(wanted)
            self.rules[outcome] = {"any": of}
        elif len(cases) > 1:
            self.notes.append(f"all but the first condition of {outcome!r}")

    def stops(self, ends: Mapping[str, Sequence[str]]) -> tuple[list[str], list[str]]:
        """Return the states whose end stops the others, and notes.

        Args:
            ends: The outcomes of all states, by label.
        """
        stops, notes = [], []
        for label, outcomes in ends.items():
            alone = self._alone.get(label, set())
            if outcomes and alone.issuperset(outcomes):
                stops.append(label)
                continue
            notes += [
                f"the stop of the other states when {label} ends with {outcome!r}"
                for outcome in sorted(alone)
            ]
        return stops, notes
