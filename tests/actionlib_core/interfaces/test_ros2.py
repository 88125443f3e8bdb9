"""ROS 2's classes: bytes and type hashes as real nodes have them, and what user definitions say."""

from __future__ import annotations

import itertools
import json
import math
import os
import pickle
import random
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from rosbags.typesys import Stores, get_typestore

from actionlib_core import interfaces
from actionlib_core.exceptions import DeserializationError, FieldError, InterfaceError
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces._ros2 import Ros2Registry, ros2_registry
from actionlib_core.time import Duration, Time
from tests.places import DATA

LINES = [
    json.loads(line)
    for line in (DATA / "ros2_golden.jsonl").read_text(encoding="utf-8").splitlines()
]
HASHES = [line for line in LINES if line["kind"] == "hash"]
MESSAGES = [line for line in LINES if line["kind"] in {"message", "request"}]
CALLS = [line for line in LINES if line["kind"] == "call"]


def plain(value: Any) -> Any:
    """The values of a message as the golden data writes them: an id is hexadecimal."""
    if hasattr(value, "_definition"):
        if value._type == "unique_identifier_msgs/msg/UUID":
            return value.uuid.hex()
        fields = value._definition.fields
        return {field.name: plain(getattr(value, field.attribute)) for field in fields}
    return [plain(item) for item in value] if isinstance(value, list) else value


def without_garbage(payload: bytes, at: list[int]) -> bytes:
    clean = bytearray(payload)
    for index in at:
        clean[index] = 0
    return bytes(clean)


@pytest.mark.parametrize("line", HASHES, ids=lambda line: line["type"])
def test_hashes_are_those_of_real_nodes(line: dict[str, Any]) -> None:
    assert ros2_registry("kilted").hash(line["type"]) == line["hash"]


@pytest.mark.parametrize("line", MESSAGES, ids=lambda line: line["type"])
def test_messages_of_real_nodes_both_ways(line: dict[str, Any]) -> None:
    cls = ros2.get_message(line["type"], "kilted")
    payload = bytes.fromhex(line["payload"])
    message = cls.from_cdr(payload)
    assert plain(message) == line["values"]
    assert message.to_cdr() == without_garbage(payload, line["garbage_in_padding_at"])


@pytest.mark.parametrize("line", CALLS, ids=lambda line: line["what"])
def test_calls_of_real_nodes_both_ways(line: dict[str, Any]) -> None:
    service = line["key"].split("/")[-2].replace("::dds_", "").replace("::", "/").rstrip("_")
    for part, end in (("request", "Request"), ("reply", "Response")):
        cls = ros2.get_message(f"{service}_{end}", "kilted")
        payload = bytes.fromhex(line[part])
        message = cls.from_cdr(payload)
        assert plain(message) == line[f"{part}_values"]
        garbage = line["garbage_in_padding_at"] if part == "reply" else []
        assert message.to_cdr() == without_garbage(payload, garbage)


def test_an_action_names_its_services_and_topics() -> None:
    known = {line["type"]: line["hash"] for line in HASHES}
    action = ros2.get_action("nav2_msgs/NavigateToPose", "kilted")
    parts = interfaces.ros2_action(action)
    for part in parts[1:]:
        assert known[part.type] == part.hash
    assert parts.action is action
    assert parts.send_goal.request().goal == action.Goal()
    assert parts.get_result.response(result={}).status == 0
    assert parts.feedback.message().feedback == action.Feedback()
    assert parts.cancel_goal.type == "action_msgs/srv/CancelGoal"
    assert parts.status.message().status_list == []
    assert action._rihs01 == known["nav2_msgs/action/NavigateToPose"]


