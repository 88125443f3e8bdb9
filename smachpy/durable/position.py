"""The position of a run, folded from the entries of its journal; no threads, time or files here.

An entry is a dict. Its `kind` and `path` are those of the corresponding event (`smachpy.events`),
so tools for recorded events can show a journal. Its `stamp_ns` is the mission's own time: the time
of day when it began, and from there on a steady clock, outages included. Setting the clock of a
computer does not change it. The other keys are needed to resume:

    Started, Entered   a visit begins; `in`: path of the container; `beside`: the other children
                       keep running; `number`: the index of the iterator's item; `ending`: it is
                       the clean-up, and the fields of the `Ending` after which it runs
    CleanedUp          the clean-up at `path` after an exception is over, which is raised now
    Left               a visit has ended with `outcome`; `next`: path of the child that follows;
                       `stopped`: path of a machine in it, or of itself -> label of the child in
                       which it was asked to stop; `goes_on`: the same, of machines whose next run
                       begins there, or ""; `served`: it had serviced the request to stop,
                       which its container is rid of
    Retried            attempt `attempt` has ended; the next begins at `at_ns`
    GoalSent, GoalTaken, GoalDone    a goal is about to be sent, is at a server, has ended
    Met                the states at `paths` have met at a barrier
    Once               a call has returned `value` for `key`
    Fired              `transitions` of the plan at `path` have fired: its tokens are in `marking`,
                       the actions at the paths `ends` must stop, those at `begins` begin
    Noted              nothing but changes, see below; or, with `stopped` and `goes_on`, an operator
                       has chosen what follows the machine that has ended there
    PreemptRequested   `source`, `by` and `why` asked the container at `path` to stop; if `passed`,
                       it has got the request from above, or from its own timeout. With `override`
                       an operator asked the child there; it is None, or the outcome, the label that
                       comes next, and whether that holds only if the child stops; `goes_on` as
                       above: an event of modes has left the child there
    Recalled           the state at `path` withdraws the requests `origins` that it has got
    Halted             an operator holds a state in the container at `path`: its timeouts stop
    WentOn             they go on
    Recovered          another process resumes; `shift_ns`: how far deadlines have moved; `gone_ns`:
                       the length of the outage
    Finished           the run has ended with `outcome`

Any of them may also have the changes since the entry before: `userdata` (path of a container -> key
-> encoded value), `deleted` (path -> keys), and `conditions` (path of a plan -> `set`: name ->
truth, `events`: pairs [name, stamp] that no guard has read). In the place of a large value is
`{"$blob": DIGEST}`; see `smachpy.durable.journal`.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, ClassVar, Final, NotRequired, TypedDict

from actionlib_core.inputs.checked_data import DataError, Stamp, checked
from smachpy.engine.visit import Override, choice_after

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

VERSION: Final = 2
"""Version of the format of entries and snapshots; 2 has large values beside them, and stamps that
no step of a computer's clock changes.
"""

MAX_REQUESTS: Final = 50
"""Kept requests to stop, of the run and of each visit; older ones are dropped."""

MAX_ENDS: Final = 80
"""Kept ends of the root's children; older ones are dropped."""


OF_PROCESS: Final = frozenset({"signal", "shutdown"})
"""Origins of requests to stop that concern one process only: a resumed run is not asked again."""


class _KeptGoal(TypedDict):
    action: str
    id: str
    sent_ns: Stamp
    taken_ns: Stamp | None
    begun_ns: NotRequired[Stamp | None]
    status: str | None
    text: NotRequired[str]
    result: NotRequired[Any]
    preempted: NotRequired[bool]
    stopped: NotRequired[bool]


class _Visit(TypedDict):
    """See `Position`; fields that journals of old versions lack need not be there.

    The field `in` has no line here, as that is a word of Python.
    """

    since_ns: Stamp
    begun_ns: NotRequired[Stamp]
    entered_ns: NotRequired[Stamp]
    attempt: int
    outcome: str | None
    number: NotRequired[int | None]
    goal: _KeptGoal | None
    once: dict[str, Any]
    asked: NotRequired[dict[str, Any]]
    requests: NotRequired[list[tuple[str, str, str]]]
    served: NotRequired[list[tuple[str, str, str]]]
    recalled: NotRequired[list[tuple[str, str, str]]]
    halted_ns: NotRequired[Stamp]
    stopping: NotRequired[bool]
    again: NotRequired[bool]
    met: NotRequired[bool]
    ending: NotRequired[tuple[str | None, str, bool]]


