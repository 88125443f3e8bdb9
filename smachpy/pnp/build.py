"""Plans built in Python from actions, sequences, branches, forks, interrupts and loops, as nets.

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

from smachpy.base.problems import Problems
from smachpy.exceptions import InvalidStateError, did_you_mean
from smachpy.pnp.conditions import ConditionError, parse
from smachpy.pnp.net import MAX_PARTS, Arc, Net, Place, Transition

if TYPE_CHECKING:
    from collections.abc import Mapping

LASTS: Final = ("restart_action", "skip_action", "restart_plan", "fail_plan", "goal")
"""How a recovery may end; or with GOTO_ and a label."""

ACTION_FAILED: Final = "action_failed"
# Dots, brackets, ';', '|' and others separate parts of labels or of plans in text form.
_NAME = re.compile(r"[^\s()\[\].;|<>{}:?!*][^\s()\[\];|<>{}:?!*]*")
_MAX_PART_NESTING: Final = 100


@dataclass(frozen=True)
class Part:
    """A part of a plan; `action`, `sense`, `choose`, `fork`, `loop`, `mark` and `go_to` return one.

    Attributes:
        line: Its line in the text of the plan; 0 if there is no text.
    """

    line: int = 0

    def then(self, *parts: Part) -> Part:
        """Return this part followed by others."""
        return Sequence_(0, tuple(_flat((self, *parts))))

    def net(self, name: str = "plan", *, file: str = "") -> Net:
        """Return the plan as a net; its goal is the end of the part.

        Raises:
            InvalidStateError: the label of a jump is missing, or the plan is empty.
        """
        return _NetBuilder(name, file).net(self)


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
    """Parts that run one after the other."""

    parts: tuple[Part, ...] = ()


@dataclass(frozen=True)
class Interrupt:
    """A condition that interrupts an action, and the recovery that follows.

    Attributes:
        condition: The text of the condition; "action_failed" for the failure of the action.
        recovery: The parts of the recovery.
        last: The step after the recovery: one of `LASTS`, or GOTO_ and a label.
    """

    condition: str
    recovery: tuple[Part, ...]
    last: str


@dataclass(frozen=True)
class Action(Part):
    """One action.

    Attributes:
        name: Its name, as in labels.
        seconds: Time after which it is interrupted [s], as a text; None: no limit.
        rules: Other interrupts.
        branches: Its ends, pairs (condition, part that follows); if empty, it has one end, when it
            has finished.
    """

    name: str = ""
    seconds: str | None = None
    rules: tuple[Interrupt, ...] = ()
    branches: tuple[tuple[str, Part], ...] = ()

    def interrupt(self, condition: str, *recovery: Part, then: str = "restart_action") -> Action:
        """Return the action with an interrupt.

        Args:
            condition: The condition that interrupts it; "action_failed": its failure.
            recovery: The parts that follow.
            then: The step after the recovery: 'restart_action', 'skip_action', 'restart_plan',
                'fail_plan', 'goal', or 'GOTO_' and a label.

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
        rule = Interrupt(condition, tuple(_flat(recovery)), then)
        return replace(self, rules=(*self.rules, rule))

    def within(self, seconds: float) -> Action:
        """Return the action with a limit [s] after which it is interrupted."""
        problems = Problems(self.name)
        checked = problems.seconds("within", seconds, optional=False)
        problems.raise_all()
        # As in the label `wait_N`: no exponent, and no zeros at the end.
        return replace(self, seconds=f"{checked:.9f}".rstrip("0").rstrip("."))


@dataclass(frozen=True)
class Choice(Part):
    """Waits until the condition of a branch is true, and runs that branch."""

    branches: tuple[tuple[str, Part], ...] = ()


@dataclass(frozen=True)
class Fork(Part):
    """Parts that run at the same time; it ends when all of them have ended."""

    parts: tuple[Part, ...] = ()


@dataclass(frozen=True)
class Loop(Part):
    """A part that is repeated until a condition is true when it has ended; "": for ever."""

    part: Part = Part()
    until: str = ""


@dataclass(frozen=True)
class Mark(Part):
    """A label, the target of a `go_to`."""

    name: str = ""


@dataclass(frozen=True)
class GoTo(Part):
    """A jump to a label; "goal" and "fail" are the ends of the plan, "init" is its beginning."""

    name: str = ""


NOTHING: Final = Sequence_()


def action(name: str, *parameters: object, robot: str = "") -> Action:
    """Return an action: `action("goto", "kitchen", robot="r1")` is `r1#goto_kitchen`.

    Raises:
        InvalidStateError: the name cannot be used in a label.
    """
    words = "_".join(map(str, (name, *parameters)))
    whole = f"{robot}#{words}" if robot else words
    if not _NAME.fullmatch(whole):
        raise InvalidStateError(
            f"action: got {whole!r}; expected a name without blanks, brackets and .;|<>{{}}:?!*"
        )
    return Action(0, whole)


def sense(act: Action, branches: Mapping[str, Part | None]) -> Part:
    """Return an action with several ends: condition -> part that follows, or None."""
    return replace(act, branches=_branches("sense", branches))


def choose(branches: Mapping[str, Part | None]) -> Part:
    """Return a choice: condition -> part that follows, or None; it waits until one is true."""
    return Choice(0, _branches("choose", branches))


def fork(*parts: Part) -> Part:
    """Return parts that run at the same time; it ends when all of them have ended."""
    return Fork(0, tuple(Sequence_(0, tuple(_flat((part,)))) for part in parts))


