"""Secrets: values that no record, journal, page, log or error shows.

A value is a secret by its type, `smachpy.Secret`, or by the name of its userdata key, field or
parameter: one that ends with `password`, `token`, `api_key` and the like, or that
`@smachpy.mission(secrets=[...])` names.
"""

from __future__ import annotations

import copy
import re
from collections import UserDict, UserList, deque
from functools import lru_cache
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any, Final, NoReturn

from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

MASK: Final = "<secret>"
"""What is shown in the place of a secret."""

_LAST: Final = frozenset(
    {"password", "passwd", "passphrase", "pwd", "secret", "token", "credential", "credentials"}
    | {"apikey", "passwords", "passphrases", "secrets"}
)
_KEYS: Final = frozenset({"api", "access", "private", "secret"})  # before "key"
# `re` compiles and keeps them when they are first used, as most programs look for no secret.
_PART: Final = r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+"
_NAMED: Final = (
    r"(?i)(?<![\w-])([A-Za-z_][\w-]{0,200})[\"']?[ \t]{0,9}[:=][ \t]{0,9}"
    r"(?!(?:true|false|null|none|~)\b|@)[^\s,}]"
)
_LOGIN: Final = r"://[^/\s:@]{0,200}:[^/\s@]{1,200}@"  # "://user:password@"
_ATOMS: Final = frozenset({type(None), bool, int, float, complex, str, bytes})
_MAPPINGS: Final = (dict, UserDict, MappingProxyType)
_LISTS: Final = (list, tuple, set, frozenset, deque, UserList)
_DEEPEST: Final = 50
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
    _named.update(name.lower() for name in names)
    is_secret_name.cache_clear()


@lru_cache(maxsize=4096)
def is_secret_name(name: str) -> bool:
    """Return whether a key, field or parameter of this name holds a secret."""
    if name.lower() in _named:
        return True
    if len(name) > 200:  # noqa: PLR2004  no name that a person has written
        return False
    parts = [part.lower() for part in re.findall(_PART, name)]
    return parts[-1:] != [] and (
        parts[-1] in _LAST
        or (parts[-1] in {"key", "keys"} and parts[-2:-1] != [] and parts[-2] in _KEYS)
    )


def holds_secret(text: str) -> bool:
    """Return whether a text has a secret in it: `password: x`, `token=x`, or a login in a URL."""
    return bool(re.search(_LOGIN, text)) or any(map(is_secret_name, re.findall(_NAMED, text)))


def is_secret(value: object) -> bool:
    """Return whether a value is a secret by its type."""
    return getattr(type(value), "_smachpy_secret", False) is True


def hides(name: object, value: object) -> bool:
    """Return whether a value under this name must not be shown; flags and "nothing" may."""
    if value is None or isinstance(value, bool):
        return False
    return is_secret(value) or (isinstance(name, str) and is_secret_name(name))


class _Opaque:
    """Stands for a value of which only the class may be shown."""

    def __init__(self, kind: type) -> None:
        self._text = f"<{kind.__name__} with secrets>"

    def __repr__(self) -> str:
        return self._text


def masked(value: Any, name: object = "") -> Any:
    """Return a value for display: a copy in which secrets are replaced.

    They are looked for in containers, and in what objects have by name: the fields of dataclasses,
    messages, named tuples and namespaces. Any other object that has a secret in its attributes is
    replaced as a whole. A value that contains itself has "..." there.
    """
    return _masked(value, name, _DEEPEST, {})


def _masked(value: Any, name: object, depth: int, known: dict[int, list[Any]]) -> Any:
    if hides(name, value):
        return MASK
    kind = type(value)
    if kind in _ATOMS:
        return value
    if not depth:
        return MASK  # nobody has looked inside
    found = known.get(id(value))
    if found is None:
        found = known[id(value)] = ["...", value]  # as long as that lives, its id is its own
        found[0] = _masked_parts(value, kind, depth - 1, known)
    return found[0]


def _masked_parts(value: Any, kind: Any, depth: int, known: dict[int, list[Any]]) -> Any:
    if isinstance(value, _MAPPINGS):
        return _masked_mapping(value, depth, known)
    names = _names_in(value, kind)
    if isinstance(value, _LISTS) and not names:
        return _masked_list(value, depth, known)
    old = {one: getattr(value, one, None) for one in names}
    new = {one: _masked(part, one, depth, known) for one, part in old.items()}
    hidden = {one: part for one, part in new.items() if part is not old[one]}
    if hidden and isinstance(value, tuple):
        return value._replace(**hidden)  # type: ignore[attr-defined]  # a named tuple
    if hidden:
        value = copy.copy(value)
        for one, part in hidden.items():
            object.__setattr__(value, one, part)  # it may be frozen, or check its types
    held = {} if names else getattr(value, "__dict__", {})
    return _Opaque(kind) if any(hides(one, part) for one, part in held.items()) else value


def _masked_mapping(value: Any, depth: int, known: dict[int, list[Any]]) -> Any:
    hidden, found = type(value) is dict, {}
    for key, one in value.items():
        is_plain = _masked(key, "", depth, known) is key
        part = found[key if is_plain else MASK] = _masked(one, key, depth, known)
        hidden = hidden or not is_plain or part is not one
    return found if hidden else value


def _masked_list(value: Any, depth: int, known: dict[int, list[Any]]) -> Any:
    if _ATOMS.issuperset(map(type, value)):
        return value
    items = [_masked(one, "", depth, known) for one in value]
    if all(new is old for new, old in zip(items, value, strict=True)):
        return value
    return tuple(items) if isinstance(value, tuple) else items


def _names_in(value: Any, kind: Any) -> Iterable[str]:
    """Return what a value has by name: fields of a message, of a dataclass and the like."""
    if hasattr(kind, "__dataclass_fields__"):
        from dataclasses import fields

        return [field.name for field in fields(kind)]
    if hasattr(kind, "_md5sum") and hasattr(kind, "__slots__"):
        names: Iterable[str] = kind.__slots__
        return names
    if isinstance(value, tuple) and hasattr(kind, "_fields"):
        return list(kind._fields)
    if isinstance(value, SimpleNamespace):
        return list(vars(value))
    return [one.name for one in getattr(kind, "__attrs_attrs__", ())]


def masked_words(argv: Sequence[str]) -> list[str]:
    """Return a mission's arguments for display; secrets that are given by name are replaced."""
    words, name = [], ""
    for word in argv:
        key, equals, value = word.lstrip("-").partition("=")
        if name and word[:1] != "@":
            words.append(MASK)
        elif equals and value[:1] != "@" and is_secret_name(key.replace("-", "_")):
            words.append(f"{word.partition('=')[0]}={MASK}")
        elif holds_secret(word):
            words.append(MASK)
        else:
            words.append(word)
        is_flag = word.startswith("--") and not equals
        name = key if is_flag and is_secret_name(key.replace("-", "_")) else ""
    return words
