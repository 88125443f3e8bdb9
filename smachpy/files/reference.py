"""What a mission file names of code: nothing of it is imported before the machine runs."""

from __future__ import annotations

import contextlib
import copy
import importlib
import importlib.util
import inspect
import sys
from dataclasses import dataclass, field, replace
from functools import cache, partial
from importlib.machinery import PathFinder
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, NoReturn

from smachpy.base.problems import unknown_name
from smachpy.engine.options import NAMES
from smachpy.engine.threads import OBSERVERS
from smachpy.exceptions import MissionError, SmachError, error_text
from smachpy.files.source import names_in
from smachpy.machines.container import Container
from smachpy.machines.state import FunctionState, State, set_options

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from smachpy.engine.options import Options
    from smachpy.events.introspection import Kind

GROUP: Final = "smachpy.states"


@dataclass(frozen=True, slots=True)
class Origin:
    """How a file names a state, so that it can be written again.

    Attributes:
        kind: "state", "mission" or "plan".
        name: The name in the file.
        arguments: The mapping `with`, as in the file.
        options: The options, as in the file.
        keys: The outcomes and keys that the file declares.
        loaded: All options of the state as it was loaded; the program may have set others since.
    """

    kind: str
    name: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    keys: Mapping[str, Sequence[str]] = field(default_factory=dict)
    loaded: Options | None = None


@dataclass(frozen=True, slots=True)
class Naming:
    """Where a file names something, and whose code it may use.

    Attributes:
        where: "patrol.yaml:12:5: states.DRIVE" for errors.
        folder: The mission's own folder.
        allow: Packages whose code it may use besides that.
    """

    where: str
    folder: Path
    allow: tuple[str, ...] = ()


class Reference(State):
    """Stands for a state until the machine runs: `module:Name` in a mission file."""

    _smachpy_kind: ClassVar[Kind] = "state"

    def __init__(
        self,
        name: str,
        make: Callable[[], State],
        outcomes: Sequence[str],
        input_keys: Sequence[str],
        output_keys: Sequence[str],
        options: Mapping[str, Any],
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys, **options)
        self.name = name
        self.make = make

    def execute(self, ud: Any) -> str:  # noqa: ARG002  the state's interface
        """Raise: `resolve` has not replaced it."""
        raise MissionError(f"{self.name} was not imported; expected smachpy.files.resolve before.")

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the name of the code."""
        kind, details = super().describe_details()
        return kind, (*details, ("code", self.name))


class ResolveError(MissionError):
    """Code that a mission file names cannot be used; all problems at once.

    Try: correct the name or the module at the line that is shown.

    Attributes:
        problems: Them, as texts with file and line.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(problems))


def resolve(machine: Container) -> Container:
    """Import the code that the mission's file names, and put the states in their places.

    The start of a run does it too. It does nothing for a machine that comes from no file.

    Raises:
        ResolveError: something cannot be imported, or is no state that fits; nothing was replaced.
    """
    problems: list[str] = []
    made: list[tuple[Container, str, State]] = []
    for container, label, reference in _references(machine):
        try:
            state = reference.make()
            _set_since(state, container.get_children()[label], reference)
        except SmachError as error:
            problems.append(str(error))
            continue
        made.append((container, label, state))
    if problems:
        raise ResolveError(problems)
    before = [(container, label, container.get_children()[label]) for container, label, _ in made]
    for container, label, state in made:
        container._smachpy_exchange(label, state)
    for inner in {id(container): container for container, _, _ in made}.values():
        problems += inner._smachpy_problems(inner.name or "")
    if problems:
        for container, label, state in before:
            container._smachpy_exchange(label, state)
        raise ResolveError(problems)
    return machine


def _set_since(state: State, stand_in: State, reference: Any) -> None:
    """Set the options that the program has set since the file was loaded."""
    then = getattr(reference, "origin", stand_in._smachpy.made_from).loaded
    now = stand_in._smachpy.options
    new = {name: getattr(now, name) for name in NAMES if getattr(now, name) != getattr(then, name)}
    set_options(state, **new)


def _references(container: Container) -> Iterator[tuple[Container, str, Any]]:
    for label, child in container.get_children().items():
        if isinstance(child, Container) and not hasattr(child._smachpy.made_from, "make"):
            yield from _references(child)
        elif isinstance(child, Reference):
            yield container, label, child
        elif hasattr(child._smachpy.made_from, "make"):
            yield container, label, child._smachpy.made_from


def _resolve_at_start(root: Any) -> None:
    if isinstance(root, Container):
        resolve(root)


OBSERVERS.append(_resolve_at_start)


# -- registered names --------------------------------------------------------------------------


