"""The goal states of ROS 2 and of ROS 1, translated into each other.

Users see the statuses of ROS 1 on both wires. ROS 2 has six states without a text; a refused goal
has no state at all. The tables of the documentation are made from those here.

Source:
    https://design.ros2.org/articles/actions.html, `action_msgs/msg/GoalStatus`.
"""

from __future__ import annotations

from enum import IntEnum

from actionlib_core.goal.states import Status


class GoalCode(IntEnum):
    """The state of a goal at a ROS 2 server (action_msgs/msg/GoalStatus)."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class CancelCode(IntEnum):
    """The answer of a ROS 2 server to a cancel request (action_msgs/srv/CancelGoal)."""

    NONE = 0
    """No error: the listed goals are canceling."""
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
"""The status at a client here of a goal that has been executing, or may have been."""

TO_STATUS_NEVER_ACTIVE = {
    **TO_STATUS,
    GoalCode.CANCELING: Status.RECALLING,
    GoalCode.CANCELED: Status.RECALLED,
}
"""The status at a client here of a goal that is known not to have been executing."""

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
"""The state in which a server here shows its goal to ROS 2."""


def to_status(code: int, *, was_active: bool) -> Status:
    """Return the status of a goal in a state of ROS 2.

    Args:
        code: See `GoalCode`; other numbers count as unknown.
        was_active: False only when it is known that the goal has not been executing.
    """
    table = TO_STATUS if was_active else TO_STATUS_NEVER_ACTIVE
    return table.get(code, Status.LOST)  # type: ignore[call-overload, no-any-return]  # an int is equal to its member


def to_code(status: int) -> GoalCode:
    """Return the state of ROS 2 for a status."""
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
    """Return the reason for a goal's failure from its result; "" when its type has no such field.

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
    """Write the reason for a goal's failure into its result, if there is an empty field for it.

    Returns:
        Whether it was written; `reason_of` reads it.
    """
    for name in ("error_msg", "error_string"):
        if getattr(result, name, None) == "":
            setattr(result, name, text)
            return True
    return False
