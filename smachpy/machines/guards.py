"""Conditions of transitions: `{"done": [when("battery < 0.3", "RECHARGE"), "NEXT"]}`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from smachpy.base.frozen import Frozen
from smachpy.base.functions import name_of, no_coroutine
from smachpy.base.problems import Problems, plain
from smachpy.engine.errors import raised
from smachpy.exceptions import InvalidUserCodeError, error_text
from smachpy.userdata.user_data import data_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actionlib_core.inputs.expression import Expression
    from smachpy.engine.frame import Frame

__all__ = ["Cases", "Target", "When", "when"]

EXPECTED = "when(CONDITION, TARGET), ..., and last the target if none holds"


class When(Frozen):
    """One case of a transition; made by `when`.

    Attributes:
        condition: The text of an expression, or a function of the userdata.
        target: Label of the next state, or outcome of the machine.
    """

    __slots__ = ("condition", "target", "_expression")  # noqa: RUF023  as the arguments

    condition: str | Callable[[Any], object]
    target: str
    _expression: Expression | None

    def __init__(
        self,
        condition: str | Callable[[Any], object],
        target: str,
        _expression: Expression | None = None,
    ) -> None:
        self._set(condition=condition, target=target, _expression=_expression)

    @property
    def text(self) -> str:
        """The condition in words: the expression, or the function's name."""
        return self.condition if isinstance(self.condition, str) else name_of(self.condition)

    @property
    def names(self) -> frozenset[str]:
        """The userdata keys that the expression asks for; empty for a function."""
        return frozenset() if self._expression is None else self._expression.names

    def holds(self, userdata: Any) -> bool:
        """Return whether the condition holds."""
        if self._expression is not None:
            return bool(self._expression(data_of(userdata)))
        assert not isinstance(self.condition, str)
        return bool(no_coroutine(self.condition(userdata)))


class Between:
    """A state between an outcome and its target, such as that of `smachpy.states.confirm`.

    Attributes:
        prefix: Its label is "<prefix>_<label>_<outcome>".
        state: The state.
        transitions: Its own.
    """

    def __init__(self, prefix: str, state: Any, transitions: Mapping[str, str]) -> None:
        self.prefix = prefix
        self.state = state
        self.transitions = transitions

    def __repr__(self) -> str:
        """Name what made it, as it is in errors about where it cannot stand."""
        return f"{self.prefix.lower()}({next(iter(self.transitions.values()))!r})"


Target: TypeAlias = "str | Between | Sequence[When | str | None] | None"
"""What an outcome leads to: a label or outcome, None, a state between, or cases of which the last
has no condition.
"""
Cases: TypeAlias = "tuple[When, ...]"


def when(condition: str | Callable[[Any], object], target: str) -> When:
    """Return a case of a transition: the outcome leads to `target` if `condition` holds.

    Args:
        condition: An expression over the userdata of the machine, such as "battery < 0.3 and not
            docked" (see docs/guards.md), or a function `condition(userdata)`.
        target: Label of the next state, or outcome of the machine.

    Raises:
        InvalidStateError: the expression cannot be parsed, or an argument has a wrong form.

    Threads: the condition is evaluated in the thread of the machine, after the state has ended.
    """
    from actionlib_core.inputs.expression import Expression, ExpressionError

    problems = Problems("when")
    expression = None
    if isinstance(condition, str):
        condition = plain(condition).strip()
        try:
            expression = Expression(condition)
        except ExpressionError as error:
            problems.add(f"condition: {error}")
    else:
        problems.function("condition", condition, "condition(userdata)", 1, optional=False)
    goal = problems.word("target", target)
    problems.raise_all()
    return When(condition, goal, expression)


def between(label: str, given: Any) -> tuple[Any, dict[str, Between]]:
    """Return the transitions of a child to the states between, and label -> each of these."""
    if not hasattr(given, "items"):
        return given, {}
    targets, found = dict(given), {}
    for outcome, target in targets.items():
        if isinstance(target, Between):
            targets[outcome] = name = f"{target.prefix}_{label}_{outcome}"
            found[name] = target
    return targets, found


def split(given: Any, problems: Problems) -> tuple[Any, dict[str, Cases]]:
    """Return transitions without their cases, and outcome -> cases of those that have some."""
    if not hasattr(given, "items"):
        return given, {}
    targets, guards = dict(given), {}
    for outcome, target in targets.items():
        if isinstance(target, str) or not isinstance(target, Sequence):
            continue
        *cases, last = target or [None, None]
        wrong = [case for case in cases if not isinstance(case, When)]
        if wrong or isinstance(last, When) or not cases:
            problems.add(f"transitions: got {outcome!r}: {target!r} in it; expected {EXPECTED}.")
            last = None
        elif isinstance(outcome, str):
            guards[plain(outcome)] = tuple(cases)
        targets[outcome] = last
    return targets, guards


class Choice:
    """The place of a target until its condition is known.

    Attributes:
        cases: Pairs of a case and where it leads: a step or an end.
        otherwise: Where it leads if none holds.
        userdata: The userdata of the machine.
    """

    final = False

    def __init__(self, cases: tuple[tuple[When, Any], ...], otherwise: Any, userdata: Any) -> None:
        self.cases = cases
        self.otherwise = otherwise
        self.userdata = userdata

    def decide(self, frame: Frame) -> Any:
        """Return the step or end to which the first case that holds leads.

        Raises:
            InvalidUserCodeError: a condition cannot be evaluated.
        """
        for case, target in self.cases:
            try:
                if case.holds(self.userdata):
                    return target
            except Exception as error:
                raise _failed(frame, case, error) from error
        return self.otherwise


def _failed(frame: Frame, case: When, error: Exception) -> InvalidUserCodeError:
    if isinstance(case.condition, str):
        text = f"{frame.here()}: condition: {error_text(error)}"
        return InvalidUserCodeError(text, path=frame.here())
    return raised(frame.here(), f"condition {case.text}", error)


def choices_of(
    guards: Mapping[str, Cases],
    steps: Mapping[str, Any],
    ends: Mapping[str, Any],
    otherwise: Mapping[str, Any],
    userdata: Any,
) -> dict[str, Choice]:
    """Return outcome -> choice for one child.

    Args:
        guards: Outcome -> cases.
        steps: Label -> step.
        ends: Outcome of the machine -> end.
        otherwise: Outcome -> where it leads if no case holds, as a decision.
        userdata: The userdata of the machine.
    """
    return {
        outcome: Choice(
            tuple((case, steps.get(case.target) or ends[case.target]) for case in cases),
            otherwise[outcome].target,
            userdata,
        )
        for outcome, cases in guards.items()
    }
