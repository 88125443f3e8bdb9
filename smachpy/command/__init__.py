"""The `smachpy` command; its subcommands are entry points.

A package adds a subcommand with an entry point in the group `smachpy.commands` whose object is a
function `register(subparsers)`. It adds one parser and sets `run=function(args) -> int`. If it also
sets `words=()`, it receives the words after the first `--` there, and ROS name remapping (`a:=b`,
`--ros-args`) in `names`. If it sets `all_words=()`, it receives all words there, except a lone
`--help`: they are meant for another program.
"""

from __future__ import annotations

import argparse
import signal
import sys
import traceback
from importlib.metadata import EntryPoint, entry_points, version
from typing import TYPE_CHECKING, Any, NoReturn

from actionlib_core.exceptions import ActionlibError
from actionlib_core.names import parse_arguments
from actionlib_core.output import printable, run_program, tell
from smachpy.command.extras import advice
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

GROUP = "smachpy.commands"
EXIT_ERROR = 2
_HELP = (["-h"], ["--help"])
EXIT_INTERRUPTED = 128 + signal.SIGINT


class UsageError(SmachError):
    """The command cannot do what was asked; the text says why and what to try."""


class _Parser(argparse.ArgumentParser):
    """argparse with smachpy's exit code and the hint `--help` in every error."""

    def error(self, message: str, way_out: str = "") -> NoReturn:
        way_out = printable(f"Try '{self.prog} --help'{way_out}.")
        self.exit(EXIT_ERROR, f"{self.prog}: {printable(message)}\n{way_out}\n")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Separate the words for this command from those for the mission that it runs."""
        if args and self.get_default("all_words") is not None and args not in _HELP:
            found, _ = super().parse_known_args([], namespace)
            found.all_words = tuple(args)
            return found, []
        if args is None or self.get_default("words") is None:
            found, unknown = super().parse_known_args(args, namespace)
        else:
            end = args.index("--") if "--" in args else len(args)
            names = parse_arguments(args[:end])
            found, unknown = super().parse_known_args(list(names.rest), namespace)
            found.words, found.names = tuple(args[end + 1 :]), names
        # Reported here: argparse would report it for the parser above, without its usage.
        if unknown:
            text = " ".join(unknown)
            way_out = ""
            if self.get_default("words") is not None and "--" not in args:
                way_out = f", or '-- {text}' if the mission or script itself takes them"
            self.error(f"unrecognized arguments: {text}", way_out)
        return found, []


def main(
    argv: Sequence[str] | None = None, *, on_ready: Callable[[], object] = lambda: None
) -> int:
    """Run the command line and return the exit code.

    Exit codes: 0 success, 1 the mission or check did not succeed, 2 bad input or an output that
    cannot be written, 130 Ctrl-C.

    Args:
        argv: The arguments; None takes those of the process.
        on_ready: Called when everything is imported, before the command starts.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    return run_program("smachpy", lambda: _run(arguments, on_ready), draws=True)


def _run(arguments: list[str], on_ready: Callable[[], object]) -> int:
    try:
        args = _parser(arguments).parse_args(arguments)
        on_ready()
        return int(args.run(args))
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except (SmachError, ActionlibError) as error:
        return _report(error, str(error), debug="--debug" in arguments)
    except ImportError as error:
        text = advice(error)
        if text is None:
            raise
        return _report(error, text, debug="--debug" in arguments)


def _report(error: Exception, text: str, *, debug: bool) -> int:
    if debug:
        sys.stderr.write(printable("".join(traceback.format_exception(error))))
    else:
        tell("smachpy", text)
    return EXIT_ERROR


def _parser(arguments: Sequence[str]) -> argparse.ArgumentParser:
    parser = _Parser(
        prog="smachpy",
        description="Robot missions: run, draw and test them.",
        epilog="Begin with: smachpy run patrol --start-robot",
    )
    parser.add_argument("--version", action="version", version=f"smachpy {version('smachpy')}")
    subparsers = parser.add_subparsers(
        metavar="COMMAND", required=True, parser_class=_Parser, dest="command"
    )
    for command in _wanted(arguments):
        _load(command)(subparsers)
    for subparser in subparsers.choices.values():
        subparser.add_argument("--debug", action="store_true", help="show tracebacks of errors")
    return parser


def _wanted(arguments: Sequence[str]) -> list[EntryPoint]:
    """Return only the given command, so that the others need not be imported; without one, all."""
    commands = sorted(entry_points(group=GROUP), key=lambda command: command.name)
    first = next((word for word in arguments if not word.startswith("-")), None)
    return [command for command in commands if command.name == first] or commands


def _load(command: EntryPoint) -> Callable[[Any], None]:
    try:
        register: Callable[[Any], None] = command.load()
    except ImportError as error:
        text = advice(error)
        if text is None:
            missing = isinstance(error, ModuleNotFoundError)
            what = f"package {error.name!r} is missing" if missing else str(error)
            text = f"{what}. Try: pip install smachpy"
        raise UsageError(f"smachpy {command.name}: {text}") from error
    return register
