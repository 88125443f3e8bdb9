"""Demo service: a custom message and a custom service, both at 10 Hz.

    DEMO_SERVICE
      TALK_AND_LISTEN  runs both at once, until enough messages have arrived
        TALK           publishes a greeting and a number, ten times per second
        LISTEN         receives them and checks that none is missing
      CALL             ASK -> REST -> ASK: calls the service, ten times per second

Run all of it: `smachpy run demo_service`. As two programs:

    smachpy run demo_service.server
    smachpy run demo_service.client -- 10
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import Publisher
from smachpy import Concurrence, MonitorState, ServiceState, State, StateMachine, UserData
from smachpy.states import MissionError, serve_during, serving_machine
from smachpy_missions.interfaces import DemoMsg
from smachpy_missions.interfaces.srv import DemoSrv, DemoSrvRequest, DemoSrvResponse

if TYPE_CHECKING:
    from collections.abc import Callable

NAME = "demo_service"
TOPIC = "demo_msg"
RATE = 10.0  # [Hz]
TIMEOUT = 5.0  # [s] without a message or an answer the exercise fails


def answer(request: DemoSrvRequest) -> DemoSrvResponse:
    """Answer a call: this is the whole server."""
    return DemoSrvResponse(out=f"heard {request.in_!r}")


def demo_service(calls: int = 10, rate: float = RATE) -> StateMachine:
    """Talk, listen and call a service, each ten times per second.

    Args:
        calls: The number of messages, and then of calls.
        rate: Messages and calls per second [Hz].
    """
    check_numbers(calls, rate)
    sm = StateMachine(
        ["succeeded", "aborted", "preempted"], output_keys=["heard"], name="DEMO_SERVICE"
    )
    serve_during(sm, server_maker())
    with sm:
        sm.add("TALK_AND_LISTEN", talk_and_listen(calls, rate), {"heard": "CALL"})
        sm.add("CALL", calling(calls, rate))
    return sm


def server_maker() -> Callable[[], Service]:
    """Return a function that makes the server, on the node that is current when it is called."""
    return lambda: Service(NAME, DemoSrv, answer)


# -- the message -----------------------------------------------------------------------------------


def talk_and_listen(count: int, rate: float) -> Concurrence:
    """Publish until the listener has received `count` messages without a gap."""
    both = Concurrence(
        outcomes=["heard", "aborted", "preempted"],
        default_outcome="aborted",
        outcome_map={"heard": {"LISTEN": "valid"}},
        child_termination_cb=lambda _outcomes: True,
        userdata={"next_number": None},
    )
    listen = MonitorState(
        TOPIC,
        DemoMsg,
        in_a_row,
        max_checks=count,
        input_keys=["next_number"],
        output_keys=["next_number"],
        timeout=count / rate + TIMEOUT,
        timeout_outcome="invalid",
    )
    with both:
        both.add("TALK", Talk(rate))
        both.add("LISTEN", listen)
    return both


class Talk(State):
    """Publishes greetings at a rate until it is preempted."""

    def __init__(self, rate: float) -> None:
        super().__init__(outcomes=["preempted"])
        self._pace = 1.0 / rate

    def execute(self, userdata: UserData) -> str:
        """Publish; message n is due n periods after the first one, so delays do not add up."""
        del userdata
        clock = self.clock()
        with Publisher(TOPIC, DemoMsg) as publisher:
            start, number = clock.now(), 0
            while not self.sleep(start + number * self._pace - clock.now()):
                publisher.publish(greeting="hello", number=number)
                number += 1
        return "preempted"


def in_a_row(userdata: UserData, message: DemoMsg) -> bool:
    """Return whether this message follows the previous one without a gap."""
    expected = userdata.next_number
    userdata.next_number = message.number + 1
    return expected in {None, message.number}


# -- the service -----------------------------------------------------------------------------------


def calling(calls: int, rate: float) -> StateMachine:
    """Call the service `calls` times at a rate."""
    sm = StateMachine(
        ["succeeded", "aborted", "preempted"],
        output_keys=["heard"],
        userdata={"heard": "", "number": 0, "due": None},
    )
    ask = ServiceState(
        NAME,
        DemoSrv,
        request_cb=lambda userdata, _request: DemoSrvRequest(f"call {userdata.number}"),
        response_cb=note_answer,
        input_keys=["number"],
        output_keys=["number", "heard"],
        timeout=TIMEOUT,
    )
    with sm:
        sm.add("ASK", ask, {"succeeded": "REST"})
        sm.add("REST", Rest(calls, rate), {"due": "ASK", "enough": "succeeded"})
    return sm


def note_answer(userdata: UserData, response: DemoSrvResponse) -> None:
    """Count the answer and store its text."""
    userdata.heard = response.out
    userdata.number += 1


class Rest(State):
    """Waits until the next call is due; after a late call the next one follows at once."""

    def __init__(self, calls: int, rate: float) -> None:
        super().__init__(["due", "enough", "preempted"], ["number", "due"], ["number", "due"])
        self._calls = calls
        self._pace = 1.0 / rate

    def execute(self, userdata: UserData) -> str:
        """Wait until the next call is due; do not wait after the last call."""
        now = self.clock().now()
        due = now if userdata.due is None else userdata.due
        # Not before `now`: after a long delay the missed calls are dropped, not sent in a burst.
        userdata.due = max(due + self._pace, now)
        if userdata.number >= self._calls:
            return "enough"
        return "preempted" if self.sleep(userdata.due - now) else "due"


def check_numbers(calls: int, rate: float) -> None:
    """Check the arguments.

    Raises:
        MissionError: one is out of range.
    """
    if calls < 1:
        raise MissionError(f"calls: got {calls}; expected 1 or more.")
    # Above 1 kHz the operating system's timers, not the period, decide when a thread wakes up.
    if not 0.0 < rate <= 1000.0:  # noqa: PLR2004
        raise MissionError(f"rate: got {rate:g}; expected more than 0, at most 1000 [Hz].")


# -- the two programs ------------------------------------------------------------------------------


def server() -> StateMachine:
    """Offer the service until Ctrl-C."""
    return serving_machine("DEMO_SERVICE_SERVER", server_maker())


def client(calls: int = 10, rate: float = RATE) -> StateMachine:
    """Call a running service, ten times per second.

    Args:
        calls: The number of calls.
        rate: Calls per second [Hz].
    """
    check_numbers(calls, rate)
    sm = StateMachine(
        ["succeeded", "aborted", "preempted"], output_keys=["heard"], name="DEMO_SERVICE_CLIENT"
    )
    with sm:
        sm.add("CALL", calling(calls, rate))
    return sm
