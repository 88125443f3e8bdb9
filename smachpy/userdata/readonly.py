"""Read-only views of values, which are still instances of the value's class.

The view of a list, dict or set is an instance of a subclass that holds read-only elements and whose
mutating methods raise. The view of an object is an instance of a subclass that shares the object's
attributes and returns them read-only, so that its methods, operators and `isinstance` work. Objects
of classes that do not allow such a subclass (locks, files, functions, modules) are returned as they
are.
"""

from __future__ import annotations

import contextlib
import enum
import functools
import types
from collections import OrderedDict, defaultdict, deque
from contextvars import ContextVar
from operator import is_
from typing import TYPE_CHECKING, Any

from smachpy.base.context import current_path
from smachpy.base.slips import accepts
from smachpy.exceptions import ReadOnlyError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

# Py_TPFLAGS_HEAPTYPE: set for classes made by a `class` statement, not for static types of C code.
_HEAP_TYPE = 1 << 9

# Types whose instances cannot change: they need no view.
ATOMS: frozenset[type] = frozenset(
    {int, float, complex, bool, str, bytes, type(None), type(Ellipsis), range, type}
    | {types.FunctionType, types.BuiltinFunctionType, types.MethodType, types.ModuleType}
)


def read_only(value: Any, key: str = "") -> Any:
    """Return a read-only view of `value`, or `value` itself if it needs none.

    Args:
        value: Any value.
        key: The userdata key from which it, or the value around it, was read; for error texts.
    """
    try:
        return _view(value, key)
    except RecursionError:  # it contains itself: again, with a note of the views that are made
        token = _MADE.set({})
    try:
        return _view(value, key)
    finally:
        _MADE.reset(token)


def _view(value: Any, key: str) -> Any:
    kind = type(value)
    if kind in ATOMS:
        return value
    maker = _maker(kind)  # type: ignore[arg-type]  # a type is hashable
    return value if maker is None else maker(value, key)


_MADE: ContextVar[dict[int, Any] | None] = ContextVar("smachpy_views_made", default=None)
"""Identity of a value -> its view, while views are made of one that contains itself."""


def still_shows(view: Any, value: Any) -> bool:
    """Return whether `view`, made by `read_only(value)`, still has the content of `value`.

    For a value that contains itself the answer is False.

    For nested lists, the comparison takes a fifth of the time of making a view. For views with
    copies that cannot be compared by identity (sets, slots), the answer is always False.
    """
    if view is value:
        return type(value) in ATOMS
    looks = getattr(type(view), "_smach_still_shows", None)
    if looks is None or view._smachpy_original is not value:
        return False
    try:
        return bool(looks(view, value))
    except RecursionError:
        return False


def _list_still_shows(view: list[Any], value: list[Any]) -> bool:
    if len(view) != len(value):
        return False
    # First the fast way, a loop in C: immutable elements are the same objects in view and original.
    # Identity, not `==`, which could be the user's code, and which equates 1, 1.0 and True.
    pairs = zip(view, value, strict=False)
    return all(map(is_, view, value)) or all(x is y or still_shows(x, y) for x, y in pairs)


def _dict_still_shows(view: dict[Any, Any], value: dict[Any, Any]) -> bool:
    return (
        len(view) == len(value)
        and all(map(is_, view, value))
        and _list_still_shows(list(view.values()), list(value.values()))
    )


def _object_still_shows(_view: Any, _value: Any) -> bool:
    return True  # it shares the attributes


def writable(value: Any) -> Any:
    """Undo `read_only`, also inside lists, tuples, sets, dicts, messages and dataclasses.

    A container with a view inside is copied, and a field that is one gets the original.

    Raises:
        ReadOnlyError: the value contains itself, and views too.
    """
    try:
        return _writable(value)
    except RecursionError:
        if not _has_view(value):
            return value
    problem = (
        "userdata: got a value that contains itself and values that this state may only read; "
        "expected one or the other. Try copy.deepcopy of what was read."
    )
    raise ReadOnlyError(problem, path=current_path())


