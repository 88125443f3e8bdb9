"""Values shared by states: `UserData`, its declared fields, and `Remapper`, a window into it.

A state reads the keys that it declares as input and writes those that it declares as output;
anything else raises `UserDataKeyError`. The value of a key that is only input is read-only
(`get_const`).
"""

from __future__ import annotations

import contextlib
import copy
import types
import typing
from typing import TYPE_CHECKING, Any, NoReturn

from smachpy.base.context import current_frame, current_path
from smachpy.base.slips import accepts
from smachpy.exceptions import (
    InvalidStateError,
    UserDataKeyError,
    UserDataTypeError,
    error_text,
)
from smachpy.userdata.readonly import ATOMS, read_only, still_shows, writable
from smachpy.userdata.secret import masked
from smachpy.userdata.typed_keys import is_of_class

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, MutableMapping

__all__ = ["Const", "Remapper", "UserData", "get_const"]


class ConstantKey(str):
    """The key of a value of `add(constants=...)`, "LABEL.key"; it belongs to the machine's code.

    A class of its own, because a user's key may have a dot, too.
    """

    __slots__ = ()


class _VisitKeys:
    """Which values of a container's userdata leave its present visit.

    Until it is written, no value of a former visit does, nor one that was only copied in. What the
    program itself has put there does, as in SMACH.

    Attributes:
        written: Keys that states have written in this visit; windows refer to this set.
    """

    __slots__ = ("_former", "written")

    def __init__(self) -> None:
        self.written: set[str] = set()
        self._former: set[str] = set()  # from a former visit, or only copied in

    def begin(self, copied_in: Iterable[str]) -> None:
        """Begin a visit."""
        self._former.update(self.written, copied_in)
        self.written.clear()

    def forget(self, key: str) -> None:
        """Treat a value as the program's own: it has been set or removed."""
        self.written.discard(key)
        self._former.discard(key)

    def leave(self, key: str) -> bool:
        """Return whether the end of the visit copies the value to the parent."""
        return key in self.written or key not in self._former


