"""The question to an operator about a state with `resume="ask"`, offered on the network."""

from __future__ import annotations

import contextlib
import itertools
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.node import get_node
from actionlib_core.pubsub.service import Service
from smachpy.states.questions import (
    AnswerQuestion,
    AnswerRefusedError,
    Inbox,
    Question,
    question_text,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

RESUME: Final = "resume"
TEXT: Final = "It was active when the process ended. Execute it again, or which outcome?"
FOREVER_S: Final = 1e9


@contextlib.contextmanager
def open_question(
    path: str, outcomes: Sequence[str], on_answer: Callable[[], object]
) -> Iterator[Inbox]:
    """Offer the question how the state at `path` continues, while the block runs.

    Args:
        path: The path of the state.
        outcomes: The answers besides `RESUME`, which executes the state again.
        on_answer: Called after the first answer, in a thread of the network.
    """
    node = get_node()
    # The session's id and a number of the node: questions of several programs, and several
    # questions of one program, need a service each.
    number = next(node.shared("questions", lambda: itertools.count(1)))
    service = node.resolve(f"operator/questions/q{node.transport.session_id}_{number}")
    answers = tuple(dict.fromkeys((RESUME, *outcomes)))
    words = ("execute it again", *[""] * (len(answers) - 1))
    question = Question(path, TEXT, answers, words, "", FOREVER_S, FOREVER_S, service)
    inbox = Inbox(path, answers, on_answer)

    def on_call(request: Any) -> dict[str, Any]:
        if not request.answer.strip():  # without an answer it asks for the text of the question
            return {"question": question_text(question, FOREVER_S)}
        try:
            inbox.take(request.answer, request.by)
        except AnswerRefusedError as error:
            return {"accepted": False, "text": error.reason}
        return {"accepted": True}

    with Service(f"/{service}", AnswerQuestion, on_call, node=node, alone=False):
        yield inbox
