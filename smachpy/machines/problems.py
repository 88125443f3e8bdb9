"""Arguments as users give them: checked one by one, and all their problems told at once."""

from __future__ import annotations

import contextlib
import inspect
import math
import numbers
from collections.abc import Iterable, Mapping
from typing import Any

from smachpy.exceptions import InvalidStateError, did_you_mean
from smachpy.machines.names import unique_names
from smachpy.slips import accepts


class Problems:
    """Collects what is wrong with the arguments of one call.

    Every method checks one argument and returns it as it is to be used; when it is wrong, the
    method notes that and returns something harmless, so that the next argument is checked too.
    `with problems:` notes an `InvalidStateError` of the block instead of letting it through.

    Args:
        where: What the arguments belong to, for the error: a class, with a name if it has one, or
            "" when the arguments themselves say enough.
    """

    def __init__(self, where: str) -> None:
        self._where = where
        self._found: list[str] = []

    def add(self, *problems: str) -> None:
        """Note problems, each as "argument: got ...; expected ..."."""
        self._found += problems

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> bool:
        if not isinstance(error, InvalidStateError):
            return False
        self._found += error.problems or (error.message,)
        return True

    def raise_all(self) -> None:
        """Raise what was found.

        Raises:
            InvalidStateError: with all problems, if there are any.
        """
        if self._found:
            where = f"{self._where}: " if self._where else ""
            text = "\n".join(f"{where}{problem}" for problem in self._found)
            raise InvalidStateError(text, self._found)

    def names(self, argument: str, given: Any) -> tuple[str, ...]:
        """Check a list of names (outcomes, keys)."""
        with self:
            return unique_names(given, argument)
        return ()

    def seconds(self, argument: str, given: Any, *, optional: bool = True) -> float | None:
        """Check a duration: a number of seconds or a `Duration`, not negative.

        None, and infinity, mean "no limit" where the argument is `optional`.
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
        """Check a name: a string that is not empty."""
        if isinstance(given, str) and given:
            return given
        self.add(f"{argument}: got {given!r}; expected a string, not empty.")
        return ""

    def kind_of(self, argument: str, given: Any, attribute: str, what: str) -> None:
        """Check that `given` is a class with this attribute: of messages, say."""
        if not isinstance(given, type) or not hasattr(given, attribute):
            self.add(f"{argument}: got {given!r}; expected {what}.")

    def mapping(self, argument: str, given: Any, holds: str) -> dict[Any, Any]:
        """Check a dict; None is an empty one. `holds` says what is expected in it."""
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
            fits = isinstance(other, str) or (optional and other is None)
            if isinstance(name, str) and fits:
                continue
            problem = f"{argument}: got {name!r}: {other!r} in it; expected {holds}."
            if accepts(problem):
                del checked[name]
                checked[str(name)] = None if optional and other is None else str(other)
            else:
                self.add(problem)
        return checked

    def values(self, argument: str, given: Any) -> tuple[Any, ...]:
        """Check a list of any values."""
        if isinstance(given, Iterable) and not isinstance(given, (str, bytes)):
            return tuple(given)
        self.add(f"{argument}: got {given!r}; expected a list. Try [{given!r}].")
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
        """Check a function that the machine calls.

        Args:
            argument: Its name.
            given: The function.
            call: How it is called, for the error: "on_enter(userdata)".
            count: How many positional arguments it is called with; None: that is not checked.
            kwargs: The keyword arguments that it is called with.
            optional: It may be None.
            plain: An `async` function is refused, because nobody would await it.
        """
        if given is None and optional:
            return None
        expected = f"expected something to call as {call}"
        if not callable(given):
            hint = " Try the function itself, without ()." if inspect.iscoroutine(given) else ""
            self.add(f"{argument}: got {given!r}; {expected}.{hint}")
        elif plain and inspect.iscoroutinefunction(given):
            self.add(f"{argument}: got the async {_shown(given)}; {expected}, not an async one.")
        elif count is not None and not takes(given, count, kwargs):
            problem = f"{argument}: got {_shown(given)}; {expected}."
            if not accepts(problem):
                self.add(problem)
        return given


def unknown_arguments(given: Iterable[str], known: Iterable[str]) -> str:
    """Return the text about keyword arguments that do not exist, or "" when there are none."""
    known = sorted(known)
    unknown = sorted(set(given) - set(known))
    if not unknown:
        return ""
    return f"unknown arguments {unknown}; expected {known}.{did_you_mean(unknown[0], known)}"


def as_number(given: Any) -> float | None:
    """Return a number or `Duration` as a float, None for anything else; a bool is no number."""
    if isinstance(given, bool):
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


def takes(function: Any, count: int, kwargs: Mapping[str, Any] | None = None) -> bool:
    """Tell whether `function` can be called with `count` positional arguments, as far as is known.

    A decorator's own signature counts, not that of the function that it wraps: it may add
    arguments or take some away.
    """
    try:
        signature = inspect.signature(function, follow_wrapped=False)
    except (TypeError, ValueError):  # made in C: it does not say
        return True
    try:
        signature.bind(*[None] * count, **(kwargs or {}))
    except TypeError:
        return False
    return True


def _shown(function: Any) -> str:
    name = getattr(function, "__qualname__", None) or getattr(function, "__name__", None)
    if name is None:
        return repr(function)
    try:
        return f"{name}{inspect.signature(function, follow_wrapped=False)}"
    except (TypeError, ValueError):
        return str(name)