class UserData:
    """Values by name, as attributes or items: `ud.x = 1`, `ud["x"]`.

    Names that begin with an underscore are ordinary attributes, not keys.

    Threads: single reads and writes are atomic; several together are not.
    """

    _data: dict[str, Any]
    _smachpy: _VisitKeys

    def __init__(self) -> None:
        object.__setattr__(self, "_data", {})
        object.__setattr__(self, "_smachpy", _VisitKeys())

    def update(self, other_userdata: UserData | Remapper | Mapping[str, Any]) -> None:
        """Set all values of `other_userdata` here; none, if a typed key refuses one."""
        keys = other_userdata.keys()  # UserData is no mapping
        values = {key: other_userdata[key] for key in keys}
        if isinstance(self._data, CheckedDict):
            for key, value in values.items():
                self._data.check(key, value)
        for key, value in values.items():
            self[key] = value

    def extract(self, keys: Iterable[str], remapping: Mapping[str, str]) -> UserData:
        """Return shallow copies of the values of `keys`, under the left names in `remapping`."""
        back = {theirs: ours for ours, theirs in dict(remapping).items()}
        found = UserData()
        for key in keys:
            if key in self._data:
                found[back.get(key, key)] = copy.copy(self._data[key])
        return found

    def merge(
        self, ud: UserData | Remapper, keys: Iterable[str], remapping: Mapping[str, str]
    ) -> None:
        """Set the values of `keys` from `ud`, under the right names in `remapping`."""
        names = dict(remapping)
        for key in keys:
            if key in ud:
                self[names.get(key, key)] = ud[key]

    def keys(self) -> list[str]:
        """Return the keys that have a value."""
        return list(self._data)

    def __getitem__(self, key: str) -> Any:
        try:
            return self._data[key]
        except KeyError:
            self._missing(key)

    def __setitem__(self, key: str, item: Any) -> None:
        self._data[key] = item
        self._smachpy.forget(key)

    def __delitem__(self, key: str) -> None:
        try:
            del self._data[key]
        except KeyError:
            self._missing(key)

    def __contains__(self, key: object) -> bool:
        return key in self._data

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __getattr__(self, name: str) -> Any:
        if name[0] == "_":
            raise AttributeError(name)
        try:
            return self._data[name]
        except KeyError:
            self._missing(name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in TAKEN and not accepts(taken_key(name)):
            raise InvalidStateError(taken_key(name))
        if name[0] == "_":
            object.__setattr__(self, name, value)
        else:
            self[name] = value

    def __delattr__(self, name: str) -> None:
        if name[0] == "_":
            object.__delattr__(self, name)
        else:
            del self[name]

    def __dir__(self) -> list[str]:
        return [*object.__dir__(self), *self._data]

    def __repr__(self) -> str:
        items = list(self._data.items())  # other branches may write meanwhile
        values = ", ".join(f"{key}={masked(value, key)!r}" for key, value in items)
        return f"UserData({values})"

    def __reduce__(self) -> tuple[object, ...]:  # also for `copy.copy`
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


def _hint_above(name: str) -> str:
    """Return what to try if a container above the one that runs here has a value of this key."""
    frame = current_frame()
    path = "" if frame is None else frame.path
    while frame is not None and name not in frame.data.input_keys:
        above = frame.parent
        # The top has the root as its own container.
        is_other = above is not None and above.container is not frame.container
        if is_other and name in above.container.userdata:
            return f" {above.path!r} has it. Try input_keys=[{name!r}] of {path!r}."
        frame = above
    return ""


def typed_userdata(kind: type) -> UserData:
    """Return userdata whose keys are the fields of `kind`, filled with their defaults.

    Raises:
        InvalidStateError: `kind` has no annotated fields.
    """
    made = UserData()
    object.__setattr__(made, "_data", CheckedDict(Fields(kind)))
    return made


def reset(userdata: UserData) -> None:
    """Remove all values; typed userdata gets its defaults back. Constants stay."""
    data = data_of(userdata)
    for key in [key for key in data if type(key) is not ConstantKey]:
        del data[key]
        userdata._smachpy.forget(key)
    if isinstance(data, CheckedDict):
        data.update(data.fields.defaults())


def _rebuild(data: dict[str, Any], kind: type | None = None) -> UserData:
    made = UserData() if kind is None else typed_userdata(kind)
    data_of(made).update(data)
    return made


def begin_visit(userdata: UserData, copied_in: Iterable[str]) -> None:
    """Begin a visit of the container, into which the values of these keys have been copied."""
    userdata._smachpy.begin(copied_in)


def write(userdata: UserData, values: Mapping[str, Any]) -> None:
    """Set values as if a state of this visit had written them."""
    userdata.update(values)
    userdata._smachpy.written.update(values)


def leaves(userdata: UserData, key: str) -> bool:
    """Return whether the end of the visit copies the value of `key` to the parent."""
    return userdata._smachpy.leave(key)


def data_of(userdata: UserData) -> dict[str, Any]:
    """Return the dict behind `userdata`, for the library only.

    The copy `dict(data_of(ud))` is atomic: other threads cannot change the keys meanwhile.
    """
    return userdata._data  # noqa: SLF001  its own module


class Fields:
    """The fields of a userdata type: names, types, defaults.

    Args:
        kind: A dataclass, a TypedDict, or a class with annotations.

    Raises:
        InvalidStateError: `kind` has no annotated fields.
    """

    def __init__(self, kind: type) -> None:
        self.kind = kind
        if not isinstance(kind, type):
            raise InvalidStateError(f"userdata_type: got {kind!r}; expected a class.")
        try:
            found = typing.get_type_hints(kind)
        except Exception as error:
            raise InvalidStateError(
                f"userdata_type: {kind.__name__}: got an annotation that cannot be read "
                f"({error_text(error)}); expected types that are known when the program runs. Try "
                "to import them outside of `if TYPE_CHECKING:`."
            ) from error
        self.types: dict[str, Any] = {
            name: hint for name, hint in found.items() if not is_of_class(hint)
        }
        if not self.types:
            raise InvalidStateError(
                f"userdata_type: {kind.__name__}: got no annotated fields; expected a dataclass or "
                "a TypedDict."
            )

    def defaults(self) -> dict[str, Any]:
        """Return field -> default, for the fields that have one; default factories are called."""
        if not hasattr(self.kind, "__dataclass_fields__"):
            bases = [vars(base) for base in self.kind.__mro__ if base.__module__ != "builtins"]
            found = {n: base[n] for base in reversed(bases) for n in self.types if n in base}
            # As in dataclasses: what has no hash is changed in place.
            return {n: copy.deepcopy(v) if v.__hash__ is None else v for n, v in found.items()}
        from dataclasses import MISSING, fields

        found = {}
        for field in fields(self.kind):
            if field.default is not MISSING:
                found[field.name] = field.default
            elif field.default_factory is not MISSING:
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
            raise UserDataTypeError(key, masked(value, key), wanted, path=current_path())


class CheckedDict(dict[str, Any]):
    """The values of typed userdata; checks every write."""

    def __init__(self, fields: Fields) -> None:
        self.fields = fields
        super().__init__(fields.defaults())

    def check(self, key: str, value: Any) -> None:
        """Check a value as `Fields.check` does; constants may be anything."""
        if type(key) is not ConstantKey:
            self.fields.check(key, value)

    def __setitem__(self, key: str, value: Any) -> None:
        self.check(key, value)
        super().__setitem__(key, value)


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


class Remapper:
    """A state's window into the userdata of its container: the declared keys, under its own names.

    Args:
        ud: The container's userdata.
        input_keys: Keys that may be read.
        output_keys: Keys that may be written.
        remapping: Name of a key here -> its name in `ud`.
    """

    __slots__ = ("_data", "_input", "_output", "_views", "_written")

    _data: MutableMapping[str, Any] | Remapper
    _input: dict[str, str]
    _output: dict[str, str]
    _views: dict[str, Any]  # key -> the last read-only view of a list or dict
    _written: set[str]  # that of the userdata

    def __init__(
        self,
        ud: UserData | Remapper,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        remapping: Mapping[str, str] | Iterable[tuple[str, str]] = (),
    ) -> None:
        names = dict(remapping)
        set_slot = object.__setattr__
        set_slot(self, "_data", data_of(ud) if isinstance(ud, UserData) else ud)
        set_slot(self, "_written", ud._smachpy.written if isinstance(ud, UserData) else set())
        set_slot(self, "_views", {})
        set_slot(self, "_input", {key: names.get(key, key) for key in input_keys})
        set_slot(self, "_output", {key: names.get(key, key) for key in output_keys})

    def update(self, other_userdata: UserData | Remapper | Mapping[str, Any]) -> None:
        """Write all values of `other_userdata`; its keys must be declared as output."""
        for key in other_userdata.keys():  # noqa: SIM118  UserData is no mapping
            self[key] = other_userdata[key]

    def keys(self) -> list[str]:
        """Return the input keys that have a value, under their names here."""
        data = self._data
        return [key for key, name in self._input.items() if name in data]

    def __contains__(self, key: object) -> bool:
        return key in self._input and self._input[str(key)] in self._data

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __getitem__(self, key: str) -> Any:
        # The hot path of userdata: two look-ups, and no view for a number or text.
        try:
            value = self._data[self._input[key]]
        except KeyError:
            self._unreadable(key)
        if type(value) in ATOMS or key in self._output:
            return value
        # Only views of lists and dicts are expensive to make and cheap to compare.
        if type(value) is list or type(value) is dict:
            return self._view_of(key, value)
        return read_only(value, key)

    def _view_of(self, key: str, value: Any) -> Any:
        """Return the previous view if it is still valid, else a new one."""
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
        # A state may write a value that it has read as a view; the next one must get the original.
        self._data[name] = item if type(item) in ATOMS else writable(item)
        self._written.add(name)

    __getattr__ = __getitem__  # the same rules, without a second call

    __setattr__ = __setitem__

    def __dir__(self) -> list[str]:
        return [*object.__dir__(self), *self.keys()]

    def __repr__(self) -> str:
        data = _copy_of(self._data)  # other branches may write meanwhile
        # A value is a secret by either of its names.
        values = ", ".join(
            f"{key}={masked(masked(data[name], name), key)!r}"
            for key, name in self._input.items()
            if name in data
        )
        return f"Remapper({values})"

    def _unreadable(self, key: str) -> NoReturn:
        if key[:1] == "_":  # never a key; Python looks for `__deepcopy__` and the like here
            raise AttributeError(key) from None
        if key in self._input:
            name = self._input[key]
            known = sorted(self._data.keys())
            alias = "" if name == key else f" (remapped from {key!r})"
            problem = f"userdata key has no value: got {name!r}{alias}; keys with a value: {known}."
            problem += _hint_above(name)
            raise UserDataKeyError(key, problem, known, path=current_path()) from None
        declared = sorted(self._input)
        problem = (
            f"userdata key read but not declared: got {key!r}; declared input keys: {declared}. "
            "Try adding it to input_keys."
        )
        raise UserDataKeyError(key, problem, declared, path=current_path()) from None

    def _refuse_write(self, key: str) -> None:
        """Raise an error; in programs for ROS 1 drop the write instead, as SMACH did."""
        # The path is not in the text of the error, which adds it, but it is in that of the warning.
        declared = sorted(self._output)
        problem = (
            f"userdata key written but not declared: got {key!r}; declared output keys: "
            f"{declared}. Try adding it to output_keys."
        )
        if not accepts(f"{current_path() or 'userdata'}: {problem}"):
            raise UserDataKeyError(key, problem, declared, path=current_path()) from None


TAKEN = frozenset((*dir(UserData), *dir(Remapper)))
"""Names that are no keys: as an attribute, `userdata.keys` is the method."""


def taken_key(key: str) -> str:
    """Return the problem of a key in `TAKEN`."""
    return (
        f"userdata key: got {key!r}, which is a method or attribute of userdata itself; expected "
        f"another name. Try {key.strip('_')}_value."
    )


def revoke(window: Remapper) -> None:
    """Cut off a window whose state was left behind: from now on it writes to a copy."""
    object.__setattr__(window, "_data", _copy_of(window._data))  # noqa: SLF001  its own module
    object.__setattr__(window, "_written", set())


def _copy_of(data: MutableMapping[str, Any] | Remapper) -> dict[str, Any]:
    """Copy the values of `data` while other threads may write to it."""
    if isinstance(data, dict):
        return dict(data)  # atomic
    found = {}
    for key in data.keys():  # noqa: SIM118  a Remapper, whose keys are its own
        with contextlib.suppress(KeyError):  # deleted meanwhile
            found[key] = data[key]
    return found


def get_const(obj: Any) -> Any:
    """Return `obj` if it is immutable, else a read-only view of it.

    The view is an instance of the object's own class: `isinstance`, methods, `len`, iteration and
    `==` work; a change raises `ReadOnlyError`.
    """
    return read_only(obj)


Const = get_const
