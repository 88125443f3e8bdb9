"""Kills the process of an explored run at the writes of its journal."""

from __future__ import annotations

import json
import re
from collections import Counter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from actionlib_core.clock._virtual_parts import Stopped
from smachpy.durable.mission import new_mission
from smachpy.durable.position import Position
from smachpy.durable.store import FencedError, Lease
from smachpy.testing.ros2_node import ScriptedNode
from smachpy.testing.servers import ScriptedActionServer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from smachpy.durable.store import MissionRow, ResourceUse, Store
    from smachpy.machines.container import Container
    from smachpy.testing.servers import ScriptedEnd

MISSION = "explored"


class Kill(NamedTuple):
    """A kill of a run.

    Attributes:
        write: The number of the write, from 1.
        written: Whether this write is done before the kill.
        what: The write's entries, as text.
    """

    write: int
    written: bool
    what: str

    @property
    def loses_request(self) -> bool:
        """Whether a preempt request is lost with the process, before anything has seen it."""
        return not self.written and "PreemptRequested" in self.what

    def __str__(self) -> str:
        return f"killed {'after' if self.written else 'before'} write {self.write}: {self.what}"


def parse_kill(text: object) -> Kill | None:
    """Return the kill that a text of `replay` describes; None if it describes none."""
    found = re.fullmatch(r"killed (before|after) write (\d+): (.*)", str(text))
    return found and Kill(int(found[2]), found[1] == "after", found[3])


class MemoryJournal:
    """The journal of an explored run, in memory, with the methods of `Store` that are needed.

    Args:
        machine: The root.
        kill: When its first process is killed; None: never.

    Attributes:
        die: Kills the process.
        writes: For each write its text, and the position before it.
        position: The position of the run.
    """

    def __init__(self, machine: Container, kill: Kill | None) -> None:
        self.die: Callable[[], object]
        self.writes: list[tuple[str, str]] = []
        self.position = Position()
        self._row = new_mission(machine, mission=MISSION)
        self._kill = kill
        self._entries: list[dict[str, Any]] = []
        self._blobs: dict[str, bytes] = {}
        self._fence = 0
        self._begins: Counter[str] = Counter()
        self._chosen: set[str] = set()

    def as_store(self) -> Store:
        """Return it with the type of the store that it replaces."""
        return cast("Store", self)

    def active(self) -> list[str]:
        """Return the paths of the active states."""
        return [path for path, one in self.position.visits.items() if one["outcome"] is None]

    def begins(self, path: str) -> int:
        """Return how often the state at `path` began, including attempts, excluding kills."""
        return self._begins[path]

    def ends(self, path: str) -> int:
        """Return how often it ended, including attempts."""
        kinds = {"Left", "Retried"}
        return sum(e["path"] == path and e["kind"] in kinds for e in self._entries)

    def facts(self, ends: Iterable[ScriptedEnd]) -> dict[str, Any]:
        """Return the facts that must be equal in runs with and without a kill."""
        # Without 'preempted': whether a preempted branch ends before its concurrence is a race.
        left = Counter(
            (e["path"], e["outcome"])
            for e in self._entries
            if e["kind"] == "Left" and e["outcome"] != "preempted"
        )
        once = Counter(f"{e['path']}: {e['key']}" for e in self._entries if e["kind"] == "Once")
        servers = [end for end in ends if isinstance(end, ScriptedActionServer)]
        return {
            "outcome": self.position.data["outcome"],
            "userdata": {path: values for path, values in self.position.userdata.items() if values},
            "ends of states": {f"{path}: {outcome}": n for (path, outcome), n in left.items()},
            "calls of once": dict(once),
            "goals": {server.name: len(server.goals) for server in servers},
            "parameters": {
                end.name: end.parameters for end in ends if isinstance(end, ScriptedNode)
            },
        }

    # -- the store -----------------------------------------------------------------------------

    def mission(self, _: str) -> MissionRow:
        return self._row

    def claim(self, mission: str, runner: str, **_: Any) -> Lease:
        """The previous process is dead."""
        self._fence += 1
        return Lease(mission, self._fence, runner)

    def renew(self, lease: Lease, **_: Any) -> bool:  # noqa: ARG002
        return False

    def hold(self, *_: Any) -> None:
        """There is no other mission."""

    def let_go(self, *_: Any) -> None:
        """There is no other mission."""

    def resources(self) -> list[ResourceUse]:
        return []

    def append(
        self,
        lease: Lease,
        entries: Sequence[bytes],
        *,
        blobs: Mapping[str, bytes] = MappingProxyType({}),
        **_: Any,
    ) -> None:
        """Nothing is compacted.

        Raises:
            Stopped: the process is killed, or was.
        """
        kill = self._kill
        if lease.fence != self._fence:
            raise Stopped
        read = [json.loads(entry) for entry in entries]
        told = ", ".join(f"{entry['kind']} {entry['path']}" for entry in read)
        self._blobs.update(blobs)
        self.writes.append((told, _summary(self.position)))
        at = kill is not None and self._fence == 1 and len(self.writes) == kill.write
        if not at or (kill is not None and kill.written):
            for entry in read:
                self.position.fold(entry)
                self._count(entry)
                self._entries.append(entry)
        if at:
            self._fence += 1  # writes of the killed process are refused from now on
            self.die()
            raise Stopped

    def read(self, _: str) -> tuple[None, list[bytes]]:
        return None, [json.dumps(entry).encode() for entry in self._entries]

    def blob(self, _: str, digest: str) -> bytes:
        return self._blobs[digest]

    def release(self, lease: Lease, status: str, *, note: str = "") -> None:  # noqa: ARG002
        if lease.fence != self._fence:
            raise FencedError("a journal in memory", lease, None)
        del status

    def _count(self, entry: Mapping[str, Any]) -> None:
        path, kind = entry["path"], entry["kind"]
        if (kind == "Entered" and path not in self._chosen) or kind == "Retried":
            self._begins[path] += 1
        elif kind == "Left":
            self._chosen.discard(path)
            if "next" in entry:
                self._begins[entry["next"]] += 1
                self._chosen.add(entry["next"])


