"""One run of an exploration: doubles that choose, a clock that chooses, and what they chose."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from smachpy._runtime.asker import asking
from smachpy.container import Container
from smachpy.events import Entered, Failed, Iterated, Left, Retried
from smachpy.introspection import describe
from smachpy.testing._core.search import Choice
from smachpy.testing._core.values import Values
from smachpy.testing.doubles import Double, Places
from smachpy.testing.runs import find_path

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence

    from actionlib_core.clock import Timer, VirtualClock
    from smachpy.events import Event
    from smachpy.introspection import StateRecord
    from smachpy.state import State

PREEMPTED = "preempted"
STEP_S = 1.0  # how long a stand-in takes, unless it outlasts others
WITHIN = 0.9  # of what is left of its timeout: how long one goes on to outlast others
TURN = "turn"

PREEMPT = "is preempted"
HANGS = "never finishes"
RAISES = "raises"
DEAF = "ignores a preempt"
RAISED = "raised by the test"
LATE = "{} as a preempt comes"
OUTLASTS = "outlasts the others"
RAISES_ONE = "raises {}"
STAYS = "is left alone"
ASKED = "runs as a preempt comes"


class Options(NamedTuple):
    """What is explored.

    Attributes:
        faults: Of "hang", "raise", "deaf".
        preempts: Preempts per run, at most.
        interleavings: Whether the order of tasks that can go on is chosen, and which of the
            leaves that run at once ends next.
        most_steps: Leaves per run, at most.
        writes: Path of a leaf -> userdata that it writes.
        merges: Whether situations are compared.
    """

    faults: frozenset[str] = frozenset()
    preempts: int = 1
    interleavings: bool = True
    most_steps: int = 200
    writes: Mapping[str, Mapping[str, Any]] = {}
    merges: bool = True


class Explorer:
    """Makes and notes the choices of one run after the other.

    Args:
        root: The machine.
        options: What is explored.

    Attributes:
        clock: The run's clock; set for each run.
        doubles: Paths of the leaves that are stood in for.
        served: Paths of those whose servers choose when a preempt comes.
        choices: What was chosen in the run, in order.
        too_long: It had too many leaves.
        mismatch: Why it could not go on as told.
        not_raised: Names of the exceptions that should be raised and cannot be made.
    """

    def __init__(self, root: Container, options: Options) -> None:
        self._root = root
        record = describe(root)
        self._parallel = {s.path for s in record.walk() if s.kind == "concurrence"}
        # How long these have been active makes no difference.
        self._timeless = {
            s.path for s in record.walk() if s.is_container and "timeout" not in dict(s.details)
        }
        self._leaves = {s.path for s in record.walk() if not s.is_container}
        raised = dict(_raised_in(root, record.path)) if "raise" in options.faults else {}
        kinds = {kind: _can_be_made(kind) for of in raised.values() for kind in of.values()}
        self.not_raised = tuple(sorted({kind.__name__ for kind, can in kinds.items() if not can}))
        self._raised = {
            path: {text: kind for text, kind in of.items() if kinds[kind]}
            for path, of in raised.items()
        }
        self._root_path = record.path
        self._options = options
        # Longer than all the leaves of a run one after the other.
        self._long_s = (options.most_steps + 1) * STEP_S
        self.clock: VirtualClock | None = None
        self.doubles: set[str] = set()
        self.served: set[str] = set()
        self._bounded: set[str] = set()
        self._told: Sequence[int | str] = ()
        self._values = Values()
        self.begin(())

    def begin(self, told: Sequence[int | str]) -> None:
        """Forget the last run; the next one begins with these choices, as indices or texts."""
        self._told = told
        self.choices: list[Choice] = []
        self.too_long = False
        self.mismatch = ""
        self._visits: dict[str, int] = {}
        self._steps = 0
        self._past: list[tuple[str, int]] = []
        self._preempts = self._options.preempts
        self._active: dict[str, float] = {}
        self._ended: dict[str, str] = {}
        self._items: dict[str, int] = {}
        self._attempts: dict[str, int] = {}
        self._hanging: set[str] = set()
        self._outlasting: set[str] = set()  # since a leaf ended last
        self._outlasted: list[tuple[float, float]] = []
        self._asked: Timer | None = None

    def end(self) -> None:
        """Call off what the run that has ended left behind."""
        if self._asked is not None:
            self._asked.cancel()

    def now(self) -> float:
        """Return the time on the run's clock [s]."""
        return 0.0 if self.clock is None else self.clock.now()

    def outlasted_s(self, since: float) -> float:
        """Return for how long, from `since` on, leaves ran only to outlast others [s]."""
        total = 0.0
        for begin, end in sorted(self._outlasted):
            total += max(0.0, end - max(begin, since))
            since = max(since, end)
        return total

    def choose(self, where: str, options: Sequence[str], situation: Hashable = None) -> int:
        """Choose, as told or the first, and note it.

        What is chosen in no situation, as by a server, belongs to all situations after it.
        """
        number = len(self.choices)
        picked = 0
        if number < len(self._told):
            picked = self._follow(self._told[number], where, options)
        self.choices.append(Choice(where, tuple(options), picked, situation))
        if situation is None and self._options.merges:
            self._past.append((where, picked))
        return picked

    def _follow(self, told: int | str, where: str, options: Sequence[str]) -> int:
        """Return the index of what was told; note it if there is none: the clock asks, too."""
        texts = [f"{where}: {option}" for option in options]
        index = texts.index(told) if told in texts else told
        if isinstance(index, int) and index < len(options):
            return index
        self.mismatch = self.mismatch or (
            f"replay: choice {len(self.choices)}: got {told!r}; expected one of {texts}. Has the "
            "machine changed, or does it depend on something outside?"
        )
        return 0

    def turn(self, names: list[str]) -> int:
        """Choose who goes on; for `VirtualClock(choose=...)`."""
        if not self._options.interleavings or len(set(names)) == 1:
            return 0
        return self.choose(TURN, names, self._situation((TURN, *sorted(names))))

    def on_event(self, event: Event) -> None:
        """Keep up with where the run is."""
        if isinstance(event, Entered):
            self._active[event.path] = event.t
            self._attempts.pop(event.path, None)
            self._forget_ends(event.path)
            if event.path in self._leaves:
                self._begins(event.path)
        elif isinstance(event, Left | Failed):
            self._active.pop(event.path, None)
            self._hanging.discard(event.path)
            # Not only the kind: an error from deeper down has it in its text.
            left = event.outcome if isinstance(event, Left) else f"raised {event.error}"
            self._ended[event.path] = left
            if event.path in self._leaves:
                self._outlasting.clear()  # another one may be the next to end
        elif isinstance(event, Retried):
            self._attempts[event.path] = event.attempt
            self._forget_ends(event.path)
        elif isinstance(event, Iterated):
            self._items[event.path] = event[3]  # tuples have an `index` of their own

    def _forget_ends(self, path: str) -> None:
        """Forget how what is in a container ended: it begins again."""
        inside = path + "/"
        for ended in [ended for ended in self._ended if ended.startswith(inside)]:
            del self._ended[ended]

    def _begins(self, path: str) -> None:
        """Choose whether a preempt comes while a leaf that is kept runs."""
        if path in self.doubles or path in self.served or not self._preempts:
            return
        if self.choose(path, (STAYS, ASKED), self._situation((path, ASKED))):
            self.count_preempt()
            assert self.clock is not None
            self._asked = self.clock.call_later(0.0, self.preempt)  # as soon as it waits

    def _situation(self, about: Hashable) -> Hashable:
        """Return what the rest of the run depends on."""
        if not self._options.merges:
            return None
        now = self.now()
        running = {self._root_path, *self._active}
        active = (
            (path, self._age(path, now - t), self._attempts.get(path, 0))
            for path, t in self._active.items()
        )
        return (
            about,
            self._preempts,
            self._attempts.get(self._root_path, 0),
            tuple(sorted(active)),
            tuple(sorted(self._hanging)),
            tuple(sorted(self._outlasting)),
            tuple(
                sorted(
                    (path, outcome)
                    for path, outcome in self._ended.items()
                    if path.rpartition("/")[0] in running & self._parallel
                )
            ),
            tuple(sorted((p, i) for p, i in self._items.items() if p in running)),
            tuple(self._past),
            _userdata(self._root, self._values),
        )

    def _age(self, path: str, age: float) -> float:
        """Return what an active state's age [s] means to the rest of the run, if anything."""
        if path in self._timeless or path in self._hanging:
            return -1.0
        if age > STEP_S and path in self.doubles - self._bounded:
            return math.inf  # it outlasts others, however long that takes
        return round(age, 6)

    @property
    def may_preempt(self) -> bool:
        """Whether the run may be preempted once more."""
        return self._preempts > 0

    def count_preempt(self) -> None:
        """Note a preempt that is to come."""
        self._preempts -= 1

    def preempt(self) -> None:
        """Preempt the mission."""
        with asking("test"):
            self._root.request_preempt()

    # -- doubles -------------------------------------------------------------------------------

    def stand_in(
        self, places: Places, container: Container, path: str, kept: Callable[[str, State], bool]
    ) -> None:
        """Put doubles that choose in the places of all leaves below `container`."""
        for label, state in list(container.get_children().items()):
            where = f"{path}/{label}"
            if isinstance(state, Container):
                self.stand_in(places, state, where, kept)
            elif not kept(where, state):
                self.doubles.add(where)
                if state.timeout is not None or state.retry is not None:
                    self._bounded.add(where)
                places.exchange(container, label, partial(self._double, path=where))

    def _double(self, state: State, path: str) -> Double:
        def execute(ud: Any) -> str:
            return self._execute(double, path, ud)

        double = Double(state, execute=execute)
        return double

    def _execute(self, double: Double, path: str, ud: Any) -> str:
        outcomes = double.get_registered_outcomes()
        self._attempts[path] = self._attempts.get(path, 0) + 1
        self._steps += 1
        if self._steps > self._options.most_steps:
            self.too_long = True
            self._root.request_preempt()
            return PREEMPTED if PREEMPTED in outcomes else outcomes[0]
        self._visits[path] = self._visits.get(path, -1) + 1
        begun = self.now()
        seconds, picked = STEP_S, OUTLASTS
        while picked == OUTLASTS:
            if self._pass(double, seconds) and PREEMPTED in outcomes:
                double.service_preempt()
                return PREEMPTED
            seconds = self._longer_s(double, path, begun)
            picked = self._pick(double, path, outcomes, may_outlast=seconds > 0)
            if picked == OUTLASTS:
                self._outlasting.add(path)
        for key, value in self._options.writes.get(path, {}).items():
            ud[key] = value
        return self._act(double, path, picked, outcomes)

    def _pass(self, double: Double, seconds: float) -> bool:
        """Let a double's time pass; whether a preempt ended it."""
        if seconds <= STEP_S:
            return double.sleep(seconds)
        assert self.clock is not None
        if self.clock.limit is not None:
            self.clock.limit += seconds  # a long run, but none that never ends
        begin = self.clock.now()
        asked = double.sleep(seconds)
        self._outlasted.append((begin, self.clock.now()))
        return asked

    def _longer_s(self, double: Double, path: str, begun: float) -> float:
        """Return how long a double would go on to outlast the others [s]; 0: it ends now.

        So each of the leaves that run at once may be the next to end. The last of them does: that
        none ends is the business of "hang".
        """
        others = self._active.keys() & self._leaves - self._hanging - self._outlasting - {path}
        if (
            not others
            or not self._options.interleavings
            or path in self._outlasting
            or double.preempt_requested()
        ):
            return 0.0
        if double.timeout is None:
            return self._long_s
        left = (double.timeout - (self.now() - begun)) * WITHIN
        return 0.0 if left <= STEP_S else min(left, self._long_s)

    def _pick(
        self, double: Double, path: str, outcomes: tuple[str, ...], *, may_outlast: bool
    ) -> str:
        plain = [outcome for outcome in outcomes if outcome != PREEMPTED] or list(outcomes)
        first = self._visits[path] % len(plain)  # each is the usual one in turn: loops end
        options = plain[first:] + plain[:first]
        options += [OUTLASTS] if may_outlast else []
        if self._preempts:
            options += [PREEMPT] if PREEMPTED in outcomes else []
            options += [LATE.format(outcome) for outcome in plain]
        faults = self._options.faults
        bounded = double.timeout is not None
        waits = dict(double.describe_details()[1])
        if bounded or "hang" in faults or self._may_wait(double, path, waits):
            options.append(HANGS)
        options += [RAISES, *self._raised.get(path, ())] if "raise" in faults else []
        options += [DEAF] if "deaf" in faults and self._preempts else []
        return options[self.choose(path, options, self._situation((path, *sorted(options))))]

    def _may_wait(self, double: Double, path: str, details: Mapping[str, str]) -> bool:
        """Tell whether it is a watcher beside others: those are called off when the others end."""
        if double.describe_details()[0] not in {"monitor", "condition"} or "checks" in details:
            return False
        parent = path.rpartition("/")[0]
        return any(p.rpartition("/")[0] == parent and p != path for p in self._active)

    def _act(self, double: Double, path: str, picked: str, outcomes: tuple[str, ...]) -> str:
        if picked == RAISES:
            raise RuntimeError(RAISED)
        if picked in self._raised.get(path, ()):
            raise _made(self._raised[path][picked])
        if picked == HANGS:
            if double.timeout is None:
                self._hanging.add(path)
            double.wait_preempt()
            self._hanging.discard(path)
            double.service_preempt()
            return PREEMPTED if PREEMPTED in outcomes else outcomes[0]
        if picked == DEAF:
            self._ask()
            double._clock().event("nothing: it ignores its preempt").wait()  # noqa: SLF001
        if picked == PREEMPT:
            self._ask()
            double.service_preempt()
            return PREEMPTED
        late = [outcome for outcome in outcomes if picked == LATE.format(outcome)]
        if late:
            self._ask()
            return late[0]
        return picked

    def _ask(self) -> None:
        self.count_preempt()
        self.preempt()


