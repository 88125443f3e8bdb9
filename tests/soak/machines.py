"""Random machines under random preempts, in virtual and in real time; prints what came of them.

python tests/soak/machines.py [--seconds 300] [--seed 1]

Each machine runs wild (children that raise, block, do not listen or override what they inherit,
callbacks and operators that ask it to stop, pause, step, jump and choose outcomes, and who set the
computer's clock), then calm, while threads of the wild run may still be about. Some machines tidy
up after a preempt, some have a clean-up. A wild run ends soon after it was asked to stop, with an
outcome that it declares or with an error of smachpy, leaves no flag and no pause, and cleans up
once each time it ran; a calm run ends 'done' and nobody in it is asked anything.
"""

from __future__ import annotations

import argparse
import dataclasses
import logging
import os
import random
import signal
import sys
import threading
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

from actionlib_core.clock import RealClock, VirtualClock, current_clock, use_clock
from smachpy import Concurrence, Iterator, SmachError, State, StateMachine, set_options
from smachpy.events import Abandoned, Entered, Preempted, PreemptRequested

sys.path.append(str(Path(__file__).parents[1]))  # as a program it knows its own folder only

from wall_clock import Computer

OUTCOMES = ["done", "aborted", "preempted"]
HANG_S = 60.0  # real seconds
AFTERWARDS = 4.0  # longest time from the last request to the end: grace, patience, the rest [s]


class Attack:
    """What one machine is made of and exposed to.

    Attributes:
        unit: Durations are multiples of this [s].
        wild: The run is one that is attacked.
        problems: What was promised and did not hold.
    """

    def __init__(self, seed: int, unit: float) -> None:
        self.rng = random.Random(seed)
        self.unit = unit
        self.wild = True
        self.is_late = False  # a command came after the run
        self.wall: Any = None  # the clock of its computer, which the operator sets
        self.problems: list[str] = []
        self.states: list[State] = []
        self.root = self.container(0)

    # -- building ------------------------------------------------------------------------------

    def seconds(self, most: float) -> float:
        return round(self.rng.uniform(0.1, most), 1) * self.unit

    def state(self, depth: int) -> State:
        inner = depth < 3 and self.rng.random() < 0.45
        return self.container(depth) if inner else self.leaf()

    def leaf(self) -> State:
        kinds = [Listens, Listens, Polls, Deaf, Stone, Raises, AsksItself, Overrides, Waits]
        options = {}
        if self.rng.random() < 0.2:
            options["timeout"] = self.seconds(2.0)
        if self.rng.random() < 0.2:
            options["retry"] = (2, self.seconds(0.3), [ValueError, "aborted"])
        if self.rng.random() < 0.2:
            options["on_exception"] = {ValueError: "aborted"}
        if self.rng.random() < 0.3:
            options["preempt_timeout"] = self.seconds(2.0)
        made = self.rng.choice(kinds)(self, **options)
        self.states.append(made)
        return made

    def container(self, depth: int) -> StateMachine | Concurrence | Iterator:
        kind = self.rng.choice([self.machine, self.concurrence, self.concurrence, self.iterator])
        made = kind(depth + 1)
        made.register_start_cb(self.callback)
        made.register_transition_cb(self.callback)
        made.register_termination_cb(self.callback)
        self.states.append(made)
        return made

    def grace(self) -> dict[str, float]:
        return {"preempt_timeout": self.seconds(1.5)}

    def machine(self, depth: int) -> StateMachine:
        made = StateMachine(OUTCOMES, **self.grace())
        count = self.rng.randint(1, 3)
        for number in range(count):
            targets = [f"S{n}" for n in range(number + 1, count)]
            ways = {"done": (targets or ["done"])[0], "aborted": [*targets, "aborted"][0]}
            if self.rng.random() < 0.2:
                ways["preempted"] = "TIDY"
            made.add(f"S{number}", self.state(depth), ways)
        made.add("TIDY", Tidies(self))
        if self.rng.random() < 0.2:
            made.add_cleanup("CLEAN_UP", Tidies(self))
        return made

    def concurrence(self, depth: int) -> Concurrence:
        count = self.rng.randint(2, 3)
        rule = {f"S{n}": "done" for n in range(count)}
        callback = self.on_child_end if self.rng.random() < 0.5 else None
        made = Concurrence(
            OUTCOMES,
            "aborted",
            outcome_map={"done": rule},
            child_termination_cb=callback,
            **self.grace(),
        )
        for label in rule:
            made.add(label, self.state(depth))
        return made

    def iterator(self, depth: int) -> Iterator:
        count = self.rng.randint(1, 3)
        made = Iterator(OUTCOMES, [], [], it=range(count), exhausted_outcome="done", **self.grace())
        made.set_contained_state("EACH", self.state(depth), loop_outcomes=["done"])
        return made

    # -- what happens while it runs ------------------------------------------------------------

    def chance(self, probability: float) -> bool:
        return self.wild and self.rng.random() < probability

    def callback(self, *_: object) -> None:
        if self.chance(0.03):
            self.root.request_preempt()
        if self.chance(0.02):
            raise ValueError("a callback")
        if self.chance(0.01):
            current_clock().sleep(self.seconds(5.0))  # longer than any grace

    def calm_down(self) -> None:
        """Attack no more; on a busy computer a timeout would ask all the same."""
        self.wild = False
        for state in self.states:
            set_options(state, timeout=None)

    def on_child_end(self, outcomes: dict[str, str | None]) -> object:
        if self.chance(0.05):
            raise ValueError("child_termination_cb")
        if self.chance(0.3):
            return True
        return [next(iter(outcomes))] if self.chance(0.2) else False

    def operate(self) -> None:
        """Ask for this and that, and to stop at last; in a task of its own."""
        clock, control = current_clock(), self.root.control
        for _ in range(self.rng.randint(0, 4)):
            clock.sleep(self.seconds(1.5))
            try:
                self.command(control)
            except SmachError:
                continue  # it does not run any more
        for place in control.breakpoints():
            control.remove_breakpoint(*place)
        control.resume()
        clock.sleep(self.seconds(2.0))

    def command(self, control: object) -> None:
        active = control.active()
        # A pause that comes as the run has just ended is for the next one.
        self.is_late = self.is_late or not self.root._is_running
        choice = self.rng.randrange(10)
        if choice >= 6:
            self.rare_command(control, active, choice)
        elif choice == 0:
            control.pause(running=self.rng.choice(["keep", "cancel"]))
        elif choice == 1:
            control.resume()
        elif choice == 2 and active:
            control.force_outcome(self.rng.choice(active), self.rng.choice(OUTCOMES))
        elif choice == 3 and active:
            control.preempt(self.rng.choice(active))
        else:
            self.root.request_preempt()

    def rare_command(self, control: Any, active: tuple[str, ...], choice: int) -> None:
        if choice == 6:
            control.step()
        elif choice == 7 and active:
            place, _, _ = self.rng.choice(active).rpartition("/")
            control.jump(f"{place}/{self.rng.choice(['S0', 'S1', 'TIDY'])}")
        elif choice == 8 and active:
            control.add_breakpoint(self.rng.choice(active))
        else:
            self.wall.ahead += self.rng.uniform(-4000.0, 4000.0)


