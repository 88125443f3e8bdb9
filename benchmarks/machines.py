"""State machines beside their peers, in one run, as ratios.

    pip install 'smachpy[bench]'
    python benchmarks/machines.py [--json] [--quick]

Times are CPU time of the machine's thread, so that a busy computer disturbs little, and wall time
where threads take part. Each figure is the median of several rounds in which the candidates take
turns; peers log nothing. transitions and python-statemachine are driven by events and py_trees
ticks, so theirs is the nearest equivalent, not the same work.

With the event stream attached there are three rows: `buffered` (`machine.event_buffer()`, read
after the run), `recorded` (a file is being written, as by `smachpy run --record`) and `listener`
(a list's append, called at each event). Beside them stands `python call`, what one call of an empty
Python function costs: a listener is two of them, two events and two looks at both clocks per
transition.
"""

from __future__ import annotations

import argparse
import importlib
import json
import statistics
import sys
import tempfile
import threading
import time
import tracemalloc
from pathlib import Path

import smachpy
from actionlib_core.clock import RealClock, use_clock
from smachpy.events.recording import Recorder
from smachpy.modes import Modes

ROUNDS = 7
STEPS = 2000
# At most so many times the peer's time, at least so many a second, at most so many ms.
BUDGETS = {
    "flat / smach": 0.6,
    "userdata / smach": 0.55,
    "nested / smach": 0.85,
    "flat buffered / flat": 4.0,
    "flat recorded / flat": 6.0,
    "flat listener / flat": 3.5,
    "concurrence runs/s": 2000.0,
    "preempt p50 ms": 0.5,
    "preempt p99 ms": 5.0,
    "emergency stop p50 ms": 2.0,
    "emergency stop p99 ms": 50.0,
}


def load_smach():
    threading.Thread.isAlive = threading.Thread.is_alive  # the package still calls it
    smach = importlib.import_module("smach")
    smach.set_loggers(*[lambda _message: None] * 4)
    return smach


def measure(function, count, clock=time.thread_time):
    """Return microseconds for one of the `count` units of work in `function`."""
    start = clock()
    function()
    return (clock() - start) / count * 1e6


def in_turns(candidates, rounds, clock=time.thread_time):
    """Return name -> median microseconds, the candidates measured by turns.

    A candidate is a function, how many units of work it does, and what to do after it.
    """
    times = {name: [] for name in candidates}
    for function, count, *_ in candidates.values():
        measure(function, count)  # once to get warm
    for _ in range(rounds):
        for name, (function, count, *after) in candidates.items():
            times[name].append(measure(function, count, clock))
            for tidy in after:
                tidy()
    return {name: statistics.median(values) for name, values in times.items()}


# -- the machines ------------------------------------------------------------------------------


def ring(library, *, userdata=False):
    """Ten states in a ring; the last one ends it after STEPS rounds."""

    class Plain(library.State):
        def __init__(self):
            library.State.__init__(self, ["next"])

        def execute(self, _ud):
            return "next"

    class Counts(library.State):
        def __init__(self):
            library.State.__init__(self, ["next"], ["x"], ["x"])

        def execute(self, ud):
            ud.x = ud.x + 1
            return "next"

    class Last(library.State):
        def __init__(self):
            library.State.__init__(self, ["next", "end"])
            self.rounds = 0

        def execute(self, _ud):
            self.rounds += 1
            return "next" if self.rounds % STEPS else "end"

    machine = library.StateMachine(["end"])
    machine.userdata.there = 0
    with machine:
        for i in range(9):
            target = {"next": f"S{i + 1}" if i < 8 else "LAST"}
            if userdata:
                library.StateMachine.add(f"S{i}", Counts(), target, remapping={"x": "there"})
            else:
                library.StateMachine.add(f"S{i}", Plain(), target)
        library.StateMachine.add("LAST", Last(), {"next": "S0", "end": "end"})
    return machine


def trivial(library):
    class Trivial(library.State):
        def __init__(self):
            library.State.__init__(self, ["next"])

        def execute(self, _ud):
            return "next"

    return Trivial()


def deep(library, depth=10):
    state = trivial(library)
    for _ in range(depth):
        machine = library.StateMachine(["next"])
        with machine:
            library.StateMachine.add("INNER", state)
        state = machine
    return state


def parallel(library, width=10):
    both = library.Concurrence(["next"], "next")
    with both:
        for i in range(width):
            library.Concurrence.add(f"C{i}", trivial(library))
    return both


def loop(library, items=10_000):
    iterator = library.Iterator(["done"], [], [], list(range(items)), "item", "done")
    with iterator:
        library.Iterator.set_contained_state("EACH", trivial(library), loop_outcomes=["next"])
    return iterator


