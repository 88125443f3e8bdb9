"""Writes a test from a recording: what a person would have written, and no more of it.

Whatever can be left out without changing the mission's way is left out: messages, feedback,
results, texts. What is written has been run.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces._sources import BUNDLED
from smachpy.base.problems import unknown_name
from smachpy.command.arguments import Text, parameters_of, read_words
from smachpy.command.targets import PLANS, is_data, load_target, names_file
from smachpy.events.introspection import describe
from smachpy.exceptions import SmachError
from smachpy.machines.container import Container
from smachpy.reproduce.compare import steps_of
from smachpy.reproduce.run import ReproductionError, check_machine, maker, reproduce
from smachpy.reproduce.script import (
    Line,
    Script,
    fewer_fields,
    kinds,
    rounder_fields,
    script_of,
    source,
)
from smachpy.reproduce.world import first_run, world_of
from smachpy.testing.kit import MissionKit
from smachpy.testing.runs import find_path
from smachpy.testing.servers import ScriptedActionServer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from smachpy.events.introspection import StateRecord
    from smachpy.events.recording import Recording
    from smachpy.reproduce.script import End
    from smachpy.testing.runs import Run

MOST_RUNS: Final = 300
"""Runs to shorten a test."""

MOST_S: Final = 60.0
"""Time for that [s]."""

WIDTH: Final = 100
MOST_LINES: Final = 200
"""A longer script is nothing that somebody reads: the test reads the recording instead."""

_USUAL: Final = frozenset({"succeeded", "valid", "done", "came"})
"""Outcomes that a test need not mention."""

_WAY: Final = frozenset({"Started", "Entered", "Left", "Finished"})


@dataclass(frozen=True, slots=True)
class Way:
    """What a test asserts of a run.

    Attributes:
        outcome: The outcome.
        lanes: Begins and ends of states, by branch.
        goals: Action -> number of goals.
        cancelled: Action -> number of cancelled ones.
    """

    outcome: str | None
    lanes: tuple[tuple[str, tuple[Any, ...]], ...]
    goals: tuple[tuple[str, int], ...]
    cancelled: tuple[tuple[str, int], ...]


@dataclass(frozen=True, slots=True)
class Written:
    """A test.

    Attributes:
        text: The file's content.
        runs: Number of runs for shortening it.
        notes: What it leaves open, in words.
    """

    text: str
    runs: int
    notes: tuple[str, ...]


def write_test(
    recording: Recording,
    *,
    mission: str = "",
    allow: Iterable[str | Path] = (),
    expect: str = "",
    folder: str | Path = ".",
) -> Written:
    """Write a test of the run of a recording.

    Args:
        recording: The recording.
        mission: The mission, as for `reproduce`.
        allow: As for `reproduce`.
        expect: The outcome that the mission ought to have had, one of its outcomes: the test fails
            until it is mended.
        folder: Where the test will be: it names files relative to itself.

    Raises:
        ReproductionError: the recording does not say enough, or `expect` is no outcome.

    Blocks: until it is shortened, `MOST_S` at most.
    """
    events = first_run(recording.events)
    if not events or recording.origin is None:
        raise ReproductionError(recording.path, "it has no inputs, or not the begin of the run.")
    make = maker(recording, mission, allow)
    try:
        with MissionKit():
            record = describe(make())
            check_machine(recording, events[0]["path"], record)
    except ReproductionError:
        raise
    except (SmachError, ActionlibError) as error:
        raise ReproductionError(recording.path, str(error)) from error
    if expect and expect not in record.outcomes:
        raise ReproductionError(recording.path, unknown_name("expect", expect, record.outcomes))
    world = world_of(recording)
    recorded = _recorded_way(recording, events)
    namespace = str(recording.origin.get("namespace") or "")
    channels = {
        event["path"]: event["service"].rpartition("/questions/")[0].removeprefix(f"{namespace}/")
        for event in events
        if event["kind"] == "QuestionAsked"
    }
    script = script_of(world, namespace, channels)
    trial = _Trial(make, recorded)
    plain = _without(script, "feedback")
    chosen = plain if trial.holds(plain) else script
    if trial.record is None or (chosen is script and not trial.holds(script)):
        why = "what the world did cannot be written as a script"
        return _from_recording(recording, mission, allow, expect, trial.runs, Path(folder), why)
    short = _shortened(chosen, trial)
    if len(short.lines) > MOST_LINES:
        why = f"what the world did would be {len(short.lines)} lines"
        return _from_recording(recording, mission, allow, expect, trial.runs, Path(folder), why)
    run = trial.run_of(short)
    assert run is not None
    call = _call(recording, mission, allow, Path(folder))
    text = _text(recording, short, run, trial.counts, call=call, expect=expect)
    return Written(text, trial.runs, tuple(script.gaps))


def beside(recording: Recording, mission: str) -> Path:
    """Return the folder of the mission's file, or else that of the recording."""
    then = {} if recording.origin is None else recording.origin["mission"]
    place = (mission or str(then.get("target"))).partition(":")[0]
    return Path(place if names_file(place) else recording.path).resolve().parent


