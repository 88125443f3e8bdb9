"""A nested machine is entered without a call when nobody would notice; nothing else may differ."""

import pytest

import smachpy
from smachpy import State, StateMachine
from smachpy.events import Entered, Left


class Leaf(State):
    def __init__(self, work=None):
        super().__init__(outcomes=["done"])
        self.work = work

    def execute(self, ud):
        if self.work is not None:
            self.work()
        return "done"


def nest(leaf, depth=3, kind=StateMachine):
    """Return the machines, the root first."""
    machines, state = [], leaf
    for _ in range(depth):
        machine = kind(outcomes=["done", "preempted"])
        machine.add("IN", state)
        machines.insert(0, machine)
        state = machine
    return machines


def assert_idle(machines):
    for machine in machines:
        assert not machine.is_running()
        assert not machine.preempt_requested()
        assert machine.get_active_states() == ["None"]


def test_each_machine_runs_while_its_leaf_does():
    seen = []
    machines = nest(Leaf(lambda: seen.append([m.get_active_states() for m in machines])))
    assert [machines[0].execute() for _ in range(3)] == ["done"] * 3
    assert seen == [[["IN"]] * 3] * 3
    assert_idle(machines)


def test_a_leaf_knows_its_path_and_so_does_its_error():
    def fail():
        paths.append(smachpy.base.context.current_path())
        raise OSError("no map")

    paths = []
    machines = nest(Leaf(fail))
    for _ in range(2):
        with pytest.raises(smachpy.InvalidUserCodeError) as caught:
            machines[0].execute()
        assert caught.value.path == paths[-1] == "/SM_ROOT/IN/IN/IN"
        assert isinstance(caught.value.__cause__, OSError)
        assert_idle(machines)


@pytest.mark.parametrize("ends", [KeyboardInterrupt, SystemExit])
def test_what_ends_a_program_goes_through_all_of_them(ends):
    def end():
        raise ends

    machines = nest(Leaf(end))
    with pytest.raises(ends):
        machines[0].execute()
    assert_idle(machines)


def test_an_outcome_that_the_machine_above_does_not_know_is_an_error_there():
    inner = StateMachine(outcomes=["done"])
    inner.add("LEAF", Leaf())
    outer = StateMachine(outcomes=["done"])
    outer.add("INNER", inner)
    outer.execute()
    inner.register_outcomes(["more"])
    with pytest.raises(smachpy.InconsistentMachineError):
        outer.execute()
    assert_idle([outer, inner])


@pytest.mark.parametrize("asked", [0, 1, 2])
def test_a_request_to_any_of_them_reaches_the_leaf_and_ends_with_the_run(asked):
    class Waits(State):
        def __init__(self):
            super().__init__(outcomes=["done", "preempted"])

        def execute(self, ud):
            machines[asked].request_preempt()
            assert self.preempt_requested()
            return "preempted"

    machines = nest(Waits())
    assert machines[0].execute() == "preempted"
    assert_idle(machines)


def test_a_request_while_nothing_runs_ends_the_next_visit_of_that_machine_alone():
    calls = []
    machines = nest(Leaf(lambda: calls.append(1)))
    machines[0].execute()
    machines[2].request_preempt()
    assert machines[0].execute() == "preempted"
    assert len(calls) == 1
    assert_idle(machines)
    assert machines[0].execute() == "done"


@pytest.mark.parametrize("register", ["start", "transition", "termination"])
def test_a_callback_that_is_registered_after_a_run_is_called(register):
    heard = []
    machines = nest(Leaf())
    inner = machines[2]
    inner.add("FIRST", Leaf())
    inner.set_initial_state(["FIRST"])
    machines[0].execute()
    second = StateMachine(outcomes=["done"])
    second.add("A", Leaf(), {"done": "B"})
    second.add("B", Leaf())
    root = StateMachine(outcomes=["done"])
    root.add("SECOND", second)
    root.execute()
    getattr(second, f"register_{register}_cb")(lambda *_args: heard.append(register))
    root.execute()
    assert heard == [register]