def _has_view(value: Any) -> bool:
    """Return whether there is a view in a value that contains itself."""
    left, seen = [value], {id(value)}
    while left:
        one = left.pop()
        if isinstance(one, _View):
            return True
        new = [part for part in _inside(one) if id(part) not in seen]
        seen.update(map(id, new))
        left += new
    return False


def _inside(value: Any) -> Iterable[Any]:
    """Return the parts of a value in which `writable` looks for views."""
    kind: Any = type(value)
    if kind is list or kind is tuple or kind is set or kind is frozenset:
        parts: Iterable[Any] = () if ATOMS.issuperset(map(type, value)) else value
        return parts
    if kind is dict:
        return list(value.values())
    found = [getattr(value, name, None) for name in _fields(kind)]
    return [part for part in found if type(part) not in ATOMS]


@functools.lru_cache(maxsize=1024)
def _fields(kind: Any) -> tuple[str, ...]:
    """Return the names of the fields of messages, dataclasses and named tuples; of others none."""
    if hasattr(kind, "__dataclass_fields__"):
        return tuple(kind.__dataclass_fields__)
    if hasattr(kind, "_md5sum") and hasattr(kind, "__slots__"):
        return tuple(kind.__slots__)
    return tuple(kind._fields) if issubclass(kind, tuple) and hasattr(kind, "_make") else ()


def _writable(value: Any) -> Any:
    kind: Any = type(value)
    if issubclass(kind, _View):
        return value._smachpy_original
    if kind in ATOMS or not any(map(_holds_view, _inside(value))):
        return value
    if kind is dict:
        return {key: _writable(item) for key, item in value.items()}
    if not _fields(kind) or issubclass(kind, tuple):
        return getattr(kind, "_make", kind)(map(_writable, value))
    for name in _fields(kind):
        part = getattr(value, name, None)
        new = _writable(part)
        if new is not part:
            object.__setattr__(value, name, new)  # it may be frozen
    return value


def _holds_view(value: Any) -> bool:
    kind = type(value)
    if kind in ATOMS:
        return False
    return issubclass(kind, _View) or any(map(_holds_view, _inside(value)))


class _View:
    """Base of all views: `_smachpy_original` is the object, `_smach_key` its userdata key."""

    __slots__ = ()
    _smachpy_original: Any
    _smach_key: str


def _refuser(base: type, method: str) -> Callable[..., Any]:
    """Return the method that replaces, in a view, a method of `base` that changes the object.

    SMACH allowed a state to change lists and dicts. Where that is accepted (programs for ROS 1),
    the method changes both the original and the view.
    """

    def refuse(self: Any, *args: Any, **kwargs: Any) -> Any:
        name, key = type(self).__name__, self._smach_key
        path = current_path()
        problem = (
            f"{path or 'userdata'}: read-only value{f' of {key!r}' if key else ''}: got a change "
            f"of a {name}; expected reading only, because its userdata key is declared as input. "
            f"Try declaring it with io_keys{f'=[{key!r}]' if key else ''}."
        )
        if not accepts(problem):
            raise ReadOnlyError(problem, key=key, path=path)
        if base is not object:
            getattr(base, method)(self, *args, **kwargs)
        result = getattr(self._smachpy_original, method)(*args, **kwargs)
        return self if method[:3] == "__i" else result

    refuse.__name__ = method
    return refuse


_SEQUENCE = (
    *("append", "extend", "insert", "remove", "pop", "clear", "reverse"),
    *("__setitem__", "__delitem__", "__iadd__", "__imul__"),
)
_MAPPING = (
    *("update", "clear", "pop", "popitem", "setdefault"),
    *("__setitem__", "__delitem__", "__ior__"),
)
# Subclasses come before their base class: the first that fits counts.
_CHANGES: dict[type, tuple[str, ...]] = {
    list: (*_SEQUENCE, "sort"),
    bytearray: _SEQUENCE,
    deque: (*_SEQUENCE, "appendleft", "extendleft", "popleft", "rotate"),
    OrderedDict: (*_MAPPING, "move_to_end"),
    dict: _MAPPING,
    set: (
        *("add", "discard", "remove", "pop", "clear", "update", "difference_update"),
        *("intersection_update", "symmetric_difference_update"),
        *("__iand__", "__ior__", "__isub__", "__ixor__"),
    ),
}