def test_distributions_differ() -> None:
    def fields(distro: str, part: str) -> tuple[str, ...]:
        return tuple(getattr(ros2.get_action("nav2_msgs/NavigateToPose", distro), part).__slots__)

    assert fields("humble", "Result") == ("result",)
    assert fields("jazzy", "Result") == ("error_code", "error_msg")
    assert len(fields("rolling", "Feedback")) == len(fields("jazzy", "Feedback")) + 2
    sent = "nav2_msgs/action/NavigateToPose_SendGoal"
    found = ros2_registry("jazzy").hash(sent)
    assert ros2.distros_of(sent, found) == ["jazzy", "kilted", "lyrical", "rolling"]
    assert ros2.distros_of(sent, "RIHS01_0") == []
    assert ros2_registry("humble").hash(sent) == "TypeHashNotSupported"
    assert ros2.get_service("std_srvs/SetBool", "humble")._rihs01 == ros2.NO_HASH
    with pytest.raises(InterfaceError, match="Jazzy, Kilted, Lyrical, Rolling has it"):
        ros2.get_message("nav_msgs/msg/Goals", "humble")
    with pytest.raises(InterfaceError, match="Did you mean 'jazzy'"):
        ros2.get_message("nav_msgs/msg/Path", "jazy")


@pytest.mark.slow
@pytest.mark.timeout(900)  # hundreds of classes are made
def test_every_definition_that_comes_with_us_is_a_class_with_a_hash_and_bytes() -> None:
    for distro in ros2.DISTROS:
        registry = Ros2Registry(distro, ours=True)
        stored = get_typestore(
            Stores[f"ROS2_{distro.upper() if distro != 'rolling' else 'LYRICAL'}"]
        )
        for package in registry.sources.packages():
            for name in registry.names("action", package):
                if (cls := registry.attribute(package, "action", name)) is not None:
                    assert cls._rihs01.startswith(("RIHS01_", "TypeHash"))
            for kind in ("msg", "srv"):
                for name in registry.names(kind, package):
                    cls = registry.attribute(package, kind, name)
                    assert cls._rihs01.startswith(("RIHS01_", "TypeHash"))
                    if hasattr(cls, "to_cdr"):
                        assert cls.from_cdr(cls().to_cdr()) == cls()
                    if cls._type in stored.fielddefs and "char" not in str(
                        stored.fielddefs[cls._type]
                    ):
                        theirs = stored.hash_rihs01(cls._type)
                        spoilt = package in {"service_msgs", "rosgraph_msgs"}
                        assert cls._rihs01 in {theirs, ros2.NO_HASH} or spoilt, cls._type


# --- bytes ---------------------------------------------------------------------------------------

