"""The data of a mission file, as it is made from the file of another tool."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

Place: TypeAlias = "tuple[int, int]"
"""Line and column, from 1."""

MAX_LENGTH: Final = 1_000_000
"""Longest text of a file of another tool [characters]."""

MAX_VALUES: Final = 100_000
"""Most values that a file stands for: what surrounds a state can count again for each one."""

MAX_NOTES: Final = 100
"""Most notes and problems of a file that are listed."""

MAX_DEPTH: Final = 50
"""Most elements or containers inside each other: the readers are recursive."""

OWN: Final = "smachpy_states"
"""The module beside the file that has the states which the other tool has in its own code."""


class TooMuchError(Exception):
    """The file is refused while it is read."""


class Leaf(Protocol):
    """Says how a mission file names a state."""

    def __call__(self, name: str, *, registered: bool = True) -> str:
        """Return `module:Name`, or the name of a registered state unless that is not wanted."""
        ...


class Part(dict[str, Any]):
    """A mapping of the file, with the places of its values in the other tool's file."""

    def __init__(self, place: Place, **values: Any) -> None:
        super().__init__(values)
        self.place = place
        self.places: dict[str, Place] = {}

    def put(self, key: str, value: Any, place: Place) -> None:
        """Set a value that has a place of its own."""
        self[key] = value
        self.places[key] = place


class Draft:
    """What was read so far.

    Attributes:
        folder: The folder of the file.
        is_included: Whether the machine is a state of the machine of another file.
        leaf: Says how a mission file names a state.
        top: The data.
        notes: What cannot be kept: places and texts.
        problems: Why the file is refused: places and texts.
    """

    def __init__(self, folder: Path, leaf: Leaf, *, is_included: bool = False) -> None:
        self.folder = folder
        self.is_included = is_included
        self.leaf = leaf
        self.top = Part((1, 1))
        self.notes: dict[tuple[Place, str], None] = {}
        self.problems: list[tuple[Place, str]] = []
        self._values = 0

    def note(self, place: Place, text: str) -> None:
        """Note what cannot be kept: "<script>"."""
        if len(self.notes) < MAX_NOTES:
            self.notes[place, text] = None

    def problem(self, place: Place, text: str) -> None:
        """Refuse the file."""
        if len(self.problems) < MAX_NOTES:
            self.problems.append((place, text))

    def spend(self, values: int) -> None:
        """Count values that the file stands for.

        Raises:
            TooMuchError: they are too many.
        """
        self._values += values
        if self._values > MAX_VALUES:
            raise TooMuchError(f"it stands for more than {MAX_VALUES:,} values.")

    def add_state(self, states: Part, label: str, entry: Part, place: Place) -> None:
        """Add a state; a second one of its label is a problem."""
        if label in states:
            self.problem(place, f"got {label!r} a second time; expected one.")
        states.put(label, entry, place)

    def finish(self, top: Part, name: str | None, about: str | None = None) -> None:
        """Set the data, with a name and a help if there are some.

        Raises:
            TooMuchError: they are too many machines in each other.
        """
        if name:
            top["name"] = name
        if about:
            top["help"] = about
        _allow_preempt(top)
        self.top = top

    def data(self) -> dict[str, Any]:
        """Return the data as plain mappings."""
        return _plain(self.top)  # type: ignore[no-any-return]

    def marks(self) -> dict[str, Place]:
        """Return the places of the data by their paths: "states.DRIVE.on"."""
        return dict(_marks(self.top, "", self.top.place))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, list) else value


def _marks(value: Any, path: str, around: Place) -> Iterator[tuple[str, Place]]:
    place = value.place if isinstance(value, Part) else around
    yield path, place
    if isinstance(value, Part):
        for key, one in value.items():
            inner = f"{path}.{key}" if path else key
            yield from _marks(one, inner, value.places.get(key, place))
    elif isinstance(value, list):
        for number, one in enumerate(value):
            yield from _marks(one, f"{path}[{number}]", place)


def _allow_preempt(part: Part, depth: int = 1) -> None:
    """Let all containers end with `preempted`: other tools have it without saying so.

    Raises:
        TooMuchError: they are too many in each other.
    """
    if depth > MAX_DEPTH:
        raise TooMuchError(f"got more than {MAX_DEPTH} machines in each other.")
    for kind in ("machine", "concurrence"):
        if kind in part:
            _allow_preempt(part[kind], depth + 1)
    if "states" in part:
        outcomes = part.get("outcomes", [])
        if isinstance(outcomes, list) and "preempted" not in outcomes:
            part["outcomes"] = [*outcomes, "preempted"]
        for entry in part["states"].values():
            _allow_preempt(entry, depth)
