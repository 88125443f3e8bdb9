"""Goals over ROS 2's wire between two processes, beside raw zenoh in the same run.

    python benchmarks/ros2_actions.py [--quick]

The floor is what any such goal takes: a query that is answered (send_goal) and a publication there
and back (the state, and the question for the result), without a type, a thread or a life cycle. Raw
and measured exchanges take turns, so that a busy computer slows both; look at the ratios.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import threading
import time
from pathlib import Path

import zenoh

sys.path.insert(0, str(Path(__file__).parent))
import actions as own  # its raw processes and its statistics

from actionlib_core import SimpleActionClient, SimpleActionServer, init
from actionlib_core.config import Config, Ros2
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci

HOLD = 2.2
PAYLOAD = b"x" * 28


def node_config(port: int, what: str) -> Config:
    """Two peers with one link, as the raw ones have."""
    endpoint = (f"tcp/127.0.0.1:{port}",)
    ends = {"listen": endpoint} if what == "listen" else {"connect": endpoint}
    return Config(discovery="off", timestamping=True, ros2=(Ros2(),), **ends)


def serve(port: int) -> None:
    """Serve goals that end at once, and raw queries, until standard input ends."""
    init("server", [], node_config(port, "listen"))
    server = SimpleActionServer(
        "instant", Fibonacci, lambda _: server.set_succeeded(Fibonacci.Result(sequence=[7]))
    )
    raw_port = own.free_port()
    session = zenoh.open(own.raw_config("listen", raw_port))

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply("raw/query", PAYLOAD, express=True)

    queryable = session.declare_queryable("raw/query", own.direct(answer), complete=True)
    own.echo(session)
    print(raw_port, flush=True)
    sys.stdin.read()
    queryable.undeclare()
    session.close()


def run(*, quick: bool) -> dict:
    """Measure everything in turns."""
    port = own.free_port()
    server = _Process("--serve", str(port))
    with server:
        session = zenoh.open(own.raw_config("connect", int(server.ready)))
        init("client", [], node_config(port, "connect"))
        client = SimpleActionClient("instant", Fibonacci)
        assert client.wait_for_server(10.0)
        wire = own.RawWire(session)
        time.sleep(0.5)
        got = threading.Lock()
        got.acquire()

        def query() -> None:
            session.get(
                "raw/query",
                own.direct(lambda _: got.release()),
                payload=PAYLOAD,
                express=True,
            )
            got.acquire()

        def goal() -> None:
            client.send_goal(Fibonacci.Goal(order=1))
            assert client.wait_for_result(10.0)

        queries, pings, goals = [], [], []
        for function in (query, wire.round_trip, goal):
            own.measure(function, own.WARM_UP)
        for _ in range(5 if quick else 40):
            queries += own.measure(query, own.BATCH)
            pings += own.measure(wire.round_trip, own.BATCH)
            goals += own.measure(goal, own.BATCH)
        wire.close()
        client.stop()
        session.close()
    figures = {
        name: own.spread(times)
        for name, times in (("query", queries), ("ping", pings), ("goal", goals))
    }
    floor = figures["query"]["p50_us"] + figures["ping"]["p50_us"]
    return {**figures, "floor_us": floor, "p50_ratio": figures["goal"]["p50_us"] / floor}


class _Process(own.Peer):
    """A process of this file."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).resolve()), *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self.ready = self.process.stdout.readline()


def main() -> int:
    """Print the figures; returns 1 when one does not hold."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--serve", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve(options.serve)
        return 0
    figures = run(quick=options.quick)
    print(json.dumps(figures, indent=2))
    held = figures["p50_ratio"] <= HOLD
    print(f"p50_ratio {figures['p50_ratio']:.2f}; hold {HOLD}: {'yes' if held else 'no'}")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
