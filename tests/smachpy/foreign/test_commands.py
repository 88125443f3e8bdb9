"""The commands that take files of other tools."""

from __future__ import annotations

import pytest

from smachpy.command import main
from smachpy.command.targets import list_files
from tests.smachpy.foreign.places import ROUNDS, save

FILES = {"rounds.xml": ROUNDS["xml"], "rounds.scxml": ROUNDS["scxml"], "rounds_sm.py": ROUNDS["py"]}


@pytest.fixture(params=FILES)
def name(request, tmp_path, monkeypatch):
    """The name of a file in the current folder."""
    monkeypatch.chdir(tmp_path)
    save(tmp_path, FILES[request.param], request.param)
    return request.param


def test_check_and_render_need_no_states(name, tmp_path, capsys):
    assert main(["check", name]) == 0
    assert main(["render", name, "-o", "m.json"]) == 0
    assert "no problems" in capsys.readouterr().out
    assert not (tmp_path / "executed").exists()


@pytest.mark.slow
def test_explore_needs_no_states(name, tmp_path, capsys):
    assert main(["explore", name]) in {0, 1}
    assert "got no state" not in capsys.readouterr().err
    assert not (tmp_path / "executed").exists()


def test_run_lists_the_missing_states_and_starts_nothing(name, tmp_path, capsys):
    assert main(["run", name, "--plain"]) == 2
    said = capsys.readouterr().err
    assert f"{name}:" in said
    assert "got no state" in said
    assert not (tmp_path / "executed").exists()


def test_run_tells_its_parameters(name, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["run", name, "--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    assert {"rounds.xml": "pause-s", "rounds.scxml": "", "rounds_sm.py": "speed"}[name] in shown


def test_export_writes_a_mission_file_and_tells_what_is_lost(name, tmp_path, capsys):
    code = main(["export", name, "-o", "m.yaml"])
    lost = "not kept: the stop of the other" in capsys.readouterr().err
    assert lost == (name != "rounds.xml")
    assert code == 0
    assert "state: smachpy_states:" in (tmp_path / "m.yaml").read_text()


def test_a_list_has_machines_but_no_other_xml(tmp_path):
    path = save(tmp_path, ROUNDS["xml"], "rounds.xml")
    save(tmp_path, "<package><name>p</name></package>", "package.xml")
    assert list_files(tmp_path) == {str(path): "Drive around, then look."}


def test_a_file_that_is_not_there_names_the_nearest(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    save(tmp_path, ROUNDS["xml"], "rounds.xml")
    assert main(["check", "round.xml"]) == 2
    assert "Did you mean 'rounds.xml'?" in capsys.readouterr().err
