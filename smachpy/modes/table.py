"""The table of modes: which event leads from which mode to which; pure.

It is written as for the package `transitions`, which checks it and says what its nested modes mean.
At run time it is a dict.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.inputs.expression import Expression, ExpressionError, MissingNameError
from actionlib_core.inputs.suggest import did_you_mean
from smachpy.base import log
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Iterator

BETWEEN: Final = "_"  # `transitions` writes the modes of a mode as "manual_slow"
MODE_KEYS: Final = frozenset({"name", "children", "initial", "mission", "resume"})


class ModesError(SmachError):
    """A table of modes is wrong.

    Try: correct each problem that is listed; docs/modes.md has an example.

    Attributes:
        problems: All problems, as texts.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("Modes: " + " ".join(problems))


@dataclass(frozen=True, slots=True)
class Way:
    """Where an event leads from a mode.

    Attributes:
        target: The mode.
        when: A condition on the userdata, or "".
    """

    target: str
    when: str = ""

    def holds(self, values: Mapping[str, Any]) -> bool:
        """Return whether the condition holds; one that cannot be evaluated does not.

        This is logged once, except for a key that is not there.
        """
        try:
            return not self.when or bool(Expression(self.when)(values))
        except MissingNameError:
            return False
        except ExpressionError as error:
            if self not in _told:
                _told.add(self)
                log.logwarn(f"Modes: a way to {self.target!r} does not count: {error}")
            return False


