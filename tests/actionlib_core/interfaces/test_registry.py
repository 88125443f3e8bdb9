"""Finding definitions and making their classes, each once."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from actionlib_core import interfaces
from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces._registry import Registry, parse_name
from actionlib_core.interfaces._sources import BUNDLED, PATH_VARIABLE, Sources


def write(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return root


@pytest.fixture
def course(tmp_path: Path) -> Path:
    """The interfaces of a robotics course."""
    return write(
        tmp_path,
        {
            "my_pkg/action/Turn.action": "# Angle to turn by.\nfloat32 angle\n---\nbool done\n---\nfloat32 left\n",
            "my_pkg/action/Demo_action.action": "int32 count\n---\nstring final_count\n---\nint32 current_number\n",
            "my_pkg/msg/Age.msg": "float32 years\nfloat32 months\nfloat32 days\n",
            "my_pkg/srv/Echo.srv": "string in\n---\nstring out\n",
        },
    )


def registry_of(*folders: Path) -> Registry:
    return Registry(Sources(folders=[*folders, BUNDLED]))


def test_the_courses_files(course: Path) -> None:
    registry = registry_of(course)
    turn = registry.action("my_pkg/Turn")
    assert turn.__name__ == "TurnAction"
    assert registry.action("my_pkg/action/Turn") is registry.action("my_pkg/TurnAction") is turn
    goal = turn().action_goal.goal  # type: ignore[attr-defined]
    goal.angle = 1.5
    assert registry.message("my_pkg/TurnGoal").from_bytes(goal.to_bytes()) == goal
    assert registry.message("my_pkg/Demo_actionActionFeedback").__slots__ == [
        "header",
        "status",
        "feedback",
    ]
    assert registry.message("my_pkg/msg/Age")(1, 2, 3).days == 3  # type: ignore[call-arg, attr-defined]
    echo = registry.service("my_pkg/srv/Echo")
    request = echo._request_class(in_="hello")  # type: ignore[call-arg]
    assert request.in_ == getattr(request, "in") == "hello"  # type: ignore[attr-defined]
    assert echo._request_class(**{"in": "hello"}) == request  # type: ignore[arg-type]
    assert request.to_dict() == {"in": "hello"}
    assert echo._request_class.from_dict({"in": "hello"}) == request
    assert registry.message("my_pkg/EchoResponse") is echo._response_class
    assert registry.sources.names("action", "my_pkg") == ["Demo_action", "Turn"]


def test_a_path_may_be_the_package_itself(course: Path) -> None:
    assert registry_of(course / "my_pkg").message("my_pkg/Age").__slots__[0] == "years"


def test_environment_and_added_paths(
    course: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nearer = write(tmp_path / "nearer", {"my_pkg/msg/Age.msg": "int32 years\n"})
    monkeypatch.setenv(PATH_VARIABLE, os.pathsep.join(["", str(course), str(tmp_path / "gone")]))
    registry = Registry()
    assert registry.message("my_pkg/Age")._slot_types == ["float32"] * 3
    registry = Registry()
    registry.add_path(nearer)
    registry.add_path(nearer)
    assert registry.message("my_pkg/Age")._slot_types == ["int32"]
    with pytest.raises(InterfaceError, match=r"gone \(missing\)"):
        registry.message("my_pkg/Nothing")


def test_add_path_refuses_what_is_none(tmp_path: Path) -> None:
    with pytest.raises(InterfaceError, match="expected an existing folder"):
        interfaces.add_path(tmp_path / "gone")
    with pytest.raises(InterfaceError, match="holds no interfaces"):
        interfaces.add_path(tmp_path)


def test_errors_name_file_and_line(tmp_path: Path) -> None:
    path = "my_pkg/action/Bad.action"
    write(tmp_path, {path: "int32 a\n---\n# result\nString name\n---\nbool 1b\n"})
    registry = registry_of(tmp_path)
    with pytest.raises(InterfaceError) as caught:
        registry.action("my_pkg/Bad")
    text = str(caught.value)
    assert f"{tmp_path / path}:4: unknown type: got 'my_pkg/String'" in text
    assert "Did you mean 'string' or 'std_msgs/String'?" in text
    assert "    String name\n    ^" in text
    assert f"{tmp_path / path}:6: invalid field name" in text
    assert PATH_VARIABLE in text


def test_unreadable_file(tmp_path: Path) -> None:
    write(tmp_path, {"my_pkg/msg/Bad.msg": ""})
    (tmp_path / "my_pkg/msg/Bad.msg").write_bytes(b"int32 a # \xff\n")
    with pytest.raises(InterfaceError, match=r"Bad\.msg: got a byte that is no UTF-8"):
        registry_of(tmp_path).message("my_pkg/Bad")


@pytest.mark.parametrize(
    ("call", "name", "said"),
    [
        ("get_message", "geometry_msgs/Posestamped", "Did you mean 'geometry_msgs/PoseStamped'"),
        ("get_action", "move_base_msgs/Movebase", "Did you mean 'move_base_msgs/MoveBase'"),
        ("get_service", "std_srvs/trigger", "Did you mean 'std_srvs/Trigger'"),
        ("get_message", "String", "expected 'package/Name'"),
        ("get_message", "a/b/c", "expected 'package/Name'"),
        ("get_message", "../etc/passwd", "expected 'package/Name'"),
        ("get_message", f"{'a' * 5000}/B", "unknown message"),  # longer than a file's name may be
        ("get_service", f"b_srvs/{'A' * 5000}", "unknown service"),
    ],
)
def test_unknown_names(call: str, name: str, said: str) -> None:
    with pytest.raises(InterfaceError) as caught:
        getattr(interfaces, call)(name)
    assert said in str(caught.value)


def test_recursion_is_found(tmp_path: Path) -> None:
    write(tmp_path, {"p/msg/A.msg": "B[] b\n", "p/msg/B.msg": "int32 x\nA a\n"})
    with pytest.raises(InterfaceError, match=r"p/A: the type contains itself: p/A -> p/B -> p/A"):
        registry_of(tmp_path).message("p/A")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("int32[99999999999] x", r":2: got a message of 399,999,999,997 bytes at least; expected"),
        ("std_msgs/Empty[99999999999] x", r"got a message of 100,000,000,000 bytes at least"),
        ("std_msgs/String[30000000] x", r"got a message of 120,000,001 bytes at least"),
        (f"int32[{'9' * 5000}] x", r":2: int32\[9{34}\.\.\.: got a message of 10\^4999 bytes"),
    ],
)
def test_message_that_no_memory_holds_is_refused_at_its_field(text: str, said: str) -> None:
    with pytest.raises(InterfaceError, match=said) as caught:
        registry_of().define("msg", "p/Huge", f"int8 a\n{text}\n")
    assert str(caught.value).endswith("    ^")
    assert registry_of().define("msg", "p/Huge", "uint8[6220800] photo\n")().photo == bytes(6220800)


def test_large_arrays_of_large_arrays_are_refused() -> None:
    registry = registry_of()
    registry.define("msg", "p/Row", "float64[10000] values\n")
    with pytest.raises(InterfaceError, match=r"p/msg/Map .*:2: got a message of 800,000,001 bytes"):
        registry.define("msg", "p/Map", "bool b\nRow[10000] rows\n")
    assert len(registry.define("msg", "p/Map", "Row[100] rows\n")().rows) == 100


def test_types_nested_without_an_end_are_refused_and_fifty_are_not(tmp_path: Path) -> None:
    files = {f"p/msg/T{n}.msg": f"int8 a\nT{n - 1} inner\n" for n in range(1, 1500)}
    write(tmp_path, {"p/msg/T0.msg": "int32 x\n", **files})
    deepest = registry_of(tmp_path).message("p/T49")
    message = deepest.from_bytes(bytes(range(49)) + b"\1\0\0\0")
    assert deepest.from_yaml(message.to_yaml()) == message
    for top in (50, 1499):
        with pytest.raises(InterfaceError, match=r":2: got over 50 types in one another; expected"):
            registry_of(tmp_path).message(f"p/T{top}")


def grow(registry: Registry, text: str) -> None:
    """Define T0, T1, ... without an end, each of the one before."""
    for n in range(1, 1500):
        registry.define("msg", f"p/T{n}", text.replace("BEFORE", f"T{n - 1}"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("BEFORE inner\nint8[9] largest\n", r"p/msg/T50 .*:1: got 51 types in one another"),
        ("BEFORE[1] x\n", r"p/msg/T20 .*:1: got 20 arrays in one another; expected 19 at most"),
        ("BEFORE a\nBEFORE b\n", r"p/msg/T14 .*:1: got 16,384 fields, nested ones counted"),
    ],
)
def test_types_that_grow_one_by_one_are_refused_where_it_is_too_much(text: str, said: str) -> None:
    registry = registry_of()
    registry.define("msg", "p/T0", "int32 x\n")
    with pytest.raises(InterfaceError, match=said):
        grow(registry, text)
    made = registry.message("p/T10")
    assert made.from_bytes(made().to_bytes()) == made()


def test_as_many_arrays_in_one_another_as_python_takes_work() -> None:
    registry = registry_of()
    registry.define("msg", "p/T0", "int32 x\n")
    with pytest.raises(InterfaceError):
        grow(registry, "BEFORE[1] x\n")
    made = registry.message("p/T19")
    assert made.from_bytes(b"\7\0\0\0").to_bytes() == b"\7\0\0\0"


def test_define_is_checked_and_forgotten_on_error() -> None:
    registry = registry_of()
    for bad in ("string a\n---\nString b\n---\n", "int32 a\n"):
        with pytest.raises(InterfaceError):
            registry.define("action", "inline_pkg/Turn", bad)
    made = registry.define("action", "inline_pkg/Turn", "float32 angle\n---\n---\n")
    assert made is registry.action("inline_pkg/Turn")
    assert registry.message("inline_pkg/TurnGoal").__slots__ == ["angle"]
    assert registry.define("action", "inline_pkg/Turn", "float32 angle\n---\n---\n") is made
    with pytest.raises(InterfaceError, match="defines differently"):
        registry.define("action", "inline_pkg/Turn", "float64 angle\n---\n---\n")
    with pytest.raises(InterfaceError, match="expected inline_pkg/msg/X"):
        registry.define("msg", "inline_pkg/srv/X", "")
    service = registry.define("srv", "inline_pkg/Ask", "---\nbool yes\n")
    assert service is registry.service("inline_pkg/Ask")


def test_names() -> None:
    assert parse_name("a/B") == ("a", None, "B")
    assert parse_name("a/action/B") == ("a", "action", "B")


def test_one_class_however_many_threads_ask() -> None:
    registry = registry_of()
    found: list[type] = []
    barrier = threading.Barrier(8)

    def ask() -> None:
        barrier.wait(60)
        found.append(registry.message("move_base_msgs/MoveBaseAction"))

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert len(found) == 8
    assert len(set(found)) == 1


def test_full_text_holds_all_nested_definitions() -> None:
    text = interfaces.get_message("geometry_msgs/PoseStamped")._full_text
    assert text.startswith("# A pose in the frame")
    for name in ("std_msgs/Header", "geometry_msgs/Pose", "geometry_msgs/Point"):
        assert f"{'=' * 80}\nMSG: {name}\n" in text
    assert text.count("MSG: ") == 4


def test_a_definition_cannot_take_the_name_of_a_part_of_another() -> None:
    registry = registry_of()
    registry.define("action", "inline_pkg/Turn", "float32 angle\n---\n---\n")
    with pytest.raises(InterfaceError, match="there is 'inline_pkg/TurnGoal' already"):
        registry.define("msg", "inline_pkg/TurnGoal", "int32 other\n")
