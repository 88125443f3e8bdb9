"""One run of an exploration: doubles that choose, a clock that chooses, and what they chose."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from smachpy._runtime.asker import asking
from smachpy.container import Container
from smachpy.events import Entered, Iterated, Left
from smachpy.introspection import describe
from smachpy.testing._core.search import Choice
from smachpy.testing._core.values import Values
from smachpy.testing.doubles import Double, Places

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Hashable, Mapping, Sequence

    from smachpy.events import Event
    from smachpy.state import State

PREEMPTED = "preempted"
STEP_S = 1.0  # how long a stand-in takes
TURN = "turn"

PREEMPT = "is preempted"
HANGS = "never finishes"
RAISES = "raises"
DEAF = "ignores a preempt"
LATE = "{} as a preempt comes"


class Options(NamedTuple):
    """What is explored.

    Attributes:
        faults: Of "hang", "raise", "deaf".
        preempts: Preempts per run, at most.
        interleavings: Whether the order of tasks that can go on is chosen.
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
        now: Time on the run's clock [s]; set for each run.
        choices: What was chosen in the run, in order.
        too_long: It had too many leaves.
        mismatch: Why it could not go on as told.
    """

    def __init__(self, root: Container, options: Options) -> None:
        self._root = root
        record = describe(root)
        self._parallel = {s.path for s in record.walk() if s.kind == "concurrence"}
        # How long these have been active makes no difference.
        self._timeless = {
            s.path for s in record.walk() if s.is_container and "timeout" not in dict(s.details)
        }
        self._root_path = record.path
        self._options = options
        self.now: Callable[[], float] = float
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
        self._preempts = self._options.preempts
        self._active: dict[str, float] = {}
        self._ended: dict[str, str] = {}
        self._items: dict[str, int] = {}
        self._attempts: dict[str, int] = {}
        self._hanging: set[str] = set()

    def choose(self, where: str, options: Sequence[str], situation: Hashable = None) -> int:
        """Choose, as told or the first, and note it."""
        number = len(self.choices)
        picked = 0
        if number < len(self._told):
            picked = self._follow(self._told[number], where, options)
        self.choices.append(Choice(where, tuple(options), picked, situation))
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
            inside = event.path + "/"
            for path in [path for path in self._ended if path.startswith(inside)]:
                del self._ended[path]
        elif isinstance(event, Left):
            self._active.pop(event.path, None)
            self._ended[event.path] = event.outcome
            self._hanging.discard(event.path)
        elif isinstance(event, Iterated):
            self._items[event.path] = event[3]  # tuples have an `index` of their own

    def _situation(self, about: Hashable) -> Hashable:
        """Return what the rest of the run depends on."""
        if not self._options.merges:
            return None
        now = self.now()
        running = {self._root_path, *self._active}
        ageless = self._timeless | self._hanging
        active = (
            (path, -1.0 if path in ageless else round(now - t, 6), self._attempts.get(path, 0))
            for path, t in self._active.items()
        )
        return (
            about,
            self._preempts,
            tuple(sorted(active)),
            tuple(sorted(self._hanging)),
            tuple(
                sorted(
                    (path, outcome)
                    for path, outcome in self._ended.items()
                    if path.rpartition("/")[0] in running & self._parallel
                )
            ),
            tuple(sorted((p, i) for p, i in self._items.items() if p in running)),
            _userdata(self._root, self._values),
        )

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
        if double.sleep(STEP_S) and PREEMPTED in outcomes:
            double.service_preempt()
            return PREEMPTED
        picked = self._pick(double, path, outcomes)
        for key, value in self._options.writes.get(path, {}).items():
            ud[key] = value
        return self._act(double, path, picked, outcomes)

    def _pick(self, double: Double, path: str, outcomes: tuple[str, ...]) -> str:
        plain = [outcome for outcome in outcomes if outcome != PREEMPTED] or list(outcomes)
        visits = self._visits[path] = self._visits.get(path, -1) + 1
        first = visits % len(plain)  # each outcome is the usual one in turn, so that loops end
        options = plain[first:] + plain[:first]
        if self._preempts:
            options += [PREEMPT] if PREEMPTED in outcomes else []
            options += [LATE.format(outcome) for outcome in plain]
        faults = self._options.faults
        bounded = double.timeout is not None
        waits = dict(double.describe_details()[1])
        if bounded or "hang" in faults or self._may_wait(double, path, waits):
            options.append(HANGS)
        options += [RAISES] if "raise" in faults else []
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
            raise RuntimeError("raised by the test")
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


def kept_by(patterns: Collection[str]) -> Callable[[str, State], bool]:
    """Return what tells the leaves that stay as they are: paths, or ends of paths."""

    def kept(path: str, _state: State) -> bool:
        return any(path == p or path.endswith("/" + p.strip("/")) for p in patterns)

    return kept
