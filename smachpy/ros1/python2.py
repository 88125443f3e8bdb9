"""Python 2 source as Python 3 code, in memory: the file stays as it is, lines keep their numbers.

fissix, a maintained fork of lib2to3, does the rewriting. What it cannot know stays Python 3's
meaning: `/` between whole numbers gives a fraction, strings are text.
"""

from __future__ import annotations

import ast
import difflib
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actionlib_core.exceptions import ActionlibError

if TYPE_CHECKING:
    from types import CodeType

# Rewriting for looks, and implicit relative imports, which the import hook finds (`hook`).
_NOT_WANTED: Final = frozenset({"buffer", "idioms", "import", "set_literal", "ws_comma", "apply"})
# For source that is Python 3 by its grammar: names that are gone.
_NAMES: Final = (
    *("basestring", "dict", "execfile", "getcwdu", "has_key", "imports", "itertools", "long"),
    *("next", "raw_input", "reduce", "reload", "standarderror", "types", "unicode", "urllib"),
    *("xrange",),
)
_GONE: Final = re.compile(
    r"\b(basestring|execfile|getcwdu|has_key|iteritems|iterkeys|itervalues|raw_input|unicode"
    r"|xrange|unichr|viewitems|viewkeys|viewvalues|StandardError|izip|imap|ifilter"
    r"|string\.(atof|atoi|atol|find|rfind|join|lower|replace|split|strip|upper)"
    r"|Queue|ConfigParser|cPickle|StringIO|urllib2|Tkinter|tkMessageBox|thread|commands|setdefaultencoding)\b"
    r"|(?<!\.)\b(cmp|long|reduce|reload)\s*\(|\.next\(\)"
)
_INDENT: Final = re.compile(r"^[ ]*\t[ \t]*", re.MULTILINE)
_CODING: Final = re.compile(rb"^[ \t\f]*#.*?coding[:=][ \t]*([-\w.]+)")


class Python2Error(ActionlibError, SyntaxError):
    """A source is neither Python 3 nor Python 2.

    Attributes:
        filename: The file.
        lineno: The line that Python 2's grammar does not allow.
    """

    def __init__(self, filename: str, lineno: int, problem: str) -> None:
        super().__init__(f"{filename}:{lineno}: {problem}")
        self.filename, self.lineno, self.msg = filename, lineno, problem


def to_code(source: bytes, filename: str) -> CodeType:
    """Compile a source, converted from Python 2 if need be; lines are those of the file.

    Raises:
        SyntaxError: it is Python in neither version; of the version that it looks like.
        MissingExtraError: it is Python 2, and what converts it is not installed.
    """
    code: CodeType = compile(to_tree(source, filename), filename, "exec", dont_inherit=True)
    return code


def to_tree(source: bytes, filename: str) -> ast.Module:
    """Parse a source; as `to_code`."""
    text = read(source)
    try:
        tree = ast.parse(text, filename)
    except SyntaxError as error:
        return _convert(straight(text), filename, error)
    if _GONE.search(text):
        return _parse_as(text, convert(text, _NAMES), filename)
    return tree


def read(source: bytes) -> str:
    """Return the text of a source in the encoding that it declares, with plain line ends."""
    encoding = "utf-8-sig"
    for line in source.splitlines()[:2]:
        match = _CODING.match(line)
        if match:
            encoding = match[1].decode()
            encoding = "utf-8-sig" if encoding.lower().replace("_", "-") == "utf-8" else encoding
    try:
        text = source.decode(encoding)
    except (UnicodeDecodeError, LookupError):
        text = source.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def straight(text: str) -> str:
    """Indent with spaces only: Python 2 took a tab for the way to the next multiple of eight."""
    return _INDENT.sub(lambda match: match[0].expandtabs(8), text)


def _convert(text: str, filename: str, error: SyntaxError) -> ast.Module:
    """Parse what is no Python 3 as it stands: with spaces for tabs, or as Python 2."""
    try:
        return ast.parse(text, filename)
    except SyntaxError:
        pass
    try:
        converted = convert(text)
    except SyntaxError:
        raise error from None
    return _parse_as(text, converted, filename)


