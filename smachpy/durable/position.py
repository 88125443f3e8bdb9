"""The position of a run, folded from the entries of its journal; no threads, time or files here.

An entry is a dict. Its `kind`, `path` and `stamp_ns` are those of the corresponding event
(`smachpy.events`), so tools for recorded events can show a journal. The other keys are needed to
resume:

    Started, Entered   a visit begins; `in`: path of the container; `beside`: the other children
                       keep running; `number`: the index of the iterator's item
    Left               a visit has ended with `outcome`; `next`: path of the child that follows
    Retried            attempt `attempt` has ended; the next begins at `at_ns`
    GoalSent, GoalTaken, GoalDone    a goal is about to be sent, is at a server, has ended
    Once               a call has returned `value` for `key`
    Fired              `transitions` of the plan at `path` have fired: its tokens are in `marking`,
                       the actions at the paths `ends` must stop, those at `begins` begin
    Noted              nothing but changes, see below
    PreemptRequested   `source`, `by` and `why` asked the container at `path` to stop; with
                       `override` an operator asked the child there; it is a pair of the outcome or
                       the label that comes next, or None
    Recovered          another process resumes; `shift_ns`: how far deadlines have moved; `gone_ns`:
                       the length of the outage
    Finished           the run has ended with `outcome`

Any of them may also have the changes since the entry before: `userdata` (path of a container -> key
-> encoded value), `deleted` (path -> keys), and `conditions` (path of a plan -> `set`: name ->
truth, `events`: pairs [name, stamp] that no guard has read).
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, ClassVar, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

VERSION: Final = 1
"""Version of the format of entries and snapshots."""

MOST_ENDS: Final = 80
"""Kept ends of the root's children; older ones are dropped."""


OF_PROCESS: Final = frozenset({"signal", "shutdown"})
"""Origins of requests to stop that concern one process only: a resumed run is not asked again."""


