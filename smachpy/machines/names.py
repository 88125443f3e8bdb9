"""Lists of names (outcomes, keys) given by users, and the names of their functions."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from smachpy.exceptions import InvalidStateError
from smachpy.slips import accepts

if TYPE_CHECKING:
    from collections.abc import Iterable


def name_of(function: object) -> str:
    """Return the name of a user's function for texts, never with a memory address.

    A method is named with its class, a `functools.partial` as its function, and any other callable
    object as its class.
    """
    while isinstance(function, functools.partial):
        function = function.func
    name = getattr(function, "__qualname__", None) or getattr(function, "__name__", None)
    return str(name or type(function).__name__).rpartition("<locals>.")[2]


def missing_init(state: object, error: BaseException) -> str:
    """Return a hint if `error` comes from a base class whose `__init__` was not called."""
    # Private attributes carry the name of the class whose `__init__` sets them: `_CBState__args`.
    lacks = getattr(error, "name", None) or ""
    for kind in type(state).__mro__:
        ours = kind.__module__.startswith("smachpy.")
        if ours and lacks.startswith(f"_{kind.__name__.lstrip('_')}__"):
            name = type(state).__name__
            return (
                f" {name}.__init__ did not call {kind.__name__}.__init__. Try as its first line "
                f"`super().__init__(...)` with the arguments of {kind.__name__}."
            )
    return ""


def unique_names(names: Iterable[str], what: str = "names") -> tuple[str, ...]:
    """Return `names` without repeats, in their order.

    Raises:
        InvalidStateError: `names` is a string or not iterable, or an item is not a string.
    """
    # A plain string is iterable too, and would silently become names of one letter each.
    if isinstance(names, str):
        problem = f"{what}: got the string {names!r}; expected a list of strings. Try [{names!r}]."
        if not accepts(problem):
            raise InvalidStateError(problem)
        names = [names]
    try:
        found = list(names)
    except TypeError as error:
        raise InvalidStateError(f"{what}: got {names!r}; expected strings, in a list.") from error
    bad = [name for name in found if not isinstance(name, str)]
    if bad:
        problem = f"{what}: got {bad}; expected strings."
        if not accepts(problem):
            raise InvalidStateError(problem)
        found = [str(name) for name in found]
    return tuple(dict.fromkeys(found))
