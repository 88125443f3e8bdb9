"""Stand-ins for missing modules, messages and values of an old program.

They accept every call, attribute and item and do nothing, so that a machine can be built, drawn,
checked and explored.
"""

from __future__ import annotations

import ast
import builtins
import re
import sys
import types
from dataclasses import dataclass
from dis import opname
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces import (
    InterfaceError,
    define_action,
    define_message,
    define_service,
)
from smachpy.ros1.python2 import to_tree
from smachpy.ros1.session import session

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

_ACTION_ENDS = ("ActionGoal", "ActionResult", "ActionFeedback", "Action")

_MARKS = frozenset({"_md5sum", "nsecs", "to_nsec"})
"""Attributes by which messages and times are recognised; stand-ins must not have them."""


class Anything:
    """A value that allows every operation.

    In sums it is 0 or a word, as a list empty, as a condition true. As a base class it accepts any
    arguments.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        name = args[0] if len(args) == 1 and isinstance(args[0], str) and not kwargs else "stub"
        self.__dict__["_stub_name"] = name

    def __getattr__(self, name: str) -> Any:
        if (name.startswith("__") and name.endswith("__")) or name in _MARKS:
            raise AttributeError(name)
        return Anything(f"{self.__dict__.get('_stub_name', 'stub')}.{name}")

    def __call__(self, *args: Any, **kwargs: Any) -> Any:  # noqa: D102  what it means is said above
        del kwargs
        if len(args) == 1 and isinstance(args[0], (types.FunctionType, type)):
            return args[0]  # it was used as a decorator
        return Anything(f"{self._stub_name}()")

    def __getitem__(self, key: Any) -> Any:
        return Anything(f"{self._stub_name}[...]")

    def __setitem__(self, key: Any, value: Any) -> None:
        pass

    def __delitem__(self, key: Any) -> None:
        pass

    def __iter__(self) -> Iterator[Any]:
        # `a, b = value` needs two items; a loop over it gets none, as it would never end.
        count = _wanted_items(sys._getframe(1))
        return iter([Anything(f"{self._stub_name}[...]") for _ in range(count)])

    def __len__(self) -> int:
        return 0

    def __bool__(self) -> bool:
        return True

    def __contains__(self, item: Any) -> bool:
        return False

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *args: object) -> None:
        pass

    def __hash__(self) -> int:
        return id(self)

    def __eq__(self, other: object) -> bool:
        return self is other

    def __repr__(self) -> str:
        return f"<stand-in {self._stub_name}>"

    def __str__(self) -> str:
        return word_of(self)

    def __float__(self) -> float:
        return 0.0

    def __int__(self) -> int:
        return 0

    def __index__(self) -> int:
        return 0

    def to_sec(self) -> float:
        """Return 0, as for a duration."""
        return 0.0

    def keys(self) -> list[Any]:
        """Return no keys, as for an empty dict."""
        return []

    def __mro_entries__(self, bases: tuple[type, ...]) -> tuple[type, ...]:
        """Allow a program to derive a class from it."""
        del bases
        return (Anything,)


def is_stand_in(value: object) -> bool:
    """Return whether a value is a stand-in, or a class that was made as one."""
    if isinstance(value, type):
        return isinstance(value, _AnyClass) and value.__module__ == __name__
    return isinstance(value, Anything)


def word_of(stand_in: Any) -> str:
    """Return a word for a stand-in: the last name by which the program asked for it."""
    if isinstance(stand_in, type):
        return stand_in.__name__
    words = re.findall(r"[A-Za-z]\w*", stand_in.__dict__["_stub_name"])
    return words[-1] if words else "stub"


def interface_for(stand_in: Any, kind: str) -> Any:
    """Return an interface in the place of a stand-in for its class.

    Args:
        stand_in: The stand-in.
        kind: "msg", "srv" or "action".
    """
    if isinstance(stand_in, type) and issubclass(stand_in, _Loose):
        return stand_in
    word = word_of(stand_in)
    if kind == "action":
        return _action_part(_PACKAGE, word.removesuffix("Action") or word, "Action")
    return (_service if kind == "srv" else _message)(_PACKAGE, word)


def takes_any_message(interface: Any) -> bool:
    """Return whether an action's goal or a service's request is a stand-in."""
    request = getattr(interface, "_request_class", None)
    if request is None:
        request = type(getattr(getattr(interface(), "action_goal", None), "goal", None))
    return is_stand_in(request)


_PACKAGE = "stand_in"  # the package of interfaces that are known by a stand-in only


@dataclass(frozen=True, slots=True)
class _StarNames:
    """What an importing file leaves to its star imports.

    Attributes:
        unbound: Names that it reads and does not bind.
        services: Those of them that it uses as classes of services.
    """

    unbound: tuple[str, ...] = ()
    services: frozenset[str] = frozenset()


def _importing(frame: FrameType | None) -> tuple[_StarNames, dict[str, Any]]:
    """Return the names that the importing file needs, if it can be read, and its globals."""
    while frame is not None and ("importlib" in frame.f_code.co_filename or _is_here(frame)):
        frame = frame.f_back
    if frame is None:
        return _StarNames(), {}
    file = Path(frame.f_code.co_filename)
    try:
        return _names_in(file, file.stat().st_mtime_ns), frame.f_globals
    except (OSError, SyntaxError):
        return _StarNames(), {}


@lru_cache(maxsize=64)  # a file may have dozens of star imports
def _names_in(file: Path, _changed: int) -> _StarNames:
    nodes = list(ast.walk(to_tree(file.read_bytes(), str(file))))
    unbound = _unbound(nodes)
    services = set()
    for call in nodes:
        if isinstance(call, ast.Call) and len(call.args) > 1:
            called = call.func.attr if isinstance(call.func, ast.Attribute) else ""
            called = call.func.id if isinstance(call.func, ast.Name) else called
            if called in _SERVICE_CALLS and isinstance(call.args[1], ast.Name):
                services.add(call.args[1].id)
    return _StarNames(tuple(unbound), frozenset(services.intersection(unbound)))


def _is_here(frame: FrameType) -> bool:
    return frame.f_code.co_filename == __file__


def service_names(frame: FrameType | None) -> frozenset[str]:
    """Return the unbound names that the importing file uses as classes of services."""
    return _importing(frame)[0].services


_SERVICE_CALLS = frozenset({"Service", "ServiceProxy", "ServiceState"})


def unbound_names(frame: FrameType | None) -> list[str]:
    """Return the names that the importing file reads but neither binds nor has imported.

    For a star import from a stand-in: these are the names that it has to provide.
    """
    names, there = _importing(frame)
    return [name for name in names.unbound if name not in there]


def _unbound(nodes: list[ast.AST]) -> list[str]:
    read = {n.id for n in nodes if isinstance(n, ast.Name)}
    for node in nodes:
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            read.discard(node.id)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            read.discard(node.name)
        elif isinstance(node, ast.arg):
            read.discard(node.arg)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            read -= {(name.asname or name.name).partition(".")[0] for name in node.names}
    return sorted(read - set(dir(builtins)))


def _wanted_items(frame: FrameType) -> int:
    """Return how many values the code unpacks from a stand-in; 0 for other iterations."""
    code = frame.f_code.co_code  # f_lasti: the instruction that is running; its argument follows
    if opname[code[frame.f_lasti]] == "UNPACK_SEQUENCE":
        return code[frame.f_lasti + 1]
    return 0


def _number(name: str) -> Callable[..., Any]:
    def operate(self: Anything, *others: Any) -> Any:
        if others and isinstance(others[0], str):  # then it is text: part of a name or path
            return {"add": f"{self}{others[0]}", "radd": f"{others[0]}{self}"}.get(name, str(self))
        if others and isinstance(others[0], list | tuple):
            return others[0]
        return 0  # not 0.0, as `range` needs an integer

    operate.__name__ = name
    return operate


for _name in (
    *("add", "sub", "mul", "truediv", "floordiv", "mod", "pow"),
    *("radd", "rsub", "rmul", "rtruediv", "rfloordiv", "rmod", "rpow"),
    *("neg", "pos", "abs", "round"),
):
    setattr(Anything, f"__{_name}__", _number(_name))
for _name in ("lt", "le", "gt", "ge"):
    setattr(Anything, f"__{_name}__", lambda _self, _other: False)


class StubModule(types.ModuleType):
    """A module that has every name."""

    def __init__(self, name: str) -> None:
        super().__init__(name, "A stand-in for a module that is missing.")
        self.__path__: list[str] = []
        self.__file__ = None

    def __getattr__(self, name: str) -> Any:
        if name == "__all__":
            return unbound_names(sys._getframe(1))
        if name.startswith("__") and name.endswith("__"):
            raise AttributeError(name)
        value = _stand_in(name)
        setattr(self, name, value)
        return value


class _AnyClass(type):
    """Makes a class have every attribute: a constant of a message, or a name if it is a module.

    It can be read like an enumeration, too.
    """

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("_") or name in _MARKS:
            raise AttributeError(name)
        return _stand_in(name)

    def __getitem__(cls, key: Any) -> Any:
        return Anything(f"{cls.__name__}[{key}]")

    def __iter__(cls) -> Iterator[Any]:
        return iter(Anything(cls.__name__))

    def __len__(cls) -> int:
        return 0


def _stand_in(name: str) -> Any:
    """Return a class for a name such as `Gripper`; a value for `gripper` and `GRIPPER`."""
    return stand_in_class(name) if name[:1].isupper() and not name.isupper() else Anything(name)


def stand_in_class(name: str) -> type:
    """Return a class whose instances are stand-ins; by its name it may be one of exceptions."""
    raised = name.endswith(("Error", "Exception"))
    return _AnyClass(
        name,
        (Anything, Exception) if raised else (Anything,),
        {
            "__init__": lambda self, *_args, **_kwargs: Anything.__init__(self, name),
            "__module__": __name__,
        },
    )


class OldSection(types.ModuleType):
    """`pkg.msg` or `pkg.srv` of an existing package, as ROS 1's generator writes it.

    A star import also gives the modules that the generated ones import: some scripts use `sys` or
    `std_msgs.msg.Bool` without importing them.

    Args:
        name: Its full name.
        known: The module with the interfaces.
    """

    def __init__(self, name: str, known: Any) -> None:
        super().__init__(name, known.__doc__)
        self._package = name.partition(".")[0]
        self._known = known
        self._leaked: tuple[str, ...] = ()

    def __getattr__(self, name: str) -> Any:
        if name == "__all__":
            names = list(self._known.__all__)
            self._leaked = (*_GENERATED, *sorted(_packages_of(self._known, names)))
            return [*names, *self._leaked]
        if name in self._leaked:
            return import_module(name)
        return getattr(self._known, name)

    def __dir__(self) -> list[str]:
        return dir(self._known)


_GENERATED = ("codecs", "genpy", "struct", "sys")


def _packages_of(section: Any, names: list[str]) -> set[str]:
    """Return the packages of the messages that are fields of those in a section."""
    found = set()
    for name in names:
        try:
            fields = getattr(getattr(section, name), "_slot_types", ())
        except InterfaceError:  # the definition of a field's type is missing
            continue
        found |= {field.partition("/")[0] for field in fields if "/" in field}
    return found


class StubSection(OldSection):
    """`pkg.msg` or `pkg.srv` with stand-ins for missing interfaces, made when they are used.

    Args:
        name: Its full name.
        known: The module with the existing interfaces; None: the whole package is missing.
    """

    def __init__(self, name: str, known: Any = None) -> None:
        super().__init__(name, known)
        self.__doc__ = "Stand-ins for the interfaces of a package that is missing."
        self.__file__ = None
        self.__path__: list[str] = []
        self._kind = name.partition(".")[2]
        self._names: list[str] = list(known.__all__) if known is not None else []

    def __getattr__(self, name: str) -> Any:
        if name == "__all__":
            there = super().__getattr__(name) if self._known is not None else []
            return [*there, *self._stand_ins(sys._getframe(1), there)]
        if name in self._leaked:
            return import_module(name)
        if name.startswith("_"):
            raise AttributeError(name)
        if name in self._names:
            return self._resolved(name)
        session().stand_in(f"{self._package}/{name}")
        make = _service if self._kind == "srv" else _message
        value = make(self._package, name)
        setattr(self, name, value)
        return value

    def _stand_ins(self, frame: FrameType | None, there: list[str]) -> list[str]:
        """Return the names that a star import gives in addition to the existing ones.

        Those that the script uses as classes of services belong to `srv`, even in lower case.
        """
        unbound, services = unbound_names(frame), service_names(frame)
        if self._kind == "srv":
            used = sorted({each for each in unbound if each[0].isupper()} | services)
        else:
            used = [each for each in unbound if each[0].isupper() and each not in services]
        return [each for each in used if each not in there]

    def _resolved(self, name: str) -> Any:
        """Return an existing class; missing types of its fields become empty messages."""
        made: set[str] = set()
        while True:
            try:
                found = getattr(self._known, name)
                return _loose.get(found, found)  # made as a stand-in for an earlier program
            except InterfaceError as error:
                unknown = set(re.findall(r"unknown type: got '(\w+/\w+)'", str(error))) - made
                if not unknown:
                    return stand_in_class(name)
                made |= unknown
                for each in sorted(unknown):
                    define_message(each, "")
                    session().stand_in(each)


def _message(package: str, name: str) -> Any:
    """Return a message class; a name such as XGoal or XActionResult makes a whole action."""
    for end in _ACTION_ENDS:
        if name.endswith(end) and name != end:
            return _action_part(package, name.removesuffix(end), end)
    for end in ("Goal", "Result", "Feedback"):
        if name.endswith(end) and name != end:
            return _action_part(package, name.removesuffix(end), end)
    return permissive(define_message(f"{package}/{name}", ""))


def _action_part(package: str, base: str, end: str) -> Any:
    from actionlib_core.interfaces import get_message

    action = define_action(f"{package}/{base}", "---\n---\n")
    for part in ("Goal", "Result", "Feedback"):
        loose = permissive(get_message(f"{package}/{base}{part}"))
        _fill(get_message(f"{package}/{base}Action{part}"), part.lower(), loose)
    return action if end == "Action" else permissive(get_message(f"{package}/{base}{end}"))


def _service(package: str, name: str) -> Any:
    base = name.removesuffix("Request").removesuffix("Response")
    service = permissive(define_service(f"{package}/{base}", "---\n"))
    service._request_class = permissive(service._request_class)
    service._response_class = permissive(service._response_class)
    if name == base:
        return service
    return service._request_class if name.endswith("Request") else service._response_class


def _fill(holder: Any, field: str, loose: type) -> None:
    """Make new messages of a class have a permissive message in a field."""
    plain = holder.__init__

    def make(self: Any, *args: Any, **fields: Any) -> None:
        plain(self, *args, **fields)
        if not isinstance(getattr(self, field), loose):
            setattr(self, field, loose())

    holder.__init__ = make


_loose: dict[type, type] = {}


def permissive(kind: type) -> Any:
    """Return a subclass of a message or service class that has every field."""
    if issubclass(kind, _Loose):
        return kind
    if kind not in _loose:
        made: Any = _AnyClass(kind.__name__, (_Loose, kind), {})
        made.__slots__ = EVERY_NAME
        _loose[kind] = made
    return _loose[kind]


class _EveryName(tuple[str, ...]):
    """Empty when iterated, but contains every name."""

    __slots__ = ()

    def __contains__(self, name: object) -> bool:
        return True


EVERY_NAME = _EveryName()


class _Loose:
    """Accepts every field; a field that was not set is a stand-in."""

    def __init__(self, *_args: Any, **fields: Any) -> None:
        super().__init__()
        self.__dict__.update(fields)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        value = Anything(name)
        self.__dict__[name] = value
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        self.__dict__[name] = value
