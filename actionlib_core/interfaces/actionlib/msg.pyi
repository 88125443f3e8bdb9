# Written by `actionlib interface stubs`; changes are lost.
from typing import Final as _Final
import actionlib_core.interfaces.actionlib_msgs.msg as _actionlib_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Duration as _Duration

class TestAction(_Message):
    action_goal: TestActionGoal
    action_result: TestActionResult
    action_feedback: TestActionFeedback
    def __init__(
        self,
        action_goal: TestActionGoal | None = None,
        action_result: TestActionResult | None = None,
        action_feedback: TestActionFeedback | None = None,
    ) -> None: ...

class TestActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: TestGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: TestGoal | None = None,
    ) -> None: ...

class TestActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: TestResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: TestResult | None = None,
    ) -> None: ...

class TestActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: TestFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: TestFeedback | None = None,
    ) -> None: ...

class TestGoal(_Message):
    goal: int
    def __init__(
        self,
        goal: int | None = None,
    ) -> None: ...

class TestResult(_Message):
    result: int
    def __init__(
        self,
        result: int | None = None,
    ) -> None: ...

class TestFeedback(_Message):
    feedback: int
    def __init__(
        self,
        feedback: int | None = None,
    ) -> None: ...

class TestRequestAction(_Message):
    action_goal: TestRequestActionGoal
    action_result: TestRequestActionResult
    action_feedback: TestRequestActionFeedback
    def __init__(
        self,
        action_goal: TestRequestActionGoal | None = None,
        action_result: TestRequestActionResult | None = None,
        action_feedback: TestRequestActionFeedback | None = None,
    ) -> None: ...

class TestRequestActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: TestRequestGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: TestRequestGoal | None = None,
    ) -> None: ...

class TestRequestActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: TestRequestResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: TestRequestResult | None = None,
    ) -> None: ...

class TestRequestActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: TestRequestFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: TestRequestFeedback | None = None,
    ) -> None: ...

class TestRequestGoal(_Message):
    TERMINATE_SUCCESS: _Final = 0  # What the server is told to do with the goal.
    TERMINATE_ABORTED: _Final = 1
    TERMINATE_REJECTED: _Final = 2
    TERMINATE_LOSE: _Final = 3
    TERMINATE_DROP: _Final = 4
    TERMINATE_EXCEPTION: _Final = 5
    terminate_status: int  # one of the constants above
    ignore_cancel: bool  # go on when asked to cancel
    result_text: str  # text of the result's status
    the_result: int  # put into the result
    is_simple_client: bool  # whether a simple client sent this
    delay_accept: _Duration  # time before the goal is accepted
    delay_terminate: _Duration  # time before it is terminated
    pause_status: _Duration  # time during which no status is published
    def __init__(
        self,
        terminate_status: int | None = None,
        ignore_cancel: bool | None = None,
        result_text: str | None = None,
        the_result: int | None = None,
        is_simple_client: bool | None = None,
        delay_accept: _Duration | float | None = None,
        delay_terminate: _Duration | float | None = None,
        pause_status: _Duration | float | None = None,
    ) -> None: ...

class TestRequestResult(_Message):
    the_result: int
    is_simple_server: bool
    def __init__(
        self,
        the_result: int | None = None,
        is_simple_server: bool | None = None,
    ) -> None: ...

class TestRequestFeedback(_Message):
    def __init__(self) -> None: ...

class TwoIntsAction(_Message):
    action_goal: TwoIntsActionGoal
    action_result: TwoIntsActionResult
    action_feedback: TwoIntsActionFeedback
    def __init__(
        self,
        action_goal: TwoIntsActionGoal | None = None,
        action_result: TwoIntsActionResult | None = None,
        action_feedback: TwoIntsActionFeedback | None = None,
    ) -> None: ...

class TwoIntsActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: TwoIntsGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: TwoIntsGoal | None = None,
    ) -> None: ...

class TwoIntsActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: TwoIntsResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: TwoIntsResult | None = None,
    ) -> None: ...

class TwoIntsActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: TwoIntsFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: TwoIntsFeedback | None = None,
    ) -> None: ...

class TwoIntsGoal(_Message):
    a: int
    b: int
    def __init__(
        self,
        a: int | None = None,
        b: int | None = None,
    ) -> None: ...

class TwoIntsResult(_Message):
    sum: int  # a + b
    def __init__(
        self,
        sum: int | None = None,
    ) -> None: ...

class TwoIntsFeedback(_Message):
    def __init__(self) -> None: ...
