"""The user's folder for recordings of viewed runs; it keeps the newest of them."""

from __future__ import annotations

import os
import re
import tempfile
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actionlib_core.clock import RealClock
from actionlib_core.process.private_files import make_private_folder
from smachpy.base import log
from smachpy.events.recording import delete_recording, run_of

if TYPE_CHECKING:
    from collections.abc import Mapping

VARIABLE: Final = "SMACHPY_RUNS"
MAX_KEPT_RECORDINGS: Final = 100
"""The number of files kept; only files with names of `new_file` are ever removed."""

_NAME = re.compile(r".+-\d{8}-\d{6}-\d+\.jsonl")


def runs_folder(environment: Mapping[str, str] = os.environ) -> Path:
    """Return the folder: `SMACHPY_RUNS`, else `smachpy/runs` in the user's folder for state.

    A user without a home, as of a container that runs as any number, has one among the temporary
    files.

    Sources: the XDG base directory specification names `XDG_STATE_HOME`, else `~/.local/state`.
    """
    if environment.get(VARIABLE):
        return Path(environment[VARIABLE]).expanduser()
    state = environment.get("XDG_STATE_HOME") or "~/.local/state"
    try:
        return Path(state).expanduser() / "smachpy" / "runs"
    except RuntimeError:
        own = Path(tempfile.gettempdir()) / f"smachpy-{os.getuid()}"
        if own.exists() and own.stat().st_uid != os.getuid():  # somebody else could read in it
            own = Path(tempfile.mkdtemp(prefix="smachpy-"))
        return own / "runs"


def new_file(mission: str, stamp_ns: int, run: str = "") -> Path | None:
    """Return the path of a new file, and remove the oldest ones.

    Args:
        mission: Name of the mission.
        stamp_ns: When it begins [ns since the epoch].
        run: Name of a durable run (`smachpy.durable.store.MissionRow.run`): if an earlier process
            recorded a part of it, that file is returned.

    Returns:
        None if nothing can be written there, which is logged.
    """
    folder = runs_folder()
    try:
        make_private_folder(folder)
        ours = [path for path in folder.iterdir() if _NAME.fullmatch(path.name)]
        known = next((path for path in ours if run and run_of(path) == run), None)
        if known is not None:
            return known
        now = RealClock().time_ns() / 1e9
        # What has a time to come is older than the rest: the clock has been put back since.
        ours.sort(key=lambda path: ((time := path.stat().st_mtime) <= now, time))
        for path in ours[: max(0, len(ours) - MAX_KEPT_RECORDINGS + 1)]:
            delete_recording(path)
        if not os.access(folder, os.W_OK):
            raise PermissionError(13, "no permission to write")
    except (OSError, RuntimeError) as error:  # RuntimeError: this user has no home
        reason = getattr(error, "strerror", None) or error
        log.logwarn(f"runs folder {str(folder)!r}: {reason}. This run is kept nowhere.")
        return None
    word = re.sub(r"[^A-Za-z0-9_.]", "_", mission)[:80]
    began = datetime.fromtimestamp(stamp_ns / 1e9).astimezone()
    return folder / f"{word}-{began:%Y%m%d-%H%M%S}-{os.getpid()}.jsonl"
