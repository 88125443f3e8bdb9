"""Counts that do not depend on the computer: calls, allocations, messages, imported modules.

    python benchmarks/counts.py [--json]

Everything runs on the virtual clock with one seed and a network in memory, so that two runs count
the same. A count that grows shows what a measured time hides in its noise.
"""

from __future__ import annotations

import argparse
import gc
import json
import subprocess
import sys
import tempfile
import threading
import tracemalloc
from contextlib import contextmanager
from pathlib import Path
from typing import Self

import smachpy
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.interfaces.actionlib.msg import TestAction, TestFeedback, TestGoal
from actionlib_core.node import Node, use_node
from actionlib_core.transport._memory_entries import Inbox
from actionlib_core.transport.memory import MemoryNetwork

ROUNDS = 100
GOALS = 50
FEEDBACK = 200
FILE_STATES = 300


class Calls:
    """Counts calls of Python functions in all threads that begin meanwhile, and in this one."""

    def __init__(self) -> None:
        self.count = 0

    def _note(self, _frame: object, event: str, _argument: object) -> None:
        if event == "call":
            self.count += 1

    def __enter__(self) -> Self:
        threading.setprofile(self._note)
        sys.setprofile(self._note)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)
        threading.setprofile(None)


def ring(rounds: int) -> smachpy.StateMachine:
    """Ten states in a ring, round and round."""
    left = [rounds]

    class Next(smachpy.State):
        def __init__(self) -> None:
            super().__init__(["next", "end"])

        def execute(self, _ud: object) -> str:
            return "next"

    class Last(Next):
        def execute(self, _ud: object) -> str:
            left[0] -= 1
            return "next" if left[0] else "end"

    machine = smachpy.StateMachine(["end"])
    with machine:
        for i in range(9):
            machine.add(f"S{i}", Next(), {"next": f"S{i + 1}"})
        machine.add("S9", Last(), {"next": "S0"})
    return machine


def of_transitions() -> dict[str, float]:
    found = {}
    for name in ("alone", "with a clean-up", "buffered", "listener"):
        machine = ring(ROUNDS)
        if name == "buffered":
            machine.event_buffer()
        elif name == "with a clean-up":  # which costs once a run
            machine.add_cleanup("TIDY", smachpy.CBState(lambda _ud: "done", outcomes=["done"]))
        elif name == "listener":
            machine.subscribe(lambda _event: None)
        with Calls() as calls:
            machine.execute()
        found[f"calls per transition, {name}"] = calls.count / (10 * ROUNDS)
    return found


def of_memory() -> dict[str, float]:
    """Bytes of a state in a machine, and blocks that a run leaves behind."""
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    machine = smachpy.StateMachine(["next"])
    with machine:
        for i in range(1000):
            machine.add(f"S{i}", smachpy.State(["next"]), {"next": "next"})
    per_state = (tracemalloc.get_traced_memory()[0] - before) / 1000
    tracemalloc.stop()
    for _ in range(5):
        ring(2).execute()
    gc.collect()
    blocks = sys.getallocatedblocks()
    for _ in range(100):
        ring(2).execute()
    gc.collect()
    left = (sys.getallocatedblocks() - blocks) / 100
    return {"bytes per state": per_state, "blocks left by a run": max(left, 0.0)}


@contextmanager
def counted_messages():
    """Count the messages that the network in memory delivers."""
    count = [0]
    deliver = Inbox._deliver

    def counted(*args: object, **kwargs: object) -> object:
        count[0] += 1
        return deliver(*args, **kwargs)

    Inbox._deliver = counted
    try:
        yield count
    finally:
        Inbox._deliver = deliver


def of_goals() -> dict[str, float]:
    with VirtualClock(1) as clock, use_clock(clock):
        network = MemoryNetwork(clock)
        with (
            Node("server", transport=network.session(), clock=clock) as server_node,
            Node("client", transport=network.session(), clock=clock) as node,
            use_node(node),
        ):

            def execute(goal: TestGoal) -> None:
                for number in range(goal.goal):
                    server.publish_feedback(TestFeedback(number))
                server.set_succeeded()

            server = SimpleActionServer("test", TestAction, execute, node=server_node)
            client = SimpleActionClient("test", TestAction)
            client.wait_for_server(5.0)
            client.send_goal_and_wait(TestGoal(0))
            with counted_messages() as messages, Calls() as calls:
                for _ in range(GOALS):
                    client.send_goal_and_wait(TestGoal(0))
            goals, goal_calls = messages[0] / GOALS, calls.count / GOALS
            with counted_messages() as messages:
                client.send_goal_and_wait(TestGoal(FEEDBACK))
            per_feedback = messages[0] / FEEDBACK
            with counted_messages() as messages:
                clock.sleep(60.0)
            idle = messages[0]
            client.stop()
            server.stop()
    return {
        "messages per goal": goals,
        "calls per goal in the client's thread": goal_calls,
        "messages per feedback": per_feedback,
        "messages in an idle minute": float(idle),
    }


def of_modules() -> dict[str, float]:
    """Modules that `import smachpy` imports, beyond those of Python's start."""
    code = "import sys; b = set(sys.modules); import smachpy; print(len(set(sys.modules) - b))"
    command = [sys.executable, "-I", "-S", "-c"]
    root = Path(smachpy.__file__).parents[1]
    path = f"import sys; sys.path.append({str(root)!r}); "
    done = subprocess.run([*command, path + code], check=True, capture_output=True, text=True)
    return {"modules imported by smachpy": float(done.stdout)}


def of_mission_files() -> dict[str, float]:
    """Calls that loading a file of 300 states takes, imports included."""
    rows = ["outcomes: [done, preempted]", "states:"]
    for i in range(FILE_STATES):
        after = f"S{i + 1}" if i + 1 < FILE_STATES else "done"
        rows += [
            f"  S{i}:",
            "    state: wait",
            "    with: {seconds: 1.5}",
            "    on:",
            "      done:",
        ]
        rows += [f"        - {{when: 1 > 2, to: {after}}}", f"        - {{to: {after}}}"]
    code = (
        "import sys; sys.path[:0] = [{root!r}]; import smachpy; n = [0]\n"
        "def note(_frame, event, _argument): n[0] += event == 'call'\n"
        "sys.setprofile(note); smachpy.load({file!r}); sys.setprofile(None); print(n[0])"
    )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "large.yaml"
        file.write_text("\n".join(rows))
        code = code.format(root=str(Path(smachpy.__file__).parents[1]), file=str(file))
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    return {"calls per state of a mission file": float(done.stdout) / FILE_STATES}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true", help="the same; it is quick")
    args = parser.parse_args()
    found = {
        **of_transitions(),
        **of_memory(),
        **of_goals(),
        **of_modules(),
        **of_mission_files(),
    }
    if args.json:
        print(json.dumps(found))
        return 0
    for name, value in found.items():
        print(f"{name:40} {value:10.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
