"""The option `--on`: runs at the workers of a Dask scheduler, instead of in processes here."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import platform
import sys
from importlib.metadata import PackageNotFoundError, distributions, version
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actionlib_core.clock import RealClock
from actionlib_core.process.output import printable
from smachpy.base.workers import cores

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator, Sequence

    from smachpy.base.cluster import Cluster

OWN: Final = ("actionlib_core", "smachpy", "smachpy_viz", "smachpy_missions")
PERIOD_S: Final = 0.1
CODE: Final = frozenset({".py", ".yaml", ".yml", ".plan", ".pnml", ".xml", ".scxml"})


def add_jobs_and_on(parser: argparse.ArgumentParser) -> None:
    """Add the options `--jobs` and `--on`, of which one can be given."""
    from actionlib_core.command_line.numbers import between

    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--jobs",
        type=between(1, 100_000),
        metavar="N",
        help="runs at the same time (default: one per core)",
    )
    group.add_argument(
        "--on",
        metavar="tcp://HOST:PORT",
        help="do the runs at the workers of this Dask scheduler, on other computers",
    )


@contextlib.contextmanager
def opened_cluster(
    address: str | None, mission: str = "", allow: Sequence[str] = ()
) -> Iterator[Cluster | None]:
    """Use the workers of a scheduler within the block; those with other code are refused, and said.

    Args:
        address: Of the scheduler; None: yields None.
        mission: The mission, by a name that all computers know (`whole_target`); "": none.
        allow: Places of code that is used besides it.

    Raises:
        ClusterError: there is no scheduler, or no worker can be used.
        ImportError: the extra is not installed; `smachpy.command.extras.advice` says so.
    """
    if address is None:
        yield None
        return
    from smachpy.base.cluster import Cluster

    def say(line: str) -> None:
        print(printable(line), file=sys.stderr)

    given = (mission, tuple(allow), _packages())
    with Cluster(address, code_facts, given, say) as cluster:
        yield cluster


def whole_place(place: str) -> str:
    """Return a place of code as other computers know it: a file or folder with its whole path."""
    return str(Path(place).resolve()) if Path(place).exists() else place


def workers_text(cluster: Cluster | None, jobs: int | None, runs: int) -> str:
    """Return who does the runs, for the line of progress."""
    if cluster is not None:
        return f"{cluster.workers} worker{'s' * (cluster.workers != 1)}"
    count = min(jobs or cores(), runs)
    return f"{count} process{'es' * (count != 1)}"


def code_facts(mission: str, allow: Sequence[str], packages: Sequence[str]) -> dict[str, str]:
    """Return what must be the same on all computers, by name.

    Args:
        mission: The mission, or "".
        allow: Files, folders and modules.
        packages: Distributions whose versions count.

    Raises:
        TargetError: there is no such mission.
    """
    from smachpy.command.evidence import mission_facts
    from smachpy.command.targets import load_target

    # A mission file is data: no code that it names is run here.
    facts = {"Python": platform.python_version(), "smachpy": _hash_of(OWN)}
    if mission:
        target = load_target(mission, imports=False, allow=allow)
        facts[f"mission {mission}"] = mission_facts(target, mission)["hash"]
    for place in allow:
        facts[f"code {place}"] = _hash_of([place])
    for name in packages:
        with contextlib.suppress(PackageNotFoundError):
            facts[name] = version(name)
    return facts


def _packages() -> list[str]:
    """Return the installed distributions of which this program has loaded modules."""
    loaded = {name.partition(".")[0] for name in sys.modules}
    found = set()
    for one in distributions():
        name = one.metadata["Name"]
        top = {str(path).partition("/")[0].removesuffix(".py") for path in one.files or ()}
        if name != "smachpy" and top & loaded:
            found.add(name)
    return sorted(found)


def _hash_of(places: Sequence[str]) -> str:
    """Return one hash of the code of absolute files and folders, and of modules."""
    found = hashlib.sha256()
    for place in places:
        path = Path(place)
        if not path.is_absolute():
            try:
                spec = importlib.util.find_spec(place)
            except (ImportError, ValueError):
                spec = None
            if spec is None or spec.origin is None:
                continue
            path = Path(spec.origin)
            path = path.parent if path.name == "__init__.py" else path
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.suffix in CODE and file.is_file():
                found.update(file.relative_to(path).as_posix().encode())
                found.update(hashlib.sha256(file.read_bytes()).digest())
    return found.hexdigest()[:16]


class ProgressLine:
    """Shows in a terminal how many runs have been done, how many a second, and by whom.

    Args:
        what: What is counted, after the number.
        who: Who does it.
        shown: Whether to show it; None: if standard error is a terminal.
    """

    def __init__(self, what: str, who: str, *, shown: bool | None = None) -> None:
        self._what, self._who = what, who
        self._clock = RealClock()
        self._begun = self._shown_at = self._clock.now()
        self._shown = sys.stderr.isatty() if shown is None else shown

    def show(self, done: int) -> None:
        """Show the number; not more often than people read."""
        now = self._clock.now()
        if not self._shown or now - self._shown_at < PERIOD_S:
            return
        self._shown_at = now
        rate = done / max(1e-3, now - self._begun)
        text = f"{done:d} {self._what}, {rate:.2g} per s, {self._who}"
        sys.stderr.write(f"\r{printable(text)}\x1b[K")
        sys.stderr.flush()

    def end(self) -> None:
        """Remove the line from the terminal."""
        if self._shown:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()
