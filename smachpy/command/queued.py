"""What a row of a store may make a computer run.

Whoever may write to a store chooses the target and the arguments of its rows, but not the code of
the computers that run them: these run missions, and only those that they have installed or that
their own command line allows. `smachpy runner`, `smachpy missions resume` and *Resume* on the page
start what a row names by `smachpy run --queued`, which reads the row itself: what is checked is
what is run.
"""

from __future__ import annotations

import contextlib
import inspect
import re
import typing
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from smachpy.command.arguments import Text
from smachpy.command.targets import (
    DEFAULT_NAMES,
    GROUP,
    TargetError,
    is_data,
    mission_names,
    names_file,
)
from smachpy.exceptions import MissionError
from smachpy.machines.container import Container
from smachpy.machines.mission_info import is_mission

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable, Iterator, Sequence

    from smachpy.command.targets import Target
    from smachpy.durable.store import MissionRow

_MODULE: Final = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")


def add_allow(parser: Any, why: str) -> None:
    """Add the option `--allow`.

    Args:
        parser: The parser.
        why: The begin of its help.
    """
    parser.add_argument(
        "--allow",
        action="append",
        default=[],
        metavar="PLACE",
        help=f"{why}: a file, a folder with all below it, or a module (repeatable; default: "
        "installed missions only)",
    )


def add_allow_packages(parser: Any) -> None:
    """Add the option `--allow` of commands that a person gives a mission file."""
    parser.add_argument(
        "--allow",
        action="append",
        default=[],
        metavar="PACKAGE",
        help="let a mission file name code of this package, besides modules in its own folder "
        "(repeatable)",
    )


class Allowed:
    """The missions that a row may name: the installed ones, and those of some places.

    Args:
        places: Files, folders, and modules or packages.
    """

    def __init__(self, places: Iterable[str | Path] = ()) -> None:
        texts = [str(place) for place in places]
        self._paths = [Path(text).resolve() for text in texts]
        self._modules = [text for text in texts if _MODULE.fullmatch(text)]
        self._installed = {point.value for point in entry_points(group=GROUP)}

    def problem(self, target: str, by: str = "row") -> str:
        """Return why a target must not be run that a row, or something else, names.

        The text has the way out; "" if it may be run.
        """
        place, _, attribute = target.partition(":")
        if names_file(place):
            return self._problem_of_file(place, by)
        if target in self._installed or (not attribute and target in mission_names()):
            return ""
        if any(f"{place}.".startswith(f"{one}.") for one in self._modules):
            return ""
        return (
            f"a {by} names it; expected an installed mission, or one that is allowed here. "
            f"Try --allow {place or 'FILE'}, if it is yours."
        )

    def _problem_of_file(self, place: str, by: str) -> str:
        if not Path(place).is_absolute():
            return f"got the file {place!r} in a {by}; expected an absolute path."
        # Resolved, as a link may lead out of an allowed folder.
        try:
            path = Path(place).resolve()
        except (OSError, ValueError) as error:
            return f"got the file {place!r:.200} in a {by} ({error}); expected a path."
        if any(path == one or one in path.parents for one in self._paths):
            return ""
        return (
            f"a {by} names it; expected a file that is allowed here. "
            f"Try --allow {place}, if it is yours."
        )


def check_is_mission(target: Target, by: str = "row") -> None:
    """Refuse what is no mission before it is called, if a row or something else names it.

    A mission is a machine, a function with `@smachpy.mission`, or a function of that file which is
    called `mission`, `machine` or `sm`, or whose annotation says that it returns a machine; or a
    plan or a mission file.

    Raises:
        TargetError: it is something else.
    """
    thing, source = target.thing, target.source
    module, _, name = source.rpartition(":")
    if (
        isinstance(thing, Container)
        or is_mission(thing)
        or is_data(source)  # `load_target` takes each such name for a file
        or source in {point.value for point in entry_points(group=GROUP)}
    ):
        return
    own = inspect.isfunction(thing) and thing.__module__ == module
    if own and (name in DEFAULT_NAMES or _returns_machine(thing)):
        return
    raise TargetError(
        target.name,
        f"a {by} names {source}, which is {thing!r:.200}; expected a mission. "
        "Try @smachpy.mission on the function.",
    )


def _returns_machine(function: Any) -> bool:
    try:
        kind = typing.get_type_hints(function).get("return")
    except Exception:  # noqa: BLE001  a name that is imported under TYPE_CHECKING: not known
        return False
    return isinstance(kind, type) and issubclass(kind, Container)


def arguments_of(row: MissionRow) -> tuple[list[tuple[str, Text]], tuple[str, ...]]:
    """Return the `--input` pairs of a row, and the words after `--`.

    Raises:
        TargetError: the row has options of the command, or anything else.
    """
    words: Sequence[str] = row.argv
    inputs = []
    while len(words) > 1 and words[0] == "--input":
        key, equals, value = words[1].partition("=")
        if not (key and equals):
            break
        inputs.append((key, Text(value)))
        words = words[2:]
    if words and words[0] != "--":
        raise TargetError(
            row.target,
            f"mission {row.id!r} has the argument {words[0]!r:.200}; expected only arguments of "
            "the mission's function.",
        )
    return inputs, tuple(words[1:])


def take_row(args: argparse.Namespace) -> None:
    """Replace target, inputs and words of `smachpy run --queued` by those of the mission's row.

    Raises:
        TargetError: the row's target is not allowed, or it has other arguments.
        SmachError: the row cannot be read.
    """
    from smachpy.durable.opening import open_store

    with contextlib.closing(open_store(args.durable, create=False)) as store:
        row = store.mission(args.mission)
    problem = Allowed(args.allow).problem(row.target)
    if problem:
        raise TargetError(row.target, problem)
    args.target, args.robot = row.target, row.robot or ""
    args.input, args.words = arguments_of(row)


@contextlib.contextmanager
def given_back(args: argparse.Namespace) -> Iterator[None]:
    """Note in a row why its mission did not begin, if a runner reserved it for this process."""
    from smachpy.durable.mission import note_of
    from smachpy.durable.opening import open_store
    from smachpy.durable.processes import this_runner
    from smachpy.durable.store import Lease

    try:
        yield
    except Exception as error:
        if args.reserved is not None:
            runner, fence = args.reserved
            # Refused if the mission has begun: the end of its journal has a note then.
            with (
                contextlib.suppress(MissionError),
                contextlib.closing(open_store(args.durable, create=False)) as store,
            ):
                lease = Lease(args.mission, fence, runner)
                store.release(lease, None, note=note_of(this_runner(), error))
        raise


def run_words(
    journal: str, mission: str, allow: Iterable[str], evidence: Iterable[str] = ()
) -> list[str]:
    """Return the words of the command that runs a row's mission; `evidence` is required."""
    # The target is the row's; this one is only shown, and "=" keeps a value from being an option.
    words = ["run", "mission-of-a-row", "--queued", f"--durable={journal}", f"--mission={mission}"]
    words += [f"--allow={place}" for place in allow]
    return [*words, *(f"--require-evidence={place}" for place in evidence)]
