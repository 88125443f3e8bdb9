"""Whether and when a state runs again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from smachpy._core.names import unique_names
from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Iterable


@dataclass(frozen=True, slots=True)
class Retry:
    """Run a state again when it ends badly.

    Attributes:
        attempts: How often it runs at most, the first time included; >= 1.
        backoff: Wait before the second attempt [s]; it doubles each time.
        on: Outcomes and exception types that ask for another attempt.
    """

    attempts: int = 2
    backoff: float = 0.0
    on: tuple[str | type[BaseException], ...] = ("aborted",)

    def __post_init__(self) -> None:
        if self.attempts < 1 or self.backoff < 0:
            raise InvalidStateError(
                f"retry: got attempts={self.attempts!r}, backoff={self.backoff!r}; expected "
                "attempts >= 1, backoff >= 0 [s]."
            )

    def wants(self, attempt: int, result: str | BaseException) -> bool:
        """Tell whether to run again after attempt number `attempt` (from 1) gave `result`."""
        if attempt >= self.attempts:
            return False
        if isinstance(result, BaseException):
            kinds = tuple(kind for kind in self.on if isinstance(kind, type))
            return isinstance(result, kinds)
        return result in self.on

    def wait_s(self, attempt: int) -> float:
        """Return the pause after attempt number `attempt` (from 1) [s]."""
        return float(self.backoff * 2.0 ** (attempt - 1))

    def __str__(self) -> str:
        on = ", ".join(item if isinstance(item, str) else item.__name__ for item in self.on)
        return f"{self.attempts} attempts, {self.backoff:g} s apart, on {on}"


def as_retry(value: Any) -> Retry | None:
    """Return `value` as a `Retry`: one already, (attempts, backoff, on), a number, or None."""
    if value is None or isinstance(value, Retry):
        return value
    if isinstance(value, int):
        return Retry(value)
    if isinstance(value, tuple) and 1 <= len(value) <= 3:  # noqa: PLR2004  the three fields
        backoff = value[1] if len(value) > 1 else 0.0
        on = value[2] if len(value) > 2 else ("aborted",)  # noqa: PLR2004
        return Retry(value[0], backoff, _as_on(on))
    raise InvalidStateError(
        f"retry: got {value!r}; expected Retry(attempts, backoff, on), that as a tuple, or a "
        "number of attempts."
    )


def _as_on(on: str | type[BaseException] | Iterable[Any]) -> tuple[Any, ...]:
    if isinstance(on, (str, type)):
        return (on,)
    items = tuple(on)
    unique_names([item for item in items if not isinstance(item, type)], "retry: on")
    return items
