"""A look at a leaf's source: what it returns, reads, waits for and loops around.

It says only what is certain. Code that hands the state or the userdata to others, returns what it
computes, or has no source, is taken to do everything it may.
"""

from __future__ import annotations

import ast
import functools
import inspect
import textwrap
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from smachpy.checks._core.model import Place

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_LOOKS = frozenset(
    {"preempt_requested", "wait_preempt", "sleep", "service_preempt", "_preempt_requested"}
)
_WAITS = frozenset(
    {"wait", "wait_for_result", "wait_for_server", "wait_for_service", "wait_for_message"}
)
# Number of positional arguments before the timeout.
_BEFORE_TIMEOUT = {"wait_for_service": 1, "wait_for_message": 2}
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_DELAYS = frozenset({"sleep", "join", "acquire"}) | _WAITS


@dataclass(slots=True)
class Code:
    """What a function certainly does; None where that cannot be known.

    Attributes:
        place: Its first line.
        returns: The strings it returns, with the lines.
        reads: Userdata keys it reads without asking whether they are there.
        waits: Waits without a timeout: text and line.
        loops: Loops that wait and look at no preempt: text and line.
    """

    place: Place
    returns: dict[str, Place] | None = field(default_factory=dict)
    reads: frozenset[str] | None = None
    waits: tuple[tuple[str, Place], ...] = ()
    loops: tuple[tuple[str, Place], ...] = ()


def look_at(function: Callable[..., Any], *, userdata: int, owner: type | None) -> Code | None:
    """Return what `function` certainly does; None when it has no source, or is decorated.

    Args:
        function: The function, not bound.
        userdata: Position of its userdata parameter.
        owner: The state's class, when the function is a method of it.
    """
    if hasattr(function, "__wrapped__"):
        return None  # a decorator may change whatever it does
    parsed = _parse(function)
    if parsed is None:
        return None
    tree, file = parsed
    body = _Function(tree, file)
    names = [argument.arg for argument in (*tree.args.posonlyargs, *tree.args.args)]
    own = names[0] if owner is not None and names else None
    data = names[userdata] if len(names) > userdata else None
    return Code(
        body.place(tree),
        body.returns(),
        None if data is None else body.reads(data),
        tuple(body.waits(own)),
        tuple(body.loops(own, owner)),
    )


@functools.lru_cache(maxsize=2048)
def _parse(function: Any) -> tuple[ast.FunctionDef | ast.AsyncFunctionDef, str] | None:
    try:
        lines, first = inspect.getsourcelines(function)
        file = inspect.getsourcefile(function) or "?"
        module = ast.parse(textwrap.dedent("".join(lines)))
    except (OSError, TypeError, SyntaxError, IndentationError):
        return None  # built in, typed at a prompt, or part of a longer line: nothing is known
    for node in ast.walk(module):
        if isinstance(node, _FUNCTIONS) and node.name == function.__name__:
            ast.increment_lineno(node, first - 1)
            return node, file
    return None


