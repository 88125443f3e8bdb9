"""What virtual time costs beside the mission's own computing.

An hour of patrol runs with the real `move_base` server and the simulated robot in virtual time, and
py-spy looks a hundred times a second which line of which file computes: the thread that holds
Python's lock, the innermost frame of ours. Looking from outside slows the run down, but its shares
are the same however often one looks (25, 100 or 400 times a second), which a meter inside changed.

  clock     `actionlib_core/clock`: waits, timers, spawning, whose turn it is; to ask it for the
            time is the business of who asks
  network   `actionlib_core/transport`: sending, and handing messages over in memory
  messages  the rest of `actionlib_core`: what clients and servers do with messages
  mission   all else: the robot, its server, the states of the mission

The first two, and the handing over of turns between threads, in which nobody computes, are what a
run pays for virtual time and must fit into the budget; the others are the mission's own computing,
which real time costs as well. All is in seconds of the wall, of the quickest hour. Everything runs
on one processor: one participant computes at a time, and changing processors cools its caches.

Transitions are compared with the same machine on the real clock, where nobody listens to it; the
ways are measured by turns. The test kit keeps every event, which is part of its figure.

    pip install 'smachpy[bench,sim]'
    python benchmarks/virtual_time.py [--seconds 3600] [--json] [--seed 1]
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from functools import partial
from pathlib import Path

from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import RealClock, VirtualClock, use_clock
from actionlib_core.clock._gates import make_gate
from actionlib_core.clock._virtual_parts import Participant
from actionlib_core.interfaces.actionlib.msg import TestAction
from actionlib_core.node import Node, use_node
from actionlib_core.transport._memory_entries import Inbox
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import CBState, Concurrence, SimpleActionState, StateMachine
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.occupancy import load_map
from smachpy.places.robot_file import load_config
from smachpy.sim.server import RobotServer
from smachpy.sim.world import Robot, World
from smachpy.testing import mission_kit
from smachpy_missions.patrol import patrol

KINDS = ("clock", "network", "messages", "mission")
PLACES = {  # in the path of a file -> kind
    "actionlib_core/clock/": "clock",
    "actionlib_core/transport/": "network",
    "actionlib_core/": "messages",
    "missions/": "mission",
    "smachpy/": "mission",
}
COUNTED = [
    (VirtualClock, "wait_for"),
    (VirtualClock, "call_later"),
    (VirtualClock, "spawn"),
    (Inbox, "_deliver"),
    (Participant, "begin"),
]
TELLING_TIME = ("VirtualClock.now ", "VirtualClock.time_ns ")
SAMPLES_HZ = 100
ROUND_S = 80.0  # a round of the patrol takes about so long
TRANSITIONS = 10_000
HOUR_BUDGET_S = 0.5  # clock and network, for an hour of patrol
TRANSITION_BUDGET = 5.0  # times the real clock's


@contextlib.contextmanager
def robot(clock):
    """The office robot with its server, and a node for the mission, on a network in memory."""
    network = MemoryNetwork(clock)
    config = load_config(OFFICE_ROBOT)
    world = World(load_map(OFFICE_MAP))
    with (
        Node("robot", transport=network.session(), clock=clock) as robot_node,
        Node("mission", transport=network.session(), clock=clock) as node,
        use_node(node),
    ):
        server = RobotServer(Robot(world, config, config.start, clock.now()), node=robot_node)
        server.start()
        try:
            yield
        finally:
            server.close()


def hour(seconds, seed):
    """Patrol for about `seconds` of virtual time; return virtual and wall seconds."""
    machine = patrol(rounds=max(1, round(seconds / ROUND_S)))
    with VirtualClock(seed) as clock, use_clock(clock), robot(clock):
        start = time.perf_counter()
        outcome = machine.execute()
        wall = time.perf_counter() - start
        if outcome != "succeeded":
            raise RuntimeError(f"the patrol ended {outcome!r}; expected 'succeeded'")
        return clock.now(), wall


def count_calls(seconds, seed):
    """Return name -> how often it happens in an hour, and how often another thread goes on."""
    calls = Counter()
    with contextlib.ExitStack() as stack:
        for owner, name in COUNTED:
            stack.enter_context(counting(owner, name, calls))
        virtual, _ = hour(seconds, seed)
    return {name: count * 3600 / virtual for name, count in calls.items()}


@contextlib.contextmanager
def counting(owner, name, calls):
    function = getattr(owner, name)

    def counted(*args, **kwargs):
        calls[name] += 1
        return function(*args, **kwargs)

    setattr(owner, name, counted)
    try:
        yield
    finally:
        setattr(owner, name, function)


def hand_over_s(count=50_000):
    """Return the seconds from a thread that gives its turn away to the one that takes it."""
    here, there = make_gate(), make_gate()

    def answer():
        for _ in range(count):
            there.acquire()
            here.release()

    def ask():
        for _ in range(count):
            there.release()
            here.acquire()

    thread = threading.Thread(target=answer)
    thread.start()
    spent = timed(ask)
    thread.join()
    return spent / (2 * count)


def shares(seconds, seed, hours):
    """Return kind -> share of the computing, as py-spy sees it from outside."""
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder, "samples")
        program = [sys.executable, __file__, "--only-hours", str(hours)]
        program += ["--seconds", str(seconds), "--seed", str(seed)]
        spy = [Path(sys.executable).with_name("py-spy"), "record", "--full-filenames", "--gil"]
        spy += ["--rate", str(SAMPLES_HZ)]
        subprocess.run(
            [*spy, "--format", "raw", "--output", str(found), "--", *program],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        kinds = Counter()
        for line in found.read_text().splitlines():
            stack, _, count = line.rpartition(" ")
            if "hour (" in stack or "run_turns (" in stack:
                kinds[kind_of(stack)] += int(count)
    print(f"{kinds.total()} samples", file=sys.stderr)
    return {kind: count / kinds.total() for kind, count in kinds.items()}


def kind_of(stack):
    """Return the kind of work of a stack, the innermost frame last."""
    for frame in reversed(stack.split(";")):
        if frame.startswith(TELLING_TIME):
            continue
        for place, kind in PLACES.items():
            if place in frame:
                return kind
    return "mission"


# -- transitions -------------------------------------------------------------------------------


def ring():
    """A flat machine: three states that compute nothing, round and round."""
    left = [TRANSITIONS]

    def count(_userdata):
        left[0] -= 1
        return "next" if left[0] > 0 else "done"

    sm = StateMachine(["done"])
    with sm:
        for label, following in [("A", "B"), ("B", "C"), ("C", "A")]:
            sm.add(label, CBState(count, outcomes=["next", "done"]), {"next": following})
    return sm


def goals():
    """A machine that sends goals to a server that ends them at once."""
    left = [TRANSITIONS // 20]

    def count(_userdata):
        left[0] -= 1
        return "next" if left[0] > 0 else "done"

    sm = StateMachine(["done", "aborted", "preempted"])
    with sm:
        sm.add("GO", SimpleActionState("test", TestAction), {"succeeded": "COUNT"})
        sm.add("COUNT", CBState(count, outcomes=["next", "done"]), {"next": "GO"})
    return sm


def forks():
    """A machine that runs two trivial children at once, again and again."""
    left = [TRANSITIONS // 20]

    def count(_userdata):
        left[0] -= 1
        return "next" if left[0] > 0 else "done"

    sm = StateMachine(["done"])
    with sm:
        both = Concurrence(["both"], "both")
        with both:
            for label in "AB":
                both.add(label, CBState(lambda _userdata: "ok", outcomes=["ok"]))
        sm.add("BOTH", both, {"both": "COUNT"})
        sm.add("COUNT", CBState(count, outcomes=["next", "done"]), {"next": "BOTH"})
    return sm


@contextlib.contextmanager
def world_of(clock):
    """A network in memory with one server, and the mission's node."""
    network = MemoryNetwork(clock)
    with (
        use_clock(clock),
        Node("server", transport=network.session(), clock=clock) as server_node,
        Node("mission", transport=network.session(), clock=clock) as node,
        use_node(node),
    ):
        server = SimpleActionServer(
            "test",
            TestAction,
            lambda _goal: server.set_succeeded(),
            auto_start=False,
            node=server_node,
        )
        server.start()
        try:
            yield
        finally:
            server.stop()


