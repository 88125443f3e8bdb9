"""What a journal keeps of userdata comes back as it was, and what it cannot keep is refused at once."""

from __future__ import annotations

import json
import math
import threading
from datetime import date, datetime, time, timedelta, timezone
from pathlib import Path, PurePosixPath
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
from actionlib_core.interfaces.nav_msgs.msg import OccupancyGrid
from actionlib_core.interfaces.ros2.geometry_msgs.msg import PoseStamped as Ros2PoseStamped
from actionlib_core.time import Duration, Time
from smachpy.durable.codec import JournalValueError, NotDurableError, decode, encode
from smachpy.exceptions import InvalidStateError
from smachpy.places.pose import Pose2D
from smachpy.userdata.kept_types import REGISTERED, register_annotations, register_type
from smachpy.userdata.readonly import read_only
from smachpy.userdata.secret import is_secret_name
from tests.smachpy.durable import kept_types
from tests.smachpy.durable.kept_types import (
    Colour,
    Level,
    MyDict,
    Point,
    Route,
    Socket,
    Stranger,
    Values,
    Waypoint,
    Ways,
    WithInitVar,
)

REGISTERED_BY_SMACHPY = dict(REGISTERED)


@pytest.fixture(autouse=True)
def own_registry():
    before = dict(REGISTERED)
    REGISTERED.clear()
    yield
    REGISTERED.clear()
    REGISTERED.update(before)


def through_json(value):
    return decode(json.loads(json.dumps(encode(value, key="k"), allow_nan=False)))


def same(a, b):
    """Equal, of one type, all the way down; NaN equals NaN."""
    if type(a) is not type(b):
        return False
    if isinstance(a, float):
        return (a == b and math.copysign(1, a) == math.copysign(1, b)) or (
            math.isnan(a) and math.isnan(b)
        )
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return len(a) == len(b) and same(list(a.items()), list(b.items()))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    return a == b


VALUES = [
    None,
    True,
    -(2**70),
    10**5000,
    "ünï\0\ud800",
    1e-300,
    -0.0,
    math.inf,
    math.nan,
    [],
    (),
    {},
    set(),
    [[], ({},), (1.5, math.nan)],
    {"a": {"b": [1, (2,)]}, "": 0},
    {1: "a", (2, 3): b"x", "$tuple": [1], None: {}},
    {"$": 1},
    {1, "a", (2, "b"), frozenset({3})},
    b"\x00\xff",
    bytearray(b"ab"),
    Time(5, 7),
    Duration(-5, 7),
    date(2026, 2, 28),
    time(1, 2, 3, 4, fold=1),
    timedelta(-3, 4, 5),
    datetime(2026, 10, 25, 2, 30, fold=1),  # noqa: DTZ001
    datetime(2026, 10, 25, 2, 30, 0, 123456, timezone(timedelta(hours=-3.5))),
    datetime(2026, 10, 25, 2, 30, fold=1, tzinfo=ZoneInfo("Europe/Berlin")),
    Path("/tmp/ü"),
    PurePosixPath("a/b"),
    np.arange(6, dtype="<i4").reshape(2, 3),
    np.arange(6.0).reshape(2, 3).T,
    np.zeros((0, 3)),
    np.array(5.0),
    np.array([math.nan, 1]),
    np.array(["ab", "ü"]),
    np.array(["2026-01-01"], dtype="datetime64[D]"),
    np.array([(1, 2.0)], dtype=[("a", "i4"), ("b", "f8", (2,))]),
    np.float32(0.1),
    np.bool_(True),
    np.str_("ü"),
    np.str_(""),
    np.bytes_(b"ab"),
    np.bytes_(b""),
    np.void(b""),
    PoseStamped(),
    OccupancyGrid(data=[1, -1, 100]),
    Ros2PoseStamped(),
    NavigateToPose.Goal(behavior_tree="x"),
]


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_values_come_back_as_they_were(value):
    assert same(through_json(value), value)


# What stands under the name of a secret is refused: see test_secrets.
KEYS = st.integers() | st.text().filter(lambda name: not is_secret_name(name))
JSON_LIKE = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary(),
    lambda inner: st.lists(inner) | st.lists(inner).map(tuple) | st.dictionaries(KEYS, inner),
    max_leaves=20,
)


