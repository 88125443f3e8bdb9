"""Userdata: windows, read-only values, typed fields, who wrote what."""

from __future__ import annotations

import copy
import dataclasses
import functools
import pickle
import threading
from collections import Counter, OrderedDict, defaultdict, deque
from collections.abc import Sized
from typing import ClassVar, Literal, NamedTuple, TypedDict

import pytest
from hypothesis import given
from hypothesis import strategies as st

import smachpy
from actionlib_core.interfaces.geometry_msgs.msg import Point, PoseStamped
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
from smachpy import CBState, InvalidStateError, StateMachine
from smachpy.events import UserdataWritten
from smachpy.userdata.user_data import Remapper, UserData, get_const


@dataclasses.dataclass
class Pose:
    x: float = 0.0
    tags: list = dataclasses.field(default_factory=list)

    def moved(self, dx):
        return Pose(self.x + dx, list(self.tags))

    def move(self, dx):
        self.x += dx


class Pair(NamedTuple):
    a: list
    b: int


class Slotted:
    __slots__ = ("__private", "a", "b")

    def __init__(self):
        self.a = [1]
        self.__private = 7

    def private(self):
        return self.__private


class Plain:
    def __init__(self):
        self.values = {"k": [1, 2]}

    def total(self):
        return sum(self.values["k"])

    def __len__(self):
        return 3

    def __getitem__(self, i):
        return self.values["k"][i]


def through_a_state(value, body, **keys):
    """Let `body` have `value` as an input-only key of a state."""
    sm = smachpy.StateMachine(["ok"])
    sm.userdata.v = value

    def run(ud):
        body(ud.v)
        return "ok"

    sm.add("A", smachpy.CBState(run, outcomes=["ok"], input_keys=["v"], **keys))
    return sm


@pytest.mark.parametrize(
    ("value", "change"),
    [
        ([1, 2], lambda v: v.append(3)),
        ([3, 1], lambda v: v.sort()),
        ([[1]], lambda v: v[0].append(2)),
        ({"a": [1]}, lambda v: v["a"].append(2)),
        ({"a": 1}, lambda v: v.update(b=2)),
        ({1, 2}, lambda v: v.add(3)),
        (bytearray(b"ab"), lambda v: v.extend(b"c")),
        (deque([1]), lambda v: v.popleft()),
        (OrderedDict(a=1), lambda v: v.pop("a")),
        (OrderedDict(a=1, b=2), lambda v: v.move_to_end("a")),
        (defaultdict(list, a=[1]), lambda v: v["a"].append(2)),
        (defaultdict(list), lambda v: v["a"].append(2)),
        (Counter("ab"), lambda v: v.update("c")),
        (([1],), lambda v: v[0].append(2)),
        (Pair([1], 2), lambda v: v.a.append(2)),
        (Pose(), lambda v: setattr(v, "x", 5.0)),
        (Pose(), lambda v: v.move(1.0)),
        (Pose(tags=["a"]), lambda v: v.tags.append("b")),
        (Slotted(), lambda v: v.a.append(2)),
        (Slotted(), lambda v: setattr(v, "a", 2)),
        (Plain(), lambda v: v.values["k"].append(3)),
        (Plain(), lambda v: delattr(v, "values")),
    ],
)
def test_input_only_values_cannot_be_changed(value, change):
    before = copy.deepcopy(value)
    sm = through_a_state(value, change)
    with pytest.raises(smachpy.ReadOnlyError, match="io_keys"):
        sm.execute()
    after = sm.userdata.v
    assert after is value
    if not isinstance(value, (Slotted, Plain)):
        assert after == before


def test_read_only_values_are_what_they_were():
    def look(v):
        assert isinstance(v, list)
        assert len(v) == 3
        assert v == [1, [2], Pose(1.0)]
        assert [1, [2], Pose(1.0)] == v
        assert list(v) == v
        assert v[1:] == [[2], Pose(1.0)]
        assert isinstance(v[2], Pose)
        assert v[2].moved(1.0) == Pose(2.0)
        assert v[2] == Pose(1.0)
        assert dataclasses.asdict(v[2]) == {"x": 1.0, "tags": []}
        assert dataclasses.replace(v[2], x=3.0) == Pose(3.0)
        assert repr(v[2]) == repr(Pose(1.0))
        assert sorted(v, key=str)

    through_a_state([1, [2], Pose(1.0)], look).execute()


