from __future__ import annotations

import pytest

from smachpy.command import main

MISSION = '''
"""A mission to draw."""
import smachpy


class Step(smachpy.State):
    def __init__(self):
        super().__init__(outcomes=["done"])

    def execute(self, userdata):
        raise AssertionError("drawing never runs a state")


def mission():
    inner = smachpy.StateMachine(outcomes=["done"])
    with inner:
        smachpy.StateMachine.add("DEEP", Step())
    machine = smachpy.StateMachine(outcomes=["done"], name="TOP")
    with machine:
        smachpy.StateMachine.add("A", Step(), transitions={"done": "B"})
        smachpy.StateMachine.add("B", inner)
    return machine
'''


@pytest.fixture
def mission(tmp_path):
    file = tmp_path / "drawn_mission.py"
    file.write_text(MISSION)
    return str(file)


def test_render_writes_the_file_and_names_it(mission, tmp_path, capsys):
    target = tmp_path / "m.svg"
    assert main(["render", mission, "-o", str(target)]) == 0
    assert capsys.readouterr().out.strip() == str(target)
    assert "DEEP" in target.read_text()


def test_options_reach_the_picture(mission, tmp_path):
    target = tmp_path / "m.txt"
    options = ["--depth", "1", "--active", "/TOP/A", "--theme", "dark", "--show-implicit"]
    assert main(["render", mission, "-o", str(target), *options]) == 0
    text = target.read_text()
    assert "DEEP" not in text
    assert "\u25b8 * A" in text


def test_a_written_record_can_be_drawn_again(mission, tmp_path):
    record = tmp_path / "m.json"
    assert main(["render", mission, "-o", str(record)]) == 0
    assert main(["render", str(record), "-o", str(tmp_path / "m.dot"), "--path", "/TOP/B"]) == 0
    assert "/TOP/B/DEEP" in (tmp_path / "m.dot").read_text()


def test_a_dash_is_standard_output(mission, capfdbinary):
    assert main(["render", mission, "-o", "-"]) == 0
    assert capfdbinary.readouterr().out.startswith(b"<?xml")


def test_the_atlas_is_written_and_its_index_named(mission, tmp_path, capsys):
    assert main(["render", mission, "--atlas", str(tmp_path / "pages")]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "pages" / "index.svg")
    assert len(list((tmp_path / "pages").iterdir())) == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "expected one of them. Try -o drawn_mission.svg"),
        (["-o", "m.bmp"], "format: got 'bmp'"),
        (["-o", "m.svg", "--path", "/TOP/C"], "no state '/TOP/C'"),
        (["-o", "m.svg", "--active", "X"], "no state 'X'"),
    ],
)
def test_bad_requests_end_with_2_and_say_why(
    mission, tmp_path, monkeypatch, capsys, arguments, words
):
    monkeypatch.chdir(tmp_path)
    assert main(["render", mission, *arguments]) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert "Traceback" not in captured.err


@pytest.mark.parametrize("depth", ["0", "x"])
def test_a_depth_is_a_number_from_one(mission, depth, capsys):
    with pytest.raises(SystemExit) as caught:
        main(["render", mission, "-o", "m.svg", "--depth", depth])
    assert caught.value.code == 2
    assert f"got '{depth}'; expected 1 or more" in capsys.readouterr().err


@pytest.mark.parametrize("text", [None, "{", '{"path": 1}'])
def test_a_record_that_cannot_be_read_is_told(tmp_path, capsys, text):
    file = tmp_path / "r.json"
    if text is not None:
        file.write_text(text)
    assert main(["render", str(file), "-o", str(tmp_path / "m.txt")]) == 2
    assert "r.json" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            "[]",
            "'r.json': $: got a list of 0; expected an object. Try a record that `smachpy render",
        ),
        ("[" * 100_000, "'r.json': it is nested deeper than 800 levels"),
        (None, "'r.json': No such file or directory. Try a record"),
    ],
)
def test_a_file_that_is_no_record_is_one_line(tmp_path, monkeypatch, capsys, content, said):
    monkeypatch.chdir(tmp_path)
    if content is not None:
        (tmp_path / "r.json").write_text(content)
    assert main(["render", "r.json", "-o", "r.txt"]) == 2
    assert capsys.readouterr().err.startswith(f"smachpy: {said}")
