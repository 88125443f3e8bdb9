"""The goals that an action server has, whoever sent them: a list, and their cancel."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.exceptions import ActionlibError
from actionlib_core.goal.states import TERMINAL, Status
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID
from actionlib_core.transport.tokens import Kind, parse_token, token_pattern
from actionlib_core.wire.actions import GOAL, action_keys, pack_goal_id, unpack_statuses
from actionlib_core.wire.encoding import encoding_of
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from actionlib_core.node import Node
    from actionlib_core.transport import Reply
    from actionlib_core.transport.tokens import Endpoint

ASK_S: Final = 1.0
"""Longest wait for the answer of a server, and for the tokens of its clients [s]."""

CANCEL_S: Final = 5.0
"""The same before and after a cancel, on a busy robot: it must be stopped all the same [s]."""

MAX_LISTED_GOALS: Final = 100
"""Goals of a server that are listed, the newest ones."""

_ID: Final = re.compile(r"(.+)-\d+-\d+\.\d+", re.DOTALL)  # of actionlib: node, number, stamp


class GoalsError(SmachError):
    """The goals of a server cannot be listed or cancelled.

    Try: wait until the server is there; `actionlib goal list` asks the network, too.
    """


def goals_of(node: Node, end: Endpoint) -> list[dict[str, Any]]:
    """Return the running goals of a server, the newest first (`wire.ServerGoal`).

    Raises:
        GoalsError: it does not answer, or is one of ROS 2, which cannot be asked.

    Blocks: 2 s at most.
    """
    entries = _running(node, end, ASK_S)
    entries.sort(key=lambda one: one.stamp_ns, reverse=True)
    clients = {client.node for client in _clients(node, end)}
    listed = []
    for one in entries[:MAX_LISTED_GOALS]:
        found = _ID.fullmatch(one.id)
        sender = found[1].strip("/") if found else ""
        listed.append(
            {
                "id": one.id,
                "status": Status(one.status).name,
                "stamp": one.stamp_ns,
                "text": one.text,
                "sender": sender,
                "gone": bool(sender) and sender not in clients,
            }
        )
    return listed


def cancel(node: Node, end: Endpoint, goal_id: str) -> None:
    """Request the cancellation of a running goal, as its client would.

    Raises:
        GoalsError: there is no such goal, or as `goals_of`.

    Blocks: 11 s at most.
    """
    running = [one.id for one in _running(node, end, CANCEL_S)]
    if goal_id not in running:  # the server would remember the cancel for a goal to come
        raise GoalsError(f"goal {goal_id!r}: not running any more; running are {running}.")
    publisher = node.transport.publisher(action_keys(end.name).cancel, encoding_of(GoalID), GOAL)
    try:
        publisher.put(pack_goal_id(goal_id, 0))
        _running(node, end, CANCEL_S)  # the answer shows that the cancel before it has arrived
    except ActionlibError as error:
        raise GoalsError(str(error)) from error
    finally:
        publisher.close()


def _running(node: Node, end: Endpoint, seconds: float) -> list[Any]:
    """Return the statuses of the running goals."""
    if end.type.count("/") > 1:
        raise GoalsError(
            f"action /{end.name}: its server speaks ROS 2's protocol, which tells no goals here. "
            f"Try: actionlib goal list /{end.name}"
        )
    statuses = _statuses(node, end, seconds)
    return [one for one in statuses if one.status not in TERMINAL and one.stamp_ns]


def _statuses(node: Node, end: Endpoint, seconds: float) -> list[Any]:
    replies: list[Reply] = []
    done = node.clock.event()
    try:
        node.transport.query(
            action_keys(end.name).result,
            pack_goal_id("", 0),
            encoding=encoding_of(GoalID),
            timeout=seconds,
            on_reply=replies.append,
            on_done=done.set,
        )
        done.wait(seconds + 0.5)
    except ActionlibError as error:
        raise GoalsError(str(error)) from error
    for reply in replies:
        try:
            if not reply.error:
                return list(unpack_statuses(reply.payload))
        except ValueError:
            continue
    raise GoalsError(f"action /{end.name}: got no answer in {seconds:g} s; expected its goals.")


def _clients(node: Node, end: Endpoint) -> list[Endpoint]:
    keys = node.transport.list_alive(token_pattern(Kind.ACTION_CLIENT, end.name), ASK_S)
    return [found for key in keys if (found := parse_token(key)) is not None]
