"""The iterator: runs its child once for each item."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.base.functions import name_of
from smachpy.base.problems import Problems, unknown_name
from smachpy.base.slips import accepts
from smachpy.engine.callback import call_bounded
from smachpy.engine.child import run_child
from smachpy.engine.described import ContainerData
from smachpy.engine.errors import unknown_outcome
from smachpy.engine.step import Plan
from smachpy.engine.visit import End, Why, following
from smachpy.events import Iterated
from smachpy.exceptions import (
    InvalidStateError,
    InvalidUserCodeError,
    error_text,
)
from smachpy.machines.construction import construction_method
from smachpy.machines.container import Container
from smachpy.machines.state import DataOf

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from collections.abc import Iterator as IteratorOf
    from typing import Unpack

    from smachpy.base.names import Names
    from smachpy.engine.frame import Frame
    from smachpy.engine.step import Step
    from smachpy.events.introspection import Kind, Structure
    from smachpy.machines.state import State, StateOptions

__all__ = ["Iterator"]

_PLAIN = frozenset({list, tuple, range, set, dict, str})  # iterating runs no code of the user
_END = object()


class IteratorData(ContainerData):
    """The library's data of one iterator; see the arguments of `Iterator`.

    Attributes:
        used_up: Items that give themselves, such as a generator, once a run has had all of them.
    """

    _kept = (
        *("items", "items_label", "exhausted_outcome"),
        *("loop_outcomes", "break_outcomes", "final_outcome_map"),
    )
    __slots__ = (*_kept, "used_up")

    def __init__(self) -> None:
        super().__init__()
        self.items: Any = ()
        self.used_up: Any = None
        self.items_label = ""
        self.exhausted_outcome = ""
        self.loop_outcomes: tuple[str, ...] = ()
        self.break_outcomes: tuple[str, ...] = ()
        self.final_outcome_map: dict[str, str] = {}


class Iterator(Container):
    """A container that runs its child once for each item.

    Args:
        outcomes: Outcomes; `exhausted_outcome` is added.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        it: The items: any iterable, or a function that returns one, called at each run. A generator
            lasts for one run; a second one that finds it used up raises an `InvalidUserCodeError`.
        it_label: Userdata key under which the child finds its item.
        exhausted_outcome: Outcome when no item is left.
        name: Name of the machine when it is the root.
        userdata_type: A dataclass or TypedDict: the userdata has its fields, and their defaults.
        userdata: Key -> value with which every run begins; a copy, so no run sees what the one
            before it has made of it.
        **options: See `StateOptions`.
    """

    _smachpy: DataOf[IteratorData] = DataOf(IteratorData)
    _smachpy_kind: ClassVar[Kind] = "iterator"

    def __init__(
        self,
        outcomes: Names,
        input_keys: Names,
        output_keys: Names,
        it: Iterable[Any] | Callable[[], Iterable[Any]] = (),
        it_label: str = "it_data",
        exhausted_outcome: str = "exhausted",
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        userdata: Mapping[str, Any] | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        problems = Problems(type(self).__name__)
        exhausted = problems.word("exhausted_outcome", exhausted_outcome)
        names = (*problems.names("outcomes", outcomes), *filter(None, [exhausted]))
        with problems:
            super().__init__(
                names,
                input_keys,
                output_keys,
                name=name,
                userdata_type=userdata_type,
                userdata=userdata,
                **options,
            )
        self.__set_items(it, it_label, problems)
        problems.raise_all()
        data = self._smachpy  # reset for a second call of __init__, as in Container
        data.exhausted_outcome = exhausted
        data.loop_outcomes = data.break_outcomes = ()
        data.final_outcome_map = {}

    @construction_method
    def set_iteritems(
        self: Iterator,
        it: Iterable[Any] | Callable[[], Iterable[Any]],
        it_label: str = "it_data",
    ) -> None:
        """Set the items and the userdata key of the current one.

        Raises:
            InvalidStateError: `it` is not iterable, or `it_label` is not a name.
        """
        problems = Problems(type(self).__name__)
        self.__set_items(it, it_label, problems)
        problems.raise_all()

    @construction_method
    def set_contained_state(
        self: Iterator,
        label: str,
        state: State,
        loop_outcomes: Names = (),
        break_outcomes: Names = (),
        final_outcome_map: Mapping[str, str] | None = None,
        *,
        remapping: Mapping[str, str] | None = None,
    ) -> State:
        """Set the child.

        Args:
            label: Its name here.
            state: The child.
            loop_outcomes: Outcomes that continue with the next item. Without these and without
                `break_outcomes`, all outcomes do.
            break_outcomes: Outcomes that end the iterator; they take precedence over
                `loop_outcomes`.
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
        # A new child replaces the old one, which stays if the new one is refused.
        data = self._smachpy
        before, old = (data.children, data.remappings), data.others()
        data.children = {name: each for name, each in data.children.items() if name not in old}
        data.remappings = {name: data.remappings[name] for name in data.children}
        try:
            self._smachpy_store_child(label, state, remapping, problems)
        except InvalidStateError:
            data.children, data.remappings = before
            raise
        data.loop_outcomes, data.break_outcomes = loop, breaks
        data.final_outcome_map = final
        return state

    def __set_items(self, it: Any, it_label: Any, problems: Problems) -> None:
        if not (callable(it) or hasattr(it, "__iter__") or hasattr(it, "__getitem__")):
            problems.add(f"it: got {it!r}; expected items, or a function that returns them.")
        self._smachpy.items = it
        self._smachpy.items_label = problems.word("it_label", it_label)

    # -- structure -----------------------------------------------------------------------------

    def __breaks(self) -> frozenset[str]:
        """Return the child's outcomes that end the iterator."""
        data = self._smachpy
        if data.break_outcomes:
            return frozenset(data.break_outcomes)
        if not data.loop_outcomes:
            return frozenset()
        outcomes = (o for state in data.others().values() for o in state._smachpy.outcomes)
        return frozenset(outcomes).difference(data.loop_outcomes)

    def get_active_states(self) -> list[str]:
        """Return the child's label while the iterator runs."""
        frame = self._smachpy.live.frame
        if frame is None:
            return []
        return list(self._smachpy.others()) if frame.tidying is None else [self._smachpy.cleanup]

    def find_problems(self, where: str) -> tuple[str, ...]:
        """Return the problems of this iterator itself."""
        data, problems = self._smachpy, []
        if not data.others():
            return (f"{where}: contained state: got none; expected one. Try set_contained_state.",)
        ((label, state),) = data.others().items()
        outcomes, final = state._smachpy.outcomes, data.final_outcome_map
        # Without `break_outcomes`, all that is no loop outcome breaks; 'preempted' needs no way on.
        breaks = data.break_outcomes or tuple(
            o for o in outcomes if o in self.__breaks() and o != "preempted"
        )
        for what, names in (
            ("loop", data.loop_outcomes),
            ("break", breaks),
            ("final", [name for name in final if name != data.exhausted_outcome]),
        ):
            problems += [
                unknown_name(f"{where}/{label}: {what} outcome", name, outcomes)
                for name in names
                if name not in outcomes
            ]
        for name in (*breaks, data.exhausted_outcome):
            end = final.get(name, name)
            if end not in data.outcomes:
                problems.append(
                    unknown_name(f"{where}: outcome after {name!r}", end, data.outcomes)
                )
        return tuple(problem for problem in problems if not accepts(problem))

    def describe_structure(self) -> Structure:
        """Return the child, its edges and the loop's rules."""
        from dataclasses import replace

        from smachpy.events.introspection import RuleRecord, TransitionRecord

        structure, data = super().describe_structure(), self._smachpy
        if not data.others():
            return structure
        ((label, state),) = data.others().items()
        breaks, final = self.__breaks(), data.final_outcome_map
        edges = tuple(
            TransitionRecord(
                label, o, final.get(o, o), target_is_outcome=True, implicit=o not in final
            )
            if o in breaks
            else TransitionRecord(label, o, label)
            for o in state._smachpy.outcomes
        )
        end = final.get(data.exhausted_outcome, data.exhausted_outcome)
        rules = (RuleRecord(end, (), "no item left"),)
        details = (("items", _describe_items(data.items)), ("item key", data.items_label))
        return replace(structure, transitions=edges, rules=rules, details=details)

    # -- running -------------------------------------------------------------------------------

    def _smachpy_compile(self) -> Plan:
        plan, breaks = Plan(self), self.__breaks()
        for step in plan.steps.values():  # it leads to itself for the next item, or to an end
            step.next = {
                outcome: following(outcome, End(outcome) if outcome in breaks else step)
                for outcome in step.state._smachpy.outcomes
            }
        return plan

    def _smachpy_run_children(self, frame: Frame, plan: Plan) -> str:
        if self._smachpy.start_cbs and not frame.run.journal.has_begun(frame.path):
            self.call_start_cbs()
        (step,) = plan.steps.values()
        outcome = self.__loop(frame, step)
        outcome = self._smachpy.final_outcome_map.get(outcome, outcome)
        if outcome not in self._smachpy.outcomes and outcome != "preempted":
            raise unknown_outcome(frame.path, self._smachpy.outcomes, outcome)
        return outcome

    def __loop(self, frame: Frame, step: Step) -> str:
        """Run the child for item after item; return its last outcome, or the exhausted one."""
        run = frame.run
        for index in self.__numbers(frame):
            if self._preempt_requested:  # asked between two items
                return frame.end_preempted(step.label)
            if run.watched:
                frame.emit_own(Iterated, index)
            decision = run_child(frame, step)
            while decision.why is Why.JUMPED:  # after a pause that cancelled the child
                decision = run_child(frame, step)
            if decision.why is Why.STOPPED:
                return frame.end_preempted(step.label)
            outcome: str = decision.outcome
            if decision.why is Why.ANSWERED:
                frame.answered = True
                return outcome
            if decision.target.final:
                return outcome
            if self._smachpy.transition_cbs:
                self.call_transition_cbs()
        return self._smachpy.exhausted_outcome

    def __numbers(self, frame: Frame) -> IteratorOf[int]:
        """Write each item to the userdata and yield its number.

        A resumed durable run skips the items that were done.
        """
        journal, index = frame.run.journal, -1
        for index, item in enumerate(self.__iterate(frame)):
            place = journal.item(frame, index)
            if place > 0:
                self.userdata[self._smachpy.items_label] = item
            if place >= 0:
                yield index
        journal.check_items(frame, index + 1)

    def __iterate(self, frame: Frame) -> IteratorOf[Any]:
        """Yield the items; an exception of the user's iterable names the iterator."""

        # A generator of the user's may block like any callback, so the grace bounds each step.
        def call(function: Callable[..., Any], *arguments: Any) -> Any:
            return call_bounded(self, frame, function, arguments)

        data, is_used_up = self._smachpy, False
        try:
            items = data.items
            if _is_function(items):
                items = call(items)
            if type(items) in _PLAIN:
                yield from items
                return
            iterator = call(iter, items)
            item = call(next, iterator, _END)
            is_used_up = item is _END and iterator is data.used_up
            while item is not _END:
                yield item
                item = call(next, iterator, _END)
            data.used_up = iterator if iterator is items else None
        except Exception as error:
            raise InvalidUserCodeError(
                f"{frame.path}: items: {error_text(error)}; expected an iterable.",
                path=frame.path,
            ) from error
        if is_used_up:
            problem = (
                f"{frame.path}: items: got a {type(data.used_up).__name__} that an earlier run has "
                "used up; expected items that can be had again. Try a list, or a function that "
                "returns them."
            )
            if not accepts(problem):
                raise InvalidUserCodeError(problem, path=frame.path)


def _is_function(items: Any) -> bool:
    """Return whether a call returns the items; an `Enum` can be called, too, but has items."""
    return callable(items) and not (isinstance(items, type) and hasattr(type(items), "__iter__"))


def _describe_items(items: Any) -> str:
    if _is_function(items):
        return f"{name_of(items)}()"
    if isinstance(items, range):
        return str(items)
    try:
        return f"{len(items)} items"
    except TypeError:
        return type(items).__name__
