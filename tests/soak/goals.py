"""Goals between real processes that are killed, stopped, suspended and started again.

Two actions, each with a server and two clients: one among peers, one through a router. While the
clients send goals, one fault after the other is done to these processes, as the seed says. Every
process writes a journal; at the end the journals are held against what is promised:

- a goal id is executed at most once, whatever happens and however many servers there were;
- every goal of a client that lived ended, once, for a reason that the journals confirm;
- a cancel is heard by the server, within 50 ms where no fault was near, though callbacks block
  (judged only on a computer that is not busy with other things).
"""

from __future__ import annotations

import collections
import contextlib
import ctypes
import os
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import journal

HERE = Path(__file__).parent
LEASE_S = 1.5
FOUND_AGAIN_S = 10.0  # peers that lost each other have met again, and said what was missed
NEAR_S = 2.0  # a fault without a lost link is over
WARM_UP_S = 30.0  # longest wait for a process to be there
LAST_S = 120.0  # longest wait for a client to end
CANCEL_S = 0.05  # longest p99 of a cancel's way, where the computer has nothing else to do:
IDLE_S = 0.003  # p99 of its own delays is below this
SENDING_S = 0.05  # between looking for a fault that is due
SLOWEST = 20.0  # goals a second; a campaign that is slower ends with fewer


ROUTER = """
import signal, sys, time
from actionlib_core.config import Config
from actionlib_core.transport.zenoh import ZenohTransport

stop = []
signal.signal(signal.SIGTERM, lambda number, _: stop.append(number))
router = ZenohTransport(
    Config(mode="router", listen=("{endpoint}",), discovery="off", lease={lease})
)
open(sys.argv[1], "w").write('{{"t": 0, "event": "up"}}')
while not stop:
    time.sleep(0.1)
router.close()
"""


_libc = ctypes.CDLL(None)


def _die_with_parent() -> None:
    """Have the system kill this process when the campaign ends, also by kill -9 (Linux)."""
    _libc.prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


@dataclass
class Program:
    """One process, or what is left of it.

    Attributes:
        faults: What was done to it: (when it began, when it was over, what).
    """

    kind: str
    number: int
    process: subprocess.Popen
    journal: Path
    faults: list[tuple[float, float, str]] = field(default_factory=list)

    @property
    def alive(self) -> bool:
        return self.process.poll() is None