def convert(text: str, names: tuple[str, ...] | None = None) -> str:
    """Return Python 2 source as Python 3 source.

    Args:
        text: The source, without tabs in its indents.
        names: Only these fixers, for source that parses as Python 3.

    Raises:
        Python2Error: it is no Python 2.
        MissingExtraError: fissix is not installed.
    """
    ended = text if text.endswith("\n") else f"{text}\n"
    tool, parse_error = _tool(names)
    try:
        return str(tool.refactor_string(ended, "<old source>"))
    except parse_error as error:
        context: Any = getattr(error, "context", None)
        line = context[1][0] if context else 0
        raise Python2Error("<old source>", line, f"no Python 2 either: {error}") from error


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
    tool.log_error = _raise_on  # it would log what is no Python 2, and return None
    return tool, (parse.ParseError, tokenize.TokenError)  # type: ignore[return-value]


def _parse_as(text: str, converted: str, filename: str) -> ast.Module:
    """Parse the converted source, with the lines of the original in every node."""
    tree = ast.parse(converted, filename)
    if any(word in text for word in ("string", "setdefaultencoding", "cmp")):
        tree = _GoneFunctions(tree).visit(tree)
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


def _raise_on(*_args: Any, **_kwargs: Any) -> None:
    """Raise what the caller has just caught."""
    raise  # noqa: PLE0704  called where it was caught


class _GoneFunctions(ast.NodeTransformer):
    """Calls methods of text in place of the functions that the module `string` had.

    `reload(sys); sys.setdefaultencoding("utf-8")` does nothing: text has no encoding any more.
    `cmp` is there unless the module has one, also as an argument of `sorted` and `sort`.
    """

    _METHODS = frozenset({
        *("capitalize", "center", "count", "expandtabs", "find", "index", "ljust", "lower"),
        *("lstrip", "replace", "rfind", "rindex", "rjust", "rstrip", "split", "strip"),
        *("swapcase", "translate", "upper", "zfill"),
    })  # fmt: skip
    _CONVERSIONS: ClassVar = {"atof": "float", "atoi": "int", "atol": "int"}

    _COMPARE: Final = "lambda a, b: (a > b) - (a < b)"

    def __init__(self, tree: ast.AST) -> None:
        self._own = {
            getattr(n, "id", getattr(n, "name", getattr(n, "arg", "")))
            for n in ast.walk(tree)
            if isinstance(n, ast.FunctionDef | ast.alias | ast.arg)
            or (isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
        }

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id != "cmp" or "cmp" in self._own or not isinstance(node.ctx, ast.Load):
            return node
        return _at(node, self._COMPARE)

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        call = re.sub(r"\b(imp|importlib)\.", "", ast.unparse(node.value))
        if call == "reload(sys)" or call.startswith("sys.setdefaultencoding("):
            return ast.copy_location(ast.Pass(), node)
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        if ast.unparse(node.func).rpartition(".")[2] in {"sort", "sorted"}:
            for keyword in node.keywords:
                if keyword.arg == "cmp":
                    wrap: Any = _at(keyword.value, "__import__('functools').cmp_to_key(None)")
                    wrap.args = [keyword.value]
                    keyword.arg, keyword.value = "key", wrap
            return node
        function: Any = node.func
        if not (isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name)):
            return node
        if function.value.id != "string" or not node.args:
            return node
        if function.attr in self._METHODS:
            function.value, *node.args = node.args
        elif function.attr in self._CONVERSIONS:
            name = ast.Name(self._CONVERSIONS[function.attr], ast.Load())
            node.func = ast.copy_location(name, function)
        elif function.attr in {"join", "joinfields"}:
            space = ast.copy_location(ast.Constant(" "), function)
            function.value = node.args[1] if len(node.args) > 1 else space
            function.attr, node.args = "join", node.args[:1]
        return node


def _at(place: ast.expr, source: str) -> ast.expr:
    """Parse an expression and give all of it the lines of another one."""
    made = ast.parse(source, mode="eval").body
    for node in ast.walk(made):
        ast.copy_location(node, place)
    return made


def _line_map(before: list[str], after: list[str]) -> dict[int, int]:
    """Return converted line -> original line, both from 1."""
    lines: dict[int, int] = {}
    matcher = difflib.SequenceMatcher(None, before, after, autojunk=False)
    for _tag, old, old_end, new, new_end in matcher.get_opcodes():
        last = max(old_end - 1, old - 1, 0)
        for offset in range(new_end - new):
            lines[new + offset + 1] = min(old + offset, last) + 1
    return lines
