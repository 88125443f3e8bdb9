"""The `actionlib` command (also `rosaction`): actions, topics, services and interfaces.

Each module of this package without a leading underscore adds commands: its `register(subparsers)`
adds parsers and sets `run=function(args) -> int`. Names are ROS names and are remapped by `a:=b`,
`__ns:=...` or `--ros-args`, as in every node.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import pkgutil
import signal
import sys
import threading
import traceback
from importlib.metadata import version
from typing import TYPE_CHECKING, NoReturn

from actionlib_core.cli._command import while_read
from actionlib_core.exceptions import ActionlibError
from actionlib_core.names import parse_arguments
from actionlib_core.output import printable, run_program, tell
from actionlib_core.ros2_options import add_ros2_options, ros2_of_options

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from actionlib_core.node import Node

EXIT_FAILED = 1
EXIT_ERROR = 2
EXIT_INTERRUPTED = 128 + signal.SIGINT
EXIT_TERMINATED = 128 + signal.SIGTERM


class Terminated(KeyboardInterrupt):
    """SIGTERM was received; commands react as to Ctrl-C, since this is a `KeyboardInterrupt`."""


class UsageError(ActionlibError):
    """A command that cannot be carried out; the text says why and what to try."""


class _Parser(argparse.ArgumentParser):
    """An argument parser with our exit code, and advice in every error."""

    def error(self, message: str) -> NoReturn:
        way_out = f"Try '{self.prog} --help'."
        if message.startswith("unrecognized arguments: "):
            options = [word.partition("=")[0] for word in message.split()]
            early = [word for word in options if word in self._option_string_actions]
            if early:  # options of `actionlib` itself, which come before the command
                way_out = f"Try {early[0]} before the verb: {self.prog} {early[0]} ... VERB."
        self.exit(EXIT_ERROR, f"{self.prog}: {printable(message)}\n{way_out}\n")


def main(
    argv: Sequence[str] | None = None,
    *,
    node: Node | None = None,
    on_ready: Callable[[], object] = lambda: None,
) -> int:
    """Run the command line; returns the exit code.

    Exit codes: 0 success, 1 the goal or call did not succeed, 2 bad input or an output that cannot
    be written, 130 Ctrl-C, 143 SIGTERM.

    Args:
        argv: The arguments; those of the process when None.
        node: The node to use; None: the command joins the network itself.
        on_ready: Called after all imports, before the command starts.
    """
    given = list(sys.argv[1:] if argv is None else argv)
    return run_program("actionlib", lambda: _run(given, node, on_ready))


def _run(given: list[str], node: Node | None, on_ready: Callable[[], object]) -> int:
    debug = "--debug" in given
    try:
        # `--debug` may stand anywhere, also behind a command, where argparse does not know it.
        names = parse_arguments([word for word in given if word != "--debug"])
        args = _parser().parse_args(names.rest)
        args.node, args.names = node, names
        on_ready()
        code = 0  # remains if `while_read` ends the command: `actionlib list | head`
        with _terminable(), while_read(), ros2_of_options(args):
            code = int(args.run(args))
            sys.stdout.flush()
    except Terminated:
        return EXIT_TERMINATED
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except ActionlibError as error:
        if debug:
            sys.stderr.write(printable("".join(traceback.format_exception(error))))
        else:
            tell("actionlib", str(error))
        return EXIT_ERROR
    return code


@contextlib.contextmanager
def _terminable() -> Iterator[None]:
    """Raise `Terminated` in the main thread on SIGTERM, inside the `with` block."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def on_signal(_number: int, _frame: object) -> None:
        raise Terminated

    before = signal.signal(signal.SIGTERM, on_signal)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


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