def registered() -> dict[str, Callable[[], Any]]:
    """Return name -> function that loads what makes the state: ours, and the entry points."""
    from smachpy.states.by_name import BY_NAME

    found: dict[str, Callable[[], Any]] = {point.name: point.load for point in _points()}
    for name, function in BY_NAME.items():
        found[name] = partial(_same, function)
    return found


@cache
def _points() -> tuple[Any, ...]:
    from importlib.metadata import entry_points

    return tuple(entry_points(group=GROUP))  # it reads a file of each installed package


def _same(thing: Any) -> Any:
    return thing


def make_registered(name: str, arguments: Mapping[str, Any], place: Naming) -> State:
    """Return a registered state.

    Raises:
        MissionError: there is none of this name, or an argument is wrong.
    """
    from smachpy.states.by_name import BY_NAME

    if name in BY_NAME:  # without a look at the installed packages
        return _called(BY_NAME[name], name, arguments, place)
    known = registered()
    if name not in known:
        text = unknown_name("state", name, sorted(known))
        raise MissionError(f"{text} Or module:Name for your own; 'smachpy states list' shows all.")
    return _called(known[name](), name, arguments, place)


def make_named(text: str, arguments: Mapping[str, Any], place: Naming) -> State:
    """Import `module:Name` and return the state that it is, or makes.

    Raises:
        MissionError: it may not be imported, does not exist, or makes no state.
    """
    return _called(named_thing(text, place), text, arguments, place)


def named_thing(text: str, place: Naming) -> Any:
    """Import `module:Name` and return what that is.

    Raises:
        MissionError: it may not be imported, or does not exist.
    """
    check_named(text, {}, place)
    module, _, name = text.partition(":")
    thing: Any = _import(module, place)
    for part in name.split("."):
        if part.startswith("__") or not hasattr(thing, part):
            near = [known for known in dir(thing) if not known.startswith("_")]
            raise MissionError(f"{place.where}: {unknown_name(f'name in {module}', part, near)}")
        thing = getattr(thing, part)
        _check_origin(thing, place)
    return thing


def _check_origin(thing: Any, place: Naming) -> None:
    """Refuse what an allowed module has only imported: `my_states:os.system`.

    Raises:
        MissionError: it is of a module that is not allowed.
    """
    while isinstance(thing, partial):
        thing = thing.func
    if inspect.ismodule(thing):
        check_allowed(thing.__name__, place)
    elif inspect.isclass(thing) or inspect.isroutine(thing):
        check_allowed(getattr(thing, "__module__", None) or "builtins", place)
    elif callable(thing) and not isinstance(thing, State):
        check_allowed(type(thing).__module__, place)


def check_named(text: str, arguments: Mapping[str, Any], place: Naming) -> None:
    """Refuse `module:Name` as far as the source of the module says; nothing is imported.

    Args:
        text: It.
        arguments: What it is called with; none are checked if there are none.
        place: Where it is named.

    Raises:
        MissionError: it may not be imported, is not defined there, or takes no such argument.
    """
    module, _, name = text.partition(":")
    check_allowed(module, place)
    first = name.partition(".")[0]
    if not all(part.isidentifier() for part in name.split(".")):
        raise MissionError(f"{place.where}: got {text!r}; expected module:Name.")
    file = file_of(module, place.folder) or _installed(module, place)
    if file is None:
        return
    try:
        names = names_in(file)
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError) as error:
        problem = f"{place.where}: got {module!r}, which is no Python: {error_text(error)}"
        raise MissionError(problem) from error
    if names is None:  # it can have names that its source does not show
        return
    if first not in names:
        near = [known for known in names if not known.startswith("_")]
        raise MissionError(f"{place.where}: {unknown_name(f'name in {module}', first, near)}")
    found = names[first]
    if isinstance(found, str):
        check_allowed(found, place)
    elif first == name and arguments and found is not None:
        for argument in arguments:
            if argument not in found:
                problem = unknown_name(text, argument, list(found))
                raise MissionError(f"{place.where}: with: {problem}")


def _installed(module: str, place: Naming) -> Path | None:
    """Return the file of a module of an allowed package; None if it has no source.

    Raises:
        MissionError: there is no such module.
    """
    top, *below = module.split(".")
    try:
        spec = importlib.util.find_spec(top)
        name = top
        for part in below:  # not `find_spec(module)`, which imports what the module is in
            name = f"{name}.{part}"
            folders = None if spec is None else spec.submodule_search_locations
            spec = PathFinder.find_spec(name, folders) if folders else None
    except (ImportError, ValueError):  # such as `__main__`, which has none
        return None
    if spec is None:
        raise MissionError(f"{place.where}: got {module!r}, which is not installed.")
    path = Path(spec.origin or "")
    return path if path.suffix == ".py" and path.is_file() else None


