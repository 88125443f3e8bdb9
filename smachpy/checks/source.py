"""A look at a leaf's source: what it returns, reads, waits for and loops around.

It says only what is certain. Code that hands the state or the userdata to others, returns what it
computes, or has no source, is taken to do everything it may.
"""

from __future__ import annotations

import ast
import functools
import inspect
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from smachpy.checks.model import Place, Reads

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator

    Function: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef
    Texts: TypeAlias = set[str] | None  # all that an expression can be; None: not known
    Found: TypeAlias = tuple[str, Place]

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_INNER = (*_FUNCTIONS, ast.Lambda, ast.ClassDef)
_LOOPS = (ast.While, ast.For, ast.AsyncFor)
_JUMPS = (ast.Return, ast.Raise, ast.Break, ast.Continue)
_WITH = (ast.With, ast.AsyncWith)
# What tells of a preempt.
_LOOKS = frozenset({"preempt_requested", "wait_preempt", "service_preempt", "_preempt_requested"})
_WAITS = frozenset(
    {"wait", "wait_for_result", "wait_for_server", "wait_for_service", "wait_for_message"}
)
# Number of positional arguments before the timeout.
_BEFORE_TIMEOUT = {"wait_for_service": 1, "wait_for_message": 2}
_DELAYS = frozenset({"sleep", "join"}) | _WAITS
_SHORT_S = 1.0  # a loop that is over by then need not look at the preempt
# Context managers that limit what is awaited inside: of asyncio, async_timeout, anyio and trio.
_LIMITERS = frozenset({"timeout", "timeout_at", "fail_after", "fail_at", "move_on_after"})


@dataclass(frozen=True, slots=True)
class Code:
    """What a function certainly does; None where that cannot be known.

    Attributes:
        place: Its first line.
        returns: The strings it returns, with the lines.
        reads: Userdata keys that it uses.
        reaches: It uses the userdata of some machine past its own keys.
        waits: Waits without a timeout: text and line.
        loops: Loops that wait and look at no preempt: text and line.
    """

    place: Place
    returns: dict[str, Place] | None
    reads: Reads | None
    reaches: bool
    waits: tuple[Found, ...]
    loops: tuple[Found, ...]


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
    names = [argument.arg for argument in (*tree.args.posonlyargs, *tree.args.args)]
    own = names[0] if owner is not None and names else None
    body = _Body(tree, file, function, own, owner)
    return Code(
        body.place(tree),
        body.returns(),
        keys_read(tree, names[userdata]) if len(names) > userdata else None,
        any(isinstance(n, ast.Attribute) and n.attr == "userdata" for n in ast.walk(tree)),
        tuple(body.waits()),
        tuple(body.loops()),
    )


def texts_in_constructors(kind: type) -> frozenset[str]:
    """Return the texts in the `__init__` methods of a state's class and of its bases."""
    found: set[str] = set()
    for cls in kind.__mro__:
        constructor = vars(cls).get("__init__")
        inside = cls.__module__.partition(".")[0] == "smachpy"
        parsed = _parse(constructor) if inspect.isfunction(constructor) and not inside else None
        for node in ast.walk(parsed[0]) if parsed is not None else ():
            found |= _texts(node, {}) or set()
    return frozenset(found)


@functools.lru_cache(maxsize=2048)
def _parse(function: Any) -> tuple[Function, str] | None:
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


