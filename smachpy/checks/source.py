"""Analyses a leaf's source: what it returns, reads and waits for, and its loops.

Only what is certain counts. Code that passes the state or the userdata on, returns a computed value
or has no source is assumed to do everything that it may.
"""

from __future__ import annotations

import ast
import functools
import inspect
import os
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from smachpy.checks.model import Place, Reads

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

    Function: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef
    Texts: TypeAlias = set[str] | None  # all possible values of an expression; None: unknown
    Found: TypeAlias = tuple[str, Place]

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_INNER = (*_FUNCTIONS, ast.Lambda, ast.ClassDef)
_LOOPS = (ast.While, ast.For, ast.AsyncFor)
_JUMPS = (ast.Return, ast.Raise, ast.Break, ast.Continue)
_WITH = (ast.With, ast.AsyncWith)
# Methods that check for a preempt.
_LOOKS = frozenset({"preempt_requested", "wait_preempt", "service_preempt", "_preempt_requested"})
_WAITS = frozenset(
    {"wait", "wait_for_result", "wait_for_server", "wait_for_service", "wait_for_message"}
)
# Number of positional arguments before the timeout.
_BEFORE_TIMEOUT = {"wait_for_service": 1, "wait_for_message": 2}
_DELAYS = frozenset({"sleep", "join"}) | _WAITS
# Functions of Python that end at once; `print` may wait for a reader, but no robot does.
_QUICK = frozenset({"print", "len", "str", "int", "float", "bool", "repr", "min", "max", "abs"})
# Methods with which lists, dicts, sets and deques change.
_CHANGERS = frozenset(
    {
        "append",
        "appendleft",
        "extend",
        "extendleft",
        "insert",
        "remove",
        "pop",
        "popleft",
        "popitem",
    }
    | {"clear", "sort", "reverse", "update", "setdefault", "add", "discard"}
)
# What differs each time, and is in no recording. `random` begins as recorded, and the clock, which
# then runs on without the time that code takes: `time.monotonic` is left out, as it has no date.
_OUTSIDE = (
    *("open", "input", "io.open", "pathlib.Path.cwd", "pathlib.Path.home", "glob", "tempfile"),
    *("shutil", "shelve", "sqlite3", "fileinput"),
    *("os.environ", "os.environb", "os.getenv", "os.getenvb", "os.urandom", "os.getrandom"),
    *("os.listdir", "os.scandir", "os.walk", "os.stat", "os.lstat", "os.access", "os.open"),
    *("os.read", "os.getcwd", "os.getpid", "os.getppid", "os.getlogin", "os.getloadavg"),
    *("os.path.exists", "os.path.isfile", "os.path.isdir", "os.path.getmtime", "os.path.getsize"),
    *("os.system", "os.popen", "subprocess", "asyncio.create_subprocess_exec"),
    *("asyncio.create_subprocess_shell", "multiprocessing", "platform", "getpass"),
    *("sys.stdin", "select", "socket", "ssl", "asyncio.open_connection", "urllib.request"),
    *("http.client", "requests", "httpx", "aiohttp", "urllib3", "ftplib", "smtplib", "serial"),
    *("psutil", "uuid.uuid1", "uuid.uuid4", "uuid.uuid6", "uuid.uuid7", "uuid.getnode", "secrets"),
    *("random.Random", "random.SystemRandom", "numpy.random"),
    *("time.time", "time.time_ns", "time.process_time", "time.process_time_ns"),
    *("time.thread_time", "time.thread_time_ns"),
    *("datetime.datetime.now", "datetime.datetime.utcnow", "datetime.datetime.today"),
    "datetime.date.today",
)
# These read the clock only if they get no time.
_OF_NOW = frozenset({"time.localtime", "time.gmtime", "time.ctime", "time.asctime"})
# Methods of `pathlib.Path` that look at the disk; the first ones have no other meaning.
_READS_FILE = frozenset({"read_text", "read_bytes"})
_PATH = "pathlib.Path"
_OF_PATH = _READS_FILE | {"open", "exists", "is_file", "is_dir", "stat", "iterdir", "glob", "rglob"}
# Where things are that call themselves after another module.
_HOMES = {
    **dict.fromkeys(("posix", "nt"), "os"),
    **dict.fromkeys(("posixpath", "ntpath", "genericpath"), "os.path"),
    "_socket": "socket",
    "pathlib._local": "pathlib",
}
_SHORT_S = 1.0  # [s] a shorter loop need not check for a preempt
# Context managers that limit awaits within them: of asyncio, async_timeout, anyio and trio.
_LIMITERS = frozenset({"timeout", "timeout_at", "fail_after", "fail_at", "move_on_after"})


