"""Finds the machine that a user names on a command line: a mission, a module or a file."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import inspect
import sys
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionlibError
from actionlib_core.suggest import did_you_mean
from smachpy.command.extras import advice, clash, hidden_by
from smachpy.exceptions import SmachError, error_text
from smachpy.machines.container import Container
from smachpy.mission_info import is_mission, mission
from smachpy.run.stack_text import trace_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

GROUP = "smachpy.missions"
DEFAULT_NAMES = ("mission", "machine", "sm")
PLANS = (".pnml", ".plan", ".pddlout")
# A script that calls `sys.exit()` would end the command, with 0 as if the mission had succeeded.
_FAILURES = (Exception, SystemExit)


class TargetError(SmachError):
    """The named mission, module or file cannot be loaded.

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
    """

    name: str
    source: str
    summary: str
    thing: Any

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
                "Try a function of your own that calls it with some.",
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

    They are the entry points `smachpy.missions`. If one cannot be loaded, its line says why.
    """
    lines = {}
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        hidden = hidden_by(point.module)
        try:
            lines[point.name] = (
                f"not available: hidden by {str(hidden)!r}"
                if hidden is not None
                else _load_mission(point.name).summary
            )
        except TargetError as error:
            lines[point.name] = f"not available: {error.problem.splitlines()[0]}"
    return lines


def list_plans(folder: Path) -> dict[str, str]:
    """Return the Petri net plans in a folder: name for `smachpy run` -> its actions, in one line.

    If one cannot be read, its line says why.

    Raises:
        TargetError: the folder cannot be read.
    """
    from smachpy.pnp.plan import understand
    from smachpy.pnp.problems import PlanError
    from smachpy.pnp.reading import read_net

    lines = {}
    try:
        files = sorted(path for path in folder.iterdir() if path.suffix in PLANS)
    except OSError as error:
        raise TargetError(str(folder), f"got {error.strerror}; expected a folder.") from error
    for path in files:
        try:
            plan = understand(read_net(path)[0])
        except PlanError as error:
            lines[str(path)] = f"not available: {str(error).splitlines()[0]}"
        else:
            names = sorted({name.rpartition("#")[2].partition("_")[0] for name in plan.executables})
            lines[str(path)] = f"Petri net plan of {', '.join(names) or 'no actions'}."
    return lines


def load_target(text: str) -> Target:
    """Load the machine that a user names.

    Args:
        text: A mission's name (`patrol`), `module:factory`, or `path.py[:factory]`. Without
            `:factory` it is the file's `mission`, `machine` or `sm`, else its only function with
            `@smachpy.mission`, else its only machine. Or a Petri net plan, `path.pnml` (.plan,
            .pddlout), with its actions and conditions in STEM.actions.yaml or actions.yaml beside
            it.

    Raises:
        TargetError: there is no such target; the nearest names are listed.
    """
    if text.endswith(PLANS):
        return _plan_target(text)
    place, _, attribute = text.partition(":")
    if place.endswith(".py") or "/" in place:
        return _from_module(text, _import_file(text, Path(place)), attribute, Path(place).stem)
    if attribute:
        return _from_module(text, _import_module(text, place), attribute, attribute)
    if place in _mission_names():
        return _load_mission(place)
    raise TargetError(text, f"no such mission; {_suggest(place, _mission_names())}")


def _plan_target(text: str) -> Target:
    from smachpy.pnp.files import load_plan

    path = Path(text)
    if not path.is_file():
        near = [str(p) for p in path.parent.iterdir()] if path.parent.is_dir() else []
        near = [name for name in near if name.endswith(PLANS)]
        raise TargetError(text, f"no file {text!r}; {_suggest(text, near)}")

    def plan() -> Container:
        """Run a Petri net plan."""
        return load_plan(path, to_run=False)

    return Target(path.name.partition(".")[0], text, "a Petri net plan", plan)


def _mission_names() -> list[str]:
    return sorted(point.name for point in entry_points(group=GROUP))


def _load_mission(name: str) -> Target:
    points = {point.value: point for point in entry_points(group=GROUP) if point.name == name}
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
        raise TargetError(text, f"no file {str(path)!r}; {_suggest(str(path), near)}")
    name = _free_name(path.stem)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise TargetError(
            text, f"{str(path)!r} is not a Python file; expected a name ending in .py"
        )
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickles look their module up
    try:
        with _on_python_path(path.parent.resolve()):  # as `python path.py` would
            spec.loader.exec_module(module)
    except _FAILURES as error:
        sys.modules.pop(name, None)  # it was executed only in part
        why = clash(error, [path.parent]) if isinstance(error, ImportError) else None
        why = why or _ros1_text(error)
        why = why or f"running the file raised {raised_text(error)}"
        if isinstance(error, SystemExit):
            why += "\n    Try `if __name__ == '__main__':` before what is not to run here."
        raise TargetError(text, why) from error
    return module


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
    from smachpy.ros1.hook import OLD_NAMES

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
        why = clash(error, [here])
        raise TargetError(
            text,
            why
            or f"no module {error.name!r}; expected one on the Python path or in {str(here)!r}.",
        ) from error
    except _FAILURES as error:
        raise TargetError(text, f"importing {name!r} raised {raised_text(error)}") from error


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
    return f"expected one of {sorted(names)}.{did_you_mean(word, names)}"


def raised_text(error: BaseException, said: str = "") -> str:
    """Return an exception of the user's code as text, with the lines that raised it.

    Args:
        error: The exception.
        said: Text instead of its type and message.
    """
    lines = (said or error_text(error), *trace_of(error).splitlines())
    return "\n    ".join(lines)
