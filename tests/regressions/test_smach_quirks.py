"""What SMACH does wrong and programs do not depend on: one test for each, fixed here."""

from __future__ import annotations

import pickle
import re
import threading

import pytest

import smachpy as smach
from actionlib_core.clock import current_clock


class Say(smach.State):
    """Ends with what it is told."""

    def __init__(self, *outcomes, **keys):
        super().__init__(list(outcomes), **keys)
        self.answers = list(outcomes)
        self.runs = 0

    def execute(self, userdata):
        self.runs += 1
        return self.answers[0]


class Sleeper(smach.State):
    def __init__(self, seconds=10.0):
        super().__init__(["slept", "preempted"])
        self.seconds = seconds

    def execute(self, userdata):
        return "preempted" if self.sleep(self.seconds) else "slept"


def machine(outcomes=("done",), **options):
    return smach.StateMachine(list(outcomes), **options)


# -- states ------------------------------------------------------------------------------------


def test_keys_may_come_from_any_iterable():
    state = smach.State(("a",), input_keys=("x",), output_keys={"y": 1}, io_keys=iter(["z"]))
    assert state.get_registered_input_keys() == ("x", "z")
    assert state.get_registered_output_keys() == ("y", "z")


def test_outcomes_keep_their_order():
    outcomes = [f"o{i}" for i in range(20)]
    assert smach.State(outcomes).get_registered_outcomes() == tuple(outcomes)


def test_a_string_is_no_list_of_outcomes():
    with pytest.raises(smach.InvalidStateError, match=r"Try \['done'\]"):
        smach.State(outcomes="done")


def test_the_callers_lists_and_dicts_are_never_changed():
    outcomes, keys, transitions, remapping = ["a"], ["k", "n"], {"a": "done"}, {"k": "m"}
    state = smach.State(outcomes, io_keys=keys)
    state.register_outcomes(["b"])
    sm = machine()
    sm.add("A", state, transitions, remapping, constants={"n": 1})
    names = ["done"]
    smach.Iterator(names, [], [], exhausted_outcome="exhausted")
    assert (outcomes, keys, transitions, remapping, names) == (
        ["a"],
        ["k", "n"],
        {"a": "done"},
        {"k": "m"},
        ["done"],
    )


def test_cb_interface_takes_io_keys():
    made = smach.CBInterface(print, outcomes=["a"], io_keys=["x"])
    assert made.get_registered_input_keys() == ("x",)
    assert made.get_registered_output_keys() == ("x",)


def test_base_class_says_which_class_has_no_execute():
    class Lazy(smach.State):
        pass

    with pytest.raises(NotImplementedError, match=r"Lazy\.execute"):
        Lazy().execute(None)


# -- userdata ----------------------------------------------------------------------------------


def test_a_missing_key_says_which():
    ud = smach.UserData()
    ud.battery = 1
    with pytest.raises(KeyError, match=r"got 'batery'.*Did you mean 'battery'"):
        ud["batery"]
    with pytest.raises(smach.UserDataKeyError) as caught:
        _ = ud.batery
    assert caught.value.key == "batery"
    assert caught.value.declared == ("battery",)
    assert not hasattr(ud, "batery")
    assert getattr(ud, "batery", 7) == 7


def test_userdata_can_be_pickled():
    ud = smach.UserData()
    ud.x = [1, 2]
    again = pickle.loads(pickle.dumps(ud))
    assert again.x == [1, 2]


def test_an_undeclared_write_raises_with_path_key_and_declared_keys():
    def write(ud):
        ud.resutl = 1
        return "done"

    sm = machine(name="PATROL")
    sm.add("A", smach.CBState(write, outcomes=["done"], output_keys=["result"]))
    with pytest.raises(smach.UserDataKeyError) as caught:
        sm.execute()
    assert caught.value.path == "/PATROL/A"
    assert caught.value.key == "resutl"
    assert caught.value.declared == ("result",)
    assert "Did you mean 'result'" in str(caught.value)


def test_an_undeclared_read_raises_with_path_key_and_declared_keys():
    sm = machine(name="PATROL")
    sm.userdata.goal = 1
    sm.add("A", smach.CBState(lambda ud: ud.goal, outcomes=["done"], input_keys=["gaol"]))
    with pytest.raises(smach.InvalidUserCodeError, match=r"/PATROL/A.*declared input keys"):
        sm.execute()


