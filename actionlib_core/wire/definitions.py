"""Definitions of message types over the network, for subscribers that do not have them.

A bridge passes on messages of types that it does not know. It answers queries on
`@smachpy_definition/<pkg>/<Type>/<md5>` with the text of the type: the `.msg` text, followed by
that of each nested type after a line of `=` and a line `MSG: pkg/Type`, the format of ROS 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core.exceptions import InterfaceError

if TYPE_CHECKING:
    from actionlib_core.interfaces import Message
    from actionlib_core.node import Node
    from actionlib_core.transport import Reply

ROOT = "@smachpy_definition"
LARGEST = 1 << 20  # larger replies are ignored [bytes]
ASK_S = 1.0  # longest wait for a reply
_LINE = "=" * 80
_NAME = "MSG: "


def definition_key(type_name: str, md5: str) -> str:
    """Return the key of queries for the text of a type."""
    return f"{ROOT}/{type_name}/{md5}"


def split_definition(type_name: str, text: str) -> dict[str, str]:
    """Return the texts of the nested types and of the type itself, by name, in this order.

    The nested types come last in the text, but must be defined first.
    """
    first, *rest = text.split(f"{_LINE}\n")
    texts = {}
    for part in reversed(rest):
        line, _, body = part.partition("\n")
        if line.startswith(_NAME):
            texts[line.removeprefix(_NAME).strip()] = body
    texts[type_name] = first
    return texts


def define(type_name: str, md5: str, text: str) -> type[Message]:
    """Make the class of a type from its text; types that are already known here are reused.

    Raises:
        InterfaceError: the text is malformed, or a type has another definition here.
    """
    from actionlib_core.interfaces import define_message, get_message

    for name, part in split_definition(type_name, text).items():
        try:
            get_message(name)
        except InterfaceError:
            define_message(name, part)
    made = get_message(type_name)
    if made._md5sum != md5:
        raise InterfaceError(
            f"{type_name}: got the checksum {made._md5sum}; expected {md5}, as its publisher has. "
            "Try the same definition here as there."
        )
    return made


def ask_definition(node: Node, type_name: str, md5: str) -> str | None:
    """Query the network for the text of a type; None when there is no reply.

    Blocks: `ASK_S` at most.
    """
    replies: list[Reply] = []
    done = node.clock.event(f"the definition of {type_name}")
    asking = node.transport.query(
        definition_key(type_name, md5),
        b"",
        timeout=ASK_S,
        on_reply=replies.append,
        on_done=done.set,
    )
    done.wait(ASK_S)
    asking.close()
    texts = (reply.payload for reply in replies if not reply.error)
    return next((raw.decode(errors="replace") for raw in texts if len(raw) <= LARGEST), None)
