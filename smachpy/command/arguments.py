"""Fills the parameters of a mission's function from a command line.

    def gotopose(robot: str, x: float, y: float, theta: float = 0.0) -> StateMachine: ...

    smachpy run rp_action.gotopose -- robot_0 10 2 0
    smachpy run rp_action.gotopose -- robot_0 10 2 --theta=1.57
    smachpy run rp_action.gotopose --input robot=robot_0 --input x=10 --input y=2

The annotations give the types; the first line and the `Args:` of the docstring are the help.
"""

from __future__ import annotations

import contextlib
import datetime as dt
import enum
import inspect
import logging
import math
import re
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import (
    TYPE_CHECKING,
    Any,
    Final,
    Literal,
    NewType,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
    is_typeddict,
)

from actionlib_core.config import LARGEST_SECRET
from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.inputs.suggest import did_you_mean, nearest
from actionlib_core.inputs.yaml_text import YamlTextError, load_yaml
from actionlib_core.names import is_rule
from smachpy.exceptions import MissionError
from smachpy.machines.container import Container
from smachpy.userdata.secret import MASK, Secret, holds_secret, is_secret_name, masked

if TYPE_CHECKING:
    from smachpy.command.targets import Target

logger = logging.getLogger(__name__)

NO_DEFAULT: Final = inspect.Parameter.empty
_OPTION = re.compile(r"--?[^\W\d]")  # a letter of any script, or the underscore of `_name`
_DOC = re.compile(r"(?P<name>\w+): (?P<text>.*)")
_HELP = frozenset({"-h", "--help"})
_LISTS = (list, tuple, Sequence)
_WORDS: Final[dict[object, str]] = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "text",
    Path: "a path",
    dict: "a dictionary",
    Mapping: "a dictionary",
    dt.date: "a date",
    dt.datetime: "a date and time",
    type(None): "null",
    Secret: "a secret, as @FILE",
    Any: "a value in YAML",
}


class Text(str):
    """A value as typed; its meaning depends on the parameter."""

    __slots__ = ()


class MisfitError(ValueError):
    """A value does not fit a parameter; the text says what was expected."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a mission's function.

    Attributes:
        name: The name in Python.
        hint: Its type; `Any` without an annotation.
        default: `NO_DEFAULT` if it is required.
        text: Its text in the docstring.
        rest: It takes all remaining words: a list that is the last positional parameter.
        named: It is keyword-only.
        secret: Its values are shown nowhere; `@FILE` reads one from a file.
    """

    name: str
    hint: Any
    default: object = NO_DEFAULT
    text: str = ""
    rest: bool = False
    named: bool = False
    secret: bool = False

    @property
    def required(self) -> bool:
        """Whether it has no default."""
        return self.default is NO_DEFAULT

    def shown(self) -> str:
        """Return its form in a usage line."""
        if self.named:
            name = self.name.replace("_", "-")
            # The usage shows only the flag that changes the default.
            flags = {False: f"--{name}", True: f"--no-{name}"}
            known = isinstance(self.default, bool)
            word = flags[bool(self.default)] if known else f"--{name} VALUE"
        else:
            word = self.name.upper()
        word += "..." if self.rest else ""
        return word if self.required else f"[{word}]"


# -- types -----------------------------------------------------------------------------------------


def fit(value: object, hint: Any) -> Any:
    """Return `value` converted for a parameter of type `hint`.

    Args:
        value: A Python value, or a `Text`.
        hint: A type, a union, `Literal`, an enumeration, a list of any of them, or `Any`.

    Raises:
        MisfitError: it cannot be converted.
    """
    kinds = _alternatives(hint)
    if isinstance(value, Text):
        return _read(value, kinds)
    for kind in kinds:
        if _is_a(value, kind):
            return value
    for kind in kinds:
        converted = _convert(value, kind)
        if converted is not None:
            return converted
    raise MisfitError(expectation(hint))


def expectation(hint: Any) -> str:
    """Return the type of a parameter in words."""
    kinds = _alternatives(hint)
    return " or ".join(_kind_in_words(k) for k in kinds if not (k is int and float in kinds))


def _kind_in_words(kind: Any) -> str:
    choices = _choices(kind)
    if choices:
        return f"one of {list(choices)}"
    if _is_list(kind):
        items = _items(kind)
        if isinstance(items, tuple):
            return f"a list of {len(items)}: {', '.join(map(expectation, items))}"
        return "a list" if items is Any else f"a list, each {expectation(items)}"
    name = getattr(kind, "__name__", kind)
    known = _WORDS.get(get_origin(kind) or kind)
    return known or f"{name} (cannot be typed on a command line)"