class _Body:
    """The body of one function.

    Args:
        tree: Its syntax tree.
        file: Where it stands.
        function: The function.
        own: Name of its first parameter, if it is a method.
        owner: The class then.
    """

    def __init__(
        self,
        tree: Function,
        file: str,
        function: Callable[..., Any],
        own: str | None,
        owner: type | None,
    ) -> None:
        self._tree = tree
        self._file = file
        self._function = function
        self._own = own
        self._owner = owner
        self._nodes = list(_own_nodes(tree))
        self._all = list(ast.walk(tree))

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
            if isinstance(node, ast.Return):
                texts = _texts(node.value, constants)
                if texts is None:
                    return None
                found.update(dict.fromkeys(texts, self.place(node)))
        return found

    def _constants(self) -> dict[str, Texts]:
        """Return the local names, with the strings that they may get."""
        # Functions inside may bind a name of this one.
        found: dict[str, Texts] = {
            name: None
            for node in self._all
            if isinstance(node, ast.Nonlocal | ast.Global)
            for name in node.names
        }
        found.update((n.arg, None) for n in ast.walk(self._tree.args) if isinstance(n, ast.arg))
        for node in self._nodes:
            for name, value in _bindings(node):
                texts = None if value is None else _texts(value, {})
                known = found.get(name, set())
                found[name] = None if texts is None or known is None else known | texts
        return found

    # -- waits and loops -----------------------------------------------------------------------

    def waits(self) -> Iterator[Found]:
        """Yield calls that wait without a limit."""
        limited = {id(node) for node in self._limited()}
        awaited = {id(node.value) for node in self._nodes if isinstance(node, ast.Await)}
        for node in self._nodes:
            if not isinstance(node, ast.Call) or id(node) in limited:
                continue
            if isinstance(self._tree, ast.AsyncFunctionDef) and id(node) not in awaited:
                continue  # a coroutine, for somebody who may have a limit
            name = _called(node)
            if (
                name in _WAITS
                and not any(k.arg in {"timeout", None} for k in node.keywords)
                and self._own_call(node) is None
                and not any(isinstance(argument, ast.Starred) for argument in node.args)
                and len(node.args) <= _BEFORE_TIMEOUT.get(name, 0)
            ):
                yield f"`{ast.unparse(node)}`", self.place(node)

    def _limited(self) -> Iterator[ast.AST]:
        """Yield the nodes that something around them gives a limit to."""
        for node in self._nodes:
            if isinstance(node, ast.Call) and _called(node) == "wait_for" and _has_limit(node, 1):
                yield from ast.walk(node)
            if any(_has_limit(call, 0) for call in _entered(node, _LIMITERS)):
                yield from ast.walk(node)

    def loops(self) -> Iterator[Found]:
        """Yield loops that take time and never look at the preempt."""
        for node in self._nodes:
            if (
                isinstance(node, ast.While | ast.For)
                and _takes_time(node)
                and not self._may_look(list(ast.walk(node)))
            ):
                kind = "while" if isinstance(node, ast.While) else "for"
                yield f"the `{kind}` loop", self.place(node)

    def _may_look(self, loop: list[ast.AST]) -> bool:
        """Tell whether the nodes of a loop may look at the preempt."""
        return (
            # A preempt cancels the task there.
            any(isinstance(n, ast.Await | ast.AsyncFor | ast.AsyncWith) for n in loop)
            or any(map(_looks, loop))
            # The state has another name too, or somebody else has it.
            or any(map(_asks_for_state, self._all))
            or _hands_on(self._all, self._own)
            or any(
                self._helper_may_look(n) or self._method_may_look(n)
                for n in loop
                if isinstance(n, ast.Call)
            )
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

    def _method_may_look(self, call: ast.Call) -> bool:
        """Tell whether it calls a method of the state that may look at the preempt."""
        name = self._own_call(call)
        if name is None or name in _LOOKS or name == "sleep":
            return name is not None
        method = getattr(self._owner, name, None)
        parsed = _parse(method) if inspect.isfunction(method) else None
        if parsed is None:
            return True  # nothing is known of it
        tree = parsed[0]
        own = tree.args.args[0].arg if tree.args.args else ""
        nodes = list(ast.walk(tree))
        # Methods that call further methods of the state are not followed.
        return _hands_on(nodes, own) or any(
            _looks(n)
            or (isinstance(n, ast.Attribute) and n.attr == "sleep")
            or _asks_for_state(n)
            or _method_of(n, own) is not None
            for n in nodes
        )

    def _own_call(self, node: ast.AST) -> str | None:
        return None if self._own is None else _method_of(node, self._own)


def _looks(node: ast.AST) -> bool:
    """Tell whether it names what tells of a preempt; `sleep` may be anybody's."""
    return isinstance(node, ast.Attribute) and node.attr in _LOOKS


def _asks_for_state(node: ast.AST) -> bool:
    """Tell whether it is `current_state`, with or without a module before it."""
    return "current_state" in (getattr(node, "id", None), getattr(node, "attr", None))


def _method_of(node: ast.AST, own: str) -> str | None:
    """Return the name of the method if it is a call `own.method(...)`."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return None
    value = node.func.value
    return node.func.attr if isinstance(value, ast.Name) and value.id == own else None


def _hands_on(nodes: list[ast.AST], own: str | None) -> bool:
    """Tell whether the name `own` stands anywhere but in front of a dot."""
    parts = {id(n.value) for n in nodes if isinstance(n, ast.Attribute)}
    return any(isinstance(n, ast.Name) and n.id == own and id(n) not in parts for n in nodes)


def _takes_time(loop: ast.While | ast.For) -> bool:
    inside = list(_own_nodes(loop))
    endless = (
        isinstance(loop, ast.While) and isinstance(loop.test, ast.Constant) and loop.test.value
    )
    if endless and not any(isinstance(n, ast.Return | ast.Break | ast.Raise) for n in inside):
        return True
    # A wait, also for a thread's end; not `", ".join(...)` and `os.path.join(...)`.
    calls = [n for n in inside if isinstance(n, ast.Call) and _called(n) in _DELAYS]
    delays = [n for n in calls if not (_called(n) == "join" and n.args)]
    if isinstance(loop, ast.For) and all(map(_seconds, delays)):
        return sum(map(_seconds, delays)) * _passes(loop.iter) >= _SHORT_S
    return bool(delays)


def _seconds(delay: ast.Call) -> float:
    """Return how long a delay is [s], 0 where that is not plain to see."""
    value = delay.args[0] if len(delay.args) == 1 and _called(delay) == "sleep" else None
    number = value.value if isinstance(value, ast.Constant) else None
    return float(number) if isinstance(number, int | float) else 0.0


def _passes(items: ast.expr) -> int:
    """Return how often a loop over `items` is run, 1 where that is not plain to see."""
    if isinstance(items, ast.List | ast.Tuple):
        return len(items.elts)
    if isinstance(items, ast.Call) and _called(items) == "range":
        numbers = [n.value for n in items.args if isinstance(n, ast.Constant)]
        whole = [n for n in numbers if isinstance(n, int)]
        if len(whole) == len(items.args) and 0 not in whole[2:]:
            return len(range(*whole))
    return 1


# -- userdata keys ---------------------------------------------------------------------------------


def keys_read(tree: Function, name: str) -> Reads | None:
    """Return the keys read from the userdata called `name`; None if it goes elsewhere.

    Left out are keys that may have a value by then, or may do without one: those asked for with
    `in`, written further up or in the same loop, read where an exception is caught, or read by a
    function inside.
    """
    nodes = list(ast.walk(tree))
    uses = {node: key for node in nodes if (key := _key(node, name)) is not None}
    asked = [key for node in nodes if (key := _asked(node, name)) is not None]
    named = sum(isinstance(n, ast.Name) and n.id == name for n in nodes)
    if named > len(uses) + len(asked):
        return None
    reader = _Reader(uses, asked)
    own = set(_own_nodes(tree))
    reader.write(node for node in nodes if node not in own)  # by a function inside
    reader.visit_all(tree.body, always=True)
    writes = {key for node, key in uses.items() if isinstance(_context(node), ast.Store)}
    return Reads(
        frozenset(reader.always), frozenset(reader.sometimes - reader.always), frozenset(writes)
    )


class _Reader:
    """Goes through a function in the order in which it runs.

    Args:
        uses: The nodes that are a key of the userdata.
        asked: Keys that it asks for before it reads them.
    """

    def __init__(self, uses: dict[ast.AST, str], asked: Iterable[str]) -> None:
        self._uses = uses
        self._valued = set(asked)  # keys that may have a value by now
        self.always: set[str] = set()
        self.sometimes: set[str] = set()

    def write(self, nodes: Iterable[ast.AST]) -> None:
        """Note what is written in `nodes`."""
        for node in nodes:
            if node in self._uses and isinstance(_context(node), ast.Store):
                self._valued.add(self._uses[node])

    def visit_all(self, nodes: Iterable[ast.AST], *, always: bool) -> bool:
        """Visit nodes one after the other; return whether each call gets past them."""
        for node in nodes:
            self.visit(node, always=always)
            always = always and not _may_leave(node)
        return always

    def visit(self, node: ast.AST, *, always: bool) -> None:
        """Note what is read in a node.

        Args:
            node: The node.
            always: Whether every call gets there.
        """
        if isinstance(node, _INNER):
            return
        if isinstance(node, ast.Try | ast.TryStar):
            if node.handlers:
                self.write(n for statement in node.body for n in ast.walk(statement))
            else:
                self.visit_all(node.body, always=always)
            for statements in (*(handler.body for handler in node.handlers), node.orelse):
                self.visit_all(statements, always=False)
            self.visit_all(node.finalbody, always=always and not node.handlers)
        elif any(_entered(node, {"suppress"})):  # so exceptions end in it
            self.write(ast.walk(node))
        else:
            if isinstance(node, _LOOPS):
                self.write(ast.walk(node))  # by an earlier pass
            if isinstance(node, ast.AugAssign):
                self._read(node.target, always=always)
            surely, branches = _parts(node)
            always = self.visit_all(surely, always=always)
            for branch in branches:
                self.visit_all(branch, always=False)
            if isinstance(_context(node), ast.Load):
                self._read(node, always=always)
            self.write([node])

    def _read(self, node: ast.AST, *, always: bool) -> None:
        key = self._uses.get(node)
        if key is not None and key not in self._valued:
            (self.always if always else self.sometimes).add(key)


def _context(node: ast.AST) -> object:
    """Return whether a name, attribute or item is read, written or deleted there."""
    return getattr(node, "ctx", None)


# The fields of a node that run whenever it does, in that order; the others may run.
_SURELY: dict[type[ast.AST], tuple[str, ...]] = {
    **dict.fromkeys((ast.If, ast.IfExp, ast.While, ast.Assert), ("test",)),
    **dict.fromkeys((ast.For, ast.AsyncFor), ("iter", "target")),
    **dict.fromkeys((ast.AnnAssign, ast.NamedExpr, ast.AugAssign), ("value", "target")),
    ast.Assign: ("value", "targets"),
    ast.Match: ("subject",),
}


def _parts(node: ast.AST) -> tuple[list[ast.AST], list[list[ast.AST]]]:
    """Return what of a node runs whenever it does, in order, and the branches that may."""
    if isinstance(node, ast.BoolOp):
        surely: list[Any] = node.values[:1]
    elif isinstance(node, ast.ListComp | ast.SetComp | ast.GeneratorExp | ast.DictComp):
        surely = [node.generators[0].iter]
    elif type(node) in _SURELY:
        found = (getattr(node, name) for name in _SURELY[type(node)])
        surely = [part for f in found for part in (f if isinstance(f, list) else [f]) if part]
    else:
        return list(ast.iter_child_nodes(node)), []
    branches: dict[object, list[ast.AST]] = {}
    for name, value in ast.iter_fields(node):
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, ast.AST) and part not in surely:
                # The statements of a block follow each other; other parts stand for themselves.
                branch = name if isinstance(part, ast.stmt) else part
                branches.setdefault(branch, []).append(part)
    return surely, [*branches.values()]


def _may_leave(statement: ast.AST) -> bool:
    """Tell whether what comes after a statement may not run."""
    jumps = (ast.Return, ast.Raise) if isinstance(statement, _LOOPS) else _JUMPS
    return isinstance(statement, _JUMPS) or any(
        isinstance(node, jumps) for node in _own_nodes(statement)
    )


def _key(node: ast.AST, name: str) -> str | None:
    """Return the key if it is `name.key` or `name["key"]`."""
    value = getattr(node, "value", None)
    if not (isinstance(value, ast.Name) and value.id == name):
        return None
    if isinstance(node, ast.Attribute) and node.attr not in {"keys", "update"}:
        return node.attr
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
        return str(node.slice.value)
    return None


def _asked(node: ast.AST, name: str) -> str | None:
    """Return the key if it is `"key" in name`."""
    if not (isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In | ast.NotIn)):
        return None
    left, right = node.left, node.comparators[0]
    is_it = isinstance(right, ast.Name) and right.id == name
    return str(left.value) if is_it and isinstance(left, ast.Constant) else None


# -- syntax trees ----------------------------------------------------------------------------------


def _own_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below `tree`, those of functions inside it left out."""
    for child in ast.iter_child_nodes(tree):
        yield child
        if not isinstance(child, _INNER):
            yield from _own_nodes(child)


def _called(node: ast.Call) -> str:
    """Return the last word of what is called."""
    return str(getattr(node.func, "attr", None) or getattr(node.func, "id", ""))


def _has_limit(call: ast.Call, position: int) -> bool:
    """Tell whether a call has an argument there or by name, and it is not None."""
    given = [*call.args[position:], *(keyword.value for keyword in call.keywords)]
    return any(not (isinstance(value, ast.Constant) and value.value is None) for value in given)


def _entered(node: ast.AST, names: Collection[str]) -> Iterator[ast.Call]:
    """Yield the calls of one of `names` that a `with` enters."""
    for item in node.items if isinstance(node, _WITH) else ():
        if isinstance(item.context_expr, ast.Call) and _called(item.context_expr) in names:
            yield item.context_expr


def _texts(node: ast.AST | None, constants: dict[str, Texts]) -> Texts:
    """Return the strings that an expression can be, None if that is not known."""
    match node:
        case ast.Constant(value=str(text)):
            return {text}
        case ast.IfExp():
            one, other = _texts(node.body, constants), _texts(node.orelse, constants)
            return None if one is None or other is None else one | other
        case ast.Name():
            return constants.get(node.id)
    return None


def _bindings(node: ast.AST) -> Iterator[tuple[str, ast.expr | None]]:
    """Yield the names that a node binds, with the value if it is plain to see."""
    plain = isinstance(node, ast.Assign | ast.AnnAssign | ast.NamedExpr)
    value = getattr(node, "value", None) if plain else None
    others = (getattr(node, "target", None), getattr(node, "optional_vars", None))
    for target in (*getattr(node, "targets", ()), *others):
        if isinstance(target, ast.Name):
            yield target.id, value
        elif target is not None:
            yield from ((n.id, None) for n in ast.walk(target) if isinstance(n, ast.Name))
    # Imports, functions, classes, handlers of exceptions and patterns.
    name = next(filter(None, (getattr(node, a, None) for a in ("asname", "name", "rest"))), None)
    if isinstance(name, str):
        yield name.partition(".")[0], None