class Group:
    """The programs of one action and what is done to them."""

    def __init__(self, name: str, directory: Path, config: str, rng: random.Random) -> None:
        self.name = name
        self.random = rng
        self.programs: list[Program] = []
        self.busy_until = 0.0
        self.clocks_set = 0
        self._directory = directory
        self._numbers = collections.Counter()
        path = directory / f"{name}.yaml"
        path.write_text(config)
        # The router's programs join its network, the peers' one of their own.
        self._environment = {**os.environ, "SMACHPY_CONFIG": str(path)}
        self._environment.pop("SMACHPY_DOMAIN", None)
        self._later: list[tuple[float, object]] = []

    def start(self, kind: str, *, wait: bool = True) -> Program:
        seed = str(self.random.randrange(1 << 30))
        arguments = [str(HERE / f"goal_{kind}.py"), "JOURNAL", self.name, seed]
        if kind == "client":  # one in two is patient
            arguments.append(self.random.choice(["0", str(2 * FOUND_AGAIN_S)]))
        program = self._run(kind, arguments)
        if wait:
            self._wait_for(program)
        return program

    def start_router(self, endpoint: str) -> None:
        """Start the router, and wait until it listens."""
        code = ROUTER.format(endpoint=endpoint, lease=LEASE_S)
        self._wait_for(self._run("router", ["-c", code, "JOURNAL"]))

    def _run(self, kind: str, arguments: list[str]) -> Program:
        number = self._numbers[kind]
        self._numbers[kind] += 1
        path = self._directory / f"{self.name}-{kind}-{number}.jsonl"
        path.write_bytes(b"")
        arguments = [str(path) if word == "JOURNAL" else word for word in arguments]
        with path.with_suffix(".err").open("w") as errors:
            process = subprocess.Popen(
                [sys.executable, *arguments],
                env=self._environment,
                stdout=subprocess.DEVNULL,
                stderr=errors,
                start_new_session=True,
                preexec_fn=_die_with_parent,
            )
        program = Program(kind, number, process, path)
        self.programs.append(program)
        return program

    @staticmethod
    def _wait_for(program: Program) -> None:
        deadline = time.monotonic() + WARM_UP_S
        while not program.journal.stat().st_size and program.alive:
            assert time.monotonic() < deadline, f"{program.journal.name}: not up"
            time.sleep(0.02)

    def living(self, kind: str) -> list[Program]:
        return [p for p in self.programs if p.kind == kind and p.alive]

    # -- faults --------------------------------------------------------------------------------

    def tick(self) -> None:
        """Do what is due: end a suspension, see to a server, or begin the next fault."""
        now = time.monotonic()
        due = [entry for entry in self._later if entry[0] <= now]
        for entry in due:
            self._later.remove(entry)
            entry[1]()
        if not self.living("server"):
            self.start("server", wait=False)
        while len(self.living("client")) < 2:
            self.start("client", wait=False)
        if now >= self.busy_until and not self._later:
            names = list(FAULTS)
            (name,) = self.random.choices(names, [FAULTS[name] for name in names])
            self.busy_until = now + self.random.uniform(0.5, 2.5)
            getattr(self, name)()

    def hurt(self, program: Program, number: int, what: str, lasts: float = NEAR_S) -> None:
        now = time.monotonic()
        program.faults.append((now, now + lasts, what))
        program.process.send_signal(number)  # nothing happens if it has gone

    def _one(self, kind: str) -> Program | None:
        ready = [p for p in self.living(kind) if p.journal.stat().st_size]
        return self.random.choice(ready) if ready else None

    def kill_server(self) -> None:
        if program := self._one("server"):
            self.hurt(program, signal.SIGKILL, "kill -9")

    def stop_server(self) -> None:
        if program := self._one("server"):
            self.hurt(program, signal.SIGTERM, "SIGTERM")

    def hang_up_server(self) -> None:
        """Close the terminal of a server, or stop its service by a signal that is less usual."""
        if program := self._one("server"):
            self.hurt(program, signal.SIGHUP, "SIGHUP")

    def set_clock(self) -> None:
        """Set the clock of the computer on which a server or a client runs; it is no fault."""
        kind = self.random.choice(["server", "client"])
        if program := self._one(kind):
            number = signal.SIGUSR1 if kind == "server" else signal.SIGHUP
            program.process.send_signal(number)
            self.clocks_set += 1

    def overlap_servers(self) -> None:
        """Start the next server before the old one has gone."""
        old = self._one("server")
        self.start("server", wait=False)
        if old:
            wait = self.random.uniform(0.0, 1.0)
            number, what = self.random.choice(
                [(signal.SIGTERM, "SIGTERM, next one started"), (signal.SIGKILL, "kill, next one")]
            )
            self._after(wait, lambda: self.hurt(old, number, what))

    def two_servers(self) -> None:
        """Start two servers at the same moment; one gives way."""
        for program in self.living("server"):
            self.hurt(program, signal.SIGKILL, "kill -9, two follow")
        for _ in range(2):
            twin = self.start("server", wait=False)
            now = time.monotonic()
            twin.faults.append((now, now + NEAR_S, "twin"))

    def suspend_server(self) -> None:
        self._suspend("server", LEASE_S * self.random.uniform(1.05, 2.0))

    def suspend_client(self) -> None:
        self._suspend("client", LEASE_S * self.random.uniform(1.05, 2.0))

    def suspend_shortly(self) -> None:
        self._suspend(self.random.choice(["server", "client"]), LEASE_S * 0.3)

    def suspend_about_the_lease(self) -> None:
        self._suspend(
            self.random.choice(["server", "client"]), LEASE_S * self.random.uniform(0.8, 1.1)
        )

    def suspend_router(self) -> None:
        self._suspend("router", LEASE_S * self.random.uniform(0.9, 2.0))

    def _suspend(self, kind: str, seconds: float) -> None:
        if program := self._one(kind):
            # Keepalives come four times within the lease, so a little less can end it, too.
            after = NEAR_S if seconds < LEASE_S / 2 else FOUND_AGAIN_S
            self.hurt(program, signal.SIGSTOP, f"suspended {kind}", seconds + after)
            self._after(seconds, lambda: program.process.send_signal(signal.SIGCONT))
            self.busy_until += seconds + self.random.uniform(0.0, after)

    def kill_client(self) -> None:
        if program := self._one("client"):
            self.hurt(program, signal.SIGKILL, "kill -9")

    def stop_client(self) -> None:
        if program := self._one("client"):
            self.hurt(program, signal.SIGTERM, "SIGTERM")

    def storm(self) -> None:
        """Have a client cancel all that it has, one by one."""
        if program := self._one("client"):
            program.process.send_signal(signal.SIGUSR1)

    def cancel_all(self) -> None:
        """Have a client cancel every goal of every client."""
        if program := self._one("client"):
            program.process.send_signal(signal.SIGUSR2)

    def _after(self, seconds: float, function) -> None:
        self._later.append((time.monotonic() + seconds, function))

    # -- the end -------------------------------------------------------------------------------

    def finish(self) -> None:
        """Let the clients wait for their last goals; then stop everything."""
        while self._later:
            self._later.sort(key=lambda entry: entry[0])
            due, function = self._later.pop(0)
            time.sleep(max(0.0, due - time.monotonic()))
            function()
        if not self.living("server"):
            self.start("server")
        clients = self.living("client")
        for program in clients:
            self._wait_for(program)  # one that has just been started would die of the signal
            program.process.terminate()
        deadline = time.monotonic() + LAST_S
        for program in clients:
            while program.alive and time.monotonic() < deadline:
                if not self.living("server"):
                    self.start("server")
                time.sleep(SENDING_S)
        for kind in ("server", "router"):
            for program in self.living(kind):
                program.process.terminate()
                program.process.wait(30.0)

    def close(self) -> None:
        """Leave nothing running."""
        for program in self.programs:
            if program.alive:
                program.process.kill()
            program.process.wait()


