"""How cost grows: a queue, finished missions, large values, recordings; several sizes of each.

    python benchmarks/scale.py [--json] [--long] [--store postgresql://HOST/DATABASE]

Slopes and counts hold on any computer: a slope is that of the logarithms, 0 for a cost that stays
the same and 1 for one that grows with the size. Of a file they are steps of SQLite's machine, which
are those of its queries; `--store` measures a server instead, by time. `--long` takes larger sizes,
and starts runners. Figures in seconds are CPU time of this computer.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import dataclasses
import importlib.util
import json
import math
import multiprocessing
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import smachpy
from actionlib_core.clock import Clock, RealClock, VirtualClock
from smachpy.command.warm import Starter
from smachpy.durable.mission import kept_mission, new_mission
from smachpy.durable.opening import open_store
from smachpy.durable.overview import overview
from smachpy.durable.processes import this_runner
from smachpy.events.recording import Recorder, read_summary

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

PAGE = 50
LEASE_S = 60.0
START_S = 60.0
VALUE = 200_000  # characters
TIMERS = 2_000
TURNS = 150
CLIENT_PROCESSES = 4
GOALS = 8_000  # of all clients together
ERRAND = """import smachpy


@smachpy.state(outcomes=["done"])
def carry(userdata):
    return "done"


def mission():
    machine = smachpy.StateMachine(["done"], name="ERRAND")
    machine.add("CARRY", carry)
    return machine
"""


def errand() -> smachpy.StateMachine:
    machine = smachpy.StateMachine(["done"], name="ERRAND")
    machine.add("CARRY", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    return machine


def slope(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Return the largest slope between two neighbouring sizes."""
    pairs = zip(pairwise(sizes), pairwise(costs), strict=True)
    return max(math.log(max(b, 1e-9) / max(a, 1e-9)) / math.log(y / x) for (x, y), (a, b) in pairs)


class Cost:
    """The statements of a store within a block, and the steps of SQLite, or else CPU time."""

    def __init__(self, store: Any) -> None:
        self.statements = 0
        self.steps = 0.0
        self._store, self._do = store, store._do

    def __enter__(self) -> Self:
        def counted(cursor: Any, sql: str, *values: object) -> None:
            self.statements += 1
            self._do(cursor, sql, *values)

        self._store._do = counted
        self._begun = time.perf_counter()
        self._counts = counts_steps(self._store)
        if self._counts:
            self._store._connection.set_progress_handler(self._step, 10)
        return self

    def _step(self) -> int:
        self.steps += 10
        return 0

    def __exit__(self, *_: object) -> None:
        self._store._do = self._do
        if self._counts:
            self._store._connection.set_progress_handler(None, 0)
        else:
            self.steps = time.perf_counter() - self._begun


def fill(store: Any, first: int, last: int, status: str, robots: int = 100) -> None:
    """Put missions with the numbers from `first` to `last` into a store."""
    base = new_mission(errand(), target="errand.py")

    def work(cursor: Any, _: bool) -> None:
        now = store._now(cursor)
        for number in numbers:
            robot = f"r{number % robots}"
            row = dataclasses.replace(base, id=f"{status}{number}", status=status, robot=robot)
            store._insert(cursor, row, now)

    for begin in range(first, last, 2_000):  # a transaction has a deadline
        numbers = range(begin, min(begin + 2_000, last))
        store._transact(work)
    if not counts_steps(store):  # PostgreSQL does so by itself, within a minute
        store._transact(lambda cursor, _: store._do(cursor, "ANALYZE smachpy_missions"))


def counts_steps(store: Any) -> bool:
    """Return whether the store is a file, of which SQLite counts the steps."""
    return hasattr(store._connection, "set_progress_handler")


def growth(
    store: Any,
    sizes: Sequence[int],
    status: str,
    acts: dict[str, Callable[[], object]],
    *,
    first: int = 0,
    robots: int = 100,
) -> dict[str, float]:
    """Return statements and slope of each act beside more and more missions of a status."""
    costs: dict[str, list[float]] = {name: [] for name in acts}
    found: dict[str, float] = {}
    have = first
    for size in sizes:
        fill(store, have, size, status, robots)
        have = size
        for name, act in acts.items():
            act()  # the first one may do what is done once per opened file
            best = math.inf
            for _ in range(3):
                with Cost(store) as cost:
                    act()
                best = min(best, cost.steps)
            costs[name].append(best)
            found[f"{name}: statements"] = cost.statements
    for name, steps in costs.items():
        found[f"{name}: slope"] = slope(sizes, steps)
    return found


