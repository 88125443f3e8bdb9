"""Conversations with an action server on ROS 2's wire; each returns what was answered.

They run against rclpy's server, in its own Python, and against ours: the answers must be the same.
A world has:

    send(id, order) -> accepted        the server refuses orders below 0, and runs nothing by itself
    execute(id), finish(id, how)       what the server's code does
    cancel(id=NONE, up_to=None)        -> code, ids canceling; `up_to`: the goal whose stamp is sent
    result(id)                         -> a function that waits for (status, sequence)
    state(id, code)                    wait until the list of statuses says so
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

NONE = bytes(16)
A, B, C = (bytes([number]) * 16 for number in (1, 2, 3))


def _begin(world: Any, goal: bytes, order: int = 3) -> None:
    assert world.send(goal, order)
    world.state(goal, 1)
    world.execute(goal)
    world.state(goal, 2)


def _end(how: str, code: int, *, cancel: bool = False) -> Callable[[Any], list[Any]]:
    def conversation(world: Any) -> list[Any]:
        _begin(world, A)
        parked = world.result(A)
        heard = [world.cancel(A)] if cancel else []
        if cancel:
            world.state(A, 3)
        world.finish(A, how)
        heard += [parked(), world.result(A)()]
        world.state(A, code)
        return [*heard, world.cancel(A), world.result(A)()]

    return conversation


def _refused(world: Any) -> list[Any]:
    return [world.send(A, -1), world.result(A)(), world.cancel(A)]


def _unknown(world: Any) -> list[Any]:
    return [world.result(A)(), world.cancel(A), world.cancel()]


def _same_id(world: Any) -> list[Any]:
    _begin(world, A)
    heard = [world.send(A, 3), world.send(A, -1)]
    world.finish(A, "succeeded")
    heard.append(world.result(A)())
    return [*heard, world.send(A, 3), world.result(A)()]


def _cancelled_twice(world: Any) -> list[Any]:
    _begin(world, A)
    heard = [world.cancel(A)]
    world.state(A, 3)
    heard += [world.cancel(A), world.cancel()]
    world.finish(A, "canceled")
    return [*heard, world.result(A)()]


def _never_run(world: Any) -> list[Any]:
    assert world.send(A, 3)
    world.state(A, 1)
    heard = [world.cancel(A)]
    world.state(A, 3)
    world.execute(A)
    world.finish(A, "canceled")
    heard.append(world.result(A)())
    world.state(A, 5)
    return heard


def _all(world: Any) -> list[Any]:
    _begin(world, A, 1)
    _begin(world, B, 2)
    _begin(world, C, 3)
    world.finish(B, "succeeded")
    heard = [world.result(B)()]
    world.state(B, 4)
    heard.append(world.cancel())
    world.state(A, 3)
    world.state(C, 3)
    for goal in (A, C):
        world.finish(goal, "canceled")
        heard.append(world.result(goal)())
    return heard


def _up_to_a_stamp(world: Any) -> list[Any]:
    for number, goal in enumerate((A, B, C)):
        _begin(world, goal, number)
    heard = [world.cancel(up_to=B)]
    world.state(A, 3)
    world.state(B, 3)
    world.finish(C, "succeeded")
    heard.append(world.result(C)())
    for goal in (A, B):
        world.finish(goal, "canceled")
        heard.append(world.result(goal)())
    return heard


def _one_and_up_to_a_stamp(world: Any) -> list[Any]:
    for number, goal in enumerate((A, B, C)):
        _begin(world, goal, number)
    heard = [world.cancel(C, up_to=A)]
    world.state(A, 3)
    world.state(C, 3)
    world.finish(B, "aborted")
    heard.append(world.result(B)())
    for goal in (A, C):
        world.finish(goal, "canceled")
        heard.append(world.result(goal)())
    return heard


CONVERSATIONS: dict[str, Callable[[Any], list[Any]]] = {
    "succeeded": _end("succeeded", 4),
    "aborted": _end("aborted", 6),
    "canceled": _end("canceled", 5, cancel=True),
    "succeeded although canceling": _end("succeeded", 4, cancel=True),
    "aborted although canceling": _end("aborted", 6, cancel=True),
    "refused": _refused,
    "unknown": _unknown,
    "same id": _same_id,
    "cancelled twice": _cancelled_twice,
    "cancelled before it runs": _never_run,
    "cancel all": _all,
    "cancel up to a stamp": _up_to_a_stamp,
    "cancel one and up to a stamp": _one_and_up_to_a_stamp,
}
