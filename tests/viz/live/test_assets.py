"""What the page is made of: each module is found by the name that others import, and is in the wheel."""

from __future__ import annotations

import fnmatch
import re
import tomllib
from pathlib import Path

import pytest

from viz.live import assets

ROOT = Path(__file__).parents[3]


def settings():
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)["tool"]["setuptools"]


def test_every_module_that_is_imported_is_in_the_import_map():
    imported = set()
    for name in assets.SCRIPTS:
        text = (assets.WEB / name).read_text(encoding="utf-8")
        imported |= set(re.findall(r'^(?:import|export) (?:[^"]* from )?"([^"]+)";', text, re.M))
    assert "#core/fold.js" in imported
    assert imported <= set(assets.MODULES)


def test_every_file_of_the_page_is_served_and_in_the_wheel():
    patterns = settings()["package-data"]["viz.web"]
    for name in assets.FILES:
        assert assets.read(name) == (assets.WEB / name).read_bytes()
        assert any(
            fnmatch.fnmatch(name, one) and name.count("/") == one.count("/") for one in patterns
        ), name


def test_the_development_tools_are_not_in_the_wheel():
    excluded = settings()["packages"]["find"]["exclude"]
    for folder in ("viz.web.node_modules.typescript", "viz.web.js.test"):
        assert any(fnmatch.fnmatch(folder, one) for one in excluded)


@pytest.mark.parametrize(
    "name",
    [
        "package.json", "types.d.ts", "js/test/fold.test.js", "js/test/fixtures.js", "index.html",
        "node_modules/preact/dist/preact.js", "../live/app.py", "js/../app.css", "js", "", "\0",
    ],
)  # fmt: skip
def test_nothing_else_is_served(name):
    assert assets.read(name) is None


def test_one_file_holds_every_module():
    page = assets.standalone({"snap": {}, "model": {}}, "a <run>")
    assert "a &lt;run&gt;" in page
    for name in assets.MODULES:
        assert f'"{name}": "data:text/javascript;base64,' in page
    assert "/js/" not in page.partition("<body")[0]