@functools.lru_cache(maxsize=1024)
def _maker(kind: type) -> Callable[[Any, str], Any] | None:
    """Return the function that makes a view of an instance of `kind`; None if it needs no view."""
    # A view is read-only already, a frozenset cannot change, and classes, enum members and
    # exceptions are compared by identity, so a view of them would not be equal to them.
    if issubclass(kind, (_View, type, enum.Enum, BaseException, frozenset)):
        return None
    if kind.__module__ == "numpy" and kind.__name__ == "ndarray":
        return _array_view
    if issubclass(kind, tuple):
        return _tuple_view if kind is tuple or hasattr(kind, "_make") else None
    base = next((base for base in _CHANGES if issubclass(kind, base)), None)
    # A class implemented in C without known methods, such as a lock or a file: what would change it
    # is not known.
    if base is None and not kind.__flags__ & _HEAP_TYPE:
        return None
    return _view_maker(kind, base)


def _tuple_view(value: Any, key: str) -> Any:
    if all(type(item) in ATOMS for item in value):
        return value
    items = [_view(item, key) for item in value]
    return tuple(items) if type(value) is tuple else type(value)._make(items)


def _array_view(value: Any, _key: str) -> Any:
    view = value.view()
    view.flags.writeable = False
    return view


def _view_maker(kind: type, base: type | None) -> Callable[[Any, str], Any] | None:
    view_class = _view_class(kind, base)
    if view_class is None:
        return None
    new: Any = object.__new__ if base is None else base.__new__
    try:
        new(view_class)
    except TypeError:  # implemented in C: only its own constructor makes instances
        return None
    slots = _slots_of(kind)
    has_dict = kind.__dictoffset__ != 0

    def make(value: Any, key: str) -> Any:
        # Without `__init__`, which may do anything: attributes are shared or copied below.
        made = _MADE.get()
        if made is not None and id(value) in made:
            return made[id(value)]
        view = new(view_class)
        if made is not None:
            made[id(value)] = view
        if base is not None:
            _fill(base, view, value, key)
        for slot in slots:
            with contextlib.suppress(AttributeError):  # an empty slot
                object.__setattr__(view, slot, object.__getattribute__(value, slot))
        if has_dict:  # the same dict, so that later changes of the object are seen in the view
            object.__setattr__(view, "__dict__", value.__dict__)
        object.__setattr__(view, "_smachpy_original", value)
        object.__setattr__(view, "_smach_key", key)
        return view

    return make


