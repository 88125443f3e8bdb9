"""What the world around a mission did, read from its recording; pure.

Times are those of the mission's clock [s]. What a server did with a goal is aligned to that goal,
or to its cancel; everything else to the run.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from smachpy.events.recording import Recording

FOUND_S: Final = 2.0
"""A server that is found so soon after its client was made was there before [s]."""

LATCHED_S: Final = 0.05
"""A message that a new subscriber gets so soon was published before, and latched [s]."""

TWICE_S: Final = 1.0
"""Two subscribers get the same message within this time [s]."""

_NEWEST: Final = 50  # messages that are compared with one that comes

GROUP_S: Final = 0.05
"""Requests to stop with one origin within this time are one request, passed on [s]."""

_FROM_OUTSIDE: Final = frozenset({"signal", "shutdown", "operator", "program", "test"})
"""Origins of requests to stop that the run does not make itself."""

AnswerKind = Literal["accept", "feedback", "end"]
ActKind = Literal["message", "asked", "server", "answer", "preempt", "resume", "step"]


@dataclass(frozen=True, slots=True)
class Answer:
    """One thing that a server did with a goal.

    Attributes:
        what: Accepted it, sent feedback, ended it.
        after: How long after the goal, or after its cancel [s].
        of_cancel: It came after the cancel.
        value: The message as in the recording, or None.
        state: Name of the goal's last status.
        text: Its status text.
    """

    what: AnswerKind
    after: float
    of_cancel: bool = False
    value: Any = None
    state: str = ""
    text: str = ""


@dataclass(slots=True)
class RecordedGoal:
    """A goal of the run, and what became of it.

    Attributes:
        id: Its id.
        t: When it was sent.
        value: The goal, as in the recording.
        answers: In order.
        cancelled: When it was cancelled [s after it was sent]; None: it was not.
        ended: When it ended; None: it did not.
    """

    id: str
    t: float
    value: Any
    answers: list[Answer] = field(default_factory=list)
    cancelled: float | None = None
    ended: float | None = None

    @property
    def end(self) -> Answer | None:
        """How it ended."""
        return next((one for one in self.answers if one.what == "end"), None)


@dataclass(slots=True)
class RecordedAction:
    """An action that the mission called.

    Attributes:
        type: Its type.
        goals: In the order in which they were sent.
        is_there: Its server is there when the run begins.
        is_own: The mission offers it itself.
    """

    type: str
    goals: list[RecordedGoal] = field(default_factory=list)
    is_there: bool = True
    is_own: bool = False


@dataclass(slots=True)
class RecordedCall:
    """A call of a service.

    Attributes:
        t: When.
        request: As in the recording.
        after: When the answer came [s after the request]; None: it did not.
        response: As in the recording, or None.
        state: Name of the error's class, or "".
        text: Text of the handler's exception.
    """

    t: float
    request: Any
    after: float | None = None
    response: Any = None
    state: str = ""
    text: str = ""


@dataclass(slots=True)
class RecordedService:
    """A service that the mission called.

    Attributes:
        type: Its type.
        calls: In order.
        is_own: The mission offers it itself.
        absent: The times in which there was no server.
    """

    type: str
    calls: list[RecordedCall] = field(default_factory=list)
    is_own: bool = False
    absent: list[tuple[float, float]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Act:
    """Something that the world did at some time of the run.

    Attributes:
        t: When.
        what: "message": on topic `name`; "asked": a request to the mission's service `name`;
            "server": the server of action `name` came (`state` "up"), died ("down"), or was cut off
            ("cut"); "answer": of an operator, `text`, to the question of the state `name`;
            "preempt": the state `name` was asked to stop by `state`, `text`, for the reason
            `value`; "resume", "step": of an operator.
        name: See above.
        type: Type of the topic or service.
        value: The message, as in the recording.
        state, text: See above.
        subscribers: How many subscribers the topic had had until then.
    """

    t: float
    what: ActKind
    name: str = ""
    type: str = ""
    value: Any = None
    state: str = ""
    text: str = ""
    subscribers: int = 0


@dataclass(slots=True)
class World:
    """What the world did during a run.

    Attributes:
        began: When the run began.
        ended: When it ended, or the recording.
        is_complete: The recording has the run's end.
        actions: Full name -> action.
        services: Full name -> service.
        topics: Full name -> whether its messages are latched.
        own: Topic on which the mission publishes -> how many subscribers it had had when each of
            these messages was published.
        acts: Everything else, in order.
        pauses: Numbers, in `first_run`, of the events after which an operator paused it.
        breakpoints: Paths of states before which it stopped.
        once: Path of a state and key -> what its calls of `smachpy.once` returned, as recorded.
        lacks: What the recording does not say, in words.
    """

    began: float
    ended: float
    is_complete: bool
    actions: dict[str, RecordedAction] = field(default_factory=dict)
    services: dict[str, RecordedService] = field(default_factory=dict)
    topics: dict[str, bool] = field(default_factory=dict)
    own: dict[str, list[int]] = field(default_factory=dict)
    acts: list[Act] = field(default_factory=list)
    pauses: set[int] = field(default_factory=set)
    breakpoints: set[str] = field(default_factory=set)
    once: dict[tuple[str, str], list[Any]] = field(default_factory=dict)
    lacks: list[str] = field(default_factory=list)


def first_run(events: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the events of the first run in a recording, up to an outage of its process.

    Feedback is left out: what is recorded of it was only shown, and does not come again.
    """
    found: list[dict[str, Any]] = []
    root = ""
    for event in events:
        kind, path = event["kind"], event["path"]
        if not root:
            if kind == "Recovered":
                return []
            if kind != "Started":
                continue
            root = path
        elif kind == "Recovered" or event.get("dropped"):
            break
        if kind != "GoalFeedback":
            found.append(dict(event))
        if kind == "Finished" and path == root:
            break
    return found