def test_a_read_only_defaultdict_has_its_defaults():
    """A key that it does not have was a KeyError."""
    rooms = defaultdict(list, lab=[1])

    def look(v):
        assert isinstance(v, defaultdict)
        assert (v["lab"], v["hall"], v.get("hall")) == ([1], [], None)
        assert "hall" not in v

    through_a_state(rooms, look).execute()
    assert rooms == {"lab": [1]}
    with pytest.raises(smachpy.InvalidUserCodeError, match="KeyError: 'hall'"):
        through_a_state(defaultdict(None, lab=1), lambda v: v["hall"]).execute()


def test_read_only_objects_have_their_methods_length_and_items():
    def look(v):
        assert isinstance(v, Plain)
        assert (v.total(), len(v), v[1]) == (3, 3, 2)

    through_a_state(Plain(), look).execute()

    def look_slotted(v):
        assert (v.a, v.private(), hasattr(v, "b")) == ([1], 7, False)

    through_a_state(Slotted(), look_slotted).execute()


class Vector:
    def __init__(self, x):
        self.x = x

    def __add__(self, other):
        return type(self)(self.x + other.x)

    def copy(self):
        made = type(self).__new__(type(self))
        made.__dict__.update(self.__dict__)
        return made

    @classmethod
    def unit(cls):
        return cls(1)


class OfAbstract(Sized):  # its metaclass is ABCMeta
    def __init__(self, x):
        self.x = x

    def __len__(self):
        return self.x

    def copy(self):
        return type(self)(self.x)


class Listed:
    __slots__ = ("x",)

    def __init__(self, x):
        self.x = x

    def copy(self):
        return type(self)(*(getattr(self, name) for name in self.__slots__))


class Numbers(list):
    def copy(self):
        return type(self)(self)

    @classmethod
    def unit(cls):
        return cls([1])


@pytest.mark.parametrize(
    "make",
    [
        lambda v: v[0] + v[0],
        lambda v: v[0].copy(),
        lambda v: v[0].unit(),
        lambda v: v[1].copy(),
        lambda v: v[2].copy(),
        lambda v: v[3].copy(),
        lambda v: v[3].unit(),
    ],
)
def test_methods_of_read_only_values_make_objects_that_can_be_changed(make):
    def look(v):
        made = make(v)
        assert type(made) in {Vector, OfAbstract, Listed, Numbers}
        if isinstance(made, list):
            made.append(2)
        else:
            made.x = 2

    through_a_state([Vector(3), OfAbstract(3), Listed(3), Numbers([3])], look).execute()


def test_read_only_messages_are_equal_and_plain_like_others():
    def look(v):
        same = Point(1.0, 2.0, 3.0)
        assert v[0] == same
        assert same == v[0]
        assert v[0] != Point()
        assert v[0].to_dict() == {"x": 1.0, "y": 2.0, "z": 3.0}
        assert repr(v[0]) == repr(same)

    through_a_state([Point(1.0, 2.0, 3.0)], look).execute()


def test_copies_of_read_only_values_can_be_changed():
    def change(v):
        for made in (copy.copy(v), copy.deepcopy(v), pickle.loads(pickle.dumps(v)), list(v)):
            made.append(1)
            assert type(made) is list
        pose = copy.deepcopy(v[0])
        pose.x = 9.0

    value = [Pose()]
    through_a_state(value, change).execute()
    assert value == [Pose()]


def test_handles_are_handed_out_as_they_are():
    import threading

    lock = threading.Lock()
    seen = []
    through_a_state(lock, seen.append).execute()
    assert seen == [lock]
    through_a_state(print, seen.append).execute()
    assert seen[1] is print


def test_arrays_are_read_only_views():
    numpy = pytest.importorskip("numpy")
    array = numpy.zeros(3)

    def change(v):
        assert isinstance(v, numpy.ndarray)
        v[0] = 1.0

    with pytest.raises(smachpy.InvalidUserCodeError, match="read-only"):
        through_a_state(array, change).execute()
    assert array[0] == 0.0


