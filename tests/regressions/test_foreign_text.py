"""Text of others reaches no terminal as it is: outcomes, labels, reasons, names of files, ...

One test reads the code and finds each place that prints; the others send control characters
through every field of every record, and look at what comes out.
"""

from __future__ import annotations

import ast
import asyncio
import contextlib
import io
import json
import xml.etree.ElementTree as ET
from dataclasses import asdict
from pathlib import Path

import pytest
from rich.console import Console
from textual.widgets import DataTable, RichLog, Static, Tree

from smachpy import CBState, StateMachine, describe
from smachpy.command import main
from smachpy.events import EVENT_KINDS, from_record
from smachpy.events.reading import read_event
from smachpy.events.recording import header_line
from smachpy_viz import TerminalView
from smachpy_viz.live.machines import Machines
from smachpy_viz.live.tui import MissionApp
from smachpy_viz.pictures import drawing
from tests.places import ROOT
from tests.viz.live.test_borders import FIELDS, NOW

# `actionlib` escapes the whole stream (actionlib_core.process.output), so `print` is safe there; what runs
# in both, or in programs of users, is not.
PLACES = [
    *(ROOT / "smachpy").rglob("*.py"),
    *(ROOT / "viz" / "smachpy_viz").rglob("*.py"),
    ROOT / "actionlib_core" / "command_line" / "ros2_options.py",
]
SAFE_CALLS = {
    "printable",
    "visible",
    "one_line",
    "shorten",
    "_clean",
    "dumps",
    "len",
    "round",
    "sum",
    "int",
    "escape",
    "usage",
    "size_text",
    "complete",  # of shtab: a script
}
# Made of rich's objects: what they show is tested below. The fourth runs with pygraphviz alone; the
# last one's formatter escapes.
EXCEPT = (
    *("terminal/panel.py", "terminal/summary.py", "live/tui.py"),
    *("pictures/bundled_dot.py", "command/logs.py"),
)


def is_safe(node):  # noqa: PLR0911
    """Whether a printed expression can have no control characters of others."""
    match node:
        case ast.Constant() | ast.Name(id="table"):  # its rows are looked at
            return True
        case ast.Call(func=ast.Name(id="Text" | "Cell"), args=[one, *_]):
            return is_safe(one)
        case ast.JoinedStr(values=parts):
            return all(map(is_safe, parts))
        case ast.FormattedValue(value=value, conversion=conversion, format_spec=spec):
            numbers = spec is not None and ast.unparse(spec).strip("f'\"")[-1:] in "defg%"
            return numbers or conversion in {ord("r"), ord("a")} or is_safe(value)
        case ast.BinOp(left=left, right=right):
            return is_safe(left) and is_safe(right)
        case ast.Name(id="shown"):  # of `smachpy port`: escaped for terminals only
            return True
        case ast.IfExp(body=body, orelse=orelse):
            return is_safe(body) and is_safe(orelse)
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)) if name in SAFE_CALLS:
            return True
        case ast.Starred(value=value) | ast.NamedExpr(value=value):
            return is_safe(value)
        case ast.GeneratorExp(elt=elt) | ast.ListComp(elt=elt):
            return is_safe(elt)
        case ast.Call(func=ast.Attribute(attr="join"), args=[one]):
            return is_safe(one)
        case ast.Call(func=ast.Name(id="map"), args=[ast.Name(id=name), _]):
            return name in SAFE_CALLS
    return False


