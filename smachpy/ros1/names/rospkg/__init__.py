"""rospkg: finds the packages in the program's repository."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.ros1.install import current_project
from smachpy.ros1.session import session

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


class ResourceNotFound(Exception):  # noqa: N818  rospkg's name
    """The program's repository has no such package."""


class InvalidManifest(Exception):  # noqa: N818  rospkg's name
    """A manifest is not XML."""


class Manifest:
    """The content of package.xml or manifest.xml.

    Args:
        name: The package's name.
        filename: Its folder.
    """

    def __init__(self, name: str, filename: str) -> None:
        self.name = name
        self.filename = filename
        self.depends = current_project().depends(name)

    def get_export(self, tag: str, attr: str) -> Sequence[str]:
        """Return the values of an attribute of the tags in <export>.

        Raises:
            InvalidManifest: it is not XML.
        """
        try:
            return current_project().exports(self.name, tag, attr)
        except ValueError as error:
            raise InvalidManifest(str(error)) from error


class RosPack:
    """Finds packages in the repository of the program."""

    def __init__(self, ros_paths: object = None) -> None:
        del ros_paths

    def get_path(self, name: str) -> str:
        """Return a package's folder.

        Raises:
            ResourceNotFound: there is none of that name.
        """
        if session().stub_missing and name not in current_project().packages():
            session().stand_in(f"package {name}")
            return str(current_project().root / name)
        return str(_folder_of(name))

    def list(self) -> list[str]:
        """Return the names of all packages."""
        return sorted(current_project().packages())

    def get_depends(self, name: str, implicit: bool = True) -> Sequence[str]:
        """Return the dependencies in a package's manifest.

        Args:
            name: The package's name.
            implicit: Also those of its dependencies, as far as they are in the same repository.

        Raises:
            ResourceNotFound: there is no package of that name.
        """
        _folder_of(name)
        project = current_project()
        found: dict[str, None] = {}
        left = project.depends(name)
        while left:
            one = left.pop(0)
            if one not in found and one != name:
                found[one] = None
                if implicit and one in project.packages():
                    left += project.depends(one)
        return [*found]

    def get_manifest(self, name: str) -> Manifest:
        """Return a package's manifest.

        Raises:
            ResourceNotFound: there is no package of that name.
        """
        return Manifest(name, str(_folder_of(name)))

    def get_depends_on(self, name: str, implicit: bool = True) -> Sequence[str]:
        """Return the packages that depend on one; `implicit`: also indirectly."""
        return [one for one in self.list() if name in self.get_depends(one, implicit)]


def _folder_of(name: str) -> Path:
    packages = current_project().packages()
    if name not in packages:
        raise ResourceNotFound(
            f"package {name!r}: got none around {current_project().folder}; expected one of "
            f"{sorted(packages)}."
        )
    return packages[name]


def get_ros_package_path() -> str:
    """Return the folder that is searched."""
    return str(current_project().root)


RosStack = RosPack
