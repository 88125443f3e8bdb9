"""Finds the machine that a user names on a command line: a mission, a module or a file."""

from __future__ import annotations

import ast
import contextlib
import importlib
import importlib.util
import inspect
import re
import sys
import warnings
from dataclasses import dataclass, replace
from importlib.machinery import SourceFileLoader
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionlibError
from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.inputs.suggest import did_you_mean
from smachpy.command.extras import advice
from smachpy.engine.stack_text import trace_of
from smachpy.exceptions import SmachError, error_text
from smachpy.machines.container import Container
from smachpy.machines.mission_info import is_mission, mission, mission_info
from smachpy.machines.state import set_options

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from importlib.metadata import EntryPoint
    from types import CodeType, ModuleType

GROUP = "smachpy.missions"
DEFAULT_NAMES = ("mission", "machine", "sm")
PLANS = (".pnml", ".plan", ".pddlout")
MISSION_FILES = (".yaml", ".yml")
OTHER_TOOLS = (".xml", ".scxml")
DATA = (*PLANS, *MISSION_FILES, *OTHER_TOOLS)
"""Ends of names of files that are data: no code of the file itself is executed."""
# A script that calls `sys.exit()` would end the command, with 0 as if the mission had succeeded.
_FAILURES = (Exception, SystemExit)


def names_file(place: str) -> bool:
    """Return whether a target, without its `:attribute`, names a file rather than a module."""
    return place.endswith((".py", *DATA)) or "/" in place


def is_data(place: str) -> bool:
    """Return whether a target is a file that is never executed: data, or a behaviour of FlexBE."""
    if not place.endswith(".py"):
        return place.endswith(DATA)
    from smachpy.foreign import is_behavior

    return is_behavior(Path(place))


class TargetError(SmachError):
    """The named mission, module or file cannot be loaded.

    Try: `smachpy list` shows the missions; a file or module is named as `FILE.py:FUNCTION`.

    Attributes:
        target: The user's text.
        problem: The reason, and what to try.
    """

    def __init__(self, target: str, problem: str) -> None:
        self.target = target
        self.problem = problem
        super().__init__(f"target {target!r}: {problem}")


@dataclass(frozen=True, slots=True)
class Target:
    """A machine, or the function that makes it.

    Attributes:
        name: Its name in messages and file names.
        source: Where it was found, `module:attribute`.
        summary: First line of its docstring.
        shown_name: Its name for viewers and of recordings, as two machines of one file need two
            names; "" for `name`.
    """

    name: str
    source: str
    summary: str
    thing: Any
    shown_name: str = ""

    def build(self, /, **arguments: object) -> Container:
        """Return the machine; a factory is called with `arguments`.

        Raises:
            TargetError: it takes no such argument, raises an exception of another library, or
                returns something else than a container.
        """
        if isinstance(self.thing, Container):
            if arguments:
                raise TargetError(
                    self.name,
                    f"got arguments {sorted(arguments)}; expected none, {self.source} is a "
                    "finished machine. Try a function that returns one.",
                )
            return self.thing
        self._check_arguments(arguments)
        try:
            machine = self.thing(**arguments)
        except (SmachError, ActionlibError):  # these say themselves which argument was wrong
            raise
        except _FAILURES as error:
            why = advice(error) if isinstance(error, ImportError) else None
            raise TargetError(
                self.name,
                why or f"expected a state machine; {self.source} raised {raised_text(error)}",
            ) from error
        if not isinstance(machine, Container):
            hint = " Try `return` with it at the end." if machine is None else ""
            raise TargetError(
                self.name, f"{self.source} returned {machine!r}; expected a state machine.{hint}"
            )
        success = mission_info(self.thing).success
        if success is not None:
            set_options(machine, success=success)
        return machine

    def _check_arguments(self, arguments: dict[str, object]) -> None:
        signature = inspect.signature(self.thing)
        missing = [
            name
            for name, parameter in signature.parameters.items()
            if parameter.default is parameter.empty
            and parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
        ]
        if missing and not arguments:
            raise TargetError(
                self.name,
                f"{self.source} needs {', '.join(missing)}; expected what needs no arguments. "
                f"Try --input {missing[0]}=VALUE, or a function of your own that calls it with "
                "some.",
            )
        try:
            signature.bind(**arguments)
        except TypeError as error:
            raise TargetError(
                self.name,
                f"{self.source}{signature} cannot be called with {sorted(arguments)}: {error}.",
            ) from error


