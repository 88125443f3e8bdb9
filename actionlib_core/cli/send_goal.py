"""`actionlib send_goal`: send one goal and follow it to its end."""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import EXIT_FAILED, UsageError
from actionlib_core.cli._command import (
    add_command,
    print_json,
    print_message,
    print_progress,
    while_read,
)
from actionlib_core.cli._network import class_of_end, find_server, open_node, typed_class
from actionlib_core.command_line.numbers import seconds
from actionlib_core.process.output import discard_output

if TYPE_CHECKING:
    import argparse

    from actionlib_core.action.client import ActionClient
    from actionlib_core.action.sent_goal import SentGoal

_TYPE = re.compile(r"\w+(/\w+){1,2}")
CANCEL_S = 10.0  # longest wait for the answer to a cancel
CANCELED = {"PREEMPTED", "RECALLED"}


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = add_command(
        subparsers,
        "send_goal",
        run,
        "send a goal, wait for its result",
        description="Exit code 0 when the goal SUCCEEDED. Ctrl-C, a closed terminal and SIGTERM "
        "cancel it first, and so does a reader of the output that leaves (... | head).",
    )
    parser.add_argument("name", metavar="NAME", help="the action")
    parser.add_argument(
        "words",
        metavar="[TYPE] YAML",
        nargs="*",
        help="the goal as YAML, for example '{order: 10}'; the server is asked for the type",
    )
    parser.add_argument("-f", "--feedback", action="store_true", help="print feedback")
    parser.add_argument("--stdin", action="store_true", help="read the YAML from standard input")
    parser.add_argument(
        "--timeout", type=seconds, metavar="S", help="longest time for server and goal [s]"
    )


def run(args: argparse.Namespace) -> int:
    """Send the goal that the arguments describe."""
    try:
        return _run(args)
    except BrokenPipeError:
        discard_output()
        return EXIT_FAILED


def _run(args: argparse.Namespace) -> int:
    type_name, text = _split(args.words, stdin=args.stdin)
    with open_node(args, settle=0.0) as node:
        print_progress(args, "Waiting for an action server to become available...")
        started = node.clock.now()
        server = find_server(node, args.name, args.timeout)
        spec = typed_class(node, "action", type_name) if type_name else class_of_end(node, server)
        from actionlib_core.action.client import ActionClient

        client: ActionClient[Any] = ActionClient(args.name, spec, node=node)
        try:
            goal = client.types.goal.from_yaml(text) if text.strip() else client.types.goal()
            client.wait_for_server(1.0)
            left = None
            if args.timeout is not None:
                left = max(0.0, args.timeout - (node.clock.now() - started))
            return _drive(client, goal, left, args)
        finally:
            client.stop()


def _split(words: list[str], *, stdin: bool) -> tuple[str, str]:
    """Split the words into type and YAML."""
    words = list(words)
    type_name = words.pop(0) if words and _TYPE.fullmatch(words[0]) else ""
    if stdin:
        words.append(sys.stdin.read())
    if len(words) > 1:
        raise UsageError(
            f"send_goal: got {len(words)} goals {words!r}; expected one. Try quoting the YAML: "
            "'{order: 10}'."
        )
    return type_name, words[0] if words else ""


def _drive(
    client: ActionClient[Any], goal: Any, timeout: float | None, args: argparse.Namespace
) -> int:
    from actionlib_core.action.sent_goal import SentGoal

    if not args.json:
        print_message("Sending goal:", goal)
    # Made before it is sent, for a signal that comes when the server has the goal already.
    unsent = client.make_goal(goal)
    handle: SentGoal[Any, Any] = SentGoal(unsent, timeout)
    interrupted: KeyboardInterrupt | None = None
    timed_out = False
    with while_read():
        try:
            unsent.manager.begin(unsent)
            _follow(handle, args)
        except KeyboardInterrupt as error:  # Ctrl-C or `Terminated`; raised again after the cancel
            interrupted = error
            _cancel(handle, args)
        except TimeoutError:
            timed_out = True
            _cancel(handle, args)
        except BaseException:  # for example, the reader of the output is gone
            # A robot must not go on with a goal that no program follows any more.
            handle.cancel()
            handle.wait(CANCEL_S)
            raise
        _print_end(handle, args)
    # On standard error, as standard output may be read by a program.
    if timed_out:
        print(f"actionlib: send_goal: not over within {args.timeout:g} s", file=sys.stderr)
    if interrupted is not None:
        raise interrupted
    return 0 if handle.status.name == "SUCCEEDED" and not timed_out else EXIT_FAILED


def _follow(handle: SentGoal[Any, Any], args: argparse.Namespace) -> None:
    announced = False
    for feedback in handle.news():
        if not announced and handle.accepted:
            announced = True
            if args.json:
                print_json(event="accepted", id=handle.id)
            else:
                print(f"Goal accepted with ID: {handle.id}\n", flush=True)
        if feedback is None or not args.feedback:
            continue
        if args.json:
            print_json(event="feedback", feedback=feedback.to_dict())
        else:
            print_message("Feedback:", feedback)


def _cancel(handle: SentGoal[Any, Any], args: argparse.Namespace) -> None:
    handle.cancel()
    with while_read():
        print_progress(args, "Canceling goal...")
    handle.wait(CANCEL_S)
    if handle.status.name in CANCELED:
        print_progress(args, "Goal canceled.")


def _print_end(handle: SentGoal[Any, Any], args: argparse.Namespace) -> None:
    status = handle.status.name
    message = handle.get_result()
    if args.json:
        print_json(
            event="result",
            id=handle.id,
            status=status,
            text=handle.text,
            result=None if message is None else message.to_dict(),
        )
        return
    if status == "REJECTED":
        print(f"Goal was rejected.{f' {handle.text}' if handle.text else ''}")
        return
    if message is not None:
        print_message("Result:", message)
    what = "finished with" if handle.over else "not finished; last"
    print(f"Goal {what} status: {status}{f' ({handle.text})' if handle.text else ''}")
