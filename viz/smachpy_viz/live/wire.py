"""The data between the page's server and its pages, as types.

The page has the same types in TypeScript, made from these by `viz/web/wire_types.py`; a test
compares them. Times are nanoseconds since the Unix epoch unless a unit is given.
"""

from __future__ import annotations

from typing import Any, Literal, NotRequired, TypeAlias, TypedDict

from smachpy.events.outcome_classes import OutcomeClass
from smachpy.events.reading import Observation
from smachpy.events.run_state import RunFacts
from smachpy.network.reading import CheckProblem, ControlState
from smachpy_viz.model.machine import Node
from smachpy_viz.model.why import Cause
from smachpy_viz.runs.good_runs import GoodRuns
from smachpy_viz.runs.notes import RunNote

EventRecord: TypeAlias = dict[str, Any]
"""An event: `kind`, the fields of its kind in `smachpy.events`, `seq`; after a gap `dropped`."""


class FieldProblem(TypedDict):
    """A problem with a value of a goal; `path` of its field, "" for the whole goal."""

    path: str
    text: str


class Failure(TypedDict):
    """The answer of any route that refuses or fails."""

    ok: Literal[False]
    text: str
    wants_token: bool
    problems: list[FieldProblem]


class Done(TypedDict):
    """The answer of a command."""

    ok: Literal[True]
    text: str


# -- the stream of events -------------------------------------------------------------------------


class Settings(TypedDict):
    """The first message of a stream.

    follow: pages follow the active states from the start. control: commands are accepted, with the
    token. beat: longest time between two beats [s]. kept: events of a live machine that the server
    keeps. home: pages begin with the list of runs. reproduces: recorded runs can be reproduced.
    """

    follow: bool
    control: bool
    beat: float
    kept: int
    home: bool
    reproduces: bool


class MachineFacts(TypedDict):
    """What the server knows of a machine besides its events (`smachpy_viz.live.machines.Machine`).

    stale: when its program disappeared. behind: how far its clock is behind the server's. before,
    after: names of the machines that show its previous and its next program. refused: number of its
    messages that were wrong and left out; refusal: what was wrong with the newest one. noted:
    number of changes of its notes; after another one, pages read them again.
    """

    name: str
    label: str
    epoch: str
    revision: int
    stale: int | None
    control: ControlState | None
    recorded: bool
    node: str
    behind: int | None
    before: str | None
    after: str | None
    refused: int
    refusal: str
    noted: int


class MachineSummary(MachineFacts):
    """A machine in the list; `questions`: number of open ones."""

    active: list[str]
    started: int | None
    ended: int | None
    outcome: str | None
    questions: int


class Snapshot(MachineFacts):
    """Everything about a run: the state before the events, and these."""

    seq: int
    problems: list[CheckProblem]
    base: RunFacts
    events: list[EventRecord]


class MachineChanges(TypedDict):
    """The summaries that have changed, in the first message all, and the names that are gone."""

    machines: list[MachineSummary]
    gone: list[str]


class Gap(TypedDict):
    """A snapshot came because the page was too far behind: so many events are only in its base."""

    name: str
    missed: int


class NewEvents(TypedDict):
    """New events of a machine; `seq` of the last one."""

    name: str
    epoch: str
    seq: int
    events: list[EventRecord]


class NewObservations(TypedDict):
    """New data of the topics of a machine's robots."""

    name: str
    records: list[Observation]


# -- machines -------------------------------------------------------------------------------------


class StateKeys(TypedDict):
    """The userdata keys of a state; `remapping`: pairs of its own name and its container's."""

    inputs: list[str]
    outputs: list[str]
    remapping: list[tuple[str, str]]


class MachineModel(TypedDict):
    """A machine to draw, without and with its implicit transitions; `keys` by path."""

    explicit: Node
    implicit: Node
    keys: dict[str, StateKeys]


class RevisedModel(MachineModel):
    """The model of a machine as it is now."""

    revision: int


class StateStatistics(TypedDict):
    """Of recorded runs: the visits of a state; durations [s]."""

    visits: int
    outcomes: dict[str, int]
    median: float | None
    p95: float | None
    total: float
    failures: int
    retries: int