def _raised_in(
    container: Container, path: str, around: tuple[type[BaseException], ...] = ()
) -> Iterator[tuple[str, dict[str, type[BaseException]]]]:
    """Yield each leaf below `container`, with the exceptions that it or what is around expects."""
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
    again = () if state.retry is None else state.retry.on
    return (*(state.on_exception or ()), *(kind for kind in again if isinstance(kind, type)))


def _made(kind: type[BaseException]) -> BaseException:
    try:
        return kind(RAISED)
    except Exception:  # noqa: BLE001  it wants other arguments: nobody looks at them
        return kind.__new__(kind, RAISED)


def _can_be_made(kind: type[BaseException]) -> bool:
    try:
        str(_made(kind))
    except Exception:  # noqa: BLE001  whatever it misses
        return False
    return True


def _userdata(container: Container, values: Values) -> Hashable:
    """Return the userdata of a container and of all below it, to be compared."""
    data = container.userdata
    own = tuple((key, values.comparable(data[key])) for key in sorted(data.keys()))
    inner = tuple(
        _userdata(child, values)
        for child in container.get_children().values()
        if isinstance(child, Container)
    )
    return (own, inner)


def kept_by(record: StateRecord, names: Iterable[str]) -> set[str]:
    """Return the paths of the leaves that stay as they are.

    Args:
        record: The machine.
        names: Paths, or ends of paths, which may mean several; a container means all in it.

    Raises:
        UnknownStateError: there is no such state.
    """
    leaves = [state.path for state in record.walk() if not state.is_container]
    kept: set[str] = set()
    for name in names:
        ends = "/" + name.strip("/")
        found = [s.path for s in record.walk() if s.path == name or s.path.endswith(ends)]
        tops = found or [find_path(record, name)]  # which says what there is
        kept.update(leaf for leaf in leaves if any(f"{leaf}/".startswith(f"{t}/") for t in tops))
    return kept