def loop(*parts: Part, until: str = "") -> Part:
    """Return parts that are repeated until a condition is true at their end."""
    if until:
        problems = Problems("loop")
        _check_condition(problems, until)
        problems.raise_all()
    return Loop(0, Sequence_(0, tuple(_flat(parts))), until)


def mark(name: str) -> Part:
    """Return a label, as the target of a `go_to`."""
    return Mark(0, name)


def go_to(name: str) -> Part:
    """Return a jump to a label; "goal", "fail" and "init" always exist."""
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


class _NetBuilder:
    """Builds the net of a part.

    Places have numbers here, as the name of the last one changes if it becomes the goal.
    """

    def __init__(self, name: str, file: str) -> None:
        self._name = name
        self._file = file
        self._places: list[tuple[str, int]] = []  # name, line
        self._transitions: list[tuple[str, int]] = []  # name, line
        self._arcs: list[Arc] = []
        self._labels: dict[str, int] = {}  # label of a jump -> place
        self._jumps: list[tuple[str, int, int]] = []  # label, place before the jump, line
        self._problems = Problems(name)
        self._depth = 0

    def net(self, part: Part) -> Net:
        init = self._place("init")
        self._labels["init"] = init
        end = self._add(part, init)
        if end == init:
            self._problems.add("got no action; expected some.")
        # The last place is the goal, unless jumps lead to the goal or to that place: these get a
        # goal place of their own.
        wants_goal = any(label == "goal" for label, _, _ in self._jumps)
        if end is not None and not wants_goal and end not in self._labels.values():
            self._places[end] = ("goal", self._places[end][1])
        elif end is not None:
            self._jumps.append(("goal", end, 0))
        for label in ("goal", "fail"):
            if label not in self._labels and any(one == label for one, _, _ in self._jumps):
                self._labels[label] = self._place(label)
        # Last, as a label may stand behind the jumps to it.
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
        if number + len(self._transitions) >= MAX_PARTS:
            raise InvalidStateError(f"{self._name}: got more than {MAX_PARTS:,} nodes.")
        self._places.append((name or f"X{number}", line))
        return number

    def _transition(self, name: str, inputs: list[int], outputs: list[int], line: int) -> None:
        own = f"t{len(self._transitions)}"
        self._transitions.append((name, line))
        self._arcs += [Arc(f"p{place}", own) for place in inputs]
        self._arcs += [Arc(own, f"p{place}") for place in outputs]

    def _add(self, part: Part, entry: int) -> int | None:
        """Add a part from the place `entry`; return its last place, None if it ends in a jump."""
        # An error with the plan's name rather than a RecursionError.
        self._depth += 1
        if self._depth > _MAX_PART_NESTING:
            raise InvalidStateError(
                f"{self._name}: got more than {_MAX_PART_NESTING} parts in each other."
            )
        try:
            return self._add_part(part, entry)
        finally:
            self._depth -= 1

    def _add_part(self, part: Part, entry: int) -> int | None:  # noqa: PLR0911  one for each kind
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
            # The part after a jump can only be reached by a label in it: it gets its own place.
            at = self._add(part, self._place() if at is None else at)
        return at

    def _guarded(self, condition: str, entry: int, line: int) -> int:
        place = self._place("", line)
        self._transition(f"[{condition}]", [entry], [place], line)
        return place

    def _merge(self, branches: list[tuple[int, Part]]) -> int | None:
        """Add each part from its place, and join their ends."""
        ends = [self._add(part, place) for place, part in branches]
        left = [end for end in ends if end is not None]  # the others end in jumps
        if len(left) <= 1:
            return left[0] if left else None
        out = self._place()
        for end in left:
            self._transition("", [end], [out], 0)
        return out

    def _fork(self, parts: tuple[Part, ...], entry: int, line: int) -> int:
        begins = [self._place("", line) for _ in parts]
        self._transition("fork", [entry], begins, line)
        ends = [self._add(part, place) for part, place in zip(parts, begins, strict=True)]
        if None in ends:  # the join would never get its token
            self._problems.add("fork: got a branch that ends in a jump; expected none.")
        out = self._place()
        self._transition("join", [end for end in ends if end is not None], [out], line)
        return out

    def _loop(self, body: Part, until: str, entry: int) -> int | None:
        end = self._add(body, entry)
        if end is None:
            return None
        if not until:
            self._transition("", [end], [entry], 0)
            return None
        out = self._place()
        # The guards exclude each other: exactly one of the two transitions fires.
        self._transition(f"[{until}]", [end], [out], 0)
        self._transition(f"[not ({until})]", [end], [entry], 0)
        return out

    def _action(self, part: Action, entry: int) -> int | None:
        name, line = part.name, part.line
        # A time limit is an action `wait_N` beside it: the first of the two to end stops the other.
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
        if limit:  # the time is over first
            out = self._place("", line) if out is None else out
            self._transition(f"{limit}.end {name}.interrupt", execs, [out], line)
        for rule in part.rules:
            out = self._rule(part, rule, execs, stop, entry, out)
        return out

    def _rule(
        self,
        part: Action,
        rule: Interrupt,
        execs: list[int],
        stop: str,
        entry: int,
        out: int | None,
    ) -> int | None:
        """Add an interrupt and its recovery; return the last place of the action."""
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
        elif rule.last == "restart_action":  # back to the place before its start
            self._transition("", [end], [entry], part.line)
        else:
            words = {"restart_plan": "init", "fail_plan": "fail", "goal": "goal"}
            label = words.get(rule.last, rule.last.removeprefix("GOTO_"))
            self._jumps.append((label, end, part.line))
        return out