class _Raised(TypedDict):
    visits: dict[str, _Visit]
    markings: dict[str, list[str]]


class _Condition(TypedDict):
    set: dict[str, bool]
    events: list[tuple[str, Stamp]]


class _Preempt(TypedDict):
    path: str
    source: str
    by: str
    why: str
    on_visit: NotRequired[bool]


class _Data(TypedDict):
    version: int
    visits: dict[str, _Visit]
    userdata: dict[str, dict[str, Any]]
    markings: NotRequired[dict[str, list[str]]]
    conditions: NotRequired[dict[str, _Condition]]
    raised: NotRequired[dict[str, _Raised]]
    stopped: NotRequired[dict[str, str]]
    goes_on: NotRequired[dict[str, str]]
    preempts: list[_Preempt]
    started_ns: Stamp
    last_ns: Stamp
    outages: list[tuple[Stamp, Stamp]]
    ends: NotRequired[list[tuple[str, Stamp, Stamp, str]]]
    emergency: NotRequired[bool]
    finished: bool
    outcome: str | None


def _moved_places(known: Mapping[str, str], new: Callable[[str], str]) -> dict[str, str]:
    """Return path -> label of a child with other paths; a label moves as its path does."""
    return {
        new(path): label and new(f"{path}/{label}").rpartition("/")[2]
        for path, label in known.items()
    }


def _moved_visits(
    known: Mapping[str, dict[str, Any]], new: Callable[[str], str]
) -> dict[str, dict[str, Any]]:
    """Return visits with other paths."""
    visits = {new(path): {**visit, "in": new(visit["in"])} for path, visit in known.items()}
    # The target of an operator's jump is a label, not a path: look it up beside the child.
    for path, visit in known.items():
        outcome, label, *more = (visit.get("asked") or {}).get("override") or (None, None)
        if label is not None:
            label = new(f"{visit['in']}/{label}").rpartition("/")[2]
            asked = {**visit["asked"], "override": [outcome, label, *more]}
            if "goes_on" in asked:
                asked["goes_on"] = _moved_places(asked["goes_on"], new)
            visits[new(path)]["asked"] = asked
    return visits


