"""Whatever asks a program to end stops its machines first, and the robot: in real processes."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import select
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from actionlib_core import SimpleActionServer
from actionlib_core.config import Config
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.node import Node
from actionlib_core.transport.zenoh import ZenohTransport

pytestmark = [pytest.mark.zenoh, pytest.mark.slow]

LONG_S = 120.0
DRIVES = """
import smachpy
from smachpy.states import Pose2D, drive_to

def mission():
    sm = smachpy.StateMachine(["succeeded", "aborted", "preempted"], name="GO")
    sm.add("DRIVE", drive_to(Pose2D(1.0, 2.0, 0.0)))
    return sm

if __name__ == "__main__":
    print(mission().execute(), flush=True)
"""
IN_A_THREAD = """
import threading
import go

threading.Thread(target=go.mission().execute, daemon=True).start()
input()
"""
CLEANS_UP = """
import smachpy
from smachpy.states import Pose2D, drive_to

def mission():
    sm = smachpy.StateMachine(["succeeded", "aborted", "preempted"], name="GO")
    wait = smachpy.CBState(lambda ud: print("waits", flush=True) or smachpy.current_state().sleep(60)
                           and "preempted", outcomes=["preempted"])
    sm.add("WAIT", wait, {"preempted": "HOME"})
    sm.add("HOME", drive_to(Pose2D(0.0, 0.0, 0.0)))
    return sm
"""
IN_A_SCRIPT = """
import smachpy
import go

print(smachpy.run_durable(go.mission(), ".smachpy/journal.db", mission="go"), flush=True)
"""
GOAL = "{target_pose: {header: {frame_id: map}, pose: {orientation: {w: 1.0}}}}"


class Robot:
    """An action server `move_base` that drives until it is told to stop."""

    def __init__(self):
        self.began, self.stopped, self.arrive = (threading.Event() for _ in range(3))
        self.goals = 0
        domain = int(os.environ["SMACHPY_DOMAIN"])
        self.node = Node("robot", transport=ZenohTransport(Config(domain=domain)))
        self.server = SimpleActionServer("move_base", MoveBaseAction, self._drive, node=self.node)

    def _drive(self, _goal):
        self.stopped.clear()
        self.goals += 1
        self.began.set()
        deadline = time.monotonic() + LONG_S
        while time.monotonic() < deadline and not self.arrive.is_set():
            if self.server.wait_preempt(0.05):
                self.server.set_preempted()
                self.stopped.set()
                return
        self.server.set_succeeded()


@pytest.fixture
def robot():
    made = Robot()
    yield made
    made.server.stop()
    made.node.close()
    made.node.transport.close()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "go.py").write_text(DRIVES)
    (tmp_path / "in_a_thread.py").write_text(IN_A_THREAD)
    (tmp_path / "cleans_up.py").write_text(CLEANS_UP)
    (tmp_path / "in_a_script.py").write_text(IN_A_SCRIPT)
    (tmp_path / ".smachpy").mkdir()
    return tmp_path


def program(name):
    return str(Path(sys.executable).with_name(name))


WAYS = {
    "smachpy run": [program("smachpy"), "run", "go.py"],
    "smachpy run --plain": [program("smachpy"), "run", "go.py", "--plain"],
    "script": [sys.executable, "go.py"],
    "send_goal": [program("actionlib"), "send_goal", "move_base", GOAL],
}
OWN = {"script"}  # their exit code is the script's own


class InTerminal:
    """A program in a terminal of its own, whose shell it is."""

    def __init__(self, words, folder):
        self.said = b""
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            try:
                os.chdir(folder)
                os.execv(words[0], words)
            finally:
                os._exit(99)

    def read_until(self, event):
        """Read its output, or it would block, until the event is set."""
        deadline = time.monotonic() + LONG_S
        while not event.is_set():
            assert time.monotonic() < deadline, self.said.decode()
            if select.select([self.terminal], [], [], 0.05)[0]:
                try:
                    self.said += os.read(self.terminal, 65536)
                except OSError:  # nobody has it open: `nohup` has replaced it
                    event.wait(LONG_S)

    def wait(self):
        """Return its exit code, once it has ended."""
        code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        self.pid = 0
        return code

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.pid:
            os.kill(self.pid, signal.SIGKILL)
            self.wait()
            with contextlib.suppress(OSError):  # the test has closed it
                os.close(self.terminal)


@contextlib.contextmanager
def started(words, folder, **more):
    process = subprocess.Popen(
        words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("way", WAYS)
def test_a_closed_terminal_stops_the_robot(robot, folder, way):
    """The process died of SIGHUP without a cancel, and the robot drove on."""
    with InTerminal(WAYS[way], folder) as shown:
        shown.read_until(robot.began)
        os.close(shown.terminal)
        assert robot.stopped.wait(LONG_S)
        assert shown.wait() == (0 if way in OWN else 128 + signal.SIGHUP)


@pytest.mark.parametrize(
    ("way", "number"),
    [
        ("smachpy run --plain", signal.SIGQUIT),
        ("script", signal.SIGINT),
        ("script", signal.SIGTERM),
        ("script", signal.SIGQUIT),
        ("send_goal", signal.SIGQUIT),
    ],
)
def test_every_signal_that_ends_programs_stops_the_robot(robot, folder, way, number):
    with started(WAYS[way], folder) as process:
        assert robot.began.wait(LONG_S)
        process.send_signal(number)
        assert robot.stopped.wait(LONG_S)
        output = process.communicate(timeout=LONG_S)[0]
        assert process.returncode == (0 if way in OWN else 128 + number), output
        assert "Traceback" not in output


TOGETHER = """
import importlib, sys
from actionlib_core import shutdown

