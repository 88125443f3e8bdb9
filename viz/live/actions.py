"""Actions on the network for the page: which there are, what their goals hold, and goals from here.

The page's counterpart of ROS's axclient. Only goals that were sent from here are followed.
"""

from __future__ import annotations

import logging
import threading
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from actionlib_core._core.states import CommState, Status
from actionlib_core.action_client import ActionClient
from actionlib_core.exceptions import ActionlibError, FieldError, InterfaceError
from actionlib_core.interfaces import get_action
from actionlib_core.presence import Kind, parse_token, token_pattern
from smachpy.exceptions import SmachError
from viz.feedback import Progress, progress_of
from viz.history import Goal
from viz.live.forms import fields_of, problems_of, sensible, values_of, yaml_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action_client import ClientGoalHandle
    from actionlib_core.node import Node
    from actionlib_core.presence import Endpoint
    from actionlib_core.transport import Presence

logger = logging.getLogger("viz.live")

KEPT_GOALS = 30
"""So many goals are remembered; those that have ended go first."""

MOST_RUNNING = 20
"""So many goals may run at the same time; a page that sends more has gone astray."""

SERVER_S = 2.0
LONGEST_TEXT = 200_000
SHOWN = 20_000
"""Characters of feedback and result that are sent to the page."""

INTERFACES = "smachpy.interfaces"
"""Entry points of modules that make interface definitions known when they are imported."""


class GoalRefusedError(SmachError):
    """A goal that was not sent, or cannot be cancelled.

    Attributes:
        problems: By field: `path` ("$.target_pose.header", "" for the whole) and `text`.
    """

    def __init__(self, text: str, problems: list[dict[str, str]] | None = None) -> None:
        self.problems = problems or []
        super().__init__(text)


