"""A state that asks a person, and takes the answer from anywhere on the network.

    smachpy answer                                                    # list the questions
    smachpy answer retry
    actionlib topic echo operator/question
    actionlib topic pub -1 operator/answer std_msgs/String '{data: retry}'
    actionlib service call operator/confirm '{data: true}'            # yes or no

The live page and the terminal view show the question as well, with a button for each answer.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import shlex
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.node import get_node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import FreshSubscriber, NewsPublisher
from smachpy.base.functions import name_of
from smachpy.base.log import logwarn
from smachpy.base.problems import Problems
from smachpy.engine.frame import current_scope
from smachpy.engine.preempt import on_preempt
from smachpy.events import QuestionAnswered, QuestionAsked
from smachpy.exceptions import MissionError
from smachpy.machines.state import State
from smachpy.states.questions import (
    AnswerQuestion,
    AnswerRefusedError,
    Inbox,
    Question,
    question_text,
    read_picture,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from os import PathLike

    from actionlib_core.interfaces.std_srvs.srv import SetBoolRequest
    from actionlib_core.node import Node
    from smachpy.engine.frame import Scope
    from smachpy.events.introspection import Kind
    from smachpy.userdata.user_data import UserData

YES_NO = ("yes", "no")
NO_ANSWER = "no_answer"


class AskOperator(State):
    """Asks a question and waits. Outcomes: the answers, `default`, 'preempted'.

    While it waits, viewers show the question, `smachpy answer` answers it through its own service
    (`smachpy.states.questions`), and the question is on the latched topic `<channel>/question`
    (std_msgs/String). Answers are also taken from the topic `<channel>/answer` (std_msgs/String:
    one of the answers) and, for yes and no, from the service `<channel>/confirm`
    (std_srvs/SetBool). The first answer counts, and is recorded with its author
    (`QuestionAnswered`). Upper and lower case do not matter unless two answers differ in nothing
    else. Any other text is refused and logged, and the question stays open.

    Args:
        question: The question, or a function of the userdata that returns it.
        answers: The possible answers; a mapping also gives the texts of their buttons.
        patience: Longest wait [s].
        default: The outcome if nobody answers: 'no_answer', or one of the answers.
        picture: A picture to show with it: the path of a PNG, JPEG or GIF file; the userdata key of
            such a path, of the bytes, or of a message with them in `data` (CompressedImage); or a
            function of the userdata that returns one of these. If it cannot be read, the question
            is asked without it and the reason is logged.
        channel: Prefix of the topics and services. An answer on the topic is for all questions
            that are open on this channel.
        **options: See `smachpy.machines.state.StateOptions`, and `input_keys` for the functions.

    Raises:
        InvalidStateError: `question` is empty, or neither a text nor a function of the userdata.
        MissionError: `patience` is not a duration, `default` is not possible, or `answers` is empty
            or has an answer with another meaning.
    """

    def __init__(
        self,
        question: str | Callable[[Any], str],
        answers: Sequence[str] | Mapping[str, str] = YES_NO,
        *,
        patience: float,
        default: str = NO_ANSWER,
        picture: PathLike[str] | str | Callable[[Any], Any] | None = None,
        channel: str = "operator",
        **options: Any,
    ) -> None:
        problems = Problems("AskOperator")
        for name, given in (("question", question), ("picture", picture)):
            if callable(given):
                problems.function(name, given, f"{name}(userdata)", 1)
        if not callable(question):
            problems.word("question", question)
        problems.raise_all()
        if not isinstance(patience, (int, float)) or not 0.0 < patience < math.inf:
            got = f"{patience:g}" if isinstance(patience, (int, float)) else repr(patience)
            raise MissionError(f"patience: got {got}; expected more than 0 [s].")
        words = dict(answers) if isinstance(answers, Mapping) else {}
        answers = (answers,) if isinstance(answers, str) else tuple(answers)
        if not all(isinstance(text, str) for text in (*answers, *words.values())):
            raise MissionError(f"answers: got {words or list(answers)}; expected texts.")
        answers = tuple(dict.fromkeys(answers))  # one that is there twice could not be meant
        taken = {"", NO_ANSWER, "preempted"}.intersection(answer.strip() for answer in answers)
        if not answers or taken:
            raise MissionError(
                f"answers: got {list(answers)}; expected at least one, and none that is empty, "
                "'no_answer' or 'preempted'."
            )
        if default not in (*answers, NO_ANSWER):
            raise MissionError(f"default: got {default!r}; expected {[*answers, NO_ANSWER]}.")
        if isinstance(picture, str):
            options["input_keys"] = [*options.get("input_keys", ()), picture]
        outcomes = dict.fromkeys((*answers, default, "preempted"))
        super().__init__(outcomes, **options)
        self._smachpy.code = tuple(one for one in (question, picture) if callable(one))
        self.__question = question
        self.__answers = answers
        self.__words = tuple(words.get(answer, "") for answer in answers)
        self.__patience = patience
        self.__default = default
        self.__picture = picture
        self.__channel = channel

    def execute(self, userdata: UserData) -> str:
        """Ask the question and wait for the answer.

        Blocks: until the answer, `patience` [s] or a preempt.
        """
        node = get_node()
        scope = current_scope()
        # A counter instead of a random id, so that runs with the same seed are equal; together with
        # the session's id the name is unique on the network.
        number = next(node.shared("questions", lambda: itertools.count(1)))
        service = node.resolve(f"{self.__channel}/questions/q{node.transport.session_id}_{number}")
        question = Question(
            path="" if scope is None else scope.path,
            text=str(self.__question(userdata) if callable(self.__question) else self.__question),
            answers=self.__answers,
            words=self.__words,
            default=self.__default,
            patience=self.__patience,
            left=self.__patience,
            service=service,
        )
        asking = _Asking(self, question, self.__read_picture(userdata), node)
        with contextlib.ExitStack() as open_ends:
            open_ends.callback(on_preempt(self, asking.wake.set))
            ask = open_ends.enter_context(
                NewsPublisher(f"{self.__channel}/question", String, latch=True, node=node)
            )
            # A latched answer is that to an earlier question.
            open_ends.enter_context(
                FreshSubscriber(f"{self.__channel}/answer", String, asking.on_topic, node=node)
            )
            if self.__answers == YES_NO:
                confirm = f"{self.__channel}/confirm"
                open_ends.enter_context(
                    Service(confirm, SetBool, asking.on_confirm, node=node, alone=False)
                )
            open_ends.enter_context(
                Service(f"/{service}", AnswerQuestion, asking.on_call, node=node, alone=False)
            )
            ask.publish(String(f"{question.text} ({', '.join(self.__answers)})"))
            logwarn(
                f"{question.text} Answer {' or '.join(self.__answers)} within "
                f"{self.__patience:g} s: smachpy answer {shlex.quote(self.__answers[0])}"
            )
            answer = asking.wait(scope)
            ask.publish(String(""))
        if answer is None:
            self.service_preempt()
            return "preempted"
        return answer

    def __read_picture(self, userdata: UserData) -> tuple[str, bytes]:
        picture: Any = self.__picture
        if picture is None:
            return "", b""
        try:
            if callable(picture):
                picture = picture(userdata)
            elif isinstance(picture, str):
                picture = userdata[picture]
            return ("", b"") if picture is None else read_picture(picture)
        except Exception as error:  # noqa: BLE001  the user's: ask without the picture
            logwarn(f"picture: {type(error).__name__}: {error} The question is asked without it.")
            return "", b""

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the question and the patience."""
        kind, details = super().describe_details()
        question = self.__question
        text = name_of(question) if callable(question) else question
        limit = f"{self.__patience:g} s -> {self.__default}"
        return kind, (("question", text), ("timeout", limit), *details)


