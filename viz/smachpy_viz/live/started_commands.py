"""Commands of smachpy that the page starts: each is a process group of its own."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from typing import IO, TYPE_CHECKING, Final

from actionlib_core.shutdown.child_process import python_command

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

STOP_S: Final = 5.0
"""Time after an interrupt until a command is killed [s]."""

MAX_END_LENGTH: Final = 10_000
"""End of the error output of a command that is looked at [bytes]."""


def start_command(words: Iterable[str], errors: IO[str]) -> subprocess.Popen[str]:
    """Start `smachpy` with some arguments; its output is a pipe, its errors go to a file."""
    return subprocess.Popen(  # noqa: S603  our own command
        python_command("-m", "smachpy.command", *words),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=errors,
        # A group of its own: signals reach the command and its worker processes.
        start_new_session=True,
        text=True,
        encoding="utf-8",
        errors="replace",
    )


def send_signal(process: subprocess.Popen[str], number: int) -> None:
    """Send a signal to a process and its group, which it leads; nothing if it has ended."""
    if process.poll() is not None:  # another group may have its number by now
        return
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, number)


def end_all(processes: Iterable[subprocess.Popen[str]]) -> None:
    """Interrupt processes, and kill those that do not end.

    Blocks: `STOP_S` for each that does not.
    """
    ending = list(processes)
    for process in ending:
        send_signal(process, signal.SIGINT)
    for process in ending:
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            send_signal(process, signal.SIGKILL)


def last_line(path: Path) -> str:
    """Return the last line of a command's error output, without the command's name."""
    try:
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - MAX_END_LENGTH))
            text = file.read(MAX_END_LENGTH).decode("utf-8", "replace")
    except OSError:
        text = ""
    # The address of an error's description follows it.
    lines = [line for line in text.split("\n") if line.strip() and not line.startswith("More: ")]
    return lines[-1].removeprefix("smachpy: ") if lines else "it ended without an error message"
