"""A mission's arguments from a command line."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Any, Literal, NewType, Protocol, TypedDict

import pytest

import smachpy
from smachpy.command import main
from smachpy.command.arguments import (
    MisfitError,
    Text,
    expectation,
    fit,
    parameters_of,
    read_words,
    usage,
    wants_help,
)
from smachpy.command.targets import Target
from smachpy.exceptions import MissionError


class Mode(enum.Enum):
    ABS = 0
    REL = 1


class Speed(enum.IntEnum):
    SLOW = 1
    FAST = 2


class Offset(TypedDict):
    x: float


class Shape(Protocol):
    """A protocol that `isinstance` refuses."""

    sides: int


Metres = NewType("Metres", float)


def target(thing):
    return Target("mine", "here:mine", "Drive somewhere.", thing)


def gotopose(robot: str, x: float, y: float, theta: float = 0.0, *, wait: bool = False):
    """Drive a robot to a pose.

    Args:
        robot: Its name.
        x: Of the goal [m],
            map frame.
        theta: Heading [rad].

    Raises:
        Nothing: at all.
    """
    return robot, x, y, theta, wait


def deliver(to: str, items: list[str], *, times: int = 1):
    return to, items, times


def turn(angle: float, flag: Literal["ABS", "REL"] = "REL", mode: Mode = Mode.ABS):
    return angle, flag, mode


def call(function, *words, **given):
    return function(**read_words(target(function), words, given))


def problem(function, *words, **given):
    with pytest.raises(MissionError) as caught:
        call(function, *words, **given)
    return str(caught.value)


@pytest.mark.parametrize(
    ("words", "values"),
    [
        (["robot_0", "10", "2", "0"], ("robot_0", 10.0, 2.0, 0.0, False)),
        (["robot_0", "-10", "-2.5"], ("robot_0", -10.0, -2.5, 0.0, False)),
        (["robot_0", "1e1", "-1e-1", "--wait"], ("robot_0", 10.0, -0.1, 0.0, True)),
        (["--theta", "-1", "robot_0", "1", "2"], ("robot_0", 1.0, 2.0, -1.0, False)),
        (["--robot=a b", "1", "2", "--no-wait"], ("a b", 1.0, 2.0, 0.0, False)),
        (["-robot", "7", "1", "2"], ("7", 1.0, 2.0, 0.0, False)),
        (["--", "--odd", "1", "2"], ("--odd", 1.0, 2.0, 0.0, False)),
    ],
)
def test_words_fill_the_parameters_in_order_or_by_name(words, values):
    assert call(gotopose, *words) == values


def test_what_is_given_by_name_is_not_asked_for_again():
    assert call(gotopose, "1", "2", robot=Text("007")) == ("007", 1.0, 2.0, 0.0, False)
    assert "robot" in problem(gotopose, "--robot", "a", "1", "2", robot="b")
    text = problem(gotopose, "1", "2", "3", "4", robot="a")
    assert "got 1 more than it takes: '4'; expected 3, as robot came by name." in text


def test_a_list_at_the_end_takes_the_rest():
    assert call(deliver, "lab", "tea", "1", "milk") == ("lab", ["tea", "1", "milk"], 1)
    assert call(deliver, "lab", "[tea, milk]", "--times", "2") == ("lab", ["tea", "milk"], 2)
    assert call(deliver, "lab", "tea") == ("lab", ["tea"], 1)


def test_choices():
    assert call(turn, "90") == (90.0, "REL", Mode.ABS)
    assert call(turn, "90", "ABS", "REL") == (90.0, "ABS", Mode.REL)
    assert "flag: got 'abs'; expected one of ['ABS', 'REL']." in problem(turn, "90", "abs")


def test_every_problem_is_named_at_once_with_the_usage():
    text = problem(gotopose, "robot_0", "ten", "nan", "--thta", "--wait=maybe")
    names = ["robot", "theta", "wait", "x", "y"]
    assert text.splitlines() == [
        f"mission 'mine': --thta: no such argument; expected one of {names}. Did you mean '--theta'?",
        "--wait: got 'maybe'; expected true or false.",
        "x: got 'ten'; expected a number.",
        "y: got 'nan'; expected a number.",
        "usage: smachpy run mine [OPTIONS] -- ROBOT X Y [THETA] [--wait]",
    ]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ([], "missing: robot, x, y; expected a value for each."),
        (["a", "1"], "missing: y;"),
        (["a", "1", "2", "3", "4", "5"], "got 2 more than it takes: '4 5'; expected 4."),
        (["a", "1", "2", "--theta"], "--theta: no value follows; expected a number."),
        (["a", "1", "2", "--theta", "--wait"], "--theta: no value follows"),
        (["--x", "1", "--x", "2", "a", "2"], "--x: given twice; expected once."),
    ],
)
def test_what_is_missing_or_too_many(words, text):
    assert text in problem(gotopose, *words)


def test_a_misspelt_input_is_named_beside_the_missing_argument():
    with pytest.raises(MissionError) as caught:
        read_words(target(gotopose), ["a", "1"], {"yy": Text("2"), "speed": Text("3")})
    first = str(caught.value).splitlines()[0]
    assert first.endswith(
        "missing: y; expected a value for each. Got --input yy. Did you mean 'y'?"
    )


def test_a_finished_machine_takes_no_words():
    sm = smachpy.StateMachine(outcomes=["done"])
    with pytest.raises(MissionError, match="got 1 more than it takes: 'a'; expected 0"):
        read_words(target(sm), ["a"], {})
    assert read_words(target(sm), [], {"key": 1}) == {}


@pytest.mark.parametrize(
    ("value", "hint", "fitted"),
    [
        (Text("3"), int, 3),
        (Text("3"), float, 3.0),
        (Text("3"), str, "3"),
        (Text("true"), bool, True),
        (Text("true"), str, "true"),
        (Text("null"), float | None, None),
        (Text("a/b"), str | Path, "a/b"),
        (Text("a/b"), Path, Path("a/b")),
        (Text("[1, 2]"), list[float], [1.0, 2.0]),
        (Text("[1, 2]"), tuple[int, ...], (1, 2)),
        (Text("{a: 1}"), dict[str, int], {"a": 1}),
        (Text("{a: 1}"), Any, {"a": 1}),
        (Text("2026-13-01"), Any, "2026-13-01"),
        (Text("{a: " * 500), Any, "{a: " * 500),
        (3, float, 3.0),
        (3, str, "3"),
        ("REL", Mode, Mode.REL),
        (Mode.REL, Mode, Mode.REL),
        ([1], list, [1]),
        (Text("FAST"), Speed, Speed.FAST),
        (Text("3"), Metres, 3.0),
        (Text("{x: 1}"), Offset, {"x": 1}),
        (Text("[1, lab]"), tuple[int, str], (1, "lab")),
        (Text("lab"), list[int] | str, "lab"),
        (Text("true"), Literal[True, "auto"], True),
    ],
)
def test_what_fits(value, hint, fitted):
    got = fit(value, hint)
    assert got == fitted
    assert type(got) is type(fitted)


@pytest.mark.parametrize(
    ("value", "hint", "expected"),
    [
        (Text("2.5"), int, "a whole number"),
        (Text("true"), float, "a number"),
        (True, int, "a whole number"),
        (Text(".inf"), float, "a number"),
        (Text("1" * 400), float, "a number"),
        (Text(f"[{'1' * 400}]"), list[float] | None, "a list, each a number or null"),
        (Text("yes"), bool, "true or false"),
        (Text("[a]"), list[int], "a list, each a whole number"),
        (Text("1"), Speed, "one of ['SLOW', 'FAST']"),
        (Text("true"), Literal[1], "one of ['1']"),
        (Text("[1, 2, 3]"), tuple[float, float], "a list of 2: a number, a number"),
        (Text("[lab, 1]"), tuple[int, str], "a list of 2: a whole number, text"),
        (Text("a"), dict[str, int], "a dictionary"),
        (Text("x"), Offset, "a dictionary"),
        (Text("a"), Shape, "Shape (cannot be typed on a command line)"),
        ([1], str, "text"),
        (None, str, "text"),
        (Text("x"), float | None, "a number or null"),
    ],
)
def test_what_does_not_fit(value, hint, expected):
    with pytest.raises(MisfitError) as caught:
        fit(value, hint)
    assert str(caught.value) == expected


def test_names_may_begin_with_any_letter_or_an_underscore():
    def free(_x: int = 1, öffnen: bool = False, self: str = ""):  # noqa: PLC2401
        return _x, öffnen, self

    assert call(free, "--_x=2", "--öffnen", "--self", "me") == (2, True, "me")


def test_a_parameter_may_be_called_self():
    machine = smachpy.StateMachine(outcomes=["done"])
    assert target(lambda self: machine).build(self="me") is machine


def test_a_default_stands_for_a_missing_annotation():
    def free(count=1, name="a", flag=False, thing=None):
        pass

    hints = {name: expectation(p.hint) for name, p in parameters_of(free).items()}
    assert hints == {
        "count": "a number",
        "name": "text",
        "flag": "true or false",
        "thing": "a value in YAML",
    }


def test_an_annotation_that_only_type_checkers_see_takes_anything():
    namespace = {}
    source = "from __future__ import annotations\ndef mission(route: Route, x: float): ..."
    exec(source, namespace)
    found = parameters_of(namespace["mission"])
    assert (found["route"].hint, found["x"].hint) == (Any, float)


def test_the_help_says_what_each_is():
    assert usage(target(gotopose)).splitlines() == [
        "usage: smachpy run mine [OPTIONS] -- ROBOT X Y [THETA] [--wait]",
        "",
        "Drive somewhere.",
        "",
        "  ROBOT     Its name (text)",
        "  X         Of the goal [m], map frame (a number)",
        "  Y         a number",
        "  [THETA]   Heading [rad] (a number, 0.0 when not given)",
        "  [--wait]  true or false, False when not given",
        "",
        "Each may be given by name too: --NAME VALUE, or --input NAME=VALUE.",
    ]
    assert "It takes no arguments." in usage(target(smachpy.StateMachine(outcomes=["done"])))
    assert wants_help(["a", "--help"])
    assert not wants_help(["a"])


MISSION = '''
import smachpy

@smachpy.state(outcomes=["done"], input_keys=["said"])
def say(userdata):
    print("said", userdata.said)
    return "done"

def mission(word: str, times: int = 1):
    """Say a word."""
    sm = smachpy.StateMachine(outcomes=["done"])
    sm.userdata.said = [word] * times
    with sm:
        sm.add("SAY", say)
    return sm
'''


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "say.py"
    file.write_text(MISSION)
    return str(file)


def test_help_is_printed_and_nothing_runs(path, capsys):
    assert main(["run", path, "--", "--help"]) == 0
    out = capsys.readouterr().out
    assert "usage: smachpy run say [OPTIONS] -- WORD [TIMES]" in out
    assert "said" not in out


def test_the_help_of_the_command_shows_the_mission_s_arguments(path, capsys):
    for words in (["run", path, "--help"], ["run", "-h"]):
        with pytest.raises(SystemExit) as caught:
            main(words)
        assert caught.value.code == 0
        out = capsys.readouterr().out
        assert "--start-robot" in out
        assert ("usage: smachpy run say [OPTIONS] -- WORD [TIMES]" in out) is (path in words)


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "soon"])
def test_a_server_timeout_that_is_no_use(path, seconds, capsys):
    with pytest.raises(SystemExit) as caught:
        main(["run", path, "--server-timeout", seconds])
    assert caught.value.code == 2
    assert "--server-timeout" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ([], "missing: word"),
        (["--", "hello", "many"], "times: got 'many'; expected a whole number."),
        (["--input", "word=a", "--input", "word=b"], "--input word: given twice"),
        (["--", "a", "--plain"], "--plain: no such argument"),
        (["a:=b//c", "--", "a"], "'//' is not allowed"),
    ],
)
def test_bad_words_end_with_2(path, arguments, text, capsys):
    assert main(["run", path, *arguments]) == 2
    assert text in capsys.readouterr().err


def test_the_usage_shows_the_word_that_changes_a_truth_value():
    def mission(*, start: bool = True, together: bool = False, must: bool):
        """Do it."""

    first = usage(target(mission)).splitlines()[0]
    assert first.endswith("-- [--no-start] [--together] --must VALUE")


@pytest.mark.parametrize("word", ["__ns:=x", "move_base:=robot_1/move_base", "_speed:=3"])
def test_a_renaming_behind_the_dashes_is_no_argument(word):
    def mission(place: str = "") -> None:
        del place

    target = Target("m", "m.py", "", mission)
    with pytest.raises(
        MissionError, match=r"which renames, behind --; expected it before\. Try 'sm"
    ):
        read_words(target, [word], {})
    assert read_words(target, ["--", word], {}) == {"place": word}
    assert read_words(target, [f"--place={word}"], {}) == {"place": word}
    assert read_words(target, ["{a: 1, b:=2}"], {}) == {"place": "{a: 1, b:=2}"}
