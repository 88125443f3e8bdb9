"""The sources of definitions: inline text, user folders in ROS layout, the bundled folder.

`.srv` and `.action` text has parts separated by `---` lines; each part becomes a message.
"""

from __future__ import annotations

import os
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from actionlib_core.exceptions import InterfaceError, InterfaceWarning
from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.interfaces._definition import TextPosition

Kind = Literal["msg", "srv", "action"]
KINDS: tuple[Kind, ...] = get_args(Kind)

PATH_VARIABLE = "SMACHPY_INTERFACE_PATH"
BUNDLED = Path(__file__).parent / "share"
"""The folder of the definitions that come with this package."""

LARGEST_FILE = 1_000_000
"""Largest file of a definition [bytes]."""

_SEPARATOR = "---"
# Text copied from printed course notes may have an en or em dash for the three hyphens.
_LOOKS_LIKE_SEPARATOR = re.compile(r"\s*(-{2,}|[\u2012-\u2015]+|-[\u2012-\u2015]+)\s*(#.*)?\Z")

SERVICE_PARTS = ("request", "response")
ACTION_PARTS = ("goal", "result", "feedback")
_warned: dict[str | tuple[str, type[Warning], int], int] = {}  # each warning is shown once


@dataclass(frozen=True, slots=True)
class Source:
    """The text of a definition, and the file or other origin that it comes from."""

    text: str
    origin: str


@dataclass(frozen=True, slots=True)
class DefinitionSection:
    """One part of a definition, and the number of its first line."""

    text: str
    first_line: int


def split(text: str, parts: tuple[str, ...], source: str) -> tuple[DefinitionSection, ...]:
    """Split a definition at its separators.

    Args:
        text: The whole `.srv` or `.action` text.
        parts: Names of the expected parts, for the error message.
        source: File name for messages.

    Raises:
        InterfaceError: More or fewer separators than the parts need.

    Warns:
        InterfaceWarning: A separator that is not exactly three hyphens.
    """
    lines = text.splitlines()
    sections: list[list[str]] = [[]]
    starts = [1]
    wanted = len(parts) - 1
    expected = f"expected {wanted} `---` between {', '.join(parts)}"
    for number, line in enumerate(lines, 1):
        match = _LOOKS_LIKE_SEPARATOR.match(line)
        if match is None:
            sections[-1].append(line)
            continue
        at = TextPosition(source, number, line.index(match[1]), line)
        if len(starts) > wanted:
            raise InterfaceError(at.problem(f"one separator too many; {expected}"))
        if match[1] != _SEPARATOR:
            what = f"separator {match[1]!r} taken for '---'. Try writing '---'"
            warnings.warn_explicit(what, InterfaceWarning, source, number, registry=_warned)
        sections.append([])
        starts.append(number + 1)
    if len(starts) <= wanted:
        at = TextPosition(source, len(lines) or 1, 0, lines[-1] if lines else "")
        raise InterfaceError(at.problem(f"got {len(starts) - 1} separators; {expected}"))
    return tuple(
        DefinitionSection("\n".join(part) + "\n" if part else "", start)
        for part, start in zip(sections, starts, strict=True)
    )


def action_messages(name: str) -> dict[str, str]:
    """Return the text of the four messages around an action's goal, result and feedback.

    Source: actionlib's genaction.

    Args:
        name: The action's short name, "MoveBase".
    """
    return {
        f"{name}Action": f"{name}ActionGoal action_goal\n"
        f"{name}ActionResult action_result\n"
        f"{name}ActionFeedback action_feedback\n",
        f"{name}ActionGoal": f"Header header\nactionlib_msgs/GoalID goal_id\n{name}Goal goal\n",
        f"{name}ActionResult": "Header header\nactionlib_msgs/GoalStatus status\n"
        f"{name}Result result\n",
        f"{name}ActionFeedback": "Header header\nactionlib_msgs/GoalStatus status\n"
        f"{name}Feedback feedback\n",
    }