@dataclass(frozen=True, slots=True)
class Code:
    """What a function certainly does; None where that is unknown.

    Attributes:
        place: Its first line.
        returns: The strings it returns, with their lines.
        unsure: Those of them that it may replace by others before it returns.
        reads: Userdata keys that it uses.
        changes: Keys whose values it changes in place, with the line.
        is_instant: Whether it has no loop, no `await` and no call of anything but quick builtins.
        reaches: Whether it uses the userdata of some machine beyond its own keys.
        waits: Waits without a timeout: text and line.
        loops: Loops that wait and never check for a preempt: text and line.
        outside: What it reads that no recording has: text and line.
    """

    place: Place
    returns: dict[str, Place] | None
    unsure: frozenset[str]
    reads: Reads | None
    changes: tuple[Found, ...]
    is_instant: bool
    reaches: bool
    waits: tuple[Found, ...]
    loops: tuple[Found, ...]
    outside: tuple[Found, ...]


def look_at(function: Callable[..., Any], *, userdata: int, owner: type | None) -> Code | None:
    """Return what `function` certainly does; None if it has no source, or is decorated.

    Args:
        function: The function, not bound.
        userdata: Position of its userdata parameter.
        owner: The state's class, if the function is a method of it.
    """
    if hasattr(function, "__wrapped__"):
        return None  # a decorator may change everything
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
        body.unsure(),
        keys_read(tree, names[userdata]) if len(names) > userdata else None,
        tuple(
            (key, Place(file, line)) for key, line in changed_values(tree, *names[userdata:][:1])
        ),
        body.is_instant(),
        any(isinstance(n, ast.Attribute) and n.attr == "userdata" for n in ast.walk(tree)),
        tuple(body.waits()),
        tuple(body.loops()),
        tuple(body.outside()),
    )


def texts_in_constructors(kind: type) -> frozenset[str]:
    """Return the string literals in the `__init__` methods of a state's class and its bases."""
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
        return None  # built in, typed at a prompt, or a part of a longer line: unknown
    for node in ast.walk(module):
        if isinstance(node, _FUNCTIONS) and node.name == function.__name__:
            ast.increment_lineno(node, first - 1)
            return node, file
    return None


def _outside_name(
    node: ast.Name | ast.Attribute, names: Mapping[str, str], call: ast.Call | None
) -> str:
    """Return the full name of something outside; "" if it is none.

    Args:
        node: The name in the code.
        names: What the names of modules, and of what is in them, stand for.
        call: The call of it, if it is called.
    """
    words: list[str] = []
    inner: ast.AST = node
    while isinstance(inner, ast.Attribute):
        words.insert(0, inner.attr)
        inner = inner.value
    if isinstance(inner, ast.Call) and isinstance(inner.func, ast.Name | ast.Attribute):
        made = _dotted(inner.func, names)
        return f"{made}.{words[-1]}" if made == _PATH and _OF_PATH.intersection(words[-1:]) else ""
    name = _dotted(node, names)
    if words and words[-1] in _READS_FILE:
        return name or words[-1]
    if name in _OF_NOW and call is not None and not call.args and not call.keywords:
        return name
    return name if any(name == one or name.startswith(f"{one}.") for one in _OUTSIDE) else ""


def _dotted(node: ast.expr, names: Mapping[str, str]) -> str:
    """Return the full name of `a.b.c`; "" if `a` is neither a module nor in one."""
    words: list[str] = []
    while isinstance(node, ast.Attribute):
        words.insert(0, node.attr)
        node = node.value
    first = names.get(node.id, "") if isinstance(node, ast.Name) else ""
    return ".".join([first, *words]) if first else ""


