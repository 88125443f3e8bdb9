"""What share of the lines the tests reach: the table of it, and its floors."""

from __future__ import annotations

import json
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader

import pytest

from tests.places import ROOT

loader = SourceFileLoader("coverage_table", str(ROOT / ".ci" / "coverage"))
coverage = module_from_spec(spec_from_loader(loader.name, loader))
loader.exec_module(coverage)


@pytest.fixture
def report(tmp_path):
    """`report({file: (lines, reached)})` writes what `coverage json` writes."""

    def written(files):
        path = tmp_path / "coverage.json"
        summaries = {
            file: {"summary": {"num_statements": lines, "covered_lines": reached}}
            for file, (lines, reached) in files.items()
        }
        path.write_text(json.dumps({"files": summaries}))
        return path

    return written


def test_the_table_has_a_line_for_each_package_and_its_rooms_from_the_lowest(report, capsys):
    files = {
        "smachpy/engine/run.py": (100, 99),
        "smachpy/engine/step.py": (100, 100),
        "smachpy/sim/robot.py": (1000, 929),
        "smachpy/__init__.py": (10, 10),
        "viz/smachpy_viz/live/app.py": (10, 10),
        "tests/conftest.py": (10, 0),
    }
    assert coverage.main(report(files)) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "| `smachpy` | 94 % | `sim` 92, `engine` 99, `.` 100 |" in lines
    assert "| `smachpy_viz` | 100 % | `live` 100 |" in lines
    assert len(lines) == 2 + len(coverage.PACKAGES)


def test_less_than_the_floor_is_refused_and_says_where_to_look(report, capsys):
    assert coverage.main(report({"actionlib_core/goal/states.py": (1000, 500)})) == 1
    (problem,) = capsys.readouterr().err.splitlines()
    floor = coverage.FLOORS["actionlib_core"]
    assert problem.startswith(
        f"coverage: actionlib_core: got 50 % of the lines; expected at least {floor}"
    )
