"""ROS 2's message, service and action classes, with the definitions of a distribution.

    from actionlib_core.interfaces.ros2.geometry_msgs.msg import PoseStamped
    from actionlib_core.interfaces.ros2.std_srvs.srv import SetBool
    from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose

    goal = NavigateToPose.Goal(pose=PoseStamped(header={"frame_id": "map"}))

Packages that only ROS 2 has, and the module `action` of every package, can also be imported without
`ros2`. Distributions define some types differently. The default is `SMACHPY_ROS2_DISTRO`, or
"jazzy"; `set_default_distro` changes it for classes that are looked up later.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces._ros2 import (
    DISTROS,
    NO_HASH,
    ActionParts,
    Ros2Action,
    Ros2Service,
    ServiceParts,
    TopicParts,
    default_distro,
    ros2_registry,
    set_default_distro,
)

if TYPE_CHECKING:
    from actionlib_core.interfaces._message import Ros2Message

__all__ = [
    "DISTROS",
    "NO_HASH",
    "ActionParts",
    "Ros2Action",
    "Ros2Service",
    "ServiceParts",
    "TopicParts",
    "default_distro",
    "distros_of",
    "get_action",
    "get_message",
    "get_service",
    "hash_of",
    "is_defined",
    "set_default_distro",
]


def get_message(name: str, distro: str | None = None) -> type[Ros2Message]:
    """Return a message class by name, "geometry_msgs/msg/Pose" or "geometry_msgs/Pose".

    Args:
        name: Parts of services and actions have names too: "nav2_msgs/action/Spin_Goal",
            "nav2_msgs/action/Spin_SendGoal_Request", "std_srvs/srv/SetBool_Request".
        distro: The distribution; None: the default.

    Raises:
        InterfaceError: Unknown there, or malformed.
    """
    return ros2_registry(distro).message(name)


def get_service(name: str, distro: str | None = None) -> type[Ros2Service]:
    """Return a service class, with its `Request` and `Response`; as `get_message`."""
    found: type[Ros2Service] = ros2_registry(distro).service(name)
    return found


def get_action(name: str, distro: str | None = None) -> type[Ros2Action]:
    """Return an action class, with its `Goal`, `Result` and `Feedback`; as `get_message`."""
    found: type[Ros2Action] = ros2_registry(distro).action(name)
    return found


def hash_of(name: str, distro: str | None = None) -> str:
    """Return the hash of a type, by its name in keys and tokens; see `distros_of`.

    Raises:
        InterfaceError: The distribution does not define it.
    """
    return ros2_registry(distro).hash(name)


def distros_of(name: str, type_hash: str) -> list[str]:
    """Return the distributions in which a type has the given hash.

    Args:
        name: As in keys and tokens: "nav2_msgs/action/NavigateToPose_SendGoal",
            "std_srvs/srv/SetBool", "nav_msgs/msg/Odometry".
        type_hash: "RIHS01_...".
    """
    found = []
    for distro in DISTROS:
        registry = ros2_registry(distro)
        try:
            if registry.defines(name) and registry.hash(name) == type_hash:
                found.append(distro)
        except InterfaceError:  # a definition of the user's is wrong
            continue
    return found


def is_defined(name: str, distro: str | None = None) -> bool:
    """Return whether a distribution defines a type, by its name in keys and tokens."""
    return ros2_registry(distro).defines(name)
