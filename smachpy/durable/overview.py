"""A summary of each mission in a store, for lists and viewers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smachpy.durable import structure
from smachpy.durable.journal import read_position
from smachpy.durable.store import StoreError
from smachpy.userdata.secret import masked_words

if TYPE_CHECKING:
    from smachpy.durable.store import MissionRow, Store


def overview(store: Store, row: MissionRow) -> dict[str, Any]:
    """Return the summary of a mission, as plain data.

    Returns:
        `id`, `name`, `target`, `argv`, `status`, `outcome`, `robot`, `created` and `changed` [s
        since the epoch] and `owner` of its row; `run`, the name of the run, as in its recordings;
        `active`, the paths of the innermost states that have begun and not ended; `began_ns` and
        `last_ns`, the times of the first and the newest entry, null before the first; `outages`,
        pairs [ns since the epoch]; `ends`, path, begin, end and outcome of the newest children of
        the root that have ended; `current`, path and begin of those that are running; `rows`, the
        children of the root if they run at the same time, else null; `problem`, why its journal
        cannot be read, a `smachpy.durable.store.Reason`, or "".

    Blocks: until the store has answered.
    """
    names = "id name target argv status outcome robot created changed owner"
    facts = {name: getattr(row, name) for name in names.split()}
    facts["argv"] = masked_words(row.argv)
    facts.update(run=row.run, active=[], problem="", rows=None)
    facts.update(began_ns=None, last_ns=None, outages=[], ends=[], current=[])
    try:
        position = read_position(store, row.id)
        shape = structure.from_bytes(row.structure)
    except StoreError as error:
        return {**facts, "problem": error.reason}
    except ValueError:
        return {**facts, "problem": "corrupt"}
    data = position.data
    root = shape.get(f"/{row.name}", {})
    children = root.get("children")
    if root.get("kind") == "concurrence" and isinstance(children, list):
        facts["rows"] = [f"/{row.name}/{label}" for label in children]
    begun = {"began_ns": data["started_ns"] or None, "last_ns": data["last_ns"] or None}
    facts.update(begun, active=position.leaves(), outages=data["outages"])
    return {
        **facts,
        # Journals of earlier versions have neither `ends` nor `entered_ns`.
        "ends": data.get("ends", []),
        "current": [
            [path, visit.get("entered_ns", visit["since_ns"])]
            for path, visit in position.visits.items()
            if visit["outcome"] is None and position.visits.get(visit["in"], {}).get("in") == ""
        ],
    }