def test_a_value_read_and_written_on_is_the_original_again():
    original = [Pose()]

    def hand_on(ud):
        ud.out = ud.v
        ud.pair = (ud.v[0], 1)
        return "ok"

    sm = smachpy.StateMachine(["ok"])
    sm.userdata.v = original
    sm.add(
        "A",
        smachpy.CBState(hand_on, outcomes=["ok"], input_keys=["v"], output_keys=["out", "pair"]),
        {"ok": "B"},
    )

    def change(ud):
        ud.out.append(1)
        ud.pair[0].x = 5.0
        return "ok"

    sm.add("B", smachpy.CBState(change, outcomes=["ok"], io_keys=["out", "pair"]))
    sm.execute()
    assert sm.userdata.out is original
    assert original[0].x == 5.0


@dataclasses.dataclass(frozen=True)
class Order:
    pose: Pose
    others: tuple = ()


@dataclasses.dataclass
class Link:
    next: object
    pose: object


def ring(pose):
    link = Link(None, pose)
    link.next = link
    return link


@pytest.mark.parametrize(
    ("make", "of"),
    [
        (lambda pose: dataclasses.replace(pose, x=2.0), lambda made: made),
        (lambda pose: Order(pose), lambda made: made.pose),
        (lambda pose: {"to": [Order(None, (pose,))]}, lambda made: made["to"][0].others[0]),
        (lambda pose: Pair(pose, 1), lambda made: made.a),
    ],
)
def test_what_is_made_of_read_only_values_can_be_changed_by_a_later_state(make, of):
    """It was told to declare the key of the first state with io_keys."""
    userdata = UserData()
    userdata.pose = Pose(tags=["a"])
    first = Remapper(userdata, ["pose"], ["order"])
    first.order = make(first.pose)
    of(Remapper(userdata, ["order"], ["order"]).order).tags.append("b")
    assert userdata.pose.tags == ["a", "b"]
    with pytest.raises(smachpy.ReadOnlyError):
        first.pose.tags.append("c")


def test_a_message_with_a_read_only_field_keeps_what_is_set_later():
    userdata = UserData()
    userdata.pose = PoseStamped()
    first = Remapper(userdata, ["pose"], ["goal"])
    goal = MoveBaseGoal(target_pose=first.pose)
    first.goal = goal
    Remapper(userdata, ["goal"], ["goal"]).goal.target_pose.header.frame_id = "map"
    assert userdata.goal is goal
    assert userdata.pose.header.frame_id == "map"


def test_a_record_with_itself_and_what_is_read_only_says_so():
    userdata = UserData()
    userdata.pose = Pose()
    window = Remapper(userdata, ["pose"], ["ring"])
    with pytest.raises(smachpy.ReadOnlyError, match="contains itself and values"):
        window.ring = ring(window.pose)
    window.ring = ring(1)


class Route:
    def __init__(self):
        self.places = [["shelf"]]

    @functools.cached_property
    def stops(self):
        return [self.places[0]]


def test_what_a_view_computes_once_is_of_the_object_itself():
    """A state that may change the value got what the view of another one had computed."""
    userdata = UserData()
    userdata.route = Route()
    view = Remapper(userdata, ["route"]).route
    assert view.stops == [["shelf"]]
    with pytest.raises(smachpy.ReadOnlyError):
        view.stops[0].append("dock")
    Remapper(userdata, ["route"], ["route"]).route.stops[0].append("dock")
    assert view.places == view.stops == [["shelf", "dock"]]


def test_io_keys_may_be_changed_in_place():
    sm = smachpy.StateMachine(["ok"])
    sm.userdata.v = [1]
    change = smachpy.CBState(lambda ud: ud.v.append(2) or "ok", outcomes=["ok"], io_keys=["v"])
    sm.add("A", change)
    sm.execute()
    assert sm.userdata.v == [1, 2]


