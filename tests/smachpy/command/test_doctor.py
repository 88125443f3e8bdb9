"""`smachpy doctor --ros2` at a robot in memory, and at a router that is not there."""

from __future__ import annotations

import json

import pytest

from actionlib_core.config import Config, Ros2
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.ros2.attachment import answer_to, unpack_attachment
from actionlib_core.wire.ros2.graph import RosNode, RosType
from actionlib_core.wire.ros2.names import Kind
from smachpy.command import doctor, main
from smachpy.command.doctor import look_at
from smachpy.durable.opening import open_store
from tests.free_port import free_port
from tests.ros2_server import Ros2Server

GET_PARAMETERS = "rcl_interfaces/srv/GetParameters"


@pytest.mark.parametrize(("behind_s", "clock_is"), [(0.0, "ok"), (3.0, "problem")])
def test_a_robot_that_is_well_but_for_its_clock(clock, behind_s, clock_is):
    network = MemoryNetwork(clock)
    session, mine = network.session(), network.session()
    server = Ros2Server(session, clock, "fib", Fibonacci)
    service = ros2.get_service(GET_PARAMETERS)
    node = RosNode(session, clock, domain=0, full_name="nav")
    end = node.end(Kind.SERVICE, "nav/get_parameters", RosType(GET_PARAMETERS, service._rihs01))
    asked = []

    def answer(query):
        asked.append(service.Request.from_cdr(query.payload).names)
        time_ns = clock.time_ns() - int(behind_s * 1e9)
        attachment = answer_to(unpack_attachment(query.attachment), time_ns)
        query.reply(service.Response().to_cdr(), attachment=attachment)
        query.finish()

    declared = session.queryable(end.key, answer, complete=True)
    end.show()
    settings = Ros2()
    with Node("doctor", transport=mine, clock=clock, config=Config(ros2=(settings,))) as here:
        found = {finding.what: finding.level.value for finding in look_at(here, settings)}
    assert found == {
        **dict.fromkeys(("router", "nodes", "types", "actions", "answers"), "ok"),
        "clock": clock_is,
    }
    assert asked == [[]]
    for entry in (declared, end, server, session, mine):
        entry.close()


@pytest.mark.slow
def test_a_router_that_is_not_there(capsys, monkeypatch):
    monkeypatch.delenv("SMACHPY_CONFIG", raising=False)
    monkeypatch.setenv("SMACHPY_ROS2", f"tcp/127.0.0.1:{free_port()}")
    assert main(["doctor", "--json"]) == 1
    (found,) = json.loads(capsys.readouterr().out)
    assert (found["level"], found["what"]) == ("problem", "router")


def test_no_robot_is_named(capsys, monkeypatch):
    monkeypatch.delenv("SMACHPY_CONFIG", raising=False)
    monkeypatch.delenv("SMACHPY_ROS2", raising=False)
    assert main(["doctor"]) == 2
    assert "--ros2" in capsys.readouterr().err


def test_the_size_of_a_journal_is_told(tmp_path, monkeypatch, capsys):
    place = str(tmp_path / "journal.db")
    open_store(place).close()
    assert main(["doctor", "--durable", place]) == 0
    assert capsys.readouterr().out.startswith(f"ok       journal  {place}: 0 missions, ")
    monkeypatch.setattr(doctor, "LARGE_JOURNAL", 1)
    assert main(["doctor", "--durable", place, "--json"]) == 0
    (finding,) = json.loads(capsys.readouterr().out)
    assert (finding["level"], finding["what"]) == ("note", "journal")
    assert "missions prune" in finding["way_out"]
    assert main(["doctor", "--durable", str(tmp_path / "none.db")]) == 2
