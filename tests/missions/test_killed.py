"""Every shipped mission, killed at each write of its journal in virtual time, goes on."""

from __future__ import annotations

import importlib
import os

import pytest

from smachpy.testing import explore
from tests.missions.test_twice import ARGUMENTS, listed

# Missions whose runs are too many for all of them: so many are tried, `make soak-durable` tries more.
LARGE = ("delivery", "fleet", "guided_recovery", "inspect", "patrol", "rp_action", "waypoints")
RUNS = int(os.environ.get("RUNS", "40"))
# Not among these: servers, which never end; goals that plain code sends, which are sent again
# (shuttle); robots whose parcels depend on who asks first (fleet); times in the userdata
# (demo_service); states that give their doubles too little (explore, there_and_back); a state that
# begins at the instant of a preempt, and may run first after a kill (patrol).
FOLLOWED = (
    *("countdown", "delivery", "demo_action", "demo_action.client", "door", "inspect", "look_at"),
    *(
        "patrol",
        "rp_action",
        "rp_action.gotopose",
        "rp_action.stopmove",
        "rp_action.turn",
        "waypoints",
    ),
)

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]  # twice `max_time`


def maker(name):
    module, _, function = listed()[name].partition(":")
    make = getattr(importlib.import_module(module), function)
    return lambda: make(**ARGUMENTS.get(name, {}))


@pytest.mark.parametrize("name", sorted(listed()))
def test_a_mission_killed_anywhere_goes_on_as_one_that_is_not(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # maps, photos
    runs = RUNS if name in LARGE else 1000
    found = explore(maker(name), faults=["kill"], max_runs=runs, max_time=300)
    found.assert_ok()
    assert found.exhaustive or name in LARGE


@pytest.mark.parametrize("name", FOLLOWED)
def test_its_goals_are_followed_whatever_servers_do_to_them(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = explore(maker(name), faults=["kill"], real_actions=True, max_runs=RUNS, max_time=300)
    found.assert_ok()