@given(JSON_LIKE)
def test_any_nesting_of_them_does(value):
    assert same(through_json(value), value)


def test_poses_of_earlier_journals_come_back():
    REGISTERED.update(REGISTERED_BY_SMACHPY)
    data = encode(Pose2D(1.0, 2.0, 0.5))
    assert data["$type"] == "smachpy.places.pose:Pose2D"
    data["$type"] = "smachpy.sim.geometry:Pose2D"
    assert decode(data) == Pose2D(1.0, 2.0, 0.5)


def test_what_comes_back_is_a_copy_that_can_change():
    array = np.zeros(3)
    kept = encode([array, {"a": [1]}])
    array[0] = 1.0
    restored = decode(kept)
    restored[0][1] = 5.0
    restored[1]["a"].append(2)
    assert decode(kept)[0][0] == 0.0
    assert decode(kept)[1] == {"a": [1]}


@pytest.mark.parametrize("kind", [PoseStamped, Ros2PoseStamped])
def test_a_message_whose_definition_has_changed_does_not_come_back(kind):
    """A field `int32 n` that is `string n` now would get a number."""
    data = encode([kind()])
    data[0]["sum"] = "of another definition"
    with pytest.raises(
        JournalValueError, match=r"\$\[0\]: got a \S+ of another definition, of ano"
    ):
        decode(data)
    data[0]["fields"]["pose"]["sum"] = "of another definition"
    del data[0]["sum"]  # as in journals of earlier versions
    with pytest.raises(JournalValueError, match=r"\$\[0\]\.pose: got a"):
        decode(data)


def test_message_fields_need_not_fit_the_wire():
    message = PoseStamped()
    message.pose.position.x = np.float64(0.1)
    message.header.frame_id = None
    restored = through_json(message)
    assert restored.header.frame_id is None
    assert type(restored.pose.position.x) is np.float64


@pytest.mark.parametrize(
    "value",
    [
        Route([Waypoint(Point(1.0), Colour.GREEN)], {"a": None, "b": Waypoint(Point(2, 3))}),
        Ways.IN | Ways.OUT,
        Ways(0),
        Ways.IN,
    ],
    ids=str,
)
def test_classes_of_annotations_are_known(value):
    register_annotations(Values)
    restored = through_json(value)
    assert restored == value
    assert type(restored) is type(value)


def test_an_alias_of_an_enum_is_its_member():
    register_type(Colour)
    assert through_json(Colour.CRIMSON) is Colour.RED


def test_an_enum_that_is_a_number_stays_an_enum():
    register_type(Level)
    assert type(through_json([Level.LOW, 1])[0]) is Level


def test_what_post_init_computes_is_restored_as_it_was():
    register_type(Route)
    route = Route([])
    route.length = 7.5
    assert through_json(route).length == 7.5


def test_a_field_that_is_new_has_its_default():
    register_type(Waypoint)
    data = encode(Waypoint(Point(1.0)))
    del data["fields"]["colour"]
    assert decode(data) == Waypoint(Point(1.0))


def test_register_type_is_a_decorator_and_takes_functions_for_other_classes():
    assert register_type(Stranger) is Stranger
    register_type(Socket, to_data=lambda s: {"address": s.address}, from_data=lambda d: Socket(**d))
    assert through_json([Socket("a:1"), Stranger(2)]) == [Socket("a:1"), Stranger(2)]


def test_read_only_views_are_kept_as_what_they_show():
    register_type(Route)
    value = {"route": Route([]), "list": [1, [2]], "pose": PoseStamped(), "array": np.zeros(2)}
    view = read_only(value, "k")
    restored = through_json(view)
    assert type(restored["route"]) is Route
    assert type(restored["list"][1]) is list
    assert type(restored["pose"]) is PoseStamped
    assert through_json([view["list"], (view["pose"],)]) == [[1, [2]], (PoseStamped(),)]


class Tangle:
    def __reduce__(self):
        raise AssertionError("journals do not pickle")


LOOP: list = []
LOOP.append(LOOP)


