"""`smachpy port`: rewrites an old script for this package and keeps its comments and layout.

Code with only one meaning is rewritten; code that needs a person's decision stays and is listed
with its line.

    import smach, smach_ros                      import smachpy
    smach.State.__init__(self, outcomes=[...])   super().__init__(outcomes=[...])
    with sm: smach.StateMachine.add('A', ...)    with sm: sm.add('A', ...)
    rospy.sleep(2) in a state                    self.sleep(2)
    rospy.loginfo("x")                           logger.info("x")
    def main(): ...; sm.execute()                @smachpy.mission
                                                 def main(): ...; return sm
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import Any, Final

from smachpy.ros1 import python2
from smachpy.ros1.extra import import_extra
from smachpy.ros1.hook import OLD_NAMES

_LOG: Final = {
    "logdebug": "debug",
    "loginfo": "info",
    "logwarn": "warning",
    "logwarning": "warning",
    "logerr": "error",
    "logerror": "error",
    "logfatal": "critical",
}
_ROSPY: Final = {
    "Duration": "actionlib_core.Duration",
    "Publisher": "actionlib_core.Publisher",
    "Service": "actionlib_core.Service",
    "ServiceException": "actionlib_core.ServiceException",
    "ServiceProxy": "actionlib_core.ServiceProxy",
    "Subscriber": "actionlib_core.Subscriber",
    "Time": "actionlib_core.Time",
    "is_shutdown": "smachpy.is_shutdown",
    "wait_for_message": "actionlib_core.wait_for_message",
    "wait_for_service": "actionlib_core.wait_for_service",
}
"""Names of rospy that have a counterpart with the same arguments here."""

_HINTS: Final = {
    "Rate": "a loop with self.sleep(seconds) ends early on a preempt",
    "Timer": "use the clock of actionlib_core.clock, or a state with a timeout",
    "get_param": "make it an argument of the mission's function: `smachpy run FILE --input K=V`",
    "myargv": "make the arguments those of the mission's function",
    "on_shutdown": "actionlib_core.shutdown.on_shutdown(function), in a thread of its own",
    "set_param": "keep it in userdata",
    "signal_shutdown": "actionlib_core.shutdown.request(reason), or return from the function",
    "sleep": "outside of a state: actionlib_core.clock.current_clock().sleep(seconds)",
    "spin": "nothing is needed: `smachpy run` ends with the machine",
}
_SHOWN: Final = "shown by `smachpy run --log-level info`, or with logging.basicConfig in the script"
_WANTS_FUNCTION: Final = (
    "`smachpy run FILE` wants a function `mission()` that returns the machine in place of one that "
    "executes it"
)
_CONTAINERS: Final = {
    ("StateMachine", "add"),
    ("StateMachine", "add_auto"),
    ("Concurrence", "add"),
    ("Sequence", "add"),
    ("Iterator", "set_contained_state"),
    ("Iterator", "set_iteritems"),
}


@dataclass(slots=True)
class Ported:
    """A rewritten script.

    Attributes:
        text: Its source.
        notes: What a person has to check: line in the old script, and why.
    """

    text: str
    notes: list[tuple[int, str]] = field(default_factory=list)


def port(source: bytes, filename: str) -> Ported:
    """Rewrite a script for ROS 1.

    Raises:
        SyntaxError: it is neither Python 3 nor Python 2.
        MissingExtraError: libcst is not installed.
    """
    cst = import_extra("libcst", "port")
    metadata = import_extra("libcst.metadata", "port")
    text = python2.in_utf8(python2.read(source))
    notes: list[tuple[int, str]] = []
    converted = python2.to_text(text, filename)
    if converted != text:
        text = converted
        notes.append((1, "it was Python 2: look at divisions of whole numbers, and at text"))
    wrapper = metadata.MetadataWrapper(cst.parse_module(text))
    # Decisions about the whole script come first; the transformer then sees one node at a time.
    main = _find_main(ast.parse(text))
    transformer = _transformer(cst, metadata)(_packages(text), main)
    notes += main.notes if main is not None else []
    module = wrapper.visit(transformer)
    code = str(module.code)
    # `import rospy` stays as long as a use of it is left, and then so does the node of rospy.
    if not any(isinstance(n, ast.Name) and n.id == "rospy" for n in ast.walk(ast.parse(code))):
        code = str(module.visit(_forget(cst, "rospy")).code)
    elif transformer.initialises:
        transformer = _transformer(cst, metadata)(_packages(text), main, keeps_node=True)
        code = str(wrapper.visit(transformer).code)
    left = _old_names(code)
    if left:
        used = f"{', '.join(left)} {'is' if len(left) == 1 else 'are'} still used"
        notes.append((1, f"{used}: such a script runs by `smachpy run --ros1 FILE`"))
    code = _add_imports(code, transformer)
    if transformer.main_line and main is None:
        notes.append((transformer.main_line, _WANTS_FUNCTION))
    return Ported(code, sorted({*notes, *transformer.notes}))


def _old_names(code: str) -> list[str]:
    """Return the packages of ROS 1 that a source imports."""
    found = set()
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found.add((node.module or "").partition(".")[0])
    return sorted(found & OLD_NAMES)


@dataclass(slots=True)
class _Main:
    """The function that is the script's whole program: it builds a machine and executes it.

    Attributes:
        function: Its name.
        machine: Name of the variable with its machine.
        execute: Line of the statement that executes the machine.
        call: Line of the statement at module level that calls the function.
        removed: Lines of statements that are not needed with `smachpy run`.
        notes: Line and reason of what was removed.
    """

    function: str
    machine: str
    execute: int
    call: int
    removed: set[int] = field(default_factory=set)
    notes: list[tuple[int, str]] = field(default_factory=list)


_NEEDLESS: Final = {
    "print": "`smachpy run` prints the outcome",
    "spin": "`smachpy run` ends with the machine",
    "signal_shutdown": "`smachpy run` ends with the machine",
    "exit": "`smachpy run` ends by the outcome",
    "IntrospectionServer": "`smachpy run --view` shows the machine",
    "request_preempt": "Ctrl-C preempts the machine",
    **dict.fromkeys(("stop", "start", "join", "init_node"), ""),
    **dict.fromkeys(_LOG, "`smachpy run` prints the outcome"),
}
"""Calls that may follow `execute()`, by their last word -> why `smachpy run` does not need them."""


def _find_main(tree: ast.Module) -> _Main | None:
    """Return the function that can become a mission; None: a person has to decide.

    There must be exactly one function without parameters that is called exactly once, at module
    level, and it must execute exactly one machine, in a statement of its own.
    """
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    called = {name: node for node in tree.body if (name := _calls(node)) in functions}
    used = [n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and n.id in called]
    if len(used) != 1 or functions[used[0]].args.args:
        return None
    function = functions[used[0]]
    executed = [(node, machine) for node in function.body if (machine := _executed(node))]
    # Statements are identified by their lines, so no two may share one.
    if len(executed) != 1 or len({node.lineno for node in function.body}) != len(function.body):
        return None
    execute, machine = executed[0]
    main = _Main(function.name, machine, execute.lineno, called[function.name].lineno)
    return main if _mark_removed(main, function.body, function.body.index(execute)) else None


def _mark_removed(main: _Main, body: list[ast.stmt], execute: int) -> bool:
    """Mark statements that `smachpy run` does not need.

    Returns:
        Whether all statements after `execute` are such, and none before returns early.
    """
    servers = set()
    for index, node in enumerate(body):
        value = node.value if isinstance(node, ast.Assign | ast.Expr | ast.Return) else None
        word = "exit" if isinstance(node, ast.Return) else _last_word(value)
        before = index < execute
        if before and word == "IntrospectionServer" and isinstance(node, ast.Assign):
            servers.add(ast.unparse(node.targets[0]))
        elif before and not (
            word == "init_node" or (word == "start" and ast.unparse(value).split(".")[0] in servers)  # type: ignore[arg-type]
        ):
            if any(isinstance(n, ast.Return) for n in ast.walk(node)):
                return False
            continue
        elif index == execute:
            continue
        if word not in _NEEDLESS:
            return False
        main.removed.add(node.lineno)
        if _NEEDLESS[word] and not isinstance(node, ast.Return):
            main.notes.append((node.lineno, f"{word}: removed: {_NEEDLESS[word]}"))
    return True


def _calls(statement: ast.stmt) -> str:
    """Return the function that a statement at module level only calls; "" for other statements.

    The call may stand below `if __name__ == "__main__":` and in a `try` that ignores Ctrl-C.
    """
    if isinstance(statement, ast.If) and "__name__" in ast.unparse(statement.test):
        body = [n for n in statement.body if not _begins_node(n)]
        return _calls(body[0]) if len(body) == 1 and not statement.orelse else ""
    if isinstance(statement, ast.Try):
        ends = all(
            h.type is not None
            and ast.unparse(h.type).rpartition(".")[2]
            in {"ROSInterruptException", "KeyboardInterrupt"}
            and all(isinstance(n, ast.Pass) for n in h.body)
            for h in statement.handlers
        )
        body = [n for n in statement.body if not _begins_node(n)]
        plain = ends and not statement.finalbody and not statement.orelse
        return _calls(body[0]) if len(body) == 1 and plain else ""
    value = statement.value if isinstance(statement, ast.Expr) else None
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and not value.args:
        return value.func.id
    return ""


def _begins_node(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and _last_word(statement.value) == "init_node"


def _executed(statement: ast.stmt) -> str:
    """Return the machine that a simple statement executes, maybe in a thread; "" for none."""
    if not isinstance(statement, ast.Assign | ast.Expr | ast.Return):
        return ""
    for node in ast.walk(statement):
        if isinstance(node, ast.Attribute) and node.attr == "execute":
            return node.value.id if isinstance(node.value, ast.Name) else ""
    return ""


def _last_word(value: ast.expr | None) -> str:
    """Return `c` for a call `a.b.c(...)`; "" for other expressions."""
    if not isinstance(value, ast.Call):
        return ""
    return ast.unparse(value.func).rpartition(".")[2]


def _packages(text: str) -> set[str]:
    """Return the message packages that a script imports, if they are known here."""
    from importlib.util import find_spec

    found: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [name.name for name in node.names] if isinstance(node, ast.Import) else []
        for name in names:
            package, _, section = name.partition(".")
            known = find_spec(f"actionlib_core.interfaces.{package}") if package else None
            if section in {"msg", "srv"} and known is not None:
                found.add(package)
    return found


def _add_imports(code: str, transformer: Any) -> str:
    """Add the imports that the new names need, before the first statement of the script."""
    wanted = [f"import {name}" for name in sorted(transformer.needs)]
    if transformer.logs:
        wanted = ["import logging", *wanted]
    lines = code.splitlines(keepends=True)
    tree = ast.parse(code)
    there = {ast.unparse(node) for node in tree.body if isinstance(node, ast.Import)}
    wanted = [line for line in wanted if line not in there]
    body = [n for n in tree.body if not (isinstance(n, ast.Expr) and n is tree.body[0])]
    future = [n for n in body if isinstance(n, ast.ImportFrom) and n.module == "__future__"]
    first = (future[-1].end_lineno or 0) if future else (_first_line(body[0]) - 1 if body else 0)
    added = [f"{line}\n" for line in wanted]
    lines[first:first] = added
    if transformer.logs:
        imports = [n for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom)]
        last = max((n.end_lineno or 0 for n in imports), default=0)
        last = max(last, first) + len(added)
        lines[last:last] = ["\nlogger = logging.getLogger(__name__)\n"]
    return "".join(lines)


def _first_line(statement: ast.stmt) -> int:
    """Return the line where a statement begins, with its decorators."""
    marks: list[ast.expr] = getattr(statement, "decorator_list", [])
    return min([statement.lineno, *(mark.lineno for mark in marks)])


def _forget(cst: Any, name: str) -> Any:
    """Return a transformer that removes `import name`."""

    class Forget(cst.CSTTransformer):  # type: ignore[misc]
        def leave_Import(self, original_node: Any, updated_node: Any) -> Any:
            del original_node
            kept = [a for a in updated_node.names if getattr(a.name, "value", "") != name]
            if not kept:
                return cst.RemoveFromParent()
            kept[-1] = kept[-1].with_changes(comma=cst.MaybeSentinel.DEFAULT)
            return updated_node.with_changes(names=kept)

    return Forget()


def _transformer(cst: Any, metadata: Any) -> Any:  # noqa: C901  a class that needs libcst
    """Return the class of the transformer; it is made here, as libcst comes with the extra."""

    def dotted(name: str) -> Any:
        parts = name.split(".")
        made = cst.Name(parts[0])
        for part in parts[1:]:
            made = cst.Attribute(made, cst.Name(part))
        return made

    def text_of(node: Any) -> str:
        if isinstance(node, cst.Name):
            return str(node.value)
        if isinstance(node, cst.Attribute):
            before = text_of(node.value)
            return f"{before}.{node.attr.value}" if before else ""
        return ""

    class Rewrite(cst.CSTTransformer):  # type: ignore[misc]
        METADATA_DEPENDENCIES = (metadata.PositionProvider,)

        def __init__(
            self, packages: set[str], main: _Main | None, *, keeps_node: bool = False
        ) -> None:
            super().__init__()
            self.packages = packages
            self.keeps_node = keeps_node
            self.initialises = False
            self.main = main
            self.needs: set[str] = set()
            self.logs = False
            self.notes: set[tuple[int, str]] = set()
            self.main_line = 0
            self._opened: list[str] = []
            self._classes: list[tuple[str, bool]] = []  # base, and whether it is a state
            self._functions: list[str] = []  # name of the first parameter of each

        def note(self, node: Any, text: str) -> None:
            self.notes.add((self._line_of(node), text))

        # -- the enclosing classes and functions -----------------------------------------------

        def visit_ClassDef(self, node: Any) -> None:
            bases = [text_of(base.value) for base in node.bases]
            base = bases[0] if len(bases) == 1 else ""
            self._classes.append((base, base.rpartition(".")[2] == "State"))

        def leave_ClassDef(self, original_node: Any, updated_node: Any) -> Any:
            del original_node
            self._classes.pop()
            return updated_node

        def visit_FunctionDef(self, node: Any) -> None:
            self._functions.append(node.params.params[0].name.value if node.params.params else "")

        def leave_FunctionDef(self, original_node: Any, updated_node: Any) -> Any:
            self._functions.pop()
            main = self.main
            if main is None or original_node.name.value != main.function or self._classes:
                return updated_node
            self.needs.add("smachpy")
            mark = cst.Decorator(dotted("smachpy.mission"))
            return updated_node.with_changes(decorators=[mark, *updated_node.decorators])

        # -- the function that becomes a mission -----------------------------------------------

        def _line_of(self, node: Any) -> int:
            return int(self.get_metadata(metadata.PositionProvider, node).start.line)

        def _is_in_mission(self, node: Any) -> bool:
            main = self.main
            return main is not None and (
                self._line_of(node) in {main.execute, main.call, *main.removed}
            )

        def visit_SimpleStatementLine(self, node: Any) -> bool:
            # A statement that is replaced or removed is not visited: nothing in it needs a note.
            return not self._is_in_mission(node)

        def leave_SimpleStatementLine(self, original_node: Any, updated_node: Any) -> Any:
            if self.main is None or not self._is_in_mission(original_node):
                return updated_node
            line = self._line_of(original_node)
            if line == self.main.call:
                return self._call(updated_node)
            if line == self.main.execute:
                returned = cst.parse_statement(f"return {self.main.machine}")
                return returned.with_changes(leading_lines=updated_node.leading_lines)
            return cst.RemoveFromParent()

        def visit_Try(self, node: Any) -> bool:
            return not self._is_in_mission(node)

        def leave_Try(self, original_node: Any, updated_node: Any) -> Any:
            return self._call(updated_node) if self._is_in_mission(original_node) else updated_node

        def leave_If(self, original_node: Any, updated_node: Any) -> Any:
            return self._call(updated_node) if self._is_in_mission(original_node) else updated_node

        def _call(self, node: Any) -> Any:
            assert self.main is not None
            guard = 'if __name__ == "__main__":'
            made = cst.parse_statement(f"{guard}\n    print({self.main.function}().execute())\n")
            return made.with_changes(leading_lines=node.leading_lines)

        def visit_With(self, node: Any) -> None:
            self._opened.append(text_of(node.items[0].item) if len(node.items) == 1 else "")

        def leave_With(self, original_node: Any, updated_node: Any) -> Any:
            del original_node
            self._opened.pop()
            return updated_node

        def visit_If(self, node: Any) -> bool:
            test = node.test
            if isinstance(test, cst.Comparison) and text_of(test.left) == "__name__":
                self.main_line = self._line_of(node)
            return not self._is_in_mission(node)

        # -- imports ---------------------------------------------------------------------------

        def leave_Import(self, original_node: Any, updated_node: Any) -> Any:
            kept = []
            for alias in updated_node.names:
                name = text_of(alias.name)
                if name in {"smach", "smach_ros"} and alias.asname is None:
                    self.needs.add("smachpy")
                elif name == "roslib" and alias.asname is None:
                    continue
                elif name == "actionlib" and alias.asname is None:
                    self.needs.add("actionlib_core")
                elif name == "rospy" and alias.asname is None:
                    kept.append(alias)
                elif name.partition(".")[0] in self.packages:
                    self.note(original_node, f"import {name}: import its classes by name")
                    kept.append(alias)
                else:
                    kept.append(alias)
            if not kept:
                return cst.RemoveFromParent()
            kept[-1] = kept[-1].with_changes(comma=cst.MaybeSentinel.DEFAULT)
            return updated_node.with_changes(names=kept)

        def leave_ImportFrom(self, original_node: Any, updated_node: Any) -> Any:
            if updated_node.module is None:
                return updated_node
            name = text_of(updated_node.module)
            package, _, rest = name.partition(".")
            if package in self.packages and rest in {"msg", "srv"}:
                return updated_node.with_changes(module=dotted(f"actionlib_core.interfaces.{name}"))
            star = isinstance(updated_node.names, cst.ImportStar)
            new = {"smach": "smachpy", "smach_ros": "smachpy", "actionlib": "actionlib_core"}
            if name in new and not star:
                return updated_node.with_changes(module=dotted(new[name]))
            if package in {*new, "rospy", "tf"}:
                self.note(original_node, f"from {name} import ...: name what is used, from smachpy")
            return updated_node

        # -- names and calls -------------------------------------------------------------------

        def leave_Attribute(self, original_node: Any, updated_node: Any) -> Any:
            name = text_of(original_node)
            package, _, rest = name.partition(".")
            if not rest or "." in rest:
                return updated_node
            if package in {"smach", "smach_ros"}:
                return updated_node.with_changes(value=cst.Name("smachpy"))
            if package == "actionlib":
                return updated_node.with_changes(value=cst.Name("actionlib_core"))
            if package == "rospy" and rest in _ROSPY:
                home = _ROSPY[rest].partition(".")[0]
                self.needs.add(home)
                return dotted(_ROSPY[rest])
            if package == "rospy" and rest not in _LOG:
                hint = _HINTS.get(rest, "it has no twin of the same meaning")
                if not (rest == "sleep" and self._in_state()) and rest != "init_node":
                    self.note(original_node, f"rospy.{rest}: {hint}")
            return updated_node

        def _in_state(self) -> bool:
            return bool(self._classes and self._classes[-1][1] and self._functions[-1:] == ["self"])

        def leave_Call(self, original_node: Any, updated_node: Any) -> Any:
            name = text_of(original_node.func)
            package, _, rest = name.partition(".")
            if package == "rospy" and rest in _LOG:
                if not self.logs and rest in {"loginfo", "logdebug"}:
                    self.note(original_node, f"{name}: {_SHOWN}")
                self.logs = True
                return updated_node.with_changes(func=dotted(f"logger.{_LOG[rest]}"))
            if name == "rospy.sleep" and self._in_state():
                return updated_node.with_changes(func=dotted("self.sleep"))
            begins = name == "rospy.init_node" and not self.keeps_node
            if begins and len(updated_node.args) == 1:
                self.initialises = True
                self.needs.add("actionlib_core")
                return updated_node.with_changes(func=dotted("actionlib_core.init"))
            made = self._super_call(name, updated_node)
            if made is not None:
                return made
            if begins:
                self.note(original_node, "rospy.init_node: actionlib_core.init(name) takes a name")
            words = tuple(name.split(".")[-2:])
            opened = self._opened[-1] if self._opened else ""
            if words in _CONTAINERS and opened:
                return updated_node.with_changes(func=dotted(f"{opened}.{words[1]}"))
            return updated_node

        def _super_call(self, name: str, node: Any) -> Any:
            base = self._classes[-1][0] if self._classes else ""
            given = node.args
            if not base or name != f"{base}.__init__" or not given:
                return None
            if text_of(given[0].value) != "self":
                return None
            function = cst.Attribute(cst.Call(cst.Name("super")), cst.Name("__init__"))
            return node.with_changes(func=function, args=given[1:])

        def leave_Expr(self, original_node: Any, updated_node: Any) -> Any:
            """Remove `roslib.load_manifest(...)`."""
            value = original_node.value
            if isinstance(value, cst.Call) and text_of(value.func) == "roslib.load_manifest":
                return cst.RemoveFromParent()
            return updated_node

    return Rewrite