def of_queue(place: str, sizes: Sequence[int]) -> dict[str, float]:
    """A runner's look at a queue in which missions wait, and what it does then."""
    with contextlib.closing(open_store(place)) as store:

        def take() -> None:
            found = store.reserve(this_runner(), seconds=LEASE_S, robots=["r7"])
            assert found is not None
            store.release(found[1], None)

        looks: dict[str, Callable[[], object]] = {
            "look": lambda: store.look(robots=["r7"]),
            "look for any robot": store.look,
            "reserve and release": take,
            "reserve, none allowed": lambda: store.reserve(
                this_runner(), seconds=LEASE_S, leave_targets=["errand.py"]
            ),
            "reserve, other version": lambda: store.reserve(
                this_runner(),
                seconds=LEASE_S,
                leave_shapes=[("errand.py", store.mission("queued0").structure)],
            ),
        }
        return growth(store, sizes, "queued", looks)


def of_busy(place: str, sizes: Sequence[int]) -> dict[str, float]:
    """What a runner does while all missions wait for one robot, which a mission uses."""
    with contextlib.closing(open_store(place)) as store:
        fill(store, 0, 1, "queued")
        store.claim("queued0", this_runner(), seconds=LEASE_S)

        def take() -> None:
            assert store.reserve(this_runner(), seconds=LEASE_S) is None

        acts = {"look, robot busy": store.look, "reserve, robot busy": take}
        return growth(store, sizes, "queued", acts, first=1, robots=1)


def of_finished(place: str, sizes: Sequence[int]) -> dict[str, float]:
    """A run, and a list, beside missions that have ended."""
    with contextlib.closing(open_store(place)) as store:
        numbers = iter(range(10**9))

        def run() -> None:
            smachpy.run_durable(errand(), store, mission=f"run{next(numbers)}")

        def page() -> None:
            for row in store.missions(limit=PAGE):
                overview(store, row)

        acts = {
            "run_durable": run,
            f"a list of {PAGE}": page,
            "a list of a status": lambda: store.missions(statuses=["ended"], limit=PAGE),
        }
        return growth(store, sizes, "ended", acts)


def nested(depth: int) -> smachpy.StateMachine:
    """A machine that hands a large value through `depth` machines."""
    keys: dict[str, Any] = {"input_keys": ["value"], "output_keys": ["value"]}
    inner = smachpy.StateMachine(["done"], **keys)
    state = smachpy.CBState(lambda _: "done", outcomes=["done"], io_keys=["value"])
    inner.add("USE", state)
    for _ in range(depth - 1):
        outer = smachpy.StateMachine(["done"], **keys)
        outer.add("IN", inner)
        inner = outer
    root = smachpy.StateMachine(["done"], name="NESTED")
    root.userdata.value = "x" * VALUE
    root.add("IN", inner)
    return root


def of_values(folder: Path, sizes: Sequence[int]) -> dict[str, float]:
    """Bytes of a journal, and memory, for a large value in nested machines."""
    written = []
    for depth in sizes:
        place = folder / f"nested{depth}.db"
        with contextlib.closing(open_store(place)) as store:
            before = io_bytes("wchar")
            smachpy.run_durable(nested(depth), store, mission="nested")
            written.append(io_bytes("wchar") - before)
    return {"large value: copies written": written[-1] / VALUE}


def io_bytes(name: str) -> int:
    """Return how many bytes this process has read ("rchar") or written ("wchar")."""
    lines = Path("/proc/self/io").read_text(encoding="ascii").splitlines()
    return int(dict(line.split(": ") for line in lines)[name])


def of_recordings(folder: Path, sizes: Sequence[int]) -> dict[str, float]:
    """Events that are missing in recordings, and what a list reads of them."""
    missing, read = 0, []
    for size in sizes:
        left = [size]

        def step(_: Any, left: list[int] = left) -> str:
            left[0] -= 1
            return "again" if left[0] else "done"

        machine = smachpy.StateMachine(["done"], name="LOOP")
        machine.add("S", smachpy.CBState(step, outcomes=["again", "done"]), {"again": "S"})
        path = folder / f"loop{size}.jsonl"
        with Recorder(path, machine):
            machine.execute()
        before = io_bytes("rchar")
        summary = read_summary(path)
        read.append(io_bytes("rchar") - before)
        missing += 2 * size + 2 - summary.events
    command = [sys.executable, __file__, "--view", str(path)]
    opened = subprocess.run(command, check=True, capture_output=True)
    return {
        "recording: events missing": missing,
        "recording: bytes read for a list": read[-1],
        "recording: MB to open it in the viewer": float(opened.stdout),
    }


