"""Where a run stands, folded from the entries of its journal; no threads, time or files here.

An entry is a dict. Its `kind`, `path` and `stamp_ns` are those of the event that it stands for
(`smachpy.events`), so that whatever shows recorded events shows a journal; what is needed to go on
is beside them:

    Started, Entered   a visit begins; `in`: path of the container; `beside`: its other children run
                       on; `number`: the iterator's item
    Left               it has ended with `outcome`; `next`: path of the child that has been chosen
    Retried            attempt `attempt` has ended; the next begins at `at_ns`
    GoalSent, GoalTaken, GoalDone    a goal is about to be sent, is at a server, has ended
    Once               a call has returned `value` for `key`
    PreemptRequested   `source`, `by` and `why` asked the container at `path` to stop
    Recovered          another process goes on; `shift_ns`: how far deadlines have moved
    Finished           the run has ended with `outcome`

Any of them may hold `userdata` (path of a container -> key -> encoded value) and `deleted` (path
-> keys): what has changed since the entry before.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, ClassVar, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

VERSION: Final = 1
"""Of entries and snapshots."""


OF_PROCESS: Final = frozenset({"signal", "shutdown"})
"""Origins of requests that are about the process: the run that goes on is not asked again."""


class Position:
    """The facts that a run goes on from; plain JSON.

    Attributes:
        data: visits: path -> visit of each state that runs, or that has ended and whose outcome
            has not been followed: in, since_ns (of the attempt), attempt, outcome (None while it
            runs), number (of the iterator's item), goal (action, id, sent_ns, taken_ns, status,
            text, result, stopped: the end of a process has cancelled it) or None, once (key ->
            encoded value);
            userdata: path of a container -> key -> encoded value;
            preempts: path, source, by and why of each request;
            started_ns, last_ns: stamps of the first entry and of the newest;
            outages: pairs [from, to] of stamps; finished; outcome; structure: the machine that the
            paths are of, when it is not the one that the mission began with.
    """

    def __init__(self, data: dict[str, Any] | None = None) -> None:
        self.data: dict[str, Any] = data or {
            "version": VERSION,
            "visits": {},
            "userdata": {},
            "preempts": [],
            "started_ns": 0,
            "last_ns": 0,
            "outages": [],
            "finished": False,
            "outcome": None,
        }

    @property
    def visits(self) -> dict[str, dict[str, Any]]:
        """See the class."""
        visits: dict[str, dict[str, Any]] = self.data["visits"]
        return visits

    @property
    def userdata(self) -> dict[str, dict[str, Any]]:
        """See the class."""
        userdata: dict[str, dict[str, Any]] = self.data["userdata"]
        return userdata

    def to_bytes(self) -> bytes:
        """Return it as a snapshot."""
        return json.dumps(self.data, separators=(",", ":")).encode()

    def leaves(self) -> list[str]:
        """Return the paths of what runs and has nothing that runs below it."""
        containers = {visit["in"] for visit in self.visits.values()}
        return [
            path
            for path, visit in self.visits.items()
            if visit["outcome"] is None and path not in containers
        ]

    def fold(self, entry: Mapping[str, Any]) -> None:
        """Fold one entry.

        Raises:
            KeyError: of an unknown kind, or about a visit that there is not.
        """
        self._FOLD[entry["kind"]](self, entry)
        self.data["last_ns"] = max(self.data["last_ns"], entry["stamp_ns"])
        for container, values in entry.get("userdata", {}).items():
            self.userdata.setdefault(container, {}).update(values)
        for container, keys in entry.get("deleted", {}).items():
            for key in keys:
                self.userdata[container].pop(key, None)

    def renamed(self, names: Mapping[str, str]) -> Position:
        """Return the position in a machine whose states have other paths.

        Args:
            names: Old path -> new path; what is below an old path moves with it.
        """

        def new(path: str) -> str:
            for old in sorted(names, key=len, reverse=True):
                if path == old or path.startswith(f"{old}/"):
                    return names[old] + path[len(old) :]
            return path

        visits = {
            new(path): {**visit, "in": new(visit["in"])} for path, visit in self.visits.items()
        }
        preempts = [{**one, "path": new(one["path"])} for one in self.data["preempts"]]
        userdata = {new(path): values for path, values in self.userdata.items()}
        return Position({**self.data, "visits": visits, "preempts": preempts, "userdata": userdata})

    # -- one function for each kind ------------------------------------------------------------

    def _end_below(self, path: str) -> None:
        below = f"{path}/"
        for each in [each for each in self.visits if each.startswith(below)]:
            del self.visits[each]

    def _begin(self, path: str, container: str, stamp_ns: int, number: int | None = None) -> None:
        self.visits[path] = {
            "in": container,
            "since_ns": stamp_ns,
            "attempt": 1,
            "outcome": None,
            "number": number,
            "goal": None,
            "once": {},
        }

    def _on_started(self, entry: Mapping[str, Any]) -> None:
        self.data["started_ns"] = entry["stamp_ns"]
        self._begin(entry["path"], "", entry["stamp_ns"])

    def _on_entered(self, entry: Mapping[str, Any]) -> None:
        path, container = entry["path"], entry["in"]
        if not entry.get("beside"):
            self._end_below(container)
        self._end_below(path)
        self._begin(path, container, entry["stamp_ns"], entry.get("number"))

    def _on_left(self, entry: Mapping[str, Any]) -> None:
        path, following = entry["path"], entry.get("next")
        visit = self.visits[path]
        self._end_below(path)
        if following is None:
            visit.update(outcome=entry["outcome"], goal=None, once={})
        else:
            del self.visits[path]
            self._begin(following, visit["in"], entry["stamp_ns"])

    def _on_retried(self, entry: Mapping[str, Any]) -> None:
        self._end_below(entry["path"])
        visit = self.visits[entry["path"]]
        visit.update(since_ns=entry["at_ns"], attempt=entry["attempt"] + 1, goal=None)

    def _on_goal_sent(self, entry: Mapping[str, Any]) -> None:
        self.visits[entry["path"]]["goal"] = {
            "action": entry["action"],
            "id": entry["goal_id"],
            "sent_ns": entry["stamp_ns"],
            "taken_ns": None,
            "status": None,
            "text": "",
            "result": None,
            "stopped": False,
        }

    def _on_goal_taken(self, entry: Mapping[str, Any]) -> None:
        self.visits[entry["path"]]["goal"]["taken_ns"] = entry["stamp_ns"]

    def _on_goal_done(self, entry: Mapping[str, Any]) -> None:
        goal = self.visits[entry["path"]]["goal"]
        goal.update(status=entry["status"], text=entry["text"], result=entry["result"])

    def _on_once(self, entry: Mapping[str, Any]) -> None:
        self.visits[entry["path"]]["once"][entry["key"]] = entry["value"]

    def _on_preempt(self, entry: Mapping[str, Any]) -> None:
        request = {name: entry[name] for name in ("path", "source", "by", "why")}
        self.data["preempts"].append(request)
        if entry["source"] in OF_PROCESS:
            for visit in self.visits.values():
                if visit["goal"] is not None:
                    visit["goal"]["stopped"] = True

    def _on_recovered(self, entry: Mapping[str, Any]) -> None:
        self.data["outages"].append([self.data["last_ns"], entry["stamp_ns"]])
        for visit in self.visits.values():
            visit["since_ns"] += entry["shift_ns"]
            goal = visit["goal"]
            if goal is not None and goal["taken_ns"] is not None:
                goal["taken_ns"] += entry["shift_ns"]

    def _on_finished(self, entry: Mapping[str, Any]) -> None:
        self.visits.clear()
        self.data.update(finished=True, outcome=entry["outcome"])

    _FOLD: ClassVar[dict[str, Callable[[Position, Mapping[str, Any]], None]]] = {
        "Started": _on_started,
        "Entered": _on_entered,
        "Left": _on_left,
        "Retried": _on_retried,
        "GoalSent": _on_goal_sent,
        "GoalTaken": _on_goal_taken,
        "GoalDone": _on_goal_done,
        "Once": _on_once,
        "PreemptRequested": _on_preempt,
        "Recovered": _on_recovered,
        "Finished": _on_finished,
    }


def folded(entries: Iterable[Mapping[str, Any]], start: Position | None = None) -> Position:
    """Return the position after `entries`."""
    position = start or Position()
    for entry in entries:
        position.fold(entry)
    return position
