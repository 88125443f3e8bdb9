"""What a state read when it began, and who had written it; pure.

Reads are no events. What a state may read are its input keys; the value is the newest one that was
written before, in its container, or in one around that from which the container got the key.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from smachpy.events.introspection import StateRecord

BEGINS = frozenset({"Entered", "Started"})


def begin_of(run: Sequence[dict[str, Any]], path: str, end: int) -> int:
    """Return the number of the event with which a visit began that ended with event `end`."""
    for i in range(end - 1, -1, -1):
        if run[i]["path"] == path and run[i]["kind"] in BEGINS:
            return i
    return 0


def values_read(
    states: Mapping[str, StateRecord], run: Sequence[dict[str, Any]], path: str, begin: int
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the keys that a state could read, each with the event that wrote its value.

    Args:
        states: The machine's states by path.
        run: The events.
        path: Of the state.
        begin: Number of the event with which its visit began.

    Keys whose values were there before the run began are left out: no event tells them.
    """
    state = states.get(path)
    for key in () if state is None else state.input_keys:
        event = _writer(states, run, path, key, begin)
        if event is not None:
            yield key, event


def _writer(
    states: Mapping[str, StateRecord],
    run: Sequence[dict[str, Any]],
    path: str,
    key: str,
    begin: int,
) -> dict[str, Any] | None:
    """Return the newest write of a state's key before event `begin`."""
    container = path.rpartition("/")[0]
    state, around = states.get(path), states.get(container)
    if state is None or around is None:
        return None
    name = dict(state.remapping).get(key, key)
    entered = begin_of(run, container, begin)
    # A key that the container itself gets from outside is set anew at each of its begins.
    first = entered if name in around.input_keys else 0
    event: dict[str, Any]
    for event in reversed(run[first:begin]):
        is_write = event["kind"] == "UserdataWritten" and event["key"] == name
        if is_write and event["path"].rpartition("/")[0] == container:
            return event
    return _writer(states, run, container, name, entered) if first else None
