"""The shape of a machine as a journal keeps it, and the differences between two shapes; pure."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from smachpy.events.introspection import describe

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from smachpy.durable.store import MissionRow
    from smachpy.events.introspection import Described, StateRecord

Shape = dict[str, dict[str, Any]]
"""Path -> the facts that a position depends on: kind, outcomes, keys; for a container its children
and transitions; for a plan its net. No position depends on `success`, the good outcomes of the root
if it says which.
"""


def shape_of(machine: Described) -> Shape:
    """Return the shape of a machine, without what may change between two processes.

    Timeouts, texts, classes and callbacks are no part of it.
    """
    root = describe(machine)
    shape = {record.path: _facts(record) for record in root.walk()}
    if root.success is not None:
        shape[root.path]["success"] = sorted(root.success)
    return shape


def success_of(row: MissionRow) -> tuple[str, ...] | None:
    """Return the good outcomes of a mission, None if its machine does not say or is damaged."""
    try:
        success = from_bytes(row.structure).get(f"/{row.name}", {}).get("success")
    except ValueError:
        return None
    return tuple(map(str, success)) if isinstance(success, list) else None


def _facts(record: StateRecord) -> dict[str, Any]:
    facts: dict[str, Any] = {
        # A leaf may be rewritten, as a function or a class: only actions have goals to follow.
        "kind": record.kind if record.is_container or record.kind == "action" else "state",
        "outcomes": sorted(record.outcomes),
        "keys": sorted({*record.input_keys, *record.output_keys}),
    }
    action = dict(record.details).get("action") if record.kind == "action" else None
    if action is not None:
        facts["action"] = action
    if record.is_container:
        facts["children"] = [child.label for child in record.children]
        facts["edges"] = {
            f"{edge.source} -{edge.outcome}->{edge.guard and f' if {edge.guard}'}": edge.target
            for edge in record.transitions
        }
        facts["rules"] = sorted(f"{rule.outcome}: {rule.text}" for rule in record.rules)
    if record.net is not None:
        facts["places"] = {place.id: place.name for place in record.net.places}
        facts["net"] = {
            each.id: f"{each.name!r}: {_arcs(each.inputs)} -> {_arcs(each.outputs)}"
            for each in record.net.transitions
        }
    return facts


def _arcs(arcs: Iterable[tuple[str, int]]) -> str:
    return " + ".join(place if weight == 1 else f"{weight} {place}" for place, weight in arcs)


def to_bytes(shape: Shape) -> bytes:
    """Encode a shape for the store."""
    return json.dumps(shape, separators=(",", ":"), sort_keys=True).encode()


def from_bytes(data: bytes) -> Shape:
    """Decode a shape from the store.

    Raises:
        ValueError: the data are damaged.
    """
    try:
        shape = json.loads(data)
    except RecursionError as error:
        raise ValueError("structure: it is nested too deeply") from error
    if not isinstance(shape, dict) or not all(isinstance(facts, dict) for facts in shape.values()):
        raise ValueError(f"structure: got {shape!r:.80}; expected path -> facts.")
    return shape


def differences(old: Shape, new: Shape) -> list[str]:
    """Return the differences between two shapes, one text each."""
    found = [f"{path}: is missing" for path in old if path not in new]
    found += [f"{path}: is new" for path in new if path not in old]
    for path in old.keys() & new.keys():
        was, now = old[path], new[path]
        for fact in sorted({*was, *now} - {"success"}):
            found += _changes(f"{path}: {fact}", was.get(fact), now.get(fact))
    return sorted(found)


def _changes(where: str, was: Any, now: Any) -> Iterable[str]:
    if was == now:
        return
    if isinstance(was, dict) and isinstance(now, dict):
        for name in sorted({*was, *now}):
            if was.get(name) != now.get(name):
                yield f"{where}: {name} {was.get(name)!r}, now {now.get(name)!r}"
    else:
        yield f"{where}: {was!r}, now {now!r}"


def missing_paths(visits: Mapping[str, Mapping[str, Any]], shape: Shape) -> list[str]:
    """Return the paths that a position needs and a machine lacks, or has as another kind."""
    # A leaf may have become a container, but a container with active children must remain one.
    containers = {visit["in"] for visit in visits.values()} - {""}
    return sorted(
        {path for path in visits if path not in shape}
        | {path for path in containers if "children" not in shape.get(path, {})}
    )


def missing_places(markings: Mapping[str, Iterable[str]], shape: Shape) -> list[str]:
    """Return "path: place" for each place that holds tokens in a position and no longer exists."""
    return sorted(
        f"{path}: place {place!r}"
        for path, marking in markings.items()
        for place in set(marking)
        if place not in shape.get(path, {}).get("places", {})
    )
