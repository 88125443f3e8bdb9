"""Secrets: values that no record, journal, page, log or error shows.

A value is a secret by its type, `smachpy.Secret`, or by the name of its userdata key, field or
parameter: one that ends with `password`, `token`, `api_key` and the like, or that
`@smachpy.mission(secrets=[...])` names.
"""

from __future__ import annotations

import copy
import dataclasses
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NoReturn

from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

MASK: Final = "<secret>"
"""What is shown in the place of a secret."""

_LAST: Final = frozenset(
    {"password", "passwd", "passphrase", "pwd", "secret", "token", "credential", "credentials"}
    | {"apikey"}
)
_KEYS: Final = frozenset({"api", "access", "private", "secret"})  # before "key"
_PART: Final = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_named: set[str] = set()  # by missions


class Secret:
    """A text that is shown nowhere: `repr`, `str` and all records have "<secret>" in its place.

    It cannot be pickled, and a journal does not keep it: a resumed mission has the secret with
    which it was built. Its copies are the same object.

        def mission(password: smachpy.Secret): ...
        login(password.reveal())

    Raises:
        InvalidStateError: the value is no text.
    """

    __slots__ = ("_value",)
    _smachpy_secret = True

    def __init__(self, value: str) -> None:
        if not isinstance(value, str):
            raise InvalidStateError(f"Secret: got {type(value).__name__}; expected a text.")
        self._value = value

    def reveal(self) -> str:
        """Return the text."""
        return self._value

    def __repr__(self) -> str:
        return MASK

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Secret):
            return NotImplemented
        import hmac  # loads OpenSSL, which few programs need

        return hmac.compare_digest(self._value.encode(), other._value.encode())

    def __hash__(self) -> int:
        return hash((Secret, self._value))

    def __bool__(self) -> bool:
        return bool(self._value)

    def __copy__(self) -> Secret:
        return self

    def __deepcopy__(self, _memo: object) -> Secret:
        return self

    def __reduce__(self) -> NoReturn:
        raise TypeError(f"got {MASK}; expected a value that may be written. Try reveal().")


def add_secret_names(names: Iterable[str]) -> None:
    """Treat values under these names as secrets, in this process."""
    _named.update(names)
    is_secret_name.cache_clear()


@lru_cache(maxsize=4096)
def is_secret_name(name: str) -> bool:
    """Return whether a key, field or parameter of this name holds a secret."""
    if name in _named:
        return True
    if len(name) > 200:  # noqa: PLR2004  no name that a person has written
        return False
    parts = [part.lower() for part in _PART.findall(name)]
    return parts[-1:] != [] and (
        parts[-1] in _LAST or (parts[-1] == "key" and parts[-2:-1] != [] and parts[-2] in _KEYS)
    )


def is_secret(value: object) -> bool:
    """Return whether a value is a secret by its type."""
    return getattr(type(value), "_smachpy_secret", False) is True


def hides(name: object, value: object) -> bool:
    """Return whether a value under this name must not be shown; flags and "nothing" may."""
    if value is None or isinstance(value, bool):
        return False
    return is_secret(value) or (isinstance(name, str) and is_secret_name(name))


def masked(value: Any, name: object = "", depth: int = 20) -> Any:
    """Return a value for display: a copy in which secrets are replaced.

    They are looked for in dicts, lists and tuples, and in the fields of dataclasses and messages.
    """
    if hides(name, value):
        return MASK
    kind = type(value)
    if depth and kind is dict:
        return {key: masked(one, key, depth - 1) for key, one in value.items()}
    if depth and kind in {list, tuple}:
        return kind(masked(one, "", depth - 1) for one in value)
    hidden = {}
    for field in _fields_of(kind) if depth else ():
        one = getattr(value, field, None)
        shown = masked(one, field, depth - 1)
        if shown is not one:
            hidden[field] = shown
    if hidden:
        value = copy.copy(value)
        for field, shown in hidden.items():
            object.__setattr__(value, field, shown)  # it may be frozen, or check its types
    return value


def _fields_of(kind: type) -> Iterable[str]:
    """Return the fields of a dataclass or of a message, else none."""
    if dataclasses.is_dataclass(kind):
        return [field.name for field in dataclasses.fields(kind)]
    return kind.__slots__ if hasattr(kind, "_md5sum") and hasattr(kind, "__slots__") else ()


def masked_words(argv: Sequence[str]) -> list[str]:
    """Return a mission's arguments for display; secrets that are given by name are replaced."""
    words, name = [], ""
    for word in argv:
        key, equals, value = word.lstrip("-").partition("=")
        if name and word[:1] != "@":
            words.append(MASK)
        elif equals and value[:1] != "@" and is_secret_name(key.replace("-", "_")):
            words.append(f"{word.partition('=')[0]}={MASK}")
        else:
            words.append(word)
        is_flag = word.startswith("--") and not equals
        name = key if is_flag and is_secret_name(key.replace("-", "_")) else ""
    return words
