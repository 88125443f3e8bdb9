"""Goals from rclpy to rclpy over Fast DDS: `ros2_actions.py` runs this with rclpy's own Python.

rclpy_goals.py serve       until standard input ends
rclpy_goals.py client      measures as many goals as each line of standard input says [s]
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
    """Send one goal after the other."""
    node = rclpy.create_node("client")
    goals = ActionClient(node, Fibonacci, "instant")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    assert goals.wait_for_server(20.0)

    def goal() -> None:
        sent = goals.send_goal_async(Fibonacci.Goal(order=1))
        executor.spin_until_future_complete(sent, 10.0)
        ended = sent.result().get_result_async()
        executor.spin_until_future_complete(ended, 10.0)
        assert list(ended.result().result.sequence) == [7]

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
    rclpy.shutdown()


rclpy.init()
{"serve": serve, "client": client}[sys.argv[1]]()
