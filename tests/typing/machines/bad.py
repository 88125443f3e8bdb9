"""Mistakes that a strict type checker must find; each line says which error."""

from __future__ import annotations

from smachpy import Concurrence, Iterator, Sequence, State, StateMachine

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
