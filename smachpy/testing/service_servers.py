"""A scripted service: what a test says it answers, faults included."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from actionlib_core.service import Service
from smachpy.testing.ends import ScriptedEnd, as_message

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.testing.kit import MissionKit


@dataclass(slots=True)
class Answer:
    """What is done with one request.

    Attributes:
        response: The response message.
        duration: How long it takes [s].
        error: The handler raises with this text.
        silent: No answer ever comes.
        die: The server dies instead of answering.
        function: Makes the response.
    """

    response: Any = None
    duration: float = 0.0
    error: str | None = None
    silent: bool = False
    die: bool = False
    function: Callable[[Any], Any] | None = None


class ScriptedService(ScriptedEnd):
    """A service that answers what the test says; made by the `service_server` fixture.

    Each request takes the next answer, else the default; without any script that is an empty
    response at once. With answers and no default, a request more fails the run.

    Args:
        kit: The test.
        name: The service's name.
        service_class: Its class.

    Attributes:
        requests: The requests that arrived, in order.
    """

    def __init__(self, kit: MissionKit, name: str, service_class: Any) -> None:
        self._service_class = service_class
        self.requests: list[Any] = []
        self._answers: deque[Answer] = deque()
        self._default: Answer | None = Answer()
        self._default_is_given = False
        super().__init__(kit, name)
        self._start()

    def _start(self) -> None:
        self._service = Service(self.name, self._service_class, self._handle, node=self.node)

    def reply(self, response: Any = None, duration: float = 0.0) -> Answer:
        """Answer the next request.

        Args:
            response: The response, or a dict of its fields.
            duration: How long it takes [s].
        """
        return self._queue(Answer(self._message(response), duration))

    def custom_reply(self, function: Callable[[Any], Any]) -> Answer:
        """Answer the next request with what `function(request)` returns; it may wait or raise.

        An AssertionError of it fails the run, too.
        """
        return self._queue(Answer(function=function))

    def default_response(self, response: Any = None, duration: float = 0.0) -> Answer:
        """Answer all requests for which there is no other answer."""
        self._default = Answer(self._message(response), duration)
        self._default_is_given = True
        return self._default

    def fail(self, text: str = "failed by the test", duration: float = 0.0) -> Answer:
        """Let the handler of the next request raise."""
        return self._queue(Answer(error=text, duration=duration))

    def never_answer(self) -> Answer:
        """Take the next request and say nothing."""
        return self._queue(Answer(silent=True))

    def die(self, after: float = 0.0) -> Answer:
        """Die with the next request unanswered, `after` so long [s]."""
        return self._queue(Answer(die=True, duration=after))

    def come_back(self) -> None:
        """Start again after death."""
        self._join()
        self._start()

    def _message(self, response: Any) -> Any:
        return as_message(self._service.response_class, response, f"{self.name}: response")

    def _queue(self, answer: Answer) -> Answer:
        if not self._default_is_given:
            self._default = None
        self._answers.append(answer)
        return answer

    def _handle(self, request: Any) -> Any:
        self.requests.append(request)
        answer = self._answers.popleft() if self._answers else self._default
        if answer is None:
            self.errors.append(
                f"{self.name}: request number {len(self.requests)} came; expected one less. Try "
                "reply(...) or default_response(...)."
            )
            raise RuntimeError(f"{self.name}: the test has no answer for this request")
        self._clock.sleep(answer.duration)
        if answer.die:
            self.kill()
        if answer.die or answer.silent:
            self._clock.event(f"the end of the test of {self.name}").wait()
        if answer.error is not None:
            raise RuntimeError(answer.error)
        if answer.function is not None:
            return self._call(answer.function, request)
        return self._service.response_class() if answer.response is None else answer.response

    def _call(self, function: Callable[[Any], Any], request: Any) -> Any:
        try:
            return function(request)
        except AssertionError as error:  # whatever else it raises is what the service does
            self.note_raised(function, error)
            raise
