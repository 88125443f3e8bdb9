"""`set_preempt_handler`: a program that ends lets its machine finish first."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

import smachpy
from actionlib_core.shutdown import Shutdown, use_shutdown
from smachpy import Concurrence, State, StateMachine, set_preempt_handler


class Tidy(State):
    """Needs some time to stop."""

    def __init__(self, seconds=2.0):
        super().__init__(["done", "preempted"])
        self.seconds = seconds
        self.ended = []

    def execute(self, ud):
        self.wait_preempt()
        self.clock().sleep(self.seconds)
        self.ended.append(self.clock().now())
        self.service_preempt()
        return "preempted"


def machine_of(state, kind=StateMachine):
    if kind is Concurrence:
        machine = Concurrence(["done", "preempted"], "preempted")
        with machine:
            machine.add("A", state)
        return machine
    machine = StateMachine(["done", "preempted"])
    with machine:
        machine.add("A", state)
    return machine


@pytest.fixture
def shutdown():
    with use_shutdown(Shutdown()) as shutdown:
        yield shutdown


@pytest.mark.parametrize("kind", [StateMachine, Concurrence])
def test_exit_preempts_and_waits(clock, shutdown, kind):
    state = Tidy()
    machine = machine_of(state, kind)
    set_preempt_handler(machine)
    task = clock.spawn(machine.execute, name="mission")
    clock.sleep(1.0)
    shutdown.leave()
    assert state.ended == [3.0]
    assert not machine.is_running()
    assert task.join(1.0)


def test_a_request_to_end_preempts(clock, shutdown):
    state = Tidy()
    machine = machine_of(state)
    set_preempt_handler(machine)
    task = clock.spawn(machine.execute, name="mission")
    clock.sleep(1.0)
    shutdown.request()
    shutdown.leave()
    assert state.ended == [3.0]
    assert task.join(1.0)


def test_the_wait_is_bounded(clock, shutdown, caplog):
    state = Tidy(9.0)
    machine = machine_of(state)
    set_preempt_handler(machine, timeout=4.0)
    task = clock.spawn(machine.execute, name="mission")
    clock.sleep(1.0)
    shutdown.leave()
    assert clock.now() == 5.0
    assert "still runs 4.0 s after its preempt" in caplog.text
    assert task.join(20.0)


def test_a_machine_that_does_not_run_is_left_alone(clock, shutdown):
    machine = machine_of(Tidy())
    set_preempt_handler(machine)
    shutdown.leave()
    assert not machine.preempt_requested()


def test_a_plain_state_is_preempted(clock, shutdown):
    state = Tidy()
    set_preempt_handler(state)
    shutdown.leave()
    assert state.preempt_requested()


def test_wait_ended_waits_for_the_run_that_is_on(clock):
    machine = machine_of(Tidy())
    assert machine.wait_ended(0.0)
    task = clock.spawn(machine.execute, name="mission")
    clock.sleep(1.0)
    assert not machine.wait_ended(1.0)
    machine.request_preempt()
    assert machine.wait_ended()
    assert clock.now() == 4.0
    assert task.join(1.0)


PROGRAM = """
import threading
import smachpy

started = threading.Event()

class Drive(smachpy.State):
    def __init__(self):
        super().__init__(["preempted"])

    def execute(self, userdata):
        started.set()
        self.wait_preempt()
        print("stopped", flush=True)
        return "preempted"

machine = smachpy.StateMachine(["preempted"])
with machine:
    machine.add("DRIVE", Drive())
smachpy.set_preempt_handler(machine)
threading.Thread(target=machine.execute, daemon=True).start()
started.wait()
"""


def test_a_program_that_ends_stops_its_machine():
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=100, check=True
    )
    assert (result.stdout, result.stderr) == ("stopped\n", "")


TERMINATED = (
    PROGRAM.replace("started.wait()", "started.wait(); print('ready', flush=True)")
    + """
from actionlib_core import shutdown
shutdown.event().wait()
"""
)
IN_MAIN = (
    PROGRAM.replace("started.set()", "print('ready', flush=True)").split("threading.Thread(")[0]
    + """
print(machine.execute(), flush=True)
"""
)


PLAIN = (
    IN_MAIN.replace("smachpy.set_preempt_handler(machine)", "import signal")
    + """
assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
"""
)


@pytest.mark.parametrize(
    ("program", "said"),
    [
        (TERMINATED, "stopped\n"),
        (IN_MAIN, "stopped\npreempted\n"),
        (PLAIN, "stopped\npreempted\n"),
    ],
)
def test_sigterm_stops_the_machine_and_lets_the_program_end(program, said):
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGTERM)
        assert process.communicate(timeout=100) == (said, "")
        assert process.returncode == 0


DEAF = IN_MAIN.replace("self.wait_preempt()", "self.clock().sleep(60.0)").replace(
    "super().__init__(", "super().__init__(preempt_timeout=None, outcomes="
)


@pytest.mark.parametrize(
    "program", [DEAF, DEAF.replace("smachpy.set_preempt_handler(machine)", "")]
)
def test_a_second_sigterm_ends_the_process(program):
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "ready\n"
        while process.poll() is None:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(0.2)
            except subprocess.TimeoutExpired:
                continue
        assert process.returncode == -signal.SIGTERM


@pytest.mark.parametrize("own", ["lambda *_: print('own', flush=True)", "signal.SIG_IGN"])
def test_a_program_that_handles_sigterm_itself_keeps_its_handler(own):
    program = IN_MAIN.replace(
        "smachpy.set_preempt_handler(machine)",
        f"import signal; own = {own}; signal.signal(signal.SIGTERM, own)",
    ).replace("self.wait_preempt()", "signal.raise_signal(signal.SIGTERM); self.sleep(0.01)")
    program += "assert signal.getsignal(signal.SIGTERM) is own"
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=100, check=True
    )
    heard = "own\n" if "print" in own else ""
    assert (result.stdout, result.stderr) == (f"ready\n{heard}stopped\npreempted\n", "")


def test_sigterm_in_another_machine_of_the_main_thread_is_given_back(clock):
    """The inner root takes no signal from the outer one, which has it."""
    inner = machine_of(Tidy())

    def run_inner(userdata):
        taken = signal.getsignal(signal.SIGTERM)
        assert taken is not signal.SIG_DFL
        clock.call_later(1.0, inner.request_preempt)
        inner.execute()
        assert signal.getsignal(signal.SIGTERM) is taken
        return "done"

    outer = smachpy.StateMachine(["done"])
    outer.add("INNER", smachpy.CBState(run_inner, outcomes=["done"]))
    assert outer.execute() == "done"
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
