"""ROS messages, services and actions as Python classes, from `.msg`, `.srv` and `.action` text.

    from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
    from actionlib_core.interfaces.std_srvs.srv import Trigger, TriggerResponse

Classes of ROS 2 are serialised as CDR and have a type hash as checksum; see the subpackage `ros2`:

    from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
    from actionlib_core.interfaces.ros2.geometry_msgs.msg import PoseStamped

All other classes have the bytes and checksums of ROS 1.

Your own definitions are files in ROS layout (`my_pkg/action/Turn.action`) in the folders that the
environment variable `SMACHPY_INTERFACE_PATH` lists or `add_path` was called with; `define_action`
and the like take their text directly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar, cast

from actionlib_core.exceptions import DeserializationError, FieldError, InterfaceError
from actionlib_core.interfaces._message import Message, Ros2Message
from actionlib_core.interfaces._modules import install as _install
from actionlib_core.interfaces._modules import install_ros_names
from actionlib_core.interfaces._registry import ServiceType, registry
from actionlib_core.interfaces._ros2 import ActionParts, Ros2Action, Ros2Service, ros2_registry

if TYPE_CHECKING:
    import os

    from actionlib_core.interfaces._sources import Kind

__all__ = [
    "DeserializationError",
    "FieldError",
    "InterfaceError",
    "Message",
    "Ros2Action",
    "Ros2Message",
    "Ros2Service",
    "ServiceType",
    "add_definition",
    "add_path",
    "define_action",
    "define_message",
    "define_service",
    "from_cdr",
    "get_action",
    "get_message",
    "get_service",
    "install_ros_names",
    "rihs01",
    "ros2_action",
    "to_cdr",
]

AnyMessage = TypeVar("AnyMessage", bound=Message)

_install()


def get_message(name: str) -> type[Message]:
    """Return a message class by its ROS name.

    Args:
        name: "move_base_msgs/MoveBaseGoal" or "move_base_msgs/msg/MoveBaseGoal".

    Raises:
        InterfaceError: Unknown, malformed, or it contains itself.
    """
    return registry.message(name)


def get_service(name: str) -> type[ServiceType]:
    """Return a service class by its ROS name, "std_srvs/Trigger" or "std_srvs/srv/Trigger".

    Raises:
        InterfaceError: As `get_message`.
    """
    return registry.service(name)


def get_action(name: str) -> type[Message]:
    """Return an action's class `XAction` by its ROS name.

    Args:
        name: "move_base_msgs/MoveBase", "move_base_msgs/action/MoveBase" or
            "move_base_msgs/MoveBaseAction".

    Raises:
        InterfaceError: As `get_message`.
    """
    return registry.action(name)


def define_message(name: str, text: str) -> type[Message]:
    """Define a message by its `.msg` text; from then on `get_message` and imports find it.

    Args:
        name: "my_pkg/Name".
        text: The contents of a `.msg` file.

    Raises:
        InterfaceError: Malformed text, or the name has another definition already.
    """
    return cast("type[Message]", registry.define("msg", name, text))


def define_service(name: str, text: str) -> type[ServiceType]:
    """Define a service by its `.srv` text; arguments and errors as `define_message`."""
    return cast("type[ServiceType]", registry.define("srv", name, text))


def define_action(name: str, text: str) -> type[Message]:
    """Define an action "my_pkg/Turn" by its `.action` text and return its class `TurnAction`.

    `TurnGoal` and the others are in `actionlib_core.interfaces.my_pkg.msg`. Arguments and errors as
    `define_message`.
    """
    return cast("type[Message]", registry.define("action", name, text))


def add_definition(kind: Kind, name: str, text: str, origin: str) -> None:
    """Register a definition, before or after those that it uses; an existing one is kept.

    It is parsed on first use, when its errors are raised too.

    Args:
        kind: "msg", "srv" or "action".
        name: "my_pkg/Name".
        text: The contents of a file of that kind.
        origin: The text's origin, for errors.

    Raises:
        InterfaceError: The name breaks the rules.
    """
    registry.add_definition(kind, name, text, origin)


def add_path(folder: str | os.PathLike[str]) -> None:
    """Search a folder in ROS layout before those known so far.

    Args:
        folder: Contains `my_pkg/{msg,srv,action}/Name.*`; it may also be the folder `my_pkg`.

    Raises:
        InterfaceError: No such folder, or no interfaces in it.
    """
    registry.add_path(folder)


def ros2_action(action: type[Ros2Action], distro: str | None = None) -> ActionParts:
    """Return the services and topics of a ROS 2 action: type names, hashes and message classes.

    Args:
        action: Its class, `nav2_msgs.action.NavigateToPose` for example.
        distro: The distribution whose definitions are used; None: that of the class.

    Raises:
        InterfaceError: The distribution does not define it.
    """
    found = ros2_registry(distro or action._distro)
    return found.parts(found.action(action._type))


def rihs01(message: type[Message] | str) -> str:
    """Return the ROS 2 type hash ("RIHS01_...") of a message class, or of ROS 1's by its ROS name.

    Raises:
        InterfaceError: Unknown, or ROS 2 cannot have such a type.
    """
    from actionlib_core.interfaces import _typesys

    cls = get_message(message) if isinstance(message, str) else message
    return cls._rihs01 if issubclass(cls, Ros2Message) else _typesys.rihs01(cls)


def to_cdr(message: Message) -> bytes:
    """Return a message's CDR serialisation, which ROS 2 uses; a `Header` loses its `seq`.

    Raises:
        FieldError: As `Message.to_bytes`.
        InterfaceError: ROS 2 defines the type, or one it uses, with other fields.
    """
    from actionlib_core.interfaces import _typesys

    return message.to_cdr() if isinstance(message, Ros2Message) else _typesys.to_cdr(message)


def from_cdr(cls: type[AnyMessage], data: bytes) -> AnyMessage:
    """Make a message from its little-endian CDR serialisation; a `Header` gets `seq` 0.

    Raises:
        DeserializationError: The bytes are not a message of this type.
        InterfaceError: As `to_cdr`.
    """
    from actionlib_core.interfaces import _typesys

    if issubclass(cls, Ros2Message):
        return cls.from_cdr(data)
    return cast("AnyMessage", _typesys.from_cdr(cls, data))
