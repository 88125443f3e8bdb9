"""Names of keys, labels and methods that look right and are not: told, or taken by their text."""

from __future__ import annotations

from typing import Any

import pytest

from smachpy import CBState, Concurrence, InvalidStateError, Iterator, State, StateMachine
from smachpy.base.slips import SlipWarning, set_accepting


class Grip(State):
    def __init__(self) -> None:
        super().__init__(["done"], input_keys=["force"], output_keys=["held"])

    def execute(self, userdata: Any) -> str:
        userdata.held = userdata.force
        return "done"


def machine_with(**wrong: Any) -> StateMachine:
    machine = StateMachine(["done"], name="M")
    machine.userdata.max_force = 3
    machine.userdata.force = 100
    with machine:
        StateMachine.add("GRIP", Grip(), **wrong)
    return machine


@pytest.mark.parametrize("key", ["forse", "heldd", "nothing"])
def test_a_remapped_key_that_the_state_does_not_have_is_refused(key: str) -> None:
    with pytest.raises(InvalidStateError, match=rf"/M/GRIP: remapping: .*got '{key}'"):
        machine_with(remapping={key: "max_force"})


def test_a_constant_that_the_state_does_not_read_is_refused() -> None:
    with pytest.raises(
        InvalidStateError, match=r"GRIP: constants: .*'forse'.*Did you mean 'force'"
    ):
        machine_with(constants={"forse": 3})


def test_a_key_that_is_remapped_and_constant_is_refused() -> None:
    """The constant won, without a word."""
    with pytest.raises(InvalidStateError, match=r"GRIP: remapping, constants: got \['force'\] in"):
        machine_with(remapping={"force": "max_force"}, constants={"force": 3})


def test_all_kinds_of_containers_refuse_a_remapped_key_that_is_unknown() -> None:
    concurrence = Concurrence(["done"], "done", name="C")
    concurrence.add("GRIP", Grip(), remapping={"forse": "x"})
    with pytest.raises(InvalidStateError, match=r"/C/GRIP: remapping: .*'forse'"):
        concurrence.check_consistency()
    iterator = Iterator(["done"], [], [], [1], name="I")
    iterator.set_contained_state("GRIP", Grip(), remapping={"forse": "x"})
    with pytest.raises(InvalidStateError, match=r"/I/GRIP: remapping: .*'forse'"):
        iterator.execute()


def test_keys_that_are_registered_after_add_count() -> None:
    machine = StateMachine(["done"], name="M")
    late = CBState(lambda userdata: "done", outcomes=["done"])
    machine.add("LATE", late, remapping={"x": "y"})
    late.register_input_keys(["x"])
    machine.check_consistency()


@pytest.mark.filterwarnings("ignore::smachpy.base.slips.SlipWarning")
def test_programs_for_ros_1_are_only_warned_of_unknown_keys() -> None:
    set_accepting(True)
    try:
        with pytest.warns(SlipWarning) as warned:
            machine = machine_with(remapping={"forse": "max_force"}, constants={"extra": 1})
        assert machine.execute() == "done"
        texts = " ".join(str(one.message) for one in warned)
        assert "'forse'" in texts
        assert "'extra'" in texts
    finally:
        set_accepting(False)


@pytest.mark.parametrize("key", ["keys", "update", "extract", "merge", "_data"])
def test_a_key_that_is_a_method_of_userdata_is_refused(key: str) -> None:
    machine = StateMachine(["done"], name="M")
    with pytest.raises(InvalidStateError, match=f"got '{key}'"):
        setattr(machine.userdata, key, 3)
    machine.add("WORK", CBState(lambda userdata: "done", outcomes=["done"], io_keys=[key]))
    with pytest.raises(InvalidStateError, match=f"/M/WORK: userdata key: got '{key}'"):
        machine.check_consistency()
