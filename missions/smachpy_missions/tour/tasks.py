"""The tasks at a waypoint: a photo, a turn, waiting for a service."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
from actionlib_core.interfaces.std_srvs.srv import Trigger
from smachpy import MonitorState, ServiceState, SimpleActionState, State, StateMachine, UserData
from smachpy.states import SIGNAL_TIMEOUT, TURN_TIMEOUT, Pose2D, goal_at, locate

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
    from actionlib_core.interfaces.std_srvs.srv import TriggerResponse
    from smachpy.places.occupancy import OccupancyMap
    from smachpy_missions.tour.tour_file import Stop, Task

SERVICE_TIMEOUT = 60.0  # [s] to find a waypoint's service and get its answer


def choose_task(userdata: UserData) -> str:
    """Return the label of the state for the waypoint's task, as an outcome."""
    return task_label(userdata.waypoint.task)


def task_label(task: Task | None) -> str:
    """Return the label of a task's state: 'PHOTO', 'TURN', 'WAIT_FOR_LOADED'."""
    if task is None:
        return "nothing"
    service = re.sub(r"\W", "_", task.service)
    return (f"wait_for_{service}" if service else task.kind).upper()


def task_states(
    waypoints: Iterable[Stop], photos: Path, grid: OccupancyMap | None
) -> dict[str, State]:
    """Return one state for each different task of the waypoints, by label."""
    states: dict[str, State] = {}
    for waypoint in waypoints:
        task, label = waypoint.task, task_label(waypoint.task)
        if task is None or label in states:
            continue
        if task.kind == "photo":
            states[label] = photo(photos, grid)
        elif task.kind == "turn":
            states[label] = turn()
        else:
            states[label] = wait_for_service(task.service)
    return states


def photo(folder: Path, grid: OccupancyMap | None) -> StateMachine:
    """Save a picture of what the robot's scanner sees."""

    def shoot(userdata: UserData, scan: LaserScan) -> bool:
        from smachpy_missions.tour.photo import save_photo

        number, name = userdata.done + 1, userdata.waypoint.name
        path = folder / f"{number:02}_{re.sub(r'[^A-Za-z0-9]+', '_', name)}.png"
        save_photo(path, scan, userdata.here, grid, f"{number} {name}")
        return True

    sm = StateMachine(["succeeded", "aborted", "preempted"], input_keys=["waypoint", "done"])
    with sm:
        sm.add("LOCATE", locate(), {"valid": "SHOOT", "invalid": "aborted"})
        sm.add(
            "SHOOT",
            MonitorState(
                "scan",
                LaserScan,
                shoot,
                max_checks=1,
                input_keys=["waypoint", "done", "here"],
                timeout=SIGNAL_TIMEOUT,
            ),
            {"valid": "succeeded", "invalid": "aborted"},
        )
    return sm


def turn() -> SimpleActionState:
    """Turn on the spot by the waypoint's angle."""

    def turn_goal(userdata: UserData, _default: MoveBaseGoal) -> MoveBaseGoal:
        angle = math.radians(userdata.waypoint.task.angle)
        return goal_at(Pose2D(0.0, 0.0, angle), frame="base_link")

    return SimpleActionState(
        "move_base",
        MoveBaseAction,
        goal_cb=turn_goal,
        input_keys=["waypoint"],
        exec_timeout=TURN_TIMEOUT,
    )


def wait_for_service(service: str) -> ServiceState:
    """Call a service at the waypoint; succeed if its answer says success."""

    def verdict(_userdata: UserData, response: TriggerResponse) -> str:
        return "succeeded" if response.success else "aborted"

    return ServiceState(service, Trigger, response_cb=verdict, timeout=SERVICE_TIMEOUT)
