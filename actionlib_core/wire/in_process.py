"""Action servers that a bridge shows in this process: clients here call them directly.

Goals, feedback and results are passed directly and, for other programs that watch the action, over
the network as well; both ends drop that copy. Everything else goes over the network alone.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from actionlib_core.transport import Sample


class ClientInProcess(Protocol):
    """A client, as a server in the same process sees it."""

    def take_feedback(self, sample: Sample, /) -> None:
        """Handle feedback; must not wait."""

    def take_result(self, sample: Sample, /, *, direct: bool) -> None:
        """Handle a result, `direct` if it did not come over the network; must not wait."""


class ServerInProcess(Protocol):
    """A server, as clients in the same process see it.

    Attributes:
        session: Id of its network session.
    """

    session: str

    def join(self, client: ClientInProcess) -> None:
        """Send directly to a client from now on."""

    def leave(self, client: ClientInProcess) -> None:
        """Send to a client over the network only."""

    def take_goal(self, sample: Sample) -> None:
        """Handle a goal that will also arrive over the network; never waits."""


servers: dict[str, ServerInProcess] = {}
"""By the keys of their tokens. Each is entered before its token is declared, so that a client that
sees the token finds its server here."""

os.register_at_fork(after_in_child=servers.clear)  # their connections belong to the parent process