class RunStatistics(TypedDict):
    """Of recorded runs of a machine; durations [s]."""

    runs: int
    outcomes: dict[str, int]
    median: float | None
    p95: float | None
    states: dict[str, StateStatistics]


class WhyAnswer(TypedDict):
    """The causes of a run's end (`smachpy_viz.model.why.Explanation`), also as text."""

    label: str
    outcome: str | None
    began: int | None
    ended: int | None
    steps: list[Cause]
    text: str


class Difference(TypedDict):
    """A state in which two machines differ."""

    path: str
    change: Literal["added", "removed", "changed", "numbers"]
    text: str


class Comparison(TypedDict("_With", {"with": str})):
    """A machine and another one, `with`, in one drawing."""

    model: MachineModel
    listed: list[Difference]
    runs: list[int]


# -- runs -----------------------------------------------------------------------------------------

StripPiece: TypeAlias = tuple[
    int, str, float, float | None, OutcomeClass | Literal["active", "waiting"]
]
"""Row, label of the state, begin and end [s since the run began; null: still running], class;
"waiting" while it asks a person."""


class MissionFacts(TypedDict):
    """A durable mission; `can`: the commands that it accepts now."""

    id: str
    journal: str
    status: Literal["queued", "running", "interrupted", "ended", "cancelled"]
    active: list[str]
    problem: str
    can: list[Literal["resume", "cancel"]]


class RunRow(TypedDict):
    """A run in the list.

    id: for `/api/open`. name: the machine that shows it, null for a file that is not open. robots:
    the namespaces of its actions. last: its newest event. reason: the first cause of a failure, or
    the running state. problem: why its file cannot be read. file: "" for none. outages: [s since
    the run began]. run: id of a durable mission's run, or "". asks: a question is open. stamp: the
    beginning by the mission's own time, which may be virtual.
    """

    id: str
    name: str | None
    machine: str
    robots: list[str]
    live: bool
    began: int | None
    ended: int | None
    last: int | None
    outcome: str | None
    reason: str
    problem: str
    file: str
    strip: list[StripPiece]
    outages: list[tuple[float, float]]
    run: str
    asks: bool
    stamp: int | None
    mission: MissionFacts | None


class JournalPlace(TypedDict):
    """A store of durable missions."""

    name: str
    problem: str


class RunList(TypedDict):
    """Live and past runs."""

    runs: list[RunRow]
    folders: list[str]
    journals: list[JournalPlace]


class FleetRow(RunRow):
    """A live run with the data for the common map."""

    observed: list[Observation]
    events: list[EventRecord]


class FleetPage(TypedDict):
    """Some of the live runs: those after `skip` of `total`."""

    rows: list[FleetRow]
    skip: int
    total: int


class BatchRow(TypedDict):
    """A batch of simulated runs (`smachpy_viz.live.simulations.Batch`)."""

    id: str
    mission: str
    runs: int
    vary: list[str]
    seed: int
    limit: str
    compare: str
    began_ns: int
    outcomes: dict[str, int]
    failed: int
    first_failure: str
    running: bool
    problem: str
    report: bool


class SimulationList(TypedDict):
    """The missions that may be simulated, name -> description, and the batches, newest first."""

    missions: dict[str, str]
    batches: list[BatchRow]


class Opened(TypedDict):
    """The machine that shows a run."""

    ok: Literal[True]
    name: str


class BatchStarted(TypedDict):
    """The batch that was started."""

    ok: Literal[True]
    batch: str


class RunDifference(TypedDict):
    """Where a reproduced run first differs (`smachpy.reproduce.compare.Difference`); times in s."""

    number: int
    at: float
    path: str
    before: list[str]
    recorded: str
    now: str
    recorded_next: list[str]
    now_next: list[str]
    later: float


class Found(TypedDict):
    """What a reproduction has found (`smachpy_viz.live.reproductions.Found`)."""

    kind: Literal["same", "differs", "failed", "test"]
    text: list[str]
    same: int
    events: int
    difference: RunDifference | None
    changed: list[str]
    notes: list[str]
    machine: str
    test: str
    file: str


