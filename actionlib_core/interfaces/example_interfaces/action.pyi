# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.example_interfaces.action import (
    Fibonacci as Fibonacci,
    Fibonacci_Goal as Fibonacci_Goal,
    Fibonacci_Result as Fibonacci_Result,
    Fibonacci_Feedback as Fibonacci_Feedback,
)
