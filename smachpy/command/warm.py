"""Starts the processes of missions from one that has imported everything they need.

A fresh Python takes most of the CPU time of a short mission, to import. So a runner has a server:
a process that imports the modules of `smachpy run`, starts nothing, and forks for each mission.
What is the mission's own comes after the fork: its file, its sessions, its threads. The new process
is like a fresh one: it has a session of its own, the environment, mask and signal handlers that the
server was started with, and returns from the fork to the end of this module, as `python -m` would.

If a file that the server has imported, or what is installed, has changed since, another server
takes its place.
"""

from __future__ import annotations

import contextlib
import dataclasses
import gc
import importlib
import json
import os
import select
import signal
import site
import socket
import subprocess
import sys
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actionlib_core import shutdown
from actionlib_core.clock import RealClock
from actionlib_core.shutdown.child_process import python_command

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from actionlib_core.clock import Event

ANSWER_S: Final = 30.0
"""Longest wait for the pid of a new process; importing takes about a second [s]."""
NEEDED: Final = (
    "actionlib_core.transport.zenoh",
    "email.parser",  # of `importlib.metadata`
    "encodings.ascii",
    "smachpy.actions",
    "smachpy.checks",
    "smachpy.command.queued",
    "smachpy.command.ros1",
    "smachpy.command.run",
    "smachpy.command.mission_run",
    "smachpy.command.watching",
    "smachpy.durable.mission",
    "smachpy.durable.sqlite",
    "smachpy.foreign",
    "smachpy_viz.terminal.panel",
)
"""What `smachpy run` imports for any mission, with all that these import."""
_MESSAGE: Final = 1 << 16  # bytes of the longest message


@dataclasses.dataclass(eq=False, slots=True)
class MissionProcess:
    """A process that runs one mission.

    Attributes:
        pid: Its process id.
        over: Set when it has ended.
        code: Its exit code, negative for a signal; None while it runs, and if nobody could see it.
    """

    pid: int
    over: Event
    code: int | None = None

    def signal(self, number: int) -> None:
        """Send it a signal, unless it has ended."""
        if not self.over.is_set():
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def wait(self, timeout: float) -> bool:
        """Wait for its end; return whether it has ended. Blocks: `timeout` at most [s]."""
        return self.over.wait(timeout)


class Starter:
    """Starts processes of this command: forked from a server on Linux, else fresh ones.

    Args:
        environment: Of the processes.
        on_end: Called when one has ended.

    Threads: `start` and `close` are called from one thread, `on_end` from threads of the clock.
    """

    def __init__(self, environment: Mapping[str, str], on_end: Callable[[], object]) -> None:
        self._environment = dict(environment)
        self._on_end = on_end
        self._server: _Server | None = None

    def start(self, words: Sequence[str]) -> MissionProcess:
        """Start `smachpy WORDS`, in a session of its own: Ctrl-C here does not reach it.

        Raises:
            OSError, ValueError: it cannot be started; the text says why.

        Blocks: the first time, and after a change of files, until everything is imported.
        """
        if not _may_fork():
            return _fresh(words, self._environment, self._on_end)
        for _ in range(2):
            if self._server is None:
                self._server = _Server(self._environment, self._on_end)
            process = self._server.start(words)
            if process is not None:
                return process
            self.close()  # its files have changed, or it was killed
        raise OSError("the server of processes ends, or its files change all the time")

    def close(self) -> None:
        """Start no more processes; those that run go on."""
        if self._server is not None:
            self._server.close()
            self._server = None


def _may_fork() -> bool:
    if sys.platform != "linux":
        return False
    try:
        os.close(os.pidfd_open(os.getpid()))
    except OSError:  # an old kernel, or a container that forbids it
        return False
    return True


def _fresh(
    words: Sequence[str], environment: Mapping[str, str], on_end: Callable[[], object]
) -> MissionProcess:
    process = subprocess.Popen(  # noqa: S603  our own command
        python_command("-m", "smachpy.command", *words),
        stdin=subprocess.DEVNULL,
        env=environment,
        start_new_session=True,
    )
    clock = RealClock()
    mission = MissionProcess(process.pid, clock.event(f"end of {process.pid}"))

    def watch() -> None:
        mission.code = process.wait()
        mission.over.set()
        on_end()

    clock.spawn(watch, name=f"end of {process.pid}")
    return mission


