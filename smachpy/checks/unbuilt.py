"""Finds changes of input keys in the source of states that nobody has built, for `smachpy port`."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Final

from smachpy.checks.source import changed_values

if TYPE_CHECKING:
    from collections.abc import Iterator


def changed_inputs(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the lines that change the value of a key which its state declares as input only.

    SMACH let such a change through.
    """
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            code = next((n for n in node.body if getattr(n, "name", "") == "execute"), None)
            skipped, declared = 1, [n for n in ast.walk(node) if _called(n) == "__init__"]
        elif isinstance(node, ast.FunctionDef):
            code, skipped = node, 0
            declared = [n for n in node.decorator_list if _called(n) == "cb_interface"]
        else:
            continue
        names = [a.arg for a in code.args.args] if isinstance(code, ast.FunctionDef) else []
        if len(declared) != 1 or len(names) <= skipped:
            continue
        assert isinstance(code, ast.FunctionDef)
        inputs, outputs = (_declared(declared[0], *place) for place in _PLACES)
        for key, line in changed_values(code, names[skipped]):
            if key in inputs - outputs:
                text = f"{key!r} is an input key only: declare it as output, too"
                yield line, f"{names[skipped]}.{key}: its value is changed, but {text}"


_PLACES: Final = (("input_keys", -2), ("output_keys", -1))
"""The keyword of each kind of keys, and where it stands in a call with all three lists."""


def _declared(call: ast.AST, keyword: str, place: int) -> set[str]:
    """Return the keys that a call declares in a list of texts."""
    assert isinstance(call, ast.Call)
    lists = [n for n in call.args if isinstance(n, ast.List | ast.Tuple)]
    given = [k.value for k in call.keywords if k.arg in {keyword, "io_keys"}]
    given += lists[place:][:1] if len(lists) > -_PLACES[0][1] else []
    texts = (n.value for one in given for n in ast.walk(one) if isinstance(n, ast.Constant))
    return {text for text in texts if isinstance(text, str)}


def _called(node: ast.AST) -> str:
    return ast.unparse(node.func).rpartition(".")[2] if isinstance(node, ast.Call) else ""
