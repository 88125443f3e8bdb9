"""Transitions that a person confirms: `{"done": confirm("NEXT", level=2)}`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.base.problems import Problems
from smachpy.machines.guards import Between
from smachpy.states.ask_operator import AskOperator

if TYPE_CHECKING:
    from smachpy.events.introspection import Kind
    from smachpy.userdata.user_data import UserData

PATIENCE_S = 300.0

_autonomy = 0


def set_autonomy(level: int) -> None:
    """Let all missions of this process take transitions up to this level without asking.

    Args:
        level: >= 0. At 0, as without a call, all transitions with `confirm` are asked.

    Raises:
        InvalidStateError: it is not a whole number >= 0.
    """
    global _autonomy  # noqa: PLW0603  one for the process, as the command line has one
    problems = Problems("set_autonomy")
    checked = problems.whole("level", level, 0, "a whole number >= 0")
    problems.raise_all()
    _autonomy = checked


class Confirm(AskOperator):
    """Asks whether to take a transition, unless the autonomy allows it; made by `confirm`.

    Outcomes: 'yes', 'no', 'no_answer', 'preempted'.
    """

    def __init__(self, question: str, level: int, patience: float) -> None:
        super().__init__(question, patience=patience)
        self.__level = level
        self._smachpy_form = (level, question, patience)  # as a mission file has it

    def execute(self, userdata: UserData) -> str:
        """Ask, if the level is above the autonomy of the process."""
        if self.__level <= _autonomy:
            self.note(f"not asked: level {self.__level}, autonomy {_autonomy}")
            return "yes"
        return super().execute(userdata)

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the level."""
        kind, details = super().describe_details()
        return kind, (("level", str(self.__level)), *details)


def confirm(
    target: str,
    level: int = 1,
    *,
    otherwise: str = "preempted",
    question: str = "",
    patience: float = PATIENCE_S,
) -> Between:
    """Return a target of a transition that a person confirms before it is taken.

    The machine gets one more state, `CONFIRM_<state>_<outcome>`, which asks.

    Args:
        target: Label of the next state, or outcome of the machine.
        level: It is asked if this is above the autonomy (`smachpy run --autonomy N`); >= 1.
        otherwise: Where it leads after a no, or if nobody answers in time.
        question: The question; "" is "Go on to <target>?".
        patience: Longest wait for the answer [s].

    Raises:
        InvalidStateError: an argument has a wrong form; all problems at once.
        MissionError: `patience` is not a duration.
    """
    problems = Problems("confirm")
    checked = problems.word("target", target)
    other = problems.word("otherwise", otherwise)
    number = problems.whole("level", level, 1, "a whole number >= 1")
    text = problems.word("question", question or f"Go on to {target}?")
    problems.raise_all()
    state = Confirm(text, number, patience)
    return Between("CONFIRM", state, {"yes": checked, "no": other, "no_answer": other})
