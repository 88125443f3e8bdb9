"""`SimpleActionState`: a state that sends a goal to an action server and waits for its end."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeVar

from actionlib_core.action.client import ActionClient
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.node import get_node
from actionlib_core.wire.action_types import ActionTypes
from smachpy.actions.goal_run import ABORTED, OUTCOMES, PREEMPTED, STOPPED, GoalFollower, GoalRun
from smachpy.actions.interface import adopt_interface
from smachpy.actions.messages import Incoming, Outgoing, UserCallback
from smachpy.actions.wakeup import Wakeup, answer_preempt
from smachpy.base import log
from smachpy.base.context import current_frame
from smachpy.base.problems import Problems
from smachpy.engine.frame import current_scope
from smachpy.engine.interrupt import Interruption
from smachpy.engine.preempt import inherited_grace, on_preempt
from smachpy.engine.step import Timeout
from smachpy.machines.state import CommonOptions, Shown, State, get_options

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Unpack

    from actionlib_core.action._action_spec import ActionSpec as Spec
    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from smachpy.base.names import Names
    from smachpy.engine.frame import Frame
    from smachpy.events.introspection import Kind
    from smachpy.machines.state import Grace

__all__ = ["ActionStateOptions", "SimpleActionState"]

G = TypeVar("G")
R = TypeVar("R")
F = TypeVar("F")

SHORTEST_ACK_S = 1.0
"""Lower limit of `server_wait_timeout`: time for the acknowledgement of a running server [s]."""

ASKED_AGAIN_S = 5.0
"""Time after a resume for whoever had asked the state to stop to ask again [s]."""

MARGIN_S = 5.0
INHERITED_MARGIN_S = 1.0
"""Time from the moment when the goal is abandoned to the interruption of the state [s].

