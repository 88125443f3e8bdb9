"""Checks the records of runs that come from files and from other programs.

One reader for recordings, for the network and for viewers: a record that it returns has the fields
of its kind with their types, so that whatever folds, draws or explains it cannot fail. Records of
unknown kinds, from newer programs, pass with the fields that all kinds have.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from functools import cache
from sys import intern
from types import NoneType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Final,
    Literal,
    NotRequired,
    TypeAlias,
    TypedDict,
    get_args,
    get_type_hints,
)

from actionlib_core.inputs.checked_data import (
    LATEST,
    Count,
    DataError,
    Number,
    Stamp,
    checked,
    checker,
)
from actionlib_core.inputs.checked_file import Limits
from smachpy.events import EVENT_KINDS
from smachpy.events.run_state import ProgressFacts, RunFacts

if TYPE_CHECKING:
    from collections.abc import Callable

MAX_CELLS: Final = 4_000_000
"""Cells of the largest map in a record; `smachpy.network.observations` makes it coarser."""

_MAX_RAYS: Final = 2_000
_MAX_POINTS: Final = 2_000

OBSERVED: Final = "Observed"
"""Kind of the records that hold data of a robot's topics."""

_COUNTS: Final = 2**53

MissionTime: TypeAlias = Annotated[float, Limits(low=-(2.0**33), high=2.0**33)]
"""An instant on the mission's clock [s]."""


class CommonFields(TypedDict):
    """What records of all kinds have; `seq` and `dropped` are added by an event buffer."""

    kind: str
    path: str
    stamp_ns: Stamp
    seq: NotRequired[Count]
    dropped: NotRequired[Count]


Pose: TypeAlias = tuple[Number, Number, Number]
"""x, y [m], yaw [rad] in the map frame."""


class _Observed(TypedDict):
    kind: Literal["Observed"]
    path: str
    stamp_ns: Stamp
    robot: str
    n: NotRequired[Count]


class PoseRecord(_Observed):
    """Where a robot is."""

    what: Literal["pose"]
    at: Pose


class ScanRecord(_Observed):
    """A scan from the pose `at`: distances [cm], -1 for nothing, at `first` + i `step` [rad]."""

    what: Literal["scan"]
    at: Pose
    first: Number
    step: Number
    ranges: list[int]


class PlanRecord(_Observed):
    """The way that a robot wants to take, [x, y] in the map frame [m]; empty for none."""

    what: Literal["plan"]
    points: list[tuple[Number, Number]]


class MapRecord(_Observed):
    """A map; `origin` is the pose of its lower left corner.

    `cells` is base64 of zlib of one byte per cell, row 0 at the bottom: 0 free, 1 occupied, 2
    unknown.
    """

    what: Literal["map"]
    resolution: Annotated[float, Limits(above=0, high=1000)]
    width: Annotated[int, Limits(low=1, high=MAX_CELLS)]
    height: Annotated[int, Limits(low=1, high=MAX_CELLS)]
    origin: Pose
    cells: str


class ValueRecord(_Observed):
    """A value with a name and a unit, such as the battery's charge [%]."""

    what: Literal["value"]
    name: str
    value: Number
    unit: str


class ValuesRecord(_Observed):
    """Numbers of a message: path in the message ("linear.x") -> number.

    `topic` is its name below the mission's namespace.
    """

    what: Literal["values"]
    topic: str
    values: dict[str, Number]


Observation: TypeAlias = (
    PoseRecord | ScanRecord | PlanRecord | MapRecord | ValueRecord | ValuesRecord
)

_OBSERVATIONS: Final[dict[str, Any]] = {
    get_args(get_type_hints(kind)["what"])[0]: kind for kind in get_args(Observation)
}


def read_event(data: Any) -> dict[str, Any]:
    """Return the record of an event, with the defaults of fields that an older program left out.

    Of a known kind it has no other fields than those that are checked.

    Raises:
        DataError: it is none, with the place of the first mistake.
    """
    kind = _read_common(data)
    if kind not in EVENT_KINDS:
        return dict(data)
    defaults, checks, names = _checks(kind)
    # A run has a million records with the same few names, paths and outcomes: each is kept once.
    record = {
        **defaults,
        **{intern(k): intern(v) if type(v) is str else v for k, v in data.items() if k in names},
    }
    for name, (usual, check) in checks.items():
        if name not in record:
            raise DataError.without([name])
        if type(record[name]) not in usual:
            try:
                check(record[name])
            except DataError as error:
                raise error.inside(f".{name}") from None
    if "progress" in record:
        try:
            checked(ProgressFacts, record["progress"])
        except DataError as error:
            raise error.inside(".progress") from None
    return record


