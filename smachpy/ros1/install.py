"""Makes ROS 1's module names importable, and undoes that."""

from __future__ import annotations

import contextlib
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from smachpy.base import log, slips
from smachpy.engine import shutdown_check
from smachpy.ros1 import session
from smachpy.ros1.hook import OldNames
from smachpy.ros1.project import Project

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

_lock = threading.Lock()


class _Installed:
    """What `install` has changed, to undo it."""

    def __init__(self, finder: OldNames) -> None:
        self.finder = finder
        self.before = dict(sys.modules)
        self.hidden: dict[str, ModuleType] = {}
        self.loggers = log.current_loggers()


_installed: list[_Installed] = []


def install(script: str | Path | None = None, *, stub_missing: bool = False) -> None:
    """Make ROS 1's names importable in this process, and accept the slips that SMACH accepted.

    Modules of these names that were imported before, for example those of an installed SMACH, are
    put aside until `uninstall`. A second call only changes the script.

    Args:
        script: The program; its folder and package are searched for modules and messages. None:
            the main module's file, or the working folder.
        stub_missing: Missing modules, messages and, in `load`, parameters are replaced by
            stand-ins.

    Threads: any, one at a time.
    """
    if script is None:
        main = getattr(sys.modules.get("__main__"), "__file__", None)
        script = main if main and Path(main).is_file() else None
    finder = OldNames(Project(None if script is None else Path(script)), stub_missing=stub_missing)
    with _lock:
        if _installed:
            made = _installed[0]
            sys.meta_path[sys.meta_path.index(made.finder)] = finder
            made.finder.close()
            made.finder = finder
            finder.open()
            return
        made = _Installed(finder)
        tops = {name.partition(".")[0] for name in sys.modules}
        claimed = {top for top in tops if finder.claims(top)}
        for name in list(sys.modules):
            if name.partition(".")[0] in claimed:
                made.hidden[name] = sys.modules.pop(name)
        _installed.append(made)
        finder.open()
        sys.meta_path.insert(0, finder)  # first, before packages that are installed under the names
        slips.set_accepting(True)
        # In ROS `import smach_ros` did this; some programs import only `smach`.
        shutdown_check.set_shutdown_check(_is_shutdown)


def _is_shutdown() -> bool:
    from smachpy.ros1.names.rospy.core import is_shutdown

    return is_shutdown()


def uninstall() -> None:
    """Undo `install`, and forget the modules that the program has imported."""
    with _lock:
        if not _installed:
            return
        made = _installed.pop()
        sys.meta_path.remove(made.finder)
        made.finder.close()
        for name, module in sys.modules.copy().items():
            if name not in made.before and made.finder.made(name, module):
                del sys.modules[name]
        sys.modules.update(made.hidden)
        log.set_loggers(*made.loggers)
        shutdown_check.reset_shutdown_check()
        session.forget_loaded()
        slips.set_accepting(False)


def current_finder(script: Path | None = None) -> OldNames:
    """Return the finder that is installed; if none is, one for a script that uses no ROS names."""
    return _installed[0].finder if _installed else OldNames(Project(script))


def current_project() -> Project:
    """Return the project of the program."""
    return current_finder().project


@contextlib.contextmanager
def installed(script: str | Path | None = None, *, stub_missing: bool = False) -> Iterator[None]:
    """Install the names for a `with` block; arguments as `install`."""
    install(script, stub_missing=stub_missing)
    try:
        yield
    finally:
        uninstall()
