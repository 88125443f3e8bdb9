"""One execution of a root container, from outside to the first frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core.clock import current_clock
from smachpy import log
from smachpy._runtime.frame import Frame, Run
from smachpy.events import Finished, Started

if TYPE_CHECKING:
    from smachpy.container import Container
    from smachpy.user_data import Remapper, UserData


def execute_root(root: Container, parent_ud: UserData | Remapper | None) -> str:
    """Run `root` as the top of a machine.

    Blocks: until it has ended.
    """
    run = Run(current_clock())
    frame = Frame(root, f"/{root.name or 'SM_ROOT'}", run, None)
    run.watched = bool(root._listeners) or log.is_info_wanted()  # noqa: SLF001  one machinery
    frame.emit_own(Started, tuple(root.get_initial_states()))
    outcome: str | None = None
    try:
        outcome = root._run(frame, parent_ud)  # noqa: SLF001  one machinery
    finally:
        frame.emit_own(Finished, outcome)
    return outcome
