"""Secrets, by their type and by their name, are in no record, journal, page, log or error."""

from __future__ import annotations

import contextlib
import copy
import io
import json
import logging
import pickle
import re
import subprocess
import sys
import traceback
from collections import OrderedDict, UserDict, UserList, defaultdict, deque
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import NamedTuple

import pytest
from rich.console import Console

import smachpy
from actionlib_core.interfaces import define_message
from actionlib_core.interfaces.geometry_msgs.msg import Point
from smachpy import Secret, StateMachine, describe
from smachpy.command import main
from smachpy.command.targets import Target
from smachpy.durable.opening import open_store
from smachpy.events import to_record
from smachpy.network.values import value_text
from smachpy.userdata.json_text import dumps, encoded
from smachpy.userdata.secret import holds_secret, is_secret_name, masked, masked_words
from smachpy.userdata.shown import Room, shown
from smachpy.userdata.user_data import Remapper, UserData
from smachpy_viz import TerminalView

PASSWORD = "hunter2"

MISSION = """
import smachpy


@smachpy.state(outcomes=["done"], input_keys=["login"], output_keys=["login", "found", "wifi_password"])
def work(userdata):
    word = userdata.login.reveal()
    userdata.found = {"user": "ann", "api_key": word, "list": [{"token": word}]}
    return "done"


@smachpy.state(outcomes=["done"], input_keys=["login", "found"])
def check(userdata):
    assert len(userdata.login.reveal()) == 7
    return "done"


@smachpy.mission(secrets=["door_code"])
def mission(password: smachpy.Secret, door_code: str = "", pin: int = 0):
    machine = smachpy.StateMachine(["done"], name="M")
    machine.userdata.login = password
    machine.add("A", work, {"done": "B"})
    machine.add("B", check)
    return machine
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    Path("mission.py").write_text(MISSION)
    Path("secret.txt").write_text(f"{PASSWORD}\nsecond line\n")
    return tmp_path


def plain(text):
    """The mission without secrets inside of other values."""
    return re.sub("userdata.found = .*", "userdata.found = {}", text)


def written(folder, *, leave=("mission.py", "secret.txt")):
    """The files in which the secret stands."""
    paths = [path for path in folder.rglob("*") if path.is_file() and path.name not in leave]
    return [str(path) for path in paths if PASSWORD.encode() in path.read_bytes()]


def test_a_secret_is_a_text_that_shows_nothing():
    secret = Secret(PASSWORD)
    assert secret.reveal() == PASSWORD
    assert {repr(secret), str(secret), f"{secret}", f"{secret!r}"} == {"<secret>"}
    assert repr([secret, {"a": secret}]) == "[<secret>, {'a': <secret>}]"
    assert (secret == Secret(PASSWORD), secret == Secret("x"), secret == PASSWORD) == (
        True,
        False,
        False,
    )
    assert len({secret, Secret(PASSWORD)}) == 1
    assert (bool(secret), bool(Secret(""))) == (True, False)
    assert copy.copy(secret) is secret
    assert copy.deepcopy([secret])[0] is secret
    with pytest.raises(TypeError, match="<secret>"):
        pickle.dumps(secret)
    with pytest.raises(smachpy.InvalidStateError, match="expected a text"):
        Secret(5)


@pytest.mark.parametrize(
    ("name", "is_one"),
    [
        *[
            (name, True)
            for name in ("password", "wifi_password", "PASSWORD", "dbPassword", "token", "token_2")
        ],
        *[(name, True) for name in ("accessToken", "api_key", "apiKey", "APIKey", "client-secret")],
        *[(name, True) for name in ("private_key", "credentials", "passphrase", "pwd", "API_KEYS")],
        *[(name, False) for name in ("key", "password_file", "tokens_left", "secret_door", "pass")],
        *[
            (name, False)
            for name in ("", "_", "monkey", "bypass", "goal", "x" * 1000 + "_password")
        ],
    ],
)
def test_names_of_secrets(name, is_one):
    assert is_secret_name(name) is is_one


def test_records_of_values_have_none():
    value = {
        "password": PASSWORD,
        "inside": [{"token": PASSWORD}, SimpleNamespace(api_key=PASSWORD)],
        "by type": Secret(PASSWORD),
        "other": "shown",
        "needs_token": True,
        "secret": None,
        1: {"pwd": PASSWORD},
    }
    text = json.dumps(shown(value, Room()))
    assert PASSWORD not in text
    assert "shown" in text
    assert PASSWORD not in dumps(
        {"password": PASSWORD, "a": {"token": PASSWORD}, "b": Secret(PASSWORD)}, longest=99
    )
    assert PASSWORD not in repr(masked(value, "x")).replace("namespace(api_key='hunter2')", "")
    event = smachpy.events.UserdataWritten("/M", 0.0, 0, "password", PASSWORD)
    assert PASSWORD not in json.dumps(to_record(event))
    machine = StateMachine(["done"])
    machine.userdata.password = PASSWORD
    assert repr(machine.userdata) == "UserData(password='<secret>')"


class Robot:
    def __init__(self):
        self.password = PASSWORD

    def __repr__(self):
        return f"Robot({self.password})"


class Account(NamedTuple):
    user: str
    password: str


HOLDERS = [
    OrderedDict(password=PASSWORD),
    defaultdict(str, token=PASSWORD),
    UserDict(password=PASSWORD),
    MappingProxyType({"password": PASSWORD}),
    SimpleNamespace(password=PASSWORD),
    Account("ann", PASSWORD),
    {Account("ann", PASSWORD)},
    frozenset({Account("ann", PASSWORD)}),
    {Account("ann", PASSWORD): 1},
    deque([{"password": PASSWORD}]),
    UserList([{"password": PASSWORD}]),
    {1: {"password": PASSWORD}},
    {1: 2, "password": PASSWORD},
    Robot(),
    [Robot()],
    reduce(lambda inside, _: [inside], range(30), {"password": PASSWORD}),
    deque([{"password": PASSWORD}, *range(2000)]),
]


@pytest.mark.parametrize("value", HOLDERS, ids=range(len(HOLDERS)))
def test_no_kind_of_value_shows_what_is_in_it(value):
    """Recordings had the userdata in full, if that was a subclass of a dict, a named tuple, ..."""
    for text in (
        json.dumps(encoded(masked(value))),
        dumps({"it": value}, longest=5_000),
        json.dumps(shown(value, Room())),
        repr(masked(value)),
    ):
        assert PASSWORD not in text


def test_the_window_of_a_state_shows_none():
    """`print(userdata)` in a state showed what that of the machine masks."""
    userdata = UserData()
    userdata.update({"wifi_password": PASSWORD, "code": PASSWORD, "place": "dock"})
    window = Remapper(
        userdata, ["text", "token", "place"], (), [("text", "wifi_password"), ("token", "code")]
    )
    assert repr(window) == "Remapper(text='<secret>', token='<secret>', place='dock')"


def test_failures_of_tests_show_none(mission):
    machine = StateMachine(["done"], name="M")
    machine.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    run = mission(machine, {"login": {"password": PASSWORD}, "token": PASSWORD})
    with pytest.raises(AssertionError) as caught:
        run.assert_userdata(login={"password": f"{PASSWORD}3"}, token=f"{PASSWORD}4")
    assert PASSWORD not in str(caught.value)
    assert "token: got '<secret>'; expected '<secret>'" in str(caught.value)


def test_a_value_that_contains_itself_has_an_end():
    value = {"password": PASSWORD, "list": []}
    value["list"] += [value, value, value]
    assert masked(value) == {"password": "<secret>", "list": ["...", "...", "..."]}


@pytest.mark.parametrize(
    ("text", "is_one"),
    [
        ("{user: ann, password: hunter2}", True),
        ('{"api_key": "hunter2"}', True),
        ("host=db password=hunter2", True),
        ("https://host/?token=hunter2", True),
        ("postgresql://ann:hunter2@host/db", True),
        ("{user: ann, needs_token: true}", False),
        ("password: @/a/file", False),
        ("tcp://127.0.0.1:7447", False),
        ("a key: to the door", False),
        ("x" * 100_000, False),
        ("a_" * 50_000 + ":", False),
    ],
)
def test_texts_with_secrets_in_them(text, is_one):
    assert holds_secret(text) is is_one


@dataclass(frozen=True)
class Login:
    user: str
    password: str
    more: object = None


Wifi = define_message("test_secrets/Wifi", "string ssid\nstring password\nint32 token")


def test_fields_of_dataclasses_and_messages_show_none():
    """Introspection sent a login in clear to whoever asked for the value."""
    login = Login("ann", PASSWORD, [Login("bob", PASSWORD), {"wifi": Wifi("lab", PASSWORD, 7)}])
    text = value_text(masked(login))
    assert PASSWORD not in text
    assert "ann" in text
    assert "bob" in text
    assert "lab" in text
    assert "token: 7" not in value_text(masked(Wifi("lab", PASSWORD, 7)))
    assert login.password == PASSWORD
    assert login.more[1]["wifi"].password == PASSWORD


def test_a_value_without_secrets_is_shown_as_it_is():
    assert masked(plain := Login("ann", "", None), "") is not plain  # an empty one is a secret, too
    point = Point(1.0, 2.0, 3.0)
    assert masked(point) is point


def test_words_for_people_have_none():
    words = (
        "--input",
        f"password={PASSWORD}",
        "--",
        f"--token={PASSWORD}",
        "--pwd",
        PASSWORD,
        "--x",
        "shown",
    )
    assert PASSWORD not in " ".join(masked_words(words))
    assert "shown" in masked_words(words)
    assert masked_words(("--input", "password=@/a")) == ["--input", "password=@/a"]


def test_the_panel_shows_none(clock):
    @smachpy.state(outcomes=["done"], output_keys=["password", "login"])
    def work(userdata):
        userdata.password = PASSWORD
        userdata.login = Secret(PASSWORD)
        return "done"

    machine = StateMachine(["done"], name="M")
    machine.add("A", work)
    out = io.StringIO()
    console = Console(file=out, force_terminal=True, width=100, color_system=None)
    with TerminalView(describe(machine), console=console) as view:
        forget = machine.subscribe(view.on_event)
        machine.execute()
        console.print(view._panel())
        forget()
    assert "login" in out.getvalue()
    assert PASSWORD not in out.getvalue()


@pytest.mark.parametrize("way", ["--input=password=@secret.txt", "--input=password=hunter2"])
def test_a_run_writes_none(folder, capfd, caplog, way):
    caplog.set_level(logging.DEBUG)
    run = ["run", "mission.py", "--plain", "--record", "r.jsonl", "--out", "out", "--debug"]
    assert main([*run, way]) == 0
    assert main(["run", "mission.py", "--json", way]) == 0
    assert main(["runs", "export", "r.jsonl", "-o", "r.html"]) == 0
    said = capfd.readouterr()
    assert "<secret>" in Path("r.jsonl").read_text()
    assert ("password: got the secret itself" in caplog.text) == ("@" not in way)
    assert PASSWORD not in said.out + said.err + caplog.text
    assert written(folder) == []


def test_a_durable_run_reads_its_secret_again_and_keeps_none(folder, capfd):
    nested = Path("mission.py").read_text()
    Path("mission.py").write_text(plain(nested))
    secret = f"--input=password=@{folder}/secret.txt"
    durable = ["run", "mission.py", "--plain", "--durable", "j.db", "--mission", "one"]
    assert main([*durable, secret]) == 0
    assert main(["missions", "show", "one", "--durable", "j.db", "--json"]) == 0
    assert written(folder) == []
    Path("mission.py").write_text(nested)
    assert main([*durable[:-1], "two", secret]) == 1
    said = capfd.readouterr().err
    assert "'found'" in said
    assert "its name says that it is a secret" in said
    assert PASSWORD not in said
    assert written(folder) == []


@pytest.mark.parametrize(
    "words",
    [
        ["--input", "password=hunter2"],
        ["--", "hunter2"],
        ["--", "--password", "hunter2"],
        ["--input", "password=@secret.txt"],  # another process has another folder
        ["--input", "password=@/secret.txt", "--input", "door_code=hunter2"],
    ],
)
def test_a_secret_in_clear_is_refused_where_it_would_be_kept(folder, capfd, words):
    words = [word.replace("@/", f"@{folder}/") for word in words]
    for command in (["run", "--plain", "--durable", "j.db"], ["submit", "--db", "j.db"]):
        assert main([command[0], "mission.py", *command[1:], *words]) == 2
    said = capfd.readouterr().err
    assert "expected @FILE" in said
    assert PASSWORD not in said
    assert written(folder) == []


INSIDE = """
import smachpy


