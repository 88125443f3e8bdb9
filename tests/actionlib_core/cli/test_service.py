"""`actionlib service`, over the network in memory."""

from __future__ import annotations

import io
import json
import sys

import pytest

from actionlib_core.cli import main
from actionlib_core.interfaces.std_srvs.srv import SetBool, Trigger
from actionlib_core.pubsub.service import Service

NODES = ("cli", "robot")


@pytest.fixture
def cli(nodes):
    return lambda *words: main(["service", *words], node=nodes[0])


@pytest.fixture
def grip(nodes):
    return Service("grip", SetBool, lambda r: (r.data, "done"), node=nodes[1])


def test_list_and_type(cli, grip, nodes, capsys):
    Service("arm/reset", Trigger, print, node=nodes[1])
    assert cli("list") == 0
    assert capsys.readouterr().out == "/arm/reset\n/grip\n"
    cli("list", "-t")
    assert "/grip [std_srvs/srv/SetBool]" in capsys.readouterr().out
    cli("list", "-c")
    assert capsys.readouterr().out == "2\n"
    cli("list", "--json")
    assert json.loads(capsys.readouterr().out)[1] == {
        "name": "/grip", "type": "std_srvs/srv/SetBool",
    }  # fmt: skip
    cli("type", "grip")
    assert capsys.readouterr().out == "std_srvs/srv/SetBool\n"


@pytest.mark.parametrize("type_", [[], ["std_srvs/SetBool"], ["std_srvs/srv/SetBool"]])
def test_call(cli, grip, capsys, type_):
    assert cli("call", "/grip", *type_, "{data: true}") == 0
    assert capsys.readouterr().out.splitlines() == [
        "waiting for service to become available...",
        "requester: making request: SetBoolRequest(data=True)", "",
        "response:", "SetBoolResponse(success=True, message='done')", "",
    ]  # fmt: skip


def test_call_without_request_sends_the_defaults(cli, grip, capsys):
    assert cli("call", "grip", "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"success": False, "message": "done"}


def test_call_reads_standard_input(cli, grip, capsys, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.StringIO("data: true\n"))
    assert cli("call", "grip", "--stdin", "--json") == 0
    assert json.loads(capsys.readouterr().out)["success"] is True


def test_bad_input_is_told_with_exit_code_2(cli, grip, capsys):
    for words, text in (
        (
            ("call", "nope", "{}"),
            "service '/nope': not there within 10 s; expected one of ['/grip']",
        ),
        (("call", "nope", "std_srvs/SetBool", "--timeout", "1"), "no server: got none in 1 s"),
        (("call", "grip", "std_srvs/Trigger"), "types differ"),
        (("call", "grip", "{date: 1}"), "date"),
        (("call", "grip", "std_srvs/SetBool", "{}", "more"), "at most two words"),
        (("call", "grip", "{}", "--stdin"), "got '{}' beside --stdin"),
        (("type", "nope"), "not there"),
    ):
        assert cli(*words) == 2, words
        assert text in capsys.readouterr().err


def test_handlers_error_is_shown(cli, nodes, capsys):
    def handler(request):
        raise ValueError("the gripper is open")

    Service("grip", SetBool, handler, node=nodes[1])
    assert cli("call", "grip", "{}") == 1
    assert "the handler raised ValueError: the gripper is open" in capsys.readouterr().err