def list_missions() -> dict[str, str]:
    """Return the missions of all installed packages: name -> summary, in one line.

    They are the entry points `smachpy.missions`. If one cannot be loaded, or if the simulated robot
    that it drives is not installed, its line says so, with what installs that.
    """
    lines = {}
    no_robot = importlib.util.find_spec("scipy") is None
    points = entry_points(group=GROUP)  # it reads a file of each installed package
    for point in sorted(points, key=lambda point: point.name):
        try:
            mission = _load_mission(point.name, points)
            lines[point.name] = mission.summary
            if no_robot and _drives(mission.thing):
                lines[point.name] += " Its simulated robot: pip install 'smachpy[sim]'"
        except TargetError as error:
            lines[point.name] = f"not available: {error.problem.splitlines()[0]}"
    return lines


def _drives(mission: Any) -> bool:
    """Return whether a mission's module uses what the simulated robot offers."""
    names = vars(sys.modules[mission.__module__]) if hasattr(mission, "__module__") else {}
    offered = ("drive_to", "MoveBaseAction", "goal_at", "ChargeAction")
    return mission_info(mission).world is not None or any(name in names for name in offered)


def list_files(folder: Path) -> dict[str, str]:
    """Return the plans and mission files in a folder: name for `smachpy run` -> one line.

    If one cannot be read, its line says why; a YAML file without `states:` is not taken for one.

    Raises:
        TargetError: the folder cannot be read.
    """
    from smachpy.pnp.plan import understand
    from smachpy.pnp.problems import PlanError
    from smachpy.pnp.reading import read_net

    lines: dict[str, str] = {}
    try:
        files = sorted(path for path in folder.iterdir() if path.suffix in DATA and path.is_file())
    except OSError as error:
        raise TargetError(
            str(folder), f"got no list of its files ({error.strerror}); expected a folder."
        ) from error
    for path in files:
        if path.suffix in MISSION_FILES:
            lines |= {str(path): line for line in _mission_line(path, _STATES)}
            continue
        if path.suffix in OTHER_TOOLS:
            lines |= {str(path): line for line in _mission_line(path, _ROOTS)}
            continue
        try:
            plan = understand(read_net(path)[0])
        except PlanError as error:
            lines[str(path)] = f"not available: {str(error).splitlines()[0]}"
        else:
            names = sorted({name.rpartition("#")[2].partition("_")[0] for name in plan.executables})
            lines[str(path)] = f"Petri net plan of {', '.join(names) or 'no actions'}."
    return lines


_STATES = rb"^(\xef\xbb\xbf)?states *:"
_ROOTS = rb"^(\xef\xbb\xbf)?<(StateMachine|scxml)\b"


def _mission_line(path: Path, sign: bytes) -> Iterator[str]:
    """Yield the line of a mission file; nothing for another file, which has no such line."""
    from smachpy.files import MissionFileError, read

    try:
        if not re.search(sign, read_limited(path), re.MULTILINE):
            return
        yield (read(path)[0] or "A mission file.").splitlines()[0]
    except (OSError, MissionFileError) as error:
        yield f"not available: {str(error).splitlines()[0]}"


def prints_aside(*, data: bool) -> contextlib.AbstractContextManager[object]:
    """Load machines in a `with` block; what their code prints goes to standard error.

    Args:
        data: Whether standard output is data for programs; otherwise prints go there.
    """
    return contextlib.redirect_stdout(sys.stderr) if data else contextlib.nullcontext()