@pytest.mark.parametrize(
    ("value", "place", "kind"),
    [
        (threading.Lock(), "", type(threading.Lock())),
        ({"a": [1, Tangle()]}, ".a[1]", Tangle),
        ({(1, 2): Tangle()}, "[(1, 2)]", Tangle),
        (Stranger(), "", Stranger),
        (Colour.RED, "", Colour),
        (MyDict(), "", MyDict),
        (lambda: None, "", type(lambda: None)),
        (Stranger, "", type),
        (np.array([Tangle()]), "", np.ndarray),
        (np.ma.masked_array([1]), "", np.ma.MaskedArray),
        (1j, "", complex),
    ],
    ids=lambda value: value if isinstance(value, str) else type(value).__name__,
)
def test_what_cannot_be_kept_is_named(value, place, kind):
    with pytest.raises(NotDurableError) as caught:
        encode(value, key="route", path="/PATROL/PLAN")
    error = caught.value
    assert (error.key, error.path, error.place, error.kind) == (
        "route",
        "/PATROL/PLAN",
        place,
        kind,
    )
    assert "transient=['route']" in str(error)
    assert isinstance(error, TypeError)


def test_a_value_that_contains_itself_is_refused():
    with pytest.raises(NotDurableError, match="nested"):
        encode(LOOP, key="k")


def test_a_function_of_the_user_that_raises_is_told():
    register_type(Socket, to_data=lambda s: s.nothing, from_data=Socket)
    with pytest.raises(NotDurableError) as caught:
        encode([Socket("a")], key="k")
    assert isinstance(caught.value.__cause__, AttributeError)
    register_type(Socket, to_data=lambda s: s.address, from_data=lambda d: d.nothing)
    with pytest.raises(JournalValueError, match="from_data"):
        through_json(Socket("a"))


@pytest.mark.parametrize(
    "arguments",
    [("Stranger",), (Socket,), (WithInitVar,)],
    ids=str,
)
def test_what_cannot_register_by_itself_is_refused(arguments):
    with pytest.raises(InvalidStateError, match="register_type"):
        register_type(*arguments)
    with pytest.raises(InvalidStateError, match="both"):
        register_type(Socket, to_data=str)


NOT_A_VALUE = [
    {"$nothing": 1},
    {"$type": "os:system", "fields": {}},
    {"$type": "tests.smachpy.durable.kept_types:Stranger", "fields": {}},
    {"$enum": "signal:Signals", "name": "SIGKILL"},
    {"$custom": "builtins:eval", "data": "1"},
    {"$msg": "os/system", "fields": {}},
    {"$msg": "std_msgs/String", "fields": {"nothing": 1}},
    {"$msg": "std_msgs/String"},
    {"$ros2": "std_msgs/msg/String", "distro": "no", "fields": {"data": ""}},
    {"$array": "AAAA", "dtype": "|O", "shape": [1]},
    {"$array": "AAAA", "dtype": "<f8", "shape": [1]},
    {"$array": "!", "dtype": "<f8", "shape": [1]},
    {"$bytes": "?"},
    {"$bytes": 5},
    {"$float": "one"},
    {"$set": [[1]]},
    {"$tuple": 5},
    {"$items": [[1]]},
    {"$datetime": "never", "fold": 0},
    {"$datetime": "2026-01-01T00:00:00", "fold": 0, "zone": "Nowhere/At_all"},
    {"$datetime": "2026-01-01T00:00:00", "fold": 0, "zone": "../../etc/passwd"},
    {"$time": ["a"]},
    {"$path": 5},
    {"$int": 5},
]


@pytest.mark.parametrize("data", NOT_A_VALUE, ids=str)
def test_data_that_is_no_value_is_refused_with_its_place(data):
    with pytest.raises(JournalValueError) as caught:
        decode({"a": [data]})
    assert caught.value.place.startswith("$.a[0]")


def test_a_class_that_is_registered_is_no_other_kind_of_class():
    register_type(Colour)
    register_type(Stranger)
    for data in (
        {"$type": "tests.smachpy.durable.kept_types:Colour", "fields": {}},
        {"$enum": "tests.smachpy.durable.kept_types:Stranger", "name": "x"},
        {"$custom": "tests.smachpy.durable.kept_types:Stranger", "data": 1},
        {"$type": "tests.smachpy.durable.kept_types:Stranger", "fields": {"z": 1}},
    ):
        assert kept_types.__name__ in str(data)
        with pytest.raises(JournalValueError):
            decode(data)


def test_data_nested_too_deeply_is_refused():
    data: list = []
    for _ in range(100_000):
        data = [data]
    with pytest.raises(JournalValueError):
        decode(data)
