"""Userdata with declared fields: a dataclass, a TypedDict or any class with annotations."""

from __future__ import annotations

import dataclasses
import types
import typing
from typing import Any

from smachpy.context import current_path
from smachpy.exceptions import InvalidStateError, UserDataKeyError, UserDataTypeError


class Fields:
    """The fields of a userdata type: names, types, defaults.

    Args:
        kind: A dataclass, a TypedDict, or a class with annotations.

    Raises:
        InvalidStateError: `kind` has no annotated fields.
    """

    def __init__(self, kind: type) -> None:
        self.kind = kind
        try:
            self.types: dict[str, Any] = typing.get_type_hints(kind)
        except TypeError as error:
            raise InvalidStateError(f"userdata_type: got {kind!r}; expected a class.") from error
        if not self.types:
            raise InvalidStateError(
                f"userdata_type: {kind.__name__}: got no annotated fields; expected a dataclass or "
                "a TypedDict."
            )

    def defaults(self) -> dict[str, Any]:
        """Return field -> default, for the fields that have one; default factories are called."""
        if not dataclasses.is_dataclass(self.kind):
            return {
                name: getattr(self.kind, name) for name in self.types if name in vars(self.kind)
            }
        found: dict[str, Any] = {}
        for field in dataclasses.fields(self.kind):
            if field.default is not dataclasses.MISSING:
                found[field.name] = field.default
            elif field.default_factory is not dataclasses.MISSING:
                found[field.name] = field.default_factory()
        return found

    def check(self, key: str, value: Any) -> None:
        """Check that the field `key` may have `value`.

        Raises:
            UserDataKeyError: the type has no such field.
            UserDataTypeError: the field has another type.
        """
        wanted = self.types.get(key, _MISSING)
        if wanted is _MISSING:
            problem = (
                f"userdata key is no field of {self.kind.__name__}: got {key!r}; fields: "
                f"{sorted(self.types)}."
            )
            raise UserDataKeyError(key, problem, self.types)
        if not _fits(value, wanted):
            raise UserDataTypeError(key, value, wanted, path=current_path())


class CheckedDict(dict[str, Any]):
    """The values of typed userdata; checks every write."""

    def __init__(self, fields: Fields) -> None:
        self.fields = fields
        super().__init__(fields.defaults())

    def __setitem__(self, key: str, value: Any) -> None:
        if "." not in key:  # keys of constants, "LABEL.key", belong to the machine
            self.fields.check(key, value)
        super().__setitem__(key, value)

    def reset(self) -> None:
        """Restore the defaults; constants stay."""
        constants = {key: value for key, value in self.items() if "." in key}
        self.clear()
        self.update(self.fields.defaults() | constants)


_MISSING = object()


def _fits(value: Any, wanted: Any) -> bool:
    """Return whether `value` has the annotated type; the elements of containers are not checked."""
    origin = typing.get_origin(wanted)
    arguments = typing.get_args(wanted)
    if origin is typing.Union or origin is types.UnionType:
        return any(_fits(value, one) for one in arguments)
    if origin is typing.Literal:
        return value in arguments
    if origin in {typing.Annotated, typing.Required, typing.NotRequired, typing.Final}:
        return _fits(value, arguments[0])
    kind = type(None) if wanted is None else origin or wanted
    if kind is Any or not isinstance(kind, type) or getattr(kind, "_is_protocol", False):
        return True
    if typing.is_typeddict(kind):
        return isinstance(value, dict)
    return isinstance(value, (int, float) if kind is float else kind)  # as for type checkers