class _Trial:
    """Tries whether the mission takes the recorded way with a script."""

    def __init__(self, make: Callable[[], Container], wanted: Way) -> None:
        self.runs = 0
        self.record: StateRecord | None = None
        self.counts: dict[str, tuple[int, int]] = {}  # of the newest run: goals, cancelled ones
        self._make = make
        self._wanted = wanted
        self._begun = RealClock().now()

    def may_go_on(self) -> bool:
        """Return whether there is time for another run."""
        return self.runs < MOST_RUNS and RealClock().now() < self._begun + MOST_S

    def holds(self, script: Script) -> bool:
        """Return whether the mission takes the recorded way."""
        return self.run_of(script) is not None

    def run_of(self, script: Script) -> Run | None:
        """Return the run; None if it takes another way."""
        self.runs += 1
        kit = MissionKit()
        kit.draws = False
        try:
            with kit:
                if self.record is None:  # its module may define the types of its messages
                    self.record = describe(self._make())
                ends = script.play(kit)
                run = kit(self._make())
                way = _way_of(run, ends)
                self.counts = {
                    word: (len(end.goals), len(end.cancelled))
                    for word, end in ends.items()
                    if isinstance(end, ScriptedActionServer)
                }
        except (SmachError, AssertionError, RuntimeError):
            return None
        return run if way == self._wanted and not run.unfired else None


def _recorded_way(recording: Recording, events: list[dict[str, Any]]) -> Way:
    world = world_of(recording)
    finished = events[-1] if events[-1]["kind"] == "Finished" else {}
    counted = {
        name: (len(action.goals), sum(goal.cancelled is not None for goal in action.goals))
        for name, action in world.actions.items()
        if not action.is_own and (action.is_there or action.goals)
    }
    return Way(
        finished.get("outcome"),
        _lanes(events, recording.record),
        _counts(count for count, _ in counted.values()),
        _counts(count for _, count in counted.values()),
    )


def _way_of(run: Run, ends: dict[str, Any]) -> Way:
    from smachpy.events import to_record

    servers = [end for end in ends.values() if isinstance(end, ScriptedActionServer)]
    return Way(
        run.outcome,
        _lanes([to_record(event) for event in run.events], run.record),
        _counts(len(server.goals) for server in servers),
        _counts(len(server.cancelled) for server in servers),
    )


def _counts(numbers: Iterable[int]) -> tuple[tuple[str, int], ...]:
    return tuple((str(number), count) for number, count in enumerate(numbers))


def _lanes(events: list[dict[str, Any]], record: StateRecord) -> tuple[tuple[str, Any], ...]:
    lanes: dict[str, list[Any]] = {}
    for step in steps_of([event for event in events if event["kind"] in _WAY], record, ()):
        lanes.setdefault(step.lane, []).append(step.sameness)
    return tuple(sorted((lane, tuple(steps)) for lane, steps in lanes.items()))


# -- shortening ------------------------------------------------------------------------------------


def _without(script: Script, name: str) -> Script:
    return replace(script, lines=[line.without(name) for line in script.lines])


def _shortened(script: Script, trial: _Trial) -> Script:
    """Leave out what the way does not need."""
    for name in ("text", "result"):
        tried = _without(script, name)
        if tried.lines != script.lines and trial.may_go_on() and trial.holds(tried):
            script = tried
    script = _with_fewer_lines(script, trial)
    for number in range(len(script.lines)):
        script = _with_simpler_line(script, number, trial)
    return script


def _with_simpler_line(script: Script, number: int, trial: _Trial) -> Script:
    """Simplify a line as long as that is possible."""
    while True:
        for lines in _simpler(script.lines[number]):
            if not trial.may_go_on():
                return script
            tried = [
                replace(script, lines=[*script.lines[:number], line, *script.lines[number + 1 :]])
                for line in lines
            ]
            if all(map(trial.holds, tried)):
                script = tried[0]
                break
        else:
            return script


def _with_fewer_lines(script: Script, trial: _Trial) -> Script:
    """Leave out lines, first many at once and at last each alone."""
    size = max(1, sum(line.may_go for line in script.lines))
    while size:
        at = 0
        while trial.may_go_on():
            places = [n for n, line in enumerate(script.lines) if line.may_go][at : at + size]
            if not places:
                break
            left = [line for n, line in enumerate(script.lines) if n not in places]
            tried = replace(script, lines=left)
            if trial.holds(tried):
                script = tried
            else:
                at += size
        size //= 2
    return script


