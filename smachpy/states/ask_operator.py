"""A state that asks a person, and waits for the answer from anywhere on the network.

    actionlib topic echo operator/question
    actionlib topic pub -1 operator/answer std_msgs/String '{data: retry}'
    actionlib service call operator/confirm '{data: true}'          # yes or no

On the live page (`smachpy run MISSION --view --control`) the operator ends the state with the
outcome of their choice.
"""

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.node import get_node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import Publisher, Subscriber
from smachpy import State, UserData
from smachpy.exceptions import MissionError, did_you_mean
from smachpy.log import logwarn
from smachpy.run.child import on_preempt

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actionlib_core.interfaces.std_srvs.srv import SetBoolRequest
    from actionlib_core.node import Node
    from smachpy.introspection import Kind

YES_NO = ("yes", "no")


class AskOperator(State):
    """Asks a question and waits. Outcomes: the answers, 'no_answer', 'preempted'.

    While it waits, the question is on the latched topic `<channel>/question` (std_msgs/String), and
    answers are taken from the topic `<channel>/answer` (std_msgs/String: one of the answers) and,
    for yes and no, from the service `<channel>/confirm` (std_srvs/SetBool). The first one counts.
    Upper and lower case do not matter unless two answers differ in nothing else. Anything
    else is refused and logged; the question stays.

    Args:
        question: What to ask.
        answers: What may be answered.
        patience: Longest wait [s]; the outcome is 'no_answer' then.
        channel: Where questions and answers go; an answer is for all questions asked there now.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        MissionError: `patience` is no time, or `answers` has none, or one that says something else.
    """

    def __init__(
        self,
        question: str,
        answers: Sequence[str] = YES_NO,
        *,
        patience: float,
        channel: str = "operator",
        **options: Any,
    ) -> None:
        if not 0.0 < patience < math.inf:
            raise MissionError(f"patience: got {patience:g}; expected more than 0 [s].")
        answers = (answers,) if isinstance(answers, str) else tuple(answers)
        taken = {"", "no_answer", "preempted"}.intersection(answer.strip() for answer in answers)
        if not answers or taken:
            raise MissionError(
                f"answers: got {list(answers)}; expected at least one, and none that is empty, "
                "'no_answer' or 'preempted'."
            )
        super().__init__((*answers, "no_answer", "preempted"), **options)
        self.__question = question
        self.__answers = answers
        self.__patience = patience
        self.__channel = channel

    def execute(self, userdata: UserData) -> str:
        """Ask.

        Blocks: until the answer, `patience` [s] or a preempt.
        """
        del userdata
        node = get_node()
        with contextlib.ExitStack() as open_ends:
            inbox = _Inbox(self, self.__question, self.__answers, node)
            open_ends.callback(on_preempt(self, inbox.wake.set))
            ask = open_ends.enter_context(
                Publisher(f"{self.__channel}/question", String, latch=True, node=node)
            )
            open_ends.enter_context(
                Subscriber(f"{self.__channel}/answer", String, inbox.on_answer, node=node)
            )
            if self.__answers == YES_NO:
                confirm = f"{self.__channel}/confirm"
                open_ends.enter_context(
                    Service(confirm, SetBool, inbox.on_confirm, node=node, alone=False)
                )
            ask.publish(String(f"{self.__question} ({', '.join(self.__answers)})"))
            logwarn(self.__invitation(node))
            answer = inbox.wait(self.__patience)
            ask.publish(String(""))
        if answer is None and self.preempt_requested():
            self.service_preempt()
            return "preempted"
        return answer or "no_answer"

    def __invitation(self, node: Node) -> str:
        topic = node.resolve(f"{self.__channel}/answer")
        return (
            f"{self.__question} Answer {' or '.join(self.__answers)} within {self.__patience:g} s: "
            f"actionlib topic pub -1 {topic} std_msgs/String '{{data: {self.__answers[0]}}}'"
        )

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the question and the patience."""
        kind, details = super().describe_details()
        own = (("question", self.__question), ("timeout", f"{self.__patience:g} s -> no_answer"))
        return kind, (*own, *details)


def find_answer(text: str, answers: Sequence[str]) -> str | None:
    """Return the answer that a text means, None when there is none or the text fits several."""
    word = text.strip()
    for fold in (str, str.casefold):
        found = [answer for answer in answers if fold(answer.strip()) == fold(word)]
        if len(found) == 1:
            return found[0]
    return None


class _Inbox:
    """Takes answers in; the first that is one wins."""

    def __init__(self, state: AskOperator, question: str, known: Sequence[str], node: Node) -> None:
        self.wake = node.clock.event(f"an answer to {question!r}")
        self._state = state
        self._question = question
        self._known = known
        self._clock = node.clock
        self._answers: list[str] = []

    def wait(self, seconds: float) -> str | None:
        """Return the answer; None when none came in time, or a preempt did."""
        until = self._clock.now() + seconds
        while not self._answers and not self._state.preempt_requested():
            left = until - self._clock.now()
            if left <= 0.0:
                break
            self.wake.wait(left)
            self.wake.clear()
        return self._answers[0] if self._answers else None

    def on_answer(self, message: String) -> None:
        known = self._known
        meant = find_answer(message.data, known)
        if meant is not None:
            self._take(meant)
            return
        hint = did_you_mean(message.data.strip(), known)
        logwarn(f"answer: got {message.data!r}; expected one of {list(known)}.{hint}")

    def on_confirm(self, request: SetBoolRequest) -> tuple[bool, str]:
        word = YES_NO[not request.data]
        return self._take(word), f"{self._question} {self._answers[0]}"

    def _take(self, word: str) -> bool:
        self._answers.append(word)
        self.wake.set()
        return self._answers[0] == word
