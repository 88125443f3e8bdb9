"""Questions of missions on the network: find the open ones, and answer them.

Each question is a service while it is open, so its liveliness token shows that it exists:

    <channel>/questions/<id>      smachpy_msgs/AnswerQuestion

A request with an empty `answer` reads the question; any other one answers it. The first answer
counts; later ones are refused with the name of its author.
"""

from __future__ import annotations

import json
import threading
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.exceptions import ActionlibError
from actionlib_core.inputs.checked_data import checked
from actionlib_core.inputs.json_text import load_json
from actionlib_core.interfaces import define_service
from actionlib_core.node import get_node
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.encoding import encoding_of
from actionlib_core.wire.presence import list_endpoints
from smachpy.base.log import logwarn
from smachpy.exceptions import SmachError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.node import Node
    from actionlib_core.transport import Reply

AnswerQuestion = define_service(
    "smachpy_msgs/AnswerQuestion",
    """
string answer       # one of the answers; "" only reads the question
string by           # who gives it
bool picture        # send the picture
---
bool accepted
string text         # why it was not accepted
string question     # JSON: path, text, answers, words, default, patience, left
string media_type   # of the picture, "image/png"
uint8[] picture
""",
)

CALL_S: Final = 10.0
"""Time for a mission to accept an answer, on a busy computer [s]."""

MAX_AUTHOR_LENGTH: Final = 200
MAX_QUESTION_LENGTH: Final = 1_000_000
"""Longest text of a question [characters]."""

MAX_PICTURE_BYTES: Final = 4_000_000
"""Limit of a picture [bytes]."""

_MEDIA = (
    (b"\x89PNG\r\n\x1a\n", "image/png"),
    (b"\xff\xd8\xff", "image/jpeg"),
    (b"GIF8", "image/gif"),
)


class AnswerRefusedError(SmachError):
    """An answer was refused: it is not possible, it came too late, or the question is gone.

    Try: give one of the answers that the question lists, before its time is over.

    Attributes:
        answer: The answer.
        reason: The reason.
    """

    def __init__(self, where: str, answer: str, reason: str) -> None:
        self.answer = answer
        self.reason = reason
        super().__init__(f"{where}: answer: got {answer!r}; {reason}")


@dataclass(frozen=True, slots=True)
class Question:
    """An open question.

    Attributes:
        path: Path of the state that asks.
        text: The question.
        answers: The possible answers.
        words: The texts of their buttons, in the same order.
        default: The outcome if nobody answers.
        patience: Time for an answer [s].
        left: The rest of that time when the question was read [s].
        service: Full name of the service that takes the answer.
    """

    path: str
    text: str
    answers: tuple[str, ...]
    words: tuple[str, ...]
    default: str
    patience: float
    left: float
    service: str


class Inbox:
    """Takes the answers to one question; the first one counts.

    Args:
        where: Path of the state that asks, for errors.
        answers: The possible answers.
        on_answer: Called once, after the first answer.

    Attributes:
        answer: The answer and its author; None until there is one.

    Threads: `take` may be called from any thread.
    """

    def __init__(self, where: str, answers: Sequence[str], on_answer: Callable[[], object]) -> None:
        self.answer: tuple[str, str] | None = None
        self._where = where
        self._answers = answers
        self._on_answer = on_answer
        self._lock = threading.Lock()

    def take(self, text: str, by: str) -> str:
        """Take an answer; return the matching one of the possible answers.

        Raises:
            AnswerRefusedError: it matches none or several, or there is an answer already.
        """
        meant = find_answer(text, self._answers)
        if meant is None:
            hint = did_you_mean(text.strip(), self._answers)
            reason = f"expected one of {list(self._answers)}.{hint}"
            raise AnswerRefusedError(self._where, text, reason)
        with self._lock:
            if self.answer is not None:
                first, who = self.answer
                over = f"answered {first!r} by {who}" if who else f"over: {first!r}"
                reason = f"expected none: it is {over}."
                raise AnswerRefusedError(self._where, text, reason)
            self.answer = meant, by[:MAX_AUTHOR_LENGTH] or "somebody"
        self._on_answer()
        return meant

    def close(self, otherwise: str) -> tuple[str, str]:
        """Stop taking answers; return the first one with its author, else (`otherwise`, "")."""
        with self._lock:
            if self.answer is None:
                self.answer = otherwise, ""
            return self.answer


def find_answer(text: str, answers: Sequence[str]) -> str | None:
    """Return the answer that matches a text; None if none or several do."""
    word = text.strip()
    for fold in (str, str.casefold):
        found = [answer for answer in answers if fold(answer.strip()) == fold(word)]
        if len(found) == 1:
            return found[0]
    return None


