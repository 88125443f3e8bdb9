"""Waits of old programs, which end as soon as the program is to end, whatever limit they have."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from actionlib_core import shutdown
from actionlib_core.clock import current_clock

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


def until_end(what: str, wait: Callable[[], T], over: Callable[[], T]) -> T:
    """Return what `wait` returns, or raise what it raises; once the program is to end, `over`.

    `what` is waited for, as a deadlock's report names it. `wait` goes on in its own thread then,
    until its limit or the end of its node.

    Blocks: until one of both.
    """
    if shutdown.requested():
        return over()
    clock = current_clock()
    done = clock.event(what)
    results: list[T] = []
    errors: list[Exception] = []

    def run() -> None:
        try:
            results.append(wait())
        except Exception as error:  # noqa: BLE001  raised again in the caller's thread
            errors.append(error)
        finally:
            done.set()

    forget = shutdown.on_shutdown(done.set)
    try:
        clock.spawn(run, name="ros1-wait")
        done.wait()
    finally:
        forget()
    if errors and not shutdown.requested():
        raise errors[0]
    return results[0] if results else over()
