"""Checks data from JSON against a Python type: what other programs send is believed only then.

    class Pose(TypedDict):
        x: Number
        y: Number
        name: NotRequired[str]

    pose = checked(Pose, load_json(text))

Types are dataclasses, typed dicts, named tuples, lists, tuples, dicts with text keys, literals,
unions, `Any`, and str, int, float, bool, None, also with `Annotated[..., Limits(...)]`. The check
of a type is compiled once.
"""

from __future__ import annotations

import dataclasses
from functools import cache
from types import NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Final,
    Literal,
    NotRequired,
    TypeAlias,
    Union,
    get_args,
    get_origin,
    get_type_hints,
    is_typeddict,
)

from actionlib_core.inputs.checked_file import Limits

if TYPE_CHECKING:
    from collections.abc import Callable

LATEST: Final = 2**32 * 10**9 - 1
"""The last instant that messages of ROS 1 can hold, in the year 2106 [ns since the epoch]."""

Stamp: TypeAlias = Annotated[int, Limits(low=0, high=LATEST)]
"""An instant [ns since the Unix epoch]."""

Count: TypeAlias = Annotated[int, Limits(low=0, high=2**53)]
"""A number of things; JavaScript knows it exactly."""

Number: TypeAlias = Annotated[float, Limits()]
"""A finite number."""

_NOT_FINITE: Final = frozenset({"nan", "inf", "-inf", "NaN", "Infinity", "-Infinity"})
"""Texts in place of the numbers that JSON does not have."""

_WORDS: Final[dict[Any, str]] = {
    str: "a text",
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    NoneType: "null",
}
_MAX_SHOWN_LENGTH: Final = 60


class DataError(ValueError):
    """Data does not have the form that was expected.

    Attributes:
        where: The place in the data: "$.events[3].path".
        expected: What was expected there.
    """

    def __init__(self, got: Any, expected: str, where: str = "") -> None:
        self.where = where
        self.expected = expected
        self._got = _shown(got)
        super().__init__(self._got, expected)

    def __str__(self) -> str:
        return f"${self.where}: got {self._got}; expected {self.expected}."

    @classmethod
    def without(cls, fields: list[str]) -> DataError:
        """Return the error of an object that lacks some fields."""
        error = cls({}, f"one with the fields {fields}")
        error._got = "an object without them"
        return error

    def inside(self, step: str) -> DataError:
        """Note that the place is inside another one; return the error."""
        self.where = step + self.where
        return self


def _shown(got: Any) -> str:
    if isinstance(got, (list, tuple, dict)):  # their `repr` may take long
        return f"{'an object' if isinstance(got, dict) else 'a list'} of {len(got)}"
    text = repr(got[:_MAX_SHOWN_LENGTH] if isinstance(got, str) else got)
    return text if len(text) <= _MAX_SHOWN_LENGTH else f"{text[:_MAX_SHOWN_LENGTH]}..."


def checked(kind: Any, data: Any, *, known_only: bool = False) -> Any:
    """Return `data` as a value of a type.

    Dataclasses and named tuples are made, typed dicts stay dicts, and lists in these stay lists,
    also where their type is a tuple. Where a field has a default, it may be missing.

    Args:
        kind: The type.
        data: Data as `load_json` returns it. It is not changed.
        known_only: Drop unknown fields, as a newer program may send them, instead of refusing them.

    Raises:
        DataError: it is not of that type, with the place of the first mistake.
    """
    try:
        return checker(kind, known_only=known_only)(data)
    except RecursionError:
        raise DataError(data, "one that is nested less deeply") from None


@cache
def checker(
    kind: Any, *, known_only: bool = False, rows: Callable[[list[Any]], Any] = tuple
) -> Callable[[Any], Any]:
    """Return the function that checks data against a type, as `checked` does.

    Args:
        kind: The type.
        known_only: As for `checked`.
        rows: Makes the values of tuple types.
    """
    origin, arguments = get_origin(kind), get_args(kind)
    if kind is Any:
        return lambda data: data
    is_dict = is_typeddict(kind)
    is_record = is_dict or dataclasses.is_dataclass(kind) or hasattr(kind, "_field_defaults")
    if is_record:
        rows = list if is_dict else tuple

    def inner(one: Any) -> Callable[[Any], Any]:
        return checker(one, known_only=known_only, rows=rows)

    if origin is not None:
        return _generic(origin, arguments, inner, rows)
    if is_record:
        return _record_of(kind, inner, known_only=known_only)
    return _plain(kind)


def _generic(
    origin: Any,
    arguments: tuple[Any, ...],
    inner: Callable[[Any], Callable[[Any], Any]],
    rows: Callable[[list[Any]], Any],
) -> Callable[[Any], Any]:
    if origin in {Union, UnionType}:
        others = [inner(one) for one in arguments if one is not NoneType]
        words = " or ".join(dict.fromkeys(map(_words, arguments)))
        return _any_of(others, words, or_none=NoneType in arguments)
    if origin is tuple and arguments[1:] != (Ellipsis,):
        return _row_of([inner(one) for one in arguments], rows)
    makers: dict[Any, Callable[[], Callable[[Any], Any]]] = {
        Annotated: lambda: _limited(inner(arguments[0]), arguments[1:]),
        NotRequired: lambda: inner(arguments[0]),
        Literal: lambda: _one_of(arguments),
        list: lambda: _list_of(inner(arguments[0]), list),
        tuple: lambda: _list_of(inner(arguments[0]), rows),
        dict: lambda: _dict_of(inner(arguments[1])),
    }
    return makers[origin]()


