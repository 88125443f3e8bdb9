"""Durations, functions, lists and dicts are checked where they are given, all at once."""

from __future__ import annotations

import fractions
import math
import operator

import numpy as np
import pytest

import smachpy
from actionlib_core import Duration
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool

NAN = math.nan
NO_SECONDS = ["5", "5 s", "soon", NAN, np.float64(NAN), -1, -math.inf, True, [1], {}, 1j, object()]


def state(**options):
    return smachpy.State(["ok", "failed"], **options)


def action(**arguments):
    return smachpy.SimpleActionState("move_base", MoveBaseAction, **arguments)


def monitor(cond_cb=lambda ud, message: True, **arguments):
    return smachpy.MonitorState("flag", Bool, cond_cb, **arguments)


def condition(cond_cb=lambda ud: True, **arguments):
    return smachpy.ConditionState(cond_cb, **arguments)


def service(**arguments):
    return smachpy.ServiceState("set", SetBool, **arguments)


def problems_of(make):
    with pytest.raises(smachpy.InvalidStateError) as raised:
        make()
    assert raised.value.problems
    return raised.value.problems


DURATIONS = [
    (state, "timeout"),
    (state, "preempt_timeout"),
    (action, "timeout"),
    (action, "exec_timeout"),
    (action, "preempt_timeout"),
    (action, "server_wait_timeout"),
    (monitor, "timeout"),
    (monitor, "preempt_timeout"),
    (condition, "timeout"),
    (condition, "poll_rate"),
    (service, "timeout"),
    (smachpy.Retry, "backoff"),
    (lambda **o: smachpy.StateMachine(["ok"], **o), "timeout"),
    (lambda **o: smachpy.Sequence(["ok"], "ok", **o), "preempt_timeout"),
    (lambda **o: smachpy.Concurrence(["ok"], "ok", **o), "timeout"),
    (lambda **o: smachpy.Iterator(["ok"], [], [], **o), "timeout"),
    (lambda **o: smachpy.CBState(lambda ud: "ok", outcomes=["ok"], **o), "timeout"),
    (lambda **o: smachpy.state(["ok"], **o)(lambda ud: "ok"), "timeout"),
]


@pytest.mark.parametrize("wrong", NO_SECONDS, ids=range(len(NO_SECONDS)))
@pytest.mark.parametrize(("make", "argument"), DURATIONS)
def test_what_is_no_duration_is_refused_by_name(make, argument, wrong):
    (problem,) = problems_of(lambda: make(**{argument: wrong}))
    assert f"{argument}: got " in problem


@pytest.mark.parametrize(
    "good", [2, 2.0, np.int64(2), np.float32(2), np.float64(2), Duration(2), fractions.Fraction(2)]
)
@pytest.mark.parametrize(("make", "argument"), DURATIONS)
def test_numbers_of_all_kinds_and_durations_are_fine(make, argument, good):
    make(**{argument: good})


def test_numbers_become_floats_and_infinity_is_no_limit():
    options = smachpy.get_options(state(timeout=np.float32(2), preempt_timeout=Duration(3)))
    assert [type(seconds) for seconds in (options.timeout, options.preempt_timeout)] == [float] * 2
    options = smachpy.get_options(state(timeout=math.inf, preempt_timeout=math.inf))
    assert options.timeout is None
    assert options.preempt_timeout is None
    assert "preempted" not in state(timeout=math.inf).get_registered_outcomes()
    problems_of(lambda: smachpy.Retry(2, math.inf))