class Position:
    """The facts from which a run can be resumed, as plain JSON.

    Attributes:
        data: A dict with these keys:

            visits: path -> visit of each state that is running, or that has ended and whose outcome
                has not been followed yet. A visit has: in (path of its container); since_ns (begin
                of the attempt), begun_ns (begin of the visit; both are moved by an outage during
                which time stops), entered_ns (the same, never moved); attempt; outcome (None while
                it runs); number (index of the iterator's item); once (key -> encoded value);
                goal, or None: action, id, sent_ns, taken_ns, begun_ns, status, text, result,
                preempted (it ended after its state was asked to stop) and stopped (the end of a
                process has cancelled it); asked, if an operator asked it to stop: source, by, why
                and override, and maybe goes_on as below, for the time after its end. A container
                may also have requests, triples of source, by and why that asked it to stop, and
                served, those after which it began another child: a served request concerns no
                later child. recalled: the requests that it has withdrawn.
                met: it has met others at a barrier.
                halted_ns: since when its timeouts stand still, if they do.
                The visit of a clean-up has ending: the fields of the `Ending` after which it runs.
                The visit of a plan's action may also have: stopping (a transition has asked it to
                stop) and again (it begins once more after that).
            markings: path of a running plan -> ids of the places that hold tokens
            conditions: as in entries
            raised: path of a clean-up that runs after an exception -> visits and markings of the
                states that were active; once it is over they are active again, so that a resumed
                run goes on with the state that had raised
            stopped: path of a machine that was asked to stop and has ended -> label of the child in
                which it was
            goes_on: path of a machine that an event of modes has left, or of one below it -> label
                of the child in which its next run begins, or ""
            userdata: path of a container -> key -> encoded value
            preempts: path, source, by and why of the newest requests; on_visit: it is also in the
                visit of the container (not in journals of old versions)
            started_ns, last_ns: stamps of the first and the newest entry
            outages: pairs [from, to] of stamps
            ends: path, begin and end [ns] and outcome of the newest visits of the root's children
                that have ended
            emergency: an emergency stop holds the machine
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
        # Path -> the paths one level below that have a visit or a marking, or something below them.
        # So the end of a branch does not look at all that run beside it.
        self._below: dict[str, dict[str, None]] = {}
        for path in (*self.visits, *self.markings):
            self._link(path)

    def check(self) -> None:
        """Check all facts: a file may come from a stranger.

        Raises:
            DataError: a fact is missing, or is of another type, with its place.
        """
        checked(_Data, self.data, known_only=True)
        for path, visit in self._all_visits():
            container = visit.get("in")
            if not isinstance(container, str):
                raise DataError(container, "a path", f".visits.{path}.in")

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

    @property
    def _raised(self) -> dict[str, dict[str, dict[str, Any]]]:
        raised: dict[str, dict[str, dict[str, Any]]] = self.data.get("raised", {})
        return raised

    def _all_visits(self) -> list[tuple[str, dict[str, Any]]]:
        """Return path and visit of all states, also of those that have raised."""
        return [
            each
            for visits in (self.visits, *(kept["visits"] for kept in self._raised.values()))
            for each in visits.items()
        ]

    def to_bytes(self) -> bytes:
        """Return the position as a snapshot."""
        return json.dumps({**self.data, "version": VERSION}, separators=(",", ":")).encode()

    def digests(self) -> set[str]:
        """Return the digests of the large values that it names."""
        values = [value for container in self.userdata.values() for value in container.values()]
        for _, visit in self._all_visits():
            values += visit["once"].values()
            values.append((visit["goal"] or {}).get("result"))
        found = (value.get("$blob") for value in values if isinstance(value, dict))
        return {digest for digest in found if digest is not None}

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

        preempts = [{**one, "path": new(one["path"])} for one in self.data["preempts"]]
        moved = {
            facts: {new(path): values for path, values in getattr(self, facts).items()}
            for facts in ("userdata", "markings", "conditions")
        }
        for kind in ("stopped", "goes_on"):
            if kind in self.data:
                moved[kind] = _moved_places(self.data[kind], new)
        if self._raised:
            moved["raised"] = {
                new(path): {
                    "visits": _moved_visits(kept["visits"], new),
                    "markings": {new(at): ids for at, ids in kept["markings"].items()},
                }
                for path, kept in self._raised.items()
            }
        visits = _moved_visits(self.visits, new)
        return Position({**self.data, "visits": visits, "preempts": preempts, **moved})

    # -- one function for each kind ------------------------------------------------------------

    def _end_below(self, path: str) -> None:
        """Drop the visits and markings below a state that has ended or begins anew."""
        left = [*self._below.pop(path, ())]
        while left:
            each = left.pop()
            self.visits.pop(each, None)
            self.markings.pop(each, None)
            left += self._below.pop(each, ())
        self.markings.pop(path, None)
        for each in [each for each in self._raised if each.startswith(f"{path}/")]:
            del self._raised[each]

    def _keep_raised(self, cleanup: str, container: str) -> None:
        """Keep what is active in a container whose clean-up begins, for the time after that."""
        known = self._raised.get(cleanup)  # kept when it began; it begins again after a pause
        inside = f"{container}/"
        kept = known or {
            "visits": {path: one for path, one in self.visits.items() if path.startswith(inside)},
            "markings": {
                path: places
                for path, places in self.markings.items()
                if path == container or path.startswith(inside)
            },
        }
        self._end_below(container)
        self.data.setdefault("raised", {})[cleanup] = kept

    def _on_cleaned_up(self, entry: Mapping[str, Any]) -> None:
        path = entry["path"]
        kept = self._raised.pop(path, {"visits": {}, "markings": {}})
        self._end_below(path)
        if path in self.visits:
            self._drop(path)
        self.visits.update(kept["visits"])
        self.markings.update(kept["markings"])
        for each in (*kept["visits"], *kept["markings"]):
            self._link(each)

    def _link(self, path: str) -> None:
        """Note a path below those above it."""
        while path:
            parent = path.rpartition("/")[0]
            beside = self._below.setdefault(parent, {})
            if path in beside:
                break
            beside[path] = None
            path = parent

    def _drop(self, path: str) -> None:
        """Drop the visit of a state."""
        del self.visits[path]
        if not self._below.get(path):
            self._below.get(path.rpartition("/")[0], {}).pop(path, None)

    def _serve(self, container: str) -> None:
        visit = self.visits.get(container)
        if visit is not None and visit.get("requests"):
            visit["served"] = [*visit.get("served", []), *visit.pop("requests")][-MAX_REQUESTS:]

    def _begin(self, path: str, container: str, stamp_ns: int, number: int | None = None) -> None:
        self._link(path)
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
            known = self.visits.get(path)
            # The child before has served what it was asked. Not if the child was chosen before the
            # request: this entry then only has changes.
            if known is None or known["outcome"] is not None:
                self._serve(container)
            if "ending" in entry and entry["ending"][0] is None:
                self._keep_raised(path, container)
            else:
                self._end_below(container)
        self._end_below(path)
        self._begin(path, container, entry["stamp_ns"], entry.get("number"))
        if "ending" in entry:
            self.visits[path]["ending"] = entry["ending"]

    def _on_left(self, entry: Mapping[str, Any]) -> None:
        path, following = entry["path"], entry.get("next")
        visit = self.visits[path]
        self._keep_end(path, visit, entry)
        self._end_below(path)
        self._keep_places(entry)
        if entry.get("served"):
            self._serve(visit["in"])
        if visit.get("stopping"):
            self._drop(path)
            if visit.get("again"):
                self._begin(path, visit["in"], entry["stamp_ns"])
        elif following is None:  # not followed yet: a resumed run enters the child for its outcome
            visit.update(outcome=entry["outcome"], goal=None, once={})
        else:
            self._drop(path)
            self._begin(following, visit["in"], entry["stamp_ns"])

    def _keep_places(self, entry: Mapping[str, Any]) -> None:
        """Keep where the next runs of a machine that has ended begin, and of those below it."""
        inside = f"{entry['path']}/"
        for kind in ("stopped", "goes_on"):
            known = self.data.setdefault(kind, {}) if kind in entry else self.data.get(kind, {})
            for each in [each for each in known if f"{each}/".startswith(inside)]:
                del known[each]
            known.update(entry.get(kind, {}))

    def _keep_end(self, path: str, visit: Mapping[str, Any], entry: Mapping[str, Any]) -> None:
        """Keep the end of a child of the root, for lists and viewers."""
        container = self.visits.get(visit["in"])
        if container is not None and container["in"] == "":
            began = visit.get("entered_ns", visit["since_ns"])  # not in journals of old versions
            ends = self.data.setdefault("ends", [])
            ends.append([path, began, entry["stamp_ns"], entry["outcome"]])
            del ends[:-MAX_ENDS]

    def _on_retried(self, entry: Mapping[str, Any]) -> None:
        self._end_below(entry["path"])
        visit = self.visits[entry["path"]]
        visit.update(since_ns=entry["at_ns"], attempt=entry["attempt"] + 1, goal=None)
        for name in ("requests", "served", "recalled", "halted_ns", "met"):
            visit.pop(name, None)

    def _on_goal_sent(self, entry: Mapping[str, Any]) -> None:
        self.visits[entry["path"]]["goal"] = {
            "action": entry["action"],
            "id": entry["goal_id"],
            "sent_ns": entry["stamp_ns"],
            "taken_ns": None,
            "begun_ns": None,
            "status": None,
            "text": "",
            "result": None,
            "preempted": False,
            "stopped": False,
        }

    def _on_goal_taken(self, entry: Mapping[str, Any]) -> None:
        goal, stamp_ns = self.visits[entry["path"]]["goal"], entry["stamp_ns"]
        if goal["taken_ns"] is None:
            goal["taken_ns"] = stamp_ns
        if entry.get("begun", True):  # journals of old versions do not say
            goal["begun_ns"] = stamp_ns

    def _on_goal_done(self, entry: Mapping[str, Any]) -> None:
        goal = self.visits[entry["path"]]["goal"]
        goal.update(status=entry["status"], text=entry["text"], result=entry["result"])
        goal["preempted"] = entry.get("preempted", False)

    def _on_once(self, entry: Mapping[str, Any]) -> None:
        self.visits[entry["path"]]["once"][entry["key"]] = entry["value"]

    def _on_met(self, entry: Mapping[str, Any]) -> None:
        for path in entry["paths"]:
            self.visits[path]["met"] = True

    def _on_fired(self, entry: Mapping[str, Any]) -> None:
        self._link(entry["path"])
        self.markings[entry["path"]] = entry["marking"]
        for path in entry["ends"]:
            visit = self.visits.get(path)
            if visit is not None and visit["outcome"] is None:
                visit["stopping"] = True
                visit.pop("again", None)
            elif visit is not None:
                self._drop(path)
        for path in entry["begins"]:
            visit = self.visits.get(path)
            # One run of an action at a time: it begins once the one that is stopping has ended.
            if visit is not None and visit.get("stopping"):
                visit["again"] = True
            else:
                self._end_below(path)
                self._begin(path, entry["path"], entry["stamp_ns"])

    def _on_noted(self, entry: Mapping[str, Any]) -> None:
        if "stopped" in entry:
            self._keep_places(entry)

    def _on_preempt(self, entry: Mapping[str, Any]) -> None:
        request = {name: entry[name] for name in ("path", "source", "by", "why")}
        if "override" in entry:
            visit = self.visits.get(entry["path"])
            if visit is not None:  # it may have ended meanwhile
                before = visit.get("asked") or {}
                # Each is outcome, label, and maybe whether only if it stopped.
                earlier, later = (
                    given and Override(*given)
                    for given in (before.get("override"), entry["override"])
                )
                chosen = choice_after(earlier, later, asked=bool(before))
                left = entry.get("goes_on") or before.get("goes_on")
                kept = {"goes_on": left} if left else {}
                visit["asked"] = {**request, "override": chosen and list(chosen), **kept}
            return
        visit = self.visits.get(entry["path"])
        if visit is not None:
            origin = [request["source"], request["by"], request["why"]]
            visit["requests"] = [*visit.get("requests", []), origin][-MAX_REQUESTS:]
        if entry.get("passed"):
            return
        preempts = self.data["preempts"]
        preempts.append({**request, "on_visit": visit is not None})
        del preempts[:-MAX_REQUESTS]
        if entry["source"] in OF_PROCESS:
            for visit in self.visits.values():
                if visit["goal"] is not None:
                    visit["goal"]["stopped"] = True

    def _on_recalled(self, entry: Mapping[str, Any]) -> None:
        visit = self.visits[entry["path"]]
        visit.pop("asked", None)
        visit.pop("requests", None)
        visit["recalled"] = [*visit.get("recalled", []), *entry["origins"]][-MAX_REQUESTS:]

    def _on_halted(self, entry: Mapping[str, Any]) -> None:
        self.visits[entry["path"]]["halted_ns"] = entry["stamp_ns"]

    def _on_went_on(self, entry: Mapping[str, Any]) -> None:
        self._go_on(self.visits[entry["path"]], entry["stamp_ns"])

    def _go_on(self, visit: dict[str, Any], stamp_ns: int) -> None:
        """Let the timeouts of a visit go on that an operator had stopped, if one had."""
        halted_ns = visit.pop("halted_ns", None)
        if halted_ns is not None:
            visit["since_ns"] += max(0, stamp_ns - halted_ns)

    def _on_recovered(self, entry: Mapping[str, Any]) -> None:
        stamp_ns = entry["stamp_ns"]
        gone_ns = entry.get("gone_ns", stamp_ns)  # not in journals of old versions
        # The clock may have been put back during the outage: stamps never exceed its time.
        last_ns = self.data["last_ns"] = min(self.data["last_ns"], stamp_ns)
        self.data["outages"].append([max(last_ns, stamp_ns - gone_ns), stamp_ns])
        for _, visit in self._all_visits():
            self._go_on(visit, stamp_ns - gone_ns)  # the operator's pause has ended with its run
            visit["begun_ns"] = visit.get("begun_ns", visit["since_ns"]) + entry["shift_ns"]
            visit["since_ns"] += entry["shift_ns"]
            goal = visit["goal"]
            for at in ("taken_ns", "begun_ns"):
                if goal is not None and goal.get(at) is not None:
                    goal[at] += entry["shift_ns"]
        for known in self.conditions.values():
            known["events"] = [[name, at + entry["shift_ns"]] for name, at in known["events"]]

    def _on_stopped(self, _entry: Mapping[str, Any]) -> None:
        self.data["emergency"] = True

    def _on_released(self, _entry: Mapping[str, Any]) -> None:
        self.data.pop("emergency", None)

    def _on_finished(self, entry: Mapping[str, Any]) -> None:
        self.visits.clear()
        self.markings.clear()
        self._raised.clear()
        self._below.clear()
        self.data.update(finished=True, outcome=entry["outcome"])

    _FOLD: ClassVar[dict[str, Callable[[Position, Mapping[str, Any]], None]]] = {
        "Started": _on_started,
        "Entered": _on_entered,
        "CleanedUp": _on_cleaned_up,
        "Left": _on_left,
        "Retried": _on_retried,
        "GoalSent": _on_goal_sent,
        "GoalTaken": _on_goal_taken,
        "GoalDone": _on_goal_done,
        "Once": _on_once,
        "Met": _on_met,
        "Fired": _on_fired,
        "Noted": _on_noted,
        "PreemptRequested": _on_preempt,
        "Recalled": _on_recalled,
        "Halted": _on_halted,
        "WentOn": _on_went_on,
        "Stopped": _on_stopped,
        "Released": _on_released,
        "Recovered": _on_recovered,
        "Finished": _on_finished,
    }
