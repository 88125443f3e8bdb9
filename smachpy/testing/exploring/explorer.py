"""Makes the choices of an explored run: for the doubles of leaves, for servers and the clock."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field, fields, is_dataclass
from functools import partial
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING, Any, TypedDict

from actionlib_core.interfaces import get_action
from smachpy.engine.described import walk
from smachpy.engine.preempt import asking
from smachpy.engine.step import time_left_around
from smachpy.events import Entered, Failed, Finished, Iterated, Left, Retried
from smachpy.events.introspection import describe
from smachpy.machines.container import Container
from smachpy.machines.guards import When
from smachpy.machines.state import get_options
from smachpy.testing.doubles import Double, Places
from smachpy.testing.exploring.search import ScheduleChoice
from smachpy.testing.recorder import STEPS
from smachpy.testing.runs import find_path
from smachpy.testing.servers import Reply, ScriptedActionServer
from smachpy.userdata.readonly import writable

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence

    from actionlib_core.clock import Timer
    from smachpy.events import Event
    from smachpy.events.introspection import StateRecord
    from smachpy.machines.state import State
    from smachpy.testing.doubles import Replacement
    from smachpy.testing.servers import ScriptedEnd, Test

PREEMPTED = "preempted"
FAULTS = frozenset({"hang", "raise", "deaf", "kill"})
STEP_S = 1.0  # [s] duration of a server, and the longest of a double, unless it outlasts others
WITHIN_STEP_S = 0.97  # [s] its longest where a timeout is near, so that both end at two moments
STEPS_WITHIN = 10.3  # so many doubles have time, one after the other, within each timeout
SHORTEST_S = 0.001  # [s] doubles do not become faster for a shorter timeout
APART = 0.001  # part added per leaf if there are kills, so that no two end at the same moment
AFTER = 1e-4  # part of a double's duration after which one that outlasts it looks around
WITHIN = 0.9  # a leaf outlasts others for this part of its remaining timeout
LONG_TEXT = 1_000  # characters of the text of a value's part, above which its hash is compared
_OUTSIDE = frozenset({"monitor", "condition", "service"})

# The options of a leaf besides its outcomes.
TURN = "turn"
PREEMPT = "is preempted"
HANGS = "never finishes"
RAISES = "raises"
RAISES_ONE = "raises {}"
DEAF = "ignores a preempt"
LATE = "{} as a preempt comes"
OUTLASTS = "outlasts the others"
STAYS = "is left alone"
ASKED = "runs as a preempt comes"
RAISED = "raised by the test"  # text of the exceptions
ENDS = "no more events"

# The options of a server for a goal.
REPLIES: dict[str, Reply] = {
    "succeeds": Reply(duration=STEP_S),
    "aborts": Reply(status="aborted", duration=STEP_S),
    "rejects": Reply(status="rejected"),
    "accepts late": Reply(duration=STEP_S, accept_after=30.0),
    "dies": Reply(status=None, die_after=STEP_S),
    "dies and comes back": Reply(status=None, die_after=STEP_S, back_after=5.0),
    "loses the result": Reply(duration=STEP_S, lose_result=True),
    "delivers twice": Reply(duration=STEP_S, twice=True),
    "is slow and ignores a cancel": Reply(duration=3 * STEP_S, ignore_cancel=True),
}
# The same, with a preempt of the mission while the goal is active.
PREEMPTED_REPLIES: dict[str, Reply] = {
    "works as a preempt comes": Reply(duration=3 * STEP_S),
    "works as a preempt comes, and ignores the cancel": Reply(
        duration=3 * STEP_S, ignore_cancel=True
    ),
}


class RunOptions(TypedDict, total=False):
    """What the runs of `explore` and `replay` vary, and when a run counts as endless.

    Keys:
        faults: "hang": any leaf may never finish; "raise": may raise a RuntimeError, and the
            exceptions in `on_exception` and `retry` of itself and its containers that can be made
            from a text alone; "deaf": may ignore a preempt. Leaves with a timeout, and watchers
            next to others, may always hang. "kill": each run has a journal, and is repeated with
            a kill of its process before and after each write; another process continues it.
        preempts: The most preempts per run; 1.
        events: The most events of `Modes` that come in a run, while they wait and while their
            missions run; 3. A machine of modes, which never ends, is preempted after them.
        interleavings: Whether to vary which thread continues first, and which leaf outlasts the
            others; True.
        max_steps: The most doubles that run; 200. With more the run counts as endless.
        limit: The longest run [s of its own clock, without the time for outlasting]; an hour. A
            longer one counts as endless.
        steps: The most steps while no time passes, as in `mission(...)`; with more the run counts
            as endless.
        keep: Leaves, or containers with all their leaves, that are not replaced; a name may match
            several. A preempt comes as soon as such a leaf waits.
        writes: Leaf -> userdata that its double writes.
        real_actions: Replace only services, monitors and conditions by doubles. Scripted servers
            do everything to a goal that servers can do: succeed, abort, reject, accept late, die,
            come back, lose the result, deliver twice, ignore a cancel; preempts come while one
            works.
        userdata: Written to the machine's userdata before each run.
        doubles: The doubles of `mission.replace`; each run starts with their complete scripts.
        servers: The servers and topics of the test; each run has them with the same scripts.
    """

    faults: Iterable[str]
    preempts: int
    events: int
    interleavings: bool
    max_steps: int
    limit: float
    steps: int
    keep: Iterable[str]
    writes: Mapping[str, Mapping[str, Any]] | None
    real_actions: bool
    userdata: Mapping[str, Any] | None
    doubles: Iterable[Replacement]
    servers: Iterable[ScriptedEnd]


DEFAULTS: RunOptions = {
    "faults": (),
    "preempts": 1,
    "events": 3,
    "interleavings": True,
    "max_steps": 200,
    "limit": 3600.0,
    "steps": STEPS,
    "keep": (),
    "writes": {},
    "real_actions": False,
    "userdata": {},
    "doubles": (),
    "servers": (),
}


@dataclass(slots=True)
class _Led:
    """The events that end a mode.

    Attributes:
        events: Name -> what triggers it, and what happens a second later, if anything.
        waits: Whether the double is the mode itself, which only waits for them.
    """

    events: dict[str, tuple[Callable[[], object], Callable[[], object] | None]]
    waits: bool


@dataclass(slots=True)
class _Execution:
    """The progress of a double.

    Attributes:
        begun: When it began [s].
        until: When its current time ends or ended [s].
        picked: The last choice.
        picks: The number of choices so far.
        turn: Its place among those that outlast others: the first ends first; 0: it does not.
    """

    begun: float
    until: float
    picked: str = OUTLASTS
    picks: int = 0
    turn: int = 0


@dataclass(slots=True)
class Orders:
    """What timeouts left time for, as pairs of leaves: the first outlasts the second.

    A leaf and itself: it ends by itself.

    Attributes:
        cut: There was no time for that.
        ended: There was.
    """

    cut: set[tuple[str, str]] = field(default_factory=set)
    ended: set[tuple[str, str]] = field(default_factory=set)

    def add(self, others: Orders) -> None:
        """Add those of another run."""
        self.cut |= others.cut
        self.ended |= others.ended


class Explorer:
    """Makes and records the choices of one run after another.

    Args:
        root: The machine; the explorer puts its doubles into it.
        options: All options.
        places: Puts the leaves back at the end.
        merges: Whether a situation that was seen before is not explored again.

    Attributes:
        doubles: Paths of the leaves that the explorer replaced.
        choices: The choices of the run, in order.
        picks: The same choices, by a key with which a run with a kill finds them.
        too_long: Whether too many leaves ran.
        mismatch: Why it could not follow the given choices.
        not_raised: Names of the exceptions that should be raised but cannot be made.
        root_path: Path of the machine.
        orders: Which leaves a timeout left no time in the run.
    """

    def __init__(
        self, root: Container, options: RunOptions, places: Places, *, merges: bool
    ) -> None:
        record = describe(root)
        states = list(record.walk())
        self._root, self.root_path = root, record.path
        self._options = options
        # A plan's next step depends on its marking, not only on the active states.
        self._merges = merges and all(s.net is None for s in states)
        self._parallel = {s.path for s in states if s.kind == "concurrence"}
        # For these the time since they began makes no difference.
        self._timeless = {
            s.path for s in states if s.is_container and "timeout" not in dict(s.details)
        }
        self._leaves = {s.path for s in states if not s.is_container}
        # For these a server chooses the moment of the preempt.
        self._served = {s.path for s in states if options["real_actions"] and s.kind == "action"}
        self._writes = {find_path(record, n): w for n, w in (options["writes"] or {}).items()}
        raised = dict(_raised_in(root, record.path)) if "raise" in options["faults"] else {}
        can = {kind: _can_be_made(kind) for kinds in raised.values() for kind in kinds.values()}
        self.not_raised = tuple(sorted({k.__name__ for k, is_made in can.items() if not is_made}))
        self._raised = {
            path: {text: kind for text, kind in kinds.items() if can[kind]}
            for path, kinds in raised.items()
        }
        # Longer than all leaves of a run together, so that everything else ends first.
        self._long_s = (options["max_steps"] + 1) * STEP_S
        self.doubles: set[str] = set()
        self._led: dict[str, _Led] = {}
        self._bounded: set[str] = set()
        steps_s, self._timed, self._brief = _tempo(root, states, options["max_steps"])
        # After a kill, leaves that end at the same moment may end in another order: avoid ties.
        tie = APART if "kill" in options["faults"] else 0.0
        self._step_s = {
            path: steps_s[path] * (1 + n * tie) for n, path in enumerate(sorted(self._leaves), 1)
        }
        self._after_s = min(self._step_s.values(), default=STEP_S) * AFTER
        # Ages are told apart by this, but not by the moments in which others look around.
        self._grain_s = 1e-6 if tie else self._after_s * 100
        self._kept = _kept_by(record, options["keep"])
        self._replace_leaves(places, root, record.path, self._kept)
        self.choices: list[ScheduleChoice] = []
        self.picks: dict[Hashable, str] = {}
        self.orders = Orders()

    @property
    def turns(self) -> list[ScheduleChoice]:
        """The choices for the turns of threads, in order."""
        return [choice for choice in self.choices if choice.where == TURN]

    # -- the run -------------------------------------------------------------------------------

    def begin(
        self,
        kit: Test,
        prefix: Sequence[int | str],
        *,
        picks: Mapping[Hashable, str] | None = None,
        begins: Callable[[str], int] | None = None,
    ) -> None:
        """Prepare for the next run.

        Args:
            kit: The test in which it runs.
            prefix: Its first choices, as indices or texts.
            picks: All its choices except the turns of threads, which `prefix` has then: the choices
                of a run to follow.
            begins: Counts how often a state has begun. A leaf that is executed again without having
                begun again was interrupted by a kill, and continues. None: there are no kills.
        """
        self._kit, self._clock = kit, kit.clock
        self._prefix = prefix
        self._given = picks
        self._begins = begins
        self._executions: dict[tuple[str, int], _Execution] = {}
        self._running: dict[str, _Execution] = {}
        self._turns = 0
        self.orders = Orders()
        self._replies: dict[str, int] = {}
        self.picks = {}
        self.choices = []
        self.too_long = False
        self.mismatch = ""
        self._visits: dict[str, int] = {}
        self._steps = 0
        self._past: list[tuple[str, int]] = []
        self._preempts = self._options["preempts"]
        self._events = self._options["events"]
        self._active: dict[str, float] = {}
        self._ended: dict[str, str] = {}
        self._items: dict[str, int] = {}
        self._attempts: dict[str, int] = {}
        self._hanging: set[str] = set()
        self._outlasting: set[str] = (
            set()
        )  # those that chose to outlast others since a leaf last ended
        self._outlasted: list[tuple[float, float]] = []
        self._requests: list[Timer] = []
        self._over = False

    def go_on(self, root: Container, places: Places, active: Iterable[str]) -> None:
        """Continue the run in another process.

        Args:
            root: Its machine.
            places: Puts the leaves back at the end.
            active: Paths of the active states.
        """
        going_on = set(active)
        self._root = root
        self._active = {path: t for path, t in self._active.items() if path in going_on}
        self._hanging.clear()
        self._over = False
        self._replace_leaves(places, root, self.root_path, self._kept)  # skips those that are there

    def end(self) -> None:
        """Cancel what was to come later."""
        for request in self._requests:
            request.cancel()

    def outlasted_s(self, since: float) -> float:
        """Return how long leaves ran on only to outlast others, from `since` on [s]."""
        total = 0.0
        for begin, end in sorted(self._outlasted):
            total += max(0.0, end - max(begin, since))
            since = max(since, end)
        return total

    def choose(
        self,
        where: str,
        options: Sequence[str],
        situation: Hashable = None,
        key: Hashable = None,
    ) -> int:
        """Choose the given option or the first, and record it.

        A choice without a situation, such as a server's, is a part of all later situations. A run
        with a kill comes to the same choice at another time, and finds it by its `key`.
        """
        number = len(self.choices)
        picked = 0
        if self._given is not None and where != TURN:
            wanted = self._given.get(key, "")
            picked = list(options).index(wanted) if wanted in options else 0
            number = len(self._prefix)
        elif self._given is not None:
            number = sum(choice.where == TURN for choice in self.choices)
        if number < len(self._prefix):
            given = self._prefix[number]
            texts = [f"{where}: {option}" for option in options]
            index = texts.index(given) if given in texts else given
            if isinstance(index, int) and index < len(options):
                picked = index
            else:  # not raised here: the clock calls this as well
                self.mismatch = self.mismatch or (
                    f"replay: choice {number}: got {given!r}; expected one of {texts}. Has the "
                    "machine changed, or does it depend on something outside?"
                )
        self.choices.append(ScheduleChoice(where, tuple(options), picked, situation))
        if key is not None:
            self.picks[key] = options[picked]
        if situation is None and self._merges:
            self._past.append((where, picked))
        return picked

    def turn(self, names: list[str]) -> int:
        """Choose which thread continues; for `VirtualClock(choose=...)`."""
        if self._over or not self._options["interleavings"] or len(set(names)) == 1:
            return 0
        return self.choose(TURN, names, self._situation((TURN, *sorted(names))))

    def on_event(self, event: Event) -> None:
        """Keep track of the run."""
        if isinstance(event, Entered):
            self._active[event.path] = event.t
            self._attempts.pop(event.path, None)
            self._forget_ends(event.path)
            if event.path in self._leaves:
                self._begin_leaf(event.path)
        elif isinstance(event, Finished) and event.path == self.root_path:
            self._over = True
        elif isinstance(event, Left | Failed):
            self._active.pop(event.path, None)
            self._hanging.discard(event.path)
            # The whole text: it contains the error of an inner state.
            left = event.outcome if isinstance(event, Left) else f"raised {event.error}"
            self._ended[event.path] = left
            if event.path in self._leaves:
                self._outlasting.clear()  # from here on, each of them may again be the next to end
        elif isinstance(event, Retried):
            self._attempts[event.path] = event.attempt
            self._forget_ends(event.path)
        elif isinstance(event, Iterated):
            self._items[event.path] = event[3]  # tuples have an `index` of their own

    def _forget_ends(self, path: str) -> None:
        """Forget the outcomes in a container that starts again."""
        inside = path + "/"
        self._ended = {p: o for p, o in self._ended.items() if not p.startswith(inside)}

    def _begin_leaf(self, path: str) -> None:
        """Choose whether a preempt comes while a kept leaf runs."""
        if path in self.doubles or path in self._served or not self._preempts:
            return
        key = (path, ASKED, 0 if self._begins is None else self._begins(path))
        if self.choose(path, (STAYS, ASKED), self._situation((path, ASKED)), key):
            self._preempts -= 1
            # A timer at the current time fires when every thread waits: so the leaf has started.
            self._requests.append(self._clock.call_later(0.0, self._preempt))

    def _situation(self, about: Hashable) -> Hashable:
        """Return everything that the rest of the run depends on."""
        if not self._merges:
            return None
        now = self._clock.now()
        running = {self.root_path, *self._active}
        parallel = running & self._parallel
        return (
            about,
            self._preempts,
            self._events,
            self._attempts.get(self.root_path, 0),
            frozenset(
                (path, self._age(path, now - t), self._attempts.get(path, 0))
                for path, t in self._active.items()
            ),
            frozenset(self._hanging),
            frozenset(self._outlasting),
            frozenset(e for e in self._ended.items() if e[0].rpartition("/")[0] in parallel),
            frozenset(item for item in self._items.items() if item[0] in running),
            tuple(self._past),
            tuple(end.situation() for end in self._kit.ends),
            _kept_in(self._root),
        )

    def _age(self, path: str, age: float) -> float:
        """Return an active state's age [s] as far as the rest of the run depends on it."""
        if path in self._timeless or path in self._hanging:
            return -1.0
        if age > self._step_s.get(path, STEP_S) and path in self.doubles - self._bounded:
            return math.inf  # it outlasts others, however long that takes
        return float(round(age / self._grain_s))

    def _preempt(self) -> None:
        with asking("test"):
            self._root.request_preempt()

    # -- servers -------------------------------------------------------------------------------

    def serve_actions(self) -> None:
        """Offer every action that the machine uses and the test does not offer.

        Those of action states are offered at once, those of other clients when a client is made.
        """
        kit = self._kit
        names = {kit.node.resolve(end.name) for end in kit.ends}

        def serve(name: str, type_name: str) -> None:
            if kit.node.resolve(name) not in names:
                names.add(kit.node.resolve(name))
                server = ScriptedActionServer(kit, name, get_action(type_name))
                server.choose_by(partial(self._choose_reply, server.name))

        for state in describe(self._root).walk():
            details = dict(state.details)
            if state.kind == "action" and {"action", "type"} <= details.keys():
                serve(details["action"], details["type"])
        kit.node.on_client = serve

    def _choose_reply(self, name: str) -> Reply:
        replies = {**REPLIES, **(PREEMPTED_REPLIES if self._preempts else {})}
        count = self._replies[name] = self._replies.get(name, 0) + 1
        picked = list(replies)[self.choose(f"server {name}", list(replies), key=(name, count))]
        if picked in PREEMPTED_REPLIES:
            self._preempts -= 1
            self._clock.call_later(STEP_S, self._preempt)
        return replies[picked]

    # -- doubles -------------------------------------------------------------------------------

    def _replace_leaves(
        self,
        places: Places,
        container: Container,
        path: str,
        kept: set[str],
        led: _Led | None = None,
    ) -> None:
        real = self._options["real_actions"]
        self._choose_cases(places, container, path, kept)
        for label, state in list(container.get_children().items()):
            where = f"{path}/{label}"
            events, waits = container._smachpy_events(label)
            inner = (
                _Led({text: (act, later) for text, act, later in events}, waits)
                if events or waits
                else led
            )
            if inner is not None:
                self._led[where] = inner
            if isinstance(state, Container):
                self._replace_leaves(places, state, where, kept, inner)
            elif where in kept or isinstance(state, Double):
                continue
            elif not real or state._smachpy_kind in _OUTSIDE:
                self.doubles.add(where)
                options = get_options(state)
                if options.timeout is not None or options.retry is not None:
                    self._bounded.add(where)
                places.exchange(container, label, partial(self._double, path=where))

    def _choose_cases(
        self, places: Places, container: Container, path: str, kept: set[str]
    ) -> None:
        """Make the conditions of transitions choices, except those after states that are kept."""
        guards = getattr(container._smachpy, "guards", None)
        if guards and not self._options["real_actions"]:
            made = {
                label: cases
                if f"{path}/{label}" in kept
                else {
                    outcome: tuple(self._case(f"{path}/{label}", outcome, one) for one in ones)
                    for outcome, ones in cases.items()
                }
                for label, cases in guards.items()
            }
            places.exchange_guards(container, made)

    def _case(self, path: str, outcome: str, case: When) -> When:
        """Return a case whose condition holds or not, as the exploration chooses."""
        what = f"{path} -{outcome}-> if {case.text}"

        def holds(_: Any) -> bool:
            key = (what, 0 if self._begins is None else self._begins(path))
            return bool(self.choose(what, ("no", "yes"), self._situation(what), key))

        holds.__qualname__ = case.text
        return When(holds, case.target)

    def _double(self, state: State, path: str) -> Double:
        def execute(ud: Any) -> str:
            return self._execute(double, path, ud)

        double = Double(state, execute=execute)
        return double

    def _execute(self, double: Double, path: str, ud: Any) -> str:
        try:
            return self._end_of(double, path, ud)
        finally:
            self._running.pop(path, None)

    def _end_of(self, double: Double, path: str, ud: Any) -> str:
        outcomes = double.get_registered_outcomes()
        begun = self._clock.now()
        number = 0 if self._begins is None else self._begins(path)
        execution = self._executions.get((path, number)) if self._begins is not None else None
        seconds = self._step_s[path]
        if execution is not None:
            seconds = max(0.0, execution.until - begun)
        else:
            self._attempts[path] = self._attempts.get(path, 0) + 1
            self._steps += 1
            if self._steps > self._options["max_steps"]:
                self.too_long = path not in self._led  # modes never end by themselves
                self._root.request_preempt()
                return PREEMPTED if PREEMPTED in outcomes else outcomes[0]
            self._visits[path] = self._visits.get(path, -1) + 1
            execution = _Execution(begun, begun + seconds)
            self._executions[path, number] = execution
        self._running[path] = execution
        led = self._led.get(path, _Led({}, waits=False))
        while execution.picked == OUTLASTS or execution.picked in led.events:
            if self._sleep(double, path, execution, seconds) and PREEMPTED in outcomes:
                double.service_preempt()
                return PREEMPTED
            execution.turn = 0
            seconds = self._longer_s(double, path, execution)
            pick = (path, number, execution.picks)
            may_outlast = seconds > 0 and not led.waits
            picked = self._pick(double, path, outcomes, pick, led, may_outlast=may_outlast)
            execution.picked, execution.picks = picked, execution.picks + 1
            if picked in led.events:
                self._trigger(*led.events[picked])
                seconds = self._step_s[path]  # it goes on, unless the event asks it to stop
            execution.until = self._clock.now() + seconds
            if picked == OUTLASTS:
                self._outlasting.add(path)
                self._turns += 1
                execution.turn = self._turns
        picked = execution.picked
        self._note_end(double, path, execution)
        for key, value in self._writes.get(path, {}).items():
            ud[key] = value
        return self._act(double, path, picked, outcomes)

    def _trigger(self, act: Callable[[], object], later: Callable[[], object] | None) -> None:
        self._events -= 1
        act()
        if later is not None:
            self._requests.append(self._clock.call_later(STEP_S, later))

    def _sleep(self, double: Double, path: str, execution: _Execution, seconds: float) -> bool:
        """Wait for a double's duration; return whether a preempt ended it."""
        if execution.turn:
            return self._outlast(double, path, execution)
        left = self._left_s(double, execution)
        asked = double.sleep(seconds)
        if left <= seconds and asked and self._clock.now() >= execution.until - seconds + left:
            self.orders.cut.add((path, path))
        return asked

    def _outlast(self, double: Double, path: str, execution: _Execution) -> bool:
        """Wait until the others have ended, or outlast this one; return whether a preempt ended it.

        Where no timeout is near, that is so after a long time. Otherwise the time must not run out
        meanwhile, so it looks around as soon as each of them ends.
        """
        end, asked = execution.until, False
        while not asked and end - (now := self._clock.now()) > self._after_s / 100:
            until, ends = end, {}
            if path in self._brief:
                ends = self._ends_before(path, execution, now)
                until = max(ends.values(), default=now)
            if until <= now:
                break
            if until > end:
                self._note_late(path, {each for each in ends if ends[each] > end})
            execution.until = min(until, end)
            if self._clock.limit is not None:  # outlasting does not count as an endless run
                self._clock.limit += execution.until - now
            asked = double.sleep(execution.until - now)
            self._outlasted.append((now, self._clock.now()))
        return asked

    def _ends_before(self, path: str, execution: _Execution, now: float) -> dict[str, float]:
        """Return what goes on before it is the turn of a leaf that outlasts others, and how long.

        Whatever is not known (a kept leaf, a pause before a retry) takes one more step.
        """
        unknown = now + self._step_s[path]
        ends = {}
        for other in self._active.keys() & self._leaves - self._hanging - {path}:
            each = self._running.get(other)
            if each is None or each.until < now:
                ends[other] = unknown
            elif each.turn < execution.turn:
                ends[other] = each.until + self._after_s
        for other in self._active.keys() - self._leaves:
            inside = other + "/"
            if not any(each.startswith(inside) for each in self._active):
                ends[other] = unknown
        return ends

    def _longer_s(self, double: Double, path: str, execution: _Execution) -> float:
        """Return how much longer a double would run to outlast the others [s]; 0: it ends now.

        So each of the leaves that run at once may be the next to end. The last one always ends; the
        fault "hang" is for leaves that never do.
        """
        others = self._active.keys() & self._leaves - self._hanging - self._outlasting - {path}
        if (
            not others
            or not self._options["interleavings"]
            or path in self._outlasting
            or double.preempt_requested()
        ):
            return 0.0
        left = self._left_s(double, execution)
        if math.isinf(left):
            return self._long_s
        now = self._clock.now()
        seconds = min(left * WITHIN, self._long_s)
        late = {
            each
            for each in others & self._running.keys()
            if not self._running[each].turn
            and self._running[each].until + self._after_s > now + seconds
        }
        self._note_late(path, late)
        return 0.0 if others == late else seconds

    def _left_s(self, double: Double, execution: _Execution) -> float:
        """Return how long a double has until a timeout of its own or around it passes [s]."""
        timeout = get_options(double).timeout
        own = math.inf if timeout is None else execution.begun + timeout - self._clock.now()
        return min(own if own > 0 else math.inf, time_left_around())

    def _note_late(self, path: str, others: Iterable[str]) -> None:
        """Note leaves that a timeout leaves a double no time to outlast."""
        for each in others:
            if each in self._running and self._running[each].picked != HANGS:
                self.orders.cut.add((path, each))

    def _note_end(self, double: Double, path: str, execution: _Execution) -> None:
        """Note the last choice of a double, and beside which others it ends."""
        if execution.picked != HANGS and not double.preempt_requested():
            self.orders.ended.update((each, path) for each in self._active.keys() & self._leaves)
        elif execution.picked == HANGS and get_options(double).timeout is not None:
            execution.until = self._clock.now() + self._left_s(double, execution)

    def _pick(
        self,
        double: Double,
        path: str,
        outcomes: tuple[str, ...],
        key: Hashable,
        led: _Led,
        *,
        may_outlast: bool,
    ) -> str:
        events = list(led.events) if self._events else []
        if led.waits and not events:
            return ENDS
        plain = [outcome for outcome in outcomes if outcome != PREEMPTED] or list(outcomes)
        if led.waits:
            plain, events = events, []
        # The usual outcome changes with each visit: with a fixed one, a loop would never end.
        first = self._visits[path] % len(plain)
        options = plain[first:] + plain[:first]
        options += [OUTLASTS] if may_outlast else []
        if self._preempts:
            options += [PREEMPT] if PREEMPTED in outcomes else []
            options += [] if led.waits else [LATE.format(outcome) for outcome in plain]
        options += events
        faults = self._options["faults"]
        if led.waits:
            faults = ()
        elif (
            get_options(double).timeout is not None
            or self._may_time_out(path)
            or "hang" in faults
            or self._waits(double, path)
        ):
            options.append(HANGS)
        options += [RAISES, *self._raised.get(path, ())] if "raise" in faults else []
        options += [DEAF] if "deaf" in faults and self._preempts else []
        situation = self._situation((path, *sorted(options)))
        return options[self.choose(path, options, situation, key)]

    def _may_time_out(self, path: str) -> bool:
        """Return whether the timeout of a container ends a leaf that hangs; not after a preempt."""
        is_asked = self._preempts < self._options["preempts"]
        return path in self._timed and not is_asked and math.isfinite(time_left_around())

    def _waits(self, double: Double, path: str) -> bool:
        """Return whether it is a watcher next to others: it waits until they end and preempt it."""
        kind, details = double.describe_details()
        if kind not in {"monitor", "condition"} or "checks" in dict(details):
            return False
        parent = path.rpartition("/")[0]
        return any(p.rpartition("/")[0] == parent and p != path for p in self._active)

    def _act(self, double: Double, path: str, picked: str, outcomes: tuple[str, ...]) -> str:
        if picked == RAISES:
            raise RuntimeError(RAISED)
        if picked in self._raised.get(path, ()):
            raise _made(self._raised[path][picked])
        if picked == HANGS:
            if get_options(double).timeout is None:
                self._hanging.add(path)
            double.wait_preempt()
            self._hanging.discard(path)
            double.service_preempt()
            # After a kill, the state is not asked again for the outcome of a timeout that has
            # passed.
            late = get_options(double).timeout_outcome if self._begins is not None else None
            return PREEMPTED if PREEMPTED in outcomes else late or outcomes[0]
        if picked in outcomes:
            return picked
        self._preempts -= picked != ENDS
        self._preempt()
        if picked == DEAF:
            self._clock.event("nothing: it ignores its preempt").wait()
        if picked in {PREEMPT, ENDS}:
            double.service_preempt()
            return PREEMPTED
        return next(outcome for outcome in outcomes if picked == LATE.format(outcome))


