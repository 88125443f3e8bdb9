"""The world of a recording as the lines of a test: what servers, topics and operators do.

A script is less than the recording: it is what a person would write. `written` tries whether the
mission still takes the recorded way with it, and leaves out what it can.
"""

from __future__ import annotations

import keyword
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces import get_action, get_message, get_service
from smachpy.reproduce.world import is_outline
from smachpy.userdata.json_text import decoded

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from smachpy.reproduce.world import Answer, RecordedCall, RecordedGoal, World
    from smachpy.testing.kit import MissionKit

AT_ONCE_S: Final = 0.05
"""What comes so soon comes at once [s]."""

AFTER_S: Final = 0.01
"""A message for a new subscriber is published so much later: it must be there [s]."""

DIGITS: Final = 3
"""Of times in a script, behind the point."""

_SMALL: Final = 100  # integers that fit, with one more, into every type

_STATUS: Final = {"ABORTED": "aborted", "PREEMPTED": "preempted", "RECALLED": "preempted"}


def source(value: Any) -> str:
    """Return a value as a test writes it, with double quotes."""
    if isinstance(value, str):
        text = repr(value)
        return text if '"' in text or text[:1] == '"' else f'"{text[1:-1]}"'.replace("\\'", "'")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{source(key)}: {source(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(map(source, value))}]"
    return repr(value)


@dataclass(frozen=True, slots=True)
class End:
    """A scripted server or topic.

    Attributes:
        fixture: "action_server", "service_server" or "topic".
        name: Its name.
        type: Type of the action, service or message.
        word: The variable in the test.
    """

    fixture: str
    name: str
    type: str
    word: str

    @property
    def kind(self) -> Any:
        """The class of its type."""
        find = {"action_server": get_action, "service_server": get_service, "topic": get_message}
        return find[self.fixture](self.type)


@dataclass(frozen=True, slots=True)
class Line:
    """A call in a test: `word.method(*values, **named)`.

    Attributes:
        word: The variable; "mission" for the kit.
        method: Its method.
        values, named: The arguments.
        may_go: The line may be left out.
    """

    word: str
    method: str
    values: tuple[Any, ...] = ()
    named: tuple[tuple[str, Any], ...] = ()
    may_go: bool = False

    def without(self, name: str) -> Line:
        """Return the line without a named argument."""
        left = tuple((key, value) for key, value in self.named if key != name)
        return Line(self.word, self.method, self.values, left, self.may_go)

    def text(self) -> str:
        """Return it as Python."""
        said = [source(value) for value in self.values]
        said += [f"{key}={source(value)}" for key, value in self.named]
        return f"{self.word}.{self.method}({', '.join(said)})"


@dataclass(slots=True)
class Script:
    """The servers and topics of a test, and what they do.

    Attributes:
        ends: In the order of the test.
        lines: Also.
        gaps: What cannot be written, in words.
    """

    ends: list[End] = field(default_factory=list)
    lines: list[Line] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)

    def play(self, kit: MissionKit) -> dict[str, Any]:
        """Do it in a test; return variable -> server or topic."""
        made: dict[str, Any] = {"mission": kit}
        for end in self.ends:
            made[end.word] = getattr(kit, end.fixture)(end.name, end.kind)
        for line in self.lines:
            getattr(made[line.word], line.method)(*line.values, **dict(line.named))
        return made

    def used(self) -> list[End]:
        """Return the ends that the test needs: a topic without a message is none."""
        spoken = {line.word for line in self.lines}
        return [end for end in self.ends if end.fixture != "topic" or end.word in spoken]


