"""Configuration: files, environment, arguments, and errors that name everything at once."""

from __future__ import annotations

import pytest

from actionlib_core.config import AccessRule, Config, Ros2, Tls, load_config
from actionlib_core.exceptions import ConfigError
from actionlib_core.transport._access import Permissions, decode_permissions, find_permissions
from actionlib_core.transport._zenoh_config import zenoh_settings


@pytest.fixture
def write(tmp_path):
    def write(text, name="config.yaml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def test_default_stays_on_this_machine(monkeypatch):
    monkeypatch.delenv("SMACHPY_CONFIG", raising=False)
    monkeypatch.delenv("SMACHPY_DOMAIN", raising=False)
    config = load_config()
    assert config == Config()
    settings = zenoh_settings(config)
    assert settings["listen/endpoints"] == ["tcp/127.0.0.1:0"]
    assert settings["scouting/multicast/interface"] == "lo"
    assert settings["scouting/multicast/address"] == "224.0.0.224:7446"
    assert "access_control" not in settings


def test_argument_beats_environment_beats_default(write, monkeypatch):
    file = write("namespace: robot_1\n")
    monkeypatch.setenv("SMACHPY_CONFIG", str(write("namespace: robot_2\n", "other.yaml")))
    monkeypatch.setenv("SMACHPY_DOMAIN", "7")
    assert load_config().namespace == "robot_2"
    assert load_config(file).namespace == "robot_1"
    assert load_config(str(file)).namespace == "robot_1"
    assert load_config(Config(namespace="robot_3")).namespace == "robot_3"
    assert load_config().domain == 0
    monkeypatch.delenv("SMACHPY_CONFIG")
    assert load_config().domain == 7


def test_domain_of_the_environment_must_be_a_number(monkeypatch):
    monkeypatch.delenv("SMACHPY_CONFIG", raising=False)
    monkeypatch.setenv("SMACHPY_DOMAIN", "seven")
    with pytest.raises(ConfigError, match="SMACHPY_DOMAIN: not a number: got 'seven'"):
        load_config()
    monkeypatch.setenv("SMACHPY_DOMAIN", "10000")
    with pytest.raises(ConfigError, match="domain: out of range"):
        load_config()


def test_every_field_is_read(write, tmp_path):
    for name in ("ca.pem", "robot.pem", "robot.key", "users", "password"):
        write("secret\n", name)
    config = load_config(
        write("""
mode: peer
connect: [tls/10.0.0.1:7447]
listen: [tcp/0.0.0.0:7448, tls/0.0.0.0:7449]
discovery: eth0
domain: 3
namespace: /robot_1
lease: 5
connect_timeout: 2.5
settle: 0.1
user: alice
password_file: password
users_file: users
tls:
  ca: ca.pem
  certificate: robot.pem
  key: robot.key
  require_client_certificate: true
  verify_name: false
access:
- names: [robot_1/**]
  users: [alice]
- names: ["**"]
  certificates: [operator]
  permission: deny
""")
    )
    here = str(tmp_path)
    assert config == Config(
        mode="peer",
        connect=("tls/10.0.0.1:7447",),
        listen=("tcp/0.0.0.0:7448", "tls/0.0.0.0:7449"),
        discovery="eth0",
        domain=3,
        namespace="/robot_1",
        lease=5.0,
        connect_timeout=2.5,
        settle=0.1,
        tls=Tls(f"{here}/ca.pem", f"{here}/robot.pem", f"{here}/robot.key", True, False),
        user="alice",
        password_file=f"{here}/password",
        users_file=f"{here}/users",
        access=(
            AccessRule(("robot_1/**",), users=("alice",)),
            AccessRule(("**",), certificates=("operator",), permission="deny"),
        ),
    )
    settings = zenoh_settings(config)
    assert settings["transport/auth/usrpwd/password"] == "secret"
    assert settings["transport/link/tls/enable_mtls"] is True
    assert settings["transport/link/tx/lease"] == 5000


def test_empty_file_is_the_default(write):
    assert load_config(write("# nothing\n")) == Config()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("mode: client\n", "connect: empty: got []; expected the router's endpoint"),
        ("- a\n", "line 1: got a list; expected a mapping of names to values"),
        ("mode: [\n", "not YAML"),
        (
            "mode: pier\nlease: a\n",
            "config.yaml: 2 problems:\n  - line 1: mode: got 'pier'; expected",
        ),
        ("listen: [7447]\n", "line 1: listen[0]: got 7447; expected a text."),
        ("listen: [localhost]\n", "line 1: listen: malformed endpoint: got 'localhost'"),
        ("lease: 0\n", "line 1: lease: too small: got 0.0; expected at least 0.1 [s]."),
        ("namespace: a b\n", "line 1: namespace: invalid namespace"),
        ("user: a\npassword: b\npassword_file: c\n", "password_file: no such file"),
        ("password: b\n", "user: missing"),
        ("tls: {certificate: x}\n", "tls.key: missing"),
        ("connect: [tls/a:1]\n", "tls.ca: missing"),
        ("tls: {ca: nothing.pem}\n", "line 1: tls.ca: no such file"),
        ("access: [{names: []}]\n", "access[0].names: empty"),
        ("access: [{names: [/a]}]\n", "access[0].names: got '/a'"),
        ("access: [{names: [a], users: [b], certificates: [c]}]\n", "expected one. Try two rules"),
    ],
)
def test_what_does_not_fit_together_is_said(write, text, problem):
    with pytest.raises(ConfigError) as caught:
        load_config(write(text))
    assert problem in str(caught.value)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"nothing.yaml: got 'No such file"):
        load_config(tmp_path / "nothing.yaml")


