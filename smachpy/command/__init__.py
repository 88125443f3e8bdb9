"""The `smachpy` command; its subcommands are entry points.

A package adds a subcommand with an entry point in the group `smachpy.commands` whose object is a
function `register(subparsers)`. It adds one parser and sets `run=function(args) -> int`. If it also
sets `words=()`, it receives the words after the first `--` there, and ROS name remapping (`a:=b`,
`--ros-args`) in `names`. If it sets `all_words=()`, it receives all words there, except a lone
`--help`: they are meant for another program.
"""

from __future__ import annotations

import argparse
import sys
from importlib.metadata import EntryPoint, entry_points, version
from typing import TYPE_CHECKING, Any

from actionlib_core.command_line.program import EXIT_ERROR as EXIT_ERROR
from actionlib_core.command_line.program import CommandParser, run_command
from actionlib_core.exceptions import ActionlibError, more_about
from actionlib_core.names import parse_arguments
from actionlib_core.shutdown import terminable
from smachpy.command.extras import advice
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

GROUP = "smachpy.commands"
SUMMARIES = {
    "new": "write a mission to begin with, and its test",
    "list": "list the missions",
    "run": "run a mission",
    "check": "find mistakes in a machine without running it",
    "test": "test missions with pytest",
    "explore": "run a mission with every outcome of its states",
    "render": "draw a state machine into a file",
    "simulate": "do many runs of a mission in virtual time",
    "certify": "try a mission in all ways, and write what was found",
    "view": "watch running machines in a browser",
    "runs": "list, show, compare and export recorded runs",
    "answer": "answer the question of a mission",
    "robot": "start the simulated robot",
    "doctor": "diagnose the connection to a ROS 2 robot, and the size of a journal",
    "bridge": "connect robots that use another middleware",
    "missions": "list, show, resume, cancel, forget and prune durable missions",
    "submit": "put a mission into the queue of runners",
    "runner": "run the missions of a queue",
    "port": "rewrite a ROS 1 script with the API of smachpy",
    "export": "write a machine as a mission file or a Petri net",
    "states": "list the states that mission files can name",
    "completion": "print what completes commands in bash or zsh",
}
"""What `smachpy --help` says of our own commands, which need not be imported for that."""
_HELP = (["-h"], ["--help"])


class UsageError(SmachError):
    """The command cannot do what was asked; the text says why and what to try."""


class _Parser(CommandParser):
    """A parser that separates the words of a mission, and names of the network, from its own."""

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
                way_out = (
                    f"Try '{self.prog} --help', or '-- {text}' if the mission or script itself "
                    "takes them."
                )
            self.error(f"unrecognized arguments: {text}", way_out)
        return found, []


def main(
    argv: Sequence[str] | None = None, *, on_ready: Callable[[], object] = lambda: None
) -> int:
    """Run the command line and return the exit code.

    Exit codes: 0 success, 1 the mission or check did not succeed, 2 bad input or an output that
    cannot be written; 130 Ctrl-C, 143 SIGTERM, 129 a closed terminal, 131 SIGQUIT.

    Args:
        argv: The arguments; None takes those of the process.
        on_ready: Called when everything is imported, before the command starts.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    return run_command(
        "smachpy", arguments, lambda: _run(arguments, on_ready), _text_of, draws=True
    )


def _run(arguments: list[str], on_ready: Callable[[], object]) -> int:
    args = _parser(arguments).parse_args(arguments)
    on_ready()
    with terminable():
        return int(args.run(args))


def _text_of(error: Exception) -> str | None:
    if isinstance(error, UsageError):
        return str(error)
    if isinstance(error, SmachError | ActionlibError):
        return f"{error}\n{more_about(type(error))}"
    return advice(error) if isinstance(error, ImportError) else None


def _parser(arguments: Sequence[str] | None) -> argparse.ArgumentParser:
    parser = _Parser(
        prog="smachpy",
        description="Robot missions: run, draw and test them.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="""\
begin with:
  smachpy run countdown                a first run, without a robot
  smachpy new my_mission               a mission of your own, with its test
  smachpy run patrol --start-robot     a simulated robot; needs: pip install 'smachpy[sim]'""",
    )
    parser.add_argument("--version", action="version", version=f"smachpy {version('smachpy')}")
    subparsers = parser.add_subparsers(
        metavar="COMMAND", required=True, parser_class=_Parser, dest="command"
    )
    for command in _wanted(arguments):
        if isinstance(command, str):
            subparsers.add_parser(command, help=SUMMARIES[command])
        else:
            _load(command)(subparsers)
    for subparser in subparsers.choices.values():
        subparser.add_argument("--debug", action="store_true", help="show tracebacks of errors")
    return parser


def full_parser() -> argparse.ArgumentParser:
    """Return the parser with all options of all commands.

    Raises:
        UsageError: a command cannot be loaded.
    """
    return _parser(None)


def _wanted(arguments: Sequence[str] | None) -> list[EntryPoint | str]:
    """Return what to offer: the given command alone, so that the others need not be imported.

    Without one, or with an unknown one, only help or an error is printed: ours are only named then.
    """
    found = {command.name: command for command in entry_points(group=GROUP)}
    known = [name for name in SUMMARIES if name in found]
    commands = {name: found[name] for name in [*known, *sorted(found)]}
    if arguments is None:
        return list(commands.values())
    first = next((word for word in arguments if not word.startswith("-")), None)
    if first in commands:
        return [commands[first]]
    return [name if name in SUMMARIES else command for name, command in commands.items()]


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
