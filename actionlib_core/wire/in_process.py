"""Action servers that a bridge shows in this process: clients here reach them without the network.

Goals, feedback and results go this way, and over the network too, for others who look on; both ends
drop that copy. All else goes over the network alone.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from actionlib_core.transport import Sample


class ClientInProcess(Protocol):
    """A client, as a server in its process sees it."""

    def take_feedback(self, sample: Sample, /) -> None:
        """Take feedback; must not wait."""

    def take_result(self, sample: Sample, /, *, direct: bool) -> None:
        """Take a result, `direct` if it did not come over the network; must not wait."""


class ServerInProcess(Protocol):
    """A server, as clients in its process see it.

    Attributes:
        session: Id of its network session.
    """

    session: str

    def join(self, client: ClientInProcess) -> None:
        """Send to a client directly from now on."""

    def leave(self, client: ClientInProcess) -> None:
        """Send to a client over the network alone."""

    def take_goal(self, sample: Sample) -> None:
        """Take a goal that will come over the network too; never waits."""


servers: dict[str, ServerInProcess] = {}
"""By the keys of their tokens; each is here before its token is shown."""

os.register_at_fork(after_in_child=servers.clear)  # the connections are the other process's
