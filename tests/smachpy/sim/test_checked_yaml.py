from __future__ import annotations

import pytest

from smachpy.sim.checked_yaml import REQUIRED, Document, Limits
from smachpy.sim.exceptions import InputFileError


def document(tmp_path, text):
    path = tmp_path / "a.yaml"
    path.write_text(text, encoding="utf-8")
    return Document(path)


def problems_of(error):
    return [(p.line, p.field) for p in error.value.problems]


def test_every_problem_is_found_at_once_with_its_line_and_field(tmp_path):
    doc = document(tmp_path, "a: 1\nrobot:\n  speed: fast\n  radius: -1\n  colour: red\nlist: 3\n")
    robot = doc.top.section("robot")
    doc.top.integer("a", REQUIRED)
    robot.number("speed", REQUIRED, unit="m/s")
    robot.number("radius", REQUIRED, Limits(above=0))
    robot.close()
    doc.top.rows("list")
    doc.top.number("missing", REQUIRED)
    doc.top.close()
    with pytest.raises(InputFileError) as error:
        doc.check()
    assert problems_of(error) == [
        (3, "robot.speed"),
        (4, "robot.radius"),
        (5, "robot.colour"),
        (6, "list"),
        (1, "missing"),
    ]
    text = str(error.value)
    assert f"{tmp_path}/a.yaml:3: robot.speed: got 'fast'; expected a number [m/s]." in text
    assert "got -1; expected a number > 0." in text
    assert "missing: got nothing; expected a number." in text


def test_an_unknown_field_names_the_nearest_known_one(tmp_path):
    doc = document(tmp_path, "max_sped: 1\n")
    doc.top.number("max_speed", 2.0)
    doc.top.close()
    with pytest.raises(InputFileError, match="Did you mean 'max_speed'"):
        doc.check()


@pytest.mark.parametrize(
    ("text", "line", "got"),
    [
        ("a: [1, 2\nb: 3\n", 2, "expected"),
        ("a: 1\na: 2\n", 2, "duplicate"),
        ("", 1, "an empty file"),
        ("- 1\n", 1, "a CommentedSeq"),
    ],
)
def test_what_is_no_mapping_is_refused_with_the_line(tmp_path, text, line, got):
    with pytest.raises(InputFileError) as error:
        document(tmp_path, text)
    (problem,) = error.value.problems
    assert problem.line == line
    assert got in str(problem)


def test_unreadable_files_are_refused(tmp_path):
    with pytest.raises(InputFileError, match="No such file"):
        Document(tmp_path / "nowhere.yaml")
    with pytest.raises(InputFileError, match="Is a directory"):
        Document(tmp_path)
    (tmp_path / "b.yaml").write_bytes(b"\xff\xfe\x00a")
    with pytest.raises(InputFileError, match="UTF-8"):
        Document(tmp_path / "b.yaml")


@pytest.mark.parametrize("value", ["true", ".nan", ".inf", "[1]", "{}", "~"])
def test_what_is_no_finite_number_is_refused(tmp_path, value):
    doc = document(tmp_path, f"a: {value}\n")
    doc.top.number("a", REQUIRED)
    assert len(doc.problems) == 1


def test_texts_lists_and_flags(tmp_path):
    doc = document(tmp_path, "mode: raww\norigin: [1, 2]\nnegate: 1\nflag: maybe\nname: ''\n")
    top = doc.top
    top.text("mode", REQUIRED, ("trinary", "scale", "raw"))
    top.numbers("origin", REQUIRED, ("x", "y", "yaw"))
    assert top.flag("negate", REQUIRED) is True
    top.flag("flag", REQUIRED)
    top.text("name", REQUIRED)
    texts = [str(p) for p in doc.problems]
    assert "Did you mean 'raw'?" in texts[0]
    assert "expected 3 numbers [x, y, yaw]" in texts[1]
    assert "true or false" in texts[2]
    assert "got ''; expected a text" in texts[3]


def test_rows_must_be_mappings(tmp_path):
    doc = document(tmp_path, "w:\n  - {x: 1}\n  - 7\n")
    rows = doc.top.rows("w")
    assert len(rows) == 1
    assert str(doc.problems[0]).endswith("a.yaml:3: w[1]: got 7; expected a mapping (name: value).")


def test_fields_of_a_section_that_is_not_there_are_named_with_a_line(tmp_path):
    doc = document(tmp_path, "other: 1\n")
    doc.top.section("dock").number("x", REQUIRED)
    assert str(doc.problems[0]).endswith("a.yaml:1: dock.x: got nothing; expected a number.")
