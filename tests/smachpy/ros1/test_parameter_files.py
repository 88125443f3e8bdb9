"""Files of parameters for scripts of ROS 1: read, or refused with one error."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from smachpy.ros1.parameters import ParameterFileError, Parameters, read_file


@pytest.mark.parametrize(
    "text",
    [
        "speed: [",
        "speed: !!int fast",
        "[" * 3000 + "]" * 3000,
        "- 1",
        "speed: 1\n---\nspeed: 2",
    ],
)
def test_a_file_that_holds_no_parameters_is_refused(tmp_path, text):
    path = tmp_path / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ParameterFileError) as caught:
        read_file(path)
    assert caught.value.path == path


def test_a_file_sets_parameters_below_a_namespace(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text("base: {speed: 0.5}\n", encoding="utf-8")
    parameters = Parameters()
    parameters.load(path, "/robot_0")
    assert parameters.get("/robot_0/base/speed") == 0.5


def test_a_namespace_has_the_values_of_the_program_and_of_the_robot():
    robot, parameters = Parameters(), Parameters()
    robot.set("/base", {"speed": 0.5, "size": {"x": 1, "y": 2}, "name": "base"})
    parameters.robot = SimpleNamespace(get_param=robot.get, param_names=robot.names)
    parameters.set("/base/speed", 9)
    parameters.set("/base/size/x", 3)
    assert parameters.get("/base") == {"speed": 9, "size": {"x": 3, "y": 2}, "name": "base"}
    assert parameters.get("/base/speed") == 9
    assert parameters.get("/base/name") == "base"
    parameters.set("/mine", {"a": 1})
    assert parameters.get("/mine") == {"a": 1}
    assert robot.get("/base/speed") == 0.5
    with pytest.raises(KeyError, match="Did you mean '/base/name'"):
        parameters.get("/base/nam")
