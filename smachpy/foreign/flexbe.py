"""Behaviours of FlexBE: the Python file that its editor writes is parsed, never executed.

Source: flexbe_behavior_engine 4 (https://github.com/FlexBE/flexbe_behavior_engine).
"""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Any, Final

from smachpy.foreign.draft import Part
from smachpy.foreign.literals import Known, NotPlainError, parse_python, plain, shown

if TYPE_CHECKING:
    from smachpy.foreign.draft import Draft, Place

MACHINES: Final = ("OperatableStateMachine", "PriorityContainer")
CONCURRENCE: Final = "ConcurrencyContainer"
LEVELS: Final = {"Low": 2, "High": 3, "Full": 4}  # as those of `confirm`
KINDS: Final = {bool: "flag", int: "whole", float: "number", str: "text", list: "list"}
_SET_UP: Final = ("initialize_ros", "initialize", "add_behavior", "__init__")


def behavior_in(tree: ast.Module) -> ast.ClassDef | None:
    """Return the behaviour of a file; None if it has none."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            bases = [getattr(base, "id", getattr(base, "attr", "")) for base in node.bases]
            if "Behavior" in bases and "create" in [getattr(one, "name", "") for one in node.body]:
                return node
    return None


def read(draft: Draft, text: str) -> None:
    """Read a behaviour from the text of its file."""
    try:
        tree = parse_python(text)
        behavior = behavior_in(tree)
        if behavior is not None:
            _Reader(draft, tree).behavior(behavior)
            return
        expected = "expected a class with the base Behavior and a method create"
        draft.problem((1, 1), f"got no behaviour of FlexBE; {expected}.")
    except SyntaxError as error:
        draft.problem((error.lineno or 1, error.offset or 1), f"not Python: {error.msg}.")
    except ValueError as error:  # a zero byte
        draft.problem((1, 1), f"not Python: {error}.")
    except (RecursionError, MemoryError):
        draft.problem((1, 1), "it is nested too deeply.")


def _place(node: ast.AST) -> Place:
    return getattr(node, "lineno", 1), getattr(node, "col_offset", 0) + 1


class _Reader:
    def __init__(self, draft: Draft, tree: ast.Module) -> None:
        self._draft = draft
        self._known = Known(draft)
        self._containers: dict[str, tuple[str, Part]] = {}  # those that are in no other one yet
        self._root = ""
        self._imported: dict[str, tuple[str, str]] = {}
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                for one in node.names:
                    self._imported[one.asname or one.name] = (node.module or "", one.name)

    def behavior(self, node: ast.ClassDef) -> None:
        """Read the whole."""
        name = node.name
        for one in (each for each in node.body if isinstance(each, ast.FunctionDef)):
            if one.name == "__init__":
                name = self._set_up(one) or name
            elif one.name == "create":
                self._create(one)
            else:
                self._draft.note(_place(one), f"the method {one.name}")
        if self._containers.get(self._root, ("",))[0] not in MACHINES:
            expected = "expected `return` with an OperatableStateMachine"
            self._draft.problem(_place(node), f"create: got {self._root or 'none'!r}; {expected}.")
            return
        top = self._containers[self._root][1]
        if self._known.parameters:
            top["parameters"] = self._known.parameters
        if not self._draft.problems:
            self._draft.finish(top, name, ast.get_docstring(node))

    def _note_code(self, node: ast.stmt) -> None:
        is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if not is_text and not isinstance(node, ast.Pass):
            self._draft.note(_place(node), f"code: {shown(node)}")

    def _create(self, function: ast.FunctionDef) -> None:
        for statement in function.body:
            match statement:
                case ast.Return(value=ast.Name(id=name)):
                    self._root = name
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call() as call) if (
                    self._kind(call) in {*MACHINES, CONCURRENCE}
                ):
                    self._container(name, call)
                case ast.Assign(targets=[target], value=value):
                    self._assign(statement, target, value)
                case ast.With(items=[ast.withitem(context_expr=ast.Name(id=name))], body=body):
                    self._fill(name, body, statement)
                case _:
                    self._note_code(statement)

    def _kind(self, node: ast.Call) -> str:
        """Return the name of what is called, as its module has it."""
        name: str = getattr(node.func, "id", "")
        return self._imported.get(name, ("", name))[1]

    def _assign(self, statement: ast.stmt, target: ast.expr, value: ast.expr) -> None:
        """Keep a literal that is given to a name, or to a key of the userdata."""
        try:
            made = plain(value, self._known)
            match target:
                case ast.Name(id=name):
                    self._known.name(name, value)
                    return
                case ast.Attribute(
                    value=ast.Attribute(value=ast.Name(id=name), attr="userdata"), attr=key
                ) if name in self._containers:
                    part = self._containers[name][1]
                    part.setdefault("userdata", Part(part.place)).put(key, made, _place(target))
                    return
        except NotPlainError:
            pass
        self._note_code(statement)

    def _set_up(self, function: ast.FunctionDef) -> str:
        """Read the parameters; return the name."""
        found = ""
        for statement in function.body:
            match statement:
                case ast.Expr(
                    value=ast.Call(
                        func=ast.Attribute(attr="add_parameter"),
                        args=[ast.Constant(value=str() as name), default],
                    )
                ):
                    self._parameter(statement, name, default)
                case ast.Assign(
                    targets=[ast.Attribute(value=ast.Name(id="self"), attr="name")],
                    value=ast.Constant(value=str() as text),
                ):
                    found = text
                case ast.Assign(targets=[ast.Attribute(attr="node")]):
                    pass
                case ast.Expr(value=ast.Call(func=ast.Attribute(attr=name))) if name in _SET_UP:
                    pass
                case _:
                    self._note_code(statement)
        return found

    def _parameter(self, statement: ast.stmt, name: str, default: ast.expr) -> None:
        about = Part(where := _place(statement))
        try:
            about["default"] = plain(default)
            about["type"] = KINDS.get(type(about["default"]), "any")
        except NotPlainError:
            self._draft.note(where, f"the default of the parameter {name!r}: {shown(default)}")
        self._known.parameters.put(name, about, where)

    def _keywords(self, call: ast.Call, *, named: bool = False) -> dict[str, Any]:
        """Return the plain arguments with names; the others are noted unless `named` is said."""
        found = {}
        for one in call.keywords:
            try:
                found[one.arg or "**"] = plain(one.value, self._known)
            except NotPlainError:
                text = f"the argument {one.arg or '**'}: {shown(one.value)}"
                self._draft.note(_place(one.value), text)
        for each in () if named else call.args:
            self._draft.note(_place(each), f"an argument without a name: {shown(each)}")
        return found

    def _container(self, name: str, call: ast.Call) -> None:
        kind, part = self._kind(call), Part(_place(call), states=Part(_place(call)))
        given = self._keywords(call)
        part |= {
            key: given[key] for key in ("outcomes", "input_keys", "output_keys") if key in given
        }
        if kind == "PriorityContainer":
            text = "the priority of a PriorityContainer: other branches go on meanwhile"
            self._draft.note(_place(call), text)
        if kind == CONCURRENCE:
            part["outcome_map"] = given.get("conditions", [])  # until its states are known
            ends = part.get("outcomes")
            part["default_outcome"] = ends[-1] if isinstance(ends, list) and ends else ""
        self._containers[name] = (kind, part)

    def _decide(self, part: Part, ends: dict[str, list[str]]) -> None:
        """Set the rules of a concurrence, and which `ends` of its states stop the others.

        In FlexBE it ends as soon as a condition holds, with the first one that is given.
        """
        found: dict[str, list[dict[str, str]]] = {}
        try:
            for outcome, wanted in part["outcome_map"]:
                found.setdefault(str(outcome), []).append({str(k): str(v) for k, v in wanted})
        except (TypeError, ValueError):
            expected = "expected [(outcome, [(label, outcome), ...]), ...]"
            self._draft.problem(part.place, f"conditions: got something else; {expected}.")
        part["outcome_map"], alone = {}, dict[str, list[str]]()
        for outcome, cases in reversed(found.items()):  # here the last rule that holds wins
            single: dict[str, list[str]] = {}
            for label, wanted in (pair for one in cases if len(one) == 1 for pair in one.items()):
                single.setdefault(label, []).append(wanted)
                alone.setdefault(label, []).append(wanted)
            part["outcome_map"][outcome] = cases[0]
            if len(cases) > 1 and all(len(one) == 1 for one in cases):
                part["outcome_map"][outcome] = {"any": single}
            elif len(cases) > 1:
                self._draft.note(part.place, f"all but the first condition of {outcome!r}")
        stops = [one for one in ends if ends[one] and {*alone.get(one, ())}.issuperset(ends[one])]
        for label in ends.keys() & alone.keys() - {*stops}:
            for outcome in {*alone[label]}:
                text = f"the stop of the other states when {label} ends with {outcome!r}"
                self._draft.note(part.place, text)
        if stops:
            part["stop_others"] = stops

    def _fill(self, name: str, body: list[ast.stmt], around: ast.stmt) -> None:
        if name not in self._containers:
            text = f"got `with {name}`; expected a machine that is made above."
            self._draft.problem(_place(around), text)
            return
        kind, part = self._containers[name]
        ends: dict[str, list[str]] = {}
        for statement in body:
            match statement:
                case ast.Expr(
                    value=ast.Call(
                        func=ast.Attribute(attr="add"),
                        args=[ast.Constant(value=str() as label), state],
                    ) as call
                ):
                    entry = self._state(state)
                    ends[label] = self._connect(entry, call, kind == CONCURRENCE)
                    self._draft.add_state(part["states"], label, entry, _place(statement))
                case _:
                    self._draft.note(_place(statement), f"code: {shown(statement)}")
        if kind == CONCURRENCE:
            self._decide(part, ends)

    def _connect(self, entry: Part, call: ast.Call, in_concurrence: bool) -> list[str]:
        """Read where a state leads to, and its keys; return its outcomes."""
        given = self._keywords(call, named=True)
        transitions, levels = (
            value if isinstance(value, dict) else {}
            for value in (given.get("transitions"), given.get("autonomy"))
        )
        on = Part(_place(call))
        for outcome, target in transitions.items():
            level = LEVELS.get(str(levels.get(outcome)))
            if level and in_concurrence:
                text = f"the autonomy level of {outcome!r}, inside a concurrence"
                self._draft.note(_place(call), text)
            on[outcome] = Part(_place(call), to=target, confirm=level) if level else target
        if given.get("remapping"):
            entry["remapping"] = given["remapping"]
        if not in_concurrence:
            entry["on"] = on
        elif "state" in entry:
            entry["outcomes"] = list(on)
        return list(on)

    def _state(self, node: ast.expr) -> Part:
        """Return a state, without what its container does with it."""
        where = _place(node)
        match node:
            case ast.Name(id=name) if name in self._containers:
                kind, part = self._containers.pop(name)
                return Part(where, **{"concurrence" if kind == CONCURRENCE else "machine": part})
            case ast.Call(func=ast.Attribute(attr="use_behavior"), args=[ast.Name(id=name), *_]):
                module, name = self._imported.get(name, ("", name))
                file = f"{module.rpartition('.')[2]}.py"
                is_beside = module and (self._draft.folder / file).is_file()
                own = {"mission": file} if is_beside else {"state": self._draft.leaf(name)}
                entry = Part(where, **own)
                given = self._keywords(node, named=True)
                arguments = given.pop("parameters", None)
                for key in given:
                    self._draft.note(where, f"the argument {key} of use_behavior")
            case ast.Call(func=ast.Name() | ast.Attribute(value=ast.Name())):
                name = self._kind(node) or getattr(node.func, "attr", "")
                entry = Part(where, state=self._draft.leaf(name))
                arguments = self._keywords(node)
            case _:
                text = f"got {shown(node)}; expected a state, a machine or use_behavior."
                self._draft.problem(where, text)
                return Part(where)
        if arguments:
            entry["with"] = arguments
        return entry
