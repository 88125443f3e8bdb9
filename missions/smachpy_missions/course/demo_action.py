"""Demo action: a server that counts to n, one step per second, written with two callbacks.

    DEMO_ACTION
      COUNT     counts to n and waits for the end
      PREEMPT   counts to 10 and is preempted before the end
      SEVERAL   counts to 1, 2 and 3 at once, on a server that runs any number of goals

Run all of it: `smachpy run demo_action`. As two programs:

    smachpy run demo_action.server
    smachpy run demo_action.client -- 10 4
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import smachpy
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import current_clock
from smachpy import Concurrence, SimpleActionState, StateMachine
from smachpy.states import MissionError, serve_during, serving_machine
from smachpy_missions.interfaces import (
    Demo_actionAction,
    Demo_actionFeedback,
    Demo_actionGoal,
    Demo_actionResult,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action.server import ServerGoalHandle
    from actionlib_core.clock import Clock, Event, Task
    from actionlib_core.node import Node

NAME = "demo_action"
SEVERAL = "demo_action_several"
STEP = 1.0  # [s]
MARGIN = 5.0  # [s] a count may take this much longer than its steps, before it is cancelled


@smachpy.mission(serves=[NAME, SEVERAL])
def demo_action(count: int = 3, preempt_after: float = 2.5) -> StateMachine:
    """Count to n; be preempted; count for several goals at once.

    Args:
        count: The last number of the first count.
        preempt_after: When the second count is preempted [s].
    """
    sm = StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="DEMO_ACTION")
    serve_during(sm, DemoActionServer, SeveralServer)
    with sm:
        sm.add("COUNT", count_to(count), {"succeeded": "PREEMPT"})
        preempt = {"stopped": "SEVERAL", "succeeded": "SEVERAL"}
        sm.add("PREEMPT", count_to(10, preempt_after), preempt)
        sm.add("SEVERAL", several())
    return sm


def count_to(count: int, preempt_after: float | None = None) -> SimpleActionState:
    """Send one goal and wait for its end; with `preempt_after` [s] it ends as 'stopped' then.

    Raises:
        MissionError: `count` or `preempt_after` is out of range.
    """
    check_count(count)
    if preempt_after is None:
        return SimpleActionState(
            NAME, Demo_actionAction, Demo_actionGoal(count), exec_timeout=count * STEP + MARGIN
        )
    if preempt_after <= 0.0:
        raise MissionError(f"preempt_after: got {preempt_after:g}; expected more than 0 [s].")
    return SimpleActionState(
        NAME,
        Demo_actionAction,
        Demo_actionGoal(count),
        timeout=preempt_after,
        timeout_outcome="stopped",
    )


def several(counts: tuple[int, ...] = (1, 2, 3)) -> Concurrence:
    """Send several goals at once; the server runs them in parallel."""
    all_done = {f"TO_{count}": "succeeded" for count in counts}
    both = Concurrence(
        outcomes=["succeeded", "aborted", "preempted"],
        default_outcome="aborted",
        outcome_map={"succeeded": all_done},
    )
    with both:
        for count in counts:
            limit = count * STEP + MARGIN
            state = SimpleActionState(
                SEVERAL, Demo_actionAction, Demo_actionGoal(count), exec_timeout=limit
            )
            both.add(f"TO_{count}", state)
    return both


def check_count(count: int) -> None:
    """Check that a number fits the goal's field.

    Raises:
        MissionError: it is negative, or larger than an int32.
    """
    if not 0 <= count < 2**31:
        raise MissionError(f"count: got {count}; expected 0 to 2147483647.")


# -- the servers -----------------------------------------------------------------------------------


def count_steps(
    clock: Clock, number: int, stop: Event, show: Callable[[int], object]
) -> tuple[int, bool]:
    """Count from 1 to `number`, one step per second.

    Args:
        clock: The clock to wait on.
        number: The last number.
        stop: Ends the count at once when set.
        show: Called with each number.

    Returns:
        The last number that was shown, and whether `stop` ended the count.

    Blocks: for `number` seconds at most.
    """
    start = clock.now()
    for current in range(1, number + 1):
        if stop.wait(start + current * STEP - clock.now()):
            return current - 1, True
        show(current)
    return number, False


class SeveralServer:
    """Counts for any number of goals at once: each has its own handle and thread.

    Args:
        node: The server's node; None uses the current one.
    """

    def __init__(self, *, node: Node | None = None) -> None:
        self._clock = current_clock() if node is None else node.clock
        self._stops: dict[str, Event] = {}
        self._server = ActionServer(
            SEVERAL, Demo_actionAction, self.on_goal, self.on_cancel, auto_start=False, node=node
        )
        self._server.start()

    def on_goal(self, handle: ServerGoalHandle) -> None:
        """Accept a goal and count for it in a new thread."""
        number = handle.get_goal().count
        trouble = _trouble(number)
        if trouble:
            handle.set_rejected(text=trouble)
            return
        handle.set_accepted()
        stop = self._clock.event("a reason to stop counting")
        self._stops[handle.get_goal_id().id] = stop
        self._clock.spawn(lambda: self._count(handle, number, stop), name=SEVERAL)

    def on_cancel(self, handle: ServerGoalHandle) -> None:
        """Stop the count of one goal; the others go on."""
        stop = self._stops.get(handle.get_goal_id().id)
        if stop is not None:
            stop.set()

    def close(self) -> None:
        """Stop all counts and leave the network."""
        for stop in tuple(self._stops.values()):  # a copy: counts that end remove themselves
            stop.set()
        self._server.stop()

    def _count(self, handle: ServerGoalHandle, number: int, stop: Event) -> None:
        def show(current: int) -> None:
            handle.publish_feedback(Demo_actionFeedback(current))

        last, stopped = count_steps(self._clock, number, stop, show)
        del self._stops[handle.get_goal_id().id]
        if stopped:
            handle.set_canceled(Demo_actionResult(last), f"stopped at {last}")
        else:
            handle.set_succeeded(Demo_actionResult(last), f"counted to {number}")


class DemoActionServer:
    """Counts for one client at a time: a newer goal preempts the older, as in ROS 1.

    Args:
        node: The server's node; None uses the current one.

    Threads: the two callbacks run one at a time, in a thread of the action server; the count runs
        in another one, so that a callback can stop it.
    """

    def __init__(self, *, node: Node | None = None) -> None:
        self._clock = current_clock() if node is None else node.clock
        self._stop = self._clock.event("a reason to stop counting")
        self._counting: Task | None = None
        self._last = 0
        self._closing = False
        self._server = SimpleActionServer(NAME, Demo_actionAction, auto_start=False, node=node)
        self._server.register_goal_callback(self.on_goal)
        self._server.register_preempt_callback(self.on_preempt)
        self._server.start()

    def on_goal(self) -> None:
        """The goal callback: accept the goal and begin to count."""
        waiting = self._server.next_goal
        # An even newer goal may have replaced the one this callback was called for; it gets a
        # callback of its own.
        if waiting is None or self._closing:
            return
        trouble = _trouble(waiting.get_goal().count)
        if trouble:
            self._server.set_rejected(text=trouble)
            return
        goal = self._server.accept_new_goal()
        self._stop.clear()
        self._last = 0
        # A cancel that arrived before the goal was accepted calls no preempt callback: only this
        # flag shows it.
        if self._server.is_preempt_requested():
            self._server.set_preempted(Demo_actionResult(0), "stopped at 0")
            return
        self._counting = self._clock.spawn(lambda: self._count(goal.count), name=NAME)

    def on_preempt(self) -> None:
        """The preempt callback: stop counting and report the last number."""
        self._stop.set()
        # Wait for the counting thread: `_last` is final only then, and so is the question whether
        # the count reached its end (and its goal succeeded) just before the stop.
        if self._counting is not None:
            self._counting.join()
        if self._server.is_active():
            self._server.set_preempted(Demo_actionResult(self._last), f"stopped at {self._last}")

    def close(self) -> None:
        """Stop counting and leave the network."""
        self._closing = True
        self.on_preempt()
        self._server.stop()

    def _count(self, number: int) -> None:
        self._last, stopped = count_steps(self._clock, number, self._stop, self._show)
        if not stopped:
            self._server.set_succeeded(Demo_actionResult(self._last), f"counted to {number}")

    def _show(self, current: int) -> None:
        self._server.publish_feedback(Demo_actionFeedback(current))


def _trouble(count: int) -> str:
    return "" if count >= 0 else f"count: got {count}; expected 0 or more"


# -- the two programs ------------------------------------------------------------------------------


def server() -> StateMachine:
    """Offer the action until Ctrl-C."""
    return serving_machine("DEMO_ACTION_SERVER", DemoActionServer)


def client(count: int = 10, preempt_after: float = 0.0) -> StateMachine:
    """Send one goal to a running server.

    Args:
        count: The last number.
        preempt_after: When to preempt the count [s]; 0: never.
    """
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="DEMO_ACTION_CLIENT")
    stop = {"stopped": "succeeded"} if preempt_after else {}
    with sm:
        sm.add("COUNT", count_to(count, preempt_after or None), stop)
    return sm
