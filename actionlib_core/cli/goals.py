"""`actionlib cancel` and `actionlib goal list|info`: the goals of a server."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import EXIT_FAILED, UsageError
from actionlib_core.cli._command import add_command, json_text, print_message
from actionlib_core.cli._network import ask, class_of_end, find_server, open_node
from actionlib_core.cli._ros2 import RemoteAction, is_ros2
from actionlib_core.inputs.arguments import is_goal_id

if TYPE_CHECKING:
    import argparse

    from actionlib_core.goal.ports import StatusEntry
    from actionlib_core.node import Node
    from actionlib_core.transport import Reply
    from actionlib_core.transport.tokens import Endpoint
    from actionlib_core.wire.ros2.action_messages import GoalState

NS = 1_000_000_000


def register(subparsers: Any) -> None:
    """Add the commands to an argparse subparsers object."""
    parser = add_command(
        subparsers,
        "cancel",
        _cancel,
        "cancel goals of an action",
        description="With an ID: that goal. With --before: those with a stamp at or before it. "
        "With both: either. With --all: all, of all clients. Exit code 1 when no goal with the ID "
        "runs.",
    )
    parser.add_argument("name", metavar="NAME", help="the action")
    parser.add_argument("id", metavar="ID", nargs="?", default="", help="a goal's id")
    parser.add_argument("--all", action="store_true", help="all goals")
    parser.add_argument("--before", metavar="STAMP", help="seconds since the epoch")

    parser = subparsers.add_parser("goal", help="show the goals of an action")
    verbs = parser.add_subparsers(metavar="VERB", required=True)
    verb = add_command(verbs, "list", _list, "list the goals that a server tracks")
    verb.add_argument("name", metavar="NAME", help="the action")
    verb.add_argument("-c", "--count", action="store_true", help="only how many")
    verb = add_command(
        verbs,
        "info",
        _info,
        "show a goal, its status, and its result when there is one",
        description="A server keeps the goal and the result until the client has the result; "
        "then only the status is left.",
    )
    verb.add_argument("name", metavar="NAME", help="the action")
    verb.add_argument("id", metavar="ID", help="the goal's id")
    only = verb.add_mutually_exclusive_group()
    only.add_argument("--goal-only", action="store_true", help="only the goal")
    only.add_argument("--status-only", action="store_true", help="only the status")
    only.add_argument("--result-only", action="store_true", help="only the result")


def _goals(node: Node, name: str) -> list[StatusEntry]:
    """Return the goals that a server tracks, without early cancels whose goals never came."""
    from actionlib_core.goal.states import Status
    from actionlib_core.wire.actions import unpack_statuses

    entries = ask(node, name, "", lambda answer: unpack_statuses(answer.payload))
    return [entry for entry in entries if entry.stamp_ns or entry.status != Status.RECALLING]


def _describe(entry: StatusEntry) -> dict[str, Any]:
    from actionlib_core.goal.states import Status

    return {
        "id": entry.id,
        "status": Status(entry.status).name,
        "stamp": entry.stamp_ns / NS,
        "text": entry.text,
    }


def _list(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        server = find_server(node, args.name)
        entries = _ros2_goals(node, server) if is_ros2(server.type) else _goals(node, args.name)
        goals = [_describe(entry) for entry in entries]
    if args.json:
        print(json.dumps(goals))
    elif args.count:
        print(len(goals))
    else:
        for goal in goals:
            print(f"{goal['id']} {goal['status']} {goal['stamp']:.3f} {goal['text']}".rstrip())
    return 0


def _info(args: argparse.Namespace) -> int:
    _check_id("goal info", args.id)  # to the server, an empty id means all goals
    with open_node(args) as node:
        server = find_server(node, args.name)
        goal = None  # ROS 2 servers do not send it
        if is_ros2(server.type):
            entry, result = _ros2_status(node, server, args.id)
        else:
            spec = class_of_end(node, server)
            entry, result = _status(node, args, spec)
            goal = None if args.status_only or args.result_only else _goal(node, args, spec)
    if args.goal_only and goal is None:
        return _not_there(entry, "goal", args)
    if args.result_only and result is None:
        return _not_there(entry, "result", args)
    status = _describe(entry)
    if args.json:
        parts = {
            "goal": None if goal is None else goal.to_dict(),
            "result": None if result is None else result.to_dict(),
        }
        only = [key for key in parts if getattr(args, f"{key}_only")]
        whole = status if args.status_only else {**status, **parts}
        print(json_text(parts[only[0]] if only else whole))
    else:
        _print_info(args, entry, goal, result)
    return EXIT_FAILED if status["status"] == "LOST" else 0


def _check_id(command: str, goal_id: str) -> None:
    if not is_goal_id(goal_id):
        raise UsageError(
            f"{command}: ID: got {goal_id!r}; expected a goal's id. Try 'actionlib goal list NAME'."
        )


def _print_info(args: argparse.Namespace, entry: StatusEntry, goal: Any, result: Any) -> None:
    if not (args.goal_only or args.result_only):
        print(f"Goal: {entry.id}\nStatus: {_describe(entry)['status']}\nText: {entry.text}")
    if goal is not None:
        print_message("Goal:" if args.goal_only else "Content:", goal)
    if result is not None and not (args.goal_only or args.status_only):
        print_message("Result:", result)


def _not_there(entry: StatusEntry, what: str, args: argparse.Namespace) -> int:
    status = _describe(entry)["status"]
    print(
        f"actionlib: goal {args.id}: its {what} is not there; its status is {status}.",
        file=sys.stderr,
    )
    return EXIT_FAILED


def _status(node: Node, args: argparse.Namespace, spec: Any) -> tuple[StatusEntry, Any]:
    """Return the status of a goal, and its result or None."""
    from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
    from actionlib_core.wire.actions import unpack_report, unpack_status
    from actionlib_core.wire.encoding import encoding_of

    def read(answer: Reply) -> tuple[StatusEntry, Any]:
        if answer.encoding == encoding_of(GoalStatus):
            return unpack_status(answer.payload), None
        entry, start = unpack_report(answer.payload)
        return entry, type(spec().action_result.result).from_bytes(answer.payload[start:])

    return ask(node, args.name, args.id, read)


def _goal(node: Node, args: argparse.Namespace, spec: Any) -> Any:
    """Return the goal message of a goal, None when the server no longer has it."""
    from actionlib_core.wire.actions import unpack_goal

    def read(answer: Reply) -> Any:
        return type(spec().action_goal.goal).from_bytes(unpack_goal(answer.payload)[2])

    try:
        return ask(node, args.name, args.id, read, "goal")
    except UsageError:
        return None


def _cancel(args: argparse.Namespace) -> int:
    if not (args.id or args.all or args.before):
        raise UsageError(
            "cancel: got no ID, --all or --before; expected one. Try 'actionlib goal list NAME'."
        )
    if args.all and (args.id or args.before):
        raise UsageError("cancel: got --all beside ID or --before; expected one of the two.")
    if args.id:
        _check_id("cancel", args.id)
    stamp_ns = _stamp(args.before)
    from actionlib_core.goal.states import TERMINAL
    from actionlib_core.interfaces.actionlib_msgs.msg import GoalID
    from actionlib_core.wire.actions import GOAL, pack_goal_id
    from actionlib_core.wire.encoding import encoding_of

    with open_node(args) as node:
        server = find_server(node, args.name)
        if is_ros2(server.type):
            return _cancel_ros2(node, server, args, stamp_ns)
        name = server.name
        goals = [entry for entry in _goals(node, f"/{name}") if entry.status not in TERMINAL]
        asked = [
            entry.id
            for entry in goals
            if args.all or entry.id == args.id or 0 < entry.stamp_ns <= stamp_ns
        ]
        publisher = node.transport.publisher(f"{name}/cancel", encoding_of(GoalID), GOAL)
        publisher.put(pack_goal_id(args.id, stamp_ns))
        # The reply to a query shows that the cancel before it has arrived: only then close.
        ask(node, f"/{name}", "", lambda _answer: None)
        publisher.close()
    missed = bool(args.id) and args.id not in asked
    if args.json:
        print(json.dumps({"cancelled": asked}))
    else:
        for goal_id in asked:
            print(f"Cancel requested for goal {goal_id}")
        if missed:
            running = [entry.id for entry in goals]
            print(
                f"actionlib: cancel: got goal {args.id!r}; expected one of {running}. The server "
                "remembers the cancel, should the goal come yet.",
                file=sys.stderr,
            )
        elif not asked:
            print("No running goal is meant.")
    return EXIT_FAILED if missed else 0


def _stamp(text: str | None) -> int:
    from actionlib_core.time import Time

    if text is None:
        return 0
    try:
        seconds, _, fraction = text.partition(".")
        stamp_ns = Time(int(seconds), int((fraction + "0" * 9)[:9])).to_nsec()
    except (ValueError, TypeError) as error:
        raise UsageError(
            f"cancel: --before: got {text!r}; expected seconds since the epoch, 1700000000.5 "
            "for example."
        ) from error
    if stamp_ns == 0:  # to the server, an empty id with the stamp 0 means all goals
        raise UsageError(
            f"cancel: --before: got {text!r}; expected seconds since the epoch above 0. Try --all "
            "to cancel all goals."
        )
    return stamp_ns


# -- ROS 2 -----------------------------------------------------------------------------------------


def _entry(state: GoalState) -> StatusEntry:
    from actionlib_core.goal.ports import StatusEntry
    from actionlib_core.wire.ros2.goal_states import to_status
    from actionlib_core.wire.ros2.names import goal_id_text

    status = to_status(state.code, was_active=True)
    return StatusEntry(goal_id_text(state.uuid), state.stamp_ns, status, "")


def _ros2_goals(node: Node, server: Endpoint) -> list[StatusEntry]:
    return [_entry(state) for state in RemoteAction(node, server).states()]


def _ros2_status(node: Node, server: Endpoint, goal_id: str) -> tuple[StatusEntry, Any]:
    """Return the status of a goal, and its result or None."""
    from actionlib_core.goal.states import TERMINAL
    from actionlib_core.wire.ros2.action_messages import GoalState
    from actionlib_core.wire.ros2.names import goal_uuid

    action, uuid = RemoteAction(node, server), goal_uuid(goal_id)
    known = {state.uuid: state for state in action.states()}
    state = known.get(uuid)
    # A goal that the server no longer lists may still have its result.
    if state is not None and _entry(state).status not in TERMINAL:
        # Not asking for the result: the server would answer only when the goal has ended.
        return _entry(state)._replace(id=goal_id), None
    code, result = action.result(uuid)
    stamp_ns = state.stamp_ns if state is not None else 0
    entry = _entry(GoalState(uuid, stamp_ns, code))._replace(id=goal_id)
    return entry, result if code else None


def _cancel_ros2(node: Node, server: Endpoint, args: argparse.Namespace, stamp_ns: int) -> int:
    from actionlib_core.wire.ros2.goal_states import CancelCode
    from actionlib_core.wire.ros2.names import NO_GOAL, goal_id_text, goal_uuid

    uuid = goal_uuid(args.id) if args.id else NO_GOAL
    answer = RemoteAction(node, server).cancel(uuid, stamp_ns)
    asked = [goal_id_text(goal) for goal, _ in answer.goals]
    missed = bool(args.id) and uuid not in {goal for goal, _ in answer.goals}
    if args.json:
        print(json.dumps({"cancelled": asked}))
        return EXIT_FAILED if missed else 0
    for goal_id in asked:
        print(f"Cancel requested for goal {goal_id}")
    if missed:
        why = {
            CancelCode.UNKNOWN_GOAL: "the server does not know it",
            CancelCode.GOAL_TERMINATED: "it has ended, or is canceling already",
        }.get(CancelCode(answer.code), "the server refused to cancel it")
        print(f"actionlib: cancel: goal {args.id}: {why}.", file=sys.stderr)
    elif not asked:
        print("No running goal is meant.")
    return EXIT_FAILED if missed else 0
