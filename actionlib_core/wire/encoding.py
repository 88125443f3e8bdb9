"""The encoding of a message on the wire, which contains its type and checksum.

`ros1/move_base_msgs/MoveBaseActionGoal;md5=660d6895a1b9a16dce51fbdd9a64a56b` means: the payload is
of that type, serialised as in ROS 1, with a definition that has this checksum.
"""

from __future__ import annotations

from functools import lru_cache
from typing import ClassVar, NamedTuple, Protocol

from actionlib_core.exceptions import TypeMismatchError

ROS1 = "ros1"


class Typed(Protocol):
    """A message, service or action class."""

    _type: ClassVar[str]
    _md5sum: ClassVar[str]


class Encoding(NamedTuple):
    """A parsed encoding.

    Attributes:
        format: The serialisation, "ros1".
        type: "pkg/Type".
        md5: Checksum of the definition; "" when it is missing.
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
    """Parse an encoding; missing parts are ""."""
    front, _, schema = encoding.partition(";")
    form, _, type_name = front.partition("/")
    return Encoding(form, type_name, schema.removeprefix("md5=") if schema else "")


def check_encoding(
    encoding: str, message_class: type[Typed], *, name: str, sender: str = ""
) -> None:
    """Check that a class can read a payload.

    An empty encoding is accepted unchecked.

    Args:
        encoding: The payload's encoding.
        message_class: The class that is to read the payload.
        name: The topic, service or action, for the error text.
        sender: The sender, for the error text.

    Raises:
        TypeMismatchError: the types or checksums differ; the error names both.
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