def world_of(recording: Recording) -> World:
    """Return what the world did during the first run of a recording."""
    events = first_run(recording.events)
    timed = [event for event in events if isinstance(event.get("t"), float | int)]
    began = timed[0]["t"] if timed else 0.0
    ended = timed[-1]["t"] if timed else 0.0
    is_complete = bool(events) and events[-1]["kind"] == "Finished"
    world = World(began, ended, is_complete)
    _add_lacks(world, recording, events)
    inputs = [one for one in recording.inputs if not is_complete or one["t"] <= ended]
    _add_goals(world, inputs)
    _add_servers(world, inputs)
    _add_services(world, inputs)
    _add_messages(world, inputs)
    _add_commands(world, events)
    for one in inputs:
        if one["what"] == "once":
            world.once.setdefault((one["name"], one["key"]), []).append(one.get("value"))
    world.acts.sort(key=lambda act: act.t)
    return world


def _add_lacks(world: World, recording: Recording, events: list[dict[str, Any]]) -> None:
    lacks = world.lacks
    if not events:
        lacks.append("it does not begin with the run")
    elif not world.is_complete:
        lacks.append(
            f"the run is recorded up to {world.ended - world.began:.1f} s{_why_not_more(recording)}"
        )
    if recording.origin is None:
        lacks.append(
            "it has no inputs: it was made by an older version, or with --record-inputs none"
        )
    for one in recording.inputs:
        if one["what"] == "lost":
            lacks.append(f"{one.get('key')} inputs are missing: too many came at once")
    if recording.wrong:
        lacks.append(f"{len(recording.wrong)} record(s) are left out: {recording.wrong[0]}")
    large = Counter(one["name"] for one in recording.inputs if is_outline(one.get("value")))
    for name, count in large.items():
        lacks.append(
            f"{count} message(s) of {name} are there as hash only; try --record-inputs all"
        )
    hidden = Counter(one["name"] for one in recording.inputs if one.get("hidden"))
    lacks += [f"{count} message(s) of {name} had secrets" for name, count in hidden.items()]


def _why_not_more(recording: Recording) -> str:
    """Return why a run is not recorded to its end, as the end of a sentence."""
    for event in recording.events:
        if event["kind"] == "Recovered":
            return ", when its process ended"
        if event.get("dropped"):
            return f", where {event['dropped']} events are missing"
    return ", where the file is cut off" if recording.cut else ""


