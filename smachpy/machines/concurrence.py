"""The concurrence: runs all children at once; their outcomes decide its own."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.base import log
from smachpy.base.functions import name_of, no_coroutine
from smachpy.base.problems import Problems, plain, unknown_name
from smachpy.base.slips import accepts
from smachpy.engine.callback import call_bounded
from smachpy.engine.described import ContainerData
from smachpy.engine.errors import raised
from smachpy.engine.interrupt import Interruption
from smachpy.engine.preempt import asking
from smachpy.engine.step import Plan
from smachpy.engine.threads import Group
from smachpy.exceptions import (
    InvalidConstructionError,
    InvalidStateError,
    InvalidTransitionError,
    InvalidUserCodeError,
    did_you_mean,
)
from smachpy.machines.construction import construction_method
from smachpy.machines.container import NO_STATES, Container, shared_below
from smachpy.machines.rules import Rule, all_of, any_of, as_rules, decide, n_of
from smachpy.machines.state import DataOf, State

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from collections.abc import Sequence as SequenceOf
    from typing import Unpack

    from smachpy.base.names import Names
    from smachpy.engine.frame import Frame
    from smachpy.engine.threads import ChildBranch
    from smachpy.events.introspection import Kind, Structure
    from smachpy.machines.state import StateOptions
    from smachpy.userdata.user_data import UserData

__all__ = ["Concurrence", "Rule", "all_of", "any_of", "n_of"]


class ConcurrenceData(ContainerData):
    """The library's data of one concurrence; see the arguments of `Concurrence`."""

    __slots__ = ("child_termination_cb", "default_outcome", "outcome_cb", "rules")
    _kept = __slots__

    def __init__(self) -> None:
        super().__init__()
        self.rules: tuple[tuple[str, Rule], ...] = ()
        self.default_outcome = ""
        self.outcome_cb: Callable[[dict[str, str | None]], str | None] | None = None
        self.child_termination_cb: Callable[[dict[str, str | None]], Any] | None = None


