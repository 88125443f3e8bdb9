"""Runs that the page reproduces, and tests that it writes of them; each is a process."""

from __future__ import annotations

import json
import re
import shutil
import signal
import tempfile
import threading
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from actionlib_core.clock import RealClock
from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.process.private_files import open_private
from smachpy.command import EXIT_ERROR
from smachpy.exceptions import SmachError
from smachpy_viz.live.runs import AGAIN, read_for_page
from smachpy_viz.live.started_commands import (
    STOP_S,
    end_all,
    last_line,
    send_signal,
    start_command,
)

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable, Iterable

    from smachpy_viz.live.machines import Machines

MAX_RUNNING: Final = 2
"""Reproductions at the same time; each uses a core."""

MAX_KEPT: Final = 10
"""Reproductions whose results are kept: the newest ones."""

LARGEST_TEST: Final = 1_000_000
"""Longest test that is shown [bytes]."""

MAX_OUTCOME_LENGTH: Final = 200


class ReproductionRequestError(SmachError):
    """A run cannot be reproduced from the page.

    Try: `smachpy runs reproduce FILE` in a terminal, which says more.
    """


@dataclass(slots=True)
class Found:
    """What a reproduction has found.

    Attributes:
        kind: "same", "differs", "failed" (it cannot be reproduced), or "test" (one was written).
        text: For people.
        same, events: Numbers of recorded events: the same ones, and all that are compared.
        difference: The first one (`smachpy.reproduce.compare.Difference`).
        changed, notes: What has changed, and what was lacking, in words.
        machine: Name of the machine that shows the run of today, "" without one.
        test, file: The test that was written, and a name for its file.
    """

    kind: Literal["same", "differs", "failed", "test"]
    text: list[str] = field(default_factory=list)
    same: int = 0
    events: int = 0
    difference: dict[str, Any] | None = None
    changed: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    machine: str = ""
    test: str = ""
    file: str = ""


@dataclass(slots=True)
class _Started:
    """One reproduction: what was asked, and what came of it."""

    id: str
    what: str  # "run" or "test"
    file: Path
    folder: Path
    process: subprocess.Popen[str]
    stopped: bool = False
    problem: str = ""
    found: Found | None = None

    @property
    def machine(self) -> str:
        """Name of the machine that shows the run of today."""
        return f"{self.file.name}{AGAIN}{self.id}"

    @property
    def output(self) -> Path:
        """The file that the command writes."""
        word = re.sub(r"[^A-Za-z0-9_]", "_", self.file.stem)[:60]
        return self.folder / (f"test_{word}.py" if self.what == "test" else f"{self.id}.jsonl")