def test_what_a_container_gets_as_input_only_is_read_only_inside_it():
    inner = smachpy.StateMachine(["ok"], input_keys=["v"])
    inner.add("A", smachpy.CBState(lambda ud: ud.v.append(2), outcomes=["ok"], io_keys=["v"]))
    sm = smachpy.StateMachine(["ok"])
    sm.userdata.v = [1]
    sm.add("INNER", inner)
    with pytest.raises(smachpy.ReadOnlyError):
        sm.execute()


json_like = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.text()
    | st.binary()
    | st.floats(allow_nan=False),
    lambda inner: (
        st.lists(inner)
        | st.dictionaries(st.text(), inner)
        | st.tuples(inner, inner)
        | st.frozensets(st.integers())
        | st.sets(st.integers())
    ),
    max_leaves=20,
)


@given(json_like)
def test_read_only_views_equal_their_originals(value):
    view = get_const(value)
    assert view == value
    assert isinstance(view, type(value))
    assert copy.deepcopy(view) == value
    from smachpy.userdata.readonly import writable

    assert writable(view) == value
    assert get_const(view) == value


# -- windows -----------------------------------------------------------------------------------


def test_userdata_as_attributes_and_items():
    ud = smachpy.UserData()
    ud.x = 1
    ud["y"] = 2
    assert (ud["x"], ud.y, "x" in ud, "z" in ud, ud.keys()) == (1, 2, True, False, ["x", "y"])
    del ud.x
    del ud["y"]
    assert ud.keys() == []
    with pytest.raises(KeyError):
        del ud.x
    ud._private = 3
    assert ud._private == 3
    assert ud.keys() == []
    del ud._private
    assert not hasattr(ud, "_private")


def test_loops_over_keys():
    """The first key was 0: "'int' object is not subscriptable"."""
    ud = smachpy.UserData()
    ud.update({"a": 1, "b": 2})
    assert list(ud) == ["a", "b"]
    assert list(Remapper(ud, ["c", "d"], remapping={"c": "b"})) == ["c"]
    assert [*zip(ud, ud, strict=True)] == [("a", "a"), ("b", "b")]


def test_update_extract_and_merge():
    ud = smachpy.UserData()
    ud.update({"a": 1, "b": [2]})
    part = ud.extract(["a", "b", "none"], {"here": "a"})
    assert (part.here, part.b) == (1, [2])
    assert part.b is not ud.b
    other = smachpy.UserData()
    other.merge(ud, ["a", "b"], {"a": "there"})
    assert (other.there, other.b) == (1, [2])
    assert copy.copy(ud).a == 1


def test_windows_into_windows():
    ud = smachpy.UserData()
    ud.x = 1
    outer = smachpy.Remapper(ud, ["y"], ["y"], {"y": "x"})
    inner = smachpy.Remapper(outer, ["z"], ["z"], {"z": "y"})
    inner.z = inner.z + 1
    assert ud.x == 2
    inner.update({"z": 7})
    assert inner["z"] == 7
    with pytest.raises(smachpy.UserDataKeyError):
        inner.y
    with pytest.raises(smachpy.UserDataKeyError):
        inner.y = 1


def test_declared_but_missing_key_says_its_name_in_the_container():
    sm = smachpy.StateMachine(["ok"], name="P")
    sm.userdata.goals = 1
    read = smachpy.CBState(lambda ud: ud.goal, outcomes=["ok"], input_keys=["goal"])
    sm.add("A", read, remapping={"goal": "gaols"})
    with pytest.raises(smachpy.UserDataKeyError, match=r"/P/A.*'gaols' \(remapped from 'goal'\)"):
        sm.execute()


def test_a_key_that_only_a_machine_above_has_is_told_with_what_to_try():
    read = smachpy.CBState(lambda ud: ud.goal, outcomes=["ok"], input_keys=["goal"])
    inner, sm = smachpy.StateMachine(["ok"]), smachpy.StateMachine(["ok"], name="P")
    inner.add("READ", read)
    sm.add("INNER", inner)
    sm.userdata.goal = "ok"
    way_out = r"'/P' has it\. Try input_keys=\['goal'\] of '/P/INNER'"
    with pytest.raises(smachpy.UserDataKeyError, match=way_out):
        sm.execute()
    inner.register_input_keys(["goal"])
    assert sm.execute() == "ok"
    inner.reset_userdata()
    with pytest.raises(smachpy.UserDataKeyError) as caught:
        inner.execute()
    assert "Try input_keys" not in str(caught.value)


