"""`ActionServerWrapper`: a machine offered as an action."""

from __future__ import annotations

import copy
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.goal.states import Status
from actionlib_core.wire.action_types import ActionTypes
from smachpy.base import log
from smachpy.base.problems import Problems
from smachpy.base.slips import accepts
from smachpy.engine.preempt import asking, request_soon
from smachpy.events import UserdataWritten
from smachpy.exceptions import did_you_mean
from smachpy.userdata.user_data import Remapper, UserData

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from actionlib_core.action.server import OnClientLost
    from actionlib_core.goal.single import Policy
    from actionlib_core.node import Node
    from smachpy.base.names import Names
    from smachpy.events import Event
    from smachpy.machines.container import Container

__all__ = ["ActionServerWrapper"]


class ActionServerWrapper:
    """Runs a container for each goal of an action. It is not a state itself.

    The way to offer a machine as an action; others: docs/howto/which_way.md.

    The goal is written to the userdata before a run, and the result is read from it afterwards.
    Feedback is sent whenever the container's feedback key, or a key of `feedback_slots_map`, is
    written, or has changed at a transition. A cancel or a newer goal preempts the container.

    Args:
        server_name: Name of the action.
        action_spec: Its class (XAction).
        wrapped_container: The container to run. It declares the keys below that it uses.
        succeeded_outcomes: Its outcomes that mean SUCCEEDED.
        aborted_outcomes: Its outcomes that mean ABORTED. An outcome in no list means ABORTED too,
            except 'preempted' if the goal was asked to stop: that means PREEMPTED.
        preempted_outcomes: Its outcomes that mean PREEMPTED.
        goal_key: Key that gets the goal (XGoal).
        feedback_key: Key of the feedback (XFeedback), which is empty at the start of each goal.
        result_key: Key of the result (XResult), which is empty at the start of each goal. So are
            the keys of the two maps below: each has the value that it had before the first goal.
        goal_slots_map: Field of the goal -> key that gets it.
        feedback_slots_map: Field of the feedback -> key from which it is read.
        result_slots_map: Field of the result -> key from which it is read. A key without a value
            is an error after one of `succeeded_outcomes`; else its field has its default value.
        expand_goal_slots: Write every field of the goal to the key of the same name.
        pack_result_slots: Read every field of the result from the key of the same name, if it has
            a value.
        node: Node of the server; None for the current node.
        policy: What happens to a new goal while one runs; see `SimpleActionServer`.
        on_client_lost: What happens to the goal of a client that died; see there, too.

    Attributes:
        wrapped_container: See above.
        userdata: The values from which input keys are copied and to which output keys are.

    Raises:
        ActionException: `action_spec` is not an action class.
        InvalidStateError: outcomes or fields do not exist or are listed twice, or an argument has
            a wrong type; all problems at once.

    Threads: the container runs in the server's thread, one goal after the other.
    """

    def __init__(
        self,
        server_name: str,
        action_spec: Any,
        wrapped_container: Container,
        succeeded_outcomes: Names = (),
        aborted_outcomes: Names = (),
        preempted_outcomes: Names = (),
        goal_key: str = "action_goal",
        feedback_key: str = "action_feedback",
        result_key: str = "action_result",
        goal_slots_map: Mapping[str, str] | None = None,
        feedback_slots_map: Mapping[str, str] | None = None,
        result_slots_map: Mapping[str, str] | None = None,
        expand_goal_slots: bool = False,
        pack_result_slots: bool = False,
        *,
        node: Node | None = None,
        policy: Policy = "preempt",
        on_client_lost: OnClientLost = "continue",
    ) -> None:
        problems = Problems(f"ActionServerWrapper {server_name!r}")
        problems.network_name("server_name", server_name)
        self.wrapped_container = wrapped_container
        self.userdata = UserData()
        self.__server_name = server_name
        self.__types = ActionTypes.of(action_spec)
        self.__outcomes = {
            "succeeded_outcomes": problems.names("succeeded_outcomes", succeeded_outcomes),
            "aborted_outcomes": problems.names("aborted_outcomes", aborted_outcomes),
            "preempted_outcomes": problems.names("preempted_outcomes", preempted_outcomes),
        }
        self.__goal_key = problems.word("goal_key", goal_key)
        self.__feedback_key = problems.word("feedback_key", feedback_key)
        self.__result_key = problems.word("result_key", result_key)
        holds = "field -> userdata key"
        self.__goal_slots_map = problems.names_of("goal_slots_map", goal_slots_map, holds)
        self.__feedback_slots_map = problems.names_of(
            "feedback_slots_map", feedback_slots_map, holds
        )
        self.__result_slots_map = problems.names_of("result_slots_map", result_slots_map, holds)
        self.__expand_goal_slots = expand_goal_slots
        self.__pack_result_slots = pack_result_slots
        if hasattr(wrapped_container, "register_transition_cb"):
            problems.add(*self.__outcome_problems())
        else:
            problems.add(f"wrapped_container: got {wrapped_container!r}; expected a container.")
        problems.add(*self.__slot_problems())
        problems.raise_all()
        self.__lock = threading.Lock()
        self.__executing = self.__stopped = False
        self.__feedback_sent = b""
        self.__before: list[tuple[UserData, dict[str, Any]]] = []
        self.__unsubscribe: Callable[[], None] | None = None
        self.__action_server = SimpleActionServer(
            server_name,
            action_spec,
            self.execute_cb,
            False,  # noqa: FBT003  actionlib's flag
            node=node,
            policy=policy,
            on_client_lost=on_client_lost,
        )
        wrapped_container.register_transition_cb(self.transition_cb)
        wrapped_container.register_termination_cb(self.termination_cb)

    def __outcome_problems(self) -> Iterator[str]:
        for problem in self.__outcome_slips():
            if not accepts(problem):
                yield problem

    def __outcome_slips(self) -> Iterator[str]:
        known = self.wrapped_container.get_registered_outcomes()
        listed: dict[str, str] = {}
        for name, outcomes in self.__outcomes.items():
            for outcome in outcomes:
                if outcome not in known:
                    yield (
                        f"{name}: got {outcome!r}; expected outcomes of the container: "
                        f"{sorted(known)}.{did_you_mean(outcome, known)}"
                    )
                if outcome in listed:
                    yield f"{name}: got {outcome!r}, which is in {listed[outcome]} too."
                listed[outcome] = name

    def __slot_problems(self) -> Iterator[str]:
        for name, slots, message in (
            ("goal_slots_map", self.__goal_slots_map, self.__types.goal),
            ("feedback_slots_map", self.__feedback_slots_map, self.__types.feedback),
            ("result_slots_map", self.__result_slots_map, self.__types.result),
        ):
            known = message.__slots__
            for slot in slots:
                if isinstance(slot, str) and slot not in known:
                    yield (
                        f"{name}: got field {slot!r}; expected fields of {message._type}: "
                        f"{list(known)}.{did_you_mean(slot, known)}"
                    )

    # -- start and stop ------------------------------------------------------------------------

    def run_server(self) -> None:
        """Start the server; its goals run in another thread.

        Raises:
            ServerConflictError: the name has a server already.

        Blocks: until the network has listed the servers of the name, 1 s at most.
        """
        if self.__unsubscribe is None:
            self.__unsubscribe = self.wrapped_container.subscribe(self.__on_event)
        self.__action_server.register_preempt_callback(self.preempt_cb)
        self.__action_server.start()
        log.loginfo(f"action server '{self.__server_name}' offers a machine")

    def stop(self) -> None:
        """Preempt the running goal and stop the server; may be called twice.

        Blocks: as `SimpleActionServer.stop`.
        """
        with self.__lock:  # asked once: a second request would end what the first has led to
            executing, self.__stopped = self.__executing and not self.__stopped, True
        if executing:
            with asking("action", self.__server_name, "the server stops"):
                request_soon(self.wrapped_container)
        self.__action_server.stop()
        if self.__unsubscribe is not None:
            self.__unsubscribe()
            self.__unsubscribe = None

    # -- goals ---------------------------------------------------------------------------------

    def execute_cb(self, goal: Any) -> None:
        """Run the container for `goal`; the action server calls it.

        An exception of the container is passed on; the server then answers ABORTED with its text.

        Blocks: until the container has ended.
        """
        server = self.__action_server
        # Under the lock, so that `preempt_cb` either finds the goal executing or is seen here.
        with self.__lock:
            if server.is_preempt_requested():
                early = True
            else:
                early, self.__executing = False, True
        if early:
            server.set_preempted(None, "preempted before it began")
            return
        try:
            outcome = self.__run(goal)
        finally:
            with self.__lock:  # a late preempt must not hit the next goal
                self.__executing = False
                self.wrapped_container.recall_preempt()
        succeeded = outcome in self.__outcomes["succeeded_outcomes"]
        result = self.__make_result(complete=succeeded)
        text = f"the machine ended with {outcome!r}"
        if succeeded:
            server.set_succeeded(result, text)
        elif self.__means_preempted(outcome):
            server.set_preempted(result, text)
        else:
            server.set_aborted(result, text)

    def __means_preempted(self, outcome: str) -> bool:
        """Return whether to answer PREEMPTED with this outcome; see `aborted_outcomes`."""
        if outcome in self.__outcomes["preempted_outcomes"]:
            return True
        asked = outcome == "preempted" and self.__action_server.is_preempt_requested()
        return asked and outcome not in self.__outcomes["aborted_outcomes"]

    def __run(self, goal: Any) -> str:
        container = self.wrapped_container
        inputs = container.get_registered_input_keys()
        outputs = container.get_registered_output_keys()
        self.__forget_former_goal()
        self.__fill_userdata(goal)
        for key in (self.__feedback_key, self.__result_key):
            if key in outputs or _is_used(container, key):
                container.userdata[key] = self.userdata[key]
        self.__feedback_sent = self.userdata[self.__feedback_key].to_bytes()
        return container.execute(Remapper(self.userdata, inputs, outputs))

    def __forget_former_goal(self) -> None:
        """Give the keys of feedback and result the values that they had before the first goal."""
        keys = {*self.__feedback_slots_map.values(), *self.__result_slots_map.values()}
        if self.__pack_result_slots:
            keys.update(self.__types.result.__slots__)
        if not self.__before:
            for userdata in (self.userdata, self.wrapped_container.userdata):
                had = {key: _copied(userdata[key]) for key in keys if key in userdata}
                self.__before.append((userdata, had))
        for userdata, had in self.__before:
            for key in keys:
                if key in had:
                    userdata[key] = _copied(had[key])
                elif key in userdata:
                    del userdata[key]

    def __fill_userdata(self, goal: Any) -> None:
        userdata = self.userdata
        if self.__expand_goal_slots:
            for slot in goal.__slots__:
                userdata[slot] = getattr(goal, slot)
        for slot, key in self.__goal_slots_map.items():
            userdata[key] = getattr(goal, slot)
        userdata[self.__goal_key] = goal
        userdata[self.__feedback_key] = self.__types.feedback()
        userdata[self.__result_key] = self.__types.result()

    def __make_result(self, *, complete: bool) -> Any:
        """Return the result of this goal; with `complete`, each key of the map needs a value."""
        userdata = self.userdata
        result = userdata[self.__result_key]
        if self.__pack_result_slots:
            for slot in result.__slots__:
                if slot in userdata:
                    setattr(result, slot, userdata[slot])
        for slot, key in self.__result_slots_map.items():
            if complete or key in userdata:
                setattr(result, slot, userdata[key])
        return result

    def preempt_cb(self) -> None:
        """Preempt the container; the action server calls it."""
        with self.__lock:  # so that it never preempts the run of the next goal; nothing blocks here
            asked = self.__action_server.is_preempt_requested() and not self.__stopped
            if self.__executing and asked:
                with asking("action", self.__server_name, self.__why()):
                    request_soon(self.wrapped_container)

    def __why(self) -> str:
        """Return the reason of the preempt: a cancel, a newer goal, or the end of the server.

        Its goal id begins with the client's name, so it also tells who asked.
        """
        newer, current = self.__action_server.next_goal, self.__action_server.current_goal
        if newer is not None:
            return f"newer goal {newer.get_goal_id().id}"
        if current is None or current.record.status is Status.ACTIVE:
            return "the server stops"
        return f"cancel of goal {current.get_goal_id().id}"

    # -- feedback ------------------------------------------------------------------------------

    def transition_cb(self, userdata: UserData, active_states: Sequence[str]) -> None:
        """Send feedback if it has changed; the container calls it."""
        del active_states
        self.__publish_change(userdata)

    def termination_cb(
        self, userdata: UserData, terminal_states: Sequence[str], container_outcome: str
    ) -> None:
        """Send feedback if it has changed; the container calls it."""
        del terminal_states, container_outcome
        self.__publish_change(userdata)

    def publish_feedback(self, userdata: UserData) -> None:
        """Send the feedback in `userdata`.

        Raises:
            ActionException: its value is not an XFeedback.
            FieldError: a field of it has a wrong type.
        """
        feedback = self.__make_feedback(userdata)
        self.__action_server.publish_feedback(feedback)
        self.__feedback_sent = feedback.to_bytes()

    def __make_feedback(self, userdata: UserData) -> Any:
        feedback = (
            userdata[self.__feedback_key]
            if self.__feedback_key in userdata
            else self.__types.feedback()
        )
        for slot, key in self.__feedback_slots_map.items():
            if key in userdata:
                setattr(feedback, slot, userdata[key])
        return feedback

    def __publish_change(self, userdata: UserData) -> None:
        if self.__executing and self.__make_feedback(userdata).to_bytes() != self.__feedback_sent:
            self.publish_feedback(userdata)

    def __on_event(self, event: Event) -> None:
        """Send feedback at once when a child of the container writes it."""
        if not isinstance(event, UserdataWritten):
            return
        container = self.wrapped_container
        label = event.path.removeprefix(f"/{container.name or 'SM_ROOT'}/")
        # Deeper states write to the userdata of another container.
        if label in container.get_children():
            keys = {self.__feedback_key, *self.__feedback_slots_map.values()}
            if event.key in keys and self.__executing:
                self.publish_feedback(self.wrapped_container.userdata)


def _copied(value: Any) -> Any:
    """Return a copy, which a state may change in place; the value itself if it has no copy."""
    try:
        return copy.deepcopy(value)
    except Exception:  # noqa: BLE001  of any kind: the value's own code decides
        return value


def _is_used(container: Container, key: str) -> bool:
    """Return whether a child of `container` reads or writes `key`."""
    for label, child in container.get_children().items():
        names = container._smachpy.remappings.get(label, {})
        keys = {*child.get_registered_input_keys(), *child.get_registered_output_keys()}
        if key in {names.get(own, own) for own in keys}:
            return True
    return False
