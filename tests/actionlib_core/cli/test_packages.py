"""The interfaces that installed packages offer, when one of the packages cannot be imported."""

from __future__ import annotations

from importlib.metadata import EntryPoint

import pytest

from actionlib_core.cli import _network
from actionlib_core.exceptions import InterfaceError


@pytest.fixture
def offer(monkeypatch):
    def set_points(*modules):
        points = [EntryPoint(name, name, "smachpy.interfaces") for name in modules]
        monkeypatch.setattr(_network, "entry_points", lambda group: points)

    return set_points


@pytest.mark.parametrize("hidden", ["json.interfaces", "no_such_package.interfaces"])
def test_a_package_that_another_one_hides_takes_only_its_own_definitions_away(
    offer, tmp_path, monkeypatch, capsys, hidden
):
    (tmp_path / "package_after_it.py").write_text("LOADED = True\n")
    monkeypatch.syspath_prepend(tmp_path)
    offer(hidden, "package_after_it")
    _network.load_packages()
    assert __import__("package_after_it").LOADED
    assert hidden in capsys.readouterr().err


@pytest.mark.parametrize("text", ["import no_such_library\n", "raise OSError('no disc')\n"])
def test_a_package_that_is_broken_is_an_error(offer, tmp_path, monkeypatch, text):
    (tmp_path / "broken_package.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    offer("broken_package")
    with pytest.raises(InterfaceError, match="broken_package"):
        _network.load_packages()
