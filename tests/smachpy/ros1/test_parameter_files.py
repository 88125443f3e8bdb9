"""Files of parameters for scripts of ROS 1: read, or refused with one error."""

from __future__ import annotations

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
