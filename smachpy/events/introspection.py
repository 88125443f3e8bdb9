"""The structure of a machine as data, for pictures and viewers.

`describe` walks a machine and returns one recursive, immutable record, which survives a round trip
through JSON. Events (`smachpy.events`) describe a run; their paths are the paths of these records.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol, TypeAlias, get_args

from smachpy.base.problems import missing_init
from smachpy.base.slips import accepts
from smachpy.events.outcome_classes import outcome_class
from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smachpy.events.outcome_classes import OutcomeClass

__all__ = [
    "INIT_TOPIC",
    "KINDS",
    "STATUS_TOPIC",
    "STRUCTURE_TOPIC",
    "ContainerProxy",
    "IntrospectionClient",
    "IntrospectionServer",
    "Kind",
    "RuleRecord",
    "StateRecord",
    "Structure",
    "TransitionRecord",
    "describe",
]

Kind: TypeAlias = Literal[
    "state",
    "callback",
    "action",
    "service",
    "monitor",
    "condition",
    "machine",
    "sequence",
    "concurrence",
    "iterator",
    "plan",
]
"""The kinds of states: `StateRecord.kind`."""

KINDS: frozenset[str] = frozenset(get_args(Kind))

MAX_NESTING = 800
"""Levels of JSON of the deepest machine, which are more than those of its states."""


@dataclass(frozen=True, slots=True)
class TransitionRecord:
    """One edge inside a container.

    Attributes:
        source: Label of the child that the edge leaves.
        outcome: Outcome of that child.
        target: Label of another child, or an outcome of the container.
        target_is_outcome: Whether `target` is an outcome.
        implicit: The user did not write the edge: it leads to the container's outcome of the same
            name.
        guard: Its condition as text; "" if it has none, or leads on if no other condition holds.
    """

    source: str
    outcome: str
    target: str
    target_is_outcome: bool = False
    implicit: bool = False
    guard: str = ""


@dataclass(frozen=True, slots=True)
class RuleRecord:
    """A rule by which a container derives its outcome from its children's outcomes.

    Attributes:
        outcome: Outcome of the container.
        conditions: Pairs (child label, child outcome) that the rule names.
        text: The rule in words, for a picture ("any of DRIVE:failed, WATCH:low").
    """

    outcome: str
    conditions: tuple[tuple[str, str], ...] = ()
    text: str = ""


@dataclass(frozen=True, slots=True)
class PlaceRecord:
    """A place of a plan.

    Attributes:
        id: Its id.
        name: Its label.
        tokens: Its tokens in the initial marking.
        child: Label of the child that runs while the place is marked, or "".
        role: Its role in the plan.
    """

    id: str
    name: str
    tokens: int = 0
    child: str = ""
    role: Literal["place", "goal", "fail"] = "place"


@dataclass(frozen=True, slots=True)
class NetTransitionRecord:
    """A transition of a plan.

    Attributes:
        id: Its id.
        name: Its label.
        guard: Its condition as text, or "".
        calls: Pairs (label of a child, what happens to it: "start", "end", "interrupt", ...).
        inputs: Pairs (id of a place, weight) from which it takes tokens.
        outputs: Pairs (id of a place, weight) to which it gives tokens.
    """

    id: str
    name: str
    guard: str = ""
    calls: tuple[tuple[str, str], ...] = ()
    inputs: tuple[tuple[str, int], ...] = ()
    outputs: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, slots=True)
class NetRecord:
    """The Petri net of a plan.

    Attributes:
        places: In the order of the document.
        transitions: Likewise.
    """

    places: tuple[PlaceRecord, ...] = ()
    transitions: tuple[NetTransitionRecord, ...] = ()


@dataclass(frozen=True, slots=True)
class StateRecord:
    """One state, with everything below it.

    Attributes:
        path: Absolute path ("/PATROL/DRIVE"); that of the root is "/" and its name.
        label: Last part of the path.
        kind: Kind of state.
        type_name: Class name.
        outcomes: Registered outcomes, in the order of their declaration.
        input_keys: Userdata keys it may read.
        output_keys: Userdata keys it may write.
        remapping: Pairs (key of the state, key of its container).
        doc: First paragraph of the class's docstring, or "".
        details: Pairs (name, text): action name, action type, timeout, retry, …
        children: Records of the children, in the order in which they were added.
        initial: Labels of the children that run first.
        transitions: Edges between the children and to the outcomes.
        rules: Outcome rules of a concurrence, loop rules of an iterator.
        default_outcome: Outcome of a concurrence if no rule holds.
        net: The net of a plan.
        cleanup: Label of the child that runs at every end of the others, or "".
        success: The outcomes that are good; None goes by their names.
    """

    path: str
    label: str
    kind: Kind
    type_name: str
    outcomes: tuple[str, ...]
    input_keys: tuple[str, ...] = ()
    output_keys: tuple[str, ...] = ()
    remapping: tuple[tuple[str, str], ...] = ()
    doc: str = ""
    details: tuple[tuple[str, str], ...] = ()
    children: tuple[StateRecord, ...] = ()
    initial: tuple[str, ...] = ()
    transitions: tuple[TransitionRecord, ...] = ()
    rules: tuple[RuleRecord, ...] = ()
    default_outcome: str | None = None
    net: NetRecord | None = None
    cleanup: str = ""
    success: tuple[str, ...] | None = None

    def class_of(self, outcome: str) -> OutcomeClass:
        """Return the class of one of its outcomes."""
        return outcome_class(outcome, self.success)

    @property
    def is_container(self) -> bool:
        """Whether its kind can have children."""
        return self.kind in {"machine", "sequence", "concurrence", "iterator", "plan"}

    @property
    def others(self) -> tuple[StateRecord, ...]:
        """All children except the clean-up."""
        return tuple(child for child in self.children if child.label != self.cleanup)

    def walk(self) -> Iterator[StateRecord]:
        """Yield this record and all below it, parents first."""
        # Without recursion: each record would pass through the generators of all above it.
        left = [self]
        while left:
            record = left.pop()
            yield record
            left += reversed(record.children)

    def to_json(self, *, indent: int | None = None) -> str:
        """Return the record as JSON text."""
        import json

        return json.dumps(asdict(self), ensure_ascii=False, indent=indent)

    @classmethod
    def from_json(cls, text: str) -> StateRecord:
        """Rebuild a record from `to_json` text.

        Raises:
            ValueError: the text is not JSON, or a field is wrong; with the path of that field.
        """
        from actionlib_core.inputs.checked_data import checked
        from actionlib_core.inputs.json_text import load_json

        record: StateRecord = checked(StateRecord, load_json(text, deepest=MAX_NESTING))
        return record


class Described(Protocol):
    """The methods of a state that `describe` uses."""

    _smachpy_is_container: ClassVar[bool]
    _smachpy_kind: ClassVar[Kind]

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]: ...
    def describe_structure(self) -> Structure: ...
    def get_registered_outcomes(self) -> tuple[str, ...]: ...
    def get_registered_input_keys(self) -> tuple[str, ...]: ...
    def get_registered_output_keys(self) -> tuple[str, ...]: ...


@dataclass(frozen=True, slots=True)
class Structure:
    """A container's part of its record; returned by `Container.describe_structure`."""

    children: tuple[tuple[str, Described, tuple[tuple[str, str], ...]], ...] = ()
    initial: tuple[str, ...] = ()
    transitions: tuple[TransitionRecord, ...] = ()
    rules: tuple[RuleRecord, ...] = ()
    default_outcome: str | None = None
    details: tuple[tuple[str, str], ...] = field(default=())
    net: NetRecord | None = None
    cleanup: str = ""
    success: tuple[str, ...] | None = None


