"""The conditions of FlexBE's ConcurrencyContainer as the rules of a concurrence."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from smachpy.foreign.draft import Draft, Place


class Conditions:
    """The argument `conditions`: [(outcome, [(label, outcome of it), ...]), ...].

    In FlexBE the container ends as soon as one of them holds, with the first one of the list.

    Args:
        draft: Gets what could not be kept.
        place: Where the container is made.
        given: The conditions, as plain data.

    Attributes:
        rules: The same as `outcome_map` of a mission file.
    """

    def __init__(self, draft: Draft, place: Place, given: Any) -> None:
        self.rules: dict[str, Any] = {}
        self._draft, self._place = draft, place
        self._alone: dict[str, set[str]] = {}
        found: dict[str, list[dict[str, str]]] = {}
        try:
            for outcome, wanted in given:
                found.setdefault(str(outcome), []).append({str(k): str(v) for k, v in wanted})
        except (TypeError, ValueError):
            expected = "expected [(outcome, [(label, outcome), ...]), ...]"
            draft.problem(place, f"conditions: got something else; {expected}.")
            return
        for outcome, cases in reversed(found.items()):  # here the last rule that holds wins
            of: dict[str, list[str]] = {}
            for label, wanted in (
                pair for case in cases if len(case) == 1 for pair in case.items()
            ):
                self._alone.setdefault(label, set()).add(wanted)
                of.setdefault(label, []).append(wanted)
            are_single = all(len(case) == 1 for case in cases)
            self.rules[outcome] = {"any": of} if are_single and len(cases) > 1 else cases[0]
            if len(cases) > 1 and not are_single:
                draft.note(place, f"all but the first condition of {outcome!r}")

    def stops(self, ends: Mapping[str, Sequence[str]]) -> list[str]:
        """Return the states whose end stops the others.

        Args:
            ends: The outcomes of all states, by label.
        """
        stops = []
        for label, outcomes in ends.items():
            alone = self._alone.get(label, set())
            if outcomes and alone.issuperset(outcomes):
                stops.append(label)
                continue
            for outcome in sorted(alone):
                text = f"the stop of the other states when {label} ends with {outcome!r}"
                self._draft.note(self._place, text)
        return stops
