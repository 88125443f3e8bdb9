"""Random machines among random servers, for the tests of reproduction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.std_msgs.msg import Int32
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy import (
    CBState,
    Concurrence,
    MonitorState,
    ServiceState,
    SimpleActionState,
    StateMachine,
)
from smachpy.states.waiting import Wait

REPLIES = (
    "succeed",
    "abort",
    "reject",
    "late",
    "never_answer",
    "never_finish",
    "deaf",
    "die",
    "twice",
)
KINDS = ("drive", "watch", "call", "wait", "both", "count")


@dataclass(frozen=True)
class Plan:
    """A machine, the world around it, and what happens in it.

    Attributes:
        states: Kind of each state, and where its good and its bad outcome lead: the number of a
            later state, or -1 for the end.
        replies: What the server does with the goals, with a duration [s] each.
        calls: Whether the service answers, after how long [s].
        numbers: When the topic publishes which number.
        preempt: When the mission is asked to stop [s], or None.
        by: Who asks: "preempt", or a signal.
    """

    states: tuple[tuple[str, int, int], ...]
    replies: tuple[tuple[str, float], ...]
    calls: tuple[tuple[bool, float], ...]
    numbers: tuple[tuple[float, int], ...]
    preempt: float | None
    by: str = "preempt"

    def machine(self) -> StateMachine:
        """Return a new machine."""
        sm = StateMachine(["good", "bad", "preempted"], name="RANDOM", userdata={"found": 0})
        with sm:
            for number, (kind, good, bad) in enumerate(self.states):
                sm.add(
                    f"S{number}",
                    *_state(kind, number, self._name(good, "good"), self._name(bad, "bad")),
                )
        return sm

    @staticmethod
    def _name(number: int, outcome: str) -> str:
        return f"S{number}" if number >= 0 else outcome

    def play(self, kit: Any) -> None:
        """Offer the servers and the topic in a test."""
        robot = kit.action_server("move_base", MoveBaseAction)
        robot.default_result(duration=1.0)
        for word, seconds in self.replies:
            _reply(robot, word, seconds)
        light = kit.service_server("light", SetBool)
        light.default_response({"success": True})
        for works, seconds in self.calls:
            if works:
                light.reply({"success": True, "message": f"{seconds:g}"}, duration=seconds)
            else:
                light.fail("no power", duration=seconds)
        numbers = kit.topic("number", Int32)
        for at, value in self.numbers:
            numbers.publish_at(at, data=value)
        if self.preempt is None:
            return
        if self.by == "preempt":
            kit.preempt(at=self.preempt)
        else:
            kit.trigger(lambda _: kit.shutdown.request(self.by), at=self.preempt)


def _reply(robot: Any, word: str, seconds: float) -> None:
    calls = {
        "succeed": lambda: robot.reply(duration=seconds, feedback=[{}, {}]),
        "abort": lambda: robot.reply(status="aborted", duration=seconds, text="a wall"),
        "reject": robot.reject,
        "late": lambda: robot.accept_late(seconds, duration=1.0),
        "never_answer": robot.never_answer,
        "never_finish": robot.never_finish,
        "deaf": lambda: robot.ignore_cancel(seconds + 4.0),
        "die": lambda: robot.die(after=seconds, back_after=0.5),
        "twice": lambda: robot.deliver_twice(duration=seconds, feedback=[{}]),
    }
    calls[word]()


def _drive(number: int) -> SimpleActionState:
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = f"map_{number}"
    return SimpleActionState(
        "move_base",
        MoveBaseAction,
        goal,
        exec_timeout=6.0,
        preempt_timeout=3.0,
        server_wait_timeout=4.0,
    )


def _watch() -> MonitorState:
    return MonitorState(
        "number", Int32, lambda _, m: m.data < 5, timeout=3.0, timeout_outcome="invalid"
    )


def _count(userdata: Any) -> str:
    userdata.found = userdata.found + 1
    return "done"


def _state(kind: str, number: int, good: str, bad: str) -> tuple[Any, dict[str, str]]:
    if kind == "drive":
        return _drive(number), {"succeeded": good, "aborted": bad}
    if kind == "watch":
        return _watch(), {"valid": good, "invalid": bad}
    if kind == "call":
        request = SetBool._request_class(data=bool(number % 2))
        return ServiceState("light", SetBool, request, timeout=5.0), {
            "succeeded": good,
            "aborted": bad,
        }
    if kind == "wait":
        return Wait(0.25 * (number + 1)), {"done": good}
    if kind == "count":
        keys = {"input_keys": ["found"], "output_keys": ["found"]}
        return CBState(_count, outcomes=["done"], **keys), {"done": good}
    both = Concurrence(
        ["good", "bad", "preempted"],
        default_outcome="bad",
        child_termination_cb=lambda ended: ended.get("WATCH") == "invalid",
        outcome_map={"good": {"DRIVE": "succeeded"}},
    )
    with both:
        both.add("DRIVE", _drive(number))
        both.add("WATCH", _watch())
    return both, {"good": good, "bad": bad}


def times(apart: float) -> Any:
    """Draw times [s]; those of different things differ, as they do in the world."""
    return st.integers(1, 40).map(lambda n: n * 0.2 + apart)


@st.composite
def plans(draw: Any) -> Plan:
    """Draw a plan. Its states lead forwards, so it ends."""
    count = draw(st.integers(1, 5))
    states = []
    for number in range(count):
        later = st.sampled_from([*range(number + 1, count), -1])
        states.append((draw(st.sampled_from(KINDS)), draw(later), draw(later)))
    return Plan(
        tuple(states),
        tuple(draw(st.lists(st.tuples(st.sampled_from(REPLIES), times(0.013)), max_size=4))),
        tuple(draw(st.lists(st.tuples(st.booleans(), times(0.0113)), max_size=2))),
        tuple(sorted(draw(st.lists(st.tuples(times(0.0171), st.integers(0, 9)), max_size=6)))),
        draw(st.none() | times(0.0057)),
        draw(st.sampled_from(["preempt", "SIGTERM"])),
    )
