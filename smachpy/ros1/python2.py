"""Converts Python 2 source to Python 3 code in memory; the code keeps the file's line numbers.

fissix, a maintained fork of lib2to3, rewrites the source. Where it cannot know the intention,
Python 3's meaning applies: `/` between integers gives a float, strings are text.
"""

from __future__ import annotations

import ast
import contextlib
import difflib
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actionlib_core.exceptions import ActionlibError

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CodeType

# Fixers that are not used: for style only, done better by `_GoneNames`, and for implicit relative
# imports, which `hook` finds.
_NOT_WANTED: Final = frozenset(
    {"buffer", "idioms", "import", "set_literal", "types", "ws_comma", "apply"}
)
# The fixers for source with Python 3's grammar that uses names of Python 2.
_NAMES: Final = (
    *("basestring", "dict", "execfile", "getcwdu", "has_key", "imports", "itertools", "long"),
    *("metaclass", "next", "nonzero", "raw_input", "reduce", "reload", "standarderror"),
    *("unicode", "urllib", "xrange"),
)
# Such names. A source without any of them is not converted, since conversion is slow.
_GONE: Final = re.compile(
    r"\b(basestring|execfile|getcwdu|has_key|iteritems|iterkeys|itervalues|raw_input|unicode"
    r"|xrange|unichr|viewitems|viewkeys|viewvalues|StandardError|izip|imap|ifilter"
    r"|string\.(atof|atoi|atol|find|rfind|join|lower|replace|split|strip|upper|letters|lowercase"
    r"|uppercase|maketrans)"
    r"|Queue|ConfigParser|cPickle|c?StringIO|urllib2|urlparse|httplib|xmlrpclib|SocketServer|copy_reg"
    r"|__builtin__|Tkinter|tkMessageBox|thread|commands|setdefaultencoding|__nonzero__|__metaclass__)\b"
    r"|(?<!\.)\b(apply|cmp|long|reduce|reload)\s*\(|\.next\(\)"
    r"|\.(keys|values|items)\(\)(\[|\.(sort|index)\()"
)
# `print >> file, text`, which is valid Python 3: a shift.
_SHIFTED_PRINT: Final = re.compile(r"^[ ]*print\s*>>", re.MULTILINE)
# Operators of Python 2 that have another name now.
_DIVISION: Final = re.compile(r"\bdef __([ir]?)div__\s*\(")
_INDENT: Final = re.compile(r"^[ ]*\t[ \t]*", re.MULTILINE)
# Errors of Python 3's parser for Python 2 source. If the conversion of such a source fails, too,
# its error is reported; else the error of Python 3's parser.
_LOOKS_OLD: Final = re.compile(
    "Missing parentheses in call|multiple exception types|leading zeros in decimal"
    "|invalid decimal literal|inconsistent use of tabs"
)
_CODING: Final = re.compile(rb"^[ \t\f]*#.*?coding[:=][ \t]*([-\w.]+)")
_CODING_OF_TEXT: Final = re.compile(  # in the first line or the second one
    r"\A((?:[ \t\f]*(?:#[^\n]*)?\n)?[ \t\f]*#[^\n]*?coding[:=][ \t]*)(?!utf[-_]?8\b)[-\w.]+"
)


class Python2Error(ActionlibError, SyntaxError):
    """A source is neither Python 3 nor Python 2.

    Try: correct the line that is shown.

    Attributes:
        filename: The file.
        lineno: The line with the error by Python 2's grammar.
    """

    def __init__(self, filename: str, lineno: int, problem: str) -> None:
        super().__init__(f"{filename}:{lineno}: {problem}")
        self.filename, self.lineno, self.msg = filename, lineno, problem


def to_code(
    source: bytes, filename: str, change: Callable[[ast.Module], None] | None = None
) -> CodeType:
    """Compile a source, converted from Python 2 if necessary; it keeps the file's line numbers.

    Args:
        source: The source.
        filename: Its file.
        change: Changes the syntax tree before.

    Raises:
        SyntaxError: it is neither Python 3 nor Python 2; the error is of the likelier version.
        MissingExtraError: it is Python 2, and fissix is not installed.
    """
    tree = to_tree(source, filename)
    if change is not None:
        change(tree)
    try:
        code: CodeType = compile(tree, filename, "exec", dont_inherit=True)
    except SyntaxError as error:
        if "prior to global declaration" not in str(error):
            raise
        _GlobalsFirst().visit(tree)
        code = compile(tree, filename, "exec", dont_inherit=True)
    return code