class Position:
    """The facts from which a run can be resumed, as plain JSON.

    Attributes:
        data: A dict with these keys:

            visits: path -> visit of each state that is running, or that has ended and whose outcome
                has not been followed yet. A visit has: in (path of its container); since_ns (begin
                of the attempt), begun_ns (begin of the visit; both are moved by an outage during
                which time stops), entered_ns (the same, never moved); attempt; outcome (None while
                it runs); number (index of the iterator's item); once (key -> encoded value);
                goal, or None: action, id, sent_ns, taken_ns, status, text, result, preempted (it
                ended after its state was asked to stop) and stopped (the end of a process has
                cancelled it); asked, if an operator asked it to stop: source, by, why and override.
                The visit of a plan's action may also have: stopping (a transition has asked it to
                stop) and again (it begins once more after that).
            markings: path of a running plan -> ids of the places that hold tokens
            conditions: as in entries
            userdata: path of a container -> key -> encoded value
            preempts: path, source, by and why of each request
            started_ns, last_ns: stamps of the first and the newest entry
            outages: pairs [from, to] of stamps
            ends: path, begin and end [ns] and outcome of the newest visits of the root's children
                that have ended
            finished, outcome: of the run
            structure: the machine that the paths belong to, if the mission began with another
    """

    def __init__(self, data: dict[str, Any] | None = None) -> None:
        self.data: dict[str, Any] = data or {
            "version": VERSION,
            "visits": {},
            "userdata": {},
            "markings": {},
            "conditions": {},
            "preempts": [],
            "started_ns": 0,
            "last_ns": 0,
            "outages": [],
            "ends": [],
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

    @property
    def markings(self) -> dict[str, list[str]]:
        """See the class."""
        markings: dict[str, list[str]] = self.data.setdefault("markings", {})
        return markings

    @property
    def conditions(self) -> dict[str, dict[str, Any]]:
        """See the class."""
        conditions: dict[str, dict[str, Any]] = self.data.setdefault("conditions", {})
        return conditions

    def to_bytes(self) -> bytes:
        """Return the position as a snapshot."""
        return json.dumps(self.data, separators=(",", ":")).encode()

    def leaves(self) -> list[str]:
        """Return the paths of the innermost states that are running."""
        containers = {visit["in"] for visit in self.visits.values()}
        return [
            path
            for path, visit in self.visits.items()
            if visit["outcome"] is None and path not in containers
        ]

    def fold(self, entry: Mapping[str, Any]) -> None:
        """Fold one entry.

        Raises:
            KeyError: the kind is unknown, or there is no such visit.
        """
        self._FOLD[entry["kind"]](self, entry)
        self.data["last_ns"] = max(self.data["last_ns"], entry["stamp_ns"])
        for container, values in entry.get("userdata", {}).items():
            self.userdata.setdefault(container, {}).update(values)
        for container, keys in entry.get("deleted", {}).items():
            for key in keys:
                self.userdata[container].pop(key, None)
        self.conditions.update(entry.get("conditions", {}))

    def renamed(self, names: Mapping[str, str]) -> Position:
        """Return the position with other paths.

        Args:
            names: Old path -> new path; paths below an old path move with it.
        """

        def new(path: str) -> str:
            for old in sorted(names, key=len, reverse=True):  # the innermost match counts
                if path == old or path.startswith(f"{old}/"):
                    return names[old] + path[len(old) :]
            return path

        visits = {
            new(path): {**visit, "in": new(visit["in"])} for path, visit in self.visits.items()
        }
        # The target of an operator's jump is a label, not a path: look it up beside the child.
        for path, visit in self.visits.items():
            outcome, label = (visit.get("asked") or {}).get("override") or (None, None)
            if label is not None:
                label = new(f"{visit['in']}/{label}").rpartition("/")[2]
                asked = {**visit["asked"], "override": [outcome, label]}
                visits[new(path)]["asked"] = asked
        preempts = [{**one, "path": new(one["path"])} for one in self.data["preempts"]]
        moved = {
            facts: {new(path): values for path, values in getattr(self, facts).items()}
            for facts in ("userdata", "markings", "conditions")
        }
        return Position({**self.data, "visits": visits, "preempts": preempts, **moved})

    # -- one function for each kind ------------------------------------------------------------

    def _end_below(self, path: str) -> None:
        """Drop the visits and markings below a state that has ended or begins anew."""
        below = f"{path}/"
        for facts in (self.visits, self.markings):
            for each in [each for each in facts if each.startswith(below)]:
                del facts[each]
        self.markings.pop(path, None)

    def _begin(self, path: str, container: str, stamp_ns: int, number: int | None = None) -> None:
        self.visits[path] = {
            "in": container,
            "since_ns": stamp_ns,
            "begun_ns": stamp_ns,
            "entered_ns": stamp_ns,
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
        if not entry.get("beside"):  # one child at a time: the one before has ended
            self._end_below(container)
        self._end_below(path)
        self._begin(path, container, entry["stamp_ns"], entry.get("number"))

    def _on_left(self, entry: Mapping[str, Any]) -> None:
        path, following = entry["path"], entry.get("next")
        visit = self.visits[path]
        self._keep_end(path, visit, entry)
        self._end_below(path)
        if visit.get("stopping"):
            del self.visits[path]
            if visit.get("again"):
                self._begin(path, visit["in"], entry["stamp_ns"])
        elif following is None:  # not followed yet: a resumed run enters the child for its outcome
            visit.update(outcome=entry["outcome"], goal=None, once={})
        else:
            del self.visits[path]
            self._begin(following, visit["in"], entry["stamp_ns"])

    def _keep_end(self, path: str, visit: Mapping[str, Any], entry: Mapping[str, Any]) -> None:
        """Keep the end of a child of the root, for lists and viewers."""
        container = self.visits.get(visit["in"])
        if container is not None and container["in"] == "":
            began = visit.get("entered_ns", visit["since_ns"])  # not in journals of old versions
            ends = self.data.setdefault("ends", [])
            ends.append([path, began, entry["stamp_ns"], entry["outcome"]])
            del ends[:-MOST_ENDS]

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
            "preempted": False,
            "stopped": False,
        }

    def _on_goal_taken(self, entry: Mapping[str, Any]) -> None:
        self.visits[entry["path"]]["goal"]["taken_ns"] = entry["stamp_ns"]

    def _on_goal_done(self, entry: Mapping[str, Any]) -> None:
        goal = self.visits[entry["path"]]["goal"]
        goal.update(status=entry["status"], text=entry["text"], result=entry["result"])
        goal["preempted"] = entry.get("preempted", False)

    def _on_once(self, entry: Mapping[str, Any]) -> None:
        self.visits[entry["path"]]["once"][entry["key"]] = entry["value"]

    def _on_fired(self, entry: Mapping[str, Any]) -> None:
        self.markings[entry["path"]] = entry["marking"]
        for path in entry["ends"]:
            visit = self.visits.get(path)
            if visit is not None and visit["outcome"] is None:
                visit["stopping"] = True
                visit.pop("again", None)
            elif visit is not None:
                del self.visits[path]
        for path in entry["begins"]:
            visit = self.visits.get(path)
            # One run of an action at a time: it begins once the one that is stopping has ended.
            if visit is not None and visit.get("stopping"):
                visit["again"] = True
            else:
                self._end_below(path)
                self._begin(path, entry["path"], entry["stamp_ns"])

    def _on_noted(self, entry: Mapping[str, Any]) -> None:
        pass

    def _on_preempt(self, entry: Mapping[str, Any]) -> None:
        request = {name: entry[name] for name in ("path", "source", "by", "why")}
        if "override" in entry:
            visit = self.visits.get(entry["path"])
            if visit is not None:  # it may have ended meanwhile
                visit["asked"] = {**request, "override": entry["override"]}
            return
        self.data["preempts"].append(request)
        if entry["source"] in OF_PROCESS:
            for visit in self.visits.values():
                if visit["goal"] is not None:
                    visit["goal"]["stopped"] = True

    def _on_recovered(self, entry: Mapping[str, Any]) -> None:
        stamp_ns = entry["stamp_ns"]
        gone_ns = entry.get("gone_ns", stamp_ns)  # not in journals of old versions
        # The clock may have been put back during the outage: stamps never exceed its time.
        last_ns = self.data["last_ns"] = min(self.data["last_ns"], stamp_ns)
        self.data["outages"].append([max(last_ns, stamp_ns - gone_ns), stamp_ns])
        for visit in self.visits.values():
            visit["begun_ns"] = visit.get("begun_ns", visit["since_ns"]) + entry["shift_ns"]
            visit["since_ns"] += entry["shift_ns"]
            goal = visit["goal"]
            if goal is not None and goal["taken_ns"] is not None:
                goal["taken_ns"] += entry["shift_ns"]
        for known in self.conditions.values():
            known["events"] = [[name, at + entry["shift_ns"]] for name, at in known["events"]]

    def _on_finished(self, entry: Mapping[str, Any]) -> None:
        self.visits.clear()
        self.markings.clear()
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
        "Fired": _on_fired,
        "Noted": _on_noted,
        "PreemptRequested": _on_preempt,
        "Recovered": _on_recovered,
        "Finished": _on_finished,
    }
