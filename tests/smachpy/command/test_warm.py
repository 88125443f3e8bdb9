"""Processes that are forked from a server: like fresh ones, whatever is killed."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from smachpy.command import warm
from smachpy.command.warm import Starter

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(900),
    pytest.mark.skipif(not warm._may_fork(), reason="needs Linux"),
]
WITHIN_S = 60

MISSION = """
import json, os, signal, sys, threading, time
from pathlib import Path

import smachpy

name = os.environ["TOLD"]
signals = sorted(signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP})


def found():
    return {
        "pid": os.getpid(),
        "alone": os.getsid(0) == os.getpgrp() == os.getpid(),
        "environment": dict(os.environ),
        "handlers": {int(n): str(signal.getsignal(n)).split(" at 0x")[0] for n in signals},
        "mask": sorted(map(int, signal.pthread_sigmask(signal.SIG_BLOCK, []))),
        "argv": sys.argv,
        "command": sys.orig_argv,
        "flags": tuple(sys.flags),
        "path": sys.path,
        "folder": os.getcwd(),
        "files": sorted(os.listdir("/proc/self/fd")),
        "standard": [os.readlink(f"/proc/self/fd/{n}") for n in range(3)],
        "threads": [thread.name for thread in threading.enumerate()],
        "word": WORD,
    }


WORD = 1
facts = {}


@smachpy.state(outcomes=["done"], preempt_timeout=0.1)  # it does not look at requests
def wait(userdata):
    facts["modules"] = sorted(sys.modules)
    # Written at once: a reader must not see the half of it.
    Path(name + "~").write_text(json.dumps(facts))
    os.replace(name + "~", name)
    go = os.environ.get("GO")
    while go and not Path(go).exists():
        time.sleep(0.01)
    return "done"


def mission():
    facts.update(found())  # before there are threads
    machine = smachpy.StateMachine(["done"], name="TOLD")
    machine.add("WAIT", wait)
    return machine
"""


@pytest.fixture
def words(tmp_path):
    file = tmp_path / "told.py"
    file.write_text(MISSION)
    return ["run", str(file), "--plain"]


@pytest.fixture
def environment(tmp_path):
    return {**os.environ, "TOLD": str(tmp_path / "told.json")}


@pytest.fixture
def starter(environment):
    starting = Starter(environment, lambda: None)
    yield starting
    starting.close()


def until(condition):
    """Wait for what other processes do."""
    deadline = time.monotonic() + WITHIN_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def told(tmp_path):
    """Return what the mission has written, when it has."""
    file = tmp_path / "told.json"
    until(file.exists)
    facts = json.loads(file.read_text())
    file.unlink()
    return facts


def lives(pid):
    try:
        with open(f"/proc/{pid}/stat") as stat:
            return stat.read().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):  # it ended as it was looked at
        return False


def ended(process):
    assert process.wait(WITHIN_S)
    return process.code


BOTH = """
import os, signal, sys, threading
from smachpy.command import warm

signal.signal(signal.SIGHUP, signal.SIG_IGN)
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1, signal.SIGTERM])
start, *words = sys.argv[1:]
environment = {**os.environ, "EXTRA": "secret"}
over = threading.Event()
if start == "warm":
    starter = warm.Starter(environment, over.set)
    process = starter.start(words)
    starter.close()
else:
    process = warm._fresh(words, environment, over.set)
