"""The texts of the types that a bridge meets."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from actionlib_core.exceptions import InterfaceError
from actionlib_core.wire.definitions import ask_definition, definition_key

if TYPE_CHECKING:
    from actionlib_core.node import Node
    from actionlib_core.ros1.sides import Typed
    from actionlib_core.transport import Closable, Query

MAX_TYPES = 2000  # a robot has a few hundred; limited, as a node can send types without end


class Definitions:
    """Definitions of types: this program's, those learned in ROS 1, and those of other programs.

    Programs on our network can query the definitions that were learned in ROS 1.

    Threads: any.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._texts: dict[Typed, str] = {}
        self._offers: list[Closable] = []
        self._closed = False

    def learn(self, typed: Typed, text: str) -> None:
        """Keep the definition in a connection header of ROS 1; "" when it has none."""
        with self._lock:
            full = len(self._texts) >= MAX_TYPES
            if not text or typed in self._texts or full or self._closed:
                return
            self._texts[typed] = text
        raw = text.encode()

        def answer(query: Query) -> None:
            query.reply(raw)
            query.finish()

        offer = self._node.transport.queryable(definition_key(*typed), answer)
        with self._lock:
            self._offers.append(offer)

    def text(self, typed: Typed) -> str:
        """Return the definition of a type, "" when it is unknown; blocks 1 s at most."""
        from actionlib_core.interfaces import get_message

        if typed in self._texts:
            return self._texts[typed]
        try:
            known = get_message(typed.type)
        except InterfaceError:
            return ask_definition(self._node, *typed) or ""
        return str(known._full_text) if known._md5sum == typed.md5 else ""

    def close(self) -> None:
        """Answer no more queries."""
        with self._lock:
            self._closed = True
            offers = list(self._offers)
        for offer in offers:
            offer.close()
