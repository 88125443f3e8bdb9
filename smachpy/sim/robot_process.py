"""The simulated robot as a child process that never outlives its parent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actionlib_core.child_process import ChildProcess, end_with_stdin
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["RobotProcess", "end_with_stdin"]

_BAD_INPUT: Final = 2  # its exit code when something it was given does not fit


class RobotProcess(ChildProcess):
    """Runs `smachpy robot`, or a module like it; a context manager.

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
        module: str = "smachpy.sim",
    ) -> None:
        super().__init__(module, ("--child", *arguments), on_change=on_change)
        self._on_refusal: Callable[[], object] = lambda: None

    def check(self) -> None:
        """Raise when it ended by itself.

        Raises:
            MissionError: with what it said.
        """
        if self.exit_code:
            raise MissionError(
                self.said.removeprefix("smachpy: ")
                or f"the robot process ended with exit code {self.exit_code}"
            )

    def on_refusal(self, callback: Callable[[], object]) -> None:
        """Call `callback`, in a thread of the clock, when it ends because it may not be there."""
        self._on_refusal = callback

    def refused(self) -> bool:
        """Tell whether it ended by itself because it may not be there: `check` says why."""
        return self.exit_code == _BAD_INPUT

    def on_end(self) -> None:
        """Tell of a refusal."""
        if self.refused():
            self._on_refusal()
