"""`SimpleActionState`: a state that sends a goal to an action server and waits for its end."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, ClassVar, TypedDict

from actionlib_core.action.client import ActionClient
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.node import get_node
from actionlib_core.wire.action_types import ActionTypes
from smachpy import log
from smachpy.actions.goal_run import ABORTED, OUTCOMES, PREEMPTED, STOPPED, GoalExchange, GoalRun
from smachpy.actions.interface import adopt_interface
from smachpy.actions.messages import Incoming, Outgoing, UserCallback
from smachpy.actions.wakeup import Wakeup
from smachpy.context import current_frame
from smachpy.machines.problems import Problems
from smachpy.machines.state import Shown, State, get_options
from smachpy.run.frame import current_scope
from smachpy.run.grace import inherited_grace, on_preempt
from smachpy.run.interrupt import Interruption
from smachpy.run.step import Timeout

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Unpack

    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from smachpy.introspection import Kind
    from smachpy.machines.state import Grace, RetrySpec
    from smachpy.run.frame import Frame

__all__ = ["ActionStateOptions", "SimpleActionState"]

SHORTEST_ACK_S = 1.0
"""A server that is there is given this long to answer, however short `server_wait_timeout` is."""

ASKED_AGAIN_S = 5.0
"""After a resume, what had asked a state to stop has this long to ask again [s]."""

MARGIN_S = 5.0
INHERITED_MARGIN_S = 1.0
"""The machine leaves the state's thread behind only so long after the goal was abandoned [s].

