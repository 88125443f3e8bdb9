"""How a message says on the wire what it is: type and checksum in the encoding.

`ros1/move_base_msgs/MoveBaseActionGoal;md5=660d6895a1b9a16dce51fbdd9a64a56b` reads: the payload is
that type, serialised as ROS 1 does, from a definition with that checksum.
"""

from __future__ import annotations

from functools import lru_cache
from typing import ClassVar, NamedTuple, Protocol

from actionlib_core.exceptions import TypeMismatchError

ROS1 = "ros1"


class Typed(Protocol):
    """What a message, service or action class tells of itself."""

    _type: ClassVar[str]
    _md5sum: ClassVar[str]


class Encoding(NamedTuple):
    """An encoding taken apart.

    Attributes:
        format: How the payload is serialised, "ros1".
        type: "pkg/Type".
        md5: Checksum of the definition; "" when the sender did not say.
    """

    format: str
    type: str
    md5: str


@lru_cache(maxsize=4096)
def make_encoding(type_name: str, md5: str) -> str:
    """Return the encoding of a type."""
    return f"{ROS1}/{type_name};md5={md5}"


def encoding_of(message_class: type[Typed]) -> str:
    """Return the encoding of the messages of a class."""
    return make_encoding(message_class._type, message_class._md5sum)


def parse_encoding(encoding: str) -> Encoding:
    """Take an encoding apart; what is missing is ""."""
    front, _, schema = encoding.partition(";")
    form, _, type_name = front.partition("/")
    return Encoding(form, type_name, schema.removeprefix("md5=") if schema else "")


def check_encoding(
    encoding: str, message_class: type[Typed], *, name: str, sender: str = ""
) -> None:
    """Check that a payload is what a class reads. An encoding of "" is taken on trust.

    Args:
        encoding: As it came with the payload.
        message_class: Reads the payload.
        name: The topic, service or action, for the error text.
        sender: Who sent it, for the error text.

    Raises:
        TypeMismatchError: it is something else; the error names both types and checksums.
    """
    if not encoding or encoding == encoding_of(message_class):
        return
    found = parse_encoding(encoding)
    found_type = found.type if found.format == ROS1 else encoding
    raise TypeMismatchError(
        name,
        (message_class._type, message_class._md5sum),
        (found_type, found.md5),
        by=sender,
    )
