"""Every exception of smachpy; the data of each error is on the object too.

    Exception
     +-- SmachError
          +-- InvalidConstructionError   a container is built in a way that cannot work
          +-- InvalidStateError          a state, its label or its options are wrong
          |    +-- InconsistentMachineError  a finished machine does not hold together
          +-- InvalidTransitionError     an outcome or a target that does not exist
          |    +-- InconsistentMachineError
          +-- MissionError               what a mission or a command is given is wrong
          +-- InvalidUserCodeError       a state or a callback raised; see `path` and `__cause__`
               +-- UserDataKeyError      a key was not declared or is not there (KeyError too)
               +-- UserDataTypeError     a value does not fit its typed field (TypeError too)
               +-- ReadOnlyError         an input-only value was changed (TypeError too)

Exceptions never write to a log; who handles one decides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

did_you_mean = suggest.did_you_mean


class SmachError(Exception):
    """Root of all errors that smachpy raises on purpose.

    Attributes:
        message: The text.
    """

    def __init__(self, message: str = "") -> None:
        self.message = message
        super().__init__(message)


class MissionError(SmachError):
    """What a mission, a command or the simulated robot was given is wrong, or it cannot do it."""


class InvalidConstructionError(SmachError):
    """A container is built in a way that cannot work."""


class InvalidStateError(SmachError):
    """A state, its label, its arguments or its options are wrong.

    Attributes:
        problems: One text per problem, "argument: got ...; expected ...", or none: see `message`.
    """

    def __init__(self, message: str = "", problems: Iterable[str] = ()) -> None:
        self.problems = tuple(problems)
        super().__init__(message)


class InvalidTransitionError(SmachError):
    """An outcome or the target of a transition does not exist."""


class InconsistentMachineError(InvalidTransitionError, InvalidStateError):
    """A machine does not hold together; all its problems at once.

    Attributes:
        problems: One text per problem, "path: what: got …; expected …".
    """

    def __init__(self, where: str, problems: Sequence[str]) -> None:
        text = "".join(problems)
        if len(problems) != 1:
            lines = "".join(f"\n  - {problem}" for problem in problems)
            text = f"{where} has {len(problems)} problems:{lines}"
        super().__init__(text)
        self.problems = tuple(problems)


class InvalidUserCodeError(SmachError):
    """A state or a callback raised, or used the library wrongly; the cause is chained.

    Attributes:
        path: Path of the state that raised ("/PATROL/DRIVE"), or "".
    """

    def __init__(self, message: str = "", *, path: str = "") -> None:
        self.path = path
        super().__init__(message)


class UserDataKeyError(InvalidUserCodeError, KeyError, AttributeError):
    """A userdata key was not declared, or has no value.

    It is a `KeyError` and an `AttributeError`, so that `in`, `hasattr` and `getattr` with a
    default work.

    Attributes:
        key: The key.
        declared: The keys that the state declared (undeclared key), or those that have a value.
    """

    def __init__(
        self, key: str, problem: str, declared: Iterable[object] = (), *, path: str = ""
    ) -> None:
        self.key = key
        self.declared = tuple(sorted(map(str, declared)))
        text = f"{path or 'userdata'}: {problem}{did_you_mean(key, self.declared)}"
        InvalidUserCodeError.__init__(self, text, path=path)

    def __str__(self) -> str:
        return self.message


class UserDataTypeError(InvalidUserCodeError, TypeError):
    """A value does not fit the field of typed userdata.

    Attributes:
        key: The field.
        value: What was written.
        expected: The annotated type.
    """

    def __init__(self, key: str, value: object, expected: object, *, path: str = "") -> None:
        self.key = key
        self.value = value
        self.expected = expected
        name = getattr(expected, "__name__", None) or str(expected)
        super().__init__(
            f"{path}{': ' if path else ''}userdata key {key!r} has another type: got {value!r} "
            f"({type(value).__name__}); expected {name}.",
            path=path,
        )


class ReadOnlyError(InvalidUserCodeError, TypeError):
    """A state tried to change a value that it declared as input only.

    Attributes:
        key: The userdata key, or "" for a view of `get_const`.
    """

    def __init__(self, message: str = "", *, key: str = "", path: str = "") -> None:
        self.key = key
        super().__init__(message, path=path)
