"""ROS 2's types: hashes, bytes, default values and constants as ROS 2's own packages have them."""

from __future__ import annotations

import json
import random
import string
import struct
from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core.interfaces._arrays import STRUCT_CODES
from actionlib_core.interfaces._definition import INTEGERS
from actionlib_core.interfaces._registry import UnknownTypeError
from actionlib_core.interfaces._ros2 import Ros2Registry

if TYPE_CHECKING:
    from tests.actionlib_core.wire.rclpy.conftest import Rclpy

pytestmark = pytest.mark.rclpy

VALUES = 4  # of each type
NOT_OURS = {"actionlib_msgs", "rmw_dds_common", "test_msgs"}
"""Packages of which nothing, or one action only, comes with us."""
NOT_READ = {"KeyedLong", "KeyedString", "ComplexNestedKey", "NonKeyedWithNestedKey", "WStrings"}
"""Of test_msgs: those that have no .msg file, and the one with `wstring`."""


def hashes_of(rclpy: Rclpy) -> dict[str, str]:
    """Every hash that the packages' descriptions name."""
    found: dict[str, str] = {}
    for path in rclpy.share.glob("*_*/*/*.json"):
        for entry in json.loads(path.read_text(encoding="utf-8")).get("type_hashes", ()):
            name, known = entry["type_name"], entry["hash_string"]
            assert found.setdefault(name, known) == known, name
    return found


OURS, THEIRS = "definitions that come with us", "files of the packages"


@pytest.fixture(params=[OURS, THEIRS])
def whose(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def registry(rclpy: Rclpy, whose: str, monkeypatch: pytest.MonkeyPatch) -> Ros2Registry:
    """Of our definitions, or of theirs as a user's are read."""
    if whose == THEIRS:
        monkeypatch.setenv("SMACHPY_INTERFACE_PATH", str(rclpy.share))
    return Ros2Registry(rclpy.distro, ours=whose == OURS)


def is_ours(name: str) -> bool:
    package = name.split("/", maxsplit=1)[0]
    return package not in NOT_OURS or name.startswith("test_msgs/action/Fibonacci")


def test_hashes(rclpy: Rclpy, registry: Ros2Registry, whose: str) -> None:
    hashes = hashes_of(rclpy)
    for name in list(hashes):
        if name.split("/")[-1] in NOT_READ or (whose == OURS and not is_ours(name)):
            del hashes[name]
    assert len(hashes) >= (263 if whose == OURS else 306)
    assert {name: registry.hash(name) for name in hashes} == hashes


def float_of(code: str, dice: random.Random) -> float:
    value = dice.choice([0.0, -0.0, float("inf"), -1.5, dice.uniform(-1e6, 1e6), 1e-30])
    return struct.unpack(code, struct.pack(code, value))[0]


def random_value(kind: Any, cls: Any, dice: random.Random) -> Any:
    """A value as the child takes it: edges of the type, arrays from empty to full."""
    if kind.is_array:
        most = 4 if kind.most is None else kind.most
        count = kind.length if kind.length is not None else dice.randint(0, most)
        return [random_value(kind.element, cls, dice) for _ in range(count)]
    if kind.base == "bool":
        return dice.random() < 0.5
    if kind.base == "string":
        most = 12 if kind.most_text is None else kind.most_text // 4  # bytes of UTF-8
        return "".join(
            dice.choices(string.printable + "\u00e9\u20ac\U0001f916", k=dice.randint(0, most))
        )
    if kind.base in {"float32", "float64"}:
        return float_of(STRUCT_CODES[kind.base], dice)
    if "/" not in kind.base:
        lowest, highest = INTEGERS["uint8" if kind.base in {"octet", "byte", "char"} else kind.base]
        return dice.choice([lowest, highest, 0, dice.randint(lowest, highest)])
    return random_values(cls._nested[kind.base], dice)


def random_values(cls: Any, dice: random.Random) -> dict[str, Any]:
    fields = cls._definition.fields
    return {field.name: random_value(field.type, cls, dice) for field in fields}


def test_bytes_defaults_and_constants(rclpy: Rclpy, registry: Ros2Registry, whose: str) -> None:
    compared, differences = 0, {}  # the two sorts of definitions share the types between them
    for name in sorted(hashes_of(rclpy)):
        if name.split("/")[-1] in NOT_READ or is_ours(name) != (whose == OURS):
            continue
        try:
            cls: Any = registry.message(name)
        except UnknownTypeError:  # a service or an action as a whole, or an event
            assert name.split("/")[1] != "msg", name
            continue
        dice = random.Random(name)
        values = [random_values(cls, dice) for _ in range(VALUES)]
        messages = [cls.from_dict(each) for each in values]
        answer = rclpy.ask("exchange", name, values, [each.to_cdr().hex() for each in messages])
        # Values are compared: rclpy leaves garbage in padding and behind the end.
        theirs = (
            [cls.from_cdr(bytes.fromhex(each)) for each in answer["written"]],
            answer["read"],
            cls.from_cdr(bytes.fromhex(answer["default"])),
            answer["constants"],
        )
        constants = {each.name: each.value for each in cls._definition.constants}
        ours = (messages, values, cls(), constants)
        compared += 1
        if ours != theirs:
            differences[name] = [
                pair for pair in zip(ours, theirs, strict=True) if pair[0] != pair[1]
            ]
    assert not differences
    assert compared >= (170 if whose == OURS else 30)
