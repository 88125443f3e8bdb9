"""Plans built in Python: actions, sequences, branches, forks, interrupts, loops; made into nets.

    from smachpy import pnp

    fetch = (
        pnp.action("goto", "kitchen")
        .interrupt("obstacle", pnp.action("wait", 5), then="restart_action")
        .then(pnp.fork(pnp.action("say", "hello"), pnp.action("wait", 2)))
    )
    plan = pnp.PetriNetPlan(fetch.net("fetch"), {"goto": goto, "say": say})

No threads, time or I/O.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from smachpy.exceptions import InvalidStateError, did_you_mean
from smachpy.machines.problems import Problems
from smachpy.pnp.conditions import ConditionError, parse
from smachpy.pnp.net import Arc, Net, Place, Transition

if TYPE_CHECKING:
    from collections.abc import Mapping

LASTS: Final = ("restart_action", "skip_action", "restart_plan", "fail_plan", "goal")
"""What may come after a recovery; or GOTO_ and a label."""

ACTION_FAILED: Final = "action_failed"
_NAME = re.compile(r"[^\s()\[\].;|<>{}:?!*][^\s()\[\];|<>{}:?!*]*")
_DEEPEST: Final = 100


@dataclass(frozen=True)
class Part:
    """A part of a plan; made by `action`, `sense`, `choose`, `fork`, `loop`, `mark`, `go_to`, ...

    Attributes:
        line: Of the text it was read from; 0 when there is none.
    """

    line: int = 0

    def then(self, *parts: Part) -> Part:
        """Return this part followed by others."""
        return Sequence_(0, tuple(_flat((self, *parts))))

    def net(self, name: str = "plan", *, file: str = "") -> Net:
        """Return the plan as a net; where the part ends is its goal.

        Raises:
            InvalidStateError: a label that is gone to is not there, or the plan is empty.
        """
        return _Weaver(name, file).net(self)


def _flat(parts: tuple[Any, ...]) -> list[Part]:
    problems = Problems("plan")
    found: list[Part] = []
    for part in parts:
        if not isinstance(part, Part):
            problems.add(f"got {part!r}; expected a part of a plan. Try pnp.action(...).")
        found += part.parts if isinstance(part, Sequence_) else [part]
    problems.raise_all()
    return found


@dataclass(frozen=True)
class Sequence_(Part):  # noqa: N801  `Sequence` is a container of smachpy
    """Parts one after the other."""

    parts: tuple[Part, ...] = ()


@dataclass(frozen=True)
class Rule:
    """What interrupts an action, and what is done then.

    Attributes:
        condition: Its text; "action_failed" for the failure of the action.
        recovery: What is done.
        last: What comes after: one of `LASTS`, or GOTO_ and a label.
    """

    condition: str
    recovery: tuple[Part, ...]
    last: str


@dataclass(frozen=True)
class Action(Part):
    """One action.

    Attributes:
        name: As in labels.
        seconds: It is interrupted after so long [s]; None: no limit.
        rules: What else interrupts it.
        branches: Pairs (condition, part): its ends. Empty: it ends when it has finished.
    """

    name: str = ""
    seconds: str | None = None
    rules: tuple[Rule, ...] = ()
    branches: tuple[tuple[str, Part], ...] = ()

    def interrupt(self, condition: str, *recovery: Part, then: str = "restart_action") -> Action:
        """Return the action with something that interrupts it.

        Args:
            condition: When; "action_failed": when the action fails.
            recovery: What is done then.
            then: What comes after: 'restart_action', 'skip_action', 'restart_plan', 'fail_plan',
                'goal', or 'GOTO_' and a label.

        Raises:
            InvalidStateError: an argument is wrong; all problems at once.
        """
        problems = Problems(self.name)
        _check_condition(problems, condition)
        if then not in LASTS and not str(then).startswith("GOTO_"):
            problems.add(
                f"then: got {then!r}; expected one of {list(LASTS)}, or 'GOTO_' and a label."
                f"{did_you_mean(then, LASTS)}"
            )
        problems.raise_all()
        rule = Rule(condition, tuple(_flat(recovery)), then)
        return replace(self, rules=(*self.rules, rule))

    def within(self, seconds: float) -> Action:
        """Return the action with a limit: it is interrupted after so long [s]."""
        problems = Problems(self.name)
        checked = problems.seconds("within", seconds, optional=False)
        problems.raise_all()
        return replace(self, seconds=f"{checked:.9f}".rstrip("0").rstrip("."))


@dataclass(frozen=True)
class Choice(Part):
    """The first branch whose condition holds."""

    branches: tuple[tuple[str, Part], ...] = ()


@dataclass(frozen=True)
class Fork(Part):
    """All parts at once; it ends when all have."""

    parts: tuple[Part, ...] = ()


@dataclass(frozen=True)
class Loop(Part):
    """A part again and again, until a condition holds when it has ended; "": for ever."""

    part: Part = Part()
    until: str = ""


@dataclass(frozen=True)
class Mark(Part):
    """A label that `go_to` leads to."""

    name: str = ""


@dataclass(frozen=True)
class GoTo(Part):
    """The plan goes on at a label; "goal" and "fail" are the plan's ends, "init" its beginning."""

    name: str = ""


