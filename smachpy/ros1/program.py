"""Runs an old script, or only builds its machine."""

from __future__ import annotations

import contextlib
import gc
import linecache
import os
import signal
import sys
import threading
import traceback
import types
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import Deadlock, RealClock, VirtualClock, current_clock, use_clock
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces import InterfaceError
from actionlib_core.node import Node, get_node, use_node
from actionlib_core.shutdown import Shutdown, use_shutdown
from actionlib_core.transport.memory import MemoryNetwork
from smachpy.engine.threads import OBSERVERS
from smachpy.exceptions import SmachError
from smachpy.machines.container import Container, below
from smachpy.ros1 import session
from smachpy.ros1.border import StandInMachine
from smachpy.ros1.dry import nothing_done
from smachpy.ros1.hook import INTERFACES, MissingPackageError
from smachpy.ros1.install import current_finder, install
from smachpy.ros1.project import Project
from smachpy.ros1.session import DryRunOver, Session

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from types import FrameType

_MASTER: Final = ("ROS_MASTER_URI", "http://localhost:11311")
"""Set in every shell of ROS 1, so scripts read it without a check."""

LOAD_S = 10.0
"""Longest time that a script may take to build its machine [s]."""


class LoadError(SmachError):
    """A script did not build a machine.

    Try: do what the text says; docs/ros1.md shows which scripts can be loaded.

    Attributes:
        script: The script.
        problem: Why, and what to try.
    """

    def __init__(self, script: Path, problem: str) -> None:
        self.script = script
        self.problem = problem
        super().__init__(f"script {str(script)!r}: {problem}")


def run_script(script: Path, argv: Sequence[str] = (), *, call: str = "") -> Any:
    """Run a script as `python script` would, with ROS 1's names, in the current session.

    Args:
        script: The file.
        argv: Its arguments.
        call: A function of the file to call afterwards, as for a file that another program imports:
            it then is not the main program. "": none.

    Returns:
        The function's return value.

    Raises:
        LoadError: the file cannot be read, or is not Python.
        BaseException: any exception of the script, including `SystemExit`.

    Blocks: as long as the script runs.
    """
    path = script.resolve()
    try:
        code = current_finder(path).to_code(path.read_bytes(), str(path))
    except OSError as error:
        raise LoadError(
            script, f"got nothing to read ({error.strerror or error}); expected a file of Python."
        ) from error
    except SyntaxError as error:
        raise LoadError(
            script,
            f"line {error.lineno}: got a syntax error ({error.msg}); expected Python, 2 or 3.",
        ) from error
    main = types.ModuleType(path.stem if call else "__main__")
    main.__file__ = str(path)
    main.__dict__["__builtins__"] = __builtins__
    before = sys.modules.get("__main__"), sys.argv, list(sys.path)
    shell = {} if _MASTER[0] in os.environ else dict([_MASTER])
    os.environ.update(shell)
    sys.modules["__main__"] = main
    sys.argv = [str(path), *argv]
    sys.path.insert(0, str(path.parent))
    try:
        exec(code, main.__dict__)  # noqa: S102  the user's own script
        if not call:
            return None
        function = getattr(main, call, None)
        if not callable(function):
            known = [name for name, value in vars(main).items() if callable(value)]
            raise LoadError(
                script,
                f"got {call!r}; expected a function of it.{did_you_mean(call, known)}",
            )
        return function()
    finally:
        sys.argv, sys.path[:] = before[1], before[2]
        for name in shell:
            os.environ.pop(name, None)
        if before[0] is not None:
            sys.modules["__main__"] = before[0]


