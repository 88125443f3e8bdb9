"""Checks of users' arguments, all problems of a call at once; and texts about users' objects."""

from __future__ import annotations

import contextlib
import math
import numbers
from collections.abc import Iterable, Mapping
from types import CoroutineType
from typing import Any, Final

from actionlib_core.exceptions import InvalidNameError
from actionlib_core.names import check_name
from smachpy.base.functions import name_of, signature_text, takes, unrun_kind
from smachpy.base.slips import accepts
from smachpy.exceptions import InvalidStateError, did_you_mean

MAX_TOLD_PROBLEMS: Final = 100
"""Problems in the text of an error; its attributes have all."""


class Problems:
    """Collects the problems of the arguments of one call.

    Each method checks one argument and returns it in the form to use. If it is wrong, the method
    adds a problem and returns a harmless value, so that the other arguments are checked too.
    `with problems:` adds an `InvalidStateError` raised in the block instead of letting it through.

    Args:
        where: The object to which the arguments belong, for the error: a class, with a name if it
            has one, or "" if the arguments say enough.
    """

    def __init__(self, where: str) -> None:
        self._where = where
        self._found: list[str] = []

    def add(self, *problems: str) -> None:
        """Add problems, each as "argument: got ...; expected ..."."""
        self._found += problems

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> bool:
        if not isinstance(error, InvalidStateError):
            return False
        self._found += error.problems or (error.message,)
        return True

    def raise_all(self) -> None:
        """Raise an error if there are problems.

        Raises:
            InvalidStateError: with all problems.
        """
        if self._found:
            where = f"{self._where}: " if self._where else ""
            lines = [f"{where}{problem}" for problem in self._found[:MAX_TOLD_PROBLEMS]]
            if len(self._found) > MAX_TOLD_PROBLEMS:
                lines.append(f"{where}and {len(self._found) - MAX_TOLD_PROBLEMS} more.")
            raise InvalidStateError("\n".join(lines), self._found)

    def names(self, argument: str, given: Any) -> tuple[str, ...]:
        """Check a list of names (outcomes, keys)."""
        with self:
            return unique_names(given, argument)
        return ()

    def seconds(self, argument: str, given: Any, *, optional: bool = True) -> float | None:
        """Check a duration: a number of seconds or a `Duration`, not negative.

        If the argument is `optional`, None and infinity mean "no limit".
        """
        if given is None and optional:
            return None
        seconds = as_number(given)
        if seconds is not None and seconds >= 0 and (optional or math.isfinite(seconds)):
            return seconds if math.isfinite(seconds) else None
        hint = ""
        if isinstance(given, str):
            with contextlib.suppress(ValueError):
                hint = f" Try {float(given.strip().removesuffix('s')):g}."
        expected = f"seconds >= 0{', or None' if optional else ', not infinite'}"
        shown = given if seconds is None else seconds
        self.add(f"{argument}: got {shown!r}; expected {expected}.{hint}")
        return None

    def whole(self, argument: str, given: Any, least: int, expected: str) -> int:
        """Check a whole number that is at least `least`."""
        number = as_number(given)
        if number is None or not isinstance(given, numbers.Integral) or number < least:
            self.add(f"{argument}: got {given!r}; expected {expected}.")
            return least
        return int(given)

    def word(self, argument: str, given: Any) -> str:
        """Check a name: a non-empty string."""
        if isinstance(given, str) and given:
            return plain(given)
        self.add(f"{argument}: got {given!r}; expected a string, not empty.")
        return ""

    def network_name(self, argument: str, given: Any) -> str:
        """Check the name of an action, service or topic."""
        name = self.word(argument, given)
        try:
            return name and check_name(name)
        except InvalidNameError as error:
            self.add(f"{argument}: got {given!r}; {error.reason}.")
        return ""

    def kind_of(self, argument: str, given: Any, attribute: str, what: str) -> None:
        """Check that `given` is a class with this attribute, such as a message class."""
        if not isinstance(given, type) or not hasattr(given, attribute):
            self.add(f"{argument}: got {given!r}; expected {what}.")

    def mapping(self, argument: str, given: Any, holds: str) -> dict[Any, Any]:
        """Check a dict; None counts as empty. `holds` describes the expected content."""
        if given is None:
            return {}
        try:
            pairs = given if isinstance(given, Mapping) else list(given)
            if isinstance(pairs, Mapping) or not any(isinstance(pair, str) for pair in pairs):
                return dict(pairs)
        except (TypeError, ValueError):
            pass
        self.add(f"{argument}: got {given!r}; expected a dict: {holds}.")
        return {}

    def names_of(
        self, argument: str, given: Any, holds: str, *, optional: bool = False
    ) -> dict[str, Any]:
        """Check a dict from name to name, or to None where that is `optional`."""
        checked = self.mapping(argument, given, holds)
        for name, other in [*checked.items()]:
            fits = (isinstance(other, str) and other != "") or (optional and other is None)
            if isinstance(name, str) and fits:
                if type(name) is not str or type(other) is not str:
                    del checked[name]
                    checked[plain(name)] = None if other is None else plain(other)
                continue
            problem = f"{argument}: got {name!r}: {other!r} in it; expected {holds}."
            if accepts(problem):
                del checked[name]
                checked[str(name)] = None if optional and not other else str(other)
            else:
                self.add(problem)
        return checked

    def values(self, argument: str, given: Any) -> tuple[Any, ...]:
        """Check a list of any values."""
        if isinstance(given, Iterable) and not isinstance(given, (str, bytes)):
            return tuple(given)
        shown = name_of(given) if callable(given) else repr(given)
        self.add(f"{argument}: got {shown}; expected a list. Try [{shown}].")
        return ()

    def function(
        self,
        argument: str,
        given: Any,
        call: str,
        count: int | None = None,
        kwargs: Mapping[str, Any] | None = None,
        *,
        optional: bool = True,
        plain: bool = True,
    ) -> Any:
        """Check a function that the machine will call.

        Args:
            argument: Its name.
            given: The function.
            call: The call, for the error text: "on_enter(userdata)".
            count: The number of positional arguments of the call; None to skip the check.
            kwargs: The keyword arguments of the call.
            optional: It may be None.
            plain: Refuse an `async` function and a generator, because nothing would run its body: a
                call returns an object, which counts as true.
        """
        if given is None and optional:
            return None
        expected = f"expected something to call as {call}"
        # The function, or the method of an object that is called.
        kind = unrun_kind(given) or unrun_kind(getattr(type(given), "__call__", None))  # noqa: B004
        if not callable(given):
            is_called = isinstance(given, CoroutineType)
            hint = " Try the function itself, without ()." if is_called else ""
            self.add(f"{argument}: got {given!r}; {expected}.{hint}")
        elif plain and kind:
            instead = "not an async one" if kind == "async" else "without `yield`"
            self.add(f"{argument}: got the {kind} {_shown(given)}; {expected}, {instead}.")
        elif count is not None and not takes(given, count, kwargs):
            problem = f"{argument}: got {_shown(given)}; {expected}."
            if not accepts(problem):
                self.add(problem)
        return given


