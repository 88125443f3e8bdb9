"""Data that states hand on: `UserData`, and `Remapper`, a state's window into it.

A state reads the keys it declared as input and writes those it declared as output; anything else
raises `UserDataKeyError`. A value whose key is input only arrives read-only (`get_const`).
"""

from __future__ import annotations

import contextlib
import copy
from typing import TYPE_CHECKING, Any, NoReturn

from smachpy.context import current_path
from smachpy.exceptions import UserDataKeyError
from smachpy.slips import accepts
from smachpy.userdata.readonly import ATOMS, read_only, still_shows, writable
from smachpy.userdata.typed import CheckedDict, Fields

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, MutableMapping

__all__ = ["Const", "Remapper", "UserData", "get_const"]


class UserData:
    """Values by name, as attributes or items: `ud.x = 1`, `ud["x"]`.

    Names that begin with an underscore are ordinary attributes, not keys.

    Threads: single reads and writes are atomic; several together are not.
    """

    _data: dict[str, Any]

    def __init__(self) -> None:
        object.__setattr__(self, "_data", {})

    def update(self, other_userdata: UserData | Remapper | Mapping[str, Any]) -> None:
        """Take over all values of `other_userdata`."""
        for key in other_userdata.keys():  # noqa: SIM118  UserData is no mapping
            self._data[key] = other_userdata[key]

    def extract(self, keys: Iterable[str], remapping: Mapping[str, str]) -> UserData:
        """Return shallow copies of the values of `keys`, under their names left of `remapping`."""
        back = {theirs: ours for ours, theirs in dict(remapping).items()}
        found = UserData()
        for key in keys:
            if key in self._data:
                found[back.get(key, key)] = copy.copy(self._data[key])
        return found

    def merge(
        self, ud: UserData | Remapper, keys: Iterable[str], remapping: Mapping[str, str]
    ) -> None:
        """Take over the values of `keys` from `ud`, under their names right of `remapping`."""
        names = dict(remapping)
        for key in keys:
            if key in ud:
                self._data[names.get(key, key)] = ud[key]

    def keys(self) -> list[str]:
        """Return the names that have a value."""
        return list(self._data)

    def __getitem__(self, key: str) -> Any:
        try:
            return self._data[key]
        except KeyError:
            self._missing(key)

    def __setitem__(self, key: str, item: Any) -> None:
        self._data[key] = item

    def __delitem__(self, key: str) -> None:
        try:
            del self._data[key]
        except KeyError:
            self._missing(key)

    def __contains__(self, key: object) -> bool:
        return key in self._data

    def __getattr__(self, name: str) -> Any:
        if name[0] == "_":
            raise AttributeError(name)
        try:
            return self._data[name]
        except KeyError:
            self._missing(name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name[0] == "_":
            object.__setattr__(self, name, value)
        else:
            self._data[name] = value

    def __delattr__(self, name: str) -> None:
        del self[name]

    def __dir__(self) -> list[str]:
        return [*object.__dir__(self), *self._data]

    def __repr__(self) -> str:
        values = ", ".join(f"{key}={value!r}" for key, value in self._data.items())
        return f"UserData({values})"

    def __copy__(self) -> UserData:
        data = self._data
        return _rebuild(data, data.fields.kind if isinstance(data, CheckedDict) else None)

    def __reduce__(self) -> tuple[object, ...]:
        data = self._data
        kind = data.fields.kind if isinstance(data, CheckedDict) else None
        return (_rebuild, (dict(data), kind))

    def _missing(self, key: str) -> NoReturn:
        raise UserDataKeyError(
            key,
            f"userdata key has no value: got {key!r}; keys with a value: {sorted(self._data)}.",
            self._data,
            path=current_path(),
        ) from None


def typed_userdata(kind: type) -> UserData:
    """Return userdata whose keys are the fields of `kind`, filled with their defaults.

    Raises:
        InvalidStateError: `kind` has no annotated fields.
    """
    made = UserData()
    object.__setattr__(made, "_data", CheckedDict(Fields(kind)))
    return made


def reset(userdata: UserData) -> None:
    """Forget all values; typed userdata goes back to its defaults. Constants stay."""
    data = userdata._data  # noqa: SLF001  its own module
    if isinstance(data, CheckedDict):
        data.reset()
        return
    for key in [key for key in data if "." not in key]:
        del data[key]


def _rebuild(data: dict[str, Any], kind: type | None = None) -> UserData:
    made = UserData() if kind is None else typed_userdata(kind)
    made._data.update(data)  # noqa: SLF001  its own module
    return made


def data_of(userdata: UserData) -> dict[str, Any]:
    """Return the dict that holds the values of `userdata`, for the library alone.

    A copy of it, `dict(data_of(ud))`, is one step: no key vanishes meanwhile.
    """
    return userdata._data  # noqa: SLF001  its own module


class Remapper:
    """A state's window into the userdata of its container: declared keys only, under its names.

    Args:
        ud: The container's userdata.
        input_keys: Keys that may be read.
        output_keys: Keys that may be written.
        remapping: Name of a key here -> its name in `ud`.
    """

    __slots__ = ("_data", "_input", "_output", "_views")

    _data: MutableMapping[str, Any] | Remapper
    _input: dict[str, str]
    _output: dict[str, str]
    _views: dict[str, Any]  # key -> the view of a list or dict that was handed out last

    def __init__(
        self,
        ud: UserData | Remapper,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        remapping: Mapping[str, str] | Iterable[tuple[str, str]] = (),
    ) -> None:
        names = dict(remapping)
        set_slot = object.__setattr__
        set_slot(self, "_data", ud._data if isinstance(ud, UserData) else ud)  # noqa: SLF001
        set_slot(self, "_views", {})
        set_slot(self, "_input", {key: names.get(key, key) for key in input_keys})
        set_slot(self, "_output", {key: names.get(key, key) for key in output_keys})

    def update(self, other_userdata: UserData | Remapper | Mapping[str, Any]) -> None:
        """Write all values of `other_userdata`; its keys must be declared as output."""
        for key in other_userdata.keys():  # noqa: SIM118  UserData is no mapping
            self[key] = other_userdata[key]

    def keys(self) -> list[str]:
        """Return the readable keys that have a value, under their names here."""
        data = self._data
        return [key for key, name in self._input.items() if name in data]

    def __contains__(self, key: object) -> bool:
        return key in self._input and self._input[str(key)] in self._data

    def __getitem__(self, key: str) -> Any:
        try:
            value = self._data[self._input[key]]
        except KeyError:
            self._unreadable(key)
        if type(value) in ATOMS or key in self._output:
            return value
        if type(value) is list or type(value) is dict:
            return self._view_of(key, value)
        return read_only(value, key)

    def _view_of(self, key: str, value: Any) -> Any:
        """Return the view of last time if it still shows what is there, else a new one."""
        view = self._views.get(key)
        if view is None or not still_shows(view, value):
            view = self._views[key] = read_only(value, key)
        return view

    def __setitem__(self, key: str, item: Any) -> None:
        try:
            name = self._output[key]
        except KeyError:
            self._refuse_write(key)
            return
        self._data[name] = item if type(item) in ATOMS else writable(item)

    __getattr__ = __getitem__  # the same rules, and no second call on the way

    def __setattr__(self, name: str, value: Any) -> None:
        try:
            key = self._output[name]
        except KeyError:
            self._refuse_write(name)
            return
        self._data[key] = value if type(value) in ATOMS else writable(value)

    def __dir__(self) -> list[str]:
        return [*object.__dir__(self), *self.keys()]

    def __repr__(self) -> str:
        data = self._data
        values = ", ".join(f"{key}={data[self._input[key]]!r}" for key in self.keys())
        return f"Remapper({values})"

    def _unreadable(self, key: str) -> NoReturn:
        if key[:1] == "_":
            raise AttributeError(key) from None
        if key in self._input:
            name = self._input[key]
            known = sorted(self._data.keys())
            alias = "" if name == key else f" (remapped from {key!r})"
            problem = f"userdata key has no value: got {name!r}{alias}; keys with a value: {known}."
            raise UserDataKeyError(key, problem, known, path=current_path()) from None
        declared = sorted(self._input)
        problem = (
            f"userdata key read but not declared: got {key!r}; declared input keys: {declared}. "
            "Try adding it to input_keys."
        )
        raise UserDataKeyError(key, problem, declared, path=current_path()) from None

    def _refuse_write(self, key: str) -> None:
        """Raise; where SMACH's slips are accepted, drop the write as SMACH did."""
        declared = sorted(self._output)
        problem = (
            f"userdata key written but not declared: got {key!r}; declared output keys: "
            f"{declared}. Try adding it to output_keys."
        )
        if not accepts(f"{current_path() or 'userdata'}: {problem}"):
            raise UserDataKeyError(key, problem, declared, path=current_path()) from None


def revoke(window: Remapper) -> None:
    """Cut a window off: its state was left behind and may not write any more."""
    object.__setattr__(window, "_data", _copy_of(window._data))  # noqa: SLF001  its own module


def _copy_of(data: MutableMapping[str, Any] | Remapper) -> dict[str, Any]:
    """Return the values of `data`, into which other threads may be writing."""
    if isinstance(data, dict):
        return dict(data)  # one step of the interpreter
    found = {}
    for key in data.keys():  # noqa: SIM118  a Remapper, whose keys are its own
        with contextlib.suppress(KeyError):  # deleted meanwhile
            found[key] = data[key]
    return found


def get_const(obj: Any) -> Any:
    """Return `obj` so that it cannot be changed: itself if immutable, else a read-only view.

    The view is an instance of the object's own class: `isinstance`, methods, `len`, iteration and
    `==` work; what would change it raises `ReadOnlyError`.
    """
    return read_only(obj)


Const = get_const
