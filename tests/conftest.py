"""What every test gets: a watch for leaked threads and processes, a virtual clock, a network."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.wire.private_network import FIRST_PRIVATE_DOMAIN

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

# Test runs on one machine, and the workers of one run, do not find each other's processes.
if "SMACHPY_DOMAIN" not in os.environ or "PYTEST_XDIST_WORKER" in os.environ:
    # Below the private domains, of which another worker may take the one that has this number.
    os.environ["SMACHPY_DOMAIN"] = str(1 + os.getpid() % (FIRST_PRIVATE_DOMAIN - 1))

# Runs that are viewed are kept, but not those of tests; a folder that cannot be made keeps none.
os.environ["SMACHPY_RUNS"] = os.devnull

# A shell's background job ignores Ctrl-C and SIGQUIT, a job of `nohup` SIGHUP, and so would all that they start.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGQUIT, signal.SIG_DFL)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

# A busy computer is no failure: pytest's timeout is the only one. Each run tries the same examples, so a build fails
# for what its change did, and `make search` looks for others. Continuous integration tries twice as many.
ANY_SPEED = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True)
settings.register_profile(
    "suite", ANY_SPEED, max_examples=100 if os.environ.get("CI") else 50, derandomize=True
)
settings.register_profile("search", ANY_SPEED, max_examples=int(os.environ.get("EXAMPLES", "2000")))
settings.load_profile("suite")

# Threads that a clock keeps for a few seconds, without work.
CACHED = {"idle", "clock-timers"}
HOUR_S = 3600.0
GRACE_S = 60.0  # a thread that is about to end takes a moment, on a busy computer a long one


def _threads() -> set[threading.Thread]:
    # Dummies are threads of libraries, zenoh's for one; they belong to no test.
    every = threading.enumerate()
    return {t for t in every if t.name not in CACHED and not isinstance(t, threading._DummyThread)}


def _children() -> set[str]:
    children: set[str] = set()
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:  # none, as nearly always; a look at each thread takes much longer
        return children
    for task in Path("/proc/self/task").iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # the thread has ended
            children.update((task / "children").read_text().split())
    return children


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Let no garbage collection look at the tests and all modules that they import: they stay."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture(autouse=True)
def no_leaks() -> Iterator[None]:
    """Fail a test that leaves a thread or a process behind."""
    threads, children = _threads(), _children()
    yield
    deadline = time.monotonic() + GRACE_S
    # A thread that becomes idle in a cache does not end, so look again in short intervals.
    while (left := _threads() - threads) and time.monotonic() < deadline:
        next(iter(left)).join(0.005)
    assert not left, f"threads left behind: {sorted(t.name for t in left)}"
    assert not _children() - children, f"processes left behind: {_children() - children}"


@pytest.fixture(autouse=True)
def no_hurry() -> Iterator[None]:
    """Let explorations end by the number of their runs: a busy computer takes long for a few."""
    exploration = sys.modules.get("smachpy.testing.exploring.exploration")
    if exploration is None:
        yield
        return
    defaults = exploration.explore.__kwdefaults__
    usual, defaults["max_time"] = defaults["max_time"], HOUR_S
    yield
    defaults["max_time"] = usual


@pytest.fixture
def clock() -> Iterator[VirtualClock]:
    """A virtual clock, in force for the test."""
    with VirtualClock() as clock, use_clock(clock):
        yield clock