shutdown.ECHO_S = 60.0  # on a busy computer, much time may pass between two signals
sys.exit(importlib.import_module(sys.argv[1]).main(sys.argv[2:]))
"""


@pytest.mark.parametrize(
    ("module", "way"),
    [("actionlib_core.cli", "send_goal"), ("smachpy.command", "smachpy run --plain")],
)
def test_two_signals_that_come_together_count_once(robot, folder, module, way):
    """The second one ended `actionlib send_goal` before its cancel, and a mission's clean-up."""
    words = [sys.executable, "-c", TOGETHER, module, *WAYS[way][1:]]
    with started(words, folder) as process:
        assert robot.began.wait(LONG_S)
        process.send_signal(signal.SIGSTOP)
        os.waitpid(process.pid, os.WUNTRACED)
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGCONT):
            process.send_signal(number)
        assert robot.stopped.wait(LONG_S)
        output = process.communicate(timeout=LONG_S)[0]
        assert process.returncode in {128 + signal.SIGTERM, 128 + signal.SIGHUP}, output


@pytest.mark.parametrize("way", ["smachpy run", "script"])
def test_a_mission_under_nohup_goes_on_without_its_terminal(robot, folder, way):
    with InTerminal(["/usr/bin/nohup", *WAYS[way]], folder) as shown:
        shown.read_until(robot.began)
        os.close(shown.terminal)
        assert not robot.stopped.wait(2.0)
        os.kill(shown.pid, signal.SIGTERM)
        assert robot.stopped.wait(LONG_S)
        assert shown.wait() == (0 if way in OWN else 128 + signal.SIGTERM)


def test_a_machine_in_a_daemon_thread_stops_at_the_end_of_the_program(robot, folder):
    """The thread ended with the process, without a cancel."""
    with started([sys.executable, "in_a_thread.py"], folder, stdin=subprocess.PIPE) as process:
        assert robot.began.wait(LONG_S)
        process.stdin.write("\n")
        process.stdin.flush()
        assert robot.stopped.wait(LONG_S)
        assert process.wait(LONG_S) == 0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_second_signal_ends_the_process_and_stops_the_robot(robot, folder, number):
    """The second SIGTERM left a robot driving that was on its way home."""
    with started([program("smachpy"), "run", "cleans_up.py", "--plain"], folder) as process:
        while "waits" not in process.stdout.readline():
            pass
        process.send_signal(number)
        assert robot.began.wait(LONG_S)
        threading.Event().wait(0.6)  # later than `ECHO_S`
        process.send_signal(number)
        assert robot.stopped.wait(LONG_S)
        assert process.wait(LONG_S) in {-number, 128 + number}


BUSY = """
import time
import smachpy

def work(userdata):
    print("works", flush=True)
    for _ in range(12000):  # Python handles a signal in the instant before one long sleep after it
        time.sleep(0.05)

def mission():
    sm = smachpy.StateMachine(["done", "preempted"], name="BUSY")
    sm.add("WORK", smachpy.CBState(work, outcomes=["done"], preempt_timeout=300.0))
    return sm
"""
IN_CONTAINER = ["unshare", "-r", "--fork", "--pid", "--mount-proc"]
BLOCKED = """
import os, signal, sys
signal.pthread_sigmask(signal.SIG_BLOCK, range(1, 32))
os.execv(sys.argv[1], sys.argv[1:])
"""


def test_a_second_sigterm_ends_process_1_of_a_container(tmp_path):
    """The system ignores signals with the default action there."""
    if subprocess.run([*IN_CONTAINER, "true"], capture_output=True).returncode:
        pytest.skip("no user namespaces here")
    (tmp_path / "busy.py").write_text(BUSY)
    words = [*IN_CONTAINER, program("smachpy"), "run", "busy.py", "--plain"]
    with started(words, tmp_path) as process:
        while "works" not in process.stdout.readline():
            pass
        (pid,) = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        try:
            os.kill(int(pid), signal.SIGTERM)
            while "asked to stop" not in process.stdout.readline():
                pass
        finally:
            os.kill(int(pid), signal.SIGTERM)
        assert process.wait(LONG_S) == 128 + signal.SIGTERM  # before the state's grace is over


