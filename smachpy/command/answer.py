"""`smachpy answer`: shows the questions of missions, and answers one."""

from __future__ import annotations

import contextlib
import getpass
import json
import os
import socket
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from actionlib_core.process.output import printable
from smachpy.exceptions import MissionError, did_you_mean

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator, Sequence

    from actionlib_core.node import Node
    from smachpy.states.questions import Question

EXIT_NOTHING = 1
EXAMPLES = """examples:
  smachpy answer                       show the current questions
  smachpy answer yes                   answer the only question
  smachpy answer yes --state CONFIRM   answer the question of that state, if there are several
"""


def register(subparsers: Any) -> None:
    """Add `smachpy answer`."""
    import argparse

    parser = subparsers.add_parser(
        "answer",
        help="answer the question of a mission",
        description="Show the questions that missions ask on this network and in your private "
        "runs, or answer one. Exit codes: 0 answered or shown, 1 no questions, 2 not answered.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "answer", nargs="?", help="one of the answers; without it, show the questions"
    )
    parser.add_argument(
        "--state",
        metavar="PATH",
        help="the state that asks, or the end of its path; or its service, if states of one path "
        "ask",
    )
    parser.add_argument(
        "--by", metavar="NAME", help="your name, for the record (default: login name)"
    )
    parser.add_argument("--json", action="store_true", help="show the questions as JSON")
    parser.set_defaults(run=_run)


def _run(args: argparse.Namespace) -> int:
    from smachpy.states.questions import find_questions, give_answer

    with _nodes() as nodes:
        found = [(one, node) for node in nodes for one in find_questions(node)]
        if args.answer is None:
            return show([one for one, _ in found], as_json=args.json)
        question = choose([one for one, _ in found], args.state)
        node = next(node for one, node in found if one is question)
        give_answer(question.service, args.answer, args.by or _user(), node=node)
    print(printable(f"{question.path}: answered {args.answer}"))
    return 0


def choose(questions: Sequence[Question], state: str | None) -> Question:
    """Return the question to answer.

    Args:
        questions: All open questions.
        state: Path of the state that asks, or the end of it, or its service; None if there is only
            one.

    Raises:
        MissionError: there is none, or several match.
    """
    paths = [one.path for one in questions]
    if not questions:
        raise MissionError("answer: got no question on the network; expected one.")
    fits = list(questions)
    if state is not None:
        word = state.strip("/")
        whole = [one for one in questions if one.path == state or one.service.strip("/") == word]
        fits = whole or [one for one in questions if one.path.endswith(f"/{word}")]
    if not fits:
        hint = did_you_mean(state or "", paths)
        raise MissionError(f"state: got {state!r}; expected one of {paths}.{hint}")
    if len(fits) > 1:
        names = [one.path for one in fits]
        if len(set(names)) < len(names):  # of several robots, for example
            names = [one.service for one in fits]
        raise MissionError(
            f"state: got {'none' if state is None else repr(state)}, and {len(fits)} questions are "
            f"asked; expected one of {names}. Try --state."
        )
    return fits[0]


def show(questions: Sequence[Question], *, as_json: bool) -> int:
    """Print the questions, and return the exit code."""
    paths = [one.path for one in questions]
    if as_json:
        print(json.dumps([asdict(one) for one in questions]))
    elif not questions:
        print("no mission asks anything")
    for one in questions if not as_json else ():
        answers = [
            f"{answer} ({words})" if words else answer
            for answer, words in zip(one.answers, one.words, strict=True)
        ]
        where = f"{one.path} ({one.service})" if paths.count(one.path) > 1 else one.path
        print(printable(f"{where}: {one.text}"))
        limit = f"; without an answer {one.default} in {one.left:.0f} s" if one.default else ""
        print(printable(f"    {', '.join(answers)}{limit}"))
    return 0 if questions else EXIT_NOTHING


@contextlib.contextmanager
def _nodes() -> Iterator[list[Node]]:
    """Yield nodes: on the network of the environment, or on the default one and private runs."""
    from actionlib_core.config import Config
    from actionlib_core.node import Node, get_node
    from actionlib_core.wire.presence import settle_network
    from actionlib_core.wire.private_network import list_private_networks, network_is_chosen

    node = get_node()
    settle_network(node.transport, node.clock)
    with contextlib.ExitStack() as stack:
        domains = [] if network_is_chosen() else list_private_networks(node.transport)
        name = f"answer_{os.getpid()}"
        more = [stack.enter_context(Node(name, config=Config(domain=one))) for one in domains]
        for one in more:
            settle_network(one.transport, one.clock)
        yield [node, *more]


def _user() -> str:
    try:
        name = getpass.getuser()
    except (OSError, KeyError):  # a user id without a name
        name = str(os.getuid())
    return f"{name}@{socket.gethostname()}"
