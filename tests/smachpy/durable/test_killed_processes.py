"""Real processes of missions are killed or suspended, at each write of a journal and at any instant.

`KILLS=1000 pytest -m slow tests/smachpy/durable/test_killed_processes.py` is the long run: `make
soak-durable`.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

HERE = Path(__file__).parent
KILLS = int(os.environ.get("KILLS", "60"))
SEED = int(os.environ.get("SEED", "0")) or KILLS
LIVES = 5  # of a random machine, at most, before one that nothing kills
LONGEST_S = 120.0
# How a life ends: by itself, killed, or suspended; a signal that comes before the run begins kills.
ENDS = {"SIGKILL": {0, -9}, "SIGTERM": {0, 143, -15}, "SIGHUP": {0, 129, -1}}


class Done(NamedTuple):
    """What a mission has done, whatever happened to its processes."""

    ended: dict[str, Any]
    goals: Counter[str]
    notes: Counter[str]


class World:
    """A folder for journal and deeds; a server that executes goals and notes them there."""

    def __init__(self, folder: Path, lives: subprocess.Popen[str]) -> None:
        self.folder = folder
        self._lives = lives
        self.kills = 0
        self.forget()

    def live(self, machine: int, **how: Any) -> bool:
        """Let the mission run, or go on; tell whether it came to its end."""
        assert self._lives.stdin is not None
        assert self._lives.stdout is not None
        how.setdefault("after", LONGEST_S)
        text = json.dumps({"folder": str(self.folder), "machine": machine, **how})
        self._lives.stdin.write(text + "\n")
        self._lives.stdin.flush()
        code = int(self._lives.stdout.readline())
        assert code in ENDS[how.get("by", "SIGKILL")], f"exit code {code} of {machine}, {how}"
        assert code == 0 or how["after"] != LONGEST_S or "kill_at" in how, "it hangs"
        self.kills += code != 0
        return code == 0

    def done(self) -> Done:
        """Return what the mission has done, and forget it; no goal id was executed twice."""
        goals = [line.split() for line in (self.folder / "goals").read_text().splitlines()]
        ids = [goal_id for goal_id, _ in goals]
        assert len(set(ids)) == len(ids)
        notes = (self.folder / "deeds").read_text().splitlines()
        ended = json.loads((self.folder / "ended").read_text())
        self.forget()
        return Done(ended, Counter(number for _, number in goals), Counter(notes))

    def forget(self) -> None:
        for path in self.folder.iterdir():
            path.unlink()
        (self.folder / "goals").touch()
        (self.folder / "deeds").touch()


def check(done: Done, calm: Done, *, exact: bool) -> None:
    """Check that a mission did what the one without kills did: nothing is left out.

    Args:
        done: What it did.
        calm: What the other one did.
        exact: Whether only writes have killed, each once it was done: nothing is done twice then,
            but in a branch of a concurrence, which may be anywhere when another one writes.
    """
    assert {**done.ended, "writes": 0} == {**calm.ended, "writes": 0}
    assert done.goals == calm.goals
    assert set(done.notes) == set(calm.notes)
    if exact:
        twice = [note for note in done.notes if done.notes[note] > calm.notes[note]]
        assert all(note.startswith("branch") for note in twice), twice


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    folder = tmp_path / "world"
    folder.mkdir()
    commands = ["goal_server.py", str(folder / "goals"), "killed_mission"], ["killed_mission.py"]
    server, lives = [
        subprocess.Popen(
            [sys.executable, str(HERE / script), *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for script, *words in commands
    ]
    assert server.stdout is not None
    assert server.stdout.readline() == "ready\n"
    yield World(folder, lives)
    for process in (lives, server):
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.close()
        assert process.wait(LONGEST_S) == 0
        process.stdout.close()


def calm(world: World, machine: int) -> Done:
    """Let a mission run that nothing kills."""
    assert world.live(machine)
    return world.done()


@pytest.mark.slow
@pytest.mark.zenoh
def test_a_mission_killed_with_its_goal_under_way_follows_it(world: World) -> None:
    expected = calm(world, 0)
    assert expected.ended.items() >= {"outcome": "ok", "count": 1, "number": 3, "sum": 3}.items()
    assert not world.live(0, kill_at=6, written=True)
    assert not world.live(0, kill_at=3, written=True)
    assert world.live(0)
    check(world.done(), expected, exact=True)


@pytest.mark.slow
@pytest.mark.zenoh
@pytest.mark.timeout(900 + 10 * KILLS)
def test_missions_killed_again_and_again_end_as_one_that_is_not(world: World) -> None:
    chance = random.Random(SEED)
    expected = calm(world, 0)
    for kill_at in range(1, expected.ended["writes"] + 1):
        for written in (False, True):
            # Branches of a concurrence may share a write: then there is one less.
            assert world.live(0, kill_at=kill_at, written=written) or world.live(0)
            check(world.done(), expected, exact=written)
    machine = 1000 * SEED
    while world.kills < KILLS:
        machine += 1
        begun = time.monotonic()
        expected = calm(world, machine)
        longest = time.monotonic() - begun
        exact = True
        for _ in range(LIVES):
            by = chance.choice(["SIGKILL", "SIGKILL", "SIGTERM", "SIGHUP"])
            how: dict[str, Any] = {"after": chance.uniform(0.0, longest), "by": by}
            if chance.random() < 0.5:
                kill_at = chance.randint(1, expected.ended["writes"])
                how = {"kill_at": kill_at, "written": chance.random() < 0.5}
            exact = exact and how.get("written", False)
            if world.live(machine, **how):
                break
        else:
            assert world.live(machine)
        check(world.done(), expected, exact=exact)
    print(f"{world.kills} kills, {machine - 1000 * SEED} random machines")
