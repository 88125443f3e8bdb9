"""A program of the command line: its parser, its exit codes, and its errors in a line each."""

from __future__ import annotations

import argparse
import signal
import sys
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from actionlib_core.process.output import printable, run_program, tell
from actionlib_core.shutdown import EXIT_SIGNAL, Terminated

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

EXIT_FAILED = 1
EXIT_ERROR = 2
EXIT_INTERRUPTED = EXIT_SIGNAL + signal.SIGINT


class CommandParser(argparse.ArgumentParser):
    """An argument parser with our exit code, and a way out in every error."""

    def error(self, message: str, way_out: str = "") -> NoReturn:
        """End the program with an error; `way_out` is "Try ..."."""
        way_out = printable(way_out or f"Try '{self.prog} --help'.")
        self.exit(EXIT_ERROR, f"{self.prog}: {printable(message)}\n{way_out}\n")


def run_command(
    program: str,
    words: Sequence[str],
    run: Callable[[], int],
    text_of: Callable[[Exception], str | None],
    *,
    draws: bool = False,
) -> int:
    """Run a command, whose output is checked; return its exit code: see `smachpy.command.main`.

    Args:
        program: The program, for error texts.
        words: Its words; `--debug` is one that shows tracebacks of errors.
        run: Runs the command.
        text_of: Returns the text of an error that needs no traceback; None for any other.
        draws: It writes control sequences to standard output, and escapes texts itself.
    """

    def checked() -> int:
        try:
            return run()
        except Terminated as error:
            return EXIT_SIGNAL + error.number
        except KeyboardInterrupt:
            return EXIT_INTERRUPTED
        except Exception as error:
            text = text_of(error) or _text_of_folder(error)
            if text is None:
                raise
            if "--debug" in words:
                sys.stderr.write(printable("".join(traceback.format_exception(error))))
            else:
                tell(program, text)
            return EXIT_ERROR

    return run_program(program, checked, draws=draws)


def _text_of_folder(error: Exception) -> str | None:
    """Return the text of an error that comes from a current folder that is not there any more."""
    if not isinstance(error, FileNotFoundError) or error.filename is not None:
        return None
    try:
        Path.cwd()
    except FileNotFoundError:
        return "the current folder: got one that was removed; expected one that is there. Try cd."
    return None
