"""Each configuration that a page of docs shows can be read."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from actionlib_core.config import load_config
from tests.places import DOCS

FILE = re.compile(r"<!-- file: (\S+) -->\n+```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", ["deployments.md", "howto/secure.md", "howto/certificates.md"])
def test_configurations_can_be_read(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = dict(FILE.findall((DOCS / page).read_text()))
    for name, text in files.items():
        Path(name).write_text(text)
    found = [name for name, text in files.items() if re.search("^mode: ", text, re.MULTILINE)]
    for name in found:
        text = files[name]
        for needed in re.findall(r"(?:ca|certificate|key): (\S+)", text):
            Path(needed).touch()
        assert load_config(name).mode in {"router", "client"}
    assert len(found) >= 3