def _words(kind: Any) -> str:
    origin = get_origin(kind)
    if origin is Annotated:
        return _words(get_args(kind)[0])
    if origin is Literal:
        return f"one of {sorted(get_args(kind))}"
    if origin in {list, tuple}:
        return "a list"
    return _WORDS.get(kind, "an object")


def _plain(kind: Any) -> Callable[[Any], Any]:
    types = (float, int) if kind is float else (kind,)

    def check(data: Any) -> Any:
        # `type`, because true and false are integers for `isinstance`.
        if type(data) in types:
            return data
        if kind is float and isinstance(data, str) and data in _NOT_FINITE:
            return data
        raise DataError(data, _words(kind))

    return check


def _limited(inner: Callable[[Any], Any], marks: tuple[Any, ...]) -> Callable[[Any], Any]:
    limits = next((one for one in marks if isinstance(one, Limits)), None)
    if limits is None:
        return inner

    def check(data: Any) -> Any:
        value = inner(data)
        # A text stands for a number that is not finite.
        if value is not None and (isinstance(value, str) or not limits.allow(value)):
            raise DataError(data, ", ".join(filter(None, ("a finite number", limits.text()))))
        return value

    return check


def _one_of(values: tuple[Any, ...]) -> Callable[[Any], Any]:
    def check(data: Any) -> Any:
        if isinstance(data, (str, int)) and data in values:
            return data
        raise DataError(data, f"one of {sorted(values)}")

    return check


def _any_of(
    inner: list[Callable[[Any], Any]], words: str, *, or_none: bool
) -> Callable[[Any], Any]:
    def check(data: Any) -> Any:
        if or_none and data is None:
            return None
        deepest: DataError | None = None
        for one in inner:
            try:
                return one(data)
            except DataError as error:
                if deepest is None or len(error.where) > len(deepest.where):
                    deepest = error
        # Of several forms, the one whose mistake is furthest inside was meant.
        if deepest is not None and deepest.where:
            raise deepest
        raise DataError(data, words)

    return check


def _list_of(inner: Callable[[Any], Any], make: Callable[[list[Any]], Any]) -> Callable[[Any], Any]:
    def check(data: Any) -> Any:
        if not isinstance(data, (list, tuple)):
            raise DataError(data, "a list")
        found: list[Any] = []
        try:
            for one in data:
                found.append(inner(one))  # noqa: PERF401  its length is the place of an error
        except DataError as error:
            raise error.inside(f"[{len(found)}]") from None
        return make(found)

    return check


def _row_of(
    inner: list[Callable[[Any], Any]], make: Callable[[list[Any]], Any]
) -> Callable[[Any], Any]:
    def check(data: Any) -> Any:
        if not isinstance(data, (list, tuple)) or len(data) != len(inner):
            raise DataError(data, f"a list of {len(inner)}")
        found: list[Any] = []
        try:
            for one, item in zip(inner, data, strict=True):
                found.append(one(item))
        except DataError as error:
            raise error.inside(f"[{len(found)}]") from None
        return make(found)

    return check


def _dict_of(inner: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def check(data: Any) -> Any:
        if not isinstance(data, dict):
            raise DataError(data, "an object")
        found = {}
        for key, item in data.items():
            try:
                found[key] = inner(item)
            except DataError as error:
                raise error.inside(f"[{key!r:.{_MAX_SHOWN_LENGTH}}]") from None
        return found

    return check


def _record_of(
    kind: Any, inner: Callable[[Any], Callable[[Any], Any]], *, known_only: bool
) -> Callable[[Any], Any]:
    hints = get_type_hints(kind, include_extras=True)
    required = _required(kind, hints)
    make = dict if is_typeddict(kind) else kind
    checks: dict[str, Callable[[Any], Any]] = {}

    def check(data: Any) -> Any:
        if not isinstance(data, dict):
            raise DataError(data, "an object")
        if not checks:  # compiled at the first use: a state contains states
            checks.update({name: inner(hint) for name, hint in hints.items()})
        found = {}
        for name, value in data.items():
            one = checks.get(name)
            if one is None:
                if known_only:
                    continue
                raise DataError(name, f"one of the fields {sorted(hints)}")
            try:
                found[name] = one(value)
            except DataError as error:
                raise error.inside(f".{name}") from None
        if not required <= found.keys():
            raise DataError.without(sorted(required - found.keys()))
        return make(**found)

    return check


def _required(kind: Any, hints: dict[str, Any]) -> frozenset[str]:
    if is_typeddict(kind):
        # Not `__required_keys__`, which is wrong where annotations are texts.
        return frozenset(
            name for name, hint in hints.items() if get_origin(hint) is not NotRequired
        )
    if dataclasses.is_dataclass(kind):
        return frozenset(
            one.name
            for one in dataclasses.fields(kind)
            if one.default is dataclasses.MISSING and one.default_factory is dataclasses.MISSING
        )
    return frozenset(hints.keys() - kind._field_defaults.keys())
