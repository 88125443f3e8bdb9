"""The border between an old program and this package: stand-ins, and private names of SMACH.

One rule makes stand-ins fit, for every function and class behind ROS 1's names: an argument that is
a stand-in is left out if it may be left out. If not, it becomes what its parameter takes: a word,
the number 1, an empty list, an interface or an empty machine. In a list or dict of names it becomes
a word.
"""

from __future__ import annotations

import functools
import inspect
import types
from collections.abc import MutableSet
from typing import TYPE_CHECKING, Any, Final

from smachpy.base import log
from smachpy.machines.construction import construction_method
from smachpy.machines.container import Container
from smachpy.machines.state import State
from smachpy.machines.state_machine import StateMachine
from smachpy.ros1.stubs import EVERY_NAME, interface_for, is_stand_in, takes_any_message, word_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from inspect import Parameter

_METHODS: Final = (
    *("__init__", "add", "add_auto", "set_contained_state", "set_initial_state", "set_iteritems"),
    *("register_outcomes", "register_input_keys", "register_output_keys", "register_io_keys"),
)
_INTERFACES: Final = {
    **dict.fromkeys(("action_spec", "ActionSpec"), "action"),
    **dict.fromkeys(("service_spec", "service_class"), "srv"),
    **dict.fromkeys(("msg_type", "data_class", "topic_type"), "msg"),
}
"""Parameter that takes a class of interfaces -> which kind."""
_MESSAGES: Final = {"action_spec": "goal", "service_spec": "request"}
"""Such a parameter -> the one for its message, which is left out if the class is a stand-in."""


class StandInMachine(StateMachine):
    """An empty machine in the place of one that comes from a missing module.

    Attributes:
        origin: The stand-in, as text.
    """

    def __init__(self, origin: str) -> None:
        super().__init__(outcomes=["stand_in"])
        self.origin = origin

    def get_registered_outcomes(self) -> Any:
        """Return a tuple that contains every name, as the machine's own outcomes are not known."""
        return EVERY_NAME


class _NameSet(MutableSet[str]):
    """The outcomes or keys of a state, as a set that programs may change, as in SMACH."""

    def __init__(self, data: Any, kind: str) -> None:
        self._data = data
        self._kind = kind

    def __contains__(self, name: object) -> bool:
        return name in getattr(self._data, self._kind)

    def __iter__(self) -> Iterator[str]:
        return iter(getattr(self._data, self._kind))

    def __len__(self) -> int:
        return len(getattr(self._data, self._kind))

    def __repr__(self) -> str:
        return repr(set(self))

    def add(self, value: str) -> None:
        """Declare a name."""
        self._data.add(self._kind, [value])

    def discard(self, value: str) -> None:
        """Take a name back."""
        names = [name for name in self if name != value]
        setattr(self._data, self._kind, ())
        self._data.add(self._kind, names)


def _names(kind: str) -> property:
    def get(state: State) -> _NameSet:
        return _NameSet(state._smachpy, kind)

    def set_all(state: State, names: Iterable[str]) -> None:
        given = list(names)  # which may be a view of the present ones
        setattr(state._smachpy, kind, ())
        state._smachpy.add(kind, given)

    return property(get, set_all)


def _copy_input_keys(container: Container, parent_ud: Any, ud: Any) -> None:
    """Copy the input keys into a container's userdata; a key without a value is logged."""
    _copy(container.get_registered_input_keys(), parent_ud, ud, "input")


def _copy_output_keys(container: Container, ud: Any, parent_ud: Any) -> None:
    """Copy the output keys to the userdata of the container around it."""
    _copy(container.get_registered_output_keys(), ud, parent_ud, "output")


def _copy(keys: Iterable[str], source: Any, target: Any, kind: str) -> None:
    if source is None or target is None:
        return
    for key in keys:
        try:
            target[key] = source[key]
        except KeyError:
            log.logwarn(f"Attempting to copy {kind} key '{key}', but this key does not exist.")


_PRIVATE: Final = (
    (State, "_outcomes", _names("outcomes")),
    (State, "_input_keys", _names("input_keys")),
    (State, "_output_keys", _names("output_keys")),
    (Container, "_copy_input_keys", _copy_input_keys),
    (Container, "_copy_output_keys", _copy_output_keys),
)
"""Private names of SMACH that programs use or change: class, name, value."""


