"""A request of a client to a service of ROS 2, until its answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.transport import Closable, Reply, Transport
    from actionlib_core.wire.ros2.graph import End

T = TypeVar("T")

# As ROS 2's own. A question that ends unanswered is asked again. The network keeps something of
# each question until its time is over, also when it was answered.
ANSWER_S = 600.0


class Question:
    """A request on its way: its first answer that can be read counts.

    Args:
        read: Reads an answer; raises ValueError.
        on_answer: Gets what was read, and the answer.

    Attributes:
        answered: There was such an answer.
        over: No answer can come any more; its owner notes that.
    """

    __slots__ = ("_on_answer", "_read", "answered", "over")

    def __init__(self, read: Callable[[bytes], T], on_answer: Callable[[T, Reply], object]) -> None:
        self._read = read
        self._on_answer: Callable[[Any, Reply], object] = on_answer
        self.answered = False
        self.over = False

    def ask(
        self,
        transport: Transport,
        end: End,
        request: bytes,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> Closable:
        """Send it to one server, with an attachment of its own, so that no two are alike.

        Args:
            transport: The session.
            end: Our end of the service.
            request: The request.
            on_reply: Gets each answer, for `take`.
            on_done: Called when no more can come.

        Raises:
            TransportError: the session is closed.
        """
        return transport.query(
            end.key,
            request,
            attachment=end.attachment(),
            best=True,
            timeout=ANSWER_S,
            on_reply=on_reply,
            on_done=on_done,
        )

    def take(self, reply: Reply) -> str:
        """Take an answer; return what is wrong with it, or ""."""
        if self.answered:
            return ""
        if reply.error:
            return reply.payload.decode(errors="replace") or "an error without a text"
        try:
            answer = self._read(reply.payload)
        except ValueError as error:
            return str(error)
        self.answered = True
        self._on_answer(answer, reply)
        return ""
