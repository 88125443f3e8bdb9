"""A machine and invariants that other processes can import."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from smachpy import CBState, Concurrence, StateMachine

OUTCOMES = ["good", "bad", "preempted"]
MARK = "SMACHPY_TEST_KILLED_ONCE"
HERE = "SMACHPY_TEST_PROCESS"


def leaf():
    return CBState(print, outcomes=OUTCOMES)


def wide():
    """Three states beside each other, and one after them."""
    beside = Concurrence(OUTCOMES, default_outcome="bad", outcome_map={"good": {"A": "good"}})
    with beside:
        for name in "ABC":
            beside.add(name, leaf())
    sm = StateMachine(OUTCOMES, name="WIDE")
    with sm:
        sm.add("BESIDE", beside, {"good": "LAST", "bad": "LAST"})
        sm.add("LAST", leaf())
    return sm


def keeps(run):
    return run.outcome is not None


def last_is_good_after_bad_ones(run):
    return not (run.outcomes("A") == ("bad",) and run.outcomes("LAST") == ("bad",))


def is_killed_once(_run):
    """An invariant whose process is killed at its first run, if it is another one."""
    mark = os.environ.get(MARK)
    if mark and os.environ[HERE] != str(os.getpid()) and not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return True


def kills_others(_run):
    if os.environ[HERE] != str(os.getpid()):
        os.kill(os.getpid(), signal.SIGKILL)
    return True


def other_there():
    """A machine that has more choices in another process."""
    is_here = os.environ[HERE] == str(os.getpid())
    sm = StateMachine(OUTCOMES, name="OTHER")
    sm.add("A", CBState(print, outcomes=OUTCOMES if is_here else ["good"]), {"bad": "A"})
    return sm
