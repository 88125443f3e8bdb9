"""Robots with PNP's own `PNPActionServer`, which executes actions and evaluates conditions.

A single action, "PNP", executes all of them: its goal has the name of the action, its parameters
and the function "start" or "interrupt". The service "pnp/conditionEval" returns the value of a
condition; a message on the topic "pnp/conditionEvent" means that values may have changed. The robot
uses ROS 1 and is reached over the bridge (docs/ros1_robot.md). Source: pnp_msgs and pnp_ros of
PetriNetPlans 1.4.
"""

from __future__ import annotations

import contextlib
import itertools
import secrets
from typing import TYPE_CHECKING, Any, ClassVar, Final

from smachpy.actions.simple_action_state import SimpleActionState
from smachpy.base import log
from smachpy.base.context import current_frame
from smachpy.base.problems import Problems
from smachpy.engine.frame import clock_of_run
from smachpy.events.outcome_classes import is_good
from smachpy.exceptions import InvalidStateError

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
_INTERRUPT_S: Final = 5.0  # longest wait for the robot's answer to an interrupt
# An interrupt refers to its action by the id of the "start" goal. The first one is random, so that
# two programs, or two runs of one, do not use the same ids.
_ids = itertools.count(secrets.randbelow(2**31))


def _interface(kind: str, name: str, text: str) -> Any:
    """Return a class of `pnp_msgs`: the user's own definition, or the one above."""
    from actionlib_core import interfaces

    get, define = {
        "action": (interfaces.get_action, interfaces.define_action),
        "srv": (interfaces.get_service, interfaces.define_service),
    }[kind]
    # `pnp_msgs` is not bundled; its users may have registered their own files.
    try:
        return get(f"pnp_msgs/{name}")
    except interfaces.InterfaceError:
        return define(f"pnp_msgs/{name}", text)


class PNPServer:
    """A robot's `PNPActionServer`, for actions and conditions that are not registered here.

    The plan calls its service for every unknown condition, at each change and periodically while a
    guard waits for it. The robot keeps its events and variables ("@NAME" in names) itself. Actions
    end with 'succeeded', or with 'aborted' if the server aborts the goal or is lost. They are
    interrupted by a second goal, as the server does not support cancelling.

    Args:
        action: Name of its action; "{robot}" stands for the robot in the plan's names.
        conditions: Name of its service for conditions; None: it has none.
        events: Name of the topic that announces changes of conditions; None: there is none.
        robot: Name of the robot for actions whose names have none.
        every: Time between two calls of the service while a guard waits [s].
        timeout: Longest wait for a server or an answer [s]; then an error is raised.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    LOCAL: ClassVar = frozenset({"wait", "waitfor", "restartcurrentplan", "stopcurrentplan"})
    """Built-in actions that run here, although the robot has them, too."""

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
        # One for each running plan with this server; all have the same name, the newest is used.
        self._services: list[Any] = []
        self._seen: list[Any] = []  # the one that has had a server: no waiting for it again

    def state(self, call: Call) -> ServerAction:
        """Return the state in which the robot executes an action."""
        return ServerAction(call, self)

    def value(self, name: str) -> bool:
        """Ask the robot for the value of a condition.

        Raises:
            ServiceError: there is no answer within `timeout`.

        Blocks: until the answer.
        """
        services = self._services[-1:]  # a copy: another plan may end and remove its service
        if not services:
            raise InvalidStateError(f"{name}: not connected to the robot: no plan is running.")
        (service,) = services
        if service not in self._seen:
            service.wait_for_service(self.timeout)
            self._seen = [service]
        return bool(service(name).truth_value == 1)

    @contextlib.contextmanager
    def listening(self, changed: Callable[[], object]) -> Iterator[None]:
        """Connect to the robot within the block; `changed` is called when values may change."""
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
    """An action that a `PNPServer` executes."""

    def __init__(self, call: Call, server: PNPServer) -> None:
        self._call = call
        self._robot = call.robot or server.robot
        self._id = 0
        self._is_sent = False
        self._told: Any = None  # set once the goal was sent, or will not be
        self._name = server.action.replace("{robot}", self._robot).lstrip("/")
        super().__init__(
            self._name,
            _interface("action", "PNP", _ACTION),
            goal_cb=self._fill,
            server_wait_timeout=server.timeout,
        )

    def _fill(self, _userdata: Any, goal: Any) -> None:
        self._describe(goal, "start")

    def _describe(self, goal: Any, function: str) -> None:
        goal.id, goal.robotname, goal.name = self._id, self._robot, self._call.action
        goal.params, goal.function = "_".join(self._call.parameters), function

    def execute(self, ud: Any) -> str:
        """Let the robot execute the action.

        Blocks: until the server reports its end, after a preempt until it has stopped.
        """
        from actionlib_core.node import get_node

        # The callback runs in another thread, where this node may not be the current one.
        asked: list[bool] = []
        node, clock = get_node(), clock_of_run()
        done = clock.event(f"the interruption of {self._call.name}")
        frame = current_frame()
        if frame is not None:  # the next process of a durable run follows the goal, too
            self._id = frame.run.journal.once(frame, "id of PNP", lambda: next(_ids) % 2**32)
        # The robot would begin an action that it has been told to interrupt before.
        self._is_sent, self._told = False, clock.event(f"the goal of {self._call.name}")

        def interrupt() -> None:
            asked.append(True)
            try:
                self._told.wait()
                if self._is_sent:
                    self._interrupt(node)
            finally:
                done.set()

        forget = self.on_preempt(interrupt)
        try:
            outcome = super().execute(ud)
        finally:
            self._told.set()
            forget()
            # The program may end with the plan: first the interrupt must have reached the robot.
            if asked:
                done.wait(_INTERRUPT_S)
        # The server may report an interrupted action as succeeded.
        if asked and is_good(outcome):
            self.service_preempt()
            return "preempted"
        return outcome

    def _smachpy_goal_sent(self) -> None:
        self._is_sent = True
        self._told.set()

    def _interrupt(self, node: Node) -> None:
        """Send the goal that interrupts the action.

        Blocks: until the server has answered, at most 5 s.
        """
        from actionlib_core import ActionClient

        spec = _interface("action", "PNP", _ACTION)
        goal = spec().action_goal.goal
        self._describe(goal, "interrupt")
        client = ActionClient(self._name, spec, node=node)
        try:
            if not client.send_goal(goal).wait(_INTERRUPT_S):
                log.logwarn(f"{self._call.name}: {self._name!r} did not confirm the interrupt.")
        finally:
            client.stop()
