"""What an operator is asked about a state with `resume="ask"`: a question on the network."""

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
    """Ask, for as long as the block runs, what is to become of the state at `path`.

    Args:
        path: The state.
        outcomes: The answers besides `RESUME`, which executes it again.
        on_answer: Called with the first answer, in a thread of the network.
    """
    node = get_node()
    number = next(node.shared("questions", lambda: itertools.count(1)))
    service = node.resolve(f"operator/questions/q{node.transport.session_id}_{number}")
    answers = tuple(dict.fromkeys((RESUME, *outcomes)))
    words = ("execute it again", *[""] * (len(answers) - 1))
    question = Question(path, TEXT, answers, words, "", FOREVER_S, FOREVER_S, service)
    inbox = Inbox(path, answers, on_answer)

    def on_call(request: Any) -> dict[str, Any]:
        if not request.answer.strip():
            return {"question": question_text(question, FOREVER_S)}
        try:
            inbox.take(request.answer, request.by)
        except AnswerRefusedError as error:
            return {"accepted": False, "text": error.reason}
        return {"accepted": True}

    with Service(f"/{service}", AnswerQuestion, on_call, node=node, alone=False):
        yield inbox