def _tempo(
    root: Container, states: Sequence[StateRecord], max_steps: int
) -> tuple[dict[str, float], set[str], set[str]]:
    """Choose how long doubles take, so that they have time within the timeouts.

    Leaves that may run at once are equally fast, so that they end in the usual order. None is so
    fast that a loop takes half of all steps before its timeout.

    Returns:
        Leaf -> duration of its double [s]; the leaves in a container with a timeout, except in its
        clean-up; those with a timeout, of whatever state, in the group of leaves that may run at
        once.
    """
    limits = {path: get_options(state).timeout for path, state in walk(root, states[0].path)}
    together = {s.path for s in states if s.kind == "concurrence" or s.net is not None}
    loops = {s.path for s in states if _may_loop(s)} if any(limits.values()) else set[str]()
    own, above, group = dict[str, float](), dict[str, float](), dict[str, str]()
    longest = dict[str, float]()  # of the loops
    for leaf in [s.path for s in states if not s.is_container]:
        *around, _ = (path for path in _above(leaf) if path in limits)
        own[leaf] = _bound([limits[leaf]])
        above[leaf] = _bound([limits[path] for path in around])
        name = group[leaf] = next((path for path in around if path in together), leaf)
        for number, path in enumerate(around, 1):
            seconds = _bound([limits[each] for each in around[:number]]) if path in loops else 0.0
            if seconds < math.inf:
                longest[name] = max(longest.get(name, 0.0), seconds)
    nearest = dict.fromkeys(group.values(), math.inf)
    for leaf, name in group.items():
        near = above[leaf] if name == leaf else min(above[leaf], own[leaf])
        nearest[name] = min(nearest[name], near)
    steps_s = {}
    for leaf, name in group.items():
        quick = max(nearest[name] / STEPS_WITHIN, longest.get(name, 0.0) / (max_steps / 2))
        longest_s = WITHIN_STEP_S if math.isfinite(nearest[name]) else STEP_S
        steps_s[leaf] = min(longest_s, quick, own[leaf] / 2, above[leaf] / 2)
    tidy = {f"{s.path}/{s.cleanup}" for s in states if s.cleanup}
    timed = {leaf for leaf in above if math.isfinite(above[leaf]) and not tidy & {*_above(leaf)}}
    return steps_s, timed, {leaf for leaf, name in group.items() if math.isfinite(nearest[name])}