class _GlobalsFirst(ast.NodeTransformer):
    """Moves a function's `global` statements to its top: Python 2 allows them after a use."""

    def __init__(self) -> None:
        self._names: list[str] = []

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        outer, self._names = self._names, []
        self.generic_visit(node)
        if self._names:
            node.body.insert(0, ast.copy_location(ast.Global(self._names), node.body[0]))
        self._names = outer
        return node

    def visit_Global(self, node: ast.Global) -> ast.AST:
        self._names += node.names
        return ast.copy_location(ast.Pass(), node)


def is_python2(source: bytes, filename: str) -> bool:
    """Return whether Python 3 cannot parse a source."""
    try:
        ast.parse(straight(read(source)), filename)
    except SyntaxError:
        return True
    return False


def to_tree(source: bytes, filename: str) -> ast.Module:
    """Parse a source; as `to_code`."""
    text = read(source)
    converted = _convert(text, filename)
    tree = ast.parse(converted, filename)
    _GoneNames(tree).visit(tree)
    # Conversion may add or remove lines; set the numbers back to those of the file.
    before, after = text.splitlines(), converted.splitlines()
    if len(before) != len(after):
        lines = _line_map(before, after)
        for node in ast.walk(tree):
            place: Any = node
            if hasattr(place, "lineno"):
                place.lineno = lines[place.lineno]
                if getattr(place, "end_lineno", None):
                    place.end_lineno = max(lines[place.end_lineno], place.lineno)
    return tree


def to_text(text: str, filename: str) -> str:
    """Return a source as Python 3 source; lines that are valid Python 3 are not changed at all.

    Raises:
        SyntaxError, MissingExtraError: as `to_code`.
    """
    converted = _convert(text, filename)
    tree = ast.parse(converted, filename)
    names = _GoneNames(tree)
    names.visit(tree)
    lines = [line.encode() for line in converted.splitlines(keepends=True)]  # ast counts bytes
    last = (len(lines) + 1, 0)
    # From the end to the beginning, so that the places of the remaining changes stay valid.
    for (line, column, end_line, end), made in sorted(names.changes, reverse=True, key=_outermost):
        if (end_line, end) > last:
            continue  # inside a change that was already written
        last = (line, column)
        new = "; ".join(ast.unparse(each) for each in made)
        new = f"({new})" if isinstance(made[0], ast.Lambda) else new
        whole = lines[line - 1][:column] + new.encode() + lines[end_line - 1][end:]
        lines[line - 1 : end_line] = [whole]
    return b"".join(lines).decode()


def _outermost(change: tuple[tuple[int, int, int, int], list[ast.AST]]) -> tuple[int, ...]:
    """Sort key of changes: by their end, and of two with the same end the larger one last."""
    line, column, end_line, end = change[0]
    return end_line, end, -line, -column


def read(source: bytes) -> str:
    """Return the text of a source in its declared encoding, with line ends as in Unix."""
    encoding = "utf-8-sig"
    for line in source.splitlines()[:2]:
        match = _CODING.match(line)
        if match:
            encoding = match[1].decode()
            encoding = "utf-8-sig" if encoding.lower().replace("_", "-") == "utf-8" else encoding
    try:
        text = source.decode(encoding)
    except (UnicodeDecodeError, LookupError):
        text = source.decode("latin-1")  # this never fails
    return text.replace("\r\n", "\n").replace("\r", "\n")


def in_utf8(text: str) -> str:
    """Return a source that declares the encoding in which it is written: UTF-8."""
    return _CODING_OF_TEXT.sub(r"\1utf-8", text, count=1)


def straight(text: str) -> str:
    """Indent with spaces only: in Python 2 a tab leads to the next multiple of eight columns."""
    return _INDENT.sub(lambda match: match[0].expandtabs(8), text)