class _Asking:
    """One open question."""

    def __init__(
        self, state: AskOperator, question: Question, picture: tuple[str, bytes], node: Node
    ) -> None:
        self.wake = node.clock.event(f"an answer to {question.text!r}")
        self._state = state
        self._question = question
        self._picture = picture
        self._clock = node.clock
        self._until = self._clock.now() + question.patience
        self._inbox = Inbox(question.path, question.answers, self.wake.set)

    def wait(self, scope: Scope | None) -> str | None:
        """Publish the question, wait for the answer and publish it; None after a preempt."""
        question, inbox = self._question, self._inbox
        if scope is not None:
            scope.emit(
                QuestionAsked,
                *(question.text, question.answers, question.words, question.default),
                *(question.patience, question.service, bool(self._picture[1])),
            )
        while inbox.answer is None and not self._state.preempt_requested():
            left = self._until - self._clock.now()
            if left <= 0.0:
                break
            self.wake.wait(left)
            self.wake.clear()
        preempted = self._state.preempt_requested()
        # An answer may have arrived together with the preempt or the timeout: it counts.
        answer, by = inbox.close("preempted" if preempted else question.default)
        if preempted and not by:
            return None
        if scope is not None:
            scope.emit(QuestionAnswered, answer, by)
        return answer

    def on_topic(self, message: String) -> None:
        self._take_or_log(message.data, f"the topic {self._channel}/answer")

    def on_confirm(self, request: SetBoolRequest) -> tuple[bool, str]:
        word = YES_NO[not request.data]
        taken = self._take_or_log(word, f"the service {self._channel}/confirm")
        first = self._inbox.answer
        return taken, f"{self._question.text} {word if first is None else first[0]}"

    def on_call(self, request: Any) -> dict[str, Any]:
        if request.answer.strip():
            try:
                self._inbox.take(request.answer, request.by)
            except AnswerRefusedError as error:
                return {"accepted": False, "text": error.reason}
            return {"accepted": True}
        media, data = self._picture if request.picture else ("", b"")
        left = max(0.0, self._until - self._clock.now())
        question = question_text(self._question, left)
        return {"question": question, "media_type": media, "picture": data}

    @property
    def _channel(self) -> str:
        return self._question.service.rpartition("/questions/")[0]

    def _take_or_log(self, text: str, by: str) -> bool:
        try:
            self._inbox.take(text, by)
        except AnswerRefusedError as error:
            logwarn(str(error))
            return False
        return True