def test_constants_are_the_states_own():
    seen = []
    sm = smachpy.StateMachine(["ok"])
    for label, value in (("A", 1), ("B", 2)):
        read = smachpy.CBState(lambda ud: seen.append(ud.speed) or "ok", outcomes=["ok"])
        sm.add(label, read, {"ok": "B"} if label == "A" else None, constants={"speed": value})
    sm.execute()
    sm.reset_userdata()
    sm.execute()
    assert seen == [1, 2, 1, 2]


def test_writes_are_events_with_path_key_and_value():
    def write(ud):
        ud.out = 5
        ud["out"] = 6
        return "ok"

    sm = smachpy.StateMachine(["ok"], name="P")
    state = smachpy.CBState(write, outcomes=["ok"], output_keys=["out"])
    sm.add("A", state, remapping={"out": "result"})
    events = []
    sm.subscribe(events.append)
    sm.execute()
    written = [e for e in events if isinstance(e, UserdataWritten)]
    assert [(e.path, e.key, e.value) for e in written] == [
        ("/P/A", "result", 5),
        ("/P/A", "result", 6),
    ]


# -- typed userdata ----------------------------------------------------------------------------


@dataclasses.dataclass
class Mission:
    battery: float = 1.0
    goals: list[str] = dataclasses.field(default_factory=list)
    mode: Literal["slow", "fast"] = "slow"
    note: str | None = None
    required: int = dataclasses.field(default=0)


class MissionDict(TypedDict, total=False):
    battery: float
    goals: list[str]


def test_typed_userdata_has_the_defaults_and_goes_back_to_them():
    sm = smachpy.StateMachine(["ok"], userdata_type=Mission)
    assert (sm.userdata.battery, sm.userdata.goals, sm.userdata.note) == (1.0, [], None)
    sm.userdata.battery = 0.5
    sm.userdata.goals.append("dock")
    sm.reset_userdata()
    assert (sm.userdata.battery, sm.userdata.goals) == (1.0, [])


@pytest.mark.parametrize(
    ("key", "good", "bad"),
    [
        ("battery", 1, "full"),
        ("goals", ["a"], ("a",)),
        ("mode", "fast", "warp"),
        ("note", None, 3),
        ("note", "x", b"x"),
    ],
)
def test_typed_userdata_checks_what_is_written(key, good, bad):
    sm = smachpy.StateMachine(["ok"], userdata_type=Mission)
    sm.userdata[key] = good
    with pytest.raises(smachpy.UserDataTypeError) as caught:
        sm.userdata[key] = bad
    assert (caught.value.key, caught.value.value) == (key, bad)


def test_typed_userdata_knows_its_keys():
    for kind in (Mission, MissionDict):
        sm = smachpy.StateMachine(["ok"], userdata_type=kind)
        with pytest.raises(smachpy.UserDataKeyError, match="Did you mean 'battery'"):
            sm.userdata.batery = 1.0


def test_typed_userdata_is_checked_with_the_machine():
    sm = smachpy.StateMachine(["ok"], userdata_type=Mission)
    read = smachpy.CBState(lambda ud: "ok", outcomes=["ok"], input_keys=["batery"])
    with pytest.raises(smachpy.InconsistentMachineError, match=r"no field of Mission.*'battery'"):
        with sm:
            smachpy.StateMachine.add("A", read)


def test_typed_userdata_is_checked_in_a_machine_that_was_built_without_a_with_block():
    machine = smachpy.StateMachine(["done"], userdata_type=Mission, name="M")
    machine.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"], input_keys=["batery"]))
    with pytest.raises(smachpy.InconsistentMachineError, match=r"no field of Mission.*'battery'"):
        machine.execute()
    report = smachpy.check(machine)
    assert [problem.rule for problem in report] == ["inconsistent"]


def test_states_write_typed_userdata():
    sm = smachpy.StateMachine(["ok"], userdata_type=Mission)

    def write(ud):
        ud.battery = "low"
        return "ok"

    sm.add("A", smachpy.CBState(write, outcomes=["ok"], output_keys=["battery"]))
    with pytest.raises(smachpy.UserDataTypeError, match="'low'"):
        sm.execute()


