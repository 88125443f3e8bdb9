"""What virtual time costs beside the mission's own computing.

An hour of patrol runs with the real `move_base` server and the simulated robot in virtual time. As
only one participant runs at a time, every moment belongs to somebody: the meter is switched where
one calls the clock or the network in memory, and where it comes back from it.

  clock     waits, hand-overs between threads, timers, spawning
  network   the network in memory: sending, and handing messages over
  messages  what clients and servers do with messages that arrive, in the clock's callbacks
  mission   all else: the robot, its server, the states of the mission

The first two are what a run pays for virtual time and must fit into the budget; the others are the
mission's own computing, which real time costs as well. All that is given in seconds of the wall and
of the processor: on a busy computer the wall's are those of other programs, too.

Transitions are compared with the same machine on the real clock, where nobody listens to it; the
ways are measured by turns. The test kit keeps every event, which is part of its figure.

    python benchmarks/virtual_time.py [--seconds 3600] [--json] [--seed 1]
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path

from actionlib_core.clock import RealClock, VirtualClock, use_clock
from actionlib_core.interfaces.actionlib.msg import TestAction
from actionlib_core.node import Node, use_node
from actionlib_core.simple_action_server import SimpleActionServer
from actionlib_core.transport import _memory_entries as entries
from actionlib_core.transport.memory import MemoryNetwork
from missions.maps import OFFICE_MAP, OFFICE_ROBOT
from missions.move_base.config import load_config
from missions.move_base.occupancy import load_map
from missions.move_base.server import RobotServer
from missions.move_base.world import Robot, World
from missions.patrol import patrol
from smachpy import CBState, Concurrence, SimpleActionState, StateMachine
from smachpy.testing import mission_kit

KINDS = ("clock", "network", "messages", "mission")
COUNTED = ("_wait", "_deliver", "call_later", "spawn")
ROUND_S = 80.0  # a round of the patrol takes about so long
TRANSITIONS = 10_000
HOUR_BUDGET_S = 0.5  # clock and network, for an hour of patrol
TRANSITION_BUDGET = 5.0  # times the real clock's


class Meter:
    """Gives every moment to a kind of work; the kinds follow each other, whatever the thread.

    Measuring costs time itself. How it falls on a call's own kind and on the kind that calls it is
    found beforehand; how much it is in the run, where nothing is as warm as in a loop, comes from
    what the run takes without it (`weigh`), and is taken off.
    """

    def __init__(self, clock):
        self.clock = clock
        self.calls = Counter()
        self._inner = self._outer = 0.0
        self._weight = 1.0
        self.start()
        self._calibrate()
        self.start()

    def start(self):
        """Forget what was measured."""
        self.spent = Counter()
        self._inside = Counter()
        self._around = Counter()
        self._kind = "mission"
        self._since = self.clock()

    def _calibrate(self, count=50_000):
        measured = self.wrap(_nothing, "inner")
        begun = self.clock()
        for _ in range(count):
            _nothing()
        bare = (self.clock() - begun) / count
        self.switch("outer")
        for _ in range(count):
            measured()
        self.switch("")
        self._inner = self.spent["inner"] / count - bare
        self._outer = self.spent["outer"] / count
        self.calls.clear()

    def switch(self, kind):
        """Begin work of another kind; return the kind of before."""
        now = self.clock()
        self.spent[self._kind] += now - self._since
        before, self._kind, self._since = self._kind, kind, now
        return before

    def weigh(self, bare):
        """Learn what the run takes without a meter [s]: the kinds add up to that."""
        cost = sum(self._cost(kind) for kind in KINDS)
        self._weight = (sum(self.spent[kind] for kind in KINDS) - bare) / cost

    def seconds(self, kind):
        """Return what was spent on a kind, without the measuring."""
        return self.spent[kind] - self._weight * self._cost(kind)

    def _cost(self, kind):
        return self._inside[kind] * self._inner + self._around[kind] * self._outer

    def wrap(self, function, kind, then=None):
        """Return `function` as work of a kind; what calls it goes on as before, or as `then`."""

        def measured(*args, **kwargs):
            before = self.switch(kind)
            self.calls[function.__name__] += 1
            self._inside[kind] += 1
            self._around[before] += 1
            try:
                return function(*args, **kwargs)
            finally:
                if then != kind:  # else another thread has the turn by now
                    self.switch(then or before)

        return measured


def _nothing():
    pass


MEASURED = [
    (VirtualClock, ["_wait", "_wake_all", "call_later", "spawn"], "clock"),
    (entries.Publisher, ["put"], "network"),
    (entries.Inbox, ["_deliver"], "network"),
    (entries.Listener, ["post"], "network"),
    (entries.Exchange, ["limit", "finish_locked", "reply_locked"], "network"),
]
CALLBACKS = [(entries.Listener, "deliver"), (entries.Exchange, "_deliver")]


@contextlib.contextmanager
def measuring(meter):
    """Switch the meter wherever the clock or the network is entered or left."""
    places = [(owner, name, kind) for owner, names, kind in MEASURED for name in names]
    places += [(owner, name, "messages") for owner, name in CALLBACKS]
    places += [(VirtualClock, "_enter", "clock"), (VirtualClock, "_leave", "clock")]
    thens = {"_enter": "mission", "_leave": "clock"}  # a thread's first and last step
    real = [(owner, name, getattr(owner, name)) for owner, name, _ in places]
    for owner, name, kind in places:
        setattr(owner, name, meter.wrap(getattr(owner, name), kind, thens.get(name)))
    try:
        yield
    finally:
        for owner, name, function in real:
            setattr(owner, name, function)


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


def hour(seconds, seed, meter=None):
    """Patrol for about `seconds` of virtual time; return virtual, wall and processor seconds."""
    machine = patrol(rounds=max(1, round(seconds / ROUND_S)))
    with VirtualClock(seed) as clock, use_clock(clock), robot(clock):
        with measuring(meter) if meter else contextlib.nullcontext():
            if meter:
                meter.start()
            wall, cpu = time.perf_counter(), time.process_time()
            outcome = machine.execute()
            wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
            if meter:
                meter.switch("")
        if outcome != "succeeded":
            raise RuntimeError(f"the patrol ended {outcome!r}; expected 'succeeded'")
        return clock.now(), wall, cpu


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


def shares(seconds, seed, rounds, clock, bare):
    """Return kind -> seconds for an hour of patrol, of the quickest run, and name -> calls.

    `bare` is what the quickest run takes without a meter [s].
    """
    meter = Meter(clock)
    quickest = None
    for _ in range(rounds):
        virtual = hour(seconds, seed, meter)[0]
        spent = sum(meter.spent[kind] for kind in KINDS)
        if quickest is None or spent < quickest:
            quickest = spent
            meter.weigh(bare)
            found = {kind: meter.seconds(kind) * 3600 / virtual for kind in KINDS}
        calls = {name: meter.calls[name] * 3600 / virtual for name in COUNTED}
        meter.calls.clear()
    return found, calls


def figures(seconds, seed, rounds):
    """Return name -> figure; those of the patrol are for one hour, of the quickest run."""
    runs = [hour(seconds, seed) for _ in range(rounds)]
    virtual, wall, cpu = (min(values) for values in zip(*runs, strict=True))
    found = {
        "patrol: virtual s": virtual,
        "patrol: wall s": wall * 3600 / virtual,
        "patrol: processor s": cpu * 3600 / virtual,
    }
    for name, clock, bare in (
        ("wall", time.perf_counter, wall),
        ("processor", time.process_time, cpu),
    ):
        best, calls = shares(seconds, seed, rounds, clock, bare)
        found |= {f"patrol: {kind} {name} s": best[kind] for kind in KINDS}
        found[f"patrol: clock + network {name} s"] = best["clock"] + best["network"]
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
    parser.add_argument("--seed", type=int, help="of the interleaving")
    parser.add_argument("--rounds", type=int, default=3, help="of every measurement")
    parser.add_argument("--json", action="store_true", help="print JSON")
    args = parser.parse_args()
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