def _full_name(thing: object) -> str:
    """Return the full name of a module, or of a function or class in one; "" for others."""
    if inspect.ismodule(thing):
        return _HOMES.get(thing.__name__, thing.__name__)
    if thing is os.environ:
        return "os.environ"
    if not (inspect.isroutine(thing) or inspect.isclass(thing)):
        return ""
    home = str(thing.__module__)
    return f"{_HOMES.get(home, home)}.{thing.__qualname__}"


class _Body:
    """The body of one function.

    Args:
        tree: Its syntax tree.
        file: Its file.
        function: The function.
        own: Name of its first parameter, if it is a method.
        owner: Its class, if it is a method.
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

    # -- what no recording has -----------------------------------------------------------------

    def outside(self) -> Iterator[Found]:
        """Yield reads of files, sockets, the environment and so on, except inside `once`."""
        kept = {
            id(inner)
            for node in self._all
            if isinstance(node, ast.Call) and _called(node) == "once"
            for inner in ast.walk(node)
        }
        kept |= {id(node.value) for node in self._all if isinstance(node, ast.Attribute)}
        calls = {id(n.func): n for n in self._all if isinstance(n, ast.Call)}
        names = self._names()
        for node in self._all:
            if isinstance(node, ast.Name | ast.Attribute) and id(node) not in kept:
                what = _outside_name(node, names, calls.get(id(node)))
                if what:
                    yield what, self.place(node)

    def _names(self) -> dict[str, str]:
        """Return the names of modules, and of what is in them, with what they stand for."""
        found = {"open": "open", "input": "input"}
        scope = getattr(self._function, "__globals__", {})
        used = {node.id for node in self._all if isinstance(node, ast.Name)}
        found.update((name, _full_name(scope[name])) for name in used & scope.keys())
        bound = {a.arg for a in ast.walk(self._tree.args) if isinstance(a, ast.arg)}
        bound |= {name for node in self._nodes for name, _ in _bindings(node)}
        for name in bound:
            found.pop(name, None)
        for node in self._all:
            if isinstance(node, ast.Import):
                for each in node.names:
                    top = each.name.partition(".")[0]
                    found[each.asname or top] = each.name if each.asname else top
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.update((n.asname or n.name, f"{node.module}.{n.name}") for n in node.names)
        return found

    # -- outcomes ------------------------------------------------------------------------------

    def returns(self) -> dict[str, Place] | None:
        """Return the outcomes it returns; None if one of them is computed."""
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
        """Return the local names, with the strings that they may be bound to."""
        # An inner function may rebind these: their values are unknown.
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

    def unsure(self) -> frozenset[str]:
        """Return strings that a variable has, but maybe no longer when it is returned.

        It may get another value after this one, or code may depend on the value that it has.
        """
        returned = {id(n) for r in self._nodes if isinstance(r, ast.Return) for n in ast.walk(r)}
        tested = {
            n.id
            for node in self._nodes
            if isinstance(node, _TESTS) and id(node) not in returned
            for n in ast.walk(node)
            if isinstance(n, ast.Name)
        }
        found: set[str] = set()
        bound: list[tuple[str, Texts, tuple[tuple[int, int], ...]]] = [
            (name, None if value is None else _texts(value, {}), way)
            for node, way in _with_ways(self._tree.body)
            for name, value in _bindings(node)
        ]
        for number, (name, texts, way) in enumerate(bound):
            later = (other for again, _, other in bound[number + 1 :] if again == name)
            if name in tested or any(not _excludes(way, other) for other in later):
                found |= texts or set()
        return frozenset(found)

    # -- waits and loops -----------------------------------------------------------------------

    def is_instant(self) -> bool:
        """Return whether it certainly takes no time."""
        code = self._function.__code__
        known = self._function.__globals__.keys() | {*code.co_varnames, *code.co_cellvars}
        return not any(
            isinstance(node, (*_LOOPS, *_WITH, ast.Await))
            or (
                isinstance(node, ast.Call)
                and (not isinstance(node.func, ast.Name) or node.func.id not in _QUICK - known)
            )
            for node in self._nodes
        )

    def waits(self) -> Iterator[Found]:
        """Yield calls that wait without a timeout."""
        limited = {id(node) for node in self._limited()}
        awaited = {id(node.value) for node in self._nodes if isinstance(node, ast.Await)}
        for node in self._nodes:
            if not isinstance(node, ast.Call) or id(node) in limited:
                continue
            if isinstance(self._tree, ast.AsyncFunctionDef) and id(node) not in awaited:
                continue  # a coroutine that is awaited elsewhere, perhaps with a timeout
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
        """Yield the nodes whose waiting time is limited by code around them."""
        for node in self._nodes:
            if isinstance(node, ast.Call) and _called(node) == "wait_for" and _has_limit(node, 1):
                yield from ast.walk(node)
            if any(_has_limit(call, 0) for call in _entered(node, _LIMITERS)):
                yield from ast.walk(node)

    def loops(self) -> Iterator[Found]:
        """Yield loops that take time and never check for a preempt."""
        for node in self._nodes:
            if (
                isinstance(node, ast.While | ast.For)
                and _takes_time(node)
                and not self._may_look(list(ast.walk(node)))
            ):
                kind = "while" if isinstance(node, ast.While) else "for"
                yield f"the `{kind}` loop", self.place(node)

    def _may_look(self, loop: list[ast.AST]) -> bool:
        """Return whether the nodes of a loop may check for a preempt."""
        return (
            # At an await, a preempt cancels the task.
            any(isinstance(n, ast.Await | ast.AsyncFor | ast.AsyncWith) for n in loop)
            or any(map(_looks, loop))
            # The state may be known under another name, or to other code.
            or any(map(_asks_for_state, self._all))
            or _hands_on(self._all, self._own)
            or any(
                self._helper_may_look(n) or self._method_may_look(n)
                for n in loop
                if isinstance(n, ast.Call)
            )
        )

    def _helper_may_look(self, call: ast.Call) -> bool:
        """Return whether a function called by its name may check for a preempt."""
        if not isinstance(call.func, ast.Name):
            return False
        name, code = call.func.id, self._function.__code__
        if name in (*code.co_varnames, *code.co_cellvars):
            return True  # a local variable: it may be any function
        cells = dict(zip(code.co_freevars, self._function.__closure__ or (), strict=True))
        try:
            helper = cells[name].cell_contents if name in cells else None
        except ValueError:
            return True  # a closure variable without a value so far
        helper = helper or self._function.__globals__.get(name)
        if helper is None or inspect.isbuiltin(helper) or inspect.isclass(helper):
            return False
        parsed = _parse(helper)
        return parsed is None or any(_asks_for_state(n) or _looks(n) for n in ast.walk(parsed[0]))

    def _method_may_look(self, call: ast.Call) -> bool:
        """Return whether a call is of a method of the state that may check for a preempt."""
        name = self._own_call(call)
        if name is None or name in _LOOKS or name == "sleep":
            return name is not None
        method = getattr(self._owner, name, None)
        parsed = _parse(method) if inspect.isfunction(method) else None
        if parsed is None:
            return True  # its source is unknown
        tree = parsed[0]
        own = tree.args.args[0].arg if tree.args.args else ""
        nodes = list(ast.walk(tree))
        # Methods that call other methods of the state are not followed: they may check.
        return _hands_on(nodes, own) or any(
            _looks(n)
            or (isinstance(n, ast.Attribute) and n.attr == "sleep")
            or _asks_for_state(n)
            or _method_of(n, own) is not None
            for n in nodes
        )

    def _own_call(self, node: ast.AST) -> str | None:
        return None if self._own is None else _method_of(node, self._own)


_TESTS = (ast.Compare, ast.Match, ast.BoolOp, ast.Subscript)


def _with_ways(
    block: list[ast.stmt], way: tuple[tuple[int, int], ...] = ()
) -> Iterator[tuple[ast.AST, tuple[tuple[int, int], ...]]]:
    """Yield the nodes of a block in their order, without those of inner functions.

    With each its way: pairs (id of a statement, number of the branch of it), outermost first.
    """
    for statement in block:
        yield statement, way
        branches = _branches(statement)
        inside = {id(part) for branch in branches for part in branch}
        for child in ast.iter_child_nodes(statement):
            if id(child) not in inside and not isinstance(child, (*_INNER, *_HOLDERS)):
                yield child, way
                yield from ((node, way) for node in _own_nodes(child))
        for number, branch in enumerate(branches):
            yield from _with_ways(branch, (*way, (id(statement), number)))


_HOLDERS = (ast.ExceptHandler, ast.match_case)


def _branches(statement: ast.stmt) -> list[list[ast.stmt]]:
    """Return the blocks of a statement."""
    if isinstance(statement, _INNER):
        return []
    holders: list[Any] = [statement]
    holders += getattr(statement, "handlers", ())
    holders += getattr(statement, "cases", ())
    found = (getattr(each, name, None) for each in holders for name in _BLOCKS)
    return [block for block in found if block]


_BLOCKS = ("body", "orelse", "finalbody")


def _excludes(way: tuple[tuple[int, int], ...], other: tuple[tuple[int, int], ...]) -> bool:
    """Return whether two ways lead through different branches of a statement."""
    one = dict(way)
    return any(one.get(statement, branch) != branch for statement, branch in other)


def _looks(node: ast.AST) -> bool:
    """Return whether a node names a method that checks; not `sleep`, which others have as well."""
    return isinstance(node, ast.Attribute) and node.attr in _LOOKS


def _asks_for_state(node: ast.AST) -> bool:
    """Return whether a node is `current_state`, with or without a module before it."""
    return "current_state" in (getattr(node, "id", None), getattr(node, "attr", None))


def _method_of(node: ast.AST, own: str) -> str | None:
    """Return the method's name if the node is a call `own.method(...)`."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return None
    value = node.func.value
    return node.func.attr if isinstance(value, ast.Name) and value.id == own else None


