"""rospkg: where packages are, those around the program."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.ros1.install import current_project

if TYPE_CHECKING:
    from collections.abc import Sequence


class ResourceNotFound(Exception):  # noqa: N818  rospkg's name
    """There is no such package around the program."""


class RosPack:
    """Finds packages in the repository of the program."""

    def __init__(self, ros_paths: object = None) -> None:
        del ros_paths

    def get_path(self, name: str) -> str:
        """Return a package's folder.

        Raises:
            ResourceNotFound: there is none of that name.
        """
        packages = current_project().packages()
        if name not in packages:
            raise ResourceNotFound(
                f"package {name!r}: got none around {current_project().folder}; expected one of "
                f"{sorted(packages)}."
            )
        return str(packages[name])

    def list(self) -> list[str]:
        """Return the names of all packages."""
        return sorted(current_project().packages())

    def get_depends(self, name: str, implicit: bool = True) -> Sequence[str]:
        """Return nothing: dependencies are not read."""
        del name, implicit
        return []


def get_ros_package_path() -> str:
    """Return the folder that is searched."""
    return str(current_project().root)


RosStack = RosPack