class Sources:
    """Finds definitions by kind, package and name; the first one found is used.

    The order: inline definitions, `add_path` folders (newest first), the folders in
    `SMACHPY_INTERFACE_PATH`, the bundled ones.

    Threads: reading needs no lock; `define`, `forget` and `add_path` do. They replace the tables
        instead of changing them, so that a thread that reads sees the old or the new one.

    Args:
        folders: Search only these, and neither the environment's folders nor the bundled ones.
    """

    def __init__(self, folders: list[Path] | None = None) -> None:
        self._only = folders
        self._inline: dict[tuple[Kind, str, str], Source] = {}
        self._added: list[Path] = []

    def add_path(self, folder: str | os.PathLike[str]) -> None:
        path = Path(folder).expanduser().resolve()
        if not path.is_dir():
            raise InterfaceError(f"add_path: got {str(folder)!r}; expected an existing folder")
        if not any(_packages_in(path)):
            raise InterfaceError(
                f"add_path: got {str(folder)!r}, which holds no interfaces; expected a folder in "
                "ROS layout: my_pkg/msg/Name.msg, my_pkg/srv/Name.srv, my_pkg/action/Name.action"
            )
        if path not in self._added:
            self._added = [path, *self._added]

    def define(self, kind: Kind, package: str, name: str, text: str, origin: str = "") -> None:
        source = Source(text, origin or f"{package}/{kind}/{name} (inline)")
        self._inline = {**self._inline, (kind, package, name): source}

    def forget(self, kind: Kind, package: str, name: str) -> None:
        gone = (kind, package, name)
        self._inline = {key: source for key, source in self._inline.items() if key != gone}

    def search_path(self) -> list[Path]:
        """Return the folders that are searched, in order, including missing ones."""
        if self._only is not None:
            return [*self._added, *self._only]
        listed = os.environ.get(PATH_VARIABLE, "").split(os.pathsep)
        return [*self._added, *(Path(p).expanduser() for p in listed if p.strip()), BUNDLED]

    def find(self, kind: Kind, package: str, name: str) -> Source | None:
        """Return a definition, None when there is none."""
        inline = self._inline.get((kind, package, name))
        if inline is not None:
            return inline
        for root in self.search_path():
            for folder in _folders_of(root, package):
                path = folder / kind / f"{name}.{kind}"
                # Unlike `Path.is_file`, this is False also for a name that no file can have.
                if os.path.isfile(path):  # noqa: PTH113
                    return Source(_text_of(path), str(path))
        return None

    def sections(self, kind: Kind, package: str, name: str) -> dict[str, DefinitionSection]:
        """Return the sections of a service or action by part name; {} when it is unknown."""
        source = self.find(kind, package, name)
        if source is None:
            return {}
        parts = SERVICE_PARTS if kind == "srv" else ACTION_PARTS
        return dict(zip(parts, split(source.text, parts, source.origin), strict=True))

    def message_source(self, package: str, name: str) -> tuple[Source, int] | None:
        """Return a message's text and first line: of its file, or of a part of an action."""
        source = self.find("msg", package, name)
        if source is not None:
            return source, 1
        for suffix in ("Goal", "Result", "Feedback"):
            part = self._part("action", package, name, suffix)
            if part is not None:
                return part
        for suffix in ("ActionGoal", "ActionResult", "ActionFeedback", "Action"):
            base = name.removesuffix(suffix)
            action = self.find("action", package, base) if base not in {name, ""} else None
            if action is not None:
                return Source(action_messages(base)[name], action.origin), 1
        return None

    def service_part(self, package: str, name: str) -> tuple[Source, int] | None:
        """Return the text and first line of a service's request or response."""
        for suffix in ("Request", "Response"):
            part = self._part("srv", package, name, suffix)
            if part is not None:
                return part
        return None

    def _part(self, kind: Kind, package: str, name: str, suffix: str) -> tuple[Source, int] | None:
        base = name.removesuffix(suffix)
        source = self.find(kind, package, base) if base not in {name, ""} else None
        if source is None:
            return None
        section = self.sections(kind, package, base)[suffix.lower()]
        return Source(section.text, source.origin), section.first_line

    def packages(self) -> list[str]:
        """Return the names of all packages that define something."""
        found = {package for _, package, _ in self._inline}
        for root in self.search_path():
            found |= {folder.name for folder in _packages_in(root)}
        return sorted(found)

    def has_package(self, package: str) -> bool:
        """Return whether a package defines something."""
        return any(key[1] == package for key in self._inline) or any(
            _folders_of(root, package) for root in self.search_path()
        )

    def names(self, kind: Kind, package: str) -> list[str]:
        """Return the names of a package's definitions of a kind."""
        found = {name for k, p, name in self._inline if (k, p) == (kind, package)}
        for root in self.search_path():
            for folder in _folders_of(root, package):
                found |= {path.stem for path in (folder / kind).glob(f"*.{kind}")}
        return sorted(found)


def _text_of(path: Path) -> str:
    try:
        return read_limited(path, LARGEST_FILE).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InterfaceError(f"{path}: got a byte that is no UTF-8: {error}") from error
    except OSError as error:
        raise InterfaceError(f"{path}: cannot be read: {error.strerror or error}") from error


def _is_package(folder: Path) -> bool:
    place = str(folder)
    # Nearly all that is asked for is no folder at all. As in `find`, any name may be asked for.
    return os.path.isdir(place) and any(os.path.isdir(f"{place}/{kind}") for kind in KINDS)  # noqa: PTH112


def _folders_of(root: Path, package: str) -> list[Path]:
    """Return the folders of a package below a root; the root may itself be the package."""
    candidates = [root / package]
    if root.name == package:
        candidates.append(root)
    return [folder for folder in candidates if _is_package(folder)]


def _packages_in(root: Path) -> list[Path]:
    if not root.is_dir():
        return []
    if _is_package(root):
        return [root]
    return [folder for folder in root.iterdir() if _is_package(folder)]