def _hands_on(nodes: list[ast.AST], own: str | None) -> bool:
    """Return whether the name `own` is used anywhere except in front of a dot."""
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
    """Return the length of a delay [s]; 0 if it is not a literal."""
    value = delay.args[0] if len(delay.args) == 1 and _called(delay) == "sleep" else None
    number = value.value if isinstance(value, ast.Constant) else None
    return float(number) if isinstance(number, int | float) else 0.0


def _passes(items: ast.expr) -> int:
    """Return the number of passes of a loop over `items`; 1 if it is not a literal."""
    if isinstance(items, ast.List | ast.Tuple):
        return len(items.elts)
    if isinstance(items, ast.Call) and _called(items) == "range":
        numbers = [n.value for n in items.args if isinstance(n, ast.Constant)]
        whole = [n for n in numbers if isinstance(n, int)]
        if len(whole) == len(items.args) and 0 not in whole[2:]:
            return len(range(*whole))
    return 1


def keys_written_aside(file: str, kinds: Collection[str]) -> frozenset[str] | None:
    """Return the userdata keys that functions of a file write by a machine's attribute `userdata`.

    Such a function may be the callback of a topic, which runs at any time. None: any key.

    Args:
        file: The file.
        kinds: Names of the classes of the machines in question, for writes to `self.userdata`.
    """
    try:
        written = _written_aside(file, Path(file).stat().st_mtime_ns)
    except (OSError, SyntaxError, ValueError):
        return None
    keys = {key for kind, key in written if kind is None or kind in kinds}
    return None if None in keys else frozenset(key for key in keys if key is not None)


