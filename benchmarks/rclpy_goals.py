"""Goals from rclpy to rclpy over Fast DDS: `ros2_actions.py` runs this with rclpy's own Python.

rclpy_goals.py serve              until standard input ends
rclpy_goals.py client             measures as many goals as each line of standard input says [s]
"""

from __future__ import annotations

import contextlib
import json
import sys
import threading
import time

import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from test_msgs.action import Fibonacci

WARM_UP = 50


def serve() -> None:
    """Serve goals that end at once."""
    node = rclpy.create_node("server")

    def execute(goal):
        goal.succeed()
        return Fibonacci.Result(sequence=[7])

    server = ActionServer(node, Fibonacci, "instant", execute)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    threading.Thread(target=end_with_input).start()
    print("ready", flush=True)
    with contextlib.suppress(ExternalShutdownException):
        executor.spin()
    server.destroy()
    node.destroy_node()


def end_with_input() -> None:
    sys.stdin.read()
    rclpy.shutdown()


def client() -> None:
    """Send one goal after the other; an executor in a thread of its own calls back."""
    node = rclpy.create_node("client")
    goals = ActionClient(node, Fibonacci, "instant")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    assert goals.wait_for_server(20.0)

    threading.Thread(target=executor.spin, daemon=True).start()

    def goal() -> None:
        done = threading.Event()

        def taken(f):
            f.result().get_result_async().add_done_callback(ended)

        def ended(f):
            assert list(f.result().result.sequence) == [7]
            done.set()

        goals.send_goal_async(Fibonacci.Goal(order=1)).add_done_callback(taken)
        assert done.wait(10.0)

    def measure(count: int) -> list[float]:
        times = []
        for _ in range(count):
            start = time.perf_counter()
            goal()
            times.append(time.perf_counter() - start)
        return times

    measure(WARM_UP)
    print("ready", flush=True)
    for line in sys.stdin:
        print(json.dumps(measure(int(line))), flush=True)
    goals.destroy()
    node.destroy_node()
    rclpy.shutdown()


rclpy.init()
{"serve": serve, "client": client}[sys.argv[1]]()