def unknown_name(what: str, got: object, known: Iterable[str]) -> str:
    """Return the problem of a name that is not one of the names in `known`."""
    known = sorted(known)
    return f"{what}: got {got!r}; expected one of {known}.{did_you_mean(got, known)}"


def unknown_arguments(given: Iterable[str], known: Iterable[str]) -> str:
    """Return the error text for keyword arguments that do not exist, or "" if there are none."""
    known = sorted(known)
    unknown = sorted(set(given) - set(known))
    if not unknown:
        return ""
    return f"unknown arguments {unknown}; expected {known}.{did_you_mean(unknown[0], known)}"


def as_number(given: Any) -> float | None:
    """Convert a number or `Duration` to a float; None for anything else, such as a bool."""
    if isinstance(given, bool):  # an int for Python, but a mistake as a duration or a count
        return None
    if isinstance(given, numbers.Real):
        try:
            return float(given)
        except OverflowError:
            return math.inf
    try:
        return float(given.to_sec())
    except (AttributeError, TypeError, ValueError):
        return None


def _shown(function: Any) -> str:
    name = getattr(function, "__qualname__", None) or getattr(function, "__name__", None)
    if name is None:
        return repr(function)
    return f"{name}{signature_text(function)}"


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
        InvalidStateError: `names` is a string or not iterable, or an item is not a string, or
            empty.
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
    if "" in found:
        problem = f"{what}: got an empty string in it; expected names."
        if not accepts(problem):
            raise InvalidStateError(problem)
    return tuple(dict.fromkeys(map(plain, found)))


def plain(text: str) -> str:
    """Return `text` as a plain string.

    A member of `class Name(str, Enum)` equals its value, but prints as "Name.MEMBER".
    """
    return text if type(text) is str else str.__str__(text)
