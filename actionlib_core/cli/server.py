"""`actionlib server`: an action server operated by hand."""

from __future__ import annotations

import argparse
import re
import sys
from typing import TYPE_CHECKING, Any

from actionlib_core.cli._command import add_command, print_json, print_message, print_progress
from actionlib_core.cli._network import open_node, typed_class
from actionlib_core.exceptions import ActionlibError
from actionlib_core.process.output import tell

if TYPE_CHECKING:
    from actionlib_core.action.server import ServerGoalHandle

_NUMBER = re.compile("[0-9]{1,9}")  # a goal's; `str.isdigit` is also true for '²'

HELP = """Commands, one a line; N is a goal's number, the newest open one when left out:
  [N] accept [TEXT]      [N] reject [TEXT]
  [N] feedback YAML      [N] succeed [YAML]     [N] abort [YAML]     [N] preempt [YAML]
  list                   quit"""


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = add_command(
        subparsers,
        "server",
        run,
        "offer an action and answer its goals by hand",
        description="Prints goals and takes commands from standard input.",
        epilog=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("name", metavar="NAME", help="the action")
    parser.add_argument("type", metavar="TYPE", help="pkg/Name, pkg/action/Name or pkg/NameAction")
    parser.add_argument("--accept", action="store_true", help="accept every goal at once")


def run(args: argparse.Namespace) -> int:
    """Serve until the input ends."""
    from actionlib_core.action.server import ActionServer

    with open_node(args) as node:
        spec = typed_class(node, "action", args.type)
        operator = Operator(args)
        server = ActionServer(args.name, spec, operator.on_goal, operator.on_cancel, node=node)
        operator.types = server.types
        print_progress(args, f"Serving /{server.ns}. {HELP}")
        try:
            for line in sys.stdin:
                if line.strip() == "quit":
                    break
                operator.obey(line)
        finally:
            server.stop()
        server.wait(0.0)  # raises the error if the server has stopped by itself
    return 0


class Operator:
    """Shows goals to the operator, by number, and carries out the operator's commands."""

    def __init__(self, args: argparse.Namespace) -> None:
        self.types: Any = None
        self._args = args
        self._goals: dict[int, ServerGoalHandle] = {}

    def on_goal(self, handle: ServerGoalHandle) -> None:
        """Show a new goal."""
        number = len(self._goals) + 1
        self._goals[number] = handle
        if self._args.json:
            print_json(event="goal", number=number, goal=handle.get_goal().to_dict())
        else:
            print_message(f"Goal {number} ({handle.get_goal_id().id}):", handle.get_goal())
        if self._args.accept:
            handle.set_accepted()

    def on_cancel(self, handle: ServerGoalHandle) -> None:
        """Show that a goal is asked to stop."""
        number = next(n for n, known in self._goals.items() if known == handle)
        if self._args.json:
            print_json(event="cancel", number=number)
        else:
            print(f"Goal {number} is asked to stop.", flush=True)

    def obey(self, line: str) -> None:
        """Carry out one command; a wrong one is reported and changes nothing."""
        first, _, rest = line.strip().partition(" ")
        try:
            if not first:
                return
            if _NUMBER.fullmatch(first):
                number = int(first)
                first, _, rest = rest.strip().partition(" ")
            else:
                number = max(self._open(), default=0)
            if first == "list":
                self._list()
            else:
                self._do(number, first, rest.strip())
        except ActionlibError as error:
            tell("actionlib", str(error))

    def _open(self) -> list[int]:
        from actionlib_core.goal.states import TERMINAL

        goals = list(self._goals.items())  # a goal may come meanwhile, in another thread
        return [n for n, goal in goals if goal.get_goal_status().status not in TERMINAL]

    def _list(self) -> None:
        from actionlib_core.goal.states import Status

        for number, goal in list(self._goals.items()):  # as in `_open`
            print(f"{number} {Status(goal.get_goal_status().status).name}", flush=True)

    def _do(self, number: int, verb: str, rest: str) -> None:
        handle = self._goals.get(number)
        if handle is None:
            raise ActionlibError(f"{verb}: got goal {number}; expected one of {self._open()}.")
        if verb == "accept":
            handle.set_accepted(rest)
        elif verb == "reject":
            handle.set_rejected(None, rest)
        elif verb == "feedback":
            handle.publish_feedback(self.types.feedback.from_yaml(rest))
        else:
            self._end(handle, verb, rest)

    def _end(self, handle: ServerGoalHandle, verb: str, rest: str) -> None:
        ends = {
            "succeed": handle.set_succeeded,
            "abort": handle.set_aborted,
            "preempt": handle.set_canceled,
        }
        if verb not in ends:
            raise ActionlibError(
                f"got {verb!r}; expected one of "
                f"{['accept', 'reject', 'feedback', *ends, 'list', 'quit']}."
            )
        ends[verb](self.types.result.from_yaml(rest) if rest else None)
