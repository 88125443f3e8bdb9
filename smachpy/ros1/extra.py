"""Imports of packages that come with the extra `ros1`, as only old programs need them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from actionlib_core.exceptions import ActionlibError

if TYPE_CHECKING:
    from types import ModuleType


class MissingExtraError(ActionlibError, ImportError):
    """A package of the extra `ros1` is not installed.

    Try: pip install 'smachpy[ros1]'.

    Attributes:
        name: The package.
    """

    def __init__(self, package: str, what: str) -> None:
        super().__init__(
            f"{what}: package {package!r} is missing. Try: pip install 'smachpy[ros1]'"
        )
        self.name = package


def import_extra(module: str, what: str) -> ModuleType:
    """Import a module of the extra `ros1`.

    Args:
        module: Its full name.
        what: What needs it, for the error.

    Raises:
        MissingExtraError: its package is not installed.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        # The package is there, but something that it imports is not: not an extra of ours.
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        raise MissingExtraError(package, what) from error
