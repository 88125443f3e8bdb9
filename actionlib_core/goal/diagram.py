"""The two life cycles of a goal as Graphviz text, drawn from the tables that run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.goal.life_cycle import client_life_cycle, server_life_cycle
from actionlib_core.goal.states import OVER, TERMINAL, CommState, Status

if TYPE_CHECKING:
    from collections.abc import Collection

    from actionlib_core.goal.life_cycle import LifeCycle

_ENDS: dict[str, Collection[Any]] = {
    "server": TERMINAL,
    "client": OVER,
}


def draw_life_cycles() -> str:
    """Return both life cycles as one DOT graph, a cluster each.

    An edge is drawn for each event that leads from one state to the next; a status that skips
    states follows several edges. The event `lose`, possible in every state, is left to the title.
    """
    lines = [
        "digraph goal {",
        '  graph [fontname="sans-serif", rankdir="LR", compound="true"]',
        '  node [fontname="sans-serif", shape="box", style="rounded"]',
        '  edge [fontname="sans-serif", fontsize="10"]',
    ]
    for cycle in (server_life_cycle(), client_life_cycle()):
        lines += _draw_cluster(cycle)
    lines.append("}")
    return "\n".join(lines) + "\n"


def _draw_cluster(cycle: LifeCycle[Any]) -> list[str]:
    name = cycle.name
    lines = [f"  subgraph cluster_{name} {{", f'    label="{_title(name)}"']
    for state in _states(cycle):
        shape = ', peripheries="2"' if state in _ENDS[name] else ""
        shape += ', penwidth="2"' if state is cycle.initial else ""
        lines.append(f'    {name}_{state.name} [label="{state.name}"{shape}]')
    for (source, target), events in _edges(cycle).items():
        label = "\\n".join(events)
        lines.append(f'    {name}_{source} -> {name}_{target} [label="{label}"]')
    lines.append("  }")
    return lines


def _title(name: str) -> str:
    if name == "server":
        return "The server's goal (events: what your code calls)"
    return "The client's goal (events: statuses, cancel, result; every state may become LOST)"


def _states(cycle: LifeCycle[Any]) -> list[Any]:
    kind = Status if cycle.name == "server" else CommState
    return [state for state in kind if state is not Status.LOST]


def _edges(cycle: LifeCycle[Any]) -> dict[tuple[str, str], list[str]]:
    edges: dict[tuple[str, str], list[str]] = {}
    for (source, event), path in cycle.steps.items():
        if len(path) == 1 and event != "lose":
            edges.setdefault((source.name, path[0].name), []).append(event)
    return edges