class OfClass:
    limit: ClassVar[int] = 3
    goals: list[str] = []  # noqa: RUF012  as users write


class OfSubclass(OfClass):
    battery: float = 1.0


def test_defaults_of_a_class_are_of_each_machine():
    """What one machine had changed in place was the default of the next; those of a base lacked."""
    sm = smachpy.StateMachine(["ok"], userdata_type=OfSubclass)
    sm.userdata.goals.append("dock")
    for other in (sm, smachpy.StateMachine(["ok"], userdata_type=OfSubclass)):
        other.reset_userdata()
        assert (other.userdata.goals, other.userdata.battery) == ([], 1.0)


def test_a_variable_of_the_class_is_no_key():
    sm = smachpy.StateMachine(["ok"], userdata_type=OfClass)
    assert sm.userdata.keys() == ["goals"]
    with pytest.raises(smachpy.UserDataKeyError, match=r"no field of OfClass: got 'limit'"):
        sm.userdata.limit = 4


def test_an_annotation_that_cannot_be_read_is_told():
    class Odd:
        pose: "OnlyForTypeCheckers"  # noqa: F821, UP037  as users write

    with pytest.raises(
        smachpy.InvalidStateError, match=r"Odd: .*'OnlyForTypeCheckers' is not defined.* Try to"
    ):
        smachpy.StateMachine(["ok"], userdata_type=Odd)


def test_userdata_type_without_fields_is_told():
    class Nothing:
        pass

    for kind in (Nothing, int):
        with pytest.raises(smachpy.InvalidStateError, match="userdata_type"):
            smachpy.StateMachine(["ok"], userdata_type=kind)


@pytest.mark.parametrize(
    ("value", "change"),
    [
        ([1], lambda v: v.append(2)),
        ({"a": [{1}]}, lambda v: v["a"][0].add(2)),
        ((Pose(tags=["a"]),), lambda v: v[0].tags.append("b")),
        (Slotted(), lambda v: v.a.append(2)),
        (OrderedDict(a=deque([[1]])), lambda v: v["a"][0].clear()),
        (Pair([1], 2), lambda v: v.a.append(2)),
    ],
)
def test_a_refused_change_names_the_key_and_the_state(value, change):
    with pytest.raises(smachpy.ReadOnlyError) as raised:
        through_a_state(value, change).execute()
    assert (raised.value.key, raised.value.path) == ("v", "/SM_ROOT/A")
    assert "/SM_ROOT/A" in str(raised.value)
    with pytest.raises(smachpy.ReadOnlyError) as raised:
        change(get_const(value))
    assert (raised.value.key, raised.value.path) == ("", "")


def test_a_value_of_a_wrong_type_names_the_state():
    @dataclasses.dataclass
    class Mission:
        v: int = 0

    def write(ud):
        ud.v = "x"

    sm = smachpy.StateMachine(["ok"], userdata_type=Mission)
    sm.add("A", smachpy.CBState(write, outcomes=["ok"], output_keys=["v"]))
    with pytest.raises(smachpy.UserDataTypeError) as raised:
        sm.execute()
    assert (raised.value.key, raised.value.path) == ("v", "/SM_ROOT/A")


def test_a_list_is_copied_again_only_when_it_has_changed():
    value = [(1.0, 2.0), "a", 3]
    userdata = smachpy.UserData()
    userdata.v = value
    window = smachpy.Remapper(userdata, ["v"])
    first = window.v
    assert window.v is first
    for change, wanted in [
        (lambda: value.append(4), [(1.0, 2.0), "a", 3, 4]),
        (lambda: value.__setitem__(2, 3.0), [(1.0, 2.0), "a", 3.0, 4]),
        (lambda: value.reverse(), [4, 3.0, "a", (1.0, 2.0)]),
        (lambda: setattr(userdata, "v", [1]), [1]),
        (lambda: setattr(userdata, "v", [True]), [True]),
    ]:
        change()
        assert list(map(repr, window.v)) == list(map(repr, wanted))
        with pytest.raises(smachpy.ReadOnlyError):
            window.v.append(1)
    assert first == [(1.0, 2.0), "a", 3]