def load(
    script: str | Path,
    argv: Sequence[str] = (),
    *,
    params: Mapping[str, Any] | None = None,
    stub_missing: bool = False,
    timeout: float = LOAD_S,
    stubbed: list[str] | None = None,
) -> Container:
    """Return the machine of a script for ROS 1; the script runs up to its first `execute`.

    It ends where it calls `execute`, `run_server` or `spin`. Until then it waits for nothing, sends
    nothing, writes nothing and starts no process: servers seem to be there, goals succeed at once,
    messages, results and responses are empty. What it does by sockets or devices of its own is
    done. ROS 1's names stay installed, as the states of the
    machine may need them; `uninstall` removes them.

    Args:
        script: The file, or `file.py:function` for a file that another program imports: the
            function is called after the file has run, and may return the machine.
        argv: Its arguments; `_name:=value` sets a private parameter.
        params: Parameters by name, also as a tree.
        stub_missing: Missing modules, messages and parameters are replaced by stand-ins.
        timeout: Longest time that the script may take [s].
        stubbed: Gets the names of what was replaced by stand-ins.

    Returns:
        The machine that it would run first; if it would serve or wait instead, the outermost one.

    Raises:
        LoadError: it built none in time, or raised.

    Blocks: as long as the script runs, `timeout` at most.
    """
    place, colon, call = str(script).rpartition(":")
    path, call = (Path(place), call) if colon and place.endswith(".py") else (Path(script), "")
    install(path, stub_missing=stub_missing)
    made = Session(
        [str(path), *argv], dry=True, make_node=_node_in_force, stub_missing=stub_missing
    )
    made.parameters.merge("/", dict(params or {}))
    # A script that never executes its machine does not show it: it is the container that the
    # garbage collector knows afterwards and did not know before.
    known = [thing for thing in gc.get_objects() if isinstance(thing, Container)]
    with contextlib.ExitStack() as stack:
        _go_virtual(stack)
        stack.enter_context(nothing_done())
        session.forget_loaded()
        session.begin(made)
        stack.callback(made.be_live)
        OBSERVERS.append(made.stop)  # called when a machine is executed
        stack.callback(OBSERVERS.remove, made.stop)
        late = stack.enter_context(_deadline(made, timeout))
        problem = _build(path, argv, call, made)
        stopped = made.stopped
    if stubbed is not None:
        stubbed += made.stubbed
    machine = stopped.machine if stopped is not None else None
    if machine is None:
        machine = _outermost(known)
    if machine is None or (problem and stopped is None):
        in_vain = f"it built no machine in {timeout:g} s. Try --timeout SECONDS."
        raise LoadError(
            path, problem or (in_vain if late else _nothing(made, served=stopped is not None))
        )
    if isinstance(machine, StandInMachine) or not isinstance(machine, Container):
        name = getattr(machine, "origin", machine)
        raise LoadError(
            path,
            f"got {str(name)!r} as its machine, which is a stand-in for what is missing; expected "
            f"a machine that the script builds. Try giving it what is missing: "
            f"{', '.join(made.stubbed)}.",
        )
    return machine


def _nothing(made: Session, *, served: bool) -> str:
    """Return why a script that has ended without a problem has no machine, and what to try."""
    got = "a call of spin()" if served else "no call of execute(), run_server() or spin()"
    text = f"it ended without a machine: got {got}; expected a machine."
    if made.stubbed:
        return f"{text} It may be in what is missing: {', '.join(made.stubbed)}."
    if served:
        return f"{text} It only serves others."
    return f"{text} Try `path.py:function` if a function of the file returns its machine."


def _build(path: Path, argv: Sequence[str], call: str, made: Session) -> str:
    """Run a dry script; return the problem, or ""."""
    try:
        returned = run_script(path, argv, call=call)
        if isinstance(returned, Container):
            made.stopped = DryRunOver(returned)
        made.settle()
    except LoadError as error:
        return error.problem
    except DryRunOver:
        return ""
    except SystemExit as error:
        return f"it ended by sys.exit({error.code!r}) before its machine ran."
    except Deadlock:  # it waits for something that nothing can bring: it would wait for ever
        made.stopped = made.stopped or DryRunOver()
        return ""
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) and made.stopped is None:  # the user's Ctrl-C
            raise
        return where_raised(error, path)
    return ""