class Leaf(State):
    """A state of an attack: quick and good in a calm run."""

    def __init__(self, attack: Attack, **options: object) -> None:
        super().__init__(OUTCOMES, **options)
        self.attack = attack

    def execute(self, userdata: object) -> str:
        if not self.attack.wild:
            asked = self.sleep(0.05 * self.attack.unit)
            return "preempted" if asked else "done"
        return self.run_wild()

    def run_wild(self) -> str:
        raise NotImplementedError

    def pause(self, most: float) -> None:
        """Let time pass whoever asks."""
        current_clock().sleep(self.attack.seconds(most))


class Listens(Leaf):
    def run_wild(self) -> str:
        if self.sleep(self.attack.seconds(2.0)):
            if self.attack.chance(0.5):
                self.service_preempt()
            return "preempted"
        return self.attack.rng.choice(["done", "done", "aborted"])


class Tidies(Leaf):
    """What comes after a preempt."""

    def run_wild(self) -> str:
        return "preempted" if self.sleep(self.attack.seconds(0.5)) else "done"


class Polls(Leaf):
    def run_wild(self) -> str:
        for _ in range(20):
            if self.preempt_requested():
                return "preempted"
            self.pause(0.2)
        return "done"


class Waits(Leaf):
    """Ends by nothing but a preempt, or after a long time."""

    def run_wild(self) -> str:
        return "preempted" if self.wait_preempt(4.0 * self.attack.unit) else "aborted"


