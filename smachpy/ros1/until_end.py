"""Waits that end as soon as the program is to end, as those of rospy do."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from actionlib_core import shutdown
from actionlib_core.clock import current_clock

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


def until_end(what: str, wait: Callable[[], T], over: Callable[[], T]) -> T:
    """Call `wait` and return its result or raise its exception; at shutdown return `over()`.

    `wait` runs in its own thread, as it cannot be interrupted. After a shutdown it goes on there
    until its own limit or the end of its node.

    Args:
        what: What is waited for, as the report of a deadlock names it.
        wait: The function that waits.
        over: Called instead when the program is to end.

    Blocks: until `wait` has ended or the program is to end.
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
