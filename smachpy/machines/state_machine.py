"""The state machine and the sequence: one child at a time; each outcome leads to the next child."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

from smachpy import log
from smachpy.events import Jumped
from smachpy.exceptions import (
    InvalidConstructionError,
    InvalidStateError,
    InvalidTransitionError,
    SmachError,
    did_you_mean,
)
from smachpy.introspection import TransitionRecord
from smachpy.machines.construction import construction_method
from smachpy.machines.container import NO_STATES, Container
from smachpy.machines.old_states import adopt_slips
from smachpy.machines.problems import Problems, unique_names, unknown_name
from smachpy.machines.state import DataOf, Shown
from smachpy.run.child import EPOCH, ContainerData
from smachpy.run.frame import Frame
from smachpy.run.grace import asking, end_visit, forget_visit, leave, request_soon, unknown_outcome
from smachpy.run.interrupt import Interruption
from smachpy.run.step import (
    Plan,
    only_buffer,
    publish_left,
    publish_raised,
    run_watched,
    user_error,
)
from smachpy.run.visit import PREEMPTED, End, Why
from smachpy.slips import accepting, accepts
from smachpy.util import is_shutdown

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from collections.abc import Sequence as SequenceOf
    from typing import Unpack

    from smachpy.events.buffer import EventBuffer
    from smachpy.introspection import Kind, Structure
    from smachpy.machines.state import State, StateOptions
    from smachpy.run.step import Following, Step
    from smachpy.userdata.user_data import UserData

__all__ = ["Sequence", "StateMachine"]


def _nested(step: Step) -> MachineData | None:
    """Return the data of a child that the loop of its parent may enter without calling it.

    None for a child that has options or its own `execute`, and so must be called.
    """
    state, execute = step.state, step.execute
    if not isinstance(state, StateMachine) or getattr(execute, "__self__", None) is not state:
        return None
    return state._smachpy if getattr(execute, "__func__", None) is Container.execute else None


@dataclass(slots=True, eq=False)
class MachineData(ContainerData):
    """What the library knows of one state machine.

    Attributes:
        transitions: Label -> outcome -> label of the next child, outcome of the machine, or None.
        initial: Label of the initial child.
        next_initial: The initial child of the next run only; None for `initial`.
        follow_connectors: The label of a child and its outcomes that lead to the child added next.
        connector_outcome: Of a `Sequence`: the outcome that connects its children.
    """

    transitions: dict[str, dict[str, str | None]] = field(default_factory=dict)
    initial: str | None = None
    next_initial: str | None = None
    follow_connectors: tuple[str, tuple[str, ...]] | None = None
    connector_outcome: str = ""

    _kept = ("transitions", "initial", "next_initial", "follow_connectors", "connector_outcome")


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
        outcomes: Iterable[str],
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        super().__init__(
            outcomes, input_keys, output_keys, name=name, userdata_type=userdata_type, **options
        )
        data = self._smachpy  # reset for a second call of __init__, as in Container
        data.transitions = {}
        data.initial = data.next_initial = data.follow_connectors = None

    # -- construction --------------------------------------------------------------------------

    @construction_method
    def add(
        self: StateMachine,
        label: str,
        state: State,
        transitions: Mapping[str, str | None] | None = None,
        remapping: Mapping[str, str] | None = None,
        constants: Mapping[str, Any] | None = None,
    ) -> State:
        """Add a state.

        Args:
            label: Its name here; unique.
            state: The state.
            transitions: Outcome of the state -> label of the next state, or outcome of this
                machine. Outcomes left out, or mapped to None, end the machine with the outcome of
                the same name.
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
        connector_outcomes: Iterable[str],
        transitions: Mapping[str, str | None] | None = None,
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
        transitions: Mapping[str, str | None] | None,
        remapping: Mapping[str, str] | None,
        constants: Mapping[str, Any] | None,
    ) -> State:
        if self._smachpy.frame is not None:
            raise InvalidConstructionError(
                f"{label}: add: got a new state while the machine runs; expected it before or "
                "after."
            )
        problems = Problems(str(label))
        holds = "outcome -> label of the next state, outcome of this machine, or None"
        given = problems.names_of("transitions", transitions, holds, optional=True)
        fixed = problems.mapping("constants", constants, "key of the state -> value")
        stored = self._smachpy_store_child(label, state, remapping, problems)
        if accepting():
            given = adopt_slips(label, stored, given)
        self._smachpy.transitions[label] = given
        for key, value in fixed.items():
            # The dot keeps it apart from the user's keys and lets typed userdata accept it.
            name = f"{label}.{key}"
            self.userdata[name] = value
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
        unknown = [label for label in labels if label not in self._smachpy.children]
        if len(labels) > 1 or unknown:
            problem = (
                f"initial state: got {labels!r}; expected one of {sorted(self._smachpy.children)}."
            )
            if unknown and self.is_opened():
                problem += " It is not added yet. Try set_initial_state after the last add()."
            elif unknown:
                problem += did_you_mean(unknown[0], self._smachpy.children)
            if not accepts(problem):
                raise InvalidStateError(problem)
        if labels:
            if not self.is_opened() and self._smachpy.initial is not None:
                self._smachpy.next_initial = labels[0]
            else:
                self._smachpy.initial = labels[0]
            EPOCH.value = object()
        if userdata is not None:
            self.userdata.update(userdata)

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
        if not data.children:
            # A subclass with its own `execute` needs no children.
            is_own = type(self).execute is not Container.execute
            return () if is_own else (f"{where}: {NO_STATES}",)
        problems: list[str] = []
        initial = data.next_initial or data.initial
        if initial not in data.children:
            problems.append(unknown_name(f"{where}: initial state", initial, data.children))
        for label in data.children:
            problems += self.__child_problems(label, f"{where}/{label}")
        return tuple(problems)

    def __child_problems(self, label: str, where: str) -> Iterator[str]:
        states, own = self._smachpy.children, self._smachpy.outcomes
        outcomes = states[label]._smachpy.outcomes
        if not outcomes:
            problem = f"{where}: outcomes: got none; expected at least one."
            if not accepts(problem):
                yield problem
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

    def describe_structure(self) -> Structure:
        """Return the children and the edges between them."""
        children = self._smachpy.children
        edges = tuple(
            TransitionRecord(
                label,
                outcome,
                target or outcome,
                target_is_outcome=not target or target not in children,
                implicit=not target,
            )
            for label in children
            for outcome, target in self.__targets(label).items()
        )
        return replace(super().describe_structure(), transitions=edges)

    # -- running -------------------------------------------------------------------------------

    def _smachpy_compile(self) -> Plan:
        plan = Plan(self)
        steps = plan.steps
        ends = {outcome: End(outcome) for outcome in self._smachpy.outcomes}
        for label, step in steps.items():
            step.nested = _nested(step)
            transitions = self._smachpy.transitions[label]
            for outcome in step.state._smachpy.outcomes:
                target = transitions.get(outcome)
                if target in steps:
                    step.next[outcome] = steps[target]
                elif (target or outcome) in ends:
                    step.next[outcome] = ends[target or outcome]
        return plan

    def _smachpy_terminal_labels(self, frame: Frame) -> list[str]:
        return [] if frame.step is None else [frame.step.label]

    def _smachpy_run_children(self, frame: Frame, plan: Plan) -> str:
        data: Any = frame.data
        # A durable run that goes on in here has called the start callbacks in an earlier process.
        resumed = None if frame.run.journal is None else frame.run.journal.resumed_label(frame)
        if data.start_cbs and resumed is None:
            self.call_start_cbs()
        label, data.next_initial = resumed or data.next_initial or data.initial, None
        assert label is not None
        assert data.initial is not None
        # From its second run on, a machine that has none of these is entered by the parent's loop.
        # Whatever changes one of them replaces EPOCH's value, which makes `plain_plan` stale.
        callbacks = data.start_cbs or data.transition_cbs or data.termination_cbs
        keys = data.input_keys or data.output_keys
        must_be_called = callbacks or keys or data.listeners or data.buffers
        plan.first = plan.steps[data.initial]
        data.plain_plan = None if must_be_called else plan
        logged = frame.run.logged
        if logged:
            log.loginfo(f"{frame.path}: starting in {label!r}, keys {self.userdata.keys()}")
        outcome = _run(frame, plan.steps[label]).outcome
        if logged:
            log.loginfo(f"{frame.path}: {frame.step.label!r} ended it with {outcome!r}")
        return outcome