def times(function, count):
    def run():
        for _ in range(count):
            function()

    return run


# -- peers that are driven by events ------------------------------------------------------------


def flat_py_trees():
    py_trees = importlib.import_module("py_trees")

    class Leaf(py_trees.behaviour.Behaviour):
        def update(self):
            return py_trees.common.Status.SUCCESS

    root = py_trees.composites.Sequence("root", memory=False)
    root.add_children([Leaf(f"L{i}") for i in range(10)])
    return times(root.tick_once, 200), 2000


def flat_transitions():
    transitions = importlib.import_module("transitions")
    states = [f"S{i}" for i in range(10)]
    model = type("Model", (), {})()
    machine = transitions.Machine(model, states=states, initial="S0")
    machine.add_ordered_transitions()
    return times(model.next_state, 1000), 1000


def nested_transitions():
    extensions = importlib.import_module("transitions.extensions")
    tree = {"name": "leaf"}
    path = "leaf"
    for i in range(10):
        tree = {"name": f"L{i}", "children": [tree], "initial": path.split("_", 1)[0]}
        path = f"L{i}_{path}"
    model = type("Model", (), {})()
    machine = extensions.HierarchicalMachine(model, states=["idle", tree], initial="idle")
    machine.add_transition("enter", "idle", path)
    machine.add_transition("leave", "*", "idle")

    def once():
        model.enter()
        model.leave()

    return times(once, 50), 50


def flat_python_statemachine():
    statemachine = importlib.import_module("statemachine")

    class Ring(statemachine.StateMachine):
        a = statemachine.State(initial=True)
        b = statemachine.State()
        go = a.to(b) | b.to(a)

    ring_machine = Ring()
    return times(ring_machine.go, 300), 300


def peers(makers, missing):
    found = {}
    for name, maker in makers.items():
        try:
            found[name] = maker()
        except ImportError:
            missing.add(name)
    return found


# -- the figures -------------------------------------------------------------------------------


def flat_figures(rounds, missing):
    count = 10 * STEPS
    listened, buffered, recorded = ring(smachpy), ring(smachpy), ring(smachpy)
    heard = []
    listened.subscribe(heard.append)
    buffer = buffered.event_buffer()
    candidates = {
        "smachpy": (ring(smachpy).execute, count),
        "smachpy buffered": (buffered.execute, count, buffer.read),
        "smachpy recorded": (recorded.execute, count),
        "smachpy listener": (listened.execute, count, heard.clear),
        "python call": (times(lambda: None, count), count),
        "smachpy userdata": (ring(smachpy, userdata=True).execute, count),
    }
    makers = {
        "smach": lambda: (ring(load_smach()).execute, count),
        "smach userdata": lambda: (ring(load_smach(), userdata=True).execute, count),
        "py_trees": flat_py_trees,
        "transitions": flat_transitions,
        "python-statemachine": flat_python_statemachine,
    }
    with tempfile.TemporaryDirectory() as folder, Recorder(Path(folder) / "run.jsonl", recorded):
        return in_turns({**candidates, **peers(makers, missing)}, rounds)


def nested_figures(rounds, missing):
    makers = {
        "smach": lambda: (times(deep(load_smach()).execute, 200), 200),
        "transitions hierarchical": nested_transitions,
    }
    candidates = {"smachpy": (times(deep(smachpy).execute, 200), 200)}
    return in_turns({**candidates, **peers(makers, missing)}, rounds)


def loop_figures(rounds, missing):
    def made():
        smach = load_smach()
        iterator = loop(smach, 500)  # its time grows with the square of the number of items
        return (lambda: iterator.execute(smach.UserData())), 500

    candidates = {"smachpy": (loop(smachpy).execute, 10_000)}
    return in_turns({**candidates, **peers({"smach": made}, missing)}, rounds)


def concurrence_figures(rounds):
    candidates = {"smachpy": (times(parallel(smachpy).execute, 200), 200)}
    return in_turns(candidates, rounds, time.perf_counter)


def preempt_latencies(count):
    """Return milliseconds from request_preempt to the end of execute, 8 levels deep, sorted."""

    class Waits(smachpy.State):
        def __init__(self):
            super().__init__(["done", "preempted"])

        def execute(self, _ud):
            waiting.set()
            self.wait_preempt(10.0)
            return "preempted"

    waiting = threading.Event()
    state = Waits()
    for _ in range(8):
        machine = smachpy.StateMachine(["done", "preempted"])
        machine.add("INNER", state)
        state = machine
    asked = []

    def ask():
        for _ in range(count):
            waiting.wait()
            waiting.clear()
            time.sleep(0.0005)  # until the leaf really waits
            asked.append(time.perf_counter())
            state.request_preempt()

    asker = threading.Thread(target=ask)
    asker.start()
    ended = []
    for _ in range(count):
        state.execute()
        ended.append(time.perf_counter())
    asker.join()
    return sorted((end - start) * 1e3 for start, end in zip(asked, ended, strict=True))