class Deaf(Leaf):
    """Does not listen, but can be broken into."""

    def run_wild(self) -> str:
        self.pause(5.0)
        return "done"


class Stone(Leaf):
    """Is left behind; ends some day, and writes and asks then."""

    def run_wild(self) -> str:
        clock = current_clock()
        end = clock.now() + self.attack.seconds(5.0)
        while clock.now() < end:
            try:
                clock.sleep(max(0.0, end - clock.now()))
            except Exception:
                return "done"
            except BaseException:  # an interruption
                if not self.attack.wild:
                    raise
        return "done"


class Raises(Leaf):
    def run_wild(self) -> str:
        self.sleep(self.attack.seconds(1.0))
        if self.attack.chance(0.5):
            raise ValueError("a state")
        return "done"


class AsksItself(Leaf):
    def run_wild(self) -> str:
        self.request_preempt()
        if self.attack.chance(0.3):
            raise ValueError("a state that has asked itself")
        return "preempted" if self.attack.chance(0.5) else "done"


class Overrides(Listens):
    """Its own `request_preempt` raises, blocks, asks the root, or forgets to pass it on."""

    def request_preempt(self) -> None:
        choice = self.attack.rng.randrange(5) if self.attack.wild else 0
        if choice != 1:
            super().request_preempt()
        if choice == 2:
            raise ConnectionError("no answer")
        if choice == 3:
            current_clock().sleep(0.3 * self.attack.unit)
        if choice == 4:
            self.attack.root.request_preempt()


# -- one attack ------------------------------------------------------------------------------------


@dataclasses.dataclass
class Figures:
    """What came of a campaign."""

    seed: int
    machines: Counter[str] = dataclasses.field(default_factory=Counter)
    outcomes: Counter[str] = dataclasses.field(default_factory=Counter)
    requests: int = 0
    abandoned: int = 0
    longest_s: float = 0.0
    problems: list[str] = dataclasses.field(default_factory=list)


def judge_run(attack: Attack, figures: Figures, events: list[object], outcome: object) -> None:
    """Check one run that has ended: its outcome, or the type of what it raised."""
    kind = "wild" if attack.wild else "calm"
    figures.outcomes[f"{kind} {outcome}"] += 1
    asked = [event for event in events if isinstance(event, PreemptRequested)]
    lost = [event for event in events if isinstance(event, Abandoned)]
    figures.requests += len(asked)
    figures.abandoned += len(lost)
    if attack.wild:
        if outcome not in OUTCOMES and not (isinstance(outcome, str) and "Error" in outcome):
            attack.problems.append(f"a wild run ended with {outcome!r}")
    else:
        heard = [*asked, *lost, *(event for event in events if isinstance(event, Preempted))]
        if outcome != "done" or heard:
            attack.problems.append(f"a calm run ended with {outcome!r} and heard {heard}")
    # What an operator's pause has stopped is done again after it.
    paused = Counter(event.path for event in asked if event.why == "pause")
    entered = Counter(event.path for event in events if isinstance(event, Entered)) - paused
    for path, count in entered.items():
        container, _, label = path.rpartition("/")
        visits = entered[container] or 1  # the root is not entered
        if label == "CLEAN_UP" and (count > visits or (count < visits and not attack.wild)):
            attack.problems.append(f"{kind}: {count} clean-ups in {visits} visits of {container}")
    for state in attack.states:
        if state.preempt_requested():
            attack.problems.append(f"{kind}: a flag is left at a {type(state).__name__}")


def run_once(attack: Attack) -> tuple[object, list[object]]:
    events: list[object] = []
    unsubscribe = attack.root.subscribe(events.append)
    try:
        return attack.root.execute(), events
    except SmachError as error:
        return type(error).__name__, events
    finally:
        unsubscribe()


