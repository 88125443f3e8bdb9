"""The interpreter's end, while threads of the program go on working."""

from __future__ import annotations

import sys
import time

# A wait until a time of the clock ends at once for a process that was stopped for longer, before
# the threads that it waits for could run: so parts of it are counted.
PART_S = 0.1
SWITCH_S = 1e-4  # threads take turns so often then; Python's 5 ms each would add up
REFUSAL_S = 0.01  # a call that is refused then takes so long


class Ending:
    """Gives way to the threads that must come out of their calls before the interpreter is gone.

    Attributes:
        begun: The interpreter ends.
    """

    def __init__(self) -> None:
        self.begun = False

    def begin(self) -> None:
        """Say that the interpreter ends."""
        self.begun = True
        sys.setswitchinterval(SWITCH_S)

    def slow_down(self) -> None:
        """Have a thread wait whose call is refused: it may try again without an end.

        Blocks: for `REFUSAL_S` when the interpreter ends.
        """
        if self.begun:
            time.sleep(REFUSAL_S)


ending = Ending()
