"""What is kept of a tape's entries when there is no room for all of them.

Of every state the end of the visit that was going on, the newest visit, and what is known of it; of
every key of userdata the newest value; the newest goal. With those, in order, whoever reads knows
what goes on now, and the visits that they see are whole; only the ones between are missing.
"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

SLOTS = 5
"""An entry is so many elements of a flat list: a tuple each would cost the machine more than all
the rest, mostly in Python's garbage collector. `list.extend` with a tuple is one atomic step.

    time [s], path of the container, step that ended or None, its outcome, step that begins or None
    None, event or record or a note of the tape, None, None, None
"""

NOTHING = (None, None, None)

_OPENS = {"Started": "", "Entered": "", "GoalSent": "goal of "}
_CLOSES = {"Finished": "", "Left": "", "Failed": "", "GoalDone": "goal of "}
_WITHIN = {
    **dict.fromkeys(("PreemptRequested", "PreemptServiced", "Abandoned"), ""),
    **dict.fromkeys(("Retried", "Paused", "Resumed"), ""),
    "Iterated": "item of ",
    "GoalFeedback": "goal of ",
    "UserdataWritten": "userdata of ",
}
"""Kind -> what comes before the path in the name of what it is about."""


class Begin:
    """Note: the tape's machine has this path from here on."""

    __slots__ = ("path",)

    def __init__(self, path: str) -> None:
        self.path = path


class Dropped:
    """Note: so many events were dropped here."""

    __slots__ = ("count",)

    def __init__(self, number: int) -> None:
        self.count = number


class _Found:
    """Where the events of one state, or of the goals of one, stand among others."""

    __slots__ = ("closes", "opens", "within")

    def __init__(self) -> None:
        self.opens: list[int] = []
        self.closes: list[int] = []
        self.within: list[tuple[str, int]] = []

    def kept(self) -> Iterable[int]:
        """The places to keep: see the module."""
        opened, closed = max(self.opens, default=-1), max(self.closes, default=-1)
        if opened >= 0:
            yield opened
        if closed > opened:
            yield closed
        if self.closes and (opened < 0 or min(self.closes) < min(self.opens)):
            yield min(self.closes)
        newest = max(opened, closed)
        yield from {slot: at for slot, at in self.within if at > newest}.values()


def thin(entries: Sequence[Any]) -> tuple[list[Any], int]:
    """Return the entries that are kept, with notes of what is missing, and how many events are.

    Args:
        entries: Elements, see `SLOTS`; they may have been thinned out before.
    """
    found: dict[str, _Found] = {}
    _find_steps(entries, found)
    _find_events(entries, found)
    kept = {at for one in found.values() for at in one.kept()}
    kept.add(_newest(entries))
    return _without_the_rest(entries, kept)


def _find_steps(entries: Sequence[Any], found: dict[str, _Found]) -> None:
    """Note where steps end and begin; places are twice the entry's number, one more to begin.

    Only the first and the last of each step matter; dicts find them without a loop in Python.
    """
    bases = list(entries[1::SLOTS])
    any_base = next((bases[i] for i, t in enumerate(entries[0::SLOTS]) if t is not None), None)
    for number in _untimed(entries):
        bases[number] = any_base  # instead of an event, which may have no hash; it has no steps
    only = any_base if bases.count(any_base) == len(bases) else None
    for steps, offset in ((entries[2::SLOTS], 0), (entries[4::SLOTS], 1)):
        keys = steps if only else list(zip(bases, steps, strict=True))
        last = dict(zip(keys, count(offset, 2), strict=False))
        first = dict(zip(reversed(keys), count(2 * len(keys) - 2 + offset, -2), strict=False))
        for key, at in last.items():
            base, step = (only, key) if only else key
            if step is not None:
                one = found.setdefault(f"{base}/{step.label}", _Found())
                (one.opens if offset else one.closes).extend((at, first[key]))


def _find_events(entries: Sequence[Any], found: dict[str, _Found]) -> None:
    for number in _untimed(entries):
        what = entries[number * SLOTS + 1]
        if isinstance(what, (Begin, Dropped)):
            continue
        kind, place = kind_of(what), 2 * number
        if kind in _OPENS:
            _about(_OPENS[kind], what, found).opens.append(place)
        elif kind in _CLOSES:
            _about(_CLOSES[kind], what, found).closes.append(place)
        elif kind in _WITHIN:
            _about(_WITHIN[kind], what, found).within.append((_slot(kind, what), place))


def _untimed(entries: Sequence[Any]) -> Iterator[int]:
    """The numbers of the entries that are events, records or notes."""
    times, number = entries[0::SLOTS], -1
    for _ in range(times.count(None)):
        number = times.index(None, number + 1)
        yield number


def _about(what_of: str, what: Any, found: dict[str, _Found]) -> _Found:
    path = what["path"] if type(what) is dict else what.path
    return found.setdefault(what_of + path, _Found())


def kind_of(what: Any) -> str:
    """Return the kind of an event or record."""
    kind: str = what["kind"] if type(what) is dict else type(what).__name__
    return kind


def _slot(kind: str, what: Any) -> str:
    """What a newer event of the same word makes out of date."""
    if kind == "UserdataWritten":
        return f"key {what['key']}"
    return "Paused" if kind == "Resumed" else kind


def _newest(entries: Sequence[Any]) -> int:
    """Place of the newest event: a gap is seen by what follows it."""
    for number in range(len(entries) // SLOTS - 1, -1, -1):
        t, what, _, _, entered = entries[number * SLOTS : (number + 1) * SLOTS]
        if t is not None:
            return 2 * number + (entered is not None)
        if not isinstance(what, (Begin, Dropped)):
            return 2 * number
    return -1


def _without_the_rest(entries: Sequence[Any], kept: set[int]) -> tuple[list[Any], int]:
    thinned: list[Any] = []
    notes = {n for n in _untimed(entries) if isinstance(entries[n * SLOTS + 1], (Begin, Dropped))}
    begun: list[Any] = []
    before = dropped = missing = 0  # missing: since the last that is kept
    for number in sorted({place // 2 for place in kept} | notes):
        missing += (passed := _events_in(entries, before, number))
        dropped += passed
        before = number + 1
        t, what, left, outcome, entered = entries[number * SLOTS : before * SLOTS]
        if number in notes:
            if isinstance(what, Begin):
                begun = [None, what, *NOTHING]
            else:
                missing += what.count
            continue
        parts = [(2 * number, (t, what, left, outcome, None))] if left or t is None else []
        parts += [(2 * number + 1, (t, what, None, None, entered))] if entered else []
        for place, part in parts:
            if place not in kept:
                missing, dropped = missing + 1, dropped + 1
                continue
            thinned += begun + ([None, Dropped(missing), *NOTHING] if missing else [])
            thinned += part
            begun, missing = [], 0
    return thinned + begun, dropped


def _events_in(entries: Sequence[Any], start: int, end: int) -> int:
    """So many events are in these entries, which are no notes."""
    part = entries[start * SLOTS : end * SLOTS]
    ended, begun = part[2::SLOTS], part[4::SLOTS]
    return 2 * (end - start) - ended.count(None) - begun.count(None) + part[0::SLOTS].count(None)
