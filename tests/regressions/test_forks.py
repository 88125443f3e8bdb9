"""A process that is forked during a run gets its own signals: the run is its parent's."""

from __future__ import annotations

import contextlib
import os
import signal
import sys

import pytest

from actionlib_core import shutdown
from actionlib_core.clock import RealClock, SerialExecutor
from actionlib_core.clock.forks import end_copy
from actionlib_core.shutdown import Shutdown, use_shutdown
from actionlib_core.shutdown.child_process import ChildProcess
from smachpy import CBState, Concurrence, StateMachine
from smachpy.durable.opening import open_store
from smachpy.durable.store import StoreError

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork"),
    pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning"),  # 3.12, with threads
]
IGNORED = 7


def end_of_child(number):
    """Fork, send the signal to the child, and return how it ended."""
    ready, go_on = os.pipe(), os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(go_on[1])
            os.write(ready[1], b"!")
            os.read(go_on[0], 1)
            for _ in range(100):  # a signal from just before the read is handled in a loop
                pass
        except KeyboardInterrupt:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        finally:
            os._exit(IGNORED)
    os.read(ready[0], 1)
    os.kill(child, number)
    for end in (*ready, *go_on):
        os.close(end)
    return -os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def machine_of(kind, work):
    state = CBState(work, outcomes=["done"])
    if kind is Concurrence:
        machine = Concurrence(["done"], "done")
        with machine:
            machine.add("FORK", state)
        return machine
    machine = StateMachine(["done"])
    with machine:
        machine.add("FORK", state)
    return machine


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("kind", [StateMachine, Concurrence])
def test_a_signal_ends_a_process_that_a_state_has_forked(kind, number):
    """`multiprocessing.Process.terminate` did nothing, so that its `join` waited for ever."""
    if sys.version_info[:2] == (3, 13) and kind is Concurrence and number == signal.SIGINT:
        pytest.skip(
            "Python 3.13 runs no signal handler in a process forked outside the main thread"
        )
    ends = []

    def work(userdata):
        ends.append(end_of_child(number))
        return "done"

    assert machine_of(kind, work).execute() == "done"
    assert ends == [number]


def test_the_parent_is_preempted_by_signals_also_after_a_fork():
    def work(userdata):
        end_of_child(signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGTERM)
        return "done"

    with use_shutdown(Shutdown()) as ending:
        machine_of(StateMachine, work).execute()
        assert ending.reason == "SIGTERM"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_a_process_that_was_forked_in_handle_signals(number):
    with use_shutdown(Shutdown()), shutdown.handle_signals(), shutdown.handle_signals():
        assert end_of_child(number) == number


