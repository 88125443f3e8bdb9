"""Stamps of records whose differences are the times that have passed.

Each event has a time of a monotonic clock, `t`, and a stamp of the wall clock, `stamp_ns`, which
can be set at any moment: by NTP minutes after the boot, or by hand. Durations, orders and time
lines are made of stamps, as several processes may take part in one run. So where the two disagree,
the stamp is replaced by that of the first event of the process plus the time that has passed since.
"""

from __future__ import annotations

from typing import Any, Final

TOLERANCE_NS: Final = 50_000_000  # the clocks are read one after the other, on a busy computer
PROCESS_S: Final = 1.0  # by a greater step back of `t`, another process has gone on with the run


def begun_root(record: dict[str, Any], root: str) -> str:
    """Return the path of the machine whose run begins with a record; "" if none does.

    Args:
        record: The record.
        root: Path of the machine that has begun before, "" for none. What begins below it is no
            run. The name of a machine may have slashes, so they are not counted.
    """
    if record["kind"] not in {"Started", "Recovered"}:
        return ""
    path = str(record["path"])
    return "" if root and path.startswith(f"{root}/") else path


class SteadyStamps:
    """Replaces the stamps of one run's records, in their order.

    The wall clock's stamp is kept as `wall_ns`.

    Threads: not thread-safe.
    """

    __slots__ = ("_begin_ns", "_begun_at", "_last_at", "_last_ns", "_root")

    def __init__(self) -> None:
        self._begun_at: float | None = None
        self._begin_ns = 0
        self._last_at = 0.0
        self._last_ns = 0
        self._root = ""

    def fix(self, record: dict[str, Any]) -> dict[str, Any]:
        """Give a record a steady stamp, and return it; one without `t` stays as it is."""
        at, stamp_ns = record.get("t"), record["stamp_ns"]
        if not isinstance(at, float | int):
            return record
        if self._begins(record, at):
            # Another process, whose clock may be behind: what follows has not come before.
            self._begun_at, self._begin_ns = at, max(stamp_ns, self._last_ns)
        steady_ns = self.at(at)
        if abs(steady_ns - stamp_ns) > TOLERANCE_NS:
            record["stamp_ns"], record["wall_ns"] = steady_ns, stamp_ns
        self._last_at = at
        self._last_ns = max(self._last_ns, record["stamp_ns"])
        return record

    def _begins(self, record: dict[str, Any], at: float) -> bool:
        path = begun_root(record, self._root)
        self._root = path or self._root
        return bool(path) or self._begun_at is None or at < self._last_at - PROCESS_S

    def at(self, at: float) -> int:
        """Return the stamp of a time of this process [ns]; 0 before the first record."""
        if self._begun_at is None:
            return 0
        return self._begin_ns + round((at - self._begun_at) * 1e9)
