"""Questions about Python syntax trees that know nothing of states."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

INNER = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
# Statements whose target gets something that is not plain to see.
_TARGETED = (ast.AugAssign, ast.For, ast.AsyncFor, ast.comprehension)
_NAMED = (
    ast.MatchAs,
    ast.MatchStar,
    ast.ExceptHandler,
    ast.FunctionDef,
    ast.AsyncFunctionDef,
    ast.ClassDef,
)


def own_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below `tree`, those of functions inside it left out."""
    for child in ast.iter_child_nodes(tree):
        yield child
        if not isinstance(child, INNER):
            yield from own_nodes(child)


def called(node: ast.Call) -> str:
    """Return the last word of what is called."""
    return str(getattr(node.func, "attr", None) or getattr(node.func, "id", ""))


def parameters(tree: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[str]:
    """Yield the names of the parameters."""
    return (node.arg for node in ast.walk(tree.args) if isinstance(node, ast.arg))


def bindings(node: ast.AST) -> Iterator[tuple[str, ast.expr | None]]:
    """Yield the names that a node binds, with the value if it is plain to see."""
    if isinstance(node, ast.Assign):
        for target in node.targets:
            if isinstance(target, ast.Name):
                yield target.id, node.value
            else:
                yield from unknown(target)
    elif isinstance(node, ast.AnnAssign | ast.NamedExpr) and isinstance(node.target, ast.Name):
        yield node.target.id, node.value
    elif isinstance(node, _TARGETED):
        yield from unknown(node.target)
    elif isinstance(node, ast.withitem) and node.optional_vars is not None:
        yield from unknown(node.optional_vars)
    else:
        yield from ((name, None) for name in _names(node))


def unknown(target: ast.AST) -> Iterator[tuple[str, None]]:
    """Yield the names in `target`, which get something that is not plain to see."""
    return ((n.id, None) for n in ast.walk(target) if isinstance(n, ast.Name))


def _names(node: ast.AST) -> list[str]:
    """Return the names that a node binds without an assignment."""
    if isinstance(node, ast.Global | ast.Nonlocal):
        return node.names
    if isinstance(node, ast.Import | ast.ImportFrom):
        return [alias.asname or alias.name.partition(".")[0] for alias in node.names]
    if isinstance(node, _NAMED):
        return [node.name] if node.name else []
    if isinstance(node, ast.MatchMapping):
        return [node.rest] if node.rest else []
    return []


def begin(node: ast.AST) -> tuple[int, int]:
    """Return the line and column where `node` begins."""
    return getattr(node, "lineno", 0), getattr(node, "col_offset", 0)


def end(node: ast.AST) -> tuple[int, int]:
    """Return the line and column where `node` ends."""
    return getattr(node, "end_lineno", 0) or 0, getattr(node, "end_col_offset", 0) or 0


def has_limit(call: ast.Call, position: int) -> bool:
    """Tell whether a call has an argument there or by name, and it is not None."""
    given = [*call.args[position:], *(keyword.value for keyword in call.keywords)]
    return any(not (isinstance(value, ast.Constant) and value.value is None) for value in given)


def inside_calls(nodes: list[ast.AST], names: Collection[str]) -> Iterator[ast.AST]:
    """Yield what stands in the body of a `with` that enters a call of one of `names`.

    The call has an argument, and it is not None.
    """
    for node in nodes:
        if isinstance(node, ast.With | ast.AsyncWith):
            entered = [item.context_expr for item in node.items]
            if any(
                isinstance(call, ast.Call) and called(call) in names and has_limit(call, 0)
                for call in entered
            ):
                yield from inside(node.body)


def inside(statements: list[ast.stmt]) -> Iterator[ast.AST]:
    """Yield the statements and all below them."""
    for statement in statements:
        yield from ast.walk(statement)