FAULTS = {
    "kill_server": 2,
    "stop_server": 2,
    "hang_up_server": 1,
    "set_clock": 3,
    "overlap_servers": 2,
    "two_servers": 1,
    "suspend_server": 1,
    "suspend_client": 1,
    "suspend_shortly": 1,
    "suspend_about_the_lease": 1,
    "suspend_router": 1,
    "kill_client": 1,
    "stop_client": 1,
    "storm": 4,
    "cancel_all": 1,
}


class Facts:
    """What the journals of one group's servers say, and what was done to the group."""

    def __init__(self, group: Group) -> None:
        self.execs: dict[str, list[tuple[float, Program]]] = collections.defaultdict(list)
        self.cancelled: dict[str, float] = {}
        self.endings: dict[str, dict[int, float]] = collections.defaultdict(dict)
        self._stopping: list[float] = []
        self._sessions: dict[str, Program] = {}
        self._faults = [(fault, program) for program in group.programs for fault in program.faults]
        for program in group.programs:
            for event in journal.read(program.journal) if program.kind == "server" else ():
                self._take(event, program)

    def _take(self, event: dict, program: Program) -> None:
        goal_id, when = event.get("id", ""), event["t"]
        match event["event"]:
            case "exec":
                self.execs[goal_id].append((when, program))
            case "cancel":
                self.cancelled.setdefault(goal_id, when)
            case "ending":
                self.endings[goal_id].setdefault(event["status"], when)
            case "session":
                self._sessions[event["session"]] = program
            case "stopping":
                self._stopping.append(when)
            case "gave way":
                self._faults.append(((when, when + NEAR_S, "gave way"), program))

    def fault_near(self, client: Program, when: float) -> bool:
        """Tell whether something was done to a client, or to the servers or router, just then."""
        return any(
            began - NEAR_S <= when <= over
            for (began, over, _), program in self._faults
            if program.kind != "client" or program is client
        )

    def what_is_false(self, end: dict, sent: float) -> str:
        """Return what contradicts a client's word on a goal's end; "" when all confirms it."""
        goal_id, status, done = end["id"], end["status"], end["t"]
        ends = self.endings.get(goal_id, {})
        wrong = ""
        if status == "LOST":
            wrong = self._what_is_false_of_lost(end["text"], sent, done)
        elif status in {"SUCCEEDED", "PREEMPTED"}:
            wrong = "" if STATUS[status] in ends else "no server ended it so"
        elif status == "RECALLED":
            wrong = "" if STATUS["PREEMPTED"] in ends or goal_id not in self.execs else "it began"
        elif not any(sent - NEAR_S <= when <= done for when in self._stopping):
            wrong = "no server was stopping"
        return wrong

    def _what_is_false_of_lost(self, text: str, sent: float, done: float) -> str:
        named = re.search(r"\(session ([0-9a-f]+)\)", text)
        if not named:
            return "no server is named"
        if named[1] not in self._sessions:
            return "there was no such server"
        # A client or router that is suspended loses a server that is well.
        blamed = [
            fault
            for fault, program in self._faults
            if program is self._sessions[named[1]] or program.kind != "server"
        ]
        if not any(began <= done and sent <= over + FOUND_AGAIN_S for began, over, _ in blamed):
            return "nothing had happened to the server or the link"
        return ""


