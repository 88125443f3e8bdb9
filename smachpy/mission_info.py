"""`@smachpy.mission(...)`: what `smachpy run` has to know of a mission's function."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar, overload

from smachpy.machines.problems import Problems

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable

    F = TypeVar("F", bound=Callable[..., Any])

_ATTRIBUTE: Final = "_smachpy_mission"


@dataclass(frozen=True, slots=True)
class MissionInfo:
    """What `@smachpy.mission` was told.

    Attributes:
        serves: Names of the actions that the mission serves itself.
        world: The world file that `smachpy run --start-robot` takes; None: only a robot.
        real_time: Why the mission cannot run in virtual time; "" when it can.
        robots: Whether the mission starts its robots, or the parameter that says so.
    """

    serves: tuple[str, ...] = ()
    world: Path | None = None
    real_time: str = ""
    robots: bool | str = False


@overload
def mission(function: F, /) -> F: ...


@overload
def mission(
    *,
    serves: Iterable[str] = (),
    world: str | os.PathLike[str] | None = None,
    real_time: str = "",
    robots: bool | str = False,
) -> Callable[[F], F]: ...


def mission(
    function: F | None = None,
    /,
    *,
    serves: Iterable[str] = (),
    world: str | os.PathLike[str] | None = None,
    real_time: str = "",
    robots: bool | str = False,
) -> F | Callable[[F], F]:
    """Tell `smachpy run` what the mission that a function makes needs.

        @smachpy.mission(serves=["turn"], world="doors.yaml")
        def deliver(to: str = "lab") -> StateMachine: ...

    Args:
        function: The function, where nothing else is told.
        serves: Names of actions that the mission serves itself: nobody waits for them before it
            starts.
        world: The world file to simulate when the run starts the robot and names no other.
        real_time: Why the mission needs real time; `--time virtual` is then refused with it.
        robots: The mission starts its robots itself: its run gets a network of its own, as one
            with `--start-robot` does. Or the name of the function's parameter that says so.

    Returns:
        A decorator, which returns the function itself; without arguments, as `@smachpy.mission`,
        the function.

    Raises:
        InvalidStateError: `serves` is no list of names.
    """
    problems = Problems("mission")
    names = problems.names("serves", serves)
    problems.raise_all()
    info = MissionInfo(names, None if world is None else Path(world), real_time, robots)

    def mark(function: F) -> F:
        setattr(function, _ATTRIBUTE, info)
        return function

    return mark if function is None else mark(function)


def is_mission(thing: object) -> bool:
    """Tell whether `@smachpy.mission` marks a function."""
    return isinstance(getattr(thing, _ATTRIBUTE, None), MissionInfo)


def mission_info(thing: object) -> MissionInfo:
    """Return what `@smachpy.mission` was told about a function; nothing when it was not used."""
    info = getattr(thing, _ATTRIBUTE, None)
    return info if isinstance(info, MissionInfo) else MissionInfo()
