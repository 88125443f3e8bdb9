"""Which process holds a mission, and whether it still lives."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def this_runner() -> str:
    """Return "host:pid" of this process."""
    return f"{platform.node() or 'localhost'}:{os.getpid()}"


def process_mark() -> str:
    """Return what tells this process from another that has its pid later, or elsewhere.

    Three words: the computer's boot, the namespace of its pids (containers), when it started.
    """
    return f"{_boot_and_namespace()} {_start_of(os.getpid())}"


def process_lives(pid: int, mark: str) -> bool | None:
    """Tell whether a process still lives, None when that cannot be told from here.

    Args:
        pid: Its number.
        mark: Its `process_mark()`.
    """
    place, _, start = mark.rpartition(" ")
    if not start or place != _boot_and_namespace():
        return None
    return _start_of(pid) == start


def _boot_and_namespace() -> str:
    """Return where pids mean the same: "BOOT NAMESPACE"."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        namespace = Path("/proc/self/ns/pid").readlink()
    except OSError:  # no Linux: nothing can be told
        return f"unknown {os.getpid()}"
    return f"{boot} {namespace}"


def _start_of(pid: int) -> str:
    """Return when a process started, in ticks after the boot (proc(5)); "-": it is gone."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_bytes()
    except OSError:
        return "-"
    fields = stat[stat.rindex(b")") + 2 :].split()  # its name may hold blanks and parentheses
    return "-" if fields[0] in {b"Z", b"X"} else fields[19].decode()
