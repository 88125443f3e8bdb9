"""The keys of a state as a type: `execute(self, userdata: Keys)`, checked against what it declares.

`Keys` is a `Protocol`, a dataclass or a TypedDict. Type checkers then check each read and write in
the state. Whether the state has these keys at all, only the state knows: that is checked here.
"""

from __future__ import annotations

import typing
from types import FunctionType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator


def key_problems(function: Any, declared: Collection[str]) -> Iterator[str]:
    """Yield the problems of the annotation of `userdata`, the first argument of `function`.

    A key that the state declares must be in the type. A protocol describes the keys of one state,
    so all of them must be declared; a dataclass may be that of the whole mission.

    Args:
        function: A bound method or a function.
        declared: The input and output keys of the state; none: it declares nothing, and may get
            constants.
    """
    kind = _kind_of(function)
    if kind is None:
        return
    keys = dict.fromkeys(_keys_of(kind))
    is_protocol = getattr(kind, "_is_protocol", False)
    if is_protocol and not keys:  # of methods: it says nothing about keys
        return
    extra = [key for key in declared if key not in keys]
    if extra:
        yield (
            f"execute: userdata: got {kind.__name__}, which lacks the declared keys {extra}; "
            f"expected them in it. Try `{extra[0]}: ...` in {kind.__name__}."
        )
    lacking = [key for key in keys if key not in declared]
    if lacking and is_protocol:
        yield (
            f"execute: userdata: got {kind.__name__} with the keys {lacking}, which the state does "
            f"not declare; expected all of it. Try input_keys={lacking}, or output_keys."
        )


def _kind_of(function: Any) -> Any:
    """Return the class that describes the keys; None for any other annotation, or none."""
    plain = getattr(function, "__func__", function)
    if isinstance(plain, FunctionType) and not plain.__annotations__:
        return None
    import inspect  # here: most programs have no such types

    try:
        parameters = inspect.signature(function, follow_wrapped=False).parameters
    except (TypeError, ValueError):  # implemented in C, without a signature
        return None
    first: Any = next((one.annotation for one in parameters.values()), None)
    if isinstance(first, str):
        # Looked up, not evaluated; a name of a function around it is not found, and not checked.
        named = getattr(inspect.unwrap(function), "__func__", function)
        name, *rest = first.strip("'\" ").split(".")
        first = getattr(named, "__globals__", {}).get(name)
        for part in rest:
            first = getattr(first, part, None)
    if not isinstance(first, type):
        return None
    is_plain = hasattr(first, "__dataclass_fields__") or typing.is_typeddict(first)
    return first if is_plain or getattr(first, "_is_protocol", False) else None


def _keys_of(kind: type) -> Iterator[str]:
    """Yield the names of a class's fields, and of the properties of a protocol."""
    for base in reversed(kind.__mro__):
        hints = vars(base).get("__annotations__", {})
        names = [name for name, hint in hints.items() if not is_of_class(hint)]
        names += [name for name, what in vars(base).items() if isinstance(what, property)]
        yield from (name for name in names if not name.startswith("_"))


def is_of_class(hint: object) -> bool:
    """Return whether an annotation, maybe a text, is a `ClassVar`: not a field."""
    return str(hint).partition("[")[0].rpartition(".")[2] == "ClassVar"
