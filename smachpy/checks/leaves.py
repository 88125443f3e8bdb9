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

from smachpy.checks._core import syntax
from smachpy.checks._core.model import Place
from smachpy.checks._core.reads import keys_read

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
_DELAYS = frozenset({"sleep", "join"}) | _WAITS
_SHORT_S = 1.0  # a loop that is over by then need not look at the preempt
# Context managers that limit what is awaited inside: of asyncio, async_timeout, anyio and trio.
_LIMITERS = frozenset({"timeout", "timeout_at", "fail_after", "fail_at", "move_on_after"})


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
    body = _Function(tree, file, function)
    names = [argument.arg for argument in (*tree.args.posonlyargs, *tree.args.args)]
    own = names[0] if owner is not None and names else None
    data = names[userdata] if len(names) > userdata else None
    return Code(
        body.place(tree),
        body.returns(),
        None if data is None else keys_read(tree, data),
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

    def __init__(
        self,
        tree: ast.FunctionDef | ast.AsyncFunctionDef,
        file: str,
        function: Callable[..., Any],
    ) -> None:
        self._tree = tree
        self._file = file
        self._function = function
        self._nodes = list(syntax.own_nodes(tree))

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
        # Functions inside may bind a name of this one.
        elsewhere = (n for n in ast.walk(self._tree) if isinstance(n, ast.Nonlocal | ast.Global))
        found: dict[str, set[str] | None] = {n: None for node in elsewhere for n in node.names}
        found.update((argument, None) for argument in syntax.parameters(self._tree))
        for node in self._nodes:
            for name, value in syntax.bindings(node):
                texts = None if value is None else _texts(value, {})
                known = found.get(name, set())
                found[name] = None if texts is None or known is None else known | texts
        return found

    # -- waits and loops -----------------------------------------------------------------------

    def waits(self, own: str | None) -> Iterator[tuple[str, Place]]:
        """Yield calls that wait without a limit."""
        limited = {id(node) for node in self._limited()}
        awaited = {id(node.value) for node in self._nodes if isinstance(node, ast.Await)}
        for node in self._nodes:
            if not isinstance(node, ast.Call) or id(node) in limited:
                continue
            if isinstance(self._tree, ast.AsyncFunctionDef) and id(node) not in awaited:
                continue  # a coroutine, for somebody who may have a limit
            if _is_endless_wait(node, own):
                yield f"`{ast.unparse(node)}`", self.place(node)

    def _limited(self) -> Iterator[ast.AST]:
        """Yield the nodes that something around them gives a limit to."""
        for node in self._nodes:
            if not (isinstance(node, ast.Call) and syntax.called(node) == "wait_for"):
                continue
            if syntax.has_limit(node, 1):
                yield from ast.walk(node)
        yield from syntax.inside_calls(self._nodes, _LIMITERS)

    def loops(self, own: str | None, owner: type | None) -> Iterator[tuple[str, Place]]:
        """Yield loops that take time and never look at the preempt."""
        for node in self._nodes:
            if not isinstance(node, ast.While | ast.For):
                continue
            if _takes_time(node) and not self._may_look(list(ast.walk(node)), own, owner):
                kind = "while" if isinstance(node, ast.While) else "for"
                yield f"the `{kind}` loop", self.place(node)

    def _may_look(self, loop: list[ast.AST], own: str | None, owner: type | None) -> bool:
        """Tell whether the nodes of a loop may look at the preempt."""
        whole = list(ast.walk(self._tree))
        return (
            # A preempt cancels the task there.
            any(isinstance(n, ast.Await | ast.AsyncFor | ast.AsyncWith) for n in loop)
            or any(map(_looks, loop))
            # The state is at hand under another name, or handed to somebody.
            or any(map(_asks_for_state, whole))
            or (own is not None and _hands_on(whole, own))
            or any(self._helper_may_look(n) for n in loop if isinstance(n, ast.Call))
            or (own is not None and any(_own_method_looks(n, own, owner) for n in loop))
        )

    def _helper_may_look(self, call: ast.Call) -> bool:
        """Tell whether a function that is called by its name may look at the preempt."""
        if not isinstance(call.func, ast.Name):
            return False
        name, code = call.func.id, self._function.__code__
        if name in (*code.co_varnames, *code.co_cellvars):
            return True  # any function
        cells = dict(zip(code.co_freevars, self._function.__closure__ or (), strict=True))
        try:
            helper = cells[name].cell_contents if name in cells else None
        except ValueError:
            return True  # not bound yet
        helper = helper or self._function.__globals__.get(name)
        if helper is None or inspect.isbuiltin(helper) or inspect.isclass(helper):
            return False
        parsed = _parse(helper)
        return parsed is None or any(_asks_for_state(n) or _looks(n) for n in ast.walk(parsed[0]))


def _looks(node: ast.AST) -> bool:
    """Tell whether it names what tells of a preempt; `sleep` may be anybody's."""
    return isinstance(node, ast.Attribute) and node.attr in _LOOKS - {"sleep"}


def _asks_for_state(node: ast.AST) -> bool:
    """Tell whether it is `current_state`, with or without a module before it."""
    return "current_state" in (getattr(node, "id", None), getattr(node, "attr", None))


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


def _is_endless_wait(node: ast.Call, own: str | None) -> bool:
    name = syntax.called(node)
    if name not in _WAITS or any(k.arg in {"timeout", None} for k in node.keywords):
        return False
    if own is not None and _own_call(node, own) is not None:
        return False
    if any(isinstance(argument, ast.Starred) for argument in node.args):
        return False
    return len(node.args) <= _BEFORE_TIMEOUT.get(name, 0)


def _own_call(node: ast.AST, own: str) -> str | None:
    """Return the name of the method if it is a call `own.method(...)`."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return None
    value = node.func.value
    return node.func.attr if isinstance(value, ast.Name) and value.id == own else None


def _hands_on(nodes: list[ast.AST], own: str) -> bool:
    """Tell whether the name `own` stands anywhere but in front of a dot."""
    parts = {id(n.value) for n in nodes if isinstance(n, ast.Attribute)}
    return any(isinstance(n, ast.Name) and n.id == own and id(n) not in parts for n in nodes)


def _takes_time(loop: ast.While | ast.For) -> bool:
    inside = list(syntax.own_nodes(loop))
    if isinstance(loop, ast.While) and isinstance(loop.test, ast.Constant) and loop.test.value:
        leaves = (ast.Return, ast.Break, ast.Raise)
        if not any(isinstance(n, leaves) for n in inside):
            return True
    delays = [n for n in inside if isinstance(n, ast.Call) and _is_delay(n)]
    if isinstance(loop, ast.For) and all(map(_seconds, delays)):
        return sum(map(_seconds, delays)) * _passes(loop.iter) >= _SHORT_S
    return bool(delays)


def _is_delay(call: ast.Call) -> bool:
    """Tell a wait, also for a thread's end, from `", ".join(...)` and `os.path.join(...)`."""
    return syntax.called(call) in _DELAYS and not (syntax.called(call) == "join" and call.args)


def _seconds(delay: ast.Call) -> float:
    """Return how long a delay is [s], 0 where that is not plain to see."""
    value = delay.args[0] if len(delay.args) == 1 and syntax.called(delay) == "sleep" else None
    number = value.value if isinstance(value, ast.Constant) else None
    return float(number) if isinstance(number, int | float) else 0.0


def _passes(items: ast.expr) -> int:
    """Return how often a loop over `items` is run, 1 where that is not plain to see."""
    if isinstance(items, ast.List | ast.Tuple):
        return len(items.elts)
    if isinstance(items, ast.Call) and syntax.called(items) == "range":
        numbers = [n.value for n in items.args if isinstance(n, ast.Constant)]
        whole = [n for n in numbers if isinstance(n, int)]
        if len(whole) == len(items.args) and 0 not in whole[2:]:
            return len(range(*whole))
    return 1


def _own_method_looks(node: ast.AST, own: str, owner: type | None) -> bool:
    """Tell whether it calls a method of the state that may look at the preempt."""
    name = _own_call(node, own)
    if name is None or name in _LOOKS:
        return name is not None
    method = getattr(owner, name, None)
    parsed = _parse(method) if inspect.isfunction(method) else None
    if parsed is None:
        return True  # nothing is known of it
    tree, _ = parsed
    its_own = tree.args.args[0].arg if tree.args.args else ""
    nodes = list(ast.walk(tree))
    # Methods that call further methods of the state are not followed.
    return _hands_on(nodes, its_own) or any(
        _looks(n)
        or (isinstance(n, ast.Attribute) and n.attr == "sleep")
        or _asks_for_state(n)
        or _own_call(n, its_own) is not None
        for n in nodes
    )