NOTHING: Final = Sequence_()


def action(name: str, *parameters: object, robot: str = "") -> Action:
    """Return an action: `action("goto", "kitchen", robot="r1")` is `r1#goto_kitchen`.

    Raises:
        InvalidStateError: that is no name for a label.
    """
    words = "_".join(map(str, (name, *parameters)))
    whole = f"{robot}#{words}" if robot else words
    if not _NAME.fullmatch(whole):
        raise InvalidStateError(
            f"action: got {whole!r}; expected a name without blanks, brackets and .;|<>{{}}:?!*"
        )
    return Action(0, whole)


def sense(act: Action, branches: Mapping[str, Part | None]) -> Part:
    """Return an action that ends in one of several ways: condition -> what comes then."""
    return replace(act, branches=_branches("sense", branches))


def choose(branches: Mapping[str, Part | None]) -> Part:
    """Return a choice: condition -> what comes then; it waits until one holds."""
    return Choice(0, _branches("choose", branches))


def fork(*parts: Part) -> Part:
    """Return parts that run at once; it ends when all have ended."""
    return Fork(0, tuple(Sequence_(0, tuple(_flat((part,)))) for part in parts))


def loop(*parts: Part, until: str = "") -> Part:
    """Return parts that are done again and again until a condition holds at their end."""
    if until:
        problems = Problems("loop")
        _check_condition(problems, until)
        problems.raise_all()
    return Loop(0, Sequence_(0, tuple(_flat(parts))), until)


def mark(name: str) -> Part:
    """Return a label that `go_to` leads to."""
    return Mark(0, name)


def go_to(name: str) -> Part:
    """Return a jump to a label; "goal", "fail" and "init" are there by themselves."""
    return GoTo(0, name)


def _branches(what: str, given: Mapping[str, Part | None]) -> tuple[tuple[str, Part], ...]:
    problems = Problems(what)
    branches = problems.mapping("branches", given, "condition -> part of a plan, or None")
    if not branches:
        problems.add("branches: got none; expected some.")
    for condition, part in branches.items():
        _check_condition(problems, condition)
        if part is not None and not isinstance(part, Part):
            problems.add(f"{condition}: got {part!r}; expected a part of a plan.")
    problems.raise_all()
    return tuple((condition, part or NOTHING) for condition, part in branches.items())


def _check_condition(problems: Problems, condition: object) -> None:
    try:
        parse(condition if isinstance(condition, str) else "")
    except ConditionError as error:
        problems.add(f"condition: got {condition!r}: {error.problem}")