def script_of(world: World, namespace: str, channels: dict[str, str]) -> Script:
    """Return the script of a recorded world.

    Args:
        world: The world.
        namespace: The mission's, which the names in the test do not have.
        channels: Path of a state that asks a person -> its channel.
    """
    script = Script()
    words = _Words(script, namespace)
    for name, action in world.actions.items():
        if not action.is_own and (action.is_there or action.goals):
            word = words.of("action_server", name, action.type)
            deaths = _deaths(world, name)
            script.lines += [_of_goal(word, goal, deaths) for goal in action.goals]
    for name, service in world.services.items():
        calls = [call for call in service.calls if call.state != "ServiceUnavailableError"]
        if not service.is_own and calls:
            word = words.of("service_server", name, service.type)
            script.lines += [_of_call(word, call) for call in calls]
    for act in world.acts:
        at = round(act.t - world.began, DIGITS)
        if act.what == "message":
            word = words.of("topic", act.name, act.type)
            latch = world.topics[act.name]
            script.lines.append(_of_message(word, at + AFTER_S, act.value, latch=latch))
        elif act.what == "answer":
            channel = channels.get(act.name, "operator")
            word = words.of("topic", f"{channel}/answer", "std_msgs/String")
            named = (("data", act.text),)
            script.lines.append(Line(word, "publish_at", (at,), named, may_go=True))
        elif act.what == "preempt" and (act.state != "operator" or not act.value):
            is_signal = act.state in {"signal", "shutdown"}
            method = "interrupt" if is_signal else "preempt"
            script.lines.append(Line("mission", method, (), (("at", at),)))
        elif act.what in {"preempt", "asked"}:
            script.gaps.append(f"{act.value or act.name} at {at:g} s, by {act.state or 'a caller'}")
    return script


class _Words:
    """Finds a variable for each server and topic."""

    def __init__(self, script: Script, namespace: str) -> None:
        self._script = script
        self._prefix = f"{namespace}/" if namespace else ""
        self._known: dict[tuple[str, str], str] = {}

    def of(self, fixture: str, name: str, type_name: str) -> str:
        """Return the variable of an end, which is added if it is new."""
        short = name.removeprefix(self._prefix)
        if (fixture, short) not in self._known:
            word = "".join(c if c.isalnum() else "_" for c in short.lower()).strip("_") or "end"
            word = f"the_{word}" if word[0].isdigit() else word
            while word in {"mission", "run", *self._known.values()} or keyword.iskeyword(word):
                word += "_"
            self._known[fixture, short] = word
            self._script.ends.append(End(fixture, short, type_name, word))
        return self._known[fixture, short]


def _deaths(world: World, name: str) -> list[tuple[float, float | None]]:
    """Return when a server died, and when it was back."""
    found: list[tuple[float, float | None]] = []
    for act in world.acts:
        if act.what == "server" and act.name == name:
            if act.state == "down":
                found.append((act.t, None))
            elif act.state == "up" and found and found[-1][1] is None:
                found[-1] = (found[-1][0], act.t)
    return found


def _of_goal(word: str, goal: RecordedGoal, deaths: Iterable[tuple[float, float | None]]) -> Line:
    accept = next((one.after for one in goal.answers if one.what == "accept"), None)
    end = goal.end
    took = None if goal.ended is None else goal.ended - goal.t
    is_lost = end is not None and end.state == "LOST"
    for died, back in deaths if is_lost and took is not None else ():
        if goal.t <= died <= goal.t + (took or 0.0) + AT_ONCE_S:
            after = ("after", round(died - goal.t, DIGITS))
            again = () if back is None else (("back_after", round(back - died, DIGITS)),)
            return Line(word, "die", (), (after, *again))
    if end is None or end.state == "LOST":
        return Line(word, "never_answer" if accept is None else "never_finish")
    return _of_ended(word, goal, end, accept)


def _of_ended(word: str, goal: RecordedGoal, end: Answer, accept: float | None) -> Line:
    """Return the line for a goal that the server ended."""
    if end.state == "REJECTED":
        return Line(word, "reject", (), (("text", end.text),) if end.text else ())
    is_late = accept is not None and accept > AT_ONCE_S and not _is_after_cancel(goal, "accept")
    begun = accept if is_late and accept is not None else 0.0
    duration = round(max(0.0, (goal.ended or goal.t) - goal.t - begun), DIGITS)
    named = _named(goal, duration)
    if goal.cancelled is None:
        if is_late:
            return Line(word, "accept_late", (round(begun, DIGITS),), named)
        return Line(word, "reply", (), named)
    if end.of_cancel and end.after < AT_ONCE_S and end.state in _STATUS:
        return Line(word, "never_finish")
    rest = tuple(pair for pair in named if pair[0] != "duration")
    return Line(word, "ignore_cancel", (round(duration + AFTER_S, DIGITS),), rest)


def _is_after_cancel(goal: RecordedGoal, what: str) -> bool:
    return any(one.of_cancel for one in goal.answers if one.what == what)


