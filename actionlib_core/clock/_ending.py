"""The exit of the interpreter while threads of the program are still running."""

from __future__ import annotations

import sys
import time

# Long waits at the exit are counted in parts. After a suspension of the process, a wait until a
# time of the clock would end at once, before the other threads could run.
PART_S = 0.1
SWITCH_S = 1e-4  # Python's switch interval during the exit; the default, 5 ms per thread, adds up
REFUSAL_S = 0.01  # duration of a refused call during the exit


class Ending:
    """Gives time to the threads that must return from their calls before the interpreter's end.

    Attributes:
        begun: The interpreter is exiting.
    """

    def __init__(self) -> None:
        self.begun = False

    def begin(self) -> None:
        """Note that the interpreter is exiting."""
        self.begun = True
        sys.setswitchinterval(SWITCH_S)

    def slow_down(self) -> None:
        """Delay a thread whose call is refused, as it may try again in an endless loop.

        Blocks: for `REFUSAL_S` while the interpreter is exiting.
        """
        if self.begun:
            time.sleep(REFUSAL_S)


ending = Ending()