@pytest.mark.parametrize(
    ("option", "wrong"),
    [
        ("preempt_timeout", "inherited"),
        ("timeout_outcome", 7),
        ("timeout_outcome", ""),
        ("timeout_outcome", None),
        ("retry", 0),
        ("retry", -1),
        ("retry", True),
        ("retry", 2.5),
        ("retry", "3"),
        ("retry", ()),
        ("retry", (3, 1.0, ["failed"], 4)),
        ("retry", (3, -1.0)),
        ("retry", (3, 1.0, [])),
        ("retry", (3, 1.0, [7])),
        ("retry", (3, 1.0, 7)),
        ("retry", (3, 1.0, [int])),
        ("on_exception", ["failed"]),
        ("on_exception", "failed"),
        ("on_exception", {"x": "failed"}),
        ("on_exception", {int: "failed"}),
        ("on_exception", {OSError("x"): "failed"}),
        ("on_exception", {(OSError, ValueError): "failed"}),
        ("on_exception", {OSError: 7}),
        ("on_exception", {OSError: None}),
        ("on_enter", 7),
        ("on_enter", "open"),
        ("on_enter", lambda: None),
        ("on_enter", lambda ud, outcome: None),
        ("on_exit", lambda ud: None),
        ("on_exit", 7),
    ],
)
def test_options_of_a_wrong_type_or_value_are_refused_by_name(option, wrong):
    (problem,) = problems_of(lambda: state(**{option: wrong}))
    assert problem.startswith(f"{option}:")


def test_an_async_hook_that_nobody_would_await_is_refused():
    async def hook(userdata):
        pass

    (problem,) = problems_of(lambda: state(on_enter=hook))
    assert "async" in problem


async def awaited(*_):
    return False


def iterated(*_):
    yield False


async def both(*_):
    yield False


class Awaited:
    async def __call__(self, *_):
        return False


class Iterated:
    def __call__(self, *_):
        yield False


@pytest.mark.parametrize("function", [awaited, iterated, both, Awaited(), Iterated()])
@pytest.mark.parametrize(
    "make",
    [
        lambda f: state(on_enter=f),
        monitor,
        condition,
        lambda f: smachpy.Concurrence(["ok"], "ok", child_termination_cb=f),
        lambda f: smachpy.StateMachine(["ok"]).register_start_cb(f),
    ],
)
def test_functions_whose_body_nothing_would_run_are_refused(make, function):
    """The condition of a generator was always true: the call returns an object."""
    (problem,) = problems_of(lambda: make(function))
    assert "not an async one" in problem or "without `yield`" in problem


def test_functions_of_all_kinds_may_be_hooks():
    class Hooks:
        def enter(self, userdata):
            pass

        def __call__(self, userdata, outcome="x"):
            pass

    class Wrapped:
        __wrapped__ = staticmethod(lambda: None)  # its own signature counts, not this one

        def __call__(self, userdata):
            pass

    for hook in (Hooks().enter, Hooks(), Wrapped(), operator.itemgetter(0), print, lambda *a: None):
        state(on_enter=hook)


def test_all_problems_are_told_at_once_with_class_and_argument():
    found = problems_of(
        lambda: smachpy.State(
            "ok", [7], timeout="soon", on_enter=7, retry=(0, NAN), preempt_timeout=-5
        )
    )
    assert [problem.partition(":")[0] for problem in found] == [
        *("outcomes", "input_keys", "timeout", "on_enter", "retry", "retry", "preempt_timeout")
    ]
    with pytest.raises(smachpy.InvalidStateError, match=r"State: timeout: .*\n.*State: on_exit:"):
        state(timeout="soon", on_exit=7)


