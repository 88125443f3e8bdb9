"""Writes a picture as DOT text: containers are clusters, outcomes are pills inside them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import graphviz

from smachpy_viz.pictures import layout, style

if TYPE_CHECKING:
    from collections.abc import Mapping

    from smachpy_viz.pictures.shapes import Anchor, Arrow, Box
    from smachpy_viz.pictures.theme import Theme


def dot_text(
    root: Box, theme: Theme, geometry: Mapping[str, Mapping[str, str]] | None = None
) -> str:
    """Return `root` as DOT.

    Args:
        root: The picture.
        theme: The colours.
        geometry: Positions by name (`layout.compose`), for an engine that keeps them (`nop2`).
            Without positions any layout engine can draw the text; `dot` gives the best result.
    """
    return _DotWriter(theme, geometry or {}).text(root)


class _DotWriter:
    def __init__(self, theme: Theme, geometry: Mapping[str, Mapping[str, str]]) -> None:
        self._theme = theme
        self._geometry = geometry

    def text(self, root: Box) -> str:
        canvas = self._geometry.get(layout.CANVAS, {})
        dot = graphviz.Digraph("machine", graph_attr={**style.graph(self._theme), **canvas})
        dot.attr("node", **style.node_defaults(self._theme))
        dot.attr("edge", **style.edge_defaults(self._theme))
        self._box(dot, root)
        return str(dot.source)

    def _box(self, dot: graphviz.Digraph, box: Box) -> None:
        if box.entry is None:
            self._node(dot, box.name, box.attributes)
            return
        with dot.subgraph(name=f"cluster_{box.name}") as cluster:
            cluster.attr("graph", **box.attributes, **self._geometry.get(box.name, {}))
            self._node(cluster, box.entry.name, box.entry.attributes)
            for child in box.boxes:
                self._box(cluster, child)
            for vertex in box.joins:
                self._node(cluster, vertex.name, vertex.attributes)
            self._pills(cluster, box)
        for arrow in box.arrows:
            self._arrow(dot, box, arrow)

    def _pills(self, cluster: graphviz.Digraph, box: Box) -> None:
        if self._geometry:
            for vertex in box.pills:
                self._node(cluster, vertex.name, vertex.attributes)
        elif box.pills:
            with cluster.subgraph() as bottom:
                bottom.attr(rank="sink")
                for vertex in box.pills:
                    self._node(bottom, vertex.name, vertex.attributes)

    def _node(self, dot: graphviz.Digraph, name: str, attributes: Mapping[str, str]) -> None:
        dot.node(name, **attributes, **self._geometry.get(name, {}))

    def _arrow(self, dot: graphviz.Digraph, box: Box, arrow: Arrow) -> None:
        tail, tail_cluster = _end(arrow.tail, box)
        head, head_cluster = _end(arrow.head, box)
        attributes = {**arrow.attributes, **self._geometry.get(arrow.name, {})}
        if arrow.back:
            tail, head, tail_cluster, head_cluster = head, tail, head_cluster, tail_cluster
            attributes["dir"] = "back"
        if tail_cluster and not self._geometry:
            attributes["ltail"] = tail_cluster
        if head_cluster and not self._geometry:
            attributes["lhead"] = head_cluster
        dot.edge(tail, head, **attributes)


def _end(anchor: Anchor, inside: Box) -> tuple[str, str]:
    """Return the node that an arrow is attached to, and the cluster at whose border it is cut."""
    if not anchor.is_open:
        return anchor.box, ""
    if anchor.part.startswith(("o", "j")):
        return f"{anchor.box}_{anchor.part}", ""
    return f"{anchor.box}_in", "" if anchor.box == inside.name else f"cluster_{anchor.box}"