The state normally ends when its goal is abandoned; the interruption is only for callbacks that
block. The second value is for a grace set by a container, which must not be exceeded by much.
"""

DEFAULT_PREEMPT_S = 60.0
"""The longest time that a cancelled goal has to end if nobody has said more [s], as in SMACH."""


class ActionStateOptions(CommonOptions, total=False):
    """`StateOptions` without `preempt_timeout`, which is an argument of its own here."""

    timeout: float | None
    timeout_outcome: str


class SimpleActionState(State):
    """Sends a goal and waits for its end. Outcomes: 'succeeded', 'aborted', 'preempted'.

    The way to send a goal in a mission; others: docs/howto/which_way.md.

    Each run builds a new goal from `goal` or `goal_key`, then `goal_slots`, then `goal_cb`. All
    callbacks run in the state's thread, without a lock. They may raise: a running goal is cancelled
    first.

    The outcome is 'preempted' only after a preempt of this state. A goal stopped by somebody else
    is 'aborted', like one that the server aborted, rejected or lost. The reason is logged and in
    the event `smachpy.events.GoalDone`.

    Args:
        action_name: Name of the action.
        action_spec: Its class (XAction).
        goal: The goal (XGoal), or the initial one for the slots and the callback.
        goal_key: Userdata key that holds the goal.
        goal_slots: Names of goal fields that are set from userdata keys of the same name.
        goal_cb: Called as `goal_cb(userdata, goal, *goal_cb_args, **goal_cb_kwargs)`; changes the
            goal or returns another. Its `cb_interface` is added, like those of the other callbacks.
        goal_cb_args: Arguments for it.
        goal_cb_kwargs: Keyword arguments for it.
        result_key: Userdata key that gets the result (XResult), if one arrives.
        result_slots: Names of result fields that are written to userdata keys of the same name.
        result_cb: Called as `result_cb(userdata, status, result, *result_cb_args,
            **result_cb_kwargs)` once a goal that was sent has ended; `status` is a number of
            `GoalStatus`. Without a result from the server it gets an empty one. May return the
            outcome.
        result_cb_args: Arguments for it.
        result_cb_kwargs: Keyword arguments for it.
        input_keys: More keys to read, for the callbacks.
        output_keys: More keys to write, for the callbacks.
        outcomes: More outcomes, for `result_cb`.
        exec_timeout: Time that the goal has to end, from its acceptance by a server [s], when it
            becomes ACTIVE. After that it is cancelled, and the outcome is 'aborted'; None for no
            limit. A callback that still runs `preempt_timeout` and a few seconds later is
            interrupted (docs/preemption.md), with the same outcome.
        preempt_timeout: Time that a cancelled goal has to end [s]. After that it is abandoned and
            reported; it may still run on the server. None for no limit. "inherit", the default,
            takes 60 s, or a container's `preempt_timeout` if that is shorter.
        server_wait_timeout: Time for a server to appear and accept the goal [s], which may have to
            wait there behind others; at least one second. After that it is cancelled, and the
            outcome is 'aborted'. None for no limit.
        feedback_cb: Called as `feedback_cb(userdata, feedback)` for each XFeedback. While it runs,
            a preempt or `exec_timeout` still cancels the goal. If it is slower than the feedback,
            up to 100,000 messages wait, and the oldest are dropped. Messages that are still waiting
            at the goal's end are dropped after a call that takes longer than 0.5 s or, if this
            state has cancelled the goal, after 0.2 s. The log says how many.
        feedback_key: Userdata key that gets each XFeedback.
        cancel_on_client_lost: The server cancels the goal if this program dies or is cut off; see
            `ActionClient.send_goal`. A durable mission sends a new one when it is resumed.
        node: Node of the client; None for the current node.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        ActionException: `action_spec` is not an action class.
        InvalidStateError: an argument does not fit the action; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "action"

    WAITING_FOR_SERVER: ClassVar[int] = 0
    INACTIVE: ClassVar[int] = 1
    ACTIVE: ClassVar[int] = 2
    PREEMPTING: ClassVar[int] = 3
    COMPLETED: ClassVar[int] = 4

    def __init__(
        self,
        action_name: str,
        action_spec: type[Spec[G, R, F]],
        goal: G | None = None,
        goal_key: str | None = None,
        goal_slots: Iterable[str] = (),
        goal_cb: Callable[..., Any] | None = None,
        goal_cb_args: Iterable[Any] = (),
        goal_cb_kwargs: Mapping[str, Any] | None = None,
        result_key: str | None = None,
        result_slots: Iterable[str] = (),
        result_cb: Callable[..., str | None] | None = None,
        result_cb_args: Iterable[Any] = (),
        result_cb_kwargs: Mapping[str, Any] | None = None,
        input_keys: Names = (),
        output_keys: Names = (),
        outcomes: Names = (),
        exec_timeout: float | Duration | None = None,
        preempt_timeout: float | Duration | Literal["inherit"] | None = "inherit",
        server_wait_timeout: float | Duration | None = 60.0,
        *,
        feedback_cb: Callable[[Any, F], object] | None = None,
        feedback_key: str | None = None,
        cancel_on_client_lost: bool = False,
        node: Node | None = None,
        **options: Unpack[ActionStateOptions],
    ) -> None:
        problems = Problems(f"{type(self).__name__} {action_name!r}")
        given = (*OUTCOMES, *problems.names("outcomes", outcomes))
        with problems:
            super().__init__(given, input_keys, output_keys, **options)
        self.__action_name = problems.network_name("action_name", action_name)
        self.__types = ActionTypes.of(action_spec)
        self.__goal = Outgoing(
            "goal",
            self.__types.goal,
            copy.deepcopy(goal),
            goal_key,
            problems.names("goal_slots", goal_slots),
            UserCallback.of(
                problems, "goal_cb", ("userdata", "goal"), goal_cb, goal_cb_args, goal_cb_kwargs
            ),
        )
        self.__result = Incoming(
            "result",
            self.__types.result,
            result_key,
            problems.names("result_slots", result_slots),
            UserCallback.of(
                problems,
                "result_cb",
                ("userdata", "status", "result"),
                result_cb,
                result_cb_args,
                result_cb_kwargs,
            ),
        )
        self.__feedback_cb = problems.function(
            "feedback_cb", feedback_cb, "feedback_cb(userdata, feedback)", 2
        )
        self.__feedback_key = feedback_key
        self.__cancel_on_client_lost = cancel_on_client_lost
        self.__exec_s = problems.seconds("exec_timeout", exec_timeout)
        self.__server_wait_s = problems.seconds("server_wait_timeout", server_wait_timeout)
        self._smachpy_set_options({"preempt_timeout": preempt_timeout}, problems)
        self.__node = node
        self.__exchange: GoalFollower | None = None
        problems.add(*self.__goal.problems(), *self.__result.problems())
        problems.raise_all()
        self._smachpy.code = (self.__goal,)
        self.__goal.declare(self)
        self.__result.declare(self)
        self.register_output_keys([] if feedback_key is None else [feedback_key])
        adopt_interface(self, feedback_cb, outcomes=False)

    # -- running -------------------------------------------------------------------------------

    def execute(self, ud: Any) -> str:
        """Send the goal and wait for its end.

        An exception of a callback is passed on after the goal has ended.

        Raises:
            FieldError: a field of the goal has a wrong type.
            TypeMismatchError: the action's server is of another type.

        Blocks: until the goal has ended, at most all three timeouts together; a preempt cancels the
            goal at once.
        """
        frame: Frame | None = current_frame()
        if frame is None or self.__exec_s is None:
            return self.__execute(ud, None)
        limit = Timeout(frame, self.__exec_s)
        try:
            outcome = self.__execute(ud, limit)
        except Interruption:
            if not limit.end(PREEMPTED):
                raise
            log.logwarn(f"{frame.here()}: a callback did not return; 'aborted' by exec_timeout.")
            return ABORTED
        except BaseException:
            limit.end(None)
            raise
        limit.end(outcome)
        return outcome

    def __execute(self, ud: Any, limit: Timeout | None) -> str:
        """Send or resume the goal, and wait for its end.

        `limit` asks the state to stop if `exec_timeout` passes while the user's code runs.
        """
        frame: Frame | None = current_frame()
        kept = None if frame is None else frame.run.journal.goal_of(frame)
        if kept is not None and frame is not None:
            outcome = self.__resume(ud, limit, frame, kept)
            if outcome is not None:
                return outcome
        exchange = self.__exchange_goal(ud, limit, frame, None)
        return PREEMPTED if exchange is None else self.__finish(ud, exchange)

    def __resume(self, ud: Any, limit: Timeout | None, frame: Frame, kept: Any) -> str | None:
        """Follow the goal that an earlier process has sent; None: send a new one."""
        if kept.get("preempted") and not kept["stopped"]:
            # It had ended because its state was asked to stop. Whoever asked is resumed too and
            # asks again: a concurrence, for instance, once all its children have been entered.
            State.wait_preempt(self, ASKED_AGAIN_S)
        exchange = self.__exchange_goal(ud, limit, frame, kept)
        assert exchange is not None
        status = exchange.run.status
        ended_with_it = self.__cancel_on_client_lost and not kept["status"]
        if (kept["stopped"] or ended_with_it) and status in STOPPED and not self._preempt_requested:
            return None  # only the end of that process had stopped it
        # The usual case: a server knows the goal, or its end was recorded, or it must stop anyway.
        if not exchange.unanswered or kept["status"] or self._preempt_requested:
            return self.__finish(ud, exchange)
        # No server knows the goal: it may have been done or not. Cancel it, should it still arrive;
        # then `resume` decides, else `idempotent`; a goal that was never accepted is sent again.
        exchange.call_off(kept["id"])
        options = get_options(self)
        if options.resume is not None:
            decided: str | None = frame.run.journal.decide(frame, ud)
            return decided
        if options.idempotent or kept["taken_ns"] is None:
            return None
        return self.__finish(ud, exchange)

    def __exchange_goal(
        self, ud: Any, limit: Timeout | None, frame: Frame | None, kept: Any
    ) -> GoalFollower | None:
        """Send a goal, or follow the `kept` one, until its end; None if preempted before that."""
        with Wakeup(self) as wake:
            if kept is None and answer_preempt(self):
                return None
            goal = self.__goal.build(ud) if kept is None else None  # may block in a callback
            client = self.__get_client()
            if kept is None and answer_preempt(self):
                return None
            own = self._smachpy.options.preempt_timeout
            grace = _shorter(inherited_grace(current_frame())) if own == "inherit" else own
            wait_s = self.__server_wait_s
            wait_s = None if wait_s is None else max(wait_s, SHORTEST_ACK_S)
            run = GoalRun(accept_timeout=wait_s, exec_timeout=self.__exec_s, preempt_timeout=grace)
            wanted = self.__feedback_cb is not None or self.__feedback_key is not None

            def is_asked() -> bool:
                # A request of `exec_timeout` alone is not a preempt: its outcome is 'aborted'.
                return self._preempt_requested and (limit is None or not limit.is_alone())

            exchange = GoalFollower(
                client,
                wake,
                current_scope(),
                run,
                is_asked,
                on_late=None if limit is None else limit.over,
                wants_feedback=wanted,
                frame=frame,
            )
            self.__exchange = exchange
            forget = on_preempt(self, exchange.hurry)
            try:
                if kept is None:
                    exchange.send(
                        goal,
                        ack_timeout=wait_s,
                        cancel_on_client_lost=self.__cancel_on_client_lost,
                    )
                else:
                    exchange.adopt(kept, ack_timeout=wait_s)
                self._smachpy_goal_sent()
                if not run.status:  # else it had ended in the earlier process
                    exchange.follow(lambda feedback: self.__on_feedback(ud, feedback))
            except BaseException as error:
                # Nobody waits for the goal now. In a durable run it goes on if the process is
                # ending (KeyboardInterrupt, SystemExit): the next process follows it.
                if frame is None or not frame.run.journal.is_durable or _is_of_run(error):
                    exchange.cancel()
                raise
            finally:
                forget()
                exchange.close()
            # The rest of `exec_timeout` is for `result_cb`.
            if limit is not None and self.__exec_s is not None and not run.preempted:
                limit.start(min(self.__exec_s, run.left(wake.clock.now())))
        return exchange

    def _smachpy_goal_sent(self) -> None:
        """Do nothing; overridden by states that send more about their goal."""

    def _smachpy_grace(self, inherited: Grace) -> Grace:
        own: Grace = self._smachpy.options.preempt_timeout
        if own == "inherit":
            goal = _shorter(inherited)
            return goal + (MARGIN_S if goal == DEFAULT_PREEMPT_S else INHERITED_MARGIN_S)
        return None if own is None else float(own) + MARGIN_S

    def __get_client(self) -> ActionClient[Any]:
        """Return the client on the node, which all states of the action share."""
        node = self.__node if self.__node is not None else get_node()
        action = self.__types.action
        key = ("action client", node.resolve(self.__action_name, "action name"), action)
        return node.shared(key, lambda: ActionClient(self.__action_name, action, node=node))

    def __on_feedback(self, ud: Any, feedback: Any) -> None:
        if self.__feedback_key is not None:
            ud[self.__feedback_key] = feedback
        if self.__feedback_cb is not None:
            self.__feedback_cb(ud, feedback)

    def __finish(self, ud: Any, exchange: GoalFollower) -> str:
        """Store the result and choose the outcome."""
        run, result = exchange.run, exchange.result
        # Otherwise the goal ended by itself first: the request stays, and the machine ends by it.
        if run.outcome == PREEMPTED:
            self.service_preempt()
        if result is not None:
            self.__result.store(ud, result)
        if run.outcome == ABORTED or run.abandoned:
            log.logwarn(self.__explain(exchange))
        status = getattr(GoalStatus, run.status)
        chosen = self.__result.callback(
            ud, status, self.__types.result() if result is None else result
        )
        return run.outcome if chosen is None else chosen

    def __explain(self, exchange: GoalFollower) -> str:
        run, scope = exchange.run, current_scope()
        where = f"{type(self).__name__} {self.__action_name!r}" if scope is None else scope.path
        text = f"{where}: goal {exchange.goal_id} on '{self.__action_name}': {run.reason}"
        if run.abandoned:
            return f"{text}. It was abandoned and may still run."
        if exchange.lost_link:
            return text
        if exchange.unanswered and exchange.adopted:
            return (
                f"{text}. An earlier process had sent it. Try idempotent=True where a goal that "
                "may have run can be sent anew, or resume= where the state is to decide."
            )
        if exchange.unanswered:
            name = self.__types.action._type
            return (
                f"{text}. Try starting an action server of type {name} on '{self.__action_name}'; "
                "`actionlib list -t` shows those that run."
            )
        return text

    # -- for pictures and for SMACH ------------------------------------------------------------

    def __get_status(self) -> int:
        """Return the constant of the present status."""
        constants, exchange = SimpleActionState, self.__exchange
        if exchange is None:
            return constants.INACTIVE
        if exchange.run.status:
            return constants.COMPLETED
        if exchange.run.cancelling:
            return constants.PREEMPTING
        return constants.ACTIVE if exchange.accepted else constants.WAITING_FOR_SERVER

    _status = Shown(__get_status)

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the action and the timeouts."""
        kind, details = super().describe_details()
        own = [("action", self.__action_name), ("type", str(self.__types.action._type))]
        grace = self._smachpy.options.preempt_timeout
        for name, seconds in (
            ("exec_timeout", self.__exec_s),
            ("preempt_timeout", DEFAULT_PREEMPT_S if grace == "inherit" else grace),
            ("server_wait_timeout", self.__server_wait_s),
        ):
            if seconds is not None:
                own.append((name, f"{seconds:g} s"))
        return kind, (*own, *details)


def _is_of_run(error: BaseException) -> bool:
    """Return whether an exception ends the state, and not the process."""
    return isinstance(error, (Exception, Interruption))


def _shorter(inherited: Grace) -> float:
    """Return the shorter one of the default and the containers' grace."""
    if inherited is None or isinstance(inherited, str):
        return DEFAULT_PREEMPT_S
    return min(DEFAULT_PREEMPT_S, inherited)