def test_keys_under_remapping_are_listed():
    ud = smach.UserData()
    ud.there = 1
    window = smach.Remapper(ud, ["here"], [], {"here": "there"})
    assert "here" in window
    assert window.keys() == ["here"]
    assert smach.Remapper(ud, ["there"], [], []).keys() == ["there"]


def test_execute_without_argument_shares_nothing():
    first, second = machine(), machine()
    for sm in (first, second):
        sm.register_input_keys(["x"])
        sm.register_output_keys(["x"])
        sm.add("A", Say("done"))
    first.userdata.x = 1
    first.execute()
    second.execute()
    assert "x" not in second.userdata


def test_userdata_is_kept_between_runs_and_can_be_reset():
    def count(ud):
        ud.n = (ud.n if "n" in ud else 0) + 1
        return "done"

    sm = machine()
    sm.add("A", smach.CBState(count, outcomes=["done"], io_keys=["n"]))
    sm.execute()
    sm.execute()
    assert sm.userdata.n == 2
    sm.reset_userdata()
    sm.execute()
    assert sm.userdata.n == 1


# -- construction ------------------------------------------------------------------------------


def test_an_exception_inside_with_leaves_nothing_open():
    sm = machine()
    with pytest.raises(ZeroDivisionError), sm:
        1 / 0
    assert not sm.is_opened()
    opened = []

    def build():
        other = machine()
        other.open()
        smach.StateMachine.add("A", Say("done"))
        other.close()
        opened.append(other)

    thread = threading.Thread(target=build)
    thread.start()
    thread.join(60)
    assert opened