class _Weaver:
    """Makes a net of a part.

    A place is known by its number until the end: its name may change, when it becomes the goal.
    """

    def __init__(self, name: str, file: str) -> None:
        self._name = name
        self._file = file
        self._places: list[tuple[str, int]] = []
        self._transitions: list[tuple[str, int]] = []
        self._arcs: list[Arc] = []
        self._labels: dict[str, int] = {}
        self._jumps: list[tuple[str, int, int]] = []
        self._problems = Problems(name)
        self._depth = 0

    def net(self, part: Part) -> Net:
        init = self._place("init")
        self._labels["init"] = init
        end = self._weave(part, init)
        if end == init:
            self._problems.add("got no action; expected some.")
        wants_goal = any(label == "goal" for label, _, _ in self._jumps)
        if end is not None and not wants_goal and end not in self._labels.values():
            self._places[end] = ("goal", self._places[end][1])
        elif end is not None:
            self._jumps.append(("goal", end, 0))
        for label in ("goal", "fail"):
            if label not in self._labels and any(one == label for one, _, _ in self._jumps):
                self._labels[label] = self._place(label)
        for label, place, line in self._jumps:
            if label not in self._labels:
                known = sorted(self._labels)
                where = f"line {line}: " if line else ""
                self._problems.add(
                    f"{where}label: got {label!r}; expected one of {known}."
                    f"{did_you_mean(label, known)}"
                )
            else:
                self._transition("", [place], [self._labels[label]], line)
        self._problems.raise_all()
        return Net(
            self._name,
            tuple(
                Place(f"p{number}", name, int(number == init), line)
                for number, (name, line) in enumerate(self._places)
            ),
            tuple(
                Transition(f"t{number}", name, line)
                for number, (name, line) in enumerate(self._transitions)
            ),
            tuple(self._arcs),
            self._file,
        )

    def _place(self, name: str = "", line: int = 0) -> int:
        number = len(self._places)
        self._places.append((name or f"X{number}", line))
        return number

    def _transition(self, name: str, inputs: list[int], outputs: list[int], line: int) -> None:
        own = f"t{len(self._transitions)}"
        self._transitions.append((name, line))
        self._arcs += [Arc(f"p{place}", own) for place in inputs]
        self._arcs += [Arc(own, f"p{place}") for place in outputs]

    def _weave(self, part: Part, entry: int) -> int | None:
        """Add a part that begins at a place; return where it ends, None when it goes elsewhere."""
        self._depth += 1
        if self._depth > _DEEPEST:
            raise InvalidStateError(f"{self._name}: got more than {_DEEPEST} parts in each other.")
        try:
            return self._woven(part, entry)
        finally:
            self._depth -= 1

    def _woven(self, part: Part, entry: int) -> int | None:  # noqa: PLR0911  one for each kind
        match part:
            case Action():
                return self._action(part, entry)
            case Sequence_(parts=parts):
                return self._sequence(parts, entry)
            case Choice(branches=branches):
                return self._merge(
                    [(self._guarded(c, entry, part.line), one) for c, one in branches]
                )
            case Fork(parts=parts):
                return self._fork(parts, entry, part.line)
            case Loop(part=body, until=until):
                return self._loop(body, until, entry)
            case Mark(name=name):
                if name in self._labels:
                    self._problems.add(f"label: got {name!r} a second time; expected it once.")
                self._labels[name] = entry
                return entry
            case GoTo(name=name):
                self._jumps.append((name, entry, part.line))
                return None
        raise AssertionError(part)

    def _sequence(self, parts: tuple[Part, ...], entry: int) -> int | None:
        at: int | None = entry
        for part in parts:
            # What follows a jump is reached by a label in it, or by nobody.
            at = self._weave(part, self._place() if at is None else at)
        return at

    def _guarded(self, condition: str, entry: int, line: int) -> int:
        place = self._place("", line)
        self._transition(f"[{condition}]", [entry], [place], line)
        return place

    def _merge(self, branches: list[tuple[int, Part]]) -> int | None:
        """Weave each part from its place, and bring their ends together."""
        ends = [self._weave(part, place) for place, part in branches]
        left = [end for end in ends if end is not None]
        if len(left) <= 1:
            return left[0] if left else None
        out = self._place()
        for end in left:
            self._transition("", [end], [out], 0)
        return out

    def _fork(self, parts: tuple[Part, ...], entry: int, line: int) -> int:
        begins = [self._place("", line) for _ in parts]
        self._transition("fork", [entry], begins, line)
        ends = [self._weave(part, place) for part, place in zip(parts, begins, strict=True)]
        if None in ends:
            self._problems.add("fork: got a branch that goes elsewhere; expected it to end.")
        out = self._place()
        self._transition("join", [end for end in ends if end is not None], [out], line)
        return out

    def _loop(self, body: Part, until: str, entry: int) -> int | None:
        end = self._weave(body, entry)
        if end is None:
            return None
        if not until:
            self._transition("", [end], [entry], 0)
            return None
        out = self._place()
        self._transition(f"[{until}]", [end], [out], 0)
        self._transition(f"[not ({until})]", [end], [entry], 0)
        return out

    def _action(self, part: Action, entry: int) -> int | None:
        name, line = part.name, part.line
        execs = [self._place(f"{name}.exec", line)]
        limit = "" if part.seconds is None else f"wait_{part.seconds}"
        if limit:
            execs.append(self._place(f"{limit}.exec", line))
        both = f" {limit}.{{}}" if limit else ""
        self._transition(f"{name}.start{both.format('start')}", [entry], execs, line)
        stop = both.format("interrupt")
        ends: list[tuple[int, Part]] = []
        for condition, branch in part.branches:
            place = self._place("", line)
            self._transition(f"{name}.end{stop} [{condition}]", execs, [place], line)
            ends.append((place, branch))
        if part.branches:
            out = self._merge(ends)
        else:
            out = self._place("", line)
            self._transition(f"{name}.end{stop}", execs, [out], line)
        if limit:
            out = self._place("", line) if out is None else out
            self._transition(f"{limit}.end {name}.interrupt", execs, [out], line)
        for rule in part.rules:
            out = self._rule(part, rule, execs, stop, entry, out)
        return out

    def _rule(
        self, part: Action, rule: Rule, execs: list[int], stop: str, entry: int, out: int | None
    ) -> int | None:
        """Add an interrupt and its recovery; return where the action ends."""
        begin = self._place("", part.line)
        label = f"{part.name}.interrupt{stop} [{rule.condition}]"
        if rule.condition == ACTION_FAILED:
            label = f"{part.name}.fail{stop}"
        self._transition(label, execs, [begin], part.line)
        end = self._sequence(rule.recovery, begin)
        if end is None:
            return out
        if rule.last == "skip_action":
            out = self._place() if out is None else out
            self._transition("", [end], [out], part.line)
        elif rule.last == "restart_action":
            self._transition("", [end], [entry], part.line)
        else:
            words = {"restart_plan": "init", "fail_plan": "fail", "goal": "goal"}
            label = words.get(rule.last, rule.last.removeprefix("GOTO_"))
            self._jumps.append((label, end, part.line))
        return out
