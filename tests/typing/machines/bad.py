"""Mistakes that a strict type checker must find; each line says which error."""

from __future__ import annotations

import smachpy
from actionlib_core import ServiceProxy, SimpleActionClient, SimpleActionServer, Subscriber
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal, TestResult
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy import (
    Concurrence,
    Iterator,
    Sequence,
    SimpleActionState,
    State,
    StateMachine,
    UserData,
)

StateMachine(outcomes="done")  # error: arg-type
State(outcomes="done")  # error: arg-type
Concurrence(["done"], "done", input_keys="key")  # error: arg-type
sm = StateMachine(outcomes=["done"])
both = Concurrence(["done"], "done")
StateMachine.add("A", 3)  # error: arg-type
StateMachine.add(State(["done"]), "A")  # error: arg-type
sm.add("A", State(["done"]), transitions=["done"])  # error: arg-type
sm.add("A")  # error: call-arg
sm.add("A", State(["done"]), transition={})  # error: call-arg
Sequence.add("A", State(["done"]), constants={})  # error: call-arg
both.add("A", State(["done"]), {"x": 1})  # error: dict-item
Iterator.set_contained_state("A", StateMachine)  # error: arg-type
State(["done"], timeout="soon")  # error: arg-type
State(["done"], timeuot=1.0)  # error: call-arg
State(["done"], retry=(3, "x"))  # error: arg-type
State([1])  # error: list-item
sm.control.pause(running="stop")  # error: arg-type
sm.execute().missing()  # error: attr-defined
sm.subscribe(3)  # error: arg-type


class Counts(State):
    def execute(self, userdata: UserData) -> int:  # error: override
        return 1


@smachpy.state(outcomes=["done"])  # error: arg-type
def counts(userdata: UserData) -> int:
    return 1


def name_end(userdata: UserData, status: int, result: TestResult) -> str:
    return "done" if result.rseult else "bad"  # error: attr-defined


SimpleActionState("lift", TestGoal)  # error: arg-type
SimpleActionState("lift", TestAction, result_cb=name_end)
lift = SimpleActionClient("lift", TestAction)
lift.send_goal(TestResult())  # error: arg-type
lift.get_result().goal  # error: union-attr
lift.send_goal(TestGoal(1), feedback_cb=lambda feedback: feedback.gaol)  # error: attr-defined


def run_result(result: TestResult) -> None: ...


SimpleActionServer("lift", TestAction, run_result)  # error: arg-type
SimpleActionState("lift", TestAction, goal=TestResult())  # error: misc
switch = ServiceProxy("switch", SetBool)
switch(dta=True)  # error: call-overload
switch(True).succes  # error: attr-defined
Subscriber("text", String, lambda message: print(message.dta))  # error: attr-defined