def load_target(text: str, *, imports: bool = True, allow: Sequence[str] | None = None) -> Target:
    """Load the machine that a user names.

    Args:
        text: A mission's name (`patrol`), `module[:factory]`, or `path.py[:factory]`; a module
            without a factory has a dot in its name. A file of a package is imported as a module of
            it. Without `:factory` it is the file's `mission`, `machine` or `sm`, else its only
            function with `@smachpy.mission`, else its only machine. Or a Petri net plan,
            `path.pnml` (.plan, .pddlout), with its actions and conditions in STEM.actions.yaml or
            actions.yaml beside it.
            Or a mission file, `path.yaml`, or a machine of another tool: YASMIN's `path.xml`,
            `path.scxml`, a behaviour of FlexBE.
        imports: False to import nothing that a plan or a mission file names: it is only looked at.
        allow: Packages of which a mission file may name code, besides its own folder; None: no
            others, and with `imports=False` any.

    Raises:
        TargetError: there is no such target; the nearest names are listed.
    """
    if text.endswith(PLANS):
        return _plan_target(text, imports)
    if is_data(text):
        return _mission_file(text, imports, allow)
    place, _, attribute = text.partition(":")
    if place.endswith(".py") or "/" in place:
        path = Path(place)
        _check_source(text, path, attribute)
        target = _from_module(text, _import_file(text, path), attribute, path.stem)
        is_plain = attribute in {*DEFAULT_NAMES, "", path.stem}
        return target if is_plain else replace(target, shown_name=f"{path.stem}_{attribute}")
    if attribute:
        return _from_module(text, _import_module(text, place), attribute, attribute)
    if place in mission_names():
        return _load_mission(place, entry_points(group=GROUP))
    if "." in place and _is_module(place):
        return _from_module(text, _import_module(text, place), "", place.rpartition(".")[2])
    raise TargetError(text, f"no such mission; {_suggest(place, mission_names())}")


def _plan_target(text: str, imports: bool) -> Target:
    from smachpy.pnp.files import load_plan

    path = Path(text)
    if not path.is_file():
        near = [str(p) for p in path.parent.iterdir()] if path.parent.is_dir() else []
        near = [name for name in near if name.endswith(PLANS)]
        raise TargetError(text, f"no file {text!r}; {_suggest(text, near)}")

    def plan() -> Container:
        """Run a Petri net plan."""
        return load_plan(path, to_run=False, imports=imports)

    return Target(path.name.partition(".")[0], text, "a Petri net plan", plan)


def _mission_file(text: str, imports: bool, allow: Sequence[str] | None) -> Target:
    from smachpy.files import MissionFileError, load, read, resolve
    from smachpy.files.reading import signature

    path = Path(text)
    if not path.is_file():
        files = path.parent.iterdir() if path.parent.is_dir() else ()
        near = [str(p) for p in files if p.suffix in (*MISSION_FILES, path.suffix)]
        raise TargetError(text, f"no file {text!r}; {_suggest(text, near)}")
    try:
        about, parameters = read(path)
    except MissionFileError:
        load(path, to_run=False)  # has all problems of the file, not only those of its parameters
        raise

    def mission(**arguments: Any) -> Container:
        to_run = imports or allow is not None
        machine = load(path, allow=allow or (), to_run=to_run, **arguments)
        return resolve(machine) if imports else machine

    mission.__signature__ = signature(parameters)  # type: ignore[attr-defined]
    mission.__annotations__ = {
        name: one.annotation for name, one in inspect.signature(mission).parameters.items()
    }
    described = [
        f"    {one.name}: {one.help or one.type}{one.unit and f' [{one.unit}]'}."
        for one in parameters
    ]
    mission.__doc__ = "\n".join([about or "A mission file.", "", "Args:", *described])
    return Target(path.stem, text, (about or "a mission file").splitlines()[0], mission)


def mission_names() -> list[str]:
    """Return the names of the installed missions."""
    return sorted(point.name for point in entry_points(group=GROUP))


def _load_mission(name: str, installed: Iterable[EntryPoint]) -> Target:
    points = {point.value: point for point in installed if point.name == name}
    if len(points) > 1:
        raise TargetError(
            name,
            f"installed packages have {len(points)} missions of that name; expected one. "
            f"Try {' or '.join(sorted(points))}",
        )
    (point,) = points.values()
    try:
        thing = point.load()
    except _FAILURES as error:
        why = advice(error) if isinstance(error, ImportError) else None
        text = why or f"importing {point.value!r} raised {raised_text(error)}"
        raise TargetError(name, text) from error
    return _target(name, name, point.value, thing)