That is for callbacks that hang; the goal is abandoned, and the state ends, without it. The second
holds when the grace is a container's, which is to be exceeded by little.
"""

DEFAULT_PREEMPT_S = float("60")
"""Told from a 60.0 of the caller by its identity: that one is more than a default."""


class ActionStateOptions(TypedDict, total=False):
    """`StateOptions` without `preempt_timeout`, which is an argument here."""

    timeout: float | None
    timeout_outcome: str
    retry: RetrySpec
    on_exception: Mapping[type[BaseException], str] | None
    on_enter: Callable[[Any], object] | None
    on_exit: Callable[[Any, str], object] | None
    resume: str | Callable[[Any], str | None] | None
    on_resume: Callable[[Any], object] | None
    idempotent: bool


class SimpleActionState(State):
    """Sends a goal and waits for its end. Outcomes: 'succeeded', 'aborted', 'preempted'.

    The goal is made of `goal` or `goal_key`, then `goal_slots`, then `goal_cb`, anew for each run.
    All callbacks run in the thread that runs the state, hold no lock, and may raise: a goal that is
    under way is cancelled first.

    'preempted' answers a preempt of this state: a goal that somebody else stopped is 'aborted', as
    is one that the server aborted, rejected or lost. The reason is logged and in the event
    `smachpy.events.GoalDone`.

    Args:
        action_name: Name of the action.
        action_spec: Its class (XAction).
        goal: The goal (XGoal), or what the slots and the callback begin with.
        goal_key: Userdata key that holds the goal.
        goal_slots: Names of goal fields that are set from userdata keys of the same name.
        goal_cb: Called as `goal_cb(userdata, goal, *goal_cb_args, **goal_cb_kwargs)`; changes the
            goal or returns another. Its `cb_interface` is added, as those of the other callbacks.
        goal_cb_args: Arguments for it.
        goal_cb_kwargs: Keyword arguments for it.
        result_key: Userdata key that gets the result (XResult), if one came.
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
        exec_timeout: A goal that has not ended so long [s] after a server took it is cancelled, and
            the outcome is 'aborted'; None: no limit. A callback that still runs `preempt_timeout`
            and a few seconds later is interrupted (docs/preemption.md), with that outcome too.
        preempt_timeout: A cancelled goal that has not ended after so long [s] is abandoned and
            reported; it may still run on the server. None: no limit. Left out, a container's
            `preempt_timeout` holds if it is shorter.
        server_wait_timeout: 'aborted' when no server has taken the goal after so long [s]; None: no
            limit. Under one second counts as one second.
        feedback_cb: Called as `feedback_cb(userdata, feedback)` for each XFeedback. While it runs,
            a preempt and `exec_timeout` cancel the goal all the same. When it is slower than the
            feedback, up to 100,000 messages wait and the oldest are dropped; what still waits at
            the goal's end is dropped after a call that takes longer than 0.5 s or, when this state
            has cancelled the goal, after 0.2 s. The log says how many.
        feedback_key: Userdata key that gets each XFeedback.
        node: Where the client is; the current node when None.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        ActionException: `action_spec` is no action class.
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
        action_spec: Any,
        goal: Any = None,
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
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        outcomes: Iterable[str] = (),
        exec_timeout: float | Duration | None = None,
        preempt_timeout: float | Duration | None = DEFAULT_PREEMPT_S,
        server_wait_timeout: float | Duration | None = 60.0,
        *,
        feedback_cb: Callable[[Any, Any], object] | None = None,
        feedback_key: str | None = None,
        node: Node | None = None,
        **options: Unpack[ActionStateOptions],
    ) -> None:
        problems = Problems(f"{type(self).__name__} {action_name!r}")
        given = (*OUTCOMES, *problems.names("outcomes", outcomes))
        with problems:
            super().__init__(given, input_keys, output_keys, **options)
        self.__action_name = problems.word("action_name", action_name)
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
        self.__exec_s = problems.seconds("exec_timeout", exec_timeout)
        self.__server_wait_s = problems.seconds("server_wait_timeout", server_wait_timeout)
        if preempt_timeout is not DEFAULT_PREEMPT_S:
            self._smachpy_set_options({"preempt_timeout": preempt_timeout}, problems)
        self.__node = node
        self.__exchange: GoalExchange | None = None
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

        What a callback raises goes through, once the goal has ended.

        Raises:
            FieldError: a field of the goal has a wrong type.
            TypeMismatchError: the action's server is of another type.

        Blocks: until the goal has ended: all three timeouts together at most; a preempt
            cancels the goal at once.
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
        """Do it; when `exec_timeout` is over while foreign code runs, `limit` is told."""
        frame: Frame | None = current_frame()
        journal = None if frame is None else frame.run.journal
        kept = None if journal is None or frame is None else journal.goal_of(frame)
        if kept is not None and frame is not None:
            outcome = self.__resume(ud, limit, frame, kept)
            if outcome is not None:
                return outcome
        exchange = self.__exchange_goal(ud, limit, frame, None)
        return PREEMPTED if exchange is None else self.__finish(ud, exchange)

    def __resume(self, ud: Any, limit: Timeout | None, frame: Frame, kept: Any) -> str | None:
        """Follow the goal that an earlier process has sent; None: a new one is to be sent."""
        journal = frame.run.journal
        assert journal is not None
        if kept.get("preempted") and not kept["stopped"]:
            # It had ended because its state was asked to stop. Who asked goes on, too, and asks
            # again: a concurrence, say, when all its children are back.
            State.wait_preempt(self, ASKED_AGAIN_S)
        exchange = self.__exchange_goal(ud, limit, frame, kept)
        assert exchange is not None
        status = exchange.run.status
        if kept["stopped"] and status in STOPPED and not self._preempt_requested:
            return None  # the end of that process had stopped it
        if not exchange.unanswered or kept["status"] or self._preempt_requested:
            return self.__finish(ud, exchange)
        exchange.call_off(kept["id"])
        options = get_options(self)
        if options.resume is not None:
            decided: str | None = journal.decide(frame, ud)
            return decided
        if options.idempotent or kept["taken_ns"] is None:
            return None
        return self.__finish(ud, exchange)

    def __exchange_goal(
        self, ud: Any, limit: Timeout | None, frame: Frame | None, kept: Any
    ) -> GoalExchange | None:
        """Send a goal, or follow the one that was `kept`, to its end; None: it was called off."""
        with Wakeup(self) as wake:
            if kept is None and self.__is_preempted():
                return None
            goal = self.__goal.build(ud) if kept is None else None
            client = self.__get_client()
            if kept is None and self.__is_preempted():
                return None
            own = self._smachpy.options.preempt_timeout
            grace = _shorter(inherited_grace(current_frame())) if own == "inherit" else own
            run = GoalRun(exec_timeout=self.__exec_s, preempt_timeout=grace)
            wanted = self.__feedback_cb is not None or self.__feedback_key is not None

            def is_asked() -> bool:
                return self._preempt_requested and (limit is None or not limit.is_alone())

            exchange = GoalExchange(
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
            wait_s = self.__server_wait_s
            wait_s = None if wait_s is None else max(wait_s, SHORTEST_ACK_S)
            try:
                if kept is None:
                    exchange.send(goal, ack_timeout=wait_s)
                else:
                    exchange.adopt(kept, ack_timeout=wait_s)
                if not run.status:  # else it had ended before the resume
                    exchange.follow(lambda feedback: self.__on_feedback(ud, feedback))
            except (
                BaseException
            ) as error:  # KeyboardInterrupt and the like: nobody waits for it now
                if frame is None or frame.run.journal is None or _is_of_run(error):
                    exchange.cancel()
                raise
            finally:
                forget()
                exchange.close()
            if limit is not None and not run.preempted:  # for `result_cb`
                limit.start(run.left(wake.clock.now()))
        return exchange

    def _smachpy_grace(self, inherited: Grace) -> Grace:
        own: Grace = self._smachpy.options.preempt_timeout
        if own == "inherit":
            goal = _shorter(inherited)
            return goal + (MARGIN_S if goal == DEFAULT_PREEMPT_S else INHERITED_MARGIN_S)
        return None if own is None else float(own) + MARGIN_S

    def __is_preempted(self) -> bool:
        if not self.preempt_requested():
            return False
        self.service_preempt()
        return True

    def __get_client(self) -> ActionClient[Any]:
        """Return the client on the node in force, which all states of the action share."""
        node = self.__node if self.__node is not None else get_node()
        action = self.__types.action
        key = ("action client", node.resolve(self.__action_name, "action name"), action)
        return node.shared(key, lambda: ActionClient(self.__action_name, action, node=node))

    def __on_feedback(self, ud: Any, feedback: Any) -> None:
        if self.__feedback_key is not None:
            ud[self.__feedback_key] = feedback
        if self.__feedback_cb is not None:
            self.__feedback_cb(ud, feedback)

    def __finish(self, ud: Any, exchange: GoalExchange) -> str:
        """Hand the result on and choose the outcome."""
        run, result = exchange.run, exchange.result
        if run.outcome == PREEMPTED:  # else the goal was done first, and the preempt is still due
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

    def __explain(self, exchange: GoalExchange) -> str:
        run, scope = exchange.run, current_scope()
        where = f"{type(self).__name__} {self.__action_name!r}" if scope is None else scope.path
        text = f"{where}: goal {exchange.goal_id} on '{self.__action_name}': {run.reason}"
        if run.abandoned:
            return f"{text}. It was abandoned and may still run."
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
        """Return which of the five constants holds."""
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
    """Tell whether an exception ends the state, not the process: goals may be followed later."""
    return isinstance(error, (Exception, Interruption))


def _shorter(inherited: Grace) -> float:
    """Return the shorter of the default and what the containers say."""
    if inherited is None or isinstance(inherited, str):
        return DEFAULT_PREEMPT_S
    return min(DEFAULT_PREEMPT_S, inherited)