TALKING = [
    (
        lambda: action(
            exec_timeout="60", preempt_timeout=NAN, goal_cb=7, result_slots="x", timeout=-1
        ),
        {"exec_timeout", "preempt_timeout", "goal_cb", "result_slots", "timeout"},
    ),
    (
        lambda: action(outcomes="ok", goal_cb_args=7, result_cb=len, feedback_cb=lambda ud: 0),
        {"outcomes", "goal_cb_args", "result_cb", "feedback_cb"},
    ),
    (lambda: action(goal_cb=lambda ud: None, goal_cb_kwargs=3), {"goal_cb", "goal_cb_kwargs"}),
    (
        lambda: monitor(7, max_checks="3", timeout=-1, on_enter=7, timeout_outcome=3),
        {"cond_cb", "max_checks", "timeout", "on_enter", "timeout_outcome"},
    ),
    (lambda: smachpy.MonitorState(7, "Bool", None), {"topic", "msg_type", "cond_cb"}),
    (
        lambda: condition(None, poll_rate="x", max_checks=-2, wake_on=["topic"]),
        {"cond_cb", "poll_rate", "max_checks", "wake_on"},
    ),
    (lambda: condition(lambda: True, poll_rate=None), {"cond_cb", "poll_rate"}),
    (
        lambda: service(timeout="x", request_cb=7, response_slots="y", timeout_outcome=None),
        {"timeout", "request_cb", "response_slots", "timeout_outcome"},
    ),
    (lambda: smachpy.ServiceState("set", Bool), {"service_spec"}),
    (lambda: smachpy.CBState(None, cb_args=7, cb_kwargs=8), {"cb", "cb_args", "cb_kwargs"}),
    (lambda: smachpy.CBState(lambda ud: "ok", [1, 2], outcomes="ok"), {"cb", "outcomes"}),
    (
        lambda: smachpy.Concurrence(
            ["ok"], "oh", outcome_map={"ok": 7}, outcome_cb=lambda: 1, child_termination_cb=3
        ),
        {"default outcome", "rule", "outcome_cb", "child_termination_cb"},
    ),
    (lambda: smachpy.Concurrence(["ok"], "ok", outcome_map=7, name=3), {"outcome_map", "name"}),
    (lambda: smachpy.StateMachine("ok", name=3, timeout=NAN), {"outcomes", "name", "timeout"}),
    (lambda: smachpy.Sequence(["ok"], 7), {"connector_outcome"}),
    (
        lambda: smachpy.Iterator(["ok"], [], [], it=7, it_label=8, exhausted_outcome=None),
        {"it", "it_label", "exhausted_outcome"},
    ),
]

ON_THE_NETWORK = [
    (
        lambda sm: smachpy.ActionServerWrapper(
            "act", MoveBaseAction, sm, succeeded_outcomes="ok", goal_key=None, goal_slots_map="x"
        ),
        {"succeeded_outcomes", "goal_key", "goal_slots_map"},
    ),
    (
        lambda sm: smachpy.ActionServerWrapper(
            "act",
            MoveBaseAction,
            sm,
            aborted_outcomes=[7],
            feedback_slots_map={"base_position": 7},
            result_slots_map={"oops": "x"},
        ),
        {"aborted_outcomes", "feedback_slots_map", "result_slots_map"},
    ),
    (
        lambda sm: smachpy.ActionServerWrapper(7, MoveBaseAction, state()),
        {"server_name", "wrapped_container"},
    ),
    (
        lambda sm: smachpy.IntrospectionServer(7, state(), None),
        {"server_name", "state", "path"},
    ),
    (
        lambda sm: smachpy.introspection.ContainerProxy("", state(), 7),
        {"server_name", "container", "path"},
    ),
    (
        lambda sm: smachpy.introspection.IntrospectionClient().set_initial_state(
            "server", "/SM", "A", timeout="5"
        ),
        {"initial_states", "timeout"},
    ),
    (
        lambda sm: smachpy.introspection.IntrospectionClient().subscribe("server", lambda: None),
        {"listener"},
    ),
]


@pytest.mark.parametrize(("make", "arguments"), ON_THE_NETWORK)
def test_what_is_offered_on_the_network_names_all_its_wrong_arguments(make, arguments):
    found = problems_of(lambda: make(smachpy.StateMachine(["ok"])))
    assert {problem.partition(":")[0] for problem in found} == arguments
    assert len(found) == len(arguments)


@pytest.mark.parametrize(("make", "arguments"), TALKING)
def test_each_kind_of_state_names_all_its_wrong_arguments(make, arguments):
    found = problems_of(make)
    assert {problem.partition(":")[0] for problem in found} == arguments
    assert len(found) == len(arguments)


