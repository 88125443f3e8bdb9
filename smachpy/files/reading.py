"""Reads a mission file: checks it, all problems at once, and builds the machine that it describes.

Nothing of the user's code is imported for that. What the file names as `module:Name` is a
`Reference` until the machine runs.
"""

from __future__ import annotations

import inspect
import os
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, get_args

from actionlib_core.inputs.checked_file import REQUIRED, CheckedFile, Limits, Section
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.inputs.yaml_text import YamlTextError, load_with_marks
from actionlib_core.resources import POLICIES
from smachpy.base.problems import unknown_name
from smachpy.exceptions import MissionError, SmachError, error_text
from smachpy.files.others import FOREIGN, NotKept, OwnStates, lacking
from smachpy.files.reference import (
    Naming,
    Origin,
    Reference,
    check_allowed,
    check_named,
    file_of,
    finish,
    make_named,
    make_registered,
    named_thing,
)
from smachpy.machines.concurrence import Concurrence
from smachpy.machines.guards import when
from smachpy.machines.iterator import Iterator
from smachpy.machines.rules import Rule, all_of, any_of, n_of
from smachpy.machines.state_machine import Reenter, Sequence, StateMachine

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from collections.abc import Sequence as SequenceOf

    from actionlib_core.inputs.checked_file import Parsed, Problem
    from smachpy.machines.container import Container
    from smachpy.machines.state import State

KINDS: Final = ("state", "machine", "sequence", "concurrence", "iterator", "mission", "plan")
OPTIONS: Final = (
    *("timeout", "timeout_outcome", "preempt_timeout", "retry", "resume"),
    *("idempotent", "transient", "success", "resource"),
)
KEYS: Final = ("outcomes", "input_keys", "output_keys")
OF_LOAD: Final = frozenset({"path", "allow", "to_run"})
"""What `load` takes besides the parameters of a file."""
TYPES: Final[dict[str, tuple[type, ...]]] = {
    "whole": (int,),
    "number": (int, float),
    "flag": (bool,),
    "text": (str,),
    "list": (list,),
    "any": (object,),
}
WORDS: Final = {
    "whole": "a whole number",
    "number": "a number",
    "flag": "true or false",
    "text": "a text",
    "list": "a list",
    "any": "a value",
}
MOST_FILES: Final = 50
"""Mission files in each other, at most."""
MOST_PARTS: Final = 1000
"""Mission files that one is made of, at most; each counts as often as it is named."""


