"""What goes wrong in a running child, as errors that name its path."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.exceptions import InvalidTransitionError, InvalidUserCodeError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.state import State


class ChildErrors(ExceptionGroup[Exception]):
    """What the children of a concurrence raised; not a group that one of them raised itself."""


def user_error(path: str, state: State, error: BaseException) -> InvalidUserCodeError:
    """Return the error for code of a state that raised; raise it `from error`."""
    return InvalidUserCodeError(
        f"{path}: {type(state).__name__} raised {type(error).__name__}: {error}", path=path
    )


def unknown_outcome(path: str, outcomes: Iterable[str], got: object) -> InvalidTransitionError:
    """Return the error for a child that returned none of its outcomes."""
    known = sorted(outcomes)
    return InvalidTransitionError(
        f"{path}: unknown outcome: got {got!r}; expected one of {known}.{did_you_mean(got, known)}"
    )