def test_a_signal_just_after_the_fork_is_not_lost(monkeypatch):
    """One worker of `multiprocessing.Pool` in fifty was not ended by `terminate`."""
    ends = []

    def work(userdata):
        # In the child, before the handlers are restored.
        monkeypatch.setattr(
            shutdown,
            "restorers",
            [lambda: os.kill(os.getpid(), signal.SIGTERM), *shutdown.restorers],
        )
        before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
        child = os.fork()
        if child == 0:
            os._exit(IGNORED)
        ends.append(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
        assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before
        return "done"

    assert machine_of(StateMachine, work).execute() == "done"
    assert ends == [-signal.SIGTERM]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_signals_are_not_blocked_in_a_child_where_a_restorer_has_raised(monkeypatch):
    def fail():
        raise RuntimeError

    monkeypatch.setattr(shutdown, "restorers", [fail, *shutdown.restorers])
    assert end_of_child(signal.SIGTERM) == signal.SIGTERM


# -- what a copy of a process must not do: wait for threads, write, end what is its parent's ---------


def in_copy(check):
    """Return whether `check` returns True in a forked process, within a few seconds."""
    child = os.fork()
    if child == 0:
        signal.alarm(20)  # it ends the process
        code = 1
        try:
            code = 0 if check() is True else 2
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_a_copy_waits_for_no_thread_of_its_parent():
    """Leaving a durable or recorded mission in a copy waited for ever, or for seconds."""
    clock = RealClock()
    over, ran = clock.event(), []
    task = clock.spawn(over.wait, name="of the parent")
    executor = SerialExecutor(clock, "of the parent")
    executor.submit(over.wait)

    def check():
        executor.submit(lambda: ran.append("in the copy"))
        ended = task.join() and executor.join() and not task.is_alive()
        clock.spawn(lambda: ran.append("own"), name="of the copy").join()
        return ended and ran == ["own"]

    try:
        assert in_copy(check)
        assert task.is_alive()
    finally:
        over.set()
        assert task.join(60)
        assert executor.join(60)


def test_a_copy_that_a_callback_has_forked_ends_with_the_callback():
    """It became a thread of the cache, which ended after five seconds."""
    clock = RealClock()
    children = []

    def fork():
        child = os.fork()
        if child == 0:
            sys.exit(IGNORED)
        children.append(child)

    executor = SerialExecutor(clock, "callbacks")
    executor.submit(fork)
    assert executor.join(60)
    assert os.waitstatus_to_exitcode(os.waitpid(children[0], 0)[1]) == IGNORED


@pytest.mark.parametrize(
    ("error", "code", "printed"),
    [
        (None, 0, b""),
        (SystemExit(), 0, b""),
        (SystemExit(IGNORED), IGNORED, b""),
        (SystemExit("gone"), 1, b"gone\n"),
        (ValueError("wrong"), 1, b"ValueError: wrong\n"),
    ],
)
def test_a_copy_ends_with_the_exit_code_of_a_program(error, code, printed, capfd):
    child = os.fork()
    if child == 0:
        sys.stderr = open(2, "w", closefd=False)  # noqa: SIM115  pytest's is not a file
        end_copy(error)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == code
    assert capfd.readouterr().err.encode() == printed


def test_a_copy_does_not_use_the_store_of_its_parent(tmp_path):
    with contextlib.closing(open_store(tmp_path / "journal.db")) as store:

        def check():
            store.close()  # does nothing
            try:
                store.missions()
            except StoreError as error:
                return "forked" in str(error)
            return False

        assert in_copy(check)
        assert store.missions() == []


def test_a_copy_does_not_end_a_process_of_its_parent(tmp_path):
    """With --start-robot, a copy that left the mission killed the robot."""
    (tmp_path / "waits.py").write_text("import sys; print('ready', flush=True); sys.stdin.read()")
    with ChildProcess("waits", environment={"PYTHONPATH": str(tmp_path)}) as robot:
        assert robot.wait_ready(60)
        assert in_copy(lambda: robot.stop() is None)
        os.kill(robot.pid, 0)
        assert robot.exit_code is None


def comes_back(error):
    if error is not None:
        raise error
    return "done"


@pytest.mark.parametrize(
    ("error", "code"), [(None, 0), (SystemExit(IGNORED), IGNORED), (ValueError("wrong"), 1)]
)
@pytest.mark.parametrize("place", ["state", "nested", "branch", "callback"])
def test_a_copy_that_comes_back_from_a_state_runs_no_other_state(place, error, code, tmp_path):
    """It ran the rest of the mission a second time, or waited for the threads of its parent."""
    ends, ran = [], tmp_path / "ran"

    def fork(*_):
        child = os.fork()
        if child == 0:
            signal.alarm(20)  # it ends the process
            return comes_back(error)
        ends.append(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
        return "done"

    def note(_userdata):
        with ran.open("a") as file:
            file.write("ran\n")
        return "done"

    inner = machine_of(Concurrence if place == "branch" else StateMachine, fork)
    machine = StateMachine(["done"])
    with machine:
        if place == "callback":
            machine.register_start_cb(fork)
        elif place == "state":
            options = {"retry": (3, 0.0, ValueError), "on_exit": lambda _ud, _out: note(None)}
            machine.add("FORK", CBState(fork, outcomes=["done"], **options), {"done": "AFTER"})
        else:
            machine.add("FORK", inner, {"done": "AFTER"})
        machine.add("AFTER", CBState(note, outcomes=["done"]))
        machine.add_cleanup("TIDY", CBState(note, outcomes=["done"]))

    assert machine.execute() == "done"
    assert ran.read_text().count("ran") == (3 if place == "state" else 2)
    # An error in the copy's thread of a branch or a callback is not told by its exit code.
    assert ends == [code if place == "state" else ends[0]]


def test_a_worker_of_a_command_is_ended_by_a_signal():
    """`multiprocessing.Pool` printed a traceback for each worker that it ended."""
    with shutdown.terminable():
        assert end_of_child(signal.SIGTERM) == signal.SIGTERM
        assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