def find_questions(node: Node | None = None) -> list[Question]:
    """Return the open questions, sorted by path.

    Args:
        node: The node to use; None for the current node.

    Blocks: until the network and each question have answered, at most 11 s for each.
    """
    node = node or get_node()
    found = []
    for end in list_endpoints(node.transport, kind=Kind.SERVICE):
        if end.type == AnswerQuestion._type:
            try:
                reply = _call(node, end.name, AnswerQuestion._request_class())
                if reply is not None:  # else it has just been answered
                    found.append(_read(reply.question, end.name))
            except (ActionlibError, ValueError) as error:
                logwarn(f"{end.name}: not read: {type(error).__name__}: {error}")
    return sorted(found, key=lambda one: (one.path, one.service))


def give_answer(service: str, answer: str, by: str, *, node: Node | None = None) -> None:
    """Answer a question.

    Args:
        service: The question's service.
        answer: One of its answers; upper and lower case do not matter.
        by: The author, for recordings.
        node: The node to use; None for the current node.

    Raises:
        AnswerRefusedError: it was refused, or the mission did not reply.

    Blocks: until the mission has accepted it, at most 11 s.
    """
    if not answer.strip():
        raise AnswerRefusedError(service, answer, "expected one of its answers.")
    make: Any = AnswerQuestion._request_class
    request = make(answer=answer, by=by)
    node = node or get_node()
    asked = node.clock.now()
    reply = _call(node, service, request)
    if reply is None:
        reason = "nobody asks that any more."
        if node.clock.now() - asked >= CALL_S:
            reason = f"the mission did not say in {CALL_S:g} s whether it took it."
        raise AnswerRefusedError(service, answer, reason)
    if not reply.accepted:
        raise AnswerRefusedError(service, answer, reply.text)


def fetch_picture(service: str, *, node: Node | None = None) -> tuple[str, bytes] | None:
    """Return media type and bytes of a question's picture; None if there is none any more.

    Blocks: until it has arrived, at most 11 s.
    """
    make: Any = AnswerQuestion._request_class
    reply = _call(node or get_node(), service, make(picture=True))
    if reply is None or not reply.picture:
        return None
    try:
        return read_picture(bytes(reply.picture))  # by its bytes: the named type may be wrong
    except ValueError as error:
        logwarn(f"{service}: picture: {error}")
        return None


def question_text(question: Question, left: float) -> str:
    """Return a question, with the rest of its time [s], as the service's JSON text."""
    told = {**asdict(question), "left": left}
    del told["service"]
    return json.dumps(told)


def read_picture(value: Any) -> tuple[str, bytes]:
    """Return media type and bytes of a picture.

    Args:
        value: The bytes of a PNG, JPEG or GIF file, the path of one, or a message with these bytes
            in `data`, such as sensor_msgs/CompressedImage.

    Raises:
        ValueError: it is not a picture of these formats, or is larger than 4 MB.
        OSError: the file cannot be read.
    """
    if hasattr(value, "__fspath__") or isinstance(value, str):
        with Path(value).open("rb") as file:
            data = file.read(MAX_PICTURE_BYTES + 1)
    else:
        data = getattr(value, "data", value)
        if not isinstance(data, (bytes, bytearray, memoryview)):
            kind = type(value).__name__
            raise ValueError(f"got {kind}; expected bytes, a path or a CompressedImage.")
        data = bytes(data)
    if len(data) > MAX_PICTURE_BYTES:
        raise ValueError(f"got more than {MAX_PICTURE_BYTES} bytes; expected fewer.")
    media = next((media for start, media in _MEDIA if data.startswith(start)), None)
    if media is None:
        raise ValueError(f"got bytes that begin with {data[:8]!r}; expected PNG, JPEG or GIF.")
    return media, data


def _read(text: str, service: str) -> Question:
    told = load_json(text, longest=MAX_QUESTION_LENGTH)
    if isinstance(told, dict):
        told["service"] = service
    question: Question = checked(Question, told, known_only=True)
    return question


def _call(node: Node, service: str, request: Any) -> Any:
    """Return the reply of a question's service; None if there is none.

    Without a `ServiceProxy`, because proxies leave data in the node for each name until the node is
    closed, and every question has a name of its own.
    """
    replies: list[Reply] = []
    done = node.clock.event(f"the answer of {service}")
    query = node.transport.query(
        service.removeprefix("/"),
        request.to_bytes(),
        encoding=encoding_of(AnswerQuestion),
        timeout=CALL_S,
        on_reply=replies.append,
        on_done=done.set,
    )
    done.wait(CALL_S + 1.0)
    query.close()
    for reply in replies:
        if not reply.error:
            return AnswerQuestion._response_class.from_bytes(reply.payload)
    return None
