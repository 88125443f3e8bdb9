"""Machines in SCXML: what becomes of them, and by what they are refused."""

from __future__ import annotations

import pytest

from smachpy import load
from smachpy.checks import check
from smachpy.files import write
from smachpy.files.others import not_kept
from smachpy.testing import mission_kit
from tests.smachpy.foreign.places import ROUNDS, refused, save

STATES = """
import smachpy

moves = iter(["lost", "seen"])


@smachpy.state(outcomes=["arrived", "estop"], io_keys=["rounds"])
def drive(userdata):
    userdata.rounds += 1 if userdata.rounds < 4 else 3
    return "arrived"


@smachpy.state(outcomes=["seen", "lost", "estop"])
def look(userdata):
    return next(moves)


@smachpy.state(outcomes=["up", "alarm"])
def lift(userdata):
    return "up"


@smachpy.state(outcomes=["turned", "alarm"])
def turn(userdata):
    return "turned"
"""


LEAVES = {"work/look": "lost", "arm/lift": "up", "base/turn": "turned"}


def lost(machine):
    """What could not be kept, without file and line."""
    return [text.partition("not kept: ")[2] for text in not_kept(machine)]


def test_a_machine_with_all_its_parts_runs_with_states_beside_it(tmp_path):
    save(tmp_path, STATES, "smachpy_states.py")
    with mission_kit() as mission:
        run = mission(load(save(tmp_path, ROUNDS["scxml"], "rounds.scxml")))
    run.assert_outcome("home")
    assert run.duration == 2.5
    assert run.userdata["rounds"] == 7


def test_an_event_of_a_state_around_leaves_it(tmp_path):
    with mission_kit() as mission:
        for leaf, outcome in LEAVES.items():
            mission.replace(leaf, [outcome])
        mission.replace("work/drive", ["estop"])
        mission(load(save(tmp_path, ROUNDS["scxml"], "r.scxml"))).assert_outcome("stopped")


def test_an_event_of_a_region_ends_the_regions(tmp_path):
    with mission_kit() as mission:
        for leaf, outcome in LEAVES.items():
            mission.replace(leaf, [outcome])
        mission.replace("work/drive", ["arrived"])
        mission.replace("arm/lift", ["alarm"])
        run = mission(
            load(save(tmp_path, ROUNDS["scxml"].replace('expr="2"', 'expr="1"'), "r.scxml"))
        )
    run.assert_outcome("stopped")


def test_it_is_the_same_from_the_mission_file_that_is_written(tmp_path):
    machine = load(save(tmp_path, ROUNDS["scxml"], "rounds.scxml"))
    assert check(machine).ok
    again = write(machine, tmp_path / "rounds.yaml")
    assert write(load(tmp_path / "rounds.yaml", to_run=False)) == again


def test_what_is_lost_is_noted(tmp_path):
    path = save(
        tmp_path,
        """<scxml initial="deep"><script>x()</script><datamodel><data id="d" expr="new Date()"/></datamodel>
        <state id="a"><history id="h" type="deep"/><onentry><log expr="1"/></onentry>
        <state id="deep"><transition event="go *" target="b"/><transition target="a b"/></state></state>
        <state id="b"><transition event="on" cond="d == 1" target="h"/></state>
        <final id="end"/></scxml>""",
        "m.scxml",
    )
    machine = load(path)
    assert machine["a"]._smachpy.reenter == "deep"
    assert lost(machine) == [
        "the entry at 'deep': 'a' begins where it says",
        "<script>",
        "the value of <data> 'd', which is no literal: new Date()",
        "<history>: the state goes on where a request to stop has interrupted it",
        "<log>",
        "the event '*'",
        "<transition> with 2 targets",
        "'on' if no condition holds: the state begins anew",
    ]


def test_operators_are_spelt_as_in_python_outside_of_texts(tmp_path):
    text = (
        '<scxml><datamodel><data id="a" expr="\'!true\'"/></datamodel><state id="s">'
        '<transition event="go" cond="!(a === \'!true\') || a !== null" target="e"/>'
        '<transition event="go" target="f"/></state><final id="e"/><final id="f"/></scxml>'
    )
    written = write(load(save(tmp_path, text, "m.scxml")))
    assert "when: not (a == '!true') or a != None" in written


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<scxml/>", "1:1: states: got {}; expected a mapping: label -> state."),
        ("<scxml><state/></scxml>", "1:8: <state>: got no id; expected one."),
        (
            '<scxml><state id="a"><transition event="x" target="b"/></state></scxml>',
            "1:22: <transition>: got target 'b'; expected an id.",
        ),
        (
            '<scxml><state id="a"/><state id="a"/></scxml>',
            "1:23: got id 'a' a second time; expected one.",
        ),
        (
            '<scxml initial="x"><state id="a"><transition target="e"/></state><final id="e"/></scxml>',
            "1:1: initial: got 'x'; expected one of ['a'].",
        ),
        (
            '<scxml><state id="a"><transition cond="In(1)" target="e"/></state><final id="e"/></scxml>',
            "1:22: states.a.on.done[0].when: condition: this call is not allowed",
        ),
        (
            '<scxml><state id="a"><invoke src="wait"><param name="seconds" expr="f()"/></invoke></state></scxml>',
            "1:41: <param>: expr: got 'f()'; expected a literal.",
        ),
        (
            '<scxml><state id="o"><transition event="e" target="f"/><state id="a"><transition event="e" target="e"/></state><state id="b"/><final id="e"/></state><final id="f"/></scxml>',
            "1:112: got 'e' for an event and for an end; expected two names.",
        ),
    ],
)
def test_a_wrong_file_is_refused_with_line_and_column(tmp_path, text, problem):
    assert refused(save(tmp_path, text, "m.scxml")).startswith(problem)
