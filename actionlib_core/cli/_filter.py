"""Expressions over a message, for `topic echo --filter`: comparisons and arithmetic only.

An expression has Python's syntax, but is evaluated here and not by `eval`, so that it cannot run
other code: names are the message's fields (`m` is the whole message), the only calls are those of
the functions below, and everything else is refused before the first message.
"""

from __future__ import annotations

import ast
import math
import operator
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.exceptions import ActionlibError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

WHOLE = "m"
LONGEST = 1000  # characters
DEEPEST = 40  # nested expressions
# Limits of results: an integer of billions of digits would take much time and memory.
_LARGEST = 1e300
_MOST_ITEMS = 100_000

_FUNCTIONS: Final[Mapping[str, Callable[..., Any]]] = {
    "abs": abs,
    "any": any,
    "all": all,
    "hypot": math.hypot,
    "len": len,
    "max": max,
    "min": min,
    "sqrt": math.sqrt,
    "sum": sum,
}
_BINARY: Final[Mapping[type[ast.operator], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
}
_UNARY: Final[Mapping[type[ast.unaryop], Callable[[Any], Any]]] = {
    ast.Not: operator.not_,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_COMPARED: Final[Mapping[type[ast.cmpop], Callable[[Any, Any], bool]]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
}
_PLAIN: Final = (ast.Name, ast.Attribute, ast.Subscript, ast.List, ast.Tuple, ast.BoolOp)
_NOT_KNOWN: Final = (
    "{} is not allowed; expected fields, numbers, texts, lists, comparisons, arithmetic, and, or, "
    "not."
)


class FilterError(ActionlibError, ValueError):
    """An expression that cannot be parsed, or not be evaluated for a message.

    Attributes:
        expression: Its text.
    """

    def __init__(self, expression: str, problem: str, column: int = 0) -> None:
        self.expression = expression
        super().__init__(f"--filter: {problem}\n  {expression}\n  {' ' * column}^")


class Filter:
    """A condition for messages.

    Args:
        expression: For example `pose.position.x > 2 and status in [1, 3]`.

    Raises:
        FilterError: it is not an expression, or contains something that is not allowed.
    """

    def __init__(self, expression: str) -> None:
        self._text = expression
        if len(expression) > LONGEST:
            raise FilterError(
                expression[:60], f"got {len(expression)} characters; expected {LONGEST} at most."
            )
        try:
            self._tree = ast.parse(expression.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            column = (getattr(error, "offset", 1) or 1) - 1
            reason = getattr(error, "msg", None) or str(error)
            raise FilterError(
                expression, f"{reason}; expected an expression such as 'data > 3'.", column
            ) from error
        self._text = expression.strip()
        self._check(self._tree, 0)

    def __call__(self, fields: Mapping[str, Any]) -> bool:
        """Return whether a message fulfils the condition.

        Args:
            fields: The message as nested dicts, lists and scalars.

        Raises:
            FilterError: a field is not there, or the operation does not fit its value.
        """
        return bool(self._value(self._tree, fields))

    # -- before the first message --------------------------------------------------------------

    def _check(self, node: ast.expr, depth: int) -> None:
        """Refuse everything that is not allowed."""
        if depth > DEEPEST:
            raise self._error(node, f"nested deeper than {DEEPEST}; expected less.")
        problem = self._problem(node)
        if problem:
            raise self._error(node, problem)
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.expr) and child is not getattr(node, "func", None):
                self._check(child, depth + 1)

    def _problem(self, node: ast.expr) -> str:
        problem = _NOT_KNOWN.format(type(node).__name__)
        match node:
            case ast.BinOp(op=op):
                problem = self._unless(op, _BINARY)
            case ast.UnaryOp(op=op):
                problem = self._unless(op, _UNARY)
            case ast.Compare(ops=ops):
                problem = next(filter(None, (self._unless(op, _COMPARED) for op in ops)), "")
            case ast.Attribute(attr=name) if name.startswith("_"):
                problem = f"{name!r} is not allowed; expected a field."
            case ast.Call():
                known = isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS
                if known and not node.keywords:
                    return ""
                problem = f"this call is not allowed; expected one of {sorted(_FUNCTIONS)}."
            case ast.Constant(value=bool() | int() | float() | str() | None):
                problem = ""
            case _ if isinstance(node, _PLAIN):
                problem = ""
        return problem

    @staticmethod
    def _unless(op: ast.AST, known: Mapping[Any, Any]) -> str:
        if type(op) in known:
            return ""
        return f"operator {type(op).__name__} is not allowed; expected + - * / // %, comparisons."

    def _error(self, node: ast.expr, problem: str) -> FilterError:
        return FilterError(self._text, problem, node.col_offset)

    # -- for a message ---------------------------------------------------------------------------

    def _value(self, node: ast.expr, fields: Mapping[str, Any]) -> Any:
        try:
            return self._evaluate(node, fields)
        except FilterError:
            raise
        except (TypeError, ValueError, ArithmeticError, LookupError) as error:
            raise self._error(node, f"{type(error).__name__}: {error}.") from error

    def _evaluate(self, node: Any, fields: Mapping[str, Any]) -> Any:
        match node:
            case ast.Constant():
                return node.value
            case ast.Name():
                whole = node.id == WHOLE and WHOLE not in fields
                return fields if whole else self._field(node, fields, node.id)
            case ast.Attribute():
                return self._field(node, self._value(node.value, fields), node.attr)
            case ast.BoolOp():
                return self._logic(node, fields)
        # All other expressions first evaluate their operands.
        return self._evaluate_operation(node, fields)

    def _evaluate_operation(self, node: Any, fields: Mapping[str, Any]) -> Any:
        value = partial(self._value, fields=fields)
        match node:
            case ast.BinOp():
                return self._arithmetic(node, value(node.left), value(node.right))
            case ast.UnaryOp():
                return _UNARY[type(node.op)](value(node.operand))
            case ast.Compare():
                return self._compare(node, fields)
            case ast.Subscript():
                return value(node.value)[value(node.slice)]
            case ast.Call(func=ast.Name(id=name)):
                return _FUNCTIONS[name](*map(value, node.args))
        return list(map(value, node.elts))  # a list or a tuple

    def _field(self, node: ast.expr, value: Any, name: str) -> Any:
        if isinstance(value, dict) and name in value:
            return value[name]
        there = sorted(value) if isinstance(value, dict) else "no fields"
        raise self._error(node, f"{name!r} is not there; there are {there}.")

    def _arithmetic(self, node: ast.BinOp, left: Any, right: Any) -> Any:
        # Not all that Python allows: "text" * 10**9, for example, is refused.
        numbers = isinstance(left, int | float) and isinstance(right, int | float)
        if not numbers and not (isinstance(node.op, ast.Add) and type(left) is type(right)):
            raise self._error(node, f"got {left!r:.40} and {right!r:.40}; expected two numbers.")
        result = _BINARY[type(node.op)](left, right)
        if numbers and abs(result) > _LARGEST:
            raise self._error(node, "the number is too large.")
        if not numbers and len(result) > _MOST_ITEMS:
            raise self._error(node, "the result is too long.")
        return result

    def _logic(self, node: ast.BoolOp, fields: Mapping[str, Any]) -> Any:
        stop = isinstance(node.op, ast.Or)
        value: Any = not stop
        for each in node.values:
            value = self._value(each, fields)
            if bool(value) is stop:
                return value
        return value

    def _compare(self, node: ast.Compare, fields: Mapping[str, Any]) -> bool:
        left = self._value(node.left, fields)
        for op, right_node in zip(node.ops, node.comparators, strict=True):
            right = self._value(right_node, fields)
            if not _COMPARED[type(op)](left, right):
                return False
            left = right
        return True
