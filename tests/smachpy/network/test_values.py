"""Values of userdata, whole, for those who watch."""

from __future__ import annotations

import pytest

from actionlib_core.interfaces.geometry_msgs.msg import Point
from actionlib_core.node import Node
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import CBState, StateMachine
from smachpy.network.values import (
    MAX_VALUE_LENGTH,
    VALUE_SERVICE,
    ReadValue,
    serve_values,
    value_text,
)


class Mute:
    def __repr__(self):
        raise RuntimeError("no")


@pytest.fixture
def ask(clock):
    inner = StateMachine(outcomes=["done"])
    with inner:
        StateMachine.add("LEAF", CBState(lambda _: "done", outcomes=["done"]))
    sm = StateMachine(outcomes=["done"], name="JOB")
    with sm:
        StateMachine.add("A B", inner)  # a label may hold any other character
    sm.userdata.long = "x" * 10_000
    sm.userdata.mute = Mute()
    inner.userdata.where = Point(1.0, 2.0, 3.0)
    network = MemoryNetwork(clock)
    with (
        Node("robot", transport=network.session(), clock=clock) as robot,
        Node("viewer", transport=network.session(), clock=clock) as viewer,
    ):
        server = serve_values("/job", sm, "/SHOWN", robot)
        proxy = ServiceProxy("/job" + VALUE_SERVICE, ReadValue, node=viewer)
        yield lambda container, key: proxy(container, key)
        proxy.close()
        server.close()


def test_values_are_whole(ask):
    answer = ask("/SHOWN", "long")
    assert (answer.success, len(answer.text)) == (True, 10_000)
    assert ask("/SHOWN/A B", "where").text == "x: 1.0\ny: 2.0\nz: 3.0"


def test_what_cannot_be_told_says_why(ask):
    assert ask("/SHOWN/C", "long").text == "/SHOWN/C: no such container; expected one of /SHOWN."
    assert ask("/SHOWN/A B/LEAF", "x").success is False
    assert ask("/SHOWN", "gone").text == "/SHOWN: 'gone' is not there any more."
    assert ask("/SHOWN", "mute").text == "Mute: its repr raised RuntimeError: no"


def test_texts_are_as_people_read_them_and_end_somewhere():
    assert value_text("plain") == "plain"
    assert value_text({"b": [1, 2]}) == "{'b': [1, 2]}"
    assert value_text("x" * (MAX_VALUE_LENGTH + 5)).endswith("\n... 5 characters more")
