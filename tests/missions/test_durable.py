"""Every shipped mission can be kept in a journal: `smachpy run NAME --durable`."""

from __future__ import annotations

import pytest

from smachpy.durable.mission import kept_mission, new_mission
from smachpy.durable.opening import open_store
from smachpy.machines.mission_info import mission_info
from tests.missions.test_twice import (
    OTHERS,
    OUTCOMES,
    listed,
    make,
    robot,  # noqa: F401  a fixture
    surroundings,
)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(listed()))
def test_a_shipped_mission_runs_with_a_journal(mission, name, tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)  # maps, photos
    function, machine = make(name)
    if name == "rp_action":
        request.getfixturevalue("robot")
    else:
        surroundings(mission, name, machine, mission_info(function).serves)
    other = OTHERS[name]() if name in OTHERS else None
    if name.endswith(".server"):
        mission.preempt(at=5.0)
    store = open_store(tmp_path / "journal.db")
    store.create(new_mission(machine, mission="it"))
    try:
        with kept_mission(machine, store, "it"):
            run = mission(machine)
    finally:
        row = store.mission("it")
        store.close()
        if other is not None:
            other.close()
    assert run.outcome == OUTCOMES.get(name, "succeeded")
    assert (row.status, row.outcome) == ("ended", run.outcome)
