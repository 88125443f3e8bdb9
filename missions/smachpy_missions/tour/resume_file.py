"""A file with a mission's progress, so that it can continue after the program has ended."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from smachpy.states import MissionError
from smachpy_missions.explore.map_file import write_atomically

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class ResumeFile:
    """Stores a dict of JSON values for one task.

    The file is replaced as a whole: after a crash it holds the old or the new values.

    Attributes:
        path: The file.
        task: Identifies the task; the file of another task is refused.
        like: Values with the expected keys and types.
    """

    path: Path
    task: str
    like: Mapping[str, object]

    def load(self) -> dict[str, Any] | None:
        """Return the saved values; None if there is no file.

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
        """Replace the saved values.

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
        """Delete the file, if it exists."""
        self.path.unlink(missing_ok=True)

    def _types(self) -> dict[str, type]:
        return {key: type(value) for key, value in self.like.items()}

    def _unusable(self, got: str) -> MissionError:
        return MissionError(
            f"{self.path}: got {got}; expected what this mission wrote when it was interrupted. "
            "Try deleting the file to start from the beginning."
        )


def fingerprint(*parts: object) -> str:
    """Return a short hash of `parts`, which changes with any of them."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]
