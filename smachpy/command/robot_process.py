"""Runs the simulated robot as a child process that never outlives its parent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actionlib_core.shutdown.child_process import ChildProcess
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_BAD_INPUT: Final = 2  # its exit code for bad input


class RobotProcess(ChildProcess):
    """Runs `smachpy robot`, or a module like it; a context manager.

    Args:
        arguments: Further arguments for it (`--map`, `--config`, `--pose`, ...).
        on_change: Called when the robot is ready, and when the process has ended.
        program: The module to run, and its first words. It prints a line when it is ready, and
            ends with its standard input.

    Threads: `on_change` is called from threads of the clock.
    """

    def __init__(
        self,
        arguments: Sequence[str] = (),
        *,
        on_change: Callable[[], object] = lambda: None,
        program: Sequence[str] = ("smachpy", "robot"),
    ) -> None:
        module, *words = program
        super().__init__(module, (*words, "--child", *arguments), on_change=on_change)
        self._on_refusal: Callable[[], object] = lambda: None

    def check(self) -> None:
        """Raise if it has ended by itself.

        Raises:
            MissionError: with the text that it printed.
        """
        if self.exit_code:
            raise MissionError(
                self.said.removeprefix("smachpy: ")
                or f"the robot process ended with exit code {self.exit_code}"
            )

    def on_refusal(self, callback: Callable[[], object]) -> None:
        """Call `callback`, in a thread of the clock, if it ends as `refused` says."""
        self._on_refusal = callback

    def refused(self) -> bool:
        """Return whether it ended because of bad input or its name; `check` says why."""
        return self.exit_code == _BAD_INPUT

    def on_end(self) -> None:
        """Report a refusal."""
        if self.refused():
            self._on_refusal()
