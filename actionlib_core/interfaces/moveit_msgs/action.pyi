# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.moveit_msgs.action import (
    ExecuteTrajectory as ExecuteTrajectory,
    ExecuteTrajectory_Goal as ExecuteTrajectory_Goal,
    ExecuteTrajectory_Result as ExecuteTrajectory_Result,
    ExecuteTrajectory_Feedback as ExecuteTrajectory_Feedback,
    MoveGroup as MoveGroup,
    MoveGroup_Goal as MoveGroup_Goal,
    MoveGroup_Result as MoveGroup_Result,
    MoveGroup_Feedback as MoveGroup_Feedback,
)
