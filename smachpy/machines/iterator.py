"""The iterator: one child again and again, once for each item."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.events import Iterated, Preempted
from smachpy.exceptions import (
    InconsistentMachineError,
    InvalidStateError,
    InvalidUserCodeError,
    SmachError,
    did_you_mean,
)
from smachpy.introspection import RuleRecord, Structure, TransitionRecord
from smachpy.machines.construction import construction_method
from smachpy.machines.container import Container
from smachpy.machines.old_states import as_state
from smachpy.machines.problems import Problems
from smachpy.machines.spec import ChildSpec, LoopSpec
from smachpy.machines.validate import loop_problems
from smachpy.run.callback import call_bounded
from smachpy.run.interrupt import Interruption
from smachpy.run.runner import end_visit, run_watched, unknown_outcome, user_error
from smachpy.run.visit import End, Why
from smachpy.slips import accepting

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from collections.abc import Iterator as IteratorOf
    from collections.abc import Sequence as SequenceOf
    from typing import Unpack

    from smachpy.introspection import Kind
    from smachpy.machines.state import State, StateOptions
    from smachpy.run.frame import Frame
    from smachpy.run.step import Step
    from smachpy.userdata.user_data import UserData

__all__ = ["Iterator"]

_PLAIN = frozenset({list, tuple, range, set, dict, str})  # iterating runs no code of the user
_END = object()


class _Plan:
    """An iterator, compiled: its step leads to itself for the next item, or to an end."""

    __slots__ = ("epoch", "step", "userdata")

    def __init__(self, iterator: Iterator, step: Step, breaks: frozenset[str]) -> None:
        self.epoch = 0
        self.userdata = iterator.userdata
        self.step = step
        step.next = {
            outcome: End(outcome) if outcome in breaks else step
            for outcome in step.state._smachpy.outcomes
        }

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

    _smachpy_kind: ClassVar[Kind] = "iterator"

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
        problems = Problems(type(self).__name__)
        self._exhausted_outcome = problems.word("exhausted_outcome", exhausted_outcome)
        names = (*problems.names("outcomes", outcomes), self._exhausted_outcome)
        with problems:
            super().__init__(
                names, input_keys, output_keys, name=name, userdata_type=userdata_type, **options
            )
        self._set_items(it, it_label, problems)
        problems.raise_all()
        self._loop_outcomes: tuple[str, ...] = ()
        self._break_outcomes: tuple[str, ...] = ()
        self._final_outcome_map: dict[str, str] = {}

    @construction_method
    def set_iteritems(
        self: Iterator,
        it: Iterable[Any] | Callable[[], Iterable[Any]],
        it_label: str = "it_data",
    ) -> None:
        """Set the items and the userdata key of the current one.

        Raises:
            InvalidStateError: `it` cannot be iterated, or `it_label` is no name.
        """
        problems = Problems(type(self).__name__)
        self._set_items(it, it_label, problems)
        problems.raise_all()

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
        problems = Problems(str(label))
        loop = problems.names("loop_outcomes", loop_outcomes)
        breaks = problems.names("break_outcomes", break_outcomes)
        final = problems.names_of("final_outcome_map", final_outcome_map, "outcome -> outcome")
        before = self._states, self._remappings
        self._states, self._remappings = {}, {}
        try:
            stored = as_state(state, label) if accepting() else state
            self._store_child(label, stored, remapping, problems)
        except InvalidStateError:
            self._states, self._remappings = before
            raise
        self._loop_outcomes, self._break_outcomes = loop, breaks
        self._final_outcome_map = final
        return state

    def _set_items(self, it: Any, it_label: Any, problems: Problems) -> None:
        if not (callable(it) or hasattr(it, "__iter__") or hasattr(it, "__getitem__")):
            problems.add(f"it: got {it!r}; expected items, or a function that returns them.")
        self._items: Any = it
        self._items_label = problems.word("it_label", it_label)

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
        return list(self._states) if self._smachpy.frame is not None else []

    @property
    def _is_running(self) -> bool:
        return self._smachpy.frame is not None

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
            self._smachpy.outcomes,
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
        return _Plan(self, self._make_step(label), self._breaks())

    def _run_children(self, frame: Frame, plan: _Plan) -> str:
        if self._start_cbs:
            self.call_start_cbs()
        outcome = self._loop(frame, plan.step)
        outcome = self._final_outcome_map.get(outcome, outcome)
        if outcome not in self._smachpy.outcomes and outcome != "preempted":
            raise unknown_outcome(frame.path, self._smachpy.outcomes, outcome)
        return outcome

    def _terminal_labels(self, frame: Frame) -> list[str]:
        """Return the child, as in SMACH; even when there was no item."""
        super()._terminal_labels(frame)
        assert self._label is not None
        return [self._label]

    def _loop(self, frame: Frame, step: Step) -> str:
        """Run the child for item after item; return its last outcome, or that of the end."""
        run, label = frame.run, self._items_label
        for index, item in enumerate(self._iterate(frame)):
            self.userdata[label] = item
            frame.step = step  # first the mark, then the look: see `smachpy.run.grace.ask`
            if self._preempt_requested:
                return self._preempted(frame, step)
            if run.watched:
                frame.emit_own(Iterated, index)
            again = True
            while again:
                outcome, why = self._visit(frame, step)
                again = why is Why.JUMPED  # a pause has cancelled it: again with the same item
            if why is Why.STOPPED:
                return self._preempted(frame, step)
            if why is Why.ANSWERED:
                frame.answered = True
                return outcome
            if step.next[outcome].final:
                return outcome
            if self._transition_cbs:
                self.call_transition_cbs()
        return self._exhausted_outcome

    def _visit(self, frame: Frame, step: Step) -> tuple[str, Why]:
        """Run the child once; return its outcome, or an operator's, and what comes of it."""
        try:
            outcome: Any = self._run_child(frame, step)
        except SmachError:
            raise
        except Interruption:
            if frame.dead:
                raise
            outcome = "preempted"
        except Exception as error:
            raise user_error(step.path_in(frame), step.state, error) from error
        visit = frame.visit
        override = None if visit is None else visit.override
        asked = self._preempt_requested or visit is not None or step.state._preempt_requested
        if not asked and isinstance(outcome, str) and outcome in step.next:
            return outcome, Why.FOLLOWED
        why = end_visit(frame, outcome).why
        if why is Why.FORCED and override is not None and override.outcome is not None:
            outcome = override.outcome
        return outcome, why

    def _run_child(self, frame: Frame, step: Step) -> Any:
        run = frame.run
        if run.control is not None:
            run.control.pass_gate(frame, step)
            if self._preempt_requested or frame.visit is not None:  # called off while it was held
                return "preempted"
        return run_watched(frame, step) if run.watched else step.execute(step.userdata)

    def _preempted(self, frame: Frame, step: Step) -> str:
        frame.answered = True
        frame.emit_own(Preempted, step.label)
        return "preempted"

    def _iterate(self, frame: Frame) -> IteratorOf[Any]:
        """Return the items' iterator; what making or running it raises names the iterator."""

        def call(function: Callable[..., Any], *arguments: Any) -> Any:
            return call_bounded(self, frame, function, arguments)

        try:
            items = call(self._items) if callable(self._items) else self._items
            if type(items) in _PLAIN:
                yield from items
                return
            iterator = call(iter, items)
            while (item := call(next, iterator, _END)) is not _END:
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
