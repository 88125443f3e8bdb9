"""The options of `--ros1`, and loading a script for ROS 1."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.names import NameArguments
from actionlib_core.process.output import tell
from smachpy.command.targets import Target, TargetError, load_target
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    import argparse


@dataclass(frozen=True, slots=True)
class Ros1Options:
    """The options for a script for ROS 1.

    Attributes:
        params: Parameter files, each with its namespace.
        stub_missing: Use stand-ins for modules and messages that are not there.
        timeout: Longest time for the script to build its machine [s].
        words: The script's own arguments, including remappings and parameters.
    """

    params: tuple[tuple[str, Path], ...] = ()
    stub_missing: bool = False
    timeout: float = 10.0
    words: tuple[str, ...] = ()

    def parameters(self) -> dict[str, Any]:
        """Return the parameters of all files.

        Raises:
            ParameterFileError: a file cannot be read.
        """
        from smachpy.ros1.parameters import Parameters

        made = Parameters()
        for namespace, path in self.params:
            made.load(path, namespace)
        return dict(made.get("/"))


def add_options(parser: Any, *, loads: bool) -> None:
    """Add `--ros1` and its companions.

    Args:
        parser: The parser of the command.
        loads: Whether the command loads machines without running them.
    """
    group = parser.add_argument_group("scripts for ROS 1")
    group.add_argument(
        "--ros1", action="store_true", help="TARGET is a script for ROS 1; it is not changed"
    )
    group.add_argument(
        "--params",
        action="append",
        default=[],
        metavar="[NS=]FILE",
        help="its parameters, a YAML file (repeatable)",
    )
    group.add_argument(
        "--stub-missing",
        action="store_true",
        help="use stand-ins for missing modules, messages and parameters",
    )
    if loads:
        parser.set_defaults(words=(), names=NameArguments(), loads=True)
        group.add_argument(
            "--timeout",
            type=float,
            default=10.0,
            metavar="S",
            help="longest time to build its machine [s] (default: %(default)g)",
        )
        parser.add_argument(
            "--import",
            action="store_true",
            dest="imports",
            help="import the modules that a plan or mission file names; that runs their code",
        )


def options_of(args: argparse.Namespace) -> Ros1Options | None:
    """Return the options for a script for ROS 1; None without `--ros1`.

    Raises:
        MissionError: an option needs `--ros1`.
    """
    loads = getattr(args, "loads", False)
    names = args.names
    words = (
        *args.words,
        *(f"{rule.old}:={rule.new}" for rule in names.rules),
        *names.parameters,
    )
    if not args.ros1:
        if loads and words:
            raise MissionError(f"{words[0]}: got arguments of a script; expected --ros1 with them.")
        for name in ("params", "stub_missing"):
            if getattr(args, name):
                flag = name.replace("_", "-")
                raise MissionError(f"--{flag}: got no --ros1 beside it; expected both.")
        return None
    return Ros1Options(
        tuple(_params(text) for text in args.params),
        args.stub_missing,
        getattr(args, "timeout", 10.0),
        words,
    )


def _params(text: str) -> tuple[str, Path]:
    namespace, equals, file = text.partition("=")
    return (namespace, Path(file)) if equals else ("/", Path(text))


def load_script(text: str, options: Ros1Options) -> Target:
    """Return the machine of a script; the script is stopped where it would run it.

    Raises:
        LoadError: there is none.
        TargetError: no such file.
    """
    from smachpy.checks import ignore
    from smachpy.machines.container import Container, below
    from smachpy.ros1 import load
    from smachpy.ros1.session import session

    file, colon, function = text.partition(".py:")
    place = script_of(f"{file}.py" if colon else text)
    stubbed: list[str] = []
    machine = load(
        f"{place}:{function}" if colon else place,
        options.words,
        params=options.parameters(),
        stub_missing=options.stub_missing,
        timeout=options.timeout,
        stubbed=stubbed,
    )
    tell_stubs(stubbed)
    if not session().executed:  # it waits for others, and may add states when they call
        for container in below(machine):
            if isinstance(container, Container) and not container.get_children():
                reason = "it had no states when the script began to wait"
                ignore(container, "inconsistent", reason)
    return Target(place.stem, f"{place}", "", machine)


def script_of(text: str) -> Path:
    """Return the path of a script.

    Raises:
        TargetError: it is not a file.
    """
    path = Path(text)
    if not path.is_file():
        raise TargetError(text, "no such file; expected a script for ROS 1, path/to/script.py.")
    return path


def tell_stubs(stubbed: list[str]) -> None:
    """Report the stand-ins."""
    if stubbed:
        tell("smachpy", f"--stub-missing: stand-ins for {', '.join(stubbed)}")


def load_any(text: str, args: argparse.Namespace) -> Target:
    """Load a target: a script for ROS 1 with `--ros1`, else as `load_target`."""
    options = options_of(args)
    if options:
        return load_script(text, options)
    return load_target(text, imports=args.imports, allow=getattr(args, "allow", None))