def _import_file(text: str, path: Path) -> ModuleType:
    if not path.is_file():
        near = sorted(str(p) for p in path.parent.glob("*.py") if p.is_file())
        shipped = path.stem in mission_names()
        if shipped or not near:
            ways = [f"{path.stem!r} without .py, which is installed"] if shipped else []
            ways.append(f"'smachpy new {f'--from {path.stem}' if shipped else path.stem}'")
            raise TargetError(text, f"no file {str(path)!r}. Try {', or '.join(ways)}.")
        raise TargetError(text, f"no file {str(path)!r}; {_suggest(str(path), near)}")
    module = _in_package(text, path)
    if module is not None:
        return module
    name = _free_name(path.stem)
    loader = _UncachedLoader(name, str(path.absolute())) if path.suffix == ".py" else None
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    if spec is None or spec.loader is None:
        raise TargetError(
            text, f"{str(path)!r} is not a Python file; expected a name ending in .py"
        )
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickles look their module up
    try:
        with _on_python_path(path.resolve().parent):  # as `python path.py`, also of a link
            spec.loader.exec_module(module)
    except _FAILURES as error:
        sys.modules.pop(name, None)  # it was executed only in part
        why = _ros1_text(error) or f"running the file raised {raised_text(error)}"
        if isinstance(error, SystemExit):
            why += "\n    Try `if __name__ == '__main__':` before what is not to run here."
        raise TargetError(text, why) from error
    return module


class _UncachedLoader(SourceFileLoader):
    """Executes the file as it is now.

    Python takes the cached bytecode for a file that has changed within a second, if its length is
    the same: a mission with another number would do what it did before.
    """

    def get_code(self, fullname: str) -> CodeType:
        """Return the code of the file itself."""
        path = self.get_filename(fullname)
        code: CodeType = self.source_to_code(self.get_data(path), path)
        return code


