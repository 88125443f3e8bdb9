"""Interface definitions that installed packages bring along."""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import TYPE_CHECKING, TypeVar

from actionlib_core.exceptions import InterfaceError

if TYPE_CHECKING:
    from collections.abc import Callable

GROUP = "smachpy.interfaces"
"""Entry points of modules that make definitions known when they are imported."""

T = TypeVar("T")


def load_packages() -> None:
    """Make known what installed packages define.

    Raises:
        InterfaceError: such a package cannot be imported.
    """
    for point in entry_points(group=GROUP):
        try:
            point.load()
        except Exception as error:
            raise InterfaceError(
                f"interfaces of {point.name!r}: importing {point.value!r} raised "
                f"{type(error).__name__}: {error}."
            ) from error


def known(get: Callable[[str], T], name: str) -> T:
    """Return what `get` finds under `name`, in installed packages too.

    Raises:
        InterfaceError: it is nowhere.
    """
    try:
        return get(name)
    except InterfaceError:
        load_packages()  # costs an import, so only now
        return get(name)