class MissionFileError(MissionError):
    """A mission file has problems.

    Try: correct each line that is listed; docs/mission_files.md says what a file can hold.

    Attributes:
        problems: Their texts: "patrol.yaml:12:5: states.DRIVE.on: got ...; expected ...".
    """

    def __init__(self, problems: SequenceOf[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(problems))


class _TooManyPartsError(MissionFileError):
    """Names of mission files in each other multiply without an end; it ends the reading at once."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a mission file.

    Attributes:
        name: Its name.
        type: One of `whole`, `number`, `flag`, `text`, `list`, `any`.
        default: Its value if none is given; `REQUIRED` if it must be.
        unit: Its unit, or "".
        help: What it is, or "".
    """

    name: str
    type: str = "any"
    default: Any = REQUIRED
    unit: str = ""
    help: str = ""

    def fits(self, value: object) -> bool:
        """Return whether a value has the type; true and false are no numbers."""
        is_flag = isinstance(value, bool)
        return isinstance(value, TYPES[self.type]) and (not is_flag or self.type in {"flag", "any"})


def load(
    path: str | Path,
    *,
    allow: SequenceOf[str] = (),
    to_run: bool = True,
    **arguments: Any,
) -> StateMachine:
    """Return the machine that a mission file describes.

    No code that the file names as `module:Name` is imported; the start of a run does that, or
    `smachpy.files.resolve`. Constructors of registered states are called.

    Args:
        path: The file.
        allow: Packages of which it may name code, besides modules in its own folder.
        to_run: False to look at it only: the packages that it names need not be allowed yet.
        **arguments: Values of its parameters.

    Raises:
        MissionFileError: it cannot be read or is wrong; all problems at once, each with file, line
            and column.
    """
    given = (allow,) if isinstance(allow, str) else tuple(allow)
    return _Reader(Path(path), Path(path).parent, given, (), to_run=to_run).machine(arguments)


def read(path: str | Path) -> tuple[str, tuple[Parameter, ...]]:
    """Return the help text and the parameters of a mission file.

    Raises:
        MissionFileError: it cannot be read, or these parts of it are wrong.
    """
    reader = _Reader(Path(path), Path(path).parent, (), ())
    parameters = reader.parameters()
    reader.file.check()
    return str(reader.file.top.value("help") or ""), parameters


@dataclass(slots=True)
class StopOthers:
    """A concurrence's `child_termination_cb`: the end of one of these children stops the others.

    Attributes:
        labels: The children; None for all.
    """

    labels: tuple[str, ...] | None = None

    def __call__(self, outcomes: Mapping[str, str | None]) -> bool:
        """Return whether the others are to stop."""
        watched = outcomes if self.labels is None else self.labels
        return any(outcomes.get(label) is not None for label in watched)


@dataclass(slots=True)
class ItemsOf:
    """An iterator's items: the list in a key of its userdata.

    Attributes:
        iterator: The iterator.
        key: The key.
    """

    iterator: Iterator
    key: str

    def __call__(self) -> Any:
        """Return the items."""
        return self.iterator.userdata[self.key]


@dataclass(slots=True)
class _Pending:
    """A plan that is loaded with its code when the machine runs."""

    make: Callable[[], State]
    origin: Origin = field(default_factory=lambda: Origin("plan", ""))


def _real(path: Path) -> Path:
    """Return where a path leads; `Path.resolve` raises RuntimeError for a link to itself."""
    return Path(os.path.realpath(path))


class _Reader:
    def __init__(
        self,
        path: Path,
        folder: Path,
        allow: tuple[str, ...],
        around: tuple[Path, ...],
        *,
        to_run: bool = True,
        parts: list[str] | None = None,
    ) -> None:
        self._to_run = to_run
        self._parts = [] if parts is None else parts  # those of the whole mission, by name
        self._columns: dict[str, int] = {}
        self._own: OwnStates | None = None
        self._notes: tuple[tuple[int, str], ...] = ()
        self._path, self._folder, self._allow = path, folder, allow
        self._around = (*around, _real(path))
        self._values: dict[str, Any] = {}
        self.file = CheckedFile(path, self._error, self._parse)

    def _parse(self, file: CheckedFile, text: str) -> Parsed:
        if self._path.suffix in FOREIGN:
            return self._parse_foreign(text)
        try:
            data, marks = load_with_marks(text)
        except YamlTextError as error:
            self._columns[""] = max(1, error.column)
            file.report("", f"not YAML: {error.reason}.", max(1, error.line))
            return None, {}
        self._columns = {path: column for path, (_, column) in marks.items()}
        return data, {path: line for path, (line, _) in marks.items()}

    def _parse_foreign(self, text: str) -> Parsed:
        """Return the data of the file of another tool."""
        from smachpy import foreign

        self._own = OwnStates(self._folder)
        draft = foreign.read(self._path, text, self._own.named, is_included=len(self._around) > 1)
        self._notes = tuple((place[0], text) for place, text in sorted(draft.notes))
        if draft.problems:
            found = [f"{self._path}:{a}:{b}: {text}" for (a, b), text in draft.problems]
            raise MissionFileError(found)
        marks = draft.marks()
        self._columns = {path: column for path, (_, column) in marks.items()}
        return draft.data(), {path: line for path, (line, _) in marks.items()}

    def _error(self, problems: SequenceOf[Problem]) -> MissionFileError:
        return MissionFileError([self._text(one) for one in problems])

    def _text(self, problem: Problem) -> str:
        if not problem.line or problem.file != str(self._path):
            return str(problem)
        where = f"{problem.file}:{problem.line}:{self._column(problem.field)}"
        return ": ".join(part for part in (where, problem.field, problem.text) if part)

    def _column(self, name: str) -> int:
        while name and name not in self._columns:
            name = name[: max(name.rfind("."), name.rfind("["), 0)]
        return self._columns.get(name, 1)

    # -- the whole file ------------------------------------------------------------------------

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters."""
        section = self.file.top.section("parameters")
        return tuple(self._parameter(section, name) for name in section)

    def _parameter(self, parameters: Section, name: str) -> Parameter:
        section = parameters.section(name)
        kind = section.text("type", "any", tuple(TYPES))
        given = section.value("default", REQUIRED)
        unit, text = (section.text(key, "", may_be_blank=True) for key in ("unit", "help"))
        section.close()
        found = Parameter(name, kind, given, unit, text)
        if not name.isidentifier():
            parameters.report(name, f"got {name!r}; expected a name of letters, digits and '_'.")
        if name in OF_LOAD:
            parameters.report(
                name, f"got {name!r}, an argument of smachpy.load; expected another name."
            )
        if given is not REQUIRED and not found.fits(given):
            section.problem("default", WORDS[kind])
        if "${" in str(given):
            section.report(
                "default", f"got {given!r}; expected a value: a default names no parameter."
            )
        return found

    def machine(self, arguments: Mapping[str, Any]) -> StateMachine:
        """Build the machine."""
        top = self.file.top
        top.text("help", "", may_be_blank=True)
        if top.value("smachpy", 1) != 1:
            top.problem("smachpy", "1, the version of the form")
        self._take(arguments)
        machine: Any = self._container(top, StateMachine, {"name": self._name(top)})
        self.file.check()
        shown = {key: top.value(key) for key in ("help", "parameters") if key in top}
        machine._smachpy.made_from = shown
        if self._notes:
            notes = NotKept(str(self._path), self._notes)
            machine._smachpy_check = notes  # noqa: SLF001  where a check asks a machine itself
        return machine  # type: ignore[no-any-return]

    def _name(self, top: Section) -> str:
        name = top.text("name", self._path.name.partition(".")[0].upper())
        self._check_printable(top, "name", name)
        return name

    def _check_printable(self, section: Section, key: str, name: str) -> None:
        """Refuse control characters: a name with a line end forges the lines of reports."""
        if not name.isprintable():
            section.report(key, f"got {name!r}; expected no control characters.")

    def _take(self, arguments: Mapping[str, Any]) -> None:
        known = {one.name: one for one in self.parameters()}
        for name in arguments:
            if name not in known:
                text = f"got an argument {name!r}; expected one of {sorted(known)}."
                self.file.report("parameters", text + did_you_mean(name, known))
        for name, one in known.items():
            value = arguments.get(name, one.default)
            if value is REQUIRED:
                self.file.report(
                    f"parameters.{name}", "got no value; expected one, it is required."
                )
                value = None
            elif name in arguments and not one.fits(value):
                unit = one.unit and f" [{one.unit}]"
                expected = f"expected {WORDS[one.type]}{unit}"
                self.file.report(f"parameters.{name}", f"got {value!r}; {expected}.")
                value = one.default  # no more problems because of it
            self._values[name] = value

    def _filled(self, section: Section, key: str, value: Any, deep: int = 0) -> Any:
        """Return a value with `${name}` replaced by parameters."""
        if isinstance(value, str) and "${" in value:
            return self._filled_text(section, key, value)
        if isinstance(value, list):
            return [self._filled(section, key, one, deep + 1) for one in value]
        if isinstance(value, dict):
            return {name: self._filled(section, key, one, deep + 1) for name, one in value.items()}
        return value

    def _filled_text(self, section: Section, key: str, text: str) -> Any:
        head, *parts = text.split("${")
        made = [head]
        for part in parts:
            name, closed, rest = part.partition("}")
            if not closed or name not in self._values:
                near = did_you_mean(name, self._values)
                expected = f"expected ${{NAME}} with one of {sorted(self._values)}.{near}"
                section.report(key, f"got {text!r}; {expected}")
                return text
            if text == f"${{{name}}}":
                return self._values[name]
            made += [str(self._values[name]), rest]
        return "".join(made)

    # -- containers ----------------------------------------------------------------------------

    def _container(
        self, section: Section, kind: type[Container], extra: Mapping[str, Any]
    ) -> Container | None:
        """Build a container from its section."""
        given: dict[str, Any] = dict(extra)
        outcomes = section.texts("outcomes", REQUIRED)
        for outcome in outcomes:
            self._check_printable(section, "outcomes", outcome)
        for key in ("input_keys", "output_keys"):
            given[key] = section.texts(key, ())
        given["userdata"] = self._mapping(section, "userdata")
        if issubclass(kind, StateMachine):
            given["reenter"] = section.text("reenter", "first", get_args(Reenter))
        items = given.get("it")
        if isinstance(items, ItemsOf) and items.key not in given["userdata"]:
            given["input_keys"] = [*dict.fromkeys([*given["input_keys"], items.key])]
        given |= self._options(section)
        made: Any = self._made(section, kind, {"outcomes": outcomes, **given})
        if kind is Iterator:
            self._fill_iterator(section, made)
        else:
            self._fill(section, made)
        section.allow(*OPTIONS)
        section.close()
        if made is not None and made.get_children():
            self._find_problems(section, made)
        return made  # type: ignore[no-any-return]

    def _find_problems(self, section: Section, made: Any) -> None:
        """Report what the machine says of itself, unless another problem is the reason."""
        labels = tuple(section.section("states"))
        missing = [label for label in labels if label not in made.get_children()]
        for problem in made._smachpy_problems("states"):
            place, _, text = problem.partition(": ")
            label = place.partition("/")[2]
            if label not in labels:  # a state between, made for a transition
                of = [one for one in labels if label.startswith(f"CONFIRM_{one}_")]
                label = max(of, key=len, default=label)
            field = f"states.{label}" if label else ""
            if label in labels:
                field += self._at_transition(section.section("states").section(label), text)
            known = not section.is_good(field) if field else bool(self.file.problems)
            if not known and not any(f"got {one!r}" in text for one in missing):
                self.file.report(section.path(field), text)

    @staticmethod
    def _at_transition(entry: Section, text: str) -> str:
        """Return the field of a state about whose transition a machine says something, or ""."""
        on = entry.section("on")
        for outcome in on:
            starts = (
                f"transition {outcome!r} leads nowhere",
                f"transition from an unknown outcome: got {outcome!r}",
            )
            if text.startswith(starts):
                return f".on.{outcome}"
            rows = on.value(outcome)
            if text.startswith("transition if ") and isinstance(rows, list):
                for number, row in enumerate(rows):
                    if f"got {row.get('to')!r};" in text:
                        return f".on.{outcome}[{number}].to"
        return ""

    def _made(self, section: Section, kind: Any, given: dict[str, Any]) -> Any:
        try:
            return kind(**given)
        except SmachError as error:
            problems = getattr(error, "problems", None) or [str(error)]
            section.report_each(problems)
            if not section.file.problems:
                section.report("", problems[0])
            return None

    def _mapping(self, section: Section, key: str) -> dict[str, Any]:
        inner = section.section(key)
        return {name: self._filled(inner, name, inner.value(name)) for name in inner}

    def _options(self, section: Section) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for name in OPTIONS:
            if name not in section:
                continue
            value = self._filled(section, name, section.value(name))
            if name == "retry" and isinstance(value, dict):
                retry = Section(section.file, section.path("retry"), value)
                value = (
                    retry.integer("attempts", 2),
                    retry.number("backoff", 0.0),
                    list(retry.texts("on", ("aborted",))),
                )
                retry.close()
            if name == "resource" and isinstance(value, dict):
                resource = Section(section.file, section.path("resource"), value)
                value = (resource.text("name", REQUIRED), resource.text("policy", "wait", POLICIES))
                resource.close()
            found[name] = value
        return found

    def _fill(self, section: Section, made: Any) -> None:
        """Add the states and the clean-up of a machine, sequence or concurrence."""
        states = section.section("states")
        if not list(states):
            section.problem("states", "a mapping: label -> state")
        for label in states:
            self._check_printable(states, label, label)
            entry = states.section(label)
            self._add(entry, made, label)
        if "initial" in section and isinstance(made, StateMachine):
            first = section.text("initial", REQUIRED, tuple(states))
            if section.is_good("initial", "states"):
                made._smachpy.initial = first
        self._fill_cleanup(section, made)

    def _fill_cleanup(self, section: Section, made: Any) -> None:
        cleanup = section.section("cleanup")
        labels = list(cleanup)
        if len(labels) > 1:
            cleanup.report(
                labels[1], "got a second clean-up; expected one. Try a sequence of both."
            )
        for label in labels[:1]:
            self._check_printable(cleanup, label, label)
            entry = cleanup.section(label)
            state = self._state(entry, ("remapping",))
            remapping = self._names(entry, "remapping")
            entry.close()
            add = partial(getattr(made, "add_cleanup", str), label, state, remapping)
            self._try(entry, add, made, state)

    def _fill_iterator(self, section: Section, made: Any) -> None:
        each = section.section("each")
        labels = list(each)
        loop, breaks = section.texts("loop_outcomes", ()), section.texts("break_outcomes", ())
        final = self._names(section, "final_outcomes")
        if len(labels) != 1:
            section.problem("each", "a mapping with one state: label -> state")
            return
        self._check_printable(each, labels[0], labels[0])
        entry = each.section(labels[0])
        state = self._state(entry, ("remapping",))
        remapping = self._names(entry, "remapping")
        entry.close()
        self._try(
            entry,
            lambda: made.set_contained_state(
                labels[0], state, loop, breaks, final, remapping=remapping
            ),
            made,
            state,
        )
        self._fill_cleanup(section, made)

    def _add(self, entry: Section, made: Any, label: str) -> None:
        around = ["on", "remapping", "constants"]
        if isinstance(made, Concurrence):
            around = ["remapping"]
            entry.allow("on")
            if "on" in entry:
                entry.report(
                    "on",
                    "got transitions; expected none in a concurrence: its outcome_map decides.",
                )
        elif isinstance(made, Sequence):
            around.remove("constants")
        state = self._state(entry, around)
        remapping = self._names(entry, "remapping")
        arguments: list[Any] = [remapping]
        if made is None:
            entry.allow(*around)
        elif not isinstance(made, Concurrence):
            arguments = [self._transitions(entry), remapping]
            if type(made) is StateMachine:
                arguments.append(self._mapping(entry, "constants"))
                self._check_constants(entry, state)
        entry.close()
        self._try(entry, lambda: made.add(label, state, *arguments), made, state)

    def _check_constants(self, entry: Section, state: State | None) -> None:
        """Refuse constants of a ready-made state that reads no key."""
        from smachpy.states.by_name import BY_NAME

        origin = None if state is None else state._smachpy.made_from
        # States of others may read what they do not declare.
        is_ours = isinstance(origin, Origin) and origin.kind == "state" and origin.name in BY_NAME
        if state is None or not is_ours or state._smachpy.input_keys:
            return
        constants = entry.section("constants")
        for key in constants:
            constants.report(key, f"got {key!r}; expected none: the state reads no key.")

    def _try(self, entry: Section, call: Callable[[], object], *needed: object) -> None:
        """Add a state; report what the machine says of it."""
        if any(one is None for one in needed):  # its problem is known
            return
        try:
            call()
        except SmachError as error:
            for problem in getattr(error, "problems", None) or [str(error)]:
                entry.file.report(entry.path(""), problem)

    def _names(self, section: Section, key: str) -> dict[str, str]:
        inner = section.section(key)
        return {name: inner.text(name, REQUIRED) for name in inner}

    def _transitions(self, entry: Section) -> dict[str, Any]:
        on = entry.section("on")
        return {outcome: self._target(on, outcome) for outcome in on}

    def _target(self, on: Section, outcome: str) -> Any:
        value = on.value(outcome)
        if isinstance(value, dict):
            return self._confirmed(on.section(outcome))
        if not isinstance(value, list):
            return None if value is None else on.text(outcome, REQUIRED)
        rows = on.rows(outcome)
        found: list[Any] = []
        for number, row in enumerate(rows, 1):
            target = row.text("to", REQUIRED)
            is_last = number == len(rows)
            if "when" in row and is_last:
                row.report("when", "got a condition in the last case; expected one without.")
            elif "when" not in row and not is_last:
                row.report("", "got a case without a condition before the last; expected `when`.")
            elif is_last:
                found.append(target)
            else:
                condition = row.text("when", REQUIRED)
                try:
                    found.append(when(condition if row.is_good("when") else "True", target))
                except SmachError as error:
                    row.report("when", str(error).partition(": ")[2])
            row.allow("when")
            row.close()
        return found if len(found) > 1 else (found[0] if found else None)

    @staticmethod
    def _confirmed(row: Section) -> Any:
        from smachpy.states.confirming import confirm  # here: few files need what it imports

        target = row.text("to", REQUIRED)
        level = row.integer("confirm", REQUIRED, Limits(low=1))
        otherwise = row.text("otherwise", "preempted")
        question = row.text("question", REQUIRED) if "question" in row else ""
        row.close()
        return confirm(target, level, otherwise=otherwise, question=question) if target else None

    # -- one state -----------------------------------------------------------------------------

    def _state(self, entry: Section, around: SequenceOf[str]) -> State | None:
        """Return the state of an entry, without what its container does with it.

        Args:
            entry: The entry.
            around: The keys of it that its container reads.
        """
        entry.text("help", "", may_be_blank=True)
        entry.allow(*around)
        kinds = [kind for kind in KINDS if kind in entry]
        if len(kinds) != 1:
            entry.allow(*KINDS)
            text = f"got {kinds or 'no kind of state'}; expected one of {list(KINDS)}."
            entry.report(kinds[1] if kinds else "", text)
            entry.allow(*entry)
            return None
        (kind,) = kinds
        if kind in {"state", "mission", "plan"}:
            return self._named(entry, kind, around)
        inner = entry.section(kind)
        for key in (*OPTIONS, *KEYS):
            if key in entry:
                entry.allow(key)
                entry.report(key, f"got it beside {kind!r}; expected it inside of that.")
        extra: dict[str, Any] = {}
        containers: dict[str, type[Container]] = {
            "machine": StateMachine,
            "sequence": Sequence,
            "concurrence": Concurrence,
            "iterator": Iterator,
        }
        if kind == "sequence":
            extra["connector_outcome"] = inner.text("connector", REQUIRED)
        elif kind == "concurrence":
            extra |= self._policy(inner)
        elif kind == "iterator":
            extra |= self._loop(inner)
        made: Any = self._container(inner, containers[kind], extra)
        if made is not None and isinstance(extra.get("it"), ItemsOf):
            extra["it"].iterator = made
        return made  # type: ignore[no-any-return]

    def _policy(self, inner: Section) -> dict[str, Any]:
        found: dict[str, Any] = {"default_outcome": inner.text("default_outcome", REQUIRED)}
        rules = inner.section("outcome_map")
        found["outcome_map"] = {outcome: self._rule(rules, outcome) for outcome in rules}
        stop = inner.value("stop_others", default=False)
        if stop is True:
            found["child_termination_cb"] = StopOthers()
        elif stop is not False:
            labels, known = inner.texts("stop_others", ()), list(inner.section("states"))
            for label in labels:
                if label not in known:
                    inner.report("stop_others", unknown_name("state", label, known))
            found["child_termination_cb"] = StopOthers(labels)
        return found

    def _rule(self, rules: Section, outcome: str) -> Rule:
        section = rules.section(outcome)
        make: Callable[[Any], Rule] = all_of
        of = section
        if set(section) == {"any"}:
            make, of = any_of, section.section("any")
        elif set(section) == {"need", "of"}:
            need, of = section.integer("need", REQUIRED), section.section("of")

            def make(conditions: Any) -> Rule:
                return n_of(need, conditions)

        wanted = {
            label: of.texts(label, REQUIRED)
            if isinstance(of.value(label), list)
            else of.text(label, REQUIRED)
            for label in of
        }
        try:
            return make(wanted)
        except SmachError as error:
            rules.report(outcome, str(error))
            return Rule(1, ())

    def _loop(self, inner: Section) -> dict[str, Any]:
        items: Any = self._filled(inner, "items", inner.value("items"))
        key = inner.value("items_from")
        if (items is None) == (key is None):
            inner.allow("items", "items_from")
            inner.report("", "got both or none of items and items_from; expected one of them.")
        elif key is not None:
            items = ItemsOf(None, inner.text("items_from", REQUIRED))  # type: ignore[arg-type]
        elif not isinstance(items, list):
            inner.problem("items", "a list")
        return {
            "it": () if items is None else items,
            "it_label": inner.text("item_key", "item"),
            "exhausted_outcome": inner.text("exhausted", "done"),
        }

    def _named(self, entry: Section, kind: str, around: SequenceOf[str]) -> State | None:
        name = entry.text(kind, REQUIRED)
        options = self._options(entry)
        entry.allow(*OPTIONS)
        raw = {key: entry.value(key) for key in options}
        with_ = Section(entry.file, "", {}) if kind == "plan" else entry.section("with")
        arguments = {} if kind == "plan" else self._mapping(entry, "with")
        keys: dict[str, Any] = {}
        if kind == "state":
            entry.allow(*KEYS)
            keys = {key: entry.texts(key, ()) for key in KEYS if key in entry}
        place = Naming(self._where(entry, kind), self._folder, self._allow)
        origin = Origin(kind, name, {key: with_.value(key) for key in with_}, raw, keys)
        if not entry.is_good(kind, "with", *OPTIONS):
            return None
        if kind == "mission":
            return self._inner(entry, name, arguments, options, origin, place)
        try:
            if kind == "plan":
                return self._plan(name, options, origin, place)
            if ":" not in name:
                return finish(make_registered(name, arguments, place), origin, options, place)
        except SmachError as error:  # also of a plan
            text = str(error).removeprefix(f"{place.where}: ").removeprefix(f"{kind}: ")
            if not self._report_arguments(entry, error, arguments):
                field, known, rest = text.partition("with: ")
                entry.report("with" if known and not field else kind, rest if not field else text)
            return None
        return self._reference(entry, name, arguments, options, origin, place, around)

    def _report_arguments(
        self, entry: Section, error: SmachError, arguments: Mapping[str, Any]
    ) -> bool:
        """Report what is wrong with arguments and options at their places; return whether it is."""
        found = [
            one.partition(": ")
            for one in getattr(error.__cause__ or error, "problems", ())
            if isinstance(one, str)
        ]
        if not found or not all(key in {*arguments, *OPTIONS} for key, _, _ in found):
            return False
        for key, _, text in found:
            (entry.section("with") if key in arguments else entry).report(key, text)
        return True

    def _where(self, entry: Section, kind: str) -> str:
        path = entry.path(kind)
        return f"{self._path}:{self.file.line(path)}:{self._column(path)}: {path}"

    def _reference(
        self,
        entry: Section,
        name: str,
        arguments: dict[str, Any],
        options: dict[str, Any],
        origin: Origin,
        place: Naming,
        around: SequenceOf[str],
    ) -> State | None:
        missing = self._own is not None and self._own.lacks(name)
        try:
            if self._to_run and not missing:
                check_named(name, arguments, place)
        except MissionError as error:
            text = str(error).removeprefix(f"{place.where}: ")
            known = text.startswith("with: ")
            entry.report("with" if known else "state", text.removeprefix("with: "))
            return None
        on, renamed, constants = (
            list(entry.section(key)) if key in around else []
            for key in ("on", "remapping", "constants")
        )
        outcomes = list(dict.fromkeys((*origin.keys.get("outcomes", ()), *on)))
        inputs = (*origin.keys.get("input_keys", ()), *renamed, *constants)
        outputs = (*origin.keys.get("output_keys", ()), *renamed)

        def make() -> State:
            if missing:
                raise MissionError(f"{place.where}: {lacking(name, self._folder)}")
            return finish(make_named(name, arguments, place), origin, options, place)

        try:
            state = Reference(
                name,
                make,
                outcomes or ["done"],
                [*dict.fromkeys(inputs)],
                [*dict.fromkeys(outputs)],
                options,
            )
        except SmachError as error:
            entry.report("state", str(error))
            return None
        state._smachpy.made_from = replace(origin, loaded=state._smachpy.options)
        return state

    def _inside(self, name: str) -> Path:
        try:
            path = _real(self._path.parent / name)
            there = path.is_file()
        except (OSError, ValueError) as error:  # too long, or with a zero byte
            raise MissionError(f"got a name of no file: {error_text(error)}") from error
        if not path.is_relative_to(self._folder.resolve()):
            raise MissionError(
                f"got {name!r}, which is not in {str(self._folder)!r}; expected a file there."
            )
        if not there:
            beside = path.parent.glob(f"*{path.suffix}") if path.suffix else ()
            near = sorted(each.name for each in beside if each.is_file())
            hint = did_you_mean(name, near)
            raise MissionError(f"got {name!r}, which is no file; expected one of {near}.{hint}")
        if path in self._around:
            raise MissionError(f"got {name!r}, which contains this file; expected another one.")
        if len(self._around) > MOST_FILES:
            raise MissionError(
                f"got {name!r} inside of {MOST_FILES} mission files; expected fewer levels."
            )
        return path

    def _inner(
        self,
        entry: Section,
        name: str,
        arguments: dict[str, Any],
        options: dict[str, Any],
        origin: Origin,
        place: Naming,
    ) -> State | None:
        """Return another mission file's machine."""
        self._parts.append(name)
        if len(self._parts) > MOST_PARTS:
            many = f"got more than {MOST_PARTS} mission files, counted as often as they are named"
            raise _TooManyPartsError([f"{place.where}: {many}; expected fewer."])
        try:
            self._inside(name)
            shown = self._path.parent / name
            reader = _Reader(
                shown,
                self._folder,
                self._allow,
                self._around,
                to_run=self._to_run,
                parts=self._parts,
            )
            return finish(reader.machine(arguments), origin, options, place)
        except _TooManyPartsError:
            raise
        except MissionFileError as error:
            for problem in error.problems:
                entry.file.report(entry.path("mission"), f"in it: {problem}")
        except MissionError as error:
            entry.report("mission", str(error).removeprefix(f"{place.where}: "))
        return None

    def _plan(self, name: str, options: dict[str, Any], origin: Origin, place: Naming) -> State:
        from smachpy.pnp.files import load_plan
        from smachpy.pnp.mapping import mapping_beside, read_mapping

        path = self._inside(name)
        beside = mapping_beside(path)
        named = [] if beside is None else read_mapping(beside, imports=False).named()
        # Code beside the plan comes first, as when the plan runs by itself.
        places = {
            text: replace(place, folder=path.parent)
            if file_of(text.partition(":")[0], path.parent)
            else place
            for text in named
        }
        for text in named if self._to_run else ():
            check_allowed(text.partition(":")[0], places[text])
        plan = finish(load_plan(path, to_run=False, imports=False), origin, options, place)

        def make() -> State:
            for text in named:
                named_thing(text, places[text])
            return finish(load_plan(path), origin, options, place)

        if named:
            plan._smachpy.made_from = _Pending(make, plan._smachpy.made_from)
        return plan


def signature(parameters: SequenceOf[Parameter]) -> inspect.Signature:
    """Return the signature of a function with these parameters, for command lines."""
    hints = {"whole": int, "number": float, "flag": bool, "text": str, "list": list, "any": Any}
    return inspect.Signature(
        [
            inspect.Parameter(
                one.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=inspect.Parameter.empty if one.default is REQUIRED else one.default,
                annotation=hints[one.type],
            )
            for one in parameters
        ]
    )