class _Function:
    """One function's syntax tree."""

    def __init__(self, tree: ast.FunctionDef | ast.AsyncFunctionDef, file: str) -> None:
        self._tree = tree
        self._file = file
        self._nodes = list(_own_nodes(tree))

    def place(self, node: ast.AST) -> Place:
        return Place(self._file, getattr(node, "lineno", self._tree.lineno))

    # -- outcomes ------------------------------------------------------------------------------

    def returns(self) -> dict[str, Place] | None:
        """Return the outcomes it returns, or None if one of them is computed."""
        if any(isinstance(n, ast.Yield | ast.YieldFrom) for n in self._nodes):
            return None
        constants = self._constants()
        found: dict[str, Place] = {}
        for node in self._nodes:
            if not isinstance(node, ast.Return):
                continue
            texts = _texts(node.value, constants)
            if texts is None:
                return None
            found.update(dict.fromkeys(texts, self.place(node)))
        return found

    def _constants(self) -> dict[str, set[str] | None]:
        """Return the local names that only ever get known strings."""
        found: dict[str, set[str] | None] = {}
        for node in self._nodes:
            for name, value in _bindings(node):
                texts = None if value is None else _texts(value, {})
                known = found.get(name, set())
                found[name] = None if texts is None or known is None else known | texts
        return found

    # -- userdata ------------------------------------------------------------------------------

    def reads(self, name: str) -> frozenset[str] | None:
        """Return the keys read from the userdata called `name`; None if it goes elsewhere."""
        reads: set[str] = set()
        asked: set[str] = set()
        plain = 0
        for node in ast.walk(self._tree):
            if isinstance(node, ast.Name) and node.id == name:
                plain += 1
            key = _key_of(node, name)
            if key is not None:
                plain -= 1
                if isinstance(getattr(node, "ctx", None), ast.Load):
                    reads.add(key)
            elif isinstance(node, ast.Compare) and _is_asked(node, name):
                plain -= 1
                asked.add(str(getattr(node.left, "value", "")))
            elif isinstance(node, ast.AugAssign):
                changed = _key_of(node.target, name)
                reads |= set() if changed is None else {changed}
        written_first = self._written_first(name)
        return None if plain else frozenset(reads - asked - written_first)

    def _written_first(self, name: str) -> set[str]:
        """Return the keys that its first plain statements write before it reads anything."""
        written: set[str] = set()
        for statement in self._tree.body:
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                continue
            if not isinstance(statement, ast.Assign):
                break
            keys = {_key_of(target, name) for target in statement.targets}
            read = {_key_of(node, name) for node in ast.walk(statement.value)} - {None}
            if read - written:
                break
            written |= {key for key in keys if key is not None}
        return written

    # -- waits and loops -----------------------------------------------------------------------

    def waits(self, own: str | None) -> Iterator[tuple[str, Place]]:
        """Yield calls that wait without a limit."""
        for node in self._nodes:
            if isinstance(node, ast.Call) and _is_endless_wait(node, own):
                yield f"`{ast.unparse(node)}`", self.place(node)

    def loops(self, own: str | None, owner: type | None) -> Iterator[tuple[str, Place]]:
        """Yield loops that take time and never look at the preempt."""
        for node in self._nodes:
            if not isinstance(node, ast.While | ast.For):
                continue
            inside = list(_own_nodes(node))
            if _takes_time(node, inside) and not self._may_look(inside, own, owner):
                kind = "while" if isinstance(node, ast.While) else "for"
                yield f"the `{kind}` loop", self.place(node)

    def _may_look(self, nodes: list[ast.AST], own: str | None, owner: type | None) -> bool:
        if any(isinstance(n, ast.Await | ast.AsyncFor | ast.AsyncWith) for n in nodes):
            return True  # a preempt cancels the task there
        if any(isinstance(n, ast.Attribute) and n.attr in _LOOKS - {"sleep"} for n in nodes):
            return True
        if own is None:  # a function: the state is not at hand, unless something global is asked
            return False
        for node in nodes:
            if isinstance(node, ast.Name) and node.id == own and not _is_part(node, nodes):
                return True  # the state is handed to somebody
            if _is_own_call(node, own) and _method_looks(owner, node.func.attr):  # type: ignore[attr-defined]
                return True
        return False


def _own_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below `tree`, those of functions inside it left out."""
    for child in ast.iter_child_nodes(tree):
        yield child
        if not isinstance(
            child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef
        ):
            yield from _own_nodes(child)


def _texts(node: ast.expr | None, constants: dict[str, set[str] | None]) -> set[str] | None:
    """Return the strings that an expression can be, None if that is not known."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return {node.value}
    if isinstance(node, ast.IfExp):
        one, other = _texts(node.body, constants), _texts(node.orelse, constants)
        return None if one is None or other is None else one | other
    if isinstance(node, ast.Name):
        return constants.get(node.id)
    return None


