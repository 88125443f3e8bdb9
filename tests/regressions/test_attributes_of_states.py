"""The attributes of a user's state are the user's, whatever their names."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import pytest

import smachpy
from actionlib_core.clock import current_clock
from smachpy.events import Left

# Names that states of public SMACH programs give their own attributes, and those of the options.
NAMES = [
    "timeout",
    "timeout_outcome",
    "preempt_timeout",
    "retry",
    "on_exception",
    "on_enter",
    "on_exit",
    "kind",
    "is_container",
    "outcomes",
    "userdata",
    "name",
    "log",
    "logger",
    "goal",
    "client",
    "clock",
    "scope",
    "on_preempt",
    "node",
    "lock",
    "path",
    "label",
    "parent",
    "run",
    "events",
    "state",
    "states",
    "result",
    "feedback",
    "server",
    "action",
    "topic",
    "sub",
    "pub",
    "rate",
    "listener",
    "tf",
    "robot",
    "controller",
    "active",
    "options",
    "data",
    "interface",
    "version",
    "input_keys",
    "output_keys",
    "callbacks",
    "preempt",
    "children",
    "count",
    "errors",
    "sleep",
    "control",
    "status",
    "start",
    "stop",
    "mutex",
    "event",
    "_cb",
    "_args",
    "_kwargs",
    "_frame",
    "_lock",
    "_plan",
    "_control",
    "_group",
    "_asker",
    "_answered",
    "_interface",
    "_outcomes",
    "_input_keys",
    "_output_keys",
    "_preempt_callbacks",
    "_clock",
    "_scope",
    "_grace",
    "_on_preempt",
    "_set_options",
    "_states",
    "_userdata",
    "_timeout",
    "_retry",
    "_kind",
    "_options",
    "_goal",
    "_node",
    "_topic",
    "_label",
    "_items",
    "_listeners",
    "_buffers",
    "_step",
    "_run",
    "_event",
    "_status",
    "_wake",
    "_stands_for",
    "_exchange",
    "_proxy",
    "_path",
    "_name",
]
VALUES = (0, "map", None, [1.0], object(), lambda: None, float("nan"))


class Owner(smachpy.State):
    """Sets one attribute, waits a little, and checks that the attribute is still its own."""

    def __init__(self, name, value, *, early=False):
        if early:
            setattr(self, name, value)
        super().__init__(outcomes=["done", "aborted", "preempted"])
        setattr(self, name, value)
        self.own = name, value

    def execute(self, userdata):
        name, value = self.own
        assert getattr(self, name) is value
        stopped = smachpy.State.wait_preempt(self, 1.0)
        return "preempted" if stopped else "done"


def machine_of(*states):
    sm = smachpy.StateMachine(["done", "aborted", "preempted"], name="M")
    labels = [f"S{i}" for i in range(len(states))]
    for label, state, following in zip(labels, states, [*labels[1:], "done"], strict=True):
        sm.add(label, state, {"done": following})
    return sm


@pytest.mark.parametrize("name", NAMES)
def test_any_name_may_be_used(clock, name):
    sm = machine_of(*(Owner(name, value, early=True) for value in VALUES))
    events = []
    sm.subscribe(events.append)
    clock.call_later(0.5, lambda: sm.control.active())
    assert sm.execute() == "done"
    assert [e.outcome for e in events if isinstance(e, Left)] == ["done"] * len(VALUES)
    assert {state.kind for state in smachpy.describe(sm).children} == {"state"}
    clock.call_later(0.5, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert clock.now() == len(VALUES) + 0.5
    assert copy.deepcopy(sm).execute() == "done"


@pytest.mark.parametrize("name", NAMES)
def test_any_name_may_be_used_beside_options_and_in_every_container(clock, name):
    class Slow(Owner):
        def __init__(self):
            super().__init__(name, "mine")
            smachpy.set_options(self, timeout=0.5, retry=2)

    both = smachpy.Concurrence(["done", "aborted"], "done")
    both.add("A", Owner(name, "mine"))
    both.add("B", Slow())
    loop = smachpy.Iterator(["done"], [], [], range(2), exhausted_outcome="done")
    loop.set_contained_state("BOTH", both)
    sm = machine_of(loop)
    assert sm.execute() == "done"
    assert clock.now() == 2.0
    sm.control.pause()
    clock.call_later(0.5, sm.control.resume)
    assert sm.execute() == "done"


@pytest.mark.parametrize("name", NAMES)
def test_class_attributes_are_no_options(clock, name):
    kind = type("Classy", (Owner,), {name: "mine"})
    assert machine_of(kind("own_name", 1)).execute() == "done"


def test_hooks_are_methods_that_take_what_hooks_take():
    heard = []

    class Own(smachpy.State):
        def on_enter(self):
            heard.append("own enter")

        def on_exit(self, userdata):
            heard.append("own exit")

        def execute(self, userdata):
            self.on_enter()
            return "done"

    class Hooked(Own):
        def on_enter(self, userdata):
            heard.append("enter")

        def on_exit(self, userdata, outcome):
            heard.append(outcome)

        def execute(self, userdata):
            return "done"

    class Free(Hooked):
        def on_enter(self, userdata, again=False, *more, **named):
            heard.append("enter, too")

        async def on_exit(self, userdata):
            heard.append("not called")

    machine_of(Own(["done"]), Hooked(["done"]), Free(["done"])).execute()
    assert heard == ["own enter", "enter", "done", "enter, too"]
    assert smachpy.get_options(Own(["done"])).on_enter is None
    assert smachpy.get_options(Hooked(["done"])).on_exit is not None


@pytest.mark.parametrize("container", [False, True], ids=["state", "root"])
@pytest.mark.parametrize("kind", ["async", "generator"])
@pytest.mark.parametrize("hook", ["on_enter", "on_exit", "resume", "on_resume"])
def test_a_hook_whose_body_nothing_would_run_is_refused(hook, kind, container):
    """It was skipped without a word: the brake stayed off."""
    words = "(self, userdata, outcome)" if hook == "on_exit" else "(self, userdata)"
    body = "def {}{}: {}".format(hook, words, "yield" if kind == "generator" else "pass")
    names = {}
    exec(f"async {body}" if kind == "async" else body, names)
    base = smachpy.StateMachine if container else smachpy.State
    made = type("Brake", (base,), {hook: names[hook], "execute": base.execute})(["done"])

    def use():
        if container:
            made.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"]))
            made.execute()
        else:
            machine_of(made)

    with pytest.raises(smachpy.SmachError, match=f"{hook}: got the {kind} {hook}; expected a"):
        use()
    smachpy.set_options(made, **{hook: lambda *_: None})  # the option comes first
    if not container:
        machine_of(made)


def test_options_are_read_and_changed_by_functions(clock):
    state = Owner("timeout", 7.0)
    smachpy.set_options(state, timeout=0.5, timeout_outcome="late", retry=(2, 1, "late"))
    options = smachpy.get_options(state)
    assert (options.timeout, options.timeout_outcome, options.on_exit) == (0.5, "late", None)
    assert options.retry == smachpy.Retry(2, 1.0, ["late"])
    assert state.timeout == 7.0
    assert "late" in state.get_registered_outcomes()
    with pytest.raises(AttributeError):
        options.timeout = 3
    with pytest.raises(smachpy.InvalidStateError) as raised:
        smachpy.set_options(state, timeout="soon", retry=0)
    assert len(raised.value.problems) == 2
    assert smachpy.get_options(state) == options
    with pytest.raises(TypeError, match="Did you mean 'timeout'"):
        smachpy.set_options(state, timeuot=1)


def test_options_that_change_between_two_runs_hold(clock):
    state = Owner("x", 1)
    sm = machine_of(state)
    assert sm.execute() == "done"
    smachpy.set_options(state, timeout=0.5)
    assert sm.execute() == "aborted"
    smachpy.set_options(state, timeout=None)
    assert sm.execute() == "done"


@dataclasses.dataclass
class Drive(smachpy.State):
    """A dataclass compares by value and cannot be hashed."""

    timeout: float = 3.0
    kind: str = "fast"

    def __post_init__(self):
        super().__init__(outcomes=["done"], input_keys=["x"])

    def execute(self, userdata):
        return "done"


def test_a_dataclass_may_be_a_state():
    sm = machine_of(Drive(), Drive(), Drive(timeout=5.0, kind="slow"))
    sm.userdata.x = 1
    assert sm.execute() == "done"
    assert smachpy.get_options(sm["S0"]).timeout is None


@dataclasses.dataclass(frozen=True)
class Frozen(smachpy.State):
    speed: float = 1.0

    def __post_init__(self):
        super().__init__(outcomes=["done"])


def test_a_frozen_dataclass_is_refused_with_the_way_out():
    """It raised "cannot assign to field '_preempt_requested'"."""
    with pytest.raises(smachpy.InvalidStateError, match="without frozen=True"):
        Frozen()


class Early(smachpy.State):
    def __init__(self):
        self.speed = 1.0

    def execute(self, userdata):
        return "done"


@dataclasses.dataclass
class NoPostInit(smachpy.State):
    speed: float = 1.0

    def execute(self, userdata):
        return "done"


@pytest.mark.parametrize("kind", [Early, NoPostInit])
@pytest.mark.parametrize(
    "use",
    [
        lambda s: smachpy.StateMachine(["done"]).add("GO", s),
        lambda s: smachpy.Concurrence(["done"], "done").add("GO", s),
        lambda s: smachpy.Iterator(["done"], [], []).set_contained_state("GO", s),
        lambda s: s.register_outcomes(["done"]),
        lambda s: s.get_registered_outcomes(),
        lambda s: s.request_preempt(),
        lambda s: s.sleep(1.0),
        smachpy.describe,
        smachpy.get_options,
        copy.copy,
    ],
)
def test_a_state_without_the_init_of_state_says_so(kind, use):
    with pytest.raises(smachpy.InvalidStateError) as raised:
        use(kind())
    text = str(raised.value)
    assert kind.__name__ in text
    assert "super().__init__(outcomes=[...])" in text


def test_the_label_is_named_too():
    with pytest.raises(smachpy.InvalidStateError, match=r"^GO: .*Early"):
        smachpy.StateMachine(["done"]).add("GO", Early())


def test_a_state_may_be_initialised_again_while_it_is_in_a_machine(clock):
    class Fresh(smachpy.State):
        def __init__(self):
            super().__init__(outcomes=["done", "preempted"])
            self.speed = 1.0

        def execute(self, userdata):
            self.__init__()
            return "preempted" if self.sleep(5.0) else "done"

    sm = machine_of(Fresh(), Fresh())
    assert sm.execute() == "done"
    clock.call_later(1.0, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert clock.now() == 11.0


class Counter(smachpy.State):
    """At the top of the module, so that it can be pickled."""

    def __init__(self):
        super().__init__(outcomes=["done", "preempted"], timeout=9.0)

    def execute(self, userdata):
        return "preempted" if self.sleep(1.0) else "done"


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))]
)
def test_a_copy_is_a_state_of_its_own(clock, copied):
    first = Counter()
    second = copied(first)
    assert smachpy.get_options(second).timeout == 9.0
    second.register_outcomes(["more"])
    assert "more" not in first.get_registered_outcomes()
    heard = []
    first.on_preempt(lambda: heard.append("first"))
    second.request_preempt()
    assert heard == []
    assert not first.preempt_requested()
    assert machine_of(first).execute() == "done"
    assert current_clock() is clock


async def say_done(userdata):
    return "done"


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
@pytest.mark.parametrize(
    "state", [smachpy.CBState(say_done, outcomes=["done"]), smachpy.state(["done"])(say_done)]
)
def test_a_copy_of_an_async_function_is_awaited_too(clock, state, copied):
    """Its outcome was the coroutine."""
    assert machine_of(copied(state)).execute() == "done"
    assert current_clock() is clock
