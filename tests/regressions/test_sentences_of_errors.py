"""Errors read "got X; expected Y": X is a value or a thing, never a sentence that somebody else wrote.

A text of the system, of a server or of another error may hold "got", ":" and ";" of its own. It stands in quotes or in
brackets, or after the sentence.
"""

import ast
import re
from pathlib import Path

import pytest

import actionlib_core
import smachpy
import smachpy_missions
import smachpy_viz
from actionlib_core import GoalFailedError
from smachpy.command import main

PACKAGES = [
    Path(p.__file__).parent for p in (actionlib_core, smachpy, smachpy_viz, smachpy_missions)
]
FOREIGN = re.compile(
    r"\b(error|failed)\b|\.(strerror|msg|text|reason|problem)\b|error_text\(|\bline\("
)
"""Expressions whose value is a text that somebody else wrote."""


def sentences(tree):
    """Yield (line, pieces) of each text of a program; pieces are texts, or nodes that are filled in."""
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield node.lineno, [p.value if isinstance(p, ast.Constant) else p for p in node.values]


def broken(pieces):
    """Return the foreign texts that stand bare between "got" and "; expected" in one sentence."""
    shown = "".join(p if isinstance(p, str) else f"\0{n}\0" for n, p in enumerate(pieces))
    found = []
    for between in re.findall(r"\bgot ((?:(?!\. |\bgot\b).)*?); expected", shown, re.DOTALL):
        bare = re.sub(r"\([^()]*\)|'[^']*'|\"[^\"]*\"", "", between)
        for number in re.findall(r"\0(\d+)\0", bare):
            piece = pieces[int(number)]
            text = ast.unparse(piece.value)
            if (
                piece.conversion != ord("r")
                and FOREIGN.search(text)
                and not text.startswith(("repr(", "type("))
            ):
                found.append(text)
    return found


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_no_error_puts_a_foreign_text_bare_between_got_and_expected(package):
    found = {
        f"{path.relative_to(package)}:{line}": texts
        for path in sorted(package.rglob("*.py"))
        for line, pieces in sentences(ast.parse(path.read_text()))
        if (texts := broken(pieces))
    }

    assert found == {}


@pytest.mark.parametrize(
    ("text", "is_broken"),
    [
        ('f"got {error.strerror}; expected a folder."', True),
        ('f"got {status}: {goal.text}; expected SUCCEEDED."', True),
        ('f"got {name!r} ({error}); expected a file."', False),
        ("f\"got '{failed.strerror}'; expected to write all of it.\"", False),
        ('f"got {name!r}; expected a file. {error}"', False),
    ],
)
def test_the_reader_of_sentences_finds_what_it_looks_for(text, is_broken):
    (_, pieces), *_ = sentences(ast.parse(text))

    assert bool(broken(pieces)) == is_broken


@pytest.mark.parametrize(
    ("status", "text", "sentence"),
    [
        (
            "ABORTED",
            "got no path; expected one.",
            "got ABORTED; expected SUCCEEDED. Its text: got no path; expected one.",
        ),
        ("REJECTED", "", "got REJECTED; expected SUCCEEDED. It has no text."),
        (
            "SUCCEEDED",
            "done",
            "got SUCCEEDED without a result; expected its result. Its text: done",
        ),
    ],
)
def test_a_failed_goal_says_its_status_and_then_the_text_of_the_server(status, text, sentence):
    error = GoalFailedError("move_base", "n-1-5.0", status, text, None)

    assert str(error) == f"goal n-1-5.0 on 'move_base': {sentence}"
    assert (error.status, error.text) == (status, text)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["port", "nowhere.py"],
            "got nothing to read (No such file or directory); expected a script.",
        ),
        (["port", "half.py"], "line 1: got a syntax error ("),
        (
            ["port", "old.py", "-o", "old.py"],
            "got a failed write (File exists); expected a new file.",
        ),
    ],
)
def test_commands_put_the_words_of_the_system_in_brackets(
    words, sentence, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    Path("half.py").write_text("x = (\n")
    Path("old.py").write_text("import smach\n")

    code = main(words)

    assert code == 2
    assert sentence in capsys.readouterr().err