@lru_cache(maxsize=64)  # each star import from a stand-in reads its file again
def _convert(text: str, filename: str) -> str:
    """Return source that Python 3 can parse: unchanged, with spaces for tabs, or converted."""
    if "__truediv__" not in text:  # else the class has the operators of both
        text = _DIVISION.sub(r"def __\1truediv__(", text)
    try:
        ast.parse(text, filename)
    except SyntaxError as error:
        return _from_python2(straight(text), filename, error)
    if _SHIFTED_PRINT.search(text):
        return convert(straight(text))
    return convert(text, _NAMES) if _GONE.search(text) else text


def _from_python2(text: str, filename: str, error: SyntaxError) -> str:
    # Python 3 with mixed tabs and spaces parses now; anything else is converted.
    with contextlib.suppress(SyntaxError):
        ast.parse(text, filename)
        return text
    try:
        converted = convert(text)
    except SyntaxError as other:
        if not _LOOKS_OLD.match(error.msg or ""):
            raise error from None
        raise Python2Error(filename, other.lineno or 0, other.msg) from None
    ast.parse(converted, filename)
    return converted


def convert(text: str, names: tuple[str, ...] | None = None) -> str:
    """Return Python 2 source as Python 3 source.

    Args:
        text: The source, without tabs in its indents.
        names: Only these fixers, for source that parses as Python 3; None: all.

    Raises:
        Python2Error: it is not Python 2.
        MissingExtraError: fissix is not installed.
    """
    ended = text if text.endswith("\n") else f"{text}\n"
    tool, parse_error = _tool(names)
    try:
        return str(tool.refactor_string(ended, "<old source>"))
    except parse_error as error:
        context: Any = getattr(error, "context", None)
        line = context[1][0] if context else 0
        raise Python2Error("<old source>", line, "syntax that is no Python 2 either") from error


@lru_cache(maxsize=2)
def _tool(names: tuple[str, ...] | None) -> tuple[Any, type[Exception]]:
    from smachpy.ros1.extra import import_extra

    refactor = import_extra("fissix.refactor", "Python 2 source")
    parse = import_extra("fissix.pgen2.parse", "Python 2 source")
    tokenize = import_extra("fissix.pgen2.tokenize", "Python 2 source")
    wanted = names or sorted(set(refactor.get_all_fix_names("fissix.fixes")) - _NOT_WANTED)
    options = {"print_function": True, "exec_function": True} if names else {}
    fixers = [f"fissix.fixes.fix_{name}" for name in wanted]
    tool = refactor.RefactoringTool(fixers, options)
    tool.log_message = tool.log_debug = lambda *_args: None
    tool.log_error = _raise_on  # by default it logs a syntax error and returns None
    return tool, (parse.ParseError, tokenize.TokenError)  # type: ignore[return-value]


def _raise_on(*_args: Any, **_kwargs: Any) -> None:
    """Raise the exception that the caller has just caught."""
    raise  # noqa: PLE0704  called where it was caught


_TYPES: Final = {
    **dict.fromkeys(("DictType", "DictionaryType"), "dict"),
    **dict.fromkeys(("ClassType", "TypeType"), "type"),
    **dict.fromkeys(("InstanceType", "ObjectType"), "object"),
    **dict.fromkeys(("IntType", "LongType"), "int"),
    **dict.fromkeys(("StringType", "UnicodeType"), "str"),
    "BooleanType": "bool",
    "BufferType": "memoryview",
    "ComplexType": "complex",
    "FileType": "__import__('io').IOBase",
    "FloatType": "float",
    "ListType": "list",
    "SliceType": "slice",
    "StringTypes": "(str,)",
    "TupleType": "tuple",
    "UnboundMethodType": "type(lambda: None)",
    "XRangeType": "range",
}
"""Names of the module `types` in Python 2 -> an expression."""
_ABSTRACT: Final = (
    *("Callable", "Container", "Hashable", "Iterable", "Iterator", "Mapping", "MutableMapping"),
    *("MutableSequence", "MutableSet", "Sequence", "Set", "Sized"),
)
_MOVED: Final = {
    **{f"types.{name}": made for name, made in _TYPES.items()},
    **{f"string.{name}": f"string.ascii_{name}" for name in ("letters", "lowercase", "uppercase")},
    **{f"collections.{name}": f"__import__('collections.abc').abc.{name}" for name in _ABSTRACT},
    **{
        f"{np}.{name}": name
        for np in ("np", "numpy")
        for name in ("bool", "float", "int", "object")
    },
    "base64.decodestring": "base64.decodebytes",
    "base64.encodestring": "base64.encodebytes",
    "inspect.getargspec": "inspect.getfullargspec",
    "string.maketrans": "str.maketrans",
    "sys.maxint": "sys.maxsize",
    "time.clock": "time.process_time",
}
"""Attributes of modules that Python 3 or NumPy have removed -> an expression."""


