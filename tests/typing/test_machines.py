"""What mypy --strict and pyright say about programs with machines."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent / "machines"


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_good_programs_pass_and_each_mistake_is_found():
    from mypy import api

    good, bad = HERE / "good.py", HERE / "bad.py"
    out, err, _ = api.run(
        ["--strict", "--no-error-summary", "--hide-error-context", str(good), str(bad)]
    )
    assert not err
    found = {
        (Path(name).name, int(line), code)
        for name, line, code in re.findall(r"^(\S+?):(\d+): error: .*\[([\w-]+)\]$", out, re.M)
    }
    wanted = {
        ("bad.py", number, code)
        for number, line in enumerate(bad.read_text().splitlines(), 1)
        for code in re.findall(r"# error: ([\w-]+)$", line)
    }
    assert found == wanted, out


def pyright(*words, folder):
    """Return what pyright reports: triples of file, line and text; warnings count, too."""
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable, *words],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=800,
    )
    found = json.loads(done.stdout[done.stdout.index("{") :])["generalDiagnostics"]
    return {
        (Path(one["file"]).name, one["range"]["start"]["line"] + 1, one["message"])
        for one in found
        if one["severity"] != "information"
    }


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_pyright_finds_the_same_mistakes_and_no_others(tmp_path):
    """An editor shows its warnings, too: messages have no source file but are no mistake."""
    good, bad = HERE / "good.py", HERE / "bad.py"

    found = pyright(str(good), str(bad), folder=tmp_path)

    wanted = {
        (bad.name, number)
        for number, line in enumerate(bad.read_text().splitlines(), 1)
        if "# error: " in line
    }
    assert {(file, line) for file, line, _ in found} == wanted, found


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_stubs_of_own_interfaces_pass_pyright(tmp_path):
    for name, text in {
        "srv/Ask.srv": "string a\n---\nstring b\n",
        "action/Count.action": "int32 n\n---\nint32 m\n---\nint32 k\n",
        "msg/Names.msg": "string[] names\ntime when\n",
    }.items():
        file = tmp_path / "my_pkg" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    subprocess.run(
        [Path(sys.executable).with_name("actionlib"), "interface", "stubs", "typings"],
        cwd=tmp_path,
        env={**os.environ, "SMACHPY_INTERFACE_PATH": "."},
        check=True,
        capture_output=True,
    )

    assert pyright("typings", folder=tmp_path) == set()
