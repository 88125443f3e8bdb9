"""ROS 1's module names: `from actionlib_core.simple_action_client import SimpleActionClient`.

Programs written for actionlib, SMACH and smach_ros import from the modules of these packages. To
port them, only the package's name is changed: `alias_modules` maps the old module names to the
modules that have the classes here.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.machinery import ModuleSpec
from typing import TYPE_CHECKING, Final, cast

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from importlib.abc import Loader
    from types import ModuleType

MODULES: Final = {
    "actionlib_core.action_client": "actionlib_core.action.client",
    "actionlib_core.action_server": "actionlib_core.action.server",
    "actionlib_core.goal_id_generator": "actionlib_core.action.goal_id_generator",
    "actionlib_core.handle_tracker_deleter": "actionlib_core.action.compat",
    "actionlib_core.server_goal_handle": "actionlib_core.action.server",
    "actionlib_core.simple_action_client": "actionlib_core.action.simple_client",
    "actionlib_core.simple_action_server": "actionlib_core.action.simple_server",
    "actionlib_core.tools": "actionlib_core.action.tools",
    "actionlib_core.status_tracker": "actionlib_core.action.compat",
}
"""actionlib's module names, under this package's name -> module here."""


class _Aliases:
    """Finds modules by other names.

    A finder and a loader by its methods: their classes in `importlib.abc` would import tempfile,
    shutil and a dozen more, a fifth of `import smachpy`.
    """

    def __init__(self) -> None:
        self.homes: dict[str, str] = {}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return a spec for an alias; None for any other name."""
        del path, target
        return ModuleSpec(fullname, cast("Loader", self)) if fullname in self.homes else None

    def create_module(self, spec: ModuleSpec) -> None:
        """Let Python make the module."""

    def exec_module(self, module: ModuleType) -> None:
        """Replace the empty module by the real one."""
        sys.modules[module.__name__] = import_module(self.homes[module.__name__])


_aliases: Final = _Aliases()


def alias_modules(homes: Mapping[str, str]) -> None:
    """Make each name importable, as another name of the module that it maps to.

    The modules are imported only when a program imports them.
    """
    _aliases.homes.update(homes)
    if _aliases not in sys.meta_path:
        sys.meta_path.append(_aliases)