def attack_in_virtual_time(seed: int, figures: Figures) -> list[str]:
    with VirtualClock(seed) as clock, use_clock(Computer(clock)) as wall:
        attack = Attack(seed, 1.0)
        attack.wall = wall
        clock.limit = 1000.0
        operator = clock.spawn(attack.operate, name="operator")
        # In a thread of its own: in the main thread nothing can be left behind.
        ended: list[tuple[object, list[object], float]] = []
        paused: list[bool] = []

        def run() -> None:
            ended.append((*run_once(attack), clock.now()))
            # Nobody else runs between the end and this look.
            paused.extend([True] if attack.root.control.is_paused() else [])

        runner = clock.spawn(run, name="runner")
        runner.join()
        outcome, events, end = ended[0]
        if paused and not attack.is_late:
            attack.problems.append("a pause is left")
        operator.join()
        attack.root.control.resume()
        attack.root.recall_preempt()  # a late command was for the next run
        asked = [e.t for e in events if isinstance(e, PreemptRequested) and e.path == "/SM_ROOT"]
        if asked:
            figures.longest_s = max(figures.longest_s, end - asked[0])
            if end - asked[0] > AFTERWARDS:
                attack.problems.append(f"it ended {end - asked[0]:.2f} s after the first request")
        judge_run(attack, figures, events, outcome)
        attack.calm_down()
        judge_run(attack, figures, *reversed(run_once(attack)))
        clock.sleep(20.0)  # what was left behind ends
    return attack.problems


def attack_in_real_time(seed: int, figures: Figures, *, by_signal: bool) -> list[str]:
    """Run in this thread, asked by a signal handler, or in another one."""
    clock = RealClock()
    with use_clock(Computer(clock)) as wall:
        attack = Attack(seed, 0.02)
        attack.wall = wall
        results: list[tuple[object, list[object]]] = []
        operator = clock.spawn(attack.operate, name="operator")
        if by_signal:
            asks = partial(os.kill, os.getpid(), signal.SIGUSR1)
            timer = clock.call_later(attack.seconds(2.0), asks)
            before = signal.signal(signal.SIGUSR1, lambda *_: attack.root.request_preempt())
            results.append(run_once(attack))
        else:
            runner = clock.spawn(lambda: results.append(run_once(attack)), name="runner")
            if not runner.join(HANG_S):
                return ["hangs"]
        operator.join()
        if by_signal:
            timer.cancel()
            clock.sleep(2.0 * attack.unit)  # a late signal is for this run, and must end no process
            signal.signal(signal.SIGUSR1, signal.SIG_IGN)
            signal.signal(signal.SIGUSR1, before)
        attack.root.control.resume()
        attack.root.recall_preempt()
        judge_run(attack, figures, results[0][1], results[0][0])
        attack.calm_down()
        judge_run(attack, figures, *reversed(run_once(attack)))
        clock.sleep(6.0 * attack.unit)
    return attack.problems


def main(seconds: float, seed: int, *, most: int | None = None) -> Figures:
    """Attack machines until `seconds` of real time have passed, or `most` of them; print figures.

    Args:
        seconds: Real time.
        seed: Of the first machine; the next has the next number.
        most: Machines at most; None: no limit.
    """
    figures = Figures(seed)
    logger = logging.getLogger("smachpy")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        attack_all(seconds, most, figures)
    finally:
        logger.setLevel(level)
    print_figures(figures)
    return figures


def attack_all(seconds: float, most: int | None, figures: Figures) -> None:
    seed = figures.seed
    end = time.monotonic() + seconds
    number = 0
    while time.monotonic() < end and (most is None or number < most):
        this = seed + number
        number += 1
        main_thread = threading.current_thread() is threading.main_thread()
        if number % 10 == 0 and main_thread:
            kind, problems = "signal", attack_in_real_time(this, figures, by_signal=True)
        elif number % 10 == 5:
            kind, problems = "real", attack_in_real_time(this, figures, by_signal=False)
        else:
            kind, problems = "virtual", attack_in_virtual_time(this, figures)
        figures.machines[kind] += 1
        figures.problems += [f"seed {this} ({kind}): {problem}" for problem in problems]


def print_figures(figures: Figures) -> None:
    machines = ", ".join(f"{count} {kind}" for kind, count in sorted(figures.machines.items()))
    print(f"random machines, from seed {figures.seed}: {figures.machines.total()} ({machines})")
    for outcome, count in sorted(figures.outcomes.items()):
        print(f"  runs that ended {outcome}: {count}")
    print(f"  requests to stop: {figures.requests}, states abandoned: {figures.abandoned}")
    print(f"  longest time from request to end: {figures.longest_s:.2f} s of virtual time")
    print(f"  broken promises: {len(figures.problems)}")
    for problem in figures.problems[:20]:
        print(f"    {problem}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    sys.exit(1 if main(given.seconds, given.seed).problems else 0)