class Judge:
    """Holds the journals against the promises.

    Attributes:
        problems: What was broken, in words.
        figures: What was counted, in the order in which it is printed.
    """

    def __init__(self) -> None:
        self.problems: list[str] = []
        self.figures: dict[str, object] = {}
        self._sent = 0
        self._executed = 0
        self._again = 0
        self._delays: list[float] = []
        self._ended: collections.Counter = collections.Counter()
        self._faults: collections.Counter = collections.Counter()
        self._lost: collections.Counter = collections.Counter()

    def hear(self, group: Group) -> None:
        """Take the journals of a group that has ended."""
        facts = Facts(group)
        self._faults.update(what for program in group.programs for _, _, what in program.faults)
        self._faults["clock set"] += group.clocks_set
        self._executed += len(facts.execs)
        for goal_id, times in facts.execs.items():
            self._again += len(times) - 1
            if len(times) > 1:
                where = ", ".join(f"{p.journal.name} at {t:.3f}" for t, p in times)
                self.problems.append(f"goal {goal_id} was executed {len(times)} times: {where}")
        for program in group.programs:
            if program.kind == "client":
                self._hear_client(program, facts)

    def _hear_client(self, program: Program, facts: Facts) -> None:
        sent: dict[str, float] = {}
        asked: dict[str, float] = {}
        ends: list[dict] = []
        finished = False
        for event in journal.read(program.journal):
            match event["event"]:
                case "sent":
                    sent[event["id"]] = event["t"]
                case "cancel":
                    asked.setdefault(event["id"], event["t"])
                case "done":
                    ends.append(event)
                case "done twice" | "never" as what:
                    self._blame(program, f"goal {event['id']}: {what}")
                case "end":
                    finished = True
        self._sent += len(sent)
        killed = any("kill" in what for _, _, what in program.faults)
        if not finished and not killed:
            self._blame(program, "the client did not end")
        missing = sent.keys() - {end["id"] for end in ends}
        if finished and missing:
            self._blame(program, f"no end of {len(missing)} goals: {sorted(missing)[:3]}")
        for end in ends:
            self._ended[end["status"]] += 1
            if end["status"] == "LOST":
                self._lost[re.sub(r"[0-9a-f]{16,}|'[^']*'", "...", end["text"])] += 1
            wrong = facts.what_is_false(end, sent.get(end["id"], end["t"]))
            if wrong:
                words = (
                    f"goal {end['id']} ended {end['status']} ({end['text']!r}) at {end['t']:.3f}"
                )
                self._blame(program, f"{words}, but {wrong}")
        for goal_id, when in asked.items():
            self._hear_cancel(program, facts, goal_id, when)

    def _hear_cancel(self, program: Program, facts: Facts, goal_id: str, when: float) -> None:
        began = facts.execs[goal_id][0][0] if goal_id in facts.execs else when
        if began >= when or facts.fault_near(program, when):
            return
        if goal_id in facts.cancelled:
            self._delays.append(max(0.0, facts.cancelled[goal_id] - when))
        elif not any(ended < when + CANCEL_S for ended in facts.endings[goal_id].values()):
            self._blame(program, f"the cancel of {goal_id} at {when:.3f} was not heard")

    def _blame(self, program: Program, what: str) -> None:
        self.problems.append(f"{program.journal.name}: {what}")

    def conclude(self, seconds: float, own_delays: list[float]) -> None:
        """Make the figures.

        Args:
            seconds: How long it took.
            own_delays: By how much the computer was late when nothing but time was waited for [s].
        """
        delays, own = sorted(self._delays) or [0.0], sorted(own_delays) or [0.0]
        if _share(own, 0.99) < IDLE_S and _share(delays, 0.99) > CANCEL_S:
            self.problems.append(f"cancels: p99 is above {CANCEL_S * 1e3:.0f} ms")
        self.figures = {
            "seconds": round(seconds, 1),
            "goals sent": self._sent,
            "goals executed": self._executed,
            "executed again": self._again,
            "ended": dict(self._ended.most_common()),
            "reasons of LOST": dict(self._lost.most_common()),
            "faults": dict(self._faults.most_common()),
            "cancels timed": len(self._delays),
            "cancel heard after [ms]": _quantiles(delays),
            "the computer's own delay [ms]": _quantiles(own),
            "problems": len(self.problems),
        }


