"""Programs that a strict type checker must accept."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypedDict

import smachpy
from actionlib_core.interfaces.actionlib.msg import TestAction
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy import (
    CBState,
    Concurrence,
    ConditionState,
    Iterator,
    MonitorState,
    Retry,
    Sequence,
    ServiceState,
    SimpleActionState,
    State,
    StateMachine,
    UserData,
    any_of,
    cb_interface,
)
from smachpy.events import Entered, Event, Left
from smachpy.events.introspection import StateRecord, describe
from smachpy.states import AwaitMessage, Publish, Wait


@dataclass
class Mission:
    battery: float = 1.0
    goals: list[str] = field(default_factory=list)


class Shared(TypedDict):
    level: int


class Drive(State):
    def __init__(self) -> None:
        super().__init__(
            outcomes=["arrived", "preempted"],
            io_keys=["goals"],
            timeout=5.0,
            retry=Retry(2, 0.5, ("aborted", OSError)),
            on_exception={OSError: "aborted"},
            preempt_timeout=None,
        )

    def execute(self, ud: Mission) -> str:
        goal: str = ud.goals.pop()
        return "preempted" if self.sleep(len(goal)) else "arrived"


class Old(smachpy.State):
    def __init__(self) -> None:
        smachpy.State.__init__(self, ["ok"], ["x"], ["y"], ["z"])

    def execute(self, userdata: UserData) -> str:
        return "ok"


class Cancelled(State):
    async def execute(self, ud: UserData) -> str:
        return "ok"


@smachpy.state(outcomes=["done"], input_keys=["level"], retry=3)
def look(userdata: UserData) -> str:
    return "done"


@cb_interface(outcomes=["done"], input_keys=["level"])
def callback(userdata: UserData, factor: int) -> str:
    return "done"


def listen(event: Event) -> None:
    if isinstance(event, Left):
        outcome: str = event.outcome
        print(event.path, outcome)
    elif isinstance(event, Entered):
        print(event.t + 1.0)


def build() -> StateMachine:
    sm = StateMachine(outcomes=["done", "preempted"], name="P", userdata_type=Mission)
    with sm:
        StateMachine.add("DRIVE", Drive(), {"arrived": "LOOK", "aborted": None}, {"goals": "goals"})
        StateMachine.add("LOOK", look, transitions={"done": "CALL"}, constants={"level": 1})
        StateMachine.add_auto("CALL", CBState(callback, [2]), ["done"])
    sm.add("LAST", smachpy.machines.state.State(["done"]))
    sm.subscribe(listen)()
    sm.control.pause(running="cancel")
    record: StateRecord = describe(sm)
    print(record.children)
    return sm


class Named(State):
    """With the argument's name of the documentation, which is not the library's."""

    def execute(self, userdata: UserData) -> str:
        return str(userdata.level)


def with_options() -> smachpy.Options:
    kind: smachpy.Kind = "state"
    again = Retry(3, 0.5, ["aborted"])
    state = State([kind], retry=(3, 1.0, ["aborted", OSError]), timeout=3)
    State(["ok"], retry=(3, 1.0, OSError), preempt_timeout="inherit")
    State(["ok"], retry=(3, 1.0, ("aborted", "failed")), preempt_timeout=None)
    State(["ok"], retry=(3, 1.0), on_exception={OSError: "failed"})
    State(["ok"], retry=3)
    SimpleActionState("count", TestAction, resource="base", success=["succeeded"])
    ServiceState("lamp", SetBool, resource="lamp", resume="skip:succeeded", success=["succeeded"])
    MonitorState("battery", Bool, lambda userdata, message: True, resource="battery")
    ConditionState(lambda userdata: True, success=["true"], on_resume=print)
    AwaitMessage("start", Bool, timeout=None, resource="button", retry=2)
    Publish("horn", Bool, resource="horn")
    Wait(1.0, resource="lift", timeout=5.0)
    smachpy.set_options(state, retry=again)
    smachpy.set_options(Named(["ok"]), retry=None)
    return smachpy.get_options(state)


def build_others() -> str:
    both = Concurrence(
        ["done", "low"],
        "done",
        outcome_map={"low": any_of({"A": ["x", "y"]}), "done": {"A": "z"}},
        child_termination_cb=lambda outcomes: outcomes["A"] == "x",
        userdata_type=Shared,
    )
    with both:
        state: State = Concurrence.add("A", Old(), {"x": "y"})
    steps = Sequence(["ok"], connector_outcome="ok")
    with steps:
        Sequence.add("ONE", state)
    loop = Iterator(["done"], [], [], it=range(3), exhausted_outcome="done")
    with loop:
        Iterator.set_contained_state("EACH", steps, loop_outcomes=["ok"])
    return loop.execute(UserData())


def in_a_function(userdata: object) -> str:
    return "preempted" if smachpy.current_state().sleep(1.0) else "done"