@pytest.mark.parametrize("inner", [[1], {"a": 1}, Pose(), ([1],), {1}])
def test_what_changes_inside_a_list_is_seen_at_the_next_read(inner):
    userdata = smachpy.UserData()
    userdata.v = [1, inner]
    window = smachpy.Remapper(userdata, ["v"])
    assert window.v == [1, inner]
    target = inner[0] if isinstance(inner, tuple) else inner
    if isinstance(target, Pose):
        target.x = 9.0
    elif isinstance(target, dict):
        target["b"] = 2
    elif isinstance(target, set):
        target.add(5)
    else:
        target.append(2)
    assert window.v == [1, inner]


# -- views that are handed out again ------------------------------------------------------------


class Cup:
    def __init__(self, volume):
        self.volume = volume


class Slots:
    __slots__ = ("volume",)

    def __init__(self, volume):
        self.volume = volume


NESTED = {
    "lists": lambda: [[1, 2], [3, [4]]],
    "dicts": lambda: [{"x": 1, "y": {"z": [2]}}],
    "dict": lambda: {"a": [1, {"b": 2}], "c": 3},
    "objects": lambda: [Cup(1), [Cup(2)]],
}


def window(value):
    ud = UserData()
    ud.v = value
    return Remapper(ud, ["v"])


@pytest.mark.parametrize("kind", NESTED)
def test_a_nested_value_that_has_not_changed_is_not_copied_again(kind):
    window_of = window(NESTED[kind]())
    assert window_of.v is window_of.v


def set_item(where, key, item):
    where[key] = item


CHANGES = {
    "an item deep in lists": ("lists", lambda v: v[1][1].append(5)),
    "an item of equal value": ("lists", lambda v: set_item(v[0], 0, True)),
    "a list in place of another": ("lists", lambda v: set_item(v, 0, [1, 3])),
    "a shorter list": ("lists", lambda v: v[0].pop()),
    "a list in dicts": ("dicts", lambda v: v[0]["y"]["z"].append(3)),
    "a key": ("dicts", lambda v: v[0].update(w=0)),
    "a key in place of another": ("dict", lambda v: v.update(d=v.pop("c"))),
    "the order of keys": ("dict", lambda v: v.update(a=v.pop("a"))),
    "a value in a dict": ("dict", lambda v: v["a"][1].update(b=3)),
    "another object": ("objects", lambda v: set_item(v, 0, Cup(3))),
    "an object in a list": ("objects", lambda v: v[1].append(Cup(3))),
}


def plain(value):
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return [(key, plain(item)) for key, item in value.items()]
    return (type(value).__name__, value if isinstance(value, (int, bool)) else value.volume)


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_is_seen_by_the_next_read(change):
    kind, do = CHANGES[change]
    value = NESTED[kind]()
    window_of = window(value)
    before = plain(window_of.v)
    do(value)
    assert plain(window_of.v) == plain(value) != before


def test_what_an_object_holds_is_seen_through_every_view():
    cup = Cup([1])
    window_of = window([cup])
    seen = window_of.v
    cup.volume = [2]
    assert seen[0].volume == window_of.v[0].volume == [2]


@pytest.mark.parametrize("make", [lambda: {1, 2}, lambda: Slots(1), lambda: ([1],)])
def test_what_cannot_be_compared_is_copied_at_each_read(make):
    value = [make()]
    window_of = window(value)
    window_of.v
    changed = value[0]
    if isinstance(changed, set):
        changed.add(3)
        assert window_of.v[0] == {1, 2, 3}
    elif isinstance(changed, tuple):
        changed[0].append(2)
        assert window_of.v[0] == ([1, 2],)
    else:
        changed.volume = 2
        assert window_of.v[0].volume == 2


def test_a_view_that_is_handed_out_again_is_still_read_only():
    window_of = window([[1]])
    for _ in range(2):
        with pytest.raises(smachpy.ReadOnlyError):
            window_of.v[0].append(2)


# -- values of a run ------------------------------------------------------------------------------


