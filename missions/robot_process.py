"""The simulated robot as a child process that never outlives its parent."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import deque
from typing import TYPE_CHECKING, Final

from actionlib_core.clock import current_clock
from missions.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import TracebackType
    from typing import IO, Self

    from actionlib_core.shutdown import Shutdown

_GRACE: Final = 1.5  # [s] from the end of its standard input until it is terminated
_LAST_GRACE: Final = 1.0  # [s] from then until it is killed
_BAD_INPUT: Final = 2  # its exit code when something it was given does not fit
_KEPT_LINES: Final = 40  # of what it said


class RobotProcess:
    """Runs `python -m missions.move_base`, or a module like it; a context manager.

    The robot lives as long as its standard input is open: when this process ends, however it ends,
    the system closes the pipe and the robot goes. It has a session of its own, so that Ctrl-C in
    the terminal reaches only the mission, which can then still stop the robot.

    Args:
        arguments: Further arguments for it (`--map`, `--config`, `--pose`, ...).
        on_change: Called when the robot is ready, and when the process has ended.
        module: What to run. It prints a line when it is ready, and ends with its standard input.

    Threads: `on_change` is called from threads of the clock.
    """

    def __init__(
        self,
        arguments: Sequence[str] = (),
        *,
        on_change: Callable[[], object] = lambda: None,
        module: str = "missions.move_base",
    ) -> None:
        self._command = [sys.executable, "-m", module, "--child", *arguments]
        self._on_change = on_change
        self._on_refusal: Callable[[], object] = lambda: None
        self._said: deque[str] = deque(maxlen=_KEPT_LINES)
        self._ready = current_clock().event()
        self._ended = current_clock().event()
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
        )
        stdout, stderr = self._process.stdout, self._process.stderr
        assert stdout is not None
        assert stderr is not None
        current_clock().spawn(lambda: self._listen(stdout), name="robot process output")
        current_clock().spawn(lambda: self._watch(stderr), name="robot process")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.stop()

    @property
    def pid(self) -> int:
        """The process id."""
        assert self._process is not None
        return self._process.pid

    def ready(self) -> bool:
        """Tell whether the robot takes goals."""
        return self._ready.is_set()

    def check(self) -> None:
        """Raise when it ended by itself.

        Raises:
            MissionError: with what it said.
        """
        if self._ended.is_set() and self._process is not None and self._process.returncode:
            said = "".join(self._said).strip()
            code = self._process.returncode
            raise MissionError(said or f"the robot process ended with exit code {code}")

    def on_refusal(self, callback: Callable[[], object]) -> None:
        """Call `callback`, in a thread of the clock, when it ends because it may not be there."""
        self._on_refusal = callback

    def refused(self) -> bool:
        """Tell whether it ended by itself because it may not be there: `check` says why."""
        return (
            self._ended.is_set()
            and self._process is not None
            and self._process.returncode == _BAD_INPUT
        )

    def let_go(self) -> None:
        """Tell the process to end, without waiting for it."""
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()

    def stop(self) -> None:
        """End the process; a second call does nothing.

        Blocks: until it has ended, 3.5 s at most.
        """
        process = self._process
        if process is None:
            return
        self.let_go()
        if not self._ended.wait(_GRACE):
            process.terminate()
            if not self._ended.wait(_LAST_GRACE):
                process.kill()
                self._ended.wait(_LAST_GRACE)

    def _listen(self, stdout: IO[str]) -> None:
        """Wait for the line that says it is ready; read on, so that it never has to wait."""
        with stdout:
            for _line in stdout:
                self._ready.set()
                self._on_change()

    def _watch(self, stderr: IO[str]) -> None:
        """Read what it says until it ends."""
        assert self._process is not None
        with stderr:
            for line in stderr:
                self._said.append(line)
        self._process.wait()
        self._ended.set()
        if self.refused():
            self._on_refusal()
        self._on_change()


def end_with_stdin(ending: Shutdown) -> None:
    """Ask this process to end when nobody holds the other end of its standard input any more.

    Blocks: until then; for a thread of its own in the child.
    """
    while os.read(sys.stdin.fileno(), 4096):  # not through the buffer: its lock outlives the thread
        pass
    ending.request("the parent has gone")