def test_machines_are_built_in_many_threads_at_once():
    wrong = []

    def build(number):
        for _ in range(100):
            sm = machine()
            with sm:
                for i in range(5):
                    label = f"T{number}_{i}"
                    smach.StateMachine.add(label, Say("done"))
            if set(sm.get_children()) != {f"T{number}_{i}" for i in range(5)}:
                wrong.append(sm)

    threads = [threading.Thread(target=build, args=(n,)) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_add_without_an_open_machine_says_so():
    with pytest.raises(smach.InvalidConstructionError, match="no StateMachine is open"):
        smach.StateMachine.add("A", Say("done"))


def test_add_auto_keeps_explicit_transitions():
    sm = machine(["done", "a"])
    with sm:
        smach.StateMachine.add_auto("A", Say("a", "b"), ["a", "b"], {"a": "done"})
        smach.StateMachine.add("B", Say("a"))
    assert sm._transitions["A"] == {"a": "done", "b": "B"}


def test_an_inconsistent_machine_raises_all_its_problems_at_once():
    sm = machine(name="PATROL")
    sm.open()
    smach.StateMachine.add("DRIVE", Say("sucess", "lost"), {"sucess": "DOKC"})
    smach.StateMachine.add("DOCK", Say("done"), {"dnoe": "done"})
    with pytest.raises(smach.InvalidTransitionError) as caught:
        sm.close()
    assert len(caught.value.problems) == 3
    assert "Did you mean 'DOCK'" in str(caught.value)
    assert "Did you mean 'done'" in str(caught.value)
    with pytest.raises(smach.InvalidStateError):
        sm.execute()


def test_two_phases_of_building():
    sm = machine()
    with sm.opened(check=False):
        smach.StateMachine.add("A", Say("x"), {"x": "B"})
    with sm:
        smach.StateMachine.add("B", Say("done"))
    assert sm.execute() == "done"


def test_nested_machines_are_checked_when_the_outermost_closes():
    outer, inner = machine(), machine(["end"])
    with outer:
        with inner:
            smach.StateMachine.add("A", Say("x"), {"x": "B"})
        with inner:
            smach.StateMachine.add("B", Say("end"))
        smach.StateMachine.add("INNER", inner, {"end": "done"})
    assert outer.execute() == "done"


@pytest.mark.parametrize("kind", ["machine", "concurrence"])
def test_a_label_is_taken_once(kind):
    container = machine() if kind == "machine" else smach.Concurrence(["done"], "done")
    container.add("A", Say("done"))
    with pytest.raises(smach.InvalidStateError, match="label is taken"):
        container.add("A", Say("done"))


def test_a_class_in_place_of_a_state_is_told():
    with pytest.raises(smach.InvalidStateError, match=r"Sleeper\(\)"):
        machine().add("A", Sleeper)


# -- running -----------------------------------------------------------------------------------


def test_a_chosen_initial_state_is_for_the_next_run_only():
    sm = machine()
    first, second = Say("a"), Say("done")
    sm.add("A", first, {"a": "B"})
    sm.add("B", second)
    sm.set_initial_state(["B"])
    sm.execute()
    assert (first.runs, second.runs) == (0, 1)
    sm.execute()
    assert (first.runs, second.runs) == (1, 2)


def test_a_chosen_initial_state_must_exist():
    sm = machine()
    sm.add("DRIVE", Say("done"))
    with pytest.raises(smach.InvalidStateError, match="Did you mean 'DRIVE'"):
        sm.set_initial_state(["DRVIE"])


def test_the_cause_of_a_failure_is_chained_and_has_its_path():
    def fail(ud):
        raise ValueError("motor 3")

    inner, outer = machine(), machine(name="PATROL")
    inner.add("LEAF", smach.CBState(fail, outcomes=["done"]))
    outer.add("INNER", inner)
    with pytest.raises(smach.InvalidUserCodeError) as caught:
        outer.execute()
    assert caught.value.path == "/PATROL/INNER/LEAF"
    assert isinstance(caught.value.__cause__, ValueError)
    assert "motor 3" in str(caught.value)
    assert not outer.is_running()
    assert not inner.is_running()


@pytest.mark.parametrize("answer", [None, "nope", 3, ["a"]])
def test_an_unknown_outcome_names_path_and_outcomes(answer):
    inner, outer = machine(), machine(name="PATROL")
    inner.add("LEAF", smach.CBState(lambda ud: answer, outcomes=["done"]))
    outer.add("INNER", inner)
    with pytest.raises(smach.InvalidTransitionError, match=r"/PATROL/INNER/LEAF.*unknown outcome"):
        outer.execute()


def test_a_raising_callback_does_not_silence_the_others():
    heard = []

    def fail(*args):
        raise ValueError("callback")

    sm = machine()
    sm.add("A", Say("a"), {"a": "B"})
    sm.add("B", Say("done"))
    for register in (
        sm.register_start_cb,
        sm.register_transition_cb,
        sm.register_termination_cb,
    ):
        register(fail)
        register(lambda ud, *args: heard.append(args), ["x"])
    assert sm.execute() == "done"
    assert heard == [(["A"], "x"), (["B"], "x"), (["B"], "done", "x")]


def test_the_same_machine_cannot_run_twice_at_once(clock):
    sm = machine(["slept", "preempted"])
    sm.add("A", Sleeper(1.0))
    errors = []

    def again():
        try:
            sm.execute()
        except smach.InvalidStateError as error:
            errors.append(error)

    sm.register_start_cb(lambda *a: clock.spawn(again, name="second"))
    assert sm.execute() == "slept"
    assert len(errors) == 1


def test_machines_can_be_copied(clock):
    import copy

    inner = smach.Concurrence(["done"], "done")
    inner.add("A", Say("done"))
    loop_ = smach.Iterator(["done"], [], [], it=[1, 2], exhausted_outcome="done")
    loop_.set_contained_state("EACH", Say("next"))
    sm = machine()
    sm.userdata.x = [1]
    sm.add("INNER", inner, {"done": "LOOP"})
    sm.add("LOOP", loop_)
    sm.execute()
    twin = copy.deepcopy(sm)
    assert twin.execute() == "done"
    assert twin.userdata.x == [1]
    assert twin.userdata.x is not sm.userdata.x
    assert (loop_["EACH"].runs, twin["LOOP"]["EACH"].runs) == (2, 4)
    again = pickle.loads(pickle.dumps(sm))
    assert again.execute() == "done"


# -- concurrence -------------------------------------------------------------------------------


def both(*states, outcomes=("done", "preempted"), **options):
    made = smach.Concurrence(list(outcomes), outcomes[0], **options)
    for i, state in enumerate(states):
        made.add("ABCDEFGH"[i], state)
    return made


def test_concurrence_child_without_outcome_raises_instead_of_hanging(clock):
    made = both(smach.CBState(lambda ud: None, outcomes=["ok"]), Sleeper())
    with pytest.raises(smach.InvalidUserCodeError) as caught:
        made.execute()
    (inner,) = caught.value.__cause__.exceptions
    assert isinstance(inner, smach.InvalidTransitionError)
    assert clock.now() == 0.0


def test_concurrence_child_outcome_must_be_registered(clock):
    with pytest.raises(smach.InvalidUserCodeError, match="unknown outcome: got 'nope'"):
        both(smach.CBState(lambda ud: "nope", outcomes=["ok"])).execute()


def test_concurrence_reports_all_children_that_raise(clock):
    def fail(text):
        def body(ud):
            raise ValueError(text)

        return smach.CBState(body, outcomes=["ok"])

    made = both(fail("one"), fail("two"), Sleeper())
    with pytest.raises(smach.InvalidUserCodeError) as caught:
        made.execute()
    group = caught.value.__cause__
    assert isinstance(group, ExceptionGroup)
    assert {str(e) for e in group.exceptions} <= {"one", "two"}


def test_a_child_that_raises_is_told_and_not_shown_to_callbacks_as_one_that_runs(clock):
    def fail(ud):
        raise ValueError("motor on fire")

    asked = []
    made = both(smach.CBState(fail, outcomes=["ok"]), Sleeper(), child_termination_cb=asked.append)
    with pytest.raises(smach.InvalidUserCodeError, match="motor on fire"):
        made.execute()
    assert asked == []


def test_concurrence_reports_a_raising_callback_with_the_children_that_raise(clock):
    class FailsToo(Sleeper):
        def execute(self, userdata):
            self.sleep(self.seconds)
            raise ValueError("motor on fire")

    asked = []

    def ask(outcomes):
        asked.append(outcomes)
        raise RuntimeError("callback")

    made = both(Say("ok"), FailsToo(), Sleeper(), child_termination_cb=ask)
    with pytest.raises(smach.InvalidUserCodeError, match=r"motor on fire.*callback") as caught:
        made.execute()
    group = caught.value.__cause__
    assert [str(e) for e in group.exceptions if isinstance(e, ValueError)] == ["motor on fire"]
    assert [str(e.__cause__) for e in group.exceptions if e.__cause__] == ["callback"]
    assert len(asked) == 1


@pytest.mark.parametrize("which", ["child_termination_cb", "outcome_cb"])
def test_raising_concurrence_callbacks_raise_instead_of_hanging(clock, which):
    def fail(outcomes):
        raise ValueError("callback")

    made = both(Say("ok"), Sleeper(5.0), **{which: fail})
    with pytest.raises(smach.InvalidUserCodeError, match=f"{which} raised"):
        made.execute()
    assert not made.is_running()


def test_child_termination_cb_preempts_just_the_labels_it_names(clock):
    made = both(
        Say("ok"),
        Sleeper(100.0),
        Sleeper(3.0),
        outcomes=["done", "mixed", "preempted"],
        outcome_map={"mixed": {"A": "ok", "B": "preempted", "C": "slept"}},
        child_termination_cb=lambda outcomes: ["B"] if outcomes["A"] == "ok" else False,
    )
    assert made.execute() == "mixed"
    assert clock.now() == 3.0


class Truthless:
    """As an array of NumPy: it is neither true nor false."""

    __hash__ = None

    def __eq__(self, other):
        return self

    def __bool__(self):
        raise ValueError("the truth value is ambiguous")

    def __repr__(self):
        return "array([1, 2])"


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (["X"], r"got labels \['X'\]"),
        (["X", 3], r"got labels \[3, 'X'\]"),
        ([["B"]], r"got labels \[\['B'\]\]"),
        (
            Truthless(),
            r"child_termination_cb: got array\(\[1, 2\]\); expected True, False, or labels",
        ),
    ],
    ids=["unknown", "mixed", "nested", "truthless"],
)
def test_a_wrong_answer_of_child_termination_cb_raises_when_all_have_ended(clock, answer, said):
    """The clean-up began, and the concurrence ended, while a branch was still braking."""

    class Brakes(Sleeper):
        def execute(self, userdata):
            super().execute(userdata)
            clock.sleep(1.0)
            return "preempted"

    made = both(Say("ok"), Brakes(), child_termination_cb=lambda outcomes: answer)
    made.add_cleanup("DOCK", Say("ok"))
    ends = []
    made.subscribe(lambda e: ends.append(e.path) if isinstance(e, smach.events.Left) else None)
    with pytest.raises(smach.InvalidUserCodeError, match=said):
        made.execute()
    assert ends == ["/SM_ROOT/A", "/SM_ROOT/B", "/SM_ROOT/DOCK"]