def _simpler(line: Line) -> Iterator[tuple[Line, ...]]:
    """Yield lines that say less than a line, or have rounder times.

    Each with those that must do as well.
    """
    if line.method == "ignore_cancel":
        yield (Line(line.word, "never_finish"),)
    yield from fewer_fields(line)
    yield from rounder_fields(line)
    times = {"at", "after", "duration", "back_after"}
    for digits in (0, 1):
        values = tuple(
            _rounded(one, digits) if isinstance(one, float) and not n else one
            for n, one in enumerate(line.values)
        )
        named = tuple(
            (key, _rounded(one, digits) if key in times else one) for key, one in line.named
        )
        named = tuple(pair for pair in named if pair != ("duration", 0))  # the default
        rounder = replace(line, values=values, named=named)
        if repr(rounder) != repr(line):
            yield (rounder,)


def _rounded(seconds: float, digits: int) -> float:
    return round(seconds, digits) if digits else round(seconds)


# -- the text --------------------------------------------------------------------------------------


def _text(
    recording: Recording,
    script: Script,
    run: Run,
    counts: dict[str, tuple[int, int]],
    *,
    call: tuple[str, list[str]],
    expect: str,
) -> str:
    ends = script.used()
    made_by, imports = call
    made = datetime.fromtimestamp(recording.made_ns / 1e9, UTC)
    name = re.sub(r"[^a-z0-9]+", "_", run.record.label.lower()).strip("_")
    outcome = expect or run.outcome or "ends"
    fixtures = sorted({end.fixture for end in ends})
    lines = [
        f'"""What {run.record.label} did on {made:%Y-%m-%d at %H:%M:%S} UTC."""',
        "",
        *_import_lines(ends, imports),
        "",
        "",
        f"def test_{name}_{_word(outcome)}({', '.join(['mission', *fixtures])}):",
    ]
    for end in ends:
        lines.append(f"    {end.word} = {end.fixture}({source(end.name)}, {end.kind.__name__})")
        lines += [_wrapped(line.text()) for line in script.lines if line.word == end.word]
        if expect and end.fixture == "action_server":
            lines.append(f"    {end.word}.default_result()  # what a mended mission may ask for")
    lines += [_wrapped(line.text()) for line in script.lines if line.word == "mission"]
    lines.append(f"    run = mission({made_by})")
    if expect:
        lines.append(f"    run.assert_outcome({source(expect)})")
        return "\n".join(lines) + "\n"
    lines += _path_lines(_short_path(run))
    lines += _outcome_lines(run)
    lines.append(f"    run.assert_outcome({source(run.outcome)})")
    for end in ends:
        goals, cancelled = counts.get(end.word, (0, 0))
        if end.word in counts:
            lines.append(f"    assert len({end.word}.goals) == {goals}")
        if cancelled:
            lines.append(f"    assert len({end.word}.cancelled) == {cancelled}")
    return "\n".join(lines) + "\n"


def _short_path(run: Run) -> list[str]:
    """Return the shortest names of the states that ran."""
    names: dict[str, str] = {}
    for path in run.path:
        words = path.strip("/").split("/")
        for count in range(1, len(words) + 1):
            word = "/".join(words[-count:])
            try:
                if find_path(run.record, word) == path:
                    names.setdefault(path, word)
                    break
            except SmachError:
                continue
        names.setdefault(path, path)
    return [names[path] for path in run.path]


def _outcome_lines(run: Run) -> Iterator[str]:
    """Yield an assert for each leaf that did not just succeed."""
    names = dict(zip(run.path, _short_path(run), strict=True))
    for path, name in names.items():
        outcomes = run.outcomes(path)
        if not _USUAL.issuperset(outcomes):
            listed = ", ".join(map(source, outcomes)) + ("," if len(outcomes) == 1 else "")
            yield _wrapped(f"assert run.outcomes({source(name)}) == ({listed})")


def _word(outcome: str) -> str:
    return re.sub(r"\W+", "_", outcome.lower()).strip("_") or "ends"


def _wrapped(text: str) -> str:
    """Return a statement of a test."""
    line = f"    {text}"
    return line if len(line) <= WIDTH else f"{line}  # noqa: E501"


def _path_lines(names: list[str]) -> list[str]:
    line = f"    run.assert_path({source(names)})"
    if len(line) <= WIDTH:
        return [line]
    return [
        "    run.assert_path(",
        "        [",
        *(f"            {source(n)}," for n in names),
        "        ]",
        "    )",
    ]


def _import_lines(ends: Iterable[End], imports: list[str]) -> list[str]:
    wanted = [f"from {module} import {name}" for name, module in kinds(list(ends)).items()]
    plain = [line for line in imports if line in {"import sys", _PATH}]
    first = [line for line in imports if line.startswith("sys.")]
    own = [line for line in imports if line not in {*plain, *first}]
    if any(not (BUNDLED / end.type.partition("/")[0]).is_dir() for end in ends):
        return [*plain, *first, *own, "", *sorted(wanted)]  # the mission defines types of messages
    if first:
        return [
            *plain,
            "",
            *sorted(wanted),
            *([""] if wanted else []),
            *first,
            "",
            *[f"{line}  # noqa: E402" for line in own],
        ]
    return [*plain, *([""] if plain else []), *sorted([*wanted, *own])]


