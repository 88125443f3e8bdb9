"""The state machine and the sequence: one child at a time; each outcome leads to the next child."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias, get_args

from smachpy.base import log
from smachpy.base.problems import Problems, plain, unique_names, unknown_name
from smachpy.base.slips import accepting, accepts
from smachpy.engine.child import run_child
from smachpy.engine.described import EPOCH, ContainerData
from smachpy.engine.step import Plan
from smachpy.engine.visit import FOLLOWED, End, Why, following
from smachpy.events import Jumped
from smachpy.exceptions import (
    InvalidConstructionError,
    InvalidStateError,
    InvalidTransitionError,
    did_you_mean,
)
from smachpy.machines.construction import construction_method
from smachpy.machines.container import NO_STATES, Container
from smachpy.machines.guards import between, choices_of, split
from smachpy.machines.history import go_on
from smachpy.machines.old_states import adopt_slips
from smachpy.machines.state import DataOf, Shown
from smachpy.userdata.user_data import ConstantKey

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from collections.abc import Sequence as SequenceOf
    from typing import Unpack

    from smachpy.base.names import Names
    from smachpy.engine.frame import Frame
    from smachpy.engine.step import Step
    from smachpy.events.introspection import Kind, Structure
    from smachpy.machines.guards import Cases, Target
    from smachpy.machines.state import State, StateOptions
    from smachpy.userdata.user_data import UserData

Reenter: TypeAlias = Literal["first", "last", "deep"]

__all__ = ["Sequence", "StateMachine"]


class MachineData(ContainerData):
    """What the library knows of one state machine.

    Attributes:
        transitions: Label -> outcome -> label of the next child, outcome of the machine, or None.
        guards: Label -> outcome -> cases, which come before the transition of that outcome.
        constants: Label -> key of the userdata -> fixed value.
        initial: Label of the initial child.
        next_initial: The initial child of the next run only; None for `initial`.
        follow_connectors: The label of a child and its outcomes that lead to the child added next.
        connector_outcome: Of a `Sequence`: the outcome that connects its children.
    """

    __slots__ = (
        *("transitions", "guards", "constants", "initial", "next_initial"),
        *("follow_connectors", "connector_outcome"),
    )
    _kept = __slots__

    def __init__(self) -> None:
        super().__init__()
        self.transitions: dict[str, dict[str, str | None]] = {}
        self.guards: dict[str, dict[str, Cases]] = {}
        self.constants: dict[str, dict[str, Any]] = {}
        self.initial: str | None = None
        self.next_initial: str | None = None
        self.follow_connectors: tuple[str, tuple[str, ...]] | None = None
        self.connector_outcome = ""


def _copied(value: Any) -> Any:
    """Return a copy of a constant; the object itself if there is none, as of a device."""
    try:
        return deepcopy(value)
    except Exception:  # noqa: BLE001  the user's class
        return value


class StateMachine(Container):
    """A container that runs one child after another, following the transitions of their outcomes.

    The first state added is the initial one. An outcome without a transition ends the machine
    with the outcome of the same name.

    Args:
        outcomes: Outcomes.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        name: Name of the machine when it is the root.
        userdata_type: A dataclass or TypedDict: the userdata has its fields, and their defaults.
        userdata: Key -> value with which every run begins; a copy, so no run sees what the one
            before it has made of it.
        reenter: Where a run begins after one that a request to stop has ended with 'preempted':
            "first", the initial state; "last", the state that was interrupted, with the userdata of
            then; "deep", the same also in the machines inside of that state. See docs/reenter.md.
        **options: See `StateOptions`.
    """

    _smachpy: DataOf[MachineData] = DataOf(MachineData)
    _smachpy_kind: ClassVar[Kind] = "machine"
    _transitions = Shown(lambda machine: machine._smachpy.transitions)
    _initial_state_label = Shown(lambda machine: machine._smachpy.initial)
    _current_label = Shown(lambda machine: _current(machine, "label"))
    _current_state = Shown(lambda machine: _current(machine, "state"))

    def __init__(
        self,
        outcomes: Names,
        input_keys: Names = (),
        output_keys: Names = (),
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        userdata: Mapping[str, Any] | None = None,
        reenter: Reenter = "first",
        **options: Unpack[StateOptions],
    ) -> None:
        super().__init__(
            outcomes,
            input_keys,
            output_keys,
            name=name,
            userdata_type=userdata_type,
            userdata=userdata,
            **options,
        )
        data = self._smachpy  # reset for a second call of __init__, as in Container
        data.transitions, data.guards, data.constants = {}, {}, {}
        data.initial = data.next_initial = data.follow_connectors = None
        problems = Problems(type(self).__name__)
        if reenter not in get_args(Reenter):
            problems.add(f"reenter: got {reenter!r}; expected one of {get_args(Reenter)}.")
        problems.raise_all()
        data.reenter = reenter

    # -- construction --------------------------------------------------------------------------

    @construction_method
    def add(
        self: StateMachine,
        label: str,
        state: State,
        transitions: Mapping[str, Target] | None = None,
        remapping: Mapping[str, str] | None = None,
        constants: Mapping[str, Any] | None = None,
    ) -> State:
        """Add a state.

        Args:
            label: Its name here; unique.
            state: The state.
            transitions: Outcome of the state -> label of the next state, or outcome of this
                machine; or cases, such as `[when("battery < 0.3", "RECHARGE"), "NEXT"]`; or
                `smachpy.states.confirm("NEXT", level=2)`. Outcomes left out, or mapped to None, end
                the machine with the outcome of the same name.
            remapping: Key of the state -> key of this machine's userdata.
            constants: Key of the state -> fixed value, kept in the userdata under "LABEL.key".

        Returns:
            The state.

        Raises:
            InvalidStateError: the label is taken, `state` is not a state, or an argument has a
                wrong form.
            InvalidConstructionError: called on the class while no machine is open, or the machine
                runs.
        """
        return self._smachpy_add(label, state, transitions, remapping, constants)

    @construction_method
    def add_auto(
        self: StateMachine,
        label: str,
        state: State,
        connector_outcomes: Names,
        transitions: Mapping[str, Target] | None = None,
        remapping: Mapping[str, str] | None = None,
        constants: Mapping[str, Any] | None = None,
    ) -> State:
        """Add a state whose `connector_outcomes` lead to the state added next.

        Explicit transitions take precedence. The other arguments are those of `add`.
        """
        connectors = unique_names(connector_outcomes, "connector_outcomes")
        self._smachpy_add(label, state, transitions, remapping, constants)
        self.__connect(label, connectors)
        return state

    def __connect(self, label: str, connectors: Iterable[str]) -> None:
        """Let the outcomes of a child that have no transition lead to the child added next."""
        given = self._smachpy.transitions[label]
        open_ends = tuple(outcome for outcome in connectors if given.get(outcome) is None)
        self._smachpy.follow_connectors = (label, open_ends)

    def _smachpy_add(
        self,
        label: str,
        state: State,
        transitions: Mapping[str, Target] | None,
        remapping: Mapping[str, str] | None,
        constants: Mapping[str, Any] | None,
    ) -> State:
        if self._smachpy.live.frame is not None:
            raise InvalidConstructionError(
                f"{label}: add: got a new state while the machine runs; expected it before or "
                "after."
            )
        problems = Problems(str(label))
        holds = "outcome -> label of the next state, outcome of this machine, or None"
        transitions, steps = between(label, transitions)
        targets, guards = split(transitions, problems)
        given = problems.names_of("transitions", targets, holds, optional=True)
        fixed = problems.mapping("constants", constants, "key of the state -> value")
        twice = sorted(key for key in fixed if key in (remapping or ()))
        if twice and not accepts(f"{label}: constants: {twice} are in remapping, too"):
            problems.add(f"remapping, constants: got {twice} in both; expected each key in one.")
        stored = self._smachpy_store_child(label, state, remapping, problems, fixed)
        label = plain(label)
        if accepting():
            given = adopt_slips(label, stored, given)
        self._smachpy.transitions[label] = given
        if guards:
            self._smachpy.guards[label] = guards
        for key, value in fixed.items():
            name = ConstantKey(f"{label}.{key}")
            self.userdata[name] = value
            self._smachpy.constants.setdefault(label, {})[name] = value
            self._smachpy.remappings[label][key] = name
            stored.register_input_keys([key])
        if self._smachpy.follow_connectors is not None:
            before, outcomes = self._smachpy.follow_connectors
            self._smachpy.transitions[before].update(dict.fromkeys(outcomes, label))
            self._smachpy.follow_connectors = None
        if self._smachpy.connector_outcome:
            self.__connect(label, [self._smachpy.connector_outcome])
        if self._smachpy.initial is None:
            self._smachpy.initial = label
        for own, step in steps.items():  # in no sequence: only the outcome leads there
            self._smachpy_store_child(own, step.state, None, Problems(own), {})
            self._smachpy.transitions[own] = dict(step.transitions)
        return state

    # -- structure -----------------------------------------------------------------------------

    def set_initial_state(
        self, initial_states: SequenceOf[str], userdata: UserData | None = None
    ) -> None:
        """Choose the initial state of the next run only, and update the userdata.

        While the machine is being built, this sets the initial state for good.

        Raises:
            InvalidStateError: more than one state, or an unknown one.
        """
        if isinstance(initial_states, str):
            initial_states = [initial_states]
        labels = list(initial_states)
        known = self._smachpy.others()
        unknown = [label for label in labels if label not in known]
        if len(labels) > 1 or unknown:
            problem = f"initial state: got {labels!r}; expected one of {sorted(known)}."
            if unknown and self.is_opened():
                problem += " It is not added yet. Try set_initial_state after the last add()."
            elif unknown:
                problem += did_you_mean(unknown[0], known)
            if not accepts(problem):
                raise InvalidStateError(problem)
        if userdata is not None:
            self.userdata.update(userdata)  # first, as typed keys may refuse a value
        if labels:
            labels = [plain(label) for label in labels]
            if not self.is_opened() and self._smachpy.initial is not None:
                self._smachpy.next_initial = labels[0]
            else:
                self._smachpy.initial = labels[0]
            self._smachpy.restructured()
            EPOCH.value = object()

    def get_initial_states(self) -> list[str]:
        """Return the label of the state in which the next run begins."""
        label = self._smachpy.next_initial or self._smachpy.initial
        return [] if label is None else [label]

    def get_active_states(self) -> list[str]:
        """Return the label of the active state; ['None'] when idle."""
        return [str(_current(self, "label"))]

    def check_state_spec(
        self, label: str, state: State, transitions: Mapping[str, str | None]
    ) -> None:
        """Check that `transitions` leave from outcomes of `state`.

        Raises:
            InvalidTransitionError: one does not.
        """
        outcomes = state.get_registered_outcomes()
        for outcome in transitions:
            if outcome not in outcomes:
                what = f"{label}: transition from an unknown outcome"
                raise InvalidTransitionError(unknown_name(what, outcome, outcomes))

    def find_problems(self, where: str) -> tuple[str, ...]:
        """Return the problems of this machine itself."""
        data = self._smachpy
        if not data.others():
            # A subclass with its own `execute` needs no children.
            is_own = type(self).execute is not Container.execute
            return () if is_own else (f"{where}: {NO_STATES}",)
        problems: list[str] = []
        states = data.others()
        initial = data.next_initial or data.initial
        if initial not in states:
            problems.append(unknown_name(f"{where}: initial state", initial, states))
        for label in states:
            problems += self.__child_problems(label, f"{where}/{label}")
        return tuple(problems)

    def __child_problems(self, label: str, where: str) -> Iterator[str]:
        states, own = self._smachpy.others(), self._smachpy.outcomes
        outcomes = states[label]._smachpy.outcomes
        if not outcomes:
            problem = f"{where}: outcomes: got none; expected at least one."
            if not accepts(problem):
                yield problem
        for case in (case for cases in self.__cases(label).values() for case in cases):
            if case.target not in states and case.target not in own:
                yield (
                    f"{where}: transition if {case.text!r} leads nowhere: got {case.target!r}; "
                    f"expected one of the states {sorted(states)} or outcomes {sorted(own)}."
                    f"{did_you_mean(case.target, [*states, *own])}"
                )
        for outcome, target in self.__targets(label).items():
            if outcome not in outcomes:
                yield unknown_name(
                    f"{where}: transition from an unknown outcome", outcome, outcomes
                )
            elif not target and outcome not in own:
                yield (
                    f"{where}: outcome has no transition: got {outcome!r}; expected a transition, "
                    f"or a container outcome of that name among {sorted(own)}."
                    f"{did_you_mean(outcome, own)}"
                )
            elif target and target not in states and target not in own:
                yield (
                    f"{where}: transition {outcome!r} leads nowhere: got {target!r}; expected one "
                    f"of the states {sorted(states)} or outcomes {sorted(own)}."
                    f"{did_you_mean(target, [*states, *own])}"
                )

    def __targets(self, label: str) -> dict[str, str | None]:
        """Return outcome -> target for every outcome of a child; None is that of the same name."""
        data = self._smachpy
        return dict.fromkeys(data.children[label]._smachpy.outcomes) | data.transitions[label]

    def __cases(self, label: str) -> dict[str, Cases]:
        """Return outcome -> cases of a child."""
        return self._smachpy.guards.get(label, {})

    def describe_structure(self) -> Structure:
        """Return the children and the edges between them."""
        from dataclasses import replace

        from smachpy.events.introspection import TransitionRecord

        children = self._smachpy.others()
        edges = tuple(
            TransitionRecord(
                label,
                outcome,
                target or outcome,
                target_is_outcome=not target or target not in children,
                implicit=not target and not guard,
                guard=guard,
            )
            for label in children
            for outcome, otherwise in self.__targets(label).items()
            for target, guard in (
                *((case.target, case.text) for case in self.__cases(label).get(outcome, ())),
                (otherwise, ""),
            )
        )
        details = () if self._smachpy.reenter == "first" else (("reenter", self._smachpy.reenter),)
        return replace(super().describe_structure(), transitions=edges, details=details)

    # -- running -------------------------------------------------------------------------------

    def _smachpy_compile(self) -> Plan:
        plan = Plan(self)
        steps = plan.steps
        ends = {outcome: End(outcome) for outcome in self._smachpy.outcomes}
        for label, step in steps.items():
            transitions = self._smachpy.transitions[label]
            for outcome in step.state._smachpy.outcomes:
                target = transitions.get(outcome)
                if target in steps:
                    step.next[outcome] = following(outcome, steps[target])
                elif (target or outcome) in ends:
                    step.next[outcome] = following(outcome, ends[target or outcome])
            if label in self._smachpy.constants:
                self.__restore_constants(label, step)
            guards = self.__cases(label)
            if guards:
                step.choices = choices_of(guards, steps, ends, step.next, self.userdata)
                step.forget_choices()
        return plan

    def __restore_constants(self, label: str, step: Step) -> None:
        """Let each visit begin with those constants that the state itself can change."""
        names, userdata, execute = self._smachpy.remappings[label], self.userdata, step.execute
        written = {names.get(key) for key in step.state._smachpy.output_keys}
        fixed = {
            name: value for name, value in self._smachpy.constants[label].items() if name in written
        }

        def begin(window: Any) -> Any:
            for name, value in fixed.items():
                userdata[name] = _copied(value)
            return execute(window)

        if fixed:
            step.execute = begin

    def _smachpy_terminal_labels(self, frame: Frame) -> list[str]:
        return [] if frame.step is None else [frame.step.label]

    def _smachpy_run_children(self, frame: Frame, plan: Plan) -> str:
        data: Any = frame.data
        # A durable run that goes on in here has called the start callbacks in an earlier process.
        resumed = frame.run.journal.resumed_label(frame)
        if data.start_cbs and resumed is None:
            self.call_start_cbs()
        stopped_at, data.live.stopped_at = data.live.stopped_at, ""
        last = stopped_at if frame.goes_on and stopped_at in plan.steps else ""
        label, data.next_initial = resumed or data.next_initial or last or data.initial, None
        assert label is not None
        if "deep" in {frame.goes_on, data.reenter} and label == last:
            go_on(data.children[last])
        if frame.run.logged:
            log.loginfo(f"{frame.path}: starting in {label!r}, keys {self.userdata.keys()}")
        outcome = self.__run_from(plan.steps[label], frame, plan)
        if outcome == "preempted":
            here = frame.step.label if frame.answered else ""
            data.live.stopped_at = frame.stopped_at or here
        if frame.run.logged:
            log.loginfo(f"{frame.path}: {frame.step.label!r} ended it with {outcome!r}")
        return outcome

    def __run_from(self, step: Step, frame: Frame, plan: Plan) -> str:
        """Run child after child; return the outcome, with the last one still in the frame."""
        run, data = frame.run, frame.data
        while True:
            why, target, outcome = run_child(frame, step)
            if why is not FOLLOWED:
                if why in {Why.STOPPED, Why.ANSWERED} and not frame.stopped_at:
                    finished = outcome != "preempted" or why is Why.STOPPED
                    frame.stopped_at = getattr(target if finished else step, "label", step.label)
                if why is Why.STOPPED:
                    return frame.end_preempted(step.label)
                if why is Why.JUMPED:
                    frame.emit_own(Jumped, target)
                    target = plan.steps[target]
            if target.final:
                ends: str = target.outcome
                return ends
            if data.transition_cbs or run.logged:
                frame.step = target  # the callbacks see it as the active one, as in SMACH
                if run.logged:
                    log.loginfo(f"{frame.path}: {step.label!r} -{outcome}-> {target.label!r}")
                self.call_transition_cbs()
            step = target


class Sequence(StateMachine):
    """States one after another: `connector_outcome` leads to the state added next.

    Args:
        outcomes: Outcomes.
        connector_outcome: Outcome that connects the states.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        name: Name of the machine when it is the root.
        userdata_type: A dataclass or TypedDict: the userdata has its fields, and their defaults.
        userdata: Key -> value with which every run begins; a copy, so no run sees what the one
            before it has made of it.
        reenter: Where a run begins after one that a request to stop has ended with 'preempted':
            "first", the initial state; "last", the state that was interrupted, with the userdata of
            then; "deep", the same also in the machines inside of that state. See docs/reenter.md.
        **options: See `StateOptions`.
    """

    _smachpy_kind: ClassVar[Kind] = "sequence"

    def __init__(
        self,
        outcomes: Names,
        connector_outcome: str,
        input_keys: Names = (),
        output_keys: Names = (),
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        userdata: Mapping[str, Any] | None = None,
        reenter: Reenter = "first",
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
                reenter=reenter,
                **options,
            )
        self._smachpy.connector_outcome = problems.word("connector_outcome", connector_outcome)
        problems.raise_all()

    @construction_method
    def add(  # type: ignore[override]  # as in SMACH: no constants
        self: Sequence,
        label: str,
        state: State,
        transitions: Mapping[str, Target] | None = None,
        remapping: Mapping[str, str] | None = None,
    ) -> State:
        """Add a state after the previous one; the arguments are those of `StateMachine.add`.

        An explicit transition for the connector outcome takes precedence over the connection.
        """
        return self._smachpy_add(label, state, transitions, remapping, None)


def _current(machine: StateMachine, name: str) -> Any:
    """Return the attribute `name` of the running step; None between runs."""
    frame = machine._smachpy.live.frame
    return getattr(None if frame is None else frame.step, name, None)
