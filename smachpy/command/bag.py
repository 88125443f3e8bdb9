"""Plays a bag during a run: `smachpy run MISSION --bag drive.mcap`."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces.bags import read_bag
from actionlib_core.node import Node, get_node
from actionlib_core.pubsub.topic import Publisher
from smachpy.base import log
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from actionlib_core.interfaces.bags import BagMessage


@contextlib.contextmanager
def playing(path: Path | None) -> Iterator[None]:
    """Publish the messages of a bag on the run's clock, from now on and within this block.

    Its topics are relative to the mission's namespace, and remapped as the mission's names are.

    Raises:
        MissionError: the bag cannot be read.
    """
    if path is None:
        yield
        return
    mission = get_node()
    # A node of its own: the mission has not published these.
    node = Node(
        "bag",
        transport=mission.transport,
        clock=mission.clock,
        namespace=mission.namespace,
        arguments=mission.arguments,
    )
    messages = read_bag(path)
    try:
        first = next(messages, None)
    except ActionlibError as error:
        raise MissionError(str(error)) from error
    end = node.clock.event("the end of the bag")
    task = node.clock.spawn(lambda: _play(node, first, messages, end), name="the bag")
    try:
        yield
    finally:
        end.set()
        task.join()
        node.close()


def _play(node: Node, first: BagMessage | None, rest: Iterator[BagMessage], end: Any) -> None:
    begun, publishers = node.clock.now(), dict[str, Publisher]()
    one = first
    try:
        while one is not None:
            if end.wait(max(0.0, begun + one.at - node.clock.now())):
                return
            if one.topic not in publishers:
                publishers[one.topic] = Publisher(one.topic, type(one.message), node=node)
            publishers[one.topic].publish(one.message)
            one = next(rest, None)
    except ActionlibError as error:
        log.logwarn(f"the bag ends here: {error}")