BASES = (
    *("bool", "byte", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32"),
    *("int64", "uint64", "float32", "float64", "string", "string<=6"),
    *("geometry_msgs/Point", "std_msgs/Header", "std_msgs/Empty", "sensor_msgs/Range"),
)
ENDS = ("", "", "[]", "[3]", "[<=2]")
_serial = itertools.count()


def random_value(kind: Any, cls: Any, dice: random.Random) -> Any:
    if kind.is_array:
        count = kind.length if kind.length is not None else dice.randrange(kind.most or 3)
        values = [random_value(kind.element, cls, dice) for _ in range(count)]
        return bytes(values) if kind.base in {"uint8", "octet"} else values
    if kind.base == "bool":
        return dice.random() < 0.5
    if kind.base == "string":
        return "".join(dice.choices("abc\u00e9", k=dice.randrange(4)))
    if kind.base.startswith("float"):
        return float(dice.randrange(-1000, 1000)) / 8
    if "/" not in kind.base:
        return dice.randrange(128)  # rosbags takes no byte above
    return random_message(cls._nested[kind.base], dice)


def random_message(cls: Any, dice: random.Random) -> Any:
    fields = cls._definition.fields
    return cls(**{field.name: random_value(field.type, cls, dice) for field in fields})


def as_rosbags(store: Any, message: Any) -> Any:
    import numpy as np

    values = {}
    for field in message._definition.fields:
        value = getattr(message, field.attribute)
        if hasattr(value, "_definition"):
            value = as_rosbags(store, value)
        elif field.type.is_array and "/" in field.type.base:
            value = [as_rosbags(store, item) for item in value]
        elif field.type.is_array and field.type.base != "string":
            kind = {"octet": "uint8"}.get(field.type.base, field.type.base)
            value = np.array(list(value), dtype=kind)
        values[field.name] = value
    if not values:
        values = {"structure_needs_at_least_one_member": 0}
    return store.types[message._type](**values)


@pytest.mark.parametrize("seed", range(60))
def test_bytes_are_those_of_rosbags(seed: int) -> None:
    from rosbags.typesys import get_types_from_msg

    dice = random.Random(seed)
    fields = [(dice.choice(BASES), dice.choice(ENDS), f"f{n}") for n in range(dice.randrange(1, 7))]
    text = "\n".join(f"{base}{end} {name}" for base, end, name in fields)
    registry = Ros2Registry("jazzy", ours=True)
    full = f"p/msg/T{next(_serial)}"
    cls: Any = registry.define("msg", full, text)
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(text, full))
    for _ in range(5):
        message = random_message(cls, dice)
        theirs = as_rosbags(store, message)
        little = message.to_cdr()
        assert little == bytes(store.serialize_cdr(theirs, full, little_endian=True))
        assert cls.from_cdr(little) == message
        assert cls.from_cdr(little + bytes(9)) == message
        big = bytes(store.serialize_cdr(theirs, full, little_endian=False))
        assert cls.from_cdr(big) == message
        for size in range(len(little)):
            with pytest.raises(ValueError):
                cls.from_cdr(little[:size])
    if "char" not in text:
        assert cls._rihs01 == store.hash_rihs01(full)


def test_readers_take_what_real_nodes_take() -> None:
    from actionlib_core.interfaces.ros2.std_msgs.msg import String
    from actionlib_core.interfaces.ros2.std_srvs.srv import SetBool

    assert SetBool.Request.from_cdr(b"\0\1\xff\0\2").data is True
    assert String.from_cdr(b"\0\1\0\0" + bytes(4)).data == ""
    assert String.from_cdr(b"\0\1\0\0\2\0\0\0ab").data == "ab"
    assert String.from_cdr(b"\0\1\0\0\3\0\0\0\xffb\0").to_cdr()[8:] == b"\xffb\0"
    for wrong in (b"", b"\0", b"\0\1\0", b"\0\2\0\0\0\0\0\0", b"\0\1\0\0\xff\xff\xff\xffab"):
        with pytest.raises(DeserializationError) as caught:
            String.from_cdr(wrong)
        assert caught.value.size == len(wrong)


def test_a_count_beyond_the_bytes_is_refused_at_once() -> None:
    from actionlib_core.interfaces.ros2.geometry_msgs.msg import PolygonStamped
    from actionlib_core.interfaces.ros2.sensor_msgs.msg import LaserScan

    good = LaserScan(ranges=[1.0]).to_cdr()
    for cls in (LaserScan, PolygonStamped):
        payload = bytearray(cls().to_cdr())
        payload[-4:] = struct.pack("<I", 2**32 - 1)
        with pytest.raises(ValueError):
            cls.from_cdr(bytes(payload))
    assert LaserScan.from_cdr(good).ranges == [1.0]


# --- values --------------------------------------------------------------------------------------


def test_defaults_of_a_definition() -> None:
    from actionlib_core.interfaces.nav2_msgs.action import DockRobot
    from actionlib_core.interfaces.ros2.geometry_msgs.msg import Pose, Quaternion

    assert Quaternion().w == 1.0
    assert Pose().orientation == Quaternion(w=1)
    assert DockRobot.Goal().use_dock_id is True
    assert DockRobot.Goal().max_staging_time == 1000.0