def where_raised(error: BaseException, script: Path) -> str:
    """Return the text of an error, with the last line of the script's project in its traceback."""
    frames = traceback.extract_tb(error.__traceback__)
    project = Project(script)
    own = [frame for frame in frames if project.holds(frame.filename)]
    text = f"{type(error).__name__}: {error}{_ways_out(error)}"
    if not own or isinstance(error, MissingPackageError):
        return text
    last = own[-1]
    source = linecache.getline(last.filename, last.lineno or 0).strip()
    return f"{last.filename}:{last.lineno}: {text}" + (f"\n    {source}" if source else "")


def _ways_out(error: BaseException) -> str:
    """Return what to try when an interface is missing; "" for other errors."""
    if isinstance(error, InterfaceError) and "unknown type" in str(error):
        return "\nTry --stub-missing for a stand-in."
    module = str(getattr(error, "name", "")).removeprefix(f"{INTERFACES}.")
    package, _, section = module.partition(".")
    if not (isinstance(error, ImportError) and section in {"msg", "srv"}):
        return ""
    return (
        f". Try putting the package's own definitions in FOLDER/{package}/{section}, with "
        "SMACHPY_INTERFACE_PATH=FOLDER, or --stub-missing for a stand-in."
    )


def _node_in_force(_name: str) -> Node:
    """Return the node that `_go_virtual` has made: a dry program gets no node of its own."""
    return get_node()


def _go_virtual(stack: contextlib.ExitStack) -> None:
    """Enter a virtual clock and a network in memory, unless the caller already has such a clock."""
    clock = current_clock()
    if isinstance(clock, VirtualClock):
        stack.enter_context(clock.patched())
        return
    made = stack.enter_context(VirtualClock())
    stack.enter_context(use_clock(made))
    stack.enter_context(use_shutdown(Shutdown()))
    stack.enter_context(made.patched())
    node = stack.enter_context(Node("script", transport=MemoryNetwork(made).session(), clock=made))
    stack.enter_context(use_node(node))


@contextlib.contextmanager
def _deadline(made: Session, seconds: float) -> Iterator[list[bool]]:
    """End the script after this real time [s], wherever it is; in the main thread only.

    Yields a list that gets an item when the time is over.
    """
    late: list[bool] = []
    # Only a signal interrupts code that computes or waits, and Python handles signals in the main
    # thread alone.
    if threading.current_thread() is not threading.main_thread():
        yield late
        return
    over: list[bool] = []

    def end(_number: int, _frame: FrameType | None) -> None:
        if not over:
            late.append(True)
            made.stopped = made.stopped or DryRunOver()
            raise made.stopped

    main = threading.main_thread().ident
    assert main is not None
    before = signal.signal(signal.SIGURG, end)  # by default it is ignored; few programs use it
    timer = RealClock().call_later(seconds, lambda: signal.pthread_kill(main, signal.SIGURG))
    try:
        yield late
    finally:
        over.append(True)
        timer.cancel()
        signal.signal(signal.SIGURG, before)


def _outermost(known: Sequence[Container]) -> Container | None:
    """Return the largest new container that is not inside another one."""
    before = {id(container) for container in known}
    made = [
        thing
        for thing in gc.get_objects()
        if isinstance(thing, Container) and id(thing) not in before and "_smachpy" in vars(thing)
        if not isinstance(thing, StandInMachine)
    ]
    inner = {
        id(child)
        for container in made
        for each in container.get_children().values()
        for child in below(each)
    }
    outer = [container for container in made if id(container) not in inner]
    sizes = [(sum(1 for _ in below(container)), -index) for index, container in enumerate(outer)]
    return outer[-max(sizes)[1]] if sizes else None


__all__ = ["LOAD_S", "LoadError", "load", "run_script", "where_raised"]
