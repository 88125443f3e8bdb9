"""One life cycle of a goal for the user: the states of ROS 2's actions in those of ROS 1's.

ROS 2 has six states and no text with them; a refused goal has none. What each side makes of the
other is two tables, from which the documentation draws its own.

Source:
    https://design.ros2.org/articles/actions.html, `action_msgs/msg/GoalStatus`.
"""

from __future__ import annotations

from enum import IntEnum

from actionlib_core.goal.states import Status


class GoalCode(IntEnum):
    """Where a goal is at a ROS 2 server (action_msgs/msg/GoalStatus)."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class CancelCode(IntEnum):
    """What a ROS 2 server answers to a cancel (action_msgs/srv/CancelGoal)."""

    NONE = 0
    """No error: the goals in the list are canceling."""
    REJECTED = 1
    UNKNOWN_GOAL = 2
    GOAL_TERMINATED = 3
    """It has ended, or is canceling already."""


ENDED = frozenset({GoalCode.SUCCEEDED, GoalCode.CANCELED, GoalCode.ABORTED})

TO_STATUS = {
    GoalCode.UNKNOWN: Status.LOST,
    GoalCode.ACCEPTED: Status.PENDING,
    GoalCode.EXECUTING: Status.ACTIVE,
    GoalCode.CANCELING: Status.PREEMPTING,
    GoalCode.SUCCEEDED: Status.SUCCEEDED,
    GoalCode.CANCELED: Status.PREEMPTED,
    GoalCode.ABORTED: Status.ABORTED,
}
"""What a client sees of a goal that has been executing."""

TO_STATUS_NEVER_ACTIVE = {
    **TO_STATUS,
    GoalCode.CANCELING: Status.RECALLING,
    GoalCode.CANCELED: Status.RECALLED,
}
"""What it sees of one of which it knows that it has not."""

TO_CODE = {
    Status.PENDING: GoalCode.ACCEPTED,
    Status.ACTIVE: GoalCode.EXECUTING,
    Status.PREEMPTED: GoalCode.CANCELED,
    Status.SUCCEEDED: GoalCode.SUCCEEDED,
    Status.ABORTED: GoalCode.ABORTED,
    Status.REJECTED: GoalCode.ABORTED,  # accepted before: a refusal at once has no state at all
    Status.PREEMPTING: GoalCode.CANCELING,
    Status.RECALLING: GoalCode.CANCELING,
    Status.RECALLED: GoalCode.CANCELED,
    Status.LOST: GoalCode.UNKNOWN,
}
"""What a server here shows of its goal to ROS 2."""


def to_status(code: int, *, was_active: bool) -> Status:
    """Return the status of a goal in a state of ROS 2.

    Args:
        code: See `GoalCode`; other numbers count as unknown.
        was_active: The goal has been executing, or nobody knows that it has not.
    """
    table = TO_STATUS if was_active else TO_STATUS_NEVER_ACTIVE
    return table.get(code, Status.LOST)  # type: ignore[call-overload, no-any-return]  # an int is equal to its member


def to_code(status: int) -> GoalCode:
    """Return the state of ROS 2 that stands for a status."""
    return TO_CODE[Status(status)]


def draw_tables() -> str:
    """Return the tables in Markdown, as `docs/ros2_servers.md` shows them."""
    lines = [
        "| ROS 2 | a client here sees | when it has never run | a server here is |",
        "| --- | --- | --- | --- |",
        "| refused (`accepted=false`) | `REJECTED` | `REJECTED` | `REJECTED` at once |",
    ]
    for code in GoalCode:
        shown = [f"`{status.name}`" for status, other in TO_CODE.items() if other is code]
        seen, never = TO_STATUS[code].name, TO_STATUS_NEVER_ACTIVE[code].name
        lines.append(
            f"| {code.value} {code.name.lower()} | `{seen}` | `{never}` | {', '.join(shown)} |"
        )
    return "\n".join(lines) + "\n"


def reason_of(result: object) -> str:
    """Return what a result says about why its goal has failed, "" where its type does not.

    ROS 2 has no text beside a status. Nav2's results have `error_msg` and `error_code`, those of
    controllers `error_string`.
    """
    text = getattr(result, "error_msg", "") or getattr(result, "error_string", "")
    code = getattr(result, "error_code", 0)
    words = [text] if isinstance(text, str) and text else []
    if isinstance(code, int) and code:
        words.append(f"(error code {code})" if words else f"error code {code}")
    return " ".join(words)


def give_reason(result: object, text: str) -> bool:
    """Write into a result why its goal has failed, where its type has room and nobody did.

    Returns:
        Whether it was written; `reason_of` finds it then.
    """
    for name in ("error_msg", "error_string"):
        if getattr(result, name, None) == "":
            setattr(result, name, text)
            return True
    return False
