"""roslib.packages: finds packages and their files."""

from __future__ import annotations

from pathlib import Path

from smachpy.ros1.names.rospkg import ResourceNotFound, RosPack

InvalidROSPkgException = ResourceNotFound


def get_pkg_dir(package: str, required: bool = True, ros_root: object = None) -> str | None:
    """Return a package's folder.

    Raises:
        InvalidROSPkgException: it is `required`, and there is none.
    """
    del ros_root
    try:
        return RosPack().get_path(package)
    except ResourceNotFound:
        if required:
            raise
        return None


def get_dir_pkg(d: str) -> tuple[str | None, str | None]:
    """Return folder and name of the package that contains a folder; (None, None) if none does."""
    rospack = RosPack()
    for name in rospack.list():
        path = rospack.get_path(name)
        if Path(d).resolve().is_relative_to(path):
            return path, name
    return None, None


def find_resource(pkg: str, resource_name: str, *_: object, **__: object) -> list[str]:
    """Return the files with a name in a package."""
    return sorted(map(str, Path(RosPack().get_path(pkg)).rglob(resource_name)))


find_node = find_resource


def list_pkgs(*_: object) -> list[str]:
    """Return the names of all packages."""
    return RosPack().list()
