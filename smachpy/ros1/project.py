"""The surroundings of a script: its package, neighbouring packages, their modules and messages.

ROS 1 finds them through catkin's workspace. Here the folders are searched: a package is a folder
with package.xml or manifest.xml, or with definitions in msg, srv or action.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal
from xml.etree import ElementTree as ET

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from actionlib_core.inputs.checked_file import read_limited

if TYPE_CHECKING:
    from collections.abc import Iterator

LARGEST_FILE: Final = 1_000_000
"""Largest manifest or setup.py that is read [bytes]."""

MAX_FOLDERS: Final = 5000
"""Limit of the search around a script: a folder such as a home directory may hold many more."""

KINDS: Final[tuple[Literal["msg", "srv", "action"], ...]] = ("msg", "srv", "action")
_MANIFESTS: Final = ("package.xml", "manifest.xml")
_SKIPPED: Final = frozenset({"__pycache__", "node_modules", "build", "devel", "install", "logs"})
_COMMENT: Final = re.compile(r"<!--.*?-->", re.DOTALL)
_DEPENDS: Final = re.compile(
    r"<(?:(?:build|build_export|exec|run)_)?depend\b[^>]*>\s*([\w-]+)\s*<"
    r"|<depend\s[^>]*?package=[\"']([\w-]+)[\"']"
)
_PACKAGE_DIR: Final = re.compile(r"package_dir\b[\"']?\s*[=:]\s*\{([^}]*)\}")
_PAIR: Final = re.compile(r"[\"'](.*?)[\"']\s*:\s*[\"'](.*?)[\"']")
_NAME: Final = re.compile(r"<name>\s*([A-Za-z]\w*)\s*</name>")


class Project:
    """The folders around a script.

    Args:
        script: The script; None: the working folder is used.

    Attributes:
        folder: The script's folder.
        root: The top of its repository or workspace, else its package, else its folder.
    """

    def __init__(self, script: Path | None = None) -> None:
        self.folder = Path.cwd() if script is None else script.resolve().parent
        self.root = _find_root(self.folder)
        self._packages: dict[str, Path] | None = None

    def packages(self) -> dict[str, Path]:
        """Return name -> folder of the packages of the project."""
        if self._packages is None:
            self._packages = {}
            for folder in _walk(self.root):
                if is_package(folder):
                    self._packages.setdefault(_name_of(folder), folder)
        return self._packages

    def depends(self, package: str) -> list[str]:
        """Return the dependencies in the manifest of a package of the project, sorted."""
        texts = (_read(self.packages()[package] / name) for name in _MANIFESTS)
        found = (_DEPENDS.findall(_COMMENT.sub("", text)) for text in texts)
        return sorted({a or b for names in found for a, b in names})

    def exports(self, package: str, tag: str, attribute: str) -> list[str]:
        """Return the values of an attribute of the tags in <export> of a package's manifest.

        Raises:
            ValueError: a manifest is not XML.
        """
        found = []
        for file in (self.packages()[package] / name for name in _MANIFESTS):
            text = _read(file)
            try:
                root = fromstring(text or "<package/>")
            except (ET.ParseError, DefusedXmlException) as error:
                raise ValueError(f"{file}: {error}") from error
            values = (one.get(attribute) for one in root.iterfind(f"export/{tag}"))
            found += [value for value in values if value is not None]
        return found

    def interfaces_of(self, package: str) -> dict[str, list[Path]]:
        """Return kind -> files with the definitions of a package of the project."""
        folder = self.packages().get(package)
        if folder is None:
            return {}
        found = {kind: sorted((folder / kind).glob(f"*.{kind}")) for kind in KINDS}
        return {kind: files for kind, files in found.items() if files}

    def source_roots(self) -> Iterator[Path]:
        """Yield the folders whose modules ROS finds for the script.

        First its own folder, then those of its package, then those of other packages.
        """
        yield self.folder
        for folder in self._by_nearness():
            for below in ("src", *_package_dirs(folder)):
                if (folder / below).is_dir():
                    yield folder / below

    def other_roots(self) -> Iterator[Path]:
        """Yield folders that ROS never searches, for modules that nobody else has.

        Some repositories are run with a path of their own, or import a package by its folder.
        """
        for folder in self._by_nearness():
            for below in ("scripts", "nodes"):
                if (folder / below).is_dir():
                    yield folder / below
        for folder in self.packages().values():
            if self.folder.is_relative_to(folder):
                yield folder
                yield folder.parent
        yield self.root

    def _by_nearness(self) -> list[Path]:
        """Return the packages' folders, first those that contain the script."""
        folders = self.packages().values()
        return sorted(folders, key=lambda folder: not self.folder.is_relative_to(folder))

    def holds(self, file: str) -> bool:
        """Return whether a file belongs to the project."""
        try:
            path = Path(file).resolve()
        except OSError:
            return False
        if "site-packages" in path.parts or "dist-packages" in path.parts:  # a .venv in the project
            return False
        return path.is_relative_to(self.root)


def _find_root(folder: Path) -> Path:
    """Return the top of the repository, else the outermost package's workspace, else `folder`."""
    package: Path | None = None
    for above in (folder, *folder.parents):
        if any((above / mark).exists() for mark in (".git", ".hg", ".catkin_workspace")):
            return above
        if is_package(above) or (above / "stack.xml").is_file():
            package = above
        if above == above.parent or above == Path.home():
            break
    if package is None:
        return folder
    beside = package.parent  # catkin's workspaces have all packages in `src`
    return beside if beside.name == "src" else package


def _walk(root: Path) -> Iterator[Path]:
    for seen, (folder, below, _files) in enumerate(os.walk(root), 1):
        below[:] = sorted(
            name for name in below if not name.startswith(".") and name not in _SKIPPED
        )
        yield Path(folder)
        if seen >= MAX_FOLDERS:
            return


def is_package(folder: Path) -> bool:
    """Return whether a folder is a ROS package."""
    if any((folder / name).is_file() for name in _MANIFESTS):
        return True
    return any(next((folder / kind).glob(f"*.{kind}"), None) is not None for kind in KINDS)


def _name_of(folder: Path) -> str:
    """Return the package's name in package.xml, else the folder's name."""
    match = _NAME.search(_read(folder / "package.xml"))
    return match[1] if match else folder.name


def _package_dirs(folder: Path) -> list[str]:
    """Return the folders of modules that a package's setup.py names."""
    match = _PACKAGE_DIR.search(_read(folder / "setup.py"))
    pairs = _PAIR.findall(match[1]) if match else []
    # {"": "lib"}: all in lib; {"robot": "lib/robot"}: this one in lib
    return [place.removesuffix(name).rstrip("/") or "." for name, place in pairs]


def _read(file: Path) -> str:
    """Return the text of a file; "" if it cannot be read."""
    try:
        return read_limited(file, LARGEST_FILE).decode("utf-8", "replace")
    except OSError:
        return ""