@pytest.mark.parametrize("way", ["smachpy run --plain", "script", "send_goal"])
def test_a_program_that_was_started_with_blocked_signals_is_stopped_by_them(robot, folder, way):
    """Only SIGKILL ended it."""
    with started([sys.executable, "-c", BLOCKED, *WAYS[way]], folder) as process:
        assert robot.began.wait(LONG_S)
        process.send_signal(signal.SIGTERM)
        assert robot.stopped.wait(LONG_S)
        assert process.wait(LONG_S) == (0 if way in OWN else 128 + signal.SIGTERM)


# -- durable missions: a service is stopped, or a terminal closed, and the mission is not over ------

DURABLE = {
    "smachpy run": [program("smachpy"), "run", "go.py", "--durable", "--mission", "go"],
    "script": [sys.executable, "in_a_script.py"],
}


def missions(folder):
    """Return the status and outcome of the missions."""
    listed = subprocess.run(
        [program("smachpy"), "missions", "list", "--json"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return [(one["status"], one["outcome"]) for one in json.loads(listed.stdout)]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGQUIT])
@pytest.mark.parametrize("way", DURABLE)
def test_a_signal_suspends_a_durable_mission_which_follows_its_goal_later(
    robot, folder, way, number
):
    """SIGTERM ended it for good, where `kill -9` kept it."""
    with started(DURABLE[way], folder) as process:
        assert robot.began.wait(LONG_S)
        process.send_signal(number)
        output = process.communicate(timeout=LONG_S)[0]
        assert process.returncode == 128 + number, output
        assert ("suspended by" in output) == (way == "smachpy run")
    assert missions(folder) == [("interrupted", None)]
    assert not robot.stopped.is_set()
    robot.arrive.set()
    with started(DURABLE[way], folder) as process:
        output = process.communicate(timeout=LONG_S)[0]
        assert "succeeded" in output
    assert missions(folder) == [("ended", "succeeded")]
    assert robot.goals == 1


@pytest.mark.parametrize("way", DURABLE)
def test_ctrl_c_ends_a_durable_mission_as_the_operator_of_its_terminal_has_asked(
    robot, folder, way
):
    with started(DURABLE[way], folder) as process:
        assert robot.began.wait(LONG_S)
        process.send_signal(signal.SIGINT)
        assert robot.stopped.wait(LONG_S)
        assert process.wait(LONG_S) == (0 if way in OWN else 130)
    assert missions(folder) == [("ended", "preempted")]


def test_a_closed_terminal_suspends_a_durable_mission(robot, folder):
    with InTerminal(DURABLE["smachpy run"], folder) as shown:
        shown.read_until(robot.began)
        os.close(shown.terminal)
        assert shown.wait() == 128 + signal.SIGHUP
    assert missions(folder) == [("interrupted", None)]
    assert not robot.stopped.is_set()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_end_of_a_runner_suspends_its_missions(robot, folder, number):
    subprocess.run(
        [program("smachpy"), "submit", "go.py"], cwd=folder, check=True, capture_output=True
    )
    with started([program("smachpy"), "runner", "--allow", "."], folder) as process:
        assert robot.began.wait(LONG_S)
        process.send_signal(number)
        assert process.wait(LONG_S) == 0
    assert missions(folder) == [("interrupted", None)]
    assert not robot.stopped.is_set()


DEVICE = """
import os
import signal
import sys
from actionlib_core import Service, SimpleActionClient, server
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal, TestResult
from actionlib_core.interfaces.std_srvs.srv import Trigger

way, number = sys.argv[1], int(sys.argv[2])

@server("lift", TestAction)
def lift(goal, ctx):
    try:
        while signal.getsignal(number) is signal.SIG_DFL:  # until the main thread waits
            ctx.sleep(0.01)
        print("moves", flush=True)
        while not ctx.sleep(0.05):
            pass
        return TestResult(1)
    finally:
        os.kill(os.getpid(), signal.SIGHUP)  # the echo, as of a closed terminal
        print("stands", flush=True)

running = lift.start()
client = SimpleActionClient("lift", TestAction)
client.wait_for_server()
client.send_goal(TestGoal(1))
if way == "wait":
    running.wait()
else:
    Service("ready", Trigger, lambda request: (True, "")).spin()
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
@pytest.mark.parametrize("way", ["wait", "spin"])
def test_a_signal_stops_the_device_of_a_server(folder, way, number):
    """The process died at once: `finally` did not run, and the device moved on."""
    (folder / "device.py").write_text(DEVICE)
    with started([sys.executable, "device.py", way, str(int(number))], folder) as device:
        assert device.stdout.readline() == "moves\n"
        device.send_signal(number)
        assert device.communicate(timeout=LONG_S)[0] == "stands\n"
        assert device.returncode == 128 + number