def test_defaults_of_arrays() -> None:
    registry = Ros2Registry("jazzy", ours=True)
    text = "int32[] a [1, -2]\nfloat64[2] b [0.5, inf]\nstring[<=2] c ['x, y', \"z\"]\nbyte[2] d [1, 255]"
    cls: Any = registry.define("msg", "p/msg/Arrays", text)
    message = cls()
    assert (message.a, message.b, message.c) == ([1, -2], [0.5, math.inf], ["x, y", "z"])
    assert message.d == b"\1\xff"
    message.a.append(3)
    assert cls().a == [1, -2]
    assert cls.from_cdr(cls().to_cdr()) == cls()


def test_quotes_in_quotes() -> None:
    registry = Ros2Registry("jazzy", ours=True)
    text = """string A='it\\'s # all' # so
string a "say \\"#\\"" # so
string[] b ["x, \\"y\\"", 'it\\'s']
string c 'a "b"'"""
    cls: Any = registry.define("msg", "p/msg/Quotes", text)
    assert cls.A == "it's # all"
    assert (cls().a, cls().b, cls().c) == ('say "#"', ['x, "y"', "it's"], 'a "b"')


def test_functions_for_classes_of_ros_1_take_those_of_ros_2_too() -> None:
    from actionlib_core.interfaces.nav2_msgs.action import Spin

    goal = Spin.Goal(target_yaw=1.5)
    assert interfaces.rihs01(Spin.Goal) == Spin.Goal._rihs01
    assert interfaces.to_cdr(goal) == goal.to_cdr()
    assert interfaces.from_cdr(Spin.Goal, goal.to_cdr()) == goal


def test_a_comma_in_a_later_value_of_an_array_is_no_separator() -> None:
    registry = Ros2Registry("jazzy", ours=True)
    cls: Any = registry.define("msg", "p/msg/Commas", "string[] a ['x', \"y, z\" , '', 'w']")
    assert cls().a == ["x", "y, z", "", "w"]


def test_tabs_separate_words_as_spaces_do() -> None:
    registry = Ros2Registry("jazzy", ours=True)
    text = "float64\tspeed\t0.3\t# [m/s]\nint8[]\tlevels\t[1,\t2]\nuint8\tA\t=\t1\nbool b\ttrue"
    cls: Any = registry.define("msg", "p/msg/Tabs", text)
    assert (cls().speed, cls().levels, cls.A, cls().b) == (0.3, [1, 2], 1, True)
    with pytest.raises(InterfaceError) as caught:
        registry.define("msg", "p/msg/Tabs2", "string<=3\ts\t'a\tbc'")
    assert str(caught.value).endswith("    string<=3 s 'a bc'\n                ^")


def test_an_apostrophe_within_a_word_opens_no_quotes() -> None:
    registry = Ros2Registry("jazzy", ours=True)
    text = "string A=don't # a comment\nstring a it's # it's one, too"
    cls: Any = registry.define("msg", "p/msg/Apostrophe", text)
    assert (cls.A, cls().a) == ("don't", "it's")


def test_a_default_longer_than_its_string_may_be_is_refused() -> None:
    registry = Ros2Registry("jazzy", ours=True)
    with pytest.raises(InterfaceError) as caught:
        registry.define(
            "msg", "p/msg/Long", "string<=3 a 'abcd'\nstring<=3[] b ['abc', '\u00e9\u00e9']"
        )
    for name in "ab":
        assert f"default value of {name}: got 4 bytes; expected string<=3" in str(caught.value)
    cls: Any = registry.define("msg", "p/msg/Short", "string<=3 a 'abc'")
    with pytest.raises(FieldError, match=r"\$\.a: expected string<=3, got 4 bytes"):
        cls(a="\u00e9\u00e9").to_cdr()


@pytest.mark.parametrize("kind", ["wstring", "wstring<=3", "wstring[]", "wstring<=3[<=2]"])
def test_strings_of_wide_characters_are_refused_by_their_name(kind: str) -> None:
    with pytest.raises(InterfaceError, match="'wstring', which cannot be used here"):
        Ros2Registry("jazzy", ours=True).define("msg", "p/msg/Wide", f"{kind} text")