def prints(tree):
    """The expressions that are written to standard output, error or a console, and their lines."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        words = ast.unparse(node.func)
        to_file = any(k.arg == "file" and "std" not in ast.unparse(k.value) for k in node.keywords)
        if (
            (words == "print" and not to_file)
            or words in {"sys.stdout.write", "sys.stderr.write"}
            or (words.endswith((".print", ".log")) and "onsole" in words)
            or words.endswith(".add_row")
        ):
            for argument in node.args:
                yield node.lineno, argument


def test_every_print_escapes_what_others_have_written():
    found = []
    for path in PLACES:
        where = path.relative_to(ROOT)
        if "/names/" in str(where) or str(where).endswith(EXCEPT):
            continue
        for line, argument in prints(ast.parse(path.read_text())):
            if not is_safe(argument):
                found.append(f"{where}:{line}: {ast.unparse(argument)}")
    assert found == []


# -- every field of every record -------------------------------------------------------------------

# Title and clipboard of a terminal, colours, cursor, C1, bidi, tags, line separators, a lone
# surrogate, and what ends an XML document.
BAD = "\x1b]0;TITLE\x07\x1b]52;c;aGk=\x07\x1b[2J\x1b[31m\x9b31m\x00\r\x08\x7f\u202e\u2066\u200f\U000e0041\u2028\ud800"
HARMFUL = set(BAD) - set("]0;TITLE52caGk=[J31m")
NAME = "M" + BAD


def machine():
    made = StateMachine(outcomes=["done" + BAD], name=NAME)
    for label, target in (("A", "B" + BAD), ("B", "done" + BAD)):
        made.add(label + BAD, CBState(lambda _: "ok", outcomes=["ok" + BAD]), {"ok" + BAD: target})
    return made


def dirty(value):
    """A value with control characters in each of its texts."""
    match value:
        case str():
            return value + BAD
        case list():
            return [dirty(one) for one in value]
        case dict():
            return {key if key[:1] == "$" else key + BAD: dirty(one) for key, one in value.items()}
    return value


def records():
    """An event of each kind; each of its texts has control characters."""
    found = []
    for number, kind in enumerate(["Started", "Entered", *EVENT_KINDS], 1):
        fields = {name: dirty(FIELDS[name]) for name in EVENT_KINDS[kind]._fields[3:]}
        path = f"/{NAME}" if kind in {"Started", "Finished", "Recovered"} else f"/{NAME}/A{BAD}"
        common = {"kind": kind, "path": path, "t": 1.0, "stamp_ns": NOW + number, "seq": number}
        found.append(read_event({**common, **fields}))
    return found


def assert_clean(text):
    assert HARMFUL & set(text) == set(), repr(text)


@pytest.mark.parametrize("panel", [False, True])
def test_a_terminal_view_shows_none(clock, panel):
    out = io.StringIO()
    console = Console(file=out, force_terminal=panel, width=150, height=50, color_system=None)
    with TerminalView(describe(machine()), console=console, plain=not panel) as view:
        for record in records():
            view.on_event(from_record(record))
            if panel:  # as it is drawn while it runs
                console.print(view._panel())
    view.print_summary("done" + BAD)
    shown = out.getvalue()
    # The panel itself moves the cursor, and shows and hides it.
    for own in ("\x1b[?25l", "\x1b[?25h", "\x1b[1A", "\x1b[2K", "\x1b[0m"):
        shown = shown.replace(own, "")
    assert_clean(shown.replace("\r", "") if panel else shown)
    assert "done" in shown


def history():
    described = json.loads(json.dumps(asdict(describe(machine()))))
    return {
        "epoch": "e", "session": "s", "run": "", "problems": [], "base": None, "observed": [],
        "control": None, "now": NOW, "events": records(), "description": described,
    }  # fmt: skip


def test_the_view_in_a_terminal_shows_none(clock):
    machines = Machines()
    told = {**history(), "description": describe(machine())}
    machines.obtain("m" + BAD).reset(told)
    shown = []

    async def look():
        app = MissionApp(machines, lambda *_: {"text": "told" + BAD})
        app.NOTIFICATION_TIMEOUT = 600.0
        async with app.run_test(size=(150, 50)) as pilot:
            app.refresh_view()
            for key in ("comma", "comma", "l", "s"):
                await pilot.press(key)
                while key == "s" and not app._notifications:  # it tells the command's answer
                    await pilot.pause(0.01)
                app.refresh_view()
                shown.extend(str(one.render()) for one in app.query(Static))
                shown.extend(str(node.label) for node in _nodes(app.query_one(Tree).root))
                shown.extend(line.text for line in app.query_one(RichLog).lines)
                table = app.query_one(DataTable)
                shown.extend(
                    str(cell) for n in range(table.row_count) for cell in table.get_row_at(n)
                )
            shown.extend(note.message for note in app._notifications)

    asyncio.run(look())
    assert any("told" in text for text in shown)
    assert any(text.startswith("done") or "ended: ok" in text for text in shown)
    for text in shown:
        assert_clean(text)


def _nodes(node):
    yield node
    for child in node.children:
        yield from _nodes(child)


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = [header_line(describe(machine()), NOW, made_ns=NOW)]
    lines += [json.dumps(record) + "\n" for record in records()]
    Path("run.jsonl").write_text("".join(lines))
    return "run.jsonl"


@pytest.mark.parametrize(
    "words",
    [
        ["runs", "list", "run.jsonl"],
        ["runs", "show", "run.jsonl"],
        ["runs", "show", "run.jsonl", "run.jsonl"],
        ["runs", "why", "run.jsonl"],
        ["runs", "compare", "run.jsonl", "run.jsonl"],
        ["runs", "export", "run.jsonl", "-o", "run.html"],
        ["runs", "list", "no" + BAD[:-1].replace("\x00", "")],
    ],
)
def test_commands_for_recordings_show_none(recording, capsys, words):
    with contextlib.suppress(SystemExit):
        main(words)
    said = capsys.readouterr()
    assert said.out + said.err
    assert_clean(said.out + said.err)


def test_pictures_have_none_and_are_well_formed(recording, tmp_path):
    record = describe(machine())
    for kind in ("svg", "txt", "mmd", "dot"):
        with contextlib.suppress(KeyError):
            made = drawing.picture(record, kind).decode("utf-8")
            assert_clean(made)
            if kind == "svg":
                ET.fromstring(made)
    assert main(["runs", "export", recording, "-o", "run.html"]) == 0
    assert_clean(Path("run.html").read_text())
