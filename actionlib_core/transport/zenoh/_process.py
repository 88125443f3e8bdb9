"""A session works in the process that opened it: a forked copy has none of zenoh's threads."""

from __future__ import annotations

import os

from actionlib_core.exceptions import TransportError


class Process:
    """What this process knows of itself.

    Attributes:
        opened: A session was opened, here or before a fork.
        forked: This process was forked after that.
    """

    def __init__(self) -> None:
        self.opened = False
        self.forked = False
        os.register_at_fork(after_in_child=self._note_fork)

    def _note_fork(self) -> None:
        self.forked = self.opened

    def check(self, what: str) -> None:
        """Refuse what would wait for threads that do not exist.

        Args:
            what: What is to be done, a key for example.

        Raises:
            TransportError: this process is a forked one.
        """
        if self.forked:
            raise TransportError(
                f"{what}: this process was forked from one that had joined the network, and cannot "
                "use it. Try multiprocessing.get_context('spawn'), or fork before the first "
                "client, server, publisher or subscriber is made."
            )


process = Process()