def _view_class(kind: type, base: type | None) -> Any:
    """Return the class of the views of `kind`; None if it cannot be subclassed."""
    getter: Any = kind.__getattribute__
    # What is computed once stays in the attributes, which the object and its views share: it is
    # made of the object's own parts, not of views.
    once = frozenset(
        name
        for cls in kind.__mro__
        for name, what in vars(cls).items()
        if isinstance(what, functools.cached_property)
    )

    def __getattribute__(self: Any, name: str) -> Any:  # noqa: N807
        value = getter(self._smachpy_original if name in once else self, name)
        if type(value) in ATOMS or name[:2] == "__" or name == "_smachpy_original":
            return value
        return read_only(value, self._smach_key)

    # For built-in containers the mutating methods are known and replaced. For other objects every
    # attribute is read-only, and values read from it become views in `__getattribute__`.
    changes = () if base is None else _CHANGES[base]
    body: dict[str, Any] = {name: _refuser(base or object, name) for name in changes}
    body |= {
        "__new__": lambda _cls, *args, **kwargs: kind.__new__(kind, *args, **kwargs),
        "__slots__": ("_smach_key", "_smachpy_original"),
        "__class__": property(lambda _self: kind),  # dataclasses compare `__class__`
        "__module__": kind.__module__,
        "__qualname__": kind.__qualname__,
        "__doc__": kind.__doc__,
        "__hash__": kind.__hash__,
        "__reduce_ex__": _reduce,
        "_smach_still_shows": _comparer(kind, base),
    }
    if issubclass(kind, defaultdict):
        body["__missing__"] = _missing
    if kind is not base:
        body |= {
            "__getattribute__": __getattribute__,
            "__setattr__": _refuser(object, "__setattr__"),
            "__delattr__": _refuser(object, "__delattr__"),
        }
    try:
        made: Any = types.new_class(
            kind.__name__,
            (kind, _View),
            {"metaclass": _view_metaclass(type(kind))},
            exec_body=lambda ns: ns.update(body),
        )
    except TypeError:  # a final class, or a metaclass with its own rules
        return None
    # Programs list an object's attributes by `__slots__`, as the `repr` of a message does.
    if hasattr(kind, "__slots__"):
        made.__slots__ = kind.__slots__
    else:
        del made.__slots__
    return made


@functools.lru_cache(maxsize=64)
def _view_metaclass(metaclass: type) -> type:
    """Return the metaclass of views of classes with this metaclass.

    Methods of the user's class make new objects by `type(self)(...)`, and class methods by
    `cls(...)`; both are the view's class here. The new objects are ordinary ones.
    """

    def call(cls: Any, *args: Any, **kwargs: Any) -> Any:
        return cls.__mro__[1](*args, **kwargs)  # the viewed class

    return type(metaclass)(metaclass.__name__, (metaclass,), {"__call__": call})


def _missing(self: Any, name: Any) -> Any:
    """Return the default of a `defaultdict` for a key that it does not have, without adding it."""
    factory = self._smachpy_original.default_factory
    if factory is None:
        raise KeyError(name)
    return read_only(factory(), self._smach_key)


def _comparer(kind: type, base: type | None) -> Callable[[Any, Any], bool] | None:
    """Return the function that compares a view of `kind` with its original; None if impossible."""
    if kind is list:
        return _list_still_shows
    if kind is dict:
        return _dict_still_shows
    return _object_still_shows if base is None and not _slots_of(kind) else None


def _fill(base: type, view: Any, value: Any, key: str) -> None:
    """Fill a new view of a built-in container with read-only elements."""
    # The base class's own methods: those of a subclass of the user's may do anything, and those of
    # the view raise.
    if isinstance(value, OrderedDict):
        for name, item in value.items():
            OrderedDict.__setitem__(view, name, _view(item, key))
    elif base is dict:
        dict.update(view, {n: _view(item, key) for n, item in dict.items(value)})
    elif base is set:
        set.update(view, value)
    elif base is bytearray:
        bytearray.extend(view, value)
    elif base is deque:
        deque.__init__(view, [_view(item, key) for item in value], value.maxlen)
    else:
        list.extend(view, [x if type(x) in ATOMS else _view(x, key) for x in list.__iter__(value)])


def _reduce(self: Any, protocol: Any) -> Any:
    """Copy and pickle like the original: a copy of a view may be changed."""
    return self._smachpy_original.__reduce_ex__(protocol)


def _slots_of(kind: type) -> tuple[str, ...]:
    found: list[str] = []
    for cls in kind.__mro__:
        slots = cls.__dict__.get("__slots__", ())
        for slot in (slots,) if isinstance(slots, str) else slots:
            if slot in {"__dict__", "__weakref__"}:
                continue
            mangled = slot.startswith("__") and not slot.endswith("__")
            found.append(f"_{cls.__name__.lstrip('_')}{slot}" if mangled else slot)
    return tuple(found)
