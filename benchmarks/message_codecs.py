"""Time to write and read a MoveBaseActionGoal: the generated codecs here beside those of rosbags.

python benchmarks/message_codecs.py [--json]
"""

from __future__ import annotations

import argparse
import json
import timeit
from typing import TYPE_CHECKING

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseActionGoal

if TYPE_CHECKING:
    from collections.abc import Callable

NAME = "move_base_msgs/msg/MoveBaseActionGoal"
CALLS = 20_000
ROUNDS = 7


def micros(*functions: Callable[[], object]) -> list[float]:
    """Best of several rounds of each function, the rounds interleaved [us per call]."""
    best = [float("inf")] * len(functions)
    for _ in range(ROUNDS):
        for i, function in enumerate(functions):
            best[i] = min(best[i], timeit.timeit(function, number=CALLS) / CALLS * 1e6)
    return best


def main() -> None:
    """Print one line per direction."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    store = get_typestore(Stores.ROS1_NOETIC)
    types = get_types_from_msg(
        "geometry_msgs/PoseStamped target_pose", "move_base_msgs/msg/MoveBaseGoal"
    )
    types |= get_types_from_msg(
        "Header header\nactionlib_msgs/GoalID goal_id\nmove_base_msgs/MoveBaseGoal goal", NAME
    )
    store.register(types)
    goal = MoveBaseActionGoal()
    goal.goal_id.id = "/patrol-3-1700000000.250"
    goal.goal.target_pose.header.frame_id = "map"
    goal.goal.target_pose.pose.orientation.w = 1.0
    data = goal.to_bytes()
    theirs = store.deserialize_ros1(data, NAME)
    ours_w, rosbags_w, ours_r, rosbags_r = micros(
        goal.to_bytes,
        lambda: store.serialize_ros1(theirs, NAME),
        lambda: MoveBaseActionGoal.from_bytes(data),
        lambda: store.deserialize_ros1(data, NAME),
    )
    if args.json:
        ratios = {"write / rosbags": ours_w / rosbags_w, "read / rosbags": ours_r / rosbags_r}
        print(json.dumps({"write us": ours_w, "read us": ours_r, **ratios}))
        return
    print(f"{len(data)} bytes")
    print(f"write  {ours_w:5.2f} us   rosbags {rosbags_w:5.2f} us   ratio {ours_w / rosbags_w:.2f}")
    print(f"read   {ours_r:5.2f} us   rosbags {rosbags_r:5.2f} us   ratio {ours_r / rosbags_r:.2f}")


if __name__ == "__main__":
    main()
