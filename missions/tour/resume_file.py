"""A file that says how far a mission got, so that it can go on after the program has ended."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from missions.explore.map_file import write_atomically
from smachpy.states import MissionError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class ResumeFile:
    """Keeps a dict of JSON values for one task.

    The file is replaced as a whole: whatever ends the program, it holds the old or the new values.

    Attributes:
        path: The file.
        task: Names what the values belong to; values of another task are refused.
        like: Values of the keys and types that are kept.
    """

    path: Path
    task: str
    like: Mapping[str, object]

    def load(self) -> dict[str, Any] | None:
        """Return what was saved last; None when there is nothing.

        Raises:
            MissionError: the file cannot be read, or belongs to another task.
        """
        try:
            text = self.path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return None
        except (OSError, UnicodeDecodeError) as error:
            raise self._unusable(f"a file that cannot be read ({error})") from error
        try:
            data = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise self._unusable(f"no JSON ({error})") from error
        if not isinstance(data, dict) or "task" not in data:
            raise self._unusable("something else")
        if data.pop("task") != self.task:
            raise self._unusable("the state of another list or of other settings")
        if {key: type(value) for key, value in data.items()} != self._types():
            raise self._unusable("other values")
        return data

    def save(self, values: Mapping[str, object]) -> None:
        """Replace what was saved.

        Raises:
            MissionError: the file cannot be written.
        """
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(self.path, json.dumps({"task": self.task, **values}) + "\n")
        except OSError as error:
            why = error.strerror or str(error)
            raise MissionError(f"{self.path}: got '{why}'; expected a writable file.") from error

    def forget(self) -> None:
        """Remove the file; nothing happens when it is not there."""
        self.path.unlink(missing_ok=True)

    def _types(self) -> dict[str, type]:
        return {key: type(value) for key, value in self.like.items()}

    def _unusable(self, got: str) -> MissionError:
        return MissionError(
            f"{self.path}: got {got}; expected what this mission wrote when it was interrupted. "
            "Try deleting the file, which begins anew."
        )


def fingerprint(*parts: object) -> str:
    """Return a short text that is another one when any of `parts` is another."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]
