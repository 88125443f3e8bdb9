"""Import of interface classes (`actionlib_core.interfaces.geometry_msgs.msg`), made on demand."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import types
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import InterfaceError
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces._registry import ROOT, Registry, registry
from actionlib_core.interfaces._ros2 import is_only_ros2, ros2_registry

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.interfaces._sources import Kind

    Choose = Callable[[str, str], Registry | None]

_SECTIONS: dict[str, Kind] = {"msg": "msg", "srv": "srv", "action": "action"}


class _SectionModule(types.ModuleType):
    """The module `pkg.msg`, `pkg.srv` or `pkg.action`; its classes are made on first use."""

    def __init__(self, name: str, package: str, kind: Kind, source: Registry) -> None:
        super().__init__(name, f"The {kind} classes of the ROS package {package}.")
        self._package = package
        self._kind = kind
        self._registry = source

    def __getattr__(self, name: str) -> Any:
        if name == "__all__":  # for `from pkg.msg import *`
            return self._registry.names(self._kind, self._package)
        if name.startswith("_"):
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        known = self._registry.names(self._kind, self._package)
        if name not in known:
            raise AttributeError(
                f"{self.__name__}: got {name!r}; expected an interface of that package."
                + (did_you_mean(name, known) or f" It has {', '.join(known) or 'none'}.")
            )
        value = self._registry.attribute(self._package, self._kind, name)
        setattr(self, name, value)  # so that this method is not called for it again
        return value

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._registry.names(self._kind, self._package)})


class _Package(types.ModuleType):
    """The module `pkg`; it has `msg`, `srv` and `action`."""

    def __init__(self, name: str, package: str) -> None:
        super().__init__(name, f"The ROS package {package}.")
        self.__path__: list[str] = []

    def __getattr__(self, name: str) -> Any:
        if name in _SECTIONS and importlib.util.find_spec(f"{self.__name__}.{name}"):
            return importlib.import_module(f"{self.__name__}.{name}")
        if self.__name__ == "actionlib" and not name.startswith("_"):
            # Old programs say `import actionlib` for the clients and servers.
            return getattr(importlib.import_module("actionlib_core"), name)
        raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")


class _Finder(MetaPathFinder, Loader):
    """Finds interface packages below a prefix.

    Args:
        prefix: "actionlib_core.interfaces." or "" for plain ROS names.
        choose: Returns the registry of a package and section ("" for the package itself), None
            when there is none.
    """

    def __init__(self, prefix: str, choose: Choose) -> None:
        self.prefix = prefix
        self._choose = choose

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: types.ModuleType | None = None,  # noqa: ARG002 # the protocol's
    ) -> ModuleSpec | None:
        if not fullname.startswith(self.prefix):
            return None
        package, _, section = fullname.removeprefix(self.prefix).partition(".")
        if package.startswith("_") or section not in {"", *_SECTIONS}:
            return None
        if self._choose(package, section) is None or self._is_found_elsewhere(fullname, path):
            return None
        return ModuleSpec(fullname, self, is_package=not section)

    def _is_found_elsewhere(self, fullname: str, path: Sequence[str] | None) -> bool:
        """Return whether a plain name has another module; a folder without code is not one."""
        if self.prefix:
            return False
        others = [finder for finder in sys.meta_path if not isinstance(finder, _Finder)]
        specs = [finder.find_spec(fullname, path) for finder in others]
        return any(spec is not None and spec.loader is not None for spec in specs)

    def create_module(self, spec: ModuleSpec) -> types.ModuleType:
        package, _, section = spec.name.removeprefix(self.prefix).partition(".")
        if not section:
            return _Package(spec.name, package)
        source = self._choose(package, section)
        assert source is not None
        return _SectionModule(spec.name, package, _SECTIONS[section], source)

    def exec_module(self, module: types.ModuleType) -> None:
        """Do nothing: there is no code to run, the module looks its classes up."""


def install() -> None:
    """Make `actionlib_core.interfaces.<pkg>` importable; called by the package itself, once."""
    _install(f"{ROOT}.", _either)
    _install(f"{ROOT}.ros2.", _ros2)


def install_ros_names() -> None:
    """Make the plain ROS names importable: `from geometry_msgs.msg import PoseStamped`.

    Old programs then run unchanged. The classes are those of `actionlib_core.interfaces`. Other
    modules of these names (of a ROS installation) take precedence. A second call has no effect.

    Raises:
        InterfaceError: A ROS installation's `geometry_msgs` was imported before.
    """
    taken = sys.modules.get("geometry_msgs")
    if taken is not None and not isinstance(taken, _Package):
        raise InterfaceError(
            f"install_ros_names: got geometry_msgs from {getattr(taken, '__file__', '?')} imported "
            "already; expected none. Try calling it first, or use the other installation"
        )
    _install("", _ros1)


def _ros1(package: str, section: str) -> Registry | None:
    return registry if section != "action" and registry.sources.has_package(package) else None


def _ros2(package: str, section: str) -> Registry | None:
    found = ros2_registry()
    if section == "action" and not found.sources.names("action", package):
        return None
    return found if found.sources.has_package(package) else None


def _either(package: str, section: str) -> Registry | None:
    """Prefer ROS 1; only ROS 2 has `pkg.action`, and some of the bundled packages.

    A folder of yours with a version of such a package does not make it a package of ROS 1.
    """
    first, second = (_ros2, _ros1) if is_only_ros2(package) else (_ros1, _ros2)
    return first(package, section) or second(package, section)


def _install(prefix: str, choose: Choose) -> None:
    # In front, so that folders of stubs or definitions do not become namespace packages.
    if not any(isinstance(f, _Finder) and f.prefix == prefix for f in sys.meta_path):
        sys.meta_path.insert(0, _Finder(prefix, choose))
