"""Evaluates the expressions of `actionlib_core.inputs.expression`, with simpleeval."""

from __future__ import annotations

import ast
import threading
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, Final

from simpleeval import DEFAULT_OPERATORS, SimpleEval

from actionlib_core.inputs.expression import (
    ARITHMETIC,
    FUNCTIONS,
    OPERATORS,
    WHOLE,
    ExpressionError,
    MissingNameError,
)

if TYPE_CHECKING:
    from collections.abc import Callable

_LARGEST: Final = 1e300  # of numbers: one of billions of digits would take much time and memory
_MAX_ITEMS: Final = 100_000  # of texts and lists
_ADD: Final = DEFAULT_OPERATORS[ast.Add]


def evaluate(text: str, tree: ast.expr, values: Any) -> Any:
    """Return the value of an expression; see `Expression.__call__`.

    Args:
        text: The expression.
        tree: Its syntax tree, which has been checked.
        values: The names.
    """
    evaluator = getattr(_of_thread, "evaluator", None)
    if evaluator is None:
        evaluator = _of_thread.evaluator = _Evaluator()
    before = evaluator.names, evaluator.expr  # those of an expression that asks for these values
    evaluator.names = values
    try:
        return evaluator.eval(text, tree)
    finally:
        evaluator.names, evaluator.expr = before


_of_thread = threading.local()


class _RefusedError(ValueError):
    """A problem in words."""


class _MissingError(Exception):
    """A name that is not there, in words."""


class _Evaluator(SimpleEval):  # type: ignore[misc]  # it has no types
    """Reads plain data only, and has limits."""

    def __init__(self) -> None:
        operators = {op: DEFAULT_OPERATORS[op] for op in OPERATORS if op in DEFAULT_OPERATORS}
        operators |= {op: _limited(DEFAULT_OPERATORS[op]) for op in ARITHMETIC}
        super().__init__(operators, FUNCTIONS, {})
        self.nodes |= {ast.List: self._eval_items, ast.Tuple: self._eval_items}

    def _eval(self, node: ast.expr) -> Any:
        try:
            return self.nodes[type(node)](node)
        except ExpressionError:
            raise
        except _MissingError as missing:
            raise MissingNameError(self.expr, str(missing), node.col_offset) from None
        except _RefusedError as refused:
            raise ExpressionError(self.expr, str(refused), node.col_offset) from None
        except (TypeError, ValueError, ArithmeticError, LookupError) as error:
            text = f"{type(error).__name__}: {error}."
            raise ExpressionError(self.expr, text, node.col_offset) from error

    def _eval_items(self, node: ast.List | ast.Tuple) -> list[Any]:
        return [self._eval(each) for each in node.elts]

    def _eval_name(self, node: ast.Name) -> Any:
        whole = node.id == WHOLE and WHOLE not in _names_of(self.names)
        return self.names if whole else _field(self.names, node.id)

    def _eval_attribute(self, node: ast.Attribute) -> Any:
        return _field(self._eval(node.value), node.attr)

    def _eval_subscript(self, node: ast.Subscript) -> Any:
        value, key = self._eval(node.value), self._eval(node.slice)
        if not isinstance(value, (Sequence, Mapping)):
            raise _RefusedError(f"got {type(value).__name__}; expected a list, text or dict.")
        return value[key]


def _names_of(values: Any) -> list[str]:
    """Return the names of the fields of plain data: of a mapping, message, dataclass or tuple."""
    if isinstance(values, Mapping):
        return list(values)
    if hasattr(type(values), "_slot_types"):  # a message
        return list(values.__slots__)
    if is_dataclass(values):
        return [each.name for each in fields(values)]
    return list(getattr(values, "_fields", ())) if isinstance(values, tuple) else []


def _field(values: Any, name: str) -> Any:
    """Return a field. No other attribute is read: it might be code."""
    if isinstance(values, Mapping):
        if name in values:
            return values[name]
    elif name in _names_of(values):
        return getattr(values, name)
    there = sorted(_names_of(values)) or "no fields"
    raise _MissingError(f"{name!r} is not there; there are {there}.")


def _limited(operate: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return an operator for two numbers, and for + also for two texts or lists."""

    def limited(left: Any, right: Any) -> Any:
        if isinstance(left, int | float) and isinstance(right, int | float):
            number = operate(left, right)
            if abs(number) > _LARGEST:
                raise _RefusedError("the number is too large.")
            return number
        alike = type(left) is type(right) and isinstance(left, (str, list, tuple))
        if not alike or operate is not _ADD:
            raise _RefusedError(f"got {left!r:.40} and {right!r:.40}; expected two numbers.")
        if len(left) + len(right) > _MAX_ITEMS:
            raise _RefusedError("the result is too long.")
        return operate(left, right)

    return limited
