"""Values that do not change: equal, hashed, shown and copied by their attributes."""

from __future__ import annotations

import copy
import pickle

import pytest

import smachpy
from smachpy import Resource, Retry, any_of, when

MADE = {
    "Retry(attempts=3, backoff=0.5, on=('late',))": lambda: Retry(3, 0.5, "late"),
    "Resource(name='base', policy='refuse')": lambda: Resource("base", "refuse"),
    "Rule(need=1, conditions=(('A', ('x',)),))": lambda: any_of({"A": "x"}),
    "When(condition='battery < 0.3', target='DOCK')": lambda: when("battery < 0.3", "DOCK"),
}


@pytest.fixture(params=MADE)
def text(request):
    return request.param


def test_a_value_equals_and_hashes_like_its_twin_and_is_shown_with_its_attributes(text):
    value, twin = MADE[text](), MADE[text]()
    others = [make() for shown, make in MADE.items() if shown != text]
    assert repr(value) == text
    assert value == twin
    assert hash(value) == hash(twin)
    assert all(value != other for other in [*others, text])


def test_a_value_cannot_be_changed(text):
    value = MADE[text]()
    name = text.partition("(")[2].partition("=")[0]
    with pytest.raises(AttributeError, match="does not change"):
        setattr(value, name, 1)
    with pytest.raises(AttributeError, match="does not change"):
        delattr(value, name)
    assert value == MADE[text]()


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
def test_a_copy_equals_the_value(text, copied):
    assert copied(MADE[text]()) == MADE[text]()


def test_a_value_comes_back_from_a_pickle(text):
    assert pickle.loads(pickle.dumps(MADE[text]())) == MADE[text]()


def test_values_of_other_attributes_differ():
    assert Retry(3) != Retry(2)
    assert smachpy.Rule(1, ()) != smachpy.Rule(2, ())