@functools.lru_cache(maxsize=256)
def _written_aside(file: str, _changed: int) -> frozenset[tuple[str | None, str | None]]:
    """Return pairs (class if it is `self.userdata`, key; None: any)."""
    tree = ast.parse(Path(file).read_bytes())
    owners = {
        id(function): kind.name
        for kind in ast.walk(tree)
        if isinstance(kind, ast.ClassDef)
        for function in kind.body
    }
    found: set[tuple[str | None, str | None]] = set()
    for function in ast.walk(tree):
        # A state's own `execute` is looked at with the state.
        other = isinstance(function, _FUNCTIONS) and function.name != "execute"
        nodes = [*_own_nodes(function)] if other else []
        # Machines that it builds itself.
        made = {n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        for node in nodes:
            value = getattr(node, "value", None)
            if isinstance(value, ast.Attribute) and value.attr == "userdata":
                base = value.value.id if isinstance(value.value, ast.Name) else ""
                if base not in made:
                    kind = owners.get(id(function)) if base == "self" else None
                    found |= {(kind, key) for key in _written_key(node)}
    return frozenset(found)


def _written_key(node: ast.AST) -> set[str | None]:
    """Return the key that `userdata.key = ...` or the like writes; None: any."""
    if isinstance(node, ast.Attribute) and node.attr == "update":
        return {None}
    if not isinstance(getattr(node, "ctx", None), ast.Store):
        return set()
    if isinstance(node, ast.Attribute):
        return {node.attr}
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
        return {str(node.slice.value)}
    return {None}


# -- userdata keys ---------------------------------------------------------------------------------


def keys_read(tree: Function, name: str) -> Reads | None:
    """Return the keys read from the userdata called `name`; None if it is passed on.

    Excluded are keys that may have a value by then, or may go without one: those tested with `in`,
    written earlier or in the same loop, read where an exception is caught, or read by an inner
    function.
    """
    nodes = list(ast.walk(tree))
    uses = {node: key for node in nodes if (key := _key(node, name)) is not None}
    asked = [key for node in nodes if (key := _asked(node, name)) is not None]
    named = sum(isinstance(n, ast.Name) and n.id == name for n in nodes)
    if named > len(uses) + len(asked):
        return None
    reader = _FunctionWalk(uses, asked)
    own = set(_own_nodes(tree))
    reader.write(node for node in nodes if node not in own)  # by an inner function
    reader.visit_all(tree.body, always=True)
    writes = {key for node, key in uses.items() if isinstance(_context(node), ast.Store)}
    return Reads(
        frozenset(reader.always), frozenset(reader.sometimes - reader.always), frozenset(writes)
    )


def changed_values(tree: Function, name: str | None = None) -> Iterator[tuple[str, int]]:
    """Yield the keys of the userdata called `name` whose values a function changes, with the line.

    These are changes of the value itself, by a method of lists, dicts and sets or by an assignment
    to a part of it; not `name.key = value`, which writes the key.
    """
    for node in _own_nodes(tree):
        inner: Any = None
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            inner = node.func.value if node.func.attr in _CHANGERS else None
        elif isinstance(_context(node), ast.Store | ast.Del):
            inner = getattr(node, "value", None)
        while isinstance(inner, ast.Attribute | ast.Subscript) and _key(inner, str(name)) is None:
            inner = inner.value
        key = None if inner is None else _key(inner, str(name))
        if key is not None:
            yield key, node.lineno  # type: ignore[attr-defined]


class _FunctionWalk:
    """Visits a function in the order of execution.

    Args:
        uses: The nodes that are a key of the userdata.
        asked: Keys that it tests for before it reads them.
    """

    def __init__(self, uses: dict[ast.AST, str], asked: Iterable[str]) -> None:
        self._uses = uses
        self._valued = set(asked)  # keys that may have a value by now
        self.always: set[str] = set()
        self.sometimes: set[str] = set()

    def write(self, nodes: Iterable[ast.AST]) -> None:
        """Note the keys written in `nodes`."""
        for node in nodes:
            if node in self._uses and isinstance(_context(node), ast.Store):
                self._valued.add(self._uses[node])

    def visit_all(self, nodes: Iterable[ast.AST], *, always: bool) -> bool:
        """Visit nodes in sequence; return whether every call gets past them."""
        for node in nodes:
            self.visit(node, always=always)
            always = always and not _may_leave(node)
        return always

    def visit(self, node: ast.AST, *, always: bool) -> None:
        """Note the keys read in a node.

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
        elif any(_entered(node, {"suppress"})):
            # Exceptions end here, so a missing key does no harm.
            self.write(ast.walk(node))
        else:
            if isinstance(node, _LOOPS):
                self.write(ast.walk(node))  # an earlier pass may have written them
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
    """Return the node's context: load, store or delete."""
    return getattr(node, "ctx", None)


# The fields of a node that are always evaluated, in order of evaluation; the others may be.
_SURELY: dict[type[ast.AST], tuple[str, ...]] = {
    **dict.fromkeys((ast.If, ast.IfExp, ast.While, ast.Assert), ("test",)),
    **dict.fromkeys((ast.For, ast.AsyncFor), ("iter", "target")),
    **dict.fromkeys((ast.AnnAssign, ast.NamedExpr, ast.AugAssign), ("value", "target")),
    ast.Assign: ("value", "targets"),
    ast.Match: ("subject",),
}


def _parts(node: ast.AST) -> tuple[list[ast.AST], list[list[ast.AST]]]:
    """Return the parts of a node that are always evaluated, in order, and the branches."""
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
                # The statements of a block form one branch; any other part is a branch of its own.
                branch = name if isinstance(part, ast.stmt) else part
                branches.setdefault(branch, []).append(part)
    return surely, [*branches.values()]


def _may_leave(statement: ast.AST) -> bool:
    """Return whether the statements after this one may be skipped."""
    jumps = (ast.Return, ast.Raise) if isinstance(statement, _LOOPS) else _JUMPS
    return isinstance(statement, _JUMPS) or any(
        isinstance(node, jumps) for node in _own_nodes(statement)
    )


def _key(node: ast.AST, name: str) -> str | None:
    """Return the key if the node is `name.key` or `name["key"]`."""
    value = getattr(node, "value", None)
    if not (isinstance(value, ast.Name) and value.id == name):
        return None
    if isinstance(node, ast.Attribute) and node.attr not in {"keys", "update"}:
        return node.attr
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
        return str(node.slice.value)
    return None


def _asked(node: ast.AST, name: str) -> str | None:
    """Return the key if the node is `"key" in name`."""
    if not (isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In | ast.NotIn)):
        return None
    left, right = node.left, node.comparators[0]
    is_it = isinstance(right, ast.Name) and right.id == name
    return str(left.value) if is_it and isinstance(left, ast.Constant) else None


