# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import TypeAlias as _TypeAlias
from actionlib_core.interfaces import Ros2Action as _Ros2Action
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.action._action_spec import HasFeedback as _HasFeedback
from actionlib_core.action._action_spec import HasGoal as _HasGoal
from actionlib_core.action._action_spec import HasResult as _HasResult

class Fibonacci(_Ros2Action):
    Goal: _TypeAlias = Fibonacci_Goal
    Result: _TypeAlias = Fibonacci_Result
    Feedback: _TypeAlias = Fibonacci_Feedback
    action_goal: _HasGoal[Fibonacci_Goal]
    action_result: _HasResult[Fibonacci_Result]
    action_feedback: _HasFeedback[Fibonacci_Feedback]

class Fibonacci_Goal(_Ros2Message):
    order: int
    def __init__(
        self,
        order: int | None = None,
    ) -> None: ...

class Fibonacci_Result(_Ros2Message):
    sequence: list[int]
    def __init__(
        self,
        sequence: _Collection[int] | None = None,
    ) -> None: ...

class Fibonacci_Feedback(_Ros2Message):
    sequence: list[int]
    def __init__(
        self,
        sequence: _Collection[int] | None = None,
    ) -> None: ...
