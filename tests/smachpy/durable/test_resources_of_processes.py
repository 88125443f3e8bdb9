"""Durable missions of several processes share a resource, whichever of them are killed."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from smachpy import StateMachine
from smachpy.command import main
from smachpy.durable.held import Held
from smachpy.durable.mission import new_mission
from smachpy.durable.opening import open_store
from smachpy.durable.processes import this_runner

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.slow

SCRIPT = Path(__file__).with_name("sharing_mission.py")


class Process:
    """A process that runs a mission, or goes on with it."""

    def __init__(self, journal: Path, mission: str, *words: str) -> None:
        command = [sys.executable, str(SCRIPT), str(journal), mission, *(words or ("wait",))]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def says(self, *lines: str) -> None:
        """Wait for its next lines."""
        assert self._process.stdout is not None
        assert [self._process.stdout.readline().strip() for _ in lines] == list(lines)

    def go_on(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()

    def end_by(self, number: signal.Signals) -> None:
        self._process.send_signal(number)
        self._process.wait()

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


class Fleet:
    """The processes of a test, and their journal."""

    def __init__(self, journal: Path) -> None:
        self.journal = journal
        self.all: list[Process] = []

    def start(self, mission: str, *words: str) -> Process:
        self.all.append(Process(self.journal, mission, *words))
        return self.all[-1]

    def uses(self) -> list[tuple[str, str, bool]]:
        """Return mission, "holds" or "waits", and whether a process runs it."""
        store = open_store(self.journal)
        found = [
            (one.mission, "holds" if one.holds else "waits", one.runner is not None)
            for one in store.resources()
        ]
        store.close()
        return found


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[Fleet]:
    made = Fleet(tmp_path / "journal.db")
    yield made
    for process in made.all:
        process.close()


def test_one_waits_for_the_mission_of_another_process(
    fleet: Fleet, capsys: pytest.CaptureFixture[str]
) -> None:
    first = fleet.start("a")
    first.says("holds", "begins")
    second = fleet.start("b")
    second.says("waits /M/USE of mission a")
    assert fleet.uses() == [("a", "holds", True), ("b", "waits", True)]
    third = fleet.start("c", "refuse")
    third.says("refused /M/USE of mission a", "refused")
    assert main(["missions", "show", "b", "--durable", str(fleet.journal)]) == 0
    shown = [line for line in capsys.readouterr().out.splitlines() if "resource" in line]
    assert [line.partition(", in process")[0] for line in shown] == [
        "resource  base: held by /M/USE of mission a",
        "resource  base: waits: /M/USE of mission b",
    ]
    first.go_on()
    first.says("ends", "free", "done")
    second.says("holds", "begins")
    second.go_on()
    second.says("ends", "free", "done")
    assert fleet.uses() == []


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_a_mission_that_was_interrupted_keeps_it_until_it_has_gone_on(
    fleet: Fleet, end: signal.Signals
) -> None:
    first = fleet.start("a")
    first.says("holds", "begins")
    second = fleet.start("b")
    second.says("waits /M/USE of mission a")
    first.end_by(end)
    assert fleet.uses() == [("a", "holds", False), ("b", "waits", True)]
    fleet.start("c", "refuse").says("refused /M/USE of mission a", "refused")
    again = fleet.start("a")
    again.says("holds", "begins")
    again.go_on()
    again.says("ends", "free", "done")
    second.says("holds", "begins")  # not beside another one
    second.go_on()
    second.says("ends", "free", "done")


def test_one_that_is_deleted_keeps_nothing(fleet: Fleet) -> None:
    first = fleet.start("a")
    first.says("holds", "begins")
    first.end_by(signal.SIGKILL)
    (fleet.journal.with_name("mark")).unlink()
    second = fleet.start("b")
    second.says("waits /M/USE of mission a")
    store = open_store(fleet.journal)
    store.forget("a")
    store.close()
    second.says("holds", "begins")


def test_one_that_was_killed_while_it_waited_is_in_nobodys_way(fleet: Fleet) -> None:
    first = fleet.start("a")
    first.says("holds", "begins")
    second = fleet.start("b")
    second.says("waits /M/USE of mission a")
    second.end_by(signal.SIGKILL)
    third = fleet.start("c")
    third.says("waits /M/USE of mission a")
    assert fleet.uses() == [("a", "holds", True), ("c", "waits", True)]
    first.go_on()
    third.says("holds", "begins")
    again = fleet.start("b")
    again.says("waits /M/USE of mission c")
    third.go_on()
    again.says("holds", "begins")


def test_the_holder_is_asked_to_stop(fleet: Fleet) -> None:
    first = fleet.start("a")
    first.says("holds", "begins")
    second = fleet.start("b", "preempt")
    second.says("waits /M/USE of mission a")
    first.says("ends", "free", "preempted")
    second.says("holds", "begins")


def test_it_is_asked_though_it_was_killed_before_it_heard_that(fleet: Fleet) -> None:
    first = fleet.start("a")
    first.says("holds", "begins")
    first.end_by(signal.SIGKILL)
    second = fleet.start("b", "preempt")
    second.says("waits /M/USE of mission a")
    again = fleet.start("a")
    again.says("holds", "begins", "ends", "free", "preempted")
    second.says("holds", "begins")


def test_a_state_that_is_not_executed_again_gives_it_back(fleet: Fleet) -> None:
    words = ("wait", "skip:done")
    first = fleet.start("a", *words)
    first.says("holds", "begins")
    first.end_by(signal.SIGKILL)
    (fleet.journal.with_name("mark")).unlink()
    second = fleet.start("b")
    second.says("waits /M/USE of mission a")
    fleet.start("a", *words).says("done")
    second.says("holds", "begins")


def test_each_robot_of_a_journal_has_resources_of_its_own(fleet: Fleet) -> None:
    store = open_store(fleet.journal)
    held = []
    for mission, robot in (("a", "r1"), ("b", "r2"), ("c", None)):
        machine = StateMachine(["done"], name=mission)
        store.create(new_mission(machine, mission=mission, robot=robot))
        lease = store.claim(mission, this_runner(), seconds=60.0)
        held.append(Held(store, lease, robot))
    first, second, third = held
    assert first.take("base", "/A", "wait", print) is None
    assert second.take("r2/base", "/B", "wait", print) is None
    assert third.take("base", "/C", "wait", print) is None
    by = third.take("r1/base", "/C", "wait", print)
    assert by is not None
    assert by.startswith("/A of mission a")
    for each in held:
        each.give("base")
    assert [one.resource for one in store.resources()] == ["r1/base"]  # of the third
    store.close()
