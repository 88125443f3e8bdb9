"""Goals over the bridge to ROS 1, beside those from ROS 1 to ROS 1, in one run.

    .ci/ros1; python benchmarks/ros1_bridge.py [--json] [--goals 200] [--pause 0.01]

Client and server are on rospy's actionlib or on ours, each in a process of its own, the bridge in a
third; "bridge inside" has it in our client's process, as `smachpy run --ros1-robot` does. The pairs
take turns, so that a busy computer slows all; look at the ratios. All are the simple clients and
servers; a goal ends at once, and the client waits `--pause` [s] between two goals: after a pause
each of the processes has to be woken, which the bridge has more of.
The action of the first pair is one that the bridge does not carry.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import statistics
import subprocess
import sys
import time
from pathlib import Path

ROS_PYTHON = "/usr/bin/python3"
BATCH = 50

ROS_SERVER = """
import sys
import actionlib, rospy
from actionlib.msg import TestAction, TestResult
rospy.init_node("bench_ros_server")

def serve(name):
    def execute(goal):
        server.set_succeeded(TestResult(goal.goal))

    server = actionlib.SimpleActionServer(name, TestAction, execute, auto_start=False)
    server.start()
    return server

servers = [serve(name) for name in sys.argv[1:]]
print("ready", flush=True)
rospy.spin()
"""

ROS_CLIENT = """
import json, sys, time
import actionlib, rospy
from actionlib.msg import TestAction, TestGoal
rospy.init_node("bench_ros_client")
clients = {}
print("ready", flush=True)
for line in sys.stdin:
    name, count, pause = line.split()
    if name not in clients:
        clients[name] = actionlib.SimpleActionClient(name, TestAction)
        clients[name].wait_for_server()
    times = []
    for number in range(int(count)):
        if float(pause):
            time.sleep(float(pause))
        start = time.perf_counter()
        clients[name].send_goal(TestGoal(number))
        if clients[name].wait_for_result(rospy.Duration(10)):  # ROS 1 loses one now and then
            times.append(time.perf_counter() - start)
    print(json.dumps(times), flush=True)
"""


def serve() -> None:
    """Run our server until standard input ends."""
    from actionlib_core import SimpleActionServer
    from actionlib_core.interfaces.actionlib.msg import TestAction, TestResult

    server = SimpleActionServer(
        "here", TestAction, lambda goal: server.set_succeeded(TestResult(goal.goal))
    )
    print("ready", flush=True)
    sys.stdin.read()


def send(client, count: int, pause: float) -> list[float]:
    """Send goals one after another; return how long each took [s]."""
    from actionlib_core.interfaces.actionlib.msg import TestGoal

    times = []
    for number in range(count):
        if pause:
            time.sleep(pause)
        start = time.perf_counter()
        client.send_goal(TestGoal(number))
        assert client.wait_for_result(10.0)
        times.append(time.perf_counter() - start)
    return times


class Processes:
    """The children of a run."""

    def __init__(self) -> None:
        with socket.create_server(("127.0.0.1", 0)) as probe:
            port = probe.getsockname()[1]
        self.master = f"http://127.0.0.1:{port}"
        self._environment = {
            **{k: v for k, v in os.environ.items() if not k.startswith("PYTHON")},
            "ROS_MASTER_URI": self.master,
            "ROS_IP": "127.0.0.1",
        }
        self._children: list[subprocess.Popen] = []
        self.start(["rosmaster", "--core", "-p", str(port)], ready=False)

    def start(self, command: list[str], *, ready: bool = True) -> subprocess.Popen:
        child = subprocess.Popen(
            command,
            env=self._environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE if ready else subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._children.append(child)
        if ready:
            assert "ready" in child.stdout.readline()
        return child

    def end(self) -> None:
        for child in reversed(self._children):
            child.terminate()
        for child in self._children:
            child.communicate()


def measure(goals: int, pause: float) -> dict[str, list[float]]:
    from actionlib_core import SimpleActionClient, ros1
    from actionlib_core.interfaces.actionlib.msg import TestAction

    inside = None
    processes = Processes()
    try:
        smachpy = str(Path(sys.executable).parent / "smachpy")
        names = ["--action", "in_ros", "--action", "here"]
        processes.start([smachpy, "bridge", "ros1", "--master", processes.master, *names])
        processes.start([ROS_PYTHON, "-c", ROS_SERVER, "in_ros", "inside", "alone"])
        processes.start([sys.executable, __file__, "--serve"])
        in_ros = processes.start([ROS_PYTHON, "-c", ROS_CLIENT])
        names = ("in_ros", "inside", "here")
        ours = {name: SimpleActionClient(name, TestAction) for name in names}
        inside = ros1.bridge(processes.master, actions={"inside": "actionlib/Test"})
        for client in ours.values():
            assert client.wait_for_server(20.0)

        def from_ros(name: str, count: int) -> list[float]:
            in_ros.stdin.write(f"{name} {count} {pause}\n")
            in_ros.stdin.flush()
            return json.loads(in_ros.stdout.readline())

        pairs = {
            "ROS 1 to ROS 1": lambda count: from_ros("alone", count),
            "ours to ROS 1": lambda count: send(ours["in_ros"], count, pause),
            "bridge inside": lambda count: send(ours["inside"], count, pause),
            "ROS 1 to ours": lambda count: from_ros("here", count),
            "ours to ours": lambda count: send(ours["here"], count, pause),
        }
        times: dict[str, list[float]] = {name: [] for name in pairs}
        for exchange in pairs.values():
            exchange(BATCH)
        while len(times["ours to ours"]) < goals:
            for name, exchange in pairs.items():
                times[name] += exchange(BATCH)
        return times
    finally:
        if inside is not None:
            inside.close()
        processes.end()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--goals", type=int, default=200)
    parser.add_argument("--pause", type=float, default=0.01)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.serve:
        serve()
        return
    figures = {}
    for name, times in measure(args.goals, args.pause).items():
        cuts = statistics.quantiles(times, n=100)
        figures[name] = {"p50_ms": cuts[49] * 1e3, "p99_ms": cuts[98] * 1e3}
    if args.json:
        print(json.dumps(figures))
        return
    base = figures["ROS 1 to ROS 1"]
    for name, each in figures.items():
        p50, p99 = each["p50_ms"], each["p99_ms"]
        ratios = f"{p50 / base['p50_ms']:5.2f} and {p99 / base['p99_ms']:5.2f} x ROS 1"
        print(f"{name:16} p50 {p50:6.2f} ms  p99 {p99:7.2f} ms  {ratios}")


if __name__ == "__main__":
    main()
