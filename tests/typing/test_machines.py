"""What mypy --strict says about programs with machines."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

HERE = Path(__file__).parent / "machines"


@pytest.mark.slow
@pytest.mark.timeout(180)
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