def _named(goal: RecordedGoal, duration: float) -> tuple[tuple[str, Any], ...]:
    """Return the arguments of a reply."""
    end = goal.end
    assert end is not None
    found: list[tuple[str, Any]] = []
    if result := fields_of(end.value):
        found.append(("result", result))
    if end.state in _STATUS:
        found.append(("status", _STATUS[end.state]))
    if duration:
        found.append(("duration", duration))
    feedback = [fields_of(one.value) for one in goal.answers if one.what == "feedback"]
    if feedback and all(one is not None for one in feedback):
        found.append(("feedback", feedback))
    if end.text:
        found.append(("text", end.text))
    return tuple(found)


def _of_call(word: str, call: RecordedCall) -> Line:
    duration = round(call.after or 0.0, DIGITS)
    took = (("duration", duration),) if duration > AT_ONCE_S else ()
    if call.after is None or call.state in {"ServiceTimeoutError", "NodeError"}:
        return Line(word, "never_answer")
    if call.state == "ServiceLostError":
        return Line(word, "die", (), (("after", duration),))
    if call.state:
        return Line(word, "fail", (call.text,) if call.text else (), took)
    return Line(word, "reply", (fields_of(call.response) or {},), took)


def _of_message(word: str, at: float, value: Any, *, latch: bool) -> Line:
    return message_line(word, round(at, DIGITS), fields_of(value) or {}, latch=latch)


def message_line(word: str, at: float, fields: dict[str, Any], *, latch: bool) -> Line:
    """Return the line that publishes a message."""
    is_flat = all(
        not isinstance(one, dict | list) and key.isidentifier() for key, one in fields.items()
    )
    kept = (("latch", True),) if latch else ()
    if is_flat and not {"at", "message", "latch"} & fields.keys():
        return Line(word, "publish_at", (at,), (*fields.items(), *kept), may_go=True)
    return Line(word, "publish_at", (at, fields), kept, may_go=True)


def fewer_fields(line: Line) -> list[tuple[Line, Line]]:
    """Return the lines that publish the message without one of its fields, outer ones first.

    Beside each is the line that has other values in that field. Only if that makes no difference
    either, the field does not matter: a battery of 0.29 is below a limit, and so is one of 0.
    """
    if line.method != "publish_at":
        return []
    named = dict(line.named)
    latch = bool(named.pop("latch", False))
    fields = line.values[1] if len(line.values) > 1 else named

    def made(less: dict[str, Any]) -> Line:
        return message_line(line.word, line.values[0], less, latch=latch)

    return [(made(less), made(other)) for less, other in _less(fields)]


def rounder_fields(line: Line) -> list[tuple[Line]]:
    """Return the lines that publish the message with rounder numbers, the roundest first.

    They stay near: a test of a battery just below a limit must see when the limit is lowered.
    """
    if line.method != "publish_at":
        return []
    named = dict(line.named)
    latch = bool(named.pop("latch", False))
    fields = line.values[1] if len(line.values) > 1 else named
    found = (_rounded(fields, digits) for digits in (DIGITS, DIGITS + 1))
    return [
        (message_line(line.word, line.values[0], one, latch=latch),)
        for one in found
        if one != fields
    ]


def _rounded(value: Any, digits: int) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(one, digits) for key, one in value.items()}
    if isinstance(value, list):
        return [_rounded(one, digits) for one in value]
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


def _less(fields: dict[str, Any]) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    found = [
        ({key: one for key, one in fields.items() if key != gone}, {**fields, gone: _other(value)})
        for gone, value in fields.items()
    ]
    for key, one in fields.items():
        if isinstance(one, dict):
            found += [({**fields, key: less}, {**fields, key: other}) for less, other in _less(one)]
    return found


def _other(value: Any) -> Any:
    """Return a value of the same type that differs everywhere."""
    if isinstance(value, dict):
        return {key: _other(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_other(one) for one in value]
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1 if value < _SMALL else value - 1
    if isinstance(value, float):
        return value * 10.0 + 1000.0
    return f"{value}_" if isinstance(value, str) else value


def fields_of(value: Any) -> dict[str, Any] | None:
    """Return the fields of a recorded message as a test writes them; None if it is not whole."""
    if not isinstance(value, dict) or is_outline(value) or "fields" not in value:
        return None
    try:
        found = decoded(value["fields"], "message")
    except ValueError:
        return None
    return found if isinstance(found, dict) else None


def kinds(ends: Sequence[End]) -> dict[str, str]:
    """Return the classes to import: name -> module."""
    found = {}
    for end in ends:
        kind = end.kind
        found[kind.__name__] = kind.__module__
    return found