def _bindings(node: ast.AST) -> Iterator[tuple[str, ast.expr | None]]:
    """Yield the names that a node binds, with the value if it is plain to see."""
    if isinstance(node, ast.Assign):
        for target in node.targets:
            if isinstance(target, ast.Name):
                yield target.id, node.value
            else:
                yield from ((n.id, None) for n in ast.walk(target) if isinstance(n, ast.Name))
    elif isinstance(node, ast.AnnAssign | ast.NamedExpr) and isinstance(node.target, ast.Name):
        yield node.target.id, node.value
    elif isinstance(node, ast.AugAssign | ast.For | ast.comprehension):
        yield from ((n.id, None) for n in ast.walk(node.target) if isinstance(n, ast.Name))
    elif isinstance(node, ast.withitem) and node.optional_vars is not None:
        yield from ((n.id, None) for n in ast.walk(node.optional_vars) if isinstance(n, ast.Name))
    elif isinstance(node, ast.Global | ast.Nonlocal):
        yield from ((name, None) for name in node.names)


def _key_of(node: ast.AST, name: str) -> str | None:
    """Return the key if `node` is `name.key` or `name["key"]`."""
    value = getattr(node, "value", None)
    if not (isinstance(value, ast.Name) and value.id == name):
        return None
    if isinstance(node, ast.Attribute) and node.attr not in {"keys", "update"}:
        return node.attr
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
        return str(node.slice.value)
    return None


def _is_asked(node: ast.Compare, name: str) -> bool:
    """Tell whether it is `"key" in name`."""
    right = node.comparators[0]
    return (
        isinstance(node.left, ast.Constant)
        and isinstance(node.ops[0], ast.In | ast.NotIn)
        and isinstance(right, ast.Name)
        and right.id == name
    )


def _called(node: ast.Call) -> str:
    return str(getattr(node.func, "attr", None) or getattr(node.func, "id", ""))


def _is_endless_wait(node: ast.Call, own: str | None) -> bool:
    name = _called(node)
    if name not in _WAITS or any(k.arg in {"timeout", None} for k in node.keywords):
        return False
    if own is not None and _is_own_call(node, own):
        return False
    if any(isinstance(argument, ast.Starred) for argument in node.args):
        return False
    return len(node.args) <= _BEFORE_TIMEOUT.get(name, 0)


def _is_own_call(node: ast.AST, own: str) -> bool:
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id == own
    )


def _is_part(name: ast.Name, nodes: list[ast.AST]) -> bool:
    """Tell whether a name only stands in front of a dot."""
    return any(isinstance(n, ast.Attribute) and n.value is name for n in nodes)


def _takes_time(loop: ast.While | ast.For, inside: list[ast.AST]) -> bool:
    if isinstance(loop, ast.While) and isinstance(loop.test, ast.Constant) and loop.test.value:
        leaves = (ast.Return, ast.Break, ast.Raise)
        if not any(isinstance(n, leaves) for n in inside):
            return True
    return any(isinstance(n, ast.Call) and _called(n) in _DELAYS and _is_wait(n) for n in inside)


def _is_wait(node: ast.Call) -> bool:
    """Tell a wait from `", ".join(...)`."""
    text = isinstance(node.func, ast.Attribute) and isinstance(node.func.value, ast.Constant)
    return not text and not (_called(node) == "join" and len(node.args) == 1)


def _method_looks(owner: type | None, name: str) -> bool:
    """Tell whether a method of the state may look at the preempt; unknown methods may."""
    if name in _LOOKS:
        return True
    method = getattr(owner, name, None)
    parsed = _parse(method) if inspect.isfunction(method) else None
    if parsed is None:
        return True
    tree, _ = parsed
    own = tree.args.args[0].arg if tree.args.args else ""
    nodes = list(ast.walk(tree))
    if any(isinstance(n, ast.Attribute) and n.attr in _LOOKS for n in nodes):
        return True
    # Methods that call further methods of the state are not followed.
    return any(_is_own_call(n, own) for n in nodes) or any(
        isinstance(n, ast.Name) and n.id == own and not _is_part(n, nodes) for n in nodes
    )