_told: set[Way] = set()  # those whose conditions could not be evaluated


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode.

    Attributes:
        name: Its name; that of a mode in another one begins with the other's name.
        mission: What runs in it: a machine, a function that returns one, a file, or None.
        resume: The mission goes on where it was when the mode is entered again.
    """

    name: str
    mission: Any = None
    resume: bool = False


class Table:
    """The modes and the ways between them.

    Args:
        states: The modes: names, or dicts with `name`, `mission`, `resume`, `children`, `initial`.
        transitions: Dicts with `trigger`, `source`, `dest` and maybe `when`, or such lists.
        initial: The first mode; by default the first of `states`.
        emergency: A mode that "*" does not mean: it is left by what names it only.

    Attributes:
        modes: Name -> mode; of nested ones the innermost.
        ways: (mode, event) -> the ways, in the order in which their conditions are asked.
        initial: The first mode.

    Raises:
        ModesError: a mode is unknown or named twice, or an entry has a wrong form; all problems.
    """

    def __init__(
        self,
        states: Iterable[Any],
        transitions: Iterable[Any],
        initial: str | None = None,
        emergency: str | None = None,
    ) -> None:
        self._emergency = emergency
        self.problems: list[str] = []
        self.modes: dict[str, Mode] = {}
        self._firsts: dict[str, str] = {}  # a mode with modes in it -> its first one
        self._around: dict[str, set[str]] = {}  # a mode -> those that it is in
        for what, given in (("states", states), ("transitions", transitions)):
            if isinstance(given, (str, Mapping)) or not isinstance(given, Iterable):
                self.problems.append(f"{what}: got {given!r}; expected a list.")
        if self.problems:
            raise ModesError(self.problems)
        plain = [self._add(state, "") for state in states]
        rows = [row for row in map(self._row, transitions) if row is not None]
        known = {*self.modes, *self._firsts}
        for row in rows:
            for name in (*(one for one in row["source"] if one != "*"), row["dest"]):
                if name not in known:
                    self._unknown(f"transition {row['trigger']!r}", name, known)
        self.initial = self._leaf(initial or next(iter(self.modes), ""))
        if self.initial not in self.modes:
            self._unknown("initial", initial, known)
        if not self.problems:
            self._validate(plain, rows)
            self._find_dead(rows)
        if self.problems:
            raise ModesError(self.problems)
        self.ways = self._compile(rows)

    def _unknown(self, what: str, name: object, known: Iterable[str]) -> None:
        near = did_you_mean(str(name), list(known))
        self.problems.append(f"{what}: got mode {name!r}; expected one of {sorted(known)}.{near}")

    def _add(self, state: Any, around: str) -> Any:
        """Add a mode, and those in it; return it as `transitions` takes it."""
        given = {"name": state} if isinstance(state, str) else state
        if not isinstance(given, Mapping) or not isinstance(given.get("name"), str):
            self.problems.append(f"states: got {state!r}; expected a name, or a dict with 'name'.")
            return "?"
        for key in given.keys() - MODE_KEYS:
            near = did_you_mean(key, MODE_KEYS)
            self.problems.append(
                f"{given['name']}: got {key!r}; expected some of {sorted(MODE_KEYS)}.{near}"
            )
        name, before = f"{around}{given['name']}", len(self.modes)
        if not given["name"] or "/" in name or name in {*self.modes, *self._firsts}:
            self.problems.append(f"states: got {name!r}; expected a new name, without '/'.")
        children = given.get("children")
        if not children:
            resume = given.get("resume", False)
            if not isinstance(resume, bool):
                problem = f"{name}: resume: got {resume!r}; expected True or False."
                self.problems.append(problem)
            self.modes[name] = Mode(name, given.get("mission"), bool(resume))
            return given["name"]
        if given.get("mission") is not None:
            self.problems.append(f"{name}: got a mission and children; expected one of them.")
        if isinstance(children, str) or not isinstance(children, Sequence):
            self.problems.append(f"{name}: children: got {children!r}; expected modes, in a list.")
            return given["name"]
        around_them = f"{name}{BETWEEN}"
        inner = [self._add(child, around_them) for child in children]
        for mode in [*self.modes][before:]:
            self._around.setdefault(mode, set()).add(name)
        first = given.get("initial") or (
            inner[0] if isinstance(inner[0], str) else inner[0]["name"]
        )
        self._firsts[name] = f"{around_them}{first}"
        if self._leaf(name) not in self.modes:
            self._unknown(f"{name}: initial", first, self.modes)
        return {"name": given["name"], "children": inner, "initial": first}

    def _row(self, row: Any) -> dict[str, Any] | None:
        keys = ("trigger", "source", "dest", "when")
        if isinstance(row, Sequence) and not isinstance(row, str) and len(row) in {3, 4}:
            row = dict(zip(keys, row, strict=False))
        fits = isinstance(row, Mapping) and {"trigger", "source", "dest"} <= row.keys() <= {*keys}
        if not fits or not all(row[key] and isinstance(row[key], str) for key in keys[::2]):
            self.problems.append(
                f"transitions: got {row!r}; expected trigger, source, dest and maybe when."
            )
            return None
        if row["trigger"] == "preempted":
            self.problems.append(
                "transition 'preempted': got what a request to stop gives; expected another event."
            )
        sources = (row["source"],) if isinstance(row["source"], str) else row["source"]
        if not isinstance(sources, Sequence) or not all(isinstance(one, str) for one in sources):
            self.problems.append(
                f"transition {row['trigger']!r}: source: got {sources!r}; expected a mode, "
                "modes in a list, or '*'."
            )
            return None
        when = row.get("when") or ""
        if not isinstance(when, str):
            self.problems.append(
                f"transition {row['trigger']!r}: when: got {when!r}; expected an expression."
            )
            return None
        try:
            _ = Expression(when) if when else None
        except ExpressionError as error:
            self.problems.append(f"transition {row['trigger']!r}: when: {error}")
        return {**row, "source": tuple(sources), "when": when}

    def _validate(self, states: list[Any], rows: list[dict[str, Any]]) -> None:
        """Let `transitions` check the table."""
        from transitions import MachineError
        from transitions.extensions import HierarchicalMachine

        given = [
            {"trigger": row["trigger"], "source": list(row["source"]), "dest": row["dest"]}
            for row in rows
        ]
        for row in given:
            if row["source"] == ["*"]:
                row["source"] = "*"
        try:
            HierarchicalMachine(
                model=None, states=states, transitions=given, initial=None, auto_transitions=False
            )
        except (MachineError, ValueError, KeyError) as error:
            self.problems.append(f"{error}; expected what the package 'transitions' takes.")

    def _find_dead(self, rows: list[dict[str, Any]]) -> None:
        """Report ways that are never taken, as an earlier one has no condition."""
        always: dict[tuple[str, str], str] = {}  # (source, event) -> where it leads in any case
        for row in rows:
            target = self._leaf(row["dest"])
            for source in row["source"]:
                first = always.get((source, row["trigger"]), target)
                if first != target:
                    self.problems.append(
                        f"transition {row['trigger']!r}: got ways from {source!r} to {first!r} and "
                        f"to {target!r}; expected one, or a condition for the first."
                    )
                elif not row["when"]:
                    always[source, row["trigger"]] = target

    def _leaf(self, name: str) -> str:
        """Return the innermost mode that is entered with a mode."""
        while name in self._firsts:
            name = self._firsts[name]
        return name

    def _compile(self, rows: list[dict[str, Any]]) -> dict[tuple[str, str], tuple[Way, ...]]:
        found: dict[tuple[str, str], list[tuple[int, Way]]] = {}
        for row in rows:
            way = Way(self._leaf(row["dest"]), row["when"])
            for source in row["source"]:
                for mode in self.modes:
                    anywhere = source == "*" and mode != self._emergency
                    if anywhere or source == mode or source in self._around.get(mode, ()):
                        # A way of an inner mode comes before those of the modes around it.
                        depth = 0 if source == "*" else 1 + source.count(BETWEEN)
                        found.setdefault((mode, row["trigger"]), []).append((-depth, way))
        return {
            pair: tuple(way for _, way in sorted(ways, key=lambda each: each[0]))
            for pair, ways in found.items()
        }

    def next(self, mode: str, event: str, values: Mapping[str, Any]) -> str | None:
        """Return the mode to which an event leads; None if it means nothing here."""
        ways = self.ways.get((mode, event), ())
        return next((way.target for way in ways if way.holds(values)), None)

    def events(self, mode: str) -> tuple[str, ...]:
        """Return the events that mean something in a mode."""
        return tuple(event for here, event in self.ways if here == mode)


# -- machines of the package `transitions` ---------------------------------------------------------


def name_of(machine: Any, name: str) -> str:
    """Return the name of a mode: machines can separate those of nested states by something else."""
    return name.replace(getattr(machine.state_cls, "separator", BETWEEN), BETWEEN)


def states_of(
    machine: Any,
    missions: Mapping[str, Any],
    known: list[str],
    around: str = "",
    states: Any = None,
) -> list[dict[str, Any]]:
    """Return the modes of a machine, nested as its states are.

    Args:
        machine: The machine.
        missions: Mode -> mission.
        known: Gets the names of all modes.
        around: What the names begin with.
        states: Name -> state; None: those of the machine.
    """
    found: list[dict[str, Any]] = []
    for name, state in (machine.states if states is None else states).items():
        whole = f"{around}{name}"
        known.append(whole)
        one = {"name": name, "mission": missions.get(whole)}
        inner = getattr(state, "states", None)
        if inner:
            one["children"] = states_of(machine, missions, known, f"{whole}{BETWEEN}", inner)
            one["initial"] = state.initial or next(iter(inner))
        found.append(one)
    return found


def rows_of(machine: Any, known: Iterable[str]) -> Iterator[dict[str, Any]]:
    """Yield the rows of a machine, without those of its events `to_MODE` and internal ones.

    Args:
        machine: The machine.
        known: The names of all modes.

    Raises:
        ModesError: it has conditions, which are code.
    """
    jumps = {f"to_{name}" for name in known} if machine.auto_transitions else set()
    for name, event in machine.events.items():
        if name_of(machine, name) in jumps:
            continue
        for ways in event.transitions.values():
            for way in ways:
                if way.conditions:
                    problem = f"{name}: got conditions, which are code; expected none. Try `when`."
                    raise ModesError([problem])
                if way.dest is None:  # an internal one, which leaves no mode
                    continue
                source, target = (name_of(machine, one) for one in (way.source, way.dest))
                yield {"trigger": name, "source": source, "dest": target}