def _alternatives(hint: Any) -> tuple[Any, ...]:
    if get_origin(hint) in {Union, types.UnionType}:
        return tuple(kind for part in get_args(hint) for kind in _alternatives(part))
    if hint is NO_DEFAULT or hint is object or isinstance(hint, TypeVar):
        return (Any,)
    if isinstance(hint, NewType):
        return _alternatives(hint.__supertype__)
    if is_typeddict(hint):
        return (dict,)
    return (hint,)


def _choices(kind: Any) -> dict[str, Any]:
    """Return the words for a `Literal` or an enumeration, with their values."""
    if get_origin(kind) is Literal:
        return {str(choice): choice for choice in get_args(kind)}
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return {member.name: member for member in kind}
    return {}


def _is_list(kind: Any) -> bool:
    return (get_origin(kind) or kind) in _LISTS


def _items(kind: Any) -> Any:
    """Return the type of a list's items; of a tuple of a given length, the tuple of their types."""
    arguments = get_args(kind)
    if (get_origin(kind) or kind) is tuple and arguments and arguments[-1] is not ...:
        return arguments
    return arguments[0] if arguments else Any


def _read(text: Text, kinds: tuple[Any, ...]) -> Any:
    """Return a typed word as one of `kinds`.

    In this order: a choice, the YAML value if its type fits as it is, text or a path, a
    conversion. Text comes after the YAML types, so that `x: int | str` reads "3" as a number.
    """
    for kind in kinds:
        choices = _choices(kind)
        if text in choices:
            return choices[text]
    value = _yaml(text)
    for kind in kinds:
        if kind not in {str, Path, Secret} and (_is_a(value, kind) or kind is Any):
            return value
    for kind in kinds:
        if kind in {str, Path, Secret}:
            return kind(str(text))
        converted = _convert(value, kind, text)
        if converted is not None:
            return converted
    raise MisfitError(expectation(Union[kinds]))  # noqa: UP007  made of a tuple


def _yaml(text: Text) -> object:
    try:
        return load_yaml(str(text))
    except YamlTextError:  # `2026-13-01`, for example, looks like a date but is none
        return str(text)


def _is_a(value: object, kind: Any) -> bool:
    """Return whether a value needs no conversion."""
    if kind is Any:
        return True
    if kind is float:
        return isinstance(value, float) and math.isfinite(value)
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool)
    if get_origin(kind) is not None or _is_list(kind):
        origin = get_origin(kind)
        return origin in {dict, Mapping} and isinstance(value, Mapping)
    try:
        return isinstance(kind, type) and isinstance(value, kind)
    except TypeError:  # a protocol that is not `runtime_checkable`
        return False


def _convert(value: object, kind: Any, text: Text | None = None) -> Any:
    """Return a value converted to `kind`; None if that is impossible."""
    choices = _choices(kind)
    if choices:
        return choices.get(str(value))
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        with contextlib.suppress(OverflowError):
            return float(value)
    if kind is str and isinstance(value, int | float | PurePath):
        return str(value)
    if kind is Path and isinstance(value, str | PurePath):
        return Path(value)
    if _is_list(kind) and not isinstance(value, Mapping):
        return _convert_list(value, kind, text)
    return None


def _convert_list(value: object, kind: Any, text: Text | None) -> Any:
    items = _items(kind)
    if not isinstance(value, list | tuple):
        value = [value if text is None else text]
    hints = items if isinstance(items, tuple) else (items,) * len(value)
    if len(hints) != len(value):
        return None
    try:
        made = [fit(one, hint) for one, hint in zip(value, hints, strict=True)]
    except MisfitError:
        return None
    return tuple(made) if (get_origin(kind) or kind) is tuple else made


# -- a function's parameters -----------------------------------------------------------------------


def parameters_of(thing: object) -> dict[str, Parameter]:
    """Return the parameters of a mission's function, by name; a finished machine has none."""
    if isinstance(thing, Container) or not callable(thing):
        return {}
    found = [
        parameter
        for parameter in inspect.signature(thing).parameters.values()
        if parameter.kind in {parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY}
    ]
    places = [p.name for p in found if p.kind is p.POSITIONAL_OR_KEYWORD]
    texts = _texts(thing)
    made = {}
    for parameter in found:
        hint = _hint(thing, parameter)
        made[parameter.name] = Parameter(
            name=parameter.name,
            hint=hint,
            default=parameter.default,
            text=texts.get(parameter.name, ""),
            rest=places[-1:] == [parameter.name] and any(map(_is_list, _alternatives(hint))),
            named=parameter.kind is parameter.KEYWORD_ONLY,
            secret=Secret in _alternatives(hint) or is_secret_name(parameter.name),
        )
    return made