@pytest.mark.parametrize("answer", [Truthless(), ["ok"], 3, {"done"}], ids=repr)
def test_a_wrong_answer_of_outcome_cb_is_an_error_with_its_place(clock, answer):
    """An array was a bare ValueError about a truth value."""
    made = both(Say("ok"), Say("ok"), outcome_cb=lambda outcomes: answer)
    text = re.escape(f"/SM_ROOT: outcome_cb: got {answer!r}; expected one of ['done'")
    with pytest.raises(smach.InvalidTransitionError, match=f"{text}.*None lets the rules decide"):
        made.execute()
    assert not made.is_running()


@pytest.mark.parametrize("answer", [None, "", False, []], ids=repr)
def test_an_outcome_cb_that_answers_nothing_lets_the_rules_decide(clock, answer):
    made = both(Say("ok"), Say("ok"), outcome_cb=lambda outcomes: answer)
    assert made.execute() == "done"


@pytest.mark.parametrize("kind", ["machine", "concurrence"])
@pytest.mark.parametrize("watched", [False, True])
@pytest.mark.parametrize(
    "options", [{}, {"timeout": 60.0}, {"retry": (2, 0.0, "ok")}, {"preempt_timeout": 1.0}], ids=str
)
def test_a_strange_outcome_of_a_state_that_is_asked_to_stop_is_unknown(
    clock, kind, watched, options
):
    """An array was a bare ValueError, and the visit of the state was not ended."""

    class Strange(smach.State):
        def __init__(self):
            super().__init__(["ok"], **options)

        def execute(self, userdata):
            made.request_preempt()
            return Truthless()

    strange = Strange()
    if kind == "machine":
        made = smach.StateMachine(["ok", "aborted", "preempted"])
        made.add("A", strange)
    else:
        made = both(strange, Sleeper())
    if watched:
        made.subscribe(lambda event: None)
    with pytest.raises(smach.SmachError, match=r"/SM_ROOT/A: unknown outcome: got array"):
        made.execute()
    assert not strange._preempt_requested
    assert clock.now() < 60.0