assert over.wait(60)
assert process.code == 0
"""


@pytest.mark.parametrize("flags", [(), ("-O", "-s")])
def test_a_warm_process_is_like_a_fresh_one(flags, words, environment, tmp_path):
    found = {}
    for start in ("fresh", "warm"):
        command = [sys.executable, *flags, "-c", BOTH, start, *words]
        subprocess.run(command, env=environment, check=True, cwd=tmp_path, timeout=WITHIN_S)
        found[start] = told(tmp_path)
    fresh, warmed = found["fresh"], found["warm"]
    assert warmed["alone"]
    assert warmed.pop("pid") != fresh.pop("pid")
    del warmed["modules"], fresh["modules"]  # threads import some
    assert warmed == fresh


def test_nothing_but_the_mission_is_imported_after_the_fork(words, environment, tmp_path):
    words += ["--durable", str(tmp_path / "journal.db")]
    command = warm.python_command("-m", "smachpy.command", *words)
    subprocess.run(command, env=environment, check=True)
    needed = set(told(tmp_path)["modules"]) - {"told", "runpy", "smachpy.command.__main__"}
    show = f"import sys, {', '.join(warm.NEEDED)}, smachpy.command.warm; print(*sys.modules)"
    has = subprocess.run([sys.executable, "-c", show], capture_output=True, text=True, check=True)
    assert sorted(needed - set(has.stdout.split())) == []


def test_the_server_has_one_thread_and_ends_after_its_processes(starter, words, tmp_path):
    process = starter.start(words)
    server = starter._server._process.pid
    told(tmp_path)
    assert len(os.listdir(f"/proc/{server}/task")) == 1
    starter.close()
    assert ended(process) == 0
    until(lambda: not lives(server))


def test_changed_files_are_read_anew(starter, words, environment, tmp_path):
    ended(starter.start(words))
    assert told(tmp_path)["word"] == 1
    file = tmp_path / "told.py"
    file.write_text(MISSION.replace("WORD = 1", "WORD = 2"))
    ended(starter.start(words))
    assert told(tmp_path)["word"] == 2


def test_another_server_takes_over_when_something_imported_has_changed(words, tmp_path):
    own = tmp_path / "own"
    own.mkdir()
    (own / "sitecustomize.py").write_text("import os; os.environ['TOLD'] += 'a'")
    environment = {**os.environ, "TOLD": str(tmp_path / "t"), "PYTHONPATH": str(own)}
    go = tmp_path / "go"
    starter = Starter({**environment, "GO": str(go)}, lambda: None)
    with contextlib.closing(starter):
        first = starter.start(words)
        until((tmp_path / "ta").exists)
        (own / "sitecustomize.py").write_text("import os; os.environ['TOLD'] += 'new'")
        second = starter.start(words)
        until((tmp_path / "tnew").exists)
        assert not first.over.is_set()
        go.touch()
        assert ended(first) == ended(second) == 0


@pytest.mark.parametrize(("number", "code"), [(signal.SIGKILL, -9), (signal.SIGTERM, 143)])
def test_a_process_that_is_ended_says_how(number, code, words, environment, tmp_path):
    starter = Starter({**environment, "GO": str(tmp_path / "go")}, lambda: None)
    with contextlib.closing(starter):
        process = starter.start(words)
        assert told(tmp_path)["pid"] == process.pid
        process.signal(number)
        assert ended(process) == code
        process.signal(number)  # does nothing


def test_signals_for_all_processes_of_a_service_end_the_missions(words, environment, tmp_path):
    starter = Starter({**environment, "GO": str(tmp_path / "go")}, lambda: None)
    with contextlib.closing(starter):
        process = starter.start(words)
        told(tmp_path)
        for pid in (starter._server._process.pid, process.pid):
            os.kill(pid, signal.SIGTERM)
        assert ended(process) == 143


def test_missions_outlive_a_server_that_is_killed(words, environment, tmp_path):
    go = tmp_path / "go"
    ends = threading.Semaphore(0)
    starter = Starter({**environment, "GO": str(go)}, ends.release)
    with contextlib.closing(starter):
        first, second = starter.start(words), starter.start(words)
        told(tmp_path)
        starter._server._process.kill()
        starter._server._process.wait()
        third = starter.start(words)
        assert not any(process.over.is_set() for process in (first, second, third))
        second.signal(signal.SIGKILL)
        assert ended(second) is None
        assert lives(first.pid)
        go.touch()
        assert ended(first) is None
        assert ended(third) == 0
        assert all(ends.acquire(timeout=WITHIN_S) for _ in range(3))


def test_a_server_that_was_killed_while_nothing_ran_has_a_successor(starter, words):
    assert ended(starter.start(words)) == 0
    server = starter._server
    server._process.kill()
    until(lambda: server._socket.fileno() == -1)
    assert ended(starter.start(words)) == 0


class LateEvent:
    """Wakes who waits only when no process runs any more."""

    def __init__(self, server):
        self.event, self.server = server._answered, server
        self.set, self.clear = self.event.set, self.event.clear

    def wait(self, timeout):
        woken = self.event.wait(timeout)
        until(lambda: not self.server._processes)
        return woken


def test_a_process_that_ends_before_its_start_is_known_has_ended(starter, words):
    """A runner with missions that end at once stopped with a KeyError."""
    assert ended(starter.start(words)) == 0
    starter._server._answered = LateEvent(starter._server)
    assert ended(starter.start(words)) == 0


def test_missions_outlive_a_runner_that_is_killed(words, environment, tmp_path):
    go = tmp_path / "go"
    code = (
        "import os, sys, time; from smachpy.command.warm import Starter\n"
        "starter = Starter(os.environ, lambda: None)\n"
        "print(starter.start(sys.argv[1:]).pid, starter._server._process.pid, flush=True)\n"
        "time.sleep(100)"
    )
    runner = subprocess.Popen(
        [sys.executable, "-c", code, *words],
        env={**environment, "GO": str(go)},
        stdout=subprocess.PIPE,
        text=True,
    )
    pids = [int(word) for word in runner.stdout.readline().split()]
    told(tmp_path)
    runner.kill()
    runner.wait()
    runner.stdout.close()
    assert all(map(lives, pids))
    go.touch()
    until(lambda: not any(map(lives, pids)))


def test_what_cannot_be_started_says_why(starter, words, environment, monkeypatch):
    with pytest.raises(ValueError, match="bytes of arguments"):
        starter.start([*words, "x" * 100_000])
    ended(starter.start(words))
    server = starter._server._process
    monkeypatch.setattr(warm, "ANSWER_S", 0.01)
    os.kill(server.pid, signal.SIGSTOP)
    with pytest.raises(TimeoutError, match="has not answered"):
        starter.start(words)
    server.wait()
    monkeypatch.undo()
    assert ended(starter.start(words)) == 0


def test_a_server_that_cannot_fork_says_why():
    ours, theirs = warm.socket.socketpair(warm.socket.AF_UNIX, warm.socket.SOCK_SEQPACKET)
    code = (
        "import os, socket, sys; from smachpy.command import warm\n"
        "def fork():\n    raise OSError(11, 'no more processes')\n"
        "os.fork = fork\n"
        "warm.serve(socket.socket(fileno=int(sys.argv[1])))"
    )
    with ours, theirs:
        file = theirs.fileno()
        server = subprocess.Popen([sys.executable, "-c", code, str(file)], pass_fds=[file])
        ours.send(b"[]")
        assert json.loads(ours.recv(1000)) == ["failed", "[Errno 11] no more processes"]
        ours.shutdown(warm.socket.SHUT_WR)
        assert server.wait(WITHIN_S) == 0
