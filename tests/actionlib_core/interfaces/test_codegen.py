"""Generated codecs against rosbags' own, on definitions and values that hypothesis makes up."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from actionlib_core.interfaces._definition import BUILTINS, FLOATS, INTEGERS
from actionlib_core.interfaces._registry import Registry
from actionlib_core.interfaces._sources import BUNDLED, Sources
from actionlib_core.time import Duration, Time

NESTED = ("geometry_msgs/Point", "std_msgs/Header", "geometry_msgs/Polygon", "std_msgs/Empty")
BASES = (*BUILTINS, *NESTED)
_serial = itertools.count()

definitions = st.lists(
    st.tuples(st.sampled_from(BASES), st.sampled_from(["", "[]", "[0]", "[1]", "[3]"])),
    max_size=6,
)


def value_of(registry: Registry, base: str) -> st.SearchStrategy[Any]:
    if base in INTEGERS:
        return st.integers(*INTEGERS[base])
    if base in FLOATS:
        return st.floats(width=32 if base == "float32" else 64, allow_nan=False)
    simple: dict[str, st.SearchStrategy[Any]] = {
        "bool": st.booleans(),
        "string": st.text(st.characters(codec="utf-8"), max_size=5),
        "time": st.builds(Time, st.integers(0, 2**31 - 1), st.integers(0, 10**9 - 1)),
        "duration": st.builds(
            Duration, st.integers(-(2**31), 2**31 - 1), st.integers(0, 10**9 - 1)
        ),
    }
    return simple[base] if base in simple else message_of(registry, registry.message(base))


def message_of(registry: Registry, cls: Any) -> st.SearchStrategy[Any]:
    fields = {}
    for field in cls._definition.fields:
        one = value_of(registry, field.type.base)
        if field.type.is_array:
            length = field.type.length
            one = st.lists(one, min_size=length or 0, max_size=3 if length is None else length)
            if field.type.base in {"uint8", "char"}:
                one = one.map(bytes)
        fields[field.attribute] = one
    return st.fixed_dictionaries(fields).map(lambda values: cls(**values))


@pytest.mark.slow
@settings(max_examples=80, deadline=None)
@given(definitions, st.data())
def test_codecs_agree_with_rosbags(fields: list[tuple[str, str]], data: st.DataObject) -> None:
    text = "".join(f"{base}{array} f{i}\n" for i, (base, array) in enumerate(fields))
    registry = Registry(Sources(folders=[BUNDLED]))
    registry.define("msg", "p/T", text)
    cls: Any = registry.message("p/T")
    message = data.draw(message_of(registry, cls))
    payload = message.to_bytes()
    assert cls.from_bytes(payload) == message
    assert cls.from_bytes(payload).to_bytes() == payload
    assert cls.from_yaml(message.to_yaml()) == message
    assert cls.from_dict(message.to_dict()) == message
    if any(array == "[0]" for _, array in fields):
        return  # rosbags takes a zero length for a dynamic one
    store = get_typestore(Stores.ROS1_NOETIC)
    name = f"p/msg/T{next(_serial)}"
    store.register(get_types_from_msg(text, name))
    if fields:
        assert store.generate_msgdef(name)[1] == cls._md5sum
    theirs = store.deserialize_ros1(payload, name)
    assert bytes(store.serialize_ros1(theirs, name)) == payload
    for i, (base, array) in enumerate(fields):
        if base in FLOATS and not array:
            mine = getattr(message, f"f{i}")
            assert math.isclose(getattr(theirs, f"f{i}"), mine) or mine == getattr(theirs, f"f{i}")
        elif base in INTEGERS and array:
            assert np.array_equal(getattr(theirs, f"f{i}"), list(getattr(message, f"f{i}")))


@given(
    st.binary(max_size=120),
    st.sampled_from(
        [
            "nav_msgs/Path",
            "sensor_msgs/JointState",
            "tf2_msgs/TFMessage",
            "actionlib_msgs/GoalStatusArray",
        ]
    ),
)
def test_any_bytes_are_read_or_refused(payload: bytes, name: str) -> None:
    from actionlib_core import interfaces
    from actionlib_core.exceptions import DeserializationError

    cls = interfaces.get_message(name)
    try:
        message = cls.from_bytes(payload)
    except DeserializationError:
        return
    assert len(message.to_bytes()) == len(payload)


def test_checksums_of_all_bundled_messages_agree_with_rosbags() -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    registry = Registry(Sources(folders=[BUNDLED]))
    seen = 0
    for package in registry.sources.packages():
        for name in registry.names("msg", package):
            ours = registry.message(f"{package}/{name}")
            theirs = f"{package}/msg/{name}"
            if theirs in store.fielddefs:
                assert store.generate_msgdef(theirs)[1] == ours._md5sum, name
                seen += 1
    assert seen > 120
