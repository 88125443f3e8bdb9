"""The iterator: one child again and again, once for each item."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from smachpy._construction import construction_method
from smachpy._core.names import unique_names
from smachpy._core.spec import ChildSpec, LoopSpec
from smachpy._core.validate import loop_problems
from smachpy._runtime.failures import unknown_outcome, user_error
from smachpy._runtime.interrupt import Interruption
from smachpy._runtime.step import run_watched
from smachpy._runtime.watch import disarm, has_answered
from smachpy.container import Container
from smachpy.events import Iterated, OutcomeForced, Preempted
from smachpy.exceptions import (
    InconsistentMachineError,
    InvalidStateError,
    InvalidUserCodeError,
    SmachError,
    did_you_mean,
)
from smachpy.introspection import RuleRecord, Structure, TransitionRecord

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from collections.abc import Iterator as IteratorOf
    from collections.abc import Sequence as SequenceOf
    from typing import Unpack

    from smachpy._runtime.frame import Frame
    from smachpy._runtime.step import Step
    from smachpy.introspection import Kind
    from smachpy.state import State, StateOptions
    from smachpy.user_data import UserData

__all__ = ["Iterator"]


class _Plan:
    """An iterator, compiled: its step and what each outcome of the child does."""

    __slots__ = ("breaks", "epoch", "outcomes", "step", "userdata")

    def __init__(self, iterator: Iterator, step: Step) -> None:
        self.epoch = 0
        self.userdata = iterator.userdata
        self.step = step
        self.breaks = iterator._breaks()  # noqa: SLF001  one module
        self.outcomes = frozenset(step.state.get_registered_outcomes())

    def is_stale(self) -> bool:
        return self.step.is_stale()


class Iterator(Container):
    """A container that runs its child once for each item.

    Args:
        outcomes: Outcomes; `exhausted_outcome` is added.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        it: The items: any iterable, or a function that returns one, called at each run.
        it_label: Userdata key under which the child finds its item.
        exhausted_outcome: Outcome when no item is left.
        name: Name of the machine when it is the root.
        userdata_type: A dataclass or TypedDict: the userdata has its fields, and their defaults.
        **options: See `StateOptions`.
    """

    kind: ClassVar[Kind] = "iterator"

    def __init__(
        self,
        outcomes: Iterable[str],
        input_keys: Iterable[str],
        output_keys: Iterable[str],
        it: Iterable[Any] | Callable[[], Iterable[Any]] = (),
        it_label: str = "it_data",
        exhausted_outcome: str = "exhausted",
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        names = (*unique_names(outcomes, "outcomes"), exhausted_outcome)
        super().__init__(
            names, input_keys, output_keys, name=name, userdata_type=userdata_type, **options
        )
        self._items: Any = it
        self._items_label = it_label
        self._exhausted_outcome = exhausted_outcome
        self._loop_outcomes: tuple[str, ...] = ()
        self._break_outcomes: tuple[str, ...] = ()
        self._final_outcome_map: dict[str, str] = {}

    @construction_method
    def set_iteritems(
        self: Iterator,
        it: Iterable[Any] | Callable[[], Iterable[Any]],
        it_label: str = "it_data",
    ) -> None:
        """Set the items and the userdata key of the current one."""
        self._items = it
        self._items_label = it_label

    @construction_method
    def set_contained_state(
        self: Iterator,
        label: str,
        state: State,
        loop_outcomes: Iterable[str] = (),
        break_outcomes: Iterable[str] = (),
        final_outcome_map: Mapping[str, str] | None = None,
        *,
        remapping: Mapping[str, str] | None = None,
    ) -> State:
        """Set the child.

        Args:
            label: Its name here.
            state: The child.
            loop_outcomes: Outcomes after which the next item comes. With neither these nor
                `break_outcomes`, all outcomes loop.
            break_outcomes: Outcomes that end the iterator; they win over `loop_outcomes`.
            final_outcome_map: Child outcome (or the exhausted outcome) -> outcome of the
                iterator; others keep their name.
            remapping: Key of the child -> key of the iterator's userdata.

        Returns:
            The child.
        """
        self._states.clear()
        self._remappings.clear()
        self._store_child(label, state, remapping)
        self._loop_outcomes = unique_names(loop_outcomes, "loop_outcomes")
        self._break_outcomes = unique_names(break_outcomes, "break_outcomes")
        self._final_outcome_map = dict(final_outcome_map or {})
        return state

    # -- structure -----------------------------------------------------------------------------

    @property
    def _label(self) -> str | None:
        return next(iter(self._states), None)

    def _breaks(self) -> frozenset[str]:
        """Return the child's outcomes that end the iterator."""
        if self._break_outcomes:
            return frozenset(self._break_outcomes)
        label = self._label
        if not self._loop_outcomes or label is None:
            return frozenset()
        outcomes = self._states[label].get_registered_outcomes()
        return frozenset(o for o in outcomes if o not in self._loop_outcomes)

    def get_initial_states(self) -> list[str]:
        """Return the child's label."""
        return list(self._states)

    def set_initial_state(
        self, initial_states: SequenceOf[str], userdata: UserData | None = None
    ) -> None:
        """Add to the userdata; there is only one state to begin with.

        Raises:
            InvalidStateError: a label that is not the child's.
        """
        unknown = sorted(set(initial_states) - set(self._states))
        if unknown:
            raise InvalidStateError(
                f"initial state: got {unknown}; expected {sorted(self._states)}."
                f"{did_you_mean(unknown[0], self._states)}"
            )
        if userdata is not None:
            self.userdata.update(userdata)

    def get_active_states(self) -> list[str]:
        """Return the child's label while the iterator runs."""
        return list(self._states) if self._frame is not None else []

    @property
    def _is_running(self) -> bool:
        return self._frame is not None

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return the edges as (outcome, from label, to label or container outcome)."""
        return [
            (edge.outcome, edge.source, edge.target)
            for edge in self.describe_structure().transitions
        ]

    def find_problems(self, where: str) -> tuple[str, ...]:
        """Return what is wrong with this iterator itself."""
        label = self._label
        child = None
        breaks: tuple[str, ...] = ()
        if label is not None:
            outcomes = tuple(self._states[label].get_registered_outcomes())
            child = ChildSpec(label, outcomes)
            breaks = self._break_outcomes or tuple(
                o for o in outcomes if o in self._breaks() and o != "preempted"
            )
        final = tuple(self._final_outcome_map.items())
        spec = LoopSpec(
            where,
            self._outcomes,
            child,
            self._exhausted_outcome,
            self._loop_outcomes,
            breaks,
            final,
        )
        return loop_problems(spec)

    def describe_structure(self) -> Structure:
        """Return the child, its edges and the loop's rules."""
        label = self._label
        if label is None:
            return Structure()
        state = self._states[label]
        breaks = self._breaks()
        final = self._final_outcome_map
        edges = tuple(
            TransitionRecord(
                label, o, final.get(o, o), target_is_outcome=True, implicit=o not in final
            )
            if o in breaks
            else TransitionRecord(label, o, label)
            for o in state.get_registered_outcomes()
        )
        end = final.get(self._exhausted_outcome, self._exhausted_outcome)
        rules = (RuleRecord(end, (), "no item left"),)
        details = (("items", _describe_items(self._items)), ("item key", self._items_label))
        children = ((label, state, tuple(self._remappings[label].items())),)
        return Structure(children, (label,), edges, rules, None, details)

    # -- running -------------------------------------------------------------------------------

    def _compile(self, frame: Frame) -> _Plan:
        problems = self.find_problems(frame.path)
        if problems:
            raise InconsistentMachineError(f"{type(self).__name__} {frame.path!r}", problems)
        label = self._label
        assert label is not None
        return _Plan(self, self._make_step(label))

    def _run_children(self, frame: Frame, plan: _Plan) -> str:
        if self._start_cbs:
            self.call_start_cbs()
        try:
            outcome = self._loop(frame, plan)
        except Interruption:  # it came just when the child had ended by itself
            if frame.dead:
                raise
            outcome, _ = self._after_preempt(frame, plan, "preempted")
        outcome = self._final_outcome_map.get(outcome, outcome)
        if outcome not in self._outcomes and outcome != "preempted":
            raise unknown_outcome(frame.path, self._outcomes, outcome)
        if self._termination_cbs:
            self.call_termination_cbs([plan.step.label], outcome)
        return outcome

    def _loop(self, frame: Frame, plan: _Plan) -> str:
        """Run the child for item after item; return its last outcome, or that of the end."""
        step = plan.step
        data = self.userdata._data  # noqa: SLF001  ours
        for index, item in enumerate(self._iterate(frame)):
            data[self._items_label] = item
            frame.step = step
            if self._preempt_requested:
                return self._preempted(frame, step)
            if frame.run.watched:
                frame.emit_own(Iterated, index)
            outcome = self._run_child(frame, step)
            if (
                self._preempt_requested or frame.told is not None or step.state._preempt_requested  # noqa: SLF001
            ):
                outcome, ends = self._after_preempt(frame, plan, outcome)
                if ends:
                    return outcome
            if outcome not in plan.outcomes:
                raise unknown_outcome(step.path_in(frame), plan.outcomes, outcome)
            if outcome in plan.breaks:
                return outcome
            if self._transition_cbs:
                self.call_transition_cbs()
        return self._exhausted_outcome

    def _run_child(self, frame: Frame, step: Step) -> str:
        """Run the child once."""
        run = frame.run
        if run.control is not None:
            run.control.pass_gate(frame, step)
            if self._preempt_requested or frame.told is not None:  # called off while it was held
                return "preempted"
        try:
            outcome: str = run_watched(frame, step) if run.watched else step.execute(step.userdata)
        except SmachError:
            raise
        except Interruption:
            if frame.dead:
                raise
            return "preempted"
        except Exception as error:
            raise user_error(step.path_in(frame), step.state, error) from error
        return outcome

    def _after_preempt(self, frame: Frame, plan: _Plan, outcome: str) -> tuple[str, bool]:
        """Return the outcome after a preempt, and whether it ends the iterator."""
        step = plan.step
        with self._lock:  # whoever passes a preempt on is done after this
            if frame.dead:
                raise Interruption
            answered = has_answered(frame, outcome)
            frame.answered = answered and self._preempt_requested
            disarm(frame)
            step.state.recall_preempt()
            override, frame.override = frame.override, None
        if not self._preempt_requested:
            if override is None:
                if outcome == "preempted" and outcome not in plan.outcomes:
                    return self._preempted(frame, step), True
                return outcome, False
            if override.outcome is None:  # a pause that cancels: this item again
                return self._once_more(frame, plan)
            frame.emit(OutcomeForced, override.outcome)
            return override.outcome, False
        if outcome in plan.breaks or answered:
            return outcome, True
        return self._preempted(frame, step), True

    def _once_more(self, frame: Frame, plan: _Plan) -> tuple[str, bool]:
        """Run the child again for the same item."""
        outcome = self._run_child(frame, plan.step)
        if self._preempt_requested or frame.told is not None:
            return self._after_preempt(frame, plan, outcome)
        return outcome, False

    def _preempted(self, frame: Frame, step: Step) -> str:
        frame.answered = True
        frame.emit_own(Preempted, step.label)
        return "preempted"

    def _iterate(self, frame: Frame) -> IteratorOf[Any]:
        """Return the items' iterator; what making or running it raises names the iterator."""
        try:
            items = self._items() if callable(self._items) else self._items
            iterator = iter(items)
            while True:
                try:
                    item = next(iterator)
                except StopIteration:
                    return
                yield item
        except Exception as error:
            raise InvalidUserCodeError(
                f"{frame.path}: items: {type(error).__name__}: {error}; expected an iterable.",
                path=frame.path,
            ) from error


def _describe_items(items: Any) -> str:
    if callable(items):
        return f"{getattr(items, '__qualname__', repr(items))}()"
    if isinstance(items, range):
        return str(items)
    try:
        return f"{len(items)} items"
    except TypeError:
        return type(items).__name__
