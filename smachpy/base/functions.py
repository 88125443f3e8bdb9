"""What users' functions are: their names, their kinds, and what they can be called with.

What `inspect` knows, mostly without it: its import takes a tenth of the time of `import smachpy`.
"""

from __future__ import annotations

import functools
from types import CodeType, CoroutineType, FunctionType, MethodType
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

# As `inspect.CO_VARARGS` and others.
_VARARGS: Final = 0x04
_GENERATOR: Final = 0x20
_COROUTINE: Final = 0x80
_ASYNC_GENERATOR: Final = 0x200


def is_coroutine_function(function: Any) -> bool:
    """Return whether a call returns a coroutine: `async def` without `yield`."""
    return bool(_flags(function) & _COROUTINE)


def unrun_kind(function: Any) -> str:
    """Return "async" or "generator" if a call runs no line of the function's body, else ""."""
    flags = _flags(function)
    if flags & (_COROUTINE | _ASYNC_GENERATOR):
        return "async"
    return "generator" if flags & _GENERATOR else ""


def _flags(function: Any) -> int:
    """Return the flags of its code; 0 if it has none, as what is written in C."""
    while isinstance(function, (MethodType, functools.partial)):
        function = function.__func__ if isinstance(function, MethodType) else function.func
    code = getattr(function, "__code__", None)
    return code.co_flags if isinstance(code, CodeType) else 0


def no_coroutine(answer: Any) -> Any:
    """Return what a function of the user has answered.

    Raises:
        TypeError: it is a coroutine, which nothing would await, and which counts as true.
    """
    if isinstance(answer, CoroutineType):
        answer.close()
        raise TypeError("got a coroutine; expected an answer. Try a function that is not async.")
    return answer


def takes(function: Any, count: int, kwargs: Mapping[str, Any] | None = None) -> bool:
    """Return whether `function` can be called with `count` positional arguments; True if unknown.

    For a decorated function the signature of the wrapper counts, not that of the wrapped function:
    the wrapper may add or remove arguments.
    """
    if not kwargs and _takes_surely(function, count):
        return True
    from inspect import signature

    try:
        found = signature(function, follow_wrapped=False)
    except (TypeError, ValueError):  # implemented in C, without a signature
        return True
    try:
        found.bind(*[None] * count, **(kwargs or {}))
    except TypeError:
        return False
    return True


def _takes_surely(function: Any, count: int) -> bool:
    """Return whether it is a plain function or method that takes `count` positional arguments."""
    if isinstance(function, MethodType):
        function, count = function.__func__, count + 1
    if not isinstance(function, FunctionType) or hasattr(function, "__signature__"):
        return False
    code = function.__code__
    if code.co_kwonlyargcount > len(function.__kwdefaults__ or ()):
        return False
    least = code.co_argcount - len(function.__defaults__ or ())
    return least <= count and (count <= code.co_argcount or bool(code.co_flags & _VARARGS))


def signature_text(function: Any) -> str:
    """Return the arguments as text, such as "(self, userdata)"; "" if unknown."""
    from inspect import signature

    try:
        return str(signature(function, follow_wrapped=False))
    except (TypeError, ValueError):
        return ""


def name_of(function: object) -> str:
    """Return the name of a user's function for texts, never with a memory address.

    A method is named with its class, a `functools.partial` as its function, and any other callable
    object as its class.
    """
    while isinstance(function, functools.partial):
        function = function.func
    name = getattr(function, "__qualname__", None) or getattr(function, "__name__", None)
    return str(name or type(function).__name__).rpartition("<locals>.")[2]