class Reproduction(TypedDict):
    """A reproduction; `found` is null while it runs, and where there is a problem."""

    running: bool
    problem: str
    found: Found | None


class ReproductionStarted(TypedDict):
    """The reproduction that was started."""

    ok: Literal[True]
    id: str


class WholeValue(TypedDict):
    """A userdata value, unabridged."""

    ok: Literal[True]
    text: str


# -- actions --------------------------------------------------------------------------------------


class ActionSeen(TypedDict):
    """An action on the network; `servers`: number of its servers."""

    name: str
    type: str
    node: str
    servers: int


class SentGoal(TypedDict):
    """A goal that was sent from here; `fraction` 0 to 1, `distance` [m]."""

    id: str
    action: str
    type: str
    state: str
    status: str
    text: str
    sent: int
    ended: int | None
    feedback_count: int
    cancelled: bool
    fraction: float | None
    distance: float | None
    feedback: NotRequired[str]
    result: NotRequired[str]


class ServerGoal(TypedDict):
    """A running goal of a server; `sender`: the node in its id, `gone` if that is no client now.

    mission: machine and state that sent it, "" for none that is known.
    """

    id: str
    status: str
    stamp: int
    text: str
    sender: str
    gone: bool
    mission: str


class ActionList(TypedDict):
    """The actions on the network, the names of those without servers, and the newest goals."""

    actions: list[ActionSeen]
    gone: list[str]
    goals: list[SentGoal]


class ArrayLength(TypedDict):
    """The length of an array; null for any."""

    length: int | None


class ConstantChoice(TypedDict):
    """A constant that is meant for a field."""

    name: str
    value: str
    comment: str


class FormField(TypedDict):
    """A field of a goal's form; `least` and `most` of an integer, the last three of a message."""

    name: str
    type: str
    base: str
    comment: str
    array: ArrayLength | None
    choices: list[ConstantChoice]
    kind: Literal["bool", "integer", "float", "string", "time", "message"]
    least: NotRequired[str]
    most: NotRequired[str]
    fields: NotRequired[list[FormField]]
    about: NotRequired[str]
    default: NotRequired[dict[str, Any]]


class GoalForm(TypedDict):
    """The data for a goal's form; numbers in `values` are texts."""

    name: str
    type: str
    about: str
    fields: list[FormField]
    values: dict[str, Any]
    yaml: str


class CheckedGoal(TypedDict):
    """A goal that was read from YAML."""

    ok: Literal[True]
    values: dict[str, Any]
    yaml: str


class GoalAccepted(TypedDict):
    """The id of a goal that was sent."""

    ok: Literal[True]
    goal: str


# -- the routes -----------------------------------------------------------------------------------

ANSWERS: dict[str, Any] = {
    "POST /api/login": Done,
    "GET /api/machines": list[MachineSummary],
    "GET /api/model": RevisedModel,
    "GET /api/statistics": RunStatistics | None,
    "GET /api/why": WhyAnswer,
    "GET /api/compare": Comparison,
    "GET /api/value": WholeValue,
    "GET /api/runs": RunList,
    "GET /api/fleet": FleetPage,
    "GET /api/good": GoodRuns,
    "GET /api/open": Opened,
    "GET /api/simulations": SimulationList,
    "GET /api/reproduction": Reproduction,
    "GET /api/action": GoalForm,
    "GET /api/goals": list[ServerGoal],
    "GET /api/notes": list[RunNote],
    "POST /api/control": Done,
    "POST /api/action": CheckedGoal | GoalAccepted | Done,
    "POST /api/simulate": BatchStarted | Done,
    "POST /api/mission": Done,
    "POST /api/notes": Done,
    "POST /api/reproduce": ReproductionStarted | Done,
}
"""What each route answers, unless it fails; the others answer with files."""

STREAM: dict[str, Any] = {
    "settings": Settings,
    "machines": MachineChanges,
    "snap": Snapshot,
    "gap": Gap,
    "facts": MachineFacts,
    "events": NewEvents,
    "observed": NewObservations,
    "actions": ActionList,
    "beat": int,
}
"""The data of each server-sent event of `/api/events`; a beat is the server's time [ms]."""
