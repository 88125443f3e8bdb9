"""Output of command-line programs: failed writes are reported, control characters are escaped.

A full disk or a closed standard output ends a program with exit code 2 and a line on standard
error. A reader that stops reading (`... | head`) is not an error.
"""

from __future__ import annotations

import contextlib
import io
import logging
import os
import sys
import threading
import traceback
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from types import TracebackType

    from _typeshed import ReadableBuffer

EXIT_OUTPUT: Final = 2
_KEPT: Final = frozenset("\n\t")
_LAST_STANDARD_FILE: Final = 2


def printable(text: object) -> str:
    """Return a text for a terminal: unprintable characters are escaped, except newline and tab."""
    words = str(text)
    if words.isprintable():
        return words
    return "".join(c if c.isprintable() or c in _KEPT else ascii(c)[1:-1] for c in words)


class _Checked(io.FileIO):
    """The file behind standard output; it stores the first error, even if code above catches it."""

    failed: OSError | None = None

    def write(self, data: ReadableBuffer, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            self.failed = self.failed or error
            raise


class _Escaping(io.TextIOWrapper):
    """Standard output of a program without control sequences: unprintable text is escaped."""

    def write(self, text: str, /) -> int:
        super().write(printable(text))
        return len(text)


def run_program(name: str, run: Callable[[], int], *, draws: bool = False) -> int:
    """Run a program whose output is checked; returns its exit code.

    Log messages that go to standard error, and tracebacks of threads, are escaped.

    Args:
        name: The program, for the error text.
        run: The program; it returns its exit code, or raises SystemExit.
        draws: It writes control sequences to standard output, and escapes texts itself.

    Raises:
        SystemExit: as `run`.
    """
    _fill_standard_files()
    if sys.stdout is None:
        tell(name, "standard output: it is closed; expected an open one. Try: > /dev/null")
        return EXIT_OUTPUT
    # A stream that a test or the caller has put there is left alone.
    real = sys.stdout is sys.__stdout__ and isinstance(sys.stdout, io.TextIOWrapper)
    before = sys.stdout
    file = _replace_output(io.TextIOWrapper if draws else _Escaping) if real else None
    if real:
        _escape_errors()
    end: SystemExit | None = None
    code = 0
    try:
        code = run()
    except SystemExit as asked:
        end = asked
    except BrokenPipeError:
        pass
    except OSError:
        if file is None or file.failed is None:
            raise
    with contextlib.suppress(OSError, ValueError):
        sys.stdout.flush()
    failed = None if file is None else file.failed
    if failed is not None:
        discard_output()  # first, as the rest of the buffer is written when the wrapper is freed
    sys.stdout = before
    if failed is None and end is not None:
        raise end
    if failed is None or isinstance(failed, BrokenPipeError):
        return code  # the reader has stopped reading, which `rich` turns into a SystemExit
    tell(
        name,
        f"standard output: got '{failed.strerror or failed}'; expected to write all of it.",
    )
    return max(code, EXIT_OUTPUT)


def _fill_standard_files() -> None:
    """Open /dev/null in the place of standard files with which the process was started closed.

    Otherwise the next file that is opened is taken for one of them, and gets what is meant for it.
    """
    with contextlib.suppress(OSError):
        while (file := os.open(os.devnull, os.O_RDWR)) <= _LAST_STANDARD_FILE:
            os.set_inheritable(file, True)  # noqa: FBT003
        os.close(file)
    sys.stdin = sys.stdin or open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = sys.stderr or open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115


def tell(name: str, text: str) -> None:
    """Write an error line to standard error, if there is one."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):
            sys.stderr.write(f"{name}: {printable(text)}\n")
            sys.stderr.flush()


def _escape_errors() -> None:
    # Logs and tracebacks may quote texts of other programs, with control characters.
    if logging.lastResort is not None:
        logging.lastResort.setFormatter(PrintableFormatter())
    threading.excepthook = _print_thread_exception
    sys.excepthook = _print_exception


class PrintableFormatter(logging.Formatter):
    """Formats log messages, with control characters escaped."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        return printable(super().format(record))


def _print_exception(
    kind: type[BaseException], error: BaseException, where: TracebackType | None
) -> None:
    """Print a traceback as `sys.excepthook` does, but escaped."""
    text = "".join(traceback.format_exception(kind, error, where))
    if sys.stderr is not None:
        with contextlib.suppress(OSError):
            sys.stderr.write(printable(text))
            sys.stderr.flush()


def _print_thread_exception(what: threading.ExceptHookArgs) -> None:
    """Print a traceback as `threading.excepthook` does, but escaped."""
    if issubclass(what.exc_type, SystemExit) or sys.stderr is None:
        return
    name = what.thread.name if what.thread is not None else "unknown"
    lines = traceback.format_exception(what.exc_type, what.exc_value, what.exc_traceback)
    text = "".join([f"Exception in thread {name}:\n", *lines])
    with contextlib.suppress(OSError):
        sys.stderr.write(printable(text))
        sys.stderr.flush()


def _replace_output(kind: type[io.TextIOWrapper]) -> _Checked:
    """Replace `sys.stdout` by a stream on a checked file; return the file."""
    before = sys.stdout
    assert isinstance(before, io.TextIOWrapper)
    before.flush()
    file = _Checked(before.fileno(), "w", closefd=False)
    sys.stdout = kind(
        io.BufferedWriter(file),
        encoding=before.encoding,
        errors="backslashreplace",  # for lone surrogates, and for terminals without UTF-8
        newline="\n",
        line_buffering=before.line_buffering,
        write_through=before.write_through,
    )
    return file


def discard_output() -> None:
    """Send further output to /dev/null, so that the flush at the interpreter's exit succeeds."""
    _replace([sys.stdout.fileno()])


TERMINALS: Final = tuple(file for file in range(3) if os.isatty(file))
"""Which of standard input, output and error were terminals at the start."""


def leave_closed_terminals() -> bool:
    """Replace terminals that were closed by /dev/null: any `print` of a mission would raise.

    Returns:
        Whether there are, or were before, closed terminals.

    Threads: any, also in a signal handler.
    """
    closed = [file for file in TERMINALS if not os.isatty(file)]
    with contextlib.suppress(OSError):
        _replace(closed)
    return bool(closed)


def _replace(files: Iterable[int]) -> None:
    nowhere = os.open(os.devnull, os.O_RDWR)
    for file in files:
        os.dup2(nowhere, file)
    os.close(nowhere)