def on_real_clock(make):
    with world_of(RealClock()):
        return timed(make().execute)


def on_virtual_clock(make):
    with VirtualClock() as clock, world_of(clock):
        return timed(make().execute)


def in_kit(make):
    with mission_kit() as mission:
        mission.action_server("test", TestAction)
        return timed(partial(mission, make()))


def timed(function):
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def transitions(rounds):
    """Return name -> how many times the real clock's time it takes, and that time [s]."""
    ways = {
        "real": on_real_clock,
        "virtual": on_virtual_clock,
        "kit": in_kit,
    }
    found = {}
    for make in (ring, forks, goals):
        times = {name: [] for name in ways}
        for _ in range(2 * rounds):
            for name, way in ways.items():
                times[name].append(way(make))
        quickest = {name: min(values) for name, values in times.items()}
        name = make.__name__
        found[f"{name}: real clock s"] = quickest["real"]
        found[f"{name}: virtual / real clock"] = quickest["virtual"] / quickest["real"]
        found[f"{name}: kit / real clock"] = quickest["kit"] / quickest["real"]
    return found


# -- figures -----------------------------------------------------------------------------------


def figures(seconds, seed, rounds):
    """Return name -> figure; those of the patrol are for one hour, of the quickest run."""
    virtual, wall = min((hour(seconds, seed) for _ in range(rounds)), key=lambda run: run[1])
    wall *= 3600 / virtual
    found = {"patrol: virtual s": virtual, "patrol: wall s": wall}
    calls = count_calls(seconds, seed)
    hand_over = hand_over_s()
    turns = calls.pop("begin")
    share = shares(seconds, seed, 2 * rounds)
    computing = wall - turns * hand_over
    found |= {f"patrol: {kind} s": share[kind] * computing for kind in KINDS}
    found["patrol: turns given to another thread s"] = turns * hand_over
    found["patrol: clock + network s"] = wall - (share["messages"] + share["mission"]) * computing
    found["patrol: a turn given to another thread us"] = hand_over * 1e6
    found["patrol: turns given to another thread"] = turns
    found |= {f"patrol: calls of {name}": count for name, count in calls.items()}
    return found | transitions(rounds)


def verdict(name, value):
    if name.startswith("patrol: clock + network"):
        budget = HOUR_BUDGET_S
    elif name.endswith("/ real clock"):
        budget = TRANSITION_BUDGET
    else:
        return ""
    return f"{'holds' if value <= budget else 'MISSED'} (budget {budget:g})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=3600.0, help="of patrol")
    parser.add_argument("--seed", type=int, default=1, help="of the interleaving")
    parser.add_argument("--rounds", type=int, default=3, help="of every measurement")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--only-hours", type=int, help="patrol so many hours and say nothing")
    args = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    if args.only_hours:
        for _ in range(args.only_hours):
            hour(args.seconds, args.seed)
        return 0
    found = figures(args.seconds, args.seed, args.rounds)
    load = os.getloadavg()[0]
    if args.json:
        print(json.dumps({"figures": found, "load": load, "processors": os.cpu_count()}, indent=2))
        return 0
    for name, value in found.items():
        print(f"{name:46} {value:12.3f}  {verdict(name, value)}")
    print(f"load {load:.1f} on {os.cpu_count()} processors")
    return 0


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))
    sys.exit(main())