def _above(path: str) -> list[str]:
    """Return the paths of all states from the root down to this one.

    The name of the root may have slashes: there are others before its path then.
    """
    parts = path.split("/")
    return ["/".join(parts[:number]) for number in range(2, len(parts) + 1)]


def _may_loop(state: StateRecord) -> bool:
    """Return whether a container may run a child again."""
    if state.kind not in {"machine", "sequence"}:
        return state.kind in {"iterator", "plan"}
    following = dict[str, set[str]]()
    for each in state.transitions:
        if not each.target_is_outcome:
            following.setdefault(each.source, set()).add(each.target)
    try:
        TopologicalSorter(following).prepare()
    except CycleError:
        return True
    return False


def _bound(timeouts: Iterable[float | None]) -> float:
    """Return the shortest timeout that a double may keep within; infinite if there is none."""
    return min((t for t in timeouts if t is not None and t >= SHORTEST_S), default=math.inf)


def _raised_in(
    container: Container, path: str, around: tuple[type[BaseException], ...] = ()
) -> Iterator[tuple[str, dict[str, type[BaseException]]]]:
    """Yield each leaf below `container`, with the exceptions that it or its containers expect."""
    around += _expected(container)
    for label, state in container.get_children().items():
        where = f"{path}/{label}"
        if isinstance(state, Container):
            yield from _raised_in(state, where, around)
        else:
            kinds = (*_expected(state), *around)
            yield where, {RAISES_ONE.format(k.__name__): k for k in kinds if k is not RuntimeError}


