"""The folder of the site's versions: one for each release, the newest as `latest`."""

from __future__ import annotations

import json
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader

import pytest

from tests.places import ROOT

loader = SourceFileLoader("site_versions", str(ROOT / ".ci" / "versions"))
versions = module_from_spec(spec_from_loader(loader.name, loader))
loader.exec_module(versions)


@pytest.fixture
def add(tmp_path, monkeypatch):
    """`add(version)` builds a page that says the version and adds it; returns the folder."""
    monkeypatch.setattr(versions, "SITE", tmp_path / "site")
    (tmp_path / "site").mkdir()

    def added(version):
        (tmp_path / "site" / "index.html").write_text(version)
        versions.add(tmp_path / "all", version)
        return tmp_path / "all"

    return added


def shown(folder):
    entries = json.loads((folder / "versions.json").read_text())
    return {one["version"]: one["aliases"] for one in entries}


def test_the_newest_release_is_the_latest_whatever_is_published_last(add):
    for version in ("0.2.0", "0.10.0", "0.9.1", "dev"):
        folder = add(version)
    assert list(shown(folder)) == ["0.10.0", "0.9.1", "0.2.0", "dev"]
    assert shown(folder)["0.10.0"] == ["latest"]
    assert (folder / "latest" / "index.html").read_text() == "0.10.0"
    assert (folder / "0.2.0" / "index.html").read_text() == "0.2.0"


def test_dev_is_the_latest_before_the_first_release(add):
    assert shown(add("dev")) == {"dev": ["latest"]}
    folder = add("0.2.0")
    assert shown(folder) == {"0.2.0": ["latest"], "dev": []}
    assert (folder / "latest" / "index.html").read_text() == "0.2.0"


def test_a_version_that_is_published_again_is_replaced(add, tmp_path):
    (add("dev") / "dev" / "old.html").touch()
    assert not (add("dev") / "dev" / "old.html").exists()


def test_a_folder_that_is_no_version_is_refused(add):
    with pytest.raises(ValueError, match=r"got '\.\./x'; expected a release"):
        add("../x")