def test_stamps_take_times_and_seconds() -> None:
    from actionlib_core.interfaces.ros2.builtin_interfaces.msg import Duration as Duration2
    from actionlib_core.interfaces.ros2.builtin_interfaces.msg import Time as Time2
    from actionlib_core.interfaces.ros2.std_msgs.msg import Header

    assert Header(stamp=12.5).stamp == Time2(sec=12, nanosec=500_000_000)
    assert Header(stamp=Time(3, 4)).stamp == Time2(3, 4)
    header = Header()
    header.stamp = 2.0
    assert Header.from_cdr(header.to_cdr()).stamp == Time2(sec=2)
    assert Header.from_dict({"stamp": {"sec": 1, "nanosec": 2}}).stamp == Time2(1, 2)
    assert Header.from_dict({"stamp": 1.5}).stamp.nanosec == 500_000_000
    before_1970 = Header(stamp=Time2(sec=-5, nanosec=4_000_000_000))
    assert Header.from_dict(before_1970.to_dict()) == before_1970
    with pytest.raises(FieldError, match="sec: expected int32"):
        Header.from_dict({"stamp": {"sec": 2**31}})
    for late in (2**31, Time(2**31), -(2**31) - 1):
        header.stamp = late
        with pytest.raises(FieldError, match=r"\$\.stamp"):
            header.to_cdr()
    from actionlib_core.interfaces.nav2_msgs.action import Wait

    assert Wait.Goal(time=Duration(-0.5)).time == Duration2(-1, 500_000_000)
    for wrong in (math.nan, math.inf, "soon", -1.0):
        header.stamp = wrong
        with pytest.raises(FieldError, match="stamp"):
            header.to_cdr()


def test_bounds_are_checked_with_their_path() -> None:
    registry = Ros2Registry("jazzy", ours=True)
    cls: Any = registry.define(
        "msg", "p/msg/Bounded", "string<=3 a\nint32[<=2] b\nstring<=2[] c\nbyte[<=2] d"
    )
    assert cls.from_cdr(cls(a="abc", b=[1, 2], c=["xy"], d=b"\1\2").to_cdr()).b == [1, 2]
    with pytest.raises(FieldError) as caught:
        cls(a="abcd", b=[1, 2, 3], c=["ok", "xyz"], d=b"123").to_cdr()
    paths = [problem.split(": ")[1] for problem in caught.value.problems]
    assert paths == ["$.a", "$.b", "$.c[1]", "$.d"]


def test_bad_values_are_named_all_at_once() -> None:
    from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose

    goal: Any = NavigateToPose.Goal()
    goal.pose.pose.position.x = "1"
    goal.behavior_tree = 3
    with pytest.raises(FieldError) as caught:
        goal.to_cdr()
    assert len(caught.value.problems) == 2
    with pytest.raises(FieldError, match="pose"):
        NavigateToPose.Goal(poze=1)


def test_messages_are_equal_copied_and_pickled() -> None:
    from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
    from actionlib_core.interfaces.ros2.geometry_msgs.msg import Point

    goal = NavigateToPose.Goal(behavior_tree="x")
    assert pickle.loads(pickle.dumps(goal)) == goal
    assert NavigateToPose.Goal.from_yaml(goal.to_yaml()) == goal
    assert goal.to_bytes() == goal.to_cdr()
    assert Point() != interfaces.get_message("geometry_msgs/Point")()


# --- where they come from ------------------------------------------------------------------------