class Concurrence(Container):
    """A container that runs all its children at once and ends when all have ended.

    Args:
        outcomes: Outcomes.
        default_outcome: Outcome if no rule of `outcome_map` holds.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        outcome_map: Outcome -> rule: `{label: outcome}` (all must hold; an outcome may be a
            list of outcomes), or `all_of`, `any_of`, `n_of`. Of the rules that hold, the one with
            most conditions wins.
        outcome_cb: Called with label -> outcome when all have ended; returns the outcome, or
            None to let the rules decide.
        child_termination_cb: Called with label -> outcome (None while it runs) each time a child
            has ended; returns True to preempt all others, a list of labels to preempt those,
            False to let them run. Called in the container's thread, one call at a time, and not
            after a child or the callback itself has raised.
        name: Name of the machine when it is the root.
        userdata_type: A dataclass or TypedDict: the userdata has its fields, and their defaults.
        userdata: Key -> value with which every run begins; a copy, so no run sees what the one
            before it has made of it.
        **options: See `StateOptions`.

    Raises:
        InvalidStateError: there is no outcome policy, or a callback cannot be called.

    Threads: children run in threads named after their paths; one that has ended may run the next
        child. All have ended when `execute` returns, except those that ignored a preempt and were
        left behind (docs/preemption.md).
    """

    _smachpy: DataOf[ConcurrenceData] = DataOf(ConcurrenceData)
    _smachpy_kind: ClassVar[Kind] = "concurrence"
    _smachpy_replaces: ClassVar[bool] = True

    def __init__(
        self,
        outcomes: Names,
        default_outcome: str,
        input_keys: Names = (),
        output_keys: Names = (),
        outcome_map: Mapping[str, Any] | None = None,
        outcome_cb: Callable[[dict[str, str | None]], str | None] | None = None,
        child_termination_cb: Callable[[dict[str, str | None]], Any] | None = None,
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        userdata: Mapping[str, Any] | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        problems = Problems(type(self).__name__)
        with problems:
            super().__init__(
                outcomes,
                input_keys,
                output_keys,
                name=name,
                userdata_type=userdata_type,
                userdata=userdata,
                **options,
            )
        known = self._smachpy.outcomes
        outcome_map = problems.mapping("outcome_map", outcome_map, "outcome -> rule")
        if not (default_outcome or outcome_map or outcome_cb):
            problems.add("outcome policy: got none; expected default_outcome at least")
        for what, named in (("default outcome", [default_outcome]), ("outcome map", outcome_map)):
            unknown = (
                unknown_name(what, outcome, known)
                for outcome in named
                if outcome not in known and (outcome or outcome_map is named)
            )
            problems.add(*(problem for problem in unknown if not accepts(problem)))
        self._smachpy.rules = ()
        with problems:
            self._smachpy.rules = as_rules(outcome_map)
        ended = "({label: outcome})"
        problems.function("outcome_cb", outcome_cb, f"outcome_cb{ended}", 1)
        problems.function(
            "child_termination_cb", child_termination_cb, f"child_termination_cb{ended}", 1
        )
        problems.raise_all()
        self._smachpy.default_outcome = default_outcome and plain(default_outcome)
        self._smachpy.outcome_cb = outcome_cb
        self._smachpy.child_termination_cb = child_termination_cb

    @construction_method
    def add(
        self: Concurrence,
        label: str,
        state: State,
        remapping: Mapping[str, str] | None = None,
    ) -> State:
        """Add a state.

        Args:
            label: Its name here; unique.
            state: The state.
            remapping: Key of the state -> key of this container's userdata.

        Returns:
            The state.

        Raises:
            InvalidStateError: the label is taken, `state` is not a state, or an argument has a
                wrong form.
            InvalidConstructionError: called on the class while no concurrence is open, or it runs.
        """
        if self._smachpy.live.frame is not None:
            raise InvalidConstructionError(f"{label}: add: got a new state while it runs.")
        # One object in two threads would share its attributes and its preempt flag.
        if isinstance(state, State) and state._smachpy.is_child:
            for other, child in self._smachpy.children.items():
                problem = (
                    f"{label}: state: got the instance that runs as {other!r} at the same time; "
                    "expected one of its own."
                )
                if child is state and not accepts(problem):
                    raise InvalidStateError(problem)
        self._smachpy_store_child(label, state, remapping)
        return state

    # -- structure -----------------------------------------------------------------------------

    def set_initial_state(
        self, initial_states: SequenceOf[str], userdata: UserData | None = None
    ) -> None:
        """Update the userdata; all children always start together.

        Raises:
            InvalidStateError: an unknown label.
        """
        super().set_initial_state(initial_states, userdata)
        if initial_states and set(initial_states) != set(self._smachpy.others()):
            log.logwarn("Concurrence.set_initial_state: all children start together; ignored.")

    def get_active_states(self) -> list[str]:
        """Return the labels of the children that are running."""
        frame = self._smachpy.live.frame
        group = None if frame is None else frame.group
        return [] if group is None else [branch.step.label for branch in group.running()]

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return the conditions of the outcome map as (child outcome, child label, outcome)."""
        return [
            (child_outcome, label, rule.outcome)
            for rule in self.describe_structure().rules
            for label, child_outcome in rule.conditions
        ]

    def find_problems(self, where: str) -> tuple[str, ...]:
        """Return the problems of this concurrence itself."""
        nothing = () if self._smachpy.others() else (f"{where}: {NO_STATES}",)
        found = (f"{where}: {problem}" for problem in (*self.__unknown(), *self.__shared_states()))
        return (*nothing, *(problem for problem in found if not accepts(problem)))

    def __unknown(self) -> Iterator[str]:
        """Yield a problem for each unknown name in the outcome policy."""
        data = self._smachpy
        if data.default_outcome is not None and data.default_outcome not in data.outcomes:
            yield unknown_name("default outcome", data.default_outcome, data.outcomes)
        for outcome, rule in data.rules:
            if outcome not in data.outcomes:
                yield unknown_name("outcome map", outcome, data.outcomes)
            what = f"outcome map: {outcome!r}"
            for label, wanted in rule.conditions:
                if label not in data.others():
                    yield unknown_name(what, label, data.others())
                    continue
                known = dict.fromkeys((*data.children[label]._smachpy.outcomes, "preempted"))
                for one in wanted:
                    if one not in known:
                        yield unknown_name(f"{what}: outcome of {label}", one, known)

    def __shared_states(self) -> Iterator[str]:
        """Yield a problem for each state that two branches would run at the same time."""
        for state, first, second in shared_below(self._smachpy.others()):
            yield (
                f"one state in two branches: got one {type(state).__name__} below both {first!r} "
                f"and {second!r}; expected an instance for each."
            )

    def describe_structure(self) -> Structure:
        """Return the children and the rules."""
        from dataclasses import replace

        from smachpy.events.introspection import RuleRecord

        data = self._smachpy
        rules = tuple(
            RuleRecord(
                outcome,
                tuple((label, one) for label, wanted in rule.conditions for one in wanted),
                str(rule),
            )
            for outcome, rule in data.rules
        )
        details = (("outcome callback", name_of(data.outcome_cb)),) if data.outcome_cb else ()
        return replace(
            super().describe_structure(),
            rules=rules,
            default_outcome=data.default_outcome or None,
            details=details,
        )

    # -- running -------------------------------------------------------------------------------

    def _smachpy_compile(self) -> Plan:
        plan = Plan(self)
        for step in plan.steps.values():
            step.end_always()
        return plan

    def _smachpy_run_children(self, frame: Frame, plan: Plan) -> str:
        # Without callbacks the container wakes up once, after the last child.
        each = bool(self._smachpy.child_termination_cb or self._smachpy.transition_cbs)
        group = frame.group = Group(frame, [*plan.steps.values()], each=each)
        try:
            if self._smachpy.start_cbs and not frame.run.journal.has_begun(frame.path):
                self.call_start_cbs()
            if self._preempt_requested:
                return frame.end_preempted()
            self.__run_group(group)
            return self.__outcome(frame, group)
        finally:
            # Break the reference cycle frame -> group -> branches -> frame: the run is freed now.
            frame.group = None
            if not group.started:
                group.release()

    def __run_group(self, group: Group) -> None:
        """Start the branches and handle their ends.

        Raises:
            Interruption: a callback outlasted its grace; the branches have ended too.
        """
        try:
            group.start()
            self.__handle_ends(group)
        except BaseException as error:
            with asking("concurrence", group.frame.path, f"raised {type(error).__name__}"):
                group.ask(group.running())
            raise

    def __handle_ends(self, group: Group) -> None:
        failure: InvalidUserCodeError | None = None
        running = True
        # As in SMACH, a transition callback is called once for each child that has started.
        if self._smachpy.transition_cbs:
            try:
                for _ in group.branches:
                    self.call_transition_cbs()
            except Interruption as error:
                self.__stop_calling(group, error)
        # Handle all reports, also those that arrive together with the last end.
        while running or group.reports:
            running = group.wait() if running else False
            while group.reports:
                branch = group.reports.popleft()
                try:
                    self.__branch_ended(group, branch)
                except InvalidUserCodeError as error:  # raised below, when all branches have ended
                    failure = error
                    group.failed = True
                    with asking("concurrence", group.frame.path, "child_termination_cb raised"):
                        group.ask(group.running())
                except Interruption as error:
                    self.__stop_calling(group, error)
        if group.failed:
            group.raise_errors(failure)
        if group.interruption is not None:
            raise group.interruption

    def __stop_calling(self, group: Group, interruption: Interruption) -> None:
        """Call no other callback after one was interrupted: it might ignore its preempt too."""
        if group.frame.dead:
            raise interruption
        group.failed = True
        group.interruption = interruption

    def __branch_ended(self, group: Group, branch: ChildBranch) -> None:
        if branch.error is not None:
            with asking("concurrence", branch.here(), f"raised {type(branch.error).__name__}"):
                group.ask(group.running())
            return
        if self._smachpy.transition_cbs and group.interruption is None:
            self.call_transition_cbs()
        if self._smachpy.child_termination_cb is None or group.failed:
            # In the callback's argument None means "still runs", which would be wrong for a child
            # that has raised.
            return
        try:
            answer = call_bounded(
                self, group.frame, self._smachpy.child_termination_cb, (_outcomes(group),)
            )
            no_coroutine(answer)
        except Exception as error:
            raise raised(group.frame.path, "child_termination_cb", error) from error
        labels = _labels(group.frame.path, answer)
        with asking("concurrence", branch.here(), f"ended with {branch.outcome!r}"):
            group.ask(self.__chosen(group, labels))

    def __chosen(self, group: Group, labels: list[Any] | bool) -> list[ChildBranch]:
        """Return the branches to preempt after `child_termination_cb` returned `labels`."""
        if isinstance(labels, bool):
            return group.running() if labels else []
        known = self._smachpy.others()
        strange = (each for each in labels if not (isinstance(each, str) and each in known))
        unknown = sorted(strange, key=str)
        if unknown:
            raise InvalidUserCodeError(
                f"{group.frame.path}: child_termination_cb: got labels {unknown}; expected labels "
                f"of {sorted(known)}.{did_you_mean(unknown[0], known)}",
                path=group.frame.path,
            )
        return [branch for branch in group.running() if branch.step.label in labels]

    def __outcome(self, frame: Frame, group: Group) -> str:
        """Return the outcome given by the callback, the rules or the default.

        It counts as an answer to a preempt only if every child that contributed to it has serviced
        the request. If one just finished its work, the machine above must not treat the outcome as
        the end of the preempt.
        """
        outcomes = _outcomes(group)
        answered = [b.step.label for b in group.branches if b.answered]
        asked = self._preempt_requested
        if self._smachpy.outcome_cb is not None:
            answer = self.__ask_callback(frame, outcomes)
            if answer is not None:
                frame.answered = asked and len(answered) == len(outcomes)
                return answer
        # Only the children that met the rule count; for the default outcome one is enough.
        ruled = decide(self._smachpy.rules, outcomes) if self._smachpy.rules else None
        if ruled is not None:
            outcome, rule = ruled
            frame.answered = asked and set(rule.met_by(outcomes)) <= set(answered)
            return outcome
        frame.answered = asked and bool(answered)
        default, known = self._smachpy.default_outcome, self._smachpy.outcomes
        if frame.answered and ("preempted" in known or not default):
            return frame.end_preempted() if frame.run.watched else "preempted"
        return default

    def __ask_callback(self, frame: Frame, outcomes: dict[str, str | None]) -> str | None:
        assert self._smachpy.outcome_cb is not None
        try:
            answer = call_bounded(self, frame, self._smachpy.outcome_cb, (dict(outcomes),))
            no_coroutine(answer)
        except Exception as error:
            raise raised(frame.path, "outcome_cb", error) from error
        if _is_nothing(answer):
            return None
        known = self._smachpy.outcomes
        if isinstance(answer, str) and answer in known:
            return plain(answer)
        problem = unknown_name(f"{frame.path}: outcome_cb", answer, known)
        hint = "" if isinstance(answer, str) else " None lets the rules decide."
        raise InvalidTransitionError(f"{problem}{hint}")


def _is_nothing(answer: Any) -> bool:
    try:
        return not answer
    except Exception:  # noqa: BLE001  of the user's object, such as an array of NumPy
        return False


def _labels(path: str, answer: Any) -> list[Any] | bool:
    """Return the labels in an answer of `child_termination_cb`, or the truth of any other.

    Raises:
        InvalidUserCodeError: it has none, as an array of NumPy.
    """
    if isinstance(answer, str):
        return [answer]
    try:
        # A generator is always true, also one that yields no label.
        if isinstance(answer, (list, tuple, AbstractSet, Iterator)):
            return list(answer)
        return bool(answer)
    except Exception as error:
        raise InvalidUserCodeError(
            f"{path}: child_termination_cb: got {answer!r}; expected True, False, or labels in a "
            "list.",
            path=path,
        ) from error


def _outcomes(group: Group) -> dict[str, str | None]:
    """Return label -> outcome of the branches; None for those that are running."""
    return {branch.step.label: branch.outcome for branch in group.branches}
