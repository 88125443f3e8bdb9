"""Countdown: a server that counts down n seconds, a client that starts it, a client that stops it.

    COUNTDOWN
      COUNT           starts it and waits for zero
      START_TWICE     both at once: a second start preempts the first
        FIRST         counts from 5
        SECOND        starts two seconds later, counts from 3
      STOP            counts from 10 and is stopped after two seconds

Run all of it: `smachpy run countdown`. As three programs:

    python -m smachpy_missions.course.countdown server
    python -m smachpy_missions.course.countdown start 10
    python -m smachpy_missions.course.countdown stop
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

import smachpy
from actionlib_core import shutdown
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import current_clock
from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.names import parse_arguments
from actionlib_core.process.output import run_program
from smachpy import Concurrence, SimpleActionState, StateMachine, UserData
from smachpy.states import MissionError, Wait, serve_during
from smachpy_missions.interfaces import (
    CountdownAction,
    CountdownFeedback,
    CountdownGoal,
    CountdownResult,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.node import Node

NAME = "countdown"
SERVER_WAIT = 3.0  # [s] the programs `start` and `stop` wait for a server


@smachpy.mission(serves=[NAME])
def countdown(seconds: int = 3) -> StateMachine:
    """Count down; start twice; start and stop.

    Args:
        seconds: Start value of the first countdown.

    Raises:
        MissionError: `seconds` does not fit the goal's field.
    """
    check_seconds(seconds)
    sm = StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="COUNTDOWN")
    serve_during(sm, CountdownServer)
    stopped = count_from(10, timeout=2.0, timeout_outcome="stopped")
    with sm:
        sm.add("COUNT", count_from(seconds), {"succeeded": "START_TWICE"})
        sm.add("START_TWICE", start_twice(), {"succeeded": "STOP"})
        sm.add("STOP", stopped, {"stopped": "succeeded", "succeeded": "aborted"})
    return sm


def count_from(seconds: int, **options: Any) -> SimpleActionState:
    """Return a state that starts the countdown and waits for zero."""
    return SimpleActionState(NAME, CountdownAction, CountdownGoal(seconds=seconds), **options)


def check_seconds(seconds: int) -> None:
    """Check that a number fits the goal's field.

    Raises:
        MissionError: it is negative, or larger than a uint32.
    """
    if not 0 <= seconds < 2**32:
        raise MissionError(f"seconds: got {seconds}; expected 0 to 4294967295.")


def start_twice() -> Concurrence:
    """Start a countdown and, two seconds later, another one, which preempts the first."""
    both = Concurrence(
        outcomes=["succeeded", "aborted", "preempted"],
        default_outcome="aborted",
        outcome_map={"succeeded": {"FIRST": "taken_over", "SECOND": "succeeded"}},
    )
    second = StateMachine(outcomes=["succeeded", "aborted", "preempted"])
    second.add("WAIT", Wait(2.0), {"done": "COUNT"})
    second.add("COUNT", count_from(3))
    both.add("FIRST", count_from(5, outcomes=["taken_over"], result_cb=taken_over))
    both.add("SECOND", second)
    return both


def taken_over(_userdata: UserData, status: int, _result: CountdownResult) -> str | None:
    """Return the outcome for a goal that another client's goal preempted."""
    return "taken_over" if status == GoalStatus.PREEMPTED else None


# -- the server ------------------------------------------------------------------------------------


class CountdownServer:
    """Counts down, one step per second.

    Args:
        show: Called with the seconds left, once per second.
        node: The server's node; None uses the current one.
    """

    def __init__(
        self, show: Callable[[int], object] = lambda _seconds: None, *, node: Node | None = None
    ) -> None:
        self._show = show
        self._server = SimpleActionServer(
            NAME, CountdownAction, self._count, auto_start=False, node=node
        )
        self._clock = current_clock() if node is None else node.clock
        self._stop = self._clock.event()
        self._server.register_preempt_callback(self._stop.set)
        self._server.start()

    def close(self) -> None:
        """Leave the network; a running countdown is stopped."""
        self._stop.set()
        self._server.stop()

    def _count(self, goal: CountdownGoal) -> None:
        # Fixed due times instead of wait(1.0) in a row: the time spent on publishing does not
        # add up, and a countdown of an hour ends on time.
        left, due = goal.seconds, self._clock.now() + 1.0
        while left > 0:
            if self._server.is_preempt_requested():
                text = f"stopped with {left} s left"
                self._server.set_preempted(CountdownResult(seconds_left=left), text)
                return
            self._show(left)
            self._server.publish_feedback(CountdownFeedback(seconds_left=left))
            if self._stop.wait(due - self._clock.now()):  # a preempt ends the second early
                self._stop.clear()
            else:
                left, due = left - 1, due + 1.0
        self._show(0)
        self._server.set_succeeded(CountdownResult(seconds_left=0), "zero")


# -- the three programs ----------------------------------------------------------------------------


def serve() -> int:
    """Offer the countdown until Ctrl-C."""
    with shutdown.handle_signals():
        server = CountdownServer(show=print)
        print(f"{NAME}: ready; stop with Ctrl-C")
        shutdown.event().wait()
        server.close()
    return 0


def start(seconds: int) -> int:
    """Start a countdown and print each second; Ctrl-C ends this program, not the countdown."""
    check_seconds(seconds)
    client = connect()
    client.send_goal(
        CountdownGoal(seconds=seconds), feedback_cb=lambda feedback: print(feedback.seconds_left)
    )
    client.wait_for_result()
    print(client.get_goal_status_text())
    return 0 if client.get_state() == GoalStatus.SUCCEEDED else 1


def stop() -> int:
    """Stop every countdown."""
    connect().cancel_all_goals()
    return 0


def connect() -> SimpleActionClient[CountdownAction]:
    """Return a client that is connected to the server."""
    client = SimpleActionClient(NAME, CountdownAction)
    if not client.wait_for_server(SERVER_WAIT):
        raise ActionlibError(
            f"action {NAME!r}: got no server within {SERVER_WAIT:g} s; expected one. "
            "Try: python -m smachpy_missions.course.countdown server"
        )
    return client


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of the three programs."""
    parser = argparse.ArgumentParser(prog="python -m smachpy_missions.course.countdown")
    parser.add_argument("program", choices=["server", "start", "stop"])
    parser.add_argument("seconds", type=int, nargs="?", default=10)
    try:
        # ROS's own arguments (`__ns:=...`, `a:=b`) first: the node reads them, argparse cannot.
        names = parse_arguments(sys.argv[1:] if argv is None else argv)
        args = parser.parse_args(names.rest)
        if args.program == "server":
            return serve()
        return start(args.seconds) if args.program == "start" else stop()
    except (ActionlibError, MissionError) as error:
        print(f"countdown: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(run_program("countdown", main))