def _read_common(data: Any) -> str:
    """Return the kind of a record; check the fields that records of all kinds have."""
    # Most records are right, so they are only compared; `checked` finds the place of a mistake.
    if not (
        type(data) is dict
        and type(data.get("kind")) is str
        and type(data.get("path")) is str
        and type(data.get("stamp_ns")) is int
        and 0 <= data["stamp_ns"] <= LATEST
        and type(data.get("seq", 0)) is int
        and 0 <= data.get("seq", 0) < _COUNTS
        and type(data.get("dropped", 0)) is int
        and 0 <= data.get("dropped", 0) < _COUNTS
    ):
        checked(CommonFields, data, known_only=True)
    kind: str = data["kind"]
    return kind


@cache
def _checks(
    kind: str,
) -> tuple[
    dict[str, Any], dict[str, tuple[tuple[type, ...], Callable[[Any], Any]]], frozenset[str]
]:
    """The defaults of an event's fields; the types that need no further look, and the check.

    And the names of all fields that a record may have.
    """
    hints: dict[str, Any] = get_type_hints(EVENT_KINDS[kind])
    special = {
        "t": MissionTime,
        "began_ns": Stamp,
        "attempt": Count,
        "number": Count,
        "outages": list[tuple[Stamp, Stamp]],
        "active": list[tuple[str, Stamp]],
    }
    hints |= {name: special[name] for name in special if name in hints}
    usual: dict[Any, tuple[type, ...]] = {str: (str,), float: (float, int), bool: (bool,)}
    usual |= {str | None: (str, NoneType), float | None: (float, int, NoneType)}
    checks = {
        name: (usual.get(hint, ()), checker(hint))
        for name, hint in hints.items()
        if name not in {"path", "stamp_ns"}
    }
    added = {"progress"} if kind == "GoalFeedback" else set()  # by a viewer
    names = frozenset({*CommonFields.__annotations__, *hints, *added})
    return EVENT_KINDS[kind]._field_defaults, checks, names


def read_observed(data: Any) -> dict[str, Any]:
    """Return the record of data of a robot's topic.

    Raises:
        DataError: it is none, with the place of the first mistake.
    """
    _read_common(data)
    what = data.get("what")
    kind = _OBSERVATIONS.get(what) if isinstance(what, str) else None
    if kind is None:
        if isinstance(what, str) and isinstance(data.get("robot"), str):
            return dict(data)  # of a newer program
        raise DataError(what, "the kind of an observation", ".what")
    record: dict[str, Any] = checked(kind, data, known_only=True)
    if what == "map":
        _check_cells(record)
    for name, most in (("ranges", _MAX_RAYS), ("points", _MAX_POINTS)):
        if len(record.get(name, ())) > most:
            raise DataError(record[name], f"at most {most}", f".{name}")
    return record


class CrossedRecord(CommonFields):
    """Something that crossed the mission's border; see `smachpy.events.inputs`."""

    t: MissionTime
    what: str
    name: NotRequired[str]
    type: NotRequired[str]
    key: NotRequired[str]
    state: NotRequired[str]
    text: NotRequired[str]
    value: NotRequired[Any]
    hidden: NotRequired[bool]


_CROSSED_TEXTS: Final = ("name", "type", "key", "state", "text")


def read_crossed(data: Any) -> dict[str, Any]:
    """Return the record of what crossed the mission's border, with the texts that it leaves out.

    Raises:
        DataError: it is none, with the place of the first mistake.
    """
    record: dict[str, Any] = checked(CrossedRecord, data, known_only=True)
    return {**dict.fromkeys(_CROSSED_TEXTS, ""), **record}


def _check_cells(record: dict[str, Any]) -> None:
    size = record["width"] * record["height"]
    if size > MAX_CELLS:
        raise DataError(size, f"at most {MAX_CELLS:,} cells", ".width")
    # A small text can expand to gigabytes; one byte too many is enough to see that it is wrong.
    expand = zlib.decompressobj()
    try:
        packed = base64.b64decode(record["cells"], validate=True)
        cells = expand.decompress(packed, size + 1)
    except (binascii.Error, ValueError, zlib.error) as error:
        raise DataError(str(error), "base64 of zlib data", ".cells") from error
    if len(cells) != size:
        raise DataError(len(cells), f"{size} cells", ".cells")


def read_facts(data: Any) -> dict[str, Any]:
    """Return the facts of a run, the data of a `RunState`.

    Raises:
        DataError: they are none, with the place of the first mistake.
    """
    facts: dict[str, Any] = checked(RunFacts, data, known_only=True)
    for goal_id, goal in facts["goals"].items():
        if goal["path"] not in facts["states"]:
            place = f".goals[{goal_id!r:.60}].path"
            raise DataError(goal["path"], "the path of one of the states", place)
    return facts
