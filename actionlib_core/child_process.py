"""Programs that a program starts, and that never outlive it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import deque
from typing import TYPE_CHECKING, Final

from actionlib_core.clock import RealClock

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import IO, Self

    from actionlib_core.shutdown import Shutdown

GRACE_S: Final = 1.5  # from the end of its standard input until it is terminated
LAST_GRACE_S: Final = 1.0  # from then until it is killed
KEPT_LINES: Final = 40  # of what it said


class ChildProcess:
    """Runs `python -m MODULE ARGUMENTS`; a context manager.

    The child lives as long as its standard input is open (`end_with_stdin`): when this process
    ends, however it ends, the system closes the pipe and the child goes. It has a session of its
    own, so that Ctrl-C in the terminal reaches only the parent, which can then still use the child.

    Args:
        module: What to run. It prints a line when it is ready, and ends with its standard input.
        arguments: Further arguments for it.
        on_change: Called when it is ready, and when it has ended; an attribute too.
        environment: Added to that of this process.

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
        # -P: a user's module in the current folder must not take the place of one of ours.
        self._command = [sys.executable, "-P", "-m", module, *arguments]
        self._environment = dict(environment or {})
        self.on_change = on_change
        self._clock = RealClock()  # processes know no other
        self._said: deque[str] = deque(maxlen=KEPT_LINES)
        self._changed = self._clock.event()
        self._ended = self._clock.event()
        self._first_line: str | None = None
        self._process: subprocess.Popen[str] | None = None

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
        """What it printed when it was ready; "" before."""
        return self._first_line or ""

    @property
    def said(self) -> str:
        """The last lines that it wrote to standard error."""
        return "".join(self._said).strip()

    @property
    def exit_code(self) -> int | None:
        """How it ended; None while it runs."""
        ended = self._ended.is_set() and self._process is not None
        return self._process.returncode if ended and self._process is not None else None

    def ready(self) -> bool:
        """Tell whether it has printed its first line."""
        return self._first_line is not None

    def wait_ready(self, timeout: float) -> bool:
        """Wait until it is ready; False when it has ended, or is not ready after `timeout` [s].

        Blocks: `timeout` at most.
        """
        self._changed.wait(timeout)
        return self.ready()

    def let_go(self) -> None:
        """Tell it to end, without waiting for it."""
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()

    def stop(self) -> None:
        """End it; a second call does nothing.

        Blocks: until it has ended, 3.5 s at most.
        """
        process = self._process
        if process is None:
            return
        self.let_go()
        if not self._ended.wait(GRACE_S):
            process.terminate()
            if not self._ended.wait(LAST_GRACE_S):
                process.kill()
                self._ended.wait(LAST_GRACE_S)

    def on_end(self) -> None:
        """Take the end of the process, before `on_change`; for subclasses."""

    def _listen(self, stdout: IO[str]) -> None:
        """Wait for the line that says it is ready; read on, so that it never has to wait."""
        with stdout:
            for line in stdout:
                if self._first_line is None:
                    self._first_line = line.strip()
                self._changed.set()
                self.on_change()

    def _watch(self, stderr: IO[str], listened: Callable[[float], object]) -> None:
        """Read what it says until it ends."""
        assert self._process is not None
        with stderr:
            for line in stderr:
                self._said.append(line)
        self._process.wait()
        listened(LAST_GRACE_S)
        self._ended.set()
        self._changed.set()
        self.on_end()
        self.on_change()


def end_with_stdin(ending: Shutdown) -> None:
    """Ask this process to end when nobody holds the other end of its standard input any more.

    Blocks: until then; for a thread of its own in the child.
    """
    while os.read(sys.stdin.fileno(), 4096):  # not through the buffer: its lock outlives the thread
        pass
    ending.request("the parent has gone")
