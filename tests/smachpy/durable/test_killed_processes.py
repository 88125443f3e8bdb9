"""Real processes of a mission are killed, at each write of its journal and at any instant.

`KILLS=1000 pytest -m slow tests/smachpy/durable/test_killed_processes.py` is the long run: `make
soak-durable`.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

HERE = Path(__file__).parent
KILLS = int(os.environ.get("KILLS", "100"))
WRITES = 26  # of a run that is not killed, about
LONGEST_S = 60.0
EXPECTED = {"outcome": "ok", "count": 1, "number": 3, "sum": 3}


@pytest.fixture
def world(tmp_path: Path) -> Iterator[Path]:
    """A folder for journal and deeds; a server that executes goals and notes them there."""
    command = [sys.executable, str(HERE / "goal_server.py"), "goals", "killed_mission"]
    process = subprocess.Popen(
        command, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    yield tmp_path
    process.stdin.close()
    assert process.wait(LONGEST_S) == 0
    process.stdout.close()


def live(world: Path, kill_at: int, *, written: bool, after: float | None = None) -> Any:
    """Let the mission run, or go on; return what it prints at its end, None if it was killed."""
    command = [
        sys.executable,
        str(HERE / "killed_mission.py"),
        "journal.db",
        "deeds",
        str(kill_at),
        str(written),
    ]
    with subprocess.Popen(command, cwd=world, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        timer = threading.Timer(LONGEST_S if after is None else after, process.kill)
        timer.start()
        line = process.stdout.read()
        code = process.wait(LONGEST_S)
        timer.cancel()
        timer.join()
    if code == 0:
        return json.loads(line)
    assert code == -9, f"exit code {code}"
    return None


def check(world: Path, *, exact: bool) -> None:
    """Check what was done: each goal id at most once, each thing once, nothing left out."""
    goals = [line.split() for line in (world / "goals").read_text().splitlines()]
    ids = [goal_id for goal_id, _ in goals]
    assert len(set(ids)) == len(ids)
    assert sorted(int(number) for _, number in goals) == [0, 1, 2, 10, 20]
    deeds = (world / "deeds").read_text().splitlines()
    assert set(deeds) == {"note 0", "L 0", "R 0"}
    if exact:
        assert len(deeds) == len(set(deeds))


def forget(world: Path) -> None:
    for path in world.iterdir():
        path.unlink()
    (world / "goals").touch()


@pytest.mark.zenoh
def test_a_mission_killed_with_its_goal_under_way_follows_it(world: Path) -> None:
    assert live(world, 6, written=True) is None
    assert live(world, 3, written=True) is None
    assert live(world, 0, written=False) == EXPECTED
    check(world, exact=True)


@pytest.mark.slow
@pytest.mark.zenoh
@pytest.mark.timeout(60 + 10 * KILLS)
def test_missions_killed_again_and_again_end_as_one_that_is_not(world: Path) -> None:
    chance = random.Random(KILLS)
    kills = 0
    points = [(n, w) for n in range(1, WRITES + 1) for w in (False, True)]
    while kills < KILLS:
        ended, exact = None, True
        while ended is None:
            if points:  # every write once, then at any instant
                (kill_at, written), after = points.pop(), None
            else:
                kill_at, written, after = 0, False, chance.uniform(0.0, 0.8)
            ended = live(world, kill_at, written=written, after=after)
            if ended is None:
                kills += 1
                exact = exact and written and after is None
        assert ended == EXPECTED
        check(world, exact=exact)
        forget(world)
    print(f"{kills} kills")