def _hint(thing: Callable[..., object], parameter: inspect.Parameter) -> Any:
    """Return a parameter's type: its annotation, else that of its default."""
    annotation = parameter.annotation
    if annotation is NO_DEFAULT:
        default = parameter.default
        if isinstance(default, int | float) and not isinstance(default, bool):
            return int | float
        return type(default) if isinstance(default, bool | str) else Any
    holder = types.SimpleNamespace(__annotations__={"it": annotation})
    names = getattr(inspect.unwrap(thing), "__globals__", {})
    try:
        return get_type_hints(holder, globalns=names)["it"]
    except (NameError, TypeError, SyntaxError):  # a name imported under TYPE_CHECKING only
        return Any


def _texts(thing: object) -> dict[str, str]:
    """Return the texts of a docstring's `Args:` section, by name."""
    _, _, section = (inspect.getdoc(thing) or "").partition("\nArgs:\n")
    texts: dict[str, str] = {}
    name = ""
    for line in section.splitlines():
        if not line.startswith("    "):
            break
        start = _DOC.fullmatch(line.removeprefix("    "))
        if start is not None:
            name = start["name"]
            texts[name] = start["text"]
        elif name:
            texts[name] += f" {line.strip()}"
    return texts


# -- secrets ---------------------------------------------------------------------------------------


def read_secret(text: Text, where: str, *, kept: bool) -> Text:
    """Return a secret that was given as text: what `@FILE` has in its first line, or the text.

    Args:
        text: As given; "@@x" stands for "@x". A secret in clear is logged as a warning.
        where: What it was given as.
        kept: Whether the text is kept, and so must name a file, by its absolute path.

    Raises:
        MisfitError: the file cannot be read, or the secret itself was given.
    """
    if text.startswith("@@"):
        text = Text(text[1:])
    elif text.startswith("@"):
        if kept and not Path(text[1:]).is_absolute():
            raise MisfitError("@FILE with its whole path, as other processes read it")
        try:
            lines = read_limited(Path(text[1:]), LARGEST_SECRET).decode("utf-8").splitlines()
            return Text(lines[0])
        except (OSError, IndexError, ValueError) as error:
            raise MisfitError(f"@FILE with a first line ({error})") from error
    if kept:
        raise MisfitError(
            "@FILE, with the secret in its first line: journals and queues keep arguments"
        )
    logger.warning("%s: got the secret itself; `ps` shows it to all users. Try @FILE.", where)
    return text


def check_kept(value: object) -> None:
    """Check that there is no secret inside a typed value, or a list of them, that is kept.

    Raises:
        MisfitError: there is one.
    """
    texts = value if isinstance(value, list) else [value]
    if any(isinstance(text, Text) and holds_secret(text) for text in texts):
        raise MisfitError(
            "no secret in it: journals and queues keep arguments. Try a parameter of its own for "
            "the secret, with a smachpy.Secret, as @FILE"
        )


# -- the words after `--` --------------------------------------------------------------------------


def wants_help(words: Sequence[str]) -> bool:
    """Return whether the words after `--` ask for help about themselves."""
    return not _HELP.isdisjoint(words)


def usage(target: Target) -> str:
    """Return a mission's help: usage, summary and parameters."""
    parameters = list(parameters_of(target.thing).values())
    lines = [usage_line(target, parameters), ""]
    if target.summary:
        lines += [target.summary, ""]
    width = max((len(parameter.shown()) for parameter in parameters), default=0)
    for parameter in parameters:
        words = expectation(parameter.hint)
        if not parameter.required:
            default = masked(parameter.default, parameter.name)
            words += f", {default} when not given"
        text = f"{parameter.text.rstrip('.')} ({words})" if parameter.text else words
        lines.append(f"  {parameter.shown():{width}}  {text}")
    if parameters:
        lines += ["", "Each may be given by name too: --NAME VALUE, or --input NAME=VALUE."]
    else:
        lines.append("It takes no arguments.")
    return "\n".join(lines)


def usage_line(target: Target, parameters: Sequence[Parameter]) -> str:
    """Return the usage line of a mission."""
    words = " ".join(parameter.shown() for parameter in parameters)
    return f"usage: smachpy run {target.name} [OPTIONS]{' -- ' if words else ''}{words}"


def read_words(
    target: Target, words: Sequence[str], given: Mapping[str, object], *, kept: bool = False
) -> dict[str, object]:
    """Return the arguments of a mission's function.

    Args:
        target: The mission.
        words: The words after `--`: values in the order of the parameters, `--name VALUE`,
            `--name=VALUE`; `--flag` and `--no-flag` for a bool.
        given: Values that were already given by name (`--input`).
        kept: The words are kept in a journal or queue: secrets must be given as @FILE.

    Raises:
        MissionError: words are superfluous, unknown, missing or do not fit; all are listed.
    """
    parameters = parameters_of(target.thing)
    reader = _WordBinder(parameters, given, kept=kept)
    reader.read(list(words))
    if reader.problems:
        line = usage_line(target, list(parameters.values()))
        problems = "\n".join(reader.problems)
        raise MissionError(f"mission {target.name!r}: {problems}\n{line}")
    return reader.values