# -- syntax trees ----------------------------------------------------------------------------------


def _own_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below `tree`, without those of inner functions."""
    for child in ast.iter_child_nodes(tree):
        yield child
        if not isinstance(child, _INNER):
            yield from _own_nodes(child)


def _called(node: ast.Call) -> str:
    """Return the last part of the called name."""
    return str(getattr(node.func, "attr", None) or getattr(node.func, "id", ""))


def _has_limit(call: ast.Call, position: int) -> bool:
    """Return whether a call has an argument there or by keyword that is not None."""
    given = [*call.args[position:], *(keyword.value for keyword in call.keywords)]
    return any(not (isinstance(value, ast.Constant) and value.value is None) for value in given)


def _entered(node: ast.AST, names: Collection[str]) -> Iterator[ast.Call]:
    """Yield the calls of one of `names` that a `with` enters."""
    for item in node.items if isinstance(node, _WITH) else ():
        if isinstance(item.context_expr, ast.Call) and _called(item.context_expr) in names:
            yield item.context_expr


def _texts(node: ast.AST | None, constants: dict[str, Texts]) -> Texts:
    """Return the strings that an expression can be; None if unknown."""
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
    """Yield the names that a node binds, with the value if it is a plain assignment."""
    plain = isinstance(node, ast.Assign | ast.AnnAssign | ast.NamedExpr)
    value = getattr(node, "value", None) if plain else None
    others = (getattr(node, "target", None), getattr(node, "optional_vars", None))
    for target in (*getattr(node, "targets", ()), *others):
        if isinstance(target, ast.Name):
            yield target.id, value
        elif target is not None:
            yield from ((n.id, None) for n in ast.walk(target) if isinstance(n, ast.Name))
    # Imports, functions, classes, exception handlers and patterns bind names, too.
    name = next(filter(None, (getattr(node, a, None) for a in ("asname", "name", "rest"))), None)
    if isinstance(name, str):
        yield name.partition(".")[0], None