def mission(login: dict, word: smachpy.Secret | None = None):
    machine = smachpy.StateMachine(["done"], name="M")
    machine.userdata.code = smachpy.Secret("")
    machine.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    return machine
"""


@pytest.mark.parametrize(
    "words",
    [
        ["--", "{user: ann, password: hunter2}"],
        ["--input", 'login={"user": "ann", "token": "hunter2"}'],
        ["--input", "login={url: 'tcp://ann:hunter2@host'}"],
        ["--input", "login={}", "--input", "word=hunter2"],
        ["--input", "login={}", "--input", "code=hunter2"],
    ],
)
def test_arguments_with_secrets_in_them_are_kept_nowhere(folder, capfd, caplog, words):
    Path("inside.py").write_text(INSIDE)
    assert main(["run", "inside.py", "--plain", "--record", "r.jsonl", *words]) == 0
    assert PASSWORD not in Path("r.jsonl").read_text()
    assert main(["runs", "reproduce", "r.jsonl", "--allow", "."]) == 2
    assert "it was begun with a secret" in capfd.readouterr().out
    assert main(["submit", "inside.py", "--db", "j.db", *words]) == 2
    assert main(["run", "inside.py", "--plain", "--durable", "j.db", *words]) == 2
    said = capfd.readouterr()
    assert "journals and queues keep arguments" in said.err
    assert PASSWORD not in said.out + said.err + caplog.text
    assert written(folder) == []


PIN = 9517530482615937  # so long that no time or id of a journal happens to contain it


@pytest.mark.parametrize("pin", [str(PIN), PIN, [str(PIN)], {"day": PIN}])
def test_any_value_that_its_name_calls_a_secret_is_refused_by_a_journal(folder, pin):
    @smachpy.state(outcomes=["done"], output_keys=["found"])
    def work(userdata):
        userdata.found = {1: 2, "door_code": pin}
        return "done"

    @smachpy.state(outcomes=["done"])
    def call(userdata):
        smachpy.once("door_code", lambda: pin)
        return "done"

    @smachpy.mission(secrets=["Door_Code"])
    def machine(state):
        machine = StateMachine(["done"], name="M")
        machine.add("A", state)
        return machine

    for name, state in (("found", work), ("once", call)):
        with pytest.raises(smachpy.NotDurableError, match="its name says that it is a secret"):
            smachpy.run_durable(machine(state), "j.db", mission=name)
    assert [path for path in folder.glob("j.db*") if str(PIN).encode() in path.read_bytes()] == []


def test_userdata_that_its_name_calls_a_secret_is_not_kept_in_clear(folder):
    @smachpy.state(outcomes=["done"], output_keys=["wifi_password"])
    def work(userdata):
        userdata.wifi_password = PASSWORD
        return "done"

    machine = StateMachine(["done"], name="M")
    machine.add("A", work)
    with pytest.raises(smachpy.NotDurableError, match=r"smachpy\.Secret") as caught:
        smachpy.run_durable(machine, "j.db", mission="one")
    assert PASSWORD not in "".join(traceback.format_exception(caught.value))
    with contextlib.closing(open_store("j.db")) as store:
        assert store.mission("one").status == "interrupted"
    assert written(folder) == []


@pytest.mark.parametrize(
    "words",
    [
        ["--", "--password", PASSWORD, "--pin", "x"],
        ["--", PASSWORD, "more", "5", "and more"],
        ["--input", "password=@nothing.txt", "--input", "door_code=hunter2"],
        ["--help"],
    ],
)
def test_errors_about_arguments_show_none(capfd, words):
    with contextlib.suppress(SystemExit):
        main(["run", "mission.py", "--plain", "--debug", *words])
    said = capfd.readouterr()
    assert PASSWORD not in said.out + said.err


def test_a_wrong_type_shows_none(capfd):
    def factory(token: int = 0) -> StateMachine:
        raise AssertionError

    from smachpy.command.arguments import Text, read_words

    with pytest.raises(smachpy.SmachError) as caught:
        read_words(
            Target("x", "x:f", "", factory), ["--token", PASSWORD], {"token": Text(PASSWORD)}
        )
    assert PASSWORD not in str(caught.value)


def test_processes_show_none(folder):
    """What a runner starts has no arguments of the mission on its command line."""
    look = "print(open('/proc/self/cmdline').read())"
    Path("mission.py").write_text(plain(MISSION).replace("word = ", f"{look}; word = "))
    words = ["--db", "j.db", "--input", f"password=@{folder}/secret.txt", "--input", f"pin={PIN}"]
    assert main(["submit", "mission.py", *words]) == 0
    done = subprocess.run(
        [sys.executable, "-m", "smachpy.command", "runner", "--db", "j.db", "--until-empty", "--allow", "."],
        capture_output=True, text=True, timeout=100,
    )  # fmt: skip
    assert "\0-m\0" in done.stdout or "\0-P\0" in done.stdout, done  # a command line was shown
    assert str(PIN) not in done.stdout
    assert PASSWORD not in done.stdout + done.stderr