class Sequence(StateMachine):
    """States one after another: `connector_outcome` leads to the state added next.

    Args:
        outcomes: Outcomes.
        connector_outcome: Outcome that connects the states.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        name: Name of the machine when it is the root.
        userdata_type: A dataclass or TypedDict: the userdata has its fields, and their defaults.
        **options: See `StateOptions`.
    """

    _smachpy_kind: ClassVar[Kind] = "sequence"

    def __init__(
        self,
        outcomes: Iterable[str],
        connector_outcome: str,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        problems = Problems(type(self).__name__)
        with problems:
            super().__init__(
                outcomes, input_keys, output_keys, name=name, userdata_type=userdata_type, **options
            )
        self._smachpy.connector_outcome = problems.word("connector_outcome", connector_outcome)
        problems.raise_all()

    @construction_method
    def add(  # type: ignore[override]  # as in SMACH: no constants
        self: Sequence,
        label: str,
        state: State,
        transitions: Mapping[str, str | None] | None = None,
        remapping: Mapping[str, str] | None = None,
    ) -> State:
        """Add a state after the previous one; the arguments are those of `StateMachine.add`.

        An explicit transition for the connector outcome takes precedence over the connection.
        """
        return self._smachpy_add(label, state, transitions, remapping, None)


def _run(base: Frame, step: Step) -> End:  # noqa: C901, PLR0912, PLR0915  see below
    """Run step after step; return the end of the machine, with the last step still in its frame.

    This is the hot path, so it is one loop: while nobody watches or asks for a preempt, a
    transition is one call, one look-up and a few flags. A nested machine that has a `plain_plan` is
    entered and left inside the loop without a call, in a third of the time: `frame` is then the
    innermost frame, `machine` and `data` belong to it, and the machines around it are found through
    `parent`. Every other container is called; `Container.execute` does the same steps as written
    out here. While somebody watches, all containers are called, because the events of a child go
    around its call.
    """
    frame, run, first = base, base.run, base.first
    machine: Any = base.container
    data: Any = base.data
    parent: Any
    state: Any
    following: Following = step
    try:
        while True:
            try:
                # Turns until something is raised; after an interruption the outer loop goes on.
                while True:
                    # Leave machines that have ended; each end is an outcome of the one around it.
                    while following.final:
                        if frame is base:
                            return following
                        outcome, parent = following.outcome, frame.parent
                        first.innermost = parent
                        # The order matters: see the end of `Container.__run`.
                        if data.frame is frame:
                            data.frame = None
                            data.answered = frame.answered
                        if (
                            machine._preempt_requested
                            or frame.visit is not None
                            or data.end_waiters
                        ):
                            leave(frame)
                        frame = parent
                        machine = frame.container
                        data = frame.data
                        step = frame.step
                        if machine._preempt_requested or frame.visit is not None:
                            following = _follow_asked(frame, step, outcome)
                        else:
                            try:
                                following = step.next[outcome]
                            except KeyError:
                                _raise_bad_outcome(frame, step, outcome)
                    step = following
                    # First write the step, then read the flags: see `smachpy.run.grace.ask`.
                    frame.step = step
                    if machine._preempt_requested or frame.visit is not None or data.transition_cbs:
                        following = _careful(frame, step)
                        continue
                    # Somebody watches: the loops below publish the events.
                    if run.watched:
                        if run.careful:
                            following = _careful(frame, step)
                        elif (buffer := only_buffer(frame)) is not None:
                            following = _buffered(frame, step, buffer)
                        else:
                            following = _follow(frame, step, run_watched(frame, step))
                        continue
                    # Enter a nested machine, unless it is running already (then it is called, and
                    # refuses that) or its plan is stale.
                    state, nested = step.state, step.nested
                    if nested is not None and nested.frame is None:
                        plan = nested.plain_plan
                        if (
                            plan is not None
                            and plan.epoch is EPOCH.value
                            and plan.userdata is state.userdata
                        ):
                            parent, frame, machine = frame, Frame(), state
                            frame.container = machine
                            frame.data = data = nested
                            frame.parent = parent
                            frame.run = run
                            frame.first = first
                            frame.above = step
                            frame.visit = None
                            frame.answered = False
                            data.frame = first.innermost = frame
                            following = plan.first
                            continue
                    execute = step.execute  # in a call, `step.execute(...)`, it is found slower
                    outcome = execute(step.userdata)
                    if (
                        machine._preempt_requested
                        or frame.visit is not None
                        or state._preempt_requested
                    ):
                        following = _follow_asked(frame, step, outcome)
                    else:
                        try:
                            following = step.next[outcome]
                        except (KeyError, TypeError):
                            _raise_bad_outcome(frame, step, outcome)
            except Interruption:
                following = _follow_interrupted(frame)
            except SmachError:
                raise
            except Exception as error:
                step = frame.step
                raise user_error(step.path_in(frame), step.state, error) from error
    finally:
        # Something was raised inside machines that this loop has entered: leave them.
        while frame is not base:
            machine, parent = frame.container, frame.parent
            first.innermost = parent
            data = frame.data
            if data.frame is frame:
                data.frame = None
                data.answered = frame.answered
            leave(frame)
            frame = parent


def _buffered(frame: Frame, step: Step, buffer: EventBuffer) -> Following:
    """Run step after step as `_run` does, while one event buffer is the only subscriber.

    Returns to `_run` with the next step as soon as anything else is to be done. It is a loop of its
    own because one entry of the buffer records both the end of a step and the begin of the next
    one, with one look at the clock. So a recorded transition costs little more than a plain one.
    """
    run, changes, container = frame.run, EPOCH, frame.container
    epoch = changes.value
    if frame.data.transition_cbs or run.careful:
        return step
    base, now = frame.path, run.clock.now
    run.flush()
    buffer.put((now(), base, None, None, step))
    while True:
        # As many rounds as the buffer has room for, so that no round has to look.
        rounds, note = buffer.room()
        for _ in rounds:
            try:
                window = step.watched_userdata(frame) if step.writes else step.userdata
                outcome = step.execute(window)
            except BaseException as error:
                publish_raised(frame, error)
                raise
            if (
                container._preempt_requested
                or frame.visit is not None
                or step.state._preempt_requested
            ):
                publish_left(frame, step, outcome)
                return _follow_asked(frame, step, outcome)
            try:
                following: Following = step.next[outcome]
            except (KeyError, TypeError):
                publish_left(frame, step, outcome)
                _raise_bad_outcome(frame, step, outcome)
            if following.final:
                buffer.put((now(), base, step, outcome, None))
                return following
            frame.step = following  # first write the step, then read the flags, as in `_run`
            if (
                container._preempt_requested
                or frame.visit is not None
                or changes.value is not epoch
            ):
                # The end of `step` is not in the buffer yet, and an event is about `frame.step`.
                frame.step = step
                publish_left(frame, step, outcome)
                frame.step = following
                return following
            note((now(), base, step, outcome, following))
            if buffer.quiet:
                buffer.ring()
            step = following


def _careful(frame: Frame, step: Step) -> Following:
    """Run one step with all checks: control, shutdown check, preempt, log, transition callbacks."""
    run = frame.run
    visit = frame.visit
    if visit is not None and visit.step is not step:  # the step before, asked after its end
        forget_visit(frame)
    if run.control is not None:
        run.control.pass_gate(frame, step)  # blocks while the machine is paused
        # An operator has called this one step off meanwhile: it is not started.
        called_off = frame.visit is not None and not frame.container._preempt_requested
        if called_off:
            return _follow_asked(frame, step, "preempted")
    if run.has_shutdown_check and is_shutdown():
        with asking("shutdown", "", "the shutdown check says so"):
            request_soon(frame.container)
    if frame.container._preempt_requested:
        return _preempted(frame, step)
    outcome = run_watched(frame, step) if run.watched else step.execute(step.userdata)
    following = _follow(frame, step, outcome)
    if following.final or not (frame.data.transition_cbs or run.logged):
        return following
    frame.step = following  # the callbacks see the next child as the active one, as in SMACH
    if run.logged:
        log.loginfo(f"{frame.path}: {step.label!r} -{outcome}-> {following.label!r}")
    return _call_between(frame, following)


def _call_between(frame: Frame, following: Step) -> Following:
    """Call the transition callbacks; return the next step, or the end if one was interrupted."""
    container: Any = frame.container
    try:
        container.call_transition_cbs()
    except Interruption:
        if frame.dead:
            raise
        return _preempted(frame, following)
    return following


def _follow(frame: Frame, step: Step, outcome: Any) -> Following:
    """Return what follows `step`, which ended with `outcome`."""
    if (
        frame.container._preempt_requested
        or frame.visit is not None
        or step.state._preempt_requested
    ):
        return _follow_asked(frame, step, outcome)
    try:
        following: Following = step.next[outcome]
    except (KeyError, TypeError):
        _raise_bad_outcome(frame, step, outcome)
    return following


def _follow_asked(frame: Frame, step: Step, outcome: Any) -> Following:
    """Return what follows `step` if it or its machine may have been asked to stop."""
    decision = end_visit(frame, outcome)
    if decision.why is Why.STOPPED:
        return _preempted(frame, step)
    if decision.why is Why.JUMPED:
        frame.emit_own(Jumped, decision.target)
        steps: dict[str, Following] = frame.data.plan.steps
        return step if decision.target == step.label else steps[decision.target]
    following: Following = decision.target
    return following


def _follow_interrupted(frame: Frame) -> Following:
    """Return what follows a child that was interrupted."""
    if frame.dead:
        raise Interruption
    try:
        return _follow_asked(frame, frame.step, "preempted")
    except Interruption:  # a second one was already pending
        if frame.dead:
            raise
        return _preempted(frame, frame.step)


def _preempted(frame: Frame, step: Step) -> End:
    """End because of a preempt; `step` was not started, or its outcome is not followed."""
    frame.end_preempted(step.label)
    return PREEMPTED


def _raise_bad_outcome(frame: Frame, step: Step, outcome: object) -> NoReturn:
    outcomes = step.state._smachpy.outcomes
    raise unknown_outcome(step.path_in(frame), outcomes, outcome) from None


def _current(machine: StateMachine, name: str) -> Any:
    """Return the attribute `name` of the running step; None between runs."""
    frame = machine._smachpy.frame
    return getattr(None if frame is None else frame.step, name, None)