def open_in_viewer(path: Path) -> float:
    """Return the most memory of this process when it opens a recording as the viewer does [MB]."""
    from smachpy_viz.live.machines import Machines
    from smachpy_viz.live.runs import Runs

    machines = Machines()
    machine = machines.get(Runs(machines, [path.parent]).open(f"file {path}"))
    assert machine is not None
    for _ in machine.snapshot_parts()[1]:
        pass
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def of_timers(sizes: Sequence[int]) -> dict[str, float]:
    """Slopes of what it costs to set a timer and to cancel it, beside more and more others."""
    found = {}
    for name, clock in {"real": RealClock(), "virtual": VirtualClock()}.items():
        with clock if isinstance(clock, VirtualClock) else contextlib.nullcontext():
            costs = [min(cost_of_timer(clock, size) for _ in range(5)) for size in sizes]
        found[f"timer, {name} clock: us"] = costs[-1] * 1e6
        found[f"timer, {name} clock: slope"] = slope(sizes, costs)
    return found


def cost_of_timer(clock: Clock, others: int) -> float:
    """Return the CPU time of setting and cancelling one [s], beside `others` that are due later."""
    there = [clock.call_later(7200.0 + number * 1e-3, int) for number in range(others)]
    begun = time.process_time()
    for number in range(TIMERS):
        clock.call_later(3600.0 + number * 1e-3, int).cancel()
    took = time.process_time() - begun
    for timer in there:
        timer.cancel()
    return took / TIMERS


def of_runners(place: str, folder: Path, counts: Sequence[int], *, long: bool) -> dict[str, float]:
    """Processes per mission with several runners of one queue; with `long`, what each one costs.

    A runner and its first mission cost a second of CPU, to import. The costs of the others are the
    difference of two queues, so that they say what runners cost one another.
    """
    mission = folder / "errand.py"
    mission.write_text(ERRAND, encoding="utf-8")
    adopt_orphans()
    found: dict[str, float] = {}
    for count in counts:
        few = cost_of_queue(place, mission, count, 2 * count)
        found[f"{count} runners: processes per mission"] = few.processes / (2 * count)
        if long:
            missions = 2 * count + 40
            many = cost_of_queue(place, mission, count, missions)
            each = (many.cpu - few.cpu) / (missions - 2 * count)
            found[f"{count} runners: processes per mission"] = many.processes / missions
            found[f"{count} runners: CPU s per mission"] = each
            found[f"{count} runners: CPU s of one's start"] = few.cpu / count - 2 * each
            found[f"{count} runners: missions/s"] = missions / many.seconds
    return found


@dataclasses.dataclass
class QueueCost:
    """What runners have used for a queue: processes, CPU time [s], time [s]."""

    processes: int
    cpu: float
    seconds: float


