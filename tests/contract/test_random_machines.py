"""Random machines under random requests: each ends, in balance, with nothing left set."""

from __future__ import annotations

import logging
import random
from collections import Counter
from typing import Any

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, use_clock
from smachpy import Concurrence, InvalidUserCodeError, Iterator, State, StateMachine, when
from smachpy.engine.described import walk
from smachpy.states import Barrier
from tests.smachpy.durable.killing_store import Kill, KillingStore

ENDS = ["done", "aborted", "preempted"]
REENTER = ["first", "last", "deep"]


class Step(State):
    """Works for some seconds, and answers a request to stop as drawn."""

    def __init__(self, draw: random.Random, **options: Any) -> None:
        super().__init__(ENDS, **options)
        self.seconds = draw.choice([0, 0, 1, 2, 3])
        self.answer = draw.choice(
            ["stops", "stops", "serves", "finishes", "deaf", "fails", "raises"]
        )

    def execute(self, userdata: Any) -> str:
        if self.answer == "deaf":
            self.clock().sleep(self.seconds)
            return "done"
        if self.sleep(self.seconds):
            if self.answer == "serves":
                self.service_preempt()
            return "done" if self.answer in {"serves", "finishes"} else "preempted"
        if self.answer == "raises" and self.seconds == 3:
            raise OSError("no such door")
        return "aborted" if self.answer == "fails" else "done"


class Draws:
    """Builds a machine from random choices.

    Args:
        seed: The seed.
        timed: With timeouts, and rules by which a branch stops the others: what is done depends
            on when it is done, and so on kills.
    """

    def __init__(self, seed: int, *, timed: bool) -> None:
        self.draw = random.Random(seed)
        self.timed = timed

    def root(self) -> StateMachine:
        draw = self.draw
        root = StateMachine(ENDS, name="R", reenter=draw.choice(REENTER))
        root.add("FIRST", self.state(3), {"done": "SECOND", "aborted": "SECOND"})
        root.add("SECOND", Step(draw))
        root.add_cleanup("TIDY", Step(draw))
        return root

    def options(self) -> dict[str, Any]:
        draw, found = self.draw, dict[str, Any]()
        if self.timed and draw.random() < 0.25:
            found["timeout"] = draw.choice([0.5, 1, 2, 3])
        if draw.random() < 0.15:
            found["retry"] = (2, draw.choice([0, 1]))
        if draw.random() < 0.3:
            found["on_exception"] = {Exception: "aborted"}
        if draw.random() < 0.2:
            found["preempt_timeout"] = draw.choice([0.5, 1])
        return found

    def state(self, depth: int, *, in_branch: bool = False) -> State:
        draw = self.draw
        kinds = ["leaf", "leaf", "machine", "machine", "concurrence", "iterator"]
        kind = draw.choice(kinds) if depth else "leaf"
        made: Any
        if kind == "leaf":
            if in_branch and draw.random() < 0.4:
                return Barrier("MET", **self.options())
            return Step(draw, **self.options())
        if kind == "machine":
            made = self.machine(depth, in_branch=in_branch)
        elif kind == "concurrence":
            rule = (lambda _: True) if self.timed and draw.random() < 0.3 else None
            made = Concurrence(ENDS, "done", child_termination_cb=rule, **self.options())
            for number in range(draw.randint(2, 3)):
                made.add(f"C{number}", self.state(depth - 1, in_branch=True))
        else:
            made = Iterator(ENDS, [], [], range(2), "item", "done", **self.options())
            made.set_contained_state("EACH", self.state(depth - 1, in_branch=in_branch), ["done"])
        if draw.random() < 0.5:
            made.add_cleanup("TIDY", Step(draw))
        return made

    def machine(self, depth: int, *, in_branch: bool) -> StateMachine:
        draw = self.draw
        made = StateMachine(
            ENDS,
            userdata={"number": draw.choice([0, 1])},
            reenter=draw.choice(REENTER),
            **self.options(),
        )
        last = draw.randint(0, 2)
        for number in range(last + 1):
            following = "done" if number == last else f"S{number + 1}"
            cases = [when("number > 0", draw.choice([following, "aborted"])), following]
            transitions: dict[str, Any] = {"done": cases if draw.random() < 0.4 else following}
            if number < last and draw.random() < 0.2:
                transitions["preempted"] = following
            made.add(f"S{number}", self.state(depth - 1, in_branch=in_branch), transitions)
        return made


@pytest.fixture(autouse=True)
def quiet(caplog):
    caplog.set_level(logging.CRITICAL, logger="smachpy")


def balance(events: list[tuple[str, str]]) -> None:
    """Check that no state was entered twice at a time, and that each that was entered has ended."""
    runs: Counter[str] = Counter()
    for kind, path in events:
        if kind == "Entered":
            runs[path] += 1
        elif kind in {"Left", "Failed"}:
            runs[path] -= 1
        assert 0 <= runs[path] <= 1, (kind, path)
    assert not any(runs.values())


@pytest.mark.parametrize("block", range(4))
def test_each_ends_once_with_its_clean_up_and_nothing_stays_set(block):
    for seed in range(40 * block, 40 * block + 40):
        draws = Draws(seed, timed=True)
        root = draws.root()
        events: list[tuple[str, str]] = []
        root.subscribe(lambda event, to=events: to.append((type(event).__name__, event.path)))
        for run in range(2):  # the second goes on where the first was interrupted
            events.clear()
            with VirtualClock(seed=2 * seed + run) as clock, use_clock(clock):
                for _ in range(draws.draw.randint(0, 3)):
                    # Some at the same instant, and at that of timeouts and ends.
                    clock.call_later(draws.draw.choice([0.5, 1, 1, 2, 3]), root.request_preempt)
                try:
                    root.execute()
                except InvalidUserCodeError as error:
                    assert "no such door" in str(error)  # noqa: PT017  it may end without
            balance(events)
            begun = ("Entered", "/R/FIRST") in events or ("Entered", "/R/SECOND") in events
            assert events.count(("Entered", "/R/TIDY")) == begun
            assert not [path for path, state in walk(root, "/R") if state._preempt_requested], seed


def live(root: StateMachine, store: KillingStore) -> str | None:
    """Run, or go on, in a process of its own; None: it was killed."""
    try:
        with VirtualClock() as clock, use_clock(clock):
            return smachpy.run_durable(root, store, mission="m")
    except InvalidUserCodeError:
        return "raised"
    except Kill:
        return None


@pytest.mark.parametrize("seed", range(24))
def test_each_ends_the_same_wherever_it_is_killed(seed):
    store = KillingStore()
    outcome = live(Draws(seed, timed=False).root(), store)
    for kill_at in range(1, min(store.writes, 20)):
        hit = KillingStore()
        hit.arm(kill_at, written=bool(seed % 2))
        assert live(Draws(seed, timed=False).root(), hit) is None
        hit.arm(0, written=False)
        assert live(Draws(seed, timed=False).root(), hit) == outcome, kill_at
