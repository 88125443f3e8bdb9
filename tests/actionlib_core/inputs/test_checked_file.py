"""The checker of files: each getter, what it reports and where, and what it returns instead."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import pytest

from actionlib_core.inputs.checked_file import REQUIRED, CheckedFile, Limits, Problem
from actionlib_core.inputs.yaml_text import load_with_marks


class WrongFileError(Exception):
    def __init__(self, problems):
        self.problems = problems
        super().__init__("\n".join(map(str, problems)))


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "a.yaml"
        path.write_text(text, encoding="utf-8")
        return CheckedFile(path, WrongFileError, **options)

    return read


def texts_of(file):
    return [f"{problem.line}: {problem.field}: {problem.text}" for problem in file.problems]


NUMBER = "a number"
WHOLE = "a whole number"
ROWS = "a list with at least one entry"
MODES = ("trinary", "scale", "raw")
SPEED = Limits(above=0, high=3)


@pytest.mark.parametrize(
    ("value", "get", "expected"),
    [
        ("2", lambda s: s.number("a", REQUIRED), 2.0),
        ("2.5", lambda s: s.number("a", REQUIRED, SPEED, "m/s"), 2.5),
        ("2", lambda s: s.integer("a", REQUIRED, SPEED), 2),
        ("true", lambda s: s.flag("a", REQUIRED), True),
        ("0", lambda s: s.flag("a", REQUIRED), False),
        ("x", lambda s: s.text("a", REQUIRED), "x"),
        ("raw", lambda s: s.text("a", REQUIRED, MODES), "raw"),
        ("''", lambda s: s.text("a", REQUIRED, may_be_blank=True), ""),
        ("[1, 2.5]", lambda s: s.numbers("a", REQUIRED, ("x", "y")), (1.0, 2.5)),
        ("[x, y]", lambda s: s.texts("a", REQUIRED), ("x", "y")),
        ("[]", lambda s: s.texts("a", REQUIRED), ()),
        ("[]", lambda s: s.rows("a", ()), []),
        ("{b: 1}", lambda s: s.section("a").number("b", REQUIRED), 1.0),
        ("", lambda s: list(s.section("a")), []),
        ("{b: [{c: 3}]}", lambda s: s.section("a").rows("b")[0].integer("c", REQUIRED), 3),
        ("{1: x}", lambda s: list(s.section("a")), ["1"]),
        ("[1, {b: 2}]", lambda s: s.value("a"), [1, {"b": 2}]),
        ("1", lambda s: s.number("other", 7.0), 7.0),
        ("1", lambda s: s.value("other"), None),
    ],
)
def test_a_good_value_is_returned(read, value, get, expected):
    file = read(f"a: {value}\n")
    found = get(file.top)
    assert (found, type(found)) == (expected, type(expected))
    file.check()


@pytest.mark.parametrize(
    ("value", "get", "problem"),
    [
        *(
            (value, lambda s: s.number("a", REQUIRED), f"got {got}; expected {NUMBER}.")
            for value, got in (
                ("fast", "'fast'"),
                ("true", "True"),
                (".nan", "nan"),
                (".inf", "inf"),
                ("[1]", "[1]"),
                ("{}", "{}"),
                ("~", "None"),
                ("1" + "0" * 400, "1" + "0" * 400),
            )
        ),
        ("0", lambda s: s.number("a", 1, SPEED, "m/s"), "got 0; expected a number [m/s] > 0, at most 3."),
        ("4", lambda s: s.integer("a", 1, SPEED), f"got 4; expected {WHOLE} > 0, at most 3."),
        ("-1", lambda s: s.integer("a", 1, Limits(low=0)), f"got -1; expected {WHOLE} at least 0."),
        ("1.5", lambda s: s.integer("a", 1), f"got 1.5; expected {WHOLE}."),
        ("true", lambda s: s.integer("a", 1), f"got True; expected {WHOLE}."),
        ("maybe", lambda s: s.flag("a", default=True), "got 'maybe'; expected true or false."),
        ("2", lambda s: s.flag("a", default=True), "got 2; expected true or false."),
        ("' '", lambda s: s.text("a", "x"), "got ' '; expected a text."),
        ("3", lambda s: s.text("a", "x"), "got 3; expected a text."),
        ("raww", lambda s: s.text("a", "raw", MODES),
         "got 'raww'; expected one of ['raw', 'scale', 'trinary']. Did you mean 'raw'?"),
        ("[1, 2]", lambda s: s.numbers("a", (), ("x [m]", "y [m]", "yaw")),
         "got [1, 2]; expected 3 numbers [x [m], y [m], yaw]."),
        ("[1, b]", lambda s: s.numbers("a", (), "xy"), "got [1, 'b']; expected 2 numbers [x, y]."),
        ("b", lambda s: s.texts("a", ()), "got 'b'; expected a list of texts. Try ['b']."),
        ("b", lambda s: s.section("a").number("b", REQUIRED),
         "got 'b'; expected a mapping of names to values."),
        ("[]", lambda s: s.rows("a"), f"got []; expected {ROWS}."),
        ("7", lambda s: s.rows("a"), f"got 7; expected {ROWS}."),
        ("7", lambda s: s.rows("a", ()), "got 7; expected a list of mappings."),
    ],
)  # fmt: skip
def test_a_bad_value_is_one_problem(read, value, get, problem):
    file = read(f"# first line\na: {value}\n")
    get(file.top)
    assert texts_of(file) == [f"2: a: {problem}"]
    assert not file.top.is_good("a")


@pytest.mark.parametrize(
    ("get", "problem"),
    [
        (lambda s: s.number("b", REQUIRED, unit="m"), "b: got nothing; expected a number [m]."),
        (lambda s: s.integer("b", REQUIRED), "b: got nothing; expected a whole number."),
        (lambda s: s.flag("b", REQUIRED), "b: got nothing; expected true or false."),
        (lambda s: s.text("b", REQUIRED), "b: got nothing; expected a text."),
        (lambda s: s.numbers("b", REQUIRED, "xy"), "b: got nothing; expected 2 numbers [x, y]."),
        (lambda s: s.texts("b", REQUIRED), "b: got nothing; expected a list of texts."),
        (lambda s: s.rows("b"), f"b: got nothing; expected {ROWS}."),
        (lambda s: s.section("b").text("c", REQUIRED), "b.c: got nothing; expected a text."),
    ],
)
def test_a_required_field_that_is_missing_has_the_line_of_its_section(read, get, problem):
    file = read("x: 0\na:\n  b: 1\n")
    get(file.top.section("x2"))
    get(file.top.section("a").section("c"))
    assert texts_of(file) == [f"1: x2.{problem}", f"2: a.c.{problem}"]


def test_all_problems_come_at_once_in_the_order_of_the_file(read, tmp_path):
    file = read(
        "a: 1\nrobot:\n  speed: fast\n  radius: -1\n  colour: red\nlist: 3\n"
        "rows:\n- {x: 1}\n- 7\n-\n  x: here\nnames: [b,\n  3]\n"
    )
    top = file.top
    for row in top.rows("rows"):
        row.number("x", REQUIRED)
    top.texts("names", ())
    top.rows("list")
    robot = top.section("robot")
    robot.number("speed", REQUIRED)
    robot.number("radius", REQUIRED, Limits(above=0))
    robot.close()
    top.number("missing", REQUIRED)
    with pytest.raises(WrongFileError) as error:
        file.check()
    assert [(p.line, p.field) for p in error.value.problems] == [
        (1, "missing"),
        (3, "robot.speed"),
        (4, "robot.radius"),
        (5, "robot.colour"),
        (6, "list"),
        (9, "rows[1]"),
        (11, "rows[2].x"),
        (13, "names[1]"),
    ]
    assert f"{tmp_path}/a.yaml:11: rows[2].x: got 'here'; expected a number." in str(error.value)


def test_problems_of_another_file_come_behind_and_once(read):
    file = read("a: 1\n")
    other = [Problem("b.yaml", 2, "y", "wrong."), Problem("b.yaml", 1, "x", "wrong.")]
    file.problems += [*other, *other]
    file.top.text("a", REQUIRED)
    assert file.top.is_good("x", "y")
    with pytest.raises(WrongFileError) as error:
        file.check()
    assert [(p.line, p.field) for p in error.value.problems] == [(1, "a"), (1, "x"), (2, "y")]


def test_an_unknown_field_names_the_known_ones(read):
    file = read("size: 1\nmax_sped: 1\n")
    file.top.number("max_speed", 2.0)
    file.top.allow("size", "colour")
    file.top.close()
    assert (file.is_good("max_speed"), file.is_good("size")) == (False, True)
    assert texts_of(file) == [
        "2: max_sped: got an unknown field; expected one of ['colour', 'max_speed', 'size']. Did you mean 'max_speed'?"
    ]


def test_what_is_in_a_wrong_mapping_is_not_reported(read):
    file = read("a: 3\n")
    inside = file.top.section("a")
    inside.number("b", REQUIRED)
    inside.section("c").text("d", REQUIRED)
    inside.close()
    assert texts_of(file) == ["1: a: got 3; expected a mapping of names to values."]
    assert not file.top.is_good("a.b")


@pytest.mark.parametrize(
    ("bad", "good"),
    [("a", ["b", "ab", "a2.x"]), ("a.b", ["a.c", "a.bc"]), ("a[0].x", ["a[1]", "a[0].y", "a[0].xy"])],
)  # fmt: skip
def test_a_field_is_good_if_nothing_in_it_or_around_it_is_wrong(read, bad, good):
    file = read("x: 1\n")
    file.report(bad, "wrong.")
    assert not file.is_good(bad)
    assert not file.is_good("a")
    assert not file.is_good(f"{bad}.c")
    assert not file.is_good(f"{bad}[2]")
    assert all(map(file.is_good, good))


@dataclass
class Robot:
    name: str
    wheels: tuple[str, ...]
    speed: float = field(default=1.0, metadata={"unit": "m/s", "limits": SPEED})
    count: int = 2
    on: bool = False
    mode: Literal["fast", "slow"] = "slow"
    poses: tuple[float, ...] = ()


def test_a_dataclass_says_what_its_fields_are(read):
    file = read("robot: {wheels: [l, r], speed: 2, mode: fast, on: true}\n")
    robot = file.top.section("robot")
    assert Robot(**robot.values(Robot, name="a")) == Robot(
        "a", ("l", "r"), 2.0, on=True, mode="fast"
    )
    robot.close()
    file.check()


def test_fields_of_a_dataclass_that_are_wrong_keep_their_defaults(read):
    file = read("speed: 9\ncount: few\non: 3\nmode: fats\nposes: [1]\nname: 7\nwheels: [1]\n")
    assert file.top.values(Robot) == {"name": "-", "wheels": ("-",)}
    file.top.close()
    assert texts_of(file) == [
        "6: name: got 7; expected a text.",
        "7: wheels[0]: got 1; expected a text.",
        "1: speed: got 9; expected a number [m/s] > 0, at most 3.",
        "2: count: got 'few'; expected a whole number.",
        "3: on: got 3; expected true or false.",
        "4: mode: got 'fats'; expected one of ['fast', 'slow']. Did you mean 'fast'?",
        # Of a type that the caller reads; this one does not.
        "5: poses: got an unknown field; expected one of ['count', 'mode', 'name', 'on', 'speed', 'wheels'].",
    ]


@pytest.mark.parametrize(
    ("text", "line", "problem"),
    [
        ("a: [1, 2\nb: 3\n", 2, "not YAML: expected"),
        ("a: 1\na: 2\n", 2, 'not YAML: found duplicate key "a"'),
        ("a: &x [*x]\nb: *x\n", 1, "not YAML: a value contains itself"),
        ("", 1, "got an empty file; expected a mapping of names to values"),
        ("- 1\n", 1, "got a list; expected a mapping of names to values"),
        ("text\n", 1, "got a str; expected a mapping of names to values"),
    ],
)
def test_what_is_no_mapping_is_refused_with_the_line(read, text, line, problem):
    with pytest.raises(WrongFileError) as error:
        read(text)
    (found,) = error.value.problems
    assert (found.line, found.field) == (line, "")
    assert found.text.startswith(problem)


def test_a_file_may_be_empty_if_the_reader_says_so(read):
    assert list(read("# nothing\n", may_be_empty=True).top) == []


def test_unreadable_files_are_refused(tmp_path):
    (tmp_path / "b.yaml").write_bytes(b"\xff\xfe\x00a")
    for name, why in (
        ("nowhere.yaml", "'No such file or directory'"),
        ("", "'Is a directory'"),
        ("b.yaml", "no UTF-8"),
    ):
        with pytest.raises(WrongFileError, match=f"got {why}; expected a readable text") as error:
            CheckedFile(tmp_path / name, WrongFileError)
        assert error.value.__cause__ is not None


def test_a_file_that_never_ends_is_refused(tmp_path):
    path = tmp_path / "zeros.yaml"
    path.symlink_to("/dev/zero")
    with pytest.raises(WrongFileError, match="more than 16,777,216 bytes") as error:
        CheckedFile(path, WrongFileError)
    assert error.value.problems[0].file == str(path)


def test_lines_are_those_of_merged_and_repeated_parts(read):
    file = read("base: &b\n  x: no\nrobot:\n  <<: *b\n  y: 1\ncopy: *b\n")
    for name in ("robot", "copy"):
        file.top.section(name).number("x", REQUIRED)
    assert [(p.line, p.field) for p in file.problems] == [(2, "robot.x"), (2, "copy.x")]


def test_a_number_that_python_cannot_write_is_one_problem_too(read):
    file = read("a: 1\n", parse=lambda _file, _text: ({"a": 16**5000}, {"a": 1}))  # as TOML has it
    file.top.number("a", 1)
    assert texts_of(file) == ["1: a: got a number with too many digits; expected a number."]


def test_data_and_places_of_a_text_that_was_read_before_are_the_callers_own():
    text = "a: &one [{b: 1}]\nc: *one\n"
    data, places = load_with_marks(text)
    data["a"][0]["b"] = 2
    places.clear()

    again, places = load_with_marks(text)

    assert again == {"a": [{"b": 1}], "c": [{"b": 1}]}
    assert again["a"] is again["c"]
    assert places["c"] == (2, 1)
