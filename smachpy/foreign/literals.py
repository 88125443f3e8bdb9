"""Values and conditions in the files of other tools: data, or refused; nothing is evaluated."""

from __future__ import annotations

import ast
import copy
import json
import re
import warnings
from typing import Any, Final

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


def plain(node: ast.expr, known: ast.NodeTransformer | None = None) -> Any:
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
