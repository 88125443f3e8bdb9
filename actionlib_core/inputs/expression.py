"""The language of conditions in files and on the command line: one expression over plain data.

It has Python's syntax, but only names, fields, items, numbers, texts, lists, comparisons,
arithmetic, `and`, `or`, `not` and the calls of `FUNCTIONS`. Anything else is refused when it is
parsed. It runs no code of others and takes little time and memory, whoever has written it.
"""

from __future__ import annotations

import ast
import math
import warnings
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.exceptions import ActionlibError

if TYPE_CHECKING:
    from collections.abc import Callable

WHOLE: Final = "m"
"""The name of all that an expression is evaluated for, such as a message, unless it has such a
field."""
MAX_EXPRESSION_LENGTH: Final = 1000
"""The longest expression [characters]."""
MAX_NESTING: Final = 40
"""The deepest nesting of an expression."""

FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    "abs": abs,
    "all": all,
    "any": any,
    "hypot": math.hypot,
    "len": len,
    "max": max,
    "min": min,
    "sqrt": math.sqrt,
    "sum": sum,
}
ARITHMETIC: Final = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.FloorDiv, ast.Mod)
_COMPARISONS: Final = (ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.In, ast.NotIn)
OPERATORS: Final = (*ARITHMETIC, *_COMPARISONS, ast.Not, ast.USub, ast.UAdd, ast.And, ast.Or)
_NODES: Final = (
    *(ast.Name, ast.Attribute, ast.Subscript, ast.List, ast.Tuple, ast.Constant),
    *(ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.Compare, ast.Call),
)
_EXPECTED: Final = (
    "fields, numbers, texts, lists, comparisons, arithmetic (+ - * / // %), and, or, not"
)


class ExpressionError(ActionlibError, ValueError):
    """An expression that cannot be parsed, or not be evaluated for these values.

    Try: correct the text at the column that is shown.

    Attributes:
        expression: Its text.
        problem: What is wrong.
        column: Where, from 0.
    """

    def __init__(self, expression: str, problem: str, column: int = 0) -> None:
        self.expression = expression
        self.problem = problem
        self.column = column
        super().__init__(f"{problem}\n  {expression}\n  {' ' * column}^")


class MissingNameError(ExpressionError):
    """An expression asks for a name or field that is not there.

    Try: use one of the names that the error lists.
    """


class Expression:
    """An expression, such as `pose.position.x > 2 and status in [1, 3]`.

    Args:
        text: The expression.

    Attributes:
        text: The expression, without spaces around it.

    Raises:
        ExpressionError: it is none, or contains something that is not allowed.
    """

    def __init__(self, text: str) -> None:
        if len(text) > MAX_EXPRESSION_LENGTH:
            problem = f"got {len(text)} characters; expected {MAX_EXPRESSION_LENGTH} at most."
            raise ExpressionError(text[:60], problem)
        self.text = text.strip()
        try:
            with warnings.catch_warnings():
                # Python's hints about its own syntax, such as "1or 2", are no business of readers.
                warnings.simplefilter("ignore")
                self._tree = ast.parse(self.text, mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            reason = getattr(error, "msg", None) or str(error)
            problem = f"{reason}; expected an expression such as 'data > 3'."
            raise ExpressionError(
                self.text, problem, (getattr(error, "offset", 1) or 1) - 1
            ) from error
        _check(self._tree, self.text, 0)

    @property
    def names(self) -> frozenset[str]:
        """The names that it asks for, without those of functions."""
        nodes = [node for node in ast.walk(self._tree) if isinstance(node, ast.Name)]
        called = {id(node.func) for node in ast.walk(self._tree) if isinstance(node, ast.Call)}
        return frozenset(node.id for node in nodes if id(node) not in called)

    def __call__(self, values: Any) -> Any:
        """Return its value.

        Args:
            values: The names: a mapping, or a message or dataclass, whose fields are the names.

        Raises:
            MissingNameError: a name or a field is not there.
            ExpressionError: an operation does not fit its values, or its result is too large.

        Threads: any.
        """
        from actionlib_core.inputs._evaluator import evaluate

        return evaluate(self.text, self._tree, values)

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"


# -- when it is parsed -----------------------------------------------------------------------------


def _check(node: ast.expr, text: str, depth: int) -> None:
    """Refuse everything that is not allowed."""
    problem = (
        f"nested deeper than {MAX_NESTING}; expected less."
        if depth > MAX_NESTING
        else _problem(node)
    )
    if problem:
        raise ExpressionError(text, problem, node.col_offset)
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.expr) and child is not getattr(node, "func", None):
            _check(child, text, depth + 1)


def _problem(node: ast.expr) -> str:
    operators = [getattr(node, "op", None), *getattr(node, "ops", ())]
    wrong = [type(op).__name__ for op in operators if op and not isinstance(op, OPERATORS)]
    if wrong:
        return f"operator {wrong[0]} is not allowed; expected {_EXPECTED}."
    if isinstance(node, ast.Attribute) and node.attr.startswith("_"):
        return f"{node.attr!r} is not allowed; expected a field."
    if isinstance(node, ast.Call):
        known = isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS
        return "" if known and not node.keywords else _CALLS
    constant = isinstance(node, ast.Constant) and not isinstance(node.value, _CONSTANTS)
    if constant or not isinstance(node, _NODES):
        return f"{type(node).__name__} is not allowed; expected {_EXPECTED}."
    return ""


_CONSTANTS: Final = (bool, int, float, str, type(None))
_CALLS: Final = f"this call is not allowed; expected one of {sorted(FUNCTIONS)}."
