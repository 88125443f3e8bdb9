"""Robots that run PNP's own `PNPActionServer`: they do a plan's actions, and answer its guards.

One action, "PNP", does all of them: a goal names the action, its parameters, and what is to happen
to it, "start" or "interrupt". The service "pnp/conditionEval" says what a condition is worth, the
topic "pnp/conditionEvent" when that may have changed. The robot is one of ROS 1, behind the bridge
(docs/ros1_robot.md). Source: pnp_msgs and pnp_ros of PetriNetPlans 1.4.
"""

from __future__ import annotations

import contextlib
import itertools
import secrets
from typing import TYPE_CHECKING, Any, ClassVar, Final

from smachpy import log
from smachpy.actions.simple_action_state import SimpleActionState
from smachpy.exceptions import InvalidStateError
from smachpy.machines.problems import Problems
from smachpy.outcome_classes import is_good
from smachpy.run.frame import clock_of_run

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.node import Node
    from smachpy.pnp.actions import Call

_ACTION: Final = """
uint32 id
string robotname
string name
string params
string function
---
string result
---
string feedback
"""
_CONDITION: Final = """
string cond
---
int8 truth_value
"""
_INTERRUPT_S: Final = 5.0
_ids = itertools.count(secrets.randbelow(2**31))


def _interface(kind: str, name: str, text: str) -> Any:
    """Return a class of `pnp_msgs`: the user's own definition, or the one above."""
    from actionlib_core import interfaces

    get, define = {
        "action": (interfaces.get_action, interfaces.define_action),
        "srv": (interfaces.get_service, interfaces.define_service),
    }[kind]
    try:
        return get(f"pnp_msgs/{name}")
    except interfaces.InterfaceError:
        return define(f"pnp_msgs/{name}", text)


class PNPServer:
    """A robot's `PNPActionServer`: does what nothing else is registered for.

    A plan with one asks it for every condition that nobody else knows, each time something changes
    and every so many seconds while a guard waits for it; its own events and variables ("@NAME" in
    names) are its own. Actions end with 'succeeded', or with 'aborted' when the server aborts the
    goal or is lost, and are interrupted by a second goal, as the server knows no cancel.

    Args:
        action: Name of its action; "{robot}" stands for the robot in the plan's names.
        conditions: Name of its service for conditions; None: it is asked for none.
        events: Name of the topic whose messages say that conditions may have changed; None: none.
        robot: Name of the robot for actions whose names have none.
        every: Time between two questions while a guard waits [s].
        timeout: A server or an answer that does not come within that is an error [s].

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    LOCAL: ClassVar = frozenset({"wait", "waitfor", "restartcurrentplan", "stopcurrentplan"})
    """Built-in actions that are the plan's own, though the robot has them, too."""

    def __init__(
        self,
        action: str = "PNP",
        *,
        conditions: str | None = "pnp/conditionEval",
        events: str | None = "pnp/conditionEvent",
        robot: str = "",
        every: float = 0.2,
        timeout: float = 10.0,
    ) -> None:
        problems = Problems(type(self).__name__)
        self.action = problems.word("action", action)
        self.conditions = conditions and problems.word("conditions", conditions)
        self.events = events and problems.word("events", events)
        self.robot = problems.word("robot", robot) if robot != "" else ""
        self.every = problems.seconds("every", every, optional=False) or 0.0
        self.timeout = problems.seconds("timeout", timeout, optional=False) or 0.0
        for name, value in (("every", self.every), ("timeout", self.timeout)):
            if value == 0.0:
                problems.add(f"{name}: got 0; expected more.")
        problems.raise_all()
        self._services: list[Any] = []
        self._seen: list[Any] = []  # they had a server once

    def state(self, call: Call) -> ServerAction:
        """Return the state that lets the robot do an action."""
        return ServerAction(call, self)

    def value(self, name: str) -> bool:
        """Ask what a condition is worth.

        Raises:
            ServiceError: nobody answers within `timeout`.

        Blocks: until the answer.
        """
        services = self._services[-1:]
        if not services:
            raise InvalidStateError(f"{name}: nobody listens to the robot: no plan runs.")
        (service,) = services
        if service not in self._seen:
            service.wait_for_service(self.timeout)
            self._seen = [service]
        return bool(service(name).truth_value == 1)

    @contextlib.contextmanager
    def listening(self, changed: Callable[[], object]) -> Iterator[None]:
        """Be able to ask while this lasts; `changed` is called when answers may have changed."""
        from actionlib_core.interfaces.std_msgs.msg import String
        from actionlib_core.pubsub.service_proxy import ServiceProxy
        from actionlib_core.pubsub.topic import NotingSubscriber

        with contextlib.ExitStack() as stack:
            if self.conditions is not None:
                spec = _interface("srv", "PNPCondition", _CONDITION)
                service = ServiceProxy(self.conditions, spec, timeout=self.timeout)
                self._services.append(service)
                stack.callback(service.close)
                stack.callback(self._services.remove, service)
            if self.events is not None:
                stack.enter_context(NotingSubscriber(self.events, String, lambda _: changed()))
            yield


class ServerAction(SimpleActionState):
    """An action that a `PNPServer` does."""

    def __init__(self, call: Call, server: PNPServer) -> None:
        self._call = call
        self._robot = call.robot or server.robot
        self._id = 0
        self._name = server.action.replace("{robot}", self._robot).lstrip("/")
        super().__init__(
            self._name,
            _interface("action", "PNP", _ACTION),
            goal_cb=self._fill,
            server_wait_timeout=server.timeout,
        )

    def _fill(self, _userdata: Any, goal: Any) -> None:
        self._id = next(_ids) % 2**32
        self._describe(goal, "start")

    def _describe(self, goal: Any, function: str) -> None:
        goal.id, goal.robotname, goal.name = self._id, self._robot, self._call.action
        goal.params, goal.function = "_".join(self._call.parameters), function

    def execute(self, ud: Any) -> str:
        """Let the robot do it.

        Blocks: until the server says that it is done, or after a preempt until it has stopped.
        """
        from actionlib_core.node import get_node

        asked: list[bool] = []
        node, done = get_node(), clock_of_run().event(f"the interruption of {self._call.name}")

        def interrupt() -> None:
            asked.append(True)
            try:
                self._interrupt(node)
            finally:
                done.set()

        forget = self.on_preempt(interrupt)
        try:
            outcome = super().execute(ud)
        finally:
            forget()
            if asked:  # the program may end with the plan: the robot is to have been told
                done.wait(_INTERRUPT_S)
        if asked and is_good(outcome):
            self.service_preempt()
            return "preempted"
        return outcome

    def _interrupt(self, node: Node) -> None:
        """Send the goal that interrupts the action.

        Blocks: until the server has taken it, for some seconds at most.
        """
        from actionlib_core import ActionClient

        spec = _interface("action", "PNP", _ACTION)
        goal = spec().action_goal.goal
        self._describe(goal, "interrupt")
        client = ActionClient(self._name, spec, node=node)
        try:
            if not client.send_goal(goal).wait(_INTERRUPT_S):
                log.logwarn(f"{self._call.name}: {self._name!r} did not take its interruption.")
        finally:
            client.stop()
