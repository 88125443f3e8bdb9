"""The command line's frame: finding commands, reporting errors, exit codes."""

from __future__ import annotations

from importlib.metadata import EntryPoint

import pytest

import smachpy.command
from smachpy.exceptions import SmachError


def register_ok(subparsers):
    parser = subparsers.add_parser("ok", help="return a code")
    parser.add_argument("code", type=int)
    parser.set_defaults(run=lambda args: args.code)


def register_bad(subparsers):
    def run(_args):
        raise SmachError("/PATROL: broken: got 'x'; expected 'y'.")

    subparsers.add_parser("bad").set_defaults(run=run)


def register_interrupted(subparsers):
    def run(_args):
        raise KeyboardInterrupt

    subparsers.add_parser("interrupted").set_defaults(run=run)


@pytest.fixture(autouse=True)
def commands(monkeypatch):
    """Only the commands of this file, plus one whose package is not installed."""
    names = ["ok", "bad", "interrupted"]
    points = [EntryPoint(n, f"{__name__}:register_{n}", smachpy.command.GROUP) for n in names]
    points.append(EntryPoint("heavy", "a_package_nobody_has:register", smachpy.command.GROUP))
    loaders = {n: globals()[f"register_{n}"] for n in names}
    monkeypatch.setattr(smachpy.command, "entry_points", lambda **_: points)
    load = smachpy.command._load
    monkeypatch.setattr(smachpy.command, "_load", lambda p: loaders.get(p.name) or load(p))


@pytest.fixture
def add_late(monkeypatch):
    """Return what makes the command `late` do something."""

    def add(run):
        def register(subparsers):
            subparsers.add_parser("late").set_defaults(run=run)

        points = [EntryPoint("late", "here:late", smachpy.command.GROUP)]
        monkeypatch.setattr(smachpy.command, "entry_points", lambda **_: points)
        monkeypatch.setattr(smachpy.command, "_load", lambda _: register)

    return add


def test_main_returns_what_the_command_returns():
    assert smachpy.command.main(["ok", "7"]) == 7


def test_an_error_is_one_screen_on_stderr_and_exit_code_2(capsys):
    assert smachpy.command.main(["bad"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    text, more = captured.err.splitlines()
    assert text == "smachpy: /PATROL: broken: got 'x'; expected 'y'."
    assert more.startswith("More: https://")


def test_an_unknown_option_is_told_by_the_subcommand(capsys):
    with pytest.raises(SystemExit) as ended:
        smachpy.command.main(["ok", "7", "--fast"])
    assert ended.value.code == 2
    said = "smachpy ok: unrecognized arguments: --fast\nTry 'smachpy ok --help'.\n"
    assert capsys.readouterr().err == said


def test_debug_shows_the_traceback(capsys):
    assert smachpy.command.main(["bad", "--debug"]) == 2
    assert "Traceback" in capsys.readouterr().err


def test_ctrl_c_is_exit_code_130():
    assert smachpy.command.main(["interrupted"]) == 130


def test_a_missing_package_is_named_with_the_way_to_install_it(capsys):
    assert smachpy.command.main(["heavy"]) == 2
    captured = capsys.readouterr().err
    assert "'a_package_nobody_has' is missing" in captured
    assert "pip install" in captured


@pytest.mark.parametrize(
    ("module", "extra"), [("scipy.ndimage", "sim"), ("PIL", "sim"), ("textual.app", "tui")]
)
def test_a_package_of_an_extra_that_is_missing_later_is_named_with_it(
    module, extra, add_late, capsys
):
    def run(_args):
        raise ModuleNotFoundError(f"No module named {module!r}", name=module)

    add_late(run)
    assert smachpy.command.main(["late"]) == 2
    package = module.partition(".")[0]
    expected = f"smachpy: package {package!r} is missing. Try: pip install 'smachpy[{extra}]'\n"
    assert capsys.readouterr().err == expected


def test_a_module_of_no_extra_that_is_missing_is_a_mistake_and_shows_where(add_late):
    def run(_args):
        raise ModuleNotFoundError("No module named 'my_robot'", name="my_robot")

    add_late(run)
    with pytest.raises(ModuleNotFoundError, match="my_robot"):
        smachpy.command.main(["late"])


def test_an_unknown_command_is_exit_code_2_and_names_the_commands(capsys, monkeypatch):
    points = [p for p in smachpy.command.entry_points() if p.name != "heavy"]
    monkeypatch.setattr(smachpy.command, "entry_points", lambda **_: points)
    with pytest.raises(SystemExit) as caught:
        smachpy.command.main(["okay"])
    assert caught.value.code == 2
    assert "'ok'" in capsys.readouterr().err


def test_only_the_command_asked_for_is_loaded(monkeypatch):
    loaded = []
    load = smachpy.command._load
    monkeypatch.setattr(smachpy.command, "_load", lambda p: loaded.append(p.name) or load(p))
    smachpy.command.main(["ok", "0"])
    assert loaded == ["ok"]
