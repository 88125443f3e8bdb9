"""Values and conditions in the files of other tools: data, or refused; nothing is evaluated."""

from __future__ import annotations

import ast
import copy
import json
import re
import warnings
from typing import TYPE_CHECKING, Any, Final

from smachpy.foreign.draft import Part

if TYPE_CHECKING:
    from smachpy.foreign.draft import Draft

LONGEST: Final = 60
"""Longest text of another file in a note [characters]."""

_TOKEN: Final = re.compile(r"""'[^']*'|"[^"]*"|===|!==|!=|&&|\|\||!|\w+""")
_WORDS: Final = {"true": "True", "false": "False", "null": "None", "undefined": "None"}
_SPELT: Final = {"===": "==", "!==": "!=", "&&": " and ", "||": " or ", "!": " not ", **_WORDS}


class NotPlainError(ValueError):
    """A text or an expression is no plain data."""


def parse_python(source: str | bytes) -> ast.Module:
    """Parse Python without its warnings.

    Raises:
        SyntaxError, ValueError, RecursionError, MemoryError: it is none, or too deep.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return ast.parse(source)


class Known(ast.NodeTransformer):
    """Puts literals in the places of what a behaviour of FlexBE has given a name."""

    def __init__(self, draft: Draft) -> None:
        self._draft = draft
        self.names: dict[str, tuple[ast.expr, int]] = {}
        self.parameters = Part((1, 1))

    def name(self, name: str, value: ast.expr) -> None:
        """Give a literal a name."""
        made = self.visit(copy.deepcopy(value))
        self.names[name] = made, sum(1 for _ in ast.walk(made))

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Return the literal."""
        made, size = self.names.get(node.id, (node, 1))
        self._draft.spend(size)  # lists of lists of lists of names grow without end
        return made

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Return the text that stands for a parameter, and the name of a level."""
        match node:
            case ast.Attribute(value=ast.Name(id="self"), attr=name) if name in self.parameters:
                return ast.Constant(f"${{{name}}}")
            case ast.Attribute(value=ast.Name(id="Logger" | "Autonomy"), attr=level):
                return ast.Constant(level)
        return node


def plain(node: ast.expr, known: Known | None = None) -> Any:
    """Return the data that an expression of Python writes down.

    Args:
        node: The expression.
        known: Puts literals in the places of names.

    Raises:
        NotPlainError: it is something else.
    """
    if known is not None:
        node = known.visit(copy.deepcopy(node))
    keys = [key for each in ast.walk(node) if isinstance(each, ast.Dict) for key in each.keys]
    if not all(isinstance(getattr(key, "value", None), str) for key in keys):
        raise NotPlainError
    try:  # JSON has lists for tuples, and no sets, bytes and endless numbers
        return json.loads(json.dumps(ast.literal_eval(node), allow_nan=False))
    except (ValueError, TypeError, SyntaxError) as error:
        raise NotPlainError from error


def read_value(text: str) -> Any:
    """Return the data that a text writes down, in JSON or Python.

    Raises:
        NotPlainError: it is something else.
    """
    try:
        return json.loads(text, parse_constant=_refused)
    except (ValueError, RecursionError):
        pass
    try:
        return plain(ast.parse(text.strip(), mode="eval").body)
    except (ValueError, SyntaxError, RecursionError, MemoryError) as error:
        raise NotPlainError from error


def _refused(name: str) -> None:
    raise NotPlainError(name)


def read_condition(text: str) -> str:
    """Return a condition of ECMAScript as an expression, as far as operators and constants go."""
    return " ".join(_TOKEN.sub(lambda found: _SPELT.get(found[0], found[0]), text).split())


def shown(what: str | ast.AST) -> str:
    """Return code on one short line."""
    text = " ".join((what if isinstance(what, str) else ast.unparse(what)).split())
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