def _expected(state: State) -> tuple[type[BaseException], ...]:
    """Return the exceptions that the options of a state name."""
    options = get_options(state)
    again = () if options.retry is None else options.retry.on
    return (*options.on_exception, *(kind for kind in again if isinstance(kind, type)))


def _made(kind: type[BaseException]) -> BaseException:
    try:
        return kind(RAISED)
    except Exception:  # noqa: BLE001  its __init__ takes other arguments: skip it
        return kind.__new__(kind, RAISED)


def _can_be_made(kind: type[BaseException]) -> bool:
    try:
        str(_made(kind))
    except Exception:  # noqa: BLE001  it lacks what its __init__ would have set
        return False
    return True


def _kept_in(container: Container) -> Hashable:
    """Return what a container and all inner ones keep, in a form that can be compared.

    The userdata, and where the next run begins.
    """
    data = container.userdata
    own = tuple((key, _text(writable(data[key]))) for key in sorted(data.keys()))
    children = container.get_children().values()
    inner = [_kept_in(child) for child in children if isinstance(child, Container)]
    return (own, begins(container), container._smachpy_situation(), *inner)


def begins(container: Container) -> tuple[str, str, str | None]:
    """Return what decides where the next run of a container begins.

    The child in which it goes on, the one in which it was stopped, and its next initial one.
    """
    live = container._smachpy.live
    return live.goes_on, live.stopped_at, getattr(container._smachpy, "next_initial", None)