@pytest.mark.parametrize("retry", [3, (3, 0.0, "abroted"), smachpy.Retry(3)])
def test_a_retry_that_nothing_could_cause_is_refused_where_the_state_is_added(retry):
    for container in (
        smachpy.StateMachine(["ok", "failed"]),
        smachpy.Concurrence(["ok"], "ok"),
    ):
        with pytest.raises(smachpy.InvalidStateError, match=r"^A: retry: .*'failed'"):
            container.add("A", state(retry=retry))
        assert container.get_children() == {}
    root = smachpy.StateMachine(["ok", "failed"], retry=retry)
    root.add("A", state())
    with pytest.raises(smachpy.InconsistentMachineError, match=r"^/SM_ROOT: retry"):
        root.check_consistency()
    with pytest.raises(smachpy.InconsistentMachineError, match=r"^/SM_ROOT: retry"):
        root.execute()


def test_a_retry_that_something_could_cause_is_fine():
    sm = smachpy.StateMachine(["ok", "failed", "aborted", "preempted", "late"])
    for i, options in enumerate(
        (
            {"retry": (3, 0.0, ["aborted", OSError])},
            {"retry": (3, 0.0, "failed")},
            {"retry": 3, "timeout": 1.0},
            {"retry": 3, "on_exception": {OSError: "aborted"}},
            {"retry": (3, 0, "preempted")},
            {"retry": (3, 0, ["late", "failed"])},
        )
    ):
        sm.add(f"S{i}", state(**options))


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"transitions": "NEXT"}, "transitions"),
        ({"transitions": ["ok"]}, "transitions"),
        ({"transitions": {"ok": 7}}, "transitions"),
        ({"remapping": "x"}, "remapping"),
        ({"constants": 7}, "constants"),
        ({"remapping": {"x": 7}}, "remapping"),
    ],
)
def test_add_names_the_argument_that_is_wrong(arguments, named):
    sm = smachpy.StateMachine(["ok", "failed"])
    (problem,) = problems_of(lambda: sm.add("A", state(), **arguments))
    assert problem.startswith(f"{named}:")
    assert sm.get_children() == {}


@pytest.mark.parametrize(
    "use",
    [
        lambda sm: sm.register_start_cb(7),
        lambda sm: sm.register_transition_cb(None),
        lambda sm: sm.register_termination_cb("f"),
        lambda sm: sm.register_start_cb(lambda ud, states: None, cb_args=7),
        lambda sm: sm.register_termination_cb(lambda ud, states: None),
        lambda sm: sm.subscribe(7),
        lambda sm: sm.subscribe(lambda: None),
        lambda sm: sm.wait_ended("soon"),
        lambda sm: sm.wait_ended(NAN),
        lambda sm: sm.event_buffer(on_news=7),
        lambda sm: smachpy.set_preempt_handler(sm, timeout="60"),
        lambda sm: smachpy.set_preempt_handler(7),
        lambda sm: smachpy.set_shutdown_check(7),
        lambda sm: smachpy.set_loggers(7, print, print, print),
        lambda sm: smachpy.cb_interface(outcomes="ok"),
        lambda sm: smachpy.CBInterface(7),
        lambda sm: smachpy.all_of("A"),
        lambda sm: smachpy.n_of("1", {"A": "ok"}),
        lambda sm: smachpy.n_of(True, {"A": "ok"}),
        lambda sm: sm.sleep("5"),
        lambda sm: sm.wait_preempt(NAN),
    ],
)
def test_the_other_functions_check_what_they_are_given(clock, use):
    with pytest.raises(smachpy.InvalidStateError):
        use(smachpy.StateMachine(["ok"]))


def test_a_sleep_until_a_time_that_has_passed_is_none(clock):
    assert not state().sleep(-0.001)
    assert not state().wait_preempt(-math.inf)
    assert not state().sleep(np.float32(0.5))
    assert clock.now() == 0.5