STATUS = {"PREEMPTED": 2, "SUCCEEDED": 3}


def _share(ordered: list[float], share: float) -> float:
    return ordered[int(share * (len(ordered) - 1))]


def _quantiles(ordered: list[float]) -> str:
    shares = {"p50": 0.5, "p99": 0.99, "max": 1.0}
    return ", ".join(f"{name} {_share(ordered, s) * 1e3:.1f}" for name, s in shares.items())


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def main(goals: int, seed: int, *, keep: Path | None = None) -> Judge:
    """Run a campaign.

    Args:
        goals: How many goals are sent, about.
        seed: Which faults, and when. What runs when within the processes is the computer's choice.
        keep: Where the journals go; None: nowhere.
    """
    rng = random.Random(seed)
    with contextlib.ExitStack() as stack:
        place = keep or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="soak-")))
        place.mkdir(parents=True, exist_ok=True)
        router = f"tcp/127.0.0.1:{_free_port()}"
        common = f"lease: {LEASE_S}\n"
        routed = Group(
            "routed",
            place,
            f"{common}mode: client\nconnect: [{router}]\ndiscovery: off\nconnect_timeout: 20.0\n",
            random.Random(rng.randrange(1 << 30)),
        )
        peers = Group(
            "peers",
            place,
            f"{common}domain: {1 + os.getpid() % 9999}\n",
            random.Random(rng.randrange(1 << 30)),
        )
        groups = [routed, peers]
        for group in groups:
            stack.callback(group.close)
        routed.start_router(router)
        for group in groups:
            group.start("server")
            for _ in range(2):
                group.start("client")
        begin = time.monotonic()
        deadline = begin + 10.0 + goals / SLOWEST
        own_delays = []
        while time.monotonic() < deadline and _count_sent(groups) < goals:
            for group in groups:
                group.tick()
            slept = time.monotonic()
            time.sleep(SENDING_S)
            own_delays.append(time.monotonic() - slept - SENDING_S)
        for group in groups:
            group.finish()
        judge = Judge()
        for group in groups:
            judge.hear(group)
        judge.conclude(time.monotonic() - begin, own_delays)
        return judge


def _count_sent(groups: list[Group]) -> int:
    """Return about how many goals were sent, from the sizes of the journals."""
    size = sum(p.journal.stat().st_size for g in groups for p in g.programs if p.kind == "client")
    return size // BYTES_PER_GOAL


BYTES_PER_GOAL = 270  # of a client's journal


def print_figures(judge: Judge) -> None:
    for name, value in judge.figures.items():
        if isinstance(value, dict):
            print(f"  {name}:")
            for key, number in value.items():
                print(f"    {key}: {number}")
        else:
            print(f"  {name}: {value}")
    for problem in judge.problems[:SHOWN]:
        print(f"  PROBLEM: {problem}")


SHOWN = 20
