"""Refusal of sessions in forked processes, in which Zenoh's threads do not exist."""

from __future__ import annotations

import os

from actionlib_core.exceptions import TransportError


class ProcessState:
    """The state of this process.

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
        """Raise an error in a forked process, where a call would wait for missing threads.

        Args:
            what: The beginning of the error text, a key for example.

        Raises:
            TransportError: this process was forked from one that had opened a session.
        """
        if self.forked:
            raise TransportError(
                f"{what}: this process was forked from one that had joined the network, and cannot "
                "use it. Try multiprocessing.get_context('spawn'), or fork before the first "
                "client, server, publisher or subscriber is made."
            )


process = ProcessState()
