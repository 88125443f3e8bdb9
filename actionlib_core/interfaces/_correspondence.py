"""Correspondence of the fields of two messages: of ROS 1 and ROS 2, or of two distributions.

Fields correspond by name (ignoring case), otherwise by being the only fields of their type on both
sides. Each field of the user's message needs a counterpart. Further fields of the other message
keep their default values, or are left out on the way back.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, Literal

from actionlib_core.exceptions import CorrespondenceError, FieldError
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces._definition import FLOATS, INTEGERS, OCTETS
from actionlib_core.interfaces._values import coerced
from actionlib_core.time import Duration, Time

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actionlib_core.interfaces._definition import Field, FieldType
    from actionlib_core.interfaces._message import Message

    Convert = Callable[[Any], Any]

_TIMES = {
    "time": (Time, "builtin_interfaces/msg/Time"),
    "duration": (Duration, "builtin_interfaces/msg/Duration"),
}
_ONLY_ROS1 = {"std_msgs/Header": {"seq"}}
"""Fields that ROS 2 does not have: they are 0 on the way back."""


def converter(
    source: type[Message],
    target: type[Message],
    fields: Mapping[str, str] | None = None,
    *,
    whole: Literal["source", "target"] = "source",
    part: str = "",
) -> Convert:
    """Return a function that converts a `source` to a `target`; for one class, the identity.

    It accepts the values that `to_bytes` of the source accepts, and raises FieldError for others,
    and for times that the target cannot hold. Other values that only the target cannot hold are
    found when it is written.

    Args:
        source: Class of its argument.
        target: Class of its result.
        fields: Counterparts that do not follow from names and types: field of the side `whole` ->
            field of the other side; "" for a field without counterpart.
        whole: The side of which every field needs a counterpart.
        part: In front of the names of `fields` in the configuration, such as "goal.".

    Raises:
        CorrespondenceError: Fields have no counterpart; the error lists all of them.
    """
    if source is target:
        return lambda message: message
    pairs = _Pairs(whole, part)
    convert = pairs.message(source, target, "", dict(fields or {}))
    if pairs.problems:
        raise CorrespondenceError(*pairs.problems)

    def checked(message: Any) -> Any:
        with contextlib.suppress(AttributeError, TypeError, ValueError):
            return convert(message)
        # A value is not exactly of its field's type. `coerced` converts what may be converted, such
        # as a stamp in seconds, and reports the rest; it is too slow for each message.
        exact = coerced(message)
        try:
            return convert(exact)
        except (TypeError, ValueError) as error:  # ROS 1 has no times before 1970
            raise FieldError(f"{source._type} -> {target._type}: {error}") from error

    return checked


class _Pairs:
    """Pairs the fields of two classes, also nested ones; collects those without counterpart."""

    def __init__(self, whole: Literal["source", "target"], part: str) -> None:
        self.problems: list[str] = []
        self._whole = whole
        self._part = part
        self._made: dict[tuple[type, type], Convert] = {}

    def message(
        self, source: type[Message], target: type[Message], path: str, fields: dict[str, str]
    ) -> Convert:
        # With fields of the user, which apply to one place only, nothing is reused.
        if not fields and (source, target) in self._made:
            return self._made[source, target]
        pairs = self._pairs(source, target, path, fields)
        plan = [
            (theirs.attribute, mine.attribute, self._field(source, mine, target, theirs, path))
            for mine, theirs in pairs
        ]

        def convert(message: Any) -> Any:
            made = target()
            for to, origin, change in plan:
                value = getattr(message, origin)
                setattr(made, to, value if change is None else change(value))
            return made

        self._made[source, target] = convert
        return convert

    def _pairs(
        self, source: type[Message], target: type[Message], path: str, fields: dict[str, str]
    ) -> list[tuple[Field, Field]]:
        """Return the pairs (of the source, of the target)."""
        at = f"{_named(source, target)} -> {_named(target, source)}: {path}"
        forward = self._whole == "source"
        whole, other = (source, target) if forward else (target, source)
        mine = {field.name: field for field in whole._definition.fields}
        others = {field.name: field for field in other._definition.fields}
        found: dict[str, Field] = {}
        # First the pairs that the user has given, ...
        for name, counterpart in fields.items():
            if name not in mine or counterpart not in {"", *others}:
                wrong, known = (name, mine) if name not in mine else (counterpart, others)
                self.problems.append(
                    f"{at}fields: got {wrong!r}; expected one of {', '.join(known) or 'none'}."
                    + did_you_mean(wrong, list(known))
                )
            elif counterpart:
                found[name] = others[counterpart]
        without = {*fields, *_ONLY_ROS1.get(whole._type, ())}
        by_name = {name.lower(): field for name, field in others.items()}
        # ... then those with the same name, ...
        for name in mine:
            if name not in without and name.lower() in by_name:
                found[name] = by_name[name.lower()]
        taken = {field.name for field in found.values()}
        alone = [name for name in mine if name not in {*without, *found}]
        # ... then those that are the only ones of their type on both sides.
        for name in alone:
            alike = [f for n, f in others.items() if n not in taken and _alike(mine[name], f)]
            rivals = [n for n in alone if _alike(mine[n], mine[name])]
            if len(alike) == len(rivals) == 1:
                found[name] = alike[0]
            else:
                self.problems.append(
                    f"{at}{name}: got a field without counterpart; expected one of "
                    f"{', '.join(others) or 'none'}.{self._way_out(whole, other, path + name)}"
                )
        ordered = [(mine[name], found[name]) for name in mine if name in found]
        return ordered if forward else [(theirs, field) for field, theirs in ordered]

    def _way_out(self, whole: type[Message], other: type[Message], name: str) -> str:
        """Return what to try for a field of `whole` without counterpart."""
        if whole._type == other._type:
            distro = getattr(other, "_distro", "")
            return f" Try the class of {distro}, with SMACHPY_ROS2_DISTRO={distro}."
        if "." in name:  # the configuration cannot name a field of a nested message
            return ""
        return (
            f" Try 'fields: {{{self._part}{name}: ...}}' in the configuration of the name, with '' "
            "for a field to do without."
        )

    def _field(
        self, source: type[Message], mine: Field, target: type[Message], theirs: Field, path: str
    ) -> Convert | None:
        """Return the conversion of a field's value; None: the value is used unchanged."""
        here = f"{path}{mine.name}"
        if mine.type.is_array != theirs.type.is_array or (
            {mine.type.length, theirs.type.length} - {None} != set()
            and mine.type.length != theirs.type.length
        ):
            self._differ(source, mine, target, theirs, here)
            return None
        one = self._one(source, mine, target, theirs, here)
        if not mine.type.is_array:
            return one
        if theirs.type.base in OCTETS:
            return lambda values: bytes(_array(values))
        if one is None:
            return lambda values: list(_array(values))
        element = one
        return lambda values: [element(value) for value in _array(values)]

    def _one(
        self, source: type[Message], mine: Field, target: type[Message], theirs: Field, here: str
    ) -> Convert | None:
        kind, other = mine.type, theirs.type
        for ours, (cls, ros2) in _TIMES.items():
            if (kind.base, other.base) == (ours, ros2):
                made = target._nested[ros2]
                return lambda value: made(sec=value.secs, nanosec=value.nsecs)  # type: ignore[call-arg]
            if (kind.base, other.base) == (ros2, ours):
                time_class = cls
                return lambda value: time_class(value.sec, value.nanosec)
        if kind.is_builtin or other.is_builtin:
            if _family(kind) != _family(other):
                self._differ(source, mine, target, theirs, here)
            return None
        nested = source._nested[kind.base], target._nested[other.base]
        return None if nested[0] is nested[1] else self.message(*nested, f"{here}.", {})

    def _differ(
        self, source: type[Message], mine: Field, target: type[Message], theirs: Field, here: str
    ) -> None:
        self.problems.append(
            f"{source._type} -> {target._type}: {here}: got {mine.type}; expected {theirs.type}, "
            f"the type of {theirs.name!r}."
        )


def _named(cls: type[Message], other: type[Message]) -> str:
    """Return the name of a type, with its distribution if the other one has the same name."""
    return f"{cls._type} ({getattr(cls, '_distro', '')})" if cls._type == other._type else cls._type


def _array(values: Any) -> Any:
    """Return values that may be those of an array; `bytes(5)` and `list("ab")` are no errors."""
    if isinstance(values, (str, dict)) or not hasattr(values, "__len__"):
        raise TypeError("not an array")
    return values


def _family(kind: FieldType) -> str:
    if kind.base in INTEGERS:
        return "integer"
    return "float" if kind.base in FLOATS else kind.base


def _alike(one: Field, other: Field) -> bool:
    """Return whether two fields have the same kind of value, so that they may correspond."""
    if one.type.is_array != other.type.is_array:
        return False
    return _plain_type(one.type) == _plain_type(other.type)


def _plain_type(kind: FieldType) -> str:
    """Return a name of the type that is the same for ROS 1 and ROS 2."""
    if kind.base in _TIMES:
        return _TIMES[kind.base][1]
    return (
        _family(kind)
        if kind.is_builtin
        else "/msg/".join((kind.base.partition("/")[0], kind.base.rpartition("/")[2]))
    )