def test_execute_without_the_userdata_is_refused_where_it_is_added():
    class Short(smachpy.State):
        def execute(self):
            return "ok"

    class Long(smachpy.State):
        def execute(self, userdata, speed):
            return "ok"

    for kind in (Short, Long):
        for add in (
            smachpy.StateMachine(["ok"]).add,
            smachpy.Concurrence(["ok"], "ok").add,
            smachpy.Iterator(["ok"], [], []).set_contained_state,
        ):
            with pytest.raises(smachpy.InvalidStateError) as raised:
                add("A", kind(["ok"]))
            assert raised.value.problems[0].startswith("execute:")
            assert str(raised.value).startswith("A:")


def decorated(function):
    def with_speed(self, userdata):
        return function(self, userdata, 1.0)

    with_speed.__wrapped__ = function
    return with_speed


@pytest.mark.parametrize(
    "execute",
    [
        lambda self, userdata, /: "ok",
        lambda self, ud, speed=1.0: "ok",
        lambda self, *args, **kwargs: "ok",
        lambda *args: "ok",
        staticmethod(lambda userdata: "ok"),
        classmethod(lambda cls, userdata: "ok"),
        decorated(lambda self, userdata, speed: "ok"),
    ],
)
def test_every_execute_that_can_be_called_is_fine(execute):
    sm = smachpy.StateMachine(["ok"])
    sm.add("A", type("Odd", (smachpy.State,), {"execute": execute})(["ok"]))
    assert sm.execute() == "ok"


def containers_of(made):
    sm = smachpy.StateMachine(["ok"], name="C")
    both = smachpy.Concurrence(["ok"], "ok", name="C")
    loop = smachpy.Iterator(["ok"], [], [], range(2), exhausted_outcome="ok", name="C")
    for add in (sm.add, both.add, loop.set_contained_state):
        add("A", made())
    return sm, both, loop


@pytest.mark.parametrize("watched", [False, True, "buffer"])
@pytest.mark.parametrize("outcome", [["ok"], {"ok": 1}, None, 7, ("ok",), object(), {1}])
def test_what_is_no_outcome_is_told_as_it_is(outcome, watched):
    for container in containers_of(lambda: smachpy.CBState(lambda ud: outcome, outcomes=["ok"])):
        if watched is True:
            container.subscribe(lambda event: None)
        elif watched:
            container.event_buffer()
        with pytest.raises(smachpy.SmachError) as raised:
            container.execute()
        assert f"/C/A: unknown outcome: got {outcome!r}" in str(raised.value)


@pytest.mark.parametrize("fails", [{}.__getitem__, len], ids=["KeyError", "TypeError"])
def test_errors_of_functions_made_in_c_are_no_outcomes(fails):
    """Such an error has no Python frame below the machine's, as a failed look-up has none."""

    class Calls(smachpy.State):
        execute = staticmethod(fails)

    for container in containers_of(lambda: Calls(["ok"])):
        with pytest.raises(smachpy.InvalidUserCodeError) as raised:
            container.execute()
        assert "raised" in str(raised.value)
        assert "unknown outcome" not in str(raised.value)


def test_a_function_that_answers_with_a_coroutine_is_an_error():
    """Nothing awaits the coroutine, which counted as true."""

    async def later():
        return False

    asks = smachpy.StateMachine(["true", "false", "preempted"], name="C")
    asks.add("A", smachpy.ConditionState(lambda userdata: later()))
    stops = smachpy.Concurrence(["ok"], "ok", child_termination_cb=lambda ended: later(), name="C")
    stops.add("A", smachpy.CBState(lambda userdata: "ok", outcomes=["ok"]))
    for container in (asks, stops):
        with pytest.raises(smachpy.InvalidUserCodeError, match="got a coroutine; expected an ans"):
            container.execute()
