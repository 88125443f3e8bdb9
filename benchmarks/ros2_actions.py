"""Goals over ROS 2's wire between two processes, beside raw zenoh in the same run.

    python benchmarks/ros2_actions.py [--quick] [--json]

The floor is what a program of bare zenoh takes for the messages of such a goal: a query that is
answered (send_goal), and from its callback a second one (get_result), with payloads and attachments
of the same sizes, in two processes of its own. Lists of statuses go out beside that, one in 20 ms
at most, and nobody waits for them. `own` is a goal on our own wire between the same processes.
`rclpy` is one from rclpy to rclpy over Fast DDS in two processes of theirs, where `.ci/rclpy` has
installed it; its client waits with `spin_until_future_complete`, as Nav2's simple commander does.
All exchanges take turns, so that a busy computer slows each; look at the ratios.
`killed` is how long after SIGKILL of its server a goal is LOST.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import zenoh

sys.path.insert(0, str(Path(__file__).parent))
import actions as own  # its raw processes and its statistics

from actionlib_core import SimpleActionClient, SimpleActionServer, init
from actionlib_core.config import Config, Ros2
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal, TestResult
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node

if TYPE_CHECKING:
    from collections.abc import Callable

HOLD = {"p50_ratio": (0, 2.2), "rclpy_ratio": (10, math.inf), "killed_ms": (0, 50.0)}
RCLPY = Path(__file__).parents[1] / ".venv-rclpy" / "kilted" / "bin" / "python"
SENT, TAKEN, ASKED, ENDED = (b"x" * size for size in (24, 16, 20, 16))  # as those of a goal
ATTACHMENT = b"x" * 33


def node_config(port: int, what: str) -> Config:
    """Two peers with one link, as the raw ones have."""
    endpoint = (f"tcp/127.0.0.1:{port}",)
    ends = {"listen": endpoint} if what == "listen" else {"connect": endpoint}
    return Config(discovery="off", timestamping=True, ros2=(Ros2(),), **ends)


def serve(port: int) -> None:
    """Serve goals that end at once, and some that do not end, until standard input ends."""
    init("server", [], node_config(port, "listen"))
    server = SimpleActionServer(
        "instant", Fibonacci, lambda _: server.set_succeeded(Fibonacci.Result(sequence=[7]))
    )
    plain = SimpleActionServer("plain", TestAction, lambda _: plain.set_succeeded(TestResult(7)))
    endless = SimpleActionServer("endless", Fibonacci, lambda _: endless.wait_preempt())
    print("ready", flush=True)
    sys.stdin.read()


def raw_serve(port: int) -> None:
    """Answer raw queries until standard input ends."""
    session = zenoh.open(own.raw_config("listen", port))

    def answer(payload: bytes, query: zenoh.Query) -> None:
        with query:
            query.reply(query.key_expr, payload, attachment=ATTACHMENT, express=True)

    ends = [
        session.declare_queryable(key, own.direct(partial(answer, payload)), complete=True)
        for key, payload in (("raw/send", TAKEN), ("raw/result", ENDED))
    ]
    print("ready", flush=True)
    sys.stdin.read()
    for end in ends:
        end.undeclare()
    session.close()


def raw_client(port: int) -> None:
    """Measure as many raw exchanges as each line of standard input says [s]."""
    session = zenoh.open(own.raw_config("connect", port))
    ended = threading.Lock()
    ended.acquire()

    def ask(key: str, payload: bytes, on_reply: Callable[[zenoh.Reply], object]) -> None:
        callback = own.direct(on_reply)
        session.get(key, callback, payload=payload, attachment=ATTACHMENT, express=True)

    def exchange() -> None:
        ask("raw/send", SENT, lambda _: ask("raw/result", ASKED, lambda _: ended.release()))
        ended.acquire()

    time.sleep(0.5)
    own.measure(exchange, own.WARM_UP)
    print("ready", flush=True)
    for line in sys.stdin:
        print(json.dumps(own.measure(exchange, int(line))), flush=True)
    session.close()


def run(*, quick: bool) -> dict:
    """Measure everything in turns."""
    port, raw_port = own.free_port(), own.free_port()
    with ExitStack() as stack:
        stack.enter_context(_Process("--serve", port))
        stack.enter_context(_Process("--raw-serve", raw_port))
        raw = stack.enter_context(_Process("--raw-client", raw_port))
        rclpy = start_rclpy(stack) if RCLPY.exists() else None
        init("client", [], node_config(port, "connect"))
        client = SimpleActionClient("instant", Fibonacci)
        plain = SimpleActionClient("plain", TestAction)

        def goal() -> None:
            client.send_goal(Fibonacci.Goal(order=1))
            assert client.wait_for_result(10.0)

        def plain_goal() -> None:
            plain.send_goal(TestGoal(1))
            assert plain.wait_for_result(10.0)

        for each, function in ((client, goal), (plain, plain_goal)):
            assert each.wait_for_server(10.0)
            own.measure(function, own.WARM_UP)
        measured = {"raw": [], "goal": [], "own": []} | ({"rclpy": []} if rclpy else {})
        for _ in range(5 if quick else 40):
            measured["raw"] += raw.ask(own.BATCH)
            measured["goal"] += own.measure(goal, own.BATCH)
            measured["own"] += own.measure(plain_goal, own.BATCH)
            if rclpy:
                measured["rclpy"] += rclpy.ask(own.BATCH // 4)
        client.stop()
        plain.stop()
    figures = {name: own.spread(times) for name, times in measured.items()}
    median = {name: spread["p50_us"] for name, spread in figures.items()}
    figures["p50_ratio"] = median["goal"] / median["raw"]
    if rclpy:
        figures["rclpy_ratio"] = median["rclpy"] / median["goal"]
    times = [kill() for _ in range(2 if quick else 10)]
    return {**figures, "killed_ms": statistics.median(times), "killed_worst_ms": max(times)}


def start_rclpy(stack: ExitStack) -> _Process:
    """Start a server and a client of rclpy; returns the client."""
    program = str(Path(__file__).with_name("rclpy_goals.py"))
    environment = {
        **os.environ,
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(1 + os.getpid() % 100),
        "ROS_LOG_DIR": stack.enter_context(tempfile.TemporaryDirectory()),
    }
    command = (str(RCLPY), program)
    stack.enter_context(_Process("serve", command=command, env=environment))
    return stack.enter_context(_Process("client", command=command, env=environment))


def kill() -> float:
    """Return how long after the SIGKILL of its server a running goal is LOST [ms]."""
    port = own.free_port()
    server = _Process("--serve", port)
    with server, Node("follower", config=node_config(port, "connect")) as node:
        client = SimpleActionClient("endless", Fibonacci, node=node)
        assert client.wait_for_server(10.0)
        active = threading.Event()
        client.send_goal(Fibonacci.Goal(order=1), active_cb=active.set)
        assert active.wait(10.0)
        start = time.perf_counter()
        server.process.kill()
        assert client.wait_for_result(10.0)
        seconds = time.perf_counter() - start
        assert client.get_state() == GoalStatus.LOST
    return seconds * 1e3


class _Process(own.Peer):
    """A process of this file, or of another program."""

    def __init__(
        self,
        *arguments: object,
        command: tuple[str, ...] = (sys.executable, str(Path(__file__).resolve())),
        env: dict[str, str] | None = None,
    ) -> None:
        self.process = subprocess.Popen(
            [*command, *map(str, arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=env,
        )
        self.ready = self.process.stdout.readline()

    def ask(self, count: int) -> list[float]:
        """Return the times of so many raw exchanges [s]."""
        self.process.stdin.write(f"{count}\n".encode())
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())


def main() -> int:
    """Print the figures; returns 1 when one does not hold."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", action="store_true")
    modes = {"--serve": serve, "--raw-serve": raw_serve, "--raw-client": raw_client}
    for mode in modes:
        parser.add_argument(mode, type=int, help=argparse.SUPPRESS)
    options = vars(parser.parse_args())
    for mode, work in modes.items():
        port = options[mode.lstrip("-").replace("-", "_")]
        if port:
            work(port)
            return 0
    figures = run(quick=options["quick"])
    print(json.dumps(figures, indent=2))
    if options["json"]:
        return 0
    if "rclpy_ratio" not in figures:
        print("rclpy was not measured; try: .ci/rclpy")
    missed = 0
    for name, (least, most) in HOLD.items():
        if name in figures:
            held = least <= figures[name] <= most
            missed += not held
            print(f"{name} {figures[name]:.2f}; hold {least} to {most}: {'yes' if held else 'no'}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
