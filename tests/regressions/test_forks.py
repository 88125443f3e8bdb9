"""A process that is forked during a run gets its own signals: the run is its parent's."""

from __future__ import annotations

import os
import signal
import sys

import pytest

from actionlib_core import shutdown
from actionlib_core.shutdown import Shutdown, use_shutdown
from smachpy import CBState, Concurrence, StateMachine

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