@dataclass(slots=True)
class SentAction:
    """One goal that was sent from here."""

    id: str
    action: str
    type: str
    goal: Any
    sent_ns: int
    handle: ClientGoalHandle | None = None
    state: str = "WAITING_FOR_GOAL_ACK"
    status: str = "PENDING"
    text: str = ""
    ended_ns: int | None = None
    heard: int = 0
    first: Any = None
    feedback: Any = None
    result: Any = None
    cancelled: bool = False
    texts: dict[str, str] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return what the page shows."""
        progress = self._progress()
        return {
            "id": self.id,
            "action": self.action,
            "type": self.type,
            "state": self.state,
            "status": self.status,
            "text": self.text,
            "sent": self.sent_ns,
            "ended": self.ended_ns,
            "heard": self.heard,
            "cancelled": self.cancelled,
            "fraction": progress.fraction,
            "distance": progress.distance,
            **self.texts,
        }

    def _progress(self) -> Progress:
        since = self.sent_ns / 1e9
        shown = (self.goal, self.feedback, self.first)
        return progress_of(Goal("", self.action, self.id, since, *shown))


class Actions:
    """Knows the actions on the network and sends goals to them.

    Args:
        node: Where.
        on_change: Called when there is something new to show.

    Threads: every method may be called from any thread; `on_change` is called from any.
    """

    def __init__(self, node: Node, on_change: Callable[[], object] = lambda: None) -> None:
        self._node = node
        self._on_change = on_change
        self._lock = threading.Lock()
        self._servers: dict[str, dict[str, Endpoint]] = {}
        self._goals: dict[str, SentAction] = {}
        self._clients: dict[tuple[str, str], ActionClient[Any]] = {}
        self._searched = False
        self.revision = 0
        pattern = token_pattern(Kind.ACTION_SERVER)
        self._watch = node.transport.watch_alive(pattern, self._on_presence)

    def listen(self, on_change: Callable[[], object]) -> None:
        """Call `on_change` from now on."""
        self._on_change = on_change

    def close(self) -> None:
        """Leave the network; goals that run go on. A second call does nothing."""
        self._watch.close()
        with self._lock:
            clients = list(self._clients.values())
            self._clients.clear()
        for client in clients:
            client.stop()

    # -- what there is ---------------------------------------------------------------------------

    def summary(self) -> dict[str, Any]:
        """Return the actions by name, names of those that are gone, the goals, newest first."""
        with self._lock:
            servers = {name: list(ends.values()) for name, ends in sorted(self._servers.items())}
            goals = [goal.to_json() for goal in reversed(self._goals.values())]
        return {
            "actions": [
                {
                    "name": name,
                    "type": ends[0].type.removesuffix("Action"),
                    "node": ends[0].node,
                    "servers": len(ends),
                }
                for name, ends in servers.items()
                if ends
            ],
            "gone": [name for name, ends in servers.items() if not ends],
            "goals": goals,
        }

    def definition(self, name: str) -> dict[str, Any]:
        """Return what a form for a goal needs: fields, values, the same as YAML.

        Raises:
            GoalRefusedError: no server, or its type is not known here.
        """
        end = self._server(name)
        cls = self._goal_class(end)
        goal = sensible(cls)
        return {
            "name": name,
            "type": end.type.removesuffix("Action"),
            "about": cls._definition.comment,
            "fields": fields_of(cls),
            "values": values_of(goal),
            "yaml": yaml_of(goal),
        }

    def check(self, name: str, text: str) -> dict[str, Any]:
        """Return a goal given as YAML as a form's values and as YAML with comments.

        Raises:
            GoalRefusedError: with the problems of every bad field; as `definition`.
        """
        goal = self._read(self._goal_class(self._server(name)), text)
        return {"values": values_of(goal), "yaml": yaml_of(goal)}

    # -- goals -----------------------------------------------------------------------------------

    def send(self, name: str, text: str) -> str:
        """Send a goal given as YAML and return its id.

        Raises:
            GoalRefusedError: as `check`; or the network refused it.

        Blocks: until the server has been found, 2 s at most.
        """
        end = self._server(name)
        goal = self._read(self._goal_class(end), text)
        with self._lock:
            running = sum(one.ended_ns is None for one in self._goals.values())
        if running >= MOST_RUNNING:
            raise GoalRefusedError(
                f"{running} goals run already; expected fewer than {MOST_RUNNING}. Cancel some."
            )
        try:
            client = self._client(end)
            if not client.wait_for_server(SERVER_S):
                raise GoalRefusedError(_gone(name))
            sent = SentAction("", name, end.type.removesuffix("Action"), goal, self._now())
            handle = client.send_goal(
                goal,
                lambda handle: self._on_transition(sent, handle),
                lambda _handle, feedback: self._on_feedback(sent, feedback),
            )
        except ActionlibError as error:
            raise GoalRefusedError(str(error)) from error
        with self._lock:
            sent.id, sent.handle = handle.get_goal_id(), handle
            self._goals[sent.id] = sent
            self._forget_old()
        self._changed()
        return sent.id

    def cancel(self, goal_id: str) -> None:
        """Ask for the end of a goal; the answer comes as its status.

        Raises:
            GoalRefusedError: no such goal, or it has ended.
        """
        with self._lock:
            goal = self._goals.get(goal_id)
        if goal is None or goal.handle is None:
            raise GoalRefusedError(f"goal {goal_id!r}: not sent from here")
        if goal.ended_ns is not None:
            raise GoalRefusedError(f"goal {goal_id!r}: has ended already: {goal.status}")
        goal.cancelled = True
        try:
            goal.handle.cancel()
        except ActionlibError as error:
            raise GoalRefusedError(str(error)) from error
        self._changed()

    def _on_transition(self, sent: SentAction, handle: ClientGoalHandle) -> None:
        state = handle.get_comm_state()
        with self._lock:
            sent.state = state.name
            sent.status = Status(handle.get_goal_status()).name
            sent.text = handle.get_goal_status_text()
            if state in {CommState.DONE, CommState.LOST}:
                sent.ended_ns = self._now()
                sent.result = handle.get_result()
                if sent.result is not None:
                    sent.texts["result"] = _shown(sent.result)
        self._changed()

    def _on_feedback(self, sent: SentAction, feedback: Any) -> None:
        with self._lock:
            sent.heard += 1
            sent.feedback = feedback
            if sent.first is None:
                sent.first = feedback
            sent.texts["feedback"] = _shown(feedback)
        self._changed()

    def _forget_old(self) -> None:
        ended = [one.id for one in self._goals.values() if one.ended_ns is not None]
        for goal_id in ended[: max(0, len(self._goals) - KEPT_GOALS)]:
            del self._goals[goal_id]

    # -- the network -----------------------------------------------------------------------------

    def _on_presence(self, presence: Presence) -> None:
        end = parse_token(presence.key)
        if end is None:
            return
        with self._lock:
            servers = self._servers.setdefault(end.name, {})
            if presence.alive:
                servers[presence.key] = end
            else:
                servers.pop(presence.key, None)
        self._changed()

    def _changed(self) -> None:
        self.revision += 1
        self._on_change()

    def _now(self) -> int:
        return self._node.clock.time_ns()

    def _server(self, name: str) -> Endpoint:
        with self._lock:
            found = list(self._servers.get(name, {}).values())
        if not found:
            raise GoalRefusedError(_gone(name))
        return found[0]

    def _goal_class(self, end: Endpoint) -> Any:
        spec = self._action_class(end)
        return type(spec().action_goal.goal)

    def _action_class(self, end: Endpoint) -> Any:
        """The class of an action, found here; servers do not send their definitions."""
        try:
            spec = get_action(end.type)
        except InterfaceError:
            self._search()
            try:
                spec = get_action(end.type)
            except InterfaceError as error:
                raise GoalRefusedError(
                    f"{error} Name the folder with its definition in SMACHPY_INTERFACE_PATH "
                    "where `smachpy view` starts."
                ) from error
        if spec._md5sum != end.md5:
            raise GoalRefusedError(
                f"{end.type}: the definition here (md5 {spec._md5sum}) is not that of the server "
                f"(md5 {end.md5}); expected the same. Try its version of the definition, in "
                "SMACHPY_INTERFACE_PATH."
            )
        return spec

    def _search(self) -> None:
        """Import what installed packages have registered, once."""
        with self._lock:
            searched, self._searched = self._searched, True
        if searched:
            return
        for point in entry_points(group=INTERFACES):
            try:
                point.load()
            except Exception:  # a package that is broken hides only its own definitions
                logger.exception("interfaces of %s cannot be loaded", point.value)

    def _client(self, end: Endpoint) -> ActionClient[Any]:
        spec = self._action_class(end)
        with self._lock:
            client = self._clients.get((end.name, end.md5))
            if client is None:
                client = ActionClient(f"/{end.name}", spec, node=self._node)
                self._clients[end.name, end.md5] = client
            return client

    def _read(self, cls: Any, text: str) -> Any:
        if len(text) > LONGEST_TEXT:
            raise GoalRefusedError(
                f"goal: got {len(text)} characters; expected at most {LONGEST_TEXT}."
            )
        try:
            return cls.from_yaml(text)
        except FieldError as error:
            raise GoalRefusedError(str(error), problems_of(error, cls._type)) from error


def _gone(name: str) -> str:
    return f"action /{name}: got no server; expected one. Start it, then send again."


def _shown(message: Any) -> str:
    text = str(message)
    return (
        text if len(text) <= SHOWN else f"{text[:SHOWN]}\n... {len(text) - SHOWN} characters more"
    )