def test_password_never_shows():
    assert "secret" not in repr(Config(user="alice", password="secret"))


def test_problems_of_an_argument_come_at_once_too():
    with pytest.raises(ConfigError) as caught:
        Config(mode="client", listen=("tcp/a:1",), lease=-1.0, domain=-1)
    assert len(caught.value.problems) >= 2


RULES = (
    AccessRule(("robot_1/**",), users=("alice",)),
    AccessRule(("robot_2/**",), certificates=("robot_2",)),
    AccessRule(("public/*",)),
    AccessRule(("robot_1/secret",), users=("alice",), permission="deny"),
)


@pytest.mark.parametrize(
    ("user", "certificate", "key", "allowed"),
    [
        ("alice", "", "robot_1/move_base/goal", True),
        ("alice", "", "robot_1/secret", False),
        ("alice", "", "robot_2/move_base/goal", False),
        ("", "robot_2", "robot_2/move_base/goal", True),
        ("bob", "", "robot_1/move_base/goal", False),
        ("bob", "", "public/map", True),
        ("bob", "", "public/a/b", False),
        ("alice", "", "@smachpy/service/s/1/n/t/m/robot_1/grip", True),
        ("alice", "", "@smachpy/service/s/1/n/t/m/robot_2/grip", False),
        ("alice", "", "robot_1/map/@latch/s/1", True),
        ("alice", "", "robot_2/map/@latch/s/1", False),
        ("bob", "", "@smachpy_access/rules", True),
        ("alice", "", "@smachpy/service/*/*/*/*/*/robot_2/grip", False),
        ("alice", "", "@smachpy/service/*/*/*/*/*/robot_1/grip", True),
        ("alice", "", "@smachpy/*/*/*/*/*/*/**", True),
    ],
)
def test_permissions(user, certificate, key, allowed):
    permissions = find_permissions(RULES, user, certificate)
    assert permissions.allows(key) is allowed
    assert decode_permissions(permissions.encode()) == permissions


@pytest.mark.parametrize(
    "answer",
    [
        b"",
        b"junk",
        b"\xff",
        b"[]",
        b"{}",
        b"1",
        b"[" * 100_000,
        b'{"who": "x", "allow": [], "deny": [1]}',
        b'{"who": "x", "allow": "all", "deny": []}',
        b'{"who": 1, "allow": [], "deny": []}',
    ],
)
def test_access_rules_that_are_none_are_refused(answer):
    with pytest.raises(ValueError, match=r"got|Expecting|codec"):
        decode_permissions(answer)


def test_who_is_named():
    assert find_permissions(RULES, "alice", "").who == "user 'alice'"
    assert find_permissions(RULES, "", "robot_2").who == "certificate 'robot_2'"
    assert find_permissions((), "", "") == Permissions("anybody", (), ())


@pytest.mark.parametrize(
    ("text", "networks"),
    [
        ("wire: ros2\n", (Ros2(names=("**",)),)),
        ("wire: ros2\nros2: {domain: 4}\n", (Ros2(domain=4, names=("**",)),)),
        (
            "ros2: {domain: 4, names: [a]}\nwire: {move_base: ros2, 'robot1/**': ros2}\n",
            (Ros2(domain=4, names=("a", "move_base", "robot1/**")),),
        ),
    ],
)
def test_wire_says_which_names_are_on_ros_2(write, text, networks):
    assert load_config(write(text)).ros2 == networks


@pytest.mark.parametrize(
    ("networks", "way_out"),
    [
        ("- {robot: a}\n- {robot: b}", "Try without 'wire'"),
        ("- {robot: a}\n- {names: [b]}", "Try without 'wire'"),
        ("- {robot: a}\n- {domain: 3}", "Try 'names' or 'robot' in each instead of 'wire'"),
    ],
)
def test_wire_beside_several_networks_is_told_with_what_is_missing(write, networks, way_out):
    with pytest.raises(ConfigError, match=way_out):
        load_config(write(f"wire: ros2\nros2:\n{networks}\n"))


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("namespace: a\nwire: ros1\n", ["line 2: wire: "]),
        ("wire: [move_base]\n", ["line 1: wire: "]),
        ("wire: {}\n", ["line 1: wire: "]),
        ("wire:\n  a: ros2\n  b: smachpy\n", ["line 3: wire.b: "]),
        ("wire: {'a//b': ros2}\n", ["line 1: wire"]),
        ("ros2:\n- {robot: a}\n- {robot: b}\nwire: ros2\n", ["line 4: wire: "]),
        ("wires: ros2\n", ["line 1: wires: "]),
    ],
)
def test_wire_that_says_something_else_is_told(write, text, lines):
    with pytest.raises(ConfigError) as caught:
        load_config(write(text))
    assert [
        problem[: len(line)] for problem, line in zip(caught.value.problems, lines, strict=True)
    ] == lines
