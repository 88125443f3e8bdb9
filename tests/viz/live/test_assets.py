"""The page's files: built from the sources in the tree, served by name, and put into one file."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from pathlib import Path

import pytest

from smachpy_viz.live import assets

SOURCES = Path(__file__).parents[3] / "viz" / "web"
BUILT = json.loads((assets.WEB / "built.json").read_text(encoding="utf-8"))


def test_the_page_is_built_from_the_sources_in_the_tree():
    """`.ci/web lint` builds it and compares the bytes; this needs no Node.js."""
    files = [path for top in ("src", "styles") for path in (SOURCES / top).rglob("*")]
    names = {path.relative_to(SOURCES).as_posix() for path in files if path.is_file()}
    digest = hashlib.sha256()
    for name in sorted({*names, "build.mjs", "package-lock.json"}):
        digest.update(f"{name}\n".encode() + (SOURCES / name).read_bytes())
    assert BUILT["sources"] == digest.hexdigest(), "viz/web was changed. Try make web"


def test_no_built_file_was_changed():
    hashes = {name: hashlib.sha256(assets.read(name)).hexdigest() for name in assets.FILES}
    assert hashes == BUILT["built"]


def test_the_page_is_small():
    import gzip

    own = [name for name in assets.FILES if name != "elk-worker.js"]
    assert sum(len(gzip.compress(assets.read(name))) for name in own) < 400_000


def test_every_package_has_a_licence_beside_it():
    for package in BUILT["packages"]:
        short = package["name"].rpartition("/")[2]
        assert assets.read(f"licences/{short}.LICENSE.txt"), package
        assert re.fullmatch(r"[\d.]+", package["version"])


@pytest.mark.parametrize(
    "name",
    ["index.html", "built.json", "__init__.py", "../live/app.py", "licences/../page.css", "licences", "", "\0"],
)  # fmt: skip
def test_nothing_else_is_served(name):
    assert assets.read(name) is None


def test_one_file_holds_everything_and_lets_nothing_else_run():
    page = assets.standalone({"snap": {}, "model": {}}, "a <run>")
    assert "a &lt;run&gt;" in page
    head = page.partition("<body")[0]
    assert not re.findall(r"""(?:src|href)=["']/|url\(["']?/""", head.partition("<script")[0])
    scripts = re.findall(r'<script type="module">(.*?)</script>', head, re.DOTALL)
    assert len(scripts) == 1
    digest = base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}' blob:;" in head
    for name in ("elk", "film", "run"):
        assert f'id="{name}-data"' in head
