"""All exceptions of smachpy; the data of each error are attributes as well.

    Exception
     +-- SmachError
          +-- InvalidConstructionError   a container is built in a wrong way
          +-- InvalidStateError          a state, its label or its options are wrong
          |    +-- InconsistentMachineError  a finished machine has problems
          +-- InvalidTransitionError     an outcome or a target does not exist
          |    +-- InconsistentMachineError
          +-- MissionError               a mission or a command got wrong arguments or files
          +-- InvalidUserCodeError       a state or a callback raised; see `path` and `__cause__`
               +-- UserDataKeyError      a key is not declared or has no value (KeyError too)
               +-- UserDataTypeError     a value does not fit its typed field (TypeError too)
               +-- ReadOnlyError         an input-only value was changed (TypeError too)

Exceptions are never logged where they are raised; the code that handles them decides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core.exceptions import Documented
from actionlib_core.inputs import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

did_you_mean = suggest.did_you_mean


def error_text(error: BaseException) -> str:
    """Return the type and the text of an exception, also if its own `__str__` raises."""
    kind = type(error).__name__
    try:
        return f"{kind}: {error}"
    except Exception as failure:  # noqa: BLE001  the user's code: show its failure instead
        return f"{kind}: <its str raised {type(failure).__name__}>"


class SmachError(Documented):
    """Root of all errors that smachpy raises on purpose.

    Try: see the error's own class; `except SmachError` catches them all.

    Attributes:
        message: The text.
    """

    def __init__(self, message: str = "") -> None:
        self.message = message
        super().__init__(message)


class MissionError(SmachError):
    """A mission, command or simulated robot got wrong arguments or files, or cannot proceed.

    Try: correct the argument or the file that is named.
    """


class InvalidConstructionError(SmachError):
    """A container is built in a wrong way.

    Try: build the container as the text says; it cannot change while it runs.
    """


class InvalidStateError(SmachError):
    """A state, its label, its arguments or its options are wrong.

    Try: correct each argument that is listed.

    Attributes:
        problems: One text per problem, "argument: got ...; expected ...", or none: see `message`.
    """

    def __init__(self, message: str = "", problems: Iterable[str] = ()) -> None:
        self.problems = tuple(problems)
        super().__init__(message)


class InvalidTransitionError(SmachError):
    """An outcome or the target of a transition does not exist.

    Try: add the missing state or outcome, or correct the label in `transitions`.
    """


class InconsistentMachineError(InvalidTransitionError, InvalidStateError):
    """A machine has problems; with all of them.

    Try: correct each problem that is listed; `smachpy check` finds more of them.

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

    Try: look at the exception above it, which your code raised, at the path that is named.

    Attributes:
        path: Path of the state that raised ("/PATROL/DRIVE"), or "".
    """

    def __init__(self, message: str = "", *, path: str = "") -> None:
        self.path = path
        super().__init__(message)


class UserDataKeyError(InvalidUserCodeError, KeyError, AttributeError):
    """A userdata key was not declared, or has no value.

    Try: declare the key in `input_keys` or `output_keys`, or write a value before it is read.

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

    Try: write a value of the field's type, or change the annotation.

    Attributes:
        key: The field.
        value: The value that was written.
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

    Try: declare the key in `output_keys`, too, or change a copy.

    Attributes:
        key: The userdata key, or "" for a view of `get_const`.
    """

    def __init__(self, message: str = "", *, key: str = "", path: str = "") -> None:
        self.key = key
        super().__init__(message, path=path)
