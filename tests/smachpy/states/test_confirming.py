"""Transitions that a person confirms, unless the autonomy allows them."""

from __future__ import annotations

import pytest

import smachpy
from actionlib_core.interfaces.std_msgs.msg import String
from smachpy import InvalidStateError, StateMachine, when
from smachpy.command import main
from smachpy.events import Noted, QuestionAsked
from smachpy.files import MissionFileError, load
from smachpy.states import Wait, confirm, confirming, set_autonomy
from smachpy.testing import explore

FILE = """\
name: M
outcomes: [done, preempted]
states:
  PICK:
    state: wait
    with: {seconds: 2}
    on: {done: {to: CARRY, confirm: 2}}
  CARRY: {state: wait, with: {seconds: 3}}
"""


@pytest.fixture(autouse=True)
def no_autonomy(monkeypatch):
    monkeypatch.setattr(confirming, "_autonomy", 0)


def machine(**options):
    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("PICK", Wait(2.0), {"done": confirm("CARRY", level=2, **options)})
        sm.add("CARRY", Wait(3.0))
    return sm


@pytest.fixture(params=["Python", "file"])
def made(request, tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(FILE)
    return machine() if request.param == "Python" else load(path)


def test_it_is_taken_after_a_yes(mission, made):
    asked = []
    made.subscribe(lambda event: asked.append(event) if isinstance(event, QuestionAsked) else None)
    mission.topic("operator/answer", String).publish_at(7.0, String("yes"))
    run = mission(made)
    assert (run.outcome, run.duration) == ("done", 10.0)
    (question,) = asked
    assert (question.path, question.text) == ("/M/CONFIRM_PICK_done", "Go on to CARRY?")


@pytest.mark.parametrize("answer", ["no", None])
def test_it_is_not_taken_after_a_no_or_without_an_answer(mission, made, answer):
    if answer:
        mission.topic("operator/answer", String).publish_at(7.0, String(answer))
    run = mission(made, limit=1000.0)
    assert (run.outcome, run.duration) == ("preempted", 7.0 if answer else 302.0)
    assert not run.visits("/M/CARRY")


def test_otherwise_says_where_it_leads_then(mission):
    sm = machine(otherwise="done", patience=10.0)
    run = mission(sm)
    assert (run.outcome, run.duration) == ("done", 12.0)
    assert not sm.get_children()["PICK"]._preempt_requested


@pytest.mark.parametrize(("autonomy", "duration"), [(1, 302.0), (2, 5.0), (3, 5.0)])
def test_it_is_not_asked_up_to_the_level_of_the_autonomy(mission, made, autonomy, duration):
    set_autonomy(autonomy)
    run = mission(made, limit=1000.0)
    assert run.duration == duration
    notes = [event.text for event in run.events if isinstance(event, Noted)]
    told = [f"not asked: level 2, autonomy {autonomy}"] if autonomy >= 2 else []
    assert [note for note in notes if note.startswith("not asked")] == told


def test_a_preempt_ends_the_question(mission, made):
    mission.preempt(at=4.0)
    assert mission(made).duration == 4.0


def test_it_is_drawn_checked_and_explored_as_a_choice(made):
    record = {one.path: one for one in smachpy.describe(made).walk()}["/M/CONFIRM_PICK_done"]
    assert {("question", "Go on to CARRY?"), ("level", "2")} <= set(record.details)
    assert smachpy.check(made).ok
    found = explore(machine)
    assert found.ok
    assert found.exhaustive


def test_the_state_that_follows_in_a_sequence_is_the_next_one():
    sequence = smachpy.Sequence(["done", "preempted"], "done", name="S")
    with sequence:
        sequence.add("A", Wait(1.0), {"done": confirm("B")})
        sequence.add("B", Wait(1.0))
        sequence.add("C", Wait(1.0))
    edges = {(e.source, e.outcome): e.target for e in smachpy.describe(sequence).transitions}
    assert edges["A", "done"] == "CONFIRM_A_done"
    assert edges["CONFIRM_A_done", "yes"] == "B"
    assert edges["B", "done"] == "C"


@pytest.mark.parametrize(
    "given",
    [
        {"target": ""},
        {"level": 0},
        {"level": "2"},
        {"level": True},
        {"otherwise": None},
        {"question": 3},
    ],
)
def test_wrong_arguments_are_refused(given):
    with pytest.raises(InvalidStateError, match="confirm"):
        confirm(**{"target": "NEXT", **given})


@pytest.mark.parametrize("cases", [[when("x", "A"), confirm("A")], [confirm("A"), "A"]])
def test_it_stands_alone(cases):
    with pytest.raises(InvalidStateError, match=r"confirm\('A'\)"):
        StateMachine(["done"]).add("A", Wait(1.0), {"done": cases})


@pytest.mark.parametrize("level", [-1, "2", 1.5, None])
def test_wrong_autonomies_are_refused(level):
    with pytest.raises(InvalidStateError, match="level"):
        set_autonomy(level)


@pytest.mark.parametrize(
    "given", ["{to: CARRY}", "{to: CARRY, confirm: 0}", "{confirm: 2}", "{to: NOWHERE, confirm: 2}"]
)
def test_wrong_files_are_refused_with_the_line(tmp_path, given):
    path = tmp_path / "m.yaml"
    path.write_text(FILE.replace("{to: CARRY, confirm: 2}", given))
    with pytest.raises(MissionFileError, match=r"m\.yaml:[47]:"):
        load(path)


@pytest.mark.parametrize(
    ("autonomy", "said"), [([], "302.00"), (["--autonomy", "2"], "M: done after 5.00 s")]
)
def test_the_command_has_the_option(tmp_path, capsys, autonomy, said):
    path = tmp_path / "m.yaml"
    path.write_text(FILE)
    main(["run", str(path), "--time", "virtual", "--plain", *autonomy])
    assert said in "".join(capsys.readouterr())


def test_a_mission_that_is_killed_before_while_or_after_it_asks_goes_the_same_way():
    found = explore(machine, faults=["kill"])
    found.assert_ok()
    assert found.exhaustive
