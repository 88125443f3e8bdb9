"""Reads what a machine on the network sends, and what is sent to it. Nothing is believed unchecked.

Each function returns checked data, or raises a ValueError that says what is wrong and where. In a
history, single events and records are left out; the others are right without them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NotRequired, TypedDict

from actionlib_core.inputs.checked_data import Count, DataError, Stamp, checked
from actionlib_core.inputs.json_text import JsonTextError, check_depth, load_json
from smachpy.events.introspection import MAX_NESTING, StateRecord
from smachpy.events.reading import read_event, read_facts, read_observed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

MAX_EVENT_LENGTH: Final = 2_000_000
"""Longest text of an event; `smachpy.events.to_record` makes far shorter ones [characters]."""

MAX_OBSERVED_LENGTH: Final = 8_000_000
"""Longest text of data of a robot's topic: a map [characters]."""

MAX_COMMAND_LENGTH: Final = 1_000_000
"""Longest text of a command, an answer to one, or the state of the control [characters]."""

MAX_EVENTS: Final = 50_000
"""Events and records in a history, each."""


class ControlState(TypedDict):
    """Whether a machine is paused, and its breakpoints: path, and outcome or null for any."""

    paused: bool
    breakpoints: list[tuple[str, str | None]]


class ControlAnswer(ControlState):
    """The answer to a command; `text` is the reason of a refusal."""

    ok: bool
    text: str


class CheckProblem(TypedDict):
    """A finding of `smachpy check`."""

    rule: str
    severity: str
    path: str
    text: str


class History(TypedDict):
    """What a machine's server answers on `<server>/smach/history` (`smachpy.network.feed`)."""

    epoch: str
    session: NotRequired[str]
    run: NotRequired[str | None]
    description: Any
    problems: NotRequired[list[CheckProblem]]
    base: NotRequired[Any]
    events: list[Any]
    observed: NotRequired[list[Any]]
    control: NotRequired[ControlState | None]
    now: NotRequired[Stamp]


class _Numbered(TypedDict):
    seq: Count


def read_description(text: str) -> StateRecord:
    """Read the structure of a machine.

    Raises:
        ValueError: it is none.
    """
    data = load_json(text, deepest=MAX_NESTING)
    record: StateRecord = checked(StateRecord, data, known_only=True)
    return record


def read_numbered_event(text: str) -> dict[str, Any]:
    """Read an event with its number.

    Raises:
        ValueError: it is none.
    """
    return _numbered(load_json(text, longest=MAX_EVENT_LENGTH))


def _numbered(data: Any) -> dict[str, Any]:
    record = read_event(data)
    checked(_Numbered, record, known_only=True)
    return record


def read_observation(text: str) -> dict[str, Any]:
    """Read data of a robot's topic.

    Raises:
        ValueError: it is none.
    """
    return _counted(load_json(text, longest=MAX_OBSERVED_LENGTH))


def _counted(data: Any) -> dict[str, Any]:
    record = read_observed(data)
    if "n" not in record:
        raise DataError.without(["n"])
    return record


def read_control_state(text: str) -> dict[str, Any]:
    """Read whether a machine is paused, and its breakpoints: a `ControlState`.

    Raises:
        ValueError: it is neither.
    """
    return _read_control(ControlState, text)


def read_control_answer(text: str) -> dict[str, Any]:
    """Read the answer to a command: a `ControlAnswer`.

    Raises:
        ValueError: it is none.
    """
    return _read_control(ControlAnswer, text)


def _read_control(kind: Any, text: str) -> dict[str, Any]:
    found: dict[str, Any] = checked(
        kind, load_json(text, longest=MAX_COMMAND_LENGTH), known_only=True
    )
    return found


def read_history(text: str) -> tuple[dict[str, Any], StateRecord, list[str]]:
    """Read the history of a machine.

    Returns:
        The history with what is right in it, the structure, and what is wrong in the rest.

    Raises:
        ValueError: it is none, or its structure is wrong, without which nothing can be shown.
    """
    history: dict[str, Any] = checked(
        History, load_json(text, deepest=MAX_NESTING), known_only=True
    )
    try:
        record = checked(StateRecord, history["description"], known_only=True)
    except DataError as error:
        raise error.inside(".description") from None
    problems: list[str] = []
    events, observed = history["events"], history.get("observed") or []
    for name, found in (("events", events), ("observed", observed)):
        if len(found) > MAX_EVENTS:
            raise DataError(found, f"at most {MAX_EVENTS:,}", f".{name}")
    history["events"] = _in_order(_right(events, "events", _numbered, problems), problems)
    history["observed"] = [one for one, _ in _right(observed, "observed", _counted, problems)]
    base = history.get("base")
    if base is not None:
        try:
            check_depth(base)
            history["base"] = read_facts(base)
        except (DataError, JsonTextError) as error:
            problems.append(f"base: {error}")
            history["base"] = None
    return history, record, problems


def _right(
    records: Iterable[Any], name: str, read: Callable[[Any], dict[str, Any]], problems: list[str]
) -> list[tuple[dict[str, Any], int]]:
    """Return the records that are right, each with the number of wrong ones before it."""
    found: list[tuple[dict[str, Any], int]] = []
    wrong = 0
    for place, record in enumerate(records):
        try:
            check_depth(record)  # only a structure may be deep
            found.append((read(record), wrong))
            wrong = 0
        except (DataError, JsonTextError) as error:
            problems.append(f"{name}[{place}]: {error}")
            wrong += 1
    return found


def _in_order(
    events: list[tuple[dict[str, Any], int]], problems: list[str]
) -> list[dict[str, Any]]:
    """Return the events whose numbers ascend; one after a gap says how many are missing."""
    found: list[dict[str, Any]] = []
    newest = -1
    for event, wrong in events:
        if event["seq"] <= newest:
            problems.append(f"$.events: got number {event['seq']}; expected more than {newest}.")
            continue
        newest = event["seq"]
        missing = event.get("dropped", 0) + wrong
        found.append({**event, "dropped": missing} if missing else event)
    return found