def is_outline(value: Any) -> bool:
    """Return whether a recorded value is only the hash and summary of a large one."""
    return isinstance(value, dict) and "$hash" in value


# -- goals and servers -----------------------------------------------------------------------------


def _add_goals(world: World, inputs: list[dict[str, Any]]) -> None:
    goals: dict[str, RecordedGoal] = {}
    accepted: set[str] = set()
    for one in inputs:
        what, key = one["what"], one.get("key", "")
        if what == "client":
            world.actions.setdefault(one["name"], RecordedAction(one["type"]))
        elif what == "goal":
            goals[key] = goal = RecordedGoal(key, one["t"], one.get("value"))
            world.actions.setdefault(one["name"], RecordedAction(one["type"])).goals.append(goal)
        elif key in goals:
            _add_answer(goals[key], one, accepted)


def _add_answer(goal: RecordedGoal, one: dict[str, Any], accepted: set[str]) -> None:
    what, state = one["what"], one.get("state", "")
    after = one["t"] - goal.t
    if what == "cancel":
        goal.cancelled = after if goal.cancelled is None else goal.cancelled
        return
    of_cancel = goal.cancelled is not None
    since = after - goal.cancelled if goal.cancelled is not None else after
    if what == "status" and state in {"ACTIVE", "PREEMPTING"} and goal.id not in accepted:
        accepted.add(goal.id)
        goal.answers.append(Answer("accept", since, of_cancel))
    elif what == "feedback":
        goal.answers.append(Answer("feedback", since, of_cancel, one.get("value")))
    elif what == "end" and goal.ended is None:
        goal.ended = one["t"]
        text = one.get("text", "")
        goal.answers.append(Answer("end", since, of_cancel, one.get("value"), state, text))


def _add_servers(world: World, inputs: list[dict[str, Any]]) -> None:
    made: dict[str, float] = {}
    sessions: dict[str, str] = {}  # of the clients
    there: defaultdict[str, set[str]] = defaultdict(set)
    sent: set[str] = set()  # goals until now: the next one may be sent when the server dies
    for one in inputs:
        what, name, t = one["what"], one.get("name", ""), one["t"]
        if what == "goal":
            sent.add(one.get("key", ""))
        elif what == "client" and name not in made:
            made[name] = t
            sessions[name] = one.get("key", "")
            world.actions[name].is_there = False
        elif what == "server" and one.get("key") == sessions.get(name):
            world.actions[name].is_own = True  # the mission will offer it again
        elif what == "server" and name in made:
            first = not there[name]
            there[name].add(one.get("key", ""))
            is_new = not any(act.what == "server" and act.name == name for act in world.acts)
            if first and is_new and t - made[name] < FOUND_S:
                world.actions[name].is_there = True
            elif first and not (is_new and world.actions[name].is_there):
                world.acts.append(Act(t, "server", name, state="up"))
        elif what == "gone" and one.get("key", "") in there[name]:
            there[name].discard(one.get("key", ""))
            if not there[name]:
                survived = any(
                    goal.id in sent
                    and (end := goal.end)
                    and end.state != "LOST"
                    and (goal.ended or t) > t
                    for goal in world.actions[name].goals
                )
                world.acts.append(Act(t, "server", name, state="cut" if survived else "down"))


# -- services --------------------------------------------------------------------------------------


def _add_services(world: World, inputs: list[dict[str, Any]]) -> None:
    calls: dict[str, RecordedCall] = {}
    for one in inputs:
        what, key = one["what"], one.get("key", "")
        if what == "request":
            calls[key] = call = RecordedCall(one["t"], one.get("value"))
            service = world.services.setdefault(one["name"], RecordedService(one["type"]))
            service.calls.append(call)
        elif what == "response" and key in calls:
            call = calls[key]
            call.after = one["t"] - call.t
            call.response = one.get("value")
            call.state, call.text = one.get("state", ""), one.get("text", "")
            if call.state == "ServiceUnavailableError":
                world.services[one["name"]].absent.append((call.t, one["t"]))
        elif what == "absent":
            service = world.services.setdefault(one["name"], RecordedService(one["type"]))
            service.absent.append((one["t"] - _seconds(one["text"]), one["t"]))
        elif what == "own":
            world.services[one["name"]].is_own = True
        elif what == "asked" and "/questions/q" not in one["name"]:  # see `_add_commands`
            act = Act(one["t"], "asked", one["name"], one["type"], one.get("value"))
            world.acts.append(act)
    own = {name for name, service in world.services.items() if service.is_own}
    world.acts = [act for act in world.acts if not (act.what == "asked" and act.name in own)]


