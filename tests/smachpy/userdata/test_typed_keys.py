"""`execute(self, userdata: Keys)`: the type and the declared keys must fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypedDict

import pytest

import smachpy


class Keys(Protocol):
    battery: float
    place: str


class More(Keys, Protocol):
    @property
    def map(self) -> str: ...


@dataclass
class Mission:
    battery: float = 1.0
    place: str = ""
    rest: int = 0


class WithConstants(Keys, Protocol):
    LOW: ClassVar[float] = 0.3


WithConstants.__annotations__["HIGH"] = ClassVar[float]  # as without the import above


class Methods(Protocol):
    def __getitem__(self, key: str) -> Any: ...


class Words(TypedDict):
    battery: float


class Namespace:
    Keys = Keys


def state(kind, **declared):
    class Typed(smachpy.State):
        def __init__(self):
            super().__init__(["done"], **declared)

        def execute(self, userdata):
            return "done"

    Typed.execute.__annotations__["userdata"] = kind
    return Typed()


def add(one):
    return smachpy.StateMachine(["done"]).add("A", one)


BOTH = {"input_keys": ["battery"], "output_keys": ["place"]}


@pytest.mark.parametrize(
    ("kind", "declared"),
    [
        (Keys, BOTH),
        ("Keys", BOTH),
        ("Namespace.Keys", BOTH),
        (More, {"io_keys": ["battery", "place", "map"]}),
        (WithConstants, BOTH),
        (Methods, BOTH),  # says nothing about keys
        (Mission, BOTH),  # of the whole mission
        (Words, {"input_keys": ["battery"]}),
        (Any, BOTH),
        ("Any", BOTH),
        ("NotThere", BOTH),
        ("smachpy.UserData", BOTH),
        (dict[str, Any], BOTH),
        (str, BOTH),
        (None, BOTH),
    ],
    ids=str,
)
def test_a_type_with_the_declared_keys_is_fine_and_other_annotations_say_nothing(kind, declared):
    assert add(state(kind, **declared))


@pytest.mark.parametrize("kind", [Keys, "Keys", Mission, Words], ids=str)
def test_a_declared_key_that_the_type_lacks_is_an_error(kind):
    with pytest.raises(smachpy.InvalidStateError, match=r"lacks the declared keys \['speed'\]"):
        add(
            state(
                kind,
                io_keys=["battery", "place"][: 1 if kind is Words else 2],
                input_keys=["speed"],
            )
        )


@pytest.mark.parametrize("kind", [Keys, "Keys"])
def test_a_key_of_a_protocol_that_the_state_does_not_declare_is_an_error(kind):
    with pytest.raises(
        smachpy.InvalidStateError, match=r"keys \['place'\].*input_keys=\['place'\]"
    ):
        add(state(kind, input_keys=["battery"]))


def test_a_property_of_a_protocol_is_a_key():
    with pytest.raises(smachpy.InvalidStateError, match=r"keys \['map'\]"):
        add(state(More, **BOTH))


def test_the_function_of_a_state_is_checked_as_execute_is():
    @smachpy.state(outcomes=["done"], input_keys=["battery"])
    def drive(userdata: Keys) -> str:
        return "done"

    with pytest.raises(smachpy.InvalidStateError, match=r"keys \['place'\]"):
        add(drive)


def test_a_function_without_a_signature_is_not_checked():
    assert add(smachpy.CBState(dict.get, outcomes=["done"], cb_args=["a"]))
