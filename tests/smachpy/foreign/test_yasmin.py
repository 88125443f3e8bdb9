"""Machines of YASMIN in XML: what becomes of them, and by what they are refused."""

from __future__ import annotations

import pytest

from smachpy import load
from smachpy.checks import check
from smachpy.files import MissionFileError, write
from smachpy.files.others import not_kept
from smachpy.files.reference import ResolveError
from smachpy.testing import mission_kit
from tests.smachpy.foreign.places import ROUNDS, refused, save

STATES = """
import smachpy
from smachpy.states import Wait


class DriveState(smachpy.State):
    def __init__(self, places):
        super().__init__(["arrived", "blocked"], io_keys=["count"])
        self.places = places

    def execute(self, userdata):
        userdata.count += len(self.places)
        return "arrived"


def TurnState(angle, seconds):
    return Wait(angle + seconds)


@smachpy.state(outcomes=["ok", "strange"])
def LookState(userdata):
    return "ok"
"""


def test_a_machine_with_all_its_parts_runs_with_states_beside_it(tmp_path):
    save(tmp_path, ROUNDS["xml"], "rounds.xml")
    save(tmp_path, STATES, "smachpy_states.py")
    with mission_kit() as mission:
        run = mission(load(tmp_path / "rounds.xml", pause_s=20.0))
    run.assert_outcome("done")
    assert run.duration == pytest.approx(20 + 1.57)
    assert run.userdata["seen"] == 2


def test_all_of_it_is_in_the_mission_file_that_is_written(tmp_path):
    machine = load(save(tmp_path, ROUNDS["xml"], "rounds.xml"))
    assert check(machine).ok
    assert list(not_kept(machine)) == []
    again = write(machine, tmp_path / "rounds.yaml")
    for part in (
        "name: Rounds",
        "pause_s:",
        "state: smachpy_states:DriveState",
        "state: barrier",
        "parties: 2",
        "default_outcome: odd",
        "count: seen",
    ):
        assert part in again
    same = load(tmp_path / "rounds.yaml", to_run=False)
    assert write(same) == again


def test_a_run_without_its_states_lists_all_and_starts_nothing(tmp_path):
    path = save(tmp_path, ROUNDS["xml"], "rounds.xml")
    with pytest.raises(ResolveError) as caught:
        load(path).execute()
    problems = caught.value.problems
    assert len(problems) == 4
    assert problems[0] == (
        f"{path}:6:3: states.Drive.state: got no state 'DriveState'; expected DriveState in "
        f"'{tmp_path}/smachpy_states.py', or an entry point 'smachpy.states' of that name. Try "
        "'smachpy check' and 'smachpy render', which need none."
    )


def test_doubles_need_no_states(tmp_path):
    path = save(
        tmp_path,
        '<StateMachine outcomes="end"><State name="A" class="x::Foo"><Transition from="ok" '
        'to="end"/></State></StateMachine>',
    )
    with mission_kit() as mission:
        machine = load(path)
        mission.replace("A", ["ok"])
        mission(machine).assert_outcome("end")


def test_an_included_machine_has_the_keys_and_parameters_of_the_one_around(tmp_path):
    save(
        tmp_path,
        '<StateMachine outcomes="ok"><Param name="n" default_type="int" default_value="1"/><Key name="k"/>'
        '<State name="B" class="Foo"><ParamRemap old="m" new="n"/><Remap old="x" new="k"/>'
        '<Transition from="ok" to="ok"/></State></StateMachine>',
        "inner.xml",
    )
    machine = load(
        save(
            tmp_path,
            '<StateMachine outcomes="end"><Param name="top" default_type="int" default_value="5"/>'
            '<StateMachine name="A" file_path="inner.xml"><ParamRemap old="n" new="top"/>'
            '<Remap old="k" new="q"/><Transition from="ok" to="end"/></StateMachine></StateMachine>',
        )
    )
    inner = machine["A"]["B"]
    assert inner._smachpy.made_from.arguments == {"m": "${n}"}
    assert machine["A"].get_registered_input_keys() == ("k",)


def test_what_is_lost_is_noted_with_its_line(tmp_path):
    path = save(
        tmp_path,
        '<StateMachine outcomes="end">\n<State name="A" class="Foo">\n<Hook/><ParamRemap old="a" new="b"/>'
        '<Key name="k" default_value="1"/><Transition from="ok" to="end"/>\n</State>\n</StateMachine>',
    )
    report = check(load(path))
    assert report.ok
    assert {problem.rule for problem in report} == {"not-kept"}
    assert str(report).splitlines()[:3] == [
        f"{path}:2: note: not kept: the default of a key of a single state [not-kept]",
        f"{path}:3: note: not kept: <Hook>, which is not known [not-kept]",
        f"{path}:3: note: not kept: the parameter 'a': 'b' has no value [not-kept]",
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<package/>", "1:1: got <package>; expected <StateMachine>, of YASMIN, or <scxml>."),
        ("<StateMachine/>", "1:1: states: got {}; expected a mapping: label -> state."),
        (
            '<StateMachine outcomes="e">\n <State class="A"/>\n</StateMachine>',
            "2:2: <State>: got no name; expected one.",
        ),
        (
            '<StateMachine outcomes="e"><State name="A"/></StateMachine>',
            "1:28: <State>: got no class; expected one.",
        ),
        (
            '<StateMachine outcomes="e"><Param name="p" default_type="int" default_value="x"/></StateMachine>',
            "1:28: <Param>: default_value: got 'x'; expected a value of type 'int'.",
        ),
        (
            '<StateMachine outcomes="e"><State name="A" class="B"><Transition from="x" to="y"/></State></StateMachine>',
            "1:54: states.A.on.x: transition 'x' leads nowhere: got 'y'; expected one of the states ['A'] or outcomes ['e', 'preempted'].",
        ),
        (
            '<StateMachine outcomes="e"><StateMachine name="A" file_path="../b.xml"/></StateMachine>',
            "1:28: states.A.mission: got '../b.xml', which is not in",
        ),
        (
            '<StateMachine outcomes="e"><State name="A" class="B"/><State name="A" class="B"/></StateMachine>',
            "1:55: got 'A' a second time; expected one.",
        ),
    ],
)
def test_a_wrong_file_is_refused_with_line_and_column(tmp_path, text, problem):
    assert refused(save(tmp_path, text)).startswith(problem)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "not XML: no element found."),
        ("<StateMachine", "not XML: unclosed token."),
        (
            '<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><StateMachine name="&e;"/>',
            "got an entity or a DOCTYPE with one; expected XML without.",
        ),
    ],
)
def test_what_is_no_plain_xml_is_refused(tmp_path, text, problem):
    said = refused(save(tmp_path, text))  # the column is that of the version of expat
    assert said.startswith("1:")
    assert problem in said


def test_all_problems_come_at_once(tmp_path):
    text = '<StateMachine outcomes="e"><State name="A"/><State class="B"/></StateMachine>'
    with pytest.raises(MissionFileError) as caught:
        load(save(tmp_path, text))
    assert len(caught.value.problems) == 2