def kills_of(journal: MemoryJournal, seen: set[object]) -> Iterator[Kill]:
    """Yield the kills for a run, two at each write, except at places that were tried before.

    Args:
        journal: Its journal.
        seen: The places that were tried; new ones are added.
    """
    for number, (told, place) in enumerate(journal.writes, 1):
        for written in (False, True):
            if written and number == len(journal.writes):
                continue  # the run has ended: nothing is left to continue
            if (told, place, written) not in seen:
                seen.add((told, place, written))
                yield Kill(number, written, told)


def difference(facts: Mapping[str, Any], expected: Mapping[str, Any]) -> str:
    """Return how a run with a kill differs from the one without; "" if not at all."""
    found = []
    for name, want in expected.items():
        got = facts[name]
        if got != want and isinstance(want, dict):
            keys = [key for key in {**want, **got} if want.get(key) != got.get(key)]
            found += [f"{name}: {k}: got {got.get(k)!r}; expected {want.get(k)!r}" for k in keys]
        elif got != want:
            found.append(f"{name}: got {got!r}; expected {want!r}")
    return ". ".join(found)


def _summary(position: Position) -> str:
    """Return a position without its times."""
    visits = {
        path: {
            **{name: fact for name, fact in visit.items() if name not in {"since_ns", "goal"}},
            "goal": goal and [goal["taken_ns"] is None, goal["status"], goal["stopped"]],
        }
        for path, visit in position.visits.items()
        for goal in [visit["goal"]]
    }
    kept = {"visits": visits, "userdata": position.userdata, "asked": position.data["preempts"]}
    return json.dumps(kept, sort_keys=True)