def test_child_termination_cb_true_preempts_all_others(clock):
    made = both(Say("ok"), Sleeper(), Sleeper(), child_termination_cb=lambda outcomes: True)
    assert made.execute() == "done"
    assert clock.now() == 0.0


def test_an_empty_concurrence_raises_instead_of_hanging():
    with pytest.raises(smach.InvalidStateError, match="expected at least one"):
        smach.Concurrence(["done"], "done").execute()


def test_concurrence_set_initial_state_works():
    made = both(Say("ok"), Say("ok"))
    data = smach.UserData()
    data.x = 1
    made.set_initial_state(["A", "B"], data)
    assert made.userdata.x == 1
    with pytest.raises(smach.InvalidStateError):
        made.set_initial_state(["Z"], data)


def test_concurrence_knows_whether_it_runs(clock):
    made = both(Sleeper(1.0))
    seen = []
    clock.call_later(0.5, lambda: seen.append((made.is_running(), made.get_active_states())))
    made.execute()
    assert seen == [(True, ["A"])]
    assert not made.is_running()


def test_concurrence_ends_with_a_registered_outcome_only(clock):
    made = both(Sleeper(), outcomes=["done", "failed"])
    clock.call_later(1.0, made.request_preempt)
    assert made.execute() == "done"  # the default, because 'preempted' is not registered


