"""What mission files of other tools need besides: their states, and notes of what is lost."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from smachpy.files.reference import registered
from smachpy.files.source import names_in
from smachpy.foreign import OWN, SUFFIXES
from smachpy.machines.container import Container

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from smachpy.checks.model import Problem

FOREIGN: Final = (*SUFFIXES, ".py")
"""Ends of names of files of other tools, once it is known that they are such files."""


class OwnStates:
    """The states written again for a file of another tool, in `smachpy_states.py` beside it.

    Args:
        folder: The folder of the file.
    """

    def __init__(self, folder: Path) -> None:
        self._file = folder / f"{OWN}.py"

    @cached_property
    def _names(self) -> dict[str, Any] | None:
        if not self._file.is_file():
            return {}
        try:
            return names_in(self._file)
        except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
            return None  # told by the import

    @cached_property
    def _registered(self) -> frozenset[str]:
        return frozenset(registered())

    def named(self, name: str, *, registered: bool = True) -> str:
        """Return how a mission file names the state."""
        own = f"{OWN}:{name}"
        return name if registered and name in self._registered and self.lacks(own) else own

    def lacks(self, name: str) -> bool:
        """Return whether `smachpy_states:Name` is not there."""
        module, _, state = name.partition(":")
        return module == OWN and self._names is not None and state not in self._names


def lacking(name: str, folder: Path) -> str:
    """Return what to do about a state that is not there."""
    state = name.partition(":")[2]
    file = str(folder / f"{OWN}.py")
    return (
        f"got no state {state!r}; expected {state} in {file!r}, or an entry point 'smachpy.states' "
        "of that name. Try 'smachpy check' and 'smachpy render', which need none."
    )


@dataclass(frozen=True, slots=True)
class NotKept:
    """What could not be kept of the file of another tool: notes of `smachpy check`.

    Attributes:
        file: The file.
        notes: Lines and texts.
    """

    file: str
    notes: tuple[tuple[int, str], ...]

    def __call__(self, path: str) -> Iterator[Problem]:
        """Yield the notes; the path is that of the machine."""
        from smachpy.checks.model import RULES, Place, Problem  # here: only a check needs them

        for line, text in self.notes:
            where = Place(self.file, line)
            message, severity = f"not kept: {text}", RULES["not-kept"].severity
            yield Problem("not-kept", severity, path, message, place=where)


def not_kept(machine: Container) -> Iterator[str]:
    """Yield what could not be kept of a machine and of those inside it, each with file and line."""
    own = getattr(machine, "_smachpy_check", None)
    if isinstance(own, NotKept):
        yield from (f"{own.file}:{line}: not kept: {text}" for line, text in own.notes)
    for child in machine.get_children().values():
        if isinstance(child, Container):
            yield from not_kept(child)