def test_imports() -> None:
    from actionlib_core.interfaces.action_msgs.msg import GoalStatus
    from actionlib_core.interfaces.control_msgs.action import GripperCommand
    from actionlib_core.interfaces.control_msgs.msg import GripperCommandGoal
    from actionlib_core.interfaces.geometry_msgs.msg import Point
    from actionlib_core.interfaces.ros2.control_msgs.action import GripperCommand as Again
    from actionlib_core.interfaces.ros2.geometry_msgs.msg import Point as Point2

    assert (GoalStatus._wire, GripperCommand._wire, Point2._wire) == ("ros2",) * 3
    assert (Point._wire, GripperCommandGoal._wire) == ("ros1", "ros1")
    assert Again is GripperCommand
    assert GoalStatus.STATUS_EXECUTING == 2
    with pytest.raises(ImportError):
        from actionlib_core.interfaces.no_such_msgs.action import Foo  # noqa: F401
    with pytest.raises(ImportError):
        from actionlib_core.interfaces.nav2_msgs.action import NavigateToPosse  # noqa: F401


def test_files_of_a_user_in_either_dialect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for kind, name, text in (
        ("msg", "Level", 'uint8 LOW=1\nuint8 value 1\nstring unit "m#"  # how high\n'),
        ("srv", "Ask", "Level[<=2] levels\n---\nbool good\n"),
        ("action", "Lift", "Level level\n---\nfloat64 height\n---\nfloat32[] past\n"),
    ):
        folder = tmp_path / "lift_msgs" / kind
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.{kind}").write_text(text, encoding="utf-8")
    monkeypatch.setenv("SMACHPY_INTERFACE_PATH", str(tmp_path))
    from actionlib_core.interfaces.lift_msgs.action import Lift
    from actionlib_core.interfaces.ros2.lift_msgs.msg import Level
    from actionlib_core.interfaces.ros2.lift_msgs.srv import Ask

    assert Level(value=Level.LOW).unit == "m#"
    assert Lift.Goal(level=Level(unit="cm")).level.value == 1
    assert Ask.Response(good=True).good is True
    assert interfaces.ros2_action(Lift).send_goal.hash.startswith("RIHS01_")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("int32[<=] a", "malformed type"),
        ("int32<=3 a", "malformed type"),
        ("Int32x$ a", "malformed type"),
        ("time stamp", "builtin_interfaces/Time"),
        ("wstring a", "wstring"),
        ("int8 a 300", "expected -128 to 127"),
        ("int8[2] a [1]", "got 1 values"),
        ("geometry_msgs/Point p 3", "expected none"),
        ("int8 X=a", "whole number"),
        ("Nosuch a", "unknown type"),
        ("p/Bad a", "contains itself"),
        ("int8 a\nint8 a", "duplicate name"),
    ],
)
def test_wrong_definitions_are_named_by_line(text: str, problem: str) -> None:
    registry = Ros2Registry("jazzy", ours=True)
    with pytest.raises(InterfaceError, match=problem):
        registry.define("msg", "p/msg/Bad", text)


def test_a_workspace_with_its_own_version_of_a_package(tmp_path: Path) -> None:
    """In a process of its own: which class a name is, is decided once."""
    folder = tmp_path / "nav2_msgs"
    for kind, name, text in (
        ("action", "Spin", "float32<=2 bad\n---\n---\n"),
        ("action", "Wait", "float32 seconds 2.5\n---\n---\nParticle last\n"),
        ("msg", "Particle", "string<=3 name\n"),
    ):
        (folder / kind).mkdir(parents=True, exist_ok=True)
        (folder / kind / f"{name}.{kind}").write_text(text)
    program = (
        "from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose, Wait\n"
        "from actionlib_core.interfaces.nav2_msgs.msg import Costmap, Particle\n"
        "assert Wait.Goal().seconds == 2.5 and Wait.Feedback().last == Particle()\n"
        "assert Particle._wire == Costmap._wire == 'ros2'\n"
        "assert 'pose' in NavigateToPose.Goal.__slots__\n"
        "try:\n"
        "    from actionlib_core.interfaces.nav2_msgs.action import Spin\n"
        "except Exception as error:\n"
        "    assert 'Spin.action:1' in str(error), error\n"
        "else:\n"
        "    raise AssertionError\n"
    )
    environment = {**os.environ, "SMACHPY_INTERFACE_PATH": str(tmp_path)}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True, timeout=100)