def describe(machine: Described, *, name: str | None = None) -> StateRecord:
    """Return the structure of `machine` without running it, even if it has problems.

    Args:
        machine: Any state; a container is described with all its descendants.
        name: Label of the root; default: the container's `name`.
    """
    own = getattr(machine, "name", None) if machine._smachpy_is_container else None
    label = name or own or "SM_ROOT"
    return _describe(machine, f"/{label}", label, ())


def _describe(
    state: Described, path: str, label: str, remapping: tuple[tuple[str, str], ...]
) -> StateRecord:
    try:
        kind, details = state.describe_details()
    except AttributeError as error:
        hint = missing_init(state, error)
        problem = f"{path}: state: got a {type(state).__name__} that is not initialised.{hint}"
        if not hint:
            raise
        if not accepts(problem):
            raise InvalidStateError(problem) from error
        kind, details = state._smachpy_kind, ()
    structure = state.describe_structure()
    children = tuple(
        _describe(child, f"{path}/{child_label}", child_label, child_remapping)
        for child_label, child, child_remapping in structure.children
    )
    if structure.cleanup:
        children = tuple(
            replace(child, details=(*child.details, ("runs", "at any end")))
            if child.label == structure.cleanup
            else child
            for child in children
        )
    return StateRecord(
        path=path,
        label=label,
        kind=kind,
        type_name=type(state).__name__,
        outcomes=tuple(state.get_registered_outcomes()),
        input_keys=tuple(state.get_registered_input_keys()),
        output_keys=tuple(state.get_registered_output_keys()),
        remapping=remapping,
        doc=_first_paragraph(state),
        details=details + structure.details,
        children=children,
        initial=structure.initial,
        transitions=structure.transitions,
        rules=structure.rules,
        default_outcome=structure.default_outcome,
        net=structure.net,
        cleanup=structure.cleanup,
        success=structure.success,
    )


def _first_paragraph(state: Described) -> str:
    cls = type(state)
    # The docstrings of the library's own classes say nothing about this mission.
    if cls.__module__.partition(".")[0] == "smachpy":
        return ""
    doc = cls.__dict__.get("__doc__") or ""
    return " ".join(doc.strip().split("\n\n")[0].split())


INIT_TOPIC: str
STATUS_TOPIC: str
STRUCTURE_TOPIC: str
ContainerProxy: Any
IntrospectionClient: Any
IntrospectionServer: Any
# What smach_ros.introspection holds -> module that defines it; imported on first use.
_LAZY = {
    "INIT_TOPIC": "smachpy.network.server",
    "STATUS_TOPIC": "smachpy.network.server",
    "STRUCTURE_TOPIC": "smachpy.network.server",
    "ContainerProxy": "smachpy.network.server",
    "IntrospectionClient": "smachpy.network.client",
    "IntrospectionServer": "smachpy.network.server",
}


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        from importlib import import_module

        return getattr(import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'smachpy.introspection' has no attribute {name!r}")