class _GoneNames(ast.NodeTransformer):
    """Replaces names, functions and arguments that no longer exist.

    Functions of the module `string` become methods of str. `reload(sys)` and
    `sys.setdefaultencoding("utf-8")` are removed, since Python 3's strings need no encoding. `cmp`,
    `apply` and `file` are replaced, unless the module defines them, and `cmp` also as an argument
    of `sorted` and `sort`. The `message` of a caught error is its only argument, unless the error
    has its own.

    Attributes:
        changes: Place of each change, (line, column, end line, end column), and the new nodes.
    """

    _METHODS = frozenset({
        *("capitalize", "center", "count", "expandtabs", "find", "index", "ljust", "lower"),
        *("lstrip", "replace", "rfind", "rindex", "rjust", "rstrip", "split", "strip"),
        *("swapcase", "translate", "upper", "zfill"),
    })  # fmt: skip
    _CONVERSIONS: ClassVar = {"atof": "float", "atoi": "int", "atol": "int"}

    _COMPARE: Final = "lambda a, b: (a > b) - (a < b)"
    _MESSAGE: Final = "getattr({0}, 'message', {0}.args[0] if len({0}.args) == 1 else '')"

    def __init__(self, tree: ast.AST) -> None:
        self.changes: list[tuple[tuple[int, int, int, int], list[ast.AST]]] = []
        self._caught: list[str | None] = []  # names of the errors of the handlers around
        self._read = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        self._own = {
            getattr(n, "id", getattr(n, "name", getattr(n, "arg", "")))
            for n in ast.walk(tree)
            if isinstance(n, ast.FunctionDef | ast.alias | ast.arg)
            or (isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
        }

    def visit(self, node: ast.AST) -> Any:
        """Visit a node; if it was replaced or changed, add it to `changes`."""
        place: Any = node
        before = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
        known = [each.arg for each in node.keywords] if isinstance(node, ast.Call) else []
        made = super().visit(node)
        changed = made is not node or (
            isinstance(made, ast.Call)
            and (before != ast.unparse(made.func) or known != [each.arg for each in made.keywords])
        )
        if changed:
            span = place.lineno, place.col_offset, place.end_lineno, place.end_col_offset
            self.changes.append((span, made if isinstance(made, list) else [made]))
        return made

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id != "cmp" or "cmp" in self._own or not isinstance(node.ctx, ast.Load):
            return node
        return _at(node, self._COMPARE)

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        call = re.sub(r"\b(imp|importlib)\.", "", ast.unparse(node.value))
        if call == "reload(sys)" or call.startswith("sys.setdefaultencoding("):
            return ast.copy_location(ast.Pass(), node)
        return self.generic_visit(node)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> Any:
        gone = {"types": _TYPES, "collections": _ABSTRACT}.get(node.module or "")
        if gone is None or node.level:
            return node
        star = node.names[0].name == "*"
        if star and node.module == "types":
            wanted = [ast.alias(name) for name in sorted(self._read & set(gone))]
        else:
            wanted = [alias for alias in node.names if alias.name in gone]
        left = node.names if star else [alias for alias in node.names if alias not in wanted]
        if not wanted:
            return node
        made: list[Any] = [ast.ImportFrom(node.module, left, 0)] if left else []
        for alias in wanted:
            name = ast.Name(alias.asname or alias.name, ast.Store())
            made.append(ast.Assign([name], _at(node, _MOVED[f"{node.module}.{alias.name}"])))
        return [ast.fix_missing_locations(ast.copy_location(each, node)) for each in made]

    def visit_ExceptHandler(self, node: ast.ExceptHandler) -> ast.AST:
        self._caught.append(node.name)
        self.generic_visit(node)
        self._caught.pop()
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.value, ast.Name) and isinstance(node.ctx, ast.Load):
            if node.attr == "message" and node.value.id in self._caught:
                return _at(node, self._MESSAGE.format(node.value.id))
            moved = _MOVED.get(f"{node.value.id}.{node.attr}")
            if moved is not None:
                return _at(node, moved)
        return node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        function: Any = node.func
        name = ast.unparse(function)
        word = getattr(function, "attr", name)
        if word in {"sort", "sorted"}:
            if word == "sort" and len(node.args) == 1 and not node.keywords:
                node.keywords = [ast.keyword("cmp", node.args.pop())]
            for keyword in node.keywords:
                if keyword.arg == "cmp":
                    wrap: Any = _at(keyword.value, "__import__('functools').cmp_to_key(None)")
                    wrap.args = [keyword.value]
                    keyword.arg, keyword.value = "key", wrap
            return ast.fix_missing_locations(node)
        if name == "apply" and "apply" not in self._own and node.args:
            node.func, *rest = node.args
            named = [ast.keyword(None, each) for each in rest[1:]]
            node.args = [ast.Starred(each, ast.Load()) for each in rest[:1]]
            node.keywords = [*named, *node.keywords]
            return ast.fix_missing_locations(node)
        if name == "file" and "file" not in self._own:
            function.id = "open"
        if not isinstance(function, ast.Attribute):
            return node
        if isinstance(function.value, ast.Name) and function.value.id == "string" and node.args:
            self._use_method(node, function)
        else:
            self._use_today(node, function, name)
        return node

    def _use_today(self, node: ast.Call, function: ast.Attribute, name: str) -> None:
        """Rename a method, or replace an argument's value, as newer libraries require."""
        if function.attr == "isAlive" and not node.args and "isAlive" not in self._own:
            function.attr = "is_alive"
        elif name == "yaml.load" and len(node.args) == 1 and not node.keywords:
            function.attr = "safe_load"  # since PyYAML 6, `load` requires a loader
        elif function.attr == "set_printoptions":  # NumPy no longer accepts nan as a threshold
            for keyword in node.keywords:
                if ast.unparse(keyword.value) in {"np.nan", "numpy.nan"}:
                    keyword.value = _at(keyword.value, "__import__('sys').maxsize")

    def _use_method(self, node: ast.Call, function: Any) -> None:
        """Turn a call such as `string.split(text)` into `text.split()`."""
        if function.attr in self._METHODS:
            function.value, *node.args = node.args
        elif function.attr in self._CONVERSIONS:
            name = ast.Name(self._CONVERSIONS[function.attr], ast.Load())
            node.func = ast.copy_location(name, function)
        elif function.attr in {"join", "joinfields"}:
            space = ast.copy_location(ast.Constant(" "), function)
            function.value = node.args[1] if len(node.args) > 1 else space
            function.attr, node.args = "join", node.args[:1]


def _at(place: ast.AST, source: str) -> ast.expr:
    """Parse an expression and give it the place of another node."""
    made = ast.parse(source, mode="eval").body
    for node in ast.walk(made):
        ast.copy_location(node, place)
    return made


def _line_map(before: list[str], after: list[str]) -> dict[int, int]:
    """Return number of a converted line -> number of the original line, both from 1."""
    lines: dict[int, int] = {}
    matcher = difflib.SequenceMatcher(None, before, after, autojunk=False)
    for _tag, old, old_end, new, new_end in matcher.get_opcodes():
        last = max(old_end - 1, old - 1, 0)
        for offset in range(new_end - new):
            lines[new + offset + 1] = min(old + offset, last) + 1
    return lines
