"""The border between the rules of actions and the network: what each side asks of the other.

An `ActionClient` speaks to the network through a `ClientPort` and listens as a `ClientListener`, an
`ActionServer` through a `ServerPort` and as a `ServerListener`. Only the ports know keys and
encodings; goals, results and feedback pass as the bytes (`body`) that the port itself has packed.

Threads: ports may be used from any thread. Listeners are called on the network's threads, in order
per sender, and must not wait.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actionlib_core.exceptions import TypeMismatchError


class StatusEntry(NamedTuple):
    """One goal's status: an actionlib_msgs/GoalStatus."""

    id: str
    stamp_ns: int
    status: int
    text: str


class Server(Protocol):
    """A server that shows that it is there; hashable, equal when it is the same one."""

    @property
    def session(self) -> str:
        """Id of its network session."""

    @property
    def node(self) -> str:
        """Full name of its node."""

    @property
    def age(self) -> tuple[int, str]:
        """The greater, the later it came."""


class ClientPort(Protocol):
    """A client's end of the wire."""

    def open(self, listener: ClientListener) -> None:
        """Listen, then show that the client is there.

        Raises:
            TransportError: the session is closed.
        """

    def close(self) -> None:
        """Leave the name; a second call does nothing."""

    def is_heard(self) -> bool:
        """Return whether anybody listens for goals."""

    def explain_absence(self) -> str:
        """Return why there may be no server and what to try; "" when nothing is known of it.

        Blocks: until the network has said who there is, 1 s at most.
        """

    def pack_goal(self, goal: Any) -> bytes:
        """Return the bytes of a goal message.

        Raises:
            FieldError: a field of it has a wrong type.
        """

    def read_feedback(self, body: bytes) -> Any:
        """Return the feedback message.

        Raises:
            ValueError, ActionlibError: it cannot be read.
        """

    def read_result(self, body: bytes) -> Any:
        """Return the result message; errors as `read_feedback`."""

    def send_goal(
        self, goal_id: str, stamp_ns: int, body: bytes, server: Any, *, wait: bool = True
    ) -> None:
        """Send a goal to one server; None: to one that does not show itself.

        Blocks: with `wait`, while a link is full; else the goal is dropped then.
        """

    def send_cancel(self, goal_id: str, stamp_ns: int, *, wait: bool = True) -> None:
        """Send a cancel; see `ServerGoals.on_cancel` for what it means. Blocks as `send_goal`."""

    def acknowledge(self, goal_ids: list[str], *, farewell: bool = False) -> None:
        """Say that the results of these goals have arrived, and maybe a server's farewell.

        Never waits; it may get lost.
        """

    def ask(self, goal_id: str, on_done: Callable[[], None]) -> None:
        """Ask the server what became of a goal; the answer goes to the listener."""


class ClientListener(Protocol):
    """What a client does about what arrives. `session` is the sender's; "" when unknown."""

    def on_server(self, server: Any, error: TypeMismatchError | None) -> None:
        """Handle the appearance of a server; `error` when it has another type."""

    def on_server_gone(self, server: Any, why: str = "is gone") -> None:
        """Handle the disappearance of a server; `why` goes into the text of the goals it had."""

    def on_statuses(self, entries: list[StatusEntry], session: str, *, whole: bool = True) -> None:
        """Handle a list of all goals; without `whole`, of those of which there is news."""

    def on_farewell(self, entries: list[StatusEntry], server: Any) -> None:
        """Handle the last list of a server that leaves: the goals it ever took."""

    def on_feedback(self, entry: StatusEntry, body: bytes, session: str) -> None:
        """Handle feedback."""

    def on_result(
        self, entry: StatusEntry, body: bytes | None, session: str, *, answered: bool = False
    ) -> None:
        """Handle a result; `answered`: it was asked for, and without a `body` is not kept."""

    def on_answer(self, entry: StatusEntry, session: str = "") -> None:
        """Handle the answer to `ask` when there is no result to send."""

    def follows(self, goal_id: str) -> bool:
        """Return whether a goal is followed, and not over."""

    def on_stranger(self, session: str) -> None:
        """Report a session that speaks as a server it is not."""


class ServerPort(Protocol):
    """A server's end of the wire."""

    def open(self, listener: ServerListener) -> None:
        """Listen, then show that the server is there.

        Raises:
            ServerConflictError: the name has a server.
            TransportError: the session is closed.

        Blocks: until the network has said who has the name, 1 s at most.
        """

    def close(self) -> None:
        """Leave the name; a second call does nothing."""

    def has_clients(self) -> bool:
        """Return whether a client of the action is there."""

    def begin_farewell(self) -> bool:
        """Note which clients are to answer the farewell; return whether anybody listens.

        Raises:
            TransportError: the session is closed.

        Blocks: until the network has said who there is, 0.2 s at most.
        """

    def send_farewell(self, taken: Iterable[StatusEntry]) -> None:
        """Say that the server leaves and which goals it has taken, and so which it has not."""

    def is_farewell_heard(self) -> bool:
        """Return whether all clients have answered the farewell."""

    def pack_result(self, result: Any) -> bytes:
        """Return the bytes of a result message.

        Raises:
            FieldError: a field of it has a wrong type.
        """

    def pack_feedback(self, feedback: Any) -> bytes:
        """Return the bytes of a feedback message; errors as `pack_result`."""

    @property
    def send_accepted(self) -> Callable[[StatusEntry], None] | None:
        """Says that a goal is accepted; None where the status list, which follows, says it."""

    def send_status(self, entries: Iterable[StatusEntry]) -> None:
        """Send the status list; dropped when the network is slow, as it is sent again."""

    def send_result(self, entry: StatusEntry, body: bytes, *, wait: bool = True) -> None:
        """Send a result.

        Blocks: with `wait`, while a link is full; else the result is dropped then.
        """

    def send_feedback(self, entry: StatusEntry, body: bytes) -> None:
        """Send feedback.

        Blocks: while a link is full.
        """


class ServerListener(Protocol):
    """What a server does about what arrives."""

    def on_goal(self, goal_id: str, stamp_ns: int, content: Any, client: str) -> bool:
        """Handle a goal; `client` is who sent it, as in `on_client_lost`.

        Returns:
            Whether it is new and has been taken.
        """

    def on_cancel(self, goal_id: str, stamp_ns: int) -> list[StatusEntry]:
        """Handle a cancel; return the goals that are asked to stop and were not before."""

    def on_acknowledged(self, goal_ids: list[str]) -> None:
        """Handle acknowledged results; `is_farewell_heard` may have changed too."""

    def on_client_lost(self, client: str) -> None:
        """Handle the death of a client, or of its session."""

    def on_conflict(self, error: Any) -> None:
        """Stop: an older server has the name."""

    def list_goals(self) -> list[StatusEntry]:
        """Return the status list."""

    def find_end(self, goal_id: str) -> tuple[StatusEntry, bytes | None]:
        """Return the status of a goal, LOST when it is unknown, and its result if it has one."""

    def find_goal(self, goal_id: str) -> tuple[int, Any] | None:
        """Return stamp [ns] and message of a goal; None when it is not known any more."""
