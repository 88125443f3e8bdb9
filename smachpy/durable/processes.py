"""Identifies the process that holds a mission, and tells whether it is still alive."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def this_runner() -> str:
    """Return "host:pid" of this process."""
    return f"{platform.node() or 'localhost'}:{os.getpid()}"


def process_mark() -> str:
    """Return a text that no other process has: pids are reused, and repeat in other containers.

    Its three words: the boot of the computer, the pid namespace, the start time of the process.
    """
    return f"{_boot_and_namespace()} {_start_of(os.getpid())}"


def process_lives(pid: int, mark: str) -> bool | None:
    """Return whether a process is still alive; None if that cannot be determined from here.

    Args:
        pid: Its process id.
        mark: Its `process_mark()`.
    """
    # After a reboot, on another computer or in another container the same pid means nothing.
    place, _, start = mark.rpartition(" ")
    if not start or place != _boot_and_namespace():
        return None
    return _start_of(pid) == start


def is_of_other_boot(mark: str) -> bool:
    """Return whether a `process_mark()` is of another boot than this process.

    On one computer nothing of that boot can still be alive.
    """
    boot, mine = mark.partition(" ")[0], _boot_and_namespace().partition(" ")[0]
    return bool(boot) and "unknown" not in {boot, mine} and boot != mine


def boot_clock() -> str:
    """Return a name of this computer's monotonic clock, the same for all that read it.

    "" if that cannot be determined. Another boot, or a container with another time, has another.
    """
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        return f"{boot} {Path('/proc/self/ns/time').readlink()}"
    except OSError:
        return ""


def _boot_and_namespace() -> str:
    """Return "BOOT NAMESPACE"; processes for which it is equal see each other's pids."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        namespace = Path("/proc/self/ns/pid").readlink()
    except OSError:  # not Linux; the own pid makes the text differ from that of other processes
        return f"unknown {os.getpid()}"
    return f"{boot} {namespace}"


def _start_of(pid: int) -> str:
    """Return when a process started, in clock ticks after the boot; "-" if it is gone."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_bytes()
    except OSError:
        return "-"
    # proc(5): "pid (name) state ...", and the start time is field 22. The name may contain blanks
    # and parentheses, so fields are counted from the last parenthesis; fields[0] is field 3.
    fields = stat[stat.rindex(b")") + 2 :].split()
    return "-" if fields[0] in {b"Z", b"X"} else fields[19].decode()  # zombie, dead