def test_the_rule_with_most_conditions_wins():
    made = both(
        Say("ok"),
        Say("ok"),
        outcomes=["done", "one", "two"],
        outcome_map={"two": {"A": "ok", "B": "ok"}, "one": {"A": "ok"}},
    )
    assert made.execute() == "two"


def test_threads_of_children_are_named_after_their_path(clock):
    names = []

    def note(ud):
        names.append(threading.current_thread().name)
        return "ok"

    made = both(smach.CBState(note, outcomes=["ok"]), name="WATCH")
    made.execute()
    assert names == ["/WATCH/A"]


# -- iterator ----------------------------------------------------------------------------------


def loop(state, it, outcomes=("done",), exhausted="done", **options):
    made = smach.Iterator(list(outcomes), [], [], it=it, exhausted_outcome=exhausted)
    made.set_contained_state("EACH", state, **options)
    return made


def test_iterator_without_loop_and_break_outcomes_goes_through_all():
    state = Say("ok")
    assert loop(state, range(4)).execute() == "done"
    assert state.runs == 4


@pytest.mark.parametrize("when", ["made", "first", "later"])
def test_an_error_in_a_generator_is_no_end(when):
    def items():
        if when == "first":
            raise ValueError("camera")
        yield 1
        raise ValueError("camera")

    def make():
        if when == "made":
            raise ValueError("camera")
        return items()

    made = loop(Say("ok"), make)
    with pytest.raises(smach.InvalidUserCodeError, match="camera") as caught:
        made.execute()
    assert isinstance(caught.value.__cause__, ValueError)
    assert not made.is_running()
    assert made.get_active_states() == []


def test_iterator_is_not_running_after_an_exception():
    def fail(ud):
        raise ValueError("x")

    made = loop(smach.CBState(fail, outcomes=["ok"]), [1])
    with pytest.raises(smach.InvalidUserCodeError, match="/SM_ROOT/EACH"):
        made.execute()
    assert made._is_running is False


def test_iterator_termination_callbacks_get_a_list():
    heard = []
    made = loop(Say("ok"), [1])
    made.register_termination_cb(lambda ud, states, outcome: heard.append((states, outcome)))
    made.execute()
    assert heard == [(["EACH"], "done")]


def test_iterator_edges_are_tuples():
    made = loop(Say("ok", "stop"), [1], outcomes=["stop"], loop_outcomes=["ok"])
    assert made.get_internal_edges() == [("ok", "EACH", "EACH"), ("stop", "EACH", "stop")]


def test_iterator_does_not_format_its_items():
    class Heavy:
        def __repr__(self):
            raise AssertionError("formatted")

        __str__ = __repr__

    assert loop(Say("ok"), [Heavy()] * 5).execute() == "done"


# -- logging -----------------------------------------------------------------------------------


def test_nothing_is_printed_by_default(capsys):
    sm = machine()
    sm.add("A", Say("done"))
    sm.execute()
    smach.logdebug("details")
    assert capsys.readouterr() == ("", "")


def test_set_loggers_keeps_its_order_of_arguments():
    from smachpy.base import log

    heard = []
    before = log.current_loggers()
    try:
        smach.set_loggers(*[lambda m, k=k: heard.append((k, m)) for k in ("i", "w", "d", "e")])
        smach.loginfo("1")
        smach.logwarn("2")
        smach.logdebug("3")
        smach.logerr("4")
        sm = machine()
        sm.add("A", Say("x"), {"x": "B"})
        sm.add("B", Say("done"))
        sm.execute()
    finally:
        log.set_loggers(*before)
    assert heard[:4] == [("i", "1"), ("w", "2"), ("d", "3"), ("e", "4")]
    assert ("i", "/SM_ROOT: 'A' -x-> 'B'") in heard


def test_errors_do_not_log_themselves(caplog):
    smach.SmachError("text")
    assert caplog.records == []


def test_state_can_be_used_again_after_any_end(clock):
    sm = machine(["slept", "preempted"])
    sm.add("A", Sleeper(1.0))
    for _ in range(3):
        clock.call_later(0.5, sm.request_preempt)
        assert sm.execute() == "preempted"
        assert sm.execute() == "slept"
    assert current_clock() is clock
