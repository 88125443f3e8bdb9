"""`actionlib interface`: show, list, stubs."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import pytest

from actionlib_core import interfaces
from actionlib_core.cli import UsageError, interface
from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces import _cli
from actionlib_core.interfaces._registry import registry


def run(*arguments: str) -> int:
    parser = argparse.ArgumentParser()
    interface.register(parser.add_subparsers())
    args = parser.parse_args(["interface", *arguments])
    return int(args.run(args))


def test_show_writes_nested_types_out(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("show", "move_base_msgs/MoveBase") == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown[:5] == [
        "# Where to drive to; the frame of the header is that of the pose.",
        "geometry_msgs/PoseStamped target_pose",
        "\tHeader header",
        "\t\tuint32 seq",
        "\t\ttime stamp",
    ]
    assert shown.count("---") == 2
    assert run("show", "-a", "move_base_msgs/MoveBase") == 0
    assert "\t\ttime stamp  # time of the data, 0: not said" in capsys.readouterr().out


def test_show_of_parts_and_of_names_with_two_kinds() -> None:
    assert _cli.show("move_base_msgs/MoveBaseGoal").startswith("# Where")
    both = _cli.show("control_msgs/GripperCommand")
    assert "# control_msgs/msg/GripperCommand\n" in both
    assert "# control_msgs/action/GripperCommand\n" in both
    assert "# control" not in _cli.show("control_msgs/msg/GripperCommand")
    assert _cli.show("std_srvs/Empty") == "---"
    with pytest.raises(InterfaceError, match="unknown message"):
        _cli.show("std_srvs/Nothing")


def test_show_keeps_string_constants_whole() -> None:
    interfaces.define_message("test_cli_pkg/Inner", "string A=x # y\nint32 a # c\n")
    interfaces.define_message("test_cli_pkg/Outer", "Inner inner\n")
    assert _cli.show("test_cli_pkg/Outer") == "Inner inner\n\tstring A=x # y\n\tint32 a"


def test_show_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("show", "actionlib_msgs/GoalStatus", "--json") == 0
    (part,) = json.loads(capsys.readouterr().out)["actionlib_msgs/msg/GoalStatus"]
    assert part["md5"] == "d388f9b87b3c471f784434d671988d4a"
    assert part["constants"][1]["name"] == "ACTIVE"
    assert [f["name"] for f in part["fields"]] == ["goal_id", "status", "text"]


def test_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("list") == 0
    text = capsys.readouterr().out
    assert "Messages:\n    actionlib_msgs/msg/GoalID\n" in text
    assert "Services:\n" in text
    assert "    move_base_msgs/action/MoveBase\n" in text
    assert run("list", "-a", "--json") == 0
    assert list(json.loads(capsys.readouterr().out)) == ["action"]


def test_stubs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Other tests in this process have defined interfaces, also some that cannot be read.
    monkeypatch.setattr(registry.sources, "_inline", {})
    monkeypatch.setattr(registry.sources, "_added", [])
    assert run("stubs", str(tmp_path), "std_srvs", "--json") == 0
    written = [Path(p) for p in json.loads(capsys.readouterr().out)]
    assert [p.relative_to(tmp_path).as_posix() for p in written] == [
        "std_srvs/__init__.pyi",
        "std_srvs/srv.pyi",
    ]
    interfaces.define_message("test_cli_pkg/Note", "string text\n")
    assert run("stubs", str(tmp_path)) == 0
    assert "class Note(_Message):" in (tmp_path / "test_cli_pkg/msg.pyi").read_text()
    with pytest.raises(InterfaceError, match="got package 'gone'"):
        run("stubs", str(tmp_path), "gone")
    (tmp_path / "file").touch()
    with pytest.raises(UsageError, match="/file': cannot be written: "):
        run("stubs", str(tmp_path / "file"), "std_srvs")


def test_show_what_only_ros2_has() -> None:
    shown = _cli.show("nav2_msgs/action/NavigateToPose").splitlines()
    assert shown[:3] == [
        "geometry_msgs/PoseStamped pose",
        "\tstd_msgs/Header header",
        "\t\tbuiltin_interfaces/Time stamp",
    ]
    assert shown.count("---") == 2
    parts = _cli.describe("lifecycle_msgs/GetState")["lifecycle_msgs/srv/GetState"]
    assert [part["type"] for part in parts] == [
        "lifecycle_msgs/srv/GetState_Request",
        "lifecycle_msgs/srv/GetState_Response",
    ]
    with pytest.raises(InterfaceError, match="nav2_msgs/NavigateToPosse"):
        _cli.show("nav2_msgs/NavigateToPosse")


def test_show_files_of_the_user_in_either_dialect(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        "msg/Lift.msg": "string<=9 name 'a'\n",
        "action/Up.action": "cli_msgs/msg/Lift lift\n---\n---\nfloat32[<=2] left\n",
        "msg/Old.msg": "time at\n",
        "msg/Bad.msg": "string<=9 name\nLiftt lift\n",
    }
    for name, text in files.items():
        path = tmp_path / "cli_msgs" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.setenv("SMACHPY_INTERFACE_PATH", str(tmp_path))
    assert _cli.show("cli_msgs/Up").startswith("cli_msgs/msg/Lift lift\n\tstring<=9 name 'a'\n---")
    assert _cli.show("cli_msgs/msg/Old") == "time at"
    assert _cli.describe("cli_msgs/Lift")["cli_msgs/msg/Lift"][0]["md5"].startswith("RIHS01_")
    with pytest.raises(InterfaceError, match=r"Bad\.msg:2: unknown type: got 'cli_msgs/msg/Liftt'"):
        _cli.show("cli_msgs/Bad")