class Border:
    """What an old program finds changed in this package's classes, to undo it.

    Args:
        stand_ins: Whether functions and classes take stand-ins.
    """

    def __init__(self, *, stand_ins: bool) -> None:
        self._stand_ins = stand_ins
        self._before: list[tuple[Any, str, Any]] = []

    def open(self) -> None:
        """Give states and containers the private names of SMACH."""
        for owner, name, value in _PRIVATE:
            self._set(owner, name, value)

    def add(self, module: types.ModuleType) -> None:
        """Make the public functions and classes of a module of ROS 1's names take stand-ins."""
        if not self._stand_ins:
            return
        for name, value in list(vars(module).items()):
            if name.startswith("_") or not _is_ours(value):
                continue
            if isinstance(value, types.FunctionType):
                self._replace(module, name, value)
            elif isinstance(value, type) and not issubclass(value, BaseException):
                for kind in filter(_is_ours, value.__mro__):
                    for method in _METHODS:
                        if method in vars(kind):
                            self._replace(kind, method, vars(kind)[method])

    def _replace(self, owner: Any, name: str, function: Any) -> None:
        if isinstance(function, construction_method):
            made: Any = construction_method(_fitting(function.__wrapped__))
            made.__set_name__(owner, name)
        else:
            made = _fitting(function)
        if getattr(function, "smachpy_border", None) is None:
            made.smachpy_border = self
            self._set(owner, name, made)

    def _set(self, owner: Any, name: str, value: Any) -> None:
        self._before.append((owner, name, vars(owner).get(name, _ABSENT)))
        setattr(owner, name, value)

    def close(self) -> None:
        """Undo it all."""
        for owner, name, value in reversed(self._before):
            if value is _ABSENT:
                delattr(owner, name)
            else:
                setattr(owner, name, value)
        self._before.clear()


_ABSENT: Final = object()


def _is_ours(value: Any) -> bool:
    home = getattr(value, "__module__", None) or ""
    ours = home.partition(".")[0] in {"smachpy", "actionlib_core"}
    return ours and ".interfaces" not in home


def _fitting(function: Callable[..., Any]) -> Callable[..., Any]:
    signature = inspect.signature(function)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError:  # its own error is the best one
            return function(*args, **kwargs)
        given = bound.arguments
        for name, value in given.items():
            given[name] = _fit(signature.parameters[name], value)
        for interface, message in _MESSAGES.items():
            if interface in given and message in given and not is_stand_in(type(given[message])):
                kind = given[interface]
                if isinstance(kind, type) and takes_any_message(kind):
                    given[message] = signature.parameters[message].default
        return function(*bound.args, **bound.kwargs)

    return call


def _fit(parameter: Parameter, value: Any) -> Any:
    """Return an argument for a parameter; what is no stand-in and holds none stays as it is."""
    takes = str(parameter.annotation)
    if parameter.name == "self":
        return value
    if parameter.kind is parameter.VAR_KEYWORD:
        return {name: each for name, each in value.items() if not is_stand_in(each)}
    if not is_stand_in(value):
        return _with_words(value) if "str" in takes else value
    if parameter.name in _INTERFACES:
        return interface_for(value, _INTERFACES[parameter.name])
    if parameter.default is not parameter.empty:
        return parameter.default
    made: dict[str, Callable[[], Any]] = {
        "Callable": lambda: value,
        "Iterable": list,
        "Sequence": list,
        "Mapping": dict,
        "str": lambda: word_of(value),
        "float": lambda: 1.0,
        "Container": lambda: StandInMachine(word_of(value)),
        "State": lambda: value() if isinstance(value, type) else value,
    }
    return next((make() for kind, make in made.items() if kind in takes), value)


def _with_words(value: Any) -> Any:
    """Return a list or dict with words in the place of stand-ins."""
    if is_stand_in(value):
        return word_of(value)
    if isinstance(value, dict):
        return {_with_words(key): _with_words(each) for key, each in value.items()}
    if type(value) in {list, tuple, set}:
        return type(value)(map(_with_words, value))
    return value