class Reproductions:
    """Reproduces recorded runs in processes: today's code of installed or allowed missions.

    Args:
        machines: The known machines; a run of today becomes one of them.
        file_of: Returns the recording of a machine's run, None without one; blocks.
        allow: Places whose missions recordings may name, besides the installed ones.

    Threads: every method may be called from any thread; `start` reads files.
    """

    def __init__(
        self,
        machines: Machines,
        file_of: Callable[[str], Path | None],
        allow: Iterable[str] = (),
    ) -> None:
        self._machines = machines
        self._file_of = file_of
        self._allow = list(allow)
        self._clock = RealClock()
        self._lock = threading.Lock()
        self._folder: Path | None = None  # of this viewer's, removed at its end
        self._known: dict[str, _Started] = {}
        self._tasks: list[Any] = []
        self._count = 0

    def start(self, asked: dict[str, Any]) -> str:
        """Begin to reproduce a machine's run, or to write a test of it; return an id.

        Args:
            asked: `machine`; `what`, "run" or "test"; `expect`, the outcome that a test is to
                expect, or "" for what was recorded.

        Raises:
            ReproductionRequestError: the request makes no sense, the run has no recording, or too
                many run.
        """
        name, what, expect = asked.get("machine"), asked.get("what"), asked.get("expect", "")
        if what not in ("run", "test"):
            raise ReproductionRequestError(f"what: got {what!r:.80}; expected run or test.")
        if (
            not isinstance(expect, str)
            or len(expect) > MAX_OUTCOME_LENGTH
            or not expect.isprintable()
        ):
            raise ReproductionRequestError(f"expect: got {expect!r:.80}; expected an outcome.")
        if not isinstance(name, str) or self._machines.get(name) is None:
            raise ReproductionRequestError(f"machine: got {name!r:.80}; expected one shown here.")
        file = self._file_of(name)
        if file is None:
            raise ReproductionRequestError(
                f"{name}: got a run without a recording; expected one. Try smachpy run --record "
                "FILE, and open the file."
            )
        with self._lock:
            if sum(one.process.poll() is None for one in self._known.values()) >= MAX_RUNNING:
                raise ReproductionRequestError(
                    f"reproductions: got {MAX_RUNNING} running ones; expected fewer. Wait, or stop "
                    "one."
                )
            self._count += 1
            number = str(self._count)
            try:
                self._folder = self._folder or Path(tempfile.mkdtemp(prefix="smachpy-again-"))
                folder = self._folder / number
                folder.mkdir(0o700)
                one = _Started(number, what, file.absolute(), folder, None)  # type: ignore[arg-type]
                with open_private(folder / "errors.txt", "w") as errors:
                    one.process = start_command(self._words(one, expect), errors)
            except OSError as error:
                raise ReproductionRequestError(
                    f"reproductions: {error.strerror or error}."
                ) from error
            self._known[number] = one
            while len(self._known) > MAX_KEPT:
                self._forget(next(iter(self._known)))
        self._tasks.append(self._clock.spawn(lambda: self._follow(one), name=f"again {number}"))
        return number

    def row(self, number: str) -> dict[str, Any]:
        """Return a reproduction: `running`, `problem` and `found` (`Found`), None until it ends.

        Raises:
            ReproductionRequestError: there is none.
        """
        with self._lock:
            one = self._known.get(number)
            if one is None:
                raise ReproductionRequestError(
                    f"id: got {number!r:.80}; expected one of this viewer."
                )
            found = None if one.found is None else asdict(one.found)
            return {
                "running": found is None and not one.problem,
                "problem": one.problem,
                "found": found,
            }

    def stop(self, number: object) -> None:
        """Interrupt a reproduction, and kill it after `STOP_S`.

        Raises:
            ReproductionRequestError: there is none.
        """
        with self._lock:
            one = self._known.get(number) if isinstance(number, str) else None
            if one is None:
                raise ReproductionRequestError(
                    f"id: got {number!r:.80}; expected one of this viewer."
                )
            one.stopped = True
        send_signal(one.process, signal.SIGINT)
        self._clock.call_later(STOP_S, lambda: self._kill(one))

    def close(self) -> None:
        """End all processes, and remove what they wrote.

        Blocks: until they have ended, a few seconds at most.
        """
        with self._lock:
            known, tasks = list(self._known.values()), list(self._tasks)
        end_all(one.process for one in known if one.process.poll() is None)
        for task in tasks:
            task.join(STOP_S)
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)

    # -- parts -----------------------------------------------------------------------------------

    def _words(self, one: _Started, expect: str) -> list[str]:
        words = ["runs", "reproduce", str(one.file)]
        # With "=", a text that begins with a dash cannot be taken for an option.
        words += [f"--allow={place}" for place in self._allow]
        if one.what == "run":
            return [*words, "--json", f"--record={one.output}"]
        words += ["--beside-mission", f"--output={one.output}"]
        return [*words, *([f"--expect={expect}"] if expect else [])]

    def _kill(self, one: _Started) -> None:
        if one.process.poll() is None:
            send_signal(one.process, signal.SIGKILL)

    def _forget(self, number: str) -> None:
        one = self._known.pop(number)
        self._kill(one)
        self._machines.forget(one.machine)

    def _follow(self, one: _Started) -> None:
        """Wait for the end of a process, and take what it has found."""
        said, _ = one.process.communicate()
        found, problem = None, ""
        try:
            found = self._run_of(one, said) if one.what == "run" else self._test_of(one, said)
        except (OSError, ValueError, KeyError, SmachError):
            problem = "it was stopped" if one.stopped else last_line(one.folder / "errors.txt")
        with self._lock:
            one.found, one.problem = found, problem

    def _run_of(self, one: _Started, said: str) -> Found:
        verdict = json.loads(said.partition("\n")[0])  # what follows is the mission's, at its end
        found = Found(
            kind=verdict["result"],
            text=[str(line).removeprefix(f"{one.file}: ") for line in verdict["text"]],
            **{
                name: verdict[name] for name in ("same", "events", "difference", "changed", "notes")
            },
        )
        if found.kind != "failed":
            self._machines.load(one.machine, read_for_page(one.output))
            found.machine = one.machine
        return found

    def _test_of(self, one: _Started, said: str) -> Found:
        if one.process.returncode >= EXIT_ERROR:
            raise ReproductionRequestError("no test was written.")
        test = read_limited(one.output, LARGEST_TEST).decode()
        # The first line is the name of the file.
        notes = [line.strip().removeprefix("note: ") for line in said.splitlines()[1:]]
        return Found(kind="test", test=test, file=one.output.name, notes=notes)
