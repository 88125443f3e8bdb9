from __future__ import annotations

import pytest

import smachpy
from smachpy.events.introspection import StateRecord
from smachpy.events.outcome_classes import is_good, outcome_class


@pytest.mark.parametrize(
    ("outcome", "kind"),
    [
        ("succeeded", "success"),
        ("DONE", "success"),
        ("aborted", "failure"),
        ("timed_out", "failure"),
        ("Timed out", "failure"),
        ("timeout", "failure"),
        ("fail", "failure"),
        ("unreachable", "failure"),
        ("no", "failure"),
        ("preempted", "preempted"),
        ("cancelled", "preempted"),
        ("CANCELED", "preempted"),
        ("low_battery", "other"),
        ("failsafe", "other"),
        ("", "other"),
    ],
)
def test_outcome_names_tell_how_something_ended(outcome, kind):
    assert outcome_class(outcome) == kind
    assert is_good(outcome) == (kind in {"success", "other"})


@pytest.mark.parametrize(
    ("outcome", "kind"),
    [
        ("home", "success"),
        ("aborted", "success"),  # the state says so
        ("succeeded", "failure"),
        ("stopped", "failure"),
        ("preempted", "preempted"),
    ],
)
def test_what_a_state_says_of_its_outcomes_comes_before_their_names(outcome, kind):
    assert outcome_class(outcome, ["home", "aborted"]) == kind
    assert is_good(outcome, ["home", "aborted"]) == (kind == "success")


def machine(**options):
    made = smachpy.StateMachine(["home", "lost"], **options)
    with made:
        made.add(
            "GO", smachpy.CBState(lambda _: "home", outcomes=["home", "lost"], success=["home"])
        )
    return made


def test_the_good_outcomes_are_in_the_record_and_survive_its_text():
    record = smachpy.describe(machine(success=["lost"]))
    assert (record.success, record.children[0].success) == (("lost",), ("home",))
    assert (record.class_of("home"), record.class_of("lost")) == ("failure", "success")
    assert StateRecord.from_json(record.to_json()) == record


def test_without_them_the_names_decide():
    record = smachpy.describe(machine())
    assert record.success is None
    assert record.class_of("lost") == "failure"


def test_no_outcome_may_be_good():
    record = smachpy.describe(machine(success=[]))
    assert record.class_of("home") == "failure"


def test_a_good_outcome_that_the_machine_does_not_have_is_an_error():
    with pytest.raises(smachpy.InconsistentMachineError, match=r"success: outcome.*'hom'.*'home'"):
        machine(success=["hom"])


def test_a_good_outcome_that_a_state_does_not_have_is_an_error():
    made = smachpy.StateMachine(["done"])
    bad = smachpy.CBState(lambda _: "done", outcomes=["done"], success=["dne"])
    with pytest.raises(smachpy.InvalidStateError, match=r"success: outcome.*'dne'.*'done'"):
        made.add("GO", bad)


def test_good_outcomes_are_a_list_of_names():
    with pytest.raises(smachpy.InvalidStateError, match="success"):
        smachpy.StateMachine(["home"], success="home")
