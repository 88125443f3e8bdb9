"""The structure of a machine as data, for pictures and viewers.

`describe` walks a machine and returns one recursive, immutable record, which survives a round trip
through JSON. Events (`smachpy.events`) describe a run; their paths are the paths of these records.
"""

from __future__ import annotations

from dataclasses import MISSING, asdict, dataclass, field, fields, is_dataclass
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Literal,
    Protocol,
    TypeAlias,
    get_args,
    get_origin,
    get_type_hints,
)

from smachpy.exceptions import InvalidStateError
from smachpy.machines.problems import missing_init

if TYPE_CHECKING:
    from collections.abc import Iterator

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
    """

    source: str
    outcome: str
    target: str
    target_is_outcome: bool = False
    implicit: bool = False


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

    @property
    def is_container(self) -> bool:
        """Whether its kind can have children."""
        return self.kind in {"machine", "sequence", "concurrence", "iterator", "plan"}

    def walk(self) -> Iterator[StateRecord]:
        """Yield this record and all below it, parents first."""
        yield self
        for child in self.children:
            yield from child.walk()

    def to_json(self, *, indent: int | None = None) -> str:
        """Return the record as JSON text."""
        import json

        return json.dumps(asdict(self), ensure_ascii=False, indent=indent)

    @classmethod
    def from_json(cls, text: str) -> StateRecord:
        """Rebuild a record from `to_json` text.

        Raises:
            ValueError: The text is not JSON, or a field is wrong; with the path of that field.
        """
        import json

        record: StateRecord = _record(StateRecord, json.loads(text), "$")
        return record


class Described(Protocol):
    """The methods of a state that `describe` uses."""

    _smachpy_is_container: ClassVar[bool]

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
        if not hint:
            raise
        raise InvalidStateError(
            f"{path}: state: got a {type(state).__name__} that is not initialised.{hint}"
        ) from error
    structure = state.describe_structure()
    children = tuple(
        _describe(child, f"{path}/{child_label}", child_label, child_remapping)
        for child_label, child, child_remapping in structure.children
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
    )


def _first_paragraph(state: Described) -> str:
    cls = type(state)
    # The docstrings of the library's own classes say nothing about this mission.
    if cls.__module__.partition(".")[0] == "smachpy":
        return ""
    doc = cls.__dict__.get("__doc__") or ""
    return " ".join(doc.strip().split("\n\n")[0].split())


def _rebuilt(kind: Any, data: Any, where: str) -> Any:
    """Convert `data`, read from JSON, to the annotated type `kind`."""
    arguments = get_args(kind)
    if NetRecord in arguments and data is not None:  # "or None"
        kind = NetRecord
    if is_dataclass(kind):
        return _record(kind, data, where)
    if get_origin(kind) is tuple:
        if isinstance(data, list) and arguments[1] is Ellipsis:
            return tuple(_rebuilt(arguments[0], one, f"{where}[{i}]") for i, one in enumerate(data))
        if isinstance(data, list) and len(data) == len(arguments):
            return tuple(
                _rebuilt(one, part, where) for one, part in zip(arguments, data, strict=True)
            )
        expected = "a list" if arguments[1] is Ellipsis else f"a list of {len(arguments)}"
    elif get_origin(kind) is Literal:
        if isinstance(data, str) and data in arguments:
            return data
        expected = f"one of {sorted(arguments)}"
    elif isinstance(data, kind):  # a class, or a union of some
        return data
    else:
        expected = {bool: "true or false", int: "a number"}.get(kind, "a text")
    raise ValueError(f"{where}: got {data!r}; expected {expected}.")


def _record(cls: Any, data: Any, where: str) -> Any:
    if not isinstance(data, dict):
        raise ValueError(f"{where}: got {type(data).__name__}; expected an object.")  # noqa: TRY004
    hints, slots = get_type_hints(cls), fields(cls)
    unknown = sorted(set(data) - set(hints))
    missing = sorted(
        slot.name for slot in slots if slot.default is MISSING and slot.name not in data
    )
    if unknown or missing:
        raise ValueError(f"{where}: got unknown fields {unknown}, missing fields {missing}.")
    return cls(**{n: _rebuilt(hints[n], part, f"{where}.{n}") for n, part in data.items()})


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
