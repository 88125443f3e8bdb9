"""What other tools write in PNML that changes a net: read if a plan can mean it, else reported.

Nothing is skipped that could be more than a drawing. Sources: files and documentation of PIPE 4,
ProM 6, pm4py 2.7, TAPAAL 3, WoPeD 3, Snoopy and GreatSPN.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator
    from xml.etree.ElementTree import Element

    from smachpy.pnp.labels import Severity

_DRAWN: Final = frozenset({"name", "graphics", "toolspecific", "comment"})
_GROUPS: Final = _DRAWN | {
    *("place", "transition", "arc", "page", "referencePlace", "referenceTransition"),
    *("declaration", "token", "tokenclass", "labels", "finalmarkings"),
}
_CHILDREN: Final = {
    "net": _GROUPS,
    "page": _GROUPS,
    "place": _DRAWN | {"initialMarking", "capacity"},
    "transition": _DRAWN | {"orientation", "rate", "timed", "infiniteServer", "priority"},
    "arc": _DRAWN | {"inscription", "arcpath", "tagged", "type", "arctype"},
    "referencePlace": _DRAWN,
    "referenceTransition": _DRAWN,
}
"""The children of an element that are read here or by `pnml`, or only draw it."""

_ORDINARY: Final = frozenset({"", "normal", "ordinary", "standard", "edge", "arc", "directed"})
_ODD: Final = re.compile(
    r"(inhibit|reset|flush|equal|clear|transport|biflow|catalyst)\w*|(read|test)(_?(arc|edge))?",
    re.IGNORECASE,
)
_FREE_INTERVAL: Final = frozenset({"", "[0,inf)", "1"})
_UNLIMITED: Final = frozenset({"", "0", "-1", "inf", "infinity", "∞", "omega", "unbounded"})


class Excess(NamedTuple):
    """One thing in an element beyond an ordinary place, transition or arc."""

    severity: Severity
    message: str
    hint: str = ""


def excess(element: Element) -> Iterator[Excess]:
    """Yield what an element has that a plan cannot mean."""
    tag = local(element)
    yield from _unread(element, tag)
    if tag == "arc":
        yield from _of_arc(element)
    elif tag == "place":
        yield from _of_place(element)
    elif tag == "transition" and value_of(element, "timed").lower() == "true":
        yield Excess("warning", "timed: got 'true', which is ignored: a plan fires at once.")


def _unread(element: Element, tag: str) -> Iterator[Excess]:
    known = _CHILDREN.get(tag)
    for child in element if known is not None else ():
        name = local(child)
        if known is None or name in known:
            continue
        if child.get("source") and child.get("target"):
            yield Excess("error", f"got <{name}> in it; expected ordinary arcs, as <arc>.")
        else:
            yield Excess("warning", f"got <{name}> in it, which is not read.")


def _of_arc(element: Element) -> Iterator[Excess]:
    kinds = [element.get("type", ""), element.get("kind", "")]
    kinds += [value_of(element, tag) for tag in ("type", "arctype")]
    for kind in kinds:
        timed = kind.lower() == "timed" and _interval(element) in _FREE_INTERVAL
        if kind.lower() not in _ORDINARY and not timed:
            yield Excess("error", f"got type {kind!r}; expected an ordinary arc.")
    for child in element:
        found = _odd_below(child) if local(child) == "toolspecific" else ""
        if found:
            yield Excess("error", f"toolspecific: got {found!r}; expected an ordinary arc.")
    name = value_of(element, "name")
    if name.isdecimal() and int(name) > 1 and not value_of(element, "inscription"):
        yield Excess(
            "warning",
            f"name: got {name!r}, which is no weight; the arc moves one token.",
            "Try <inscription>, if it is one.",
        )


def _interval(element: Element) -> str:
    return re.sub(r"\s", "", element.get("inscription", ""))


def _odd_below(element: Element) -> str:
    for each in element.iter():
        values = [local(each), *(each.get(name, "") for name in ("type", "kind", "value"))]
        for text in (*values, (each.text or "").strip()):
            if _ODD.fullmatch(text):
                return text
    return ""


def _of_place(element: Element) -> Iterator[Excess]:
    capacity = value_of(element, "capacity") or element.get("capacity", "")
    number = capacity.rpartition(",")[2].strip().lower()
    if number not in _UNLIMITED:
        yield Excess(
            "error",
            f"capacity: got {capacity!r}; expected none: places have no limit.",
            "Try a second place for the free room, with arcs against those of this one.",
        )
    invariant = re.sub(r"\s", "", element.get("invariant", ""))
    if invariant not in {"", "<inf", "&lt;inf"}:
        yield Excess("error", f"invariant: got {invariant!r}; expected none.")


def tokens(text: str) -> int | None:
    """Return the tokens in a marking such as "1" or "Default,1"; None if it is none.

    Of several colours, "red,0,Default,1", only one may have tokens.
    """
    parts = text.split(",")
    pairs = [parts] if len(parts) == 1 else [parts[i : i + 2] for i in range(0, len(parts), 2)]
    counts = [pair[-1].strip() for pair in pairs]
    if not all(re.fullmatch(r"[0-9]{1,9}", count) for count in counts):
        return None
    marked = [int(count) for count in counts if int(count)]
    return (marked or [0])[0] if len(marked) <= 1 else None


def priorities(transitions: list[Element]) -> list[Element]:
    """Return the transitions whose priority differs from that of the first one."""
    given = [
        value_of(element, "priority") or element.get("priority", "") for element in transitions
    ]
    return [e for e, priority in zip(transitions, given, strict=True) if priority != given[0]]


def is_place_transition_net(kind: str) -> bool:
    """Return whether a net's type is one whose nets are places, transitions and weights."""
    letters = re.sub(r"[^a-z]", "", kind.rpartition("/")[2].lower() or kind.lower())
    whole = re.sub(r"[^a-z]", "", kind.lower())
    names = ("ptnet", "pnmlcoremodel", "placetransitionnet", "basicpetrinet")
    return not kind or letters in names or whole.endswith(names)


def value_of(element: Element, tag: str) -> str:
    """Return the text or attribute `value` of an element's child `tag`; "" if it has none."""
    for child in element:
        if local(child) == tag:
            for holder in child:
                if local(holder) in {"value", "text"}:
                    return "".join(holder.itertext()).strip()
            return (child.get("value") or "".join(child.itertext())).strip()
    return ""


def local(element: Element) -> str:
    """Return an element's tag without its namespace."""
    return str(element.tag).rpartition("}")[2]