class _WordBinder:
    """Fills parameters from words."""

    def __init__(
        self, parameters: Mapping[str, Parameter], given: Mapping[str, object], *, kept: bool
    ) -> None:
        self._kept = kept
        self.values: dict[str, object] = {}
        self.problems: list[str] = []
        self._parameters = parameters
        self._given = {name: value for name, value in given.items() if name in parameters}
        self._others = [name for name in given if name not in parameters]  # keys of the userdata

    def read(self, words: list[str]) -> None:
        places: list[str] = []
        while words:
            word = words.pop(0)
            if word == "--":
                places += words
                break
            if _OPTION.match(word):
                self._take_option(word, words)
            elif is_rule(word):
                self.problems.append(
                    f"got {word!r}, which renames, behind --; expected it before. Try 'smachpy run "
                    f"TARGET {word}', or '-- -- {word}' if it is an argument."
                )
            else:
                places.append(word)
        for name, value in self._given.items():
            self._take(self._parameters[name], value, f"--input {name}")
        self._take_places(places)
        missing = [
            p.name for p in self._parameters.values() if p.required and p.name not in self.values
        ]
        if missing and not self.problems:
            hints = [(one, did_you_mean(one, missing)) for one in self._others]
            slips = "".join(f" Got --input {one}.{hint}" for one, hint in hints if hint)
            self.problems.append(
                f"missing: {', '.join(missing)}; expected a value for each.{slips}"
            )

    def _take_option(self, word: str, words: list[str]) -> None:
        name, equals, value = word.lstrip("-").partition("=")
        name = name.replace("-", "_")
        parameter = self._parameters.get(name)
        if parameter is None and name.startswith("no_") and not equals:
            parameter = self._flag(name.removeprefix("no_"))
            if parameter is not None:
                self._take(parameter, False, word)  # noqa: FBT003  the value itself
                return
        if parameter is None:
            self.problems.append(f"{word}: no such argument; {self._known(name)}")
        elif equals:
            self._take(parameter, Text(value), f"--{name}")
        elif self._flag(name) is not None:
            self._take(parameter, True, word)  # noqa: FBT003  the value itself
        elif words and words[0] != "--" and not _OPTION.match(words[0]):
            self._take(parameter, Text(words.pop(0)), word)
        else:
            wish = expectation(parameter.hint)
            self.problems.append(f"{word}: no value follows; expected {wish}.")
            # Counts as given, so that it is not reported as missing too.
            self.values.setdefault(name, None)

    def _flag(self, name: str) -> Parameter | None:
        parameter = self._parameters.get(name)
        return parameter if parameter and bool in _alternatives(parameter.hint) else None

    def _known(self, name: str) -> str:
        near = nearest(name, self._parameters)
        names = sorted(self._parameters)
        hint = f" Did you mean '--{near[0]}'?" if near else ""
        return f"expected {f'one of {names}' if names else 'none'}.{hint}"

    def _take_places(self, places: list[str]) -> None:
        named = [p.name for p in self._parameters.values() if p.name in self.values and not p.named]
        free = [p for p in self._parameters.values() if p.name not in self.values and not p.named]
        for parameter in free:
            if not places:
                return
            # One word that begins with "[" is a whole list in YAML, not its only item.
            if parameter.rest and (len(places) > 1 or not places[0].startswith("[")):
                self._take(parameter, [Text(word) for word in places], parameter.name)
                return
            self._take(parameter, Text(places.pop(0)), parameter.name)
        if places:
            why = f", as {', '.join(named)} came by name" if named else ""
            self.problems.append(
                f"got {len(places)} more than it takes: {' '.join(places)!r}; expected "
                f"{len(free)}{why}. A text with spaces needs quotes."
            )

    def _take(self, parameter: Parameter, value: object, where: str) -> None:
        if parameter.name in self.values:
            self.problems.append(f"{where}: given twice; expected once.")
            return
        try:
            if parameter.secret and isinstance(value, Text):
                value = read_secret(value, where, kept=self._kept)
            elif self._kept:
                check_kept(value)
            self.values[parameter.name] = fit(value, parameter.hint)
        except MisfitError as error:
            shown = str(value) if isinstance(value, Text) else value
            shown = MASK if parameter.secret or holds_secret(str(value)) else shown
            self.problems.append(f"{where}: got {shown!r}; expected {error}.")
            self.values[parameter.name] = None