def _call(
    recording: Recording, mission: str, allow: Iterable[str | Path], folder: Path
) -> tuple[str, list[str]]:
    """Return the expression that makes the machine, and the imports for it."""
    assert recording.origin is not None
    then = recording.origin["mission"]
    text = mission or str(then["target"])
    target = load_target(text, imports=False)
    arguments = _arguments(then, target) if not mission or mission == then.get("target") else ""
    if text.endswith(PLANS):
        imported = "from smachpy.pnp.files import load_plan"
        return f"load_plan({_here(text, folder)})", [_PATH, imported]
    if is_data(text):
        packages = [one for one in map(str, allow) if one.replace(".", "_").isidentifier()]
        allowed = [f"allow={source(packages)}"] if packages else []
        words = [_here(text, folder), *allowed, *([arguments] if arguments else [])]
        return f"load({', '.join(words)})", [_PATH, "from smachpy import load"]
    thing = target.thing
    is_machine = isinstance(thing, Container)
    module = getattr(thing, "__module__", "")
    name = getattr(thing, "__qualname__", "")
    place, _, attribute = text.partition(":")
    if place.endswith(".py") or "/" in place:
        path = Path(place).resolve()
        module, name = path.stem, attribute or _name_in(thing, name)
        imports = ["import sys", _PATH, f"sys.path.insert(0, str({_here(path.parent, folder)}))"]
    else:
        imports = []
        name = name or attribute
    if not name.isidentifier():
        raise ReproductionError(
            recording.path,
            f"{text!r} has no name that a test can import. Try --mission MODULE:NAME",
        )
    alias = f"make_{name}" if not is_machine else name
    imports.append(f"from {module} import {name}" + (f" as {alias}" if alias != name else ""))
    return (alias if is_machine else f"{alias}({arguments})"), imports


def _name_in(thing: Any, name: str) -> str:
    import sys

    module = sys.modules.get(getattr(thing, "__module__", ""), None)
    found = [key for key, value in vars(module).items() if value is thing] if module else []
    return name if name in found or not found else found[0]


def _arguments(then: dict[str, Any], target: Any) -> str:
    inputs = {key: Text(value) for key, value in dict(then.get("inputs", {})).items()}
    values = read_words(target, tuple(then.get("words", ())), inputs)
    known = parameters_of(target.thing)
    return ", ".join(f"{key}={source(value)}" for key, value in values.items() if key in known)


def _from_recording(
    recording: Recording,
    mission: str,
    allow: Iterable[str | Path],
    expect: str,
    runs: int,
    folder: Path,
    why: str,
) -> Written:
    """Return a test that reads the recording: its world cannot be written down."""
    notes = [f"{why}: the test reads the recording"]
    if not (expect or reproduce(recording, mission=mission, allow=allow).is_same):
        notes.append("today's run differs from the recorded one: the test fails")
    name = re.sub(r"[^a-z0-9]+", "_", recording.record.label.lower()).strip("_")
    assert recording.origin is not None
    target = mission or str(recording.origin["mission"]["target"])
    place, colon, attribute = target.partition(":")
    given = source(target)
    if names_file(place):
        attribute = f" + {source(colon + attribute)}" if colon else ""
        given = f"str(HERE / {_relative(place, folder)}){attribute}"
    check = (
        f"assert found.outcome == {source(expect)}"
        if expect
        else "assert found.is_same, lines_of(found)"
    )
    more = "" if expect else "from smachpy.reproduce.report import lines_of\n"
    text = f'''"""The recorded run of {recording.record.label}; its world is in the recording."""

from pathlib import Path

from smachpy.events.recording import read_recording
{more}from smachpy.reproduce.run import reproduce

HERE = Path(__file__).parent


def test_{name}_as_recorded():
    recording = read_recording(HERE / {_relative(recording.path, folder)})
    found = reproduce(recording, mission={given})
    {check}
'''
    return Written(text, runs, tuple(notes))


_PATH: Final = "from pathlib import Path"


def _here(place: str | Path, folder: Path) -> str:
    """Return the expression by which the test in `folder` finds a file or folder."""
    place = _relative(place, folder)
    return "Path(__file__).parent" + ("" if place == source(".") else f" / {place}")


def _relative(place: str | Path, folder: Path) -> str:
    """Return the text of a place as the test in `folder` finds it, also where both are moved to."""
    return source(os.path.relpath(Path(place).resolve(), folder.resolve()))
