"""`@smachpy.mission(...)`: facts about a mission's function for `smachpy run`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias, TypeVar, overload

from smachpy.base.problems import Problems
from smachpy.userdata.secret import add_secret_names

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Mapping
    from pathlib import Path

    F = TypeVar("F", bound=Callable[..., Any])
    Migrations: TypeAlias = Callable[[list[str]], Mapping[str, str] | None]

_ATTRIBUTE: Final = "_smachpy_mission"


class MissionInfo(NamedTuple):
    """The arguments of `@smachpy.mission`.

    Attributes:
        serves: Names of the actions that the mission serves itself.
        world: The world file for `smachpy run --start-robot`; None for a robot only.
        real_time: The reason why the mission cannot run in virtual time; "" if it can.
        robots: Whether the mission starts its robots, or the parameter that decides it.
        max_outage: Age of its journal up to which a durable run resumes by itself [s]; None for
            any.
        migrations: Returns the changed paths of its machine, or None.
        secrets: Parameters and userdata keys whose values are shown nowhere.
        success: The outcomes of its machine that are good; None for what that says itself.
    """

    serves: tuple[str, ...] = ()
    world: Path | None = None
    real_time: str = ""
    robots: bool | str = False
    max_outage: float | None = None
    migrations: Migrations | None = None
    secrets: tuple[str, ...] = ()
    success: tuple[str, ...] | None = None


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
    secrets: Iterable[str] = (),
    success: Iterable[str] | None = None,
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
    secrets: Iterable[str] = (),
    success: Iterable[str] | None = None,
) -> F | Callable[[F], F]:
    """Declare what `smachpy run` must know about the mission that a function builds.

        @smachpy.mission(serves=["turn"], world="doors.yaml")
        def deliver(to: str = "lab") -> StateMachine: ...

    Args:
        function: The function, for `@smachpy.mission` without arguments.
        serves: Names of actions that the mission serves itself: the run does not wait for their
            servers before it starts.
        world: The world file to simulate if the run starts the robot and names no other.
        real_time: The reason why the mission needs real time; `--time virtual` is then refused with
            this text.
        robots: The mission starts its robots itself, so its run gets a network of its own, as with
            `--start-robot`. Or the name of the function's parameter that decides it.
        max_outage: Age of its journal up to which `smachpy run --durable` resumes it [s]. An older
            one needs a person and `smachpy missions resume`. None for any age.
        migrations: Called with the differences, as texts, if the machine is not the one of the
            journal; returns old path -> new path, or None to refuse.
        secrets: Parameters of the function, and userdata keys, whose values are shown nowhere, as
            those of `smachpy.Secret` and of names such as `password`.
        success: The outcomes of its machine that are good, as its option `success`.

    Returns:
        A decorator, which returns the function itself; for `@smachpy.mission` without arguments the
        function.

    Raises:
        InvalidStateError: `serves`, `secrets` or `success` is not a list of names, `max_outage` is
            not a duration, or `migrations` is not a function.
    """
    problems = Problems("mission")
    names = problems.names("serves", serves)
    hidden = problems.names("secrets", secrets)
    good = None if success is None else problems.names("success", success)
    limit = problems.seconds("max_outage", max_outage)
    problems.function("migrations", migrations, "migrations(differences)", 1)
    problems.raise_all()
    from pathlib import Path

    place = None if world is None else Path(world)
    info = MissionInfo(names, place, real_time, robots, limit, migrations, hidden, good)
    add_secret_names(hidden)

    def mark(function: F) -> F:
        setattr(function, _ATTRIBUTE, info)
        return function

    return mark if function is None else mark(function)


def is_mission(thing: object) -> bool:
    """Return whether a function is decorated with `@smachpy.mission`."""
    return isinstance(getattr(thing, _ATTRIBUTE, None), MissionInfo)


def mission_info(thing: object) -> MissionInfo:
    """Return the arguments of `@smachpy.mission` for a function; the defaults without it."""
    info = getattr(thing, _ATTRIBUTE, None)
    return info if isinstance(info, MissionInfo) else MissionInfo()