def _seconds(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


# -- topics ----------------------------------------------------------------------------------------


def _add_messages(world: World, inputs: list[dict[str, Any]]) -> None:
    made: dict[str, float] = {}  # subscriber -> when
    heard: defaultdict[str, int] = defaultdict(int)  # subscriber -> number of its messages
    joined: Counter[str] = Counter()  # topic -> number of its subscribers so far
    born: dict[str, int] = {}  # subscriber -> number of its record
    # Topic -> messages: when, value, subscribers, number of the record.
    newest: dict[str, list[tuple[float, Any, set[str], int]]] = defaultdict(list)
    own: defaultdict[str, list[tuple[float, Any]]] = defaultdict(list)  # what the mission published
    for number, one in enumerate(inputs):
        what, key = one["what"], one.get("key", "")
        if what == "subscriber":
            made[key], born[key] = one["t"], number
            joined[one["name"]] += 1
        elif what == "published":
            own[one["name"]].append((one["t"], one.get("value")))
            world.own.setdefault(one["name"], []).append(joined[one["name"]])
        elif what == "message":
            heard[key] += 1
            name, value, t = one["name"], one.get("value"), one["t"]
            world.topics.setdefault(name, False)
            if is_outline(value) or any(
                sent == value and 0.0 <= t - at < TWICE_S for at, sent in own[name][-_NEWEST:]
            ):
                continue
            known = newest[name]
            is_first = heard[key] == 1 and t - made.get(key, t - 1.0) < LATCHED_S
            if is_first and known and known[-1][1] == value and t - known[-1][0] > LATCHED_S:
                world.topics[name] = True
                known[-1][2].add(key)
                continue
            same = next(  # which the subscriber has got, too: it was there, or it was latched
                (
                    m
                    for m in reversed(known[-_NEWEST:])
                    if t - m[0] < TWICE_S
                    and m[1] == value
                    and key not in m[2]
                    and (is_first or m[3] > born.get(key, -1))
                ),
                None,
            )
            if same is not None:
                same[2].add(key)
                continue
            known.append((t, value, {key}, number))
            world.acts.append(Act(t, "message", name, one["type"], value, subscribers=joined[name]))


# -- operators and signals -------------------------------------------------------------------------


def _add_commands(world: World, events: list[dict[str, Any]]) -> None:
    for number, event in enumerate(events):
        kind, path, t = event["kind"], event["path"], event.get("t", 0.0)
        if kind == "PreemptRequested" and event["source"] in _FROM_OUTSIDE:
            if not _is_passed_on(events, number):
                act = Act(t, "preempt", path, "", event["why"], event["source"], event["by"])
                world.acts.append(act)
        elif kind == "QuestionAnswered" and event["by"]:
            if not event["by"].startswith(("the topic ", "the service ")):
                act = Act(t, "answer", path, "", event["by"], text=event["answer"])
                world.acts.append(act)
        elif kind == "Paused" and event["reason"] == "breakpoint":
            world.breakpoints.add(path)
        elif kind == "Paused" and event["reason"] == "pause":
            world.pauses.add(number - 1)
        elif kind == "Resumed":
            steps = any(
                later["kind"] == "Paused" and later["reason"] == "step"
                for later in events[number + 1 :]
            )
            world.acts.append(Act(t, "step" if steps else "resume"))


def _is_passed_on(events: list[dict[str, Any]], number: int) -> bool:
    """Return whether a request to stop comes from one to a container above."""
    event = events[number]
    origin = [event[key] for key in ("source", "by", "why")]
    for before in reversed(events[:number]):
        if event["t"] - before["t"] > GROUP_S:
            return False
        if (
            before["kind"] == "PreemptRequested"
            and [before[key] for key in ("source", "by", "why")] == origin
        ):
            return True
    return False
