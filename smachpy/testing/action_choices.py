"""Scripted servers for an exploration: what becomes of each goal is a choice."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smachpy.container import Container
from smachpy.testing.action_servers import Reply, ScriptedActionServer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smachpy.testing.explorers import Explorer
    from smachpy.testing.kit import MissionKit

DURATION_S = 1.0
# What may become of a goal; the first is the usual one.
REPLIES: dict[str, Reply] = {
    "succeeds": Reply(duration=DURATION_S),
    "aborts": Reply(status="aborted", duration=DURATION_S),
    "rejects": Reply(status="rejected"),
    "accepts late": Reply(duration=DURATION_S, accept_after=30.0),
    "dies": Reply(status=None, die_after=DURATION_S),
    "dies and comes back": Reply(status=None, die_after=DURATION_S, back_after=5.0),
    "loses the result": Reply(duration=DURATION_S, lose_result=True),
    "delivers twice": Reply(duration=DURATION_S, twice=True),
    "is slow and ignores a cancel": Reply(duration=3 * DURATION_S, ignore_cancel=True),
}
# The same with a preempt of the mission while the goal is active.
PREEMPTED: dict[str, Reply] = {
    "works as a preempt comes": Reply(duration=3 * DURATION_S),
    "works as a preempt comes, and ignores the cancel": Reply(
        duration=3 * DURATION_S, ignore_cancel=True
    ),
}


def serve_actions(
    kit: MissionKit, machine: Container, explorer: Explorer
) -> list[ScriptedActionServer]:
    """Offer every action that the machine's states use; return the servers."""
    names: set[str] = set()
    servers: list[ScriptedActionServer] = []
    for state in _action_states(machine):
        name = state._action_name  # noqa: SLF001  one house
        if name not in names:
            names.add(name)
            server = kit.action_server(name, state._types.action)  # noqa: SLF001
            _let_choose(server, explorer)
            servers.append(server)
    return servers


def _action_states(container: Container) -> Iterator[Any]:
    for child in container.get_children().values():
        if isinstance(child, Container):
            yield from _action_states(child)
        elif child.kind == "action":
            yield child


def _let_choose(server: ScriptedActionServer, explorer: Explorer) -> None:
    def choose() -> Reply:
        options = [*REPLIES, *(PREEMPTED if explorer.may_preempt else ())]
        picked = options[explorer.choose(f"server {server.name}", options)]
        if picked in PREEMPTED:
            explorer.count_preempt()
            server.node.clock.call_later(DURATION_S, explorer.preempt)
            return PREEMPTED[picked]
        return REPLIES[picked]

    server.choose_by(choose)