def _check_source(text: str, path: Path, attribute: str) -> None:
    """Refuse a file that cannot have the machine, before its code is executed.

    Args:
        text: The user's text.
        path: The file; one that cannot be read or parsed is left to the import.
        attribute: The name that is asked for; "" for none.

    Raises:
        TargetError: the file gives no such name to anything.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the import gives them
            tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        return
    names: set[str] = set()
    for node in ast.walk(tree):  # also inside functions, which may have `global`
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                names.add(name)
            case ast.ClassDef(name=name) | ast.Name(id=name, ctx=ast.Store()):
                names.add(name)
            case ast.alias(name=name, asname=asname):
                names.add(asname or name.partition(".")[0])
            case ast.Name(id="globals" | "vars" | "locals" | "exec" | "setattr"):
                return
            case ast.Global(names=given):
                names.update(given)
    wanted = attribute.partition(".")[0]
    if "*" in names or (wanted in names if wanted else names):
        return
    what = (
        f"nothing is called {wanted!r}" if wanted else "which machine is meant? got no name at all"
    )
    hint = _suggest(wanted, sorted(name for name in names if not name.startswith("_")))
    raise TargetError(text, f"{what}; {hint} The file was not executed.")


def _in_package(text: str, path: Path) -> ModuleType | None:
    """Import a file as a module of its package; None if it is in none, or not found by that name.

    Its relative imports and those of the package then work, as with `python -m`.
    """
    path = path.resolve()
    folder, names = path.parent, [] if path.stem == "__init__" else [path.stem]
    while (folder / "__init__.py").is_file() and folder.name.isidentifier():
        names.insert(0, folder.name)
        folder = folder.parent
    if len(names) < 2 or not path.stem.isidentifier():  # noqa: PLR2004  a package and a module
        return None
    name = ".".join(names)
    with _on_python_path(folder):
        top = importlib.util.find_spec(names[0])
        if top is None or Path(top.origin or "?").resolve() != folder / names[0] / "__init__.py":
            return None  # another package has that name
        return _import_module(text, name)


def _is_module(name: str) -> bool:
    """Return whether a name is one of a module, on the Python path or in this folder."""
    try:
        with _on_python_path(Path.cwd()):
            return importlib.util.find_spec(name) is not None
    except (ImportError, ValueError):
        return False


@contextlib.contextmanager
def _on_python_path(folder: Path) -> Iterator[None]:
    """Import from `folder` in a `with` block, whose code may change the path or the folder."""
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        with contextlib.suppress(ValueError):
            sys.path.remove(str(folder))


def _ros1_text(error: BaseException) -> str:
    """Return what to try if a file needs the modules of ROS 1; "" if that is not the cause."""
    try:
        from smachpy.ros1.hook import OLD_NAMES
    except ModuleNotFoundError:  # installed without what runs such scripts
        return ""
    name = (getattr(error, "name", None) or "").partition(".")[0]
    if not isinstance(error, ModuleNotFoundError) or not (
        name in OLD_NAMES or importlib.util.find_spec(f"actionlib_core.interfaces.{name}")
    ):
        return ""
    return (
        f"{name!r} is a module of ROS 1, which is not installed: {trace_of(error).strip()}; "
        "expected a file without such modules. Try the option --ros1."
    )


def _free_name(stem: str) -> str:
    """Return `stem`, with a number appended if a module already has that name."""
    name, number = stem, 1
    while name in sys.modules:
        number += 1
        name = f"{stem}_{number}"
    return name


def _import_module(text: str, name: str) -> ModuleType:
    here = Path.cwd()
    try:
        with _on_python_path(here):
            return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{name}.".startswith(f"{error.name}."):
            raise TargetError(text, _why_not(name, error)) from error
        raise TargetError(
            text,
            f"no module {error.name!r}; expected one on the Python path or in {str(here)!r}.",
        ) from error
    except _FAILURES as error:
        raise TargetError(text, _why_not(name, error)) from error


def _why_not(name: str, error: BaseException) -> str:
    return _ros1_text(error) or f"importing {name!r} raised {raised_text(error)}"


def _from_module(text: str, module: ModuleType, attribute: str, name: str) -> Target:
    # The decorator `mission`, imported by that name, is not the file's mission.
    found = [n for n in DEFAULT_NAMES if getattr(module, n, mission) is not mission]
    names = [attribute] if attribute else found
    if not names:
        marked = [
            n
            for n, thing in vars(module).items()
            if is_mission(thing) and thing.__module__ == module.__name__
        ]
        names = marked if len(marked) == 1 else []
    if not names:
        machines = [n for n, thing in vars(module).items() if isinstance(thing, Container)]
        if len(machines) != 1:
            here = _own_names(module)
            raise TargetError(
                text,
                f"which machine is meant? got {here or 'no machine and no function'}; expected one "
                f"of {list(DEFAULT_NAMES)} or a single machine. Try {text}:NAME.",
            )
        names = machines
    thing: Any = module
    for word in names[0].split("."):
        if not hasattr(thing, word):
            raise TargetError(
                text, f"nothing is called {names[0]!r}; {_suggest(word, _own_names(module))}"
            )
        thing = getattr(thing, word)
    return _target(text, name, f"{module.__name__}:{names[0]}", thing)


def _own_names(module: ModuleType) -> list[str]:
    """Return the names of a module's machines and functions, without those of other packages."""
    package = module.__name__.partition(".")[0]
    return [
        name
        for name, thing in vars(module).items()
        if not name.startswith("_")
        and (
            isinstance(thing, Container)
            or (inspect.isfunction(thing) and thing.__module__.partition(".")[0] == package)
        )
    ]


def _target(text: str, name: str, source: str, thing: Any) -> Target:
    try:
        if not isinstance(thing, Container):
            inspect.signature(thing)
    except (TypeError, ValueError) as error:  # no function, or one like `int`, written in C
        raise TargetError(
            text, f"{source} is {thing!r}; expected a machine or a function that returns one."
        ) from error
    doc = "" if isinstance(thing, Container) else (inspect.getdoc(thing) or "").strip()
    return Target(name, source, doc.splitlines()[0] if doc else "", thing)


def _suggest(word: str, names: list[str]) -> str:
    expected = f"one of {sorted(names)}" if names else "one that is there"
    return f"expected {expected}.{did_you_mean(word, names)}"


def raised_text(error: BaseException, said: str = "") -> str:
    """Return an exception of the user's code as text, with the lines that raised it.

    Args:
        error: The exception.
        said: Text instead of its type and message.
    """
    lines = (said or error_text(error), *trace_of(error).splitlines())
    return "\n    ".join(lines)