def cost_of_queue(place: str, mission: Path, count: int, missions: int) -> QueueCost:
    """Let `count` runners empty a queue of trivial missions."""
    names = [f"m{count}-{missions}-{number}" for number in range(missions)]
    with contextlib.closing(open_store(place)) as store:
        for name in names:
            store.create(new_mission(errand(), mission=name, target=str(mission)))
    words = ["-m", "smachpy", "runner", "--db", place, "--until-empty", "--allow", str(mission)]
    texts: list[str] = []

    def run() -> None:
        runners = [
            subprocess.Popen(
                [sys.executable, *words],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
            for _ in range(count)
        ]
        texts.extend(runner.communicate()[0] for runner in runners)
        with contextlib.suppress(ChildProcessError):
            while True:  # the servers of processes, which outlive their runners by a moment
                os.wait()

    begun = time.perf_counter()
    cpu = cpu_of_children(run)
    text = "".join(texts)
    assert len(re.findall(r"mission \S+: ended: done", text)) == missions, text
    begins = len(re.findall(r"mission \S+: begins", text))
    return QueueCost(begins, cpu, time.perf_counter() - begun)


def adopt_orphans() -> None:
    """Let this process wait for the children of its children, and so get their CPU time."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)  # PR_SET_CHILD_SUBREAPER


def cpu_of_children(run: Callable[[], object]) -> float:
    """Return the CPU time of the processes that `run` starts and waits for [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def of_starts(folder: Path, processes: int) -> dict[str, float]:
    """CPU time of the processes of trivial missions: warm, fresh, and those of `mp.Pool`."""
    mission = folder / "errand.py"
    mission.write_text(ERRAND, encoding="utf-8")
    words = ["run", str(mission), "--plain"]

    def warm(count: int) -> None:
        starter = Starter(os.environ, lambda: None)
        for _ in range(count):
            process = starter.start(words)
            assert process.wait(START_S)
            assert process.code == 0
        server = starter._server
        starter.close()
        assert server is not None
        server._process.wait()

    def fresh() -> None:
        command = [sys.executable, "-P", "-m", "smachpy.command", *words]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)

    def pool() -> None:
        with multiprocessing.get_context("fork").Pool(1, maxtasksperchild=1) as workers:
            workers.map(abs, range(10 * processes), chunksize=1)
            workers.close()
            workers.join()

    with silent():
        first = cpu_of_children(lambda: warm(1))
        each = (cpu_of_children(lambda: warm(1 + processes)) - first) / processes
        cold = min(cpu_of_children(fresh) for _ in range(2))
    return {
        "start: CPU s, warm": each,
        "start: CPU s, fresh": cold,
        "start: warm / fresh": each / cold,
        "start: CPU s, mp.Pool of one task each": cpu_of_children(pool) / (10 * processes),
    }


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """Send what this process and its children write to /dev/null."""
    kept = os.dup(1)
    with Path(os.devnull).open("wb") as nothing:
        os.dup2(nothing.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def of_servers(count: int) -> dict[str, float]:
    """CPU time to start and stop action servers in one process, and that of zenoh alone."""
    command = [sys.executable, __file__, "--servers", str(count)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    figures = json.loads(done.stdout)
    return {
        f"{count} servers: CPU s to start": figures["start"],
        f"{count} servers: CPU s to stop": figures["stop"],
        f"{count} servers: declarations of zenoh alone, CPU s": figures["zenoh"],
        "servers: start / zenoh alone": figures["start"] / figures["zenoh"],
    }


def start_servers(count: int) -> dict[str, float]:
    """Start and stop servers in this process, after the same declarations by zenoh alone."""
    import zenoh

    from actionlib_core import ActionServer
    from actionlib_core.interfaces.actionlib.msg import TestAction
    from actionlib_core.wire.private_network import private_network

    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    session = zenoh.open(config)
    begun = time.process_time()
    kept: list[Any] = []
    for number in range(count):
        name = f"a{number:05}"
        kept += [
            session.declare_subscriber(
                f"{name}/{what}", zenoh.handlers.Callback(print, indirect=False)
            )
            for what in ("goal", "cancel", "ack")
        ]
        kept += [
            session.declare_queryable(
                f"{name}/{what}", zenoh.handlers.Callback(print, indirect=False)
            )
            for what in ("goal", "result")
        ]
        kept.append(session.liveliness().declare_token(f"@tokens/{name}"))
    alone = time.process_time() - begun
    session.close()
    with private_network():
        begun = time.process_time()
        servers = [
            ActionServer(f"a{n:05}", TestAction, print, print, auto_start=False)
            for n in range(count)
        ]
        for server in servers:
            server.start()
        started = time.process_time()
        for server in servers:
            server.stop()
        stopped = time.process_time()
    return {"zenoh": alone, "start": started - begun, "stop": stopped - started}


def of_clients(counts: Sequence[int]) -> dict[str, float]:
    """CPU time of a goal, at its server and clients, with more and more clients of one action."""
    found: dict[str, float] = {}
    costs = []
    for count in counts:
        os.environ["SMACHPY_DOMAIN"] = str(1_000 + os.getpid() % 3_000)
        each = [str(count // CLIENT_PROCESSES), str(GOALS // count)]
        with contextlib.ExitStack() as processes:

            def start(*words: str, processes: Any = processes) -> subprocess.Popen[str]:
                command = [sys.executable, __file__, *words]
                pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
                one = subprocess.Popen(command, text=True, **pipes)
                processes.callback(one.wait)
                processes.callback(one.kill)
                assert one.stdout is not None
                assert one.stdout.readline() == "ready\n"
                return one

            server = start("--serve")
            clients = [start("--clients", *each) for _ in range(CLIENT_PROCESSES)]
            begun = time.perf_counter()
            for one in (server, *clients):
                tell(one)
            cpu = sum(float(one.stdout.readline()) for one in clients if one.stdout)
            seconds = time.perf_counter() - begun
            tell(server)
            assert server.stdout is not None
            cpu += float(server.stdout.readline())
        goals = CLIENT_PROCESSES * int(each[0]) * int(each[1])
        costs.append(cpu / goals)
        found[f"{count} clients: CPU ms of a goal"] = 1e3 * cpu / goals
        found[f"{count} clients: goals/s"] = goals / seconds
    found["CPU of a goal, most clients / fewest"] = costs[-1] / costs[0]
    return found


def tell(process: subprocess.Popen[str]) -> None:
    """Let a process go on that reads a line."""
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()


def serve() -> None:
    """Serve an action; tell the CPU time between two lines of standard input."""
    from actionlib_core import ActionServer
    from actionlib_core.interfaces.actionlib.msg import TestAction, TestResult

    def on_goal(handle: Any) -> None:
        handle.set_accepted()
        handle.set_succeeded(TestResult(1))

    server = ActionServer("scale", TestAction, on_goal, print, auto_start=False)
    server.start()
    print("ready", flush=True)
    sys.stdin.readline()
    begun = time.process_time()
    sys.stdin.readline()
    print(time.process_time() - begun, flush=True)
    sys.stdin.read()


def send_goals(count: int, goals: int) -> None:
    """Let `count` clients send goals one after the other, and tell the CPU time."""
    from actionlib_core import ActionClient
    from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal

    clients = [ActionClient("scale", TestAction) for _ in range(count)]
    for client in clients:
        assert client.wait_for_server(START_S)

    def run(client: Any) -> None:
        for _ in range(goals):
            with client.send(TestGoal(1), timeout=START_S) as handle:
                handle.result()

    threads = [threading.Thread(target=run, args=(client,)) for client in clients]
    print("ready", flush=True)
    sys.stdin.readline()
    begun = time.process_time()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    print(time.process_time() - begun, flush=True)
    sys.stdin.read()


def of_action_states(sizes: Sequence[int]) -> dict[str, float]:
    """CPU time of a concurrence of action states: from the preempt of all to the machine's end."""
    costs = []
    for size in sizes:
        command = [sys.executable, __file__, "--states", str(size)]
        runs = [subprocess.run(command, check=True, capture_output=True) for _ in range(3)]
        costs.append(min(float(run.stdout) for run in runs))
    return {
        f"{sizes[-1]} action states: CPU s until told and ended": costs[-1],
        "action states told and ended: slope": slope(sizes, costs),
    }


def preempt_states(count: int) -> float:
    """Return the CPU time of preempting `count` action states of this process [s]."""
    from actionlib_core import ActionServer
    from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal, TestResult
    from actionlib_core.wire.private_network import private_network

    begun, left = threading.Event(), [count]

    def on_goal(handle: Any) -> None:
        handle.set_accepted()
        left[0] -= 1
        if not left[0]:
            begun.set()

    def on_cancel(handle: Any) -> None:
        handle.set_canceled(TestResult(0))

    outcomes = ["succeeded", "aborted", "preempted"]
    machine = smachpy.Concurrence(outcomes=outcomes, default_outcome="succeeded")
    with private_network():
        server = ActionServer("scale", TestAction, on_goal, on_cancel, auto_start=False)
        server.start()
        for number in range(count):
            machine.add(
                f"C{number}", smachpy.SimpleActionState("scale", TestAction, goal=TestGoal(1))
            )
        run = threading.Thread(target=machine.execute, daemon=True)  # a failure ends the process
        run.start()
        assert begun.wait(START_S)
        before = time.process_time()
        machine.request_preempt()
        run.join()
        took = time.process_time() - before
        server.stop()
    return took


def of_dbos(place: str, missions: int) -> dict[str, float]:
    """Missions per second of a queue in one process: ours one by one, DBOS's workflows at once."""
    from dbos import DBOS

    with contextlib.closing(open_store(place)) as store:
        begun = time.perf_counter()
        for number in range(missions):
            row = new_mission(errand(), mission=f"q{number}", target="errand.py")
            store.create(row)
        for _ in range(missions):
            found = store.reserve(this_runner(), seconds=LEASE_S)
            assert found is not None
            machine = errand()
            with kept_mission(machine, store, found[0].id, reserved=found[1]):
                machine.execute()
        ours = missions / (time.perf_counter() - begun)

    url = place.replace("postgresql://", "postgresql+psycopg://")
    DBOS(config={"name": "bench", "system_database_url": url, "log_level": "ERROR"})

    @DBOS.step()
    def carry() -> str:
        return "done"

    @DBOS.workflow()
    def mission() -> str:
        return carry()

    DBOS.launch()
    queue = DBOS.register_queue(
        "missions", polling_interval_sec=0.01
    )  # as many at once as it likes
    begun = time.perf_counter()
    handles = [queue.enqueue(mission) for _ in range(missions)]
    assert all(handle.get_result() == "done" for handle in handles)
    theirs = missions / (time.perf_counter() - begun)
    with contextlib.closing(open_store(place)) as store:
        names = iter(range(10**9))
        one, other = medians_in_turns(
            lambda: smachpy.run_durable(errand(), store, mission=f"run{next(names)}"), mission
        )
    DBOS.destroy()
    return {
        "run_durable, PostgreSQL: ms": 1e3 * one,
        "run_durable / DBOS workflow": one / other,
        "queue in one process: missions/s": ours,
        "queue in one process: DBOS workflows/s": theirs,
        "queue in one process: DBOS / ours": theirs / ours,
    }


def medians_in_turns(*acts: Callable[[], object]) -> list[float]:
    """Return the median times of calls [s], in turns so that other work meets all alike."""
    times: list[list[float]] = [[] for _ in acts]
    for _ in range(TURNS):
        for act, taken in zip(acts, times, strict=True):
            begun = time.perf_counter()
            act()
            taken.append(time.perf_counter() - begun)
    return [statistics.median(taken) for taken in times]


def measure_here(args: argparse.Namespace) -> bool:
    """Measure what another process of this program asks for; return whether one has asked."""
    if args.servers:
        print(json.dumps(start_servers(args.servers)))
    elif args.states:
        print(preempt_states(args.states))
    elif args.view:
        print(open_in_viewer(args.view))
    elif args.serve:
        serve()
    elif args.clients:
        send_goals(*args.clients)
    else:
        return False
    return True


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--long", action="store_true", help="larger sizes, and runners")
    parser.add_argument("--store", metavar="URL", help="an empty database for the queue")
    parser.add_argument("--servers", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--states", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--view", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--clients", type=int, nargs=2, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if measure_here(args):
        return
    waiting = (100, 1_000, 10_000, 100_000) if args.long else (100, 1_000, 10_000)
    finished = (10, 1_000, 10_000, 100_000) if args.long else (10, 1_000, 10_000)
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["SMACHPY_RUNS"] = name
        if args.store:
            found |= of_queue(args.store, waiting)
            found |= of_runners(args.store, folder, (1, 2, 4, 8), long=args.long)
            if importlib.util.find_spec("dbos"):
                found |= of_dbos(args.store, 200)
        else:
            found |= of_queue(str(folder / "queue.db"), waiting)
            found |= of_busy(str(folder / "busy.db"), waiting)
            found |= of_finished(str(folder / "finished.db"), finished)
            found |= of_values(folder, (5, 20, 80))
            found |= of_timers((100, 10_000, 100_000) if args.long else (100, 10_000))
            found |= of_recordings(folder, (1_000, 500_000 if args.long else 30_000))
            found |= of_starts(folder, 10 if args.long else 4)
            found |= of_servers(1_000 if args.long else 400)
            if args.long:
                found |= of_action_states((300, 1_000, 3_000))
                found |= of_clients((4, 16, 64, 200))
            runners = (1, 2, 4, 8) if args.long else (4,)
            found |= of_runners(str(folder / "runners.db"), folder, runners, long=args.long)
    if args.json:
        print(json.dumps({"figures": found}))
        return
    for figure, value in found.items():
        print(f"{figure:44} {value:12.2f}")


if __name__ == "__main__":
    main()
