"""Tell functions that only read and compare: where and how often one runs makes no difference."""

from __future__ import annotations

import dis
from types import FunctionType

_PLAIN = frozenset(
    {
        "BINARY_OP",
        "BINARY_SUBSCR",
        "BUILD_TUPLE",
        "CACHE",
        "COMPARE_OP",
        "CONTAINS_OP",
        "COPY",
        "COPY_FREE_VARS",
        "EXTENDED_ARG",
        "IS_OP",
        "JUMP_FORWARD",
        "JUMP_IF_FALSE_OR_POP",
        "JUMP_IF_TRUE_OR_POP",
        "LOAD_ATTR",
        "LOAD_CONST",
        "LOAD_DEREF",
        "LOAD_FAST",
        "LOAD_FAST_BORROW",
        "LOAD_FAST_BORROW_LOAD_FAST_BORROW",
        "LOAD_FAST_CHECK",
        "LOAD_FAST_LOAD_FAST",
        "LOAD_GLOBAL",
        "LOAD_SMALL_INT",
        "NOP",
        "NOT_TAKEN",
        "POP_JUMP_FORWARD_IF_FALSE",
        "POP_JUMP_FORWARD_IF_NONE",
        "POP_JUMP_FORWARD_IF_NOT_NONE",
        "POP_JUMP_FORWARD_IF_TRUE",
        "POP_JUMP_IF_FALSE",
        "POP_JUMP_IF_NONE",
        "POP_JUMP_IF_NOT_NONE",
        "POP_JUMP_IF_TRUE",
        "POP_TOP",
        "RESUME",
        "RETURN_CONST",
        "RETURN_VALUE",
        "STORE_FAST",
        "STORE_FAST_LOAD_FAST",
        "STORE_FAST_STORE_FAST",
        "SWAP",
        "TO_BOOL",
        "UNARY_INVERT",
        "UNARY_NEGATIVE",
        "UNARY_NOT",
        "UNARY_POSITIVE",
    }
)
"""Instructions of Python 3.11 to 3.14 that call, loop, raise and write nothing."""


def only_compares(function: object) -> bool:
    """Tell whether `function` does no more than read, calculate and compare.

    It calls nothing, has no loop and writes nothing but its own variables, so that it takes no
    time, waits for nothing and cannot tell which thread runs it. What an instruction does to a
    value of a class of the user's (`a.b`, `a < b`) is not looked at.

    Args:
        function: Anything; only functions written in Python can be told to be plain.
    """
    if not isinstance(function, FunctionType):
        return False
    return all(
        each.opname in _PLAIN and not (each.opname == "BINARY_OP" and each.argrepr.endswith("="))
        for each in dis.get_instructions(function)
    )
