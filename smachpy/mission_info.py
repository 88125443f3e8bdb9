"""`@smachpy.mission(...)`: what `smachpy run` has to know of a mission's function."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias, TypeVar, overload

from smachpy.machines.problems import Problems

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Mapping

    F = TypeVar("F", bound=Callable[..., Any])
    Migrations: TypeAlias = Callable[[list[str]], Mapping[str, str] | None]

_ATTRIBUTE: Final = "_smachpy_mission"


@dataclass(frozen=True, slots=True)
class MissionInfo:
    """What `@smachpy.mission` was told.

    Attributes:
        serves: Names of the actions that the mission serves itself.
        world: The world file that `smachpy run --start-robot` takes; None: only a robot.
        real_time: Why the mission cannot run in virtual time; "" when it can.
        robots: Whether the mission starts its robots, or the parameter that says so.
        max_outage: How old its journal may be for a durable run to go on by itself [s]; None: any.
        migrations: Says which paths of its machine have changed, or None.
    """

    serves: tuple[str, ...] = ()
    world: Path | None = None
    real_time: str = ""
    robots: bool | str = False
    max_outage: float | None = None
    migrations: Migrations | None = None


@overload
def mission(function: F, /) -> F: ...


@overload
def mission(
    *,
    serves: Iterable[str] = (),
    world: str | os.PathLike[str] | None = None,
    real_time: str = "",
    robots: bool | str = False,
    max_outage: float | None = None,
    migrations: Migrations | None = None,
) -> Callable[[F], F]: ...


def mission(
    function: F | None = None,
    /,
    *,
    serves: Iterable[str] = (),
    world: str | os.PathLike[str] | None = None,
    real_time: str = "",
    robots: bool | str = False,
    max_outage: float | None = None,
    migrations: Migrations | None = None,
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

        max_outage: How old its journal may be for `smachpy run --durable` to go on with it [s]; an
            older one wants a person, who says `smachpy missions resume`. None: any age.
        migrations: Called with the differences, as texts, when the machine is another one than that
            of the journal; returns old path -> new path, or None to refuse.

    Returns:
        A decorator, which returns the function itself; without arguments, as `@smachpy.mission`,
        the function.

    Raises:
        InvalidStateError: `serves` is no list of names, `max_outage` no time, or `migrations` no
            function.
    """
    problems = Problems("mission")
    names = problems.names("serves", serves)
    limit = problems.seconds("max_outage", max_outage)
    problems.function("migrations", migrations, "migrations(differences)", 1)
    problems.raise_all()
    place = None if world is None else Path(world)
    info = MissionInfo(names, place, real_time, robots, limit, migrations)

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