def test_a_listener_of_a_nested_machine_hears_of_it_from_its_next_visit_on():
    heard = []
    machines = nest(Leaf())
    machines[0].execute()
    unsubscribe = machines[1].subscribe(heard.append)
    machines[0].execute()
    paths = {type(e): [x.path for x in heard if type(x) is type(e)] for e in heard}
    assert paths == {
        Entered: ["/SM_ROOT/IN/IN", "/SM_ROOT/IN/IN/IN"],
        Left: ["/SM_ROOT/IN/IN/IN", "/SM_ROOT/IN/IN"],
    }
    unsubscribe()
    heard.clear()
    machines[0].execute()
    assert heard == []


def test_a_listener_that_comes_in_the_middle_hears_the_rest():
    heard = []
    inner = StateMachine(outcomes=["done"])
    inner.add("A", Leaf(lambda: root.subscribe(heard.append)), {"done": "B"})
    inner.add("B", Leaf())
    root = StateMachine(outcomes=["done"])
    root.add("INNER", inner, {"done": "AFTER"})
    root.add("AFTER", Leaf())
    root.execute()
    entered = [e.path for e in heard if isinstance(e, Entered)]
    assert entered == ["/SM_ROOT/INNER/B", "/SM_ROOT/AFTER"]


def test_the_initial_state_of_the_next_run_holds_for_that_one_alone():
    calls = []
    inner = StateMachine(outcomes=["done"])
    inner.add("A", Leaf(lambda: calls.append("A")), {"done": "B"})
    inner.add("B", Leaf(lambda: calls.append("B")))
    root = StateMachine(outcomes=["done"])
    root.add("INNER", inner)
    for label in (None, "B", None, None):
        if label is not None:
            inner.set_initial_state([label])
        root.execute()
    assert "".join(calls) == "AB" + "B" + "AB" + "AB"


def test_userdata_that_was_put_in_the_place_of_the_old_is_used():
    class Reads(State):
        def __init__(self):
            super().__init__(outcomes=["done"], input_keys=["x"])

        def execute(self, ud):
            seen.append(ud.x)
            return "done"

    seen = []
    machines = nest(Reads())
    for x in (1, 2):
        machines[2].userdata = smachpy.UserData()
        machines[2].userdata.x = x
        machines[0].execute()
    assert seen == [1, 2]


def test_an_execute_of_a_user_is_called_at_each_level():
    class Own(StateMachine):
        def execute(self, parent_ud=None):
            calls.append(self)
            return super().execute(parent_ud)

    calls = []
    machines = nest(Leaf(), kind=Own)
    machines[0].execute()
    assert calls == machines


def test_an_execute_that_is_set_on_the_instance_is_called():
    calls = []
    machines = nest(Leaf())
    execute = machines[1].execute
    machines[1].execute = lambda ud: calls.append(1) or execute(ud)
    machines[0].execute()
    assert calls == [1]


def test_options_of_a_nested_machine_hold():
    attempts = []

    def fail_once():
        attempts.append(1)
        if len(attempts) < 3:
            raise OSError("not yet")

    inner = StateMachine(outcomes=["done"], retry=smachpy.Retry(3, 0.0, OSError))
    inner.add("LEAF", Leaf(fail_once))
    root = StateMachine(outcomes=["done"])
    root.add("INNER", inner)
    assert root.execute() == "done"
    assert len(attempts) == 3


def test_a_child_that_is_added_between_two_runs_is_run():
    calls = []
    inner = StateMachine(outcomes=["done"])
    inner.add("A", Leaf(), {"done": "B"})
    inner.add("B", Leaf())
    root = StateMachine(outcomes=["done"])
    root.add("INNER", inner)
    root.execute()
    inner.add("C", Leaf(lambda: calls.append("C")))
    inner.set_initial_state(["C"])
    root.execute()
    assert calls == ["C"]


def test_the_same_machine_inside_itself_is_refused():
    def again():
        machines[1].execute()

    machines = nest(Leaf(again))
    with pytest.raises(smachpy.InvalidStateError):
        machines[0].execute()
    assert_idle(machines)
