"""The userdata keys that a function certainly reads, whatever it does otherwise."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, TypeAlias

from smachpy.checks._core import syntax

if TYPE_CHECKING:
    from collections.abc import Iterator

_Place: TypeAlias = tuple[int, int]  # line, column
_LOOPS = (ast.While, ast.For, ast.AsyncFor)


def keys_read(tree: ast.AST, name: str) -> frozenset[str] | None:
    """Return the keys read from the userdata called `name`; None if it goes elsewhere.

    Left out are keys that may have a value by then, or may do without one: those asked for with
    `in`, written further up or in the same loop, read where an exception is caught, or read by a
    function inside.
    """
    nodes = list(syntax.own_nodes(tree))
    uses = dict(_uses(tree, name))
    asked = [key for key in (_asked(n, name) for n in ast.walk(tree)) if key is not None]
    named = sum(isinstance(n, ast.Name) and n.id == name for n in ast.walk(tree))
    if named > len(uses) + len(asked):
        return None
    written = _written(nodes, uses)
    caught = {id(node) for node in _caught(nodes)}
    looped = {id(n) for loop in nodes if isinstance(loop, _LOOPS) for n in ast.walk(loop)}
    changed = {id(n.target) for n in nodes if isinstance(n, ast.AugAssign)}
    found: set[str] = set()
    for node in nodes:
        key = uses.get(node)
        if key is None or key in asked or id(node) in caught:
            continue
        if not (id(node) in changed or isinstance(getattr(node, "ctx", None), ast.Load)):
            continue
        if key not in written or (id(node) not in looped and syntax.begin(node) < written[key]):
            found.add(key)
    return frozenset(found)


def _uses(tree: ast.AST, name: str) -> Iterator[tuple[ast.AST, str]]:
    """Yield the nodes that are `name.key` or `name["key"]`, with the key."""
    for node in ast.walk(tree):
        value = getattr(node, "value", None)
        if not (isinstance(value, ast.Name) and value.id == name):
            continue
        if isinstance(node, ast.Attribute) and node.attr not in {"keys", "update"}:
            yield node, node.attr
        elif isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
            yield node, str(node.slice.value)


def _asked(node: ast.AST, name: str) -> str | None:
    """Return the key if it is `"key" in name`."""
    if not (isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In | ast.NotIn)):
        return None
    left, right = node.left, node.comparators[0]
    is_it = isinstance(right, ast.Name) and right.id == name
    return str(left.value) if is_it and isinstance(left, ast.Constant) else None


def _written(nodes: list[ast.AST], uses: dict[ast.AST, str]) -> dict[str, _Place]:
    """Return key -> where it has been written for the first time; `+=` reads it before."""
    ends: dict[int, _Place] = {}
    changed = set()
    for node in nodes:
        if isinstance(node, ast.AugAssign):
            changed.add(id(node.target))
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            ends.update((id(n), syntax.end(node)) for t in targets for n in ast.walk(t))
    found: dict[str, _Place] = {}
    for node in nodes:
        key = uses.get(node)
        if key is None or id(node) in changed:
            continue
        if isinstance(getattr(node, "ctx", None), ast.Store):
            at = ends.get(id(node), syntax.end(node))
            found[key] = min(at, found.get(key, at))
    return found


def _caught(nodes: list[ast.AST]) -> Iterator[ast.AST]:
    """Yield the nodes out of which an exception need not get."""
    for node in nodes:
        if isinstance(node, ast.Try | ast.TryStar) and node.handlers:
            yield from syntax.inside(node.body)
    yield from syntax.inside_calls(nodes, {"suppress"})
