"""Child processes that never outlive the program that has started them."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import deque
from typing import TYPE_CHECKING, Final

from actionlib_core.clock import RealClock
from actionlib_core.clock.forks import is_copy

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import IO, Self

    from actionlib_core.shutdown import Shutdown

GRACE_S: Final = 1.5  # from the end of its standard input to SIGTERM
LAST_GRACE_S: Final = 1.0  # from then to SIGKILL
MAX_ERROR_LINES: Final = 40  # last lines of its standard error


def python_command(*arguments: str) -> list[str]:
    """Return the command for another Python like this one, with these arguments.

    It imports nothing from its current folder (-P): a file there, whose code nobody has asked for,
    must not take the place of a module of ours or of Python's. Options of this Python that would
    change what it imports and how it reads texts are handed on.
    """
    flags = ["-P", *("-O" for _ in range(sys.flags.optimize))]
    for flag, is_set in (
        ("-I", sys.flags.isolated),
        ("-E", sys.flags.ignore_environment),
        ("-s", sys.flags.no_user_site),
    ):
        flags += [flag] if is_set else []
    return [sys.executable, *flags, "-X", f"utf8={sys.flags.utf8_mode}", *arguments]


class ChildProcess:
    """Runs `python -m MODULE ARGUMENTS`; a context manager.

    The child lives as long as its standard input is open (`end_with_stdin`): whenever and however
    this process ends, the system closes the pipe, and the child ends too. The child has its own
    session, so that Ctrl-C in the terminal reaches only the parent, which can still use the child
    while it ends.

    Args:
        module: The module to run. It prints a line when it is ready, and ends with its standard
            input.
        arguments: Its arguments.
        on_change: Called when it is ready, and when it has ended; also an attribute.
        environment: Variables that are added to the environment of this process.

    Threads: `on_change` is called from threads of the clock.
    """

    def __init__(
        self,
        module: str,
        arguments: Sequence[str] = (),
        *,
        on_change: Callable[[], object] = lambda: None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.module = module
        self._command = python_command("-m", module, *arguments)
        self._environment = dict(environment or {})
        self.on_change = on_change
        self._clock = RealClock()  # other processes have no virtual time
        self._said: deque[str] = deque(maxlen=MAX_ERROR_LINES)
        self._changed = self._clock.event()
        self._ended = self._clock.event()
        self._first_line: str | None = None
        self._process: subprocess.Popen[str] | None = None
        self._parent = os.getpid()

    def __enter__(self) -> Self:
        self._process = subprocess.Popen(  # noqa: S603  our own interpreter and module
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,
            env={**os.environ, **self._environment},
        )
        stdout, stderr = self._process.stdout, self._process.stderr
        assert stdout is not None
        assert stderr is not None
        listening = self._clock.spawn(lambda: self._listen(stdout), name=f"output of {self.module}")
        self._clock.spawn(lambda: self._watch(stderr, listening.join), name=self.module)
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def pid(self) -> int:
        """The process id."""
        assert self._process is not None
        return self._process.pid

    @property
    def first_line(self) -> str:
        """The line that it has printed when it was ready; "" before."""
        return self._first_line or ""

    @property
    def said(self) -> str:
        """The last lines of its standard error."""
        return "".join(self._said).strip()

    @property
    def exit_code(self) -> int | None:
        """Its exit code; None while it runs."""
        ended = self._ended.is_set() and self._process is not None
        return self._process.returncode if ended and self._process is not None else None

    def ready(self) -> bool:
        """Return whether it has printed its first line."""
        return self._first_line is not None

    def wait_ready(self, timeout: float) -> bool:
        """Wait until it is ready; False when it has ended, or is not ready after `timeout` [s].

        Blocks: `timeout` at most.
        """
        self._changed.wait(timeout)
        return self.ready()

    def let_go(self) -> None:
        """Ask it to end, without waiting for it."""
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()

    def stop(self) -> None:
        """End it; a second call does nothing.

        Blocks: until it has ended, 3.5 s at most.
        """
        process = self._process
        if process is None or is_copy(self._parent):
            return
        # First the request, by closing its standard input; then SIGTERM; then SIGKILL.
        self.let_go()
        if not self._ended.wait(GRACE_S):
            process.terminate()
            if not self._ended.wait(LAST_GRACE_S):
                process.kill()
                self._ended.wait(LAST_GRACE_S)

    def on_end(self) -> None:
        """Handle the end of the process, before `on_change`; for subclasses."""

    def _listen(self, stdout: IO[str]) -> None:
        """Wait for the first line, then keep reading, so that the child never blocks in a write."""
        with stdout:
            for line in stdout:
                if self._first_line is None:
                    self._first_line = line.strip()
                self._changed.set()
                self.on_change()

    def _watch(self, stderr: IO[str], listened: Callable[[float], object]) -> None:
        """Read its standard error until it ends, then report its end."""
        assert self._process is not None
        with stderr:
            for line in stderr:
                self._said.append(line)
        self._process.wait()
        listened(LAST_GRACE_S)  # so that its last lines are reported before its end
        self._ended.set()
        self._changed.set()
        self.on_end()
        self.on_change()


def end_with_stdin(ending: Shutdown) -> None:
    """Request the shutdown of this process when its standard input is closed: by the parent's end.

    Blocks: until then. The child calls it in a thread of its own.
    """
    # Not through `sys.stdin`, whose lock this thread would still hold at the interpreter's end.
    while os.read(sys.stdin.fileno(), 4096):
        pass
    ending.request("the parent has gone")