def emergency_latencies(count):
    """Return milliseconds of emergency stops of 8 branches, 4 levels deep, each sorted.

    Until the call returns, which is when all states have been told; and until the last of these
    states has ended.
    """
    waiting, ended = threading.Semaphore(0), threading.Semaphore(0)

    class Waits(smachpy.State):
        def __init__(self):
            super().__init__(["done", "preempted"])

        def execute(self, _ud):
            waiting.release()
            self.wait_preempt()
            ended.release()
            return "preempted"

    branches = smachpy.Concurrence(["done", "preempted"], "done")
    for number in range(8):
        state = Waits()
        for _ in range(3):
            machine = smachpy.StateMachine(["done", "preempted"])
            machine.add("INNER", state)
            state = machine
        branches.add(f"BRANCH_{number}", state)
    modes = Modes([{"name": "auto", "mission": branches}, "estop"], [], emergency="estop")
    told, over = [], []

    def press():
        for _ in range(count):
            for _ in range(8):
                waiting.acquire()
            time.sleep(0.0005)  # until the leaves really wait
            start = time.perf_counter()
            modes.emergency_stop()
            told.append((time.perf_counter() - start) * 1e3)
            for _ in range(8):
                ended.acquire()
            over.append((time.perf_counter() - start) * 1e3)
            modes.release()
        modes.request_preempt()

    presser = threading.Thread(target=press)
    presser.start()
    modes.execute()
    presser.join()
    return sorted(told), sorted(over)


def bytes_per_state(library, count=2000):
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    machine = library.StateMachine(["next"])
    with machine:
        for i in range(count):
            library.StateMachine.add(f"S{i}", library.State(["next"]), {"next": "next"})
    used = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    return used / count


def figures(rounds):
    """Return name -> figure, and the peers that are not installed."""
    missing = set()
    flat = flat_figures(rounds, missing)
    nested = nested_figures(rounds, missing)
    looped = loop_figures(rounds, missing)
    found = {f"flat us: {name}": value for name, value in flat.items()}
    found |= {f"nested x10 us: {name}": value for name, value in nested.items()}
    found |= {f"iterator us per item: {name}": value for name, value in looped.items()}
    if "smach" in flat:
        found["flat / smach"] = flat["smachpy"] / flat["smach"]
        found["userdata / smach"] = flat["smachpy userdata"] / flat["smach userdata"]
        found["nested / smach"] = nested["smachpy"] / nested["smach"]
        found["iterator / smach"] = looped["smachpy"] / looped["smach"]
        found["bytes per state: smach"] = bytes_per_state(load_smach())
    for how in ("buffered", "recorded", "listener"):
        found[f"flat {how} / flat"] = flat[f"smachpy {how}"] / flat["smachpy"]
    found["concurrence runs/s"] = 1e6 / concurrence_figures(rounds)["smachpy"]
    latencies = preempt_latencies(60 * rounds)
    found["preempt p50 ms"] = latencies[len(latencies) // 2]
    found["preempt p99 ms"] = latencies[int(len(latencies) * 0.99)]
    told, over = emergency_latencies(60 * rounds)
    found["emergency stop p50 ms"] = told[len(told) // 2]
    found["emergency stop p99 ms"] = told[int(len(told) * 0.99)]
    found["emergency stop, states ended, p99 ms"] = over[int(len(over) * 0.99)]
    found["bytes per state: smachpy"] = bytes_per_state(smachpy)
    return found, missing


def verdict(name, value):
    budget = BUDGETS.get(name)
    if budget is None:
        return ""
    holds = value >= budget if name.endswith("runs/s") else value <= budget
    return f"{'holds' if holds else 'MISSED'} (budget {budget:g})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    args = parser.parse_args()
    with use_clock(RealClock()):
        found, missing = figures(3 if args.quick else ROUNDS)
    if args.json:
        print(json.dumps({"figures": found, "missing": sorted(missing)}, indent=2))
        return 0
    for name, value in found.items():
        print(f"{name:42} {value:12.3f}  {verdict(name, value)}")
    for name in sorted(missing):
        print(f"not installed: {name}. Try pip install 'smachpy[bench]'.")
    return 0


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))
    sys.exit(main())