def check_allowed(module: str, place: Naming) -> None:
    """Refuse a module outside of the mission's folder and of the allowed packages.

    Raises:
        MissionError: it is.
    """
    inside = file_of(module, place.folder) is not None
    if inside or any(f"{module}.".startswith(f"{allowed}.") for allowed in place.allow):
        return
    top = module.partition(".")[0]
    hint = f" Try --allow {top} if you trust that package." if top else ""
    raise MissionError(
        f"{place.where}: got {module!r}, which is not in {str(place.folder)!r}; expected a module "
        f"there.{hint}"
    )


def file_of(module: str, folder: Path) -> Path | None:
    """Return the file of a module in a folder, or None."""
    parts = module.split(".")
    if not all(part.isidentifier() for part in parts):
        return None
    path = folder.joinpath(*parts)
    with contextlib.suppress(OSError):  # a name that is too long
        for file in (path.with_suffix(".py"), path / "__init__.py"):
            if file.is_file() and file.resolve().is_relative_to(folder.resolve()):
                return file.resolve()
    return None


def _import(name: str, place: Naming) -> Any:
    file = file_of(name, place.folder)
    folder = place.folder.resolve()
    with contextlib.ExitStack() as stack:
        if file is not None:  # code of an allowed package must not find that of the folder instead
            sys.path.insert(0, str(folder))
            stack.callback(_take_off_path, str(folder))
            # The package around it may be another one of that name, whose code is not allowed.
            top = importlib.util.find_spec(name.partition(".")[0])
            around = [] if top is None else [top.origin, *(top.submodule_search_locations or ())]
            if not any(one and Path(one).resolve().is_relative_to(folder) for one in around):
                _refuse_other(name, around[0] if around else None, file, place)
        try:
            module = importlib.import_module(name)
        except Exception as error:
            raise MissionError(
                f"{place.where}: importing {name!r} raised {error_text(error)}"
            ) from error
    found = getattr(module, "__file__", None)
    if file is not None and (found is None or Path(found).resolve() != file):
        _refuse_other(name, found, file, place)
    return module


def _take_off_path(folder: str) -> None:
    with contextlib.suppress(ValueError):  # its code may have changed the path
        sys.path.remove(folder)


def _refuse_other(name: str, found: str | None, file: Path, place: Naming) -> NoReturn:
    raise MissionError(
        f"{place.where}: got {name!r}, which is {found} already; expected {file}. Try another "
        "name for the file."
    )


def _called(thing: Any, name: str, arguments: Mapping[str, Any], place: Naming) -> State:
    if isinstance(thing, State) and not arguments:
        return copy.copy(thing) if isinstance(thing, FunctionState) else thing
    if isinstance(thing, State) or not callable(thing):
        raise MissionError(
            f"{place.where}: got {name!r} with arguments; expected none, it is ready."
        )
    known, hints = _parameters(thing), getattr(thing, "__annotations__", {})
    for argument, value in arguments.items():
        if known is None:
            break
        if argument not in known:
            raise MissionError(f"{place.where}: with: {unknown_name(name, argument, known)}")
        wants_text = hints.get(argument) in {"str", "str | None"}
        if wants_text and not isinstance(value, str | None):
            what = f"with: {argument}: got {value!r}; expected a text."
            raise MissionError(f"{place.where}: {what}")
    try:
        state = thing(**arguments)
    except Exception as error:
        raise MissionError(f"{place.where}: {name}: {error_text(error)}") from error
    if not isinstance(state, State):
        raise MissionError(f"{place.where}: {name} made {state!r}; expected a state.")
    return state


def _parameters(thing: Any) -> list[str] | None:
    """Return the names of the parameters of a function or class; None if it takes any."""
    try:
        found = inspect.signature(thing).parameters.values()
    except (TypeError, ValueError):
        return None
    return (
        None if any(one.kind is one.VAR_KEYWORD for one in found) else [one.name for one in found]
    )


def finish(state: State, origin: Origin, options: Mapping[str, Any], place: Naming) -> State:
    """Set the options of a state that a file names, and note where it comes from.

    Raises:
        MissionError: an option is wrong.
    """
    if options:
        try:
            set_options(state, **options)
        except SmachError as error:
            raise MissionError(f"{place.where}: {error}") from error
    missing = [
        name for name in origin.keys.get("outcomes", ()) if name not in state._smachpy.outcomes
    ]
    if missing:
        problem = unknown_name("outcome", missing[0], state._smachpy.outcomes)
        raise MissionError(f"{place.where}: {origin.name}: {problem}")
    state._smachpy.made_from = replace(origin, loaded=state._smachpy.options)
    return state