class _Server:
    """The server, as its runner sees it: a socket. The last process that is forked outlives it."""

    def __init__(self, environment: Mapping[str, str], on_end: Callable[[], object]) -> None:
        self._clock = RealClock()
        self._on_end = on_end
        self._processes: dict[int, MissionProcess] = {}
        self._answers: deque[MissionProcess | str | None] = deque()
        self._answered = self._clock.event("answer of the server of processes")
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603  our own interpreter and module
                python_command("-m", __name__, str(theirs.fileno())),
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                env=environment,
                start_new_session=True,  # Ctrl-C is for the runner
            )
        self._clock.spawn(self._listen, name="processes of missions")

    def start(self, words: Sequence[str]) -> MissionProcess | None:
        """Fork a process; return None if another server is needed for that.

        Raises:
            OSError: there is no process, or no answer in `ANSWER_S`.
        """
        message = json.dumps(list(words)).encode()
        if len(message) > _MESSAGE:
            raise ValueError(f"got {len(message)} bytes of arguments; expected at most {_MESSAGE}")
        try:
            self._socket.send(message)
        except OSError:  # it was killed; the socket is closed once its processes have ended, too
            return None
        if not self._answered.wait(ANSWER_S):
            self._process.kill()
            raise TimeoutError(f"the server of processes has not answered for {ANSWER_S:g} s")
        self._answered.clear()
        answer = self._answers.popleft()
        if isinstance(answer, str):
            raise OSError(answer)
        return answer

    def close(self) -> None:
        """Let it end when the processes have ended that it has forked."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)

    def _listen(self) -> None:
        with self._socket:
            while message := self._receive():
                kind, *values = json.loads(message)
                if kind == "ended":
                    self._end(*values)
                    continue
                (answer,) = values
                if kind == "forked":
                    process = MissionProcess(answer, self._clock.event(f"end of {answer}"))
                    self._processes[answer] = process
                    answer = process  # its end may be told before `start` looks at this
                self._answers.append(answer)
                self._answered.set()
            self._process.wait()
            self._answers.append(None)
            self._answered.set()
            if self._processes:  # it was killed: they run on, and nobody can see their exit codes
                _wait_for_ends(self._processes, lambda pid: self._end(pid, None))

    def _receive(self) -> bytes:
        try:
            return self._socket.recv(_MESSAGE)
        except ConnectionError:
            return b""

    def _end(self, pid: int, code: int | None) -> None:
        process = self._processes.pop(pid)
        process.code = code
        process.over.set()
        self._on_end()


def _wait_for_ends(pids: Iterable[int], on_end: Callable[[int], object]) -> None:
    """Call `on_end` with each process, not of this one's children, when it has ended."""
    poll, files = select.poll(), {}
    for pid in list(pids):
        try:
            files[os.pidfd_open(pid)] = pid
        except ProcessLookupError:
            on_end(pid)
    for file in files:
        poll.register(file, select.POLLIN)
    while files:
        for file, _ in poll.poll():
            poll.unregister(file)
            os.close(file)
            on_end(files.pop(file))


# -- in the server -----------------------------------------------------------------------------


def serve(runner: socket.socket) -> list[str] | None:
    """Fork a process for each message; return its words in it, and None at the end of the server.

    That is when the runner has closed its side and all processes have ended.
    """
    _keep_serving()
    imported, asks = _state_of_files(), True
    gc.freeze()  # so that the collections of new processes do not copy what all have
    children: dict[int, int] = {}  # file of a process -> its pid
    poll = select.poll()
    poll.register(runner, select.POLLIN)
    while asks or children:
        for file, _ in poll.poll():
            if file in children:
                poll.unregister(file)
                os.close(file)
                _, status = os.waitpid(pid := children.pop(file), 0)
                _tell(runner, "ended", pid, os.waitstatus_to_exitcode(status))
            elif not (message := _read(runner)):
                poll.unregister(runner)
                asks = False
            elif _state_of_files() != imported:
                _tell(runner, "changed", None)
            elif (new := _fork(runner)) == 0:
                for opened in (runner.detach(), *children):
                    os.close(opened)
                words: list[str] = json.loads(message)
                return words
            elif new is not None:
                children[opened := os.pidfd_open(new)] = new
                poll.register(opened, select.POLLIN)
                _tell(runner, "forked", new)
    return None


def _keep_serving() -> None:
    """Ignore signals that end programs here, and let new processes handle them as before.

    If all processes of a service are told to end, its missions end first, then its runner.
    """
    before = {number: signal.getsignal(number) for number in shutdown.SIGNALS}
    for number, old in before.items():
        if old is not signal.SIG_IGN:
            signal.signal(number, lambda *_: None)

    def restore() -> None:
        for number, old in before.items():
            signal.signal(number, old)

    shutdown.restorers.append(restore)  # called while these signals are blocked


def _fork(runner: socket.socket) -> int | None:
    """Fork; return the pid, 0 in the new process, None if that was not possible."""
    try:
        pid = os.fork()
    except OSError as error:  # too many processes, or no memory
        _tell(runner, "failed", str(error))
        return None
    if pid == 0:
        os.setsid()
        importlib.invalidate_caches()  # a mission may have been installed since
    return pid


def _read(runner: socket.socket) -> bytes:
    try:
        return runner.recv(_MESSAGE)
    except ConnectionError:
        return b""


def _tell(runner: socket.socket, kind: str, *values: object) -> None:
    with contextlib.suppress(ConnectionError):  # the runner was killed: nobody needs to know
        runner.send(json.dumps([kind, *values]).encode())


def _state_of_files() -> dict[str, tuple[int, int] | None]:
    """Return time of change and size of all files that are imported, and of what is installed."""
    files = {getattr(module, "__file__", None) for module in sys.modules.copy().values()}
    # A folder changes when a package is installed or removed.
    files |= {*site.getsitepackages(), site.getusersitepackages()}
    return {file: _state_of(file) for file in files if file}


def _state_of(file: str) -> tuple[int, int] | None:
    try:
        found = Path(file).stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


def main() -> int:
    """Serve over the socket whose file number is the argument; in a new process, be `smachpy`."""
    for name in NEEDED:
        importlib.import_module(name)
    with contextlib.suppress(ImportError):  # of an extra
        importlib.import_module("smachpy.durable.postgres")
    words = serve(socket.socket(fileno=int(sys.argv[1])))
    if words is None:
        return 0
    from smachpy.command import __file__ as package
    from smachpy.command import main as command

    sys.argv = [str(Path(package).with_name("__main__.py")), *words]
    sys.orig_argv = python_command("-m", "smachpy.command", *words)
    return command()


if __name__ == "__main__":
    sys.exit(main())
