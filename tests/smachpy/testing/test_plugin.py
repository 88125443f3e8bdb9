"""The plugin in test sessions of its own: fixtures, options, coverage, xdist."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

pytest_plugins = ["pytester"]

TESTS = """
import pytest
from smachpy import CBState, State, StateMachine

class Wait(State):
    def __init__(self):
        super().__init__(["done", "failed", "preempted"])
    def execute(self, ud):
        return "preempted" if self.sleep(10) else "done"

def machine():
    sm = StateMachine(["done", "failed", "preempted"], name="M")
    with sm:
        sm.add("A", Wait(), {"done": "B"})
        sm.add("B", Wait())
    return sm

def test_done(mission):
    mission(machine()).assert_outcome("done")

@pytest.mark.parametrize("state", ["A", "B"])
def test_preempt(mission, state):
    mission.preempt(on=state)
    mission(machine()).assert_outcome("preempted")
"""

OPTIONS = ["-p", "no:cacheprovider"]
ALIAS = "import sys; from smachpy.cli import main; sys.exit(main(sys.argv[1:]))"


def test_the_fixtures_need_no_conftest(pytester):
    pytester.makepyfile(TESTS)
    pytester.runpytest_inprocess(*OPTIONS).assert_outcomes(passed=3)


def test_a_failing_assertion_shows_the_diff_and_not_our_code(pytester):
    pytester.makepyfile(
        TESTS + "\n\ndef test_path(mission):\n    mission(machine()).assert_path(['B'])\n"
    )
    result = pytester.runpytest_inprocess(*OPTIONS)
    result.assert_outcomes(passed=3, failed=1)
    result.stdout.fnmatch_lines(
        ["*AssertionError: path (- expected, + got):", "*+ /M/A", "*picture: *M-1.svg"]
    )


def test_coverage_table_and_json(pytester):
    pytester.makepyfile(TESTS)
    result = pytester.runpytest_inprocess(
        *OPTIONS,
        "--mission-coverage",
        "--mission-coverage-json=c.json",
        "--mission-coverage-html=c.html",
    )
    assert result.ret == 0
    result.stdout.fnmatch_lines(
        ["*mission coverage*", "machine*runs*states*preempts*", "/M *3 *3/3*2/2*"]
    )
    result.stdout.fnmatch_lines(["*outcomes not run: */M/A -failed->*"])
    (machine,) = json.loads((pytester.path / "c.json").read_text())["machines"]
    assert machine["runs"] == 3
    assert machine["states"] == {
        "run": 3,
        "total": 3,
        "missed": [],
        "times": {"/M/A": 3, "/M/B": 2, "/M": 3},
    }
    assert machine["preempts"]["run"] == 2
    page = (pytester.path / "c.html").read_text()
    assert "<svg" in page
    assert "/M/A" in page


@pytest.mark.parametrize(("least", "code"), [(50, 0), (90, 1)])
def test_coverage_fail_under(pytester, least, code):
    pytester.makepyfile(TESTS)
    result = pytester.runpytest_inprocess(*OPTIONS, f"--mission-coverage-fail-under={least}")
    assert result.ret == code
    if code:
        result.stdout.fnmatch_lines(
            [f"FAIL mission coverage: /M: * %; expected at least {least} %"]
        )


def test_coverage_of_nothing_fails(pytester):
    pytester.makepyfile("def test_nothing(): pass")
    result = pytester.runpytest_inprocess(*OPTIONS, "--mission-coverage-fail-under=1")
    assert result.ret == 1
    result.stdout.fnmatch_lines(["no mission ran"])


def test_coverage_is_merged_over_workers(pytester):
    pytester.makepyfile(TESTS)
    result = pytester.runpytest_subprocess(
        *OPTIONS, "-n", "2", "--mission-coverage", "--mission-coverage-json=c.json"
    )
    assert result.ret == 0
    (machine,) = json.loads((pytester.path / "c.json").read_text())["machines"]
    assert machine["runs"] == 3
    assert machine["preempts"]["run"] == 2


def test_a_seed_for_all_missions(pytester):
    pytester.makepyfile(
        "def test_seed(mission):\n    assert mission.seed == mission.clock.seed == 7"
    )
    pytester.runpytest_inprocess(*OPTIONS, "--mission-seed=7").assert_outcomes(passed=1)


def test_unittest_runs_it(pytester):
    (pytester.path / "test_u.py").write_text(
        TESTS
        + "\nfrom smachpy.testing import MissionTestCase\n"
        + "class Test(MissionTestCase):\n"
        + "    def test(self):\n"
        + "        self.assertEqual(self.mission(machine()).duration, 20)\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "unittest", "test_u"],
        cwd=pytester.path,
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Ran 1 test" in done.stderr


def test_the_command_line_alias(pytester):
    pytester.makepyfile(test_m=TESTS)
    done = subprocess.run(
        [sys.executable, "-c", ALIAS, "test", "test_m.py", "-q", "-k", "done", *OPTIONS],
        cwd=pytester.path,
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )
    assert "1 passed" in done.stdout, done.stderr


def test_loading_the_plugin_loads_neither_network_nor_numbers():
    code = (
        "import sys, smachpy.testing.plugin\n"
        "heavy = {'zenoh', 'numpy', 'rosbags', 'smachpy.testing.kit', 'actionlib_core.node'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=50, check=True
    )
    assert done.stdout.strip() == "[]"
