"""A path names one state: no label has a slash, and a label that is an enum's member is its text."""

from __future__ import annotations

import enum

import pytest

import smachpy
from smachpy import CBState, Concurrence, Iterator, Sequence, StateMachine


def leaf(*outcomes, **keys):
    return CBState(lambda _: outcomes[0], outcomes=outcomes, **keys)


def each_of(label):
    return {
        "machine": lambda: StateMachine(["done"]).add(label, leaf("done")),
        "sequence": lambda: Sequence(["done"], "done").add(label, leaf("done")),
        "concurrence": lambda: Concurrence(["done"], "done").add(label, leaf("done")),
        "iterator": lambda: Iterator(["done"], [], [], it=[1]).set_contained_state(
            label, leaf("done"), ["done"]
        ),
        "auto": lambda: StateMachine(["done"]).add_auto(label, leaf("done"), ["done"]),
    }


@pytest.mark.parametrize("kind", each_of(""))
@pytest.mark.parametrize("label", ["LIFT/UP", "/", "UP/", "/UP"])
def test_a_label_with_a_slash_is_refused(kind, label):
    """A second state had the path of a child of LIFT: commands and journals mixed them up."""
    with pytest.raises(smachpy.InvalidStateError, match="expected no '/'"):
        each_of(label)[kind]()


class L(str, enum.Enum):  # noqa: UP042  the older way, whose text is "L.LOAD"
    NAME = "M"
    LOAD = "load"
    EACH = "each"
    BOTH = "both"
    OK = "ok"
    DONE = "done"
    KEY = "box"
    OUTER = "boxes"


def load(userdata):
    userdata[L.KEY] = 1
    return L.OK


def machine():
    both = Concurrence([L.DONE], L.DONE, outcome_map={L.DONE: {L.LOAD: L.OK}})
    both.add(L.LOAD, leaf(L.OK))
    each = Iterator([L.DONE], [], [], it=[1], exhausted_outcome=L.DONE)
    each.set_contained_state(L.LOAD, leaf(L.OK), loop_outcomes=[L.OK])
    sm = StateMachine(outcomes=[L.DONE], name=L.NAME)
    sm.add(
        L.LOAD,
        CBState(load, outcomes=[L.OK], output_keys=[L.KEY]),
        {L.OK: L.BOTH},
        remapping={L.KEY: L.OUTER},
    )
    sm.add(L.BOTH, both, {L.DONE: L.EACH})
    sm.add(L.EACH, each, {L.DONE: L.DONE})
    sm.set_initial_state([L.LOAD])
    return sm


def texts(value):
    """Return all strings in an event or record, however deep."""
    if isinstance(value, str):
        return [value]
    if isinstance(value, dict):
        return [text for item in value.items() for text in texts(item)]
    return (
        [text for item in value for text in texts(item)] if isinstance(value, (list, tuple)) else []
    )


def test_the_members_of_an_enum_of_texts_are_these_texts(clock):
    sm, heard = machine(), []
    assert type(sm.execute()) is str  # while nobody watches
    buffer = sm.event_buffer()
    sm.execute()
    records = buffer.read()
    buffer.close()
    sm.subscribe(heard.append)
    sm.control.add_breakpoint("/M/load", "ok")
    sm.control.remove_breakpoint("/M/load", "ok")
    assert sm.execute() == "done"
    assert type(sm.execute()) is str
    found = [text for one in (*heard, *records) for text in texts(one)]
    assert {"/M/load", "/M/both/load", "/M/each/load", "ok", "done"} <= set(found)
    assert not [text for text in found if type(text) is not str or "L." in text]
    assert [type(label) for label in sm.get_children()] == [str] * 3
    assert sm.userdata.boxes == 1
