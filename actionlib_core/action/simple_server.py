"""`SimpleActionServer`: one goal at a time, run by one callback."""

from __future__ import annotations

import contextlib
import logging
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core.action.goal_keeper import TEXT_STOPPED, OnClientLost
from actionlib_core.action.server import STOP_GRACE_S, ActionServer, OnRestart
from actionlib_core.exceptions import (
    ActionException,
    IllegalTransitionError,
    InvalidNameError,
    text_of,
)
from actionlib_core.goal.server import RESULT_TIMEOUT_S
from actionlib_core.goal.single import ANNOUNCE, Decision, Policy, SingleGoal
from actionlib_core.goal.states import TERMINAL, Status
from actionlib_core.inputs.arguments import check_delay, check_function
from actionlib_core.names import check_name
from actionlib_core.resources import (
    POLICIES,
    CircleError,
    Claim,
    around_sender,
    inside,
    resources_on,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from actionlib_core.action._action_spec import ActionSpec as Spec
    from actionlib_core.action.server import ServerGoalHandle
    from actionlib_core.clock import Event, Task
    from actionlib_core.node import Node
    from actionlib_core.resources import Policy as ResourcePolicy
    from actionlib_core.time import Duration

G = TypeVar("G")
R = TypeVar("R")
F = TypeVar("F")

log = logging.getLogger(__name__)

LINGER_S = 0.1  # the thread that runs goals waits for the next goal before it ends

TEXT_ACCEPTED = "This goal has been accepted by the simple action server"
TEXT_NEWER = "This goal was canceled because another goal was received by the simple action server"
TEXT_CANCELLED_WAITING = "This goal was canceled before it was started"
TEXT_BUSY = "This goal was rejected because the simple action server is busy"
TEXT_NO_STATUS = "No terminal state was set."


class SimpleActionServer:
    """Offers an action whose goals run one at a time.

    For programs with actionlib's names; others: docs/howto/which_way.md.

    With `execute_cb`, each goal is run by calling it, in a thread that exists only while there are
    goals. Without, register a goal callback and call `accept_new_goal` yourself.

    Args:
        name: The action's name.
        ActionSpec: The action class (XAction).
        execute_cb: Called with the goal message (XGoal); it must call `set_succeeded`,
            `set_aborted` or `set_preempted` before it returns. As in ROS, the goal is accepted
            before the call, so it can be aborted but no longer rejected; `server` offers both.
        auto_start: Start at once; a goal may then come before the constructor has returned. When
            the callback uses the server, pass False and call `start` afterwards.
        node: The server's node; None: the current node.
        policy: The effect of a new goal while one runs: "preempt" asks the running one to stop, as
            in ROS; with "queue" the new goal waits; with "reject" it is rejected.
        on_client_lost: What happens to the goal of a client that died: "continue" as in ROS, or
            "cancel", as if the client had cancelled it.
        result_timeout: How long a result waits for a client that lost its link [s]; 0 or more.
        durable: A file in which goals and results survive the end of the process; see
            `ActionServer`.
        on_restart: With `durable`, what happens to a goal that ran when the process was killed:
            "abort" ends it ABORTED, with the reason; "resume" runs it again (see `is_resumed`).
        resource: What a goal needs for itself while it runs, such as the base of the robot: a name,
            or a tuple of name and policy. While another server or state of this process holds it,
            the goal waits, not yet accepted ("wait"), the holder is asked to stop ("preempt"), or
            the goal is rejected ("refuse"). See docs/resources.md.

    Attributes:
        action_server: The `ActionServer` beneath.
        execute_callback: `execute_cb`.

    Raises:
        ActionException: `ActionSpec` is not an action class, or `resource` is wrong or without an
            `execute_cb`.
        ActionlibError: a callback is not a function, or `result_timeout` is not a duration.
        InvalidNameError: the name breaks the ROS rules.
        ServerConflictError: the name has a server already (from `start`).
        TransportError: the network session is closed.

    Threads: every method may be called from any thread and any callback. User callbacks run
        without any lock.
    """

    _accepts = True  # goals are accepted before they run

    def __init__(
        self,
        name: str,
        ActionSpec: type[Spec[G, R, F]],  # noqa: N803  actionlib's name
        execute_cb: Callable[[G], object] | None = None,
        auto_start: bool = True,
        *,
        node: Node | None = None,
        policy: Policy = "preempt",
        on_client_lost: OnClientLost = "continue",
        result_timeout: float | Duration = RESULT_TIMEOUT_S,
        durable: str | Path | None = None,
        on_restart: OnRestart = "abort",
        resource: str | tuple[str, ResourcePolicy] | None = None,
    ) -> None:
        check_function(f"action {name!r}", "execute_cb", execute_cb)
        self.execute_callback = execute_cb
        needed = _resource(f"action {name!r}", resource, execute_cb)
        self.goal_callback: Callable[[], object] | None = None
        self.preempt_callback: Callable[[], object] | None = None
        # The lock guards these. Reading one attribute of `_policy` is atomic and needs no lock.
        self._policy: SingleGoal[ServerGoalHandle] = SingleGoal(policy)
        self._task: Task | None = None  # the thread that runs goals, None while there is none
        self._idle = False  # it waits for `_come`
        self._stopping = False
        self._making = auto_start
        self._early: set[str] = set()  # ids of goals that came before the constructor had returned
        self._grace_ends: float | None = None
        # Our two callbacks return at once, so they may be called directly on the network's thread,
        # which saves each goal a change of threads.
        self.action_server = ActionServer(
            name,
            ActionSpec,
            self.internal_goal_callback,
            self.internal_preempt_callback,
            False,  # noqa: FBT003  actionlib's flag
            node=node,
            on_client_lost=on_client_lost,
            result_timeout=result_timeout,
            direct=True,
            on_stopped=self._ask_to_stop,
            durable=durable,
            on_restart=on_restart,
        )
        self._keeper = self.action_server.keeper
        self._clock = self.action_server.node.clock
        self.lock = self.action_server.lock
        self._name = self.action_server.ns
        self._queue = self.action_server.callback_queue
        # Starts the thread that runs goals, with the server's clock and node as the current ones.
        self._start: Callable[[], Task] = partial(
            self._queue.context.copy().run,
            partial(self._clock.spawn, self.executeLoop, name=f"{self._name} execute"),
        )
        self._come: Event = self._clock.event(f"a goal for {self._name}")
        self._preempted: Event = self._clock.event()
        self._heard: Event = self._clock.event()  # the preempt callback, of a stop
        node = self.action_server.node
        self._resource = needed and (node.resolve(needed[0], "resource"), needed[1])
        self._claim: Claim | None = None  # of the current goal
        self._forget: Callable[[], None] | None = None
        if auto_start:
            self.start()
            self._making = False

    # -- life ----------------------------------------------------------------------------------

    def start(self) -> None:
        """Offer the action; a second call does nothing.

        Raises:
            ServerConflictError: the name has a server already.
            TransportError: the network session is closed.
            ActionException: the server was stopped.

        Blocks: until the network has listed the servers of the name, 1 s at most.
        """
        self.action_server.start()
        with self.lock:
            if self._forget is None:
                node = self.action_server.node
                self._forget = node.on_close(self.stop, ask=self._begin_to_stop)

    def stop(self) -> None:
        """Ask the running goal to stop, end all goals, and withdraw from the network.

        A second call does nothing, nor does one before `start`. A stopped server cannot be started
        again.

        Blocks: until `execute_cb`, or else the preempt callback, has returned, 0.4 s at most (then
            a goal that has not ended is ABORTED), and then until the clients have acknowledged the
            ends of all goals, 0.7 s at most.
        """
        forget, self._forget = self._forget, None
        if forget is None:
            return
        forget()
        task = self._task  # read before it is asked to stop: it then resets `_task`
        try:
            grace_ends = self._begin_to_stop()
            if task is not None:
                task.join(max(0.0, grace_ends - self._clock.now()))
            elif self._policy.preempt_requested and self.preempt_callback is not None:
                self._heard.wait(max(0.0, grace_ends - self._clock.now()))
        finally:
            self.action_server.stop()

    def _begin_to_stop(self) -> float:
        """Ask all goals to end; return the end of their grace [s, clock].

        A node that closes calls this for all its servers first, so that they share one grace.
        """
        if self._grace_ends is None:
            self._grace_ends = self._clock.now() + STOP_GRACE_S
            self._keeper.close_to_goals()
            self._ask_to_stop()
        return self._grace_ends

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the server has stopped; for programs that do nothing else.

        Returns:
            Whether it has stopped.

        Raises:
            ServerConflictError: it stopped because an older server has the name.

        Blocks: until then, `timeout` [s] at most; None: no limit.
        """
        return self.action_server.wait(timeout)

    def _ask_to_stop(self) -> None:
        with self.lock:
            if self._stopping:  # once: a second request would end what the first has led to
                return
            self._stopping = True
            waiting = self._policy.on_stop()
            if self._idle:
                self._come.set()
            self._tell_preempt()  # also wakes code that waits for a preempt without a running goal
        self._carry_out(Decision(preempt=self._policy.preempt_requested), TEXT_STOPPED)
        for handle in waiting:
            self._keeper.give_up(handle, TEXT_STOPPED)

    # -- goals ---------------------------------------------------------------------------------

    @property
    def current_goal(self) -> ServerGoalHandle | None:
        """The goal that was accepted last."""
        return self._policy.current

    @property
    def next_goal(self) -> ServerGoalHandle | None:
        """The goal that waits to be accepted next."""
        return self._policy.next

    @property
    def preempt_request(self) -> bool:
        """Whether the current goal is asked to stop."""
        return self._policy.preempt_requested

    def accept_new_goal(self) -> Any:
        """Accept the waiting goal; a goal that still runs becomes PREEMPTED.

        Returns:
            The goal message; None when no goal waits (check `is_new_goal_available` before).
        """
        new = self._take_next()
        if new is None:
            log.error(
                "action '%s': accept_new_goal(): no goal waits. Try is_new_goal_available().",
                self._name,
            )
            return None
        new.set_accepted(TEXT_ACCEPTED)
        return new.get_goal()

    def _take_next(self) -> ServerGoalHandle | None:
        """Make the waiting goal the current one, not yet accepted; None when none waits."""
        with self.lock:
            new, replaced = self._policy.accept()
            if new is None:
                return None
            if self._policy.preempt_requested:
                self._tell_preempt()
            else:
                self._preempted.clear()  # it was for the goal before
        # Without the lock: sending the result blocks while a link is full.
        if replaced is not None:
            with contextlib.suppress(IllegalTransitionError):  # its own code has just ended it
                replaced.set_canceled(None, TEXT_NEWER)
        return new

    def is_new_goal_available(self) -> bool:
        """Return whether a goal waits to be accepted."""
        return bool(self._policy.waiting)

    def is_preempt_requested(self) -> bool:
        """Return whether the current goal is asked to stop, by a cancel or a newer goal."""
        return self._policy.preempt_requested

    def wait_preempt(self, timeout: float | None = None) -> bool:
        """Wait until the current goal is asked to stop.

        Args:
            timeout: Longest wait [s]; None: no limit; a negative time: do not wait.

        Returns:
            Whether it is asked to stop.

        Raises:
            InvalidDurationError: `timeout` is not a duration.

        Blocks: until then.
        """
        limit = check_delay(f"action '{self._name}'", "timeout", timeout)
        if not self._preempted.is_set():
            # The goal will run for some time, so its acceptance need not wait to share a list.
            self._keeper.status.hurry()
        return self._preempted.wait(limit)

    def is_active(self) -> bool:
        """Return whether a goal was accepted and has not ended."""
        goal = self._policy.current
        if goal is None:
            return False
        return goal.record.status in {Status.ACTIVE, Status.PREEMPTING}

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the current goal in success.

        Args:
            result: The result message (XResult); None sends one with default values.
            text: The reason, for people.

        Raises:
            IllegalTransitionError: the goal has ended already.
            ActionException: no goal was accepted, `result` is not of the action's type, or `text`
                is not a string. The goal's status does not change.
            FieldError: a field of `result` has a wrong type.
        """
        self._end("set_succeeded()", "succeed", result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the current goal in failure; see `set_succeeded`."""
        self._end("set_aborted()", "abort", result, text)

    def set_preempted(self, result: Any = None, text: str = "") -> None:
        """End the current goal because it was asked to stop; see `set_succeeded`."""
        self._end("set_preempted()", "cancel", result, text)

    def set_rejected(self, result: Any = None, text: str = "") -> None:
        """Reject the goal that waits; see `set_succeeded`.

        For goal callbacks: the goal of `execute_cb` is already accepted and can only be ended, for
        example with `set_aborted`.
        """
        with self.lock:
            handle = self._policy.withdraw()
        if handle is None and self.execute_callback is not None:
            raise ActionException(
                f"action '{self._name}': set_rejected(): the goal that runs is accepted already; "
                "expected one that waits. Try set_aborted(), or @server, whose function may raise "
                "Reject."
            )
        if handle is None:
            raise ActionException(
                f"action '{self._name}': set_rejected(): got no waiting goal; expected one. Try "
                "calling it from the goal callback, before accept_new_goal()."
            )
        handle.set_rejected(result, text)

    def _end(self, call: str, event: str, result: Any, text: str) -> None:
        goal = self._policy.current
        if goal is None:
            raise ActionException(
                f"action '{self._name}': {call}: got no goal; expected one that was accepted."
            )
        self._keeper.step(goal, event, call, result, text)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback (XFeedback) to the current goal's client.

        Raises:
            ActionException: no goal was accepted, or `feedback` is not of the action's type.
            FieldError: a field of `feedback` has a wrong type.
        """
        goal = self._policy.current
        if goal is None:
            raise ActionException(
                f"action '{self._name}': publish_feedback(): got no goal; expected one that was "
                "accepted."
            )
        goal.publish_feedback(feedback)

    def is_resumed(self) -> bool:
        """Return whether an earlier process had already accepted the current goal."""
        goal = self._policy.current
        return goal is not None and goal.resumed

    def get_default_result(self) -> Any:
        """Return a new result message with default values."""
        return self.action_server.ActionResultType()

    def register_goal_callback(self, cb: Callable[[], object] | None) -> None:
        """Call `cb` when a new goal waits to be accepted.

        Raises:
            ActionException: the server has an `execute_cb`, which runs the goals.
        """
        if self.execute_callback is not None and cb is not None:
            raise ActionException(
                f"action '{self._name}': register_goal_callback(): got a callback beside "
                "execute_cb; expected one of the two."
            )
        check_function(f"action '{self._name}'", "cb", cb)
        self.goal_callback = cb

    def register_preempt_callback(self, cb: Callable[[], object] | None) -> None:
        """Call `cb` when the current goal is asked to stop."""
        check_function(f"action '{self._name}'", "cb", cb)
        self.preempt_callback = cb

    # -- messages (on the network's thread) ----------------------------------------------------

    def internal_goal_callback(self, goal: ServerGoalHandle) -> None:
        """Handle a new goal; called by the `ActionServer` beneath."""
        refused = ""
        with self.lock:
            if self._stopping:
                refused = TEXT_STOPPED
            else:
                try:
                    decision = self._admit(goal)
                except RuntimeError as error:  # no thread can be started, the system's limit
                    self._policy.on_cancel(goal, recall_waiting=True)
                    refused = f"The goal cannot run: {error}"
                current = self._policy.current
                waits = self._policy.running or self.execute_callback is None
        if refused:
            self._turn_away(goal, "reject", refused)
            return
        if decision.preempt and current is not None:
            self._keeper.note_superseded(current.record)
        if waits:  # else its acceptance, which follows at once, tells the client that it has come
            self._keeper.status.on_arrival()
        # Without the lock, as this sends results. The usual decision needs nothing more.
        if decision is not ANNOUNCE or self.goal_callback is not None:
            self._carry_out(decision, TEXT_NEWER)

    def _admit(self, goal: ServerGoalHandle) -> Decision[ServerGoalHandle]:
        """Decide about a new goal, and see to it that it runs; with the lock held."""
        decision = self._policy.on_goal(goal, recall_waiting=self.execute_callback is not None)
        if decision.preempt:  # under the lock, as `_take_next` clears it for the next goal
            self._tell_preempt()
        if self._making:
            self._early.add(goal.record.id)
        # Wake the thread that runs goals, or start one. A busy thread looks for the next goal by
        # itself.
        if decision.announce and self._idle:
            self._come.set()
        elif decision.announce and self.execute_callback is not None and self._task is None:
            self._task = self._start()
        return decision

    def internal_preempt_callback(self, preempt: ServerGoalHandle) -> None:
        """Handle a cancel; called by the `ActionServer` beneath."""
        with self.lock:
            goal = self._policy.find(preempt)
            decision = self._policy.on_cancel(
                goal, recall_waiting=self.execute_callback is not None
            )
            if decision.preempt:
                self._tell_preempt()
        self._carry_out(decision, TEXT_CANCELLED_WAITING)

    def _tell_preempt(self) -> None:
        """Wake the code of the running goal, which is asked to stop. Must not block."""
        self._preempted.set()
        if self._claim is not None:
            self._claim.wake.set()

    def _carry_out(self, decision: Decision[ServerGoalHandle], text: str) -> None:
        for older in decision.recall:
            self._turn_away(older, "cancel", text)
        if decision.reject is not None:
            self._turn_away(decision.reject, "reject", TEXT_BUSY)
        if decision.preempt and self.preempt_callback is not None:
            self._queue.call_urgently(self._call_preempt_callback)
        if decision.announce and self.goal_callback is not None:
            self._queue.call(self._call_goal_callback)

    def _turn_away(self, goal: ServerGoalHandle, event: str, text: str) -> None:
        """End a goal that never started. Does not wait for a link, as on the network's thread."""
        self._keeper.step(
            goal, event, f"the policy {self._policy.policy!r}", None, text, wait=False
        )

    # In ROS these two run as the message arrives. Here they are queued, so what they report may be
    # out of date: another callback may have accepted or ended the goal.

    def _call_preempt_callback(self) -> None:
        callback, goal = self.preempt_callback, self._policy.current
        over = goal is None or goal.record.status in TERMINAL
        try:
            if callback is not None and self._policy.preempt_requested and not over:
                callback()
        finally:
            if self._stopping:
                self._heard.set()

    def _call_goal_callback(self) -> None:
        callback = self.goal_callback
        if callback is not None and self._policy.waiting:
            callback()

    # -- execution -----------------------------------------------------------------------------

    def executeLoop(self) -> None:  # noqa: N802  actionlib's name
        """Run the waiting goals, until none has come for `LINGER_S`."""
        try:
            while self._wait_for_goal():
                self._run_next()
        except BaseException:  # `sys.exit` in a callback ends only this thread; start another
            with self.lock:
                self._task, self._idle = None, False
                if self._policy.waiting:
                    self._task = self._start()
            raise

    def _wait_for_goal(self) -> bool:
        """Wait for the next goal; False when the thread is to end.

        Blocks: until then, `LINGER_S` at most.
        """
        with self.lock:
            self._idle = not self._policy.waiting
            if not self._idle:
                return True
            self._come.clear()  # a goal that comes from now on finds `_idle` true and sets it
        come = not self._stopping and self._come.wait(LINGER_S)
        with self.lock:
            self._idle = False
            if come or (self._policy.waiting and not self._stopping):
                return True
            self._task = None  # under the lock: the next goal starts another thread
        return False

    def _run_next(self) -> None:
        """Run the next goal, if there is one, when it has its resource."""
        handle = self._take_next()
        if handle is None:
            return
        if self._resource is None:
            self._run(handle)
            return
        claim = self._claim_of(handle, *self._resource)
        held = resources_on(self._clock)
        try:
            if self._take(handle, claim):
                with inside(claim):
                    self._run(handle)
        finally:
            self._claim = None
            held.release(claim)

    def _claim_of(self, handle: ServerGoalHandle, name: str, policy: ResourcePolicy) -> Claim:
        who = f"goal {handle.record.id} of action '{self._name}'"

        def stop(taker: Claim) -> None:
            log.info("%s is asked to stop: %s takes %s", who, taker.who(), name)
            self._keeper.note_superseded(handle.record)
            self.internal_preempt_callback(handle)

        around = (handle, *around_sender(handle.record.id))
        return Claim(
            name, policy, around, lambda: who, stop, self._clock.event(f"{name}, for {who}")
        )

    def _take(self, handle: ServerGoalHandle, claim: Claim) -> bool:
        """Take the resource for a goal; return whether it has it. Otherwise the goal has ended.

        Blocks: until the resource is free, or the goal is asked to stop.
        """
        self._claim = claim
        held = resources_on(self._clock)
        try:
            holder = held.claim(claim)
        except CircleError as error:  # through what its sender holds
            self._turn_away(handle, "reject", str(error))
            return False
        if holder is None:
            return True
        by = holder.who()
        if claim.policy == "refuse":
            self._turn_away(handle, "reject", f"{by} holds {claim.resource}")
            return False
        log.info("%s waits for %s, held by %s", claim.who(), claim.resource, by)
        # The client learns that the goal has come, as its acceptance will take some time.
        self._keeper.status.on_arrival()
        if claim.policy == "preempt":
            holder.stop(claim)
        if not self._policy.preempt_requested:
            claim.wake.wait()
        if self._stopping:
            self._keeper.give_up(handle, TEXT_STOPPED)
        elif self._policy.preempt_requested:
            text = f"{TEXT_CANCELLED_WAITING}: {by} held {claim.resource}"
            self._turn_away(handle, "cancel", text)
        else:
            return True
        return False

    def _run(self, handle: ServerGoalHandle) -> None:
        """Run a goal, and make sure that it ends."""
        # As in ROS: accepted before the call. (`@server` accepts later.)
        if self._accepts:
            self._keeper.step(handle, "accept", "set_accepted()", text=TEXT_ACCEPTED)
        text = TEXT_NO_STATUS
        try:
            self._execute(handle)
        except Exception as error:  # noqa: BLE001  user code: sent to the client and logged
            if handle.record.text == TEXT_STOPPED:
                return  # `stop` has ended the goal; the callback's own attempt has then failed
            text = self._report(handle, error)
        except BaseException as error:
            text = text_of(error, repr)
            self._keeper.give_up(handle, f"Exception in execute callback: {text}")
            raise
        if handle.record.status not in TERMINAL:
            if text is TEXT_NO_STATUS:  # not every wire takes the text to the client
                log.error(
                    "action '%s': the execute callback has returned without a terminal state; the "
                    "goal is aborted. Try set_succeeded(), set_aborted() or set_preempted() in it.",
                    self._name,
                )
            self._keeper.give_up(handle, text)

    def _execute(self, handle: ServerGoalHandle) -> None:
        if self.execute_callback is not None:
            self.execute_callback(handle.content)

    def _report(self, handle: ServerGoalHandle, error: Exception) -> str:
        hint = ""
        if handle.record.id in self._early:
            hint = (
                " (The goal came before the constructor of its server had returned: a callback "
                "that uses the server needs auto_start=False, and start() afterwards.)"
            )
        log.error("action '%s': exception in execute callback%s", self._name, hint, exc_info=error)
        return f"Exception in execute callback: {text_of(error)}{hint}"


def _resource(where: str, given: object, execute_cb: object) -> tuple[str, ResourcePolicy] | None:
    """Return the name and the policy of a resource that the program gave.

    Raises:
        ActionException: they are wrong, or nothing runs goals that could hold it.
    """
    if given is None:
        return None
    name, policy = given if isinstance(given, tuple) and len(given) == 2 else (given, "wait")  # noqa: PLR2004
    if not isinstance(name, str) or policy not in POLICIES:
        raise ActionException(
            f"{where}: resource: got {given!r}; expected a name, or (name, policy) with one of "
            f"{list(POLICIES)}."
        )
    try:
        check_name(name, "resource")
    except InvalidNameError as error:
        raise ActionException(f"{where}: {error}") from error
    if execute_cb is None:
        raise ActionException(
            f"{where}: resource: got {name!r} without execute_cb; expected one, which holds the "
            "resource while it runs."
        )
    return name, policy