def _text(value: Any) -> str:
    """Return a text that equal values share: the `repr`, and what that leaves out.

    Fields of dataclasses with `repr=False`, and the middle of long arrays. A value without a `repr`
    counts as different from all others.
    """
    try:
        return _part_text(value, {})
    except RecursionError:  # nested too deeply
        return object.__repr__(value)


def _part_text(value: Any, known: dict[int, tuple[str, Any]]) -> str:
    """Return the text of a part of a value.

    Args:
        value: The part.
        known: Identity of a part -> its text, and the part, as long as whose life its identity is
            its own. Parts may know each other, so that each is looked at once, and a long text is
            replaced by its hash.
    """
    found = known.get(id(value))
    if found is not None:
        return found[0]
    try:
        parts = _parts_of(value, known)
        if parts is None:
            return repr(value)
        text = f"{type(value).__qualname__}({', '.join(parts)})"
    except RecursionError:
        raise
    except Exception:  # noqa: BLE001  the value's own code
        return object.__repr__(value)
    if len(text) > LONG_TEXT:
        text = f"{type(value).__qualname__} {hashlib.sha256(text.encode()).hexdigest()}"
    known[id(value)] = text, value
    return text


def _parts_of(value: Any, known: dict[int, tuple[str, Any]]) -> list[str] | None:
    """Return the texts of the parts of a value; None if it is told by its `repr`."""
    if hasattr(value, "tobytes") and hasattr(value, "dtype"):
        return [str(value.dtype), str(value.shape), str(value.tobytes())]
    is_record = is_dataclass(value) and not isinstance(value, type)
    if not is_record and type(value) not in {list, tuple, dict}:
        return None
    known[id(value)] = f"...{len(known)}", value  # until it has its own
    if is_record:
        return [_part_text(getattr(value, each.name), known) for each in fields(value)]
    if type(value) is dict:
        return [f"{key!r}: {_part_text(each, known)}" for key, each in value.items()]
    return [_part_text(each, known) for each in value]


def _kept_by(record: StateRecord, names: Iterable[str]) -> set[str]:
    """Return the paths of the leaves that are not replaced.

    Args:
        record: The machine.
        names: Paths, or ends of paths, which may match several; a container stands for all its
            leaves.

    Raises:
        UnknownStateError: there is no such state.
    """
    leaves = [state.path for state in record.walk() if not state.is_container]
    kept: set[str] = set()
    for name in names:
        end = "/" + name.strip("/")
        found = [s.path for s in record.walk() if s.path == name or s.path.endswith(end)]
        tops = found or [find_path(record, name)]  # raises, and lists the states
        kept.update(leaf for leaf in leaves if any(f"{leaf}/".startswith(f"{t}/") for t in tops))
    return kept
