"""The current state of a run, folded from the records of its events.

A `RunState` is plain JSON data: it is sent to a viewer that joins in the middle of a run, and
serves as a keyframe of a recording. It keeps counts and the newest facts, not the events. The page
folds the same events in TypeScript (`viz/web/src/core/fold.ts`); both are tested on the
same fixtures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NotRequired, TypedDict

# The types are also read while the program runs, by what checks data from the network.
from actionlib_core.inputs.checked_data import Count, Number, Stamp  # noqa: TC001
from smachpy.events import resource_text

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

RAISED = "exception"
"""The outcome shown for a state that raised."""

_NOT_ASKED = {"preempt": None, "asked": None, "serviced": None, "abandoned": None}

_OF_QUESTION = ("text", "answers", "words", "default", "patience", "service", "has_picture")

_OF_VISIT = ("note", "question", "marking", "fired", "held", "resource")

CUT_SHORT = "a new run began before it ended"
"""Text of a LOST goal whose run was cut short."""

NOT_RECORDED = "its end was not recorded"
"""Text of a LOST goal that ended during an outage."""

ENDED_GOALS = 20
"""Number of ended goals that are kept."""


def paths_above(paths: Iterable[str]) -> set[str]:
    """Return the paths of all that contains one of `paths`, whether it is among them or not."""
    above: set[str] = set()
    for path in paths:
        while (path := path.rpartition("/")[0]) and path not in above:
            above.add(path)
    return above


def innermost(paths: Collection[str]) -> list[str]:
    """Return the paths that contain no other one of `paths`."""
    above = paths_above(paths)
    return [path for path in paths if path not in above]


class PreemptFacts(TypedDict):
    """Who asked a state to stop: fields of `PreemptRequested`; None in older recordings."""

    source: str | None
    by: str | None
    why: str | None
    grace: float | None


class QuestionFacts(TypedDict):
    """A question: fields of `QuestionAsked`, when it was asked, and the answer.

    `answer`, `by` and `answered`, the time, are None until there is one; an empty `by` means that
    nobody answered in time.
    """

    text: str
    answers: list[str]
    words: list[str]
    default: str
    patience: float
    service: str
    has_picture: bool
    asked: Stamp
    answer: str | None
    by: str | None
    answered: Stamp | None


class StateFacts(TypedDict):
    """What is known of one state.

    visits: number of visits. since: when the running visit began, None while there is none. left:
    when it last ended. outcome: of the newest visit that ended. outcomes: outcome -> count.
    seconds: in finished visits. preempt: when the running visit was asked to stop, asked: by whom,
    serviced: when it serviced the request, abandoned: when its grace was over; all None until then.
    attempt: of the visit, from 1. item: number of an iterator's item, from 0. waits: the reason of
    a pause before it. note, question: of the newest visit. resource: which one it holds or waits
    for, in words. Of a plan that has fired since it was entered: marking, ids of the places that
    hold tokens (one with two tokens is in it twice); fired, id of the newest transition; held,
    while it waits: id of a transition -> why its guard is false.
    """

    visits: Count
    since: Stamp | None
    outcome: str | None
    outcomes: dict[str, Count]
    seconds: Number
    left: NotRequired[Stamp]
    error: NotRequired[str | None]
    preempt: NotRequired[Stamp | None]
    asked: NotRequired[PreemptFacts | None]
    serviced: NotRequired[Stamp | None]
    abandoned: NotRequired[Stamp | None]
    attempt: NotRequired[Count]
    item: NotRequired[Count]
    waits: NotRequired[str | None]
    note: NotRequired[str]
    resource: NotRequired[str]
    question: NotRequired[QuestionFacts]
    marking: NotRequired[list[str]]
    fired: NotRequired[str]
    held: NotRequired[dict[str, str]]


class ProgressFacts(TypedDict):
    """The progress of a goal: `smachpy_viz.model.progress.Progress`."""

    fraction: Number | None
    distance: Number | None
    text: str


class GoalFacts(TypedDict):
    """What is known of one goal; `attempt` is that of the visit that sent it."""

    path: str
    action: str
    since: Stamp
    goal: Any
    feedback: Any
    first_feedback: Any
    status: str
    text: str
    result: Any
    ended: Stamp | None
    attempt: NotRequired[Count]
    progress: NotRequired[ProgressFacts]


class WrittenFacts(TypedDict):
    """The newest value of a key of userdata, who wrote it, and when."""

    key: str
    value: Any
    writer: str
    at: Stamp
    container: str


class RunFacts(TypedDict):
    """The facts of a run; times are nanoseconds since the Unix epoch.

    run: number of runs so far. started, ended, outcome: of the newest run. states: by path. goals:
    by goal id. userdata: by "container key". outages: times in which no process ran it, absent if
    there were none. dropped: number of missing events, by which counts are too low; absent if 0.
    """

    run: Count
    started: Stamp | None
    ended: Stamp | None
    outcome: str | None
    states: dict[str, StateFacts]
    goals: dict[str, GoalFacts]
    userdata: dict[str, WrittenFacts]
    outages: NotRequired[list[tuple[Stamp, Stamp]]]
    dropped: NotRequired[Count]


class RunState:
    """Folds records (`smachpy.events.to_record`) into one state.

    Attributes:
        data: The facts, of the form of `RunFacts`.

    Threads: not thread-safe.
    """

    def __init__(self, data: dict[str, Any] | None = None) -> None:
        self.data: dict[str, Any] = data or {
            "run": 0,
            "started": None,
            "ended": None,
            "outcome": None,
            "states": {},
            "goals": {},
            "userdata": {},
        }
        self._fold: dict[str, Callable[[dict[str, Any]], None]] = {
            "Started": self._on_started,
            "Recovered": self._on_recovered,
            "Finished": self._on_finished,
            "Entered": self._on_entered,
            "Left": lambda record: self._leave(record, record["outcome"]),
            "Failed": self._on_failed,
            "PreemptRequested": self._on_preempt,
            "PreemptServiced": lambda r: self._on_answer(r, "serviced"),
            "Abandoned": lambda r: self._on_answer(r, "abandoned"),
            "Retried": lambda r: self._set(r, attempt=r["attempt"] + 1),
            "Fired": self._on_fired,
            "HeldBack": self._on_held_back,
            "Iterated": lambda r: self._set(r, item=r["number"]),
            "ResourceUse": self._on_resource,
            "Noted": lambda r: self._set(r, note=r["text"]),
            "Paused": lambda r: self._set(r, waits=r["reason"]),
            "Resumed": lambda r: self._set(r, waits=None),
            "UserdataWritten": self._on_userdata,
            "QuestionAsked": self._on_question,
            "QuestionAnswered": self._on_question_answered,
            "GoalSent": self._on_goal_sent,
            "GoalFeedback": self._on_feedback,
            "GoalDone": self._on_goal_done,
        }

    def fold(self, record: dict[str, Any]) -> None:
        """Apply one record; kinds that change nothing are ignored."""
        if "dropped" in record:
            self.data["dropped"] = self.data.get("dropped", 0) + record["dropped"]
        fold = self._fold.get(record["kind"])
        if fold is not None:
            fold(record)

    def active(self) -> list[str]:
        """Return the paths of the running states."""
        states = self.data["states"]
        return [path for path, state in states.items() if state["since"] is not None]

    def _state(self, path: str) -> dict[str, Any]:
        states: dict[str, dict[str, Any]] = self.data["states"]
        if path not in states:
            states[path] = {
                "visits": 0,
                "since": None,
                "outcome": None,
                "outcomes": {},
                "seconds": 0.0,
            }
        return states[path]

    def _set(self, record: dict[str, Any], **facts: Any) -> None:
        self._state(record["path"]).update(facts)

    def _on_started(self, record: dict[str, Any]) -> None:
        self.data["run"] += 1
        self.data.update(started=record["stamp_ns"], ended=None, outcome=None)
        self.data.pop("outages", None)
        # States and goals of an earlier run of this root that are still open were cut short: no
        # event will end them.
        root, below = record["path"], f"{record['path']}/"
        for path, state in self.data["states"].items():
            if path == root or path.startswith(below):
                state.update(since=None, waits=None, **_NOT_ASKED)
        for goal in self.data["goals"].values():
            # A late GoalDone corrects it.
            if goal["ended"] is None and goal["path"].startswith(below):
                goal.update(status="LOST", text=CUT_SHORT, ended=record["stamp_ns"])
        self._on_entered(record)

    def _on_recovered(self, record: dict[str, Any]) -> None:
        """Keep the states that are active in the resumed run, and end all others.

        How the others ended was not recorded.
        """
        known, stamp = self.data["started"] is not None, record["stamp_ns"]
        if not known:
            self.data.update(run=self.data["run"] + 1, started=record["began_ns"])
        self.data.update(ended=None, outcome=None, outages=list(map(list, record["outages"])))
        active = dict(record["active"])
        for path, state in self.data["states"].items():
            if state["since"] is not None and path not in active:
                state.update(since=None, left=stamp, waits=None, **_NOT_ASKED)
        for path, since in active.items():
            state = self._state(path)
            # The process that ended has preempted its states and recorded that as their end, but in
            # the mission they are still active.
            if state["since"] is None and state.get("left", -1) >= since:
                _reopen(state, since)
            elif state["since"] is None:
                state["visits"] += 1
                state.update(attempt=1)
            first = since if state["since"] is None else state["since"]
            state.update(since=first, waits=None, error=None, **_NOT_ASKED)
        for goal in self.data["goals"].values():
            if goal["ended"] is None and goal["path"] not in active:
                goal.update(status="LOST", text=NOT_RECORDED, ended=stamp)

    def _on_finished(self, record: dict[str, Any]) -> None:
        outcome = record["outcome"] or RAISED
        self._leave(record, outcome)
        self.data.update(ended=record["stamp_ns"], outcome=outcome)

    def _on_entered(self, record: dict[str, Any]) -> None:
        state = self._state(record["path"])
        state["visits"] += 1
        for fact in _OF_VISIT:
            state.pop(fact, None)
        state.update(since=record["stamp_ns"], waits=None, error=None, attempt=1, **_NOT_ASKED)

    def _on_failed(self, record: dict[str, Any]) -> None:
        self._leave(record, RAISED)
        self._set(record, error=record["error"])

    def _leave(self, record: dict[str, Any], outcome: str) -> None:
        state = self._state(record["path"])
        state.pop("held", None)
        state.pop("resource", None)
        if state["since"] is not None:
            state["seconds"] += (record["stamp_ns"] - state["since"]) / 1e9
        state.update(since=None, left=record["stamp_ns"], outcome=outcome, waits=None, **_NOT_ASKED)
        state["outcomes"][outcome] = state["outcomes"].get(outcome, 0) + 1

    def _on_preempt(self, record: dict[str, Any]) -> None:
        # The first request counts: it has the first cause, and the grace runs from it.
        state = self._state(record["path"])
        if state["since"] is not None and not state.get("preempt"):
            asked = {name: record.get(name) for name in ("source", "by", "why", "grace")}
            state.update(preempt=record["stamp_ns"], asked=asked)

    def _on_answer(self, record: dict[str, Any], fact: str) -> None:
        state = self._state(record["path"])
        if state.get("preempt"):
            state[fact] = record["stamp_ns"]

    def holding_up(self) -> list[str]:
        """Return the paths of the leaves that were asked to stop and are still running."""
        # A container waits for its children, so only the innermost ones delay the preempt.
        return innermost(
            [
                path
                for path, state in self.data["states"].items()
                if state["since"] is not None and state.get("preempt")
            ]
        )

    def _on_fired(self, record: dict[str, Any]) -> None:
        self._set(record, marking=list(record["marking"]), fired=record["transition"])
        self._state(record["path"]).pop("held", None)

    def _on_held_back(self, record: dict[str, Any]) -> None:
        guards = [f"{guard} is false" for guard in record["guards"]]
        truths = record.get("truths") or guards  # older recordings have none
        pairs = zip(record["transitions"], truths, guards, strict=False)
        self._set(record, held={number: truth or guard for number, truth, guard in pairs})

    def _on_resource(self, record: dict[str, Any]) -> None:
        if record["status"] == "free":
            self._state(record["path"]).pop("resource", None)
            return
        text = resource_text(record["status"], record["resource"], record["holder"])
        self._set(record, resource=text)

    def _on_question(self, record: dict[str, Any]) -> None:
        question = {name: record[name] for name in _OF_QUESTION}
        question.update(asked=record["stamp_ns"], answer=None, by=None, answered=None)
        self._set(record, question=question)

    def _on_question_answered(self, record: dict[str, Any]) -> None:
        question = self._state(record["path"]).get("question")
        if question is not None:
            question.update(answer=record["answer"], by=record["by"], answered=record["stamp_ns"])

    def questions(self) -> dict[str, dict[str, Any]]:
        """Return path -> question of the questions without an answer, the oldest first."""
        found = [
            (path, state["question"])
            for path, state in self.data["states"].items()
            if state["since"] is not None
            and state.get("question") is not None
            and state["question"]["answered"] is None
        ]
        return dict(sorted(found, key=lambda one: (one[1]["asked"], one[0])))

    def _on_userdata(self, record: dict[str, Any]) -> None:
        # A state writes to the userdata of the container above it.
        container = record["path"].rpartition("/")[0] or record["path"]
        userdata, name = self.data["userdata"], f"{container} {record['key']}"
        userdata.pop(name, None)  # so that the newest write is the last item
        userdata[name] = {
            "key": record["key"],
            "value": record["value"],
            "writer": record["path"],
            "at": record["stamp_ns"],
            "container": container,
        }

    def _on_goal_sent(self, record: dict[str, Any]) -> None:
        goals = self.data["goals"]
        goals[record["goal_id"]] = {
            "path": record["path"],
            "action": record["action"],
            "since": record["stamp_ns"],
            "goal": record["goal"],
            "feedback": None,
            "first_feedback": None,
            "status": "ACTIVE",
            "text": "",
            "result": None,
            "ended": None,
            "attempt": self._state(record["path"]).get("attempt", 1),
        }
        # Bounded, as a mission may send goals for weeks; running goals are always kept.
        ended = [goal_id for goal_id, goal in goals.items() if goal["ended"] is not None]
        ended.sort(key=lambda goal_id: (goals[goal_id]["since"], goal_id))
        for goal_id in ended[:-ENDED_GOALS]:
            del goals[goal_id]

    def _on_feedback(self, record: dict[str, Any]) -> None:
        goal = self.data["goals"].get(record["goal_id"])
        if goal is not None:
            goal["feedback"] = record["feedback"]
            if "progress" in record:  # added by a viewer that understands the feedback
                goal["progress"] = record["progress"]
            if goal["first_feedback"] is None:
                goal["first_feedback"] = record["feedback"]

    def _on_goal_done(self, record: dict[str, Any]) -> None:
        goal = self.data["goals"].get(record["goal_id"])
        if goal is not None:
            goal.update(
                status=record["status"],
                text=record["text"],
                result=record["result"],
                ended=record["stamp_ns"],
            )


def _reopen(state: dict[str, Any], since: int) -> None:
    """Undo the last end of a state, which has not really ended."""
    state["seconds"] = max(0.0, state["seconds"] - (state["left"] - since) / 1e9)
    outcome, outcomes = state["outcome"], state["outcomes"]
    # Without an outcome it was an outage that ended the visit, and nothing was counted.
    if outcome in outcomes:
        outcomes[outcome] -= 1
        if outcomes[outcome] <= 0:
            del outcomes[outcome]
    state["outcome"] = next(reversed(outcomes), None)