def counting(kind=StateMachine, **options):
    def count(userdata):
        userdata.found.append(len(userdata.found))
        return "done"

    container = kind(outcomes=["done"], userdata={"found": []}, **options)
    container.add("COUNT", CBState(count, outcomes=["done"], io_keys=["found"]))
    return container


def test_every_run_begins_with_a_copy_of_the_values_of_a_run():
    machine = counting()
    for _ in range(3):
        assert machine.execute() == "done"
        assert machine.userdata.found == [0]


def test_a_nested_machine_begins_with_them_each_time():
    inner = counting(output_keys=["found"])
    rounds = iter(["again", "again", "done"])
    outer = StateMachine(outcomes=["done"])
    outer.add("IN", inner, {"done": "NEXT"})
    outer.add("NEXT", CBState(lambda ud: next(rounds), outcomes=["again", "done"]), {"again": "IN"})
    assert outer.execute() == "done"
    assert outer.userdata.found == [0]


def test_input_keys_come_after_the_values_of_a_run():
    machine = counting(input_keys=["found"])
    values = UserData()
    values.found = [7]
    machine.execute(values)
    assert machine.userdata.found == [7, 1]


@pytest.mark.parametrize(
    ("values", "text"),
    [
        (5, "userdata: got 5"),
        ({"lock": threading.Lock()}, "userdata: got a value that cannot be set here"),
    ],
)
def test_values_of_a_run_that_cannot_be_copied_are_an_error(values, text):
    with pytest.raises(InvalidStateError, match=text):
        StateMachine(outcomes=["done"], userdata=values)


def test_values_of_a_run_have_the_types_of_typed_userdata():
    @dataclasses.dataclass
    class Count:
        found: list[int]

    machine = counting(userdata_type=Count)
    assert machine.execute() == "done"
    with pytest.raises(InvalidStateError, match="found"):
        StateMachine(outcomes=["done"], userdata_type=Count, userdata={"found": "none"})


# -- values that contain themselves ----------------------------------------------------------------


def places(kind):
    """Return places with their neighbours, which have each other."""
    hall, lab = kind(), kind()
    if kind is dict:
        hall["next"], lab["next"], hall["name"], lab["name"] = [lab], [hall], "hall", "lab"
    else:
        hall += ["hall", (lab,)]
        lab += ["lab", (hall,)]
    return hall


@pytest.mark.parametrize("kind", [dict, list])
def test_a_value_that_contains_itself_is_kept_and_read(kind):
    """A map of places ended the mission with a RecursionError that named no key."""
    seen = []

    def write(userdata):
        userdata.places = places(kind)
        return "ok"

    def read(userdata):
        hall = userdata.places
        back = hall["next"][0]["next"][0] if kind is dict else hall[1][0][1][0]
        assert back is hall
        with pytest.raises(smachpy.ReadOnlyError, match="places"):
            back.clear()
        seen.append(userdata.places is not None)
        return "ok"

    sm = smachpy.StateMachine(["ok"])
    sm.add("W", smachpy.CBState(write, outcomes=["ok"], output_keys=["places"]), {"ok": "R"})
    sm.add("R", smachpy.CBState(read, outcomes=["ok"], input_keys=["places"]))
    buffer = sm.event_buffer()
    assert sm.execute() == "ok"
    assert seen == [True]
    assert len(buffer.read()) > 4
    buffer.close()


def test_a_value_with_itself_and_what_is_read_only_says_so():
    def mix(userdata):
        box = [userdata.read]
        box.append(box)
        userdata.out = box
        return "ok"

    sm = smachpy.StateMachine(["ok"])
    sm.userdata.read = [1]
    sm.add("MIX", smachpy.CBState(mix, outcomes=["ok"], input_keys=["read"], output_keys=["out"]))
    with pytest.raises(smachpy.InvalidUserCodeError, match=r"Try copy\.deepcopy"):
        sm.execute()


def test_repr_is_complete_while_another_branch_writes():
    """It raised: dictionary changed size during iteration."""
    userdata = UserData()

    class Shown:
        def __repr__(self):
            userdata.other = 1  # as another thread does meanwhile
            return "shown"

    userdata.first = Shown()
    userdata.last = 2
    assert repr(userdata) == "UserData(first=shown, last=2)"
