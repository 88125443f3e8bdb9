"""The `actionlib` command (also `rosaction`): actions, topics, services and interfaces.

Each module of this package without a leading underscore adds commands: its `register(subparsers)`
adds parsers and sets `run=function(args) -> int`. Names are ROS names and are remapped by `a:=b`,
`__ns:=...` or `--ros-args`, as in every node.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
from importlib.metadata import version
from typing import TYPE_CHECKING, NoReturn

from actionlib_core.cli._command import while_read
from actionlib_core.command_line.program import EXIT_ERROR as EXIT_ERROR
from actionlib_core.command_line.program import EXIT_FAILED as EXIT_FAILED
from actionlib_core.command_line.program import CommandParser, run_command
from actionlib_core.command_line.ros2_options import add_ros2_options, ros2_of_options
from actionlib_core.exceptions import ActionlibError, more_about
from actionlib_core.names import parse_arguments
from actionlib_core.shutdown import terminable

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

    from actionlib_core.node import Node


class UsageError(ActionlibError):
    """A command that cannot be carried out; the text says why and what to try."""


class _Parser(CommandParser):
    """A parser that knows which options stand before the command."""

    def error(self, message: str, way_out: str = "") -> NoReturn:
        if message.startswith("unrecognized arguments: "):
            options = [word.partition("=")[0] for word in message.split()]
            early = [word for word in options if word in self._option_string_actions]
            if early:  # options of `actionlib` itself
                way_out = f"Try {early[0]} before the verb: {self.prog} {early[0]} ... VERB."
        super().error(message, way_out)


def main(
    argv: Sequence[str] | None = None,
    *,
    node: Node | None = None,
    on_ready: Callable[[], object] = lambda: None,
) -> int:
    """Run the command line; returns the exit code.

    Exit codes: 0 success, 1 the goal or call did not succeed, 2 bad input or an output that cannot
    be written, 130 Ctrl-C, 143 SIGTERM, 129 a closed terminal, 131 SIGQUIT.

    Args:
        argv: The arguments; those of the process when None.
        node: The node to use; None: the command joins the network itself.
        on_ready: Called after all imports, before the command starts.
    """
    given = list(sys.argv[1:] if argv is None else argv)
    return run_command("actionlib", given, lambda: _run(given, node, on_ready), _text_of)


def _run(given: list[str], node: Node | None, on_ready: Callable[[], object]) -> int:
    # `--debug` may stand anywhere, also behind a command, where argparse does not know it.
    names = parse_arguments([word for word in given if word != "--debug"])
    args = _parser().parse_args(names.rest)
    args.node, args.names = node, names
    on_ready()
    code = 0  # remains if `while_read` ends the command: `actionlib list | head`
    with terminable(), while_read(), ros2_of_options(args):
        code = int(args.run(args))
        sys.stdout.flush()
    return code


def _text_of(error: Exception) -> str | None:
    if isinstance(error, UsageError):
        return str(error)
    return f"{error}\n{more_about(type(error))}" if isinstance(error, ActionlibError) else None


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="actionlib",
        description="Look at, use and operate actions, topics and services.",
        epilog="--debug shows tracebacks. SMACHPY_CONFIG names the network configuration.",
    )
    parser.add_argument("--version", action="version", version=f"actionlib {version('smachpy')}")
    parser.add_argument("--config", metavar="FILE", help="how to join the network")
    add_ros2_options(parser)
    subparsers = parser.add_subparsers(
        metavar="COMMAND", required=True, parser_class=_Parser, dest="command"
    )
    for module in sorted(pkgutil.iter_modules(__path__), key=lambda module: module.name):
        if not module.name.startswith("_"):
            importlib.import_module(f"{__name__}.{module.name}").register(subparsers)
    return parser
